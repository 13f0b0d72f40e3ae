//! How cracks are shown, and the files that every command writes.

use crate::{
    own::own_picture,
    painting::{covering, fitted, paint},
    pictures::read_picture,
};
use bevy_crack::{
    CrackPreset,
    paint::{Look, LookTable, Modulation, modulate},
    pattern::SurfaceFrame,
    raster::DepthField,
};
use glam::UVec2;
use image::{GrayImage, ImageBuffer, Luma, RgbaImage};
use std::{error::Error, fs, path::Path};

/// The preset of this name.
pub(crate) fn preset(name: &str) -> Result<CrackPreset, Box<dyn Error>> {
    let names = || format!("no preset `{name}`; there are {}", CrackPreset::NAMES.join(", "));
    Ok(CrackPreset::named(name).ok_or_else(names)?)
}

/// The picture at `path` stretched to `size`, or the one that suits a preset, not stretched.
pub(crate) fn base_picture(path: Option<&Path>, preset: &str, size: UVec2) -> Result<RgbaImage, Box<dyn Error>> {
    match path {
        Some(path) => Ok(fitted(read_picture(path)?, size)),
        None => Ok(covering(read_picture(&own_picture(preset))?, size)),
    }
}

/// How cracks are shown.
pub(crate) enum Paint {
    Look(Box<LookTable>),
    Modulation(Modulation),
}

impl Paint {
    /// A look of the crate, or the plain modulation of Mould 2005: `dark` or `bright`.
    pub(crate) fn new(name: &str, frame: &SurfaceFrame) -> Result<Self, Box<dyn Error>> {
        match name {
            "dark" => Ok(Self::Modulation(Modulation::DARK)),
            "bright" => Ok(Self::Modulation(Modulation::BRIGHT)),
            _ => {
                let names = Look::NAMES.join(", ");
                let look = Look::named(name).ok_or(format!("no look `{name}`; there are {names}, dark, bright"))?;
                Ok(Self::Look(Box::new(LookTable::new(&look, frame.texels_per_unit())?)))
            }
        }
    }

    /// Diffuse and normal.
    pub(crate) fn paint(&self, base: &RgbaImage, field: &DepthField) -> Result<[RgbaImage; 2], Box<dyn Error>> {
        match self {
            Self::Look(table) => Ok(paint(base, field, table)),
            Self::Modulation(modulation) => {
                let groove = LookTable::new(&Look::GROOVE, field.frame.texels_per_unit())?;
                let [_, normal] = paint(base, field, &groove);
                let mut diffuse = base.clone();
                modulate(&mut diffuse, field, modulation)?;
                Ok([diffuse, normal])
            }
        }
    }
}

/// White where a person would mark a crack: not on the chipped rim.
pub(crate) fn mask(field: &DepthField) -> GrayImage {
    let size = field.frame.size();
    GrayImage::from_fn(size.x, size.y, |x, y| {
        let depth = field.depth.get(x, y).unwrap_or(0);
        Luma([if depth > u16::MAX / 3 { 255 } else { 0 }])
    })
}

/// Writes `diffuse.png`, `normal.png`, `depth.png` (16 bit) and `mask.png` to a folder, which is made if it is not there. The depth is that of the
/// cracks or of `craters` (8 bit), whichever is deeper; if there are craters, the cracks alone are `cracks.png` (16 bit).
pub(crate) fn write_maps(
    folder: &Path,
    [diffuse, normal]: &[RgbaImage; 2],
    field: &DepthField,
    craters: &[u8],
) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    diffuse.save(folder.join("diffuse.png"))?;
    normal.save(folder.join("normal.png"))?;
    let (size, mut texels) = (field.frame.size(), field.depth.as_slice().to_vec());
    let gray = |texels: Vec<u16>| ImageBuffer::<Luma<u16>, _>::from_raw(size.x, size.y, texels).ok_or("depth size");
    let cracks = folder.join("cracks.png");
    if craters.iter().any(|crater| *crater > 0) {
        gray(texels.clone())?.save(cracks)?;
    } else if cracks.exists() {
        // Of other cracks that were written here before.
        fs::remove_file(cracks)?;
    }
    for (texel, &crater) in texels.iter_mut().zip(craters) {
        let crater = 257 * u16::from(crater);
        // A crack alone is half a step off in eight bits.
        if crater > texel.saturating_add(128) {
            *texel = crater;
        }
    }
    gray(texels)?.save(folder.join("depth.png"))?;
    mask(field).save(folder.join("mask.png"))?;
    Ok(())
}
