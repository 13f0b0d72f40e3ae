//! Networks and lines to shards, and what becomes of these.

use super::{Input, run};
use crate::{
    math::Rng,
    pattern::{Link, LinkKind, NO_PARENT, Network, Node},
    shatter::{
        Anchor, Burst, BurstParams, Cuts, MeshFrame, RimLook, Shards, ShatterParams, Support, shatter,
        tests::{check_meshes, check_tiling},
    },
};
use glam::{Vec2, Vec3};

/// Sizes of surfaces for which areas are numbers.
fn extent(input: &mut Input) -> Vec2 {
    match input.byte() % 4 {
        0 => Vec2::ONE,
        1 => Vec2::new(1.0, input.between(1.0, 64.0)),
        2 => Vec2::new(input.between(1.0, 64.0), 1.0),
        _ => Vec2::splat(input.between(1e-3, 64.0)),
    }
}

/// A position that lies on others, on the border or beyond it more often than by chance.
fn position(input: &mut Input, extent: Vec2) -> Vec2 {
    let pos = Vec2::new(input.unit(), input.unit()) * 1.25 - 0.125;
    let grid = input.choose(&[4.0, 9.0, 64.0, 1e5]);
    (pos * grid).round() / grid * extent
}

/// A network of any kind: trees and links that cross each other.
fn network(input: &mut Input, extent: Vec2) -> Network {
    let roughness = input.between(0.0, 0.5);
    let mut network = Network::new(extent, roughness, u64::from(input.word()));
    for child in 0..input.below(120) {
        let parent = if child == 0 || input.once_in(8) { NO_PARENT } else { input.below(child) };
        let pos = position(input, extent).clamp(Vec2::ZERO, extent);
        let width = input.between(0.0005, 0.1);
        network.nodes.push(Node { pos, width, parent, generation: 0, birth: child, impact: 0, bend: input.unit() });
    }
    let nodes = network.nodes.len() as u32;
    for birth in 0..input.below(nodes) {
        let (a, b) = (input.below(nodes), input.below(nodes));
        network.links.push(Link { a, b, width: 0.01, birth, kind: LinkKind::Island, bend: input.unit() });
    }
    network
}

fn cuts(input: &mut Input, extent: Vec2) -> Cuts {
    if input.once_in(3) {
        return Cuts::from_network(&network(input, extent)).unwrap();
    }
    let mut cuts = Cuts::new(extent).unwrap();
    for _ in 0..input.below(24) {
        let line: Vec<Vec2> = (0..input.below(8))
            .map(|_| {
                let pos = position(input, extent);
                if input.once_in(64) { Vec2::new(input.odd(), pos.y) } else { pos }
            })
            .collect();
        let is_finite = line.iter().all(|point| point.is_finite());
        assert_eq!(cuts.add_line(&line).is_ok(), is_finite, "{line:?}");
    }
    cuts
}

/// What is known of a shard, and all that can be made of it, is a number.
fn check_shapes(input: &mut Input, shards: &Shards) {
    let burst = Burst::new(BurstParams::DEFAULT, shards.extent() * 0.5, Vec3::Z, 1.0, 1).unwrap();
    let seconds = input.between(0.0, 20.0);
    for (number, shard) in (0u32..).zip(shards.iter()) {
        assert!(shard.area.is_finite() && shard.area > 0.0 && shard.centroid.is_finite(), "{shard:?}");
        let pose = burst.flight(number, shard).pose(seconds);
        assert!(pose.offset.is_finite() && pose.rotation.is_finite() && pose.opacity.is_finite(), "{pose:?}");
    }
    let tolerance = input.choose(&[0.0, 1e-4, 0.02]);
    for number in 0..shards.len().min(12) as u32 {
        let pieces = shards.convex_pieces(number, tolerance);
        assert!(pieces.iter().all(|piece| piece.len() >= 3 && piece.iter().all(|corner| corner.is_finite())));
        let frame = MeshFrame { rim: RimLook::GLASS, ..MeshFrame::new(shards.extent()) };
        let mesh = shards.solid_mesh(number, &frame, 0.1);
        assert!(mesh.positions.iter().chain(&mesh.normals).flatten().all(|value| value.is_finite()));
    }
}

fn target(bytes: &[u8]) {
    let input = &mut Input::new(bytes);
    if input.once_in(32) {
        let extent = Vec2::new(input.odd(), input.odd());
        let Ok(mut cuts) = Cuts::new(extent) else { return };
        cuts.add_line(&[Vec2::ZERO, extent]).unwrap();
        assert_eq!(shatter(cuts, &ShatterParams { min_area: 0.0, ..ShatterParams::DEFAULT }).unwrap().len(), 2);
        return;
    }
    let extent = extent(input);
    let cuts = cuts(input, extent);
    let params = ShatterParams {
        extend_cracks: input.once_in(2),
        min_area: if input.once_in(2) { 0.0 } else { input.mostly(1e-6, 1.0, 32) },
        max_shards: if input.once_in(8) { input.word() } else { 1 + input.below(500) },
        seed: u64::from(input.word()),
    };
    let Ok(shards) = shatter(cuts, &params) else {
        assert!(!(0.0..=1.0).contains(&params.min_area) || !(1..=1_000_000).contains(&params.max_shards));
        return;
    };
    assert!((1..=params.max_shards as usize).contains(&shards.len()));
    assert!(shards.len() == 1 || shards.iter().all(|shard| shard.area > 0.999 * params.min_area));
    check_tiling(&shards);
    check_shapes(input, &shards);
    if shards.len() < 40 {
        check_meshes(&shards, &mut Rng::new(u64::from(input.byte())));
    }

    let mut support =
        Support::new(&shards, input.choose(&[Anchor::Border, Anchor::Sides([false, false, true, false])]));
    for _ in 0..input.below(6) {
        let (at, reach) = (input.place(extent, 16), input.mostly(0.0, 64.0, 16));
        let Ok(fallen) = support.hit(&shards, at, reach) else { continue };
        assert!(fallen.hit.iter().chain(&fallen.loose).all(|&shard| !support.is_in_place(shard)));
    }
    let number = input.below(shards.len() as u32 + 1);
    // Thousands of pieces take seconds: `b5_a_piece_breaks_into_thousands`. Hundreds are for a few cases.
    let least = if input.once_in(16) { 4e-3 } else { 0.04 };
    let (area, share) = (shards.get(number).map_or(1.0, |shard| shard.area), input.mostly(least, 0.5, 16));
    let largest = if (0.0..4e-3).contains(&share) { 4e-3 * area } else { share * area };
    if let Ok(pieces) = shards.break_again(number, largest, u64::from(input.word())) {
        let whole = shards.get(number).unwrap();
        let sum: f32 = pieces.iter().map(|piece| piece.area).sum();
        // Where its outline is cut it moves to the lattice, by up to 0.71 units each time.
        let around = whole.border.iter().chain(shards.neighbours(number).iter().map(|next| &next.length)).sum::<f32>();
        let moved = around * 0.7072 * extent.max_element() / 16_777_216.0;
        assert!((sum - whole.area).abs() < 1e-3 * whole.area + moved, "{sum} of {}", whole.area);
    }
}

#[test]
fn shards() {
    run("shards", 300, target);
}
