//! Fingerprints of what no preset asks for: settings at random, masks, moments in between, meshes and flights of pieces.

use super::{Made, Print, painted_field, texels};
use bevy_crack::{
    CrackPreset, Grid,
    growth::{CrackGrowth, GrowthParams, MarkerLayout, StartLayout, Venation},
    math::{Rng, ops},
    paint::{Cel, Facets, Look},
    pattern::{CellTracker, CrackMask, Moment, PathPoint, SegmentPath, SurfaceFrame},
    raster::{
        CrushedZone, DepthField, DirtyTiles, Profile, Replay, ReplayChanges, TexelRect, Veil, crack_distance,
        stamp_path,
    },
    shatter::{
        Anchor, BreakAgain, Burst, BurstParams, Cuts, Floor, MeshFrame, RimLook, ShardMesh, Shards, ShatterParams,
        Shell, ShellFrame, ShellPart, ShellTriangle, Support, shatter,
    },
    strands::StrandParams,
    voronoi::{
        FONT, Front, Guide, SeamMotion, Seams, SiteLayout, VoronoiBake, VoronoiParams, draw_text, edges, ink, lightness,
    },
};
use glam::{Affine3A, UVec2, Vec2, Vec3};
use std::f32::consts::TAU;

/// Each kind of thing, and how many of them there are.
type Kind = (&'static str, u64, fn(&mut Print, &mut Rng) -> Made<()>);

const KINDS: [Kind; 11] = [
    ("zones", 26, zones),
    ("strokes", 14, strokes),
    ("plates", 6, plates),
    ("moments", 4, moments),
    ("grown", 30, grown),
    ("masked", 8, masked),
    ("pieces", 5, pieces),
    ("shell", 4, shell),
    ("map", 8, map),
    ("texels", 3, changed_texels),
    ("numbers", 1, numbers),
];

/// All of them, by name.
pub(super) fn each(mut add: impl FnMut(&str, &dyn Fn(&mut Print) -> Made<()>) -> Made<()>) -> Made<()> {
    for (name, count, make) in KINDS {
        for number in 0..count {
            add(&format!("{name} {number}"), &|print| make(print, &mut Rng::new(9).stream(name).substream(number)))?;
        }
    }
    Ok(())
}

/// A value, or 0 half the time.
fn maybe(rng: &mut Rng, low: f32, high: f32) -> f32 {
    let value = rng.range(low, high);
    if rng.unit() < 0.5 { value } else { 0.0 }
}

fn whole(rng: &mut Rng, low: u32, high: u32) -> u32 {
    low + rng.next_u32() % (high + 1 - low)
}

fn coin(rng: &mut Rng) -> bool {
    rng.unit() < 0.5
}

fn choose<T: Copy>(rng: &mut Rng, of: &[T]) -> T {
    of[(rng.next_u32() as usize) % of.len()]
}

fn place(rng: &mut Rng, extent: Vec2) -> Vec2 {
    Vec2::new(rng.unit(), rng.unit()) * extent
}

fn color(rng: &mut Rng) -> [f32; 3] {
    [rng.unit(), rng.unit(), rng.unit()]
}

/// Hits of several energies, two at nearly the same place, from which next to nothing grows.
fn only_hits(rng: &mut Rng, extent: Vec2, courses: f32) -> Made<CrackGrowth> {
    let params = GrowthParams { num_iterations: 1, reach: 0.05, courses, ..GrowthParams::DEFAULT };
    let mut growth = CrackGrowth::new(params, extent, 3)?;
    for (at, energy) in [([0.2, 0.3], 0.3), ([0.65, 0.6], 2.5), ([0.9, 0.15], 1.0), ([0.66, 0.6], 3.5)] {
        growth.hit((Vec2::from(at) + 0.03 * rng.signed()) * extent, energy);
        growth.step();
    }
    Ok(growth)
}

/// What hits leave around them.
fn zones(print: &mut Print, rng: &mut Rng) -> Made<()> {
    let mut zone = CrushedZone {
        radius: rng.range(0.03, 0.12),
        ragged: rng.unit(),
        soft: maybe(rng, 0.0, 1.0),
        depth: maybe(rng, 0.004, 0.06),
        rough: maybe(rng, 0.001, 0.02),
        grain: rng.range(0.004, 0.04),
        color: color(rng),
        pale: rng.range(0.3, 1.0),
        speckle: maybe(rng, 0.2, 1.0),
        dust: maybe(rng, 0.2, 1.0),
        chips: maybe(rng, 0.2, 1.0),
        reach: rng.range(1.2, 4.0),
        ..CrushedZone::DEFAULT
    };
    match rng.next_u32() % 3 {
        0 => {
            zone.broken = true;
            zone.basin = maybe(rng, 0.3, 0.9);
            zone.terraces = if coin(rng) { whole(rng, 1, 4) } else { 0 };
            zone.flakes = whole(rng, 0, 6);
            zone.fall = maybe(rng, 0.2, 1.0);
            zone.outline = maybe(rng, 0.004, 0.02);
            zone.pit = maybe(rng, 0.2, 0.8);
            zone.ticks = whole(rng, 0, 12);
            zone.bare = maybe(rng, 0.2, 1.0);
            zone.jag = maybe(rng, 0.004, 0.03);
            zone.stones = maybe(rng, 0.2, 0.9);
            zone.tint = maybe(rng, 0.2, 1.0);
        }
        1 => {
            zone.needles = rng.range(0.3, 1.0);
            zone.crazing = maybe(rng, 0.3, 1.0);
            zone.bubbles = whole(rng, 0, 24);
        }
        _ => {
            zone.flake = maybe(rng, 1.5, 4.0);
            zone.rim = maybe(rng, 0.1, 1.0);
            zone.bubbles = if coin(rng) { whole(rng, 4, 16) } else { 0 };
        }
    }
    zone.hole = maybe(rng, 0.2, 0.7);
    zone.edge = maybe(rng, 0.3, 2.0);
    let courses = maybe(rng, 0.06, 0.2);
    let look = Look { crushed: Some(zone), relief: 0.03, ..Look::GROOVE };
    let frame = SurfaceFrame::new(UVec2::new(150, 110))?;
    let growth = only_hits(rng, frame.extent(), courses)?;
    let mut field = DepthField::new(frame);
    field.set_layers(look.layer(rng.next_u32().into()));
    if coin(rng) {
        let forbidden = Some(Grid::from_vec(UVec2::new(3, 2), vec![0.0, 0.0, 1.0, 0.0, 0.0, 0.0]).ok_or("no mask")?);
        field.set_forbidden(&CrackMask { forbidden, ..CrackMask::default() });
    }
    let (timeline, mut changed) = (growth.timeline(), Vec::new());
    field.show_layers(growth.network(), timeline, Moment::after(timeline.end()), &mut changed);
    rectangles(print, &changed);
    for impact in growth.impacts() {
        if let Some(crater) = field.crater(0, impact.pos, impact.energy) {
            print.numbers([crater.reach()]);
        }
    }
    painted_field(print, &look, field, 7)
}

fn rectangles(print: &mut Print, rects: &[TexelRect]) {
    print.words(rects.iter().flat_map(|rect| [rect.min.x, rect.min.y, rect.max.x, rect.max.y]));
}

/// A few cracks of one of these presets.
fn few_cracks(rng: &mut Rng, names: &[&str], extent: Vec2) -> Made<CrackGrowth> {
    let preset = CrackPreset::named(choose(rng, names)).ok_or("no such preset")?;
    let mut growth = CrackGrowth::new(GrowthParams { max_nodes: 500, ..preset.growth }, extent, 4)?;
    growth.hit(place(rng, extent), 1.3);
    while growth.step().grew() {}
    Ok(growth)
}

/// Sections, veils and floors along cracks.
fn strokes(print: &mut Print, rng: &mut Rng) -> Made<()> {
    let profile = Profile {
        depth: rng.range(0.3, 1.0),
        full_width: rng.range(0.004, 0.04),
        wall: rng.unit(),
        rim_width: maybe(rng, 0.005, 0.04),
        rim_depth: maybe(rng, 0.1, 0.6),
        faintest: maybe(rng, 0.2, 1.0),
        even_walls: coin(rng),
        ragged: maybe(rng, 0.002, 0.02),
        chipped: maybe(rng, 0.002, 0.02),
        rubble: maybe(rng, 0.0, 1.0),
        edge: maybe(rng, 0.1, 1.0),
    };
    let veil = Veil {
        reach: rng.range(0.02, 0.2),
        full_width: rng.range(0.001, 0.02),
        cover: rng.range(0.4, 1.0),
        color: color(rng),
        variation: maybe(rng, 0.3, 1.0),
        bubbles: maybe(rng, 0.3, 1.0),
    };
    let cel = Cel { slant: rng.unit(), wall: rng.range(0.01, 0.1), wide: rng.range(0.002, 0.02), ..Cel::DEFAULT };
    let look = Look {
        veil: coin(rng).then_some(veil),
        cel: coin(rng).then_some(cel),
        directionality: maybe(rng, 0.2, 1.0),
        full_rim: maybe(rng, 0.004, 0.04),
        ..Look::GROOVE
    };
    let frame = SurfaceFrame::new(UVec2::new(130, 100))?;
    let growth = few_cracks(rng, &["ice", "concrete", "clay", "laminated_glass"], frame.extent())?;
    let mut field = DepthField::new(frame);
    field.set_layers(look.layer(rng.next_u32().into()));
    for path in growth.network().segments().filter_map(|segment| growth.network().path(segment)) {
        let rect = stamp_path(&mut field, &profile, &path);
        rectangles(print, &[rect]);
    }
    // Wide enough that pieces have come off.
    for _ in 0..3 {
        let mut point = || PathPoint { pos: place(rng, frame.extent()), width: rng.range(0.03, 0.2) };
        let path = SegmentPath::straight(point(), point());
        rectangles(print, &[stamp_path(&mut field, &profile, &path)]);
    }
    print.numbers(crack_distance(&field, 9000, 20).as_slice().iter().copied());
    painted_field(print, &look, field, 8)
}

/// Plates between cracks, some of which are gone.
fn plates(print: &mut Print, rng: &mut Rng) -> Made<()> {
    let facets = Facets {
        tone: rng.unit(),
        tilt: rng.unit(),
        reflection: maybe(rng, 0.3, 1.0),
        falloff: maybe(rng, 0.3, 1.0),
        concavity: maybe(rng, 0.3, 1.0),
        fade: maybe(rng, 0.2, 1.0),
        similarity: maybe(rng, 0.3, 1.0),
        missing_whole: coin(rng),
        patch_share: maybe(rng, 0.2, 1.0),
        thickness: maybe(rng, 0.004, 0.02),
        ..Facets::DEFAULT
    };
    let zone = CrushedZone { radius: 0.12, hole: 0.8, edge: maybe(rng, 0.5, 1.0), ..CrushedZone::DEFAULT };
    let look = Look { facets: Some(facets), crushed: Some(zone), ..Look::GLASS };
    let frame = SurfaceFrame::new(UVec2::new(150, 120))?;
    let growth = few_cracks(rng, &["glass", "mud"], frame.extent())?;
    let mut field = DepthField::new(frame);
    field.set_layers(look.layer(rng.next_u32().into()));
    let (timeline, mut changed) = (growth.timeline(), Vec::new());
    for steps in [0.7, 0.3, 1.0] {
        let moment = Moment::nearest(steps * f64::from(timeline.end()));
        field.show_layers(growth.network(), timeline, moment, &mut changed);
    }
    rectangles(print, &changed);
    painted_field(print, &look, field, 9)
}

/// Cracks as they were at some moments, forwards and backwards, drawn and by their numbers.
fn moments(print: &mut Print, rng: &mut Rng) -> Made<()> {
    let frame = SurfaceFrame::new(UVec2::new(110, 90))?;
    let preset = CrackPreset::named(choose(rng, &["glass", "clay", "marble", "plaster"])).ok_or("no such preset")?;
    let params = GrowthParams { draw_markers: true, max_nodes: 500, ..preset.growth };
    let mut growth = CrackGrowth::new(params, frame.extent(), 4)?;
    growth.hit(place(rng, frame.extent()), 0.7);
    for _ in 0..12 {
        growth.step();
    }
    growth.hit(place(rng, frame.extent()), 1.1);
    while growth.step().grew() {}
    let (network, timeline) = (growth.network(), growth.timeline());
    let (mut field, mut changes) = (DepthField::new(frame), ReplayChanges::default());
    let mut replay = Replay::new(frame.size(), preset.profile);
    for share in [0.31, 0.62, 0.07, 0.9] {
        let moment = Moment::nearest(share * f64::from(timeline.end()));
        replay.show(&mut field, network, timeline, moment, &mut changes);
        print.words(field.depth.as_slice().iter().map(|&depth| u32::from(depth)));
        for rects in [&changes.cleared, &changes.stamped, &changes.changed] {
            rectangles(print, rects);
        }
        let dots = (0..).step_by(3).map_while(|dot| Some((dot, timeline.dot_at(dot, Moment::after(timeline.end()))?)));
        for dot in dots.filter_map(|(dot, _)| timeline.dot_at(dot, moment)) {
            print.places([&dot.pos]);
            print.numbers([dot.radius]);
        }
        print.numbers((0..network.nodes().len() as u32).filter_map(|node| timeline.width_at(node, moment)));
        for path in network.segments().filter_map(|segment| timeline.path_at(network, segment, moment)) {
            let path = path.moved(Vec2::new(0.25, -0.5));
            print.numbers(path.points().iter().flat_map(|point| [point.pos.x, point.pos.y, point.width]));
        }
        print.words([timeline.born(2, moment.whole()).start, timeline.born(2, moment.whole()).end]);
    }
    Ok(())
}

/// Settings of growth from all of their ranges that end soon.
fn params(rng: &mut Rng) -> GrowthParams {
    let (count, radius) = (whole(rng, 1, 9), rng.range(0.01, 0.2));
    let step_length = rng.range(0.012, 0.06);
    let crack_radius = rng.range(0.08, 0.4);
    let line_width = rng.range(0.001, 0.01);
    let dividing = rng.unit() < 0.25;
    let strands = [StrandParams::ASPHALT, StrandParams::MARBLE, StrandParams::SAND];
    GrowthParams {
        kill_distance: rng.range(0.02, 0.08),
        step_length,
        crack_radius,
        num_iterations: 80,
        num_lines_grid: whole(rng, 6, 18),
        num_columns_grid: whole(rng, 6, 18),
        markers: match rng.next_u32() % if dividing { 4 } else { 8 } {
            0..=2 => MarkerLayout::PseudoGrid { occupancy: rng.range(0.4, 1.0), jitter: rng.unit() },
            3 | 4 => MarkerLayout::DartThrowing { spacing: rng.range(0.03, 0.08) },
            5 => MarkerLayout::Strands {
                count: whole(rng, 2, 5),
                strands: StrandParams { length: 0.3, ..choose(rng, &strands) },
            },
            _ => MarkerLayout::Rays { sectors: whole(rng, 5, 20), jitter: rng.unit(), through: rng.unit() },
        },
        venation: match rng.next_u32() % 2 {
            _ if dividing => Venation::Subdivision,
            0 => Venation::Open,
            _ => Venation::Closed,
        },
        focus: maybe(rng, 0.0, 4.0),
        reach: rng.range(0.2, 0.6),
        reach_variation: maybe(rng, 0.1, 0.9),
        starts: match rng.next_u32() % 6 {
            0 => StartLayout::Point,
            1 => StartLayout::Points { count },
            2 => StartLayout::Arms { count },
            3 => StartLayout::Ring { count, radius },
            4 => StartLayout::Crushed { count, radius },
            _ => StartLayout::Disc { count, radius },
        },
        line_width,
        line_growth: rng.range(0.0, 2.0),
        murray: rng.range(1.0, 4.0),
        max_width: line_width + rng.range(0.0, 0.05),
        tip_taper: maybe(rng, 0.0, 8.0),
        unevenness: maybe(rng, 0.1, 0.9),
        inertia: maybe(rng, 0.1, 4.0),
        axis: rng.range(-3.0, 3.0),
        directed: maybe(rng, 0.1, 1.0),
        wander: rng.range(0.0, 0.5),
        grain: maybe(rng, 0.02, 0.2),
        zigzag: maybe(rng, 0.1, 1.0),
        forks: maybe(rng, 0.05, 0.5),
        fork_angle: rng.range(0.3, 1.4),
        roughness: rng.range(0.0, 0.4),
        draw_connections: coin(rng),
        connection_gaps: rng.unit(),
        connection_every: whole(rng, 1, 3),
        draw_islands: coin(rng),
        island_distance: rng.range(0.01, 0.1),
        arrest: maybe(rng, 0.03, 0.15),
        open_ends: maybe(rng, 0.1, 0.8),
        nucleation: maybe(rng, 0.2, 3.0),
        generations: whole(rng, 1, 3),
        three_arm_share: maybe(rng, 0.2, 1.0),
        straightness: maybe(rng, 0.2, 1.0),
        thinning: maybe(rng, 0.2, 1.0),
        width_variation: maybe(rng, 0.2, 0.9),
        front: maybe(rng, 0.01, 0.1),
        patchiness: maybe(rng, 0.5, 3.0),
        variety: maybe(rng, 0.2, 1.0),
        courses: if rng.unit() < 0.2 { rng.range(0.06, 0.2) } else { 0.0 },
        distortion: maybe(rng, 0.005, 0.03),
        draw_markers: coin(rng),
        max_nodes: 600,
    }
}

fn extent(rng: &mut Rng) -> Vec2 {
    if coin(rng) { Vec2::new(1.0 + 0.6 * rng.unit(), 1.0) } else { Vec2::new(1.0, 1.0 + 0.6 * rng.unit()) }
}

/// All that is to be seen of a growth.
fn everything(print: &mut Print, growth: &CrackGrowth) {
    print.network(growth.network());
    print.lines(growth.network());
    print.words([growth.steps(), growth.timeline().end(), growth.nodes_left()]);
    for impact in growth.impacts() {
        print.places([&impact.pos]);
        print.numbers([impact.energy, impact.widening]);
    }
    let markers: Vec<Vec2> = growth.living_markers().collect();
    print.places(&markers);
    let mut cells = CellTracker::new(growth.network().extent());
    cells.update(growth.network());
    for (number, cell) in (0u32..).zip(cells.cells()) {
        print.numbers([cell.area]);
        print.words(cells.outline(number));
        cells.holes(number).for_each(|hole| print.words(hole));
    }
}

/// Hits, one of which feeds an earlier one, and one on cracks whose oldest part is forgotten.
fn live(print: &mut Print, rng: &mut Rng, growth: &mut CrackGrowth) {
    let extent = growth.network().extent();
    let first = place(rng, extent);
    growth.hit(first, rng.range(0.3, 1.5));
    for _ in 0..8 {
        growth.step();
    }
    growth.hit(place(rng, extent), rng.range(0.3, 3.0));
    for _ in 0..6 {
        growth.step();
    }
    growth.hit(first, 0.6);
    while growth.step().grew() {}
    everything(print, growth);
    if coin(rng) {
        let nodes = growth.network().nodes().len() as u32;
        print.word(growth.remove_oldest(2 * nodes / 3));
        growth.hit(place(rng, extent), 1.0);
        while growth.step().grew() {}
        everything(print, growth);
    }
}

fn grown(print: &mut Print, rng: &mut Rng) -> Made<()> {
    let mut growth = CrackGrowth::new(params(rng), extent(rng), rng.next_u32().into())?;
    if coin(rng) {
        growth.set_density(Grid::from_vec(UVec2::new(3, 2), (0..6).map(|_| rng.range(0.2, 1.0)).collect()));
    }
    live(print, rng, &mut growth);
    Ok(())
}

/// Joints, what cracks avoid, a hole and a gap, and cracks of another surface.
fn masked(print: &mut Print, rng: &mut Rng) -> Made<()> {
    let size = UVec2::new(48, 40);
    let (slant, bricks) = (rng.range(-0.4, 0.4), coin(rng));
    let layer = |value: &dyn Fn(f32, f32) -> f32| {
        let at = |i: u32| value((i % size.x) as f32, (i / size.x) as f32);
        Grid::from_vec(size, (0..size.x * size.y).map(at).collect())
    };
    let joint = |x: f32, y: f32| {
        let is_joint = if bricks {
            y % 10.0 < 2.0 || (x + 8.0 * (y / 10.0).floor()) % 16.0 < 2.0
        } else {
            (x + slant * y).rem_euclid(12.0) < 2.0
        };
        f32::from(u8::from(is_joint))
    };
    let middle = place(rng, size.as_vec2());
    let mask = CrackMask {
        weak: if coin(rng) { layer(&joint) } else { None },
        strong: if coin(rng) { layer(&|x, y| (x / 48.0 - 0.3 * y / 40.0).clamp(0.0, 1.0)) } else { None },
        forbidden: layer(&|x, y| f32::from(u8::from(middle.distance(Vec2::new(x, y)) < 5.0 || x > 44.0 && y < 30.0))),
        density: if coin(rng) { layer(&|x, _| x / 48.0) } else { None },
    };
    for _ in 0..60 {
        let (a, b) = (place(rng, Vec2::ONE), place(rng, Vec2::ONE));
        print.word(mask.blocks(a, b).into());
        print.numbers([mask.weak_at(a), mask.strong_at(a), mask.density_at(a)]);
    }
    let preset = CrackPreset::named(choose(rng, &CrackPreset::NAMES)).ok_or("no such preset")?;
    let extent = Vec2::new(1.2, 1.0);
    for params in [GrowthParams { max_nodes: 600, ..preset.growth }, params(rng)] {
        let mut growth = CrackGrowth::new(params, extent, rng.next_u32().into())?;
        growth.set_mask(mask.clone());
        if coin(rng) {
            print.word(growth.add_cracks(few_cracks(rng, &["clay"], extent)?.network(), 2));
        }
        live(print, rng, &mut growth);
    }
    Ok(())
}

fn mesh(print: &mut Print, mesh: &ShardMesh) {
    print.numbers(mesh.positions.iter().chain(&mesh.normals).flatten().copied());
    print.numbers(mesh.uvs.iter().flatten().copied());
    print.numbers(mesh.colors.iter().flatten().copied());
    print.words(mesh.indices.iter().copied());
    print.word(mesh.sides as u32);
}

/// Lines of any kind across a surface: long, short, closed, along each other.
fn cut(rng: &mut Rng, extent: Vec2) -> Made<Shards> {
    let mut cuts = Cuts::new(extent)?;
    for _ in 0..7 {
        let mut at = place(rng, extent);
        let line: Vec<Vec2> = (0..whole(rng, 2, 6))
            .map(|_| {
                at += 0.5 * Vec2::new(rng.signed(), rng.signed());
                at
            })
            .collect();
        cuts.add_line(&line)?;
        let (middle, radius, corners) = (place(rng, extent), rng.range(0.02, 0.2), whole(rng, 3, 8));
        let ring: Vec<Vec2> =
            (0..=corners).map(|k| middle + radius * ops::unit(TAU * k as f32 / corners as f32)).collect();
        cuts.add_line(&ring)?;
    }
    for k in 1..4 {
        let x = 0.25 * k as f32 * extent.x;
        cuts.add_line(&[Vec2::new(x, 0.0), Vec2::new(x, 0.3 + 0.2 * k as f32)])?;
    }
    let params = ShatterParams {
        extend_cracks: coin(rng),
        min_area: maybe(rng, 1e-4, 2e-3),
        max_shards: whole(rng, 12, 60),
        seed: 5,
    };
    Ok(shatter(cuts, &params)?)
}

/// What can be asked of shards, their meshes, what holds them, and how they fly.
fn pieces(print: &mut Print, rng: &mut Rng) -> Made<()> {
    let extent = extent(rng);
    let shards = cut(rng, extent)?;
    let frame = MeshFrame {
        uv: [Vec2::new(0.1, 0.2), Vec2::new(0.8, 0.9)],
        centred: coin(rng),
        rim: RimLook { width: rng.range(0.003, 0.02), bright: 0.5, relief: 0.3, shift: 0.01 },
        seed: 3,
        ..MeshFrame::new(200.0 * extent)
    };
    let burst = Burst::new(
        BurstParams {
            tumble: coin(rng),
            drag: maybe(rng, 0.1, 2.0),
            gravity: Vec2::new(0.3, -2.0),
            ..BurstParams::DEFAULT
        },
        place(rng, extent),
        Vec3::new(rng.signed(), rng.signed(), 1.0),
        rng.range(0.3, 4.0),
        2,
    )?
    .with_origin(Vec3::new(0.2, 0.1, -0.3));
    let floor = Floor {
        up: Vec3::new(0.1, 1.0, 0.2),
        height: -1.7,
        clearance: 0.02,
        depth: maybe(rng, 0.02, 0.2),
        lies_flat: coin(rng),
    };
    let landing = burst.clone().with_floor(floor)?;
    for (number, shard) in (0u32..).zip(shards.iter()) {
        print.numbers([shard.area, shard.second_moment]);
        print.numbers(shard.border);
        shards.holes(number).for_each(|hole| print.words(hole.iter().copied()));
        print.words(shards.corners(number).iter().copied());
        print.places(shards.inner_point(number).iter());
        for tolerance in [0.0, 0.02] {
            print.places(shards.convex_pieces(number, tolerance).iter().flatten());
        }
        mesh(print, &shards.solid_mesh(number, &frame, 7.0));
        mesh(print, &shards.flat_mesh(number, &MeshFrame { rim: RimLook::STONE, ..frame }));
        for flight in [burst.flight(number, shard), burst.fall(number, shard), landing.flight(number, shard)] {
            for time in [0.2, 0.6, 1.1, 1.9] {
                let pose = flight.pose(time);
                print.numbers(pose.offset.to_array());
                print.numbers(pose.rotation.to_array());
                print.numbers([pose.opacity]);
            }
            print.numbers([flight.end()]);
        }
        if let Some(due) = BreakAgain::DEFAULT.due(shard.area, number.into()) {
            let parts = shards.break_again(number, 0.3 * shard.area, 4)?;
            print.places(parts.positions());
            for (part, shape) in (0u32..).zip(parts.iter()) {
                let flight = landing.flight(number, shard).fragment(due, shard, shape, 0.2, part.into());
                print.numbers(flight.pose(due + 0.7).offset.to_array());
                print.numbers(flight.pose(due + 0.7).rotation.to_array());
            }
        }
    }
    for _ in 0..40 {
        let at = place(rng, extent);
        print.words(shards.at(at));
        print.numbers([shards.distance(0, at), shards.distance(shards.len() as u32 / 2, at)]);
    }
    let mut support = Support::new(&shards, Anchor::Sides([coin(rng), true, false, coin(rng)]));
    for _ in 0..3 {
        let fallen = support.hit(&shards, place(rng, extent), rng.range(0.02, 0.15))?;
        print.words(fallen.hit.into_iter().chain(fallen.loose));
    }
    print.words(support.missing());
    let other = cut(rng, extent)?;
    let mut after = support.after_new_cracks(&shards, &other, Anchor::Border);
    print.words(after.drop_loose(&other));
    print.words(after.held_by(&other, Anchor::Sides([false, false, true, false])).missing());
    Ok(())
}

/// Pieces of a vault and of a box that are laid out side by side.
fn shell(print: &mut Print, rng: &mut Rng) -> Made<()> {
    let extent = Vec2::new(2.2, 1.0);
    let bend = rng.range(0.1, 0.9);
    let columns = whole(rng, 4, 9);
    // Turned by `bend` from one corner to the next.
    let at = |u: u32, v: f32| {
        let turned = bend * u as f32;
        let flat = Vec2::new(0.1 + u as f32 / columns as f32, 1.0 - v);
        (flat, Vec3::new(ops::cos(turned), v, -ops::sin(turned)), ops::unit(-turned))
    };
    let mut triangles = Vec::new();
    for u in 0..columns {
        for corners in [[(u, 0.0), (u + 1, 0.0), (u + 1, 1.0)], [(u, 0.0), (u + 1, 1.0), (u, 1.0)]] {
            let corners = corners.map(|(u, v)| at(u, v));
            triangles.push(ShellTriangle {
                flat: corners.map(|(flat, ..)| flat),
                corners: corners.map(|(_, corner, _)| corner),
                normals: corners.map(|(.., out)| Vec3::new(out.x, 0.0, out.y)),
            });
        }
    }
    // A square that does not touch it.
    let square = [[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)], [(0.0, 0.0), (1.0, 1.0), (0.0, 1.0)]];
    triangles.extend(square.map(|corners| ShellTriangle {
        flat: corners.map(|(u, v)| Vec2::new(1.2 + 0.9 * u, 0.95 - 0.9 * v)),
        corners: corners.map(|(u, v)| Vec3::new(0.9 * u, 0.9 * v, 3.0)),
        normals: [Vec3::Z; 3],
    }));
    let shell = Shell::new(extent, triangles);
    let mut cuts = Cuts::new(extent)?;
    for edge in shell.border() {
        print.places(&edge);
        cuts.add_line(&edge)?;
    }
    for _ in 0..5 {
        let (a, b) = (place(rng, extent), place(rng, extent));
        cuts.add_line(&[a - (b - a), a, 0.5 * (a + b) + 0.03, b, b + (b - a)])?;
    }
    let shards = shatter(cuts, &ShatterParams::DEFAULT)?;
    let frame = ShellFrame {
        to_mesh: Affine3A::from_rotation_y(0.4),
        uv: [Vec2::new(0.1, 0.0), Vec2::new(0.9, 0.7)],
        rim: RimLook::GLASS,
        seed: 2,
        thickness: maybe(rng, 0.05, 0.3),
        roughness: maybe(rng, 0.3, 1.0),
    };
    for number in 0..shards.len() as u32 {
        let mesh = shards.shell_mesh(number, &shell, &frame);
        for ShellPart { positions, normals, tangents, uvs, colors, indices } in [mesh.picture, mesh.inside] {
            print.numbers(positions.into_iter().chain(normals).flatten());
            print.numbers(tangents.into_iter().chain(colors).flatten());
            print.numbers(uvs.into_iter().flatten());
            print.words(indices);
        }
        print.numbers(shell.distance(&shards, number, Vec3::new(0.3, 0.4, 0.5)));
    }
    for _ in 0..20 {
        if let Some(place) = shell.place(place(rng, extent)) {
            print.numbers(
                [place.position, place.normal, place.right, place.down].map(|at| at.to_array()).into_iter().flatten(),
            );
        }
    }
    Ok(())
}

fn seams(print: &mut Print, seams: &Seams) {
    for seam in &seams.seams {
        print.words([seam.from, seam.to]);
        print.numbers(seam.points.iter().flat_map(|point| [point.pos.x, point.pos.y, point.width]));
    }
}

/// A map of any settings, its strokes, and its seams while weights change.
fn map(print: &mut Print, rng: &mut Rng) -> Made<()> {
    let size = UVec2::new(whole(rng, 60, 110), whole(rng, 60, 110));
    let word = draw_text(FONT, choose(rng, &["LO", "S7", "&"]), size / 2, f32::INFINITY).ok_or("no word")?;
    let picture = texels(UVec2::new(30, 20), rng.next_u32().into());
    let light = lightness(UVec2::new(30, 20), &picture).ok_or("no picture")?;
    let drawn = edges(&light);
    print.numbers(light.as_slice().iter().chain(drawn.as_slice()).copied());
    for opacity in [255, 60] {
        let sheet: Vec<u8> = picture.as_chunks::<4>().0.iter().flat_map(|&[r, g, b, _]| [r, g, b, opacity]).collect();
        print.numbers(ink(UVec2::new(30, 20), &sheet).ok_or("no picture")?.as_slice().iter().copied());
    }
    let layout = match rng.next_u32() % 6 {
        0 => SiteLayout::Uniform,
        1 => SiteLayout::Even,
        2 => SiteLayout::Impact { at: Vec2::new(0.4, 0.6), focus: rng.range(1.0, 6.0) },
        3 => SiteLayout::Density(light),
        4 => SiteLayout::Given((0..9).map(|_| place(rng, Vec2::ONE)).collect()),
        _ => SiteLayout::StrokePairs,
    };
    let width = rng.range(0.005, 0.05);
    let params = VoronoiParams {
        alpha: rng.range(0.0, 20.0),
        beta: 1.0,
        sites: whole(rng, 3, 60),
        layout,
        levels: whole(rng, 1, 3),
        noise_scale: rng.range(0.03, 0.5),
        width,
        least_width: 0.2 * width,
        taper: rng.range(0.0, 4.0),
        stroke_width: maybe(rng, 0.2, 1.0),
        guide_noise: maybe(rng, 0.0, 1.0),
        roughness: maybe(rng, 0.0, 0.02),
    };
    let guides = vec![Guide { image: word, gamma: 20.0 }, Guide { image: drawn, gamma: rng.range(0.0, 9.0) }];
    let mut bake = VoronoiBake::new(params, guides, size, rng.next_u32().into())?;
    while let bevy_crack::voronoi::BakeStatus::Working(_) = bake.step(16) {}
    let (mut map, made) = bake.finish();
    seams(print, &made);
    print.places(&map.sites().iter().map(|site| site.as_vec2()).collect::<Vec<_>>());
    if let Some(report) = map.strokes() {
        print.numbers([report.length, report.covered]);
    }
    for (x, y) in (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y))) {
        let (right, below) = map.edges(x, y);
        print.words([map.region(x, y).unwrap_or(0), right.unwrap_or(1).into(), below.unwrap_or(1).into()]);
    }
    map.set_gammas(&[3.0, 15.0])?;
    map.rescale_widths();
    seams(print, &map.seams());
    let mut motion = SeamMotion::new(map, vec![0.0, 9.0], vec![25.0, 2.0])?;
    for share in [0.3, 0.8, 0.5] {
        seams(print, &motion.at(share)?);
    }
    let mut map = motion.into_map();
    map.search_again();
    let last = map.seams();
    seams(print, &last);
    let front = Front::new(&last, place(rng, Vec2::ONE));
    let mut field = DepthField::new(*map.frame());
    last.stamp_front(&mut field, &Profile::DEFAULT, &front, 0.4 * front.reach());
    print.words(field.depth.as_slice().iter().map(|&depth| u32::from(depth)));
    last.stamp_share(&mut field, &Profile::DEFAULT, 0.6);
    print.words(field.depth.as_slice().iter().map(|&depth| u32::from(depth)));
    Ok(())
}

/// Which texels have changed, the lines of pictures, and where they are transparent.
fn changed_texels(print: &mut Print, rng: &mut Rng) -> Made<()> {
    let size = UVec2::new(whole(rng, 700, 1300), whole(rng, 60, 300));
    let mut dirty = DirtyTiles::new(size);
    let mut rects = Vec::new();
    for many in [1, 4, 30, 400] {
        for _ in 0..many {
            let min = place(rng, size.as_vec2()).as_uvec2();
            let most = if coin(rng) { 30 } else { 800 };
            dirty.mark(TexelRect { min, max: min + UVec2::new(whole(rng, 0, most), whole(rng, 1, 30)) });
        }
        dirty.take_rects(&mut rects);
        rectangles(print, &rects);
    }
    let size = UVec2::new(whole(rng, 70, 100), whole(rng, 60, 90));
    let mut picture = texels(size, rng.next_u32().into());
    let (period, slant, dark) = (whole(rng, 14, 30), whole(rng, 0, 2), coin(rng));
    for (i, texel) in (0u32..).zip(picture.as_chunks_mut::<4>().0) {
        let (x, y) = (i % size.x, i / size.x);
        let is_line = (x + slant * y / 3) % period < 3 || y % 24 < 2;
        let level = if is_line == dark { 60 } else { 180 } + texel[0] % 30;
        *texel = [level, level, level, if x > 55 { 0 } else { 255 }];
    }
    let mask = CrackMask::from_picture(size, &picture)?;
    for layer in [mask.weak, mask.forbidden].iter().flatten() {
        print.numbers(layer.as_slice().iter().copied());
    }
    Ok(())
}

/// Functions of numbers, streams, and settings that are read, scaled and varied.
fn numbers(print: &mut Print, rng: &mut Rng) -> Made<()> {
    for _ in 0..200 {
        let (x, y) = (rng.range(-9.0, 9.0), rng.range(-2.0, 2.0));
        print.numbers([ops::sin(x), ops::cos(x), ops::atan2(y, x), ops::exp(y), ops::powf(x.abs(), y)]);
        print.places([&ops::unit(x)]);
        print.word(rng.substream(x.to_bits().into()).stream("x").next_u32());
    }
    for number in 0..20 {
        let params = params(rng);
        for made in [params.varied(number), params.scaled(0.4), params.scaled(2.5)] {
            print.bytes(format!("{made:?} {}", made.most_nodes(3, number)).as_bytes());
        }
    }
    let mut params = GrowthParams::DEFAULT;
    let texts = [
        ("markers", "rays"),
        ("sectors", "9"),
        ("jitter", "0.4"),
        ("through", "0.3"),
        ("starts", "ring"),
        ("start_count", "7"),
        ("start_radius", "0.04"),
        ("venation", "closed"),
        ("D", "0.03"),
        ("draw_islands", "true"),
        ("markers", "darts"),
        ("spacing", "0.07"),
        ("starts", "arms"),
        ("venation", "dividing"),
        ("axis", "1.2"),
        ("markers", "strands"),
        ("strand_count", "3"),
        ("strands.depth", "1"),
        ("starts", "crushed"),
        ("starts", "disc"),
        ("markers", "grid"),
        ("occupancy", "0.4"),
        ("jitter", "0.1"),
        ("starts", "points"),
        ("starts", "point"),
        ("sectors", "3"),
        ("venation", "open"),
        ("draw_markers", "yes"),
        ("draw_connections", "true"),
        ("no", "1"),
    ];
    for (name, text) in texts {
        let outcome = params.set(name, text);
        print.bytes(format!("{outcome:?} {params:?}").as_bytes());
    }
    Ok(())
}
