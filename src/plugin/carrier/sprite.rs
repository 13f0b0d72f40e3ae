//! Sprites as carriers.

use super::kind::{Carrier, CarrierKind, Found, NextLook, Shown};
use super::pipelines::{self, Shape};
use super::plane::Plane;
use super::shard_visual::{MaterialVisuals, ShardVisuals};
use super::slot::typed;
use crate::plugin::api::error::CrackError;
use crate::plugin::api::textures::{CrackTextures, Maps};
use crate::plugin::source::layout::Layout;
use crate::raster::TexelRect;
use bevy::{
    asset::UntypedHandle,
    math::Mat3A,
    prelude::*,
    sprite::{Anchor, SliceScaleMode},
};
use std::sync::Arc;

/// Sprites. Their shards are meshes.
pub(super) struct SpriteKind;

impl CarrierKind for SpriteKind {
    fn inspect(&self, world: &World, entity: Entity) -> Found {
        let Some(sprite) = world.get::<Sprite>(entity) else { return Found::Other };
        let is_part = sprite.rect.is_some() || sprite.texture_atlas.is_some();
        let refused = match sprite.image_mode {
            SpriteImageMode::Auto => None,
            SpriteImageMode::Sliced(_) => is_part.then_some("Sliced"),
            SpriteImageMode::Tiled { .. } => is_part.then_some("Tiled"),
            SpriteImageMode::Scale(_) => Some("Scale"),
        };
        if let Some(mode) = refused {
            return Found::Unusable(CrackError::SpriteMode { mode: mode.to_owned() });
        }
        let layouts = world.get_resource::<Assets<TextureAtlasLayout>>();
        if let Some(atlas) = &sprite.texture_atlas
            && !layouts.is_some_and(|layouts| layouts.contains(&atlas.layout))
        {
            return Found::Waiting;
        }
        let rect = part(sprite, layouts);
        // A sprite of one colour shows Bevy's white picture of one texel.
        let is_blank = sprite.image == Handle::default() && rect.is_none();
        Found::Shown(Box::new(Shown {
            asset: sprite.image.clone().untyped(),
            diffuse: (!is_blank).then(|| sprite.image.clone()),
            normal: None,
            depth: None,
            rect: rect.map(texels),
            layout: layout(&sprite.image_mode, sprite.custom_size).map(|layout| {
                // The engine ignores the anchor of such a sprite until it has a size of its own.
                let keeps_size = is_anchor_ignored(sprite) && anchor_of(world, entity) != Vec2::ZERO;
                Arc::new(Layout { keeps_size, ..layout })
            }),
            size: sprite.custom_size,
            maps: Maps { diffuse: true, normal: true, depth: false, emissive: false, mips: true },
        }))
    }

    fn attach(&self, world: &mut World, entity: Entity, carrier: &mut Carrier, textures: &CrackTextures, _relief: f32) {
        let Some(own) = &textures.diffuse else { return };
        carrier.own = Some(own.clone().untyped());
        let images = world.get_resource::<Assets<Image>>();
        let size = |handle: &Handle<Image>| images.and_then(|images| images.get(handle)).map(Image::size_f32);
        let (before, now) = (typed(&carrier.shown.asset).and_then(|before| size(&before)), size(own));
        let Some(mut sprite) = world.get_mut::<Sprite>(entity) else { return };
        sprite.image = own.clone();
        if carrier.shown.layout.is_some() {
            // Its texture has it laid out.
            let mode = core::mem::replace(&mut sprite.image_mode, WHOLE);
            if mode != WHOLE {
                carrier.mode = Some(mode);
            }
        }
        give_size_back(&mut sprite, carrier.size.take());
        // Textures of another size must not change the size of the sprite.
        if sprite.custom_size.is_none() && before != now {
            sprite.custom_size = before;
            carrier.size = before;
        }
    }

    fn detach(&self, world: &mut World, entity: Entity, carrier: &Carrier) {
        let Some(mut sprite) = world.get_mut::<Sprite>(entity) else { return };
        if carrier.is_showing(&sprite.image.clone().untyped())
            && let Some(before) = typed(&carrier.shown.asset)
        {
            sprite.image = before;
        }
        if let Some(mode) = carrier.mode.as_ref().filter(|_| sprite.image_mode == WHOLE) {
            sprite.image_mode = mode.clone();
        }
        give_size_back(&mut sprite, carrier.size);
    }

    /// With cracks it is a sprite as before.
    fn can_draw(&self, world: &mut World, entity: Entity, look: &NextLook<'_>) -> bool {
        let NextLook::Broken { has_rims, .. } = look else { return true };
        let material = ColorMaterial { texture: Some(Handle::default()), ..ColorMaterial::default() };
        let shape = Shape::Shard { has_colors: *has_rims, has_tangents: false };
        pipelines::can_draw::<MeshMaterial2d<ColorMaterial>>(world, entity, material, &shape)
    }

    fn aspect(&self, world: &World, entity: Entity, picture: Option<Vec2>, given: Option<Vec2>) -> Option<f32> {
        let size = world.get::<Sprite>(entity)?.custom_size.filter(|size| Some(*size) != given);
        let size = size.or(picture).unwrap_or(Vec2::ONE);
        let place = world.get::<GlobalTransform>(entity).map_or(Mat3A::IDENTITY, |place| place.affine().matrix3);
        Some((size.x * place.x_axis.length() / (size.y * place.y_axis.length())).abs())
    }

    fn locate(&self, world: &World, entity: Entity, local: Vec3, size: Option<UVec2>) -> Result<Vec2, &'static str> {
        let sprite = world.get::<Sprite>(entity).ok_or("the sprite is gone")?;
        let images = world.get_resource::<Assets<Image>>().ok_or("there are no images")?;
        let anchor = if is_anchor_ignored(sprite) { Vec2::ZERO } else { anchor_of(world, entity) };
        let none = Assets::default();
        let layouts = world.get_resource::<Assets<TextureAtlasLayout>>().unwrap_or(&none);
        let texel = sprite
            .compute_pixel_space_point(local.truncate(), Anchor(anchor), images, layouts)
            .map_err(|_| "the point lies off the sprite")?;
        let Found::Shown(shown) = self.inspect(world, entity) else { return Err("the sprite cannot be read") };
        let picture = images.get(&sprite.image).ok_or("the picture is gone")?.size();
        let seen = shown.texels(picture).ok_or("the sprite shows nothing of its picture")?;
        // Of frames that are not all of one size, the first one that was hit says how large the surface is.
        let size = size.filter(|_| shown.rect.is_some()).unwrap_or(seen.size());
        Ok((texel - seen.min.as_vec2()) / size.as_vec2())
    }

    fn plane(&self, world: &World, entity: Entity, seen: TexelRect) -> Result<Plane, &'static str> {
        let sprite = world.get::<Sprite>(entity).ok_or("the sprite is gone")?;
        let seen = Rect { min: seen.min.as_vec2(), max: seen.max.as_vec2() };
        let part = part(sprite, world.get_resource::<Assets<TextureAtlasLayout>>()).unwrap_or(seen);
        let size = sprite.custom_size.unwrap_or(part.size());
        let has_area = |size: Vec2| size.is_finite() && size.min_element() > 0.0;
        if !(has_area(size) && has_area(part.size())) {
            return Err("the sprite has no size");
        }
        let anchor = if is_anchor_ignored(sprite) { Vec2::ZERO } else { anchor_of(world, entity) };
        let flip = BVec2::new(sprite.flip_x, sprite.flip_y);
        // What the picture's edge cuts off is no part of the surface.
        let (shift, share) = ((seen.center() - part.center()) / part.size(), seen.size() / part.size());
        let aside = Vec2::select(flip, -shift, shift) * Vec2::new(1.0, -1.0);
        let (middle, size) = (((aside - anchor) * size).extend(0.0), size * share);
        Ok(Plane { middle, rotation: Quat::IDENTITY, size: Vec2::select(flip, -size, size), thickness: None })
    }

    /// Shards of sprites are meshes: a material that looks as the sprite does.
    fn shard_material(
        &self,
        world: &mut World,
        entity: Entity,
        _carrier: &Carrier,
        picture: &Handle<Image>,
        opacity: f32,
    ) -> Option<UntypedHandle> {
        let color = world.get::<Sprite>(entity)?.color;
        let color = color.with_alpha(color.alpha() * opacity);
        let mut materials = world.get_resource_mut::<Assets<ColorMaterial>>()?;
        let material = ColorMaterial { color, texture: Some(picture.clone()), ..ColorMaterial::default() };
        Some(materials.add(material).untyped())
    }

    fn shards(&self) -> &'static dyn ShardVisuals {
        &MaterialVisuals::<MeshMaterial2d<ColorMaterial>>::NEW
    }
}

/// The part of its picture that a sprite is to show, as somebody has written it; `None` = all of it.
pub(crate) fn part(sprite: &Sprite, layouts: Option<&Assets<TextureAtlasLayout>>) -> Option<Rect> {
    let frame = sprite.texture_atlas.as_ref().and_then(|atlas| {
        let layout = layouts?.get(&atlas.layout)?;
        layout.textures.get(atlas.index).map(URect::as_rect)
    });
    match (frame, sprite.rect) {
        (Some(frame), Some(rect)) => Some(Rect { min: rect.min + frame.min, max: rect.max + frame.min }),
        (frame, rect) => frame.or(rect),
    }
}

/// Where the anchor of a sprite lies in it, if it has one.
fn anchor_of(world: &World, entity: Entity) -> Vec2 {
    world.get::<Anchor>(entity).map_or(Vec2::ZERO, Anchor::as_vec)
}

/// Whether the engine shows a sprite as if its anchor was its centre: one that repeats or slices its picture, and has no size of its own.
pub(crate) fn is_anchor_ignored(sprite: &Sprite) -> bool {
    sprite.image_mode.uses_slices() && sprite.custom_size.is_none() && sprite.rect.is_none()
}

/// The texels of a part of a picture; one that ends before it begins, or is not a number, has none. Texels that a border between two
/// pixels cuts belong to it.
pub(crate) fn texels(part: Rect) -> URect {
    let (min, max) = (part.min.floor().as_uvec2(), part.max.ceil().as_uvec2());
    URect { min, max: max.max(min) }
}

/// The whole picture, stretched: as [`SpriteImageMode::Auto`], and the engine forgets the parts that it has drawn before.
const WHOLE: SpriteImageMode = SpriteImageMode::Tiled { tile_x: false, tile_y: false, stretch_value: 1.0 };

/// How a sprite that was given this size lays out its picture; `None` if it merely stretches it.
pub(crate) fn layout(mode: &SpriteImageMode, size: Option<Vec2>) -> Option<Layout> {
    let stretch = |mode: SliceScaleMode| match mode {
        SliceScaleMode::Stretch => None,
        SliceScaleMode::Tile { stretch_value } => Some(stretch_value),
    };
    let layout = match mode {
        SpriteImageMode::Tiled { tile_x, tile_y, stretch_value } => Layout {
            size,
            keeps_size: false,
            low: Vec2::ZERO,
            high: Vec2::ZERO,
            max_scale: 1.0,
            sides: None,
            middle: [tile_x, tile_y].map(|is_tiled| is_tiled.then_some(*stretch_value)),
        },
        SpriteImageMode::Sliced(slicer) => Layout {
            size,
            keeps_size: false,
            low: slicer.border.min_inset,
            high: slicer.border.max_inset,
            max_scale: slicer.max_corner_scale,
            sides: stretch(slicer.sides_scale_mode),
            middle: [stretch(slicer.center_scale_mode); 2],
        },
        SpriteImageMode::Auto | SpriteImageMode::Scale(_) => return None,
    };
    let has_size = size.is_none_or(|size| size.is_finite() && size.min_element() > 0.0);
    let is_stretched = layout.low + layout.high == Vec2::ZERO && layout.middle == [None; 2];
    (has_size && !is_stretched).then_some(layout)
}

/// Takes the size that was given to a sprite from it, unless somebody has changed it since. If so it does not count as changed.
fn give_size_back(sprite: &mut Mut<Sprite>, given: Option<Vec2>) {
    if given.is_some() && sprite.custom_size == given {
        sprite.custom_size = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;
    use bevy::sprite::{BorderRect, SliceScaleMode, SpriteImageMode, TextureSlice, TextureSlicer};

    /// The parts into which the engine cuts a sprite.
    fn parts(mode: &SpriteImageMode, picture: Vec2, size: Vec2) -> Vec<TextureSlice> {
        let texture_rect = Rect { min: Vec2::ZERO, max: picture };
        match mode {
            SpriteImageMode::Sliced(slicer) => slicer.compute_slices(texture_rect, Some(size)),
            SpriteImageMode::Tiled { tile_x, tile_y, stretch_value } => {
                TextureSlice { texture_rect, draw_size: size, offset: Vec2::ZERO }
                    .tiled(*stretch_value, (*tile_x, *tile_y))
            }
            _ => Vec::new(),
        }
    }

    /// The place in the picture that one of the parts shows at a point of the sprite (from its top left).
    fn shown(parts: &[TextureSlice], size: Vec2, at: Vec2) -> Option<Vec2> {
        let at = (at - size / 2.0) * Vec2::new(1.0, -1.0);
        parts.iter().find_map(|part| {
            let share = (at - part.offset) * Vec2::new(1.0, -1.0) / part.draw_size + 0.5;
            let is_inside = share.cmpge(Vec2::ZERO).all() && share.cmple(Vec2::ONE).all();
            is_inside.then(|| part.texture_rect.min + share * part.texture_rect.size())
        })
    }

    #[test]
    fn places_are_those_of_the_parts_that_the_engine_draws() {
        let mut rng = Rng::new(5);
        let (mut checked, mut cut) = (0, 0);
        for round in 0..300 {
            let picture = UVec2::new(8 + rng.next_u32() % 60, 8 + rng.next_u32() % 60);
            let size = Vec2::new(rng.range(5.0, 300.0), rng.range(5.0, 300.0));
            let mut scale_mode = || match rng.next_u32() % 2 {
                0 => SliceScaleMode::Stretch,
                _ => SliceScaleMode::Tile { stretch_value: rng.range(0.2, 2.0) },
            };
            let (center_scale_mode, sides_scale_mode) = (scale_mode(), scale_mode());
            let mode = if round % 2 == 0 {
                let mut inset = || Vec2::new(rng.range(0.5, 3.9), rng.range(0.5, 3.9));
                SpriteImageMode::Sliced(TextureSlicer {
                    border: BorderRect { min_inset: inset(), max_inset: inset() },
                    center_scale_mode,
                    sides_scale_mode,
                    max_corner_scale: rng.range(0.3, 2.0),
                })
            } else {
                let [tile_x, tile_y] = [(); 2].map(|()| rng.unit() < 0.5);
                SpriteImageMode::Tiled { tile_x, tile_y, stretch_value: rng.range(0.1, 2.0) }
            };
            let parts = parts(&mode, picture.as_vec2(), size);
            let Some(layout) = layout(&mode, Some(size)) else {
                assert!(matches!(mode, SpriteImageMode::Tiled { tile_x: false, tile_y: false, .. }));
                continue;
            };
            let texels = UVec2::new(1 + rng.next_u32() % 90, 1 + rng.next_u32() % 90);
            let places = layout.places(picture, texels);
            for _ in 0..60 {
                let texel = UVec2::new(rng.next_u32() % texels.x, rng.next_u32() % texels.y);
                let at = (texel.as_vec2() + 0.5) / texels.as_vec2() * size;
                // Where parts meet, rounding decides; so only what is the same a little to all sides is compared.
                let near = [Vec2::X, Vec2::Y, -Vec2::X, -Vec2::Y].map(|side| shown(&parts, size, at + 1e-3 * side));
                let Some(want) = shown(&parts, size, at) else { continue };
                if near.iter().any(|near| near.is_none_or(|near| near.distance(want) > 0.1)) {
                    cut += 1;
                    continue;
                }
                let got = places(texel.x, texel.y);
                assert!(got.distance(want) < 0.05, "{mode:?} {picture} {size} {texel} of {texels}: {got}, not {want}");
                checked += 1;
            }
        }
        assert!(checked > 50 * cut && checked > 10_000, "{checked} places checked, {cut} lie where parts meet");
    }

    #[test]
    fn textures_show_as_much_as_the_picture_has() {
        let size = Vec2::new(300.0, 100.0);
        let texels =
            |mode: &SpriteImageMode, size| layout(mode, Some(size)).unwrap().texels(UVec2::splat(64)).to_array();
        let tiled = |stretch_value, tile_y| SpriteImageMode::Tiled { tile_x: true, tile_y, stretch_value };
        assert_eq!(texels(&tiled(1.0, true), size), [300, 100]);
        assert_eq!(texels(&tiled(0.5, true), size), [600, 200]);
        assert_eq!(texels(&tiled(2.0, false), size), [150, 64]);
        let nine = SpriteImageMode::Sliced(TextureSlicer { border: BorderRect::all(8.0), ..default() });
        assert_eq!(texels(&nine, size), [300, 100]);
        assert_eq!(texels(&nine, Vec2::new(300.0, 32.0)), [600, 64], "its corners are shown at half their size");
        let hidden = TextureSlicer { border: BorderRect::all(8.0), max_corner_scale: 0.0, ..default() };
        assert_eq!(texels(&SpriteImageMode::Sliced(hidden), size), [64, 64], "its borders are not shown");
        let crowded = SpriteImageMode::Sliced(TextureSlicer { border: BorderRect::all(32.0), ..default() });
        assert_eq!(texels(&crowded, size), [64, 64], "its borders leave no room");
        assert_eq!(layout(&tiled(0.5, true), None).unwrap().texels(UVec2::new(64, 32)), UVec2::new(128, 64));
        let fine = SliceScaleMode::Tile { stretch_value: 0.25 };
        let nine = TextureSlicer { border: BorderRect::all(8.0), center_scale_mode: fine, ..default() };
        assert_eq!(texels(&SpriteImageMode::Sliced(nine), size), [1200, 400], "its middle at a quarter");
        let [width, height] = texels(&tiled(0.001, true), Vec2::splat(1.0e9));
        assert!(width == height && width * height <= 2_097_152, "{width} x {height}");
    }
}
