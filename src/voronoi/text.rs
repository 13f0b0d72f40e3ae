//! Words as guides.

use crate::Grid;
use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};
use glam::{UVec2, Vec2};

/// The font that ships with the crate, as the content of a TTF file: Open Sans Extra Bold, for languages in Latin letters. Strokes
/// this wide are drawn well by cracks. Its licence is in `assets/CREDITS.md`.
pub const FONT: &[u8] = include_bytes!("../../assets/fonts/open_sans_extra_bold.ttf");

/// Share of the surface that stays free on each side.
const MARGIN: f32 = 0.06;

/// The lines of a text as a guide: 1 inside the letters, 0 outside, partial cover at their edges.
///
/// `font` is the content of a TTF or OTF file. The letters are as large as `size` allows, with a margin of 6 % on each side, but at most
/// `most` texels high. Letters that the font lacks are drawn as its box. A text without letters gives an empty guide. `None` if the
/// font cannot be read.
///
/// ```
/// use bevy_crack::voronoi::{FONT, draw_text};
///
/// let guide = draw_text(FONT, "ICE", [64, 32].into(), f32::INFINITY).unwrap();
/// assert!(guide.as_slice().contains(&1.0));
/// assert_eq!(draw_text(b"not a font", "ICE", [64, 32].into(), f32::INFINITY), None);
/// ```
#[must_use]
pub fn draw_text(font: &[u8], text: &str, size: UVec2, most: f32) -> Option<Grid<f32>> {
    let font = FontRef::try_from_slice(font).ok()?;
    let mut grid = Grid::new(size, 0.0f32);
    // Laid out at a size of 100, then scaled.
    let letters = lay_out(&font, text, 100.0);
    let Some((min, max)) = bounds(&font, &letters) else { return Some(grid) };
    let room = size.as_vec2() * (1.0 - 2.0 * MARGIN);
    let scale = (room / (max - min).max(Vec2::splat(1.0e-3))).min_element().min(most / 100.0);
    let letters = lay_out(&font, text, 100.0 * scale);
    let Some((min, max)) = bounds(&font, &letters) else { return Some(grid) };
    let shift = (size.as_vec2() - (max - min)) * 0.5 - min;
    for mut letter in letters {
        letter.position.x += shift.x;
        letter.position.y += shift.y;
        let Some(outline) = font.outline_glyph(letter) else { continue };
        let corner = outline.px_bounds().min;
        outline.draw(|x, y, cover| {
            let at = (corner.x + x as f32, corner.y + y as f32);
            if at.0 >= 0.0 && at.1 >= 0.0 && (at.0 as u32) < size.x && (at.1 as u32) < size.y {
                let value = &mut grid.row_mut(at.1 as usize)[at.0 as usize];
                *value = value.max(cover.min(1.0));
            }
        });
    }
    Some(grid)
}

fn lay_out(font: &FontRef<'_>, text: &str, scale: f32) -> Vec<Glyph> {
    let scaled = font.as_scaled(PxScale::from(scale));
    let line_width = |line: &str| {
        let mut width = 0.0;
        let mut before = None;
        for letter in line.chars() {
            let id = scaled.glyph_id(letter);
            width += before.map_or(0.0, |before| scaled.kern(before, id)) + scaled.h_advance(id);
            before = Some(id);
        }
        width
    };
    let mut glyphs = Vec::new();
    for (row, line) in text.lines().enumerate() {
        let mut x = -0.5 * line_width(line);
        let mut before = None;
        for letter in line.chars() {
            let id = scaled.glyph_id(letter);
            x += before.map_or(0.0, |before| scaled.kern(before, id));
            let y = row as f32 * scaled.height() * 0.85;
            glyphs.push(id.with_scale_and_position(scale, point(x, y)));
            x += scaled.h_advance(id);
            before = Some(id);
        }
    }
    glyphs
}

fn bounds(font: &FontRef<'_>, glyphs: &[Glyph]) -> Option<(Vec2, Vec2)> {
    let boxes = glyphs.iter().filter_map(|glyph| Some(font.outline_glyph(glyph.clone())?.px_bounds()));
    boxes
        .map(|b| (Vec2::new(b.min.x, b.min.y), Vec2::new(b.max.x, b.max.y)))
        .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}
