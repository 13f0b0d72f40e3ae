//! Contour lines of a height field, by marching squares.

use bevy_crack::{Grid, relief::Ring};
use glam::Vec2;
use std::collections::BTreeMap;

/// The contour lines at `height`, texel coordinates (centers at half-integers).
///
/// What lies outside of the grid counts as lower, so every line is closed. Rings around higher ground have a positive
/// area.
pub(crate) fn contour_lines(heights: &Grid<f32>, height: f32, level: i32) -> Vec<Ring> {
    let (w, h) = (heights.width() as i64, heights.height() as i64);
    let at = |x: i64, y: i64| {
        let is_inside = (0..w).contains(&x) && (0..h).contains(&y);
        if is_inside { heights.row(y as usize)[x as usize] - height } else { -1.0 }
    };
    let is_in = |x, y| at(x, y) >= 0.0;
    // The edges of the lattice of texel centers are numbered: 2 for each place, to the right and down.
    let edge = |x: i64, y: i64, down: bool| ((y + 1) * (w + 2) + x + 1) * 2 + i64::from(down);
    let crossing = |edge: i64| {
        let (place, down) = (edge / 2, edge % 2);
        let (x, y) = (place % (w + 2) - 1, place / (w + 2) - 1);
        let (a, b) = (at(x, y), at(x + 1 - down, y + down));
        let share = (a / (a - b)).clamp(0.001, 0.999);
        Vec2::new(x as f32 + 0.5, y as f32 + 0.5) + share * Vec2::new((1 - down) as f32, down as f32)
    };
    // From edge to edge, with the higher ground to the right as seen with y down.
    let mut next = BTreeMap::new();
    for y in -1..h {
        for x in -1..w {
            let corners = [is_in(x, y), is_in(x + 1, y), is_in(x + 1, y + 1), is_in(x, y + 1)];
            let sides = [edge(x, y, false), edge(x + 1, y, true), edge(x, y + 1, false), edge(x, y, true)];
            // Around the square: a line enters where the corners go from low to high, and leaves where they go back.
            for side in 0..4 {
                if corners[side] && !corners[(side + 1) % 4] {
                    let enter = (1..4).map(|k| (side + k) % 4).find(|&k| !corners[k] && corners[(k + 1) % 4]);
                    if let Some(enter) = enter {
                        next.insert(sides[side], sides[enter]);
                    }
                }
            }
        }
    }
    let mut rings = Vec::new();
    while let Some((&start, _)) = next.first_key_value() {
        let mut points = Vec::new();
        let mut here = start;
        while let Some(to) = next.remove(&here) {
            points.push(crossing(here));
            here = to;
        }
        let mut ring = Ring { points, level };
        ring.points.dedup();
        if ring.points.len() >= 3 {
            rings.push(ring);
        }
    }
    rings
}
