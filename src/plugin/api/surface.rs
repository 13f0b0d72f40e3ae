//! [`CrackSurface`]: this sprite or mesh can crack.

use super::{CrackMaskSource, CrackState, PresetSource};
use bevy::{prelude::*, reflect::serde::ReflectSerializeWithRegistry};

/// This sprite, 2D mesh or 3D mesh can crack.
///
/// Costs nothing until the first hit. Then the surface gets textures of its own, which start as copies of its pictures;
/// everybody else who shows those pictures keeps the originals. Removing the component heals it: the originals are back, and
/// [`CrackState`] is as at the start.
///
/// `Sprite::image` and the material in `MeshMaterial2d` or `MeshMaterial3d` are the surface's own while it is cracked. A
/// copy of a material is changed through the handle that the entity has then, not through the one it was spawned with, and is dropped
/// by healing; another image or material put in its place is cracked as the first one was. A sprite that repeats or slices its picture shows
/// it laid out in its texture while it is cracked, at the size that it had when that was made, and its `image_mode` is `Tiled` without tiles.
///
/// A 3D mesh that is neither flat nor a slab is laid out flat around its first hit, and all of it cracks: see [`CrackUnwrap`]. A box no thicker than a
/// quarter of its width and height, as it is scaled in the world, is a slab: it cracks through, so that its back shows what its front shows,
/// and is hit from all sides.
///
/// Where a mesh is not laid out and some of its faces show the same part of the picture, as those of a `Cuboid` or a `Cylinder`, only that face cracks
/// which is hit first; hits on others are refused until it is healed. Its textures hold the picture twice, and `Mesh3d` is a copy with other texture
/// coordinates while it is cracked. A face is what hangs together in the texture coordinates, or a side of a box. Where a face shows a part of the
/// picture twice itself, where the picture repeats, faces share vertices, or there are more than 65,536 triangles, the mesh stays as it is, and cracks
/// show wherever their place of the picture does.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// fn setup(mut commands: Commands, assets: Res<AssetServer>) {
///     // Most cracks where the first image is light, none where the second one is. There is no use for its normals.
///     let wall = CrackSurface::new(CrackPreset::PLASTER)
///         .with_seed(3)
///         .with_density(assets.load("density.png"))
///         .with_mask(CrackMaskSource::Images { weak: None, strong: None, forbidden: Some(assets.load("frame.png")) })
///         .with_maps(CrackMaps { normal: false, ..default() });
///     commands.spawn((Sprite::from_image(assets.load("wall.png")), wall));
///     // A coin is small.
///     let coin = CrackSurface::new(CrackPreset::GLASS).with_resolution(CrackResolution::Fixed(UVec2::splat(64)));
///     commands.spawn((Sprite::from_image(assets.load("coin.png")), coin));
/// }
///
/// // A large vase, to be laid out flat in any case.
/// let vase = CrackSurface::new(CrackPreset::CLAY).with_unwrap(CrackUnwrap::Always);
/// assert_eq!((vase.mask, vase.write), (CrackMaskSource::Auto, CrackMaps::default()));
/// # bevy::ecs::system::assert_is_system(setup);
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default, SerializeWithRegistry)]
#[require(CrackState)]
pub struct CrackSurface {
    /// How cracks grow and look, here or in a file. A changed look and profile show on all cracks at once, changed growth on what
    /// grows from then on; invalid changes are refused with one warning. Default: [`CrackPreset::CONCRETE`](crate::CrackPreset::CONCRETE).
    pub preset: PresetSource,
    /// Seed of the pattern; default 0. A change takes effect after healing.
    pub seed: u64,
    /// Size of the textures; default [`Picture`](CrackResolution::Picture). A change takes effect when they are made again: after healing, or with
    /// another picture.
    pub resolution: CrackResolution,
    /// Which maps are written; default all. A change takes effect as one of `resolution`.
    pub write: CrackMaps,
    /// Whether transparent texels refuse hits and attract no cracks; default true.
    pub alpha_mask: bool,
    /// Where cracks like to run and where they never go; by default as the preset has it. A change takes effect as one of `resolution`, and so
    /// does one of what the preset has.
    pub mask: CrackMaskSource,
    /// How densely cracks grow: this image over the shown part of the surface's picture, of any size. White = as everywhere, black = no markers
    /// there (lightness as it is stored, times alpha). `None` (default) = everywhere alike. The first hit waits until it is loaded. A change takes
    /// effect as one of `resolution`.
    pub density: Option<Handle<Image>>,
    /// Whether a 3D mesh is laid out flat around its first hit, so that cracks run over its edges and around its curves; default
    /// [`Auto`](CrackUnwrap::Auto). A change takes effect after healing.
    pub unwrap: CrackUnwrap,
    /// Whether the textures have mip levels. A change takes effect as one of `resolution`.
    pub mips: CrackMips,
}

impl CrackSurface {
    /// A surface of the given material (a [`CrackPreset`](crate::CrackPreset) or the handle of one), with seed 0, everything
    /// else by default.
    #[must_use]
    pub fn new(preset: impl Into<PresetSource>) -> Self {
        Self {
            preset: preset.into(),
            seed: 0,
            resolution: CrackResolution::Picture,
            write: CrackMaps { diffuse: true, normal: true, depth: true },
            alpha_mask: true,
            mask: CrackMaskSource::Auto,
            density: None,
            unwrap: CrackUnwrap::Auto,
            mips: CrackMips::Auto,
        }
    }

    /// The same with another seed.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// The same with textures of another size.
    #[must_use]
    pub fn with_resolution(mut self, resolution: CrackResolution) -> Self {
        self.resolution = resolution;
        self
    }

    /// The same with only these maps.
    #[must_use]
    pub fn with_maps(mut self, maps: CrackMaps) -> Self {
        self.write = maps;
        self
    }

    /// The same with an image of how densely cracks grow.
    #[must_use]
    pub fn with_density(mut self, density: Handle<Image>) -> Self {
        self.density = Some(density);
        self
    }

    /// The same, its mesh laid out flat or not.
    #[must_use]
    pub fn with_unwrap(mut self, unwrap: CrackUnwrap) -> Self {
        self.unwrap = unwrap;
        self
    }

    /// The same with mip levels or without.
    #[must_use]
    pub fn with_mips(mut self, mips: CrackMips) -> Self {
        self.mips = mips;
        self
    }

    /// The same with a mask.
    #[must_use]
    pub fn with_mask(mut self, mask: CrackMaskSource) -> Self {
        self.mask = mask;
        self
    }
}

impl Default for CrackSurface {
    fn default() -> Self {
        Self::new(PresetSource::default())
    }
}

/// Whether a 3D mesh is laid out flat around its first hit.
///
/// Such a mesh cracks all over, its cracks running over edges and around curves as if it were flat around the hit: a box is unfolded, a rock is
/// laid out by distance and direction. Lengths and angles stay as they are on meshes of flat faces (up to 64 of them), and change by no more than
/// twice on others. What does not lie flat any more, as the far side of a ball, is laid out beside it and cracks too, but no crack of a hit runs
/// from one part to another. [`GuidedCracks`](crate::plugin::GuidedCracks) do cross the cuts. For them a mesh that has not been hit is laid out
/// around the middle of its picture. Each needs textures for all of it: a box six times its picture, and about as much for the gaps.
///
/// Never laid out: flat meshes and slabs, those of more than 65,536 triangles, meshes whose surface has a [mask](CrackSurface::mask) of images, a
/// [density](CrackSurface::density), a [fixed size](CrackResolution::Fixed) or [`CrackStrands`](crate::plugin::CrackStrands), which have their
/// places in its picture.
///
/// While it is cracked, `Mesh3d` is a copy with other texture coordinates. Hits by texture coordinates are meant for those of the picture, as before. One that
/// is laid out shatters as a shell: see [`ShatterCracks`](crate::plugin::ShatterCracks#bodies).
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[type_path = "bevy_crack"]
pub enum CrackUnwrap {
    /// If that takes no more than 1.5 million texels at the resolution of its picture: a box with a picture of 350 x 350 or without one.
    #[default]
    Auto,
    /// Always, with up to eight million texels and as many a side as the budget allows; fewer for a unit of length where that is not enough.
    Always,
    /// Cracks are where the mesh's own texture coordinates have them.
    Never,
}

/// Whether the textures of a surface have mip levels: smaller versions of themselves that the renderer shows from afar, where fine cracks and
/// rough picture would flicker otherwise.
///
/// Levels follow the cracks frame by frame, where they change, down to a single texel; see [`MipLevels`](crate::paint::MipLevels). They take a third more
/// memory. How they are shown is up to the sampler of the picture: the default one of
/// [`ImagePlugin`](bevy::prelude::ImagePlugin) blends between levels. Beside a frame of an atlas, coarse levels show some of its neighbours.
///
/// ```
/// use bevy_crack::prelude::*;
///
/// // A wall that is also seen from far away.
/// let wall = CrackSurface::new(CrackPreset::BRICK).with_mips(CrackMips::Always);
/// assert_eq!(CrackSurface::default().mips, CrackMips::Auto);
/// # assert_ne!(wall.mips, CrackMips::Auto);
/// ```
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[type_path = "bevy_crack"]
#[reflect(Default)]
pub enum CrackMips {
    /// If its picture has them, so that it looks as before from afar.
    #[default]
    Auto,
    /// Whether its picture has them or not.
    Always,
    /// The textures alone.
    Never,
}

/// Size of a surface's textures.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[type_path = "bevy_crack"]
pub enum CrackResolution {
    /// As its picture; with more columns or rows where it is shown stretched by more than 1.4, so that the cracks are not, by the sprite's
    /// `custom_size`, the mesh's texture coordinates or a scale that stretches it. That is seen to when the textures are made, as far as two
    /// million texels and the memory allow, and not for sprites with a `rect` or an atlas, nor for pictures whose sampler shows texels as
    /// squares. Where a sprite repeats its picture or shows it in nine parts, as many texels as it shows of it, up to two million. Without a picture,
    /// 512 texels along the longer side, or 256 along the shorter one if that is more.
    ///
    /// A texel takes 14 to 24 bytes in all, and for a coin [`Fixed`](Self::Fixed) of 64 x 64 is plenty.
    #[default]
    Picture,
    /// This size, the picture being resampled; cracks are stretched with a picture that is. Sprites with a `rect` or an atlas keep the size of their picture.
    Fixed(UVec2),
}

/// Which maps of a surface are written; by default all of them.
///
/// With a look that [glows](crate::paint::Look::glow) when a surface first cracks, 3D meshes whose material has no emissive picture of its own get an
/// emissive map as well.
#[derive(Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[type_path = "bevy_crack"]
#[reflect(Default)]
pub struct CrackMaps {
    /// The picture itself.
    pub diffuse: bool,
    /// Normals, tangent space.
    pub normal: bool,
    /// Depth for parallax mapping: 3D meshes only.
    pub depth: bool,
}

impl Default for CrackMaps {
    fn default() -> Self {
        Self { diffuse: true, normal: true, depth: true }
    }
}
