//! [`Analogy`]: a surface that is made from examples, and made on as its cracks grow.

use super::{
    error::AnalogyError,
    examples::Examples,
    guide::{Change, GuideWork, NewCracks, shrink},
    level::Level,
    pair::{MAX_CHANNELS, check_channel, check_size},
    ramp,
    region::Region,
    widen,
    work::Work,
};
use crate::{Grid, raster::TexelRect};
use glam::UVec2;
use std::{collections::VecDeque, sync::Arc};

/// Longest side of a surface, texels.
pub const MAX_SURFACE_SIDE: u32 = 8192;

/// Shortest side of the smallest level of a surface, texels.
const LEAST_SIDE: u32 = 4;

/// Changes are told in runs of tiles of `2^LOG_TILE` texels a side.
const LOG_TILE: u32 = 4;

/// The first level on which it is counted how often each texel has been copied.
const FIRST_COUNTED: usize = 2;

/// A surface `B'` for which `A : A' :: B : B'` holds (Hertzmann et al. 2001; Mould 2005, section 5.1).
///
/// Every texel is a copy of one of the photographs. The first call makes the whole surface; [`update`](Self::update)
/// makes what lies near new cracks and leaves all else as it is. Work is done by [`step`](Self::step), in parts of any
/// size, which do not change the result: it depends on examples, seed, and the rectangles and depths of the updates in
/// their order.
///
/// Differs from the papers: the guide is a ramp of the distance to the crack, not the mask itself, and cracks thinner
/// than most of the photographs' are widened to the thin ones of these; the search for
/// nearest neighbours is by coherence and random places instead of a tree; texels are made in several passes, each of
/// which sees all neighbours, instead of in one.
///
/// ```
/// use bevy_crack::{Grid, paint::analogy::{Analogy, AnalogyPair, AnalogyParams, Examples}, raster::TexelRect};
/// use std::sync::Arc;
///
/// // A photograph: bright, with a dark crack down column 20 and one across it, in row 20.
/// let size = [40, 40].into();
/// let shade = |i: u32| if i % 40 == 20 || i / 40 == 20 { 10 } else { 200 };
/// let photo: Vec<u8> = (0..1600).flat_map(|i| [shade(i), shade(i), shade(i), 255]).collect();
/// let pair = AnalogyPair::from_darkness(size, &photo, 0.3)?;
/// let examples = Arc::new(Examples::new(&[pair], &AnalogyParams::DEFAULT)?);
///
/// // A surface with no crack yet, then one in row 9.
/// let mut depth = Grid::new(size, 0);
/// let mut wall = Analogy::new(examples, &depth, &[], 7)?;
/// wall.finish();
/// depth.row_mut(9).fill(u16::MAX);
/// wall.update(&depth, &[TexelRect { min: [0, 9].into(), max: [40, 10].into() }])?;
/// while wall.step(1000) {}
/// assert_eq!(wall.color(30, 9), [10, 10, 10, 255]);
/// assert_eq!(wall.color(30, 20), [200, 200, 200, 255]);
/// # Ok::<(), bevy_crack::paint::analogy::AnalogyError>(())
/// ```
///
/// The work in slices, and all that can be read of the result:
///
/// ```
/// use bevy_crack::{Grid, paint::analogy::{Analogy, AnalogyPair, AnalogyParams, Examples, TexelSource}};
/// use std::sync::Arc;
///
/// let size = [40, 40].into();
/// let shade = |i: u32| if i % 40 == 20 || i / 40 == 20 { 10 } else { 200 };
/// let photo: Vec<u8> = (0..1600).flat_map(|i| [shade(i), shade(i), shade(i), 255]).collect();
/// let pair = AnalogyPair::from_darkness(size, &photo, 0.3)?;
/// let examples = Arc::new(Examples::new(std::slice::from_ref(&pair), &AnalogyParams::DEFAULT)?);
/// assert_eq!((examples.sizes().collect::<Vec<_>>(), examples.params()), (vec![size], &AnalogyParams::DEFAULT));
///
/// let mut depth = Grid::new(size, 0);
/// depth.row_mut(9).fill(u16::MAX);
/// let mut wall = Analogy::new(examples, &depth, &[], 7)?;
/// assert_eq!((wall.is_busy(), wall.progress(), wall.size()), (true, 0.0, size));
/// assert_eq!(wall.source(30, 9).map(|source| source.pair), Some(TexelSource::NONE));
/// while wall.step(1000) {}
/// assert_eq!((wall.is_busy(), wall.progress()), (false, 1.0));
/// // All of it is new. Later cracks change texels up to 40 or so away from them.
/// assert!(!wall.take_changed().is_empty());
/// assert!(wall.window() < 60);
///
/// // Each texel is a copy: its colour, and whatever else belongs to the photograph.
/// let TexelSource { pair: _, texel: [x, y] } = wall.source(30, 9).expect("it is on the surface");
/// assert_eq!(pair.cracks().get(x.into(), y.into()), Some(1.0));
/// assert_eq!(wall.sources().get(30, 9), wall.source(30, 9));
/// let heights = Grid::from_vec(size, (0..1600).map(|i| if shade(i) == 10 { -1.0 } else { 0.5 }).collect()).unwrap();
/// let carried = wall.carry(&[&heights], 0.0)?;
/// assert_eq!((carried.get(30, 9), carried.get(30, 30)), (Some(-1.0), Some(0.5)));
/// let (whole, mut texels) = (bevy_crack::raster::TexelRect::whole(size), vec![0; 40 * 40 * 4]);
/// wall.paint_into(whole, &mut texels);
/// assert_eq!(texels, wall.colors().as_slice().as_flattened());
/// let mut into = Grid::new(size, 0.0);
/// wall.carry_into(&[&heights], whole, &mut into)?;
/// assert_eq!(into, carried);
///
/// // The guides of surface and photograph: low in cracks. Texels come from places where the guide is alike.
/// assert!(wall.ramp().get(30, 9) < wall.ramp().get(30, 30));
/// let guide = wall.examples().ramp(0).expect("there is a pair");
/// assert!(guide.get(20, 5) < guide.get(5, 5));
/// assert!(wall.is_near_crack(30, 9) && wall.agreement(0.1) > 0.5);
/// # Ok::<(), bevy_crack::paint::analogy::AnalogyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Analogy {
    examples: Arc<Examples>,
    /// From the full size down.
    levels: Vec<Level>,
    is_crack: Vec<bool>,
    seed: u64,
    queue: VecDeque<Change>,
    work: Option<Work>,
    /// Whether the whole surface has been asked for.
    is_begun: bool,
    changed: Vec<TexelRect>,
}

impl Analogy {
    /// A surface with these depths (0 = untouched, 65535 = the deepest), as of
    /// [`DepthField::depth`](crate::raster::DepthField::depth), and as many further channels as the pairs have.
    ///
    /// Nothing is made before [`step`](Self::step) or [`finish`](Self::finish). Takes about 14 bytes for each texel.
    ///
    /// # Errors
    /// [`AnalogyError`] if a side is 0 or above [`MAX_SURFACE_SIDE`], or if the channels differ in number or size or
    /// have a value that is not finite.
    pub fn new(
        examples: Arc<Examples>,
        depth: &Grid<u16>,
        channels: &[Grid<f32>],
        seed: u64,
    ) -> Result<Self, AnalogyError> {
        let size = depth.size();
        if size.min_element() == 0 || size.max_element() > MAX_SURFACE_SIDE {
            return Err(AnalogyError::SurfaceSize { width: size.x, height: size.y, most: MAX_SURFACE_SIDE });
        }
        let (count, expected) = (channels.len(), examples.given);
        if count != expected {
            return Err(AnalogyError::ChannelCount { count, expected, most: MAX_CHANNELS });
        }
        for channel in channels {
            check_channel("channel", channel, size)?;
        }
        let (mut levels, mut side) = (Vec::new(), size);
        while levels.len() < examples.atlases.len() && (levels.is_empty() || side.min_element() >= LEAST_SIDE) {
            let atlas = &examples.atlases[levels.len()];
            let is_last = levels.len() + 1 == examples.atlases.len() || side.min_element() < 2 * LEAST_SIDE;
            let counted = if is_last || levels.len() >= FIRST_COUNTED { atlas.texels.len() } else { 0 };
            levels.push(Level::new(side, examples.params.is_tileable, atlas.channels, counted));
            side = (side + 1) / 2;
        }
        fill_channels(&mut levels, channels);
        let is_crack = vec![false; size.element_product() as usize];
        let (queue, work, changed) = (VecDeque::new(), None, Vec::new());
        let mut analogy = Self { examples, levels, is_crack, seed, queue, work, is_begun: false, changed };
        analogy.update(depth, &[TexelRect::whole(size)])?;
        Ok(analogy)
    }

    /// Takes over new depths inside rectangles, which are clipped to the surface.
    ///
    /// The work is queued. What one call takes over is made together, after what earlier calls took over; so few calls
    /// with more rectangles take less time than many. Depths outside of the rectangles must not have changed, or are
    /// taken over by a later call.
    ///
    /// # Errors
    /// [`AnalogyError::SizesDiffer`] if `depth` does not have the size of the surface.
    pub fn update(&mut self, depth: &Grid<u16>, changed: &[TexelRect]) -> Result<(), AnalogyError> {
        check_size("depth", depth.size(), self.size())?;
        let least = ((self.examples.params.depth * 65535.0) as u16).max(1);
        let whole = TexelRect::whole(self.size());
        let rects = changed.iter().map(|rect| rect.intersect(whole)).filter(|rect| !rect.is_empty());
        let change: Change = rects
            .map(|rect| {
                let columns = rect.min.x as usize..rect.max.x as usize;
                let rows = (rect.min.y..rect.max.y).flat_map(|y| &depth.row(y as usize)[columns.clone()]);
                NewCracks { rect, is_crack: rows.map(|&depth| depth >= least).collect() }
            })
            .collect();
        if !change.is_empty() {
            self.queue.push_back(change);
        }
        Ok(())
    }

    /// Does some of the work that is queued: parts of up to a row, until at least `texels` texels have been visited; 0 counts as 1.
    /// One part of each change, which takes its guide to the smaller levels, is as large as the change.
    ///
    /// Returns whether any is left.
    ///
    /// Each texel is visited a few times; a visit takes about a quarter of a microsecond. Who no longer wants the
    /// result stops calling this and drops the surface; who wants it later goes on later.
    pub fn step(&mut self, texels: u64) -> bool {
        let mut visited = 0;
        while visited < texels.max(1) {
            if self.work.is_none() {
                let Some(change) = self.queue.pop_front() else { return false };
                let guide = GuideWork::new(&change, &mut self.is_crack, self.levels[0].size, &self.examples);
                self.work = Some(Work::new(guide, !self.is_begun, self.levels.len()));
                self.is_begun = true;
            }
            let Some(work) = &mut self.work else { return false };
            match work.step(&mut self.levels, &self.is_crack, &self.examples, self.seed) {
                Some(count) => visited += count,
                None => {
                    self.changed.extend(work.region().tiles(LOG_TILE, self.levels[0].size));
                    self.work = None;
                }
            }
        }
        self.is_busy()
    }

    /// Does all the work that is queued.
    pub fn finish(&mut self) {
        while self.step(u64::MAX) {}
    }

    /// Whether any work is left.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.work.is_some() || !self.queue.is_empty()
    }

    /// Share of the change in progress that is done, 0..=1; 1 if there is none.
    #[must_use]
    pub fn progress(&self) -> f32 {
        match &self.work {
            Some(work) => work.progress(),
            None if self.queue.is_empty() => 1.0,
            None => 0.0,
        }
    }

    /// Takes the rectangles of the texels that may have changed since the last call, of all changes that are finished.
    pub fn take_changed(&mut self) -> Vec<TexelRect> {
        std::mem::take(&mut self.changed)
    }

    /// How far from a texel whose crack has changed texels can change: the reach of the guide,
    /// the margin, and a few where thin cracks are widened.
    #[must_use]
    pub fn window(&self) -> u32 {
        self.examples.params.reach + self.examples.params.margin + widen::reach(self.examples.thin())
    }

    /// Size of the surface, texels.
    #[must_use]
    pub fn size(&self) -> UVec2 {
        self.levels[0].size
    }

    /// The examples.
    #[must_use]
    pub const fn examples(&self) -> &Arc<Examples> {
        &self.examples
    }

    /// The full size.
    pub(super) fn full(&self) -> &Level {
        &self.levels[0]
    }
}

/// Writes the further channels that the user gives.
fn fill_channels(levels: &mut [Level], channels: &[Grid<f32>]) {
    let Some(level) = levels.first_mut() else { return };
    for (at, channel) in channels.iter().enumerate() {
        for (texel, value) in ramp::bytes(channel).into_iter().enumerate() {
            level.extras[texel * level.channels + at] = value;
        }
    }
    let whole = Region::whole(level.size);
    shrink(levels, &whole, 0);
}
