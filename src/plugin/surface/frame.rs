//! Where cracks lie and how they look on a surface.

use crate::CrackPreset;
use crate::paint::{LookTable, Shades};
use crate::pattern::SurfaceFrame;
use crate::plugin::api::error::CrackError;
use crate::plugin::source::picture::BasePicture;
use crate::raster::{Profile, TexelRect};
use std::borrow::Cow;

/// Where the cracks of a surface lie that shows `rect` of a picture.
pub(crate) fn frame(rect: TexelRect, base: &BasePicture) -> Result<SurfaceFrame, CrackError> {
    let frame = match base.unit() {
        None => SurfaceFrame::new(rect.size()),
        Some(unit) => SurfaceFrame::with_unit(rect.size(), unit),
    };
    frame.map_err(|error| CrackError::Size { width: error.width, height: error.height })
}

/// The look of a surface, ready to paint with. Where texels are shown as squares it has few shades, unless the preset says how many.
pub(crate) fn look(preset: &CrackPreset, frame: SurfaceFrame, is_nearest: bool) -> Result<LookTable, CrackError> {
    let mut look = Cow::Borrowed(&preset.look);
    if is_nearest && look.shades == Shades::Auto {
        look.to_mut().shades = Shades::Steps(Shades::PIXELS);
    }
    LookTable::new(&look, frame.texels_per_unit()).map_err(|error| CrackError::Preset { reason: error.to_string() })
}

/// The profile to draw the cracks of a surface with. Where it has few shades, cracks thinner than a texel do not fade: a faint line would be
/// no shade at all.
pub(crate) fn profile(preset: &CrackPreset, is_nearest: bool) -> Profile {
    let is_smooth = match preset.look.shades {
        Shades::Auto => !is_nearest,
        Shades::Smooth => true,
        Shades::Steps(_) => false,
    };
    if is_smooth { preset.profile } else { Profile { faintest: 1.0, ..preset.profile } }
}
