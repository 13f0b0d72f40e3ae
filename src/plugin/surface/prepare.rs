//! Surfaces that are made by background tasks: what the first hit on a large picture needs takes longer than a frame may.

use super::active::Active;
use super::cracked::has_cracked;
use super::create::{install, make_now, report_failure};
use super::inputs::{BaseAndMask, BlankSurface, Copies, SurfaceInputs};
use super::plan::Plan;
use super::queues::Queues;
use super::unfold::unfold;
use super::warm;
use crate::CrackPreset;
use crate::plugin::api::textures::MAPS;
use crate::plugin::api::{CrackBudget, CrackError, CrackSurface};
use crate::plugin::gpu::buffer::Stager;
use crate::plugin::gpu::textures::{self, Picture};
use crate::plugin::gpu::uploads::Uploads;
use crate::plugin::jobs::background::{BackgroundJob, PATIENCE, drop_in_background, guarded_as};
use crate::plugin::jobs::copy::{CopyProgress, MAX_BYTES, PictureCopies};
use crate::plugin::jobs::frame_time::{FrameClock, Timer};
use crate::plugin::jobs::threads::Threads;
use crate::plugin::source::picture::{BaseKey, BasePictures};
use crate::raster::TexelRect;
use bevy::{
    ecs::entity::{EntityHashMap, EntityHashSet},
    platform::time::Instant,
    prelude::*,
    render::renderer::RenderDevice,
};
use std::collections::VecDeque;

/// Texels up to which the frame of the first hit makes a surface itself.
const MAX_AT_ONCE: u64 = 512 * 512;

/// Share of the frame's budget after which no more is copied.
const SHARE: f32 = 0.3;

/// Texels up to which a surface is never made by a background task: a task would cost more.
const MIN_BESIDE: u64 = 128 * 128;

/// Texels of the larger ones that are on their way at once for each thread, if there is more than one.
const PER_THREAD: u64 = 4 << 20;

/// Other surfaces that are on their way at once for each thread: some wait for frames.
const SMALL_PER_THREAD: u64 = 16;

/// How often a surface may change while it is made by a background task; then a frame makes it.
const MAX_ROUNDS: u32 = 3;

/// Wanted surfaces that are looked at in a frame.
const MAX_WANTED: usize = 16;

/// Frames that a picture on its way to the renderer is waited for: it may have stopped to draw.
pub(crate) const MAX_UPLOAD_FRAMES: u32 = 16;

/// Surfaces that are being made.
#[derive(Resource, Default)]
pub(crate) struct Preparations {
    list: Vec<(Entity, Preparation)>,
    /// Those that are to be made without a hit, in order, each once.
    wanted: Wanted,
    /// When a task was last done.
    moved: Option<Instant>,
    /// How often a surface had to begin again.
    rounds: EntityHashMap<u32>,
}

/// Entities in a queue, each once.
#[derive(Default)]
struct Wanted {
    queue: VecDeque<Entity>,
    all: EntityHashSet,
}

impl Wanted {
    fn push(&mut self, entity: Entity) {
        if self.all.insert(entity) {
            self.queue.push_back(entity);
        }
    }

    fn pop(&mut self) -> Option<Entity> {
        let next = self.queue.pop_front()?;
        self.all.remove(&next);
        Some(next)
    }

    fn remove(&mut self, entity: Entity) {
        if self.all.remove(&entity) {
            self.queue.retain(|wanted| *wanted != entity);
        }
    }
}

impl Preparations {
    /// Has a surface made, though nothing hits it.
    pub(crate) fn want(&mut self, entity: Entity) {
        self.wanted.push(entity);
    }

    /// Surfaces that are to be made, though nothing hits them.
    #[cfg(any(feature = "2d", feature = "3d"))]
    pub(crate) fn wanted(&self) -> impl Iterator<Item = Entity> + '_ {
        self.wanted.queue.iter().copied()
    }

    /// What was read of the picture before this frame has changed.
    pub(crate) fn forget_picture(&mut self, picture: AssetId<Image>, frame: u64) {
        for (_, Preparation { plan, stage, .. }) in &mut self.list {
            if plan.forget_picture(picture, frame)
                && let Stage::Reading(reading, _) = stage
            {
                reading.forget(picture);
            }
        }
    }

    /// Whether there is room for one more: of those that are hit small ones and others do not wait for one another, and neither
    /// for those that are not.
    fn has_room(&self, plan: &Plan, is_wanted: bool, threads: u64) -> bool {
        let small = is_small(plan);
        let alike =
            |other: &&Preparation| other.is_wanted == is_wanted && (is_wanted || is_small(&other.plan) == small);
        let others = || self.list.iter().map(|(_, other)| other).filter(alike);
        match (is_wanted, small) {
            (true, _) => (others().count() as u64) < threads,
            (false, true) => (others().count() as u64) < SMALL_PER_THREAD * threads,
            (false, false) => {
                let sum = others().map(|other| texels(&other.plan)).sum::<u64>();
                sum == 0 || sum + texels(plan) <= PER_THREAD * threads
            }
        }
    }

    /// Whether small surfaces are made by background tasks.
    fn has_small(&self) -> bool {
        self.list.iter().any(|(_, other)| !other.is_wanted && is_small(&other.plan))
    }

    fn has_changed_often(&self, entity: Entity) -> bool {
        self.rounds.get(&entity).is_some_and(|rounds| *rounds >= MAX_ROUNDS)
    }

    fn is_making(&self, entity: Entity) -> bool {
        self.list.iter().any(|(made, _)| *made == entity)
    }

    fn take(&mut self, entity: Entity) -> Option<Preparation> {
        let index = self.list.iter().position(|(made, _)| *made == entity)?;
        Some(self.list.swap_remove(index).1)
    }
}

/// Whether any surface is to be made.
pub(crate) fn any_preparing(preparations: Res<Preparations>) -> bool {
    !preparations.list.is_empty() || !preparations.wanted.queue.is_empty()
}

/// Makes nothing of a surface any more.
pub(crate) fn cancel(world: &mut World, entity: Entity) {
    if let Some(mut preparations) = world.get_resource_mut::<Preparations>() {
        preparations.wanted.remove(entity);
        preparations.rounds.remove(&entity);
        if let Some(preparation) = preparations.take(entity) {
            drop_in_background(preparation);
        }
    }
}

/// Gives up a surface: makes nothing of it any more, refuses its hits and says why, once for each cause.
pub(crate) fn fail(world: &mut World, entity: Entity, error: CrackError) {
    cancel(world, entity);
    report_failure(world, entity, error);
}

/// A surface on its way.
struct Preparation {
    plan: Box<Plan>,
    key: BaseKey,
    stage: Stage,
    /// When the stage began.
    since: Instant,
    /// Whether it is made without a hit.
    is_wanted: bool,
}

enum Stage {
    /// Pictures are copied.
    Reading(PictureCopies, Box<SurfaceInputs>),
    Making(BackgroundJob<Work, Result<Box<PreparedSurface>, CrackError>>),
    /// Its textures are on their way to the renderer, for this many frames.
    Uploading(Box<PreparedSurface>, u32),
}

/// What a task makes a surface from.
struct Work {
    raw: Box<SurfaceInputs>,
    copies: Vec<Image>,
    surface: CrackSurface,
    preset: CrackPreset,
    stager: Option<Stager>,
}

struct PreparedSurface {
    read: BaseAndMask,
    blank: BlankSurface,
    /// The texels of each texture.
    pictures: [Option<Picture>; MAPS],
}

impl Work {
    fn make(self) -> Result<Box<PreparedSurface>, CrackError> {
        guarded_as(
            |reason| CrackError::Textures { reason },
            || {
                let Self { raw, copies, surface, preset, stager } = self;
                let read = raw.read(&copies)?;
                let blank = BlankSurface::new(&surface, &preset, &read, raw.plan.rect)?;
                let texels = textures::texels(raw.plan.maps, &read.base);
                let pictures = textures::stage(texels, read.base.size, stager.as_ref());
                Ok(Box::new(PreparedSurface { read, blank, pictures }))
            },
        )
    }
}

/// Makes a surface ready that has not cracked; `false` if it is not yet.
pub(crate) fn make_ready(world: &mut World, entity: Entity) -> Result<bool, CrackError> {
    ready(world, entity, false)
}

fn ready(world: &mut World, entity: Entity, is_wanted: bool) -> Result<bool, CrackError> {
    if has_cracked(world, entity) {
        return Ok(true);
    }
    let preparations = world.resource::<Preparations>();
    if preparations.is_making(entity) {
        return Ok(false);
    }
    if !warm::can_crack(world, entity) {
        return Ok(false);
    }
    if !unfold(world, entity) {
        return Ok(false);
    }
    let preparations = world.resource::<Preparations>();
    // One of many comes when it is its turn: the others take some time of the frames already.
    let (is_late, is_one_of_many) = (preparations.has_changed_often(entity), preparations.has_small());
    let Some(plan) = Plan::new(world, entity)? else { return Ok(false) };
    match threads(world) {
        Some(threads) if !is_late && !is_tiny(&plan) && (is_one_of_many || is_wanted || !is_small(&plan)) => {
            begin(world, entity, plan, is_wanted, threads).and(Ok(false))
        }
        _ => {
            world.resource_mut::<Preparations>().rounds.remove(&entity);
            make_now(world, entity, plan)
        }
    }
}

/// Has a surface made by a background task that is worth it; `false` if nothing was begun.
pub(crate) fn make_beside(world: &mut World, entity: Entity) -> Result<bool, CrackError> {
    let preparations = world.resource::<Preparations>();
    let is_known = preparations.is_making(entity) || preparations.has_changed_often(entity);
    let Some(threads) = threads(world).filter(|_| !is_known) else { return Ok(false) };
    if has_cracked(world, entity) || !warm::can_crack(world, entity) || !unfold(world, entity) {
        return Ok(false);
    }
    match Plan::new(world, entity)? {
        Some(plan) if !is_tiny(&plan) => begin(world, entity, plan, false, threads),
        _ => Ok(false),
    }
}

fn texels(plan: &Plan) -> u64 {
    TexelRect::whole(plan.pictures.size).area()
}

fn is_small(plan: &Plan) -> bool {
    texels(plan) <= MAX_AT_ONCE
}

fn is_tiny(plan: &Plan) -> bool {
    texels(plan) <= MIN_BESIDE
}

/// How many threads there are for background tasks; `None` if frames may take any time, or all threads would stop them.
fn threads(world: &World) -> Option<u64> {
    let has_time = world.resource::<CrackBudget>().is_unlimited();
    let pool = world.resource::<Threads>().pool().filter(|_| !has_time && !cfg!(target_arch = "wasm32"));
    pool.map(|pool| pool.thread_num().max(1) as u64)
}

/// Begins to make a surface, if there is room for it and what it is made from is there. Copies nothing yet.
fn begin(world: &mut World, entity: Entity, mut plan: Plan, is_wanted: bool, threads: u64) -> Result<bool, CrackError> {
    let (key, preparations) = (plan.key(), world.resource::<Preparations>());
    // Who is the first to read some pictures reads them for all.
    let is_being_read = || {
        let mut others = preparations.list.iter().map(|(_, other)| other);
        others.any(|other| other.key == key) && world.resource::<BasePictures>().find(key).is_none()
    };
    if !preparations.has_room(&plan, is_wanted, threads) || is_being_read() {
        return Ok(false);
    }
    let mut copies = Copies::default();
    let Some(raw) = plan.raw(world, &mut copies)? else { return Ok(false) };
    plan.check_mesh(world, entity)?;
    let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
    let Some(reading) = PictureCopies::new(copies.0, images, true) else { return Ok(false) };
    plan.allocate_textures(world)?;
    let stage = Stage::Reading(reading, Box::new(raw));
    let plan = Box::new(plan);
    let preparation = Preparation { plan, key, stage, since: Instant::now(), is_wanted };
    let turn = &mut Turn { timer: None, must_copy: false, may_make: false };
    if let Progress::Working(preparation) = preparation.step(world, entity, turn)? {
        world.resource_mut::<Preparations>().list.push((entity, *preparation));
    }
    Ok(true)
}

/// Goes on with the surfaces that are being made.
pub(crate) fn prepare_surfaces(world: &mut World) {
    let timer = world.resource::<FrameClock>().start(world.resource::<CrackBudget>(), SHARE);
    let turn = &mut Turn { timer: Some(&timer), must_copy: true, may_make: true };
    let list = world.resource::<Preparations>().list.iter();
    // An observer of one may heal another.
    for entity in list.map(|(entity, _)| *entity).collect::<Vec<_>>() {
        let Some(preparation) = world.resource_mut::<Preparations>().take(entity) else { continue };
        let outcome = preparation.step(world, entity, turn);
        let mut preparations = world.resource_mut::<Preparations>();
        match outcome {
            Ok(Progress::Working(preparation)) => preparations.list.push((entity, *preparation)),
            Ok(Progress::Again) => *preparations.rounds.entry(entity).or_default() += 1,
            Ok(Progress::Done) => _ = preparations.rounds.remove(&entity),
            Err(error) => fail(world, entity, error),
        }
    }
    for _ in 0..world.resource::<Preparations>().wanted.queue.len().min(MAX_WANTED) {
        if timer.is_over() {
            break;
        }
        let Some(entity) = world.resource_mut::<Preparations>().wanted.pop() else { break };
        if world.get::<CrackSurface>(entity).is_none() {
            continue;
        }
        match ready(world, entity, true) {
            Ok(true) => {}
            Ok(false) => world.resource_mut::<Preparations>().wanted.push(entity),
            Err(error) => fail(world, entity, error),
        }
    }
    world.resource_mut::<FrameClock>().stop(&timer);
}

/// What has become of a surface on its way.
enum Progress {
    Working(Box<Preparation>),
    /// The surface has changed.
    Again,
    Done,
}

impl Preparation {
    /// Goes on.
    fn step(self, world: &mut World, entity: Entity, turn: &mut Turn) -> Result<Progress, CrackError> {
        if has_cracked(world, entity) {
            // A bake has made it.
            drop_in_background(self);
            return Ok(Progress::Done);
        }
        let Self { plan, key, mut stage, since, is_wanted } = self;
        let moved = world.resource::<Preparations>().moved.map_or(since, |moved| moved.max(since));
        let is_late = moved.elapsed() >= PATIENCE;
        loop {
            stage = match stage {
                Stage::Reading(mut reading, raw) => {
                    if is_late {
                        reading.wait_no_more();
                    }
                    let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
                    match turn.copy(&mut reading, images) {
                        CopyProgress::More => {
                            let stage = Stage::Reading(reading, raw);
                            return Ok(Progress::Working(Box::new(Self { plan, key, stage, since, is_wanted })));
                        }
                        CopyProgress::Changed => return Ok(Progress::Again),
                        CopyProgress::Done => {
                            let since = Instant::now();
                            if reading.has_task {
                                world.resource_mut::<Preparations>().moved = Some(since);
                            }
                            let stager = world.resource::<Uploads>().stager(world.get_resource::<RenderDevice>());
                            let (surface, preset) = (plan.surface.clone(), plan.preset.clone());
                            let work = Work { raw, copies: reading.finish(), surface, preset, stager };
                            let stage = Stage::Making(BackgroundJob::start(work, Work::make));
                            return Ok(Progress::Working(Box::new(Self { plan, key, stage, since, is_wanted })));
                        }
                    }
                }
                Stage::Making(mut making) => {
                    let is_done = making.is_done();
                    match making.take_if_done(is_late && turn.may_make) {
                        None => {
                            let stage = Stage::Making(making);
                            return Ok(Progress::Working(Box::new(Self { plan, key, stage, since, is_wanted })));
                        }
                        Some(Err(_)) if !plan.is_current(world, entity) => return Ok(Progress::Again),
                        Some(made) => {
                            if is_done {
                                world.resource_mut::<Preparations>().moved = Some(Instant::now());
                            }
                            // No more than one in a frame.
                            turn.may_make &= is_done;
                            let mut made = made?;
                            if let Some(textures) = &plan.textures {
                                textures.fill(world, &mut made.pictures);
                            }
                            Stage::Uploading(made, 0)
                        }
                    }
                }
                Stage::Uploading(made, frames) => {
                    if !plan.is_current(world, entity) || !plan.has_room(world) {
                        drop_in_background((made, plan));
                        return Ok(Progress::Again);
                    }
                    let is_staged = plan.textures.as_ref().is_some_and(|textures| textures.are_staged(world));
                    if is_staged && frames < MAX_UPLOAD_FRAMES {
                        let stage = Stage::Uploading(made, frames + 1);
                        return Ok(Progress::Working(Box::new(Self { plan, key, stage, since, is_wanted })));
                    }
                    finish(world, entity, *plan, *made);
                    return Ok(Progress::Done);
                }
            };
        }
    }
}

/// What a frame may still do.
struct Turn<'a> {
    /// `None` = nothing.
    timer: Option<&'a Timer>,
    /// Whether something is copied even if there is no time.
    must_copy: bool,
    /// Whether it may do the work of a task that no thread has begun.
    may_make: bool,
}

impl Turn<'_> {
    fn copy(&mut self, reading: &mut PictureCopies, images: &Assets<Image>) -> CopyProgress {
        loop {
            let may_copy = self.must_copy || self.timer.is_some_and(|timer| !timer.is_over());
            let room = if may_copy { MAX_BYTES } else { 0 };
            let mut left = room;
            let read = reading.step(images, &mut left);
            self.must_copy &= left == room;
            // Something is left if more has to be waited for.
            if read != CopyProgress::More || left > 0 || !may_copy || reading.is_whole() {
                return read;
            }
        }
    }
}

/// Makes a surface of what is ready.
fn finish(world: &mut World, entity: Entity, mut plan: Plan, made: PreparedSurface) {
    let (textures, is_outdated) = (plan.textures.take().unwrap_or_default(), plan.is_outdated);
    let PreparedSurface { read, blank: BlankSurface { growth, field, look }, .. } = made;
    let ground = plan.ground(world, read, look, textures);
    let mut active = Box::new(Active::new(ground, growth, field));
    active.canvas.is_outdated = is_outdated;
    install(world, entity, active);
    // It may show another part of its pictures, or they have changed.
    world.resource_mut::<Queues>().changed.push(entity);
}

#[cfg(all(test, feature = "2d"))]
mod tests {
    use super::*;
    use crate::plugin::{
        headless::{app, blank},
        prelude::*,
        surface::cracked::Cracked,
    };
    use std::sync::Arc;

    /// Surfaces that are asked for in every frame, and whose pictures are not there, wait once each.
    #[test]
    fn what_is_wanted_again_and_again_waits_once() {
        let mut app = app(CrackBudget::default());
        let image = app.world().resource::<Assets<Image>>().reserve_handle();
        let sprite = || (Sprite::from_image(image.clone()), CrackSurface::default());
        let entities: Vec<Entity> = (0..40).map(|_| app.world_mut().spawn(sprite()).id()).collect();
        for _ in 0..30 {
            for entity in &entities {
                app.world_mut().commands().entity(*entity).prepare_cracks();
            }
            app.update();
        }
        assert_eq!(app.world().resource::<Preparations>().wanted.queue.len(), entities.len());
        for entity in &entities {
            app.world_mut().commands().entity(*entity).heal_cracks();
        }
        app.update();
        let wanted = &app.world().resource::<Preparations>().wanted;
        assert!(wanted.queue.is_empty() && wanted.all.is_empty());
    }

    /// Surfaces that show the same are read once, however many of them are hit at once.
    #[test]
    fn surfaces_with_one_picture_share_what_is_read_of_it() {
        let mut app = app(CrackBudget::default());
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::splat(600)));
        let entities: Vec<Entity> = (0..6)
            .map(|seed| {
                let surface = CrackSurface::default().with_seed(seed);
                app.world_mut().spawn((Sprite::from_image(image.clone()), surface)).id()
            })
            .collect();
        for entity in &entities {
            app.world_mut().trigger(CrackHit::uv(*entity, Vec2::splat(0.5)));
        }
        let start = Instant::now();
        while entities.iter().any(|entity| app.world().get::<Cracked>(*entity).is_none()) {
            app.update();
            let is_reading =
                |(_, preparation): &&(Entity, Preparation)| matches!(preparation.stage, Stage::Reading(..));
            let readers = app.world().resource::<Preparations>().list.iter().filter(is_reading).count();
            assert!(readers <= 1, "{readers} read the picture at once");
            assert!(start.elapsed() < std::time::Duration::from_secs(60), "they never come");
        }
        let active = |entity: &Entity| app.world().get::<Cracked>(*entity).and_then(Cracked::get);
        let bases: Vec<_> = entities.iter().filter_map(active).map(|active| &active.canvas.base).collect();
        assert!(bases.iter().all(|base| Arc::ptr_eq(base, bases[0])), "each has its own");
        // That the picture came in the frame of the hits does not make it another one.
        let read = bases[0].clone();
        (0..4).for_each(|_| app.update());
        let base = |entity: &Entity| {
            app.world().get::<Cracked>(*entity).and_then(Cracked::get).map(|active| &active.canvas.base)
        };
        assert!(
            entities.iter().all(|entity| base(entity).is_some_and(|base| Arc::ptr_eq(base, &read))),
            "it was read twice"
        );
        assert!(app.world().resource::<Preparations>().list.is_empty());
    }

    /// Of large ones no more than a thread can deal with are on their way: memory is not taken for all at once.
    #[test]
    fn only_some_are_made_at_once() {
        let mut app = app(CrackBudget { milliseconds: 0.0, ..default() });
        let side = 1100;
        for _ in 0..20 {
            let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::splat(side)));
            let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::default())).id();
            app.world_mut().trigger(CrackHit::uv(entity, Vec2::splat(0.5)));
        }
        let most = PER_THREAD * threads(app.world()).expect("there are threads") / u64::from(side * side);
        let mut seen = 0;
        for _ in 0..5 {
            app.update();
            seen = seen.max(app.world().resource::<Preparations>().list.len());
        }
        assert_eq!(seen as u64, most.min(20));
    }
}
