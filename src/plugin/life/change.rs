//! Changes are applied: other presets, other pictures, another frame of an animation.

use crate::CrackPreset;
use crate::pattern::CellTracker;
use crate::plugin::api::error::EntityLabel;
use crate::plugin::api::{CrackBudget, CrackError, CrackState, CrackStatus, CrackSurface};
use crate::plugin::carrier::kind::{Carrier, CarrierKind, Found, Shown};
use crate::plugin::carrier::kinds;
use crate::plugin::draw::async_playback::{self, recall};
use crate::plugin::draw::next_picture::{self, NextInputs, NextShown};
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
/// last hit are to be laid out before it, which may need more than one frame.
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
    active.has_new_settings = false;
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
    let Some(draft) = draft(world, entity, active, other, &shown)? else { return Ok(false) };
    let Some(mask) = resolve_mask(world, &active.surface, &active.preset, &shown, &draft)? else { return Ok(false) };
    let (frame, is_nearest) = (frame(draft.plan.rect, &draft.base)?, draft.base.is_nearest);
    let (preset, seed) = (active.preset.clone(), active.surface.seed);
    let inputs = NextInputs {
        look: look(&preset, frame, is_nearest)?,
        growth: Regrowth { preset, frame, seed, is_nearest, mask, density: None },
        base: draft.base.clone(),
        rect: draft.plan.rect,
        maps: draft.plan.maps,
    };
    let Some(next) = next_picture::make(world, entity, active, inputs, may_wait)? else {
        // Hits come after it.
        world.resource_mut::<Queues>().late.insert(entity);
        return Ok(false);
    };
    show_picture(world, entity, active, (other, shown), draft, next)?;
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
    active.canvas.is_outdated = false;
    active.canvas.read_at = world.resource::<FrameCount>().0;
    let changes_field = inputs.changes_field(active);
    let (mask, frame) = (inputs.growth.mask, inputs.growth.frame);
    if let Some(Regrown { growth, frozen }) = regrown {
        active.drawing.frozen = frozen;
        active.cracks.cells = CellTracker::new(frame.extent());
        active.cracks.cells.update(growth.network());
        active.cracks.cells_reported = active.cracks.cells.cells().len();
        active.cracks.growth = growth;
    }
    if active.surface.alpha_mask || draft.base.has_gaps() {
        active.cracks.growth.set_density(draft.base.density(draft.plan.rect));
    }
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
mod tests {
    use super::*;
    use crate::plugin::{
        headless::{app, blank, shown},
        jobs::threads::Threads,
        prelude::*,
    };
    use crate::shatter::{Anchor, ShatterParams};
    use bevy::time::TimeUpdateStrategy;
    use core::time::Duration;

    /// Fault B5: a frame without time draws one surface anew when the preset of many changes, each has its turn, and a hit that comes
    /// after the change grows by the new preset.
    #[test]
    fn b5_the_preset_of_many_surfaces_changes_within_the_budget() {
        const SURFACES: usize = 12;
        let mut app = app(CrackBudget { milliseconds: 1000.0, ..default() });
        let preset = CrackPreset::CONCRETE.scaled(0.3);
        let entities: Vec<Entity> = (0..SURFACES as u64)
            .map(|seed| {
                let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::splat(32)));
                let surface = CrackSurface::new(preset.clone()).with_seed(seed);
                app.world_mut().spawn((Sprite::from_image(image), surface)).id()
            })
            .collect();
        let hit_all = |app: &mut App| {
            for entity in &entities {
                app.world_mut().trigger(CrackHit::uv(*entity, Vec2::splat(0.5)));
            }
        };
        let hits = |app: &App, entity: &Entity| active(app.world(), *entity).map_or(0, |active| active.cracks.hits);
        let settled = |app: &App| {
            let is_settled = |active: &Active| active.cracks.hits > 0 && !active.cracks.growth.is_growing();
            entities.iter().all(|entity| active(app.world(), *entity).is_some_and(is_settled))
        };
        hit_all(&mut app);
        // By the clock: frames take next to no time where nothing else runs.
        for _ in 0..10_000 {
            app.update();
            if settled(&app) {
                break;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(settled(&app), "they do not crack");

        app.world_mut().resource_mut::<CrackBudget>().milliseconds = 0.0;
        let other = CrackPreset::ICE.scaled(0.3);
        for entity in &entities {
            app.world_mut().get_mut::<CrackSurface>(*entity).expect("it is there").preset = other.clone().into();
        }
        hit_all(&mut app);
        let mut frames = 0;
        let changed = |app: &App, entity: &Entity| active(app.world(), *entity).is_some_and(|a| a.preset == other);
        loop {
            let before = entities.iter().filter(|entity| changed(&app, entity)).count();
            app.update();
            frames += 1;
            let after = entities.iter().filter(|entity| changed(&app, entity)).count();
            assert!(after - before <= 1, "{} surfaces in a frame without time", after - before);
            for entity in &entities {
                assert!(changed(&app, entity) || hits(&app, entity) == 1, "a hit came before the change");
            }
            if entities.iter().all(|entity| hits(&app, entity) == 2) {
                break;
            }
            assert!(frames < 400, "some surface starves");
        }
        assert!(frames >= SURFACES, "{frames} frames");
        assert!(app.world().resource::<Queues>().late.is_empty());
    }

    /// Fault B5: cracks on a picture of other proportions are grown again by a task, as a frame would have grown them; hits come after that.
    #[test]
    fn b5_cracks_on_another_picture_are_grown_beside_the_frames() {
        let grown = |budget: CrackBudget| {
            let mut app = app(CrackBudget { milliseconds: 1e6, ..default() });
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
            let [first, other] = [UVec2::new(96, 96), UVec2::new(160, 80)]
                .map(|size| app.world_mut().resource_mut::<Assets<Image>>().add(blank(size)));
            let surface = CrackSurface::new(CrackPreset::CLAY.scaled(0.5)).with_seed(4);
            let entity = app.world_mut().spawn((Sprite::from_image(first), surface)).id();
            app.world_mut().trigger(CrackHit::uv(entity, Vec2::new(0.3, 0.6)).with_energy(4.0));
            // They are still growing.
            (0..60).for_each(|_| app.update());
            let extent = |app: &App| active(app.world(), entity).map(|a| a.cracks.growth.network().extent());
            let before = extent(&app);
            assert!(active(app.world(), entity).is_some_and(|a| a.cracks.growth.network().nodes().len() > 1024));
            app.insert_resource(budget);
            // Their time stands still, so that the hit comes after the same step.
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
            if let Some(mut sprite) = app.world_mut().get_mut::<Sprite>(entity) {
                sprite.image = other;
            }
            app.world_mut().trigger(CrackHit::uv(entity, Vec2::new(0.7, 0.4)));
            let is_limited = !app.world().resource::<CrackBudget>().is_unlimited();
            app.update();
            assert_eq!(extent(&app) == before, is_limited, "the frame of the change");
            for _ in 0..10_000 {
                if extent(&app) != before {
                    break;
                }
                let hits = active(app.world(), entity).map(|active| active.cracks.hits);
                assert_eq!(hits, Some(1), "a hit comes after the change");
                std::thread::sleep(Duration::from_millis(1));
                app.update();
            }
            assert_ne!(extent(&app), before);
            app.insert_resource(CrackBudget { milliseconds: 1e6, ..default() });
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
            (0..600).for_each(|_| app.update());
            assert!(app.world().resource::<Queues>().late.is_empty());
            let grown = active(app.world(), entity);
            let grown = grown.map(|active| (active.cracks.hits, active.cracks.growth.steps_made()));
            (grown, shown(&app, entity))
        };
        let at_once = grown(CrackBudget { milliseconds: 1e6, ..default() });
        assert_eq!(at_once.0.map(|grown| grown.0), Some(2));
        let beside = grown(CrackBudget { milliseconds: 500.0, ..default() });
        assert_eq!(at_once.0, beside.0);
        assert!(at_once.1 == beside.1, "other cracks");
    }

    /// Fault B5: a large surface with other settings is drawn again by a task, or in slices of frames. It shows what it showed until then, and
    /// what it would show if a frame had drawn it.
    #[test]
    fn b5_a_large_surface_is_drawn_again_beside_the_frames() {
        preset_changes_beside_the_frames(cracked);
    }

    /// Fault B5: so is one that has forgotten its oldest cracks.
    #[test]
    fn b5_a_large_surface_that_has_forgotten_is_drawn_again_beside_the_frames() {
        preset_changes_beside_the_frames(forgetful);
    }

    /// Fault B5: so is one that shards have left.
    #[test]
    fn b5_a_large_surface_without_its_shards_is_drawn_again_beside_the_frames() {
        preset_changes_beside_the_frames(broken);
    }

    /// Fault B5: so is one that shows frames of an atlas.
    #[test]
    fn b5_a_large_surface_with_frames_is_drawn_again_beside_the_frames() {
        preset_changes_beside_the_frames(animated);
    }

    /// Fault B5: so is one whose picture has changed.
    #[test]
    fn b5_a_large_surface_on_a_changed_picture_is_drawn_beside_the_frames() {
        let same = |app: &mut App, entity| change_picture(app, entity, UVec2::new(600, 500));
        let larger = |app: &mut App, entity| change_picture(app, entity, UVec2::new(720, 600));
        let wider = |app: &mut App, entity| change_picture(app, entity, UVec2::new(800, 400));
        let another = |app: &mut App, entity| give_picture(app, entity, UVec2::new(600, 500));
        let another_wider = |app: &mut App, entity| give_picture(app, entity, UVec2::new(800, 400));
        let cases: [(Crack, Change); 7] = [
            (cracked, larger),
            (cracked, wider),
            (forgetful, same),
            (broken, larger),
            (cracked, another),
            (cracked, another_wider),
            (broken, another),
        ];
        for (crack, change) in cases {
            changes_beside_the_frames(crack, change);
        }
    }

    type Crack = fn(&mut App) -> Entity;
    type Change = fn(&mut App, Entity);

    fn preset_changes_beside_the_frames(crack: Crack) {
        let redraw = |app: &mut App, entity| {
            change_preset(app, entity, |preset| {
                (preset.profile, preset.look) = (CrackPreset::MUD.profile, CrackPreset::MUD.look);
            });
        };
        let repaint = |app: &mut App, entity| {
            change_preset(app, entity, |preset| (preset.look.tint, preset.look.shadow) = (0.2, 0.2));
        };
        for change in [redraw, repaint] {
            changes_beside_the_frames(crack, change);
        }
    }

    fn change_preset(app: &mut App, entity: Entity, change: fn(&mut CrackPreset)) {
        let preset = active(app.world(), entity).map(|active| active.preset.clone());
        if let (Some(mut preset), Some(mut surface)) = (preset, app.world_mut().get_mut::<CrackSurface>(entity)) {
            change(&mut preset);
            surface.preset = preset.into();
        }
    }

    fn change_picture(app: &mut App, entity: Entity, size: UVec2) {
        let picture = active(app.world(), entity).and_then(|active| active.carrier.shown.diffuse.clone());
        let mut images = app.world_mut().resource_mut::<Assets<Image>>();
        if let Some(mut image) = picture.and_then(|picture| images.get_mut(&picture)) {
            *image = blank(size);
            image.data.iter_mut().flatten().for_each(|value| *value = value.saturating_add(20));
        }
        // The engine tells of it at the end of the frame.
        app.update();
    }

    /// Somebody gives it another picture.
    fn give_picture(app: &mut App, entity: Entity, size: UVec2) {
        let mut image = blank(size);
        image.data.iter_mut().flatten().for_each(|value| *value = value.saturating_add(20));
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(image);
        if let Some(mut sprite) = app.world_mut().get_mut::<Sprite>(entity) {
            sprite.image = image;
        }
    }

    fn settle(app: &mut App, entity: Entity) {
        let is_done = |app: &App| {
            let state = app.world().get::<CrackState>(entity);
            state.is_some_and(|state| state.hits > 0 && state.status == CrackStatus::Done)
        };
        for _ in 0..2000 {
            app.update();
            if is_done(app) {
                break;
            }
        }
        assert!(is_done(app), "it does not crack");
    }

    fn hit_and_settle(app: &mut App, entity: Entity) {
        for i in 0..4 {
            let at = Vec2::new(0.2 + 0.2 * i as f32, 0.5);
            app.world_mut().trigger(CrackHit::uv(entity, at).with_energy(3.0));
        }
        settle(app, entity);
    }

    fn spawn(app: &mut App, preset: CrackPreset, size: UVec2) -> Entity {
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(size));
        app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(preset).with_seed(4))).id()
    }

    fn cracked(app: &mut App) -> Entity {
        let entity = spawn(app, CrackPreset::CONCRETE, UVec2::new(600, 500));
        hit_and_settle(app, entity);
        entity
    }

    fn forgetful(app: &mut App) -> Entity {
        let mut preset = CrackPreset::CONCRETE;
        preset.growth.max_nodes = 400;
        let entity = spawn(app, preset, UVec2::new(600, 500));
        for _ in 0..20 {
            hit_and_settle(app, entity);
        }
        assert!(active(app.world(), entity).is_some_and(|active| active.drawing.frozen.is_some()));
        entity
    }

    fn broken(app: &mut App) -> Entity {
        let entity = spawn(app, CrackPreset::GLASS, UVec2::new(600, 500));
        let cut = ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT };
        let settings = ShatterCracks { cut, anchor: Anchor::Nothing, ..default() };
        app.world_mut().entity_mut(entity).insert(settings);
        hit_and_settle(app, entity);
        app.world_mut().commands().entity(entity).shatter_cracks(ShatterRequest::around(Vec2::splat(0.2), 0.1));
        let is_whole = |app: &App| active(app.world(), entity).is_none_or(|active| active.drawing.cutouts.is_none());
        for _ in 0..10_000 {
            app.update();
            if !is_whole(app) {
                break;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        (0..50).for_each(|_| app.update());
        let is_broken = |active: &Active| {
            active.drawing.cutouts.as_ref().is_some_and(|holes| holes.is_any()) && !active.drawing.carried.is_empty()
        };
        assert!(active(app.world(), entity).is_some_and(is_broken));
        entity
    }

    fn animated(app: &mut App) -> Entity {
        let entity = spawn(app, CrackPreset::CONCRETE, UVec2::new(1200, 500));
        let frames = TextureAtlasLayout::from_grid(UVec2::new(600, 500), 2, 1, None, None);
        let layout = app.world_mut().resource_mut::<Assets<TextureAtlasLayout>>().add(frames);
        if let Some(mut sprite) = app.world_mut().get_mut::<Sprite>(entity) {
            sprite.texture_atlas = Some(TextureAtlas { layout, index: 0 });
        }
        hit_and_settle(app, entity);
        for index in [1, 0] {
            show_frame(app, entity, index);
        }
        assert!(active(app.world(), entity).is_some_and(|active| active.canvas.views.len() == 2));
        entity
    }

    fn show_frame(app: &mut App, entity: Entity, index: usize) {
        if let Some(atlas) = app.world_mut().get_mut::<Sprite>(entity).as_mut().and_then(|s| s.texture_atlas.as_mut()) {
            atlas.index = index;
        }
        (0..5).for_each(|_| app.update());
    }

    /// The texels that the sprite shows.
    fn seen(app: &App, entity: Entity) -> Vec<u8> {
        let texels = shown(app, entity);
        let canvas = active(app.world(), entity).map(|active| (active.canvas.seen(), active.canvas.base.size.x));
        let Some((Some(rect), width)) = canvas else { return texels };
        let row = |y: u32| 4 * (y * width + rect.min.x) as usize..4 * (y * width + rect.max.x) as usize;
        (rect.min.y..rect.max.y).map(|y| &texels[row(y)]).collect::<Vec<_>>().concat()
    }

    /// All that is shown while a surface changes, and what it shows after another hit, of all frames.
    fn pictures_of(
        crack: Crack,
        change: Change,
        budget: CrackBudget,
        no_threads: bool,
    ) -> (Vec<Vec<u8>>, [Vec<u8>; 2]) {
        let mut app = app(CrackBudget { milliseconds: 1e6, ..default() });
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
        let entity = crack(&mut app);
        let is_limited = !budget.is_unlimited();
        app.insert_resource(budget);
        app.world_mut().resource_mut::<Threads>().are_missing = no_threads;
        let mut pictures = vec![seen(&app, entity)];
        change(&mut app, entity);
        let mut last = 0;
        for frame in 0..2000 {
            app.update();
            let now = seen(&app, entity);
            if pictures.last() != Some(&now) {
                pictures.push(now);
                last = frame;
            }
            assert!(frame > 0 || (pictures.len() == 1) == is_limited, "the frame of the change");
            if pictures.len() > 1 && frame - last > 50 {
                break;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        let state = app.world().get::<CrackState>(entity);
        assert!(state.is_some_and(|state| state.status == CrackStatus::Done));
        assert!(app.world().get::<async_playback::AsyncPlayback>(entity).is_none());
        assert!(active(app.world(), entity).is_some_and(|active| active.playhead.playback.is_none()));
        // It cracks on as all others.
        app.insert_resource(CrackBudget { milliseconds: 1e6, ..default() });
        app.world_mut().trigger(CrackHit::uv(entity, Vec2::new(0.5, 0.2)));
        (0..300).for_each(|_| app.update());
        let after = [0, 1].map(|index| {
            show_frame(&mut app, entity, index);
            seen(&app, entity)
        });
        (pictures, after)
    }

    /// Fault B5: a picture that somebody has given a large surface is shown when its cracks are, and not without them; a surface that is
    /// healed before shows it whole.
    #[test]
    fn b5_another_picture_comes_with_its_cracks() {
        let image = |app: &App, entity| app.world().get::<Sprite>(entity).map(|sprite| sprite.image.clone());
        let original = |app: &App, entity| active(app.world(), entity).and_then(|a| a.carrier.shown.diffuse.clone());
        let mut app = app(CrackBudget { milliseconds: 0.0, ..default() });
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
        let entity = cracked(&mut app);
        let own = image(&app, entity);
        for size in [UVec2::new(600, 500), UVec2::new(500, 800)] {
            give_picture(&mut app, entity, size);
            let given = image(&app, entity);
            let mut frames = 0;
            while original(&app, entity) != given {
                app.update();
                frames += 1;
                assert_eq!(image(&app, entity), own, "frame {frames}");
                assert!(frames < 10_000, "it never comes");
                std::thread::sleep(Duration::from_millis(1));
            }
            assert!(frames > 1);
        }
        let [first, second] = [0, 1].map(|_| {
            give_picture(&mut app, entity, UVec2::new(600, 500));
            let given = image(&app, entity);
            app.update();
            assert_eq!(image(&app, entity), own);
            given
        });
        assert_ne!(first, second);
        app.world_mut().commands().entity(entity).heal_cracks();
        app.update();
        assert_eq!(image(&app, entity), second);
    }

    fn changes_beside_the_frames(crack: Crack, change: Change) {
        let (in_a_frame, after) = pictures_of(crack, change, CrackBudget { milliseconds: 1e6, ..default() }, false);
        assert_eq!(in_a_frame.len(), 2);
        for no_threads in [false, true] {
            let budget = CrackBudget { milliseconds: 0.0, ..default() };
            let (beside, after_beside) = pictures_of(crack, change, budget, no_threads);
            assert!(beside == in_a_frame, "{} pictures", beside.len());
            assert!(after_beside == after);
        }
    }
}
