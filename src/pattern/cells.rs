//! [`CellTracker`]: the closed cells of a growing network, found as they close.
//!
//! The network is a planar drawing: its nodes are the vertices, its segments (taken as straight) and the surface's
//! border the edges. The tracker keeps the half-edges of that drawing in loops, one loop for each side of each connected
//! part (Muller and Preparata 1978). A new edge either joins two parts, which merges two loops, or two places of one part,
//! which splits a loop: then a cell has closed. The two new loops are walked side by side until the shorter one ends, and only
//! that one is marked anew; areas and moments are whole numbers, so the longer loop's follow by subtraction.
//!
//! Directions are compared by exact cross products of whole numbers, never by angles.

use super::{NO_PARENT, Network, SegmentId, Timeline};
use glam::Vec2;
use std::{
    collections::{BTreeMap, HashMap},
    ops::Range,
};

/// The surface's corners in a [`CellTracker::outline`]: this plus 0, 1, 2, 3 from the top left, right, down, left, up.
pub const CORNERS: u32 = u32::MAX - 4;

/// Coordinates are whole numbers up to this.
const RANGE: f64 = (1u32 << 30) as f64;
const NONE: u32 = u32::MAX;

/// Room for so many nodes from the start, so that most surfaces ask for memory once.
const FEW: usize = 64;

/// A part of the surface that cracks and border enclose.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Area inside the straight outline, without the holes, pattern units squared.
    pub area: f32,
    /// Centre of that area, pattern units.
    pub centroid: Vec2,
    /// Step at which the segment was born that closed it.
    pub birth: u32,
    /// The later of the impacts of that segment's ends; [`NO_IMPACT`](super::NO_IMPACT) if one has none.
    pub impact: u32,
    /// A half-edge of its outer loop.
    start: u32,
    /// Any half-edge of each loop that runs around something inside it that hangs on nothing.
    holes: Vec<u32>,
}

/// What lies to the left of a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    /// This cell, with the loop around it.
    Cell(u32),
    /// The cell `host`, with the loop as a hole in it. Unknown ([`NONE`]) as long as the part encloses nothing.
    Around { host: u32 },
    /// Nothing: it is beyond the border.
    Beyond,
}

/// Half-edges that follow each other around one side of a connected part.
#[derive(Clone, Copy, Debug)]
struct Loop {
    /// The loop that it has become part of; itself if none.
    root: u32,
    side: Side,
    sums: Sums,
}

/// Integrals over the inside of a loop, in whole numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums {
    /// Twice the area; negative if the loop runs around it the other way.
    area: i64,
    /// Six times the first moment.
    moment: [i128; 2],
}

impl Sums {
    fn add_edge(&mut self, [ax, ay]: [i32; 2], [bx, by]: [i32; 2]) {
        let (ax, ay, bx, by) = (i64::from(ax), i64::from(ay), i64::from(bx), i64::from(by));
        let cross = ax * by - bx * ay;
        // Sums on the way may wrap; the last one fits.
        self.area = self.area.wrapping_add(cross);
        self.moment[0] = self.moment[0].wrapping_add(i128::from(ax + bx) * i128::from(cross));
        self.moment[1] = self.moment[1].wrapping_add(i128::from(ay + by) * i128::from(cross));
    }

    fn add(&mut self, other: Self) {
        self.area = self.area.wrapping_add(other.area);
        self.moment = [0, 1].map(|i| self.moment[i].wrapping_add(other.moment[i]));
    }

    fn subtract(&mut self, other: Self) {
        self.area = self.area.wrapping_sub(other.area);
        self.moment = [0, 1].map(|i| self.moment[i].wrapping_sub(other.moment[i]));
    }
}

/// A point where edges meet.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    /// Index of the first node at this place, or [`CORNERS`] plus the corner.
    name: u32,
    pos: Vec2,
    at: [i32; 2],
    /// One half-edge that leaves from here.
    first: u32,
    /// Towards the vertex that stands for its connected part.
    part: u32,
}

/// Where a new edge leaves a vertex: between the half-edge that comes before it in the loop, and the one after.
#[derive(Clone, Copy, Debug)]
struct Gap {
    before: u32,
    after: u32,
}

/// What is known of the segment being added.
#[derive(Clone, Copy, Debug)]
struct Cause {
    birth: u32,
    impact: u32,
}

/// The closed cells of a network that grows, with the surface's border.
///
/// Cell 0 is there from the start: what no crack has cut off yet. When a crack cuts through a cell, the larger part keeps
/// its number and the smaller one is a new cell: so a cell's number never changes, cells are never removed, and their
/// areas always add up to the surface.
///
/// Nodes closer than about 2⁻³⁰ of the surface's longer side count as one. A segment that runs along another or along the
/// border, or crosses from one cell into another, closes nothing and is left out.
///
/// ```
/// use bevy_crack::{CrackPreset, growth::CrackGrowth, pattern::CellTracker};
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
/// # Ok::<(), bevy_crack::growth::ParamError>(())
/// ```
#[derive(Clone, Debug)]
pub struct CellTracker {
    extent: Vec2,
    /// Whole numbers per pattern unit; 0 for an extent that no surface can have.
    scale: f64,
    corner: [i32; 2],
    vertices: Vec<Vertex>,
    vertex_at: HashMap<[i32; 2], u32>,
    /// Per node: its vertex, or [`NONE`].
    vertex_of: Vec<u32>,
    links: usize,
    /// Way along the border from the top left, and the half-edge along it that begins there.
    border: BTreeMap<i64, u32>,
    /// Per half-edge: where it begins, the next of its loop, and a loop whose root is its own. `h ^ 1` runs the other way.
    origin: Vec<u32>,
    next: Vec<u32>,
    loop_of: Vec<u32>,
    loops: Vec<Loop>,
    cells: Vec<Cell>,
    /// Cells whose area has to be computed again.
    touched: Vec<u32>,
    /// Each cell as it was when it closed, if that is wanted.
    closings: Option<Closings>,
}

/// The cells of a network, each as it was at the moment it closed: later ones have been cut off it since.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Closings {
    list: Vec<Closing>,
    /// All outlines, one after the other.
    points: Vec<Vec2>,
}

/// A cell at the moment it closed. The first in the list is cell 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Closing {
    /// Step of the timeline in which the segment comes that closes it.
    pub(crate) birth: u32,
    /// The impact of that segment.
    pub(crate) impact: u32,
    /// The cell that it was a part of before.
    pub(crate) host: u32,
    /// Area inside the outline, pattern units squared, and its centre.
    pub(crate) area: f32,
    pub(crate) centroid: Vec2,
    first: usize,
    end: usize,
}

impl Closings {
    pub(crate) fn all(&self) -> &[Closing] {
        &self.list
    }

    /// The straight outline, pattern units.
    pub(crate) fn outline(&self, closing: &Closing) -> &[Vec2] {
        self.points.get(closing.first..closing.end).unwrap_or_default()
    }

    fn push(&mut self, cause: Cause, host: u32, (area, centroid): (f32, Vec2), outline: impl Iterator<Item = Vec2>) {
        let first = self.points.len();
        self.points.extend(outline);
        let Cause { birth, impact } = cause;
        self.list.push(Closing { birth, impact, host, area, centroid, first, end: self.points.len() });
    }
}

impl CellTracker {
    /// The tracker of a surface of `extent` pattern units, see [`Network::extent`]: one cell, the whole.
    ///
    /// With an extent that is not finite and above zero there are no cells.
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

    /// The same, which keeps of each cell what it was when it closed.
    pub(crate) fn recording(extent: Vec2) -> Self {
        Self { closings: Some(Closings::default()), ..Self::new(extent) }
    }

    /// What was kept by a tracker that is [`recording`](Self::recording).
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

    /// Takes in what `network` has gained since the last call, and returns the numbers of the cells that closed thereby.
    ///
    /// Must be given the same network every time, which may only gain nodes and links. Costs as much as what was gained,
    /// and the shorter outline of each cell that closes; a few times the whole network for each unconnected part that
    /// closes its first cell.
    pub fn update(&mut self, network: &Network) -> Range<u32> {
        let first = self.cells.len() as u32;
        if self.cells.is_empty() {
            return 0..0;
        }
        let (nodes, links) = (network.nodes(), network.links());
        // In order of birth, so that it does not matter how often this is called.
        while self.vertex_of.len() < nodes.len() || self.links < links.len() {
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
        first..self.cells.len() as u32
    }

    /// As [`update`](Self::update), in the order of a timeline, whose steps count as births: hits in the middle of growth do not change it
    /// either.
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

    /// Takes in the next link.
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

    /// Takes in the next node, with the branch that leads to it.
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

    /// All cells by their number; the first is what no crack has cut off yet.
    #[must_use]
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// How many cells the cracks have cut off.
    #[must_use]
    pub fn closed(&self) -> u32 {
        (self.cells.len() as u32).saturating_sub(1)
    }

    /// The outline of a cell: indices of nodes and [`CORNERS`], x turning to y, without cracks that end inside it.
    ///
    /// Empty if there is no such cell. A place is passed more than once where the cell touches itself.
    #[must_use]
    pub fn outline(&self, cell: u32) -> Vec<u32> {
        self.cells.get(cell as usize).map_or_else(Vec::new, |cell| self.trace(cell.start))
    }

    /// The outlines of what lies inside a cell without being joined to its outline, the other way round.
    pub fn holes(&self, cell: u32) -> impl Iterator<Item = Vec<u32>> + '_ {
        self.cells.get(cell as usize).into_iter().flat_map(|cell| &cell.holes).map(|&hole| self.trace(hole))
    }

    /// Place of a point of an outline, pattern units.
    #[must_use]
    pub fn pos(&self, point: u32) -> Option<Vec2> {
        let vertex = if point >= CORNERS { point - CORNERS } else { *self.vertex_of.get(point as usize)? };
        self.vertices.get(vertex as usize).map(|vertex| vertex.pos)
    }

    /// The cell at a place; costs as much as the network is large.
    #[must_use]
    pub fn cell_at(&self, pos: Vec2) -> Option<u32> {
        let inside = !self.cells.is_empty() && pos.is_finite() && pos.cmpge(Vec2::ZERO).all();
        (inside && pos.cmple(self.extent).all()).then(|| self.cell_around(self.whole(pos), None))
    }

    fn whole(&self, pos: Vec2) -> [i32; 2] {
        let coordinate = |x: f32| (f64::from(x) * self.scale).round().clamp(0.0, RANGE) as i32;
        [coordinate(pos.x), coordinate(pos.y)]
    }

    /// How far along the border a place is, if it is on it.
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

    /// The vertex at `pos`; where there is none, a new one, in the border if it lies on it.
    fn add_vertex(&mut self, name: u32, pos: Vec2) -> u32 {
        if !pos.is_finite() {
            return NONE;
        }
        let at = self.whole(pos.clamp(Vec2::ZERO, self.extent));
        let vertex = self.vertices.len() as u32;
        let known = *self.vertex_at.entry(at).or_insert(vertex);
        if known != vertex {
            return known;
        }
        self.vertices.push(Vertex { name, pos, at, first: NONE, part: vertex });
        if let Some(way) = self.way(at)
            && let Some((_, &inner)) = self.border.range(..way).next_back()
        {
            self.split_border(inner, vertex);
            self.border.insert(way, self.vertices[vertex as usize].first);
        }
        vertex
    }

    /// Puts `vertex` into the border's edge `inner`.
    fn split_border(&mut self, inner: u32, vertex: u32) {
        let outer = inner ^ 1;
        let end = self.origin[outer as usize];
        // What comes before `outer` around its origin.
        let mut before = inner;
        while self.next[before as usize] != outer {
            before = self.next[before as usize] ^ 1;
        }
        let (rest, back) = (self.origin.len() as u32, self.origin.len() as u32 + 1);
        self.origin.extend([vertex, end]);
        self.origin[outer as usize] = vertex;
        self.next.extend([self.next[inner as usize], outer]);
        self.next[inner as usize] = rest;
        self.next[before as usize] = back;
        self.loop_of.extend([self.loop_of[inner as usize], self.loop_of[outer as usize]]);
        self.vertices[end as usize].first = back;
        self.vertices[vertex as usize].first = rest;
        self.vertices[vertex as usize].part = 0;
    }

    fn head(&self, half_edge: u32) -> u32 {
        self.origin[half_edge as usize ^ 1]
    }

    fn at(&self, vertex: u32) -> [i32; 2] {
        self.vertices[vertex as usize].at
    }

    /// The half-edges of a loop from one of them.
    fn walk(&self, start: u32) -> impl Iterator<Item = u32> + '_ {
        let mut following = Some(start);
        std::iter::from_fn(move || {
            let half_edge = following?;
            following = Some(self.next[half_edge as usize]).filter(|&next| next != start);
            Some(half_edge)
        })
    }

    /// Names along a loop, without the ways to dead ends and back.
    fn trace(&self, start: u32) -> Vec<u32> {
        self.corners(start).into_iter().map(|vertex| self.vertices[vertex as usize].name).collect()
    }

    /// Vertices along a loop, as in [`trace`](Self::trace).
    fn corners(&self, start: u32) -> Vec<u32> {
        let mut line: Vec<u32> = Vec::new();
        for half_edge in self.walk(start) {
            if line.last() == Some(&(half_edge ^ 1)) {
                line.pop();
            } else {
                line.push(half_edge);
            }
        }
        // The walk may have begun on such a way.
        let mut ends = 0..line.len();
        while ends.len() > 1 && line[ends.start] == line[ends.end - 1] ^ 1 {
            ends = ends.start + 1..ends.end - 1;
        }
        line[ends].iter().map(|&h| self.origin[h as usize]).collect()
    }

    fn sums_from(&self, start: u32) -> Sums {
        let mut sums = Sums::default();
        for half_edge in self.walk(start) {
            sums.add_edge(self.at(self.origin[half_edge as usize]), self.at(self.head(half_edge)));
        }
        sums
    }

    fn part(&mut self, mut vertex: u32) -> u32 {
        while self.vertices[vertex as usize].part != vertex {
            let above = self.vertices[self.vertices[vertex as usize].part as usize].part;
            self.vertices[vertex as usize].part = above;
            vertex = above;
        }
        vertex
    }

    fn loop_root(&self, half_edge: u32) -> u32 {
        let mut root = self.loop_of[half_edge as usize];
        while self.loops[root as usize].root != root {
            root = self.loops[root as usize].root;
        }
        root
    }

    /// [`loop_root`](Self::loop_root), remembered.
    fn find_loop(&mut self, half_edge: u32) -> u32 {
        let root = self.loop_root(half_edge);
        let mut way = std::mem::replace(&mut self.loop_of[half_edge as usize], root);
        while way != root {
            way = std::mem::replace(&mut self.loops[way as usize].root, root);
        }
        root
    }

    /// Where an edge from `u` towards `v` finds its place; `Err` if it would run along another, `Ok(None)` if it is the first.
    fn gap(&self, u: u32, v: u32) -> Result<Option<Gap>, Overlap> {
        let vertex = &self.vertices[u as usize];
        if vertex.first == NONE {
            return Ok(None);
        }
        let new = direction(vertex.at, self.at(v));
        // The first half-edge to the left of the new one comes out just before it in their loop's twin.
        let mut left = (vertex.first, self.turn(new, vertex, vertex.first)?);
        let mut half_edge = self.next[vertex.first as usize ^ 1];
        while half_edge != vertex.first {
            let turn = self.turn(new, vertex, half_edge)?;
            let (half, way) = left.1;
            if turn.0 < half || (turn.0 == half && cross(turn.1, way) > 0) {
                left = (half_edge, turn);
            }
            half_edge = self.next[half_edge as usize ^ 1];
        }
        let before = left.0 ^ 1;
        Ok(Some(Gap { before, after: self.next[before as usize] }))
    }

    /// Which half turn from `new` a half-edge lies in, and its direction.
    fn turn(&self, new: [i64; 2], from: &Vertex, half_edge: u32) -> Result<(u8, [i64; 2]), Overlap> {
        let way = direction(from.at, self.at(self.head(half_edge)));
        match cross(new, way) {
            1.. => Ok((0, way)),
            0 if new[0] * way[0] + new[1] * way[1] < 0 => Ok((1, way)),
            0 => Err(Overlap),
            _ => Ok((2, way)),
        }
    }

    /// Adds the edge between two vertices, unless it runs along another or crosses one.
    fn join(&mut self, u: u32, v: u32, cause: Cause) {
        if u == v || u == NONE || v == NONE || self.along_border(u, v) {
            return;
        }
        let (Ok(gap_u), Ok(gap_v)) = (self.gap(u, v), self.gap(v, u)) else { return };
        let loops = [gap_u, gap_v].map(|gap| gap.map(|gap| self.find_loop(gap.after)));
        let Some(side) = self.common_side(loops) else { return };
        let (part_u, part_v) = (self.part(u), self.part(v));
        let closes = part_u == part_v;
        // In a planar drawing two places of one part that see each other are on one loop, and those of two parts are not.
        if closes != (loops[0] == loops[1] && loops[0].is_some()) {
            return;
        }

        let (out, back) = (self.origin.len() as u32, self.origin.len() as u32 + 1);
        self.origin.extend([u, v]);
        self.next.extend([back, out]);
        for (vertex, gap, leaving) in [(u, gap_u, out), (v, gap_v, back)] {
            match gap {
                Some(Gap { before, after }) => {
                    self.next[before as usize] = leaving;
                    self.next[leaving as usize ^ 1] = after;
                }
                None => self.vertices[vertex as usize].first = leaving,
            }
        }
        if closes {
            let whole = loops[0].unwrap_or(0);
            self.loop_of.extend([whole; 2]);
            self.close(whole, out, cause);
            return;
        }
        // The border's part keeps its number.
        let (above, below) = (part_u.min(part_v), part_u.max(part_v));
        self.vertices[below as usize].part = above;
        let merged = match loops {
            [Some(a), Some(b)] => self.merge(a, b, side),
            [Some(one), None] | [None, Some(one)] => one,
            [None, None] => {
                let root = self.loops.len() as u32;
                self.loops.push(Loop { root, side, sums: Sums::default() });
                root
            }
        };
        self.loop_of.extend([merged; 2]);
    }

    /// Whether the line between two vertices lies in the border.
    fn along_border(&self, u: u32, v: u32) -> bool {
        let (a, b) = (self.at(u), self.at(v));
        (0..2).any(|i| a[i] == b[i] && (a[i] == 0 || a[i] == self.corner[i]))
    }

    /// What the loops at the ends of a new edge have on their left, if it can be the same.
    fn common_side(&self, loops: [Option<u32>; 2]) -> Option<Side> {
        let unknown = Side::Around { host: NONE };
        let [a, b] = loops.map(|root| root.map_or(unknown, |root| self.loops[root as usize].side));
        match (a, b) {
            (Side::Beyond, _) | (_, Side::Beyond) => None,
            (Side::Cell(cell), Side::Cell(other)) => (cell == other).then_some(a),
            (Side::Cell(cell), Side::Around { host }) => (host == NONE || host == cell).then_some(a),
            (Side::Around { host }, Side::Cell(cell)) => (host == NONE || host == cell).then_some(b),
            (Side::Around { host }, Side::Around { host: other }) => {
                (host == NONE || other == NONE || host == other).then_some(if host == NONE { b } else { a })
            }
        }
    }

    /// Makes one loop of two parts' loops.
    fn merge(&mut self, a: u32, b: u32, side: Side) -> u32 {
        let hole_of = |root: u32| match self.loops[root as usize].side {
            Side::Around { host } if host != NONE => Some(host),
            _ => None,
        };
        let (hole_a, hole_b) = (hole_of(a), hole_of(b));
        // A hole that has come to hang on the outline is none any more, and of two holes one remains.
        if matches!(side, Side::Cell(_)) {
            for (host, root) in [(hole_a, a), (hole_b, b)] {
                host.into_iter().for_each(|host| self.remove_holes(host, &[root]));
            }
        } else if let (Some(_), Some(host)) = (hole_a, hole_b) {
            self.remove_holes(host, &[b]);
        }
        let sums = self.loops[b as usize].sums;
        self.loops[b as usize].root = a;
        let root = &mut self.loops[a as usize];
        root.sums.add(sums);
        root.side = side;
        a
    }

    /// Strikes loops off a cell's list of holes.
    fn remove_holes(&mut self, host: u32, roots: &[u32]) {
        let mut holes = std::mem::take(&mut self.cells[host as usize].holes);
        holes.retain(|&hole| !roots.contains(&self.loop_root(hole)));
        self.cells[host as usize].holes = holes;
    }

    /// The edge `out` has just cut the loop `whole` in two: a cell has closed.
    fn close(&mut self, whole: u32, out: u32, Cause { birth, impact }: Cause) {
        let (mut one, mut other) = (self.next[out as usize], self.next[out as usize ^ 1]);
        while one != out && other != out ^ 1 {
            (one, other) = (self.next[one as usize], self.next[other as usize]);
        }
        let (short, long) = if one == out { (out, out ^ 1) } else { (out ^ 1, out) };

        let cut = self.loops.len() as u32;
        let mut half_edge = short;
        while self.loop_of[half_edge as usize] != cut {
            self.loop_of[half_edge as usize] = cut;
            half_edge = self.next[half_edge as usize];
        }
        let (side, sums) = (self.loops[whole as usize].side, self.sums_from(short));
        self.loops.push(Loop { root: cut, side, sums });
        self.loops[whole as usize].sums.subtract(sums);
        let rest = self.loops[whole as usize].sums;

        // The smaller part of a cell is new; of a hole's loop, the part that runs the right way round.
        let short_is_new = match side {
            Side::Cell(_) => sums.area < rest.area || (sums.area == rest.area && short == out),
            _ => sums.area > rest.area,
        };
        let ((new, new_loop), (old, old_loop)) =
            if short_is_new { ((short, cut), (long, whole)) } else { ((long, whole), (short, cut)) };
        let id = self.cells.len() as u32;
        self.cells.push(Cell { area: 0.0, centroid: Vec2::ZERO, birth, impact, start: new, holes: Vec::new() });
        self.loops[new_loop as usize].side = Side::Cell(id);
        let host = match side {
            Side::Cell(cell) => {
                self.cells[cell as usize].start = old;
                cell
            }
            Side::Around { host } if host != NONE => {
                self.remove_holes(host, &[whole, cut]);
                host
            }
            _ => self.cell_around(self.at(self.origin[new as usize]), Some(id)),
        };
        self.hand_over_holes(host, id);
        if let Some(mut closings) = self.closings.take() {
            let sums = self.loops[new_loop as usize].sums;
            let corners = self.corners(new);
            let outline = corners.into_iter().map(|vertex| self.vertices[vertex as usize].pos);
            closings.push(Cause { birth, impact }, host, self.area_and_centre(sums, new), outline);
            self.closings = Some(closings);
        }
        if !matches!(side, Side::Cell(_)) {
            self.loops[old_loop as usize].side = Side::Around { host };
            self.cells[host as usize].holes.push(old);
        }
        self.touched.extend([host, id]);
    }

    /// Gives those holes of a cell to another that lie in its loop.
    fn hand_over_holes(&mut self, from: u32, to: u32) {
        let start = self.cells[to as usize].start;
        let (inside, outside): (Vec<u32>, Vec<u32>) = std::mem::take(&mut self.cells[from as usize].holes)
            .into_iter()
            .partition(|&hole| self.is_inside(start, self.at(self.origin[hole as usize])));
        for &hole in &inside {
            let root = self.find_loop(hole);
            self.loops[root as usize].side = Side::Around { host: to };
        }
        self.cells[from as usize].holes = outside;
        self.cells[to as usize].holes = inside;
    }

    /// Whether a place lies within a loop.
    fn is_inside(&self, start: u32, at: [i32; 2]) -> bool {
        self.walk(start).filter(|&h| self.passes_right_of(h, at).is_some()).count() % 2 == 1
    }

    /// Where the ray from just below a place to the right meets an edge.
    fn passes_right_of(&self, half_edge: u32, at: [i32; 2]) -> Option<f64> {
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
    fn cell_around(&self, at: [i32; 2], except: Option<u32>) -> u32 {
        let mut found = (f64::INFINITY, 0);
        for h in (0..self.origin.len() as u32).step_by(2) {
            let Some(x) = self.passes_right_of(h, at).filter(|&x| x < found.0) else { continue };
            let goes_down = self.at(self.origin[h as usize])[1] < self.at(self.head(h))[1];
            // What encloses nothing has the same on both sides.
            match self.loops[self.loop_root(if goes_down { h } else { h ^ 1 }) as usize].side {
                Side::Cell(cell) | Side::Around { host: cell } if cell != NONE && Some(cell) != except => {
                    found = (x, cell);
                }
                _ => {}
            }
        }
        found.1
    }

    /// Area and centre from the loops.
    fn measure(&mut self, cell: u32) {
        let Cell { start, ref holes, .. } = self.cells[cell as usize];
        let mut sums = self.loops[self.loop_root(start) as usize].sums;
        for &hole in holes {
            sums.add(self.loops[self.loop_root(hole) as usize].sums);
        }
        let (area, centroid) = self.area_and_centre(sums, start);
        let cell = &mut self.cells[cell as usize];
        (cell.area, cell.centroid) = (area, centroid);
    }

    /// Area and centre of what has these sums; that of nothing is where the half-edge `start` begins.
    fn area_and_centre(&self, sums: Sums, start: u32) -> (f32, Vec2) {
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

/// An edge that would leave a vertex in the direction of another.
#[derive(Clone, Copy, Debug)]
struct Overlap;

fn direction(from: [i32; 2], to: [i32; 2]) -> [i64; 2] {
    [0, 1].map(|i| i64::from(to[i]) - i64::from(from[i]))
}

fn cross(a: [i64; 2], b: [i64; 2]) -> i64 {
    a[0] * b[1] - a[1] * b[0]
}

#[cfg(test)]
mod tests;
