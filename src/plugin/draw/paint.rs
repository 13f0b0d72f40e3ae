//! The painting system: networks to texels.

use super::report::report_painted;
use crate::pattern::Moment;
use crate::plugin::api::textures::MAPS;
use crate::plugin::api::{CrackBudget, CrackState, CrackTextures};
use crate::plugin::gpu::pack::Packer;
use crate::plugin::gpu::textures;
use crate::plugin::gpu::uploads::Uploads;
use crate::plugin::jobs::frame_time::{FrameClock, Timer, par_for_each};
use crate::plugin::surface::active::Active;
use crate::plugin::surface::canvas::Canvas;
use crate::plugin::surface::cracked::{CrackedSurfaces, batch};
use crate::plugin::surface::queues::Queues;
use crate::plugin::surface::stamp::{Scratch, stamp};
use crate::raster::TexelRect;
use bevy::{ecs::system::NonSendMarker, platform::time::Instant, prelude::*};
use std::{
    sync::atomic::{AtomicU64, Ordering},
    time::Duration,
};

/// Share of the frame's budget after which nothing more is painted: the rest is for what is under way then, and for reporting it.
const BUDGET_SHARE: f32 = 0.9;

/// Surfaces that one thread paints, one after the other: fewer are not worth another thread.
const SHARE: usize = 4;

/// Tiles of what hits have crushed that a surface draws in a frame at the most, however much time there is.
const CRUSHED: usize = 8;

/// A surface that is being painted.
struct PaintJob<'a> {
    entity: Entity,
    active: &'a mut Active,
    texels: Texels,
    /// What was shown before, if it has a playback.
    before: Option<Moment>,
    is_painted: bool,
}

/// Paints what has changed, some surfaces at once, at least one, until the budget is spent.
///
/// A surface has its cracks, base and textures to itself, so that it does not matter which thread paints it.
pub(crate) fn paint_surfaces(
    _main_thread: NonSendMarker,
    mut commands: Commands,
    budget: Res<CrackBudget>,
    mut clock: ResMut<FrameClock>,
    mut queues: ResMut<Queues>,
    mut surfaces: CrackedSurfaces,
    mut uploads: ResMut<Uploads>,
    images: Option<ResMut<Assets<Image>>>,
    mut states: Query<&mut CrackState>,
    mut scratch: Local<Vec<Scratch>>,
) {
    if queues.dirty.is_empty() {
        return;
    }
    let Some(mut images) = images else { return };
    let timer = clock.start(&budget, BUDGET_SHARE);
    let most_crushed = if budget.is_unlimited() { usize::MAX } else { CRUSHED };
    let Queues { dirty, blending, .. } = &mut *queues;
    let (mut left, mut behind) = (Vec::new(), Vec::new());
    while left.is_empty() && !dirty.is_empty() {
        let mut jobs: Vec<PaintJob> =
            batch(&mut surfaces, dirty, |entity, active| Some(PaintJob::new(entity, active, &mut images)));
        let shares = jobs.len().div_ceil(SHARE);
        let known = scratch.len().max(shares);
        scratch.resize_with(known, Scratch::default);
        // What the last one took, the next one will take, about.
        let last = AtomicU64::new(0);
        uploads.pack(shares, |packers| {
            let shares = jobs.chunks_mut(SHARE).zip(&mut *scratch).zip(packers).enumerate();
            par_for_each(shares, |(i, ((jobs, scratch), packer))| {
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
        for PaintJob { entity, active, texels, before, is_painted } in jobs {
            texels.put_back(&active.canvas.textures, &mut images);
            if !is_painted {
                left.push(entity);
                continue;
            }
            report_painted(active, entity, before, &mut states, &mut commands);
            if active.has_normals_to_blend() && !core::mem::replace(&mut active.turn.is_blending, true) {
                blending.push_back(entity);
            }
            if active.drawing.field.is_behind() {
                active.turn.is_dirty = true;
                behind.push(entity);
            }
        }
        if timer.is_over() {
            break;
        }
    }
    left.into_iter().rev().for_each(|entity| dirty.push_front(entity));
    for entity in &*dirty {
        if let Ok((_, mut cracked)) = surfaces.get_mut(*entity)
            && let Some(active) = cracked.get_mut()
        {
            active.turn.is_late = true;
        }
    }
    dirty.extend(behind);
    clock.stop(&timer);
}

impl<'a> PaintJob<'a> {
    fn new(entity: Entity, active: &'a mut Active, images: &mut Assets<Image>) -> Self {
        let before = active.playhead.playback.as_ref().map(|playback| playback.shown);
        let texels = Texels::take(&active.canvas.textures, images);
        Self { entity, active, texels, before, is_painted: false }
    }

    fn paint(&mut self, scratch: &mut Scratch, packer: &mut Packer, most_crushed: usize, timer: &Timer) {
        stamp(self.active, scratch);
        crush(self.active, scratch, most_crushed, timer);
        self.texels.paint(self.active, packer, &mut scratch.rects);
        self.active.cracks.cells.update(self.active.cracks.growth.network());
        self.is_painted = true;
    }
}

/// Draws some of what hits have crushed: a tile at least if any is left, and no more than `most`.
fn crush(active: &mut Active, scratch: &mut Scratch, most: usize, timer: &Timer) {
    if active.drawing.field.is_behind() {
        let is_over = |drawn: usize| drawn == most || timer.is_over();
        (1..).find(|drawn| !active.drawing.field.crush(1, &mut scratch.rects) || is_over(*drawn));
        scratch.rects.drain(..).for_each(|rect| active.mark(rect));
    }
}

/// Paints in the middle of a frame what is dirty.
pub(crate) fn paint_now(world: &mut World, active: &mut Active) {
    world.resource_scope(|world, mut images: Mut<Assets<Image>>| {
        let mut texels = Texels::take(&active.canvas.textures, &mut images);
        world.resource_mut::<Uploads>().pack(1, |packers| {
            packers.iter_mut().for_each(|packer| texels.paint(active, packer, &mut Vec::new()));
        });
        texels.put_back(&active.canvas.textures, &mut images);
    });
}

/// The data of a surface's textures, out of their images: many cannot be borrowed at once.
struct Texels([Option<Vec<u8>>; MAPS]);

impl Texels {
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
        let size = active.canvas.base.size;
        let Some(view) = active.canvas.views.get_mut(active.canvas.view) else { return };
        view.dirty.take_rects(rects);
        if rects.is_empty() {
            return;
        }
        let origin = view.rect.min;
        let shown = TexelRect::whole(view.rect.size());
        rects.iter_mut().for_each(|rect| *rect = rect.intersect(shown));
        rects.retain(|rect| !rect.is_empty());
        let texels = self.0.each_mut().map(Option::as_deref_mut);
        let Canvas { base, analogy, look, .. } = &active.canvas;
        textures::paint(base, analogy.as_deref(), &active.drawing.field, look, rects, origin, texels);
        for rect in rects.drain(..) {
            if let (Some(holes), [Some(diffuse), ..]) = (&active.drawing.cutouts, &mut self.0) {
                holes.cut_out(diffuse, size, origin, rect);
            }
            let rect = TexelRect { min: rect.min + origin, max: rect.max + origin }.intersect(TexelRect::whole(size));
            let data = self.0.each_ref().map(Option::as_deref);
            let pictures = active.canvas.textures.all().into_iter().zip(data).zip(&textures::KINDS);
            let pictures = pictures.map(|((texture, data), kind)| Some((texture?.id(), data?, kind.texel())));
            packer.push(pictures, size, rect);
        }
    }
}
