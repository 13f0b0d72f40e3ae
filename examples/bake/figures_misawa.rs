//! `bake figures-misawa`: the figures of the paper on contour generation, made again with a contour of our own.

use crate::{mountain::Mountain, terrain::Terrain};
use bevy_crack::{
    math::{Rng, ops},
    relief::{Contours, Descriptors, Join, ReliefParams},
};
use clap::Args;
use glam::Vec2;
use image::RgbaImage;
use std::{
    error::Error,
    f32::consts::TAU,
    fs,
    path::{Path, PathBuf},
};
use tiny_skia::{Color, Paint, PathBuilder, Pixmap, Stroke, Transform};

#[derive(Args)]
pub(crate) struct Options {
    /// Folder to write to; made if it is not there
    #[arg(long, default_value = "out/figures-misawa")]
    out: PathBuf,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Real terrain for figures 9 and 17: a 16-bit picture of heights with a JSON text of the same name beside it
    #[arg(long, default_value = "assets/terrain/jacksboro_fault.png")]
    dem: PathBuf,
    /// Side of a panel, texels
    #[arg(long, default_value_t = 640, value_parser = clap::value_parser!(u32).range(64..=4096))]
    side: u32,
}

/// Free space around a panel.
const GAP: u32 = 16;

/// Distance from contour to contour, in units of the panel's side.
const DISTANCE: f32 = 0.0125;

/// Contours over the whole height of the real terrain.
const LEVELS: u16 = 40;

/// Corners of the seed contour.
const CORNERS: u32 = 230;

type Done<T> = Result<T, Box<dyn Error>>;

/// The foot of a mountain: spurs that end round, valleys that run up sharp, in a square from 0 to 1.
fn mountain(seed: u64) -> Vec<Vec2> {
    let mut rng = Rng::new(seed).stream("mountain");
    let shift = rng.unit() * TAU;
    let waves: Vec<[f32; 3]> = [3.0, 5.0, 8.0, 13.0, 21.0]
        .into_iter()
        .map(|k: f32| [k, rng.unit() * TAU, 0.75 / ops::powf(k, 1.05) * rng.range(0.75, 1.25)])
        .collect();
    (0..CORNERS)
        .map(|i| {
            let turn = TAU * (i as f32 + 0.7 * rng.unit()) / CORNERS as f32;
            // Ridges of different width: waves that run unevenly round.
            let uneven = turn + 0.25 * ops::sin(2.0 * turn + shift);
            let spurs: f32 =
                waves.iter().map(|[k, at, size]| size * (ops::sin(0.5 * (k * uneven + at)).abs() - 0.64)).sum();
            let radius = 0.36 * (1.0 + spurs + 0.012 * rng.signed());
            Vec2::splat(0.5) + ops::unit(turn) * radius * Vec2::new(1.18, 0.95)
        })
        .collect()
}

/// A white square on which closed lines are drawn. Places are in units of its side.
struct Panel(Pixmap);

impl Panel {
    fn new(side: u32) -> Done<Self> {
        let mut map = Pixmap::new(side, side).ok_or("a panel has texels")?;
        map.fill(Color::WHITE);
        Ok(Self(map))
    }

    fn line(&mut self, points: &[Vec2], width: f32, gray: u8) {
        let side = self.0.width() as f32;
        let mut path = PathBuilder::new();
        for (i, point) in points.iter().enumerate() {
            let Vec2 { x, y } = *point * side;
            if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        path.close();
        let mut paint = Paint { anti_alias: true, ..Paint::default() };
        paint.set_color_rgba8(gray, gray, gray, 255);
        if let Some(path) = path.finish() {
            self.0.stroke_path(&path, &paint, &Stroke { width, ..Stroke::default() }, Transform::identity(), None);
        }
    }

    fn contours(mut self, contours: &Contours) -> Self {
        for ring in &contours.rings {
            self.line(&ring.points, if ring.level == 0 { 1.6 } else { 0.9 }, 0);
        }
        self
    }
}

/// Panels side by side.
fn save(panels: &[Panel], path: PathBuf) -> Done<()> {
    let side = panels.first().map_or(1, |panel| panel.0.width());
    let count = panels.len() as u32;
    let mut sheet = Pixmap::new((side + GAP) * count + GAP, side + 2 * GAP).ok_or("a sheet has texels")?;
    sheet.fill(Color::from_rgba8(205, 208, 214, 255));
    for (i, panel) in panels.iter().enumerate() {
        let x = GAP + i as u32 * (side + GAP);
        sheet.draw_pixmap(x as i32, GAP as i32, panel.0.as_ref(), &Default::default(), Transform::identity(), None);
    }
    let (width, height) = (sheet.width(), sheet.height());
    let image = RgbaImage::from_raw(width, height, sheet.take()).ok_or("a sheet has texels")?;
    Ok(image.save(path)?)
}

struct Studio {
    seed: u64,
    side: u32,
    contour: Vec<Vec2>,
}

impl Studio {
    fn contours(&self, params: ReliefParams) -> Done<Contours> {
        let params = ReliefParams { distance: DISTANCE, ..params };
        Ok(Contours::generate(&params, std::slice::from_ref(&self.contour), self.seed)?)
    }

    fn panel(&self, params: ReliefParams) -> Done<Panel> {
        Ok(Panel::new(self.side)?.contours(&self.contours(params)?))
    }

    /// A valley, moved once.
    fn corner(&self, valley: &[[f32; 2]], join: Join, gray: Option<Join>) -> Done<Panel> {
        let valley: Vec<Vec2> = valley.iter().map(|place| Vec2::from_array(*place)).collect();
        let mut panel = Panel::new(self.side)?;
        let moved = |join| {
            let params = ReliefParams { join, distance: 0.16, inward: 1, ..ReliefParams::SIMPLE };
            Contours::generate(&params, std::slice::from_ref(&valley), self.seed)
        };
        if let Some(join) = gray {
            moved(join)?.level(1).for_each(|ring| panel.line(&ring.points, 1.5, 170));
        }
        for ring in &moved(join)?.rings {
            panel.line(&ring.points, if ring.level == 0 { 3.0 } else { 1.8 }, 0);
        }
        Ok(panel)
    }
}

pub(crate) fn bake(options: &Options) -> Done<()> {
    let out = &options.out;
    fs::create_dir_all(out)?;
    let studio = Studio { seed: options.seed, side: options.side, contour: mountain(options.seed) };
    joins(&studio, out)?;
    let simple = |join| studio.panel(ReliefParams { join, ..ReliefParams::SIMPLE });
    let arc = |factor| simple(Join::Arc { factor });
    real(&studio, &options.dem, out)?;
    save(&[arc(1.4)?, arc(1.6)?], out.join("fig_10_arcs.png"))?;
    let midpoint =
        |degrees: f32| studio.panel(ReliefParams { max_angle: degrees.to_radians(), ..ReliefParams::MIDPOINT });
    save(&[midpoint(10.0)?, midpoint(20.0)?, midpoint(30.0)?], out.join("fig_12_midpoints.png"))?;
    phases(&studio, out)?;
    save(&[studio.panel(ReliefParams::FOURIER)?], out.join("fig_15_fourier.png"))?;
    save(&[studio.panel(ReliefParams::IMPROVED)?], out.join("fig_16_improved.png"))?;
    beyond(&studio, out)?;
    println!("figures 5, 7, 9, 10, 12 and 14 to 17, and what goes beyond the paper, are in {}", out.display());
    Ok(())
}

/// 9: the three joins from a real contour, beside the contours of the real map. 17: bird's-eye views of the real contours, of
/// simple and of improved ones.
fn real(studio: &Studio, dem: &Path, out: &Path) -> Done<()> {
    let mountain = Mountain::of(&Terrain::read(dem)?, LEVELS)?;
    let made = |params: ReliefParams| {
        let params = ReliefParams { distance: mountain.contours.distance, ..params };
        Contours::generate(&params, &mountain.seeds(), studio.seed)
    };
    let simple = |join| made(ReliefParams { join, ..ReliefParams::SIMPLE });
    let panel = |contours: &Contours| Ok(Panel::new(studio.side)?.contours(contours));
    let joins = [Join::Miter, Join::Bevel, Join::Arc { factor: 1.2 }].map(|join| panel(&simple(join)?));
    let panels = joins.into_iter().chain([panel(&mountain.contours)]).collect::<Done<Vec<_>>>()?;
    save(&panels, out.join("fig_09_simple.png"))?;
    let views = [mountain.contours.clone(), simple(Join::Arc { factor: 1.4 })?, made(ReliefParams::IMPROVED)?];
    for (contours, name) in views.iter().zip(["a_real", "b_simple", "c_improved"]) {
        mountain.birds_eye(contours)?.save(out.join(format!("fig_17{name}.png")))?;
    }
    Ok(())
}

/// 5: a valley with edges extended, joined by a line, and by a circle. 7: the circle by two lines.
fn joins(studio: &Studio, out: &Path) -> Done<()> {
    let wide = [[-2.0, 0.9], [0.2, 0.9], [0.5, 0.45], [0.8, 0.9], [3.0, 0.9], [3.0, -3.0], [-2.0, -3.0]];
    let panels = [Join::Miter, Join::Bevel, Join::Round].map(|join| studio.corner(&wide, join, None));
    save(&panels.into_iter().collect::<Done<Vec<_>>>()?, out.join("fig_05_joins.png"))?;
    let mut narrow = wide;
    (narrow[1][0], narrow[3][0]) = (0.4, 0.6);
    let panels = [wide, narrow].map(|valley| studio.corner(&valley, Join::Arc { factor: 1.2 }, Some(Join::Round)));
    save(&panels.into_iter().collect::<Done<Vec<_>>>()?, out.join("fig_07_arc.png"))
}

/// 14: one contour, and what random phases from lower and lower frequencies on make of it.
fn phases(studio: &Studio, out: &Path) -> Done<()> {
    let contours = studio.contours(ReliefParams { inward: 4, ..ReliefParams::SIMPLE })?;
    let rings = contours.level(4).max_by_key(|ring| ring.points.len());
    let ring = rings.ok_or("the fourth contour")?;
    let mut panels = vec![Panel::new(studio.side)?];
    panels[0].line(&ring.points, 1.2, 0);
    for first in [384, 256, 128, 64] {
        let mut descriptors = Descriptors::new(&ring.points, 1024)?;
        descriptors.scramble(first, &mut Rng::new(studio.seed));
        let points: Vec<Vec2> = descriptors.points().iter().map(|point| point.as_vec2()).collect();
        let mut panel = Panel::new(studio.side)?;
        panel.line(&points, 1.2, 0);
        panels.push(panel);
    }
    save(&panels, out.join("fig_14_phases.png"))
}

/// Parameters from the seed, a steep side, both ways from a contour in the middle, several seeds.
fn beyond(studio: &Studio, out: &Path) -> Done<()> {
    let estimated = ReliefParams::estimate(&studio.contour)?;
    println!("estimated from the seed: {estimated:?}");
    let steep = ReliefParams { steepness: 0.6, steep_angle: -0.6, ..ReliefParams::IMPROVED };
    let small = |scale: f32, x: f32, y: f32| -> Vec<Vec2> {
        studio.contour.iter().map(|point| (*point - 0.5) * scale + Vec2::new(x, y)).collect()
    };
    let both = ReliefParams { distance: DISTANCE, outward: 16, ..ReliefParams::IMPROVED };
    let middle = Contours::generate(&both, &[small(0.45, 0.5, 0.5)], studio.seed)?;
    let several = [small(0.35, 0.3, 0.35), small(0.3, 0.7, 0.4), small(0.25, 0.45, 0.72)];
    let range = Contours::generate(&both, &several, studio.seed)?;
    let panels = [
        studio.panel(estimated)?,
        studio.panel(steep)?,
        Panel::new(studio.side)?.contours(&middle),
        Panel::new(studio.side)?.contours(&range),
    ];
    save(&panels, out.join("beyond_the_paper.png"))
}
