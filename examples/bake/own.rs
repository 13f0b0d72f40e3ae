//! Pictures that ship with the crate.

use std::path::{Path, PathBuf};

/// The picture that suits a preset.
pub(crate) fn own_picture(preset: &str) -> PathBuf {
    let file = match preset {
        "glass" | "tempered_glass" | "laminated_glass" => "glass_pane",
        "brick" => "brick_red",
        "plaster" | "clay" | "mud" | "glaze" | "ice" | "toon" => preset,
        _ => "concrete_fine",
    };
    Path::new(crate::ASSETS).join("textures").join(file).with_extension("png")
}
