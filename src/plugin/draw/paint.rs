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
use crate::plugin::surface::canvas::{Canvas, View};
use crate::plugin::surface::cracked::{CrackedSurfaces, batch};
use crate::plugin::surface::cracks::Cracks;
use crate::plugin::surface::queues::Queues;
use crate::plugin::surface::stamp::{Scratch, stamp_some};
use crate::raster::{DirtyTiles, TexelRect};
use bevy::{ecs::system::NonSendMarker, platform::time::Instant, prelude::*};
use std::{
    sync::atomic::{AtomicU64, Ordering},
    time::Duration,
};

/// Share of the frame's budget after which nothing more is painted: the rest is for what is under way then, and for reporting it.
const BUDGET_SHARE: f32 = 0.7;

/// Surfaces that one thread paints, one after the other: fewer are not worth another thread.
const SHARE: usize = 4;

/// Parts of what hits have crushed, of one hit on one tile each, that a surface draws in a frame at the most, however much time there is.
const CRUSHED: usize = 8;

/// Texels that are painted between two looks at the frame's clock: so many at least, once painting has begun.
const SLICE: u32 = 4096;

/// Nodes and links that are searched for closed cells between two looks at it.
const NODES: usize = 64;

/// Dirty tiles that are made into rectangles at once, where a frame may not paint all of them.
const BAND: usize = 512;

/// A surface that is being painted.
struct PaintJob<'a> {
    entity: Entity,
    active: &'a mut Active,
    texels: Texels,
    /// What was shown before, if it has a playback.
    before: Option<Moment>,
    painted: Painted,
}

/// How far the painting of a surface has come in a frame.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Painted {
    /// Its turn has not come.
    Nothing,
    /// There was no time for all of it.
    Partly,
    /// All of what has grown since.
    Wholly,
    /// The rest of what earlier frames had no time for, but not what has come since.
    Earlier,
}

/// Paints what has changed, some surfaces at once, at least a part of one, until the budget is spent. What is left of a surface is painted in
/// the next frames, before anything else of it changes.
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
        for PaintJob { entity, active, texels, before, painted } in jobs {
            texels.put_back(&active.canvas.textures, &mut images);
            if matches!(painted, Painted::Nothing | Painted::Partly) {
                left.push(entity);
                continue;
            }
            if painted == Painted::Earlier && (active.turn.has_news || active.drawing.field.is_behind()) {
                active.turn.is_late = false;
                behind.push(entity);
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
        Self { entity, active, texels, before, painted: Painted::Nothing }
    }

    fn paint(&mut self, scratch: &mut Scratch, packer: &mut Packer, most_crushed: usize, timer: &Timer) {
        // Without a limit nothing is put off.
        let may_wait = most_crushed < usize::MAX && self.active.may_be_partly_painted();
        if !may_wait {
            self.active.cracks.finish_step();
        }
        let goes_on = may_wait && self.active.is_partly_painted() && !self.active.turn.is_stamping;
        if !goes_on {
            self.active.turn.has_news = false;
            if !stamp_some(self.active, scratch, || may_wait && timer.is_over()) {
                self.painted = Painted::Partly;
                return;
            }
            crush(self.active, scratch, most_crushed, timer);
            let Cracks { growth, cells, .. } = &mut self.active.cracks;
            // Cells close in the order of whole steps.
            while !growth.is_in_step() && !cells.update_some(growth.network(), NODES) {
                if may_wait && timer.is_over() {
                    self.active.turn.is_stamping = true;
                    self.painted = Painted::Partly;
                    return;
                }
            }
        }
        self.painted = Painted::Wholly;
        let Some(view) = self.active.canvas.views.get_mut(self.active.canvas.view) else { return };
        if !may_wait {
            view.join_rest();
        }
        let tiles = if may_wait { BAND } else { usize::MAX };
        self.texels.paint(self.active, packer, &mut scratch.rects, (tiles, || may_wait && timer.is_over()));
        if self.active.is_partly_painted() {
            self.painted = Painted::Partly;
        } else if goes_on {
            self.painted = Painted::Earlier;
        }
    }
}

/// Draws some of what hits have crushed: a part at least if any is left, and no more than `most`.
fn crush(active: &mut Active, scratch: &mut Scratch, most: usize, timer: &Timer) {
    if active.drawing.field.is_behind() {
        let is_over = |drawn: usize| drawn == most || timer.is_over();
        (1..).find(|drawn| !active.drawing.field.crush(1, &mut scratch.rects) || is_over(*drawn));
        scratch.rects.drain(..).for_each(|rect| active.mark_grown(rect));
    }
}

/// Paints in the middle of a frame what is dirty.
pub(crate) fn paint_now(world: &mut World, active: &mut Active) {
    world.resource_scope(|world, mut images: Mut<Assets<Image>>| {
        let mut texels = Texels::take(&active.canvas.textures, &mut images);
        active.canvas.views.get_mut(active.canvas.view).map(View::join_rest);
        world.resource_mut::<Uploads>().pack(1, |packers| {
            for packer in packers {
                texels.paint(active, packer, &mut Vec::new(), (usize::MAX, || false));
            }
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

    /// Paints the dirty texels of the view that is shown and asks for their upload, those first that are left over. `tiles` is about how many dirty tiles
    /// are made into rectangles at once. What there is no time for is left over again.
    fn paint(
        &mut self,
        active: &mut Active,
        packer: &mut Packer,
        rects: &mut Vec<TexelRect>,
        (tiles, is_over): (usize, impl Fn() -> bool),
    ) {
        let size = active.canvas.base.size;
        let index = active.canvas.view;
        let Some(view) = active.canvas.views.get_mut(index) else { return };
        let (origin, shown) = (view.rect.min, TexelRect::whole(view.rect.size()));
        if view.rest.is_empty() {
            core::mem::swap(&mut view.rest, &mut view.dirty);
        }
        let (mut slice, mut texels) = (Vec::new(), 0);
        while let Some(view) = active.canvas.views.get_mut(index) {
            if rects.is_empty() {
                view.rest.take_some_rects(tiles, rects);
                rects.iter_mut().for_each(|rect| *rect = rect.intersect(shown));
                // Taken from the end.
                rects.reverse();
            }
            let Some(rect) = rects.pop() else { break };
            let (now, later) = split(rect, SLICE - texels);
            rects.extend(later);
            if !now.is_empty() {
                slice.push(now);
                texels += now.size().element_product();
            }
            if texels < SLICE && !rects.is_empty() {
                continue;
            }
            self.paint_rects(active, packer, &slice, (size, origin));
            slice.clear();
            texels = 0;
            if is_over() {
                break;
            }
        }
        if let Some(view) = active.canvas.views.get_mut(index) {
            rects.drain(..).for_each(|rect| view.rest.mark(rect));
        }
    }

    /// Paints some rectangles of the field, whose top left is at `origin` of an image of `size`.
    fn paint_rects(
        &mut self,
        active: &Active,
        packer: &mut Packer,
        rects: &[TexelRect],
        (size, origin): (UVec2, UVec2),
    ) {
        let texels = self.0.each_mut().map(Option::as_deref_mut);
        let Canvas { base, analogy, look, .. } = &active.canvas;
        textures::paint(base, analogy.as_deref(), &active.drawing.field, look, rects, origin, texels);
        for &rect in rects {
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

/// The first rows of a rectangle with at least so many texels, or all of them, and the rest.
fn split(rect: TexelRect, texels: u32) -> (TexelRect, Option<TexelRect>) {
    let rows = texels.div_ceil(rect.size().x.max(1)).next_multiple_of(DirtyTiles::TILE);
    let line = rect.min.y.saturating_add(rows);
    if line >= rect.max.y {
        return (rect, None);
    }
    let max = UVec2::new(rect.max.x, line);
    (TexelRect { max, ..rect }, Some(TexelRect { min: UVec2::new(rect.min.x, line), ..rect }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CrackPreset;
    use crate::plugin::headless::{app, blank, shown};
    use crate::plugin::prelude::*;
    use crate::plugin::surface::cracked::active;
    use bevy::time::TimeUpdateStrategy;

    /// Texels that are still to be painted.
    fn unpainted(app: &App, entity: Entity) -> u64 {
        let mut rects = Vec::new();
        for view in active(app.world(), entity).iter().flat_map(|active| &active.canvas.views) {
            view.dirty.clone().take_rects(&mut rects);
            view.rest.clone().take_rects(&mut rects);
        }
        rects.iter().map(TexelRect::area).sum()
    }

    /// Rectangles are split into rows of whole tiles, and nothing is lost.
    #[test]
    fn rectangles_are_split_without_rest() {
        for (size, texels) in [([1, 1], 1), ([8, 8], 8192), ([512, 512], 8192), ([9000, 70], 8192), ([3, 5000], 100)] {
            let whole = TexelRect { min: UVec2::new(16, 24), max: UVec2::from(size) + UVec2::new(16, 24) };
            let (mut rest, mut parts) = (Some(whole), Vec::new());
            while let Some(rect) = rest {
                let (part, later) = split(rect, texels);
                assert!(later.is_none_or(|later| later.min.y == part.max.y && later.max == whole.max));
                let is_enough = later.is_none() || part.area() >= u64::from(texels);
                assert!(is_enough && part.area() <= u64::from(texels + 8 * part.size().x), "{part:?}");
                parts.push(part);
                rest = later;
            }
            assert_eq!(parts.iter().map(TexelRect::area).sum::<u64>(), whole.area(), "{size:?}");
        }
    }

    /// With no time at all a large surface is painted in parts, over some frames, in which it does not grow. What it shows in the end is what frames
    /// without a limit show.
    #[test]
    fn large_surfaces_are_painted_in_parts() {
        let play = |milliseconds: f32| {
            let mut app = app(CrackBudget { milliseconds, ..default() });
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(50)));
            let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::splat(600)));
            let surface = CrackSurface::new(CrackPreset::CLAY).with_seed(4);
            let entity = app.world_mut().spawn((Sprite::from_image(image), surface)).id();
            app.world_mut().trigger(CrackHit::uv(entity, Vec2::splat(0.4)).with_energy(2.0));
            let mut parts = 0;
            for frame in 0.. {
                let before = active(app.world(), entity).map(|active| {
                    let steps = active.cracks.growth.steps_made();
                    (active.is_partly_painted(), steps, active.turn.is_stamping, unpainted(&app, entity))
                });
                app.update();
                if let (Some((true, steps, is_stamping, texels)), Some(now)) = (before, active(app.world(), entity)) {
                    parts += 1;
                    assert_eq!(now.cracks.growth.steps_made(), steps, "it grows in frame {frame}");
                    assert!(is_stamping || unpainted(&app, entity) < texels, "nothing was painted in frame {frame}");
                }
                let state = app.world().get::<CrackState>(entity);
                if state.is_some_and(|state| state.status == CrackStatus::Done) {
                    break;
                }
                assert!(frame < 20_000, "it never ends");
            }
            (0..4).for_each(|_| app.update());
            assert_eq!(unpainted(&app, entity), 0);
            (parts, shown(&app, entity))
        };
        let (parts, at_once) = play(1e6);
        assert_eq!(parts, 0);
        let (parts, in_parts) = play(0.0);
        assert!(parts > 20, "only {parts} frames had a part to paint");
        assert!(at_once == in_parts);
    }
}
