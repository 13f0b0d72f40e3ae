//! [`AsyncPlayback`]: background tasks draw and paint the times of baked cracks. They are too many for a frame, which only exchanges pictures.

use super::frame_job::{Back, FrameJob, Stage, TimelineSnapshot, gather};
use super::report::report_painted;
use super::running::{News, Running};
use crate::growth::CrackGrowth;
use crate::pattern::Moment;
use crate::plugin::api::textures::MAPS;
use crate::plugin::api::{CrackBudget, CrackState};
use crate::plugin::gpu::buffer::Stager;
use crate::plugin::gpu::uploads::Uploads;
use crate::plugin::jobs::background::drop_in_background;
use crate::plugin::jobs::frame_time::FrameClock;
use crate::plugin::jobs::threads::Threads;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cracked::{Cracked, active_mut};
use crate::plugin::surface::drawing::Frozen;
use crate::plugin::surface::playhead::Playback;
use crate::plugin::surface::queues::Queues;
use crate::plugin::surface::stamp::stamp_anew;
use crate::raster::{DepthField, DirtyTiles, Replay, ReplayChanges, TexelRect};
use bevy::{
    ecs::{entity_disabling::Disabled, query::Allow},
    prelude::*,
    render::renderer::RenderDevice,
};
use std::sync::Arc;

/// The most nodes, and texels, of a surface that is drawn again in a frame.
const MAX_NODES: usize = 1024;
const MAX_TEXELS: u64 = 512 * 512;

/// Drawing what a hit has crushed takes as long as drawing so many nodes, or longer.
const NODES_OF_HIT: usize = 128;

/// Frames after which memory is given back if time stands still.
const IDLE: u32 = 60;

/// What shows the times of a surface with baked cracks, and makes other surfaces again of which much is to be drawn or painted. Empty as
/// soon as that is done, or the end is shown and nothing can turn time back.
///
/// While a job runs, the field, the touched tiles and the replay of the surface are with it, and the surface counts as dirty without being in
/// the queue.
#[derive(Component, Default)]
#[component(clone_behavior = Ignore)]
pub(crate) struct AsyncPlayback(Option<Box<AsyncWork>>);

/// What tasks make of one surface.
#[derive(Default)]
struct AsyncWork {
    timeline: Option<Arc<TimelineSnapshot>>,
    back: Option<Back>,
    job: Option<Running>,
    stager: Option<Stager>,
    /// Whether all of the surface is to be made again, whatever it shows.
    is_asked: bool,
    /// Whether a change of the surface waits for the job: no other one is begun before it.
    is_awaited: bool,
    /// Frames since anything was to be shown.
    idle: u32,
}

impl AsyncPlayback {
    /// Of a growth all of whose times are to be shown, and of the texels that are shown first: in the background, as both are copied.
    pub(crate) fn new(growth: &CrackGrowth, texels: &[Option<Vec<u8>>; MAPS]) -> Self {
        let back = Back { texels: texels.clone(), behind: Vec::new() };
        let work = AsyncWork { timeline: Some(TimelineSnapshot::of(growth)), back: Some(back), ..AsyncWork::default() };
        Self(Some(Box::new(work)))
    }

    /// Whether tasks make what the surface shows, or will as soon as that changes.
    pub(crate) const fn is_on(&self) -> bool {
        self.0.is_some()
    }

    /// Has tasks make what the surface shows from now on.
    pub(super) fn turn_on(&mut self) {
        self.0.get_or_insert_default();
    }

    /// Whether a surface has baked cracks and shows any but the end.
    pub(crate) const fn is_for(active: &Active) -> bool {
        active.cracks.added.is_some() && active.playhead.playback.is_some()
    }
}

impl AsyncWork {
    /// Begins to make what the surface is to show.
    fn begin(&mut self, active: &mut Active, has_threads: bool) {
        let moment = active.moment();
        let hair = active.hair();
        let Active { cracks, drawing, canvas, playhead, .. } = &mut *active;
        let Some(view) = canvas.views.get_mut(canvas.view) else { return };
        view.join_rest();
        let (growth, field, profile) = (&cracks.growth, &mut drawing.field, drawing.profile);
        let timeline = self
            .timeline
            .take()
            .filter(|timeline| timeline.is_of(growth))
            .unwrap_or_else(|| TimelineSnapshot::of(growth));
        self.timeline = Some(timeline.clone());
        let size = field.frame.size();
        let job = Box::new(FrameJob {
            timeline,
            moment,
            base: canvas.base.clone(),
            analogy: canvas.analogy.clone(),
            look: canvas.look.clone(),
            maps: canvas.textures.all().map(|texture| texture.is_some()),
            has_mips: canvas.has_mips,
            rect: view.rect,
            stager: self.stager.clone(),
            field: field.take(),
            ground: None,
            replay: playhead
                .playback
                .as_mut()
                .map(|playback| core::mem::replace(&mut playback.replay, Replay::stale(UVec2::ZERO, profile))),
            touched: core::mem::take(&mut drawing.touched),
            profile,
            is_anew: core::mem::take(&mut drawing.is_stale),
            frozen: drawing.frozen.clone(),
            carried: (drawing.carried.clone(), hair),
            holes: drawing.cutouts.clone(),
            motion: cracks.motion_at(moment),
            back: self.back.take(),
            dirty: core::mem::replace(&mut view.dirty, DirtyTiles::new(size)),
            redrawn: ReplayChanges::default(),
            stage: Stage::Begin,
            changed: Vec::new(),
            staged: [const { None }; MAPS],
        });
        (active.turn.is_dirty, active.turn.is_late) = (true, false);
        self.is_asked = false;
        self.job = Some(Running::start(job, has_threads));
    }

    /// Shows what was made, and keeps what was shown.
    fn apply(&mut self, active: &mut Active, job: FrameJob, images: &mut Assets<Image>, uploads: &mut Uploads) {
        let rects = job.in_image(&gather(&job.changed, job.field.frame.size()));
        let FrameJob { field, replay, touched, moment, frozen, back, changed, staged, rect, .. } = job;
        (active.drawing.field, active.drawing.touched) = (field, touched);
        if let (Some(playback), Some(replay)) = (&mut active.playhead.playback, replay) {
            (playback.replay, playback.shown) = (replay, moment);
        }
        if has_thawed(active, frozen.as_ref()) {
            (self.is_asked, active.drawing.is_stale) = (true, true);
        }
        let Some(mut back) = back else { return };
        let whole = TexelRect::whole(active.drawing.field.frame.size());
        // The other texels have no cracks any more that show other parts of the picture.
        let others = active.canvas.views.iter_mut().filter(|view| view.rect != rect);
        others.for_each(|view| view.dirty.mark(whole));
        if !changed.is_empty() {
            active.canvas.note_depths(&changed);
            let pictures = active.canvas.textures.all().into_iter().zip(&mut back.texels).zip(staged);
            for ((texture, texels), staged) in pictures {
                // Without an asset event, which would upload the whole image.
                if let (Some(texture), Some(texels)) = (texture, texels)
                    && let Some(image) = images.get_mut_untracked(texture)
                    && let Some(data) = &mut image.data
                {
                    core::mem::swap(data, texels);
                    uploads.push_staged(texture.id(), image.size(), &rects, staged);
                }
            }
        }
        self.back = Some(Back { behind: changed, ..back });
    }

    /// Gives back memory that is only of use for the next moment.
    fn rest(&mut self) {
        if let Some(back) = self.back.take() {
            drop_in_background((back, self.stager.take()));
        }
    }
}

/// What tasks make of a surface, if they make anything.
fn work_of(world: &mut World, entity: Entity) -> Option<&mut AsyncWork> {
    world.get_mut::<AsyncPlayback>(entity)?.into_inner().0.as_deref_mut()
}

/// Whether tasks can make the times of a surface, one after the other: nothing else is to paint its textures.
fn can_be_async(active: &Active) -> bool {
    let has_one_view = active.drawing.cutouts.is_none() && active.canvas.views.len() == 1;
    AsyncPlayback::is_for(active) && has_one_view && !active.turn.is_to_shatter
}

/// Whether the field has to be drawn again. That of cracks that move is drawn for each moment.
fn shows_stale(active: &Active) -> bool {
    let playback = active.playhead.playback.as_ref();
    let is_stale =
        |playback: &Playback| playback.replay.is_stale() && active.cracks.motion_at(playback.shown).is_none();
    active.drawing.is_stale || playback.is_some_and(is_stale)
}

/// Whether what a job has drawn below the cracks is not to be shown any more: time can be turned back since.
const fn has_thawed(active: &Active, frozen: Option<&Frozen>) -> bool {
    frozen.is_some() && active.drawing.frozen.is_none()
}

/// Draws all of a surface again: what was drawn is lost.
fn start_over(active: &mut Active) {
    let frame = active.drawing.field.frame;
    active.drawing.field = DepthField::new(frame);
    active.drawing.field.set_forbidden(active.cracks.growth.mask());
    active.drawing.field.set_layers(active.preset.look.layer(active.surface.seed));
    active.drawing.is_stale = true;
    if let Some(playback) = &mut active.playhead.playback {
        playback.shown = Moment::START;
    }
    active.mark_all();
}

/// Whether a surface can be changed without waiting for a task, and without ending the slices of one. If not, it can as soon as what is being
/// made is there.
pub(crate) fn may_change(world: &mut World, entity: Entity) -> bool {
    let Some(work) = work_of(world, entity) else { return true };
    let is_at_rest = work.job.as_ref().is_none_or(Running::is_at_rest);
    work.is_awaited = !is_at_rest;
    is_at_rest
}

/// Ends what a task makes of a surface, for a change of it: it is as if it had been drawn and not painted yet. Waits for a task that is at
/// work, unless the surface [may change](may_change). What is to be painted then is much.
pub(crate) fn recall(world: &mut World, entity: Entity, active: &mut Active) {
    if take_back(world, entity, active)
        && let Some(work) = work_of(world, entity)
    {
        work.is_asked = true;
    }
}

/// The same for a surface that will show something else. Returns whether anything was to be made.
pub(crate) fn take_back(world: &mut World, entity: Entity, active: &mut Active) -> bool {
    let Some(work) = work_of(world, entity) else { return false };
    work.timeline = None;
    work.rest();
    let was_asked = core::mem::take(&mut work.is_asked);
    let Some(job) = work.job.take() else { return was_asked };
    active.turn.is_dirty = false;
    match job.recall() {
        Some(job) => {
            let FrameJob { field, replay, touched, moment, is_anew, frozen, mut dirty, mut changed, stage, .. } = *job;
            (active.drawing.field, active.drawing.touched) = (field, touched);
            let is_stale = (is_anew && matches!(stage, Stage::Begin)) || has_thawed(active, frozen.as_ref());
            active.drawing.is_stale |= is_stale;
            if let (Some(playback), Some(replay)) = (&mut active.playhead.playback, replay) {
                playback.replay = replay;
                if !matches!(stage, Stage::Begin) {
                    playback.shown = moment;
                }
            }
            dirty.take_rects(&mut changed);
            changed.into_iter().for_each(|rect| active.mark(rect));
        }
        None => start_over(active),
    }
    true
}

/// Drops what tasks make of a surface.
pub(crate) fn stop(world: &mut World, entity: Entity, active: &mut Active) {
    if let Some(work) = world.get_mut::<AsyncPlayback>(entity).and_then(|mut playback| playback.0.take()) {
        active.turn.is_dirty = active.turn.is_dirty && work.job.is_none();
        drop_in_background(work);
    }
}

/// Has tasks make the times of a surface with baked cracks, if it shows any but the end.
pub(crate) fn start(world: &mut World, entity: Entity, playback: Option<AsyncPlayback>) {
    let is_for = active_mut(world, entity).is_some_and(|active| AsyncPlayback::is_for(active));
    if is_for && let Some(mut to) = world.get_mut::<AsyncPlayback>(entity).filter(|playback| !playback.is_on()) {
        *to = playback.unwrap_or_default();
        to.turn_on();
    }
}

/// Whether all texels of a surface are more than a frame paints.
fn is_large(size: UVec2) -> bool {
    TexelRect::whole(size).area() > MAX_TEXELS
}

/// Whether so many cracks on so many texels are more than a frame draws.
pub(super) fn is_much(growth: &CrackGrowth, size: UVec2) -> bool {
    growth.network().nodes().len() + NODES_OF_HIT * growth.impacts().len() > MAX_NODES || is_large(size)
}

/// Has all of a surface drawn anew that shows something else in the same places: by a task, until which it shows what it showed, if it
/// takes longer than a frame has.
pub(crate) fn redraw(world: &mut World, entity: Entity, active: &mut Active) {
    if !is_much(&active.cracks.growth, active.drawing.field.frame.size()) || !ask(world, entity) {
        return stamp_anew(active);
    }
    active.drawing.is_stale = true;
    active.drawing.redrawn += 1;
}

/// Has all of a surface painted by a task, if it takes longer than a frame has.
pub(crate) fn repaint(world: &mut World, entity: Entity, active: &mut Active) {
    if is_large(active.drawing.field.frame.size()) && ask(world, entity) {
        active.drawing.redrawn += 1;
    }
}

/// Has a task make what a surface shows. `false` if that is not needed.
fn ask(world: &mut World, entity: Entity) -> bool {
    if world.resource::<CrackBudget>().is_unlimited() {
        return false;
    }
    let Some(mut playback) = world.get_mut::<AsyncPlayback>(entity) else { return false };
    playback.0.get_or_insert_default().is_asked = true;
    true
}

/// Whether a task makes what a surface shows, or slices of frames do.
pub(crate) fn is_at_work(world: &World, entity: Entity) -> bool {
    let work = world.get::<AsyncPlayback>(entity).and_then(|playback| playback.0.as_deref());
    work.is_some_and(|work| work.job.is_some())
}

/// Shows what tasks have made of surfaces with baked cracks, and has made what they are to show now.
pub(crate) fn play_async(
    mut commands: Commands,
    budget: Res<CrackBudget>,
    mut clock: ResMut<FrameClock>,
    threads: Res<Threads>,
    device: Option<Res<RenderDevice>>,
    mut playing: Query<(Entity, &mut AsyncPlayback, &mut Cracked), Allow<Disabled>>,
    mut queues: ResMut<Queues>,
    mut uploads: ResMut<Uploads>,
    images: Option<ResMut<Assets<Image>>>,
    mut states: Query<&mut CrackState>,
) {
    let is_any = playing.iter().any(|(_, playback, _)| playback.is_on());
    let Some(mut images) = images.filter(|_| is_any) else { return };
    let timer = clock.start(&budget, 1.0);
    let has_threads = threads.pool().is_some();
    for (entity, mut playback, mut cracked) in &mut playing {
        let (Some(work), Some(active)) = (&mut playback.0, cracked.get_mut()) else { continue };
        let is_awaited = core::mem::take(&mut work.is_awaited);
        let (mut is_new, mut is_over, mut has_made) = (!is_awaited, false, false);
        loop {
            if let Some(job) = work.job.take() {
                let before = active.playhead.playback.as_ref().map(|playback| playback.shown);
                match job.look(&timer) {
                    News::Running(job) => {
                        work.job = Some(job);
                        break;
                    }
                    News::Made(job) => work.apply(active, *job, &mut images, &mut uploads),
                    News::Lost => start_over(active),
                }
                has_made = true;
                report_painted(active, entity, before, &mut states, &mut commands);
                if active.has_normals_to_blend() {
                    queues.mark_blending(entity, &mut active.turn);
                }
            }
            let is_stale = active.is_to_paint() || shows_stale(active);
            let is_wanted = active.is_behind() || is_stale;
            // Frames show cracks that were not baked, unless all of them are to be made again.
            work.is_asked &= is_wanted;
            if budget.is_unlimited() || !(work.is_asked || can_be_async(active)) {
                work.rest();
                work.is_asked = false;
                is_over = active.cracks.added.is_none();
                if !budget.is_unlimited()
                    && let Some(added) = &mut active.cracks.added
                {
                    // It takes longer than a frame has.
                    added.motion = None;
                }
                // It may have grown meanwhile.
                if is_wanted || (has_made && active.playhead.playback.is_none()) {
                    queues.mark_dirty(entity, &mut active.turn);
                }
                break;
            }
            work.idle = if is_wanted { 0 } else { work.idle + 1 };
            if work.idle == IDLE {
                work.rest();
            }
            if !(is_wanted && core::mem::take(&mut is_new)) {
                break;
            }
            if active.turn.is_dirty {
                queues.dirty.retain(|other| *other != entity);
            }
            let stager = work.stager.take();
            let stager = stager.filter(|stager| device.as_ref().is_some_and(|device| stager.is_of(device)));
            work.stager = stager.or_else(|| uploads.stager(device.as_deref()));
            work.begin(active, has_threads);
            if has_threads {
                break;
            }
        }
        let is_needed = work.job.is_some() || work.is_asked;
        if !is_needed && (is_over || active.playhead.playback.is_none()) {
            drop_in_background(playback.0.take());
        }
    }
    clock.stop(&timer);
}

#[cfg(all(test, feature = "2d"))]
mod tests {
    use super::*;
    use crate::{
        Grid,
        plugin::{
            draw::frame_job::SLICE,
            headless::{app, blank, shown},
            jobs::background::BackgroundJob,
            prelude::*,
            surface::cracked::active,
        },
    };
    use bevy::{platform::time::Instant, time::TimeUpdateStrategy};
    use std::{sync::Mutex, thread, time::Duration};

    /// Where tasks run in place, moments are made in slices of frames, one a frame if there is no time, and the end is the same.
    #[test]
    fn slices_make_what_tasks_make() {
        let end = |no_threads: bool| {
            let mut app = app(CrackBudget { milliseconds: 0.0, ..default() });
            // However long a frame takes.
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(2)));
            app.world_mut().resource_mut::<Threads>().are_missing = no_threads;
            let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::new(390, 260)));
            let guided = GuidedCracks::new(CrackGuide::new(Grid::new(UVec2::new(3, 1), 0.5)))
                .with_appearance(GuidedAppearance::Widen { seconds: 0.05 });
            let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::default(), guided)).id();
            let mut slices = 0;
            while app.world().get::<CrackState>(entity).is_none_or(|state| state.status != CrackStatus::Done) {
                let left_to_paint = |app: &App| {
                    let Some(Running::Slices(job)) = &app.world().get::<AsyncPlayback>(entity)?.0.as_ref()?.job else {
                        return None;
                    };
                    let Stage::Paint(rects) = &job.stage else { return None };
                    Some(rects.iter().map(|rect| rect.area()).sum::<u64>())
                };
                let before = left_to_paint(&app);
                app.update();
                if let (Some(before), Some(after)) = (before, left_to_paint(&app)) {
                    assert!(before - after <= SLICE, "{before} {after}");
                    slices += 1;
                }
            }
            (shown(&app, entity), slices)
        };
        let (sliced, slices) = end(true);
        let (made, _) = end(false);
        assert!(slices > 8, "{slices}");
        assert!(sliced == made && made.iter().any(|&value| value < 100), "the same cracks");
    }

    fn frames_until(app: &mut App, mut is_so: impl FnMut(&mut App) -> bool) {
        for _ in 0..10_000 {
            if is_so(app) {
                return;
            }
            app.update();
            thread::sleep(Duration::from_millis(1));
        }
        assert!(is_so(app), "it never comes");
    }

    /// A large sprite with cracks that have grown.
    fn cracked(budget: CrackBudget) -> (App, Entity) {
        let mut app = app(budget);
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::new(600, 500)));
        let surface = CrackSurface::new(CrackPreset::CONCRETE).with_seed(4);
        let entity = app.world_mut().spawn((Sprite::from_image(image), surface)).id();
        for x in [0.2, 0.4, 0.6, 0.8] {
            app.world_mut().trigger(CrackHit::uv(entity, Vec2::new(x, 0.5)).with_energy(3.0));
        }
        app.update();
        frames_until(&mut app, |app| is_done(app, entity));
        (app, entity)
    }

    fn is_done(app: &App, entity: Entity) -> bool {
        app.world().get::<CrackState>(entity).is_some_and(|state| state.status == CrackStatus::Done)
    }

    fn give_preset(app: &mut App, entity: Entity, preset: CrackPreset) {
        if let Some(mut surface) = app.world_mut().get_mut::<CrackSurface>(entity) {
            surface.preset = preset.into();
        }
    }

    fn give_picture(app: &mut App, entity: Entity) {
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::new(600, 480)));
        if let Some(mut sprite) = app.world_mut().get_mut::<Sprite>(entity) {
            sprite.image = image;
        }
    }

    /// Fault B5: another preset, and another picture, do not wait in the frame for a task that draws. They come after it, and what is shown
    /// then is what frames would have drawn.
    #[test]
    fn b5_changes_come_after_the_task_that_draws() {
        static GATE: Mutex<()> = Mutex::new(());
        let redraw = |app: &mut App, entity| {
            give_preset(app, entity, CrackPreset { profile: CrackPreset::CLAY.profile, ..CrackPreset::CONCRETE });
        };
        let other = |app: &mut App, entity| give_preset(app, entity, CrackPreset::MUD);
        let changes: [fn(&mut App, Entity); 2] = [other, give_picture];
        for change in changes {
            let (mut app, entity) = cracked(CrackBudget { milliseconds: 500.0, ..default() });
            let seen = |app: &App, entity| {
                let active = active(app.world(), entity).expect("it is cracked");
                (active.preset.clone(), active.canvas.base.size)
            };
            redraw(&mut app, entity);
            app.update();
            // The task that draws it again stops at a lock.
            let gate = GATE.lock().expect("nothing has failed");
            let work = work_of(app.world_mut(), entity).expect("a task draws it");
            let job = work.job.take().and_then(Running::recall).expect("it is drawn");
            let job = BackgroundJob::start(job, |job| {
                // Not for ever, so that a frame that waits for it fails.
                for _ in 0..10_000 {
                    if GATE.try_lock().is_ok() {
                        break;
                    }
                    thread::sleep(Duration::from_millis(1));
                }
                Some(job.finish())
            });
            while !job.is_begun() {
                thread::yield_now();
            }
            work.job = Some(Running::Task(job, Instant::now()));
            let before = seen(&app, entity);
            change(&mut app, entity);
            for _ in 0..3 {
                app.update();
                assert!(seen(&app, entity) == before && is_at_work(app.world(), entity), "it waits for what is drawn");
            }
            drop(gate);
            frames_until(&mut app, |app| seen(app, entity) != before);
            let is_over = |app: &mut App| work_of(app.world_mut(), entity).is_none();
            frames_until(&mut app, is_over);
            // On another picture the cracks are others, and may grow for longer.
            frames_until(&mut app, |app| is_done(app, entity));

            let (mut frames, same) = cracked(CrackBudget { milliseconds: f32::INFINITY, ..default() });
            let both: [fn(&mut App, Entity); 2] = [redraw, change];
            for change in both {
                let before = seen(&frames, same);
                change(&mut frames, same);
                // A task may grow them.
                frames_until(&mut frames, |app| seen(app, same) != before);
                (0..3).for_each(|_| frames.update());
                frames_until(&mut frames, |app| is_done(app, same));
            }
            assert!(shown(&app, entity) == shown(&frames, same), "other cracks");
        }
    }
}
