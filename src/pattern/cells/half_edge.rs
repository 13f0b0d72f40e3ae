//! Half-edges, loops and vertices of a planar drawing.

use glam::Vec2;

pub(super) const NONE: u32 = u32::MAX;

/// The area to the left of a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// This cell; the loop is its outline.
    Cell(u32),
    /// The cell `host`; the loop is a hole in it. Unknown ([`NONE`]) as long as the part encloses nothing.
    Around { host: u32 },
    /// Outside the border.
    Beyond,
}

/// Half-edges that follow each other around one side of a connected part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loop {
    /// The loop into which it was merged; itself if none.
    pub(super) root: u32,
    pub(super) side: Side,
    pub(super) sums: Sums,
}

/// Integrals over the inside of a loop, in integers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums {
    /// Twice the area; negative if the loop has the opposite orientation.
    pub(super) area: i64,
    /// Six times the first moment.
    pub(super) moment: [i128; 2],
}

impl Sums {
    pub(super) fn add_edge(&mut self, [ax, ay]: [i32; 2], [bx, by]: [i32; 2]) {
        let (ax, ay, bx, by) = (i64::from(ax), i64::from(ay), i64::from(bx), i64::from(by));
        let cross = ax * by - bx * ay;
        // Intermediate sums may wrap; the final one fits.
        self.area = self.area.wrapping_add(cross);
        self.moment[0] = self.moment[0].wrapping_add(i128::from(ax + bx) * i128::from(cross));
        self.moment[1] = self.moment[1].wrapping_add(i128::from(ay + by) * i128::from(cross));
    }

    pub(super) fn add(&mut self, other: Self) {
        self.area = self.area.wrapping_add(other.area);
        self.moment = [0, 1].map(|i| self.moment[i].wrapping_add(other.moment[i]));
    }

    pub(super) fn subtract(&mut self, other: Self) {
        self.area = self.area.wrapping_sub(other.area);
        self.moment = [0, 1].map(|i| self.moment[i].wrapping_sub(other.moment[i]));
    }
}

/// A point where edges meet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    /// Index of the first node at this place, or [`CORNERS`] plus the corner.
    pub(super) name: u32,
    pub(super) pos: Vec2,
    pub(super) at: [i32; 2],
    /// One half-edge that leaves from here.
    pub(super) first: u32,
    /// Link towards the vertex that represents its connected part (union-find).
    pub(super) part: u32,
}

/// Where a new edge is inserted at a vertex: between the half-edge before it in the loop and the one after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gap {
    pub(super) before: u32,
    pub(super) after: u32,
}

/// The properties of the segment being added.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cause {
    pub(super) birth: u32,
    pub(super) impact: u32,
}

/// An edge would leave a vertex in the direction of another edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Overlap;
