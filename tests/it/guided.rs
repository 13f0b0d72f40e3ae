//! Guided cracks on surfaces: bakes that start, end, are cancelled and fail, and what is on the surface afterwards.

use crate::support::*;
use bevy::{prelude::*, render::render_resource::TextureFormat};
use bevy_crack::{
    Grid,
    math::Rng,
    plugin::CrackUploadStats,
    prelude::*,
    voronoi::{FONT, MAX_SITES, SiteLayout, VoronoiBake, VoronoiParams, draw_text},
};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// What was told.
#[derive(Resource, Default, Debug, PartialEq)]
pub(crate) struct Told {
    pub(crate) baked: Vec<(Entity, Option<f32>)>,
    pub(crate) failed: Vec<(Entity, CrackError)>,
    pub(crate) finished: usize,
}

pub(crate) fn guided_app() -> App {
    listening(app())
}

pub(crate) fn listening(mut app: App) -> App {
    app.init_resource::<Told>()
        .add_observer(|baked: On<CrackBaked>, mut told: ResMut<Told>| told.baked.push((baked.entity, baked.covered)))
        .add_observer(|failed: On<CrackFailed>, mut told: ResMut<Told>| {
            told.failed.push((failed.entity, failed.error.clone()));
        })
        .add_observer(|_: On<CrackFinished>, mut told: ResMut<Told>| told.finished += 1);
    app
}

pub(crate) fn told(app: &App) -> &Told {
    app.world().resource()
}

pub(crate) fn progress(app: &App, entity: Entity) -> f32 {
    get::<BakeProgress>(app, entity).0
}

/// A cross of broad strokes.
pub(crate) fn cross(size: UVec2) -> Grid<f32> {
    let mut grid = Grid::new(size, 0.0);
    for y in 0..size.y {
        for (x, value) in (0..size.x).zip(grid.row_mut(y as usize)) {
            let at = (UVec2::new(x, y).as_vec2() + 0.5) / size.as_vec2() - 0.5;
            let inside = at.abs().max_element() < 0.35 && at.abs().min_element() < 0.07;
            *value = if inside { 1.0 } else { 0.0 };
        }
    }
    grid
}

pub(crate) fn guided() -> GuidedCracks {
    let mut guided = GuidedCracks::new(CrackGuide::new(cross(UVec2::splat(64))));
    guided.params.sites = 40;
    guided
}

fn spawn(app: &mut App, guided: GuidedCracks) -> Entity {
    let image = add(app, solid(UVec2::splat(128), [180, 180, 180, 255]));
    app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(CrackPreset::CONCRETE), guided)).id()
}

/// Frames until the bakes begun so far have ended.
pub(crate) fn bake(app: &mut App, entity: Entity) {
    let n = told(app).baked.len() + told(app).failed.len();
    wait_for(app, "the end of the bake", |app| told(app).baked.len() + told(app).failed.len() > n);
    if told(app).failed.is_empty() {
        assert_eq!(progress(app, entity), 1.0);
    }
}

/// How much darker than its picture the surface is, as a share.
fn darkness(app: &App, entity: Entity) -> f32 {
    let texels = shown(app, entity);
    let lost: u64 = texels.chunks(4).map(|texel| 180u64.saturating_sub(u64::from(texel[0]))).sum();
    lost as f32 / (180 * texels.len() / 4) as f32
}

/// Fault G4: what was inserted before a surface was healed, in the same frame, is not baked; what comes after that is.
#[test]
fn g4_a_surface_that_is_healed_forgets_what_was_to_be_baked() {
    type Give = fn(&mut EntityCommands);
    let ends: [Give; 2] = [|of| _ = of.heal_cracks(), |of| _ = of.close_cracks(0.5)];
    let gives: [Give; 3] = [
        |of| _ = of.insert(guided()),
        |of| _ = of.insert(CrackStrands::new([HitPoint::Uv(Vec2::new(0.0, 0.5))], StrandField::Linear(Vec2::X))),
        |of| _ = of.insert((CrackSurface::new(CrackPreset::GLASS), guided())),
    ];
    let both = ends.into_iter().flat_map(|end| gives.map(|give| (end, give)));
    for (i, (end, give)) in both.enumerate() {
        let mut app = guided_app();
        let image = add(&mut app, solid(UVec2::splat(128), [180, 180, 180, 255]));
        let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(CrackPreset::CONCRETE))).id();
        step(&mut app);
        give(&mut app.world_mut().commands().entity(entity));
        end(&mut app.world_mut().commands().entity(entity));
        for _ in 0..60 {
            step(&mut app);
            std::thread::sleep(Duration::from_millis(2));
        }
        assert!(app.world().get::<CrackTextures>(entity).is_none(), "{i}");
        assert!(told(&app).baked.is_empty() && progress(&app, entity) == 0.0, "{i}");
        end(&mut app.world_mut().commands().entity(entity));
        give(&mut app.world_mut().commands().entity(entity));
        bake(&mut app, entity);
        assert!(app.world().get::<CrackTextures>(entity).is_some(), "{i}");
    }
}

#[test]
fn a_word_is_baked_and_shown() {
    let mut app = guided_app();
    let entity = spawn(&mut app, guided());
    assert_eq!(progress(&app, entity), 0.0);
    bake(&mut app, entity);
    settle(&mut app, entity);
    let [(baked, covered)] = told(&app).baked[..] else { panic!("{:?}", told(&app)) };
    assert_eq!(baked, entity);
    assert!(covered.is_some_and(|covered| covered > 0.9), "{covered:?}");
    assert_eq!((told(&app).failed.len(), told(&app).finished), (0, 1));
    let share = darkness(&app, entity);
    assert!((0.02..0.3).contains(&share), "{share}");
    let state = state(&app, entity);
    assert!(state.cells > 30 && state.hits == 0 && state.nodes > 100, "{state:?}");
    // The strokes of the cross are cracked along their middle lines.
    let texels = shown(&app, entity);
    let dark = |x: usize, y: usize| texels[4 * (y * 128 + x)] < 150;
    let crossed = (30..98).filter(|&y| (55..73).any(|x| dark(x, y))).count();
    assert!(crossed > 60, "{crossed} of 68 rows have a crack in the upright stroke");
    // The same again, in another app, whatever the frames were.
    let mut other = guided_app();
    let twin = spawn(&mut other, guided());
    bake(&mut other, twin);
    settle(&mut other, twin);
    assert!(shown(&other, twin) == texels, "the same cracks");
}

/// G1, G2: other sizes, and guides in which there is nothing to follow.
#[test]
fn g1_g2_any_guide_makes_cracks() {
    let mut app = guided_app();
    let noise = |size: UVec2| {
        let mut rng = Rng::new(3);
        Grid::from_vec(size, (0..size.element_product()).map(|_| rng.unit()).collect()).unwrap()
    };
    let grids = [
        cross(UVec2::new(7, 500)),
        Grid::new(UVec2::ONE, 1.0),
        Grid::new(UVec2::ZERO, 1.0),
        Grid::new(UVec2::splat(64), 0.0),
        Grid::new(UVec2::splat(64), 1.0),
        Grid::new(UVec2::splat(64), f32::NAN),
        Grid::new(UVec2::splat(64), f32::NEG_INFINITY),
        noise(UVec2::splat(64)),
    ];
    for (i, grid) in grids.into_iter().enumerate() {
        let entity = spawn(&mut app, GuidedCracks { guides: vec![CrackGuide::new(grid)], ..guided() });
        bake(&mut app, entity);
        settle(&mut app, entity);
        let has_strokes = told(&app).baked.last().unwrap().1.is_some();
        assert!(i != 0 || has_strokes, "a cross is a cross at any size");
        assert!((1..7).contains(&i) != has_strokes || i == 0, "guide {i}: there is nothing to be astride of");
        assert!(darkness(&app, entity) > 0.01, "guide {i}");
    }
    for (i, format) in
        [TextureFormat::R8Unorm, TextureFormat::Rgba32Float, TextureFormat::Rgba16Float].into_iter().enumerate()
    {
        let mut image = picture_of(UVec2::new(9, 5), format);
        if i > 0 {
            // Not a number, all of it.
            image.data.as_mut().unwrap().fill(0xFF);
        }
        let image = add(&mut app, image);
        let entity = spawn(&mut app, GuidedCracks { guides: vec![CrackGuide::new(image)], ..guided() });
        bake(&mut app, entity);
        settle(&mut app, entity);
    }
    let entity = spawn(&mut app, GuidedCracks { guides: vec![CrackGuide::own_edges()], ..guided() });
    bake(&mut app, entity);
    settle(&mut app, entity);
    assert_eq!(told(&app).failed, []);
}

#[test]
fn g3_any_number_of_sites() {
    assert_eq!(MAX_SITES, 65_536, "as the documentation says");
    let mut app = guided_app();
    let mut made = Vec::new();
    for sites in [0, 1, 2, MAX_SITES, 1_000_000] {
        let mut guided = guided();
        guided.params.sites = sites;
        guided.params.layout = SiteLayout::Uniform;
        let entity = spawn(&mut app, guided);
        bake(&mut app, entity);
        wait_for(&mut app, "the end", |app| state(app, entity).status == CrackStatus::Done);
        assert_eq!(state(&app, entity).nodes > 0, sites > 1, "{sites} sites");
        let params = VoronoiParams { sites, layout: SiteLayout::Uniform, ..default() };
        let map = VoronoiBake::new(params, Vec::new(), UVec2::splat(16), 0).unwrap().finish().0;
        assert_eq!(map.sites().len(), sites.min(MAX_SITES) as usize);
        made.push((state(&app, entity).nodes, state(&app, entity).cells, shown(&app, entity)));
        if sites < 3 {
            assert_cracks(&mut app, entity);
        }
    }
    assert!(made[3] == made[4], "what is beyond the most makes no difference: {:?} {:?}", &made[3].0, &made[4].0);
    assert!(made[2] != made[3]);
    for (places, cracks) in [
        // The first has it all; what is no number is no site.
        (vec![Vec2::splat(0.5); 20], false),
        (vec![Vec2::NAN, Vec2::splat(9.0)], false),
        ((0..9).map(|i| Vec2::new(0.5, i as f32 / 9.0)).collect(), true),
    ] {
        let mut guided = guided();
        guided.params.layout = SiteLayout::Given(places);
        let entity = spawn(&mut app, guided);
        bake(&mut app, entity);
        wait_for(&mut app, "the end", |app| state(app, entity).status == CrackStatus::Done);
        assert_eq!(state(&app, entity).nodes > 0, cracks, "{:?}", get::<GuidedCracks>(&app, entity).params.layout);
    }
    assert_eq!(told(&app).failed, []);
}

/// Cancelled, restarted each frame, despawned: the last one wins, and each that is not cancelled is told of once.
#[test]
fn g4_the_last_bake_wins() {
    let mut app = guided_app();
    let quiet = spawn(&mut app, guided());
    bake(&mut app, quiet);
    settle(&mut app, quiet);
    let expected = shown(&app, quiet);

    let entity = spawn(&mut app, guided());
    for seed in 1..40 {
        app.world_mut().get_mut::<GuidedCracks>(entity).unwrap().seed = seed;
        step(&mut app);
    }
    app.world_mut().get_mut::<GuidedCracks>(entity).unwrap().seed = 0;
    step(&mut app);
    wait_for(&mut app, "the last bake", |app| {
        progress(app, entity) == 1.0 && state(app, entity).status == CrackStatus::Done
    });
    assert!(shown(&app, entity) == expected, "the last one is shown, and it alone");

    // Long enough to be in the middle of it after three frames.
    let large = || {
        let mut guided = GuidedCracks { max_side: 4096, ..guided() };
        (guided.params.sites, guided.params.levels) = (60_000, 5);
        guided
    };
    let image = add(&mut app, solid(UVec2::splat(1500), [180, 180, 180, 255]));
    let doomed: Vec<Entity> = (0..4)
        .map(|_| app.world_mut().spawn((Sprite::from_image(image.clone()), CrackSurface::default(), large())).id())
        .collect();
    steps(&mut app, 3);
    let n = told(&app).baked.len();
    app.world_mut().entity_mut(doomed[0]).remove::<GuidedCracks>();
    app.world_mut().entity_mut(doomed[1]).remove::<CrackSurface>();
    app.world_mut().despawn(doomed[2]);
    app.world_mut().commands().entity(doomed[3]).heal_cracks();
    let start = Instant::now();
    while start.elapsed() < Duration::from_millis(1500) {
        step(&mut app);
    }
    assert_eq!(told(&app).baked.len(), n, "cancelled ones are not told of");
    assert_eq!(told(&app).failed, []);
    for entity in [doomed[0], doomed[1], doomed[3]] {
        assert_eq!(progress(&app, entity), 0.0);
    }
    // What was taken back can be had again.
    app.world_mut().entity_mut(doomed[0]).insert(GuidedCracks { max_side: 64, ..guided() });
    bake(&mut app, doomed[0]);
}

#[test]
fn g5_progress_never_falls() {
    let mut app = guided_app();
    let image = add(&mut app, solid(UVec2::splat(1024), [180, 180, 180, 255]));
    let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::default(), guided())).id();
    let mut seen = vec![progress(&app, entity)];
    wait_for(&mut app, "the end of the bake", |app| {
        seen.push(progress(app, entity));
        !told(app).baked.is_empty()
    });
    assert!(seen.is_sorted(), "{seen:?}");
    assert!(seen.iter().all(|share| (0.0..=1.0).contains(share)));
}

/// A chunk of a PNG file.
fn chunk(kind: &[u8], data: &[u8]) -> Vec<u8> {
    let body = [kind, data].concat();
    let crc = body.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 })
    });
    [&(data.len() as u32).to_be_bytes()[..], &body, &(!crc).to_be_bytes()].concat()
}

/// F2: a file of 68 bytes that claims `side` x `side` RGBA texels.
fn bomb(side: u32, bits: u8) -> Vec<u8> {
    let side = side.to_be_bytes();
    let header = [&side[..], &side, &[bits, 6, 0, 0, 0]].concat();
    let data = [0x78, 0x9C, 0x63, 0, 0, 0, 1, 0, 1, 0, 0];
    [&b"\x89PNG\r\n\x1a\n"[..], &chunk(b"IHDR", &header), &chunk(b"IDAT", &data), &chunk(b"IEND", &[])].concat()
}

fn png(file: Vec<u8>) -> GuidedCracks {
    let file: Arc<[u8]> = file.into();
    GuidedCracks { guides: vec![CrackGuide::new(file)], ..guided() }
}

#[test]
fn f1_f2_hostile_files_fail_once_and_hits_still_crack() {
    let mut drawing = Vec::new();
    let picture = image::GrayImage::from_fn(40, 40, |x, y| image::Luma([if x.abs_diff(y) < 4 { 0 } else { 255 }]));
    picture.write_to(&mut std::io::Cursor::new(&mut drawing), image::ImageFormat::Png).unwrap();
    let mut app = guided_app();
    let entity = spawn(&mut app, png(drawing.clone()));
    bake(&mut app, entity);
    assert!(told(&app).baked[0].1.is_some_and(|covered| covered > 0.5), "{:?}", told(&app));
    let mut hostile: Vec<Vec<u8>> = [60_000, 24_000, 8_193, u32::MAX].map(|side| bomb(side, 8)).to_vec();
    // Within the limit of texels, beyond that of bytes.
    hostile.push(bomb(8192, 16));
    assert!(hostile.iter().all(|file| file.len() == 68));
    let n_bombs = hostile.len();
    hostile.extend((0..drawing.len()).step_by(7).map(|n| drawing[..n].to_vec()));
    hostile.extend([b"GIF89a".to_vec(), vec![0; 1000]]);
    let mut rng = Rng::new(5);
    for _ in 0..100 {
        let mut file = drawing.clone();
        let byte = rng.next_u32() as usize % file.len();
        file[byte] ^= 1 << (rng.next_u32() % 8);
        hostile.push(file);
    }
    let n_before = told(&app).baked.len();
    let n = hostile.len();
    let mut entities = Vec::new();
    for (i, file) in hostile.into_iter().enumerate() {
        let entity = spawn(&mut app, png(file));
        let (baked, failed) = (told(&app).baked.len(), told(&app).failed.len());
        wait_for(&mut app, "an end", |app| told(app).baked.len() + told(app).failed.len() > baked + failed);
        let is_limit = |error: &CrackError| error.to_string().contains("limit");
        assert!(i >= n_bombs || told(&app).failed.last().is_some_and(|(_, error)| is_limit(error)), "{:?}", told(&app));
        entities.push(entity);
    }
    steps(&mut app, 3);
    let (baked, failed) = (told(&app).baked.len() - n_before, told(&app).failed.len());
    assert_eq!(baked + failed, n, "each ends once");
    assert!(failed > n / 2, "{failed} of {n}");
    assert_eq!(told(&app).failed[0].0, entities[0]);
    assert_cracks(&mut app, entities[0]);
}

/// Cracks that are baked are there with the component or without it.
#[test]
fn e2_the_component_goes() {
    let mut app = guided_app();
    let entity = spawn(&mut app, guided());
    bake(&mut app, entity);
    settle(&mut app, entity);
    let baked = shown(&app, entity);
    let remove = |app: &mut App| {
        app.world_mut().entity_mut(entity).remove::<GuidedCracks>();
        step(app);
        progress(app, entity)
    };
    assert_eq!(remove(&mut app), 1.0, "it is done");
    steps(&mut app, 3);
    assert!(progress(&app, entity) == 1.0 && shown(&app, entity) == baked);
    // One that goes on is cancelled.
    app.world_mut().entity_mut(entity).insert(guided().with_seed(2));
    step(&mut app);
    assert!(progress(&app, entity) < 1.0);
    assert_eq!(remove(&mut app), 0.0, "it is cancelled");
    steps(&mut app, 20);
    assert_eq!((progress(&app, entity), told(&app).baked.len()), (0.0, 1));
    // Healing takes them away.
    app.world_mut().entity_mut(entity).insert(guided());
    bake(&mut app, entity);
    app.world_mut().entity_mut(entity).remove::<GuidedCracks>();
    app.world_mut().commands().entity(entity).heal_cracks();
    step(&mut app);
    assert_eq!(progress(&app, entity), 0.0, "it is healed");
}

/// What cannot be baked is told once, by name, and the surface can be hit.
#[test]
fn what_cannot_be_baked_fails_once() {
    let mut app = guided_app();
    let missing = app.world().resource::<AssetServer>().load("nowhere/at_all.png");
    let gpu_only = {
        let mut image = solid(UVec2::splat(8), [0; 4]);
        image.data = None;
        add(&mut app, image)
    };
    let with = |change: &dyn Fn(&mut GuidedCracks)| {
        let mut guided = guided();
        change(&mut guided);
        guided
    };
    let guide = |source: CrackGuide| move |guided: &mut GuidedCracks| guided.guides.push(source.clone());
    let cases = [
        (with(&guide(CrackGuide::new(missing))), "number 1"),
        (with(&guide(CrackGuide::new(gpu_only))), "number 1"),
        (with(&guide(CrackGuide::own_edges().with_gamma(f32::NAN))), "gamma"),
        (with(&|guided| guided.params.alpha = -1.0), "alpha"),
        (with(&|guided| guided.params.levels = 0), "levels"),
        (with(&|guided| guided.params.width = f32::INFINITY), "width"),
    ];
    for (i, (guided, named)) in cases.into_iter().enumerate() {
        let entity = spawn(&mut app, guided);
        wait_for(&mut app, "the failure", |app| told(app).failed.len() > i);
        steps(&mut app, 3);
        let (failed, error) = &told(&app).failed[i];
        assert_eq!((*failed, told(&app).failed.len()), (entity, i + 1));
        assert!(error.to_string().contains(named), "{error}");
        assert_cracks(&mut app, entity);
    }
    // Nothing to crack at all.
    let entity = app.world_mut().spawn((CrackSurface::default(), guided())).id();
    wait_for(&mut app, "the failure", |app| told(app).failed.len() > 6);
    steps(&mut app, 3);
    assert_eq!(told(&app).failed[6..], [(entity, CrackError::NothingToCrack)]);
    assert_eq!(told(&app).baked, []);
}

#[test]
fn hits_start_from_seams_and_stop_at_them() {
    let mut app = guided_app();
    let mut preset = CrackPreset::CLAY;
    preset.growth.arrest = 0.05;
    // The floor of a crater shows nothing of what was there.
    preset.look.crushed = None;
    let image = add(&mut app, solid(UVec2::splat(256), [180, 180, 180, 255]));
    let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(preset), guided())).id();
    bake(&mut app, entity);
    settle(&mut app, entity);
    let (before, baked) = (state(&app, entity), shown(&app, entity));
    for at in [Vec2::new(0.3, 0.4), Vec2::new(0.7, 0.6)] {
        hit(&mut app, CrackHit::uv(entity, at));
        settle(&mut app, entity);
    }
    let after = state(&app, entity);
    assert!(after.nodes > before.nodes + 10 && after.cells > before.cells, "{before:?} {after:?}");
    // Nothing of the seams is lost, but where the light on the wall of a new crack falls on one.
    let (side, after) = (256, shown(&app, entity));
    let value = |texels: &[u8], x: usize, y: usize| texels[4 * (y * side + x)];
    let is_lost = |x, y| value(&baked, x, y) < 90 && value(&after, x, y) > value(&baked, x, y).saturating_add(40);
    let is_new = |x, y| value(&after, x, y) < value(&baked, x, y).saturating_sub(40);
    let near = |at: usize| at.saturating_sub(4)..(at + 5).min(side);
    let is_beside_new = |x, y| near(y).any(|y| near(x).any(|x| is_new(x, y)));
    let places = || (0..side).flat_map(|y| (0..side).map(move |x| (x, y)));
    let lost = places().filter(|&(x, y)| is_lost(x, y) && !is_beside_new(x, y)).count();
    let new = places().filter(|&(x, y)| is_new(x, y)).count();
    assert!(lost < 20 && new > 100 && new < side * side / 10, "{lost} texels of the seams are gone, {new} are new");
}

/// A changed guide takes the place of the one before, around hits that are grown anew.
#[test]
fn a_second_bake_takes_the_place_of_the_first() {
    let mut app = guided_app();
    let entity = spawn(&mut app, guided());
    bake(&mut app, entity);
    hit(&mut app, center(entity));
    settle(&mut app, entity);
    let first = shown(&app, entity);
    app.world_mut().get_mut::<GuidedCracks>(entity).unwrap().seed = 9;
    step(&mut app);
    bake(&mut app, entity);
    settle(&mut app, entity);
    assert!(shown(&app, entity) != first);
    assert_eq!(state(&app, entity).hits, 1);
    app.world_mut().get_mut::<GuidedCracks>(entity).unwrap().seed = 0;
    step(&mut app);
    bake(&mut app, entity);
    settle(&mut app, entity);
    assert!(shown(&app, entity) == first, "back to the first, hit and all");
    // Removing the component keeps the cracks; healing takes them.
    app.world_mut().entity_mut(entity).remove::<GuidedCracks>();
    steps(&mut app, 3);
    assert!(shown(&app, entity) == first);
    app.world_mut().commands().entity(entity).heal_cracks();
    steps(&mut app, 3);
    assert_eq!(state(&app, entity), CrackState::default());
    assert_eq!(darkness(&app, entity), 0.0);
}

#[test]
fn cracks_appear_as_asked() {
    let mut app = guided_app();
    let at_once = spawn(&mut app, guided());
    bake(&mut app, at_once);
    settle(&mut app, at_once);
    let whole = darkness(&app, at_once);
    let appearances =
        [GuidedAppearance::Front { from: Vec2::ZERO, seconds: 2.0 }, GuidedAppearance::Widen { seconds: 2.0 }];
    for appearance in appearances {
        let entity = spawn(&mut app, guided().with_appearance(appearance));
        bake(&mut app, entity);
        let mut shares = Vec::new();
        while state(&app, entity).status != CrackStatus::Done {
            shares.push(darkness(&app, entity));
            step(&mut app);
            assert!(shares.len() < 1000);
        }
        // 2 seconds are 100 frames.
        assert!((95..=110).contains(&shares.len()), "{appearance:?}: {} frames", shares.len());
        assert!(shares.windows(2).all(|pair| pair[1] >= pair[0] - 2e-3), "{appearance:?}: {shares:?}");
        // Hair cracks are seen from the first moment.
        let early = if matches!(appearance, GuidedAppearance::Widen { .. }) { 0.85 } else { 0.2 };
        assert!(shares[5] < early * whole && shares[50] > 0.05 * whole, "{appearance:?}: {shares:?}");
        let share = darkness(&app, entity);
        assert!((share - whole).abs() < 0.01, "{appearance:?}: {share} {whole}");
        assert_cracks(&mut app, entity);
    }
    assert_eq!(told(&app).failed, []);
}

/// A bake of even sites whose cracks are all of one width, so that only the weights decide where they are.
fn weighed(gammas: [f32; 2], appearance: GuidedAppearance) -> GuidedCracks {
    let bar = Grid::from_vec(UVec2::new(5, 1), vec![0.0, 1.0, 0.0, 0.0, 0.0]).unwrap();
    let guides = [cross(UVec2::splat(64)), bar].into_iter().zip(gammas);
    let params = VoronoiParams {
        sites: 40,
        layout: SiteLayout::Even,
        width: 0.01,
        least_width: 0.01,
        stroke_width: 0.0,
        ..default()
    };
    let guides = guides.map(|(grid, gamma)| CrackGuide::new(grid).with_gamma(gamma)).collect();
    GuidedCracks { guides, params, seed: 3, appearance, max_side: 128 }
}

/// The picture of a bake whose clock has been set to a share of its time.
fn picture_at(app: &mut App, guided: GuidedCracks, share: f32) -> Vec<u8> {
    let n_ended = told(app).baked.len() + told(app).failed.len();
    let entity = spawn(app, guided);
    app.world_mut().entity_mut(entity).insert(CrackClock::value(share));
    wait_for(app, "the end of the bake", |app| told(app).baked.len() + told(app).failed.len() > n_ended);
    for _ in 0..20 {
        steps(app, 1);
        std::thread::sleep(Duration::from_millis(5));
    }
    shown(app, entity)
}

/// Eq. 4 of the paper: on the way a picture is that of the weights on the way, and it ends as that of the last ones, with tasks and in the
/// frame itself.
#[test]
fn cracks_move_as_their_weights_do() {
    let unlimited = || {
        let mut app = guided_app();
        app.insert_resource(CrackBudget { milliseconds: 1e4, ..default() });
        app
    };
    for mut app in [guided_app(), unlimited()] {
        let emerge = weighed([24.0, 12.0], GuidedAppearance::Emerge { seconds: 1.0 });
        let morph = weighed([24.0, 12.0], GuidedAppearance::Morph { seconds: 1.0 });
        let still = |app: &mut App, gammas| picture_at(app, weighed(gammas, GuidedAppearance::AtOnce), 1.0);
        let untouched = [180, 180, 180, 255].repeat(128 * 128);
        for (moving, ways) in
            [(emerge, [[6.0, 3.0], [12.0, 6.0], [24.0, 12.0]]), (morph, [[18.0, 3.0], [12.0, 6.0], [0.0, 12.0]])]
        {
            let mut seen = vec![untouched.clone()];
            assert!(picture_at(&mut app, moving.clone(), 0.0) == untouched);
            for (share, gammas) in [0.25, 0.5, 1.0].into_iter().zip(ways) {
                let (got, wanted) = (picture_at(&mut app, moving.clone(), share), still(&mut app, gammas));
                assert!(got == wanted, "{:?} at {share}", moving.appearance);
                assert!(!seen.contains(&got), "{:?} at {share}: they move", moving.appearance);
                seen.push(got);
            }
        }
        assert_eq!(told(&app).failed, []);
    }
}

/// Without a clock the cracks move within their time, there and no further, and hits then meet those that stay.
#[test]
fn moving_cracks_come_to_rest() {
    let mut app = guided_app();
    let still = spawn(&mut app, weighed([24.0, 12.0], GuidedAppearance::AtOnce));
    bake(&mut app, still);
    settle(&mut app, still);
    let entity = spawn(&mut app, weighed([24.0, 12.0], GuidedAppearance::Emerge { seconds: 1.0 }));
    bake(&mut app, entity);
    let mut pictures = vec![shown(&app, entity)];
    let mut frames = 0;
    while state(&app, entity).status != CrackStatus::Done {
        step(&mut app);
        std::thread::sleep(Duration::from_millis(1));
        pictures.push(shown(&app, entity));
        frames += 1;
        assert!(frames < 1000);
    }
    pictures.dedup();
    assert!((47..=60).contains(&frames) && pictures.len() > 8, "{frames} frames, {} pictures", pictures.len());
    assert!(shown(&app, entity) == shown(&app, still), "where they stay");
    assert_cracks(&mut app, entity);
}

/// A text is a guide, drawn at the size of the map; what cannot be drawn fails once.
#[test]
fn texts_are_guides() {
    let mut app = guided_app();
    let drawn = draw_text(FONT, "HA", UVec2::splat(128), f32::INFINITY).unwrap();
    let [text, grid] = [CrackGuide::text("HA"), CrackGuide::new(drawn)].map(|guide| {
        let entity = spawn(&mut app, GuidedCracks::new(guide));
        bake(&mut app, entity);
        settle(&mut app, entity);
        shown(&app, entity)
    });
    assert!(text == grid && text.chunks(4).any(|texel| texel[0] < 100));
    let source = GuideSource::Text { text: "HA".into(), font: Some(Arc::from(*b"no font")) };
    let entity = spawn(&mut app, GuidedCracks::new(CrackGuide::new(source)));
    bake(&mut app, entity);
    let error = CrackError::Guide { index: 0, reason: "its font cannot be read".into() };
    assert_eq!(told(&app).failed, [(entity, error)]);
    let alone = GuidedCracks { appearance: GuidedAppearance::Morph { seconds: 1.0 }, ..guided() };
    let error = CrackError::OutOfRange { field: "guides".into(), value: 1.0, min: 2.0, max: 64.0 };
    assert_eq!(alone.validate(), Err(error));
}

/// A picture of another size keeps the word, stretched with it.
#[test]
fn a_changed_picture_keeps_the_cracks() {
    let mut app = guided_app();
    let entity = spawn(&mut app, guided());
    bake(&mut app, entity);
    settle(&mut app, entity);
    let (share, nodes) = (darkness(&app, entity), state(&app, entity).nodes);
    for size in [UVec2::splat(128), UVec2::splat(256), UVec2::new(300, 128)] {
        let image = add(&mut app, solid(size, [180, 180, 180, 255]));
        app.world_mut().get_mut::<Sprite>(entity).unwrap().image = image;
        steps(&mut app, 5);
        wait_for(&mut app, "the end", |app| state(app, entity).status == CrackStatus::Done);
        assert_eq!(state(&app, entity).nodes, nodes, "{size}");
        assert!((darkness(&app, entity) - share).abs() < 0.04, "{size}");
        assert_sound(&app, entity);
    }
    assert_eq!(told(&app).baked.len(), 1);
}

/// What was baked comes to the GPU whole, by one copy for each texture, and what is painted afterwards comes on top.
#[test]
fn baked_pictures_reach_the_gpu_in_one_copy_each() {
    let Some((_one, app)) = gpu_app() else { return };
    let mut app = listening(app);
    let entity = spawn(&mut app, guided());
    for seed in 0..3 {
        app.world_mut().get_mut::<GuidedCracks>(entity).unwrap().seed = seed;
        let mut most = CrackUploadStats::default();
        wait_for(&mut app, "the end", |app| {
            let stats = app.world().resource::<CrackUploadStats>();
            most = CrackUploadStats { bytes: most.bytes.max(stats.bytes), rects: most.rects.max(stats.rects) };
            told(app).baked.len() > seed as usize && state(app, entity).status == CrackStatus::Done
        });
        assert_eq!(most, CrackUploadStats { bytes: 2 * 4 * 128 * 128, rects: 2 }, "diffuse and normals, bake {seed}");
        assert_on_gpu(&mut app, &[entity]);
    }
    hit(&mut app, center(entity));
    for _ in 0..10 {
        step(&mut app);
        assert_on_gpu(&mut app, &[entity]);
    }
    assert_eq!(told(&app).failed, []);
}

#[test]
fn a_wall_of_tiles_is_baked_as_a_whole() {
    let Some((_one, app)) = gpu_app() else { return };
    let mut app = listening(app);
    let target = spawn_camera(&mut app, UVec2::new(96, 64));
    let image = add(&mut app, solid(UVec2::splat(16), [180, 180, 180, 255]));
    let image_mode = SpriteImageMode::Tiled { tile_x: true, tile_y: true, stretch_value: 0.5 };
    let sprite = Sprite { image_mode, custom_size: Some(Vec2::new(96.0, 64.0)), ..Sprite::from_image(image) };
    let surface = CrackSurface::new(CrackPreset::CONCRETE);
    let entity = app.world_mut().spawn((sprite.clone(), surface, guided())).id();
    bake(&mut app, entity);
    steps(&mut app, 3);
    assert!(told(&app).failed.is_empty(), "{:?}", told(&app));
    let own = image_of(&app, entity);
    let size = app.world().resource::<Assets<Image>>().get(&own).expect("its texture").size();
    assert_eq!(size, UVec2::new(192, 128), "each tile of 8 x 8 units has its 16 x 16 texels");
    // The cross is on the whole wall, once, and is drawn there.
    let drawn = drawn(&mut app, &target);
    let dark = |x: u32, y: u32| drawn[4 * (y * 96 + x) as usize] < 90;
    let share = |columns: std::ops::Range<u32>, rows: std::ops::Range<u32>| {
        let all = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
        all.clone().filter(|&(x, y)| dark(x, y)).count() as f32 / all.count() as f32
    };
    let (middle, corner) = (share(40..56, 24..40), share(0..14, 0..9));
    assert!(middle > 0.1 && middle > 2.0 * corner, "{middle} of the middle is dark, {corner} of a corner");
    app.world_mut().commands().entity(entity).heal_cracks();
    step(&mut app);
    assert_eq!(get::<Sprite>(&app, entity).image_mode, sprite.image_mode);
}

/// `CrackFailed` promises it, whoever sends it.
#[test]
fn a_bake_that_fails_refuses_the_hits_that_wait() {
    let mut app = guided_app();
    let preset = app.world().resource::<Assets<CrackPreset>>().reserve_handle();
    let image = add(&mut app, picture(UVec2::splat(32)));
    let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(preset))).id();
    hit(&mut app, center(entity));
    step(&mut app);
    assert_eq!(counts(&app).queued, 1, "its preset never comes");
    let wild = GuidedCracks::new(CrackGuide::new(Grid::new(UVec2::new(3, 1), 0.5)).with_gamma(f32::NAN));
    app.world_mut().entity_mut(entity).insert(wild);
    steps(&mut app, 2);
    let told = &told(&app).failed;
    assert!(told.iter().any(|(failed, error)| *failed == entity && matches!(error, CrackError::OutOfRange { .. })));
    assert_eq!((counts(&app).rejected, counts(&app).queued), (1, 0));
}
