//! Finds, follows and smooths the boundaries of the regions.
//!
//! A boundary runs between two neighbouring texels of different regions. Its line crosses the straight connection of
//! their centres, at first in the middle. The squares between four texel centres link the crossings to lines and
//! contain the points where three or four lines meet. Then every crossing slides along its connection towards the
//! middle of its neighbours, as if the line were a taut thread. No point leaves its connection or its square, so
//! lines touch only at their ends. At last all of them are bent in small kinks ([`Roughness`]), which keeps the order of all places.

use super::{
    MapCharts,
    branches::branch,
    chains::LineCosts,
    charts::MapGround,
    level::Level,
    params::VoronoiParams,
    rough::Roughness,
    seams::{Seam, SeamVertex, Seams},
    widths::{
        ASIDE, Cost, FILLED, Guidance, NARROWED, RUN_OUT, UNEVEN, Way, Widths, dearest, run_out, smooth, without_thorns,
    },
};
use crate::pattern::{PathPoint, SurfaceFrame};
use glam::{IVec2, UVec2, Vec2};

/// How often the threads are tightened. Once leaves stairs, twenty times smooths away what the noise has made.
const ROUNDS: usize = 6;

/// Smallest distance of a crossing from a texel centre, texels.
const MARGIN: f32 = 0.12;

/// Largest distance of points from the line that replaces them, texels, and where lines have kinks: two lines keep `MARGIN * sqrt(2)` = 0.17
/// apart, and kinks bring them closer.
const TOLERANCE: f32 = 0.08;
const TOLERANCE_IN_KINKS: f32 = 0.03;

/// The sides of a corner of four texels, in the order north, east, south, west.
const SIDES: [IVec2; 4] = [IVec2::new(0, -1), IVec2::new(1, 0), IVec2::new(0, 1), IVec2::new(-1, 0)];

/// The continuation of a boundary at a corner.
#[derive(Clone, Copy, PartialEq)]
enum Corner {
    /// It continues through this side.
    Pass(usize),
    /// It ends.
    End,
}

/// Bits of [`Tracer::edges`].
const RIGHT: u8 = 1;

const DOWN: u8 = 2;

/// Set in addition when the edge has been followed.
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

/// A vertex in texels, kept within its square.
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

    /// Searches up to `rows` further rows for boundaries; returns whether there are more.
    pub(super) fn scan(&mut self, level: &Level, charts: Option<&MapCharts>, rows: usize) -> bool {
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
            if let Some(charts) = charts {
                charts.disjoin(edges, self.row, [RIGHT, DOWN]);
            }
            self.row += 1;
        }
        self.row < h
    }

    /// How much of the surface has been scanned, 0..=1.
    pub(super) fn progress(&self) -> f32 {
        self.row as f32 / self.size.y.max(1) as f32
    }

    /// Texel and bit of the edge through `side` of `corner`, if it lies on the surface.
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

    /// The continuation of a boundary that reaches `corner` through `side`.
    fn corner(&self, level: &Level, charts: Option<&MapCharts>, corner: IVec2, side: usize) -> Corner {
        if charts.is_some_and(|charts| !charts.is_whole(corner)) {
            return Corner::End;
        }
        let mut others = (0..4).filter(|&other| other != side && self.is_boundary(corner, other));
        match (others.next(), others.next(), others.next()) {
            (Some(other), None, None) => Corner::Pass(other),
            (Some(_), Some(_), Some(_)) => {
                // Four boundaries are two that pass each other if two diagonal texels belong to the same region.
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

    /// Follows a boundary from `corner` through `side` to its end.
    fn follow(
        &mut self,
        level: &Level,
        charts: Option<&MapCharts>,
        mut corner: IVec2,
        mut side: usize,
    ) -> (Vec<Crossing>, IVec2) {
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
            match self.corner(level, charts, corner, (side + 2) % 4) {
                Corner::Pass(next) => side = next,
                Corner::End => break,
            }
        }
        (crossings, corner)
    }

    /// The lines of all boundaries, after the whole surface has been scanned.
    fn lines(&mut self, level: &Level, charts: Option<&MapCharts>) -> (Vec<Joint>, Vec<Line>) {
        let size = self.size.as_ivec2();
        let (mut joints, mut lines) = (Vec::new(), Vec::new());
        let mut joint_at = std::collections::BTreeMap::new();
        let mut joint = |joints: &mut Vec<Joint>, corner: IVec2, texel: IVec2| {
            // Lines of different charts have no end in common.
            let chart = charts.map_or(0, |charts| charts.at(texel));
            *joint_at.entry((corner.y, corner.x, chart)).or_insert_with(|| {
                let is_outer = corner.x == 0 || corner.y == 0 || corner.x == size.x || corner.y == size.y;
                let on_border = is_outer || charts.is_some_and(|charts| !charts.is_whole(corner));
                joints.push(Joint { corner: corner.as_vec2(), pos: corner.as_vec2(), on_border });
                joints.len() - 1
            })
        };
        // First from all corners where boundaries end; then the remaining ones are closed rings.
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
                    if !open || (!rings && self.corner(level, charts, corner, side) != Corner::End) {
                        continue;
                    }
                    let (crossings, end) = self.follow(level, charts, corner, side);
                    let ends = [corner, end].map(|corner| joint(&mut joints, corner, texel));
                    lines.push(Line { ends, crossings });
                }
            }
        }
        (joints, lines)
    }

    /// The seams of the finest of `levels`, after the whole surface has been scanned, and the cost of full width:
    /// `full`, or that of the most expensive crossings.
    pub(super) fn finish(
        mut self,
        levels: &[Level],
        params: &VoronoiParams,
        ground: MapGround<'_>,
        (guides, rough): (&Guidance<'_>, &Roughness),
        full: Option<f32>,
    ) -> (Seams, f32) {
        let MapGround { frame, charts } = ground;
        let mut seams = Seams { extent: frame.extent(), ..Seams::default() };
        let Some(finest) = levels.last() else { return (seams, 1.0) };
        let (mut joints, mut lines) = self.lines(finest, charts);
        tauten(&mut joints, &mut lines);
        let births: Vec<usize> = lines.iter().map(|line| self.birth(line, levels)).collect();
        let mut along: Vec<LineCosts> =
            lines.iter().zip(&births).map(|(line, &birth)| self.costs_along(line, &levels[birth], guides)).collect();
        let vertices: Vec<Vec2> = joints.iter().map(|joint| joint.pos).collect();
        without_thorns(&mut along, &vertices, guides);
        let costs: Vec<Vec<Cost>> =
            lines.iter().zip(&along).map(|(line, along)| self.costs(line, along, (guides, rough), frame)).collect();
        drop(along);
        let full = full.unwrap_or_else(|| dearest(&costs));
        let (least, gain) = (params.least_width, params.width - params.least_width);
        let of_stroke = params.stroke_width * guides.by_breadth(FILLED) / frame.texels_per_unit();
        let widths = Widths { least, gain, taper: params.taper, full, of_stroke };
        let deviation = guides.deviation();
        let tolerance = if rough.has_kinks() && deviation > 0.0 { TOLERANCE_IN_KINKS } else { TOLERANCE };
        let moved = |place: Vec2| rough.moved(place, deviation);
        let regions: Vec<_> = lines.iter().map(|line| self.regions(line, finest, &joints)).collect();
        let mut ways: Vec<Way> = (lines.iter().zip(&costs))
            .map(|(line, costs)| {
                let ends = line.ends.map(|end| joints[end].pos);
                let crossings = line.crossings.iter().map(Crossing::pos);
                // A vertex has the cost of the crossing beside it.
                let last = costs.len().saturating_sub(1);
                let beside = || std::iter::once(0).chain(0..costs.len()).chain([last]).filter_map(|i| costs.get(i));
                Way {
                    ends: line.ends,
                    places: std::iter::once(ends[0]).chain(crossings).chain([ends[1]]).map(moved).collect(),
                    widths: beside().map(|cost| widths.of(*cost)).collect(),
                    inside: beside().map(|cost| cost.inside).collect(),
                }
            })
            .collect();
        if !guides.layers.is_empty() {
            let on_border: Vec<bool> = joints.iter().map(|joint| joint.on_border).collect();
            run_out(&mut ways, &on_border, RUN_OUT / frame.texels_per_unit());
            branch(&mut ways, &regions, &on_border, frame.texels_per_unit(), guides);
        }
        let to_seam = |(((line, way), birth), [left, right]): (((&Line, &Way), usize), [u32; 2])| {
            line.crossings.first()?;
            let point = |i: usize| PathPoint { pos: frame.to_pos(way.places[i]), width: way.widths[i] };
            Some(Seam {
                from: line.ends[0] as u32,
                to: line.ends[1] as u32,
                left,
                right,
                level: birth as u32,
                points: simplify(&way.places, tolerance).into_iter().map(point).collect(),
            })
        };
        seams.seams = lines.iter().zip(&ways).zip(births).zip(regions).filter_map(to_seam).collect();
        let vertex = |joint: &Joint| SeamVertex { pos: frame.to_pos(moved(joint.pos)), on_border: joint.on_border };
        seams.vertices = joints.iter().map(vertex).collect();
        (seams, full)
    }

    /// A texel on the left and one on the right of a line as one leaves its first vertex; left is where y is smaller if x increases.
    fn sides(&self, line: &Line, joints: &[Joint]) -> Option<[usize; 2]> {
        let first = line.crossings.first()?;
        let [a, b] = self.beside(first);
        let heading = first.pos() - joints[line.ends[0]].corner;
        Some(if heading.perp_dot(first.from - first.pos()) < 0.0 { [a, b] } else { [b, a] })
    }

    /// The regions on the left and on the right of a line.
    fn regions(&self, line: &Line, finest: &Level, joints: &[Joint]) -> [u32; 2] {
        self.sides(line, joints).map_or([0; 2], |sides| sides.map(|texel| finest.region(texel)))
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

    /// A line with path costs along it, reduced away from the guides.
    fn costs_along(&self, line: &Line, level: &Level, guides: &Guidance<'_>) -> LineCosts {
        let mean =
            |crossing: &Crossing, of: &dyn Fn(usize) -> f32| self.beside(crossing).map(of).iter().sum::<f32>() * 0.5;
        let mut costs: Vec<f32> =
            line.crossings.iter().map(|crossing| mean(crossing, &|texel| level.cost(texel))).collect();
        smooth(&mut costs);
        let inside: Vec<f32> =
            line.crossings.iter().map(|crossing| mean(crossing, &|texel| guides.at(texel))).collect();
        let aside = ASIDE * guides.share();
        costs.iter_mut().zip(&inside).for_each(|(cost, inside)| *cost *= 1.0 - aside * (1.0 - inside));
        LineCosts { ends: line.ends, places: line.crossings.iter().map(Crossing::pos).collect(), costs, inside }
    }

    /// What the widths along a line depend on.
    fn costs(
        &self,
        line: &Line,
        along: &LineCosts,
        (guides, rough): (&Guidance<'_>, &Roughness),
        frame: &SurfaceFrame,
    ) -> Vec<Cost> {
        let weigh = |((&cost, inside), crossing): ((&f32, &f32), &Crossing)| {
            let at = crossing.pos();
            let (place, of_picture) = (frame.to_pos(at), rough.of_picture(at));
            let thin = guides.thin(place) * of_picture;
            let uneven = 1.0 - guides.by_breadth(UNEVEN) * thin;
            let narrowed = 1.0 - guides.by_breadth(NARROWED).max(0.0) * thin * inside.min(1.0);
            let beside = 1.0 + (guides.beside(place, *inside) - 1.0) * of_picture;
            Cost { cost, stroke: 2.0 * inside * guides.texels(cost), uneven, narrowed, beside, inside: inside.min(1.0) }
        };
        along.costs.iter().zip(&along.inside).zip(&line.crossings).map(weigh).collect()
    }
}

/// Moves crossings and joints towards the middle of their neighbours.
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
                // This corner is on the border: the line meets the border at a right angle.
                joint.pos = Vec2::new(joint.corner.x, middle.y);
            } else {
                joint.pos = Vec2::new(middle.x, joint.corner.y);
            }
        }
    }
}

/// Indices of the points that are needed for the line (Douglas and Peucker 1973). The pieces at both ends stay,
/// because lines are close to each other there.
fn simplify(points: &[Vec2], tolerance: f32) -> Vec<usize> {
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
        if worst.0 > tolerance * tolerance {
            keep[worst.1] = true;
            stack.push((a, worst.1));
            stack.push((worst.1, b));
        }
    }
    (0..n).filter(|&i| keep[i]).collect()
}
