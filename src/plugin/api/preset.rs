//! [`PresetSource`]: presets in components and presets in files.

use crate::preset::CrackPreset;
use bevy::{prelude::*, reflect::serde::ReflectSerializeWithRegistry};

/// Where a surface's preset comes from: itself, or a file.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// fn setup(mut commands: Commands, assets: Res<AssetServer>) {
///     let mut slow = CrackPreset::GLASS;
///     slow.steps_per_second = 5.0;
///     commands.spawn((Sprite::default(), CrackSurface::new(slow)));
///     commands.spawn((Sprite::default(), CrackSurface::new(assets.load("presets/mine.crack.ron"))));
/// }
/// ```
#[derive(Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Default, SerializeWithRegistry)]
#[expect(clippy::large_enum_variant, reason = "the large one is the usual one")]
pub enum PresetSource {
    /// This preset.
    Inline(CrackPreset),
    /// An asset, for instance a file `*.crack.ron` (see [`CrackPreset::from_ron`]). Hits wait until it is loaded. When it
    /// changes, surfaces that use it take it up as they do a changed component; a broken file is one error in the log, and
    /// what was there before stays.
    Asset(Handle<CrackPreset>),
}

impl PresetSource {
    /// The preset, to change it; `None` if it is an asset.
    ///
    /// ```
    /// use bevy::prelude::*;
    /// use bevy_crack::prelude::*;
    ///
    /// let mut surface = CrackSurface::new(CrackPreset::GLASS);
    /// if let Some(preset) = surface.preset.as_mut() {
    ///     preset.growth.reach = 0.3;
    /// }
    /// assert_eq!(surface.preset.as_mut().map(|preset| preset.growth.reach), Some(0.3));
    /// assert_eq!(PresetSource::Asset(Handle::default()).as_mut(), None);
    /// ```
    #[must_use]
    pub const fn as_mut(&mut self) -> Option<&mut CrackPreset> {
        match self {
            Self::Inline(preset) => Some(preset),
            Self::Asset(_) => None,
        }
    }
}

impl Default for PresetSource {
    fn default() -> Self {
        Self::Inline(CrackPreset::default())
    }
}

impl From<CrackPreset> for PresetSource {
    fn from(preset: CrackPreset) -> Self {
        Self::Inline(preset)
    }
}

impl From<Handle<CrackPreset>> for PresetSource {
    fn from(preset: Handle<CrackPreset>) -> Self {
        Self::Asset(preset)
    }
}
