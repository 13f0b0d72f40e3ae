//! Widths by hierarchy: a pipe model whose widths never decrease.

use super::params::GrowthParams;
use crate::{
    math::ops,
    pattern::{NO_PARENT, Node},
};

/// Ratio of successive width levels (notches): smaller changes are not drawn.
pub(super) const NOTCH: f32 = 1.1;

/// The largest number of nodes behind a node that affects its width.
const MOST: u32 = 1 << 24;

/// In a network of at most this many nodes, every new node is counted up to the start at once.
const SMALL: usize = 192;

/// In a large network that grows at many ends, a new node is counted for this many ancestors at once; for the others
/// together with many more new nodes.
const AT_ONCE: u32 = 8;

/// New nodes wait until there is one for this many existing nodes.
const WAITING: usize = 12;

/// Widths of nodes by the number of nodes behind them (`lw = line_growth * n_c'` of Couto et al., with the exponent
/// of Murray's pipe model: `n` nodes are as wide as `n^(1/murray)` tips).
///
/// Widths have levels (notches), each a tenth wider than the one before, so that a segment is repainted about a dozen
/// times in total. Counts are exact: each new node is counted for all its ancestors. If there are few new nodes for
/// the size of the network, their counts are passed up together, one ancestor at a time, because the address of each
/// ancestor is known only after reading the one before, and the memory accesses of several chains overlap. Else the
/// counts are collected and added in one pass from the youngest node to the oldest, when a twelfth as many as there
/// are nodes have gathered, or growth has ended; the ancestors just behind the tips are updated at once.
///
/// Every hit is counted for itself: cracks that begin at one of an older hit do not make that wider.
#[derive(Clone, Debug)]
pub(super) struct Widths {
    /// Number of nodes behind from which each notch applies, with its width; then an entry that is never reached.
    notches: Vec<(u32, f32)>,
    /// How much widths vary along a crack, as a share.
    unevenness: f32,
    /// Largest width of a node.
    widest: f32,
    /// Number of nodes that are counted beyond an end that is no longer free.
    beyond: u32,
    pipes: Vec<Pipe>,
    /// Per node.
    forms: Vec<Form>,
    /// Nodes, and the number of nodes behind each that is not counted yet; empty in between.
    pending: Vec<(u32, u32)>,
    /// Buffer for the next round.
    passed: Vec<(u32, u32)>,
    /// Number of new nodes that wait.
    waiting: usize,
}

/// The number of nodes behind a node, itself included. As small as possible: on the way up a branch each is read
/// before the next one is known.
#[derive(Clone, Copy, Debug)]
struct Pipe {
    behind: u32,
    /// Number of further nodes behind it that are not counted yet.
    waiting: u32,
    /// The count at which it reaches the next notch.
    due: u32,
    /// The node for which it counts too.
    parent: u32,
}

/// The other factors of the width of a node.
#[derive(Clone, Copy, Debug)]
struct Form {
    /// Factor for the width of its notch, 0..=1.
    factor: f32,
    /// Factor for the energy of its impact.
    wider: f32,
    /// Factor for the crack that it belongs to: smaller beyond an older crack, 0..=1.
    share: f32,
    /// Its own count: one, plus the length of a taper if the crack continues beyond it.
    counts: u32,
}

/// The width of an even crack with `count` nodes behind, pattern units.
pub(super) fn even_width(params: &GrowthParams, count: u32) -> f32 {
    let pipes = ops::powf(count as f32, 1.0 / params.murray) - 1.0;
    let width = (params.line_width * (1.0 + params.line_growth * pipes)).min(params.max_width);
    // A tapered end: the tip itself has next to no width.
    let taper = if params.tip_taper > 0.0 { ((count as f32 - 0.95) / params.tip_taper).min(1.0) } else { 1.0 };
    width * taper
}

/// Number of nodes that a junction counts for: the length of the taper.
pub(super) fn beyond(params: &GrowthParams) -> u32 {
    params.tip_taper.ceil() as u32
}

/// The same for an end that narrows.
pub(super) const fn thinly(beyond: u32) -> u32 {
    beyond * 2 / 5
}

impl Widths {
    pub(super) fn new(params: &GrowthParams) -> Self {
        let width = |count: u32| even_width(params, count);
        let widest = width(MOST);
        let mut notches = vec![(1, width(1))];
        while let Some(&(count, thin)) = notches.last()
            && thin < widest
        {
            // The first count that is one notch wider.
            let goal = (thin * NOTCH).min(widest);
            let (mut low, mut high) = (count, MOST);
            while high - low > 1 {
                let middle = low + (high - low) / 2;
                if width(middle) >= goal { high = middle } else { low = middle }
            }
            if high == MOST && width(MOST) < goal {
                break;
            }
            notches.push((high, width(high)));
        }
        notches.push((u32::MAX, 0.0));
        Self {
            notches,
            unevenness: params.unevenness,
            widest: f32::INFINITY,
            beyond: beyond(params),
            pipes: Vec::new(),
            forms: Vec::new(),
            pending: Vec::new(),
            passed: Vec::new(),
            waiting: 0,
        }
    }

    /// Sets the notches for later nodes; existing nodes never become thinner.
    pub(super) fn set_params(&mut self, params: &GrowthParams) {
        let Self { notches, unevenness, beyond, .. } = Self::new(params);
        (self.notches, self.unevenness, self.beyond) = (notches, unevenness, beyond);
        // Nodes at full width have stopped counting.
        for (pipe, form) in self.pipes.iter_mut().zip(&mut self.forms) {
            form.counts = if form.counts > 1 { 1 + beyond } else { form.counts };
            (pipe.behind, pipe.waiting) = (form.counts, 0);
        }
        for node in (0..self.pipes.len()).rev() {
            let Pipe { behind, parent, .. } = self.pipes[node];
            self.pipes[node].due = self.notches[self.notch(behind) + 1].0;
            if let Some(parent) = self.pipes.get_mut(parent as usize) {
                parent.behind += behind;
            }
        }
        self.waiting = 0;
    }

    /// Sets the largest width of nodes, pattern units.
    pub(super) const fn set_widest(&mut self, widest: f32) {
        self.widest = widest;
    }

    /// `width`, limited to the largest width.
    pub(super) fn at_most(&self, width: f32) -> f32 {
        width.min(self.widest)
    }

    pub(super) fn reserve(&mut self, nodes: usize) {
        self.pipes.reserve(nodes);
        self.forms.reserve(nodes);
    }

    /// The notch for a count.
    fn notch(&self, behind: u32) -> usize {
        self.notches.partition_point(|notch| notch.0 <= behind).saturating_sub(1)
    }

    /// Adds the entry of a node that grows from `parent`, with one random draw; returns its width. It counts for its
    /// parent too, if that `is_own`.
    pub(super) fn tip(&mut self, (parent, is_own): (u32, bool), draw: impl FnOnce() -> f32, wider: f32) -> f32 {
        let mut factor = 1.0;
        if self.unevenness > 0.0 {
            // Each node is similar to the one before.
            let middle = 1.0 - 0.5 * self.unevenness;
            let before = self.forms.get(parent as usize).map_or(middle, |form| form.factor);
            factor = middle + 0.75 * (before - middle) + self.unevenness * (draw() - 0.5);
            factor = factor.clamp(1.0 - self.unevenness, 1.0);
        }
        let share = self.forms.get(parent as usize).filter(|_| is_own).map_or(1.0, |form| form.share);
        self.place(if is_own { parent } else { NO_PARENT }, Form { factor, wider, share, counts: 1 });
        self.at_most(self.notches[0].1 * factor * wider * share)
    }

    /// Adds the entry of a node that has its own width and is not counted.
    pub(super) fn admit(&mut self, parent: u32) {
        self.place(parent, Form { factor: 1.0, wider: 1.0, share: 1.0, counts: 0 });
    }

    fn place(&mut self, parent: u32, form: Form) {
        self.pipes.push(Pipe { behind: form.counts, waiting: 0, due: self.notches[1].0, parent });
        self.forms.push(form);
    }

    /// Removes all nodes except the last `left`.
    pub(super) fn forget(&mut self, left: usize) {
        let first = self.pipes.len().saturating_sub(left);
        self.pipes.drain(..first);
        self.forms.drain(..first);
        for pipe in self.pipes.iter_mut().filter(|pipe| pipe.parent != NO_PARENT) {
            pipe.parent = pipe.parent.checked_sub(first as u32).unwrap_or(NO_PARENT);
        }
    }

    /// Makes a node permanently wider.
    pub(super) fn scale(&mut self, node: u32, by: f32) {
        self.forms[node as usize].wider *= by;
    }

    /// Counts the nodes from `first` on and widens their ancestors; calls `widened` with each node that became wider.
    pub(super) fn push(&mut self, nodes: &mut [Node], first: u32, widened: impl FnMut(u32)) {
        let born = self.pipes[first as usize..].iter().filter(|pipe| pipe.parent != NO_PARENT);
        self.pending.extend(born.map(|pipe| (pipe.parent, 1)));
        self.spread(nodes, widened);
    }

    /// Makes all that grows from `node` thinner, by a factor, than the crack of `end`: it goes on beyond an older one.
    pub(super) fn thin_beyond(&mut self, end: u32, node: u32, by: f32) {
        self.forms[node as usize].share = by * self.forms[end as usize].share;
    }

    /// Handles an end that is no longer free: it gets the width of a crack that continues.
    pub(super) fn join(&mut self, nodes: &mut [Node], tip: u32, widened: impl FnMut(u32)) {
        self.count_beyond(nodes, tip, self.beyond, widened);
    }

    /// Handles an end that meets another crack at the rim of the area that its hit has loaded: it narrows, but not to
    /// zero.
    pub(super) fn join_thinly(&mut self, nodes: &mut [Node], tip: u32, widened: impl FnMut(u32)) {
        self.count_beyond(nodes, tip, thinly(self.beyond), widened);
    }

    /// Counts `beyond` nodes beyond an end.
    fn count_beyond(&mut self, nodes: &mut [Node], tip: u32, beyond: u32, widened: impl FnMut(u32)) {
        let form = &mut self.forms[tip as usize];
        let more = (1 + beyond).saturating_sub(form.counts);
        if more > 0 {
            form.counts += more;
            self.pending.push((tip, more));
            self.spread(nodes, widened);
        }
    }

    /// Adds the pending counts to nodes, then to their parents, and so on.
    fn spread(&mut self, nodes: &mut [Node], mut widened: impl FnMut(u32)) {
        let is_small = self.pipes.len() <= SMALL;
        let are_few = self.pending.len() * AT_ONCE as usize * WAITING < self.pipes.len();
        let mut rounds = if is_small || are_few { u32::MAX } else { AT_ONCE };
        while rounds > 0 && !self.pending.is_empty() {
            rounds -= 1;
            self.passed.resize(self.pending.len(), (0, 0));
            let mut passed = 0;
            for i in 0..self.pending.len() {
                let (node, more) = self.pending[i];
                let pipe = &mut self.pipes[node as usize];
                pipe.behind += more;
                let is_due = pipe.behind >= pipe.due;
                // The ancestors of a node at full width are at full width too.
                let passes = pipe.parent != NO_PARENT && pipe.due != u32::MAX;
                self.passed[passed] = (pipe.parent, more);
                passed += usize::from(passes);
                if is_due {
                    self.widen(nodes, node, &mut widened);
                }
            }
            self.passed.truncate(passed);
            std::mem::swap(&mut self.pending, &mut self.passed);
        }
        for (node, more) in self.pending.drain(..) {
            self.pipes[node as usize].waiting += more;
            self.waiting += more as usize;
        }
        if self.waiting * WAITING > self.pipes.len() {
            self.settle(nodes, widened);
        }
    }

    /// Adds all waiting counts.
    pub(super) fn settle(&mut self, nodes: &mut [Node], mut widened: impl FnMut(u32)) {
        if std::mem::take(&mut self.waiting) == 0 {
            return;
        }
        // A parent is older than its children.
        for node in (0..self.pipes.len()).rev() {
            let pipe = &mut self.pipes[node];
            let more = std::mem::take(&mut pipe.waiting);
            if more == 0 {
                continue;
            }
            pipe.behind += more;
            let (is_due, passes, parent) = (pipe.behind >= pipe.due, pipe.due != u32::MAX, pipe.parent);
            if let Some(parent) = self.pipes.get_mut(parent as usize).filter(|_| passes) {
                parent.waiting += more;
            }
            if is_due {
                self.widen(nodes, node as u32, &mut widened);
            }
        }
    }

    /// Sets the width of a node to that of its notch.
    fn widen(&mut self, nodes: &mut [Node], node: u32, widened: &mut impl FnMut(u32)) {
        let notch = self.notch(self.pipes[node as usize].behind);
        self.pipes[node as usize].due = self.notches[notch + 1].0;
        let form = self.forms[node as usize];
        let width = self.at_most(self.notches[notch].1 * form.factor * form.wider * form.share);
        let this = &mut nodes[node as usize];
        if width > this.width {
            this.width = width;
            widened(node);
        }
    }
}

#[cfg(test)]
impl Widths {
    /// The own count of a node, and its width as a share of the even width.
    pub(super) fn form(&self, node: u32) -> (u32, f32) {
        let Form { factor, wider, share, counts } = self.forms[node as usize];
        (counts, factor * wider * share)
    }

    /// Its factor for the crack that it belongs to.
    pub(super) fn share(&self, node: u32) -> f32 {
        self.forms[node as usize].share
    }
}
