//! A hall of a tile map, 64 x 34 tiles, that is shot at: cracks run from tile to tile, and a hammer brings a pillar down.
//!
//! The hall and the pillar are a group each, of one chunk of tiles: each cracks as one surface.
//!
//! Click to fire at the pointer, Space swings the hammer at the pillar, H heals.
//!
//! Without a display (or with `--headless`) a script plays, and pictures and a GIF are written to `--out`.
//! The picture of the README is the last one of `--frames 150 --height 680 --out film`.

use bevy::{
    asset::RenderAssetUsages,
    image::ImageSampler,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
    sprite_render::{AlphaMode2d, TileData, TilemapChunk, TilemapChunkTileData},
};
use bevy_crack::{
    math::Rng,
    prelude::*,
    shatter::{Anchor, BurstParams, ShatterParams},
};
use bevy_crack_demos::{Cursor, DemoArguments, OnCanvas, Script, caption, demo_app, heal_on_h, play};

/// Tiles of the level, and their size in the world.
const LEVEL: UVec2 = UVec2::new(64, 34);
const TILE: u32 = 20;

/// Texels of a side of a tile.
const TEXELS: u32 = 32;

/// Pictures of stones: courses that are shifted against each other, tones of each.
const COURSES: u32 = 2;
const TONES: u32 = 6;

/// Rectangles of stone, in tiles from the bottom left: first and last column and row. The hall, and the pillar that comes down.
const HALL: [[u32; 4]; 7] =
    [[0, 63, 0, 4], [0, 63, 30, 33], [0, 3, 5, 29], [60, 63, 5, 29], [20, 25, 5, 29], [18, 27, 27, 29], [4, 8, 5, 9]];
const PILLAR: [[u32; 4]; 3] = [[39, 44, 5, 29], [37, 46, 27, 29], [37, 46, 5, 6]];

/// Length of a pattern unit of the cracks, in the world.
const UNIT: f32 = 380.0;

/// Where the gun stands, and how fast bullets fly.
const GUN: Vec2 = Vec2::new(-440.0, -122.0);
const SPEED: f32 = 1500.0;

/// Shots of the script, and where the hammer hits.
const TARGETS: [Vec2; 9] = [
    Vec2::new(-236.0, -60.0),
    Vec2::new(-236.0, 90.0),
    Vec2::new(-300.0, -248.0),
    Vec2::new(-236.0, -150.0),
    Vec2::new(-330.0, 270.0),
    Vec2::new(-100.0, 265.0),
    Vec2::new(-232.0, 30.0),
    Vec2::new(-410.0, -248.0),
    Vec2::new(-236.0, 180.0),
];
const HAMMER: Vec2 = Vec2::new(196.0, -10.0);

/// Stones that crack as one.
#[derive(Component)]
struct Stones(&'static [[u32; 4]]);

/// The stones that the hammer brings down.
#[derive(Component)]
struct Pillar;

#[derive(Component)]
struct Bullet(Vec2);

fn main() -> AppExit {
    let arguments = DemoArguments::given("A hall of a tile map that is shot at, and loses a pillar");
    let mut app = demo_app("bevy_crack: dungeon", &arguments);
    app.insert_resource(ClearColor(Color::srgb(0.05, 0.05, 0.06)))
        .add_systems(Startup, setup)
        .add_systems(Update, (fly, fade, put_on_canvas));
    play(app, (play_by_hand, heal_on_h), play_script)
}

fn setup(mut commands: Commands, mut images: ResMut<Assets<Image>>) {
    commands.spawn(Camera2d);
    let mut rng = Rng::new(11);
    let tileset = images.add(stones(&mut rng));
    let chunk = TilemapChunk {
        chunk_size: LEVEL,
        tile_display_size: UVec2::splat(TILE),
        tileset,
        alpha_mode: AlphaMode2d::Opaque,
    };
    let mut tile = |row: u32, color: Color| {
        let index = row % COURSES * TONES + rng.next_u32() % TONES;
        Some(TileData { color, ..TileData::from_tileset_index(index as u16) })
    };
    // The wall behind lies in the dark, the more so the farther from the middle.
    let behind = (0..LEVEL.element_product()).map(|i| {
        let at = tile_at(i).as_vec2() / LEVEL.as_vec2() - 0.5;
        let light = 0.34 - 0.5 * at.length_squared();
        tile(i / LEVEL.x, Color::srgb(light * 0.9, light, light * 1.15))
    });
    let behind = TilemapChunkTileData(behind.collect());
    commands.spawn((chunk.clone(), behind, Transform::from_xyz(0.0, 0.0, -2.0)));

    for stones in [&HALL[..], &PILLAR[..]] {
        let tiles =
            (0..LEVEL.element_product()).map(|i| lies_in(stones, tile_at(i)).then(|| tile(i / LEVEL.x, Color::WHITE)));
        let tiles = TilemapChunkTileData(tiles.map(Option::flatten).collect());
        // Presets are made for surfaces whose shorter side is a unit.
        let preset = CrackPreset::CONCRETE.scaled(UNIT / shorter_side(stones));
        let group = commands.spawn((Stones(stones), CrackSurface::new(preset).with_seed(8))).id();
        commands.spawn((chunk.clone(), tiles, CrackMemberOf(group)));
        if stones == PILLAR {
            let shatter = ShatterCracks {
                cut: ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT },
                anchor: Anchor::Nothing,
                burst: BurstParams { hold: 0.0, speed: 0.4, gravity: Vec2::new(0.0, -5.0), ..BurstParams::DEFAULT },
                ..default()
            };
            commands.entity(group).insert((Pillar, shatter));
        }
    }

    let gun = Sprite::from_color(Color::srgb(0.2, 0.21, 0.25), Vec2::new(64.0, 22.0));
    commands.spawn((gun, Transform::from_xyz(GUN.x - 24.0, GUN.y, 1.0)));
    commands.spawn(caption("click: fire      Space: swing the hammer      H: heal", Vec2::new(0.0, -326.0)));
}

fn tile_at(i: u32) -> UVec2 {
    UVec2::new(i % LEVEL.x, i / LEVEL.x)
}

fn lies_in(stones: &[[u32; 4]], tile: UVec2) -> bool {
    let holds = |[left, right, bottom, top]: &[u32; 4]| {
        (*left..=*right).contains(&tile.x) && (*bottom..=*top).contains(&tile.y)
    };
    stones.iter().any(holds)
}

/// The shorter side of the rectangle around some stones, in the world.
fn shorter_side(stones: &[[u32; 4]]) -> f32 {
    let most = |side: usize| stones.iter().map(|stone| stone[side]).max().unwrap_or(0) + 1;
    let least = |side: usize| stones.iter().map(|stone| stone[side]).min().unwrap_or(0);
    ((most(1) - least(0)).min(most(3) - least(2)) * TILE) as f32
}

/// Whether some stones lie at a point of the world.
fn are_at(stones: &[[u32; 4]], point: Vec2) -> bool {
    let tile = (point / TILE as f32 + LEVEL.as_vec2() / 2.0).floor();
    tile.cmpge(Vec2::ZERO).all() && tile.cmplt(LEVEL.as_vec2()).all() && lies_in(stones, tile.as_uvec2())
}

/// A set of hewn stones, one below the other.
fn stones(rng: &mut Rng) -> Image {
    let layers = COURSES * TONES;
    let mut texels = Vec::new();
    for layer in 0..layers {
        let tone = rng.range(0.86, 1.06);
        let warm = rng.range(-0.03, 0.03);
        // One stone a tile in even courses, two halves of stones in odd ones.
        let shift = layer / TONES * TEXELS / 2;
        for (x, y) in (0..TEXELS).flat_map(|y| (0..TEXELS).map(move |x| ((x + shift) % TEXELS, y))) {
            let edge = x.min(TEXELS - 1 - x).min(y.min(TEXELS - 1 - y));
            let light = match edge {
                0 => 0.45,
                1 | 2 if x <= 2 || y <= 2 => 1.12,
                1 | 2 => 0.82,
                _ => 1.0,
            };
            let grain = rng.range(0.93, 1.07) * if rng.unit() < 0.03 { 0.85 } else { 1.0 };
            let value = 0.56 * tone * light * grain;
            let channel = |value: f32| (255.0 * value.clamp(0.0, 1.0)) as u8;
            texels.extend([channel(value + warm), channel(value), channel(value - warm), 255]);
        }
    }
    let size = Extent3d { width: TEXELS, height: TEXELS, depth_or_array_layers: layers };
    let format = TextureFormat::Rgba8UnormSrgb;
    let mut image = Image::new(size, TextureDimension::D2, texels, format, RenderAssetUsages::default());
    image.sampler = ImageSampler::linear();
    image
}

fn fire(commands: &mut Commands, at: Vec2) {
    let way = (at - GUN).normalize_or(Vec2::X);
    let sprite = Sprite::from_color(Color::srgb(2.0, 1.7, 0.9), Vec2::new(22.0, 5.0));
    let turn = Quat::from_rotation_z(way.to_angle());
    commands.spawn((Bullet(way * SPEED), sprite, Transform::from_translation(GUN.extend(2.0)).with_rotation(turn)));
}

/// Bullets fly until they are in a wall.
fn fly(
    mut commands: Commands,
    time: Res<Time>,
    groups: Query<(Entity, &Stones)>,
    mut bullets: Query<(Entity, &Bullet, &mut Transform)>,
) {
    for (entity, Bullet(speed), mut place) in &mut bullets {
        let (steps, from) = (16, place.translation.truncate());
        let way = speed * time.delta_secs() / steps as f32;
        place.translation += (way * steps as f32).extend(0.0);
        let on_the_way = (1..=steps).map(|step| from + way * step as f32);
        let mut met = on_the_way.filter_map(|point| {
            let group = groups.iter().find(|(_, stones)| are_at(stones.0, point))?;
            Some((group.0, point))
        });
        if let Some((group, point)) = met.next() {
            let inside = point + speed.normalize_or_zero() * 10.0;
            let blow = CrackHit::world(group, inside.extend(0.0)).with_energy(1.0);
            commands.trigger(CrackHit { direction: speed.extend(0.0), ..blow });
            commands.entity(entity).despawn();
            dust(&mut commands, point, 10, 60.0);
        } else if place.translation.length() > 2000.0 {
            commands.entity(entity).despawn();
        }
    }
}

#[derive(Component)]
struct Dust(Vec2, f32);

fn dust(commands: &mut Commands, at: Vec2, count: u32, speed: f32) {
    let mut rng = Rng::new(u64::from(at.x.to_bits()) ^ u64::from(at.y.to_bits()) << 20);
    for _ in 0..count {
        let way = Vec2::from_angle(rng.range(0.0, core::f32::consts::TAU)) * rng.range(0.3, 1.0) * speed;
        let grey = rng.range(0.5, 0.75);
        let sprite = Sprite::from_color(Color::srgba(grey, grey, grey, 0.8), Vec2::splat(rng.range(3.0, 8.0)));
        commands.spawn((Dust(way, rng.range(0.4, 0.9)), sprite, Transform::from_translation(at.extend(2.5))));
    }
}

/// Dust slows down, sinks and fades.
fn fade(mut commands: Commands, time: Res<Time>, mut grains: Query<(Entity, &mut Dust, &mut Transform, &mut Sprite)>) {
    let seconds = time.delta_secs();
    for (entity, mut dust, mut place, mut sprite) in &mut grains {
        let way = dust.0;
        place.translation += (way * seconds).extend(0.0);
        dust.0 = way * (1.0 - (2.0 * seconds).min(1.0)) - Vec2::new(0.0, 120.0 * seconds);
        dust.1 -= seconds;
        sprite.color.set_alpha(dust.1.clamp(0.0, 0.8));
        if dust.1 <= 0.0 {
            commands.entity(entity).despawn();
        }
    }
}

/// Where nothing can be drawn, the picture of the walls is shown as soon as it has been put together.
fn put_on_canvas(mut commands: Commands, groups: Query<(Entity, &Sprite), (With<Stones>, Without<OnCanvas>)>) {
    for (group, sprite) in &groups {
        if let Some(size) = sprite.custom_size {
            commands.entity(group).insert(OnCanvas { picture: sprite.image.clone(), size });
        }
    }
}

/// The blow of a hammer: strong hits one above the other, around `at`.
fn swing(commands: &mut Commands, pillar: Entity, at: Vec2) {
    for aside in [-200.0, -110.0, 0.0, 90.0, 190.0] {
        let at = at + Vec2::new(0.1 * aside, aside);
        if are_at(&PILLAR, at) {
            commands.trigger(CrackHit::world(pillar, at.extend(0.0)).with_energy(1.5));
        }
    }
    dust(commands, at, 40, 220.0);
}

/// What it has broken comes down.
fn bring_down(commands: &mut Commands, pillar: Entity) {
    let blow = ShatterRequest { direction: Some(Vec3::new(1.0, 0.0, 0.0)), ..ShatterRequest::ALL };
    commands.entity(pillar).shatter_cracks(blow.with_energy(1.0));
}

fn play_by_hand(
    mut commands: Commands,
    keys: Res<ButtonInput<KeyCode>>,
    buttons: Res<ButtonInput<MouseButton>>,
    cursor: Cursor,
    pillar: Single<Entity, With<Pillar>>,
    time: Res<Time>,
    mut falls_at: Local<Option<f32>>,
) {
    if falls_at.take_if(|when| time.elapsed_secs() > *when).is_some() {
        bring_down(&mut commands, *pillar);
    }
    let Some(at) = cursor.point() else { return };
    if buttons.just_pressed(MouseButton::Left) {
        fire(&mut commands, at);
    }
    if keys.just_pressed(KeyCode::Space) && are_at(&PILLAR, at) {
        swing(&mut commands, *pillar, at);
        *falls_at = Some(time.elapsed_secs() + 0.7);
    }
}

/// The scripted run, by shares of its length: shots, and then the hammer.
fn play_script(mut commands: Commands, script: Script, pillar: Single<Entity, With<Pillar>>) {
    for i in script.due(TARGETS.len() as u32, 0.03..0.5) {
        fire(&mut commands, TARGETS[i as usize]);
    }
    if script.is_at(0.56) {
        swing(&mut commands, *pillar, HAMMER);
    }
    if script.is_at(0.9) {
        bring_down(&mut commands, *pillar);
    }
}
