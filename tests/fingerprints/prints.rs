//! The fingerprints: one for each thing that the crate makes, over all of its bits.

#[path = "settings.rs"]
mod settings;

use bevy_crack::{
    CrackPreset, Grid,
    growth::CrackGrowth,
    math::{Rng, ops},
    paint::{
        BaseTexels, Look, LookTable, PaintTargets,
        analogy::{Analogy, AnalogyPair, AnalogyParams, Examples},
        correct_normals, paint_glow, paint_into,
    },
    pattern::{CellTracker, CrackMask, Moment, Network, SurfaceFrame},
    raster::{DepthField, TexelRect, stamp_path},
    relief::{Crater, CraterParams, ReliefFrame, ReliefJob, ReliefMesh, ReliefSettings},
    shatter::{Burst, BurstParams, Cuts, ShatterParams, shatter},
    strands::{Directions, StrandParams, StrandStart, Strands},
    unwrap::{MeshShape, Unwrap},
    voronoi::{BakeStatus, FONT, Front, Guide, SiteLayout, VoronoiBake, VoronoiParams, draw_text},
};
use glam::{UVec2, Vec2, Vec3};
use std::{
    error::Error,
    f32::consts::{FRAC_PI_2, PI},
    sync::Arc,
};

/// FNV-1a, a word at a time.
struct Print(u64);

impl Print {
    const fn new() -> Self {
        Self(0xCBF2_9CE4_8422_2325)
    }

    fn word(&mut self, word: u32) {
        self.0 = (self.0 ^ u64::from(word)).wrapping_mul(0x100_0000_01B3);
    }

    fn words(&mut self, words: impl IntoIterator<Item = u32>) {
        words.into_iter().for_each(|word| self.word(word));
    }

    fn numbers(&mut self, numbers: impl IntoIterator<Item = f32>) {
        numbers.into_iter().for_each(|number| self.word(number.to_bits()));
    }

    fn places<'a>(&mut self, places: impl IntoIterator<Item = &'a Vec2>) {
        places.into_iter().for_each(|place| self.numbers(place.to_array()));
    }

    fn bytes(&mut self, bytes: &[u8]) {
        self.words(bytes.iter().map(|&byte| u32::from(byte)));
    }

    fn network(&mut self, network: &Network) {
        let nodes =
            network.nodes().iter().flat_map(|n| [n.pos.x.to_bits(), n.pos.y.to_bits(), n.width.to_bits(), n.parent]);
        self.words(nodes);
        self.words(network.links().iter().flat_map(|link| [link.a, link.b, link.width.to_bits(), link.birth]));
    }

    /// The lines as they are drawn.
    fn lines(&mut self, network: &Network) {
        for path in network.segments().filter_map(|segment| network.path(segment)) {
            self.numbers(path.points().iter().flat_map(|point| [point.pos.x, point.pos.y, point.width]));
        }
    }
}

type Made<T> = Result<T, Box<dyn Error>>;

/// A preset and a growth of it that two hits have made.
fn grown(name: &str) -> Made<(CrackPreset, CrackGrowth)> {
    let preset = CrackPreset::named(name).ok_or("no such preset")?;
    let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::new(1.5, 1.0), 1)?;
    growth.hit(Vec2::new(0.6, 0.5), 1.0);
    for _ in 0..20 {
        growth.step();
    }
    growth.hit(Vec2::new(1.1, 0.3), 2.0);
    while growth.step().grew() {}
    Ok((preset, growth))
}

/// Random texels, RGBA.
fn texels(size: UVec2, seed: u64) -> Vec<u8> {
    let mut rng = Rng::new(seed);
    (0..4 * size.x * size.y).map(|_| rng.next_u32() as u8).collect()
}

/// Depths, all layers of the look, diffuse, normals that are blended into others, depth and light.
fn painted(print: &mut Print, preset: &CrackPreset, growth: &CrackGrowth, seed: u64) -> Made<()> {
    let size = UVec2::new(120, 80);
    let mut field = DepthField::new(SurfaceFrame::new(size)?);
    field.set_layers(preset.look.layer(1));
    for path in growth.network().segments().filter_map(|segment| growth.network().path(segment)) {
        stamp_path(&mut field, &preset.profile, &path);
    }
    let timeline = growth.timeline();
    field.show_layers(growth.network(), timeline, Moment::after(timeline.end()), &mut Vec::new());
    print.words(field.depth.as_slice().iter().map(|&depth| u32::from(depth)));

    painted_field(print, &preset.look, field, seed)
}

/// What a look makes of a field: diffuse, normals that are blended into others, depth and light.
fn painted_field(print: &mut Print, look: &Look, mut field: DepthField, seed: u64) -> Made<()> {
    let size = field.frame.size();
    let n = (size.x * size.y) as usize;
    let [picture, normals, depths] = [0, 1, 2].map(|k| texels(size, seed + k));
    let base = BaseTexels { size, diffuse: &picture, normal: Some(&normals), depth: Some(&depths[..n]) };
    let table = LookTable::new(look, field.frame.texels_per_unit())?;
    correct_normals(base, &mut field, UVec2::ZERO)?;
    let [mut diffuse, mut normal, mut depth] = [vec![0; 4 * n], vec![0; 4 * n], vec![0; n]];
    let mut targets = PaintTargets { diffuse: Some(&mut diffuse), normal: Some(&mut normal), depth: Some(&mut depth) };
    paint_into(base, &field, &table, TexelRect::whole(size), UVec2::ZERO, &mut targets);
    let mut light = vec![0; 4 * n];
    paint_glow(None, size, &field, &table, &[TexelRect::whole(size)], UVec2::ZERO, &mut light);
    [diffuse, normal, depth, light].iter().for_each(|made| print.bytes(made));
    Ok(())
}

/// The pieces between the cracks, and where they are when they fall.
fn broken(print: &mut Print, network: &Network) -> Made<()> {
    let params = ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT };
    let shards = shatter(Cuts::from_network(network)?, &params)?;
    let burst = Burst::new(BurstParams::DEFAULT, Vec2::new(0.6, 0.5), Vec3::new(0.3, 0.1, 1.0), 1.0, 1)?;
    print.places(shards.positions());
    print.places(shards.extended_lines().iter().flatten());
    for (number, shard) in (0u32..).zip(shards.iter()) {
        print.numbers([shard.area, shard.second_moment]);
        print.places([&shard.centroid]);
        print.words(shards.triangles(number).iter().flatten().copied());
        for neighbour in shards.neighbours(number) {
            print.word(neighbour.shard);
            print.numbers([neighbour.length]);
        }
        print.places(shards.convex_pieces(number, 0.004).iter().flat_map(|piece| piece.iter()));
        for seconds in [0.1, 0.9] {
            let pose = burst.flight(number, shard).pose(seconds);
            print.numbers(pose.offset.to_array());
            print.numbers(pose.rotation.to_array());
            print.numbers([pose.opacity]);
        }
    }
    if let Some((number, shard)) = (0u32..).zip(shards.iter()).max_by(|a, b| a.1.area.total_cmp(&b.1.area)) {
        print.places(shards.break_again(number, 0.2 * shard.area, 5)?.positions());
    }
    Ok(())
}

/// The closed cells of a network.
fn cells(print: &mut Print, network: &Network) {
    let mut cells = CellTracker::new(network.extent());
    let closed = cells.update(network);
    print.words([closed.start, closed.end, network.nodes().len() as u32]);
    for cell in cells.cells() {
        print.numbers([cell.area]);
        print.places([&cell.centroid]);
        print.word(cell.birth);
    }
}

/// A map that draws a word, with its seams, and the crack front that runs through them.
fn guided(print: &mut Print, layout: SiteLayout) -> Made<()> {
    let size = UVec2::new(200, 120);
    let word = draw_text(FONT, "CRACK", size, f32::INFINITY).ok_or("no word")?;
    print.numbers(word.as_slice().iter().copied());
    let params = VoronoiParams { layout, levels: 2, ..VoronoiParams::DEFAULT };
    let mut bake = VoronoiBake::new(params, vec![Guide { image: word, gamma: 28.0 }], size, 3)?;
    while let BakeStatus::Working(_) = bake.step(64) {}
    let (map, seams) = bake.finish();
    print.words(map.regions().iter().flat_map(|regions| regions.as_slice()).copied());
    for (x, y) in (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y))) {
        let cost = map.cost(x, y).unwrap_or(u64::MAX);
        print.words([cost as u32, (cost >> 32) as u32]);
    }
    for seam in &seams.seams {
        print.words([seam.from, seam.to]);
        print.numbers(seam.points.iter().flat_map(|point| [point.pos.x, point.pos.y, point.width]));
    }
    print.numbers([Front::new(&seams, Vec2::new(0.4, 0.5)).reach()]);
    print.network(&seams.network(Vec2::new(0.4, 0.5)));
    Ok(())
}

fn relief(print: &mut Print, settings: ReliefSettings) -> Made<()> {
    let relief = ReliefJob::new(settings, UVec2::new(180, 120), 7)?.finish()?;
    for ring in &relief.contours.rings {
        print.word(ring.level as u32);
        print.places(&ring.points);
    }
    print.numbers(relief.heights.as_slice().iter().copied());
    print.bytes(relief.diffuse.as_slice().as_flattened());
    print.bytes(relief.normal.as_slice().as_flattened());
    let mesh = ReliefMesh::new(&relief.heights, &ReliefFrame::new(Vec2::new(1.5, 1.0)), 2)?;
    print.numbers(mesh.positions.iter().chain(&mesh.normals).flatten().copied());
    print.numbers(mesh.uvs.iter().flatten().copied());
    print.words(mesh.indices);
    Ok(())
}

fn crater(print: &mut Print) -> Made<()> {
    let mut depths = Grid::new(UVec2::new(150, 100), 0);
    let frame = SurfaceFrame::new(depths.size())?;
    let crater = Crater::new(Vec2::new(0.7, 0.4), &CraterParams { radius: 0.3, ..CraterParams::DEFAULT }, 4)?;
    crater.fill(UVec2::ZERO, &frame, 1.0, &mut depths);
    print.words(depths.as_slice().iter().map(|&depth| u32::from(depth)));
    print.places(crater.contours().rings.iter().flat_map(|ring| &ring.points));
    Ok(())
}

fn strands(print: &mut Print, params: &StrandParams) -> Made<()> {
    let extent = Vec2::new(1.5, 1.0);
    let starts = [Vec2::new(0.0, 0.5), Vec2::new(0.7, 0.1)].map(StrandStart::new);
    for field in [
        Directions::Linear(Vec2::new(1.0, 0.2)),
        Directions::Swirl { center: Vec2::new(0.7, 0.6), turn: 1.1 },
        Directions::Radial { center: Vec2::new(0.4, 0.3) },
    ] {
        let network = Strands::new(params, field, &starts, extent, 7)?.network(&params.material.primitives())?;
        print.network(&network);
        print.lines(&network);
    }
    Ok(())
}

/// The lines in a picture, as a mask.
fn lines_of_a_picture(print: &mut Print) -> Made<()> {
    let size = UVec2::new(140, 90);
    let mut picture = texels(size, 6);
    for (i, texel) in picture.as_chunks_mut::<4>().0.iter_mut().enumerate() {
        let is_line = (i % 140) % 30 < 3 || (i / 140) % 24 < 3;
        let level = if is_line { 180 } else { 60 } + texel[0] % 40;
        *texel = [level, level, level, 255];
    }
    let mask = CrackMask::from_picture(size, &picture)?;
    let weak = mask.weak.ok_or("no lines")?;
    print.numbers(weak.as_slice().iter().copied());
    Ok(())
}

/// Cracks in the material of a picture.
fn analogy(print: &mut Print) -> Made<()> {
    let (size, mut rng) = (UVec2::new(40, 33), Rng::new(8));
    let pair = AnalogyPair::from_darkness(size, &texels(size, 9), 0.3)?;
    let mut depth = Grid::new(size, 0);
    depth.as_mut_slice().iter_mut().for_each(|depth| *depth = (rng.next_u32() % 9000) as u16 * 2);
    let examples = Arc::new(Examples::new(&[pair], &AnalogyParams::DEFAULT)?);
    let mut analogy = Analogy::new(examples, &depth, &[], 5)?;
    analogy.finish();
    print.words(analogy.sources().as_slice().iter().flat_map(|source| {
        let text = format!("{source:?}");
        text.bytes().map(u32::from).collect::<Vec<_>>()
    }));
    Ok(())
}

/// A bent sheet and a tall box, laid out flat.
fn laid_out(print: &mut Print) -> Made<()> {
    let bent = |columns: u32, rows: u32, bend: f32| {
        let at = |i: u32, j: u32| ops::unit(bend * i as f32).extend(0.1 * j as f32);
        let positions: Vec<Vec3> = (0..=rows).flat_map(|j| (0..=columns).map(move |i| at(i, j))).collect();
        let corner = |i: u32, j: u32| j * (columns + 1) + i;
        let cells = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
        let triangles: Vec<[u32; 3]> = cells
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        (positions, triangles)
    };
    for (positions, triangles) in [bent(4, 1, FRAC_PI_2), bent(24, 12, 0.2)] {
        lay_out(print, &positions, &triangles)?;
    }
    Ok(())
}

/// A ball and one that is pressed flat, laid out.
fn laid_out_balls(print: &mut Print) -> Made<()> {
    let (rows, round) = (14, 28);
    let corner = |row: u32, i: u32| row * round + i % round;
    let cells = (0..rows).flat_map(|row| (0..round).map(move |i| (row, i)));
    let triangles: Vec<[u32; 3]> = cells
        .flat_map(|(row, i)| {
            let [a, b, c, d] = [corner(row, i), corner(row, i + 1), corner(row + 1, i + 1), corner(row + 1, i)];
            [[a, c, b], [a, d, c]]
        })
        .collect();
    for height in [1.0, 0.3] {
        let at = |row: u32, i: u32| {
            let [up, around] =
                [row as f32 / rows as f32, 2.0 * i as f32 / round as f32].map(|share| ops::unit(PI * share));
            Vec3::new(up.y * around.x, height * up.x, -up.y * around.y)
        };
        let positions: Vec<Vec3> = (0..=rows).flat_map(|row| (0..round).map(move |i| at(row, i))).collect();
        lay_out(print, &positions, &triangles)?;
    }
    Ok(())
}

/// A mesh, laid out around the first vertex of a triangle with area.
fn lay_out(print: &mut Print, positions: &[Vec3], triangles: &[[u32; 3]]) -> Made<()> {
    let shape = MeshShape::new(positions, triangles)?;
    let triangle = (0..shape.len()).find(|&triangle| shape.has_area(triangle)).ok_or("no triangle")?;
    let around = positions[triangles[triangle][0] as usize];
    let unwrap = Unwrap { around, triangle, right: Vec3::Y, texels: 40.0, most_side: 1024, most_texels: 1 << 20 };
    let laid_out = unwrap.apply(&shape)?;
    print.words([laid_out.size.x, laid_out.size.y, laid_out.charts as u32]);
    print.places(laid_out.corners.iter().flatten().flatten());
    print.words(laid_out.owner);
    Ok(())
}

/// A line for each thing whose name begins like this: its name and the fingerprint.
pub(crate) fn prints(begin: &str) -> Made<Vec<String>> {
    let mut out = Vec::new();
    let mut add = |name: &str, make: &dyn Fn(&mut Print) -> Made<()>| -> Made<()> {
        if !name.starts_with(begin) {
            return Ok(());
        }
        let mut print = Print::new();
        make(&mut print).map_err(|error| format!("{name}: {error}"))?;
        out.push(format!("{name} {:016x}", print.0));
        Ok(())
    };
    for name in CrackPreset::NAMES {
        let (preset, growth) = grown(name)?;
        let network = growth.network();
        add(&format!("growth {name}"), &|print| {
            print.network(network);
            Ok(())
        })?;
        add(&format!("lines {name}"), &|print| {
            print.lines(network);
            Ok(())
        })?;
        add(&format!("cells {name}"), &|print| {
            cells(print, network);
            Ok(())
        })?;
        add(&format!("shards {name}"), &|print| broken(print, network))?;
        add(&format!("painted {name}"), &|print| painted(print, &preset, &growth, 2))?;
    }
    let (mut preset, growth) = grown("glass")?;
    for look in Look::NAMES {
        preset.look = Look::named(look).ok_or("no such look")?;
        add(&format!("look {look}"), &|print| painted(print, &preset, &growth, 20))?;
    }
    let layouts = [
        ("uniform", SiteLayout::Uniform),
        ("even", SiteLayout::Even),
        ("impact", SiteLayout::Impact { at: Vec2::new(0.3, 0.6), focus: 3.0 }),
        ("stroke_pairs", SiteLayout::StrokePairs),
    ];
    for (name, layout) in layouts {
        add(&format!("guided {name}"), &|print| guided(print, layout.clone()))?;
    }
    let reliefs = [
        ("rock_wall", ReliefSettings::rock_wall()),
        ("island", ReliefSettings::island()),
        ("mountain", ReliefSettings::mountain()),
    ];
    for (name, settings) in reliefs {
        add(&format!("relief {name}"), &|print| relief(print, settings.clone()))?;
    }
    add("crater", &crater)?;
    for (name, params) in
        [("asphalt", StrandParams::ASPHALT), ("marble", StrandParams::MARBLE), ("sand", StrandParams::SAND)]
    {
        add(&format!("strands {name}"), &|print| strands(print, &params))?;
    }
    add("mask lines_of_a_picture", &lines_of_a_picture)?;
    add("analogy darkness", &analogy)?;
    add("mesh laid_out", &laid_out)?;
    add("mesh laid_out_balls", &laid_out_balls)?;
    settings::each(add)?;
    Ok(out)
}
