//! What a task makes of an analogy: the texels around cracks that are new.

use crate::Grid;
use crate::paint::analogy::{Analogy, AnalogyError};
use crate::plugin::api::{AnalogyExamples, CrackError};
use crate::plugin::jobs::stepped::{Step, Stepped};
use crate::plugin::source::analogy::AnalogyPicture;
use crate::plugin::source::picture::BasePicture;
use crate::raster::{DirtyTiles, TexelRect};
use bevy::prelude::*;
use std::{any::Any, sync::Arc};

/// Texels that are visited in a step, a fraction of a millisecond, and those of a patch.
const SLICE: u64 = 1 << 12;
const PATCH: u64 = 1 << 14;

/// So many texels beside a crack count as cracked: one that widens is not painted as a new one along its edges.
const EDGE: u32 = 2;

/// What an analogy is made from.
#[derive(Clone)]
pub(crate) struct AnalogyWish {
    pub(crate) examples: AnalogyExamples,
    pub(crate) keeps_picture: bool,
    pub(crate) seed: u64,
    pub(crate) base: Arc<BasePicture>,
    /// The part of the image that is shown.
    pub(crate) rect: TexelRect,
}

impl PartialEq for AnalogyWish {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.examples.0, &other.examples.0)
            && (self.keeps_picture, self.seed, self.rect) == (other.keeps_picture, other.seed, other.rect)
            && Arc::ptr_eq(&self.base, &other.base)
    }
}

impl AnalogyWish {
    /// Whether normals are carried over.
    pub(super) fn has_normals(&self) -> bool {
        !self.examples.0.normals.is_empty()
    }

    fn begin(&self, depth: &Grid<u16>) -> Result<Analogy, AnalogyError> {
        let set = &self.examples.0;
        let examples = if self.keeps_picture {
            let picture: Arc<dyn Any + Send + Sync> = self.base.clone();
            set.with_picture(&picture, self.rect, || self.own_texels())?
        } else {
            set.examples.clone()
        };
        Analogy::new(examples, depth, &[], self.seed)
    }

    /// The part of its picture that a surface shows.
    fn own_texels(&self) -> Vec<u8> {
        let rows = self.rect.min.y..self.rect.max.y;
        rows.flat_map(|y| self.row(&self.base.diffuse, self.rect.min.x, self.rect.size().x, y)).copied().collect()
    }

    /// Texels of a row of the image, four bytes each.
    fn row<'a>(&self, texels: &'a [u8], x: u32, width: u32, y: u32) -> &'a [u8] {
        let start = 4 * (y as usize * self.base.size.x as usize + x as usize);
        texels.get(start..start + 4 * width as usize).unwrap_or_default()
    }
}

/// Texels of a rectangle that a task has made.
pub(super) struct MadePatch {
    pub(super) rect: TexelRect,
    /// RGBA8, sRGB.
    pub(super) diffuse: Vec<u8>,
    /// RGBA8, linear; empty if none are carried over.
    pub(super) normal: Vec<u8>,
    pub(super) depth: Vec<u16>,
}

/// What comes of the work.
pub(super) struct Made {
    pub(super) analogy: Box<Analogy>,
    /// The depths that it has taken over.
    pub(super) depth: Grid<u16>,
    pub(super) patches: Vec<MadePatch>,
    /// The whole picture, if there was none, with what is in the patches.
    pub(super) picture: Option<AnalogyPicture>,
}

/// The making of an analogy, or of what is new of it.
pub(super) struct AnalogyWork {
    wish: AnalogyWish,
    analogy: Option<Box<Analogy>>,
    depth: Grid<u16>,
    /// Where depths have changed.
    changed: Vec<TexelRect>,
    has_begun: bool,
    /// Whether the surface has a picture that shows an analogy.
    has_picture: bool,
}

impl AnalogyWork {
    /// `analogy` = `None`: all of it.
    pub(super) fn new(
        wish: AnalogyWish,
        analogy: Option<Box<Analogy>>,
        depth: Grid<u16>,
        changed: Vec<TexelRect>,
        has_picture: bool,
    ) -> Self {
        Self { wish, analogy, depth, changed, has_begun: false, has_picture }
    }

    fn finish(self, mut analogy: Box<Analogy>) -> Made {
        let mut tiles = DirtyTiles::new(analogy.size());
        analogy.take_changed().iter().for_each(|rect| tiles.mark(*rect));
        self.changed.iter().for_each(|rect| tiles.mark(rect.grow(EDGE, analogy.size())));
        let mut rects = Vec::new();
        tiles.take_rects(&mut rects);
        let patches: Vec<_> = rects.into_iter().flat_map(bands).filter_map(|rect| self.patch(&analogy, rect)).collect();
        let picture = (!self.has_picture).then(|| {
            let mut picture = untouched(&self.wish);
            patches.iter().for_each(|patch| picture.put(patch, &self.wish));
            picture
        });
        Made { analogy, depth: self.depth, patches, picture }
    }

    /// `None` if it is as the surface's own picture and need not be told.
    fn patch(&self, analogy: &Analogy, rect: TexelRect) -> Option<MadePatch> {
        let area = rect.area() as usize;
        let (mut diffuse, mut depth) = (Vec::with_capacity(4 * area), Vec::with_capacity(area));
        let near = self.wish.keeps_picture.then(|| near_cracks(analogy, rect));
        let mut is_own = true;
        for y in rect.min.y..rect.max.y {
            let (left, top) = (self.wish.rect.min.x + rect.min.x, self.wish.rect.min.y + y);
            let base = self.wish.row(&self.wish.base.diffuse, left, rect.size().x, top);
            let start = diffuse.len();
            for (x, own) in (rect.min.x..rect.max.x).zip(base.as_chunks::<4>().0) {
                let [red, green, blue, _] = analogy.color(x, y);
                let is_made = self.is_made(analogy, near.as_ref(), rect, [x, y]);
                diffuse.extend(if is_made { [red, green, blue, own[3]] } else { *own });
            }
            is_own &= diffuse.get(start..) == Some(base);
            depth.extend((rect.min.x..rect.max.x).map(|x| deepest(&self.depth, x, y)));
        }
        is_own &= depth.iter().all(|depth| *depth == 0);
        // Texels that are those of the surface's own picture are there.
        if is_own && !self.has_picture {
            return None;
        }
        let normal = if self.wish.has_normals() { self.normals(analogy, rect, near.as_ref()) } else { Vec::new() };
        Some(MadePatch { rect, diffuse, normal, depth })
    }

    /// Whether a texel comes from a photograph. All others are those of the surface's own picture, in their own places: what is
    /// copied from elsewhere in it would be seen to have moved.
    fn is_made(&self, analogy: &Analogy, near: Option<&Grid<bool>>, rect: TexelRect, [x, y]: [u32; 2]) -> bool {
        near.is_none_or(|near| {
            near.get(x - rect.min.x, y - rect.min.y) == Some(true)
                && analogy.source(x, y).is_some_and(|source| source.pair > 0)
        })
    }

    /// Normals from where the colours come from.
    fn normals(&self, analogy: &Analogy, rect: TexelRect, near: Option<&Grid<bool>>) -> Vec<u8> {
        const FLAT: [u8; 4] = [128, 128, 255, 255];
        let maps = &self.wish.examples.0.normals;
        let own = |x: u32, y: u32| {
            let (normal, at) = (self.wish.base.normal.as_deref()?, self.wish.rect.min + UVec2::new(x, y));
            self.wish.row(normal, at.x, 1, at.y).first_chunk().copied()
        };
        let mut normals = Vec::with_capacity(4 * rect.area() as usize);
        for (x, y) in (rect.min.y..rect.max.y).flat_map(|y| (rect.min.x..rect.max.x).map(move |x| (x, y))) {
            let source = analogy.source(x, y).map(|source| (usize::from(source.pair), source.texel.map(u32::from)));
            let normal = match source {
                _ if !self.is_made(analogy, near, rect, [x, y]) => own(x, y),
                Some((pair, [x, y])) => {
                    let map = maps.get(pair.saturating_sub(usize::from(self.wish.keeps_picture)));
                    map.and_then(|map| map.get(x, y))
                }
                None => None,
            };
            normals.extend(normal.unwrap_or(FLAT));
        }
        normals
    }
}

/// The picture of a surface that has no cracks of photographs yet.
fn untouched(wish: &AnalogyWish) -> AnalogyPicture {
    let (base, params) = (&wish.base, wish.examples.params());
    let normal = || base.normal.clone().unwrap_or_else(|| [128, 128, 255, 255].repeat(base.area()));
    AnalogyPicture {
        diffuse: base.diffuse.clone(),
        normal: wish.has_normals().then(normal),
        depth: Grid::new(wish.rect.size(), 0),
        least: ((params.depth * 65535.0) as u16).max(1),
    }
}

impl AnalogyPicture {
    /// Takes a patch over.
    pub(super) fn put(&mut self, patch: &MadePatch, wish: &AnalogyWish) {
        let (rect, width) = (patch.rect, patch.rect.size().x as usize);
        let own = self.normal.as_mut();
        let maps = [Some((&mut self.diffuse, &patch.diffuse)), own.map(|normal| (normal, &patch.normal))];
        for (to, from) in maps.into_iter().flatten() {
            for (from, y) in from.chunks_exact(4 * width).zip(rect.min.y..) {
                let at = wish.rect.min + UVec2::new(rect.min.x, y);
                let start = 4 * (at.y as usize * wish.base.size.x as usize + at.x as usize);
                if let Some(to) = to.get_mut(start..start + from.len()) {
                    to.copy_from_slice(from);
                }
            }
        }
        for (from, y) in patch.depth.chunks_exact(width).zip(rect.min.y as usize..) {
            let to = &mut self.depth.row_mut(y)[rect.min.x as usize..rect.max.x as usize];
            to.copy_from_slice(from);
        }
    }
}

/// The greatest depth around a texel.
fn deepest(depth: &Grid<u16>, x: u32, y: u32) -> u16 {
    let around = |at: u32, most: usize| at.saturating_sub(EDGE) as usize..most.min((at + EDGE) as usize + 1);
    let rows = around(y, depth.height()).map(|y| &depth.row(y)[around(x, depth.width())]);
    rows.flatten().copied().max().unwrap_or(0)
}

/// The texels of a rectangle that a crack may have changed. All others are those of the surface's own picture, also where
/// there was a crack.
fn near_cracks(analogy: &Analogy, rect: TexelRect) -> Grid<bool> {
    let margin = analogy.examples().params().margin;
    let around = TexelRect { min: rect.min.saturating_sub(UVec2::splat(margin)), max: rect.max + margin };
    let size = rect.size();
    let mut near = Grid::new(size, false);
    // How many more rows a column is near a crack.
    let mut left = vec![0; size.x as usize];
    for y in around.min.y..around.max.y {
        let mut last = None;
        for x in around.min.x..around.max.x {
            if analogy.is_near_crack(x, y) {
                last = Some(x);
            }
            // The texel whose surroundings end here.
            let column = x.checked_sub(margin + rect.min.x).filter(|column| *column < size.x);
            if let Some(column) = column
                && last.is_some_and(|last| last + 2 * margin >= x)
            {
                left[column as usize] = 2 * margin + 1;
            }
        }
        let row = y.checked_sub(margin + rect.min.y).filter(|row| *row < size.y);
        for (column, left) in left.iter_mut().enumerate() {
            if let Some(row) = row {
                near.row_mut(row as usize)[column] = *left > 0;
            }
            *left = left.saturating_sub(1);
        }
    }
    near
}

/// A rectangle in parts of few texels, or a row.
fn bands(rect: TexelRect) -> impl Iterator<Item = TexelRect> {
    let rows = (PATCH / u64::from(rect.size().x.max(1))).max(1);
    (rect.min.y..rect.max.y).step_by(rows as usize).map(move |y| TexelRect {
        min: UVec2::new(rect.min.x, y),
        max: UVec2::new(rect.max.x, rect.max.y.min(y.saturating_add(rows as u32))),
    })
}

impl Stepped for AnalogyWork {
    type Output = Box<Made>;

    fn step(mut self) -> Result<Step<Self>, CrackError> {
        let mut analogy = match self.analogy.take() {
            Some(mut analogy) => {
                if !core::mem::replace(&mut self.has_begun, true) {
                    analogy.update(&self.depth, &self.changed)?;
                }
                analogy
            }
            None => {
                self.has_begun = true;
                Box::new(self.wish.begin(&self.depth)?)
            }
        };
        Ok(if analogy.step(SLICE) {
            self.analogy = Some(analogy);
            Step::More(self)
        } else {
            Step::Done(Box::new(self.finish(analogy)))
        })
    }

    fn progress(&self) -> f32 {
        self.analogy.as_ref().filter(|_| self.has_begun).map_or(0.0, |analogy| analogy.progress())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;
    use crate::paint::analogy::{AnalogyPair, AnalogyParams, Examples};

    #[test]
    fn near_cracks_is_what_a_search_finds() {
        let photo: Vec<u8> =
            (0..1024).flat_map(|i| if i % 32 == 12 { [0, 0, 0, 255] } else { [200, 200, 200, 255] }).collect();
        let pair = AnalogyPair::from_darkness(UVec2::splat(32), &photo, 0.2).expect("it has a crack");
        let params = AnalogyParams { reach: 3, margin: 4, levels: 1, ..AnalogyParams::DEFAULT };
        let examples = Arc::new(Examples::new(&[pair], &params).expect("they are valid"));
        let mut rng = Rng::new(7);
        for case in 0..20 {
            let size = UVec2::new(1 + rng.next_u32() % 70, 1 + rng.next_u32() % 70);
            let mut depth = Grid::new(size, 0);
            for _ in 0..case % 5 {
                depth.row_mut((rng.next_u32() % size.y) as usize)[(rng.next_u32() % size.x) as usize] = u16::MAX;
            }
            let mut analogy = Analogy::new(examples.clone(), &depth, &[], 1).expect("it is valid");
            analogy.finish();
            let min = UVec2::new(rng.next_u32() % size.x, rng.next_u32() % size.y);
            let rect = TexelRect { min, max: min + 1 + UVec2::splat(rng.next_u32() % 30) };
            let rect = rect.intersect(TexelRect::whole(size));
            let near = near_cracks(&analogy, rect);
            for (x, y) in (rect.min.y..rect.max.y).flat_map(|y| (rect.min.x..rect.max.x).map(move |x| (x, y))) {
                let rows = y.saturating_sub(4)..y + 5;
                let is_near =
                    rows.into_iter().any(|y| (x.saturating_sub(4)..x + 5).any(|x| analogy.is_near_crack(x, y)));
                assert_eq!(near.get(x - rect.min.x, y - rect.min.y), Some(is_near), "case {case}: {x}, {y}");
            }
        }
    }
}
