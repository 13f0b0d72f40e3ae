//! An earthquake: cracks run over a road and branch.
//!
//! Move the mouse from the left to the right: the further right it is, the further the cracks are. Click for other cracks, H heals. Without a
//! display (or with `--headless`) the cracks run by themselves, and pictures and a GIF are written to `--out`.

use bevy::prelude::*;
use bevy_crack::{paint::Look, prelude::*, strands::StrandParams};
use bevy_crack_demos::{Cursor, DemoArguments, OnCanvas, Script, caption, demo_app, heal_on_h, play};

/// Size of the road in the world.
const SIZE: Vec2 = Vec2::new(1120.0, 560.0);

/// Where cracks start, texture coordinates.
const STARTS: [Vec2; 3] = [Vec2::new(0.0, 0.3), Vec2::new(0.0, 0.62), Vec2::new(0.0, 0.9)];

#[derive(Component)]
struct Road;

fn main() -> AppExit {
    let mut app = demo_app(
        "bevy_crack: earthquake",
        &DemoArguments::given("Cracks run over a road and branch as the earth shakes"),
    );
    app.insert_resource(ClearColor(Color::srgb(0.24, 0.27, 0.2))).add_systems(Startup, setup);
    play(app, (shake_by_hand, crack_anew, heal_on_h), shake_by_script)
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    commands.spawn(Camera2d);
    let picture = assets.load("textures/asphalt.png");
    commands.spawn((
        Road,
        Sprite { image: picture.clone(), custom_size: Some(SIZE), ..default() },
        CrackSurface::new(CrackPreset { look: Look::ASPHALT, ..CrackPreset::CONCRETE }),
        quake(3),
        CrackClock::value(0.0),
        OnCanvas { picture, size: SIZE },
    ));
    commands.spawn(caption("move right: shake      click: other cracks      H: heal", Vec2::new(0.0, -320.0)));
}

/// Strands along the road that branch twice.
fn quake(seed: u64) -> CrackStrands {
    let starts = STARTS.map(HitPoint::Uv);
    let params = StrandParams { length: 2.4, ..StrandParams::ASPHALT };
    // The clock has the say; above zero, cracks come in the order of their growth.
    CrackStrands::new(starts, StrandField::Linear(Vec2::X)).with_params(params).with_seed(seed).with_seconds(3.0)
}

/// The mouse says how far the cracks are.
fn shake_by_hand(cursor: Cursor, mut clock: Single<&mut CrackClock, With<Road>>) {
    if let Some(point) = cursor.point() {
        clock.set_if_neq(CrackClock::value((point.x / SIZE.x + 0.5).clamp(0.0, 1.0)));
    }
}

fn crack_anew(buttons: Res<ButtonInput<MouseButton>>, mut strands: Single<&mut CrackStrands, With<Road>>) {
    if buttons.just_pressed(MouseButton::Left) {
        strands.seed += 1;
    }
}

/// The scripted run: time goes on to the end, and rests there.
fn shake_by_script(script: Script, mut clock: Single<&mut CrackClock, With<Road>>) {
    clock.set_if_neq(CrackClock::value((1.25 * script.share()).min(1.0)));
}
