//! A layout of markers under way: a hit may lay its markers out in slices, and they are the same however large those are.

use super::{
    cursor::Cursor,
    layout::{Darts, Keeper, Layout, Stress},
    markers,
    params::{GrowthParams, MAX_MARKERS, MarkerLayout},
    region::{Region, spacing},
    state::CrackGrowth,
};

/// The fewest nodes that a layout makes room for.
const FEW_NODES: usize = 64;

/// For more than so many markers are given room in good time.
const MANY_NODES: usize = 4096;

/// Room for so many nodes costs as much as a place.
const ROOM: u32 = 16;

impl CrackGrowth {
    /// Prepares the layout of an impact for `region`.
    pub(super) fn begin_layout(&mut self, region: Region, (impact, loyal): (u32, u32), seed: u64) {
        let mut darts = None;
        let stress = self.division.is_some().then(|| {
            self.field.settle(&self.network.nodes, &self.nodes);
            let apart = 0.5 * spacing(&self.params, region.extent);
            Stress { region, seed: self.seed ^ u64::from(impact), apart }
        });
        if let MarkerLayout::DartThrowing { spacing } = self.params.markers {
            // Darts keep their distance from the markers of hits that no step has taken up yet, too.
            self.field.settle(&self.network.nodes, &self.nodes);
            let others = (self.field.made_settled(), self.network.nodes.len());
            darts = Some(Box::new(Darts::new(&region, spacing, self.mask.is_empty(), others)));
        }
        self.layout =
            Some(Box::new(Layout { region, seed, loyal, cursor: Cursor::default(), darts, stress, room: None }));
    }

    /// Goes on laying out the markers of a hit that was [begun](Self::begin_hit), at up to about `places` places. Returns whether some are left.
    ///
    /// Where markers come to lie does not depend on the slices. Whatever else is asked of the growth does what is left first.
    pub fn lay_out(&mut self, places: u32) -> bool {
        let Some(mut layout) = self.layout.take() else { return false };
        layout.cursor.left = places;
        if layout.room.is_none() && self.lay_out_markers(&mut layout) {
            layout.room = Some(0);
        }
        let is_left = !layout.room.as_mut().is_some_and(|room| self.make_room(room, &mut layout.cursor));
        self.layout = is_left.then_some(layout);
        is_left
    }

    /// Lays out markers as far as the slice goes. Returns whether those were the last ones.
    fn lay_out_markers(&mut self, layout: &mut Layout) -> bool {
        let Layout { region, seed, loyal, cursor, darts, stress, .. } = layout;
        if let Some(darts) = darts {
            let (count, markers) = (darts.others.len().min(cursor.left as usize), darts.index.markers);
            for _ in 0..count {
                let other = darts.others.start;
                let is_marker = other < markers as usize;
                let node = || self.network.nodes[other - markers as usize].pos;
                darts.push(if is_marker { self.field.marker(other as u32).pos } else { node() });
                darts.others.start += 1;
            }
            cursor.left -= count as u32;
            if !darts.others.is_empty() {
                return false;
            }
        }
        let GrowthParams { draw_markers, line_width, .. } = self.params;
        let mut keeper = Keeper {
            field: &mut self.field,
            shown: draw_markers.then_some((&mut self.shown_markers, &mut self.timeline, line_width)),
            loyal: *loyal,
            darts: darts.as_deref_mut(),
            stress: *stress,
        };
        let wishes = (self.density.as_ref(), &*self.mask);
        // A full field takes none of those that are left.
        let is_full = keeper.field.living_at_most() >= MAX_MARKERS;
        is_full || markers::lay_out(&self.params, *region, wishes, *seed, cursor, &mut keeper)
    }

    /// A large growth makes about two nodes a marker: room for them now, one kind after the other, so that no step pauses to move them
    /// all. Returns whether there is room for all.
    fn make_room(&mut self, next: &mut u32, cursor: &mut Cursor) -> bool {
        let more = (2 * self.field.living_at_most()).max(FEW_NODES).min(self.room());
        while cursor.left > 0 {
            match *next {
                0 if more > MANY_NODES => self.field.reserve(),
                1 => self.network.nodes.reserve(more),
                2 => self.nodes.reserve(more),
                3 => self.widths.reserve(more),
                4 => self.pull_of.reserve(more),
                5 => self.courses.reserve(more),
                6 => self.changes.reserve(more),
                7 => self.timeline.reserve(more),
                8 => self.arrest.iter_mut().for_each(|arrest| arrest.reserve(more)),
                0 => {}
                _ => return true,
            }
            *next += 1;
            cursor.left = cursor.left.saturating_sub(more as u32 / ROOM);
        }
        false
    }

    /// Takes up the markers of hits, up to about so many of them, before the next [`step`](Self::step), which takes up all that are left. Returns
    /// whether it has only to grow.
    ///
    /// What grows does not depend on the slices.
    pub fn prepare_step(&mut self, markers: u32) -> bool {
        !self.lay_out(markers) && self.field.settle_some(&self.network.nodes, &self.nodes, markers)
    }

    /// Whether [`prepare_step`](Self::prepare_step) has begun and is not done. A hit would do the rest of it at once.
    #[cfg_attr(not(feature = "bevy"), expect(dead_code, reason = "surfaces of the plugin are hit"))]
    pub(crate) const fn is_preparing(&self) -> bool {
        self.layout.is_some() || self.field.is_settling()
    }

    /// Whether markers of a hit are still to be laid out.
    #[must_use]
    pub const fn is_laying_out(&self) -> bool {
        self.layout.is_some()
    }

    /// Lays out what is left, and has it settle if it has begun to.
    pub(super) fn finish_layout(&mut self) {
        while self.lay_out(1 << 16) {}
        if self.field.is_settling() {
            self.field.settle(&self.network.nodes, &self.nodes);
        }
    }
}
