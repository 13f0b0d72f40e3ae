//! Cracks of a game that are shown as those of photographs: made by tasks, grown, healed, changed, refused.

use crate::support::*;
use bevy::{asset::RenderAssetUsages, prelude::*, render::render_resource::TextureFormat};
use bevy_crack::{
    Grid,
    math::Rng,
    paint::{
        Look,
        analogy::{AnalogyPair, AnalogyParams},
    },
    prelude::*,
};
use std::{fs, path::PathBuf, time::Duration};

/// What was told of analogies.
#[derive(Resource, Default)]
struct Told {
    made: Vec<Entity>,
    failed: Vec<CrackError>,
}

fn watch(mut app: App) -> App {
    app.init_resource::<Told>()
        .add_observer(|made: On<AnalogyMade>, mut told: ResMut<Told>| told.made.push(made.entity))
        .add_observer(|failed: On<AnalogyFailed>, mut told: ResMut<Told>| told.failed.push(failed.error.clone()));
    app
}

fn told(app: &App) -> &Told {
    app.world().resource::<Told>()
}

fn progress(app: &App, entity: Entity) -> f32 {
    get::<AnalogyProgress>(app, entity).0
}

/// Frames with a little time for tasks, until something holds.
fn wait(app: &mut App, what: &str, mut holds: impl FnMut(&App) -> bool) {
    wait_for(app, what, |app| {
        std::thread::sleep(Duration::from_millis(1));
        holds(app)
    });
}

fn wait_for_news(app: &mut App) {
    let before = told(app).made.len() + told(app).failed.len();
    wait(app, "news of the analogy", |app| told(app).made.len() + told(app).failed.len() > before);
}

/// Blue of all texels of the photograph, and of no others.
const TAG: u8 = 7;

/// A photograph of 64 x 64 texels: speckled, with two dark red cracks.
fn photo() -> AnalogyPair {
    let size = UVec2::splat(64);
    let is_crack = |i: usize| (i % 64).abs_diff(20) < 2 || (i / 64).abs_diff(40) < 3;
    let texel = |i: usize| {
        if is_crack(i) { [90 + (i % 5) as u8, 10, TAG, 255] } else { [200, 150 + (i * 7 % 31) as u8, TAG, 255] }
    };
    let rgba: Vec<u8> = (0..64 * 64).flat_map(texel).collect();
    let cracks = (0..64 * 64).map(|i| f32::from(u8::from(is_crack(i)))).collect();
    AnalogyPair::new(size, &rgba, Grid::from_vec(size, cracks).unwrap()).unwrap()
}

fn examples() -> AnalogyExamples {
    AnalogyExamples::new(vec![photo()], &AnalogyParams::DEFAULT).unwrap()
}

/// Wide cracks without crushed zones.
fn preset() -> CrackPreset {
    let mut preset = CrackPreset { look: Look::GROOVE, ..CrackPreset::CONCRETE };
    (preset.growth.line_width, preset.growth.max_width) = (0.02, 0.06);
    preset
}

const SIZE: UVec2 = UVec2::new(120, 96);

/// A sprite with an analogy whose first picture is there.
fn spawn(app: &mut App, change: impl FnOnce(CrackAnalogy) -> CrackAnalogy) -> (Entity, Handle<Image>) {
    let (image, examples) = (add(app, picture(SIZE)), add(app, examples()));
    let surface = CrackSurface::new(preset()).with_seed(3);
    let analogy = change(CrackAnalogy::new(examples));
    let entity = app.world_mut().spawn((Sprite::from_image(image.clone()), surface, analogy)).id();
    wait_for_news(app);
    assert_eq!((told(app).made.as_slice(), told(app).failed.as_slice()), (&[entity][..], &[][..]));
    assert_eq!(progress(app, entity), 1.0);
    (entity, image)
}

/// Texels that are neither those of the picture nor of the photograph, and those that are of its cracks.
fn count(app: &App, entity: Entity, own: &[u8]) -> (usize, usize) {
    let shown = shown(app, entity);
    let texels = shown.as_chunks::<4>().0.iter().zip(own.as_chunks::<4>().0);
    let strange = texels.clone().filter(|(shown, own)| shown != own && shown[2] != TAG).count();
    (strange, texels.filter(|(shown, own)| shown != own && shown[1] == 10).count())
}

/// Before any crack the picture is as it was. Cracks show at once, become those of the photograph, bit for bit, and
/// all else stays as it is; the network does not depend on it. Healing gives the picture back.
#[test]
fn cracks_become_those_of_a_photograph() {
    let mut app = watch(app());
    let (entity, image) = spawn(&mut app, |analogy| analogy);
    let own = texels(&app, &image);
    assert_ne!(image_of(&app, entity), image, "it is prepared");
    assert!(shown(&app, entity) == own);
    let plain = {
        let plain =
            app.world_mut().spawn((Sprite::from_image(image.clone()), CrackSurface::new(preset()).with_seed(3)));
        let plain = plain.id();
        hit(&mut app, center(plain).with_energy(2.0));
        settle(&mut app, plain);
        plain
    };
    hit(&mut app, center(entity).with_energy(2.0));
    step(&mut app);
    step(&mut app);
    assert!(shown(&app, entity) != own, "what is not made yet is shown in the look of the preset");
    settle(&mut app, entity);
    wait(&mut app, "the cracks of the photograph", |app| count(app, entity, &own).0 == 0);
    let (_, cracks) = count(&app, entity, &own);
    assert!(cracks > 100, "{cracks}");
    assert_eq!(state(&app, entity).nodes, state(&app, plain).nodes);
    // Far from all cracks, which the plain surface shows, nothing has changed.
    let window = (AnalogyParams::DEFAULT.reach + AnalogyParams::DEFAULT.margin + 2) as i32;
    let (with, without) = (shown(&app, entity), shown(&app, plain));
    let cracked = |x: i32, y: i32| {
        let at = 4 * (y * SIZE.x as i32 + x) as usize;
        without[at..at + 4] != own[at..at + 4]
    };
    let (width, height) = (SIZE.x as i32, SIZE.y as i32);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let rows = (y - window).max(0)..(y + window + 1).min(height);
        let columns = (x - window).max(0)..(x + window + 1).min(width);
        let is_far = !rows.into_iter().any(|y| columns.clone().any(|x| cracked(x, y)));
        let at = 4 * (y * width + x) as usize;
        assert!(!is_far || with[at..at + 4] == own[at..at + 4], "{x}, {y}");
    }
    app.world_mut().commands().entity(entity).heal_cracks();
    app.update();
    assert_eq!((image_of(&app, entity), progress(&app, entity)), (image.clone(), 0.0));
    // It cracks again as it did.
    hit(&mut app, center(entity).with_energy(2.0));
    settle(&mut app, entity);
    wait(&mut app, "the cracks of the photograph once more", |app| {
        let (strange, cracks) = count(app, entity, &own);
        strange == 0 && cracks > 100
    });
}

/// Without the component the surface is as one that never had it; with another one it is made anew.
#[test]
fn analogies_change_and_go() {
    let mut app = watch(app());
    let (entity, image) = spawn(&mut app, |analogy| analogy);
    let own = texels(&app, &image);
    let plain = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(preset()).with_seed(3))).id();
    for entity in [entity, plain] {
        hit(&mut app, center(entity));
        settle(&mut app, entity);
    }
    wait(&mut app, "its cracks", |app| count(app, entity, &own).0 == 0);
    app.world_mut().get_mut::<CrackAnalogy>(entity).unwrap().keeps_picture = false;
    wait_for_news(&mut app);
    wait(&mut app, "all its texels", |app| shown(app, entity).as_chunks::<4>().0.iter().all(|texel| texel[2] == TAG));
    assert_eq!(told(&app).made.len(), 2);
    app.world_mut().entity_mut(entity).remove::<CrackAnalogy>();
    steps(&mut app, 3);
    assert!(shown(&app, entity) == shown(&app, plain), "the look of the preset");
    // Cancelled in the middle of it, and by despawning.
    let examples = add(&mut app, examples());
    for end in 0..2 {
        app.world_mut().entity_mut(entity).insert(CrackAnalogy::new(examples.clone()));
        steps(&mut app, 2);
        if end == 0 {
            app.world_mut().entity_mut(entity).remove::<CrackAnalogy>();
            steps(&mut app, 2);
            assert!(shown(&app, entity) == shown(&app, plain));
        } else {
            app.world_mut().despawn(entity);
        }
    }
    steps(&mut app, 50);
    assert_eq!((told(&app).made.len(), told(&app).failed.len()), (2, 0));
}

/// Time that runs backwards takes the cracks of the photograph back; baked cracks become its own as well.
#[test]
fn clocks_and_baked_cracks() {
    let mut app = watch(app());
    let (entity, image) = spawn(&mut app, |analogy| analogy);
    let own = texels(&app, &image);
    hit(&mut app, center(entity).with_energy(2.0));
    settle(&mut app, entity);
    wait(&mut app, "its cracks", |app| count(app, entity, &own).0 == 0);
    app.world_mut().entity_mut(entity).insert(CrackClock::speed(-1.0));
    wait(&mut app, "the way back", |app| shown(app, entity) == own);
    app.world_mut().entity_mut(entity).remove::<CrackClock>();

    let mut bars = Grid::new(UVec2::new(6, 1), 0.0);
    bars.row_mut(0).copy_from_slice(&[0.0, 1.0, 0.0, 1.0, 0.0, 1.0]);
    app.world_mut().entity_mut(entity).insert(GuidedCracks::new(CrackGuide::new(bars)));
    wait(&mut app, "baked cracks", |app| {
        let (strange, cracks) = count(app, entity, &own);
        state(app, entity).status == CrackStatus::Done && strange == 0 && cracks > 100
    });
}

/// Normals come along with the colours where the photograph has them.
#[test]
fn normals_are_carried_over() {
    const FLAT: [u8; 4] = [128, 128, 255, 255];
    const LEANING: [u8; 4] = [201, 128, 230, 255];
    let mut app = watch(app());
    let normals = Grid::new(UVec2::splat(64), LEANING);
    let examples = examples().with_normals(vec![normals]).unwrap();
    let examples = add(&mut app, examples);
    let image = add(&mut app, picture(SIZE));
    let surface =
        CrackSurface { write: CrackMaps { normal: true, ..default() }, ..CrackSurface::new(preset()).with_seed(3) };
    let entity = app.world_mut().spawn((Sprite::from_image(image.clone()), surface, CrackAnalogy::new(examples))).id();
    wait_for_news(&mut app);
    let normal = get::<CrackTextures>(&app, entity).normal.unwrap();
    assert!(texels(&app, &normal).as_chunks::<4>().0.iter().all(|texel| *texel == FLAT));
    hit(&mut app, center(entity).with_energy(2.0));
    settle(&mut app, entity);
    let own = texels(&app, &image);
    // A groove too shallow to change a colour still tilts its normal, so the colours may be done first.
    let strange = |app: &App| {
        let (shown, normals) = (shown(app, entity), texels(app, &normal));
        let (shown, own) = (shown.as_chunks::<4>().0, own.as_chunks::<4>().0);
        let expected = shown.iter().zip(own).map(|(shown, own)| if shown == own { FLAT } else { LEANING });
        normals.as_chunks().0.iter().zip(expected).filter(|(normal, expected)| *normal != expected).count()
    };
    wait(&mut app, "its cracks and normals", |app| count(app, entity, &own).0 == 0 && strange(app) == 0);
    assert!(count(&app, entity, &own).1 > 100);
    steps(&mut app, 20);
    assert_eq!(strange(&app), 0, "it stays so");
}

/// The examples that ship can be loaded, and are what the command line copies from.
#[test]
fn shipped_examples_load() {
    let mut app = watch(app());
    for name in ["clay", "concrete", "paving"] {
        let file = format!("analogies/{name}.{}", AnalogyExamples::EXTENSION);
        let examples: Handle<AnalogyExamples> = app.world().resource::<AssetServer>().load(file);
        wait(&mut app, name, |app| app.world().resource::<Assets<AnalogyExamples>>().get(&examples).is_some());
        let examples = app.world().resource::<Assets<AnalogyExamples>>().get(&examples).unwrap();
        assert_eq!(examples.pairs().len(), 1);
        assert!(examples.pairs()[0].cracks().as_slice().contains(&1.0), "{name}");
    }
}

/// A folder of assets that goes with this.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("bevy_crack_analogies_{name}_{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn app(&self) -> App {
        let mut app = App::new();
        let assets = AssetPlugin { file_path: self.0.to_str().unwrap().to_owned(), ..default() };
        app.add_plugins((MinimalPlugins, TransformPlugin, assets, ImagePlugin::default(), CrackPlugins));
        start(&mut app);
        watch(app)
    }

    fn png(&self, name: &str, size: u32, texel: impl Fn(u32, u32) -> [u8; 3]) {
        let picture = image::RgbImage::from_fn(size, size, |x, y| image::Rgb(texel(x, y)));
        picture.save(self.0.join(name)).unwrap();
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// E9: files that are broken or missing, pictures that do not fit, and surfaces that are too small are one error each; the
/// surface cracks in the look of its preset, and what is asked for next is made.
#[test]
fn e9_analogies_that_cannot_be_made() {
    let folder = Folder::new("e9");
    folder.png("photo.png", 48, |x, _| if x % 24 == 8 { [20, 20, 20] } else { [180, 170, 160] });
    folder.png("mask.png", 48, |x, _| [if x % 24 == 8 { 255 } else { 0 }; 3]);
    folder.png("dark.png", 48, |_, _| [0; 3]);
    folder.png("small.png", 8, |x, _| [if x == 4 { 255 } else { 0 }; 3]);
    fs::write(folder.0.join("broken.png"), b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0").unwrap();
    // 20,000 texels a side.
    fs::write(folder.0.join("huge.png"), b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x4e\x20\0\0\x4e\x20\x08\x02").unwrap();
    let cases = [
        ("(pairs: [(photo: \"photo.png\", mask: \"gone.png\")])", "gone.png"),
        ("(pairs: [(photo: \"huge.png\")])", "20000 x 20000"),
        ("(pairs: [(photo: \"broken.png\")])", "no PNG"),
        ("(pairs: [(photo: \"photo.png\", mask: \"small.png\")])", "8 x 8"),
        ("(pairs: [(photo: \"small.png\")])", "8 x 8"),
        ("(pairs: [(photo: \"photo.png\", mask: \"dark.png\")])", "no crack"),
        ("(pairs: [(photo: \"photo.png\", mask: \"mask.png\", darkness: 0.5)])", "either"),
        ("(pairs: [(photo: \"photo.png\", darkness: 7)])", "must lie in"),
        ("(pairs: [(photo: \"photo.png\", mask: \"mask.png\", normal: \"small.png\")])", "8 x 8"),
        ("(pairs: [(photo: \"photo.png\", mask: \"mask.png\")], params: (reach: 0))", "reach"),
        ("(pairs: [(photo: \"photo.png\", mask: \"mask.png\")], params: (tries: -1))", "line 1"),
        ("(pairs: [(picture: \"photo.png\")])", "picture"),
        ("(pairs: [])", "0 pairs"),
        ("words", "line 1"),
        ("", "line 1"),
    ];
    for (i, (text, _)) in cases.iter().enumerate() {
        fs::write(folder.0.join(format!("{i}.analogy.ron")), text).unwrap();
    }
    fs::write(folder.0.join("good.analogy.ron"), "(pairs: [(photo: \"photo.png\", mask: \"mask.png\")])").unwrap();
    let mut app = folder.app();
    let good = app.world().resource::<AssetServer>().load::<AnalogyExamples>("good.analogy.ron");
    let image = add(&mut app, picture(SIZE));
    for (i, (text, reason)) in cases.iter().enumerate() {
        let examples = app.world().resource::<AssetServer>().load(format!("{i}.analogy.ron"));
        let surface = (Sprite::from_image(image.clone()), CrackSurface::new(preset()));
        let entity = app.world_mut().spawn((surface, CrackAnalogy::new(examples))).id();
        wait_for_news(&mut app);
        let error = told(&app).failed.last().unwrap().to_string();
        assert!(error.contains(reason), "{text}: {error}");
        steps(&mut app, 5);
        assert_eq!((told(&app).failed.len(), told(&app).made.len()), (i + 1, i), "once: {text}");
        hit(&mut app, center(entity));
        settle(&mut app, entity);
        assert!(shown(&app, entity) != texels(&app, &image), "it cracks: {text}");
        app.world_mut().get_mut::<CrackAnalogy>(entity).unwrap().examples = good.clone();
        wait_for_news(&mut app);
        assert_eq!((told(&app).failed.len(), told(&app).made.len()), (i + 1, i + 1), "{text}");
        app.world_mut().despawn(entity);
    }
    // Surfaces that are too small for it, and a frame of an atlas that is shown after another one.
    let (count, made) = (told(&app).failed.len(), told(&app).made.len());
    let tiny = add(&mut app, picture(UVec2::new(9, 40)));
    let surface = (Sprite::from_image(tiny), CrackSurface::new(preset()));
    app.world_mut().spawn((surface, CrackAnalogy::new(good.clone())));
    wait_for_news(&mut app);
    let sprite = Sprite { rect: Some(Rect::new(0.0, 0.0, 60.0, 96.0)), ..Sprite::from_image(image.clone()) };
    let entity = app.world_mut().spawn((sprite, CrackSurface::new(preset()), CrackAnalogy::new(good))).id();
    wait_for_news(&mut app);
    assert_eq!((told(&app).failed.len(), told(&app).made.len()), (count + 1, made + 1));
    app.world_mut().get_mut::<Sprite>(entity).unwrap().rect = Some(Rect::new(60.0, 0.0, 120.0, 96.0));
    wait_for_news(&mut app);
    assert_eq!((told(&app).failed.len(), told(&app).made.len()), (count + 2, made + 1));
}

/// Pictures that are swapped, reloaded at another size, and surfaces in 3D go on.
#[test]
fn pictures_change_under_an_analogy() {
    let mut app = watch(app());
    let (entity, _) = spawn(&mut app, |analogy| analogy);
    hit(&mut app, center(entity).with_energy(2.0));
    settle(&mut app, entity);
    for (i, size) in [UVec2::new(64, 64), UVec2::new(120, 96)].into_iter().enumerate() {
        let other = add(&mut app, solid(size, [90 + i as u8, 100, 110, 255]));
        let own = texels(&app, &other);
        app.world_mut().get_mut::<Sprite>(entity).unwrap().image = other;
        wait_for_news(&mut app);
        wait(&mut app, "its cracks", |app| {
            let (strange, cracks) = count(app, entity, &own);
            strange == 0 && cracks > 20
        });
    }
    assert_eq!(told(&app).failed, []);
    // A slab of a wall.
    let mut picture = picture_of(SIZE, TextureFormat::Rgba8UnormSrgb);
    picture.asset_usage = RenderAssetUsages::default();
    let own = picture.data.clone().unwrap();
    let texture = add(&mut app, picture);
    let material = add(&mut app, StandardMaterial { base_color_texture: Some(texture), ..default() });
    let mesh = add(&mut app, Mesh::from(Rectangle::new(1.25, 1.0)));
    let examples = add(&mut app, examples());
    let surface = (CrackSurface::new(preset()), CrackAnalogy::new(examples));
    let wall = app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material), surface)).id();
    wait_for_news(&mut app);
    hit(&mut app, center(wall).with_energy(2.0));
    wait(&mut app, "its cracks", |app| state(app, wall).status == CrackStatus::Done);
    wait(&mut app, "those of the photograph", |app| {
        let shown = texels(app, &get::<CrackTextures>(app, wall).diffuse.unwrap());
        let texels = shown.as_chunks::<4>().0.iter().zip(own.as_chunks::<4>().0);
        let strange = texels.clone().filter(|(shown, own)| shown != own && shown[2] != TAG).count();
        strange == 0 && texels.filter(|(shown, _)| shown[1] == 10).count() > 100
    });
}

/// Surfaces with analogies are hit, healed, shattered, despawned, given other pictures, analogies and clocks, in any order: nothing
/// panics, and nothing is left of them.
#[test]
fn s9_whatever_happens_to_analogies() {
    let mut app = watch(app());
    let images = [picture(SIZE), picture(UVec2::new(40, 70)), solid(UVec2::new(64, 64), [9, 90, 200, 255])];
    let images = images.map(|image| add(&mut app, image));
    let examples = [examples(), examples().with_normals(vec![Grid::new(UVec2::splat(64), [128; 4])]).unwrap()];
    let examples = examples.map(|examples| add(&mut app, examples));
    let count = |app: &App| app.world().resource::<Assets<Image>>().len();
    let (before, mut rng) = (count(&app), Rng::new(23));
    let mut surfaces = Vec::new();
    for frame in 0..1200 {
        let mut pick = |n: usize| (rng.next_u32() as usize) % n;
        let analogy =
            |n: usize| CrackAnalogy { examples: examples[n % 2].clone(), keeps_picture: n % 4 < 2, seed: n as u64 % 3 };
        if surfaces.len() < 6 {
            let image = images[pick(3)].clone();
            let surface = CrackSurface::new(if pick(2) == 0 { preset() } else { CrackPreset::GLASS.scaled(0.5) });
            surfaces.push(app.world_mut().spawn((Sprite::from_image(image), surface, analogy(pick(12)))).id());
        }
        let (at, entity) = (pick(surfaces.len()), surfaces[pick(surfaces.len())]);
        match pick(14) {
            0..5 => {
                let uv = Vec2::new(pick(100) as f32, pick(100) as f32) / 100.0;
                hit(&mut app, CrackHit::uv(entity, uv).with_energy(0.5 + pick(4) as f32));
            }
            5 => _ = app.world_mut().commands().entity(entity).heal_cracks(),
            6 => _ = app.world_mut().commands().entity(entity).close_cracks(0.2),
            7 => _ = app.world_mut().commands().entity(entity).shatter_cracks(ShatterRequest::EVERYTHING),
            8 => app.world_mut().get_mut::<Sprite>(entity).unwrap().image = images[pick(3)].clone(),
            9 => _ = app.world_mut().entity_mut(entity).insert(analogy(pick(12))),
            10 => _ = app.world_mut().entity_mut(entity).remove::<CrackAnalogy>(),
            11 => _ = app.world_mut().entity_mut(entity).insert(CrackClock::speed([1.0, -1.0, 0.0][pick(3)])),
            12 => _ = app.world_mut().entity_mut(entity).remove::<CrackClock>(),
            _ => _ = app.world_mut().despawn(surfaces.swap_remove(at)),
        }
        step(&mut app);
        if frame % 16 == 0 {
            std::thread::sleep(Duration::from_millis(2));
        }
    }
    // How many depends on the machine.
    assert!(!told(&app).made.is_empty());
    assert_eq!(told(&app).failed, []);
    for entity in surfaces {
        app.world_mut().despawn(entity);
    }
    wait(&mut app, "all to go", |app| count(app) == before);
}
