//! Apps, pictures and questions that several modules share.

use bevy::{
    asset::RenderAssetUsages,
    camera::{CameraPlugin, RenderTarget},
    core_pipeline::CorePipelinePlugin,
    ecs::schedule::SingleThreadedExecutor,
    image::{CompressedImageFormats, ImageLoader, ImageSampler, TextureAtlasLayout},
    log::{
        tracing::{self, Subscriber, field},
        tracing_subscriber::{self, layer::SubscriberExt},
    },
    mesh::MeshPlugin,
    prelude::*,
    render::{
        RenderPlugin,
        gpu_readback::{Readback, ReadbackComplete},
        render_resource::{Extent3d, TextureDimension, TextureFormat},
        renderer::initialize_renderer,
        settings::{RenderCreation, RenderResources, WgpuSettings},
        view::screenshot::{Screenshot, ScreenshotCaptured},
    },
    sprite_render::SpriteRenderPlugin,
    time::TimeUpdateStrategy,
    window::ExitCondition,
};
use bevy_crack::prelude::*;
use std::{
    collections::HashMap,
    io::Write,
    panic,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

/// Length of a frame.
pub(crate) const FRAME: Duration = Duration::from_millis(20);

/// Assets and time, but no renderer. 20 ms a frame, and time enough for everything.
pub(crate) fn app() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default(), ImagePlugin::default(), CrackPlugins))
        // The renderer does this; without a loader, pictures would load for ever.
        .register_asset_loader(ImageLoader::new(CompressedImageFormats::NONE));
    start(&mut app);
    app
}

/// What a test needs besides plugins, and the first frame, in which no time passes.
pub(crate) fn start(app: &mut App) {
    app.init_asset::<TextureAtlasLayout>()
        .init_asset::<Mesh>()
        .init_asset::<ColorMaterial>()
        .init_asset::<StandardMaterial>();
    finish(app);
    app.update();
}

/// What a runner does before the first frame.
pub(crate) fn finish(app: &mut App) {
    app.insert_resource(TimeUpdateStrategy::ManualDuration(FRAME))
        .insert_resource(CrackBudget { milliseconds: 1e6, ..default() });
    while app.plugins_state() == bevy::app::PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
}

/// The renderer, if there is an adapter: asking for one that is not there panics inside Bevy.
fn renderer() -> Option<RenderResources> {
    let settings = WgpuSettings::default();
    let backends = settings.backends?;
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|_| {}));
    let resources = panic::catch_unwind(|| bevy::tasks::block_on(initialize_renderer(backends, None, &settings)));
    panic::set_hook(hook);
    resources.ok()
}

/// The renderer for one test at a time. `None`, said aloud, where there is no adapter.
pub(crate) fn gpu() -> Option<(MutexGuard<'static, ()>, RenderResources)> {
    static ONE: Mutex<()> = Mutex::new(());
    let guard = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(renderer) = renderer() else {
        assert!(
            std::env::var_os("CRACK_REQUIRE_ALL").is_none_or(|v| v != "1"),
            "no GPU adapter, and all tests must run"
        );
        let test = std::thread::current().name().unwrap_or("a test").to_owned();
        // Not by `eprintln`, which the test runner keeps to itself.
        writeln!(std::io::stderr(), "PASSED OVER: {test}: no GPU adapter (install Mesa's software Vulkan)").unwrap();
        return None;
    };
    Some((guard, renderer))
}

/// An app that renders without a window; one at a time. `None`, said aloud, where there is no adapter.
pub(crate) fn gpu_app() -> Option<(MutexGuard<'static, ()>, App)> {
    let (guard, renderer) = gpu()?;
    let mut app = App::new();
    app.add_plugins((render_plugins(RenderCreation::Manual(renderer)), CrackPlugins));
    start(&mut app);
    Some((guard, app))
}

/// All that it takes to draw sprites into images. Not `SpritePlugin`: with the feature for picking, which other crates of a
/// build may ask for, it wants the plugins for picking.
pub(crate) fn render_plugins(render_creation: RenderCreation) -> impl PluginGroup {
    bevy::app::PluginGroupBuilder::start::<MinimalPlugins>()
        .add_group(MinimalPlugins)
        .add(TransformPlugin)
        .add(WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() })
        .add(AssetPlugin::default())
        .add(RenderPlugin { render_creation, synchronous_pipeline_compilation: true, ..default() })
        .add(ImagePlugin::default_nearest())
        .add(MeshPlugin)
        .add(CameraPlugin)
        .add(CorePipelinePlugin)
        .add(SpriteRenderPlugin)
}

/// A picture of this format whose texels differ from their neighbours, alpha 255.
pub(crate) fn picture_of(size: UVec2, format: TextureFormat) -> Image {
    let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
    let texel = format.block_copy_size(None).unwrap_or(4) as usize;
    let n = size.x as usize * size.y as usize * texel;
    let data = (0..n).map(|i| if i % 4 == 3 { 255 } else { 150 + (i * 7 % 60) as u8 }).collect();
    let mut image = Image::new_uninit(extent, TextureDimension::D2, format, RenderAssetUsages::default());
    image.data = Some(data);
    image.sampler = ImageSampler::nearest();
    image
}

pub(crate) fn picture(size: UVec2) -> Image {
    picture_of(size, TextureFormat::Rgba8UnormSrgb)
}

/// A picture of one colour.
pub(crate) fn solid(size: UVec2, texel: [u8; 4]) -> Image {
    let mut image = picture(size);
    image.data = Some(texel.repeat(size.element_product() as usize));
    image
}

pub(crate) fn add<A: Asset>(app: &mut App, asset: A) -> Handle<A> {
    app.world_mut().resource_mut::<Assets<A>>().add(asset)
}

/// A sprite of concrete that shows `image`.
pub(crate) fn spawn_sprite(app: &mut App, image: &Handle<Image>) -> Entity {
    app.world_mut().spawn((Sprite::from_image(image.clone()), CrackSurface::default())).id()
}

/// A sprite of concrete that shows a new picture.
pub(crate) fn spawn_picture(app: &mut App, size: UVec2) -> Entity {
    let image = add(app, picture(size));
    spawn_sprite(app, &image)
}

/// A preset that is done after a few steps.
pub(crate) fn small_preset() -> CrackPreset {
    let mut preset = CrackPreset::CONCRETE;
    preset.growth.num_lines_grid = 3;
    preset.growth.num_columns_grid = 3;
    preset.growth.step_length = 0.05;
    preset.growth.reach = 0.3;
    preset
}

/// A hit in the middle.
pub(crate) fn center(entity: Entity) -> CrackHit {
    CrackHit::uv(entity, Vec2::splat(0.5))
}

pub(crate) fn hit(app: &mut App, hit: CrackHit) {
    app.world_mut().trigger(hit);
}

pub(crate) fn get<C: Component + Clone>(app: &App, entity: Entity) -> C {
    app.world().get::<C>(entity).expect("the component").clone()
}

pub(crate) fn state(app: &App, entity: Entity) -> CrackState {
    get(app, entity)
}

pub(crate) fn image_of(app: &App, entity: Entity) -> Handle<Image> {
    get::<Sprite>(app, entity).image
}

pub(crate) fn texels(app: &App, image: &Handle<Image>) -> Vec<u8> {
    let image = app.world().resource::<Assets<Image>>().get(image).expect("the image");
    image.data.clone().expect("data on the CPU")
}

/// What the sprite shows.
pub(crate) fn shown(app: &App, entity: Entity) -> Vec<u8> {
    texels(app, &image_of(app, entity))
}

/// The counts, which add up.
pub(crate) fn counts(app: &App) -> CrackStats {
    let stats = *app.world().resource::<CrackStats>();
    let sum = stats.applied + stats.merged + stats.ignored + stats.rejected + stats.queued;
    assert_eq!(stats.sent, sum, "every hit is somewhere: {stats:?}");
    stats
}

/// One frame, after which the counts add up.
pub(crate) fn step(app: &mut App) -> CrackStats {
    app.update();
    counts(app)
}

pub(crate) fn steps(app: &mut App, n: usize) {
    for _ in 0..n {
        step(app);
    }
}

/// Frames until `is_done`, for no longer than a minute.
pub(crate) fn wait_for(app: &mut App, what: &str, mut is_done: impl FnMut(&App) -> bool) {
    let start = Instant::now();
    while !is_done(app) {
        assert!(start.elapsed() < Duration::from_secs(60), "waited in vain for {what}");
        step(app);
    }
}

/// Frames until the cracks of `entity` have ended; its textures are sound then.
pub(crate) fn settle(app: &mut App, entity: Entity) {
    step(app);
    wait_for(app, "the end of the cracks", |app| {
        let (state, counts) = (state(app, entity), counts(app));
        let is_lost = state.status == CrackStatus::Untouched && counts.queued == 0;
        assert!(!is_lost && !matches!(state.status, CrackStatus::Failed(_)), "{state:?} {counts:?}");
        state.status == CrackStatus::Done
    });
    assert_sound(app, entity);
}

/// Every texture has as many texels as its size says, and every normal is one.
pub(crate) fn assert_sound(app: &App, entity: Entity) {
    let textures: CrackTextures = get(app, entity);
    for handle in textures.handles() {
        let image = app.world().resource::<Assets<Image>>().get(handle).expect("the texture");
        let texel = image.texture_descriptor.format.block_copy_size(None).expect("a plain format") as usize;
        let size = image.size();
        assert!(size.min_element() > 0, "{size}");
        let levels = (0..image.texture_descriptor.mip_level_count).map(|level| (size >> level).max(UVec2::ONE));
        let all: u32 = levels.map(UVec2::element_product).sum();
        assert_eq!(texels(app, handle).len(), all as usize * texel);
    }
    if let Some(normal) = &textures.normal {
        for texel in texels(app, normal).chunks(4) {
            let normal = Vec3::new(f32::from(texel[0]), f32::from(texel[1]), f32::from(texel[2])) / 127.5 - 1.0;
            assert!((normal.length() - 1.0).abs() < 0.1 && normal.z > 0.0, "no normal: {texel:?}");
        }
    }
    let state = state(app, entity);
    assert!((0.0..=1.0).contains(&state.damage), "{state:?}");
    assert!(state.tips.len() <= CrackState::MAX_TIPS, "{} tips", state.tips.len());
    for tip in &state.tips {
        assert!(tip.uv.cmpge(Vec2::ZERO).all() && tip.uv.cmple(Vec2::ONE).all(), "{tip:?}");
        assert!(tip.direction.is_finite(), "{tip:?}");
    }
}

/// Whether the sprite can be cracked: the test of last resort for "the others are untouched".
pub(crate) fn assert_cracks(app: &mut App, entity: Entity) {
    let before = shown(app, entity);
    hit(app, center(entity).with_energy(2.0));
    settle(app, entity);
    assert!(shown(app, entity) != before, "no crack shows");
}

/// Lets the crate's systems run on the thread of the test, where [`warnings`] hears them.
pub(crate) fn single_threaded(app: &mut App) {
    app.edit_schedule(PostUpdate, |schedule| {
        schedule.set_executor(SingleThreadedExecutor::new());
    });
}

/// What the crate warns about on this thread while `run` runs; see [`single_threaded`].
pub(crate) fn warnings(run: impl FnOnce()) -> Vec<String> {
    #[derive(Clone, Default)]
    struct Heard(Arc<Mutex<Vec<String>>>);

    impl<S: Subscriber> tracing_subscriber::Layer<S> for Heard {
        fn on_event(&self, event: &tracing::Event<'_>, _: tracing_subscriber::layer::Context<'_, S>) {
            let meta = event.metadata();
            if *meta.level() <= tracing::Level::WARN && meta.target().starts_with("bevy_crack") {
                event.record(&mut |field: &field::Field, value: &dyn std::fmt::Debug| {
                    if field.name() == "message" {
                        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(format!("{value:?}"));
                    }
                });
            }
        }
    }

    let heard = Heard::default();
    let subscriber = tracing_subscriber::registry().with(heard.clone());
    tracing::subscriber::with_default(subscriber, run);
    heard.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

/// The texels that the GPU holds for each image, rows packed. Growth stands still meanwhile.
pub(crate) fn gpu_texels(app: &mut App, images: &[Handle<Image>]) -> Vec<Vec<u8>> {
    let answers = Arc::new(Mutex::new(HashMap::<AssetId<Image>, Vec<u8>>::new()));
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    let ask = |image: &Handle<Image>| {
        let (answers, id) = (answers.clone(), image.id());
        app.world_mut()
            .spawn(Readback::texture(image.clone()))
            .observe(move |done: On<ReadbackComplete>| {
                answers.lock().unwrap_or_else(PoisonError::into_inner).insert(id, done.data.clone());
            })
            .id()
    };
    let readers: Vec<_> = images.iter().map(ask).collect();
    let n_answers = || answers.lock().unwrap_or_else(PoisonError::into_inner).len();
    let start = Instant::now();
    while n_answers() < images.len() {
        assert!(start.elapsed() < Duration::from_secs(60), "the GPU does not answer");
        app.update();
    }
    for reader in readers {
        app.world_mut().despawn(reader);
    }
    // The requests of the last frame run out.
    app.update();
    app.world_mut().resource_mut::<Time<Virtual>>().unpause();
    let answers = answers.lock().unwrap_or_else(PoisonError::into_inner);
    let packed = |handle: &Handle<Image>| {
        let image = app.world().resource::<Assets<Image>>().get(handle).expect("the image");
        let row = (image.width() * image.texture_descriptor.format.block_copy_size(None).expect("a format")) as usize;
        answers[&handle.id()].chunks(row.next_multiple_of(256)).flat_map(|r| &r[..row]).copied().collect()
    };
    images.iter().map(packed).collect()
}

/// The textures of each surface are the same on the GPU.
pub(crate) fn assert_on_gpu(app: &mut App, surfaces: &[Entity]) {
    let images: Vec<_> = surfaces
        .iter()
        .flat_map(|entity| get::<CrackTextures>(app, *entity).handles().cloned().collect::<Vec<_>>())
        .collect();
    for (image, on_gpu) in images.iter().zip(gpu_texels(app, &images)) {
        let descriptor = &app.world().resource::<Assets<Image>>().get(image).expect("the image").texture_descriptor;
        // The first of its mip levels.
        assert!(texels(app, image)[..on_gpu.len()] == on_gpu, "the GPU holds something else: {descriptor:?}");
    }
}

/// A camera at the origin that draws `size` world units, a texel each, on black.
pub(crate) fn spawn_camera(app: &mut App, size: UVec2) -> Handle<Image> {
    let target = add(app, Image::new_target_texture(size.x, size.y, TextureFormat::Rgba8UnormSrgb, None));
    app.world_mut().spawn((
        Camera2d,
        Msaa::Off,
        Camera { clear_color: ClearColorConfig::Custom(Color::BLACK), ..default() },
        RenderTarget::Image(target.clone().into()),
    ));
    // A camera knows the size of a new target from the second frame on.
    app.update();
    app.update();
    target
}

/// What the camera draws in each of `n` frames; `before` is called before each.
pub(crate) fn film(
    app: &mut App,
    target: &Handle<Image>,
    n: usize,
    mut before: impl FnMut(&mut App, usize),
) -> Vec<Vec<u8>> {
    let film = Arc::new(Mutex::new(Vec::new()));
    for i in 0..n {
        before(app, i);
        let film = film.clone();
        app.world_mut().spawn(Screenshot::image(target.clone())).observe(move |done: On<ScreenshotCaptured>| {
            let data = done.image.data.clone().unwrap_or_default();
            film.lock().unwrap_or_else(PoisonError::into_inner).push(data);
        });
        app.update();
    }
    let start = Instant::now();
    while film.lock().unwrap_or_else(PoisonError::into_inner).len() < n {
        assert!(start.elapsed() < Duration::from_secs(60), "no screenshot");
        app.update();
    }
    core::mem::take(&mut *film.lock().unwrap_or_else(PoisonError::into_inner))
}

/// What the camera draws now.
pub(crate) fn drawn(app: &mut App, target: &Handle<Image>) -> Vec<u8> {
    film(app, target, 1, |_, _| {}).swap_remove(0)
}

/// The largest difference of two pictures of one size.
pub(crate) fn difference(a: &[u8], b: &[u8]) -> u8 {
    assert_eq!(a.len(), b.len(), "pictures of different sizes");
    a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
}
