//! A mountain out of a real terrain: one contour and all that lie inside of it.

use crate::{
    birds_eye::{View, birds_eye},
    terrain::{Terrain, length},
};
use bevy_crack::{
    pattern::SurfaceFrame,
    relief::{Contours, HeightParams, ReliefError, Ring, TerrainColors, colors, heights},
};
use glam::{UVec2, Vec2};
use image::RgbaImage;
use std::error::Error;

/// A mountain.
pub(crate) struct Mountain {
    /// The contour at its foot as level 0, and the real contours inside of it, fitted to a square.
    pub(crate) contours: Contours,
    /// Height from level to level, in units of that square.
    pub(crate) step: f32,
}

fn is_inside(points: &[Vec2], at: Vec2) -> bool {
    let sides = points.iter().zip(points.iter().cycle().skip(1));
    let crosses =
        |(a, b): &(&Vec2, &Vec2)| (a.y > at.y) != (b.y > at.y) && at.x < a.x + (at.y - a.y) * (b.x - a.x) / (b.y - a.y);
    sides.filter(crosses).count() % 2 == 1
}

fn bounds(points: &[Vec2]) -> [Vec2; 2] {
    [Vec2::min, Vec2::max].map(|pick| points.iter().copied().reduce(pick).unwrap_or_default())
}

impl Mountain {
    /// The largest mountain with five contours above its foot, of so many over the whole height of a terrain.
    pub(crate) fn of(terrain: &Terrain, levels: u16) -> Result<Self, Box<dyn Error>> {
        Ok(fitted(terrain, levels)?.ok_or("no mountain with five contours above its foot")?)
    }

    /// The contours at its foot.
    pub(crate) fn seeds(&self) -> Vec<Vec<Vec2>> {
        self.contours.level(0).filter(|ring| !ring.is_hole()).map(|ring| ring.points.clone()).collect()
    }

    /// A bird's-eye view of contours with the heights of this mountain.
    pub(crate) fn birds_eye(&self, contours: &Contours) -> Result<RgbaImage, Box<dyn Error>> {
        let frame = SurfaceFrame::new(UVec2::splat(1024))?;
        let params = HeightParams { step: 3.0 * self.step, floor: 1.5, ..HeightParams::DEFAULT };
        let ground = heights(contours, &params, frame, 1)?;
        let unlit = colors(&ground, &frame, &TerrainColors { light: 0.0, ..TerrainColors::MOUNTAIN }, 1)?;
        Ok(birds_eye(&ground, &unlit, &frame, &View::WIDE))
    }
}

fn fitted(terrain: &Terrain, levels: u16) -> Result<Option<Mountain>, ReliefError> {
    let (all, step) = terrain.contours(levels)?;
    let extent = terrain.frame.extent();
    let border = 1.5 / terrain.frame.texels_per_unit();
    let is_whole = |ring: &&Ring| {
        let [min, max] = bounds(&ring.points);
        !ring.is_hole() && min.min_element() > border && (extent - max).min_element() > border
    };
    let depth = |ring: &Ring| {
        let inside =
            all.rings.iter().filter(|other| other.level > ring.level && is_inside(&ring.points, other.points[0]));
        inside.map(|other| other.level - ring.level).max().unwrap_or(0)
    };
    let whole = all.rings.iter().filter(is_whole).filter(|ring| depth(ring) >= 5);
    let Some(seed) = whole.max_by(|a, b| a.signed_area().total_cmp(&b.signed_area())) else { return Ok(None) };
    let [min, max] = bounds(&seed.points);
    let scale = 0.86 / (max - min).max_element();
    let moved = |ring: &Ring| Ring {
        points: ring.points.iter().map(|&point| (point - 0.5 * (min + max)) * scale + 0.5).collect(),
        level: ring.level - seed.level,
    };
    let is_part = |ring: &&Ring| {
        ring.level == seed.level && ring.points == seed.points
            || (ring.level > seed.level || ring.is_hole() && ring.level == seed.level)
                && is_inside(&seed.points, ring.points[0])
    };
    let rings: Vec<_> = all.rings.iter().filter(is_part).map(moved).collect();
    let mut real = Contours { rings, distance: 0.02 };
    real.distance = spacing(&real);
    Ok(Some(Mountain { contours: real, step: step * scale }))
}

fn area(contours: &Contours, level: i32) -> f32 {
    contours.level(level).map(|ring| ring.signed_area() as f32).sum()
}

/// Length of all rings of a level.
pub(crate) fn total_length(contours: &Contours, level: i32) -> f32 {
    contours.level(level).map(|ring| length(&ring.points)).sum()
}

/// Mean distance between the levels: the area between two of them over their mean length.
fn spacing(contours: &Contours) -> f32 {
    let last = contours.levels().map_or(0, |(_, highest)| highest);
    let between: f32 = (0..last).map(|k| area(contours, k) - area(contours, k + 1)).sum();
    let lengths: f32 = (0..last).map(|k| 0.5 * (total_length(contours, k) + total_length(contours, k + 1))).sum();
    between / lengths.max(1e-6)
}
