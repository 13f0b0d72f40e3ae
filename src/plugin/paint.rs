//! The painting system: networks to texels.

use super::{
    CellClosed, CrackBudget, CrackFinished, CrackState, CrackStatus, CrackTextures, CrackTip,
    budget::{FrameClock, Timer, share_out},
    surfaces::{Active, Surfaces, Touched, batch},
    textures::{self, MAPS},
    upload::{Packer, Uploads},
};
use crate::{
    growth::CrackGrowth,
    pattern::{Moment, NO_PARENT, SegmentId},
    raster::{DOT_DEPTH, DepthField, Profile, Redrawn, TexelRect, stamp_dot, stamp_path, stamp_path_with},
};
use bevy::{ecs::system::NonSendMarker, platform::time::Instant, prelude::*};
use std::{
    sync::atomic::{AtomicU64, Ordering},
    time::Duration,
};

/// Share of the frame's budget after which nothing further is painted: the rest is for what is under way then, and for telling of it.
const BUDGET_SHARE: f32 = 0.9;

/// So many of them are painted one after the other: fewer are not worth another thread.
const SHARE: usize = 4;

/// Tiles of what hits have crushed that a surface draws in a frame at the most, however much time there is.
const CRUSHED: usize = 8;

/// Buffers kept from frame to frame.
#[derive(Default)]
pub(super) struct Scratch {
    segments: Vec<SegmentId>,
    markers: Vec<Vec2>,
    redrawn: Redrawn,
    rects: Vec<TexelRect>,
}

/// A surface that is being painted.
struct Job<'a> {
    entity: Entity,
    active: &'a mut Active,
    canvas: Canvas,
    /// What was shown before, if it has a playback.
    before: Option<Moment>,
    is_painted: bool,
}

/// Paints what has changed, some surfaces at once, at least one, until the budget is spent.
///
/// A surface has its cracks, base and textures to itself, so that it does not matter which thread paints it.
pub(super) fn paint_surfaces(
    _main_thread: NonSendMarker,
    mut commands: Commands,
    budget: Res<CrackBudget>,
    mut clock: ResMut<FrameClock>,
    mut surfaces: ResMut<Surfaces>,
    mut uploads: ResMut<Uploads>,
    images: Option<ResMut<Assets<Image>>>,
    mut states: Query<&mut CrackState>,
    mut scratch: Local<Vec<Scratch>>,
) {
    if surfaces.dirty.is_empty() {
        return;
    }
    let Some(mut images) = images else { return };
    let timer = clock.start(&budget, BUDGET_SHARE);
    let most_crushed = if budget.is_boundless() { usize::MAX } else { CRUSHED };
    let Surfaces { active, dirty, .. } = &mut *surfaces;
    let (mut left, mut behind) = (Vec::new(), Vec::new());
    while left.is_empty() && !dirty.is_empty() {
        let mut jobs: Vec<Job> = batch(active, dirty, |entity, active| Some(Job::new(entity, active, &mut images)));
        let shares = jobs.len().div_ceil(SHARE);
        let known = scratch.len().max(shares);
        scratch.resize_with(known, Scratch::default);
        // What the last one took, whoever painted it, the next one will take, about.
        let last = AtomicU64::new(0);
        uploads.pack(shares, |packers| {
            let shares = jobs.chunks_mut(SHARE).zip(&mut *scratch).zip(packers).enumerate();
            share_out(shares, |(i, ((jobs, scratch), packer))| {
                for (k, job) in jobs.iter_mut().enumerate() {
                    let expected = Duration::from_nanos(last.load(Ordering::Relaxed));
                    if (i, k) == (0, 0) || !timer.has_no_time_for(expected) {
                        let start = Instant::now();
                        job.paint(scratch, packer, most_crushed, &timer);
                        last.store(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
                    }
                }
            });
        });
        for Job { entity, active, canvas, before, is_painted } in jobs {
            canvas.put_back(&active.textures, &mut images);
            if !is_painted {
                left.push(entity);
                continue;
            }
            tell_painted(active, entity, before, &mut states, &mut commands);
            if active.field.is_behind() {
                active.is_dirty = true;
                behind.push(entity);
            }
        }
        if timer.is_over() {
            break;
        }
    }
    left.into_iter().rev().for_each(|entity| dirty.push_front(entity));
    for entity in &*dirty {
        if let Some(active) = active.get_mut(entity) {
            active.is_late = true;
        }
    }
    dirty.extend(behind);
    clock.stop(&timer);
}

impl<'a> Job<'a> {
    fn new(entity: Entity, active: &'a mut Active, images: &mut Assets<Image>) -> Self {
        let before = active.playback.as_ref().map(|playback| playback.shown);
        let canvas = Canvas::take(&active.textures, images);
        Self { entity, active, canvas, before, is_painted: false }
    }

    fn paint(&mut self, scratch: &mut Scratch, packer: &mut Packer, most_crushed: usize, timer: &Timer) {
        stamp(self.active, scratch);
        crush(self.active, scratch, most_crushed, timer);
        self.canvas.paint(self.active, packer, &mut scratch.rects);
        self.active.cells.update(self.active.growth.network());
        self.is_painted = true;
    }
}

/// Stamps what has grown since the last time into the field, or whatever is to be shown, but for what hits have [crushed](crush).
pub(super) fn stamp(active: &mut Active, scratch: &mut Scratch) {
    let moment = active.moment();
    if let Some(playback) = &mut active.playback {
        let (growth, redrawn) = (&active.growth, &mut scratch.redrawn);
        playback.replay.show_lines(&mut active.field, growth.network(), growth.timeline(), moment, redrawn);
        playback.shown = moment;
        active.touched.follow(redrawn);
        redrawn.changed.iter().for_each(|rect| active.mark(*rect));
        if !redrawn.changed.is_empty() {
            active.stamp_carried();
        }
        return;
    }
    active.growth.take_changed(&mut scratch.segments);
    for segment in scratch.segments.drain(..) {
        if let Some(path) = active.growth.network().path(segment) {
            let changed = &mut |rect| scratch.rects.push(rect);
            let rect = stamp_path_with(&mut active.field, &active.profile, &path, changed);
            active.touched.mark(rect);
        }
    }
    let timeline = active.growth.timeline();
    active.field.begin_layer(active.growth.network(), timeline, moment, &mut scratch.rects);
    scratch.rects.drain(..).for_each(|rect| active.mark(rect));
    active.growth.take_markers(&mut scratch.markers);
    let radius = active.growth.params().line_width;
    for marker in scratch.markers.drain(..) {
        let rect = stamp_dot(&mut active.field, marker, radius, DOT_DEPTH);
        active.mark(rect);
    }
}

impl Active {
    /// Finds out what a hit crushes, which counts as part of the hit. It is drawn when the surface is painted.
    pub(super) fn note_hit(&mut self) {
        if self.playback.is_none() {
            let moment = self.moment();
            self.field.follow_hits(self.growth.timeline(), moment);
        }
    }
}

/// Draws some of what hits have crushed: a tile at least if any is left, and no more than `most`.
fn crush(active: &mut Active, scratch: &mut Scratch, most: usize, timer: &Timer) {
    if active.field.is_behind() {
        let is_over = |drawn: usize| drawn == most || timer.is_over();
        (1..).find(|drawn| !active.field.crush(1, &mut scratch.rects) || is_over(*drawn));
        scratch.rects.drain(..).for_each(|rect| active.mark(rect));
    }
}

/// Clears the field and stamps the whole network anew; at another time than the end that is left to the next
/// [`paint_surfaces`].
pub(super) fn stamp_anew(active: &mut Active) {
    let frame = active.field.frame;
    active.field.clear();
    active.touched = Touched::new(frame.size());
    if let Some(frozen) = &active.frozen {
        frozen.draw(&mut active.field);
    }
    if let Some(playback) = &mut active.playback {
        playback.start_over(frame, active.profile);
        return;
    }
    stamp_all(&active.growth, &active.profile, &mut active.field, &mut active.touched);
    active.stamp_carried();
}

/// Stamps the end of a growth into an untouched field.
pub(super) fn stamp_all(growth: &CrackGrowth, profile: &Profile, field: &mut DepthField, touched: &mut Touched) {
    let (network, timeline) = (growth.network(), growth.timeline());
    let end = Moment::after(timeline.end());
    for dot in (0..).map_while(|dot| timeline.dot_at(dot, end)) {
        stamp_dot(field, dot.pos, dot.radius, DOT_DEPTH);
    }
    for segment in network.segments() {
        if let Some(path) = network.path(segment) {
            touched.mark(stamp_path(field, profile, &path));
        }
    }
    field.show_layer(network, timeline, end, &mut Vec::new());
}

/// Paints in the middle of a frame what is dirty.
pub(super) fn paint_now(world: &mut World, active: &mut Active) {
    world.resource_scope(|world, mut images: Mut<Assets<Image>>| {
        let mut canvas = Canvas::take(&active.textures, &mut images);
        world.resource_mut::<Uploads>().pack(1, |packers| {
            packers.iter_mut().for_each(|packer| canvas.paint(active, packer, &mut Vec::new()));
        });
        canvas.put_back(&active.textures, &mut images);
    });
}

/// The data of a surface's textures, out of their images: many cannot be borrowed at once.
struct Canvas([Option<Vec<u8>>; MAPS]);

impl Canvas {
    /// Texels are changed without an asset event, which would upload the whole image.
    fn take(textures: &CrackTextures, images: &mut Assets<Image>) -> Self {
        Self(textures.all().map(|texture| images.get_mut_untracked(texture?)?.data.take()))
    }

    fn put_back(self, textures: &CrackTextures, images: &mut Assets<Image>) {
        for (texture, data) in textures.all().into_iter().zip(self.0) {
            if let Some(image) = texture.and_then(|texture| images.get_mut_untracked(texture)) {
                image.data = data;
            }
        }
    }

    /// Paints the dirty texels of the view that is shown and asks for their upload.
    fn paint(&mut self, active: &mut Active, packer: &mut Packer, rects: &mut Vec<TexelRect>) {
        let size = active.base.size;
        let Some(view) = active.views.get_mut(active.view) else { return };
        view.dirty.take_rects(rects);
        if rects.is_empty() {
            return;
        }
        let origin = view.rect.min;
        let shown = TexelRect::whole(view.rect.size());
        rects.iter_mut().for_each(|rect| *rect = rect.intersect(shown));
        rects.retain(|rect| !rect.is_empty());
        let texels = self.0.each_mut().map(Option::as_deref_mut);
        textures::paint(&active.base, &active.field, &active.look, rects, origin, texels);
        for rect in rects.drain(..) {
            if let (Some(broken), [Some(diffuse), ..]) = (&active.broken, &mut self.0) {
                broken.holes.cut_out(diffuse, size, origin, rect);
            }
            let rect = TexelRect { min: rect.min + origin, max: rect.max + origin }.intersect(TexelRect::whole(size));
            let data = self.0.each_ref().map(Option::as_deref);
            let pictures = active.textures.all().into_iter().zip(data);
            packer.push(pictures.map(|(texture, data)| Some((texture?.id(), data?))), size, rect);
        }
    }
}

/// Tells what is shown of a surface that has been painted; `before` was shown before if it has a playback.
pub(super) fn tell_painted(
    active: &mut Active,
    entity: Entity,
    before: Option<Moment>,
    states: &mut Query<&mut CrackState>,
    commands: &mut Commands,
) {
    (active.is_dirty, active.is_late) = (false, false);
    active.painted += 1;
    let is_done = active.is_open && active.is_complete();
    tell_cells(active, entity, commands);
    if let Ok(mut state) = states.get_mut(entity) {
        tell(active, &mut state, before, is_done);
    }
    active.close_playback();
    if is_done {
        active.is_open = false;
        commands.trigger(CrackFinished { entity });
    }
}

/// Tells of the cells that have closed and are shown closed for the first time.
fn tell_cells(active: &mut Active, entity: Entity, commands: &mut Commands) {
    let now = active.shown().whole();
    while let Some(cell) = active.cells.cells().get(active.cells_told).filter(|cell| cell.birth <= now) {
        let uv = active.field.frame.pos_to_uv(cell.centroid);
        let frozen = active.frozen.as_ref().map_or(0, |frozen| frozen.cells);
        commands.trigger(CellClosed { entity, cell: active.cells_told as u32 + frozen, area: cell.area, uv });
        active.cells_told += 1;
    }
}

/// Writes down how the surface is doing; `before` was shown before if it has a playback.
fn tell(active: &mut Active, state: &mut CrackState, before: Option<Moment>, is_done: bool) {
    let network = active.growth.network();
    let nodes = network.nodes();
    state.damage = active.touched.share();
    state.nodes = u32::try_from(nodes.len()).unwrap_or(u32::MAX);
    state.hits = active.hits;
    let (frozen, closed) = active.frozen.as_ref().map_or((0, 0), |frozen| (frozen.nodes, frozen.cells));
    state.frozen = frozen;
    let moment = active.shown();
    // In order of birth; the first is no piece.
    let cells = active.cells.cells().get(1..).unwrap_or_default();
    state.cells = closed + cells.partition_point(|cell| cell.birth <= moment.whole()) as u32;
    state.time = moment.steps() as f32;
    state.end = active.growth.timeline().end() as f32;
    state.tips.clear();
    if is_done {
        state.status = CrackStatus::Done;
    }
    if active.is_complete() {
        // No crack is on its way.
    } else if let Some(before) = before {
        let timeline = active.growth.timeline();
        let born = if before < moment { timeline.born(before.whole(), moment.begun()) } else { 0..0 };
        let first = born.start.max(born.end.saturating_sub(CrackState::MAX_TIPS as u32));
        state.tips.extend((first..born.end).filter_map(|node| {
            // From the node it grows from to as far as it is shown.
            let way = |moment| match timeline.path_at(network, SegmentId::Branch(node), moment)?.points() {
                [from, .., to] => Some((to.pos, to.pos - from.pos)),
                _ => None,
            };
            let (tip, now) = way(moment)?;
            let length = now.length() - way(before).map_or(0.0, |(_, earlier)| earlier.length());
            let uv = active.field.frame.pos_to_uv(tip);
            Some(CrackTip { uv, direction: now.normalize_or_zero(), length: length.max(0.0) })
        }));
    } else {
        let first = active.tips_from.max(nodes.len().saturating_sub(CrackState::MAX_TIPS)).min(nodes.len());
        state.tips.extend(nodes[first..].iter().filter(|node| node.parent != NO_PARENT).map(|node| {
            let way = node.pos - nodes[node.parent as usize].pos;
            let uv = active.field.frame.pos_to_uv(node.pos);
            CrackTip { uv, direction: way.normalize_or_zero(), length: way.length() }
        }));
    }
    active.tips_from = nodes.len();
}
