//! All paths of a set of strands, grown together: branching (section 3.4 of the paper) and repulsion.

use super::{
    error::StrandError,
    field::{Directions, GuidanceField, Turbulence},
    near::{Mark, Near},
    params::{Propagation, StrandParams},
    walk::Walk,
};
use crate::math::{hash_unit, mix};
use glam::Vec2;

/// The largest number of strands that start by themselves.
pub const MAX_STARTS: usize = 4096;

/// The largest number of points of all strands together; a strand that would need more ends there.
pub const MAX_STRAND_POINTS: usize = 1 << 20;

/// Salts of the random draws. Frozen: a seed must give the same result in every version.
const SIDE: u64 = 0x5401;
const CHILD_FIELD: u64 = 0x5402;

/// Frequency of the noise that varies the branch cost.
const BRANCH_FREQUENCY: f32 = 7.0;

/// A tip moves towards a strand, and meets it, if the cosine of the angle to it is above this; otherwise it is turned
/// away.
const STEEP: f32 = 0.75;

/// Strands that touch may be close within this many repulsion distances of where they do.
const JOINT: f32 = 1.6;

/// A branch shorter than this many repulsion distances is taken back if it returns to its start.
const SHORT: f32 = 8.0;

/// Where a strand starts by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
pub struct StrandStart {
    /// Position, pattern units.
    pub pos: Vec2,
    /// Direction in which it is driven at first, by [`StrandParams::spread`]; `None` = it follows the field from the
    /// start.
    pub direction: Option<Vec2>,
}

impl StrandStart {
    /// A start at `pos` that follows the field.
    #[must_use]
    pub const fn new(pos: Vec2) -> Self {
        Self { pos, direction: None }
    }
}

/// Why a strand ends where it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrandEnd {
    /// It has its full length.
    Length,
    /// It has come to the border of the surface.
    Border,
    /// The field has no direction there.
    Field,
    /// It has joined a strand.
    Joined {
        /// Index of that strand.
        strand: u32,
        /// Index of the point of that strand at which it ends.
        point: u32,
    },
    /// It has come close to a place where other strands meet already.
    Stopped,
    /// It would have started too close to another strand or come back at once, and has one point only.
    Crowded,
}

/// The path of one strand.
#[derive(Clone, Debug, PartialEq)]
pub struct Strand {
    /// The points, one [`StrandParams::step`] apart, pattern units.
    pub points: Vec<Vec2>,
    /// The strand from which it branches and the index of the point of that strand where it starts; `None` if it
    /// starts by itself.
    pub parent: Option<(u32, u32)>,
    /// Number of branchings between it and a strand that starts by itself.
    pub depth: u32,
    /// Distance from the first start to its first point along the strands.
    pub begins: f32,
    /// Why it ends.
    pub end: StrandEnd,
}

/// A strand that still grows.
#[derive(Clone, Debug)]
struct Tip {
    strand: u32,
    walk: Walk,
    /// Number of steps that it may still make.
    left: u32,
    /// Number of steps of its whole length.
    length: u32,
    branch_cost: f32,
    across: Vec2,
}

/// What a tip meets.
enum Contact {
    None,
    /// Another direction than that of the field.
    Turned(Vec2),
    Meets(Mark),
}

/// The paths of all strands.
#[derive(Clone, Debug)]
pub(super) struct Paths {
    pub(super) params: StrandParams,
    pub(super) extent: Vec2,
    pub(super) seed: u64,
    /// The field of each depth.
    fields: Vec<GuidanceField>,
    branching: Turbulence,
    near: Option<Near>,
    /// For each strand: the strands that it touches, and where.
    joints: Vec<Vec<(u32, Vec2)>>,
    tips: Vec<Tip>,
    points: usize,
    /// The most points of all strands together.
    most: usize,
    pub(super) strands: Vec<Strand>,
}

impl Paths {
    pub(super) fn new(
        params: &StrandParams,
        directions: Directions,
        starts: &[StrandStart],
        extent: Vec2,
        seed: u64,
        most: usize,
    ) -> Result<Self, StrandError> {
        params.validate()?;
        let field = GuidanceField::new(directions, params.frequency, params.rotation, extent, seed)?;
        if starts.len() > MAX_STARTS {
            return Err(StrandError::TooManyStarts { count: starts.len(), most: MAX_STARTS });
        }
        for (index, start) in starts.iter().enumerate() {
            // Also false for NaN.
            if !(start.pos.cmpge(Vec2::ZERO) & start.pos.cmple(extent)).all() {
                let [x, y] = start.pos.to_array();
                return Err(StrandError::StartOutside { index, x, y, width: extent.x, height: extent.y });
            }
        }
        let child =
            |depth: u32| field.with_noise(params.child_frequency, mix(seed ^ CHILD_FIELD ^ u64::from(depth) << 32));
        let fields = std::iter::once(field.clone()).chain((1..=params.depth).map(child)).collect();
        let reach = 2.0 * params.repulsion;
        let mut paths = Self {
            params: *params,
            extent,
            seed,
            fields,
            branching: Turbulence::new(seed, "branching"),
            near: (reach > 0.0).then(|| Near::new(extent, reach)),
            joints: Vec::new(),
            tips: Vec::new(),
            points: 0,
            most,
            strands: Vec::new(),
        };
        let length = (params.length / params.step).round() as u32;
        for start in starts {
            let across = start.direction.map_or(Vec2::ZERO, |direction| direction.normalize_or_zero());
            paths.begin(start.pos, across, length, None);
        }
        Ok(paths)
    }

    /// Grows all strands by up to about so many steps of their tips. Returns whether all have ended.
    pub(super) fn grow(&mut self, mut steps: u32) -> bool {
        while !self.tips.is_empty() {
            if steps == 0 {
                return false;
            }
            steps = steps.saturating_sub(self.tips.len() as u32);
            let mut tips = std::mem::take(&mut self.tips);
            // Children that start in this round grow from the next one on.
            tips.retain_mut(|tip| self.advance(tip));
            tips.append(&mut self.tips);
            self.tips = tips;
        }
        true
    }

    /// Starts a strand unless another one is too close.
    fn begin(&mut self, pos: Vec2, across: Vec2, length: u32, parent: Option<(u32, u32)>) {
        let strand = self.strands.len() as u32;
        let touches: Vec<u32> = match parent {
            Some((parent, _)) => {
                let siblings = (0u32..).zip(&self.strands).filter(|(_, other)| {
                    other.parent.is_some() && other.points[0] == pos && other.parent.map(|(of, _)| of) == Some(parent)
                });
                std::iter::once(parent).chain(siblings.map(|(i, _)| i)).collect()
            }
            None => (0u32..).zip(&self.strands).filter(|(_, other)| other.points[0] == pos).map(|(i, _)| i).collect(),
        };
        self.joints.push(touches.iter().map(|&other| (other, pos)).collect());
        for other in touches {
            self.joints[other as usize].push((strand, pos));
        }
        // A branch needs room to grow.
        let room = if parent.is_some() { JOINT * self.params.repulsion } else { self.meeting() };
        let is_crowded = self.nearest(strand, 0, pos).is_some_and(|(distance, _)| distance <= room);
        if is_crowded && parent.is_some() {
            self.joints.pop();
            self.joints.iter_mut().for_each(|joints| joints.retain(|(other, _)| *other != strand));
            return;
        }
        let (depth, begins) = parent.map_or((0, 0.0), |(of, at)| {
            let of = &self.strands[of as usize];
            (of.depth + 1, of.begins + at as f32 * self.params.step)
        });
        let end = if is_crowded { StrandEnd::Crowded } else { StrandEnd::Length };
        self.strands.push(Strand { points: vec![pos], parent, depth, begins, end });
        self.points += 1;
        if !is_crowded {
            self.mark(strand, 0, pos);
            let walk = Walk::new(&self.params, pos, across);
            self.tips.push(Tip { strand, walk, left: length, length, branch_cost: self.params.branch_cost, across });
        }
    }

    fn mark(&mut self, strand: u32, number: u32, pos: Vec2) {
        if let Some(near) = &mut self.near {
            near.add(Mark { pos, strand, number });
        }
    }

    /// Moves a tip by one step; returns whether it grows on.
    fn advance(&mut self, tip: &mut Tip) -> bool {
        let index = tip.strand as usize;
        // Another tip has met it head on.
        if self.strands[index].end != StrandEnd::Length || tip.left == 0 || self.points >= self.most {
            return false;
        }
        let depth = self.strands[index].depth as usize;
        let (pos, number) = (tip.walk.pos(), self.strands[index].points.len() as u32 - 1);
        let mut v = self.fields[depth].at(pos);
        if v == Vec2::ZERO && number == 0 {
            v = tip.across;
        }
        if v == Vec2::ZERO {
            self.strands[index].end = StrandEnd::Field;
            return false;
        }
        match self.contact(tip.strand, number, pos, self.heading(index, v), v) {
            Contact::None => {}
            Contact::Turned(turned) => v = turned,
            Contact::Meets(mark) => {
                self.meet(tip.strand, mark);
                return false;
            }
        }
        tip.walk.advance(v);
        let next = tip.walk.pos();
        let inside = next.clamp(Vec2::ZERO, self.extent);
        if inside != next {
            let end = self.on_border(pos, next);
            if end != pos {
                self.push(tip.strand, end);
            }
            self.strands[index].end = StrandEnd::Border;
            return false;
        }
        self.push(tip.strand, next);
        tip.left -= 1;
        self.branch(tip, number + 1, next);
        true
    }

    fn push(&mut self, strand: u32, pos: Vec2) {
        let number = self.strands[strand as usize].points.len() as u32;
        self.strands[strand as usize].points.push(pos);
        self.points += 1;
        self.mark(strand, number, pos);
    }

    /// Where the way from `from` to `to` leaves the surface.
    fn on_border(&self, from: Vec2, to: Vec2) -> Vec2 {
        let mut share = 1.0f32;
        for axis in 0..2 {
            let (a, b, side) = (from[axis], to[axis], self.extent[axis]);
            let wall = if b < 0.0 { 0.0 } else { side };
            if b < 0.0 || b > side {
                share = share.min((wall - a) / (b - a));
            }
        }
        let mut pos = (from + (to - from) * share).clamp(Vec2::ZERO, self.extent);
        for axis in 0..2 {
            let wall = if to[axis] < 0.0 { 0.0 } else { self.extent[axis] };
            // Exactly on the border, whatever the rounding.
            if (to[axis] < 0.0 || to[axis] > self.extent[axis]) && (pos[axis] - wall).abs() < 1.0e-4 * self.params.step
            {
                pos[axis] = wall;
            }
        }
        pos
    }

    /// The direction in which a strand has run lately.
    fn heading(&self, index: usize, v: Vec2) -> Vec2 {
        let points = &self.strands[index].points;
        let last = points.len() - 1;
        (points[last] - points[last.saturating_sub(8)]).normalize_or(v)
    }

    /// The nearest point of another strand within twice the repulsion distance of a tip, joints aside.
    fn nearest(&self, strand: u32, number: u32, pos: Vec2) -> Option<(f32, Mark)> {
        let (near, repulsion, step) = (self.near.as_ref()?, self.params.repulsion, self.params.step);
        let joint = JOINT * repulsion + 2.0 * step;
        let own = (4.0 * repulsion / step) as u32 + 8;
        let mut best: Option<(f32, Mark)> = None;
        near.within(pos, 2.0 * repulsion, |mark, distance_sq| {
            let is_own = mark.strand == strand;
            if is_own && number.abs_diff(mark.number) <= own {
                return;
            }
            let is_nearer =
                best.is_none_or(|(least, at)| (distance_sq, mark.strand, mark.number) < (least, at.strand, at.number));
            if !is_nearer {
                return;
            }
            // A strand that was taken back has left its marks.
            let is_there = (mark.number as usize) < self.strands[mark.strand as usize].points.len();
            let is_free = is_there
                && (is_own
                    || !self.joints[strand as usize].iter().any(|(other, at)| {
                        *other == mark.strand && at.distance(pos) <= joint && at.distance(mark.pos) <= joint
                    }));
            if is_free {
                best = Some((distance_sq, mark));
            }
        });
        best.map(|(distance_sq, mark)| (distance_sq.sqrt(), mark))
    }

    /// Distance at which strands meet.
    fn meeting(&self) -> f32 {
        // The smooth curve of a path of four directions cuts corners.
        let slack = if self.params.propagation == Propagation::Costs { 4.0 } else { 2.0 };
        1.05 * self.params.repulsion + slack * self.params.step
    }

    /// Whether a third strand is close to where a strand would join another one.
    fn is_busy(&self, strand: u32, mark: Mark) -> bool {
        let Some(near) = &self.near else { return false };
        let mut is_busy = false;
        near.within(mark.pos, self.params.repulsion, |third, _| {
            let is_there = (third.number as usize) < self.strands[third.strand as usize].points.len();
            is_busy |= is_there && third.strand != mark.strand && third.strand != strand;
        });
        is_busy
    }

    /// What a tip has to heed: strands closer than the repulsion distance are met, others repel it.
    fn contact(&self, strand: u32, number: u32, pos: Vec2, heading: Vec2, v: Vec2) -> Contact {
        let Some((distance, mark)) = self.nearest(strand, number, pos) else { return Contact::None };
        if distance <= self.meeting() {
            return Contact::Meets(mark);
        }
        let away = (pos - mark.pos) / distance;
        if -heading.dot(away) >= STEEP {
            return Contact::None;
        }
        let push = (2.0 * self.params.repulsion - distance) / self.params.repulsion;
        let aside = (v - away * v.dot(away).min(0.0) + away * push).normalize_or(v);
        // Rather than turn back it goes to the other one.
        if aside.dot(heading) < 0.0 { Contact::Meets(mark) } else { Contact::Turned(aside) }
    }

    /// Ends a strand that has come close to another one.
    fn meet(&mut self, strand: u32, mark: Mark) {
        if self.take_back(strand, mark) {
            return;
        }
        if self.is_busy(strand, mark) {
            self.strands[strand as usize].end = StrandEnd::Stopped;
        } else {
            self.join(strand, mark);
        }
    }

    /// Removes a branch that would come back at once to where it started, or to itself; returns whether it did.
    fn take_back(&mut self, strand: u32, mark: Mark) -> bool {
        let index = strand as usize;
        let Strand { points, parent: Some((parent, _)), .. } = &self.strands[index] else { return false };
        let is_short = points.len() as f32 * self.params.step < SHORT * self.params.repulsion;
        let is_back = mark.strand == strand || points[0].distance(mark.pos) < SHORT * self.params.repulsion;
        // Others may have joined it: all that it touches must be where it starts.
        let is_alone = self.joints[index].iter().all(|(_, at)| *at == points[0]);
        let is_own = mark.strand == *parent
            || mark.strand == strand
            || self.strands[mark.strand as usize].points[0] == points[0];
        let is_taken = is_short && is_back && is_own && is_alone;
        if is_taken {
            let strand = &mut self.strands[index];
            self.points -= strand.points.len() - 1;
            strand.points.truncate(1);
            strand.end = StrandEnd::Crowded;
        }
        is_taken
    }

    /// Ends a strand at a point of another one, in a straight line.
    fn join(&mut self, strand: u32, mark: Mark) {
        let index = strand as usize;
        let (from, heading) =
            (self.strands[index].points[self.strands[index].points.len() - 1], self.heading(index, Vec2::ZERO));
        let pieces = (from.distance(mark.pos) / self.params.step).ceil().max(1.0) as u32;
        for piece in 1..pieces {
            self.push(strand, from.lerp(mark.pos, piece as f32 / pieces as f32));
        }
        self.push(strand, mark.pos);
        self.strands[index].end = StrandEnd::Joined { strand: mark.strand, point: mark.number };
        if mark.strand == strand {
            return;
        }
        self.joints[index].push((mark.strand, mark.pos));
        self.joints[mark.strand as usize].push((strand, mark.pos));
        // Two tips that run towards each other become one crack.
        let other = mark.strand as usize;
        let is_tip = mark.number as usize + 1 >= self.strands[other].points.len();
        let point = self.strands[index].points.len() as u32 - 1;
        if is_tip && self.strands[other].end == StrandEnd::Length && heading.dot(self.heading(other, -heading)) < 0.0 {
            self.strands[other].end = StrandEnd::Joined { strand, point };
        }
    }

    /// Lets the branch cost run down, and starts children at a joint when it is used up.
    fn branch(&mut self, tip: &mut Tip, number: u32, pos: Vec2) {
        let params = &self.params;
        if self.strands[tip.strand as usize].depth >= params.depth || params.child_length == 0.0 {
            return;
        }
        let rate = 1.0 + params.branch_noise * self.branching.at(pos, BRANCH_FREQUENCY);
        tip.branch_cost -= rate * params.step;
        if tip.branch_cost > 0.0 || !number.is_multiple_of(params.tile_steps()) || tip.left == 0 {
            return;
        }
        tip.branch_cost = params.branch_cost;
        let across = self.heading(tip.strand as usize, Vec2::ZERO).perp();
        let length = (tip.length as f32 * params.child_length).round() as u32;
        let both = params.children == 2;
        let first = hash_unit(self.seed ^ SIDE, u64::from(tip.strand) << 32 | u64::from(number)) < 0.5;
        for (side, is_on) in [(across, both || first), (-across, both || !first)] {
            if is_on {
                self.begin(pos, side, length, Some((tip.strand, number)));
            }
        }
    }
}
