//! Cracks that appear over time: the front that runs along the seams, widths over time, and the seams as a network.

use super::seams::{Seam, Seams};
use crate::{
    pattern::{Link, LinkKind, NO_PARENT, Network, Node, PathPoint, SegmentPath},
    raster::{DepthField, Profile, stamp_path},
};
use glam::Vec2;
use std::{cmp::Reverse, collections::BinaryHeap};

/// Distance behind its tip over which a running crack opens to full width, pattern units.
const OPENING: f32 = 0.18;

/// Length of crack that is added per step in [`Seams::network`], pattern units.
pub const FRONT_STEP: f32 = 0.01;

/// The latest step, however far away the front starts.
const LAST_BIRTH: f32 = 1_000_000.0;

/// Smallest width in a network, whose widths must be above zero; pattern units.
const LEAST_WIDTH: f32 = 1.0e-5;

/// When a crack that starts at an impact and runs along the seams reaches each point of each seam.
///
/// The front starts at the vertex nearest to the impact. In parts that are not connected to it, it starts at their
/// own nearest vertex, with a delay that corresponds to the distance.
#[derive(Clone, Debug, PartialEq)]
pub struct Front {
    arrivals: Vec<Vec<f32>>,
    reach: f32,
}

impl Front {
    /// A front that starts at `from` (pattern units).
    #[must_use]
    pub fn new(seams: &Seams, from: Vec2) -> Self {
        let graph = Graph::new(seams);
        let arrivals = graph.run(&straight(from));
        let mut reach = 0.0f32;
        for arrival in &arrivals {
            reach = reach.max(arrival.distance);
        }
        let of_seam = |(i, seam): (usize, &Seam)| {
            (0..seam.points.len()).map(|k| arrivals[graph.id(seams, i, k)].distance).collect()
        };
        Self { arrivals: seams.seams.iter().enumerate().map(of_seam).collect(), reach }
    }

    /// The distance that the front has to run until all cracks have their full width, pattern units.
    #[must_use]
    pub fn reach(&self) -> f32 {
        self.reach + OPENING
    }
}

impl Seams {
    /// Stamps all seams into `field`.
    pub fn stamp(&self, field: &mut DepthField, profile: &Profile) {
        self.stamp_share(field, profile, 1.0);
    }

    /// Stamps all seams with `share` (0..=1) of their width: `min(t / t_max, 1)` of Mould 2005, eq. 5.
    pub fn stamp_share(&self, field: &mut DepthField, profile: &Profile, share: f32) {
        let share = share.clamp(0.0, 1.0);
        for seam in &self.seams {
            for pair in seam.points.windows(2) {
                let narrow = |point: PathPoint| PathPoint { width: point.width * share, ..point };
                stamp_path(field, profile, &SegmentPath::straight(narrow(pair[0]), narrow(pair[1])));
            }
        }
    }

    /// Stamps what a front has opened after running `distance` pattern units. Cracks are thin at their tips, and
    /// never narrower than at a smaller distance.
    ///
    /// `front` must have been made from these seams; for other seams only the common part is stamped.
    pub fn stamp_front(&self, field: &mut DepthField, profile: &Profile, front: &Front, distance: f32) {
        for (seam, arrivals) in self.seams.iter().zip(&front.arrivals) {
            for (pair, arrivals) in seam.points.windows(2).zip(arrivals.windows(2)) {
                let run = [distance - arrivals[0], distance - arrivals[1]];
                let length = pair[0].pos.distance(pair[1].pos);
                let open = |point: PathPoint, run: f32| PathPoint {
                    width: point.width * (run / OPENING).clamp(0.0, 1.0),
                    ..point
                };
                let mut stamp = |from, to| _ = stamp_path(field, profile, &SegmentPath::straight(from, to));
                if run[0].max(0.0) + run[1].max(0.0) >= length {
                    stamp(open(pair[0], run[0]), open(pair[1], run[1]));
                    continue;
                }
                // Part of the piece, from either end.
                for (from, to, run) in [(pair[0], pair[1], run[0]), (pair[1], pair[0], run[1])] {
                    if run > 0.0 {
                        let tip = PathPoint { pos: from.pos.lerp(to.pos, run / length), width: 0.0 };
                        stamp(open(from, run), tip);
                    }
                }
            }
        }
    }

    /// The seams as a network that has grown from an impact at `from`, with a step for every [`FRONT_STEP`].
    ///
    /// Every point of a seam is a node; where two arms of the front meet there is a link. The lines are straight,
    /// because seams are rough already.
    #[must_use]
    pub fn network(&self, from: Vec2) -> Network {
        self.network_by(&straight(from))
    }

    /// The same from anywhere: how far it is to each place, pattern units.
    pub(super) fn network_by(&self, far: &dyn Fn(Vec2) -> f32) -> Network {
        let graph = Graph::new(self);
        let arrivals = graph.run(far);
        let mut order: Vec<u32> = (0..arrivals.len() as u32).collect();
        order.sort_by_key(|&id| arrivals[id as usize].rank);
        let mut index = vec![0; arrivals.len()];
        (0u32..).zip(&order).for_each(|(i, &id)| index[id as usize] = i);

        let mut network = Network::new(self.extent, 0.0, 0);
        let birth = |id: u32| (arrivals[id as usize].distance / FRONT_STEP).min(LAST_BIRTH) as u32;
        for &id in &order {
            let parent = arrivals[id as usize].parent.map(|parent| index[parent as usize]);
            network.nodes.push(Node {
                pos: graph.places[id as usize],
                width: graph.widths[id as usize].max(LEAST_WIDTH),
                parent: parent.unwrap_or(NO_PARENT),
                generation: parent.map_or(0, |parent| network.nodes[parent as usize].generation + 1),
                birth: birth(id),
                impact: 0,
                bend: 0.0,
            });
        }
        let is_parent = |a: u32, b: u32| arrivals[a as usize].parent == Some(b);
        for &(a, b) in graph.pieces.iter().filter(|&&(a, b)| !is_parent(a, b) && !is_parent(b, a)) {
            network.links.push(Link {
                a: index[a as usize],
                b: index[b as usize],
                width: graph.widths[a as usize].min(graph.widths[b as usize]).max(LEAST_WIDTH),
                birth: birth(a).max(birth(b)),
                kind: LinkKind::Junction,
                bend: 0.0,
            });
        }
        network.links.sort_by_key(|link| (link.birth, link.a, link.b));
        network
    }
}

/// The straight way from a point; from the corner if it is nowhere.
fn straight(from: Vec2) -> impl Fn(Vec2) -> f32 {
    let from = if from.is_finite() { from } else { Vec2::ZERO };
    move |place| place.distance(from)
}

/// All points of all seams, vertices first.
struct Graph {
    places: Vec<Vec2>,
    /// A vertex is as wide as the widest seam that ends there.
    widths: Vec<f32>,
    pieces: Vec<(u32, u32)>,
    /// The first inner point of each seam.
    first: Vec<usize>,
    /// The pieces at each point: where each list begins, and the lists.
    begins: Vec<u32>,
    beside: Vec<u32>,
}

/// How the front reaches a point.
#[derive(Clone, Copy)]
struct Arrival {
    distance: f32,
    parent: Option<u32>,
    /// Position in the order of arrival.
    rank: u32,
}

impl Graph {
    fn new(seams: &Seams) -> Self {
        let mut places: Vec<Vec2> = seams.vertices.iter().map(|vertex| vertex.pos).collect();
        let mut widths = vec![0.0f32; places.len()];
        let (mut first, mut pieces) = (Vec::new(), Vec::new());
        for seam in &seams.seams {
            first.push(places.len());
            let n = seam.points.len();
            let mut before = seam.from;
            for (k, point) in seam.points.iter().enumerate() {
                let id = match k {
                    0 => seam.from,
                    k if k + 1 == n => seam.to,
                    _ => {
                        places.push(point.pos);
                        widths.push(0.0);
                        places.len() as u32 - 1
                    }
                };
                widths[id as usize] = widths[id as usize].max(point.width);
                if k > 0 {
                    pieces.push((before, id));
                }
                before = id;
            }
        }
        let mut begins = vec![0u32; places.len() + 1];
        for id in pieces.iter().flat_map(|&(a, b)| [a, b]) {
            begins[id as usize + 1] += 1;
        }
        for id in 0..places.len() {
            begins[id + 1] += begins[id];
        }
        let mut next = begins.clone();
        let mut beside = vec![0; 2 * pieces.len()];
        for &(a, b) in &pieces {
            for (from, to) in [(a, b), (b, a)] {
                beside[next[from as usize] as usize] = to;
                next[from as usize] += 1;
            }
        }
        Self { places, widths, pieces, first, begins, beside }
    }

    /// The number of point `k` of seam `i`.
    fn id(&self, seams: &Seams, i: usize, k: usize) -> usize {
        let seam = &seams.seams[i];
        match k {
            0 => seam.from as usize,
            k if k + 1 == seam.points.len() => seam.to as usize,
            k => self.first[i] + k - 1,
        }
    }

    fn neighbours(&self, id: u32) -> &[u32] {
        &self.beside[self.begins[id as usize] as usize..self.begins[id as usize + 1] as usize]
    }

    /// The point of each connected part that is nearest.
    fn starts(&self, far: &dyn Fn(Vec2) -> f32) -> Vec<u32> {
        let mut seen = vec![false; self.places.len()];
        let mut starts = Vec::new();
        for id in 0..self.places.len() as u32 {
            if seen[id as usize] {
                continue;
            }
            seen[id as usize] = true;
            let (mut part, mut next) = (vec![id], 0);
            while let Some(&here) = part.get(next) {
                next += 1;
                for &beside in self.neighbours(here) {
                    if !std::mem::replace(&mut seen[beside as usize], true) {
                        part.push(beside);
                    }
                }
            }
            let part = part.into_iter().map(|id| (far(self.places[id as usize]), id));
            let nearest = part.min_by(|(a, first), (b, second)| a.total_cmp(b).then(first.cmp(second)));
            starts.extend(nearest.map(|(_, id)| id));
        }
        starts
    }

    /// Shortest paths along the seams; ties go to the lower number.
    fn run(&self, far: &dyn Fn(Vec2) -> f32) -> Vec<Arrival> {
        let mut arrivals = vec![Arrival { distance: f32::INFINITY, parent: None, rank: u32::MAX }; self.places.len()];
        let mut heap = BinaryHeap::new();
        for id in self.starts(far) {
            let distance = far(self.places[id as usize]);
            arrivals[id as usize].distance = distance;
            // The bits of non-negative floats have the order of the floats.
            heap.push(Reverse((distance.to_bits(), id)));
        }
        let mut rank = 0;
        while let Some(Reverse((_, id))) = heap.pop() {
            if arrivals[id as usize].rank != u32::MAX {
                continue;
            }
            arrivals[id as usize].rank = rank;
            rank += 1;
            let here = arrivals[id as usize].distance;
            for &beside in self.neighbours(id) {
                let distance = here + self.places[id as usize].distance(self.places[beside as usize]);
                let there = &mut arrivals[beside as usize];
                if there.rank == u32::MAX && distance < there.distance {
                    there.distance = distance;
                    there.parent = Some(id);
                    heap.push(Reverse((distance.to_bits(), beside)));
                }
            }
        }
        arrivals
    }
}
