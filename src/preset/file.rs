//! Preset files, `*.crack.ron`.

use super::{CrackPreset, PresetError};
use crate::{growth::GrowthParams, paint::Look, raster::Profile};
use ron::{Options, error::SpannedError, extensions::Extensions, ser::PrettyConfig, value::RawValue};
use serde::{
    Deserialize, Deserializer, Serialize,
    de::{DeserializeOwned, MapAccess, Visitor},
};
use std::{collections::BTreeMap, fmt};

/// A preset file with its strict structure. It is read only for its errors and their positions; missing fields are
/// not taken from the base here.
#[derive(Deserialize)]
#[serde(rename = "CrackPreset", deny_unknown_fields, default)]
struct Form {
    base: String,
    growth: GrowthParams,
    profile: Profile,
    look: Look,
    steps_per_second: f32,
    follows_lines: bool,
}

impl Default for Form {
    fn default() -> Self {
        let CrackPreset { growth, profile, look, steps_per_second, follows_lines } = CrackPreset::default();
        Self { base: DEFAULT_BASE.into(), growth, profile, look, steps_per_second, follows_lines }
    }
}

/// The base of files that do not name one.
const DEFAULT_BASE: &str = "concrete";

/// The same file: the fields that it has, without those that it leaves to its base.
#[derive(Deserialize)]
#[serde(default)]
struct Patch {
    base: String,
    growth: Fields,
    profile: Fields,
    look: Fields,
    steps_per_second: Option<f32>,
    follows_lines: Option<bool>,
}

impl Default for Patch {
    fn default() -> Self {
        let [growth, profile, look] = <[Fields; 3]>::default();
        Self { base: DEFAULT_BASE.into(), growth, profile, look, steps_per_second: None, follows_lines: None }
    }
}

/// The fields of a struct as text.
#[derive(Default)]
struct Fields(BTreeMap<String, Box<RawValue>>);

impl<'de> Deserialize<'de> for Fields {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;

        impl<'de> Visitor<'de> for Reader {
            type Value = Fields;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("fields in parentheses")
            }

            /// Called for `()`, which is a unit unless a struct is expected.
            fn visit_unit<E>(self) -> Result<Fields, E> {
                Ok(Fields::default())
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Fields, A::Error> {
                let mut fields = BTreeMap::new();
                while let Some((name, value)) = map.next_entry()? {
                    fields.insert(name, value);
                }
                Ok(Fields(fields))
            }
        }

        deserializer.deserialize_any(Reader)
    }
}

impl CrackPreset {
    /// The extension of preset files, without the first dot.
    pub const EXTENSION: &str = "crack.ron";

    /// The largest preset file, bytes.
    pub const MAX_FILE: usize = super::check::MAX_FILE;

    /// Reads a preset file in the format [RON](https://docs.rs/ron). Every field can be left out; missing fields are
    /// those of the preset that `base` names, or of concrete.
    ///
    /// ```
    /// use bevy_crack::CrackPreset;
    ///
    /// let preset = CrackPreset::from_ron(r#"(
    ///     base: "glass",
    ///     growth: (reach: 0.5, markers: DartThrowing(spacing: 0.05)),
    ///     look: (glint: 2.0),
    ///     steps_per_second: 30,
    /// )"#)?;
    /// assert_eq!((preset.growth.reach, preset.look.glint), (0.5, 2.0));
    /// assert_eq!(preset.profile, CrackPreset::GLASS.profile);
    ///
    /// let error = CrackPreset::from_ron("(look: (glimt: 2.0))").unwrap_err();
    /// assert!(error.to_string().starts_with("line 1, column 14: "), "{error}");
    /// # Ok::<(), bevy_crack::preset::PresetError>(())
    /// ```
    ///
    /// # Errors
    /// - [`PresetError::TooLarge`] if the text is longer than [`MAX_FILE`](Self::MAX_FILE);
    /// - [`PresetError::Unreadable`] if it is not RON, or has a field that a preset does not have;
    /// - [`PresetError::UnknownBase`] if `base` is not the name of a preset;
    /// - [`PresetError::OutOfRange`] if a field is out of its range.
    pub fn from_ron(text: &str) -> Result<Self, PresetError> {
        if text.len() > Self::MAX_FILE {
            return Err(PresetError::TooLarge { bytes: text.len() });
        }
        let options = options();
        options.from_str::<Form>(text).map_err(unreadable)?;
        let patch: Patch = options.from_str(text).map_err(unreadable)?;
        let base = Self::named(&patch.base).ok_or(PresetError::UnknownBase { name: patch.base })?;
        let preset = Self {
            growth: patched(&base.growth, patch.growth)?,
            profile: patched(&base.profile, patch.profile)?,
            look: patched(&base.look, patch.look)?,
            steps_per_second: patch.steps_per_second.unwrap_or(base.steps_per_second),
            follows_lines: patch.follows_lines.unwrap_or(base.follows_lines),
        };
        preset.validate()?;
        Ok(preset)
    }

    /// Writes the preset as a file with every field.
    ///
    /// ```
    /// use bevy_crack::CrackPreset;
    ///
    /// let text = CrackPreset::GLASS.to_ron()?;
    /// assert_eq!(CrackPreset::from_ron(&text)?, CrackPreset::GLASS);
    /// # Ok::<(), bevy_crack::preset::PresetError>(())
    /// ```
    ///
    /// # Errors
    /// If the preset does not [`validate`](Self::validate), and so could not be read again.
    pub fn to_ron(&self) -> Result<String, PresetError> {
        self.validate()?;
        let style = PrettyConfig::new().struct_names(false).new_line("\n");
        options().to_string_pretty(self, style).map(|text| text + "\n").map_err(unwritable)
    }
}

/// `base` with its fields replaced by `fields`.
fn patched<T: Serialize + DeserializeOwned>(base: &T, fields: Fields) -> Result<T, PresetError> {
    let options = options();
    let text = options.to_string(base).map_err(unwritable)?;
    let mut all: Fields = options.from_str(&text).map_err(unreadable)?;
    all.0.extend(fields.0);
    let fields: Vec<_> = all.0.iter().map(|(name, value)| format!("{name}:{}", value.get_ron())).collect();
    options.from_str(&format!("({})", fields.join(","))).map_err(unreadable)
}

fn options() -> Options {
    Options::default().with_default_extension(Extensions::IMPLICIT_SOME)
}

fn unreadable(error: SpannedError) -> PresetError {
    // The end is where the reader stopped; the start is that of the struct.
    let end = error.span.end;
    PresetError::Unreadable { line: end.line, column: end.col, reason: error.code.to_string() }
}

fn unwritable(error: ron::Error) -> PresetError {
    PresetError::Field { section: "preset", reason: error.to_string() }
}
