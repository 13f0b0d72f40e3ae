//! [`ContourJob`]: all contours from the seeds, level by level.

use super::{
    contours::{Contours, Ring},
    error::ReliefError,
    fourier::Transform,
    lattice::{Lattice, Loop, double_area, edges, perimeter},
    midpoint::Displacement,
    offset::{Move, Way, least_area, offset},
    pace::{FACTORS, Pace},
    params::{Join, Method, ReliefParams},
    scramble::Scramble,
    seeds::{Seeds, limits},
    simplify::working_copy,
    untangle::{Fill, untangled},
};
use crate::{Grid, math::Rng};
use glam::Vec2;

/// Most points of all seed contours together, and of all rings of one level.
pub const MAX_LEVEL_POINTS: usize = 1 << 20;

/// Most points of all rings.
pub const MAX_RING_POINTS: usize = 1 << 23;

/// Displaced contours keep this share of the distance from the contour before, beyond what displacements take.
const GAP: f64 = 0.25;

/// The share of the distance that is kept before phases are drawn, beyond what these may take.
const KEPT: f64 = 0.24;

/// Corners within this share of the distance from a straight line do not matter for what is kept.
const KEPT_TOLERANCE: f64 = 0.05;

/// Windings of a region whose border may be twisted.
const POSITIVE: Fill = Fill::AtLeast(1);

/// Islands of displaced contours with an area below this share of the squared distance are not made.
const LEAST_DISPLACED_AREA: f64 = 0.01;

/// Corners that may be dropped from a displaced contour lie within this share of the distance from a straight line.
const DROPPED: [f64; 2] = [0.001, 0.1];

/// Corners that samples may miss lie within this share of the distance from the line between samples.
const MISSED: f64 = 0.03;

/// What a job does next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Inward,
    Outward,
    Done,
}

/// The generation of contours as steps of bounded work, for a background task that shows progress and can be stopped.
///
/// Every level comes from the rings of the level before, by [`ReliefParams::method`]. Results depend on parameters,
/// seed contours, factors and seed alone.
///
/// All rings are simple. Rings of one level share single points at most. A level lies within the one before: at the
/// distance less a hundredth with [`Join::Miter`] and [`Join::Round`] in the simple method (less a twentieth where lines are so
/// rough that they cross very often while they move); joins that are nearer to a corner say so; displaced contours keep a fortieth of the
/// distance at least. Islands smaller than a thousandth of the squared distance (a hundredth, where contours are displaced) are not made.
///
/// Work is bounded: a step takes time in proportion to the points of its level and to the places where lines cross while they
/// move, of which there are 2 million at most. Levels have [`MAX_LEVEL_POINTS`] at most, all together [`MAX_RING_POINTS`].
///
/// ```
/// use bevy_crack::relief::{ContourJob, Contours, ReliefParams};
/// use glam::Vec2;
///
/// let seed = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].into_iter().map(Vec2::from_array).collect();
/// let params = ReliefParams { distance: 0.1, ..ReliefParams::SIMPLE };
/// let mut job = ContourJob::new(&params, &[seed], 1)?;
/// while job.step()? {
///     println!("{:.0} %", 100.0 * job.progress());
/// }
/// let contours = job.finish();
/// assert_eq!(contours.levels(), Some((0, 4)));
/// # Ok::<(), bevy_crack::relief::ReliefError>(())
/// ```
#[derive(Clone, Debug)]
pub struct ContourJob {
    params: ReliefParams,
    lattice: Lattice,
    pace: Pace,
    transform: Transform,
    rng: Rng,
    /// `2 d0`: edges longer than this are displaced.
    longest: f64,
    seeds: Vec<Loop>,
    current: Vec<Loop>,
    /// Whether the current rings are a single one, made of a loop that did not meet itself.
    is_lone: bool,
    level: i32,
    stage: Stage,
    rings: Vec<Ring>,
    points: usize,
    /// Within what corners are dropped at the moment, lattice steps.
    dropped: f64,
    /// Areas of the seeds and of the last level inward.
    areas: [f64; 2],
}

fn area(rings: &[Loop]) -> f64 {
    0.5 * rings.iter().map(|ring| double_area(ring)).sum::<i128>() as f64
}

fn count(rings: &[Loop]) -> usize {
    rings.iter().map(Vec::len).sum()
}

/// The shortest mean edge for which midpoints are displaced: finer ones are lost again.
///
/// Moving a line takes away what is much smaller than the distance, and samples of a line cannot hold what is smaller than they are.
fn finest_edge(params: &ReliefParams, rings: &[Loop], distance: f64) -> f64 {
    let longest = rings.iter().map(|ring| perimeter(ring)).fold(0.0, f64::max);
    let samples = if params.method.scrambles() { longest / f64::from(params.samples) } else { 0.0 };
    samples.max(0.25 * distance)
}

impl ContourJob {
    /// A job for the contours around all `seeds` together, closed lines in pattern space, and the random `seed`.
    ///
    /// What is inside is what lines wind round, in any direction: crossing and overlapping lines enclose one region;
    /// a line in another one that runs the other way round is a hole. Points go to a fine lattice (8 million steps
    /// for the farthest coordinate), points that repeat the one before are dropped.
    ///
    /// # Errors
    /// Those of [`ReliefParams::validate`]; [`ReliefError::Contours`], [`ReliefError::TooFewPoints`],
    /// [`ReliefError::TooManyPoints`] above [`MAX_LEVEL_POINTS`], [`ReliefError::Point`]; [`ReliefError::NoArea`];
    /// [`ReliefError::Distance`] if levels are so near that the lattice cannot tell them apart;
    /// [`ReliefError::Tangled`].
    pub fn new(params: &ReliefParams, seeds: &[Vec<Vec2>], seed: u64) -> Result<Self, ReliefError> {
        Self::with_reach(params, seeds, seed, 1.0 + params.steepness)
    }

    /// A job whose distance varies: `factors` covers a surface of the size `extent` from the origin of pattern space, row by row
    /// from the top left. Each value multiplies the distance there, 0.1..=8: small values make steep places.
    ///
    /// ```
    /// use bevy_crack::{Grid, relief::{ContourJob, ReliefParams}};
    ///
    /// let square = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].into_iter().map(Into::into).collect();
    /// let params = ReliefParams { distance: 0.1, ..ReliefParams::SIMPLE };
    /// // Twice as steep everywhere: twice as many levels.
    /// let steep = Grid::new([4, 4].into(), 0.5);
    /// let mut job = ContourJob::with_factors(&params, &[square], 1, steep, [1.0, 1.0].into())?;
    /// while job.step()? {}
    /// assert_eq!(job.finish().levels(), Some((0, 9)));
    /// # Ok::<(), bevy_crack::relief::ReliefError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`ContourJob::new`]; [`ReliefError::Image`], [`ReliefError::Texel`].
    pub fn with_factors(
        params: &ReliefParams,
        seeds: &[Vec<Vec2>],
        seed: u64,
        factors: Grid<f32>,
        extent: Vec2,
    ) -> Result<Self, ReliefError> {
        let mut out = Self::with_reach(params, seeds, seed, FACTORS[1] * (1.0 + params.steepness))?;
        out.pace.set_image(factors, extent, out.lattice)?;
        out.check_distance()?;
        Ok(out)
    }

    fn with_reach(params: &ReliefParams, seeds: &[Vec<Vec2>], seed: u64, pace: f32) -> Result<Self, ReliefError> {
        params.validate()?;
        limits(seeds, MAX_LEVEL_POINTS)?;
        let step = f64::from(params.distance) * f64::from(pace) * (f64::from(params.join.reach()) + 1.0);
        let Seeds { lattice, rings, mean_edge } = Seeds::new(seeds, step * f64::from(params.outward))?;
        let distance = f64::from(params.distance) * lattice.steps();
        let longest = 2.0 * mean_edge.max(finest_edge(params, &rings, distance));
        let stage = if params.inward > 0 { Stage::Inward } else { Stage::Outward };
        let mut out = Self {
            params: *params,
            lattice,
            pace: Pace::new(distance, params.steepness, params.steep_angle),
            transform: Transform::new(params.samples),
            rng: Rng::new(seed),
            longest,
            current: rings.clone(),
            is_lone: false,
            areas: [area(&rings); 2],
            seeds: rings,
            level: 0,
            stage,
            rings: Vec::new(),
            points: 0,
            dropped: 0.01 * distance,
        };
        out.check_distance()?;
        out.add(0)?;
        out.settle();
        Ok(out)
    }

    fn check_distance(&self) -> Result<(), ReliefError> {
        /// Smallest distance, lattice steps.
        const LEAST: f64 = 64.0;
        if self.pace.least() >= LEAST {
            return Ok(());
        }
        let least = (LEAST / self.pace.least() * f64::from(self.params.distance)) as f32;
        Err(ReliefError::Distance { distance: self.params.distance, least })
    }

    /// Adds the current rings to the result.
    fn add(&mut self, level: i32) -> Result<(), ReliefError> {
        let here = count(&self.current);
        self.points += here;
        for (points, most) in [(here, MAX_LEVEL_POINTS), (self.points, MAX_RING_POINTS)] {
            if points > most {
                return Err(ReliefError::TooManyPoints { most });
            }
        }
        let lattice = self.lattice;
        let ring = |points: &Loop| Ring { points: points.iter().map(|&point| lattice.pos(point)).collect(), level };
        self.rings.extend(self.current.iter().map(ring));
        Ok(())
    }

    /// Goes on to the next stage if nothing is left to do in this one.
    fn settle(&mut self) {
        if self.stage == Stage::Inward && (self.current.is_empty() || self.level >= self.params.inward as i32) {
            self.stage = Stage::Outward;
            self.level = 0;
            self.current.clone_from(&self.seeds);
            self.is_lone = false;
        }
        if self.stage == Stage::Outward && -self.level >= self.params.outward as i32 {
            self.stage = Stage::Done;
        }
    }

    /// Makes the next level: inward until nothing is left, then outward. Returns whether there is more to do.
    ///
    /// # Errors
    /// [`ReliefError::TooManyPoints`] if the level has more than [`MAX_LEVEL_POINTS`] or all have more than
    /// [`MAX_RING_POINTS`]; [`ReliefError::Tangled`] if lines cross too often. The levels before are kept.
    pub fn step(&mut self) -> Result<bool, ReliefError> {
        let (way, level) = match self.stage {
            Stage::Inward => (Way::Inward, self.level + 1),
            Stage::Outward => (Way::Outward, self.level - 1),
            Stage::Done => return Ok(false),
        };
        self.current = match self.next(way, level) {
            Ok(rings) => rings,
            Err(error) => {
                self.stage = Stage::Done;
                return Err(error);
            }
        };
        self.level = level;
        if way == Way::Inward {
            self.areas[1] = area(&self.current);
        }
        if let Err(error) = self.add(level) {
            self.stage = Stage::Done;
            return Err(error);
        }
        self.settle();
        Ok(self.stage != Stage::Done)
    }

    /// The rings that follow the current ones.
    fn next(&mut self, way: Way, level: i32) -> Result<Vec<Loop>, ReliefError> {
        let tangled = |_| ReliefError::Tangled { level };
        let method = self.params.method;
        let least = least_area(self.pace.least(), LEAST_DISPLACED_AREA);
        let rng = self.rng.stream("contours").substream(u64::from(level as u32));
        let from = std::mem::take(&mut self.current);
        let known = if std::mem::take(&mut self.is_lone) { from.first().map_or(&[][..], Vec::as_slice) } else { &[] };
        let plain = Move { rings: &from, join: self.params.join, pace: &self.pace, tolerance: 0.0 };
        let mut rings = if method == Method::Improved {
            let mut displaced = from.clone();
            self.displace(&mut displaced, &mut rng.stream("midpoints"))?;
            let (displaced, is_same) = untangled(&displaced, known, POSITIVE, least).map_err(tangled)?;
            let pace = Pace::even(self.room_of_phases() + KEPT * self.pace.least());
            let tolerance = KEPT_TOLERANCE * self.pace.least();
            let kept = Move { join: Join::Round, pace: &pace, tolerance, ..plain };
            let moves = [Move { rings: &displaced, ..plain }, kept];
            // Where midpoints have bridged what is narrow, the level itself must keep its distance too.
            offset(if is_same { &moves[..1] } else { &moves }, way)
        } else {
            offset(&[plain], way)
        }
        .map_err(tangled)?;
        match method {
            _ if rings.is_empty() => return Ok(rings),
            Method::Simple => return Ok(rings),
            Method::Midpoint => self.displace(&mut rings, &mut rng.stream("midpoints"))?,
            Method::Fourier | Method::Improved => self.scramble(&mut rings, &mut rng.stream("phases")),
        }
        let (rings, is_same) = untangled(&rings, &[], POSITIVE, least).map_err(tangled)?;
        self.is_lone = is_same && rings.len() == 1;
        Ok(rings)
    }

    /// How far points may go in all displacements of one level.
    fn room(&self) -> f64 {
        (self.params.join.least() - GAP) * self.pace.least()
    }

    /// How far points may go by displaced midpoints.
    fn room_of_midpoints(&self) -> f64 {
        let share = if self.params.method == Method::Improved { 0.7 } else { 1.0 };
        f64::min(share * self.room(), 2.0 * f64::from(self.params.displacement) * self.pace.least())
    }

    /// How far points may go by new phases.
    fn room_of_phases(&self) -> f64 {
        self.room() - if self.params.method == Method::Improved { self.room_of_midpoints() } else { 0.0 }
    }

    fn displace(&self, rings: &mut [Loop], rng: &mut Rng) -> Result<(), ReliefError> {
        let pieces: f64 = rings.iter().map(|ring| perimeter(ring) / self.longest).sum();
        if pieces > MAX_LEVEL_POINTS as f64 {
            return Err(ReliefError::TooManyPoints { most: MAX_LEVEL_POINTS });
        }
        let displacement = Displacement {
            longest: self.longest,
            most: f64::from(self.params.displacement) * self.pace.least(),
            within: self.room_of_midpoints(),
            angles: [self.params.min_angle, self.params.max_angle],
        };
        for ring in rings {
            *ring = displacement.apply(ring, rng);
        }
        Ok(())
    }

    fn scramble(&mut self, rings: &mut [Loop], rng: &mut Rng) {
        let is_improved = self.params.method == Method::Improved;
        let scramble = Scramble {
            transform: &self.transform,
            first_harmonic: self.params.first_harmonic,
            tolerance: MISSED * self.pace.least(),
            within: self.room_of_phases(),
        };
        for ring in rings {
            *ring = scramble.apply(ring, rng);
            if is_improved {
                *ring = working_copy(ring, self.dropped);
                let long = edges(ring).filter(|(a, b)| a.distance(*b) >= self.longest).count();
                let is_enough = long as f64 >= f64::from(self.params.long_edges) * ring.len() as f64;
                let [low, high] = DROPPED.map(|share| share * self.pace.least());
                self.dropped = (self.dropped * if is_enough { 0.8 } else { 1.25 }).clamp(low, high);
            }
        }
    }

    /// How much is done, 0..=1. An estimate: how many levels there will be inward is not known before.
    #[must_use]
    pub fn progress(&self) -> f32 {
        let Self { level, stage, areas, params, .. } = self;
        let (inward, outward) = match stage {
            Stage::Inward => {
                let by_area = 1.0 - (areas[1] / areas[0]).max(0.0).sqrt();
                (by_area.max(f64::from(*level) / f64::from(params.inward.max(1))), 0.0)
            }
            Stage::Outward => (1.0, f64::from(-level) / f64::from(params.outward.max(1))),
            Stage::Done => return 1.0,
        };
        let shares = [params.inward, params.outward].map(|levels| if levels > 0 { 1.0 } else { 0.0 });
        ((shares[0] * inward + shares[1] * outward) / (shares[0] + shares[1]).max(1.0)) as f32
    }

    /// The contours made so far, lowest level first.
    #[must_use]
    pub fn finish(mut self) -> Contours {
        self.rings.sort_by_key(|ring| ring.level);
        Contours { rings: self.rings, distance: self.params.distance }
    }
}

impl Contours {
    /// All contours around `seeds`: [`ContourJob`], run to the end.
    ///
    /// ```
    /// use bevy_crack::relief::{Contours, ReliefParams};
    /// use glam::Vec2;
    ///
    /// let triangle = vec![[0.1, 0.9], [0.9, 0.9], [0.5, 0.1]].into_iter().map(Vec2::from_array).collect();
    /// let contours = Contours::generate(&ReliefParams::IMPROVED, &[triangle], 7)?;
    /// let area = |level| contours.level(level).map(|ring| ring.signed_area()).sum::<f64>();
    /// assert!(area(1) < area(0) && area(2) < area(1));
    /// # Ok::<(), bevy_crack::relief::ReliefError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`ContourJob::new`] and [`ContourJob::step`].
    pub fn generate(params: &ReliefParams, seeds: &[Vec<Vec2>], seed: u64) -> Result<Self, ReliefError> {
        let mut job = ContourJob::new(params, seeds, seed)?;
        while job.step()? {}
        Ok(job.finish())
    }
}
