//! Pictures that ship with the crate.

use bevy_crack::{CrackPreset, paint::Look};
use std::path::{Path, PathBuf};

/// The presets, and looks that none of them has: as many as fill a sheet.
pub(crate) fn exhibits() -> impl Iterator<Item = &'static str> {
    CrackPreset::NAMES.into_iter().chain(["mirror", "glowing"])
}

/// The preset of this name, or a look on concrete.
pub(crate) fn exhibit(name: &str) -> Option<CrackPreset> {
    CrackPreset::named(name).or_else(|| Some(CrackPreset { look: Look::named(name)?, ..CrackPreset::CONCRETE }))
}

/// The picture that suits a preset.
pub(crate) fn own_picture(preset: &str) -> PathBuf {
    let file = match preset {
        "glass" | "tempered_glass" | "laminated_glass" => "glass_pane",
        "brick" => "brick_red",
        "plaster" | "clay" | "mud" | "glaze" | "ice" | "asphalt" | "marble" | "sand" | "toon" => preset,
        _ => "concrete_fine",
    };
    Path::new(crate::ASSETS).join("textures").join(file).with_extension("png")
}
