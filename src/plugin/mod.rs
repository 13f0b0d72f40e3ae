//! The Bevy glue: put [`CrackSurface`] on a sprite or a mesh, send a [`CrackHit`], and a crack grows into its textures.
//!
//! Per frame, in `PostUpdate`, in the sets of [`CrackSystems`]: hits are queued and applied, networks grow, the changed
//! texels are painted into private copies of the surface's pictures, and only those texels go to the GPU. Nothing is
//! made for a surface, and nothing looks at it, before its first hit.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_crack::prelude::*;
//!
//! fn crack(mut commands: Commands, surface: Single<Entity, With<CrackSurface>>) {
//!     commands.trigger(CrackHit::uv(*surface, Vec2::splat(0.5)).with_energy(2.0));
//! }
//!
//! let mut app = App::new();
//! app.add_plugins(CrackPlugins).add_systems(Update, crack);
//! ```

mod activate;
mod bake;
mod beside;
mod budget;
mod carrier;
mod clock;
mod error;
#[cfg(feature = "3d")]
mod faces;
mod film;
mod freeze;
mod grow;
mod guided;
#[cfg(all(test, feature = "2d"))]
mod headless;
mod heal;
mod hit;
mod later;
mod layout;
#[cfg(feature = "2d")]
mod lit;
mod mask;
#[cfg(any(feature = "2d", feature = "3d"))]
mod material;
#[cfg(any(feature = "2d", feature = "3d"))]
mod mesh;
mod paint;
mod picture;
#[cfg(any(feature = "2d", feature = "3d"))]
mod place;
mod plan;
mod prepare;
mod preset;
mod queue;
mod read;
mod reflect;
mod shards;
mod space;
#[cfg(feature = "2d")]
mod sprite;
mod state;
mod surface;
mod surfaces;
mod textures;
mod upload;
#[cfg_attr(not(any(feature = "2d", feature = "3d")), expect(dead_code, reason = "there are no kinds then"))]
mod warm;
mod watch;

pub use budget::{CrackBudget, CrackStats};
pub use clock::{CrackClock, CrackDrive};
pub use error::CrackError;
pub use guided::{BakeProgress, CrackBaked, CrackGuide, GuideSource, GuidedAppearance, GuidedCracks};
pub use heal::CrackCommandsExt;
pub use hit::{CrackHit, HitPoint};
#[cfg(feature = "2d")]
pub use lit::{CrackLight2d, CrackLitMaterial, CrackLitUniform, MAX_LIGHTS};
pub use mask::CrackMaskSource;
#[cfg(any(feature = "2d", feature = "3d"))]
pub use place::{CrackPlace, CrackPlaces};
pub use preset::PresetSource;
pub use shards::{
    CrackShards, GravitySpace, Reassembled, Shard, ShardsError, ShatterCracks, ShatterFailed, ShatterRequest,
    ShatterWhen, Shattered,
};
pub use state::{CellClosed, CrackFailed, CrackFinished, CrackState, CrackStatus, CrackTip};
pub use surface::{CrackMaps, CrackResolution, CrackSurface};
pub use textures::CrackTextures;
pub use upload::CrackUploadStats;

use bevy::{
    app::{PluginGroup, PluginGroupBuilder, PostUpdate},
    asset::AssetEventSystems,
    prelude::*,
    transform::TransformSystems,
};

/// What a game names.
pub mod prelude {
    pub use super::{
        BakeProgress, CellClosed, CrackBaked, CrackBudget, CrackClock, CrackCommandsExt, CrackDrive, CrackError,
        CrackFailed, CrackFinished, CrackGuide, CrackHit, CrackMaps, CrackMaskSource, CrackPlugin, CrackPlugins,
        CrackResolution, CrackShards, CrackState, CrackStats, CrackStatus, CrackSurface, CrackSystems, CrackTextures,
        CrackTip, GravitySpace, GuideSource, GuidedAppearance, GuidedCracks, HitPoint, PresetSource, Reassembled,
        Shard, ShatterCracks, ShatterFailed, ShatterRequest, ShatterWhen, Shattered,
    };
    #[cfg(feature = "2d")]
    pub use super::{CrackLight2d, CrackLitMaterial};
    #[cfg(any(feature = "2d", feature = "3d"))]
    pub use super::{CrackPlace, CrackPlaces};
    pub use crate::preset::CrackPreset;
}

/// The stages of a frame, in order, in `PostUpdate`, all but the first after transforms are propagated and before asset events.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CrackSystems {
    /// After this set, which comes before transforms are propagated, shards are where they belong in this frame.
    Shatter,
    /// After this set, every hit of this frame is queued, and as many as the budget allows are in their growths.
    Hit,
    /// After this set, networks have made the steps that are due, as many as the budget allows.
    Grow,
    /// After this set, changed texels are painted on the CPU, as many surfaces as the budget allows.
    Paint,
    /// After this set, the rectangles to upload are handed to the render world.
    Upload,
}

/// Everything that the crate brings into an app: [`CrackPlugin`].
#[derive(Clone, Copy, Debug, Default)]
pub struct CrackPlugins;

impl PluginGroup for CrackPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>().add(CrackPlugin)
    }
}

/// Cracks on sprites and meshes. May be added before or after `DefaultPlugins`; works without a renderer.
#[derive(Clone, Copy, Debug, Default)]
pub struct CrackPlugin;

impl Plugin for CrackPlugin {
    fn build(&self, app: &mut App) {
        use CrackSystems::{Grow, Hit, Paint, Shatter, Upload};
        app.register_type::<CrackSurface>()
            .register_type::<CrackClock>()
            .register_type::<CrackState>()
            .register_type::<GuidedCracks>()
            .register_type::<GuidedAppearance>()
            .register_type::<BakeProgress>()
            .register_type::<CrackBaked>()
            .register_type::<CrackTextures>()
            .register_type::<CrackHit>()
            .register_type::<CrackFinished>()
            .register_type::<CrackFailed>()
            .register_type::<CellClosed>()
            .register_type::<ShatterCracks>()
            .register_type::<Shard>()
            .register_type::<CrackShards>()
            .register_type::<Shattered>()
            .register_type::<Reassembled>()
            .register_type::<CrackBudget>()
            .register_type::<CrackStats>()
            .register_type::<CrackUploadStats>()
            .init_resource::<CrackBudget>()
            .init_resource::<CrackStats>()
            .init_resource::<CrackUploadStats>()
            .init_resource::<upload::Uploads>()
            .init_resource::<later::Later>()
            .init_resource::<shards::Spares>()
            .init_resource::<budget::FrameClock>()
            .init_resource::<queue::HitQueue>()
            .init_resource::<mask::PictureMasks>()
            .init_resource::<picture::BasePictures>()
            .init_resource::<surfaces::Surfaces>()
            .init_resource::<bake::Bakes>()
            .init_resource::<prepare::Preparations>()
            .init_resource::<warm::Warmth>()
            .add_message::<CrackHit>()
            .add_observer(hit::receive_hit)
            .configure_sets(
                PostUpdate,
                (Hit, Grow, Paint, Upload).chain().after(TransformSystems::Propagate).before(AssetEventSystems),
            )
            .configure_sets(PostUpdate, Shatter.before(TransformSystems::Propagate))
            .add_systems(
                PostUpdate,
                (
                    (warm::note_fresh, warm::watch_views, warm::warm_up)
                        .chain()
                        .run_if(warm::is_connected)
                        .in_set(Shatter)
                        .before(shards::fly_shards),
                    (
                        shards::fly_shards,
                        shards::shatter_when_due,
                        shards::shatter_surfaces.run_if(shards::any_requests),
                    )
                        .chain()
                        .in_set(Shatter),
                    (
                        (
                            budget::start_frame,
                            watch::watch_surfaces,
                            watch::watch_pictures,
                            preset::watch_presets,
                            guided::watch_guided,
                        ),
                        watch::update_changed.run_if(watch::any_changed),
                        hit::collect_hits,
                        prepare::prepare_surfaces.run_if(prepare::any_preparing),
                        activate::apply_hits.run_if(activate::any_hits),
                    )
                        .chain()
                        .in_set(Hit),
                    (clock::follow_clocks, grow::grow_surfaces, bake::bake_guided.run_if(bake::any_baking))
                        .chain()
                        .in_set(Grow),
                    (film::show_films.run_if(film::any_filmed), paint::paint_surfaces).chain().in_set(Paint),
                    (upload::drop_unwanted, budget::end_frame).chain().in_set(Upload),
                ),
            );
        // What a sprite shows changes by hits, by bakes and when cracks have closed, and then the engine cuts it into parts.
        #[cfg(feature = "2d")]
        app.configure_sets(PostUpdate, (Hit, Grow).before(bevy::sprite_render::SpriteSystems::ComputeSlices));
        #[cfg(feature = "2d")]
        app.add_systems(
            PostUpdate,
            (
                watch::watch::<Sprite>,
                watch::watch::<MeshMaterial2d<ColorMaterial>>,
                watch::watch::<MeshMaterial2d<CrackLitMaterial>>,
            )
                .in_set(Hit)
                .before(watch::update_changed),
        );
        #[cfg(feature = "3d")]
        app.add_systems(
            PostUpdate,
            watch::watch::<MeshMaterial3d<StandardMaterial>>.in_set(Hit).before(watch::update_changed),
        );
    }

    fn finish(&self, app: &mut App) {
        app.insert_resource(picture::NearestByDefault::of(app));
        preset::add_assets(app);
        upload::connect(app);
        warm::connect(app);
        #[cfg(feature = "2d")]
        lit::add_material(app);
    }
}
