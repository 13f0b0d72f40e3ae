//! Adds cracks from another network, such as those of a picture.

use super::{pull::NO_PULL, state::CrackGrowth};
use crate::pattern::{Link, NO_IMPACT, NO_PARENT, Network, Node, SegmentId};
use glam::Vec2;

impl CrackGrowth {
    /// Adds cracks that have not grown here, such as those of [`Seams::network`](crate::voronoi::Seams::network).
    /// Later hits and steps treat them as cracks of another hit: with [`arrest`](super::GrowthParams::arrest) new
    /// cracks stop at them unless their hit is near, and a hit on one starts from it.
    ///
    /// They are added in the steps after the current one, in the order of their [`birth`](Node::birth), and each
    /// opens to its width within `opening` further steps. Returns how many steps this takes in total. Lines are
    /// straight from node to node. A network of another extent is stretched over the surface. The added nodes do not
    /// count for [`max_nodes`](super::GrowthParams::max_nodes). Where they cross existing cracks, nothing prevents
    /// it.
    ///
    /// ```
    /// use bevy_crack::{growth::{CrackGrowth, GrowthParams}, voronoi::{VoronoiBake, VoronoiParams}};
    ///
    /// let (_, seams) = VoronoiBake::new(VoronoiParams::DEFAULT, Vec::new(), [64, 64].into(), 7)?.finish();
    /// let mut growth = CrackGrowth::new(GrowthParams { arrest: 0.05, ..GrowthParams::DEFAULT }, [1.0, 1.0].into(), 7)?;
    /// let steps = growth.add_cracks(&seams.network([0.5, 0.5].into()), 0);
    /// assert_eq!(growth.timeline().end(), steps);
    /// growth.hit([0.5, 0.5].into(), 1.0);
    /// while growth.step().grew() {}
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn add_cracks(&mut self, cracks: &Network, opening: u32) -> u32 {
        self.finish();
        let Some(last) = cracks.nodes.iter().map(|node| node.birth).chain(cracks.links.iter().map(|l| l.birth)).max()
        else {
            return 0;
        };
        let (extent, from) = (self.network.extent(), cracks.extent());
        // Keeps border points exactly on the border.
        let place = |pos: Vec2| Vec2::select(pos.cmpeq(from), extent, (pos / from * extent).min(extent));
        let (before, first) = (self.steps, self.network.nodes.len() as u32);
        // Number of nodes and links added so far.
        let (mut node, mut link) = (0, 0);
        for step in 0..=last {
            self.steps = before.saturating_add(step).saturating_add(1);
            self.timeline.begin(self.steps);
            while let Some(&added) = cracks.nodes.get(node).filter(|added| added.birth <= step) {
                let parent = if added.parent == NO_PARENT { NO_PARENT } else { added.parent + first };
                let birth = self.steps;
                self.add(Node { pos: place(added.pos), parent, birth, impact: NO_IMPACT, bend: 0.0, ..added });
                self.timeline.add_opening_node(added.width, opening);
                node += 1;
            }
            while let Some(&added) = cracks.links.get(link).filter(|added| added.birth <= step) {
                let (a, b, birth) = (added.a + first, added.b + first, self.steps);
                self.network.links.push(Link { a, b, birth, bend: 0.0, ..added });
                self.timeline.add_opening_link(opening);
                link += 1;
            }
        }
        self.steps = self.steps.saturating_add(opening);
        self.skip_due_since(before);
        let reported = std::mem::replace(&mut self.links_reported, self.network.links.len() as u32);
        self.changes.list.extend((reported..self.links_reported).map(SegmentId::Link));
        self.new_nodes = first..self.network.nodes.len() as u32;
        self.added += self.new_nodes.len();
        for node in self.new_nodes.clone() {
            self.field.visit(node, &self.network.nodes, &self.nodes);
        }
        if let Some(arrest) = &mut self.arrest {
            let branches = self.new_nodes.clone().map(SegmentId::Branch);
            arrest.add_walls(&self.network, branches.chain((reported..self.links_reported).map(SegmentId::Link)));
        }
        self.steps - before
    }

    /// Adds a node that has not grown here.
    fn add(&mut self, node: Node) {
        self.widths.admit(node.parent);
        if let Some(arrest) = &mut self.arrest {
            arrest.push_node(false);
        }
        self.nodes.push(node.pos);
        self.pull_of.push(NO_PULL);
        self.courses.push(Vec2::ZERO);
        self.changes.push_node(node.parent);
        self.network.nodes.push(node);
    }
}
