//! [`CrackRecords`]: surfaces are recorded.

use crate::plugin::api::CrackRecord;
use crate::plugin::surface::cracked::Cracked;
use bevy::{ecs::entity_disabling::Disabled, ecs::query::Allow, ecs::system::SystemParam, prelude::*};

/// Records what has happened to surfaces, for saved games and replays: a parameter for systems, see [`CrackRecord`].
#[derive(SystemParam)]
pub struct CrackRecords<'w, 's> {
    surfaces: Query<'w, 's, &'static Cracked, Allow<Disabled>>,
}

impl CrackRecords<'_, '_> {
    /// What has happened to a surface so far; `None` if it has no cracks, or was hit more often than
    /// [`Past::MAX_EVENTS`](crate::growth::Past::MAX_EVENTS) times since it was healed.
    #[must_use]
    pub fn get(&self, surface: Entity) -> Option<CrackRecord> {
        self.surfaces.get(surface).ok()?.get()?.record()
    }
}
