//! Layouts of markers.

use super::{
    cursor::Cursor,
    layout::Keeper,
    params::{GrowthParams, MarkerLayout},
    region::{Cells, Region, dart_cells, density_at, grid, spacing, span},
    starts::room,
};
use crate::{
    Grid,
    math::{Rng, hash_unit, mix, ops},
    pattern::CrackMask,
};
use glam::Vec2;
use std::f32::consts::TAU;

/// Gives `keeper` the next markers that `params` lay out in `region`, in a fixed order, up to the limit of the slice.
/// Returns whether those were the last ones.
///
/// Each random draw depends only on the place. So a hit whose energy increases only adds a ring of markers, and
/// slices may be of any size.
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
    // A hit near the border has little room as it is.
    let uneven = params.reach_variation * room(region.center, params.reach, region.extent);
    // Decides whether a marker is created at a place, and where it moves.
    let settle = |pos: Vec2, chance: f32, probability: f32| {
        let share = region.share(pos, uneven, seed)?;
        let mut thinned = if params.focus > 0.0 { ops::powf(1.0 - share, params.focus) } else { 1.0 };
        let mut pos = pos;
        if !mask.is_empty() {
            let (place, liking) = to_weak_place(pos, apart, mask, region.extent, seed);
            (pos, thinned) = (place, thinned * liking);
        }
        let density = density_at(density, pos, region.extent) * mask.density_at(pos / region.extent);
        (chance < probability * thinned * density).then_some(pos)
    };
    // A closer marker is reached at once.
    let counts = |pos: Vec2| u32::from(pos.distance(region.center) > 1.5 * params.kill_distance);
    let mut offer = |pos: Vec2, chance: f32, probability: f32| {
        if let Some(pos) = settle(pos, chance, probability) {
            keeper.keep(pos);
            kept += counts(pos);
        }
    };
    // With a mask several places are tried.
    let cost = if mask.is_empty() { 1 } else { TRIES };
    let is_over = match params.markers {
        // Markers of rays are created with their plan.
        MarkerLayout::Rays { .. } | MarkerLayout::Strands { .. } => true,
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
            // One dart per cell and round; the cells are so small that each holds at most one marker.
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
            let density = density_at(density, pos, region.extent) * mask.density_at(pos / region.extent);
            if density > 0.0 && !mask.is_forbidden(pos / region.extent) {
                keeper.keep(pos);
            }
        }
    }
    is_over
}

/// Rounds of darts, one dart per cell and round.
const DART_ROUNDS: u64 = 6;

/// Places that are tried to find the weakest one.
const TRIES: u32 = 24;

/// The weakest place near a marker, and the share of its probability there: zero where cracks are forbidden; small
/// where the whole neighbourhood is strong, or where nothing near is weak although other places of the surface are.
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

/// A place `arm` away from the hit along the longer side, where there is more room. Even a surface that is almost a
/// line has such a place.
fn towards_room(region: Region, arm: f32) -> Vec2 {
    let axis = if region.extent.x >= region.extent.y { Vec2::X } else { Vec2::Y };
    let is_in_first_half = region.center.dot(axis) < 0.5 * region.extent.dot(axis);
    (region.center + if is_in_first_half { arm } else { -arm } * axis).clamp(Vec2::ZERO, region.extent)
}

/// Number of markers that even the weakest hit creates, so that it is visible.
const FEWEST: u32 = 3;
