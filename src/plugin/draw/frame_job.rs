//! One moment of a surface, or all of it again, drawn and painted by a background task.

use crate::growth::CrackGrowth;
use crate::paint::LookTable;
use crate::pattern::{CrackMask, Moment, Network, Timeline};
use crate::plugin::api::textures::MAPS;
use crate::plugin::gpu::buffer::{Staged, Stager};
use crate::plugin::gpu::textures;
use crate::plugin::source::analogy::AnalogyPicture;
use crate::plugin::source::picture::BasePicture;
use crate::plugin::surface::cutouts::Holes;
use crate::plugin::surface::drawing::Frozen;
use crate::plugin::surface::motion::MotionFrame;
use crate::plugin::surface::stamp::stamp_hairlines;
use crate::plugin::surface::tile_set::Touched;
use crate::raster::{DepthField, DirtyTiles, LayerPlan, Profile, Replay, ReplayChanges, TexelRect};
use bevy::prelude::*;
use std::sync::Arc;

/// Texels that are painted in a slice, and segments that are looked at: well below a millisecond.
pub(crate) const SLICE: u64 = 1 << 14;

const SEGMENTS: usize = 256;

/// Lines of cracks that were carried on which are drawn in a slice.
const LINES: usize = 16;

/// Parts of a side, each with one rectangle to upload at the most.
const PARTS: u32 = 8;

/// A network and its past, as they were when they were copied.
pub(crate) struct TimelineSnapshot {
    network: Network,
    timeline: Timeline,
}

impl TimelineSnapshot {
    pub(crate) fn of(growth: &CrackGrowth) -> Arc<Self> {
        Arc::new(Self { network: growth.network().clone(), timeline: growth.timeline().clone() })
    }

    pub(crate) fn is_of(&self, growth: &CrackGrowth) -> bool {
        // Nothing is ever changed but by an entry more.
        self.timeline.entries(u32::MAX) == growth.timeline().entries(u32::MAX)
    }
}

/// The texels that were shown before those that are.
pub(crate) struct Back {
    pub(crate) texels: [Option<Vec<u8>>; MAPS],
    /// Texels of the field that have changed since.
    pub(crate) behind: Vec<TexelRect>,
}

/// A moment as a machine that is stepped, with all that it takes out of the surface meanwhile.
pub(crate) struct FrameJob {
    pub(crate) timeline: Arc<TimelineSnapshot>,
    pub(crate) moment: Moment,
    pub(crate) base: Arc<BasePicture>,
    pub(crate) analogy: Option<Arc<AnalogyPicture>>,
    pub(crate) look: LookTable,
    /// Which textures there are, and the part of them that is shown.
    pub(crate) maps: [bool; MAPS],
    pub(crate) has_mips: bool,
    pub(crate) rect: TexelRect,
    pub(crate) stager: Option<Stager>,
    pub(crate) field: DepthField,
    /// What a field is made for, if there is none yet.
    pub(crate) ground: Option<(Arc<CrackMask>, LayerPlan)>,
    /// `None` if the field is as it is to be, and only painted.
    pub(crate) replay: Option<Replay>,
    pub(crate) profile: Profile,
    /// Whether all is drawn anew, as for another profile.
    pub(crate) is_anew: bool,
    /// What lies below the cracks, and above them: lines of this width.
    pub(crate) frozen: Option<Frozen>,
    pub(crate) carried: (Vec<Arc<[Vec<Vec2>]>>, f32),
    /// The texels that have left with shards.
    pub(crate) holes: Option<Holes>,
    /// If the cracks are on their way to where they stay.
    pub(crate) motion: Option<MotionFrame>,
    pub(crate) touched: Touched,
    pub(crate) back: Option<Back>,
    /// What is not as the textures show it.
    pub(crate) dirty: DirtyTiles,
    pub(crate) redrawn: ReplayChanges,
    pub(crate) stage: Stage,
    /// The same when it is made: texels of the field.
    pub(crate) changed: Vec<TexelRect>,
    pub(crate) staged: [Option<Staged>; MAPS],
}

pub(crate) enum Stage {
    /// As it was.
    Begin,
    /// There is nothing in the field.
    Cleared,
    Draw,
    /// What hits have crushed is being drawn.
    Crush,
    /// So many lines of those that were carried on are drawn.
    Carry(usize),
    /// What is left to paint.
    Paint(Vec<TexelRect>),
    Made,
}

impl FrameJob {
    pub(crate) fn finish(mut self: Box<Self>) -> Box<Self> {
        while !self.step() {}
        self
    }

    /// Whether the field is neither as it was nor as it will be.
    pub(crate) const fn is_half_drawn(&self) -> bool {
        matches!(self.stage, Stage::Cleared | Stage::Draw | Stage::Crush | Stage::Carry(_))
    }

    /// A slice of the work; says whether it was the last one.
    pub(crate) fn step(&mut self) -> bool {
        let snapshot = self.timeline.clone();
        let TimelineSnapshot { network, timeline } = &*snapshot;
        match &mut self.stage {
            Stage::Begin if self.is_anew => {
                self.clear();
                self.stage = Stage::Cleared;
            }
            Stage::Begin | Stage::Cleared => {
                self.stage = if self.draw_motion() {
                    Stage::Crush
                } else if let Some(replay) = &mut self.replay {
                    replay.begin(&mut self.field, network, timeline, self.moment, &mut self.redrawn);
                    if let Some(frozen) = &self.frozen {
                        frozen.draw(&mut self.field);
                    }
                    Stage::Draw
                } else {
                    Stage::Paint(self.plan())
                };
            }
            Stage::Draw => {
                if let Some(replay) = &mut self.replay
                    && replay.draw(&mut self.field, network, timeline, SEGMENTS, &mut self.redrawn)
                {
                    replay.end(&mut self.field, network, timeline, &mut self.redrawn);
                    self.stage = Stage::Crush;
                }
            }
            Stage::Crush => {
                if !self.field.crush(1, &mut self.redrawn.changed) {
                    let is_any = !self.carried.0.is_empty();
                    self.stage = if is_any { Stage::Carry(0) } else { Stage::Paint(self.plan()) };
                }
            }
            Stage::Carry(drawn) => {
                let first = core::mem::replace(drawn, *drawn + LINES);
                if !self.carry(first) {
                    self.stage = Stage::Paint(self.plan());
                }
            }
            Stage::Paint(rects) => {
                let mut slice = Vec::new();
                let mut area = 0;
                while let Some(rect) = rects.pop_if(|rect| area == 0 || area + rect.area() <= SLICE) {
                    area += rect.area();
                    slice.push(rect);
                }
                self.paint(&slice);
                if area == 0 {
                    self.stage();
                    self.stage = Stage::Made;
                }
            }
            Stage::Made => {}
        }
        matches!(self.stage, Stage::Made)
    }

    /// Makes the field what it was before there was anything to draw.
    fn clear(&mut self) {
        let (frame, size) = (self.field.frame, self.field.frame.size());
        match self.ground.take() {
            Some((mask, layers)) => {
                self.field = DepthField::new(frame);
                self.field.set_forbidden(&mask);
                self.field.set_layers(layers);
            }
            None => self.field.clear(),
        }
        self.touched = Touched::new(size);
        self.replay = Some(Replay::new(size, self.profile));
    }

    /// Draws some of the lines that were carried on, from this one on; returns whether there were any.
    fn carry(&mut self, first: usize) -> bool {
        let Self { carried: (carried, width), field, profile, redrawn, .. } = self;
        let mut lines = carried.iter().flat_map(|lines| lines.iter()).skip(first).take(LINES).peekable();
        let is_any = lines.peek().is_some();
        for line in lines {
            stamp_hairlines(field, profile, *width, core::slice::from_ref(line), |rect| redrawn.changed.push(rect));
        }
        is_any
    }

    /// Draws cracks that are on their way; returns whether they are.
    fn draw_motion(&mut self) -> bool {
        let Self { motion, profile, field, touched, replay, redrawn, .. } = self;
        if !motion.as_ref().is_some_and(|motion| motion.draw(profile, field, touched)) {
            return false;
        }
        let size = field.frame.size();
        *replay = Some(Replay::stale(size, *profile));
        *redrawn = ReplayChanges { changed: vec![TexelRect::whole(size)], ..ReplayChanges::default() };
        true
    }

    /// Finds out what is to be painted.
    fn plan(&mut self) -> Vec<TexelRect> {
        let Self { redrawn, touched, dirty, field, look, .. } = self;
        touched.follow(redrawn);
        redrawn.changed.iter().for_each(|rect| dirty.mark(look.affected(*rect, &field.depth)));
        self.changed.clear();
        dirty.take_rects(&mut self.changed);
        let mut rects = Vec::new();
        match &self.back {
            Some(back) => {
                self.changed.iter().chain(&back.behind).for_each(|rect| dirty.mark(*rect));
                dirty.take_rects(&mut rects);
            }
            None => {
                let mut kinds = textures::KINDS.iter().zip(self.maps);
                let texels = [(); MAPS].map(|()| {
                    let (kind, _) = kinds.next().filter(|(_, is_wanted)| *is_wanted)?;
                    Some(kind.texels(&self.base, self.has_mips))
                });
                self.back = Some(Back { texels, behind: Vec::new() });
                rects.push(TexelRect::whole(field.frame.size()));
            }
        }
        let shown = TexelRect::whole(self.rect.size());
        rects.into_iter().flat_map(|rect| bands(rect.intersect(shown))).collect()
    }

    fn paint(&mut self, rects: &[TexelRect]) {
        let Some(back) = &mut self.back else { return };
        let texels = back.texels.each_mut().map(Option::as_deref_mut);
        let (size, origin) = (self.base.size, self.rect.min);
        textures::paint(&self.base, self.analogy.as_deref(), &self.field, &self.look, rects, origin, texels);
        if let (Some(holes), [Some(diffuse), ..]) = (&self.holes, &mut back.texels) {
            rects.iter().for_each(|rect| holes.cut_out(diffuse, size, origin, *rect));
        }
        textures::update_mips(&mut back.texels, size, rects, origin);
    }

    /// Brings what has changed to where the renderer can read it.
    fn stage(&mut self) {
        let (Some(stager), Some(back)) = (&self.stager, &self.back) else { return };
        let rects = self.in_image(&gather(&self.changed, self.field.frame.size()));
        let mut kinds = textures::KINDS.iter();
        self.staged = back.texels.each_ref().map(|texels| {
            let kind = kinds.next()?;
            stager.stage(texels.as_ref()?, kind.levels(self.base.size), &rects)
        });
    }

    /// Rectangles of the field in the image.
    pub(crate) fn in_image(&self, rects: &[TexelRect]) -> Vec<TexelRect> {
        let (origin, shown) = (self.rect.min, TexelRect::whole(self.rect.size()));
        let rects = rects.iter().map(|rect| rect.intersect(shown)).filter(|rect| !rect.is_empty());
        rects.map(|rect| TexelRect { min: rect.min + origin, max: rect.max + origin }).collect()
    }
}

/// A rectangle in parts of no more than a slice, or a row.
fn bands(rect: TexelRect) -> impl Iterator<Item = TexelRect> {
    let rows = (SLICE / u64::from(rect.size().x.max(1))).max(1);
    (rect.min.y..rect.max.y).step_by(rows as usize).map(move |y| TexelRect {
        min: UVec2::new(rect.min.x, y),
        max: UVec2::new(rect.max.x, rect.max.y.min(y + rows as u32)),
    })
}

/// Few rectangles around all of these: each costs a copy of its own, and the thread of the frames orders them.
pub(crate) fn gather(rects: &[TexelRect], size: UVec2) -> Vec<TexelRect> {
    let side = (size / PARTS + 1).max(UVec2::ONE);
    let mut parts = vec![TexelRect::default(); (PARTS * PARTS) as usize];
    for rect in rects.iter().filter(|rect| !rect.is_empty()) {
        let (first, last) = (rect.min / side, (rect.max - 1) / side);
        for y in first.y..=last.y {
            for x in first.x..=last.x {
                let min = UVec2::new(x, y) * side;
                if let Some(part) = parts.get_mut((y * PARTS + x) as usize) {
                    *part = part.union(rect.intersect(TexelRect { min, max: min + side }));
                }
            }
        }
    }
    // Those beside one another together, unless that is much more.
    let mut gathered = Vec::<TexelRect>::new();
    for row in parts.chunks(PARTS as usize) {
        let mut before = TexelRect::default();
        for part in row.iter().filter(|part| !part.is_empty()) {
            let both = before.union(*part);
            if !before.is_empty() && 4 * both.area() <= 5 * (before.area() + part.area()) {
                before = both;
                gathered.pop();
            } else {
                before = *part;
            }
            gathered.push(before);
        }
    }
    gathered
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    fn random_rects(rng: &mut Rng, size: UVec2) -> Vec<TexelRect> {
        let mut corner = || UVec2::new(rng.next_u32() % size.x, rng.next_u32() % size.y);
        let rect = |(a, b): (UVec2, UVec2)| TexelRect { min: a.min(b), max: a.max(b) + 1 };
        (0..6).map(|_| rect((corner(), corner()))).collect()
    }

    #[test]
    fn few_rectangles_hold_them_all() {
        let mut rng = Rng::new(8);
        for size in [[1, 1], [7, 300], [64, 64], [1000, 700]].map(UVec2::from) {
            for n in 0..7 {
                let rects = random_rects(&mut rng, size).split_off(n.min(6));
                let gathered = gather(&rects, size);
                assert!(gathered.len() <= 64);
                let of = |rects: &[TexelRect]| -> Vec<bool> {
                    let at = |i: u32| UVec2::new(i % size.x, i / size.x);
                    let is_in = |at: UVec2, r: &TexelRect| at.cmpge(r.min).all() && at.cmplt(r.max).all();
                    (0..size.element_product()).map(|i| rects.iter().any(|r| is_in(at(i), r))).collect()
                };
                let (wanted, got) = (of(&rects), of(&gathered));
                assert!(wanted.iter().zip(&got).all(|(wanted, got)| got >= wanted), "{rects:?} {gathered:?}");
                let area: u64 = gathered.iter().map(|rect| rect.area()).sum();
                assert_eq!(area, got.iter().filter(|is| **is).count() as u64, "each texel once");
            }
        }
    }

    #[test]
    fn bands_are_the_rectangle() {
        for size in [[1, 40_000], [40_000, 3], [500, 333]].map(UVec2::from) {
            let rect = TexelRect { min: UVec2::new(3, 5), max: UVec2::new(3, 5) + size };
            let mut y = rect.min.y;
            for band in bands(rect) {
                assert!(band.min == UVec2::new(3, y) && band.max.x == rect.max.x && !band.is_empty());
                assert!(band.area() <= SLICE || band.size().y == 1);
                y = band.max.y;
            }
            assert_eq!(y, rect.max.y);
        }
        assert_eq!(bands(TexelRect::default()).count(), 0);
    }
}
