//! The content of a crushed zone at a place, in texels.

use super::{
    broken::{Broken, NearBroken},
    bruise::{self, Bruise},
    crushed::CrushedZone,
    draws,
    noise::{floor, hash, lattice, noise},
    outline::{Outline, WIDEST},
};
use crate::pattern::Bricks;
use glam::Vec2;

/// Direction to the light: the upper left.
pub(super) const TO_LIGHT: Vec2 = Vec2::new(-std::f32::consts::FRAC_1_SQRT_2, -std::f32::consts::FRAC_1_SQRT_2);

/// How many clods of loose material lie in the bowl, as a share of those beside it.
const IN_BOWL: f32 = 0.2;

/// The pieces of a crushed zone, wherever they are drawn.
#[derive(Debug)]
pub(super) struct Pieces {
    broken: Option<Broken>,
    /// A hole with a broken edge, and the outer outline of that edge.
    hole: Option<[Outline; 2]>,
    /// Positions relative to the hit, and radii, texels.
    bubbles: Vec<(Vec2, f32)>,
}

/// A crushed zone in texels, with what of it is near the texels that are drawn.
pub(super) struct Shape<'a> {
    pub(super) crushed: &'a CrushedZone,
    pub(super) radius: f32,
    pub(super) depth: f32,
    /// Its radius, in units of that at energy 1.
    pub(super) enlarged: f32,
    pub(super) rough: f32,
    pub(super) grain: f32,
    pub(super) jag: f32,
    pub(super) broken: Option<NearBroken<'a>>,
    pub(super) hole: Option<&'a [Outline; 2]>,
    pub(super) bubbles: Vec<(Vec2, f32)>,
}

/// How a bruise spreads: the distance of a place in its radii, what is left of it there, 0..=1, and noise, -1..=1.
#[derive(Clone, Copy, Default)]
pub(super) struct BruiseSpread {
    pub(super) q: f32,
    pub(super) left: f32,
    pub(super) cloud: f32,
}

/// The content of a place.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) height: f32,
    pub(super) pale: f32,
    pub(super) shade: f32,
    pub(super) dark: f32,
    pub(super) pit: [u8; 3],
}

impl Place {
    pub(super) const NONE: Self = Self { height: 0.0, pale: 0.0, shade: 0.0, dark: 0.0, pit: [0; 3] };
}

impl Pieces {
    pub(super) fn new(crushed: &CrushedZone, unit: f32, radius: f32, seed: u32, bricks: &Bricks) -> Self {
        let grain = grain(crushed, unit);
        Self {
            broken: crushed.broken.then(|| Broken::new(crushed, unit, radius, grain, seed, bricks)),
            hole: (crushed.hole > 0.0 && crushed.edge > 0.0).then(|| {
                let hole = crushed.hole * radius;
                // Within the extent of other outlines.
                let most = radius * crushed.reach.max(1.0 + WIDEST * crushed.ragged) / (1.0 + 0.75 * WIDEST);
                let around = (hole + (0.75 * crushed.edge * hole).max(1.5)).min(most);
                let centre = Vec2::ZERO;
                [
                    Outline::new(centre, hole, 6 + (seed >> 3) % 3, 2, 0.62, seed ^ draws::HOLE),
                    Outline::new(centre, around, 8 + (seed >> 5) % 4, 1, 0.75, seed ^ draws::SHELL),
                ]
            }),
            bubbles: bruise::bubbles(crushed.bubbles, radius, crushed.reach, grain, seed),
        }
    }
}

/// Size of a grain, texels.
const fn grain(crushed: &CrushedZone, unit: f32) -> f32 {
    (crushed.grain * unit).max(1.0)
}

impl<'a> Shape<'a> {
    /// What of a zone with these pieces reaches into a rectangle, texels from the hit.
    pub(super) fn near(
        crushed: &'a CrushedZone,
        unit: f32,
        radius: f32,
        pieces: &'a Pieces,
        [min, max]: [Vec2; 2],
    ) -> Self {
        let depth = crushed.depth * unit;
        let is_near = |&&(middle, radius): &&(Vec2, f32)| {
            let far = middle.clamp(min - 2.0, max + 2.0).distance_squared(middle);
            far <= (radius + 1.0) * (radius + 1.0)
        };
        Self {
            crushed,
            radius,
            depth,
            enlarged: radius / (crushed.radius * unit).max(1.0e-3),
            rough: crushed.rough * unit,
            grain: grain(crushed, unit),
            jag: crushed.jag * unit,
            broken: pieces.broken.as_ref().map(|broken| broken.near(min, max, depth)),
            hole: pieces.hole.as_ref(),
            bubbles: pieces.bubbles.iter().filter(is_near).copied().collect(),
        }
    }

    /// How a bruise spreads to a place at a distance; `cloud` is noise, `bumps` is noise around it.
    pub(super) fn spread_of_bruise(&self, distance: f32, cloud: f32, bumps: [f32; 2]) -> BruiseSpread {
        let CrushedZone { ragged, reach, .. } = self.crushed;
        let radii = distance / self.radius.max(0.5);
        // No outline: the cracks are dense near the hit, and further out there are more and more gaps.
        let stray = 1.0 + ragged * (0.45 * bumps[0] + 0.4 * bumps[1]) + 0.25 * ragged * cloud;
        let q = radii / stray.max(0.3);
        let left = (1.0 - q / reach).min(2.0 * (1.0 - radii / reach)).clamp(0.0, 1.0);
        BruiseSpread { q, left, cloud }
    }

    /// Noise along a bruise.
    #[inline(always)]
    pub(super) fn cloud(&self, at: Vec2, seed: u32) -> f32 {
        noise(seed ^ 10, at.x / (3.0 * self.grain), at.y / (3.0 * self.grain))
    }

    /// Short cracks and flakes that thin out outward. `crazed` is what there is of crossing ones.
    pub(super) fn add_bruise(&self, place: &mut Place, off: Vec2, spread: BruiseSpread, crazed: Bruise, seed: u32) {
        let CrushedZone { pale, speckle, needles, crazing, .. } = *self.crushed;
        let BruiseSpread { q, left, cloud } = spread;
        if left <= 0.0 {
            return;
        }
        let dense = (1.5 * left * left).min(1.0);
        let fine = (self.radius / (8.0 * self.grain)).sqrt().clamp(0.6, 3.0);
        let mut bruise = if crazing < 1.0 { bruise::bruise(off, q, dense, fine, seed) } else { Bruise::default() };
        let mut haze = (1.08 - 0.8 * q).clamp(0.0, 1.0);
        if crazing > 0.0 {
            bruise.crack = bruise.crack * (1.0 - crazing) + crazed.crack * crazing;
            bruise.flake = bruise.flake * (1.0 - crazing) + crazed.flake * crazing;
            // The haze is not uniform.
            haze *= 1.0 - crazing * (0.12 - 0.35 * cloud - 0.3 * crazed.flake);
            place.shade += crazing * needles * (0.5 * crazed.flake - 0.22) * left;
        }
        let uneven = 1.0 - speckle * (0.5 + 0.5 * cloud) * (1.0 - 0.5 * haze);
        let milk = ((1.5 * haze * haze).min(1.0) + (0.55 + 0.75 * crazing) * bruise.flake * left * left) * uneven;
        place.pale = place.pale.max(needles * pale * milk.max(bruise.crack * (0.35 + 0.65 * left)));
        place.shade += needles * 0.35 * speckle * (bruise.flake - 0.3) * left;
        place.height += self.rough * bruise.flake * left * left - self.rough * bruise.crack * left;
    }

    /// A hole with straight sides: its broken wall is visible inside, and chips with sharp sides have come off around
    /// it.
    pub(super) fn add_hole(&self, place: &mut Place, [hole, shell]: &[Outline; 2], off: Vec2) {
        let pale = self.crushed.pale;
        let (within, inward) = hole.side(off);
        let inside = (within + 0.5).clamp(0.0, 1.0);
        let line = |far: f32, thick: f32| (thick + 0.5 - far.abs()).clamp(0.0, 1.0);
        if inside < 1.0 {
            let (chip, slope) = shell.side(off);
            let chipped = (chip + 0.5).clamp(0.0, 1.0) * (1.0 - inside);
            if chipped > 0.0 {
                // Each chip leaves a flat face that slopes down to the hole, with a sharp side.
                let facing = slope.dot(TO_LIGHT);
                let fall = (-within / (chip - within).max(1.0)).clamp(0.0, 1.0);
                let face = 0.14 + 0.40 * facing.max(0.0) + 0.30 * (1.0 - fall);
                let side = 0.75 * line(chip - 0.6, 0.4) * (0.35 + 0.65 * facing.abs());
                let edge = 0.9 * line(within + 0.8, 0.5);
                let keep = 1.0 - 0.75 * chipped;
                place.pale = (place.pale * keep).max(pale * chipped * face.max(side).max(edge));
                place.shade -= 0.28 * chipped * (-facing).max(0.0);
            }
        }
        if inside > 0.0 {
            // Glass is thick: more of the far wall is visible, which is lit.
            let void = (hole.within((off - TO_LIGHT * (0.16 * hole.reach)) * 1.2) + 0.5).clamp(0.0, 1.0);
            let facing = inward.dot(TO_LIGHT);
            let bright =
                (0.10 + 0.50 * facing.max(0.0)).max(0.85 * line(within - 0.7, 0.5) * (0.4 + 0.6 * facing.max(0.0)));
            let wall = bright.max(0.45 * (1.0 - 2.0 * (void - 0.5).abs())) * (1.0 - void);
            place.dark = inside;
            place.pale += (pale * wall - place.pale) * inside;
            place.shade *= 1.0 - inside;
        }
    }

    /// A flat flake to one side of the hit, with arcs around it.
    pub(super) fn add_flake(&self, place: &mut Place, way: Vec2, q: f32, seed: u32) {
        let side = Vec2::new(lattice(seed, 1, 7), lattice(seed, 5, 3)).normalize_or(Vec2::Y);
        let facing = way.dot(side);
        let reach = 1.0 + (self.crushed.flake - 1.0) * (0.45 + 0.55 * facing).max(0.0);
        let inside = ((reach - q) * self.radius + 0.5).clamp(0.0, 1.0);
        if inside <= 0.0 || q <= 0.9 {
            return;
        }
        let share = ((q - 1.0) / (reach - 1.0).max(0.05)).clamp(0.0, 1.0);
        // Arcs, wider apart outward: each is a steep step and a gentle slope back.
        let arcs = 5.0 * share.sqrt() + 0.4 * noise(seed ^ 9, way.x * 2.0, way.y * 2.0);
        let saw = arcs - arcs.floor();
        let strength = inside * (1.0 - 0.6 * share);
        place.height -= 0.35 * self.depth * (1.0 - share) * inside + 0.25 * self.depth * saw * strength;
        place.pale = place.pale.max(self.crushed.pale * strength * (0.04 + 0.30 * saw * saw * saw));
        // Its rim catches the light.
        let rim = (1.0 - ((reach - q) * self.radius - 1.0).abs() / 1.2).clamp(0.0, 1.0);
        place.pale = place.pale.max(0.5 * self.crushed.pale * rim);
    }

    /// A crumb in some of the squares of a lattice.
    pub(super) fn add_crumb(&self, place: &mut Place, at: Vec2, chance: f32, seed: u32) {
        let side = 2.6 * self.grain;
        let ((left, x), (top, y)) = (floor(at.x / side), floor(at.y / side));
        let cell = Vec2::new(left, top);
        let draw = |k: u32| (hash(seed ^ k, x, y) >> 8) as i32 as f32 * (1.0 / 16_777_216.0);
        if draw(20) >= chance {
            return;
        }
        let radius = self.grain * (0.35 + 0.85 * draw(21) * draw(22));
        let middle = (cell + 0.5) * side + (Vec2::new(draw(23), draw(24)) - 0.5) * (side - 2.0 * radius).max(0.0);
        let off = at - middle;
        // A turned square without its corners.
        let turn = Vec2::new(draw(25) - 0.5, draw(26) - 0.5).normalize_or(Vec2::X);
        let (u, v) = (off.dot(turn).abs(), off.perp_dot(turn).abs());
        let far = (0.58 * (u + v)).max(u.max(1.2 * v)) / radius;
        let inside = ((1.0 - far) * radius + 0.5).clamp(0.0, 1.0);
        if inside > 0.0 {
            place.height += 0.9 * radius * (1.0 - far).clamp(0.0, 0.6);
            let pale = self.crushed.pale.max(0.4) * (0.45 + 0.55 * draw(28));
            place.pale = place.pale.max(pale * inside);
            place.shade += (0.9 * draw(27) - 0.55) * inside;
        }
    }

    /// How much of the dust and the crumbs around a hit is left at a distance from it, radii.
    pub(super) fn left_at(&self, radii: f32) -> f32 {
        1.0 - ((radii - 0.8) / (self.crushed.reach - 0.8)).clamp(0.0, 1.0)
    }

    /// A clod of loose material in some of the squares of a lattice, with its shadow; `off` is the offset of the place from the hit.
    pub(super) fn add_clod(&self, place: &mut Place, off: Vec2, at: Vec2, seed: u32) {
        let side = 10.0 * self.grain;
        let ((left, x), (top, y)) = (floor(at.x / side), floor(at.y / side));
        let draw = |k: u32| (hash(seed ^ (draws::CLODS + k), x, y) >> 8) as i32 as f32 * (1.0 / 16_777_216.0);
        if draw(0) >= self.crushed.chips {
            return;
        }
        let radius = self.grain * (0.7 + 1.4 * draw(1) * draw(2));
        let middle = (Vec2::new(left, top) + 0.5) * side
            + (Vec2::new(draw(3), draw(4)) - 0.5) * (side - 3.8 * radius - 1.4).max(0.0);
        // The distance of its middle tells whether it is there, so that it is there as a whole.
        let distance = (off + middle - at).length();
        let left = self.left_at(distance / self.radius.max(0.5));
        // Most of what falls back into the bowl is buried.
        let many = self.crushed.chips * if distance < 0.95 * self.radius { IN_BOWL } else { 1.0 };
        if draw(0) >= many * left * left || distance + 2.0 * radius > self.crushed.reach * self.radius {
            return;
        }
        let turn = Vec2::new(draw(5) - 0.5, draw(6) - 0.5).normalize_or(Vec2::X);
        // Its outline is longer one way, and uneven.
        let inside = |off: Vec2| {
            let size = 0.9 * radius;
            let bump = noise(seed ^ draws::CLOD_OUTLINE, (middle.x + off.x) / size, (middle.y + off.y) / size);
            1.0 - Vec2::new(off.dot(turn), 1.3 * off.perp_dot(turn)).length() / (radius * (1.0 + 0.35 * bump))
        };
        let cover = |inside: f32| (inside * radius + 0.5).clamp(0.0, 1.0);
        let off = at - middle;
        let (here, above) = (inside(off), inside(off + TO_LIGHT * (0.75 * radius)));
        let shadow = cover(above) * (1.0 - cover(here));
        place.height += 1.1 * radius * here.max(0.0).sqrt();
        place.pale = place.pale.max(self.crushed.pale * cover(here).max(shadow));
        place.shade += (0.2 * draw(7) - 0.12) * cover(here) - 0.45 * shadow;
    }
}
