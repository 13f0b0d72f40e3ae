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

mod api;
mod bake;
mod carrier;
mod draw;
mod gpu;
#[cfg(any(feature = "2d", feature = "3d"))]
mod group;
#[cfg(all(test, feature = "2d"))]
mod headless;
mod hits;
#[cfg(feature = "editor")]
pub(crate) mod inspect;
mod jobs;
mod life;
mod relief;
mod shards;
mod source;
mod surface;

pub use api::{
    AnalogyExamples, AnalogyFailed, AnalogyMade, AnalogyProgress, BakeProgress, CellClosed, CrackAnalogy, CrackBaked,
    CrackBudget, CrackChip, CrackChips, CrackClock, CrackDrive, CrackError, CrackFailed, CrackFinished, CrackGuide,
    CrackHit, CrackMaps, CrackMaskSource, CrackMips, CrackRecord, CrackRelief, CrackResolution, CrackScript,
    CrackShards, CrackState, CrackStats, CrackStatus, CrackStrands, CrackSurface, CrackSystems, CrackTextures,
    CrackTip, CrackUnwrap, CrackUploadStats, GravitySpace, GuideSource, GuidedAppearance, GuidedCracks, HitPoint,
    PresetSource, Reassembled, ReliefFailed, ReliefMade, ReliefProgress, ScriptedHit, Shard, ShardsError,
    ShatterCracks, ShatterFailed, ShatterRequest, ShatterWhen, Shattered, StrandField,
};
#[cfg(any(feature = "2d", feature = "3d"))]
pub use api::{CrackGroup, CrackMemberOf};
#[cfg(feature = "2d")]
pub use carrier::lit::{CrackLight2d, CrackLitMaterial, CrackLitUniform, MAX_LIGHTS};
#[cfg(any(feature = "2d", feature = "3d"))]
pub use carrier::place::{CrackPlace, CrackPlaces};
pub use life::{commands::CrackCommandsExt, record::CrackRecords};

use draw::{async_playback::AsyncPlayback, next_picture::NextPicture};
use shards::broken::Pieces;
use surface::cracked::Cracked;

use bevy::{
    app::{PluginGroup, PluginGroupBuilder, PostUpdate},
    asset::AssetEventSystems,
    prelude::*,
    transform::TransformSystems,
};

/// What a game names.
pub mod prelude {
    pub use super::{
        AnalogyExamples, AnalogyFailed, AnalogyMade, AnalogyProgress, BakeProgress, CellClosed, CrackAnalogy,
        CrackBaked, CrackBudget, CrackChip, CrackChips, CrackClock, CrackCommandsExt, CrackDrive, CrackError,
        CrackFailed, CrackFinished, CrackGuide, CrackHit, CrackMaps, CrackMaskSource, CrackMips, CrackPlugin,
        CrackPlugins, CrackRecord, CrackRecords, CrackRelief, CrackResolution, CrackScript, CrackShards, CrackState,
        CrackStats, CrackStatus, CrackStrands, CrackSurface, CrackSystems, CrackTextures, CrackTip, CrackUnwrap,
        GravitySpace, GuideSource, GuidedAppearance, GuidedCracks, HitPoint, PresetSource, Reassembled, ReliefFailed,
        ReliefMade, ReliefProgress, ScriptedHit, Shard, ShatterCracks, ShatterFailed, ShatterRequest, ShatterWhen,
        Shattered, StrandField,
    };
    #[cfg(any(feature = "2d", feature = "3d"))]
    pub use super::{CrackGroup, CrackMemberOf, CrackPlace, CrackPlaces};
    #[cfg(feature = "2d")]
    pub use super::{CrackLight2d, CrackLitMaterial};
    pub use crate::preset::CrackPreset;
}

/// Everything that the crate brings into an app: [`CrackPlugin`].
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// let mut app = App::new();
/// app.add_plugins(CrackPlugins);
/// assert!(app.is_plugin_added::<CrackPlugin>());
/// ```
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
            .register_type::<CrackStrands>()
            .register_type::<CrackScript>()
            .register_type::<CrackRecord>()
            .register_type::<StrandField>()
            .register_type::<BakeProgress>()
            .register_type::<CrackAnalogy>()
            .register_type::<AnalogyProgress>()
            .register_type::<AnalogyMade>()
            .register_type::<AnalogyFailed>()
            .register_type::<CrackRelief>()
            .register_type::<ReliefProgress>()
            .register_type::<ReliefMade>()
            .register_type::<ReliefFailed>()
            .register_type::<CrackBaked>()
            .register_type::<CrackTextures>()
            .register_type::<CrackHit>()
            .register_type::<CrackFinished>()
            .register_type::<CrackFailed>()
            .register_type::<CellClosed>()
            .register_type::<ShatterCracks>()
            .register_type::<Shard>()
            .register_type::<CrackChips>()
            .register_type::<CrackChip>()
            .register_type::<CrackShards>()
            .register_type::<Shattered>()
            .register_type::<Reassembled>()
            .register_type::<CrackBudget>()
            .register_type::<CrackStats>()
            .register_type::<CrackUploadStats>()
            .register_required_components::<Cracked, AsyncPlayback>()
            .register_required_components::<Cracked, NextPicture>()
            .register_required_components::<CrackShards, Pieces>()
            .init_resource::<CrackBudget>()
            .init_resource::<CrackStats>()
            .init_resource::<CrackUploadStats>()
            .init_resource::<gpu::uploads::Uploads>()
            .init_resource::<jobs::deferred::Later>()
            .init_resource::<shards::body::Spares>()
            .init_resource::<shards::chips::Chips>()
            .init_resource::<jobs::frame_time::FrameClock>()
            .init_resource::<surface::queue::HitQueue>()
            .init_resource::<source::mask::PictureMasks>()
            .init_resource::<source::picture::BasePictures>()
            .init_resource::<surface::owners::Owners>()
            .init_resource::<surface::reread::Rereadings>()
            .init_resource::<surface::queues::Queues>()
            .init_resource::<gpu::memory::TextureMemory>()
            .init_resource::<source::picture::FrameCount>()
            .init_resource::<jobs::threads::Threads>()
            .init_resource::<shards::request::ShardQueue>()
            .init_resource::<bake::work::Bakes>()
            .init_resource::<surface::prepare::Preparations>()
            .init_resource::<surface::unfold::Unfoldings>()
            .init_resource::<carrier::pipelines::PipelineRequests>()
            .add_message::<CrackHit>()
            .add_observer(hits::collect::receive_hit)
            .add_observer(bake::work::cancel_removed::<GuidedCracks>)
            .add_observer(bake::work::cancel_removed::<CrackStrands>)
            .add_observer(bake::work::cancel_removed::<CrackRecord>)
            .add_observer(relief::system::cancel_removed)
            .add_observer(draw::analogy::prepare_added)
            .add_observer(draw::analogy::drop_removed)
            .add_observer(life::heal::disown_added)
            .add_observer(life::heal::heal_removed)
            .add_observer(life::heal::heal_closed)
            .configure_sets(
                PostUpdate,
                (Hit, Grow, Paint, Upload).chain().after(TransformSystems::Propagate).before(AssetEventSystems),
            )
            .configure_sets(PostUpdate, Shatter.before(TransformSystems::Propagate))
            .add_systems(
                PostUpdate,
                (
                    (surface::warm::note_fresh, surface::warm::watch_views, surface::warm::warm_up)
                        .chain()
                        .run_if(carrier::pipelines::is_connected)
                        .in_set(Shatter)
                        .before(shards::fly::fly_shards),
                    (
                        shards::fly::fly_shards,
                        shards::request::shatter_when_due,
                        shards::release::shatter_surfaces.run_if(shards::request::any_requests),
                        shards::chips::fly_chips.run_if(shards::chips::any_chips),
                    )
                        .chain()
                        .in_set(Shatter),
                    (
                        (
                            jobs::frame_time::start_frame,
                            life::script::play_scripts,
                            relief::system::watch_reliefs,
                            life::watch::watch_surfaces,
                            life::watch::watch_pictures,
                            life::watch::watch_presets,
                            bake::work::watch_baked,
                            bake::work::watch_records.run_if(any_with_component::<CrackRecord>),
                        )
                            .chain_ignore_deferred(),
                        life::change::update_changed.run_if(life::watch::any_changed),
                        hits::collect::collect_hits,
                        surface::prepare::prepare_surfaces.run_if(surface::prepare::any_preparing),
                        hits::apply::apply_hits.run_if(hits::apply::any_hits),
                    )
                        .chain()
                        .in_set(Hit),
                    (
                        draw::clock::follow_clocks,
                        draw::grow::grow_surfaces,
                        bake::system::bake_guided.run_if(bake::work::any_baking),
                        relief::system::make_reliefs.run_if(relief::system::any_reliefs),
                    )
                        .chain()
                        .in_set(Grow),
                    (
                        draw::async_playback::play_async,
                        draw::blend::blend_normals,
                        draw::paint::paint_surfaces,
                        draw::analogy::make_analogies,
                    )
                        .chain()
                        .in_set(Paint),
                    (gpu::mips::follow_up, gpu::uploads::drop_unwanted, jobs::frame_time::end_frame)
                        .chain()
                        .in_set(Upload),
                ),
            );
        // What a sprite shows changes by hits, by bakes and when cracks have closed, and then the engine cuts it into parts.
        #[cfg(feature = "2d")]
        app.configure_sets(PostUpdate, (Hit, Grow).before(bevy::sprite_render::SpriteSystems::ComputeSlices));
        #[cfg(any(feature = "2d", feature = "3d"))]
        app.register_type::<CrackMemberOf>()
            .register_type::<CrackGroup>()
            .init_resource::<gpu::grain::Grain>()
            .add_observer(group::hide::show_leaving);
        #[cfg(feature = "2d")]
        app.init_resource::<group::system::GroupChanges>().add_systems(
            PostUpdate,
            (group::system::watch_members, group::system::make_walls)
                .chain()
                .run_if(group::system::any_groups)
                .in_set(Hit)
                .after(hits::collect::collect_hits)
                .before(surface::prepare::prepare_surfaces)
                .before(bevy::camera::visibility::VisibilitySystems::CheckVisibility),
        );
        #[cfg(feature = "3d")]
        {
            let bodies = (group::bodies::watch_members, group::bodies::make_bodies)
                .chain()
                .run_if(group::bodies::any_groups)
                .in_set(Hit)
                .after(hits::collect::collect_hits)
                .before(surface::prepare::prepare_surfaces)
                .before(bevy::camera::visibility::VisibilitySystems::CheckVisibility);
            #[cfg(feature = "2d")]
            let bodies = bodies.after(group::system::make_walls);
            app.init_resource::<group::bodies::BodyChanges>().add_systems(PostUpdate, bodies);
        }
        #[cfg(feature = "2d")]
        app.add_systems(
            PostUpdate,
            (
                life::watch::watch::<Sprite>,
                life::watch::watch::<MeshMaterial2d<ColorMaterial>>,
                life::watch::watch::<MeshMaterial2d<CrackLitMaterial>>,
            )
                .chain()
                .in_set(Hit)
                .after(bake::work::watch_records)
                .before(life::change::update_changed),
        );
        #[cfg(feature = "3d")]
        {
            let watch = life::watch::watch::<MeshMaterial3d<StandardMaterial>>
                .in_set(Hit)
                .after(bake::work::watch_records)
                .before(life::change::update_changed);
            #[cfg(feature = "2d")]
            let watch = watch.after(life::watch::watch::<MeshMaterial2d<CrackLitMaterial>>);
            app.add_systems(PostUpdate, watch);
        }
    }

    fn finish(&self, app: &mut App) {
        app.insert_resource(source::picture::NearestByDefault::of(app));
        source::preset::add_assets(app);
        source::analogy::add_assets(app);
        gpu::fetch::connect(app);
        carrier::pipelines::connect(app);
        #[cfg(feature = "2d")]
        carrier::lit::add_material(app);
    }
}
