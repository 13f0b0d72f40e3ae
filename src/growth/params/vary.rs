//! Parameters of the same material at another scale, and with the variety of a seed.

use super::{GrowthParams, MarkerLayout, StartLayout};
use crate::math::{Rng, ops};
use std::f32::consts::FRAC_PI_2;

impl GrowthParams {
    /// The same material at another scale: every length times `by` (above 1 = seen from nearer). Lengths are clamped
    /// to their ranges. `by` is clamped to 0.01..=100; NaN counts as 1.
    ///
    /// ```
    /// use bevy_crack::growth::GrowthParams;
    ///
    /// let near = GrowthParams::DEFAULT.scaled(2.0);
    /// assert_eq!(near.step_length, 2.0 * GrowthParams::DEFAULT.step_length);
    /// near.validate()?;
    /// # Ok::<(), bevy_crack::growth::ParamError>(())
    /// ```
    #[must_use]
    pub fn scaled(&self, by: f32) -> Self {
        let by = if by.is_nan() { 1.0 } else { by.clamp(0.01, 100.0) };
        let mut scaled = self.clone();
        let length = |length: &mut f32, min: f32, max: f32| *length = (*length * by).clamp(min, max);
        length(&mut scaled.step_length, 0.001, 4.0);
        length(&mut scaled.crack_radius, 0.001, 256.0 * scaled.step_length.min(0.125));
        length(&mut scaled.kill_distance, 0.0005, scaled.crack_radius.min(4.0));
        length(&mut scaled.reach, 0.01, 64.0);
        length(&mut scaled.line_width, 0.0005, 0.2);
        length(&mut scaled.max_width, scaled.line_width, 0.4);
        length(&mut scaled.island_distance, 0.0, 1.0);
        length(&mut scaled.arrest, 0.0, 1.0);
        length(&mut scaled.grain, 0.0, 1.0);
        length(&mut scaled.courses, 0.0, 1.0);
        length(&mut scaled.distortion, 0.0, 0.05);
        length(&mut scaled.front, 0.0, 1.0);
        // Number of grid lines on the same surface.
        let count = |count: u32| ((count as f32 / by).round() as u32).clamp(1, 512);
        match &mut scaled.markers {
            MarkerLayout::PseudoGrid { .. } => {
                scaled.num_lines_grid = count(self.num_lines_grid);
                scaled.num_columns_grid = count(self.num_columns_grid);
            }
            MarkerLayout::DartThrowing { spacing } => length(spacing, 0.002, 1.0),
            MarkerLayout::Rays { .. } => {}
            MarkerLayout::Strands { strands, .. } => *strands = strands.scaled(by),
        }
        match &mut scaled.starts {
            StartLayout::Point | StartLayout::Points { .. } | StartLayout::Arms { .. } => {}
            StartLayout::Ring { radius, .. }
            | StartLayout::Crushed { radius, .. }
            | StartLayout::Disc { radius, .. } => length(radius, 0.0, 1.0),
        }
        scaled.nucleation = (self.nucleation / by).min(64.0);
        scaled
    }

    /// The parameters of the surface with this seed, changed at random by [`variety`](Self::variety). The result is
    /// valid if `self` is.
    ///
    /// ```
    /// use bevy_crack::growth::GrowthParams;
    ///
    /// let params = GrowthParams { variety: 0.5, ..GrowthParams::DEFAULT };
    /// assert_ne!(params.varied(1), params.varied(2));
    /// params.varied(1).validate()?;
    /// assert_eq!(GrowthParams::DEFAULT.varied(1), GrowthParams::DEFAULT);
    /// # Ok::<(), bevy_crack::growth::ParamError>(())
    /// ```
    #[must_use]
    pub fn varied(&self, seed: u64) -> Self {
        let mut varied = self.clone();
        if self.variety <= 0.0 {
            return varied;
        }
        let mut rng = Rng::new(seed).stream("variety");
        let [width, rough, stray, spacing, starts, free] =
            [self.variety; 6].map(|variety| ops::exp(variety * 0.35 * (rng.signed() + rng.signed())));
        varied.line_width = (self.line_width * width).clamp(0.0005, 0.2);
        varied.max_width = (self.max_width * width).clamp(varied.line_width, 0.4);
        varied.roughness = (self.roughness * rough).min(0.5);
        varied.wander = (self.wander * stray).min(1.0);
        varied.axis = (self.axis + FRAC_PI_2 * self.variety * rng.signed()).clamp(-7.0, 7.0);
        varied.open_ends = (self.open_ends * free).min(1.0);
        let count = |count: u32, by: f32, most: u32| ((count as f32 * by).round() as u32).clamp(1, most);
        match &mut varied.markers {
            MarkerLayout::PseudoGrid { .. } => {
                varied.num_lines_grid = count(self.num_lines_grid, 1.0 / spacing, 512);
                varied.num_columns_grid = count(self.num_columns_grid, 1.0 / spacing, 512);
            }
            MarkerLayout::DartThrowing { spacing: apart } => {
                *apart = (*apart * spacing).clamp(0.002, 1.0);
                // Markers that are further apart must attract from further away.
                let furthest = (256.0 * self.step_length).min(32.0);
                varied.crack_radius = (self.crack_radius * spacing.max(1.0)).min(furthest).max(self.crack_radius);
            }
            MarkerLayout::Rays { sectors, .. } => {
                *sectors = count(*sectors, 1.0 / spacing, 360);
            }
            MarkerLayout::Strands { .. } => {}
        }
        match &mut varied.starts {
            StartLayout::Point | StartLayout::Arms { .. } => {}
            StartLayout::Points { count: n }
            | StartLayout::Ring { count: n, .. }
            | StartLayout::Crushed { count: n, .. }
            | StartLayout::Disc { count: n, .. } => {
                *n = count(*n, starts, 1024);
            }
        }
        varied
    }
}
