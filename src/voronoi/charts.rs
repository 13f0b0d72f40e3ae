//! Maps of surfaces that are laid out in parts: [`MapCharts`].

use super::{
    VoronoiError,
    lattice::{Lattice, WALL},
};
use crate::{Grid, pattern::SurfaceFrame};
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
    margin: i32,
    links: Vec<[u32; 2]>,
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
        Ok(Self { frame, chart, margin, links })
    }

    pub(super) const fn frame(&self) -> &SurfaceFrame {
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

    /// Whether a texel shows some of the surface.
    pub(super) fn is_surface(&self, texel: UVec2) -> bool {
        self.chart.get(texel.x, texel.y).is_some_and(|chart| chart != Self::NOTHING)
    }

    /// Whether a texel lies within the border of its chart: not in its margin, nor beside all charts.
    #[must_use]
    pub fn is_inside(&self, texel: UVec2) -> bool {
        let (at, own) = (texel.as_ivec2(), self.at(texel.as_ivec2()));
        let around = [IVec2::X, IVec2::Y, IVec2::NEG_X, IVec2::NEG_Y];
        own != Self::NOTHING && around.into_iter().all(|way| self.at(at + self.margin * way) == own)
    }

    /// Whether the four texels that meet in a corner belong to one chart.
    pub(super) fn is_whole(&self, corner: IVec2) -> bool {
        let own = self.at(corner);
        let others = [IVec2::NEG_X, IVec2::NEG_Y, IVec2::NEG_ONE];
        own != Self::NOTHING && others.into_iter().all(|way| self.at(corner + way) == own)
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

    /// For texels from `x0` on of row `y`: whether the next one, to the right or `down`, is of another chart; those that have none are left out.
    fn apart(&self, y: usize, x0: usize, down: bool) -> impl Iterator<Item = bool> + '_ {
        let row = &self.chart.row(y)[x0..];
        let next = match down {
            false => row.get(1..).unwrap_or_default(),
            true if y + 1 < self.chart.height() => &self.chart.row(y + 1)[x0..],
            true => &[],
        };
        row.iter().zip(next).map(|(a, b)| a != b || *a == Self::NOTHING)
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
        let texel = |number: u32| UVec2::new(number % from.x, number / from.x) * size / from;
        let number = |at: UVec2| at.y * size.x + at.x;
        let mut links: Vec<[u32; 2]> = self.links.iter().map(|ends| ends.map(|end| number(texel(end)))).collect();
        links.sort_unstable();
        links.dedup();
        let is_there = |end: &u32| chart.as_slice()[*end as usize] != Self::NOTHING;
        links.retain(|ends| ends[0] != ends[1] && ends.iter().all(is_there));
        let unit = self.frame.texels_per_unit() * scale;
        let frame = SurfaceFrame::with_unit(size, unit).unwrap_or(self.frame);
        Self { frame, chart, margin: (self.margin as f32 * scale).round().max(1.0) as i32, links }
    }
}
