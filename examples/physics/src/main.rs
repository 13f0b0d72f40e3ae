//! Shards as bodies of a physics engine: a pane is hit, bursts, and comes to rest on a floor.
//!
//! `cargo run --manifest-path examples/physics/Cargo.toml -- rest.png`: no window; the picture shows the end. The engine is
//! `avian2d`; any other takes the same from [`Shard`]: convex pieces for colliders, velocity and spin from the blow.

use avian2d::prelude::*;
use bevy::{
    asset::RenderAssetUsages,
    image::TextureAtlasLayout,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
    time::TimeUpdateStrategy,
};
use bevy_crack::{
    prelude::*,
    shatter::{Anchor, BurstParams, MeshFrame, ShatterParams},
};
use image::{Rgba, RgbaImage};
use std::{error::Error, path::PathBuf, time::Duration};

/// Size of the drawn part of the world, world units, which are texels as well.
const SIZE: UVec2 = UVec2::new(900, 600);

/// Upper side of the floor.
const FLOOR: f32 = -260.0;

/// How far colliders may stray from the rough outline, pattern units: far fewer pieces.
const TOLERANCE: f32 = 0.004;

/// Steps of 1/60 s after which all must have come to rest, and what counts as rest: world units a second.
const STEPS: u32 = 1200;
const REST: f32 = 4.0;

fn main() -> Result<(), Box<dyn Error>> {
    let out = std::env::args().nth(1).map_or_else(|| PathBuf::from("rest.png"), PathBuf::from);
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default(), ImagePlugin::default(), CrackPlugins))
        .add_plugins(PhysicsPlugins::default().with_length_unit(100.0))
        .init_asset::<Mesh>()
        .init_asset::<ColorMaterial>()
        .init_asset::<TextureAtlasLayout>()
        .insert_resource(Gravity(Vec2::NEG_Y * 900.0))
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs(1) / 60))
        .add_observer(embody)
        .add_systems(Startup, setup);
    app.finish();
    app.cleanup();
    let mut surfaces = app.world_mut().query_filtered::<Entity, With<CrackSurface>>();
    app.update();
    let pane = surfaces.single(app.world())?;
    for at in [Vec2::new(0.4, 0.45), Vec2::new(0.7, 0.6), Vec2::new(0.25, 0.75)] {
        app.world_mut().trigger(CrackHit::uv(pane, at).with_energy(2.0).with_direction(Vec3::X));
    }
    app.update();
    let done = |app: &App| app.world().get::<CrackState>(pane).is_none_or(|state| state.status == CrackStatus::Done);
    while !done(&app) {
        app.update();
    }
    app.world_mut().commands().entity(pane).shatter_cracks(ShatterRequest::ALL);
    let mut bodies = app.world_mut().query_filtered::<(&GlobalTransform, &LinearVelocity), With<Shard>>();
    for step in 0..STEPS {
        app.update();
        let moving = bodies.iter(app.world()).filter(|(_, velocity)| velocity.length() > REST).count();
        if step > 60 && moving == 0 {
            let seconds = f64::from(step) / 60.0;
            println!("{} shards came to rest after {seconds:.1} s", bodies.iter(app.world()).count());
            let fallen = bodies.iter(app.world()).filter(|(at, _)| at.translation().y < FLOOR).count();
            if fallen > 0 {
                return Err(format!("{fallen} shards fell through the floor").into());
            }
            draw(app.world_mut()).save(&out)?;
            println!("{}", out.display());
            return Ok(());
        }
    }
    draw(app.world_mut()).save(&out)?;
    Err("the shards do not come to rest".into())
}

fn setup(mut commands: Commands, mut images: ResMut<Assets<Image>>) -> Result {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/textures/glass_pane.png");
    let picture = image::open(file)?.to_rgba8();
    let size = Extent3d { width: picture.width(), height: picture.height(), depth_or_array_layers: 1 };
    let format = TextureFormat::Rgba8UnormSrgb;
    let picture = Image::new(size, TextureDimension::D2, picture.into_raw(), format, RenderAssetUsages::default());
    commands.spawn((
        Sprite { image: images.add(picture), custom_size: Some(Vec2::splat(320.0)), ..default() },
        Transform::from_xyz(0.0, 40.0, 0.0),
        CrackSurface::new(CrackPreset::GLASS).with_seed(5),
        ShatterCracks {
            // The physics engine moves them.
            fly: false,
            anchor: Anchor::Nothing,
            cut: ShatterParams { extend_cracks: true, min_area: 1e-4, ..ShatterParams::DEFAULT },
            burst: BurstParams { tumble: false, ..BurstParams::DEFAULT },
            ..default()
        },
    ));
    let wall = |at: Vec2, size: Vec2| {
        (RigidBody::Static, Collider::rectangle(size.x, size.y), Transform::from_translation(at.extend(0.0)))
    };
    commands.spawn(wall(Vec2::new(0.0, FLOOR - 20.0), Vec2::new(900.0, 40.0)));
    for side in [-1.0, 1.0] {
        commands.spawn(wall(Vec2::new(side * 440.0, 0.0), Vec2::new(20.0, 1200.0)));
    }
    Ok(())
}

/// Every shard that leaves becomes a body.
fn embody(shattered: On<Shattered>, mut commands: Commands, shards: Query<&Shard>) {
    for entity in &shattered.shards {
        let Ok(shard) = shards.get(*entity) else { continue };
        let pieces = shard.convex_pieces(TOLERANCE);
        let hulls = pieces.into_iter().filter_map(|corners| Some((Vec2::ZERO, 0.0, Collider::convex_hull(corners)?)));
        let hulls: Vec<_> = hulls.collect();
        if hulls.is_empty() {
            commands.entity(*entity).despawn();
            continue;
        }
        commands.entity(*entity).insert((
            RigidBody::Dynamic,
            Collider::compound(hulls),
            LinearVelocity(shard.velocity.truncate()),
            AngularVelocity(shard.spin.z),
            Friction::new(0.6),
            Restitution::new(0.15),
            AngularDamping(0.6),
            LinearDamping(0.05),
        ));
    }
}

/// The shards as they lie, on the floor.
fn draw(world: &mut World) -> RgbaImage {
    let mut canvas = RgbaImage::from_fn(SIZE.x, SIZE.y, |_, y| {
        let y = SIZE.y as f32 / 2.0 - y as f32;
        if y < FLOOR { Rgba([70, 66, 62, 255]) } else { Rgba([30, 33, 38, 255]) }
    });
    let mut shards = world.query::<(&Shard, &GlobalTransform, &MeshMaterial2d<ColorMaterial>)>();
    let (materials, images) = (world.resource::<Assets<ColorMaterial>>(), world.resource::<Assets<Image>>());
    for (shard, at, material) in shards.iter(world) {
        let texture = materials.get(&material.0).and_then(|material| images.get(material.texture.as_ref()?));
        let Some(picture) = texture.and_then(|image| image.clone().try_into_dynamic().ok()) else { continue };
        let picture = picture.to_rgba8();
        let mesh = shard.pieces.flat_mesh(shard.number, &MeshFrame::new(shard.scale * shard.pieces.extent()));
        for corners in mesh.indices.as_chunks::<3>().0 {
            let places = corners.map(|i| {
                let place = at.transform_point(mesh.positions[i as usize].into()).truncate();
                Vec2::new(place.x, -place.y) + 0.5 * SIZE.as_vec2()
            });
            let uvs = corners.map(|i| Vec2::from(mesh.uvs[i as usize]));
            fill(&mut canvas, places, |weights| {
                let uv = uvs[0] * weights.x + uvs[1] * weights.y + uvs[2] * weights.z;
                let texel = (uv * Vec2::new(picture.width() as f32, picture.height() as f32)).as_uvec2();
                *picture.get_pixel(texel.x.min(picture.width() - 1), texel.y.min(picture.height() - 1))
            });
        }
    }
    canvas
}

/// Blends a triangle into a picture.
fn fill(canvas: &mut RgbaImage, [a, b, c]: [Vec2; 3], color: impl Fn(Vec3) -> Rgba<u8>) {
    let area = (b - a).perp_dot(c - a);
    let low = a.min(b).min(c).max(Vec2::ZERO).as_uvec2();
    let high = a.max(b).max(c).ceil().max(Vec2::ZERO).as_uvec2().min(SIZE);
    for y in low.y..high.y {
        for x in low.x..high.x {
            let at = UVec2::new(x, y).as_vec2() + 0.5;
            let weights =
                Vec3::new((b - at).perp_dot(c - at), (c - at).perp_dot(a - at), (a - at).perp_dot(b - at)) / area;
            if weights.min_element() >= 0.0 {
                let (over, under) = (color(weights).0, canvas.get_pixel_mut(x, y));
                let alpha = f32::from(over[3]) / 255.0;
                for (under, over) in under.0.iter_mut().zip(over).take(3) {
                    *under = (f32::from(over) * alpha + f32::from(*under) * (1.0 - alpha)) as u8;
                }
            }
        }
    }
}
