//! The camera that draws the panel.

use bevy::{camera::RenderTarget, prelude::*, window::WindowRef};
use bevy_egui::{EguiGlobalSettings, PrimaryEguiContext};

/// Whether egui would choose the camera by itself.
pub(super) fn is_open_to_choice(settings: Option<Res<EguiGlobalSettings>>) -> bool {
    settings.is_some_and(|settings| settings.auto_create_primary_context)
}

/// Chooses the camera. Egui takes the first that it finds, and of several that are spawned in one frame that may be any, also one with
/// a small part of the window for itself.
pub(super) fn choose_camera(
    mut commands: Commands,
    mut settings: ResMut<EguiGlobalSettings>,
    cameras: Query<(Entity, &Camera, &RenderTarget)>,
    chosen: Query<(), With<PrimaryEguiContext>>,
) {
    let suits = |(entity, camera, target): &(Entity, &Camera, &RenderTarget)| {
        let is_window = matches!(target, RenderTarget::Window(WindowRef::Primary));
        // What is drawn last is above all else.
        (is_window, camera.is_active, camera.viewport.is_none(), camera.order, *entity)
    };
    if chosen.is_empty() {
        let Some((camera, ..)) = cameras.iter().max_by_key(suits) else { return };
        commands.entity(camera).insert(PrimaryEguiContext);
    }
    settings.auto_create_primary_context = false;
}
