//! Changes are applied: other presets, other pictures, another frame of an animation.

use crate::CrackPreset;
use crate::pattern::CellTracker;
use crate::plugin::api::error::EntityLabel;
use crate::plugin::api::{CrackBudget, CrackError, CrackState, CrackStatus, CrackSurface};
use crate::plugin::carrier::kind::{Carrier, CarrierKind, Found, Shown};
use crate::plugin::carrier::kinds;
use crate::plugin::draw::async_playback::{self, recall};
use crate::plugin::draw::next_picture::{self, NextInputs, NextShown, Request};
use crate::plugin::gpu::memory::TextureMemory;
use crate::plugin::jobs::deferred::hold;
use crate::plugin::jobs::frame_time::{FrameClock, Timer};
use crate::plugin::shards::broken::drop_shards;
use crate::plugin::source::picture::FrameCount;
use crate::plugin::source::preset;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cracked::{self, active, with_queues};
use crate::plugin::surface::create::{attach, make_textures, report_textures, set_status};
use crate::plugin::surface::frame::{frame, look, profile};
use crate::plugin::surface::picture_plan::ReadPictures;
use crate::plugin::surface::plan::resolve_mask;
use crate::plugin::surface::prepare::fail;
use crate::plugin::surface::queues::Queues;
use crate::plugin::surface::regrow::{Regrown, Regrowth};
use crate::plugin::surface::reread::draft;
use crate::plugin::surface::shared::Shared;
use crate::plugin::surface::stamp::stamp_anew;
use crate::plugin::surface::time::SLICE;
use crate::raster::DepthField;
use bevy::prelude::*;
use std::sync::Arc;

/// Share of the frame's budget after which no further surface is drawn anew.
const SHARE: f32 = 0.4;

/// Applies what has changed. What is not loaded yet, and what there is no time for, is looked at again in the next frame.
pub(crate) fn update_changed(world: &mut World) {
    let timer = world.resource::<FrameClock>().start(world.resource::<CrackBudget>(), SHARE);
    hold(world, |world| apply_changes(world, &timer));
    world.resource_mut::<FrameClock>().stop(&timer);
}

fn apply_changes(world: &mut World, timer: &Timer) {
    let mut queues = world.resource_mut::<Queues>();
    let (mut changed, late) = (core::mem::take(&mut queues.changed), core::mem::take(&mut queues.late));
    // Those that have waited come first.
    changed.sort_unstable_by_key(|entity| (!late.contains(entity), *entity));
    changed.dedup();
    let mut has_drawn = false;
    changed.retain(|&entity| {
        let Some(mut active) = cracked::take(world, entity) else { return false };
        // The budget has time for one in every frame.
        if has_drawn && timer.is_over() && is_costly(world, entity, &active) {
            cracked::put_back(world, entity, active);
            world.resource_mut::<Queues>().late.insert(entity);
            return true;
        }
        let before = (active.canvas.base.clone(), active.canvas.textures.clone(), active.drawing.redrawn);
        let outcome =
            cracked::with_other_assets(world, entity, &mut active, |world, active| update(world, entity, active));
        has_drawn |= active.drawing.redrawn != before.2;
        let is_growing = active.cracks.growth.is_growing();
        let has_new_textures = !Arc::ptr_eq(&before.0, &active.canvas.base) || before.1 != active.canvas.textures;
        cracked::put_back(world, entity, active);
        with_queues(world, entity, |queues, turn| {
            queues.mark_dirty(entity, turn);
            if is_growing {
                queues.start_growing(entity, turn);
            }
        });
        if is_growing && world.get::<CrackState>(entity).is_some_and(|state| state.status == CrackStatus::Done) {
            set_status(world, entity, CrackStatus::Growing);
        }
        if has_new_textures {
            report_textures(world, entity);
        }
        if !matches!(outcome, Ok(false)) {
            next_picture::give_up(world, entity);
        }
        match outcome {
            Ok(is_done) => {
                if is_done {
                    recover(world, entity);
                }
                !is_done
            }
            Err(error) => {
                fail(world, entity, error);
                false
            }
        }
    });
    world.resource_mut::<Queues>().changed.append(&mut changed);
}

/// Whether a surface may have to be drawn anew: it has other settings or another picture.
fn is_costly(world: &World, entity: Entity, active: &Active) -> bool {
    active.has_new_settings
        || active.canvas.is_outdated
        || world.get::<CrackSurface>(entity).is_some_and(|surface| *surface != active.surface)
}

/// A surface that failed over a picture that is whole again goes on.
fn recover(world: &mut World, entity: Entity) {
    let is_growing = active(world, entity).is_some_and(|active| active.turn.is_growing);
    if matches!(world.get::<CrackState>(entity).map(|state| &state.status), Some(CrackStatus::Failed(_))) {
        set_status(world, entity, if is_growing { CrackStatus::Growing } else { CrackStatus::Done });
    }
}

/// `false` if the new picture is not there yet. On an error the cracks stay as they are.
fn update(world: &mut World, entity: Entity, active: &mut Active) -> Result<bool, CrackError> {
    active.turn.is_held = false;
    if !update_settings(world, entity, active) {
        return Ok(false);
    }
    let (mut kind, mut found) = kinds::inspect(world, entity);
    if active.carrier.shown.layout.is_some()
        && matches!(&found, Found::Shown(shown) if !active.carrier.is_showing(&shown.asset))
    {
        // Another picture is laid out as the one before, unless somebody says otherwise.
        active.carrier.kind.detach(world, entity, &active.carrier);
        (kind, found) = kinds::inspect(world, entity);
    }
    let shown = match found {
        Found::Shown(shown) => *shown,
        Found::Waiting => return Ok(false),
        Found::Unusable(error) => return Err(error),
        Found::Other => return Ok(true),
    };
    if active.carrier.is_showing(&shown.asset) {
        if let (Some(kind), Some(next)) = (kind, active.carrier.next.take()) {
            let (rect, layout) = (shown.rect, shown.layout);
            return update_picture(world, entity, active, Some(kind), Shown { rect, layout, ..*next });
        }
        // A part of the picture is shown as it is, not of textures of another size.
        let is_part = shown.rect.is_some()
            && active.canvas.unstretched.is_some_and(|size| active.canvas.base.size.cmpgt(size).any());
        // Somebody has it laid out in another way.
        let is_laid_out = shown.layout.is_some() && active.carrier.own.is_some();
        if active.canvas.is_outdated || is_part || is_laid_out {
            // What it shows now are our textures; the pictures are those it was made from.
            let is_new = is_laid_out || active.carrier.own.is_none();
            let layout = if is_new { shown.layout } else { active.carrier.shown.layout.clone() };
            let original = Shown { rect: shown.rect, layout, ..active.carrier.shown.clone() };
            return update_picture(world, entity, active, None, original);
        }
        if let Some(rect) = shown.texels(active.carrier.whole(active.canvas.base.size).size()) {
            active.show(rect);
        }
        return Ok(true);
    }
    // Somebody gave it another picture.
    let Some(kind) = kind else { return Ok(true) };
    update_picture(world, entity, active, Some(kind), shown)
}

/// Applies other settings; a preset that is invalid is refused and the old one stays. `false` if it is not there yet, or if markers of the
/// last hit are to be laid out before it, which may need more than one frame, or if a task draws what it shows.
fn update_settings(world: &mut World, entity: Entity, active: &mut Active) -> bool {
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
    let grows_otherwise = matches!(&preset, Ok(Some(preset)) if preset.growth != active.preset.growth && preset.growth.validate().is_ok());
    if grows_otherwise && active.cracks.growth.is_preparing() && !active.cracks.growth.prepare_step(SLICE) {
        world.resource_mut::<Queues>().late.insert(entity);
        return false;
    }
    let is_other = matches!(&preset, Ok(Some(preset)) if *preset != active.preset);
    if is_other && !async_playback::may_change(world, entity) {
        world.resource_mut::<Queues>().late.insert(entity);
        return false;
    }
    active.has_new_settings = false;
    next_picture::read_again(world, entity);
    match preset.and_then(|preset| preset.map_or(Ok(()), |preset| update_preset(world, entity, active, preset))) {
        Ok(()) => {}
        Err(error) => warn!("the changed preset of {} is not used: {error}", EntityLabel::of(world, entity)),
    }
    true
}

fn update_preset(
    world: &mut World,
    entity: Entity,
    active: &mut Active,
    preset: CrackPreset,
) -> Result<(), CrackError> {
    if preset == active.preset {
        return Ok(());
    }
    let look = look(&preset, active.drawing.field.frame, active.canvas.base.is_nearest)?;
    active.cracks.growth.finish_step();
    recall(world, entity, active);
    if preset.growth != active.preset.growth {
        let outcome = active.cracks.growth.set_params(preset.growth.clone());
        outcome.map_err(|error| CrackError::Preset { reason: error.to_string() })?;
    }
    active.canvas.look = look;
    let plan = preset.look.layer(active.surface.seed);
    let profile = profile(&preset, active.canvas.base.is_nearest);
    if active.drawing.profile != profile || *active.drawing.field.plan() != plan {
        active.drawing.profile = profile;
        active.drawing.field.set_layers(plan);
        async_playback::redraw(world, entity, active);
    } else {
        async_playback::repaint(world, entity, active);
    }
    active.playhead.rate = preset.steps_per_second;
    active.preset = preset;
    active.mark_all();
    Ok(())
}

/// It is shown by something else from now on.
fn change_carrier(
    world: &mut World,
    entity: Entity,
    active: &mut Active,
    kind: &'static dyn CarrierKind,
    shown: &Shown,
) {
    active.canvas.offered.clear();
    let carrier = Carrier::new(kind, shown.clone());
    if shown.asset.type_id() == active.carrier.shown.asset.type_id() {
        let (mesh, size) = (active.carrier.mesh.take(), active.carrier.size);
        let unfolding = active.carrier.unfolding.take();
        active.carrier = Carrier { mesh, size, unfolding, ..carrier };
    } else {
        active.carrier.kind.detach(world, entity, &active.carrier);
        active.carrier = carrier;
    }
}

/// Reads the pictures again and paints the cracks over them; `false` if they are not there yet. `other` is how to deal with them if somebody
/// gave them to it. Until they are accepted it is dealt with as before: its shards are of the kind that it was, and it goes on showing what it
/// did, if it can.
fn update_picture(
    world: &mut World,
    entity: Entity,
    active: &mut Active,
    other: Option<&'static dyn CarrierKind>,
    shown: Shown,
) -> Result<bool, CrackError> {
    let next = other.filter(|_| active.carrier.may_wait_for(&shown)).map(|_| Box::new(shown.clone()));
    let may_wait = other.is_none() || next.is_some();
    let outcome = try_picture(world, entity, active, other, shown, may_wait);
    let is_back = matches!(kinds::inspect(world, entity).1, Found::Shown(now) if active.carrier.is_showing(&now.asset));
    // One that turns out to be broken is not shown.
    active.carrier.next = next.filter(|_| matches!(outcome, Ok(false)) || (is_back && outcome.is_err()));
    if active.carrier.next.is_some() && !is_back {
        attach(world, entity, active);
    }
    outcome
}

/// Like [`update_picture`]; what it was before may be shown meanwhile if it `may_wait`.
fn try_picture(
    world: &mut World,
    entity: Entity,
    active: &mut Active,
    other: Option<&'static dyn CarrierKind>,
    shown: Shown,
    may_wait: bool,
) -> Result<bool, CrackError> {
    active.canvas.is_outdated = true;
    active.canvas.offered = if other.is_some() { shown.pictures().map(Handle::id).collect() } else { Vec::new() };
    let has_changed = core::mem::take(&mut active.canvas.has_changed);
    let latest = Request { other, shown, read: None, is_superseded: false };
    let mut request = if may_wait { next_picture::request(world, entity, latest, has_changed) } else { latest };
    let is_superseded = match show_request(world, entity, active, &mut request, may_wait) {
        Ok(true) => request.is_superseded,
        Err(error) if !request.is_superseded => return Err(error),
        // The newer one may be whole.
        Err(_) => true,
        Ok(false) => {
            if may_wait {
                next_picture::put_back(world, entity, request);
            }
            return Ok(false);
        }
    };
    active.canvas.is_outdated = is_superseded;
    Ok(!is_superseded)
}

/// Reads a picture, draws the cracks on it and shows them; `false` if they are not there yet.
fn show_request(
    world: &mut World,
    entity: Entity,
    active: &mut Active,
    request: &mut Request,
    may_wait: bool,
) -> Result<bool, CrackError> {
    if request.read.is_none() {
        let Some(reading) = draft(world, entity, active, request.other, &request.shown)? else { return Ok(false) };
        request.is_superseded |= reading.has_changed;
        let read = reading.pictures;
        let mask = resolve_mask(world, &active.surface, &active.preset, &request.shown, &read)?;
        let Some(mask) = mask else { return Ok(false) };
        request.read = Some((read, mask));
    }
    let Some((draft, mask)) = &request.read else { return Ok(false) };
    let frame = frame(draft.plan.rect, &draft.base)?;
    let inputs = NextInputs {
        look: look(&active.preset, frame, draft.base.is_nearest)?,
        growth: Regrowth {
            preset: active.preset.clone(),
            base: draft.base.clone(),
            rect: draft.plan.rect,
            frame,
            seed: active.surface.seed,
            alpha_mask: active.surface.alpha_mask,
            mask: mask.clone(),
        },
        maps: draft.plan.maps,
    };
    let next = if may_wait && !async_playback::may_change(world, entity) {
        active.turn.is_held = true;
        None
    } else {
        next_picture::make(world, entity, active, inputs, may_wait)?
    };
    let Some(next) = next else {
        // Hits come after it.
        world.resource_mut::<Queues>().late.insert(entity);
        return Ok(false);
    };
    let Some((draft, _)) = request.read.take() else { return Ok(false) };
    show_picture(world, entity, active, (request.other, request.shown.clone()), draft, next)?;
    Ok(true)
}

/// Shows cracks on other pictures, which frames draw and paint if nobody has.
fn show_picture(
    world: &mut World,
    entity: Entity,
    active: &mut Active,
    (other, shown): (Option<&'static dyn CarrierKind>, Shown),
    draft: ReadPictures,
    NextShown { inputs, regrown, drawn }: NextShown,
) -> Result<(), CrackError> {
    async_playback::take_back(world, entity, active);
    let (drawn, made) = drawn.map_or_else(Default::default, |drawn| drawn.split());
    active.canvas.textures = make_textures(world, &draft, Some(&active.canvas.textures), made)?;
    // Shards show the picture that was.
    drop_shards(world, entity, active);
    if let Some(kind) = other {
        change_carrier(world, entity, active, kind, &shown);
    }
    active.canvas.read_at = world.resource::<FrameCount>().0;
    let changes_field = inputs.changes_field(active);
    let (mask, frame) = (inputs.growth.mask, inputs.growth.frame);
    if let Some(Regrown { growth, frozen }) = regrown {
        active.drawing.frozen = frozen;
        active.cracks.cells = CellTracker::new(frame.extent());
        active.cracks.cells.update(growth.network());
        active.cracks.cells_reported = active.cracks.cells.cells().len();
        active.cracks.growth = Shared::new(growth);
    }
    let density = draft.base.density(draft.plan.rect, active.surface.alpha_mask);
    active.cracks.growth.set_density(density);
    active.cracks.growth.set_mask(mask.clone());
    active.bytes = world.resource::<TextureMemory>().count(draft.plan.bytes);
    active.canvas.unstretched = draft.plan.unstretched;
    active.canvas.has_mips = draft.plan.maps.mips;
    let profile = profile(&active.preset, draft.base.is_nearest);
    active.canvas.base = draft.base;
    active.canvas.look = inputs.look;
    let is_painted = drawn.is_some();
    match drawn {
        Some(drawn) => drawn.put_on(active),
        None if changes_field => {
            active.drawing.profile = profile;
            active.drawing.field = DepthField::new(frame);
            active.drawing.field.set_forbidden(&mask);
            active.drawing.field.set_layers(active.preset.look.layer(active.surface.seed));
            stamp_anew(active);
        }
        None => {}
    }
    active.drop_analogy();
    active.canvas.views.clear();
    active.show(draft.plan.rect);
    if is_painted {
        active.canvas.views.iter_mut().for_each(|view| view.dirty.clear());
    }
    active.carrier.shown = shown;
    active.carrier.is_twofold = draft.plan.is_twofold;
    active.carrier.unfolding = draft.plan.unfolding.clone();
    // The material is made again: one that exists keeps showing a texture of the old size.
    attach(world, entity, active);
    Ok(())
}

#[cfg(all(test, feature = "2d"))]
mod tests;
