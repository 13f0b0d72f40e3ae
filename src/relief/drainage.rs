//! How water runs over a lattice of heights: [`DrainageJob`] finds it, [`Drainage`] holds it.

use crate::Grid;
use std::{cmp::Reverse, collections::BinaryHeap};

/// Where the water of each cell of a lattice runs: downhill, and out of hollows over their lowest rim.
///
/// Found by flooding from the outlets (Barnes, Lehman and Mulla 2014, "Priority-Flood").
#[derive(Clone, Debug)]
pub(super) struct Drainage {
    /// Cells, each after the one that its water runs into.
    pub(super) order: Vec<u32>,
    /// The cell that the water of a cell runs into; outlets name themselves.
    pub(super) into: Vec<u32>,
    width: usize,
}

/// A number that orders as the float does.
fn key(height: f32) -> u32 {
    let bits = height.to_bits();
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}

const OPEN: u32 = u32::MAX;

/// Cells that a step of a flood reaches.
const CELLS: usize = 1 << 12;

/// The search for the drainage of a lattice in steps.
#[derive(Clone, Debug)]
pub(super) struct DrainageJob {
    flood: Flood,
    queue: Queue,
    outlets: Vec<bool>,
    order: Vec<u32>,
    into: Vec<u32>,
}

impl DrainageJob {
    /// Cells at the border and cells at height 0 or below are outlets.
    pub(super) fn new(heights: &Grid<f32>) -> Self {
        let (width, height) = (heights.width(), heights.height());
        let values = heights.as_slice();
        let mut flood = Flood { width, height, filled: values.to_vec(), rank: vec![OPEN; values.len()] };
        let mut order = Vec::with_capacity(values.len());
        // The sea is lower than all else, so it needs no queue.
        for (cell, _) in (0..).zip(values).filter(|(_, height)| **height <= 0.0) {
            flood.reach(cell, &mut order);
        }
        let entered = flood.rank.iter().map(|rank| *rank != OPEN).collect();
        let mut queue = Queue { heap: BinaryHeap::new(), cells: Vec::new(), entered };
        for (i, &value) in values.iter().enumerate() {
            if i % width == 0 || i % width + 1 == width || i < width || i / width + 1 == height {
                queue.enter(i, value);
            }
        }
        let outlets = queue.entered.clone();
        for &cell in &order {
            flood.spread(cell as usize, &mut queue);
        }
        Self { flood, queue, outlets, order, into: (0..values.len() as u32).collect() }
    }

    /// Some cells; `false` when all are reached.
    pub(super) fn step(&mut self) -> bool {
        for _ in 0..CELLS {
            let Some(cell) = self.queue.next() else { return false };
            let i = cell as usize;
            self.flood.reach(cell, &mut self.order);
            if !self.outlets[i] {
                self.into[i] = self.flood.downhill(i);
            }
            self.flood.spread(i, &mut self.queue);
        }
        true
    }

    pub(super) fn finish(self) -> Drainage {
        Drainage { order: self.order, into: self.into, width: self.flood.width }
    }
}

impl Drainage {
    /// How many cells drain through each, itself included.
    pub(super) fn gathered(&self) -> Vec<f32> {
        let mut gathered = vec![1.0; self.into.len()];
        for &cell in self.order.iter().rev() {
            let into = self.into[cell as usize];
            if into != cell {
                gathered[into as usize] += gathered[cell as usize];
            }
        }
        gathered
    }

    /// Distance between two neighboring cells, in cells.
    pub(super) fn distance(&self, a: u32, b: u32) -> f32 {
        let (a, b) = (a as usize, b as usize);
        if a % self.width == b % self.width || a / self.width == b / self.width {
            1.0
        } else {
            std::f32::consts::SQRT_2
        }
    }
}

/// Cells that the flood comes to, the lowest first, and those of a height in turn.
#[derive(Clone, Debug)]
struct Queue {
    /// The height of a cell, as a number that orders as it does, in the upper half; its place in `cells` in the lower.
    heap: BinaryHeap<Reverse<u64>>,
    /// All cells that were ever in it, in turn.
    cells: Vec<u32>,
    /// Which cells are or were in it, or need not be.
    entered: Vec<bool>,
}

impl Queue {
    fn enter(&mut self, i: usize, height: f32) {
        if !self.entered[i] {
            self.entered[i] = true;
            self.heap.push(Reverse(u64::from(key(height)) << 32 | self.cells.len() as u64));
            self.cells.push(i as u32);
        }
    }

    /// The cell that the flood comes to next.
    fn next(&mut self) -> Option<u32> {
        let Reverse(first) = self.heap.pop()?;
        Some(self.cells[first as u32 as usize])
    }
}

/// The state of a flood.
#[derive(Clone, Debug)]
struct Flood {
    width: usize,
    height: usize,
    filled: Vec<f32>,
    /// When a cell was reached.
    rank: Vec<u32>,
}

impl Flood {
    fn reach(&mut self, cell: u32, order: &mut Vec<u32>) {
        self.rank[cell as usize] = order.len() as u32;
        order.push(cell);
    }

    /// Enters the cells around a cell, no lower than it.
    fn spread(&mut self, i: usize, queue: &mut Queue) {
        for (next, _) in self.around(i) {
            if !queue.entered[next] {
                self.filled[next] = self.filled[next].max(self.filled[i]);
                queue.enter(next, self.filled[next]);
            }
        }
    }

    /// The cells around a cell, and their distances in cells.
    fn around(&self, i: usize) -> impl Iterator<Item = (usize, f32)> + use<> {
        let (x, y) = (i % self.width, i / self.width);
        let (width, height) = (self.width, self.height);
        const SIDES: [(i32, i32); 8] = [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)];
        SIDES.into_iter().filter_map(move |(right, down)| {
            let next = (x.checked_add_signed(right as isize)?, y.checked_add_signed(down as isize)?);
            let distance = if right != 0 && down != 0 { std::f32::consts::SQRT_2 } else { 1.0 };
            (next.0 < width && next.1 < height).then_some((next.1 * width + next.0, distance))
        })
    }

    /// The steepest way down from a cell among those reached before it, or the first reached where it is level.
    fn downhill(&self, i: usize) -> u32 {
        let here = self.filled[i];
        let reached = self.around(i).filter(|(next, _)| self.rank[*next] != OPEN);
        let mut best = (i, f32::MIN, OPEN);
        for (next, distance) in reached {
            let (fall, rank) = ((here - self.filled[next]) / distance, self.rank[next]);
            if fall > best.1 || (fall == best.1 && rank < best.2) {
                best = (next, fall, rank);
            }
        }
        best.0 as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    fn drainage(heights: &Grid<f32>) -> Drainage {
        let mut job = DrainageJob::new(heights);
        while job.step() {}
        job.finish()
    }

    #[test]
    fn all_water_reaches_an_outlet() {
        let mut rng = Rng::new(4);
        for size in [[1, 1], [2, 5], [40, 30]] {
            let heights = (0..size[0] * size[1]).map(|_| rng.signed()).collect();
            let heights = Grid::from_vec(size.into(), heights).unwrap();
            let drainage = drainage(&heights);
            let mut place = vec![0; drainage.into.len()];
            drainage.order.iter().enumerate().for_each(|(rank, &cell)| place[cell as usize] = rank);
            assert_eq!(drainage.order.len(), drainage.into.len());
            let outlets = (0..).zip(&drainage.into).filter(|(i, into)| i == *into);
            let (mut sum, gathered) = (0.0, drainage.gathered());
            for (i, _) in outlets {
                sum += gathered[i as usize];
            }
            assert_eq!(sum, (size[0] * size[1]) as f32);
            let before = |(i, &into): (usize, &u32)| into == i as u32 || place[into as usize] < place[i];
            assert!(drainage.into.iter().enumerate().all(before));
        }
    }

    /// Water leaves a hollow over its lowest rim.
    #[test]
    fn hollows_overflow_at_the_lowest_rim() {
        let mut heights = Grid::new([7, 7].into(), 0.9);
        heights.row_mut(3)[2..].copy_from_slice(&[0.1, 0.1, 0.1, 0.5, 0.6]);
        let drainage = drainage(&heights);
        let mut cell = 3 * 7 + 2;
        while drainage.into[cell] != cell as u32 {
            cell = drainage.into[cell] as usize;
        }
        assert_eq!(cell % 7, 6);
    }
}
