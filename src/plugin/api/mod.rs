//! Everything that a game sees: components, events, resources. Types, no systems.

pub(crate) mod analogy;
pub(crate) mod budget;
pub(crate) mod chips;
pub(crate) mod clock;
mod defaults;
pub(crate) mod error;
#[cfg(any(feature = "2d", feature = "3d"))]
pub(crate) mod group;
pub(crate) mod guided;
pub(crate) mod hit;
pub(crate) mod mask;
pub(crate) mod preset;
pub(crate) mod record;
mod reflect;
pub(crate) mod relief;
pub(crate) mod script;
pub(crate) mod shatter;
pub(crate) mod state;
pub(crate) mod strands;
pub(crate) mod surface;
pub(crate) mod systems;
pub(crate) mod textures;

pub use analogy::{AnalogyExamples, AnalogyFailed, AnalogyMade, AnalogyProgress, CrackAnalogy};
pub use budget::{CrackBudget, CrackStats, CrackUploadStats};
pub use chips::{CrackChip, CrackChips};
pub use clock::{CrackClock, CrackDrive};
pub use error::CrackError;
#[cfg(any(feature = "2d", feature = "3d"))]
pub use group::{CrackGroup, CrackMemberOf};
pub use guided::{BakeProgress, CrackBaked, CrackGuide, GuideSource, GuidedAppearance, GuidedCracks};
pub use hit::{CrackHit, HitPoint};
pub use mask::CrackMaskSource;
pub use preset::PresetSource;
pub use record::CrackRecord;
pub use relief::{CrackRelief, ReliefFailed, ReliefMade, ReliefProgress};
pub use script::{CrackScript, ScriptedHit};
pub use shatter::{
    CrackShards, GravitySpace, Reassembled, Shard, ShardsError, ShatterCracks, ShatterFailed, ShatterRequest,
    ShatterWhen, Shattered,
};
pub use state::{CellClosed, CrackFailed, CrackFinished, CrackState, CrackStatus, CrackTip};
pub use strands::{CrackStrands, StrandField};
pub use surface::{CrackMaps, CrackMips, CrackResolution, CrackSurface, CrackUnwrap};
pub use systems::CrackSystems;
pub use textures::CrackTextures;
