//! How a crack would divide the domain around a place.

use super::{
    division::{rim_towards, rims},
    draws,
    state::CrackGrowth,
};
use crate::math::{hash_unit, ops};
use glam::{Vec2, Vec4};
use std::f32::consts::PI;

/// Axes along which the width of a domain is measured.
pub(super) const AXES: usize = 8;

/// Distance to which the width of a domain is measured, in distances to its nearest crack.
const FAR: f32 = 2.5;

/// An open side of a domain counts as this many times the measured distance.
const OPEN: f32 = 2.0;

/// Beyond the rim by less than this many times the measured distance, a domain is open.
const BEYOND: f32 = 1.5;

/// How much a crack avoids starting where it would meet others at a slant.
const SLANT: f32 = 0.25;

/// Additional weight of that for a straight crack.
const STEEP: f32 = 0.75;

/// Per axis: the distance of the nearest crack in one direction, and how much the angle there deviates from a right
/// angle, 0..=1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    pub(super) distance: [f32; AXES],
    slant: [f32; AXES],
}

/// How a crack would divide a domain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Across {
    /// The shorter direction.
    pub(super) way: Vec2,
    /// Where it would start, in the middle of the longer direction.
    pub(super) middle: Vec2,
    /// The length in the longer direction, and its ratio to the shorter one.
    pub(super) length: f32,
    pub(super) longer: f32,
}

impl CrackGrowth {
    /// The nearest cracks within `far` of a place, forward and backward along each axis.
    pub(super) fn look_around(&self, pos: Vec2, axes: &[Vec2; AXES], far: f32) -> [Sight; 2] {
        let mut sight = [Sight { distance: [f32::INFINITY; AXES], slant: [0.0; AXES] }; 2];
        let Some(arrest) = &self.arrest else { return sight };
        // Four axes at once.
        const LANES: usize = 4;
        let fours = |number: fn(&Vec2) -> f32| -> [Vec4; AXES / LANES] {
            std::array::from_fn(|k| Vec4::from_array(std::array::from_fn(|i| number(&axes[LANES * k + i]))))
        };
        let (x, y) = (fours(|axis| axis.x), fours(|axis| axis.y));
        let mut nearest = [[(Vec4::INFINITY, Vec4::ZERO); AXES / LANES]; 2];
        arrest.walls.each_near(pos, far, |from, to| {
            let (from, way) = (from - pos, to - from);
            let length_sq = way.length_squared();
            for (k, (&x, &y)) in x.iter().zip(&y).enumerate() {
                let (slope, across) = (x * way.y - y * way.x, x * from.y - y * from.x);
                let share = -across / slope;
                let is_on = share.cmpge(Vec4::ZERO) & share.cmple(Vec4::ONE);
                if !is_on.any() {
                    continue;
                }
                let distance = x * from.x + y * from.y + share * (x * way.x + y * way.y);
                let slant = Vec4::ONE - slope * slope / length_sq;
                for (nearest, ahead) in nearest.iter_mut().zip([distance, -distance]) {
                    let before = nearest[k];
                    let is_nearer = is_on & ahead.cmpge(Vec4::ZERO) & ahead.cmplt(before.0);
                    nearest[k] = (Vec4::select(is_nearer, ahead, before.0), Vec4::select(is_nearer, slant, before.1));
                }
            }
        });
        for (sight, nearest) in sight.iter_mut().zip(nearest) {
            for (k, (distance, slant)) in nearest.into_iter().enumerate() {
                sight.distance[LANES * k..LANES * (k + 1)].copy_from_slice(&distance.to_array());
                sight.slant[LANES * k..LANES * (k + 1)].copy_from_slice(&slant.to_array());
            }
        }
        sight
    }

    /// How far an impact has loaded the surface in the direction `way` from its hit.
    pub(super) fn rim_of(&self, impact: u32, way: Vec2) -> f32 {
        rim_towards(way, self.reach_of_impact(impact), self.seed ^ u64::from(impact))
    }

    /// Whether a place, `way` from the hit of an impact, is outside the area that it has loaded.
    pub(super) fn is_beyond_rim(&self, impact: u32, way: Vec2) -> bool {
        let (length, reach) = (way.length(), self.reach_of_impact(impact));
        let [nearest, farthest] = rims(reach);
        length > farthest || length > nearest && length > self.rim_of(impact, way)
    }

    fn reach_of_impact(&self, impact: u32) -> f32 {
        self.division.as_ref().map_or(f32::INFINITY, |division| division.reach_of(impact))
    }

    /// How a crack would divide the domain around a place; `None` if it could not end at other cracks.
    pub(super) fn across(&self, pos: Vec2, impact: u32, name: u32, clearance: f32) -> Option<Across> {
        let across = self.across_from(pos, impact, name, clearance)?;
        if self.params.straightness <= 0.0 {
            return Some(across);
        }
        // Measured again from the middle of the domain, which is more precise.
        let again = self.across_from(across.middle, impact, name, clearance);
        Some(again.map_or(across, |again| Across { middle: across.middle, ..again }))
    }

    /// The same, measured from that place.
    fn across_from(&self, pos: Vec2, impact: u32, name: u32, clearance: f32) -> Option<Across> {
        let draw = |what: u64| hash_unit(self.seed ^ what, u64::from(name));
        let turn = PI * draw(draws::DOMAIN_AXES);
        let axes: [Vec2; AXES] = std::array::from_fn(|i| ops::unit(turn + PI * i as f32 / AXES as f32));
        let far = FAR * clearance;
        let sight = self.look_around(pos, &axes, far);
        let (extent, hit) = (self.network.extent(), self.impacts.get(impact as usize).map_or(pos, |impact| impact.pos));
        let mut is_closed = [true; AXES];
        let mut seen = [[(0.0, 0.0); 2]; AXES];
        for (i, seen) in seen.iter_mut().enumerate() {
            for (side, way) in [axes[i], -axes[i]].into_iter().enumerate() {
                let (border, slant) = to_border(pos, way, extent);
                let crack = sight[side].distance[i];
                seen[side] = if border < crack { (border, slant) } else { (crack, sight[side].slant[i]) };
                let distance = seen[side].0;
                if distance > far {
                    let leaves = self.is_beyond_rim(impact, pos + way * distance.min(BEYOND * far) - hit);
                    is_closed[i] &= !leaves;
                    seen[side] = (if leaves { OPEN * far } else { far }, 0.5);
                }
            }
        }
        let (out, near_hit) = ((pos - hit).normalize_or_zero(), self.params.near_hit(pos.distance(hit)));
        let sum = |i: usize| seen[i % AXES][0].0 + seen[i % AXES][1].0;
        let around = |i: usize| 0.5 * sum(i) + 0.25 * (sum(i + 1) + sum(i + AXES - 1));
        let score = |i: usize| {
            let slant = 1.0 + (SLANT + STEEP * self.params.straightness) * (seen[i][0].1 + seen[i][1].1);
            around(i) * slant * (1.0 + 1.2 * near_hit * (1.0 - axes[i].dot(out).abs()))
        };
        let may_leave = self.division.as_ref().is_none_or(|division| division.generation == 0);
        let best = (0..AXES).filter(|&i| may_leave || is_closed[i]).min_by(|&a, &b| score(a).total_cmp(&score(b)))?;
        // In the middle of its length.
        let long = (best + AXES / 2) % AXES;
        let middle = pos + axes[long] * (0.4 * (seen[long][0].0 - seen[long][1].0));
        let middle = if self.is_beyond_rim(impact, middle - hit) { pos } else { middle };
        let stray =
            2.0 * self.params.wander * (1.0 - 0.7 * self.params.straightness) * (2.0 * draw(draws::DOMAIN_STRAY) - 1.0);
        let way = (axes[best] + axes[best].perp() * stray).normalize_or(Vec2::X);
        let length = around(long);
        Some(Across { way, middle: middle.clamp(Vec2::ZERO, extent), length, longer: length / around(best).max(1e-6) })
    }
}

/// Distance of the border from `pos` in a direction, and deviation from a right angle there.
fn to_border(pos: Vec2, way: Vec2, extent: Vec2) -> (f32, f32) {
    let along = |pos: f32, way: f32, extent: f32| match () {
        () if way > 0.0 => (extent - pos) / way,
        () if way < 0.0 => -pos / way,
        () => f32::INFINITY,
    };
    let (x, y) = (along(pos.x, way.x, extent.x), along(pos.y, way.y, extent.y));
    if x < y { (x, way.y * way.y) } else { (y, way.x * way.x) }
}
