//! Computes a map step by step: [`VoronoiBake`].

use super::{
    Guide, MapCharts, SiteLayout, VoronoiError, VoronoiParams,
    charts::texel,
    lattice::{Lattice, Layer},
    level::Level,
    map::VoronoiMap,
    noise::Noise,
    outline::Outline,
    params::MAX_SITES,
    resample::Resampler,
    rough::Roughness,
    seams::Seams,
    sites::sites,
    strokes::StrokePairs,
    trace::Tracer,
};
use crate::{Grid, grid::ask_for, math::Rng, pattern::SurfaceFrame};
use glam::UVec2;

/// The progress of a bake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BakeStatus {
    /// There is more to do; the share that is done, 0..1, which never decreases.
    Working(f32),
    /// The map is complete: [`VoronoiBake::finish`] has nothing left to do.
    Done,
}

enum Stage {
    /// Guides and noise are resampled to the lattice, row by row.
    Guides {
        y: usize,
    },
    /// The costs of edges are computed, row by row.
    Costs {
        y: usize,
    },
    /// Sites are laid out.
    Sites,
    /// Sites are laid out on both sides of strokes, round by round.
    StrokePairs(Box<StrokePairs>),
    /// The regions of the level before become walls, row by row.
    Walls {
        y: usize,
    },
    /// Shortest paths of the last level.
    Search,
    /// Boundaries are searched for, row by row.
    Seams(Tracer),
    Done(Seams),
}

/// Computes a map: call [`step`](Self::step) until it is done, or drop it.
///
/// ```
/// use bevy_crack::voronoi::{BakeStatus, VoronoiBake, VoronoiParams};
///
/// let mut bake = VoronoiBake::new(VoronoiParams::DEFAULT, Vec::new(), [64, 48].into(), 7)?;
/// while let BakeStatus::Working(_share) = bake.step(16) {}
/// let (map, seams) = bake.finish();
/// assert_eq!(map.sites().len(), 175);
/// assert!(!seams.seams.is_empty());
/// # Ok::<(), bevy_crack::voronoi::VoronoiError>(())
/// ```
pub struct VoronoiBake {
    guides: Vec<Guide>,
    resamplers: Vec<Option<Resampler>>,
    outlines: Vec<Outline>,
    noise: Noise,
    seed: u64,
    map: VoronoiMap,
    stage: Stage,
    progress: f32,
    with_seams: bool,
}

/// The share of [`VoronoiParams::guide_noise`] that acts on the narrowest strokes.
const NARROW_NOISE: f32 = 0.3;

/// Memory for strokes and for what is small, bytes.
const SMALL: u64 = 4_000_000;

/// The most memory that a bake holds at a time, bytes; by measurement where it depends on how the regions lie.
fn need(params: &VoronoiParams, guides: usize, size: UVec2) -> u64 {
    let texels = u64::from(size.x) * u64::from(size.y);
    // Noise and guides; edges and paths of each level; paths that are found anew with larger numbers; edges of regions; what
    // makes lines rough.
    let of_texel = 2 * (1 + guides as u64) + 13 * u64::from(params.levels) + 8;
    // Seams are the longer the more regions there are.
    let sites = match &params.layout {
        SiteLayout::Given(points) => points.len() as u64,
        _ => u64::from(params.sites),
    };
    let seams = texels.saturating_mul(sites.min(u64::from(MAX_SITES)).min(texels)).isqrt();
    texels * of_texel + 900 * seams + SMALL
}

impl VoronoiBake {
    /// Starts a map of `size` texels.
    ///
    /// # Errors
    /// [`VoronoiError::OutOfRange`] if a parameter is out of its range, [`VoronoiError::Size`] if the size is,
    /// [`VoronoiError::Memory`] if there is no memory for what all steps need.
    pub fn new(params: VoronoiParams, guides: Vec<Guide>, size: UVec2, seed: u64) -> Result<Self, VoronoiError> {
        Self::over(params, guides, SurfaceFrame::new(size)?, None, seed)
    }

    /// Starts a map of a surface that is laid out in parts: see [`MapCharts`]. Guides are stretched over all of its picture.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn on_charts(
        params: VoronoiParams,
        guides: Vec<Guide>,
        charts: MapCharts,
        seed: u64,
    ) -> Result<Self, VoronoiError> {
        Self::over(params, guides, *charts.frame(), Some(charts), seed)
    }

    fn over(
        params: VoronoiParams,
        guides: Vec<Guide>,
        frame: SurfaceFrame,
        charts: Option<MapCharts>,
        seed: u64,
    ) -> Result<Self, VoronoiError> {
        params.validate(&guides)?;
        let size = frame.size();
        ask_for(need(&params, guides.len(), size))?;
        let mut noise = Rng::new(seed).stream("noise");
        let noise_seed = u64::from(noise.next_u32()) << 32 | u64::from(noise.next_u32());
        let layer = |weight: f32| {
            let mut layer = Layer::new(Grid::new(size, 0));
            layer.set_weight(weight / params.beta);
            layer
        };
        let rough_seed = Rng::new(seed).stream("roughness").next_u32().into();
        let layers = std::iter::once(params.alpha).chain(guides.iter().map(|guide| guide.gamma)).map(layer).collect();
        let resampler = |guide: &Guide| {
            let from = guide.image.size();
            (from.min_element() > 0).then(|| Resampler::new(from, size))
        };
        Ok(Self {
            resamplers: guides.iter().map(resampler).collect(),
            outlines: vec![Outline::default(); guides.len()],
            guides,
            noise: Noise::new(&frame, params.noise_scale, noise_seed),
            seed,
            map: VoronoiMap {
                rough: Roughness::new(params.roughness, &frame, charts.as_ref(), rough_seed)?,
                params,
                frame,
                charts,
                sites: Vec::new(),
                layers,
                levels: Vec::new(),
                lattices: vec![Lattice::new(size)],
                guided: Vec::new(),
                strokes: None,
                width_seed: Rng::new(seed).stream("widths").next_u32(),
                full_cost: None,
            },
            stage: Stage::Guides { y: 0 },
            progress: 0.0,
            with_seams: true,
        })
    }

    /// Skips the seams.
    pub(super) fn regions_alone(self) -> Self {
        Self { with_seams: false, ..self }
    }

    /// Does the work of about `rows` rows of texels.
    pub fn step(&mut self, rows: usize) -> BakeStatus {
        let rows = rows.max(1);
        let height = self.map.height();
        self.stage = match std::mem::replace(&mut self.stage, Stage::Sites) {
            Stage::Guides { y } => {
                let end = height.min(y + rows);
                (y..end).for_each(|y| self.fill_layers(y));
                if end == height {
                    self.lessen_weights();
                }
                if end < height { Stage::Guides { y: end } } else { Stage::Costs { y: 0 } }
            }
            Stage::Costs { y } => {
                let end = height.min(y + rows);
                for y in y..end {
                    self.map.set_row(y);
                    self.map.mark_guided(y);
                }
                if end == height {
                    self.map.set_links();
                }
                if end < height { Stage::Costs { y: end } } else { Stage::Sites }
            }
            Stage::Sites => self.lay_sites(),
            Stage::StrokePairs(mut pairs) => {
                if pairs.advance() {
                    Stage::StrokePairs(pairs)
                } else {
                    self.map.strokes = Some(pairs.report());
                    let mut rng = Rng::new(self.seed).stream("sites");
                    let ground = self.map.ground();
                    let points = pairs.finish(ground, &mut rng).into_iter().filter(|point| ground.has_room(*point));
                    self.map.sites = points.map(|point| texel(ground.frame, point)).collect();
                    self.first_level()
                }
            }
            Stage::Walls { y } => {
                let end = height.min(y + rows);
                self.map.set_walls(y..end);
                if end < height { Stage::Walls { y: end } } else { self.next_level() }
            }
            Stage::Search => {
                if self.map.search(rows) {
                    Stage::Search
                } else if self.map.levels.len() < self.map.n_levels() {
                    self.map.lattices.push(self.map.lattices[0].clone());
                    Stage::Walls { y: 0 }
                } else if self.with_seams {
                    Stage::Seams(Tracer::new(self.map.frame.size()))
                } else {
                    Stage::Done(Seams::default())
                }
            }
            Stage::Seams(mut tracer) => {
                if self.map.scan(&mut tracer, rows) {
                    Stage::Seams(tracer)
                } else {
                    let (seams, full) = self.map.follow(tracer);
                    self.map.full_cost = Some(full);
                    Stage::Done(seams)
                }
            }
            done @ Stage::Done(_) => done,
        };
        let share = self.share();
        self.progress = self.progress.max(share);
        match self.stage {
            Stage::Done(_) => BakeStatus::Done,
            _ => BakeStatus::Working(self.progress),
        }
    }

    /// The map and its seams, after completing the remaining work.
    #[must_use]
    pub fn finish(mut self) -> (VoronoiMap, Seams) {
        while let BakeStatus::Working(_) = self.step(1 << 20) {}
        match self.stage {
            Stage::Done(seams) => (self.map, seams),
            _ => (self.map, Seams::default()),
        }
    }

    /// The progress, weighted by the cost of the stages.
    fn share(&self) -> f32 {
        let rows = |y: usize| y as f32 / self.map.height() as f32;
        let levels = self.map.n_levels() as f32;
        let level = |more: f32| 0.5 + 0.4 * (self.map.levels.len() as f32 - 1.0 + more) / levels;
        match &self.stage {
            Stage::Guides { y } => 0.3 * rows(*y),
            Stage::Costs { y } => 0.3 + 0.1 * rows(*y),
            Stage::Sites => 0.4,
            Stage::StrokePairs(pairs) => 0.4 + 0.1 * pairs.progress(),
            Stage::Walls { .. } => level(1.0),
            Stage::Search => level(self.map.levels.last().map_or(0.0, Level::progress)),
            Stage::Seams(tracer) => 0.9 + 0.1 * tracer.progress(),
            Stage::Done(_) => 1.0,
        }
    }

    fn fill_layers(&mut self, y: usize) {
        let Some((noise, guides)) = self.map.layers.split_first_mut() else { return };
        self.noise.fill_row(y, noise.values.row_mut(y));
        let of_guides = self.guides.iter().zip(&self.resamplers).zip(&mut self.outlines);
        for (layer, ((guide, resampler), outline)) in guides.iter_mut().zip(of_guides) {
            if let Some(resampler) = resampler {
                resampler.fill_row(&guide.image, y, layer.values.row_mut(y));
                outline.add_row(&layer.values, y);
            }
        }
    }

    /// Has the noise take away from the weights of guides: the less, the narrower their strokes are.
    fn lessen_weights(&mut self) {
        let noise = self.map.params.guide_noise;
        for (layer, outline) in self.map.layers.iter_mut().skip(1).zip(&self.outlines) {
            layer.breadth = outline.breadth();
            layer.noise_share = (noise * (NARROW_NOISE + (1.0 - NARROW_NOISE) * layer.breadth) * 65535.0) as u16;
        }
    }

    fn lay_sites(&mut self) -> Stage {
        let map = &mut self.map;
        if map.params.layout == SiteLayout::StrokePairs
            && let Some(pairs) = StrokePairs::new(map.ground(), &map.layers, map.params.sites.min(MAX_SITES) as usize)
        {
            return Stage::StrokePairs(Box::new(pairs));
        }
        map.sites = sites(&map.params, map.ground(), self.seed);
        self.first_level()
    }

    fn first_level(&mut self) -> Stage {
        if self.map.sites.is_empty() {
            return Stage::Done(Seams { extent: self.map.frame.extent(), ..Seams::default() });
        }
        self.next_level()
    }

    fn next_level(&mut self) -> Stage {
        let map = &mut self.map;
        let n = map.sites_of(map.levels.len());
        map.levels.push(map.level(n, !map.levels.is_empty()));
        Stage::Search
    }
}
