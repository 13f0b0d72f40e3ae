//! Limits and directions of turns: no sharp turns, towards weak areas, and into a nearby border.

use crate::pattern::CrackMask;
use glam::Vec2;

/// Cosine and sine of the largest turn of a crack from one segment to the next: 60 degrees.
const MOST_TURN: (f32, f32) = (0.5, 0.866_025_4);

/// `direction`, limited to the turn that a crack with this heading may make.
pub(super) fn turned_at_most(heading: Vec2, direction: Vec2) -> Vec2 {
    if heading == Vec2::ZERO || heading.dot(direction) >= MOST_TURN.0 {
        return direction;
    }
    let across = if heading.perp_dot(direction) < 0.0 { -heading.perp() } else { heading.perp() };
    heading * MOST_TURN.0 + across * MOST_TURN.1
}

/// Turns `direction` by up to 80 degrees towards weak areas and away from strong or forbidden ones.
pub(super) fn steer(from: Vec2, direction: Vec2, length: f32, mask: &CrackMask, extent: Vec2) -> Vec2 {
    // Cosine and sine of 0, 10, ... 80 degrees.
    const TURNS: [(f32, f32); 9] = [
        (1.0, 0.0),
        (0.984_807_8, 0.173_648_18),
        (0.939_692_6, 0.342_020_15),
        (0.866_025_4, 0.5),
        (0.766_044_4, 0.642_787_6),
        (0.642_787_6, 0.766_044_4),
        (0.5, 0.866_025_4),
        (0.342_020_15, 0.939_692_6),
        (0.173_648_18, 0.984_807_8),
    ];
    let mut best = (f32::NEG_INFINITY, direction);
    for (cos, sin) in TURNS.into_iter().flat_map(|(cos, sin)| [(cos, sin), (cos, -sin)]) {
        let way = direction * cos + direction.perp() * sin;
        let mut liking = 0.35 * cos;
        for share in [0.5, 1.0, 1.5] {
            let uv = (from + way * (share * length)) / extent;
            liking += mask.weak_at(uv) - mask.strong_at(uv);
        }
        if mask.blocks(from / extent, (from + way * length) / extent) {
            liking -= 100.0;
        }
        if liking > best.0 {
            best = (liking, way);
        }
    }
    best.1
}

/// The end of a segment of `length`. If the border of the surface is at most `margin` beyond it, the end is on the
/// border.
///
/// So cracks run into the border instead of ending just before it, and never leave the surface.
pub(super) fn up_to_border(from: Vec2, direction: Vec2, length: f32, margin: f32, extent: Vec2) -> Vec2 {
    let far = from + direction * (length + margin);
    let mut share = 1.0f32;
    for axis in 0..2 {
        let way = far[axis] - from[axis];
        if far[axis] < 0.0 {
            share = share.min(-from[axis] / way);
        } else if far[axis] > extent[axis] {
            share = share.min((extent[axis] - from[axis]) / way);
        }
    }
    if share < 1.0 { (from + (far - from) * share).clamp(Vec2::ZERO, extent) } else { from + direction * length }
}
