//! Random operations in a real app, against a model of what must be there.
//!
//! A game is a list of operations, each with all it needs, in rounds. A round is played in frames; after each frame the world is held
//! against [`Model`]; at the end of the round everything is despawned, and nothing may be left. When a round fails, operations are taken
//! out of it for as long as it still fails, and what is left is printed: a test to copy.
//!
//! `CRACK_RANDOM_FRAMES` (default 2,000) and `CRACK_RANDOM_SEED` (default 1) play longer and other games:
//! `CRACK_RANDOM_FRAMES=60000 cargo test --test it random`. From 20,000 frames on, the bytes in use are measured as well.

use crate::{MEMORY, support::*};
use bevy::{
    asset::RenderAssetUsages,
    camera::RenderTarget,
    ecs::system::RunSystemOnce,
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
    render::render_resource::TextureFormat,
    time::TimeUpdateStrategy,
};
use bevy_crack::{
    Grid,
    math::Rng,
    prelude::*,
    shatter::{Anchor, BreakAgain, ShatterParams},
};
use std::{
    collections::BTreeMap,
    panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook},
    sync::atomic::{AtomicUsize, Ordering},
    time::{Duration, Instant},
};

/// Surfaces at once.
const SLOTS: u8 = 24;

/// Frames of a round.
const ROUND: usize = 250;

/// From so many frames on memory is measured.
const MEASURED: usize = 20_000;

/// What a surface is drawn as.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Carrier {
    Sprite,
    Resized([f32; 2]),
    Part([f32; 4]),
    Frame(usize),
    Tiled,
    Mesh2d,
    Wall,
    /// A box or a curved mesh, which is laid out.
    Body(u8),
    /// Of what a mesh may be that cannot crack or that the engine would stumble over.
    BrokenMesh(u8),
}

impl Carrier {
    /// Whether a hit must crack it if its picture is good.
    fn is_sound(self) -> bool {
        match self {
            Self::Sprite | Self::Mesh2d | Self::Wall => true,
            Self::Resized(size) => size.iter().all(|side| (1.0..=500.0).contains(side)),
            Self::Part(_) | Self::Frame(_) | Self::Tiled | Self::Body(_) | Self::BrokenMesh(_) => false,
        }
    }
}

/// What it shows.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Show {
    Good([u16; 2]),
    Empty,
    NoData,
    Short,
    Compressed,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Op {
    Spawn {
        slot: u8,
        carrier: Carrier,
        show: Show,
        preset: u8,
        seed: u8,
        anchored: bool,
    },
    Despawn(u8),
    RemoveSurface(u8),
    InsertSurface {
        slot: u8,
        preset: u8,
        seed: u8,
    },
    Clone {
        from: u8,
        to: u8,
    },
    Hit {
        slot: u8,
        uv: [f32; 2],
        energy: f32,
    },
    HitWorld {
        slot: u8,
        at: [f32; 3],
        energy: f32,
    },
    Heal(u8),
    Close {
        slot: u8,
        seconds: f32,
    },
    Prepare(u8),
    Preset {
        slot: u8,
        preset: u8,
        scale: f32,
    },
    Picture {
        slot: u8,
        size: [u16; 2],
    },
    Change(u8),
    Transform {
        slot: u8,
        scale: [f32; 3],
        turn: f32,
    },
    Parent {
        slot: u8,
        parent: Option<u8>,
    },
    Clock {
        slot: u8,
        clock: Option<CrackClock>,
    },
    Guide {
        slot: u8,
        side: u8,
        gamma: f32,
        appearance: u8,
        seconds: f32,
    },
    Unguide(u8),
    /// What has happened to one surface happens to another.
    Restore {
        from: u8,
        to: u8,
        is_healed: bool,
    },
    Shatter {
        slot: u8,
        uv: Option<[f32; 2]>,
        reach: f32,
    },
    Settings {
        slot: u8,
        when: u8,
        speed: f32,
        again: bool,
        fly: bool,
        seek: Option<f32>,
    },
    Chips {
        slot: u8,
        count: Option<u32>,
    },
    CrackShard(u8),
    DespawnShard(u8),
    Budget {
        milliseconds: f32,
        max_shards: usize,
    },
    Speed(f32),
    Frame(u16),
    Resize {
        target: u8,
        size: [u16; 2],
    },
}

/// What must be true of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Expect {
    /// It shows what the game gave it, and has no textures.
    Whole,
    /// It has textures of its own, or will have them soon.
    Cracked,
    /// It shows what the game gave it, or will soon: it cannot crack.
    Failed,
    /// The crate may do what it thinks best, without a panic.
    Anything,
}

/// What a surface shows when it is whole.
#[derive(Clone, Debug, PartialEq)]
enum Shown {
    Image(Handle<Image>),
    Color(Handle<ColorMaterial>),
    Standard(Handle<StandardMaterial>),
}

struct Known {
    entity: Entity,
    carrier: Carrier,
    is_good: bool,
    is_surface: bool,
    /// Whether it has cracks to be baked, and whether it was hit in this frame: both wait for it to be a surface.
    has_guide: bool,
    is_struck: bool,
    shown: Shown,
    expect: Expect,
}

impl Known {
    fn is_sound(&self) -> bool {
        self.is_good && self.carrier.is_sound() && self.is_surface
    }

    /// What follows a hit that is in order.
    fn struck(&mut self) {
        self.expect = match self.expect {
            _ if !self.is_surface => self.expect,
            Expect::Whole | Expect::Failed if self.is_sound() => Expect::Cracked,
            Expect::Whole if !self.is_good && self.carrier.is_sound() => Expect::Failed,
            Expect::Whole => Expect::Anything,
            other => other,
        };
    }
}

/// What must be there.
#[derive(Default)]
struct Model {
    slots: BTreeMap<u8, Known>,
    /// Hits sent since the app began.
    sent: u64,
}

struct Game {
    app: App,
    model: Model,
    parents: Vec<Entity>,
    targets: Vec<Handle<Image>>,
    windows: Vec<Entity>,
    max_shards: usize,
    /// Entities, images, meshes and materials without surfaces.
    empty: [usize; 5],
}

/// Panics of all threads.
static PANICS: AtomicUsize = AtomicUsize::new(0);

fn stock(app: &App) -> [usize; 5] {
    let world = app.world();
    [
        world.entities().count_spawned() as usize,
        world.resource::<Assets<Image>>().len(),
        world.resource::<Assets<Mesh>>().len(),
        world.resource::<Assets<ColorMaterial>>().len(),
        world.resource::<Assets<StandardMaterial>>().len(),
    ]
}

fn preset(number: u8, scale: f32) -> CrackPreset {
    let name = CrackPreset::NAMES[usize::from(number) % CrackPreset::NAMES.len()];
    let preset = CrackPreset::named(name).expect("a preset");
    CrackPreset { steps_per_second: 600.0, ..if scale == 1.0 { preset } else { preset.scaled(scale) } }
}

fn surface_of(number: u8, seed: u8) -> CrackSurface {
    CrackSurface::new(preset(number, 1.0)).with_seed(seed.into())
}

fn show(show: Show) -> Image {
    let size = |[x, y]: [u16; 2]| UVec2::new(x.into(), y.into());
    let mut image = match show {
        Show::Good(sides) => picture(size(sides)),
        Show::Compressed => picture_of(UVec2::splat(32), TextureFormat::Bc1RgbaUnorm),
        Show::NoData | Show::Short => picture(UVec2::splat(32)),
        Show::Empty => picture(UVec2::ZERO),
    };
    match show {
        Show::NoData => image.data = None,
        Show::Short => image.data = Some(vec![9; 100]),
        _ => {}
    }
    image
}

fn broken_mesh(kind: u8) -> Mesh {
    let mut mesh = Mesh::from(Rectangle::new(30.0, 20.0));
    match kind % 5 {
        0 => mesh.insert_indices(Indices::U32(vec![0, 1, 2, 7, 8, 900])),
        1 => mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, vec![[f32::NAN, 0.0, 0.0]; 4]),
        2 => mesh.insert_attribute(Mesh::ATTRIBUTE_UV_0, vec![[0.5f32, 0.5]; 4]),
        3 => mesh = Mesh::new(PrimitiveTopology::LineStrip, RenderAssetUsages::default()),
        _ => mesh = Mesh::from(Sphere::new(10.0)),
    }
    mesh
}

fn body(kind: u8) -> Mesh {
    match kind % 4 {
        0 => Mesh::from(Cuboid::new(3.0, 2.0, 2.5)),
        1 => Mesh::from(Sphere::new(1.5)),
        2 => Mesh::from(Cylinder::new(1.0, 3.0)),
        _ => Mesh::from(Torus::new(0.6, 1.5)),
    }
}

impl Game {
    fn new(mut app: App, is_drawn: bool) -> Self {
        let parents =
            [(); 3].map(|()| app.world_mut().spawn((Transform::default(), Visibility::default())).id()).into();
        let mut game = Self {
            app,
            model: Model::default(),
            parents,
            targets: Vec::new(),
            windows: Vec::new(),
            max_shards: CrackBudget::default().max_shards,
            empty: [0; 5],
        };
        if is_drawn {
            game.targets.push(spawn_camera(&mut game.app, UVec2::new(96, 64)));
            for _ in 0..2 {
                let window = Window { resolution: (64, 64).into(), visible: false, ..default() };
                let window = game.app.world_mut().spawn(window).id();
                let target = RenderTarget::Window(bevy::window::WindowRef::Entity(window));
                game.app.world_mut().spawn((Camera3d::default(), Msaa::Off, target));
                game.windows.push(window);
            }
        }
        step(&mut game.app);
        game.model.sent = counts(&game.app).sent;
        game.empty = stock(&game.app);
        game
    }

    fn spawn(&mut self, slot: u8, carrier: Carrier, shows: Show) -> Known {
        // The engine itself ends over pictures that it cannot upload.
        let is_drawn = !self.targets.is_empty();
        let shows = if is_drawn && !matches!(shows, Show::Good(_)) { Show::NoData } else { shows };
        let image = add(&mut self.app, show(shows));
        let at = Transform::from_xyz(f32::from(slot) * 3.0 - 36.0, 0.0, 0.0);
        let sprite = Sprite::from_image(image.clone());
        let world = self.app.world_mut();
        let mut shown = Shown::Image(image.clone());
        let entity = match carrier {
            Carrier::Sprite => world.spawn((sprite, at)).id(),
            Carrier::Resized(size) => world.spawn((Sprite { custom_size: Some(size.into()), ..sprite }, at)).id(),
            Carrier::Part([x0, y0, x1, y1]) => {
                let rect = Some(Rect { min: Vec2::new(x0, y0), max: Vec2::new(x1, y1) });
                world.spawn((Sprite { rect, ..sprite }, at)).id()
            }
            Carrier::Frame(index) => {
                let layout = TextureAtlasLayout::from_grid(UVec2::splat(12), 3, 3, None, None);
                let layout = world.resource_mut::<Assets<TextureAtlasLayout>>().add(layout);
                let texture_atlas = Some(TextureAtlas { layout, index });
                world.spawn((Sprite { texture_atlas, ..sprite }, at)).id()
            }
            Carrier::Tiled => {
                let image_mode = SpriteImageMode::Tiled { tile_x: true, tile_y: true, stretch_value: 1.0 };
                world.spawn((Sprite { image_mode, custom_size: Some(Vec2::splat(70.0)), ..sprite }, at)).id()
            }
            Carrier::Mesh2d | Carrier::BrokenMesh(_) => {
                let mesh = match carrier {
                    Carrier::BrokenMesh(kind) => broken_mesh(kind),
                    _ => Mesh::from(Rectangle::new(30.0, 20.0)),
                };
                let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
                let material = ColorMaterial { texture: Some(image), ..default() };
                let material = world.resource_mut::<Assets<ColorMaterial>>().add(material);
                shown = Shown::Color(material.clone());
                world.spawn((Mesh2d(mesh), MeshMaterial2d(material), at)).id()
            }
            Carrier::Wall | Carrier::Body(_) => {
                let mesh = match carrier {
                    Carrier::Body(kind) => body(kind),
                    _ => Mesh::from(Rectangle::new(3.0, 2.0)),
                };
                let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
                let material = StandardMaterial { base_color_texture: Some(image), ..default() };
                let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
                shown = Shown::Standard(material.clone());
                world.spawn((Mesh3d(mesh), MeshMaterial3d(material), at)).id()
            }
        };
        let is_good = matches!(shows, Show::Good(_));
        Known {
            entity,
            carrier,
            is_good,
            is_surface: false,
            has_guide: false,
            is_struck: false,
            shown,
            expect: Expect::Whole,
        }
    }

    fn send(&mut self, hit: CrackHit) {
        self.app.world_mut().trigger(hit);
        self.model.sent += 1;
    }

    fn shards(&mut self) -> Vec<Entity> {
        let world = self.app.world_mut();
        let mut shards: Vec<_> = world.query_filtered::<Entity, With<Shard>>().iter(world).collect();
        shards.sort();
        shards
    }

    fn play(&mut self, op: Op) {
        let slot_of = |op: Op| match op {
            Op::Despawn(slot)
            | Op::RemoveSurface(slot)
            | Op::Heal(slot)
            | Op::Prepare(slot)
            | Op::Change(slot)
            | Op::Unguide(slot)
            | Op::InsertSurface { slot, .. }
            | Op::Hit { slot, .. }
            | Op::HitWorld { slot, .. }
            | Op::Close { slot, .. }
            | Op::Preset { slot, .. }
            | Op::Picture { slot, .. }
            | Op::Transform { slot, .. }
            | Op::Parent { slot, .. }
            | Op::Clock { slot, .. }
            | Op::Guide { slot, .. }
            | Op::Shatter { slot, .. }
            | Op::Chips { slot, .. }
            | Op::Settings { slot, .. } => Some(slot),
            _ => None,
        };
        if let Some(slot) = slot_of(op) {
            if let Some(mut known) = self.model.slots.remove(&slot)
                && self.act(op, &mut known)
            {
                self.model.slots.insert(slot, known);
            }
        } else {
            self.act_on_all(op);
        }
        self.app.world_mut().flush();
    }

    /// Does an operation on one surface; says whether that is still there.
    fn act(&mut self, op: Op, known: &mut Known) -> bool {
        let entity = known.entity;
        match op {
            Op::Hit { uv, energy, .. } => {
                self.send(CrackHit::uv(entity, uv.into()).with_energy(energy));
                known.is_struck = true;
                let [u, v] = uv;
                let is_inside = (0.02..=0.98).contains(&u) && (0.02..=0.98).contains(&v);
                if is_inside && energy.is_finite() && energy > 0.0 {
                    known.struck();
                } else if known.expect == Expect::Whole && !(energy <= 0.0 || energy.is_nan()) {
                    // On the edge, or a picture that is looked at before the hit is.
                    known.expect = Expect::Anything;
                }
                return true;
            }
            Op::HitWorld { at, energy, .. } => {
                self.send(CrackHit::world(entity, at.into()).with_energy(energy));
                known.is_struck = true;
                known.expect = if known.is_surface { Expect::Anything } else { known.expect };
                return true;
            }
            _ => {}
        }
        let mut commands = self.app.world_mut().commands();
        let mut commands = commands.entity(entity);
        match op {
            Op::Despawn(_) => {
                commands.despawn();
                return false;
            }
            Op::RemoveSurface(_) => {
                commands.remove::<CrackSurface>();
                (known.is_surface, known.expect) = (false, Expect::Whole);
            }
            Op::InsertSurface { preset, seed, .. } => {
                commands.insert(surface_of(preset, seed));
                known.is_surface = true;
                if known.has_guide || known.is_struck {
                    known.expect = Expect::Anything;
                }
            }
            Op::Heal(_) => {
                commands.heal_cracks();
                known.expect = Expect::Whole;
            }
            Op::Close { seconds, .. } => {
                commands.close_cracks(seconds);
                known.expect = Expect::Anything;
            }
            Op::Prepare(_) => {
                commands.prepare_cracks();
                known.struck();
            }
            Op::Preset { preset: number, scale, .. } if known.is_surface => {
                let preset = preset(number, scale);
                commands.entry::<CrackSurface>().and_modify(move |mut surface| surface.preset = preset.into());
            }
            Op::Transform { scale, turn, .. } => {
                commands.insert(Transform { scale: scale.into(), rotation: Quat::from_rotation_z(turn), ..default() });
                let is_sane = scale.iter().all(|side| (0.2..=5.0).contains(&side.abs()));
                if !is_sane && known.is_surface {
                    known.expect = Expect::Anything;
                    // A hit by texture coordinates may crack it all the same.
                    known.carrier = Carrier::Tiled;
                }
            }
            Op::Parent { parent, .. } => {
                match parent {
                    Some(parent) => commands.insert(ChildOf(self.parents[usize::from(parent) % self.parents.len()])),
                    None => commands.remove::<ChildOf>(),
                };
            }
            Op::Clock { clock, .. } => {
                match clock {
                    Some(clock) => commands.insert(clock),
                    None => commands.remove::<CrackClock>(),
                };
            }
            Op::Guide { side, gamma, appearance, seconds, .. } => {
                let size = UVec2::splat(u32::from(side));
                let mut grid = Grid::new(size, 0.0);
                (0..size.x as usize).for_each(|i| grid.row_mut(i)[i] = 1.0);
                let appearance = match appearance % 3 {
                    0 => GuidedAppearance::AtOnce,
                    1 => GuidedAppearance::Front { from: Vec2::new(0.2, 0.4), seconds },
                    _ => GuidedAppearance::Widen { seconds },
                };
                let mut guided = GuidedCracks::new(CrackGuide::new(grid).with_gamma(gamma)).with_appearance(appearance);
                guided.params.sites = 20;
                guided.max_side = 40;
                commands.insert(guided);
                known.has_guide = true;
                known.expect = if known.is_surface { Expect::Anything } else { known.expect };
            }
            Op::Unguide(_) => {
                commands.remove::<(GuidedCracks, CrackRecord)>();
                known.has_guide = false;
            }
            Op::Shatter { uv, reach, .. } => {
                let request = uv.map_or(ShatterRequest::ALL, |uv| ShatterRequest::around(uv.into(), reach));
                commands.shatter_cracks(request);
            }
            Op::Chips { count, .. } => {
                match count {
                    Some(count) => commands.insert(CrackChips { count, ..default() }),
                    None => commands.remove::<CrackChips>(),
                };
            }
            Op::Settings { when, speed, again, fly, seek, .. } => {
                commands.insert(ShatterCracks {
                    when: match when % 3 {
                        0 => ShatterWhen::Never,
                        1 => ShatterWhen::AtDamage(0.05),
                        _ => ShatterWhen::CellsAsTheyClose,
                    },
                    cut: ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT },
                    anchor: Anchor::Nothing,
                    again: again.then_some(BreakAgain::DEFAULT),
                    speed,
                    fly,
                    seek,
                    ..default()
                });
            }
            Op::Picture { size, .. } => {
                let image = add(&mut self.app, show(Show::Good(size)));
                if let Some(mut sprite) = self.app.world_mut().get_mut::<Sprite>(entity) {
                    sprite.image = image.clone();
                    // Where it was good before, it is good now: cracks stay.
                    known.shown = Shown::Image(image);
                    if !known.is_good {
                        // Good or not, by what was wrong with it.
                        known.carrier = Carrier::Tiled;
                        known.expect = if known.expect == Expect::Whole { Expect::Whole } else { Expect::Anything };
                    }
                }
            }
            Op::Change(_) => {
                // The picture is drawn into, as by a game that paints on it.
                if let Shown::Image(image) = &known.shown
                    && let Some(mut image) = self.app.world_mut().resource_mut::<Assets<Image>>().get_mut(image)
                    && let Some(data) = &mut image.data
                {
                    data.iter_mut().step_by(5).for_each(|byte| *byte = byte.wrapping_add(1));
                }
            }
            _ => {}
        }
        true
    }

    fn act_on_all(&mut self, op: Op) {
        match op {
            Op::Spawn { slot, carrier, show, preset, seed, anchored } => {
                if let Some(known) = self.model.slots.remove(&slot) {
                    self.app.world_mut().despawn(known.entity);
                }
                let mut known = self.spawn(slot, carrier, show);
                self.app.world_mut().entity_mut(known.entity).insert(surface_of(preset, seed));
                if anchored {
                    self.app.world_mut().entity_mut(known.entity).insert(ShatterCracks::default());
                }
                known.is_surface = true;
                self.model.slots.insert(slot, known);
            }
            Op::Clone { from, to } if from != to => {
                let Some(known) = self.model.slots.get(&from) else { return };
                let (carrier, is_good, is_surface) = (known.carrier, known.is_good, known.is_surface);
                let (entity, shown) = (known.entity, known.shown.clone());
                // What a clone of a surface in trouble is, the crate may decide.
                let expect = match known.expect {
                    Expect::Whole | Expect::Cracked => Expect::Whole,
                    Expect::Failed | Expect::Anything => Expect::Anything,
                };
                let entity = self.app.world_mut().entity_mut(entity).clone_and_spawn();
                // It would bake anew, and shatter as the other one did.
                self.app.world_mut().entity_mut(entity).remove::<(GuidedCracks, CrackRecord, ShatterCracks)>();
                if let Some(old) = self.model.slots.remove(&to) {
                    self.app.world_mut().despawn(old.entity);
                }
                let known =
                    Known { entity, carrier, is_good, is_surface, has_guide: false, is_struck: false, shown, expect };
                self.model.slots.insert(to, known);
            }
            Op::Restore { from, to, is_healed } => {
                let (Some(from), Some(to)) = (self.model.slots.get(&from), self.model.slots.get(&to)) else { return };
                let (from, to, is_surface) = (from.entity, to.entity, to.is_surface);
                let record = move |records: CrackRecords| records.get(from);
                let Some(record) = self.app.world_mut().run_system_once(record).expect("it runs") else { return };
                let mut commands = self.app.world_mut().commands();
                let mut commands = commands.entity(to);
                if is_healed {
                    commands.heal_cracks();
                }
                commands.insert(record);
                for known in self.model.slots.values_mut().filter(|known| known.entity == to) {
                    known.has_guide = true;
                    known.expect = if is_surface { Expect::Anything } else { known.expect };
                }
            }
            Op::CrackShard(number) | Op::DespawnShard(number) => {
                let shards = self.shards();
                if shards.is_empty() {
                    return;
                }
                let shard = shards[usize::from(number) % shards.len()];
                if matches!(op, Op::CrackShard(_)) {
                    self.app.world_mut().entity_mut(shard).insert(surface_of(number, number));
                    self.send(center(shard));
                } else {
                    self.app.world_mut().despawn(shard);
                }
            }
            Op::Budget { milliseconds, max_shards } => {
                self.max_shards = self.max_shards.max(max_shards);
                self.app.insert_resource(CrackBudget { milliseconds, max_shards, ..default() });
            }
            Op::Speed(speed) => self.app.world_mut().resource_mut::<Time<Virtual>>().set_relative_speed(speed),
            Op::Frame(milliseconds) => {
                let frame = Duration::from_millis(milliseconds.into());
                self.app.insert_resource(TimeUpdateStrategy::ManualDuration(frame));
            }
            Op::Resize { target, size: [x, y] } => {
                let world = self.app.world_mut();
                if let Some(window) = self.windows.get(usize::from(target)).copied() {
                    if let Some(mut window) = world.get_mut::<Window>(window) {
                        window.resolution.set_physical_resolution(x.into(), y.into());
                    }
                } else if let Some(target) = self.targets.first()
                    && let Some(mut image) = world.resource_mut::<Assets<Image>>().get_mut(target)
                {
                    let (width, height) = (u32::from(x).max(1), u32::from(y).max(1));
                    image.resize(bevy::render::render_resource::Extent3d { width, height, ..default() });
                }
            }
            _ => {}
        }
    }

    fn shows(&self, entity: Entity) -> Option<Shown> {
        let world = self.app.world();
        let sprite = world.get::<Sprite>(entity).map(|sprite| Shown::Image(sprite.image.clone()));
        let color =
            || world.get::<MeshMaterial2d<ColorMaterial>>(entity).map(|material| Shown::Color(material.0.clone()));
        let wall =
            || world.get::<MeshMaterial3d<StandardMaterial>>(entity).map(|found| Shown::Standard(found.0.clone()));
        sprite.or_else(color).or_else(wall)
    }

    /// Holds the world against the model after a frame.
    fn check(&mut self) {
        let stats = counts(&self.app);
        assert_eq!(stats.sent, self.model.sent, "hits sent");
        let shards = self.shards();
        assert!(shards.len() <= self.max_shards, "{} shards, {} allowed", shards.len(), self.max_shards);
        for (slot, known) in &self.model.slots {
            let entity = known.entity;
            let world = self.app.world();
            assert!(world.get_entity(entity).is_ok(), "surface {slot} is gone");
            let Some(state) = world.get::<CrackState>(entity) else { continue };
            assert!((0.0..=1.0).contains(&state.damage), "{slot}: damage {}", state.damage);
            let (time, end) = (state.time, state.end);
            assert!(time.is_finite() && time >= 0.0 && time <= end + 1.0, "{slot}: time {time} of {end}");
            assert!(state.tips.len() <= CrackState::MAX_TIPS, "{slot}: tips");
            let textures = world.get::<CrackTextures>(entity);
            if known.expect == Expect::Whole {
                assert!(textures.is_none(), "{slot}: whole, but has textures");
                assert_eq!(self.shows(entity).as_ref(), Some(&known.shown), "{slot}: whole, but shows something else");
                assert!(!matches!(state.status, CrackStatus::Growing | CrackStatus::Done), "{slot}: {state:?}");
            }
            for texture in textures.into_iter().flat_map(CrackTextures::handles) {
                assert!(world.resource::<Assets<Image>>().contains(texture), "{slot}: a texture is gone");
            }
        }
    }

    fn frame(&mut self) {
        self.app.update();
        self.check();
        self.model.slots.values_mut().for_each(|known| known.is_struck = false);
    }

    /// Waits until everything that is to crack has cracked.
    fn settle(&mut self) {
        self.play(Op::Budget { milliseconds: 1e6, max_shards: CrackBudget::default().max_shards });
        self.play(Op::Speed(1.0));
        self.play(Op::Frame(20));
        for known in self.model.slots.values() {
            self.app.world_mut().entity_mut(known.entity).remove::<CrackClock>();
        }
        let start = Instant::now();
        loop {
            self.frame();
            let open: Vec<_> = self.model.slots.iter().filter(|(_, known)| !self.is_settled(known)).collect();
            if open.is_empty() {
                break;
            }
            if start.elapsed() > Duration::from_secs(20) {
                let (slot, known) = open[0];
                let state = self.app.world().get::<CrackState>(known.entity);
                panic!("surface {slot} ({:?}, {:?}) never settles: {state:?}", known.carrier, known.expect);
            }
        }
        let sound: Vec<_> = self.model.slots.values().filter(|known| known.expect == Expect::Cracked).collect();
        for known in sound {
            assert_sound(&self.app, known.entity);
            assert_ne!(self.shows(known.entity).as_ref(), Some(&known.shown), "cracked, but shows the game's own");
        }
    }

    fn is_settled(&self, known: &Known) -> bool {
        let world = self.app.world();
        let Some(state) = world.get::<CrackState>(known.entity) else { return true };
        match known.expect {
            Expect::Whole | Expect::Anything => true,
            Expect::Failed => matches!(state.status, CrackStatus::Failed(_)),
            Expect::Cracked => {
                let is_whole_again = world.get::<CrackShards>(known.entity).is_none();
                // What has been prepared and not hit is untouched.
                let is_done = matches!(state.status, CrackStatus::Done) || state.hits == 0;
                world.get::<CrackTextures>(known.entity).is_some() && (is_done || !is_whole_again)
            }
        }
    }

    /// Despawns everything; nothing may be left.
    fn clear(&mut self) {
        for known in std::mem::take(&mut self.model.slots).into_values() {
            self.app.world_mut().despawn(known.entity);
        }
        self.max_shards = CrackBudget::default().max_shards;
        let start = Instant::now();
        while stock(&self.app) != self.empty || counts(&self.app).queued > 0 {
            self.frame();
            let (now, empty) = (stock(&self.app), self.empty);
            assert!(
                start.elapsed() < Duration::from_secs(10),
                "left over: {now:?} entities, images, meshes and materials, {empty:?} at first"
            );
        }
    }
}

/// The operations of a round, frame by frame.
fn compose(seed: u64, frames: usize) -> Vec<Vec<Op>> {
    let mut rng = Rng::new(seed).stream("operations");
    (0..frames).map(|_| (0..rng.next_u32() % 4).map(|_| operation(&mut rng)).collect()).collect()
}

fn operation(rng: &mut Rng) -> Op {
    let slot = (rng.next_u32() % u32::from(SLOTS)) as u8;
    let number = rng.next_u32() as u8;
    let wild = [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e30, -1e30, f32::MIN_POSITIVE][usize::from(number) % 7];
    let mut some = |low: f32, high: f32| if rng.unit() < 0.08 { wild } else { rng.range(low, high) };
    let [a, b, c] = [some(0.0, 1.0), some(0.0, 1.0), some(0.2, 4.0)];
    let size = [16 + (rng.next_u32() % 60) as u16, 16 + (rng.next_u32() % 60) as u16];
    match rng.next_u32() % 45 {
        0..5 => {
            let carrier = match rng.next_u32() % 14 {
                0..4 => Carrier::Sprite,
                4 => Carrier::Resized([60.0 * a, 80.0 * b]),
                5 => Carrier::Part([20.0 * a, 20.0 * b, 40.0 * b, 60.0 * c]),
                6 => Carrier::Frame(usize::from(number % 11)),
                7 => Carrier::Tiled,
                8 | 9 => Carrier::Mesh2d,
                10 => Carrier::Wall,
                11 => Carrier::Body(number / 11),
                _ => Carrier::BrokenMesh(number),
            };
            let show = match rng.next_u32() % 16 {
                0 => Show::Empty,
                1 => Show::NoData,
                2 => Show::Short,
                3 => Show::Compressed,
                _ => Show::Good(size),
            };
            Op::Spawn { slot, carrier, show, preset: number, seed: number / 11, anchored: number.is_multiple_of(3) }
        }
        5 => Op::Despawn(slot),
        6 => Op::RemoveSurface(slot),
        7 => Op::InsertSurface { slot, preset: number, seed: number },
        8 => Op::Clone { from: slot, to: number % SLOTS },
        9..17 => Op::Hit { slot, uv: [a, b], energy: c },
        17 => Op::HitWorld { slot, at: [60.0 * a - 30.0, 10.0 * b, 0.0], energy: c },
        18 | 19 => Op::Heal(slot),
        20 => Op::Close { slot, seconds: a },
        21 => Op::Prepare(slot),
        22 => Op::Preset { slot, preset: number, scale: if number.is_multiple_of(2) { 1.0 } else { c } },
        23 => Op::Picture { slot, size },
        24 => Op::Change(slot),
        25 => Op::Transform { slot, scale: [c, -c, 1.0], turn: a },
        26 => Op::Parent { slot, parent: (!number.is_multiple_of(4)).then_some(number) },
        27 => {
            let clock = match number % 4 {
                0 => None,
                1 => Some(CrackClock::value(a)),
                2 => Some(CrackClock { seek: Some(100.0 * b), ..CrackClock::speed(c) }),
                _ => Some(CrackClock::speed(-c)),
            };
            Op::Clock { slot, clock }
        }
        28 => Op::Guide { slot, side: 1 + number % 30, gamma: 20.0 * a, appearance: number, seconds: b },
        29 => Op::Unguide(slot),
        30..33 => Op::Shatter { slot, uv: number.is_multiple_of(3).then_some([a, b]), reach: c },
        33 | 34 => {
            let seek = number.is_multiple_of(5).then_some(c);
            Op::Settings {
                slot,
                when: number,
                speed: 2.0 * a - 0.6,
                again: number.is_multiple_of(2),
                fly: !number.is_multiple_of(7),
                seek,
            }
        }
        35 => Op::CrackShard(number),
        36 => Op::DespawnShard(number),
        37 => {
            let milliseconds = [0.0, 0.1, 2.0, 1e6, f32::NAN, -1.0][usize::from(number) % 6];
            Op::Budget { milliseconds, max_shards: usize::from(number) * 8 }
        }
        39 | 40 => Op::Restore { from: slot, to: number % SLOTS, is_healed: !number.is_multiple_of(3) },
        38 => Op::Speed([0.0, 0.5, 1.0, 1.0, 8.0][usize::from(number) % 5]),
        41 | 42 => Op::Chips { slot, count: (!number.is_multiple_of(4)).then_some(number.into()) },
        _ if number.is_multiple_of(2) => Op::Frame([0, 1, 16, 20, 1000][usize::from(number) % 5]),
        _ => Op::Resize { target: number % 4, size: [u16::from(number), size[0]] },
    }
}

/// Plays a round; `Err` says what went wrong.
fn play(game: &mut Game, round: &[Vec<Op>]) -> Result<(), String> {
    let panics = PANICS.load(Ordering::Relaxed);
    let played = catch_unwind(AssertUnwindSafe(|| {
        for (number, ops) in round.iter().enumerate() {
            ops.iter().for_each(|op| game.play(*op));
            game.frame();
            if number % 100 == 99 {
                game.settle();
            }
        }
        game.settle();
        game.clear();
    }));
    match played {
        Err(cause) => {
            let text = cause.downcast_ref::<String>().cloned();
            Err(text.or_else(|| cause.downcast_ref::<&str>().map(ToString::to_string)).unwrap_or_default())
        }
        Ok(()) if PANICS.load(Ordering::Relaxed) > panics => Err("a panic on another thread".into()),
        Ok(()) => Ok(()),
    }
}

/// Takes parts out of a round for as long as it fails (Zeller's delta debugging), for two minutes at the most.
fn shortest(new: impl Fn() -> Option<Game>, round: Vec<Vec<Op>>) -> Vec<Vec<Op>> {
    let start = Instant::now();
    let mut round = round;
    let mut part = round.len().div_ceil(2);
    let fails = |round: &[Vec<Op>]| new().is_some_and(|mut game| play(&mut game, round).is_err());
    while part > 0 && start.elapsed() < Duration::from_secs(120) {
        let mut at = 0;
        while at < round.len() && start.elapsed() < Duration::from_secs(120) {
            let end = (at + part).min(round.len());
            let mut fewer = round.clone();
            fewer.drain(at..end);
            if fails(&fewer) { round = fewer } else { at = end }
        }
        part /= 2;
    }
    // What is left frame by frame, operation by operation.
    for frame in (0..round.len()).rev() {
        for op in (0..round[frame].len()).rev() {
            let mut fewer = round.clone();
            fewer[frame].remove(op);
            if start.elapsed() < Duration::from_secs(180) && fails(&fewer) {
                round = fewer;
            }
        }
    }
    round
}

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// Plays `frames` frames and takes a failing round apart.
fn run(new: impl Fn() -> Option<Game>, frames: usize, seed: u64) {
    let hook = take_hook();
    set_hook(Box::new(move |info| {
        PANICS.fetch_add(1, Ordering::Relaxed);
        hook(info);
    }));
    let Some(mut game) = new() else { return };
    let (mut used, mut kinds) = (Vec::new(), Vec::new());
    let rounds = frames.div_ceil(ROUND);
    // Where memory is measured, the second half is the first once more: so the largest burst lies in the first, the warm-up.
    let other = if frames >= MEASURED { rounds.div_ceil(2) } else { rounds };
    for number in (0..rounds).map(|number| number % other) {
        let round = compose(seed.wrapping_mul(1_000_003).wrapping_add(number as u64), ROUND);
        if let Err(why) = play(&mut game, &round) {
            drop(game);
            set_hook(Box::new(|_| _ = PANICS.fetch_add(1, Ordering::Relaxed)));
            let mut again = new().expect("an app");
            let short = match play(&mut again, &round) {
                Err(_) => shortest(new, round),
                Ok(()) => vec![vec![]],
            };
            // The engine's own again, which prints what follows.
            drop(take_hook());
            panic!("round {number} of seed {seed}: {why}\nthe shortest that fails, frame by frame:\n{short:#?}");
        }
        used.push(MEMORY.allocated());
        kinds.push(game.app.world().archetypes().len());
    }
    if frames >= MEASURED {
        let some: Vec<usize> = used.iter().step_by(rounds.div_ceil(20)).map(|bytes| bytes >> 10).collect();
        // A round may end while a task still has memory: the median of a tenth of the rounds.
        let (half, end) = (median(&used[other * 9 / 10..other]), median(&used[rounds - other / 10..]));
        let more = kinds[rounds - 1] - kinds[other - 1];
        println!(
            "bytes in use: {half} after half of {frames} frames, {end} at the end, with {more} more archetypes of {}; KiB on \
             the way: {some:?}",
            kinds[rounds - 1]
        );
        assert!(end < half + (2 << 20), "{half} bytes after half of {frames} frames, {end} at the end");
    }
}

fn median(values: &[usize]) -> usize {
    let mut values = values.to_vec();
    values.sort_unstable();
    values[values.len() / 2]
}

/// In a process of its own, where every panic of every thread counts.
fn alone(test: &str) {
    let program = std::env::current_exe().expect("this program");
    let run = std::process::Command::new(program)
        .args([test, "--exact", "--ignored", "--nocapture"])
        .output()
        .expect("it runs");
    let told = String::from_utf8_lossy(&run.stdout) + String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success() && told.contains("1 passed"), "{told}");
    if told.contains("PASSED OVER") {
        let _ = std::io::Write::write_all(&mut std::io::stderr(), told.as_bytes());
    }
}

#[test]
fn b3_random_operations_leave_nothing_behind() {
    alone("random::random_operations");
}

#[test]
#[ignore = "run by `b3_random_operations_leave_nothing_behind`"]
fn random_operations() {
    let frames = number("CRACK_RANDOM_FRAMES", 2000) as usize;
    run(|| Some(Game::new(app(), false)), frames, number("CRACK_RANDOM_SEED", 1));
}

#[test]
fn b3_random_operations_with_a_renderer() {
    alone("random::drawn_random_operations");
}

#[test]
#[ignore = "run by `b3_random_operations_with_a_renderer`"]
fn drawn_random_operations() {
    let frames = number("CRACK_RANDOM_FRAMES", 2000) as usize / 4;
    let new = || {
        let (one, app) = gpu_app()?;
        // The lock is for other tests of the same process, of which there are none.
        drop(one);
        Some(Game::new(app, true))
    };
    run(new, frames, number("CRACK_RANDOM_SEED", 1) + 1000);
}
