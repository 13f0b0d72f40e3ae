//! The growth itself: hits, steps, and what they leave behind.

use super::{
    GrowthParams, MarkerLayout, ParamError, StartLayout,
    arrest::{Advance, Arrest},
    field::{ANY_IMPACT, MarkerField},
    links::{self, Linker},
    markers::{self, Region},
    nodes::NodeGrid,
    params::{MAX_MARKERS, PROGRESS},
    width::Widths,
};
use crate::{
    Grid,
    math::{hash_unit, mix},
    pattern::{CrackMask, Dot, Link, LinkKind, NO_IMPACT, NO_PARENT, Network, Node, SegmentId, Timeline},
};
use glam::Vec2;
use std::{ops::Range, sync::Arc};

/// The most energy that an impact gathers.
pub const MAX_ENERGY: f32 = 16.0;

/// One impact on a growth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Where, pattern units.
    pub pos: Vec2,
    /// Sum of the energies of all hits merged into it, at most [`MAX_ENERGY`].
    pub energy: f32,
    /// Energy of the first of them.
    pub first_energy: f32,
    /// How many times wider its cracks are, for the hits merged into it.
    pub widening: f32,
}

/// Why a hit was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Rejected {
    /// A coordinate or the energy is NaN or infinite.
    #[error("a coordinate or the energy is not finite")]
    NotFinite,
    /// The energy is negative.
    #[error("the energy is negative")]
    NegativeEnergy,
    /// It lies off the surface.
    #[error("it lies off the surface")]
    OffSurface,
    /// Cracks are forbidden there.
    #[error("cracks are forbidden there")]
    Forbidden,
    /// The surface has all the nodes it may have.
    #[error("the surface has all the nodes it may have")]
    Full,
}

/// What became of a hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HitOutcome {
    /// It became the impact with this index.
    Started(u32),
    /// It fell on the impact with this index and added its energy to it.
    Merged(u32),
    /// Its energy is zero: nothing happens.
    Nothing,
    /// It was refused.
    Rejected(Rejected),
}

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

/// The markers that attract one node: `S(c)` of Couto et al.
#[derive(Clone, Copy, Debug)]
struct Pull {
    node: u32,
    /// Sum of the unit vectors to the markers, in units of 2⁻²⁴: whole numbers, so that the order does not matter.
    sum: [i64; 2],
    closest: u32,
    closest_sq: f32,
    closest_id: u32,
    child: Vec2,
    serves: bool,
    /// Where nothing grows from the node any more: its markers on that side are given up.
    stopped: Option<Vec2>,
}

const FIXED: f32 = 16_777_216.0;
const NO_PULL: u32 = u32::MAX;

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
    pub(super) widths: Widths,
    pub(super) linker: Linker,
    pub(super) impacts: Vec<Impact>,
    density: Option<Grid<f32>>,
    pub(super) mask: Arc<CrackMask>,
    pub(super) steps: u32,
    steps_left: u32,
    /// Cracks that began by themselves, and markers that were tried for it.
    nucleated: u32,
    tried: u32,
    /// First nodes of hits whose growth has not ended.
    pub(super) unshown: Vec<u32>,
    /// Nodes that have not grown here.
    pub(super) added: usize,
    pub(super) newborn: Range<u32>,
    /// Links that are among the changes.
    pub(super) links_told: u32,
    /// Places of markers made since they were last asked for.
    shown_markers: Vec<Vec2>,
    pub(super) changes: Changes,
    pub(super) timeline: Timeline,
    pulls: Vec<Pull>,
    /// Node and entry in `pulls`, in order of the nodes.
    order: Vec<(u32, u32)>,
    /// Per node: its entry in `pulls` during a step.
    pub(super) pull_of: Vec<u32>,
}

/// Segments that are new or wider, each once.
#[derive(Clone, Debug, Default)]
pub(super) struct Changes {
    list: Vec<SegmentId>,
    /// Per node: whether its branch is on the list.
    listed: Vec<bool>,
    /// First child and next sibling of each node: a branch tapers between two widths, so it changes with either.
    child: Vec<u32>,
    sibling: Vec<u32>,
}

impl Changes {
    fn reserve(&mut self, nodes: usize) {
        self.list.reserve(nodes);
        self.listed.reserve(nodes);
        self.child.reserve(nodes);
        self.sibling.reserve(nodes);
    }

    /// Forgets nodes and links; `nodes` are those that are left, `number` says what a segment is called now.
    pub(super) fn forget(&mut self, nodes: &[Node], number: impl Fn(SegmentId) -> Option<SegmentId>) {
        let before = std::mem::take(self);
        for node in nodes {
            self.push_node(node.parent);
        }
        self.list.clear();
        self.listed.fill(false);
        for segment in before.list.into_iter().filter_map(number) {
            match segment {
                SegmentId::Branch(node) if nodes[node as usize].parent != NO_PARENT => self.list_branch(node),
                SegmentId::Branch(_) => {}
                SegmentId::Link(_) => self.list.push(segment),
            }
        }
    }

    fn push_node(&mut self, parent: u32) {
        let node = self.listed.len() as u32;
        self.listed.push(false);
        self.child.push(NO_PARENT);
        let sibling = match self.child.get_mut(parent as usize) {
            Some(child) => std::mem::replace(child, node),
            None => NO_PARENT,
        };
        self.sibling.push(sibling);
        if parent != NO_PARENT {
            self.list_branch(node);
        }
    }

    fn list_branch(&mut self, node: u32) {
        if !std::mem::replace(&mut self.listed[node as usize], true) {
            self.list.push(SegmentId::Branch(node));
        }
    }

    fn widened(&mut self, node: u32, has_parent: bool) {
        if has_parent {
            self.list_branch(node);
        }
        let mut child = self.child[node as usize];
        while child != NO_PARENT {
            self.list_branch(child);
            child = self.sibling[child as usize];
        }
    }
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
        let network = Network::new(extent, params.roughness, seed);
        Ok(Self {
            arrest: (params.arrest > 0.0).then(|| Arrest::new(&network, params.step_length)),
            network,
            field: MarkerField::new(extent, &params),
            nodes: NodeGrid::new(extent, 2.0 * params.step_length.max(params.kill_distance)),
            widths: Widths::new(&params),
            linker: Linker::default(),
            impacts: Vec::new(),
            density: None,
            mask: Arc::default(),
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
            order: Vec::new(),
            pull_of: Vec::new(),
            params,
            seed,
        })
    }

    /// Where markers of later hits may be: a probability 0..=1 over the whole surface, at any resolution, sampled at the
    /// nearest cell; `None` = everywhere. Values that are not finite count as 0.
    pub fn set_density(&mut self, density: Option<Grid<f32>>) {
        self.density = density.filter(|grid| grid.size().min_element() > 0);
    }

    /// Where cracks of later hits and steps like to run, avoid to, and never go; an empty mask = everywhere alike.
    ///
    /// Markers move to the weakest place near them, cracks steer along what is weak and around what is strong, and no line
    /// enters a forbidden texel. A hit on one is [rejected](Rejected::Forbidden). What is grown stays.
    pub fn set_mask(&mut self, mask: impl Into<Arc<CrackMask>>) {
        self.mask = mask.into();
        self.mind_others();
    }

    /// Keeps account of lines if cracks must not cross, or if there are places that they must not enter.
    fn mind_others(&mut self) {
        let must = self.params.arrest > 0.0 || self.mask.forbidden.is_some();
        if must != self.arrest.is_some() {
            self.arrest = must.then(|| Arrest::new(&self.network, self.params.step_length));
        }
    }

    /// Hits the surface at `pos` (pattern units) with `energy` (1 = an ordinary hit; 4 reaches twice as far).
    ///
    /// Lays out starts and markers; growth happens in [`step`](Self::step). A hit as good as on top of an earlier one adds
    /// its energy to that one, so hammering on one spot costs no more than one hard hit.
    pub fn hit(&mut self, pos: Vec2, energy: f32) -> HitOutcome {
        if !pos.is_finite() || !energy.is_finite() {
            return HitOutcome::Rejected(Rejected::NotFinite);
        }
        if energy < 0.0 {
            return HitOutcome::Rejected(Rejected::NegativeEnergy);
        }
        let extent = self.network.extent();
        if pos.cmplt(Vec2::ZERO).any() || pos.cmpgt(extent).any() {
            return HitOutcome::Rejected(Rejected::OffSurface);
        }
        if energy == 0.0 {
            return HitOutcome::Nothing;
        }
        if self.mask.is_forbidden(pos / extent) {
            return HitOutcome::Rejected(Rejected::Forbidden);
        }
        if self.room() == 0 {
            return HitOutcome::Rejected(Rejected::Full);
        }
        self.timeline.begin(self.steps.saturating_add(1));
        let merge = self.params.step_length.max(self.params.kill_distance).min(0.05);
        let nearest = (0u32..)
            .zip(&self.impacts)
            .map(|(i, impact)| (impact.pos.distance_squared(pos), i))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((distance_sq, index)) = nearest
            && distance_sq <= merge * merge
        {
            let impact = &mut self.impacts[index as usize];
            let before = impact.energy;
            impact.energy = (before + energy).min(MAX_ENERGY);
            let (center, after) = (impact.pos, impact.energy);
            if after > before {
                self.widen(index);
                self.populate(index, center, self.reach(before), self.reach(after));
                self.steps_left = self.params.num_iterations;
            }
            return HitOutcome::Merged(index);
        }
        let index = self.impacts.len() as u32;
        let energy = energy.min(MAX_ENERGY);
        self.impacts.push(Impact { pos, energy, first_energy: energy, widening: 1.0 });
        let reach = self.reach(energy);
        let first = self.network.nodes.len() as u32;
        let seed = mix(self.seed ^ mix(u64::from(index)));
        for place in markers::starts(self.params.starts, (pos, energy), reach, extent, seed) {
            let is_free = !self.nodes.any_within(place, 1e-4) && !self.is_on_crack(place);
            if is_free && !self.mask.is_forbidden(place / extent) {
                self.bear(place, NO_PARENT, 0, index, 1.0);
            }
        }
        if first == self.network.nodes.len() as u32 {
            self.sprout(pos, index);
        } else if matches!(self.params.starts, StartLayout::Crushed { .. }) {
            self.crush(first);
        }
        for node in first..self.network.nodes.len() as u32 {
            self.field.visit(node, &self.network.nodes, &self.nodes);
        }
        self.newborn = first..self.network.nodes.len() as u32;
        if self.arrest.is_some() {
            self.unshown.push(first);
        }
        self.join_newborn();
        self.populate(index, pos, 0.0, reach);
        self.steps_left = self.params.num_iterations;
        HitOutcome::Started(index)
    }

    /// Adds cracks that have not grown here, say those of [`Seams::network`](crate::voronoi::Seams::network). To hits and steps
    /// afterwards they are cracks of another hit: with [`arrest`](GrowthParams::arrest) new ones stop at them, and a hit on one starts from it.
    ///
    /// They come in the steps after those made so far, in order of their [`birth`](Node::birth), and each opens to its width within
    /// `opening` further steps; returns how many steps all of that takes. Lines are straight from node to node; a network of another extent is
    /// stretched over the surface. They do not count for [`max_nodes`](GrowthParams::max_nodes). Where they
    /// cross what has grown already, they cross it.
    ///
    /// ```
    /// use bevy_crack::{growth::{CrackGrowth, GrowthParams}, voronoi::{VoronoiBake, VoronoiParams}};
    ///
    /// let (_, seams) = VoronoiBake::new(VoronoiParams::DEFAULT, Vec::new(), [64, 64].into(), 7)?.finish();
    /// let mut growth = CrackGrowth::new(GrowthParams { arrest: 0.05, ..GrowthParams::DEFAULT }, [1.0, 1.0].into(), 7)?;
    /// let steps = growth.add_cracks(&seams.network([0.5, 0.5].into()), 0);
    /// assert_eq!(growth.timeline().end(), steps);
    /// growth.hit([0.5, 0.5].into(), 1.0);
    /// while growth.step().grew() {}
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn add_cracks(&mut self, cracks: &Network, opening: u32) -> u32 {
        let Some(last) = cracks.nodes.iter().map(|node| node.birth).chain(cracks.links.iter().map(|l| l.birth)).max()
        else {
            return 0;
        };
        let (extent, from) = (self.network.extent(), cracks.extent());
        // Nothing leaves the border by rounding.
        let place = |pos: Vec2| Vec2::select(pos.cmpeq(from), extent, (pos / from * extent).min(extent));
        let (before, first) = (self.steps, self.network.nodes.len() as u32);
        // Nodes and links that are there, and nodes that have opened.
        let (mut node, mut link, mut opened) = (0, 0, 0);
        for step in 0..=last.saturating_add(opening) {
            self.steps = before.saturating_add(step).saturating_add(1);
            self.timeline.begin(self.steps);
            for (i, &Node { width, birth, .. }) in cracks.nodes.iter().enumerate().take(node).skip(opened) {
                let share = (step - birth + 1) as f32 / (opening + 1) as f32;
                self.timeline.widen(first + i as u32, width * share);
                opened += usize::from(step - birth >= opening);
            }
            while let Some(&added) = cracks.nodes.get(node).filter(|added| added.birth <= step) {
                let parent = if added.parent == NO_PARENT { NO_PARENT } else { added.parent + first };
                let birth = self.steps;
                self.add(Node { pos: place(added.pos), parent, birth, impact: NO_IMPACT, bend: 0.0, ..added });
                self.timeline.add_node(added.width / (opening + 1) as f32);
                node += 1;
                opened += usize::from(opening == 0);
            }
            while let Some(&added) = cracks.links.get(link).filter(|added| added.birth <= step) {
                let (a, b, birth) = (added.a + first, added.b + first, self.steps);
                self.network.links.push(Link { a, b, birth, bend: 0.0, ..added });
                self.timeline.add_link();
                link += 1;
            }
        }
        let told = std::mem::replace(&mut self.links_told, self.network.links.len() as u32);
        self.changes.list.extend((told..self.links_told).map(SegmentId::Link));
        self.newborn = first..self.network.nodes.len() as u32;
        self.added += self.newborn.len();
        for node in self.newborn.clone() {
            self.field.visit(node, &self.network.nodes, &self.nodes);
        }
        if let Some(arrest) = &mut self.arrest {
            let branches = self.newborn.clone().map(SegmentId::Branch);
            arrest.add_walls(&self.network, branches.chain((told..self.links_told).map(SegmentId::Link)));
        }
        self.steps - before
    }

    /// Notes a node that has not grown.
    fn add(&mut self, node: Node) {
        self.widths.admit();
        if let Some(arrest) = &mut self.arrest {
            arrest.push_node(false);
        }
        self.nodes.push(node.pos);
        self.pull_of.push(NO_PULL);
        self.changes.push_node(node.parent);
        self.network.nodes.push(node);
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

    fn reach(&self, energy: f32) -> f32 {
        self.params.reach * energy.sqrt()
    }

    fn populate(&mut self, impact: u32, center: Vec2, inner: f32, outer: f32) {
        let extent = self.network.extent();
        let energy = self.impacts[impact as usize].first_energy;
        let region = Region { center, energy, inner, outer, extent };
        let seed = mix(self.seed ^ mix(u64::from(impact) | 1 << 40));
        // Darts keep their distance from each other, and from the markers of hits that no step has taken up yet.
        let mut darts = None;
        if let MarkerLayout::DartThrowing { spacing } = self.params.markers {
            self.field.settle(&self.network.nodes, &self.nodes);
            darts = Some(NodeGrid::new(extent, spacing));
        }
        let (field, nodes, shown) = (&mut self.field, &self.nodes, &mut self.shown_markers);
        let (timeline, radius) = (&mut self.timeline, self.params.line_width);
        let show = self.params.draw_markers;
        // The rays of a hit are its own: older cracks do not sprout towards them.
        let is_loyal = self.params.arrest > 0.0 || matches!(self.params.markers, MarkerLayout::Polar { .. });
        let loyal = if is_loyal { impact } else { ANY_IMPACT };
        let wishes = (self.density.as_ref(), &*self.mask);
        markers::lay_out(&self.params, region, wishes, seed, |pos, spacing| {
            if field.living_at_most() >= MAX_MARKERS {
                return;
            }
            if let (Some(spacing), Some(darts)) = (spacing, &mut darts) {
                if darts.any_within(pos, spacing) || field.any_within(pos, spacing) || nodes.any_within(pos, spacing) {
                    return;
                }
                darts.push(pos);
            }
            field.add(pos, loyal);
            if show {
                shown.push(pos);
                timeline.add_dot(Dot { pos, radius });
            }
        });
        // A large growth makes about two nodes a marker: room for them now, so that no step pauses to move them all.
        let expected = (2 * self.field.living_at_most()).min(self.params.max_nodes as usize);
        if expected > 4096 {
            self.network.nodes.reserve(expected);
            self.nodes.reserve(expected);
            self.widths.reserve(expected);
            self.pull_of.reserve(expected);
            self.changes.reserve(expected);
            self.timeline.reserve(expected);
        }
    }

    /// Adds a node; the caller lets it visit the markers.
    pub(super) fn bear(&mut self, pos: Vec2, parent: u32, generation: u32, impact: u32, bend: f32) {
        let node = self.network.nodes.len() as u64;
        let wider = self.impacts.get(impact as usize).map_or(1.0, |impact| impact.widening);
        let width = self.widths.tip(parent, hash_unit(self.seed ^ 0x1D, node), wider);
        if let Some(arrest) = &mut self.arrest {
            arrest.push_node(false);
        }
        self.network.nodes.push(Node { pos, width, parent, generation, birth: self.steps, impact, bend });
        self.nodes.push(pos);
        self.pull_of.push(NO_PULL);
        self.changes.push_node(parent);
        self.timeline.add_node(width);
        self.widen_with(|widths, nodes, widened| widths.push(nodes, widened));
    }

    /// A tip that has met a crack is as wide there as further back.
    pub(super) fn widen_end(&mut self, tip: u32) {
        if self.params.tip_taper > 0.0 {
            self.widen_with(|widths, nodes, widened| widths.join(nodes, tip, widened));
        }
    }

    /// Lets `act` widen nodes, and notes which became wider.
    fn widen_with(&mut self, act: impl FnOnce(&mut Widths, &mut [Node], &mut dyn FnMut(u32))) {
        let mut widened = [NO_PARENT; 64];
        let mut n = 0;
        act(&mut self.widths, &mut self.network.nodes, &mut |node| {
            // Each node on the way up is wider than the one before, so there are no more than notches.
            if let Some(slot) = widened.get_mut(n) {
                *slot = node;
                n += 1;
            }
        });
        for &node in &widened[..n] {
            let widened = self.network.nodes[node as usize];
            self.changes.widened(node, widened.parent != NO_PARENT);
            self.timeline.widen(node, widened.width);
        }
    }

    /// One step of growth (Couto et al., eq. 2): every node that attracts markers grows one node at
    /// `c' = c + D n̂`, `n = Σ (m - c) / ‖m - c‖`, then markers within the kill distance of a node die.
    ///
    /// Differs from the paper where the paper would never end: a node at `c + D n̂` that neither reaches a marker nor brings
    /// one closer (by `D²/4` of squared distance) is not born; the node that is born instead lies straight towards
    /// the closest marker, on it if that is nearer than `D`. So every birth serves a marker, and growth ends within
    /// [`GrowthParams::most_nodes`]. A node beyond the border, or closer to it than the kill distance on its way, lies on it.
    pub fn step(&mut self) -> StepReport {
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
        self.gather_pulls();
        self.aim();
        let first = self.network.nodes.len() as u32;
        let room = self.room();
        // What comes when growth has ended takes a step of the timeline all the same.
        self.timeline.begin(self.steps.saturating_add(1));
        if !self.pulls.is_empty() || self.arrest.as_ref().is_some_and(Arrest::is_running) {
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
                    self.bear(child, node, parent.generation.saturating_add(1), parent.impact, 1.0);
                }
            }
        }
        self.pulls.clear();
        if self.params.nucleation > 0.0 {
            self.nucleate();
        }
        let last = self.network.nodes.len() as u32;
        self.newborn = first..last;
        for node in first..last {
            self.field.visit(node, &self.network.nodes, &self.nodes);
        }
        self.join_newborn();
        if first == last && !any_stopped && !self.arrest.as_ref().is_some_and(Arrest::is_running) {
            self.steps_left = 0;
        }
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
                match self.advance(node, self.pulls[slot as usize].child) {
                    Advance::Grown => None,
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
        let due = self.params.nucleation * (self.steps + 1) as f32;
        for _ in 0..self.room() {
            if self.nucleated as f32 >= due {
                break;
            }
            let Some((place, loyal)) = self.field.take_waiting(mix(self.seed ^ 0x0C ^ u64::from(self.tried) << 8))
            else {
                break;
            };
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
        self.changes.child[node as usize]
    }

    /// A hit from which nothing could grow, so narrow is its place, leaves a short crack all the same.
    fn show_hits(&mut self) {
        while let Some(start) = self.unshown.pop() {
            let born = self.network.nodes.len();
            let Some(&node) = self.network.nodes.get(start as usize) else { continue };
            let of_hit = |other: &Node| other.impact == node.impact && other.parent != NO_PARENT;
            if self.network.nodes[start as usize..].iter().any(of_hit) {
                continue;
            }
            // It takes a step of its own.
            self.steps = self.steps.saturating_add(1);
            self.timeline.begin(self.steps);
            let length = self.params.step_length;
            for way in [Vec2::X, Vec2::NEG_X, Vec2::Y, Vec2::NEG_Y] {
                let to = (node.pos + way * length).clamp(Vec2::ZERO, self.network.extent());
                if to.distance(node.pos) > 0.25 * length && self.extend(start, to, true).is_some() {
                    break;
                }
            }
            self.newborn = born as u32..self.network.nodes.len() as u32;
        }
    }

    /// Whether a place lies on a crack, or as good as.
    fn is_on_crack(&self, place: Vec2) -> bool {
        let close = 0.3 * self.params.step_length;
        self.params.arrest > 0.0 && self.arrest.as_ref().is_some_and(|arrest| arrest.walls.any_within(place, close))
    }

    /// Joins the nodes of a crushed core, from `first` on: each to the nearest before it, and most to the one after it.
    fn crush(&mut self, first: u32) {
        let last = self.network.nodes.len() as u32;
        for node in first + 1..last {
            let pos = self.network.nodes[node as usize].pos;
            let to = |other: u32| self.network.nodes[other as usize].pos.distance_squared(pos);
            // The node before it is on its own ring.
            let inner = (first..node.saturating_sub(1).max(first + 1)).min_by(|&a, &b| to(a).total_cmp(&to(b)));
            let draw = hash_unit(self.seed ^ 0xC3, u64::from(node));
            for other in [inner.filter(|_| draw < 0.8), Some(node - 1).filter(|_| draw > 0.15)].into_iter().flatten() {
                let width = self.params.line_width;
                let (birth, kind) = (self.steps, LinkKind::Connection);
                self.link(Link { a: other, b: node, width, birth, kind, bend: 1.0 });
            }
        }
    }

    /// Widens the cracks of an impact that was hit again: by the fourth root of the energy that it has gathered, up to twice.
    fn widen(&mut self, impact: u32) {
        let Impact { energy, first_energy, widening, .. } = self.impacts[impact as usize];
        let wider = (energy / first_energy).sqrt().sqrt().min(2.0);
        // In steps that can be seen, so that a thousand little hits do not repaint it all a thousand times.
        if wider < 1.05 * widening {
            return;
        }
        self.impacts[impact as usize].widening = wider;
        for node in 0..self.network.nodes.len() as u32 {
            let this = &mut self.network.nodes[node as usize];
            if this.impact == impact {
                this.width = (this.width * (wider / widening)).min(0.4);
                self.widths.scale(node, wider / widening);
                let (width, parent) = (this.width, this.parent);
                self.changes.widened(node, parent != NO_PARENT);
                self.timeline.widen(node, width);
            }
        }
    }

    /// A hit on a crack: new cracks start from it to either side.
    fn sprout(&mut self, pos: Vec2, impact: u32) {
        let length = self.params.step_length;
        let mut nearest = (f32::INFINITY, u32::MAX);
        self.nodes.within(pos, 2.0 * length, |node, distance_sq| {
            if (distance_sq, node) < nearest {
                nearest = (distance_sq, node);
            }
        });
        let Some(&node) = self.network.nodes.get(nearest.1 as usize) else { return };
        let Some(&parent) = self.network.nodes.get(node.parent as usize) else { return };
        let across = (node.pos - parent.pos).perp().normalize_or_zero();
        for way in [across, -across] {
            let born = self.network.nodes.len();
            self.extend(nearest.1, node.pos + way * length, false);
            if let Some(child) = self.network.nodes.get_mut(born) {
                child.impact = impact;
            }
        }
    }

    /// Collects `S(c)` of every node, and the order of the nodes.
    fn gather_pulls(&mut self) {
        self.field.grow_older();
        self.field.sweep();
        let Self { field, network, pulls, pull_of, .. } = self;
        field.each_pull(&network.nodes, |index, node, distance_sq| {
            let slot = &mut pull_of[node as usize];
            if *slot == NO_PULL {
                *slot = pulls.len() as u32;
                pulls.push(Pull {
                    node,
                    sum: [0, 0],
                    closest: index,
                    closest_sq: f32::INFINITY,
                    closest_id: u32::MAX,
                    child: Vec2::ZERO,
                    serves: false,
                    stopped: None,
                });
            }
            let pull = &mut pulls[*slot as usize];
            let marker = field.marker(index);
            let towards = (marker.pos - network.nodes[node as usize].pos) * (FIXED / distance_sq.sqrt());
            pull.sum[0] += i64::from(towards.x as i32);
            pull.sum[1] += i64::from(towards.y as i32);
            if (distance_sq, marker.id) < (pull.closest_sq, pull.closest_id) {
                (pull.closest, pull.closest_sq, pull.closest_id) = (index, distance_sq, marker.id);
            }
        });
        self.order.clear();
        self.order.extend((0u32..).zip(&self.pulls).map(|(slot, pull)| (pull.node, slot)));
        self.order.sort_unstable();
    }

    /// Finds the place of every child.
    fn aim(&mut self) {
        let extent = self.network.extent();
        let (length, kill) = (self.params.step_length, self.params.kill_distance);
        let next = self.network.nodes.len() as u64;
        for (child, &(_, slot)) in (next..).zip(&self.order) {
            let pull = &mut self.pulls[slot as usize];
            let from = self.network.nodes[pull.node as usize].pos;
            let mut direction = Vec2::new(pull.sum[0] as f32, pull.sum[1] as f32).normalize_or_zero();
            if self.params.inertia > 0.0
                && let Some(before) = self.network.nodes.get(self.network.nodes[pull.node as usize].parent as usize)
            {
                let heading = (from - before.pos).normalize_or_zero();
                // A side branch has left that heading already.
                if heading.dot(direction) > 0.0 {
                    direction = (direction + heading * self.params.inertia).normalize_or_zero();
                }
            }
            direction = self.params.direct(direction);
            if self.params.wander > 0.0 {
                // A draw per child, frozen by its index.
                let stray = self.params.wander * (2.0 * hash_unit(self.seed ^ 0x57A6, child) - 1.0);
                direction = (direction + direction.perp() * stray).normalize_or_zero();
            }
            if !self.mask.is_empty() {
                direction = steer(from, direction, length, &self.mask, extent);
            }
            pull.child = up_to_border(from, direction, length, kill, extent);
        }
        let Self { field, network, pulls, pull_of, .. } = self;
        field.each_pull(&network.nodes, |index, node, distance_sq| {
            let pull = &mut pulls[pull_of[node as usize] as usize];
            if !pull.serves {
                let left_sq = field.marker(index).pos.distance_squared(pull.child);
                pull.serves = left_sq <= kill * kill || left_sq <= distance_sq - PROGRESS * length * length;
            }
        });
        // A crack does not turn on its heel: what it cannot serve on its way is left to others.
        let keeps_on = self.arrest.is_some() && (self.params.inertia > 0.0 || !self.mask.is_empty());
        for pull in &mut self.pulls {
            let is_start = self.network.nodes[pull.node as usize].parent == NO_PARENT;
            if !pull.serves && (is_start || !keeps_on) {
                let (from, to) = (self.network.nodes[pull.node as usize].pos, self.field.marker(pull.closest).pos);
                let distance = pull.closest_sq.sqrt();
                pull.child = if distance <= length { to } else { from + (to - from) * (length / distance) };
                pull.serves = true;
            }
        }
    }

    fn join_newborn(&mut self) {
        let newborn = self.newborn.clone();
        let met = self.field.relations.as_mut().map(|relations| std::mem::take(&mut relations.met));
        for (a, b) in met.into_iter().flatten() {
            let nodes = &self.network.nodes;
            if a != b && nodes[a as usize].parent != b && nodes[b as usize].parent != a && !self.stays_open(b) {
                let width = nodes[a as usize].width.min(nodes[b as usize].width);
                self.widen_end(b);
                self.link(Link { a, b, width, birth: self.steps, kind: LinkKind::Meeting, bend: 1.0 });
            }
        }
        if self.params.draw_connections {
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
                    self.run_on(tip, self.params.island_distance);
                } else if let Some(link) = links::island(&self.params, &self.network, &self.nodes, tip) {
                    self.link(link);
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
                self.changes.listed[node as usize] = false;
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

    /// Takes up other parameters; what is grown stays, `roughness` included.
    ///
    /// # Errors
    /// If a parameter is out of its range; nothing changes then.
    pub fn set_params(&mut self, params: GrowthParams) -> Result<(), ParamError> {
        params.validate()?;
        let params = params.varied(self.seed);
        self.field.set_params(&params);
        self.widths.set_params(&params);
        self.params = params;
        self.mind_others();
        Ok(())
    }
}

/// Turns `direction` by up to 80 degrees towards what is weak and away from what is strong or forbidden.
fn steer(from: Vec2, direction: Vec2, length: f32, mask: &CrackMask, extent: Vec2) -> Vec2 {
    // Cosine and sine of 0, 10, ... 80 degrees.
    const TURNS: [(f32, f32); 9] = [
        (1.0, 0.0),
        (0.984_807_8, 0.173_648_18),
        (0.939_692_6, 0.342_020_15),
        (0.866_025_4, 0.5),
        (0.766_044_4, 0.642_787_6),
        (0.642_787_6, 0.766_044_4),
        (0.5, 0.866_025_4),
        (0.342_020_15, 0.939_692_6),
        (0.173_648_18, 0.984_807_8),
    ];
    let mut best = (f32::NEG_INFINITY, direction);
    for (cos, sin) in TURNS.into_iter().flat_map(|(cos, sin)| [(cos, sin), (cos, -sin)]) {
        let way = direction * cos + direction.perp() * sin;
        let mut liking = 0.35 * cos;
        for share in [0.5, 1.0, 1.5] {
            let uv = (from + way * (share * length)) / extent;
            liking += mask.weak_at(uv) - mask.strong_at(uv);
        }
        if mask.blocks(from / extent, (from + way * length) / extent) {
            liking -= 100.0;
        }
        if liking > best.0 {
            best = (liking, way);
        }
    }
    best.1
}

/// The end of a segment of `length`; where the border of the surface is no further than `margin` beyond, the border.
///
/// So cracks run into the border instead of ending just before it, and never leave the surface.
fn up_to_border(from: Vec2, direction: Vec2, length: f32, margin: f32, extent: Vec2) -> Vec2 {
    let far = from + direction * (length + margin);
    let mut share = 1.0f32;
    for axis in 0..2 {
        let way = far[axis] - from[axis];
        if far[axis] < 0.0 {
            share = share.min(-from[axis] / way);
        } else if far[axis] > extent[axis] {
            share = share.min((extent[axis] - from[axis]) / way);
        }
    }
    if share < 1.0 { (from + (far - from) * share).clamp(Vec2::ZERO, extent) } else { from + direction * length }
}
