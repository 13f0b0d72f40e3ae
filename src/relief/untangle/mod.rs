//! Simple rings from loops that cross, touch and twist.
//!
//! All on a lattice of whole numbers, with exact predicates, in three steps: loops are cut where they meet, and what is
//! cut is moved to lattice points, until no two pieces meet but at their ends ([`meet`], after the snap rounding of
//! Hobby 1999); winding numbers go from piece to piece round the places where they meet ([`faces`]); the pieces
//! between inside and outside are joined to rings. The paper (Misawa et al. 1986, section 4.4) knows no complete method.

mod bins;
mod chains;
mod faces;
mod lone;
mod meet;
mod rings;

use super::lattice::{Loop, Point, double_area};
pub(super) use faces::Fill;
pub(super) use meet::TooTangled;

/// Most cuts where loops meet.
pub(super) const MAX_CUTS: usize = 1 << 21;

/// The region that `loops` enclose by the rule `fill`, as rings.
///
/// No ring meets itself. Two rings share single points at most and do not cross. Rings have the region on the side of
/// positive turns, so those around it have a positive area and holes a negative one. Rings with twice an area below
/// `least` are left out.
///
/// Fails if there are more than `most` cuts.
pub(super) fn untangle(loops: &[Loop], fill: Fill, least: i128, most: usize) -> Result<Vec<Loop>, TooTangled> {
    Ok(cut_and_joined(loops, fill, least, most)?.0)
}

/// As [`untangle`], with [`MAX_CUTS`] at most, and whether the rings are the loops as they came: none met itself or
/// another one, none was left out.
///
/// Faster for a loop that does not meet itself, a little slower for one that does. `known` is nothing or such a loop, all
/// that came back the last time, and saves time where many edges are the same.
pub(super) fn untangled(
    loops: &[Loop],
    known: &[Point],
    fill: Fill,
    least: i128,
) -> Result<(Vec<Loop>, bool), TooTangled> {
    if let [points] = loops
        && fill.holds(1)
        && lone::stays(points, known)
        && let Some(rings) = alone(points, least)
    {
        let is_same = !rings.is_empty();
        return Ok((rings, is_same));
    }
    cut_and_joined(loops, fill, least, MAX_CUTS)
}

/// The rings of a loop that does not meet itself, if it has the inside on the side of positive turns.
fn alone(points: &[Point], least: i128) -> Option<Vec<Loop>> {
    let area = double_area(points);
    (area > 0).then(|| if area >= least.max(1) { vec![points.to_vec()] } else { Vec::new() })
}

fn cut_and_joined(loops: &[Loop], fill: Fill, least: i128, most: usize) -> Result<(Vec<Loop>, bool), TooTangled> {
    let edges = meet::cut(loops, most)?;
    if fill.holds(1) && edges.is_one_ring() {
        // The common case, which needs no more than that.
        let ring: Loop = edges.edges.iter().map(|edge| edge.a).collect();
        let area = double_area(&ring);
        if area > 0 {
            let rings = if area >= least.max(1) { vec![ring] } else { Vec::new() };
            let is_same = rings.len() == loops.len();
            return Ok((rings, is_same));
        }
    }
    let mut chains = chains::chains(&edges);
    faces::wind(&mut chains, &edges);
    let mut rings = rings::trace(&chains, &edges, fill);
    rings.retain(|ring: &Loop| ring.len() >= 3 && double_area(ring).abs() >= least.max(1));
    let is_same = chains.nodes.is_empty() && rings.len() == loops.len();
    Ok((rings, is_same))
}
