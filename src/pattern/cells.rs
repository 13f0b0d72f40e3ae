//! [`CellTracker`]: the closed cells of a growing network, found as they close.
//!
//! The network is a planar drawing: its nodes are the vertices, its segments (taken as straight) and the surface's
//! border are the edges. The tracker stores the half-edges of that drawing in loops, one loop for each side of each
//! connected part (Muller and Preparata 1978). A new edge either joins two parts, which merges two loops, or connects
//! two places of one part, which splits a loop: then a cell has closed. The two new loops are walked side by side
//! until the shorter one ends, and only that one is relabelled. Areas and moments are integers, so those of the
//! longer loop follow by subtraction.
//!
//! Directions are compared by exact integer cross products, never by angles.

mod closing;
mod half_edge;
mod join;
mod loops;
#[cfg(test)]
mod tests;

pub(crate) use closing::{Closing, Closings};

use super::{NO_PARENT, Network, SegmentId, Timeline};
use glam::Vec2;
use half_edge::{Cause, Loop, Side, Sums, Vertex};
use std::{
    collections::{BTreeMap, HashMap},
    ops::Range,
};

/// Index of the surface's corners in a [`CellTracker::outline`]: this plus 0, 1, 2, 3 for top left, top right, bottom
/// right, bottom left.
pub const CORNERS: u32 = u32::MAX - 4;

/// Coordinates are integers up to this.
const RANGE: f64 = (1u32 << 30) as f64;

/// Initial capacity for nodes, so that most surfaces allocate once.
const FEW: usize = 64;

/// A part of the surface that is enclosed by cracks and the border.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Area inside the straight outline, without the holes, pattern units squared.
    pub area: f32,
    /// Centre of that area, pattern units.
    pub centroid: Vec2,
    /// Step of the segment that closed it.
    pub birth: u32,
    /// The later of the impacts of that segment's ends; [`NO_IMPACT`](super::NO_IMPACT) if one has none.
    pub impact: u32,
    /// A half-edge of its outer loop.
    start: u32,
    /// Any half-edge of each loop around something disconnected inside it.
    holes: Vec<u32>,
}

/// The closed cells of a growing network, together with the surface's border.
///
/// Cell 0 exists from the start: the area that no crack has cut off yet. When a crack cuts through a cell, the larger
/// part keeps its number and the smaller one is a new cell. So a cell's number never changes, cells are never
/// removed, and their areas always add up to the surface.
///
/// Nodes closer than about 2⁻³⁰ of the surface's longer side count as one. A segment that runs along another or along
/// the border, or crosses from one cell into another, closes nothing and is ignored.
///
/// ```
/// use bevy_crack::{CrackPreset, growth::CrackGrowth, pattern::{CORNERS, Cell, CellTracker}};
///
/// let mut growth = CrackGrowth::new(CrackPreset::CLAY.growth, [1.0, 1.0].into(), 1)?;
/// growth.hit([0.5, 0.5].into(), 1.0);
/// let mut tracker = CellTracker::new(growth.network().extent());
/// while growth.step().grew() {
///     for id in tracker.update(growth.network()) {
///         let cell = &tracker.cells()[id as usize];
///         assert!(cell.birth <= growth.steps());
///     }
/// }
/// assert!(tracker.closed() > 4);
///
/// // Cells tile the surface. The first one is what no crack has cut off: it begins at the corners.
/// let cells: &[Cell] = tracker.cells();
/// assert!((cells.iter().map(|cell| cell.area).sum::<f32>() - 1.0).abs() < 1e-4);
/// assert_eq!(tracker.cell_at([0.0, 0.0].into()), Some(0));
/// assert!(tracker.outline(0).contains(&CORNERS));
/// assert_eq!(tracker.pos(CORNERS + 2), Some([1.0, 1.0].into()));
/// // The cracks around the hit do not touch its outline: they are a hole in it.
/// assert_eq!(tracker.holes(0).count(), 1);
/// # Ok::<(), bevy_crack::growth::ParamError>(())
/// ```
#[derive(Clone, Debug)]
pub struct CellTracker {
    extent: Vec2,
    /// Integer units per pattern unit; 0 for an extent that a surface cannot have.
    scale: f64,
    corner: [i32; 2],
    vertices: Vec<Vertex>,
    vertex_at: HashMap<[i32; 2], u32>,
    /// Per node: its vertex, or [`NONE`].
    vertex_of: Vec<u32>,
    links: usize,
    /// Distance along the border from the top left, and the half-edge along it that begins there.
    border: BTreeMap<i64, u32>,
    /// Per half-edge: its origin, the next one of its loop, and a loop whose root is its loop. `h ^ 1` is the
    /// opposite half-edge.
    origin: Vec<u32>,
    next: Vec<u32>,
    loop_of: Vec<u32>,
    loops: Vec<Loop>,
    cells: Vec<Cell>,
    /// Cells whose area has to be computed again.
    touched: Vec<u32>,
    /// Each cell as it was when it closed, if recorded.
    closings: Option<Closings>,
}

impl CellTracker {
    /// A tracker for a surface of `extent` pattern units, see [`Network::extent`]: it starts with one cell, the whole
    /// surface.
    ///
    /// If the extent is not finite and above zero there are no cells.
    #[must_use]
    pub fn new(extent: Vec2) -> Self {
        let valid = extent.is_finite() && extent.min_element() > 0.0;
        let scale = if valid { RANGE / f64::from(extent.max_element()) } else { 0.0 };
        let mut tracker = Self {
            extent,
            scale,
            corner: [0; 2],
            vertices: Vec::with_capacity(FEW),
            vertex_at: HashMap::with_capacity(FEW),
            vertex_of: Vec::with_capacity(FEW),
            links: 0,
            border: BTreeMap::new(),
            origin: Vec::with_capacity(2 * FEW),
            next: Vec::with_capacity(2 * FEW),
            loop_of: Vec::with_capacity(2 * FEW),
            loops: Vec::new(),
            cells: Vec::new(),
            touched: Vec::new(),
            closings: None,
        };
        tracker.corner = tracker.whole(extent);
        if valid && tracker.corner[0] > 0 && tracker.corner[1] > 0 {
            tracker.lay_border();
        }
        tracker
    }

    /// The same, which also records each cell as it was when it closed.
    pub(crate) fn recording(extent: Vec2) -> Self {
        Self { closings: Some(Closings::default()), ..Self::new(extent) }
    }

    /// The cells recorded by a tracker that is [`recording`](Self::recording).
    pub(crate) const fn closings(&self) -> Option<&Closings> {
        self.closings.as_ref()
    }

    fn lay_border(&mut self) {
        let corners = [Vec2::ZERO, Vec2::new(self.extent.x, 0.0), self.extent, Vec2::new(0.0, self.extent.y)];
        for (i, pos) in (0u32..).zip(corners) {
            let at = self.whole(pos);
            self.vertices.push(Vertex { name: CORNERS + i, pos, at, first: 2 * i, part: 0 });
            self.vertex_at.insert(at, i);
            self.border.insert(self.way(at).unwrap_or(0), 2 * i);
            self.origin.extend([i, (i + 1) % 4]);
            self.next.extend([2 * ((i + 1) % 4), 2 * ((i + 3) % 4) + 1]);
            self.loop_of.extend([0, 1]);
        }
        let inside = Loop { root: 0, side: Side::Cell(0), sums: Sums::default() };
        self.loops.extend([inside, Loop { root: 1, side: Side::Beyond, ..inside }]);
        self.loops[0].sums = self.sums_from(0);
        self.cells.push(Cell { area: 0.0, centroid: Vec2::ZERO, birth: 0, impact: 0, start: 0, holes: Vec::new() });
        self.measure(0);
    }

    /// Adds the new nodes and links of `network` since the last call, and returns the numbers of the cells that they
    /// closed.
    ///
    /// It must be called with the same network every time, which may only gain nodes and links. The cost is
    /// proportional to what was added, and to the shorter outline of each cell that closes; for each disconnected
    /// part that closes its first cell it is a few times the whole network.
    pub fn update(&mut self, network: &Network) -> Range<u32> {
        let first = self.cells.len() as u32;
        self.update_some(network, usize::MAX);
        first..self.cells.len() as u32
    }

    /// The same with `most` nodes and links at the most; returns whether none are left.
    pub(crate) fn update_some(&mut self, network: &Network, most: usize) -> bool {
        if self.cells.is_empty() {
            return true;
        }
        let (nodes, links) = (network.nodes(), network.links());
        let mut left = most;
        // In the order in which they were added, so that it does not matter how often this is called.
        while self.vertex_of.len() < nodes.len() || self.links < links.len() {
            if left == 0 {
                return false;
            }
            left -= 1;
            let i = self.vertex_of.len();
            if let Some(link) = links.get(self.links)
                && nodes.get(i).is_none_or(|node| link.birth < node.birth && (link.a.max(link.b) as usize) < i)
            {
                self.add_link(network, link.birth);
            } else {
                self.add_node(network, nodes[i].birth);
            }
        }
        self.touched.sort_unstable();
        self.touched.dedup();
        let mut touched = std::mem::take(&mut self.touched);
        touched.drain(..).for_each(|cell| self.measure(cell));
        self.touched = touched;
        true
    }

    /// Like [`update`](Self::update), in the order of a timeline, whose steps are used as births: hits in the middle
    /// of growth do not change the result either.
    pub(crate) fn follow(&mut self, network: &Network, timeline: &Timeline) {
        let (nodes, links) = (network.nodes(), network.links());
        while !self.cells.is_empty() && (self.vertex_of.len() < nodes.len() || self.links < links.len()) {
            let (i, k) = (self.vertex_of.len() as u32, self.links as u32);
            let is_next = links.get(self.links).is_some_and(|link| {
                link.a.max(link.b) < i && timeline.nodes_before(k).is_none_or(|before| before <= i)
            });
            if is_next || i as usize >= nodes.len() {
                self.add_link(network, timeline.step_of(SegmentId::Link(k)).unwrap_or(u32::MAX));
            } else {
                self.add_node(network, timeline.step_of(SegmentId::Branch(i)).unwrap_or(u32::MAX));
            }
        }
        self.touched.clear();
    }

    /// Adds the next link.
    fn add_link(&mut self, network: &Network, birth: u32) {
        let Some(link) = network.links().get(self.links) else { return };
        self.links += 1;
        let [a, b] = [link.a, link.b].map(|node| {
            let vertex = self.vertex_of.get(node as usize)?;
            Some((*vertex, network.nodes().get(node as usize)?.impact))
        });
        if let (Some((a, impact)), Some((b, other))) = (a, b) {
            self.join(a, b, Cause { birth, impact: impact.max(other) });
        }
    }

    /// Adds the next node, with the branch that leads to it.
    fn add_node(&mut self, network: &Network, birth: u32) {
        let i = self.vertex_of.len();
        let Some(node) = network.nodes().get(i) else { return };
        let vertex = self.add_vertex(i as u32, node.pos);
        self.vertex_of.push(vertex);
        if node.parent != NO_PARENT
            && let Some(&parent) = self.vertex_of.get(node.parent as usize)
        {
            let impact = network.nodes().get(node.parent as usize).map_or(node.impact, |parent| parent.impact);
            self.join(parent, vertex, Cause { birth, impact: impact.max(node.impact) });
        }
    }

    /// All cells by number; the first is the area that no crack has cut off yet.
    #[must_use]
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Number of cells that cracks have cut off.
    #[must_use]
    pub fn closed(&self) -> u32 {
        (self.cells.len() as u32).saturating_sub(1)
    }

    /// The outline of a cell, turning from x to y: indices of nodes and [`CORNERS`], without cracks that end inside
    /// it.
    ///
    /// Empty if there is no such cell. A place appears more than once where the cell touches itself.
    #[must_use]
    pub fn outline(&self, cell: u32) -> Vec<u32> {
        self.cells.get(cell as usize).map_or_else(Vec::new, |cell| self.trace(cell.start))
    }

    /// The outlines of the parts inside a cell that are not connected to its outline, in the opposite direction.
    pub fn holes(&self, cell: u32) -> impl Iterator<Item = Vec<u32>> + '_ {
        self.cells.get(cell as usize).into_iter().flat_map(|cell| &cell.holes).map(|&hole| self.trace(hole))
    }

    /// Position of a point of an outline, pattern units.
    #[must_use]
    pub fn pos(&self, point: u32) -> Option<Vec2> {
        let vertex = if point >= CORNERS { point - CORNERS } else { *self.vertex_of.get(point as usize)? };
        self.vertices.get(vertex as usize).map(|vertex| vertex.pos)
    }

    /// The cell at a position; the cost is proportional to the size of the network.
    #[must_use]
    pub fn cell_at(&self, pos: Vec2) -> Option<u32> {
        let inside = !self.cells.is_empty() && pos.is_finite() && pos.cmpge(Vec2::ZERO).all();
        (inside && pos.cmple(self.extent).all()).then(|| self.cell_around(self.whole(pos), None))
    }

    fn whole(&self, pos: Vec2) -> [i32; 2] {
        let coordinate = |x: f32| (f64::from(x) * self.scale).round().clamp(0.0, RANGE) as i32;
        [coordinate(pos.x), coordinate(pos.y)]
    }

    /// Distance of a place along the border, if it is on it.
    fn way(&self, [x, y]: [i32; 2]) -> Option<i64> {
        let [w, h] = self.corner.map(i64::from);
        let (x, y) = (i64::from(x), i64::from(y));
        match () {
            () if y == 0 => Some(x),
            () if x == w => Some(w + y),
            () if y == h => Some(w + h + (w - x)),
            () if x == 0 => Some(w + h + w + (h - y)),
            () => None,
        }
    }
}
