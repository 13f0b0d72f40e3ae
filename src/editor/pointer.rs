//! Clicks on surfaces: they choose and hit them.

use super::state::{Aim, CrackEditor};
use crate::plugin::{CrackHit, CrackMemberOf, CrackSurface, inspect};
use bevy::prelude::*;

/// A press that moves less is no aim, logical pixels.
const STILL: f32 = 8.0;

/// What shows a surface, or a part of one.
type OfSurface = Or<(With<CrackSurface>, With<CrackMemberOf>)>;

/// The engine picks only those sprites that say so.
pub(super) fn make_pickable(
    mut commands: Commands,
    sprites: Query<Entity, (OfSurface, With<Sprite>, Without<Pickable>)>,
) {
    for sprite in &sprites {
        commands.entity(sprite).try_insert(Pickable::default());
    }
}

pub(super) fn press(
    press: On<Pointer<Press>>,
    surfaces: Query<(), With<CrackSurface>>,
    members: Query<&CrackMemberOf>,
    mut editor: ResMut<CrackEditor>,
) {
    let entity = members.get(press.entity).map_or(press.entity, |member| member.0);
    // The event goes on to parents and the window.
    if !editor.is_open || press.button != PointerButton::Primary || !surfaces.contains(entity) {
        return;
    }
    let from = press.pointer_location.position;
    editor.aim = press.hit.position.map(|point| Aim { surface: entity, point, from });
    editor.chosen = Some(entity);
}

pub(super) fn release(release: On<Pointer<Release>>, mut editor: ResMut<CrackEditor>, mut commands: Commands) {
    if release.button != PointerButton::Primary {
        return;
    }
    let Some(aim) = editor.aim.take().filter(|_| editor.is_open && editor.panel.hits_on_click) else { return };
    let moved = release.pointer_location.position - aim.from;
    let (energy, hits_all) = (editor.panel.energy, editor.panel.hits_all);
    commands.queue(move |world: &mut World| strike(world, aim, moved, energy, hits_all));
}

/// Hits the surface that was aimed at, and others at the same texture coordinates if they are to be.
fn strike(world: &mut World, aim: Aim, moved: Vec2, energy: f32, hits_all: bool) {
    let direction = direction(world, moved);
    let hit = |hit: CrackHit| hit.with_energy(energy).with_direction(direction);
    let uv = hits_all.then(|| inspect::uv_at(world, aim.surface, aim.point)).flatten();
    if let Some(uv) = uv {
        let mut surfaces = world.query_filtered::<Entity, With<CrackSurface>>();
        let others: Vec<Entity> = surfaces.iter(world).filter(|entity| *entity != aim.surface).collect();
        for other in others {
            world.trigger(hit(CrackHit::uv(other, uv)));
        }
    }
    world.trigger(hit(CrackHit::world(aim.surface, aim.point)));
}

/// The way the pointer was dragged, in the world: to the right and up as the camera sees it, and away from it.
fn direction(world: &mut World, moved: Vec2) -> Vec3 {
    if moved.length() < STILL {
        return Vec3::ZERO;
    }
    let mut cameras = world.query::<(&Camera, &GlobalTransform)>();
    let cameras = cameras.iter(world).filter(|(camera, _)| camera.is_active);
    let Some((_, transform)) = cameras.min_by_key(|(camera, _)| camera.order) else { return Vec3::ZERO };
    let across = transform.right() * moved.x - transform.up() * moved.y;
    (across + transform.forward() * moved.length()).normalize_or_zero()
}
