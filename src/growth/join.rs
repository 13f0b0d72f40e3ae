//! Links new nodes to each other, where two cracks meet, and to other cracks.

use super::{arrest::AHEAD, links, state::CrackGrowth};
use crate::pattern::{Link, LinkKind, SegmentId};

impl CrackGrowth {
    pub(super) fn join_newborn(&mut self) {
        let new_nodes = self.new_nodes.clone();
        let met = self.field.relations.as_mut().map(|relations| std::mem::take(&mut relations.met));
        for (a, b) in met.into_iter().flatten() {
            let nodes = &self.network.nodes;
            if a != b && nodes[a as usize].parent != b && nodes[b as usize].parent != a && !self.stays_open(b) {
                let width = nodes[a as usize].width.min(nodes[b as usize].width);
                if self.link(Link { a, b, width, birth: self.steps, kind: LinkKind::Meeting, bend: 1.0 }) {
                    self.widen_end(b);
                }
            }
        }
        if self.params.draw_connections && !self.has_rays() {
            self.linker.rings(&self.params, &self.network, &self.impacts, new_nodes.clone(), self.seed);
            for link in self.linker.take_links() {
                self.link(link);
            }
        }
        if self.params.draw_islands {
            for tip in self.linker.tips_at_rest(&self.network, new_nodes) {
                if self.stays_open(tip) {
                    continue;
                }
                if self.arrest.is_some() {
                    let node = self.network.nodes[tip as usize];
                    if let Some(parent) = self.network.nodes.get(node.parent as usize) {
                        let heading = (node.pos - parent.pos).normalize_or_zero();
                        self.run_on(tip, heading, self.params.island_distance, AHEAD);
                    }
                } else if let Some(link) = links::island(&self.params, &self.network, &self.nodes, tip)
                    && self.link(link)
                {
                    self.widen_end(tip);
                }
            }
        }
        self.report_links();
    }

    /// Enters the links that were added since the last call in the timeline and in the list of changes. To be called before a step or a
    /// hit ends: what is not listed is not drawn.
    pub(super) fn report_links(&mut self) {
        let all = self.network.links.len() as u32;
        (self.links_reported..all).for_each(|_| self.timeline.add_link());
        self.changes.list.extend((self.links_reported..all).map(SegmentId::Link));
        self.links_reported = all;
    }
}
