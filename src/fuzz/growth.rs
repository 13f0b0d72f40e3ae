//! Growths of any parameters, hit and changed while they grow.

use super::{Input, run};
use crate::{
    CrackPreset, Grid,
    growth::{CrackGrowth, GrowthParams, HitOutcome},
    pattern::{CellTracker, CrackMask, Moment, NO_IMPACT, NO_PARENT, Network, SurfaceFrame},
    raster::{DepthField, stamp_path},
};
use glam::{UVec2, Vec2};

/// The most steps of a case.
const MOST_STEPS: u32 = 300;

/// Parameters of a material of which some are set to other values, a few of them beyond what is allowed.
pub(super) fn params(input: &mut Input) -> GrowthParams {
    let mut params = match input.below(1 + CrackPreset::NAMES.len() as u32) as usize {
        0 => GrowthParams::DEFAULT,
        number => CrackPreset::named(CrackPreset::NAMES[number - 1]).unwrap().growth,
    };
    let layouts =
        [("markers", &["grid", "darts", "rays", "strands"][..]), ("venation", &["open", "closed", "dividing"])];
    let starts = [("starts", &["point", "points", "arms", "ring", "crushed", "disc"][..])];
    for (name, values) in layouts.into_iter().chain(starts) {
        if input.once_in(3) {
            params.set(name, input.choose(values)).unwrap();
        }
    }
    for name in ["draw_connections", "draw_islands"] {
        if input.once_in(4) {
            params.set(name, input.choose(&["true", "false"])).unwrap();
        }
    }
    let kinds = ["occupancy", "jitter", "through"].map(|name| (name, 0.0, 1.0));
    let more = [("spacing", 0.002, 1.0), ("sectors", 1.0, 360.0), ("strand_count", 1.0, 64.0)];
    let starts = [("start_count", 1.0, 1024.0), ("start_radius", 0.0, 1.0)];
    // Finer steps, more strands and longer ones are allowed, but a hit with them takes seconds.
    let strands = [
        ("strands.frequency", 0.0, 256.0),
        ("strands.rotation", 0.0, 1.0),
        ("strands.inertia", 0.0, 1.0),
        ("strands.length", 0.001, 4.0),
        ("strands.step", 0.002, 0.05),
        ("strands.depth", 0.0, 3.0),
        ("strands.branch_cost", 0.005, 64.0),
        ("strands.spread", 0.0, 1.0),
        ("strands.repulsion", 0.0, 0.5),
        ("strands.tile", 0.01, 1.0),
        ("strands.sideways", 0.0, 2.0),
        ("strands.lanes", 1.0, 16.0),
        ("strands.pace", 0.0005, 1.0),
    ];
    let numbers: Vec<_> = params.ranges().map(|(name, _, low, high)| (name, low as f32, high as f32)).collect();
    for (name, low, high) in kinds.into_iter().chain(more).chain(starts).chain(strands).chain(numbers) {
        if input.once_in(5) {
            let value = input.mostly(low, high, 200);
            // Those of other layouts are not there, and whole numbers have no fractions.
            if params.set(name, &value.to_string()).is_err() {
                let _ = params.set(name, &(value as u32).to_string());
            }
        }
    }
    // What must not be above another value mostly is not.
    if !input.once_in(16) {
        params.max_width = params.max_width.max(params.line_width);
        params.kill_distance = params.kill_distance.min(params.crack_radius);
        params.crack_radius = params.crack_radius.min(256.0 * params.step_length);
    }
    // So that cases take milliseconds.
    if !input.once_in(64) {
        params.num_lines_grid = params.num_lines_grid.min(64);
        params.num_columns_grid = params.num_columns_grid.min(64);
    }
    params.max_nodes = params.max_nodes.min(1 + input.below(2500));
    params
}

fn mask(input: &mut Input) -> CrackMask {
    let layer = |input: &mut Input| {
        let size = UVec2::new(input.below(7), input.below(7));
        let values: Vec<f32> = (0..size.x * size.y).map(|_| input.mostly(0.0, 1.0, 32)).collect();
        input.once_in(2).then(|| Grid::from_vec(size, values).unwrap())
    };
    CrackMask { weak: layer(input), strong: layer(input), forbidden: layer(input), density: layer(input) }
}

/// What [`Network`] promises, and that there is no more of it than was allowed.
fn check(growth: &CrackGrowth, most_nodes: usize, widest: f32) {
    let network = growth.network();
    let (nodes, extent) = (network.nodes(), network.extent());
    assert!(nodes.len() <= most_nodes, "{} nodes of {most_nodes}", nodes.len());
    for (i, node) in (0u32..).zip(nodes) {
        assert!(node.parent == NO_PARENT || node.parent < i, "{i} has a later parent: {node:?}");
        assert!(node.pos.cmpge(Vec2::ZERO).all() && node.pos.cmple(extent).all(), "{i} is off {extent}: {node:?}");
        assert!(
            node.width > 0.0 && node.width.is_finite() && (0.0..=1.0).contains(&node.bend),
            "{i} is no crack: {node:?}"
        );
        assert!(node.impact == NO_IMPACT || node.width <= widest, "{i}: {node:?} is wider than {widest}");
        assert!(
            node.impact == NO_IMPACT || (node.impact as usize) < growth.impacts().len(),
            "{i} is of no hit: {node:?}"
        );
    }
    for segment in network.segments() {
        assert!(growth.timeline().step_of(segment).is_some(), "{segment:?} was added at no time");
    }
    for link in network.links() {
        assert!(link.a.max(link.b) < nodes.len() as u32 && link.width > 0.0 && link.width.is_finite(), "{link:?}");
    }
    let counts = growth.marker_counts();
    assert_eq!(counts.total, counts.killed + counts.attracting + counts.waiting, "{counts:?}");
}

/// The lines, whole and on their way, are numbers.
fn check_lines(growth: &CrackGrowth, moment: Moment) {
    let network = growth.network();
    for segment in network.segments() {
        let paths = [network.path(segment), growth.timeline().path_at(network, segment, moment)];
        for path in paths.iter().flatten() {
            assert!(path.points().iter().all(|point| point.pos.is_finite() && point.width.is_finite()), "{segment:?}");
        }
    }
}

fn depths(frame: SurfaceFrame, network: &Network) -> DepthField {
    let mut field = DepthField::new(frame);
    for path in network.segments().filter_map(|segment| network.path(segment)) {
        stamp_path(&mut field, &CrackPreset::MUD.profile, &path);
    }
    field
}

fn target(bytes: &[u8]) {
    let input = &mut Input::new(bytes);
    let first = params(input);
    let frame = SurfaceFrame::new(UVec2::new(1 + input.below(64), 1 + input.below(64))).unwrap();
    let extent = if input.once_in(64) { Vec2::new(input.odd(), input.odd()) } else { frame.extent() };
    let seed = u64::from(input.word());
    let begun = CrackGrowth::new(first.clone(), extent, seed);
    let is_surface = extent.to_array().iter().all(|side| (1e-4..=64.0).contains(side));
    assert_eq!(begun.is_ok(), first.validate().is_ok() && is_surface, "{first:?}");
    let Ok(mut growth) = begun else { return };
    let mask = if input.once_in(3) { mask(input) } else { CrackMask::default() };
    growth.set_mask(mask.clone());

    let (mut widest, mut most_nodes, mut added) = (2.0 * growth.params().max_width, first.max_nodes, 0);
    let (mut is_plain, mut has_forgotten) = (true, false);
    let mut field = DepthField::new(frame);
    let mut steps = 0;
    for _ in 0..1 + input.below(12) {
        match input.byte() % 32 {
            0..16 => {
                let (at, energy) = (input.place(extent, 32), input.mostly(0.05, 4.0, 32));
                let outcome = growth.hit(at, energy);
                let is_sound = at.is_finite() && energy.is_finite() && energy >= 0.0;
                assert!(is_sound || matches!(outcome, HitOutcome::Rejected(_)), "{at} {energy}: {outcome:?}");
                if mask.is_forbidden(at / extent) && energy > 0.0 {
                    assert!(matches!(outcome, HitOutcome::Rejected(_)), "{at} {energy}: {outcome:?}");
                }
            }
            16..20 => {
                let keep = input.below(growth.network().nodes().len() as u32 + 1);
                has_forgotten |= growth.remove_oldest(keep) > 0;
            }
            20 => {
                let other = params(input);
                if growth.set_params(other.clone()).is_ok() {
                    widest = widest.max(2.0 * growth.params().max_width);
                    most_nodes = most_nodes.max(other.max_nodes);
                    is_plain = false;
                }
            }
            21 => {
                let mut foreign = CrackGrowth::new(CrackPreset::TOON.growth, Vec2::new(1.0, 2.0), seed).unwrap();
                foreign.hit(Vec2::new(input.unit(), input.unit()), 1.0);
                (0..input.below(12)).for_each(|_| _ = foreign.step());
                added += foreign.network().nodes().len();
                growth.add_cracks(foreign.network(), input.below(9));
                is_plain = false;
            }
            _ => {}
        }
        let widths: Vec<f32> = growth.network().nodes().iter().map(|node| node.width).collect();
        for _ in 0..input.below(60) {
            if steps == MOST_STEPS {
                break;
            }
            growth.step();
            steps += 1;
        }
        let now = growth.network().nodes();
        assert!(widths.iter().zip(now).all(|(before, node)| node.width >= *before), "a crack has become narrower");
        check(&growth, most_nodes as usize + added, widest);
        let mut changed = Vec::new();
        growth.take_changed(&mut changed);
        for path in changed.iter().filter_map(|&segment| growth.network().path(segment)) {
            stamp_path(&mut field, &CrackPreset::MUD.profile, &path);
        }
    }
    check_lines(&growth, Moment::nearest(f64::from(input.unit()) * f64::from(growth.timeline().end())));
    let mut cells = CellTracker::new(extent);
    cells.update(growth.network());
    assert!(cells.cells().iter().all(|cell| cell.area.is_finite() && cell.centroid.is_finite()));
    // Nothing but the changed segments has to be drawn.
    if frame.extent() == extent {
        let whole = depths(frame, growth.network());
        let missing = field.depth.as_slice().iter().zip(whole.depth.as_slice()).filter(|(drawn, depth)| drawn < depth);
        assert_eq!(missing.count(), 0, "texels of changed segments are not drawn");
        if !has_forgotten {
            assert_eq!(field.depth, whole.depth, "more is drawn than there is");
        }
    }
    if is_plain {
        let past = growth.past().unwrap();
        assert_eq!(past.validate(), Ok(()));
        let mut again = CrackGrowth::new(first, extent, seed).unwrap();
        again.set_mask(mask);
        again.replay(&past);
        assert_eq!(again.network(), growth.network(), "it does not grow again");
    }
}

#[test]
fn growths() {
    run("growth", 400, target);
}
