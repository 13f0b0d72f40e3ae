//! What surfaces are going to look like is asked of the renderer before it is shown.

use super::active::Active;
use super::cracked::active;
use crate::plugin::api::shatter::rim_for;
use crate::plugin::api::textures::Maps;
use crate::plugin::api::{CrackSurface, ShatterCracks};
use crate::plugin::carrier::kind::{Found, NextLook};
use crate::plugin::carrier::kinds;
use crate::plugin::carrier::pipelines::{LEAD, PATIENCE, PipelineRequests, is_needed};
use crate::plugin::source::preset;
use bevy::{asset::UntypedHandle, ecs::archetype::Archetype, prelude::*, render::view::Msaa};
use core::{
    hash::{Hash, Hasher},
    sync::atomic::Ordering,
};
use std::collections::hash_map::DefaultHasher;

/// New surfaces that are looked at in a frame.
const MAX_FRESH: usize = 32;

/// Notes surfaces that are new, and those that are to shatter from now on.
pub(crate) fn note_fresh(
    fresh: Query<Entity, (With<CrackSurface>, Or<(Added<CrackSurface>, Added<ShatterCracks>)>)>,
    mut warmth: ResMut<PipelineRequests>,
) {
    warmth.fresh.extend(&fresh);
}

/// Asks for everything again when cameras have become others.
pub(crate) fn watch_views(
    cameras: Query<(Entity, &Archetype, Option<&Msaa>), With<Camera>>,
    mut warmth: ResMut<PipelineRequests>,
    mut commands: Commands,
) {
    // In any order.
    let views = cameras.iter().fold(0u64, |sum, (entity, archetype, msaa)| {
        let mut hasher = DefaultHasher::new();
        (entity, archetype.id().index(), msaa.map(Msaa::samples)).hash(&mut hasher);
        sum.wrapping_add(hasher.finish())
    });
    warmth.frame += 1;
    if core::mem::replace(&mut warmth.views, views) == views {
        return;
    }
    warmth.waited.retain(|_, since| since.elapsed() < PATIENCE);
    for (key, look) in core::mem::take(&mut warmth.looks) {
        warmth.fresh.push_back(look.of);
        if let Some(stand_in) = look.stand_in {
            commands.entity(stand_in).try_despawn();
            // However often they change, nothing waits for longer.
            warmth.waited.insert(key, look.since);
        }
    }
}

/// Asks for the looks of new surfaces, and takes away what was drawn for those that are there.
pub(crate) fn warm_up(world: &mut World) {
    let is_needed = is_needed(world);
    let warmth = &mut *world.resource_mut::<PipelineRequests>();
    let ready_up_to = warmth.ready_up_to.as_ref().map_or(0, |ready| ready.load(Ordering::Relaxed));
    let mut done = Vec::new();
    for look in warmth.looks.values_mut() {
        if ready_up_to >= look.frame + LEAD || look.since.elapsed() >= PATIENCE {
            done.extend(look.stand_in.take());
        }
    }
    let count = warmth.fresh.len().min(MAX_FRESH);
    let fresh: Vec<Entity> = warmth.fresh.drain(..count).filter(|_| is_needed).collect();
    for stand_in in done {
        world.try_despawn(stand_in).ok();
    }
    for entity in fresh {
        if !look_ahead(world, entity) {
            world.resource_mut::<PipelineRequests>().fresh.push_back(entity);
        }
    }
}

/// Asks for what a surface may look like one day; `false` if it is not there yet.
fn look_ahead(world: &mut World, entity: Entity) -> bool {
    let Some(surface) = world.get::<CrackSurface>(entity) else { return true };
    let write = surface.write;
    let preset = match preset::resolve(world, &surface.preset) {
        Ok(Some(preset)) => preset,
        Ok(None) => return false,
        Err(_) => return true,
    };
    let maps = Maps::wanted(write, &preset.look);
    let (kind, shown) = match kinds::inspect(world, entity) {
        (Some(kind), Found::Shown(shown)) => (kind, shown),
        (_, Found::Waiting) => return false,
        _ => return true,
    };
    kind.can_draw(world, entity, &NextLook::Cracked(maps));
    let Some(settings) = world.get::<ShatterCracks>(entity).cloned() else { return true };
    let active = active(world, entity);
    let original = active.map_or(shown.asset, |active| active.carrier.shown.asset.clone());
    let has_rims = rim_for(&settings, &preset.look).width > 0.0;
    kind.can_draw(world, entity, &NextLook::Broken { maps, original: &original, has_rims, inside: inside(&settings) });
    true
}

#[cfg_attr(not(feature = "3d"), expect(unused_variables, reason = "only 3D shards have sides"))]
fn inside(settings: &ShatterCracks) -> Option<UntypedHandle> {
    #[cfg(feature = "3d")]
    if let Some(inside) = &settings.inside {
        return Some(inside.clone().untyped());
    }
    None
}

/// Whether the renderer can draw a surface with cracks. If not, it is asked to.
pub(crate) fn can_crack(world: &mut World, entity: Entity) -> bool {
    if !is_needed(world) {
        return true;
    }
    let Some(CrackSurface { write, preset, .. }) = world.get::<CrackSurface>(entity) else { return true };
    let Ok(Some(preset)) = preset::resolve(world, preset) else { return true };
    let maps = Maps::wanted(*write, &preset.look);
    let (Some(kind), Found::Shown(_)) = kinds::inspect(world, entity) else { return true };
    kind.can_draw(world, entity, &NextLook::Cracked(maps))
}

/// Whether the renderer can draw a surface with holes, and its shards. If not, it is asked to.
pub(crate) fn can_break(world: &mut World, entity: Entity, active: &Active) -> bool {
    if !is_needed(world) {
        return true;
    }
    let settings = world.get::<ShatterCracks>(entity).cloned().unwrap_or_default();
    let has_rims = rim_for(&settings, &active.preset.look).width > 0.0;
    let emissive = active.canvas.textures.emissive.is_some();
    let maps = Maps { emissive, ..Maps::wanted(active.surface.write, &active.preset.look) };
    let original = &active.carrier.shown.asset;
    let asked = NextLook::Broken { maps, original, has_rims, inside: inside(&settings) };
    active.carrier.kind.can_draw(world, entity, &asked)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plugin::carrier::pipelines::Look;
    use bevy::{ecs::system::RunSystemOnce, platform::time::Instant};

    /// However often cameras change, what was not there is waited for since it was first asked for.
    #[test]
    fn cameras_that_change_do_not_prolong_a_wait() {
        let mut world = World::new();
        world.init_resource::<PipelineRequests>();
        let camera = world.spawn(Camera::default()).id();
        let (of, stand_in) = (world.spawn_empty().id(), world.spawn_empty().id());
        world.run_system_once(watch_views).ok();
        let since = Instant::now();
        let look = |stand_in| Look { of, stand_in, frame: 0, since };
        world.resource_mut::<PipelineRequests>().looks.extend([(1, look(Some(stand_in))), (2, look(None))]);
        world.entity_mut(camera).insert(Name::new("other"));
        world.run_system_once(watch_views).ok();
        let requests = world.resource::<PipelineRequests>();
        assert!(requests.looks.is_empty() && requests.fresh == [of, of]);
        assert!(requests.waited.iter().eq([(&1, &since)]), "{:?}", requests.waited);
    }
}
