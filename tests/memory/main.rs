//! B2: what is said where there is no memory. A binary of its own: its allocator has a limit.

use bevy_crack::{
    Grid, OutOfMemory,
    pattern::{MAX_SIDE, SurfaceFrame},
    raster::DepthField,
    relief::{ReliefError, ReliefJob, ReliefSettings},
    voronoi::{BakeStatus, FONT, Guide, SiteLayout, VoronoiBake, VoronoiError, VoronoiParams, draw_text},
};
use cap::Cap;
use glam::UVec2;
use std::alloc::System;

#[global_allocator]
static MEMORY: Cap<System> = Cap::new(System, usize::MAX);

/// Runs `work` while no more than `bytes` can be allocated. Whatever asks for more and does not look at the answer ends this program.
fn with_no_more_than<T>(bytes: usize, work: impl FnOnce() -> T) -> T {
    assert!(MEMORY.set_limit(MEMORY.allocated() + bytes).is_ok());
    let made = work();
    assert!(MEMORY.set_limit(usize::MAX).is_ok());
    made
}

/// Whether there was memory for a depth field.
fn draws(size: UVec2) -> bool {
    let Ok(frame) = SurfaceFrame::new(size) else { return false };
    match DepthField::try_new(frame) {
        Ok(field) => field.depth.size() == size,
        Err(OutOfMemory { bytes }) => {
            assert_eq!(bytes, 2 * u64::from(size.x) * u64::from(size.y));
            false
        }
    }
}

/// Whether there was memory for a guided map.
fn bakes(params: VoronoiParams, guides: Vec<Guide>, size: UVec2) -> bool {
    match VoronoiBake::new(params, guides, size, 3) {
        Ok(mut bake) => {
            while bake.step(16) != BakeStatus::Done {}
            !bake.finish().1.seams.is_empty()
        }
        Err(error) => {
            assert!(matches!(error, VoronoiError::Memory(_)), "{error}");
            false
        }
    }
}

/// Whether there was memory for a relief.
fn rises(settings: ReliefSettings, size: UVec2) -> bool {
    match ReliefJob::new(settings, size, 3) {
        Ok(job) => job.finish().is_ok_and(|relief| relief.heights.size() == size),
        Err(error) => {
            assert!(matches!(error, ReliefError::Memory(_)), "{error}");
            false
        }
    }
}

/// At every limit there is an error or a result, and a result from some limit on.
#[test]
fn b2_without_memory_there_is_an_error() {
    // A few bytes are always there.
    let limits = |most: usize| (0..=24).map(move |step| 50_000 + most * step / 24);
    let check = |name: &str, most: usize, made: &dyn Fn(usize) -> bool| {
        let made: Vec<bool> = limits(most).map(made).collect();
        assert!(!made[0] && made[24] && made.is_sorted(), "{name}: {made:?}");
    };
    let size = UVec2::new(600, 400);
    check("depths", 1_000_000, &|limit| with_no_more_than(limit, || draws(size)));
    let word = draw_text(FONT, "CRACK", size, f32::INFINITY).unwrap();
    for (name, layout, sites, levels) in [
        ("uniform", SiteLayout::Uniform, 3000, 3),
        ("even", SiteLayout::Even, u32::MAX, 1),
        ("stroke pairs", SiteLayout::StrokePairs, 400, 2),
    ] {
        let params = VoronoiParams { layout, sites, levels, ..VoronoiParams::DEFAULT };
        check(name, 140_000_000, &|limit| {
            let (params, guides) = (params.clone(), vec![Guide { image: word.clone(), gamma: 28.0 }]);
            with_no_more_than(limit, || bakes(params, guides, size))
        });
    }
    for settings in [ReliefSettings::island(), ReliefSettings::mountain()] {
        check("relief", 20_000_000, &|limit| {
            let settings = settings.clone();
            with_no_more_than(limit, || rises(settings, size))
        });
    }

    #[cfg(feature = "2d")]
    game::a_surface_without_memory_fails_and_cracks_later();

    // The largest surface that there is, with half a gigabyte.
    let (size, limit) = (UVec2::splat(MAX_SIDE), 500_000_000);
    assert!(!with_no_more_than(limit, || draws(size)));
    assert!(!with_no_more_than(limit, || bakes(VoronoiParams::DEFAULT, Vec::new(), size)));
    assert!(!with_no_more_than(limit, || rises(ReliefSettings::island(), size)));
    // More than there are addresses.
    let bytes = u64::from(u32::MAX) * u64::from(u32::MAX);
    assert_eq!(Grid::try_new(UVec2::MAX, 0u8), Err(OutOfMemory { bytes }));
    assert_eq!(Grid::try_new(UVec2::MAX, 0u64), Err(OutOfMemory { bytes: u64::MAX }));
    assert_eq!(Grid::try_new(UVec2::new(2, 1), 7u8).map(|grid| grid.as_slice().to_vec()), Ok(vec![7, 7]));
}

#[cfg(feature = "2d")]
mod game {
    use super::with_no_more_than;
    use bevy::{
        asset::RenderAssetUsages,
        prelude::*,
        render::render_resource::{Extent3d, TextureDimension, TextureFormat},
    };
    use bevy_crack::prelude::*;

    #[derive(Resource, Default)]
    struct Failed(Vec<CrackError>);

    /// A picture of 16 MiB: what is made of it needs several times as much.
    pub(super) fn a_surface_without_memory_fails_and_cracks_later() {
        let mut app = App::new();
        app.add_plugins((
            MinimalPlugins,
            TransformPlugin,
            AssetPlugin::default(),
            ImagePlugin::default(),
            CrackPlugins,
        ))
        .init_asset::<TextureAtlasLayout>()
        .init_asset::<Mesh>()
        .init_asset::<ColorMaterial>()
        .init_asset::<StandardMaterial>()
        .insert_resource(CrackBudget { milliseconds: 1e6, ..default() })
        .init_resource::<Failed>()
        .add_observer(|event: On<CrackFailed>, mut failed: ResMut<Failed>| failed.0.push(event.error.clone()));
        app.finish();
        app.cleanup();
        let extent = Extent3d { width: 2048, height: 2048, depth_or_array_layers: 1 };
        let (format, usage) = (TextureFormat::Rgba8UnormSrgb, RenderAssetUsages::default());
        let image = Image::new_fill(extent, TextureDimension::D2, &[90, 120, 150, 255], format, usage);
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(image);
        let surface = CrackSurface::new(CrackPreset::CONCRETE);
        let wall = app.world_mut().spawn((Sprite::from_image(image), surface)).id();
        (0..5).for_each(|_| app.update());
        for (limit, cracks) in [(6_000_000, false), (24_000_000, false), (1_000_000_000, true)] {
            with_no_more_than(limit, || {
                app.world_mut().trigger(CrackHit::uv(wall, Vec2::splat(0.5)));
                (0..5).for_each(|_| app.update());
            });
            let is_cracked = app.world().get::<CrackTextures>(wall).is_some();
            assert_eq!(is_cracked, cracks, "{limit} bytes");
        }
        let failed = &app.world().resource::<Failed>().0;
        assert!(failed.iter().all(|error| error.to_string().contains("no memory")), "{failed:?}");
        assert!(!failed.is_empty());
    }
}
