//! Contour lines to a height field: [`HeightMap`], [`heights`].

use super::{
    contours::Contours,
    error::ReliefError,
    heights_bands::{Band, Bands},
    heights_near::{Corners, FAR, Segments, TILE, Tiles},
    heights_params::HeightParams,
    heights_slope::{Across, Lane},
    terrain_noise::RowNoise,
};
use crate::{
    Grid,
    math::{Rng, hash_unit, ops, vectorized},
    pattern::SurfaceFrame,
};
use std::{
    iter::successors,
    sync::{Mutex, PoisonError},
    thread,
};

/// Most points of all rings together.
pub const MAX_HEIGHT_POINTS: usize = 1 << 22;

/// Largest level, up or down.
pub const MAX_LEVEL: i32 = 4096;

/// How much higher a level is than the one below it at least, however much steps taper, in steps: slopes divide by it.
const LEAST_STEP: f32 = 1e-4;

/// Largest coordinate of a ring, pattern units.
const MOST_PLACE: f32 = 1e4;

/// Sides of the tiles, each in one of the size before it, texels. The first is the height of a stripe.
const SIDES: [usize; 3] = [128, 32, 8];

/// The height field of contour lines, made stripe by stripe.
///
/// Every texel has exact distances to the nearest rings below and above it and to the next beyond each. Its height is a
/// monotone cubic through the levels (Fritsch and Butland 1984), so a ring has exactly its height, the ground between two
/// rings rises from one to the other, and slopes are continuous across rings. Ridges and valleys are where
/// the nearest point of a ring changes: they run from corner to corner of the rings, as ridge lines do on maps.
///
/// Stripes do not depend on each other, so threads may share them; the bits are the same.
///
/// ```
/// use bevy_crack::{pattern::SurfaceFrame, relief::{Contours, HeightMap, HeightParams, Ring}};
///
/// let square = |level, half: f32| {
///     let points = [[-half, -half], [half, -half], [half, half], [-half, half]];
///     Ring { points: points.iter().map(|&[x, y]| [0.5 + x, 0.5 + y].into()).collect(), level }
/// };
/// let contours = Contours { rings: vec![square(0, 0.4), square(1, 0.2)], distance: 0.2 };
/// let params = HeightParams { step: 0.1, floor: 0.0, ..HeightParams::DEFAULT };
/// let map = HeightMap::new(&contours, &params, SurfaceFrame::new([100, 100].into())?, 7)?;
/// let mut rows = vec![0.0; 100 * 100];
/// map.fill_stripe(0, &mut rows);
/// // Outside; half way from ring to ring; on the summit.
/// assert_eq!(rows[50 * 100 + 5], 0.0);
/// assert!((rows[50 * 100 + 20] - 0.05).abs() < 0.005);
/// assert!((0.1..0.2).contains(&rows[50 * 100 + 50]));
/// assert_eq!((map.level_height(1), map.stripes()), (0.1, 1));
/// // The whole field by four threads.
/// assert_eq!(map.heights(4).as_slice(), rows);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct HeightMap {
    frame: SurfaceFrame,
    params: HeightParams,
    bands: Bands,
    /// Levels from the lowest to the highest.
    levels: Vec<Segments>,
    lowest: i32,
    /// Heights of the levels from two below the lowest on, to two above the highest.
    heights: Vec<f32>,
    /// Distance between levels, texels.
    distance: f32,
    seed: u64,
}

/// The height field of contour lines over a surface, on this thread: see [`HeightMap`].
///
/// One value for each texel center, row by row; pattern units, up is positive. `seed` is that of the variation, the
/// roughness and the cliffs.
///
/// # Errors
/// Those of [`HeightMap::new`].
///
/// ```
/// use bevy_crack::{pattern::SurfaceFrame, relief::{Contours, HeightParams, Ring, heights}};
///
/// let triangle = Ring { points: vec![[0.1, 0.9].into(), [0.5, 0.1].into(), [0.9, 0.9].into()], level: 0 };
/// let contours = Contours { rings: vec![triangle], distance: 0.3 };
/// let grid = heights(&contours, &HeightParams::DEFAULT, SurfaceFrame::new([64, 64].into())?, 1)?;
/// assert!(grid.get(32, 40) > grid.get(32, 5));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn heights(
    contours: &Contours,
    params: &HeightParams,
    frame: SurfaceFrame,
    seed: u64,
) -> Result<Grid<f32>, ReliefError> {
    Ok(HeightMap::new(contours, params, frame, seed)?.heights(1))
}

fn check(contours: &Contours) -> Result<(), ReliefError> {
    let (min, max) = (1e-6, 1e6);
    if !(min..=max).contains(&contours.distance) {
        return Err(ReliefError::OutOfRange { name: "distance", value: contours.distance, min, max });
    }
    if contours.rings.iter().map(|ring| ring.points.len()).sum::<usize>() > MAX_HEIGHT_POINTS {
        return Err(ReliefError::TooManyPoints { most: MAX_HEIGHT_POINTS });
    }
    for (i, ring) in contours.rings.iter().enumerate() {
        if ring.points.len() < 3 {
            return Err(ReliefError::TooFewPoints { contour: i, points: ring.points.len() });
        }
        if !(-MAX_LEVEL..=MAX_LEVEL).contains(&ring.level) {
            return Err(ReliefError::Level { ring: i, level: ring.level, most: MAX_LEVEL });
        }
        let is_far = |point: &glam::Vec2| !(point.is_finite() && point.abs().max_element() <= MOST_PLACE);
        if let Some(point) = ring.points.iter().position(is_far) {
            let glam::Vec2 { x, y } = ring.points[point];
            return Err(ReliefError::Point { contour: i, point, x, y, most: MOST_PLACE });
        }
    }
    Ok(())
}

/// Heights of the levels from the lowest to the highest. Each is above the one below it, as slopes need.
fn level_heights(params: &HeightParams, lowest: i32, highest: i32, seed: u64) -> Vec<f32> {
    // Steps up to a level, added one by one: the formula of the sum has no digits left where they hardly taper.
    let left = 1.0 - f64::from(params.taper);
    let sums: Vec<f64> =
        successors(Some(0.0), |sum| Some(1.0 + left * sum)).take(highest.max(0) as usize + 1).collect();
    let height = |level: i32| {
        let deviation = params.variation * (hash_unit(seed, u64::from(level as u32)) - 0.5);
        let step = if level > 0 { ops::powf(1.0 - params.taper, level as f32) } else { 1.0 };
        let rise = if level > 0 && params.taper > 0.0 {
            sums[level as usize] as f32 + LEAST_STEP * level as f32
        } else {
            level as f32
        };
        params.step * (rise + if level == 0 { 0.0 } else { step * deviation })
    };
    let mut heights: Vec<f32> = (lowest..=highest).map(height).collect();
    for i in 1..heights.len() {
        // Rounding may have made them equal.
        heights[i] = heights[i].max(heights[i - 1].next_up());
    }
    heights
}

impl HeightMap {
    /// Rows of a stripe; the last one may have less.
    pub const STRIPE: usize = 128;

    /// Prepares the heights of contour lines over a surface.
    ///
    /// Rings are simple, do not cross each other and nest as [`Contours`] tells. Where they do not, heights are finite
    /// and the same for the same values, but mean nothing. Without rings all heights are 0.
    ///
    /// # Errors
    /// [`ReliefError`] if a parameter, the distance of the contours, a ring or its level is out of range, or if there are more than
    /// [`MAX_HEIGHT_POINTS`] points.
    pub fn new(
        contours: &Contours,
        params: &HeightParams,
        frame: SurfaceFrame,
        seed: u64,
    ) -> Result<Self, ReliefError> {
        params.validate()?;
        check(contours)?;
        let (lowest, highest) = contours.levels().unwrap_or((0, -1));
        let mut levels = vec![Segments::default(); (highest - lowest + 1) as usize];
        for ring in &contours.rings {
            let segments = &mut levels[(ring.level - lowest) as usize];
            let mut last = frame.to_texel(ring.points[ring.points.len() - 1]);
            for &next in &ring.points {
                let next = frame.to_texel(next);
                segments.push(last.to_array(), next.to_array());
                last = next;
            }
        }
        Ok(Self {
            frame,
            params: *params,
            bands: Bands::new(contours, frame.texels_per_unit()),
            levels,
            lowest,
            heights: level_heights(params, lowest - 2, highest + 3, seed),
            distance: contours.distance * frame.texels_per_unit(),
            seed,
        })
    }

    /// Height of a level, pattern units: `level * step`, less above 0 if [`taper`](HeightParams::taper) is not 0, and a
    /// deviation if [`variation`](HeightParams::variation) is not 0. 0 for levels without a ring.
    #[must_use]
    pub fn level_height(&self, level: i32) -> f32 {
        let has_rings = usize::try_from(level - self.lowest).is_ok_and(|level| level < self.levels.len());
        if has_rings { self.heights[(level - self.lowest + 2) as usize] } else { 0.0 }
    }

    /// Number of stripes.
    #[must_use]
    pub fn stripes(&self) -> usize {
        (self.frame.size().y as usize).div_ceil(Self::STRIPE)
    }

    /// The whole field, by up to `threads` threads.
    #[must_use]
    pub fn heights(&self, threads: usize) -> Grid<f32> {
        let mut grid = Grid::new(self.frame.size(), 0.0);
        let width = grid.width();
        let stripes = Mutex::new(grid.as_mut_slice().chunks_mut(Self::STRIPE * width).enumerate());
        let fill = || {
            let mut work = Work::default();
            loop {
                let next = stripes.lock().unwrap_or_else(PoisonError::into_inner).next();
                let Some((stripe, rows)) = next else { break };
                self.fill_with(stripe, rows, &mut work);
            }
        };
        thread::scope(|scope| {
            for _ in 1..threads.min(self.stripes()) {
                // Where there are no more threads, those that are there do the work.
                let _ = thread::Builder::new().spawn_scoped(scope, fill);
            }
            fill();
        });
        grid
    }

    /// Writes the heights of stripe `stripe`: its rows, one after another. What `rows` has beyond the last row of the
    /// surface is left as it is, and so are rows that do not fit.
    pub fn fill_stripe(&self, stripe: usize, rows: &mut [f32]) {
        self.fill_with(stripe, rows, &mut Work::default());
    }

    fn fill_with(&self, stripe: usize, rows: &mut [f32], work: &mut Work) {
        let [width, height] = self.frame.size().to_array().map(|side| side as usize);
        let first = stripe.saturating_mul(Self::STRIPE);
        let n_rows = height.saturating_sub(first).min(Self::STRIPE).min(rows.len() / width);
        let rows = &mut rows[..n_rows * width];
        if self.levels.is_empty() || n_rows == 0 {
            rows.fill(0.0);
            return;
        }
        work.begin(self, first, width, n_rows);
        let area = Area { first, width, n_rows };
        self.fill_tiles(&area, rows, work);
        if self.params.terraces > 0.0 || self.params.cliffs > 0.0 || self.params.roughness > 0.0 {
            self.reshape(&area, rows, work);
        }
    }

    /// Levels whose distances the texels of a tile need, as indices of `levels`, and the lowest and highest band there.
    fn needed(&self, [low, high]: [i32; 2]) -> std::ops::Range<usize> {
        let index = |level: i32| (level - self.lowest).clamp(0, self.levels.len() as i32) as usize;
        index(low - 1)..index(high + 3)
    }

    /// Whether no texel of a tile lies beside level `level`, an index, so that only distances beyond a band are needed.
    fn is_beyond(&self, level: usize, [low, high]: [i32; 2]) -> bool {
        let level = self.lowest + level as i32;
        level < low || level > high + 1
    }

    fn band(&self, code: i32) -> i32 {
        Band(code).lower().clamp(self.lowest - 1, self.lowest + self.levels.len() as i32 - 1)
    }

    /// Fills the tiles of a stripe.
    fn fill_tiles(&self, area: &Area, rows: &mut [f32], work: &mut Work) {
        for x in (0..area.width).step_by(SIDES[0]) {
            let tiles = Tiles { min: [x as f32, area.first as f32], side: SIDES[0] as f32, count: [1, 1] };
            let Work { lists, corners, .. } = work;
            vectorized(
                #[inline(always)]
                || {
                    for level in self.needed(work.ranges[0][x / SIDES[0]]) {
                        self.levels[level].measure(&tiles, &mut corners[0][level]);
                        self.levels[level].nearest_in(&tiles, [0, 0], &corners[0][level], &mut lists[0][level]);
                    }
                },
            );
            self.fill_tile([x, 0], area, rows, work);
        }
    }

    /// Fills a tile of the first size, whose top left in the stripe is `at`, from the lists of that size.
    fn fill_tile(&self, at: [usize; 2], area: &Area, rows: &mut [f32], work: &mut Work) {
        let tiles = area.within(0, at);
        vectorized(
            #[inline(always)]
            || work.measure(0, &tiles, self.needed(work.range(0, at, area))),
        );
        for (tile, at) in area.inner(0, at, &tiles) {
            let bands = work.range(1, at, area);
            vectorized(
                #[inline(always)]
                || {
                    for level in self.needed(bands) {
                        work.pick(0, &tiles, tile, level);
                    }
                    let tiles = area.within(1, at);
                    work.measure(1, &tiles, self.needed(bands));
                    for (tile, at) in area.inner(1, at, &tiles) {
                        self.fill_leaf(&tiles, tile, at, area, rows, work);
                    }
                },
            );
        }
    }

    /// Fills a tile of the last size, whose top left in the stripe is `at`.
    #[inline(always)]
    fn fill_leaf(
        &self,
        tiles: &Tiles,
        tile: [usize; 2],
        at: [usize; 2],
        area: &Area,
        rows: &mut [f32],
        work: &mut Work,
    ) {
        let bands = work.range(2, at, area);
        let levels = self.needed(bands);
        let place = [at[0] as f32 + 0.5, (area.first + at[1]) as f32 + 0.5];
        work.near.clear();
        for level in levels.clone() {
            let squares = if self.is_beyond(level, bands) {
                [[0.0; TILE]; TILE]
            } else {
                work.pick(1, tiles, tile, level);
                work.lists[2][level].tile(place)
            };
            work.near.push((squares, work.corners[1][level].of(tile).map(f32::sqrt)));
        }
        let [n, n_rows] = [area.width - at[0], area.n_rows - at[1]].map(|n| n.min(TILE));
        for row in 0..n_rows {
            let start = (at[1] + row) * area.width + at[0];
            let mut codes = [work.codes[start]; TILE];
            codes[..n].copy_from_slice(&work.codes[start..start + n]);
            let heights = self.row(&codes, row, bands, levels.start, &work.near);
            rows[start..start + n].copy_from_slice(&heights[..n]);
        }
    }

    /// Heights of a row of a tile, from the squares of its distances to the levels from `first` on.
    #[inline(always)]
    fn row(
        &self,
        codes: &[i32; TILE],
        row: usize,
        [low, high]: [i32; 2],
        first: usize,
        near: &[([Lane; TILE], [f32; 4])],
    ) -> Lane {
        let band = codes.map(|code| Band(code).lower().max(low).min(high));
        let mut across = Across {
            low: [FAR; TILE],
            high: [FAR; TILE],
            lower: [FAR; TILE],
            higher: [FAR; TILE],
            base: [0.0; TILE],
            rise: [1.0; TILE],
            rise_under: [1.0; TILE],
            rise_over: [1.0; TILE],
        };
        let down = (row as f32 + 0.5) / TILE as f32;
        for ((squares, corners), level) in near.iter().zip(self.lowest + first as i32..) {
            let squares = &squares[row];
            let left = corners[0] + (corners[2] - corners[0]) * down;
            let right = corners[1] + (corners[3] - corners[1]) * down;
            let beyond = RAMP.map(|share| left + (right - left) * share);
            let put_at = |out: &mut Lane, level: i32, values: &Lane| {
                if (low..=high).contains(&level) {
                    put(out, &band, level, values);
                }
            };
            put_at(&mut across.lower, level + 1, &beyond);
            put_at(&mut across.low, level, squares);
            put_at(&mut across.high, level - 1, squares);
            put_at(&mut across.higher, level - 2, &beyond);
        }
        for i in 0..TILE {
            across.low[i] = across.low[i].sqrt();
            across.high[i] = across.high[i].sqrt();
        }
        for level in low..=high {
            let heights = &self.heights[(level - self.lowest + 1) as usize..][..4];
            put(&mut across.base, &band, level, &[heights[1]; TILE]);
            put(&mut across.rise_under, &band, level, &[heights[1] - heights[0]; TILE]);
            put(&mut across.rise, &band, level, &[heights[2] - heights[1]; TILE]);
            put(&mut across.rise_over, &band, level, &[heights[3] - heights[2]; TILE]);
        }
        let mut out = across.between(self.distance);
        if codes.iter().any(|&code| !Band(code).has_upper()) {
            let summit = across.summit(self.distance, self.params.summit);
            for i in 0..TILE {
                out[i] = if Band(codes[i]).has_upper() { out[i] } else { summit[i] };
            }
        }
        if codes.iter().any(|&code| !Band(code).has_lower()) {
            // A pit stays above the level below it.
            let pit = self.params.floor.min(0.9);
            let floor = self.params.floor * self.params.step;
            let mut depth = [floor; TILE];
            for i in 0..TILE {
                depth[i] = if band[i] < self.lowest { floor } else { pit * across.rise[i] };
            }
            let floor = across.floor(self.distance, &depth);
            for i in 0..TILE {
                out[i] = if Band(codes[i]).has_lower() { out[i] } else { floor[i] };
            }
        }
        out
    }

    /// Roughness, terraces and cliffs: they change where in its band a texel is, and keep rings where they are.
    fn reshape(&self, area: &Area, rows: &mut [f32], work: &Work) {
        let params = &self.params;
        let scale = [params.noise_scale * self.frame.texels_per_unit(); 2];
        let rng = Rng::new(self.seed);
        let mut rough = RowNoise::new(area.width, scale, 5, 0.6, &mut rng.stream("relief roughness"));
        let mut where_cliffs = RowNoise::new(area.width, scale, 3, 0.5, &mut rng.stream("relief cliffs"));
        let mut noise = [vec![0.0; area.width], vec![0.0; area.width]];
        for (y, row) in rows.chunks_exact_mut(area.width).enumerate() {
            rough.fill_row(area.first + y, &mut noise[0]);
            where_cliffs.fill_row(area.first + y, &mut noise[1]);
            let codes = &work.codes[y * area.width..][..area.width];
            for (x, (height, &code)) in row.iter_mut().zip(codes).enumerate() {
                let band = self.band(code);
                let heights = &self.heights[(band - self.lowest + 2) as usize..][..2];
                if !Band(code).has_lower() {
                    continue;
                }
                let rise = heights[1] - heights[0];
                let share = ((*height - heights[0]) / rise).clamp(0.0, 1.0);
                let share = share + params.roughness * noise[0][x].clamp(-1.0, 1.0) * share * (1.0 - share);
                let cliff = ((params.cliffs * 2.4 - 1.2 + noise[1][x]) * 4.0).clamp(0.0, 1.0);
                let amount = params.terraces.max(if params.cliffs > 0.0 { cliff } else { 0.0 });
                let reshaped = share + (self.terrace(share) - share) * amount;
                // A summit is all above its ring, so there is no wall at its far side.
                let share = if Band(code).has_upper() { reshaped } else { share };
                *height = heights[0] + rise * share;
            }
        }
    }

    /// Where on a terrace a share of the way is: flat, then a wall.
    fn terrace(&self, share: f32) -> f32 {
        let (tread, roundness) = (self.params.tread, self.params.roundness);
        let wall = ((share - tread) / (1.0 - tread)).max(0.0);
        wall + (wall * wall * (3.0 - 2.0 * wall) - wall) * roundness
    }
}

/// Where the centers of a tile's texels lie across it.
const RAMP: Lane = [0.0625, 0.1875, 0.3125, 0.4375, 0.5625, 0.6875, 0.8125, 0.9375];

/// Writes values where the band is that of `level`.
#[inline(always)]
fn put(out: &mut Lane, band: &[i32; TILE], level: i32, values: &Lane) {
    let mut merged = *out;
    for i in 0..TILE {
        merged[i] = if band[i] == level { values[i] } else { merged[i] };
    }
    *out = merged;
}

/// The texels of a stripe: its first row, its width and its number of rows.
struct Area {
    first: usize,
    width: usize,
    n_rows: usize,
}

impl Area {
    /// The tiles of the next size in a tile of side `SIDES[depth]`, whose top left in the stripe is `at`.
    #[inline(always)]
    fn within(&self, depth: usize, at: [usize; 2]) -> Tiles {
        let count = [self.width - at[0], self.n_rows - at[1]].map(|n| n.min(SIDES[depth]).div_ceil(SIDES[depth + 1]));
        Tiles { min: [at[0] as f32, (self.first + at[1]) as f32], side: SIDES[depth + 1] as f32, count }
    }

    /// Those tiles one after another, and the top left of each in the stripe.
    #[inline(always)]
    fn inner(
        &self,
        depth: usize,
        at: [usize; 2],
        tiles: &Tiles,
    ) -> impl Iterator<Item = ([usize; 2], [usize; 2])> + use<> {
        let (side, [across, down]) = (SIDES[depth + 1], tiles.count);
        (0..across * down).map(move |i| {
            let tile = [i % across, i / across];
            (tile, [at[0] + tile[0] * side, at[1] + tile[1] * side])
        })
    }
}

/// Memory for stripes.
#[derive(Default)]
struct Work {
    /// The band of each texel.
    codes: Vec<i32>,
    /// The lowest and the highest band of each tile, for each size of tiles.
    ranges: [Vec<[i32; 2]>; SIDES.len()],
    /// For each size of tiles and each level, the segments that can be nearest to a texel of the current tile.
    lists: [Vec<Segments>; SIDES.len()],
    /// Squares of the distances of a tile to the levels that it needs.
    near: Vec<([Lane; TILE], [f32; 4])>,
    /// For each size of tiles but the last and each level, the distances of the segments of the current tile to the corners of
    /// the tiles in it.
    corners: [Vec<Corners>; SIDES.len() - 1],
}

impl Work {
    fn begin(&mut self, map: &HeightMap, first: usize, width: usize, n_rows: usize) {
        self.codes.resize(width * n_rows, 0);
        map.bands.fill(first, width, &mut self.codes);
        for lists in &mut self.lists {
            lists.resize_with(map.levels.len(), Segments::default);
        }
        for corners in &mut self.corners {
            corners.resize_with(map.levels.len(), Corners::default);
        }
        for (side, ranges) in SIDES.iter().zip(&mut self.ranges) {
            ranges.clear();
            ranges.resize(width.div_ceil(*side) * n_rows.div_ceil(*side), [i32::MAX, i32::MIN]);
        }
        let leaf = SIDES.len() - 1;
        let across = width.div_ceil(TILE);
        for (y, row) in self.codes.chunks_exact(width).enumerate() {
            let ranges = &mut self.ranges[leaf][y / TILE * across..][..across];
            for (codes, range) in row.chunks(TILE).zip(ranges) {
                for &code in codes {
                    let band = map.band(code);
                    *range = [range[0].min(band), range[1].max(band)];
                }
            }
        }
        for depth in (1..SIDES.len()).rev() {
            let ratio = SIDES[depth - 1] / SIDES[depth];
            let [inner, outer] = [depth, depth - 1].map(|depth| width.div_ceil(SIDES[depth]));
            let (large, small) = self.ranges.split_at_mut(depth);
            for (i, small) in small[0].iter().enumerate() {
                let large = &mut large[depth - 1][i / inner / ratio * outer + i % inner / ratio];
                *large = [large[0].min(small[0]), large[1].max(small[1])];
            }
        }
    }

    /// Measures the distances of the segments of a tile to the corners of the tiles in it.
    #[inline(always)]
    fn measure(&mut self, depth: usize, tiles: &Tiles, levels: std::ops::Range<usize>) {
        for level in levels {
            self.lists[depth][level].measure(tiles, &mut self.corners[depth][level]);
        }
    }

    /// Makes the list of a tile from that of the tile around it.
    #[inline(always)]
    fn pick(&mut self, depth: usize, tiles: &Tiles, tile: [usize; 2], level: usize) {
        let (outer, inner) = self.lists.split_at_mut(depth + 1);
        outer[depth][level].nearest_in(tiles, tile, &self.corners[depth][level], &mut inner[0][level]);
    }

    /// The lowest and the highest band in a tile.
    #[inline(always)]
    fn range(&self, depth: usize, at: [usize; 2], area: &Area) -> [i32; 2] {
        let across = area.width.div_ceil(SIDES[depth]);
        self.ranges[depth][at[1] / SIDES[depth] * across + at[0] / SIDES[depth]]
    }
}
