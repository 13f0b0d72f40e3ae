//! The picture of a group: tiles, put together by a task.

use super::tint::Tint;
use crate::plugin::api::CrackError;
use crate::plugin::jobs::stepped::{Step, Stepped};
use crate::plugin::source::picture::{self, Space};
use crate::raster::TexelRect;
use bevy::{
    math::{DAffine2, DVec2},
    prelude::*,
    render::render_resource::Extent3d,
};
use std::vec;

/// The most texels of a side.
const MAX_SIDE: f64 = 4096.0;

/// Texels that a step puts in place, about.
const SLICE: u64 = 1 << 15;

/// A rectangle of a picture, as a member shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tile {
    /// From the tile, (0, 0) at its top left and (1, 1) at its bottom right, to the group's own plane, y up.
    pub(super) place: DAffine2,
    pub(super) z: f32,
    /// Which picture.
    pub(super) picture: usize,
    /// Which layer of it.
    pub(super) layer: u32,
    /// The texels that are shown.
    pub(super) part: Rect,
    /// Red, green, blue, alpha; sRGB.
    pub(super) tint: [f32; 4],
}

impl Tile {
    /// Its corners, or rather the lowest and the highest of their coordinates.
    fn bounds(&self) -> (DVec2, DVec2) {
        let corners = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(|corner| self.place.transform_point2(corner));
        corners
            .iter()
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(min, max), corner| (min.min(*corner), max.max(*corner)))
    }

    /// The sides of a texel, in units of the group.
    fn texel(&self) -> DVec2 {
        let sides = DVec2::new(self.place.matrix2.x_axis.length(), self.place.matrix2.y_axis.length());
        sides / self.part.size().as_dvec2()
    }

    /// Whether it lies along the axes of the group and has an area.
    pub(super) fn is_upright(&self) -> bool {
        let (x, y) = (self.place.matrix2.x_axis, self.place.matrix2.y_axis);
        let size = self.part.size();
        let slant = |axis: DVec2| axis.abs().min_element() / axis.abs().max_element();
        let has_area = size.min_element() > 0.0 && size.is_finite() && self.place.is_finite();
        has_area && (slant(x) < 1e-3 && slant(y) < 1e-3) && self.place.matrix2.determinant().abs() > 1e-12
    }
}

/// Where the texels of the picture of a group lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WallFrame {
    /// The top left corner, in the group's own plane.
    corner: DVec2,
    /// Length of a texel.
    texel: f64,
    pub(super) size: UVec2,
}

impl WallFrame {
    /// Around tiles, which are upright; with the texels of the finest, or coarser ones if that were too many. `None` without any.
    pub(super) fn around(tiles: &[Tile]) -> Option<Self> {
        let none = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (min, max) = tiles.iter().map(Tile::bounds).fold(none, |(min, max), (a, b)| (min.min(a), max.max(b)));
        let finest = tiles.iter().map(|tile| tile.texel().min_element()).fold(f64::INFINITY, f64::min);
        let span = max - min;
        let texel = finest.max(span.max_element() / MAX_SIDE);
        let size = (span / texel).round().max(DVec2::ONE).as_uvec2();
        (span.is_finite() && texel.is_finite() && texel > 0.0).then_some(Self {
            corner: DVec2::new(min.x, max.y),
            texel,
            size,
        })
    }

    /// Its size, in units of the group.
    pub(super) fn extent(&self) -> Vec2 {
        (self.size.as_dvec2() * self.texel).as_vec2()
    }

    /// Its centre, in the group's own plane.
    pub(super) fn center(&self) -> Vec2 {
        let half = self.size.as_dvec2() * self.texel / 2.0;
        (self.corner + half * DVec2::new(1.0, -1.0)).as_vec2()
    }

    /// From texels to the group's own plane.
    fn to_plane(self) -> DAffine2 {
        DAffine2::from_scale_angle_translation(DVec2::new(self.texel, -self.texel), 0.0, self.corner)
    }

    /// The texels of a tile; `None` if it does not lie within.
    pub(super) fn rect(&self, tile: &Tile) -> Option<TexelRect> {
        let (min, max) = tile.bounds();
        let to_texels = self.to_plane().inverse();
        let (a, b) = (to_texels.transform_point2(min), to_texels.transform_point2(max));
        let (min, max) = (a.min(b).round(), a.max(b).round());
        let is_within = min.cmpge(DVec2::ZERO).all() && max.cmple(self.size.as_dvec2()).all();
        is_within.then(|| TexelRect { min: min.as_uvec2(), max: max.as_uvec2() })
    }
}

/// A picture that tiles are read from.
struct Source {
    size: UVec2,
    /// RGBA8, sRGB.
    texels: Vec<u8>,
}

impl Source {
    /// The layers of an array lie one below the other.
    fn read(mut image: Image) -> Result<Self, CrackError> {
        let Extent3d { width, height, depth_or_array_layers: layers } = image.texture_descriptor.size;
        let rows = height.saturating_mul(layers);
        image.texture_descriptor.size = Extent3d { width, height: rows, depth_or_array_layers: 1 };
        let texels = picture::read_colors(&image, Space::Srgb, UVec2::new(width, rows))?;
        Ok(Self { size: UVec2::new(width, height), texels })
    }

    fn texel(&self, at: UVec2, layer: u32) -> Option<[u8; 4]> {
        let row = layer as usize * self.size.y as usize + at.y as usize;
        let start = 4 * (row * self.size.x as usize + at.x as usize);
        self.texels.get(start..)?.first_chunk().copied()
    }
}

/// The making of the picture of a group.
pub(super) struct WallWork {
    frame: WallFrame,
    /// Those that are covered come first.
    tiles: Vec<Tile>,
    copies: vec::IntoIter<Image>,
    sources: Vec<Source>,
    /// That of the last tile: tiles beside each other mostly have the same.
    tint: Tint,
    done: usize,
    /// RGBA8, sRGB.
    texels: Vec<u8>,
}

impl WallWork {
    /// `copies` are the pictures of the tiles.
    pub(super) fn new(frame: WallFrame, mut tiles: Vec<Tile>, copies: Vec<Image>) -> Self {
        tiles.sort_by(|a, b| a.z.total_cmp(&b.z));
        Self {
            frame,
            tiles,
            copies: copies.into_iter(),
            sources: Vec::new(),
            tint: Tint::NONE,
            done: 0,
            texels: Vec::new(),
        }
    }

    /// Puts a tile in its place; returns how many texels it covers.
    fn put(&mut self, tile: &Tile) -> u64 {
        self.tint.become_of(tile.tint);
        let (Some(rect), Some(source)) = (self.frame.rect(tile), self.sources.get(tile.picture)) else { return 0 };
        let part = tile.part.intersect(Rect { min: Vec2::ZERO, max: source.size.as_vec2() });
        if part.is_empty() {
            return 0;
        }
        let (least, most) = (part.min.floor().as_uvec2(), (part.max.ceil().as_uvec2()).saturating_sub(UVec2::ONE));
        let scale = DAffine2::from_scale_angle_translation(tile.part.size().as_dvec2(), 0.0, tile.part.min.as_dvec2());
        let back = scale * tile.place.inverse() * self.frame.to_plane();
        let width = self.frame.size.x as usize;
        for y in rect.min.y..rect.max.y {
            for x in rect.min.x..rect.max.x {
                let at = back.transform_point2(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)).floor();
                // What the edge of a picture cuts off is missing.
                if at.cmplt(least.as_dvec2() - 0.5).any() || at.cmpgt(most.as_dvec2() + 0.5).any() {
                    continue;
                }
                let start = 4 * (y as usize * width + x as usize);
                let (texel, below) = (source.texel(at.as_uvec2(), tile.layer), self.texels.get_mut(start..start + 4));
                if let (Some(texel), Some(below)) = (texel, below.and_then(|below| below.first_chunk_mut())) {
                    *below = over(self.tint.of(texel), *below);
                }
            }
        }
        rect.area()
    }
}

impl Stepped for WallWork {
    /// The texels.
    type Output = Vec<u8>;

    fn step(mut self) -> Result<Step<Self>, CrackError> {
        if let Some(copy) = self.copies.next() {
            self.sources.push(Source::read(copy)?);
            return Ok(Step::More(self));
        }
        if self.texels.is_empty() {
            self.texels = vec![0; 4 * TexelRect::whole(self.frame.size).area() as usize];
        }
        let mut area = 0;
        while let Some(tile) = self.tiles.get(self.done).copied().filter(|_| area < SLICE) {
            area += self.put(&tile) + 1;
            self.done += 1;
        }
        Ok(if self.done < self.tiles.len() { Step::More(self) } else { Step::Done(self.texels) })
    }

    fn progress(&self) -> f32 {
        self.done as f32 / self.tiles.len().max(1) as f32
    }
}

/// A texel over another one, as the renderer blends them.
fn over(top: [u8; 4], below: [u8; 4]) -> [u8; 4] {
    if top[3] == 255 || below[3] == 0 {
        return top;
    }
    let [top, below] = [top, below].map(|texel| LinearRgba::from(Srgba::from_u8_array(texel)));
    let (cover, left) = (top.alpha, below.alpha * (1.0 - top.alpha));
    let alpha = cover + left;
    if alpha <= 0.0 {
        return [0; 4];
    }
    let mix = |a: f32, b: f32| (a * cover + b * left) / alpha;
    let mixed = LinearRgba {
        red: mix(top.red, below.red),
        green: mix(top.green, below.green),
        blue: mix(top.blue, below.blue),
        alpha,
    };
    Srgba::from(mixed).to_u8_array()
}
