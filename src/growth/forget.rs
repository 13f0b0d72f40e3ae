//! Removes the oldest cracks, so that a surface can be hit any number of times.

use super::{arrest::Arrest, nodes::NodeGrid, state::CrackGrowth};
use crate::pattern::{NO_IMPACT, SegmentId};

impl CrackGrowth {
    /// How many more nodes can grow before the surface has [`max_nodes`](super::GrowthParams::max_nodes) of them.
    #[must_use]
    pub fn nodes_left(&self) -> u32 {
        u32::try_from(self.room()).unwrap_or(u32::MAX)
    }

    /// Removes the oldest nodes, so that at most the newest `keep` are left and there is room for others. Returns how
    /// many were removed: the numbers of the remaining nodes decrease by that.
    ///
    /// Segments with an end among the removed nodes are removed too; the others keep their lines bit for bit. Removed
    /// cracks that were drawn stay visible: they are *frozen*. New cracks neither grow from them nor stop at them,
    /// they close no cells, and the [`timeline`](Self::timeline) no longer contains them. Growth that is in progress
    /// continues from the remaining nodes. New and wider segments should be [taken](Self::take_changed) before the
    /// call.
    ///
    /// ```
    /// use bevy_crack::growth::{CrackGrowth, GrowthParams};
    ///
    /// let mut growth = CrackGrowth::new(GrowthParams { max_nodes: 500, ..GrowthParams::DEFAULT }, [1.0, 1.0].into(), 7)?;
    /// for i in 0..20 {
    ///     if growth.nodes_left() < 250 {
    ///         growth.remove_oldest(250);
    ///     }
    ///     growth.hit([0.05 * i as f32, 0.3].into(), 1.0);
    ///     while growth.step().grew() {}
    /// }
    /// assert!(growth.network().nodes().len() <= 500);
    /// # Ok::<(), bevy_crack::growth::ParamError>(())
    /// ```
    pub fn remove_oldest(&mut self, keep: u32) -> u32 {
        self.finish();
        let first = self.network.nodes.len().saturating_sub(keep as usize);
        if first == 0 {
            return 0;
        }
        self.record.removal(keep);
        // Nodes that have grown from added cracks may not belong to an impact either.
        let foreign = self.network.nodes[..first].iter().filter(|node| node.impact == NO_IMPACT).count();
        self.added = self.added.saturating_sub(foreign);
        let forgotten = first as u32;
        let links = self.network.forget(forgotten);
        let number = |node: u32| node.checked_sub(forgotten);
        self.timeline.forget(forgotten, &links);
        self.changes.forget(&self.network.nodes, |segment| match segment {
            SegmentId::Branch(node) => number(node).map(SegmentId::Branch),
            SegmentId::Link(link) => links.binary_search(&link).ok().map(|link| SegmentId::Link(link as u32)),
        });
        self.links_reported = self.network.links.len() as u32;
        self.nodes = NodeGrid::new(self.network.extent(), 2.0 * self.params.step_length.max(self.params.kill_distance));
        for node in &self.network.nodes {
            self.nodes.push(node.pos);
        }
        self.widths.forget(self.network.nodes.len());
        self.linker.forget(forgotten);
        self.rays.forget(forgotten);
        self.strands.iter_mut().for_each(|strands| strands.forget(forgotten));
        self.field.ray_of.drain(..first.min(self.field.ray_of.len()));
        self.pull_of.drain(..first);
        self.courses.drain(..first);
        if let Some(division) = &mut self.division {
            division.forget(forgotten);
        }
        self.unshown = self.unshown.iter().filter_map(|&node| number(node)).collect();
        self.new_nodes = self.new_nodes.start.saturating_sub(forgotten)..self.new_nodes.end.saturating_sub(forgotten);
        if let Some(before) = self.arrest.take() {
            self.arrest = Some(Arrest::after(before, &self.network, self.params.step_length, forgotten));
        }
        // Every marker searches for its nodes again. Markers of an impact without remaining nodes can no longer be
        // reached.
        let mut is_left = vec![false; self.impacts.len()];
        for node in &self.network.nodes {
            if let Some(is_left) = is_left.get_mut(node.impact as usize) {
                *is_left = true;
            }
        }
        let is_over = !self.is_growing();
        let Self { field, rays, params, .. } = self;
        field.forget_dead(params, |owner| {
            let impact = rays.impact_of(owner).unwrap_or(owner);
            is_over || is_left.get(impact as usize) == Some(&false)
        });
        forgotten
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        CrackPreset,
        growth::{CrackGrowth, GrowthParams, HitOutcome},
        math::Rng,
        pattern::{CellTracker, Moment, NO_PARENT, Network, SegmentId, SegmentPath},
    };
    use glam::Vec2;
    use std::collections::BTreeMap;

    /// Every line by where it begins and ends.
    fn lines(
        network: &Network,
        timeline: impl Fn(SegmentId) -> Option<SegmentPath>,
    ) -> BTreeMap<[u32; 5], Vec<String>> {
        let mut lines = BTreeMap::<_, Vec<_>>::new();
        for segment in network.segments() {
            let (a, b) = network.ends(segment).unwrap();
            let [a, b] = [a, b].map(|node| network.nodes()[node as usize].pos);
            let kind = u32::from(matches!(segment, SegmentId::Link(_)));
            let key = [kind, a.x.to_bits(), a.y.to_bits(), b.x.to_bits(), b.y.to_bits()];
            let line = lines.entry(key).or_default();
            line.push(format!("{:?}", timeline(segment)));
            line.sort();
        }
        lines
    }

    #[test]
    fn what_is_left_stays_as_it_was() {
        let mut rng = Rng::new(31);
        for name in CrackPreset::NAMES {
            let params = CrackPreset::named(name).unwrap().growth;
            for seed in 0..4 {
                let mut growth = CrackGrowth::new(params.clone(), Vec2::ONE, seed).unwrap();
                for _ in 0..3 {
                    growth.hit(Vec2::new(rng.unit(), rng.unit()), 0.5);
                    // Also while it grows.
                    for _ in 0..rng.next_u32() % 60 {
                        growth.step();
                    }
                }
                let moments = [0.3, 0.7, 1.0].map(|share| Moment::nearest(share * f64::from(growth.timeline().end())));
                let before = growth.clone();
                let keep = rng.next_u32() % growth.network().nodes().len() as u32;
                let gone = growth.remove_oldest(keep);
                assert_eq!(growth.network().nodes().len() as u32, keep);
                assert_eq!(gone + keep, before.network().nodes().len() as u32, "{name}");
                for moment in moments {
                    let all = lines(before.network(), |id| before.timeline().path_at(before.network(), id, moment));
                    let left = lines(growth.network(), |id| growth.timeline().path_at(growth.network(), id, moment));
                    assert!(left.iter().all(|(key, line)| all.get(key) == Some(line)), "{name} {seed}");
                    // All of them: those without an end among the forgotten.
                    let ends = before.network().segments().filter_map(|segment| before.network().ends(segment));
                    assert_eq!(
                        left.values().map(Vec::len).sum::<usize>(),
                        ends.filter(|(a, b)| *a.min(b) >= gone).count()
                    );
                }
                let census = growth.marker_counts();
                assert_eq!(census.total, census.killed + census.attracting + census.waiting);
                // It is taken in small bites as it is at once.
                let mut twice = before.clone();
                twice.remove_oldest(keep + gone / 2);
                twice.remove_oldest(keep);
                assert_eq!(twice.network().nodes(), growth.network().nodes());
                assert_eq!(twice.network().links(), growth.network().links());
                while growth.step().grew() {}
                let nodes = growth.network().nodes();
                assert!((0u32..).zip(nodes).all(|(i, node)| node.parent == NO_PARENT || node.parent < i));
                let mut cells = CellTracker::new(Vec2::ONE);
                cells.update(growth.network());
            }
        }
    }

    #[test]
    fn changes_that_were_not_taken_are_not_lost() {
        let mut growth = CrackGrowth::new(CrackPreset::MUD.growth, Vec2::ONE, 3).unwrap();
        growth.hit(Vec2::splat(0.5), 1.0);
        for _ in 0..30 {
            growth.step();
        }
        growth.take_changed(&mut Vec::new());
        for _ in 0..30 {
            growth.step();
        }
        let mut before = Vec::new();
        growth.clone().take_changed(&mut before);
        let place = |network: &Network, segment| {
            let (a, b) = network.ends(segment).unwrap();
            [a, b].map(|node| network.nodes()[node as usize].pos.to_array().map(f32::to_bits))
        };
        let network = growth.network().clone();
        let gone = growth.remove_oldest(network.nodes().len() as u32 / 2);
        let is_left = |segment: &SegmentId| network.ends(*segment).is_some_and(|(a, b)| a.min(b) >= gone);
        let expected: Vec<_> = before.into_iter().filter(is_left).map(|segment| place(&network, segment)).collect();
        let mut after = Vec::new();
        growth.take_changed(&mut after);
        assert!(expected.len() > 20);
        assert_eq!(after.into_iter().map(|segment| place(growth.network(), segment)).collect::<Vec<_>>(), expected);
    }

    #[test]
    fn foreign_cracks_and_what_has_grown_from_them_are_forgotten_too() {
        for (seed, arrest) in [(1, 0.0), (2, 0.0), (3, 0.05)] {
            let params = GrowthParams { max_nodes: 300, arrest, ..GrowthParams::DEFAULT };
            let mut foreign = CrackGrowth::new(GrowthParams { reach: 0.2, ..params.clone() }, Vec2::ONE, seed).unwrap();
            foreign.hit(Vec2::splat(0.5), 1.0);
            while foreign.step().grew() {}
            let mut growth = CrackGrowth::new(params, Vec2::ONE, seed).unwrap();
            growth.add_cracks(foreign.network(), 0);
            let mut rng = Rng::new(seed);
            for _ in 0..30 {
                if growth.nodes_left() < 150 {
                    growth.remove_oldest(150);
                }
                growth.hit(Vec2::new(rng.unit(), rng.unit()), 1.0);
                while growth.step().grew() {}
                assert!(growth.network().nodes().len() <= 300 + foreign.network().nodes().len());
            }
            growth.remove_oldest(0);
            assert!(growth.network().nodes().is_empty() && growth.nodes_left() == 300);
        }
    }

    #[test]
    fn a_surface_may_be_hit_for_ever() {
        for name in CrackPreset::NAMES {
            let params = GrowthParams { max_nodes: 600, ..CrackPreset::named(name).unwrap().growth };
            let mut growth = CrackGrowth::new(params, Vec2::ONE, 5).unwrap();
            let mut rng = Rng::new(8);
            let mut frozen = 0;
            for _ in 0..400 {
                if growth.nodes_left() < 300 {
                    frozen += growth.remove_oldest(300);
                }
                let outcome = growth.hit(Vec2::new(rng.unit(), rng.unit()), 0.3);
                assert!(!matches!(outcome, HitOutcome::Rejected(_)), "{name}: {outcome:?}");
                for _ in 0..20 {
                    growth.step();
                }
                assert!(growth.network().nodes().len() <= 600 && growth.marker_counts().waiting < 20_000, "{name}");
            }
            assert!(frozen > 100, "{name}: {frozen}");
        }
    }
}
