//! [`Course`]: the smooth curve of a path, along which primitives are bent.

use super::params::{Propagation, StrandParams};
use glam::Vec2;

/// The points of a path without the stairs of the lattice.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Course {
    pub(super) points: Vec<Vec2>,
    /// Number of points over which normals are taken, on either side.
    reach: f32,
}

impl Course {
    /// The curve of a path. It begins at `start` if that is given, a point of its parent's curve.
    pub(super) fn new(params: &StrandParams, path: &[Vec2], start: Option<Vec2>) -> Self {
        let half = match params.propagation {
            Propagation::Costs => 7,
            Propagation::Continuous => 2,
        };
        // Strands that keep their distance must not lose it.
        let room = (params.repulsion / (3.0 * params.step)) as usize;
        let half = if room > 0 { half.min(room.max(2)) } else { half };
        let sums: Vec<Vec2> = std::iter::once(Vec2::ZERO)
            .chain(path.iter().scan(Vec2::ZERO, |sum, point| {
                *sum += *point - path[0];
                Some(*sum)
            }))
            .collect();
        let last = path.len() - 1;
        let mut points: Vec<Vec2> = (0..=last)
            .map(|i| {
                let reach = half.min(i).min(last - i);
                match reach {
                    0 => path[i],
                    _ => path[0] + (sums[i + reach + 1] - sums[i - reach]) / (2 * reach + 1) as f32,
                }
            })
            .collect();
        if let Some(start) = start {
            let off = start - path[0];
            for (i, point) in points.iter_mut().enumerate().take(2 * half) {
                *point += off * (1.0 - i as f32 / (2 * half) as f32);
            }
        }
        // The wider what is bent, the wider must be the bends.
        let reach = 0.06 + 0.4 * (params.lanes - 1) as f32;
        Self { points, reach: (reach * params.tile_steps() as f32).max(2.0) }
    }

    /// Position and normal at point `s`, a whole number or between; beyond the ends straight on.
    pub(super) fn at(&self, s: f32) -> (Vec2, Vec2) {
        let along = self.pos(s + self.reach) - self.pos(s - self.reach);
        (self.pos(s), -along.normalize_or(Vec2::Y).perp())
    }

    fn pos(&self, s: f32) -> Vec2 {
        let last = self.points.len() - 1;
        if last == 0 {
            return self.points[0];
        }
        let left = (s.max(0.0) as usize).min(last - 1);
        let (a, b) = (self.points[left], self.points[left + 1]);
        // Beyond the ends along the last few points.
        let reach = (self.reach as usize).clamp(1, last);
        if s < 0.0 {
            return a + (self.points[reach] - a) * (s / reach as f32);
        }
        if s > last as f32 {
            return b + (b - self.points[last - reach]) * ((s - last as f32) / reach as f32);
        }
        a.lerp(b, s - left as f32)
    }
}
