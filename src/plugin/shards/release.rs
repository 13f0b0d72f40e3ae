//! From a surface to shards.

use super::{
    Broken, CrackShards, Shard, ShardsError, ShatterCracks, ShatterFailed, ShatterRequest, ShatterWhen, Shattered,
    broken::Piece,
    holes::{bounds, for_each_span},
};
use crate::{
    plugin::{
        CrackBudget, CrackState, CrackStatus,
        surfaces::{Active, Surfaces},
        upload::Uploads,
    },
    raster::TexelRect,
    shatter::{Burst, Cuts, Pose, ShardMesh, Shards, ShatterError, Support, shatter},
};
use bevy::{asset::UntypedHandle, prelude::*};
use std::sync::Arc;

/// Asks for shards where they are to fall by themselves.
pub(in crate::plugin) fn shatter_when_due(
    changed: Query<(Entity, &ShatterCracks, &CrackState), Changed<CrackState>>,
    mut surfaces: ResMut<Surfaces>,
) {
    for (entity, settings, state) in &changed {
        let Some(active) = surfaces.active.get_mut(&entity) else { continue };
        let (nodes, cells) = (active.growth.network().nodes().len(), active.cells_told);
        let is_due = match settings.when {
            ShatterWhen::Never => false,
            ShatterWhen::AtDamage(damage) => {
                state.status == CrackStatus::Done && state.damage >= damage && nodes > active.fell_at.0
            }
            ShatterWhen::CellsAsTheyClose => cells > active.fell_at.1,
        };
        if is_due {
            active.fell_at = (nodes, cells);
            surfaces.requests.push((entity, ShatterRequest { reach: settings.reach, ..ShatterRequest::ALL }));
        }
    }
}

/// Whether any surface is to shatter.
pub(in crate::plugin) fn any_requests(surfaces: Res<Surfaces>) -> bool {
    !surfaces.requests.is_empty()
}

/// Shatters the surfaces that are to.
pub(in crate::plugin) fn shatter_surfaces(world: &mut World, mut scratch: Local<ShardMesh>) {
    let mut told = Vec::new();
    let mut failed = Vec::new();
    world.resource_scope(|world, mut surfaces: Mut<Surfaces>| {
        let requests = core::mem::take(&mut surfaces.requests);
        for (entity, request) in requests {
            let left = world.resource::<CrackBudget>().max_texture_bytes.saturating_sub(surfaces.bytes);
            let Some(active) = surfaces.active.get_mut(&entity) else { continue };
            if active.is_dirty {
                // The shards are to show what the surface will.
                surfaces.requests.push((entity, request));
                continue;
            }
            let (bytes, was_broken) = (active.bytes, active.broken.is_some());
            let outcome = release(world, entity, active, &request, left, &mut scratch);
            let (more, is_broken) = (active.bytes - bytes, active.broken.is_some());
            surfaces.bytes += more;
            if is_broken && !was_broken {
                surfaces.broken.push(entity);
            }
            match outcome {
                Ok(shards) if shards.is_empty() => {}
                Ok(shards) => {
                    surfaces.soil(entity);
                    surfaces.shards.extend(&shards);
                    told.push(Shattered { entity, shards });
                }
                Err(error) => failed.push(ShatterFailed { entity, error }),
            }
        }
        make_room(world, &mut surfaces);
    });
    for mut event in told {
        event.shards.retain(|shard| world.get_entity(*shard).is_ok());
        world.trigger(event);
    }
    for event in failed {
        warn!("{} cannot shatter: {}", event.entity, event.error);
        world.trigger(event);
    }
}

/// The oldest shards go if there are too many.
pub(super) fn make_room(world: &mut World, surfaces: &mut Surfaces) {
    surfaces.shards.retain(|shard| world.get_entity(*shard).is_ok());
    let excess = surfaces.shards.len().saturating_sub(world.resource::<CrackBudget>().max_shards);
    let mut shortened = Vec::new();
    for entity in surfaces.shards.drain(..excess) {
        let Some(&Shard { surface, piece: id, .. }) = world.get::<Shard>(entity) else { continue };
        if let Some(broken) = surfaces.active.get_mut(&surface).and_then(|active| active.broken.as_mut())
            && let Ok(index) = broken.pieces.binary_search_by_key(&id, |piece| piece.id)
        {
            broken.pieces[index].is_spent = true;
            broken.hide(world, index);
            shortened.push(surface);
        }
    }
    shortened.dedup();
    for surface in shortened {
        if let Some(broken) = surfaces.active.get(&surface).and_then(|active| active.broken.as_ref())
            && let Some(mut report) = world.get_mut::<CrackShards>(surface)
        {
            *report = broken.report();
        }
    }
}

/// Releases what a blow knocks out of a surface.
fn release(
    world: &mut World,
    entity: Entity,
    active: &mut Active,
    request: &ShatterRequest,
    left: u64,
    scratch: &mut ShardMesh,
) -> Result<Vec<Entity>, ShardsError> {
    let settings = world.get::<ShatterCracks>(entity).cloned().unwrap_or_default();
    if !(0.0..=10.0).contains(&settings.thickness) {
        let value = f64::from(settings.thickness);
        let name = "thickness";
        return Err(ShatterError::OutOfRange { name, value, min: 0.0, max: 10.0 }.into());
    }
    let network = active.growth.network();
    let extent = network.extent();
    let (pos, energy, direction) =
        active.struck.map_or((0.5 * extent, 1.0, Vec3::ZERO), |struck| (struck.pos, struck.energy, struck.direction));
    let from = request.uv.map_or(pos, |uv| uv * extent);
    let plane = (active.carrier.kind.plane)(world, entity, active).map_err(|reason| ShardsError::NotFlat { reason })?;
    let to_local =
        world.get::<GlobalTransform>(entity).map_or(Mat3::IDENTITY, |at| at.affine().matrix3.inverse().into());
    let direction = plane.rotation.inverse() * (to_local * request.direction.unwrap_or(direction));
    let seed = active.surface.seed ^ u64::from(active.broken.as_ref().map_or(0, |broken| broken.next));
    let burst = Burst::new(settings.burst, from, direction, request.energy.unwrap_or(energy), seed)?;

    // What has been cut stays cut, unless there is more to cut along.
    let grown = (network.nodes().len(), network.links().len());
    let same = |broken: &Broken| {
        let before = &broken.settings;
        broken.grown == grown && before.cut == settings.cut && before.anchor == settings.anchor
    };
    let (cut, mut support) = match &active.broken {
        Some(broken) if same(broken) => (broken.cut.clone(), broken.support.clone()),
        broken => {
            let cut = Arc::new(shatter(Cuts::from_network(network)?, &settings.cut)?);
            let support = match broken {
                Some(broken) => broken.support.renewed(&broken.cut, &cut, settings.anchor),
                None => Support::new(&cut, settings.anchor),
            };
            (cut, support)
        }
    };
    let fallen = support.hit(&cut, from, request.reach)?;
    if fallen.hit.is_empty() && fallen.loose.is_empty() {
        return Ok(Vec::new());
    }
    let is_first = active.broken.is_none();
    let mut broken = match active.broken.take() {
        Some(broken) => broken,
        None => {
            let picture = copy_picture(world, active, left)?;
            (active.carrier.kind.open)(world, &active.carrier);
            Box::new(Broken::new((cut.clone(), support.clone()), grown, settings.clone(), picture, plane, active))
        }
    };
    broken.inside = inside(world, active, &settings, broken.inside.take());
    (broken.cut, broken.support, broken.grown, broken.settings, broken.plane) = (cut, support, grown, settings, plane);
    if !is_first {
        let pieces = fallen.hit.iter().chain(&fallen.loose);
        let rects = pieces.map(|&number| bounds(&broken.cut, number, active.field.frame));
        refresh(world, active, &broken, rects);
    }
    let falls = fallen.hit.iter().map(|_| false).chain(fallen.loose.iter().map(|_| true));
    let mut shards = Vec::new();
    for (&number, is_falling) in fallen.hit.iter().chain(&fallen.loose).zip(falls) {
        let Some(shard) = broken.cut.get(number) else { continue };
        let id = broken.next;
        broken.next += 1;
        let flight = if is_falling { burst.fall(id, shard) } else { burst.flight(id, shard) };
        broken.end = broken.end.max(broken.time + f64::from(flight.end()));
        let piece = Piece {
            cut: broken.cut.clone(),
            number,
            id,
            start: broken.time,
            flight,
            uv: shown_uv(active),
            is_spent: is_transparent(active, &broken.cut, number),
            entity: None,
            level: 0,
        };
        let is_spent = piece.is_spent;
        broken.pieces.push(piece);
        broken.holes.set(&broken.cut, number, active.field.frame, true);
        active.mark(bounds(&broken.cut, number, active.field.frame));
        let index = broken.pieces.len() - 1;
        if !is_spent && let Some(shard) = broken.spawn(world, entity, &active.carrier, index, scratch) {
            broken.pose(world, entity, &active.carrier, index, Pose::AT_REST);
            shards.push(shard);
        }
    }
    if is_first {
        active.bytes += broken.bytes;
    }
    let report = broken.report();
    active.broken = Some(broken);
    active.mind_holes();
    if let Ok(mut entity) = world.get_entity_mut(entity) {
        entity.insert(report);
    }
    Ok(shards)
}

/// A copy of the surface's picture, and its bytes on the CPU and the GPU.
fn copy_picture(world: &mut World, active: &Active, left: u64) -> Result<(Handle<Image>, u64), ShardsError> {
    let diffuse = active.textures.diffuse.as_ref().ok_or(ShardsError::NoDiffuse)?;
    let needed = 8 * u64::from(active.base.size.x) * u64::from(active.base.size.y);
    if needed > left {
        return Err(ShardsError::TextureBudget { needed, left });
    }
    let mut images = world.get_resource_mut::<Assets<Image>>().ok_or(ShardsError::NoAssets { name: "Image" })?;
    let copy = images.get(diffuse).cloned().ok_or(ShardsError::NoDiffuse)?;
    let copy = images.add(copy);
    world.resource_mut::<Uploads>().expect_whole();
    Ok((copy, needed))
}

/// Brings what is about to leave up to date in the copy of the picture: more cracks have grown since.
fn refresh(world: &mut World, active: &Active, broken: &Broken, rects: impl Iterator<Item = TexelRect>) {
    let (Some(diffuse), Some(view)) = (&active.textures.diffuse, active.views.get(active.view)) else { return };
    let Some(mut images) = world.get_resource_mut::<Assets<Image>>() else { return };
    // Without an asset event, which would upload the whole image.
    let Some(mut copy) = images.get_mut_untracked(&broken.whole).and_then(|image| image.data.take()) else { return };
    let size = active.base.size;
    let mut changed = Vec::new();
    if let Some(shown) = images.get(diffuse).and_then(|image| image.data.as_ref()) {
        for rect in rects {
            // One more, for those who blend neighbouring texels.
            let rect = rect.grow(1, active.field.frame.size());
            broken.holes.copy_present(shown, &mut copy, size, view.rect.min, rect);
            changed.push(TexelRect { min: rect.min + view.rect.min, max: rect.max + view.rect.min });
        }
    }
    if let Some(image) = images.get_mut_untracked(&broken.whole) {
        image.data = Some(copy);
    }
    let mut uploads = world.resource_mut::<Uploads>();
    for rect in changed {
        uploads.push(broken.whole.id(), rect);
    }
}

/// The part of the texture that the surface shows.
fn shown_uv(active: &Active) -> [Vec2; 2] {
    let size = active.base.size.as_vec2();
    let rect = active.views.get(active.view).map_or(TexelRect::whole(active.base.size), |view| view.rect);
    [rect.min.as_vec2() / size, rect.max.as_vec2() / size]
}

/// Whether nothing of a piece can be seen.
fn is_transparent(active: &Active, cut: &Shards, number: u32) -> bool {
    let Some(view) = active.views.get(active.view) else { return false };
    let (mut is_any, mut is_seen) = (false, false);
    for_each_span(cut, number, active.field.frame, |y, from, to| {
        is_any = true;
        is_seen = is_seen || (from..to).any(|x| !active.base.is_hole(view.rect.min + UVec2::new(x, y)));
    });
    is_any && !is_seen
}

/// The material of the sides.
#[cfg_attr(not(feature = "3d"), expect(unused_variables, reason = "only 3D shards have sides"))]
fn inside(
    world: &mut World,
    active: &Active,
    settings: &ShatterCracks,
    before: Option<UntypedHandle>,
) -> Option<UntypedHandle> {
    #[cfg(feature = "3d")]
    if let Some(inside) = &settings.inside {
        return active.carrier.kind.is_solid.then(|| inside.clone().untyped());
    }
    before.or_else(|| (active.carrier.kind.inside)(world, &active.carrier, active.base.mean()))
}
