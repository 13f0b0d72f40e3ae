//! The parts of a height field that gaps part: [`StonesJob`] finds them, [`Stones`] holds them.

use super::rows::{MANY, Rows};
use crate::{Grid, math::mix, pattern::SurfaceFrame};
use glam::{UVec2, Vec2};

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

/// Sums over the texels of a stone.
#[derive(Clone, Copy, Debug)]
struct Sum {
    texels: u32,
    place: [u64; 2],
    low: [u32; 2],
    high: [u32; 2],
    highest: f32,
}

/// The search for stones in steps.
#[derive(Clone, Debug)]
pub(super) struct StonesJob {
    level: f32,
    seed: u64,
    stage: Stage,
    rows: Rows,
    labels: Grid<u32>,
    /// For each label another one of the same stone, or itself.
    parents: Vec<u32>,
    sums: Vec<Sum>,
    /// For each label, one more than the index of its stone, or 0.
    names: Vec<u32>,
    list: Vec<Stone>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Label,
    Sum,
    /// Large sums become stones.
    Name,
    Rename,
    Done,
}

const NO_SUM: Sum = Sum { texels: 0, place: [0; 2], low: [u32::MAX; 2], high: [0; 2], highest: f32::MIN };

impl StonesJob {
    /// For the places above `level`.
    pub(super) fn new(size: UVec2, level: f32, seed: u64) -> Self {
        let (labels, rows) = (Grid::new(size, 0), Rows::new(size));
        let [parents, names] = [vec![0], Vec::new()];
        Self { level, seed, stage: Stage::Label, rows, labels, parents, sums: Vec::new(), names, list: Vec::new() }
    }

    /// Some rows of `heights`, which are the same in all steps; `false` when all is done.
    pub(super) fn step(&mut self, heights: &Grid<f32>, frame: &SurfaceFrame) -> bool {
        if self.stage == Stage::Name {
            self.name(frame);
        } else {
            for y in self.rows.take(MANY) {
                match self.stage {
                    Stage::Label => self.label_row(y, heights.row(y)),
                    Stage::Sum => self.sum_row(y, heights.row(y)),
                    Stage::Rename => {
                        let labels = self.labels.row_mut(y);
                        labels.iter_mut().for_each(|label| *label = self.names[*label as usize]);
                    }
                    Stage::Name | Stage::Done => {}
                }
            }
        }
        self.advance();
        self.stage != Stage::Done
    }

    fn advance(&mut self) {
        let is_done = if self.stage == Stage::Name { self.names.len() == self.sums.len() } else { self.rows.is_done() };
        if !is_done {
            return;
        }
        self.rows = Rows::new(self.labels.size());
        self.stage = match self.stage {
            Stage::Label => {
                self.sums = vec![NO_SUM; self.parents.len()];
                Stage::Sum
            }
            Stage::Sum => Stage::Name,
            Stage::Name => Stage::Rename,
            Stage::Rename | Stage::Done => Stage::Done,
        };
    }

    pub(super) fn finish(self) -> Stones {
        Stones { labels: self.labels, list: self.list }
    }

    fn label_row(&mut self, y: usize, heights: &[f32]) {
        let width = heights.len();
        let (before, row) = self.labels.as_mut_slice()[..(y + 1) * width].split_at_mut(y * width);
        let above = before.chunks_exact(width).next_back();
        let (parents, mut left) = (&mut self.parents, 0);
        for (x, (label, &height)) in row.iter_mut().zip(heights).enumerate() {
            left = match (height > self.level, left, above.map_or(0, |above| above[x])) {
                (false, ..) => 0,
                (true, 0, 0) => {
                    parents.push(parents.len() as u32);
                    parents.len() as u32 - 1
                }
                (true, one, 0) | (true, 0, one) => one,
                (true, one, other) => {
                    let (one, other) = (root(parents, one), root(parents, other));
                    parents[one.max(other) as usize] = one.min(other);
                    one.min(other)
                }
            };
            *label = left;
        }
    }

    fn sum_row(&mut self, y: usize, heights: &[f32]) {
        for (x, (label, &height)) in self.labels.row_mut(y).iter_mut().zip(heights).enumerate() {
            if *label > 0 {
                *label = root(&mut self.parents, *label);
                self.sums[*label as usize].add([x as u32, y as u32], height);
            }
        }
    }

    fn name(&mut self, frame: &SurfaceFrame) {
        let first = self.names.len();
        for sum in &self.sums[first..(first + MANY).min(self.sums.len())] {
            let stone = sum.stone(frame, self.seed);
            self.list.extend(stone);
            self.names.push(if stone.is_some() { self.list.len() as u32 } else { 0 });
        }
    }
}

impl Stones {
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
        let frame = SurfaceFrame::new([5, 4].into()).unwrap();
        let mut job = StonesJob::new(heights.size(), 0.0, 1);
        while job.step(&heights, &frame) {}
        let stones = job.finish();
        assert_eq!(stones.list.len(), 2);
        assert_eq!(stones.labels.row(0), [1, 0, 0, 0, 1]);
        assert_eq!(stones.labels.row(1), [1, 0, 2, 0, 1]);
        assert_eq!(stones.labels.row(3), [1; 5]);
        assert_eq!((stones.list[0].area, stones.list[0].highest), (11.0 / 16.0, 0.5));
        assert_eq!(stones.list[1].middle, Vec2::new(2.5, 1.5) / 4.0);
    }
}
