//! [`CrackPlaces`]: from points of a crack to points of the world.

#[cfg(feature = "2d")]
use crate::plugin::carrier::sprite;
use crate::plugin::{carrier::mesh::place_of, carrier::space};
#[cfg(feature = "2d")]
use bevy::sprite::Anchor;
use bevy::{ecs::system::SystemParam, prelude::*};

/// A place on a surface, in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrackPlace {
    /// Where it is.
    pub position: Vec3,
    /// The way the surface faces there, a unit vector.
    pub normal: Vec3,
}

/// Where points of a crack are in the world: for the dust at [`CrackTip::uv`](crate::plugin::CrackTip::uv) and the grains at
/// [`CellClosed::uv`](crate::plugin::CellClosed::uv).
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// fn dust(walls: Query<(Entity, &CrackState)>, places: CrackPlaces, mut commands: Commands) {
///     for (wall, state) in &walls {
///         for tip in &state.tips {
///             if let Some(CrackPlace { position, normal }) = places.at(wall, tip.uv) {
///                 commands.spawn(Transform::from_translation(position + 0.1 * normal));
///             }
///         }
///     }
/// }
/// ```
#[derive(SystemParam)]
pub struct CrackPlaces<'w, 's> {
    transforms: Query<'w, 's, &'static GlobalTransform>,
    meshes: Option<Res<'w, Assets<Mesh>>>,
    #[cfg(feature = "2d")]
    sprites: Query<'w, 's, (&'static Sprite, Option<&'static Anchor>)>,
    #[cfg(feature = "2d")]
    images: Option<Res<'w, Assets<Image>>>,
    #[cfg(feature = "2d")]
    layouts: Option<Res<'w, Assets<TextureAtlasLayout>>>,
    #[cfg(feature = "2d")]
    flat: Query<'w, 's, &'static Mesh2d>,
    #[cfg(feature = "3d")]
    solid: Query<'w, 's, &'static Mesh3d>,
}

impl CrackPlaces<'_, '_> {
    /// The place at `uv` (0..=1, v down) of a surface's picture or sprite frame, as transforms were last propagated.
    ///
    /// `None` if the entity is no surface or its picture or mesh is not there. On a mesh: in the triangle whose own coordinates
    /// (`UV_0`) hold `uv`, all of them being looked at; if there are some, in that with the least of the picture, or the first of them. A
    /// material's `uv_transform` is not looked at.
    #[must_use]
    pub fn at(&self, entity: Entity, uv: Vec2) -> Option<CrackPlace> {
        let (local, normal) = self.local(entity, uv)?;
        let transform = self.transforms.get(entity).ok()?;
        // Normals of what is scaled turn the other way.
        let normal = (space::to_local(transform)?.matrix3.transpose() * normal).normalize_or_zero();
        let position = transform.transform_point(local);
        (position.is_finite() && normal.is_finite()).then_some(CrackPlace { position, normal })
    }

    fn local(&self, entity: Entity, uv: Vec2) -> Option<(Vec3, Vec3)> {
        #[cfg(feature = "2d")]
        if let Ok((sprite, anchor)) = self.sprites.get(entity) {
            let (size, uv) = (self.size(sprite)?, self.uv_in_sprite(sprite, uv));
            let flip = Vec2::new(if sprite.flip_x { -1.0 } else { 1.0 }, if sprite.flip_y { 1.0 } else { -1.0 });
            let anchor = anchor.filter(|_| !sprite::is_anchor_ignored(sprite)).map_or(Vec2::ZERO, Anchor::as_vec);
            return Some(((((uv - 0.5) * flip - anchor) * size).extend(0.0), Vec3::Z));
        }
        let mesh = None;
        #[cfg(feature = "2d")]
        let mesh = mesh.or_else(|| self.flat.get(entity).ok().map(|mesh| &mesh.0));
        #[cfg(feature = "3d")]
        let mesh = mesh.or_else(|| self.solid.get(entity).ok().map(|mesh| &mesh.0));
        place_of(self.meshes.as_ref()?.get(mesh?)?, uv)
    }

    /// From the texels that a sprite shows of its picture to all that it is to show: what the picture's edge cuts off is missing.
    #[cfg(feature = "2d")]
    fn uv_in_sprite(&self, sprite: &Sprite, uv: Vec2) -> Vec2 {
        let part = sprite::part(sprite, self.layouts.as_deref());
        let image = self.images.as_ref().and_then(|images| images.get(&sprite.image));
        let (Some(part), Some(image)) = (part, image) else { return uv };
        let URect { min, max } = sprite::texels(part).intersect(URect { min: UVec2::ZERO, max: image.size() });
        let seen = Rect { min: min.as_vec2(), max: max.as_vec2() };
        if seen == part { uv } else { (seen.min + uv * seen.size() - part.min) / part.size() }
    }

    /// Size of a sprite in its own space.
    #[cfg(feature = "2d")]
    fn size(&self, sprite: &Sprite) -> Option<Vec2> {
        if let Some(size) = sprite.custom_size {
            return Some(size);
        }
        if let Some(rect) = sprite.rect {
            return Some(rect.size());
        }
        match &sprite.texture_atlas {
            Some(atlas) => {
                self.layouts.as_ref()?.get(&atlas.layout)?.textures.get(atlas.index).map(|rect| rect.size().as_vec2())
            }
            None => self.images.as_ref()?.get(&sprite.image).map(Image::size_f32),
        }
    }
}
