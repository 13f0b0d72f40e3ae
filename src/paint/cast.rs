//! Shadows that the edges of cracks cast on their walls and floors.

use super::patch::BLOCK;
use crate::Grid;
use glam::UVec2;

/// How far light falls by for each texel of its way: it comes from the upper left, 39 degrees above the surface.
const FALL: f32 = 0.8;

/// The two ways to the light, texels of a step: it is no point, so that shadows have soft ends, and cracks that run towards it have some too.
const WAYS: [[u32; 2]; 2] = [[2, 1], [1, 2]];

/// Length of a step, texels.
const STEP: f32 = 2.236_068;

/// The steps after which there is a look at the depth.
const SAMPLED_STEPS: [u16; 10] = [1, 2, 3, 4, 6, 8, 11, 16, 22, 32];

/// Height over which a shadow ends, texels.
const SOFT: f32 = 1.5;

/// Cracks are at least so many texels deep: in a coarse picture their shadows are shorter than a texel.
const LEAST: f32 = 3.0;

/// And at most so many, so that no shadow is longer than the last of the steps.
const MOST: f32 = 57.0;

/// One over the depth from which on a wall is lit as much as it can be; one that is less deep belongs to a fine crack.
const WALL: f32 = 3.0;

/// Shadows of cracks of one height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cast {
    /// Height of two steps of depth, texels.
    height: f32,
    /// How far light falls by in a step, in units of that height.
    fall: u16,
    /// How far shadows reach to the right and down, texels.
    pub(super) reach: u32,
}

impl Cast {
    /// For cracks that are about `deep` texels deep at most; `None` for zero.
    pub(super) fn new(deep: f32) -> Option<Self> {
        let deep = if deep > 0.0 { deep.clamp(LEAST, MOST) } else { return None };
        let height = deep / 32767.5;
        let steps = SAMPLED_STEPS.iter().rev().find(|steps| f32::from(**steps - 1) * STEP * FALL <= deep).unwrap_or(&1);
        Some(Self { height, fall: (FALL * STEP / height).round() as u16, reach: 2 * u32::from(*steps) })
    }

    /// Makes the depths of a block deeper where shadows are cast on them, and less deep where light reaches a wall, by up to this share. `facing` is how
    /// far walls face the light, 0..=1. Grounds of cracks do not become less deep, nor do fine cracks, which have no wall that is seen.
    #[inline(always)]
    pub(super) fn adjust_depths(
        &self,
        depths: &Grid<u16>,
        at: UVec2,
        facing: &[f32; BLOCK],
        strength: f32,
        block: &mut [u16; BLOCK],
    ) {
        let shades = self.blocked_light(depths, block, at);
        for i in 0..BLOCK {
            let depth = f32::from(block[i]);
            let share = depth * (1.0 / 65535.0);
            let away = 2.0 * shades[i] - 1.0;
            let lit = (share * WALL).min(1.0) * (1.0 - share * share * share) * (2.0 * facing[i]).clamp(0.0, 1.0);
            let by = if away < 0.0 { away * lit } else { away };
            let deeper = depth * (1.0 + strength * by);
            block[i] = if deeper < 65535.0 { deeper as i32 as u16 } else { u16::MAX };
        }
    }

    /// The share of light at each texel from `at` on that does not reach it.
    #[inline(always)]
    fn blocked_light(&self, depths: &Grid<u16>, own: &[u16; BLOCK], at: UVec2) -> [f32; BLOCK] {
        let mut deepest = 0;
        for &depth in own {
            deepest = deepest.max(depth);
        }
        // From there on no texel of the block is in a shadow. Half of each depth leaves room for sums.
        let end = deepest / 2 + (0.5 * SOFT / self.height) as u16 + 2;
        let mut shades = [0.0; BLOCK];
        for [right, down] in WAYS {
            // The highest of all, as seen along the light.
            let mut highest = [u16::MAX; BLOCK];
            for steps in SAMPLED_STEPS {
                let fallen = self.fall.saturating_mul(steps);
                if fallen >= end || 2 * u32::from(steps) > self.reach {
                    break;
                }
                let there = depths_at(depths, at, [right * u32::from(steps), down * u32::from(steps)]);
                for i in 0..BLOCK {
                    highest[i] = highest[i].min((there[i] / 2).saturating_add(fallen));
                }
            }
            for i in 0..BLOCK {
                let above = f32::from(own[i] / 2) - f32::from(highest[i]);
                shades[i] += 0.5 * (above * (self.height / SOFT) + 0.5).clamp(0.0, 1.0);
            }
        }
        shades
    }
}

/// The depths of a block so many texels to the left and above; those of the border beyond it.
#[inline(always)]
fn depths_at(depths: &Grid<u16>, at: UVec2, [left, up]: [u32; 2]) -> [u16; BLOCK] {
    let row = depths.row(at.y.saturating_sub(up) as usize);
    if let Some(from) = at.x.checked_sub(left)
        && let Some(block) = row[from as usize..].first_chunk()
    {
        return *block;
    }
    std::array::from_fn(|i| {
        let x = (at.x as usize + i).saturating_sub(left as usize).min(row.len() - 1);
        row[x]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// The share of light that does not reach a texel, texel by texel.
    fn shade(depths: &Grid<u16>, deep: f64, [x, y]: [i64; 2]) -> f64 {
        let at = |x: i64, y: i64| {
            let inside = |at: i64, size: usize| at.clamp(0, size as i64 - 1) as usize;
            f64::from(depths.row(inside(y, depths.height()))[inside(x, depths.width())]) / 65535.0 * deep
        };
        let mut sum = 0.0;
        for [right, down] in [[2, 1], [1, 2]] {
            let over =
                |steps: i64| at(x, y) - at(x - steps * right, y - steps * down) - 0.8 * 5.0_f64.sqrt() * steps as f64;
            let most = [1, 2, 3, 4, 6, 8, 11, 16, 22, 32].into_iter().map(over).fold(f64::NEG_INFINITY, f64::max);
            sum += 0.5 * (most / 1.5 + 0.5).clamp(0.0, 1.0);
        }
        sum
    }

    #[test]
    fn shadows_are_those_of_each_way_to_the_light() {
        let mut rng = Rng::new(41);
        for case in 0..300 {
            let size = UVec2::new(1 + rng.next_u32() % 40, 1 + rng.next_u32() % 30);
            let mut depths = Grid::new(size, 0);
            for _ in 0..rng.next_u32() % 6 {
                let [from, to] = [0, 1].map(|_| UVec2::new(rng.next_u32() % size.x, rng.next_u32() % size.y));
                let depth = rng.next_u32() as u16;
                for y in from.min(to).y..=from.max(to).y {
                    depths.row_mut(y as usize)[from.min(to).x as usize..=from.max(to).x as usize].fill(depth);
                }
            }
            let deep = rng.range(3.0, 57.0);
            let Some(cast) = Cast::new(deep) else { continue };
            for y in 0..size.y {
                for x in (0..size.x).step_by(BLOCK) {
                    let n = BLOCK.min((size.x - x) as usize);
                    let mut own = [0; BLOCK];
                    own[..n].copy_from_slice(&depths.row(y as usize)[x as usize..x as usize + n]);
                    let shades = cast.blocked_light(&depths, &own, UVec2::new(x, y));
                    for (i, found) in (0..).zip(&shades[..n]) {
                        let wanted = shade(&depths, deep.into(), [i64::from(x) + i, y.into()]);
                        assert!((f64::from(*found) - wanted).abs() < 3.0e-3, "case {case}: {found}, not {wanted}");
                    }
                }
            }
        }
    }

    /// In a slot across the light the side towards it is dark, and the other one is lit if it is wide.
    #[test]
    fn the_far_side_of_a_wide_slot_is_lit() {
        let mut depths = Grid::new(UVec2::new(60, 3), 0);
        depths.as_mut_slice().fill(0);
        (0..3).for_each(|y| depths.row_mut(y)[10..50].fill(u16::MAX));
        let cast = Cast::new(8.0).unwrap();
        let shades =
            |x: u32| cast.blocked_light(&depths, depths.row(1)[x as usize..].first_chunk().unwrap(), UVec2::new(x, 1));
        assert_eq!((shades(10)[0], shades(40)), (1.0, [0.0; BLOCK]));
        assert!(Cast::new(0.0).is_none() && Cast::new(f32::NAN).is_none());
        assert_eq!(Cast::new(f32::INFINITY).map(|cast| cast.reach), Some(64));
    }
}
