//! From requests to shards: background tasks make them, and a frame applies them.

use super::batch::{Batch, Leaving};
use super::body::Spares;
use super::broken::{self, Broken, Piece, Pieces};
use super::crumbs::Crumb;
use super::order::{CutSurface, MOST_NEW, ShatterJob};
use super::request::{FRAMES, Request, ShardQueue, frames};
use super::show::ShownPiece;
use crate::plugin::api::error::EntityLabel;
use crate::plugin::api::{CrackBudget, Shard, ShardsError, ShatterCracks, ShatterFailed, Shattered};
use crate::plugin::carrier::plane::Plane;
use crate::plugin::carrier::slot::SideLook;
use crate::plugin::draw::async_playback::is_at_work;
use crate::plugin::draw::paint::paint_now;
use crate::plugin::gpu::memory::{TextureBytes, TextureMemory};
use crate::plugin::gpu::textures;
use crate::plugin::gpu::uploads::Uploads;
use crate::plugin::jobs::background::{BackgroundJob, PATIENCE};
use crate::plugin::jobs::deferred::hold;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cutouts::{Holes, Span, cut_span};
use crate::plugin::surface::queues::Queues;
use crate::plugin::surface::{cracked, warm};
use crate::raster::TexelRect;
use crate::shatter::RimLook;
use bevy::{asset::UntypedHandle, platform::time::Instant, prelude::*};

/// Shatters the surfaces that are to, one request after the other.
pub(crate) fn shatter_surfaces(world: &mut World) {
    let (mut shattered, mut failed) = (Vec::new(), Vec::new());
    hold(world, |world| {
        world.resource_scope(|world, mut queue: Mut<ShardQueue>| {
            let requests = core::mem::take(&mut queue.requests);
            // Those that have begun first.
            for entity in queue.broken.clone() {
                shattered.extend(
                    with_active(world, entity, |world, active| let_go(world, entity, active, &mut queue)).flatten(),
                );
            }
            for request in requests {
                let entity = request.entity;
                let outcome = with_active(world, entity, |world, active| attend(world, active, request, &mut queue));
                match outcome {
                    Some(Ok(event)) => shattered.extend(event),
                    Some(Err(error)) => failed.push(ShatterFailed { entity, error }),
                    None => {}
                }
            }
        });
    });
    for mut event in shattered {
        event.shards.retain(|shard| world.get::<Shard>(*shard).is_some());
        world.trigger(event);
    }
    for event in failed {
        warn!("{} cannot shatter: {}", EntityLabel::of(world, event.entity), event.error);
        world.trigger(event);
    }
}

/// Does something with the world and a surface beside it.
pub(super) fn with_active<T>(
    world: &mut World,
    entity: Entity,
    work: impl FnOnce(&mut World, &mut Active) -> T,
) -> Option<T> {
    let mut active = cracked::take(world, entity)?;
    let result = work(world, &mut active);
    cracked::put_back(world, entity, active);
    Some(result)
}

/// Goes on with a request; it goes back to the queue if it has to wait.
fn attend(
    world: &mut World,
    active: &mut Active,
    request: Request,
    queue: &mut ShardQueue,
) -> Result<Option<Shattered>, ShardsError> {
    let entity = request.entity;
    let is_first = queue.requests.iter().all(|other| other.entity != entity);
    let is_shattering = world.get::<Pieces>(entity).is_some_and(Pieces::is_waiting);
    active.turn.is_to_shatter = true;
    if active.cracks.growth.is_in_step() {
        active.cracks.growth.finish_step();
        world.resource_mut::<Queues>().mark_dirty(entity, &mut active.turn);
    }
    // The shards are to show what the surface will.
    if active.turn.is_dirty || is_shattering || !is_first {
        queue.requests.push(request);
        return Ok(None);
    }
    let is_warm = warm::can_break(world, entity, active);
    let outcome = match proceed(world, active, request, is_warm) {
        Ok(Progress::Wait(request)) => {
            queue.requests.push(request);
            return Ok(None);
        }
        Ok(Progress::Ready(made)) => release(world, entity, active, *made),
        Err(error) => Err(error),
    };
    active.turn.is_to_shatter = false;
    if broken::broken(world, entity).is_some() && !queue.broken.contains(&entity) {
        queue.broken.push(entity);
    }
    outcome?;
    Ok(let_go(world, entity, active, queue))
}

enum Progress {
    Wait(Request),
    Ready(Box<CutSurface>),
}

/// Begins to make what was asked for, waits for it, or has it. It is not to be had before `is_warm`.
fn proceed(world: &World, active: &Active, mut request: Request, is_warm: bool) -> Result<Progress, ShardsError> {
    let order = |request: &Request| ShatterJob::of(world, request.entity, active, &request.request);
    let made = match request.work.take() {
        None => {
            request.work = Some((BackgroundJob::start(order(&request)?, ShatterJob::make), 1));
            (request.frames, request.since) = (frames(world, active), Instant::now());
            return Ok(Progress::Wait(request));
        }
        // Before the renderer can draw shards, there would be nothing to see.
        Some((work, frames)) if frames < request.frames || !is_warm => {
            request.work = Some((work, frames.saturating_add(1)));
            return Ok(Progress::Wait(request));
        }
        // It will take what it takes; one that no thread has begun is done here.
        Some((work, frames)) if request.frames > FRAMES && !work.is_done() => {
            let is_late = request.since.elapsed() >= PATIENCE;
            match is_late.then(|| work.take_back()).flatten() {
                Some(order) => Some(order.make()),
                None => {
                    request.work = Some((work, frames));
                    return Ok(Progress::Wait(request));
                }
            }
        }
        Some((work, _)) => work.finish(),
    };
    let made = match made {
        Some(Ok(made)) if !made.fits(active) => None,
        made => made,
    };
    // It has become another surface: in this frame, or it would never be done where that happens often.
    let made = made.unwrap_or_else(|| order(&request)?.make())?;
    Ok(Progress::Ready(Box::new(made)))
}

/// Counts the shards that are shown.
pub(super) fn count_shown(world: &World, queue: &mut ShardQueue) -> usize {
    // Entities are used again: only those count that still are the same piece.
    queue.shown.retain(|&(entity, of, piece)| {
        world.get::<Shard>(entity).is_some_and(|shard| shard.surface == of && shard.piece == piece)
    });
    queue.shown.len()
}

/// The oldest shards go if there are too many with so many more. `own` is the surface that is taken out, with its state and its pieces.
pub(super) fn evict_oldest(
    world: &mut World,
    queue: &mut ShardQueue,
    more: usize,
    own: (Entity, &Active, &mut Broken),
) {
    let shown = count_shown(world, queue);
    let excess = (shown + more).saturating_sub(world.resource::<CrackBudget>().max_shards).min(shown);
    let (in_hand, own_active, own_broken) = own;
    let mut shortened = Vec::new();
    for (_, surface, [piece, _]) in queue.shown.drain(..excess) {
        let is_gone = if surface == in_hand {
            own_broken.spend(world, own_active, piece)
        } else {
            let spend = |world: &mut World, active: &mut Active| {
                let mut broken = broken::take(world, surface)?;
                let is_gone = broken.spend(world, active, piece);
                broken::put_back(world, surface, broken);
                Some(is_gone)
            };
            with_active(world, surface, spend).flatten().unwrap_or(false)
        };
        if is_gone {
            shortened.push(surface);
        }
    }
    shortened.dedup();
    for surface in shortened {
        if surface == in_hand {
            own_broken.report(world, surface);
        } else if let Some(broken) = broken::take(world, surface) {
            broken.report(world, surface);
            broken::put_back(world, surface, broken);
        }
    }
}

/// Cuts out of a surface what is to leave it.
fn release(world: &mut World, entity: Entity, active: &mut Active, made: CutSurface) -> Result<(), ShardsError> {
    if made.batches.is_empty() {
        return Ok(());
    }
    let before = broken::take(world, entity);
    let is_first = before.is_none();
    let CutSurface {
        settings,
        rim,
        plane,
        shell,
        grown,
        cut,
        is_new,
        support,
        batches,
        crumbs,
        drawn,
        density,
        room,
        ..
    } = made;
    if is_first {
        can_copy_picture(world, active)?;
    }
    if is_new && !cut.extended_lines().is_empty() {
        match drawn.filter(|drawn| drawn.fits(active)) {
            Some(drawn) => drawn.put_on(world, active),
            None => {
                active.stamp_lines(cut.extended_lines());
                paint_now(world, active);
            }
        }
    }
    let mut broken = match before {
        Some(broken) => broken,
        None => {
            let picture = copy_picture(world, active, room)?;
            active.carrier.kind.open(world, entity, &active.carrier, true);
            active.drawing.cutouts = Some(Holes::new(active.drawing.field.frame.size()));
            Box::new(Broken::new((cut.clone(), support.clone()), grown, settings.clone(), picture, plane))
        }
    };
    if is_new && !cut.extended_lines().is_empty() {
        active.drawing.carried.push(cut.shared_carried());
    }
    broken.inside = inside(world, active, (&settings, rim, &plane), shell.is_some(), broken.inside.take());
    (broken.cut, broken.support, broken.grown) = (cut, support, grown);
    (broken.settings, broken.plane, broken.shell, broken.rim) = (settings, plane, shell, rim);
    (broken.is_fresh, broken.crumb_params) = (is_first, crumbs);
    (broken.waiting, broken.since, broken.has_begun) = (batches, broken.time, false);
    broken.report(world, entity);
    broken::put_back(world, entity, broken);
    active.cracks.growth.set_density(density);
    Ok(())
}

/// Lets the pieces go that leave a surface in this frame, if there is room for any.
fn let_go(world: &mut World, entity: Entity, active: &mut Active, queue: &mut ShardQueue) -> Option<Shattered> {
    if is_at_work(world, entity) {
        // What a task makes of it would not have the holes.
        return None;
    }
    let budget = world.resource::<CrackBudget>();
    let (most, is_unlimited) = (budget.max_shards, budget.is_unlimited());
    let batch = broken::broken(world, entity)?.waiting.front()?;
    let new = batch.leaving.iter().filter(|leaving| leaving.form.is_some()).count();
    if new > queue.new && queue.new < MOST_NEW && !is_unlimited {
        // Others have made some in this frame.
        return None;
    }
    queue.new = queue.new.saturating_sub(new);
    let mut broken = broken::take(world, entity)?;
    evict_oldest(world, queue, new, (entity, active, &mut broken));
    if !core::mem::replace(&mut broken.has_begun, true) {
        broken.since = broken.time;
    }
    let shards = match broken.waiting.pop_front() {
        Some(batch) => depart(world, entity, active, &mut broken, batch, most),
        None => Vec::new(),
    };
    broken.report(world, entity);
    let rest = broken.waiting.iter().map(|batch| batch.leaving.len() as u32).sum();
    broken::put_back(world, entity, broken);
    active.bump_revision();
    queue.shown.extend(shards.iter().map(|(shard, piece)| (*shard, entity, *piece)));
    Spares::shrink_to(world, most.saturating_sub(queue.shown.len()));
    let shards: Vec<Entity> = shards.into_iter().map(|(shard, _)| shard).collect();
    (!shards.is_empty()).then_some(Shattered { entity, shards, rest })
}

/// Makes shards and a hole of pieces. Returns the shards, no more than `most`, and which pieces they are.
fn depart(
    world: &mut World,
    entity: Entity,
    active: &mut Active,
    broken: &mut Broken,
    Batch { leaving, crumbs, spans, rects, uv }: Batch,
    most: usize,
) -> Vec<(Entity, [u32; 2])> {
    if !core::mem::take(&mut broken.is_fresh) {
        refresh(world, active, broken, &rects);
    }
    if let Some(holes) = &mut active.drawing.cutouts {
        holes.set(&spans, true);
    }
    punch(world, active, &spans, &rects);
    let start = broken.since;
    broken.crumbs.extend(crumbs.into_iter().map(|crumb| Crumb { start, ..crumb }));
    broken.pieces.reserve(leaving.len());
    let mut shown = Vec::with_capacity(leaving.len());
    for Leaving { number, plane, flight, seed, again, form, .. } in leaving {
        broken.end = broken.end.max(broken.since + f64::from(flight.end()));
        let is_spent = form.is_none() || shown.len() >= most;
        let pose = flight.pose((broken.time - broken.since) as f32);
        if !is_spent && pose.opacity > 0.0 {
            shown.push(ShownPiece { index: broken.pieces.len(), pose, form });
        }
        broken.pieces.push(Piece {
            cut: broken.cut.clone(),
            number,
            plane,
            id: broken.next,
            seed,
            start: broken.since,
            born: broken.since,
            flight,
            again,
            is_broken: false,
            stays_whole: false,
            part_of: None,
            uv,
            is_spent,
            body: None,
            spare: None,
            times: 0,
            level: 0,
        });
        (broken.next, broken.released) = (broken.next + 1, broken.released + 1);
    }
    broken.spawn(world, entity, &active.carrier, shown)
}

/// Bytes of a copy of the surface's picture on the CPU and the GPU.
fn copy_bytes(active: &Active) -> u64 {
    let bytes = 8 * u64::from(active.canvas.base.size.x) * u64::from(active.canvas.base.size.y);
    if active.canvas.has_mips { (4 * bytes).div_ceil(3) } else { bytes }
}

/// Whether the surface's picture can be copied.
fn can_copy_picture(world: &World, active: &Active) -> Result<(), ShardsError> {
    let diffuse = active.canvas.textures.diffuse.as_ref().ok_or(ShardsError::NoDiffuse)?;
    let needed = copy_bytes(active);
    let left =
        world.resource::<CrackBudget>().max_texture_bytes.saturating_sub(world.resource::<TextureMemory>().used());
    if needed > left {
        return Err(ShardsError::TextureBudget { needed, left });
    }
    let images = world.get_resource::<Assets<Image>>().ok_or(ShardsError::NoAssets { name: "Image" })?;
    images.get(diffuse).map(|_| ()).ok_or(ShardsError::NoDiffuse)
}

/// A copy of the surface's picture, in memory that is there, and its bytes.
fn copy_picture(
    world: &mut World,
    active: &Active,
    mut room: Vec<u8>,
) -> Result<(Handle<Image>, TextureBytes), ShardsError> {
    let diffuse = active.canvas.textures.diffuse.as_ref().ok_or(ShardsError::NoDiffuse)?;
    let mut images = world.get_resource_mut::<Assets<Image>>().ok_or(ShardsError::NoAssets { name: "Image" })?;
    let shown = images.get(diffuse).ok_or(ShardsError::NoDiffuse)?;
    room.clear();
    room.extend_from_slice(shown.data.as_deref().ok_or(ShardsError::NoDiffuse)?);
    let copy = textures::DIFFUSE.image(shown.size(), room, &shown.sampler).ok_or(ShardsError::NoDiffuse)?;
    let copy = images.add(copy);
    let mut uploads = world.resource_mut::<Uploads>();
    uploads.expect_whole();
    uploads.push_copy(diffuse.id(), copy.id());
    Ok((copy, world.resource::<TextureMemory>().count(copy_bytes(active))))
}

/// Brings what is about to leave up to date in the copy of the picture: more cracks have grown since.
fn refresh(world: &mut World, active: &Active, broken: &Broken, rects: &[TexelRect]) {
    let (Some(diffuse), Some(view)) = (&active.canvas.textures.diffuse, active.canvas.views.get(active.canvas.view))
    else {
        return;
    };
    let Some(holes) = &active.drawing.cutouts else { return };
    let Some(mut images) = world.get_resource_mut::<Assets<Image>>() else { return };
    // Without an asset event, which would upload the whole image.
    let Some(mut copy) = images.get_mut_untracked(&broken.whole).and_then(|image| image.data.take()) else { return };
    let (size, field) = (active.canvas.base.size, active.drawing.field.frame.size());
    let shown = TexelRect::whole(view.rect.size());
    // One more, for those who blend neighbouring texels.
    let rects = rects.iter().map(|rect| rect.grow(1, field).intersect(shown)).filter(|rect| !rect.is_empty());
    let mut changed = Vec::new();
    if let Some(shown) = images.get(diffuse).and_then(|image| image.data.as_ref()) {
        for rect in rects {
            holes.copy_present(shown, &mut copy, size, view.rect.min, rect);
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

/// Makes the surface transparent where pieces leave it: nothing is painted for that.
fn punch(world: &mut World, active: &mut Active, spans: &[Span], rects: &[TexelRect]) {
    let shown = active.canvas.view;
    for (_, view) in active.canvas.views.iter_mut().enumerate().filter(|(index, _)| *index != shown) {
        rects.iter().for_each(|rect| view.dirty.mark(*rect));
    }
    let (Some(diffuse), Some(view)) = (&active.canvas.textures.diffuse, active.canvas.views.get(shown)) else { return };
    let (size, origin, within) = (active.canvas.base.size, view.rect.min, view.rect.size());
    let Some(mut images) = world.get_resource_mut::<Assets<Image>>() else { return };
    // Without an asset event, which would upload the whole image.
    if let Some(data) = images.get_mut_untracked(diffuse).and_then(|image| image.data.as_mut()) {
        for &[y, from, to] in spans.iter().filter(|[y, ..]| *y < within.y) {
            cut_span(data, size, origin, [y, from.min(within.x), to.min(within.x)]);
        }
    }
    let mut uploads = world.resource_mut::<Uploads>();
    for rect in rects {
        let rect = rect.intersect(TexelRect::whole(within));
        uploads.push(diffuse.id(), TexelRect { min: rect.min + origin, max: rect.max + origin });
    }
}

/// The material of the sides.
#[cfg_attr(not(feature = "3d"), expect(unused_variables, reason = "only 3D shards have sides"))]
fn inside(
    world: &mut World,
    active: &Active,
    (settings, rim, plane): (&ShatterCracks, RimLook, &Plane),
    is_shell: bool,
    before: Option<UntypedHandle>,
) -> Option<UntypedHandle> {
    #[cfg(feature = "3d")]
    if let Some(inside) = &settings.inside {
        return active.carrier.is_solid.then(|| inside.clone().untyped());
    }
    let carrier = &active.carrier;
    if before.is_some() || !carrier.is_solid {
        return before;
    }
    // Texture coordinates of shells are pattern units, those of all others the entity's units.
    let unit = if is_shell { 1.0 } else { plane.size.y.abs() / active.cracks.growth.network().extent().y };
    carrier.kind.side_material(world, carrier, &SideLook { mean: active.canvas.base.mean(), rim, unit })
}

#[cfg(all(test, feature = "2d"))]
mod tests {
    use super::*;
    use crate::{
        plugin::{
            headless::{app, blank},
            prelude::*,
        },
        shatter::{Anchor, ShatterParams},
    };

    /// By count: the frames in which shards are asked for, made and there cut nothing, and paint nothing.
    #[test]
    fn no_frame_cuts_or_paints_for_shards() {
        let mut app = app(CrackBudget::default());
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::splat(64)));
        let settings = ShatterCracks {
            cut: ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT },
            anchor: Anchor::Nothing,
            ..default()
        };
        let sprite = (Sprite::from_image(image), CrackSurface::new(CrackPreset::GLASS), settings);
        let entity = app.world_mut().spawn(sprite).id();
        app.world_mut().trigger(CrackHit::uv(entity, Vec2::splat(0.5)).with_energy(2.0));
        app.update();
        while app.world().get::<CrackState>(entity).is_some_and(|state| state.status != CrackStatus::Done) {
            app.update();
        }
        for around in [Vec2::splat(0.2), Vec2::splat(0.8)] {
            let painted = |app: &App| cracked::active(app.world(), entity).map(|active| active.drawing.painted);
            let (before, shown) = (painted(&app), app.world().get::<CrackShards>(entity).map_or(0, |told| told.shown));
            app.world_mut().commands().entity(entity).shatter_cracks(ShatterRequest::around(around, 0.1));
            app.update();
            let is_made = |app: &App| {
                let requests = &app.world().resource::<ShardQueue>().requests;
                requests.iter().any(|request| request.work.as_ref().is_some_and(|(work, _)| work.is_done()))
            };
            while !is_made(&app) {
                std::thread::yield_now();
            }
            (0..22).for_each(|_| app.update());
            assert!(app.world().get::<CrackShards>(entity).is_some_and(|told| told.shown > shown));
            let active = cracked::active(app.world(), entity).expect("it has cracked");
            assert_eq!(painted(&app), before, "a whole frame's painting");
            assert!(active.canvas.views.iter().all(|view| view.dirty.is_empty()), "texels to paint");
        }
    }
}
