//! Times of baked cracks that are drawn and painted beside the frames: they are too many for a frame, which only exchanges pictures.

use super::{
    CrackBudget, CrackState,
    bake::{Bakes, guarded},
    beside::{Beside, throw_away},
    budget::{FrameClock, Timer},
    paint::tell_painted,
    picture::BasePicture,
    surfaces::{Active, Surfaces, Touched},
    textures::{self, TextureKind},
    upload::{Staged, Stager, Uploads},
};
use crate::{
    growth::CrackGrowth,
    paint::{LookTable, PaintTargets, paint_rects},
    pattern::{Moment, Network, Timeline},
    raster::{DepthField, DirtyTiles, Redrawn, Replay, TexelRect},
};
use bevy::{platform::time::Instant, prelude::*, render::renderer::RenderDevice};
use std::{sync::Arc, time::Duration};

/// Texels that are painted in a slice, and segments that are looked at: well below a millisecond.
const SLICE: u64 = 1 << 14;
const SEGMENTS: usize = 256;

/// So long a task may wait for a thread before its work is done in slices of frames.
const PATIENCE: Duration = Duration::from_millis(50);

/// Frames after which memory is given back if time stands still.
const IDLE: u32 = 60;

/// Parts of a side, each with one rectangle to upload at the most.
const PARTS: u32 = 8;

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

/// A network and its past, as they were when they were copied.
struct Score {
    network: Network,
    timeline: Timeline,
}

impl Score {
    fn of(growth: &CrackGrowth) -> Arc<Self> {
        Arc::new(Self { network: growth.network().clone(), timeline: growth.timeline().clone() })
    }

    fn is_of(&self, growth: &CrackGrowth) -> bool {
        // Nothing is ever changed but by an entry more.
        self.timeline.entries(u32::MAX) == growth.timeline().entries(u32::MAX)
    }
}

/// The texels that were shown before those that are.
struct Back {
    texels: [Option<Vec<u8>>; 3],
    /// Texels of the field that have changed since.
    behind: Vec<TexelRect>,
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
                while matches!(shot.stage, Stage::Draw) {
                    shot.step();
                }
                Some(shot)
            }
        }
    }
}

/// A moment as a machine that is stepped, with all that it takes out of the surface meanwhile.
struct Shot {
    score: Arc<Score>,
    moment: Moment,
    base: Arc<BasePicture>,
    look: LookTable,
    /// Which textures there are, and the part of them that is shown.
    maps: [bool; 3],
    rect: TexelRect,
    stager: Option<Stager>,
    field: DepthField,
    replay: Replay,
    touched: Touched,
    back: Option<Back>,
    /// What is not as the textures show it.
    dirty: DirtyTiles,
    redrawn: Redrawn,
    stage: Stage,
    /// The same when it is made: texels of the field.
    changed: Vec<TexelRect>,
    staged: [Option<Staged>; 3],
}

enum Stage {
    /// As it was.
    Begin,
    Draw,
    /// What is left to paint.
    Paint(Vec<TexelRect>),
    Made,
}

impl Shot {
    fn finish(mut self: Box<Self>) -> Box<Self> {
        while !self.step() {}
        self
    }

    /// A slice of the work; says whether it was the last one.
    fn step(&mut self) -> bool {
        let Score { network, timeline } = &*self.score;
        match &mut self.stage {
            Stage::Begin => {
                self.replay.begin(&mut self.field, network, timeline, self.moment, &mut self.redrawn);
                self.stage = Stage::Draw;
            }
            Stage::Draw => {
                if self.replay.draw(&mut self.field, network, timeline, SEGMENTS, &mut self.redrawn) {
                    self.replay.end(&self.field, &mut self.redrawn);
                    self.stage = Stage::Paint(self.plan());
                }
            }
            Stage::Paint(rects) => {
                let mut slice = Vec::new();
                let mut area = 0;
                while let Some(rect) = rects.pop_if(|rect| area == 0 || area + rect.area() <= SLICE) {
                    area += rect.area();
                    slice.push(rect);
                }
                self.paint(&slice);
                if area == 0 {
                    self.stage();
                    self.stage = Stage::Made;
                }
            }
            Stage::Made => {}
        }
        matches!(self.stage, Stage::Made)
    }

    /// Finds out what is to be painted.
    fn plan(&mut self) -> Vec<TexelRect> {
        let Self { redrawn, touched, dirty, field, .. } = self;
        redrawn.cleared.iter().for_each(|tile| touched.unmark(*tile));
        redrawn.stamped.iter().for_each(|rect| touched.mark(*rect));
        let size = field.frame.size();
        redrawn.changed.iter().for_each(|rect| dirty.mark(rect.grow(1, size)));
        self.changed.clear();
        dirty.take_rects(&mut self.changed);
        let mut rects = Vec::new();
        match &self.back {
            Some(back) => {
                self.changed.iter().chain(&back.behind).for_each(|rect| dirty.mark(*rect));
                dirty.take_rects(&mut rects);
            }
            None => {
                let mut kinds = textures::KINDS.iter().zip(self.maps);
                let texels = [(); 3].map(|()| {
                    let (kind, _) = kinds.next().filter(|(_, is_wanted)| *is_wanted)?;
                    Some((kind.texels)(&self.base))
                });
                self.back = Some(Back { texels, behind: Vec::new() });
                rects.push(TexelRect::whole(size));
            }
        }
        let shown = TexelRect::whole(self.rect.size());
        rects.into_iter().flat_map(|rect| bands(rect.intersect(shown))).collect()
    }

    fn paint(&mut self, rects: &[TexelRect]) {
        let Some(back) = &mut self.back else { return };
        let [diffuse, normal, depth] = back.texels.each_mut().map(Option::as_deref_mut);
        let mut targets = PaintTargets { diffuse, normal, depth };
        paint_rects(self.base.texels(), &self.field, &self.look, rects, self.rect.min, &mut targets);
    }

    /// Brings what has changed to where the renderer can read it.
    fn stage(&mut self) {
        let (Some(stager), Some(back)) = (&self.stager, &self.back) else { return };
        let rects = self.in_image(&gather(&self.changed, self.field.frame.size()));
        let mut kinds = textures::KINDS.iter().map(TextureKind::texel);
        self.staged = back.texels.each_ref().map(|texels| {
            let texel = kinds.next()?;
            stager.stage(texels.as_ref()?, self.base.size, texel, &rects)
        });
    }

    /// Rectangles of the field in the image.
    fn in_image(&self, rects: &[TexelRect]) -> Vec<TexelRect> {
        let (origin, shown) = (self.rect.min, TexelRect::whole(self.rect.size()));
        let rects = rects.iter().map(|rect| rect.intersect(shown)).filter(|rect| !rect.is_empty());
        rects.map(|rect| TexelRect { min: rect.min + origin, max: rect.max + origin }).collect()
    }
}

/// A rectangle in parts of no more than a slice, or a row.
fn bands(rect: TexelRect) -> impl Iterator<Item = TexelRect> {
    let rows = (SLICE / u64::from(rect.size().x.max(1))).max(1);
    (rect.min.y..rect.max.y).step_by(rows as usize).map(move |y| TexelRect {
        min: UVec2::new(rect.min.x, y),
        max: UVec2::new(rect.max.x, rect.max.y.min(y + rows as u32)),
    })
}

/// Few rectangles around all of these: each costs a copy of its own, and the thread of the frames orders them.
fn gather(rects: &[TexelRect], size: UVec2) -> Vec<TexelRect> {
    let side = (size / PARTS + 1).max(UVec2::ONE);
    let mut parts = vec![TexelRect::default(); (PARTS * PARTS) as usize];
    for rect in rects.iter().filter(|rect| !rect.is_empty()) {
        let (first, last) = (rect.min / side, (rect.max - 1) / side);
        for y in first.y..=last.y {
            for x in first.x..=last.x {
                let min = UVec2::new(x, y) * side;
                if let Some(part) = parts.get_mut((y * PARTS + x) as usize) {
                    *part = part.union(rect.intersect(TexelRect { min, max: min + side }));
                }
            }
        }
    }
    // Those beside one another together, unless that is much more.
    let mut gathered = Vec::<TexelRect>::new();
    for row in parts.chunks(PARTS as usize) {
        let mut before = TexelRect::default();
        for part in row.iter().filter(|part| !part.is_empty()) {
            let both = before.union(*part);
            if !before.is_empty() && 4 * both.area() <= 5 * (before.area() + part.area()) {
                before = both;
                gathered.pop();
            } else {
                before = *part;
            }
            gathered.push(before);
        }
    }
    gathered
}

impl Film {
    /// Of a growth all of whose times are to be shown, and of the texels that are shown first: beside the frames, as both are copied.
    pub(super) fn new(growth: &CrackGrowth, texels: &[Option<Vec<u8>>; 3]) -> Self {
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
            staged: [const { None }; 3],
        });
        active.is_dirty = true;
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
            film.stager = film.stager.or_else(|| uploads.stager(device.as_deref()));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    fn random_rects(rng: &mut Rng, size: UVec2) -> Vec<TexelRect> {
        let mut corner = || UVec2::new(rng.next_u32() % size.x, rng.next_u32() % size.y);
        let rect = |(a, b): (UVec2, UVec2)| TexelRect { min: a.min(b), max: a.max(b) + 1 };
        (0..6).map(|_| rect((corner(), corner()))).collect()
    }

    #[test]
    fn few_rectangles_hold_them_all() {
        let mut rng = Rng::new(8);
        for size in [[1, 1], [7, 300], [64, 64], [1000, 700]].map(UVec2::from) {
            for n in 0..7 {
                let rects = random_rects(&mut rng, size).split_off(n.min(6));
                let gathered = gather(&rects, size);
                assert!(gathered.len() <= 64);
                let of = |rects: &[TexelRect]| -> Vec<bool> {
                    let at = |i: u32| UVec2::new(i % size.x, i / size.x);
                    let is_in = |at: UVec2, r: &TexelRect| at.cmpge(r.min).all() && at.cmplt(r.max).all();
                    (0..size.element_product()).map(|i| rects.iter().any(|r| is_in(at(i), r))).collect()
                };
                let (wanted, got) = (of(&rects), of(&gathered));
                assert!(wanted.iter().zip(&got).all(|(wanted, got)| got >= wanted), "{rects:?} {gathered:?}");
                let area: u64 = gathered.iter().map(|rect| rect.area()).sum();
                assert_eq!(area, got.iter().filter(|is| **is).count() as u64, "each texel once");
            }
        }
    }

    #[test]
    fn bands_are_the_rectangle() {
        for size in [[1, 40_000], [40_000, 3], [500, 333]].map(UVec2::from) {
            let rect = TexelRect { min: UVec2::new(3, 5), max: UVec2::new(3, 5) + size };
            let mut y = rect.min.y;
            for band in bands(rect) {
                assert!(band.min == UVec2::new(3, y) && band.max.x == rect.max.x && !band.is_empty());
                assert!(band.area() <= SLICE || band.size().y == 1);
                y = band.max.y;
            }
            assert_eq!(y, rect.max.y);
        }
        assert_eq!(bands(TexelRect::default()).count(), 0);
    }

    /// Where tasks run in place, moments are made in slices of frames, one a frame if there is no time, and the end is the same.
    #[cfg(feature = "2d")]
    #[test]
    fn slices_make_what_tasks_make() {
        use crate::{
            Grid,
            plugin::{
                headless::{app, blank, shown},
                prelude::*,
            },
        };
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
