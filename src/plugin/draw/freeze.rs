//! Freezing: a surface that has all its nodes keeps the picture of its oldest cracks and forgets the rest of them.

use super::async_playback::is_at_work;
use crate::plugin::api::CrackBudget;
use crate::plugin::jobs::background::drop_in_background;
use crate::plugin::jobs::threads::Threads;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cracked::{active, active_mut};
use crate::plugin::surface::cracks::Cracks;
use crate::plugin::surface::drawing::{Drawing, Frozen};
use crate::plugin::surface::freezing::{Freezing, Left};
use crate::plugin::surface::queues::Queues;
use crate::plugin::surface::shared::Shared;
use crate::plugin::surface::stamp::{Scratch, stamp};
use bevy::prelude::*;

/// Whether less than a quarter of its nodes are left to a surface. One whose time may be turned back needs all of its cracks.
fn is_full(active: &Active) -> bool {
    let growth = &active.cracks.growth;
    active.playhead.playback.is_none() && growth.nodes_left() < growth.params().max_nodes.div_ceil(4)
}

/// Whether all that has grown has been drawn, and nothing of the next step is being prepared: no frame changes the cracks then.
fn stands_still(active: &Active) -> bool {
    let turn = &active.turn;
    let is_at_work = turn.is_dirty || turn.is_stamping || turn.is_laying_out || turn.is_to_shatter;
    !is_at_work && !active.cracks.growth.is_preparing()
}

/// How many nodes a surface keeps: the newest half of them.
fn kept(active: &Active) -> u32 {
    active.cracks.growth.params().max_nodes / 2
}

/// Whether the hit has to wait for room: what is to be frozen is being drawn again, a task works out what is left, or what has grown is not all
/// drawn. `lands` tells whether the hit will not be refused.
pub(crate) fn has_to_wait(world: &mut World, entity: Entity, lands: impl FnOnce(&mut World) -> bool) -> bool {
    if !active(world, entity).is_some_and(is_full) {
        return false;
    }
    if is_at_work(world, entity) {
        return true;
    }
    let has_threads = world.resource::<Threads>().pool().is_some();
    if !has_threads || world.resource::<CrackBudget>().is_unlimited() || !lands(world) {
        return false;
    }
    let has_room = active_mut(world, entity).is_none_or(|active| {
        let known = active.freezing.take();
        let freezing = Freezing::go_on(known, &active.cracks, &active.drawing, kept(active), stands_still(active));
        // The next frames stamp what is left, and search it for cells, before the hit comes.
        let is_stamping = active.turn.is_stamping || (active.turn.is_dirty && active.cracks.growth.has_changed());
        active.freezing.insert(Box::new(freezing)).is_done() && !is_stamping
    });
    if !has_room {
        world.resource_mut::<Queues>().freezing.insert(entity);
    }
    !has_room
}

/// Makes room for a hit: a surface that is full forgets all but the newest half of its nodes. Returns whether it has.
pub(crate) fn freeze_if_full(active: &mut Active) -> bool {
    if !is_full(active) {
        return false;
    }
    let keep = kept(active);
    let left = active.freezing.take().and_then(|freezing| freezing.left(&active.cracks, &active.drawing));
    stamp(active, &mut Scratch::default());
    let Drawing { field, frozen, .. } = &mut active.drawing;
    let Cracks { growth, cells, .. } = &mut active.cracks;
    let (now, gone) = match left.map(|left| *left) {
        Some(Left { growth: mut left, forgotten }) => {
            cells.update(growth.network());
            left.take_density(growth);
            // All of it has been drawn.
            left.take_changed(&mut Vec::new());
            left.take_markers(&mut Vec::new());
            drop_in_background(core::mem::replace(growth, Shared::new(left)));
            Frozen::of(frozen.take(), forgotten, field, cells)
        }
        None => Frozen::after(frozen.take(), growth, keep, field, cells),
    };
    *frozen = Some(now);
    if let Some(added) = &mut active.cracks.added {
        // What is forgotten does not move any more.
        added.motion = None;
    }
    active.cracks.cells_reported = active.cracks.cells.cells().len();
    active.cracks.tips_from = active.cracks.tips_from.saturating_sub(gone as usize);
    active.fell_at = (active.fell_at.0.saturating_sub(gone as usize), active.cracks.cells_reported);
    true
}

#[cfg(all(test, feature = "2d"))]
mod tests {
    use super::*;
    use crate::CrackPreset;
    use crate::math::Rng;
    use crate::plugin::headless::{app, blank, shown};
    use crate::plugin::prelude::*;
    use crate::plugin::surface::queue::with_queue;
    use bevy::time::TimeUpdateStrategy;
    use core::time::Duration;

    /// Milliseconds of a budget.
    const IN_FRAMES: f32 = 1e6;
    const BESIDE: f32 = 0.0;

    fn start(milliseconds: f32, preset: &CrackPreset) -> (App, Entity) {
        let mut app = app(CrackBudget { milliseconds, ..default() });
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::splat(128)));
        let mut preset = preset.clone();
        preset.growth.max_nodes = 400;
        let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(preset).with_seed(4))).id();
        (app, entity)
    }

    fn hit(app: &mut App, entity: Entity, number: u64) {
        let mut rng = Rng::new(number);
        app.world_mut().trigger(CrackHit::uv(entity, Vec2::new(rng.unit(), rng.unit())).with_energy(2.0));
    }

    /// Fault B5: what is left of the cracks of a full surface is worked out by a task, bit for bit as by a frame. The surface stands still
    /// until then, and the hit that needs the room comes after it.
    #[test]
    fn b5_what_is_forgotten_is_worked_out_beside_the_frames() {
        let mut waited_in_all = 0;
        for preset in [CrackPreset::CONCRETE, CrackPreset::CLAY, CrackPreset::GLASS] {
            let play = |milliseconds: f32| {
                let (mut app, entity) = start(milliseconds, &preset);
                let mut waited = 0;
                for number in 0..12 {
                    hit(&mut app, entity, number);
                    for frame in 0.. {
                        let steps = |app: &App| active(app.world(), entity).map(|a| a.cracks.growth.steps_made());
                        let before = steps(&app);
                        app.update();
                        let now = active(app.world(), entity);
                        if now.is_some_and(|active| active.freezing.is_some()) {
                            waited += 1;
                            assert_eq!(steps(&app), before);
                            std::thread::sleep(Duration::from_millis(1));
                        }
                        let is_waiting = app.world().resource::<CrackStats>().queued > 0;
                        if !is_waiting && now.is_some_and(|active| !active.cracks.growth.is_growing()) {
                            break;
                        }
                        assert!(frame < 20_000, "hit {number} never comes");
                    }
                }
                (0..20).for_each(|_| app.update());
                let end = active(app.world(), entity).map(|active| {
                    let frozen = active.drawing.frozen.as_ref();
                    let cells = active.cracks.cells.cells().len();
                    let nodes = active.cracks.growth.network().nodes().to_vec();
                    (nodes, cells, frozen.map(|frozen| (frozen.nodes, frozen.cells, frozen.depth.clone())))
                });
                assert!(end.as_ref().is_some_and(|(.., frozen)| frozen.is_some()), "it forgets nothing");
                (waited, end, shown(&app, entity))
            };
            let (at_once, in_frames, texels) = play(IN_FRAMES);
            let (waited, beside, texels_beside) = play(BESIDE);
            assert_eq!(at_once, 0);
            // On a busy machine some of it is done before the frame ends, and no wait is seen.
            waited_in_all += waited;
            assert!(beside == in_frames && texels_beside == texels);
        }
        assert!(waited_in_all > 0, "nothing was worked out beside the frames");
    }

    /// Faults B5, E3: a surface that forgets when it is healed, or when the hit goes that needs the room, is not held any more.
    #[test]
    fn b5_nothing_waits_for_hits_that_have_gone() {
        for heals in [true, false] {
            let (mut app, entity) = start(BESIDE, &CrackPreset::CONCRETE);
            let is_held = |app: &App| active(app.world(), entity).is_some_and(|active| active.freezing.is_some());
            let mut number = 0;
            for _ in 0..20_000 {
                if app.world().resource::<CrackStats>().queued == 0 {
                    hit(&mut app, entity, number);
                    number += 1;
                }
                app.update();
                if is_held(&app) {
                    break;
                }
            }
            assert!(is_held(&app), "it is never full");
            if heals {
                app.world_mut().commands().entity(entity).heal_cracks();
            } else {
                with_queue(app.world_mut(), |_, queue, stats| queue.purge(entity, stats));
            }
            app.update();
            assert!(!is_held(&app) && app.world().resource::<Queues>().freezing.is_empty());
            // It cracks on.
            hit(&mut app, entity, 7);
            let hits = |app: &App| app.world().get::<CrackState>(entity).map_or(0, |state| state.hits);
            let before = hits(&app);
            for _ in 0..5000 {
                app.update();
                if hits(&app) > before {
                    break;
                }
                std::thread::sleep(Duration::from_millis(1));
            }
            assert!(hits(&app) > before);
        }
    }
}
