//! From a surface to shards.

use super::{
    Broken, Shard, ShardsError, ShatterCracks, ShatterFailed, ShatterRequest, ShatterWhen, Shattered,
    broken::Piece,
    holes::{bounds, for_each_span},
};
use crate::{
    math::mix,
    plugin::{
        CrackBudget, CrackState, CrackStatus,
        paint::paint_now,
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
                    surfaces.shards.extend(shards.iter().map(|(shard, piece)| (*shard, entity, *piece)));
                    told.push(Shattered { entity, shards: shards.into_iter().map(|(shard, _)| shard).collect() });
                }
                Err(error) => failed.push(ShatterFailed { entity, error }),
            }
        }
        make_room(world, &mut surfaces);
    });
    for mut event in told {
        event.shards.retain(|shard| world.get::<Shard>(*shard).is_some());
        world.trigger(event);
    }
    for event in failed {
        warn!("{} cannot shatter: {}", event.entity, event.error);
        world.trigger(event);
    }
}

/// The oldest shards go if there are too many.
pub(super) fn make_room(world: &mut World, surfaces: &mut Surfaces) {
    // Entities are used again: only those count that still are the same piece.
    surfaces.shards.retain(|&(entity, of, piece)| {
        world.get::<Shard>(entity).is_some_and(|shard| shard.surface == of && shard.piece == piece)
    });
    let excess = surfaces.shards.len().saturating_sub(world.resource::<CrackBudget>().max_shards);
    let mut shortened = Vec::new();
    for (_, surface, [piece, _]) in surfaces.shards.drain(..excess) {
        let Some(active) = surfaces.active.get_mut(&surface) else { continue };
        if let Some(broken) = &mut active.broken
            && let Some(index) = broken.index_of(piece)
        {
            broken.pieces[index].is_spent = true;
            broken.hide(world, &active.carrier, index);
            shortened.push(surface);
        }
    }
    shortened.dedup();
    for surface in shortened {
        if let Some(broken) = surfaces.active.get(&surface).and_then(|active| active.broken.as_ref()) {
            broken.tell(world, surface);
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
) -> Result<Vec<(Entity, [u32; 2])>, ShardsError> {
    let settings = world.get::<ShatterCracks>(entity).cloned().unwrap_or_default();
    if !(0.0..=10.0).contains(&settings.thickness) {
        let value = f64::from(settings.thickness);
        let name = "thickness";
        return Err(ShatterError::OutOfRange { name, value, min: 0.0, max: 10.0 }.into());
    }
    let rim = active.rim(&settings);
    rim.validate()?;
    if let Some(again) = settings.again {
        again.validate()?;
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
    let seed = active.surface.seed ^ u64::from(active.broken.as_ref().map_or(0, |broken| broken.released));
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
            let mut cuts = Cuts::from_network(network)?;
            for line in broken.iter().flat_map(|broken| &broken.carried) {
                cuts.add_line(line)?;
            }
            let cut = Arc::new(shatter(cuts, &settings.cut)?);
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
    let is_new = active.broken.as_ref().is_none_or(|broken| !Arc::ptr_eq(&broken.cut, &cut));
    if is_first {
        can_copy_picture(world, active, left)?;
    }
    if is_new && !cut.carried().is_empty() {
        active.stamp_lines(cut.carried());
        paint_now(world, active);
    }
    let mut broken = match active.broken.take() {
        Some(broken) => broken,
        None => {
            let picture = copy_picture(world, active)?;
            (active.carrier.kind.open)(world, &active.carrier);
            Box::new(Broken::new((cut.clone(), support.clone()), grown, settings.clone(), picture, plane, active))
        }
    };
    if is_new {
        broken.carried.extend_from_slice(cut.carried());
    }
    broken.rim = rim;
    let again = settings.again;
    broken.inside = inside(world, active, &settings, rim.bright, broken.inside.take());
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
        let (id, nth) = (broken.next, broken.released);
        (broken.next, broken.released) = (id + 1, nth + 1);
        let flight = if is_falling { burst.fall(nth, shard) } else { burst.flight(nth, shard) };
        let seed = mix(active.surface.seed ^ mix(u64::from(nth)));
        let again = again.and_then(|again| Some((again, flight.delay + again.due(shard.area, seed)?)));
        broken.end = broken.end.max(broken.time + f64::from(flight.end()));
        let is_spent = is_transparent(active, &broken.cut, number);
        broken.pieces.push(Piece {
            cut: broken.cut.clone(),
            number,
            id,
            seed,
            start: broken.time,
            born: broken.time,
            flight,
            again,
            is_broken: false,
            part_of: None,
            uv: shown_uv(active),
            is_spent,
            body: None,
            times: 0,
            level: 0,
        });
        broken.holes.set(&broken.cut, number, active.field.frame, true);
        active.mark(bounds(&broken.cut, number, active.field.frame));
        let index = broken.pieces.len() - 1;
        if !is_spent && let Some(shard) = broken.spawn(world, entity, &active.carrier, index, Pose::AT_REST, scratch) {
            shards.push(shard);
        }
    }
    if is_first {
        active.bytes += broken.bytes;
    }
    broken.tell(world, entity);
    active.broken = Some(broken);
    active.mind_holes();
    Ok(shards)
}

/// Bytes of a copy of the surface's picture on the CPU and the GPU.
fn copy_bytes(active: &Active) -> u64 {
    8 * u64::from(active.base.size.x) * u64::from(active.base.size.y)
}

/// Whether the surface's picture can be copied.
fn can_copy_picture(world: &World, active: &Active, left: u64) -> Result<(), ShardsError> {
    let diffuse = active.textures.diffuse.as_ref().ok_or(ShardsError::NoDiffuse)?;
    let needed = copy_bytes(active);
    if needed > left {
        return Err(ShardsError::TextureBudget { needed, left });
    }
    let images = world.get_resource::<Assets<Image>>().ok_or(ShardsError::NoAssets { name: "Image" })?;
    images.get(diffuse).map(|_| ()).ok_or(ShardsError::NoDiffuse)
}

/// A copy of the surface's picture, and its bytes.
fn copy_picture(world: &mut World, active: &Active) -> Result<(Handle<Image>, u64), ShardsError> {
    let diffuse = active.textures.diffuse.as_ref().ok_or(ShardsError::NoDiffuse)?;
    let mut images = world.get_resource_mut::<Assets<Image>>().ok_or(ShardsError::NoAssets { name: "Image" })?;
    let copy = images.get(diffuse).cloned().ok_or(ShardsError::NoDiffuse)?;
    let copy = images.add(copy);
    world.resource_mut::<Uploads>().expect_whole();
    Ok((copy, copy_bytes(active)))
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
    bright: f32,
    before: Option<UntypedHandle>,
) -> Option<UntypedHandle> {
    #[cfg(feature = "3d")]
    if let Some(inside) = &settings.inside {
        return active.carrier.kind.is_solid.then(|| inside.clone().untyped());
    }
    before.or_else(|| (active.carrier.kind.inside)(world, &active.carrier, active.base.mean(), bright))
}
