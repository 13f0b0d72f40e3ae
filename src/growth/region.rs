//! The part of a surface in which a hit creates markers, and its cells.

use super::{
    draws,
    params::{GrowthParams, MarkerLayout},
};
use crate::{
    Grid,
    math::{hash_unit, ops},
};
use glam::{UVec2, Vec2};
use std::f32::consts::TAU;

/// The ring-shaped part of a surface in which one hit creates markers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    pub(super) center: Vec2,
    /// The part closer than this already has markers.
    pub(super) inner: f32,
    pub(super) outer: f32,
    pub(super) extent: Vec2,
}

impl Region {
    /// Distance from the centre as a share of the reach; `None` outside the region or the surface.
    pub(super) fn share(&self, pos: Vec2, uneven: f32, seed: u64) -> Option<f32> {
        let away = self.away(pos, uneven, seed);
        let distance = pos.distance(self.center);
        let distance = if away < 1.0 { distance / away } else { distance };
        let inside = pos.cmpge(Vec2::ZERO).all() && pos.cmple(self.extent).all();
        (inside && distance >= self.inner && distance < self.outer).then_some(distance / self.outer)
    }

    /// The reach of the hit in the direction of a place, as a share of its largest reach.
    fn away(&self, pos: Vec2, uneven: f32, seed: u64) -> f32 {
        if uneven <= 0.0 {
            return 1.0;
        }
        let way = (pos - self.center).normalize_or(Vec2::X);
        // Cosines of multiples of the angle, each with a random phase.
        let (mut power, mut sum) = (way, 0.0);
        for wave in 2..=5u64 {
            power = power.rotate(way);
            sum += power.dot(ops::unit(TAU * hash_unit(seed ^ draws::UNEVEN_REACH, wave)));
        }
        1.0 - uneven * (0.5 + 0.35 * sum).clamp(0.0, 1.0)
    }
}

/// A probability over the surface, at any resolution.
pub(super) fn density_at(density: Option<&Grid<f32>>, pos: Vec2, extent: Vec2) -> f32 {
    let Some(grid) = density else { return 1.0 };
    let size = grid.size();
    let texel = (pos / extent * size.as_vec2()).as_uvec2();
    let value = grid.get(texel.x.min(size.x.saturating_sub(1)), texel.y.min(size.y.saturating_sub(1)));
    value.filter(|p| p.is_finite()).unwrap_or(0.0)
}

/// A rectangle of cells, row by row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells {
    pub(super) x: (u32, u32),
    pub(super) y: (u32, u32),
}

impl Cells {
    pub(super) const fn columns(&self) -> u32 {
        self.x.1 - self.x.0
    }

    pub(super) fn rows(&self) -> u64 {
        u64::from(self.y.1 - self.y.0)
    }
}

/// The largest number of rows or columns of a grid on a long surface.
const MAX_LINES: u32 = 4096;

/// Columns and rows of the grid on a surface: in proportion to its size relative to the unit square.
pub(super) fn grid(params: &GrowthParams, extent: Vec2) -> UVec2 {
    let count = |number: u32, length: f32| ((number as f32 * length).round() as u32).clamp(1, MAX_LINES);
    UVec2::new(count(params.num_columns_grid, extent.x), count(params.num_lines_grid, extent.y))
}

/// Approximate distance between the markers of a layout.
pub(super) fn spacing(params: &GrowthParams, extent: Vec2) -> f32 {
    match params.markers {
        MarkerLayout::PseudoGrid { .. } => (extent / grid(params, extent).as_vec2()).max_element(),
        MarkerLayout::DartThrowing { spacing } => spacing,
        MarkerLayout::Rays { .. } | MarkerLayout::Strands { .. } => 0.5 * params.crack_radius,
    }
}

/// Side of the cells for darts, and the cells that a region may touch.
pub(super) fn dart_cells(region: &Region, spacing: f32) -> (f32, Cells) {
    let cell = spacing * std::f32::consts::FRAC_1_SQRT_2;
    let all = (region.extent / cell).ceil().as_uvec2();
    let x = span(region.center.x, region.outer, cell, all.x);
    (cell, Cells { x, y: span(region.center.y, region.outer, cell, all.y) })
}

/// The cells of `0..count` that a circle of `radius` around `center` may touch.
pub(super) fn span(center: f32, radius: f32, cell: f32, count: u32) -> (u32, u32) {
    let low = ((center - radius) / cell - 1.0).max(0.0) as u32;
    let high = ((center + radius) / cell + 2.0).max(0.0) as u32;
    (low.min(count), high.min(count))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An uneven hit reaches nowhere further than an even one, and in some directions less far.
    #[test]
    fn uneven_hits_reach_less_far_in_some_directions() {
        let region = Region { center: Vec2::splat(0.5), inner: 0.0, outer: 0.4, extent: Vec2::ONE };
        for seed in 0..50 {
            let reach = |uneven: f32| {
                (0..64).map(move |i| region.away(region.center + ops::unit(TAU * i as f32 / 64.0) * 0.1, uneven, seed))
            };
            assert!(reach(0.0).all(|share| share == 1.0));
            let (least, most) =
                reach(0.8).fold((1.0f32, 0.0f32), |(low, high), share| (low.min(share), high.max(share)));
            assert!(least >= 0.2 - 1.0e-6 && most <= 1.0 && most - least > 0.2, "{least} to {most}");
        }
    }
}
