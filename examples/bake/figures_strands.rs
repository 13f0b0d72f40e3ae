//! `bake figures-strands`: the figures of the paper on primitives along a guidance field, made again with our pictures.

use crate::{
    grounds::ground,
    maps::base_picture,
    painting::paint,
    strands::{Setting, material, stamped},
};
use bevy_crack::{
    math::{Rng, ops},
    paint::LookTable,
    pattern::{Network, SurfaceFrame},
    raster::{DepthField, Profile},
    strands::{Directions, GuidanceField, Material, Primitive, Propagation, StrandParams, StrandStart, Strands},
};
use clap::Args;
use glam::{UVec2, Vec2};
use image::{Rgba, RgbaImage, imageops};
use noise::{NoiseFn, Perlin};
use std::{error::Error, f32::consts::PI, fs, path::PathBuf};

#[derive(Args)]
pub(crate) struct Options {
    /// Folder to write to; made if it is not there
    #[arg(long, default_value = "out/figures-strands")]
    out: PathBuf,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Side of a panel, texels
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(64..=2048))]
    side: u32,
}

/// Free space between panels.
const GAP: u32 = 8;

type Done<T> = Result<T, Box<dyn Error>>;

/// Panels in rows.
fn sheet(rows: &[Vec<RgbaImage>]) -> RgbaImage {
    let width = |row: &Vec<RgbaImage>| row.iter().map(|panel| panel.width() + GAP).sum::<u32>() + GAP;
    let height = |row: &Vec<RgbaImage>| row.iter().map(RgbaImage::height).max().unwrap_or(0) + GAP;
    let size = (rows.iter().map(width).max().unwrap_or(1), rows.iter().map(height).sum::<u32>() + GAP);
    let mut sheet = RgbaImage::from_pixel(size.0, size.1, Rgba([120, 130, 150, 255]));
    let mut y = GAP;
    for row in rows {
        let mut x = GAP;
        for panel in row {
            imageops::replace(&mut sheet, panel, i64::from(x), i64::from(y));
            x += panel.width() + GAP;
        }
        y += height(row);
    }
    sheet
}

/// One seed, one size.
struct Studio {
    seed: u64,
    frame: SurfaceFrame,
}

impl Studio {
    fn white(&self) -> RgbaImage {
        let size = self.frame.size();
        RgbaImage::from_pixel(size.x, size.y, Rgba([255, 255, 255, 255]))
    }

    fn field(&self, directions: Directions, frequency: f32, rotation: f32) -> Done<GuidanceField> {
        Ok(GuidanceField::new(directions, frequency, rotation, self.frame.extent(), self.seed)?)
    }

    /// A field as colours.
    fn colors(&self, field: &GuidanceField) -> RgbaImage {
        let picture = field.picture(self.frame);
        RgbaImage::from_fn(self.frame.size().x, self.frame.size().y, |x, y| Rgba(picture.get(x, y).unwrap_or_default()))
    }

    /// A field as small lines from dots.
    fn arrows(&self, field: &GuidanceField) -> RgbaImage {
        let mut panel = self.white();
        let every = self.frame.size().x / 20;
        for y in 0..20 {
            for x in 0..20 {
                let at = (Vec2::new(x as f32, y as f32) + 0.5) * every as f32;
                let way = field.at(self.frame.to_pos(at)) * (0.8 * every as f32);
                line(&mut panel, at, at + way, Rgba([40, 70, 130, 255]));
                dot(&mut panel, at, 2, Rgba([40, 70, 130, 255]));
            }
        }
        panel
    }

    fn noise(&self, frequency: f64) -> RgbaImage {
        let perlin = Perlin::new(self.seed as u32);
        let unit = f64::from(self.frame.texels_per_unit());
        RgbaImage::from_fn(self.frame.size().x, self.frame.size().y, |x, y| {
            let value = perlin.get([f64::from(x) / unit * frequency, f64::from(y) / unit * frequency]);
            let level = (value * 127.5 + 127.5) as u8;
            Rgba([level, level, level, 255])
        })
    }

    fn strands(&self, params: &StrandParams, directions: Directions, starts: &[StrandStart]) -> Done<Strands> {
        Ok(Strands::new(params, directions, starts, self.frame.extent(), self.seed)?)
    }

    /// The paths as lines, starts and joints as dots.
    fn paths(&self, mut panel: RgbaImage, strands: &Strands) -> RgbaImage {
        const COLORS: [Rgba<u8>; 4] =
            [Rgba([20, 20, 20, 255]), Rgba([200, 40, 30, 255]), Rgba([30, 90, 200, 255]), Rgba([20, 140, 60, 255])];
        for strand in strands.strands() {
            let color = COLORS[strand.depth as usize % 4];
            for ends in strand.points.windows(2) {
                line(&mut panel, self.frame.to_texel(ends[0]), self.frame.to_texel(ends[1]), color);
            }
        }
        for strand in strands.strands() {
            dot(&mut panel, self.frame.to_texel(strand.points[0]), 4, Rgba([230, 120, 20, 255]));
        }
        panel
    }

    fn field_of(&self, network: &Network, profile: &Profile) -> DepthField {
        stamped(network, self.frame, profile)
    }

    /// The height map: black is deepest.
    fn heights(&self, network: &Network, profile: &Profile) -> RgbaImage {
        let field = self.field_of(network, profile);
        RgbaImage::from_fn(self.frame.size().x, self.frame.size().y, |x, y| {
            let light = 255 - (field.depth.get(x, y).unwrap_or(0) >> 8) as u8;
            Rgba([light, light, light, 255])
        })
    }

    /// Cracks in a picture, and their normals.
    fn painted(&self, network: &Network, setting: &Setting, base: &RgbaImage) -> Done<[RgbaImage; 2]> {
        let field = self.field_of(network, &setting.profile);
        Ok(paint(base, &field, &LookTable::new(&setting.look, self.frame.texels_per_unit())?))
    }
}

fn dot(panel: &mut RgbaImage, at: Vec2, radius: i32, color: Rgba<u8>) {
    for dy in -radius..=radius {
        for dx in -radius..=radius {
            let (x, y) = (at.x as i32 + dx, at.y as i32 + dy);
            if dx * dx + dy * dy <= radius * radius
                && x >= 0
                && y >= 0
                && x < panel.width() as i32
                && y < panel.height() as i32
            {
                panel.put_pixel(x as u32, y as u32, color);
            }
        }
    }
}

fn line(panel: &mut RgbaImage, from: Vec2, to: Vec2, color: Rgba<u8>) {
    let pieces = (from.distance(to) * 2.0).ceil().max(1.0) as u32;
    for piece in 0..=pieces {
        dot(panel, from.lerp(to, piece as f32 / pieces as f32), 1, color);
    }
}

/// Directions rounded to the nearest of the four (the paper's naive way, figures 8 and 9).
fn naive(field: &GuidanceField, from: Vec2, step: f32, count: u32) -> Vec<Vec2> {
    let mut points = vec![from];
    let mut at = from;
    for _ in 0..count {
        let v = field.at(at);
        at += if v.x.abs() >= v.y.abs() { Vec2::X * v.x.signum() } else { Vec2::Y * v.y.signum() } * step;
        points.push(at);
    }
    points
}

const DOWN: Directions = Directions::Linear(Vec2::Y);
const EAST: Directions = Directions::Linear(Vec2::X);

/// Starts of several strands that run from the left to the right.
fn starts(count: u32, seed: u64) -> Vec<StrandStart> {
    let mut rng = Rng::new(seed).stream("figure");
    (0..count)
        .map(|i| {
            let y = (i as f32 + 0.5 + 0.3 * rng.signed()) / count as f32;
            StrandStart { pos: Vec2::new(0.03 + 0.12 * rng.unit(), y), direction: Some(Vec2::X) }
        })
        .collect()
}

pub(crate) fn bake(options: &Options) -> Done<()> {
    let out = &options.out;
    fs::create_dir_all(out)?;
    let studio = Studio { seed: options.seed, frame: SurfaceFrame::new(UVec2::splat(options.side))? };
    fields(&studio, out)?;
    paths(&studio, out)?;
    branches(&studio, out)?;
    materials(&studio, out)?;
    parameters(&studio, out)?;
    repulsion(&studio, out)?;
    primitives(&studio, out)?;
    println!("figures 5, 6, 9, 11 to 13 and 15 to 19, primitives and nets are in {}", out.display());
    Ok(())
}

/// 5: noise of three frequencies. 6: fields before and after it.
fn fields(studio: &Studio, out: &std::path::Path) -> Done<()> {
    sheet(&[[4.0, 8.0, 16.0].map(|frequency| studio.noise(frequency)).into()]).save(out.join("fig_05_noise.png"))?;
    let mut rows = Vec::new();
    for (directions, frequency) in [(DOWN, 2.0), (Directions::Radial { center: Vec2::splat(0.5) }, 8.0)] {
        let [before, after] = [0.0, 0.5].map(|turn| studio.field(directions.clone(), frequency, turn));
        let (before, after) = (before?, after?);
        rows.push(vec![
            studio.arrows(&before),
            studio.noise(f64::from(frequency)),
            studio.arrows(&after),
            studio.colors(&after),
        ]);
    }
    sheet(&rows).save(out.join("fig_06_fields.png"))?;
    // The other kinds of directions, which the paper leaves to the user.
    let center = Vec2::splat(0.5);
    let drawn = (0..=20).map(|i| Vec2::new(0.1 + 0.04 * i as f32, 0.5 + 0.25 * ops::sin(0.5 * i as f32))).collect();
    let kinds = [Directions::Swirl { center, turn: 0.4 * PI }, Directions::Along { line: drawn, hold: 0.12 }, DOWN];
    let panels: Done<Vec<_>> =
        kinds.into_iter().map(|kind| Ok(studio.arrows(&studio.field(kind, 5.0, 0.2)?))).collect();
    Ok(sheet(&[panels?]).save(out.join("fig_06_more_fields.png"))?)
}

/// 9: naive approximation, costs, and continuous directions on one field. 11: path, joints, strand.
fn paths(studio: &Studio, out: &std::path::Path) -> Done<()> {
    let params = StrandParams { frequency: 4.0, rotation: 0.35, inertia: 0.3, repulsion: 0.0, ..StrandParams::DEFAULT };
    let start = [StrandStart::new(Vec2::new(0.02, 0.45))];
    let field = studio.field(EAST, params.frequency, params.rotation)?;
    let mut stiff = studio.white();
    for ends in naive(&field, start[0].pos, params.step, 500).windows(2) {
        line(&mut stiff, studio.frame.to_texel(ends[0]), studio.frame.to_texel(ends[1]), Rgba([200, 40, 30, 255]));
    }
    let of = |propagation| studio.strands(&StrandParams { propagation, ..params }, EAST, &start);
    let (costs, continuous) = (of(Propagation::Costs)?, of(Propagation::Continuous)?);
    let panels = vec![
        studio.arrows(&field),
        stiff,
        studio.paths(studio.white(), &costs),
        studio.paths(studio.white(), &continuous),
    ];
    sheet(&[panels]).save(out.join("fig_09_propagation.png"))?;

    let mut joints = studio.paths(studio.white(), &costs);
    for strand in costs.strands() {
        for at in strand.points.iter().step_by((params.tile / params.step).round() as usize) {
            dot(&mut joints, studio.frame.to_texel(*at), 5, Rgba([30, 90, 200, 255]));
        }
    }
    let setting = material("asphalt").ok_or("asphalt")?;
    let network = costs.network(&Material::Asphalt.primitives())?;
    let panels = vec![studio.paths(studio.colors(&field), &costs), joints, studio.heights(&network, &setting.profile)];
    Ok(sheet(&[panels]).save(out.join("fig_11_joints.png"))?)
}

/// 12: a branching path at three lengths. 13: path, heights, and the fields of parent and children.
fn branches(studio: &Studio, out: &std::path::Path) -> Done<()> {
    let setting = material("asphalt").ok_or("asphalt")?;
    let params = StrandParams { children: 2, depth: 2, branch_cost: 0.28, ..setting.params };
    let start = [StrandStart { pos: Vec2::new(0.02, 0.5), direction: Some(Vec2::X) }];
    let grown = |length| studio.strands(&StrandParams { length, ..params }, EAST, &start);
    let panels: Done<Vec<_>> =
        [0.35, 0.7, 1.3].into_iter().map(|length| Ok(studio.paths(studio.white(), &grown(length)?))).collect();
    sheet(&[panels?]).save(out.join("fig_12_branching.png"))?;
    let strands = grown(1.3)?;
    let network = strands.network(&Material::Asphalt.primitives())?;
    let [parent, child] =
        [params.frequency, params.child_frequency].map(|frequency| studio.field(EAST, frequency, params.rotation));
    let panels = vec![
        studio.paths(studio.white(), &strands),
        studio.heights(&network, &setting.profile),
        studio.colors(&parent?),
        studio.colors(&child?),
    ];
    Ok(sheet(&[panels]).save(out.join("fig_13_children.png"))?)
}

/// 15 and 16: three materials without and with branches: picture, height, normals.
fn materials(studio: &Studio, out: &std::path::Path) -> Done<()> {
    for (figure, has_branches) in [("fig_15_strands.png", false), ("fig_16_branches.png", true)] {
        let mut rows = [Vec::new(), Vec::new(), Vec::new()];
        for name in ["asphalt", "marble", "sand"] {
            let setting = material(name).ok_or(name)?;
            let depth = if has_branches { setting.params.depth } else { 0 };
            let params = StrandParams { depth, ..setting.params };
            let strands = studio.strands(&params, EAST, &starts(3, studio.seed + 2))?;
            let network = strands.network(&params.material.primitives())?;
            let [diffuse, normal] = studio.painted(&network, &setting, &ground(name, studio.frame.size())?)?;
            rows[0].push(diffuse);
            rows[1].push(studio.heights(&network, &setting.profile));
            rows[2].push(normal);
        }
        sheet(&rows).save(out.join(figure))?;
    }
    Ok(())
}

/// 17: frequencies. 18: rotation and inertia.
fn parameters(studio: &Studio, out: &std::path::Path) -> Done<()> {
    let setting = material("asphalt").ok_or("asphalt")?;
    let base = ground("asphalt", studio.frame.size())?;
    let start = [StrandStart { pos: Vec2::new(0.5, 0.02), direction: Some(Vec2::Y) }];
    let panel = |params: StrandParams| -> Done<RgbaImage> {
        let network = studio.strands(&params, DOWN, &start)?.network(&Material::Asphalt.primitives())?;
        let [diffuse, _] = studio.painted(&network, &setting, &base)?;
        Ok(diffuse)
    };
    let usual =
        StrandParams { depth: 0, propagation: Propagation::Costs, rotation: 0.5, inertia: 0.3, ..setting.params };
    let frequencies = [2.0, 6.0, 14.0];
    let colors: Done<Vec<_>> = frequencies.iter().map(|&f| Ok(studio.colors(&studio.field(DOWN, f, 0.5)?))).collect();
    let cracks: Done<Vec<_>> =
        frequencies.iter().map(|&frequency| panel(StrandParams { frequency, ..usual })).collect();
    sheet(&[colors?, cracks?]).save(out.join("fig_17_frequency.png"))?;
    let turns: Done<Vec<_>> =
        [0.1, 0.45, 0.85].map(|rotation| panel(StrandParams { rotation, ..usual })).into_iter().collect();
    let usual = StrandParams { propagation: Propagation::Continuous, frequency: 10.0, ..usual };
    let inert: Done<Vec<_>> =
        [0.1, 0.9, 0.975].map(|inertia| panel(StrandParams { inertia, ..usual })).into_iter().collect();
    Ok(sheet(&[turns?, inert?]).save(out.join("fig_18_rotation_and_inertia.png"))?)
}

/// 19: without and with repulsion, and the length by which strands are too close.
fn repulsion(studio: &Studio, out: &std::path::Path) -> Done<()> {
    let setting = material("asphalt").ok_or("asphalt")?;
    let base = ground("asphalt", studio.frame.size())?;
    let mut rows = [Vec::new(), Vec::new()];
    for repulsion in [0.0, setting.params.repulsion] {
        let params = StrandParams { repulsion, frequency: 3.0, rotation: 0.6, ..setting.params };
        let strands = studio.strands(&params, EAST, &starts(8, studio.seed))?;
        let network = strands.network(&Material::Asphalt.primitives())?;
        let [diffuse, _] = studio.painted(&network, &setting, &base)?;
        rows[0].push(studio.paths(studio.white(), &strands));
        rows[1].push(diffuse);
    }
    Ok(sheet(&rows).save(out.join("fig_19_repulsion.png"))?)
}

/// The shipped primitives, and nets of them.
fn primitives(studio: &Studio, out: &std::path::Path) -> Done<()> {
    let image = |primitive: &Primitive| {
        let grid = primitive.image();
        let (w, h) = (grid.size().x, grid.size().y);
        RgbaImage::from_fn(w, h, |x, y| {
            let light = 255 - (grid.get(x, y).unwrap_or(0) >> 8) as u8;
            Rgba([light, light, light, 255])
        })
    };
    let row = |material: Material| material.primitives().iter().chain(&material.nets()).map(image).collect();
    sheet(&Material::ALL.map(row)).save(out.join("primitives.png"))?;
    let mut panels = Vec::new();
    for (name, lanes, tile) in [("asphalt", 4, 0.075), ("sand", 3, 0.15)] {
        let setting = material(name).ok_or(name)?;
        let params = StrandParams {
            lanes,
            tile,
            depth: 0,
            repulsion: 0.0,
            rotation: 0.2,
            width: 0.6 * setting.params.width,
            ..setting.params
        };
        let start = [StrandStart { pos: Vec2::new(0.02, 0.5), direction: Some(Vec2::X) }];
        let network = studio.strands(&params, EAST, &start)?.network(&params.material.nets())?;
        let [diffuse, _] = studio.painted(&network, &setting, &ground(name, studio.frame.size())?)?;
        panels.push(diffuse);
    }
    // On a picture of the crate, along a drawn line.
    let setting = material("asphalt").ok_or("asphalt")?;
    let line: Vec<Vec2> =
        (0..=20).map(|i| Vec2::new(0.06 + 0.044 * i as f32, 0.5 + 0.25 * ops::sin(0.3 * i as f32))).collect();
    let start = [StrandStart::new(line[0])];
    let strands = studio.strands(&setting.params, Directions::Along { line, hold: 0.1 }, &start)?;
    let network = strands.network(&Material::Asphalt.primitives())?;
    let [diffuse, _] = studio.painted(&network, &setting, &base_picture(None, "concrete", studio.frame.size())?)?;
    panels.push(diffuse);
    Ok(sheet(&[panels]).save(out.join("nets_and_a_drawn_line.png"))?)
}
