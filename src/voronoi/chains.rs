//! Lines that go on through vertices: [`chains`].
//!
//! Where three lines meet, two of them are one crack that goes on, and the third one begins at its side. So a stroke of a
//! letter runs past the thin cracks at its sides, and out into one of those at its end.

use glam::Vec2;

/// A line between two vertices with path costs along it.
pub(super) struct LineCosts {
    pub(super) ends: [usize; 2],
    /// Positions, texels, without those of the vertices.
    pub(super) places: Vec<Vec2>,
    /// Path costs there, in β, reduced away from the guides.
    pub(super) costs: Vec<f32>,
    /// Values of the guides there, 0..=1.
    pub(super) inside: Vec<f32>,
}

impl LineCosts {
    /// Mean cost within `reach` of the first or last place along the line, texels, and the direction there from `vertex`.
    fn beginning(&self, end: usize, vertex: Vec2, reach: f32) -> (f32, Vec2) {
        let (mut far, mut sum, mut n, mut last) = (0.0, 0.0, 0.0f32, None::<Vec2>);
        for k in 0..self.places.len() {
            let i = if end == 0 { k } else { self.places.len() - 1 - k };
            far += last.map_or(0.0, |last| last.distance(self.places[i]));
            if far > reach {
                break;
            }
            sum += self.costs[i];
            n += 1.0;
            last = Some(self.places[i]);
        }
        (sum / n.max(1.0), (last.unwrap_or(vertex) - vertex).normalize_or_zero())
    }
}

/// A line of a chain, and whether the chain runs along it from its second end.
pub(super) type Member = (usize, bool);

/// Joins lines to chains; each line is in one of them. `reach` is how far lines are looked at from each vertex, texels.
pub(super) fn chains(lines: &[LineCosts], vertices: &[Vec2], reach: &[f32]) -> Vec<Vec<Member>> {
    let mut at_vertex = vec![Vec::new(); vertices.len()];
    for (i, line) in lines.iter().enumerate() {
        for (end, &vertex) in line.ends.iter().enumerate() {
            at_vertex[vertex].push((i, end));
        }
    }
    // For each end of each line the end that goes on from it.
    let mut next: Vec<[Option<(usize, usize)>; 2]> = vec![[None; 2]; lines.len()];
    for ((ends, vertex), reach) in at_vertex.iter().zip(vertices).zip(reach) {
        if let Some((a, b)) = straightest(lines, ends, *vertex, *reach) {
            next[a.0][a.1] = Some(b);
            next[b.0][b.1] = Some(a);
        }
    }
    let mut seen = vec![false; lines.len()];
    let mut all = Vec::new();
    // Chains with two ends, then rings.
    for rings in [false, true] {
        for first in 0..lines.len() {
            let Some(end) = (0..2).find(|end| rings || next[first][*end].is_none()) else { continue };
            let mut chain = Vec::new();
            let mut here = Some((first, end));
            while let Some((line, end)) = here
                && !seen[line]
            {
                seen[line] = true;
                chain.push((line, end == 1));
                here = next[line][1 - end];
            }
            if !chain.is_empty() {
                all.push(chain);
            }
        }
    }
    all
}

/// The two ends at a vertex that are one crack: expensive ones, in a line.
fn straightest(
    lines: &[LineCosts],
    ends: &[(usize, usize)],
    vertex: Vec2,
    reach: f32,
) -> Option<((usize, usize), (usize, usize))> {
    let of: Vec<(f32, Vec2)> = ends.iter().map(|&(line, end)| lines[line].beginning(end, vertex, reach)).collect();
    let most = of.iter().map(|(cost, _)| *cost).fold(1.0e-6, f32::max);
    let mut best = (f32::MIN, None);
    for i in 0..of.len() {
        for j in i + 1..of.len() {
            // Of lines that are alike in cost the straighter ones, otherwise the more expensive ones.
            let score = of[i].0.min(of[j].0) / most - 0.5 * of[i].1.dot(of[j].1);
            if score > best.0 {
                best = (score, Some((ends[i], ends[j])));
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Rng, ops};

    fn line(ends: [usize; 2], vertices: &[Vec2], cost: f32) -> LineCosts {
        let [from, to] = ends.map(|end| vertices[end]);
        let places: Vec<Vec2> = (1..10).map(|i| from.lerp(to, i as f32 / 10.0)).collect();
        LineCosts { ends, costs: vec![cost; places.len()], inside: vec![1.0; places.len()], places }
    }

    /// A stroke that bends a little at each vertex, cheap lines at its sides, and two of them at its end.
    #[test]
    fn strokes_pass_cheap_lines() {
        let vertices = [[0.0, 0.0], [20.0, 1.0], [40.0, -1.0], [21.0, 20.0], [39.0, -20.0], [58.0, 8.0], [52.0, -18.0]];
        let vertices = vertices.map(Vec2::from_array);
        let lines = [([1, 0], 9.0), ([1, 2], 8.0), ([3, 1], 1.0), ([2, 4], 1.0), ([2, 5], 2.0), ([6, 2], 1.9)];
        let lines: Vec<LineCosts> = lines.into_iter().map(|(ends, cost)| line(ends, &vertices, cost)).collect();
        let mut all = chains(&lines, &vertices, &[12.0; 7]);
        all.sort_by_key(Vec::len);
        let stroke = all.pop().unwrap();
        let forward = [(0, true), (1, false), (4, false)];
        let back: Vec<Member> = forward.iter().rev().map(|&(i, reversed)| (i, !reversed)).collect();
        assert!(stroke == forward || stroke == back, "{stroke:?}");
        assert!(all.iter().all(|chain| chain.len() == 1), "{all:?}");
    }

    /// Each line is in one chain, lines of a chain follow one another, and rings come to an end.
    #[test]
    fn lines_are_in_one_chain() {
        let mut rng = Rng::new(3);
        for n in 1..200usize {
            let vertices: Vec<Vec2> = (0..1 + n / 3).map(|_| 90.0 * Vec2::new(rng.unit(), rng.unit())).collect();
            let mut end = || (rng.next_u32() as usize) % vertices.len();
            let ends: Vec<[usize; 2]> = (0..n).map(|_| [end(), end()]).collect();
            let mut lines: Vec<LineCosts> =
                ends.into_iter().map(|ends| line(ends, &vertices, 1.0 + rng.unit())).collect();
            let ring: Vec<Vec2> = (0..12).map(|i| 20.0 * ops::unit(i as f32 / 2.0)).collect();
            lines.push(LineCosts { ends: [0, 0], costs: vec![1.0; 12], inside: vec![0.0; 12], places: ring });
            lines.push(LineCosts { ends: [0, 0], costs: Vec::new(), inside: Vec::new(), places: Vec::new() });
            let all = chains(&lines, &vertices, &vec![5.0; vertices.len()]);
            let mut seen: Vec<usize> = all.iter().flatten().map(|(i, _)| *i).collect();
            seen.sort_unstable();
            assert!(seen.into_iter().eq(0..lines.len()));
            for pair in all.iter().flat_map(|chain| chain.windows(2)) {
                let [(a, a_reversed), (b, b_reversed)] = [pair[0], pair[1]];
                assert_eq!(lines[a].ends[usize::from(!a_reversed)], lines[b].ends[usize::from(b_reversed)]);
            }
        }
    }
}
