//! [`Material`]: the shipped libraries of primitives, drawn by a generator.

use super::{
    line::{PrimitiveLine, PrimitivePoint},
    primitive::Primitive,
};
use crate::{
    Grid,
    math::{Rng, ops},
    pattern::{PathPoint, SegmentPath, SurfaceFrame},
    raster::{DepthField, Profile, stamp_path},
};
use glam::{UVec2, Vec2};

/// A library of primitives that ships with the crate.
///
/// ```
/// use bevy_crack::strands::Material;
///
/// assert_eq!(Material::Sand.name(), "sand");
/// assert_eq!(Material::Sand.primitives().len(), 6);
/// assert!(Material::Sand.nets().iter().all(|primitive| primitive.has_sides()));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Material {
    /// Zigzag lines of uneven width, with short side cracks.
    Asphalt,
    /// Thin lines of straight runs and sharp kinks.
    Marble,
    /// Thick, ragged lines with many short notches.
    Sand,
    /// Nearly straight hairlines that split at small angles.
    Glass,
    /// Smooth bends of even width.
    Clay,
}

/// How the lines of a material look. Lengths are shares of a primitive's height.
struct Style {
    /// Number of pieces of the main line, a power of two.
    pieces: usize,
    /// Displacement of the middle, and the ratio from one halving to the next.
    bend: f32,
    finer: f32,
    /// Share of displacements that are much larger than the others.
    kinks: f32,
    width: f32,
    /// How much widths vary, 0..1.
    uneven: f32,
    /// How little the width changes from point to point, 0..1.
    even: f32,
    /// Number of side lines, their lengths and their angle to the main line, radians.
    hairs: usize,
    hair: (f32, f32),
    angle: (f32, f32),
    /// Width of a side line where it begins, as a share of the main line's.
    hair_width: f32,
}

/// Size of the images, texels.
const SIZE: UVec2 = UVec2::new(96, 192);
const NET_SIZE: UVec2 = UVec2::new(160, 160);

/// Number of primitives of a library.
const COUNT: u64 = 6;
const NET_COUNT: u64 = 4;

impl Material {
    /// All materials.
    pub const ALL: [Self; 5] = [Self::Asphalt, Self::Marble, Self::Sand, Self::Glass, Self::Clay];

    const fn style(self) -> Style {
        match self {
            Self::Asphalt => Style {
                pieces: 32,
                bend: 0.11,
                finer: 0.68,
                kinks: 0.35,
                width: 0.03,
                uneven: 0.75,
                even: 0.3,
                hairs: 3,
                hair: (0.05, 0.22),
                angle: (0.6, 1.3),
                hair_width: 0.45,
            },
            Self::Marble => Style {
                pieces: 16,
                bend: 0.07,
                finer: 0.5,
                kinks: 0.6,
                width: 0.016,
                uneven: 0.45,
                even: 0.4,
                hairs: 1,
                hair: (0.12, 0.35),
                angle: (0.4, 0.9),
                hair_width: 0.5,
            },
            Self::Sand => Style {
                pieces: 64,
                bend: 0.1,
                finer: 0.74,
                kinks: 0.25,
                width: 0.085,
                uneven: 0.55,
                even: 0.6,
                hairs: 8,
                hair: (0.05, 0.1),
                angle: (0.8, 1.5),
                hair_width: 0.75,
            },
            Self::Glass => Style {
                pieces: 16,
                bend: 0.012,
                finer: 0.5,
                kinks: 0.2,
                width: 0.008,
                uneven: 0.2,
                even: 0.5,
                hairs: 1,
                hair: (0.2, 0.5),
                angle: (0.2, 0.45),
                hair_width: 0.5,
            },
            Self::Clay => Style {
                pieces: 16,
                bend: 0.08,
                finer: 0.4,
                kinks: 0.0,
                width: 0.035,
                uneven: 0.25,
                even: 0.6,
                hairs: 0,
                hair: (0.0, 0.0),
                angle: (0.0, 0.0),
                hair_width: 0.0,
            },
        }
    }

    /// The primitives of a line of cracks, with connectors at head and tail. They are the same on every machine.
    #[must_use]
    pub fn primitives(self) -> Vec<Primitive> {
        let style = self.style();
        (0..COUNT).map(|i| style.strip(&mut Rng::new(i).stream(self.name()))).collect()
    }

    /// The primitives of nets, with connectors on all four sides. They are the same on every machine.
    #[must_use]
    pub fn nets(self) -> Vec<Primitive> {
        let style = self.style();
        (0..NET_COUNT).map(|i| style.net(&mut Rng::new(i).stream(self.name()).stream("nets"))).collect()
    }

    /// Name of the material, lower case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Asphalt => "asphalt",
            Self::Marble => "marble",
            Self::Sand => "sand",
            Self::Glass => "glass",
            Self::Clay => "clay",
        }
    }
}

impl Style {
    fn strip(&self, rng: &mut Rng) -> Primitive {
        let main = self.line(Vec2::ZERO, Vec2::Y, self.pieces, rng);
        let mut lines = vec![PrimitiveLine { from: None, points: self.widen(main, 1.0, 0.0, rng) }];
        self.add_hairs(&mut lines, self.hairs, rng);
        Primitive::new(draw(&lines, SIZE), lines, None)
    }

    /// A main line and two more from it to the sides.
    fn net(&self, rng: &mut Rng) -> Primitive {
        let middle = Vec2::new(0.16 * rng.signed(), 0.5 + 0.12 * rng.signed());
        let half = self.pieces / 2;
        let mut main = self.line(Vec2::ZERO, middle, half, rng);
        main.extend(self.line(middle, Vec2::Y, half, rng).into_iter().skip(1));
        let mut lines = vec![PrimitiveLine { from: None, points: self.widen(main, 1.0, 0.0, rng) }];
        for x in [-0.5, 0.5] {
            let from = (0.5 + 0.3 * rng.signed()) * self.pieces as f32;
            let begin = lines[0].points[from as usize].at;
            let way = self.line(begin, Vec2::new(x, 0.5), half, rng);
            let points = self.widen(way, 0.85, 0.0, rng).split_off(1);
            lines.push(PrimitiveLine { from: Some((0, from as u32)), points });
        }
        self.add_hairs(&mut lines, self.hairs / 2, rng);
        Primitive::new(draw(&lines, NET_SIZE), lines, Some([1, 2]))
    }

    /// A line by midpoint displacement.
    fn line(&self, from: Vec2, to: Vec2, pieces: usize, rng: &mut Rng) -> Vec<Vec2> {
        let mut points = vec![from; pieces + 1];
        points[pieces] = to;
        let mut span = pieces;
        let mut bend = self.bend * from.distance(to);
        while span > 1 {
            for left in (0..pieces).step_by(span) {
                let (a, b) = (points[left], points[left + span]);
                let size = if rng.unit() < self.kinks { 1.6 } else { 0.7 };
                let aside = (b - a).perp().normalize_or_zero() * (bend * size * rng.signed());
                points[left + span / 2] = a.lerp(b, 0.5 + 0.15 * rng.signed()) + aside;
            }
            bend *= self.finer;
            span /= 2;
        }
        points
    }

    /// Gives a line widths: `share` of the style's, that fall to `1 - narrows` of it.
    fn widen(&self, line: Vec<Vec2>, share: f32, narrows: f32, rng: &mut Rng) -> Vec<PrimitivePoint> {
        let last = (line.len() - 1) as f32;
        let phase = rng.range(0.0, std::f32::consts::TAU);
        let mut rough = 0.0;
        let points = line.into_iter().enumerate().map(|(i, at)| {
            let along = i as f32 / last;
            rough += (1.0 - self.even) * (1.3 * rng.signed() - rough);
            // Even at the joints, so that neighbours fit.
            let free = (8.0 * along.min(1.0 - along)).min(1.0);
            let slow = 0.5 * ops::sin(phase + 7.0 * along);
            let uneven = 1.0 + free * self.uneven * (slow + rough);
            PrimitivePoint { at, width: self.width * share * uneven.max(0.3) * (1.0 - narrows * along) }
        });
        points.collect()
    }

    fn add_hairs(&self, lines: &mut Vec<PrimitiveLine>, count: usize, rng: &mut Rng) {
        for _ in 0..count {
            let main = &lines[0].points;
            let from = 2 + (rng.unit() * (main.len() - 5) as f32) as usize;
            let along = (main[from + 1].at - main[from - 1].at).normalize_or(Vec2::Y);
            let along = if rng.unit() < 0.5 { along } else { -along };
            let side = if rng.unit() < 0.5 { 1.0 } else { -1.0 };
            let way = ops::unit(side * rng.range(self.angle.0, self.angle.1)).rotate(along);
            let begin = main[from].at;
            let end = begin + way * rng.range(self.hair.0, self.hair.1);
            let end = end.clamp(Vec2::new(-0.24, 0.02), Vec2::new(0.24, 0.98));
            let line = self.line(begin, end, (self.pieces / 4).max(2), rng);
            let share = self.hair_width * main[from].width / self.width;
            let points = self.widen(line, share, 0.85, rng).split_off(1);
            lines.push(PrimitiveLine { from: Some((0, from as u32)), points });
        }
    }
}

/// The height image of lines.
fn draw(lines: &[PrimitiveLine], size: UVec2) -> Grid<u16> {
    let Ok(frame) = SurfaceFrame::new(size) else { return Grid::new(size, 0) };
    // Heights of the image to pattern units.
    let unit = size.y as f32 / frame.texels_per_unit();
    let middle = Vec2::new(0.5 * frame.extent().x, 0.0);
    let mut field = DepthField::new(frame);
    let width = lines[0].points.iter().map(|point| point.width).fold(0.0, f32::max) * unit;
    let profile = Profile { full_width: (0.6 * width).max(1.0e-4), wall: 0.5, faintest: 1.0, ..Profile::DEFAULT };
    let place = |point: &PrimitivePoint| PathPoint { pos: middle + point.at * unit, width: point.width * unit };
    for line in lines {
        let begin = line.from.and_then(|(line, point)| lines.get(line as usize)?.points.get(point as usize));
        let begin = begin.map(|from| PathPoint { width: line.points[0].width * unit, ..place(from) });
        let points: Vec<_> = begin.into_iter().chain(line.points.iter().map(place)).collect();
        for ends in points.windows(2) {
            stamp_path(&mut field, &profile, &SegmentPath::straight(ends[0], ends[1]));
        }
    }
    field.depth
}
