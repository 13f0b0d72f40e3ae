//! The light that cracks emit.

use super::{
    LookTable,
    rows::{Rgba, round},
};
use crate::raster::{DepthField, TexelRect};
use glam::UVec2;

/// Paints an emissive map: the texels `rects` get the value of `base` (black without one) plus the light of the
/// look's [`glow`](super::Look::glow). The map has `size` texels (RGBA8, sRGB, row-major).
///
/// `rects` and `origin` are those of [`paint_rects`](super::paint_rects). Slices that are shorter than `size`
/// requires are left unchanged.
///
/// ```
/// use bevy_crack::{
///     paint::{Look, LookTable, paint_glow},
///     pattern::SurfaceFrame,
///     raster::{DepthField, TexelRect},
/// };
/// use glam::UVec2;
///
/// // Four texels, of which the third is cracked.
/// let size = UVec2::new(4, 1);
/// let mut field = DepthField::new(SurfaceFrame::new(size)?);
/// field.depth.row_mut(0)[2] = u16::MAX;
/// let look = LookTable::new(&Look::GLOWING, field.frame.texels_per_unit())?;
/// let mut light = [0; 16];
/// paint_glow(None, size, &field, &look, &[TexelRect::whole(size)], UVec2::ZERO, &mut light);
/// assert_eq!(light[..8], [0, 0, 0, 255, 0, 0, 0, 255]);
/// assert_eq!(light[8], 255);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn paint_glow(
    base: Option<&[u8]>,
    size: UVec2,
    field: &DepthField,
    look: &LookTable,
    rects: &[TexelRect],
    origin: UVec2,
    out: &mut [u8],
) {
    let visible = field.depth.size().min(size.saturating_sub(origin));
    let Some(texels) = (size.x as usize).checked_mul(size.y as usize) else { return };
    let (out, base) = (out.as_chunks_mut::<4>().0, base.map(|base| base.as_chunks::<4>().0));
    if out.len() < texels || base.is_some_and(|base| base.len() < texels) {
        return;
    }
    for rect in rects {
        let rect = rect.intersect(TexelRect::whole(visible));
        for y in rect.min.y..rect.max.y {
            let depths = &field.depth.row(y as usize)[rect.min.x as usize..rect.max.x.max(rect.min.x) as usize];
            let first = (origin.y + y) as usize * size.x as usize + (origin.x + rect.min.x) as usize;
            for (i, &depth) in depths.iter().enumerate() {
                let before: Rgba = base.map_or([0, 0, 0, 255], |base| base[first + i]);
                out[first + i] = if depth == 0 || !look.glows() { before } else { lit(before, look.light(depth)) };
            }
        }
    }
}

fn lit([r, g, b, a]: Rgba, light: [f32; 3]) -> Rgba {
    let add = |byte: u8, light: f32| round((f32::from(byte) + light).clamp(0.0, 255.0)) as u8;
    [add(r, light[0]), add(g, light[1]), add(b, light[2]), a]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{paint::Look, pattern::SurfaceFrame};

    #[test]
    fn light_is_added_where_cracks_are_and_nowhere_else() {
        let size = UVec2::new(20, 9);
        let mut field = DepthField::new(SurfaceFrame::new(size).unwrap());
        for (x, depth) in (0u16..).zip(field.depth.row_mut(4)) {
            *depth = x * 3400;
        }
        let look = LookTable::new(&Look::GLOWING, 9.0).unwrap();
        let base = [10, 20, 30, 77].repeat(180);
        let mut out = vec![0; 720];
        paint_glow(Some(&base), size, &field, &look, &[TexelRect::whole(size)], UVec2::ZERO, &mut out);
        let texels = out.as_chunks::<4>().0;
        for (i, texel) in texels.iter().enumerate() {
            if i / 20 == 4 && i % 20 > 0 {
                assert!(texel[0] > 10 && texel[3] == 77, "{i}: {texel:?}");
            } else {
                assert_eq!(*texel, [10, 20, 30, 77], "{i}");
            }
        }
        assert!(texels[99][0] == 255 && texels[99][1] > texels[85][1], "brighter where it is deeper");
        // Without a glow it is the base, and with slices that are too short nothing happens.
        let dark = LookTable::new(&Look::GROOVE, 9.0).unwrap();
        paint_glow(Some(&base), size, &field, &dark, &[TexelRect::whole(size)], UVec2::ZERO, &mut out);
        assert_eq!(out, base);
        let mut short = vec![9; 719];
        paint_glow(None, size, &field, &look, &[TexelRect::whole(size)], UVec2::ZERO, &mut short);
        assert!(short.iter().all(|&byte| byte == 9));
        paint_glow(None, UVec2::MAX, &field, &look, &[TexelRect::whole(size)], UVec2::ZERO, &mut short);
    }
}
