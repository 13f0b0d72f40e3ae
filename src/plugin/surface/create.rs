//! Surfaces are made, and given to their entities.

use super::active::Active;
use super::cracked::{self, active, has_cracked};
use super::inputs::{BaseAndMask, BlankSurface};
use super::picture_plan::ReadPictures;
use super::plan::{Plan, resolve_mask};
use super::queue::with_queue;
use crate::plugin::api::error::EntityLabel;
use crate::plugin::api::textures::MAPS;
use crate::plugin::api::{CrackClock, CrackError, CrackFailed, CrackState, CrackStatus, CrackTextures};
use crate::plugin::gpu::textures::{self, TextureKind};
use crate::plugin::gpu::uploads::Uploads;
use crate::raster::TexelRect;
use bevy::prelude::*;

/// The largest depth of parallax that still looks like depth, in units of the texture.
const MAX_PARALLAX: f32 = 0.1;

pub(crate) fn set_status(world: &mut World, entity: Entity, status: CrackStatus) {
    if let Some(mut state) = world.get_mut::<CrackState>(entity)
        && state.status != status
    {
        state.status = status;
    }
}

/// Refuses the hits of a surface that cannot crack, and says why, once for each cause.
pub(super) fn report_failure(world: &mut World, entity: Entity, error: CrackError) {
    with_queue(world, |_, queue, stats| queue.purge(entity, stats));
    let status = CrackStatus::Failed(error.clone());
    let Some(mut state) = world.get_mut::<CrackState>(entity) else { return };
    if state.status != status {
        state.status = status;
        warn!("{} cannot crack: {error}", EntityLabel::of(world, entity));
        world.trigger(CrackFailed { entity, error });
    }
}

/// Makes growth and textures for a surface that has none; `false` if its pictures are not there yet.
pub(crate) fn make_ready_now(world: &mut World, entity: Entity) -> Result<bool, CrackError> {
    if has_cracked(world, entity) {
        return Ok(true);
    }
    Plan::new(world, entity)?.map_or(Ok(false), |plan| make_now(world, entity, plan))
}

/// Makes growth and textures in this frame; `false` if its mask is not there yet.
pub(crate) fn make_now(world: &mut World, entity: Entity, plan: Plan) -> Result<bool, CrackError> {
    plan.check_mesh(world, entity)?;
    let draft = plan.pictures.clone().draft(world, &plan.shown)?;
    let Some(mask) = resolve_mask(world, &plan.surface, &plan.preset, &plan.shown, &draft)? else { return Ok(false) };
    let read = BaseAndMask { base: draft.base.clone(), mask };
    let BlankSurface { growth, field, look } =
        BlankSurface::new(&plan.surface, &plan.preset, &read, plan.pictures.rect)?;
    let textures = make_textures(world, &draft, None, Default::default())?;
    let ground = plan.ground(world, read, look, textures);
    install(world, entity, Box::new(Active::new(ground, growth, field)));
    Ok(true)
}

/// Puts a surface among those that crack.
pub(crate) fn install(world: &mut World, entity: Entity, mut active: Box<Active>) {
    if let Some(mut clock) = world.get_mut::<CrackClock>(entity) {
        active.follow(clock.bypass_change_detection());
    }
    attach(world, entity, &mut active);
    cracked::insert(world, entity, active);
}

/// Makes the entity show the surface's textures.
pub(crate) fn attach(world: &mut World, entity: Entity, active: &mut Active) {
    let relief = (active.preset.look.relief / active.drawing.field.frame.extent().max_element()).min(MAX_PARALLAX);
    let kind = active.carrier.kind;
    kind.attach(world, entity, &mut active.carrier, &active.canvas.textures, relief);
    if active.drawing.cutouts.is_some() {
        kind.open(world, entity, &active.carrier, true);
    }
}

/// Gives the entity the component that names its textures. Observers and commands that wait run then, and may heal the surface.
pub(crate) fn report_textures(world: &mut World, entity: Entity) {
    let textures = active(world, entity).map(|active| active.canvas.textures.clone());
    if let (Some(textures), Ok(mut entity)) = (textures, world.get_entity_mut(entity)) {
        entity.insert(textures);
    }
}

/// Makes the textures of a surface, into the images of `reuse` if given: of the texels that were `made`, or without cracks.
pub(crate) fn make_textures(
    world: &mut World,
    draft: &ReadPictures,
    reuse: Option<&CrackTextures>,
    made: [Option<Vec<u8>>; MAPS],
) -> Result<CrackTextures, CrackError> {
    world.resource_mut::<Uploads>().expect_whole();
    let mut images = world.get_resource_mut::<Assets<Image>>().ok_or(CrackError::NoImages)?;
    let ReadPictures { base, plan } = draft;
    let mut made = made.into_iter();
    let mut add = |kind: &TextureKind, old: Option<&Option<Handle<Image>>>| -> Result<_, CrackError> {
        let made = made.next().flatten();
        if !(kind.is_wanted)(plan.maps) {
            return Ok(None);
        }
        let UVec2 { x: width, y: height } = base.size;
        let texels = made.unwrap_or_else(|| kind.texels(base, plan.maps.mips));
        let image = kind.image(base.size, texels, &plan.sampler).ok_or(CrackError::Size { width, height })?;
        if let Some(Some(old)) = old
            && let Some(mut place) = images.get_mut(old)
        {
            *place = image;
            return Ok(Some(old.clone()));
        }
        Ok(Some(images.add(image)))
    };
    let made = CrackTextures {
        diffuse: add(&textures::DIFFUSE, reuse.map(|t| &t.diffuse))?,
        normal: add(&textures::NORMAL, reuse.map(|t| &t.normal))?,
        depth: add(&textures::DEPTH, reuse.map(|t| &t.depth))?,
        emissive: add(&textures::EMISSIVE, reuse.map(|t| &t.emissive))?,
    };
    if plan.maps.mips && reuse.is_some() {
        push_mips(&mut world.resource_mut::<Uploads>(), &made, base.size);
    }
    Ok(made)
}

/// Asks for the upload of all mip levels: of an image that has changed, the renderer uploads only the first.
fn push_mips(uploads: &mut Uploads, made: &CrackTextures, size: UVec2) {
    for (texture, kind) in made.all().into_iter().zip(&textures::KINDS) {
        let Some(texture) = texture else { continue };
        for (level, rect) in kind.levels(size).above(&[TexelRect::whole(size)]) {
            uploads.push_level(texture.id(), level, rect);
        }
    }
}
