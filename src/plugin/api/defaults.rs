//! What editors and remote tools fill in where they leave a field out: without a default the engine's reflection would panic. The entity is one
//! that does not exist, so that an event without an entity is about nothing.

use super::{
    AnalogyFailed, AnalogyMade, CellClosed, CrackBaked, CrackChip, CrackError, CrackFailed, CrackFinished, CrackHit,
    CrackShards, HitPoint, Reassembled, ReliefFailed, ReliefMade, Shard, Shattered,
};
use crate::shatter::Shards;
use bevy::prelude::*;
use std::sync::Arc;

const NOBODY: Entity = Entity::PLACEHOLDER;

impl Default for CrackHit {
    /// The middle of nothing, energy 1.
    fn default() -> Self {
        Self::uv(NOBODY, Vec2::splat(0.5))
    }
}

impl Default for HitPoint {
    /// The middle of the picture.
    fn default() -> Self {
        Self::Uv(Vec2::splat(0.5))
    }
}

impl Default for CrackChip {
    fn default() -> Self {
        Self { surface: NOBODY }
    }
}

impl Default for CrackFinished {
    fn default() -> Self {
        Self { entity: NOBODY }
    }
}

impl Default for Reassembled {
    fn default() -> Self {
        Self { entity: NOBODY }
    }
}

impl Default for CellClosed {
    fn default() -> Self {
        Self { entity: NOBODY, cell: 0, area: 0.0, uv: Vec2::ZERO }
    }
}

impl Default for CrackFailed {
    fn default() -> Self {
        Self { entity: NOBODY, error: CrackError::NothingToCrack }
    }
}

impl Default for CrackBaked {
    fn default() -> Self {
        Self { entity: NOBODY, covered: None }
    }
}

impl Default for ReliefMade {
    fn default() -> Self {
        Self { entity: NOBODY }
    }
}

impl Default for ReliefFailed {
    fn default() -> Self {
        Self { entity: NOBODY, error: CrackError::NothingToCrack }
    }
}

impl Default for AnalogyMade {
    fn default() -> Self {
        Self { entity: NOBODY }
    }
}

impl Default for AnalogyFailed {
    fn default() -> Self {
        Self { entity: NOBODY, error: CrackError::NothingToCrack }
    }
}

impl Default for Shattered {
    fn default() -> Self {
        Self { entity: NOBODY, shards: Vec::new(), rest: 0 }
    }
}

impl Default for Shard {
    fn default() -> Self {
        Self {
            surface: NOBODY,
            pieces: Arc::new(Shards::default()),
            number: 0,
            velocity: Vec3::ZERO,
            spin: Vec3::ZERO,
            scale: Vec2::ONE,
            piece: [0; 2],
        }
    }
}

impl Default for CrackShards {
    fn default() -> Self {
        Self { pieces: Arc::new(Shards::default()), gone: 0, shown: 0, time: 0.0 }
    }
}
