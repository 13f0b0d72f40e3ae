//! A stone pedestal with a clay jar on it, and a ball of plaster beside it, to shoot at: cracks run over the edges of the box and around the
//! curves of the others. At last the ball falls to pieces, as a hollow shell, in crumbs and dust, and time runs backwards.
//!
//! Click to shoot; W writes a word into the jar, by cracks that run over all of it; B breaks the ball; R lets time run backwards, and forwards again; H heals everything. The camera goes around them.
//!
//! Without a display (or with `--headless`) a script plays, and pictures and a GIF are written to `--out`.
//! Try `--frames 120 --out film`.

use bevy::{
    asset::RenderAssetUsages,
    camera::Hdr,
    core_pipeline::tonemapping::Tonemapping,
    light::{CascadeShadowConfigBuilder, NotShadowCaster},
    math::{Affine2, ops},
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use bevy_crack::{
    Grid,
    math::Rng,
    prelude::*,
    shatter::{BreakAgain, BurstParams, ShatterParams, SizeClasses},
    voronoi::{FONT, VoronoiParams, draw_text},
};
use bevy_crack_demos::{DemoArguments, Script, demo_app, heal_on_h, hit_on_press, play, repeated, with_normals};
use std::f32::consts::TAU;

/// Height of the pedestal, metres.
const PEDESTAL: f32 = 1.1;

/// Outline of the jar from its foot to its mouth: radius and height, metres.
const JAR: [Vec2; 12] = [
    Vec2::new(0.0, 0.0),
    Vec2::new(0.2, 0.0),
    Vec2::new(0.23, 0.03),
    Vec2::new(0.2, 0.07),
    Vec2::new(0.36, 0.3),
    Vec2::new(0.45, 0.56),
    Vec2::new(0.43, 0.76),
    Vec2::new(0.3, 0.94),
    Vec2::new(0.17, 1.04),
    Vec2::new(0.17, 1.14),
    Vec2::new(0.25, 1.22),
    Vec2::new(0.22, 1.24),
];

/// Corners around the jar.
const AROUND: u32 = 96;

/// Shots of the scripted run: at which of the three, the direction from its middle, height above that, energy.
const SHOTS: [(usize, f32, f32, f32); 7] = [
    (0, 0.75, 0.42, 4.0),
    (1, 0.6, 0.05, 2.5),
    (2, 0.5, 0.15, 6.0),
    (0, 1.2, -0.05, 3.0),
    (1, -0.3, 0.2, 1.5),
    (2, 1.2, -0.1, 5.0),
    (0, 0.35, -0.3, 1.5),
];

/// Which of the three the jar is.
const JAR_NUMBER: usize = 1;

/// Which of the three the ball is.
const BALL: usize = 2;

#[derive(Component)]
struct Target(usize);

/// What clouds of dust are made of.
#[derive(Resource)]
struct Dust {
    mesh: Handle<Mesh>,
    picture: Handle<Image>,
}

/// A part of a cloud.
#[derive(Component)]
struct Puff {
    velocity: Vec3,
    /// Seconds.
    age: f32,
}

/// How long a cloud of dust hangs in the air, seconds.
const DUST_LASTS: f32 = 1.6;

fn main() -> AppExit {
    let arguments = DemoArguments::given("A pedestal, a jar and a ball whose cracks run all around them");
    let mut app = demo_app("bevy_crack: statue", &arguments);
    app.add_systems(Startup, setup).add_systems(Update, (go_around, let_dust_settle).chain());
    play(app, (heal_on_h, write_on_w, break_on_b, turn_time_on_r), play_script)
}

fn setup(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut images: ResMut<Assets<Image>>,
) {
    commands.insert_resource(Dust { mesh: meshes.add(Rectangle::default()), picture: images.add(soft_disc(32)) });
    commands.spawn((
        Camera3d::default(),
        Camera { clear_color: ClearColorConfig::Custom(Color::srgb(0.46, 0.5, 0.54)), ..default() },
        Hdr,
        // Needs no lookup table.
        Tonemapping::AcesFitted,
        AmbientLight { brightness: 420.0, color: Color::srgb(0.85, 0.9, 1.0), ..default() },
        Transform::default(),
    ));
    commands.spawn((
        DirectionalLight {
            illuminance: 8_500.0,
            color: Color::srgb(1.0, 0.95, 0.86),
            shadow_maps_enabled: true,
            // Crumbs are small.
            shadow_normal_bias: 0.5,
            ..default()
        },
        CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 9.0, ..default() }.build(),
        Transform::from_xyz(2.4, 3.0, 1.8).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    let (picture, normals) = with_normals(&assets, "concrete_fine");
    let stone = materials.add(StandardMaterial {
        base_color_texture: Some(picture),
        normal_map_texture: Some(normals),
        perceptual_roughness: 0.9,
        ..default()
    });
    let plain = |color: Color, roughness: f32| StandardMaterial {
        base_color: color,
        perceptual_roughness: roughness,
        ..default()
    };
    let mut tiled = |name, times: Vec2, tint| {
        materials.add(StandardMaterial {
            base_color_texture: Some(repeated(&assets, name)),
            uv_transform: Affine2::from_scale(times),
            ..plain(tint, 0.95)
        })
    };
    let floor = tiled("paving", Vec2::splat(8.0), Color::srgb(0.9, 0.9, 0.92));
    let wall = tiled("plaster", Vec2::new(6.0, 2.0), Color::srgb(0.62, 0.68, 0.72));
    let clay = materials.add(plain(Color::srgb(0.72, 0.42, 0.28), 0.6));
    let plaster = materials.add(StandardMaterial {
        base_color_texture: Some(assets.load("textures/plaster.png")),
        ..plain(Color::WHITE, 0.95)
    });
    commands.spawn((Mesh3d(meshes.add(Plane3d::new(Vec3::Y, Vec2::splat(8.0)))), MeshMaterial3d(floor)));
    // Behind all of it, whichever way the camera looks.
    for (x, z) in [(-0.35, -1.0), (-1.0, -0.35)] {
        let facing = Vec3::new(-x, 0.0, -z).normalize();
        commands.spawn((
            Mesh3d(meshes.add(Rectangle::new(16.0, 5.0))),
            MeshMaterial3d(wall.clone()),
            Transform::from_translation(Vec3::Y * 2.5 - 2.2 * facing).looking_to(-facing, Vec3::Y),
        ));
    }
    // It has a picture of its own, which is laid out with it.
    let pedestal = CrackSurface::new(CrackPreset::CONCRETE).with_unwrap(CrackUnwrap::Always);
    let jar = CrackSurface::new(CrackPreset::CLAY).with_seed(1);
    let ball = CrackSurface::new(CrackPreset::CLAY.scaled(1.5)).with_seed(2).with_unwrap(CrackUnwrap::Always);
    let turned = Quat::from_rotation_y(0.5);
    let targets = [
        (
            Mesh::from(Cuboid::new(1.0, PEDESTAL, 1.0)),
            stone,
            Transform::from_xyz(-0.3, 0.5 * PEDESTAL, 0.0).with_rotation(turned),
            pedestal,
        ),
        (
            turned_on_a_lathe(&JAR, AROUND),
            clay,
            // The middle of its picture is to the front.
            Transform::from_xyz(-0.3, PEDESTAL, 0.0).with_rotation(Quat::from_rotation_y(2.55)),
            jar,
        ),
        (Sphere::new(0.42).mesh().uv(96, 64), plaster, Transform::from_xyz(0.75, 0.42, -0.35), ball),
    ];
    for (i, (mesh, material, place, surface)) in targets.into_iter().enumerate() {
        let pieces = ShatterCracks {
            thickness: 0.11,
            // No piece is narrower than it is thick.
            cut: ShatterParams { min_area: 0.012, ..ShatterParams::DEFAULT },
            floor: Some(0.0),
            // Fast where it is hit, while the far side only falls.
            burst: BurstParams { speed: 2.6, falloff: 0.16, fade_after: 30.0, ..BurstParams::DEFAULT },
            again: Some(BreakAgain { classes: SizeClasses { largest: [0.25, 0.6, 1.5] }, after: 0.15, apart: 0.1 }),
            ..default()
        };
        // What hits knock out, and crumbs off the edges of the pieces.
        let chips = CrackChips { floor: Some(0.0), crumbs: 60, crumb_size: 0.1, ..default() };
        commands
            .spawn((Target(i), Mesh3d(meshes.add(mesh)), MeshMaterial3d(material), place, surface, pieces, chips))
            .observe(hit_on_press)
            .observe(raise_dust);
    }
}

/// The mesh that an outline makes when it turns around the y axis.
fn turned_on_a_lathe(outline: &[Vec2], around: u32) -> Mesh {
    const BETWEEN: u32 = 5;
    let last = outline.len() - 1;
    // A curve through all points (Catmull and Rom 1974).
    let point = |i: u32| {
        let (at, share) = ((i / BETWEEN) as usize, (i % BETWEEN) as f32 / BETWEEN as f32);
        let [a, b, c, d] = [at.saturating_sub(1), at, at + 1, at + 2].map(|i| outline[i.min(last)]);
        let (linear, square, cube) = (c - a, 2.0 * a - 5.0 * b + 4.0 * c - d, 3.0 * (b - c) + d - a);
        b + 0.5 * share * (linear + share * (square + share * cube))
    };
    let rows = BETWEEN * last as u32 + 1;
    let (mut positions, mut normals, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for row in 0..rows {
        let Vec2 { x: radius, y: height } = point(row).max(Vec2::ZERO);
        // Across the outline, so that the mesh has no seam where it closes.
        let along = point((row + 1).min(rows - 1)) - point(row.saturating_sub(1));
        let out = -along.perp().normalize_or(Vec2::NEG_Y);
        for i in 0..=around {
            let (sin, cos) = ops::sin_cos(TAU * i as f32 / around as f32);
            positions.push([radius * cos, height, -radius * sin]);
            normals.push([out.x * cos, out.y, -out.x * sin]);
            uvs.push([i as f32 / around as f32, 1.0 - row as f32 / (rows - 1) as f32]);
        }
    }
    for (row, i) in (0..rows - 1).flat_map(|row| (0..around).map(move |i| (row, i))) {
        let (a, b) = (row * (around + 1) + i, (row + 1) * (around + 1) + i);
        indices.extend([a, a + 1, b + 1, a, b + 1, b]);
    }
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, uvs)
        .with_inserted_indices(Indices::U32(indices))
}

/// White, and the more transparent the further from the middle.
fn soft_disc(size: u32) -> Image {
    let extent = Extent3d { width: size, height: size, depth_or_array_layers: 1 };
    let texels = (0..size * size).flat_map(|i| {
        let at = (Vec2::new((i % size) as f32, (i / size) as f32) + 0.5) / (0.5 * size as f32) - 1.0;
        let there = (1.0 - at.length_squared()).max(0.0);
        [255, 255, 255, (255.0 * there * there) as u8]
    });
    let (format, usage) = (TextureFormat::Rgba8UnormSrgb, RenderAssetUsages::RENDER_WORLD);
    Image::new(extent, TextureDimension::D2, texels.collect(), format, usage)
}

/// What a game can hang on pieces that leave: a cloud of dust where they were.
fn raise_dust(
    shattered: On<Shattered>,
    shards: Query<&Transform, With<Shard>>,
    surfaces: Query<&GlobalTransform>,
    dust: Res<Dust>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut commands: Commands,
) {
    let Ok(surface) = surfaces.get(shattered.entity) else { return };
    let material = materials.add(StandardMaterial {
        base_color_texture: Some(dust.picture.clone()),
        alpha_mode: AlphaMode::Blend,
        unlit: true,
        ..default()
    });
    let mut chance = Rng::new(1);
    for shard in shattered.shards.iter().filter_map(|shard| shards.get(*shard).ok()).take(30) {
        for _ in 0..4 {
            let mut any = || Vec3::new(chance.signed(), chance.signed(), chance.signed());
            let at = surface.transform_point(shard.translation) + 0.12 * any();
            let velocity = 0.3 * any() + 0.5 * (at - surface.translation()).normalize_or_zero();
            let look = (Mesh3d(dust.mesh.clone()), MeshMaterial3d(material.clone()), NotShadowCaster);
            commands.spawn((Puff { velocity, age: 0.0 }, look, Transform::from_translation(at)));
        }
    }
}

/// Dust spreads, slows down and thins out.
fn let_dust_settle(
    time: Res<Time>,
    camera: Single<&Transform, With<Camera3d>>,
    mut puffs: Query<(Entity, &mut Puff, &mut Transform, &MeshMaterial3d<StandardMaterial>), Without<Camera3d>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut commands: Commands,
) {
    for (entity, mut puff, mut place, material) in &mut puffs {
        puff.age += time.delta_secs();
        let (share, velocity) = (puff.age / DUST_LASTS, puff.velocity * ops::exp(-3.0 * puff.age));
        if share >= 1.0 {
            commands.entity(entity).despawn();
            continue;
        }
        let size = 0.12 + 0.45 * ops::sqrt(share);
        place.translation += velocity * time.delta_secs();
        // The floor does not cut it.
        place.translation.y = place.translation.y.max(0.45 * size);
        (place.rotation, place.scale) = (camera.rotation, Vec3::splat(size));
        if let Some(mut material) = materials.get_mut(&material.0) {
            // It is not there before the pieces move.
            let there = (5.0 * share - 0.7).clamp(0.0, 1.0) * (1.0 - share);
            material.base_color = Color::srgba(0.78, 0.75, 0.7, 0.2 * there);
        }
    }
}

fn go_around(time: Res<Time>, mut camera: Query<&mut Transform, With<Camera3d>>) {
    for mut transform in &mut camera {
        let angle = 0.75 + 0.4 * ops::sin(0.5 * time.elapsed_secs());
        let eye = Vec3::new(3.6 * ops::sin(angle), 2.1, 3.6 * ops::cos(angle));
        *transform = Transform::from_translation(eye).looking_at(Vec3::new(0.12, 1.13, 0.0), Vec3::Y);
    }
}

/// Where the word stands in the jar's picture, texture coordinates.
const WORD: Rect = Rect { min: Vec2::new(0.37, 0.38), max: Vec2::new(0.63, 0.6) };

/// Cracks all over the jar that draw a word on its front.
fn guided() -> GuidedCracks {
    const PICTURE: UVec2 = UVec2::new(1024, 512);
    let mut drawing = Grid::new(PICTURE, 0.0);
    let size = (WORD.size() * PICTURE.as_vec2()).as_uvec2();
    if let Some(word) = draw_text(FONT, "FRAGILE", size, f32::INFINITY) {
        let corner = (WORD.min * PICTURE.as_vec2()).as_usizevec2();
        for y in 0..word.height() {
            drawing.row_mut(corner.y + y)[corner.x..][..word.width()].copy_from_slice(word.row(y));
        }
    }
    let guided = GuidedCracks::new(CrackGuide::new(drawing));
    let params = VoronoiParams { sites: 260, ..guided.params.clone() };
    let from = WORD.min.with_y(WORD.center().y);
    GuidedCracks { params, ..guided }.with_appearance(GuidedAppearance::Front { from, seconds: 1.5 })
}

fn write_on_w(
    mut commands: Commands,
    keys: Res<ButtonInput<KeyCode>>,
    targets: Query<(Entity, &Target, &GlobalTransform)>,
) {
    if keys.just_pressed(KeyCode::KeyW) {
        write_on_jar(&mut commands, &targets);
    }
}

fn write_on_jar(commands: &mut Commands, targets: &Query<(Entity, &Target, &GlobalTransform)>) {
    for (entity, ..) in targets.iter().filter(|(_, target, _)| target.0 == JAR_NUMBER) {
        commands.entity(entity).insert(guided());
    }
}

/// Takes the ball apart.
fn break_ball(commands: &mut Commands, targets: &Query<(Entity, &Target, &GlobalTransform)>) {
    for (entity, ..) in targets.iter().filter(|(_, target, _)| target.0 == BALL) {
        commands.entity(entity).shatter_cracks(ShatterRequest::EVERYTHING.with_energy(2.5));
    }
}

fn break_on_b(
    mut commands: Commands,
    keys: Res<ButtonInput<KeyCode>>,
    targets: Query<(Entity, &Target, &GlobalTransform)>,
) {
    if keys.just_pressed(KeyCode::KeyB) {
        break_ball(&mut commands, &targets);
    }
}

/// How fast pieces fly back to where they were.
const BACKWARDS: f32 = -1.5;

fn turn_time_on_r(keys: Res<ButtonInput<KeyCode>>, mut pieces: Query<&mut ShatterCracks>) {
    if keys.just_pressed(KeyCode::KeyR) {
        for mut pieces in &mut pieces {
            pieces.speed = if pieces.speed > 0.0 { BACKWARDS } else { 1.0 };
        }
    }
}

/// The scripted run: shots at all of them in turn; then the ball breaks, and is whole again.
fn play_script(
    mut commands: Commands,
    script: Script,
    targets: Query<(Entity, &Target, &GlobalTransform)>,
    mut pieces: Query<&mut ShatterCracks>,
) {
    if script.is_at(0.02) {
        write_on_jar(&mut commands, &targets);
    }
    if script.is_at(0.55) {
        break_ball(&mut commands, &targets);
    }
    if script.is_at(0.85) {
        pieces.iter_mut().for_each(|mut pieces| pieces.speed = BACKWARDS);
    }
    for i in script.due(SHOTS.len() as u32, 0.05..0.5) {
        let (which, angle, height, energy) = SHOTS[i as usize];
        let Some((entity, _, at)) = targets.iter().find(|(_, target, _)| target.0 == which) else { continue };
        let middle = at.translation() + Vec3::Y * (height + if which == 1 { 0.6 } else { 0.0 });
        // On the box, which is turned: its face is 0.5 away from the middle.
        let out = Vec3::new(ops::sin(angle), 0.0, ops::cos(angle));
        let away = match which {
            0 => {
                let own = at.rotation().inverse() * out;
                0.5 / own.x.abs().max(own.z.abs())
            }
            1 => 0.44,
            _ => 0.42,
        };
        commands.trigger(CrackHit::world(entity, middle + away * out).with_energy(energy));
    }
}
