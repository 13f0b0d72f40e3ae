//! [`SurfaceInputs`]: what a surface is read from, by any thread.

use super::frame::{frame, look, profile};
use super::picture_plan::PicturePlan;
use crate::CrackPreset;
use crate::OutOfMemory;
use crate::growth::CrackGrowth;
use crate::paint::LookTable;
use crate::pattern::CrackMask;
use crate::plugin::api::{CrackError, CrackSurface};
use crate::plugin::source::mask::{self, MaskKey};
use crate::plugin::source::picture::BasePicture;
use crate::raster::{DepthField, TexelRect, make_tables};
use bevy::prelude::*;
use std::sync::Arc;

/// The pictures of which a copy is needed, each once.
#[derive(Default)]
pub(crate) struct Copies(pub(crate) Vec<Handle<Image>>);

impl Copies {
    pub(crate) fn add(&mut self, picture: &Handle<Image>) -> usize {
        self.0.iter().position(|known| known == picture).unwrap_or_else(|| {
            self.0.push(picture.clone());
            self.0.len() - 1
        })
    }
}

/// What a surface is to be read from, by any thread.
pub(crate) struct SurfaceInputs {
    pub(crate) plan: PicturePlan,
    pub(super) base: RawBase,
    pub(super) mask: RawMask,
    /// Index of the copy of the image of densities.
    pub(super) density: Option<usize>,
}

pub(super) enum RawBase {
    Read(Arc<BasePicture>),
    /// Indices of the copies.
    Pictures([Option<usize>; 3]),
}

pub(super) enum RawMask {
    Made(Arc<CrackMask>),
    FromPicture(MaskKey),
    /// Indices of the copies of its layers.
    Images([Option<usize>; 3]),
}

/// What was read of a surface.
#[derive(Clone)]
pub(crate) struct BaseAndMask {
    pub(crate) base: Arc<BasePicture>,
    pub(crate) mask: Arc<CrackMask>,
}

impl SurfaceInputs {
    pub(crate) fn read(&self, copies: &[Image]) -> Result<BaseAndMask, CrackError> {
        let copy = |index: Option<usize>| index.and_then(|index| copies.get(index));
        let base = match &self.base {
            RawBase::Read(base) => base.clone(),
            RawBase::Pictures(pictures) => Arc::new(self.plan.read(pictures.map(copy))?),
        };
        let mask = match &self.mask {
            RawMask::Made(mask) => mask.clone(),
            RawMask::FromPicture(key) => key.make(&base.diffuse)?,
            RawMask::Images(layers) => {
                let [weak, strong, forbidden] = layers.map(|index| copy(index).map(mask::layer).transpose());
                Arc::new(CrackMask { weak: weak?, strong: strong?, forbidden: forbidden?, density: None })
            }
        };
        let mask = with_density(mask, copy(self.density))?;
        Ok(BaseAndMask { base, mask })
    }
}

/// A mask with the densities of an image.
pub(super) fn with_density(mask: Arc<CrackMask>, image: Option<&Image>) -> Result<Arc<CrackMask>, CrackError> {
    let Some(image) = image else { return Ok(mask) };
    Ok(Arc::new(CrackMask { density: Some(mask::layer(image)?), ..CrackMask::clone(&mask) }))
}

/// What cracks grow and are drawn in, before the first.
pub(crate) struct BlankSurface {
    pub(crate) growth: CrackGrowth,
    pub(crate) field: DepthField,
    pub(crate) look: LookTable,
}

impl BlankSurface {
    pub(crate) fn new(
        surface: &CrackSurface,
        preset: &CrackPreset,
        BaseAndMask { base, mask }: &BaseAndMask,
        rect: TexelRect,
    ) -> Result<Self, CrackError> {
        let frame = frame(rect, base)?;
        let look = look(preset, frame, base.is_nearest)?;
        let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), surface.seed)
            .map_err(|error| CrackError::Preset { reason: error.to_string() })?;
        growth.set_density(base.density(rect, surface.alpha_mask));
        growth.set_mask(mask.clone());
        let out_of_memory = |error: OutOfMemory| CrackError::Textures { reason: error.to_string() };
        let mut field = DepthField::try_new(frame).map_err(out_of_memory)?;
        field.set_forbidden(mask);
        field.set_layers(preset.look.layer(surface.seed));
        make_tables(&profile(preset, base.is_nearest), frame);
        Ok(Self { growth, field, look })
    }
}
