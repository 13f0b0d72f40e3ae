//! Courses of bricks, and the directions that their joints offer to cracks.

use super::draws;
use crate::{
    Grid,
    math::hash_unit,
    pattern::{Bricks, NO_BRICKS},
};
use glam::Vec2;

/// A row (column) of a course counts as a joint if this share of it is weak.
const JOINT: f32 = 0.45;

/// Ratio of the length of bricks to the height of a course.
const BRICK: f32 = 3.0;

/// Share of a course that is joint, if the picture does not say.
const THIN: f32 = 0.14;

/// For a hit at the border, places there count as further away by this factor times their lack of room.
const OFF_BORDER: f32 = 2.2;

/// Places closer than this (pattern units) are the same.
const SAME: f32 = 1e-4;

/// The joints of a wall: bed joints run from side to side, head joints from bed to bed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Masonry {
    extent: Vec2,
    /// Positions of bed joints, from the top.
    beds: Vec<f32>,
    /// For each course, from the one above the first bed joint: the positions of its head joints, from the left.
    heads: Vec<Vec<f32>>,
    /// Width of joints, pattern units.
    joint: f32,
    /// Length of bricks, pattern units.
    brick: f32,
}

/// A direction along a joint, and the distance to the next crossing joint.
pub(super) type Way = (Vec2, f32);

impl Masonry {
    /// A wall without a picture: courses of this height, each shifted by half a brick against the one below.
    pub(super) fn regular(extent: Vec2, course: f32, seed: u64) -> Self {
        let uneven = |i: u64| 0.06 * (hash_unit(seed ^ draws::BRICK, i) - 0.5);
        let count = |length: f32, of: f32| ((length / of) as u32).clamp(1, 4096);
        let first = course * (0.3 + 0.4 * hash_unit(seed ^ draws::WALL, 0));
        let beds: Vec<f32> = (0..count(extent.y - first, course))
            .map(|i| first + course * (i as f32 + uneven(u64::from(i))))
            .filter(|y| *y > SAME && *y < extent.y - SAME)
            .collect();
        let brick = BRICK * course;
        let heads = (0..=beds.len() as u64)
            .map(|i| {
                let half = 0.5 * (i % 2) as f32 + hash_unit(seed ^ draws::WALL, 1);
                (0..=count(extent.x, brick))
                    .map(|k| brick * (k as f32 + half.fract() + uneven(i << 32 | u64::from(k))))
                    .filter(|x| *x > SAME && *x < extent.x - SAME)
                    .collect()
            })
            .collect();
        Self { extent, beds, heads, joint: THIN * course, brick }
    }

    /// The joints in a picture with these weak places; `None` if it does not show courses of bricks.
    pub(super) fn find(weak: &Grid<f32>, extent: Vec2) -> Option<Self> {
        let size = weak.size();
        let scale = extent / size.as_vec2();
        let (columns, rows) = (size.x as usize, size.y as usize);
        let known = |value: f32| if value.is_nan() { 0.0 } else { value };
        let of_rows: Vec<f32> = (0..rows).map(|y| mean(weak.row(y).iter().copied().map(known))).collect();
        let beds = ridges(&of_rows);
        if beds.len() < 2 {
            return None;
        }
        let edges: Vec<usize> =
            std::iter::once(0).chain(beds.iter().map(|&(y, _)| y as usize)).chain(std::iter::once(rows)).collect();
        let thick = (beds.iter().map(|&(_, thick)| thick).sum::<f32>() / beds.len() as f32).max(1.0);
        let heads: Vec<Vec<f32>> = edges
            .windows(2)
            .map(|pair| {
                let margin = thick.ceil() as usize;
                let (top, bottom) = (pair[0] + margin, pair[1].saturating_sub(margin));
                if bottom < top + 2 {
                    return Vec::new();
                }
                let of_columns: Vec<f32> =
                    (0..columns).map(|x| mean((top..bottom).map(|y| known(weak.row(y)[x])))).collect();
                ridges(&of_columns).iter().map(|&(x, _)| x * scale.x).collect()
            })
            .collect();
        let with_heads = heads.iter().filter(|heads| !heads.is_empty()).count();
        let gaps: Vec<f32> = heads.iter().flat_map(|heads| heads.windows(2).map(|pair| pair[1] - pair[0])).collect();
        if 2 * with_heads < heads.len() || gaps.is_empty() {
            return None;
        }
        Some(Self {
            extent,
            beds: beds.iter().map(|&(y, _)| y * scale.y).collect(),
            heads,
            // The detected lines of a picture are a little too wide.
            joint: 0.7 * thick * scale.min_element(),
            brick: gaps.iter().sum::<f32>() / gaps.len() as f32,
        })
    }

    pub(super) const fn joint(&self) -> f32 {
        self.joint
    }

    pub(super) const fn brick(&self) -> f32 {
        self.brick
    }

    /// The course at a height; on a bed joint the course above it.
    fn course(&self, y: f32) -> usize {
        self.beds.partition_point(|bed| *bed < y - SAME)
    }

    /// The bed joint on which a place lies.
    fn bed(&self, y: f32) -> Option<usize> {
        let bed = self.course(y);
        self.beds.get(bed).is_some_and(|bed| (bed - y).abs() <= SAME).then_some(bed)
    }

    fn is_head(&self, course: usize, x: f32) -> bool {
        self.heads.get(course).is_some_and(|heads| heads.iter().any(|head| (head - x).abs() <= SAME))
    }

    /// Whether a place lies in a joint's middle.
    pub(super) fn is_in_joint(&self, pos: Vec2) -> bool {
        self.bed(pos.y).is_some() || self.is_head(self.course(pos.y), pos.x)
    }

    /// The nearest place at which joints meet, if there is one; instead of one at the border, one further inside.
    pub(super) fn nearest(&self, pos: Vec2) -> Option<Vec2> {
        let off = |at: f32, to: f32, extent: f32, room: f32| {
            (at - to).abs() + OFF_BORDER * (room - at.min(extent - at)).clamp(0.0, 0.5 * extent)
        };
        let rows = |bed: &usize| off(self.beds[*bed], pos.y, self.extent.y, 0.8 * self.brick);
        let bed = (0..self.beds.len()).min_by(|a, b| rows(a).total_cmp(&rows(b)))?;
        let columns = |x: &f32| off(*x, pos.x, self.extent.x, 1.1 * self.brick);
        let heads = self.heads[bed].iter().chain(&self.heads[bed + 1]);
        let x = heads.min_by(|a, b| columns(a).total_cmp(&columns(b)))?;
        Some(Vec2::new(*x, self.beds[bed]))
    }

    /// The bricks around a place where joints meet.
    pub(super) fn bricks(&self, pos: Vec2) -> Bricks {
        let (mut all, mut count) = (NO_BRICKS, 0);
        let Some(bed) = self.bed(pos.y) else { return all };
        let lines = [
            bed.checked_sub(1).map_or(0.0, |above| self.beds[above]),
            self.beds[bed],
            self.beds.get(bed + 1).copied().unwrap_or(self.extent.y),
        ];
        for (course, height) in [bed, bed + 1].into_iter().zip(lines.windows(2)) {
            let heads = || self.heads[course].iter().copied();
            let left = heads().filter(|x| *x < pos.x - SAME).fold(0.0, f32::max);
            let right = heads().filter(|x| *x > pos.x + SAME).fold(self.extent.x, f32::min);
            let middle = self.is_head(course, pos.x).then_some(pos.x);
            let ends = [Some(left), middle, Some(right)];
            let ends: Vec<f32> = ends.into_iter().flatten().collect();
            for across in ends.windows(2) {
                let half = 0.5 * self.joint;
                let brick = [Vec2::new(across[0], height[0]) + half, Vec2::new(across[1], height[1]) - half];
                if brick[0].cmplt(brick[1]).all() {
                    all[count] = brick;
                    count += 1;
                }
            }
        }
        all
    }

    /// The directions from a place: along its joints; inside a brick up and down.
    pub(super) fn ways(&self, pos: Vec2) -> Vec<Way> {
        let mut ways = Vec::with_capacity(4);
        let course = self.course(pos.y);
        // From the joint or the brick at `pos` up and down to the next bed.
        let up = |course: usize| pos.y - course.checked_sub(1).map_or(0.0, |bed| self.beds[bed]);
        let down = |course: usize| self.beds.get(course).copied().unwrap_or(self.extent.y) - pos.y;
        if let Some(bed) = self.bed(pos.y) {
            let meeting = self.heads[bed].iter().chain(&self.heads[bed + 1]);
            let left = meeting.clone().filter(|x| **x < pos.x - SAME).fold(0.0f32, |a, b| a.max(*b));
            let right = meeting.filter(|x| **x > pos.x + SAME).fold(self.extent.x, |a, b| a.min(*b));
            ways.extend([(Vec2::NEG_X, pos.x - left), (Vec2::X, right - pos.x)]);
            if self.is_head(bed, pos.x) {
                ways.push((Vec2::NEG_Y, up(bed)));
            }
            if self.is_head(bed + 1, pos.x) {
                ways.push((Vec2::Y, down(bed + 1)));
            }
        } else {
            ways.extend([(Vec2::NEG_Y, up(course)), (Vec2::Y, down(course))]);
        }
        ways.retain(|&(_, far)| far > SAME);
        ways
    }

    /// The place above (`up` -1) or below (1) a bed joint where a crack through the brick there ends; `None` near the
    /// brick's ends.
    pub(super) fn across(&self, pos: Vec2, up: f32) -> Option<Vec2> {
        let bed = self.bed(pos.y)?;
        let (course, y) = if up < 0.0 {
            (bed, bed.checked_sub(1).map_or(0.0, |bed| self.beds[bed]))
        } else {
            (bed + 1, self.beds.get(bed + 1).copied().unwrap_or(self.extent.y))
        };
        let is_near = |head: &f32| (head - pos.x).abs() < 0.25 * self.brick;
        (!self.heads[course].iter().any(is_near)).then_some(Vec2::new(pos.x, y))
    }

    /// The end of a segment of about `length` in this direction.
    pub(super) fn end(&self, from: Vec2, (way, far): Way, length: f32) -> Vec2 {
        let end = if far <= 1.45 * length { far } else { length };
        let mut to = (from + way * end).clamp(Vec2::ZERO, self.extent);
        // Exactly in the middle, without rounding errors.
        if let Some(bed) = self.bed(to.y) {
            to.y = self.beds[bed];
        }
        to
    }
}

fn mean(values: impl Iterator<Item = f32>) -> f32 {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), value| (sum + value, count + 1));
    sum / count.max(1) as f32
}

/// Runs of high values: the weighted middle of each, and its length.
fn ridges(values: &[f32]) -> Vec<(f32, f32)> {
    let highest = values.iter().copied().fold(0.0, f32::max);
    let least = JOINT.max(0.5 * highest);
    let mut found = Vec::new();
    let mut start = 0;
    while start < values.len() {
        if values[start] < least {
            start += 1;
            continue;
        }
        let end = (start..values.len()).find(|&i| values[i] < least).unwrap_or(values.len());
        // Including its slopes.
        let (low, high) = (start.saturating_sub(1), (end + 1).min(values.len()));
        let weight: f32 = values[low..high].iter().sum();
        let middle = (low..high).map(|i| (i as f32 + 0.5) * values[i]).sum::<f32>() / weight;
        // A run at the border is at most half a joint.
        if start > 0 && end < values.len() {
            found.push((middle, weight / highest));
        }
        start = end;
    }
    found
}
