//! An index of the drawn lines of a network, so that no other line is drawn across them.

use crate::pattern::{PathPoint, SegmentPath};
use glam::{DVec2, UVec2, Vec2};

const NONE: u32 = u32::MAX;

/// Lines closer than this (pattern units) count as touching.
const CLEARANCE: f64 = 2e-4;

/// Lines whose bounds are further apart do not touch, despite rounding.
const APART: f32 = 2.0 * CLEARANCE as f32;

/// Cosine of the least angle between two lines at a node, 20 degrees: closer ones would be one line drawn twice.
const LEAST_ANGLE: f64 = 0.94;

/// The line of one segment.
#[derive(Clone, Copy, Debug)]
struct Wall {
    ends: (u32, u32),
    first: u32,
    len: u32,
    low: Vec2,
    high: Vec2,
}

/// A spatial index of lines; lines are only ever added.
#[derive(Clone, Debug)]
pub(super) struct Walls {
    cells: UVec2,
    /// Cells per pattern unit.
    per_unit: Vec2,
    head: Vec<u32>,
    /// Wall and next entry.
    entries: Vec<(u32, u32)>,
    walls: Vec<Wall>,
    /// Per wall: its ends, and the first cell that it lies in.
    chords: Vec<Chord>,
    points: Vec<Vec2>,
}

/// The straight line between the ends of a wall.
#[derive(Clone, Copy, Debug)]
struct Chord {
    from: Vec2,
    to: Vec2,
    cell: UVec2,
}

impl Walls {
    /// An index over `extent` for lines of about `length`.
    pub(super) fn new(extent: Vec2, length: f32) -> Self {
        let side = length.max(extent.max_element() / 512.0);
        let cells = (extent / side).ceil().as_uvec2().max(UVec2::ONE);
        Self {
            cells,
            per_unit: cells.as_vec2() / extent,
            head: vec![NONE; cells.x as usize * cells.y as usize],
            entries: Vec::new(),
            walls: Vec::new(),
            chords: Vec::new(),
            points: Vec::new(),
        }
    }

    fn cell_at(&self, pos: Vec2) -> UVec2 {
        (pos * self.per_unit).max(Vec2::ZERO).as_uvec2().min(self.cells - UVec2::ONE)
    }

    fn slots(&self, low: Vec2, high: Vec2) -> impl Iterator<Item = usize> + use<> {
        let (low, high, width) = (self.cell_at(low), self.cell_at(high), self.cells.x as usize);
        (low.y as usize..=high.y as usize)
            .flat_map(move |y| (low.x as usize..=high.x as usize).map(move |x| y * width + x))
    }

    /// Reserves memory for lines that mostly have two pieces in two cells.
    pub(super) fn reserve(&mut self, lines: usize) {
        self.entries.reserve(2 * lines);
        self.walls.reserve(lines);
        self.chords.reserve(lines);
        self.points.reserve(3 * lines);
    }

    /// Adds the line between two nodes.
    pub(super) fn add(&mut self, ends: (u32, u32), path: &SegmentPath) {
        let wall = self.walls.len() as u32;
        let (low, high) = bounds(path.points());
        for slot in self.slots(low, high) {
            self.entries.push((wall, self.head[slot]));
            self.head[slot] = self.entries.len() as u32 - 1;
        }
        let points = path.points();
        self.walls.push(Wall { ends, first: self.points.len() as u32, len: points.len() as u32, low, high });
        self.chords.push(Chord { from: points[0].pos, to: points[points.len() - 1].pos, cell: self.cell_at(low) });
        self.points.extend(points.iter().map(|point| point.pos));
    }

    /// Whether the line `path` between the nodes `ends` would touch another elsewhere than at a shared node, or run along
    /// it; a node that does not exist yet is `u32::MAX`.
    pub(super) fn touches_any(&self, ends: (u32, u32), path: &SegmentPath) -> bool {
        let (low, high) = bounds(path.points());
        let (low, high) = (low - APART, high + APART);
        self.slots(low, high).any(|slot| {
            let mut entry = self.head[slot];
            while entry != NONE {
                let (wall, next) = self.entries[entry as usize];
                let wall = self.walls[wall as usize];
                let is_near = wall.low.cmple(high).all() && wall.high.cmpge(low).all();
                if is_near && self.touches(wall, ends, path.points()) {
                    return true;
                }
                entry = next;
            }
            false
        })
    }

    fn touches(&self, wall: Wall, ends: (u32, u32), path: &[PathPoint]) -> bool {
        if wall.ends == ends || wall.ends == (ends.1, ends.0) {
            return true;
        }
        let line = &self.points[wall.first as usize..(wall.first + wall.len) as usize];
        let last = (path.len() - 2, line.len() - 2);
        for (i, piece) in path.windows(2).enumerate() {
            let (a, b) = (piece[0].pos.as_dvec2(), piece[1].pos.as_dvec2());
            for (j, other) in line.windows(2).enumerate() {
                let (c, d) = (other[0].as_dvec2(), other[1].as_dvec2());
                // The two pieces at a shared node, starting from it.
                let shared = if i == 0 && j == 0 && ends.0 == wall.ends.0 {
                    Some((b - a, d - c))
                } else if i == 0 && j == last.1 && ends.0 == wall.ends.1 {
                    Some((b - a, c - d))
                } else if i == last.0 && j == 0 && ends.1 == wall.ends.0 {
                    Some((a - b, d - c))
                } else if i == last.0 && j == last.1 && ends.1 == wall.ends.1 {
                    Some((a - b, c - d))
                } else {
                    None
                };
                let touching = match shared {
                    Some((u, v)) => u.dot(v) > LEAST_ANGLE * (u.length_squared() * v.length_squared()).sqrt(),
                    None => gap_sq((a, b), (c, d)) < CLEARANCE * CLEARANCE,
                };
                if touching {
                    return true;
                }
            }
        }
        false
    }

    /// Calls `visit` with the ends of each line that may pass within `distance` of `pos`, once.
    pub(super) fn each_near(&self, pos: Vec2, distance: f32, mut visit: impl FnMut(Vec2, Vec2)) {
        let (low, high) = (self.cell_at(pos - distance), self.cell_at(pos + distance));
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                let cell = UVec2::new(x, y);
                let mut entry = self.head[y as usize * self.cells.x as usize + x as usize];
                while entry != NONE {
                    let (wall, next) = self.entries[entry as usize];
                    let chord = &self.chords[wall as usize];
                    // Of all the cells that it lies in, in the first one of these.
                    if chord.cell.max(low) == cell {
                        visit(chord.from, chord.to);
                    }
                    entry = next;
                }
            }
        }
    }

    /// Whether a line passes within `distance` of `pos`.
    pub(super) fn any_within(&self, pos: Vec2, distance: f32) -> bool {
        let limit = f64::from(distance).powi(2);
        let (low, high) = (pos - distance - APART, pos + distance + APART);
        self.slots(low, high).any(|slot| {
            let mut entry = self.head[slot];
            while entry != NONE {
                let (wall, next) = self.entries[entry as usize];
                let Wall { first, len, low: from, high: to, .. } = self.walls[wall as usize];
                let line = &self.points[first as usize..(first + len) as usize];
                if from.cmple(high).all()
                    && to.cmpge(low).all()
                    && line.windows(2).any(|p| point_gap_sq(pos.as_dvec2(), (p[0].as_dvec2(), p[1].as_dvec2())) < limit)
                {
                    return true;
                }
                entry = next;
            }
            false
        })
    }
}

/// Whether a rough line crosses itself.
pub(super) fn crosses_itself(path: &SegmentPath) -> bool {
    let piece = |pair: &[PathPoint]| (pair[0].pos.as_dvec2(), pair[1].pos.as_dvec2());
    let points = path.points();
    (2..points.len().saturating_sub(1))
        .any(|i| points[..i].windows(2).any(|earlier| crosses(piece(earlier), piece(&points[i..i + 2]))))
}

fn bounds(path: &[PathPoint]) -> (Vec2, Vec2) {
    let first = path[0].pos;
    path.iter().fold((first, first), |(low, high), point| (low.min(point.pos), high.max(point.pos)))
}

/// Squared distance from a point to a piece of line.
fn point_gap_sq(p: DVec2, (a, b): (DVec2, DVec2)) -> f64 {
    let way = b - a;
    let length_sq = way.length_squared();
    let share = if length_sq > 0.0 { ((p - a).dot(way) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    p.distance_squared(a + way * share)
}

/// Squared distance between two pieces of line; 0 where they cross.
fn gap_sq(one: (DVec2, DVec2), other: (DVec2, DVec2)) -> f64 {
    if crosses(one, other) {
        return 0.0;
    }
    let ends = point_gap_sq(one.0, other).min(point_gap_sq(one.1, other));
    ends.min(point_gap_sq(other.0, one)).min(point_gap_sq(other.1, one))
}

/// Whether the ends of each lie on different sides of the other.
fn crosses((a, b): (DVec2, DVec2), (c, d): (DVec2, DVec2)) -> bool {
    let side = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
    (side(a, b, c) > 0.0) != (side(a, b, d) > 0.0) && (side(c, d, a) > 0.0) != (side(c, d, b) > 0.0)
}
