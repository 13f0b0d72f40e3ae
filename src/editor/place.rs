//! The camera that draws the panel.

use bevy::{camera::RenderTarget, ecs::schedule::ScheduleLabel, prelude::*, window::WindowRef};
use bevy_egui::{EguiPrimaryContextPass, EguiSchedule, PrimaryEguiContext};

/// Whether there is no camera that draws the panel: egui allows one for each schedule.
pub(super) fn has_no_camera(schedules: Query<&EguiSchedule>) -> bool {
    let primary = EguiPrimaryContextPass.intern();
    schedules.iter().all(|schedule| schedule.0 != primary)
}

/// Chooses the camera, where none draws it. Egui by itself takes the first that it finds, and of several that are spawned in one frame that
/// may be any, also one with a small part of the window for itself; when that has gone, it takes no other.
pub(super) fn choose_camera(mut commands: Commands, cameras: Query<(Entity, &Camera, &RenderTarget)>) {
    let suits = |(entity, camera, target): &(Entity, &Camera, &RenderTarget)| {
        let is_window = matches!(target, RenderTarget::Window(WindowRef::Primary));
        // What is drawn last is above all else.
        (is_window, camera.is_active, camera.viewport.is_none(), camera.order, *entity)
    };
    if let Some((camera, ..)) = cameras.iter().max_by_key(suits) {
        commands.entity(camera).insert(PrimaryEguiContext);
    }
}
