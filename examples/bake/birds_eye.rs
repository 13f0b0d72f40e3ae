//! A bird's-eye view of a height field: rays marched through it, with sun, shadows, light of the sky, haze and sea.

use bevy_crack::{Grid, math::ops, pattern::SurfaceFrame};
use glam::{UVec2, Vec2, Vec3};
use image::{Rgba, RgbaImage};
use std::thread;

/// Where the viewer is, and what there is beside the ground.
#[derive(Clone, Copy)]
pub(crate) struct View {
    /// Size of the picture, texels.
    pub(crate) size: UVec2,
    /// Direction from which the viewer looks, degrees around from the bottom of the surface.
    pub(crate) around: f32,
    /// Angle at which the viewer looks down, degrees.
    pub(crate) down: f32,
    /// Distance of the viewer from the middle, pattern units.
    pub(crate) distance: f32,
    /// Whether the ground lies in a sea whose surface is at height 0.
    pub(crate) sea: bool,
}

impl View {
    pub(crate) const WIDE: Self =
        Self { size: UVec2::new(1200, 675), around: 24.0, down: 27.0, distance: 1.35, sea: false };
    /// Nearly from above: a wall seen from the front.
    pub(crate) const FRONT: Self = Self { around: 0.0, down: 74.0, distance: 1.0, ..Self::WIDE };
}

/// Towards the sun: right, up, towards the bottom of the surface.
const SUN: Vec3 = Vec3::new(-0.78, 0.5, 0.22);
const SUNLIGHT: Vec3 = Vec3::new(1.5, 1.32, 1.05);
const SKYLIGHT: Vec3 = Vec3::new(0.26, 0.34, 0.47);
const HAZE: Vec3 = Vec3::new(0.60, 0.70, 0.82);
const ZENITH: Vec3 = Vec3::new(0.24, 0.42, 0.68);

/// Rays for each texel of the picture, across and down.
const RAYS: u32 = 2;

struct Scene<'a> {
    heights: &'a Grid<f32>,
    colors: &'a Grid<[u8; 4]>,
    unit: f32,
    highest: f32,
    lowest: f32,
    /// Mean color at the border, linear: that of all that lies outside.
    outside: Vec3,
    sun: Vec3,
    sea: bool,
}

/// Between the four values around a place, in texels; those at the border continue outside.
fn sampled<T>(grid: &Grid<T>, at: Vec2, value: impl Fn(T) -> Vec3) -> Vec3
where
    T: Copy,
{
    let last = (grid.size() - 1).as_vec2();
    let at = (at - 0.5).clamp(Vec2::ZERO, last);
    let (base, share) = (at.floor(), at - at.floor());
    let (x, y) = (base.x as usize, base.y as usize);
    let right = (x + 1).min(last.x as usize);
    let rows = [grid.row(y), grid.row((y + 1).min(last.y as usize))];
    let [above, below] = rows.map(|row| value(row[x]).lerp(value(row[right]), share.x));
    above.lerp(below, share.y)
}

impl Scene<'_> {
    fn height(&self, pos: Vec3) -> f32 {
        sampled(self.heights, Vec2::new(pos.x, pos.z) * self.unit, Vec3::splat).x
    }

    fn normal(&self, pos: Vec3, reach: f32) -> Vec3 {
        let step = reach.max(0.9 / self.unit);
        let at = |x: f32, z: f32| self.height(pos + Vec3::new(x, 0.0, z) * step);
        Vec3::new(at(-1.0, 0.0) - at(1.0, 0.0), 2.0 * step, at(0.0, -1.0) - at(0.0, 1.0)).normalize()
    }

    /// Distance along a ray to the ground.
    fn hit(&self, eye: Vec3, ray: Vec3) -> Option<f32> {
        let mut along = if eye.y > self.highest { (self.highest - eye.y) / ray.y.min(-1e-4) } else { 0.0 };
        let floor = if self.sea { self.lowest.min(0.0) } else { self.lowest };
        let end = if ray.y < -1e-4 { (floor - 0.01 - eye.y) / ray.y } else { 0.0 };
        let mut last = along;
        while along < end.min(30.0) {
            let pos = eye + ray * along;
            let gap = pos.y - self.height(pos);
            if gap <= 0.0 {
                let (mut low, mut high) = (last, along);
                for _ in 0..7 {
                    let middle = 0.5 * (low + high);
                    let pos = eye + ray * middle;
                    if pos.y > self.height(pos) { low = middle } else { high = middle }
                }
                return Some(high);
            }
            last = along;
            along += (0.35 * gap).max(0.45 / self.unit) + 0.0004 * along;
        }
        None
    }

    /// How much of the sun is seen: 0..=1, soft at the border.
    fn sunlit(&self, pos: Vec3) -> f32 {
        let mut light = 1.0f32;
        let mut along = 2.0 / self.unit;
        while along < 1.5 {
            let at = pos + self.sun * along;
            if at.y > self.highest {
                break;
            }
            let gap = at.y - self.height(at);
            light = light.min(0.5 + 14.0 * gap / along);
            if light <= 0.0 {
                return 0.0;
            }
            along += (0.5 * gap).max(1.2 / self.unit);
        }
        light.min(1.0)
    }

    /// How much of the sky is seen: what rises around a place hides it.
    fn skylit(&self, pos: Vec3) -> f32 {
        let mut open = 0.0;
        let directions =
            [[1.0, 0.0], [0.7, 0.7], [0.0, 1.0], [-0.7, 0.7], [-1.0, 0.0], [-0.7, -0.7], [0.0, -1.0], [0.7, -0.7]];
        for [x, z] in directions {
            let mut steepest = 0.0f32;
            for reach in [0.006, 0.014, 0.03, 0.06, 0.11] {
                let at = pos + Vec3::new(x, 0.0, z) * reach;
                steepest = steepest.max((self.height(at) - pos.y) / reach);
            }
            open += 1.0 - steepest / (1.0 + steepest * steepest).sqrt();
        }
        open / 8.0
    }

    fn sky(&self, ray: Vec3) -> Vec3 {
        let up = ray.y.max(0.0);
        let sun = ray.dot(self.sun).max(0.0);
        HAZE.lerp(ZENITH, (1.0 - (-up * 3.5).exp2()).min(1.0)) + SUNLIGHT * 0.25 * sun.powi(24)
    }

    fn hazy(&self, color: Vec3, ray: Vec3, along: f32) -> Vec3 {
        let clear = (-along * along * 0.025 * 1.44).exp2();
        self.sky(Vec3::new(ray.x, 0.02, ray.z).normalize()).lerp(color, clear)
    }

    /// The light that a ray brings, linear.
    fn light(&self, eye: Vec3, ray: Vec3) -> Vec3 {
        let ground = self.hit(eye, ray);
        let surface = (self.sea && ray.y < -1e-4).then(|| -eye.y / ray.y);
        match (ground, surface) {
            (Some(along), None) => self.ground(eye, ray, along),
            (Some(along), Some(water)) if along < water => self.ground(eye, ray, along),
            (_, Some(water)) => self.water(eye, ray, water),
            (None, None) => self.sky(ray),
        }
    }

    /// The color of a place, linear.
    fn albedo(&self, pos: Vec3) -> Vec3 {
        let texel = Vec2::new(pos.x, pos.z) * self.unit;
        let out = (-texel).max(texel - self.colors.size().as_vec2()).max_element();
        let color = sampled(self.colors, texel, linear);
        color.lerp(self.outside, (out / (0.03 * self.unit)).clamp(0.0, 1.0))
    }

    fn ground(&self, eye: Vec3, ray: Vec3, along: f32) -> Vec3 {
        let pos = eye + ray * along;
        let normal = self.normal(pos, 0.0006 * along);
        let albedo = self.albedo(pos);
        let sun = normal.dot(self.sun).max(0.0) * self.sunlit(pos + normal * (0.8 / self.unit));
        let sky = self.skylit(pos) * (0.6 + 0.4 * normal.y);
        let bounce = 0.12 * (1.0 - normal.y).max(0.0);
        self.hazy(albedo * (SUNLIGHT * sun * 1.25 + SKYLIGHT * (1.3 * sky) + SUNLIGHT * bounce), ray, along)
    }

    fn water(&self, eye: Vec3, ray: Vec3, along: f32) -> Vec3 {
        let pos = eye + ray * along;
        let wave = |k: f32, x: f32, z: f32| ops::sin(pos.x * x * k + pos.z * z * k);
        let calm = 1.0 / (1.0 + 0.6 * along * along);
        let tilt = Vec2::new(
            wave(310.0, 1.0, 0.4) + wave(170.0, -0.3, 1.0) + wave(530.0, 0.8, -0.9),
            wave(260.0, 0.5, 1.0) + wave(410.0, -1.0, 0.7) + wave(120.0, 1.0, 0.1),
        ) * (0.012 * calm);
        let normal = Vec3::new(tilt.x, 1.0, tilt.y).normalize();
        let back = (ray - normal * 2.0 * ray.dot(normal)).normalize();
        let mirror = 0.03 + 0.97 * (1.0 - (-ray.dot(normal)).clamp(0.0, 1.0)).powi(5);
        let shine = SUNLIGHT * 2.0 * back.dot(self.sun).max(0.0).powi(180);
        let seen = self.albedo(pos) * (0.45 + 0.75 * self.sunlit(pos + Vec3::Y * (0.5 / self.unit)));
        self.hazy(seen.lerp(self.sky(back), 0.7 * mirror) + shine, ray, along)
    }
}

fn linear([r, g, b, _]: [u8; 4]) -> Vec3 {
    let color = Vec3::new(f32::from(r), f32::from(g), f32::from(b)) / 255.0;
    color * color
}

/// A curve of film: light to 0..=255, sRGB.
fn exposed(light: Vec3) -> [u8; 4] {
    let tone = |value: f32| {
        let value = value * 1.05;
        let film = value * (2.51 * value + 0.03) / (value * (2.43 * value + 0.59) + 0.14);
        (ops::powf(film.clamp(0.0, 1.0), 1.0 / 2.2) * 255.0 + 0.5) as u8
    };
    [tone(light.x), tone(light.y), tone(light.z), 255]
}

/// A picture of the ground from above and aside. `colors` are without light.
pub(crate) fn birds_eye(heights: &Grid<f32>, colors: &Grid<[u8; 4]>, frame: &SurfaceFrame, view: &View) -> RgbaImage {
    let range = |pick: fn(f32, f32) -> f32, from| heights.as_slice().iter().copied().fold(from, pick);
    let scene = Scene {
        heights,
        colors,
        unit: frame.texels_per_unit(),
        highest: range(f32::max, f32::MIN),
        lowest: range(f32::min, f32::MAX),
        outside: colors.row(0).iter().map(|&color| linear(color)).sum::<Vec3>() / colors.width() as f32,
        sun: SUN.normalize(),
        sea: view.sea,
    };
    let extent = frame.extent();
    let base = if view.sea { 0.0 } else { scene.lowest };
    let target = Vec3::new(0.5 * extent.x, base + 0.38 * (scene.highest - base), 0.5 * extent.y);
    let [around, down] = [view.around, view.down].map(f32::to_radians);
    let ([side, front], [level, up]) = (ops::unit(around).to_array(), ops::unit(down).to_array());
    let back = Vec3::new(front * level, up, side * level);
    let eye = target + back * view.distance;
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let [width, height] = view.size.to_array();
    let texel = |x: u32, y: u32| {
        let mut sum = Vec3::ZERO;
        for ray in 0..RAYS * RAYS {
            let inside = Vec2::new((ray % RAYS) as f32 + 0.5, (ray / RAYS) as f32 + 0.5) / RAYS as f32;
            let at = (Vec2::new(x as f32, y as f32) + inside - 0.5 * view.size.as_vec2()) / width as f32;
            sum += scene.light(eye, (right * at.x - up * at.y - back * 1.25).normalize()).min(Vec3::splat(4.0));
        }
        exposed(sum / (RAYS * RAYS) as f32)
    };
    let mut picture = RgbaImage::new(width, height);
    let n_threads = thread::available_parallelism().map_or(1, usize::from);
    let rows = |part: usize| {
        let rows = (part as u32..height).step_by(n_threads);
        rows.map(|y| (y, (0..width).map(|x| texel(x, y)).collect::<Vec<_>>())).collect::<Vec<_>>()
    };
    thread::scope(|scope| {
        let parts: Vec<_> = (0..n_threads).map(|part| scope.spawn(move || rows(part))).collect();
        for (y, row) in parts.into_iter().filter_map(|part| part.join().ok()).flatten() {
            for (x, texel) in (0..).zip(row) {
                picture.put_pixel(x, y, Rgba(texel));
            }
        }
    });
    picture
}
