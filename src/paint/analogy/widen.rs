//! Cracks that are thinner than those of the photographs are widened to these.
//!
//! The middle of a thin crack lies in the light edge of a wider one, so texels found by distance to the edge would be
//! too light, and the crack would fade. Photographs and surface are widened alike: the same cracks have the same guide.

use crate::raster::TexelRect;
use glam::{IVec2, UVec2};

/// The widest that cracks are widened to, measured from their middle, texels squared.
const MOST: u32 = 16;

/// As `MOST`, texels.
const MOST_SIDE: i32 = 4;

/// One in how many middles of cracks may be thinner.
const THIN_SHARE: usize = 4;

/// A part of a surface, with what is crack in it.
struct Part {
    min: IVec2,
    size: UVec2,
    is_crack: Vec<bool>,
}

impl Part {
    /// A rectangle and `by` texels around it.
    fn new(size: UVec2, rect: TexelRect, by: u32, wraps: bool, is_crack: impl Fn(u32, u32) -> bool) -> Self {
        let (min, side) = (rect.min.as_ivec2() - by as i32, size.as_ivec2());
        let part = rect.size() + 2 * by;
        let ask = |at: IVec2| {
            let inside = if wraps { at.rem_euclid(side) } else { at };
            let is_in = inside.cmpge(IVec2::ZERO).all() && inside.cmplt(side).all();
            is_in && is_crack(inside.x as u32, inside.y as u32)
        };
        let rows = 0..part.y as i32;
        let is_crack = rows.flat_map(|y| (0..part.x as i32).map(move |x| IVec2::new(x, y))).map(|at| ask(min + at));
        Self { min, size: part, is_crack: is_crack.collect() }
    }

    fn index(&self, at: IVec2) -> Option<usize> {
        let is_in = at.cmpge(IVec2::ZERO).all() && at.cmplt(self.size.as_ivec2()).all();
        is_in.then(|| at.y as usize * self.size.x as usize + at.x as usize)
    }

    /// Squared distances to what is no crack, up to those that count.
    fn insides(&self) -> Vec<u32> {
        let mut offsets = disc(MOST + 1);
        offsets.sort_by_key(|by| by.length_squared());
        let inside = |at: IVec2| {
            let is_out = |by: &&IVec2| self.index(at + **by).is_none_or(|index| !self.is_crack[index]);
            offsets.iter().find(is_out).map_or(MOST, |by| by.length_squared() as u32)
        };
        let all = (0..self.size.y as i32).flat_map(|y| (0..self.size.x as i32).map(move |x| IVec2::new(x, y)));
        all.zip(&self.is_crack).map(|(at, &is_crack)| if is_crack { inside(at) } else { 0 }).collect()
    }

    /// The middles of cracks, with their squared distance to what is none.
    fn middles(&self) -> Vec<(IVec2, u32)> {
        let insides = self.insides();
        let value = |at: IVec2| self.index(at).map_or(0, |index| insides[index]);
        let around = disc(3);
        let all = (0..self.size.y as i32).flat_map(|y| (0..self.size.x as i32).map(move |x| IVec2::new(x, y)));
        let is_middle =
            |(at, inside): &(IVec2, u32)| *inside > 0 && around.iter().all(|&by| value(*at + by) <= *inside);
        all.zip(insides.iter().copied()).filter(is_middle).collect()
    }
}

/// All offsets whose squared length is less than this.
fn disc(square: u32) -> Vec<IVec2> {
    let side = -MOST_SIDE..=MOST_SIDE;
    let all = side.clone().flat_map(|y| side.clone().map(move |x| IVec2::new(x, y)));
    all.filter(|by| (by.length_squared() as u32) < square).collect()
}

/// Squared distances of the middles of a photograph's cracks to what is none.
pub(super) fn widths(size: UVec2, wraps: bool, is_crack: impl Fn(u32, u32) -> bool) -> Vec<u32> {
    let by = if wraps { MOST_SIDE as u32 + 1 } else { 0 };
    let part = Part::new(size, TexelRect::whole(size), by, wraps, is_crack);
    let is_in = |at: IVec2| (part.min + at).cmpge(IVec2::ZERO).all() && (part.min + at).cmplt(size.as_ivec2()).all();
    part.middles().into_iter().filter(|(at, _)| is_in(*at)).map(|(_, inside)| inside).collect()
}

/// The width of thin cracks: what most middles of cracks have at least.
pub(super) fn thin(mut widths: Vec<u32>) -> u32 {
    widths.sort_unstable();
    widths.get(widths.len() / THIN_SHARE).copied().unwrap_or(1)
}

/// How far from a texel whose crack has changed others are widened or not, texels.
pub(super) const fn reach(thin: u32) -> u32 {
    if thin <= 1 {
        return 0;
    }
    let side = thin.isqrt() + 1;
    2 * side + 1
}

/// The cracks of a rectangle of a surface and of `by` texels around it, widened: whether each of its texels is crack,
/// row after row. Beyond the borders there is none, or what lies at the opposite border if it `wraps`.
pub(super) fn widened(
    size: UVec2,
    rect: TexelRect,
    by: u32,
    thin: u32,
    wraps: bool,
    is_crack: impl Fn(u32, u32) -> bool,
) -> Vec<bool> {
    let more = reach(thin);
    let part = Part::new(size, rect, by + more, wraps, is_crack);
    if more == 0 {
        return part.is_crack;
    }
    let (side, more) = ((rect.size() + 2 * by).as_usizevec2(), more as usize);
    let row = |y: usize| &part.is_crack[y * part.size.x as usize + more..][..side.x];
    let mut out: Vec<bool> = (more..more + side.y).flat_map(row).copied().collect();
    let (min, stamp) = (rect.min.as_ivec2() - by as i32, disc(thin));
    for (middle, _) in part.middles().into_iter().filter(|(_, inside)| *inside < thin) {
        for at in stamp.iter().map(|&stamp| middle + stamp - more as i32) {
            let is_on = wraps || (min + at).cmpge(IVec2::ZERO).all() && (min + at).cmplt(size.as_ivec2()).all();
            if is_on && at.cmpge(IVec2::ZERO).all() && at.cmplt(side.as_ivec2()).all() {
                out[at.y as usize * side.x + at.x as usize] = true;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// A lone texel and thin lines get the width, wide cracks stay as they are; and a part of a surface is that part of
    /// the whole.
    #[test]
    fn thin_cracks_are_widened_and_parts_agree() {
        let size = UVec2::new(64, 48);
        // A line of one column, a bar of seven, a texel.
        let is_crack = |x: u32, y: u32| x == 10 || (24..31).contains(&x) || (x, y) == (50, 20);
        for (thin, [line, bar, dot]) in [(1, [48, 336, 1]), (2, [144, 336, 5]), (4, [144, 336, 9]), (5, [240, 336, 13])]
        {
            let out = widened(size, TexelRect::whole(size), 0, thin, true, is_crack);
            let count = |columns: std::ops::Range<usize>| {
                (0..48 * 64).filter(|i| columns.contains(&(i % 64)) && out[*i]).count()
            };
            assert_eq!([count(0..20), count(20..40), count(40..64)], [line, bar, dot], "{thin}");
        }
        let mut rng = Rng::new(3);
        for case in 0..100 {
            let size = UVec2::new(9 + rng.next_u32() % 40, 9 + rng.next_u32() % 40);
            let share = 0.3 * rng.unit();
            let cracks: Vec<bool> = (0..size.element_product()).map(|_| rng.unit() < share).collect();
            let is_crack = |x: u32, y: u32| cracks[(y * size.x + x) as usize];
            let (thin, wraps) = (1 + rng.next_u32() % MOST, case % 2 == 0);
            let whole = widened(size, TexelRect::whole(size), 0, thin, wraps, is_crack);
            let min = UVec2::new(rng.next_u32() % size.x, rng.next_u32() % size.y);
            let rect = TexelRect { min, max: (min + 1 + rng.next_u32() % 9).min(size) };
            let part = widened(size, rect, 0, thin, wraps, is_crack);
            let all = (rect.min.y..rect.max.y).flat_map(|y| (rect.min.x..rect.max.x).map(move |x| (x, y)));
            for ((x, y), part) in all.zip(part) {
                assert_eq!(part, whole[(y * size.x + x) as usize], "case {case}: {x}, {y} of {rect:?}");
            }
        }
    }

    /// Three in four middles are at least as wide; none at all count as thin.
    #[test]
    fn the_width_of_thin_cracks_is_that_of_most() {
        let size = UVec2::new(64, 64);
        let is_crack =
            |x: u32, _: u32| x == 3 || (10..15).contains(&x) || (20..25).contains(&x) || (30..35).contains(&x);
        let all = widths(size, true, is_crack);
        assert_eq!(all.len(), 4 * 64);
        assert_eq!(thin(all), 9);
        assert_eq!(thin(vec![1, 1, 1, 16]), 1);
        assert_eq!((thin(Vec::new()), reach(1), reach(4)), (1, 0, 7));
    }
}
