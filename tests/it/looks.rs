//! What looks show beside cracks (plates, crushed zones, veils, light) on surfaces that heal, run backwards and change.

use crate::support::*;
use bevy::{image::ImageSampler, prelude::*};
use bevy_crack::{
    paint::{Look, Shades},
    prelude::*,
};

const SIZE: UVec2 = UVec2::new(120, 96);

/// Presets that show plates, crushed zones, veils and curled rims.
const PRESETS: [CrackPreset; 5] =
    [CrackPreset::GLASS, CrackPreset::MUD, CrackPreset::ICE, CrackPreset::CONCRETE, CrackPreset::TOON];

fn spawn(app: &mut App, image: &Handle<Image>, preset: &CrackPreset) -> Entity {
    let surface = CrackSurface::new(preset.clone()).with_seed(3);
    app.world_mut().spawn((Sprite::from_image(image.clone()), surface)).id()
}

fn hit_twice(app: &mut App, entity: Entity) {
    hit(app, CrackHit::uv(entity, Vec2::new(0.4, 0.5)));
    hit(app, CrackHit::uv(entity, Vec2::new(0.7, 0.4)).with_energy(2.0));
}

fn set_value(app: &mut App, entity: Entity, value: f32) -> Vec<u8> {
    app.world_mut().entity_mut(entity).insert(CrackClock::value(value));
    steps(app, 3);
    shown(app, entity)
}

#[test]
fn surfaces_of_all_looks_heal_to_the_untouched_picture() {
    for preset in PRESETS {
        let mut app = app();
        let image = add(&mut app, picture(SIZE));
        let untouched = texels(&app, &image);
        let entity = spawn(&mut app, &image, &preset);
        hit_twice(&mut app, entity);
        settle(&mut app, entity);
        let cracked = shown(&app, entity);
        assert!(cracked != untouched, "nothing shows");
        app.world_mut().commands().entity(entity).heal_cracks();
        steps(&mut app, 2);
        assert_eq!(image_of(&app, entity), image);
        assert!(shown(&app, entity) == untouched, "it is not whole");
        hit_twice(&mut app, entity);
        settle(&mut app, entity);
        assert!(shown(&app, entity) == cracked, "the same hits make other cracks");
    }
}

#[test]
fn all_that_looks_show_follows_the_clock() {
    for preset in PRESETS {
        let mut app = app();
        let image = add(&mut app, picture(SIZE));
        let untouched = texels(&app, &image);
        let plain = spawn(&mut app, &image, &preset);
        hit_twice(&mut app, plain);
        settle(&mut app, plain);
        let entity = spawn(&mut app, &image, &preset);
        app.world_mut().entity_mut(entity).insert(CrackClock::value(0.0));
        hit_twice(&mut app, entity);
        let end = |app: &App| state(app, entity).end;
        let goal = end(&app).max(state(&app, plain).end);
        wait_for(&mut app, "the end of growth", |app| end(app) >= goal);
        assert!(set_value(&mut app, entity, 0.0) == untouched, "something shows at the start");
        let values = [0.2, 0.5, 0.8, 1.0];
        let pictures = values.map(|value| set_value(&mut app, entity, value));
        assert!(pictures[3] == shown(&app, plain), "the end is not that of a surface without a clock");
        assert!(pictures.windows(2).all(|pair| pair[0] != pair[1]), "each time has a picture of its own");
        for i in [1, 3, 0, 2, 1, 0, 3] {
            assert!(set_value(&mut app, entity, values[i]) == pictures[i], "{} comes back as another", values[i]);
        }
        assert!(set_value(&mut app, entity, 0.0) == untouched, "something is left");
    }
}

#[test]
fn a_look_that_is_changed_shows_as_if_it_had_been_there_from_the_start() {
    for preset in PRESETS {
        let mut app = app();
        let image = add(&mut app, picture(SIZE));
        let bare = CrackPreset { look: Look::GROOVE, ..preset.clone() };
        let [wanted, changed] = [&preset, &bare].map(|preset| spawn(&mut app, &image, preset));
        for entity in [wanted, changed] {
            hit_twice(&mut app, entity);
            settle(&mut app, entity);
        }
        assert!(shown(&app, wanted) != shown(&app, changed), "they look the same");
        app.world_mut().get_mut::<CrackSurface>(changed).expect("it is there").preset = preset.into();
        steps(&mut app, 3);
        assert!(shown(&app, wanted) == shown(&app, changed), "they look different");
    }
}

#[test]
fn cracks_that_glow_write_an_emissive_map_and_heal() {
    let mut app = app();
    let image = add(&mut app, picture(SIZE));
    let own = StandardMaterial { base_color_texture: Some(image), ..default() };
    let (mesh, material) = (add(&mut app, Mesh::from(Rectangle::default())), add(&mut app, own));
    let preset = CrackPreset { look: Look::GLOWING, ..CrackPreset::CONCRETE };
    let wall = (Mesh3d(mesh), MeshMaterial3d(material.clone()));
    let entity = app.world_mut().spawn((wall, CrackSurface::new(preset))).id();
    hit(&mut app, center(entity).with_energy(4.0));
    settle(&mut app, entity);
    let emissive = get::<CrackTextures>(&app, entity).emissive.expect("an emissive map");
    let light = texels(&app, &emissive);
    let lit = light.as_chunks::<4>().0.iter().filter(|texel| texel[0] > 150).count();
    assert!(lit > 20, "{lit} texels give off light");
    assert!(light.as_chunks::<4>().0.contains(&[0, 0, 0, 255]), "all of it gives off light");
    let shown = get::<MeshMaterial3d<StandardMaterial>>(&app, entity).0;
    let shown = app.world().resource::<Assets<StandardMaterial>>().get(&shown).expect("the material");
    assert_eq!((shown.emissive_texture.as_ref(), shown.emissive), (Some(&emissive), LinearRgba::WHITE));
    app.world_mut().commands().entity(entity).heal_cracks();
    steps(&mut app, 2);
    assert_eq!(get::<MeshMaterial3d<StandardMaterial>>(&app, entity).0, material);
}

/// Pixel art: where texels are shown as squares, cracks are whole texels in few shades of the picture's own colours, unless the preset says
/// otherwise; where they are not, cracks are smooth.
#[test]
fn cracks_in_pixel_art_are_shades_of_its_colours() {
    let shades = |nearest: bool, shades: Shades| {
        let mut app = app();
        let mut texture = picture(SIZE);
        texture.sampler = if nearest { ImageSampler::nearest() } else { ImageSampler::linear() };
        let image = add(&mut app, texture);
        let before = texels(&app, &image);
        let mut preset = CrackPreset::CONCRETE;
        preset.look.shades = shades;
        let entity = spawn(&mut app, &image, &preset);
        hit_twice(&mut app, entity);
        settle(&mut app, entity);
        let after = shown(&app, entity);
        let changed: Vec<_> = before.chunks(4).zip(after.chunks(4)).filter(|(before, after)| before != after).collect();
        assert!(changed.len() > 200, "{} texels show cracks", changed.len());
        let is_shade = |before: &[u8], after: &[u8], share: f32| {
            (0..3).all(|c| (f32::from(before[c]) * share).round().min(255.0) as u8 == after[c])
        };
        let steps = [0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let n = changed.iter().filter(|(a, b)| steps.iter().any(|k| is_shade(a, b, k / 3.0))).count();
        n as f32 / changed.len() as f32
    };
    assert_eq!(shades(true, Shades::Auto), 1.0);
    assert_eq!(shades(false, Shades::Steps(3)), 1.0);
    for smooth in [shades(false, Shades::Auto), shades(true, Shades::Smooth)] {
        assert!(smooth < 0.3, "{smooth} of the texels are shades by chance");
    }
}
