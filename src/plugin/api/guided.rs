//! [`GuidedCracks`]: cracks that draw a picture, baked by a background task.

use super::CrackError;
use crate::Grid;
use crate::voronoi::{SiteLayout, VoronoiError, VoronoiParams};
use bevy::{prelude::*, reflect::serde::ReflectSerializeWithRegistry};
use std::sync::Arc;

/// Cracks the surface all over, so that its cracks draw pictures or words.
///
/// Put it beside a [`CrackSurface`](super::CrackSurface). Adding it, or changing it, starts a *bake*: a map of the whole surface
/// ([`voronoi`](crate::voronoi)), made on the [`AsyncComputeTaskPool`](bevy::tasks::AsyncComputeTaskPool), or in slices inside the
/// [`CrackBudget`](super::CrackBudget) where there are no threads. [`BakeProgress`] tells how far it is. It ends with exactly one of
/// [`CrackBaked`] and [`CrackFailed`](super::CrackFailed), unless it is cancelled: by another change (the last one wins), by
/// removing the component or the entity, or by healing.
///
/// The cracks take the place of those of an earlier bake. To hits they are older cracks: new ones start from them and, where the preset has
/// [`arrest`](crate::growth::GrowthParams::arrest), stop at them. Cracks that hits made before are grown again around them, from the same places.
///
/// On a 3D mesh that is [laid out](super::CrackUnwrap) they run over all of the body (Mould 2005, section 8): regions and fronts go on where it is
/// cut to lie flat, and guides lie where the mesh shows their part of its picture. On a [`CrackGroup`](super::CrackGroup) of meshes that picture is
/// the one in which its members are laid out.
///
/// A guide is a picture, dark strokes on light or the other way round, or a text ([`CrackGuide::text`]).
/// A [`CrackClock`](super::CrackClock) moves them as it moves all cracks. A changed picture keeps them, stretched if its
/// proportions are others; removing the component keeps them too. Healing takes them away, for good until the component is changed.
///
/// ```
/// use bevy::{prelude::*, reflect::serde::ReflectSerializeWithRegistry};
/// use bevy_crack::prelude::*;
///
/// fn setup(mut commands: Commands, assets: Res<AssetServer>) {
///     commands.spawn((
///         Sprite::from_image(assets.load("textures/concrete_fine.png")),
///         CrackSurface::new(CrackPreset::CONCRETE),
///         GuidedCracks::new(CrackGuide::new(assets.load("sign.png")))
///             .with_appearance(GuidedAppearance::Front { from: Vec2::splat(0.5), seconds: 2.0 }),
///     ));
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
#[require(BakeProgress)]
pub struct GuidedCracks {
    /// The pictures that the cracks follow, at most 64; none (default) = cracks of plain mud or pavement.
    pub guides: Vec<CrackGuide>,
    /// Sites, their layout, levels, noise and widths. Default: [`VoronoiParams::DEFAULT`]; [`new`](Self::new) lays out sites in pairs.
    ///
    /// On a body that is laid out, places of the layout of sites are those of its picture, the shorter side being 1. Lengths are those of the
    /// body: a unit is the side of a cube with as much surface.
    pub params: VoronoiParams,
    /// Seed of the sites and the noise. Default 0.
    pub seed: u64,
    /// How the cracks come when the bake is done. Default: at once.
    pub appearance: GuidedAppearance,
    /// Longer side of the map, texels; 0 counts as 1; default 1024. The map has the surface's own size (that of its layout) if that is smaller; its
    /// cracks are lines, as sharp as the surface's textures in any case. A map takes some 12 bytes a texel.
    pub max_side: u32,
}

impl GuidedCracks {
    /// Cracks that follow one guide, with sites on both sides of its strokes, which come at once.
    #[must_use]
    pub fn new(guide: CrackGuide) -> Self {
        let params = VoronoiParams { layout: SiteLayout::StrokePairs, ..VoronoiParams::DEFAULT };
        Self { guides: vec![guide], params, ..Self::default() }
    }

    /// The same with another seed.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// The same, coming in another way.
    #[must_use]
    pub fn with_appearance(mut self, appearance: GuidedAppearance) -> Self {
        self.appearance = appearance;
        self
    }
}

/// The most guides of a surface: a map takes 2 bytes a texel for each.
const MAX_GUIDES: usize = 64;

/// A front begins no further from a surface, texture coordinates.
const FURTHEST: f32 = 64.0;

/// Cracks take no longer to appear, seconds.
const LONGEST: f32 = 1e6;

impl GuidedCracks {
    /// Checks every number that is not read from a picture.
    ///
    /// # Errors
    /// [`CrackError::OutOfRange`] for the first that is out of its range or not finite.
    pub fn validate(&self) -> Result<(), CrackError> {
        let (from, seconds) = match self.appearance {
            GuidedAppearance::AtOnce => (Vec2::ZERO, 0.0),
            GuidedAppearance::Front { from, seconds } => (from, seconds),
            GuidedAppearance::Widen { seconds }
            | GuidedAppearance::Emerge { seconds }
            | GuidedAppearance::Morph { seconds } => (Vec2::ZERO, seconds),
        };
        let least_guides = if matches!(self.appearance, GuidedAppearance::Morph { .. }) { 2.0 } else { 0.0 };
        for (field, value, min, max) in [
            ("guides", self.guides.len() as f32, least_guides, MAX_GUIDES as f32),
            ("appearance.from", from.x, -FURTHEST, FURTHEST),
            ("appearance.from", from.y, -FURTHEST, FURTHEST),
            // Not a number and what is below zero mean at once.
            ("appearance.seconds", seconds.max(0.0), 0.0, LONGEST),
        ] {
            if !(min..=max).contains(&value) {
                return Err(CrackError::OutOfRange { field: field.to_owned(), value, min, max });
            }
        }
        let outcome = self.params.validate_with(self.guides.iter().map(|guide| guide.gamma));
        outcome.map_err(|error| match error {
            VoronoiError::OutOfRange { field: "gamma", value, min, max } => {
                CrackError::OutOfRange { field: "guides.gamma".to_owned(), value, min, max }
            }
            VoronoiError::OutOfRange { field, value, min, max } => {
                CrackError::OutOfRange { field: format!("params.{field}"), value, min, max }
            }
            error => CrackError::Bake { reason: error.to_string() },
        })
    }
}

impl Default for GuidedCracks {
    fn default() -> Self {
        Self {
            guides: Vec::new(),
            params: VoronoiParams::DEFAULT,
            seed: 0,
            appearance: GuidedAppearance::AtOnce,
            max_side: 1024,
        }
    }
}

/// One picture that cracks follow.
///
/// ```
/// use bevy_crack::{Grid, plugin::{CrackGuide, GuideSource, GuidedCracks}};
///
/// // A picture of one's own, and more faintly what the surface shows anyway.
/// let mut cross = Grid::new([9, 9].into(), 0.0);
/// cross.row_mut(4).fill(1.0);
/// (0..9).for_each(|y| cross.row_mut(y)[4] = 1.0);
/// let guides = vec![CrackGuide::new(cross), CrackGuide::own_edges().with_gamma(8.0)];
/// assert!(matches!(guides[0].source, GuideSource::Grid(_)));
/// assert_eq!((guides[1].source.clone(), guides[1].gamma), (GuideSource::OwnEdges, 8.0));
/// assert!(GuidedCracks { guides, ..GuidedCracks::default() }.with_seed(3).validate().is_ok());
/// ```
#[derive(Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Clone, Debug, PartialEq)]
pub struct CrackGuide {
    /// Where it comes from. It is stretched over the shown part of the surface's picture.
    pub source: GuideSource,
    /// Its weight, see [`Guide::gamma`](crate::voronoi::Guide::gamma); default 28.
    pub gamma: f32,
}

impl CrackGuide {
    /// A guide (an image, a grid, the bytes of a PNG file) with the paper's weight.
    #[must_use]
    pub fn new(source: impl Into<GuideSource>) -> Self {
        Self { source: source.into(), gamma: 28.0 }
    }

    /// A word or lines of text, in the font that ships with the crate.
    ///
    /// ```
    /// use bevy_crack::prelude::*;
    ///
    /// let sign = GuidedCracks::new(CrackGuide::text("KEEP\nOUT"));
    /// assert!(sign.validate().is_ok());
    /// ```
    #[must_use]
    pub fn text(text: impl Into<String>) -> Self {
        Self::new(GuideSource::Text { text: text.into(), font: None })
    }

    /// The edges of the surface's own picture.
    #[must_use]
    pub fn own_edges() -> Self {
        Self::new(GuideSource::OwnEdges)
    }

    /// The same with another weight.
    #[must_use]
    pub const fn with_gamma(mut self, gamma: f32) -> Self {
        self.gamma = gamma;
        self
    }
}

/// Where a guide comes from.
#[derive(Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Clone, Debug, PartialEq, SerializeWithRegistry)]
pub enum GuideSource {
    /// The drawing in an image, see [`ink`](crate::voronoi::ink): at most 8192 texels a side, readable on the CPU. The bake
    /// waits until it is loaded; later changes of it have no effect.
    ///
    /// The engine loads image files without limits. Files of unknown origin go in as [`Png`](Self::Png).
    Image(Handle<Image>),
    /// Values 0..=1, say a word drawn by a font; see [`Guide::image`](crate::voronoi::Guide::image).
    Grid(Arc<Grid<f32>>),
    /// The drawing in a PNG file, which may come from anywhere: more than 8192 texels a side or 256 MiB are refused by its
    /// header. Needs the engine's `png` feature.
    Png(Arc<[u8]>),
    /// Lines of text, as large as they fit on the surface's picture with a margin of 6 %; see [`draw_text`](crate::voronoi::draw_text).
    Text {
        /// The lines.
        text: String,
        /// The content of a TTF or OTF file; default [`FONT`](crate::voronoi::FONT).
        font: Option<Arc<[u8]>>,
    },
    /// The edges of the surface's own picture, its transparency included, see [`edges`](crate::voronoi::edges).
    OwnEdges,
}

impl From<Handle<Image>> for GuideSource {
    fn from(image: Handle<Image>) -> Self {
        Self::Image(image)
    }
}

impl From<Grid<f32>> for GuideSource {
    fn from(grid: Grid<f32>) -> Self {
        Self::Grid(Arc::new(grid))
    }
}

impl From<Arc<[u8]>> for GuideSource {
    fn from(file: Arc<[u8]>) -> Self {
        Self::Png(file)
    }
}

/// How baked cracks come. Under a [`CrackClock`](super::CrackClock), which rules then, in the same order; on a surface that has been hit
/// before, at once.
///
/// A frame does not draw them: what the surface is to show is drawn and painted by a background task, and a frame applies it when it is
/// ready, one later at the earliest. So what is shown lags a little behind; [`CrackState::time`](super::CrackState::time)
/// is what it shows, and when time stands still, or has come to its end, that is exactly the picture of that time. While cracks move, this
/// takes some 8 bytes a texel more. Where there are no threads it is done in slices inside the [`CrackBudget`](super::CrackBudget);
/// with a budget of a second or more, in the frame itself.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Clone, Debug, Default, PartialEq)]
pub enum GuidedAppearance {
    /// All at once.
    #[default]
    AtOnce,
    /// They run outward along their seams.
    Front {
        /// The point from which, texture coordinates in the surface's picture or sprite frame, 0..=1, v down; from beside it no further
        /// than -64..=64.
        from: Vec2,
        /// Until all are there, up to 1e6. Not a number, zero or below: at once.
        seconds: f32,
    },
    /// They open from hair cracks to their widths.
    Widen {
        /// Until all are open, up to 1e6. Not a number, zero or below: at once.
        seconds: f32,
    },
    /// The picture emerges from plain cracks: the weights of the guides rise from zero to [`CrackGuide::gamma`] (Mould 2005, section 6.1).
    ///
    /// While cracks move, each picture of the surface is drawn as a whole, and the map is kept: some 12 bytes a texel of it more. Where
    /// there are no threads, moving the cracks is one slice. Once shards have left the surface, its cracks open as with
    /// [`Widen`](Self::Widen).
    Emerge {
        /// Until the picture is there, up to 1e6. Not a number, zero or below: at once.
        seconds: f32,
    },
    /// The first guide turns into the second (Mould 2005, eq. 4); further guides keep their weights. The cracks that stay are those of the
    /// second one. What is said of [`Emerge`](Self::Emerge) holds here as well.
    Morph {
        /// Until the second guide is there, up to 1e6. Not a number, zero or below: at once.
        seconds: f32,
    },
}

impl GuidedAppearance {
    /// The time that it takes, seconds; `None` = at once.
    ///
    /// ```
    /// use bevy_crack::plugin::GuidedAppearance;
    ///
    /// assert_eq!(GuidedAppearance::Widen { seconds: 3.0 }.seconds(), Some(3.0));
    /// assert_eq!(GuidedAppearance::Widen { seconds: -1.0 }.seconds(), None);
    /// assert_eq!(GuidedAppearance::AtOnce.seconds(), None);
    /// ```
    #[must_use]
    pub fn seconds(&self) -> Option<f32> {
        match *self {
            Self::AtOnce => None,
            Self::Front { seconds, .. }
            | Self::Widen { seconds }
            | Self::Emerge { seconds }
            | Self::Morph { seconds } => Some(seconds),
        }
        .filter(|seconds| *seconds > 0.0)
    }

    /// The point from which cracks run.
    pub(crate) const fn front(&self) -> Option<Vec2> {
        if let Self::Front { from, .. } = *self { Some(from) } else { None }
    }
}

/// How far the bake of a [`GuidedCracks`] is: 0 while its pictures load, 1 when its cracks are on the surface, and as long as they are,
/// without the component as well. Falls only when a new bake begins, or to 0 when one is cancelled or the surface is healed. Written by the
/// crate.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// fn bar(bakes: Query<&BakeProgress, Changed<BakeProgress>>) {
///     for BakeProgress(share) in &bakes {
///         info!("{:.0} % done", 100.0 * share);
///     }
/// }
///
/// fn baked(baked: On<CrackBaked>) {
///     if let Some(share) = baked.covered {
///         info!("{:.0} % of the strokes have become cracks", 100.0 * share);
///     }
/// }
/// # bevy::ecs::system::assert_is_system(bar);
/// # World::new().add_observer(baked);
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default)]
#[component(clone_behavior = Ignore)]
pub struct BakeProgress(pub f32);

/// The cracks of a [`GuidedCracks`] are made and on the surface; [`CrackFinished`](super::CrackFinished) tells when all of them are shown.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Event, Default)]
pub struct CrackBaked {
    /// The surface.
    pub entity: Entity,
    /// The share of the length of the guides' strokes that has a crack within the stroke, 0..=1; `None` unless sites were to lie
    /// [in pairs](SiteLayout::StrokePairs) and there are strokes.
    pub covered: Option<f32>,
}
