//! [`Layout`]: a picture that is laid out over what shows it, repeated or in nine parts.

use bevy::prelude::*;
use std::hash::{Hash, Hasher};

/// The smallest share of its own size at which a picture is repeated, as the engine has it.
const LEAST_STRETCH: f32 = 0.001;

/// How a picture is laid out over a sprite: its borders as they are, what lies between them stretched or repeated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// Size of the sprite; `None` = that of its picture.
    pub(crate) size: Option<Vec2>,
    /// Whether textures have the size of the picture: another one would change where the sprite is shown.
    pub(crate) keeps_size: bool,
    /// Widths of the borders at the left and the top, texels of the picture.
    pub(crate) low: Vec2,
    /// The same at the right and the bottom.
    pub(crate) high: Vec2,
    /// The most that the borders are scaled by.
    pub(crate) max_scale: f32,
    /// The size at which borders are repeated along the sides, as a share of their own; `None` = they are stretched.
    pub(crate) sides: Option<f32>,
    /// The same of what lies between them, along and down.
    pub(crate) middle: [Option<f32>; 2],
}

/// Two are the same if their numbers are, bit for bit.
impl PartialEq for Layout {
    fn eq(&self, other: &Self) -> bool {
        self.bits() == other.bits()
    }
}

impl Eq for Layout {}

impl Hash for Layout {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.bits().hash(state);
    }
}

impl Layout {
    fn bits(&self) -> ([Option<u32>; 10], bool) {
        let Self { size, keeps_size, low, high, max_scale, sides, middle: [across, down] } = *self;
        let [c, d, e, f, g] = [low.x, low.y, high.x, high.y, max_scale].map(Some);
        let (a, b) = (size.map(|size| size.x), size.map(|size| size.y));
        ([a, b, c, d, e, f, g, sides, across, down].map(|value| value.map(f32::to_bits)), keeps_size)
    }

    /// For a picture of this size: where its borders leave no room it is merely stretched.
    fn fit(self, picture: UVec2) -> Fitted {
        let picture = picture.as_vec2();
        let size = self.size.unwrap_or(picture);
        let layout = if (self.low + self.high).cmpge(picture).any() {
            Self { low: Vec2::ZERO, high: Vec2::ZERO, sides: None, middle: [None; 2], ..self }
        } else {
            self
        };
        Fitted { layout, picture, size, scale: (size / picture).min_element().min(self.max_scale) }
    }

    /// Size of textures that show as much as a picture of this size has.
    pub(crate) fn texels(&self, picture: UVec2) -> UVec2 {
        if self.keeps_size { picture } else { self.fit(picture).texels() }
    }

    /// For each texel of textures of this size the place in the picture that is shown there, in texels.
    pub(crate) fn places(&self, picture: UVec2, texels: UVec2) -> impl Fn(u32, u32) -> Vec2 + use<> {
        self.fit(picture).places(texels)
    }
}

/// A [`Layout`] of a picture.
struct Fitted {
    layout: Layout,
    /// Size of the picture, texels.
    picture: Vec2,
    /// Size of the sprite.
    size: Vec2,
    /// What the borders are scaled by.
    scale: f32,
}

impl Fitted {
    fn texels(&self) -> UVec2 {
        let Layout { low, high, sides, middle, .. } = self.layout;
        let has_borders = low + high != Vec2::ZERO && self.scale > 0.0;
        // The finest of its parts.
        let density = |axis: usize| {
            let parts = [has_borders.then_some(self.scale), sides.filter(|_| has_borders), middle[axis]];
            let finest = parts.into_iter().flatten().reduce(f32::min);
            finest.map_or(self.picture[axis] / self.size[axis], |scale| scale.max(LEAST_STRETCH).recip())
        };
        let texels = self.size * Vec2::new(density(0), density(1));
        let shrink = (MOST_TEXELS / texels.element_product()).sqrt().min(1.0);
        (texels * shrink).round().as_uvec2().max(UVec2::ONE)
    }

    fn places(&self, texels: UVec2) -> impl Fn(u32, u32) -> Vec2 + use<> {
        let Layout { sides, middle, .. } = self.layout;
        let [columns, rows] = [0, 1].map(|axis| [middle[axis], sides].map(|tile| self.along(axis, texels[axis], tile)));
        move |x, y| {
            let ((across, is_side), (down, is_end)) = (columns[0][x as usize], rows[0][y as usize]);
            // Along a border it is repeated as borders are.
            Vec2::new(
                if is_end { columns[1][x as usize].0 } else { across },
                if is_side { rows[1][y as usize].0 } else { down },
            )
        }
    }

    /// The place in the picture along one axis, and whether it is in a border, for each texel.
    fn along(&self, axis: usize, texels: u32, tile: Option<f32>) -> Vec<(f32, bool)> {
        let (picture, size, scale) = (self.picture[axis], self.size[axis], self.scale);
        let (low, high) = (self.layout.low[axis], self.layout.high[axis]);
        let (start, end) = (low * scale, size - high * scale);
        let (length, between) = (end - start, picture - low - high);
        let period = tile.map_or(length, |stretch| (between * stretch.max(LEAST_STRETCH)).max(1.0).min(length));
        let place = |i: u32| {
            let at = (i as f32 + 0.5) / texels as f32 * size;
            let (place, is_border) = if at < start {
                (at / scale, true)
            } else if at >= end {
                (picture - (size - at) / scale, true)
            } else {
                (low + (at - start) % period / period * between, false)
            };
            // Of wild numbers anything may come.
            (if place.is_finite() { place } else { 0.0 }, is_border)
        };
        (0..texels).map(place).collect()
    }
}

#[cfg(all(test, feature = "2d"))]
mod tests {
    use super::*;
    use crate::{math::Rng, plugin::carrier::sprite};
    use bevy::sprite::{BorderRect, SliceScaleMode, SpriteImageMode, TextureSlice, TextureSlicer};

    /// The parts into which the engine cuts a sprite.
    fn parts(mode: &SpriteImageMode, picture: Vec2, size: Vec2) -> Vec<TextureSlice> {
        let texture_rect = Rect { min: Vec2::ZERO, max: picture };
        match mode {
            SpriteImageMode::Sliced(slicer) => slicer.compute_slices(texture_rect, Some(size)),
            SpriteImageMode::Tiled { tile_x, tile_y, stretch_value } => {
                TextureSlice { texture_rect, draw_size: size, offset: Vec2::ZERO }
                    .tiled(*stretch_value, (*tile_x, *tile_y))
            }
            _ => Vec::new(),
        }
    }

    /// The place in the picture that one of the parts shows at a point of the sprite (from its top left).
    fn shown(parts: &[TextureSlice], size: Vec2, at: Vec2) -> Option<Vec2> {
        let at = (at - size / 2.0) * Vec2::new(1.0, -1.0);
        parts.iter().find_map(|part| {
            let share = (at - part.offset) * Vec2::new(1.0, -1.0) / part.draw_size + 0.5;
            let is_inside = share.cmpge(Vec2::ZERO).all() && share.cmple(Vec2::ONE).all();
            is_inside.then(|| part.texture_rect.min + share * part.texture_rect.size())
        })
    }

    #[test]
    fn places_are_those_of_the_parts_that_the_engine_draws() {
        let mut rng = Rng::new(5);
        let (mut checked, mut cut) = (0, 0);
        for round in 0..300 {
            let picture = UVec2::new(8 + rng.next_u32() % 60, 8 + rng.next_u32() % 60);
            let size = Vec2::new(rng.range(5.0, 300.0), rng.range(5.0, 300.0));
            let mut scale_mode = || match rng.next_u32() % 2 {
                0 => SliceScaleMode::Stretch,
                _ => SliceScaleMode::Tile { stretch_value: rng.range(0.2, 2.0) },
            };
            let (center_scale_mode, sides_scale_mode) = (scale_mode(), scale_mode());
            let mode = if round % 2 == 0 {
                let mut inset = || Vec2::new(rng.range(0.5, 3.9), rng.range(0.5, 3.9));
                SpriteImageMode::Sliced(TextureSlicer {
                    border: BorderRect { min_inset: inset(), max_inset: inset() },
                    center_scale_mode,
                    sides_scale_mode,
                    max_corner_scale: rng.range(0.3, 2.0),
                })
            } else {
                let [tile_x, tile_y] = [(); 2].map(|()| rng.unit() < 0.5);
                SpriteImageMode::Tiled { tile_x, tile_y, stretch_value: rng.range(0.1, 2.0) }
            };
            let parts = parts(&mode, picture.as_vec2(), size);
            let Some(layout) = sprite::layout(&mode, Some(size)) else {
                assert!(matches!(mode, SpriteImageMode::Tiled { tile_x: false, tile_y: false, .. }));
                continue;
            };
            let texels = UVec2::new(1 + rng.next_u32() % 90, 1 + rng.next_u32() % 90);
            let places = layout.places(picture, texels);
            for _ in 0..60 {
                let texel = UVec2::new(rng.next_u32() % texels.x, rng.next_u32() % texels.y);
                let at = (texel.as_vec2() + 0.5) / texels.as_vec2() * size;
                // Where parts meet, rounding decides; so only what is the same a little to all sides is compared.
                let near = [Vec2::X, Vec2::Y, -Vec2::X, -Vec2::Y].map(|side| shown(&parts, size, at + 1e-3 * side));
                let Some(want) = shown(&parts, size, at) else { continue };
                if near.iter().any(|near| near.is_none_or(|near| near.distance(want) > 0.1)) {
                    cut += 1;
                    continue;
                }
                let got = places(texel.x, texel.y);
                assert!(got.distance(want) < 0.05, "{mode:?} {picture} {size} {texel} of {texels}: {got}, not {want}");
                checked += 1;
            }
        }
        assert!(checked > 50 * cut && checked > 10_000, "{checked} places checked, {cut} lie where parts meet");
    }

    #[test]
    fn textures_show_as_much_as_the_picture_has() {
        let size = Vec2::new(300.0, 100.0);
        let texels = |mode: &SpriteImageMode, size| {
            sprite::layout(mode, Some(size)).unwrap().texels(UVec2::splat(64)).to_array()
        };
        let tiled = |stretch_value, tile_y| SpriteImageMode::Tiled { tile_x: true, tile_y, stretch_value };
        assert_eq!(texels(&tiled(1.0, true), size), [300, 100]);
        assert_eq!(texels(&tiled(0.5, true), size), [600, 200]);
        assert_eq!(texels(&tiled(2.0, false), size), [150, 64]);
        let nine = SpriteImageMode::Sliced(TextureSlicer { border: BorderRect::all(8.0), ..default() });
        assert_eq!(texels(&nine, size), [300, 100]);
        assert_eq!(texels(&nine, Vec2::new(300.0, 32.0)), [600, 64], "its corners are shown at half their size");
        let hidden = TextureSlicer { border: BorderRect::all(8.0), max_corner_scale: 0.0, ..default() };
        assert_eq!(texels(&SpriteImageMode::Sliced(hidden), size), [64, 64], "its borders are not shown");
        let crowded = SpriteImageMode::Sliced(TextureSlicer { border: BorderRect::all(32.0), ..default() });
        assert_eq!(texels(&crowded, size), [64, 64], "its borders leave no room");
        assert_eq!(sprite::layout(&tiled(0.5, true), None).unwrap().texels(UVec2::new(64, 32)), UVec2::new(128, 64));
        let fine = SliceScaleMode::Tile { stretch_value: 0.25 };
        let nine = TextureSlicer { border: BorderRect::all(8.0), center_scale_mode: fine, ..default() };
        assert_eq!(texels(&SpriteImageMode::Sliced(nine), size), [1200, 400], "its middle at a quarter");
        let [width, height] = texels(&tiled(0.001, true), Vec2::splat(1.0e9));
        assert!(width == height && width * height <= 2_097_152, "{width} x {height}");
    }
}

/// Textures in which a picture is stretched or laid out have no more texels than this, unless the picture itself has.
pub(crate) const MOST_TEXELS: f32 = 2_097_152.0;
