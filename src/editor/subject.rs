//! What the panel knows of the surface that is chosen: values that it shows and changes. No part of it is in the world.

use crate::plugin::{
    BakeProgress, CrackChips, CrackClock, CrackRelief, CrackState, CrackStrands, CrackSurface, GuidedCracks,
    ShatterCracks, ShatterRequest,
};
use bevy::prelude::*;
use bevy_egui::egui::TextureId;
use std::path::PathBuf;

/// The surface that is chosen, as values: what the panel changes in them goes to the components of the same names.
#[derive(Clone, Debug, Default)]
pub struct Subject {
    /// What it is called: its [`Name`], or its number.
    pub name: String,
    /// Its settings.
    pub surface: CrackSurface,
    /// The preset in a file, if it has one and it is loaded: shown in place of what `surface` has.
    pub preset: Option<crate::CrackPreset>,
    /// How its cracks are; read only.
    pub state: CrackState,
    /// Its time.
    pub clock: Option<CrackClock>,
    /// Its guided cracks.
    pub guided: Option<GuidedCracks>,
    /// Its strands.
    pub strands: Option<CrackStrands>,
    /// Its relief.
    pub relief: Option<CrackRelief>,
    /// How far the relief is, 0..=1.
    pub relief_progress: f32,
    /// The photographs that its cracks are like.
    pub analogy: Option<AnalogyChoice>,
    /// How far its analogy is, 0..=1; read only.
    pub analogy_progress: f32,
    /// How far a bake is; read only.
    pub progress: Option<BakeProgress>,
    /// How it shatters.
    pub shatter: Option<ShatterCracks>,
    /// The chips that its craters lose.
    pub chips: Option<CrackChips>,
    /// Its shards: shown, gone and all; read only.
    pub shards: Option<(u32, u32, u32)>,
    /// Its textures, by name; read only.
    pub textures: Vec<(&'static str, TextureId, UVec2)>,
}

/// A [`CrackAnalogy`](crate::plugin::CrackAnalogy) as values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AnalogyChoice {
    /// Path of the file of its examples; empty if they come from none.
    pub file: String,
    /// Whether the surface keeps its own picture.
    pub keeps_picture: bool,
    /// Seed of the search.
    pub seed: u64,
}

/// What all cracks cost in the last frame; read only.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Costs {
    /// Time of the crate's own systems, milliseconds, and what the budget allows.
    pub milliseconds: f32,
    /// Limit of the budget, milliseconds.
    pub budget: f32,
    /// Bytes that went to the GPU.
    pub bytes: u64,
    /// Rectangles that they were.
    pub rects: u32,
    /// Nodes of all networks.
    pub nodes: u64,
    /// Surfaces that have cracks.
    pub cracked: u32,
    /// Bytes of all textures.
    pub texture_bytes: u64,
}

/// What a user asks for by a button of the panel.
#[derive(Clone, Debug, PartialEq)]
pub enum EditorCommand {
    /// Show the settings of another surface.
    Choose(Entity),
    /// Hit the chosen surface at these texture coordinates.
    Hit(Vec2),
    /// Take all cracks away at once.
    Heal,
    /// Close all cracks within so many seconds.
    Close(f32),
    /// Knock shards out.
    Shatter(ShatterRequest),
    /// Go back to the settings before the last change.
    Undo,
    /// Go forth again.
    Redo,
    /// Write the preset to a file.
    SavePreset(PathBuf),
    /// Read cracks from a file that [`Export::Record`] has written.
    LoadRecord(PathBuf),
    /// Write something of the surface into a folder.
    Export(Export, PathBuf),
}

/// What can be written to files.
///
/// ```
/// use bevy_crack::editor::Export;
///
/// let labels = Export::ALL.map(Export::label);
/// assert_eq!(labels[0], "Maps as PNG");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Export {
    /// Every texture as a PNG file.
    Maps,
    /// The growth as a GIF.
    Gif,
    /// The growth as one PNG, its moments side by side.
    Sheet,
    /// The outlines of the shards as SVG.
    Shards,
    /// The cracks themselves, as a [`CrackRecord`](crate::plugin::CrackRecord) in RON.
    Record,
}

impl Export {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Maps, Self::Gif, Self::Sheet, Self::Shards, Self::Record];

    /// Name of the file with a record.
    pub const RECORD: &str = "cracks.ron";

    /// What its button says.
    #[must_use]
    pub const fn label(self) -> &'static str {
        match self {
            Self::Maps => "Maps as PNG",
            Self::Gif => "Growth as GIF",
            Self::Sheet => "Growth as sprite sheet",
            Self::Shards => "Shards as SVG",
            Self::Record => "Save cracks",
        }
    }
}
