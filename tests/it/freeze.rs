//! Surfaces that are hit for ever: the oldest cracks are frozen, so that the newest find room.

use crate::support::*;
use bevy::prelude::*;
use bevy_crack::{CrackPreset, math::Rng, paint::Shades, prelude::*};

const MOST: u32 = 200;

fn preset() -> CrackPreset {
    let mut preset = small_preset();
    preset.growth.max_nodes = MOST;
    preset.growth.draw_islands = true;
    // What is crushed is made anew where it is hit again; this is about cracks.
    preset.look.crushed = None;
    // Nothing is lit, or what is lit by one crack and in the shadow of another may look like the whole picture.
    preset.look.shades = Shades::Smooth;
    preset.look.ramp.to_mut().iter_mut().for_each(|stop| stop.cover = 1.0);
    (preset.look.relief, preset.look.glint, preset.look.shadow) = (0.0, 0.0, 0.0);
    (preset.growth.line_width, preset.growth.max_width) = (0.012, 0.03);
    preset
}

/// Hits the surface many times and lets each hit grow for some frames.
fn hammer(app: &mut App, entity: Entity, seed: u64, times: usize) {
    let mut rng = Rng::new(seed);
    for _ in 0..times {
        hit(app, CrackHit::uv(entity, Vec2::new(rng.unit(), rng.unit())).with_energy(0.6));
        steps(app, 6);
        assert!(state(app, entity).nodes <= MOST);
    }
    settle(app, entity);
}

fn spawn(app: &mut App) -> (Entity, Vec<u8>) {
    let image = add(app, solid(UVec2::splat(192), [200, 180, 160, 255]));
    let entity = app.world_mut().spawn((Sprite::from_image(image.clone()), CrackSurface::new(preset()))).id();
    (entity, texels(app, &image))
}

/// Which texels are not as in the whole picture.
fn is_cracked<'a>(whole: &'a [u8], now: &'a [u8]) -> impl Iterator<Item = bool> + 'a {
    whole.chunks(4).zip(now.chunks(4)).map(|(whole, now)| whole != now)
}

fn count(whole: &[u8], now: &[u8]) -> usize {
    is_cracked(whole, now).filter(|is_cracked| *is_cracked).count()
}

/// Share of the texels that were cracked which still are.
fn still_cracked(whole: &[u8], before: &[u8], now: &[u8]) -> f64 {
    let still = is_cracked(whole, before).zip(is_cracked(whole, now)).filter(|(before, now)| *before && *now).count();
    still as f64 / count(whole, before) as f64
}

#[test]
fn a_full_surface_goes_on_cracking_and_keeps_its_picture() {
    let mut app = app();
    let (entity, whole) = spawn(&mut app);
    hit(&mut app, center(entity).with_energy(2.0));
    settle(&mut app, entity);
    let first = shown(&app, entity);
    let mut cracked = first.clone();
    let mut frozen = 0;
    for round in 0..6 {
        hammer(&mut app, entity, round, 40);
        let (now, state) = (shown(&app, entity), state(&app, entity));
        assert!(still_cracked(&whole, &cracked, &now) == 1.0, "round {round}");
        assert!(state.frozen >= frozen);
        frozen = state.frozen;
        cracked = now;
        assert_sound(&app, entity);
    }
    let stats = counts(&app);
    assert_eq!((stats.rejected, stats.queued), (0, 0));
    assert_eq!(stats.sent, stats.applied + stats.merged);
    assert!(frozen > MOST, "{frozen}");
    // The first crack is long forgotten, and there to see.
    let (many, still) = (count(&whole, &first), still_cracked(&whole, &first, &cracked));
    assert!(many > 100 && still == 1.0, "{still} of {many}");
    app.world_mut().commands().entity(entity).heal_cracks();
    steps(&mut app, 2);
    assert_eq!(shown(&app, entity), whole);
    assert_eq!(state(&app, entity), CrackState::default());
}

#[test]
fn what_is_frozen_outlasts_a_new_look_and_goes_when_time_is_turned() {
    let mut app = app();
    let (entity, whole) = spawn(&mut app);
    hammer(&mut app, entity, 9, 120);
    let cells = state(&app, entity).cells;
    assert!(state(&app, entity).frozen > 0);
    let before = shown(&app, entity);
    // Another profile stamps all lines anew: those that are forgotten as well.
    let mut other = preset();
    other.profile.depth = 0.999;
    app.world_mut().get_mut::<CrackSurface>(entity).unwrap().preset = other.into();
    steps(&mut app, 3);
    assert!(still_cracked(&whole, &before, &shown(&app, entity)) == 1.0);
    assert_eq!(state(&app, entity).cells, cells);
    // Backwards, and forwards again: what is left, and no more.
    app.world_mut().entity_mut(entity).insert(CrackClock { seek: Some(0.0), ..CrackClock::speed(0.0) });
    steps(&mut app, 3);
    assert_eq!(shown(&app, entity), whole);
    assert_eq!(state(&app, entity).frozen, 0);
    app.world_mut().get_mut::<CrackClock>(entity).unwrap().seek = Some(1e6);
    steps(&mut app, 3);
    let (left, all) = (count(&whole, &shown(&app, entity)), count(&whole, &before));
    assert!(left > 50 && left < all, "{left} of {all}");
}
