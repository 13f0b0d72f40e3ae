//! [`Changes`]: which segments are to be drawn anew.

use crate::pattern::{NO_PARENT, Node, SegmentId};

/// Segments that are new or wider, each once.
#[derive(Clone, Debug, Default)]
pub(super) struct Changes {
    pub(super) list: Vec<SegmentId>,
    /// Of each node: a branch tapers between two widths, so it changes with either.
    pub(super) kin: Vec<Kin>,
}

/// Where a node is in its family. [`NO_PARENT`] is nobody.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kin {
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
        self.kin.reserve(nodes);
    }

    /// Forgets nodes and links; `nodes` are those that are left, `number` says what a segment is called now.
    pub(super) fn forget(&mut self, nodes: &[Node], number: impl Fn(SegmentId) -> Option<SegmentId>) {
        let before = std::mem::take(self);
        for node in nodes {
            self.push_node(node.parent);
        }
        self.list.clear();
        self.kin.iter_mut().for_each(|kin| kin.is_listed = false);
        for segment in before.list.into_iter().filter_map(number) {
            match segment {
                SegmentId::Branch(node) if nodes[node as usize].parent != NO_PARENT => self.list_branch(node),
                SegmentId::Branch(_) => {}
                SegmentId::Link(_) => self.list.push(segment),
            }
        }
    }

    pub(super) fn push_node(&mut self, parent: u32) {
        let node = self.kin.len() as u32;
        let sibling = match self.kin.get_mut(parent as usize) {
            Some(parent) => std::mem::replace(&mut parent.child, node),
            None => NO_PARENT,
        };
        self.kin.push(Kin { child: NO_PARENT, sibling, is_listed: false });
        if parent != NO_PARENT {
            self.list_branch(node);
        }
    }

    pub(super) fn list_branch(&mut self, node: u32) {
        if !std::mem::replace(&mut self.kin[node as usize].is_listed, true) {
            self.list.push(SegmentId::Branch(node));
        }
    }

    pub(super) fn widened(&mut self, node: u32, has_parent: bool) {
        if has_parent {
            self.list_branch(node);
        }
        let mut child = self.kin[node as usize].child;
        while child != NO_PARENT {
            self.list_branch(child);
            child = self.kin[child as usize].sibling;
        }
    }
}
