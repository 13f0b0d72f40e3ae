//! [`CrackSystems`]: the stages of a frame.

use bevy::prelude::*;

/// The stages of a frame, in order, in `PostUpdate`, all but the first after transforms are propagated and before asset events.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// /// Dust in the frame of the crack, not in the one after it.
/// fn dust(walls: Query<&CrackState, Changed<CrackState>>) {
///     for state in &walls {
///         info!("{} tips", state.tips.len());
///     }
/// }
///
/// App::new().add_plugins(CrackPlugins).add_systems(PostUpdate, dust.after(CrackSystems::Paint));
/// ```
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CrackSystems {
    /// After this set, which comes before transforms are propagated, shards are where they belong in this frame.
    Shatter,
    /// After this set, every hit of this frame is queued, and as many as the budget allows are in their growths.
    Hit,
    /// After this set, networks have made the steps that are due, as many as the budget allows.
    Grow,
    /// After this set, changed texels are painted on the CPU, as many surfaces as the budget allows.
    Paint,
    /// After this set, the rectangles to upload are handed to the render world.
    Upload,
}
