//! [`CrackTextures`]: a surface's own textures.

use super::CrackMaps;
use crate::paint::Look;
use bevy::prelude::*;

/// The private textures of a cracked surface, for materials of your own. Written by the crate, gone after healing.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// /// Tells a material of one's own what to show.
/// fn show(walls: Query<(Entity, &CrackTextures), Changed<CrackTextures>>) {
///     for (wall, textures) in &walls {
///         info!("{wall} shows {:?}, one of {} textures", textures.diffuse, textures.handles().count());
///     }
/// }
///
/// let textures = CrackTextures { diffuse: Some(Handle::default()), ..default() };
/// assert!(textures.handles().eq(textures.diffuse.iter()));
/// # bevy::ecs::system::assert_is_system(show);
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default)]
#[component(clone_behavior = Ignore)]
pub struct CrackTextures {
    /// The picture with its cracks, `Rgba8UnormSrgb`.
    #[reflect(skip_serializing)]
    pub diffuse: Option<Handle<Image>>,
    /// Tangent-space normals, +Y up, `Rgba8Unorm`.
    #[reflect(skip_serializing)]
    pub normal: Option<Handle<Image>>,
    /// Depth, `R8Unorm`, white = deep.
    #[reflect(skip_serializing)]
    pub depth: Option<Handle<Image>>,
    /// The light that cracks give off, `Rgba8UnormSrgb`, black where there is none.
    #[reflect(skip_serializing)]
    pub emissive: Option<Handle<Image>>,
}

impl CrackTextures {
    /// The textures there are.
    pub fn handles(&self) -> impl Iterator<Item = &Handle<Image>> {
        self.all().into_iter().flatten()
    }

    /// Diffuse, normal, depth, emissive.
    pub(crate) fn all(&self) -> [Option<&Handle<Image>>; MAPS] {
        [self.diffuse.as_ref(), self.normal.as_ref(), self.depth.as_ref(), self.emissive.as_ref()]
    }
}

/// Kinds of textures.
pub(crate) const MAPS: usize = 4;

/// Which textures a surface has, or could have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Maps {
    pub(crate) diffuse: bool,
    pub(crate) normal: bool,
    pub(crate) depth: bool,
    pub(crate) emissive: bool,
    /// Whether they have mip levels.
    pub(crate) mips: bool,
}

impl Maps {
    /// Those that are to be written with a look; with mip levels, unless the surface is to have none.
    pub(crate) fn wanted(CrackMaps { diffuse, normal, depth }: CrackMaps, look: &Look) -> Self {
        Self { diffuse, normal, depth, emissive: !look.glow.is_empty(), mips: true }
    }

    /// Those that are in both.
    pub(crate) const fn and(self, other: Self) -> Self {
        Self {
            diffuse: self.diffuse && other.diffuse,
            normal: self.normal && other.normal,
            depth: self.depth && other.depth,
            emissive: self.emissive && other.emissive,
            mips: self.mips && other.mips,
        }
    }
}
