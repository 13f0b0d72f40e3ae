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
    let mut lines = outlines(&field, 0.0).unwrap_or_default();
    lines.retain(|line| area(line) > LEAST_AREA);
    lines.sort_by(|a, b| area(b).total_cmp(&area(a)));
    lines.truncate(PIECES);
    lines.into_iter().map(|line| line.into_iter().map(|point| point * scale).collect()).collect()
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
            let off = off + 0.1 * Vec2::new(aside, down);
            let along = Vec2::new(off.dot(axis) / long, off.perp_dot(axis) * long.sqrt());
            let far = along.length() / 0.34;
            // Nothing reaches the border.
            let edge = smooth_edge(off.abs().max_element() / 0.46);
            let ragged = (0.5 + 1.3 * ragged).clamp(0.08, 1.0);
            *out = 1.0 - far * far.sqrt() + 0.75 * broad + 0.3 * ragged * fine - 3.0 * edge;
        }
    }
    out
}

/// 0 up to 0.85, 1 from 1 on.
fn smooth_edge(share: f32) -> f32 {
    let t = ((share - 0.85) / 0.15).clamp(0.0, 1.0);
    t * t
}

fn area(line: &[Vec2]) -> f32 {
    let next = line.iter().cycle().skip(1);
    0.5 * line.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f32>()
}
