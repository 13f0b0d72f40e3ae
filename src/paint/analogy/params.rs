//! The settings of an analogy: [`AnalogyParams`].

use super::error::AnalogyError;

macro_rules! params {
    ($($(#[doc = $doc:literal])* $name:ident: $kind:ty = $default:expr, $min:expr, $max:expr;)*) => {
        /// All settings of an analogy except pairs, surface and seed.
        ///
        /// Lengths are in texels of the photograph, because texels are copied one for one.
        ///
        /// ```
        /// use bevy_crack::paint::analogy::AnalogyParams;
        ///
        /// let params = AnalogyParams { reach: 16, ..AnalogyParams::DEFAULT };
        /// assert_eq!(params.validate(), Ok(()));
        /// let error = AnalogyParams { reach: 0, ..params }.validate().unwrap_err();
        /// assert_eq!(error.to_string(), "`reach` is 0, must lie in 2..=60");
        /// // From text, as in a console.
        /// let mut params = params;
        /// params.set("reach", "12")?;
        /// assert_eq!(params.reach, 12);
        /// # Ok::<(), bevy_crack::paint::analogy::AnalogyError>(())
        /// ```
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
        pub struct AnalogyParams {
            $($(#[doc = $doc])* pub $name: $kind,)*
            /// Whether the result continues from its right border to its left one and from its lower border to its
            /// upper one, so that it can be repeated without seams; cracks should do the same. Default false.
            pub is_tileable: bool,
        }

        impl AnalogyParams {
            /// The default.
            pub const DEFAULT: Self = Self { $($name: $default,)* is_tileable: false };

            /// Checks every number against its range.
            ///
            /// # Errors
            /// [`AnalogyError::OutOfRange`] for the first number that is out of its range or not finite.
            pub fn validate(&self) -> Result<(), AnalogyError> {
                let ranges = [$((stringify!($name), self.$name as f32, $min, $max)),*];
                match ranges.into_iter().find(|(_, value, min, max)| !(*min..=*max).contains(value)) {
                    Some((name, value, min, max)) => Err(AnalogyError::OutOfRange { name, value, min, max }),
                    None => Ok(()),
                }
            }

            /// Sets the number `name` from text, as in `reach` and `12`.
            ///
            /// # Errors
            /// [`AnalogyError::Unknown`] if there is no such number, [`AnalogyError::Unreadable`] if the text is not
            /// its value, [`AnalogyError::OutOfRange`] if it is out of its range; nothing changes then.
            pub fn set(&mut self, name: &str, text: &str) -> Result<(), AnalogyError> {
                let unreadable = || AnalogyError::Unreadable { name: name.into(), text: text.into() };
                let mut changed = *self;
                match name {
                    $(stringify!($name) => changed.$name = text.trim().parse().map_err(|_| unreadable())?,)*
                    "is_tileable" => changed.is_tileable = text.trim().parse().map_err(|_| unreadable())?,
                    _ => return Err(AnalogyError::Unknown { name: name.into() }),
                }
                changed.validate()?;
                *self = changed;
                Ok(())
            }
        }
    };
}

params! {
    /// Distance from a crack up to which the guide tells where a texel is, texels. Farther away all places are alike to
    /// it. 2..=60; default 12. Larger values carry stains and worn edges along, and leave fewer places to choose from.
    reach: u32 = 12, 2.0, 60.0;
    /// Depth from which a texel is crack, 0..=1; default 0.15, so that thin cracks have few gaps.
    depth: f32 = 0.15, 0.0, 1.0;
    /// Weight of the guide against that of the three colours together, 0..=5; default 3. Smaller values
    /// fit pieces to each other better than to the cracks. At 0 cracks go anywhere.
    guide: f32 = 3.0, 0.0, 5.0;
    /// Weight of the direction away from the crack against the guide, 0..=4; default 0. Raise it for photographs with
    /// light from one side.
    orientation: f32 = 0.0, 0.0, 4.0;
    /// Weight of each further channel against the guide, 0..=4; default 1.
    extra: f32 = 1.0, 0.0, 4.0;
    /// How much better a place must match than one that continues a neighbour, as a share: `κ` of Hertzmann et al.,
    /// section 3.2. 0..=4; default 0.4. Larger values copy larger pieces.
    coherence: f32 = 0.4, 0.0, 4.0;
    /// How much places that have been copied before are avoided on the small levels, 0..=8; default 1. Larger values
    /// repeat less and have more seams.
    variety: f32 = 1.0, 0.0, 8.0;
    /// Levels of the pyramids, each half the size of the one before. 1..=8; default 5.
    levels: u32 = 5, 1.0, 8.0;
    /// Passes over each level. 1..=8; default 2.
    passes: u32 = 2, 1.0, 8.0;
    /// Places of the same guide value that each texel tries in a pass, besides those that continue its neighbours.
    /// 0..=64; default 6.
    tries: u32 = 6, 0.0, 64.0;
    /// How far from a changed guide the texels of a growing crack are made anew, texels. 1..=32; default 5.
    margin: u32 = 5, 1.0, 32.0;
}

impl Default for AnalogyParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}
