//! Which edges come near each other: a grid of square cells.

use super::super::lattice::Point;

/// An edge from `a` to `b`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Edge {
    pub(super) a: Point,
    pub(super) b: Point,
}

impl Edge {
    /// Smallest and largest coordinates.
    pub(super) fn bounds(&self) -> [i32; 4] {
        [self.a.x.min(self.b.x), self.a.y.min(self.b.y), self.a.x.max(self.b.x), self.a.y.max(self.b.y)]
    }
}

/// Edges that are less than two lattice steps apart share a cell.
const MARGIN: i32 = 2;

/// The cells of a grid.
pub(super) struct Bins {
    low: Point,
    /// The side of a cell is two to this power.
    shift: u32,
    columns: u32,
    rows: u32,
}

impl Bins {
    /// At most `per` cells for each edge and a few more, and a quarter of that at least, unless edges are so long that each would be in too many.
    pub(super) fn new(edges: &[Edge], per: u64) -> Self {
        let mut bounds = [i32::MAX, i32::MAX, i32::MIN, i32::MIN];
        let mut length = 0i64;
        for edge in edges {
            let [x0, y0, x1, y1] = edge.bounds();
            bounds = [bounds[0].min(x0), bounds[1].min(y0), bounds[2].max(x1), bounds[3].max(y1)];
            length += i64::from(x1 - x0) + i64::from(y1 - y0);
        }
        let low = Point::new(bounds[0] - MARGIN, bounds[1] - MARGIN);
        let width = [bounds[2] - low.x + MARGIN, bounds[3] - low.y + MARGIN].map(|side| side as u32);
        let count = edges.len() as u64;
        let mean = length as u64 / count.max(1);
        let cells = |shift: u32| (u64::from(width[0] >> shift) + 1) * (u64::from(width[1] >> shift) + 1);
        let mut shift = 2;
        while (16 << shift) < mean || cells(shift) > per * count + 64 {
            shift += 1;
        }
        Self { low, shift, columns: (width[0] >> shift) + 1, rows: (width[1] >> shift) + 1 }
    }

    /// Number of cells.
    pub(super) const fn len(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    fn column(&self, x: i32) -> u32 {
        ((x - self.low.x).max(0) as u32 >> self.shift).min(self.columns - 1)
    }

    fn row(&self, y: i32) -> u32 {
        ((y - self.low.y).max(0) as u32 >> self.shift).min(self.rows - 1)
    }

    /// The cell of a point.
    pub(super) fn cell(&self, p: Point) -> u32 {
        self.row(p.y) * self.columns + self.column(p.x)
    }

    /// Calls `visit` for each cell that the edge reaches.
    #[inline]
    pub(super) fn cells(&self, edge: &Edge, mut visit: impl FnMut(u32)) {
        let [x0, y0, x1, y1] = edge.bounds();
        let [c0, c1] = [self.column(x0 - MARGIN), self.column(x1 + MARGIN)];
        let [r0, r1] = [self.row(y0 - MARGIN), self.row(y1 + MARGIN)];
        if c0 == c1 && r0 == r1 {
            visit(r0 * self.columns + c0);
            return;
        }
        if c1 - c0 <= 1 || r1 - r0 <= 1 {
            for row in r0..=r1 {
                (c0..=c1).for_each(|column| visit(row * self.columns + column));
            }
            return;
        }
        let per_row = (f64::from(edge.b.x) - f64::from(edge.a.x)) / (f64::from(edge.b.y) - f64::from(edge.a.y));
        for row in r0..=r1 {
            // The part of the edge between the borders of the row, and a margin.
            let top = self.low.y + ((row << self.shift) as i32) - MARGIN;
            let bottom = self.low.y + (((row + 1) << self.shift) as i32) + MARGIN;
            let ends = [top.max(y0), bottom.min(y1)].map(|y| {
                let x = f64::from(edge.a.x) + (f64::from(y) - f64::from(edge.a.y)) * per_row;
                x.clamp(f64::from(x0), f64::from(x1)) as i32
            });
            let from = self.column(ends[0].min(ends[1]) - MARGIN - 1);
            let to = self.column(ends[0].max(ends[1]) + MARGIN + 1);
            (from..=to).for_each(|column| visit(row * self.columns + column));
        }
    }
}
