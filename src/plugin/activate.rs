//! From hits to cracks: a surface gets its growth and textures at its first hit.

use super::{
    CrackBudget, CrackClock, CrackError, CrackFailed, CrackState, CrackStats, CrackStatus, CrackTextures, HitPoint,
    budget::{FrameClock, Timer},
    carrier::{self, Found, Kind},
    clock,
    error::Called,
    mask, picture,
    plan::{Blank, Draft, Plan, Readings},
    prepare,
    queue::{HitQueue, QueuedHit},
    shards::Struck,
    surfaces::{Active, Surfaces},
    textures::{self, TextureKind},
    upload::Uploads,
};
use crate::{CrackPreset, growth::HitOutcome, paint::LookTable, pattern::SurfaceFrame, raster::TexelRect};
use bevy::prelude::*;

/// Share of the frame's budget after which no further hit is applied.
const SHARE: f32 = 0.4;

/// So many surfaces in line are looked at that may be made beside the frames.
const MAX_OTHERS: usize = 16;

/// So many surfaces that are not ready are looked at when there is no time.
const MAX_LOOKS: usize = 64;

/// Places for markers that a hit looks at between two looks at the clock.
const SLICE: u32 = 1024;

/// The largest depth of parallax that still looks like depth, in units of the texture.
const MAX_PARALLAX: f32 = 0.1;

/// Shards fly no further after harder hits: the most that [`ShatterRequest::energy`](super::ShatterRequest::energy) may be.
const HARDEST: f32 = 1000.0;

/// Whether any hit waits, or has markers to lay out.
pub(super) fn any_hits(queue: Res<HitQueue>, surfaces: Res<Surfaces>) -> bool {
    queue.has_any() || !surfaces.laying_out.is_empty()
}

/// Applies the hits that wait, in turns, as many as the budget allows.
pub(super) fn apply_hits(world: &mut World) {
    let timer = world.resource::<FrameClock>().start(world.resource::<CrackBudget>(), SHARE);
    let (mut looks, mut has_worked) = (0, lay_out(&mut world.resource_mut::<Surfaces>(), &timer));
    world.resource_mut::<HitQueue>().unpark();
    while let Some(entity) = world.resource::<HitQueue>().next() {
        if has_worked && timer.is_over() {
            make_others(world);
            break;
        }
        // A hit comes after the markers of the one before it, all in their places.
        match prepare_some(&mut world.resource_mut::<Surfaces>(), entity) {
            Some(true) => {
                has_worked = true;
                continue;
            }
            Some(false) => {
                world.resource_mut::<HitQueue>().park();
                continue;
            }
            None => {}
        }
        // A hit beside a surface makes nothing for it.
        let ready = if is_missed(world, entity) { Ok(true) } else { prepare::make_ready(world, entity) };
        let is_ready = !matches!(ready, Ok(false));
        match ready {
            // Observers may have healed it.
            _ if world.resource::<HitQueue>().next() != Some(entity) => {}
            Ok(true) => apply_next(world, entity, &timer),
            Ok(false) => {
                set_status(world, entity, CrackStatus::Waiting);
                world.resource_mut::<HitQueue>().park();
                looks += 1;
            }
            Err(error) => fail(world, entity, error),
        }
        has_worked |= is_ready;
        // Those that wait are not to keep others from the one hit that every frame has time for.
        if timer.is_over() && looks >= MAX_LOOKS {
            make_others(world);
            break;
        }
    }
    world.resource_mut::<FrameClock>().stop(&timer);
}

/// Goes on with the markers of a surface that have no places yet; `None` if all have, `false` if they are being laid out, which comes first.
fn prepare_some(surfaces: &mut Surfaces, entity: Entity) -> Option<bool> {
    let growth = &mut surfaces.active.get_mut(&entity)?.growth;
    growth.is_preparing().then(|| {
        let has_places = !growth.is_laying_out();
        if has_places {
            growth.prepare_step(clock::SLICE);
        }
        has_places
    })
}

/// Goes on with the markers of hits, the oldest first, one slice at least. Returns whether there was any.
fn lay_out(surfaces: &mut Surfaces, timer: &Timer) -> bool {
    let Surfaces { active, laying_out, .. } = surfaces;
    let mut has_worked = false;
    while let Some(entity) = laying_out.front().filter(|_| !has_worked || !timer.is_over()) {
        let is_left = active.get_mut(entity).is_some_and(|active| {
            has_worked |= active.growth.is_laying_out();
            active.growth.lay_out(SLICE)
        });
        if !is_left {
            laying_out.pop_front();
        }
    }
    has_worked
}

/// Has surfaces made beside the frames for whose hits this one has no time.
fn make_others(world: &mut World) {
    // The first of them comes in the next frame in any case.
    let others: Vec<Entity> = world.resource::<HitQueue>().turns().skip(1).take(MAX_OTHERS).collect();
    for entity in others {
        // An observer of another may have healed it.
        if world.resource::<HitQueue>().first(entity).is_none() || is_missed(world, entity) {
            continue;
        }
        match prepare::make_beside(world, entity) {
            Ok(true) => set_status(world, entity, CrackStatus::Waiting),
            Ok(false) => {}
            Err(error) => fail(world, entity, error),
        }
    }
}

/// Applies the first hit of the surface in turn, which is ready.
fn apply_next(world: &mut World, entity: Entity, timer: &Timer) {
    let hit = with_queue(world, |_, queue, stats| queue.take(stats));
    if let Some(hit) = hit {
        let outcome = apply(world, entity, hit, timer);
        with_queue(world, |world, queue, stats| match outcome {
            Ok(HitOutcome::Started(_)) => stats.applied += 1,
            Ok(HitOutcome::Merged(_)) => stats.merged += 1,
            Ok(HitOutcome::Nothing) => stats.ignored += 1,
            Ok(HitOutcome::Rejected(reason)) => queue.reject(&Called::of(world, entity), &reason.to_string(), stats),
            Err(reason) => queue.reject(&Called::of(world, entity), reason, stats),
        });
    }
    if world.get::<CrackState>(entity).is_some_and(|state| state.status == CrackStatus::Waiting) {
        set_status(world, entity, CrackStatus::Untouched);
    }
}

/// Works on the queue and its counts. Nothing of a game runs meanwhile: whatever it does finds the queue in the world.
fn with_queue<T>(world: &mut World, work: impl FnOnce(&World, &mut HitQueue, &mut CrackStats) -> T) -> T {
    world.resource_scope(|world, mut queue: Mut<HitQueue>| {
        let mut stats = *world.resource::<CrackStats>();
        let result = work(world, &mut queue, &mut stats);
        *world.resource_mut::<CrackStats>() = stats;
        result
    })
}

/// Whether the first hit of a surface without cracks is to be refused for where it lands. If not, the hit knows its place from then on: it
/// may have to wait, and a mesh has many triangles to look at.
fn is_missed(world: &mut World, entity: Entity) -> bool {
    if world.resource::<Surfaces>().active.contains_key(&entity) {
        return false;
    }
    let Some(hit) = world.resource::<HitQueue>().first(entity) else { return false };
    let (Some(kind), Found::Shown(shown)) = carrier::inspect(world, entity) else { return false };
    let is_there = shown.pictures().all(|picture| matches!(picture::is_loaded(world, picture), Ok(true)));
    if !is_there {
        return false;
    }
    match locate(world, entity, kind, hit.at) {
        Ok(uv) => {
            world.resource_mut::<HitQueue>().place_first(entity, uv);
            false
        }
        Err(_) => true,
    }
}

/// Texture coordinates of a hit, within the surface.
fn locate(world: &World, entity: Entity, kind: &Kind, at: HitPoint) -> Result<Vec2, &'static str> {
    let uv = match at {
        HitPoint::Uv(uv) => uv,
        HitPoint::Local(point) | HitPoint::World(point) => (kind.locate)(world, entity, point)?,
    };
    // Not a number is not within either.
    let is_within = uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all();
    is_within.then_some(uv).ok_or("it lies off the surface")
}

fn apply(world: &mut World, entity: Entity, hit: QueuedHit, timer: &Timer) -> Result<HitOutcome, &'static str> {
    const GONE: &str = "the surface is gone";
    let active = world.resource::<Surfaces>().active.get(&entity);
    let kind = active.map(|active| active.carrier.kind).or_else(|| carrier::inspect(world, entity).0).ok_or(GONE)?;
    let is_blank = active.is_some_and(|active| active.growth.network().nodes().is_empty());
    let at = (kind.aim)(world, entity, &hit, is_blank);
    let uv = locate(world, entity, kind, at)?;
    let mut surfaces = world.resource_mut::<Surfaces>();
    let active = surfaces.active.get_mut(&entity).ok_or(GONE)?;
    let frame = active.field.frame;
    let texel = frame.to_texel(frame.uv_to_pos(uv)).max(Vec2::ZERO).as_uvec2();
    if active.broken.as_ref().is_some_and(|broken| broken.holes.contains(texel)) {
        return Err("a shard has left the surface there");
    }
    if active.surface.alpha_mask
        && let Some(view) = active.views.get(active.view)
        && active.base.is_hole(view.rect.min + (uv * frame.size().as_vec2()).as_uvec2().min(view.rect.size() - 1))
    {
        return Err("the surface is transparent there");
    }
    let pos = uv * active.growth.network().extent();
    active.freeze_if_full();
    let outcome = active.growth.begin_hit(pos, hit.energy);
    let mut is_left = active.growth.lay_out(SLICE);
    while is_left && !timer.is_over() {
        is_left = active.growth.lay_out(SLICE);
    }
    if matches!(outcome, HitOutcome::Started(_) | HitOutcome::Merged(_)) {
        let energy = hit.energy.min(HARDEST);
        active.struck = Some(Struck { pos, energy, direction: hit.direction });
        active.hits += 1;
        active.note_hit();
        if is_left && !surfaces.laying_out.contains(&entity) {
            surfaces.laying_out.push_back(entity);
        }
        surfaces.start_growing(entity);
        // The nodes it starts with show at once.
        surfaces.soil(entity);
        let turned = surfaces.active.get_mut(&entity).and_then(Active::turn_forwards);
        if let (Some(turned), Some(mut clock)) = (turned, world.get_mut::<CrackClock>(entity)) {
            *clock = turned;
        }
        set_status(world, entity, CrackStatus::Growing);
    }
    Ok(outcome)
}

pub(super) fn set_status(world: &mut World, entity: Entity, status: CrackStatus) {
    if let Some(mut state) = world.get_mut::<CrackState>(entity)
        && state.status != status
    {
        state.status = status;
    }
}

/// Gives up a surface: refuses its hits and says why, once for each cause.
pub(super) fn fail(world: &mut World, entity: Entity, error: CrackError) {
    prepare::cancel(world, entity);
    with_queue(world, |_, queue, stats| queue.purge(entity, stats));
    let status = CrackStatus::Failed(error.clone());
    let Some(mut state) = world.get_mut::<CrackState>(entity) else { return };
    if state.status != status {
        state.status = status;
        warn!("{} cannot crack: {error}", Called::of(world, entity));
        world.trigger(CrackFailed { entity, error });
    }
}

/// Makes growth and textures for a surface that has none; `false` if its pictures are not there yet.
pub(super) fn make_ready_now(world: &mut World, entity: Entity) -> Result<bool, CrackError> {
    if world.resource::<Surfaces>().active.contains_key(&entity) {
        return Ok(true);
    }
    Plan::new(world, entity)?.map_or(Ok(false), |plan| make_now(world, entity, plan))
}

/// Makes growth and textures in this frame; `false` if its mask is not there yet.
pub(super) fn make_now(world: &mut World, entity: Entity, plan: Plan) -> Result<bool, CrackError> {
    plan.check_mesh(world, entity)?;
    let draft = plan.pictures.clone().draft(world, &plan.shown)?;
    let Some(mask) = mask::resolve(world, plan.mask(), &plan.shown, &draft)? else { return Ok(false) };
    let read = Readings { base: draft.base.clone(), mask };
    let Blank { growth, field, look } = Blank::new(&plan.surface, &plan.preset, &read, plan.pictures.rect)?;
    let textures = make_textures(world, &draft, None)?;
    let ground = plan.ground(world, read, look, textures);
    install(world, entity, Active::new(ground, growth, field));
    Ok(true)
}

/// Puts a surface among those that crack.
pub(super) fn install(world: &mut World, entity: Entity, mut active: Active) {
    if let Some(mut clock) = world.get_mut::<CrackClock>(entity) {
        active.follow(clock.bypass_change_detection());
    }
    attach(world, entity, &mut active);
    let mut surfaces = world.resource_mut::<Surfaces>();
    surfaces.bytes += active.bytes;
    surfaces.own(entity, &active);
    surfaces.active.insert(entity, active);
    tell_textures(world, entity);
}

/// Makes the entity show the surface's textures.
pub(super) fn attach(world: &mut World, entity: Entity, active: &mut Active) {
    let relief = (active.preset.look.relief / active.field.frame.extent().max_element()).min(MAX_PARALLAX);
    (active.carrier.kind.attach)(world, entity, &mut active.carrier, &active.textures, relief);
}

/// Gives the entity the component that names its textures. Observers and commands that wait run then, and may heal the surface.
pub(super) fn tell_textures(world: &mut World, entity: Entity) {
    let textures = world.resource::<Surfaces>().active.get(&entity).map(|active| active.textures.clone());
    if let (Some(textures), Ok(mut entity)) = (textures, world.get_entity_mut(entity)) {
        entity.insert(textures);
    }
}

/// Where the cracks of a surface lie that shows `rect`.
pub(super) fn frame(rect: TexelRect) -> Result<SurfaceFrame, CrackError> {
    SurfaceFrame::new(rect.size()).map_err(|error| CrackError::Size { width: error.width, height: error.height })
}

/// The look of a surface, ready to paint with.
pub(super) fn look(preset: &CrackPreset, frame: SurfaceFrame) -> Result<LookTable, CrackError> {
    LookTable::new(&preset.look, frame.texels_per_unit())
        .map_err(|error| CrackError::Preset { reason: error.to_string() })
}

/// Makes the textures of a surface, into the images of `reuse` if given.
pub(super) fn make_textures(
    world: &mut World,
    draft: &Draft,
    reuse: Option<&CrackTextures>,
) -> Result<CrackTextures, CrackError> {
    world.resource_mut::<Uploads>().expect_whole();
    let mut images = world.get_resource_mut::<Assets<Image>>().ok_or(CrackError::NoImages)?;
    let Draft { base, plan } = draft;
    let mut add = |kind: &TextureKind, old: Option<&Option<Handle<Image>>>| -> Result<_, CrackError> {
        if !(kind.is_wanted)(plan.maps) {
            return Ok(None);
        }
        let UVec2 { x: width, y: height } = base.size;
        let image =
            kind.image(base.size, (kind.texels)(base), &plan.sampler).ok_or(CrackError::Size { width, height })?;
        if let Some(Some(old)) = old
            && let Some(mut place) = images.get_mut(old)
        {
            *place = image;
            return Ok(Some(old.clone()));
        }
        Ok(Some(images.add(image)))
    };
    Ok(CrackTextures {
        diffuse: add(&textures::DIFFUSE, reuse.map(|t| &t.diffuse))?,
        normal: add(&textures::NORMAL, reuse.map(|t| &t.normal))?,
        depth: add(&textures::DEPTH, reuse.map(|t| &t.depth))?,
        emissive: add(&textures::EMISSIVE, reuse.map(|t| &t.emissive))?,
    })
}

#[cfg(all(test, feature = "2d"))]
mod tests {
    use super::*;
    use crate::{
        growth::CrackGrowth,
        plugin::{
            CrackHit, CrackSurface,
            headless::{app, blank},
        },
    };

    /// Fault B5: a frame without time looks at one slice of places, however many markers hits make and however many hits there are, and
    /// the cracks are those of hits that take effect at once.
    #[test]
    fn b5_the_markers_of_hits_are_laid_out_within_the_budget() {
        let preset = CrackPreset::TEMPERED_GLASS.scaled(0.3);
        let mut app = app(CrackBudget { milliseconds: 0.0, ..default() });
        let places = [Vec2::splat(0.5), Vec2::new(0.2, 0.7)];
        let entities: Vec<Entity> = (0..3)
            .map(|seed| {
                let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::splat(64)));
                let surface = CrackSurface::new(preset.clone()).with_seed(seed);
                app.world_mut().spawn((Sprite::from_image(image), surface)).id()
            })
            .collect();
        app.update();
        for (entity, at) in entities.iter().flat_map(|entity| places.map(|at| (*entity, at))) {
            app.world_mut().trigger(CrackHit::uv(entity, at));
        }
        let made = |app: &App| -> u32 {
            let active = &app.world().resource::<Surfaces>().active;
            entities.iter().filter_map(|entity| active.get(entity)).map(|active| active.growth.census().total).sum()
        };
        let (mut before, mut frames, mut has_waited) = (0, 0, false);
        loop {
            app.update();
            frames += 1;
            let now = made(&app);
            assert!(now - before <= SLICE, "{} markers in a frame", now - before);
            before = now;
            let surfaces = app.world().resource::<Surfaces>();
            has_waited |=
                surfaces.active.values().any(|active| active.growth.is_laying_out() && active.growth.steps() == 0);
            let is_done = |entity: &Entity| surfaces.active.get(entity).is_some_and(|active| active.hits == 2);
            if entities.iter().all(is_done) && surfaces.laying_out.is_empty() {
                break;
            }
            assert!(frames < 20_000, "they never come");
        }
        assert!(has_waited && frames > 100, "{frames} frames");
        let stats = app.world().resource::<CrackStats>();
        assert_eq!((stats.sent, stats.applied, stats.queued), (6, 6, 0));
        for (seed, entity) in (0..).zip(&entities) {
            let growth = &app.world().resource::<Surfaces>().active[entity].growth;
            let mut at_once = CrackGrowth::new(preset.growth.clone(), Vec2::ONE, seed).expect("it is valid");
            at_once.hit(places[0], 1.0);
            // The other hit came after as many steps as there were by then.
            let first_of_second = growth.network().nodes().iter().position(|node| node.impact == 1);
            let born = first_of_second.map_or(0, |node| growth.network().nodes()[node].birth);
            while at_once.steps() < born && at_once.step().grew() {}
            at_once.hit(places[1], 1.0);
            while at_once.steps() < growth.steps() && at_once.step().grew() {}
            assert_eq!(at_once.network().nodes(), growth.network().nodes(), "surface {seed}");
        }
    }
}
