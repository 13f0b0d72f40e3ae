//! From requests to shards: they are made beside the frames, and a frame takes them up.

use super::{
    Broken, Shard, ShardsError, ShatterCracks, ShatterFailed, ShatterRequest, ShatterWhen, Shattered, Spares,
    body::Shown,
    broken::Piece,
    holes::{Span, cut_span},
    order::{Batch, Leaving, MOST_NEW, Made, Order},
};
use crate::{
    plugin::{
        CrackBudget, CrackState, CrackStatus,
        beside::{Beside, PATIENCE},
        error::Called,
        later::hold,
        paint::paint_now,
        surfaces::{Active, Surfaces},
        textures,
        upload::Uploads,
        warm,
    },
    raster::TexelRect,
};
use bevy::{asset::UntypedHandle, platform::time::Instant, prelude::*};

/// Frames from a request to its shards, at the least, where the renderer is ready to draw them: the same on every machine, however long
/// they take to make.
const FRAMES: u32 = 2;

/// One more for so many nodes of cracks, unless frames may take any time; where these are more, no frame waits for them.
const NODES: usize = 500;

/// And the most.
const MOST_FRAMES: u32 = 20;

/// Frames from a request to its shards.
fn frames(world: &World, active: &Active) -> u32 {
    if world.resource::<CrackBudget>().is_boundless() {
        return FRAMES;
    }
    let more = active.growth.network().nodes().len() / NODES;
    (FRAMES + u32::try_from(more).unwrap_or(MOST_FRAMES)).min(MOST_FRAMES)
}

/// A surface that is to shatter.
pub(in crate::plugin) struct Request {
    pub(in crate::plugin) entity: Entity,
    request: ShatterRequest,
    /// Once its shards are being made, and how many frames ago that was begun.
    work: Option<(Beside<Order, Result<Made, ShardsError>>, u32)>,
    /// How many of them it takes.
    frames: u32,
    /// When it was begun.
    since: Instant,
}

impl Request {
    pub(in crate::plugin) fn new(entity: Entity, request: ShatterRequest) -> Self {
        Self { entity, request, work: None, frames: FRAMES, since: Instant::now() }
    }
}

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
            let request = ShatterRequest { reach: settings.reach, ..ShatterRequest::ALL };
            // One that has not begun will do for both.
            let is_same = |other: &Request| (other.entity, other.request) == (entity, request) && other.work.is_none();
            if !surfaces.requests.iter().any(is_same) {
                surfaces.requests.push(Request::new(entity, request));
            }
        }
    }
}

/// Whether any surface is to shatter, or has begun to.
pub(in crate::plugin) fn any_requests(surfaces: Res<Surfaces>) -> bool {
    let is_waiting = |entity| surfaces.active.get(entity).is_some_and(Active::is_shattering);
    !surfaces.requests.is_empty() || surfaces.broken.iter().any(is_waiting)
}

impl Active {
    /// Whether some of what was released is still to leave.
    fn is_shattering(&self) -> bool {
        self.broken.as_ref().is_some_and(|broken| !broken.waiting.is_empty())
    }
}

/// Shatters the surfaces that are to, one request after the other.
pub(in crate::plugin) fn shatter_surfaces(world: &mut World) {
    let (mut told, mut failed) = (Vec::new(), Vec::new());
    hold(world, |world| {
        world.resource_scope(|world, mut surfaces: Mut<Surfaces>| {
            let requests = core::mem::take(&mut surfaces.requests);
            // Those that have begun first.
            for entity in surfaces.broken.clone() {
                told.extend(let_go(world, entity, &mut surfaces));
            }
            for request in requests {
                let entity = request.entity;
                let is_first = surfaces.requests.iter().all(|other| other.entity != entity);
                let left = world.resource::<CrackBudget>().max_texture_bytes.saturating_sub(surfaces.bytes);
                let Some(active) = surfaces.active.get_mut(&entity) else { continue };
                // The shards are to show what the surface will.
                if active.is_dirty || active.is_shattering() || !is_first {
                    surfaces.requests.push(request);
                    continue;
                }
                let is_warm = warm::can_break(world, entity, active);
                let outcome = match proceed(world, active, request, is_warm) {
                    Ok(Progress::Wait(request)) => {
                        surfaces.requests.push(request);
                        continue;
                    }
                    Ok(Progress::Made(made)) => {
                        let (bytes, was_broken) = (active.bytes, active.broken.is_some());
                        let outcome = release(world, entity, active, *made, left);
                        let (more, is_broken) = (active.bytes - bytes, active.broken.is_some());
                        surfaces.bytes += more;
                        if is_broken && !was_broken {
                            surfaces.broken.push(entity);
                        }
                        outcome
                    }
                    Err(error) => Err(error),
                };
                match outcome {
                    Ok(()) => told.extend(let_go(world, entity, &mut surfaces)),
                    Err(error) => failed.push(ShatterFailed { entity, error }),
                }
            }
        });
    });
    for mut event in told {
        event.shards.retain(|shard| world.get::<Shard>(*shard).is_some());
        world.trigger(event);
    }
    for event in failed {
        warn!("{} cannot shatter: {}", Called::of(world, event.entity), event.error);
        world.trigger(event);
    }
}

enum Progress {
    Wait(Request),
    Made(Box<Made>),
}

/// Begins to make what was asked for, waits for it, or has it. It is not to be had before `is_warm`.
fn proceed(world: &World, active: &Active, mut request: Request, is_warm: bool) -> Result<Progress, ShardsError> {
    let order = |request: &Request| Order::of(world, request.entity, active, &request.request);
    let made = match request.work.take() {
        None => {
            request.work = Some((Beside::start(order(&request)?, Order::make), 1));
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
    Ok(Progress::Made(Box::new(made)))
}

/// Counts the shards that are shown.
pub(super) fn count_shown(world: &World, surfaces: &mut Surfaces) -> usize {
    // Entities are used again: only those count that still are the same piece.
    surfaces.shards.retain(|&(entity, of, piece)| {
        world.get::<Shard>(entity).is_some_and(|shard| shard.surface == of && shard.piece == piece)
    });
    surfaces.shards.len()
}

/// The oldest shards go if there are too many with so many more.
pub(super) fn make_room(world: &mut World, surfaces: &mut Surfaces, more: usize) {
    let shown = count_shown(world, surfaces);
    let excess = (shown + more).saturating_sub(world.resource::<CrackBudget>().max_shards).min(shown);
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

/// Takes up what is to leave a surface.
fn release(world: &mut World, entity: Entity, active: &mut Active, made: Made, left: u64) -> Result<(), ShardsError> {
    if made.batches.is_empty() {
        return Ok(());
    }
    let is_first = active.broken.is_none();
    let Made { settings, rim, plane, grown, cut, is_new, support, batches, drawn, density, room, .. } = made;
    if is_first {
        can_copy_picture(world, active, left)?;
    }
    if is_new && !cut.carried().is_empty() {
        match drawn.filter(|drawn| drawn.fits(active)) {
            Some(drawn) => drawn.put_on(world, active),
            None => {
                active.stamp_lines(cut.carried());
                paint_now(world, active);
            }
        }
    }
    let mut broken = match active.broken.take() {
        Some(broken) => broken,
        None => {
            let picture = copy_picture(world, active, room)?;
            (active.carrier.kind.open)(world, entity, &active.carrier, true);
            Box::new(Broken::new((cut.clone(), support.clone()), grown, settings.clone(), picture, plane, active))
        }
    };
    if is_new && !cut.carried().is_empty() {
        broken.carried.push(cut.shared_carried());
    }
    broken.inside = inside(world, active, &settings, rim.bright, broken.inside.take());
    (broken.cut, broken.support, broken.grown) = (cut, support, grown);
    (broken.settings, broken.plane, broken.rim) = (settings, plane, rim);
    broken.is_fresh = is_first;
    (broken.waiting, broken.since, broken.has_begun) = (batches, broken.time, false);
    if is_first {
        active.bytes += broken.bytes;
    }
    broken.tell(world, entity);
    active.broken = Some(broken);
    active.growth.set_density(density);
    Ok(())
}

/// Lets the pieces go that leave a surface in this frame, if there is room for any.
fn let_go(world: &mut World, entity: Entity, surfaces: &mut Surfaces) -> Option<Shattered> {
    let budget = world.resource::<CrackBudget>();
    let (most, is_boundless) = (budget.max_shards, budget.is_boundless());
    let batch = surfaces.active.get(&entity)?.broken.as_ref()?.waiting.front()?;
    let new = batch.leaving.iter().filter(|leaving| leaving.form.is_some()).count();
    if new > surfaces.new_shards && surfaces.new_shards < MOST_NEW && !is_boundless {
        // Others have made some in this frame.
        return None;
    }
    surfaces.new_shards = surfaces.new_shards.saturating_sub(new);
    make_room(world, surfaces, new);
    let active = surfaces.active.get_mut(&entity)?;
    let mut broken = active.broken.take()?;
    if !core::mem::replace(&mut broken.has_begun, true) {
        broken.since = broken.time;
    }
    let shards = match broken.waiting.pop_front() {
        Some(batch) => depart(world, entity, active, &mut broken, batch, most),
        None => Vec::new(),
    };
    broken.tell(world, entity);
    let rest = broken.waiting.iter().map(|batch| batch.leaving.len() as u32).sum();
    active.broken = Some(broken);
    active.renew();
    surfaces.shards.extend(shards.iter().map(|(shard, piece)| (*shard, entity, *piece)));
    Spares::shrink_to(world, most.saturating_sub(surfaces.shards.len()));
    let shards: Vec<Entity> = shards.into_iter().map(|(shard, _)| shard).collect();
    (!shards.is_empty()).then_some(Shattered { entity, shards, rest })
}

/// Makes shards and a hole of pieces. Returns the shards, no more than `most`, and which pieces they are.
fn depart(
    world: &mut World,
    entity: Entity,
    active: &mut Active,
    broken: &mut Broken,
    Batch { leaving, spans, rects, uv }: Batch,
    most: usize,
) -> Vec<(Entity, [u32; 2])> {
    if !core::mem::take(&mut broken.is_fresh) {
        refresh(world, active, broken, &rects);
    }
    broken.holes.set(&spans, true);
    punch(world, active, &spans, &rects);
    broken.pieces.reserve(leaving.len());
    let mut shown = Vec::with_capacity(leaving.len());
    for Leaving { number, flight, seed, again, form, .. } in leaving {
        broken.end = broken.end.max(broken.since + f64::from(flight.end()));
        let is_spent = form.is_none() || shown.len() >= most;
        let pose = flight.pose((broken.time - broken.since) as f32);
        if !is_spent && pose.opacity > 0.0 {
            shown.push(Shown { index: broken.pieces.len(), pose, form });
        }
        broken.pieces.push(Piece {
            cut: broken.cut.clone(),
            number,
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

/// A copy of the surface's picture, in memory that is there, and its bytes.
fn copy_picture(world: &mut World, active: &Active, mut room: Vec<u8>) -> Result<(Handle<Image>, u64), ShardsError> {
    let diffuse = active.textures.diffuse.as_ref().ok_or(ShardsError::NoDiffuse)?;
    let mut images = world.get_resource_mut::<Assets<Image>>().ok_or(ShardsError::NoAssets { name: "Image" })?;
    let shown = images.get(diffuse).ok_or(ShardsError::NoDiffuse)?;
    room.clear();
    room.extend_from_slice(shown.data.as_deref().ok_or(ShardsError::NoDiffuse)?);
    let copy = textures::DIFFUSE.image(shown.size(), room, &shown.sampler).ok_or(ShardsError::NoDiffuse)?;
    let copy = images.add(copy);
    world.resource_mut::<Uploads>().expect_whole();
    Ok((copy, copy_bytes(active)))
}

/// Brings what is about to leave up to date in the copy of the picture: more cracks have grown since.
fn refresh(world: &mut World, active: &Active, broken: &Broken, rects: &[TexelRect]) {
    let (Some(diffuse), Some(view)) = (&active.textures.diffuse, active.views.get(active.view)) else { return };
    let Some(mut images) = world.get_resource_mut::<Assets<Image>>() else { return };
    // Without an asset event, which would upload the whole image.
    let Some(mut copy) = images.get_mut_untracked(&broken.whole).and_then(|image| image.data.take()) else { return };
    let (size, field) = (active.base.size, active.field.frame.size());
    let shown = TexelRect::whole(view.rect.size());
    // One more, for those who blend neighbouring texels.
    let rects = rects.iter().map(|rect| rect.grow(1, field).intersect(shown)).filter(|rect| !rect.is_empty());
    let mut changed = Vec::new();
    if let Some(shown) = images.get(diffuse).and_then(|image| image.data.as_ref()) {
        for rect in rects {
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

/// Makes the surface transparent where pieces leave it: nothing is painted for that.
fn punch(world: &mut World, active: &mut Active, spans: &[Span], rects: &[TexelRect]) {
    let shown = active.view;
    for (_, view) in active.views.iter_mut().enumerate().filter(|(index, _)| *index != shown) {
        rects.iter().for_each(|rect| view.dirty.mark(*rect));
    }
    let (Some(diffuse), Some(view)) = (&active.textures.diffuse, active.views.get(shown)) else { return };
    let (size, origin, within) = (active.base.size, view.rect.min, view.rect.size());
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
    settings: &ShatterCracks,
    bright: f32,
    before: Option<UntypedHandle>,
) -> Option<UntypedHandle> {
    #[cfg(feature = "3d")]
    if let Some(inside) = &settings.inside {
        return active.carrier.kind.is_solid.then(|| inside.clone().untyped());
    }
    let carrier = &active.carrier;
    if before.is_some() || !carrier.kind.is_solid {
        return before;
    }
    (carrier.kind.inside)(world, carrier, active.base.mean(), bright)
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
            cut: ShatterParams { carry_on: true, ..ShatterParams::DEFAULT },
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
            let painted = |app: &App| app.world().resource::<Surfaces>().active[&entity].painted;
            let (before, shown) = (painted(&app), app.world().get::<CrackShards>(entity).map_or(0, |told| told.shown));
            app.world_mut().commands().entity(entity).shatter_cracks(ShatterRequest::around(around, 0.1));
            app.update();
            let is_made = |app: &App| {
                let requests = &app.world().resource::<Surfaces>().requests;
                requests.iter().any(|request| request.work.as_ref().is_some_and(|(work, _)| work.is_done()))
            };
            while !is_made(&app) {
                std::thread::yield_now();
            }
            (0..22).for_each(|_| app.update());
            assert!(app.world().get::<CrackShards>(entity).is_some_and(|told| told.shown > shown));
            let active = &app.world().resource::<Surfaces>().active[&entity];
            assert_eq!(painted(&app), before, "a whole frame's painting");
            assert!(active.views.iter().all(|view| view.dirty.is_empty()), "texels to paint");
        }
    }
}
