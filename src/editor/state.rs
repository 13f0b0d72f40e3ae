//! [`CrackEditor`]: what the workbench shows.

use super::{history::History, overlay::Flash, panel::Panel};
use bevy::{prelude::*, tasks::Task};

/// The state of the workbench. A game may choose a surface, open the panel or set an energy.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::{editor::{CrackEditor, Overlays}, prelude::*};
///
/// /// Opens the panel for a wall, with its network drawn over it.
/// fn inspect(mut editor: ResMut<CrackEditor>, wall: Single<Entity, With<CrackSurface>>) {
///     editor.is_open = true;
///     editor.chosen = Some(*wall);
///     editor.panel.overlays = Overlays { network: true, ..default() };
/// }
/// # bevy::ecs::system::assert_is_system(inspect);
/// ```
#[derive(Resource, Default)]
pub struct CrackEditor {
    /// Whether the panel is shown.
    pub is_open: bool,
    /// The key that shows and hides it.
    pub key: Option<KeyCode>,
    /// The surface whose settings are shown.
    pub chosen: Option<Entity>,
    /// Tools, overlays and drafts.
    pub panel: Panel,
    pub(super) history: History,
    /// A press that has not been let go.
    pub(super) aim: Option<Aim>,
    /// Rectangles that were painted lately.
    pub(super) flashes: Vec<Flash>,
    /// Files that are being written: what to say of each in the end.
    pub(super) exports: Vec<Task<String>>,
}

/// A hit that is being aimed.
#[derive(Clone, Copy)]
pub(super) struct Aim {
    pub(super) surface: Entity,
    /// In the world.
    pub(super) point: Vec3,
    /// Where the pointer was, logical pixels.
    pub(super) from: Vec2,
}
