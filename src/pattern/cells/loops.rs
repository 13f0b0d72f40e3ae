//! Loops of half-edges: their vertices and the area inside them.

use super::{
    Cell, CellTracker,
    half_edge::{NONE, Side, Sums},
};
use glam::Vec2;

impl CellTracker {
    pub(super) fn head(&self, half_edge: u32) -> u32 {
        self.origin[half_edge as usize ^ 1]
    }

    pub(super) fn at(&self, vertex: u32) -> [i32; 2] {
        self.vertices[vertex as usize].at
    }

    /// The half-edges of a loop, starting at one of them.
    pub(super) fn walk(&self, start: u32) -> impl Iterator<Item = u32> + '_ {
        let mut following = Some(start);
        std::iter::from_fn(move || {
            let half_edge = following?;
            following = Some(self.next[half_edge as usize]).filter(|&next| next != start);
            Some(half_edge)
        })
    }

    /// Names of the vertices along a loop, without detours into dead ends.
    pub(super) fn trace(&self, start: u32) -> Vec<u32> {
        self.corners(start).into_iter().map(|vertex| self.vertices[vertex as usize].name).collect()
    }

    /// Vertices along a loop, as in [`trace`](Self::trace).
    pub(super) fn corners(&self, start: u32) -> Vec<u32> {
        let mut line: Vec<u32> = Vec::new();
        for half_edge in self.walk(start) {
            if line.last() == Some(&(half_edge ^ 1)) {
                line.pop();
            } else {
                line.push(half_edge);
            }
        }
        // The walk may have started in a dead end.
        let mut ends = 0..line.len();
        while ends.len() > 1 && line[ends.start] == line[ends.end - 1] ^ 1 {
            ends = ends.start + 1..ends.end - 1;
        }
        line[ends].iter().map(|&h| self.origin[h as usize]).collect()
    }

    pub(super) fn sums_from(&self, start: u32) -> Sums {
        let mut sums = Sums::default();
        for half_edge in self.walk(start) {
            sums.add_edge(self.at(self.origin[half_edge as usize]), self.at(self.head(half_edge)));
        }
        sums
    }

    pub(super) fn part(&mut self, mut vertex: u32) -> u32 {
        while self.vertices[vertex as usize].part != vertex {
            let above = self.vertices[self.vertices[vertex as usize].part as usize].part;
            self.vertices[vertex as usize].part = above;
            vertex = above;
        }
        vertex
    }

    pub(super) fn loop_root(&self, half_edge: u32) -> u32 {
        let mut root = self.loop_of[half_edge as usize];
        while self.loops[root as usize].root != root {
            root = self.loops[root as usize].root;
        }
        root
    }

    /// [`loop_root`](Self::loop_root) with path compression.
    pub(super) fn find_loop(&mut self, half_edge: u32) -> u32 {
        let root = self.loop_root(half_edge);
        let mut way = std::mem::replace(&mut self.loop_of[half_edge as usize], root);
        while way != root {
            way = std::mem::replace(&mut self.loops[way as usize].root, root);
        }
        root
    }

    /// Whether a place lies within a loop.
    pub(super) fn is_inside(&self, start: u32, at: [i32; 2]) -> bool {
        self.walk(start).filter(|&h| self.passes_right_of(h, at).is_some()).count() % 2 == 1
    }

    /// Where the ray to the right from just below a place meets an edge.
    pub(super) fn passes_right_of(&self, half_edge: u32, at: [i32; 2]) -> Option<f64> {
        let (a, b) = (self.at(self.origin[half_edge as usize]), self.at(self.head(half_edge)));
        if (a[1] <= at[1]) == (b[1] <= at[1]) {
            return None;
        }
        // Half a unit below, where there are no vertices.
        let share = (f64::from(at[1]) + 0.5 - f64::from(a[1])) / (f64::from(b[1]) - f64::from(a[1]));
        let x = f64::from(a[0]) + share * (f64::from(b[0]) - f64::from(a[0]));
        (x > f64::from(at[0])).then_some(x)
    }

    /// The cell around a place, other than `except`.
    pub(super) fn cell_around(&self, at: [i32; 2], except: Option<u32>) -> u32 {
        let mut found = (f64::INFINITY, 0);
        for h in (0..self.origin.len() as u32).step_by(2) {
            let Some(x) = self.passes_right_of(h, at).filter(|&x| x < found.0) else { continue };
            let goes_down = self.at(self.origin[h as usize])[1] < self.at(self.head(h))[1];
            // A loop that encloses nothing has the same cell on both sides.
            match self.loops[self.loop_root(if goes_down { h } else { h ^ 1 }) as usize].side {
                Side::Cell(cell) | Side::Around { host: cell } if cell != NONE && Some(cell) != except => {
                    found = (x, cell);
                }
                _ => {}
            }
        }
        found.1
    }

    /// Computes area and centre of a cell from its loops.
    pub(super) fn measure(&mut self, cell: u32) {
        let Cell { start, ref holes, .. } = self.cells[cell as usize];
        let mut sums = self.loops[self.loop_root(start) as usize].sums;
        for &hole in holes {
            sums.add(self.loops[self.loop_root(hole) as usize].sums);
        }
        let (area, centroid) = self.area_and_centre(sums, start);
        let cell = &mut self.cells[cell as usize];
        (cell.area, cell.centroid) = (area, centroid);
    }

    /// Area and centre for these sums; if the area is zero the centre is the start of the half-edge `start`.
    pub(super) fn area_and_centre(&self, sums: Sums, start: u32) -> (f32, Vec2) {
        let area = sums.area as f64;
        let centroid = if sums.area == 0 {
            self.vertices[self.origin[start as usize] as usize].pos
        } else {
            let [x, y] = sums.moment.map(|moment| moment as f64 / (3.0 * area) / self.scale);
            Vec2::new(x as f32, y as f32)
        };
        ((0.5 * area / (self.scale * self.scale)) as f32, centroid)
    }
}
