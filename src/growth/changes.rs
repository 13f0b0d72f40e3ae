//! [`Changes`]: the segments that must be redrawn.

use crate::pattern::{NO_PARENT, Node, SegmentId};

/// Segments that are new or wider, each once.
#[derive(Clone, Debug, Default)]
pub(super) struct Changes {
    pub(super) list: Vec<SegmentId>,
    /// Per node: a branch tapers between two widths, so it changes with either.
    pub(super) tree: Vec<TreeLinks>,
}

/// The links of a node to its child and sibling. [`NO_PARENT`] = none.
#[derive(Clone, Copy, Debug)]
pub(super) struct TreeLinks {
    /// The last child.
    pub(super) child: u32,
    /// The next of its parent's children.
    pub(super) sibling: u32,
    /// Whether the branch from the parent is on the list.
    pub(super) is_listed: bool,
}

impl Changes {
    pub(super) fn reserve(&mut self, nodes: usize) {
        self.list.reserve(nodes);
        self.tree.reserve(nodes);
    }

    /// Removes nodes and links; `nodes` are the remaining ones, `number` gives the new number of a segment.
    pub(super) fn forget(&mut self, nodes: &[Node], number: impl Fn(SegmentId) -> Option<SegmentId>) {
        let before = std::mem::take(self);
        for node in nodes {
            self.push_node(node.parent);
        }
        self.list.clear();
        self.tree.iter_mut().for_each(|node| node.is_listed = false);
        for segment in before.list.into_iter().filter_map(number) {
            match segment {
                SegmentId::Branch(node) if nodes[node as usize].parent != NO_PARENT => self.list_branch(node),
                SegmentId::Branch(_) => {}
                SegmentId::Link(_) => self.list.push(segment),
            }
        }
    }

    /// Moves the oldest segments, `most` of them at the most, to another list.
    pub(super) fn take(&mut self, most: usize, changed: &mut Vec<SegmentId>) {
        let count = most.min(self.list.len());
        for segment in self.list.drain(..count) {
            if let SegmentId::Branch(node) = segment {
                self.tree[node as usize].is_listed = false;
            }
            changed.push(segment);
        }
    }

    pub(super) fn push_node(&mut self, parent: u32) {
        let node = self.tree.len() as u32;
        let sibling = match self.tree.get_mut(parent as usize) {
            Some(parent) => std::mem::replace(&mut parent.child, node),
            None => NO_PARENT,
        };
        self.tree.push(TreeLinks { child: NO_PARENT, sibling, is_listed: false });
        if parent != NO_PARENT {
            self.list_branch(node);
        }
    }

    pub(super) fn list_branch(&mut self, node: u32) {
        if !std::mem::replace(&mut self.tree[node as usize].is_listed, true) {
            self.list.push(SegmentId::Branch(node));
        }
    }

    pub(super) fn widened(&mut self, node: u32, has_parent: bool) {
        if has_parent {
            self.list_branch(node);
        }
        let mut child = self.tree[node as usize].child;
        while child != NO_PARENT {
            self.list_branch(child);
            child = self.tree[child as usize].sibling;
        }
    }
}
