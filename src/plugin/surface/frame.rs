//! Where cracks lie and how they look on a surface.

use crate::CrackPreset;
use crate::paint::LookTable;
use crate::pattern::SurfaceFrame;
use crate::plugin::api::error::CrackError;
use crate::raster::TexelRect;

/// Where the cracks of a surface lie that shows `rect`.
pub(crate) fn frame(rect: TexelRect) -> Result<SurfaceFrame, CrackError> {
    SurfaceFrame::new(rect.size()).map_err(|error| CrackError::Size { width: error.width, height: error.height })
}

/// The look of a surface, ready to paint with.
pub(crate) fn look(preset: &CrackPreset, frame: SurfaceFrame) -> Result<LookTable, CrackError> {
    LookTable::new(&preset.look, frame.texels_per_unit())
        .map_err(|error| CrackError::Preset { reason: error.to_string() })
}
