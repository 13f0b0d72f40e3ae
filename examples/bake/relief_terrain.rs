//! `bake relief-terrain`: from one real contour to the others, by every method, beside the real ones.

use crate::{
    mountain::{Mountain, total_length},
    terrain::Terrain,
};
use bevy_crack::{
    Grid,
    pattern::SurfaceFrame,
    relief::{Contours, HeightParams, Join, Method, ReliefParams, heights},
};
use clap::Args;
use glam::{UVec2, Vec2};
use std::{collections::BTreeSet, error::Error, fs, path::PathBuf};

#[derive(Args)]
pub(crate) struct Options {
    /// A 16-bit picture of heights with a JSON text of the same name beside it
    #[arg(long)]
    dem: PathBuf,
    /// Number of contours over the whole height of the model
    #[arg(long, default_value_t = 40)]
    levels: u16,
    /// Random seeds over which each method is averaged
    #[arg(long, default_value_t = 4)]
    seeds: u64,
    /// Folder for bird's-eye pictures; made if it is not there
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Side of the surface to which the region of the seed contour is fitted, texels.
const SIDE: u32 = 512;

/// Points on the rings of a level, a small step apart.
fn samples(contours: &Contours, level: i32, step: f32) -> Vec<Vec2> {
    let mut out = Vec::new();
    for ring in contours.level(level) {
        for (a, b) in ring.points.iter().zip(ring.points.iter().cycle().skip(1)) {
            let n = (a.distance(*b) / step).ceil().max(1.0);
            out.extend((0..n as u32).map(|i| a.lerp(*b, i as f32 / n)));
        }
    }
    out
}

/// Mean distance from the points of one line to those of another.
fn mean_distance(from: &[Vec2], to: &[Vec2]) -> f32 {
    let nearest = |a: &Vec2| to.iter().map(|b| a.distance_squared(*b)).fold(f32::MAX, f32::min).sqrt();
    from.iter().map(nearest).sum::<f32>() / from.len().max(1) as f32
}

/// Box-counting dimension of points, over boxes of 1/128 to 1/16.
fn dimension(points: &[Vec2]) -> f64 {
    let counts: Vec<_> = [128.0f32, 64.0, 32.0, 16.0]
        .iter()
        .map(|&n| {
            let boxes: BTreeSet<_> = points.iter().map(|&point| (point * n).floor().as_ivec2().to_array()).collect();
            (f64::from(n).ln(), (boxes.len().max(1) as f64).ln())
        })
        .collect();
    let n = counts.len() as f64;
    let [mean_x, mean_y] =
        [0, 1].map(|axis| counts.iter().map(|&(x, y)| if axis == 0 { x } else { y }).sum::<f64>() / n);
    let top: f64 = counts.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    top / counts.iter().map(|(x, _)| (x - mean_x) * (x - mean_x)).sum::<f64>()
}

/// How near made contours come to the real ones.
#[derive(Clone, Copy, Default)]
struct Score {
    /// Mean distance, both ways, in units of the distance between levels.
    distance: f64,
    /// Length of all made contours over that of the real ones.
    length: f64,
    /// Box-counting dimension.
    dimension: f64,
    /// Mean difference of heights inside the seed contour, in steps.
    height: f64,
}

const STEP: f32 = 1.0 / 400.0;

fn score(made: &Contours, real: &Contours, ground: [&Grid<f32>; 2], step: f32) -> Score {
    let last = real.levels().map_or(0, |(_, highest)| highest);
    let (mut distance, mut n_distances) = (0.0, 0.0);
    let (mut lengths, mut dimensions) = ([0.0f32; 2], Vec::new());
    for level in 1..=last {
        let [a, b] = [made, real].map(|contours| samples(contours, level, STEP));
        lengths = [lengths[0] + total_length(made, level), lengths[1] + total_length(real, level)];
        if a.len() > 40 && b.len() > 40 {
            distance += f64::from(0.5 * (mean_distance(&a, &b) + mean_distance(&b, &a)) / real.distance);
            n_distances += 1.0;
            dimensions.push(dimension(&a));
        }
    }
    let differences = ground[0].as_slice().iter().zip(ground[1].as_slice()).filter(|(_, real)| **real > 0.0);
    let (sum, n) = differences.fold((0.0, 0.0), |(sum, n), (a, b)| (sum + f64::from((a - b).abs() / step), n + 1.0));
    Score {
        distance: distance / f64::max(n_distances, 1.0),
        length: f64::from(lengths[0] / lengths[1].max(1e-6)),
        dimension: dimensions.iter().sum::<f64>() / dimensions.len().max(1) as f64,
        height: sum / f64::max(n, 1.0),
    }
}

fn name(method: Method) -> &'static str {
    match method {
        Method::Simple => "simple",
        Method::Midpoint => "midpoint",
        Method::Fourier => "fourier",
        Method::Improved => "improved",
    }
}

fn picture(options: &Options, mountain: &Mountain, contours: &Contours, file: &str) -> Result<(), Box<dyn Error>> {
    let Some(out) = &options.out else { return Ok(()) };
    fs::create_dir_all(out)?;
    mountain.birds_eye(contours)?.save(out.join(format!("{file}.png")))?;
    fs::write(out.join(format!("{file}.svg")), contours.to_svg(Vec2::ONE, 1000.0))?;
    Ok(())
}

pub(crate) fn bake(options: &Options) -> Result<(), Box<dyn Error>> {
    let terrain = Terrain::read(&options.dem)?;
    let mountain = Mountain::of(&terrain, options.levels)?;
    let (real, step) = (&mountain.contours, mountain.step);
    let frame = SurfaceFrame::new(UVec2::splat(SIDE))?;
    let params = HeightParams { step, floor: 0.0, ..HeightParams::DEFAULT };
    let real_ground = heights(real, &params, frame, 1)?;
    let seeds = mountain.seeds();
    let itself = score(real, real, [&real_ground; 2], step);
    println!(
        "{} rings, {:.0} m from level to level, {:.4} apart",
        real.rings.len(),
        step * terrain.metres_per_unit,
        real.distance
    );
    println!("method    distance  length  dimension  height");
    let row = |name: &str, it: Score| {
        println!("{name:9} {:8.3} {:7.3} {:10.3} {:7.3}", it.distance, it.length, it.dimension, it.height);
    };
    row("real", itself);
    picture(options, &mountain, real, "a_real")?;
    for method in Method::ALL {
        // The constants that the paper gives for each.
        let factor = if method == Method::Improved { 3.0 } else { 1.4 };
        let join = Join::Arc { factor };
        let rings = ReliefParams { method, join, distance: real.distance, ..ReliefParams::IMPROVED };
        let mut mean = Score::default();
        for seed in 1..=options.seeds {
            let made = Contours::generate(&rings, &seeds, seed)?;
            let ground = heights(&made, &params, frame, 1)?;
            let it = score(&made, real, [&ground, &real_ground], step);
            let share = 1.0 / options.seeds as f64;
            mean.distance += share * it.distance;
            mean.length += share * it.length;
            mean.dimension += share * it.dimension;
            mean.height += share * it.height;
            if seed == 1 {
                picture(
                    options,
                    &mountain,
                    &made,
                    &format!("{}_{}", if method == Method::Simple { "b" } else { "c" }, name(method)),
                )?;
            }
        }
        row(name(method), mean);
    }
    Ok(())
}
