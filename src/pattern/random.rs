//! Random planar networks for tests.

use super::{Link, LinkKind, NO_PARENT, Network, Node};
use crate::math::Rng;
use glam::Vec2;

fn cross(o: Vec2, a: Vec2, b: Vec2) -> f64 {
    // Exact: places are multiples of 2⁻¹⁰.
    (a - o).as_dvec2().perp_dot((b - o).as_dvec2())
}

fn is_on(p: Vec2, a: Vec2, b: Vec2) -> bool {
    cross(a, b, p) == 0.0 && (p - a).dot(p - b) <= 0.0
}

/// Whether two segments share anything but a common end.
pub(crate) fn touch((a, b): (Vec2, Vec2), (c, d): (Vec2, Vec2)) -> bool {
    let opposite = |x: f64, y: f64| (x > 0.0 && y < 0.0) || (x < 0.0 && y > 0.0);
    if opposite(cross(a, b, c), cross(a, b, d)) && opposite(cross(c, d, a), cross(c, d, b)) {
        return true;
    }
    let inner = |p: Vec2, (a, b): (Vec2, Vec2)| p != a && p != b && is_on(p, a, b);
    inner(c, (a, b)) || inner(d, (a, b)) || inner(a, (c, d)) || inner(b, (c, d)) || (a, b) == (c, d) || (a, b) == (d, c)
}

/// One node more or less as a growth makes it.
pub(crate) fn node(pos: Vec2, parent: u32, birth: u32) -> Node {
    Node { pos, width: 0.01, parent, generation: 0, birth, impact: birth / 10, bend: 1.0 }
}

/// One link more or less as a growth makes it.
pub(crate) fn link(a: u32, b: u32, birth: u32) -> Link {
    Link { a, b, width: 0.01, birth, kind: LinkKind::Island, bend: 1.0 }
}

/// A network of about `nodes` nodes without crossings: trees with and without a foot on the border, closed by links.
///
/// Places are multiples of 2⁻¹⁰. Segments lie on no other and not on the border.
pub(crate) fn planar_network(nodes: u32, extent: Vec2, rng: &mut Rng) -> Network {
    let mut network = Network::new(extent, 0.3, u64::from(rng.next_u32()));
    let mut segments: Vec<(Vec2, Vec2)> = Vec::new();
    // Short reaches, few feet on the border and many starts leave islands.
    let reach = rng.range(0.8, 2.5) / (nodes as f32).sqrt();
    let (free_share, border_share) = (rng.unit(), rng.range(0.0, 0.25));
    let on_side = |p: Vec2| [p.x == 0.0, p.x == extent.x, p.y == 0.0, p.y == extent.y];
    let along = |a: Vec2, b: Vec2| on_side(a).into_iter().zip(on_side(b)).any(|(a, b)| a && b);
    let fits = |segments: &[(Vec2, Vec2)], network: &Network, a: Vec2, b: Vec2| {
        a != b
            && !along(a, b)
            && segments.iter().all(|&segment| !touch(segment, (a, b)))
            && network.nodes.iter().all(|node| node.pos == a || node.pos == b || !is_on(node.pos, a, b))
    };
    for birth in 0..nodes {
        let mut pos = (Vec2::new(rng.unit(), rng.unit()) * extent * 1024.0).round() / 1024.0;
        if rng.unit() < border_share {
            match rng.next_u32() % 4 {
                0 => pos.x = 0.0,
                1 => pos.x = extent.x,
                2 => pos.y = 0.0,
                _ => pos.y = extent.y,
            }
        }
        let corner = (pos.x == 0.0 || pos.x == extent.x) && (pos.y == 0.0 || pos.y == extent.y);
        let taken = network.nodes.iter().any(|node| node.pos == pos) || segments.iter().any(|&(a, b)| is_on(pos, a, b));
        if corner || taken {
            continue;
        }
        let near: Vec<u32> = (0u32..)
            .zip(&network.nodes)
            .filter(|(_, node)| node.pos.distance(pos) < reach && fits(&segments, &network, node.pos, pos))
            .map(|(i, _)| i)
            .collect();
        let parent = if near.is_empty() || rng.unit() < 0.3 * free_share {
            NO_PARENT
        } else {
            near[rng.next_u32() as usize % near.len()]
        };
        let child = network.nodes.len() as u32;
        network.nodes.push(node(pos, parent, birth));
        if parent != NO_PARENT {
            segments.push((network.nodes[parent as usize].pos, pos));
        }
        for other in near {
            let end = network.nodes[other as usize].pos;
            if other != parent && rng.unit() < 0.8 && fits(&segments, &network, end, pos) {
                segments.push((end, pos));
                network.links.push(link(child, other, birth));
            }
        }
    }
    network
}
