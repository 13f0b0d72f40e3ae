//! Plates: which closed cell each texel lies in.

use super::noise::noise;
use crate::{
    Grid,
    math::mix,
    pattern::{CellTracker, Closing, Moment, Network, SurfaceFrame, Timeline},
    raster::TexelRect,
};
use glam::{UVec2, Vec2};

/// At most this many cells are told apart.
const MAX_PLATES: usize = u16::MAX as usize;

/// The properties of a closed cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plate {
    /// Centre, texels.
    pub(crate) centre: Vec2,
    /// Inverse of the side of a square of the same area, 1 / texels.
    pub(crate) inv_side: f32,
    /// Closeness to the hit that caused it: 1 at the hit, towards 0 far away.
    pub(crate) near: f32,
    /// Distance of that hit, pattern units, divided by the root of its energy.
    pub(crate) away: f32,
    /// Largest distance of its outline from the centre, texels.
    pub(crate) extent: f32,
    /// Random numbers, -1..=1.
    pub(crate) draws: [f32; 6],
    /// Random numbers that vary smoothly from plate to plate.
    pub(crate) common: [f32; 3],
}

/// Bumps per pattern unit of the noise that neighbouring plates share.
const BUNDLES: f32 = 7.0;

/// The plates of a field, added as cells close.
#[derive(Clone, Debug)]
pub(crate) struct PlateField {
    frame: SurfaceFrame,
    seed: u64,
    cells: CellTracker,
    /// Per texel the number of the plate that it belongs to, 0 = none.
    ids: Grid<u16>,
    /// The plates that are shown; entry 0 means no plate.
    plates: Vec<Plate>,
    /// Number of plates of the removed part, and of cells that were closed by then.
    frozen: usize,
    skipped: usize,
    crossings: Vec<(u32, f32)>,
    /// Position of each impact and the energy of its first hit, from this many hits.
    hits: Vec<(Vec2, f32)>,
    strikes: usize,
    /// Texels that were written.
    written: u64,
    /// Distance from a plate at which its side is visible, texels.
    beyond: u32,
}

/// Distance from a plate at which its side is visible, texels.
pub(crate) fn beyond(thick: f32, frame: SurfaceFrame) -> u32 {
    if thick > 0.0 { (thick.min(0.02) * frame.texels_per_unit()).ceil() as u32 + 2 } else { 0 }
}

impl PartialEq for PlateField {
    fn eq(&self, other: &Self) -> bool {
        self.ids == other.ids && self.plates == other.plates
    }
}

impl PlateField {
    pub(super) fn new(frame: SurfaceFrame, seed: u64, thick: f32) -> Self {
        let none = Plate {
            centre: Vec2::ZERO,
            inv_side: 0.0,
            near: 0.0,
            away: 0.0,
            extent: 0.0,
            draws: [0.0; 6],
            common: [0.0; 3],
        };
        Self {
            frame,
            seed,
            cells: CellTracker::recording(frame.extent()),
            ids: Grid::new(frame.size(), 0),
            plates: vec![none],
            frozen: 0,
            skipped: 0,
            crossings: Vec::new(),
            hits: Vec::new(),
            strikes: 0,
            written: 0,
            beyond: beyond(thick, frame),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.plates.len() <= 1
    }

    pub(crate) fn ids(&self) -> &Grid<u16> {
        &self.ids
    }

    pub(crate) fn plates(&self) -> &[Plate] {
        &self.plates
    }

    /// Texels that were written so far.
    #[cfg(test)]
    pub(crate) fn written(&self) -> u64 {
        self.written
    }

    /// Shows the cells that have closed by the end of the last whole step at `moment`.
    pub(super) fn show(
        &mut self,
        network: &Network,
        timeline: &Timeline,
        moment: Moment,
        forbidden: Option<&Grid<bool>>,
        changed: &mut Vec<TexelRect>,
    ) {
        let new = timeline.strikes().get(self.strikes..).unwrap_or_default();
        self.strikes += new.len();
        self.hits.extend(new.iter().filter(|strike| strike.before == 0.0).map(|strike| (strike.pos, strike.energy)));
        self.cells.follow(network, timeline);
        let cells = std::mem::replace(&mut self.cells, CellTracker::new(Vec2::ZERO));
        if let Some(closings) = cells.closings() {
            let all = closings.all().get(self.skipped..).unwrap_or_default();
            let count = all.partition_point(|closing| closing.birth <= moment.whole());
            let count = count.min((MAX_PLATES - 1).saturating_sub(self.frozen));
            while self.shown() > count {
                let last = self.shown() - 1;
                let to = self.host(&all[last]);
                let from = (self.frozen + last + 1) as u16;
                let rect = self.fill(closings.outline(&all[last]), |id| id == from, to, None);
                changed.push(rect.grow(self.beyond, self.ids.size()));
                self.plates.pop();
            }
            for closing in all.get(self.shown()..count).unwrap_or_default() {
                let (host, frozen) = (self.host(closing), self.frozen as u16);
                let id = self.plates.len() as u16;
                self.plates.push(self.plate(closing, closings.outline(closing)));
                let is_host = |of: u16| of == host || (host == 0 && of <= frozen);
                let rect = self.fill(closings.outline(closing), is_host, id, forbidden);
                changed.push(rect.grow(self.beyond, self.ids.size()));
            }
        }
        self.cells = cells;
    }

    /// Number of shown plates that do not belong to a removed part.
    fn shown(&self) -> usize {
        self.plates.len() - 1 - self.frozen
    }

    /// The plate from which a cell was cut off.
    fn host(&self, closing: &Closing) -> u16 {
        match (closing.host as usize).checked_sub(self.skipped) {
            None | Some(0) => 0,
            Some(cell) => (self.frozen + cell) as u16,
        }
    }

    /// Keeps what is shown and continues with the cells of the remaining network.
    pub(super) fn freeze(&mut self, cells: CellTracker) {
        self.cells = cells;
        self.frozen = self.plates.len() - 1;
        self.skipped = self.cells.closings().map_or(0, |closings| closings.all().len());
    }

    fn plate(&self, closing: &Closing, outline: &[Vec2]) -> Plate {
        let unit = self.frame.texels_per_unit();
        let hit = self.hits.get(closing.impact as usize);
        let near = hit.map_or(0.0, |(hit, _)| 1.0 / (1.0 + 6.0 * hit.distance(closing.centroid)));
        let away = hit.map_or(0.0, |(hit, energy)| hit.distance(closing.centroid) / energy.max(1.0e-6).sqrt());
        let extent = outline.iter().map(|pos| pos.distance(closing.centroid)).fold(0.0, f32::max);
        let common = [1u32, 2, 3].map(|k| {
            let place = BUNDLES * closing.centroid;
            (1.6 * noise(self.seed as u32 ^ k, place.x, place.y)).clamp(-1.0, 1.0)
        });
        let mut state = mix(self.seed ^ mix(self.plates.len() as u64));
        let draws = std::array::from_fn(|_| {
            state = mix(state);
            (state >> 40) as f32 * (2.0 / 16_777_215.0) - 1.0
        });
        let side = (closing.area.max(0.0).sqrt() * unit).max(1.0);
        let centre = closing.centroid * unit;
        Plate { centre, inv_side: 1.0 / side, near, away, extent: extent * unit, draws, common }
    }

    /// Writes `to` on the texels of the plate `from` whose centre is inside an outline (even-odd); returns their
    /// rectangle.
    fn fill(
        &mut self,
        outline: &[Vec2],
        from: impl Fn(u16) -> bool,
        to: u16,
        forbidden: Option<&Grid<bool>>,
    ) -> TexelRect {
        let size = self.ids.size();
        let last = size.y as f32;
        self.crossings.clear();
        for (i, &a) in outline.iter().enumerate() {
            let b = outline[(i + 1) % outline.len()];
            let (a, b) = (self.frame.to_texel(a), self.frame.to_texel(b));
            // The same numbers in both directions of an edge, so that neighbours agree on the side of every texel.
            let (a, b) = if (a.y, a.x) <= (b.y, b.x) { (a, b) } else { (b, a) };
            let (top, bottom) = ((a.y + 0.5).floor().clamp(0.0, last), (b.y + 0.5).floor().clamp(0.0, last));
            for y in top as u32..bottom as u32 {
                let share = (y as f32 + 0.5 - a.y) / (b.y - a.y);
                self.crossings.push((y, a.x + (b.x - a.x) * share));
            }
        }
        self.crossings.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut rect = TexelRect::default();
        for pair in self.crossings.as_chunks::<2>().0 {
            let [(y, left), (_, right)] = *pair;
            let column = |x: f32| (x + 0.5).floor().clamp(0.0, size.x as f32) as usize;
            let (x0, x1) = (column(left), column(right));
            if x0 >= x1 {
                continue;
            }
            let row = &mut self.ids.row_mut(y as usize)[x0..x1];
            let barred = forbidden.map(|forbidden| &forbidden.row(y as usize)[x0..x1]);
            for (i, id) in row.iter_mut().enumerate() {
                if from(*id) && !barred.is_some_and(|barred| barred[i]) {
                    *id = to;
                }
            }
            self.written += (x1 - x0) as u64;
            rect = rect.union(TexelRect { min: UVec2::new(x0 as u32, y), max: UVec2::new(x1 as u32, y + 1) });
        }
        rect
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{math::Rng, pattern::random::planar_network};

    fn field(size: UVec2) -> PlateField {
        PlateField::new(SurfaceFrame::new(size).unwrap(), 3, 0.0)
    }

    /// A network with only the nodes and links up to step `birth`, and its timeline: each belongs to the step after.
    fn up_to(network: &Network, birth: u32) -> (Network, Timeline) {
        let (mut part, mut timeline) = (network.clone(), Timeline::default());
        part.nodes.retain(|node| node.birth <= birth);
        part.links.retain(|link| link.birth <= birth);
        for now in 0..=birth {
            timeline.begin(now + 1);
            part.nodes.iter().filter(|node| node.birth == now).for_each(|node| timeline.add_node(node.width));
            part.links.iter().filter(|link| link.birth == now).for_each(|_| timeline.add_link());
        }
        (part, timeline)
    }

    /// Every texel lies in the cell that the tracker finds at its centre, and every cell has cost its own area once.
    #[test]
    fn plates_are_the_cells_and_cost_their_area_once() {
        let mut rng = Rng::new(31);
        let mut closed = 0;
        for round in 0..30 {
            let size = UVec2::new(90 + 7 * (round % 3), 70);
            let frame = SurfaceFrame::new(size).unwrap();
            let network = planar_network(60, frame.extent(), &mut rng);
            let last = network.nodes().iter().map(|node| node.birth).max().unwrap_or(0);
            let (mut steps, mut plates) = (Vec::new(), field(size));
            for step in 0..=last {
                let before = (plates.written(), plates.ids.clone());
                let (part, timeline) = up_to(&network, step);
                plates.show(&part, &timeline, Moment::after(step + 1), None, &mut Vec::new());
                let written = plates.written() - before.0;
                let others = plates.ids.as_slice().iter().zip(before.1.as_slice()).filter(|(a, b)| a != b).count();
                let area: f32 =
                    plates.cells.closings().unwrap().all().iter().filter(|c| c.birth == step + 1).map(|c| c.area).sum();
                let area = area * frame.texels_per_unit() * frame.texels_per_unit();
                // Islands inside were cells of their own before.
                assert!(written >= others as u64, "step {step}");
                assert!((written as f32) < 1.1 * area + 60.0, "step {step}: {written} texels of {area}");
                steps.push(plates.ids.clone());
            }
            closed += plates.plates.len() - 1;
            let mut tracker = CellTracker::new(frame.extent());
            tracker.update(&network);
            let mut wrong = 0;
            for y in 0..size.y {
                for x in 0..size.x {
                    let centre = frame.to_pos(UVec2::new(x, y).as_vec2() + 0.5);
                    wrong += usize::from(tracker.cell_at(centre) != plates.ids.get(x, y).map(u32::from));
                }
            }
            // A centre on a crack may be counted to either side.
            assert!(wrong <= 4, "{wrong} texels are in another cell");
            let (_, timeline) = up_to(&network, last);
            // Back and forth, in any steps, and all at once.
            for _ in 0..12 {
                let step = rng.next_u32() % (last + 1);
                plates.show(&network, &timeline, Moment::after(step + 1), None, &mut Vec::new());
                assert!(plates.ids == steps[step as usize], "step {step}");
            }
            let mut at_once = field(size);
            at_once.show(&network, &timeline, Moment::after(last + 1), None, &mut Vec::new());
            assert!(at_once.ids == steps[last as usize]);
            plates.show(&network, &timeline, Moment::START, None, &mut Vec::new());
            assert!(plates.ids.as_slice().iter().all(|&id| id == 0), "something is left at the start");
        }
        assert!(closed > 100, "{closed} cells");
    }
}
