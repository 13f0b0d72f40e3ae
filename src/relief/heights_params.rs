//! The settings of heights: [`HeightParams`].

use super::error::ReliefError;

macro_rules! params {
    ($($(#[doc = $doc:literal])* $name:ident = $default:expr, $min:expr, $max:expr;)*) => {
        /// How contour lines become heights.
        ///
        /// Heights and lengths are in pattern units: the surface's shorter side is 1.
        ///
        /// ```
        /// use bevy_crack::relief::HeightParams;
        ///
        /// let params = HeightParams { step: 0.02, ..HeightParams::DEFAULT };
        /// assert_eq!(params.validate(), Ok(()));
        /// let error = HeightParams { summit: 2.0, ..params }.validate().unwrap_err();
        /// assert_eq!(error.to_string(), "`summit` is 2, must lie in 0..=1");
        /// // From text, as in a console.
        /// let mut params = params;
        /// params.set("step", "0.05")?;
        /// assert_eq!(params.step, 0.05);
        /// # Ok::<(), bevy_crack::relief::ReliefError>(())
        /// ```
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
        pub struct HeightParams {
            $($(#[doc = $doc])* pub $name: f32,)*
        }

        impl HeightParams {
            /// The default: even slopes without terraces.
            pub const DEFAULT: Self = Self { $($name: $default,)* };

            /// Checks every number against its range.
            ///
            /// # Errors
            /// [`ReliefError::OutOfRange`] for the first number that is out of its range or not finite.
            pub fn validate(&self) -> Result<(), ReliefError> {
                let ranges = [$((stringify!($name), self.$name, $min, $max)),*];
                match ranges.into_iter().find(|(_, value, min, max)| !(*min..=*max).contains(value)) {
                    Some((name, value, min, max)) => Err(ReliefError::OutOfRange { name, value, min, max }),
                    None => Ok(()),
                }
            }

            /// Sets the number `name` from text, as in `step` and `0.02`.
            ///
            /// # Errors
            /// [`ReliefError::Unknown`] if there is no such number, [`ReliefError::Unreadable`] if the text is not its
            /// value, [`ReliefError::OutOfRange`] if it is out of its range; nothing changes then.
            pub fn set(&mut self, name: &str, text: &str) -> Result<(), ReliefError> {
                let unreadable = || ReliefError::Unreadable { name: name.into(), text: text.into() };
                let mut changed = *self;
                match name {
                    $(stringify!($name) => changed.$name = text.trim().parse().map_err(|_| unreadable())?,)*
                    _ => return Err(ReliefError::Unknown { name: name.into() }),
                }
                changed.validate()?;
                *self = changed;
                Ok(())
            }
        }
    };
}

params! {
    /// Height from a level to the next: level `k` lies at `k * step`. 0.0001..=4; default 0.03.
    step = 0.03, 0.0001, 4.0;
    /// How much the heights of levels deviate from even steps, as a share of the step. 0..=0.9; default 0.
    variation = 0.0, 0.0, 0.9;
    /// How much lower each step above level 0 is than the one below it, as a share of that: 0 = all are equal. The higher, the
    /// flatter the top. 0..=0.95; default 0.
    taper = 0.0, 0.0, 0.95;
    /// How round summits are: 0 = they rise to a point or an edge, 1 = they level out. 0..=1; default 0.5.
    summit = 0.5, 0.0, 1.0;
    /// How far the ground falls outside of the lowest level, in steps; it levels out. 0 = flat. 0..=64; default 1.
    floor = 1.0, 0.0, 64.0;
    /// How much the ground between two rings becomes a terrace: 0 = an even slope, 1 = flat ground above a ring, then a
    /// wall up to the next. 0..=1; default 0.
    terraces = 0.0, 0.0, 1.0;
    /// Share of the ground between two rings that is the flat part of a terrace or lies below a cliff. 0..=0.95;
    /// default 0.6.
    tread = 0.6, 0.0, 0.95;
    /// How round the edges of terraces and cliffs are. 0..=1; default 0.5.
    roundness = 0.5, 0.0, 1.0;
    /// Share of the surface, by noise, where the ground between two rings is a cliff, terraces or not. 0..=1; default 0.
    cliffs = 0.0, 0.0, 1.0;
    /// How uneven the ground between rings is. It stays between their heights; above 0 it may fall and rise again on the way up. 0..=1;
    /// default 0.
    roughness = 0.0, 0.0, 1.0;
    /// Size of the largest features of the noise of roughness and cliffs. 0.005..=4; default 0.12.
    noise_scale = 0.12, 0.005, 4.0;
}

impl Default for HeightParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}
