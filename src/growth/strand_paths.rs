//! Strands that are to be laid out ([`Order`]), and their paths, which grow step by step ([`StrandPaths`]).

use crate::{
    math::mix,
    pattern::{NO_PARENT, Network},
    strands::{Directions, GrowingStrands, Material, Primitive, StrandParams, StrandStart},
};
use glam::Vec2;
use std::sync::LazyLock;

/// Lines of at most this many points that leave a longer one grow this many steps later.
const SHORT: u32 = 12;
const LATER: u32 = 6;

/// Strands that are to be laid out: some tries, one after the other, of which the best is taken.
#[derive(Clone, Debug)]
pub(super) struct Order {
    pub(super) impact: u32,
    /// The point from which they lead away.
    pub(super) center: Vec2,
    pub(super) reach: f32,
    /// See [`StrandPaths`].
    pub(super) roots: Vec<(Vec2, u32)>,
    pub(super) least: f32,
    pub(super) rounds: u32,
    pub(super) seed: u64,
    pub(super) params: StrandParams,
    pub(super) starts: Vec<StrandStart>,
    /// Number of tries made, of their points, and the longest strands so far.
    pub(super) tries: u32,
    pub(super) points: usize,
    pub(super) best: Option<(f32, Network)>,
    /// The strands of the try that is being made.
    pub(super) growing: Option<GrowingStrands>,
}

/// Most tries to find strands that have room.
const TRIES: u32 = 12;

/// Most points of the strands of one try, and most primitives along them; no more tries are made once this many points were made.
pub(super) const MOST_POINTS: usize = 1 << 15;
const MOST_PRIMITIVES: usize = 1024;

/// The primitives of each material, for single strands and for nets. They are made when they are first used: their images are traced.
static LIBRARIES: [[LazyLock<Vec<Primitive>>; 2]; Material::ALL.len()] = {
    macro_rules! library {
        ($material:ident) => {
            [LazyLock::new(|| Material::$material.primitives()), LazyLock::new(|| Material::$material.nets())]
        };
    }
    // In the order of `Material`.
    [library!(Asphalt), library!(Marble), library!(Sand), library!(Glass), library!(Clay)]
};

impl Order {
    pub(super) fn new(impact: u32, center: Vec2, reach: f32, params: StrandParams, seed: u64) -> Self {
        Self {
            impact,
            center,
            reach,
            roots: Vec::new(),
            least: 0.0,
            rounds: 0,
            seed,
            params,
            starts: Vec::new(),
            tries: 0,
            points: 0,
            best: None,
            growing: None,
        }
    }

    /// Goes on with a try, by up to about so many points. Returns whether the last try is done.
    ///
    /// Near the border strands may run off the surface at once. Then others are tried that noise turns less and that are longer,
    /// until they are as long as they should be.
    pub(super) fn go_on(&mut self, extent: Vec2, points: u32) -> bool {
        let library = &LIBRARIES[self.params.material as usize][usize::from(self.params.lanes > 1)];
        // There is no error: the parameters have been checked, and the starts are on the surface.
        let Some(mut growing) = self.growing.take().or_else(|| self.begin_try(extent)) else { return true };
        if !growing.grow(points) {
            self.growing = Some(growing);
            return false;
        }
        let Ok(network) = growing.finish().network(library) else { return true };
        let room = length_inside(&network);
        self.tries += 1;
        self.points += network.nodes.len();
        if self.best.as_ref().is_none_or(|(most, _)| room > *most) {
            self.best = Some((room, network));
        }
        room >= self.least || self.tries >= TRIES || self.points >= MOST_POINTS
    }

    fn begin_try(&self, extent: Vec2) -> Option<GrowingStrands> {
        let less = self.tries as f32 / TRIES as f32;
        let length = (self.params.length * (1.0 + 1.5 * less)).min(64.0);
        let params = StrandParams { rotation: self.params.rotation * (1.0 - less), length, ..self.params };
        let most = MOST_POINTS.min(MOST_PRIMITIVES * params.tile_steps() as usize);
        let field = Directions::Radial { center: self.center };
        let seed = mix(self.seed ^ u64::from(self.tries) << 32);
        GrowingStrands::new(&params, field, &self.starts, extent, seed, most).ok()
    }

    /// The best of its tries.
    pub(super) fn finish(mut self) -> Option<StrandPaths> {
        let (_, network) = self.best.take()?;
        Some(StrandPaths::new(self, network))
    }
}

/// The length of paths up to where they meet the border.
fn length_inside(paths: &Network) -> f32 {
    let mut is_in = Vec::with_capacity(paths.nodes.len());
    let mut length = 0.0;
    for node in &paths.nodes {
        let on_border = (node.pos.cmpeq(Vec2::ZERO) | node.pos.cmpeq(paths.extent())).any();
        let from = paths.nodes.get(node.parent as usize).filter(|_| is_in[node.parent as usize]);
        length += from.map_or(0.0, |from| from.pos.distance(node.pos));
        is_in.push(node.parent == NO_PARENT || from.is_some() && !on_border);
    }
    length
}

/// Paths that were laid out, as far as they have grown.
#[derive(Clone, Debug)]
pub(super) struct StrandPaths {
    pub(super) impact: u32,
    /// Where strands start, and the node there.
    pub(super) roots: Vec<(Vec2, u32)>,
    pub(super) network: Network,
    /// The points in the order in which they grow, each after a number of steps.
    order: Vec<(u32, u32)>,
    /// How many of them have grown.
    grown: usize,
    /// For each point: its node, or [`NO_PARENT`] if it has not grown or the way is blocked.
    pub(super) nodes: Vec<u32>,
    /// Steps made since the hit.
    pub(super) steps: u32,
    /// How long all strands of the impact should be at least, pattern units, and how often more may be laid out for that.
    pub(super) least: f32,
    pub(super) rounds: u32,
}

impl StrandPaths {
    fn new(order: Order, network: Network) -> Self {
        let nodes = vec![NO_PARENT; network.nodes.len()];
        let Order { impact, roots, least, rounds, .. } = order;
        let order = in_order(&network);
        Self { impact, roots, order, network, grown: 0, nodes, steps: 0, least, rounds }
    }

    pub(super) const fn is_over(&self) -> bool {
        self.grown >= self.order.len()
    }

    /// The next point that is to grow by now.
    pub(super) fn next(&mut self) -> Option<u32> {
        let &(_, point) = self.order.get(self.grown).filter(|(step, _)| *step <= self.steps)?;
        self.grown += 1;
        Some(point)
    }

    /// The first `count` nodes of the growth have been removed: nothing grows from those any more.
    pub(super) fn forget(&mut self, count: u32) {
        let roots = self.roots.iter_mut().map(|(_, node)| node);
        for node in self.nodes.iter_mut().chain(roots).filter(|node| **node != NO_PARENT) {
            *node = node.checked_sub(count).unwrap_or(NO_PARENT);
        }
    }

    /// The node from which a strand starts that begins at `pos`.
    pub(super) fn root(&self, pos: Vec2) -> u32 {
        let distance = |root: &&(Vec2, u32)| root.0.distance_squared(pos);
        let nearest = self.roots.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map_or(NO_PARENT, |(_, node)| *node)
    }
}

/// The order in which points grow: short side lines come a little later than the line that they leave, which is not to stop at them.
fn in_order(paths: &Network) -> Vec<(u32, u32)> {
    let nodes = &paths.nodes;
    // Number of points of the longest line from each point on. Parents come before their children.
    let mut longest = vec![1u32; nodes.len()];
    for (i, node) in nodes.iter().enumerate().rev() {
        if let Some(parent) = longest.get(node.parent as usize).copied() {
            longest[node.parent as usize] = parent.max(longest[i] + 1);
        }
    }
    let mut is_side = vec![false; nodes.len()];
    let mut order = Vec::with_capacity(nodes.len());
    for (i, node) in nodes.iter().enumerate() {
        if node.parent != NO_PARENT {
            let parent = node.parent as usize;
            is_side[i] = is_side[parent] || longest[i] <= SHORT && longest[i] + 1 < longest[parent];
        }
        order.push((node.birth.saturating_add(if is_side[i] { LATER } else { 0 }), i as u32));
    }
    order.sort_unstable();
    order
}
