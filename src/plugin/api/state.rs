//! [`CrackState`]: how a surface is doing.

use super::CrackError;
use bevy::prelude::*;

/// How a surface is doing. Written by the crate, read by games.
///
/// Damage, time, tips and the end are written in [`CrackSystems::Paint`](super::CrackSystems::Paint), the status also in the sets before it, all
/// in `PostUpdate`: a system in `Update` reads what was so at the end of the frame before. Healing sets it back at once.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// fn describe(walls: Query<(NameOrEntity, &CrackState)>) {
///     for (wall, state) in &walls {
///         match &state.status {
///             CrackStatus::Untouched | CrackStatus::Waiting => {}
///             CrackStatus::Growing => info!("{wall} cracks in {} places", state.tips.len()),
///             CrackStatus::Done => info!("{wall}: {:.0} % damage", 100.0 * state.damage),
///             CrackStatus::Failed(error) => warn!("{wall} cannot crack: {error}"),
///         }
///     }
/// }
///
/// /// The sound of the longest crack of this frame.
/// fn creak(walls: Query<&CrackState>) {
///     let tips = walls.iter().flat_map(|state| &state.tips);
///     if let Some(CrackTip { length, .. }) = tips.max_by(|a, b| a.length.total_cmp(&b.length)) {
///         info!("{length} pattern units");
///     }
/// }
///
/// // The same as events.
/// fn cut_out(cell: On<CellClosed>) {
///     info!("a piece of {} pattern units squared is loose in {}", cell.area, cell.entity);
/// }
///
/// fn finished(finished: On<CrackFinished>, mut commands: Commands) {
///     commands.entity(finished.entity).close_cracks(5.0);
/// }
///
/// fn failed(failed: On<CrackFailed>) {
///     match &failed.error {
///         CrackError::TextureBudget { needed, left } => warn!("{needed} bytes, {left} are left"),
///         error => error!("{} cannot crack: {error}", failed.entity),
///     }
/// }
/// # bevy::ecs::system::assert_is_system(describe);
/// # bevy::ecs::system::assert_is_system(creak);
/// # let mut world = World::new();
/// # world.add_observer(cut_out);
/// # world.add_observer(finished);
/// # world.add_observer(failed);
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default)]
#[component(clone_behavior = Ignore)]
pub struct CrackState {
    /// What it is at.
    pub status: CrackStatus,
    /// Share of the surface's tiles of 8 x 8 texels that a crack has touched, 0..=1.
    ///
    /// One ordinary hit on a square of 512 x 512 gives 0.1 to 0.25 where cracks run out from it (glass, concrete, plaster, ice; brick and toon
    /// less), and 0.4 to 0.9 where they come everywhere (tempered glass, clay, mud, glaze). Tiles being of texels, it is more on coarser textures.
    pub damage: f32,
    /// Nodes of the crack network, at most [`max_nodes`](crate::growth::GrowthParams::max_nodes).
    pub nodes: u32,
    /// Nodes that were taken out of it to make room for the cracks of later hits: the oldest cracks stay in the picture, but nothing
    /// grows from them any more or stops at them, and they go when time is turned back.
    pub frozen: u32,
    /// Hits that started or fed a crack.
    pub hits: u32,
    /// What of the cracks is shown: as they were after this many steps, with fractions; below [`end`](Self::end) only under a
    /// [`CrackClock`](super::CrackClock) or while they close.
    pub time: f32,
    /// Number of steps that the cracks have grown.
    pub end: f32,
    /// Closed cells of what is shown: parts of the surface that cracks and border enclose.
    pub cells: u32,
    /// Where cracks grew in the last frame they grew in (for sound and dust); empty when done. At most
    /// [`MAX_TIPS`](Self::MAX_TIPS).
    pub tips: Vec<CrackTip>,
}

impl CrackState {
    /// The most tips that are listed.
    pub const MAX_TIPS: usize = 256;
}

/// What a surface is at.
#[derive(Reflect, Clone, Debug, Default, PartialEq)]
#[type_path = "bevy_crack"]
pub enum CrackStatus {
    /// Not hit yet, or healed.
    #[default]
    Untouched,
    /// Hit, but its picture is still loading, or its textures are being made, which takes some frames if they are large. The hits wait.
    Waiting,
    /// Cracks are growing, or a clock has not shown their end yet.
    Growing,
    /// Cracks have come to an end and were shown whole, until the next hit. A clock may show less of them since.
    Done,
    /// It cannot crack.
    Failed(CrackError),
}

/// The end of a growing crack.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[type_path = "bevy_crack"]
pub struct CrackTip {
    /// Texture coordinates in the surface's picture or sprite frame, 0..=1, v down.
    pub uv: Vec2,
    /// Direction of growth in the same axes, a unit vector in pattern space.
    pub direction: Vec2,
    /// How far it has grown in this frame, pattern units (the surface's shorter side is 1).
    pub length: f32,
}

/// Cracks have closed a cell: a piece that could fall. Told when the crack that closes it is shown for the first time.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Event, Default)]
pub struct CellClosed {
    /// The surface.
    pub entity: Entity,
    /// Number of the cell, from 1; see [`CellTracker`](crate::pattern::CellTracker).
    pub cell: u32,
    /// Its area, pattern units squared (the surface's shorter side is 1).
    pub area: f32,
    /// Its centre, texture coordinates in the surface's picture or sprite frame, 0..=1, v down.
    pub uv: Vec2,
}

/// The cracks of a surface have come to an end, and all of them are shown: once after a hit, however often a
/// [`CrackClock`](super::CrackClock) runs over the end. A hit that widens what is there already is one of them: under hammering this
/// comes again and again.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Event, Default)]
pub struct CrackFinished {
    /// The surface.
    pub entity: Entity,
}

/// A surface cannot crack; the hits that waited on it are rejected.
#[derive(EntityEvent, Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Event, Default)]
pub struct CrackFailed {
    /// The surface.
    pub entity: Entity,
    /// Why.
    pub error: CrackError,
}
