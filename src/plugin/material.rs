//! Meshes with a material as carriers.

#[cfg(feature = "3d")]
mod split;

use super::{
    CrackError, CrackTextures, HitPoint, Shard,
    carrier::{Carrier, Clothes, Found, Kind, Shown, typed},
    mesh::{aspect_of, check_for_tangents, closest, is_flat, place_of, wrap},
    queue::QueuedHit,
    shards::Plane,
    surfaces::Active,
    textures::Maps,
    warm::{self, Asked, Shape},
};
use bevy::{
    asset::{LoadState, UntypedHandle},
    ecs::component::Mutable,
    math::{Affine2, Mat3A},
    prelude::*,
};

/// A material that can show cracks.
pub(super) trait CrackMaterial: Asset + Clone {
    /// The maps that it knows.
    const MAPS: Maps;
    /// The pictures that it shows: diffuse, normal, depth.
    fn pictures(&self) -> [Option<Handle<Image>>; 3];
    /// Shows the textures that there are; `relief` is how deep a crack is, in units of the surface's shorter side.
    fn show(&mut self, textures: &CrackTextures, relief: f32);
    /// From the mesh's texture coordinates to the picture's.
    fn uv_transform(&self) -> Affine2 {
        Affine2::IDENTITY
    }
    /// Shows the upper half of its textures as if that were all of them.
    fn show_upper_half(&mut self) {}
    /// Becomes transparent where its picture is.
    fn open(&mut self);
    /// The same for shards: with this picture, the mesh's texture coordinates being the picture's, and so much of it there (0..=1).
    fn for_shards(&mut self, picture: &Handle<Image>, opacity: f32);
    /// The same for the sides of shards of a picture of this mean colour (sRGB), if they have any; see
    /// [`RimLook::bright`](crate::shatter::RimLook::bright).
    fn for_sides(&self, mean: [f32; 3], bright: f32) -> Option<Self>;
    /// What the renderer's pipelines for it depend on.
    fn pipeline_key(&self) -> u64;
}

/// The component that holds a material.
pub(super) trait MaterialSlot: Component<Mutability = Mutable> + From<Handle<Self::Material>> {
    type Material: CrackMaterial;
    /// The component that holds the mesh beside it.
    type Mesh: Component + From<Handle<Mesh>>;
    fn material(&self) -> &Handle<Self::Material>;
    fn set_material(&mut self, material: Handle<Self::Material>);
}

/// How to deal with meshes whose material is in the component `S`.
pub(super) const fn kind<S: MaterialSlot>() -> Kind {
    Kind {
        inspect: inspect::<S>,
        attach: attach::<S>,
        looks: looks::<S>,
        detach: detach::<S>,
        aspect: aspect::<S>,
        is_twofold: is_twofold::<S>,
        aim,
        locate: locate::<S>,
        check_mesh: check_mesh::<S>,
        is_solid: S::Material::MAPS.depth,
        plane: plane::<S>,
        open: open::<S>,
        shard_material: shard_material::<S>,
        inside: inside::<S>,
        spawn: spawn::<S>,
        spawn_sides: spawn_sides::<S>,
        dress: dress::<S>,
        change: change::<S>,
        undress: undress::<S>,
    }
}

fn inspect<S: MaterialSlot>(world: &World, entity: Entity) -> Found {
    let Some(slot) = world.get::<S>(entity) else { return Found::Other };
    let Some(materials) = world.get_resource::<Assets<S::Material>>() else {
        return Found::Unusable(CrackError::NoMaterials { material: S::Material::short_type_path().to_owned() });
    };
    let Some(material) = materials.get(slot.material()).filter(|_| !is_mesh_loading(world, entity)) else {
        return Found::Waiting;
    };
    let [diffuse, normal, depth] = material.pictures();
    Found::Shown(Box::new(Shown {
        asset: slot.material().clone().untyped(),
        diffuse,
        normal,
        depth,
        rect: None,
        layout: None,
        size: None,
        maps: S::Material::MAPS,
    }))
}

/// Whether the mesh of an entity is on its way. Hits wait for it: where they land, and tangents, are found on it.
fn is_mesh_loading(world: &World, entity: Entity) -> bool {
    let server = world.get_resource::<AssetServer>();
    let state = server.zip(mesh_of(world, entity)).and_then(|(server, mesh)| server.get_load_state(mesh));
    matches!(state, Some(LoadState::NotLoaded | LoadState::Loading))
}

pub(super) fn mesh_of(world: &World, entity: Entity) -> Option<&Handle<Mesh>> {
    let mesh_2d = world.get::<Mesh2d>(entity).map(|mesh| &mesh.0);
    mesh_2d.or_else(|| world.get::<Mesh3d>(entity).map(|mesh| &mesh.0))
}

fn attach<S: MaterialSlot>(
    world: &mut World,
    entity: Entity,
    carrier: &mut Carrier,
    textures: &CrackTextures,
    relief: f32,
) {
    let Some(before) = typed::<S::Material>(&carrier.shown.asset) else { return };
    let Some(mut materials) = world.get_resource_mut::<Assets<S::Material>>() else { return };
    let Some(mut material) = materials.get(&before).cloned() else { return };
    material.show(textures, relief);
    if carrier.is_twofold {
        material.show_upper_half();
    }
    let own = carrier.own.as_ref().and_then(typed::<S::Material>).unwrap_or_else(|| materials.reserve_handle());
    // A handle that we hold is never refused.
    if materials.insert(&own, material).is_err() {
        return;
    }
    carrier.own = Some(own.clone().untyped());
    if let Some(mut slot) = world.get_mut::<S>(entity) {
        slot.set_material(own);
    }
    #[cfg(feature = "3d")]
    if S::Material::MAPS.depth && carrier.mesh.is_none() && (textures.normal.is_some() || textures.depth.is_some()) {
        carrier.mesh = give_tangents(world, entity);
    }
    #[cfg(feature = "3d")]
    split::give_faces::<S>(world, entity, carrier);
}

/// Whether tangents can be made for a mesh that has none.
fn check_mesh<S: MaterialSlot>(world: &World, entity: Entity) -> Result<(), CrackError> {
    let meshes = world.get_resource::<Assets<Mesh>>();
    match meshes.and_then(|meshes| meshes.get(mesh_of(world, entity)?)) {
        Some(mesh) if S::Material::MAPS.depth && lacks_tangents(mesh) => {
            check_for_tangents(mesh).map_err(|reason| CrackError::Mesh { reason })
        }
        _ => Ok(()),
    }
}

fn lacks_tangents(mesh: &Mesh) -> bool {
    matches!(mesh.try_attribute_option(Mesh::ATTRIBUTE_TANGENT), Ok(None))
}

/// Normal and depth maps show nothing on a mesh without tangents: such a mesh is replaced by one that has them.
#[cfg(feature = "3d")]
fn give_tangents(world: &mut World, entity: Entity) -> Option<(Handle<Mesh>, Handle<Mesh>)> {
    let before = world.get::<Mesh3d>(entity)?.0.clone();
    let mut meshes = world.get_resource_mut::<Assets<Mesh>>()?;
    let mesh = meshes.get(&before)?;
    if !lacks_tangents(mesh) {
        return None;
    }
    // It may be another one than when the surface was planned.
    let made = check_for_tangents(mesh)
        .and_then(|()| mesh.clone().with_generated_tangents().map_err(|error| error.to_string()));
    match made {
        Ok(mesh) => {
            let own = meshes.add(mesh);
            world.get_mut::<Mesh3d>(entity)?.0 = own.clone();
            Some((before, own))
        }
        Err(error) => {
            let surface = super::error::Called::of(world, entity);
            warn!("the normals of the cracks on {surface} will not show, its mesh has no tangents: {error}");
            None
        }
    }
}

fn looks<S: MaterialSlot>(world: &mut World, entity: Entity, asked: &Asked<'_>) -> bool {
    let Some(materials) = world.get_resource::<Assets<S::Material>>() else { return true };
    let Some(now) = world.get::<S>(entity).and_then(|slot| materials.get(slot.material())) else { return true };
    // Any picture will do, and the engine's white one is there.
    let (white, is_solid) = (Handle::<Image>::default(), S::Material::MAPS.depth);
    let textures = |maps: &Maps| CrackTextures {
        diffuse: (maps.diffuse && S::Material::MAPS.diffuse).then(|| white.clone()),
        normal: (maps.normal && S::Material::MAPS.normal).then(|| white.clone()),
        depth: (maps.depth && S::Material::MAPS.depth).then(|| white.clone()),
        emissive: (maps.emissive && S::Material::MAPS.emissive).then(|| white.clone()),
    };
    let own = Shape::Own { has_tangents: is_solid };
    let mut cracked = now.clone();
    match asked {
        Asked::Cracked(maps) => {
            cracked.show(&textures(maps), 0.0);
            let is_as_before = !is_solid && cracked.pipeline_key() == now.pipeline_key();
            is_as_before || warm::can_draw::<S>(world, entity, cracked, &own)
        }
        Asked::Broken { maps, original, has_rims, inside } => {
            cracked.show(&textures(maps), 0.0);
            let read = |material: &UntypedHandle| materials.get(&material.clone().try_typed().ok()?);
            let sides = match inside {
                Some(inside) => read(inside).cloned(),
                None => read(original).and_then(|before| before.for_sides([0.0; 3], 0.0)),
            };
            cracked.open();
            let mut shard = cracked.clone();
            shard.for_shards(&white, 1.0);
            let shape = Shape::Shard { has_colors: *has_rims, has_tangents: is_solid };
            let bare = Shape::Shard { has_colors: false, has_tangents: true };
            // All of them, that they come at once.
            let has_surface = warm::can_draw::<S>(world, entity, cracked, &own);
            let has_shards = warm::can_draw::<S>(world, entity, shard, &shape);
            let has_sides = !is_solid || sides.is_none_or(|sides| warm::can_draw::<S>(world, entity, sides, &bare));
            has_surface && has_shards && has_sides
        }
    }
}

fn detach<S: MaterialSlot>(world: &mut World, entity: Entity, carrier: &Carrier) {
    if let Some(mut slot) = world.get_mut::<S>(entity)
        && carrier.is_showing(&slot.material().clone().untyped())
        && let Some(before) = typed(&carrier.shown.asset)
    {
        slot.set_material(before);
    }
    if let Some((before, own)) = &carrier.mesh
        && let Some(mut mesh) = world.get_mut::<Mesh3d>(entity)
        && mesh.0 == *own
    {
        mesh.0 = before.clone();
    }
    #[cfg(feature = "3d")]
    split::forget(world, entity);
}

/// From a mesh's texture coordinates to those of the picture.
fn to_picture<S: MaterialSlot>(world: &World, entity: Entity) -> Result<Affine2, &'static str> {
    let material = world.get::<S>(entity).ok_or("the material is gone")?.material();
    let materials = world.get_resource::<Assets<S::Material>>().ok_or("there are no materials")?;
    let transform = materials.get(material).map_or(Affine2::IDENTITY, CrackMaterial::uv_transform);
    #[cfg(feature = "3d")]
    if split::is_upper_half(world, entity, material.id().untyped()) {
        return Ok(Affine2::from_scale(Vec2::new(1.0, 2.0)) * transform);
    }
    Ok(transform)
}

fn is_twofold<S: MaterialSlot>(world: &World, entity: Entity) -> bool {
    #[cfg(feature = "3d")]
    if S::Material::MAPS.depth {
        return split::shares_its_picture::<S>(world, entity);
    }
    let _ = (world, entity);
    false
}

fn aim(world: &mut World, entity: Entity, hit: &QueuedHit, is_blank: bool) -> HitPoint {
    #[cfg(feature = "3d")]
    if let Some(at) = split::aim(world, entity, hit, is_blank) {
        return at;
    }
    let _ = (world, entity, is_blank);
    hit.at
}

fn aspect<S: MaterialSlot>(world: &World, entity: Entity, _: Option<Vec2>, _: Option<Vec2>) -> Option<f32> {
    let mesh = world.get_resource::<Assets<Mesh>>()?.get(mesh_of(world, entity)?)?;
    world.get_resource::<Assets<S::Material>>()?.get(world.get::<S>(entity)?.material())?;
    let place = world.get::<GlobalTransform>(entity).map_or(Mat3A::IDENTITY, |place| place.affine().matrix3);
    aspect_of(mesh, place, to_picture::<S>(world, entity).ok()?)
}

fn locate<S: MaterialSlot>(world: &World, entity: Entity, local: Vec3) -> Result<Vec2, &'static str> {
    let mesh = mesh_of(world, entity).ok_or("there is no mesh")?;
    let meshes = world.get_resource::<Assets<Mesh>>().ok_or("there are no mesh assets")?;
    let transform = to_picture::<S>(world, entity)?;
    #[cfg(feature = "3d")]
    if let Some(uv) = split::locate(world, entity, meshes, local)? {
        return Ok(transform.transform_point2(uv).clamp(Vec2::ZERO, Vec2::ONE));
    }
    let (_, uv) = closest(meshes.get(mesh).ok_or("the mesh is not loaded")?, local)?;
    Ok(wrap(transform.transform_point2(uv)))
}

fn plane<S: MaterialSlot>(world: &World, entity: Entity, _: &Active) -> Result<Plane, &'static str> {
    let mesh = mesh_of(world, entity).ok_or("there is no mesh")?;
    let mesh =
        world.get_resource::<Assets<Mesh>>().and_then(|meshes| meshes.get(mesh)).ok_or("its mesh is not loaded")?;
    let transform = to_picture::<S>(world, entity)?;
    if transform.matrix2.determinant() == 0.0 {
        return Err("its material shows one line of the picture only");
    }
    let to_mesh = transform.inverse();
    let corner = |u, v| place_of(mesh, to_mesh.transform_point2(Vec2::new(u, v))).ok_or("its mesh lacks a corner");
    let (first, normal) = corner(0.0, 0.0)?;
    let plane = Plane::through([first, corner(1.0, 0.0)?.0, corner(0.0, 1.0)?.0, corner(1.0, 1.0)?.0], normal)?;
    #[cfg(feature = "3d")]
    if let Some(thickness) = split::thickness(world, entity) {
        return Ok(Plane { thickness: Some(thickness), ..plane });
    }
    if !is_flat(mesh, first, normal) {
        return Err(
            "its mesh is neither flat nor a slab, which is a box at least four times as wide and high as thick",
        );
    }
    Ok(plane)
}

#[cfg_attr(not(feature = "3d"), expect(unused_variables, reason = "only 3D meshes have sides"))]
fn open<S: MaterialSlot>(world: &mut World, entity: Entity, carrier: &Carrier, has_holes: bool) {
    #[cfg(feature = "3d")]
    split::open(world, entity, has_holes);
    if !has_holes {
        return;
    }
    let (Some(own), Some(mut materials)) = (&carrier.own, world.get_resource_mut::<Assets<S::Material>>()) else {
        return;
    };
    if let Some(mut material) = typed(own).and_then(|own| materials.get_mut(&own)) {
        material.open();
    }
}

fn shard_material<S: MaterialSlot>(
    world: &mut World,
    _entity: Entity,
    carrier: &Carrier,
    picture: &Handle<Image>,
    opacity: f32,
) -> Option<UntypedHandle> {
    let mut materials = world.get_resource_mut::<Assets<S::Material>>()?;
    let own = typed(carrier.own.as_ref().unwrap_or(&carrier.shown.asset))?;
    let mut material = materials.get(&own)?.clone();
    material.for_shards(picture, opacity);
    Some(materials.add(material).untyped())
}

fn inside<S: MaterialSlot>(world: &mut World, carrier: &Carrier, mean: [f32; 3], bright: f32) -> Option<UntypedHandle> {
    let mut materials = world.get_resource_mut::<Assets<S::Material>>()?;
    let inside = materials.get(&typed(&carrier.shown.asset)?)?.for_sides(mean, bright)?;
    Some(materials.add(inside).untyped())
}

/// Makes entities of shards; `None` once their surface is gone.
///
/// One after the other, and each a child of its surface before it is a shard: observers of shards may despawn the surface, and the engine
/// panics where that comes between a child and its parent.
pub(super) fn spawn<S: MaterialSlot>(world: &mut World, shards: Vec<(Shard, Clothes)>) -> Vec<Option<Entity>> {
    let spawn = |(shard, clothes)| {
        let entity = spawn_one::<S>(world, clothes)?;
        if let Ok(mut entity) = world.get_entity_mut(entity) {
            entity.insert(shard);
        }
        Some(entity)
    };
    shards.into_iter().map(spawn).collect()
}

/// Makes entities of the sides of shards; `None` where the shard is gone.
pub(super) fn spawn_sides<S: MaterialSlot>(world: &mut World, sides: Vec<Clothes>) -> Vec<Option<Entity>> {
    sides.into_iter().map(|clothes| spawn_one::<S>(world, clothes)).collect()
}

fn spawn_one<S: MaterialSlot>(world: &mut World, clothes: Clothes) -> Option<Entity> {
    world.get_entity(clothes.parent).is_ok().then(|| world.spawn(worn::<S>(clothes)).id())
}

/// All that is seen of a shard; nothing of one whose material is of another kind.
fn worn<S: MaterialSlot>(clothes: Clothes) -> (ChildOf, Transform, Visibility, S::Mesh, S) {
    let Clothes { parent, place, mesh, material } = clothes;
    let material: Handle<S::Material> = typed(&material).unwrap_or_default();
    (ChildOf(parent), place, Visibility::Inherited, mesh.into(), material.into())
}

/// Makes a shard of an entity that was one.
pub(super) fn dress<S: MaterialSlot>(entity: &mut EntityWorldMut, shard: Option<Shard>, clothes: Clothes) {
    let is_child = entity.get::<ChildOf>().is_some_and(|child| child.parent() == clothes.parent);
    let (parent, place, visibility, mesh, material) = worn::<S>(clothes);
    let has_parent = is_child || entity.world().get_entity(parent.parent()).is_ok();
    if !is_child && has_parent {
        entity.insert(parent);
    }
    if !entity.is_despawned() {
        entity.insert((place, visibility, mesh, material));
    }
    // Last, as in `spawn`.
    if let Some(shard) = shard.filter(|_| has_parent && !entity.is_despawned()) {
        entity.insert(shard);
    }
}

/// Gives a shard another material.
pub(super) fn change<S: MaterialSlot>(entity: &mut EntityWorldMut, material: &UntypedHandle) {
    if let Some(material) = typed::<S::Material>(material) {
        entity.insert(S::from(material));
    }
}

/// Takes what makes it a shard from an entity, and the material.
pub(super) fn undress<S: MaterialSlot>(entity: &mut EntityWorldMut) {
    entity.remove::<(Shard, S)>();
}

#[cfg(feature = "2d")]
mod flat {
    use super::{Affine2, CrackMaterial, CrackTextures, Handle, Image, Maps, MaterialSlot};
    use bevy::{
        prelude::{Alpha, ColorMaterial, Mesh2d, MeshMaterial2d},
        sprite_render::AlphaMode2d,
    };

    impl CrackMaterial for ColorMaterial {
        const MAPS: Maps = Maps { diffuse: true, normal: true, depth: false, emissive: false };

        fn pictures(&self) -> [Option<Handle<Image>>; 3] {
            [self.texture.clone(), None, None]
        }

        fn show(&mut self, textures: &CrackTextures, _relief: f32) {
            if let Some(diffuse) = &textures.diffuse {
                self.texture = Some(diffuse.clone());
            }
        }

        fn uv_transform(&self) -> Affine2 {
            self.uv_transform
        }

        fn open(&mut self) {
            if self.alpha_mode == AlphaMode2d::Opaque {
                self.alpha_mode = AlphaMode2d::Mask(0.5);
            }
        }

        fn for_shards(&mut self, picture: &Handle<Image>, opacity: f32) {
            self.texture = Some(picture.clone());
            self.uv_transform = Affine2::IDENTITY;
            self.alpha_mode = AlphaMode2d::Blend;
            self.color = self.color.with_alpha(self.color.alpha() * opacity);
        }

        fn for_sides(&self, _mean: [f32; 3], _bright: f32) -> Option<Self> {
            None
        }

        fn pipeline_key(&self) -> u64 {
            match self.alpha_mode {
                AlphaMode2d::Opaque => 0,
                AlphaMode2d::Mask(_) => 1,
                AlphaMode2d::Blend => 2,
            }
        }
    }

    impl MaterialSlot for MeshMaterial2d<ColorMaterial> {
        type Material = ColorMaterial;
        type Mesh = Mesh2d;

        fn material(&self) -> &Handle<ColorMaterial> {
            &self.0
        }

        fn set_material(&mut self, material: Handle<ColorMaterial>) {
            self.0 = material;
        }
    }
}

#[cfg(feature = "3d")]
mod standard {
    use super::{Affine2, CrackMaterial, CrackTextures, Handle, Image, Maps, MaterialSlot};
    use bevy::{
        pbr::{ParallaxMappingMethod, StandardMaterialKey},
        prelude::{AlphaMode, Color, LinearRgba, Mesh3d, MeshMaterial3d, StandardMaterial, Vec2},
    };
    use core::hash::{Hash, Hasher};
    use std::collections::hash_map::DefaultHasher;

    impl CrackMaterial for StandardMaterial {
        const MAPS: Maps = Maps { diffuse: true, normal: true, depth: true, emissive: true };

        fn pictures(&self) -> [Option<Handle<Image>>; 3] {
            [self.base_color_texture.clone(), self.normal_map_texture.clone(), self.depth_map.clone()]
        }

        fn show(&mut self, textures: &CrackTextures, relief: f32) {
            if let Some(diffuse) = &textures.diffuse {
                self.base_color_texture = Some(diffuse.clone());
            }
            if let Some(normal) = &textures.normal {
                self.normal_map_texture = Some(normal.clone());
            }
            if let Some(emissive) = textures.emissive.as_ref().filter(|_| self.emissive_texture.is_none()) {
                self.emissive_texture = Some(emissive.clone());
                self.emissive = LinearRgba::WHITE;
            }
            let Some(depth) = &textures.depth else { return };
            if self.depth_map.is_none() {
                // Half of what the normals say: seen from the side, deeper cracks swim.
                self.parallax_depth_scale = 0.5 * relief;
                self.parallax_mapping_method = ParallaxMappingMethod::Relief { max_steps: 5 };
                self.max_parallax_layer_count = 32.0;
            }
            self.depth_map = Some(depth.clone());
        }

        fn uv_transform(&self) -> Affine2 {
            self.uv_transform
        }

        fn show_upper_half(&mut self) {
            self.uv_transform = Affine2::from_scale(Vec2::new(1.0, 0.5)) * self.uv_transform;
            // Depth is in units of the texture, which is twice as high.
            self.parallax_depth_scale *= 0.5;
        }

        fn open(&mut self) {
            if self.alpha_mode == AlphaMode::Opaque {
                self.alpha_mode = AlphaMode::Mask(0.5);
            }
        }

        /// Shards in 3D shrink instead of fading.
        fn for_shards(&mut self, picture: &Handle<Image>, _opacity: f32) {
            self.base_color_texture = Some(picture.clone());
            self.uv_transform = Affine2::IDENTITY;
        }

        fn for_sides(&self, mean: [f32; 3], bright: f32) -> Option<Self> {
            let share = bright.clamp(0.0, 1.0);
            let [red, green, blue] =
                [0, 1, 2].map(|i| DARKER * mean[i] * (1.0 - share) + (0.4 * mean[i] + 0.6 * EDGE[i]) * share);
            let color = Color::srgb(red, green, blue);
            Some(Self {
                base_color: color,
                // Light that has entered elsewhere leaves through the edges of glass.
                emissive: color.to_linear() * (GLOW * share),
                base_color_texture: None,
                normal_map_texture: None,
                emissive_texture: None,
                depth_map: None,
                ..self.clone()
            })
        }

        fn pipeline_key(&self) -> u64 {
            let mut hasher = DefaultHasher::new();
            StandardMaterialKey::from(self).hash(&mut hasher);
            core::mem::discriminant(&self.alpha_mode).hash(&mut hasher);
            core::mem::discriminant(&self.opaque_render_method).hash(&mut hasher);
            hasher.finish()
        }
    }

    /// How much darker than its picture a wall is inside, sRGB.
    const DARKER: f32 = 0.55;

    /// The edge of a pane of glass, sRGB, and how much it glows.
    const EDGE: [f32; 3] = [0.72, 0.94, 0.88];
    const GLOW: f32 = 0.35;

    impl MaterialSlot for MeshMaterial3d<StandardMaterial> {
        type Material = StandardMaterial;
        type Mesh = Mesh3d;

        fn material(&self) -> &Handle<StandardMaterial> {
            &self.0
        }

        fn set_material(&mut self, material: Handle<StandardMaterial>) {
            self.0 = material;
        }
    }
}
