//! Lays out markers, at once or in slices; the result does not depend on the size of the slices.

use super::{
    cursor::Cursor,
    layout::{Darts, Keeper, Layout, Stress},
    markers,
    params::{GrowthParams, MAX_MARKERS, MarkerLayout},
    region::{Region, spacing},
    state::CrackGrowth,
};

/// The smallest number of nodes for which memory is reserved.
const FEW_NODES: usize = 64;

/// Above this number of nodes memory for markers is prepared in advance.
const MANY_NODES: usize = 4096;

/// Reserving memory for this many nodes costs as much as one place.
const ROOM: u32 = 16;

impl CrackGrowth {
    /// Prepares the layout of an impact for `region`.
    pub(super) fn begin_layout(&mut self, region: Region, (impact, owner): (u32, u32), seed: u64) {
        let mut darts = None;
        let stress = self.division.is_some().then(|| {
            self.field.settle(&self.network.nodes, &self.nodes);
            let apart = 0.5 * spacing(&self.params, region.extent);
            Stress { region, seed: self.seed ^ u64::from(impact), apart }
        });
        if let MarkerLayout::DartThrowing { spacing } = self.params.markers {
            // Darts also keep their distance from the markers of hits that no step has processed yet.
            self.field.settle(&self.network.nodes, &self.nodes);
            let others = (self.field.made_settled(), self.network.nodes.len());
            darts = Some(Box::new(Darts::new(&region, spacing, self.mask.is_empty(), others)));
        }
        self.layout =
            Some(Box::new(Layout { region, seed, owner, cursor: Cursor::default(), darts, stress, room: None }));
    }

    /// Continues to lay out the markers of a hit that was [begun](Self::begin_hit), at up to about `places` places.
    /// Returns whether some are left. For [strands](super::MarkerLayout::Strands) about a quarter as many points are laid out. 0 counts
    /// as 1.
    ///
    /// The positions of markers do not depend on the slices. All other methods that change the growth complete the layout first.
    pub fn continue_hit(&mut self, places: u32) -> bool {
        if self.try_strands(places) {
            return true;
        }
        let Some(mut layout) = self.layout.take() else { return false };
        layout.cursor.left = places.max(1);
        if layout.room.is_none() && self.lay_out_markers(&mut layout) {
            layout.room = Some(0);
        }
        let is_left = !layout.room.as_mut().is_some_and(|room| self.reserve_nodes(room, &mut layout.cursor));
        self.layout = is_left.then_some(layout);
        is_left
    }

    /// Lays out markers up to the limit of the slice. Returns whether those were the last ones.
    fn lay_out_markers(&mut self, layout: &mut Layout) -> bool {
        let Layout { region, seed, owner, cursor, darts, stress, .. } = layout;
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
            owner: *owner,
            darts: darts.as_deref_mut(),
            stress: *stress,
        };
        let wishes = (self.density.as_ref(), &*self.mask);
        // A full field accepts no more markers.
        let is_full = keeper.field.living_at_most() >= MAX_MARKERS;
        is_full || markers::lay_out(&self.params, *region, wishes, *seed, cursor, &mut keeper)
    }

    /// Reserves memory for about two nodes per marker, one array after the other, so that no step pauses to move them
    /// all. Returns whether all are done.
    fn reserve_nodes(&mut self, next: &mut u32, cursor: &mut Cursor) -> bool {
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

    /// Processes the markers of hits, up to about `markers` of them, before the next [`step`](Self::step), which
    /// processes all that are left. Returns whether none are left. 0 counts as 1.
    ///
    /// The result of the growth does not depend on the slices.
    ///
    /// ```
    /// use bevy_crack::growth::{CrackGrowth, GrowthParams};
    ///
    /// let mut growth = CrackGrowth::new(GrowthParams::DEFAULT, [1.0, 1.0].into(), 7)?;
    /// growth.begin_hit([0.5, 0.5].into(), 1.0);
    /// // One slice per frame.
    /// while !growth.prepare_step(64) {}
    /// assert!(growth.step().grew());
    /// # Ok::<(), bevy_crack::growth::ParamError>(())
    /// ```
    pub fn prepare_step(&mut self, markers: u32) -> bool {
        !self.continue_hit(markers) && self.field.settle_some(&self.network.nodes, &self.nodes, markers)
    }

    /// Whether [`prepare_step`](Self::prepare_step) has begun and is not done. A hit would complete it at once.
    #[cfg_attr(not(feature = "bevy"), expect(dead_code, reason = "surfaces of the plugin are hit"))]
    pub(crate) fn is_preparing(&self) -> bool {
        self.is_laying_out() || self.field.is_settling()
    }

    /// Whether markers or strands of a hit are still to be laid out.
    #[must_use]
    pub fn is_laying_out(&self) -> bool {
        self.layout.is_some() || !self.orders.is_empty()
    }

    /// Completes a step that was begun, lays out the remaining markers, and settles them if settling has begun.
    pub(super) fn finish(&mut self) {
        self.finish_step();
        while self.continue_hit(1 << 16) {}
        if self.field.is_settling() {
            self.field.settle(&self.network.nodes, &self.nodes);
        }
    }
}
