//! Changing a running growth: its parameters, marker density and mask.

use super::{
    division::Division,
    params::{GrowthParams, ParamError},
    state::CrackGrowth,
};
use crate::{Grid, pattern::CrackMask};
use std::sync::Arc;

/// How many cracks have started by themselves after so many steps, if all did that were due.
fn due_after(nucleation: f32, steps: u32) -> u32 {
    (nucleation * steps as f32) as u32
}

impl CrackGrowth {
    /// Counts the cracks as started that were due in the steps since `before`, in which nothing grew here.
    pub(super) fn skip_due_since(&mut self, before: u32) {
        let due = |steps| due_after(self.params.nucleation, steps);
        self.nucleated = self.nucleated.saturating_add(due(self.steps).saturating_sub(due(before)));
    }

    /// Sets where the markers of later hits may be: a probability 0..=1 over the whole surface, at any resolution,
    /// sampled at the nearest cell. `None` = everywhere. Values that are not finite count as 0.
    pub fn set_density(&mut self, density: Option<Grid<f32>>) {
        self.finish();
        self.density = density.filter(|grid| grid.size().min_element() > 0);
    }

    /// Takes over the density of another growth.
    #[cfg(feature = "bevy")]
    pub(crate) fn take_density(&mut self, other: &mut Self) {
        self.density = other.density.take();
    }

    /// Sets where the cracks of later hits and steps prefer to run, avoid to run, and never run. An empty mask treats
    /// the whole surface alike.
    ///
    /// Markers move to the weakest place near them, cracks steer along weak areas and around strong ones, and no line
    /// enters a forbidden texel. A hit on a forbidden texel is [rejected](super::Rejected::Forbidden). Existing
    /// cracks stay as they are.
    pub fn set_mask(&mut self, mask: impl Into<Arc<CrackMask>>) {
        self.finish();
        self.mask = mask.into();
        self.update_arrest();
        self.update_masonry();
    }

    /// Replaces the parameters for later hits and steps. Existing cracks stay, and so do `roughness` and `sway`.
    ///
    /// ```
    /// use bevy_crack::{
    ///     Grid,
    ///     growth::{CrackGrowth, GrowthParams, HitOutcome, Rejected},
    ///     pattern::CrackMask,
    /// };
    ///
    /// let mut growth = CrackGrowth::new(GrowthParams::default(), [1.0, 1.0].into(), 7)?;
    /// // No markers in the right half: no cracks grow there.
    /// growth.set_density(Grid::from_vec([2, 1].into(), vec![1.0, 0.0]));
    /// growth.hit([0.25, 0.5].into(), 1.0);
    /// while growth.step().grew() {}
    /// assert!(growth.network().nodes().iter().all(|node| node.pos.x < 0.55));
    ///
    /// // From now on cracks may be there, but not in the lower half, and they are wider.
    /// growth.set_density(None);
    /// growth.set_mask(CrackMask { forbidden: Some(CrackMask::layer([1, 2].into(), &[0, 255])?), ..CrackMask::default() });
    /// growth.set_params(GrowthParams { line_width: 0.01, ..GrowthParams::default() })?;
    /// assert_eq!(growth.params().line_width, 0.01);
    /// assert_eq!(growth.hit([0.75, 0.75].into(), 1.0), HitOutcome::Rejected(Rejected::Forbidden));
    /// assert_eq!(growth.hit([0.75, 0.25].into(), 1.0), HitOutcome::Started(1));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`ParamError::OutOfRange`] if a parameter is out of its range; nothing changes then.
    pub fn set_params(&mut self, params: GrowthParams) -> Result<(), ParamError> {
        params.validate()?;
        self.finish();
        let params = params.varied(self.seed);
        self.field.set_params(&params);
        self.widths.set_params(&params);
        let division = Division::new(&params).map(|new| self.division.take().unwrap_or(new));
        let begins_alike = division.is_some() == self.divides();
        self.division = division;
        // What was due before is neither made up for nor waited for.
        if params.nucleation != self.params.nucleation || !begins_alike {
            self.nucleated = due_after(params.nucleation, self.steps);
        }
        self.params = params;
        self.update_arrest();
        self.update_masonry();
        Ok(())
    }
}
