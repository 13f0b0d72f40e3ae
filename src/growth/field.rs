//! The markers, each with its nearest node.
//!
//! The usual way is to index the nodes and to query that index for every marker at every step. Here it is the other
//! way around: the markers are stored in the cells of a uniform grid and remember their nearest node. Each new node
//! visits the markers within its reach once, and takes those to which it is the nearest.

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
use core::ops::Range;
use glam::{UVec2, Vec2};

/// Squared distance of a removed marker to its node: no distance is below it.
const DEAD: f32 = -1.0;

/// No node attracts the marker.
pub(super) const NO_NODE: u32 = u32::MAX;

/// [`MarkerField::owner`] of a marker that every node may take.
pub(super) const ANY_IMPACT: u32 = u32::MAX;

/// Markers that are compared at once; compilers vectorize the comparison.
const LANES: usize = 8;

#[derive(Clone, Copy, Debug)]
pub(super) struct Marker {
    pub(super) pos: Vec2,
    /// Order of creation, for ties.
    pub(super) id: u32,
}

/// A marker that was given up this often is removed.
pub(super) const MOST_GIVEN_UP: u8 = 4;

#[derive(Clone, Debug)]
pub(super) struct MarkerField {
    extent: Vec2,
    radius: f32,
    kill_sq: f32,
    /// Whether cracks divide domains: markers only store the distance to the nearest crack, and attract only that
    /// crack.
    divides: bool,
    // Sorted by cell, one entry per marker, followed by as many dead entries as there are lanes.
    x: Vec<f32>,
    y: Vec<f32>,
    /// Squared distance to the nearest node; the squared crack radius while there is none within it; [`DEAD`].
    near_sq: Vec<f32>,
    node: Vec<u32>,
    id: Vec<u32>,
    /// The owner: an impact or a ray, or [`ANY_IMPACT`]. Only nodes of the owner may take the marker. A marker of an
    /// impact is removed by every node that reaches it, a marker of a ray only by nodes of the ray.
    owner: Vec<u32>,
    /// How often the marker was given up.
    given_up: Vec<u8>,
    /// The nodes before this one have been shown to all settled markers.
    shown: u32,
    /// Per node: its ray; may be shorter than the number of nodes.
    pub(super) ray_of: Vec<u32>,
    /// Closed venation: the nodes that each marker attracts in addition to the nearest.
    pub(super) relations: Option<Relations>,
    /// Markers that lie in no cell yet.
    newborn: Vec<Newborn>,
    /// The state of settling new markers, while it is in progress.
    settling: Option<Box<Settling>>,
    cells: UVec2,
    /// Cells per pattern unit.
    per_unit: Vec2,
    /// First marker of each cell, and the end.
    first: Vec<u32>,
    /// Markers that attract a node; may contain dead ones until the next sweep.
    pub(super) active: Vec<u32>,
    /// What [`retain_beyond`](Self::retain_beyond) has kept, if anything was sought since markers were last sorted.
    beyond: Option<Vec<u32>>,
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
            divides: params.venation == Venation::Subdivision,
            x: Vec::new(),
            y: Vec::new(),
            near_sq: Vec::new(),
            node: Vec::new(),
            id: Vec::new(),
            owner: Vec::new(),
            given_up: Vec::new(),
            shown: 0,
            ray_of: Vec::new(),
            relations: (params.venation == Venation::Closed).then(|| Relations::new(params)),
            newborn: Vec::new(),
            settling: None,
            cells: UVec2::ONE,
            per_unit: extent.recip(),
            first: vec![0, 0],
            active: Vec::new(),
            beyond: None,
            made: 0,
            next: 0,
            killed: 0,
        }
    }

    /// Sets other parameters; every marker searches for its nodes again when it [settles](Self::settle).
    pub(super) fn set_params(&mut self, params: &GrowthParams) {
        // Distances to cracks are known only where cracks divided before.
        let divides = params.venation == Venation::Subdivision;
        self.divides &= divides;
        let mut living = self.take_living();
        self.shown = 0;
        self.radius = params.crack_radius;
        self.kill_sq = kill_sq(params);
        self.divides = divides;
        self.relations = (params.venation == Venation::Closed).then(|| {
            let mut relations = Relations::new(params);
            (0..self.next).for_each(|_| relations.add());
            relations
        });
        living.append(&mut self.newborn);
        if !divides {
            // Other cracks may take a marker however near the border or the rim are.
            living.iter_mut().for_each(|marker| marker.near_sq = f32::INFINITY);
        }
        self.newborn = living;
    }

    /// Removes dead markers, and those for which `is_lost` says that no node can take them, so that the others can be
    /// renumbered.
    pub(super) fn forget_dead(&mut self, params: &GrowthParams, is_lost: impl Fn(u32) -> bool) {
        self.set_params(params);
        let before = self.newborn.len();
        self.newborn.retain(|marker| !is_lost(marker.owner));
        self.count_killed(before - self.newborn.len());
        self.newborn.sort_unstable_by_key(|marker| marker.id);
        for (id, marker) in (0..).zip(&mut self.newborn) {
            marker.id = id;
        }
        self.next = self.newborn.len() as u32;
        if let Some(relations) = &mut self.relations {
            relations.keep(self.newborn.len());
        }
    }

    fn count_killed(&mut self, markers: usize) {
        self.killed = self.killed.saturating_add(markers as u32);
    }

    /// Positions of the living markers in the field.
    pub(super) fn living_positions(&self) -> impl Iterator<Item = Vec2> + '_ {
        let all = self.x.iter().zip(&self.y).zip(&self.near_sq);
        all.filter(|(_, near_sq)| **near_sq > DEAD).map(|((x, y), _)| Vec2::new(*x, *y))
    }

    /// Removes all settled markers from the field and returns the living ones.
    fn take_living(&mut self) -> Vec<Newborn> {
        let living = (0..self.x.len()).filter(|&i| self.near_sq[i] > DEAD);
        let living = living.map(|i| self.marker_at(i)).collect();
        self.clear();
        living
    }

    /// A settled marker as one that looks for its node.
    fn marker_at(&self, i: usize) -> Newborn {
        Newborn {
            pos: Vec2::new(self.x[i], self.y[i]),
            id: self.id[i],
            owner: self.owner[i],
            given_up: self.given_up[i],
            near_sq: if self.divides { self.near_sq[i] } else { f32::INFINITY },
            node: NO_NODE,
            is_known: false,
        }
    }

    /// A settled marker that keeps its node, if it would find the same again.
    fn kept_marker_at(&self, i: usize) -> Newborn {
        let (node, near_sq) = (self.node[i], self.near_sq[i]);
        let is_known = match node {
            // A marker that was given up looks at all nodes again.
            NO_NODE => self.given_up[i] == 0 && near_sq == self.radius * self.radius,
            _ => node < self.shown,
        };
        // A node may not be on its ray yet when it is shown.
        let is_plain = !self.divides && self.relations.is_none() && self.ray_of.is_empty();
        let marker = self.marker_at(i);
        if is_known && is_plain { Newborn { near_sq, node, is_known, ..marker } } else { marker }
    }

    /// Removes all settled markers.
    fn clear(&mut self) {
        for plane in [&mut self.x, &mut self.y, &mut self.near_sq] {
            plane.clear();
        }
        self.node.clear();
        self.id.clear();
        self.owner.clear();
        self.given_up.clear();
        self.active.clear();
        self.beyond = None;
        self.first.fill(0);
    }

    pub(super) fn add(&mut self, pos: Vec2, owner: u32, relieved: f32) {
        let near_sq = relieved.max(0.0) * relieved;
        let (id, node) = (self.next, NO_NODE);
        self.newborn.push(Newborn { pos, id, owner, given_up: 0, near_sq, node, is_known: false });
        self.next += 1;
        self.made = self.made.saturating_add(1);
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

    /// Lets a new node take the markers to which it is the nearest, and removes those that it reaches.
    ///
    /// Must be called in the order of the nodes' indices: at equal distance the lower index keeps the marker.
    pub(super) fn visit(&mut self, index: u32, nodes: &[Node], grid: &NodeGrid) {
        let node = &nodes[index as usize];
        if index == self.shown {
            self.shown += 1;
        }
        for (from, to) in self.rows(node.pos, self.radius) {
            let (from, to) = (self.first[from] as usize, self.first[to] as usize);
            // Whole lanes, even beyond the cells: markers that are not taken do not change, and there is padding.
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
        let owner = self.owner[marker];
        let is_own = self.is_own(owner, index, node);
        if distance_sq <= self.kill_sq && (is_own || !is_ray(owner)) {
            self.near_sq[marker] = DEAD;
            self.count_killed(1);
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

    /// Whether a marker with this owner attracts a node.
    fn is_own(&self, owner: u32, index: u32, node: &Node) -> bool {
        owner == ANY_IMPACT
            || owner == node.impact
            || (is_ray(owner) && self.ray_of.get(index as usize) == Some(&owner))
    }

    /// Closed venation: shows a marker a node that may become one of its relative neighbours.
    fn relate(&mut self, marker: usize, index: u32, nodes: &[Node], grid: &NodeGrid) {
        let (pos, node) = (Vec2::new(self.x[marker], self.y[marker]), &nodes[index as usize]);
        let distance_sq = distance_sq(pos.x, pos.y, node.pos);
        let is_own = self.is_own(self.owner[marker], index, node);
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
            // It stays in the active list until the next sweep, and must not be added twice.
            Bond::Waits => {}
            Bond::Dead => {
                self.near_sq[marker] = DEAD;
                self.count_killed(1);
            }
        }
    }

    /// Ages the active markers by one step, if they can be too old.
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

    /// Number of markers that attract nodes.
    pub(super) const fn pulls(&self) -> usize {
        self.active.len()
    }

    /// Calls `visit` with each of some markers that attract a node, that node, and their squared distance.
    #[inline]
    pub(super) fn each_pull(&self, some: Range<usize>, nodes: &[Node], mut visit: impl FnMut(u32, u32, f32)) {
        let active = self.active.get(some).unwrap_or_default();
        match &self.relations {
            None => {
                for &index in active {
                    visit(index, self.node[index as usize], self.near_sq[index as usize]);
                }
            }
            Some(relations) => {
                for &index in active {
                    let i = index as usize;
                    for &node in relations.neighbours(self.id[i]) {
                        visit(index, node, distance_sq(self.x[i], self.y[i], nodes[node as usize].pos));
                    }
                }
            }
        }
    }

    /// Removes dead and given-up markers from the active list.
    pub(super) fn sweep(&mut self) {
        let (near_sq, node) = (&self.near_sq, &self.node);
        self.active.retain(|&i| near_sq[i as usize] > DEAD && node[i as usize] != NO_NODE);
    }

    /// Detaches a marker from its node, because a crack lies between them: now only a nearer node may take it. After
    /// a few times it is removed.
    pub(super) fn give_up(&mut self, index: u32, node: u32) {
        let i = index as usize;
        if let Some(relations) = &mut self.relations {
            match relations.give_up(self.id[i], node) {
                Bond::Attracts(other) => self.node[i] = other,
                Bond::Waits => self.node[i] = NO_NODE,
                Bond::Dead if self.near_sq[i] > DEAD => {
                    self.near_sq[i] = DEAD;
                    self.count_killed(1);
                }
                Bond::Dead => {}
            }
            return;
        }
        self.node[i] = NO_NODE;
        self.given_up[i] += 1;
        if self.given_up[i] >= MOST_GIVEN_UP {
            self.near_sq[i] = DEAD;
            self.count_killed(1);
        }
    }

    /// Removes a living marker that no node attracts, and returns its position and impact. One is found from each of
    /// `draws.len()` random places; the nearest of them to `center` is used.
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
        self.count_killed(1);
        Some((Vec2::new(self.x[i], self.y[i]), self.owner[i]))
    }

    /// Calls `keeps` with each living marker that is further than this from all cracks: its index in the field,
    /// number, position, squared distance to the nearest crack and impact. Those for which it returns `false` are not
    /// visited again until [`seek_again`](Self::seek_again).
    pub(super) fn retain_beyond(&mut self, least_sq: f32, mut keeps: impl FnMut(u32, u32, Vec2, f32, u32) -> bool) {
        let Self { near_sq, id, x, y, owner, beyond, .. } = self;
        let is_beyond = |i: &u32| near_sq[*i as usize] > least_sq;
        let beyond = beyond.get_or_insert_with(|| (0..near_sq.len() as u32).filter(is_beyond).collect());
        beyond.retain(|index| {
            let i = *index as usize;
            is_beyond(index) && keeps(*index, id[i], Vec2::new(x[i], y[i]), near_sq[i], owner[i])
        });
    }

    /// Lets [`retain_beyond`](Self::retain_beyond) visit all markers again.
    pub(super) fn seek_again(&mut self) {
        self.beyond = None;
    }

    /// Calls `visit` with the position and squared distance of each marker within the radius that is nearer to the
    /// node at `pos` than to any other.
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

    /// Removes a marker.
    pub(super) fn take(&mut self, index: u32) {
        self.near_sq[index as usize] = DEAD;
        self.count_killed(1);
    }

    /// Whether settling of new markers is in progress.
    pub(super) const fn is_settling(&self) -> bool {
        self.settling.is_some()
    }

    /// Markers in the cells, with those that died since the last [`settle`](Self::settle).
    pub(super) fn made_settled(&self) -> usize {
        self.x.len().saturating_sub(LANES)
    }

    /// Number of living markers, and how many of them attract a node.
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

    /// Calls `visit` with the position, squared distance to the nearest crack and impact of each living marker.
    #[cfg(test)]
    pub(super) fn each_living(&self, mut visit: impl FnMut(Vec2, f32, u32)) {
        for i in (0..self.x.len()).filter(|&i| self.near_sq[i] > DEAD) {
            visit(Vec2::new(self.x[i], self.y[i]), self.near_sq[i], self.owner[i]);
        }
    }

    /// Positions and owners of the unsettled markers.
    #[cfg(test)]
    pub(super) fn unsettled(&self) -> impl Iterator<Item = (Vec2, u32)> {
        self.newborn.iter().map(|marker| (marker.pos, marker.owner))
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
const fn is_ray(owner: u32) -> bool {
    owner != ANY_IMPACT && owner & RAY != 0
}

/// The squared distance within which a marker is removed.
fn kill_sq(params: &GrowthParams) -> f32 {
    let finest = if params.venation == Venation::Subdivision { 1.0 + params.focus } else { 1.0 };
    (params.kill_distance / finest) * (params.kill_distance / finest)
}

/// Reserves memory for `n` values and writes it once: the first write causes page faults.
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
