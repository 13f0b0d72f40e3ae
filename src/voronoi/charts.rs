//! Maps of surfaces that are laid out in parts: [`MapCharts`].

use super::{
    VoronoiError,
    lattice::{Lattice, WALL},
};
use crate::{Grid, OutOfMemory, pattern::SurfaceFrame};
use glam::{IVec2, UVec2, Vec2};

/// A surface that is laid out in parts, as a mesh is whose charts lie side by side in one picture.
///
/// A map is a graph of texels (Mould 2005, section 8, has it run over the vertices of a mesh). On a plain surface each texel is joined to the
/// four beside it. Here texels of different charts are not joined, wherever they lie; and *links* join those that are neighbours on the surface
/// and not in the picture. So regions go on from chart to chart, and there is no crack where the surface is cut.
///
/// ```
/// use bevy_crack::{Grid, voronoi::{MapCharts, SiteLayout, VoronoiBake, VoronoiParams}};
///
/// // Two charts of 3 x 2 texels beside one another; the left end of the first is joined to the right end of the second.
/// let mut chart = Grid::new([6, 2].into(), 0);
/// (0..2).for_each(|y| chart.row_mut(y)[3..].fill(1));
/// let links = (0..2).map(|y| [[0, y].into(), [5, y].into()]).collect();
/// let charts = MapCharts::new(chart, 2.0, 0, links)?;
///
/// // One site at the right end of the first chart: its region is all of both.
/// let params = VoronoiParams { alpha: 0.0, layout: SiteLayout::Given(vec![[1.25, 0.25].into()]), ..VoronoiParams::DEFAULT };
/// let (map, seams) = VoronoiBake::on_charts(params, Vec::new(), charts, 1)?.finish();
/// let costs = [2, 1, 0, 5, 4, 3].map(|edges| Some(edges * 256));
/// assert_eq!([0, 1, 2, 3, 4, 5].map(|x| map.cost(x, 0)), costs);
/// assert!(seams.seams.is_empty());
/// # Ok::<(), bevy_crack::voronoi::VoronoiError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct MapCharts {
    frame: SurfaceFrame,
    chart: Grid<u32>,
    /// For each texel: whether the next ones, to the right and down, are no neighbours.
    apart: Grid<u8>,
    margin: i32,
    links: Vec<[u32; 2]>,
}

/// Bits of [`MapCharts::apart`].
const RIGHT: u8 = 1;

const DOWN: u8 = 2;

/// Which texels are of another chart than the next ones, to the right and down.
fn apart(chart: &Grid<u32>) -> Result<Grid<u8>, OutOfMemory> {
    let mut apart = Grid::try_new(chart.size(), 0)?;
    for y in 0..chart.height() {
        let row = chart.row(y);
        let below = if y + 1 < chart.height() { chart.row(y + 1) } else { &[] };
        let bits = apart.row_mut(y);
        for (bit, next) in [(RIGHT, row.get(1..).unwrap_or_default()), (DOWN, below)] {
            for ((bits, a), b) in bits.iter_mut().zip(row).zip(next) {
                if a != b || *a == MapCharts::NOTHING {
                    *bits |= bit;
                }
            }
        }
    }
    Ok(apart)
}

/// Where the texels of a map lie.
#[derive(Clone, Copy)]
pub(super) struct MapGround<'a> {
    pub frame: &'a SurfaceFrame,
    /// `None` where all of it is surface.
    pub charts: Option<&'a MapCharts>,
}

impl MapGround<'_> {
    /// Whether there can be a site at a point, pattern units.
    pub(super) fn has_room(&self, point: Vec2) -> bool {
        self.charts.is_none_or(|charts| charts.is_inside(texel(self.frame, point)))
    }
}

/// The texel of a point, pattern units.
pub(super) fn texel(frame: &SurfaceFrame, pos: Vec2) -> UVec2 {
    frame.to_texel(pos).max(Vec2::ZERO).as_uvec2().min(frame.size() - 1)
}

impl MapCharts {
    /// The number of no chart: of texels that show nothing of the surface.
    pub const NOTHING: u32 = u32::MAX;

    /// A surface whose texels belong to these charts, with so many texels for a unit of pattern space.
    ///
    /// `margin` is how many texels charts go on beyond their borders, so that filtering finds something there: cracks run into it, sites do not
    /// lie in it. `links` are the pairs of texels that are neighbours on the surface alone.
    ///
    /// # Errors
    /// [`VoronoiError::Size`] if the size is out of its range, [`VoronoiError::Link`] for the first link that leaves the map, joins a texel
    /// to itself, or begins or ends at a texel of no chart.
    pub fn new(
        chart: Grid<u32>,
        texels_per_unit: f32,
        margin: u32,
        links: Vec<[UVec2; 2]>,
    ) -> Result<Self, VoronoiError> {
        let frame = SurfaceFrame::with_unit(chart.size(), texels_per_unit)?;
        let is_there = |at: UVec2| chart.get(at.x, at.y).is_some_and(|chart| chart != Self::NOTHING);
        if let Some(index) = links.iter().position(|[a, b]| a == b || !is_there(*a) || !is_there(*b)) {
            return Err(VoronoiError::Link { index });
        }
        let number = |at: UVec2| at.y * chart.size().x + at.x;
        let links = links.into_iter().map(|ends| ends.map(number)).collect();
        let margin = margin.min(chart.size().max_element()) as i32;
        Ok(Self { frame, apart: apart(&chart)?, chart, margin, links })
    }

    /// The same, these pairs of texels beside one another not being neighbours: where two parts of one chart touch that do not meet on the surface.
    #[must_use]
    pub fn with_walls(mut self, walls: impl IntoIterator<Item = [UVec2; 2]>) -> Self {
        let size = self.frame.size();
        for [a, b] in walls {
            let (first, next) = (a.min(b), a.max(b));
            let bit = match (next - first).to_array() {
                [1, 0] => RIGHT,
                [0, 1] => DOWN,
                _ => continue,
            };
            if next.cmplt(size).all() {
                self.apart.row_mut(first.y as usize)[first.x as usize] |= bit;
            }
        }
        self
    }

    /// Where it lies in pattern space.
    #[must_use]
    pub const fn frame(&self) -> &SurfaceFrame {
        &self.frame
    }

    pub(super) fn links(&self) -> &[[u32; 2]] {
        &self.links
    }

    /// The chart of a texel.
    pub(super) fn at(&self, texel: IVec2) -> u32 {
        let is_there = texel.min_element() >= 0;
        is_there.then(|| self.chart.get(texel.x as u32, texel.y as u32)).flatten().unwrap_or(Self::NOTHING)
    }

    /// Whether a texel lies within the border of its chart: not in its margin, nor beside all charts.
    #[must_use]
    pub fn is_inside(&self, texel: UVec2) -> bool {
        let (at, own) = (texel.as_ivec2(), self.at(texel.as_ivec2()));
        let around = [IVec2::X, IVec2::Y, IVec2::NEG_X, IVec2::NEG_Y];
        own != Self::NOTHING && around.into_iter().all(|way| self.at(at + self.margin * way) == own)
    }

    /// Whether the four texels that meet in a corner are neighbours.
    pub(super) fn is_whole(&self, corner: IVec2) -> bool {
        let is_joined = |texel: IVec2, bit: u8| {
            let bits = (texel.min_element() >= 0).then(|| self.apart.get(texel.x as u32, texel.y as u32)).flatten();
            bits.is_some_and(|bits| bits & bit == 0)
        };
        let (left, above, before) = (corner + IVec2::NEG_X, corner + IVec2::NEG_Y, corner + IVec2::NEG_ONE);
        is_joined(before, RIGHT) && is_joined(left, RIGHT) && is_joined(before, DOWN) && is_joined(above, DOWN)
    }

    /// For texels from `x0` on of row `y`: puts walls where the next one, to the right or `down`, is of another chart.
    pub(super) fn wall(&self, edges: &mut [u16], y: usize, x0: usize, down: bool) {
        for (edge, is_apart) in edges.iter_mut().zip(self.apart(y, x0, down)) {
            if is_apart {
                *edge = WALL;
            }
        }
    }

    /// Puts walls between charts into row `y` of a lattice.
    pub(super) fn wall_row(&self, lattice: &mut Lattice, y: usize) {
        self.wall(lattice.across_mut(y), y, 0, false);
        self.wall(lattice.down_mut(y), y, 0, true);
    }

    /// For texels of row `y`: takes away the bits of boundaries to the right and down where the next one is of another chart.
    pub(super) fn disjoin(&self, edges: &mut [u8], y: usize, bits: [u8; 2]) {
        for (down, bit) in [false, true].into_iter().zip(bits) {
            for (edge, is_apart) in edges.iter_mut().zip(self.apart(y, 0, down)) {
                if is_apart {
                    *edge &= !bit;
                }
            }
        }
    }

    /// For texels from `x0` on of row `y`: whether the next one, to the right or `down`, is no neighbour.
    fn apart(&self, y: usize, x0: usize, down: bool) -> impl Iterator<Item = bool> + '_ {
        let bit = if down { DOWN } else { RIGHT };
        self.apart.row(y)[x0..].iter().map(move |bits| bits & bit != 0)
    }

    /// The same surface with fewer texels.
    pub(super) fn shrunk(&self, size: UVec2) -> Self {
        let from = self.chart.size();
        let scale = size.x as f32 / from.x as f32;
        let mut chart = Grid::new(size, Self::NOTHING);
        let middle = |at: u32, size: u32, from: u32| ((2 * at + 1) * from / (2 * size)).min(from - 1);
        for y in 0..size.y {
            for (x, out) in (0..size.x).zip(chart.row_mut(y as usize)) {
                *out = self.chart.get(middle(x, size.x, from.x), middle(y, size.y, from.y)).unwrap_or(Self::NOTHING);
            }
        }
        let small = |at: UVec2| at * size / from;
        let number = |at: UVec2| at.y * size.x + at.x;
        // Not those that would join other charts than before.
        let is_own = |at: &UVec2| {
            let to = small(*at);
            chart.get(to.x, to.y) == self.chart.get(at.x, at.y)
        };
        let ends = |ends: &[u32; 2]| ends.map(|end| UVec2::new(end % from.x, end / from.x));
        let links = self.links.iter().map(ends).filter(|ends| ends.iter().all(is_own));
        let mut links: Vec<[u32; 2]> = links.map(|ends| ends.map(|at| number(small(at)))).collect();
        links.retain(|ends| ends[0] != ends[1]);
        links.sort_unstable();
        links.dedup();
        let mut parted = apart(&chart).unwrap_or_else(|_| Grid::new(size, 0));
        for (y, x) in (0..from.y).flat_map(|y| (0..from.x).map(move |x| (y, x))) {
            let at = UVec2::new(x, y);
            for (bit, next) in [(RIGHT, at + UVec2::X), (DOWN, at + UVec2::Y)] {
                let (to, next) = (small(at), small(next.min(from - 1)));
                if to != next && self.apart.get(x, y).is_some_and(|bits| bits & bit != 0) {
                    parted.row_mut(to.y as usize)[to.x as usize] |= bit;
                }
            }
        }
        let unit = self.frame.texels_per_unit() * scale;
        let frame = SurfaceFrame::with_unit(size, unit).unwrap_or(self.frame);
        let margin = (self.margin as f32 * scale).round().max(1.0) as i32;
        Self { frame, chart, apart: parted, margin, links }
    }
}
