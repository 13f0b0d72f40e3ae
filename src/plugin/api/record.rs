//! [`CrackRecord`]: what has happened to a surface, for saved games and replays.

use super::{BakeProgress, CrackError};
use crate::growth::{Past, PastEvent};
use bevy::prelude::*;
use serde::{Deserialize, Serialize};

/// What has happened to a surface: saved with a game, it brings back the same cracks, bit for bit, also those that were still growing.
///
/// [`CrackRecords`](super::super::CrackRecords) makes one of a surface. Put on an entity with a [`CrackSurface`](super::CrackSurface) it is taken
/// up: a background task grows the cracks again, [`BakeProgress`] tells how far it is, and it ends with exactly one of
/// [`CrackBaked`](super::CrackBaked) and [`CrackFailed`](super::CrackFailed), and without the component. Hits that the surface has had before, or gets
/// meanwhile, come after those of the record: heal it first if it has cracked already.
///
/// It is a list of hits, so it is small, and the preset, the picture, the components [`CrackClock`](super::CrackClock) and
/// [`GuidedCracks`](super::GuidedCracks) (whose cracks are made first), and the version of the crate must be the same. Not in it are
/// shards that have left, hits that still wait, and changes of the preset between hits.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// /// All walls as text for a file.
/// fn save(walls: Query<(Entity, &Name), With<CrackSurface>>, records: CrackRecords) -> Result<String> {
///     let walls: Vec<(String, CrackRecord)> =
///         walls.iter().filter_map(|(wall, name)| Some((name.to_string(), records.get(wall)?))).collect();
///     Ok(serde_json::to_string(&walls)?)
/// }
///
/// /// The walls of a level that has just been spawned.
/// fn load(In(text): In<String>, walls: Query<(Entity, &Name)>, mut commands: Commands) -> Result {
///     let records: Vec<(String, CrackRecord)> = serde_json::from_str(&text)?;
///     for (name, record) in records {
///         if let Some((wall, _)) = walls.iter().find(|(_, other)| other.as_str() == name) {
///             commands.entity(wall).insert(record);
///         }
///     }
///     Ok(())
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[require(BakeProgress)]
pub struct CrackRecord {
    /// [`VERSION`](Self::VERSION) of the crate that made it.
    pub version: u32,
    /// The surface's [`seed`](super::CrackSurface::seed), which it gets again.
    pub seed: u64,
    /// Hits and steps of growth.
    pub past: Past,
    /// Steps that have passed, with their fraction: what a [`CrackClock`](super::CrackClock) shows goes on from there, and so does growth.
    pub time: f64,
    /// Where its mesh was first hit, in its own space, if that was laid out ([`CrackUnwrap`](super::CrackUnwrap)): it is laid out around that point
    /// again.
    #[serde(default)]
    pub around: Option<Vec3>,
}

impl Default for CrackRecord {
    fn default() -> Self {
        Self {
            version: Self::VERSION,
            seed: 0,
            past: Past { extent: Vec2::ONE, ..Past::default() },
            time: 0.0,
            around: None,
        }
    }
}

impl CrackRecord {
    /// Records of other versions are refused: their cracks would be others.
    pub const VERSION: u32 = 1;

    /// Checks it.
    ///
    /// # Errors
    /// [`CrackError::Record`] if it was made by another version, or cannot be the past of a surface, see [`Past::validate`].
    pub fn validate(&self) -> Result<(), CrackError> {
        if self.version != Self::VERSION {
            let reason = format!("its version is {}, this crate's {}", self.version, Self::VERSION);
            return Err(CrackError::Record { reason });
        }
        if !self.time.is_finite() || self.time < 0.0 {
            return Err(CrackError::Record { reason: format!("its time is {}, must be 0 or more", self.time) });
        }
        if self.around.is_some_and(|around| !around.is_finite()) {
            return Err(CrackError::Record {
                reason: "the point around which its mesh was laid out is not finite".to_owned(),
            });
        }
        self.past.validate().map_err(|error| CrackError::Record { reason: error.to_string() })
    }

    /// Its hits: places (pattern units) and energies, in order.
    ///
    /// ```
    /// use bevy::prelude::*;
    /// use bevy_crack::{growth::PastEvent, prelude::*};
    ///
    /// let mut record = CrackRecord::default();
    /// record.past.events = vec![PastEvent::Hit { after: 0, pos: Vec2::splat(0.5), energy: 2.0 }];
    /// assert_eq!(record.hits().last(), Some((Vec2::splat(0.5), 2.0)));
    /// assert!(record.validate().is_ok());
    /// record.version += 1;
    /// assert!(record.validate().is_err());
    /// ```
    pub fn hits(&self) -> impl DoubleEndedIterator<Item = (Vec2, f32)> + '_ {
        self.past.events.iter().filter_map(|event| match event {
            PastEvent::Hit { pos, energy, .. } => Some((*pos, *energy)),
            PastEvent::Removal { .. } => None,
        })
    }
}
