//! [`CrackBudget`]: what cracks may cost, and what they did: [`CrackStats`], [`CrackUploadStats`].

use bevy::prelude::*;
use core::time::Duration;

/// What all surfaces together may cost.
///
/// A clock decides only *when* something happens, never *what*: the cracks of a surface are the same on a slow machine.
///
/// ```
/// use bevy::{image::TextureAtlasLayout, prelude::*};
/// use bevy_crack::{plugin::CrackUploadStats, prelude::*};
///
/// // A game without a window, as in tests. It may take any time for a frame.
/// let mut app = App::new();
/// app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default(), ImagePlugin::default(), CrackPlugins))
///     .init_asset::<TextureAtlasLayout>()
///     .init_asset::<Mesh>()
///     .init_asset::<ColorMaterial>()
///     .insert_resource(CrackBudget { milliseconds: 1e6, ..default() });
/// app.finish();
/// app.cleanup();
///
/// let pane = (Sprite::from_color(Color::WHITE, Vec2::splat(64.0)), CrackSurface::new(CrackPreset::GLASS));
/// let pane = app.world_mut().spawn(pane).id();
/// app.world_mut().trigger(CrackHit::uv(pane, Vec2::splat(0.5)));
/// app.world_mut().trigger(CrackHit::uv(pane, Vec2::splat(7.0)));
/// app.update();
/// let stats = app.world().resource::<CrackStats>();
/// assert_eq!((stats.sent, stats.applied, stats.rejected), (2, 1, 1));
/// // Nothing goes to a GPU that is not there.
/// assert_eq!(*app.world().resource::<CrackUploadStats>(), CrackUploadStats::default());
/// ```
#[derive(Resource, Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Resource, Default)]
pub struct CrackBudget {
    /// Time for hits, growth and painting in one frame, milliseconds, however many threads grow and paint; default 2. Up to a quarter of it
    /// counts as spent on what runs between them. What is left over waits for the next frame; at least one hit, one step and one surface
    /// are done in each. Of a hit that makes many markers this may be a part of them. Of a surface it may be a part of what is to be painted: it
    /// grows on when the next frames have painted the rest. Where more cracks grow than there is time for, all of them grow more slowly. NaN and values below zero count
    /// as 0.
    ///
    /// With a second or more nothing that a frame shows is put off: for recordings, whose frames may take any time.
    pub milliseconds: f32,
    /// Hits that may wait on one surface; default 4096. A further one adds its energy to a waiting one near it.
    pub max_queued_per_surface: usize,
    /// Surfaces that may grow at once; default 1024. Others wait for one of them to end.
    pub max_growing: usize,
    /// Memory for the textures of all cracked surfaces, bytes; default 1 GiB. A surface that does not fit gets coarser
    /// textures, or fails.
    pub max_texture_bytes: u64,
    /// Longest side of a texture, texels; default 8192. The device's own limit holds as well.
    pub max_side: u32,
    /// Shards that there are at once, of all surfaces together, shown or kept to serve again; default 4096. Each is an entity, in 3D with
    /// one more for its sides.
    ///
    /// A surface that would break into more than this breaks into fewer and larger ones. Where several have broken, the oldest
    /// shards make room for new ones, and pieces that would [break again](super::ShatterCracks::again) stay whole when their time has come
    /// if there is no room for all their fragments, in the order in which the surfaces broke. While none is shown, up to 256 are kept to
    /// serve again.
    pub max_shards: usize,
}

impl Default for CrackBudget {
    fn default() -> Self {
        Self {
            milliseconds: 2.0,
            max_queued_per_surface: 4096,
            max_growing: 1024,
            max_texture_bytes: 1 << 30,
            max_side: 8192,
            max_shards: 4096,
        }
    }
}

/// What became of all hits ever sent: `sent = applied + merged + ignored + rejected + queued`, after every frame.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[type_path = "bevy_crack"]
#[reflect(Resource, Default)]
pub struct CrackStats {
    /// Hits sent, as events or messages.
    pub sent: u64,
    /// Hits that started a crack.
    pub applied: u64,
    /// Hits whose energy went into another hit close to them.
    pub merged: u64,
    /// Hits without energy.
    pub ignored: u64,
    /// Hits refused: not finite, off the surface, on nothing, or on a surface that failed, was healed or is gone.
    pub rejected: u64,
    /// Hits that wait.
    pub queued: u64,
}

impl CrackBudget {
    /// Whether frames may take any time.
    pub(crate) fn is_unlimited(&self) -> bool {
        self.milliseconds >= 1000.0
    }

    /// A share of the time in a frame.
    pub(crate) fn share(&self, share: f32) -> Duration {
        Duration::from_secs_f32((self.milliseconds.max(0.0) * share / 1000.0).min(3600.0))
    }
}

/// What went to the GPU in the last frame that was rendered.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[type_path = "bevy_crack"]
#[reflect(Resource, Default)]
pub struct CrackUploadStats {
    /// Bytes of texels.
    pub bytes: u64,
    /// Rectangles.
    pub rects: u32,
}
