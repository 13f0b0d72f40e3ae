//! [`CrackAnalogy`]: cracks that look like those of a photograph.

use super::CrackError;
use crate::{
    Grid,
    paint::analogy::{AnalogyError, AnalogyPair, AnalogyParams, Examples},
    raster::TexelRect,
};
use bevy::{prelude::*, reflect::serde::ReflectSerializeWithRegistry};
use std::{
    any::Any,
    sync::{Arc, Mutex, PoisonError, Weak},
};

/// Shows the cracks of a [`CrackSurface`](super::CrackSurface) as those of a photograph, by an image analogy
/// ([`paint::analogy`](crate::paint::analogy); Hertzmann et al. 2001, Mould 2005, section 5.1).
///
/// Adding it prepares the surface, as [`prepare_cracks`](crate::plugin::CrackCommandsExt::prepare_cracks) does, and makes its picture
/// anew in a background task; [`AnalogyProgress`] tells how far it is. It ends with one of [`AnalogyMade`] and [`AnalogyFailed`],
/// unless the surface cannot crack, which says so with [`CrackFailed`](super::CrackFailed), or it is cancelled: by another change (the last one wins), by healing, or by removing the component or the entity. Cracks that
/// grow later are shown in the look of their preset at once, and as those of the photograph when a task has made the texels around
/// them, some frames later; all other texels stay as they are. Where cracks close or time runs backwards, it is the same.
///
/// Crushed zones, plates and veils are painted over it by the preset. Normals come from the photographs if all of them have
/// normals, else from the cracks, as without it. Cracks themselves are the same with and without it; which texels are copied depends on
/// when tasks are done, and so may differ from run to run. Removing it shows the look of the preset again, healing the untouched picture.
///
/// A surface takes about 40 bytes more for each texel. It must show one part of its picture: a sprite whose atlas frame changes fails.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// fn setup(mut commands: Commands, assets: Res<AssetServer>) {
///     let wall = Sprite::from_image(assets.load("textures/concrete.png"));
///     let analogy = CrackAnalogy::new(assets.load("analogies/concrete.analogy.ron"));
///     commands.spawn((wall, CrackSurface::new(CrackPreset::CONCRETE), analogy));
/// }
///
/// fn bar(analogies: Query<&AnalogyProgress, Changed<AnalogyProgress>>) {
///     for AnalogyProgress(share) in &analogies {
///         info!("{:.0} % done", 100.0 * share);
///     }
/// }
///
/// fn made(made: On<AnalogyMade>, mut commands: Commands) {
///     commands.entity(made.entity).insert(Visibility::Visible);
/// }
///
/// fn failed(failed: On<AnalogyFailed>) {
///     warn!("{} keeps its look: {}", failed.entity, failed.error);
/// }
///
/// // All of the wall in the material of the photographs.
/// let analogy = CrackAnalogy::new(Handle::default()).with_their_material().with_seed(3);
/// assert!(!analogy.keeps_picture);
/// # bevy::ecs::system::assert_is_system(setup);
/// # bevy::ecs::system::assert_is_system(bar);
/// # let mut world = World::new();
/// # world.add_observer(made);
/// # world.add_observer(failed);
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default, Clone, Debug, PartialEq, SerializeWithRegistry)]
#[require(AnalogyProgress)]
pub struct CrackAnalogy {
    /// The photographs and where their cracks are, for instance a file `*.analogy.ron`. When it changes, the surface is made anew.
    pub examples: Handle<AnalogyExamples>,
    /// Whether the surface keeps its own picture away from its cracks, texel for texel. If false it takes the material of
    /// the photographs everywhere. Default true.
    pub keeps_picture: bool,
    /// Seed of the search. Default 0.
    pub seed: u64,
}

impl CrackAnalogy {
    /// Cracks like those of these photographs, on the surface's own picture.
    #[must_use]
    pub const fn new(examples: Handle<AnalogyExamples>) -> Self {
        Self { examples, keeps_picture: true, seed: 0 }
    }

    /// The same with the material of the photographs in place of the surface's own picture.
    #[must_use]
    pub const fn with_their_material(mut self) -> Self {
        self.keeps_picture = false;
        self
    }

    /// The same with another seed.
    #[must_use]
    pub const fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }
}

impl Default for CrackAnalogy {
    fn default() -> Self {
        Self::new(Handle::default())
    }
}

/// Photographs of cracked materials with guides that tell where their cracks are: what a [`CrackAnalogy`] copies from.
///
/// As an asset it is a file `*.analogy.ron` beside its pictures, which are PNG files of up to 8192 texels a side, with paths
/// relative to it:
///
/// ```ron
/// (
///     pairs: [
///         // White where there is a crack. Without `mask` the lines that stand out from the photograph count as its cracks;
///         // with `darkness: 0.3` all that is darker than that, 0..=1.
///         (photo: "wall.png", mask: "wall_mask.png"),
///         // With normals of the photograph, which can be repeated without seams, and without slow changes of light over more than
///         // 64 texels or so (4..=512).
///         (photo: "plaster.png", normal: "plaster_normal.png", is_tileable: true, flatten: 64),
///     ],
///     // Parameters that are not the default, see `AnalogyParams`.
///     params: (reach: 16),
/// )
/// ```
///
/// Normals are used if all photographs have them. A file that cannot be read, or has a picture that cannot, is one error in the
/// log and an [`AnalogyFailed`] for each surface that asks for it.
#[derive(Asset, Reflect, Clone, Debug)]
#[type_path = "bevy_crack"]
#[reflect(opaque, Clone, Debug)]
pub struct AnalogyExamples(pub(crate) Arc<ExampleSet>);

/// What is shared by all surfaces that copy from the same photographs.
#[derive(Debug)]
pub(crate) struct ExampleSet {
    pub(crate) pairs: Vec<AnalogyPair>,
    pub(crate) examples: Arc<Examples>,
    /// RGBA8, linear, +Y up, one for each pair; empty = none.
    pub(crate) normals: Vec<Grid<[u8; 4]>>,
    with_pictures: Mutex<Vec<WithPicture>>,
}

/// Examples with a part of a surface's own picture as the first pair.
#[derive(Debug)]
struct WithPicture {
    picture: Weak<dyn Any + Send + Sync>,
    rect: TexelRect,
    examples: Weak<Examples>,
}

impl ExampleSet {
    /// These, with a part of a surface's own picture, which has no crack, as the first pair. Surfaces that show the same share them.
    pub(crate) fn with_picture(
        &self,
        picture: &Arc<dyn Any + Send + Sync>,
        rect: TexelRect,
        read: impl FnOnce() -> Vec<u8>,
    ) -> Result<Arc<Examples>, AnalogyError> {
        let mut known = self.with_pictures.lock().unwrap_or_else(PoisonError::into_inner);
        known.retain(|other| other.examples.strong_count() > 0);
        let is_same = |other: &&WithPicture| {
            other.rect == rect && other.picture.upgrade().is_some_and(|other| Arc::ptr_eq(&other, picture))
        };
        if let Some(examples) = known.iter().find(is_same).and_then(|other| other.examples.upgrade()) {
            return Ok(examples);
        }
        let own = AnalogyPair::new(rect.size(), &read(), Grid::new(rect.size(), 0.0))?;
        let pairs: Vec<_> = [own].into_iter().chain(self.pairs.iter().cloned()).collect();
        let examples = Arc::new(Examples::new(&pairs, self.examples.params())?);
        known.push(WithPicture { picture: Arc::downgrade(picture), rect, examples: Arc::downgrade(&examples) });
        Ok(examples)
    }
}

impl AnalogyExamples {
    /// The extension of their files, without the first dot.
    pub const EXTENSION: &str = "analogy.ron";

    /// Pairs of guide and photograph, and how they are copied. Takes about 40 ns for each of their texels.
    ///
    /// # Errors
    /// Those of [`Examples::new`].
    ///
    /// ```
    /// use bevy_crack::{Grid, paint::analogy::{AnalogyPair, AnalogyParams}, plugin::AnalogyExamples};
    ///
    /// let photo: Vec<u8> = (0..1024).flat_map(|i| if i % 32 == 12 { [20, 20, 20, 255] } else { [200, 200, 200, 255] }).collect();
    /// let pair = AnalogyPair::from_darkness([32, 32].into(), &photo, 0.2)?;
    /// let examples = AnalogyExamples::new(vec![pair], &AnalogyParams::DEFAULT)?;
    /// assert_eq!((examples.pairs().len(), examples.params()), (1, &AnalogyParams::DEFAULT));
    /// // With the normals of the photograph, which is even here.
    /// let even = Grid::new([32, 32].into(), [128, 128, 255, 255]);
    /// let examples = examples.with_normals(vec![even])?;
    /// assert!(examples.with_normals(vec![]).is_err());
    /// # Ok::<(), bevy_crack::paint::analogy::AnalogyError>(())
    /// ```
    pub fn new(pairs: Vec<AnalogyPair>, params: &AnalogyParams) -> Result<Self, AnalogyError> {
        let examples = Arc::new(Examples::new(&pairs, params)?);
        Ok(Self(Arc::new(ExampleSet { pairs, examples, normals: Vec::new(), with_pictures: Mutex::default() })))
    }

    /// The same with normals of the photographs: RGBA8, linear, +Y up.
    ///
    /// # Errors
    /// [`AnalogyError`] if there is not one map for each pair, or one has another size than its photograph.
    pub fn with_normals(self, normals: Vec<Grid<[u8; 4]>>) -> Result<Self, AnalogyError> {
        let (count, expected) = (normals.len(), self.0.pairs.len());
        if count != expected {
            return Err(AnalogyError::MapCount { count, expected });
        }
        for (normal, pair) in normals.iter().zip(&self.0.pairs) {
            let (is, must) = (normal.size(), pair.size());
            if is != must {
                let (width, height, expected_width, expected_height) = (is.x, is.y, must.x, must.y);
                return Err(AnalogyError::SizesDiffer {
                    name: "normal",
                    width,
                    height,
                    expected_width,
                    expected_height,
                });
            }
        }
        let (pairs, examples) = (self.0.pairs.clone(), self.0.examples.clone());
        Ok(Self(Arc::new(ExampleSet { pairs, examples, normals, with_pictures: Mutex::default() })))
    }

    /// The pairs of guide and photograph.
    #[must_use]
    pub fn pairs(&self) -> &[AnalogyPair] {
        &self.0.pairs
    }

    /// The parameters.
    #[must_use]
    pub fn params(&self) -> &AnalogyParams {
        self.0.examples.params()
    }
}

impl From<AnalogyError> for CrackError {
    fn from(error: AnalogyError) -> Self {
        Self::Analogy { reason: error.to_string() }
    }
}

/// How far the first picture of a [`CrackAnalogy`] is, 0..=1: 1 when it is shown. Falls only when it is made anew, or to 0 when it is
/// cancelled. Written by the crate.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default)]
#[component(clone_behavior = Ignore)]
pub struct AnalogyProgress(pub f32);

/// A surface with a [`CrackAnalogy`] shows its first picture, with all cracks that it had when that was begun.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Event, Default)]
pub struct AnalogyMade {
    /// The surface.
    pub entity: Entity,
}

/// The picture of a [`CrackAnalogy`] could not be made; the surface shows the look of its preset.
#[derive(EntityEvent, Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Event, Default)]
pub struct AnalogyFailed {
    /// The surface.
    pub entity: Entity,
    /// Why.
    pub error: CrackError,
}
