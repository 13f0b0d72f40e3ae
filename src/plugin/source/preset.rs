//! Presets from components and files.

use crate::plugin::api::error::CrackError;
use crate::plugin::api::preset::PresetSource;
use crate::preset::{CrackPreset, PresetError};
use bevy::{
    asset::{AssetLoader, AssetPath, AsyncReadExt, LoadContext, LoadState, io::Reader},
    platform::{collections::HashMap, time::Instant},
    prelude::*,
};
use std::{
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

/// The preset, valid; `None` if it is not there yet.
pub(crate) fn resolve(world: &World, source: &PresetSource) -> Result<Option<CrackPreset>, CrackError> {
    let refused = |reason: String| CrackError::Preset { reason };
    let preset = match source {
        PresetSource::Inline(preset) => preset,
        PresetSource::Asset(handle) => {
            let presets = world.get_resource::<Assets<CrackPreset>>();
            let presets = presets.ok_or_else(|| refused("there are no assets: add `AssetPlugin`".into()))?;
            match (presets.get(handle), world.get_resource::<AssetServer>()) {
                (Some(preset), _) => {
                    let fault = world.get_resource::<PresetFiles>().and_then(|files| files.fault(handle));
                    fault.map_or(Ok(preset), |fault| Err(refused(fault)))?
                }
                (None, Some(server)) => match server.get_load_state(handle) {
                    // With backtraces on, the text goes on for pages.
                    Some(LoadState::Failed(error)) => {
                        return Err(refused(error.to_string().lines().next().unwrap_or_default().to_owned()));
                    }
                    _ => return Ok(None),
                },
                (None, None) => return Ok(None),
            }
        }
    };
    preset.validate().map_err(|error| refused(error.to_string()))?;
    Ok(Some(preset.clone()))
}

/// What is known of the preset files that were read.
#[derive(Resource, Clone, Default)]
struct PresetFiles(Arc<Mutex<HashMap<AssetPath<'static>, PresetFile>>>);

#[derive(Default)]
struct PresetFile {
    /// What it was when it could be used last.
    good: Option<CrackPreset>,
    /// Why it cannot be used, if it never could.
    fault: Option<String>,
    /// What was refused last, and when.
    refused: Option<(Vec<u8>, Instant)>,
}

/// How long after a file was refused a second try is one of the engine's own.
const AGAIN: Duration = Duration::from_secs(1);

impl PresetFiles {
    fn with<T>(&self, path: &AssetPath<'static>, act: impl FnOnce(&mut PresetFile) -> T) -> T {
        act(self.0.lock().unwrap_or_else(PoisonError::into_inner).entry(path.clone()).or_default())
    }

    /// Why the file of a preset that is there cannot be used.
    fn fault(&self, preset: &Handle<CrackPreset>) -> Option<String> {
        let files = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        files.get(preset.path()?)?.fault.clone()
    }
}

impl PresetFile {
    /// Takes up what was read of it. Where a file cannot be loaded again the engine tries once more at once, and would say the same once
    /// more; it is given what was there before then, which stays.
    fn take(&mut self, bytes: Vec<u8>, read: Result<CrackPreset, LoadError>) -> Result<CrackPreset, LoadError> {
        let error = match read {
            Ok(preset) => {
                *self = Self { good: Some(preset.clone()), ..Self::default() };
                return Ok(preset);
            }
            Err(error) => error,
        };
        if self.refused.take().is_some_and(|(before, when)| before == bytes && when.elapsed() < AGAIN) {
            return Ok(self.good.clone().unwrap_or_default());
        }
        self.fault = self.good.is_none().then(|| error.to_string());
        self.refused = Some((bytes, Instant::now()));
        Err(error)
    }
}

/// Loads `*.crack.ron`.
#[derive(TypePath, Default)]
struct PresetLoader(PresetFiles);

/// Why a file is no preset.
#[derive(Debug, thiserror::Error)]
enum LoadError {
    #[error("{0}")]
    Io(#[from] std::io::Error),
    #[error("not UTF-8: {0}")]
    Text(#[from] std::str::Utf8Error),
    #[error("{0}")]
    Preset(#[from] PresetError),
}

impl AssetLoader for PresetLoader {
    type Asset = CrackPreset;
    type Settings = ();
    type Error = LoadError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        (): &(),
        context: &mut LoadContext<'_>,
    ) -> Result<CrackPreset, LoadError> {
        // One byte more than allowed tells that the file is too large, however large it is.
        let mut bytes = Vec::new();
        reader.take(CrackPreset::MAX_FILE as u64 + 1).read_to_end(&mut bytes).await?;
        let preset = read(&bytes);
        self.0.with(context.path(), |file| file.take(bytes, preset))
    }

    fn extensions(&self) -> &[&str] {
        &[CrackPreset::EXTENSION]
    }
}

fn read(bytes: &[u8]) -> Result<CrackPreset, LoadError> {
    if bytes.len() > CrackPreset::MAX_FILE {
        return Err(PresetError::TooLarge { bytes: bytes.len() }.into());
    }
    Ok(CrackPreset::from_ron(str::from_utf8(bytes)?)?)
}

/// Makes presets assets, where there are any.
pub(crate) fn add_assets(app: &mut App) {
    if app.world().contains_resource::<AssetServer>() {
        let files = PresetFiles::default();
        app.insert_resource(files.clone())
            .init_asset::<CrackPreset>()
            .register_asset_reflect::<CrackPreset>()
            .register_asset_loader(PresetLoader(files));
    }
}
