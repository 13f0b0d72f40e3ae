//! [`Changes`]: which segments are to be drawn anew.

use crate::pattern::{NO_PARENT, Node, SegmentId};

/// Segments that are new or wider, each once.
#[derive(Clone, Debug, Default)]
pub(super) struct Changes {
    pub(super) list: Vec<SegmentId>,
    /// Per node: whether its branch is on the list.
    pub(super) listed: Vec<bool>,
    /// First child and next sibling of each node: a branch tapers between two widths, so it changes with either.
    pub(super) child: Vec<u32>,
    pub(super) sibling: Vec<u32>,
}

impl Changes {
    pub(super) fn reserve(&mut self, nodes: usize) {
        self.list.reserve(nodes);
        self.listed.reserve(nodes);
        self.child.reserve(nodes);
        self.sibling.reserve(nodes);
    }

    /// Forgets nodes and links; `nodes` are those that are left, `number` says what a segment is called now.
    pub(super) fn forget(&mut self, nodes: &[Node], number: impl Fn(SegmentId) -> Option<SegmentId>) {
        let before = std::mem::take(self);
        for node in nodes {
            self.push_node(node.parent);
        }
        self.list.clear();
        self.listed.fill(false);
        for segment in before.list.into_iter().filter_map(number) {
            match segment {
                SegmentId::Branch(node) if nodes[node as usize].parent != NO_PARENT => self.list_branch(node),
                SegmentId::Branch(_) => {}
                SegmentId::Link(_) => self.list.push(segment),
            }
        }
    }

    pub(super) fn push_node(&mut self, parent: u32) {
        let node = self.listed.len() as u32;
        self.listed.push(false);
        self.child.push(NO_PARENT);
        let sibling = match self.child.get_mut(parent as usize) {
            Some(child) => std::mem::replace(child, node),
            None => NO_PARENT,
        };
        self.sibling.push(sibling);
        if parent != NO_PARENT {
            self.list_branch(node);
        }
    }

    pub(super) fn list_branch(&mut self, node: u32) {
        if !std::mem::replace(&mut self.listed[node as usize], true) {
            self.list.push(SegmentId::Branch(node));
        }
    }

    pub(super) fn widened(&mut self, node: u32, has_parent: bool) {
        if has_parent {
            self.list_branch(node);
        }
        let mut child = self.child[node as usize];
        while child != NO_PARENT {
            self.list_branch(child);
            child = self.sibling[child as usize];
        }
    }
}
