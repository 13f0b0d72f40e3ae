//! Charts side by side in one picture: [`LaidOut`].

use super::beside::{self, Beside};
use super::chart::{Chart, bounds, cells};
use super::error::UnwrapError;
use super::shape::MeshShape;
use glam::{U64Vec2, UVec2, Vec2};

/// Texels around each chart that belong to it too, so that filtering at its border finds what goes on there.
pub const GUTTER: u32 = 4;

/// Part of a texel that rounding may add to the size of a chart.
const ROUNDING: f32 = 0.01;

/// A mesh that is laid out.
#[derive(Clone, Debug, PartialEq)]
pub struct LaidOut {
    /// Size of the picture, texels.
    pub size: UVec2,
    /// Where the corners of each triangle are, texels; the top left is at (0, 0). `None` for one without area.
    pub corners: Vec<Option<[Vec2; 3]>>,
    /// Number of charts. Triangles of different charts have no texel in common.
    pub charts: usize,
    /// The chart of each triangle, the first being 0; [`LaidOut::NOTHING`] for one without area.
    pub chart: Vec<u32>,
    /// The triangle that each texel belongs to, row by row; [`LaidOut::NOTHING`] if to none.
    pub owner: Vec<u32>,
    /// Where the surface is cut: the edges of the mesh that lie in two places, or parts of them.
    pub cuts: Vec<Cut>,
    /// Where the surface ends: the edges of one triangle alone, texels.
    pub borders: Vec<[Vec2; 2]>,
}

/// An edge of a mesh that lies in two places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// The triangles on both sides of it.
    pub triangles: [usize; 2],
    /// Where it lies beside each of them, from the same end to the other, texels.
    pub places: [[Vec2; 2]; 2],
}

impl LaidOut {
    /// The number of no triangle or chart.
    pub const NOTHING: u32 = u32::MAX;

    /// The triangle of a texel, those within [`GUTTER`] texels of it among them.
    #[must_use]
    pub fn owner(&self, texel: UVec2) -> Option<usize> {
        let i = texel.y as usize * self.size.x as usize + texel.x as usize;
        let owner = self.owner.get(i).filter(|_| texel.x < self.size.x)?;
        (*owner != Self::NOTHING).then_some(*owner as usize)
    }
}

/// Ends of an edge that are nearer to one another in the plane are one, texels.
const TOGETHER: f32 = 0.1;

/// The edges that lie in two places, and those of one triangle alone.
fn cuts(shape: &MeshShape, beside: &[Beside], corners: &[Option<[Vec2; 3]>]) -> (Vec<Cut>, Vec<[Vec2; 2]>) {
    let (mut cuts, mut borders) = (Vec::new(), Vec::new());
    let mut cut = |triangles: [usize; 2], places: [[Vec2; 2]; 2]| {
        let [[a, b], [p, q]] = places;
        let is_together = a.distance(p) <= TOGETHER && b.distance(q) <= TOGETHER;
        // Each once.
        if !is_together && triangles[0] < triangles[1] {
            cuts.push(Cut { triangles, places });
        }
        is_together
    };
    for (triangle, laid) in corners.iter().enumerate() {
        let Some(laid) = *laid else { continue };
        for (begin, across) in shape.across(triangle).into_iter().enumerate() {
            let place = edge(laid, begin);
            let other = across.and_then(|(other, from)| Some((other as usize, from, corners[other as usize]?)));
            if let Some((other, from, there)) = other {
                let [to, from] = edge(there, usize::from(from));
                cut([triangle, other], [place, [from, to]]);
                continue;
            }
            // Edges that lie on a part of it.
            let own = edge(shape.corners(triangle), begin);
            let parts = beside::of(beside, triangle).filter(|beside| beside.corner == begin);
            let mut is_joined = false;
            for (other, there) in parts.filter_map(|beside| Some((beside.other, corners[beside.other]?))) {
                for from in (0..3).filter(|from| shape.across(other)[*from].is_none()) {
                    let Some(shares) = beside::common(own, edge(shape.corners(other), from)) else { continue };
                    let part = |[a, b]: [Vec2; 2], shares: [f32; 2]| shares.map(|share| a.lerp(b, share));
                    let places = [part(place, shares[0]), part(edge(there, from), shares[1])];
                    is_joined |= cut([triangle, other], places);
                }
            }
            if !is_joined {
                borders.push(place);
            }
        }
    }
    (cuts, borders)
}

/// The edge of a triangle that begins at a corner.
fn edge<T: Copy>([a, b, c]: [T; 3], begin: usize) -> [T; 2] {
    [[a, b], [b, c], [c, a]][begin]
}

/// A chart and where it lies.
struct Part<'a> {
    chart: &'a Chart,
    min: Vec2,
    size: UVec2,
    at: UVec2,
}

/// Lays charts side by side: the first at the top left, the others beside and below it in rows, the highest first.
pub(super) fn pack(
    shape: &MeshShape,
    beside: &[Beside],
    charts: &[Chart],
    texels: f32,
    (most_side, most_texels): (u32, u64),
) -> Result<LaidOut, UnwrapError> {
    // Before memory is taken for them.
    let check = |size: U64Vec2| {
        let fits = size.max_element() <= u64::from(most_side) && size.element_product() <= most_texels;
        if fits { Ok(size.as_uvec2()) } else { Err(UnwrapError::TooLarge { width: size.x, height: size.y }) }
    };
    let mut parts = Vec::with_capacity(charts.len());
    for chart in charts {
        let (min, max) = bounds(chart.triangles.iter().flat_map(|(_, corners)| *corners));
        // No row of texels for what rounding adds.
        let own = ((max - min) * texels - ROUNDING).ceil().max(Vec2::ONE);
        let size = check((own + 2.0 * GUTTER as f32).min(Vec2::splat(1e9)).as_u64vec2())?;
        parts.push(Part { chart, min, size, at: UVec2::ZERO });
    }
    let size = check(arrange(&mut parts).as_u64vec2())?;
    let mut corners = vec![None; shape.len()];
    for part in &parts {
        let origin = part.at.as_vec2() + GUTTER as f32;
        for (triangle, laid) in &part.chart.triangles {
            corners[*triangle] = Some(laid.map(|at| (at - part.min) * texels + origin));
        }
    }
    let owner = owners(&corners, size, &parts);
    let mut chart = vec![LaidOut::NOTHING; shape.len()];
    for (number, (triangle, _)) in
        (0..).zip(charts).flat_map(|(number, chart)| chart.triangles.iter().map(move |of| (number, of)))
    {
        chart[*triangle] = number;
    }
    let (cuts, borders) = cuts(shape, beside, &corners);
    Ok(LaidOut { size, corners, charts: charts.len(), chart, owner, cuts, borders })
}

/// Finds places for all parts; returns the size of what is around them.
fn arrange(parts: &mut [Part<'_>]) -> UVec2 {
    let Some((first, others)) = parts.split_first_mut() else { return UVec2::ONE };
    let mut order: Vec<usize> = (0..others.len()).collect();
    order.sort_by_key(|i| core::cmp::Reverse((others[*i].size.y, others[*i].size.x)));
    let area: u64 = others.iter().map(|part| u64::from(part.size.x) * u64::from(part.size.y)).sum();
    let widest = others.iter().map(|part| part.size.x).max().unwrap_or(0);
    // Beside the first if that is higher than wide, else below it.
    let is_beside = first.size.y > first.size.x;
    let width = if is_beside { (area as f64 / f64::from(first.size.y)).ceil() as u32 } else { first.size.x };
    let width = width.max(widest).max((area as f64).sqrt().min(f64::from(first.size.max_element())) as u32);
    let corner = if is_beside { UVec2::new(first.size.x, 0) } else { UVec2::new(0, first.size.y) };
    let (mut at, mut row) = (UVec2::ZERO, 0);
    let mut size = first.size;
    for i in order {
        let part = &mut others[i];
        if at.x + part.size.x > width && at.x > 0 {
            (at, row) = (UVec2::new(0, at.y + row), 0);
        }
        part.at = corner + at;
        at.x += part.size.x;
        row = row.max(part.size.y);
        size = size.max(part.at + part.size);
    }
    size
}

/// The triangle of each texel. Those around a chart belong to the triangles at its border.
fn owners(corners: &[Option<[Vec2; 3]>], size: UVec2, parts: &[Part<'_>]) -> Vec<u32> {
    let width = size.x as usize;
    let mut owner = vec![LaidOut::NOTHING; width * size.y as usize];
    for (triangle, laid) in (0..).zip(corners) {
        for texel in laid.iter().flat_map(|laid| cells(*laid, size, 0.0)) {
            let owner = &mut owner[texel.y as usize * width + texel.x as usize];
            *owner = (*owner).min(triangle);
        }
    }
    for Part { at, size, .. } in parts {
        widen(&mut owner, width, *at, *at + *size);
    }
    owner
}

/// Gives the texels next to others their triangle, [`GUTTER`] times, within a rectangle.
fn widen(owner: &mut [u32], width: usize, min: UVec2, max: UVec2) {
    let (min, max) = (min.as_usizevec2(), max.as_usizevec2());
    let beside = |i: usize| {
        let (x, y) = (i % width, i / width);
        let all = [
            (x > min.x, i.wrapping_sub(1)),
            (x + 1 < max.x, i + 1),
            (y > min.y, i.wrapping_sub(width)),
            (y + 1 < max.y, i + width),
        ];
        all.into_iter().filter(|(is_within, _)| *is_within).map(|(_, other)| other)
    };
    let is_edge = |i: &usize| owner[*i] != LaidOut::NOTHING && beside(*i).any(|other| owner[other] == LaidOut::NOTHING);
    let all = (min.y..max.y).flat_map(|y| (min.x..max.x).map(move |x| y * width + x));
    let mut edge: Vec<usize> = all.filter(is_edge).collect();
    for _ in 0..GUTTER {
        let mut next = Vec::new();
        for i in edge {
            for other in beside(i) {
                if owner[other] == LaidOut::NOTHING {
                    owner[other] = owner[i];
                    next.push(other);
                }
            }
        }
        edge = next;
    }
}
