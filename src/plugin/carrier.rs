//! [`Carrier`]: what shows a surface's pictures, a sprite or a material.

use super::{
    CrackError, CrackSurface, CrackTextures, HitPoint, Shard, layout::Layout, preset, queue::QueuedHit, shards::Plane,
    surfaces::Active, textures::Maps, warm::Asked,
};
use crate::{CrackPreset, raster::TexelRect};
use bevy::{
    asset::{UntypedAssetId, UntypedHandle},
    prelude::*,
};
#[cfg(feature = "2d")]
use bevy::{sprite::SpriteImageMode, sprite_render::TilemapChunk};
use std::sync::Arc;

/// What an entity shows.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shown {
    /// The sprite's image, or the material.
    pub(super) asset: UntypedHandle,
    pub(super) diffuse: Option<Handle<Image>>,
    pub(super) normal: Option<Handle<Image>>,
    pub(super) depth: Option<Handle<Image>>,
    /// The part of the image that is shown; `None` = all of it. Its size cannot change then.
    pub(super) rect: Option<URect>,
    /// How the picture is laid out, if it is not merely stretched.
    pub(super) layout: Option<Arc<Layout>>,
    /// The size that it was given, where there is no picture.
    pub(super) size: Option<Vec2>,
    /// Maps that it can make use of.
    pub(super) maps: Maps,
}

impl Shown {
    /// The texels that it shows of a picture of this size; `None` if there are none. All that is to be known of a part of a picture goes
    /// through here: a `rect` may lie anywhere, and a frame of an atlas may be cut off by the sheet's edge.
    pub(super) fn texels(&self, size: UVec2) -> Option<TexelRect> {
        let whole = TexelRect::whole(size);
        let seen = self.rect.map_or(whole, |URect { min, max }| TexelRect { min, max }.intersect(whole));
        (!seen.is_empty()).then_some(seen)
    }

    pub(super) fn pictures(&self) -> impl Iterator<Item = &Handle<Image>> {
        [&self.diffuse, &self.normal, &self.depth].into_iter().flatten()
    }

    /// Whether the same pictures are shown, as large a part of them, wherever that lies: another frame of an animation.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let moved = Self { rect: other.rect, size: other.size, ..self.clone() };
        let size = |shown: &Self| shown.rect.map(|URect { min, max }| max.saturating_sub(min));
        let is_as_large = size(self) == size(other);
        moved == *other && is_as_large && (self.diffuse.is_some() || self.size == other.size)
    }
}

/// What a look at an entity finds.
#[cfg_attr(not(any(feature = "2d", feature = "3d")), expect(dead_code, reason = "there are no kinds then"))]
pub(super) enum Found {
    /// Something of another kind.
    Other,
    /// Something whose assets are not there yet.
    Waiting,
    Shown(Box<Shown>),
    Unusable(CrackError),
}

/// How to deal with one kind of carrier.
pub(super) struct Kind {
    pub(super) inspect: fn(&World, Entity) -> Found,
    /// Makes the entity show `textures`; called again when they have changed.
    pub(super) attach: fn(&mut World, Entity, &mut Carrier, &CrackTextures, relief: f32),
    /// Whether the renderer can draw what is asked. If not, it is asked to.
    pub(super) looks: fn(&mut World, Entity, &Asked<'_>) -> bool,
    /// Gives back what the entity showed before.
    pub(super) detach: fn(&mut World, Entity, &Carrier),
    /// Width of the whole picture over its height, as it is shown in the world, the picture having this size and the crate having given
    /// that to a sprite; `None` where there is no telling.
    pub(super) aspect: fn(&World, Entity, picture: Option<Vec2>, given: Option<Vec2>) -> Option<f32>,
    /// Whether its textures are to hold the picture twice, see [`Faces`](super::faces::Faces).
    pub(super) is_twofold: fn(&World, Entity) -> bool,
    /// Says where a hit lands, having chosen what of it cracks if it has no cracks yet.
    pub(super) aim: fn(&mut World, Entity, &QueuedHit, is_blank: bool) -> HitPoint,
    /// Texture coordinates in the shown part of a point in the entity's own space.
    pub(super) locate: fn(&World, Entity, Vec3) -> Result<Vec2, &'static str>,
    /// Looks whether the mesh can show normals.
    pub(super) check_mesh: fn(&World, Entity) -> Result<(), CrackError>,
    /// Whether its shards have thickness.
    pub(super) is_solid: bool,
    /// Where its picture lies in the entity's own space, if that is flat.
    pub(super) plane: fn(&World, Entity, &Active) -> Result<Plane, &'static str>,
    /// Makes what it shows transparent where its texture is, or has no holes any more.
    pub(super) open: fn(&mut World, Entity, &Carrier, has_holes: bool),
    /// The material of its shards, with the picture given, so much of it being there (0..=1).
    pub(super) shard_material: fn(&mut World, Entity, &Carrier, &Handle<Image>, f32) -> Option<UntypedHandle>,
    /// The material of their sides, if they have any, of a picture of this mean colour (sRGB).
    pub(super) inside: fn(&mut World, &Carrier, [f32; 3], f32) -> Option<UntypedHandle>,
    /// Makes entities of shards; `None` where their surface has gone meanwhile.
    pub(super) spawn: fn(&mut World, Vec<(Shard, Clothes)>) -> Vec<Option<Entity>>,
    /// The same for their sides.
    pub(super) spawn_sides: fn(&mut World, Vec<Clothes>) -> Vec<Option<Entity>>,
    /// Makes a shard, or the sides of one, of an entity that was one.
    pub(super) dress: fn(&mut EntityWorldMut, Option<Shard>, Clothes),
    /// Gives a shard another material.
    pub(super) change: fn(&mut EntityWorldMut, &UntypedHandle),
    /// Takes what makes it a shard from an entity, and the material.
    pub(super) undress: fn(&mut EntityWorldMut),
}

/// What a shard or its sides are shown with.
#[cfg_attr(not(any(feature = "2d", feature = "3d")), expect(dead_code, reason = "there are no kinds then"))]
pub(super) struct Clothes {
    pub(super) parent: Entity,
    pub(super) place: Transform,
    pub(super) mesh: Handle<Mesh>,
    pub(super) material: UntypedHandle,
}

/// All kinds, the first that fits is taken.
pub(super) const KINDS: &[Kind] = &[
    #[cfg(feature = "2d")]
    super::sprite::KIND,
    #[cfg(feature = "2d")]
    super::material::kind::<MeshMaterial2d<ColorMaterial>>(),
    #[cfg(feature = "2d")]
    super::material::kind::<MeshMaterial2d<super::CrackLitMaterial>>(),
    #[cfg(feature = "3d")]
    super::material::kind::<MeshMaterial3d<StandardMaterial>>(),
];

/// What shows the pictures of a surface, and what it showed before.
pub(super) struct Carrier {
    pub(super) kind: &'static Kind,
    /// What it showed before.
    pub(super) shown: Shown,
    /// The sprite's image or the material that it shows now; `None` = as before.
    pub(super) own: Option<UntypedHandle>,
    /// The mesh before, and the mesh with tangents.
    pub(super) mesh: Option<(Handle<Mesh>, Handle<Mesh>)>,
    /// The size that was given to the sprite.
    pub(super) size: Option<Vec2>,
    /// Whether its textures hold the picture twice, one above the other: the upper one cracks.
    pub(super) is_twofold: bool,
    /// How the sprite laid out its picture, if its texture has it laid out.
    #[cfg(feature = "2d")]
    pub(super) mode: Option<SpriteImageMode>,
}

impl Carrier {
    /// It still shows what it showed.
    pub(super) fn new(kind: &'static Kind, shown: Shown) -> Self {
        Self {
            kind,
            shown,
            own: None,
            mesh: None,
            size: None,
            is_twofold: false,
            #[cfg(feature = "2d")]
            mode: None,
        }
    }

    /// What of textures of this size cracks where all of a picture is shown.
    pub(super) fn whole(&self, texels: UVec2) -> TexelRect {
        TexelRect::whole(if self.is_twofold { UVec2::new(texels.x, texels.y / 2) } else { texels })
    }

    /// Ids of the pictures it was made from.
    pub(super) fn sources(&self) -> impl Iterator<Item = AssetId<Image>> + '_ {
        self.shown.pictures().map(Handle::id)
    }

    /// Ids of the assets made for it, besides textures.
    pub(super) fn owned(&self) -> impl Iterator<Item = UntypedAssetId> + '_ {
        self.own.iter().map(UntypedHandle::id).chain(self.mesh.iter().map(|(_, own)| own.id().untyped()))
    }

    /// Whether `asset` is what the entity should show.
    pub(super) fn is_showing(&self, asset: &UntypedHandle) -> bool {
        asset.id() == self.own.as_ref().unwrap_or(&self.shown.asset).id()
    }
}

/// A handle as one of assets of this type, if it is one.
#[cfg_attr(not(any(feature = "2d", feature = "3d")), expect(dead_code, reason = "there are no kinds then"))]
pub(super) fn typed<A: Asset>(handle: &UntypedHandle) -> Option<Handle<A>> {
    handle.clone().try_typed().ok()
}

/// What the entity shows, and how to deal with it.
pub(super) fn inspect(world: &World, entity: Entity) -> (Option<&'static Kind>, Found) {
    for kind in KINDS {
        match (kind.inspect)(world, entity) {
            Found::Other => {}
            found => return (Some(kind), found),
        }
    }
    #[cfg(feature = "2d")]
    if world.get::<TilemapChunk>(entity).is_some() {
        return (None, Found::Unusable(CrackError::Tilemap));
    }
    (None, Found::Unusable(CrackError::NothingToCrack))
}

/// A surface that has not cracked.
pub(super) struct Untouched {
    pub(super) surface: CrackSurface,
    pub(super) preset: CrackPreset,
    pub(super) kind: &'static Kind,
    pub(super) shown: Shown,
}

/// What the entity is made of; `None` if some of it is not there yet.
pub(super) fn untouched(world: &World, entity: Entity) -> Result<Option<Untouched>, CrackError> {
    // Removed since it was asked for: the hook has dropped its hits, unless they came in between.
    let Some(surface) = world.get::<CrackSurface>(entity).cloned() else { return Err(CrackError::NothingToCrack) };
    if !world.contains_resource::<Assets<Image>>() {
        return Err(CrackError::NoImages);
    }
    let (kind, shown) = match inspect(world, entity) {
        (Some(kind), Found::Shown(shown)) => (kind, *shown),
        (_, Found::Waiting) => return Ok(None),
        (_, Found::Unusable(error)) => return Err(error),
        _ => return Err(CrackError::NothingToCrack),
    };
    let preset = preset::resolve(world, &surface.preset)?;
    Ok(preset.map(|preset| Untouched { surface, preset, kind, shown }))
}
