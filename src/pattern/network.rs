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
    /// Width of the crack here, pattern units. Only ever grows.
    pub width: f32,
    /// Index of the node it grew from, always below its own, or [`NO_PARENT`].
    pub parent: u32,
    /// Number of segments between it and its start.
    pub generation: u32,
    /// Step at which it was born.
    pub birth: u32,
    /// Index of the impact it belongs to, or [`NO_IMPACT`].
    pub impact: u32,
    /// How much of the network's roughness the line from its parent has, 0 (straight) to 1.
    pub bend: f32,
}

/// What a [`Link`] stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkKind {
    /// Between nodes born of the same parent generation: `draw_connections` of Couto et al., the rings of glass.
    Connection,
    /// Between close nodes of different branches: `draw_islands` of Couto et al., the cells of clay.
    Island,
    /// Where cracks come together in a marker: closed venation of Runions et al. 2005.
    Meeting,
    /// From the end of a crack to the older crack that stops it.
    Junction,
}

/// A segment between two nodes neither of which is the other's parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Index of one end.
    pub a: u32,
    /// Index of the other end.
    pub b: u32,
    /// Width, pattern units. Only ever grows.
    pub width: f32,
    /// Step at which it was born.
    pub birth: u32,
    /// Why it is there.
    pub kind: LinkKind,
    /// How much of the network's roughness its line has, 0 (straight) to 1.
    pub bend: f32,
}

/// Names one segment of a [`Network`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SegmentId {
    /// From the parent of this node to this node.
    Branch(u32),
    /// The link with this index.
    Link(u32),
}

/// Nodes and segments of a crack pattern, in order of birth.
///
/// Invariants: a parent's index is below its child's; every position lies in `0..=extent`; widths are finite and above
/// zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    extent: Vec2,
    roughness: f32,
    sway: f32,
    seed: u64,
    pub(crate) nodes: Vec<Node>,
    pub(crate) links: Vec<Link>,
    /// Nodes and links that came before those that are left: lines go by the numbers that segments had at first.
    forgotten: (u64, u64),
    /// First numbers of the links that were there when others were forgotten.
    numbers: Vec<u64>,
}

impl Network {
    /// A network without nodes on a surface of `extent` pattern units.
    ///
    /// `roughness` is how far a segment's path strays from the straight line, as a share of its length (0 = straight);
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

    /// The same with lines that sway off their way by up to so much, pattern units.
    pub(crate) fn with_sway(mut self, sway: f32) -> Self {
        self.sway = sway;
        self
    }

    /// Size of the surface, pattern units.
    #[must_use]
    pub const fn extent(&self) -> Vec2 {
        self.extent
    }

    /// All nodes, in order of birth.
    #[must_use]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// All links, in order of birth.
    #[must_use]
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// All segments: branches in order of birth, then links.
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

    /// The rough line that stands for a segment, with its width at each point; `None` if there is no such segment.
    ///
    /// Frozen at birth: the points of a segment never move, only its widths grow.
    #[must_use]
    pub fn path(&self, segment: SegmentId) -> Option<SegmentPath> {
        let (a, b) = self.ends(segment)?;
        let widths = match segment {
            SegmentId::Branch(_) => (self.nodes[a as usize].width, self.nodes[b as usize].width),
            SegmentId::Link(i) => (self.links[i as usize].width, self.links[i as usize].width),
        };
        self.path_with(segment, widths)
    }

    /// The line of a segment with other widths at its ends: what it was when it was thinner.
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

    /// The number that a link had at first.
    fn number(&self, link: u32) -> u64 {
        self.numbers.get(link as usize).copied().unwrap_or(u64::from(link) + self.forgotten.1)
    }

    /// Takes the first nodes out, with all segments that have an end among them. Returns the numbers that the links that are left had.
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
            // Of a branch whose start is gone the rest stays.
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
