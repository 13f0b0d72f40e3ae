//! What cracks cost in a frame of a game, beside painting and uploading whole images.
//!
//! `cargo bench --bench frame` builds the engine as games ship it; with `--profile dev` the build that `cargo test` uses serves.
//! `growing/*`: 100 surfaces of 512 x 512 that were hit at once, one step a frame each; the time of an idle frame of the same
//! app is taken off. "10,000 ...": a frame with cracked surfaces of 32 x 32 that have come to an end, in turns with one with
//! plain sprites. "a first hit": on a surface with a picture of its own. "... first hits": on surfaces that show the same picture. "only ...": parts of the first that no program could do without. `baking`: what of each frame the crate's systems
//! take while guided cracks are baked, 60 frames a second, from the first frame to ten after the last crack; `front`, `widen`: while they
//! appear within a second. "With an analogy": while cracks grow that are shown as those of a photograph. `shards/*`: what
//! the crate's own systems take of the main thread in the three frames in which a pane becomes 500 shards for the first time, 60 a second
//! (beside three in which nothing happens), in the one in which as many are shown once more, and in each in which 5,000 fly. With a Vulkan driver (software will do) uploads are part
//! of it; without, it says so.

#![expect(clippy::print_stdout, clippy::expect_used, reason = "a benchmark")]

use bevy::{
    app::{App, PluginsState},
    asset::RenderAssetUsages,
    ecs::schedule::SingleThreadedExecutor,
    prelude::*,
    render::{
        render_resource::{
            BufferDescriptor, BufferUsages, CommandEncoderDescriptor, Extent3d, Origin3d, PollType,
            TexelCopyBufferInfo, TexelCopyBufferLayout, TexelCopyTextureInfo, TextureAspect, TextureDimension,
            TextureFormat,
        },
        renderer::{RenderDevice, RenderQueue},
    },
    time::TimeUpdateStrategy,
};
use bevy_crack::{
    Grid,
    growth::CrackGrowth,
    math::Rng,
    paint::{
        BaseTexels, LookTable, PaintTargets,
        analogy::{AnalogyPair, AnalogyParams},
        paint_into,
    },
    pattern::SurfaceFrame,
    plugin::CrackUploadStats,
    prelude::*,
    raster::{DepthField, DirtyTiles, TexelRect, stamp_path, stamp_path_with},
    shatter::{Anchor, ShatterParams},
};
use criterion::{Criterion, criterion_group, criterion_main};
use std::{
    path::Path,
    time::{Duration, Instant},
};

const SURFACES: usize = 100;
const SIDE: u32 = 512;
/// Bakes of each size that are measured.
const BAKES: usize = 8;
/// Growing frames that are measured, after the one in which the textures are made.
const FRAMES: u32 = 12;
/// Surfaces that are hit for the first time, all at once.
const FIRST_HITS: u64 = 300;
/// Runs of which each frame is taken at its best.
const RUNS: usize = 8;

fn picture(side: u32) -> Image {
    let size = Extent3d { width: side, height: side, depth_or_array_layers: 1 };
    let texel = [150, 148, 140, 255];
    Image::new_fill(size, TextureDimension::D2, &texel, TextureFormat::Rgba8UnormSrgb, RenderAssetUsages::default())
}

/// An app without a window, stepped by hand.
fn app() -> App {
    let mut app = App::new();
    app.add_plugins(support::headless())
        .add_plugins(CrackPlugins)
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs(1) / 60))
        .insert_resource(CrackBudget { milliseconds: 1e6, max_texture_bytes: 1 << 34, ..default() });
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
    app
}

/// Time that the crate's systems of the main world took, all frames together, and CPU time of the thread that looks.
#[derive(Resource, Default)]
struct OurSystems(Option<(Instant, Duration)>, Duration, Duration);

fn start_watch(mut time: ResMut<OurSystems>) {
    let cpu = cpu_time_here();
    time.0 = Some((Instant::now(), cpu));
}

fn stop_watch(mut time: ResMut<OurSystems>) {
    let Some((start, cpu)) = time.0.take() else { return };
    time.1 += start.elapsed();
    time.2 += cpu_time_here().saturating_sub(cpu);
}

/// CPU time of this thread so far; zero where the system does not tell.
fn cpu_time_here() -> Duration {
    // The system brings its count up to date now.
    std::thread::yield_now();
    Duration::from_nanos(nanoseconds("/proc/thread-self/schedstat".as_ref()).unwrap_or(0))
}

fn nanoseconds(path: &Path) -> Option<u64> {
    std::fs::read_to_string(path).ok()?.split(' ').next()?.parse().ok()
}

fn measure_systems(app: &mut App) {
    app.init_resource::<OurSystems>().add_systems(
        PostUpdate,
        (
            start_watch.after(TransformSystems::Propagate).before(CrackSystems::Hit),
            stop_watch.after(CrackSystems::Upload).before(bevy::asset::AssetEventSystems),
        ),
    );
}

/// The same for the systems that make and move shards.
fn measure_shards(app: &mut App) {
    app.init_resource::<OurSystems>().add_systems(
        PostUpdate,
        (
            start_watch.before(CrackSystems::Shatter),
            stop_watch.after(CrackSystems::Shatter).before(TransformSystems::Propagate),
        ),
    );
}

/// The engine without a window: with a renderer where there is an adapter.
mod support {
    use bevy::{
        app::{PluginGroup, PluginGroupBuilder},
        prelude::*,
        render::{
            RenderPlugin,
            pipelined_rendering::PipelinedRenderingPlugin,
            renderer::initialize_renderer,
            settings::{RenderCreation, WgpuSettings},
        },
        window::ExitCondition,
    };
    use std::panic;

    pub(super) fn headless() -> PluginGroupBuilder {
        let settings = WgpuSettings::default();
        let hook = panic::take_hook();
        panic::set_hook(Box::new(|_| {}));
        let found = settings.backends.and_then(|backends| {
            panic::catch_unwind(|| bevy::tasks::block_on(initialize_renderer(backends, None, &settings))).ok()
        });
        panic::set_hook(hook);
        if found.is_none() {
            println!("NO GPU ADAPTER: uploads are not part of the numbers");
        }
        let render_creation = match found {
            Some(resources) => RenderCreation::Manual(resources),
            None => WgpuSettings { backends: None, ..default() }.into(),
        };
        DefaultPlugins
            .set(WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() })
            .set(RenderPlugin { render_creation, synchronous_pipeline_compilation: true, ..default() })
            .disable::<bevy::winit::WinitPlugin>()
            .disable::<bevy::log::LogPlugin>()
            .disable::<PipelinedRenderingPlugin>()
    }
}

/// Sprites with pictures of their own, shown for a while so that everything is loaded.
fn with_sprites(app: &mut App, count: usize, side: u32, surfaces: bool) -> Vec<Entity> {
    let entities = (0..count)
        .map(|i| {
            let image = app.world_mut().resource_mut::<Assets<Image>>().add(picture(side));
            let mut entity = app.world_mut().spawn(Sprite::from_image(image));
            if surfaces {
                entity.insert(CrackSurface::new(CrackPreset::CONCRETE).with_seed(i as u64));
            }
            entity.id()
        })
        .collect();
    (0..3).for_each(|_| app.update());
    entities
}

fn time_of(mut work: impl FnMut()) -> Duration {
    let start = Instant::now();
    work();
    start.elapsed()
}

/// CPU time of all threads so far, those of the driver included; zero where the system does not tell.
fn cpu_time() -> Duration {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    let times = tasks.filter_map(|task| nanoseconds(&task.ok()?.path().join("schedstat")));
    Duration::from_nanos(times.sum())
}

/// What each of some frames took, and idle ones of the same app: time, CPU time of all threads, and of the time the main world's systems.
#[derive(Default)]
struct Costs {
    times: Vec<Duration>,
    cpu: Vec<Duration>,
    systems: Vec<Duration>,
    idle_times: Vec<Duration>,
    idle_cpu: Vec<Duration>,
    /// Bytes uploaded in all of them.
    bytes: u64,
}

impl Costs {
    /// Measures idle frames.
    fn idle(app: &mut App) -> Self {
        let mut idle = Self::default();
        idle.measure(app, 2 * FRAMES);
        Self { idle_times: idle.times, idle_cpu: idle.cpu, ..Self::default() }
    }

    /// Measures some frames.
    fn measure(&mut self, app: &mut App, count: u32) {
        for _ in 0..count {
            app.insert_resource(OurSystems::default());
            let cpu = cpu_time();
            self.times.push(time_of(|| app.update()));
            self.cpu.push(cpu_time().saturating_sub(cpu));
            self.systems.push(app.world().resource::<OurSystems>().1);
            self.bytes += app.world().resource::<CrackUploadStats>().bytes;
        }
    }

    /// Mean time of a frame over the median of the idle ones.
    fn time(&self) -> Duration {
        mean(&self.times).saturating_sub(median(&self.idle_times))
    }

    /// The same of the CPU time.
    fn cpu(&self) -> Duration {
        mean(&self.cpu).saturating_sub(median(&self.idle_cpu))
    }

    /// Of several runs, each frame as it was in the run in which it took least, and so the idle ones: others on the machine only ever
    /// lengthen one.
    fn at_best(runs: &[Self]) -> [Duration; 3] {
        let of = |times: fn(&Self) -> &Vec<Duration>| {
            let least = |frame: usize| runs.iter().map(|run| times(run)[frame]).min().unwrap_or_default();
            mean(&(0..times(&runs[0]).len()).map(least).collect::<Vec<Duration>>())
        };
        let [time, cpu] = [of(|run| &run.times), of(|run| &run.cpu)];
        let [idle, idle_cpu] = [of(|run| &run.idle_times), of(|run| &run.idle_cpu)];
        [time.saturating_sub(idle), cpu.saturating_sub(idle_cpu), of(|run| &run.systems)]
    }
}

fn mean(times: &[Duration]) -> Duration {
    times.iter().sum::<Duration>() / times.len() as u32
}

fn median(times: &[Duration]) -> Duration {
    let mut times = times.to_vec();
    times.sort();
    times[times.len() / 2]
}

/// Growing surfaces, all of them hit, and what idle frames took before.
fn growing(budget: CrackBudget) -> (App, Costs) {
    let mut app = app();
    app.insert_resource(budget);
    measure_systems(&mut app);
    let entities = with_sprites(&mut app, SURFACES, SIDE, true);
    let idle = Costs::idle(&mut app);
    for entity in entities {
        app.world_mut().trigger(CrackHit::uv(entity, Vec2::splat(0.5)));
    }
    (app, idle)
}

/// Frames in which all surfaces grow.
fn growing_frames() -> Costs {
    let (mut app, mut costs) = growing(CrackBudget { milliseconds: 1e6, max_texture_bytes: 1 << 34, ..default() });
    app.update();
    app.update();
    costs.measure(&mut app, FRAMES);
    costs
}

/// The main world's systems in each frame from the hits to the last crack, under the default budget, and in how many of them a surface
/// shows more than before, on average.
fn budgeted_frames(run: Run) -> (Frames, f64) {
    let (mut app, _) = growing(CrackBudget { max_texture_bytes: 1 << 34, ..default() });
    run.arrange(&mut app);
    let (mut systems, mut changes) = (Vec::new(), 0);
    loop {
        let mut frame = Costs::default();
        let nodes = |app: &mut App| -> Vec<(Entity, u32)> {
            let mut states = app.world_mut().query::<(Entity, &CrackState)>();
            let mut nodes: Vec<_> = states.iter(app.world()).map(|(entity, state)| (entity, state.nodes)).collect();
            nodes.sort_unstable();
            nodes
        };
        let before = nodes(&mut app);
        frame.measure(&mut app, 1);
        changes += nodes(&mut app).iter().zip(&before).filter(|(now, before)| now != before).count();
        // The tasks beside the frames have the time that they have in a game.
        std::thread::sleep((Duration::from_secs(1) / 60).saturating_sub(frame.times[0]));
        let OurSystems(_, time, cpu) = *app.world().resource::<OurSystems>();
        systems.push([time, cpu]);
        let mut states = app.world_mut().query::<&CrackState>();
        let is_done = states.iter(app.world()).all(|state| state.status == CrackStatus::Done);
        if is_done && states.iter(app.world()).count() == SURFACES {
            return (systems, changes as f64 / SURFACES as f64);
        }
    }
}

/// A first hit on a sprite of this size with a picture of its own, 60 frames a second, under the default budget: how much longer than an
/// idle frame the longest one is, what the systems take of theirs, and after how many frames a crack shows.
fn first_hit(side: u32) {
    let (mut longest, mut systems, mut frames) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..5 {
        let mut app = app();
        measure_systems(&mut app);
        app.insert_resource(CrackBudget { max_texture_bytes: 1 << 34, ..default() });
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(picture(side));
        let surface = CrackSurface::new(CrackPreset::CONCRETE).with_seed(seed);
        let entity = app.world_mut().spawn((Sprite::from_image(image), surface)).id();
        let pace = |app: &mut App, costs: &mut Costs| {
            costs.measure(app, 1);
            let frame = costs.times.last().copied().unwrap_or_default();
            std::thread::sleep((Duration::from_secs(1) / 60).saturating_sub(frame));
        };
        let (mut idle, mut hit) = (Costs::default(), Costs::default());
        (0..20).for_each(|_| pace(&mut app, &mut idle));
        app.world_mut().trigger(CrackHit::uv(entity, Vec2::splat(0.5)));
        let shows = |app: &App| app.world().get::<CrackState>(entity).is_some_and(|state| state.nodes > 0);
        while !shows(&app) {
            pace(&mut app, &mut hit);
        }
        frames.push(hit.times.len());
        longest.extend(hit.times.iter().max().map(|time| time.saturating_sub(median(&idle.times))));
        systems.extend(hit.systems.iter().max().copied());
    }
    frames.sort_unstable();
    println!(
        "a first hit, {side} x {side}: the longest frame over an idle one {}; the systems {}; a crack shows in frame {} to {}",
        least_and_median(longest),
        least_and_median(systems),
        frames[0],
        frames[frames.len() - 1]
    );
}

/// First hits on surfaces that show the same picture, all sent at once, under the default budget: how many frames they take, and the
/// systems for each.
fn first_hits(resolution: CrackResolution, name: &str) {
    let mut app = app();
    measure_systems(&mut app);
    app.insert_resource(CrackBudget { max_texture_bytes: 1 << 34, ..default() });
    let image = app.world_mut().resource_mut::<Assets<Image>>().add(picture(SIDE));
    let surfaces: Vec<Entity> = (0..FIRST_HITS)
        .map(|seed| {
            let surface = CrackSurface::new(CrackPreset::CONCRETE).with_seed(seed);
            let sprite = Sprite::from_image(image.clone());
            app.world_mut().spawn((sprite, CrackSurface { resolution, ..surface })).id()
        })
        .collect();
    (0..3).for_each(|_| app.update());
    for surface in surfaces {
        app.world_mut().trigger(CrackHit::uv(surface, Vec2::splat(0.5)));
    }
    let mut costs = Costs::default();
    while costs.times.is_empty() || app.world().resource::<CrackStats>().queued > 0 {
        costs.measure(&mut app, 1);
    }
    let each = costs.systems.iter().sum::<Duration>().as_secs_f64() * 1e3 / FIRST_HITS as f64;
    println!("{FIRST_HITS} first hits, textures {name}: {} frames, {each:.3} ms each", costs.times.len());
}

#[derive(Resource, Default)]
struct Naive(Vec<(CrackGrowth, DepthField, Vec<u8>, Handle<Image>, Handle<Image>)>);

/// The obvious way: grow, stamp, paint the whole image, let the engine upload the whole image.
fn paint_whole(mut naive: ResMut<Naive>, mut images: ResMut<Assets<Image>>, look: Local<Option<LookTable>>) {
    let mut look = look;
    let preset = CrackPreset::CONCRETE;
    let look = look.get_or_insert_with(|| LookTable::new(&preset.look, SIDE as f32).expect("the preset is valid"));
    for (growth, field, base, diffuse, normal) in &mut naive.0 {
        growth.step();
        let mut changed = Vec::new();
        growth.take_changed(&mut changed);
        for segment in changed {
            if let Some(path) = growth.network().path(segment) {
                stamp_path(field, &preset.profile, &path);
            }
        }
        let mut take = |handle: &Handle<Image>| images.get_mut(handle).and_then(|image| image.into_inner().data.take());
        let (mut diffuse_data, mut normal_data) = (take(diffuse), take(normal));
        paint_into(
            BaseTexels { size: UVec2::splat(SIDE), diffuse: base, normal: None, depth: None },
            field,
            look,
            TexelRect::whole(UVec2::splat(SIDE)),
            UVec2::ZERO,
            &mut PaintTargets { diffuse: diffuse_data.as_deref_mut(), normal: normal_data.as_deref_mut(), depth: None },
        );
        for (handle, data) in [(diffuse, diffuse_data), (normal, normal_data)] {
            if let Some(mut image) = images.get_mut(&*handle) {
                image.data = data;
            }
        }
    }
}

/// The same in the obvious way.
fn naive_frames() -> Costs {
    let mut app = app();
    app.init_resource::<OurSystems>();
    let frame = SurfaceFrame::new(UVec2::splat(SIDE)).expect("the size is valid");
    let preset = CrackPreset::CONCRETE;
    let mut naive = Naive::default();
    for seed in 0..SURFACES as u64 {
        let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), seed).expect("the preset is valid");
        growth.hit(Vec2::splat(0.5), 1.0);
        let mut images = app.world_mut().resource_mut::<Assets<Image>>();
        let (diffuse, mut normal) = (picture(SIDE), picture(SIDE));
        normal.texture_descriptor.format = TextureFormat::Rgba8Unorm;
        let base = diffuse.data.clone().expect("the picture has texels");
        let (diffuse, normal) = (images.add(diffuse), images.add(normal));
        app.world_mut().spawn(Sprite::from_image(diffuse.clone()));
        naive.0.push((growth, DepthField::new(frame), base, diffuse, normal));
    }
    (0..3).for_each(|_| app.update());
    let mut costs = Costs::idle(&mut app);
    app.insert_resource(naive).add_systems(Update, paint_whole);
    app.update();
    costs.measure(&mut app, FRAMES);
    costs
}

/// The rectangles that a growing frame paints, of each surface and frame.
fn growing_rects() -> Vec<Vec<Vec<TexelRect>>> {
    let size = UVec2::splat(SIDE);
    let frame = SurfaceFrame::new(size).expect("the size is valid");
    let preset = CrackPreset::CONCRETE;
    let rects_of = |seed: usize| {
        let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), seed as u64).expect("it is valid");
        growth.hit(Vec2::splat(0.5), 1.0);
        let (mut field, mut dirty) = (DepthField::new(frame), DirtyTiles::new(size));
        let (mut changed, mut frames) = (Vec::new(), Vec::new());
        let look = LookTable::new(&preset.look, frame.texels_per_unit()).expect("it is valid");
        for _ in 0..FRAMES + 2 {
            growth.step();
            growth.take_changed(&mut changed);
            let mut rects = Vec::new();
            for path in changed.drain(..).filter_map(|segment| growth.network().path(segment)) {
                stamp_path_with(&mut field, &preset.profile, &path, &mut |rect| rects.push(rect));
            }
            rects.drain(..).for_each(|rect| dirty.mark(look.affected(rect, &field.depth)));
            dirty.take_rects(&mut rects);
            frames.push(rects);
        }
        frames.split_off(2)
    };
    (0..SURFACES).map(rects_of).collect()
}

/// What no program can do without: the same texels copied from a picture to two others, at the same places, a frame; then two
/// textures a surface filled from a buffer that is ready, at the same places.
fn floors() {
    let rects = growing_rects();
    let n = (SIDE * SIDE * 4) as usize;
    let mut pictures: Vec<[Vec<u8>; 3]> = (0..SURFACES).map(|i| [1u8, 2, 3].map(|k| vec![k + i as u8; n])).collect();
    let copy = time_of(|| {
        for frame in 0..FRAMES as usize {
            for ([from, diffuse, normal], rects) in pictures.iter_mut().zip(&rects) {
                for rect in &rects[frame] {
                    for y in rect.min.y..rect.max.y {
                        let row = ((y * SIDE + rect.min.x) * 4) as usize..((y * SIDE + rect.max.x) * 4) as usize;
                        diffuse[row.clone()].copy_from_slice(&from[row.clone()]);
                        normal[row.clone()].copy_from_slice(&from[row]);
                    }
                }
            }
        }
    });
    println!("only to copy its texels: {:.2} ms a frame", (copy / FRAMES).as_secs_f64() * 1e3);

    let app = app();
    let (Some(device), Some(queue)) =
        (app.world().get_resource::<RenderDevice>(), app.world().get_resource::<RenderQueue>())
    else {
        return;
    };
    let image = picture(SIDE);
    let textures: Vec<_> = (0..2 * SURFACES).map(|_| device.create_texture(&image.texture_descriptor)).collect();
    let buffer = device.create_buffer(&BufferDescriptor {
        label: None,
        size: 8 << 20,
        usage: BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let ready = vec![7; 2 << 20];
    let mut n_copies = 0;
    let mut frame = |frame: usize| {
        queue.write_buffer(&buffer, 0, &ready);
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        for (pair, rects) in textures.chunks(2).zip(&rects) {
            for (rect, texture) in rects[frame].iter().flat_map(|rect| pair.iter().map(move |texture| (rect, texture)))
            {
                let size = rect.size();
                let layout = TexelCopyBufferLayout { bytes_per_row: Some(4 * SIDE), ..default() };
                let origin = Origin3d { x: rect.min.x, y: rect.min.y, z: 0 };
                encoder.copy_buffer_to_texture(
                    TexelCopyBufferInfo { buffer: &buffer, layout },
                    TexelCopyTextureInfo { texture, mip_level: 0, origin, aspect: TextureAspect::All },
                    Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
                );
                n_copies += 1;
            }
        }
        queue.submit([encoder.finish()]);
        device.poll(PollType::wait_indefinitely()).expect("the device waits");
    };
    (0..FRAMES as usize).for_each(&mut frame);
    let time = time_of(|| (0..FRAMES as usize).for_each(&mut frame)) / FRAMES;
    let per_frame = n_copies / 2 / FRAMES;
    println!("only {per_frame} copies to textures: {:.2} ms a frame", time.as_secs_f64() * 1e3);
}

/// A frame with many sprites, cracked to their end or not surfaces at all.
fn many(cracked: bool) -> App {
    let mut app = app();
    let entities = with_sprites(&mut app, 10_000, 32, cracked);
    if cracked {
        for entity in entities {
            app.world_mut().trigger(CrackHit::uv(entity, Vec2::splat(0.5)).with_energy(0.2));
        }
        for _ in 0..1000 {
            app.update();
        }
        let done = |state: &CrackState| state.status == CrackStatus::Done;
        let mut states = app.world_mut().query::<&CrackState>();
        assert!(states.iter(app.world()).all(done), "all cracks have come to an end");
    }
    app
}

/// How the systems of a frame run.
#[derive(Clone, Copy, PartialEq)]
enum Run {
    /// One after the other, so that work is measured, and not what they wait for threads that tasks keep busy.
    InARow,
    /// As the engine has them.
    OnThreads,
}

impl Run {
    fn arrange(self, app: &mut App) {
        if self == Self::InARow {
            app.edit_schedule(PostUpdate, |schedule| _ = schedule.set_executor(SingleThreadedExecutor::new()));
        }
    }
}

/// Time and CPU time of the crate's systems in each frame.
type Frames = Vec<[Duration; 2]>;

/// The frames of some bakes, each on a new surface; apart, those in which its cracks appear, and how many times are shown.
fn baking_frames(side: u32, appearance: GuidedAppearance, run: Run) -> ([Frames; 2], usize) {
    let mut app = app();
    measure_systems(&mut app);
    run.arrange(&mut app);
    app.insert_resource(CrackBudget { max_texture_bytes: 1 << 34, ..default() });
    let cross = |at: UVec2| f32::from(u8::from((24..40).contains(&at.x) || (24..40).contains(&at.y)));
    let texels = (0..64 * 64).map(|i| cross(UVec2::new(i % 64, i / 64))).collect();
    let guide = Grid::from_vec(UVec2::splat(64), texels).expect("the size fits");
    let [mut baking, mut appearing] = [Vec::new(), Vec::new()];
    let (mut times_shown, mut shown) = (0, 0.0);
    for seed in 0..BAKES as u64 {
        let entity = with_sprites(&mut app, 1, side, false)[0];
        let guided = GuidedCracks { max_side: side, appearance, ..GuidedCracks::new(CrackGuide::new(guide.clone())) };
        app.world_mut().entity_mut(entity).insert((CrackSurface::new(CrackPreset::CONCRETE), guided.with_seed(seed)));
        let mut after = 0;
        while after < 10 {
            app.insert_resource(OurSystems::default());
            let is_baked = app.world().get::<BakeProgress>(entity) == Some(&BakeProgress(1.0));
            let frame = time_of(|| app.update());
            let times = if is_baked && after == 0 { &mut appearing } else { &mut baking };
            let OurSystems(_, time, cpu) = app.world().resource();
            times.push([*time, *cpu]);
            let state = app.world().get::<CrackState>(entity);
            let now = state.map_or(0.0, |state| state.time);
            times_shown += usize::from(core::mem::replace(&mut shown, now) != now);
            after += u32::from(state.is_some_and(|state| state.status == CrackStatus::Done));
            std::thread::sleep((Duration::from_secs(1) / 60).saturating_sub(frame));
        }
        app.world_mut().despawn(entity);
        (0..3).for_each(|_| app.update());
    }
    ([baking, appearing], times_shown / BAKES)
}

fn baking(side: u32) {
    for (name, run) in [("in a row", Run::InARow), ("on threads", Run::OnThreads)] {
        let frames = baking_frames(side, GuidedAppearance::AtOnce, run).0.concat();
        println!("baking {side} x {side}, systems {name}: {}", percentiles(&frames, run));
    }
    let front = GuidedAppearance::Front { from: Vec2::splat(0.5), seconds: 1.0 };
    for (name, appearance) in [("front", front), ("widen", GuidedAppearance::Widen { seconds: 1.0 })] {
        let ([_, frames], shown) = baking_frames(side, appearance, Run::InARow);
        println!(
            "{name} {side} x {side}, systems in a row: {}; {shown} times are shown",
            percentiles(&frames, Run::InARow)
        );
    }
}

fn percentiles(frames: &Frames, run: Run) -> String {
    let of = |which: usize| {
        let mut times: Vec<Duration> = frames.iter().map(|times| times[which]).collect();
        times.sort();
        let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize].as_secs_f64() * 1e3;
        format!("p50 {:.3} ms, p99 {:.3} ms, max {:.3} ms", at(0.5), at(0.99), at(1.0))
    };
    match run {
        Run::InARow => format!("{} frames, {}; CPU time {}", frames.len(), of(0), of(1)),
        // Not all on the thread that looks.
        Run::OnThreads => format!("{} frames, {}", frames.len(), of(0)),
    }
}

/// Panes that are cracked all over, and become at most 500 shards each.
fn panes(count: usize, run: Run) -> (App, Vec<Entity>) {
    let mut app = app();
    measure_shards(&mut app);
    run.arrange(&mut app);
    app.world_mut().resource_mut::<CrackBudget>().max_shards = 10_000;
    let panes: Vec<Entity> = (0..count as u64)
        .map(|seed| {
            let image = app.world_mut().resource_mut::<Assets<Image>>().add(picture(256));
            let settings = ShatterCracks {
                cut: ShatterParams { extend_cracks: true, max_shards: 500, ..ShatterParams::DEFAULT },
                anchor: Anchor::Nothing,
                speed: 0.0,
                ..default()
            };
            let surface = CrackSurface::new(CrackPreset::GLASS).with_seed(seed);
            app.world_mut().spawn((Sprite::from_image(image), surface, settings)).id()
        })
        .collect();
    for i in 0..64 {
        let at = Vec2::new(0.06 + 0.125 * (i % 8) as f32, 0.07 + 0.123 * (i / 8) as f32);
        for pane in &panes {
            app.world_mut().trigger(CrackHit::uv(*pane, at).with_energy(2.0));
        }
    }
    for _ in 0..400 {
        app.update();
    }
    (app, panes)
}

fn set(app: &mut App, pane: Entity, change: impl FnOnce(&mut ShatterCracks)) {
    change(&mut app.world_mut().get_mut::<ShatterCracks>(pane).expect("the settings"));
}

/// Time of the systems in some frames, 60 a second.
fn systems_of(app: &mut App, frames: usize) -> Duration {
    app.insert_resource(OurSystems::default());
    for _ in 0..frames {
        let frame = time_of(|| app.update());
        std::thread::sleep((Duration::from_secs(1) / 60).saturating_sub(frame));
    }
    app.world().resource::<OurSystems>().1
}

/// The least and the median time of some, in milliseconds: a busy machine pauses a run, it never speeds one up.
fn least_and_median(mut times: Vec<Duration>) -> String {
    times.sort();
    format!(
        "{:.2} ms at best, median {:.2} ms",
        times[0].as_secs_f64() * 1e3,
        times[times.len() / 2].as_secs_f64() * 1e3
    )
}

fn shards(c: &mut Criterion) {
    let first_time = |run: Run, name: &str| {
        let (mut app, panes) = panes(10, run);
        let idle = (0..20).map(|_| systems_of(&mut app, 3)).collect();
        println!("idle, systems {name}, three frames: {}", least_and_median(idle));
        let burst = |pane: &Entity| {
            app.world_mut().commands().entity(*pane).shatter_cracks(ShatterRequest::ALL);
            // Those in which it is asked for, made, and there.
            systems_of(&mut app, 3)
        };
        let times = panes.iter().map(burst).collect();
        println!("500 shards for the first time, systems {name}, three frames: {}", least_and_median(times));
        (app, panes)
    };
    drop(first_time(Run::InARow, "in a row"));
    let (mut app, panes) = first_time(Run::OnThreads, "on threads");
    let shown = app.world_mut().query::<&Shard>().iter(app.world()).count();
    println!("{shown} shards in all");
    let mut again = Vec::new();
    for pane in panes.iter().cycle().take(100) {
        set(&mut app, *pane, |pane| pane.seek = Some(1000.0));
        app.update();
        set(&mut app, *pane, |pane| pane.seek = Some(0.0));
        again.push(systems_of(&mut app, 1));
    }
    println!("500 shards with bodies that are there: {}", least_and_median(again));
    let still = (0..40).map(|_| time_of(|| app.update())).collect();
    println!("a frame in which they stand still: {}", least_and_median(still));
    let mut frame = 0;
    // To and fro, so that none fades.
    let mut fly = |app: &mut App| {
        frame += 1;
        let speed = if frame % 60 < 30 { 1.0 } else { -0.9 };
        for pane in &panes {
            set(app, *pane, |pane| pane.speed = speed);
        }
    };
    let moved = (0..80).map(|_| {
        fly(&mut app);
        systems_of(&mut app, 1)
    });
    println!("5,000 fly, the systems: {}", least_and_median(moved.collect()));
    let mut group = c.benchmark_group("shards");
    group.sample_size(20);
    group.bench_function("5,000 fly, the frame", |b| {
        b.iter(|| {
            fly(&mut app);
            app.update();
        });
    });
    group.finish();
}

fn frame(c: &mut Criterion) {
    [1024, 2048].into_iter().for_each(baking);
    floors();
    // In turns, so that both have the same machine.
    let (ours, naive): (Vec<Costs>, Vec<Costs>) = (0..RUNS).map(|_| (growing_frames(), naive_frames())).unzip();
    for (name, runs) in [("ours", &ours), ("whole images", &naive)] {
        let [time, cpu, systems] = Costs::at_best(runs).map(|time| time.as_secs_f64() * 1e3);
        println!("{name}, each frame at its best: {time:.2} ms, the systems {systems:.2} ms, CPU time {cpu:.2} ms");
        println!("{name}, a frame: {}", least_and_median(runs.iter().map(Costs::time).collect()));
        println!(
            "{name}, CPU time of all threads a frame: {}",
            least_and_median(runs.iter().map(Costs::cpu).collect())
        );
    }
    let bytes = ours[0].bytes / u64::from(FRAMES);
    let whole = SURFACES as u64 * u64::from(SIDE * SIDE) * 8;
    if let Some(times) = whole.checked_div(bytes) {
        println!("bytes a frame: {bytes}, whole images: {whole}, {times} times fewer");
    }
    for (name, run) in [("in a row", Run::InARow), ("on threads", Run::OnThreads)] {
        let (frames, changes) = budgeted_frames(run);
        let budgeted = percentiles(&frames, run);
        println!("growing under the default budget, systems {name}: {budgeted}; each surface changes in {changes:.1}");
    }
    [256, 512, 1024, 2048].into_iter().for_each(first_hit);
    for _ in 0..3 {
        first_hits(CrackResolution::Fixed(UVec2::splat(128)), "of 128 x 128");
        first_hits(CrackResolution::Picture, "of 512 x 512");
    }
    let mut group = c.benchmark_group("growing");
    group.sample_size(10);
    group.bench_function("100 surfaces", |b| {
        b.iter_custom(|n| (0..n).map(|_| growing_frames().time()).sum());
    });
    group.bench_function("100 surfaces, main world", |b| {
        b.iter_custom(|n| (0..n).map(|_| mean(&growing_frames().systems)).sum());
    });
    group.bench_function("100 whole images", |b| {
        b.iter_custom(|n| (0..n).map(|_| naive_frames().time()).sum());
    });
    group.finish();
    finished();
}

/// A frame of a sixtieth of a second, whose systems are measured.
fn step(app: &mut App, frames: &mut Frames) {
    app.insert_resource(OurSystems::default());
    let frame = time_of(|| app.update());
    let OurSystems(_, time, cpu) = app.world().resource();
    frames.push([*time, *cpu]);
    std::thread::sleep((Duration::from_secs(1) / 60).saturating_sub(frame));
}

/// What a frame takes while three hits grow, with and without an analogy, 60 frames a second under the default budget.
fn analogies(_: &mut Criterion) {
    let texel = |i: u32| {
        let is_crack = (i % 256).abs_diff(100) < 3 || (i / 256).abs_diff(60) < 4;
        if is_crack { [60, 50, 40, 255] } else { [150 + (i * 7 % 23) as u8, 148, 140, 255] }
    };
    let photo: Vec<u8> = (0..256 * 256).flat_map(texel).collect();
    let pair = AnalogyPair::from_darkness(UVec2::splat(256), &photo, 0.3).expect("it has cracks");
    let examples = AnalogyExamples::new(vec![pair], &AnalogyParams::DEFAULT).expect("they are valid");
    for side in [512, 1024, 2048] {
        for (name, has_analogy) in [("without an analogy", false), ("with an analogy", true)] {
            let mut app = app();
            measure_systems(&mut app);
            Run::InARow.arrange(&mut app);
            app.insert_resource(CrackBudget { max_texture_bytes: 1 << 34, ..default() });
            let wall = with_sprites(&mut app, 1, side, false)[0];
            let examples = app.world_mut().resource_mut::<Assets<AnalogyExamples>>().add(examples.clone());
            let mut entity = app.world_mut().entity_mut(wall);
            entity.insert(CrackSurface::new(CrackPreset::CONCRETE));
            if has_analogy {
                entity.insert(CrackAnalogy::new(examples));
            }
            let mut making = Vec::new();
            while has_analogy && app.world().get::<AnalogyProgress>(wall) != Some(&AnalogyProgress(1.0)) {
                step(&mut app, &mut making);
            }
            let mut growing = Vec::new();
            for i in 0..3 {
                let at = Vec2::new(0.3 + 0.2 * i as f32, 0.6 - 0.15 * i as f32);
                app.world_mut().trigger(CrackHit::uv(wall, at).with_energy(2.0));
                (0..60).for_each(|_| step(&mut app, &mut growing));
            }
            println!("growing {side} x {side} {name}, systems: {}", percentiles(&growing, Run::InARow));
            if has_analogy {
                println!("its first picture: {}", percentiles(&making, Run::InARow));
            }
        }
    }
}

/// A level of 10,000 tiles of 16 x 16 texels that is one group, at rest, made ready for its first hit, and hit 100 times a second.
fn groups(_: &mut Criterion) {
    for (name, is_group) in [("10,000 tiles in a group", true), ("10,000 plain tiles", false)] {
        let mut app = app();
        measure_systems(&mut app);
        Run::InARow.arrange(&mut app);
        app.insert_resource(CrackBudget::default());
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(picture(16));
        let surface = CrackSurface::new(CrackPreset::CONCRETE.scaled(0.1));
        let group = app.world_mut().spawn(surface).id();
        for i in 0..10_000 {
            let place = Transform::from_xyz(16.0 * (i % 100) as f32, 16.0 * (i / 100) as f32, 0.0);
            let mut tile = app.world_mut().spawn((Sprite::from_image(image.clone()), place));
            if is_group {
                tile.insert(CrackMemberOf(group));
            }
        }
        let [mut idle, mut first, mut hits] = [Frames::new(), Frames::new(), Frames::new()];
        (0..10).for_each(|_| step(&mut app, &mut Vec::new()));
        (0..100).for_each(|_| step(&mut app, &mut idle));
        println!("{name}, idle, systems: {}", percentiles(&idle, Run::InARow));
        if !is_group {
            continue;
        }
        let mut rng = Rng::new(5);
        let mut hit = |app: &mut App| {
            let at = Vec3::new(rng.range(0.0, 1580.0), rng.range(0.0, 1580.0), 0.0);
            app.world_mut().trigger(CrackHit::world(group, at).with_energy(0.5));
        };
        hit(&mut app);
        while app.world().get::<CrackState>(group).is_none_or(|state| state.hits == 0) {
            step(&mut app, &mut first);
        }
        println!("{name}, until the first hit, systems: {}", percentiles(&first, Run::InARow));
        for i in 0..600 {
            (0..if i % 3 == 0 { 1 } else { 2 }).for_each(|_| hit(&mut app));
            step(&mut app, &mut hits);
        }
        println!("{name}, 100 hits a second, systems: {}", percentiles(&hits, Run::InARow));
    }
}

/// A ball of 20,000 triangles, which is laid out, beside a flat wall: until its first hit has landed, while three hits grow, and while it falls to
/// pieces.
fn bodies(_: &mut Criterion) {
    let ball = Sphere::new(0.7).mesh().uv(120, 85);
    for (name, mesh) in [("a ball of 20,000 triangles", ball), ("a flat wall", Rectangle::new(1.0, 1.0).into())] {
        let mut app = app();
        measure_systems(&mut app);
        Run::InARow.arrange(&mut app);
        app.insert_resource(CrackBudget::default());
        let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
        let material = app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial::default());
        let surface = CrackSurface::new(CrackPreset::CONCRETE).with_unwrap(CrackUnwrap::Always);
        let body = app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material), surface)).id();
        (0..10).for_each(|_| step(&mut app, &mut Vec::new()));
        let [mut first, mut growing, mut falling] = [Frames::new(), Frames::new(), Frames::new()];
        for i in 0..3 {
            let at = Vec3::new(0.2 * i as f32 - 0.2, 0.1, 0.7);
            app.world_mut().trigger(CrackHit::local(body, at).with_energy(2.0));
            while app.world().get::<CrackState>(body).is_none_or(|state| state.hits <= i) {
                step(&mut app, if i == 0 { &mut first } else { &mut growing });
            }
            (0..60).for_each(|_| step(&mut app, &mut growing));
        }
        println!("{name}, until the first hit, systems: {}", percentiles(&first, Run::InARow));
        println!("{name}, growing, systems: {}", percentiles(&growing, Run::InARow));
        app.world_mut().commands().entity(body).shatter_cracks(ShatterRequest::EVERYTHING);
        (0..60).for_each(|_| step(&mut app, &mut falling));
        let pieces = app.world_mut().query::<&Shard>().iter(app.world()).count();
        println!("{name}, into {pieces} pieces, systems: {}", percentiles(&falling, Run::InARow));
    }
}

/// Frames with cracked surfaces, which are at rest, in turns with frames of plain sprites.
fn finished() {
    let mut apps = [many(true), many(false)];
    apps.iter_mut().for_each(measure_systems);
    let mut costs = [Costs::default(), Costs::default()];
    for _ in 0..200 {
        for (app, costs) in apps.iter_mut().zip(&mut costs) {
            // The other's frame has emptied the caches.
            app.update();
            costs.measure(app, 2);
        }
    }
    for (name, Costs { times, systems, .. }) in ["10,000 cracked surfaces", "10,000 plain sprites"].iter().zip(costs) {
        println!("{name}, a frame: {}; the systems {}", least_and_median(times), least_and_median(systems));
    }
}

criterion_group!(benches, analogies, shards, frame, groups, bodies);
criterion_main!(benches);
