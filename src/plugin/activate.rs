//! From hits to cracks: a surface gets its growth and textures at its first hit.

use super::{
    CrackBudget, CrackClock, CrackError, CrackFailed, CrackMaps, CrackResolution, CrackState, CrackStats, CrackStatus,
    CrackSurface, CrackTextures, HitPoint,
    budget::FrameClock,
    carrier::{self, Carrier, Found, Kind, Shown, Untouched},
    mask,
    picture::{self, BaseKey, BasePicture, BasePictures, Space},
    queue::{HitQueue, QueuedHit},
    shards::Struck,
    surfaces::{Active, Ground, Surfaces},
    textures::{self, TextureKind},
    upload::Uploads,
};
use crate::{
    CrackPreset,
    growth::{CrackGrowth, HitOutcome},
    paint::LookTable,
    pattern::SurfaceFrame,
    raster::{DepthField, TexelRect},
};
use bevy::{image::ImageSampler, prelude::*, render::renderer::RenderDevice};
use std::sync::Arc;

/// Share of the frame's budget after which no further hit is applied.
const SHARE: f32 = 0.4;

/// Longer side of the textures of a surface without a picture, texels.
const DEFAULT_SIDE: f32 = 512.0;

/// Textures are not made coarser than this to fit the budget, texels.
const MIN_SIDE: u32 = 64;

/// The largest depth of parallax that still looks like depth, in units of the texture.
const MAX_PARALLAX: f32 = 0.1;

/// Applies the hits that wait, in turns, as many as the budget allows.
pub(super) fn apply_hits(world: &mut World) {
    let timer = world.resource::<FrameClock>().start(world.resource::<CrackBudget>(), SHARE);
    world.resource_mut::<HitQueue>().unpark();
    while let Some(entity) = world.resource::<HitQueue>().next() {
        // A hit beside a surface makes nothing for it.
        let ready = if is_missed(world, entity) { Ok(true) } else { make_ready(world, entity) };
        match ready {
            Ok(true) => apply_next(world, entity),
            Ok(false) => {
                set_status(world, entity, CrackStatus::Waiting);
                world.resource_mut::<HitQueue>().park();
            }
            Err(error) => fail(world, entity, error),
        }
        if timer.is_over() {
            break;
        }
    }
    world.resource_mut::<FrameClock>().stop(&timer);
}

/// Applies the first hit of the surface in turn, which is ready.
fn apply_next(world: &mut World, entity: Entity) {
    world.resource_scope(|world, mut queue: Mut<HitQueue>| {
        let mut stats = *world.resource::<CrackStats>();
        if let Some(hit) = queue.take(&mut stats) {
            match apply(world, entity, hit) {
                Ok(HitOutcome::Started(_)) => stats.applied += 1,
                Ok(HitOutcome::Merged(_)) => stats.merged += 1,
                Ok(HitOutcome::Nothing) => stats.ignored += 1,
                Ok(HitOutcome::Rejected(reason)) => queue.reject(entity, &reason.to_string(), &mut stats),
                Err(reason) => queue.reject(entity, reason, &mut stats),
            }
        }
        *world.resource_mut::<CrackStats>() = stats;
    });
    if world.get::<CrackState>(entity).is_some_and(|state| state.status == CrackStatus::Waiting) {
        set_status(world, entity, CrackStatus::Untouched);
    }
}

/// Whether the first hit of a surface without cracks is to be refused for where it lands.
fn is_missed(world: &World, entity: Entity) -> bool {
    if world.resource::<Surfaces>().active.contains_key(&entity) {
        return false;
    }
    let Some(hit) = world.resource::<HitQueue>().first(entity) else { return false };
    let (Some(kind), Found::Shown(shown)) = carrier::inspect(world, entity) else { return false };
    let is_there = shown.pictures().all(|picture| matches!(picture::is_loaded(world, picture), Ok(true)));
    is_there && locate(world, entity, kind, hit.at).is_err()
}

/// Texture coordinates of a hit, within the surface.
fn locate(world: &World, entity: Entity, kind: &Kind, at: HitPoint) -> Result<Vec2, &'static str> {
    let uv = match at {
        HitPoint::Uv(uv) => uv,
        HitPoint::Local(point) | HitPoint::World(point) => (kind.locate)(world, entity, point)?,
    };
    // Not a number is not within either.
    let is_within = uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all();
    is_within.then_some(uv).ok_or("it lies off the surface")
}

fn apply(world: &mut World, entity: Entity, hit: QueuedHit) -> Result<HitOutcome, &'static str> {
    const GONE: &str = "the surface is gone";
    let active = world.resource::<Surfaces>().active.get(&entity);
    let kind = active.map(|active| active.carrier.kind).or_else(|| carrier::inspect(world, entity).0).ok_or(GONE)?;
    let uv = locate(world, entity, kind, hit.at)?;
    let mut surfaces = world.resource_mut::<Surfaces>();
    let active = surfaces.active.get_mut(&entity).ok_or(GONE)?;
    let texel = active.field.frame.to_texel(active.field.frame.uv_to_pos(uv)).max(Vec2::ZERO).as_uvec2();
    if active.broken.as_ref().is_some_and(|broken| broken.holes.contains(texel)) {
        return Err("a shard has left the surface there");
    }
    if active.surface.alpha_mask
        && let Some(view) = active.views.get(active.view)
        && active.base.is_hole(view.rect.min + (uv * view.rect.size().as_vec2()).as_uvec2().min(view.rect.size() - 1))
    {
        return Err("the surface is transparent there");
    }
    let pos = uv * active.growth.network().extent();
    active.freeze_if_full();
    let outcome = active.growth.hit(pos, hit.energy);
    if matches!(outcome, HitOutcome::Started(_) | HitOutcome::Merged(_)) {
        active.struck = Some(Struck { pos, energy: hit.energy, direction: hit.direction });
        active.hits += 1;
        surfaces.start_growing(entity);
        // The nodes it starts with show at once.
        surfaces.soil(entity);
        let turned = surfaces.active.get_mut(&entity).and_then(Active::turn_forwards);
        if let (Some(turned), Some(mut clock)) = (turned, world.get_mut::<CrackClock>(entity)) {
            *clock = turned;
        }
        set_status(world, entity, CrackStatus::Growing);
    }
    Ok(outcome)
}

pub(super) fn set_status(world: &mut World, entity: Entity, status: CrackStatus) {
    if let Some(mut state) = world.get_mut::<CrackState>(entity)
        && state.status != status
    {
        state.status = status;
    }
}

/// Gives up a surface: refuses its hits and says why, once for each cause.
pub(super) fn fail(world: &mut World, entity: Entity, error: CrackError) {
    world.resource_scope(|world, mut queue: Mut<HitQueue>| {
        queue.purge(entity, &mut world.resource_mut::<CrackStats>());
    });
    let status = CrackStatus::Failed(error.clone());
    let Some(mut state) = world.get_mut::<CrackState>(entity) else { return };
    if state.status != status {
        state.status = status;
        warn!("{entity} cannot crack: {error}");
        world.trigger(CrackFailed { entity, error });
    }
}

/// Makes growth and textures for a surface that has none; `false` if its pictures are not there yet.
pub(super) fn make_ready(world: &mut World, entity: Entity) -> Result<bool, CrackError> {
    if world.resource::<Surfaces>().active.contains_key(&entity) {
        return Ok(true);
    }
    let Some(untouched) = carrier::untouched(world, entity)? else { return Ok(false) };
    let Untouched { surface, preset, kind, shown } = untouched;
    let Some(draft) = draft(world, &surface, &shown, 0)? else { return Ok(false) };
    let Some(mask) = mask::resolve(world, &surface, &shown, &draft)? else { return Ok(false) };
    let frame = frame(draft.plan.rect)?;
    let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), surface.seed)
        .map_err(|error| CrackError::Preset { reason: error.to_string() })?;
    let look = look(&preset, frame)?;
    if surface.alpha_mask {
        growth.set_density(draft.base.density(draft.plan.rect));
    }
    let mut field = DepthField::new(frame);
    field.forbid(&mask);
    growth.set_mask(mask);
    let textures = make_textures(world, &draft, None)?;
    let Draft { base, plan: PicturePlan { rect, bytes, .. } } = draft;
    let active = Active::new(
        Ground { surface, preset, look, base, textures, carrier: Carrier::new(kind, shown), bytes, rect },
        growth,
        field,
    );
    install(world, entity, active);
    Ok(true)
}

/// Puts a surface among those that crack.
pub(super) fn install(world: &mut World, entity: Entity, mut active: Active) {
    if let Some(mut clock) = world.get_mut::<CrackClock>(entity) {
        active.follow(clock.bypass_change_detection());
    }
    attach(world, entity, &mut active);
    let mut surfaces = world.resource_mut::<Surfaces>();
    surfaces.bytes += active.bytes;
    surfaces.own(entity, &active);
    surfaces.active.insert(entity, active);
}

/// Makes the entity show the surface's textures.
pub(super) fn attach(world: &mut World, entity: Entity, active: &mut Active) {
    let relief = (active.preset.look.relief / active.field.frame.extent().max_element()).min(MAX_PARALLAX);
    (active.carrier.kind.attach)(world, entity, &mut active.carrier, &active.textures, relief);
    if let Ok(mut entity) = world.get_entity_mut(entity) {
        entity.insert(active.textures.clone());
    }
}

/// The pictures of a surface, ready to be cracked.
pub(super) struct Draft {
    pub(super) base: Arc<BasePicture>,
    pub(super) plan: PicturePlan,
}

/// What the pictures of a surface will be.
#[derive(Clone)]
pub(super) struct PicturePlan {
    pub(super) size: UVec2,
    /// The part of the image that is shown.
    pub(super) rect: TexelRect,
    /// Bytes of the textures and of what belongs to them.
    pub(super) bytes: u64,
    pub(super) sampler: ImageSampler,
    pub(super) maps: CrackMaps,
}

impl PicturePlan {
    /// The pictures, read.
    pub(super) fn read(&self, [diffuse, normal, depth]: [Option<&Image>; 3]) -> Result<BasePicture, CrackError> {
        let n = self.size.x as usize * self.size.y as usize;
        let read =
            |image: Option<&Image>| image.map(|image| picture::read(image, Space::Linear, self.size)).transpose();
        let diffuse = match diffuse {
            Some(image) => picture::read_shown(image, self.size)?,
            None => vec![255; n * 4],
        };
        let normal = if self.maps.normal { read(normal)? } else { None };
        let depth = if self.maps.depth { read(depth)?.map(|rgba| picture::red(&rgba)) } else { None };
        Ok(BasePicture::new(self.size, diffuse, normal, depth))
    }
}

/// Plans the pictures of a surface; `None` if they are not there yet. `owned` bytes of the budget are its own already.
pub(super) fn plan_pictures(
    world: &World,
    surface: &CrackSurface,
    shown: &Shown,
    owned: u64,
) -> Result<Option<PicturePlan>, CrackError> {
    let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
    for picture in shown.pictures() {
        if !picture::is_loaded(world, picture)? {
            return Ok(None);
        }
    }
    let maps = CrackMaps {
        diffuse: surface.write.diffuse && shown.maps.diffuse,
        normal: surface.write.normal && shown.maps.normal,
        depth: surface.write.depth && shown.maps.depth,
    };
    let image = shown.diffuse.as_ref().and_then(|picture| images.get(picture));
    let size = size(world, surface, shown, image, maps, owned)?;
    let whole = TexelRect::whole(size);
    let rect = shown.rect.map_or(whole, |rect| TexelRect { min: rect.min, max: rect.max }.intersect(whole));
    let sampler = image.map_or(ImageSampler::Default, |image| image.sampler.clone());
    Ok(Some(PicturePlan { size, rect, bytes: bytes(size, maps), sampler, maps }))
}

/// Reads the pictures of a surface; `None` if they are not there yet. `owned` as in [`plan_pictures`].
pub(super) fn draft(
    world: &mut World,
    surface: &CrackSurface,
    shown: &Shown,
    owned: u64,
) -> Result<Option<Draft>, CrackError> {
    let Some(plan) = plan_pictures(world, surface, shown, owned)? else { return Ok(None) };
    let maps = [(&shown.diffuse, true), (&shown.normal, plan.maps.normal), (&shown.depth, plan.maps.depth)];
    let maps = maps.map(|(map, is_needed)| map.as_ref().filter(|_| is_needed));
    let key = BaseKey { pictures: maps.map(|map| map.map(Handle::id)), size: plan.size };
    let base = world.resource_scope(|world, mut bases: Mut<BasePictures>| {
        let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
        bases.get(key, || plan.read(maps.map(|map| map.and_then(|picture| images.get(picture)))))
    })?;
    Ok(Some(Draft { base, plan }))
}

/// Bytes of the textures on the CPU and the GPU, the base picture, as if no other surface had the same, and the depth field.
fn bytes(size: UVec2, maps: CrackMaps) -> u64 {
    let texel = 4 + 2 + 8 * u64::from(maps.diffuse) + 8 * u64::from(maps.normal) + 2 * u64::from(maps.depth);
    u64::from(size.x) * u64::from(size.y) * texel
}

/// Size of the textures: what is asked for, made smaller until it fits device and budget.
fn size(
    world: &World,
    surface: &CrackSurface,
    shown: &Shown,
    image: Option<&Image>,
    maps: CrackMaps,
    owned: u64,
) -> Result<UVec2, CrackError> {
    let own_size = match image {
        Some(image) => picture::readable_size(image)?,
        None => {
            let proportions = shown.proportions.abs();
            let size = proportions * (DEFAULT_SIDE / proportions.max_element());
            if size.is_finite() { size.as_uvec2().max(UVec2::ONE) } else { UVec2::splat(512) }
        }
    };
    let mut size = match surface.resolution {
        CrackResolution::Fixed(size) if shown.rect.is_none() => size,
        _ => own_size,
    };
    if size.min_element() == 0 {
        return Err(CrackError::Size { width: size.x, height: size.y });
    }
    let budget = world.resource::<CrackBudget>();
    let device = world.get_resource::<RenderDevice>().map_or(u32::MAX, |d| d.limits().max_texture_dimension_2d);
    let max_side = budget.max_side.clamp(1, device.clamp(1, crate::pattern::MAX_SIDE));
    if size.max_element() > max_side {
        if shown.rect.is_some() {
            return Err(CrackError::Size { width: size.x, height: size.y });
        }
        let scale = f64::from(max_side) / f64::from(size.max_element());
        size = (size.as_dvec2() * scale).as_uvec2().clamp(UVec2::ONE, UVec2::splat(max_side));
    }
    let left = budget.max_texture_bytes.saturating_sub(world.resource::<Surfaces>().bytes.saturating_sub(owned));
    while bytes(size, maps) > left {
        if shown.rect.is_some() || size.max_element() <= MIN_SIDE {
            return Err(CrackError::TextureBudget { needed: bytes(size, maps), left });
        }
        size = (size / 2).max(UVec2::ONE);
    }
    Ok(size)
}

/// Where the cracks of a surface lie that shows `rect`.
pub(super) fn frame(rect: TexelRect) -> Result<SurfaceFrame, CrackError> {
    SurfaceFrame::new(rect.size()).map_err(|error| CrackError::Size { width: error.width, height: error.height })
}

/// The look of a surface, ready to paint with.
pub(super) fn look(preset: &CrackPreset, frame: SurfaceFrame) -> Result<LookTable, CrackError> {
    LookTable::new(&preset.look, frame.texels_per_unit())
        .map_err(|error| CrackError::Preset { reason: error.to_string() })
}

/// Makes the textures of a surface, into the images of `reuse` if given.
pub(super) fn make_textures(
    world: &mut World,
    draft: &Draft,
    reuse: Option<&CrackTextures>,
) -> Result<CrackTextures, CrackError> {
    world.resource_mut::<Uploads>().expect_whole();
    let mut images = world.get_resource_mut::<Assets<Image>>().ok_or(CrackError::NoImages)?;
    let Draft { base, plan } = draft;
    let mut add = |kind: &TextureKind, old: Option<&Option<Handle<Image>>>| -> Result<_, CrackError> {
        if !(kind.is_wanted)(plan.maps) {
            return Ok(None);
        }
        let UVec2 { x: width, y: height } = base.size;
        let image =
            kind.image(base.size, (kind.texels)(base), &plan.sampler).ok_or(CrackError::Size { width, height })?;
        if let Some(Some(old)) = old
            && let Some(mut place) = images.get_mut(old)
        {
            *place = image;
            return Ok(Some(old.clone()));
        }
        Ok(Some(images.add(image)))
    };
    Ok(CrackTextures {
        diffuse: add(&textures::DIFFUSE, reuse.map(|t| &t.diffuse))?,
        normal: add(&textures::NORMAL, reuse.map(|t| &t.normal))?,
        depth: add(&textures::DEPTH, reuse.map(|t| &t.depth))?,
    })
}
