//! What a game can hang on growing cracks: dust falls from their tips, grains fly where a cell closes, and every crackle is
//! there to be heard.
//!
//! Click to hit, H heals. Without a display (or with `--headless`) a script plays and pictures are written to `--out`.

use bevy::{platform::collections::HashMap, prelude::*};
use bevy_crack::{math::Rng, prelude::*};
use bevy_crack_demos::{DemoArguments, OnCanvas, Script, caption, demo_app, heal_on_h, hit_on_press, play};

/// Side of a wall in the world.
const SIDE: f32 = 520.0;

/// Grains of dust for each pattern unit (side of a wall) that cracks grow.
const DUST_PER_LENGTH: f32 = 90.0;

/// Grains for each pattern unit squared of a cell that closes.
const GRAINS_PER_AREA: f32 = 900.0;

/// The most particles in the air; further ones are not made.
const MAX_PARTICLES: usize = 1500;

const GRAVITY: f32 = -520.0;

/// Hits of the scripted run.
const HITS: u32 = 6;

/// A wall, and the colour of its dust.
#[derive(Component)]
struct Wall {
    dust: Handle<ColorMaterial>,
}

#[derive(Component)]
struct Particle {
    velocity: Vec2,
    age: f32,
    life: f32,
}

/// A crackle. The crate plays no sound: a game would, here, by its own means.
#[derive(Message)]
struct Crackle {
    /// Length that cracks have grown, or root of the area that has closed, pattern units.
    loudness: f32,
    /// A closing cell snaps, a growing tip ticks.
    is_snap: bool,
}

/// Grains of dust that are due at each wall, with their fractions.
#[derive(Resource, Default)]
struct Due(HashMap<Entity, f32>);

#[derive(Resource)]
struct Chance(Rng);

#[derive(Resource)]
struct Shapes {
    speck: Handle<Mesh>,
    grain: Handle<Mesh>,
}

#[derive(Component)]
struct Meter {
    loudness: f32,
}

fn main() -> AppExit {
    let mut app = demo_app(
        "bevy_crack: tips and dust",
        &DemoArguments::given("Dust falls from the tips of cracks, grains fly where a cell closes"),
    );
    app.insert_resource(ClearColor(Color::srgb(0.09, 0.1, 0.115)))
        .insert_resource(Chance(Rng::new(1)))
        .init_resource::<Due>()
        .add_message::<Crackle>()
        .add_systems(Startup, setup)
        .add_systems(Update, (raise_dust, fall, listen).chain())
        .add_observer(throw_grains);
    play(app, heal_on_h, play_script)
}

fn setup(
    mut commands: Commands,
    assets: Res<AssetServer>,

    mut meshes: ResMut<Assets<Mesh>>,
    mut colors: ResMut<Assets<ColorMaterial>>,
) {
    commands.spawn(Camera2d);
    // A preset of a file each: change one while this runs, and the next cracks follow it.
    for (x, name, dust) in
        [(-290.0, "plaster", Color::srgb(0.6, 0.57, 0.52)), (290.0, "clay", Color::srgb(0.93, 0.8, 0.64))]
    {
        let picture = assets.load(format!("textures/{name}.png"));
        let preset: Handle<CrackPreset> = assets.load(format!("presets/{name}.crack.ron"));
        commands
            .spawn((
                Wall { dust: colors.add(dust) },
                Sprite { image: picture.clone(), custom_size: Some(Vec2::splat(SIDE)), ..default() },
                Transform::from_xyz(x, 20.0, 0.0),
                CrackSurface::new(preset),
                OnCanvas { picture, size: Vec2::splat(SIDE) },
                Pickable::default(),
            ))
            .observe(hit_on_press);
    }
    commands.spawn(caption("click: hit      H: heal      sound:", Vec2::new(-100.0, -325.0)));
    commands.spawn((
        Meter { loudness: 0.0 },
        Mesh2d(meshes.add(Rectangle::new(1.0, 12.0))),
        MeshMaterial2d(colors.add(Color::srgb(0.5, 0.75, 0.55))),
        Transform::from_xyz(100.0, -325.0, 3.0),
    ));
    commands.insert_resource(Shapes {
        speck: meshes.add(Circle::new(2.6)),
        grain: meshes.add(RegularPolygon::new(4.5, 5)),
    });
}

/// Every frame in which a tip grows raises dust there, in proportion to how far it has come.
fn raise_dust(
    mut commands: Commands,
    walls: Query<(Entity, &Wall, &CrackState), Changed<CrackState>>,
    places: CrackPlaces,
    particles: Query<(), With<Particle>>,
    shapes: Res<Shapes>,
    mut due: ResMut<Due>,
    mut chance: ResMut<Chance>,
    mut crackles: MessageWriter<Crackle>,
) {
    let mut room = MAX_PARTICLES.saturating_sub(particles.iter().len());
    for (entity, wall, state) in &walls {
        let due = due.0.entry(entity).or_default();
        for tip in &state.tips {
            *due += tip.length * DUST_PER_LENGTH;
            if *due < 1.0 || room == 0 {
                *due = due.min(1.0);
                continue;
            }
            *due -= 1.0;
            room -= 1;
            let Some(place) = places.at(entity, tip.uv) else { continue };
            // Out of the crack, a little to the side.
            let aside = Vec2::new(chance.0.signed(), 0.6 * chance.0.unit()) * 30.0;
            commands.spawn((
                Particle { velocity: aside, age: 0.0, life: chance.0.range(0.6, 1.5) },
                Mesh2d(shapes.speck.clone()),
                MeshMaterial2d(wall.dust.clone()),
                Transform::from_translation(place.position + 5.0 * place.normal),
            ));
        }
        let grown: f32 = state.tips.iter().map(|tip| tip.length).sum();
        if grown > 0.0 {
            crackles.write(Crackle { loudness: grown, is_snap: false });
        }
    }
}

/// A cell that closes throws grains from its middle, the more the larger it is.
fn throw_grains(
    closed: On<CellClosed>,
    mut commands: Commands,
    walls: Query<&Wall>,
    places: CrackPlaces,
    particles: Query<(), With<Particle>>,
    shapes: Res<Shapes>,
    mut chance: ResMut<Chance>,
    mut crackles: MessageWriter<Crackle>,
) {
    crackles.write(Crackle { loudness: closed.area.sqrt(), is_snap: true });
    let (Ok(wall), Some(place)) = (walls.get(closed.entity), places.at(closed.entity, closed.uv)) else { return };
    let room = MAX_PARTICLES.saturating_sub(particles.iter().len());
    let count = (2.0 + closed.area * GRAINS_PER_AREA).min(24.0) as usize;
    for _ in 0..count.min(room) {
        let out = Vec2::new(chance.0.signed(), chance.0.signed());
        let place = place.position + (out * closed.area.sqrt() * 0.3 * SIDE).extend(6.0);
        commands.spawn((
            Particle { velocity: out * 90.0 + 70.0 * Vec2::Y, age: 0.0, life: chance.0.range(0.9, 1.6) },
            Mesh2d(shapes.grain.clone()),
            MeshMaterial2d(wall.dust.clone()),
            Transform::from_translation(place).with_scale(Vec3::splat(chance.0.range(0.5, 1.2))),
        ));
    }
}

fn fall(mut commands: Commands, time: Res<Time>, mut particles: Query<(Entity, &mut Particle, &mut Transform)>) {
    let seconds = time.delta_secs();
    for (entity, mut particle, mut transform) in &mut particles {
        particle.age += seconds;
        particle.velocity.y += GRAVITY * seconds;
        transform.translation += (particle.velocity * seconds).extend(0.0);
        if particle.age > 0.7 * particle.life {
            transform.scale *= 1.0 - 2.5 * seconds;
        }
        if particle.age > particle.life {
            commands.entity(entity).despawn();
        }
    }
}

/// Where a game would play its sounds: here a bar shows how loud it is.
fn listen(mut crackles: MessageReader<Crackle>, mut meter: Query<(&mut Meter, &mut Transform)>) {
    for (mut meter, mut bar) in &mut meter {
        meter.loudness *= 0.85;
        for crackle in crackles.read() {
            meter.loudness += crackle.loudness * if crackle.is_snap { 4.0 } else { 1.0 };
        }
        let length = 300.0 * meter.loudness.min(1.0);
        bar.scale.x = length.max(1.0);
        bar.translation.x = 100.0 + length / 2.0;
    }
}

/// The scripted run: each wall is hit a few times.
fn play_script(mut commands: Commands, script: Script, walls: Query<Entity, With<Wall>>) {
    for i in script.due(HITS, 0.0..0.8) {
        // Sorted: a wall that cracks gets components, and a query lists the two in another order.
        let wall = walls.iter().sort::<Entity>().nth(i as usize % 2);
        let at = Vec2::new((0.31 + i as f32 * 0.618).fract(), (0.42 + i as f32 * 0.755).fract()) * 0.7 + 0.15;
        if let Some(wall) = wall {
            commands.trigger(CrackHit::uv(wall, at).with_energy(1.0 + 0.3 * i as f32));
        }
    }
}
