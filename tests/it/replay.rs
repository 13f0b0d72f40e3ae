//! Any moment of a growth, shown in whatever order.

use bevy_crack::{
    CrackPreset, Grid,
    growth::{CrackGrowth, Venation},
    math::Rng,
    pattern::{CrackMask, Moment, Node, SegmentId, SurfaceFrame},
    raster::{DOT_DEPTH, DepthField, Replay, ReplayChanges, TexelRect, stamp_dot, stamp_path},
    voronoi::{VoronoiBake, VoronoiParams},
};
use glam::{UVec2, Vec2};

/// A growth, its field, and the replay between them.
struct Scene {
    preset: CrackPreset,
    growth: CrackGrowth,
    field: DepthField,
    untouched: DepthField,
    replay: Replay,
    redrawn: ReplayChanges,
}

impl Scene {
    fn new(preset: CrackPreset, size: UVec2, seed: u64) -> Self {
        let frame = SurfaceFrame::new(size).unwrap();
        let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), seed).unwrap();
        let replay = Replay::new(size, preset.profile);
        // Every other one has a bar that no crack enters.
        let mut mask = CrackMask::default();
        if seed.is_multiple_of(2) {
            mask.forbidden = Grid::from_vec(UVec2::new(5, 1), vec![0.0, 0.0, 1.0, 0.0, 0.0]);
        }
        growth.set_mask(mask.clone());
        let mut field = DepthField::new(frame);
        field.set_forbidden(&mask);
        let untouched = field.clone();
        Self { growth, field, untouched, replay, redrawn: ReplayChanges::default(), preset }
    }

    fn hit(&mut self, rng: &mut Rng) {
        // Some fall on one spot, which widens its cracks.
        let uv = if rng.unit() < 0.4 { Vec2::new(0.6, 0.4) } else { Vec2::new(rng.unit(), rng.unit()) };
        self.growth.hit(uv * self.field.frame.extent(), rng.range(0.2, 1.5));
    }

    fn grow(&mut self) {
        while self.growth.step().grew() {}
    }

    /// Cracks that have not grown, which open for some steps; returns how many links.
    fn add(&mut self, rng: &mut Rng) -> usize {
        let params = VoronoiParams { sites: 9, ..VoronoiParams::DEFAULT };
        let size = self.field.frame.size();
        let (_, seams) = VoronoiBake::new(params, Vec::new(), size, rng.next_u32().into()).unwrap().finish();
        let (first, before) = (self.growth.network().links().len() as u32, self.growth.steps());
        let opening = rng.next_u32() % 40;
        self.growth.add_cracks(&seams.network(Vec2::new(rng.unit(), rng.unit())), opening);
        let (network, timeline) = (self.growth.network(), self.growth.timeline());
        let added = (0u32..).zip(network.links()).skip(first as usize);
        for (i, link) in added {
            assert!(link.birth > before, "{link:?}");
            let width =
                |step| timeline.path_at(network, SegmentId::Link(i), Moment::after(step)).unwrap().points()[0].width;
            // Lines may be narrower than they say, here and there.
            let whole = network.path(SegmentId::Link(i)).unwrap().points()[0].width;
            assert!(whole <= link.width);
            for age in 0..=opening {
                let share = (age + 1) as f32 / (opening + 1) as f32;
                assert!((width(link.birth + age) - share * whole).abs() < 1e-6, "link {i} opens as its nodes do");
            }
        }
        network.links().len() - first as usize
    }

    fn end(&self) -> u32 {
        self.growth.timeline().end()
    }

    fn show(&mut self, moment: Moment) {
        let Self { growth, field, replay, redrawn, .. } = self;
        replay.show(field, growth.network(), growth.timeline(), moment, redrawn);
        assert_eq!(self.replay.at(), moment);
    }

    /// The moment drawn once, on an untouched field.
    fn drawn(&self, moment: Moment) -> DepthField {
        let mut field = self.untouched.clone();
        let (network, timeline) = (self.growth.network(), self.growth.timeline());
        for segment in network.segments() {
            if let Some(path) = timeline.path_at(network, segment, moment) {
                stamp_path(&mut field, &self.preset.profile, &path);
            }
        }
        for dot in (0..).map_while(|i| timeline.dot_at(i, Moment::after(u32::MAX)).map(|_| i)) {
            if let Some(dot) = timeline.dot_at(dot, moment) {
                stamp_dot(&mut field, dot.pos, dot.radius, DOT_DEPTH);
            }
        }
        field
    }

    fn random_moment(&self, rng: &mut Rng) -> Moment {
        let steps = f64::from(rng.unit()) * f64::from(self.end()) * 1.05;
        match rng.next_u32() % 8 {
            0 => Moment::START,
            1 => Moment::after(self.end()),
            2 | 3 => Moment::nearest(steps.floor()),
            _ => Moment::nearest(steps),
        }
    }
}

/// Those of the crate, and whatever else growth can do.
fn presets() -> impl Iterator<Item = CrackPreset> {
    let mut dotted = CrackPreset::CONCRETE;
    dotted.growth.draw_markers = true;
    let mut closed = CrackPreset::CLAY;
    closed.growth.venation = Venation::Closed;
    let mut arrested = CrackPreset::CLAY;
    arrested.growth.arrest = 0.08;
    arrested.growth.inertia = 0.5;
    arrested.growth.nucleation = 0.5;
    arrested.growth.unevenness = 0.3;
    CrackPreset::NAMES.into_iter().filter_map(CrackPreset::named).chain([dotted, closed, arrested])
}

/// Which texels of `a` and `b` differ.
fn differing<'a>(a: &'a DepthField, b: &'a DepthField) -> impl Iterator<Item = UVec2> + 'a {
    let width = a.depth.width();
    let texels = a.depth.as_slice().iter().zip(b.depth.as_slice()).enumerate();
    texels.filter(|(_, (a, b))| a != b).map(move |(i, _)| UVec2::new((i % width) as u32, (i / width) as u32))
}

fn holds(rect: &TexelRect, texel: UVec2) -> bool {
    texel.cmpge(rect.min).all() && texel.cmplt(rect.max).all()
}

/// Random jumps, forwards and backwards, with hits and growth in between: always as if drawn at once. What has changed is
/// told, and nothing else.
#[test]
fn any_moment_is_the_same_however_it_was_reached() {
    let mut links = 0;
    for (round, preset) in presets().enumerate() {
        for (seed, size) in [(1, UVec2::new(203, 141)), (2, UVec2::new(64, 130))] {
            let mut rng = Rng::new(seed + 10 * round as u64);
            let mut scene = Scene::new(preset.clone(), size, seed);
            for jump in 0..90 {
                match rng.next_u32() % 8 {
                    0 if jump < 60 || scene.end() == 0 => scene.hit(&mut rng),
                    1 => scene.grow(),
                    2 if jump < 60 => links += scene.add(&mut rng),
                    _ => {
                        for _ in 0..rng.next_u32() % 9 {
                            scene.growth.step();
                        }
                    }
                }
                let moment = scene.random_moment(&mut rng);
                let before = scene.field.clone();
                scene.show(moment);
                assert!(scene.field == scene.drawn(moment), "jump {jump} of preset {round} to {moment:?}");
                let changed = &scene.redrawn.changed;
                let mut n_told = 0;
                for texel in differing(&before, &scene.field) {
                    let holding = changed.iter().filter(|rect| holds(rect, texel)).count();
                    assert_eq!(holding, 1, "{texel} has changed and is told so once");
                    n_told += 1;
                }
                assert_eq!(n_told == 0, changed.is_empty());
            }
            scene.show(Moment::START);
            assert_eq!(scene.field, scene.untouched, "nothing is there at the start");
        }
    }
    assert!(links > 50, "{links} places where arms of a front meet");
}

/// Played in frames of any length, forwards to the end and back, every moment on the way is that of a jump.
#[test]
fn playing_equals_jumping() {
    for (round, preset) in presets().enumerate() {
        let mut rng = Rng::new(77 + round as u64);
        let mut scene = Scene::new(preset, UVec2::new(160, 120), 5);
        scene.hit(&mut rng);
        let (mut steps, mut speed) = (0.0f64, 0.37);
        for frame in 0..400 {
            steps += speed;
            // Grown no further than is shown.
            while f64::from(scene.end()) < steps && scene.growth.step().grew() {}
            if frame == 60 {
                scene.hit(&mut rng);
            }
            let end = f64::from(scene.end());
            if steps >= end && !scene.growth.is_growing() {
                speed = -0.83;
            } else if steps <= 0.0 {
                speed = 1.7;
            }
            steps = steps.clamp(0.0, end);
            scene.show(Moment::nearest(steps));
            if frame % 7 == 0 {
                assert!(scene.field == scene.drawn(Moment::nearest(steps)), "frame {frame} of preset {round}");
            }
        }
    }
}

/// At the end of time the field is that of the finished network, stamped as ever, and times between are in order.
#[test]
fn the_end_is_the_finished_network() {
    for preset in presets() {
        let mut rng = Rng::new(3);
        let mut scene = Scene::new(preset, UVec2::new(180, 130), 9);
        for _ in 0..3 {
            scene.hit(&mut rng);
            scene.grow();
        }
        scene.show(Moment::nearest(7.3));
        scene.show(Moment::after(scene.end()));
        let mut finished = scene.untouched.clone();
        let network = scene.growth.network();
        for segment in network.segments() {
            stamp_path(&mut finished, &scene.preset.profile, &network.path(segment).unwrap());
        }
        let (mut markers, radius) = (Vec::new(), scene.growth.params().line_width);
        scene.growth.take_markers(&mut markers);
        for marker in markers {
            stamp_dot(&mut finished, marker, radius, DOT_DEPTH);
        }
        assert!(finished == scene.field);
        // Time only ever adds, to within rounding.
        let mut earlier = scene.untouched.clone();
        for quarter in 0..=4 * scene.end() {
            let now = scene.drawn(Moment::nearest(f64::from(quarter) / 4.0));
            let lost = earlier.depth.as_slice().iter().zip(now.depth.as_slice()).map(|(a, b)| a.saturating_sub(*b));
            let most = lost.max().unwrap();
            assert!(most <= 16, "{most} lost at quarter {quarter}");
            earlier = now;
        }
    }
}

/// Each node is as wide at the end of each step as it was then.
#[test]
fn widths_are_those_of_the_growth() {
    let mut rng = Rng::new(8);
    for (number, preset) in presets().enumerate() {
        let mut scene = Scene::new(preset, UVec2::new(100, 100), 4);
        let mut widths: Vec<Vec<f32>> = vec![Vec::new()];
        for _ in 0..2 {
            scene.hit(&mut rng);
            while scene.growth.step().grew() {
                let now = scene.growth.network().nodes().iter().map(|node| node.width);
                widths.resize(scene.growth.steps() as usize, Vec::new());
                widths.push(now.collect());
            }
        }
        let (network, timeline) = (scene.growth.network(), scene.growth.timeline());
        for (step, widths) in (0u32..).zip(&widths) {
            for (node, width) in (0u32..).zip(widths) {
                assert_eq!(timeline.width_at(node, Moment::after(step)), Some(*width), "node {node} after {step}");
                // Half a step earlier it is between the two.
                assert!(timeline.width_at(node, Moment::nearest(f64::from(step) - 0.5)).unwrap() <= *width);
                let segment = SegmentId::Branch(node);
                let is_there = timeline.path_at(network, segment, Moment::after(step)).is_some();
                let is_born = network.ends(segment).is_some() && network.nodes()[node as usize].birth <= step;
                assert_eq!(is_there, is_born, "preset {number}: node {node} after {step}");
            }
        }
        assert_eq!(timeline.born(0, timeline.end()), 0..network.nodes().len() as u32);
        for step in 0..scene.growth.steps() {
            for node in timeline.born(step, step + 1) {
                let Node { birth, parent, impact, .. } = network.nodes()[node as usize];
                // What a hit makes at once: starts with their arms, and sprouts of the crack that it falls on.
                let parent = network.nodes().get(parent as usize);
                let is_of_hit = parent.is_none_or(|parent| parent.impact != impact || parent.birth == birth);
                assert!(birth == step + 1 || (birth == step && is_of_hit), "starts come a step later");
            }
        }
    }
}

/// What a move costs goes by what changes, not by the size of the network.
#[test]
fn a_move_stamps_what_has_changed() {
    let mut rng = Rng::new(6);
    let mut scene = Scene::new(CrackPreset::CONCRETE, UVec2::splat(512), 2);
    for _ in 0..30 {
        scene.hit(&mut rng);
        scene.grow();
    }
    let all = scene.growth.network().segments().count();
    let end = Moment::after(scene.end());
    scene.show(end);
    assert_eq!(scene.redrawn.stamped.len(), all, "from nothing to all: each segment once");
    scene.show(end);
    assert_eq!(scene.redrawn, ReplayChanges::default(), "the same moment costs nothing");
    let (mut stamped, mut changes, mut moves) = (0, 0, 0);
    for step in (0..scene.end()).rev() {
        for part in [0.5, 0.0] {
            let to = Moment::nearest(f64::from(step) + part);
            let (network, timeline) = (scene.growth.network(), scene.growth.timeline());
            let path = |segment, moment| timeline.path_at(network, segment, moment);
            let at = scene.replay.at();
            changes += network.segments().filter(|segment| path(*segment, at) != path(*segment, to)).count();
            scene.show(to);
            stamped += scene.redrawn.stamped.len();
            moves += 1;
        }
    }
    println!("{all} segments, {moves} moves, {changes} changes, {stamped} stamps");
    assert!(stamped < 4 * changes, "{stamped} stamps for {changes} changes");
    assert!(stamped < moves * all / 10, "{stamped} stamps in {moves} moves over {all} segments");
}

/// A field that holds something else is drawn anew, also one of another size.
#[test]
fn strange_fields_are_drawn_anew() {
    let mut rng = Rng::new(1);
    let mut scene = Scene::new(CrackPreset::GLASS, UVec2::new(90, 70), 3);
    scene.hit(&mut rng);
    scene.grow();
    let moment = Moment::nearest(12.6);
    scene.field.depth.as_mut_slice().fill(4711);
    scene.replay = Replay::stale(scene.field.depth.size(), scene.preset.profile);
    scene.show(moment);
    assert!(scene.field == scene.drawn(moment));
    scene.field = DepthField::new(SurfaceFrame::new(UVec2::new(33, 41)).unwrap());
    scene.untouched = scene.field.clone();
    scene.show(moment);
    assert!(scene.field == scene.drawn(moment));
}
