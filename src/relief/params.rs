//! The settings of contour lines: [`ReliefParams`], [`Method`], [`Join`].

use super::error::ReliefError;

/// How a contour is made from the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Method {
    /// By shrinking (or growing) alone (section 3 of the paper). Shapes become simpler from level to level.
    Simple,
    /// Long edges of the shrunk contour get displaced midpoints (section 4.1).
    Midpoint,
    /// High frequencies of the shrunk contour get phases drawn at random (section 4.2).
    Fourier,
    /// Midpoints are displaced, the contour is shrunk, then phases are drawn and points dropped (section 4.3).
    Improved,
}

impl Method {
    /// All methods, as the paper lists them.
    pub const ALL: [Self; 4] = [Self::Simple, Self::Midpoint, Self::Fourier, Self::Improved];

    /// Whether phases are drawn.
    pub(super) const fn scrambles(self) -> bool {
        matches!(self, Self::Fourier | Self::Improved)
    }
}

/// What joins two moved edges where they come apart (figures 5 and 7 of the paper).
///
/// That is at the corners at which the line turns away from where it goes: valleys when it shrinks, ridges when it grows.
/// Distances are of the joined line from the corner, for a line that moves by `d`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Join {
    /// Edges are extended until they meet (figure 5a), at most to [`MITER_LIMIT`] times `d`. Distances are `d` or more.
    Miter,
    /// Ends are joined by a straight line (figure 5b). Corners that turn by more than 120 degrees get a point at
    /// the distance `d` between. Distances are `d / 2` or more.
    Bevel,
    /// Ends are joined through one point on the bisector at `factor * d`, or where the extended edges meet, if that is
    /// nearer (figure 7). 1.2 in the paper; 1.4 comes closest to real maps (figure 10). Distances are 0.7 `d` or more.
    Arc {
        /// Distance of the point from the corner, in units of `d`. 1..=16.
        factor: f32,
    },
    /// Ends are joined by the circle of radius `d` (figure 5c), in chords around it. Distances are `d` or more.
    Round,
}

/// Where [`Join::Miter`] ends, in units of the distance.
pub const MITER_LIMIT: f32 = 10.0;

impl Join {
    /// The distance from the corner of the farthest point of a join, in units of the distance.
    pub(super) const fn reach(self) -> f32 {
        match self {
            Self::Miter => MITER_LIMIT,
            Self::Bevel => 1.0,
            Self::Arc { factor } => factor,
            Self::Round => 1.02,
        }
    }

    /// How near to the corner joined lines come, in units of the distance.
    pub(super) fn least(self) -> f64 {
        match self {
            Self::Miter => 0.99,
            Self::Bevel => 0.5,
            // From the end of an edge to the point, where a line turns back: a right triangle.
            Self::Arc { factor } => f64::from(factor) / (1.0 + f64::from(factor * factor)).sqrt(),
            Self::Round => 1.0,
        }
    }
}

macro_rules! params {
    ($($(#[doc = $doc:literal])* $name:ident: $kind:ty = $default:expr, $min:expr, $max:expr;)*) => {
        /// All settings of contour lines except the seed contours and the random seed.
        ///
        /// Lengths are in pattern units: the surface's shorter side is 1.
        ///
        /// ```
        /// use bevy_crack::relief::{Join, Method, ReliefParams};
        ///
        /// let mut params = ReliefParams { distance: 0.01, ..ReliefParams::IMPROVED };
        /// params.set("join", "arc")?;
        /// params.set("factor", "1.4")?;
        /// assert_eq!(params.join, Join::Arc { factor: 1.4 });
        /// let error = ReliefParams { distance: -0.5, ..params }.validate().unwrap_err();
        /// assert_eq!(error.to_string(), "`distance` is -0.5, must lie in 0.000001..=1000000");
        /// # Ok::<(), bevy_crack::relief::ReliefError>(())
        /// ```
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
        pub struct ReliefParams {
            /// How a contour is made from the one before; default [`Method::Improved`].
            pub method: Method,
            /// What joins moved edges; default [`Join::Arc`] with a factor of 3.
            pub join: Join,
            $($(#[doc = $doc])* pub $name: $kind,)*
        }

        impl ReliefParams {
            /// The default: the improved method with the constants of the paper (section 4.3).
            pub const DEFAULT: Self =
                Self { method: Method::Improved, join: Join::Arc { factor: 3.0 }, $($name: $default,)* };

            /// Checks every number against its range.
            ///
            /// # Errors
            /// [`ReliefError::OutOfRange`] for the first number that is out of its range or not finite;
            /// [`ReliefError::Order`] if `min_angle` is above `max_angle`; [`ReliefError::Samples`];
            /// [`ReliefError::FirstHarmonic`].
            pub fn validate(&self) -> Result<(), ReliefError> {
                let factor = if let Join::Arc { factor } = self.join { factor } else { 1.0 };
                let ranges = [$((stringify!($name), self.$name as f32, $min, $max),)* ("factor", factor, 1.0, 16.0)];
                if let Some((name, value, min, max)) =
                    ranges.into_iter().find(|(_, value, min, max)| !(*min..=*max).contains(value))
                {
                    return Err(ReliefError::OutOfRange { name, value, min, max });
                }
                self.validate_together()
            }

            /// Sets a parameter from text, as in `distance` and `0.02`.
            ///
            /// The name `method` takes `simple`, `midpoint`, `fourier` and `improved`; `join` takes `miter`, `bevel`,
            /// `arc` (with a factor of 1.2) and `round`; `factor` makes the join an arc with this factor.
            ///
            /// # Errors
            /// [`ReliefError::Unknown`] if there is no such parameter, [`ReliefError::Unreadable`] if the text is not its
            /// value, those of [`validate`](Self::validate) if it does not fit; nothing changes then.
            pub fn set(&mut self, name: &str, text: &str) -> Result<(), ReliefError> {
                let unreadable = || ReliefError::Unreadable { name: name.into(), text: text.into() };
                let mut changed = *self;
                match name {
                    "method" => changed.method = method(text.trim()).ok_or_else(unreadable)?,
                    "join" => changed.join = join(text.trim()).ok_or_else(unreadable)?,
                    "factor" => changed.join = Join::Arc { factor: text.trim().parse().map_err(|_| unreadable())? },
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
    /// Distance `d` from a contour to the next one, pattern units. 1e-6..=1e6; default 0.02.
    distance: f32 = 0.02, 1e-6, 1e6;
    /// Largest displacement of a midpoint, `d''` of the paper, in units of the distance. 0..=1; default 0.5.
    displacement: f32 = 0.5, 0.0, 1.0;
    /// Smallest angle by which a midpoint is displaced, seen from the end of its edge, radians. 0..=1.2; default 20 degrees.
    min_angle: f32 = 20.0 * std::f32::consts::PI / 180.0, 0.0, 1.2;
    /// Largest angle by which a midpoint is displaced, radians. 0..=1.2; default 40 degrees.
    max_angle: f32 = 40.0 * std::f32::consts::PI / 180.0, 0.0, 1.2;
    /// Number of samples of a contour in the Fourier transform: a power of two. 16..=16384; default 1024.
    samples: u32 = 1024, 16.0, 16384.0;
    /// Phases change from this harmonic on: `f0` of the paper. 1..=half the samples; default 256.
    first_harmonic: u32 = 256, 1.0, 8192.0;
    /// The share of edges that stay longer than twice the mean edge of the seed, so that there is something to
    /// displace: in the improved method, points in nearly straight lines are dropped until it is reached. 0..=1; default 0.2.
    long_edges: f32 = 0.2, 0.0, 1.0;
    /// Most contours to make inward, which is uphill. Fewer if the last one vanishes. 0..=4096; default 4096.
    inward: u32 = 4096, 0.0, 4096.0;
    /// Number of contours to make outward, which is downhill. 0..=256; default 0.
    outward: u32 = 0, 0.0, 256.0;
    /// How much nearer contours are on the side of `steep_angle`: 0 = not at all, 0.8 = at a fifth of the distance where
    /// a ring reaches farthest to that side, and at 1.8 times at its other end, evenly between. 0..=0.8; default 0.
    steepness: f32 = 0.0, 0.0, 0.8;
    /// Direction of the steep side, radians from the x axis towards y, which points down. -7..=7; default 0.
    steep_angle: f32 = 0.0, -7.0, 7.0;
}

impl ReliefParams {
    /// The simple method with the join that comes closest to real maps (section 3, figure 10a).
    pub const SIMPLE: Self = Self { method: Method::Simple, join: Join::Arc { factor: 1.4 }, ..Self::DEFAULT };

    /// The method of section 4.1 with the constants of figure 12b.
    pub const MIDPOINT: Self = Self {
        method: Method::Midpoint,
        join: Join::Arc { factor: 1.4 },
        displacement: 0.3,
        min_angle: 0.0,
        max_angle: 20.0 * std::f32::consts::PI / 180.0,
        ..Self::DEFAULT
    };

    /// The method of section 4.2 with the constants of figure 15.
    pub const FOURIER: Self = Self { method: Method::Fourier, join: Join::Arc { factor: 1.4 }, ..Self::DEFAULT };

    /// The method of section 4.3 with the constants of figure 16.
    pub const IMPROVED: Self = Self::DEFAULT;

    fn validate_together(&self) -> Result<(), ReliefError> {
        let Self { min_angle, max_angle, samples, first_harmonic, .. } = *self;
        if min_angle > max_angle {
            return Err(ReliefError::Order {
                low: "min_angle",
                low_value: min_angle,
                high: "max_angle",
                high_value: max_angle,
            });
        }
        if !samples.is_power_of_two() {
            return Err(ReliefError::Samples { samples });
        }
        if first_harmonic > samples / 2 {
            return Err(ReliefError::FirstHarmonic { first: first_harmonic, most: samples / 2 });
        }
        Ok(())
    }
}

impl Default for ReliefParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

fn method(name: &str) -> Option<Method> {
    let names = ["simple", "midpoint", "fourier", "improved"];
    names.iter().position(|known| *known == name).map(|i| Method::ALL[i])
}

fn join(name: &str) -> Option<Join> {
    match name {
        "miter" => Some(Join::Miter),
        "bevel" => Some(Join::Bevel),
        "arc" => Some(Join::Arc { factor: 1.2 }),
        "round" => Some(Join::Round),
        _ => None,
    }
}
