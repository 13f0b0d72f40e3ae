//! [`Threads`]: whether background tasks have threads of their own.

use bevy::{prelude::*, tasks::AsyncComputeTaskPool};

/// Whether background tasks run on threads that do not stop the frames.
#[derive(Resource, Default)]
pub(crate) struct Threads {
    /// Whether tasks turned out to run where they are started.
    pub(crate) are_missing: bool,
}

impl Threads {
    /// What tasks run on that do not stop the frames.
    pub(crate) fn pool(&self) -> Option<&'static AsyncComputeTaskPool> {
        AsyncComputeTaskPool::try_get().filter(|_| !self.are_missing)
    }
}
