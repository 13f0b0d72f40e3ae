//! The colors of the texels of a height field: [`Painter`].

use super::{
    stones::Stones,
    terrain::{Patches, Sea, StoneColors, TerrainColors, Woods},
    terrain_check::smoothstep,
    terrain_noise::RowNoise,
    terrain_normals::Slopes,
    terrain_water::Water,
    terrain_wear::around,
};
use crate::{
    Grid,
    math::{Rng, mix, vectorized},
    pattern::SurfaceFrame,
};
use glam::{Vec2, Vec3};

/// Radii of the two blurs that tell hollows from edges, pattern units.
pub(super) const RADII: [f32; 2] = [0.004, 0.022];

/// Where the light comes from: left, up, towards the viewer.
const LIGHT: Vec3 = Vec3::new(-0.48, -0.52, 0.706);

/// Height from which on a stone is a stone, and at which its surface begins to show beside what lies in gaps, pattern
/// units.
pub(super) const STONE: [f32; 2] = [0.0015, 0.0055];

/// How much crowns differ in where they stand: the width of the edge of woods.
const THIN: f32 = 0.5;

/// The color of snow in shade, as a share of that in light.
const SHADY: Vec3 = Vec3::new(0.76, 0.84, 0.95);

/// What is measured of a height field before it is painted.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    /// Lowest and highest height, the lowest not below the sea.
    pub(super) range: [f32; 2],
    /// The height field, blurred by [`RADII`].
    pub(super) blurs: [Grid<f32>; 2],
    pub(super) stones: Option<Stones>,
    pub(super) water: Option<Water>,
}

/// The colors of one row after another.
#[derive(Clone, Debug)]
pub(super) struct Painter {
    colors: TerrainColors,
    frame: SurfaceFrame,
    slopes: Slopes,
    measured: Measured,
    noises: [RowNoise; 4],
    noise: [Vec<f32>; 4],
    seed: u64,
}

/// What is known of a texel.
struct Place {
    x: usize,
    y: usize,
    pos: Vec2,
    height: f32,
    /// Share of the way from the lowest to the highest.
    share: f32,
    /// Noise of large, middle and small features, and of streaks that run down.
    noise: [f32; 4],
    /// How far it stands out from its near and wide surroundings, -1..=1.
    edge: [f32; 2],
    slope: f32,
    moist: f32,
}

#[inline(always)]
fn rgb(color: [u8; 3]) -> Vec3 {
    Vec3::from_array(color.map(f32::from))
}

#[inline(always)]
fn unit_draws(seed: u64) -> [f32; 4] {
    let bits = mix(seed);
    [0, 16, 32, 48].map(|shift| f32::from((bits >> shift) as u16) * (1.0 / 65_536.0))
}

impl Painter {
    /// For rows of `width` texels.
    pub(super) fn new(
        width: usize,
        frame: &SurfaceFrame,
        colors: &TerrainColors,
        measured: Measured,
        seed: u64,
    ) -> Self {
        let unit = frame.texels_per_unit();
        let mut rng = Rng::new(seed).stream("terrain colors");
        let mut noise = |scale: [f32; 2], octaves, persistence| {
            RowNoise::new(width, scale.map(|scale| scale * unit), octaves, persistence, &mut rng)
        };
        let noises = [
            noise([0.25; 2], 6, 0.62),
            noise([0.035; 2], 4, 0.66),
            noise([0.012; 2], 2, 0.7),
            noise([0.035, 0.3], if colors.stains.is_some() { 3 } else { 0 }, 0.62),
        ];
        Self {
            colors: *colors,
            frame: *frame,
            slopes: Slopes::new(width, frame),
            measured,
            noises,
            noise: std::array::from_fn(|_| vec![0.0; width]),
            seed: mix(seed ^ 0xC0105),
        }
    }

    /// Paints row `y`.
    pub(super) fn paint_row(&mut self, heights: &Grid<f32>, y: usize, out: &mut [[u8; 4]]) {
        self.slopes.read(heights, y);
        for (noise, row) in self.noises.iter_mut().zip(&mut self.noise) {
            noise.fill_row(y, row);
        }
        if let Some(water) = &mut self.measured.water {
            water.moisture.read(y);
        }
        vectorized(
            #[inline(always)]
            || {
                for (x, out) in out.iter_mut().enumerate() {
                    let color = self.color(&self.place(heights.row(y)[x], x, y));
                    let [r, g, b] = color.to_array().map(|value| (value + 0.5) as u8);
                    *out = [r, g, b, 255];
                }
            },
        );
    }

    #[inline(always)]
    fn place(&self, height: f32, x: usize, y: usize) -> Place {
        let [right, down] = [self.slopes.right[x], self.slopes.down[x]];
        Place {
            x,
            y,
            pos: self.frame.to_pos(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)),
            height,
            share: (height - self.measured.range[0]) / (self.measured.range[1] - self.measured.range[0]),
            noise: std::array::from_fn(|i| self.noise[i][x]),
            edge: std::array::from_fn(|i| {
                ((height - self.measured.blurs[i].row(y)[x]) / RADII[i] * 1.6).clamp(-1.0, 1.0)
            }),
            slope: (right * right + down * down).sqrt(),
            moist: self.measured.water.as_ref().map_or(0.0, |water| water.moisture.row[x]),
        }
    }

    /// The color of a texel, 0..=255.
    #[inline(always)]
    fn color(&self, place: &Place) -> Vec3 {
        if let Some(sea) = self.colors.sea.filter(|_| place.height < 0.0) {
            let fresh = self.river(place) * (1.0 - smoothstep(0.0, 0.25, -place.height / sea.half));
            return match &self.colors.rivers {
                Some(_) => self.sea(&sea, place).lerp(rgb(sea.shallow), 0.75 * fresh),
                None => self.sea(&sea, place),
            };
        }
        let (variety, noise) = (self.colors.variety, place.noise);
        let mut color = self.dry(place);
        let mut shade = self.shade(place);
        if self.colors.stones.is_some() {
            // Little light falls into gaps.
            let open = smoothstep(-STONE[1], STONE[1], place.height);
            shade = shade.min(1.15) + (shade - shade.min(1.15)) * open;
            shade = shade.max(0.62 * (1.0 - open));
        }
        let mut grain = 1.0 + variety * (0.07 * noise[1] + 0.075 * noise[2]);
        if let Some((woods, lush)) = self.woods(place).filter(|(_, lush)| *lush > -0.5 * THIN) {
            let (crown, light, share) = self.crown(&woods, place, lush);
            color = color.lerp(crown, share);
            shade *= 1.0 + share * (light - 1.0);
            grain += (1.0 - grain) * share;
        }
        if let Some(rivers) = &self.colors.rivers {
            let share = self.river(place);
            let tide = self.colors.sea.map_or(0.0, |_| 0.75 * smoothstep(0.006, 0.0, place.height));
            let shallow = self.colors.sea.map_or(Vec3::ZERO, |sea| rgb(sea.shallow));
            color = color.lerp(rgb(rivers.color).lerp(shallow, tide), share);
            shade += (1.0 - shade) * 0.7 * share;
        }
        (color * (shade * grain).max(0.0)).min(Vec3::splat(255.0))
    }

    /// Share of a place that is river.
    #[inline(always)]
    fn river(&self, place: &Place) -> f32 {
        let rivers = self.measured.water.as_ref().and_then(|water| water.rivers.as_ref());
        rivers.map_or(0.0, |rivers| rivers.row(place.y)[place.x])
    }

    /// How far a place faces the light, about -1..=1.
    #[inline(always)]
    fn facing(&self, place: &Place) -> f32 {
        -(self.slopes.right[place.x] * LIGHT.x + self.slopes.down[place.x] * LIGHT.y)
    }

    /// Light and shade.
    #[inline(always)]
    fn shade(&self, place: &Place) -> f32 {
        let (right, down) = (self.slopes.right[place.x], self.slopes.down[place.x]);
        let cavity = 1.0 + self.colors.cavity * (0.28 * place.edge[0] + 0.3 * place.edge[1]);
        let normal = Vec3::new(-right, -down, 1.0).normalize();
        let lit = (normal.dot(LIGHT) / LIGHT.z).max(0.0);
        // Twilight from above beside the sun.
        cavity
            * (1.0
                + self.colors.light
                    * (0.34 * normal.z + 0.3 + 0.48 * (lit.min(1.0) + 0.4 * (lit - 1.0).clamp(0.0, 0.8)) - 1.0))
    }

    /// Ground and rock.
    #[inline(always)]
    fn dry(&self, place: &Place) -> Vec3 {
        let [ground, snow] = self.ground(place);
        let steep = place.slope * (1.0 + 0.25 * self.colors.variety * place.noise[1]);
        // Sand and snow lie on less and on more than other ground.
        let low = 1.0 - smoothstep(0.5, 1.3, place.share / self.colors.ground[1].from.max(1e-3));
        let steep = if self.colors.sea.is_some() { steep * (1.0 + 1.2 * low) - 0.5 * snow.x } else { steep };
        let rock = smoothstep(self.colors.steep[0], self.colors.steep[1], steep);
        let Some(stones) = self.colors.stones else {
            // Scree lies below rock.
            let high = smoothstep(0.3, 0.62, place.share + 0.12 * place.noise[0]);
            let loose =
                high * smoothstep(0.7 * self.colors.steep[0], self.colors.steep[0], steep + 0.2 * place.noise[1]);
            let bare = self.rock(place, 0);
            return ground.lerp(bare * (1.12 + 0.1 * place.noise[2]), 0.6 * loose).lerp(bare, rock);
        };
        self.stone(&stones, place, ground, rock)
    }

    /// The surface of a stone, or what lies beside it.
    #[inline(always)]
    fn stone(&self, stones: &StoneColors, place: &Place, ground: Vec3, steep: f32) -> Vec3 {
        let share = smoothstep(STONE[0], STONE[1], place.height + 0.003 * place.noise[1]);
        let gap = || self.gap(stones, place, ground);
        let face = || self.face(stones, place, ground, steep);
        if share <= 0.0 {
            gap()
        } else if share < 1.0 {
            gap().lerp(face(), share)
        } else {
            face()
        }
    }

    /// What lies in a gap: earth and loose pieces of the same rock.
    #[inline(always)]
    fn gap(&self, stones: &StoneColors, place: &Place, ground: Vec3) -> Vec3 {
        let noise = place.noise;
        let mottled = 1.0 + self.colors.variety * (0.12 * noise[2] + 0.3 * noise[1] + 0.3 * noise[0]);
        let piece = ground.lerp(self.rock(place, 0), 0.5) * 0.72;
        rgb(stones.gap).lerp(piece, 0.8 * smoothstep(-0.3, 0.8, place.edge[0])) * mottled.max(0.4)
    }

    /// The surface of a stone.
    #[inline(always)]
    fn face(&self, stones: &StoneColors, place: &Place, ground: Vec3, steep: f32) -> Vec3 {
        let stone = self.measured.stones.as_ref().and_then(|stones| stones.at(place.x, place.y));
        let mut color = ground.lerp(self.rock(place, stone.map_or(0, |stone| stone.seed)), 0.35 + 0.4 * steep);
        if let Some(stone) = stone {
            let [light, warm, cool, _] = unit_draws(stone.seed ^ 0x70_4E);
            let warm = stones.tone * 0.26 * (0.5 * (warm + cool) - 0.5);
            color *= 1.0 + stones.tone * 0.6 * (light - 0.5);
            color *= Vec3::new(1.0 + warm, 1.0 + 0.15 * warm, 1.0 - warm);
        }
        self.patches(color, place)
    }

    /// Stains and lichen on rock.
    #[inline(always)]
    fn patches(&self, color: Vec3, place: &Place) -> Vec3 {
        let noise = place.noise;
        let cover = |patches: &Patches, value: f32, soft: f32| {
            let from = 0.75 - 1.3 * patches.share;
            if patches.share > 0.0 { smoothstep(from, from + soft, value) } else { 0.0 }
        };
        let mut color = color;
        if let Some(stains) = &self.colors.stains {
            let share = cover(stains, 0.9 * noise[3] + 0.55 * noise[0] + 0.1 * noise[1], 0.55);
            // They darken what they cover.
            color = color.lerp(rgb(stains.color) * (color.element_sum() / 400.0), 0.5 * share);
        }
        if let Some(lichen) = &self.colors.lichen {
            let value = 0.75 * noise[1] - 0.55 * noise[0] + 0.12 * noise[2] + 0.25 * place.edge[1];
            color = color.lerp(rgb(lichen.color), 0.55 * cover(lichen, value, 0.4));
        }
        color
    }

    /// The color of the ground, and how far it is the uppermost kind.
    #[inline(always)]
    fn ground(&self, place: &Place) -> [Vec3; 2] {
        let noise = place.noise;
        // Borders between two kinds wander with the noise, and the upper kind lies in hollows first, as snow does.
        let wander = 0.6 * noise[0] + 0.35 * noise[1] - 0.25 * (place.edge[0] + place.edge[1]);
        let (mut color, mut last) = (rgb(self.colors.ground[0].color), 0.0);
        let facing = self.facing(place);
        // Height by the wider surroundings, so that crests have no line of their own.
        let around = (self.measured.blurs[1].row(place.y)[place.x] - self.measured.range[0])
            / (self.measured.range[1] - self.measured.range[0]);
        let broad = 0.4 * place.share + 0.6 * around;
        for (i, ground) in self.colors.ground.iter().enumerate().skip(1) {
            let half = (0.5 * self.colors.transition).min(0.35 * ground.from) * if i == 4 { 1.8 } else { 1.0 };
            let wide = 0.3 * half + 0.16 * ground.from;
            let moved = match (i, self.colors.stones) {
                // Beaches have a smooth edge.
                (1, None) if self.colors.sea.is_some() => {
                    let even = self.measured.blurs[0].row(place.y)[place.x]
                        / (self.measured.range[1] - self.measured.range[0]);
                    even + self.colors.variety * noise[0] * 0.5 * ground.from
                }
                // Snow stays where it is shady and not steep.
                (4, None) => {
                    let crest = place.edge[1].max(0.0);
                    let stays =
                        0.11 - 0.12 * crest - 0.09 * facing.clamp(-0.8, 1.0) - 0.1 * smoothstep(0.7, 1.5, place.slope);
                    broad + self.colors.variety * (wander * wide + stays + 0.06 * noise[0] + 0.05 * noise[1])
                }
                (3, None) => broad + self.colors.variety * wander * wide,
                _ => place.share + self.colors.variety * wander * wide,
            };
            last = smoothstep(ground.from - half, ground.from + half, moved);
            let shady = if i == 4 { smoothstep(0.15, -0.6, facing) } else { 0.0 };
            color = color.lerp(rgb(ground.color) * Vec3::ONE.lerp(SHADY, shady), last);
        }
        let tint = Vec3::new(1.0 + 0.05 * noise[0], 1.0, 1.0 - 0.05 * noise[0]);
        // Ground that water runs to is greener, ridges are dry.
        let dry = if self.measured.water.is_some() { (1.0 - last) * (0.45 - place.moist) } else { 0.0 };
        let tint = tint * Vec3::new(1.0 + 0.26 * dry, 1.0 + 0.06 * dry, 1.0);
        let patches = 1.0 + self.colors.variety * (0.1 * noise[0] + 0.06 * noise[1]);
        [color * tint * patches, Vec3::splat(last)]
    }

    /// The color of rock: strata bend with the noise. Those of stones lie as each stone does.
    #[inline(always)]
    fn rock(&self, place: &Place, stone: u64) -> Vec3 {
        let [first, second] = self.colors.rock.map(rgb);
        let noise = place.noise;
        let [tilt, shift, ..] = unit_draws(stone);
        let across = place.pos.y + (tilt - 0.5) * place.pos.x;
        let along = if self.colors.stones.is_some() { across + 16.0 * shift } else { place.height };
        let layers = along / self.colors.stratum + 1.3 * noise[0] + 0.25 * noise[1];
        let kind = |layer: f32| crate::math::hash_unit(0x57A7A, u64::from(layer as i32 as u32));
        let (layer, inside) = (layers.floor(), layers - layers.floor());
        let share = kind(layer) + (kind(layer + 1.0) - kind(layer)) * smoothstep(0.55, 1.0, inside);
        let share = 0.5 + self.colors.strata * (share - 0.5) + 0.2 * self.colors.variety * noise[0];
        let seam = 1.0 - 0.22 * self.colors.strata * smoothstep(0.8, 0.97, inside) * smoothstep(-0.3, 0.4, noise[1]);
        first.lerp(second, share.clamp(0.0, 1.0)) * seam
    }

    /// How lush woods are at a place: above 0 they cover it.
    #[inline(always)]
    fn woods(&self, place: &Place) -> Option<(Woods, f32)> {
        let woods = self.colors.woods?;
        if woods.spread <= 0.0 {
            return None;
        }
        let noise = place.noise;
        let low = self.colors.ground[1].from;
        let high = smoothstep(woods.top * 0.7, woods.top * 1.1, place.share + 0.06 * noise[1]);
        let shore = if self.colors.sea.is_some() {
            1.0 - smoothstep(low, 3.0 * low, place.share + 0.01 * noise[1])
        } else {
            0.0
        };
        let bare = 1.3 * high + 1.4 * shore + 1.3 * smoothstep(1.05, 1.8, place.slope);
        let lush = 1.6 * (woods.spread - 0.5) + 1.3 * (place.moist - 0.42) + 0.55 * noise[0] + 0.3 * noise[1];
        let hollow = -0.3 * (place.edge[1] + 0.5 * place.edge[0]);
        Some((woods, lush + hollow + 0.08 * noise[2] - bare))
    }

    /// Color and light of the crowns at a place, and how far they cover it. At the edge of woods crowns stand apart.
    #[inline(always)]
    fn crown(&self, woods: &Woods, place: &Place, lush: f32) -> (Vec3, f32, f32) {
        let (mut cover, mut sums, mut weights) = (0.0f32, Vec3::ZERO, 1e-3);
        for (off, [.., tone, hue]) in around(self.seed, place.pos / woods.crown) {
            let square = off.length_squared();
            let near = (1.0 - square).max(0.0);
            let weight = near * near * near;
            let light = (1.1 - 0.55 * square.min(1.0)) * (1.0 + 0.55 * off.dot(Vec2::new(LIGHT.x, LIGHT.y)));
            sums += weight * Vec3::new(light, tone, hue);
            weights += weight;
            let stands = smoothstep(-0.08, 0.08, lush - THIN * (tone - 0.5));
            cover = cover.max(stands * smoothstep(0.55, 0.12, square));
        }
        let [light, tone, hue] = (sums / weights).to_array();
        let share = cover.max(0.9 * smoothstep(0.1, 0.5, lush));
        // Light woods on dry ground, dark ones in moist hollows.
        let dark = smoothstep(-0.35, 0.35, 0.7 * place.noise[0] + 1.2 * (place.moist - 0.5) + 0.25 * place.noise[1]);
        let kind = Vec3::new(1.42, 1.3, 1.05).lerp(Vec3::new(0.86, 0.92, 1.0), dark);
        let color = rgb(woods.color) * kind * (0.78 + 0.44 * tone);
        (color * Vec3::new(0.88 + 0.3 * hue, 1.0, 0.95), light, share)
    }

    #[inline(always)]
    fn sea(&self, sea: &Sea, place: &Place) -> Vec3 {
        let noise = place.noise;
        let blurred = -self.measured.blurs[0].row(place.y)[place.x];
        let depth = (0.5 * -place.height + 0.5 * blurred.max(0.0)) * (1.0 + 0.12 * noise[0] + 0.1 * noise[1]);
        let depth = depth / sea.half;
        let share = depth * depth / (depth * depth + 1.0);
        let sand = rgb(self.colors.ground[0].color);
        // Weeds and reefs make shallow ground dark in places.
        let weeds = 0.3 * smoothstep(0.05, 0.6, 0.8 * noise[1] + 0.6 * noise[0]) * smoothstep(0.1, 0.4, depth);
        let shallow = rgb(sea.shallow) * (1.0 - self.colors.variety * weeds);
        let color = sand.lerp(shallow, 0.3 + 0.7 * smoothstep(0.0, 0.22, depth)).lerp(rgb(sea.deep), share);
        // Surf: a thin line that breaks off.
        let texel = 1.0 / self.frame.texels_per_unit();
        let away = -place.height / place.slope.max(0.02);
        let line = |at: f32, half: f32| 1.0 - smoothstep(0.5 * half, half, (away - at).abs());
        let surf =
            0.65 * line(0.0, (0.0022f32).max(1.2 * texel)) * smoothstep(-0.05, 0.5, 0.8 * noise[1] + 0.5 * noise[0]);
        let second = 0.3 * line(0.007, (0.0018f32).max(texel)) * smoothstep(0.0, 0.5, noise[1] - 0.5 * noise[0]);
        color.lerp(Vec3::new(236.0, 242.0, 240.0), surf.max(second) * smoothstep(0.4, 0.15, depth))
            * (1.0 + 0.05 * noise[0] + 0.02 * noise[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relief::colors;

    fn mean(picture: &Grid<[u8; 4]>, columns: std::ops::Range<usize>) -> Vec3 {
        let texels = (0..picture.height()).flat_map(|y| &picture.row(y)[columns.clone()]);
        texels.map(|&[r, g, b, _]| rgb([r, g, b])).sum::<Vec3>() / (columns.len() * picture.height()) as f32
    }

    /// Two flat stones have colors of their own, the gap between them is darker.
    #[test]
    fn stones_differ_and_gaps_are_dark() {
        let size = [200, 100];
        let frame = SurfaceFrame::new(size.into()).unwrap();
        let heights = (0..size[0] * size[1]).map(|i| if (90..110).contains(&(i % size[0])) { -0.01 } else { 0.05 });
        let heights = Grid::from_vec(size.into(), heights.collect()).unwrap();
        let even = TerrainColors { variety: 0.0, strata: 0.0, stains: None, lichen: None, ..TerrainColors::ROCK };
        let paint = |tone: f32| {
            let stones = even.stones.map(|stones| StoneColors { tone, ..stones });
            colors(&heights, &frame, &TerrainColors { stones, ..even }, 4).unwrap()
        };
        let differ = |picture: &Grid<[u8; 4]>| mean(picture, 10..70).distance(mean(picture, 130..190));
        let (plain, toned) = (paint(0.0), paint(1.0));
        assert!(differ(&plain) < 8.0 && differ(&toned) > 12.0, "{} {}", differ(&plain), differ(&toned));
        let gap = mean(&toned, 95..105).element_sum();
        assert!(gap < 0.7 * mean(&toned, 10..70).element_sum() && gap < 0.7 * mean(&toned, 130..190).element_sum());
        assert_eq!(toned, paint(1.0));
    }

    /// In a valley there are woods and a river; on its sides, which are steep, there are none.
    #[test]
    fn woods_and_rivers_lie_in_valleys() {
        let size = [240, 240];
        let frame = SurfaceFrame::new(size.into()).unwrap();
        let height = |i: u32| {
            let (x, y) = ((i % size[0]) as f32 / 240.0, (i / size[0]) as f32 / 240.0);
            0.02 + 0.05 * x + (2.2 * ((y - 0.5).abs() - 0.1)).max(0.0)
        };
        let heights = Grid::from_vec(size.into(), (0..size[0] * size[1]).map(height).collect()).unwrap();
        let bare = TerrainColors::ISLAND.woods.map(|woods| Woods { spread: 0.0, ..woods });
        let plain = TerrainColors { sea: None, woods: bare, rivers: None, variety: 0.0, ..TerrainColors::ISLAND };
        let woods = TerrainColors { woods: TerrainColors::ISLAND.woods, ..plain };
        let rivers = TerrainColors { rivers: TerrainColors::ISLAND.rivers, ..plain };
        let paint = |look: &TerrainColors| colors(&heights, &frame, look, 4).unwrap();
        let (before, woods, rivers) = (paint(&plain), paint(&woods), paint(&rivers));
        let changed = |picture: &Grid<[u8; 4]>, rows: std::ops::Range<usize>| {
            let far = |y: usize, x: usize| {
                let green = |grid: &Grid<[u8; 4]>| i32::from(grid.row(y)[x][0]);
                (green(picture) - green(&before)).abs() > 12
            };
            rows.map(|y| (40..200).filter(|x| far(y, *x)).count()).sum::<usize>()
        };
        assert!(changed(&woods, 105..135) > 1000 && changed(&woods, 10..50) == 0, "{}", changed(&woods, 105..135));
        assert!((20..2000).contains(&changed(&rivers, 95..145)) && changed(&rivers, 10..50) == 0);
    }
}
