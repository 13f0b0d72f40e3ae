//! From [`CrackStrands`] to a network: what a bake of strands is made from, and how.

use crate::Grid;
use crate::pattern::{Network, SurfaceFrame};
use crate::plugin::api::strands::strand_error;
use crate::plugin::api::{CrackError, CrackStrands, HitPoint, StrandField};
use crate::plugin::carrier::{kinds, space};
use crate::plugin::source::picture::{self, Space};
use crate::plugin::surface::cracked::active;
use crate::plugin::surface::inputs::Copies;
use crate::strands::{Directions, Primitive, StrandParams, StrandStart, Strands};
use bevy::prelude::*;

/// Steps in which strands open behind their tips.
const OPENING: u32 = 12;

/// Longest side of an image, texels.
const MAX_SIDE: u32 = 8192;

/// A field whose places are texture coordinates.
enum Field {
    Linear(Vec2),
    Radial(Vec2),
    Swirl(Vec2, f32),
    /// Index of the copy.
    Painted(usize),
    Along(Vec<Vec2>, f32),
}

/// All that strands depend on beside the size of their surface.
pub(super) struct StrandsOrder {
    starts: Vec<Vec2>,
    field: Field,
    params: StrandParams,
    /// Indices of the copies.
    primitives: Vec<usize>,
    seed: u64,
    is_at_once: bool,
}

/// The texture coordinates of a place, which may lie off the surface.
fn uv(world: &World, entity: Entity, at: HitPoint) -> Result<Vec2, &'static str> {
    let local = match at {
        HitPoint::Uv(uv) => return Ok(uv),
        HitPoint::Local(point) => point,
        HitPoint::World(point) => {
            let transform = world.get::<GlobalTransform>(entity).ok_or("the surface has no `GlobalTransform`")?;
            let back = space::to_local(transform)
                .ok_or("the surface's transform has a scale of zero, or cannot be inverted")?;
            back.transform_point3(point)
        }
    };
    let before = active(world, entity);
    let kind = before.map(|active| active.carrier.kind).or_else(|| kinds::inspect(world, entity).0);
    let size = before.map(|active| active.drawing.field.frame.size());
    kind.ok_or("the surface is gone")?.locate(world, entity, local, size)
}

impl StrandsOrder {
    /// What is needed of the world; `None` if its images are not there yet.
    pub(super) fn new(
        world: &World,
        entity: Entity,
        strands: &CrackStrands,
        copies: &mut Copies,
    ) -> Result<Option<Self>, CrackError> {
        strands.validate()?;
        let place = |name: &str, index: usize, at: HitPoint| {
            uv(world, entity, at).map_err(|reason| CrackError::Bake { reason: format!("{name} {index}: {reason}") })
        };
        let images = strands.primitives.iter().chain(match &strands.field {
            StrandField::Painted(image) => Some(image),
            _ => None,
        });
        let loaded = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
        for image in images {
            if !picture::is_loaded(world, image)? {
                return Ok(None);
            }
            let Some(size) = loaded.get(image).map(picture::readable_size).transpose()? else { return Ok(None) };
            if size.max_element() > MAX_SIDE {
                return Err(CrackError::Size { width: size.x, height: size.y });
            }
        }
        let field = match &strands.field {
            StrandField::Linear(direction) => Field::Linear(*direction),
            StrandField::Radial(center) => Field::Radial(place("center", 0, *center)?),
            StrandField::Swirl { center, turn } => Field::Swirl(place("center", 0, *center)?, *turn),
            StrandField::Painted(image) => Field::Painted(copies.add(image)),
            StrandField::Along { line, hold } => {
                let line: Result<_, _> = line.iter().enumerate().map(|(i, at)| place("point", i, *at)).collect();
                Field::Along(line?, *hold)
            }
        };
        let starts: Result<Vec<Vec2>, _> =
            strands.starts.iter().enumerate().map(|(i, at)| place("start", i, *at)).collect();
        let mut starts = starts?;
        if starts.is_empty() {
            starts.extend(match &field {
                Field::Radial(center) | Field::Swirl(center, _) => Some(*center),
                Field::Along(line, _) => line.first().copied(),
                Field::Linear(_) | Field::Painted(_) => None,
            });
        }
        Ok(Some(Self {
            starts,
            field,
            params: strands.params,
            primitives: strands.primitives.iter().map(|image| copies.add(image)).collect(),
            seed: strands.seed,
            is_at_once: strands.seconds.is_nan() || strands.seconds <= 0.0,
        }))
    }

    /// The cracks, and the steps in which they open.
    pub(super) fn lines(&self, copies: &[Image], size: UVec2) -> Result<(Network, u32), CrackError> {
        let frame = SurfaceFrame::new(size).map_err(|error| CrackError::Bake { reason: error.to_string() })?;
        let place = |uv: Vec2| frame.uv_to_pos(uv);
        let directions = match &self.field {
            Field::Linear(direction) => Directions::Linear(*direction),
            Field::Radial(center) => Directions::Radial { center: place(*center) },
            Field::Swirl(center, turn) => Directions::Swirl { center: place(*center), turn: *turn },
            Field::Painted(image) => {
                let (size, rgba) = read(copies, *image)?;
                Directions::from_picture(size, &rgba).map_err(strand_error)?
            }
            Field::Along(line, hold) => {
                Directions::Along { line: line.iter().copied().map(place).collect(), hold: *hold }
            }
        };
        let starts: Vec<_> = self.starts.iter().map(|uv| self.start(place(*uv))).collect();
        let strands =
            Strands::new(&self.params, directions, &starts, frame.extent(), self.seed).map_err(strand_error)?;
        let mut primitives = Vec::with_capacity(self.primitives.len());
        for (index, &image) in self.primitives.iter().enumerate() {
            let (size, rgba) = read(copies, image)?;
            let primitive = Primitive::from_image(heights(size, &rgba));
            primitives
                .push(primitive.map_err(|error| CrackError::Bake { reason: format!("primitive {index}: {error}") })?);
        }
        let material = self.params.material;
        if primitives.is_empty() {
            primitives = if self.params.lanes > 1 { material.nets() } else { material.primitives() };
        }
        let mut network = strands.network(&primitives).map_err(strand_error)?;
        if self.is_at_once {
            network.nodes.iter_mut().for_each(|node| node.birth = 0);
            network.links.iter_mut().for_each(|link| link.birth = 0);
        }
        Ok((network, if self.is_at_once { 0 } else { OPENING }))
    }

    /// At the center of a field there is no direction: a strand runs east from there.
    fn start(&self, pos: Vec2) -> StrandStart {
        let has_center = matches!(self.field, Field::Radial(_) | Field::Swirl(..));
        StrandStart { pos, direction: has_center.then_some(Vec2::X) }
    }
}

/// Size and texels of a copied image.
fn read(copies: &[Image], index: usize) -> Result<(UVec2, Vec<u8>), CrackError> {
    let image = copies.get(index).ok_or(CrackError::NoImages)?;
    let size = picture::readable_size(image)?;
    Ok((size, picture::read(image, Space::Srgb, size)?))
}

/// A height image from a picture: black is deepest.
fn heights(size: UVec2, rgba: &[u8]) -> Grid<u16> {
    let depth = |texel: &[u8; 4]| {
        let light = (u32::from(texel[0]) + u32::from(texel[1]) + u32::from(texel[2])) / 3;
        257 * (255 - light.min(255) as u16)
    };
    let depths = rgba.as_chunks::<4>().0.iter().map(depth).collect();
    Grid::from_vec(size, depths).unwrap_or_else(|| Grid::new(UVec2::ZERO, 0))
}
