//! Primitives bent along paths, as nodes and links of a network (section 3.3 of the paper).

use super::{
    course::Course,
    field::Turbulence,
    grow::{Strand, StrandEnd},
    line::PrimitiveLine,
    params::StrandParams,
    primitive::Primitive,
};
use crate::{
    math::{Rng, ops},
    pattern::{Link, LinkKind, NO_IMPACT, NO_PARENT, Network, Node},
};
use glam::Vec2;

/// The least width of a node, pattern units.
const LEAST_WIDTH: f32 = 1.0e-5;

/// Share of a primitive's length at either end in which its widths approach the mean.
const BLEND: f32 = 0.12;

/// Frequencies of the noise that varies the width along strands, and of that which bends nets.
const WIDTH_FREQUENCY: f32 = 13.0;
const WARP_FREQUENCY: f32 = 0.55;

/// A primitive at its place on a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub(super) primitive: usize,
    /// 1, or -1 if it is mirrored.
    pub(super) side: f32,
    /// First point of the path, and number of steps.
    pub(super) from: f32,
    pub(super) steps: f32,
    /// Position of its middle across the path, primitives.
    pub(super) lane: f32,
}

/// Collects the nodes of all strands.
struct Bender<'a> {
    params: &'a StrandParams,
    extent: Vec2,
    primitives: &'a [Primitive],
    strands: &'a [Strand],
    courses: &'a [Course],
    widths: Turbulence,
    /// In the order in which they are added, not of their birth.
    nodes: Vec<Node>,
    /// Ends of links, and their width.
    links: Vec<(u32, u32, f32)>,
    /// For each strand: the nodes at its joints in its middle lane, and all nodes of its main line with their
    /// points of the path.
    joints: Vec<Vec<u32>>,
    mains: Vec<Vec<(f32, u32)>>,
}

/// The primitives along each strand.
pub(super) fn place(
    params: &StrandParams,
    primitives: &[Primitive],
    strands: &[Strand],
    seed: u64,
) -> Vec<Vec<Placed>> {
    let every = params.tile_steps() as usize;
    let rng = Rng::new(seed).stream("primitives");
    (0u64..)
        .zip(strands)
        .map(|(index, strand)| {
            let mut rng = rng.substream(index);
            let last = strand.points.len() - 1;
            let rows = (0..last).step_by(every);
            rows.flat_map(|from| (0..params.lanes).map(move |lane| (from, lane)))
                .map(|(from, lane)| Placed {
                    primitive: ((rng.unit() * primitives.len() as f32) as usize).min(primitives.len() - 1),
                    side: if rng.unit() < 0.5 { 1.0 } else { -1.0 },
                    from: from as f32,
                    steps: (last - from).min(every) as f32,
                    lane: lane as f32 - 0.5 * (params.lanes - 1) as f32,
                })
                .collect()
        })
        .collect()
}

/// The network of strands.
pub(super) fn bend(
    params: &StrandParams,
    primitives: &[Primitive],
    (strands, courses): (&[Strand], &[Course]),
    extent: Vec2,
    seed: u64,
) -> Network {
    let placed = place(params, primitives, strands, seed);
    let mut bender = Bender {
        params,
        extent,
        primitives,
        strands,
        courses,
        widths: Turbulence::new(seed, "widths"),
        nodes: Vec::new(),
        links: Vec::new(),
        joints: vec![Vec::new(); strands.len()],
        mains: vec![Vec::new(); strands.len()],
    };
    for (strand, placed) in placed.iter().enumerate() {
        bender.add(strand, placed);
    }
    for strand in 0..strands.len() {
        bender.link_end(strand);
    }
    bender.finish(seed)
}

impl Bender<'_> {
    /// Adds a strand.
    fn add(&mut self, strand: usize, placed: &[Placed]) {
        if placed.is_empty() {
            return;
        }
        let lanes = self.params.lanes as usize;
        let middle = (lanes - 1) / 2;
        let first = match self.strands[strand].parent {
            Some((parent, point)) => {
                self.joints[parent as usize].get((point / self.params.tile_steps()) as usize).copied()
            }
            None => None,
        };
        // The node at which each lane goes on.
        let mut heads: Vec<Option<u32>> = vec![None; lanes];
        heads[middle] = first;
        for row in placed.chunks(lanes) {
            // The end of the line to the right of the primitive before.
            let mut beside = None;
            for (lane, tile) in row.iter().enumerate() {
                let head = heads[lane].unwrap_or_else(|| self.push(strand, tile, (Vec2::ZERO, None), NO_PARENT));
                if lane == middle {
                    self.joints[strand].push(head);
                    if self.mains[strand].is_empty() {
                        self.mains[strand].push((tile.from, head));
                    }
                }
                let (tail, right) = self.add_primitive(strand, tile, (head, beside), lane == middle);
                (heads[lane], beside) = (Some(tail), right);
            }
        }
        // A branch may start where the strand ends.
        self.joints[strand].extend(heads[middle]);
    }

    /// Adds a primitive; returns the nodes at its tail and at its right connector.
    fn add_primitive(
        &mut self,
        strand: usize,
        tile: &Placed,
        (head, beside): (u32, Option<u32>),
        is_middle: bool,
    ) -> (u32, Option<u32>) {
        let primitives = self.primitives;
        let primitive = &primitives[tile.primitive];
        let mean = primitive.mean_width();
        // A mirrored primitive has its left connector on the right.
        let sides = primitive.sides().map(|[left, right]| if tile.side > 0.0 { [left, right] } else { [right, left] });
        let [outer_left, outer_right] =
            [tile.lane == -0.5 * (self.params.lanes - 1) as f32, tile.lane == 0.5 * (self.params.lanes - 1) as f32];
        let mut ids: Vec<Vec<u32>> = Vec::new();
        let mut right = None;
        for (number, PrimitiveLine { from, points }) in (0u32..).zip(primitive.lines()) {
            let is_left = sides.is_some_and(|[left, _]| left == number);
            let is_right = sides.is_some_and(|[_, right]| right == number);
            let begins = from.and_then(|(line, point)| ids.get(line as usize)?.get(point as usize)).copied();
            let mut parent = begins.unwrap_or(head);
            let mut line = Vec::new();
            if number == 0 {
                line.push(head);
            }
            // The outermost lines of a net are cut short; towards the left neighbour the last piece is a link.
            let is_outer = is_left && outer_left || is_right && outer_right;
            let skip = usize::from(number == 0);
            let count = if is_outer { points.len() / 2 } else { points.len() - usize::from(is_left) };
            for point in points.iter().take(count).skip(skip) {
                let share = (point.at.y / BLEND).min((1.0 - point.at.y) / BLEND).clamp(0.0, 1.0);
                let relative = point.width / mean;
                let width = if number == 0 { 1.0 + (relative - 1.0) * share } else { relative };
                parent = self.push(strand, tile, (point.at, Some(width)), parent);
                line.push(parent);
                if number == 0 && is_middle {
                    self.mains[strand].push((tile.from + point.at.y * tile.steps, parent));
                }
            }
            if let Some(beside) = beside.filter(|_| is_left && !is_outer) {
                self.link(parent, beside);
            }
            if is_right && !is_outer {
                right = Some(parent);
            }
            ids.push(line);
        }
        let tail = ids.first().and_then(|main| main.last()).copied().unwrap_or(head);
        (tail, right)
    }

    /// Adds a node at a point of a primitive, given with its relative width.
    fn push(&mut self, strand: usize, tile: &Placed, (at, width): (Vec2, Option<f32>), parent: u32) -> u32 {
        let s = tile.from + at.y * tile.steps;
        let of = &self.strands[strand];
        let mut pos = self.place(strand, tile, at);
        let inside = pos.clamp(Vec2::ZERO, self.extent);
        if inside != pos && self.nodes.get(parent as usize).is_some_and(|node| self.is_on_border(node.pos)) {
            // Lines do not run along the border.
            return parent;
        }
        pos = inside;
        if at.x == 0.0 && tile.lane == 0.0 && (s == 0.0 || s == (of.points.len() - 1) as f32) {
            // Ends on the border stay there.
            pos = self.courses[strand].at(s).0.clamp(Vec2::ZERO, self.extent);
        }
        let width = self.width_at(strand, s, pos) * width.unwrap_or(1.0);
        let before = self.nodes.get(parent as usize).copied();
        let born = (of.begins + s.max(0.0) * self.params.step) / self.params.pace;
        let birth = (born as u32).max(before.map_or(0, |node| node.birth));
        let generation = before.map_or(0, |node| node.generation + 1);
        let node = Node { pos, width: width.max(LEAST_WIDTH), parent, generation, birth, impact: NO_IMPACT, bend: 0.0 };
        self.nodes.push(node);
        self.nodes.len() as u32 - 1
    }

    /// Where a point of a primitive lies on the surface.
    fn place(&self, strand: usize, tile: &Placed, at: Vec2) -> Vec2 {
        let (mut across, mut along) = (at.x * tile.side * self.params.sideways, at.y);
        if self.params.lanes > 1 {
            // Connectors of neighbours stay together: nets keep their proportions, and are bent as a whole.
            let half = self.half_width(tile.primitive);
            across = at.x * tile.side * 0.5 / half + tile.lane;
            let row = tile.from / self.params.tile_steps() as f32;
            let place = Vec2::new(across, row + along);
            across += 0.35 * self.widths.at(place, WARP_FREQUENCY);
            along += 0.35 * self.widths.at(place + Vec2::new(37.5, 11.5), WARP_FREQUENCY);
        }
        let s = tile.from + along * tile.steps;
        let (pos, normal) = self.courses[strand].at(s);
        pos + normal * (across * tile.steps * self.params.step)
    }

    fn is_on_border(&self, pos: Vec2) -> bool {
        (pos.cmpeq(Vec2::ZERO) | pos.cmpeq(self.extent)).any()
    }

    fn half_width(&self, primitive: usize) -> f32 {
        let image = self.primitives[primitive].image();
        0.5 * image.width() as f32 / image.height() as f32
    }

    /// Width of a strand at point `s`, without that of its primitive.
    fn width_at(&self, strand: usize, s: f32, pos: Vec2) -> f32 {
        let (of, params) = (&self.strands[strand], self.params);
        let last = (of.points.len() - 1).max(1) as f32;
        let share = (s / last).clamp(0.0, 1.0);
        let taper = params.taper;
        let end = match of.end {
            StrandEnd::Border => 1.0,
            StrandEnd::Joined { .. } => 1.0 - 0.4 * taper.min(1.0) * share,
            _ => ops::powf((1.0 - share).max(0.004), 0.7 * taper),
        };
        let is_free = of.parent.is_none() && {
            let (low, high) = (of.points[0], self.extent - of.points[0]);
            low.min(high).min_element() > params.step
        };
        let start = if is_free { (0.3 + 0.7 * (share / 0.12).min(1.0)).max(1.0 - taper.min(1.0)) } else { 1.0 };
        let slow = 1.0 + 0.45 * self.widths.at(pos, WIDTH_FREQUENCY);
        let depth: f32 = (0..of.depth).map(|_| params.child_width).product();
        params.width * depth * end * start * slow
    }

    fn link(&mut self, a: u32, b: u32) {
        let [x, y] = [a, b].map(|i| self.nodes[i as usize].width);
        self.links.push((a, b, x.min(y)));
    }

    /// Joins the end of a strand to the nearest node of the strand that it has met.
    fn link_end(&mut self, strand: usize) {
        let StrandEnd::Joined { strand: other, point } = self.strands[strand].end else { return };
        let Some(&(_, end)) = self.mains[strand].last() else { return };
        let pos = self.nodes[end as usize].pos;
        let reach = self.params.tile_steps() as f32;
        let near =
            self.mains[other as usize].iter().filter(|(s, node)| (s - point as f32).abs() <= reach && *node != end);
        let distance = |&(_, node): &(f32, u32)| self.nodes[node as usize].pos.distance_squared(pos);
        if let Some(&(_, near)) = near.min_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.1.cmp(&b.1))) {
            self.link(end, near);
        }
    }

    /// All nodes in the order of their birth.
    fn finish(self, seed: u64) -> Network {
        let mut order: Vec<u32> = (0..self.nodes.len() as u32).collect();
        order.sort_by_key(|&i| (self.nodes[i as usize].birth, i));
        let mut place = vec![0; order.len()];
        for (new, &old) in (0u32..).zip(&order) {
            place[old as usize] = new;
        }
        let renumber = |i: u32| place.get(i as usize).copied().unwrap_or(NO_PARENT);
        let mut network = Network::new(self.extent, 0.0, seed);
        for &old in &order {
            let node = self.nodes[old as usize];
            network.nodes.push(Node { parent: renumber(node.parent), ..node });
        }
        let birth = |i: u32| self.nodes[i as usize].birth;
        let mut links: Vec<Link> = self
            .links
            .iter()
            .map(|&(a, b, width)| Link {
                a: renumber(a),
                b: renumber(b),
                width,
                birth: birth(a).max(birth(b)),
                kind: LinkKind::Junction,
                bend: 0.0,
            })
            .collect();
        links.sort_by_key(|link| link.birth);
        network.links = links;
        network
    }
}
