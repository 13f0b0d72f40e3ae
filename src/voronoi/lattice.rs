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
    /// How much of the weight the noise, which is the first layer, takes away: 65535 for all of it where the noise is highest.
    pub noise_share: u16,
    /// How broad its strokes are: 0 for those in which cracks must not wander, so that they are recognised, 1 for those in which they may.
    pub breadth: f32,
}

impl Layer {
    /// A layer without weight.
    pub(super) const fn new(values: Grid<u16>) -> Self {
        Self { values, weight: 0, noise_share: 0, breadth: 0.0 }
    }

    /// The weight in β.
    pub(super) fn weight_in_beta(&self) -> f32 {
        f32::from(self.weight) / f32::from(UNIT)
    }

    /// Largest difference of a weight from the one that it was set to, in β.
    pub(super) const ROUNDED: f32 = 0.5 / UNIT as f32;

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

/// What is left of a cost where the noise of the two neighbours is `noise`.
#[inline(always)]
fn lessen(cost: u16, noise: (u16, u16), noise_share: u16) -> u16 {
    ((u32::from(cost) * (65536 - u32::from(weigh(noise.0, noise.1, noise_share)))) >> 16) as u16
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
            let at = |layer: &Layer| (layer.values.as_slice()[a as usize], layer.values.as_slice()[b as usize]);
            let noise = layers.first().map(at).unwrap_or_default();
            let of = |layer: &Layer| {
                let (a, b) = at(layer);
                lessen(weigh(a, b, layer.weight), noise, layer.noise_share)
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
    add(out, layers, |layer| {
        let row = layer.values.row(y);
        [&row[x0..x1], &row[(x0 + 1).min(row.len())..(x1 + 1).min(row.len())]]
    });
    if layers.first().is_some_and(|layer| x1 == layer.values.width()) {
        out[x1 - x0 - 1] = WALL;
    }
}

/// The edges downwards from the texels `x0..` of row `y`, which is not the last.
pub(super) fn edges_down(out: &mut [u16], layers: &[Layer], y: usize, x0: usize) {
    out.fill(UNIT);
    let x1 = x0 + out.len();
    add(out, layers, |layer| [y, y + 1].map(|y| &layer.values.row(y)[x0..x1]));
}

/// Adds what each layer gives; `rows` are its values at both ends of each edge.
fn add<'a>(out: &mut [u16], layers: &'a [Layer], rows: impl Fn(&'a Layer) -> [&'a [u16]; 2]) {
    let Some((noise, guides)) = layers.split_first() else { return };
    let noises = rows(noise);
    for ((edge, &a), &b) in out.iter_mut().zip(noises[0]).zip(noises[1]) {
        *edge += weigh(a, b, noise.weight);
    }
    for guide in guides {
        let [from, to] = rows(guide);
        let noise = noises[0].iter().zip(noises[1]);
        for (((edge, &a), &b), (&na, &nb)) in out.iter_mut().zip(from).zip(to).zip(noise) {
            *edge += lessen(weigh(a, b, guide.weight), (na, nb), guide.noise_share);
        }
    }
}
