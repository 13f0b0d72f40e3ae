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
    /// Energy of the hit, when it came.
    pub(super) energy: f32,
    /// What lies closer was populated before.
    pub(super) inner: f32,
    pub(super) outer: f32,
    pub(super) extent: Vec2,
}

impl Region {
    /// Share of the way from the centre to the rim; `None` outside of the region or the surface.
    fn share(&self, pos: Vec2) -> Option<f32> {
        let distance = pos.distance(self.center);
        let inside = pos.cmpge(Vec2::ZERO).all() && pos.cmple(self.extent).all();
        (inside && distance >= self.inner && distance < self.outer).then_some(distance / self.outer)
    }
}

/// A probability over the surface, at any resolution.
fn density_at(density: Option<&Grid<f32>>, pos: Vec2, extent: Vec2) -> f32 {
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
        let share = region.share(pos)?;
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
        MarkerLayout::Polar { sectors, rings, ring_growth, jitter, occupancy } => {
            let turn = TAU * hash_unit(seed, 0);
            let sectors = by_energy(sectors, region.energy, 360);
            for ray in cursor.slice(u64::from(sectors), cost * rings) {
                let mut rng = Rng::new(mix(seed ^ ray));
                let mut angle = turn + TAU * (ray as f32 + jitter * (rng.unit() - 0.5)) / sectors as f32;
                // Half of the rays end early: few of the radials of a pane reach its edge.
                let (draw, early) = (rng.unit(), rng.unit() < 0.5);
                let cut = if early { 0.55 + 0.4 * draw } else { 0.5 * draw };
                let length = region.outer * (1.0 - jitter * cut);
                let first = params.reach * ring_share(1, rings, ring_growth);
                let mut radius = 0.0;
                for ring in 1..=4 * rings {
                    let gap = params.reach * ring_share(ring, rings, ring_growth) - radius;
                    radius += gap;
                    if radius >= length || gap <= 0.0 {
                        break;
                    }
                    // A ray bends a little from ring to ring.
                    angle += 0.06 * jitter * rng.signed() * (first / radius.max(first)).max(0.25);
                    let along = radius + 0.5 * jitter * gap * rng.signed();
                    let (pos, chance) = (region.center + params.direct(ops::unit(angle)) * along, rng.unit());
                    offer(pos, chance, occupancy);
                    if pos.clamp(Vec2::ZERO, region.extent) != pos {
                        // A ray that leaves the surface runs up to its border.
                        let arm = pos - region.center;
                        let to_border = |center: f32, arm: f32, extent: f32| {
                            if arm > 0.0 { (extent - center) / arm } else { -center / arm }
                        };
                        let share = to_border(region.center.x, arm.x, region.extent.x).min(to_border(
                            region.center.y,
                            arm.y,
                            region.extent.y,
                        ));
                        let border = (region.center + arm * share).clamp(Vec2::ZERO, region.extent);
                        offer(border, 0.0, occupancy);
                        break;
                    }
                }
            }
            cursor.is_at(u64::from(sectors))
        }
    };
    cursor.kept = kept;
    if is_over && region.inner == 0.0 && kept < FEWEST {
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
fn spacing(params: &GrowthParams, extent: Vec2) -> f32 {
    match params.markers {
        MarkerLayout::PseudoGrid { .. } => (extent / grid(params, extent).as_vec2()).max_element(),
        MarkerLayout::DartThrowing { spacing } => spacing,
        MarkerLayout::Polar { rings, .. } => params.reach / rings as f32,
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

/// Radius of ring `ring` of `rings`, as a share of the reach; each gap is `growth` times the one before.
fn ring_share(ring: u32, rings: u32, growth: f32) -> f32 {
    if (growth - 1.0).abs() < 1e-3 {
        ring as f32 / rings as f32
    } else {
        (ops::powf(growth, ring as f32) - 1.0) / (ops::powf(growth, rings as f32) - 1.0)
    }
}

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

/// Rings of a crushed core.
const CORE_RINGS: u32 = 3;

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
        StartLayout::Point => vec![center],
        StartLayout::Points { count } => {
            let mut places = scatter(((count as f32 * energy).ceil() as u32).clamp(1, 1024), reach);
            places[0] = center;
            places
        }
        StartLayout::Disc { count, radius } => scatter(count, radius),
        StartLayout::Crushed { count, radius } => {
            // Rings around a centre, each node a little off its place.
            let (count, radius) = (by_energy(count, energy, 1024), radius * energy.sqrt().sqrt());
            let mut places = vec![center];
            for ring in 1..=CORE_RINGS {
                let share = ring as f32 / CORE_RINGS as f32;
                let n = ((count as f32 * share) as u32).max(3);
                let turn = rng.unit();
                places.extend((0..n).map(|i| {
                    let angle = TAU * (i as f32 + turn + 0.35 * rng.signed()) / n as f32;
                    center + ops::unit(angle) * (radius * share * (1.0 + 0.15 * rng.signed()))
                }));
            }
            places
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
