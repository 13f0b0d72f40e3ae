//! Photographs for image analogies, from files; and the picture of a surface that was made from them.

use crate::Grid;
use crate::paint::ShownCracks;
use crate::paint::analogy::{AnalogyError, AnalogyPair, AnalogyParams};
use crate::plugin::api::analogy::AnalogyExamples;
use crate::plugin::api::error::CrackError;
use crate::plugin::source::picture::{Space, read};
use crate::plugin::source::png;
use bevy::{
    asset::{AssetLoader, AsyncReadExt, LoadContext, LoadState, ReadAssetBytesError, io::Reader},
    prelude::*,
};
use ron::{Options, extensions::Extensions};
use serde::Deserialize;

/// A surface's picture with cracks as those of photographs.
pub(crate) struct AnalogyPicture {
    /// RGBA8, sRGB: the whole image.
    pub(crate) diffuse: Vec<u8>,
    /// RGBA8, linear, of the whole image; `None` = the normals come from the cracks.
    pub(crate) normal: Option<Vec<u8>>,
    /// The depths of the cracks that it has, and of texels beside them; of the part of the image that is shown.
    pub(crate) depth: Grid<u16>,
    /// Depth from which it has a crack.
    pub(crate) least: u16,
}

impl AnalogyPicture {
    pub(crate) const fn shown(&self) -> ShownCracks<'_> {
        ShownCracks { depth: &self.depth, least: self.least }
    }
}

/// The largest file, bytes.
const MAX_FILE: u64 = 1 << 16;

/// A file of examples.
#[derive(Deserialize)]
#[serde(rename = "AnalogyExamples", deny_unknown_fields)]
struct File {
    pairs: Vec<PairFile>,
    #[serde(default)]
    params: AnalogyParams,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PairFile {
    photo: String,
    #[serde(default)]
    mask: Option<String>,
    #[serde(default)]
    darkness: Option<f32>,
    #[serde(default)]
    normal: Option<String>,
    #[serde(default)]
    is_tileable: bool,
    #[serde(default)]
    flatten: Option<u32>,
}

/// Why a file has no examples.
#[derive(Debug, thiserror::Error)]
enum LoadError {
    #[error("{0}")]
    Io(#[from] std::io::Error),
    #[error("the file has more than {MAX_FILE} bytes")]
    TooLarge,
    #[error("not UTF-8: {0}")]
    Text(#[from] std::str::Utf8Error),
    #[error("line {line}, column {column}: {reason}")]
    Unreadable { line: usize, column: usize, reason: String },
    #[error("`{path}`: {reason}")]
    Picture { path: String, reason: String },
    #[error("a pair has either `mask` or `darkness`")]
    TwoGuides,
    #[error("{0}")]
    Analogy(#[from] AnalogyError),
}

/// A picture as it is stored.
struct Picture {
    size: UVec2,
    rgba: Vec<u8>,
}

/// Loads `*.analogy.ron`.
#[derive(TypePath, Default)]
struct ExamplesLoader;

impl AssetLoader for ExamplesLoader {
    type Asset = AnalogyExamples;
    type Settings = ();
    type Error = LoadError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        (): &(),
        context: &mut LoadContext<'_>,
    ) -> Result<AnalogyExamples, LoadError> {
        // One byte more than allowed tells that the file is too large.
        let mut bytes = Vec::new();
        reader.take(MAX_FILE + 1).read_to_end(&mut bytes).await?;
        if bytes.len() as u64 > MAX_FILE {
            return Err(LoadError::TooLarge);
        }
        let options = Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
        let file: File = options.from_str(str::from_utf8(&bytes)?).map_err(|error| {
            let (at, reason) = (error.span.end, error.code.to_string());
            LoadError::Unreadable { line: at.line, column: at.col, reason }
        })?;
        let (mut pairs, mut normals) = (Vec::new(), Vec::new());
        for pair in file.pairs {
            if pair.mask.is_some() && pair.darkness.is_some() {
                return Err(LoadError::TwoGuides);
            }
            let Picture { size, rgba } = picture(context, &pair.photo).await?;
            let made = match (&pair.mask, pair.darkness) {
                (Some(mask), _) => {
                    let mask = picture(context, mask).await?;
                    let shares = mask.rgba.iter().step_by(4).map(|value| f32::from(*value) / 255.0).collect();
                    let cracks = Grid::from_vec(mask.size, shares).unwrap_or_else(|| Grid::new(UVec2::ZERO, 0.0));
                    AnalogyPair::new(size, &rgba, cracks)?
                }
                (None, Some(lightness)) => AnalogyPair::from_darkness(size, &rgba, lightness)?,
                (None, None) => AnalogyPair::from_lines(size, &rgba)?,
            };
            let made = if pair.is_tileable { made.tileable() } else { made };
            pairs.push(match pair.flatten {
                Some(radius) => made.flattened(radius)?,
                None => made,
            });
            if let Some(normal) = &pair.normal {
                let Picture { size, rgba } = picture(context, normal).await?;
                normals.extend(Grid::from_vec(size, rgba.as_chunks().0.to_vec()));
            }
        }
        let has_normals = normals.len() == pairs.len();
        let examples = AnalogyExamples::new(pairs, &file.params)?;
        Ok(if has_normals { examples.with_normals(normals)? } else { examples })
    }

    fn extensions(&self) -> &[&str] {
        &[AnalogyExamples::EXTENSION]
    }
}

/// A picture beside the file.
async fn picture(context: &mut LoadContext<'_>, path: &str) -> Result<Picture, LoadError> {
    let refused = |reason: String| LoadError::Picture { path: path.to_owned(), reason };
    let full = context.path().resolve_embed_str(path).map_err(|error| refused(error.to_string()))?;
    // The server checks the paths of assets, not of what their loaders read.
    if full.is_unapproved() {
        return Err(refused("it lies outside the folder of assets".to_owned()));
    }
    let bytes = context.read_asset_bytes(full).await.map_err(|error| match error {
        ReadAssetBytesError::AssetReaderError(error) => refused(error.to_string()),
        error => refused(error.to_string()),
    })?;
    let image = png::decode(&bytes).map_err(refused)?;
    let size = image.size();
    // The numbers as they are stored, whatever they stand for.
    let rgba = read(&image, Space::Srgb, size).map_err(|error| refused(error.to_string()))?;
    Ok(Picture { size, rgba })
}

/// The examples; `None` if they are not there yet.
pub(crate) fn resolve(
    examples: Option<&Assets<AnalogyExamples>>,
    server: Option<&AssetServer>,
    handle: &Handle<AnalogyExamples>,
) -> Result<Option<AnalogyExamples>, CrackError> {
    let refused = |reason: &str| CrackError::Analogy { reason: reason.into() };
    let examples = examples.ok_or_else(|| refused("there are no assets: add `AssetPlugin`"))?;
    if let Some(examples) = examples.get(handle) {
        return Ok(Some(examples.clone()));
    }
    match server.and_then(|server| server.get_load_state(handle)) {
        // With backtraces on, the text goes on for pages.
        Some(LoadState::Failed(error)) => Err(refused(error.to_string().lines().next().unwrap_or_default())),
        _ => Ok(None),
    }
}

/// Makes examples assets, where there are any.
pub(crate) fn add_assets(app: &mut App) {
    if app.world().contains_resource::<AssetServer>() {
        app.init_asset::<AnalogyExamples>()
            .register_asset_reflect::<AnalogyExamples>()
            .register_asset_loader(ExamplesLoader);
    }
}
