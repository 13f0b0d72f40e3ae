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
        assert_eq!(read("follows_lines: true"), CrackPreset { follows_lines: true, ..base.clone() });
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
        ("(growth: (markers: Rays(sectors: 3)))", "jitter"),
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
        // What is open at each depth.
        let mut open = [""; 6];
        for line in text.lines() {
            let trimmed = line.trim();
            let depth = (line.len() - line.trim_start().len()) / 4;
            let Some((field, value)) = trimmed.split_once(": ") else { continue };
            open[depth..].fill("");
            open[depth] = if value.ends_with(['(', '[']) { field } else { "" };
            let value = value.trim_end_matches(',');
            // Whole numbers cannot be NaN in a file.
            if !value.contains('.') || value.parse::<f32>().is_err() {
                continue;
            }
            let groups = open[..depth].iter().filter(|name| !name.is_empty());
            let full: String = groups.flat_map(|name| [*name, "."]).chain([field]).collect();
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

#[cfg(all(feature = "2d", feature = "3d"))]
mod in_apps {
    use super::CrackPreset;
    use crate::support::{
        add, center, counts, finish, hit, picture, settle, shown, single_threaded, small_preset, state, step, steps,
        wait_for, warnings,
    };
    use bevy::{
        asset::AssetLoadFailedEvent,
        image::{CompressedImageFormats, ImageLoader, TextureAtlasLayout},
        prelude::*,
    };
    use bevy_crack::prelude::*;
    use std::path::PathBuf;

    const FILE: &str = "mine.crack.ron";

    /// An app whose assets lie in a folder of its own.
    struct Folder {
        path: PathBuf,
        app: App,
    }

    impl Folder {
        fn new(name: &str) -> Self {
            let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
            std::fs::create_dir_all(&path).unwrap();
            let mut app = App::new();
            let assets = AssetPlugin {
                file_path: path.to_str().unwrap().to_owned(),
                // Files are loaded anew when the test says so.
                watch_for_changes_override: Some(false),
                ..default()
            };
            app.add_plugins((MinimalPlugins, TransformPlugin, assets, ImagePlugin::default(), CrackPlugins))
                .register_asset_loader(ImageLoader::new(CompressedImageFormats::NONE))
                .init_asset::<TextureAtlasLayout>()
                .init_asset::<Mesh>()
                .init_asset::<ColorMaterial>()
                .init_asset::<StandardMaterial>();
            finish(&mut app);
            single_threaded(&mut app);
            app.update();
            Self { path, app }
        }

        fn write(&self, text: &str) {
            std::fs::write(self.path.join(FILE), text).unwrap();
        }

        fn load(&self) -> Handle<CrackPreset> {
            self.app.world().resource::<AssetServer>().load(FILE)
        }

        /// Writes and loads the file anew, and waits until it is there or, if `is_broken`, refused.
        fn rewrite(&mut self, text: &str, preset: &Handle<CrackPreset>, is_broken: bool) {
            self.write(text);
            let world = self.app.world();
            let mut failures = world.resource::<Messages<AssetLoadFailedEvent<CrackPreset>>>().get_cursor_current();
            let before = world.resource::<Assets<CrackPreset>>().get(preset).cloned();
            world.resource::<AssetServer>().reload(FILE);
            let id = preset.id();
            wait_for(&mut self.app, "the file", |app| {
                let failed = app.world().resource::<Messages<AssetLoadFailedEvent<CrackPreset>>>();
                let is_new = app.world().resource::<Assets<CrackPreset>>().get(id) != before.as_ref();
                let is_refused = failures.read(failed).count() > 0;
                assert!(if is_broken { !is_new } else { !is_refused });
                is_new || is_refused
            });
            // The change is told in one frame, read in the next.
            steps(&mut self.app, 3);
        }

        fn spawn(&mut self, preset: impl Into<PresetSource>) -> Entity {
            let image = add(&mut self.app, picture(UVec2::splat(64)));
            self.app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(preset))).id()
        }
    }

    #[test]
    fn a_preset_in_a_file_cracks_as_one_in_the_component() {
        let mut folder = Folder::new("preset_file");
        let preset = small_preset();
        folder.write(&preset.to_ron().unwrap());
        let from_file = folder.load();
        let (a, b) = (folder.spawn(from_file), folder.spawn(preset));
        for entity in [a, b] {
            hit(&mut folder.app, center(entity));
        }
        step(&mut folder.app);
        for entity in [a, b] {
            settle(&mut folder.app, entity);
        }
        assert!(shown(&folder.app, a) == shown(&folder.app, b), "the same cracks");
        assert_eq!(counts(&folder.app).applied, 2);
    }

    #[test]
    fn a_missing_or_broken_file_fails_the_surface_until_it_is_whole() {
        let mut folder = Folder::new("preset_broken");
        folder.write("(growth: (kill_distance: -1.0))");
        let preset = folder.load();
        let missing = folder.app.world().resource::<AssetServer>().load("nowhere.crack.ron");
        let entities = [folder.spawn(preset.clone()), folder.spawn(missing)];
        for entity in entities {
            hit(&mut folder.app, center(entity));
        }
        let heard = warnings(|| {
            for entity in entities {
                wait_for(&mut folder.app, "the failure", |app| {
                    matches!(state(app, entity).status, CrackStatus::Failed(_))
                });
            }
            // Further hits are refused without another word.
            for entity in entities {
                hit(&mut folder.app, center(entity));
            }
            steps(&mut folder.app, 5);
        });
        assert_eq!(heard.len(), 2, "{heard:#?}");
        let reason = format!("{:?}", state(&folder.app, entities[0]).status);
        assert!(reason.contains("`growth.kill_distance` is -1, must lie in"), "{reason}");
        let reason = format!("{:?}", state(&folder.app, entities[1]).status);
        assert!(reason.contains("nowhere.crack.ron"), "{reason}");
        assert_eq!(counts(&folder.app).rejected, 4);
        // Whole again, it cracks.
        folder.rewrite(&small_preset().to_ron().unwrap(), &preset, false);
        hit(&mut folder.app, center(entities[0]));
        settle(&mut folder.app, entities[0]);
    }

    /// One save, one error: the engine tries twice to load anew what it could not.
    #[test]
    fn f3_one_save_of_a_broken_file_is_one_error() {
        let mut folder = Folder::new("preset_one_error");
        let mut told =
            folder.app.world().resource::<Messages<AssetLoadFailedEvent<CrackPreset>>>().get_cursor_current();
        // The engine's log says each of these.
        let mut save = |folder: &mut Folder, text: &str, errors: usize| {
            folder.write(text);
            folder.app.world().resource::<AssetServer>().reload(FILE);
            let mut failed = Vec::new();
            for _ in 0..40 {
                std::thread::sleep(std::time::Duration::from_millis(5));
                step(&mut folder.app);
                let events = folder.app.world().resource::<Messages<AssetLoadFailedEvent<CrackPreset>>>();
                failed.extend(told.read(events).map(|event| event.error.to_string()));
            }
            assert_eq!(failed.len(), errors, "{failed:#?}");
            failed.pop().unwrap_or_default()
        };
        let status = |folder: &mut Folder, entity: Entity| {
            hit(&mut folder.app, center(entity));
            steps(&mut folder.app, 3);
            state(&folder.app, entity).status
        };
        // Broken from the start, and saved as broken, in the same way and in another.
        folder.write("((((");
        let handle = folder.load();
        let early = folder.spawn(handle.clone());
        wait_for(&mut folder.app, "the failure", |app| {
            matches!(
                app.world().resource::<AssetServer>().get_load_state(&handle),
                Some(bevy::asset::LoadState::Failed(_))
            )
        });
        steps(&mut folder.app, 5);
        assert!(matches!(status(&mut folder, early), CrackStatus::Failed(CrackError::Preset { .. })));
        save(&mut folder, "(growth: (reach: NaN))", 1);
        assert!(matches!(status(&mut folder, early), CrackStatus::Failed(CrackError::Preset { .. })));
        for _ in 0..3 {
            let error = save(&mut folder, "(growth: (reach: -1.0))", 1);
            assert!(error.contains("`growth.reach` is -1"), "{error}");
            assert!(matches!(status(&mut folder, early), CrackStatus::Failed(CrackError::Preset { .. })));
        }
        // Whole, and broken again: what was there before stays.
        let good = small_preset();
        save(&mut folder, &good.to_ron().unwrap(), 0);
        assert!(!matches!(status(&mut folder, early), CrackStatus::Failed(_)));
        settle(&mut folder.app, early);
        let before = shown(&folder.app, early);
        for broken in ["((((", "(gorwth: ())", "(gorwth: ())"] {
            let heard = warnings(|| _ = save(&mut folder, broken, 1));
            assert_eq!(heard, [""; 0], "the asset server has said it");
            assert_eq!(folder.app.world().resource::<Assets<CrackPreset>>().get(&handle), Some(&good));
            assert!(shown(&folder.app, early) == before, "it changes nothing");
            let late = folder.spawn(handle.clone());
            assert!(!matches!(status(&mut folder, late), CrackStatus::Failed(_)), "it can still be used");
        }
    }

    /// E8 for files: new steps take up what has changed, what is drawn stays, and a broken file changes nothing.
    #[test]
    fn a_changed_file_is_taken_up_while_cracks_grow() {
        let mut folder = Folder::new("preset_reload");
        let preset = CrackPreset { steps_per_second: 10.0, ..CrackPreset::CONCRETE };
        folder.write(&preset.to_ron().unwrap());
        let handle = folder.load();
        let entity = folder.spawn(handle.clone());
        let other = folder.spawn(preset.clone());
        for entity in [entity, other] {
            hit(&mut folder.app, center(entity));
        }
        wait_for(&mut folder.app, "some nodes", |app| state(app, entity).nodes > 6);
        // Halted: nothing grows, nothing goes.
        folder.rewrite("(steps_per_second: 0)", &handle, false);
        let (nodes, before) = (state(&folder.app, entity).nodes, shown(&folder.app, entity));
        steps(&mut folder.app, 30);
        assert_eq!(
            (state(&folder.app, entity).nodes, state(&folder.app, entity).status),
            (nodes, CrackStatus::Growing)
        );
        // Broken: the old one stays.
        for broken in ["(growth: (reach: NaN))", "((((", "(gorwth: ())"] {
            let heard = warnings(|| folder.rewrite(broken, &handle, true));
            assert_eq!(heard, [""; 0], "the asset server has said it");
            steps(&mut folder.app, 10);
            assert_eq!(state(&folder.app, entity).nodes, nodes);
            assert!(shown(&folder.app, entity) == before, "a broken file changes nothing");
        }
        // Another look is painted at once; what was drawn stays where it is.
        folder.rewrite(
            "(steps_per_second: 0, look: (ramp: [(depth: 0.01, color: (1, 0, 0), cover: 1)], glint: 0, grain: 0))",
            &handle,
            false,
        );
        let red = shown(&folder.app, entity);
        let clean = picture(UVec2::splat(64)).data.unwrap();
        let cracked =
            |texels: &[u8]| -> Vec<bool> { texels.chunks(4).zip(clean.chunks(4)).map(|(a, b)| a != b).collect() };
        assert!(red != before, "the look has changed");
        // Slopes light the texel beside a crack as well; this look has none.
        let (was, is) = (cracked(&before), cracked(&red));
        let around = |i: usize| [0, 1, 63, 64, 65].into_iter().flat_map(move |d| [i.checked_sub(d), i.checked_add(d)]);
        for (i, _) in was.iter().enumerate().filter(|(_, was)| **was) {
            assert!(around(i).flatten().any(|i| is.get(i) == Some(&true)), "a texel that was cracked is whole");
        }
        // And it grows on.
        folder.rewrite("(steps_per_second: 500)", &handle, false);
        settle(&mut folder.app, entity);
        assert!(state(&folder.app, entity).nodes > nodes);
        // The other surface has never heard of the file.
        assert!(state(&folder.app, other).nodes > 0);
    }
}
