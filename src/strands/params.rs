//! The settings of strands: [`StrandParams`], [`Propagation`].

use super::{error::StrandError, material::Material};

/// How a path turns the directions of the field into moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Propagation {
    /// Moves in the four directions of a lattice, by propagation costs (section 3.2 of the paper).
    ///
    /// Every direction `d` has a cost, 1 at the start. A step at a place with the field direction `v` is
    /// `C_d <- C_d - (1 - inertia) <v, d>`, then a move in the direction of least cost, whose cost rises by 1. Ties go
    /// to the first of north, east, south and west.
    Costs,
    /// Moves in any direction: a step turns the heading `h` to `inertia h + (1 - inertia) v`.
    ///
    /// The paper describes it as the ideal that the lattice approximates.
    Continuous,
}

macro_rules! params {
    ($($(#[doc = $doc:literal])* $name:ident: $kind:ty = $default:expr, $min:expr, $max:expr;)*) => {
        /// All settings of strands except field, starts, primitives and seed.
        ///
        /// Lengths are in pattern units: the surface's shorter side is 1.
        ///
        /// ```
        /// use bevy_crack::strands::StrandParams;
        ///
        /// let params = StrandParams { frequency: 12.0, ..StrandParams::ASPHALT };
        /// assert_eq!(params.validate(), Ok(()));
        /// let error = StrandParams { inertia: 2.0, ..params }.validate().unwrap_err();
        /// assert_eq!(error.to_string(), "`inertia` is 2, must lie in 0..=1");
        /// // From text, as in a console.
        /// let mut params = params;
        /// params.set("inertia", "0.7")?;
        /// assert_eq!(params.inertia, 0.7);
        /// # Ok::<(), bevy_crack::strands::StrandError>(())
        /// ```
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
        pub struct StrandParams {
            $($(#[doc = $doc])* pub $name: $kind,)*
            /// How paths follow the field; default [`Propagation::Costs`].
            pub propagation: Propagation,
            /// The shipped library from which primitives are taken if none are given; default [`Material::Asphalt`].
            pub material: Material,
        }

        impl StrandParams {
            /// The default: single strands as in the paper.
            pub const DEFAULT: Self =
                Self { $($name: $default,)* propagation: Propagation::Costs, material: Material::Asphalt };

            /// Checks every number against its range.
            ///
            /// # Errors
            /// [`StrandError::OutOfRange`] for the first number that is out of its range or not finite.
            pub fn validate(&self) -> Result<(), StrandError> {
                let ranges = [$((stringify!($name), self.$name as f32, $min, $max)),*];
                match ranges.into_iter().find(|(_, value, min, max)| !(*min..=*max).contains(value)) {
                    Some((name, value, min, max)) => Err(StrandError::OutOfRange { name, value, min, max }),
                    None => Ok(()),
                }
            }

            /// The first number that is out of its range, with its name behind `strands.` and its range.
            pub(crate) fn out_of_range(&self) -> Option<(&'static str, f32, f32, f32)> {
                let ranges = [$((concat!("strands.", stringify!($name)), self.$name as f32, $min, $max)),*];
                ranges.into_iter().find(|(_, value, min, max)| !(*min..=*max).contains(value))
            }

            /// Sets the number `name` from text, as in `inertia` and `0.5`.
            ///
            /// # Errors
            /// [`StrandError::Unknown`] if there is no such number, [`StrandError::Unreadable`] if the text is not its
            /// value, [`StrandError::OutOfRange`] if it is out of its range; nothing changes then.
            pub fn set(&mut self, name: &str, text: &str) -> Result<(), StrandError> {
                let unreadable = || StrandError::Unreadable { name: name.into(), text: text.into() };
                let mut changed = *self;
                match name {
                    $(stringify!($name) => changed.$name = text.trim().parse().map_err(|_| unreadable())?,)*
                    _ => return Err(StrandError::Unknown { name: name.into() }),
                }
                changed.validate()?;
                *self = changed;
                Ok(())
            }
        }
    };
}

params! {
    /// Frequency of the noise that turns the field: cells of Perlin noise per pattern unit. 0..=256; default 6.
    frequency: f32 = 6.0, 0.0, 256.0;
    /// Rotation coefficient `c`: noise turns a direction by up to this share of 180 degrees. 0..=1; default 0.5.
    rotation: f32 = 0.5, 0.0, 1.0;
    /// Inertia coefficient: how little a step of a path yields to the field. 0..=1; default 0.4.
    inertia: f32 = 0.4, 0.0, 1.0;
    /// Length at which a strand ends. 0.001..=64; default 1.5.
    length: f32 = 1.5, 0.001, 64.0;
    /// Length of one step of a path, and side of a lattice cell. 0.0001..=0.05; default 1/512.
    step: f32 = 1.0 / 512.0, 0.0001, 0.05;
    /// How many times branches branch: 0 = none, 1 = only the strands that start by themselves. 0..=3; default 0.
    depth: u32 = 0, 0.0, 3.0;
    /// Number of children at a joint, on one side or on both. 1..=2; default 2.
    children: u32 = 2, 1.0, 2.0;
    /// Branch cost: length after which a strand branches at its next joint, on average. 0.005..=64; default 0.35.
    branch_cost: f32 = 0.35, 0.005, 64.0;
    /// How much noise varies the rate at which the branch cost runs down. 0..=1; default 0.8.
    branch_noise: f32 = 0.8, 0.0, 1.0;
    /// Frequency of the noise of the children's field. 0..=256; default 9.
    child_frequency: f32 = 9.0, 0.0, 256.0;
    /// Length of a child as a share of its parent's. 0..=1; default 0.45.
    child_length: f32 = 0.45, 0.0, 1.0;
    /// Width of a child as a share of its parent's. 0..=1; default 0.6.
    child_width: f32 = 0.6, 0.0, 1.0;
    /// How far a child is driven across its parent before it follows the field alone: its costs begin lower in that
    /// direction. 0..=1; default 0.06.
    spread: f32 = 0.06, 0.0, 1.0;
    /// Distance that strands keep from each other unless they join. 0 = they do not know of each other, as in the
    /// paper. 0..=0.5; default 0.03.
    repulsion: f32 = 0.03, 0.0, 0.5;
    /// Width of a strand that starts by itself, where it is widest. 0..=0.2; default 0.008.
    width: f32 = 0.008, 0.0, 0.2;
    /// How much a strand narrows towards a free end: 0 = not at all, 1 = to a point, more = earlier. 0..=4; default 1.
    taper: f32 = 1.0, 0.0, 4.0;
    /// Length of a primitive along the path: the distance between joints. 0.01..=1; default 0.12.
    tile: f32 = 0.12, 0.01, 1.0;
    /// How far the lines of primitives deviate sideways, as a share of what their images show. 0..=2; default 1.
    sideways: f32 = 1.0, 0.0, 2.0;
    /// Number of primitives side by side. Above 1 strands are nets, and all primitives need connectors on four sides.
    /// 1..=16; default 1.
    lanes: u32 = 1, 1.0, 16.0;
    /// Length that a strand gains in one step of growth. 0.0005..=1; default 0.012.
    pace: f32 = 0.012, 0.0005, 1.0;
}

impl StrandParams {
    /// Number of steps from joint to joint.
    pub(crate) fn tile_steps(&self) -> u32 {
        ((self.tile / self.step).round() as u32).max(1)
    }
}

impl Default for StrandParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}
