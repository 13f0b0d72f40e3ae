//! When the mesh of a group is made, and shown in place of its members.

use super::body::{BodyWork, MadeBody};
use super::common::{self, GroupFrame, Whole, warn_left_out};
use super::hide::{GivenLayers, Replaced};
use super::solids::{Solids, place_in};
use crate::plugin::api::{CrackError, CrackGroup, CrackMemberOf, CrackTextures};
use crate::plugin::carrier::unfold;
use crate::plugin::jobs::background::PATIENCE;
use crate::plugin::jobs::copy::{CopyProgress, PictureCopies};
use crate::plugin::jobs::stepped::{News, Running};
use crate::plugin::jobs::threads::Threads;
use crate::plugin::surface::unfold::order;
use bevy::{
    asset::RenderAssetUsages,
    camera::visibility::RenderLayers,
    ecs::entity::EntityHashSet,
    image::ImageSampler,
    light::{NotShadowCaster, NotShadowReceiver},
    math::Affine3A,
    mesh::VertexAttributeValues,
    platform::time::Instant,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use std::ops::Range;

/// Members further from where they were than this have moved, as a share of where they were.
const SLACK: f32 = 1e-4;

/// Groups of meshes of which some member may have moved or gone.
#[derive(Resource, Default)]
pub(crate) struct BodyChanges(EntityHashSet);

/// The mesh of a group.
#[derive(Component, Default)]
#[component(clone_behavior = Ignore)]
pub(crate) struct Body {
    stage: Stage,
    mesh: Handle<Mesh>,
    members: Vec<Member>,
    replaced: Replaced,
    layers: GivenLayers,
    /// Whether it casts no shadows, and receives none, as its members.
    is_unshadowed: (bool, bool),
    has_warned: bool,
}

/// A member that the group shows.
struct Member {
    entity: Entity,
    /// Where it was when the mesh was made.
    place: Affine3A,
    triangles: Range<usize>,
}

#[derive(Default)]
enum Stage {
    /// Nothing is being made.
    #[default]
    Rest,
    /// Pictures of members are copied.
    Copying {
        copies: PictureCopies,
        solids: Box<Solids>,
        since: Instant,
    },
    Making {
        work: Running<BodyWork>,
        made_of: Box<MadeOf>,
    },
}

/// What is known of a mesh that is being made.
struct MadeOf {
    /// The members, and where they are.
    members: Vec<(Entity, Affine3A)>,
    material: StandardMaterial,
    sampler: ImageSampler,
    layers: Option<RenderLayers>,
}

/// Whether there is any group that may be one of meshes.
pub(crate) fn any_groups(groups: Query<(), Or<(With<CrackGroup>, With<Body>)>>) -> bool {
    common::any_groups(groups)
}

/// Notes groups of which some member may have moved or gone.
pub(crate) fn watch_members(
    changed: Query<&CrackMemberOf, Or<(Changed<CrackMemberOf>, Changed<GlobalTransform>)>>,
    groups: Query<Entity, (Or<(Changed<CrackGroup>, Changed<GlobalTransform>)>, With<Body>)>,
    bodies: Query<(), With<Body>>,
    mut changes: ResMut<BodyChanges>,
) {
    if !bodies.is_empty() {
        changes.0.extend(changed.iter().map(|member| member.0).filter(|group| bodies.contains(*group)));
        changes.0.extend(&groups);
    }
}

/// Goes on with all groups of meshes.
pub(crate) fn make_bodies(world: &mut World, mut found: Local<Vec<Entity>>) {
    let changes = core::mem::take(&mut world.resource_mut::<BodyChanges>().0);
    common::go_on_with_all::<Body>(world, &mut found, &changes);
}

impl Whole for Body {
    fn is_for(world: &World, group: Entity) -> bool {
        common::is_solid(world, group)
    }

    fn go_on(&mut self, world: &mut World, group: Entity, frame: &mut GroupFrame<'_>) -> Result<bool, CrackError> {
        let has_cracked = world.get::<CrackTextures>(group).is_some();
        if !has_cracked && !frame.wanted {
            self.stage = Stage::Rest;
            return Ok(!self.take_down(world, group));
        }
        self.stage = match core::mem::take(&mut self.stage) {
            Stage::Rest if !self.is_there() => self.begin(world, group)?,
            Stage::Rest => {
                if frame.has_changed {
                    self.let_go(world, group);
                }
                Stage::Rest
            }
            Stage::Copying { copies, solids, since } => copy(world, group, copies, solids, (since, &mut frame.left))?,
            Stage::Making { work, made_of } => {
                match world.resource_scope(|_, mut threads: Mut<Threads>| work.look(&mut threads, frame.timer)) {
                    News::Going(work, _) => Stage::Making { work, made_of },
                    News::Ended(made) => {
                        self.put_up(world, group, made?, *made_of);
                        Stage::Rest
                    }
                }
            }
        };
        self.replaced.hide_more(world, has_cracked);
        Ok(true)
    }

    fn rest(&mut self) {
        self.stage = Stage::Rest;
    }
}

impl Body {
    fn is_there(&self) -> bool {
        self.mesh != Handle::default()
    }

    fn begin(&mut self, world: &World, group: Entity) -> Result<Stage, CrackError> {
        let failed = |reason: &str| CrackError::Group { reason: reason.into() };
        if world.get::<Mesh3d>(group).is_some() {
            return Err(failed("the group has a mesh of its own"));
        }
        let Some(solids) = Solids::of(world, group, &EntityHashSet::default())? else { return Ok(Stage::Rest) };
        if solids.list.is_empty() {
            return Err(failed(solids.left_out.unwrap_or("none of its members shows anything")));
        }
        warn_left_out(world, group, solids.left_out, &mut self.has_warned);
        let has_threads = world.resource::<Threads>().pool().is_some();
        let pictures = solids.pictures.iter().map(|picture| picture.handle.clone()).collect();
        let images = world.get_resource::<Assets<Image>>();
        let copies = images.and_then(|images| PictureCopies::new(pictures, images, has_threads));
        let solids = Box::new(solids);
        Ok(copies.map_or(Stage::Rest, |copies| Stage::Copying { copies, solids, since: Instant::now() }))
    }

    /// Shows a mesh that was made.
    fn put_up(&mut self, world: &mut World, group: Entity, made: MadeBody, of: MadeOf) {
        let (Some(first), size) = (of.members.first(), made.unfolding.layout.size) else { return };
        let Some(mut images) = world.get_resource_mut::<Assets<Image>>() else { return };
        let mut add = |texels, format| {
            let size = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
            let mut image = Image::new(size, TextureDimension::D2, texels, format, RenderAssetUsages::default());
            image.sampler = of.sampler.clone();
            images.add(image)
        };
        let material = StandardMaterial {
            base_color_texture: Some(add(made.diffuse, TextureFormat::Rgba8UnormSrgb)),
            normal_map_texture: made.normal.map(|normal| add(normal, TextureFormat::Rgba8Unorm)),
            ..of.material
        };
        let Some(mut materials) = world.get_resource_mut::<Assets<StandardMaterial>>() else { return };
        let material = materials.add(material);
        let Some(mut meshes) = world.get_resource_mut::<Assets<Mesh>>() else { return };
        self.mesh = meshes.add(made.before);
        let lacks = (has::<NotShadowCaster>(world, first.0), has::<NotShadowReceiver>(world, first.0));
        let had = (has::<NotShadowCaster>(world, group), has::<NotShadowReceiver>(world, group));
        self.is_unshadowed = (lacks.0 && !had.0, lacks.1 && !had.1);
        unfold::give(world, group, self.mesh.clone(), made.mesh, made.unfolding);
        if let Ok(mut group) = world.get_entity_mut(group) {
            group.insert(MeshMaterial3d(material));
            self.layers.give(&mut group, of.layers);
            if self.is_unshadowed.0 {
                group.insert(NotShadowCaster);
            }
            if self.is_unshadowed.1 {
                group.insert(NotShadowReceiver);
            }
        }
        let members = of.members.into_iter().zip(made.triangles);
        self.members = members.map(|((entity, place), triangles)| Member { entity, place, triangles }).collect();
        self.replaced.become_of(world, self.members.iter().map(|member| member.entity).collect());
        self.let_go(world, group);
    }

    /// Members that have moved or gone are not shown by the group any more.
    fn let_go(&mut self, world: &mut World, group: Entity) {
        let stays = |member: &Member| {
            world.get::<CrackMemberOf>(member.entity).is_some_and(|of| of.0 == group)
                && place_in(world, group, member.entity).is_some_and(|place| is_near(place, member.place))
        };
        let (stay, gone): (Vec<_>, Vec<_>) = self.members.drain(..).partition(stays);
        self.members = stay;
        if gone.is_empty() {
            return;
        }
        let now = world.get::<Mesh3d>(group).map(|mesh| mesh.0.clone());
        if let Some(mut meshes) = world.get_resource_mut::<Assets<Mesh>>() {
            for handle in [Some(self.mesh.clone()), now.filter(|now| *now != self.mesh)].into_iter().flatten() {
                if let Some(mut mesh) = meshes.get_mut(&handle) {
                    gone.iter().for_each(|member| collapse(&mut mesh, &member.triangles));
                }
            }
        }
        self.replaced.become_of(world, self.members.iter().map(|member| member.entity).collect());
    }

    /// Shows members again, some in each frame, and then nothing of the group; whether that is done.
    fn take_down(&mut self, world: &mut World, group: Entity) -> bool {
        let is_over = self.replaced.show_more(world);
        if is_over
            && self.is_there()
            && let Ok(mut group) = world.get_entity_mut(group)
            && group.get::<Mesh3d>().is_some_and(|mesh| mesh.0 == self.mesh)
        {
            group.remove::<(Mesh3d, MeshMaterial3d<StandardMaterial>)>();
            self.layers.take_back(&mut group);
            if self.is_unshadowed.0 {
                group.remove::<NotShadowCaster>();
            }
            if self.is_unshadowed.1 {
                group.remove::<NotShadowReceiver>();
            }
        }
        is_over
    }
}

fn copy(
    world: &mut World,
    group: Entity,
    mut copies: PictureCopies,
    solids: Box<Solids>,
    (since, left): (Instant, &mut usize),
) -> Result<Stage, CrackError> {
    let Some(images) = world.get_resource::<Assets<Image>>() else { return Ok(Stage::Rest) };
    if since.elapsed() >= PATIENCE {
        copies.wait_no_more();
    }
    Ok(match copies.step(images, left) {
        CopyProgress::More => Stage::Copying { copies, solids, since },
        CopyProgress::Changed => Stage::Rest,
        CopyProgress::Done => {
            // Until its preset is there.
            let Some(order) = order(world, group)? else { return Ok(Stage::Copying { copies, solids, since }) };
            let meshes = world.get_resource::<Assets<Mesh>>();
            let read = |mesh: &Handle<Mesh>| meshes.and_then(|meshes| meshes.get(mesh)).cloned();
            let Some(meshes) = solids.list.iter().map(|solid| read(&solid.mesh)).collect() else {
                return Ok(Stage::Rest);
            };
            let axes = world.get::<GlobalTransform>(group).copied().unwrap_or_default().affine().matrix3;
            let scale = Vec3::new(axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length());
            let made_of = Box::new(MadeOf {
                members: solids.list.iter().map(|solid| (solid.entity, solid.place)).collect(),
                material: solids.material.clone(),
                sampler: solids.sampler(),
                layers: solids.layers.clone(),
            });
            let work = BodyWork::new(*solids, meshes, copies.finish(), order, scale);
            Stage::Making { work: Running::start(world.resource::<Threads>(), work), made_of }
        }
    })
}

fn has<C: Component>(world: &World, entity: Entity) -> bool {
    world.get::<C>(entity).is_some()
}

/// Whether a member is where it was, but for rounding.
fn is_near(now: Affine3A, before: Affine3A) -> bool {
    let size = before.translation.abs().max_element().max(1.0);
    now.matrix3.abs_diff_eq(before.matrix3, SLACK) && now.translation.abs_diff_eq(before.translation, SLACK * size)
}

/// Leaves nothing to be seen of some triangles, of three vertices each.
fn collapse(mesh: &mut Mesh, triangles: &Range<usize>) {
    let positions = mesh.try_attribute_mut_option(Mesh::ATTRIBUTE_POSITION);
    if let Ok(Some(VertexAttributeValues::Float32x3(positions))) = positions
        && let Some(corners) = positions.get_mut(3 * triangles.start..3 * triangles.end)
        && let Some(first) = corners.first().copied()
    {
        corners.fill(first);
    }
}
