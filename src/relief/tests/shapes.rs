//! Closed lines of many kinds.

use crate::math::{Rng, ops};
use glam::Vec2;
use std::f32::consts::TAU;

/// Kinds of [`shape`].
pub(super) const KINDS: [&str; 10] =
    ["wavy", "spiky", "spiral", "thin", "collinear", "comb", "touching", "steps", "crossing", "fractal"];

fn on_circle(count: u32, mut radius: impl FnMut(f32) -> f32) -> Vec<Vec2> {
    (0..count)
        .map(|i| {
            let share = i as f32 / count as f32;
            Vec2::splat(0.5) + ops::unit(TAU * share) * radius(share)
        })
        .collect()
}

/// A band that turns round its middle.
fn spiral(count: u32, rng: &mut Rng) -> Vec<Vec2> {
    let half = (count / 2).max(4);
    let turns = rng.range(0.5, 4.0);
    let width = rng.range(0.1, 0.8) * 0.45 / turns.max(1.0);
    let at = |i: u32, r: f32| {
        let share = i as f32 / (half - 1) as f32;
        Vec2::splat(0.5) + ops::unit(TAU * turns * share) * (r + 0.02 + 0.45 * share)
    };
    (0..half).map(|i| at(i, 0.0)).chain((0..half).rev().map(|i| at(i, width))).collect()
}

/// Teeth, some of which touch each other at a point or along an edge.
fn comb(count: u32, does_touch: bool, rng: &mut Rng) -> Vec<Vec2> {
    let teeth = (count / 4).max(1);
    let mut out = vec![Vec2::new(0.0, 1.0), Vec2::new(0.0, 0.9)];
    for tooth in 0..teeth {
        let x = tooth as f32 / teeth as f32;
        let wide = if does_touch && rng.unit() < 0.5 { 1.0 } else { rng.range(0.1, 0.9) };
        let y = rng.range(0.0, 0.8);
        let right = x + wide / teeth as f32;
        out.extend([Vec2::new(x, 0.9), Vec2::new(x, y), Vec2::new(right, y), Vec2::new(right, 0.9)]);
    }
    out.push(Vec2::new(1.0, 1.0));
    out
}

/// Right angles on a coarse lattice, with edges on each other.
fn steps(count: u32, rng: &mut Rng) -> Vec<Vec2> {
    let mut at = Vec2::ZERO;
    (0..count)
        .map(|i| {
            let step = (rng.next_u32() % 9) as f32 - 4.0;
            at += if i % 2 == 0 { Vec2::new(step, 0.0) } else { Vec2::new(0.0, step) };
            at * 0.03125
        })
        .collect()
}

/// Midpoints displaced again and again.
fn fractal(count: u32, rng: &mut Rng) -> Vec<Vec2> {
    let mut line = on_circle(5, |_| 0.4);
    while line.len() * 2 <= count as usize {
        let next = line.iter().copied().cycle().skip(1);
        line = line
            .iter()
            .zip(next)
            .flat_map(|(&a, b)| [a, (a + b) * 0.5 + (b - a).perp() * 0.35 * rng.signed()])
            .collect();
    }
    line
}

/// A closed line of a kind with about `count` points.
pub(super) fn shape(kind: usize, count: u32, rng: &mut Rng) -> Vec<Vec2> {
    let (a, b, c) = (rng.unit(), rng.unit(), rng.unit());
    match KINDS[kind] {
        "wavy" => on_circle(count, |s| {
            0.3 + 0.06 * ops::sin(TAU * (3.0 * s + a)) + 0.04 * ops::sin(TAU * (8.0 * s + b)) + 0.01 * c
        }),
        "spiky" => on_circle(count, |_| rng.range(0.02, 0.5)),
        "spiral" => spiral(count, rng),
        "thin" => on_circle(count, |_| 0.45).into_iter().map(|p| Vec2::new(p.x, p.y * 0.001 + c)).collect(),
        "collinear" => {
            let corners = [Vec2::ZERO, Vec2::new(1.0, a), Vec2::new(b, 1.0), Vec2::new(0.2 * c, 0.5)];
            let per_side = (count / 4).max(1);
            let side = |i: usize| (0..per_side).map(move |k| (i, k as f32 / per_side as f32));
            (0..4).flat_map(side).map(|(i, t)| corners[i].lerp(corners[(i + 1) % 4], t)).collect()
        }
        "comb" => comb(count, false, rng),
        "touching" => comb(count, true, rng),
        "steps" => steps(count.min(400), rng),
        "crossing" => (0..count.min(60)).map(|_| Vec2::new(rng.unit(), rng.unit())).collect(),
        _ => fractal(count, rng),
    }
}

/// 3..=`most` points, small numbers as often as large ones.
pub(super) fn count(rng: &mut Rng, most: f32) -> u32 {
    (3.0 * ops::powf(most / 3.0, rng.unit())) as u32
}
