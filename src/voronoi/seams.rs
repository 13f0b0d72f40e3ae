//! The boundaries of the regions as smooth lines: [`Seams`].
//!
//! A boundary runs between two neighbouring texels of different regions. Its line crosses the straight connection of
//! their centres, at first in the middle; the squares between four texel centres link the crossings to lines and hold
//! the points where three or four lines meet. Then every crossing slides along its connection towards the middle of
//! its neighbours, as if the line were a taut thread. Nothing ever leaves its connection or its square, so lines touch at
//! their ends only.

use super::{lattice::Layer, level::Level, params::VoronoiParams};
use crate::{
    math::ops,
    pattern::{PathPoint, SurfaceFrame},
};
use glam::{IVec2, UVec2, Vec2};
use std::collections::VecDeque;

/// How often the threads are tautened. Once leaves stairs, twenty times rounds off what the noise has made.
const ROUNDS: usize = 6;

/// How close a crossing may come to a texel centre, texels.
const MARGIN: f32 = 0.12;

/// How far points may lie off the line that replaces them, texels. Two lines keep `MARGIN * sqrt(2)` = 0.17 apart.
const TOLERANCE: f32 = 0.08;

/// A point where seams end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamVertex {
    /// Position, pattern units. On the border one coordinate is exactly zero or the extent.
    pub pos: Vec2,
    /// Whether it lies on the border of the surface.
    pub on_border: bool,
}

/// The line between two regions from one vertex to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Seam {
    /// Index of the vertex at which it begins.
    pub from: u32,
    /// Index of the vertex at which it ends; the same as `from` for a region that lies within another one.
    pub to: u32,
    /// The region to the left as one goes from `from` to `to` (y is down: left of east is north).
    pub left: u32,
    /// The region to the right.
    pub right: u32,
    /// The level at which the crack appeared, 0 = oldest.
    pub level: u32,
    /// The line with its widths, pattern units; first and last are the vertices.
    pub points: Vec<PathPoint>,
}

/// All boundaries of a map: a planar graph that meets only in its vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seams {
    /// Size of the surface, pattern units.
    pub extent: Vec2,
    /// Where seams end.
    pub vertices: Vec<SeamVertex>,
    /// The seams, in the order in which rows are read.
    pub seams: Vec<Seam>,
}

/// The sides of a corner of four texels, in the order north, east, south, west.
const SIDES: [IVec2; 4] = [IVec2::new(0, -1), IVec2::new(1, 0), IVec2::new(0, 1), IVec2::new(-1, 0)];

/// What happens to a boundary at a corner.
#[derive(Clone, Copy, PartialEq)]
enum Corner {
    /// It leaves by this side.
    Pass(usize),
    /// It ends.
    End,
}

/// Bits of [`Tracer::edges`].
const RIGHT: u8 = 1;
const DOWN: u8 = 2;
/// Set beside them when the edge has been followed.
const SEEN: u8 = 4;

/// Where a boundary crosses the connection of two texel centres.
#[derive(Clone, Copy)]
struct Crossing {
    /// Centre of the left or upper texel.
    from: Vec2,
    /// (1, 0) or (0, 1).
    along: Vec2,
    /// Texel index of `from`, and the edge's bit.
    texel: usize,
    bit: u8,
    t: f32,
}

impl Crossing {
    fn pos(&self) -> Vec2 {
        self.from + self.along * self.t
    }
}

struct Line {
    ends: [usize; 2],
    crossings: Vec<Crossing>,
}

/// A vertex in texels, kept within reach of its corner.
struct Joint {
    corner: Vec2,
    pos: Vec2,
    on_border: bool,
}

/// Finds and follows the boundaries.
pub(super) struct Tracer {
    size: UVec2,
    /// Which edges of each texel are boundaries.
    edges: Vec<u8>,
    row: usize,
    regions: [Vec<u32>; 2],
}

impl Tracer {
    pub(super) fn new(size: UVec2) -> Self {
        let (w, h) = (size.x as usize, size.y as usize);
        Self { size, edges: vec![0; w * h], row: 0, regions: [vec![0; w], vec![0; w]] }
    }

    /// Looks for boundaries in up to `rows` further rows; says whether there are more.
    pub(super) fn scan(&mut self, level: &Level, rows: usize) -> bool {
        let (w, h) = (self.size.x as usize, self.size.y as usize);
        for _ in 0..rows {
            if self.row == h {
                return false;
            }
            let [row, below] = &mut self.regions;
            if self.row == 0 {
                level.fill_regions(0, row);
            } else {
                std::mem::swap(row, below);
            }
            let last = self.row + 1 == h;
            if last {
                below.copy_from_slice(row);
            } else {
                level.fill_regions(self.row + 1, below);
            }
            let edges = &mut self.edges[self.row * w..(self.row + 1) * w];
            for ((edge, a), b) in edges.iter_mut().zip(row.iter()).zip(below.iter()) {
                *edge = if a == b { 0 } else { DOWN };
            }
            for (edge, pair) in edges.iter_mut().zip(row.windows(2)) {
                *edge |= if pair[0] == pair[1] { 0 } else { RIGHT };
            }
            self.row += 1;
        }
        self.row < h
    }

    /// How much of the surface has been scanned, 0..=1.
    pub(super) fn progress(&self) -> f32 {
        self.row as f32 / self.size.y.max(1) as f32
    }

    /// Texel and bit of the edge that leaves `corner` on `side`, if it lies on the surface.
    fn edge(&self, corner: IVec2, side: usize) -> Option<(usize, u8)> {
        let (texel, bit) = match side {
            0 => (corner - IVec2::new(1, 1), RIGHT),
            1 => (corner - IVec2::new(0, 1), DOWN),
            2 => (corner - IVec2::new(1, 0), RIGHT),
            _ => (corner - IVec2::new(1, 1), DOWN),
        };
        let size = self.size.as_ivec2();
        let end = texel + if bit == RIGHT { IVec2::new(1, 0) } else { IVec2::new(0, 1) };
        let inside = texel.min_element() >= 0 && end.x < size.x && end.y < size.y;
        inside.then(|| (texel.y as usize * self.size.x as usize + texel.x as usize, bit))
    }

    fn is_boundary(&self, corner: IVec2, side: usize) -> bool {
        self.edge(corner, side).is_some_and(|(texel, bit)| self.edges[texel] & bit != 0)
    }

    /// What becomes of a boundary that reaches `corner` by `side`.
    fn corner(&self, level: &Level, corner: IVec2, side: usize) -> Corner {
        let mut others = (0..4).filter(|&other| other != side && self.is_boundary(corner, other));
        match (others.next(), others.next(), others.next()) {
            (Some(other), None, None) => Corner::Pass(other),
            (Some(_), Some(_), Some(_)) => {
                // Four boundaries are two that pass each other if two texels across are of one region.
                let region = |dx: i32, dy: i32| {
                    let texel = corner + IVec2::new(dx, dy);
                    level.region(texel.y as usize * self.size.x as usize + texel.x as usize)
                };
                if region(-1, -1) == region(0, 0) {
                    Corner::Pass([1, 0, 3, 2][side])
                } else if region(0, -1) == region(-1, 0) {
                    Corner::Pass([3, 2, 1, 0][side])
                } else {
                    Corner::End
                }
            }
            _ => Corner::End,
        }
    }

    /// Follows a boundary from `corner` by `side` to its end.
    fn follow(&mut self, level: &Level, mut corner: IVec2, mut side: usize) -> (Vec<Crossing>, IVec2) {
        let mut crossings = Vec::new();
        while let Some((texel, bit)) = self.edge(corner, side)
            && self.edges[texel] & (bit * SEEN) == 0
        {
            self.edges[texel] |= bit * SEEN;
            let w = self.size.x as usize;
            let from = Vec2::new((texel % w) as f32 + 0.5, (texel / w) as f32 + 0.5);
            let along = if bit == RIGHT { Vec2::X } else { Vec2::Y };
            crossings.push(Crossing { from, along, texel, bit, t: 0.5 });
            corner += SIDES[side];
            match self.corner(level, corner, (side + 2) % 4) {
                Corner::Pass(next) => side = next,
                Corner::End => break,
            }
        }
        (crossings, corner)
    }

    /// The lines of all boundaries, after the whole surface has been scanned.
    fn lines(&mut self, level: &Level) -> (Vec<Joint>, Vec<Line>) {
        let size = self.size.as_ivec2();
        let (mut joints, mut lines) = (Vec::new(), Vec::new());
        let mut joint_at = std::collections::BTreeMap::new();
        let mut joint = |joints: &mut Vec<Joint>, corner: IVec2| {
            *joint_at.entry((corner.y, corner.x)).or_insert_with(|| {
                let on_border = corner.x == 0 || corner.y == 0 || corner.x == size.x || corner.y == size.y;
                joints.push(Joint { corner: corner.as_vec2(), pos: corner.as_vec2(), on_border });
                joints.len() - 1
            })
        };
        // First from all corners where boundaries end, then what is left: rings.
        for rings in [false, true] {
            for i in 0..self.edges.len() {
                if self.edges[i] & (RIGHT | DOWN) == 0 {
                    continue;
                }
                let texel = IVec2::new((i % self.size.x as usize) as i32, (i / self.size.x as usize) as i32);
                // The ends of the two edges of the texel, with the side on which the edge leaves.
                let ends = [
                    (RIGHT, texel + IVec2::new(1, 0), 2),
                    (RIGHT, texel + IVec2::new(1, 1), 0),
                    (DOWN, texel + IVec2::new(0, 1), 1),
                    (DOWN, texel + IVec2::new(1, 1), 3),
                ];
                for (bit, corner, side) in ends {
                    let open = self.edges[i] & bit != 0 && self.edges[i] & (bit * SEEN) == 0;
                    if !open || (!rings && self.corner(level, corner, side) != Corner::End) {
                        continue;
                    }
                    let (crossings, end) = self.follow(level, corner, side);
                    let ends = [joint(&mut joints, corner), joint(&mut joints, end)];
                    lines.push(Line { ends, crossings });
                }
            }
        }
        (joints, lines)
    }

    /// The seams of the finest of `levels`, after the whole surface has been scanned, and the cost that has full width:
    /// `full`, or that of the dearest ones.
    pub(super) fn finish(
        mut self,
        levels: &[Level],
        params: &VoronoiParams,
        frame: &SurfaceFrame,
        guides: &Guidance<'_>,
        full: Option<f32>,
    ) -> (Seams, f32) {
        let mut seams = Seams { extent: frame.extent(), ..Seams::default() };
        let Some(finest) = levels.last() else { return (seams, 1.0) };
        let (mut joints, mut lines) = self.lines(finest);
        tauten(&mut joints, &mut lines);
        let births: Vec<usize> = lines.iter().map(|line| self.birth(line, levels)).collect();
        let costs: Vec<Vec<Cost>> =
            lines.iter().zip(&births).map(|(line, &birth)| self.costs(line, &levels[birth], guides)).collect();
        let full = full.unwrap_or_else(|| dearest(&costs));
        let (least, gain) = (params.least_width, params.width - params.least_width);
        let of_stroke = params.stroke_width / frame.texels_per_unit();
        let widths = Widths { least, gain, taper: params.taper, full, of_stroke };
        let mut ways: Vec<Way> = (lines.iter().zip(&costs))
            .map(|(line, costs)| {
                let ends = line.ends.map(|end| joints[end].pos);
                let crossings = line.crossings.iter().map(Crossing::pos);
                // A vertex has the cost of the crossing beside it.
                let of = |i: usize| costs.get(i).map_or(0.0, |cost| widths.of(*cost));
                let last = costs.len().saturating_sub(1);
                Way {
                    ends: line.ends,
                    places: std::iter::once(ends[0]).chain(crossings).chain([ends[1]]).collect(),
                    widths: std::iter::once(0).chain(0..costs.len()).chain([last]).map(of).collect(),
                }
            })
            .collect();
        if !guides.layers.is_empty() {
            let on_border: Vec<bool> = joints.iter().map(|joint| joint.on_border).collect();
            run_out(&mut ways, &on_border, RUN_OUT / frame.texels_per_unit());
        }
        let to_seam = |((line, way), birth): ((&Line, &Way), usize)| {
            let first = line.crossings.first()?;
            let point = |i: usize| PathPoint { pos: frame.to_pos(way.places[i]), width: way.widths[i] };
            // On which side the first crossing has its texel as one leaves the first vertex; left is where y is less
            // for x that grows.
            let [a, b] = self.beside(first);
            let heading = first.pos() - joints[line.ends[0]].corner;
            let a_is_left = heading.perp_dot(first.from - first.pos()) < 0.0;
            let (left, right) = if a_is_left { (a, b) } else { (b, a) };
            Some(Seam {
                from: line.ends[0] as u32,
                to: line.ends[1] as u32,
                left: finest.region(left),
                right: finest.region(right),
                level: birth as u32,
                points: simplify(&way.places).into_iter().map(point).collect(),
            })
        };
        seams.seams = lines.iter().zip(&ways).zip(births).filter_map(to_seam).collect();
        let vertex = |joint: &Joint| SeamVertex { pos: frame.to_pos(joint.pos), on_border: joint.on_border };
        seams.vertices = joints.iter().map(vertex).collect();
        (seams, full)
    }

    /// The texels on either side of a crossing.
    fn beside(&self, crossing: &Crossing) -> [usize; 2] {
        [crossing.texel, crossing.texel + if crossing.bit == RIGHT { 1 } else { self.size.x as usize }]
    }

    /// The level at which a line appeared.
    fn birth(&self, line: &Line, levels: &[Level]) -> usize {
        let Some(first) = line.crossings.first() else { return 0 };
        let [a, b] = self.beside(first);
        levels.iter().position(|level| level.region(a) != level.region(b)).unwrap_or(0)
    }

    /// Path costs along a line.
    fn costs(&self, line: &Line, level: &Level, guides: &Guidance<'_>) -> Vec<Cost> {
        let cost = |crossing: &Crossing| self.beside(crossing).map(|texel| level.cost(texel)).iter().sum::<f32>() * 0.5;
        let mut costs: Vec<f32> = line.crossings.iter().map(cost).collect();
        smooth(&mut costs);
        let costs = without_thorns(&costs, guides);
        let share = guides.share();
        let weigh = |(cost, crossing): (f32, &Crossing)| {
            let [a, b] = self.beside(crossing).map(|texel| guides.at(texel));
            let inside = 0.5 * (a + b);
            let noise = self.beside(crossing).map(|texel| guides.noise_at(texel)).iter().sum::<f32>();
            let uneven = 1.0 + UNEVEN * (noise - 1.0);
            let stroke = 2.0 * inside * guides.texels(cost);
            Cost { cost: cost * (1.0 - ASIDE * share * (1.0 - inside)), stroke, uneven }
        };
        costs.into_iter().zip(&line.crossings).map(weigh).collect()
    }
}

/// What the width of a crack follows at one of its crossings.
#[derive(Clone, Copy)]
struct Cost {
    /// Path cost, in β; less beside the guides.
    cost: f32,
    /// Width of the stroke of which this is the middle, texels.
    stroke: f32,
    /// How much wider the crack is here in a stroke.
    uneven: f32,
}

/// What the widths of cracks have to know of the guides.
pub(super) struct Guidance<'a> {
    /// The most that an edge of bare ground costs, in β.
    pub ground: f32,
    /// The weight of the heaviest guide, in β.
    pub weight: f32,
    /// The guides.
    pub layers: &'a [Layer],
    /// The noise.
    pub noise: &'a Layer,
}

impl Guidance<'_> {
    /// How much of the cost of the dearest edge is the guides', 0..1.
    fn share(&self) -> f32 {
        self.weight / (self.ground + self.weight)
    }

    /// How many texels a path of this cost leads through a stroke, in β: what it costs on the way there counts as well, but
    /// is little where there is a site beside the stroke.
    fn texels(&self, cost: f32) -> f32 {
        cost * self.share() / (self.ground + self.weight)
    }

    /// The noise at a texel, 0..=1.
    fn noise_at(&self, texel: usize) -> f32 {
        f32::from(self.noise.values.as_slice()[texel]) / 65535.0
    }

    /// The largest value of a guide at a texel, 0..=1; guides count by their weight.
    fn at(&self, texel: usize) -> f32 {
        let value = |layer: &Layer| f32::from(layer.values.as_slice()[texel]) / 65535.0 * layer.weight_in_beta();
        self.layers.iter().map(value).fold(0.0, f32::max) / self.weight.max(1.0e-6)
    }
}

/// How much less cracks beside the guides count, at most. With 0 a crack far from all sites is as wide as those that
/// draw the picture; with 1 the picture stands alone.
const ASIDE: f32 = 0.55;

/// Cracks along a stroke that are shorter than twice this part of half its width stay thin. With 1 those that come in from
/// the side show as thorns on the letters; with 2 the cross-bars of small letters get lost.
const THORN: f32 = 1.6;

/// Cuts off the rise of the costs where a crack comes into a stroke from the side, and where it runs out into the corners
/// of a stroke's end; what runs along the middle of a stroke keeps its costs.
///
/// The opening of mathematical morphology: what is not at least so long as the stroke is broad goes.
fn without_thorns(costs: &[f32], guides: &Guidance<'_>) -> Vec<f32> {
    let most = costs.iter().copied().fold(0.0, f32::max);
    let reach = (THORN * guides.texels(most)) as usize;
    let negative = |costs: Vec<f32>| costs.into_iter().map(|cost| -cost).collect::<Vec<f32>>();
    negative(least_within(&negative(least_within(costs, reach)), reach))
}

/// The least value within `reach` of each.
fn least_within(values: &[f32], reach: usize) -> Vec<f32> {
    // Those that no later one undercuts, in order.
    let mut ahead = VecDeque::new();
    let mut next = 0;
    let least = |i: usize| {
        while next < values.len().min(i + reach + 1) {
            while ahead.back().is_some_and(|&last: &usize| values[last] >= values[next]) {
                ahead.pop_back();
            }
            ahead.push_back(next);
            next += 1;
        }
        while ahead.front().is_some_and(|&first| first + reach < i) {
            ahead.pop_front();
        }
        ahead.front().map_or(0.0, |&first| values[first])
    };
    (0..values.len()).map(least).collect()
}

/// By how much the noise widens and narrows cracks in strokes, as a share of their width. With 0 they look cut, with 0.7 small
/// letters cannot be read.
const UNEVEN: f32 = 0.3;

/// By how much a crack in a stroke exceeds full width at most. With 1 short words, whose letters are large, are not read as well;
/// without a limit the middles of broad surfaces gape.
const MOST: f32 = 2.0;

/// Path cost to width (Mould 2005, section 3.2: "the further the site, the wider").
struct Widths {
    least: f32,
    gain: f32,
    taper: f32,
    /// Full cost, in β.
    full: f32,
    /// Pattern units for each texel of a stroke's width.
    of_stroke: f32,
}

impl Widths {
    fn of(&self, Cost { cost, stroke, uneven }: Cost) -> f32 {
        let width = self.least + self.gain * ops::powf((cost / self.full).min(1.0), self.taper);
        width.max((self.of_stroke * stroke).min(MOST * (self.least + self.gain)) * uneven)
    }
}

/// A line with its widths.
struct Way {
    ends: [usize; 2],
    /// Texels.
    places: Vec<Vec2>,
    /// Pattern units.
    widths: Vec<f32>,
}

impl Way {
    /// Makes it nowhere widen by more than `slope` in a texel. Returns whether it has become thinner anywhere.
    fn run_out(&mut self, slope: f32) -> bool {
        let n = self.widths.len();
        let mut is_thinner = false;
        let mut pass = |from: usize, to: usize, places: &[Vec2]| {
            let most = self.widths[from] + slope * places[from].distance(places[to]);
            if self.widths[to] > most {
                self.widths[to] = most;
                is_thinner = true;
            }
        };
        (1..n).for_each(|i| pass(i - 1, i, &self.places));
        (1..n).rev().for_each(|i| pass(i, i - 1, &self.places));
        is_thinner
    }
}

/// How much a crack widens at most along its way, where there are guides: strokes end in needles that run on as the thin cracks beyond.
/// With more they look cut, with less short strokes get lost.
const RUN_OUT: f32 = 0.22;

/// Lets wide cracks run out where they do not go on: none is wider at a vertex than the second widest there, and none widens by more than
/// `slope` in a texel.
fn run_out(ways: &mut [Way], on_border: &[bool], slope: f32) {
    let mut widest = vec![[0.0f32; 2]; on_border.len()];
    // It is thinned out along a stroke from vertex to vertex; there are few in each.
    for _ in 0..16 {
        widest.fill([0.0; 2]);
        for way in &*ways {
            for (end, width) in way.ends.iter().zip([way.widths.first(), way.widths.last()]) {
                let widest = &mut widest[*end];
                let width = width.copied().unwrap_or(0.0);
                let at = widest.iter().position(|other| width > *other);
                if let Some(at) = at {
                    widest[at..].rotate_right(1);
                    widest[at] = width;
                }
            }
        }
        let mut is_thinner = false;
        for way in &mut *ways {
            for (end, at) in way.ends.into_iter().zip([0, way.widths.len().saturating_sub(1)]) {
                let [_, second] = widest[end];
                if let Some(width) = way.widths.get_mut(at)
                    && !on_border[end]
                    && *width > second
                {
                    (*width, is_thinner) = (second, true);
                }
            }
            is_thinner |= way.run_out(slope);
        }
        if !is_thinner {
            break;
        }
    }
}

/// The share of crossings that are less dear than the full width.
const USUAL: f32 = 0.97;

/// Cost of the dearest crossings.
fn dearest(costs: &[Vec<Cost>]) -> f32 {
    let mut all: Vec<f32> = costs.iter().flatten().map(|cost| cost.cost).collect();
    let n = ((all.len() as f32 * USUAL) as usize).min(all.len().saturating_sub(1));
    if all.is_empty() { 1.0 } else { all.select_nth_unstable_by(n, f32::total_cmp).1.max(1.0e-3) }
}

/// Slides crossings and joints towards the middle of their neighbours.
fn tauten(joints: &mut [Joint], lines: &mut [Line]) {
    for _ in 0..ROUNDS {
        let mut sums = vec![(Vec2::ZERO, 0.0f32); joints.len()];
        for line in lines.iter_mut() {
            let ends = line.ends.map(|end| joints[end].pos);
            let n = line.crossings.len();
            let mut before = ends[0];
            for i in 0..n {
                let after = if i + 1 < n { line.crossings[i + 1].pos() } else { ends[1] };
                let crossing = &mut line.crossings[i];
                let t = ((before + after) * 0.5 - crossing.from).dot(crossing.along);
                crossing.t = t.clamp(MARGIN, 1.0 - MARGIN);
                before = crossing.pos();
            }
            for (end, crossing) in line.ends.iter().zip([line.crossings.first(), line.crossings.last()]) {
                if let Some(crossing) = crossing {
                    sums[*end].0 += crossing.pos();
                    sums[*end].1 += 1.0;
                }
            }
        }
        for (joint, (sum, n)) in joints.iter_mut().zip(sums) {
            let middle = sum / n.max(1.0);
            if !joint.on_border {
                let reach = 0.5 - MARGIN;
                joint.pos = middle.clamp(joint.corner - reach, joint.corner + reach);
            } else if (middle.x - joint.corner.x).abs() > (middle.y - joint.corner.y).abs() {
                // The border is where the surface ends beside this corner: the line leaves it squarely.
                joint.pos = Vec2::new(joint.corner.x, middle.y);
            } else {
                joint.pos = Vec2::new(middle.x, joint.corner.y);
            }
        }
    }
}

/// Runs of costs without the jumps from texel to texel.
fn smooth(costs: &mut [f32]) {
    for _ in 0..4 {
        let mut before = costs.first().copied().unwrap_or_default();
        for i in 1..costs.len().saturating_sub(1) {
            let here = costs[i];
            costs[i] = 0.25 * before + 0.5 * here + 0.25 * costs[i + 1];
            before = here;
        }
    }
}

/// Indices of the points that are enough for the line (Douglas and Peucker 1973); the pieces at either end stay, where
/// lines come close to each other.
fn simplify(points: &[Vec2]) -> Vec<usize> {
    let n = points.len();
    if n < 5 {
        return (0..n).collect();
    }
    let mut keep = vec![false; n];
    for i in [0, 1, n - 2, n - 1] {
        keep[i] = true;
    }
    let mut stack = vec![(1, n - 2)];
    while let Some((a, b)) = stack.pop() {
        let (from, along) = (points[a], points[b] - points[a]);
        let inv = 1.0 / along.length_squared().max(1.0e-12);
        let off = |i: usize| {
            let t = ((points[i] - from).dot(along) * inv).clamp(0.0, 1.0);
            (points[i] - from - along * t).length_squared()
        };
        let worst =
            (a + 1..b).map(|i| (off(i), i)).fold((0.0, 0), |best, next| if next.0 > best.0 { next } else { best });
        if worst.0 > TOLERANCE * TOLERANCE {
            keep[worst.1] = true;
            stack.push((a, worst.1));
            stack.push((worst.1, b));
        }
    }
    (0..n).filter(|&i| keep[i]).collect()
}
