//! Widths by hierarchy: a pipe model that only ever widens.

use super::params::GrowthParams;
use crate::{
    math::ops,
    pattern::{NO_PARENT, Node},
};

/// How much wider a crack becomes with each notch: finer changes are not drawn.
pub(super) const NOTCH: f32 = 1.1;

/// The most nodes behind that make a difference.
const MOST: u32 = 1 << 24;

/// A network of so many nodes is small: every birth is told all the way to the start.
const SMALL: usize = 192;

/// In a large network that grows at many ends, a birth is told to so many nodes at once; to the others with many more.
const AT_ONCE: u32 = 8;

/// So many times fewer births than nodes wait until they are told to all.
const WAITING: usize = 12;

/// Widths of nodes by the number of nodes behind them (`lw = line_growth * n_c'` of Couto et al., with the exponent of
/// Murray's pipe model: `n` nodes are as wide as `n^(1/murray)` tips).
///
/// Widths have notches, each a tenth wider than the one before, so that a segment is repainted about a dozen times in its life. Counts
/// are exact: each birth is told to every node that it hangs on. Where there are few births for the network's size, each is told
/// on its own, all that a step bears side by side, as each node on the way is in memory that only the one before tells. Else they are told
/// together, from the youngest node to the oldest in one go, when a twelfth as many as there are nodes have gathered, or
/// growth has ended; but those just behind the tips at once.
#[derive(Clone, Debug)]
pub(super) struct Widths {
    /// Nodes behind from which each notch holds, with its width; then one that none reaches.
    notches: Vec<(u32, f32)>,
    /// How much widths vary along a crack, as a share.
    unevenness: f32,
    /// No node becomes wider.
    widest: f32,
    /// Nodes beyond the end of a crack that is free no longer.
    beyond: u32,
    pipes: Vec<Pipe>,
    /// Of each node.
    forms: Vec<Form>,
    /// Nodes, and how many more hang on each than it knows; empty in between.
    told: Vec<(u32, u32)>,
    /// Room for those that pass on what they were told.
    passed: Vec<(u32, u32)>,
    /// Births that wait.
    waiting: usize,
}

/// What a node knows of what hangs on it, itself included. As little as possible: on the way up a branch each is read before it is
/// known which one comes next.
#[derive(Clone, Copy, Debug)]
struct Pipe {
    behind: u32,
    /// How many more it will be told of.
    waiting: u32,
    /// The count at which it is due for another notch.
    due: u32,
    parent: u32,
}

/// What else makes the width of a node.
#[derive(Clone, Copy, Debug)]
struct Form {
    /// What the width of its notch is multiplied by, 0..=1.
    factor: f32,
    /// And for the energy of its impact.
    wider: f32,
    /// What it counts for by itself: one, and all that a needle takes where the crack goes on beyond it.
    counts: u32,
}

/// The width of an even crack with `count` nodes behind, pattern units.
pub(super) fn even_width(params: &GrowthParams, count: u32) -> f32 {
    let pipes = ops::powf(count as f32, 1.0 / params.murray) - 1.0;
    let width = (params.line_width * (1.0 + params.line_growth * pipes)).min(params.max_width);
    // A needle: the tip itself has next to no width.
    let taper = if params.tip_taper > 0.0 { ((count as f32 - 0.95) / params.tip_taper).min(1.0) } else { 1.0 };
    width * taper
}

/// Nodes for which a junction stands: all that a needle takes.
pub(super) fn beyond(params: &GrowthParams) -> u32 {
    params.tip_taper.ceil() as u32
}

/// Of those, how many an end has that narrows.
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
            // The first count that is a notch wider.
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
            told: Vec::new(),
            passed: Vec::new(),
            waiting: 0,
        }
    }

    /// Other notches for the nodes to come; those that are there never become thinner.
    pub(super) fn set_params(&mut self, params: &GrowthParams) {
        let Self { notches, unevenness, beyond, .. } = Self::new(params);
        (self.notches, self.unevenness, self.beyond) = (notches, unevenness, beyond);
        // What was wide enough has stopped counting.
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

    /// No node becomes wider from now on, pattern units.
    pub(super) const fn set_widest(&mut self, widest: f32) {
        self.widest = widest;
    }

    /// The most that a node that was so wide may become.
    pub(super) fn at_most(&self, width: f32) -> f32 {
        width.min(self.widest)
    }

    pub(super) fn reserve(&mut self, nodes: usize) {
        self.pipes.reserve(nodes);
        self.forms.reserve(nodes);
    }

    /// The notch that holds for a count.
    fn notch(&self, behind: u32) -> usize {
        self.notches.partition_point(|notch| notch.0 <= behind).saturating_sub(1)
    }

    /// Prepares the place of a node that grows from `parent`, with a draw of its own; returns its width.
    pub(super) fn tip(&mut self, parent: u32, draw: impl FnOnce() -> f32, wider: f32) -> f32 {
        let mut factor = 1.0;
        if self.unevenness > 0.0 {
            // Each node is much like the one before.
            let middle = 1.0 - 0.5 * self.unevenness;
            let before = self.forms.get(parent as usize).map_or(middle, |form| form.factor);
            factor = middle + 0.75 * (before - middle) + self.unevenness * (draw() - 0.5);
            factor = factor.clamp(1.0 - self.unevenness, 1.0);
        }
        self.place(parent, Form { factor, wider, counts: 1 });
        self.at_most(self.notches[0].1 * factor * wider)
    }

    /// Prepares the place of a node that comes with a width of its own, and counts for nothing.
    pub(super) fn admit(&mut self, parent: u32) {
        self.place(parent, Form { factor: 1.0, wider: 1.0, counts: 0 });
    }

    fn place(&mut self, parent: u32, form: Form) {
        self.pipes.push(Pipe { behind: form.counts, waiting: 0, due: self.notches[1].0, parent });
        self.forms.push(form);
    }

    /// Forgets all nodes but the last ones, which are these.
    pub(super) fn forget(&mut self, left: &[Node]) {
        let first = self.pipes.len().saturating_sub(left.len());
        self.pipes.drain(..first);
        self.forms.drain(..first);
        self.pipes.iter_mut().zip(left).for_each(|(pipe, node)| pipe.parent = node.parent);
    }

    /// Makes a node wider for good.
    pub(super) fn scale(&mut self, node: u32, by: f32) {
        self.forms[node as usize].wider *= by;
    }

    /// Takes up the nodes from `first` on and widens what they hang on; calls `widened` with each node that became wider.
    pub(super) fn push(&mut self, nodes: &mut [Node], first: u32, widened: impl FnMut(u32)) {
        let born = nodes[first as usize..].iter().filter(|node| node.parent != NO_PARENT);
        self.told.extend(born.map(|node| (node.parent, 1)));
        self.spread(nodes, widened);
    }

    /// An end that is free no longer: as if the crack ran on beyond it.
    pub(super) fn join(&mut self, nodes: &mut [Node], tip: u32, widened: impl FnMut(u32)) {
        self.goes_on(nodes, tip, self.beyond, widened);
    }

    /// An end that meets another at the rim of what its hit has loaded: it narrows, but not to nothing.
    pub(super) fn join_thinly(&mut self, nodes: &mut [Node], tip: u32, widened: impl FnMut(u32)) {
        self.goes_on(nodes, tip, thinly(self.beyond), widened);
    }

    /// Counts so many nodes beyond an end.
    fn goes_on(&mut self, nodes: &mut [Node], tip: u32, beyond: u32, widened: impl FnMut(u32)) {
        let form = &mut self.forms[tip as usize];
        let more = (1 + beyond).saturating_sub(form.counts);
        if more > 0 {
            form.counts += more;
            self.told.push((tip, more));
            self.spread(nodes, widened);
        }
    }

    /// Tells nodes how many more hang on them, then those that they hang on, and so on.
    fn spread(&mut self, nodes: &mut [Node], mut widened: impl FnMut(u32)) {
        let is_small = self.pipes.len() <= SMALL;
        let are_few = self.told.len() * AT_ONCE as usize * WAITING < self.pipes.len();
        let mut rounds = if is_small || are_few { u32::MAX } else { AT_ONCE };
        while rounds > 0 && !self.told.is_empty() {
            rounds -= 1;
            self.passed.resize(self.told.len(), (0, 0));
            let mut passed = 0;
            for i in 0..self.told.len() {
                let (node, more) = self.told[i];
                let pipe = &mut self.pipes[node as usize];
                pipe.behind += more;
                let is_due = pipe.behind >= pipe.due;
                // What is as wide as can be hangs on what is.
                let passes = pipe.parent != NO_PARENT && pipe.due != u32::MAX;
                self.passed[passed] = (pipe.parent, more);
                passed += usize::from(passes);
                if is_due {
                    self.widen(nodes, node, &mut widened);
                }
            }
            self.passed.truncate(passed);
            std::mem::swap(&mut self.told, &mut self.passed);
        }
        for (node, more) in self.told.drain(..) {
            self.pipes[node as usize].waiting += more;
            self.waiting += more as usize;
        }
        if self.waiting * WAITING > self.pipes.len() {
            self.settle(nodes, widened);
        }
    }

    /// Tells all that waits.
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

    /// Gives a node the width of its notch.
    fn widen(&mut self, nodes: &mut [Node], node: u32, widened: &mut impl FnMut(u32)) {
        let notch = self.notch(self.pipes[node as usize].behind);
        self.pipes[node as usize].due = self.notches[notch + 1].0;
        let form = self.forms[node as usize];
        let (this, width) = (&mut nodes[node as usize], self.at_most(self.notches[notch].1 * form.factor * form.wider));
        if width > this.width {
            this.width = width;
            widened(node);
        }
    }
}

#[cfg(test)]
impl Widths {
    /// What a node counts for by itself, and the share of its even width that it has.
    pub(super) fn form(&self, node: u32) -> (u32, f32) {
        let Form { factor, wider, counts } = self.forms[node as usize];
        (counts, factor * wider)
    }
}
