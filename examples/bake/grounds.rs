//! Pictures of grounds for strands: asphalt, marble, sand, and what else there is in `assets/textures`.

use crate::{own::own_picture, painting::covering, pictures::read_picture};
use bevy_crack::math::{Rng, ops};
use glam::{UVec2, Vec2};
use image::{Rgba, RgbaImage};
use noise::{Fbm, MultiFractal, NoiseFn, Perlin};
use std::error::Error;

/// The ground of a material.
pub(crate) fn ground(name: &str, size: UVec2) -> Result<RgbaImage, Box<dyn Error>> {
    Ok(match name {
        "asphalt" => asphalt(size),
        "marble" => marble(size),
        "sand" => sand(size),
        _ => covering(read_picture(&own_picture(name))?, size),
    })
}

fn each(size: UVec2, mut color: impl FnMut(Vec2) -> [f32; 3]) -> RgbaImage {
    let unit = size.min_element() as f32;
    RgbaImage::from_fn(size.x, size.y, |x, y| {
        let [r, g, b] =
            color(Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / unit).map(|c| (c.clamp(0.0, 1.0) * 255.0) as u8);
        Rgba([r, g, b, 255])
    })
}

fn clouds(seed: u32, octaves: usize, frequency: f64) -> impl Fn(Vec2) -> f32 {
    let noise = Fbm::<Perlin>::new(seed).set_octaves(octaves).set_frequency(frequency);
    move |at| noise.get(at.as_dvec2().to_array()) as f32
}

/// Stones of several sizes in dark binder: each texel shows the topmost stone over it.
fn asphalt(size: UVec2) -> RgbaImage {
    let mut rng = Rng::new(11);
    let (stain, fine) = (clouds(1, 4, 3.0), clouds(2, 2, 420.0));
    let mut picture = each(size, |at| {
        let light = 0.36 + 0.05 * stain(at) + 0.07 * fine(at);
        [light, light * 0.99, light * 0.97]
    });
    let unit = size.min_element() as f32;
    let stones = (14_000.0 * size.as_vec2().element_product() / (unit * unit)) as usize;
    for _ in 0..stones {
        let at = Vec2::new(rng.unit(), rng.unit()) * size.as_vec2();
        let radius = unit * (0.0012 + 0.0032 * rng.unit() * rng.unit());
        let light = 0.30 + 0.34 * rng.unit() * rng.unit();
        let warm = 0.04 * rng.signed();
        let squash = Vec2::new(1.0, rng.range(0.6, 1.0));
        let turn = Vec2::from_angle(rng.range(0.0, 3.0));
        let reach = radius.ceil() as i32;
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let (x, y) = (at.x as i32 + dx, at.y as i32 + dy);
                let off = turn.rotate(Vec2::new(x as f32, y as f32) + 0.5 - at) / squash;
                if off.length() < radius && x >= 0 && y >= 0 && x < size.x as i32 && y < size.y as i32 {
                    let shade = light * (1.0 - 0.25 * (off.x + off.y) / (2.0 * radius));
                    let texel =
                        [shade + warm, shade + 0.3 * warm, shade - warm].map(|c| (c.clamp(0.0, 1.0) * 255.0) as u8);
                    picture.put_pixel(x as u32, y as u32, Rgba([texel[0], texel[1], texel[2], 255]));
                }
            }
        }
    }
    picture
}

/// White stone with grey veins and clouds.
fn marble(size: UVec2) -> RgbaImage {
    let (warp, cloud, fine) = (clouds(3, 5, 2.2), clouds(4, 4, 3.0), clouds(5, 3, 90.0));
    each(size, |at| {
        let bent = at + 0.22 * Vec2::new(warp(at), warp(at + 7.3));
        let vein = |wide: f32, turn: Vec2, every: f32| {
            let wave = ((bent.dot(turn) * every) % 1.0 + 1.0) % 1.0;
            ops::exp(-((wave - 0.5) / wide).powi(2))
        };
        let veins = 0.55 * vein(0.05, Vec2::new(0.8, 0.6), 2.3) + 0.3 * vein(0.025, Vec2::new(0.5, -0.8), 3.7);
        let light = 0.90 - 0.20 * veins * (0.6 + cloud(at)).clamp(0.0, 1.2) + 0.05 * cloud(at) + 0.012 * fine(at);
        [light, light * 0.99, light * 0.965]
    })
}

/// Pale, wind-blown sand.
fn sand(size: UVec2) -> RgbaImage {
    let mut rng = Rng::new(5);
    let (dune, warp, fine) = (clouds(6, 3, 2.0), clouds(7, 3, 4.0), clouds(8, 3, 60.0));
    each(size, |at| {
        let ripple = ops::sin((at.y + 0.25 * at.x) * 70.0 + 9.0 * warp(at));
        let light = 0.70 + 0.07 * dune(at) + 0.018 * ripple + 0.06 * fine(at) + 0.09 * rng.signed() * rng.unit();
        [light * 1.04, light * 0.88, light * 0.66]
    })
}
