//! Anti-aliased stamps: tapered capsules and discs, combined by max.
//!
//! One kernel draws all of them. The distance `d` of a texel centre to the centre line and the half width `r` at the
//! nearest point of that line give the depth (both in texels):
//!
//! ```text
//! core = peak(r) * mix(clamp((r + 1/2 - d) / (1 + wall * r), 0, 1), clamp(r + 1/2 - d, 0, 1), edge(r))
//! rim  = rim_depth * clamp((r + rim - d) / max(rim, 1), 0, 1)
//! depth = max(core, rim) * min(2 r / (1 - faintest), 1)
//! ```
//!
//! `peak(r)` rises with `r` from 40 % of the depth to all of it at the full width. With even walls it is `(1 + r) /
//! full` and `wall` is 1, so that depth measures the distance to the edge in texels.
//!
//! `edge(r)` is zero up to a half width of 2.5 texels and all of `edge` from 6 on.
//!
//! The core is a slot with an edge one texel wide (`wall` 0) up to a V (`wall` 1). Lines thinner than a texel keep
//! the cross-section of one texel (`r` = 1/2 in `core`) and only get fainter, by the last factor: a line 0.3 texels
//! wide covers 0.3 texels of area (`faintest` 0) wherever it lies between the texel centres, and is never dotted. A
//! pointed end fades out.
//!
//! With ragged edges `d` is increased by `min(ragged, 0.6 max(r - 1/2, 0))` times a random value in `-1..=1` of the
//! texel.
//!
//! Pieces come off the edges of wide lines. Each has a share of the largest reach. Where one has come off whole, and where it has left a step,
//! there is
//!
//! ```text
//! gap   = share * min(chipped, 0.8 max(r - 3/2, 0))
//! whole = 0.5 * peak(r) * min(gap, 1) * clamp(r + 1/2 + gap - d, 0, 1)
//! step  = 0.14 * depth * min(gap, 1) * clamp(r + 1/2 + gap - d, 0, 1)
//! ```
//!
//! And where a stone lies, `peak` is at most `depth * (1 - rubble * stone)`. Shares and heights of stones are those of the texel.
//!
//! If a [plan](super::LayerPlan) says so, a line has only a share of that depth, by the light that it catches, and
//! narrow lines have a fainter rim.
//!
//! The value depends only on the texel and the capsule, and grows with `r`: stamps can be drawn in any order.

use super::{
    DepthField, DirtyTiles, Profile, TexelRect,
    catch::Catch,
    ragged,
    section::{MAX_RADIUS, Section, clamp01, clamped, max, min},
};
use crate::{
    math::vectorized,
    pattern::{PathPoint, SegmentPath, SurfaceFrame},
};
use glam::{DVec2, UVec2, Vec2, Vec4};

/// Texels computed at once. Eight `f32` are one AVX register or two of SSE; 16 spill there, 4 leave half of the latency of `sqrt` unused.
const LANES: usize = 8;

/// Up to this many blocks in a row use the loop for few blocks.
const FEW_BLOCKS: usize = 3;

/// Centres of the texels of one block, from its left edge.
const CENTRES: [f32; LANES] = [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5];

/// Changes are reported for this many rows at once: those of a row of dirty tiles.
const BAND: u32 = DirtyTiles::TILE;

/// Texels in a cache line.
const CACHE_LINE: usize = 64 / size_of::<u16>();

/// How far outside the reach of a capsule a rounding error can still leave a trace, texels.
const MARGIN: f32 = 0.0625;

/// Lines flatter than this (texels along per texel down) are not narrowed row by row: it would gain little, and the
/// rounding error of a row's middle grows with the flatness.
const FLATTEST: f32 = 64.0;

/// Stamps the rough line of one segment into `field`; returns the texels that it may have changed.
///
/// Half widths are linear between the points of the path. Points that are not finite are skipped, with the pieces
/// beside them. Widths below zero and NaN count as zero.
pub fn stamp_path(field: &mut DepthField, profile: &Profile, path: &SegmentPath) -> TexelRect {
    stamp_pieces::<false>(field, profile, path, &mut |_| {})
}

/// Like [`stamp_path`], and calls `changed` with small rectangles that together contain every changed texel.
///
/// They contain far fewer texels than the returned rectangle where a line is slanted, or lies over deeper lines.
pub fn stamp_path_with(
    field: &mut DepthField,
    profile: &Profile,
    path: &SegmentPath,
    changed: &mut dyn FnMut(TexelRect),
) -> TexelRect {
    stamp_pieces::<true>(field, profile, path, changed)
}

/// Makes the tables that stamps with a profile look into, which the first one would make otherwise.
#[cfg(feature = "bevy")]
pub(crate) fn make_tables(profile: &Profile, frame: SurfaceFrame) {
    Section::new(profile, frame.texels_per_unit());
}

/// Stamps a path; calls `changed` if `REPORT`.
fn stamp_pieces<const REPORT: bool>(
    field: &mut DepthField,
    profile: &Profile,
    path: &SegmentPath,
    changed: &mut dyn FnMut(TexelRect),
) -> TexelRect {
    let unit = field.frame.texels_per_unit();
    let plan = field.layer.plan();
    let section = Section::new(profile, unit).with_rims(plan.full_rim, unit);
    let catch = (plan.directionality > 0.0).then(|| Catch::new(plan.directionality, plan.seed));
    let mut bounds = TexelRect::default();
    for pair in path.points().windows(2) {
        if let Some(mut capsule) = Capsule::clipped(&field.frame, field.depth.size(), &section, pair[0], pair[1]) {
            if let Some(catch) = &catch {
                (capsule.catch_from, capsule.catch_gain) = catch.of(pair[0].pos, pair[1].pos);
            }
            bounds = bounds.union(capsule.stamp::<REPORT>(field, &section, changed));
        }
    }
    if let Some(veil) = &mut field.layer.veil {
        let rect = veil.stamp(path);
        if REPORT && !rect.is_empty() {
            changed(rect);
        }
        bounds = bounds.union(rect);
    }
    field.spare(bounds);
    bounds
}

/// Stamps a disc of `radius` pattern units at `pos` (pattern units), `depth` (0..=1) deep; returns the texels that it may have changed.
///
/// The disc has upright walls. Nothing happens if `pos` is not finite.
pub fn stamp_dot(field: &mut DepthField, pos: Vec2, radius: f32, depth: f32) -> TexelRect {
    let section = Section::upright(depth);
    let point = PathPoint { pos, width: 2.0 * radius };
    match Capsule::clipped(&field.frame, field.depth.size(), &section, point, point) {
        Some(capsule) => {
            let changed = capsule.stamp::<false>(field, &section, &mut |_| {});
            field.spare(changed);
            changed
        }
        None => TexelRect::default(),
    }
}

/// One piece of a path, in texels.
#[derive(Clone, Copy)]
struct Capsule {
    from: Vec2,
    along: Vec2,
    /// 0 for a disc.
    inv_len_sq: f32,
    r_from: f32,
    r_gain: f32,
    /// Beyond this distance from the centre line nothing is drawn.
    reach: f32,
    /// Share of its depth by the light that it catches: 1 if the field has no such effect.
    catch_from: f32,
    catch_gain: f32,
}

impl Capsule {
    /// The part of a piece that can reach the field; `None` if there is none or a coordinate is not finite.
    fn clipped(frame: &SurfaceFrame, size: UVec2, section: &Section, from: PathPoint, to: PathPoint) -> Option<Self> {
        if !from.pos.is_finite() || !to.pos.is_finite() {
            return None;
        }
        let radius = |point: PathPoint| clamped(0.5 * point.width * frame.texels_per_unit(), MAX_RADIUS);
        let (mut r_from, mut r_to) = (radius(from), radius(to));
        let reach = section.reach(max(r_from, r_to)) + MARGIN;
        if max(r_from, r_to) == 0.0 {
            return None;
        }
        let (mut a, mut b) = (frame.to_texel(from.pos), frame.to_texel(to.pos));
        let (low, high) = (Vec2::splat(-reach - 1.0), size.as_vec2() + (reach + 1.0));
        let inside = |p: Vec2| p.cmpge(low).all() && p.cmple(high).all();
        if !(inside(a) && inside(b)) {
            // In f64, so that the rounding of a distant end does not move the near one.
            let scale = f64::from(frame.texels_per_unit());
            let (start, end) = (from.pos.as_dvec2() * scale, to.pos.as_dvec2() * scale);
            let (t0, t1) = clip(start, end, low.as_dvec2(), high.as_dvec2())?;
            let along = end - start;
            a = (start + along * t0).as_vec2();
            b = (start + along * t1).as_vec2();
            let r_gain = r_to - r_from;
            r_to = r_from + r_gain * t1 as f32;
            r_from += r_gain * t0 as f32;
        }
        let along = b - a;
        let len_sq = along.length_squared();
        let whole = Self {
            from: a,
            along: Vec2::ZERO,
            inv_len_sq: 0.0,
            r_from: max(r_from, r_to),
            r_gain: 0.0,
            reach,
            catch_from: 1.0,
            catch_gain: 0.0,
        };
        Some(if len_sq > 1.0e-12 {
            Self { along, inv_len_sq: 1.0 / len_sq, r_from, r_gain: r_to - r_from, ..whole }
        } else {
            whole
        })
    }

    /// The texels within reach.
    fn bounds(&self, size: UVec2) -> TexelRect {
        let to = self.from + self.along;
        let limit = size.as_vec2();
        let low = (self.from.min(to) - (self.reach + 0.5)).ceil().clamp(Vec2::ZERO, limit);
        let high = (self.from.max(to) + (self.reach + 0.5)).floor().clamp(Vec2::ZERO, limit);
        TexelRect { min: low.as_uvec2(), max: high.as_uvec2() }
    }

    fn stamp<const REPORT: bool>(
        &self,
        field: &mut DepthField,
        section: &Section,
        changed: &mut dyn FnMut(TexelRect),
    ) -> TexelRect {
        let rect = self.bounds(field.depth.size());
        if rect.is_empty() {
            return TexelRect::default();
        }
        vectorized(
            #[inline(always)]
            || match (self.r_gain != 0.0, section.rim_depth > 0.0) {
                _ if section.is_chipped(max(self.r_from, self.r_from + self.r_gain)) => {
                    self.stamp_rows::<REPORT, true, true, true, true>(field, section, rect, changed);
                }
                _ if !section.tile.is_empty() => {
                    self.stamp_rows::<REPORT, true, true, true, false>(field, section, rect, changed);
                }
                (false, false) => self.stamp_rows::<REPORT, false, false, false, false>(field, section, rect, changed),
                (false, true) => self.stamp_rows::<REPORT, false, true, false, false>(field, section, rect, changed),
                (true, false) => self.stamp_rows::<REPORT, true, false, false, false>(field, section, rect, changed),
                (true, true) => self.stamp_rows::<REPORT, true, true, false, false>(field, section, rect, changed),
            },
        );
        rect
    }

    /// Stamps row by row: blocks of [`LANES`] texels and at most one of half as many. A block may exceed `rect`: the
    /// values there are zero.
    #[inline(always)]
    fn stamp_rows<const REPORT: bool, const TAPER: bool, const RIM: bool, const RAGGED: bool, const CHIPPED: bool>(
        &self,
        field: &mut DepthField,
        section: &Section,
        rect: TexelRect,
        changed: &mut dyn FnMut(TexelRect),
    ) {
        if REPORT {
            fetch(field, rect);
        }
        let width = field.depth.width();
        let blocks = (rect.size().x as usize).div_ceil(LANES);
        if blocks <= FEW_BLOCKS && blocks * LANES <= width {
            self.stamp_blocks::<REPORT, TAPER, RIM, RAGGED, CHIPPED>(field, section, rect, blocks, changed);
            return;
        }
        let mut band = TexelRect::default();
        let (left, right) = (rect.min.x as f32, rect.max.x as f32);
        let slope = self.along.x / self.along.y;
        let narrow = slope.abs() < FLATTEST && rect.size().x as usize > LANES;
        let half_span = self.reach * (1.0 + slope * slope).sqrt() + 0.5;
        for y in rect.min.y..rect.max.y {
            let dy = (y as f32 + 0.5) - self.from.y;
            let (mut x0, mut x1) = (rect.min.x as usize, rect.max.x as usize);
            if narrow {
                // The capsule lies in the strip of lines parallel to it within its reach.
                let middle = self.from.x + dy * slope;
                x0 = max(middle - half_span, left) as usize;
                x1 = min(middle + half_span, right) as usize;
                if x0 >= x1 {
                    continue;
                }
            }
            let n = (x1 - x0).next_multiple_of(LANES / 2);
            x0 = x0.min(width.saturating_sub(n));
            let end = (x0 + n).min(width);
            // The columns that have changed, and those between them.
            let mut span = end..x0;
            let mut add = |x0: usize, change: u32| {
                if REPORT && change != 0 {
                    span.start = span.start.min(x0 + change.trailing_zeros() as usize);
                    span.end = end.min(x0 + change.ilog2() as usize + 1);
                }
            };
            let (blocks, rest) = field.depth.row_mut(y as usize)[x0..end].as_chunks_mut::<LANES>();
            for block in blocks {
                add(x0, self.stamp_block::<LANES, TAPER, RIM, RAGGED, CHIPPED>(block, section, (x0, y as usize), dy));
                x0 += LANES;
            }
            if let Ok(block) = <&mut [u16; LANES / 2]>::try_from(&mut *rest) {
                add(
                    x0,
                    self.stamp_block::<{ LANES / 2 }, TAPER, RIM, RAGGED, CHIPPED>(
                        block,
                        section,
                        (x0, y as usize),
                        dy,
                    ),
                );
            } else if !rest.is_empty() {
                let mut block = [0; LANES];
                block[..rest.len()].copy_from_slice(rest);
                add(
                    x0,
                    self.stamp_block::<LANES, TAPER, RIM, RAGGED, CHIPPED>(&mut block, section, (x0, y as usize), dy),
                );
                rest.copy_from_slice(&block[..rest.len()]);
            }
            if REPORT && span.start < span.end {
                if !band.is_empty() && y >= band.max.y.next_multiple_of(BAND) {
                    changed(std::mem::take(&mut band));
                }
                let (min, max) = (UVec2::new(span.start as u32, y), UVec2::new(span.end as u32, y + 1));
                band = band.union(TexelRect { min, max });
            }
        }
        if !band.is_empty() {
            changed(band);
        }
    }

    /// The same number of blocks in every row: for few blocks the branches are predictable then.
    #[inline(always)]
    fn stamp_blocks<const REPORT: bool, const TAPER: bool, const RIM: bool, const RAGGED: bool, const CHIPPED: bool>(
        &self,
        field: &mut DepthField,
        section: &Section,
        rect: TexelRect,
        blocks: usize,
        changed: &mut dyn FnMut(TexelRect),
    ) {
        let x0 = (rect.min.x as usize).min(field.depth.width() - blocks * LANES);
        let mut top = rect.min.y;
        while top < rect.max.y {
            let bottom = (top + 1).next_multiple_of(BAND).min(rect.max.y);
            // The columns and rows that have changed, a bit each.
            let (mut columns, mut rows) = (0, 0);
            for (i, y) in (top..bottom).enumerate() {
                let dy = (y as f32 + 0.5) - self.from.y;
                let row = &mut field.depth.row_mut(y as usize)[x0..x0 + blocks * LANES];
                let mut change = 0;
                for (k, block) in row.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
                    let at = (x0 + k * LANES, y as usize);
                    change |=
                        self.stamp_block::<LANES, TAPER, RIM, RAGGED, CHIPPED>(block, section, at, dy) << (k * LANES);
                }
                columns |= change;
                rows |= u32::from(change != 0) << i;
            }
            if REPORT && columns != 0 {
                let min = UVec2::new(x0 as u32 + columns.trailing_zeros(), top + rows.trailing_zeros());
                let max = UVec2::new(x0 as u32 + columns.ilog2() + 1, top + rows.ilog2() + 1);
                changed(TexelRect { min, max });
            }
            top = bottom;
        }
    }

    /// Returns the changed texels, one bit each.
    #[inline(always)]
    fn stamp_block<const N: usize, const TAPER: bool, const RIM: bool, const RAGGED: bool, const CHIPPED: bool>(
        &self,
        block: &mut [u16; N],
        section: &Section,
        (x, y): (usize, usize),
        dy: f32,
    ) -> u32 {
        let uniform = section.cut(self.r_from);
        let mut uneven = [0.0; N];
        if RAGGED {
            uneven.iter_mut().zip(ragged::at(section.tile, x, y)).for_each(|(to, step)| *to = f32::from(*step));
        }
        let (mut pieces, mut stones) = ([0.0; N], [0.0; N]);
        if CHIPPED {
            pieces.iter_mut().zip(ragged::at(section.pieces, x, y)).for_each(|(to, step)| *to = f32::from(*step));
            stones.iter_mut().zip(ragged::at(section.stones, x, y)).for_each(|(to, step)| *to = f32::from(*step));
        }
        let x = x as f32;
        let mut values = [0.0; N];
        for i in 0..N {
            let dx = (x + CENTRES[i]) - self.from.x;
            let t = clamp01((dx * self.along.x + dy * self.along.y) * self.inv_len_sq);
            let (across_x, across_y) = (dx - t * self.along.x, dy - t * self.along.y);
            let mut distance = (across_x * across_x + across_y * across_y).sqrt();
            let cut = if TAPER { section.cut(self.r_from + t * self.r_gain) } else { uniform };
            if RAGGED {
                distance += cut.swing * uneven[i];
            }
            let mut value = if CHIPPED {
                section.deep(&cut, distance, pieces[i], stones[i])
            } else {
                cut.peak * cut.share(distance)
            };
            if RIM {
                value = max(value, cut.rim_depth * clamp01((cut.rim_reach - distance) * section.inv_rim));
            }
            values[i] = value * (cut.scale * (self.catch_from + t * self.catch_gain));
        }
        let (mut old, mut new) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            old[i] = whole(block[i]);
            new[i] = values[i] + WHOLE;
        }
        let mut change = 0;
        for k in 0..N / 4 {
            let [old, new] =
                [old, new].map(|all| Vec4::new(all[4 * k], all[4 * k + 1], all[4 * k + 2], all[4 * k + 3]));
            change |= new.cmpgt(old).bitmask() << (4 * k);
        }
        for i in 0..N {
            block[i] = max(new[i], old[i]).to_bits() as u16;
        }
        change
    }
}

/// Reads one texel of each cache line, so that the latency of cold memory overlaps instead of adding up block by
/// block.
fn fetch(field: &DepthField, rect: TexelRect) {
    let mut sum = 0;
    for y in rect.min.y..rect.max.y {
        let row = &field.depth.row(y as usize)[rect.min.x as usize..rect.max.x as usize];
        for line in row.chunks(CACHE_LINE) {
            sum ^= line[0] ^ line[line.len() - 1];
        }
    }
    std::hint::black_box(sum);
}

/// Added to a value of 0..=65535, this rounds it and leaves the integer in the low bits of the float. Unlike a cast,
/// which
/// has to handle NaN, this is one addition on every machine.
const WHOLE: f32 = 8_388_608.0;

/// [`WHOLE`] plus an integer.
#[inline(always)]
fn whole(depth: u16) -> f32 {
    f32::from_bits(WHOLE.to_bits() | u32::from(depth))
}

/// The range of `from + t * (to - from)`, `t` in 0..=1, inside a box (Liang and Barsky 1984); `None` if there is none.
fn clip(from: DVec2, to: DVec2, low: DVec2, high: DVec2) -> Option<(f64, f64)> {
    let along = to - from;
    let (mut t0, mut t1) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        let (p, v) = (from[axis], along[axis]);
        if v == 0.0 {
            if p < low[axis] || p > high[axis] {
                return None;
            }
            continue;
        }
        let (enter, leave) = ((low[axis] - p) / v, (high[axis] - p) / v);
        t0 = t0.max(enter.min(leave));
        t1 = t1.min(enter.max(leave));
    }
    (t0 <= t1).then_some((t0, t1))
}

#[cfg(test)]
mod tests;
