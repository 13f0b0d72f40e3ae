//! Presets as files and as assets.
//!
//! `UPDATE_PRESETS=1 cargo test presets` writes `assets/presets` anew from the constants.

use bevy_crack::{
    CrackPreset,
    growth::{GrowthParams, MarkerLayout, StartLayout},
    math::Rng,
    paint::Look,
    preset::PresetError,
};
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/presets")
}

fn constants() -> impl Iterator<Item = (&'static str, CrackPreset)> {
    CrackPreset::NAMES.into_iter().map(|name| (name, CrackPreset::named(name).unwrap()))
}

#[test]
fn every_constant_has_its_file() {
    let updates = std::env::var_os("UPDATE_PRESETS").is_some();
    for (name, preset) in constants() {
        let path = folder().join(format!("{name}.{}", CrackPreset::EXTENSION));
        let text = preset.to_ron().unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(CrackPreset::from_ron(&text).unwrap(), preset, "{name}, written and read");
        if updates {
            std::fs::create_dir_all(folder()).unwrap();
            std::fs::write(&path, &text).unwrap();
        }
        let stored = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!(stored.replace("\r\n", "\n"), text, "{name}: is the file old? UPDATE_PRESETS=1 writes it anew");
    }
    let files = std::fs::read_dir(folder()).unwrap().count();
    assert_eq!(files, CrackPreset::NAMES.len(), "a file without a constant in {}", folder().display());
}

#[test]
fn what_a_file_leaves_out_is_as_in_its_base() {
    assert_eq!(CrackPreset::from_ron("()"), Ok(CrackPreset::CONCRETE));
    for (name, base) in constants() {
        let read = |fields: &str| CrackPreset::from_ron(&format!("(base: \"{name}\", {fields})")).unwrap();
        assert_eq!(read(""), base);
        assert_eq!(read("growth: (), profile: (), look: ()"), base);
        assert_eq!(read("steps_per_second: 7"), CrackPreset { steps_per_second: 7.0, ..base.clone() });
        let growth = GrowthParams {
            markers: MarkerLayout::DartThrowing { spacing: 0.25 },
            starts: StartLayout::Point,
            wander: 0.125,
            ..base.growth.clone()
        };
        assert_eq!(
            read("growth: (markers: DartThrowing(spacing: 0.25), /* a note */ starts: Point, wander: 0.125)"),
            CrackPreset { growth, ..base.clone() }
        );
        // A ramp is taken as a whole: shorter or longer than the base's.
        let look = |ramp| CrackPreset { look: Look { ramp, ..base.look.clone() }, ..base.clone() };
        assert_eq!(read("look: (ramp: [])"), look(vec![].into()));
        assert_eq!(read("look: (ramp: [(depth: 0.5, color: (1, 0, 0.5), cover: 1)])").look.ramp.len(), 1);
        assert_eq!(read("look: (opaque: true, grain: 1.0)").look.ramp, base.look.ramp);
    }
}

/// Part of the error that a text must give.
fn refused(text: &str) -> String {
    CrackPreset::from_ron(text).map_or_else(|error| error.to_string(), |preset| panic!("{text} is {preset:?}"))
}

#[test]
fn broken_files_say_where_and_what() {
    for (text, part) in [
        ("", "line 1, column 1"),
        ("(", "line 1, column 2: Unexpected end"),
        ("(growth: (kill_distanc: 0.1))", "line 1, column 23: Unexpected field named `kill_distanc`"),
        ("(growht: ())", "Unexpected field named `growht` in `CrackPreset`"),
        ("(growth: (),\n\n growth: ())", "line 3"),
        ("(growth: (kill_distance: \"0.1\"))", "line 1, column 26"),
        ("(growth: (kill_distance: 0.1, kill_distance: 0.1))", "kill_distance"),
        ("(growth: (markers: Polar(sectors: 3)))", "rings"),
        ("(growth: (markers: Hexagons))", "Hexagons"),
        ("(growth: (num_iterations: -1))", "line 1"),
        ("(growth: {\"kill_distance\": 0.1})", "line 1"),
        ("(growth: [0.1])", "line 1"),
        ("(look: (ramp: [(depth: 0.5)]))", "color"),
        ("(base: \"glas\")", "`base`: there is no preset `glas`; there are glass"),
        ("(base: 3)", "line 1"),
        ("() ()", "line 1"),
        // Out of range, by full name.
        ("(growth: (kill_distance: -0.5))", "`growth.kill_distance` is -0.5, must lie in 0.0005..="),
        ("(growth: (reach: NaN))", "`growth.reach` is NaN"),
        ("(growth: (reach: inf))", "`growth.reach` is inf"),
        ("(growth: (max_nodes: 4294967295))", "`growth.max_nodes` is 4294967295, must lie in 1..=1000000"),
        ("(growth: (markers: DartThrowing(spacing: 9.0)))", "`growth.markers.spacing` is 9, must lie in 0.002..=1"),
        ("(growth: (starts: Ring(count: 0, radius: 0.1)))", "`growth.starts.count` is 0"),
        ("(growth: (starts: Disc(count: 1, radius: -0.1)))", "`growth.starts.radius` is -0.1"),
        ("(profile: (depth: 1.5))", "`profile.depth` is 1.5, must lie in 0..=1"),
        ("(profile: (full_width: 0))", "`profile.full_width` is 0, must lie in 0.0001..=1"),
        ("(profile: (wall: -1))", "`profile.wall` is -1"),
        ("(profile: (rim_width: 1))", "`profile.rim_width` is 1"),
        ("(profile: (rim_depth: NaN))", "`profile.rim_depth` is NaN"),
        ("(profile: (faintest: 2))", "`profile.faintest` is 2"),
        ("(look: (glint: 5))", "`look.glint` is 5"),
        ("(look: (ramp: [(depth: 2, color: (0, 0, 0), cover: 0)]))", "`look.ramp.depth` is 2"),
        ("(steps_per_second: -1)", "`steps_per_second` is -1, must lie in 0..=10000"),
    ] {
        let error = refused(text);
        assert!(error.contains(part), "{text}\n  gives  {error}\n  not    {part}");
    }
}

/// Every number of every preset, set to what it must not be, is refused by its own full name.
#[test]
fn every_number_is_checked() {
    for (name, preset) in constants() {
        let text = preset.to_ron().unwrap();
        let mut checked = 0;
        let (mut section, mut group) = ("", "");
        for line in text.lines() {
            let trimmed = line.trim();
            let depth = (line.len() - line.trim_start().len()) / 4;
            let Some((field, value)) = trimmed.split_once(": ") else { continue };
            if depth == 1 {
                section = if value == "(" { field } else { "" };
            }
            if depth == 2 {
                group = if value.ends_with('(') { field } else { "" };
            }
            let value = value.trim_end_matches(',');
            // Whole numbers cannot be NaN in a file.
            if !value.contains('.') || value.parse::<f32>().is_err() {
                continue;
            }
            let full = match (section, depth) {
                ("", _) => field.to_owned(),
                (_, 2) => format!("{section}.{field}"),
                ("look", _) => format!("look.ramp.{field}"),
                _ => format!("{section}.{group}.{field}"),
            };
            let broken = text.replacen(line, &line.replace(value, "NaN"), 1);
            // The same line may stand above under another name.
            if text.find(line) == Some(line.as_ptr() as usize - text.as_ptr() as usize) {
                assert!(refused(&broken).contains(&format!("`{full}` is NaN")), "{name}: {full}: {}", refused(&broken));
                checked += 1;
            }
        }
        assert!(checked > 20, "{name}: {checked} numbers");
    }
}

#[test]
fn files_without_end_are_refused_at_once() {
    let long = format!("({})", " ".repeat(CrackPreset::MAX_FILE));
    assert_eq!(CrackPreset::from_ron(&long), Err(PresetError::TooLarge { bytes: long.len() }));
    for open in ["(", "[", "{", "Some(", "(growth:", "(growth:(markers:", "/*"] {
        let deep = open.repeat(CrackPreset::MAX_FILE / open.len());
        assert!(CrackPreset::from_ron(&deep).is_err());
    }
}

#[test]
fn damaged_files_are_errors_or_valid_presets() {
    let mut rng = Rng::new(11);
    let (mut good, mut bad) = (0, 0);
    for (_, preset) in constants() {
        let text = preset.to_ron().unwrap();
        for _ in 0..1_000 {
            let mut bytes = text.clone().into_bytes();
            for _ in 0..1 + (rng.unit() * 3.0) as usize {
                let at = (rng.unit() * bytes.len() as f32) as usize;
                match (rng.unit() * 3.0) as u32 {
                    0 => drop(bytes.remove(at)),
                    1 => bytes[at] = b"()[]{},:.-+0123456789aeN\"'\\/*\n\0\xff"[(rng.unit() * 32.0) as usize],
                    _ => bytes.truncate(at + 1),
                }
            }
            match CrackPreset::from_ron(&String::from_utf8_lossy(&bytes)) {
                Ok(preset) => {
                    preset.validate().unwrap();
                    good += 1;
                }
                Err(_) => bad += 1,
            }
        }
    }
    assert!(good > 50 && bad > 500, "{good} good, {bad} bad");
}
