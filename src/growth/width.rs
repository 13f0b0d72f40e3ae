//! Widths by hierarchy: a pipe model that only ever widens.

use super::params::GrowthParams;
use crate::{
    math::ops,
    pattern::{NO_PARENT, Node},
};

/// How many times more nodes must hang on a node for its width to grow by one notch.
const NOTCH: f32 = 1.5;

/// Free ends are narrower over so many nodes.
const TAPERED: u32 = 5;

/// Where a crack is a mere hairline, its tip is so much narrower.
const HAIRLINE: f32 = 0.1;

/// A hairline opens with each notch, and from this one on it is as wide as the rest.
const OPEN: u8 = 9;

/// Share of the nodes of a hairline after which it goes on.
const GOES_ON: f32 = 0.6;

/// Widths of nodes by the number of nodes behind them (`lw = line_growth * n_c'` of Couto et al., with the exponent of
/// Murray's pipe model: `n` nodes are as wide as `n^(1/murray)` tips).
///
/// A node tells its parent of its growth only when it has become wider itself, so a birth costs a few steps up its branch
/// and not the whole way to the start, and a segment is repainted about a dozen times in its life.
#[derive(Clone, Debug)]
pub(super) struct Widths {
    /// Nodes behind from which each notch holds, with its width; then one that none reaches.
    notches: Vec<(u32, f32)>,
    /// How much widths vary along a crack, as a share.
    unevenness: f32,
    /// Share of the nodes at which a crack is a hairline.
    hairlines: f32,
    pipes: Vec<Pipe>,
    /// Of each node.
    forms: Vec<Form>,
    /// Nodes, and how many more hang on each than it knows; empty in between.
    told: Vec<(u32, u32)>,
    /// Room for those that are due for another notch.
    due: Vec<u32>,
}

/// What a node knows of what hangs on it, itself included. As little as possible: on the way up a branch each is read before it is
/// known which one comes next.
#[derive(Clone, Copy, Debug)]
struct Pipe {
    behind: u32,
    /// How much of that its parent has been told.
    passed_on: u32,
    parent: u32,
    notch: u8,
}

/// What else makes the width of a node.
#[derive(Clone, Copy, Debug)]
struct Form {
    /// What the width of its notch is multiplied by.
    factor: f32,
    /// And for the hammering on its impact.
    wider: f32,
    is_hairline: bool,
}

impl Form {
    const PLAIN: Self = Self { factor: 1.0, wider: 1.0, is_hairline: false };

    /// The width at a notch.
    fn width(self, notch: u8, width: f32) -> f32 {
        let open = if self.is_hairline { (f32::from(notch) / f32::from(OPEN)).min(1.0) } else { 1.0 };
        width * self.factor * self.wider * (HAIRLINE + (1.0 - HAIRLINE) * open)
    }
}

impl Widths {
    pub(super) fn new(params: &GrowthParams) -> Self {
        let taper = |count: u32| 1.0 - params.tip_taper * (1.0 - (count - 1) as f32 / TAPERED as f32).max(0.0);
        let mut notches = vec![(1u32, params.line_width * taper(1))];
        while let Some(&(count, width)) = notches.last() {
            let is_tapered = params.tip_taper > 0.0 && count <= TAPERED;
            let is_widest = width >= params.max_width || params.line_growth <= 0.0;
            if (is_widest && !is_tapered) || notches.len() >= 40 {
                break;
            }
            let count = (count + 2).max((count as f32 * NOTCH) as u32);
            let pipes = ops::powf(count as f32, 1.0 / params.murray) - 1.0;
            let width = (params.line_width * (1.0 + params.line_growth * pipes)).min(params.max_width) * taper(count);
            notches.push((count, width));
        }
        notches.push((u32::MAX, 0.0));
        let (unevenness, hairlines) = (params.unevenness, params.hairlines);
        let (pipes, forms) = (Vec::new(), Vec::new());
        Self { notches, unevenness, hairlines, pipes, forms, told: Vec::new(), due: Vec::new() }
    }

    /// Other notches for the nodes to come; those that are there never become thinner.
    pub(super) fn set_params(&mut self, params: &GrowthParams) {
        self.notches = Self::new(params).notches;
        (self.unevenness, self.hairlines) = (params.unevenness, params.hairlines);
        let last = (self.notches.len() - 2) as u8;
        for pipe in &mut self.pipes {
            pipe.notch = pipe.notch.min(last);
        }
    }

    pub(super) fn reserve(&mut self, nodes: usize) {
        self.pipes.reserve(nodes);
        self.forms.reserve(nodes);
    }

    /// Prepares the place of a node that grows from `parent`, with draws of its own; returns its width.
    pub(super) fn tip(&mut self, parent: u32, draw: impl Fn(u64) -> f32, wider: f32) -> f32 {
        let mut factor = 1.0;
        let mut is_hairline = false;
        if self.hairlines > 0.0 {
            let begins = (1.0 - GOES_ON) * self.hairlines / (1.0 - self.hairlines).max(1e-3);
            let is_within = self.forms.get(parent as usize).is_some_and(|form| form.is_hairline);
            is_hairline = draw(0x2D) < if is_within { GOES_ON } else { begins };
        }
        if self.unevenness > 0.0 {
            // Each node is much like the one before.
            let before = self.forms.get(parent as usize).map_or(1.0, |form| form.factor);
            factor += 0.75 * (before - 1.0) + self.unevenness * (draw(0x1D) - 0.5);
            factor = factor.clamp(1.0 - self.unevenness, 1.0 + self.unevenness);
        }
        let form = Form { factor, wider, is_hairline };
        self.place(parent, form);
        form.width(0, self.notches[0].1)
    }

    /// Prepares the place of a node that comes with a width of its own.
    pub(super) fn admit(&mut self, parent: u32) {
        self.place(parent, Form::PLAIN);
    }

    fn place(&mut self, parent: u32, form: Form) {
        self.pipes.push(Pipe { behind: 1, passed_on: 1, parent, notch: 0 });
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
        self.told.push((tip, TAPERED));
        self.spread(nodes, widened);
    }

    /// Tells nodes how many more hang on them, then those that they hang on, and so on: all that are as far on their way at once, as
    /// each is in memory that is known only from the one before, and many such reads take hardly longer than one.
    fn spread(&mut self, nodes: &mut [Node], mut widened: impl FnMut(u32)) {
        while !self.told.is_empty() {
            self.due.resize(self.told.len(), 0);
            let mut due = 0;
            for &(node, more) in &self.told {
                let pipe = &mut self.pipes[node as usize];
                pipe.behind += more;
                // Without a branch, which would be guessed wrong at every other node.
                self.due[due] = node;
                due += usize::from(pipe.behind >= self.notches[usize::from(pipe.notch) + 1].0);
            }
            self.told.clear();
            for &node in &self.due[..due] {
                let pipe = &mut self.pipes[node as usize];
                let before = pipe.notch;
                while pipe.behind >= self.notches[usize::from(pipe.notch) + 1].0 {
                    pipe.notch += 1;
                }
                // Told twice at once.
                if pipe.notch == before {
                    continue;
                }
                if pipe.parent != NO_PARENT {
                    self.told.push((pipe.parent, pipe.behind - pipe.passed_on));
                }
                pipe.passed_on = pipe.behind;
                let width = self.forms[node as usize].width(pipe.notch, self.notches[usize::from(pipe.notch)].1);
                let this = &mut nodes[node as usize];
                this.width = this.width.max(width);
                widened(node);
            }
        }
    }
}
