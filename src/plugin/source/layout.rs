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

/// Textures in which a picture is stretched or laid out have no more texels than this, unless the picture itself has.
pub(crate) const MOST_TEXELS: f32 = 2_097_152.0;
