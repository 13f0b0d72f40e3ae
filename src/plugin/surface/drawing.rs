//! [`Drawing`]: what is drawn of the cracks of a surface, before it is painted.

use super::cutouts::Holes;
use super::tile_set::Touched;
use crate::Grid;
use crate::growth::CrackGrowth;
use crate::pattern::CellTracker;
use crate::raster::{DepthField, Profile};
use bevy::prelude::*;
use std::sync::Arc;

/// The depths of a surface.
pub(crate) struct Drawing {
    pub(crate) field: DepthField,
    pub(crate) profile: Profile,
    /// Tiles that a crack has touched.
    pub(crate) touched: Touched,
    /// What it has forgotten and still shows.
    pub(crate) frozen: Option<Frozen>,
    /// Cracks that were carried on when it was cut into shards.
    pub(crate) carried: Vec<Arc<[Vec<Vec2>]>>,
    /// The texels that have left it with shards; `None` = it is whole.
    pub(crate) cutouts: Option<Holes>,
    /// Whether all of it is to be drawn anew: the field is not what is to be shown.
    pub(crate) is_stale: bool,
    /// How often it has been painted.
    pub(crate) painted: u64,
    /// How often all of its cracks have been drawn anew.
    pub(crate) redrawn: u64,
}

impl Drawing {
    pub(crate) fn new(field: DepthField, profile: Profile) -> Self {
        let touched = Touched::new(field.frame.size());
        Self {
            field,
            profile,
            touched,
            frozen: None,
            carried: Vec::new(),
            cutouts: None,
            is_stale: false,
            painted: 0,
            redrawn: 0,
        }
    }
}

/// What a surface has forgotten of its cracks, and still shows.
#[derive(Clone)]
pub(crate) struct Frozen {
    /// All of the picture when they were frozen.
    pub(crate) depth: Arc<Grid<u16>>,
    pub(crate) nodes: u32,
    /// Cells that they closed.
    pub(crate) cells: u32,
}

/// What a growth has forgotten.
pub(crate) struct Forgotten {
    /// Nodes that were removed.
    gone: u32,
    /// The cells of what is left.
    cells: CellTracker,
    /// The same for plates, if there are any.
    plates: Option<CellTracker>,
    /// A picture to write into, if there is none.
    depth: Option<Grid<u16>>,
}

impl Forgotten {
    /// Removes all but the newest nodes of a growth. `size` is that of a picture that is wanted.
    pub(crate) fn of(growth: &mut CrackGrowth, keep: u32, has_plates: bool, size: Option<UVec2>) -> Self {
        let gone = growth.remove_oldest(keep);
        let mut cells = CellTracker::new(growth.network().extent());
        cells.update(growth.network());
        let plates = has_plates.then(|| {
            let mut plates = CellTracker::recording(growth.network().extent());
            plates.follow(growth.network(), growth.timeline());
            plates
        });
        // Of ones: memory that was never written to comes slowly.
        let depth = size.map(|size| Grid::new(size, 1));
        Self { gone, cells, plates, depth }
    }
}

impl Frozen {
    /// Removes all but the newest nodes of a growth that is drawn in `field`, and keeps the picture. `cells` are those of the growth
    /// and, then, of what is left of it. Returns how many nodes were removed, too.
    pub(crate) fn after(
        before: Option<Self>,
        growth: &mut CrackGrowth,
        keep: u32,
        field: &mut DepthField,
        cells: &mut CellTracker,
    ) -> (Self, u32) {
        cells.update(growth.network());
        let forgotten = Forgotten::of(growth, keep, field.has_plates(), None);
        Self::of(before, forgotten, field, cells)
    }

    /// Keeps the picture of a growth that has forgotten some of its nodes. `cells` are those it had before, and then those it has.
    pub(crate) fn of(
        before: Option<Self>,
        forgotten: Forgotten,
        field: &mut DepthField,
        cells: &mut CellTracker,
    ) -> (Self, u32) {
        let Forgotten { gone, cells: left, plates, depth } = forgotten;
        if let Some(plates) = plates {
            field.freeze_plates(plates);
        }
        let (nodes, frozen_cells, picture) =
            before.map_or((0, 0, None), |before| (before.nodes, before.cells, Some(before.depth)));
        let closed = frozen_cells + cells.closed();
        *cells = left;
        let frozen = closed.saturating_sub(cells.closed());
        let picture = picture.and_then(|picture| Arc::try_unwrap(picture).ok()).or(depth);
        let depth = picture.filter(|picture| picture.size() == field.depth.size()).map_or_else(
            || field.depth.clone(),
            |mut picture| {
                picture.as_mut_slice().copy_from_slice(field.depth.as_slice());
                picture
            },
        );
        (Self { depth: Arc::new(depth), nodes: nodes.saturating_add(gone), cells: frozen }, gone)
    }

    /// Draws it into a field of any size.
    pub(crate) fn draw(&self, field: &mut DepthField) {
        let (from, to) = (self.depth.size(), field.depth.size());
        if from == to {
            let depths = field.depth.as_mut_slice().iter_mut().zip(self.depth.as_slice());
            return depths.for_each(|(depth, frozen)| *depth = (*depth).max(*frozen));
        }
        for y in 0..to.y {
            let row = self.depth.row((u64::from(y) * u64::from(from.y) / u64::from(to.y)) as usize);
            for (x, depth) in (0u64..).zip(field.depth.row_mut(y as usize)) {
                let frozen = row.get((x * u64::from(from.x) / u64::from(to.x)) as usize);
                *depth = (*depth).max(frozen.copied().unwrap_or(0));
            }
        }
    }
}
