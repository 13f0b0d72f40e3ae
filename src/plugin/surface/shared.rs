//! [`Shared`]: a value that tasks read while the frames keep it.

use core::ops::{Deref, DerefMut};
use std::sync::Arc;

/// A value that tasks may read. Changing it while one does copies it first.
pub(crate) struct Shared<T>(Arc<T>);

impl<T> Shared<T> {
    pub(crate) fn new(value: T) -> Self {
        Self(Arc::new(value))
    }

    /// The value, for a task.
    pub(crate) fn share(&self) -> Arc<T> {
        self.0.clone()
    }
}

impl<T> Deref for Shared<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T: Clone> DerefMut for Shared<T> {
    fn deref_mut(&mut self) -> &mut T {
        Arc::make_mut(&mut self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a task reads does not change, and nothing is copied when none reads.
    #[test]
    fn changes_do_not_reach_tasks() {
        let place = |own: &Shared<[i32; 2]>| core::ptr::from_ref(&**own);
        let mut own = Shared::new([1, 2]);
        let first = place(&own);
        own[0] = 3;
        assert_eq!(place(&own), first, "nobody else reads it");
        let read = own.share();
        own[1] = 4;
        assert_eq!((*read, *own), ([3, 2], [3, 4]));
        drop(read);
        let second = place(&own);
        own[0] = 5;
        assert_eq!((*own, place(&own)), ([5, 4], second), "nobody reads it any more");
    }
}
