//! Draws networks into a depth field, anti-aliased and combined by max.
//!
//! Depth is 16 bits a texel: 0 = untouched, 65535 = the deepest. Stamps are combined by max, so their order does not
//! matter and a segment can be stamped again with a larger width without its neighbours.
//!
//! In addition to depths a field can hold the layers that some looks show ([`LayerPlan`]): plates, crushed zones and
//! veils.
//!
//! ```
//! use bevy_crack::{
//!     growth::{CrackGrowth, GrowthParams},
//!     pattern::SurfaceFrame,
//!     raster::{DepthField, Profile, stamp_path},
//! };
//!
//! let frame = SurfaceFrame::new([64, 64].into())?;
//! let mut growth = CrackGrowth::new(GrowthParams::DEFAULT, frame.extent(), 7)?;
//! growth.hit([0.5, 0.5].into(), 1.0);
//! while growth.step().grew() {}
//!
//! let mut field = DepthField::new(frame);
//! let network = growth.network();
//! for path in network.segments().filter_map(|segment| network.path(segment)) {
//!     stamp_path(&mut field, &Profile::DEFAULT, &path);
//! }
//! assert!(field.depth.as_slice().iter().any(|&depth| depth > 0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod catch;
mod chipped;
mod correction;
mod dirty;
mod distance;
mod layer;
mod ragged;
mod rect;
mod replay;
mod section;
mod stamp;

pub use correction::SlopeCorrection;
pub use dirty::DirtyTiles;
pub use distance::{MAX_DISTANCE, crack_distance};
pub(crate) use layer::{CrushedField, Layer, PIT_STEPS, Plate, SLOPE_UNIT, Spot, noise, noise_row};
pub use layer::{CrushedZone, LayerPlan, Veil};
pub use rect::TexelRect;
pub use replay::{DOT_DEPTH, Replay, ReplayChanges};
#[cfg(feature = "bevy")]
pub(crate) use stamp::make_tables;
pub use stamp::{stamp_dot, stamp_path, stamp_path_with};

use crate::{
    Grid, OutOfMemory,
    pattern::{CellTracker, CrackMask, Moment, Network, SurfaceFrame, Timeline},
    relief::Crater,
};
use glam::{UVec2, Vec2};
use std::sync::Arc;

/// How deep the crack is at each texel: 0 = untouched, 65535 = the deepest; row-major from the top left.
///
/// ```
/// use bevy_crack::{
///     OutOfMemory,
///     pattern::{CrackMask, PathPoint, SegmentPath, SurfaceFrame},
///     raster::{DepthField, Profile, TexelRect, stamp_dot, stamp_path_with},
/// };
///
/// let frame = SurfaceFrame::new([8, 4].into())?;
/// // An error where there is no memory.
/// let mut field: DepthField = DepthField::try_new(frame).map_err(|OutOfMemory { bytes }| format!("{bytes} bytes"))?;
/// // The right half is a frame of metal.
/// let forbidden = CrackMask::layer([2, 1].into(), &[0, 255])?;
/// field.set_forbidden(&CrackMask { forbidden: Some(forbidden), ..CrackMask::default() });
///
/// // A straight line through the second row.
/// let point = |x| PathPoint { pos: [x, 0.375].into(), width: 0.25 };
/// let mut changed = TexelRect::default();
/// let slot = Profile { wall: 0.0, full_width: 0.1, ..Profile::DEFAULT };
/// let path = SegmentPath::straight(point(0.0), point(2.0));
/// stamp_path_with(&mut field, &slot, &path, &mut |rect| changed = changed.union(rect));
/// assert_eq!(field.depth.row(1), [65535, 65535, 65535, 65535, 0, 0, 0, 0]);
/// assert_eq!(field.depth.row(3), [0; 8]);
/// assert!(changed.min.y <= 1 && changed.max.y >= 2);
///
/// // A disc of half the depth on the last row.
/// stamp_dot(&mut field, [0.125, 0.875].into(), 0.125, 0.5);
/// assert_eq!(field.depth.row(3)[0], 32768);
/// field.clear();
/// assert!(field.depth.as_slice().iter().all(|depth| *depth == 0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DepthField {
    /// The position of the field in pattern space.
    pub frame: SurfaceFrame,
    /// One value per texel of the frame.
    pub depth: Grid<u16>,
    /// Texels that always stay untouched.
    forbidden: Option<Grid<bool>>,
    layer: Layer,
    correction: Option<Arc<SlopeCorrection>>,
}

impl DepthField {
    /// An untouched field.
    #[must_use]
    pub fn new(frame: SurfaceFrame) -> Self {
        Self::over(frame, Grid::new(frame.size(), u16::MAX))
    }

    /// Like [`new`](Self::new), which ends the program where there is no memory.
    ///
    /// # Errors
    /// [`OutOfMemory`] if there is no memory for the depths.
    pub fn try_new(frame: SurfaceFrame) -> Result<Self, OutOfMemory> {
        Ok(Self::over(frame, Grid::try_new(frame.size(), u16::MAX)?))
    }

    fn over(frame: SurfaceFrame, mut depth: Grid<u16>) -> Self {
        // Written twice: the first write to each page of new memory is slow (a page fault), and it should not happen
        // while cracks grow.
        std::hint::black_box(&mut depth).as_mut_slice().fill(0);
        Self { frame, depth, forbidden: None, layer: Layer::default(), correction: None }
    }

    /// A field without texels, on which nothing is drawn.
    #[cfg(feature = "bevy")]
    pub(crate) fn without_texels(frame: SurfaceFrame) -> Self {
        let depth = Grid::new(UVec2::ZERO, 0);
        Self { frame, depth, forbidden: None, layer: Layer::default(), correction: None }
    }

    /// Moves the field out and leaves one without texels.
    #[cfg(feature = "bevy")]
    pub(crate) fn take(&mut self) -> Self {
        let empty = Self::without_texels(self.frame);
        std::mem::replace(self, empty)
    }

    /// Makes all texels untouched. Forbidden texels stay forbidden; a correction of slopes is removed.
    pub fn clear(&mut self) {
        self.correction = None;
        self.depth.as_mut_slice().fill(0);
        self.layer.clear(self.frame);
    }

    /// Sets the layers that the field holds in addition to depths, all empty.
    pub fn set_layers(&mut self, plan: LayerPlan) {
        self.layer = Layer::new(plan, self.frame);
    }

    /// The layers that the field holds in addition to depths.
    #[must_use]
    pub const fn plan(&self) -> &LayerPlan {
        self.layer.plan()
    }

    /// Sets the slopes that are added to the surface's own normals where a look blends by Poisson, or removes them.
    /// They should be [solved](crate::blend::solve_correction) from the depths of this field.
    pub fn correct(&mut self, correction: Option<Arc<SlopeCorrection>>) {
        self.correction = correction;
    }

    /// The slopes that are added to the surface's own normals, if there are any.
    #[must_use]
    pub const fn correction(&self) -> Option<&Arc<SlopeCorrection>> {
        self.correction.as_ref()
    }

    /// Updates the layers to those of `network` at `moment`, and appends the rectangles of the texels that may have
    /// changed.
    ///
    /// `network` and `timeline` must belong to one growth, which may have grown since the last call. The result
    /// depends only on the moment. A cell that closes costs its own area once, a hit its crushed zone.
    /// [`Replay::show`] calls this itself.
    pub fn show_layers(
        &mut self,
        network: &Network,
        timeline: &Timeline,
        moment: Moment,
        changed: &mut Vec<TexelRect>,
    ) {
        self.begin_layer(network, timeline, moment, changed);
        self.crush(usize::MAX, changed);
    }

    /// Like [`show_layers`](Self::show_layers) without the crushed zones, which [`crush`](Self::crush) draws.
    pub(crate) fn begin_layer(
        &mut self,
        network: &Network,
        timeline: &Timeline,
        moment: Moment,
        changed: &mut Vec<TexelRect>,
    ) {
        self.layer.show(network, timeline, moment, self.forbidden.as_ref(), changed);
        changed.retain(|rect| !rect.is_empty());
    }

    /// Registers the hits up to `moment`, so that their crushed zones can be drawn;
    /// [`begin_layer`](Self::begin_layer) does the same.
    #[cfg_attr(not(feature = "bevy"), expect(dead_code, reason = "surfaces of the plugin are hit"))]
    pub(crate) fn follow_hits(&mut self, timeline: &Timeline, moment: Moment) {
        self.layer.follow(timeline, moment);
    }

    /// Draws at most so many parts of crushed zones, each of one hit on one tile of 32 x 32 texels, from each hit outward. Returns whether
    /// any are left.
    pub(crate) fn crush(&mut self, parts: usize, changed: &mut Vec<TexelRect>) -> bool {
        let is_left = self.layer.crush(parts, self.forbidden.as_ref(), changed);
        changed.retain(|rect| !rect.is_empty());
        is_left
    }

    /// Whether tiles of crushed zones are left to draw.
    #[cfg_attr(not(feature = "bevy"), expect(dead_code, reason = "surfaces of the plugin are hit"))]
    pub(crate) fn is_behind(&self) -> bool {
        self.layer.is_behind()
    }

    /// Whether closed cells are plates of their own.
    #[cfg_attr(not(feature = "bevy"), expect(dead_code, reason = "surfaces of the plugin forget"))]
    pub(crate) const fn has_plates(&self) -> bool {
        self.layer.has_plates()
    }

    /// Continues with a network whose oldest part was removed: the plates that are shown stay. `cells` are what is left, as
    /// [recorded](CellTracker::recording).
    #[cfg_attr(not(feature = "bevy"), expect(dead_code, reason = "surfaces of the plugin forget"))]
    pub(crate) fn freeze_plates(&mut self, cells: CellTracker) {
        self.layer.freeze(cells);
    }

    /// The crater that impact number `impact` at `pos` (pattern units) has at an energy, as it is drawn: its contours, and how deep it is.
    /// `None` if the [plan](Self::plan) has no crushed zones with [terraces](CrushedZone::terraces), or the energy is 0 or less.
    ///
    /// ```
    /// use bevy_crack::{paint::Look, pattern::SurfaceFrame, raster::DepthField};
    ///
    /// let mut field = DepthField::new(SurfaceFrame::new([256, 256].into())?);
    /// field.set_layers(Look::CONCRETE.layer(7));
    /// let crater = |energy| field.crater(0, [0.5, 0.5].into(), energy);
    /// assert!(crater(4.0).map(|crater| crater.reach()) > crater(1.0).map(|crater| crater.reach()));
    /// assert_eq!(crater(0.0), None);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn crater(&self, impact: u32, pos: Vec2, energy: f32) -> Option<Crater> {
        self.plan().crater(impact, pos, energy)
    }

    pub(crate) const fn layer(&self) -> &Layer {
        &self.layer
    }

    /// Keeps every texel whose centre `mask` forbids untouched from now on, and clears those that were drawn on.
    ///
    /// Growth keeps the centre lines out of these texels; this keeps the width of the lines out as well.
    pub fn set_forbidden(&mut self, mask: &CrackMask) {
        let size = self.frame.size();
        self.forbidden = mask.forbidden.as_ref().map(|_| {
            let forbids = |x, y| mask.is_forbidden((UVec2::new(x, y).as_vec2() + 0.5) / size.as_vec2());
            let mut forbidden = Grid::new(size, false);
            for y in 0..size.y {
                for (x, texel) in (0..).zip(forbidden.row_mut(y as usize)) {
                    *texel = forbids(x, y);
                }
            }
            forbidden
        });
        self.spare(TexelRect::whole(size));
    }

    /// Clears the forbidden texels in `rect`.
    fn spare(&mut self, rect: TexelRect) {
        let Some(forbidden) = &self.forbidden else { return };
        for y in rect.min.y..rect.max.y {
            let texels = rect.min.x as usize..rect.max.x as usize;
            let depth = &mut self.depth.row_mut(y as usize)[texels.clone()];
            for (depth, forbidden) in depth.iter_mut().zip(&forbidden.row(y as usize)[texels.clone()]) {
                if *forbidden {
                    *depth = 0;
                }
            }
            if let Some(veil) = &mut self.layer.veil {
                let veil = &mut veil.density_mut().row_mut(y as usize)[texels.clone()];
                for (veil, forbidden) in veil.iter_mut().zip(&forbidden.row(y as usize)[texels]) {
                    if *forbidden {
                        *veil = 0;
                    }
                }
            }
        }
    }
}

/// The cross-section of a crack.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct Profile {
    /// Depth in the middle of a crack of [`full_width`](Self::full_width) or more. Range 0..=1; default 1.
    pub depth: f32,
    /// Width at which a crack reaches full depth; thinner cracks are shallower, down to 40 %. Pattern units, > 0;
    /// default 0.02.
    pub full_width: f32,
    /// How much of the half width is wall: 0 = a slot with upright walls, 1 = a V. Range 0..=1; default 0.6.
    pub wall: f32,
    /// Width of the chipped rim on either side. Pattern units, 0..=0.2; default 0.
    pub rim_width: f32,
    /// Depth of the rim where it meets the crack; it falls to 0 outward. Range 0..=1; default 0.
    pub rim_depth: f32,
    /// How slowly lines thinner than a texel fade. They are fully visible down to a width of `1 - faintest` texels,
    /// and fade in proportion to their width below: 0 = they cover as much as they are wide. Range 0..=1; default 0.
    ///
    /// Larger values keep fine cracks visible on small pictures. Pointed ends fade all the same.
    pub faintest: f32,
    /// Whether walls are equally steep at every width. Depth then measures the distance from the edge, and is 1 half
    /// a [`full_width`](Self::full_width) away from it; [`wall`](Self::wall) has no effect. For
    /// [drawn](crate::paint::Cel) cracks; default false.
    pub even_walls: bool,
    /// How far the edges of a crack deviate from its smooth outline, each on its own: chips, crumbling material.
    /// Narrow cracks deviate less, by up to 60 % of their half width, and 33 % if all of it is [`wall`](Self::wall).
    /// Pattern units, 0..=0.05; default 0.
    pub ragged: f32,
    /// How far pieces have come off the edges of wide cracks, at most: some whole, some leave a shallow step. Pieces are about three times as long as
    /// this along the crack. They come off by at most 9 texels, and less from narrow cracks. It has no effect with [`even_walls`](Self::even_walls). Pattern units, 0..=0.05; default 0.
    pub chipped: f32,
    /// How high stones lie in deep cracks, as a share of [`depth`](Self::depth). They are about twice as large as [`chipped`](Self::chipped), 2 to 16 texels. It has no effect with [`even_walls`](Self::even_walls). Range 0..=1; default 0.
    pub rubble: f32,
    /// How much of the depth of wide cracks is an upright edge, above the [`wall`](Self::wall): where they broke apart. It begins at a width of 5
    /// texels and is all there from 12 on. It has no effect with [`even_walls`](Self::even_walls). Range 0..=1; default 0.
    pub edge: f32,
}

impl Profile {
    /// The default: a groove with sloping walls and no rim.
    pub const DEFAULT: Self = Self {
        depth: 1.0,
        full_width: 0.02,
        wall: 0.6,
        rim_width: 0.0,
        rim_depth: 0.0,
        faintest: 0.0,
        even_walls: false,
        ragged: 0.0,
        chipped: 0.0,
        rubble: 0.0,
        edge: 0.0,
    };
}

impl Default for Profile {
    fn default() -> Self {
        Self::DEFAULT
    }
}
