//! The playground: a pane of glass, a wall of any material and a wall in 3D, with the workbench. Made for a page in a browser
//! (`examples/playground/build` makes it); `cargo run --bin playground` opens it in a window.
//!
//! Click to hit, drag to aim. Small pictures give the wall another material. Space bursts the pane and brings it back, G writes a
//! word into the wall, H heals everything, F1 hides the panel.

mod page;
mod place;
mod wall;

use bevy::{
    asset::{AssetMetaCheck, AssetPlugin, LoadState},
    core_pipeline::tonemapping::Tonemapping,
    image::ImageLoaderSettings,
    light::GlobalAmbientLight,
    prelude::*,
};
use bevy_crack::{
    editor::{CrackEditor, CrackEditorPlugin, PrimaryEguiContext},
    prelude::*,
    shatter::{Anchor, BurstParams, ShatterParams},
};
use place::{PANE, View3d, WALL_3D};

fn main() -> AppExit {
    let folder = if page::IS_BROWSER { "assets" } else { concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets") };
    let window = Window {
        title: "bevy_crack: playground".into(),
        resolution: page::size().unwrap_or(UVec2::new(1280, 720)).into(),
        canvas: Some("#view".into()),
        fit_canvas_to_parent: true,
        ..default()
    };
    App::new()
        .add_plugins(
            DefaultPlugins
                .set(WindowPlugin { primary_window: Some(window), ..default() })
                // A browser would ask for each file twice.
                .set(AssetPlugin { file_path: folder.into(), meta_check: AssetMetaCheck::Never, ..default() }),
        )
        .add_plugins((CrackPlugins, CrackEditorPlugin::default()))
        .insert_resource(ClearColor(Color::srgb(0.1, 0.112, 0.128)))
        .insert_resource(GlobalAmbientLight { brightness: 260.0, ..default() })
        .init_resource::<Baked>()
        .add_systems(Startup, (setup, wall::setup, prepare).chain())
        .add_systems(PreUpdate, place::fit)
        .add_systems(Update, (wall::move_lamp, press_keys))
        .add_systems(Last, report)
        .add_observer(wall::choose)
        .add_observer(mend)
        .add_observer(|_: On<CrackBaked>, mut baked: ResMut<Baked>| baked.0 += 1)
        .run()
}

#[derive(Component)]
struct Pane;

/// How many bakes have ended well.
#[derive(Resource, Default)]
struct Baked(u32);

/// A picture, and the normal map that goes with it.
fn with_normals(assets: &AssetServer, name: &str) -> [Handle<Image>; 2] {
    let normals = assets
        .load_builder()
        .with_settings(|settings: &mut ImageLoaderSettings| settings.is_srgb = false)
        .load(format!("textures/{name}_normal.png"));
    [assets.load(format!("textures/{name}.png")), normals]
}

fn setup(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    // Nothing here has edges that need smoothing.
    commands.spawn((Camera2d, Msaa::Off, PrimaryEguiContext));
    // The pane stands before bricks, so that one sees it is glass.
    let [bricks, normals] = with_normals(&assets, "brick_red");
    commands.spawn((
        Sprite {
            image: bricks.clone(),
            custom_size: Some(PANE.size()),
            color: Color::srgb(0.42, 0.43, 0.46),
            ..default()
        },
        Transform::from_translation(PANE.center().extend(-1.0)),
    ));
    commands.spawn((
        Pane,
        Name::new("Pane"),
        Sprite { image: assets.load("textures/glass_pane.png"), custom_size: Some(PANE.size() - 20.0), ..default() },
        Transform::from_translation(PANE.center().extend(1.0)),
        CrackSurface::new(CrackPreset::GLASS).with_seed(5),
        ShatterCracks {
            cut: ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT },
            anchor: Anchor::Nothing,
            burst: BurstParams { hold: 0.1, speed: 1.4, gravity: Vec2::new(0.0, -1.6), ..BurstParams::DEFAULT },
            ..default()
        },
    ));
    commands.spawn((
        View3d,
        Camera3d::default(),
        Msaa::Off,
        Camera { order: 1, clear_color: Color::srgb(0.07, 0.078, 0.09).into(), ..default() },
        Tonemapping::AcesFitted,
        Transform::from_xyz(0.5, 0.12, 1.35).looking_at(Vec3::new(0.0, -0.02, 0.0), Vec3::Y),
    ));
    let material = StandardMaterial {
        base_color_texture: Some(bricks),
        normal_map_texture: Some(normals),
        perceptual_roughness: 0.9,
        ..default()
    };
    commands.spawn((
        Name::new("Wall in 3D"),
        Mesh3d(meshes.add(Rectangle::new(2.0 * WALL_3D.width() / WALL_3D.height(), 2.0))),
        MeshMaterial3d(materials.add(material)),
        CrackSurface::new(CrackPreset::BRICK).with_seed(2),
    ));
    commands.spawn((
        PointLight { intensity: 190_000.0, range: 12.0, color: Color::srgb(1.0, 0.92, 0.8), ..default() },
        Transform::from_xyz(-1.5, 0.9, 0.9),
    ));
}

/// First hits find everything ready.
fn prepare(
    mut commands: Commands,
    surfaces: Query<Entity, With<CrackSurface>>,
    pane: Single<Entity, With<Pane>>,
    mut editor: ResMut<CrackEditor>,
) {
    editor.chosen = Some(*pane);
    for surface in &surfaces {
        commands.entity(surface).prepare_cracks();
    }
}

fn press_keys(
    keys: Res<ButtonInput<KeyCode>>,
    mut commands: Commands,
    surfaces: Query<Entity, With<CrackSurface>>,
    wall: Single<Entity, With<wall::Wall>>,
    pane: Single<(Entity, &mut ShatterCracks, Has<CrackShards>), With<Pane>>,
) {
    if keys.just_pressed(KeyCode::KeyH) {
        for surface in &surfaces {
            commands.entity(surface).heal_cracks();
        }
    }
    if keys.just_pressed(KeyCode::KeyG) {
        let front = GuidedAppearance::Front { from: Vec2::new(0.0, 0.5), seconds: 2.0 };
        commands.entity(*wall).insert(GuidedCracks::new(CrackGuide::text("CRACK")).with_appearance(front));
    }
    if keys.just_pressed(KeyCode::Space) {
        let (entity, mut shatter, is_broken) = pane.into_inner();
        if is_broken {
            // Time turns around.
            shatter.speed = if shatter.speed < 0.0 { 1.0 } else { -1.5 };
        } else {
            shatter.speed = 1.0;
            commands.entity(entity).shatter_cracks(ShatterRequest::ALL);
        }
    }
}

/// Whole again: now the cracks close as well.
fn mend(whole: On<Reassembled>, mut commands: Commands, mut panes: Query<&mut ShatterCracks>) {
    commands.entity(whole.entity).close_cracks(1.0);
    if let Ok(mut pane) = panes.get_mut(whole.entity) {
        pane.speed = 1.0;
    }
}

/// Tells the page how far the app is: whether all pictures are there, whether all surfaces are prepared, and what has happened.
fn report(
    baked: Res<Baked>,
    assets: Res<AssetServer>,
    images: Res<Assets<Image>>,
    sprites: Query<&Sprite>,
    surfaces: Query<(&CrackState, Has<CrackTextures>)>,
    bakes: Query<&BakeProgress>,
    mut told: Local<Told>,
) {
    told.frames += 1;
    if !told.is_ready && sprites.iter().all(|sprite| images.contains(&sprite.image)) {
        told.is_ready = true;
        page::tell("ready", 1);
    }
    let has_failed = |sprite: &Sprite| matches!(assets.load_state(&sprite.image), LoadState::Failed(_));
    if !told.is_ready && sprites.iter().any(has_failed) {
        page::tell("failed", 1);
    }
    told.slices += u32::from(bakes.iter().any(|progress| progress.0 > 0.0 && progress.0 < 1.0));
    page::tell("prepared", surfaces.iter().filter(|(_, has_textures)| *has_textures).count() as u32);
    page::tell("hits", surfaces.iter().map(|(state, _)| state.hits).sum());
    page::tell("frames", told.frames);
    page::tell("slices", told.slices);
    page::tell("baked", baked.0);
}

/// What the page was told last.
#[derive(Default)]
struct Told {
    is_ready: bool,
    frames: u32,
    /// Frames in which a bake was under way.
    slices: u32,
}
