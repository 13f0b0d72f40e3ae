//! The state of a growth: [`CrackGrowth`], and its queries.

use super::{
    arrest::Arrest,
    changes::Changes,
    division::Division,
    field::MarkerField,
    impact::Impact,
    layout::Layout,
    links::Linker,
    masonry::Masonry,
    nodes::NodeGrid,
    params::{GrowthParams, MarkerLayout, ParamError},
    past::Record,
    pull::{Part, Pull},
    rays::Rays,
    strand_paths::{Order, StrandPaths},
    width::Widths,
};
use crate::{
    Grid,
    pattern::{CrackMask, Network, Node, SegmentId, Timeline},
};
use glam::Vec2;
use std::{collections::VecDeque, ops::Range, sync::Arc};

/// Number of markers in each state: the other numbers add up to `total`. Those of all time stop at `u32::MAX`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct MarkerCounts {
    /// Markers ever created.
    pub total: u32,
    /// Reached and removed.
    pub killed: u32,
    /// Attracting a node.
    pub attracting: u32,
    /// Out of reach of all nodes.
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
/// assert_eq!(growth.marker_counts().attracting, 0);
/// # Ok::<(), bevy_crack::growth::ParamError>(())
/// ```
///
/// What each call does, and what it says:
///
/// ```
/// use bevy_crack::growth::{CrackGrowth, GrowthParams, HitOutcome, Impact, MarkerCounts, Rejected, StepReport};
///
/// let mut growth = CrackGrowth::new(GrowthParams::default(), [1.0, 1.0].into(), 7)?;
/// assert_eq!(growth.hit([1.5, 0.5].into(), 1.0), HitOutcome::Rejected(Rejected::OffSurface));
/// assert_eq!(growth.hit([0.5, 0.5].into(), 0.0), HitOutcome::Nothing);
/// assert_eq!(growth.hit([0.5, 0.5].into(), 1.0), HitOutcome::Started(0));
/// // A second hit on the same spot adds its energy.
/// assert_eq!(growth.hit([0.5, 0.5].into(), 3.0), HitOutcome::Merged(0));
/// let impact: Impact = growth.impacts()[0];
/// assert_eq!((impact.energy, impact.first_energy), (4.0, 1.0));
///
/// // Each step adds nodes, and their segments are to be drawn.
/// assert!(growth.is_growing() && !growth.is_laying_out());
/// let StepReport { born, .. } = growth.step();
/// assert_eq!(growth.new_nodes(), 1..1 + born);
/// let mut changed = Vec::new();
/// growth.take_changed(&mut changed);
/// assert_eq!(changed.len(), born as usize);
/// while growth.step().grew() {}
/// assert!(!growth.is_growing());
/// // The last call found nothing to grow.
/// assert!(growth.steps_made() >= growth.steps());
///
/// let MarkerCounts { total, killed, attracting, waiting } = growth.marker_counts();
/// assert_eq!(killed + attracting + waiting, total);
/// assert_eq!(growth.living_markers().count() as u32, attracting + waiting);
/// # Ok::<(), bevy_crack::growth::ParamError>(())
/// ```
#[derive(Clone, Debug)]
pub struct CrackGrowth {
    pub(super) params: GrowthParams,
    pub(super) seed: u64,
    pub(super) network: Network,
    pub(super) field: MarkerField,
    pub(super) nodes: NodeGrid,
    /// Only if cracks must not cross.
    pub(super) arrest: Option<Arrest>,
    /// Only if cracks divide domains.
    pub(super) division: Option<Division>,
    pub(super) widths: Widths,
    pub(super) linker: Linker,
    pub(super) rays: Rays,
    /// Strands that are to be laid out.
    pub(super) orders: VecDeque<Order>,
    /// Strands that have not grown to their ends.
    pub(super) strands: Vec<StrandPaths>,
    pub(super) impacts: Vec<Impact>,
    /// The markers that the last hit has still to lay out.
    pub(super) layout: Option<Box<Layout>>,
    pub(super) density: Option<Grid<f32>>,
    pub(super) mask: Arc<CrackMask>,
    /// The joints in which cracks run.
    pub(super) masonry: Option<Arc<Masonry>>,
    pub(super) steps: u32,
    pub(super) steps_left: u32,
    /// The step that is under way.
    pub(super) part: Option<Part>,
    /// What has happened so far.
    pub(super) record: Record,
    /// Number of cracks started by nucleation, and of markers that were tried for it.
    pub(super) nucleated: u32,
    pub(super) tried: u32,
    /// First nodes of hits whose growth has not ended.
    pub(super) unshown: Vec<u32>,
    /// Number of nodes that were added from other networks.
    pub(super) added: usize,
    pub(super) new_nodes: Range<u32>,
    /// Number of links that are already in the list of changes.
    pub(super) links_reported: u32,
    /// Positions of markers created since the last call of [`take_markers`](Self::take_markers).
    pub(super) shown_markers: Vec<Vec2>,
    pub(super) changes: Changes,
    pub(super) timeline: Timeline,
    pub(super) pulls: Vec<Pull>,
    /// For rays: the directions to which each of `pulls` is bound.
    pub(super) ways: Vec<[Vec2; 3]>,
    /// Per node: the direction of its crack without kinks; zero for a start.
    pub(super) courses: Vec<Vec2>,
    /// Node and entry in `pulls`, in the order of the nodes.
    pub(super) order: Vec<(u32, u32)>,
    /// Per node: its entry in `pulls` during a step.
    pub(super) pull_of: Vec<u32>,
    /// Nodes that became wider through one new node; empty in between.
    pub(super) widened: Vec<u32>,
}

impl CrackGrowth {
    /// A pattern without cracks on a surface of `extent` pattern units (see
    /// [`SurfaceFrame::extent`](crate::pattern::SurfaceFrame::extent)).
    ///
    /// # Errors
    /// [`ParamError::OutOfRange`] if a parameter is out of its range, or `extent` (with this name) is not within
    /// 0.0001..=64.
    pub fn new(params: GrowthParams, extent: Vec2, seed: u64) -> Result<Self, ParamError> {
        params.validate()?;
        for value in extent.to_array() {
            if !(1e-4..=64.0).contains(&value) {
                return Err(ParamError::OutOfRange { name: "extent", value: f64::from(value), min: 1e-4, max: 64.0 });
            }
        }
        let params = params.varied(seed);
        let network = Network::new(extent, params.roughness, seed).with_distortion(params.distortion);
        let mut growth = Self {
            arrest: params.keeps_apart().then(|| Arrest::new(&network, params.step_length)),
            division: Division::new(&params),
            network,
            field: MarkerField::new(extent, &params),
            nodes: NodeGrid::new(extent, 2.0 * params.step_length.max(params.kill_distance)),
            widths: Widths::new(&params),
            linker: Linker::default(),
            rays: Rays::default(),
            orders: VecDeque::new(),
            strands: Vec::new(),
            impacts: Vec::new(),
            layout: None,
            density: None,
            mask: Arc::default(),
            masonry: None,
            steps: 0,
            steps_left: 0,
            part: None,
            record: Record::default(),
            nucleated: 0,
            tried: 0,
            unshown: Vec::new(),
            added: 0,
            new_nodes: 0..0,
            links_reported: 0,
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
        growth.update_masonry();
        Ok(growth)
    }

    /// Computes the joints in which cracks run.
    pub(super) fn update_masonry(&mut self) {
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

    /// Creates or drops the index of lines. It exists if cracks must not cross, or if there are forbidden places.
    pub(super) fn update_arrest(&mut self) {
        let must = self.params.keeps_apart() || self.mask.forbidden.is_some();
        if must != self.arrest.is_some() {
            self.arrest = must.then(|| Arrest::new(&self.network, self.params.step_length));
        }
    }

    /// Whether another step may grow something, or [one](Self::continue_step) is under way.
    #[must_use]
    pub const fn is_growing(&self) -> bool {
        self.steps_left > 0 || self.part.is_some()
    }

    /// Nodes and segments so far.
    #[must_use]
    pub const fn network(&self) -> &Network {
        &self.network
    }

    /// When each part of the network was added.
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

    /// Indices of the nodes that the last step or hit added.
    #[must_use]
    pub fn new_nodes(&self) -> Range<u32> {
        self.new_nodes.clone()
    }

    /// Appends the segments that are new or wider since the last call, each once, and clears the list.
    pub fn take_changed(&mut self, changed: &mut Vec<SegmentId>) {
        self.changes.take(usize::MAX, changed);
    }

    /// Whether anything is left that [`take_changed`](Self::take_changed) or [`take_markers`](Self::take_markers) would give.
    #[cfg(feature = "bevy")]
    pub(crate) fn has_changed(&self) -> bool {
        !self.changes.list.is_empty() || !self.shown_markers.is_empty()
    }

    /// Like [`take_changed`](Self::take_changed), but no more than `most` of the oldest; returns whether any are left.
    #[cfg(feature = "bevy")]
    pub(crate) fn take_some_changed(&mut self, most: usize, changed: &mut Vec<SegmentId>) -> bool {
        self.changes.take(most, changed);
        !self.changes.list.is_empty()
    }

    /// Appends the positions of markers created since the last call, if `draw_markers` is set.
    ///
    /// ```
    /// use bevy_crack::growth::{CrackGrowth, GrowthParams};
    ///
    /// let params = GrowthParams { draw_markers: true, ..GrowthParams::DEFAULT };
    /// let mut growth = CrackGrowth::new(params, [1.0, 1.0].into(), 7)?;
    /// growth.hit([0.5, 0.5].into(), 1.0);
    /// let mut markers = Vec::new();
    /// growth.take_markers(&mut markers);
    /// assert_eq!(markers.len() as u32, growth.marker_counts().total);
    /// # Ok::<(), bevy_crack::growth::ParamError>(())
    /// ```
    pub fn take_markers(&mut self, markers: &mut Vec<Vec2>) {
        markers.append(&mut self.shown_markers);
    }

    /// Positions of the markers that are not reached yet, pattern units.
    pub fn living_markers(&self) -> impl Iterator<Item = Vec2> + '_ {
        self.field.living_positions()
    }

    /// Number of markers in each state.
    #[must_use]
    pub fn marker_counts(&self) -> MarkerCounts {
        let (living, attracting) = self.field.living();
        MarkerCounts { total: self.field.made, killed: self.field.killed, attracting, waiting: living - attracting }
    }

    /// The parameters, as [varied](GrowthParams::varied) by the seed.
    #[must_use]
    pub const fn params(&self) -> &GrowthParams {
        &self.params
    }

    /// The current mask.
    #[cfg(feature = "bevy")]
    pub(crate) const fn mask(&self) -> &Arc<CrackMask> {
        &self.mask
    }

    /// How many more nodes can grow.
    pub(super) fn room(&self) -> usize {
        (self.params.max_nodes as usize + self.added).saturating_sub(self.network.nodes.len())
    }

    /// The last child of a node, or [`NO_PARENT`].
    pub(super) fn child_of(&self, node: u32) -> u32 {
        self.changes.tree[node as usize].child
    }

    /// The direction of the segment to a node; zero for a start.
    pub(super) fn heading_of(&self, node: u32) -> Vec2 {
        let Node { pos, parent, .. } = self.network.nodes[node as usize];
        self.network.nodes.get(parent as usize).map_or(Vec2::ZERO, |parent| (pos - parent.pos).normalize_or_zero())
    }

    /// Whether cracks divide domains.
    pub(super) const fn divides(&self) -> bool {
        self.division.is_some()
    }

    /// Whether every ray has markers of its own.
    pub(super) const fn has_rays(&self) -> bool {
        matches!(self.params.markers, MarkerLayout::Rays { .. })
    }

    /// Whether cracks are rays that keep to their way.
    pub(super) fn are_rays(&self) -> bool {
        self.arrest.is_some() && self.has_rays()
    }
}
