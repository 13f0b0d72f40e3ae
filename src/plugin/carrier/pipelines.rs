//! Warming up: a surface keeps its old look until the renderer has the pipelines for the new one.
//!
//! The engine makes pipelines in the background, and what it has none for yet it does not draw: a surface that is shown with another
//! material or mesh would be gone for some frames. So what it is going to look like is *asked for* before: an entity with such a material
//! and a mesh of that kind without any area is drawn in all views, until all pipelines are there that were asked for by then. That
//! is done as soon as there is a `CrackSurface` or `ShatterCracks`, once for each kind of look, and again when the cameras have become
//! others. What was not asked for in time waits: the hit in its queue, the shards with their surface.

#[cfg(any(feature = "2d", feature = "3d"))]
use super::slot::{CrackMaterial, MaterialSlot, mesh_of};
use crate::plugin::api::CrackBudget;
#[cfg(any(feature = "2d", feature = "3d"))]
use bevy::{
    asset::RenderAssetUsages,
    camera::visibility::{NoFrustumCulling, RenderLayers},
    mesh::{Indices, PrimitiveTopology, VertexAttributeValues},
};
use bevy::{
    platform::{collections::HashMap, time::Instant},
    prelude::*,
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderSystems,
        render_resource::{CachedPipelineState, CachedRenderPipelineId, PipelineCache},
    },
};
#[cfg(any(feature = "2d", feature = "3d"))]
use core::any::TypeId;
#[cfg(any(feature = "2d", feature = "3d"))]
use core::hash::{Hash, Hasher};
use core::{
    sync::atomic::{AtomicU64, Ordering},
    time::Duration,
};
#[cfg(any(feature = "2d", feature = "3d"))]
use std::hash::DefaultHasher;
use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

/// Frames from an entity that is made to the first of which it is certain that all pipelines for it have been asked for: it is seen from
/// the next frame on, and what it is made of may come a frame later.
pub(crate) const LEAD: u64 = 3;

/// Nothing waits any longer for a renderer.
pub(crate) const PATIENCE: Duration = Duration::from_secs(5);

/// What the renderer has made its pipelines for, and what it is making them for.
#[derive(Resource, Default)]
pub(crate) struct PipelineRequests {
    /// All pipelines are there that were asked for up to this frame; `None` = there is no renderer.
    pub(crate) ready_up_to: Option<Arc<AtomicU64>>,
    /// Number of frames so far.
    pub(crate) frame: u64,
    /// What all pipelines depend on unmeasured looks.
    pub(crate) views: u64,
    /// By all that makes a look another one for the renderer.
    pub(crate) looks: BTreeMap<u64, Look>,
    /// Since when those are waited for that were not there when the cameras became others.
    pub(crate) waited: BTreeMap<u64, Instant>,
    /// Surfaces that are to be looked at.
    pub(crate) fresh: VecDeque<Entity>,
}

/// Something that surfaces can look like.
pub(crate) struct Look {
    /// One of the surfaces.
    pub(crate) of: Entity,
    /// What is drawn so that pipelines are made; `None` = they are there.
    pub(crate) stand_in: Option<Entity>,
    /// The frame in which it was made, and when that was.
    pub(crate) frame: u64,
    pub(crate) since: Instant,
}

/// The mesh of a look.
#[cfg(any(feature = "2d", feature = "3d"))]
pub(crate) enum Shape {
    /// As the entity's own, with tangents or as it is.
    Own { has_tangents: bool },
    /// As that of a shard.
    Shard { has_colors: bool, has_tangents: bool },
}

/// Connects the worlds, if there is a renderer.
pub(crate) fn connect(app: &mut App) {
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
    let ready_up_to = Arc::<AtomicU64>::default();
    render_app
        .insert_resource(Pipelines {
            ready_up_to: ready_up_to.clone(),
            frame: 0,
            has_time: false,
            waiting: HashMap::default(),
        })
        .add_systems(ExtractSchedule, take_frame)
        .add_systems(
            Render,
            (
                wait_for_pipelines.after(RenderSystems::Prepare).before(RenderSystems::Render),
                tell_of_pipelines.in_set(RenderSystems::Cleanup),
            ),
        );
    app.world_mut().resource_mut::<PipelineRequests>().ready_up_to = Some(ready_up_to);
}

/// Whether there is a renderer.
pub(crate) fn is_connected(warmth: Res<PipelineRequests>) -> bool {
    warmth.ready_up_to.is_some()
}

/// The renderer's pipelines.
#[derive(Resource)]
struct Pipelines {
    ready_up_to: Arc<AtomicU64>,
    /// The frame that is drawn.
    frame: u64,
    /// Whether frames may take any time.
    has_time: bool,
    /// Those that are not there: the frame in which that was first seen, and when that was.
    waiting: HashMap<usize, (u64, Instant)>,
}

fn take_frame(
    warmth: Extract<Res<PipelineRequests>>,
    budget: Extract<Res<CrackBudget>>,
    mut pipelines: ResMut<Pipelines>,
) {
    (pipelines.frame, pipelines.has_time) = (warmth.frame, budget.is_unlimited());
}

/// Where frames may take any time, each is drawn with all of its pipelines.
fn wait_for_pipelines(pipelines: Res<Pipelines>, cache: Option<ResMut<PipelineCache>>) {
    let Some(mut cache) = cache.filter(|_| pipelines.has_time) else { return };
    cache.process_queue();
    for id in cache.waiting_pipelines().collect::<Vec<_>>() {
        let id = CachedRenderPipelineId::new(id);
        if matches!(cache.get_render_pipeline_state(id), CachedPipelineState::Creating(_)) {
            cache.block_on_render_pipeline(id);
        }
    }
}

/// Tells up to which frame all pipelines are there. Those that never come, for want of a shader, count for a while only.
fn tell_of_pipelines(mut pipelines: ResMut<Pipelines>, cache: Option<Res<PipelineCache>>) {
    let Some(cache) = cache else { return };
    let Pipelines { ready_up_to, frame, waiting, .. } = &mut *pipelines;
    let is_waiting = |id: &usize| {
        let state = cache.get_render_pipeline_state(CachedRenderPipelineId::new(*id));
        !matches!(state, CachedPipelineState::Ok(_))
    };
    let before = core::mem::take(waiting);
    let now = Instant::now();
    for id in cache.waiting_pipelines().filter(is_waiting) {
        waiting.insert(id, before.get(&id).copied().unwrap_or((*frame, now)));
    }
    let in_time = waiting.values().filter(|(_, since)| now.duration_since(*since) < PATIENCE);
    let all_up_to = in_time.map(|(first, _)| first.saturating_sub(1)).min().unwrap_or(*frame);
    ready_up_to.store(all_up_to, Ordering::Relaxed);
}

/// Whether anything waits for the renderer. Where frames may take any time nothing is put off, and each is drawn when all is there.
pub(crate) fn is_needed(world: &World) -> bool {
    let has_renderer = world.get_resource::<PipelineRequests>().is_some_and(|warmth| warmth.ready_up_to.is_some());
    has_renderer && !world.resource::<CrackBudget>().is_unlimited()
}

/// Whether the renderer can draw this material on a mesh of this shape. If not, it is asked to.
#[cfg(any(feature = "2d", feature = "3d"))]
pub(crate) fn can_draw<S: MaterialSlot>(
    world: &mut World,
    entity: Entity,
    material: S::Material,
    shape: &Shape,
) -> bool {
    let Some(Point { mesh, scale }) = Point::of(world, entity, shape) else { return true };
    let layers = world.get::<RenderLayers>(entity).cloned();
    let mut hasher = DefaultHasher::new();
    (TypeId::of::<S>(), material.pipeline_key()).hash(&mut hasher);
    layers.as_ref().map(RenderLayers::bits).hash(&mut hasher);
    match &mesh {
        Ok(mesh) => {
            mesh.primitive_topology().hash(&mut hasher);
            for (attribute, _) in mesh.try_attributes().into_iter().flatten() {
                (attribute.id, attribute.format).hash(&mut hasher);
            }
        }
        Err(own) => own.id().hash(&mut hasher),
    }
    let key = hasher.finish();
    if let Some(look) = world.resource::<PipelineRequests>().looks.get(&key) {
        return look.stand_in.is_none();
    }
    let Some(mut materials) = world.get_resource_mut::<Assets<S::Material>>() else { return true };
    let material = materials.add(material);
    let Some(mut meshes) = world.get_resource_mut::<Assets<Mesh>>() else { return true };
    let mesh = mesh.map_or_else(|own| own, |mesh| meshes.add(mesh));
    let translation = world.get::<GlobalTransform>(entity).map_or(Vec3::ZERO, GlobalTransform::translation);
    let place = Transform::from_translation(translation).with_scale(Vec3::splat(scale));
    let parts = (S::Mesh::from(mesh), S::from(material), place, Visibility::Visible, NoFrustumCulling);
    let mut stand_in = world.spawn(parts);
    if let Some(layers) = layers {
        stand_in.insert(layers);
    }
    let stand_in = Some(stand_in.id());
    let warmth = &mut *world.resource_mut::<PipelineRequests>();
    let since = warmth.waited.remove(&key).unwrap_or_else(Instant::now);
    warmth.looks.insert(key, Look { of: entity, stand_in, frame: warmth.frame, since });
    false
}

/// A mesh of which nothing is seen: one of a single point or, where nothing can be read of the entity's own, that one, so small.
#[cfg(any(feature = "2d", feature = "3d"))]
struct Point {
    mesh: Result<Mesh, Handle<Mesh>>,
    scale: f32,
}

#[cfg(any(feature = "2d", feature = "3d"))]
impl Point {
    /// `None` where there is nothing to draw, or where it takes more to draw it than a mesh.
    fn of(world: &World, entity: Entity, shape: &Shape) -> Option<Self> {
        const TINY: f32 = 1e-12;
        let made = |mesh| Some(Self { mesh: Ok(mesh), scale: 1.0 });
        match *shape {
            Shape::Shard { has_colors, has_tangents } => {
                let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
                    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0; 3]; 3])
                    .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 0.0, 1.0]; 3])
                    .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, vec![[0.0; 2]; 3])
                    .with_inserted_indices(Indices::U32(vec![0, 1, 2]));
                if has_colors {
                    mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, vec![[1.0; 4]; 3]);
                }
                if has_tangents {
                    mesh.insert_attribute(Mesh::ATTRIBUTE_TANGENT, vec![[1.0, 0.0, 0.0, 1.0]; 3]);
                }
                made(mesh)
            }
            Shape::Own { has_tangents } => {
                let own = mesh_of(world, entity)?;
                let mesh = world.get_resource::<Assets<Mesh>>()?.get(own)?;
                let Ok(attributes) = mesh.try_attributes() else {
                    return Some(Self { mesh: Err(own.clone()), scale: TINY });
                };
                let mut point = Mesh::new(mesh.primitive_topology(), RenderAssetUsages::default());
                for (attribute, values) in attributes {
                    let values = match values {
                        VertexAttributeValues::Float32(_) => VertexAttributeValues::Float32(vec![0.0; 3]),
                        VertexAttributeValues::Float32x2(_) => VertexAttributeValues::Float32x2(vec![[0.0; 2]; 3]),
                        VertexAttributeValues::Float32x3(_) => VertexAttributeValues::Float32x3(vec![[0.0; 3]; 3]),
                        VertexAttributeValues::Float32x4(_) => VertexAttributeValues::Float32x4(vec![[0.0; 4]; 3]),
                        VertexAttributeValues::Unorm8x4(_) => VertexAttributeValues::Unorm8x4(vec![[0; 4]; 3]),
                        // Bones and the like want more than a mesh.
                        _ => return None,
                    };
                    point.insert_attribute(*attribute, values);
                }
                let has = |attribute| matches!(point.try_contains_attribute(attribute), Ok(true));
                if has_tangents && has(Mesh::ATTRIBUTE_NORMAL) && has(Mesh::ATTRIBUTE_UV_0) {
                    point.insert_attribute(Mesh::ATTRIBUTE_TANGENT, vec![[1.0, 0.0, 0.0, 1.0]; 3]);
                }
                match mesh.try_indices_option() {
                    Ok(Some(Indices::U16(_))) => point.insert_indices(Indices::U16(vec![0, 1, 2])),
                    Ok(Some(Indices::U32(_))) => point.insert_indices(Indices::U32(vec![0, 1, 2])),
                    _ => {}
                }
                made(point)
            }
        }
    }
}
