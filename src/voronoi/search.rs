//! Exact shortest paths from all sites at once: [`Search`].
//!
//! Cost and site of a texel are packed into one number, with the cost in the high bits, so that one `min` compares
//! both and a tie goes to the lower site. Rows are swept down and up: each row takes cheaper paths from the row
//! before, then propagates them along itself, right and left. After each sweep paths go over the links of the lattice. The result has the costs of Dijkstra's method, because
//! a row is at rest only if no neighbour offers a cheaper path. Rows are divided into blocks with time stamps, so
//! that a block at rest beside blocks at rest is skipped.

use super::lattice::{Lattice, WALL};
use glam::UVec2;

/// Texels of a block.
pub(super) const BLOCK: usize = 64;

/// Cost and site of a texel in one number.
pub(super) trait Packed: Copy + Ord {
    /// The value of a texel that no path has reached. Adding an edge does not overflow.
    const FAR: Self;
    /// The largest number of sites.
    const MAX_SITES: usize;
    /// The value of the site itself.
    fn site(index: u32) -> Self;
    /// The value one edge further.
    fn plus(self, edge: u16) -> Self;
    /// The index of the site.
    fn index(self) -> u32;
    /// The cost in units.
    fn cost(self) -> u64;
}

/// For up to 256 sites and costs below 32,000 β: 23 bits of cost, 8 of site.
impl Packed for i32 {
    const FAR: Self = Self::MAX - ((WALL as Self) << 8) - 255;
    const MAX_SITES: usize = 1 << 8;

    #[inline(always)]
    fn site(index: u32) -> Self {
        (index & 0xFF) as Self
    }

    #[inline(always)]
    fn plus(self, edge: u16) -> Self {
        self + (Self::from(edge) << 8)
    }

    fn index(self) -> u32 {
        (self & 0xFF) as u32
    }

    fn cost(self) -> u64 {
        (self >> 8) as u64
    }
}

/// For everything else: 47 bits of cost, 16 of site.
impl Packed for i64 {
    const FAR: Self = Self::MAX - ((WALL as Self) << 16) - 0xFFFF;
    const MAX_SITES: usize = 1 << 16;

    #[inline(always)]
    fn site(index: u32) -> Self {
        Self::from(index & 0xFFFF)
    }

    #[inline(always)]
    fn plus(self, edge: u16) -> Self {
        self + (Self::from(edge) << 16)
    }

    fn index(self) -> u32 {
        (self & 0xFFFF) as u32
    }

    fn cost(self) -> u64 {
        (self >> 16) as u64
    }
}

/// One edge further, or [`FAR`](Packed::FAR) through a wall.
#[inline(always)]
fn step<P: Packed, const WALLS: bool>(from: P, edge: u16) -> P {
    if WALLS && edge == WALL { P::FAR } else { from.plus(edge) }
}

#[inline(always)]
fn min<P: Packed>(a: P, b: P) -> P {
    if a < b { a } else { b }
}

/// When a block of a row changed, and when it last took paths from the rows above and below.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Stamps {
    changed: u32,
    looked: [u32; 2],
    /// Whether it must be propagated along its row even if the rows beside it did not change.
    stirred: bool,
}

/// The state of a search, which can pause between any two rows.
#[derive(Clone, Debug)]
pub(super) struct Search<P> {
    size: UVec2,
    field: Vec<P>,
    blocks: usize,
    stamps: Vec<Stamps>,
    /// Whether a block of the current row is to be propagated.
    active: Vec<bool>,
    clock: u32,
    /// The next row of the sweep.
    row: usize,
    upwards: bool,
    /// Whether this sweep has changed anything, and the number of successive sweeps without a change.
    moved: bool,
    quiet: u32,
    /// Sweeps begun since the search was last at rest.
    sweeps: u32,
    /// Texels whose path may have used an edge that became more expensive.
    suspects: Vec<u32>,
    /// The clock when costs were last checked by [`overflows`](Self::overflows).
    checked: u32,
}

impl<P: Packed> Search<P> {
    pub(super) fn new(size: UVec2) -> Self {
        let (w, h) = (size.x as usize, size.y as usize);
        let blocks = w.div_ceil(BLOCK);
        Self {
            size,
            field: vec![P::FAR; w * h],
            blocks,
            stamps: vec![Stamps::default(); blocks * h],
            active: vec![false; blocks],
            clock: 1,
            row: 0,
            upwards: false,
            moved: false,
            quiet: 2,
            sweeps: 0,
            suspects: Vec::new(),
            checked: 0,
        }
    }

    pub(super) fn field(&self) -> &[P] {
        &self.field
    }

    /// Adds a source of paths; of two on one texel the lower index stays.
    pub(super) fn add_site(&mut self, texel: UVec2, index: u32) {
        let i = texel.y as usize * self.size.x as usize + texel.x as usize;
        self.field[i] = min(self.field[i], P::site(index));
        self.stir(texel.x as usize, texel.y as usize);
    }

    /// Whether a path has reached a texel.
    pub(super) fn is_reached(&self, texel: usize) -> bool {
        self.field[texel] < P::FAR
    }

    /// Marks the block of a texel so that it and its neighbours are visited again.
    fn stir(&mut self, x: usize, y: usize) {
        self.stamps[y * self.blocks + x / BLOCK] = Stamps { changed: self.clock, looked: [0; 2], stirred: true };
        self.quiet = 0;
    }

    /// Overwrites the costs of edges of row `y`, from its texels `x0..` to the right or `down`; returns the number of
    /// changed edges. [`reconsider`](Self::reconsider) must follow.
    pub(super) fn take_over(&mut self, edges: &mut [u16], new: &[u16], x0: usize, y: usize, down: bool) -> usize {
        let w = self.size.x as usize;
        let mut n_changed = 0;
        for (x, (edge, &new)) in (x0..).zip(edges.iter_mut().zip(new)) {
            let before = std::mem::replace(edge, new);
            if new == before {
                continue;
            }
            n_changed += 1;
            let (right, below) = if down { (x, y + 1) } else { (x + 1, y) };
            if new < before {
                self.stir(x, y);
                self.stir(right, below);
                continue;
            }
            let ends = [y * w + x, below * w + right];
            for [from, to] in [ends, [ends[1], ends[0]]] {
                if step::<P, true>(self.field[from], before) <= self.field[to] {
                    self.suspects.push(to as u32);
                }
            }
        }
        n_changed
    }

    /// Repairs the search after edges have changed: after further sweeps it is at rest where a new search would be.
    ///
    /// A texel whose path used an edge that became more expensive is reset, and with it every texel whose path may
    /// depend on it; the others stay. No texel can depend on itself, because each step has a cost above zero.
    ///
    /// The lattice must have no links.
    pub(super) fn reconsider(&mut self, lattice: &Lattice) {
        let w = self.size.x as usize;
        while let Some(suspect) = self.suspects.pop() {
            let i = suspect as usize;
            let here = self.field[i];
            if here >= P::FAR || here.cost() == 0 {
                continue;
            }
            // There are walls beyond the border, also between the end of a row and the beginning of the next.
            let around = [
                (i + 1, lattice.edges(i).0),
                (i.wrapping_sub(1), if i > 0 { lattice.edges(i - 1).0 } else { WALL }),
                (i + w, lattice.edges(i).1),
                (i.wrapping_sub(w), if i >= w { lattice.edges(i - w).1 } else { WALL }),
            ];
            let near = around.map(|(j, _)| self.field.get(j).copied().unwrap_or(P::FAR));
            if around.iter().zip(near).any(|(&(_, edge), from)| step::<P, true>(from, edge) <= here) {
                continue;
            }
            for ((j, edge), there) in around.into_iter().zip(near) {
                if there < P::FAR && step::<P, true>(here, edge) <= there {
                    self.suspects.push(j as u32);
                }
            }
            self.field[i] = P::FAR;
            // 32-bit divisions take a third of the time of 64-bit ones.
            self.stir((suspect % self.size.x) as usize, (suspect / self.size.x) as usize);
        }
    }

    /// Whether, since the last call, a cost became too large for `P`: no path has reached a texel that is joined to one that was reached.
    pub(super) fn overflows(&mut self, lattice: &Lattice) -> bool {
        let (w, blocks) = (self.size.x as usize, self.blocks);
        let since = std::mem::replace(&mut self.checked, self.clock);
        let is_cut_off = |i: usize| {
            let around = [
                (Some(i + 1), lattice.edges(i).0),
                (i.checked_sub(1), if i > 0 { lattice.edges(i - 1).0 } else { WALL }),
                (Some(i + w), lattice.edges(i).1),
                (i.checked_sub(w), if i >= w { lattice.edges(i - w).1 } else { WALL }),
            ];
            around.into_iter().any(|(beside, edge)| {
                edge != WALL && beside.is_some_and(|beside| self.field.get(beside).is_some_and(|p| *p < P::FAR))
            })
        };
        let too_far = |(i, stamps): (usize, &Stamps)| {
            let x0 = i % blocks * BLOCK;
            let mut block = i / blocks * w + x0..i / blocks * w + (x0 + BLOCK).min(w);
            (stamps.changed > since || since == 0) && block.any(|i| self.field[i] >= P::FAR && is_cut_off(i))
        };
        let is_reached = |end: u32| self.field[end as usize] < P::FAR;
        self.stamps.iter().enumerate().any(too_far)
            || lattice
                .links()
                .iter()
                .any(|link| link.cost != WALL && is_reached(link.ends[0]) != is_reached(link.ends[1]))
    }

    /// Whether every texel has its cost.
    pub(super) const fn at_rest(&self) -> bool {
        self.quiet >= 2
    }

    /// The progress, 0..=1: estimated from the number of sweeps, of which three or four do most of the work.
    pub(super) fn progress(&self) -> f32 {
        if self.at_rest() {
            return 1.0;
        }
        let height = self.size.y.max(1) as f32;
        let row = if self.upwards { height - self.row as f32 } else { self.row as f32 };
        let sweeps = self.sweeps as f32 + row / height;
        sweeps / (sweeps + 1.0)
    }

    /// Sweeps up to `rows` rows.
    pub(super) fn advance<const WALLS: bool>(&mut self, lattice: &Lattice, rows: usize) {
        let height = self.size.y as usize;
        for _ in 0..rows {
            if self.at_rest() {
                self.sweeps = 0;
                return;
            }
            if self.upwards {
                self.visit::<WALLS>(lattice, self.row, (self.row + 1 < height).then_some(self.row + 1));
            } else {
                self.visit::<WALLS>(lattice, self.row, self.row.checked_sub(1));
            }
            let last = if self.upwards { 0 } else { height - 1 };
            if self.row != last {
                self.row = if self.upwards { self.row - 1 } else { self.row + 1 };
                continue;
            }
            self.upwards = !self.upwards;
            self.sweeps += 1;
            self.moved |= self.follow_links(lattice);
            self.quiet = if self.moved { 0 } else { self.quiet + 1 };
            self.moved = false;
        }
    }

    /// Takes cheaper paths over links; returns whether there were any.
    fn follow_links(&mut self, lattice: &Lattice) -> bool {
        let mut any = false;
        for link in lattice.links() {
            let [a, b] = link.ends.map(|end| end as usize);
            for (from, to) in [(a, b), (b, a)] {
                let by = step::<P, true>(self.field[from], link.cost);
                if by < self.field[to] {
                    self.field[to] = by;
                    any = true;
                    self.stir(to % self.size.x as usize, to / self.size.x as usize);
                }
            }
        }
        any
    }

    /// Sweeps to the end.
    #[cfg(test)]
    pub(super) fn finish<const WALLS: bool>(&mut self, lattice: &Lattice) {
        while !self.at_rest() {
            self.advance::<WALLS>(lattice, 1 << 20);
        }
    }

    /// Takes cheaper paths from row `before` and propagates them along row `y`.
    fn visit<const WALLS: bool>(&mut self, lattice: &Lattice, y: usize, before: Option<usize>) {
        let (w, blocks, side) = (self.size.x as usize, self.blocks, usize::from(self.upwards));
        let mut any = false;
        for b in 0..blocks {
            let stamps = self.stamps[y * blocks + b];
            let mut active = stamps.stirred;
            if let Some(before) = before
                && self.stamps[before * blocks + b].changed > stamps.looked[side]
            {
                self.stamps[y * blocks + b].looked[side] = self.clock;
                let (x0, x1) = (b * BLOCK, ((b + 1) * BLOCK).min(w));
                let (above, below) = self.field.split_at_mut(y.max(before) * w);
                let edges = &lattice.down(y.min(before))[x0..x1];
                active |= if before < y {
                    pull::<P, WALLS>(&mut below[x0..x1], &above[before * w + x0..before * w + x1], edges)
                } else {
                    pull::<P, WALLS>(&mut above[y * w + x0..y * w + x1], &below[x0..x1], edges)
                };
            }
            self.active[b] = active;
            any |= active;
        }
        self.clock += 1;
        if any {
            self.moved = true;
            self.pass_on::<WALLS>(lattice, y);
        }
    }

    /// Propagates along row `y`: within the active blocks, then from block to block as long as that is cheaper.
    fn pass_on<const WALLS: bool>(&mut self, lattice: &Lattice, y: usize) {
        let w = self.size.x as usize;
        let row = &mut self.field[y * w..(y + 1) * w];
        let edges = lattice.across(y);
        let ends = |b: usize| (b * BLOCK, ((b + 1) * BLOCK).min(w));
        for (b, _) in self.active.iter().enumerate().filter(|(_, active)| **active) {
            let (x0, x1) = ends(b);
            both_ways::<P, WALLS>(&mut row[x0..x1], &edges[x0..x1]);
        }
        // Every block is at rest internally now, so that an incoming path ends where it is not the cheaper one.
        for b in 1..self.blocks {
            let (x0, x1) = ends(b);
            let mut from = step::<P, WALLS>(row[x0 - 1], edges[x0 - 1]);
            for (texel, &edge) in row[x0..x1].iter_mut().zip(&edges[x0..x1]) {
                if from >= *texel {
                    break;
                }
                *texel = from;
                self.active[b] = true;
                from = step::<P, WALLS>(from, edge);
            }
        }
        for b in (1..self.blocks).rev() {
            let (x0, x1) = ends(b - 1);
            let mut from = row[x1];
            for (texel, &edge) in row[x0..x1].iter_mut().zip(&edges[x0..x1]).rev() {
                from = step::<P, WALLS>(from, edge);
                if from >= *texel {
                    break;
                }
                *texel = from;
                self.active[b - 1] = true;
            }
        }
        for (b, _) in self.active.iter().enumerate().filter(|(_, active)| **active) {
            let stamps = &mut self.stamps[y * self.blocks + b];
            stamps.changed = self.clock;
            stamps.stirred = false;
        }
    }
}

/// Propagates paths within a block along its row; `edges` lead from each texel to the next.
///
/// No cheapest path turns around within a row, so neither direction needs the other's result. Each direction is a
/// chain of dependent steps: running both at once takes hardly longer than one.
fn both_ways<P: Packed, const WALLS: bool>(row: &mut [P], edges: &[u16]) {
    let n = row.len().min(edges.len());
    let (row, edges) = (&mut row[..n], &edges[..n]);
    let (mut right, mut left) = (P::FAR, P::FAR);
    for i in 0..n {
        let j = n - 1 - i;
        left = min(row[j], if i > 0 { step::<P, WALLS>(left, edges[j]) } else { left });
        row[j] = left;
        right = min(row[i], right);
        row[i] = right;
        right = step::<P, WALLS>(right, edges[i]);
    }
}

/// Takes cheaper paths from `from`; returns whether there were any.
fn pull<P: Packed, const WALLS: bool>(row: &mut [P], from: &[P], edges: &[u16]) -> bool {
    let mut any = 0u8;
    for ((texel, &from), &edge) in row.iter_mut().zip(from).zip(edges) {
        let by = step::<P, WALLS>(from, edge);
        any |= u8::from(by < *texel);
        *texel = min(*texel, by);
    }
    any != 0
}
