//! [`CrackMaskSource`]: where a surface's masks come from.

use bevy::{prelude::*, reflect::serde::ReflectSerializeWithRegistry};

/// Where cracks like to run, where they do not, and where they never go. See [`CrackMask`](crate::pattern::CrackMask).
///
/// Cracks that [divide](crate::growth::Venation::Subdivision) what there is (tempered glass, plaster, clay, mud, glaze) hardly mind where they like to run.
#[derive(Reflect, Clone, Debug, Default, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Default, SerializeWithRegistry)]
pub enum CrackMaskSource {
    /// As the preset has it: cracks of brick, and of every preset that [follows lines](crate::CrackPreset::follows_lines), follow the lines of the
    /// surface's own picture, which are read as those of [`FromPicture`](Self::FromPicture); else [`None`](Self::None).
    #[default]
    Auto,
    /// Everywhere alike.
    None,
    /// By the surface's own picture: cracks follow its lines (mortar, joints of tiles and planks, old cracks) and keep off
    /// what is less than half opaque. It is read once for each picture, in the background; the first hit waits for that.
    FromPicture,
    /// By images over the shown part of the surface's picture, of any size: black = not at all, white = wholly (lightness as
    /// it is stored, times alpha). The first hit waits until they are loaded; later changes of theirs have no effect.
    Images {
        /// Where cracks like to run.
        weak: Option<Handle<Image>>,
        /// What they avoid.
        strong: Option<Handle<Image>>,
        /// What they never enter: where the image is lighter than half.
        forbidden: Option<Handle<Image>>,
    },
}
