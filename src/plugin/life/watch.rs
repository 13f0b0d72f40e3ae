//! Changes from outside: other presets, other pictures, another frame of an animation.

use crate::CrackPreset;
use crate::plugin::api::{CrackSurface, CrackTextures, PresetSource};
use crate::plugin::bake::work::Bakes;
use crate::plugin::source::mask::PictureMasks;
use crate::plugin::source::picture::{BasePictures, FrameCount};
use crate::plugin::surface::cracked::CrackedSurfaces;
use crate::plugin::surface::owners::Owners;
use crate::plugin::surface::prepare::Preparations;
use crate::plugin::surface::queues::Queues;
use crate::plugin::surface::reread::Rereadings;
use bevy::prelude::*;

/// Notes the cracked surfaces whose settings have changed.
pub(crate) fn watch_surfaces(
    changed: Query<Entity, (Changed<CrackSurface>, With<CrackTextures>)>,
    mut queues: ResMut<Queues>,
) {
    queues.changed.extend(&changed);
}

/// Notes the cracked surfaces whose sprite or material slot has changed.
#[cfg(any(feature = "2d", feature = "3d"))]
pub(crate) fn watch<C: Component>(
    changed: Query<Entity, (Changed<C>, With<CrackTextures>)>,
    mut queues: ResMut<Queues>,
) {
    queues.changed.extend(&changed);
}

/// Notes the cracked surfaces whose original pictures have changed.
pub(crate) fn watch_pictures(
    events: Option<MessageReader<AssetEvent<Image>>>,
    mut surfaces: CrackedSurfaces,
    owners: Res<Owners>,
    mut queues: ResMut<Queues>,
    mut frame: ResMut<FrameCount>,
    mut masks: ResMut<PictureMasks>,
    mut bases: ResMut<BasePictures>,
    mut bakes: ResMut<Bakes>,
    mut preparations: ResMut<Preparations>,
    mut readings: ResMut<Rereadings>,
) {
    let frame = &mut frame.0;
    *frame += 1;
    readings.trim();
    masks.trim();
    let Some(mut events) = events else { return };
    let mut removed = Vec::new();
    for event in events.read() {
        let (id, before) = match event {
            AssetEvent::Modified { id } => (id, *frame),
            // Who has read it in the frame in which it came has read what came, unless it came back.
            AssetEvent::Added { id } => (id, if removed.contains(id) { *frame } else { *frame - 1 }),
            AssetEvent::Removed { id } => {
                removed.push(*id);
                masks.forget(*id);
                bases.forget(*id);
                continue;
            }
            AssetEvent::Unused { .. } | AssetEvent::LoadedWithDependencies { .. } => continue,
        };
        masks.forget(*id);
        bases.forget(*id);
        bakes.forget_picture(*id, before);
        preparations.forget_picture(*id, before);
        readings.forget(*id, before);
        for &entity in owners.users(*id) {
            if let Ok((_, mut cracked)) = surfaces.get_mut(entity)
                && let Some(active) = cracked.get_mut().filter(|active| active.canvas.read_at < before)
            {
                (active.canvas.is_outdated, active.canvas.has_changed) = (true, true);
                queues.changed.push(entity);
            }
        }
    }
}

/// Whether anything has changed.
pub(crate) fn any_changed(queues: Res<Queues>) -> bool {
    !queues.changed.is_empty()
}

/// Notes the cracked surfaces whose preset has changed on disk.
pub(crate) fn watch_presets(
    events: Option<MessageReader<AssetEvent<CrackPreset>>>,
    mut surfaces: CrackedSurfaces,
    mut queues: ResMut<Queues>,
) {
    let Some(mut events) = events else { return };
    for event in events.read() {
        let (AssetEvent::Modified { id } | AssetEvent::Added { id }) = event else { continue };
        for (entity, mut cracked) in &mut surfaces {
            let Some(active) = cracked.get_mut() else { continue };
            if matches!(&active.surface.preset, PresetSource::Asset(handle) if handle.id() == *id) {
                active.has_new_settings = true;
                queues.changed.push(entity);
            }
        }
    }
}
