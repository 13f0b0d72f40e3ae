//! The coast of an island: [`coast`].

use super::{terrain_noise::RowNoise, trace::outlines};
use crate::{
    Grid,
    math::{Rng, ops},
    pattern::SurfaceFrame,
};
use glam::{UVec2, Vec2};
use std::f32::consts::TAU;

/// Texels of the shorter side of the field whose outline is the coast.
const FINE: f32 = 192.0;

/// Most pieces of land: the island and what lies off its coast.
const PIECES: usize = 5;

/// Area of the smallest piece of land, square pattern units.
const LEAST_AREA: f32 = 0.0006;

/// The closed coast lines of an island around the middle, the largest first: headlands, bays and islets.
///
/// Some stretches of the coast are smooth, others ragged.
pub(super) fn coast(extent: Vec2, rng: &mut Rng) -> Vec<Vec<Vec2>> {
    let size = (extent / extent.min_element() * FINE).min(Vec2::splat(8.0 * FINE)).as_uvec2().max(UVec2::ONE);
    let Ok(frame) = SurfaceFrame::new(size) else { return Vec::new() };
    let field = field(&frame, rng);
    let scale = extent.min_element();
    // A long surface has its island in the middle.
    let shift = 0.5 * (extent - scale * frame.extent());
    let mut lines = outlines(&field, 0.0).unwrap_or_default();
    lines.retain(|line| area(line) > LEAST_AREA);
    lines.sort_by(|a, b| area(b).total_cmp(&area(a)));
    lines.truncate(PIECES);
    lines.into_iter().map(|line| line.into_iter().map(|point| point * scale + shift).collect()).collect()
}

/// Above 0 on land. It falls with the distance from the middle, and noise makes it uneven.
fn field(frame: &SurfaceFrame, rng: &mut Rng) -> Grid<f32> {
    let size = frame.size();
    let mut noise =
        |scale: f32, octaves, persistence| RowNoise::new(size.x as usize, [scale * FINE; 2], octaves, persistence, rng);
    let mut noises =
        [noise(0.4, 2, 0.5), noise(0.4, 2, 0.5), noise(0.36, 3, 0.45), noise(0.085, 4, 0.62), noise(0.3, 1, 0.5)];
    let axis = ops::unit(TAU * rng.unit());
    let long = rng.range(1.15, 1.5);
    let middle = 0.5 * frame.extent();
    let mut rows: [Vec<f32>; 5] = std::array::from_fn(|_| vec![0.0; size.x as usize]);
    let mut out = Grid::new(size, 0.0);
    for y in 0..out.height() {
        for (noise, row) in noises.iter_mut().zip(&mut rows) {
            noise.fill_row(y, row);
        }
        for (x, out) in out.row_mut(y).iter_mut().enumerate() {
            let [aside, down, broad, fine, ragged] = std::array::from_fn(|i| rows[i][x]);
            let off = frame.to_pos(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)) - middle;
            let bent = off + 0.1 * Vec2::new(aside, down);
            let along = Vec2::new(bent.dot(axis) / long, bent.perp_dot(axis) * long.sqrt());
            let far = along.length() / 0.33;
            let edge = border((off + 0.06 * Vec2::new(down, aside)) / middle, off / middle);
            let ragged = (0.5 + 1.3 * ragged).clamp(0.08, 1.0);
            *out = 1.0 - far * far.sqrt() + 0.75 * broad + 0.3 * ragged * fine - edge;
        }
    }
    out
}

/// How much lower the field is near the border, so that nothing reaches it. Places are in units of the way from the middle
/// to the border; those that are bent make a rounded, uneven edge.
fn border(bent: Vec2, place: Vec2) -> f32 {
    let squares = bent * bent;
    let rounded = squares.length().sqrt();
    let soft = ((rounded - 0.55) / 0.45).max(0.0);
    let hard = ((place.abs().max_element() - 0.85) / 0.1).clamp(0.0, 1.0);
    1.5 * soft * soft + 3.0 * hard * hard
}

fn area(line: &[Vec2]) -> f32 {
    let next = line.iter().cycle().skip(1);
    0.5 * line.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f32>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All seeds make one large island, in the middle of surfaces of all shapes, that keeps off their borders.
    #[test]
    fn there_is_an_island() {
        for seed in 0..60 {
            let extent = [[1.0, 1.0], [1.5, 1.0], [1.0, 3.0], [20.0, 1.0]][seed as usize % 4].into();
            let lines = coast(extent, &mut Rng::new(seed));
            let areas: Vec<_> = lines.iter().map(|line| area(line)).collect();
            assert!(
                (1..=PIECES).contains(&areas.len()) && areas[0] > 0.1 && areas.is_sorted_by(|a, b| a >= b),
                "{seed} {areas:?}"
            );
            let is_inside = |point: &Vec2| ((*point - 0.5 * extent).abs() / extent).max_element() < 0.48;
            assert!(lines.iter().flatten().all(is_inside), "{seed}");
        }
    }
}
