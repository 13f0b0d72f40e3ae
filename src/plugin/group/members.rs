//! What the members of a group show.

use super::wall::{Tile, WallFrame};
use crate::plugin::api::{CrackError, CrackGroup};
use crate::plugin::carrier::sprite;
use crate::plugin::source::picture;
use bevy::{
    camera::visibility::RenderLayers,
    ecs::entity::{EntityHashMap, EntityHashSet},
    image::ImageSampler,
    math::{DAffine2, DMat2, DVec2},
    prelude::*,
    sprite::Anchor,
    sprite_render::{TileData, TilemapChunk, TilemapChunkTileData},
};

/// Members of a group and what they show.
#[derive(Clone, Default)]
pub(super) struct Members {
    pub(super) pictures: Vec<Handle<Image>>,
    pub(super) list: Vec<(Entity, Vec<Tile>)>,
    /// How the first one samples its picture.
    pub(super) sampler: ImageSampler,
    /// Which cameras see it.
    pub(super) layers: Option<RenderLayers>,
    /// Why some are left out.
    pub(super) left_out: Option<&'static str>,
}

impl Members {
    /// Those of a group as they are now, without `gone`; `None` if some picture is not there yet.
    pub(super) fn of(world: &World, group: Entity, gone: &EntityHashSet) -> Result<Option<Self>, CrackError> {
        let mut members = Self::default();
        let Some(entities) = world.get::<CrackGroup>(group) else { return Ok(Some(members)) };
        let place = world.get::<GlobalTransform>(group).map(GlobalTransform::affine).unwrap_or_default();
        if place.matrix3.determinant() == 0.0 || !place.is_finite() {
            return Err(CrackError::Group { reason: "its transform cannot be inverted".into() });
        }
        let back = place.inverse();
        for entity in entities.iter().filter(|entity| !gone.contains(entity)) {
            let Some(place) = world.get::<GlobalTransform>(entity) else { continue };
            let relative = back * place.affine();
            let plane = DMat2::from_cols(
                relative.matrix3.x_axis.truncate().as_dvec2(),
                relative.matrix3.y_axis.truncate().as_dvec2(),
            );
            let z = relative.translation.z;
            let is_flat = Vec2::new(relative.matrix3.x_axis.z, relative.matrix3.y_axis.z).abs().max_element() < 1e-3;
            if !is_flat || !z.is_finite() {
                members.left_out = Some("it does not lie in the plane of the group");
                continue;
            }
            let place = DAffine2::from_mat2_translation(plane, relative.translation.truncate().as_dvec2());
            match members.add(world, entity, place, z)? {
                None => return Ok(None),
                Some(tiles) if tiles.is_empty() => {}
                Some(tiles) if tiles.iter().all(Tile::is_upright) => {
                    if members.list.is_empty() {
                        members.layers = world.get::<RenderLayers>(entity).cloned();
                    }
                    members.list.push((entity, tiles));
                }
                Some(_) => members.left_out = Some("it is not turned by quarter turns, or has no size"),
            }
        }
        Ok(Some(members))
    }

    /// The tiles of a member; `None` if its picture is not there yet.
    fn add(&mut self, world: &World, entity: Entity, place: DAffine2, z: f32) -> Result<Option<Vec<Tile>>, CrackError> {
        if let Some(sprite) = world.get::<Sprite>(entity) {
            let anchor = world.get::<Anchor>(entity).map_or(Vec2::ZERO, Anchor::as_vec);
            return self.sprite(world, sprite, anchor, place, z);
        }
        if let (Some(chunk), Some(tiles)) =
            (world.get::<TilemapChunk>(entity), world.get::<TilemapChunkTileData>(entity))
        {
            return self.chunk(world, chunk, tiles, place, z);
        }
        self.left_out = Some("it has no `Sprite` or `TilemapChunk`");
        Ok(Some(Vec::new()))
    }

    fn sprite(
        &mut self,
        world: &World,
        sprite: &Sprite,
        anchor: Vec2,
        place: DAffine2,
        z: f32,
    ) -> Result<Option<Vec<Tile>>, CrackError> {
        if sprite.image_mode != SpriteImageMode::Auto {
            self.left_out = Some("its sprite repeats or slices its picture");
            return Ok(Some(Vec::new()));
        }
        let layouts = world.get_resource::<Assets<TextureAtlasLayout>>();
        if let Some(atlas) = &sprite.texture_atlas
            && !layouts.is_some_and(|layouts| layouts.contains(&atlas.layout))
        {
            return Ok(None);
        }
        let Some((picture, image)) = self.picture(world, &sprite.image)? else { return Ok(None) };
        let whole = Rect { min: Vec2::ZERO, max: image.size_f32() };
        let part = sprite::part(sprite, layouts).unwrap_or(whole);
        let size = sprite.custom_size.unwrap_or(part.size()).as_dvec2();
        let flip = DVec2::new(if sprite.flip_x { -1.0 } else { 1.0 }, if sprite.flip_y { -1.0 } else { 1.0 });
        // (0, 0) is the top left of what is shown, of a flipped one the opposite corner.
        let to_sprite = DAffine2::from_translation(-anchor.as_dvec2() * size)
            * DAffine2::from_scale(size * flip * DVec2::new(1.0, -1.0))
            * DAffine2::from_translation(DVec2::splat(-0.5));
        let tint = sprite.color.to_srgba().to_f32_array();
        Ok(Some(vec![Tile { place: place * to_sprite, z, picture, layer: 0, part, tint }]))
    }

    fn chunk(
        &mut self,
        world: &World,
        chunk: &TilemapChunk,
        tiles: &TilemapChunkTileData,
        place: DAffine2,
        z: f32,
    ) -> Result<Option<Vec<Tile>>, CrackError> {
        let Some((picture, image)) = self.picture(world, &chunk.tileset)? else { return Ok(None) };
        let layers = image.texture_descriptor.size.depth_or_array_layers;
        let part = Rect { min: Vec2::ZERO, max: image.size_f32() };
        let (across, shown) = (chunk.chunk_size.x.max(1), chunk.tile_display_size.as_dvec2());
        let corner = -0.5 * chunk.chunk_size.as_dvec2() * shown;
        let mut list = Vec::new();
        for (i, tile) in (0u32..).zip(&tiles.0) {
            let Some(TileData { tileset_index, color, visible: true, orientation }) = *tile else { continue };
            if u32::from(tileset_index) >= layers {
                continue;
            }
            // Rows come from the bottom to the top.
            let middle = corner + shown * (DVec2::new(f64::from(i % across), f64::from(i / across)) + 0.5);
            let to_chunk = DAffine2::from_translation(middle)
                * DAffine2::from_scale(shown * DVec2::new(1.0, -1.0))
                * turned(orientation.mirror_h(), orientation.mirror_v(), orientation.mirror_d())
                * DAffine2::from_translation(DVec2::splat(-0.5));
            let tint = color.to_srgba().to_f32_array();
            list.push(Tile { place: place * to_chunk, z, picture, layer: u32::from(tileset_index), part, tint });
        }
        Ok(Some(list))
    }

    /// A picture and its number; `None` if it is not there yet.
    fn picture<'a>(
        &mut self,
        world: &'a World,
        picture: &Handle<Image>,
    ) -> Result<Option<(usize, &'a Image)>, CrackError> {
        if !picture::is_loaded(world, picture)? {
            return Ok(None);
        }
        let Some(image) = world.get_resource::<Assets<Image>>().and_then(|images| images.get(picture)) else {
            return Ok(None);
        };
        if image.data.is_none() {
            return Err(CrackError::NoCpuData);
        }
        let number = self.pictures.iter().position(|known| known == picture).unwrap_or_else(|| {
            if self.pictures.is_empty() {
                self.sampler = image.sampler.clone();
            }
            self.pictures.push(picture.clone());
            self.pictures.len() - 1
        });
        Ok(Some((number, image)))
    }

    /// The tiles of those that lie within `frame`, and who that is.
    pub(super) fn within(&self, frame: &WallFrame) -> (Vec<Tile>, Vec<Entity>) {
        let mut tiles = Vec::new();
        let mut entities = Vec::new();
        for (entity, own) in &self.list {
            if own.iter().all(|tile| frame.rect(tile).is_some()) {
                tiles.extend(own);
                entities.push(*entity);
            }
        }
        (tiles, entities)
    }

    pub(super) fn tiles(&self) -> Vec<Tile> {
        self.list.iter().flat_map(|(_, tiles)| tiles).copied().collect()
    }

    /// Those that have another place than in `before`.
    pub(super) fn moved(&self, before: &Self) -> Vec<Entity> {
        let places = |tiles: &[Tile]| tiles.first().map(|tile| (tile.place, tile.z));
        let known: EntityHashMap<_> = before.list.iter().map(|(entity, tiles)| (*entity, places(tiles))).collect();
        let has_moved = |(entity, tiles): &&(Entity, Vec<Tile>)| {
            known.get(entity).is_some_and(|known| match (known, places(tiles)) {
                (Some((a, _)), Some((b, _))) => !a.abs_diff_eq(b, 1e-3),
                _ => false,
            })
        };
        self.list.iter().filter(has_moved).map(|(entity, _)| *entity).collect()
    }

    /// Whether the same is shown.
    pub(super) fn shows_the_same(&self, other: &Self) -> bool {
        let is_same = |(a, b): (&(Entity, Vec<Tile>), &(Entity, Vec<Tile>))| {
            a.0 == b.0
                && a.1.len() == b.1.len()
                && a.1
                    .iter()
                    .zip(&b.1)
                    .all(|(a, b)| a.place.abs_diff_eq(b.place, 1e-3) && Tile { place: a.place, z: a.z, ..*b } == *a)
        };
        self.pictures == other.pictures
            && self.list.len() == other.list.len()
            && self.list.iter().zip(&other.list).all(is_same)
    }
}

/// What a tile's own orientation does to it: the shader mirrors texture coordinates across, then down, then along the diagonal; this is the
/// way back.
fn turned(across: bool, down: bool, diagonal: bool) -> DAffine2 {
    let sign = |is_mirrored: bool| if is_mirrored { -1.0 } else { 1.0 };
    let swap = if diagonal { DMat2::from_cols(DVec2::Y, DVec2::X) } else { DMat2::IDENTITY };
    DAffine2::from_mat2(DMat2::from_diagonal(DVec2::new(sign(across), sign(down))) * swap)
}
