//! Widths by hierarchy: a pipe model that only ever widens.

use super::params::GrowthParams;
use crate::{
    math::ops,
    pattern::{NO_PARENT, Node},
};

/// How many times more nodes must hang on a node for its width to grow by one notch.
const NOTCH: f32 = 1.5;

/// Widths of nodes by the number of nodes behind them (`lw = line_growth * n_c'` of Couto et al., with the exponent of
/// Murray's pipe model: `n` nodes are as wide as `n^(1/murray)` tips).
///
/// A node tells its parent of its growth only when it has become wider itself, so a birth costs a few steps up its branch
/// and not the whole way to the start, and a segment is repainted about a dozen times in its life.
#[derive(Clone, Debug)]
pub(super) struct Widths {
    /// Nodes behind from which each notch holds, with its width.
    notches: Vec<(u32, f32)>,
    /// How much widths vary along a crack, as a share.
    unevenness: f32,
    pipes: Vec<Pipe>,
}

/// What a node knows of what hangs on it, itself included.
#[derive(Clone, Copy, Debug)]
struct Pipe {
    behind: u32,
    /// How much of that its parent has been told.
    told: u32,
    notch: u8,
    /// What the width of its notch is multiplied by.
    factor: f32,
    /// And for the hammering on its impact.
    wider: f32,
}

impl Widths {
    pub(super) fn new(params: &GrowthParams) -> Self {
        let mut notches = vec![(1u32, params.line_width)];
        while let Some(&(count, width)) = notches.last() {
            if width >= params.max_width || params.line_growth <= 0.0 || notches.len() >= 40 {
                break;
            }
            let count = (count + 2).max((count as f32 * NOTCH) as u32);
            let pipes = ops::powf(count as f32, 1.0 / params.murray) - 1.0;
            let width = (params.line_width * (1.0 + params.line_growth * pipes)).min(params.max_width);
            notches.push((count, width));
        }
        Self { notches, unevenness: params.unevenness, pipes: Vec::new() }
    }

    /// Other notches for the nodes to come; those that are there never become thinner.
    pub(super) fn set_params(&mut self, params: &GrowthParams) {
        self.notches = Self::new(params).notches;
        self.unevenness = params.unevenness;
        let last = (self.notches.len() - 1) as u8;
        for pipe in &mut self.pipes {
            pipe.notch = pipe.notch.min(last);
        }
    }

    pub(super) fn reserve(&mut self, nodes: usize) {
        self.pipes.reserve(nodes);
    }

    /// Prepares the place of a node that grows from `parent`, with a draw of its own; returns its width.
    pub(super) fn tip(&mut self, parent: u32, draw: f32, wider: f32) -> f32 {
        let mut factor = 1.0;
        if self.unevenness > 0.0 {
            // Each node is much like the one before.
            let before = self.pipes.get(parent as usize).map_or(1.0, |pipe| pipe.factor);
            factor += 0.75 * (before - 1.0) + self.unevenness * (draw - 0.5);
            factor = factor.clamp(1.0 - self.unevenness, 1.0 + self.unevenness);
        }
        self.pipes.push(Pipe { behind: 1, told: 1, notch: 0, factor, wider });
        self.notches[0].1 * factor * wider
    }

    /// Prepares the place of a node that comes with a width of its own.
    pub(super) fn add(&mut self) {
        self.pipes.push(Pipe { behind: 1, told: 1, notch: 0, factor: 1.0, wider: 1.0 });
    }

    /// Makes a node wider for good.
    pub(super) fn scale(&mut self, node: u32, by: f32) {
        self.pipes[node as usize].wider *= by;
    }

    /// Widens what it hangs on; calls `widened` with each node that became wider.
    pub(super) fn push(&mut self, nodes: &mut [Node], mut widened: impl FnMut(u32)) {
        let Some(newest) = nodes.last() else { return };
        let (mut node, mut more) = (newest.parent, 1);
        while node != NO_PARENT {
            let pipe = &mut self.pipes[node as usize];
            pipe.behind += more;
            let before = pipe.notch;
            while self.notches.get(usize::from(pipe.notch) + 1).is_some_and(|&(count, _)| pipe.behind >= count) {
                pipe.notch += 1;
            }
            if pipe.notch == before {
                return;
            }
            more = pipe.behind - pipe.told;
            pipe.told = pipe.behind;
            let this = &mut nodes[node as usize];
            this.width = this.width.max(self.notches[usize::from(pipe.notch)].1 * pipe.factor * pipe.wider);
            widened(node);
            node = this.parent;
        }
    }
}
