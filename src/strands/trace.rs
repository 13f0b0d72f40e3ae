//! The middle lines of a crack in an image.
//!
//! A shortest path from the head to the tail that prefers the middle of the crack is the main line. Then the crack's
//! texel that is furthest from all lines so far is joined to them, as long as one is far enough (the method of Sato et
//! al. 2000 for tree-shaped skeletons).

use super::{
    error::PrimitiveError,
    line::{PrimitiveLine, PrimitivePoint},
};
use crate::Grid;
use glam::Vec2;
use std::{cmp::Reverse, collections::BinaryHeap};

/// Texels deeper than this belong to the crack.
const DEEP: u16 = u16::MAX / 4;

/// The largest number of lines of a primitive.
const MOST_LINES: usize = 64;

/// About so many points to the height of an image.
const POINTS: usize = 28;

const NONE: u32 = u32::MAX;

type Traced = (Vec<PrimitiveLine>, Option<[u32; 2]>);

/// The crack of an image, its middle and the shortest paths from the head.
struct Tracer {
    width: usize,
    height: usize,
    /// Distance to the edge of the crack, in thirds of a texel; 0 outside.
    inside: Vec<u32>,
    /// The texel before each on the way from the head, and the length of that way in fifths of a texel.
    before: Vec<u32>,
    length: Vec<u32>,
    /// Line and point of each texel on a line.
    on_line: Vec<Option<(u32, u32)>>,
    is_covered: Vec<bool>,
    /// The texels of each line.
    lines: Vec<(Option<(u32, u32)>, Vec<u32>)>,
}

pub(super) fn trace(image: &Grid<u16>) -> Result<Traced, PrimitiveError> {
    let mut tracer = Tracer::new(image);
    if tracer.inside.iter().all(|&inside| inside == 0) {
        return Err(PrimitiveError::Empty);
    }
    let (w, h) = (tracer.width, tracer.height);
    let top: Vec<usize> = (0..w).collect();
    let side = |first: usize, stride: usize, n: usize| (0..n).map(|i| first + i * stride).collect::<Vec<_>>();
    let head = tracer.connector(&top).ok_or(PrimitiveError::NoConnector { side: "head" })?;
    let tail = tracer.connector(&side((h - 1) * w, 1, w)).ok_or(PrimitiveError::NoConnector { side: "tail" })?;
    let left = tracer.connector(&side(0, w, h));
    let right = tracer.connector(&side(w - 1, w, h));
    tracer.search(head);
    let joined = |at: usize, side| match tracer.length[at] {
        NONE => Err(PrimitiveError::NotJoined { side }),
        _ => Ok(()),
    };
    joined(tail, "tail")?;
    if let (Some(left), Some(right)) = (left, right) {
        joined(left, "left")?;
        joined(right, "right")?;
    }
    tracer.add(tail);
    let sides = left.zip(right).and_then(|(left, right)| Some([tracer.add(left)?, tracer.add(right)?]));
    tracer.add_rest();
    Ok((tracer.smooth(sides), sides))
}

impl Tracer {
    fn new(image: &Grid<u16>) -> Self {
        let (width, height) = (image.width(), image.height());
        let n = width * height;
        let mut inside: Vec<u32> =
            image.as_slice().iter().map(|&depth| if depth > DEEP { NONE / 2 } else { 0 }).collect();
        // Distances by two passes with steps of 3 and 4; the crack goes on beyond the image.
        let mut pass = |i: usize, near: [Option<(usize, u32)>; 4]| {
            let least = near.into_iter().flatten().map(|(j, far)| inside[j].saturating_add(far)).min();
            inside[i] = inside[i].min(least.unwrap_or(NONE / 2));
        };
        for i in 0..n {
            let (x, y) = (i % width, i / width);
            let up = |is: bool, back: usize, far| (y > 0 && is).then(|| (i - back, far));
            pass(
                i,
                [
                    (x > 0).then(|| (i - 1, 3)),
                    up(true, width, 3),
                    up(x > 0, width + 1, 4),
                    up(x + 1 < width, width - 1, 4),
                ],
            );
        }
        for i in (0..n).rev() {
            let (x, y) = (i % width, i / width);
            let down = |is: bool, on: usize, far| (y + 1 < height && is).then(|| (i + on, far));
            pass(
                i,
                [
                    (x + 1 < width).then(|| (i + 1, 3)),
                    down(true, width, 3),
                    down(x + 1 < width, width + 1, 4),
                    down(x > 0, width - 1, 4),
                ],
            );
        }
        // An image that is all crack has no edge.
        inside.iter_mut().for_each(|far| *far = (*far).min(3 * width.max(height) as u32));
        let (before, length) = (vec![NONE; n], vec![NONE; n]);
        Self {
            width,
            height,
            inside,
            before,
            length,
            on_line: vec![None; n],
            is_covered: vec![false; n],
            lines: Vec::new(),
        }
    }

    /// The texel of a side, given in order, at which the crack reaches its middle third.
    fn connector(&self, side: &[usize]) -> Option<usize> {
        let n = side.len();
        let is_in = |i: usize| self.inside[side[i]] > 0;
        let middle = (n / 3..n - n / 3).filter(|&i| is_in(i)).min_by_key(|&i| (2 * i + 1).abs_diff(n))?;
        let first = (0..=middle).rev().take_while(|&i| is_in(i)).last()?;
        let last = (middle..n).take_while(|&i| is_in(i)).last()?;
        Some(side[usize::midpoint(first, last)])
    }

    /// The neighbours of a texel with the length of the way to them.
    fn each_neighbour(&self, i: usize, mut visit: impl FnMut(usize, u32)) {
        let (x, y) = (i % self.width, i / self.width);
        for v in y.saturating_sub(1)..=(y + 1).min(self.height - 1) {
            for u in x.saturating_sub(1)..=(x + 1).min(self.width - 1) {
                let j = v * self.width + u;
                if j != i && self.inside[j] > 0 {
                    visit(j, if u == x || v == y { 5 } else { 7 });
                }
            }
        }
    }

    /// Cheapest paths from `head`; texels near the edge of the crack are expensive.
    fn search(&mut self, head: usize) {
        let mut costs = vec![u64::MAX; self.inside.len()];
        let mut queue = BinaryHeap::from([Reverse((0u64, head))]);
        costs[head] = 0;
        self.length[head] = 0;
        while let Some(Reverse((cost, i))) = queue.pop() {
            if cost > costs[i] {
                continue;
            }
            let mut better = Vec::new();
            self.each_neighbour(i, |j, way| {
                let inside = u64::from(self.inside[j]);
                let next = cost + u64::from(way) * (16 + 4096 / (inside * inside));
                if next < costs[j] {
                    better.push((j, way, next));
                }
            });
            for (j, way, next) in better {
                costs[j] = next;
                self.before[j] = i as u32;
                self.length[j] = self.length[i] + way;
                queue.push(Reverse((next, j)));
            }
        }
    }

    /// Adds the way from the lines so far to a texel; `None` if it is on one of them or cannot be reached.
    fn add(&mut self, to: usize) -> Option<u32> {
        let mut texels = Vec::new();
        let mut at = to;
        while self.on_line[at].is_none() {
            texels.push(at as u32);
            match self.before[at] {
                NONE => break,
                before => at = before as usize,
            }
        }
        if texels.is_empty() || self.length[to] == NONE {
            return None;
        }
        texels.reverse();
        let line = self.lines.len() as u32;
        let from = self.on_line[at];
        for (point, &texel) in (0u32..).zip(&texels) {
            self.on_line[texel as usize] = Some((line, point));
        }
        texels.iter().for_each(|&texel| self.cover(texel as usize));
        self.lines.push((from, texels));
        Some(line)
    }

    /// Marks what lies within the width of the crack around a texel of a line.
    fn cover(&mut self, texel: usize) {
        let reach = (1.5 * self.inside[texel] as f32 / 3.0 + 2.0) as usize;
        let (x, y) = (texel % self.width, texel / self.width);
        for v in y.saturating_sub(reach)..(y + reach + 1).min(self.height) {
            for u in x.saturating_sub(reach)..(x + reach + 1).min(self.width) {
                self.is_covered[v * self.width + u] |= u.abs_diff(x).pow(2) + v.abs_diff(y).pow(2) <= reach * reach;
            }
        }
    }

    /// Adds lines to all that is far from those so far.
    fn add_rest(&mut self) {
        let mut order: Vec<usize> = (0..self.inside.len()).filter(|&i| self.length[i] != NONE).collect();
        order.sort_by_key(|&i| (Reverse(self.length[i]), i));
        for i in order {
            if !self.is_covered[i] && self.lines.len() < MOST_LINES {
                self.add(i);
                self.cover(i);
            }
        }
    }

    /// The lines with fewer, smoother points.
    fn smooth(&self, sides: Option<[u32; 2]>) -> Vec<PrimitiveLine> {
        let every = (self.height / POINTS).max(1);
        let place = |texel: u32| {
            let (x, y) = (texel as usize % self.width, texel as usize / self.width);
            Vec2::new(x as f32 + 0.5, y as f32 + 0.5)
        };
        // For each line the number of the kept point of each texel.
        let mut kept: Vec<Vec<u32>> = Vec::new();
        let mut out: Vec<PrimitiveLine> = Vec::new();
        for (index, (from, texels)) in (0u32..).zip(&self.lines) {
            let last = texels.len() - 1;
            let mut line = PrimitiveLine {
                from: from.map(|(line, point)| (line, kept[line as usize][point as usize])),
                points: Vec::new(),
            };
            let mut numbers = vec![0; texels.len()];
            for (i, number) in numbers.iter_mut().enumerate() {
                let is_kept = i % every == 0 && (i + every <= last || i == 0) || i == last;
                *number = (line.points.len() as u32).saturating_sub(u32::from(!is_kept));
                if !is_kept {
                    continue;
                }
                let reach = (every / 2).min(i).min(last - i);
                let near = &texels[i - reach..=i + reach];
                let mut at = near.iter().map(|&texel| place(texel)).sum::<Vec2>() / near.len() as f32;
                let width =
                    near.iter().map(|&texel| self.inside[texel as usize] as f32).sum::<f32>() / near.len() as f32;
                if index == 0 && i == last {
                    at.y = self.height as f32;
                } else if index == 0 && i == 0 {
                    at.y = 0.0;
                } else if let Some(side) =
                    sides.and_then(|sides| sides.iter().position(|&side| side == index)).filter(|_| i == last)
                {
                    at = Vec2::new([0.0, self.width as f32][side], self.height as f32 * 0.5);
                }
                let at = (at - Vec2::new(0.5 * self.width as f32, 0.0)) / self.height as f32;
                line.points.push(PrimitivePoint { at, width: (2.0 * width / 3.0 - 1.0).max(0.5) / self.height as f32 });
            }
            kept.push(numbers);
            out.push(line);
        }
        out
    }
}
