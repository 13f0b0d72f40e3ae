//! [`Owners`]: which assets belong to which surface.

use super::active::Active;
use bevy::{asset::UntypedAssetId, platform::collections::HashMap, prelude::*};

/// Which assets surfaces own, and which they were made from.
#[derive(Resource, Default)]
pub(crate) struct Owners {
    /// The surface of a private image, material or mesh.
    owners: HashMap<UntypedAssetId, Entity>,
    /// The surfaces that were made from a picture.
    users: HashMap<AssetId<Image>, Vec<Entity>>,
}

impl Owners {
    /// Notes which assets a surface owns and which it was made from.
    pub(super) fn add(&mut self, entity: Entity, active: &Active) {
        self.owners.extend(active.owned().map(|id| (id, entity)));
        for source in active.sources() {
            let users = self.users.entry(source).or_default();
            if !users.contains(&entity) {
                users.push(entity);
            }
        }
    }

    /// Takes back what [`add`](Self::add) has noted.
    pub(super) fn remove(&mut self, entity: Entity, active: &Active) {
        for id in active.owned() {
            self.owners.remove(&id);
        }
        for source in active.sources() {
            if let Some(users) = self.users.get_mut(&source) {
                users.retain(|user| *user != entity);
                if users.is_empty() {
                    self.users.remove(&source);
                }
            }
        }
    }

    /// The surface that owns an asset.
    pub(crate) fn owner(&self, asset: UntypedAssetId) -> Option<Entity> {
        self.owners.get(&asset).copied()
    }

    /// Whether any surface owns anything.
    pub(crate) fn has_any(&self) -> bool {
        !self.owners.is_empty()
    }

    /// The surfaces that were made from a picture.
    pub(crate) fn users(&self, picture: AssetId<Image>) -> &[Entity] {
        self.users.get(&picture).map_or(&[], Vec::as_slice)
    }
}
