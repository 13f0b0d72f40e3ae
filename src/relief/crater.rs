//! Craters: what a hit knocks out of a surface, in terraces.

use super::{
    contours::{Contours, Ring},
    error::ReliefError,
};
use crate::{Grid, math::Rng, pattern::SurfaceFrame};
use glam::{UVec2, Vec2};

/// Corners of each ring of a crater.
const CORNERS: usize = 72;

/// A corner stands out no further than those so many corners beside it, about.
const BESIDE: usize = 4;

/// Most terraces of a crater.
const MOST_TERRACES: usize = 4;

/// The size and shape of craters.
///
/// ```
/// use bevy_crack::relief::CraterParams;
///
/// let params = CraterParams { radius: 0.1, ..CraterParams::DEFAULT };
/// assert_eq!(params.validate(), Ok(()));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct CraterParams {
    /// Mean radius, pattern units. For a hit of energy `e` it is a material's constant times the square root of `e`, if
    /// the area that is knocked out grows with the energy. 0.0001..=16; default 0.06.
    pub radius: f32,
    /// Number of terraces from the border to the bottom: as many rings. 1..=4; default 3.
    pub terraces: u32,
    /// How uneven the rings are: 0 = circles, 1 = splintered. 0..=1; default 0.5.
    pub roughness: f32,
    /// How much a terrace is a wall and then flat: 0 = even slopes, 1 = walls. Shells of brittle rock and glass are in between.
    /// 0..=1; default 0.6.
    pub walls: f32,
}

impl CraterParams {
    /// A crater in stone.
    pub const DEFAULT: Self = Self { radius: 0.06, terraces: 3, roughness: 0.5, walls: 0.6 };

    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ReliefError::OutOfRange`] for the first number that is out of its range or not finite.
    pub fn validate(&self) -> Result<(), ReliefError> {
        let ranges = [
            ("radius", self.radius, 0.0001, 16.0),
            ("terraces", self.terraces as f32, 1.0, MOST_TERRACES as f32),
            ("roughness", self.roughness, 0.0, 1.0),
            ("walls", self.walls, 0.0, 1.0),
        ];
        match ranges.into_iter().find(|(_, value, min, max)| !(*min..=*max).contains(value)) {
            Some((name, value, min, max)) => Err(ReliefError::OutOfRange { name, value, min, max }),
            None => Ok(()),
        }
    }
}

impl Default for CraterParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// What a hit knocks out: a contour around it, shrunk inwards in terraces that lie deeper and deeper.
///
/// All rings have a corner on each of the same rays from the hit, so they are simple and nest, and the depth of a place is
/// found without a search: in the sector between two rays the distance to a side is a linear function.
///
/// ```
/// use bevy_crack::relief::{Crater, CraterParams};
///
/// let crater = Crater::new([0.5, 0.5].into(), &CraterParams::DEFAULT, 7)?;
/// assert_eq!(crater.depth_at(crater.center()), 1.0);
/// assert!((0.05..0.2).contains(&crater.reach()));
/// assert_eq!(crater.depth_at([0.7, 0.5].into()), 0.0);
/// assert_eq!(crater.contours().rings.len(), 3);
/// # Ok::<(), bevy_crack::relief::ReliefError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Crater {
    center: Vec2,
    /// Corners relative to the center: a ring for each terrace, the outermost first.
    rings: Vec<[Vec2; CORNERS]>,
    /// For each sector and ring: the function of the place relative to the center that is 1 on the ring's side.
    sectors: Vec<[Vec2; MOST_TERRACES]>,
    /// The farthest corner, pattern units.
    reach: f32,
    walls: f32,
}

/// A number that grows with the angle of a vector, 0..=4 for a whole turn from the x axis, without trigonometry.
#[inline(always)]
fn turn(at: Vec2) -> f32 {
    let share = at.y / (at.x.abs() + at.y.abs()).max(1e-30);
    if at.x < 0.0 {
        2.0 - share
    } else if at.y < 0.0 {
        4.0 + share
    } else {
        share
    }
}

/// The unit vector whose [`turn`] is `turn`.
fn direction(turn: f32) -> Vec2 {
    let inside = turn - turn.floor();
    let at = match turn as u32 % 4 {
        0 => Vec2::new(1.0 - inside, inside),
        1 => Vec2::new(-inside, 1.0 - inside),
        2 => Vec2::new(inside - 1.0, -inside),
        _ => Vec2::new(inside, inside - 1.0),
    };
    at.normalize()
}

/// The radii of a polygon on all rays, about 1: few corners, whose sides are broken `levels` times, and longer in one direction.
fn chords(count: u32, levels: u32, uneven: f32, rng: &mut Rng) -> [f32; CORNERS] {
    let mut corners: Vec<Vec2> = (0..count)
        .map(|k| {
            let place = (k as f32 + 0.7 * (rng.unit() - 0.5)) / count as f32;
            direction(4.0 * (place - place.floor())) * (1.0 + 0.7 * uneven * rng.signed())
        })
        .collect();
    for _ in 0..levels {
        let sides: Vec<_> = corners.iter().copied().zip(corners.iter().copied().cycle().skip(1)).collect();
        let broken = |(a, b): (Vec2, Vec2)| {
            let (along, aside) = (0.3 + 0.4 * rng.unit(), 0.22 * uneven * rng.signed());
            [a, a + (b - a) * along + (b - a).perp() * aside]
        };
        corners = sides.into_iter().flat_map(broken).collect();
    }
    let (way, by) = (direction(4.0 * rng.unit()), 1.0 + 0.5 * uneven * rng.unit());
    for corner in &mut corners {
        let along = way * corner.dot(way);
        *corner = along * by + (*corner - along) / by;
    }
    corners.sort_by(|a, b| turn(*a).total_cmp(&turn(*b)));
    let radii: [f32; CORNERS] = std::array::from_fn(|i| {
        let ray = direction(4.0 * i as f32 / CORNERS as f32);
        let next = corners.partition_point(|corner| turn(*corner) <= turn(ray));
        let [a, b] = [(next + corners.len() - 1) % corners.len(), next % corners.len()].map(|k| corners[k]);
        let radius = a.perp_dot(b) / ray.perp_dot(b - a);
        if radius.is_finite() { radius.clamp(0.25, 1.7) } else { 1.0 }
    });
    // Brittle material leaves no thorns.
    std::array::from_fn(|i| {
        let beside = radii[(i + CORNERS - BESIDE) % CORNERS].max(radii[(i + BESIDE) % CORNERS]);
        radii[i].min(1.15 * beside)
    })
}

impl Crater {
    /// The crater of a hit at `center`, pattern units.
    ///
    /// # Errors
    /// [`ReliefError::OutOfRange`] if a number of `params` or of `center` is out of its range or not finite.
    pub fn new(center: Vec2, params: &CraterParams, seed: u64) -> Result<Self, ReliefError> {
        params.validate()?;
        let most = 1e4;
        for value in center.to_array() {
            if !(-most..=most).contains(&value) {
                return Err(ReliefError::OutOfRange { name: "center", value, min: -most, max: most });
            }
        }
        let mut rng = Rng::new(seed).stream("crater");
        let radii = Self::radii(params, &mut rng);
        let rays: [_; CORNERS] = std::array::from_fn(|i| direction(4.0 * i as f32 / CORNERS as f32));
        let rings: Vec<[_; CORNERS]> = radii.iter().map(|radii| std::array::from_fn(|i| rays[i] * radii[i])).collect();
        let sector = |i: usize| {
            let mut sides = [Vec2::ZERO; MOST_TERRACES];
            for (side, ring) in sides.iter_mut().zip(&rings) {
                let [a, b] = [ring[i], ring[(i + 1) % CORNERS]];
                *side = (b - a).perp() / b.perp_dot(a);
            }
            sides
        };
        let sectors = (0..CORNERS).map(sector).collect();
        let reach = radii[0].iter().fold(0.0, |most: f32, &radius| most.max(radius));
        Ok(Self { center, rings, sectors, reach, walls: params.walls })
    }

    /// Radii of the corners of all rings, pattern units.
    fn radii(params: &CraterParams, rng: &mut Rng) -> Vec<[f32; CORNERS]> {
        let n = params.terraces as usize;
        let roughness = params.roughness;
        let mut outline = |count: u32, uneven: f32| {
            let levels = if uneven < 0.65 { 1 } else { 2 };
            chords(count + rng.next_u32() % 3, levels, uneven, rng)
                .map(|radius| 1.0 + (1.1 * roughness).min(1.0) * (radius - 1.0))
        };
        let mut radii = outline(6, roughness).map(|radius| params.radius * radius);
        let mut rings = vec![radii];
        for ring in 1..n {
            let mean = (n - ring) as f32 / (n - ring + 1) as f32;
            for (radius, share) in radii.iter_mut().zip(outline(5, 0.8 * roughness)) {
                // Never outside of the ring around it.
                *radius *= (mean * share).clamp(0.15, 0.93);
            }
            rings.push(radii);
        }
        rings
    }

    /// The rings: level 0 around the crater, 1, 2, ... deeper inside. 72 corners each.
    #[must_use]
    pub fn contours(&self) -> Contours {
        let ring = |(ring, level): (&[Vec2; CORNERS], i32)| Ring {
            points: ring.iter().map(|&corner| self.center + corner).collect(),
            level,
        };
        let distance = self.reach / self.rings.len() as f32;
        Contours { rings: self.rings.iter().zip(0..).map(ring).collect(), distance }
    }

    /// Where it is, pattern units.
    #[must_use]
    pub const fn center(&self) -> Vec2 {
        self.center
    }

    /// How far the crater reaches from its center, pattern units.
    #[must_use]
    pub const fn reach(&self) -> f32 {
        self.reach
    }

    /// How deep a place lies: 0 outside, 1 at the bottom, `k / terraces` on ring `k`.
    #[must_use]
    pub fn depth_at(&self, pos: Vec2) -> f32 {
        self.depth(pos - self.center)
    }

    #[inline(always)]
    fn depth(&self, at: Vec2) -> f32 {
        if at.length_squared() > self.reach * self.reach {
            return 0.0;
        }
        let sector = ((turn(at) * (CORNERS as f32 / 4.0)) as usize).min(CORNERS - 1);
        let n = self.rings.len();
        // Above 1 outside of a ring, below it inside.
        let places = self.sectors[sector].map(|side| side.dot(at));
        let inside = places[..n].iter().filter(|&&place| place < 1.0).count();
        if inside == 0 {
            return 0.0;
        }
        let from_outer = 1.0 - places[inside - 1];
        let share = if inside == n {
            from_outer
        } else {
            // Of the way along the ray from ring to ring.
            let along = (places[inside] - 1.0) * (places[inside - 1] / places[inside]);
            from_outer / (from_outer + along)
        };
        let left = 1.0 - share;
        // Even slopes to shells: steep below the edge, then flat.
        let wall = 1.0 - left * left * left;
        (inside as f32 - 1.0 + share + (wall - share) * self.walls) / n as f32
    }

    /// Writes the depths of the texels of a rectangle, whose top left texel is `min`, row by row: those that are deeper than what is
    /// there. 65535 is the bottom times `depth`.
    ///
    /// `depth` is clamped to 0..=1.
    ///
    /// ```
    /// use bevy_crack::{Grid, pattern::SurfaceFrame, relief::{Crater, CraterParams}};
    ///
    /// let crater = Crater::new([0.5, 0.5].into(), &CraterParams::DEFAULT, 7)?;
    /// let mut depths = Grid::new([32, 32].into(), 0u16);
    /// crater.fill([112, 112].into(), &SurfaceFrame::new([256, 256].into())?, 1.0, &mut depths);
    /// assert!(depths.get(16, 16) > Some(60_000));
    /// assert_eq!(depths.get(0, 0), Some(0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn fill(&self, min: UVec2, frame: &SurfaceFrame, depth: f32, out: &mut Grid<u16>) {
        let scale = 65_535.0 * depth.clamp(0.0, 1.0);
        for y in 0..out.height() {
            for (x, out) in out.row_mut(y).iter_mut().enumerate() {
                let texel = min.as_vec2() + Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let deep = (self.depth(frame.to_pos(texel) - self.center) * scale + 0.5) as u16;
                *out = (*out).max(deep);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random(rng: &mut Rng) -> (Crater, CraterParams) {
        let params = CraterParams {
            radius: rng.range(0.01, 0.3),
            terraces: 1 + rng.next_u32() % 4,
            roughness: rng.unit(),
            walls: rng.unit(),
        };
        let center = Vec2::new(rng.unit(), rng.unit());
        (Crater::new(center, &params, u64::from(rng.next_u32())).unwrap(), params)
    }

    fn is_inside(points: &[Vec2], at: Vec2) -> bool {
        let sides = points.iter().zip(points.iter().cycle().skip(1));
        let crosses = |(a, b): &(&Vec2, &Vec2)| {
            (a.y > at.y) != (b.y > at.y) && at.x < a.x + (at.y - a.y) * (b.x - a.x) / (b.y - a.y)
        };
        sides.filter(crosses).count() % 2 == 1
    }

    #[test]
    fn depths_are_those_of_the_rings_around_a_place() {
        let mut rng = Rng::new(1);
        for _ in 0..150 {
            let (crater, params) = random(&mut rng);
            let contours = crater.contours();
            assert!(contours.rings.iter().all(|ring| ring.signed_area() > 0.0));
            for _ in 0..200 {
                let at = crater.center + 1.3 * params.radius * Vec2::new(rng.signed(), rng.signed());
                let inside = contours.rings.iter().filter(|ring| is_inside(&ring.points, at)).count() as f32;
                let depth = crater.depth_at(at) * params.terraces as f32;
                let low = (inside - 1.0).max(0.0);
                assert!((low - 1e-3..=inside + 1e-3).contains(&depth), "{depth} within {inside} rings");
            }
            for ring in &contours.rings {
                for corner in &ring.points {
                    let depth = crater.depth_at(*corner) * params.terraces as f32;
                    assert!((depth - ring.level as f32).abs() < 2e-2, "{depth} at a corner of ring {}", ring.level);
                }
            }
        }
    }

    #[test]
    fn depths_are_continuous_and_grow_towards_the_center() {
        let mut rng = Rng::new(2);
        for _ in 0..100 {
            let (crater, params) = random(&mut rng);
            let ray = direction(4.0 * rng.unit());
            let mut last = 1.0;
            for i in 0..=1000u16 {
                let depth = crater.depth(ray * (1.4 * params.radius * f32::from(i) / 1000.0));
                assert!(depth <= last + 1e-5 && last - depth < 0.12, "{last} {depth}");
                last = depth;
            }
            let around = |i: u16| crater.depth(0.5 * params.radius * direction(f32::from(i) / 1000.0));
            for i in 0..3999 {
                assert!((around(i) - around(i + 1)).abs() < 0.06);
            }
        }
    }

    #[test]
    fn the_seed_decides_and_numbers_are_checked() {
        let make = |seed| Crater::new(Vec2::ZERO, &CraterParams::DEFAULT, seed).unwrap();
        assert!(make(1) == make(1) && make(1) != make(2));
        let wrong = [
            CraterParams { radius: 0.0, ..CraterParams::DEFAULT },
            CraterParams { terraces: 0, ..CraterParams::DEFAULT },
            CraterParams { terraces: 5, ..CraterParams::DEFAULT },
            CraterParams { roughness: f32::NAN, ..CraterParams::DEFAULT },
            CraterParams { walls: -1.0, ..CraterParams::DEFAULT },
        ];
        for params in wrong {
            assert!(matches!(Crater::new(Vec2::ZERO, &params, 1), Err(ReliefError::OutOfRange { .. })), "{params:?}");
        }
        assert!(Crater::new(Vec2::new(0.0, f32::NAN), &CraterParams::DEFAULT, 1).is_err());
        assert!(make(3).depth_at(Vec2::splat(f32::NAN)).is_finite());
    }
}
