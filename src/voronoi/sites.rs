//! Layouts of sites.

use super::{
    SiteLayout, VoronoiParams,
    charts::{MapGround, texel},
    params::MAX_SITES,
};
use crate::{
    Grid,
    math::{Rng, ops},
};
use glam::{UVec2, Vec2};

/// Failed darts before the minimum distance of sites is reduced.
const TRIES: u32 = 30;

/// Factor by which the distance is reduced.
const CLOSER: f32 = 0.93;

/// The sites of every layout except [`SiteLayout::StrokePairs`], ordered so that every prefix is such a layout too.
pub(super) fn sites(params: &VoronoiParams, ground: MapGround<'_>, seed: u64) -> Vec<UVec2> {
    let mut rng = Rng::new(seed).stream("sites");
    let n = params.sites.min(MAX_SITES) as usize;
    let extent = ground.frame.extent();
    let has_room = |point: Vec2| ground.has_room(point);
    let points = match &params.layout {
        SiteLayout::Uniform => {
            let mut point = || Vec2::new(rng.unit(), rng.unit()) * extent;
            (0..n).map(|_| first_with_room(&mut point, has_room)).collect()
        }
        SiteLayout::Even | SiteLayout::StrokePairs => even(n, Vec::new(), extent, &mut rng, has_room, |_| 1.0),
        SiteLayout::Impact { at, focus } => around(n, *at, *focus, ground, &mut rng),
        SiteLayout::Density(density) => by_density(n, density, ground, &mut rng)
            .unwrap_or_else(|| even(n, Vec::new(), extent, &mut rng, has_room, |_| 1.0)),
        SiteLayout::Given(points) => {
            points.iter().copied().filter(|point| point.is_finite()).take(MAX_SITES as usize).collect()
        }
    };
    points.into_iter().filter(|point| has_room(*point)).map(|point| texel(ground.frame, point)).collect()
}

/// Points that are drawn until one has room.
const DRAWS: usize = 64;

/// The first of some points that has room, or the last of them.
fn first_with_room(mut point: impl FnMut() -> Vec2, has_room: impl Fn(Vec2) -> bool) -> Vec2 {
    let mut drawn = point();
    for _ in 1..DRAWS {
        if has_room(drawn) {
            break;
        }
        drawn = point();
    }
    drawn
}

/// Adds points to `points` until there are `n`, each as far from all others as a few darts can find, times `spread`.
pub(super) fn even(
    n: usize,
    mut points: Vec<Vec2>,
    extent: Vec2,
    rng: &mut Rng,
    allowed: impl Fn(Vec2) -> bool,
    spread: impl Fn(Vec2) -> f32,
) -> Vec<Vec2> {
    if n <= points.len() {
        return points;
    }
    // Finally about two points per cell.
    let cell = (2.0 * extent.x * extent.y / n as f32).sqrt();
    let columns = (extent / cell).ceil().max(Vec2::ONE).as_uvec2();
    let mut cells = vec![Vec::<u32>::new(); columns.x as usize * columns.y as usize];
    let cell_of = |point: Vec2| (point / cell).max(Vec2::ZERO).as_uvec2().min(columns - 1);
    let index = |at: UVec2| at.y as usize * columns.x as usize + at.x as usize;
    for (i, &point) in (0u32..).zip(&points) {
        cells[index(cell_of(point))].push(i);
    }
    let mut apart = 0.9 * (extent.x * extent.y / (points.len() + 1) as f32).sqrt();
    let mut missed = 0;
    while points.len() < n {
        let dart = Vec2::new(rng.unit(), rng.unit()) * extent;
        let least = apart * spread(dart);
        let (low, high) = (cell_of(dart - least), cell_of(dart + least));
        let mut near = (low.y..=high.y).flat_map(|y| (low.x..=high.x).map(move |x| UVec2::new(x, y)));
        let free = |i: &u32| points[*i as usize].distance_squared(dart) >= least * least;
        if (allowed(dart) || apart < 1.0e-4) && near.all(|at| cells[index(at)].iter().all(free)) {
            cells[index(cell_of(dart))].push(points.len() as u32);
            points.push(dart);
            missed = 0;
        } else {
            missed += 1;
            if missed == TRIES {
                missed = 0;
                apart *= CLOSER;
            }
        }
    }
    points
}

fn around(n: usize, at: Vec2, focus: f32, ground: MapGround<'_>, rng: &mut Rng) -> Vec<Vec2> {
    let extent = ground.frame.extent();
    let at = at.clamp(Vec2::ZERO, extent);
    let reach = at.max(extent - at).length();
    let mut point = || {
        // At least a quarter of the circle lies on the surface.
        for _ in 0..DRAWS {
            let radius = reach * ops::powf(rng.unit(), focus);
            let point = at + ops::unit(rng.unit() * std::f32::consts::TAU) * radius;
            if point.cmpge(Vec2::ZERO).all() && point.cmplt(extent).all() && ground.has_room(point) {
                return point;
            }
        }
        at
    };
    (0..n).map(|_| point()).collect()
}

/// `None` where the density is zero everywhere.
fn by_density(n: usize, density: &Grid<f32>, ground: MapGround<'_>, rng: &mut Rng) -> Option<Vec<Vec2>> {
    let most = density.as_slice().iter().copied().filter(|value| value.is_finite()).fold(0.0, f32::max);
    if most <= 0.0 {
        return None;
    }
    // Integers, so that the sum does not depend on the order.
    let mut sum = 0u64;
    let weight = |value: f32| if value.is_finite() { (value.max(0.0) / most * 65536.0) as u64 } else { 0 };
    let sums: Vec<u64> = density
        .as_slice()
        .iter()
        .map(|&value| {
            sum += weight(value);
            sum
        })
        .collect();
    let cell = ground.frame.extent() / density.size().as_vec2();
    let mut point = || {
        let drawn = (u128::from(u64::from(rng.next_u32()) << 32 | u64::from(rng.next_u32())) * u128::from(sum)) >> 64;
        let i = sums.partition_point(|&sum| u128::from(sum) <= drawn);
        let corner = Vec2::new((i % density.width()) as f32, (i / density.width()) as f32);
        (corner + Vec2::new(rng.unit(), rng.unit())) * cell
    };
    Some((0..n).map(|_| first_with_room(&mut point, |point| ground.has_room(point))).collect())
}
