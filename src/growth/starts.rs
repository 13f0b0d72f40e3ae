//! Where the cracks of a hit start, and how much room there is for them.

use super::params::StartLayout;
use crate::math::{Rng, ops};
use glam::Vec2;
use std::f32::consts::TAU;

/// A count at this energy; `count` is the value at energy 1.
fn by_energy(count: u32, energy: f32, most: u32) -> u32 {
    ((count as f32 * energy.sqrt()).round() as u32).clamp(2, most.max(2))
}

/// Directions in which the room around a hit is measured.
const DIRECTIONS: usize = 64;

/// Number of directions on either side of an arm that should have as much room as the arm: 17 degrees.
const BESIDE: usize = 3;

/// Share of `reach` that lies on the surface in each direction from `center`, 0..=1.
fn rooms(center: Vec2, reach: f32, extent: Vec2) -> [f32; DIRECTIONS] {
    std::array::from_fn(|i| {
        let way = ops::unit(TAU * i as f32 / DIRECTIONS as f32);
        let to_border = |center: f32, way: f32, extent: f32| match way {
            way if way > 1e-6 => (extent - center) / way,
            way if way < -1e-6 => -center / way,
            _ => f32::INFINITY,
        };
        let far = to_border(center.x, way.x, extent.x).min(to_border(center.y, way.y, extent.y));
        (far / reach).clamp(0.0, 1.0)
    })
}

/// Share of the surroundings of a hit that lies on the surface, 0..=1.
pub(super) fn room(center: Vec2, reach: f32, extent: Vec2) -> f32 {
    rooms(center, reach, extent).iter().sum::<f32>() / DIRECTIONS as f32
}

/// The directions of the arms of a hit: evenly spaced over the directions that have room, each with a small random
/// deviation.
pub(super) fn arms(count: u32, (center, energy): (Vec2, f32), reach: f32, extent: Vec2, seed: u64) -> Vec<Vec2> {
    let mut rng = Rng::new(seed).stream("arms");
    let rooms = rooms(center, reach, extent);
    // An arm with hardly any room would not be visible, and one along the border would soon run into it.
    let weights: [f32; DIRECTIONS] = std::array::from_fn(|i| {
        let beside = (0..=2 * BESIDE).map(|k| rooms[(i + DIRECTIONS + k - BESIDE) % DIRECTIONS]);
        beside.fold(1.0, f32::min).powi(2) + 1e-4
    });
    let total: f32 = weights.iter().sum();
    let share = 0.7 + 0.3 * rooms.iter().sum::<f32>() / DIRECTIONS as f32;
    let count = ops::powf(energy, 1.0 / 3.0) * count as f32 * share;
    let count = ((count + 0.5 + 0.55 * rng.signed()) as u32).clamp(2, 1024);
    let turn = rng.unit();
    let angle = |place: f32| {
        // The direction below which this share of the total room lies.
        let mut left = place.rem_euclid(1.0) * total;
        for (i, weight) in weights.iter().enumerate() {
            if left < *weight {
                return TAU * (i as f32 - 0.5 + left / weight) / DIRECTIONS as f32;
            }
            left -= weight;
        }
        0.0
    };
    let mut places = (0..count).map(|i| (i as f32 + turn + 0.35 * rng.signed()) / count as f32).collect::<Vec<_>>();
    places.iter_mut().map(|place| ops::unit(angle(*place))).collect()
}

/// The positions of the first nodes of a hit.
pub(super) fn starts(
    layout: StartLayout,
    (center, energy): (Vec2, f32),
    reach: f32,
    extent: Vec2,
    seed: u64,
) -> Vec<Vec2> {
    let mut rng = Rng::new(seed).stream("starts");
    let mut scatter = |count: u32, radius: f32| {
        (0..count).map(|_| center + ops::unit(TAU * rng.unit()) * (radius * rng.unit().sqrt())).collect::<Vec<_>>()
    };
    let mut places = match layout {
        StartLayout::Point | StartLayout::Arms { .. } => vec![center],
        StartLayout::Points { count } => {
            let mut places = scatter(((count as f32 * energy).ceil() as u32).clamp(1, 1024), reach);
            places[0] = center;
            places
        }
        StartLayout::Disc { count, radius } => scatter(count, radius),
        StartLayout::Crushed { count, radius } => {
            let (count, radius) = (by_energy(count, energy, 1024), radius * energy.sqrt().sqrt());
            let turn = rng.unit();
            let angle = |i, stray: f32| TAU * (i as f32 + turn + 0.35 * stray) / count as f32;
            (0..count).map(|i| center + ops::unit(angle(i, rng.signed())) * radius).collect()
        }
        StartLayout::Ring { count, radius } => {
            let turn = rng.unit();
            (0..count).map(|i| center + ops::unit(TAU * (i as f32 + turn) / count as f32) * radius).collect()
        }
    };
    for place in &mut places {
        *place = place.clamp(Vec2::ZERO, extent);
    }
    places
}
