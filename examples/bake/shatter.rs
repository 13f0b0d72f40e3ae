//! `bake shatter`: hits in, shards out: outlines, everything about them as JSON, and a picture of the pieces apart.

use crate::growth;
use bevy_crack::shatter::{Burst, BurstParams, Cuts, Shards, ShatterParams, shatter};
use clap::Args;
use glam::{Vec2, Vec3, Vec3Swizzles};
use image::RgbaImage;
use serde_json::json;
use std::{error::Error, fmt::Write, fs, time::Instant};
use tiny_skia::{
    Color, FillRule, FilterQuality, Paint, Path, PathBuilder, Pattern, Pixmap, PixmapPaint, Shader, SpreadMode, Stroke,
    Transform,
};

#[derive(Args)]
#[group(id = "shatter")]
pub(crate) struct Options {
    #[command(flatten)]
    growth: growth::Options,
    /// Carry cracks that end inside a piece on to the next crack
    #[arg(long)]
    extend_cracks: bool,
    /// Pieces below this area join a neighbour; the shorter side is 1
    #[arg(long, default_value_t = ShatterParams::DEFAULT.min_area)]
    min_area: f32,
    /// Break pieces above this area again
    #[arg(long)]
    largest: Option<f32>,
    /// Show the pieces so many seconds after the first hit; without it, pulled apart
    #[arg(long)]
    after: Option<f32>,
}

pub(crate) fn bake(options: &Options) -> Result<(), Box<dyn Error>> {
    let (network, diffuse) = growth::bake(&options.growth)?;
    let seed = options.growth.seed;
    let clock = Instant::now();
    let params = ShatterParams {
        extend_cracks: options.extend_cracks,
        min_area: options.min_area,
        seed,
        ..ShatterParams::DEFAULT
    };
    let shards = shatter(Cuts::from_network(&network)?, &params)?;
    let cut = clock.elapsed();
    let mut sets = vec![];
    for (number, shard) in (0u32..).zip(shards.iter()) {
        match options.largest.filter(|&largest| shard.area > largest) {
            Some(largest) => sets.push(Pieces::all(shards.break_again(number, largest, seed)?)),
            None => sets.push(Pieces { shards: shards.clone(), numbers: vec![number] }),
        }
    }
    let out = &options.growth.out;
    fs::write(out.join("shards.json"), serde_json::to_string(&describe(&shards))?)?;
    fs::write(out.join("shards.svg"), draw(&shards)?)?;
    let (uv, energy) = options.growth.hit.first().copied().unwrap_or((Vec2::splat(0.5), 1.0));
    let hit = uv * shards.extent();
    let burst = Burst::new(BurstParams::DEFAULT, hit, Vec3::NEG_Z, energy, seed)?;
    let apart = explode(&sets, &diffuse, hit, options.after.map(|seconds| (burst, seconds)))?;
    apart.save(out.join("exploded.png"))?;
    let smallest = shards.iter().map(|shard| shard.area).fold(f32::INFINITY, f32::min);
    println!(
        "{} shards in {:.2} ms, the smallest of area {smallest:.6}; {} cracks carried on",
        shards.len(),
        cut.as_secs_f64() * 1e3,
        shards.extended_lines().len()
    );
    Ok(())
}

/// Some shards of a set.
struct Pieces {
    shards: Shards,
    numbers: Vec<u32>,
}

impl Pieces {
    fn all(shards: Shards) -> Self {
        Self { numbers: (0..shards.len() as u32).collect(), shards }
    }
}

/// Everything about the shards, in pattern units (the shorter side is 1).
fn describe(shards: &Shards) -> serde_json::Value {
    let points = |ring: &[u32]| -> Vec<[f32; 2]> {
        ring.iter().map(|&corner| shards.positions()[corner as usize].to_array()).collect()
    };
    let pieces: Vec<_> = (0u32..)
        .zip(shards.iter())
        .map(|(i, shard)| {
            let neighbours: Vec<_> = shards
                .neighbours(i)
                .iter()
                .map(|neighbour| json!({ "shard": neighbour.shard, "length": neighbour.length }))
                .collect();
            let convex: Vec<Vec<[f32; 2]>> = shards
                .convex_pieces(i, 0.004)
                .iter()
                .map(|piece| piece.iter().map(|&corner| (corner + shard.centroid).to_array()).collect())
                .collect();
            json!({ "area": shard.area, "centroid": shard.centroid.to_array(), "second_moment": shard.second_moment,
                    "border": shard.border, "outline": points(shards.outline(i)),
                    "holes": shards.holes(i).map(points).collect::<Vec<_>>(),
                    "triangles": shards.triangles(i), "neighbours": neighbours, "convex_pieces": convex })
        })
        .collect();
    let carried: Vec<Vec<[f32; 2]>> =
        shards.extended_lines().iter().map(|line| line.iter().map(|point| point.to_array()).collect()).collect();
    json!({ "extent": shards.extent().to_array(), "shards": pieces, "carried": carried })
}

/// Outlines in pale colours, each with its number.
fn draw(shards: &Shards) -> Result<String, Box<dyn Error>> {
    let size = shards.extent() * 1000.0;
    let mut svg =
        format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-5 -5 {} {}\">\n", size.x + 10.0, size.y + 10.0);
    for (i, shard) in (0u32..).zip(shards.iter()) {
        let mut path = String::new();
        for ring in std::iter::once(shards.outline(i)).chain(shards.holes(i)) {
            for (k, &corner) in ring.iter().enumerate() {
                let at = shards.positions()[corner as usize] * 1000.0;
                write!(path, "{}{:.2} {:.2}", if k == 0 { "M" } else { "L" }, at.x, at.y)?;
            }
            path.push('Z');
        }
        let hue = i.wrapping_mul(137) % 360;
        writeln!(
            svg,
            "<path d=\"{path}\" fill=\"hsl({hue} 45% 82%)\" stroke=\"#333\" stroke-width=\"0.8\" fill-rule=\"evenodd\"/>"
        )?;
        let (at, height) = (shard.centroid * 1000.0, (shard.area.sqrt() * 220.0).min(16.0));
        writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" font-size=\"{height:.1}\" text-anchor=\"middle\" fill=\"#555\">{i}</text>",
            at.x,
            at.y + 0.35 * height
        )?;
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// The pieces apart, on a dark ground: pulled from the hit, or as the burst has thrown them.
fn explode(
    sets: &[Pieces],
    diffuse: &RgbaImage,
    hit: Vec2,
    burst: Option<(Burst, f32)>,
) -> Result<RgbaImage, Box<dyn Error>> {
    let (width, height) = diffuse.dimensions();
    let mut picture = Pixmap::new(width, height).ok_or("a picture without size")?;
    for (to, from) in picture.pixels_mut().iter_mut().zip(diffuse.pixels()) {
        let [r, g, b, a] = from.0;
        *to = tiny_skia::ColorU8::from_rgba(r, g, b, a).premultiply();
    }
    let margin = 0.35 * width.min(height) as f32;
    let mut canvas =
        Pixmap::new(width + 2 * margin as u32, height + 2 * margin as u32).ok_or("a canvas without size")?;
    canvas.fill(Color::from_rgba8(38, 40, 46, 255));
    let mut drawn = Vec::new();
    let mut number = 0;
    for Pieces { shards, numbers } in sets {
        let scale = width as f32 / shards.extent().x;
        for &i in numbers {
            let Some(shard) = shards.get(i) else { continue };
            let path = outline(shards, i, scale).ok_or("a shard without outline")?;
            // Columns of the matrix that turns texels about the centroid, and where that goes.
            let (x, y, offset, depth, opacity) = match &burst {
                None => (Vec2::X, Vec2::Y, 0.33 * (shard.centroid - hit), 0.0, 1.0),
                Some((burst, seconds)) => {
                    let pose = burst.flight(number, shard).pose(*seconds);
                    let flip = Vec2::new(1.0, -1.0);
                    let (x, y) = ((pose.rotation * Vec3::X).xy() * flip, (pose.rotation * Vec3::NEG_Y).xy() * flip);
                    (x, y, pose.offset.xy() * flip, pose.offset.z, pose.opacity)
                }
            };
            number += 1;
            let centre = shard.centroid * scale;
            let to = (shard.centroid + offset) * scale + margin - (x * centre.x + y * centre.y);
            drawn.push((depth, opacity, path, Transform::from_row(x.x, x.y, y.x, y.y, to.x, to.y)));
        }
    }
    drawn.sort_by(|a, b| a.0.total_cmp(&b.0));
    let thickness = 0.006 * width.min(height) as f32;
    for (_, opacity, path, transform) in drawn {
        let mut layer = Paint { anti_alias: true, ..Paint::default() };
        let fill = |canvas: &mut Pixmap, layer: &Paint<'_>, transform| {
            canvas.fill_path(&path, layer, FillRule::EvenOdd, transform, None);
        };
        for (shift, shade) in [(2.5 * thickness, [0, 0, 0, 90]), (thickness, [92, 96, 104, 255])] {
            let [r, g, b, a] = shade;
            layer.set_color_rgba8(r, g, b, (f32::from(a) * opacity) as u8);
            fill(&mut canvas, &layer, transform.post_translate(0.7 * shift, shift));
        }
        layer.shader = Pattern::new(
            picture.as_ref(),
            SpreadMode::Pad,
            FilterQuality::Bilinear,
            PixmapPaint::default().opacity * opacity,
            Transform::identity(),
        );
        fill(&mut canvas, &layer, transform);
        layer.shader = Shader::SolidColor(Color::from_rgba(1.0, 1.0, 1.0, 0.35 * opacity).unwrap_or(Color::WHITE));
        canvas.stroke_path(&path, &layer, &Stroke { width: 0.7, ..Stroke::default() }, transform, None);
    }
    let (width, height) = (canvas.width(), canvas.height());
    Ok(RgbaImage::from_raw(width, height, canvas.take()).ok_or("canvas size")?)
}

fn outline(shards: &Shards, shard: u32, scale: f32) -> Option<Path> {
    let mut path = PathBuilder::new();
    for ring in std::iter::once(shards.outline(shard)).chain(shards.holes(shard)) {
        for (k, &corner) in ring.iter().enumerate() {
            let at = shards.positions()[corner as usize] * scale;
            if k == 0 {
                path.move_to(at.x, at.y);
            } else {
                path.line_to(at.x, at.y);
            }
        }
        path.close();
    }
    path.finish()
}
