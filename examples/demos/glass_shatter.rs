//! A pane of glass: hit, cracked, burst, in slow motion, and whole again as time runs backwards.
//!
//! Click to hit, Space to burst, hold S for slow motion, R turns time around, H heals.
//!
//! Without a display (or with `--headless`) a script plays, and pictures and a GIF are written to `--out`.
//! Try `--frames 300 --out film`.

use bevy::prelude::*;
use bevy_crack::{
    prelude::*,
    shatter::{Anchor, BreakAgain, BurstParams, ShatterParams},
};
use bevy_crack_demos::{Cursor, DemoArguments, OnCanvas, Script, caption, demo_app, heal_on_h, play};

/// Size of the pane in the world.
const SIDE: f32 = 460.0;

/// How fast time runs in slow motion, and backwards.
const SLOW: f32 = 0.22;
const BACKWARDS: f32 = -1.5;

/// Seconds in which the cracks close when the pane is whole again.
const CLOSE: f32 = 1.0;

#[derive(Component)]
struct Pane;

fn main() -> AppExit {
    let mut app =
        demo_app("bevy_crack: glass", &DemoArguments::given("A pane of glass that bursts, and becomes whole again"));
    app.insert_resource(ClearColor(Color::srgb(0.09, 0.1, 0.12))).add_systems(Startup, setup).add_observer(mend);
    play(app, (play_by_hand, heal_on_h), play_script)
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    commands.spawn(Camera2d);
    // The pane stands before a wall, so that one sees it is glass.
    let behind = assets.load("textures/brick_red.png");
    commands.spawn((
        Sprite {
            image: behind.clone(),
            custom_size: Some(Vec2::splat(SIDE + 60.0)),
            color: Color::srgb(0.42, 0.43, 0.46),
            ..default()
        },
        Transform::from_xyz(0.0, 40.0, -1.0),
        OnCanvas { picture: behind, size: Vec2::splat(SIDE + 60.0) },
    ));
    let pane = assets.load("textures/glass_pane.png");
    commands.spawn((
        Pane,
        Sprite { image: pane.clone(), custom_size: Some(Vec2::splat(SIDE)), ..default() },
        Transform::from_xyz(0.0, 40.0, 0.0),
        CrackSurface::new(CrackPreset::GLASS).with_seed(5),
        ShatterCracks {
            cut: ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT },
            anchor: Anchor::Nothing,
            again: Some(BreakAgain { after: 0.5, ..BreakAgain::DEFAULT }),
            burst: BurstParams { hold: 0.25, speed: 1.4, gravity: Vec2::new(0.0, -1.6), ..BurstParams::DEFAULT },
            ..default()
        },
        OnCanvas { picture: pane, size: Vec2::splat(SIDE) },
    ));
    commands.spawn(caption(
        "click: hit      Space: burst      S: slow motion      R: turn time around      H: heal",
        Vec2::new(0.0, -335.0),
    ));
}

/// Whole again: now the cracks close as well.
fn mend(whole: On<Reassembled>, mut commands: Commands, mut panes: Query<&mut ShatterCracks>) {
    commands.entity(whole.entity).close_cracks(CLOSE);
    if let Ok(mut pane) = panes.get_mut(whole.entity) {
        pane.speed = 1.0;
    }
}

fn play_by_hand(
    mut commands: Commands,
    keys: Res<ButtonInput<KeyCode>>,
    buttons: Res<ButtonInput<MouseButton>>,
    cursor: Cursor,
    pane: Single<(Entity, &mut ShatterCracks), With<Pane>>,
) {
    let (entity, mut shatter) = pane.into_inner();
    if buttons.just_pressed(MouseButton::Left)
        && let Some(at) = cursor.point()
    {
        commands.trigger(CrackHit::world(entity, at.extend(0.0)).with_energy(2.0));
    }
    if keys.just_pressed(KeyCode::Space) {
        shatter.speed = 1.0;
        commands.entity(entity).shatter_cracks(ShatterRequest::ALL);
    }
    if keys.just_pressed(KeyCode::KeyS) {
        shatter.speed *= SLOW;
    }
    if keys.just_released(KeyCode::KeyS) {
        shatter.speed = shatter.speed.signum();
    }
    if keys.just_pressed(KeyCode::KeyR) {
        shatter.speed = -shatter.speed;
    }
}

/// The scripted run, by shares of its length: three hits, a burst, slow motion, and back.
fn play_script(mut commands: Commands, script: Script, pane: Single<(Entity, &mut ShatterCracks), With<Pane>>) {
    let (entity, mut shatter) = pane.into_inner();
    if script.is_at(0.05) {
        commands.trigger(CrackHit::uv(entity, Vec2::new(0.4, 0.42)).with_energy(3.0));
    }
    if script.is_at(0.16) {
        commands.trigger(CrackHit::uv(entity, Vec2::new(0.68, 0.62)).with_energy(1.5));
    }
    if script.is_at(0.2) {
        commands.trigger(CrackHit::uv(entity, Vec2::new(0.25, 0.75)).with_energy(1.5));
    }
    if script.is_at(0.3) {
        let at = ShatterRequest::around(Vec2::new(0.4, 0.42), 64.0);
        commands.entity(entity).shatter_cracks(at.with_energy(3.0));
    }
    if script.is_at(0.38) {
        shatter.speed = SLOW;
    }
    if script.is_at(0.6) {
        shatter.speed = 1.0;
    }
    if script.is_at(0.66) {
        shatter.speed = BACKWARDS;
    }
}
