//! The markers, each with its nearest node.
//!
//! The usual way is to index the nodes and ask that index for every marker at every step. Here it is turned round: the
//! markers lie still, sorted by the cells of a uniform grid, and remember their nearest node; a newborn node looks once at
//! the markers within its reach and wins those that it is nearest to.

mod newborn;
mod settle;

use self::newborn::{Newborn, Settling};
use super::{
    GrowthParams,
    closed::{Bond, Relations},
    nodes::NodeGrid,
    params::Venation,
    rays::RAY,
};
use crate::pattern::Node;
use glam::{UVec2, Vec2};

/// Squared distance of a dead marker to its node: no distance is below it.
const DEAD: f32 = -1.0;

/// No node attracts the marker.
pub(super) const NO_NODE: u32 = u32::MAX;

/// [`MarkerField::loyal`] of a marker that every node may win.
pub(super) const ANY_IMPACT: u32 = u32::MAX;

/// Markers that are compared at once; compilers turn the comparison into vector instructions.
const LANES: usize = 8;

#[derive(Clone, Copy, Debug)]
pub(super) struct Marker {
    pub(super) pos: Vec2,
    /// Order of birth, for ties.
    pub(super) id: u32,
}

/// A marker that was given up so often dies.
pub(super) const MOST_GIVEN_UP: u8 = 4;

#[derive(Clone, Debug)]
pub(super) struct MarkerField {
    extent: Vec2,
    radius: f32,
    kill_sq: f32,
    /// Whether cracks divide domains: markers only know how far the nearest is, and attract those of which they are their own.
    divides: bool,
    // Sorted by cell, one entry a marker, then as many dead ones as there are lanes.
    x: Vec<f32>,
    y: Vec<f32>,
    /// Squared distance to the nearest node; the squared crack radius while there is none within it; [`DEAD`].
    near_sq: Vec<f32>,
    node: Vec<u32>,
    id: Vec<u32>,
    /// The impact whose nodes alone may win the marker, or [`ANY_IMPACT`]; every node that reaches it kills it. Or the ray, whose nodes
    /// alone do either.
    loyal: Vec<u32>,
    /// How often the marker was given up.
    given_up: Vec<u8>,
    /// Per node: the ray that it is on; may be shorter than there are nodes.
    pub(super) ray_of: Vec<u32>,
    /// Closed venation: what each marker attracts besides its nearest node.
    pub(super) relations: Option<Relations>,
    /// Markers that lie in no cell yet.
    newborn: Vec<Newborn>,
    /// Newborn markers that have not all found their places.
    settling: Option<Box<Settling>>,
    cells: UVec2,
    /// Cells per pattern unit.
    per_unit: Vec2,
    /// First marker of each cell, and the end.
    first: Vec<u32>,
    /// Markers that attract a node; may hold dead ones until the next sweep.
    pub(super) active: Vec<u32>,
    pub(super) made: u32,
    /// Number for the next marker.
    next: u32,
    pub(super) killed: u32,
}

impl MarkerField {
    pub(super) fn new(extent: Vec2, params: &GrowthParams) -> Self {
        Self {
            extent,
            radius: params.crack_radius,
            kill_sq: kill_sq(params),
            divides: params.venation == Venation::Dividing,
            x: Vec::new(),
            y: Vec::new(),
            near_sq: Vec::new(),
            node: Vec::new(),
            id: Vec::new(),
            loyal: Vec::new(),
            given_up: Vec::new(),
            ray_of: Vec::new(),
            relations: (params.venation == Venation::Closed).then(|| Relations::new(params)),
            newborn: Vec::new(),
            settling: None,
            cells: UVec2::ONE,
            per_unit: extent.recip(),
            first: vec![0, 0],
            active: Vec::new(),
            made: 0,
            next: 0,
            killed: 0,
        }
    }

    /// Takes up other parameters; every marker looks for its nodes anew when it [settles](Self::settle).
    pub(super) fn set_params(&mut self, params: &GrowthParams) {
        self.radius = params.crack_radius;
        self.kill_sq = kill_sq(params);
        self.divides = params.venation == Venation::Dividing;
        self.relations = (params.venation == Venation::Closed).then(|| {
            let mut relations = Relations::new(params);
            (0..self.next).for_each(|_| relations.add());
            relations
        });
        let mut living = self.take_living();
        living.append(&mut self.newborn);
        self.newborn = living;
    }

    /// Forgets the dead and those that `is_lost` says can never be won, so that the others may be numbered anew.
    pub(super) fn forget_dead(&mut self, params: &GrowthParams, is_lost: impl Fn(u32) -> bool) {
        self.set_params(params);
        let before = self.newborn.len();
        self.newborn.retain(|marker| !is_lost(marker.loyal));
        self.killed += (before - self.newborn.len()) as u32;
        self.newborn.sort_unstable_by_key(|marker| marker.id);
        for (id, marker) in (0..).zip(&mut self.newborn) {
            marker.id = id;
        }
        self.next = self.newborn.len() as u32;
        if let Some(relations) = &mut self.relations {
            relations.keep(self.newborn.len());
        }
    }

    /// Empties the field of its settled markers and returns the living.
    fn take_living(&mut self) -> Vec<Newborn> {
        let living = (0..self.x.len()).filter(|&i| self.near_sq[i] > DEAD);
        let living = living.map(|i| self.marker_at(i)).collect();
        self.clear();
        living
    }

    /// A settled marker as one that has not settled.
    fn marker_at(&self, i: usize) -> Newborn {
        Newborn {
            pos: Vec2::new(self.x[i], self.y[i]),
            id: self.id[i],
            loyal: self.loyal[i],
            given_up: self.given_up[i],
            near_sq: if self.divides { self.near_sq[i] } else { f32::INFINITY },
        }
    }

    /// Empties the field of its settled markers.
    fn clear(&mut self) {
        for plane in [&mut self.x, &mut self.y, &mut self.near_sq] {
            plane.clear();
        }
        self.node.clear();
        self.id.clear();
        self.loyal.clear();
        self.given_up.clear();
        self.active.clear();
        self.first.fill(0);
    }

    pub(super) fn add(&mut self, pos: Vec2, loyal: u32, relieved: f32) {
        let near_sq = relieved.max(0.0) * relieved;
        self.newborn.push(Newborn { pos, id: self.next, loyal, given_up: 0, near_sq });
        self.next += 1;
        self.made += 1;
        if let Some(relations) = &mut self.relations {
            relations.add();
        }
    }

    #[inline]
    pub(super) fn marker(&self, index: u32) -> Marker {
        let i = index as usize;
        let pos = Vec2::new(self.x[i], self.y[i]);
        Marker { pos, id: self.id[i] }
    }

    fn cell_at(&self, pos: Vec2) -> UVec2 {
        (pos * self.per_unit).max(Vec2::ZERO).as_uvec2().min(self.cells - UVec2::ONE)
    }

    fn cell_of(&self, pos: Vec2) -> usize {
        let cell = self.cell_at(pos);
        cell.y as usize * self.cells.x as usize + cell.x as usize
    }

    /// The markers of the cells within `reach` of `pos`: one range for each row of cells.
    fn rows(&self, pos: Vec2, reach: f32) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (low, high) = (self.cell_at(pos - reach), self.cell_at(pos + reach));
        let width = self.cells.x as usize;
        (low.y as usize..=high.y as usize).map(move |y| (y * width + low.x as usize, y * width + high.x as usize + 1))
    }

    /// Lets a newborn node win the markers that it is nearest to, and kills those that it reaches.
    ///
    /// Must be called in order of the nodes' indices: at equal distance the lower index keeps the marker.
    pub(super) fn visit(&mut self, index: u32, nodes: &[Node], grid: &NodeGrid) {
        let node = &nodes[index as usize];
        for (from, to) in self.rows(node.pos, self.radius) {
            let (from, to) = (self.first[from] as usize, self.first[to] as usize);
            // Whole lanes, even beyond the cells: a marker that is not won is left as it is, and there is padding.
            for i in (from..to).step_by(LANES) {
                if self.any_won(i, node.pos) {
                    for marker in i..i + LANES {
                        if self.relations.is_none() {
                            self.offer(marker, index, node);
                        } else {
                            self.relate(marker, index, nodes, grid);
                        }
                    }
                }
            }
        }
    }

    /// Whether `pos` is nearer to one of the [`LANES`] markers from `first` than its node.
    #[inline]
    fn any_won(&self, first: usize, pos: Vec2) -> bool {
        let lanes = first..first + LANES;
        let (x, y, near_sq) = (&self.x[lanes.clone()], &self.y[lanes.clone()], &self.near_sq[lanes]);
        let mut any = false;
        for lane in 0..LANES {
            any |= distance_sq(x[lane], y[lane], pos) < near_sq[lane];
        }
        any
    }

    #[inline]
    fn offer(&mut self, marker: usize, index: u32, node: &Node) {
        let distance_sq = distance_sq(self.x[marker], self.y[marker], node.pos);
        if distance_sq >= self.near_sq[marker] {
            return;
        }
        let loyal = self.loyal[marker];
        let is_own = self.is_own(loyal, index, node);
        if distance_sq <= self.kill_sq && (is_own || !is_ray(loyal)) {
            self.near_sq[marker] = DEAD;
            self.killed += 1;
            return;
        }
        if self.divides {
            self.near_sq[marker] = distance_sq;
            return;
        }
        if !is_own {
            return;
        }
        if self.node[marker] == NO_NODE {
            self.active.push(marker as u32);
        }
        self.near_sq[marker] = distance_sq;
        self.node[marker] = index;
    }

    /// Whether a marker that is loyal so attracts a node.
    fn is_own(&self, loyal: u32, index: u32, node: &Node) -> bool {
        loyal == ANY_IMPACT
            || loyal == node.impact
            || (is_ray(loyal) && self.ray_of.get(index as usize) == Some(&loyal))
    }

    /// Closed venation: shows a marker a node that may come to be among its relative neighbours.
    fn relate(&mut self, marker: usize, index: u32, nodes: &[Node], grid: &NodeGrid) {
        let (pos, node) = (Vec2::new(self.x[marker], self.y[marker]), &nodes[index as usize]);
        let distance_sq = distance_sq(pos.x, pos.y, node.pos);
        let is_own = self.is_own(self.loyal[marker], index, node);
        let Some(relations) = self.relations.as_mut().filter(|_| distance_sq < self.near_sq[marker]) else { return };
        let bond = relations.visit((self.id[marker], pos), (index, distance_sq, is_own), nodes, grid);
        self.bind(marker, bond);
    }

    fn bind(&mut self, marker: usize, bond: Bond) {
        match bond {
            Bond::Attracts(node) => {
                if std::mem::replace(&mut self.node[marker], node) == NO_NODE {
                    self.active.push(marker as u32);
                }
            }
            // It stays among the active until the next sweep, and must not be put there twice.
            Bond::Waits => {}
            Bond::Dead => {
                self.near_sq[marker] = DEAD;
                self.killed += 1;
            }
        }
    }

    /// Makes the active markers a step older, where they can be too old.
    pub(super) fn grow_older(&mut self) {
        for i in 0..self.active.len() {
            let marker = self.active[i] as usize;
            let id = self.id[marker];
            if self.near_sq[marker] <= DEAD {
                continue;
            }
            match self.relations.as_mut().map(|relations| relations.grow_older(id)) {
                Some(Bond::Waits) => self.node[marker] = NO_NODE,
                Some(bond) => self.bind(marker, bond),
                None => return,
            }
        }
    }

    /// Calls `visit` with each marker that attracts a node, that node, and their squared distance.
    #[inline]
    pub(super) fn each_pull(&self, nodes: &[Node], mut visit: impl FnMut(u32, u32, f32)) {
        match &self.relations {
            None => {
                for &index in &self.active {
                    visit(index, self.node[index as usize], self.near_sq[index as usize]);
                }
            }
            Some(relations) => {
                for &index in &self.active {
                    let i = index as usize;
                    for &node in relations.neighbours(self.id[i]) {
                        visit(index, node, distance_sq(self.x[i], self.y[i], nodes[node as usize].pos));
                    }
                }
            }
        }
    }

    /// Drops the dead and the given up from the active markers.
    pub(super) fn sweep(&mut self) {
        let (near_sq, node) = (&self.near_sq, &self.node);
        self.active.retain(|&i| near_sq[i as usize] > DEAD && node[i as usize] != NO_NODE);
    }

    /// Takes a marker from its node, for which it is behind a crack: only a nearer node may win it now. After a few times it dies.
    pub(super) fn give_up(&mut self, index: u32, node: u32) {
        let i = index as usize;
        if let Some(relations) = &mut self.relations {
            match relations.give_up(self.id[i], node) {
                Bond::Attracts(other) => self.node[i] = other,
                Bond::Waits => self.node[i] = NO_NODE,
                Bond::Dead if self.near_sq[i] > DEAD => {
                    self.near_sq[i] = DEAD;
                    self.killed += 1;
                }
                Bond::Dead => {}
            }
            return;
        }
        self.node[i] = NO_NODE;
        self.given_up[i] += 1;
        if self.given_up[i] >= MOST_GIVEN_UP {
            self.near_sq[i] = DEAD;
            self.killed += 1;
        }
    }

    /// Takes a living marker that no node attracts: of those found first from `draws.len()` places that are chosen by draws the nearest to
    /// `center`. Returns its place and its impact.
    pub(super) fn take_waiting(&mut self, draws: &[u64], center: Vec2) -> Option<(Vec2, u32)> {
        let n = self.made_settled();
        let is_waiting = |i: &usize| self.near_sq[*i] > DEAD && self.node[*i] == NO_NODE;
        let found = draws.iter().filter_map(|draw| {
            let from = (draw % n.max(1) as u64) as usize;
            (from..n).chain(0..from).find(is_waiting)
        });
        let away = |i: &usize| Vec2::new(self.x[*i], self.y[*i]).distance_squared(center);
        let i = found.min_by(|a, b| away(a).total_cmp(&away(b)))?;
        self.near_sq[i] = DEAD;
        self.killed += 1;
        Some((Vec2::new(self.x[i], self.y[i]), self.loyal[i]))
    }

    /// Calls `visit` with each living marker that is further than this from all cracks: its place in the field, number, place, squared distance to
    /// the nearest crack and impact.
    pub(super) fn each_beyond(&self, least_sq: f32, mut visit: impl FnMut(u32, u32, Vec2, f32, u32)) {
        for (i, &near_sq) in self.near_sq.iter().enumerate() {
            if near_sq > least_sq {
                visit(i as u32, self.id[i], Vec2::new(self.x[i], self.y[i]), near_sq, self.loyal[i]);
            }
        }
    }

    /// Calls `visit` with the place and squared distance of each marker within the radius that is nearer to the node at `pos` than to any other.
    pub(super) fn each_own(&self, pos: Vec2, mut visit: impl FnMut(Vec2, f32)) {
        for (from, to) in self.rows(pos, self.radius) {
            for i in self.first[from] as usize..self.first[to] as usize {
                let distance_sq = distance_sq(self.x[i], self.y[i], pos);
                if distance_sq == self.near_sq[i] {
                    visit(Vec2::new(self.x[i], self.y[i]), distance_sq);
                }
            }
        }
    }

    /// Squared distance of a marker to the nearest crack; below zero if it is dead.
    pub(super) fn near_sq(&self, index: u32) -> f32 {
        self.near_sq[index as usize]
    }

    /// Takes a marker.
    pub(super) fn take(&mut self, index: u32) {
        self.near_sq[index as usize] = DEAD;
        self.killed += 1;
    }

    /// Whether newborn markers have begun to settle, and not all have found their places.
    pub(super) const fn is_settling(&self) -> bool {
        self.settling.is_some()
    }

    /// Markers in the cells, with those that died since the last [`settle`](Self::settle).
    pub(super) fn made_settled(&self) -> usize {
        self.x.len().saturating_sub(LANES)
    }

    /// Markers that are alive, and how many of them attract a node.
    pub(super) fn living(&self) -> (u32, u32) {
        let alive = self.near_sq.iter().zip(&self.node).filter(|(near_sq, _)| **near_sq > DEAD);
        let in_hand = self.settling.as_ref().map_or(0, |settling| settling.in_hand());
        let (mut living, mut attracting) = ((self.newborn.len() + in_hand) as u32, 0);
        for (_, node) in alive {
            living += 1;
            attracting += u32::from(*node != NO_NODE);
        }
        (living, attracting)
    }

    /// Places of the markers that no step has taken up yet, and whose they are.
    #[cfg(test)]
    pub(super) fn unsettled(&self) -> impl Iterator<Item = (Vec2, u32)> {
        self.newborn.iter().map(|marker| (marker.pos, marker.loyal))
    }

    /// Markers alive, counting those that died since the last [`settle`](Self::settle).
    pub(super) fn living_at_most(&self) -> usize {
        self.x.len() + self.newborn.len()
    }

    /// Whether a marker, alive or dead since the last [`settle`](Self::settle), lies within `distance` of `pos`.
    pub(super) fn any_within(&self, pos: Vec2, distance: f32) -> bool {
        self.rows(pos, distance).any(|(from, to)| {
            let (from, to) = (self.first[from] as usize, self.first[to] as usize);
            (from..to).any(|i| distance_sq(self.x[i], self.y[i], pos) < distance * distance)
        })
    }
}

/// Whether a marker belongs to a ray.
const fn is_ray(loyal: u32) -> bool {
    loyal != ANY_IMPACT && loyal & RAY != 0
}

/// The least squared distance at which a marker dies.
fn kill_sq(params: &GrowthParams) -> f32 {
    let finest = if params.venation == Venation::Dividing { 1.0 + params.focus } else { 1.0 };
    (params.kill_distance / finest) * (params.kill_distance / finest)
}

/// Room for `n` values, written once: the first write to memory is the dear one.
fn get_ready<T: Copy + Default>(plane: &mut Vec<T>, n: usize) {
    let length = plane.len();
    plane.resize(n.max(length), T::default());
    plane.truncate(length);
}

/// As `Vec2::distance_squared`, spelled out for whole lanes.
fn distance_sq(x: f32, y: f32, pos: Vec2) -> f32 {
    let (dx, dy) = (x - pos.x, y - pos.y);
    dx * dx + dy * dy
}
