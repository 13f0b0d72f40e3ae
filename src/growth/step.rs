//! The growth itself, step by step.

use super::{
    GrowthParams, Impact, ParamError, StartLayout,
    arrest::{AHEAD, Advance, Arrest},
    changes::Changes,
    divide::Division,
    field::{ANY_IMPACT, MarkerField},
    layout::Layout,
    links::{self, Linker},
    masonry::Masonry,
    nodes::NodeGrid,
    pull::{NO_PULL, Pull},
    rays::Rays,
    width::Widths,
};
use crate::{
    Grid,
    math::{hash_unit, mix},
    pattern::{CrackMask, Link, LinkKind, NO_PARENT, Network, Node, SegmentId, Timeline},
};
use glam::Vec2;
use std::{ops::Range, sync::Arc};

/// What one step did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepReport {
    /// Number of nodes born.
    pub born: u32,
}

impl StepReport {
    /// Whether anything grew; if not, the growth has ended until the next hit.
    #[must_use]
    pub const fn grew(&self) -> bool {
        self.born > 0
    }
}

/// Where all markers are: the other numbers add up to `total`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Census {
    /// Markers ever made.
    pub total: u32,
    /// Reached and removed.
    pub killed: u32,
    /// Attracting a node.
    pub attracting: u32,
    /// Out of every node's reach.
    pub waiting: u32,
}

/// A growing crack pattern on one surface.
///
/// ```
/// use bevy_crack::growth::{CrackGrowth, GrowthParams};
///
/// let mut growth = CrackGrowth::new(GrowthParams::default(), [1.0, 1.0].into(), 7)?;
/// growth.hit([0.5, 0.5].into(), 1.0);
/// while growth.step().grew() {}
/// assert!(growth.network().nodes().len() > 100);
/// assert_eq!(growth.census().attracting, 0);
/// # Ok::<(), bevy_crack::growth::ParamError>(())
/// ```
#[derive(Clone, Debug)]
pub struct CrackGrowth {
    pub(super) params: GrowthParams,
    pub(super) seed: u64,
    pub(super) network: Network,
    pub(super) field: MarkerField,
    pub(super) nodes: NodeGrid,
    /// Only where cracks must not cross.
    pub(super) arrest: Option<Arrest>,
    /// Only where cracks divide domains.
    pub(super) division: Option<Division>,
    pub(super) widths: Widths,
    pub(super) linker: Linker,
    pub(super) rays: Rays,
    pub(super) impacts: Vec<Impact>,
    /// What the last hit has still to lay out.
    pub(super) layout: Option<Box<Layout>>,
    pub(super) density: Option<Grid<f32>>,
    pub(super) mask: Arc<CrackMask>,
    /// The joints in which cracks run.
    pub(super) masonry: Option<Arc<Masonry>>,
    pub(super) steps: u32,
    pub(super) steps_left: u32,
    /// Cracks that began by themselves, and markers that were tried for it.
    pub(super) nucleated: u32,
    pub(super) tried: u32,
    /// First nodes of hits whose growth has not ended.
    pub(super) unshown: Vec<u32>,
    /// Nodes that have not grown here.
    pub(super) added: usize,
    pub(super) newborn: Range<u32>,
    /// Links that are among the changes.
    pub(super) links_told: u32,
    /// Places of markers made since they were last asked for.
    pub(super) shown_markers: Vec<Vec2>,
    pub(super) changes: Changes,
    pub(super) timeline: Timeline,
    pub(super) pulls: Vec<Pull>,
    /// Where cracks are rays: what each of `pulls` must keep to.
    pub(super) ways: Vec<[Vec2; 3]>,
    /// Per node: the direction in which its crack runs, but for its kinks; zero for a start.
    pub(super) courses: Vec<Vec2>,
    /// Node and entry in `pulls`, in order of the nodes.
    pub(super) order: Vec<(u32, u32)>,
    /// Per node: its entry in `pulls` during a step.
    pub(super) pull_of: Vec<u32>,
    /// Nodes that one birth has made wider; empty in between.
    pub(super) widened: Vec<u32>,
}

impl CrackGrowth {
    /// A pattern without cracks on a surface of `extent` pattern units (see
    /// [`SurfaceFrame::extent`](crate::pattern::SurfaceFrame::extent)).
    ///
    /// # Errors
    /// If a parameter is out of its range, or `extent` (named so) is not within 0.0001..=64.
    pub fn new(params: GrowthParams, extent: Vec2, seed: u64) -> Result<Self, ParamError> {
        params.validate()?;
        for value in extent.to_array() {
            if !(1e-4..=64.0).contains(&value) {
                return Err(ParamError::OutOfRange { name: "extent", value: f64::from(value), min: 1e-4, max: 64.0 });
            }
        }
        let params = params.varied(seed);
        let network = Network::new(extent, params.roughness, seed).with_sway(params.sway);
        let mut growth = Self {
            arrest: params.keeps_apart().then(|| Arrest::new(&network, params.step_length)),
            division: Division::new(&params),
            network,
            field: MarkerField::new(extent, &params),
            nodes: NodeGrid::new(extent, 2.0 * params.step_length.max(params.kill_distance)),
            widths: Widths::new(&params),
            linker: Linker::default(),
            rays: Rays::default(),
            impacts: Vec::new(),
            layout: None,
            density: None,
            mask: Arc::default(),
            masonry: None,
            steps: 0,
            steps_left: 0,
            nucleated: 0,
            tried: 0,
            unshown: Vec::new(),
            added: 0,
            newborn: 0..0,
            links_told: 0,
            shown_markers: Vec::new(),
            changes: Changes::default(),
            timeline: Timeline::default(),
            pulls: Vec::new(),
            ways: Vec::new(),
            courses: Vec::new(),
            order: Vec::new(),
            pull_of: Vec::new(),
            widened: Vec::new(),
            params,
            seed,
        };
        growth.lay_bricks();
        Ok(growth)
    }

    /// Where markers of later hits may be: a probability 0..=1 over the whole surface, at any resolution, sampled at the
    /// nearest cell; `None` = everywhere. Values that are not finite count as 0.
    pub fn set_density(&mut self, density: Option<Grid<f32>>) {
        self.finish_layout();
        self.density = density.filter(|grid| grid.size().min_element() > 0);
    }

    /// Where cracks of later hits and steps like to run, avoid to, and never go; an empty mask = everywhere alike.
    ///
    /// Markers move to the weakest place near them, cracks steer along what is weak and around what is strong, and no line
    /// enters a forbidden texel. A hit on one is [rejected](super::Rejected::Forbidden). What is grown stays.
    pub fn set_mask(&mut self, mask: impl Into<Arc<CrackMask>>) {
        self.finish_layout();
        self.mask = mask.into();
        self.mind_others();
        self.lay_bricks();
    }

    /// Finds the joints in which cracks run.
    fn lay_bricks(&mut self) {
        let (extent, courses) = (self.network.extent(), self.params.courses);
        let is_masonry = courses > 0.0 && self.params.arrest > 0.0;
        self.masonry = match &self.mask.weak {
            _ if !is_masonry => None,
            Some(weak) => Masonry::find(weak, extent),
            None => Some(Masonry::regular(extent, courses, self.seed)),
        }
        .map(Arc::new);
        self.widths.set_widest(self.masonry.as_ref().map_or(f32::INFINITY, |masonry| masonry.joint()));
    }

    /// Keeps account of lines if cracks must not cross, or if there are places that they must not enter.
    fn mind_others(&mut self) {
        let must = self.params.keeps_apart() || self.mask.forbidden.is_some();
        if must != self.arrest.is_some() {
            self.arrest = must.then(|| Arrest::new(&self.network, self.params.step_length));
        }
    }

    /// How many more nodes may grow.
    pub(super) fn room(&self) -> usize {
        (self.params.max_nodes as usize + self.added).saturating_sub(self.network.nodes.len())
    }

    /// Where cracks may run.
    #[cfg(feature = "bevy")]
    pub(crate) const fn mask(&self) -> &Arc<CrackMask> {
        &self.mask
    }

    /// Adds a node; the caller lets it visit the markers.
    pub(super) fn bear(&mut self, pos: Vec2, parent: u32, generation: u32, impact: u32, bend: f32) {
        let first = self.network.nodes.len() as u32;
        self.bear_thin(pos, parent, generation, impact, bend);
        self.widen_with(|widths, nodes, widened| widths.push(nodes, first, widened));
    }

    /// Adds a node of which the others do not know yet.
    fn bear_thin(&mut self, pos: Vec2, parent: u32, generation: u32, impact: u32, bend: f32) {
        let node = self.network.nodes.len() as u64;
        let wider = self.impacts.get(impact as usize).map_or(1.0, |impact| impact.widening);
        let (mixed, draw) = (self.params.mixed, hash_unit(self.seed ^ 0xA5, node));
        let share = |division: &mut Division| division.bear(node as u32, parent, 1.0 - mixed * draw);
        let wider = self.division.as_mut().map_or(1.0, share) * wider * self.thinned(pos, impact);
        let width = self.widths.tip(parent, || hash_unit(self.seed ^ 0x1D, node), wider);
        if let Some(arrest) = &mut self.arrest {
            arrest.push_node(false);
        }
        self.network.nodes.push(Node { pos, width, parent, generation, birth: self.steps, impact, bend });
        self.nodes.push(pos);
        let from = self.network.nodes.get(parent as usize).map_or(pos, |parent| parent.pos);
        self.courses.push((pos - from).normalize_or_zero());
        self.pull_of.push(NO_PULL);
        self.changes.push_node(parent);
        self.timeline.add_node(width);
        self.inherit_ray(node as u32, parent);
    }

    /// A tip that has met a crack is as wide there as further back.
    pub(super) fn widen_end(&mut self, tip: u32) {
        if self.params.tip_taper > 0.0 {
            self.widen_with(|widths, nodes, widened| widths.join(nodes, tip, widened));
        }
    }

    /// A tip that has met a crack at the rim of what its hit has loaded narrows, but not to nothing.
    pub(super) fn thin_end(&mut self, tip: u32) {
        if self.params.tip_taper > 0.0 {
            self.widen_with(|widths, nodes, widened| widths.join_thinly(nodes, tip, widened));
        }
    }

    /// Lets `act` widen nodes, and notes which became wider.
    fn widen_with(&mut self, act: impl FnOnce(&mut Widths, &mut [Node], &mut dyn FnMut(u32))) {
        let mut widened = std::mem::take(&mut self.widened);
        act(&mut self.widths, &mut self.network.nodes, &mut |node| widened.push(node));
        for node in widened.drain(..) {
            let wider = self.network.nodes[node as usize];
            self.changes.widened(node, wider.parent != NO_PARENT);
            self.timeline.widen(node, wider.width);
        }
        self.widened = widened;
    }

    /// One step of growth (Couto et al., eq. 2): every node that attracts markers grows one node at
    /// `c' = c + D n̂`, `n = Σ (m - c) / ‖m - c‖`, then markers within the kill distance of a node die.
    ///
    /// Differs from the paper where the paper would never end: a node at `c + D n̂` that neither reaches a marker nor brings
    /// one closer (by `D²/4` of squared distance) is not born; the node that is born instead lies straight towards
    /// the closest marker, on it if that is nearer than `D`. So every birth serves a marker, and growth ends within
    /// [`GrowthParams::most_nodes`]. A node beyond the border, or closer to it than the kill distance on its way, lies on it.
    pub fn step(&mut self) -> StepReport {
        self.finish_layout();
        self.newborn = 0..0;
        // A tip that has just set out to meet a crack may be all that moves, and has no node to show for it yet.
        while self.steps_left > 0 && self.newborn.is_empty() {
            self.make_step();
        }
        if self.steps_left == 0 && self.arrest.is_some() {
            self.show_hits();
        }
        StepReport { born: self.newborn.len() as u32 }
    }

    fn make_step(&mut self) {
        self.steps_left -= 1;
        self.field.settle(&self.network.nodes, &self.nodes);
        if self.divides() {
            self.divide();
            return;
        }
        self.gather_pulls();
        self.aim();
        let first = self.network.nodes.len() as u32;
        let room = self.room();
        // What comes when growth has ended takes a step of the timeline all the same.
        self.timeline.begin(self.steps.saturating_add(1));
        if !self.pulls.is_empty() || self.is_running() {
            self.steps = self.steps.saturating_add(1);
        }
        let mut any_stopped = false;
        if self.arrest.is_some() {
            any_stopped = self.advance_all();
        } else {
            for i in 0..self.order.len() {
                let (node, slot) = self.order[i];
                self.pull_of[node as usize] = NO_PULL;
                if i < room {
                    let (parent, child) = (self.network.nodes[node as usize], self.pulls[slot as usize].child);
                    self.bear_thin(child, node, parent.generation.saturating_add(1), parent.impact, 1.0);
                }
            }
            self.widen_with(|widths, nodes, widened| widths.push(nodes, first, widened));
        }
        self.pulls.clear();
        if self.params.nucleation > 0.0 {
            self.nucleate();
        }
        self.advance_rays(first);
        let last = self.network.nodes.len() as u32;
        self.newborn = first..last;
        for node in first..last {
            self.field.visit(node, &self.network.nodes, &self.nodes);
        }
        self.join_newborn();
        if first == last && !any_stopped && !self.is_running() {
            self.steps_left = 0;
        }
        if self.steps_left == 0 {
            self.widen_with(|widths, nodes, widened| widths.settle(nodes, widened));
        }
    }

    /// Whether a tip is on its way to a goal.
    fn is_running(&self) -> bool {
        self.rays.is_running() || self.arrest.as_ref().is_some_and(Arrest::is_running)
    }

    /// Grows from every node that is pulled, unless older cracks are in the way; then from those that are on their way to one.
    /// Says whether a marker was given up: the others may pull elsewhere then.
    fn advance_all(&mut self) -> bool {
        let mut any_stopped = false;
        for i in 0..self.order.len() {
            let (node, slot) = self.order[i];
            let is_sealed = self.arrest.as_ref().is_some_and(|arrest| arrest.is_sealed(node));
            let stopped = if is_sealed {
                Some(Vec2::ZERO)
            } else if !self.pulls[slot as usize].serves {
                let closest = self.field.marker(self.pulls[slot as usize].closest).pos;
                Some((closest - self.network.nodes[node as usize].pos).normalize_or_zero())
            } else {
                let born = self.network.nodes.len();
                let Pull { child, course, side, .. } = self.pulls[slot as usize];
                let advanced = self.advance(node, child);
                if (self.params.grain > 0.0 || self.params.zigzag > 0.0 || self.masonry.is_some())
                    && self.network.nodes.get(born).is_some_and(|born| born.pos == child)
                {
                    self.courses[born] = course;
                }
                match advanced {
                    Advance::Grown => {
                        if let Some(side) = side {
                            let from = self.network.nodes[node as usize].pos;
                            let branch = self.extend(node, side, false);
                            // Round the bricks it goes on as before, aside.
                            if let Some(branch) = branch.filter(|_| self.masonry.is_some()) {
                                let way = (side - from).normalize_or_zero();
                                self.courses[branch as usize] = (way + course).normalize_or(way);
                            }
                        }
                        None
                    }
                    Advance::Stopped(direction) => Some(direction),
                }
            };
            self.pulls[slot as usize].stopped = stopped;
            any_stopped |= stopped.is_some();
        }
        if any_stopped {
            let Self { field, network, pulls, pull_of, .. } = self;
            let mut given_up = Vec::new();
            field.each_pull(&network.nodes, |index, node, _| {
                let pull = &pulls[pull_of[node as usize] as usize];
                if let Some(direction) = pull.stopped {
                    let way = field.marker(index).pos - network.nodes[node as usize].pos;
                    if index == pull.closest || way.dot(direction) >= 0.0 {
                        given_up.push((index, node));
                    }
                }
            });
            for (index, node) in given_up {
                field.give_up(index, node);
            }
            field.sweep();
        }
        for &(node, _) in &self.order {
            self.pull_of[node as usize] = NO_PULL;
        }
        self.advance_runners();
        any_stopped
    }

    /// Begins new cracks where markers are out of reach of all others.
    fn nucleate(&mut self) {
        let due = self.params.nucleation * self.steps.saturating_add(1) as f32;
        // What springs from a blow breaks ahead of its cracks, what dries breaks anywhere.
        let center = self.impacts.last().map_or(Vec2::ZERO, |impact| impact.pos);
        let is_blow = matches!(self.params.starts, StartLayout::Crushed { .. });
        for _ in 0..self.room() {
            if self.nucleated as f32 >= due {
                break;
            }
            let draws = [0, 1, 2, 3, 4, 5].map(|i| mix(self.seed ^ 0x0C ^ u64::from(self.tried) << 8 ^ i << 48));
            let draws = if is_blow { &draws[..] } else { &draws[..1] };
            let Some((place, loyal)) = self.field.take_waiting(draws, center) else { break };
            self.tried += 1;
            let impact = if loyal == ANY_IMPACT { self.impacts.len().saturating_sub(1) as u32 } else { loyal };
            let is_free = !self.nodes.any_within(place, 2.0 * self.params.step_length)
                && !self.mask.is_forbidden(place / self.network.extent());
            if is_free {
                self.nucleated += 1;
                self.bear(place, NO_PARENT, 0, impact, 1.0);
            }
        }
    }

    /// The last child of a node, or [`NO_PARENT`].
    pub(super) fn child_of(&self, node: u32) -> u32 {
        self.changes.kin[node as usize].child
    }

    pub(super) fn join_newborn(&mut self) {
        let newborn = self.newborn.clone();
        let met = self.field.relations.as_mut().map(|relations| std::mem::take(&mut relations.met));
        for (a, b) in met.into_iter().flatten() {
            let nodes = &self.network.nodes;
            if a != b && nodes[a as usize].parent != b && nodes[b as usize].parent != a && !self.stays_open(b) {
                let width = nodes[a as usize].width.min(nodes[b as usize].width);
                if self.link(Link { a, b, width, birth: self.steps, kind: LinkKind::Meeting, bend: 1.0 }) {
                    self.widen_end(b);
                }
            }
        }
        if self.params.draw_connections && !self.has_rays() {
            self.linker.rings(&self.params, &self.network, &self.impacts, newborn.clone(), self.seed);
            for link in self.linker.take_links() {
                self.link(link);
            }
        }
        if self.params.draw_islands {
            for tip in self.linker.tips_at_rest(&self.network, newborn) {
                if self.stays_open(tip) {
                    continue;
                }
                if self.arrest.is_some() {
                    let node = self.network.nodes[tip as usize];
                    if let Some(parent) = self.network.nodes.get(node.parent as usize) {
                        let heading = (node.pos - parent.pos).normalize_or_zero();
                        self.run_on(tip, heading, self.params.island_distance, AHEAD);
                    }
                } else if let Some(link) = links::island(&self.params, &self.network, &self.nodes, tip)
                    && self.link(link)
                {
                    self.widen_end(tip);
                }
            }
        }
        let all = self.network.links.len() as u32;
        (self.links_told..all).for_each(|_| self.timeline.add_link());
        self.changes.list.extend((self.links_told..all).map(SegmentId::Link));
        self.links_told = all;
    }

    /// Whether another step may grow something.
    #[must_use]
    pub const fn is_growing(&self) -> bool {
        self.steps_left > 0
    }

    /// Nodes and segments so far.
    #[must_use]
    pub const fn network(&self) -> &Network {
        &self.network
    }

    /// When all of it came.
    #[must_use]
    pub const fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    /// The impacts so far.
    #[must_use]
    pub fn impacts(&self) -> &[Impact] {
        &self.impacts
    }

    /// Number of steps in which something grew.
    #[must_use]
    pub const fn steps(&self) -> u32 {
        self.steps
    }

    /// Indices of the nodes born in the last step or hit.
    #[must_use]
    pub fn newborn(&self) -> Range<u32> {
        self.newborn.clone()
    }

    /// Appends the segments that are new or wider since the last call, each once, and forgets them.
    pub fn take_changed(&mut self, changed: &mut Vec<SegmentId>) {
        for segment in self.changes.list.drain(..) {
            if let SegmentId::Branch(node) = segment {
                self.changes.kin[node as usize].is_listed = false;
            }
            changed.push(segment);
        }
    }

    /// Appends the places of markers made since the last call, if `draw_markers` is set.
    pub fn take_markers(&mut self, markers: &mut Vec<Vec2>) {
        markers.append(&mut self.shown_markers);
    }

    /// Where all markers are.
    #[must_use]
    pub fn census(&self) -> Census {
        let (living, attracting) = self.field.living();
        Census { total: self.field.made, killed: self.field.killed, attracting, waiting: living - attracting }
    }

    /// The parameters, as [varied](GrowthParams::varied) by the seed.
    #[must_use]
    pub const fn params(&self) -> &GrowthParams {
        &self.params
    }

    /// Takes up other parameters; what is grown stays, `roughness` and `sway` included.
    ///
    /// # Errors
    /// If a parameter is out of its range; nothing changes then.
    pub fn set_params(&mut self, params: GrowthParams) -> Result<(), ParamError> {
        params.validate()?;
        self.finish_layout();
        let params = params.varied(self.seed);
        self.field.set_params(&params);
        self.widths.set_params(&params);
        let division = Division::new(&params).map(|new| self.division.take().unwrap_or(new));
        self.division = division;
        self.params = params;
        self.mind_others();
        self.lay_bricks();
        Ok(())
    }
}
