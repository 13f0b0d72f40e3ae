//! How shards look, break again, serve again, and that nothing is left of them however often that is.

use crate::{
    MEMORY,
    shards::{crack, cracked, loose, shards, shatter, stock, vertices},
    support::*,
};
use bevy::{mesh::VertexAttributeValues, prelude::*};
use bevy_crack::{
    paint::Shades,
    prelude::*,
    shatter::{BreakAgain, BurstParams, RimLook, SizeClasses},
};
use std::collections::BTreeMap;

fn colors(app: &App, mesh: &Handle<Mesh>) -> Vec<[f32; 4]> {
    match app.world().resource::<Assets<Mesh>>().get(mesh).expect("the mesh").attribute(Mesh::ATTRIBUTE_COLOR) {
        Some(VertexAttributeValues::Float32x4(colors)) => colors.clone(),
        _ => Vec::new(),
    }
}

fn set(app: &mut App, entity: Entity, change: impl FnOnce(&mut ShatterCracks)) {
    change(&mut app.world_mut().get_mut::<ShatterCracks>(entity).expect("the settings"));
}

/// Where every shard is and what it shows, by area and centre: both tell it from all others.
fn pieces(app: &mut App) -> BTreeMap<[u32; 3], (Transform, Vec<(Vec3, Vec2)>)> {
    let mut all = BTreeMap::new();
    for entity in shards(app) {
        let (shard, mesh) = (get::<Shard>(app, entity), get::<Mesh2d>(app, entity).0);
        let piece = shard.pieces.get(shard.number).expect("the piece").clone();
        let key = [piece.area, piece.centroid.x, piece.centroid.y].map(f32::to_bits);
        assert_eq!(get::<Visibility>(app, entity), Visibility::Inherited);
        assert!(all.insert(key, (get(app, entity), vertices(app, &mesh))).is_none(), "one piece twice");
    }
    all
}

fn area(app: &mut App) -> f32 {
    shards(app).iter().map(|shard| get::<Shard>(app, *shard).area()).sum()
}

#[test]
fn pieces_break_again_in_the_air_and_come_together() {
    let mut app = app();
    let again = BreakAgain { after: 0.2, ..BreakAgain::DEFAULT };
    let burst = BurstParams { fade_after: 60.0, ..BurstParams::DEFAULT };
    let settings = ShatterCracks { again: Some(again), burst, speed: 1.0, ..loose() };
    let entity = cracked(&mut app, UVec2::splat(64), settings);
    step(&mut app);
    let (stock_before, whole) = (stock(&app), shown(&app, entity));
    shatter(&mut app, entity, ShatterRequest::ALL);
    let (first, first_area) = (pieces(&mut app), area(&mut app));
    let gone = get::<CrackShards>(&app, entity).gone;
    assert_eq!(gone as usize, first.len());
    steps(&mut app, 40);
    let early = pieces(&mut app);
    assert!(early.len() > 2 * first.len(), "{} of {}", early.len(), first.len());
    steps(&mut app, 160);
    let late = pieces(&mut app);
    assert!((area(&mut app) - first_area).abs() < 1e-3 * first_area, "nothing is lost");
    assert_eq!(get::<CrackShards>(&app, entity).gone, gone);
    let extent = 64.0 * 64.0;
    let largest = shards(&mut app).iter().map(|shard| get::<Shard>(&app, *shard).area() / extent).fold(0.0, f32::max);
    assert!(largest <= SizeClasses::DEFAULT.largest[0] * 1.001, "each into splinters in the end: {largest}");
    // Any time again, from either side.
    for (time, expected) in [(0.8, &early), (4.0, &late), (0.8, &early), (0.0, &first), (4.0, &late)] {
        set(&mut app, entity, |settings| (settings.seek, settings.speed) = (Some(time), 0.0));
        step(&mut app);
        let found = pieces(&mut app);
        assert!(found.keys().eq(expected.keys()), "other pieces at {time}: {} {}", found.len(), expected.len());
        for ((at, form), (expected_at, expected_form)) in found.values().zip(expected.values()) {
            assert!(at.translation.distance(expected_at.translation) < 1e-2, "{at:?} {expected_at:?} at {time}");
            assert_eq!(form, expected_form, "used again, a mesh is as a new one");
        }
    }
    set(&mut app, entity, |settings| (settings.seek, settings.speed) = (Some(0.3), -1.0));
    steps(&mut app, 20);
    assert!(shown(&app, entity) == whole && shards(&mut app).is_empty());
    assert_eq!(stock(&app), stock_before);
}

#[test]
fn what_is_spent_serves_again() {
    let mut app = app();
    let burst = BurstParams { hold: 0.0, fade_after: 0.1, fade: 0.1, ..BurstParams::DEFAULT };
    let settings = ShatterCracks { speed: 1.0, burst, ..loose() };
    let first = cracked(&mut app, UVec2::splat(64), settings.clone());
    let second = cracked(&mut app, UVec2::splat(64), settings);
    let whole = stock(&app);
    shatter(&mut app, first, ShatterRequest::ALL);
    let (shown_first, full) = (pieces(&mut app), stock(&app));
    let bodies = shards(&mut app);
    // Showing a shard again does not count twice.
    app.world_mut().resource_mut::<CrackBudget>().max_shards = 2 * bodies.len() + 1;
    steps(&mut app, 60);
    assert!(shards(&mut app).is_empty() && get::<CrackShards>(&app, first).shown == 0);
    assert!(bodies.iter().all(|body| get::<Visibility>(&app, *body) == Visibility::Hidden), "kept");
    // Another surface wears them: no entity, no mesh is made.
    shatter(&mut app, second, ShatterRequest::ALL);
    let of_second = shards(&mut app);
    assert!(of_second.len() == bodies.len() && of_second.iter().all(|shard| bodies.contains(shard)));
    let parents = of_second.iter().all(|shard| get::<ChildOf>(&app, *shard).parent() == second);
    assert!(parents && of_second.iter().all(|shard| get::<Shard>(&app, *shard).surface == second));
    assert_eq!(stock(&app)[..2], full[..2]);
    // Two hundred times more.
    for _ in 0..200 {
        steps(&mut app, 60);
        set(&mut app, first, |settings| settings.seek = Some(0.0));
        step(&mut app);
        set(&mut app, first, |settings| settings.speed = 1.0);
    }
    assert_eq!(stock(&app)[..2], full[..2]);
    set(&mut app, first, |settings| (settings.seek, settings.speed) = (Some(0.0), 0.0));
    steps(&mut app, 2);
    let now = pieces(&mut app);
    assert!(now.len() >= shown_first.len() && shown_first.keys().all(|piece| now.contains_key(piece)));
    for entity in [first, second] {
        app.world_mut().commands().entity(entity).heal_cracks();
    }
    steps(&mut app, 2);
    // Own textures are gone as well.
    assert!(stock(&app).iter().zip(&whole).all(|(now, before)| now <= before), "{:?} {whole:?}", stock(&app));
    assert_eq!(stock(&app)[0], whole[0]);
}

#[test]
fn rims_befit_the_preset() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(64)));
    let material = add(&mut app, StandardMaterial { base_color_texture: Some(image.clone()), ..default() });
    let quad = add(&mut app, Mesh::from(Rectangle::new(2.0, 2.0)));
    let settings = ShatterCracks { rim: None, ..loose() };
    // Extremes of the outer edges' brightness, and the brightness of the sides over that of the picture's mean.
    let mut look = |preset: CrackPreset| {
        let surface = CrackSurface::new(preset).with_seed(4);
        let sprite = (Sprite::from_image(image.clone()), surface.clone(), settings.clone());
        let flat = app.world_mut().spawn(sprite).id();
        let mesh = (Mesh3d(quad.clone()), MeshMaterial3d(material.clone()), surface, settings.clone());
        let solid = app.world_mut().spawn(mesh).id();
        let mut inside = 0.0;
        let mut range: Vec<f32> = Vec::new();
        for entity in [flat, solid] {
            crack(&mut app, entity);
            shatter(&mut app, entity, ShatterRequest::ALL);
            for shard in shards(&mut app) {
                let world = app.world();
                let mesh = world.get::<Mesh2d>(shard).map(|mesh| mesh.0.clone());
                let mesh = mesh.or(world.get::<Mesh3d>(shard).map(|mesh| mesh.0.clone())).expect("a mesh");
                range.extend(colors(&app, &mesh).iter().map(|color| color[0]));
                let Some(children) = app.world().get::<Children>(shard) else { continue };
                let sides = get::<MeshMaterial3d<StandardMaterial>>(&app, children[0]).0;
                let sides = app.world().resource::<Assets<StandardMaterial>>().get(&sides).expect("a material");
                // The picture of the grain is darker than white.
                let grain = if sides.base_color_texture.is_some() { 0.8 } else { 1.0 };
                inside = grain * sides.base_color.to_srgba().red / (180.0 / 255.0);
            }
            app.world_mut().despawn(entity);
            step(&mut app);
        }
        range.sort_by(f32::total_cmp);
        (range.first().copied(), range.last().copied(), inside)
    };
    let fast = |preset: CrackPreset| CrackPreset { steps_per_second: 2000.0, ..preset };
    let (low, high, inside) = look(fast(CrackPreset::GLASS));
    assert!(low >= Some(0.99) && high > Some(1.8) && inside > 0.9, "glass: {low:?} {high:?} {inside}");
    let (low, high, inside) = look(fast(CrackPreset::CLAY));
    assert!(low < Some(0.6) && high <= Some(1.0) && inside < 0.7, "clay: {low:?} {high:?} {inside}");
    assert_eq!(look(fast(CrackPreset::TOON)).0, None, "drawn");
}

/// The cut lines are the drawn ones, those as well that were carried on when the surface broke.
#[test]
fn every_edge_lies_on_a_drawn_crack() {
    let mut app = app();
    let (side, plain) = (256, [150, 148, 140, 255]);
    let image = add(&mut app, solid(UVec2::splat(side), plain));
    // Its cracks end in the open. They are wide enough for each texel of them to be seen, and have no needles at their ends.
    let mut preset = CrackPreset::CONCRETE;
    (preset.growth.line_width, preset.growth.tip_taper) = (0.012, 0.0);
    preset.look.shades = Shades::Smooth;
    let surface = CrackSurface::new(preset).with_seed(4);
    let entity = app.world_mut().spawn((Sprite::from_image(image), surface, loose())).id();
    crack(&mut app, entity);
    shatter(&mut app, entity, ShatterRequest::ALL);
    let cut = get::<CrackShards>(&app, entity).pieces;
    assert!(!cut.extended_lines().is_empty());
    let picture = shown(&app, entity);
    let is_drawn = |at: Vec2| {
        let texel = (at * side as f32).as_uvec2().min(UVec2::splat(side - 1));
        let i = 4 * (texel.y * side + texel.x) as usize;
        picture[i..i + 3] != plain[..3]
    };
    let on_border = |at: Vec2| at.min_element() < 1e-3 || at.max_element() > 1.0 - 1e-3;
    let (mut checked, mut missing) = (0, 0);
    for number in 0..cut.len() as u32 {
        let ring = cut.outline(number);
        for (i, &corner) in ring.iter().enumerate() {
            let [a, b] = [corner, ring[(i + 1) % ring.len()]].map(|corner| cut.positions()[corner as usize]);
            let middle = 0.5 * (a + b);
            if !on_border(a) && !on_border(b) {
                checked += 1;
                missing += u32::from(!is_drawn(middle));
            }
        }
    }
    assert!(checked > 200 && missing == 0, "{missing} of {checked}");
}

/// In a process of its own: other tests use memory as well.
#[test]
fn two_thousand_times_leave_nothing_behind() {
    let test = std::env::current_exe().expect("this program");
    let run = std::process::Command::new(test)
        .args(["shards_life::two_thousand_times", "--exact", "--ignored", "--nocapture"])
        .output()
        .expect("it runs");
    let told = String::from_utf8_lossy(&run.stdout) + String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success() && told.contains("1 passed"), "{told}");
}

#[test]
#[ignore = "run by `two_thousand_times_leave_nothing_behind`"]
fn two_thousand_times() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(48)));
    let settings =
        ShatterCracks { speed: 1.0, again: Some(BreakAgain { after: 0.1, ..BreakAgain::DEFAULT }), ..loose() };
    let preset = CrackPreset { steps_per_second: 4000.0, ..CrackPreset::GLASS };
    let surface = CrackSurface::new(preset).with_seed(4);
    let entity = app.world_mut().spawn((Sprite::from_image(image), surface, settings)).id();
    steps(&mut app, 2);
    let (before, picture) = (stock(&app), shown(&app, entity));
    let mut used = 0;
    for i in 0..2000 {
        crack(&mut app, entity);
        set(&mut app, entity, |settings| settings.rim = Some([RimLook::PLAIN, RimLook::GLASS][i % 2]));
        shatter(&mut app, entity, ShatterRequest::ALL);
        assert!(shards(&mut app).len() > 3);
        steps(&mut app, i % 4 * 6);
        app.world_mut().commands().entity(entity).heal_cracks();
        steps(&mut app, 2);
        assert_eq!(stock(&app), before, "after {i}");
        assert!(shown(&app, entity) == picture);
        if i == 400 {
            used = MEMORY.allocated();
        }
    }
    let more = MEMORY.allocated().saturating_sub(used);
    assert!(more < 4 << 20, "{more} bytes more after 1600 times");
    // Nothing of the budget is lost either.
    let tight = CrackBudget { milliseconds: 1e6, max_texture_bytes: 48 * 48 * (22 + 8 + 2), ..default() };
    app.insert_resource(tight);
    crack(&mut app, entity);
    shatter(&mut app, entity, ShatterRequest::ALL);
    assert!(!shards(&mut app).is_empty());
}
