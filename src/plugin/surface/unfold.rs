//! Meshes are laid out before they crack.

use super::picture_plan::texel_bytes;
use crate::plugin::api::textures::Maps;
use crate::plugin::api::{
    CrackBudget, CrackError, CrackMaskSource, CrackRecord, CrackResolution, CrackStrands, CrackSurface, CrackUnwrap,
    GuidedCracks, HitPoint,
};
use crate::plugin::carrier::kind::{Found, UnfoldOrder};
use crate::plugin::carrier::kinds;
use crate::plugin::gpu::memory::TextureMemory;
use crate::plugin::jobs::threads::Threads;
use crate::plugin::source::{picture, preset};
use crate::plugin::surface::queue::HitQueue;
use bevy::{prelude::*, render::renderer::RenderDevice};

/// The most texels of a layout that nobody asked for.
const MOST_BY_ITSELF: u64 = 3 << 19;

/// The most texels of any.
const MOST: u64 = 8 << 20;

/// The number of the next layout.
#[derive(Resource, Default)]
pub(crate) struct Unfoldings(u64);

/// Has the mesh of a surface laid out that has not cracked, if that is of use; `false` if that is under way.
pub(crate) fn unfold(world: &mut World, entity: Entity) -> bool {
    let (Some(kind), found) = kinds::inspect(world, entity) else { return true };
    if let Some(is_ready) = kind.poll_unfold(world, entity) {
        return is_ready;
    }
    // How large they are is not known before.
    let is_on_its_way = |picture| matches!(picture::is_loaded(world, picture), Ok(false));
    match found {
        Found::Waiting => return false,
        Found::Shown(shown) if shown.pictures().any(is_on_its_way) => return false,
        _ => {}
    }
    let Some(surface) = world.get::<CrackSurface>(entity) else { return true };
    // What is given over the whole of a picture has its place there.
    let has_places = !matches!(surface.mask, CrackMaskSource::Auto | CrackMaskSource::None)
        || surface.density.is_some()
        || surface.resolution != CrackResolution::Picture
        || world.get::<CrackStrands>(entity).is_some();
    if surface.unwrap == CrackUnwrap::Never || has_places {
        return true;
    }
    match order(world, entity) {
        Ok(Some(order)) => kind.unfold(world, entity, &order),
        _ => true,
    }
}

/// How the mesh of a surface that has not cracked is to be laid out; `None` as long as its preset is not there.
pub(crate) fn order(world: &mut World, entity: Entity) -> Result<Option<UnfoldOrder>, CrackError> {
    let Some(surface) = world.get::<CrackSurface>(entity) else { return Ok(None) };
    let must = surface.unwrap == CrackUnwrap::Always;
    let write = surface.write;
    let Some(preset) = preset::resolve(world, &surface.preset)? else { return Ok(None) };
    let texel = texel_bytes(Maps::wanted(write, &preset.look), preset.look.layer(0).bytes_per_texel());
    let budget = world.resource::<CrackBudget>();
    let left = budget.max_texture_bytes.saturating_sub(world.resource::<TextureMemory>().used());
    let device = world.get_resource::<RenderDevice>().map_or(u32::MAX, |d| d.limits().max_texture_dimension_2d);
    let hit = match world.get::<CrackRecord>(entity).and_then(|record| record.around) {
        Some(around) => Some((HitPoint::Local(around), None)),
        None => world.resource::<HitQueue>().first(entity).map(|hit| (hit.at, hit.point)),
    };
    // Guides are usually in the middle of its picture.
    let is_guided = world.get::<GuidedCracks>(entity).is_some();
    let hit = hit.or_else(|| is_guided.then_some((HitPoint::Uv(Vec2::splat(0.5)), None)));
    let order = UnfoldOrder {
        hit,
        must,
        most_texels: (left / texel).min(if must { MOST } else { MOST_BY_ITSELF }),
        most_side: budget.max_side.min(device).clamp(1, crate::pattern::MAX_SIDE),
        at_once: budget.is_unlimited() || world.resource::<Threads>().pool().is_none(),
        id: world.resource::<Unfoldings>().0,
    };
    world.resource_mut::<Unfoldings>().0 += 1;
    Ok(Some(order))
}
