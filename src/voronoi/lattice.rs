//! The cost of a step from texel to texel: [`Lattice`].

use crate::Grid;
use glam::UVec2;

/// Cost units per β: integers, so that every machine computes the same map.
pub(super) const UNIT: u16 = 256;

/// The cost of an edge that cannot be crossed.
pub(super) const WALL: u16 = u16::MAX;

/// The largest sum of all weights of one edge, in β: below [`WALL`] in units.
pub(super) const MAX_WEIGHT: f32 = 254.0;

/// A picture that raises the cost of edges, with its weight.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    /// 0..=65535 at each texel.
    pub values: Grid<u16>,
    /// Cost of the value 65535, in units.
    pub weight: u16,
}

impl Layer {
    /// The weight in β.
    pub(super) fn weight_in_beta(&self) -> f32 {
        f32::from(self.weight) / f32::from(UNIT)
    }

    /// A weight given in β.
    pub(super) fn set_weight(&mut self, in_beta: f32) {
        self.weight = (in_beta.clamp(0.0, MAX_WEIGHT) * f32::from(UNIT)).round() as u16;
    }
}

/// The costs of all edges of the 4-connected lattice (Mould 2005, eq. 1, 2 and 4), in units.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lattice {
    size: UVec2,
    /// From (x, y) to (x + 1, y); a wall in the last column.
    across: Vec<u16>,
    /// From (x, y) to (x, y + 1); a wall in the last row.
    down: Vec<u16>,
    /// Edges between texels that are not beside one another.
    links: Vec<LatticeLink>,
}

/// An edge between two texels anywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LatticeLink {
    pub ends: [u32; 2],
    pub cost: u16,
}

/// The larger value between neighbours, weighed: `weight * max / 65536`.
#[inline(always)]
fn weigh(a: u16, b: u16, weight: u16) -> u16 {
    ((u32::from(a.max(b)) * u32::from(weight)) >> 16) as u16
}

impl Lattice {
    /// Every edge is a wall until [`set_row`](Self::set_row).
    pub(super) fn new(size: UVec2) -> Self {
        let n = size.x as usize * size.y as usize;
        Self { size, across: vec![WALL; n], down: vec![WALL; n], links: Vec::new() }
    }

    pub(super) const fn size(&self) -> UVec2 {
        self.size
    }

    pub(super) const fn width(&self) -> usize {
        self.size.x as usize
    }

    pub(super) const fn n_texels(&self) -> usize {
        self.across.len()
    }

    pub(super) fn across(&self, y: usize) -> &[u16] {
        let w = self.width();
        &self.across[y * w..(y + 1) * w]
    }

    pub(super) fn down(&self, y: usize) -> &[u16] {
        let w = self.width();
        &self.down[y * w..(y + 1) * w]
    }

    pub(super) fn across_mut(&mut self, y: usize) -> &mut [u16] {
        let w = self.width();
        &mut self.across[y * w..(y + 1) * w]
    }

    pub(super) fn down_mut(&mut self, y: usize) -> &mut [u16] {
        let w = self.width();
        &mut self.down[y * w..(y + 1) * w]
    }

    /// The edge from texel `i` to its right, and from `i` downwards.
    #[inline(always)]
    pub(super) fn edges(&self, i: usize) -> (u16, u16) {
        (self.across[i], self.down[i])
    }

    pub(super) fn links(&self) -> &[LatticeLink] {
        &self.links
    }

    pub(super) fn links_mut(&mut self) -> &mut Vec<LatticeLink> {
        &mut self.links
    }

    /// Computes the costs of links between these texels from `layers`.
    pub(super) fn set_links(&mut self, links: &[[u32; 2]], layers: &[Layer]) {
        let cost = |[a, b]: [u32; 2]| {
            let of = |layer: &Layer| {
                let values = layer.values.as_slice();
                weigh(values[a as usize], values[b as usize], layer.weight)
            };
            UNIT + layers.iter().map(of).sum::<u16>()
        };
        self.links.clear();
        self.links.extend(links.iter().map(|ends| LatticeLink { ends: *ends, cost: cost(*ends) }));
    }

    /// Computes the edges of row `y` to the right and down from `layers`.
    pub(super) fn set_row(&mut self, y: usize, layers: &[Layer]) {
        let (w, h) = (self.width(), self.size.y as usize);
        let across = &mut self.across[y * w..(y + 1) * w];
        edges_across(across, layers, y, 0);
        if y + 1 < h {
            edges_down(&mut self.down[y * w..(y + 1) * w], layers, y, 0);
        }
    }
}

/// The edges to the right from the texels `x0..` of row `y`, as many as `out` holds; a wall at the border.
pub(super) fn edges_across(out: &mut [u16], layers: &[Layer], y: usize, x0: usize) {
    out.fill(UNIT);
    let x1 = x0 + out.len();
    for layer in layers {
        let row = layer.values.row(y);
        let right = &row[(x0 + 1).min(row.len())..(x1 + 1).min(row.len())];
        for ((edge, &a), &b) in out.iter_mut().zip(&row[x0..x1]).zip(right) {
            *edge += weigh(a, b, layer.weight);
        }
    }
    if layers.first().is_some_and(|layer| x1 == layer.values.width()) {
        out[x1 - x0 - 1] = WALL;
    }
}

/// The edges downwards from the texels `x0..` of row `y`, which is not the last.
pub(super) fn edges_down(out: &mut [u16], layers: &[Layer], y: usize, x0: usize) {
    out.fill(UNIT);
    let x1 = x0 + out.len();
    for layer in layers {
        let (row, below) = (&layer.values.row(y)[x0..x1], &layer.values.row(y + 1)[x0..x1]);
        for ((edge, &a), &b) in out.iter_mut().zip(row).zip(below) {
            *edge += weigh(a, b, layer.weight);
        }
    }
}
