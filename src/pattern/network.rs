//! [`Network`]: the graph of a crack pattern.

use super::path::{SegmentPath, rough_path};
use glam::Vec2;

/// The [`Node::parent`] of a node at which a crack starts.
pub const NO_PARENT: u32 = u32::MAX;

/// The [`Node::impact`] of a node that does not belong to an impact.
pub const NO_IMPACT: u32 = u32::MAX;

/// A point of a crack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Position, pattern units.
    pub pos: Vec2,
    /// Width of the crack here, pattern units. It never decreases.
    pub width: f32,
    /// Index of the node from which it grew, always below its own, or [`NO_PARENT`].
    pub parent: u32,
    /// Number of segments between it and its start.
    pub generation: u32,
    /// Step in which it was added.
    pub birth: u32,
    /// Index of the impact it belongs to, or [`NO_IMPACT`].
    pub impact: u32,
    /// Share of the network's roughness of the line from its parent, 0 (straight) to 1.
    pub bend: f32,
}

/// What a [`Link`] represents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkKind {
    /// Between nodes whose parents have the same generation: `draw_connections` of Couto et al., the rings of glass.
    Connection,
    /// Between close nodes of different branches: `draw_islands` of Couto et al., the cells of clay.
    Island,
    /// Where cracks join at a marker: closed venation of Runions et al. 2005.
    Meeting,
    /// From the end of a crack to the older crack that stops it.
    Junction,
}

/// A segment between two nodes of which neither is the parent of the other.
///
/// ```
/// use bevy_crack::{CrackPreset, growth::CrackGrowth, pattern::{Link, LinkKind, SegmentId}};
///
/// let mut growth = CrackGrowth::new(CrackPreset::GLASS.growth, [1.0, 1.0].into(), 7)?;
/// growth.hit([0.5, 0.5].into(), 1.0);
/// while growth.step().grew() {}
/// // The rings of glass join its rays.
/// let network = growth.network();
/// let is_ring = |link: &Link| link.kind == LinkKind::Connection;
/// assert!(network.links().iter().any(is_ring));
/// let Link { a, b, .. } = network.links()[0];
/// assert_eq!(network.ends(SegmentId::Link(0)), Some((a, b)));
/// # Ok::<(), bevy_crack::growth::ParamError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Index of one end.
    pub a: u32,
    /// Index of the other end.
    pub b: u32,
    /// Width, pattern units. It never decreases.
    pub width: f32,
    /// Step in which it was added.
    pub birth: u32,
    /// What it represents.
    pub kind: LinkKind,
    /// Share of the network's roughness of its line, 0 (straight) to 1.
    pub bend: f32,
}

/// Identifies one segment of a [`Network`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SegmentId {
    /// From the parent of this node to this node.
    Branch(u32),
    /// The link with this index.
    Link(u32),
}

/// Nodes and segments of a crack pattern, in the order in which they were added.
///
/// Invariants: a parent's index is below its child's; every position lies in `0..=extent`; widths are finite and
/// above zero.
///
/// ```
/// use bevy_crack::{growth::{CrackGrowth, GrowthParams}, pattern::{NO_PARENT, Network, Node, SegmentId}};
///
/// let mut growth = CrackGrowth::new(GrowthParams::DEFAULT, [1.0, 1.0].into(), 7)?;
/// growth.hit([0.5, 0.5].into(), 1.0);
/// while growth.step().grew() {}
/// let network: &Network = growth.network();
/// for segment in network.segments() {
///     let points = network.path(segment).expect("the segment exists").points().len();
///     assert!(points >= 2);
/// }
/// // Cracks start at the hit.
/// let is_start = |node: &&Node| node.parent == NO_PARENT;
/// assert!(network.nodes().iter().filter(is_start).all(|node| node.pos.distance([0.5, 0.5].into()) < 0.1));
/// let node = network.nodes()[9];
/// assert_eq!(network.ends(SegmentId::Branch(9)), Some((node.parent, 9)));
/// // A new network is empty.
/// assert_eq!(Network::new([2.0, 1.0].into(), 0.1, 7).segments().count(), 0);
/// # Ok::<(), bevy_crack::growth::ParamError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    extent: Vec2,
    roughness: f32,
    sway: f32,
    seed: u64,
    pub(crate) nodes: Vec<Node>,
    pub(crate) links: Vec<Link>,
    /// Number of nodes and links that were removed: the random line of a segment depends on its original number.
    forgotten: (u64, u64),
    /// Original numbers of the links that remained when others were removed.
    numbers: Vec<u64>,
}

impl Network {
    /// A network without nodes on a surface of `extent` pattern units.
    ///
    /// `roughness` is how far a segment's path deviates from the straight line, as a share of its length (0 =
    /// straight);
    /// `seed` fixes the paths.
    #[must_use]
    pub const fn new(extent: Vec2, roughness: f32, seed: u64) -> Self {
        Self {
            extent,
            roughness,
            sway: 0.0,
            seed,
            nodes: Vec::new(),
            links: Vec::new(),
            forgotten: (0, 0),
            numbers: Vec::new(),
        }
    }

    /// The same network with lines that are displaced by up to `sway` pattern units.
    pub(crate) fn with_distortion(mut self, sway: f32) -> Self {
        self.sway = sway;
        self
    }

    /// Size of the surface, pattern units.
    #[must_use]
    pub const fn extent(&self) -> Vec2 {
        self.extent
    }

    /// All nodes, in the order in which they were added.
    #[must_use]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// All links, in the order in which they were added.
    #[must_use]
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// All segments: first branches, then links, each in the order in which they were added.
    pub fn segments(&self) -> impl Iterator<Item = SegmentId> + '_ {
        let branches = (0u32..).zip(&self.nodes).filter(|(_, node)| node.parent != NO_PARENT);
        let links = (0u32..).zip(&self.links);
        branches.map(|(i, _)| SegmentId::Branch(i)).chain(links.map(|(i, _)| SegmentId::Link(i)))
    }

    /// Indices of the two end nodes of a segment; `None` if there is no such segment.
    #[must_use]
    pub fn ends(&self, segment: SegmentId) -> Option<(u32, u32)> {
        match segment {
            SegmentId::Branch(child) => {
                let parent = self.nodes.get(child as usize)?.parent;
                (parent != NO_PARENT).then_some((parent, child))
            }
            SegmentId::Link(link) => self.links.get(link as usize).map(|link| (link.a, link.b)),
        }
    }

    /// The rough line of a segment, with its width at each point; `None` if there is no such segment.
    ///
    /// The points of a segment never move after it was added; only its widths grow.
    #[must_use]
    pub fn path(&self, segment: SegmentId) -> Option<SegmentPath> {
        let (a, b) = self.ends(segment)?;
        let widths = match segment {
            SegmentId::Branch(_) => (self.nodes[a as usize].width, self.nodes[b as usize].width),
            SegmentId::Link(i) => (self.links[i as usize].width, self.links[i as usize].width),
        };
        self.path_with(segment, widths)
    }

    /// The line of a segment with other widths at its ends: as it was when it was thinner.
    pub(super) fn path_with(&self, segment: SegmentId, widths: (f32, f32)) -> Option<SegmentPath> {
        let (a, b) = self.ends(segment)?;
        let ends = (self.nodes[a as usize].pos, self.nodes[b as usize].pos);
        let bend = match segment {
            SegmentId::Branch(child) => self.nodes[child as usize].bend,
            SegmentId::Link(link) => self.links[link as usize].bend,
        };
        Some(self.draft(segment, ends, widths, bend))
    }

    /// The rough line that `segment` would have between two places.
    pub(crate) fn draft(&self, segment: SegmentId, ends: (Vec2, Vec2), widths: (f32, f32), bend: f32) -> SegmentPath {
        let salt = match segment {
            SegmentId::Branch(child) => u64::from(child) + self.forgotten.0,
            SegmentId::Link(link) => self.number(link) | 1 << 32,
        };
        let path = rough_path(ends, widths, self.roughness * bend, self.extent, self.seed, salt);
        if self.sway > 0.0 { path.swayed(self.sway, self.extent, self.seed) } else { path }
    }

    /// The original number of a link.
    fn number(&self, link: u32) -> u64 {
        self.numbers.get(link as usize).copied().unwrap_or(u64::from(link) + self.forgotten.1)
    }

    /// Removes the first nodes, with all segments that have an end among them. Returns the former numbers of the
    /// remaining links.
    pub(crate) fn forget(&mut self, first: u32) -> Vec<u32> {
        let left: Vec<u32> = (0u32..)
            .zip(&self.links)
            .filter(|(_, link)| link.a.min(link.b) >= first)
            .map(|(number, _)| number)
            .collect();
        self.numbers = left.iter().map(|&link| self.number(link)).collect();
        self.forgotten =
            (self.forgotten.0 + u64::from(first), self.forgotten.1 + (self.links.len() - left.len()) as u64);
        self.nodes.drain(..first as usize);
        for node in &mut self.nodes {
            // The rest of a branch whose start was removed stays.
            node.parent = node.parent.checked_sub(first).filter(|_| node.parent != NO_PARENT).unwrap_or(NO_PARENT);
        }
        self.links.retain_mut(|link| {
            let is_left = link.a.min(link.b) >= first;
            if is_left {
                (link.a, link.b) = (link.a - first, link.b - first);
            }
            is_left
        });
        left
    }
}
