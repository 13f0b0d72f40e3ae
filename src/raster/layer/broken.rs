//! The outlines of material that a hit breaks off, and the chips around it.

use super::{
    crushed::CrushedZone,
    draws,
    noise::{draw, noise},
    outline::{FAR_OUT, Outline, WIDEST},
};
use crate::{
    math::{mix, ops},
    pattern::Bricks,
    relief::{Crater, CraterParams},
};
use glam::Vec2;

/// Length of shadows, in units of the height of the caster, and how dark they are.
pub(super) const SHADOW: f32 = 0.75;

/// The same inside crumbling material.
pub(super) const LONG_SHADOW: f32 = 1.1;

/// A chip that lies beside the zone.
#[derive(Debug)]
pub(super) struct Chip {
    pub(super) outline: Outline,
    /// Its difference in brightness.
    pub(super) tone: f32,
    /// Width of the line around it, texels.
    pub(super) ink: f32,
}

/// A part of a brick's face that has come off, with some of the mortar beside it.
#[derive(Debug)]
pub(super) struct Face {
    outline: Outline,
    /// Opposite corners of the brick.
    min: Vec2,
    max: Vec2,
    /// How far the mortar has come off beside the sides at `min` and at `max`, texels.
    mortar: [Vec2; 2],
    /// Size of the notches in that mortar, texels.
    notch: f32,
    seed: u32,
    /// How deep its floor is in the middle, as a share of the depth, and how much deeper per texel.
    floor: f32,
    lean: Vec2,
}

/// Sizes of the parts that come off the bricks around a hit, in radii.
const FACES: [f32; 4] = [1.9, 1.1, 0.75, 0.45];

/// Least and largest depth of the floor where a face has come off, as a share of the depth, and how much deeper it is
/// at the side towards the hit.
const FLOORS: [f32; 2] = [0.4, 0.8];
const LEAN: f32 = 0.35;

/// The same for the mortar, and how much darker it is between bricks.
const MORTAR: f32 = 0.8;
const IN_JOINT: f32 = 0.7;

/// Radius within which a hit breaks out the mortar too, in radii.
const CORE: f32 = 0.85;

impl Face {
    /// Those of the bricks around a hit, each larger than the next.
    fn all(bricks: &Bricks, crushed: &CrushedZone, (unit, radius): (f32, f32), seed: u32) -> Vec<Self> {
        let bricks: Vec<[Vec2; 2]> = bricks.iter().copied().filter(|[min, max]| min != max).collect();
        let first = (draw(seed, -3, 1) * bricks.len() as f32) as usize;
        let (joint, jag) = (joint_between(&bricks).min(0.5 * radius), crushed.jag * unit);
        let face = |k: usize| {
            let [min, max] = bricks[(first + k) % bricks.len()];
            let seed = mix_in(seed, 0x400 + k as u32);
            let most = radius * crushed.reach / (1.0 + WIDEST * crushed.ragged);
            let size = (FACES[k] * radius * (0.85 + 0.3 * draw(seed, -3, 2))).min(0.75 * most);
            let near = Vec2::ZERO.clamp(min, max);
            let centre = near + (0.5 * (min + max) - near).clamp_length_max(0.3 * size);
            let pick = |what: i32| draw(seed, -3, what);
            // Beside most sides nearly all of the mortar comes off, beside some hardly any; crumbling leaves less.
            let gone = |what: i32| jag + joint * if pick(what) < 0.85 { 0.8 + 0.6 * pick(what + 1) } else { 0.2 };
            let mortar = [Vec2::new(gone(3), gone(5)), Vec2::new(gone(7), gone(9))];
            // Deeper towards the hit, and a little to one side.
            let lean = (-centre.normalize_or_zero() + 0.9 * (Vec2::new(pick(11), pick(12)) - 0.5)) * (LEAN / size);
            Self {
                outline: Outline::new(centre, size, 6, 2, 0.8 * crushed.ragged, seed),
                min,
                max,
                mortar,
                notch: joint.max(2.0),
                seed,
                floor: FLOORS[0] + (FLOORS[1] - FLOORS[0]) * pick(13),
                lean,
            }
        };
        (0..bricks.len()).map(face).collect()
    }

    /// Distance of a place from the edge of what has come off, and from that of its brick; positive inside.
    fn within_at_most(&self, at: Vec2, most: f32) -> f32 {
        let within = self.outline.within_at_most(at, most);
        let beside = self.beside(at);
        if within <= beside.min_element() || within < 0.0 {
            return within.min(beside.min_element());
        }
        let bump = noise(self.seed, at.x / self.notch, at.y / self.notch);
        let notched = 0.85 + 0.3 * bump;
        let beyond = (at - self.min + notched * self.mortar[0]).min(self.max - at + notched * self.mortar[1]);
        within.min(beyond.min_element())
    }

    /// Distances from the sides of its brick; positive inside.
    fn beside(&self, at: Vec2) -> Vec2 {
        (at - self.min).min(self.max - at)
    }
}

/// Width of the joints between bricks, texels.
fn joint_between(bricks: &[[Vec2; 2]]) -> f32 {
    let gaps = bricks.iter().flat_map(|[_, max]| bricks.iter().map(move |[min, _]| *min - *max));
    gaps.flat_map(|gap| [gap.x, gap.y]).filter(|gap| *gap > 0.0).fold(f32::MAX, f32::min)
}

/// Broken-off pieces and where they lie; positions relative to the hit, texels.
#[derive(Debug)]
pub(super) struct Broken {
    /// The crater and the flakes around it.
    off: Vec<Outline>,
    /// Faces of bricks that have come off, in place of those: each is the part of an outline that lies in its brick.
    faces: Vec<Face>,
    /// Where it goes down further, step by step.
    pub(super) steps: Vec<Outline>,
    chips: Vec<Chip>,
    /// Strokes between two places; the first end is the wide one.
    pub(super) ticks: Vec<[Vec2; 2]>,
    pub(super) thick: f32,
    pub(super) pit: Option<Outline>,
}

impl Broken {
    /// Whether there are ledges below the edge, and not only a step or none.
    pub(super) fn has_ledges(&self) -> bool {
        self.steps.len() > 1
    }

    pub(super) fn new(crushed: &CrushedZone, unit: f32, radius: f32, grain: f32, seed: u32, bricks: &Bricks) -> Self {
        let CrushedZone { ragged, reach, fall, .. } = *crushed;
        let more = root_of_energy(crushed, unit, radius);
        let pick = |k: u32, what: i32| draw(seed ^ draws::PIECES, k as i32, what);
        let crumbles = crushed.jag > 0.0;
        let faces = Face::all(bricks, crushed, (unit, radius), seed ^ draws::FACES);
        let (off, steps) = if faces.is_empty() {
            crater_and_flakes(crushed, unit, radius, seed)
        } else {
            // Mortar breaks out only where the hit is, and beside the faces.
            let core = Outline::new(Vec2::ZERO, radius * CORE, 8, 2, 0.8 * ragged, mix_in(seed, 0x500));
            (vec![shaped(core, crushed, mix_in(seed, 0x501))], Vec::new())
        };
        // Craters from contours have more chips around them, and slightly larger ones.
        let (many, large) = if crushed.terraces > 0 { (58.0, 1.05) } else { (24.0, 1.0) };
        let chips = (many * crushed.chips * more).round().min(96.0) as u32;
        let is_drawn = crushed.outline > 0.0;
        let chips: Vec<Chip> = (0..chips)
            .map(|k| {
                let size = if crumbles {
                    // Many small chips, few large ones.
                    large * grain * (0.3 + 0.13 * (1.0 / (0.12 + pick(k, 6)) - 0.9))
                } else {
                    grain * (0.4 + pick(k, 6) * pick(k, 7))
                };
                let size = size.min(0.4 * radius);
                let mut way = ops::unit(std::f32::consts::TAU * pick(k, 8));
                if way.y < 0.3 && pick(k, 9) < fall {
                    way.y = 0.3 + way.y.abs();
                }
                let least = if is_drawn { 1.25 } else { 0.95 };
                let near = least + (0.85 * reach - least) * pick(k, 10) * pick(k, 11).sqrt();
                let far = near * radius;
                let far = if crumbles { far.min(radius * reach - 2.2 * size) } else { far };
                let centre = way.normalize_or(Vec2::Y) * far;
                // Four corners alone are now and then a square.
                let (count, levels) = if crumbles { (5, 1) } else { (4, 0) };
                let count = count + (2.0 * pick(k, 12)) as u32;
                let outline = Outline::new(centre, size, count, levels, 0.6, mix_in(seed, 0x200 + k));
                Chip { outline, tone: 0.34 * pick(k, 13) - 0.08, ink: crushed.outline * unit }
            })
            .collect();
        let pit = (crushed.pit > 0.0).then(|| {
            Outline::new(Vec2::ZERO, radius * crushed.pit, 5 + (2.6 * pick(0, 20)) as u32, 1, 0.55, seed ^ draws::PIT)
        });
        // Two strokes behind each of the first chips.
        let ticks = (0..crushed.ticks)
            .zip(chips.iter().flat_map(|chip: &Chip| [chip, chip]))
            .map(|(k, Chip { outline, .. })| {
                let way = outline.centre.normalize_or(Vec2::Y);
                let side = way.perp() * (if k % 2 == 0 { 0.5 } else { -0.5 });
                let near = outline.centre - (way * (1.5 + 0.4 * pick(k, 22)) + side) * outline.reach;
                [near, near - way * (1.0 + 1.1 * pick(k, 24)) * outline.reach]
            })
            .collect();
        Self { off, faces, steps, chips, ticks, thick: 0.8 * crushed.outline * unit, pit }
    }

    /// What of it reaches into a rectangle, texels from the hit.
    pub(super) fn near(&self, min: Vec2, max: Vec2, depth: f32) -> NearBroken<'_> {
        let is_near = |outline: &Outline, beyond: f32| {
            let nearest = outline.centre.clamp(min - 1.0, max + 1.0);
            nearest.distance_squared(outline.centre) <= (outline.reach + beyond) * (outline.reach + beyond)
        };
        let shadow = 3.0 + LONG_SHADOW.max(SHADOW) * depth;
        NearBroken {
            whole: self,
            off: self.off.iter().filter(|outline| is_near(outline, shadow)).collect(),
            faces: self.faces.iter().filter(|face| is_near(&face.outline, shadow)).collect(),
            chips: self.chips.iter().filter(|chip| is_near(&chip.outline, 2.0 + chip.outline.reach)).collect(),
        }
    }
}

/// What of it is near some texels.
pub(super) struct NearBroken<'a> {
    pub(super) whole: &'a Broken,
    off: Vec<&'a Outline>,
    faces: Vec<&'a Face>,
    pub(super) chips: Vec<&'a Chip>,
}

impl NearBroken<'_> {
    /// Distance of a place from the edge of the broken-off area; positive inside, and `most` where it is so much or more.
    pub(super) fn within_at_most(&self, at: Vec2, most: f32) -> f32 {
        let off = self.off.iter().map(|outline| outline.within_at_most(at, most));
        off.chain(self.faces.iter().map(|face| face.within_at_most(at, most))).fold(-FAR_OUT, f32::max)
    }

    /// The floor where bricks are: its depth as a share of the depth, and how much darker it is. `None` if there are no bricks.
    pub(super) fn masonry(&self, at: Vec2) -> Option<[f32; 2]> {
        if self.whole.faces.is_empty() {
            return None;
        }
        // Corners and edges of the bricks are chipped.
        let inside = |face: &&Face| {
            let (within, most) = (face.beside(at).min_element(), 0.45 * face.notch);
            let bump = || noise(face.seed ^ draws::CHIPPED, 1.4 * at.x / face.notch, 1.4 * at.y / face.notch);
            within > most || (within > -most && within > most * bump())
        };
        Some(match self.whole.faces.iter().find(inside) {
            Some(face) => [(face.floor + face.lean.dot(at - face.outline.centre)).clamp(0.25, 1.0), 0.0],
            None => [MORTAR, IN_JOINT],
        })
    }
}

/// The crater of a hit at `pos`, all in pattern units. `None` if the zone has no terraces.
pub(super) fn crater(crushed: &CrushedZone, pos: Vec2, radius: f32, seed: u32) -> Option<Crater> {
    let CrushedZone { terraces, ragged: roughness, .. } = *crushed;
    let params = CraterParams { radius, terraces, roughness, ..CraterParams::DEFAULT };
    Crater::new(pos, &params, u64::from(seed ^ draws::CRATER)).ok()
}

/// The edges of a crater and of the flakes around it, and its terraces or its basin.
fn crater_and_flakes(crushed: &CrushedZone, unit: f32, radius: f32, seed: u32) -> (Vec<Outline>, Vec<Outline>) {
    let CrushedZone { ragged, reach, .. } = *crushed;
    let more = root_of_energy(crushed, unit, radius);
    let pick = |k: u32, what: i32| draw(seed ^ draws::PIECES, k as i32, what);
    let crumbles = crushed.jag > 0.0;
    // Less ragged zones have longer chords.
    let levels = if crumbles && ragged < 0.65 { 1 } else { 2 };
    let shape = |outline: Outline, k: u32| shaped(outline, crushed, mix_in(seed, k));
    let count = 6 + (3.0 * pick(0, 0)) as u32;
    let (edge, steps) = terraces(crushed, unit, radius, seed).unwrap_or_else(|| {
        let edge = shape(Outline::new(Vec2::ZERO, radius, count, levels, ragged, seed ^ draws::CRATER), 0x300);
        let basin = (crushed.basin > 0.0).then(|| {
            let centre = Vec2::new(pick(0, 4) - 0.5, pick(0, 5) - 0.3) * (0.3 * radius);
            shape(Outline::new(centre, radius * crushed.basin, 7, 2, 0.8 * ragged, seed ^ draws::BASIN), 0x301)
        });
        (edge, basin.into_iter().collect())
    });
    let mut off = vec![edge];
    let flakes = (crushed.flakes as f32 * more).round().min(64.0) as u32;
    let one = radius / more.max(1.0) * more.max(1.0).sqrt();
    for k in 0..flakes {
        // A few large flakes beside the hit, small ones further out.
        let is_beside = k % 3 == 0;
        let size = one * if is_beside { 0.5 + 0.3 * pick(k, 1) } else { 0.22 + 0.4 * pick(k, 1) * pick(k, 14) };
        let far = if is_beside {
            0.75 * radius + 0.5 * size
        } else {
            radius * (0.9 + pick(k, 2) * pick(k, 15) * (reach - 1.0))
        };
        let far = far.min(radius * reach - 1.8 * size);
        let centre = ops::unit(std::f32::consts::TAU * pick(k, 3)) * far.max(0.0);
        let seed = mix_in(seed, 0x100 + k);
        let (count, levels, ragged) = if crumbles { (7, 2, 0.8) } else { (5, levels, 0.6) };
        off.push(shape(Outline::new(centre, size, count, levels, ragged, seed), 0x340 + k));
    }
    (off, steps)
}

/// The root of the energy of a hit whose zone has this radius, texels.
fn root_of_energy(crushed: &CrushedZone, unit: f32, radius: f32) -> f32 {
    radius / (crushed.radius * unit).max(1.0e-3)
}

/// An outline as it is in the material: pieces of what crumbles are longer one way.
fn shaped(outline: Outline, crushed: &CrushedZone, seed: u32) -> Outline {
    if crushed.jag > 0.0 { outline.stretched(seed) } else { outline }
}

/// The edge of a crater and its terraces, if it has any; texels.
fn terraces(crushed: &CrushedZone, unit: f32, radius: f32, seed: u32) -> Option<(Outline, Vec<Outline>)> {
    let rings = crater(crushed, Vec2::ZERO, radius / unit, seed)?.contours().rings;
    let mut outlines = rings.iter().map(|ring| Outline::through(ring.points.iter().map(|corner| *corner * unit)));
    Some((outlines.next()?, outlines.collect()))
}

/// A different seed for each `k`.
fn mix_in(seed: u32, k: u32) -> u32 {
    mix(u64::from(seed) << 32 | u64::from(k)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CrackPreset;

    /// Bricks lose their faces, and the mortar breaks out where the hit is, and beside faces that are lost, but not further
    /// out.
    #[test]
    fn mortar_breaks_out_at_the_hit() {
        let crushed = CrackPreset::BRICK.look.crushed.unwrap();
        let (unit, joint) = (512.0, 2.0);
        let radius = crushed.radius * unit;
        // A head joint above the bed joint in which the hit is.
        let brick = |min: [f32; 2], max: [f32; 2]| [Vec2::from(min), Vec2::from(max)];
        let bricks = [
            brick([-90.0, -32.0], [-joint, -joint]),
            brick([joint, -32.0], [90.0, -joint]),
            brick([-45.0, joint], [45.0, 32.0]),
            [Vec2::ZERO; 2],
        ];
        let (mut faces, mut mortar) = (0, 0);
        for seed in 0..200 {
            let broken = Broken::new(&crushed, unit, radius, 2.0, seed, &bricks);
            let all = broken.near(Vec2::splat(-200.0), Vec2::splat(200.0), 10.0);
            let is_off = |x: f32, y: f32| all.within_at_most(Vec2::new(x, y), 1.0) > 0.0;
            assert!(is_off(0.0, 0.0), "{seed}: the mortar at the hit");
            for x in [-89.0, -70.0, 70.0, 89.0] {
                assert!(!is_off(x, 0.0), "{seed}: the mortar at {x}");
            }
            let beside = 1.2 * radius;
            faces += [[-beside, -10.0], [beside, -10.0]].iter().filter(|[x, y]| is_off(*x, *y)).count();
            for x in [-1.4 * radius, 1.4 * radius].into_iter().filter(|x| is_off(*x, 0.0)) {
                let mut beside = (-8..=8).flat_map(|by| [-1.0, 1.0].map(|side| (x + by as f32, side * (joint + 0.5))));
                assert!(beside.any(|(x, y)| is_off(x, y)), "{seed}: the mortar at {x} is off, and nothing beside it");
                mortar += 1;
            }
        }
        assert!(faces > 100, "{faces} faces are off further out than the hit");
        assert!(mortar > 60, "{mortar} places in the mortar further out than the hit are off");
    }
}
