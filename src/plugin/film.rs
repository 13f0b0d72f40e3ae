//! Times of baked cracks that are drawn and painted beside the frames: they are too many for a frame, which only exchanges pictures.

mod shot;

use super::{
    CrackBudget, CrackState,
    bake::{Bakes, guarded},
    beside::{Beside, throw_away},
    budget::{FrameClock, Timer},
    paint::tell_painted,
    surfaces::{Active, Surfaces, Touched},
    textures::MAPS,
    upload::{Stager, Uploads},
};
use crate::{
    growth::CrackGrowth,
    pattern::Moment,
    raster::{DepthField, DirtyTiles, Redrawn, Replay, TexelRect},
};
use bevy::{platform::time::Instant, prelude::*, render::renderer::RenderDevice};
use shot::{Back, Score, Shot, Stage, gather};
use std::{sync::Arc, time::Duration};

/// So long a task may wait for a thread before its work is done in slices of frames.
const PATIENCE: Duration = Duration::from_millis(50);

/// Frames after which memory is given back if time stands still.
const IDLE: u32 = 60;

/// What shows the times of a surface with baked cracks.
#[derive(Default)]
pub(super) struct Film {
    score: Option<Arc<Score>>,
    back: Option<Back>,
    shot: Option<Out>,
    stager: Option<Stager>,
    /// Frames since anything was to be shown.
    idle: u32,
}

/// A moment that is being made.
enum Out {
    /// By a task, since then.
    Task(Beside<Box<Shot>, Option<Box<Shot>>>, Instant),
    Slices(Box<Shot>),
}

/// What has become of it.
enum News {
    Out(Out),
    Made(Box<Shot>),
    /// The task has failed.
    Lost,
}

impl Out {
    fn start(shot: Box<Shot>, has_threads: bool) -> Self {
        if has_threads {
            Self::Task(Beside::start(shot, |shot| guarded(|| Ok(shot.finish())).ok()), Instant::now())
        } else {
            Self::Slices(shot)
        }
    }

    /// Looks after it; makes slices until the time is over.
    fn look(self, timer: &Timer) -> News {
        match self {
            Self::Task(task, _) if task.is_done() => task.finish().flatten().map_or(News::Lost, News::Made),
            Self::Task(task, since) if since.elapsed() < PATIENCE => News::Out(Self::Task(task, since)),
            Self::Task(task, since) => match task.take_back() {
                Some(shot) => Self::Slices(shot).look(timer),
                None => News::Out(Self::Task(task, since)),
            },
            Self::Slices(mut shot) => loop {
                if shot.step() {
                    return News::Made(shot);
                }
                if timer.is_over() {
                    return News::Out(Self::Slices(shot));
                }
            },
        }
    }

    /// What there is of it; waits for a task that is at work.
    fn recall(self) -> Option<Box<Shot>> {
        match self {
            Self::Task(task, _) => task.take_back().or_else(|| task.finish().flatten()),
            Self::Slices(mut shot) => {
                while matches!(shot.stage, Stage::Draw | Stage::Crush) {
                    shot.step();
                }
                Some(shot)
            }
        }
    }
}

impl Film {
    /// Of a growth all of whose times are to be shown, and of the texels that are shown first: beside the frames, as both are copied.
    pub(super) fn new(growth: &CrackGrowth, texels: &[Option<Vec<u8>>; MAPS]) -> Self {
        let back = Back { texels: texels.clone(), behind: Vec::new() };
        Self { score: Some(Score::of(growth)), back: Some(back), ..Self::default() }
    }

    /// Begins to make what the surface is to show.
    fn start(&mut self, active: &mut Active, has_threads: bool) {
        let moment = active.moment();
        let Active { playback: Some(playback), growth, field, profile, views, view, textures, .. } = active else {
            return;
        };
        let Some(view) = views.get_mut(*view) else { return };
        let score = self.score.take().filter(|score| score.is_of(growth)).unwrap_or_else(|| Score::of(growth));
        self.score = Some(score.clone());
        let size = field.frame.size();
        let shot = Box::new(Shot {
            score,
            moment,
            base: active.base.clone(),
            look: active.look.clone(),
            maps: textures.all().map(|texture| texture.is_some()),
            rect: view.rect,
            stager: self.stager.clone(),
            field: field.take(),
            replay: core::mem::replace(&mut playback.replay, Replay::over(UVec2::ZERO, *profile)),
            touched: core::mem::take(&mut active.touched),
            back: self.back.take(),
            dirty: core::mem::replace(&mut view.dirty, DirtyTiles::new(size)),
            redrawn: Redrawn::default(),
            stage: Stage::Begin,
            changed: Vec::new(),
            staged: [const { None }; MAPS],
        });
        (active.is_dirty, active.is_late) = (true, false);
        self.shot = Some(Out::start(shot, has_threads));
    }

    /// Shows what was made, and keeps what was shown.
    fn take_up(&mut self, active: &mut Active, shot: Shot, images: &mut Assets<Image>, uploads: &mut Uploads) {
        let rects = shot.in_image(&gather(&shot.changed, shot.field.frame.size()));
        let Shot { field, replay, touched, moment, back, changed, staged, .. } = shot;
        (active.field, active.touched) = (field, touched);
        if let Some(playback) = &mut active.playback {
            (playback.replay, playback.shown) = (replay, moment);
        }
        let Some(mut back) = back else { return };
        if !changed.is_empty() {
            let pictures = active.textures.all().into_iter().zip(&mut back.texels).zip(staged);
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
            throw_away((back, self.stager.take()));
        }
    }
}

impl Active {
    /// Whether its times can be made beside the frames: nothing else is to paint its textures.
    fn is_filmable(&self) -> bool {
        self.playback.is_some() && self.broken.is_none() && self.views.len() == 1
    }

    /// Ends what is made of it beside the frames: it is as if it had been drawn and not painted yet.
    pub(super) fn recall(&mut self) {
        let Some(film) = &mut self.film else { return };
        film.score = None;
        film.rest();
        let Some(out) = film.shot.take() else { return };
        self.is_dirty = false;
        match out.recall() {
            Some(shot) => {
                let Shot { field, replay, touched, moment, mut dirty, mut changed, stage, .. } = *shot;
                (self.field, self.touched) = (field, touched);
                if let Some(playback) = &mut self.playback {
                    playback.replay = replay;
                    if !matches!(stage, Stage::Begin) {
                        playback.shown = moment;
                    }
                }
                dirty.take_rects(&mut changed);
                changed.into_iter().for_each(|rect| self.mark(rect));
            }
            None => self.start_over(),
        }
    }

    /// Draws all of it anew: what was drawn is lost.
    fn start_over(&mut self) {
        let frame = self.field.frame;
        self.field = DepthField::new(frame);
        self.field.forbid(self.growth.mask());
        self.field.lay(self.preset.look.layer(self.surface.seed));
        self.touched = Touched::new(frame.size());
        let (profile, whole) = (self.profile, TexelRect::whole(frame.size()));
        if let Some(playback) = &mut self.playback {
            playback.start_over(frame, profile);
            playback.shown = Moment::START;
        }
        self.mark(whole);
    }

    /// Lets go what is made of it beside the frames.
    pub(super) fn drop_film(&mut self) {
        if let Some(film) = self.film.take() {
            self.is_dirty = self.is_dirty && film.shot.is_none();
            throw_away(film);
        }
    }
}

impl Surfaces {
    /// Has the times of a surface with baked cracks made beside the frames, if it shows any but the end.
    pub(super) fn film(&mut self, entity: Entity, film: Option<Box<Film>>) {
        if let Some(active) = self.active.get_mut(&entity)
            && active.added.is_some()
            && active.playback.is_some()
            && active.film.is_none()
        {
            active.film = Some(film.unwrap_or_default());
            if !self.filmed.contains(&entity) {
                self.filmed.push(entity);
            }
        }
    }
}

/// Whether the times of any surface are made beside the frames.
pub(super) fn any_filmed(surfaces: Res<Surfaces>) -> bool {
    !surfaces.filmed.is_empty()
}

/// Takes up what was made of surfaces with baked cracks, and has made what they are to show now.
pub(super) fn show_films(
    mut commands: Commands,
    budget: Res<CrackBudget>,
    mut clock: ResMut<FrameClock>,
    bakes: Res<Bakes>,
    device: Option<Res<RenderDevice>>,
    mut surfaces: ResMut<Surfaces>,
    mut uploads: ResMut<Uploads>,
    images: Option<ResMut<Assets<Image>>>,
    mut states: Query<&mut CrackState>,
) {
    let Some(mut images) = images else { return };
    let timer = clock.start(&budget, 1.0);
    let has_threads = bakes.pool().is_some();
    let mut filmed = core::mem::take(&mut surfaces.filmed);
    filmed.retain(|&entity| {
        let Surfaces { active, dirty, requests, .. } = &mut *surfaces;
        let Some(active) = active.get_mut(&entity) else { return false };
        let Some(mut film) = active.film.take() else { return false };
        let mut is_new = true;
        loop {
            if let Some(out) = film.shot.take() {
                let before = active.playback.as_ref().map(|playback| playback.shown);
                match out.look(&timer) {
                    News::Out(out) => {
                        film.shot = Some(out);
                        break;
                    }
                    News::Made(shot) => film.take_up(active, *shot, &mut images, &mut uploads),
                    News::Lost => active.start_over(),
                }
                tell_painted(active, entity, before, &mut states, &mut commands);
            }
            let is_stale = active.views.get(active.view).is_some_and(|view| !view.dirty.is_empty());
            let is_stale = is_stale || active.playback.as_ref().is_some_and(|playback| playback.replay.is_stale());
            let is_wanted = active.is_behind() || is_stale;
            let is_due = !budget.is_boundless() && requests.iter().all(|request| request.entity != entity);
            if !(is_due && active.is_filmable()) {
                film.rest();
                if is_wanted && !active.is_dirty {
                    active.is_dirty = true;
                    dirty.push_back(entity);
                }
                break;
            }
            film.idle = if is_wanted { 0 } else { film.idle + 1 };
            if film.idle == IDLE {
                film.rest();
            }
            if !(is_wanted && core::mem::take(&mut is_new)) {
                break;
            }
            if active.is_dirty {
                dirty.retain(|other| *other != entity);
            }
            let stager = film.stager.filter(|stager| device.as_ref().is_some_and(|device| stager.is_of(device)));
            film.stager = stager.or_else(|| uploads.stager(device.as_deref()));
            film.start(active, has_threads);
            if has_threads {
                break;
            }
        }
        if active.playback.is_none() {
            throw_away(film);
            return false;
        }
        active.film = Some(film);
        true
    });
    surfaces.filmed = filmed;
    clock.stop(&timer);
}

#[cfg(all(test, feature = "2d"))]
mod tests {
    use super::*;
    use crate::{
        Grid,
        plugin::{
            headless::{app, blank, shown},
            prelude::*,
        },
    };

    /// Where tasks run in place, moments are made in slices of frames, one a frame if there is no time, and the end is the same.
    #[test]
    fn slices_make_what_tasks_make() {
        let end = |no_threads: bool| {
            let mut app = app(CrackBudget { milliseconds: 0.0, ..default() });
            app.world_mut().resource_mut::<Bakes>().no_threads = no_threads;
            let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::new(300, 200)));
            let guided = GuidedCracks::new(CrackGuide::new(Grid::new(UVec2::new(3, 1), 0.5)))
                .with_appearance(GuidedAppearance::Widen { seconds: 0.05 });
            let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::default(), guided)).id();
            let mut slices = 0;
            while app.world().get::<CrackState>(entity).is_none_or(|state| state.status != CrackStatus::Done) {
                let left_to_paint = |app: &App| {
                    let active = app.world().resource::<Surfaces>().active.get(&entity)?;
                    let Some(Out::Slices(shot)) = &active.film.as_ref()?.shot else { return None };
                    let Stage::Paint(rects) = &shot.stage else { return None };
                    Some(rects.iter().map(|rect| rect.area()).sum::<u64>())
                };
                let before = left_to_paint(&app);
                app.update();
                if let (Some(before), Some(after)) = (before, left_to_paint(&app)) {
                    assert!(before - after <= shot::SLICE, "{before} {after}");
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
