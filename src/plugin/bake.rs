//! Bakes: from guides to a network, on a task or in slices of frames.

use super::{
    BakeProgress, CrackBaked, CrackBudget, CrackError, CrackFailed, CrackStatus, GuideSource, GuidedAppearance,
    GuidedCracks,
    activate::{density, make_ready, set_status},
    budget::FrameClock,
    picture::{self, Space},
    surfaces::{Added, Surfaces},
    watch::grown_anew,
};
use crate::{
    Grid,
    pattern::Network,
    raster::TexelRect,
    voronoi::{self, Guide, Seams, VoronoiBake},
};
use bevy::{
    asset::RenderAssetUsages,
    image::{CompressedImageFormats, ImageSampler, ImageType},
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, futures::check_ready},
};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU32, Ordering},
    },
    thread::{self, ThreadId},
    vec,
};

/// Share of the frame's budget after which no further slice is made.
const SHARE: f32 = 0.9;

/// Texels of a slice: well below a millisecond.
const SLICE: u32 = 1 << 14;

/// Longest side of a guide, texels.
const MAX_SIDE: u32 = 8192;

/// The most bytes of a guide.
const MAX_BYTES: u64 = 256 << 20;

/// Steps in which the cracks of a front open behind its tip.
const FRONT_OPENING: u32 = 12;

/// Steps in which cracks open that widen all at once.
const WIDE_OPENING: u32 = 32;

/// Shares of the whole that reading the guides and drawing the lines are told to be.
const READ: f32 = 0.1;
const MAPPED: f32 = 0.95;

/// The bakes that go on, in order.
#[derive(Resource, Default)]
pub(super) struct Bakes {
    list: Vec<(Entity, Work)>,
    /// Bakes were cancelled while the list was worked on.
    cancelled: Vec<Entity>,
    /// Whether tasks turned out to run in place.
    no_threads: bool,
}

enum Work {
    /// Its pictures may not be there yet.
    Wanted,
    /// Others come first.
    Ready(Box<Job>),
    Task(Run),
    Slices(Box<Job>),
}

impl Work {
    const fn is_running(&self) -> bool {
        matches!(self, Self::Task(_) | Self::Slices(_))
    }
}

impl Bakes {
    /// Begins a bake anew.
    pub(super) fn want(&mut self, entity: Entity) {
        self.cancel(entity);
        self.cancelled.retain(|cancelled| *cancelled != entity);
        self.list.push((entity, Work::Wanted));
    }

    /// Ends a bake without a word.
    pub(super) fn cancel(&mut self, entity: Entity) {
        self.list.retain(|(baked, _)| *baked != entity);
        self.cancelled.push(entity);
    }
}

/// Whether any bake goes on.
pub(super) fn any_baking(bakes: Res<Bakes>) -> bool {
    !bakes.list.is_empty()
}

/// No bake any more.
pub(super) fn reset(progress: &mut Mut<BakeProgress>) {
    progress.set_if_neq(BakeProgress(0.0));
}

/// Ends the bake of a surface that is healed.
pub(super) fn cancel(world: &mut World, entity: Entity) {
    if let Some(mut bakes) = world.get_resource_mut::<Bakes>() {
        bakes.cancel(entity);
    }
    if let Some(mut progress) = world.get_mut::<BakeProgress>(entity) {
        reset(&mut progress);
    }
}

/// A task at work, which stops within a slice when this is dropped.
struct Run {
    task: Task<Outcome>,
    line: Arc<Line>,
}

/// What a task and its surface tell one another.
#[derive(Default)]
struct Line {
    cancelled: AtomicBool,
    /// The bits of the progress.
    progress: AtomicU32,
}

impl Drop for Run {
    fn drop(&mut self) {
        self.line.cancelled.store(true, Ordering::Relaxed);
    }
}

/// What comes back from a task.
enum Outcome {
    /// It runs where it was started, which would stand still meanwhile.
    NoThread(Box<Job>),
    Ended(Result<Product, CrackError>),
}

impl Run {
    fn start(pool: &AsyncComputeTaskPool, job: Box<Job>) -> Self {
        let line = Arc::new(Line::default());
        let (lined, home) = (line.clone(), thread::current().id());
        Self { task: pool.spawn(async move { work(job, &lined, home) }), line }
    }
}

/// The work of a task.
fn work(mut job: Box<Job>, line: &Line, home: ThreadId) -> Outcome {
    if thread::current().id() == home {
        return Outcome::NoThread(job);
    }
    loop {
        if line.cancelled.load(Ordering::Relaxed) {
            return Outcome::Ended(Err(CrackError::Bake { reason: "cancelled".into() }));
        }
        match guarded(|| job.step()) {
            Ok(None) => line.progress.store(job.progress.to_bits(), Ordering::Relaxed),
            Ok(Some(product)) => return Outcome::Ended(Ok(product)),
            Err(error) => return Outcome::Ended(Err(error)),
        }
    }
}

/// A panic becomes an error: in a task it would end the app.
fn guarded<T>(run: impl FnOnce() -> Result<T, CrackError>) -> Result<T, CrackError> {
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<&str>().copied().or(panic.downcast_ref::<String>().map(String::as_str));
        Err(CrackError::Bake { reason: format!("it panicked: {}", text.unwrap_or("unknown")) })
    })
}

/// A bake as a machine that is stepped; depends on nothing but itself.
struct Job {
    sources: vec::IntoIter<(Source, f32)>,
    n_sources: usize,
    guides: Vec<Guide>,
    guided: GuidedCracks,
    size: UVec2,
    map: Option<VoronoiBake>,
    progress: f32,
}

/// A guide that is not read yet.
enum Source {
    Image(Box<Image>),
    Grid(Arc<Grid<f32>>),
    Png(Arc<[u8]>),
    /// The surface's own picture.
    Own(UVec2, Vec<u8>),
}

/// What a bake makes.
struct Product {
    network: Network,
    opening: u32,
    covered: Option<f32>,
}

impl Job {
    /// A slice of the work.
    fn step(&mut self) -> Result<Option<Product>, CrackError> {
        if let Some((source, gamma)) = self.sources.next() {
            let index = self.guides.len();
            let image = source.read().map_err(|reason| CrackError::Guide { index, reason })?;
            self.guides.push(Guide { image, gamma });
            self.progress = READ * self.guides.len() as f32 / self.n_sources as f32;
            return Ok(None);
        }
        let Some(map) = &mut self.map else {
            let (params, guides) = (self.guided.params.clone(), core::mem::take(&mut self.guides));
            let map = VoronoiBake::new(params, guides, self.size, self.guided.seed);
            self.map = Some(map.map_err(|error| CrackError::Bake { reason: error.to_string() })?);
            return Ok(None);
        };
        if let voronoi::BakeProgress::Working(share) = map.step((SLICE / self.size.x).max(1) as usize) {
            self.progress = READ + (MAPPED - READ) * share;
            return Ok(None);
        }
        let Some((map, seams)) = self.map.take().map(VoronoiBake::finish) else { return Ok(None) };
        let covered = map.strokes().map(|strokes| strokes.covered);
        drop(map);
        let (network, opening) = lines(&seams, self.guided.appearance);
        Ok(Some(Product { network, opening, covered }))
    }
}

/// The seams in the order in which they come, and the steps in which each opens.
fn lines(seams: &Seams, appearance: GuidedAppearance) -> (Network, u32) {
    if let GuidedAppearance::Front { from, .. } = appearance {
        return (seams.network(from * seams.extent), FRONT_OPENING);
    }
    let mut network = seams.network(Vec2::ZERO);
    network.nodes.iter_mut().for_each(|node| node.birth = 0);
    network.links.iter_mut().for_each(|link| link.birth = 0);
    (network, if matches!(appearance, GuidedAppearance::AtOnce) { 0 } else { WIDE_OPENING })
}

impl Source {
    fn read(self) -> Result<Grid<f32>, String> {
        let image = match self {
            Self::Grid(grid) => return Ok(Arc::unwrap_or_clone(grid)),
            Self::Own(size, rgba) => {
                let picture = voronoi::lightness(size, &rgba).ok_or("its size is wrong")?;
                return Ok(voronoi::edges(&picture));
            }
            Self::Image(image) => *image,
            Self::Png(file) => decode(&file)?,
        };
        let size = picture::readable_size(&image).map_err(|error| error.to_string())?;
        let rgba = picture::read(&image, Space::Srgb, size).map_err(|error| error.to_string())?;
        Ok(voronoi::ink(size, &rgba).ok_or("its size is wrong")?)
    }
}

/// A PNG file as an image; what is too large is refused before memory is taken.
fn decode(file: &[u8]) -> Result<Image, String> {
    // Signature, length of the header, its name; width, height, bits, kind of colour.
    let header = file.strip_prefix(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR").and_then(|rest| rest.first_chunk::<10>());
    let &[a, b, c, d, e, f, g, h, bits, _] = header.ok_or("it is no PNG file")?;
    let (width, height) = (u32::from_be_bytes([a, b, c, d]), u32::from_be_bytes([e, f, g, h]));
    let texel = 4 * u64::from(bits.div_ceil(8));
    if width.max(height) > MAX_SIDE || u64::from(width) * u64::from(height) * texel > MAX_BYTES {
        return Err(format!("{width} x {height} texels are beyond the limit of {MAX_SIDE} a side and 256 MiB"));
    }
    let (kind, sampler) = (ImageType::MimeType("image/png"), ImageSampler::Default);
    let usage = RenderAssetUsages::MAIN_WORLD;
    Image::from_buffer(file, kind, CompressedImageFormats::NONE, true, sampler, usage)
        .map_err(|error| error.to_string().lines().next().unwrap_or_default().to_owned())
}

/// Works on all bakes: starts those that can start, asks those on tasks, and makes slices of those that have none.
pub(super) fn bake_guided(world: &mut World) {
    let timer = world.resource::<FrameClock>().start(world.resource::<CrackBudget>(), SHARE);
    let mut bakes = world.resource_mut::<Bakes>();
    bakes.cancelled.clear();
    let mut list = core::mem::take(&mut bakes.list);
    let pool = AsyncComputeTaskPool::try_get().filter(|_| !bakes.no_threads);
    let mut room = pool.map_or(1, |pool| pool.thread_num().max(1));
    room = room.saturating_sub(list.iter().filter(|(_, work)| work.is_running()).count());
    let mut ended = Vec::new();
    list.retain_mut(|(entity, work)| {
        let result = loop {
            match work {
                Work::Wanted => match job(world, *entity) {
                    Ok(Some(job)) => *work = Work::Ready(Box::new(job)),
                    Ok(None) => {
                        tell(world, *entity, 0.0);
                        return true;
                    }
                    Err(error) => break Err(error),
                },
                Work::Ready(_) => {
                    tell(world, *entity, 0.0);
                    if room == 0 {
                        return true;
                    }
                    room -= 1;
                    let Work::Ready(job) = core::mem::replace(work, Work::Wanted) else { return true };
                    *work = match pool {
                        Some(pool) => Work::Task(Run::start(pool, job)),
                        None => Work::Slices(job),
                    };
                }
                Work::Task(run) => match check_ready(&mut run.task) {
                    None => {
                        tell(world, *entity, f32::from_bits(run.line.progress.load(Ordering::Relaxed)));
                        return true;
                    }
                    Some(Outcome::NoThread(job)) => {
                        world.resource_mut::<Bakes>().no_threads = true;
                        *work = Work::Slices(job);
                    }
                    Some(Outcome::Ended(result)) => break result,
                },
                Work::Slices(job) => match guarded(|| job.step()).transpose() {
                    None => {
                        tell(world, *entity, job.progress);
                        if timer.is_over() {
                            return true;
                        }
                    }
                    Some(result) => break result,
                },
            }
        };
        ended.push((*entity, result));
        false
    });
    // What was begun or cancelled meanwhile has the last word.
    let mut bakes = world.resource_mut::<Bakes>();
    let newer = core::mem::take(&mut bakes.list);
    let cancelled = core::mem::take(&mut bakes.cancelled);
    list.retain(|(entity, _)| !cancelled.contains(entity) && newer.iter().all(|(other, _)| other != entity));
    list.extend(newer);
    bakes.list = list;
    world.resource_mut::<FrameClock>().stop(&timer);
    for (entity, result) in ended {
        end(world, entity, result);
    }
}

fn tell(world: &mut World, entity: Entity, progress: f32) {
    if let Some(mut told) = world.get_mut::<BakeProgress>(entity) {
        told.set_if_neq(BakeProgress(progress));
    }
}

/// Takes up the result of a bake.
fn end(world: &mut World, entity: Entity, result: Result<Product, CrackError>) {
    match result.and_then(|product| adopt(world, entity, product)) {
        Ok(Some(covered)) => {
            tell(world, entity, 1.0);
            world.trigger(CrackBaked { entity, covered });
        }
        // Healed in the same moment.
        Ok(None) => {}
        Err(error) => {
            warn!("the guided cracks of {entity} are not made: {error}");
            world.trigger(CrackFailed { entity, error });
        }
    }
}

/// All that a bake needs; `None` if its pictures are not there yet.
fn job(world: &mut World, entity: Entity) -> Result<Option<Job>, CrackError> {
    let Some(guided) = world.get::<GuidedCracks>(entity).cloned() else { return Ok(None) };
    if !make_ready(world, entity)? {
        return Ok(None);
    }
    let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
    let Some(active) = world.resource::<Surfaces>().active.get(&entity) else { return Ok(None) };
    let mut sources = Vec::with_capacity(guided.guides.len());
    for (index, guide) in guided.guides.iter().enumerate() {
        let named = |error: CrackError| CrackError::Guide { index, reason: error.to_string() };
        let source = match &guide.source {
            GuideSource::Grid(grid) => Source::Grid(grid.clone()),
            GuideSource::Png(file) => Source::Png(file.clone()),
            GuideSource::OwnEdges => {
                let rect = active.views.get(active.view).map_or(TexelRect::default(), |view| view.rect);
                Source::Own(rect.size(), super::mask::part(&active.base.diffuse, active.base.size, rect))
            }
            GuideSource::Image(image) => {
                if !picture::is_loaded(world, image).map_err(named)? {
                    return Ok(None);
                }
                let Some(image) = images.get(image) else { return Ok(None) };
                let size = picture::readable_size(image).map_err(named)?;
                if size.max_element() > MAX_SIDE {
                    return Err(named(CrackError::Size { width: size.x, height: size.y }));
                }
                Source::Image(Box::new(image.clone()))
            }
        };
        sources.push((source, guide.gamma));
    }
    let size = active.field.frame.size();
    let side = size.max_element();
    let scale = f64::from(guided.max_side.clamp(1, side)) / f64::from(side);
    let size = (size.as_dvec2() * scale).round().as_uvec2().max(UVec2::ONE);
    Ok(Some(Job {
        n_sources: sources.len(),
        sources: sources.into_iter(),
        guides: Vec::new(),
        guided,
        size,
        map: None,
        progress: 0.0,
    }))
}

/// Puts baked cracks on their surface; `None` if it is gone.
fn adopt(world: &mut World, entity: Entity, product: Product) -> Result<Option<Option<f32>>, CrackError> {
    let Some(seconds) = world.get::<GuidedCracks>(entity).map(|guided| match guided.appearance {
        GuidedAppearance::AtOnce => 0.0,
        GuidedAppearance::Front { seconds, .. } | GuidedAppearance::Widen { seconds } => seconds,
    }) else {
        return Ok(None);
    };
    let mut surfaces = world.resource_mut::<Surfaces>();
    let Some(active) = surfaces.active.get_mut(&entity) else { return Ok(None) };
    let is_first = active.added.is_none() && active.growth.network().nodes().is_empty();
    let Product { network, opening, covered } = product;
    let mut added = Added { network, opening, steps: 0 };
    if is_first {
        added.steps = active.growth.add_cracks(&added.network, added.opening);
        active.added = Some(added);
    } else {
        let before = active.added.replace(added);
        let (extent, mask) = (active.field.frame.extent(), active.growth.mask().clone());
        let rect = active.views.get(active.view).map_or(TexelRect::default(), |view| view.rect);
        let base = active.surface.alpha_mask.then_some(&active.base);
        let density = base.and_then(|base| density(rect.size(), |texel| base.is_hole(rect.min + texel)));
        active.growth = grown_anew(active, before.map_or(0, |before| before.steps), extent, mask, density)?;
        active.mind_holes();
    }
    let is_untouched = active.growth.impacts().is_empty();
    active.show_anew(is_untouched.then_some(seconds));
    surfaces.start_growing(entity);
    surfaces.soil(entity);
    set_status(world, entity, CrackStatus::Growing);
    Ok(Some(covered))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn e11_a_panic_is_an_error() {
        let outcome = guarded(|| -> Result<(), CrackError> { panic!("no {}", "luck") });
        assert_eq!(outcome, Err(CrackError::Bake { reason: "it panicked: no luck".into() }));
        assert_eq!(guarded(|| Ok(7)), Ok(7));
    }

    #[cfg(feature = "2d")]
    fn blank(size: UVec2) -> Image {
        use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat};
        let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
        let format = TextureFormat::Rgba8UnormSrgb;
        Image::new_fill(extent, TextureDimension::D2, &[200, 200, 200, 255], format, RenderAssetUsages::default())
    }

    /// Frames until the bake has ended, and the progress after each.
    #[cfg(feature = "2d")]
    fn frames(no_threads: bool) -> (Vec<f32>, Vec<u8>) {
        use crate::plugin::prelude::*;
        use bevy::image::TextureAtlasLayout;
        let mut app = App::new();
        app.add_plugins((
            MinimalPlugins,
            TransformPlugin,
            AssetPlugin::default(),
            ImagePlugin::default(),
            CrackPlugins,
        ))
        .init_asset::<TextureAtlasLayout>();
        app.finish();
        app.cleanup();
        // No more than a slice a frame.
        app.insert_resource(CrackBudget { milliseconds: 0.0, ..default() });
        app.world_mut().resource_mut::<Bakes>().no_threads = no_threads;
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::new(300, 200)));
        let guide = CrackGuide::new(Grid::new(UVec2::new(3, 1), 0.5));
        let guided = GuidedCracks { max_side: 4096, ..GuidedCracks::new(guide) };
        let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::default(), guided)).id();
        let mut told = Vec::new();
        while told.last() != Some(&1.0) {
            app.update();
            told.extend(app.world().get::<BakeProgress>(entity).map(|progress| progress.0));
            assert!(told.len() < 1_000_000, "it never ends");
        }
        while app.world().get::<CrackState>(entity).is_some_and(|state| state.status != CrackStatus::Done) {
            app.update();
        }
        let image = app.world().get::<Sprite>(entity).map(|sprite| sprite.image.clone()).unwrap_or_default();
        let images = app.world().resource::<Assets<Image>>();
        (told, images.get(&image).and_then(|image| image.data.clone()).unwrap_or_default())
    }

    /// M9: where tasks run in place, a bake goes on in slices of frames, and makes the same cracks.
    #[cfg(feature = "2d")]
    #[test]
    fn e12_slices_make_what_tasks_make() {
        let (slices, cracked) = frames(true);
        assert!(slices.len() > 8 && slices.is_sorted(), "{slices:?}");
        let (task, same) = frames(false);
        assert!(task.is_sorted());
        assert!(cracked.iter().any(|&value| value < 100), "cracks show");
        assert!(cracked == same, "the same cracks");
    }
}
