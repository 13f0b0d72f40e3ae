//! The settings of materials.

use super::{
    material::Material,
    params::{Propagation, StrandParams},
};

impl StrandParams {
    /// Asphalt: jagged cracks of uneven width, with medium rotation and inertia.
    pub const ASPHALT: Self = Self {
        frequency: 4.0,
        rotation: 0.4,
        inertia: 0.6,
        propagation: Propagation::Continuous,
        length: 2.0,
        depth: 2,
        children: 1,
        branch_cost: 0.3,
        child_frequency: 7.0,
        child_length: 0.4,
        child_width: 0.6,
        spread: 0.08,
        repulsion: 0.035,
        width: 0.007,
        tile: 0.13,
        sideways: 1.0,
        ..Self::DEFAULT
    };

    /// Marble: thin, sharp cracks that change their direction often; higher rotation, low inertia.
    pub const MARBLE: Self = Self {
        frequency: 9.0,
        rotation: 0.55,
        inertia: 0.15,
        propagation: Propagation::Continuous,
        length: 1.8,
        depth: 2,
        children: 2,
        branch_cost: 0.32,
        child_frequency: 12.0,
        child_length: 0.35,
        child_width: 0.7,
        spread: 0.05,
        repulsion: 0.025,
        width: 0.0035,
        tile: 0.1,
        material: Material::Marble,
        ..Self::DEFAULT
    };

    /// Sand: thick, rugged cracks that hardly turn; low rotation, high inertia.
    pub const SAND: Self = Self {
        frequency: 3.0,
        rotation: 0.25,
        inertia: 0.9,
        propagation: Propagation::Continuous,
        length: 1.6,
        depth: 1,
        children: 1,
        branch_cost: 0.45,
        child_frequency: 5.0,
        child_length: 0.5,
        child_width: 0.55,
        spread: 0.12,
        repulsion: 0.06,
        width: 0.024,
        tile: 0.2,
        sideways: 1.0,
        pace: 0.008,
        material: Material::Sand,
        ..Self::DEFAULT
    };

    /// The same material at another scale: every length times `by`, clamped to its range. `by` is clamped to 0.01..=100;
    /// NaN counts as 1.
    ///
    /// ```
    /// use bevy_crack::strands::StrandParams;
    ///
    /// let near = StrandParams::MARBLE.scaled(2.0);
    /// assert_eq!(near.length, 2.0 * StrandParams::MARBLE.length);
    /// assert_eq!(near.validate(), Ok(()));
    /// ```
    #[must_use]
    pub fn scaled(&self, by: f32) -> Self {
        let by = if by.is_nan() { 1.0 } else { by.clamp(0.01, 100.0) };
        Self {
            frequency: (self.frequency / by).min(256.0),
            child_frequency: (self.child_frequency / by).min(256.0),
            length: (self.length * by).clamp(0.001, 64.0),
            step: (self.step * by).clamp(0.0001, 0.05),
            branch_cost: (self.branch_cost * by).clamp(0.005, 64.0),
            repulsion: (self.repulsion * by).min(0.5),
            width: (self.width * by).min(0.2),
            tile: (self.tile * by).clamp(0.01, 1.0),
            pace: (self.pace * by).clamp(0.0005, 1.0),
            ..*self
        }
    }
}
