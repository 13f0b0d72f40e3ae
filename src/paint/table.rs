//! [`LookTable`]: a look prepared for painting.

use super::{
    cast::Cast,
    cel::Strokes,
    facets::Facets,
    look::{ColorStop, Look},
    patch::Curve,
    range::{LookError, within},
    shades::Shades,
};
use crate::{Grid, blend::NormalBlending, pattern::MAX_SIDE, raster::TexelRect};
use glam::{UVec2, Vec4};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Bumps per pattern unit of the noise that varies the cover along cracks.
const SPARKLES: f32 = 28.0;

/// Bumps of the light on walls per pattern unit.
const GLINTS: f32 = 40.0;

/// Steps of the precomputed ramp: one for each value of the high byte of a depth.
const STEPS: usize = 256;

/// The colour over the picture at a depth: colour times cover in 0..=255 (sRGB), and cover 0..=1.
pub(super) type Layer = Vec4;

/// One entry for depth 0, then the ramp at depths 0, 256, .. 65280, each with the difference to the next entry.
/// Values between are interpolated linearly, so that slow gradients have no steps.
type Ramp = [[Layer; 2]; STEPS + 1];

/// Ramps in use, with the stops from which they were made. Surfaces with the same stops share one ramp, so that it
/// stays in the processor's caches while many surfaces are painted.
static RAMPS: Mutex<Vec<(Vec<ColorStop>, Weak<Ramp>)>> = Mutex::new(Vec::new());

/// The largest number of shared ramps.
const MAX_SHARED: usize = 64;

/// A [`Look`] prepared for painting: lengths in texels, ramps as tables.
#[derive(Clone, Debug, PartialEq)]
pub struct LookTable {
    ramp: Arc<Ramp>,
    glow: Option<Arc<Ramp>>,
    pub(super) tint: f32,
    pub(super) glint: f32,
    pub(super) uneven_glint: f32,
    /// Bumps of its noise per texel.
    pub(super) glint_scale: f32,
    pub(super) gloss: f32,
    pub(super) shadow: f32,
    /// Shadows of edges.
    pub(super) cast: Option<Cast>,
    pub(super) sparkle: f32,
    /// Bumps of the sparkle noise per texel.
    pub(super) sparkle_scale: f32,
    /// The height of curled rims by depth.
    pub(super) curve: Option<Box<Curve>>,
    pub(super) cel: Option<Strokes>,
    pub(super) facets: Option<Facets>,
    /// Colour of the reflections of plates, 0..=255.
    pub(super) sheen: [f32; 3],
    /// Colour of the sides of plates, 0..=255, and their thickness, texels.
    pub(super) side: [f32; 3],
    pub(super) thick: f32,
    /// Colour of veils, 0..=255, and the cover of one step of their density; zero if there are none.
    pub(super) veil: [f32; 3],
    pub(super) veil_cover: f32,
    pub(super) grain: f32,
    pub(super) shift: f32,
    /// Share of a depth map's range for one pattern unit of depth.
    pub(super) deep: f32,
    /// From the Sobel sum of `u16` depths to the slope of the surface.
    pub(super) slope: f32,
    pub(super) normals: NormalBlending,
    pub(super) opaque: bool,
    /// Number of shades; `None` = smooth.
    pub(super) steps: Option<u8>,
}

impl Look {
    /// The height of the surface at each depth; 65536 = at the bottom.
    fn curve(&self) -> Option<Box<Curve>> {
        (self.curl > 0.0).then(|| {
            Box::new(Curve(std::array::from_fn(|step| {
                let depth = step as f32 / STEPS as f32;
                let rim = (1.0 - (depth / self.curl_depth - 1.0).abs()).max(0.0);
                ((depth - self.curl * rim) * 65535.0) as i32
            })))
        })
    }
}

/// Colour and cover at `depth` (0..=1). Before the first stop the cover rises from zero; after the last nothing
/// changes.
fn at(stops: &[ColorStop], depth: f32) -> ([f32; 3], f32) {
    let Some(first) = stops.first() else { return ([0.0; 3], 0.0) };
    let mut low =
        ColorStop { depth: 0.0, color: first.color, cover: if first.depth > 0.0 { 0.0 } else { first.cover } };
    for &high in stops {
        if depth < high.depth {
            let t = (depth - low.depth) / (high.depth - low.depth);
            let mix = |a: f32, b: f32| a + (b - a) * t;
            let color = std::array::from_fn(|i| mix(low.color[i], high.color[i]));
            return (color, mix(low.cover, high.cover));
        }
        low = high;
    }
    (low.color, low.cover)
}

fn ramp(stops: &[ColorStop]) -> Ramp {
    let layer = |step: usize| {
        let (color, cover) = at(stops, step as f32 / STEPS as f32);
        let [r, g, b] = color.map(|channel| 255.0 * channel * cover);
        Layer::new(r, g, b, cover)
    };
    let mut ramp = [[Layer::ZERO; 2]; STEPS + 1];
    for (step, place) in ramp[1..].iter_mut().enumerate() {
        *place = [layer(step), layer(step + 1) - layer(step)];
    }
    ramp
}

fn shared_ramp(wanted: &[ColorStop]) -> Arc<Ramp> {
    let mut ramps = RAMPS.lock().unwrap_or_else(PoisonError::into_inner);
    let known = ramps.iter().find(|(stops, _)| **stops == *wanted).and_then(|(_, ramp)| ramp.upgrade());
    known.unwrap_or_else(|| {
        ramps.retain(|(_, ramp)| ramp.strong_count() > 0);
        let ramp = Arc::new(ramp(wanted));
        if ramps.len() < MAX_SHARED {
            ramps.push((wanted.to_vec(), Arc::downgrade(&ramp)));
        }
        ramp
    })
}

impl LookTable {
    /// Prepares `look` for painting; `texels_per_unit` is that of the [`SurfaceFrame`](crate::pattern::SurfaceFrame).
    ///
    /// # Errors
    /// [`LookError::OutOfRange`] if a field or `texels_per_unit` is out of its range or not finite.
    pub fn new(look: &Look, texels_per_unit: f32) -> Result<Self, LookError> {
        look.validate()?;
        within("texels_per_unit", texels_per_unit, f32::MIN_POSITIVE..=MAX_SIDE as f32, "above 0, up to 16384")?;
        let ramp = shared_ramp(&look.ramp);
        let glow = (!look.glow.is_empty()).then(|| shared_ramp(&look.glow));
        // Sobel's kernel weighs a slope of one depth step per texel with 8.
        let slope = look.relief * texels_per_unit / (8.0 * 65535.0);
        let Look { tint, glint, uneven_glint, gloss, shadow, sparkle, grain, shift, normals, opaque, facets, .. } =
            *look;
        Ok(Self {
            ramp,
            glow,
            tint,
            glint,
            uneven_glint,
            glint_scale: GLINTS / texels_per_unit,
            gloss,
            shadow,
            cast: (shadow > 0.0 && look.cel.is_none())
                .then(|| Cast::new(look.cast * look.relief * texels_per_unit))
                .flatten(),
            sparkle,
            sparkle_scale: SPARKLES / texels_per_unit,
            curve: look.curve(),
            cel: look.cel.map(|cel| Strokes::new(&cel, texels_per_unit)),
            facets,
            side: facets.map_or([0.0; 3], |facets| facets.side_color.map(|channel| 255.0 * channel)),
            thick: facets.map_or(0.0, |facets| facets.thickness * texels_per_unit),
            sheen: facets.map_or([0.0; 3], |facets| facets.reflection_color.map(|channel| 255.0 * channel)),
            veil: look.veil.map_or([0.0; 3], |veil| veil.color.map(|channel| 255.0 * channel)),
            veil_cover: look.veil.map_or(0.0, |veil| veil.cover * (1.0 / 255.0)),
            grain,
            shift,
            deep: if look.relief > 0.0 { 1.0 / look.relief } else { 0.0 },
            slope,
            normals,
            opaque,
            steps: match look.shades {
                Shades::Auto | Shades::Smooth => None,
                Shades::Steps(steps) => Some(steps),
            },
        })
    }

    /// The texels that may look different after `depths` of a field have changed in `rect`: normals depend on the texels around their own, and where
    /// cracks [cast shadows](Look::cast), so do the colours of cracks up to 64 texels to the right and below.
    ///
    /// ```
    /// use bevy_crack::{
    ///     Grid,
    ///     paint::{Look, LookTable},
    ///     raster::TexelRect,
    /// };
    ///
    /// let mut depths = Grid::new([512, 512].into(), 0);
    /// let rect = TexelRect { min: [40, 40].into(), max: [44, 42].into() };
    /// let around = TexelRect { min: [39, 39].into(), max: [45, 43].into() };
    /// let [groove, concrete] = [Look::GROOVE, Look::CONCRETE].map(|look| LookTable::new(&look, 512.0));
    /// let (groove, concrete) = (groove?, concrete?);
    /// assert_eq!(groove.affected(rect, &depths), around);
    /// assert_eq!(concrete.affected(rect, &depths), around);
    /// // Another crack may lie in the shadow of what has changed.
    /// depths.row_mut(46)[48] = 9000;
    /// assert_eq!(groove.affected(rect, &depths), around);
    /// assert_eq!(concrete.affected(rect, &depths), TexelRect { max: [49, 47].into(), ..around });
    /// # Ok::<(), bevy_crack::paint::LookError>(())
    /// ```
    #[must_use]
    pub fn affected(&self, rect: TexelRect, depths: &Grid<u16>) -> TexelRect {
        let mut grown = rect.grow(1, depths.size());
        if let Some(cast) = &self.cast
            && !grown.is_empty()
        {
            let end = rect.max.saturating_add(UVec2::splat(cast.reach)).min(depths.size());
            for y in rect.min.y..end.y {
                // The texels of the row that are not affected yet.
                let start = if y < grown.max.y { grown.max.x.min(end.x) } else { rect.min.x };
                let row = &depths.row(y as usize)[start as usize..end.x as usize];
                if let Some(last) = row.iter().rposition(|&depth| depth != 0) {
                    grown.max = grown.max.max(UVec2::new(start + last as u32 + 1, y + 1));
                }
            }
        }
        grown
    }

    /// Whether cracks emit light.
    pub(super) const fn glows(&self) -> bool {
        self.glow.is_some()
    }

    /// The emitted light at a depth: three channels, 0..=255.
    pub(super) fn light(&self, depth: u16) -> [f32; 3] {
        let Some(glow) = &self.glow else { return [0.0; 3] };
        let [low, gain] = glow[usize::from(depth >> 8) + usize::from(depth != 0)];
        let [r, g, b, _] = (low + gain * Self::between(depth)).to_array();
        [r, g, b]
    }

    /// The colour of the ramp at `depth`; `between` is [`Self::between`] of that depth.
    #[inline(always)]
    pub(super) fn layer(&self, depth: u16, between: f32) -> Layer {
        // Depth zero selects the first entry, without a branch.
        let [low, gain] = self.ramp[usize::from(depth >> 8) + usize::from(depth != 0)];
        low + gain * between
    }

    /// Position of `depth` between the step before it and the step after it, 0..1.
    #[inline(always)]
    pub(super) fn between(depth: u16) -> f32 {
        f32::from(depth & 255) * (1.0 / 256.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        paint::{cel::Cel, look::stop},
        raster::{CrushedZone, Veil},
    };

    fn layer(table: &LookTable, depth: u16) -> [f32; 4] {
        table.layer(depth, LookTable::between(depth)).to_array()
    }

    fn refused(look: &Look) -> Option<&'static str> {
        match LookTable::new(look, 512.0) {
            Ok(_) => None,
            Err(LookError::OutOfRange { field, .. }) => Some(field),
        }
    }

    #[test]
    fn the_constants_are_valid() {
        for name in Look::NAMES {
            assert_eq!(refused(&Look::named(name).unwrap()), None, "{name}");
        }
        assert_eq!(Look::named("no such"), None);
        assert_eq!(refused(&Look { ramp: vec![].into(), ..Look::GROOVE }), None);
    }

    #[test]
    fn numbers_out_of_range_are_named() {
        for bad in [-0.1, 17.0, f32::NAN, f32::INFINITY] {
            assert_eq!(refused(&Look { glint: bad, ..Look::GROOVE }), Some("glint"));
            assert_eq!(refused(&Look { uneven_glint: bad, ..Look::GROOVE }), Some("uneven_glint"));
            assert_eq!(refused(&Look { grain: bad, ..Look::GROOVE }), Some("grain"));
            assert_eq!(refused(&Look { shift: bad, ..Look::GROOVE }), Some("shift"));
            assert_eq!(refused(&Look { relief: bad, ..Look::GROOVE }), Some("relief"));
            assert_eq!(refused(&Look { tint: bad, ..Look::GROOVE }), Some("tint"));
            assert_eq!(refused(&Look { gloss: bad, ..Look::GROOVE }), Some("gloss"));
            assert_eq!(refused(&Look { sparkle: bad, ..Look::GROOVE }), Some("sparkle"));
            assert_eq!(refused(&Look { directionality: bad, ..Look::GROOVE }), Some("directionality"));
            assert_eq!(refused(&Look { shadow: bad, ..Look::GROOVE }), Some("shadow"));
            assert_eq!(refused(&Look { cast: bad, ..Look::GROOVE }), Some("cast"));
            assert_eq!(refused(&Look { full_rim: bad, ..Look::GROOVE }), Some("full_rim"));
            assert_eq!(refused(&Look { curl: bad, ..Look::GROOVE }), Some("curl"));
            assert_eq!(refused(&Look { curl_depth: bad, ..Look::GROOVE }), Some("curl_depth"));
            let cel = |cel| refused(&Look { cel: Some(cel), ..Look::GROOVE });
            assert_eq!(cel(Cel { wide: bad, ..Cel::DEFAULT }), Some("cel.wide"));
            assert_eq!(cel(Cel { outline: bad, ..Cel::DEFAULT }), Some("cel.outline"));
            assert_eq!(cel(Cel { wall: bad, ..Cel::DEFAULT }), Some("cel.wall"));
            assert_eq!(cel(Cel { slant: bad, ..Cel::DEFAULT }), Some("cel.slant"));
            assert_eq!(cel(Cel { ink: [bad, 0.0, 0.0], ..Cel::DEFAULT }), Some("cel.ink"));
            assert_eq!(cel(Cel { fill: [0.0, bad, 0.0], ..Cel::DEFAULT }), Some("cel.fill"));
            assert_eq!(cel(Cel { lit: [0.0, 0.0, bad], ..Cel::DEFAULT }), Some("cel.lit"));
            let facets = |facets| refused(&Look { facets: Some(facets), ..Look::GROOVE });
            assert_eq!(facets(Facets { tone: bad, ..Facets::DEFAULT }), Some("facets.tone"));
            assert_eq!(facets(Facets { tilt: bad, ..Facets::DEFAULT }), Some("facets.tilt"));
            assert_eq!(facets(Facets { shift: bad, ..Facets::DEFAULT }), Some("facets.shift"));
            assert_eq!(facets(Facets { reflection: bad, ..Facets::DEFAULT }), Some("facets.reflection"));
            assert_eq!(facets(Facets { bright_share: bad, ..Facets::DEFAULT }), Some("facets.bright_share"));
            assert_eq!(
                facets(Facets { reflection_color: [0.0, 0.0, bad], ..Facets::DEFAULT }),
                Some("facets.reflection_color")
            );
            assert_eq!(facets(Facets { falloff: bad, ..Facets::DEFAULT }), Some("facets.falloff"));
            assert_eq!(facets(Facets { concavity: bad, ..Facets::DEFAULT }), Some("facets.concavity"));
            assert_eq!(facets(Facets { fade: bad, ..Facets::DEFAULT }), Some("facets.fade"));
            assert_eq!(facets(Facets { similarity: bad, ..Facets::DEFAULT }), Some("facets.similarity"));
            assert_eq!(facets(Facets { patch_share: bad, ..Facets::DEFAULT }), Some("facets.patch_share"));
            assert_eq!(facets(Facets { thickness: bad, ..Facets::DEFAULT }), Some("facets.thickness"));
            assert_eq!(facets(Facets { side_color: [0.0, bad, 0.0], ..Facets::DEFAULT }), Some("facets.side_color"));
            let crushed = |crushed| refused(&Look { crushed: Some(crushed), ..Look::GROOVE });
            assert_eq!(crushed(CrushedZone { radius: bad, ..CrushedZone::DEFAULT }), Some("crushed.radius"));
            assert_eq!(crushed(CrushedZone { ragged: bad, ..CrushedZone::DEFAULT }), Some("crushed.ragged"));
            assert_eq!(crushed(CrushedZone { soft: bad, ..CrushedZone::DEFAULT }), Some("crushed.soft"));
            assert_eq!(crushed(CrushedZone { hole: bad, ..CrushedZone::DEFAULT }), Some("crushed.hole"));
            assert_eq!(crushed(CrushedZone { depth: bad, ..CrushedZone::DEFAULT }), Some("crushed.depth"));
            assert_eq!(crushed(CrushedZone { rough: bad, ..CrushedZone::DEFAULT }), Some("crushed.rough"));
            assert_eq!(crushed(CrushedZone { grain: bad, ..CrushedZone::DEFAULT }), Some("crushed.grain"));
            assert_eq!(crushed(CrushedZone { color: [0.0, bad, 0.0], ..CrushedZone::DEFAULT }), Some("crushed.color"));
            assert_eq!(crushed(CrushedZone { pale: bad, ..CrushedZone::DEFAULT }), Some("crushed.pale"));
            assert_eq!(crushed(CrushedZone { speckle: bad, ..CrushedZone::DEFAULT }), Some("crushed.speckle"));
            assert_eq!(crushed(CrushedZone { flake: bad, ..CrushedZone::DEFAULT }), Some("crushed.flake"));
            assert_eq!(crushed(CrushedZone { dust: bad, ..CrushedZone::DEFAULT }), Some("crushed.dust"));
            assert_eq!(crushed(CrushedZone { chips: bad, ..CrushedZone::DEFAULT }), Some("crushed.chips"));
            assert_eq!(crushed(CrushedZone { reach: bad, ..CrushedZone::DEFAULT }), Some("crushed.reach"));
            assert_eq!(crushed(CrushedZone { bare: bad, ..CrushedZone::DEFAULT }), Some("crushed.bare"));
            assert_eq!(crushed(CrushedZone { jag: bad, ..CrushedZone::DEFAULT }), Some("crushed.jag"));
            assert_eq!(crushed(CrushedZone { stones: bad, ..CrushedZone::DEFAULT }), Some("crushed.stones"));
            assert_eq!(crushed(CrushedZone { rim: bad, ..CrushedZone::DEFAULT }), Some("crushed.rim"));
            assert_eq!(crushed(CrushedZone { tint: bad, ..CrushedZone::DEFAULT }), Some("crushed.tint"));
            assert_eq!(crushed(CrushedZone { basin: bad, ..CrushedZone::DEFAULT }), Some("crushed.basin"));
            assert_eq!(crushed(CrushedZone { fall: bad, ..CrushedZone::DEFAULT }), Some("crushed.fall"));
            assert_eq!(crushed(CrushedZone { outline: bad, ..CrushedZone::DEFAULT }), Some("crushed.outline"));
            assert_eq!(crushed(CrushedZone { pit: bad, ..CrushedZone::DEFAULT }), Some("crushed.pit"));
            assert_eq!(crushed(CrushedZone { ticks: 17, ..CrushedZone::DEFAULT }), Some("crushed.ticks"));
            assert_eq!(crushed(CrushedZone { flakes: 17, ..CrushedZone::DEFAULT }), Some("crushed.flakes"));
            assert_eq!(crushed(CrushedZone { needles: bad, ..CrushedZone::DEFAULT }), Some("crushed.needles"));
            assert_eq!(crushed(CrushedZone { crazing: bad, ..CrushedZone::DEFAULT }), Some("crushed.crazing"));
            assert_eq!(crushed(CrushedZone { bubbles: 65, ..CrushedZone::DEFAULT }), Some("crushed.bubbles"));
            assert_eq!(crushed(CrushedZone { edge: bad, ..CrushedZone::DEFAULT }), Some("crushed.edge"));
            let veil = |veil| refused(&Look { veil: Some(veil), ..Look::GROOVE });
            assert_eq!(veil(Veil { reach: bad, ..Veil::DEFAULT }), Some("veil.reach"));
            assert_eq!(veil(Veil { full_width: bad, ..Veil::DEFAULT }), Some("veil.full_width"));
            assert_eq!(veil(Veil { cover: bad, ..Veil::DEFAULT }), Some("veil.cover"));
            assert_eq!(veil(Veil { variation: bad, ..Veil::DEFAULT }), Some("veil.variation"));
            assert_eq!(veil(Veil { bubbles: bad, ..Veil::DEFAULT }), Some("veil.bubbles"));
            assert_eq!(veil(Veil { color: [bad, 0.0, 0.0], ..Veil::DEFAULT }), Some("veil.color"));
            let glow = |stops: &[ColorStop]| refused(&Look { glow: stops.to_vec().into(), ..Look::GROOVE });
            assert_eq!(glow(&[stop(bad, [0.0; 3], 0.0)]), Some("glow.depth"));
            assert_eq!(glow(&[stop(0.5, [bad, 0.0, 0.0], 0.0)]), Some("glow.color"));
            assert_eq!(glow(&[stop(0.5, [0.0; 3], bad)]), Some("glow.cover"));
            let ramp = |stops: &[ColorStop]| refused(&Look { ramp: stops.to_vec().into(), ..Look::GROOVE });
            assert_eq!(ramp(&[stop(bad, [0.0; 3], 0.0)]), Some("ramp.depth"));
            assert_eq!(ramp(&[stop(0.5, [0.0, bad, 0.0], 0.0)]), Some("ramp.color"));
            assert_eq!(ramp(&[stop(0.5, [0.0; 3], bad)]), Some("ramp.cover"));
            assert!(LookTable::new(&Look::GROOVE, bad.min(0.0)).is_err(), "texels per unit {bad}");
        }
        let unordered = vec![stop(0.5, [0.0; 3], 0.0), stop(0.4, [0.0; 3], 0.0)];
        assert_eq!(refused(&Look { ramp: unordered.into(), ..Look::GROOVE }), Some("ramp.depth"));
        assert_eq!(
            refused(&Look { ramp: vec![stop(0.5, [0.0; 3], 0.0); 17].into(), ..Look::GROOVE }),
            Some("ramp.len()")
        );
    }

    #[test]
    fn equal_stops_share_a_ramp_and_others_do_not() {
        let stops = vec![stop(0.3, [0.1, 0.9, 0.2], 0.7), stop(0.9, [0.4, 0.2, 0.3], 1.0)];
        let look = Look { ramp: stops.clone().into(), ..Look::GROOVE };
        let table = |look: &Look| LookTable::new(look, 512.0).unwrap();
        let (first, second) = (table(&look), table(&Look { glint: 0.1, ..look.clone() }));
        assert!(Arc::ptr_eq(&first.ramp, &second.ramp), "not shared");
        let other = table(&Look { ramp: stops[..1].to_vec().into(), ..Look::GROOVE });
        assert_ne!(first.ramp, other.ramp);
        let before = *first.ramp;
        drop((first, second));
        assert_eq!(*table(&look).ramp, before);
        // Many looks at once: those that are not shared are right as well.
        let tables: Vec<_> = (0..2 * MAX_SHARED)
            .map(|i| {
                let stops = vec![stop(0.5, [0.0, 0.0, i as f32 / 255.0], 1.0)];
                (i, table(&Look { ramp: stops.into(), ..Look::GROOVE }))
            })
            .collect();
        for (i, table) in tables {
            assert_eq!(layer(&table, 0x8000)[2], i as f32 / 255.0 * 255.0);
        }
    }

    #[test]
    fn the_ramp_is_linear_between_its_stops() {
        let ramp = vec![stop(0.25, [1.0, 0.0, 0.0], 0.5), stop(0.75, [0.0, 0.0, 1.0], 1.0)];
        let look = Look { ramp: ramp.into(), ..Look::GROOVE };
        let look_at = |depth| at(&look.ramp, depth);
        assert_eq!(look_at(0.125), ([1.0, 0.0, 0.0], 0.25));
        assert_eq!(look_at(0.5), ([0.5, 0.0, 0.5], 0.75));
        assert_eq!(look_at(1.0), ([0.0, 0.0, 1.0], 1.0));
        let table = LookTable::new(&look, 512.0).unwrap();
        assert_eq!(layer(&table, 0), [0.0; 4]);
        assert_eq!(layer(&table, 0x8000), [0.5 * 0.75 * 255.0, 0.0, 0.5 * 0.75 * 255.0, 0.75]);
        // Two stops at one depth are a step, and a first stop at zero covers all but depth zero itself.
        let step = vec![stop(0.0, [1.0; 3], 1.0), stop(0.5, [1.0; 3], 1.0), stop(0.5, [0.0; 3], 1.0)];
        let table = LookTable::new(&Look { ramp: step.into(), ..Look::GROOVE }, 512.0).unwrap();
        assert_eq!(layer(&table, 1)[3], 1.0);
        assert_eq!((layer(&table, 0), layer(&table, 0x8000)[0], layer(&table, 0x7F00)[0]), ([0.0; 4], 0.0, 255.0));
    }
}
