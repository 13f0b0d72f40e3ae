//! Image analogies: cracks that look like those of a photograph.
//!
//! `A : A' :: B : B'` (Hertzmann et al. 2001, as used in Mould 2005, section 5.1): `A'` is a photograph of a cracked
//! material and `A` tells where its cracks are; `B` is a crack pattern of any kind; `B'` is the surface with these
//! cracks, in the material of the photograph. [`AnalogyPair`] is `A : A'`, [`Examples`] are pairs made ready,
//! [`Analogy`] makes `B'`.
//!
//! Every texel of `B'` is a copy of a texel of `A'`, so heights and normals that belong to the photograph are carried
//! over with the colours. `B' = A'` where `B = A`. If the first pair is the uncracked picture of a surface, the surface
//! keeps it texel for texel away from its cracks.
//!
//! See [`Analogy`] for an example.

mod atlas;
mod carry;
mod error;
mod examples;
mod flatten;
mod guide;
mod level;
mod pair;
mod params;
mod ramp;
mod region;
mod search;
mod state;
#[cfg(test)]
mod tests;
mod widen;
mod work;

pub use carry::TexelSource;
pub use error::AnalogyError;
pub use examples::{Examples, MAX_EXAMPLE_TEXELS, MAX_PAIRS};
pub use pair::{AnalogyPair, MAX_CHANNELS, MAX_EXAMPLE_SIDE, MIN_EXAMPLE_SIDE};
pub use params::AnalogyParams;
pub use state::{Analogy, MAX_SURFACE_SIDE};
