//! [`Carrier`]: what shows a surface's pictures, and the trait of its kinds.

use super::plane::Plane;
use super::shard_visual::ShardVisuals;
use super::slot::SideLook;
use crate::plugin::api::error::CrackError;
use crate::plugin::api::hit::HitPoint;
use crate::plugin::api::textures::{CrackTextures, Maps};
use crate::plugin::source::layout::Layout;
use crate::plugin::source::unfolding::Unfolding;
use crate::raster::TexelRect;
use crate::shatter::ShellTriangle;
#[cfg(feature = "2d")]
use bevy::sprite::SpriteImageMode;
use bevy::{
    asset::{UntypedAssetId, UntypedHandle},
    prelude::*,
};
use std::sync::Arc;

/// What an entity shows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shown {
    /// The sprite's image, or the material.
    pub(crate) asset: UntypedHandle,
    pub(crate) diffuse: Option<Handle<Image>>,
    pub(crate) normal: Option<Handle<Image>>,
    pub(crate) depth: Option<Handle<Image>>,
    /// The part of the image that is shown; `None` = all of it. Its size cannot change then.
    pub(crate) rect: Option<URect>,
    /// How the picture is laid out, if it is not merely stretched.
    pub(crate) layout: Option<Arc<Layout>>,
    /// The size that it was given, where there is no picture.
    pub(crate) size: Option<Vec2>,
    /// Maps that it can make use of.
    pub(crate) maps: Maps,
}

impl Shown {
    /// The texels that it shows of a picture of this size; `None` if there are none. All that is to be known of a part of a picture goes
    /// through here: a `rect` may lie anywhere, and a frame of an atlas may be cut off by the sheet's edge.
    pub(crate) fn texels(&self, size: UVec2) -> Option<TexelRect> {
        let whole = TexelRect::whole(size);
        let seen = self.rect.map_or(whole, |URect { min, max }| TexelRect { min, max }.intersect(whole));
        (!seen.is_empty()).then_some(seen)
    }

    pub(crate) fn pictures(&self) -> impl Iterator<Item = &Handle<Image>> {
        [&self.diffuse, &self.normal, &self.depth].into_iter().flatten()
    }

    /// Whether the same pictures are shown, as large a part of them, wherever that lies: another frame of an animation.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let moved = Self { rect: other.rect, size: other.size, ..self.clone() };
        let size = |shown: &Self| shown.rect.map(|URect { min, max }| max.saturating_sub(min));
        let is_as_large = size(self) == size(other);
        moved == *other && is_as_large && (self.diffuse.is_some() || self.size == other.size)
    }
}

/// What a look at an entity finds.
#[cfg_attr(not(any(feature = "2d", feature = "3d")), expect(dead_code, reason = "there are no kinds then"))]
pub(crate) enum Found {
    /// Something of another kind.
    Other,
    /// Something whose assets are not there yet.
    Waiting,
    Shown(Box<Shown>),
    Unusable(CrackError),
}

/// How to deal with one kind of carrier.
pub(crate) trait CarrierKind: Send + Sync {
    /// What the entity shows, if it is of this kind.
    fn inspect(&self, world: &World, entity: Entity) -> Found;

    /// Makes the entity show `textures`; called again when they have changed. `relief` is the depth of a crack in units of the texture.
    fn attach(&self, world: &mut World, entity: Entity, carrier: &mut Carrier, textures: &CrackTextures, relief: f32);

    /// Gives back what the entity showed before.
    fn detach(&self, world: &mut World, entity: Entity, carrier: &Carrier);

    /// Whether the renderer can draw the entity with another look. If not, it is asked to make what it needs.
    fn can_draw(&self, world: &mut World, entity: Entity, look: &NextLook<'_>) -> bool;

    /// Width of the whole picture over its height, as it is shown in the world. The picture has the size `picture`; `given` is the size
    /// that the crate has given to a sprite. `None` where it cannot be told.
    fn aspect(&self, world: &World, entity: Entity, picture: Option<Vec2>, given: Option<Vec2>) -> Option<f32>;

    /// Whether the textures hold the picture twice: see `faces`.
    fn is_twofold(&self, _world: &World, _entity: Entity) -> bool {
        false
    }

    /// Whether its mesh is laid out flat, or is to stay as it is; `None` if that was not asked yet.
    fn poll_unfold(&self, _world: &mut World, _entity: Entity) -> Option<bool> {
        Some(true)
    }

    /// Has a mesh laid out flat, if that is of use; `false` if that is under way.
    fn unfold(&self, _world: &mut World, _entity: Entity, _order: &UnfoldOrder) -> bool {
        true
    }

    /// Gives up the layout of a mesh that has not cracked.
    fn forget_layout(&self, _world: &mut World, _entity: Entity) {}

    /// How its mesh is laid out, if it is.
    fn unfolding(&self, _world: &World, _entity: Entity) -> Option<Arc<Unfolding>> {
        None
    }

    /// Where a hit lands. `point` is the same place in the entity's own space, if it is known. Chooses what of the entity cracks if it `is_blank`.
    fn aim(
        &self,
        _world: &mut World,
        _entity: Entity,
        at: HitPoint,
        _point: Option<Vec3>,
        _is_blank: bool,
    ) -> HitPoint {
        at
    }

    /// Texture coordinates in the shown part of a point in the entity's own space. `size` is that of the cracked surface, texels, if there
    /// is one.
    fn locate(&self, world: &World, entity: Entity, local: Vec3, size: Option<UVec2>) -> Result<Vec2, &'static str>;

    /// Checks whether the mesh can show normals.
    fn check_mesh(&self, _world: &World, _entity: Entity) -> Result<(), CrackError> {
        Ok(())
    }

    /// Where the picture lies in the entity's own space, if it is flat. `seen` is the part of its texture that it shows.
    fn plane(&self, world: &World, entity: Entity, seen: TexelRect) -> Result<Plane, &'static str>;

    /// The plane in which a place of a mesh lies that is laid out flat; what is nearby lies there as it is laid out. `texel` is a place of
    /// the layout.
    fn plane_at(&self, _world: &World, _entity: Entity, _texel: Vec2) -> Option<Plane> {
        None
    }

    /// The triangles of a mesh that is laid out flat, in the entity's own space.
    fn triangles(&self, _world: &World, _entity: Entity) -> Option<Vec<ShellTriangle>> {
        None
    }

    /// The place of the layout, texels, of texture coordinates of the picture that a mesh had before it was laid out.
    fn texel_of(&self, _world: &World, _entity: Entity, _uv: Vec2) -> Option<Vec2> {
        None
    }

    /// Makes what it shows transparent where its texture is, or has no holes any more.
    fn open(&self, _world: &mut World, _entity: Entity, _carrier: &Carrier, _has_holes: bool) {}

    /// Whether its shards have thickness.
    fn is_solid(&self) -> bool {
        false
    }

    /// The material of its shards, with the picture given, `opacity` (0..=1) of it being there.
    fn shard_material(
        &self,
        world: &mut World,
        entity: Entity,
        carrier: &Carrier,
        picture: &Handle<Image>,
        opacity: f32,
    ) -> Option<UntypedHandle>;

    /// The material of the sides of its shards, if they have any.
    fn side_material(&self, _world: &mut World, _carrier: &Carrier, _look: &SideLook) -> Option<UntypedHandle> {
        None
    }

    /// The entities of its shards.
    fn shards(&self) -> &'static dyn ShardVisuals;
}

/// How a mesh is to be laid out.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "3d"), expect(dead_code, reason = "only 3D meshes are laid out"))]
pub(crate) struct UnfoldOrder {
    /// Where it is hit, and the same place in the entity's own space if that is known.
    pub(crate) hit: Option<(HitPoint, Option<Vec3>)>,
    /// Whether fewer texels than its picture has are better than none.
    pub(crate) must: bool,
    /// The most texels, and the most of a side.
    pub(crate) most_texels: u64,
    pub(crate) most_side: u32,
    /// Whether it is made in this frame.
    pub(crate) at_once: bool,
    /// The id that it gets.
    pub(crate) id: u64,
}

/// What shows the pictures of a surface, and what it showed before.
pub(crate) struct Carrier {
    pub(crate) kind: &'static dyn CarrierKind,
    /// Whether its shards have thickness.
    pub(crate) is_solid: bool,
    /// What it showed before.
    pub(crate) shown: Shown,
    /// What somebody has given it since, until its cracks are on that.
    pub(crate) next: Option<Box<Shown>>,
    /// The sprite's image or the material that it shows now; `None` = as before.
    pub(crate) own: Option<UntypedHandle>,
    /// The mesh before, and the mesh with tangents.
    pub(crate) mesh: Option<(Handle<Mesh>, Handle<Mesh>)>,
    /// The size that was given to the sprite.
    pub(crate) size: Option<Vec2>,
    /// Whether its textures hold the picture twice, one above the other: the upper one cracks.
    pub(crate) is_twofold: bool,
    /// How its mesh is laid out in its textures, if it is.
    pub(crate) unfolding: Option<Arc<Unfolding>>,
    /// How the sprite laid out its picture, if its texture has it laid out.
    #[cfg(feature = "2d")]
    pub(crate) mode: Option<SpriteImageMode>,
}

impl Carrier {
    /// It still shows what it showed.
    pub(crate) fn new(kind: &'static dyn CarrierKind, shown: Shown) -> Self {
        Self {
            kind,
            is_solid: kind.is_solid(),
            shown,
            next: None,
            own: None,
            mesh: None,
            size: None,
            is_twofold: false,
            unfolding: None,
            #[cfg(feature = "2d")]
            mode: None,
        }
    }

    /// What of textures of this size cracks where all of a picture is shown.
    pub(crate) fn whole(&self, texels: UVec2) -> TexelRect {
        TexelRect::whole(if self.is_twofold { UVec2::new(texels.x, texels.y / 2) } else { texels })
    }

    /// Ids of the pictures it was made from.
    pub(crate) fn sources(&self) -> impl Iterator<Item = AssetId<Image>> + '_ {
        self.shown.pictures().map(Handle::id)
    }

    /// Ids of the assets made for it, unmeasured textures.
    pub(crate) fn owned(&self) -> impl Iterator<Item = UntypedAssetId> + '_ {
        self.own.iter().map(UntypedHandle::id).chain(self.mesh.iter().map(|(_, own)| own.id().untyped()))
    }

    /// Gives back what an entity showed before, or what it was to show next.
    pub(crate) fn give_back(&mut self, world: &mut World, entity: Entity) {
        if let Some(next) = self.next.take() {
            let before = core::mem::replace(&mut self.shown, *next);
            self.kind.detach(world, entity, self);
            self.next = Some(Box::new(core::mem::replace(&mut self.shown, before)));
        } else {
            self.kind.detach(world, entity, self);
        }
    }

    /// Whether it may go on showing what it does until its cracks are on other pictures that somebody has given it. A part of a picture, or
    /// one that is laid out, does not fit what it shows.
    pub(crate) fn may_wait_for(&self, other: &Shown) -> bool {
        let is_plain = |shown: &Shown| shown.rect.is_none() && shown.layout.is_none();
        let is_of_its_kind = self.shown.asset.type_id() == other.asset.type_id();
        is_of_its_kind && is_plain(&self.shown) && is_plain(other) && !self.is_twofold && self.unfolding.is_none()
    }

    /// Whether `asset` is what the entity should show.
    pub(crate) fn is_showing(&self, asset: &UntypedHandle) -> bool {
        asset.id() == self.own.as_ref().unwrap_or(&self.shown.asset).id()
    }
}

/// What a surface is going to look like.
#[cfg_attr(not(any(feature = "2d", feature = "3d")), expect(dead_code, reason = "there are no kinds then"))]
pub(crate) enum NextLook<'a> {
    /// It shows these maps.
    Cracked(Maps),
    /// It has holes, and there are shards.
    Broken {
        maps: Maps,
        /// What it showed before it cracked.
        original: &'a UntypedHandle,
        has_rims: bool,
        /// The material of their sides, if one was given.
        inside: Option<UntypedHandle>,
    },
}
