//! [`AsyncPlayback`]: background tasks draw and paint the times of baked cracks. They are too many for a frame, which only exchanges pictures.

use super::frame_job::{Back, FrameJob, Stage, TimelineSnapshot, gather};
use super::report::report_painted;
use crate::growth::CrackGrowth;
use crate::pattern::Moment;
use crate::plugin::api::textures::MAPS;
use crate::plugin::api::{CrackBudget, CrackState};
use crate::plugin::gpu::buffer::Stager;
use crate::plugin::gpu::uploads::Uploads;
use crate::plugin::jobs::background::{BackgroundJob, drop_in_background, guarded};
use crate::plugin::jobs::frame_time::{FrameClock, Timer};
use crate::plugin::jobs::threads::Threads;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cracked::{Cracked, active_mut};
use crate::plugin::surface::queues::Queues;
use crate::plugin::surface::tile_set::Touched;
use crate::raster::{DepthField, DirtyTiles, Replay, ReplayChanges, TexelRect};
use bevy::{
    ecs::{entity_disabling::Disabled, query::Allow},
    platform::time::Instant,
    prelude::*,
    render::renderer::RenderDevice,
};
use std::{sync::Arc, time::Duration};

/// How long a task may wait for a thread before its work is done in slices of frames.
const PATIENCE: Duration = Duration::from_millis(50);

/// The most nodes, and texels, of a surface that is drawn again in a frame.
const MAX_NODES: usize = 1024;
const MAX_TEXELS: u64 = 512 * 512;

/// Frames after which memory is given back if time stands still.
const IDLE: u32 = 60;

/// What shows the times of a surface with baked cracks, and draws other surfaces again of which much is to be drawn. Removed when that is done,
/// or the end is shown and nothing can turn time back.
///
/// While a job runs, the field, the touched tiles and the replay of the surface are with it, and the surface counts as dirty without being in
/// the queue.
#[derive(Component, Default)]
#[component(storage = "SparseSet", clone_behavior = Ignore)]
pub(crate) struct AsyncPlayback {
    timeline: Option<Arc<TimelineSnapshot>>,
    back: Option<Back>,
    job: Option<Running>,
    stager: Option<Stager>,
    /// Frames since anything was to be shown.
    idle: u32,
}

/// A moment that is being made.
enum Running {
    /// By a task, since then.
    Task(BackgroundJob<Box<FrameJob>, Option<Box<FrameJob>>>, Instant),
    Slices(Box<FrameJob>),
}

/// What has become of it.
enum News {
    Running(Running),
    Made(Box<FrameJob>),
    /// The task has failed.
    Lost,
}

impl Running {
    fn start(job: Box<FrameJob>, has_threads: bool) -> Self {
        if has_threads {
            Self::Task(BackgroundJob::start(job, |job| guarded(|| Ok(job.finish())).ok()), Instant::now())
        } else {
            Self::Slices(job)
        }
    }

    /// Looks after it; makes slices until the time is over.
    fn look(self, timer: &Timer) -> News {
        match self {
            Self::Task(task, _) if task.is_done() => task.finish().flatten().map_or(News::Lost, News::Made),
            Self::Task(task, since) if since.elapsed() < PATIENCE => News::Running(Self::Task(task, since)),
            Self::Task(task, since) => match task.take_back() {
                Some(job) => Self::Slices(job).look(timer),
                None => News::Running(Self::Task(task, since)),
            },
            Self::Slices(mut job) => loop {
                if job.step() {
                    return News::Made(job);
                }
                if timer.is_over() {
                    return News::Running(Self::Slices(job));
                }
            },
        }
    }

    /// What there is of it; waits for a task that is at work.
    fn recall(self) -> Option<Box<FrameJob>> {
        match self {
            Self::Task(task, _) => task.take_back().or_else(|| task.finish().flatten()),
            Self::Slices(mut job) => {
                while matches!(job.stage, Stage::Draw | Stage::Crush) {
                    job.step();
                }
                Some(job)
            }
        }
    }
}

impl AsyncPlayback {
    /// Of a growth all of whose times are to be shown, and of the texels that are shown first: in the background, as both are copied.
    pub(crate) fn new(growth: &CrackGrowth, texels: &[Option<Vec<u8>>; MAPS]) -> Self {
        let back = Back { texels: texels.clone(), behind: Vec::new() };
        Self { timeline: Some(TimelineSnapshot::of(growth)), back: Some(back), ..Self::default() }
    }

    /// Whether a surface has baked cracks and shows any but the end.
    pub(crate) const fn is_for(active: &Active) -> bool {
        active.cracks.added.is_some() && active.playhead.playback.is_some()
    }

    /// Begins to make what the surface is to show.
    fn begin(&mut self, active: &mut Active, has_threads: bool) {
        let moment = active.moment();
        let Active { cracks, drawing, canvas, playhead, .. } = &mut *active;
        let (Some(playback), Some(view)) = (&mut playhead.playback, canvas.views.get_mut(canvas.view)) else { return };
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
            replay: core::mem::replace(&mut playback.replay, Replay::stale(UVec2::ZERO, profile)),
            touched: core::mem::take(&mut drawing.touched),
            profile,
            motion: cracks.motion_at(moment),
            back: self.back.take(),
            dirty: core::mem::replace(&mut view.dirty, DirtyTiles::new(size)),
            redrawn: ReplayChanges::default(),
            stage: Stage::Begin,
            changed: Vec::new(),
            staged: [const { None }; MAPS],
        });
        (active.turn.is_dirty, active.turn.is_late) = (true, false);
        self.job = Some(Running::start(job, has_threads));
    }

    /// Shows what was made, and keeps what was shown.
    fn apply(&mut self, active: &mut Active, job: FrameJob, images: &mut Assets<Image>, uploads: &mut Uploads) {
        let rects = job.in_image(&gather(&job.changed, job.field.frame.size()));
        let FrameJob { field, replay, touched, moment, back, changed, staged, .. } = job;
        (active.drawing.field, active.drawing.touched) = (field, touched);
        if let Some(playback) = &mut active.playhead.playback {
            (playback.replay, playback.shown) = (replay, moment);
        }
        let Some(mut back) = back else { return };
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

/// Whether a task can make the times of a surface: nothing else is to paint its textures.
fn can_be_async(active: &Active) -> bool {
    active.playhead.playback.is_some() && has_one_view(active)
}

fn has_one_view(active: &Active) -> bool {
    active.drawing.cutouts.is_none() && active.canvas.views.len() == 1
}

/// Whether the field has to be drawn again. That of cracks that move is drawn for each moment.
fn shows_stale(active: &Active) -> bool {
    let playback = active.playhead.playback.as_ref();
    playback.is_some_and(|playback| playback.replay.is_stale() && active.cracks.motion_at(playback.shown).is_none())
}

/// Draws all of a surface again: what was drawn is lost.
fn start_over(active: &mut Active) {
    let frame = active.drawing.field.frame;
    active.drawing.field = DepthField::new(frame);
    active.drawing.field.set_forbidden(active.cracks.growth.mask());
    active.drawing.field.set_layers(active.preset.look.layer(active.surface.seed));
    active.drawing.touched = Touched::new(frame.size());
    if let Some(playback) = &mut active.playhead.playback {
        playback.start_over(frame, active.drawing.profile);
        playback.shown = Moment::START;
    }
    active.mark_all();
}

/// Ends what a task makes of a surface: it is as if it had been drawn and not painted yet. Waits for a task that is at work.
pub(crate) fn recall(world: &mut World, entity: Entity, active: &mut Active) {
    let Some(mut playback) = world.get_mut::<AsyncPlayback>(entity) else { return };
    playback.timeline = None;
    playback.rest();
    let Some(job) = playback.job.take() else { return };
    active.turn.is_dirty = false;
    match job.recall() {
        Some(job) => {
            let FrameJob { field, replay, touched, moment, mut dirty, mut changed, stage, .. } = *job;
            (active.drawing.field, active.drawing.touched) = (field, touched);
            if let Some(playback) = &mut active.playhead.playback {
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
}

/// Drops what tasks make of a surface.
pub(crate) fn stop(world: &mut World, entity: Entity, active: &mut Active) {
    let playback = world.get_entity_mut(entity).ok().and_then(|mut entity| entity.take::<AsyncPlayback>());
    if let Some(playback) = playback {
        active.turn.is_dirty = active.turn.is_dirty && playback.job.is_none();
        drop_in_background(playback);
    }
}

/// Has tasks make the times of a surface with baked cracks, if it shows any but the end.
pub(crate) fn start(world: &mut World, entity: Entity, playback: Option<AsyncPlayback>) {
    let is_for = active_mut(world, entity).is_some_and(|active| AsyncPlayback::is_for(active));
    if is_for
        && let Ok(mut entity) = world.get_entity_mut(entity)
        && !entity.contains::<AsyncPlayback>()
    {
        entity.insert(playback.unwrap_or_default());
    }
}

/// Whether all texels of a surface are more than a frame paints.
pub(crate) fn is_large(active: &Active) -> bool {
    TexelRect::whole(active.drawing.field.frame.size()).area() > MAX_TEXELS
}

/// Has all of a surface drawn again that shows something else in the same places: by a task, until which it shows what it showed, if it
/// takes longer than a frame has. `false` if that cannot be.
pub(crate) fn redraw(world: &mut World, entity: Entity, active: &mut Active) -> bool {
    let budget = world.resource::<CrackBudget>();
    let is_little = active.cracks.growth.network().nodes().len() <= MAX_NODES && !is_large(active);
    let is_whole = active.drawing.frozen.is_none() && active.drawing.carried.is_empty();
    if is_little || budget.is_unlimited() || !is_whole || !has_one_view(active) {
        return false;
    }
    let Ok(mut entity) = world.get_entity_mut(entity) else { return false };
    active.draw_later();
    if !entity.contains::<AsyncPlayback>() {
        entity.insert(AsyncPlayback::default());
    }
    true
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
    let Some(mut images) = images.filter(|_| !playing.is_empty()) else { return };
    let timer = clock.start(&budget, 1.0);
    let has_threads = threads.pool().is_some();
    for (entity, mut playback, mut cracked) in &mut playing {
        let Some(active) = cracked.get_mut() else { continue };
        let (mut is_new, mut is_over) = (true, false);
        loop {
            if let Some(job) = playback.job.take() {
                let before = active.playhead.playback.as_ref().map(|playback| playback.shown);
                match job.look(&timer) {
                    News::Running(job) => {
                        playback.job = Some(job);
                        break;
                    }
                    News::Made(job) => playback.apply(active, *job, &mut images, &mut uploads),
                    News::Lost => start_over(active),
                }
                report_painted(active, entity, before, &mut states, &mut commands);
                if active.has_normals_to_blend() {
                    queues.mark_blending(entity, &mut active.turn);
                }
            }
            let is_stale = active.canvas.views.get(active.canvas.view).is_some_and(|view| !view.dirty.is_empty());
            let is_stale = is_stale || shows_stale(active);
            let is_wanted = active.is_behind() || is_stale;
            let is_due = !budget.is_unlimited() && !active.turn.is_to_shatter;
            // Cracks that were not baked are shown by the frames, unless all of them are to be drawn.
            let is_baked = active.cracks.added.is_some();
            if !is_baked && !shows_stale(active) {
                if is_wanted {
                    queues.mark_dirty(entity, &mut active.turn);
                }
                is_over = true;
                break;
            }
            if !(is_due && can_be_async(active)) {
                playback.rest();
                if !budget.is_unlimited()
                    && let Some(added) = &mut active.cracks.added
                {
                    // It takes longer than a frame has.
                    added.motion = None;
                }
                if is_wanted {
                    queues.mark_dirty(entity, &mut active.turn);
                }
                break;
            }
            playback.idle = if is_wanted { 0 } else { playback.idle + 1 };
            if playback.idle == IDLE {
                playback.rest();
            }
            if !(is_wanted && core::mem::take(&mut is_new)) {
                break;
            }
            if active.turn.is_dirty {
                queues.dirty.retain(|other| *other != entity);
            }
            let stager = playback.stager.take();
            let stager = stager.filter(|stager| device.as_ref().is_some_and(|device| stager.is_of(device)));
            playback.stager = stager.or_else(|| uploads.stager(device.as_deref()));
            playback.begin(active, has_threads);
            if has_threads {
                break;
            }
        }
        if is_over || active.playhead.playback.is_none() {
            drop_in_background(core::mem::take(&mut *playback));
            commands.entity(entity).try_remove::<AsyncPlayback>();
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
            prelude::*,
        },
    };

    /// Where tasks run in place, moments are made in slices of frames, one a frame if there is no time, and the end is the same.
    #[test]
    fn slices_make_what_tasks_make() {
        let end = |no_threads: bool| {
            let mut app = app(CrackBudget { milliseconds: 0.0, ..default() });
            app.world_mut().resource_mut::<Threads>().are_missing = no_threads;
            let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::new(300, 200)));
            let guided = GuidedCracks::new(CrackGuide::new(Grid::new(UVec2::new(3, 1), 0.5)))
                .with_appearance(GuidedAppearance::Widen { seconds: 0.05 });
            let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::default(), guided)).id();
            let mut slices = 0;
            while app.world().get::<CrackState>(entity).is_none_or(|state| state.status != CrackStatus::Done) {
                let left_to_paint = |app: &App| {
                    let Some(Running::Slices(job)) = &app.world().get::<AsyncPlayback>(entity)?.job else {
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
}
