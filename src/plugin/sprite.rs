//! Sprites as carriers.

use super::{
    CrackError, CrackMaps, CrackTextures,
    carrier::{Carrier, Found, Kind, Shown},
    material,
    shards::Plane,
    surfaces::Active,
};
use bevy::{asset::UntypedHandle, math::Mat3A, prelude::*, sprite::Anchor};

pub(super) const KIND: Kind = Kind {
    inspect,
    attach,
    detach,
    aspect,
    locate,
    is_solid: false,
    plane,
    open: |_, _| {},
    shard_material,
    inside: |_, _, _, _| None,
    spawn: material::spawn::<MeshMaterial2d<ColorMaterial>>,
    spawn_sides: material::spawn_sides::<MeshMaterial2d<ColorMaterial>>,
    dress: material::dress::<MeshMaterial2d<ColorMaterial>>,
    change: material::change::<MeshMaterial2d<ColorMaterial>>,
    undress: material::undress::<MeshMaterial2d<ColorMaterial>>,
};

fn inspect(world: &World, entity: Entity) -> Found {
    let Some(sprite) = world.get::<Sprite>(entity) else { return Found::Other };
    if !matches!(sprite.image_mode, SpriteImageMode::Auto) {
        let mode = match sprite.image_mode {
            SpriteImageMode::Sliced(_) => "Sliced",
            SpriteImageMode::Tiled { .. } => "Tiled",
            _ => "Scale",
        };
        return Found::Unusable(CrackError::SpriteMode { mode: mode.to_owned() });
    }
    let layouts = world.get_resource::<Assets<TextureAtlasLayout>>();
    let frame = match &sprite.texture_atlas {
        Some(atlas) => {
            let Some(layout) = layouts.and_then(|layouts| layouts.get(&atlas.layout)) else { return Found::Waiting };
            layout.textures.get(atlas.index).map(|rect| rect.as_rect())
        }
        None => None,
    };
    let rect = match (frame, sprite.rect) {
        (Some(frame), Some(rect)) => Some(Rect { min: rect.min + frame.min, max: rect.max + frame.min }),
        (frame, rect) => frame.or(rect),
    };
    // A sprite of one colour shows Bevy's white picture of one texel.
    let is_blank = sprite.image == Handle::default() && rect.is_none();
    Found::Shown(Box::new(Shown {
        asset: sprite.image.clone().untyped(),
        diffuse: (!is_blank).then(|| sprite.image.clone()),
        normal: None,
        depth: None,
        // Texels that a border between two pixels cuts belong to the frame.
        rect: rect.map(|rect| URect { min: rect.min.floor().as_uvec2(), max: rect.max.ceil().as_uvec2() }),
        size: sprite.custom_size,
        maps: CrackMaps { diffuse: true, normal: true, depth: false },
    }))
}

fn attach(world: &mut World, entity: Entity, carrier: &mut Carrier, textures: &CrackTextures, _relief: f32) {
    let Some(own) = &textures.diffuse else { return };
    carrier.own = Some(own.clone().untyped());
    let images = world.get_resource::<Assets<Image>>();
    let size = |handle: &Handle<Image>| images.and_then(|images| images.get(handle)).map(Image::size_f32);
    let (before, now) = (size(&carrier.shown.asset.clone().typed()), size(own));
    let Some(mut sprite) = world.get_mut::<Sprite>(entity) else { return };
    sprite.image = own.clone();
    give_size_back(&mut sprite, carrier.size.take());
    // Textures of another size must not change the size of the sprite.
    if sprite.custom_size.is_none() && before != now {
        sprite.custom_size = before;
        carrier.size = before;
    }
}

fn detach(world: &mut World, entity: Entity, carrier: &Carrier) {
    let Some(mut sprite) = world.get_mut::<Sprite>(entity) else { return };
    if carrier.is_showing(&sprite.image.clone().untyped()) {
        sprite.image = carrier.shown.asset.clone().typed();
    }
    give_size_back(&mut sprite, carrier.size);
}

/// Takes the size that was given to a sprite from it, unless somebody has changed it since.
fn give_size_back(sprite: &mut Sprite, given: Option<Vec2>) {
    if given.is_some() && sprite.custom_size == given {
        sprite.custom_size = None;
    }
}

fn aspect(world: &World, entity: Entity) -> Option<f32> {
    let sprite = world.get::<Sprite>(entity)?;
    let picture = || world.get_resource::<Assets<Image>>()?.get(&sprite.image).map(Image::size_f32);
    let size = sprite.custom_size.or_else(picture)?;
    let place = world.get::<GlobalTransform>(entity).map_or(Mat3A::IDENTITY, |place| place.affine().matrix3);
    Some((size.x * place.x_axis.length() / (size.y * place.y_axis.length())).abs())
}

fn locate(world: &World, entity: Entity, local: Vec3) -> Result<Vec2, &'static str> {
    let sprite = world.get::<Sprite>(entity).ok_or("the sprite is gone")?;
    let images = world.get_resource::<Assets<Image>>().ok_or("there are no images")?;
    let anchor = world.get::<Anchor>(entity).copied().unwrap_or_default();
    let none = Assets::default();
    let layouts = world.get_resource::<Assets<TextureAtlasLayout>>().unwrap_or(&none);
    let texel = sprite
        .compute_pixel_space_point(local.truncate(), anchor, images, layouts)
        .map_err(|_| "the point lies off the sprite")?;
    let Found::Shown(shown) = inspect(world, entity) else { return Err("the sprite cannot be read") };
    let rect = match shown.rect {
        Some(rect) => rect.as_rect(),
        None => Rect { min: Vec2::ZERO, max: images.get(&sprite.image).ok_or("the picture is gone")?.size_f32() },
    };
    Ok((texel - rect.min) / rect.size())
}

fn plane(world: &World, entity: Entity, active: &Active) -> Result<Plane, &'static str> {
    let sprite = world.get::<Sprite>(entity).ok_or("the sprite is gone")?;
    let texels = active.views.get(active.view).ok_or("it shows nothing")?.rect.size();
    let size = sprite.custom_size.unwrap_or(texels.as_vec2());
    if !(size.is_finite() && size.min_element() > 0.0) {
        return Err("the sprite has no size");
    }
    let anchor = world.get::<Anchor>(entity).copied().unwrap_or_default();
    let flip = BVec2::new(sprite.flip_x, sprite.flip_y);
    let middle = (-anchor.as_vec() * size).extend(0.0);
    Ok(Plane { middle, rotation: Quat::IDENTITY, size: Vec2::select(flip, -size, size) })
}

/// Shards of sprites are meshes: a material that looks as the sprite does.
fn shard_material(
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
