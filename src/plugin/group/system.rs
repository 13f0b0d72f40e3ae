//! When the picture of a group is made, and shown in place of its members.

use super::common::{self, GroupFrame, Whole, warn_left_out};
use super::hide::{GivenLayers, Replaced};
use super::members::Members;
use super::wall::{WallFrame, WallWork};
use crate::plugin::api::{CrackError, CrackGroup, CrackMemberOf, CrackTextures};
use crate::plugin::jobs::background::PATIENCE;
use crate::plugin::jobs::copy::{CopyProgress, PictureCopies};
use crate::plugin::jobs::stepped::{News, Running};
use crate::plugin::jobs::threads::Threads;
use bevy::{
    asset::RenderAssetUsages,
    ecs::entity::EntityHashSet,
    platform::time::Instant,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
    sprite::Anchor,
};

/// Frames between two pictures of a group whose members change.
const PAUSE: u32 = 8;

/// Groups of which some member has changed.
#[derive(Resource, Default)]
pub(crate) struct GroupChanges(EntityHashSet);

/// The picture of a group.
#[derive(Component, Default)]
#[component(clone_behavior = Ignore)]
pub(crate) struct Wall {
    stage: Stage,
    /// Where it lies. It stays until the group is healed.
    frame: Option<WallFrame>,
    picture: Handle<Image>,
    /// What it shows.
    shown: Members,
    /// Members that have left it.
    gone: EntityHashSet,
    /// Members that lie within it.
    within: Replaced,
    layers: GivenLayers,
    /// Whether members have changed since it was made.
    is_stale: bool,
    /// For how many frames it is not made again.
    pause: u32,
    has_warned: bool,
}

#[derive(Default)]
enum Stage {
    /// Nothing is being made.
    #[default]
    Rest,
    /// Pictures of members are copied.
    Copying {
        copies: PictureCopies,
        members: Box<Members>,
        since: Instant,
    },
    Making(Running<WallWork>, Box<Members>),
}

/// What a member may show, and how.
type ChangedMember = Or<(
    Changed<CrackMemberOf>,
    Changed<GlobalTransform>,
    Changed<Sprite>,
    Changed<Anchor>,
    Changed<bevy::sprite_render::TilemapChunk>,
    Changed<bevy::sprite_render::TilemapChunkTileData>,
)>;

/// Notes groups of which some member has changed.
pub(crate) fn watch_members(
    changed: Query<&CrackMemberOf, ChangedMember>,
    groups: Query<Entity, (Changed<CrackGroup>, With<Wall>)>,
    walls: Query<(Entity, &Wall)>,
    images: Option<MessageReader<AssetEvent<Image>>>,
    mut changes: ResMut<GroupChanges>,
) {
    if walls.is_empty() {
        if let Some(mut images) = images {
            images.clear();
        }
        return;
    }
    changes.0.extend(changed.iter().map(|member| member.0).filter(|group| walls.contains(*group)));
    changes.0.extend(&groups);
    let Some(mut images) = images else { return };
    for event in images.read() {
        if let AssetEvent::Modified { id } | AssetEvent::Added { id } = event {
            let shows = |(_, wall): &(Entity, &Wall)| wall.shown.pictures.iter().any(|picture| picture.id() == *id);
            changes.0.extend(walls.iter().filter(shows).map(|(group, _)| group));
        }
    }
}

/// Whether there is any group.
pub(crate) fn any_groups(groups: Query<(), Or<(With<CrackGroup>, With<Wall>)>>) -> bool {
    common::any_groups(groups)
}

/// Goes on with all groups of sprites and tile maps.
pub(crate) fn make_walls(world: &mut World, mut found: Local<Vec<Entity>>) {
    let changes = core::mem::take(&mut world.resource_mut::<GroupChanges>().0);
    common::go_on_with_all::<Wall>(world, &mut found, &changes);
}

impl Whole for Wall {
    fn is_for(world: &World, group: Entity) -> bool {
        !common::is_solid(world, group)
    }

    fn go_on(&mut self, world: &mut World, group: Entity, frame: &mut GroupFrame<'_>) -> Result<bool, CrackError> {
        let has_cracked = world.get::<CrackTextures>(group).is_some();
        if !has_cracked && !frame.wanted {
            self.stage = Stage::Rest;
            return Ok(!self.take_down(world, group));
        }
        self.is_stale |= frame.has_changed;
        self.pause = self.pause.saturating_sub(1);
        self.stage = match core::mem::take(&mut self.stage) {
            Stage::Rest if !self.is_there() => self.begin(world, group)?,
            Stage::Rest if self.is_stale && self.pause == 0 => self.begin_again(world, group)?,
            Stage::Rest => Stage::Rest,
            Stage::Copying { copies, members, since } => self.copy(world, copies, members, since, &mut frame.left),
            Stage::Making(running, members) => {
                match world.resource_scope(|_, mut threads: Mut<Threads>| running.look(&mut threads, frame.timer)) {
                    News::Going(running, _) => Stage::Making(running, members),
                    News::Ended(texels) => {
                        self.put_up(world, group, texels?, *members);
                        Stage::Rest
                    }
                }
            }
        };
        self.within.hide_more(world, has_cracked);
        Ok(true)
    }

    fn rest(&mut self) {
        self.stage = Stage::Rest;
    }
}

impl Wall {
    /// Whether there is a picture.
    fn is_there(&self) -> bool {
        self.picture != Handle::default()
    }

    /// The first picture.
    fn begin(&mut self, world: &World, group: Entity) -> Result<Stage, CrackError> {
        let failed = |reason: &str| CrackError::Group { reason: reason.into() };
        if world.get::<Sprite>(group).is_some() {
            return Err(failed("the group has a sprite of its own"));
        }
        self.is_stale = false;
        let Some(members) = Members::of(world, group, &self.gone)? else { return Ok(Stage::Rest) };
        let frame = WallFrame::around(&members.tiles());
        self.frame = frame;
        if frame.is_none() {
            return Err(failed(members.left_out.unwrap_or("none of its members shows anything")));
        }
        warn_left_out(world, group, members.left_out, &mut self.has_warned);
        Ok(start_copying(world, members))
    }

    /// Another picture, if other members, or the same, show something else.
    fn begin_again(&mut self, world: &mut World, group: Entity) -> Result<Stage, CrackError> {
        let Some(members) = Members::of(world, group, &self.gone)? else { return Ok(Stage::Rest) };
        self.is_stale = false;
        let moved = members.moved(&self.shown);
        if !moved.is_empty() {
            self.gone.extend(&moved);
            self.is_stale = true;
            return Ok(Stage::Rest);
        }
        Ok(if members.shows_the_same(&self.shown) { Stage::Rest } else { start_copying(world, members) })
    }

    fn copy(
        &self,
        world: &World,
        mut copies: PictureCopies,
        members: Box<Members>,
        since: Instant,
        left: &mut usize,
    ) -> Stage {
        let (Some(images), Some(frame)) = (world.get_resource::<Assets<Image>>(), self.frame) else {
            return Stage::Rest;
        };
        if since.elapsed() >= PATIENCE {
            copies.wait_no_more();
        }
        match copies.step(images, left) {
            CopyProgress::More => Stage::Copying { copies, members, since },
            CopyProgress::Changed => Stage::Rest,
            CopyProgress::Done => {
                let work = WallWork::new(frame, members.within(&frame).0, copies.finish());
                Stage::Making(Running::start(world.resource::<Threads>(), work), members)
            }
        }
    }

    /// Shows a picture that was made.
    fn put_up(&mut self, world: &mut World, group: Entity, texels: Vec<u8>, members: Members) {
        let Some(frame) = self.frame else { return };
        let (_, within) = members.within(&frame);
        if within.len() < members.list.len() {
            let reason = "it lies outside of the rectangle that has cracked";
            warn_left_out(world, group, Some(reason), &mut self.has_warned);
        }
        let Some(mut images) = world.get_resource_mut::<Assets<Image>>() else { return };
        let size = Extent3d { width: frame.size.x, height: frame.size.y, depth_or_array_layers: 1 };
        let usage = RenderAssetUsages::default();
        let mut image = Image::new(size, TextureDimension::D2, texels, TextureFormat::Rgba8UnormSrgb, usage);
        image.sampler = members.sampler.clone();
        if self.is_there() {
            let is_other = images.get(&self.picture).is_none_or(|before| before.data != image.data);
            if is_other {
                _ = images.insert(&self.picture, image);
            }
        } else {
            self.picture = images.add(image);
            let extent = frame.extent();
            let sprite = Sprite { image: self.picture.clone(), custom_size: Some(extent), ..Sprite::default() };
            if let Ok(mut group) = world.get_entity_mut(group) {
                group.insert((sprite, Anchor(-frame.center() / extent)));
                self.layers.give(&mut group, members.layers.clone());
            }
        }
        self.within.become_of(world, within);
        (self.shown, self.pause) = (members, PAUSE);
    }

    /// Shows members again, some in each frame, and then nothing of the group; whether that is done.
    fn take_down(&mut self, world: &mut World, group: Entity) -> bool {
        let is_over = self.within.show_more(world);
        if is_over
            && self.is_there()
            && let Ok(mut group) = world.get_entity_mut(group)
            && group.get::<Sprite>().is_some_and(|sprite| sprite.image == self.picture)
        {
            group.remove::<(Sprite, Anchor)>();
            self.layers.take_back(&mut group);
        }
        is_over
    }
}

/// Begins to copy the pictures of members.
fn start_copying(world: &World, members: Members) -> Stage {
    let has_threads = world.resource::<Threads>().pool().is_some();
    let images = world.get_resource::<Assets<Image>>();
    let copies = images.and_then(|images| PictureCopies::new(members.pictures.clone(), images, has_threads));
    let members = Box::new(members);
    copies.map_or(Stage::Rest, |copies| Stage::Copying { copies, members, since: Instant::now() })
}
