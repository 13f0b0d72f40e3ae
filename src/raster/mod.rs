//! Networks to a depth field, anti-aliased, combined by max.
//!
//! Depth is 16 bits a texel: 0 = untouched, 65535 = the deepest. Because stamps combine by max, painting is order-free
//! and a segment can be stamped again, wider, without its neighbours.
//!
//! Beside depths a field may hold what some looks show ([`LayerPlan`]): plates, crushed zones and veils.

mod catch;
mod dirty;
mod distance;
mod layer;
mod rect;
mod replay;
mod section;
mod stamp;

pub use dirty::DirtyTiles;
pub use distance::{MAX_DISTANCE, crack_distance};
pub use layer::{Crushed, LayerPlan, Veil};
pub(crate) use layer::{CrushedField, Layer, PIT_STEPS, Plate, SLOPE_UNIT, Spot, noise};
pub use rect::TexelRect;
pub use replay::{DOT_DEPTH, Redrawn, Replay};
pub use stamp::{stamp_dot, stamp_path, stamp_path_with};

use crate::{
    Grid,
    pattern::{CrackMask, Moment, Network, SurfaceFrame, Timeline},
};
use glam::UVec2;

/// How deep the crack is at each texel: 0 = untouched, 65535 = the deepest; row-major from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthField {
    /// Where the field lies in pattern space.
    pub frame: SurfaceFrame,
    /// One value per texel of the frame.
    pub depth: Grid<u16>,
    /// Texels that stay untouched.
    forbidden: Option<Grid<bool>>,
    layer: Layer,
}

impl DepthField {
    /// An untouched field.
    #[must_use]
    pub fn new(frame: SurfaceFrame) -> Self {
        // Written twice: new memory is dear at the first write of each page, which else comes when cracks grow.
        let mut depth = Grid::new(frame.size(), u16::MAX);
        std::hint::black_box(&mut depth).as_mut_slice().fill(0);
        Self { frame, depth, forbidden: None, layer: Layer::default() }
    }

    /// Takes the depths out, and leaves a field without texels in the same place, on which nothing is drawn.
    #[cfg(feature = "bevy")]
    pub(crate) fn take(&mut self) -> Self {
        let empty =
            Self { frame: self.frame, depth: Grid::new(UVec2::ZERO, 0), forbidden: None, layer: Layer::default() };
        std::mem::replace(self, empty)
    }

    /// Makes all of it untouched. What is forbidden stays so.
    pub fn clear(&mut self) {
        self.depth.as_mut_slice().fill(0);
        self.layer.clear(self.frame);
    }

    /// Lets it hold what `plan` says beside depths, of which nothing is there at first.
    pub fn lay(&mut self, plan: LayerPlan) {
        self.layer = Layer::new(plan, self.frame);
    }

    /// What it holds beside depths.
    #[must_use]
    pub const fn plan(&self) -> &LayerPlan {
        self.layer.plan()
    }

    /// Makes what it holds beside depths that of `network` at `moment`; appends the rectangles of the texels that may be others now.
    ///
    /// Network and timeline must be those of one growth, which may have grown since the last time. What it holds depends on the moment
    /// alone. A cell that closes costs its own area once, a hit its crushed zone. [`Replay::show`] does it by itself.
    pub fn show_layer(&mut self, network: &Network, timeline: &Timeline, moment: Moment, changed: &mut Vec<TexelRect>) {
        self.begin_layer(network, timeline, moment, changed);
        self.crush(usize::MAX, changed);
    }

    /// The same, but for what hits have crushed: that is drawn by [`crush`](Self::crush).
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

    /// Takes up the hits until then, so that what they have crushed can be drawn; [`begin_layer`](Self::begin_layer) does it by itself.
    #[cfg_attr(not(feature = "bevy"), expect(dead_code, reason = "surfaces of the plugin are hit"))]
    pub(crate) fn follow_hits(&mut self, timeline: &Timeline, moment: Moment) {
        self.layer.follow(timeline, moment);
    }

    /// Draws what hits have crushed, at most so many tiles of 32 x 32 texels, from each hit outward. Returns whether any are left.
    pub(crate) fn crush(&mut self, tiles: usize, changed: &mut Vec<TexelRect>) -> bool {
        let is_left = self.layer.crush(tiles, self.forbidden.as_ref(), changed);
        changed.retain(|rect| !rect.is_empty());
        is_left
    }

    /// Whether any are left.
    #[cfg_attr(not(feature = "bevy"), expect(dead_code, reason = "surfaces of the plugin are hit"))]
    pub(crate) fn is_behind(&self) -> bool {
        self.layer.is_behind()
    }

    /// Goes on with a network whose oldest part was forgotten: what is shown stays.
    #[cfg_attr(not(feature = "bevy"), expect(dead_code, reason = "surfaces of the plugin forget"))]
    pub(crate) fn freeze_layer(&mut self, network: &Network, timeline: &Timeline) {
        self.layer.freeze(network, timeline);
    }

    pub(crate) const fn layer(&self) -> &Layer {
        &self.layer
    }

    /// Keeps every texel whose centre `mask` forbids untouched from now on, and gives back those that are not.
    ///
    /// Growth keeps its lines out of them; this keeps the width of the lines out as well.
    pub fn forbid(&mut self, mask: &CrackMask) {
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

    /// Takes back what was stamped on forbidden texels in `rect`.
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
    /// Width at which a crack reaches full depth; thinner ones are shallower, down to 40 %. Pattern units, > 0; default 0.02.
    pub full_width: f32,
    /// How much of the half width is wall: 0 = a slot with upright walls, 1 = a V. Range 0..=1; default 0.6.
    pub wall: f32,
    /// Width of the chipped rim on either side. Pattern units, 0..=0.2; default 0.
    pub rim_width: f32,
    /// Depth of the rim where it meets the crack, falling to 0 outward. Range 0..=1; default 0.
    pub rim_depth: f32,
    /// How slowly lines thinner than a texel fade: they are full down to a width of `1 - faintest` texels, and fade by their width
    /// from there: 0 = they cover as much as they are wide. Range 0..=1; default 0.
    ///
    /// Keeps fine cracks visible on small pictures; the ends of needles fade all the same.
    pub faintest: f32,
    /// Whether walls are equally steep whatever the width: depth then tells how far the edge is, and is 1 half a
    /// [`full_width`](Self::full_width) away from it. [`wall`](Self::wall) does not count then. For [drawn](crate::paint::Cel) cracks; default false.
    pub even_walls: bool,
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
    };
}

impl Default for Profile {
    fn default() -> Self {
        Self::DEFAULT
    }
}
