//! Regions and costs of every texel: [`VoronoiMap`].

use super::{
    MapCharts, StrokeReport, VoronoiError, VoronoiParams,
    charts::{MapGround, texel},
    lattice::{Lattice, Layer, WALL, edges_across, edges_down},
    level::Level,
    params::MAX_LEVELS,
    rough::Roughness,
    seams::Seams,
    search::BLOCK,
    trace::Tracer,
    widths::Guidance,
};
use crate::{
    Grid,
    pattern::{Network, SurfaceFrame},
};
use glam::{UVec2, Vec2};

/// How much longer ways are from texel to texel than straight ones, in the mean over all directions: 4 / π.
const LONGER: f32 = 4.0 / std::f32::consts::PI;

/// If more than one edge in this many has changed, a new search is faster.
const MOST_CHANGES: usize = 8;

/// Regions and path costs of every texel (Mould 2005, section 3).
///
/// It keeps everything that a later change needs: about 12 bytes a texel with one level and one guide, 7 more on [`MapCharts`], 8 more for
/// each further level and 2 for each further guide.
///
/// ```
/// use bevy_crack::voronoi::{SiteLayout, VoronoiMap, VoronoiParams, voronoi_map};
/// use std::ops::ControlFlow;
///
/// // Two sites on 7 x 5 texels, no noise: every edge costs β, which is 256 units.
/// let sites = SiteLayout::Given(vec![[0.1, 0.3].into(), [0.5, 0.3].into()]);
/// let params = VoronoiParams { alpha: 0.0, layout: sites, ..VoronoiParams::DEFAULT };
/// let mut map: VoronoiMap = voronoi_map(&params, &[], [7, 5].into(), 1, |_| ControlFlow::Continue(()))?;
/// assert_eq!(map.sites(), [[0, 1].into(), [2, 1].into()]);
/// assert_eq!((map.params(), map.frame().size()), (&params, [7, 5].into()));
/// let regions = map.regions().expect("there are sites");
/// assert_eq!(regions.row(3), [0, 0, 1, 1, 1, 1, 1]);
/// assert_eq!((map.region(1, 3), map.cost(1, 3)), (Some(0), Some(3 * 256)));
/// // Nothing lies to the right of the last column or below the last row.
/// assert_eq!((map.edges(3, 3), map.edges(6, 4)), ((Some(256), Some(256)), (None, None)));
/// // Only strokes of guides are reported on.
/// assert_eq!(map.strokes(), None);
/// let before = map.clone();
/// map.search_again();
/// assert_eq!(map.regions(), before.regions());
/// # Ok::<(), bevy_crack::voronoi::VoronoiError>(())
/// ```
#[derive(Clone, Debug)]
pub struct VoronoiMap {
    pub(super) params: VoronoiParams,
    pub(super) frame: SurfaceFrame,
    /// Where all of it is surface there are none.
    pub(super) charts: Option<MapCharts>,
    pub(super) sites: Vec<UVec2>,
    /// Noise, then guides.
    pub(super) layers: Vec<Layer>,
    pub(super) levels: Vec<Level>,
    pub(super) lattices: Vec<Lattice>,
    /// For each row and block: whether a guide is above zero there.
    pub(super) guided: Vec<bool>,
    pub(super) strokes: Option<StrokeReport>,
    /// Seed of what varies the widths of cracks away from the guides.
    pub(super) width_seed: u32,
    /// What makes its lines rough.
    pub(super) rough: Roughness,
    /// Path cost at which cracks have full width, in β: that of the most expensive ones when the map was made.
    pub(super) full_cost: Option<f32>,
}

impl VoronoiMap {
    #[cfg(test)]
    pub(super) fn lattice(&self, level: usize) -> &Lattice {
        &self.lattices[level]
    }

    pub(super) const fn ground(&self) -> MapGround<'_> {
        MapGround { frame: &self.frame, charts: self.charts.as_ref() }
    }

    /// A search from the first `n` sites that has not begun.
    pub(super) fn level(&self, n: usize, has_walls: bool) -> Level {
        Level::new(self.frame.size(), &self.sites[..n], n, has_walls || self.charts.is_some())
    }

    /// Computes the edges of row `y` of the first lattice.
    pub(super) fn set_row(&mut self, y: usize) {
        self.lattices[0].set_row(y, &self.layers);
        if let Some(charts) = &self.charts {
            charts.wall_row(&mut self.lattices[0], y);
        }
    }

    /// Computes the links of the first lattice.
    pub(super) fn set_links(&mut self) {
        if let Some(charts) = &self.charts {
            self.lattices[0].set_links(charts.links(), &self.layers);
        }
    }

    pub(super) const fn height(&self) -> usize {
        self.frame.size().y as usize
    }

    pub(super) fn n_levels(&self) -> usize {
        self.params.levels.clamp(1, MAX_LEVELS) as usize
    }

    /// Number of the sites that a level uses.
    pub(super) fn sites_of(&self, level: usize) -> usize {
        let finer = self.n_levels() - 1 - level;
        (self.sites.len() >> (2 * finer)).max(1)
    }

    /// Sweeps rows of the last level; returns whether there is more to do.
    pub(super) fn search(&mut self, rows: usize) -> bool {
        let Some(level) = self.levels.last_mut() else { return false };
        let (lattice, n) = (&self.lattices[self.lattices.len() - 1], level.n_sites());
        level.advance(lattice, &self.sites[..n], rows)
    }

    /// Writes walls between the regions of the last level to the last lattice.
    pub(super) fn set_walls(&mut self, rows: std::ops::Range<usize>) {
        let width = self.frame.size().x as usize;
        let (mut row, mut below) = (vec![0; width], vec![0; width]);
        if let (Some(level), Some(lattice)) = (self.levels.last(), self.lattices.last_mut()) {
            if rows.start == 0 {
                level.wall_links(lattice);
            }
            for y in rows {
                level.wall_row(lattice, y, &mut row, &mut below);
            }
        }
    }

    pub(super) fn mark_guided(&mut self, y: usize) {
        let width = self.frame.size().x as usize;
        let guides = &self.layers[1..];
        for x0 in (0..width).step_by(BLOCK) {
            // Includes the texels to the right and below, whose edges to this block belong to it.
            let x1 = (x0 + BLOCK + 1).min(width);
            let rows = y..(y + 2).min(self.frame.size().y as usize);
            let any = guides
                .iter()
                .any(|guide| rows.clone().any(|y| guide.values.row(y)[x0..x1].iter().any(|&value| value > 0)));
            self.guided.push(any);
        }
    }

    /// The position of the map in pattern space.
    #[must_use]
    pub const fn frame(&self) -> &SurfaceFrame {
        &self.frame
    }

    /// The parameters of the map.
    #[must_use]
    pub const fn params(&self) -> &VoronoiParams {
        &self.params
    }

    /// The texel of each site. If several are on one texel only the first has a region.
    #[must_use]
    pub fn sites(&self) -> &[UVec2] {
        &self.sites
    }

    /// How well the cracks cover the strokes of the guides; `None` unless the layout was [`SiteLayout::StrokePairs`](super::SiteLayout::StrokePairs) and
    /// there are strokes.
    #[must_use]
    pub const fn strokes(&self) -> Option<StrokeReport> {
        self.strokes
    }

    fn index(&self, x: u32, y: u32) -> Option<usize> {
        let size = self.frame.size();
        (x < size.x && y < size.y).then(|| y as usize * size.x as usize + x as usize)
    }

    /// The last level, and the number there of a texel that belongs to a region.
    fn reached(&self, x: u32, y: u32) -> Option<(&Level, usize)> {
        let (level, i) = (self.levels.last()?, self.index(x, y)?);
        level.is_reached(i).then_some((level, i))
    }

    /// The region of a texel: the index of its site. `None` outside, and where no path from a site leads.
    #[must_use]
    pub fn region(&self, x: u32, y: u32) -> Option<u32> {
        self.reached(x, y).map(|(level, i)| level.region(i))
    }

    /// Cost of the shortest path from the site to a texel, in units of β / 256. `None` outside, and where no path from a site leads.
    #[must_use]
    pub fn cost(&self, x: u32, y: u32) -> Option<u64> {
        self.reached(x, y).map(|(level, i)| level.units(i))
    }

    /// Costs of the edges from a texel to its right and down in the finest level, in units of β / 256; `None` where
    /// there is no edge.
    #[must_use]
    pub fn edges(&self, x: u32, y: u32) -> (Option<u16>, Option<u16>) {
        let edges = self.index(x, y).zip(self.lattices.last()).map(|(i, lattice)| lattice.edges(i));
        let passable = |edge: u16| (edge != WALL).then_some(edge);
        edges.map_or((None, None), |(across, down)| (passable(across), passable(down)))
    }

    /// Computes the paths of all levels again, from the same sites and edges, with the same result. For measurements.
    pub fn search_again(&mut self) {
        (0..self.levels.len()).for_each(|i| self.search_level_again(i));
    }

    fn search_level_again(&mut self, i: usize) {
        let (n, has_walls) = (self.levels[i].n_sites(), self.levels[i].has_walls());
        self.levels[i] = self.level(n, has_walls);
        while self.levels[i].advance(&self.lattices[i], &self.sites[..n], usize::MAX) {}
    }

    /// The regions of all texels; `None` where there are no sites. Those of texels that show nothing of the surface mean nothing.
    #[must_use]
    pub fn regions(&self) -> Option<Grid<u32>> {
        let level = self.levels.last()?;
        let mut regions = Grid::new(self.frame.size(), 0);
        for y in 0..self.height() {
            level.fill_regions(y, regions.row_mut(y));
        }
        Some(regions)
    }

    /// The seams that a tracer has found, and the cost of full width.
    pub(super) fn follow(&self, tracer: Tracer) -> (Seams, f32) {
        let layers = &self.layers[1..];
        // In proportion to the weights, so that nothing jumps where another guide becomes the heaviest.
        let sum: f32 = layers.iter().map(Layer::weight_in_beta).sum();
        let mean = |of: fn(&Layer) -> f32| {
            layers.iter().map(|layer| layer.weight_in_beta() * of(layer)).sum::<f32>() / sum.max(1.0e-6)
        };
        let guides = Guidance {
            ground: self.params.alpha / self.params.beta + 1.0,
            weight: layers.iter().map(Layer::weight_in_beta).fold(0.0, f32::max),
            left: 1.0 - 0.5 * mean(|layer| f32::from(layer.noise_share)) / 65535.0,
            breadth: mean(|layer| layer.breadth),
            seed: self.width_seed,
            layers,
        };
        tracer.finish(&self.levels, &self.params, self.ground(), (&guides, &self.rough), self.full_cost)
    }

    /// These seams of the map as a network that has grown from an impact at `from`, pattern units, as [`Seams::network`] does. On [`MapCharts`] the
    /// front goes over links: in each chart it begins where it comes first, when it comes there.
    #[must_use]
    pub fn network(&self, seams: &Seams, from: Vec2) -> Network {
        let Some(charts) = &self.charts else { return seams.network(from) };
        let from = if from.is_finite() { from } else { Vec2::ZERO };
        let size = self.frame.size();
        let mut lattice = Lattice::new(size);
        let uniform = Layer::new(Grid::new(size, 0));
        (0..self.height()).for_each(|y| {
            lattice.set_row(y, std::slice::from_ref(&uniform));
            charts.wall_row(&mut lattice, y);
        });
        lattice.set_links(charts.links(), &[uniform]);
        let start = [texel(&self.frame, from)];
        let mut ways = Level::new(size, &start, 1, true);
        while ways.advance(&lattice, &start, usize::MAX) {}
        let step = 1.0 / (LONGER * self.frame.texels_per_unit());
        seams.network_by(&|place| {
            let at = texel(&self.frame, place);
            let i = at.y as usize * size.x as usize + at.x as usize;
            if ways.is_reached(i) { ways.cost(i) * step } else { place.distance(from) }
        })
    }

    /// Makes the most expensive cracks of the current map the widest, as they were when the map was made.
    ///
    /// ```
    /// use bevy_crack::{Grid, voronoi::{Guide, VoronoiBake, VoronoiMap, VoronoiParams}};
    ///
    /// // All of the surface is expensive, and then only half as much.
    /// let guide = Guide::new(Grid::new([1, 1].into(), 1.0));
    /// let params = VoronoiParams { stroke_width: 0.0, ..VoronoiParams::DEFAULT };
    /// let mut map = VoronoiBake::new(params, vec![guide], [64, 64].into(), 1)?.finish().0;
    /// map.set_gammas(&[14.0])?;
    /// let widest = |map: &VoronoiMap| {
    ///     let seams = map.seams().seams;
    ///     seams.iter().flat_map(|seam| &seam.points).map(|point| point.width).fold(0.0, f32::max)
    /// };
    /// let before = widest(&map);
    /// map.rescale_widths();
    /// assert!(widest(&map) > before);
    /// # Ok::<(), bevy_crack::voronoi::VoronoiError>(())
    /// ```
    pub fn rescale_widths(&mut self) {
        self.full_cost = None;
        if !self.levels.is_empty() {
            self.full_cost = Some(self.traced().1);
        }
    }

    /// The boundaries of the regions, with [`roughness`](VoronoiParams::roughness): [`regions`](Self::regions) and [`strokes`](Self::strokes) are as
    /// they are without it.
    ///
    /// The cost that corresponds to full width stays that of the map when it was made, so that widths do not jump as
    /// weights change.
    #[must_use]
    pub fn seams(&self) -> Seams {
        if self.levels.is_empty() {
            return Seams { extent: self.frame.extent(), ..Seams::default() };
        }
        self.traced().0
    }

    /// The seams, and the cost of full width.
    fn traced(&self) -> (Seams, f32) {
        let mut tracer = Tracer::new(self.frame.size());
        self.scan(&mut tracer, self.height());
        self.follow(tracer)
    }

    /// Has a tracer look for boundaries in some further rows; returns whether there are more.
    pub(super) fn scan(&self, tracer: &mut Tracer, rows: usize) -> bool {
        self.levels.last().is_some_and(|level| tracer.scan(level, self.charts.as_ref(), rows))
    }

    /// Changes the weights of the guides and keeps sites and noise (Mould 2005, section 6.1, and eq. 4).
    ///
    /// Only what can change is computed (all of it on [`MapCharts`] with links): the texels whose path used an edge that became more expensive, and those to
    /// which a cheaper edge gives a shorter path. The result equals a new map.
    ///
    /// ```
    /// use bevy_crack::{Grid, voronoi::{Guide, VoronoiBake, VoronoiParams}};
    ///
    /// // A bar down the middle; the weight of the guide rises from nothing.
    /// let mut bar = Grid::new([9, 1].into(), 0.0);
    /// bar.row_mut(0)[4] = 1.0;
    /// let guide = Guide { gamma: 0.0, ..Guide::new(bar) };
    /// let mut map = VoronoiBake::new(VoronoiParams::DEFAULT, vec![guide], [90, 90].into(), 1)?.finish().0;
    /// let before = map.cost(45, 45);
    /// map.set_gammas(&[28.0])?;
    /// assert!(map.cost(45, 45) > before);
    /// # Ok::<(), bevy_crack::voronoi::VoronoiError>(())
    /// ```
    ///
    /// # Errors
    /// [`VoronoiError::OutOfRange`] if a weight is out of its range, which depends on all of them; the map does not change then. Weights beyond the
    /// number of
    /// guides are ignored; guides beyond the number of weights keep theirs.
    pub fn set_gammas(&mut self, gammas: &[f32]) -> Result<(), VoronoiError> {
        let beta = self.params.beta;
        // Weights that stay have been rounded, perhaps up.
        let kept = |layer: &Layer| (layer.weight_in_beta() - Layer::ROUNDED).max(0.0) * beta;
        let layers = &mut self.layers[1..];
        let all = gammas.iter().copied().chain(layers.iter().skip(gammas.len()).map(kept)).take(layers.len());
        self.params.validate_with(all)?;
        for (layer, gamma) in layers.iter_mut().zip(gammas) {
            layer.set_weight(gamma / beta);
        }
        for i in 0..self.levels.len() {
            let n_changed = if i == 0 { self.change_base() } else { self.change_walls(i) };
            let has_links = !self.lattices[i].links().is_empty();
            if has_links || n_changed * MOST_CHANGES > self.lattices[i].n_texels() {
                self.search_level_again(i);
                continue;
            }
            let level = &mut self.levels[i];
            level.reconsider(&self.lattices[i]);
            let n = level.n_sites();
            while level.advance(&self.lattices[i], &self.sites[..n], usize::MAX) {}
        }
        Ok(())
    }

    /// Updates the first lattice where a guide is above zero; returns the number of changed edges.
    fn change_base(&mut self) -> usize {
        let (width, height) = (self.frame.size().x as usize, self.height());
        let blocks = width.div_ceil(BLOCK);
        self.set_links();
        let (lattice, layers, charts) = (&mut self.lattices[0], &self.layers[..], self.charts.as_ref());
        let Some(level) = self.levels.first_mut() else { return 0 };
        let mut n_changed = 0;
        let mut new = [0; BLOCK];
        for (block, _) in self.guided.iter().enumerate().filter(|(_, guided)| **guided) {
            let (y, x0) = (block / blocks, block % blocks * BLOCK);
            let x1 = (x0 + BLOCK).min(width);
            let new = &mut new[..x1 - x0];
            edges_across(new, layers, y, x0);
            if let Some(charts) = charts {
                charts.wall(new, y, x0, false);
            }
            n_changed += level.take_over(&mut lattice.across_mut(y)[x0..x1], new, x0, y, false);
            if y + 1 < height {
                edges_down(new, layers, y, x0);
                if let Some(charts) = charts {
                    charts.wall(new, y, x0, true);
                }
                n_changed += level.take_over(&mut lattice.down_mut(y)[x0..x1], new, x0, y, true);
            }
        }
        n_changed
    }

    /// Updates the lattice of level `i` after the level before has changed.
    fn change_walls(&mut self, i: usize) -> usize {
        let width = self.frame.size().x as usize;
        let mut new = self.lattices[0].clone();
        self.levels[i - 1].wall_links(&mut new);
        let (mut row, mut below) = (vec![0; width], vec![0; width]);
        let mut n_changed = 0;
        let lattice = &mut self.lattices[i];
        for y in 0..self.frame.size().y as usize {
            self.levels[i - 1].wall_row(&mut new, y, &mut row, &mut below);
            n_changed += self.levels[i].take_over(lattice.across_mut(y), new.across(y), 0, y, false);
            n_changed += self.levels[i].take_over(lattice.down_mut(y), new.down(y), 0, y, true);
        }
        core::mem::swap(lattice.links_mut(), new.links_mut());
        n_changed
    }
}
