//! Colors of height fields: [`TerrainColors`], [`colors`].

use super::{heights_error::HeightError, terrain_blur::blurred, terrain_noise::RowNoise, terrain_normals::Slopes};
use crate::{
    Grid,
    math::Rng,
    pattern::{MAX_SIDE, SurfaceFrame},
};
use glam::Vec3;

/// Ground that is not steep, from a height on up to that of the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ground {
    /// Where it begins, as a share of the way from the lowest height (the sea, if there is one) to the highest. 0..=1.
    pub from: f32,
    /// sRGB.
    pub color: [u8; 3],
}

/// The sea: all that lies below height 0.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sea {
    /// sRGB at the shore.
    pub shallow: [u8; 3],
    /// sRGB where it is deep.
    pub deep: [u8; 3],
    /// Depth at which the color is half way to `deep`, pattern units. 0.0001..=16.
    pub half: f32,
}

/// What the ground looks like, by its height, slope and shape.
///
/// Rock shows where the ground is steep. It has layers, strata, along its heights. Hollows are darker than edges.
///
/// ```
/// use bevy_crack::relief::TerrainColors;
///
/// let dark = TerrainColors { light: 0.0, ..TerrainColors::ROCK };
/// assert_eq!(dark.validate(), Ok(()));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TerrainColors {
    /// The sea, if there is one.
    pub sea: Option<Sea>,
    /// Ground that is not steep, from the lowest to the highest.
    pub ground: [Ground; 5],
    /// Width of the transition from one ground to the next, as a share of all heights. 0..=1.
    pub transition: f32,
    /// sRGB of rock: two kinds of strata.
    pub rock: [[u8; 3]; 2],
    /// Slopes, height per length, at which rock begins to show and at which it covers everything. 0..=100, the second
    /// above the first.
    pub steep: [f32; 2],
    /// Thickness of a stratum, pattern units. 0.0005..=16.
    pub stratum: f32,
    /// How much the color of rock changes from stratum to stratum. 0..=1.
    pub strata: f32,
    /// How much hollows are darker and edges lighter. 0..=1.
    pub cavity: f32,
    /// How much colors vary from place to place. 0..=1.
    pub variety: f32,
    /// How much light from the top left and shade are part of the colors: 0 for surfaces that the game lights. 0..=1.
    pub light: f32,
}

const fn ground(from: f32, color: [u8; 3]) -> Ground {
    Ground { from, color }
}

impl TerrainColors {
    /// Gray and ochre rock: a wall seen from the front.
    pub const ROCK: Self = Self {
        sea: None,
        ground: [
            ground(0.0, [104, 96, 87]),
            ground(0.3, [124, 114, 101]),
            ground(0.55, [138, 127, 112]),
            ground(0.8, [151, 141, 126]),
            ground(1.0, [163, 154, 140]),
        ],
        transition: 0.2,
        rock: [[118, 104, 90], [94, 87, 81]],
        steep: [0.5, 1.6],
        stratum: 0.022,
        strata: 0.6,
        cavity: 0.9,
        variety: 0.6,
        light: 0.35,
    };

    /// An island: sea, beach, grass, woods, rock and snow.
    pub const ISLAND: Self = Self {
        sea: Some(Sea { shallow: [86, 168, 170], deep: [16, 58, 98], half: 0.02 }),
        ground: [
            ground(0.0, [214, 196, 150]),
            ground(0.045, [116, 136, 66]),
            ground(0.3, [72, 100, 50]),
            ground(0.68, [124, 116, 100]),
            ground(0.86, [240, 243, 247]),
        ],
        transition: 0.1,
        rock: [[122, 110, 97], [92, 86, 82]],
        steep: [0.85, 1.5],
        stratum: 0.02,
        strata: 0.4,
        cavity: 0.55,
        variety: 0.7,
        light: 0.35,
    };

    /// High mountains: meadows, scree, rock and snow.
    pub const MOUNTAIN: Self = Self {
        sea: None,
        ground: [
            ground(0.0, [92, 104, 60]),
            ground(0.22, [108, 108, 72]),
            ground(0.42, [128, 118, 100]),
            ground(0.6, [148, 142, 134]),
            ground(0.7, [242, 245, 250]),
        ],
        transition: 0.08,
        rock: [[112, 104, 97], [82, 79, 79]],
        steep: [0.8, 1.5],
        stratum: 0.018,
        strata: 0.45,
        cavity: 0.6,
        variety: 0.65,
        light: 0.35,
    };

    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`HeightError::OutOfRange`] for the first number that is out of its range or not finite.
    pub fn validate(&self) -> Result<(), HeightError> {
        let mut ranges = vec![
            ("transition", self.transition, 0.0, 1.0),
            ("steep", self.steep[0], 0.0, 100.0),
            ("steep", self.steep[1], self.steep[0], 100.0),
            ("stratum", self.stratum, 0.0005, 16.0),
            ("strata", self.strata, 0.0, 1.0),
            ("cavity", self.cavity, 0.0, 1.0),
            ("variety", self.variety, 0.0, 1.0),
            ("light", self.light, 0.0, 1.0),
        ];
        ranges.extend(self.ground.map(|ground| ("ground", ground.from, 0.0, 1.0)));
        ranges.extend(self.sea.map(|sea| ("sea", sea.half, 0.0001, 16.0)));
        match ranges.into_iter().find(|(_, value, min, max)| !(*min..=*max).contains(value)) {
            Some((name, value, min, max)) => Err(HeightError::OutOfRange { name, value, min, max }),
            None => Ok(()),
        }
    }
}

impl Default for TerrainColors {
    fn default() -> Self {
        Self::ROCK
    }
}

/// Largest height, pattern units.
const MOST_HEIGHT: f32 = 1e6;

/// Checks that heights are finite and neither too many nor too few.
pub(super) fn check_heights(heights: &Grid<f32>, least: u32) -> Result<(), HeightError> {
    let size = heights.size();
    if size.min_element() < least || size.max_element() > MAX_SIDE {
        return Err(HeightError::Size { width: size.x, height: size.y, least, most: MAX_SIDE });
    }
    let is_wrong = |height: &f32| !(-MOST_HEIGHT..=MOST_HEIGHT).contains(height);
    match heights.as_slice().iter().position(is_wrong) {
        Some(i) => Err(HeightError::Height { x: i as u32 % size.x, y: i as u32 / size.x }),
        None => Ok(()),
    }
}

/// The colors of a height field: `[red, green, blue, 255]`, sRGB.
///
/// Heights are in pattern units, of texels as `frame` tells. `seed` is that of the variety.
///
/// # Errors
/// [`HeightError`] if a number of `colors` is out of range, or a height is not finite.
///
/// ```
/// use bevy_crack::{Grid, pattern::SurfaceFrame, relief::{TerrainColors, colors}};
///
/// // Sea on the left, land on the right.
/// let frame = SurfaceFrame::new([64, 64].into())?;
/// let shore = (0..64 * 64).map(|i| (i % 64) as f32 / 320.0 - 0.1).collect();
/// let heights = Grid::from_vec([64, 64].into(), shore).unwrap();
/// let picture = colors(&heights, &frame, &TerrainColors::ISLAND, 1)?;
/// let [red, _, blue, _] = picture.get(2, 30).unwrap();
/// assert!(blue > red);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn colors(
    heights: &Grid<f32>,
    frame: &SurfaceFrame,
    colors: &TerrainColors,
    seed: u64,
) -> Result<Grid<[u8; 4]>, HeightError> {
    colors.validate()?;
    check_heights(heights, 1)?;
    let mut painter = Painter::new(heights, frame, colors, seed);
    let mut out = Grid::new(heights.size(), [0, 0, 0, 255]);
    for y in 0..heights.height() {
        painter.paint_row(y, out.row_mut(y));
    }
    Ok(out)
}

/// Radii of the two blurs that tell hollows from edges, pattern units.
const RADII: [f32; 2] = [0.004, 0.022];

/// Where the light comes from: left, up, towards the viewer.
const LIGHT: Vec3 = Vec3::new(-0.48, -0.52, 0.706);

/// The colors of one row after another.
struct Painter<'a> {
    heights: &'a Grid<f32>,
    colors: &'a TerrainColors,
    slopes: Slopes<'a>,
    /// The height field, blurred by [`RADII`].
    blurs: [Grid<f32>; 2],
    /// Lowest and highest height, the lowest not below the sea.
    range: [f32; 2],
    noises: [RowNoise; 3],
    noise: [Vec<f32>; 3],
}

pub(super) fn smoothstep(from: f32, to: f32, value: f32) -> f32 {
    let share = ((value - from) / (to - from).max(1e-6)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

fn rgb(color: [u8; 3]) -> Vec3 {
    Vec3::from_array(color.map(f32::from))
}

impl<'a> Painter<'a> {
    fn new(heights: &'a Grid<f32>, frame: &SurfaceFrame, colors: &'a TerrainColors, seed: u64) -> Self {
        let unit = frame.texels_per_unit();
        let (low, high) =
            heights.as_slice().iter().fold((f32::MAX, f32::MIN), |(low, high), &h| (low.min(h), high.max(h)));
        let low = if colors.sea.is_some() { 0.0 } else { low };
        let width = heights.width();
        let mut rng = Rng::new(seed).stream("terrain colors");
        let mut noise =
            |scale: f32, octaves, persistence| RowNoise::new(width, [scale * unit; 2], octaves, persistence, &mut rng);
        Self {
            heights,
            colors,
            slopes: Slopes::new(heights, frame),
            blurs: RADII.map(|radius| blurred(heights, (radius * unit).round() as usize)),
            range: [low, high.max(low + 1e-6)],
            noises: [noise(0.25, 6, 0.62), noise(0.035, 4, 0.75), noise(0.012, 3, 0.8)],
            noise: std::array::from_fn(|_| vec![0.0; width]),
        }
    }

    fn paint_row(&mut self, y: usize, out: &mut [[u8; 4]]) {
        self.slopes.read(y);
        for (noise, row) in self.noises.iter_mut().zip(&mut self.noise) {
            noise.fill_row(y, row);
        }
        for (x, out) in out.iter_mut().enumerate() {
            let color = self.color(x, y);
            let [r, g, b] = color.to_array().map(|value| (value + 0.5) as u8);
            *out = [r, g, b, 255];
        }
    }

    /// The color of a texel, 0..=255.
    fn color(&self, x: usize, y: usize) -> Vec3 {
        let height = self.heights.row(y)[x];
        let noise: [f32; 3] = std::array::from_fn(|i| self.noise[i][x]);
        let (right, down) = (self.slopes.right[x], self.slopes.down[x]);
        let [fine, wide] =
            std::array::from_fn(|i| ((height - self.blurs[i].row(y)[x]) / RADII[i] * 1.6).clamp(-1.0, 1.0));
        let cavity = 1.0 + self.colors.cavity * (0.28 * fine + 0.3 * wide);
        let normal = Vec3::new(-right, -down, 1.0).normalize();
        if let Some(sea) = self.colors.sea.filter(|_| height < 0.0) {
            return self.sea(&sea, -height, noise);
        }
        let steep = (right * right + down * down).sqrt() * (1.0 + 0.25 * self.colors.variety * noise[1]);
        let rock = smoothstep(self.colors.steep[0], self.colors.steep[1], steep);
        let ground = self.ground(height, fine + wide, noise);
        let color = ground + (self.rock(height, noise) - ground) * rock;
        let lit = (normal.dot(LIGHT) / LIGHT.z).max(0.0);
        // Twilight from above beside the sun.
        let light = 1.0 + self.colors.light * (0.42 * normal.z + 0.2 + 0.5 * lit.min(1.6) - 1.0);
        let grain = 1.0 + self.colors.variety * (0.07 * noise[1] + 0.075 * noise[2]);
        (color * (cavity * light * grain).max(0.0)).min(Vec3::splat(255.0))
    }

    fn ground(&self, height: f32, edge: f32, noise: [f32; 3]) -> Vec3 {
        let [low, high] = self.range;
        let share = (height - low) / (high - low);
        // Borders between two kinds wander with the noise, and the upper kind lies in hollows first, as snow does.
        let wander = 0.6 * noise[0] + 0.35 * noise[1] - 0.25 * edge;
        let mut color = rgb(self.colors.ground[0].color);
        for ground in &self.colors.ground[1..] {
            let half = 0.5 * self.colors.transition;
            let moved = share + self.colors.variety * wander * (half + 0.13 * ground.from);
            color = color.lerp(rgb(ground.color), smoothstep(ground.from - half, ground.from + half, moved));
        }
        let tint = Vec3::new(1.0 + 0.05 * noise[0], 1.0, 1.0 - 0.05 * noise[0]);
        let patches = 1.0 + self.colors.variety * (0.1 * noise[0] + 0.06 * noise[1]);
        color * tint * patches
    }

    /// The color of rock: strata bend with the noise.
    fn rock(&self, height: f32, noise: [f32; 3]) -> Vec3 {
        let [first, second] = self.colors.rock.map(rgb);
        let place = height / self.colors.stratum + 1.3 * noise[0] + 0.25 * noise[1];
        let kind = |layer: f32| crate::math::hash_unit(0x57A7A, u64::from(layer as i32 as u32));
        let (layer, inside) = (place.floor(), place - place.floor());
        let share = kind(layer) + (kind(layer + 1.0) - kind(layer)) * smoothstep(0.55, 1.0, inside);
        let share = 0.5 + self.colors.strata * (share - 0.5) + 0.2 * self.colors.variety * noise[0];
        let seam = 1.0 - 0.22 * self.colors.strata * smoothstep(0.8, 0.97, inside) * smoothstep(-0.3, 0.4, noise[1]);
        first.lerp(second, share.clamp(0.0, 1.0)) * seam
    }

    fn sea(&self, sea: &Sea, depth: f32, noise: [f32; 3]) -> Vec3 {
        let share = depth / (depth + sea.half);
        let color = rgb(sea.shallow).lerp(rgb(sea.deep), (share + 0.05 * noise[0]).clamp(0.0, 1.0));
        // Foam at the shore.
        let foam = 0.55 * (1.0 - smoothstep(0.0, 0.07, share + 0.035 * noise[1]));
        color.lerp(Vec3::new(236.0, 242.0, 240.0), foam) * (1.0 + 0.02 * noise[1])
    }
}
