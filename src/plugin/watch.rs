//! Changes from outside: other presets, other pictures, another frame of an animation.

use super::{
    CrackError, CrackState, CrackStatus, CrackSurface, CrackTextures,
    activate::{attach, fail, frame, look, make_textures, set_status, tell_textures},
    bake::Bakes,
    carrier::{self, Carrier, Found, Kind, Shown},
    error::Called,
    later::hold,
    mask::{self, PictureMasks},
    paint::stamp_anew,
    picture::BasePictures,
    plan::draft,
    prepare::Preparations,
    preset,
    shards::drop_shards,
    surfaces::{Active, Added, Surfaces},
};
use crate::{
    CrackPreset, Grid,
    growth::CrackGrowth,
    pattern::{CellTracker, CrackMask, SurfaceFrame},
    raster::{DepthField, TexelRect},
};
use bevy::prelude::*;
use std::sync::Arc;

/// Notes the cracked surfaces whose settings have changed.
pub(super) fn watch_surfaces(
    changed: Query<Entity, (Changed<CrackSurface>, With<CrackTextures>)>,
    mut surfaces: ResMut<Surfaces>,
) {
    surfaces.changed.extend(&changed);
}

/// Notes the cracked surfaces whose sprite or material slot has changed.
#[cfg(any(feature = "2d", feature = "3d"))]
pub(super) fn watch<C: Component>(
    changed: Query<Entity, (Changed<C>, With<CrackTextures>)>,
    mut surfaces: ResMut<Surfaces>,
) {
    surfaces.changed.extend(&changed);
}

/// Notes the cracked surfaces whose original pictures have changed.
pub(super) fn watch_pictures(
    events: Option<MessageReader<AssetEvent<Image>>>,
    mut surfaces: ResMut<Surfaces>,
    mut masks: ResMut<PictureMasks>,
    mut bases: ResMut<BasePictures>,
    mut bakes: ResMut<Bakes>,
    mut preparations: ResMut<Preparations>,
) {
    let Surfaces { active, changed, sources, frame, .. } = &mut *surfaces;
    *frame += 1;
    let Some(mut events) = events else { return };
    let mut removed = Vec::new();
    for event in events.read() {
        let (id, before) = match event {
            AssetEvent::Modified { id } => (id, *frame),
            // Who has read it in the frame in which it came has read what came, unless it came back.
            AssetEvent::Added { id } => (id, if removed.contains(id) { *frame } else { *frame - 1 }),
            AssetEvent::Removed { id } => {
                removed.push(*id);
                masks.forget(*id);
                bases.forget(*id);
                continue;
            }
            AssetEvent::Unused { .. } | AssetEvent::LoadedWithDependencies { .. } => continue,
        };
        masks.forget(*id);
        bases.forget(*id);
        bakes.forget_picture(*id, before);
        preparations.forget_picture(*id, before);
        for entity in sources.get(id).into_iter().flatten() {
            if let Some(active) = active.get_mut(entity).filter(|active| active.read_at < before) {
                active.is_outdated = true;
                changed.push(*entity);
            }
        }
    }
}

/// Whether anything has changed.
pub(super) fn any_changed(surfaces: Res<Surfaces>) -> bool {
    !surfaces.changed.is_empty()
}

/// Takes up what has changed. What is not loaded yet is looked at again in the next frame.
pub(super) fn update_changed(world: &mut World) {
    hold(world, take_up_changed);
}

fn take_up_changed(world: &mut World) {
    let mut changed = core::mem::take(&mut world.resource_mut::<Surfaces>().changed);
    changed.sort_unstable();
    changed.dedup();
    changed.retain(|entity| {
        let Some(mut active) = take(world, *entity) else { return false };
        let before = (active.base.clone(), active.textures.clone());
        let outcome = update(world, *entity, &mut active);
        let is_growing = active.growth.is_growing();
        let has_new_textures = !Arc::ptr_eq(&before.0, &active.base) || before.1 != active.textures;
        let mut surfaces = world.resource_mut::<Surfaces>();
        surfaces.own(*entity, &active);
        surfaces.active.insert(*entity, active);
        surfaces.soil(*entity);
        if is_growing {
            surfaces.start_growing(*entity);
        }
        if has_new_textures {
            tell_textures(world, *entity);
        }
        match outcome {
            Ok(is_done) => {
                if is_done {
                    recover(world, *entity);
                }
                !is_done
            }
            Err(error) => {
                fail(world, *entity, error);
                false
            }
        }
    });
    world.resource_mut::<Surfaces>().changed.append(&mut changed);
}

/// A surface that failed over a picture that is whole again goes on.
fn recover(world: &mut World, entity: Entity) {
    let is_growing = world.resource::<Surfaces>().active.get(&entity).is_some_and(|active| active.is_growing);
    if matches!(world.get::<CrackState>(entity).map(|state| &state.status), Some(CrackStatus::Failed(_))) {
        set_status(world, entity, if is_growing { CrackStatus::Growing } else { CrackStatus::Done });
    }
}

fn take(world: &mut World, entity: Entity) -> Option<Active> {
    let mut surfaces = world.resource_mut::<Surfaces>();
    let active = surfaces.active.remove(&entity)?;
    surfaces.disown(entity, &active);
    Some(active)
}

/// `false` if the new picture is not there yet. On an error the cracks stay as they are.
fn update(world: &mut World, entity: Entity, active: &mut Active) -> Result<bool, CrackError> {
    if !update_settings(world, entity, active) {
        return Ok(false);
    }
    let (mut kind, mut found) = carrier::inspect(world, entity);
    if active.carrier.shown.layout.is_some()
        && matches!(&found, Found::Shown(shown) if !active.carrier.is_showing(&shown.asset))
    {
        // Another picture is laid out as the one before, unless somebody says otherwise.
        (active.carrier.kind.detach)(world, entity, &active.carrier);
        (kind, found) = carrier::inspect(world, entity);
    }
    let shown = match found {
        Found::Shown(shown) => *shown,
        Found::Waiting => return Ok(false),
        Found::Unusable(error) => return Err(error),
        Found::Other => return Ok(true),
    };
    if active.carrier.is_showing(&shown.asset) {
        // A part of the picture is shown as it is, not of textures of another size.
        let is_part = shown.rect.is_some() && active.unstretched.is_some_and(|size| active.base.size.cmpgt(size).any());
        // Somebody has it laid out in another way.
        let is_laid_out = shown.layout.is_some() && active.carrier.own.is_some();
        if active.is_outdated || is_part || is_laid_out {
            // What it shows now are our textures; the pictures are those it was made from.
            let is_new = is_laid_out || active.carrier.own.is_none();
            let layout = if is_new { shown.layout } else { active.carrier.shown.layout.clone() };
            let original = Shown { rect: shown.rect, layout, ..active.carrier.shown.clone() };
            return update_picture(world, entity, active, None, original);
        }
        if let Some(rect) = shown.texels(active.carrier.whole(active.base.size).size()) {
            active.show(rect);
        }
        return Ok(true);
    }
    // Somebody gave it another picture.
    let Some(kind) = kind else { return Ok(true) };
    update_picture(world, entity, active, Some(kind), shown)
}

/// Takes up other settings; a preset that is invalid is refused and the old one stays. `false` if it is not there yet.
fn update_settings(world: &World, entity: Entity, active: &mut Active) -> bool {
    if let Some(surface) = world.get::<CrackSurface>(entity)
        && *surface != active.surface
    {
        // Remembered even if refused, so that it is refused once only.
        active.surface = surface.clone();
        active.has_new_settings = true;
    }
    if !active.has_new_settings {
        return true;
    }
    let preset = preset::resolve(world, &active.surface.preset);
    if matches!(preset, Ok(None)) {
        return false;
    }
    active.has_new_settings = false;
    match preset.and_then(|preset| preset.map_or(Ok(()), |preset| update_preset(active, preset))) {
        Ok(()) => {}
        Err(error) => warn!("the changed preset of {} is not used: {error}", Called::of(world, entity)),
    }
    true
}

fn update_preset(active: &mut Active, preset: CrackPreset) -> Result<(), CrackError> {
    if preset == active.preset {
        return Ok(());
    }
    let look = look(&preset, active.field.frame)?;
    active.recall();
    if preset.growth != active.preset.growth {
        let outcome = active.growth.set_params(preset.growth.clone());
        outcome.map_err(|error| CrackError::Preset { reason: error.to_string() })?;
    }
    active.look = look;
    let plan = preset.look.layer(active.surface.seed);
    if active.profile != preset.profile || *active.field.plan() != plan {
        active.profile = preset.profile;
        active.field.lay(plan);
        stamp_anew(active);
    }
    active.rate = preset.steps_per_second;
    active.preset = preset;
    let whole = TexelRect::whole(active.field.frame.size());
    active.mark(whole);
    Ok(())
}

/// On a picture of other proportions the same hits, in the same places, make other cracks: grown as far as they were.
/// `None` if they may stay.
fn regrow(active: &mut Active, frame: SurfaceFrame, mask: Arc<CrackMask>) -> Result<Option<CrackGrowth>, CrackError> {
    if active.growth.network().extent() == frame.extent() {
        return Ok(None);
    }
    let past = Past::of(active);
    let Active { preset, surface, added, .. } = active;
    grown_anew(preset, frame.extent(), surface.seed, mask, None, added.as_mut(), &past).map(Some)
}

/// What has happened to a surface.
pub(super) struct Past {
    /// Places (texture coordinates) and energies of its hits.
    pub(super) hits: Vec<(Vec2, f32)>,
    /// Steps of growth after those of what was added.
    pub(super) steps: u32,
}

impl Past {
    pub(super) fn of(active: &Active) -> Self {
        let extent = active.growth.network().extent();
        Self {
            hits: active.growth.impacts().iter().map(|impact| (impact.pos / extent, impact.energy)).collect(),
            steps: active.growth.steps() - active.added.as_ref().map_or(0, |added| added.steps),
        }
    }
}

/// The same hits in the same places, around what is added, grown as far as they were.
pub(super) fn grown_anew(
    preset: &CrackPreset,
    extent: Vec2,
    seed: u64,
    mask: Arc<CrackMask>,
    density: Option<Grid<f32>>,
    added: Option<&mut Added>,
    past: &Past,
) -> Result<CrackGrowth, CrackError> {
    let mut growth = CrackGrowth::new(preset.growth.clone(), extent, seed)
        .map_err(|error| CrackError::Preset { reason: error.to_string() })?;
    growth.set_mask(mask);
    growth.set_density(density);
    if let Some(added) = added {
        added.steps = growth.add_cracks(&added.network, added.opening);
    }
    for (uv, energy) in &past.hits {
        growth.hit((*uv * extent).min(extent), *energy);
    }
    for _ in 0..past.steps {
        growth.step();
    }
    Ok(growth)
}

/// It is shown by something else from now on.
fn change_carrier(world: &mut World, entity: Entity, active: &mut Active, kind: &'static Kind, shown: &Shown) {
    active.offered.clear();
    let carrier = Carrier::new(kind, shown.clone());
    if shown.asset.type_id() == active.carrier.shown.asset.type_id() {
        let (mesh, size) = (active.carrier.mesh.take(), active.carrier.size);
        active.carrier = Carrier { mesh, size, ..carrier };
    } else {
        (active.carrier.kind.detach)(world, entity, &active.carrier);
        active.carrier = carrier;
    }
}

/// Reads the pictures anew and paints the cracks over them; `false` if they are not there yet. `other` is how to deal with them if somebody
/// gave them to it. Until they are accepted it is dealt with as before: its shards are of the kind that it was.
fn update_picture(
    world: &mut World,
    entity: Entity,
    active: &mut Active,
    other: Option<&'static Kind>,
    shown: Shown,
) -> Result<bool, CrackError> {
    active.is_outdated = true;
    active.offered = if other.is_some() { shown.pictures().map(Handle::id).collect() } else { Vec::new() };
    let Some(draft) = draft(world, entity, active, other, &shown)? else { return Ok(false) };
    let from = active.surface.mask.with(&active.preset);
    let Some(mask) = mask::resolve(world, from, &shown, &draft)? else { return Ok(false) };
    let frame = frame(draft.plan.rect)?;
    let look = look(&active.preset, frame)?;
    active.recall();
    let regrown = regrow(active, frame, mask.clone())?;
    active.textures = make_textures(world, &draft, Some(&active.textures))?;
    // Shards show the picture that was.
    let bytes = drop_shards(world, entity, active);
    world.resource_mut::<Surfaces>().bytes -= bytes;
    if let Some(kind) = other {
        change_carrier(world, entity, active, kind, &shown);
    }
    active.is_outdated = false;
    active.read_at = world.resource::<Surfaces>().frame;
    if let Some(growth) = regrown {
        active.frozen = None;
        active.cells = CellTracker::new(frame.extent());
        active.cells.update(growth.network());
        active.cells_told = active.cells.cells().len();
        active.growth = growth;
    }
    if active.surface.alpha_mask {
        active.growth.set_density(draft.base.density(draft.plan.rect));
    }
    let had_mask = !active.growth.mask().is_empty();
    active.growth.set_mask(mask.clone());
    world.resource_mut::<Surfaces>().bytes += draft.plan.bytes;
    world.resource_mut::<Surfaces>().bytes -= active.bytes;
    active.bytes = draft.plan.bytes;
    active.unstretched = draft.plan.unstretched;
    active.base = draft.base;
    // What the mask forbids may be elsewhere now.
    if frame != active.field.frame || had_mask || !mask.is_empty() {
        active.look = look;
        active.field = DepthField::new(frame);
        active.field.forbid(&mask);
        active.field.lay(active.preset.look.layer(active.surface.seed));
        stamp_anew(active);
    }
    active.views.clear();
    active.show(draft.plan.rect);
    active.carrier.shown = shown;
    active.carrier.is_twofold = draft.plan.is_twofold;
    // The material is made anew: one that exists keeps showing a texture of the old size.
    attach(world, entity, active);
    Ok(true)
}
