//! [`CrackError`]: why a surface cannot crack.

use bevy::prelude::*;
use std::fmt;

/// Why a surface cannot crack.
#[derive(Clone, Debug, PartialEq, Reflect, thiserror::Error)]
#[type_path = "bevy_crack"]
#[non_exhaustive]
pub enum CrackError {
    /// It has neither a sprite nor a material that the crate knows.
    #[error(
        "it has no `Sprite`, `MeshMaterial2d<ColorMaterial>`, `MeshMaterial2d<CrackLitMaterial>` or \
         `MeshMaterial3d<StandardMaterial>` (or the feature `2d` or `3d` is off)"
    )]
    NothingToCrack,
    /// It is a chunk of a tilemap, whose tiles share the texels of their tileset.
    #[error(
        "it is a `TilemapChunk`, whose tiles share the texels of their tileset: make it a member of a group (`CrackMemberOf`) that \
         has the `CrackSurface`; or, for one tile, take it out of its `TilemapChunkTileData` and put a `Sprite` (or a `Mesh2d`) of it \
         in its place, at `TilemapChunk::calculate_tile_transform`, with the `CrackSurface`"
    )]
    Tilemap,
    /// The members of its group cannot be put together.
    #[error("its group cannot be shown as one: {reason}")]
    Group {
        /// What is in the way.
        reason: String,
    },
    /// There is no place for images.
    #[error("there are no image assets: add `AssetPlugin` and `ImagePlugin`")]
    NoImages,
    /// There is no place for materials.
    #[error("there are no assets of `{material}`: add the plugin that brings them")]
    NoMaterials {
        /// Name of the type.
        material: String,
    },
    /// The picture failed to load.
    #[error("its picture failed to load: {reason}")]
    LoadFailed {
        /// What the asset server said.
        reason: String,
    },
    /// The picture is in GPU memory only.
    #[error("its picture has no data on the CPU: load it with `RenderAssetUsages::MAIN_WORLD`")]
    NoCpuData,
    /// The picture's format cannot be read.
    #[error("its picture has the format {format}: load it uncompressed, two-dimensional, with one layer")]
    UnsupportedFormat {
        /// Name of the format.
        format: String,
    },
    /// The picture's data is not as long as its size and format say.
    #[error("its picture has {actual} bytes of data, its size and format need {expected}")]
    DataLength {
        /// Bytes needed.
        expected: u64,
        /// Bytes there.
        actual: u64,
    },
    /// The picture or the frame of the sprite has no texels, or too many.
    #[error(
        "a picture of {width} x {height} texels cannot crack: empty, or shown in parts (`rect`, atlas) and larger than \
         `CrackBudget::max_side` or the device allows"
    )]
    Size {
        /// Width, texels.
        width: u32,
        /// Height, texels.
        height: u32,
    },
    /// The sprite shows a part of its picture (`Sprite::rect`, an atlas) that has no texels, or lies beyond it.
    #[error(
        "it shows the texels from {min} to {max} of a picture of {size}: there are none (see `Sprite::rect` and its atlas)"
    )]
    Part {
        /// First column and row.
        min: UVec2,
        /// One past the last column and row.
        max: UVec2,
        /// Size of the picture, texels.
        size: UVec2,
    },
    /// The sprite is scaled into its size, or it is sliced or tiled and shows a part of its picture.
    #[error(
        "`SpriteImageMode` {mode} is not supported here: use `Auto`, or `Sliced` or `Tiled` without `rect` and atlas"
    )]
    SpriteMode {
        /// Name of the mode.
        mode: String,
    },
    /// Not enough of [`CrackBudget::max_texture_bytes`](super::CrackBudget::max_texture_bytes) is left.
    #[error("its textures need {needed} bytes, the budget has {left} left")]
    TextureBudget {
        /// Bytes needed at the least resolution.
        needed: u64,
        /// Bytes left.
        left: u64,
    },
    /// The mesh is broken, so that the engine could not make tangents for it.
    #[error("its mesh has no tangents, and none can be made: {reason}")]
    Mesh {
        /// What is wrong with it.
        reason: String,
    },
    /// A number of [`GuidedCracks`](super::GuidedCracks) is out of its range, or not finite.
    #[error("`{field}` is {value}, must lie in {min}..={max}")]
    OutOfRange {
        /// Name of the field, as in `appearance.seconds`.
        field: String,
        /// Its value.
        value: f32,
        /// Least value allowed.
        min: f32,
        /// Greatest value allowed.
        max: f32,
    },
    /// A guide of [`GuidedCracks`](super::GuidedCracks) cannot be read.
    #[error("guide number {index} cannot be used: {reason}")]
    Guide {
        /// Its index.
        index: usize,
        /// Why.
        reason: String,
    },
    /// The bake of [`GuidedCracks`](super::GuidedCracks) failed.
    #[error("the bake failed: {reason}")]
    Bake {
        /// Which one and why.
        reason: String,
    },
    /// A [`CrackRecord`](super::CrackRecord) cannot be taken up.
    #[error("its record cannot be used: {reason}")]
    Record {
        /// Why.
        reason: String,
    },
    /// A [`CrackRelief`](super::CrackRelief) cannot be made.
    #[error("its relief cannot be made: {reason}")]
    Relief {
        /// Why.
        reason: String,
    },
    /// A [`CrackAnalogy`](super::CrackAnalogy) cannot be made.
    #[error("its cracks cannot be those of photographs: {reason}")]
    Analogy {
        /// Why.
        reason: String,
    },
    /// Its textures could not be made.
    #[error("its textures could not be made: {reason}")]
    Textures {
        /// Why.
        reason: String,
    },
    /// A parameter of the preset is out of its range.
    #[error("{reason}")]
    Preset {
        /// Which one and why.
        reason: String,
    },
}

/// An entity as warnings call it: by its `Name`, if it has one.
pub(crate) struct EntityLabel<'a> {
    pub(crate) entity: Entity,
    pub(crate) name: Option<&'a Name>,
}

impl<'a> EntityLabel<'a> {
    pub(crate) fn of(world: &'a World, entity: Entity) -> Self {
        Self { entity, name: world.get(entity) }
    }
}

impl fmt::Display for EntityLabel<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name {
            Some(name) => write!(f, "{name} ({})", self.entity),
            None => self.entity.fmt(f),
        }
    }
}
