//! The parts of a height field that gaps part: [`Stones`].

use crate::{Grid, math::mix, pattern::SurfaceFrame};
use glam::Vec2;

/// Smallest area of a stone, square pattern units.
const LEAST_AREA: f32 = 0.0003;

/// What is known of a stone. Lengths and places in pattern units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stone {
    pub(super) middle: Vec2,
    /// Half of its width and height.
    pub(super) half: Vec2,
    pub(super) area: f32,
    pub(super) highest: f32,
    /// A random number of its own, nearly the same at other sizes of the picture.
    pub(super) seed: u64,
}

/// All places above a level that hang together are a stone.
#[derive(Clone, Debug)]
pub(super) struct Stones {
    /// For each texel, one more than the index of its stone; 0 outside.
    pub(super) labels: Grid<u32>,
    pub(super) list: Vec<Stone>,
}

fn root(parents: &mut [u32], mut label: u32) -> u32 {
    while parents[label as usize] != label {
        parents[label as usize] = parents[parents[label as usize] as usize];
        label = parents[label as usize];
    }
    label
}

/// A label for each texel, and for each label another one of the same stone, or itself.
fn label(heights: &Grid<f32>, level: f32) -> (Grid<u32>, Vec<u32>) {
    let mut labels = Grid::new(heights.size(), 0u32);
    let mut parents = vec![0u32];
    let mut above = vec![0u32; heights.width()];
    for y in 0..heights.height() {
        let row = labels.row_mut(y);
        let mut left = 0;
        for (x, &height) in heights.row(y).iter().enumerate() {
            left = match (height > level, left, above[x]) {
                (false, ..) => 0,
                (true, 0, 0) => {
                    parents.push(parents.len() as u32);
                    parents.len() as u32 - 1
                }
                (true, one, 0) | (true, 0, one) => one,
                (true, one, other) => {
                    let (one, other) = (root(&mut parents, one), root(&mut parents, other));
                    parents[one.max(other) as usize] = one.min(other);
                    one.min(other)
                }
            };
            row[x] = left;
        }
        above.copy_from_slice(row);
    }
    (labels, parents)
}

/// Sums over the texels of a stone.
#[derive(Clone, Copy)]
struct Sum {
    texels: u32,
    place: [u64; 2],
    low: [u32; 2],
    high: [u32; 2],
    highest: f32,
}

impl Stones {
    pub(super) fn new(heights: &Grid<f32>, frame: &SurfaceFrame, level: f32, seed: u64) -> Self {
        let (mut labels, mut parents) = label(heights, level);
        let none = Sum { texels: 0, place: [0; 2], low: [u32::MAX; 2], high: [0; 2], highest: f32::MIN };
        let mut sums = vec![none; parents.len()];
        for y in 0..heights.height() {
            for (x, (label, &height)) in labels.row_mut(y).iter_mut().zip(heights.row(y)).enumerate() {
                if *label > 0 {
                    *label = root(&mut parents, *label);
                    sums[*label as usize].add([x as u32, y as u32], height);
                }
            }
        }
        let mut list = Vec::new();
        let names: Vec<u32> = sums
            .iter()
            .map(|sum| match sum.stone(frame, seed) {
                Some(stone) => {
                    list.push(stone);
                    list.len() as u32
                }
                None => 0,
            })
            .collect();
        labels.as_mut_slice().iter_mut().for_each(|label| *label = names[*label as usize]);
        Self { labels, list }
    }

    /// The stone at a texel of the surface.
    pub(super) fn at(&self, x: usize, y: usize) -> Option<&Stone> {
        self.list.get((self.labels.row(y)[x] as usize).checked_sub(1)?)
    }
}

impl Sum {
    fn add(&mut self, place: [u32; 2], height: f32) {
        self.texels += 1;
        self.highest = self.highest.max(height);
        for (axis, at) in place.into_iter().enumerate() {
            self.place[axis] += u64::from(at);
            self.low[axis] = self.low[axis].min(at);
            self.high[axis] = self.high[axis].max(at);
        }
    }

    fn stone(&self, frame: &SurfaceFrame, seed: u64) -> Option<Stone> {
        let unit = frame.texels_per_unit();
        let area = self.texels as f32 / (unit * unit);
        if area < LEAST_AREA {
            return None;
        }
        let mean = self.place.map(|sum| sum as f32 / self.texels as f32 + 0.5);
        let middle = frame.to_pos(Vec2::from(mean));
        let half = [0, 1].map(|axis| (self.high[axis] - self.low[axis] + 1) as f32);
        let near = (middle * 16.0).round().as_ivec2();
        let name = u64::from(near.x as u32) << 32 | u64::from(near.y as u32);
        Some(Stone {
            middle,
            half: Vec2::from(half) * (0.5 / unit),
            area,
            highest: self.highest,
            seed: mix(seed ^ mix(name)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_hangs_together_is_a_stone() {
        // A U and a bar between its arms.
        let rows = ["#...#", "#.#.#", "#...#", "#####"];
        let heights = rows.iter().flat_map(|row| row.bytes()).map(|c| if c == b'#' { 0.5 } else { -0.5 }).collect();
        let heights = Grid::from_vec([5, 4].into(), heights).unwrap();
        let stones = Stones::new(&heights, &SurfaceFrame::new([5, 4].into()).unwrap(), 0.0, 1);
        assert_eq!(stones.list.len(), 2);
        assert_eq!(stones.labels.row(0), [1, 0, 0, 0, 1]);
        assert_eq!(stones.labels.row(1), [1, 0, 2, 0, 1]);
        assert_eq!(stones.labels.row(3), [1; 5]);
        assert_eq!((stones.list[0].area, stones.list[0].highest), (11.0 / 16.0, 0.5));
        assert_eq!(stones.list[1].middle, Vec2::new(2.5, 1.5) / 4.0);
    }
}
