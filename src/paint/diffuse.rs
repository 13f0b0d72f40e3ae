//! Colours of the painted picture from depths and slopes, block by block.

use super::{
    LookTable,
    extras::Extras,
    patch::{BLOCK, Patch},
    rows::{Rgba, channel, round},
};
use crate::{
    Grid,
    raster::{Spot, TexelRect, noise_row},
};
use glam::{Mat4, UVec2};
use std::f32::consts::FRAC_1_SQRT_2;

/// Largest brightening of a wall that faces the light: the highlight for a gloss of 1, in sRGB levels, and a share of
/// the colour below. Found by eye on glass (the first) and concrete (the second).
const HIGHLIGHT: f32 = 110.0;
const SHADING: f32 = 0.75;

/// With cast shadows, the light on a wall for each step of its depth: it is the wall that is lit, and not the edge above.
const INNER: f32 = 2.5 / 65535.0;

/// And the least light on crushed material.
const CRUSHED: f32 = 0.55;

/// How much of the picture is visible in a hole.
const HOLE: f32 = 0.10;

/// The part of the base picture that belongs to the field.
pub(super) struct Frame<'a> {
    pub(super) base: &'a [Rgba],
    pub(super) stride: usize,
    pub(super) origin: UVec2,
    pub(super) size: UVec2,
    /// The depths of the whole field.
    pub(super) depths: &'a Grid<u16>,
}

impl Frame<'_> {
    /// Index of texel `(x, y)` of the field in the slices.
    #[inline(always)]
    pub(super) fn index(&self, x: u32, y: u32) -> usize {
        (self.origin.y + y) as usize * self.stride + (self.origin.x + x) as usize
    }

    #[inline(always)]
    fn texel(&self, x: u32, y: u32) -> Rgba {
        self.base[self.index(x, y)]
    }

    /// The texel at this offset in columns and rows, or the nearest one.
    #[inline(always)]
    fn moved(&self, at: UVec2, [x, y]: [i32; 2]) -> Rgba {
        let place = |at: u32, by: i32, size: u32| at.saturating_add_signed(by).min(size - 1);
        self.texel(place(at.x, x, self.size.x), place(at.y, y, self.size.y))
    }

    /// The colour at texel `at` + `offset`, bilinear, weighted by alpha so that the hidden colour of transparent
    /// texels does not show; `None` where everything is transparent.
    #[inline(always)]
    fn shifted(&self, at: UVec2, offset: [f32; 2]) -> Option<[f32; 3]> {
        let place = |at: u32, offset: f32, size: u32| {
            let pos = (at as f32 + offset).clamp(0.0, (size - 1) as f32);
            let low = pos as u32;
            (low, (low + 1).min(size - 1), pos - low as f32)
        };
        let (x0, x1, tx) = place(at.x, offset[0], self.size.x);
        let (y0, y1, ty) = place(at.y, offset[1], self.size.y);
        let corners = [
            (self.texel(x0, y0), (1.0 - tx) * (1.0 - ty)),
            (self.texel(x1, y0), tx * (1.0 - ty)),
            (self.texel(x0, y1), (1.0 - tx) * ty),
            (self.texel(x1, y1), tx * ty),
        ];
        let (mut sum, mut weight) = ([0.0; 3], 0.0);
        for ([r, g, b, a], share) in corners {
            let share = share * f32::from(a);
            weight += share;
            for (sum, channel) in sum.iter_mut().zip([r, g, b]) {
                *sum += f32::from(channel) * share;
            }
        }
        (weight > 0.0).then(|| sum.map(|channel| channel / weight))
    }
}

/// A random value 0..1 for each texel from `(x, y)` on. Each operation is applied to all texels before the next one,
/// so that the loops are vectorized.
#[inline(always)]
fn noise(x: u32, y: u32) -> [f32; BLOCK] {
    const X: u32 = 0x9E37_79B1;
    let (first, row) = (x.wrapping_mul(X), y.wrapping_mul(0x85EB_CA77));
    let (mut hash, mut out) = ([0u32; BLOCK], [0.0; BLOCK]);
    for (i, h) in (0..).zip(&mut hash) {
        *h = first.wrapping_add(X.wrapping_mul(i)) ^ row;
    }
    for h in &mut hash {
        *h = (*h ^ (*h >> 15)).wrapping_mul(0x2C1B_3C6D);
    }
    for h in &mut hash {
        *h = (*h ^ (*h >> 12)).wrapping_mul(0x297A_2D39);
    }
    for i in 0..BLOCK {
        // Through i32, because its conversion is one instruction on every machine.
        out[i] = ((hash[i] ^ (hash[i] >> 15)) >> 8) as i32 as f32 * (1.0 / 16_777_216.0);
    }
    out
}

/// Paints the colours of a patch that lies at `rect` of the field.
///
/// First all texels are copied from the picture and touched blocks are put on a list; then those are painted. Finding
/// and painting them one by one takes longer, because mispredicted branches keep the processor from starting the next
/// block early.
#[inline(always)]
pub(super) fn diffuse_patch<const ROOM: usize, const RICH: bool>(
    out: &mut [Rgba],
    frame: &Frame<'_>,
    patch: &mut Patch<ROOM>,
    extras: Option<&Extras<'_, ROOM>>,
    look: &LookTable,
    rect: TexelRect,
) {
    let width = rect.size().x as usize;
    if width < BLOCK {
        narrow_patch::<ROOM, RICH>(out, frame, patch, extras, look, rect);
        return;
    }
    let mut count = 0;
    for (row, y) in (rect.min.y..rect.max.y).enumerate() {
        let first = frame.index(rect.min.x, y);
        let (out, base) = (&mut out[first..first + width], &frame.base[first..first + width]);
        for from in (0..width).step_by(BLOCK) {
            // The last block starts early enough to be whole: texels that are painted twice get the same value twice.
            let from = from.min(width - BLOCK);
            // A copy of fixed length compiles to a few moves instead of a call.
            if let (Some(out), Some(base)) = (out[from..].first_chunk_mut::<BLOCK>(), base[from..].first_chunk()) {
                *out = *base;
            }
            let place = row * patch.stride + from;
            patch.blocks[count] = (place as u16, UVec2::new(rect.min.x + from as u32, y));
            count += usize::from(patch.is_touched(place));
        }
    }
    for &(place, at) in &patch.blocks[..count] {
        let first = frame.index(at.x, at.y);
        if let (Some(block), Some(out)) =
            (Block::load(&frame.base[first..], patch, place.into()), out[first..].first_chunk_mut())
        {
            *out = block.colors::<ROOM, RICH>(frame, look, extras, place.into(), at);
        }
    }
}

/// Like [`diffuse_patch`] for a patch that is narrower than a block.
#[inline(always)]
fn narrow_patch<const ROOM: usize, const RICH: bool>(
    out: &mut [Rgba],
    frame: &Frame<'_>,
    patch: &Patch<ROOM>,
    extras: Option<&Extras<'_, ROOM>>,
    look: &LookTable,
    rect: TexelRect,
) {
    let width = rect.size().x as usize;
    for (row, y) in (rect.min.y..rect.max.y).enumerate() {
        let first = frame.index(rect.min.x, y);
        let (out, base) = (&mut out[first..first + width], &frame.base[first..first + width]);
        out.copy_from_slice(base);
        let place = row * patch.stride;
        if patch.is_touched(place)
            && let Some(block) = Block::load(base, patch, place)
        {
            let at = UVec2::new(rect.min.x, y);
            out.copy_from_slice(&block.colors::<ROOM, RICH>(frame, look, extras, place, at)[..width]);
        }
    }
}

/// The inputs of the colours of a block. Values beyond the end of a row are not used.
struct Block<'a> {
    base: [u32; BLOCK],
    depth: &'a [u16; BLOCK],
    x: &'a [f32; BLOCK],
    y: &'a [f32; BLOCK],
    inv_len: &'a [f32; BLOCK],
}

impl<'a> Block<'a> {
    /// The block at `place` of a patch; `None` if the patch ends before it.
    #[inline(always)]
    fn load<const ROOM: usize>(base: &[Rgba], patch: &'a Patch<ROOM>, place: usize) -> Option<Self> {
        let mut bytes = [[0; 4]; BLOCK];
        match base.first_chunk() {
            Some(base) => bytes = *base,
            None => bytes[..base.len()].copy_from_slice(base),
        }
        Some(Self {
            base: bytes.map(u32::from_le_bytes),
            depth: patch.depth[place + patch.stride + 1..].first_chunk()?,
            x: patch.x[place..].first_chunk()?,
            y: patch.y[place..].first_chunk()?,
            inv_len: patch.inv_len[place..].first_chunk()?,
        })
    }
}

impl Block<'_> {
    #[inline(always)]
    fn colors<const ROOM: usize, const RICH: bool>(
        &self,
        frame: &Frame<'_>,
        look: &LookTable,
        extras: Option<&Extras<'_, ROOM>>,
        place: usize,
        at: UVec2,
    ) -> [Rgba; BLOCK] {
        let extras = if RICH { extras.map(|extras| (extras, place)) } else { None };
        let painted = if look.opaque {
            self.paint::<ROOM, true, RICH>(frame, look, extras, at)
        } else {
            self.paint::<ROOM, false, RICH>(frame, look, extras, at)
        };
        painted.map(u32::to_le_bytes)
    }

    #[inline(always)]
    fn paint<const ROOM: usize, const OPAQUE: bool, const RICH: bool>(
        &self,
        frame: &Frame<'_>,
        look: &LookTable,
        extras: Option<(&Extras<'_, ROOM>, usize)>,
        at: UVec2,
    ) -> [u32; BLOCK] {
        // Channel by channel, so that each loop works on many texels at once.
        let mut over = self.over::<ROOM, RICH>(frame, look, extras, at);
        let mut under = self.picture(frame, look, at);
        let facets = if RICH { self.plates(frame, extras, at, &mut under) } else { [0.0; BLOCK] };
        if look.tint > 0.0 {
            for c in 0..3 {
                for i in 0..BLOCK {
                    over[c][i] *= (1.0 - look.tint) + look.tint * (1.0 / 255.0) * under[c][i];
                }
            }
        }
        let mut dark = [0.0; BLOCK];
        if RICH && let Some((extras, place)) = extras {
            dark = compose((extras, place, at), look, &facets, &under, &mut over);
        }
        let mut painted = [0; BLOCK];
        let (mut under_share, mut over_share, mut facing) = ([0.0; BLOCK], [1.0; BLOCK], [0.0; BLOCK]);
        for i in 0..BLOCK {
            let cover = over[3][i];
            if OPAQUE {
                // An opaque crack adds its cover to the alpha, like a second pane; else the alpha is that of the
                // picture.
                let alpha = channel(self.base[i], 3) * (1.0 / 255.0);
                let pane = 1.0 - (1.0 - alpha);
                let pane_out = pane * (1.0 - cover) + cover;
                over_share[i] = 1.0 / pane_out;
                under_share[i] = pane * (1.0 - cover) * over_share[i];
                painted[i] = round(255.0 * (alpha + (pane_out - alpha))) << 24;
            } else {
                under_share[i] = 1.0 - cover;
                painted[i] = self.base[i] & 0xFF00_0000;
            }
            // Light from the upper left, on a normal whose y points down. The response flattens out on steep walls.
            let light = (self.x[i] + self.y[i]) * self.inv_len[i] * (-FRAC_1_SQRT_2 * look.glint);
            facing[i] = light / (1.0 + light.abs());
            // Nothing is lit in a hole.
            if RICH {
                facing[i] *= 1.0 - dark[i];
            }
        }
        if look.cast.is_some() {
            for (i, facing) in facing.iter_mut().enumerate() {
                let mut share = (f32::from(self.depth[i]) * INNER).min(1.0);
                if RICH
                    && let Some((extras, place)) = extras
                    && extras.spot(place + i) != Spot::default()
                {
                    share = share.max(CRUSHED);
                }
                *facing *= share;
            }
        }
        if look.uneven_glint > 0.0 && facing.iter().any(|facing| *facing > 0.0) {
            let mut share = lit_shares(look, at);
            // Crushed stone is lit as it lies.
            if RICH && let Some((extras, place)) = extras {
                for (i, share) in share.iter_mut().enumerate() {
                    *share += (1.0 - *share) * f32::from(extras.spot(place + i).pale) * (1.0 / 255.0);
                }
            }
            for i in 0..BLOCK {
                facing[i] *= if facing[i] > 0.0 { share[i] } else { 1.0 };
            }
        }
        for c in 0..3 {
            let (under, over) = (&under[c], &over[c]);
            for i in 0..BLOCK {
                let mixed = under[i] * under_share[i] + over[i] * over_share[i];
                let lit = mixed + facing[i] * (look.gloss * HIGHLIGHT + SHADING * mixed);
                let lit = if lit > 0.0 { lit } else { 0.0 };
                painted[i] |= round(if lit < 255.0 { lit } else { 255.0 }).wrapping_shl(8 * c as u32);
            }
        }
        for (i, painted) in painted.iter_mut().enumerate() {
            let mut untouched = (self.depth[i] == 0) & (self.x[i] == 0.0) & (self.y[i] == 0.0);
            if RICH && let Some((extras, place)) = extras {
                untouched &= extras.is_untouched(place + i);
            }
            if untouched | (self.base[i] >> 24 == 0) {
                *painted = self.base[i];
            }
        }
        painted
    }

    /// The colours over the picture: three channels times cover, and cover. They are computed texel by texel, four
    /// values at once, and then transposed.
    #[inline(always)]
    fn over<const ROOM: usize, const RICH: bool>(
        &self,
        frame: &Frame<'_>,
        look: &LookTable,
        extras: Option<(&Extras<'_, ROOM>, usize)>,
        at: UVec2,
    ) -> [[f32; BLOCK]; 4] {
        let mut share = [1.0; BLOCK];
        if look.grain > 0.0 {
            let noise = noise(at.x, at.y);
            for i in 0..BLOCK {
                share[i] = 1.0 - look.grain * noise[i];
            }
        }
        if look.sparkle > 0.0 && *self.depth != [0; BLOCK] {
            for (share, bump) in share.iter_mut().zip(bumps(0x5EED, look.sparkle_scale, at)) {
                *share *= 1.0 - look.sparkle * (0.5 + 0.5 * bump);
            }
        }
        if RICH
            && let Some((extras, place)) = extras
            && let Some(cel) = look.cel.as_ref().filter(|cel| cel.has_floor)
        {
            let mut over = [[0.0; BLOCK]; 4];
            for i in 0..BLOCK {
                let pit = extras.spot(place + i).pit;
                if self.depth[i] != 0 || pit[0] != 0 {
                    let at = [(at.x + i as u32) as f32, at.y as f32];
                    let floor = extras.veil(place + i);
                    let layer = cel.layer_over(self.depth[i], [self.x[i], self.y[i]], floor, pit, at);
                    over.iter_mut().zip(layer).for_each(|(over, part)| over[i] = part * share[i]);
                }
            }
            return over;
        }
        if RICH && *self.depth == [0; BLOCK] {
            return [[0.0; BLOCK]; 4];
        }
        if let Some(cel) = &look.cel {
            let mut over = [[0.0; BLOCK]; 4];
            for i in 0..BLOCK {
                let layer = cel.layer(self.depth[i], [self.x[i], self.y[i]]);
                over.iter_mut().zip(layer).for_each(|(over, part)| over[i] = part * share[i]);
            }
            return over;
        }
        let mut depth = *self.depth;
        if let Some(cast) = &look.cast {
            if depth != [0; BLOCK] {
                let facing = std::array::from_fn(|i| -(self.x[i] + self.y[i]) * self.inv_len[i] * FRAC_1_SQRT_2);
                cast.adjust_depths(frame.depths, at, &facing, look.shadow, &mut depth);
            }
        } else if look.shadow > 0.0 {
            for (i, depth) in depth.iter_mut().enumerate() {
                let away = (self.x[i] + self.y[i]) * self.inv_len[i] * FRAC_1_SQRT_2;
                let deeper = f32::from(*depth) * (1.0 + look.shadow * away);
                *depth = if deeper < 65535.0 { deeper as i32 as u16 } else { u16::MAX };
            }
        }
        let mut between = [0.0; BLOCK];
        for (between, &depth) in between.iter_mut().zip(&depth) {
            *between = LookTable::between(depth);
        }
        let layer = |i: usize| look.layer(depth[i], between[i]) * share[i];
        let mut over = [[0.0; BLOCK]; 4];
        for i in (0..BLOCK).step_by(4) {
            let turned = Mat4::from_cols(layer(i), layer(i + 1), layer(i + 2), layer(i + 3)).transpose();
            for (over, part) in over.iter_mut().zip(turned.to_cols_array_2d()) {
                over[i..i + 4].copy_from_slice(&part);
            }
        }
        over
    }

    /// The colours of the picture, displaced where the surface is tilted.
    #[inline(always)]
    fn picture(&self, frame: &Frame<'_>, look: &LookTable, at: UVec2) -> [[f32; BLOCK]; 3] {
        let mut under = [[0.0; BLOCK]; 3];
        for (c, under) in (0..).zip(&mut under) {
            for (under, &base) in under.iter_mut().zip(&self.base) {
                *under = channel(base, c);
            }
        }
        if look.shift > 0.0 {
            for i in 0..BLOCK {
                let scale = self.inv_len[i] * look.shift;
                let offset = [self.x[i] * scale, self.y[i] * scale];
                let hidden = self.base[i] >> 24 == 0;
                if hidden || offset == [0.0; 2] {
                    continue;
                }
                if let Some(color) = frame.shifted(at + UVec2::new(i as u32, 0), offset) {
                    under.iter_mut().zip(color).for_each(|(under, value)| under[i] = value);
                }
            }
        }
        under
    }

    /// Displaces the picture behind each plate and applies the plate's tone; returns the cover of its reflection.
    #[inline(always)]
    fn plates<const ROOM: usize>(
        &self,
        frame: &Frame<'_>,
        extras: Option<(&Extras<'_, ROOM>, usize)>,
        at: UVec2,
        under: &mut [[f32; BLOCK]; 3],
    ) -> [f32; BLOCK] {
        let mut sheen = [0.0; BLOCK];
        let Some((extras, place)) = extras else { return sheen };
        for (i, sheen) in sheen.iter_mut().enumerate() {
            let id = extras.plate(place + i);
            if id == 0 {
                continue;
            }
            let facet = extras.facet(id);
            let x = at.x + i as u32;
            // Where cracks displace the picture too, their displacement is used.
            if facet.shift != [0; 2] && self.x[i] == 0.0 && self.y[i] == 0.0 {
                let moved = frame.moved(UVec2::new(x, at.y), facet.shift);
                if moved[3] == (self.base[i] >> 24) as u8 {
                    under.iter_mut().zip(moved).for_each(|(under, value)| under[i] = f32::from(value));
                }
            }
            let tone = facet.tone(x, at.y);
            under.iter_mut().for_each(|under| under[i] *= tone);
            *sheen = facet.sheen(x, at.y);
        }
        sheen
    }
}

/// Smooth noise in -1..=1 at each texel from `at` on, with `scale` bumps per texel.
#[inline(always)]
fn bumps(seed: u32, scale: f32, at: UVec2) -> [f32; BLOCK] {
    let mut x = [0.0; BLOCK];
    for (i, x) in x.iter_mut().enumerate() {
        *x = (at.x + i as u32) as f32 * scale;
    }
    noise_row(seed, x, at.y as f32 * scale)
}

/// How much of the light on walls there is at each texel from `at` on.
#[inline(always)]
fn lit_shares(look: &LookTable, at: UVec2) -> [f32; BLOCK] {
    let mut share = bumps(0x61E7, look.glint_scale, at);
    for share in &mut share {
        let bump = (0.5 + 0.9 * *share).clamp(0.0, 1.0);
        *share = 1.0 - look.uneven_glint * (1.0 - bump * bump);
    }
    share
}

/// Puts reflections and crushed material under the cracks, and holes over them; returns how dark the holes are.
#[inline(always)]
fn compose<const ROOM: usize>(
    (extras, place, at): (&Extras<'_, ROOM>, usize, UVec2),
    look: &LookTable,
    sheen: &[f32; BLOCK],
    under: &[[f32; BLOCK]; 3],
    over: &mut [[f32; BLOCK]; 4],
) -> [f32; BLOCK] {
    let mut holes = [0.0; BLOCK];
    for i in 0..BLOCK {
        let spot = extras.spot(place + i);
        let pale = f32::from(spot.pale) * (1.0 / 255.0);
        let mut dark = f32::from(spot.dark) * (1.0 / 255.0);
        if extras.are_gone {
            // Small plates are missing or present as a whole.
            match extras.facet(extras.plate(place + i)).is_gone {
                // Plates larger than the hole stay.
                None if look.thick > 0.0 && extras.plate(place + i) != 0 => dark = 0.0,
                None => {}
                Some(is_gone) => {
                    dark = if is_gone { 1.0 } else { 0.0 };
                    if is_gone && look.thick > 0.0 {
                        let side = extras.side(at.x + i as u32, at.y, look.thick);
                        // The line at the edge of the hole stays, and so do the visible sides of the plates beside
                        // it.
                        dark -= side.line * over[3][i].clamp(0.0, 1.0);
                        for c in 0..3 {
                            let face = HOLE * under[c][i] * (1.0 - side.face) + look.side[c] * side.face * side.tone;
                            over[c][i] = over[c][i] * (1.0 - dark) + face * dark;
                        }
                        over[3][i] = 1.0;
                        holes[i] = dark;
                        continue;
                    }
                }
            }
        }
        // Shadows lie under the cracks; a hole has no shadow.
        let (shade, hole) = if extras.shades { (dark, 0.0) } else { (0.0, dark) };
        let tone = 1.0 + f32::from(spot.shade) * (1.0 / 128.0);
        let veil = f32::from(extras.veil(place + i)) * look.veil_cover;
        if extras.is_bare() {
            let share = extras.left(place + i);
            over.iter_mut().for_each(|over| over[i] *= share);
        }
        let (left, sheen) = (1.0 - over[3][i], sheen[i]);
        for c in 0..3 {
            let veiled = look.sheen[c] * sheen * (1.0 - veil) + look.veil[c] * veil;
            let crushed = extras.color[c] + under[c][i] * extras.tint;
            let mut crack = over[c][i];
            if extras.is_drawn {
                crack = (crack + veiled * left) * (1.0 - pale) + crushed * tone * pale;
                crack = crack * (1.0 - shade) + HOLE * under[c][i] * shade;
            } else {
                let below = veiled * (1.0 - pale) + crushed * tone * pale;
                let below = below * (1.0 - shade) + HOLE * under[c][i] * shade;
                crack += below * left;
            }
            let mut void = HOLE * under[c][i];
            if extras.has_walls {
                void += (crushed * tone - void) * pale;
            }
            over[c][i] = crack * (1.0 - hole) + void * hole;
        }
        // The total cover of all layers.
        let cover = over[3][i] + left * (1.0 - (1.0 - sheen) * (1.0 - veil) * (1.0 - pale) * (1.0 - shade));
        over[3][i] = cover * (1.0 - hole) + hole;
        holes[i] = hole;
    }
    holes
}
