//! [`Layer`]: what a field holds in addition to depths, for the looks that show it: plates, crushed zones and veils.

mod break_off;
mod broken;
mod bruise;
mod crushed;
mod draws;
mod ledges;
mod noise;
mod outline;
mod plates;
mod row;
mod shape;
mod spot;
mod stone;
mod texels;
mod veil;
mod zones;

pub use crushed::CrushedZone;
pub(crate) use noise::{noise, noise_row};
pub(crate) use plates::Plate;
pub(crate) use spot::{PIT_STEPS, SLOPE_UNIT, Spot};
pub use veil::Veil;
pub(super) use veil::VeilField;
pub(crate) use zones::CrushedField;
use zones::crater_of;

use super::TexelRect;
use crate::{
    Grid,
    pattern::{CellTracker, Moment, Network, SurfaceFrame, Timeline},
    relief::Crater,
};
use glam::Vec2;
use plates::PlateField;

/// The layers that a [`DepthField`](super::DepthField) holds in addition to depths.
/// [`Look::layer`](crate::paint::Look::layer) returns the plan that a look needs.
///
/// ```
/// use bevy_crack::{
///     CrackPreset,
///     growth::CrackGrowth,
///     pattern::{Moment, SurfaceFrame},
///     raster::{CrushedZone, DepthField, LayerPlan, Veil},
/// };
///
/// let mut growth = CrackGrowth::new(CrackPreset::CLAY.growth, [1.0, 1.0].into(), 1)?;
/// growth.hit([0.5, 0.5].into(), 1.0);
/// while growth.step().grew() {}
///
/// // Plates, and crushed stone where the surface was hit; with a veil it would take a byte more.
/// let plan = LayerPlan { plates: true, crushed: Some(CrushedZone::DEFAULT), ..LayerPlan::default() };
/// let veiled = LayerPlan { veil: Some(Veil::DEFAULT), ..plan.clone() };
/// assert_eq!((plan.bytes_per_texel(), veiled.bytes_per_texel()), (2, 3));
/// let mut field = DepthField::new(SurfaceFrame::new([64, 64].into())?);
/// field.set_layers(plan.clone());
/// assert_eq!(field.plan(), &plan);
/// let (network, timeline) = (growth.network(), growth.timeline());
/// let mut changed = Vec::new();
/// field.show_layers(network, timeline, Moment::after(timeline.end()), &mut changed);
/// assert!(!changed.is_empty(), "these are to be painted");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LayerPlan {
    /// Whether to record which closed cell each texel lies in; default no.
    pub plates: bool,
    /// Thickness of plates beside those that are missing in a hole, pattern units, 0..=0.02; default 0.
    pub thickness: f32,
    /// Crushed zones around hits; default none.
    pub crushed: Option<CrushedZone>,
    /// Sheets along cracks; default none.
    pub veil: Option<Veil>,
    /// How far the floor of a crack is moved to the upper left: as a share of the crack's half width, and the largest
    /// distance in pattern units. The field records how much of each texel the floor covers. Not used with a veil.
    /// 0..=1 and 0..=0.5; default 0 = no floor.
    pub floor: [f32; 2],
    /// How much of its depth a line has only where it catches the light: lines that run towards the light are stamped
    /// less deep, and so are some places along each line. 0..=1; default 0 = all lines are as deep as their profile
    /// says.
    pub directionality: f32,
    /// Width from which a crack has the whole rim of its profile; narrower cracks have a fainter rim. Pattern units,
    /// 0..=1; default 0 = all cracks have the whole rim.
    pub full_rim: f32,
    /// Seed of the random details; default 0.
    pub seed: u64,
}

impl LayerPlan {
    /// Approximate memory per texel of the field, bytes. Crushed zones take additional memory where they are.
    #[must_use]
    pub const fn bytes_per_texel(&self) -> u64 {
        (if self.plates { 2 } else { 0 }) + (if self.veil.is_some() || self.floor[0] > 0.0 { 1 } else { 0 })
    }

    /// The crater that an impact at `pos` (pattern units) has at an energy, if zones have terraces.
    pub(crate) fn crater(&self, impact: u32, pos: Vec2, energy: f32) -> Option<Crater> {
        crater_of(self.crushed.as_ref()?, self.seed, impact, pos, energy)
    }
}

/// See [`LayerPlan`]. It follows a network and its timeline; its content depends only on the moment, bit for bit.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Layer {
    plan: LayerPlan,
    plates: Option<Box<PlateField>>,
    crushed: Option<Box<CrushedField>>,
    pub(super) veil: Option<Box<VeilField>>,
}

impl Layer {
    pub(super) fn new(plan: LayerPlan, frame: SurfaceFrame) -> Self {
        let plates = plan.plates.then(|| Box::new(PlateField::new(frame, plan.seed, plan.thickness)));
        let crushed = plan
            .crushed
            .as_ref()
            .map(|crushed| Box::new(CrushedField::new(crushed, frame, plan.seed).with_sides(plan.thickness)));
        let veil = match &plan.veil {
            Some(veil) => Some(Box::new(VeilField::new(veil, frame, plan.seed))),
            None => (plan.floor[0] > 0.0).then(|| Box::new(VeilField::floor(plan.floor, frame))),
        };
        Self { plan, plates, crushed, veil }
    }

    /// Resets it to its state after [`new`](Self::new).
    pub(super) fn clear(&mut self, frame: SurfaceFrame) {
        *self = Self::new(std::mem::take(&mut self.plan), frame);
    }

    /// Shows everything except the crushed zones, which [`crush`](Self::crush) draws.
    pub(super) fn show(
        &mut self,
        network: &Network,
        timeline: &Timeline,
        moment: Moment,
        forbidden: Option<&Grid<bool>>,
        changed: &mut Vec<TexelRect>,
    ) {
        if let Some(plates) = &mut self.plates {
            plates.show(network, timeline, moment, forbidden, changed);
        }
        self.follow(timeline, moment);
    }

    /// Registers the hits up to `moment`.
    pub(super) fn follow(&mut self, timeline: &Timeline, moment: Moment) {
        if let Some(crushed) = &mut self.crushed {
            let count = timeline.entries(moment.begun()).strikes;
            crushed.follow(&timeline.strikes()[..count], timeline.strikes());
        }
    }

    /// Draws at most so many parts of crushed zones, of one hit on one tile each. Returns whether any are left.
    pub(super) fn crush(&mut self, parts: usize, forbidden: Option<&Grid<bool>>, changed: &mut Vec<TexelRect>) -> bool {
        self.crushed.as_mut().is_some_and(|crushed| crushed.draw_some(parts, forbidden, changed))
    }

    /// Whether tiles are left to draw.
    pub(super) fn is_behind(&self) -> bool {
        self.crushed.as_ref().is_some_and(|crushed| crushed.is_behind())
    }

    /// Continues with a network whose oldest part was removed.
    pub(super) fn freeze(&mut self, cells: CellTracker) {
        if let Some(plates) = &mut self.plates {
            plates.freeze(cells);
        }
    }

    pub(super) const fn has_plates(&self) -> bool {
        self.plates.is_some()
    }

    pub(super) const fn plan(&self) -> &LayerPlan {
        &self.plan
    }

    pub(crate) fn veil(&self) -> Option<&Grid<u8>> {
        self.veil.as_deref().map(VeilField::density)
    }

    pub(crate) fn plates(&self) -> Option<&PlateField> {
        self.plates.as_deref().filter(|plates| !plates.is_empty())
    }

    pub(crate) fn crushed(&self) -> Option<&CrushedField> {
        self.crushed.as_deref().filter(|crushed| !crushed.is_empty())
    }
}
