//! Where markers and starts come to lie.

use super::{
    layout::{Cursor, Keeper},
    params::{GrowthParams, MarkerLayout, StartLayout},
};
use crate::{
    Grid,
    math::{Rng, hash_unit, mix, ops},
    pattern::CrackMask,
};
use glam::{UVec2, Vec2};
use std::f32::consts::TAU;

/// The ring-shaped part of a surface that one hit populates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    pub(super) center: Vec2,
    /// What lies closer was populated before.
    pub(super) inner: f32,
    pub(super) outer: f32,
    pub(super) extent: Vec2,
}

impl Region {
    /// Share of the way from the centre to the rim; `None` outside of the region or the surface.
    fn share(&self, pos: Vec2, uneven: f32, seed: u64) -> Option<f32> {
        let away = self.away(pos, uneven, seed);
        let distance = pos.distance(self.center);
        let distance = if away < 1.0 { distance / away } else { distance };
        let inside = pos.cmpge(Vec2::ZERO).all() && pos.cmple(self.extent).all();
        (inside && distance >= self.inner && distance < self.outer).then_some(distance / self.outer)
    }

    /// How far the hit reaches in the direction of a place, as a share of how far it does at the most.
    fn away(&self, pos: Vec2, uneven: f32, seed: u64) -> f32 {
        if uneven <= 0.0 {
            return 1.0;
        }
        let way = (pos - self.center).normalize_or(Vec2::X);
        // Cosines of multiples of the angle, each turned by a draw.
        let (mut power, mut sum) = (way, 0.0);
        for wave in 2..=5u64 {
            power = power.rotate(way);
            sum += power.dot(ops::unit(TAU * hash_unit(seed ^ 0xA4, wave)));
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

/// Gives `keeper` the next markers that `params` lay out in `region`, in a fixed order, as far as the slice goes. Returns whether those were the
/// last ones.
///
/// Each draw depends on the place alone, so that a hit that grows by energy only adds a ring, and slices may be of any size.
pub(super) fn lay_out(
    params: &GrowthParams,
    region: Region,
    (density, mask): (Option<&Grid<f32>>, &CrackMask),
    seed: u64,
    cursor: &mut Cursor,
    keeper: &mut Keeper<'_>,
) -> bool {
    let mut kept = cursor.kept;
    let apart = spacing(params, region.extent);
    // Where a marker comes to lie that is offered a place, if it does.
    let settle = |pos: Vec2, chance: f32, probability: f32| {
        let share = region.share(pos, params.uneven, seed)?;
        let mut thinned = if params.focus > 0.0 { ops::powf(1.0 - share, params.focus) } else { 1.0 };
        let mut pos = pos;
        if !mask.is_empty() {
            let (place, liking) = to_weak_place(pos, apart, mask, region.extent, seed);
            (pos, thinned) = (place, thinned * liking);
        }
        (chance < probability * thinned * density_at(density, pos, region.extent)).then_some(pos)
    };
    // A closer one dies at once.
    let counts = |pos: Vec2| u32::from(pos.distance(region.center) > 1.5 * params.kill_distance);
    let mut offer = |pos: Vec2, chance: f32, probability: f32| {
        if let Some(pos) = settle(pos, chance, probability) {
            keeper.keep(pos);
            kept += counts(pos);
        }
    };
    // Places that may move are looked for.
    let cost = if mask.is_empty() { 1 } else { TRIES };
    let is_over = match params.markers {
        // They come with their plan.
        MarkerLayout::Rays { .. } => true,
        MarkerLayout::PseudoGrid { occupancy, jitter } => {
            let [columns, lines] = grid(params, region.extent).to_array();
            let cell = region.extent / Vec2::new(columns as f32, lines as f32);
            let cells = Cells {
                x: span(region.center.x, region.outer, cell.x, columns),
                y: span(region.center.y, region.outer, cell.y, lines),
            };
            for y in cursor.slice(cells.rows(), cost * cells.columns()) {
                let y = cells.y.0 + y as u32;
                for x in cells.x.0..cells.x.1 {
                    let vertex = mix(seed ^ (u64::from(y) << 32 | u64::from(x)));
                    let stray = Vec2::new(hash_unit(vertex, 1), hash_unit(vertex, 2)) - 0.5;
                    let pos = (Vec2::new(x as f32, y as f32) + 0.5 + stray * jitter) * cell;
                    offer(pos, hash_unit(vertex, 0), occupancy);
                }
            }
            cursor.is_at(cells.rows())
        }
        MarkerLayout::DartThrowing { spacing } => {
            // One dart per cell and round; the cells are small enough that each holds at most one marker.
            let (cell, cells) = dart_cells(&region, spacing);
            let rows = DART_ROUNDS * cells.rows();
            for row in cursor.slice(rows, cost * cells.columns()) {
                let (round, row) = (row / cells.rows(), row % cells.rows());
                let (y, first) = (cells.y.0 + row as u32, row * u64::from(cells.columns()));
                for (x, index) in (cells.x.0..cells.x.1).zip(first..) {
                    if keeper.is_covered(index) {
                        continue;
                    }
                    let dart = mix(seed ^ (u64::from(y) << 32 | u64::from(x))).wrapping_add(round);
                    let stray = Vec2::new(hash_unit(dart, 1), hash_unit(dart, 2));
                    let pos = (Vec2::new(x as f32, y as f32) + stray) * cell;
                    if let Some(pos) = settle(pos, hash_unit(dart, 0), 1.0) {
                        keeper.throw(pos, spacing);
                        kept += counts(pos);
                    }
                }
            }
            cursor.is_at(rows)
        }
    };
    cursor.kept = kept;
    let has_rays = matches!(params.markers, MarkerLayout::Rays { .. });
    if is_over && region.inner == 0.0 && kept < FEWEST && !has_rays {
        let mut rng = Rng::new(seed).stream("fewest");
        let turn = rng.unit();
        for i in 0..FEWEST {
            let angle = TAU * (turn + (i as f32 + 0.6 * rng.unit()) / FEWEST as f32);
            let arm = (region.outer * rng.range(0.5, 0.95)).max(2.0 * params.kill_distance);
            let arm = arm.min(0.95 * params.crack_radius);
            let pos = region.center + ops::unit(angle) * arm;
            let inside = pos.cmpge(Vec2::ZERO).all() && pos.cmple(region.extent).all();
            let pos = if inside { pos } else { towards_room(region, arm) };
            if density_at(density, pos, region.extent) > 0.0 && !mask.is_forbidden(pos / region.extent) {
                keeper.keep(pos);
            }
        }
    }
    is_over
}

/// Rounds of darts, one for each cell.
const DART_ROUNDS: u64 = 6;

/// Side of the cells for darts, and the cells that a region may touch.
pub(super) fn dart_cells(region: &Region, spacing: f32) -> (f32, Cells) {
    let cell = spacing * std::f32::consts::FRAC_1_SQRT_2;
    let all = (region.extent / cell).ceil().as_uvec2();
    let x = span(region.center.x, region.outer, cell, all.x);
    (cell, Cells { x, y: span(region.center.y, region.outer, cell, all.y) })
}

/// Cells from one column and row to others, row by row.
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

/// The most lines or columns of a grid, however long the surface.
const MAX_LINES: u32 = 4096;

/// Columns and lines of the grid on a surface: as many more as it is larger than the unit square.
fn grid(params: &GrowthParams, extent: Vec2) -> UVec2 {
    let count = |number: u32, length: f32| ((number as f32 * length).round() as u32).clamp(1, MAX_LINES);
    UVec2::new(count(params.num_columns_grid, extent.x), count(params.num_lines_grid, extent.y))
}

/// About how far the markers of a layout lie from each other.
pub(super) fn spacing(params: &GrowthParams, extent: Vec2) -> f32 {
    match params.markers {
        MarkerLayout::PseudoGrid { .. } => (extent / grid(params, extent).as_vec2()).max_element(),
        MarkerLayout::DartThrowing { spacing } => spacing,
        MarkerLayout::Rays { .. } => 0.5 * params.crack_radius,
    }
}

/// Places that are looked at for the weakest one.
const TRIES: u32 = 24;

/// The weakest place near a marker, and how much of its chance it keeps there: none where cracks are forbidden, little where
/// all around is strong or, if some places of the surface are weak, nothing here is.
fn to_weak_place(pos: Vec2, apart: f32, mask: &CrackMask, extent: Vec2, seed: u64) -> (Vec2, f32) {
    let place = mix(seed ^ u64::from(pos.x.to_bits()) << 32 ^ u64::from(pos.y.to_bits()));
    let mut best = (pos, f32::NEG_INFINITY);
    for i in 0..TRIES {
        let stray = ops::unit(TAU * hash_unit(place, u64::from(2 * i))) * hash_unit(place, u64::from(2 * i + 1)).sqrt();
        let near = if i == 0 { pos } else { (pos + stray * (0.8 * apart)).clamp(Vec2::ZERO, extent) };
        let uv = near / extent;
        let liking = mask.weak_at(uv) - mask.strong_at(uv);
        if liking > best.1 && !mask.is_forbidden(uv) {
            best = (near, liking);
        }
    }
    let kept = match best.1 {
        f32::NEG_INFINITY => 0.0,
        liking if mask.weak.is_some() => (0.15 + 1.2 * liking).clamp(0.02, 1.0),
        liking => (1.0 + liking).clamp(0.02, 1.0),
    };
    (best.0, kept)
}

/// A place `arm` away from the hit, along the longer side, where there is more room: even a surface that is hardly more than a
/// line has one.
fn towards_room(region: Region, arm: f32) -> Vec2 {
    let axis = if region.extent.x >= region.extent.y { Vec2::X } else { Vec2::Y };
    let is_in_first_half = region.center.dot(axis) < 0.5 * region.extent.dot(axis);
    (region.center + if is_in_first_half { arm } else { -arm } * axis).clamp(Vec2::ZERO, region.extent)
}

/// Markers that even the weakest hit lays out, so that it shows.
const FEWEST: u32 = 3;

/// The cells of `0..count` that a circle of `radius` around `center` may touch.
fn span(center: f32, radius: f32, cell: f32, count: u32) -> (u32, u32) {
    let low = ((center - radius) / cell - 1.0).max(0.0) as u32;
    let high = ((center + radius) / cell + 2.0).max(0.0) as u32;
    (low.min(count), high.min(count))
}

/// What is `count` at energy 1.
fn by_energy(count: u32, energy: f32, most: u32) -> u32 {
    ((count as f32 * energy.sqrt()).round() as u32).clamp(2, most.max(2))
}

/// Directions in which the room around a hit is measured.
const DIRECTIONS: usize = 64;

/// Directions to either side of an arm in which there should be as much room as on its way: 17 degrees.
const BESIDE: usize = 3;

/// How much of `reach` there is on the surface in each direction from `center`, 0..=1.
fn rooms(center: Vec2, reach: f32, extent: Vec2) -> [f32; DIRECTIONS] {
    std::array::from_fn(|i| {
        let way = ops::unit(TAU * i as f32 / DIRECTIONS as f32);
        let to_border = |center: f32, way: f32, extent: f32| match way {
            way if way > 1e-6 => (extent - center) / way,
            way if way < -1e-6 => -center / way,
            _ => f32::INFINITY,
        };
        let far = to_border(center.x, way.x, extent.x).min(to_border(center.y, way.y, extent.y));
        (far / reach).clamp(0.0, 1.0)
    })
}

/// Share of the surroundings of a hit that lies on the surface, 0..=1.
pub(super) fn room(center: Vec2, reach: f32, extent: Vec2) -> f32 {
    rooms(center, reach, extent).iter().sum::<f32>() / DIRECTIONS as f32
}

/// The directions of the arms of a hit: spread evenly, each a little off its place, over those in which there is room.
pub(super) fn arms(count: u32, (center, energy): (Vec2, f32), reach: f32, extent: Vec2, seed: u64) -> Vec<Vec2> {
    let mut rng = Rng::new(seed).stream("arms");
    let rooms = rooms(center, reach, extent);
    // An arm that has hardly any room would not be seen, one that runs along the border would soon run into it.
    let weights: [f32; DIRECTIONS] = std::array::from_fn(|i| {
        let beside = (0..=2 * BESIDE).map(|k| rooms[(i + DIRECTIONS + k - BESIDE) % DIRECTIONS]);
        beside.fold(1.0, f32::min).powi(2) + 1e-4
    });
    let total: f32 = weights.iter().sum();
    let share = 0.7 + 0.3 * rooms.iter().sum::<f32>() / DIRECTIONS as f32;
    let count = ops::powf(energy, 1.0 / 3.0) * count as f32 * share;
    let count = ((count + 0.5 + 0.55 * rng.signed()) as u32).clamp(2, 1024);
    let turn = rng.unit();
    let angle = |place: f32| {
        // The direction before which so much of the room lies.
        let mut left = place.rem_euclid(1.0) * total;
        for (i, weight) in weights.iter().enumerate() {
            if left < *weight {
                return TAU * (i as f32 - 0.5 + left / weight) / DIRECTIONS as f32;
            }
            left -= weight;
        }
        0.0
    };
    let mut places = (0..count).map(|i| (i as f32 + turn + 0.2 * rng.signed()) / count as f32).collect::<Vec<_>>();
    places.iter_mut().map(|place| ops::unit(angle(*place))).collect()
}

/// The places of the first nodes of a hit.
pub(super) fn starts(
    layout: StartLayout,
    (center, energy): (Vec2, f32),
    reach: f32,
    extent: Vec2,
    seed: u64,
) -> Vec<Vec2> {
    let mut rng = Rng::new(seed).stream("starts");
    let mut scatter = |count: u32, radius: f32| {
        (0..count).map(|_| center + ops::unit(TAU * rng.unit()) * (radius * rng.unit().sqrt())).collect::<Vec<_>>()
    };
    let mut places = match layout {
        StartLayout::Point | StartLayout::Arms { .. } => vec![center],
        StartLayout::Points { count } => {
            let mut places = scatter(((count as f32 * energy).ceil() as u32).clamp(1, 1024), reach);
            places[0] = center;
            places
        }
        StartLayout::Disc { count, radius } => scatter(count, radius),
        StartLayout::Crushed { count, radius } => {
            let (count, radius) = (by_energy(count, energy, 1024), radius * energy.sqrt().sqrt());
            let turn = rng.unit();
            let angle = |i, stray: f32| TAU * (i as f32 + turn + 0.35 * stray) / count as f32;
            (0..count).map(|i| center + ops::unit(angle(i, rng.signed())) * radius).collect()
        }
        StartLayout::Ring { count, radius } => {
            let turn = rng.unit();
            (0..count).map(|i| center + ops::unit(TAU * (i as f32 + turn) / count as f32) * radius).collect()
        }
    };
    for place in &mut places {
        *place = place.clamp(Vec2::ZERO, extent);
    }
    places
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
