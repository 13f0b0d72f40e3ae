//! [`Timeline`]: when each part of a network was added, and what the network looked like at any time.

use super::{Network, SegmentId, path::SegmentPath};
use glam::Vec2;
use std::ops::Range;

/// A time of a [`Timeline`]: steps of growth, with a resolution of 1/256.
///
/// ```
/// use bevy_crack::pattern::Moment;
///
/// assert_eq!(Moment::after(3).steps(), 3.0);
/// assert_eq!(Moment::nearest(2.251), Moment::nearest(2.25));
/// assert_eq!(Moment::nearest(f64::NAN), Moment::START);
/// // In the middle of the third step.
/// assert_eq!((Moment::nearest(2.5).whole(), Moment::nearest(2.5).begun()), (2, 3));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Moment(u32);

impl Moment {
    /// Before the first step: there are no cracks.
    pub const START: Self = Self(0);

    /// Moments per step.
    const PARTS: u32 = 256;

    /// The end of step number `steps`; the first step is 1.
    #[must_use]
    pub const fn after(steps: u32) -> Self {
        Self(steps.saturating_mul(Self::PARTS))
    }

    /// The moment nearest to a number of steps. Values below zero and NaN give the start.
    #[must_use]
    pub fn nearest(steps: f64) -> Self {
        Self((steps * f64::from(Self::PARTS) + 0.5) as u32)
    }

    /// Number of steps, with the fraction.
    #[must_use]
    pub fn steps(self) -> f64 {
        f64::from(self.0) / f64::from(Self::PARTS)
    }

    /// Number of steps that have ended.
    #[must_use]
    pub const fn whole(self) -> u32 {
        self.0 / Self::PARTS
    }

    /// Number of steps that have begun.
    #[must_use]
    pub const fn begun(self) -> u32 {
        self.0.div_ceil(Self::PARTS)
    }

    /// How much of the changes of a step is visible, 0..=1.
    fn share(self, step: u32) -> f32 {
        let start = u64::from(step.saturating_sub(1)) * u64::from(Self::PARTS);
        let passed = u64::from(self.0).saturating_sub(start).min(u64::from(Self::PARTS));
        passed as f32 / Self::PARTS as f32
    }
}

/// A disc that represents a marker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dot {
    /// Position, pattern units.
    pub pos: Vec2,
    /// Radius, pattern units.
    pub radius: f32,
}

/// Records in which step each part of a network was added, and when it reached which width.
///
/// A change in step `s` grows from nothing at moment `s - 1` to its full size at moment `s`: a segment by its length,
/// a width from its old to its new value, a dot by its radius. The nodes that a hit creates belong to the step after
/// it. So at [`Moment::START`] there is nothing, and at the [`end`](Self::end) the network is in its current state.
/// Cracks that were [added](crate::growth::CrackGrowth::add_cracks) can continue to open for some steps, evenly along
/// their whole length.
///
/// Entries are only ever appended, in order of their steps.
///
/// ```
/// use bevy_crack::{growth::{CrackGrowth, GrowthParams}, pattern::{Moment, SegmentId}};
///
/// let mut growth = CrackGrowth::new(GrowthParams::default(), [1.0, 1.0].into(), 7)?;
/// growth.hit([0.5, 0.5].into(), 1.0);
/// while growth.step().grew() {}
/// let (network, timeline) = (growth.network(), growth.timeline());
/// let segment = SegmentId::Branch(1);
/// assert_eq!(timeline.path_at(network, segment, Moment::START), None);
/// let (young, old) = (Moment::after(1), Moment::after(timeline.end()));
/// let width = |moment| timeline.path_at(network, segment, moment).map(|path| path.points()[0].width);
/// assert!(width(young) < width(old));
/// assert_eq!(timeline.path_at(network, segment, old), network.path(segment));
/// assert_eq!(timeline.width_at(1, old), Some(network.nodes()[1].width));
/// // The nodes of the second step follow those of the first.
/// assert_eq!(timeline.born(0, 1).end, timeline.born(1, 2).start);
/// assert_eq!(timeline.born(0, timeline.end()).len(), network.nodes().len());
/// # Ok::<(), bevy_crack::growth::ParamError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timeline {
    /// The step of the next entries.
    now: u32,
    nodes: Vec<Birth>,
    links: Vec<LinkBirth>,
    widenings: Vec<Widening>,
    dots: Vec<(u32, Dot)>,
    strikes: Vec<Strike>,
    /// The longest opening, and the step after which everything is fully open.
    longest: u32,
    open: u32,
}

/// The bricks around a place in masonry: two opposite corners of each, pattern units; equal corners = no brick.
pub(crate) type Bricks = [[Vec2; 2]; 4];

/// A place that is not in masonry.
pub(crate) const NO_BRICKS: Bricks = [[Vec2::ZERO; 2]; 4];

/// A hit that started an impact or added energy to one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Strike {
    step: u32,
    /// The impact, its position in pattern units, and its energy before and after.
    pub(crate) impact: u32,
    pub(crate) pos: Vec2,
    pub(crate) before: f32,
    pub(crate) energy: f32,
    pub(crate) bricks: Bricks,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Birth {
    step: u32,
    width: f32,
    /// Steps after its own step in which it opens to that width.
    opening: u32,
    /// Its latest widening, or [`NONE`].
    latest: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct LinkBirth {
    step: u32,
    /// As for a node.
    opening: u32,
    /// Number of nodes that were added before it.
    after: u32,
}

/// The width at `moment` of a part that is added in `step` and opens to `width` over `opening` further steps. The
/// width increases evenly from zero at the start of `step`; during `step` itself it is the width at the end of that
/// step.
fn opened(width: f32, step: u32, opening: u32, moment: Moment) -> f32 {
    let start = u64::from(step.saturating_sub(1)) * u64::from(Moment::PARTS);
    let all = (u64::from(opening) + 1) * u64::from(Moment::PARTS);
    let passed = u64::from(moment.0).saturating_sub(start).max(u64::from(Moment::PARTS));
    if passed < all { width * (passed as f64 / all as f64) as f32 } else { width }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Widening {
    step: u32,
    node: u32,
    width: f32,
    /// The previous widening of the same node, or [`NONE`].
    before: u32,
}

const NONE: u32 = u32::MAX;

/// Numbers of entries of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Entries {
    pub(crate) nodes: usize,
    pub(crate) links: usize,
    pub(crate) widenings: usize,
    pub(crate) dots: usize,
    pub(crate) strikes: usize,
}

impl Timeline {
    /// Sets the step of the next entries, at least 1 and never lower than before.
    pub(crate) fn begin(&mut self, step: u32) {
        self.now = self.now.max(step);
    }

    /// The step of the next entries.
    pub(crate) const fn now(&self) -> u32 {
        self.now
    }

    pub(crate) fn reserve(&mut self, nodes: usize) {
        self.nodes.reserve(nodes);
        self.widenings.reserve(2 * nodes);
    }

    /// Adds the next node, with this width.
    pub(crate) fn add_node(&mut self, width: f32) {
        self.add_opening_node(width, 0);
    }

    /// Adds the next node, which opens to this width over `opening` further steps.
    pub(crate) fn add_opening_node(&mut self, width: f32, opening: u32) {
        self.nodes.push(Birth { step: self.now, width, opening, latest: NONE });
        self.opens(opening);
    }

    /// Adds the next link.
    pub(crate) fn add_link(&mut self) {
        self.add_opening_link(0);
    }

    /// Adds the next link, which opens to its width over `opening` further steps.
    pub(crate) fn add_opening_link(&mut self, opening: u32) {
        self.links.push(LinkBirth { step: self.now, opening, after: self.nodes.len() as u32 });
        self.opens(opening);
    }

    fn opens(&mut self, opening: u32) {
        self.longest = self.longest.max(opening);
        self.open = self.open.max(self.now.saturating_add(opening));
    }

    /// Records that a node becomes wider.
    pub(crate) fn widen(&mut self, node: u32, width: f32) {
        let next = self.widenings.len() as u32;
        if let Some(birth) = self.nodes.get_mut(node as usize) {
            let before = std::mem::replace(&mut birth.latest, next);
            self.widenings.push(Widening { step: self.now, node, width, before });
        }
    }

    pub(crate) fn add_dot(&mut self, dot: Dot) {
        self.dots.push((self.now, dot));
    }

    /// Records an impact at `pos` that is new, or has more energy than `before`.
    pub(crate) fn strike(&mut self, impact: u32, (pos, bricks): (Vec2, Bricks), before: f32, energy: f32) {
        self.strikes.push(Strike { step: self.now, impact, pos, before, energy, bricks });
    }

    /// All hits, in order; [`entries`](Self::entries) gives the number of those up to a step.
    pub(crate) fn strikes(&self) -> &[Strike] {
        &self.strikes
    }

    /// Removes the first nodes, and all links except those with the numbers `left`.
    pub(crate) fn forget(&mut self, first: u32, left: &[u32]) {
        self.nodes.drain(..first as usize);
        self.links = left.iter().filter_map(|&link| self.links.get(link as usize).copied()).collect();
        self.links.iter_mut().for_each(|link| link.after = link.after.saturating_sub(first));
        self.nodes.iter_mut().for_each(|birth| birth.latest = NONE);
        let since = self.nodes.first().map_or(u32::MAX, |birth| birth.step);
        self.dots.retain(|dot| dot.0 >= since);
        let before = std::mem::take(&mut self.widenings);
        for widening in before {
            if let Some(node) = widening.node.checked_sub(first)
                && let Some(birth) = self.nodes.get_mut(node as usize)
            {
                let before = std::mem::replace(&mut birth.latest, self.widenings.len() as u32);
                self.widenings.push(Widening { node, before, ..widening });
            }
        }
    }

    /// The step after which nothing changes any more; 0 if there is nothing.
    #[must_use]
    pub fn end(&self) -> u32 {
        let last = [
            self.nodes.last().map(|birth| birth.step),
            self.links.last().map(|birth| birth.step),
            self.widenings.last().map(|widening| widening.step),
            self.dots.last().map(|dot| dot.0),
            self.strikes.last().map(|strike| strike.step),
        ];
        let is_empty = self.nodes.is_empty() && self.links.is_empty();
        last.into_iter().flatten().max().unwrap_or(0).max(if is_empty { 0 } else { self.open })
    }

    /// The line of a segment at `moment`; `None` if it does not exist (yet).
    ///
    /// `network` must be the one whose growth wrote the timeline.
    #[must_use]
    pub fn path_at(&self, network: &Network, segment: SegmentId, moment: Moment) -> Option<SegmentPath> {
        let share = moment.share(self.step_of(segment)?);
        if share <= 0.0 {
            return None;
        }
        let (a, b) = network.ends(segment)?;
        let widths = match segment {
            SegmentId::Branch(_) => (self.width_at(a, moment)?, self.width_at(b, moment)?),
            SegmentId::Link(i) => {
                let LinkBirth { step, opening, .. } = *self.links.get(i as usize)?;
                let width = opened(network.links().get(i as usize)?.width, step, opening, moment);
                (width, width)
            }
        };
        let path = network.path_with(segment, widths)?;
        Some(if share < 1.0 { path.up_to(share) } else { path })
    }

    /// Width of a node at `moment`, pattern units; before the node is added, its initial width. `None` if there is no
    /// such node.
    #[must_use]
    pub fn width_at(&self, node: u32, moment: Moment) -> Option<f32> {
        let birth = self.nodes.get(node as usize)?;
        let goal = self.version(birth.latest, moment.begun());
        let base = self.version(goal, moment.whole());
        let width = |version: u32| match self.widenings.get(version as usize) {
            Some(widening) => widening.width,
            None => opened(birth.width, birth.step, birth.opening, moment),
        };
        let (from, to) = (width(base), width(goal));
        Some(if goal == base { to } else { from + (to - from) * moment.share(moment.begun()) })
    }

    /// The latest widening up to `step`, searched backwards from `from`.
    fn version(&self, from: u32, step: u32) -> u32 {
        let mut version = from;
        while let Some(widening) = self.widenings.get(version as usize).filter(|widening| widening.step > step) {
            version = widening.before;
        }
        version
    }

    /// Disc number `index` at `moment`; `None` if it does not exist (yet).
    ///
    /// ```
    /// use bevy_crack::{growth::{CrackGrowth, GrowthParams}, pattern::{Dot, Moment}};
    ///
    /// let params = GrowthParams { draw_markers: true, ..GrowthParams::DEFAULT };
    /// let mut growth = CrackGrowth::new(params, [1.0, 1.0].into(), 7)?;
    /// growth.hit([0.5, 0.5].into(), 1.0);
    /// while growth.step().grew() {}
    /// let timeline = growth.timeline();
    /// let Dot { pos, radius } = timeline.dot_at(0, Moment::after(timeline.end())).expect("a marker");
    /// assert!(pos.distance([0.5, 0.5].into()) < 1.0 && radius > 0.0);
    /// // At first there is none.
    /// assert_eq!(timeline.dot_at(0, Moment::START), None);
    /// # Ok::<(), bevy_crack::growth::ParamError>(())
    /// ```
    #[must_use]
    pub fn dot_at(&self, index: u32, moment: Moment) -> Option<Dot> {
        let &(step, dot) = self.dots.get(index as usize)?;
        let share = moment.share(step);
        (share > 0.0).then_some(Dot { radius: dot.radius * share, ..dot })
    }

    /// The nodes that were added in the steps after `from` up to `to`.
    #[must_use]
    pub fn born(&self, from: u32, to: u32) -> Range<u32> {
        let up_to = |step: u32| self.nodes.partition_point(|birth| birth.step <= step) as u32;
        up_to(from)..up_to(to.max(from))
    }

    /// The step in which a segment was added.
    pub(crate) fn step_of(&self, segment: SegmentId) -> Option<u32> {
        match segment {
            SegmentId::Branch(node) => self.nodes.get(node as usize).map(|birth| birth.step),
            SegmentId::Link(link) => self.links.get(link as usize).map(|birth| birth.step),
        }
    }

    /// Number of nodes that were added before a link.
    pub(crate) fn nodes_before(&self, link: u32) -> Option<u32> {
        self.links.get(link as usize).map(|link| link.after)
    }

    /// The nodes and the links that were added by the end of step `step` and are still opening after it.
    pub(crate) fn opening(&self, step: u32) -> (impl Iterator<Item = usize>, impl Iterator<Item = usize>) {
        // Earlier ones have opened for the longest possible time.
        let over = step.saturating_sub(self.longest);
        let (first, last) = (self.entries(over), self.entries(step));
        let is_open = move |birth: u32, opening: u32| birth.saturating_add(opening) <= step;
        (
            (first.nodes..last.nodes).filter(move |&i| !is_open(self.nodes[i].step, self.nodes[i].opening)),
            (first.links..last.links).filter(move |&i| !is_open(self.links[i].step, self.links[i].opening)),
        )
    }

    /// The node of a widening.
    pub(crate) fn widened(&self, widening: usize) -> Option<u32> {
        self.widenings.get(widening).map(|widening| widening.node)
    }

    /// Disc number `index` at its full size.
    pub(crate) fn dot(&self, index: usize) -> Option<Dot> {
        self.dots.get(index).map(|&(_, dot)| dot)
    }

    /// Number of entries of each kind up to step `step`.
    pub(crate) fn entries(&self, step: u32) -> Entries {
        Entries {
            nodes: self.nodes.partition_point(|birth| birth.step <= step),
            links: self.links.partition_point(|birth| birth.step <= step),
            widenings: self.widenings.partition_point(|widening| widening.step <= step),
            dots: self.dots.partition_point(|dot| dot.0 <= step),
            strikes: self.strikes.partition_point(|strike| strike.step <= step),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dots_grow_in_their_step() {
        let mut timeline = Timeline::default();
        timeline.begin(3);
        let dot = Dot { pos: Vec2::new(0.25, 0.5), radius: 0.5 };
        timeline.add_dot(dot);
        let radius = |steps| timeline.dot_at(0, Moment::nearest(steps)).map(|dot| dot.radius);
        assert_eq!(
            [1.5, 2.0, 2.25, 2.5, 3.0, 9.0].map(radius),
            [None, None, Some(0.125), Some(0.25), Some(0.5), Some(0.5)]
        );
        assert_eq!(timeline.dot_at(0, Moment::nearest(2.25)).map(|dot| dot.pos), Some(dot.pos));
        assert_eq!(timeline.dot_at(1, Moment::after(9)), None);
    }
}
