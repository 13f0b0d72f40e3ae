//! An upper bound for the size of a growth.

use super::{
    arrest, closed, divide, field,
    params::{GrowthParams, MarkerLayout, PROGRESS, Venation},
    plan, rays,
};

/// The most points of the strands of a hit, with those of their primitives, in all rounds.
const MOST_POINTS: u64 = 1 << 22;

impl GrowthParams {
    /// The largest number of nodes that `markers` markers and `starts` starts can create: growth ends by itself
    /// within as many steps.
    ///
    /// Each new node either reaches a marker or brings one closer by at least `D²/4` of squared distance, and no
    /// marker is further than [`crack_radius`](Self::crack_radius) from the node that it attracts. With closed
    /// venation a marker attracts at most six nodes at once, for at most twice as many steps. With arrest a marker
    /// counts for each time that it can be given up, and every node can be a tip that runs on and breaks through the
    /// crack at which it ends. With nucleation every marker can be a start. Each node can fork. Strands have a largest
    /// number of points. The largest number there is stands for all above it.
    ///
    /// ```
    /// use bevy_crack::growth::GrowthParams;
    ///
    /// // Steps of 0.02 towards markers that attract over 0.2: 2 + 100 / 0.25 nodes for each, at most.
    /// assert_eq!(GrowthParams::DEFAULT.most_nodes(10, 1), 1 + 10 * 402);
    /// ```
    #[must_use]
    pub fn most_nodes(&self, markers: u64, starts: u64) -> u64 {
        let approaches = ((self.crack_radius / self.step_length).powi(2) / PROGRESS).ceil() as u64;
        let mut births = markers.saturating_mul(approaches.saturating_add(2));
        if self.strands().is_some() {
            births = births.saturating_add(starts.saturating_mul(MOST_POINTS));
        }
        if self.venation == Venation::Closed {
            births = markers.saturating_mul(6 * u64::from(closed::patience(self)));
        }
        if matches!(self.markers, MarkerLayout::Rays { .. }) {
            // A first node, and one line for each ring.
            let chord = u64::from(rays::chord_steps(plan::LONGEST_CHORD, self.step_length));
            births = births.saturating_add(markers.saturating_mul(1 + u64::from(plan::MOST_RINGS) * chord));
        }
        let own_starts = if self.nucleation > 0.0 || self.venation == Venation::Subdivision { markers } else { 0 };
        let starts = starts.saturating_add(own_starts);
        if self.venation == Venation::Subdivision {
            // Each start has two tips, which may run straight on.
            births = births.saturating_add(starts.saturating_mul(2 * (1 + u64::from(divide::STRAIGHT))));
        }
        if !self.keeps_apart() {
            return starts.saturating_add(births);
        }
        let run = u64::from(arrest::steps_for(self.arrest.max(self.island_distance), self.step_length)) + 4;
        let each = if self.forks > 0.0 { 2 } else { 1 };
        births.saturating_mul(field::MOST_GIVEN_UP.into()).saturating_add(starts).saturating_mul(each * run)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CrackPreset;

    #[test]
    fn bounds_beyond_all_numbers_are_the_largest() {
        for name in CrackPreset::NAMES {
            let mut params = CrackPreset::named(name).unwrap().growth;
            for venation in [params.venation, Venation::Closed, Venation::Subdivision] {
                params.venation = venation;
                for (markers, starts) in [(u64::MAX, u64::MAX), (u64::MAX, 0), (u64::MAX / 3, 7)] {
                    assert_eq!(params.most_nodes(markers, starts), u64::MAX, "{name}");
                }
                assert!(params.most_nodes(0, u64::MAX) == u64::MAX && params.most_nodes(1000, 9) < 1 << 50, "{name}");
            }
        }
    }
}
