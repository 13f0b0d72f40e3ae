//! [`Plan`]: what a surface will be, before anything of it is made.

use super::active::SurfaceParts;
use super::inputs::{BaseAndMask, Copies, RawBase, RawMask, SurfaceInputs, with_density};
use super::picture_plan::{PicturePlan, ReadPictures, Stretch, plan_pictures};
use crate::CrackPreset;
use crate::paint::LookTable;
use crate::pattern::CrackMask;
use crate::plugin::api::textures::Maps;
use crate::plugin::api::{CrackBudget, CrackError, CrackSurface, CrackTextures};
use crate::plugin::carrier::kind::{Carrier, CarrierKind, Found, Shown};
use crate::plugin::carrier::kinds;
use crate::plugin::gpu::memory::TextureMemory;
use crate::plugin::gpu::textures::{self, TextureKind};
use crate::plugin::source::mask::{MaskFrom, PictureMasks, layer};
use crate::plugin::source::picture::{self, BaseKey, BasePictures, FrameCount};
use crate::plugin::source::preset;
use bevy::prelude::*;
use std::sync::Arc;

/// A surface that has not cracked.
struct Untouched {
    surface: CrackSurface,
    preset: CrackPreset,
    kind: &'static dyn CarrierKind,
    shown: Shown,
}

/// What the entity is made of; `None` if some of it is not there yet.
fn untouched(world: &World, entity: Entity) -> Result<Option<Untouched>, CrackError> {
    // Removed since it was asked for: the hook has dropped its hits, unless they came in between.
    let Some(surface) = world.get::<CrackSurface>(entity).cloned() else { return Err(CrackError::NothingToCrack) };
    if !world.contains_resource::<Assets<Image>>() {
        return Err(CrackError::NoImages);
    }
    let (kind, shown) = match kinds::inspect(world, entity) {
        (Some(kind), Found::Shown(shown)) => (kind, *shown),
        (_, Found::Waiting) => return Ok(None),
        (_, Found::Unusable(error)) => return Err(error),
        _ => return Err(CrackError::NothingToCrack),
    };
    let preset = preset::resolve(world, &surface.preset)?;
    Ok(preset.map(|preset| Untouched { surface, preset, kind, shown }))
}

/// A surface that has not cracked, as it is to be made.
pub(crate) struct Plan {
    pub(crate) surface: CrackSurface,
    pub(crate) preset: CrackPreset,
    kind: &'static dyn CarrierKind,
    pub(crate) shown: Shown,
    pub(crate) pictures: PicturePlan,
    /// Its textures, without texels.
    pub(crate) textures: Option<CrackTextures>,
    /// The frame in which it was made: its pictures are read from then on.
    read_at: u64,
    /// Whether a picture has changed since.
    pub(crate) is_outdated: bool,
}

impl Plan {
    /// `None` if some of what it is made from is not there yet.
    pub(crate) fn new(world: &World, entity: Entity) -> Result<Option<Self>, CrackError> {
        let Some(Untouched { surface, preset, kind, shown }) = untouched(world, entity)? else {
            return Ok(None);
        };
        let aspect = |picture| kind.aspect(world, entity, picture, None);
        let is_twofold = kind.is_twofold(world, entity);
        let unfolding = kind.unfolding(world, entity);
        let stretch = Stretch { aspect: &aspect, kept: None, is_twofold, unfolding };
        let layer = preset.look.layer(0).bytes_per_texel();
        let wanted = Maps::wanted(surface.write, &preset.look);
        let pictures = plan_pictures(world, (&surface, wanted), &shown, &stretch, layer, 0)?;
        let read_at = world.resource::<FrameCount>().0;
        Ok(pictures.map(|pictures| Self {
            surface,
            preset,
            kind,
            shown,
            pictures,
            textures: None,
            read_at,
            is_outdated: false,
        }))
    }

    /// Looks whether the mesh can show its textures.
    pub(crate) fn check_mesh(&self, world: &World, entity: Entity) -> Result<(), CrackError> {
        let has_normals = self.pictures.maps.normal || self.pictures.maps.depth;
        if has_normals { self.kind.check_mesh(world, entity) } else { Ok(()) }
    }

    /// Where its mask comes from.
    pub(crate) fn mask(&self) -> MaskFrom<'_> {
        MaskFrom::new(&self.surface.mask, &self.preset)
    }

    /// What its pictures are read from.
    pub(crate) fn key(&self) -> BaseKey {
        self.pictures.key(&self.shown)
    }

    /// What was read of the picture before this frame has changed; whether some of it may have been read.
    pub(crate) fn forget_picture(&mut self, picture: AssetId<Image>, frame: u64) -> bool {
        let is_past = self.read_at < frame;
        self.is_outdated |= is_past && self.shown.pictures().any(|image| image.id() == picture);
        is_past
    }

    /// Whether the entity still is what it was, but for the part of its pictures that it shows.
    pub(crate) fn is_current(&self, world: &World, entity: Entity) -> bool {
        world.get::<CrackSurface>(entity) == Some(&self.surface)
            && matches!(kinds::inspect(world, entity), (_, Found::Shown(shown)) if shown.is_like(&self.shown))
            && matches!(preset::resolve(world, &self.surface.preset), Ok(Some(preset)) if preset == self.preset)
    }

    /// Whether its textures have room in the budget.
    pub(crate) fn has_room(&self, world: &World) -> bool {
        let left =
            world.resource::<CrackBudget>().max_texture_bytes.saturating_sub(world.resource::<TextureMemory>().used());
        self.pictures.bytes <= left
    }

    /// Makes its textures, without texels, so that the renderer has room for them when they come.
    pub(crate) fn allocate_textures(&mut self, world: &mut World) -> Result<(), CrackError> {
        let mut images = world.get_resource_mut::<Assets<Image>>().ok_or(CrackError::NoImages)?;
        let PicturePlan { size, maps, sampler, .. } = &self.pictures;
        let mut add = |kind: &TextureKind| -> Result<Option<Handle<Image>>, CrackError> {
            if !(kind.is_wanted)(*maps) {
                return Ok(None);
            }
            let UVec2 { x: width, y: height } = *size;
            let image = kind.empty(*size, sampler, maps.mips).ok_or(CrackError::Size { width, height })?;
            Ok(Some(images.add(image)))
        };
        let [diffuse, normal, depth, emissive] = textures::KINDS.each_ref().map(&mut add);
        let (diffuse, normal, depth, emissive) = (diffuse?, normal?, depth?, emissive?);
        self.textures = Some(CrackTextures { diffuse, normal, depth, emissive });
        Ok(())
    }

    /// What has to be read for it, which can be read; `None` if its masks are not there yet.
    pub(crate) fn raw(&self, world: &World, copies: &mut Copies) -> Result<Option<SurfaceInputs>, CrackError> {
        for image in self.mask().images().chain(&self.surface.density) {
            if !picture::is_loaded(world, image)? {
                return Ok(None);
            }
        }
        let base = match world.resource::<BasePictures>().find(self.key()) {
            Some(base) => RawBase::Read(base),
            None => RawBase::Pictures(self.pictures.needed(&self.shown).map(|map| map.map(|map| copies.add(map)))),
        };
        let mask = match (self.mask(), &self.shown.diffuse) {
            (MaskFrom::Picture(part), Some(picture)) => {
                let key = self.pictures.mask_key(picture, part);
                world.resource::<PictureMasks>().find(key).map_or(RawMask::FromPicture(key), RawMask::Made)
            }
            (MaskFrom::Nothing | MaskFrom::Picture(_), _) => RawMask::Made(Arc::default()),
            (MaskFrom::Images(layers), _) => RawMask::Images(layers.map(|image| image.map(|image| copies.add(image)))),
        };
        let density = self.surface.density.as_ref().map(|image| copies.add(image));
        let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
        for image in copies.0.iter().filter_map(|image| images.get(image)) {
            picture::readable_size(image)?;
        }
        Ok(Some(SurfaceInputs { plan: self.pictures.clone(), base, mask, density }))
    }

    /// Takes up what was read for it: others who show the same need not read it again.
    pub(crate) fn ground(
        self,
        world: &mut World,
        read: BaseAndMask,
        look: LookTable,
        textures: CrackTextures,
    ) -> SurfaceParts {
        let key = self.key();
        let Self { surface, preset, kind, shown, pictures, read_at, is_outdated, .. } = self;
        let BaseAndMask { base, mask } = read;
        if !is_outdated {
            world.resource_mut::<BasePictures>().remember(key, &base);
            if let (MaskFrom::Picture(part), Some(picture)) = (MaskFrom::new(&surface.mask, &preset), &shown.diffuse)
                // Others have other densities.
                && surface.density.is_none()
            {
                world.resource_mut::<PictureMasks>().remember(pictures.mask_key(picture, part), &mask);
            }
        }
        let PicturePlan { bytes, rect, maps, unstretched, is_twofold, unfolding, .. } = pictures;
        let carrier = Carrier { is_twofold, unfolding, ..Carrier::new(kind, shown) };
        let bytes = world.resource::<TextureMemory>().count(bytes);
        SurfaceParts {
            surface,
            preset,
            look,
            base,
            textures,
            has_mips: maps.mips,
            carrier,
            bytes,
            rect,
            unstretched,
            read_at,
        }
    }
}

/// The mask of a surface; `None` if it is not there yet.
pub(crate) fn resolve_mask(
    world: &mut World,
    surface: &CrackSurface,
    preset: &CrackPreset,
    shown: &Shown,
    draft: &ReadPictures,
) -> Result<Option<Arc<CrackMask>>, CrackError> {
    let from = MaskFrom::new(&surface.mask, preset);
    for image in from.images().chain(&surface.density) {
        if !picture::is_loaded(world, image)? {
            return Ok(None);
        }
    }
    let mask = match (from, &shown.diffuse) {
        (MaskFrom::Picture(part), Some(picture)) => {
            let has_time = world.resource::<CrackBudget>().is_unlimited();
            let key = draft.plan.mask_key(picture, part);
            world.resource_mut::<PictureMasks>().get(key, &draft.base, has_time)?
        }
        // Without a picture there is nothing to go by.
        (MaskFrom::Nothing | MaskFrom::Picture(_), _) => Some(Arc::default()),
        (MaskFrom::Images(layers), _) => {
            let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
            let layer =
                |image: Option<&Handle<Image>>| image.and_then(|image| images.get(image)).map(layer).transpose();
            let [weak, strong, forbidden] = layers.map(layer);
            Some(Arc::new(CrackMask { weak: weak?, strong: strong?, forbidden: forbidden?, density: None }))
        }
    };
    let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
    let density = surface.density.as_ref().and_then(|image| images.get(image));
    mask.map(|mask| with_density(mask, density)).transpose()
}
