//! [`ReliefJob`]: from a shape to heights, colors and normals, step by step.

use super::{
    contours::Contours,
    error::ReliefError,
    generate::ContourJob,
    heights::HeightMap,
    heights_params::HeightParams,
    params::ReliefParams,
    shapes::ReliefShape,
    terrain::TerrainColors,
    terrain_colors::ColorJob,
    terrain_normals::Normals,
    weather::{WeatherJob, Weathering},
};
use crate::{Grid, grid::ask_for, pattern::SurfaceFrame};
use glam::UVec2;

/// Everything that a relief is made from, except its size and seed.
///
/// ```
/// use bevy_crack::relief::ReliefSettings;
///
/// assert_eq!(ReliefSettings::rock_wall().validate(), Ok(()));
/// // A mountain is an island without sea.
/// let (mountain, island) = (ReliefSettings::mountain(), ReliefSettings::island());
/// assert_eq!((mountain.shape, mountain.contours), (island.shape, island.contours));
/// assert!(island.colors.sea.is_some() && mountain.colors.sea.is_none());
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ReliefSettings {
    /// Where the contours begin; default [`ReliefShape::Wall`].
    pub shape: ReliefShape,
    /// How contours are made from each other. Default, as of the other fields: that of [`rock_wall`](Self::rock_wall).
    pub contours: ReliefParams,
    /// How contours become heights.
    pub heights: HeightParams,
    /// What weather makes of the heights; default of a file that does not name it: nothing.
    #[cfg_attr(feature = "serde", serde(default))]
    pub weathering: Weathering,
    /// How heights become colors.
    pub colors: TerrainColors,
}

impl ReliefSettings {
    /// A wall of rock, seen from the front.
    #[must_use]
    pub fn rock_wall() -> Self {
        let rough = HeightParams { roughness: 0.2, variation: 0.7, noise_scale: 0.12, ..HeightParams::DEFAULT };
        Self {
            shape: ReliefShape::Wall,
            contours: ReliefParams { distance: 0.012, displacement: 0.15, outward: 2, ..ReliefParams::IMPROVED },
            heights: HeightParams { step: 0.03, taper: 0.5, floor: 2.0, ..rough },
            weathering: Weathering::ROCK,
            colors: TerrainColors::ROCK,
        }
    }

    /// An island in the sea, seen from above.
    #[must_use]
    pub fn island() -> Self {
        Self {
            shape: ReliefShape::Island,
            contours: ReliefParams { steepness: 0.6, steep_angle: -2.2, ..ReliefParams::IMPROVED },
            heights: HeightParams { step: 0.014, floor: 4.0, roughness: 0.35, ..HeightParams::DEFAULT },
            weathering: Weathering::LAND,
            colors: TerrainColors::ISLAND,
        }
    }

    /// A mountain, seen from above.
    #[must_use]
    pub fn mountain() -> Self {
        let weathering = Weathering { coast: 0.0, ..Weathering::LAND };
        Self { colors: TerrainColors::MOUNTAIN, weathering, ..Self::island() }
    }

    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ReliefError`] for the first number that is out of its range or not finite. Lines are checked when contours are made.
    pub fn validate(&self) -> Result<(), ReliefError> {
        self.contours.validate()?;
        self.heights.validate()?;
        self.weathering.validate()?;
        self.colors.validate()
    }
}

impl Default for ReliefSettings {
    fn default() -> Self {
        Self::rock_wall()
    }
}

/// A relief: contours, heights and what they look like.
#[derive(Clone, Debug, PartialEq)]
pub struct Relief {
    /// The contour lines, as they were before the weather.
    pub contours: Contours,
    /// Heights, pattern units; one for each texel.
    pub heights: Grid<f32>,
    /// Colors: sRGB and 255.
    pub diffuse: Grid<[u8; 4]>,
    /// Normals in tangent space, +Y up, linear.
    pub normal: Grid<[u8; 4]>,
}

impl Relief {
    /// How steep the ground is at each texel: 0 = level, 255 = a slope of 2 or more.
    #[must_use]
    pub fn steepness(&self) -> Grid<u8> {
        let steep = |&[x, y, z, _]: &[u8; 4]| {
            let [x, y, z] = [x, y, z].map(|part| f32::from(part) / 127.5 - 1.0);
            (127.5 * (x * x + y * y).sqrt() / z.max(0.01)).min(255.0) as u8
        };
        let steep = self.normal.as_slice().iter().map(steep).collect();
        Grid::from_vec(self.normal.size(), steep).unwrap_or_else(|| Grid::new(UVec2::ZERO, 0))
    }
}

/// What a job does next.
#[derive(Clone, Debug)]
enum Stage {
    Contours(Box<ContourJob>),
    Heights { contours: Contours, map: Box<HeightMap>, heights: Grid<f32>, stripe: usize },
    Weather { contours: Contours, job: Box<WeatherJob> },
    Normals { contours: Contours, heights: Grid<f32>, job: Box<Normals> },
    Colors { contours: Contours, heights: Grid<f32>, normal: Grid<[u8; 4]>, job: Box<ColorJob> },
    Done,
}

/// The making of a relief as steps of bounded work, for a background task that shows progress and can be stopped.
///
/// Results depend on settings, size and seed alone.
///
/// ```
/// use bevy_crack::relief::{Relief, ReliefJob, ReliefSettings};
///
/// let mut job = ReliefJob::new(ReliefSettings::island(), [96, 64].into(), 7)?;
/// let relief: Relief = loop {
///     if let Some(relief) = job.step()? {
///         break relief;
///     }
///     assert!(job.progress() < 1.0);
/// };
/// assert_eq!(relief.diffuse.size(), [96, 64].into());
/// // The sea is level, the island is not.
/// let steepness = relief.steepness();
/// assert!(steepness.get(0, 0) < Some(5));
/// assert!(steepness.as_slice().iter().any(|steep| *steep > 60));
/// // The same at once.
/// assert_eq!(ReliefJob::new(ReliefSettings::island(), [96, 64].into(), 7)?.finish()?, relief);
/// # Ok::<(), bevy_crack::relief::ReliefError>(())
/// ```
#[derive(Clone, Debug)]
pub struct ReliefJob {
    settings: ReliefSettings,
    frame: SurfaceFrame,
    seed: u64,
    stage: Stage,
}

/// The most memory that a job holds at a time, bytes for each texel; by measurement.
const OF_TEXEL: u64 = 30;

/// Memory for what is small, bytes.
const SMALL: u64 = 4_000_000;

/// Shares of the progress at which contours, heights, weather and normals are done.
const PROGRESS: [f32; 4] = [0.1, 0.16, 0.62, 0.65];

impl ReliefJob {
    /// A job for a relief of `size` texels.
    ///
    /// # Errors
    /// [`ReliefError`] if a number is out of its range, the size is zero or above
    /// [`MAX_SIDE`](crate::pattern::MAX_SIDE), the lines of the shape cannot be used, or there is no memory for what
    /// is made of the texels. What contours need is not foreseen.
    pub fn new(settings: ReliefSettings, size: UVec2, seed: u64) -> Result<Self, ReliefError> {
        settings.validate()?;
        let frame = SurfaceFrame::new(size)?;
        ask_for(u64::from(size.x) * u64::from(size.y) * OF_TEXEL + SMALL)?;
        let seeds = settings.shape.contours(frame.extent(), seed);
        let stage = Stage::Contours(Box::new(ContourJob::new(&settings.contours, &seeds, seed)?));
        Ok(Self { settings, frame, seed, stage })
    }

    /// One step of the work; the relief when it is done, once.
    ///
    /// # Errors
    /// [`ReliefError`] if contours or heights cannot be made. The job is over then.
    pub fn step(&mut self) -> Result<Option<Relief>, ReliefError> {
        let (frame, seed) = (self.frame, self.seed);
        self.stage = match std::mem::replace(&mut self.stage, Stage::Done) {
            Stage::Contours(mut job) => {
                if job.step()? {
                    Stage::Contours(job)
                } else {
                    let contours = job.finish();
                    let map = Box::new(HeightMap::new(&contours, &self.settings.heights, frame, seed)?);
                    Stage::Heights { contours, map, heights: Grid::new(frame.size(), 0.0), stripe: 0 }
                }
            }
            Stage::Heights { contours, map, mut heights, stripe } => {
                let first = stripe * HeightMap::STRIPE * heights.width();
                map.fill_stripe(stripe, &mut heights.as_mut_slice()[first..]);
                if stripe + 1 < map.stripes() {
                    Stage::Heights { contours, map, heights, stripe: stripe + 1 }
                } else {
                    let job = WeatherJob::new(heights, frame, self.settings.weathering, seed);
                    Stage::Weather { contours, job: Box::new(job) }
                }
            }
            Stage::Weather { contours, mut job } => {
                if job.step() {
                    Stage::Weather { contours, job }
                } else {
                    let normals = Box::new(Normals::new(frame.size(), &frame));
                    Stage::Normals { contours, heights: job.heights, job: normals }
                }
            }
            Stage::Normals { contours, heights, mut job } => {
                if job.step(&heights) {
                    Stage::Normals { contours, heights, job }
                } else {
                    let colors = Box::new(ColorJob::new(&heights, frame, self.settings.colors, seed));
                    Stage::Colors { contours, heights, normal: job.out, job: colors }
                }
            }
            Stage::Colors { contours, heights, normal, mut job } => {
                if !job.step(&heights)? {
                    return Ok(Some(Relief { contours, heights, diffuse: job.out, normal }));
                }
                Stage::Colors { contours, heights, normal, job }
            }
            Stage::Done => Stage::Done,
        };
        Ok(None)
    }

    /// How much is done, 0..=1.
    #[must_use]
    pub fn progress(&self) -> f32 {
        let [contours, heights, weather, normals] = PROGRESS;
        match &self.stage {
            Stage::Contours(job) => contours * job.progress(),
            Stage::Heights { map, stripe, .. } => {
                contours + (heights - contours) * *stripe as f32 / map.stripes().max(1) as f32
            }
            Stage::Weather { job, .. } => heights + (weather - heights) * job.progress(),
            Stage::Normals { job, .. } => weather + (normals - weather) * job.progress(),
            Stage::Colors { job, .. } => normals + (1.0 - normals) * job.progress().min(0.99),
            Stage::Done => 1.0,
        }
    }

    /// The whole relief at once.
    ///
    /// # Errors
    /// Those of [`step`](Self::step).
    pub fn finish(mut self) -> Result<Relief, ReliefError> {
        loop {
            if let Some(relief) = self.step()? {
                return Ok(relief);
            }
            if matches!(self.stage, Stage::Done) {
                // It was stepped to its end before: make it again.
                self = Self::new(self.settings, self.frame.size(), self.seed)?;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relief::rows::{MANY, tests::TAKEN};
    use glam::Vec2;

    #[test]
    fn steps_rise_to_the_relief_made_at_once() {
        for settings in [ReliefSettings::rock_wall(), ReliefSettings::island(), ReliefSettings::mountain()] {
            let size = UVec2::new(150, 200);
            let at_once = ReliefJob::new(settings.clone(), size, 3).unwrap().finish().unwrap();
            let mut job = ReliefJob::new(settings, size, 3).unwrap();
            let mut last = 0.0;
            let by_steps = loop {
                assert!((last..1.0).contains(&job.progress()));
                last = job.progress();
                if let Some(relief) = job.step().unwrap() {
                    break relief;
                }
            };
            assert!(by_steps == at_once && job.progress() == 1.0);
            assert_eq!(job.step(), Ok(None));
            let steep = by_steps.steepness();
            assert!(steep.as_slice().iter().any(|&steep| steep > 60) && steep.size() == size);
        }
    }

    /// After contours and heights, which are made level by level and stripe by stripe, no step works on more texels than a few
    /// rows have.
    #[test]
    fn steps_are_bounded() {
        let size = UVec2::new(500, 700);
        for settings in [ReliefSettings::rock_wall(), ReliefSettings::island()] {
            let mut job = ReliefJob::new(settings, size, 3).unwrap();
            let (mut all, mut is_done) = (0, false);
            while !is_done {
                let before = TAKEN.get();
                is_done = job.step().unwrap().is_some();
                let taken = TAKEN.get() - before;
                assert!(taken <= MANY, "{taken} texels at {}", job.progress());
                all += taken;
            }
            // Bends, wear, normals, colors, and all that these measure before.
            assert!(all >= 12 * (size.x * size.y) as usize, "{all}");
        }
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let with = |change: fn(&mut ReliefSettings)| {
            let mut settings = ReliefSettings::island();
            change(&mut settings);
            ReliefJob::new(settings, UVec2::splat(64), 1).err().map(|error| error.to_string())
        };
        assert!(with(|settings| settings.contours.distance = f32::NAN).unwrap().contains("`distance`"));
        assert!(with(|settings| settings.heights.step = -1.0).unwrap().contains("`step`"));
        assert!(with(|settings| settings.colors.strata = 2.0).unwrap().contains("`strata`"));
        assert!(with(|settings| settings.shape = ReliefShape::Lines(Vec::new())).is_some());
        assert!(with(|settings| settings.shape = ReliefShape::Lines(vec![vec![Vec2::NAN; 3]])).is_some());
        assert!(ReliefJob::new(ReliefSettings::island(), UVec2::new(0, 5), 1).is_err());
    }
}
