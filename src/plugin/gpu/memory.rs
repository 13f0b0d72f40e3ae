//! [`TextureMemory`]: the memory that textures take.

use bevy::prelude::*;
use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

/// Bytes of all textures of the crate, on the CPU and the GPU.
#[derive(Resource, Default)]
pub(crate) struct TextureMemory(Arc<AtomicU64>);

/// Bytes of some textures. They count until this is dropped.
pub(crate) struct TextureBytes {
    bytes: u64,
    total: Arc<AtomicU64>,
}

impl TextureMemory {
    /// Bytes in use.
    pub(crate) fn used(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    /// Counts some textures.
    pub(crate) fn count(&self, bytes: u64) -> TextureBytes {
        self.0.fetch_add(bytes, Ordering::Relaxed);
        TextureBytes { bytes, total: self.0.clone() }
    }
}

impl TextureBytes {
    /// How many they are.
    pub(crate) const fn get(&self) -> u64 {
        self.bytes
    }
}

impl Drop for TextureBytes {
    fn drop(&mut self) {
        self.total.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_dropped_does_not_count() {
        let memory = TextureMemory::default();
        let mut kept = memory.count(7);
        drop(memory.count(100));
        assert_eq!((memory.used(), kept.get()), (7, 7));
        kept = memory.count(5);
        assert_eq!((memory.used(), kept.get()), (5, 5));
    }
}
