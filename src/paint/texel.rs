//! The loops over texels.
//!
//! A rectangle is painted in patches. If the depth field is untouched in a patch, the base is copied. Else the slopes
//! of the whole patch are computed at once and used for diffuse and normal. Diffuse is painted in blocks, and
//! untouched blocks are copied. Patches and blocks affect only the speed: every texel depends on its own 3 x 3 depths,
//! on those that cast shadows on it, and on the base. Sums of integers that cannot overflow use wrapping addition, because an overflow check per texel
//! would cost more than the sum.

use super::{
    LookTable,
    diffuse::{Frame, diffuse_patch},
    extras::Extras,
    patch::{BLOCK, Patch, ShownCracks},
    rows::{Rgba, corrected_row, depth_row, flat_row, level_row, tilted_row, whiteout_row},
    shades::reduce_shades,
};
use crate::{
    blend::{BlendError, NormalBlending, solve_correction},
    math::vectorized,
    raster::{DepthField, SlopeCorrection, TexelRect},
};
use glam::UVec2;
use std::{ops::Range, sync::Arc};

/// The untouched picture. All slices are row-major and cover the whole image of `size` texels.
#[derive(Clone, Copy, Debug)]
pub struct BaseTexels<'a> {
    /// Size of the image.
    pub size: UVec2,
    /// RGBA8, sRGB.
    pub diffuse: &'a [u8],
    /// RGBA8 tangent-space normals, linear, +Y up; `None` = flat.
    pub normal: Option<&'a [u8]>,
    /// R8 depth, 255 = bottom; `None` = 0 everywhere.
    pub depth: Option<&'a [u8]>,
}

/// The images to paint. Slices are like those of [`BaseTexels`], of the same size; `None` = not painted.
#[derive(Debug)]
pub struct PaintTargets<'a> {
    /// RGBA8, sRGB.
    pub diffuse: Option<&'a mut [u8]>,
    /// RGBA8 tangent-space normals, linear, +Y up.
    pub normal: Option<&'a mut [u8]>,
    /// R8 depth, 255 = bottom.
    pub depth: Option<&'a mut [u8]>,
}

/// The normal of a flat surface.
pub(super) const FLAT: Rgba = [128, 128, 255, 255];

/// Width of the widest patch.
const WIDE: usize = 64;

/// Buffer sizes for the depths of a patch, of the texels around it, and of those that the last block may read beyond:
/// one for most dirty rectangles, one for larger ones.
const LITTLE: usize = 360;
const MUCH: usize = 800;

/// Texels in a cache line.
const CACHE_LINE: usize = 64 / size_of::<Rgba>();

/// The largest number of texels that are prefetched before painting: they stay in the cache until then.
const MAX_FETCHED: u64 = 1 << 13;

/// Paints the texels `rect` of `field`. `origin` is the top left of the field in the image (of an atlas frame; else
/// zero).
///
/// `rect` is in texels of the field and is clipped to it; texels of the field outside the image are skipped. Target
/// slices that are shorter than `size` requires are left unchanged, and so is a target whose base slice is too short.
pub fn paint_into(
    base: BaseTexels<'_>,
    field: &DepthField,
    look: &LookTable,
    rect: TexelRect,
    origin: UVec2,
    targets: &mut PaintTargets<'_>,
) {
    paint_rects(base, field, look, &[rect], origin, targets);
}

/// Like [`paint_rects`] over a base that shows cracks already: of the field only what is deeper there, and was less
/// than a crack, is painted, so that new cracks show until the base has them as well. Crushed zones, plates and veils
/// are painted as ever. `shown` that does not have the size of the field counts as nothing.
///
/// ```
/// use bevy_crack::{
///     Grid,
///     paint::{BaseTexels, Look, LookTable, PaintTargets, ShownCracks, paint_new},
///     pattern::SurfaceFrame,
///     raster::{DepthField, TexelRect},
/// };
/// use glam::UVec2;
///
/// let size = UVec2::splat(16);
/// let mut field = DepthField::new(SurfaceFrame::new(size)?);
/// field.depth.row_mut(3).fill(60_000);
/// let mut shown = Grid::new(size, 0);
/// shown.row_mut(3)[..8].fill(60_000);
/// let look = LookTable::new(&Look::GROOVE, field.frame.texels_per_unit())?;
/// let base = BaseTexels { size, diffuse: &[200; 4 * 256], normal: None, depth: None };
/// let mut painted = vec![0; 4 * 256];
/// let mut targets = PaintTargets { diffuse: Some(&mut painted), normal: None, depth: None };
/// let shown = ShownCracks { depth: &shown, least: 10_000 };
/// paint_new(base, shown, &field, &look, &[TexelRect::whole(size)], UVec2::ZERO, &mut targets);
/// let texel = |x: usize| painted[4 * (3 * 16 + x)];
/// assert_eq!(texel(2), 200, "the base shows that crack");
/// assert!(texel(12) < 200, "this one is new");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn paint_new(
    base: BaseTexels<'_>,
    shown: ShownCracks<'_>,
    field: &DepthField,
    look: &LookTable,
    rects: &[TexelRect],
    origin: UVec2,
    targets: &mut PaintTargets<'_>,
) {
    let shown = Some(shown).filter(|shown| shown.depth.size() == field.depth.size());
    paint_over(base, shown, field, look, rects, origin, targets);
}

/// Like [`paint_into`] for several rectangles. It takes less time where they are small and the memory is not in the
/// cache.
pub fn paint_rects(
    base: BaseTexels<'_>,
    field: &DepthField,
    look: &LookTable,
    rects: &[TexelRect],
    origin: UVec2,
    targets: &mut PaintTargets<'_>,
) {
    paint_over(base, None, field, look, rects, origin, targets);
}

fn paint_over(
    base: BaseTexels<'_>,
    shown: Option<ShownCracks<'_>>,
    field: &DepthField,
    look: &LookTable,
    rects: &[TexelRect],
    origin: UVec2,
    targets: &mut PaintTargets<'_>,
) {
    // The part of the field that lies in the image.
    let visible = field.depth.size().min(base.size.saturating_sub(origin));
    let rects = rects.iter().map(|rect| rect.intersect(TexelRect::whole(visible))).filter(|rect| !rect.is_empty());
    let Some(texels) = (base.size.x as usize).checked_mul(base.size.y as usize) else { return };
    let diffuse = base.diffuse.as_chunks().0;
    let mut diffuse_out = targets.diffuse.as_deref_mut().map(|out| out.as_chunks_mut().0);
    diffuse_out.take_if(|out| out.len() < texels || diffuse.len() < texels);

    let normal = base.normal.map(|base| base.as_chunks().0);
    let mut normal_out = targets.normal.as_deref_mut().map(|out| out.as_chunks_mut().0);
    normal_out.take_if(|out| out.len() < texels || normal.is_some_and(|base| base.len() < texels));

    let mut depth_out = targets.depth.as_deref_mut();
    depth_out.take_if(|out| out.len() < texels || base.depth.is_some_and(|base| base.len() < texels));

    let mut job = Job {
        frame: Frame { base: diffuse, stride: base.size.x as usize, origin, size: visible, depths: &field.depth },
        field,
        look,
        shown,
        // It is that of all cracks.
        correction: field
            .correction()
            .map(Arc::as_ref)
            .filter(|_| look.normals == NormalBlending::Poisson && shown.is_none()),
        normal,
        depth: base.depth,
        diffuse_out,
        normal_out,
        depth_out,
    };
    let (mut most, mut all) = (0, 0);
    for rect in rects.clone() {
        let around = rect.size() + 2;
        most = most.max(around.x as usize * around.y as usize + BLOCK);
        all += rect.area();
    }
    if all <= MAX_FETCHED {
        job.fetch(rects.clone());
    }
    if most <= LITTLE {
        job.paint::<LITTLE>(rects);
    } else {
        job.paint::<MUCH>(rects);
    }
}

/// Makes the normals of a field and a base those of one surface, for a look with [`NormalBlending::Poisson`]: solves
/// for the slopes that its picture needs, keeps them in the field, and returns rectangles around the texels that are to
/// be painted for it. `origin` is as for [`paint_into`].
///
/// It is meant for cracks at rest. Painting without it, and with what was solved for earlier depths, is defined as well:
/// a texel then depends on its own 3 x 3 depths, the base and the slopes that the field holds. After it the painted
/// normals are a function of the base, the depths and the look only, in whatever order the cracks have grown and
/// rectangles have been painted. [`solve_correction`] tells which rectangle is solved and what holds around it. A base
/// without normals, or without texels of the field, needs no correction.
///
/// # Errors
/// Those of [`solve_correction`]; the field is unchanged then.
///
/// ```
/// use bevy_crack::{
///     blend::NormalBlending,
///     paint::{BaseTexels, Look, LookTable, PaintTargets, correct_normals, paint_into, paint_rects},
///     pattern::{PathPoint, SegmentPath, SurfaceFrame},
///     raster::{DepthField, Profile, TexelRect, stamp_path},
/// };
/// use glam::UVec2;
///
/// let size = UVec2::splat(64);
/// let mut field = DepthField::new(SurfaceFrame::new(size)?);
/// let [from, to] = [0.2, 0.8].map(|x| PathPoint { pos: [x, 0.5].into(), width: 0.1 });
/// stamp_path(&mut field, &Profile::DEFAULT, &SegmentPath::straight(from, to));
///
/// let slope = [170, 128, 240, 255].repeat(64 * 64);
/// let base = BaseTexels { size, diffuse: &[], normal: Some(&slope), depth: None };
/// let look = Look { normals: NormalBlending::Poisson, ..Look::GROOVE };
/// let look = LookTable::new(&look, field.frame.texels_per_unit())?;
/// let mut painted = slope.clone();
/// let mut targets = PaintTargets { diffuse: None, normal: Some(&mut painted), depth: None };
/// paint_into(base, &field, &look, TexelRect::whole(size), UVec2::ZERO, &mut targets);
///
/// let changed = correct_normals(base, &mut field, UVec2::ZERO)?;
/// assert!(!changed.is_empty());
/// paint_rects(base, &field, &look, &changed, UVec2::ZERO, &mut targets);
/// assert_eq!(correct_normals(base, &mut field, UVec2::ZERO)?, [], "it is at rest");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn correct_normals(
    base: BaseTexels<'_>,
    field: &mut DepthField,
    origin: UVec2,
) -> Result<Vec<TexelRect>, BlendError> {
    let solved = match base.normal {
        Some(normals) => solve_correction(normals, base.size, origin, &field.depth)?,
        None => None,
    };
    let changed = SlopeCorrection::changes(field.correction().map(Arc::as_ref), solved.as_ref(), field.depth.size());
    field.correct(solved.map(Arc::new));
    Ok(changed)
}

/// The checked arguments of [`paint_into`].
struct Job<'a> {
    frame: Frame<'a>,
    field: &'a DepthField,
    look: &'a LookTable,
    /// Cracks that are not painted.
    shown: Option<ShownCracks<'a>>,
    /// Slopes that are added to the base, where it is untouched as well.
    correction: Option<&'a SlopeCorrection>,
    normal: Option<&'a [Rgba]>,
    depth: Option<&'a [u8]>,
    diffuse_out: Option<&'a mut [Rgba]>,
    normal_out: Option<&'a mut [Rgba]>,
    depth_out: Option<&'a mut [u8]>,
}

impl Job<'_> {
    fn paint<const ROOM: usize>(&mut self, rects: impl Iterator<Item = TexelRect>) {
        let mut patch = Patch::EMPTY;
        let mut extras = Extras::of(self.field, self.look);
        rects.for_each(|rect| self.paint_rect::<ROOM>(rect, &mut patch, &mut extras));
    }

    fn paint_rect<const ROOM: usize>(
        &mut self,
        rect: TexelRect,
        patch: &mut Patch<ROOM>,
        extras: &mut Option<Extras<'_, ROOM>>,
    ) {
        let size = rect.size();
        let width = size.x.min(WIDE as u32);
        // A patch has two rows and columns more than are painted; the buffer suffices for at least one row.
        let height = ((ROOM - BLOCK) as u32 / (width + 2) - 2).min(size.y);
        for y in (rect.min.y..rect.max.y).step_by(height as usize) {
            for x in (rect.min.x..rect.max.x).step_by(WIDE) {
                let min = UVec2::new(x, y);
                let part = TexelRect { min, max: (min + UVec2::new(width, height)).min(rect.max) };
                let mut is_touched = patch.load(&self.field.depth, part);
                if let Some(shown) = self.shown.filter(|_| is_touched) {
                    is_touched = patch.leave_out(&shown, part);
                }
                let extras = extras.as_mut().filter(|extras| extras.touches(part));
                if is_touched || extras.is_some() {
                    self.paint_patch(patch, extras, part);
                } else {
                    self.restore(part);
                }
            }
        }
    }

    /// The texels of row `y` of a rectangle, in the slices.
    fn range(&self, rect: TexelRect, y: u32) -> Range<usize> {
        let first = self.frame.index(rect.min.x, y);
        first..first + rect.size().x as usize
    }

    /// Copies the base to texels that are untouched, and adds the correction of its normals.
    fn restore(&mut self, rect: TexelRect) {
        let corrected = self.correction.filter(|correction| !correction.rect().intersect(rect).is_empty());
        let mut steps = [[0; 2]; WIDE];
        for y in rect.min.y..rect.max.y {
            let range = self.range(rect, y);
            if let Some(out) = &mut self.diffuse_out {
                out[range.clone()].copy_from_slice(&self.frame.base[range.clone()]);
            }
            if let Some(out) = &mut self.normal_out {
                let out = &mut out[range.clone()];
                match (self.normal, corrected) {
                    (Some(base), Some(correction)) => {
                        correction.read_row(rect.min.x, y, &mut steps[..out.len()]);
                        level_row(out, &base[range.clone()], &steps);
                    }
                    (Some(base), None) => out.copy_from_slice(&base[range.clone()]),
                    (None, _) => out.fill(FLAT),
                }
            }
            if let Some(out) = &mut self.depth_out {
                match self.depth {
                    Some(base) => out[range.clone()].copy_from_slice(&base[range]),
                    None => out[range].fill(0),
                }
            }
        }
    }

    /// Reads one texel of each cache line that will be read or written: independent reads, so that the latency of
    /// cold memory overlaps instead of adding up texel by texel. The tighter the loop, the more reads are in flight.
    fn fetch(&self, rects: impl Iterator<Item = TexelRect>) {
        let (diffuse, normal) = (self.diffuse_out.as_deref(), self.normal_out.as_deref());
        let picture = diffuse.map(|_| self.frame.base);
        let Some(any) = picture.or(normal) else { return };
        let all = [picture, diffuse, normal.and(self.normal), normal].map(|texels| texels.unwrap_or(any));
        let mut sum = 0;
        for rect in rects {
            for y in rect.min.y..rect.max.y {
                let range = self.range(rect, y);
                let [a, b, c, d] = all.map(|texels| &texels[range.clone()]);
                let last = a.len() - 1;
                let mut at = 0;
                while at < last {
                    sum ^= a[at][0] ^ b[at][0] ^ c[at][0] ^ d[at][0];
                    at += CACHE_LINE;
                }
                sum ^= a[last][0] ^ b[last][0] ^ c[last][0] ^ d[last][0];
            }
        }
        std::hint::black_box(sum);
    }

    fn paint_patch<const ROOM: usize>(
        &mut self,
        patch: &mut Patch<ROOM>,
        extras: Option<&mut Extras<'_, ROOM>>,
        rect: TexelRect,
    ) {
        match extras {
            None => vectorized(
                #[inline(always)]
                || self.paint_texels(patch, None, rect),
            ),
            Some(extras) => vectorized(
                #[inline(always)]
                || {
                    extras.load(rect);
                    self.paint_texels(patch, Some(extras), rect);
                },
            ),
        }
    }

    #[inline(always)]
    fn paint_texels<const ROOM: usize>(
        &mut self,
        patch: &mut Patch<ROOM>,
        mut extras: Option<&mut Extras<'_, ROOM>>,
        rect: TexelRect,
    ) {
        if self.diffuse_out.is_some() || self.normal_out.is_some() {
            patch.measure(self.look.slope, self.look.curve.as_deref());
            if let Some(extras) = &mut extras {
                extras.mark(patch);
            }
        }
        if let Some(out) = &mut self.diffuse_out {
            match &extras {
                None => diffuse_patch::<ROOM, false>(out, &self.frame, patch, None, self.look, rect),
                Some(extras) => diffuse_patch::<ROOM, true>(out, &self.frame, patch, Some(extras), self.look, rect),
            }
            if let Some(steps) = self.look.steps {
                for y in rect.min.y..rect.max.y {
                    let first = self.frame.index(rect.min.x, y);
                    let row = first..first + rect.size().x as usize;
                    reduce_shades(&mut out[row.clone()], &self.frame.base[row], steps);
                }
            }
        }
        if self.normal_out.is_some()
            && let Some(extras) = &extras
        {
            extras.tilt(patch);
        }
        let mut steps = [[0; 2]; WIDE];
        for (row, y) in (rect.min.y..rect.max.y).enumerate() {
            let range = self.range(rect, y);
            if let Some(out) = &mut self.normal_out {
                let out = &mut out[range.clone()];
                match self.normal.map(|base| (&base[range.clone()], self.look.normals)) {
                    Some((base, NormalBlending::Plain)) => tilted_row(out, base, patch, row),
                    Some((base, NormalBlending::Whiteout)) => whiteout_row(out, base, patch, row),
                    Some((base, NormalBlending::Poisson)) => {
                        let steps = &mut steps[..out.len()];
                        self.correction.inspect(|correction| correction.read_row(rect.min.x, y, steps));
                        corrected_row(out, base, steps, patch, row);
                    }
                    None => flat_row(out, patch, row),
                }
            }
            if let Some(out) = &mut self.depth_out {
                let out = &mut out[range.clone()];
                depth_row(out, self.depth.map(|base| &base[range]), patch.depths(row));
                if let Some(extras) = &extras {
                    extras.deepen(out, row);
                }
            }
        }
    }
}
