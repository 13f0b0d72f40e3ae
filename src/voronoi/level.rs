//! One generation of regions: [`Level`].

use super::{
    lattice::{Lattice, UNIT, WALL},
    search::{Packed, Search},
};
use glam::UVec2;

/// Paths in the number type that the map needs.
#[derive(Clone, Debug)]
enum Paths {
    Narrow(Search<i32>),
    Wide(Search<i64>),
}

/// A search from the first sites, and its result.
#[derive(Clone, Debug)]
pub(super) struct Level {
    paths: Paths,
    n_sites: usize,
    /// Whether there are edges that cannot be crossed.
    walls: bool,
}

/// Calls a method of the search, for either number type.
macro_rules! paths {
    ($paths:expr, $search:ident => $call:expr) => {
        match $paths {
            Paths::Narrow($search) => $call,
            Paths::Wide($search) => $call,
        }
    };
}

impl Level {
    /// A level that starts with `sites`; more can be added, up to `most`.
    pub(super) fn new(size: UVec2, sites: &[UVec2], most: usize, walls: bool) -> Self {
        let paths = if most <= <i32 as Packed>::MAX_SITES {
            Paths::Narrow(Search::new(size))
        } else {
            Paths::Wide(Search::new(size))
        };
        let mut level = Self { paths, n_sites: 0, walls };
        level.add_sites(sites);
        level
    }

    /// Whether a texel belongs to a region.
    pub(super) fn is_reached(&self, texel: usize) -> bool {
        paths!(&self.paths, search => search.is_reached(texel))
    }

    /// Adds sites after the existing ones.
    pub(super) fn add_sites(&mut self, sites: &[UVec2]) {
        for (i, &site) in (self.n_sites as u32..).zip(sites) {
            paths!(&mut self.paths, search => search.add_site(site, i));
        }
        self.n_sites += sites.len();
    }

    pub(super) const fn has_walls(&self) -> bool {
        self.walls
    }

    pub(super) const fn n_sites(&self) -> usize {
        self.n_sites
    }

    /// Sweeps up to `rows` rows; returns whether there is more to do.
    ///
    /// `sites` are those it was made with.
    pub(super) fn advance(&mut self, lattice: &Lattice, sites: &[UVec2], rows: usize) -> bool {
        let walls = self.walls;
        paths!(&mut self.paths, search => {
            if walls { search.advance::<true>(lattice, rows) } else { search.advance::<false>(lattice, rows) }
        });
        if !self.at_rest() {
            return true;
        }
        // A cost did not fit: start again with larger numbers.
        if self.n_sites > 0
            && let Paths::Narrow(search) = &mut self.paths
            && search.overflows(lattice)
        {
            self.paths = Paths::Wide(Search::new(lattice.size()));
            self.n_sites = 0;
            self.add_sites(sites);
            return true;
        }
        false
    }

    pub(super) fn at_rest(&self) -> bool {
        paths!(&self.paths, search => search.at_rest())
    }

    pub(super) fn progress(&self) -> f32 {
        paths!(&self.paths, search => search.progress())
    }

    /// Overwrites the costs of edges, see [`Search::take_over`].
    pub(super) fn take_over(&mut self, edges: &mut [u16], new: &[u16], x0: usize, y: usize, down: bool) -> usize {
        paths!(&mut self.paths, search => search.take_over(edges, new, x0, y, down))
    }

    /// After edges have changed, see [`Search::reconsider`].
    pub(super) fn reconsider(&mut self, lattice: &Lattice) {
        paths!(&mut self.paths, search => search.reconsider(lattice));
    }

    /// The region of a texel. There must be sites.
    #[inline(always)]
    pub(super) fn region(&self, texel: usize) -> u32 {
        paths!(&self.paths, search => search.field()[texel].index())
    }

    /// Regions of row `y`.
    pub(super) fn fill_regions(&self, y: usize, out: &mut [u32]) {
        let texels = y * out.len()..(y + 1) * out.len();
        paths!(&self.paths, search => {
            for (out, p) in out.iter_mut().zip(&search.field()[texels]) {
                *out = p.index();
            }
        });
    }

    /// Path cost in units.
    pub(super) fn units(&self, texel: usize) -> u64 {
        paths!(&self.paths, search => search.field()[texel].cost())
    }

    /// Path cost in β.
    pub(super) fn cost(&self, texel: usize) -> f32 {
        self.units(texel) as f32 / f32::from(UNIT)
    }

    /// Puts walls into the links of `lattice` between the regions of this level.
    pub(super) fn wall_links(&self, lattice: &mut Lattice) {
        for link in lattice.links_mut() {
            let [a, b] = link.ends.map(|end| self.region(end as usize));
            if a != b {
                link.cost = WALL;
            }
        }
    }

    /// Puts walls between the regions of this level into row `y` of `lattice`.
    pub(super) fn wall_row(&self, lattice: &mut Lattice, y: usize, row: &mut [u32], below: &mut [u32]) {
        self.fill_regions(y, row);
        for (edge, pair) in lattice.across_mut(y).iter_mut().zip(row.windows(2)) {
            if pair[0] != pair[1] {
                *edge = WALL;
            }
        }
        if y + 1 < lattice.size().y as usize {
            self.fill_regions(y + 1, below);
            for ((edge, a), b) in lattice.down_mut(y).iter_mut().zip(row.iter()).zip(below.iter()) {
                if a != b {
                    *edge = WALL;
                }
            }
        }
    }
}
