//! Sprites and tile maps that crack as one surface.

use crate::support::*;
use bevy::{
    camera::visibility::RenderLayers,
    ecs::system::RunSystemOnce,
    image::TextureAtlasLayout,
    prelude::*,
    render::render_resource::{Extent3d, TextureFormat},
    sprite_render::{
        TileData, TileOrientation, TilemapChunk, TilemapChunkMaterial, TilemapChunkMeshCache, TilemapChunkTileData,
    },
};
use bevy_crack::{math::Rng, prelude::*};

/// Texels of a tile, and tiles of the wall.
const TILE: u32 = 16;
const WALL: UVec2 = UVec2::new(12, 8);

/// A picture without two texels that are alike, nearly.
fn speckled(size: UVec2, seed: u64) -> Image {
    let mut image = picture(size);
    let mut rng = Rng::new(seed);
    let data = image.data.as_mut().unwrap();
    data.iter_mut().enumerate().for_each(|(i, byte)| *byte = if i % 4 == 3 { 255 } else { rng.next_u32() as u8 });
    image
}

fn texel(image: &Image, x: u32, y: u32) -> [u8; 4] {
    let start = 4 * (y * image.width() + x) as usize;
    image.data.as_ref().unwrap()[start..start + 4].try_into().unwrap()
}

fn set_texel(image: &mut Image, x: u32, y: u32, texel: [u8; 4]) {
    let start = 4 * (y * image.width() + x) as usize;
    image.data.as_mut().unwrap()[start..start + 4].copy_from_slice(&texel);
}

fn preset() -> CrackPreset {
    CrackPreset::CONCRETE
}

/// A wall of sprites that shows `whole`: frames of an atlas in random order, flipped and turned by quarter turns at random, spawned in random
/// order. Its centre is at `center`.
fn spawn_wall(app: &mut App, whole: &Image, center: Vec3, seed: u64) -> (Entity, Vec<Entity>) {
    let mut rng = Rng::new(seed);
    let group =
        app.world_mut().spawn((CrackSurface::new(preset()).with_seed(5), Transform::from_translation(center))).id();
    let mut frames: Vec<u32> = (0..WALL.element_product()).collect();
    let mut order = frames.clone();
    for list in [&mut frames, &mut order] {
        for i in 0..list.len() {
            let other = rng.next_u32() as usize % list.len();
            list.swap(i, other);
        }
    }
    let mut atlas = picture(WALL * TILE);
    let mut layout = TextureAtlasLayout::new_empty(WALL * TILE);
    for i in 0..WALL.element_product() {
        let min = UVec2::new(i % WALL.x, i / WALL.x) * TILE;
        layout.add_texture(URect { min, max: min + TILE });
    }
    let mut members = Vec::new();
    for i in order {
        let (column, row) = (i % WALL.x, i / WALL.x);
        let frame = frames[i as usize];
        let (flip_x, flip_y, turns) = (rng.unit() < 0.5, rng.unit() < 0.5, rng.next_u32() % 4);
        for (x, y) in (0..TILE).flat_map(|y| (0..TILE).map(move |x| (x, y))) {
            // Where a texel of the frame is seen: mirrored, then turned counterclockwise.
            let mirrored = (if flip_x { TILE - 1 - x } else { x }, if flip_y { TILE - 1 - y } else { y });
            let (u, v) = (0..turns).fold(mirrored, |(u, v), _| (v, TILE - 1 - u));
            let seen = texel(whole, column * TILE + u, row * TILE + v);
            set_texel(&mut atlas, frame % WALL.x * TILE + x, frame / WALL.x * TILE + y, seen);
        }
        let at = Vec2::new(column as f32 + 0.5, row as f32 + 0.5) - WALL.as_vec2() / 2.0;
        let place = center + (at * Vec2::new(TILE as f32, -(TILE as f32))).extend(0.0);
        let turn = Quat::from_rotation_z(core::f32::consts::FRAC_PI_2 * turns as f32);
        let sprite = Sprite { flip_x, flip_y, ..default() };
        let transform = Transform::from_translation(place).with_rotation(turn);
        members.push((app.world_mut().spawn((sprite, transform, CrackMemberOf(group))).id(), frame));
    }
    let (atlas, layout) = (add(app, atlas), add(app, layout));
    for (member, frame) in &members {
        let mut sprite = app.world_mut().get_mut::<Sprite>(*member).unwrap();
        sprite.image = atlas.clone();
        sprite.texture_atlas = Some(TextureAtlas { layout: layout.clone(), index: *frame as usize });
    }
    (group, members.into_iter().map(|(member, _)| member).collect())
}

fn is_ready(app: &App, entity: Entity) -> bool {
    app.world().get::<CrackTextures>(entity).is_some()
}

/// Prepares a surface.
fn prepare(app: &mut App, entity: Entity) {
    app.world_mut().commands().entity(entity).prepare_cracks();
    wait_for(app, "the surface", |app| is_ready(app, entity));
}

fn is_hidden(app: &App, member: Entity) -> bool {
    app.world().get::<RenderLayers>(member) == Some(&RenderLayers::none())
}

/// A wall of tiles shows in every frame what one sprite shows, bit for bit, and goes on so when half of its tiles have gone.
#[test]
fn a_wall_of_tiles_is_one_surface() {
    let mut app = app();
    let whole = speckled(WALL * TILE, 1);
    let (group, members) = spawn_wall(&mut app, &whole, Vec3::new(300.0, -70.0, 2.0), 2);
    let image = add(&mut app, whole.clone());
    let plain = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(preset()).with_seed(5))).id();
    step(&mut app);
    assert!(app.world().get::<Sprite>(group).is_none() && !is_hidden(&app, members[0]), "nothing is made before a hit");
    prepare(&mut app, group);
    prepare(&mut app, plain);
    for i in 0..200 {
        if i % 50 == 0 {
            let at = Vec2::new(0.3 + 0.002 * i as f32, 0.5);
            hit(&mut app, CrackHit::uv(group, at).with_energy(2.0));
            hit(&mut app, CrackHit::uv(plain, at).with_energy(2.0));
        }
        step(&mut app);
        assert!(shown(&app, group) == shown(&app, plain), "frame {i}");
    }
    settle(&mut app, group);
    assert_eq!(state(&app, group).nodes, state(&app, plain).nodes);
    assert!(members.iter().all(|member| is_hidden(&app, *member)));
    // Half of them go.
    let cracked = shown(&app, plain);
    let (gone, stay) = members.split_at(members.len() / 2);
    let places: Vec<Vec3> = gone.iter().map(|member| get::<Transform>(&app, *member).translation).collect();
    for member in gone {
        app.world_mut().despawn(*member);
    }
    let is_open = |app: &App| shown(app, group).as_chunks::<4>().0.iter().filter(|texel| texel[3] == 0).count();
    wait_for(&mut app, "the holes", |app| is_open(app) == gone.len() * (TILE * TILE) as usize);
    let holes = shown(&app, group);
    for (i, (now, before)) in holes.as_chunks::<4>().0.iter().zip(cracked.as_chunks::<4>().0).enumerate() {
        let (x, y) = (i as u32 % (WALL.x * TILE), i as u32 / (WALL.x * TILE));
        let at = Vec2::new(x as f32 - 95.5, 63.5 - y as f32) + Vec2::new(300.0, -70.0);
        let half = TILE as f32 / 2.0;
        let is_gone = places.iter().any(|place| (place.truncate() - at).abs().max_element() < half);
        assert!(if is_gone { now[3] == 0 } else { now == before }, "{x}, {y}: {now:?} {before:?}");
    }
    // Healed, the members are shown again, and cracked again they are all there is.
    app.world_mut().commands().entity(group).heal_cracks();
    step(&mut app);
    assert!(app.world().get::<Sprite>(group).is_none());
    assert!(stay.iter().all(|member| !is_hidden(&app, *member) && app.world().get::<RenderLayers>(*member).is_none()));
    let place = get::<Transform>(&app, stay[0]).translation;
    hit(&mut app, CrackHit::world(stay[0], place));
    settle(&mut app, group);
    // All of them: nothing is left.
    for member in stay {
        app.world_mut().despawn(*member);
    }
    steps(&mut app, 30);
    app.world_mut().despawn(group);
    steps(&mut app, 3);
}

/// A hit on a member is one on its group, in the same place, however it is given.
#[test]
fn hits_on_members_land_on_the_group() {
    let mut app = app();
    let whole = speckled(WALL * TILE, 1);
    let (group, members) = spawn_wall(&mut app, &whole, Vec3::new(-20.0, 30.0, 0.0), 9);
    step(&mut app);
    let place = get::<Transform>(&app, members[7]).translation;
    let uv = (place.truncate() - Vec2::new(-20.0, 30.0)) * Vec2::new(1.0, -1.0) / (WALL * TILE).as_vec2() + 0.5;
    for (hit_at, entity) in [
        (HitPoint::Uv(Vec2::splat(0.5)), members[7]),
        (HitPoint::Local(Vec3::ZERO), members[7]),
        (HitPoint::World(place), members[7]),
        (HitPoint::World(place), members[0]),
        (HitPoint::World(place), group),
    ] {
        let at = CrackHit { at: hit_at, ..CrackHit::uv(entity, Vec2::ZERO) };
        hit(&mut app, at);
        settle(&mut app, group);
        let record = app.world_mut().run_system_once(move |records: CrackRecords| records.get(group)).unwrap();
        let (at, _) = record.expect("it was hit").hits().next().unwrap();
        let at = at / Vec2::new(1.5, 1.0);
        assert!(at.distance(uv) < 1e-4, "{hit_at:?}: {at} {uv}");
        app.world_mut().commands().entity(group).heal_cracks();
        step(&mut app);
    }
}

/// Healing refuses the hits before it that were on members, as those on the group; those after it land.
#[test]
fn i12_a_group_is_healed_in_the_frame_of_a_hit_on_a_member() {
    let mut app = app();
    let whole = speckled(WALL * TILE, 1);
    let (group, members) = spawn_wall(&mut app, &whole, Vec3::ZERO, 9);
    step(&mut app);
    hit(&mut app, center(members[7]));
    app.world_mut().commands().entity(group).heal_cracks();
    app.world_mut().flush();
    assert_eq!((counts(&app).sent, counts(&app).rejected), (1, 1));
    hit(&mut app, center(members[8]));
    settle(&mut app, group);
    assert_eq!((counts(&app).applied, state(&app, group).hits), (1, 1));
}

/// The texel of a tile that the engine's shader shows at (u, v) in it.
fn shader(orientation: TileOrientation, u: f32, v: f32) -> (f32, f32) {
    let u = if orientation.mirror_h() { 1.0 - u } else { u };
    let v = if orientation.mirror_v() { 1.0 - v } else { v };
    if orientation.mirror_d() { (v, u) } else { (u, v) }
}

/// A chunk of a tile map, with a sprite beside it, shows what the engine draws of both.
#[test]
fn chunks_of_tile_maps_crack() {
    use TileOrientation::*;
    let mut app = app();
    app.init_resource::<TilemapChunkMeshCache>().init_asset::<TilemapChunkMaterial>();
    let mut tileset = speckled(UVec2::new(8, 24), 4);
    tileset.texture_descriptor.size = Extent3d { width: 8, height: 8, depth_or_array_layers: 3 };
    let set = tileset.clone();
    let tileset = add(&mut app, tileset);
    let all = [Default, Rotate90, Rotate180, Rotate270, MirrorH, MirrorHRotate90, MirrorHRotate180, MirrorHRotate270];
    let mut tiles: Vec<Option<TileData>> = (0..16)
        .map(|i| Some(TileData { tileset_index: i % 3, orientation: all[usize::from(i % 8)], ..default() }))
        .collect();
    tiles[5] = None;
    tiles[6] = tiles[6].map(|tile| TileData { visible: false, ..tile });
    tiles[9] = tiles[9].map(|tile| TileData { tileset_index: 3, ..tile });
    tiles[10] = tiles[10].map(|tile| TileData { color: Color::srgb(0.5, 1.0, 0.0), ..tile });
    let chunk = TilemapChunk { chunk_size: UVec2::splat(4), tile_display_size: UVec2::splat(16), tileset, ..default() };
    let group = app.world_mut().spawn(CrackSurface::new(preset())).id();
    let data = TilemapChunkTileData(tiles.clone());
    let chunk = app.world_mut().spawn((chunk, data, CrackMemberOf(group), Transform::from_xyz(100.0, 50.0, 0.0))).id();
    let beside = add(&mut app, solid(UVec2::splat(4), [9, 8, 7, 255]));
    let beside = Sprite { custom_size: Some(Vec2::new(32.0, 64.0)), ..Sprite::from_image(beside) };
    app.world_mut().spawn((beside, CrackMemberOf(group), Transform::from_xyz(148.0, 50.0, 0.0)));
    step(&mut app);
    prepare(&mut app, group);
    let shown = app.world().get::<Sprite>(group).unwrap();
    assert_eq!(shown.custom_size, Some(Vec2::new(96.0, 64.0)));
    let image = app.world().resource::<Assets<Image>>().get(&shown.image).unwrap();
    assert_eq!(image.size(), UVec2::new(48, 32), "two units a texel");
    for (x, y) in (0..32).flat_map(|y| (0..48).map(move |x| (x, y))) {
        let expected = if x >= 32 {
            [9, 8, 7, 255]
        } else {
            let (column, row) = (x / 8, 3 - y / 8);
            match tiles[(row * 4 + column) as usize] {
                Some(TileData { visible: true, tileset_index: index @ 0..3, orientation, color }) => {
                    let (u, v) = shader(orientation, (x % 8) as f32 / 8.0 + 0.0625, (y % 8) as f32 / 8.0 + 0.0625);
                    let mut expected = texel(&set, (u * 8.0) as u32, (v * 8.0) as u32 + 8 * u32::from(index));
                    if color != Color::WHITE {
                        (expected[0], expected[2]) = (texel(image, x, y)[0], 0);
                    }
                    expected
                }
                _ => [0; 4],
            }
        };
        assert_eq!(texel(image, x, y), expected, "{x}, {y}");
    }
    let untinted =
        (0..8).flat_map(|y| (16..24).map(move |x| (x, 8 + y))).filter(|(x, y)| texel(image, *x, *y)[0] > 200);
    assert_eq!(untinted.count(), 0, "the tint halves red");
    // A tile that is taken out of the chunk leaves a hole.
    hit(&mut app, CrackHit::world(chunk, Vec3::new(124.0, 26.0, 0.0)).with_energy(2.0));
    settle(&mut app, group);
    app.world_mut().get_mut::<TilemapChunkTileData>(chunk).unwrap().0[0] = None;
    wait_for(&mut app, "the hole", |app| {
        let own = texels(app, &image_of(app, group));
        (24..32).all(|y| (0..8).all(|x| own[4 * (y * 48 + x) + 3] == 0))
    });
}

/// What cannot be a member is left out, with a warning once; a group that cannot be put together fails.
#[test]
fn e9_members_that_fit_no_group() {
    let mut app = app();
    single_threaded(&mut app);
    let image = add(&mut app, speckled(UVec2::splat(32), 3));
    let group = app.world_mut().spawn(CrackSurface::new(preset())).id();
    let sprite = |x: f32| (Sprite::from_image(image.clone()), Transform::from_xyz(x, 0.0, 0.0), CrackMemberOf(group));
    let [kept, turned, tilted, flat, empty, lost] =
        [0.0, 32.0, 64.0, 96.0, 128.0, 160.0].map(|x| app.world_mut().spawn(sprite(x)).id());
    app.world_mut().get_mut::<Transform>(turned).unwrap().rotation = Quat::from_rotation_z(0.3);
    app.world_mut().get_mut::<Transform>(tilted).unwrap().rotation = Quat::from_rotation_x(0.3);
    app.world_mut().get_mut::<Transform>(flat).unwrap().scale = Vec3::new(0.0, 1.0, 1.0);
    app.world_mut().get_mut::<Sprite>(empty).unwrap().custom_size = Some(Vec2::new(f32::NAN, 3.0));
    app.world_mut().get_mut::<Transform>(lost).unwrap().translation.x = f32::INFINITY;
    app.world_mut().spawn((Transform::default(), CrackMemberOf(group)));
    step(&mut app);
    let heard = warnings(|| {
        hit(&mut app, CrackHit::world(kept, Vec3::ZERO));
        settle(&mut app, group);
        steps(&mut app, 20);
    });
    assert_eq!(heard.len(), 1, "{heard:?}");
    assert!(heard[0].contains("is left out"), "{heard:?}");
    assert_eq!(app.world().get::<Sprite>(group).unwrap().custom_size, Some(Vec2::splat(32.0)));
    assert!(is_hidden(&app, kept));
    for member in [turned, tilted, flat, empty, lost] {
        assert!(!is_hidden(&app, member));
    }

    let failed = |app: &mut App, group: Entity| {
        hit(app, CrackHit::world(group, Vec3::ZERO));
        steps(app, 3);
        let status = state(app, group).status;
        assert!(matches!(status, CrackStatus::Failed(CrackError::Group { .. })), "{status:?}");
    };
    let nothing = app.world_mut().spawn(CrackSurface::new(preset())).id();
    app.world_mut().spawn((Transform::default(), CrackMemberOf(nothing)));
    failed(&mut app, nothing);
    let own = app.world_mut().spawn((CrackSurface::new(preset()), Transform::from_scale(Vec3::ZERO))).id();
    app.world_mut().spawn((Sprite::from_image(image.clone()), CrackMemberOf(own)));
    hit(&mut app, CrackHit::uv(own, Vec2::splat(0.5)));
    steps(&mut app, 3);
    assert!(matches!(state(&app, own).status, CrackStatus::Failed(CrackError::Group { .. })));
    // Whoever has nobody is no group.
    let nobody = app.world_mut().spawn(CrackSurface::new(preset())).id();
    hit(&mut app, center(nobody));
    steps(&mut app, 2);
    assert_eq!(state(&app, nobody).status, CrackStatus::Failed(CrackError::NothingToCrack));
    // A member of what is no surface, or is gone, is refused.
    let rejected = counts(&app).rejected;
    let stranger = app.world_mut().spawn((sprite(0.0).0, CrackMemberOf(lost))).id();
    hit(&mut app, center(stranger));
    steps(&mut app, 2);
    assert_eq!(counts(&app).rejected, rejected + 1);
}

/// Layers that members were drawn in come back; who moves is shown by itself.
#[test]
fn members_are_shown_as_before() {
    let mut app = app();
    let whole = speckled(WALL * TILE, 1);
    let (group, members) = spawn_wall(&mut app, &whole, Vec3::ZERO, 9);
    let layers = RenderLayers::from_layers(&[2, 3]);
    app.world_mut().entity_mut(members[0]).insert(layers.clone());
    step(&mut app);
    hit(&mut app, CrackHit::uv(group, Vec2::splat(0.5)));
    settle(&mut app, group);
    steps(&mut app, 5);
    assert!(is_hidden(&app, members[0]) && is_hidden(&app, members[3]) && is_hidden(&app, members[4]));
    assert_eq!(app.world().get::<RenderLayers>(group), Some(&layers), "the group is drawn where the first is");
    // One moves, one leaves, all move with the group.
    app.world_mut().get_mut::<Transform>(members[3]).unwrap().translation.x += 7.0;
    app.world_mut().entity_mut(members[4]).remove::<CrackMemberOf>();
    let all: Vec<Entity> = members.iter().copied().chain([group]).collect();
    for entity in all {
        app.world_mut().get_mut::<Transform>(entity).unwrap().translation.y += 1000.0;
    }
    wait_for(&mut app, "both", |app| !is_hidden(app, members[3]) && !is_hidden(app, members[4]));
    steps(&mut app, 20);
    assert!(is_hidden(&app, members[0]) && is_hidden(&app, members[5]));
    let own = texels(&app, &image_of(&app, group));
    let open = own.as_chunks::<4>().0.iter().filter(|texel| texel[3] == 0).count();
    assert_eq!(open, 2 * (TILE * TILE) as usize);
    app.world_mut().entity_mut(group).remove::<CrackSurface>();
    steps(&mut app, 3);
    assert_eq!(app.world().get::<RenderLayers>(members[0]), Some(&layers));
    assert!(members.iter().all(|member| !is_hidden(&app, *member)));
    assert!(app.world().get::<RenderLayers>(group).is_none(), "those of its members go");
}

/// However many members a group has, all of them are shown again, also if its picture has just been made again.
#[test]
fn all_members_are_shown_again() {
    let mut app = app();
    let image = add(&mut app, solid(UVec2::splat(2), [120, 110, 100, 255]));
    let group = app.world_mut().spawn(CrackSurface::new(preset()).with_seed(5)).id();
    let spawn = |app: &mut App, i: u32| {
        let place = Transform::from_xyz(2.0 * (i % 40) as f32, 2.0 * (i / 40) as f32, 0.0);
        app.world_mut().spawn((Sprite::from_image(image.clone()), place, CrackMemberOf(group))).id()
    };
    let members: Vec<Entity> = (0..1600).map(|i| spawn(&mut app, i)).collect();
    step(&mut app);
    hit(&mut app, CrackHit::uv(group, Vec2::splat(0.5)));
    wait_for(&mut app, "all", |app| members.iter().all(|member| is_hidden(app, *member)));
    app.world_mut().get_mut::<Transform>(members[7]).unwrap().translation.x += 500.0;
    wait_for(&mut app, "the one that moves", |app| !is_hidden(app, members[7]));
    app.world_mut().commands().entity(group).heal_cracks();
    steps(&mut app, 10);
    let hidden = members.iter().filter(|member| is_hidden(&app, **member)).count();
    assert_eq!(hidden, 0, "of {}", members.len());
}

/// Pictures of one channel are red on their members, and so they are on the group.
#[test]
fn groups_of_pictures_with_one_channel_are_red() {
    let mut app = app();
    let image = add(&mut app, picture_of(UVec2::splat(16), TextureFormat::R8Unorm));
    let group = app.world_mut().spawn(CrackSurface::new(preset())).id();
    for x in [0.0, 16.0] {
        let sprite = Sprite::from_image(image.clone());
        app.world_mut().spawn((sprite, Transform::from_xyz(x, 0.0, 0.0), CrackMemberOf(group)));
    }
    step(&mut app);
    prepare(&mut app, group);
    let shown = texels(&app, &image_of(&app, group));
    let all = shown.as_chunks::<4>().0;
    assert!(all.iter().all(|[_, green, blue, _]| (*green, *blue) == (0, 0)) && all.iter().any(|[red, ..]| *red > 0));
}

/// Whatever happens to groups and their members, counts add up and nothing is left.
#[test]
fn s10_whatever_happens_to_groups() {
    let mut app = app();
    let image = add(&mut app, speckled(UVec2::splat(16), 3));
    let before = app.world().resource::<Assets<Image>>().len();
    let mut rng = Rng::new(77);
    let mut groups: Vec<Entity> = Vec::new();
    let mut members: Vec<Entity> = Vec::new();
    for frame in 0..1500 {
        let pick = |rng: &mut Rng, list: &[Entity]| list.get(rng.next_u32() as usize % list.len().max(1)).copied();
        let (group, member) = (pick(&mut rng, &groups), pick(&mut rng, &members));
        let at = Vec3::new(16.0 * (rng.next_u32() % 8) as f32, 16.0 * (rng.next_u32() % 8) as f32, 0.0);
        match (rng.next_u32() % 14, group, member) {
            (0, ..) if groups.len() < 4 => {
                let surface = CrackSurface::new(small_preset());
                groups.push(app.world_mut().spawn((surface, ShatterCracks::default())).id());
            }
            (1..=4, Some(group), _) if members.len() < 60 => {
                let sprite = Sprite { flip_x: rng.unit() < 0.5, ..Sprite::from_image(image.clone()) };
                members
                    .push(app.world_mut().spawn((sprite, Transform::from_translation(at), CrackMemberOf(group))).id());
            }
            (5, _, Some(member)) => {
                app.world_mut().despawn(member);
                members.retain(|other| *other != member);
            }
            (6, _, Some(member)) => {
                app.world_mut().get_mut::<Transform>(member).unwrap().translation = at;
            }
            (7, Some(group), Some(member)) => {
                app.world_mut().entity_mut(member).insert(CrackMemberOf(group));
            }
            (8, _, Some(member)) => hit(&mut app, CrackHit::world(member, at).with_energy(2.0)),
            (9 | 10, Some(group), _) => hit(&mut app, CrackHit::world(group, at)),
            (11, Some(group), _) if rng.unit() < 0.3 => {
                app.world_mut().commands().entity(group).heal_cracks();
            }
            (12, Some(group), _) if rng.unit() < 0.3 => {
                app.world_mut().commands().entity(group).shatter_cracks(ShatterRequest::default());
            }
            (13, Some(group), _) if rng.unit() < 0.1 => {
                app.world_mut().despawn(group);
                groups.retain(|other| *other != group);
                assert!(app.world().get_entity(group).is_err());
            }
            _ => {}
        }
        step(&mut app);
        for member in &members {
            let is_alone = app.world().get::<CrackMemberOf>(*member).is_none();
            assert!(!(is_alone && is_hidden(&app, *member)), "frame {frame}: nobody shows {member}");
        }
    }
    for entity in members.into_iter().chain(groups) {
        app.world_mut().despawn(entity);
    }
    wait_for(&mut app, "an empty world", |app| app.world().resource::<Assets<Image>>().len() == before);
}

/// No frame without the wall: before the hit, at it, while members are hidden, with holes, healed.
#[test]
fn e13_groups_do_not_blink() {
    let Some((_guard, mut app)) = gpu_app() else { return };
    app.insert_resource(CrackBudget { milliseconds: 2.0, ..default() });
    let size = UVec2::new(128, 96);
    let target = spawn_camera(&mut app, size);
    let image = add(&mut app, solid(UVec2::splat(16), [240, 250, 230, 255]));
    let mut preset = preset();
    preset.growth.reach = 0.1;
    let group = app.world_mut().spawn((CrackSurface::new(preset), ShatterCracks::default())).id();
    for i in 0..48 {
        let at = Vec2::new((i % 8) as f32, (i / 8) as f32) * 16.0 - Vec2::new(56.0, 40.0);
        let place = Transform::from_translation(at.extend(0.0));
        app.world_mut().spawn((Sprite::from_image(image.clone()), place, CrackMemberOf(group)));
    }
    // All pictures are with the renderer.
    (0..5).for_each(|_| app.update());
    let film = film(&mut app, &target, 60, |app, frame| match frame {
        3 => hit(app, CrackHit::world(group, Vec3::new(-40.0, 20.0, 0.0)).with_energy(0.5)),
        40 => _ = app.world_mut().commands().entity(group).heal_cracks(),
        _ => {}
    });
    let mut cracked = 0;
    for (i, frame) in film.iter().enumerate() {
        let texels = frame.as_chunks::<4>().0;
        let is_plain = |texel: &&[u8; 4]| **texel == [240, 250, 230, 255];
        let far = (0..96).flat_map(|y| (112..128).map(move |x| (x, y))).map(|(x, y)| &texels[y * 128 + x]);
        assert!(far.clone().all(|texel| is_plain(&texel)), "frame {i}: {:?}", far.clone().find(|t| !is_plain(t)));
        let plain = texels.iter().filter(is_plain).count();
        assert!(plain > 64 * 96, "frame {i}: {plain}");
        cracked += usize::from(plain < 128 * 96);
    }
    assert!(cracked > 10 && film[59] == film[0], "{cracked}");
}
