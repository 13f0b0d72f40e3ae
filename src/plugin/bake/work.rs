//! A bake and its work.

use super::finish::{Finish, FinishStep, Finished};
use super::map_job::{Lines, MAPPED, MapJob};
use crate::plugin::api::{BakeProgress, CrackError, CrackRecord, CrackStrands, CrackSurface, GuidedCracks};
use crate::plugin::carrier::kinds;
use crate::plugin::jobs::copy::PictureCopies;
use crate::plugin::jobs::stepped::{RunningTask, Step, Stepped};
use crate::plugin::surface::cracked::has_cracked;
use crate::plugin::surface::plan::Plan;
use bevy::{
    ecs::{
        change_detection::Tick,
        entity::{EntityHashMap, EntityHashSet},
        system::SystemChangeTick,
    },
    prelude::*,
};

/// The bakes that go on, in order.
#[derive(Resource, Default)]
pub(crate) struct Bakes {
    pub(super) list: Vec<(Entity, Bake)>,
    /// While the list is worked on: the bakes that were cancelled meanwhile.
    pub(super) cancelled: Option<EntityHashSet>,
    /// Surfaces that were healed since the last look at what is to be baked, and when: what they were given before is not baked any more.
    healed: EntityHashMap<Tick>,
}

/// The component whose cracks are baked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Baked {
    Guided,
    Strands,
    Record,
}

/// A bake that goes on.
pub(super) struct Bake {
    pub(super) kind: Baked,
    pub(super) work: Work,
    /// The surface, if it has not cracked when the bake began.
    pub(super) plan: Option<Box<Plan>>,
    /// How often its surface has changed too late.
    pub(super) rounds: u32,
}

pub(super) enum Work {
    /// Its pictures may not be there yet.
    Wanted,
    /// Pictures are copied.
    Reading(PictureCopies, Box<MapJob>),
    /// Others come first.
    Ready(BakeJob),
    Task(RunningTask<BakeJob>),
    Slices(BakeJob),
    /// Textures are on their way to the renderer, for this many frames.
    Uploading(Box<Finished>, u32),
}

impl Work {
    pub(super) const fn is_running(&self) -> bool {
        matches!(self, Self::Task(_) | Self::Slices(_))
    }
}

impl Bakes {
    /// Begins a bake again.
    fn want(&mut self, entity: Entity, kind: Baked) {
        self.cancel(entity);
        if let Some(cancelled) = &mut self.cancelled {
            cancelled.remove(&entity);
        }
        self.list.push((entity, Bake { kind, work: Work::Wanted, plan: None, rounds: 0 }));
    }

    /// Ends a bake silently.
    pub(crate) fn cancel(&mut self, entity: Entity) {
        self.list.retain(|(baked, _)| *baked != entity);
        if let Some(cancelled) = &mut self.cancelled {
            cancelled.insert(entity);
        }
    }

    /// What was read of the picture before this frame has changed.
    pub(crate) fn forget_picture(&mut self, picture: AssetId<Image>, frame: u64) {
        for (_, Bake { work, plan, .. }) in &mut self.list {
            let is_past = plan.as_mut().is_none_or(|plan| plan.forget_picture(picture, frame));
            if let Work::Reading(reading, _) = work
                && is_past
            {
                reading.forget(picture);
            }
        }
    }
}

/// Whether any bake goes on.
pub(crate) fn any_baking(bakes: Res<Bakes>) -> bool {
    !bakes.list.is_empty()
}

/// No bake any more.
fn reset(progress: &mut Mut<BakeProgress>) {
    progress.set_if_neq(BakeProgress(0.0));
}

/// Ends the bake of a surface that is healed, also one that has not begun.
pub(crate) fn give_up(world: &mut World, entity: Entity) {
    cancel(world, entity);
    // What it is given from now on is newer.
    let now = world.increment_change_tick();
    if let Some(mut bakes) = world.get_resource_mut::<Bakes>() {
        bakes.healed.insert(entity, now);
    }
}

/// Ends the bake of a surface.
pub(crate) fn cancel(world: &mut World, entity: Entity) {
    if let Some(mut bakes) = world.get_resource_mut::<Bakes>() {
        bakes.cancel(entity);
    }
    if let Some(mut progress) = world.get_mut::<BakeProgress>(entity) {
        reset(&mut progress);
    }
}

/// The two parts of a bake, machines that are stepped: between them it is seen what has become of the surface.
pub(super) enum BakeJob {
    Map(Box<MapJob>),
    Finish(Box<Finish>),
}

pub(super) enum StepResult {
    Lines(Lines),
    Surface(Box<Finished>),
}

impl Stepped for BakeJob {
    type Output = StepResult;

    fn step(self) -> Result<Step<Self>, CrackError> {
        Ok(match self {
            Self::Map(mut map) => match map.step()? {
                Some(lines) => Step::Done(StepResult::Lines(lines)),
                None => Step::More(Self::Map(map)),
            },
            Self::Finish(finish) => match finish.step()? {
                FinishStep::More(finish) => Step::More(Self::Finish(finish)),
                FinishStep::Done(finished) => Step::Done(StepResult::Surface(finished)),
            },
        })
    }

    fn progress(&self) -> f32 {
        match self {
            Self::Map(map) => map.progress,
            Self::Finish(_) => MAPPED,
        }
    }
}

/// Surfaces on which a component is new, or that are new.
type Fresh<'w, 's, T> =
    Query<'w, 's, (Entity, Ref<'static, T>, Ref<'static, CrackSurface>), Or<(Changed<T>, Added<CrackSurface>)>>;

/// Notes what is to be baked.
pub(crate) fn watch_baked(
    guided: Fresh<GuidedCracks>,
    strands: Fresh<CrackStrands>,
    mut bakes: ResMut<Bakes>,
    tick: SystemChangeTick,
) {
    let healed = if bakes.healed.is_empty() { default() } else { core::mem::take(&mut bakes.healed) };
    let is_wanted = |entity: Entity, given: [Tick; 2]| {
        let is_newer = |healed: &Tick| given.iter().any(|given| given.is_newer_than(*healed, tick.this_run()));
        healed.get(&entity).is_none_or(is_newer)
    };
    for (entity, guided, surface) in &guided {
        if is_wanted(entity, [guided.last_changed(), surface.added()]) {
            bakes.want(entity, Baked::Guided);
        }
    }
    for (entity, strands, surface) in &strands {
        if is_wanted(entity, [strands.last_changed(), surface.added()]) {
            bakes.want(entity, Baked::Strands);
        }
    }
}

/// Notes the records that are to be taken up, as soon as no other cracks are on their way to their surfaces.
pub(crate) fn watch_records(records: Query<(Entity, Ref<CrackRecord>), With<CrackSurface>>, mut bakes: ResMut<Bakes>) {
    for (entity, record) in &records {
        let under_way = bakes.list.iter().find(|(baked, _)| *baked == entity).map(|(_, bake)| bake.kind);
        match under_way {
            Some(Baked::Guided | Baked::Strands) => {}
            Some(Baked::Record) if !record.is_changed() => {}
            Some(Baked::Record) | None => bakes.want(entity, Baked::Record),
        }
    }
}

/// A component from which cracks are baked.
pub(crate) trait BakedComponent: Component {
    /// Which of them.
    const KIND: Baked;
}

impl BakedComponent for GuidedCracks {
    const KIND: Baked = Baked::Guided;
}

impl BakedComponent for CrackStrands {
    const KIND: Baked = Baked::Strands;
}

impl BakedComponent for CrackRecord {
    const KIND: Baked = Baked::Record;
}

/// A mesh that was laid out for a bake that has come to nothing is so around its first hit.
pub(super) fn forget_layout(world: &mut World, entity: Entity) {
    if !has_cracked(world, entity)
        && let Some(kind) = kinds::inspect(world, entity).0
    {
        kind.forget_layout(world, entity);
    }
}

/// Cancels the bake of a component that goes. The cracks of a bake that is done stay.
pub(crate) fn cancel_removed<T: BakedComponent>(
    removed: On<Remove, T>,
    mut bakes: ResMut<Bakes>,
    mut progress: Query<&mut BakeProgress>,
    mut commands: Commands,
) {
    let is_of_another = |(baked, bake): &(Entity, Bake)| *baked == removed.entity && bake.kind != T::KIND;
    if bakes.list.iter().any(is_of_another) {
        return;
    }
    bakes.cancel(removed.entity);
    let entity = removed.entity;
    commands.queue(move |world: &mut World| forget_layout(world, entity));
    if let Ok(mut progress) = progress.get_mut(removed.entity)
        && progress.0 < 1.0
    {
        reset(&mut progress);
    }
}
