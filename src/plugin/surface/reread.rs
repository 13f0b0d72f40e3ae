//! [`Rereadings`]: pictures of cracked surfaces that have changed are read by background tasks.

use super::active::Active;
use super::picture_plan::{PicturePlan, ReadPictures, Stretch, plan_pictures};
use crate::plugin::api::textures::Maps;
use crate::plugin::api::{CrackBudget, CrackError};
use crate::plugin::carrier::kind::{CarrierKind, Shown};
use crate::plugin::jobs::background::{BackgroundJob, PATIENCE, guarded_as};
use crate::plugin::jobs::copy::{CopyProgress, MAX_BYTES, PictureCopies};
use crate::plugin::jobs::threads::Threads;
use crate::plugin::source::picture::{BaseKey, BasePicture, BasePictures, FrameCount};
use bevy::{ecs::entity::EntityHashMap, platform::time::Instant, prelude::*};
use std::{sync::Arc, time::Duration};

/// Texels up to which a picture is read in the frame.
const MAX_AT_ONCE: usize = 512 * 512;

/// How long a result is kept for surfaces that have asked for it and do not come for it.
const KEPT: Duration = Duration::from_secs(5);

/// Pictures that are being read. What was read before is shown until they are there.
#[derive(Resource, Default)]
pub(crate) struct Rereadings {
    list: Vec<Rereading>,
    /// The frame in which something was last copied, and how many bytes may still be copied in it.
    copied: (u64, usize),
    /// Surfaces whose pictures are not there yet.
    asked: EntityHashMap<Asked>,
}

/// What a surface waits for.
struct Asked {
    key: BaseKey,
    restarts: u32,
    /// How often it has changed before it was there.
    changes: u32,
    at: Instant,
}

/// A picture that has changed so often before it was read, as those of a film do, is read in the frame.
const MAX_CHANGES: u32 = 3;

struct Rereading {
    key: BaseKey,
    stage: Stage,
    since: Instant,
    asked: Instant,
    /// How often it had to begin again.
    restarts: u32,
}

enum Stage {
    /// Pictures are copied; indices of the copies of diffuse, normal and depth.
    Copying(PictureCopies, [Option<usize>; 3]),
    Reading(BackgroundJob<Work, Result<BasePicture, CrackError>>),
    /// A picture has changed since.
    Stale,
}

/// What a task reads.
struct Work {
    plan: PicturePlan,
    copies: Vec<Image>,
    indices: [Option<usize>; 3],
}

impl Work {
    fn read(self) -> Result<BasePicture, CrackError> {
        let Self { plan, copies, indices } = self;
        let read = || plan.read(indices.map(|index| copies.get(index?)));
        guarded_as(|reason| CrackError::Textures { reason }, read)
    }
}

impl Rereadings {
    /// The picture has changed.
    pub(crate) fn forget(&mut self, picture: AssetId<Image>) {
        for reading in self.list.iter_mut().filter(|reading| reading.key.pictures.contains(&Some(picture))) {
            reading.stage = Stage::Stale;
            reading.restarts += 1;
        }
    }
}

/// Reads the pictures of a cracked surface again; `None` if they are not there yet. `other` is how to deal with them if they are not those
/// that it was made from.
pub(crate) fn draft(
    world: &mut World,
    entity: Entity,
    active: &Active,
    other: Option<&dyn CarrierKind>,
    shown: &Shown,
) -> Result<Option<ReadPictures>, CrackError> {
    let kind = other.unwrap_or(active.carrier.kind);
    let aspect = |picture| kind.aspect(world, entity, picture, active.carrier.size);
    let same = active.canvas.unstretched.filter(|_| other.is_none());
    let kept = same.map(|unstretched| (unstretched, active.carrier.whole(active.canvas.base.size).size()));
    let stretch = Stretch {
        aspect: &aspect,
        kept,
        is_twofold: kind.is_twofold(world, entity),
        unfolding: kind.unfolding(world, entity),
    };
    let layer = active.preset.look.layer(0).bytes_per_texel();
    let emissive = active.canvas.textures.emissive.is_some();
    let wanted = Maps { emissive, ..Maps::wanted(active.surface.write, &active.preset.look) };
    let plan = plan_pictures(world, (&active.surface, wanted), shown, &stretch, layer, active.bytes.get())?;
    let Some(plan) = plan else { return Ok(None) };
    Ok(base(world, entity, &plan, shown)?.map(|base| ReadPictures { base, plan }))
}

/// The pictures of a plan, read; `None` if that takes some frames more.
fn base(
    world: &mut World,
    entity: Entity,
    plan: &PicturePlan,
    shown: &Shown,
) -> Result<Option<Arc<BasePicture>>, CrackError> {
    let key = plan.key(shown);
    let is_small = plan.size.as_usizevec2().element_product() <= MAX_AT_ONCE;
    let has_threads = world.resource::<Threads>().pool().is_some();
    if is_small || !has_threads || world.resource::<CrackBudget>().is_unlimited() {
        return plan.clone().draft(world, shown).map(|draft| Some(draft.base));
    }
    if let Some(base) = world.resource::<BasePictures>().find(key) {
        return Ok(Some(base));
    }
    if world.resource_mut::<Rereadings>().changes_often(entity, key) {
        return plan.clone().draft(world, shown).map(|draft| Some(draft.base));
    }
    world.resource_scope(|world, mut readings: Mut<Rereadings>| {
        let base = readings.step(world, plan, shown, key)?;
        if base.is_some() {
            readings.asked.remove(&entity);
        }
        Ok(base)
    })
}

impl Rereadings {
    /// Whether what a surface waits for changes before it is there, time and again.
    fn changes_often(&mut self, entity: Entity, key: BaseKey) -> bool {
        let now = Instant::now();
        self.asked.retain(|_, asked| now - asked.at < KEPT);
        let restarts = self.list.iter().find(|reading| reading.key == key).map_or(0, |reading| reading.restarts);
        let asked = self.asked.entry(entity).or_insert(Asked { key, restarts, changes: 0, at: now });
        if (asked.key, asked.restarts) != (key, restarts) {
            (asked.key, asked.restarts, asked.at) = (key, restarts, now);
            asked.changes = (asked.changes + 1).min(MAX_CHANGES);
        }
        asked.changes == MAX_CHANGES
    }

    fn step(
        &mut self,
        world: &mut World,
        plan: &PicturePlan,
        shown: &Shown,
        key: BaseKey,
    ) -> Result<Option<Arc<BasePicture>>, CrackError> {
        let now = Instant::now();
        self.list.retain(|reading| reading.key == key || now - reading.asked < KEPT);
        let index = self.list.iter().position(|reading| reading.key == key).unwrap_or_else(|| {
            self.list.push(Rereading { key, stage: Stage::Stale, since: now, asked: now, restarts: 0 });
            self.list.len() - 1
        });
        let frame = world.resource::<FrameCount>().0;
        if self.copied.0 != frame {
            self.copied = (frame, MAX_BYTES);
        }
        let Self { list, copied: (_, left), .. } = self;
        let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
        let reading = &mut list[index];
        reading.asked = now;
        if matches!(reading.stage, Stage::Stale) {
            let needed = plan.needed(shown);
            let pictures: Vec<Handle<Image>> = needed.iter().copied().flatten().cloned().collect();
            let mut next = 0..;
            let indices = needed.map(|picture| picture.and_then(|_| next.next()));
            let Some(copies) = PictureCopies::new(pictures, images, true) else { return Ok(None) };
            (reading.stage, reading.since) = (Stage::Copying(copies, indices), now);
        }
        match &mut reading.stage {
            Stage::Copying(copies, indices) => {
                if now - reading.since >= PATIENCE {
                    copies.wait_no_more();
                }
                match copies.step(images, left) {
                    CopyProgress::More => {}
                    CopyProgress::Changed => reading.stage = Stage::Stale,
                    CopyProgress::Done => {
                        let indices = *indices;
                        if let Stage::Copying(copies, _) = core::mem::replace(&mut reading.stage, Stage::Stale) {
                            let work = Work { plan: plan.clone(), copies: copies.finish(), indices };
                            let job = BackgroundJob::start(work, Work::read);
                            (reading.stage, reading.since) = (Stage::Reading(job), now);
                        }
                    }
                }
                Ok(None)
            }
            Stage::Reading(job) => {
                let Some(read) = job.take_if_done(now - reading.since >= PATIENCE) else { return Ok(None) };
                list.swap_remove(index);
                let base = Arc::new(read?);
                world.resource_mut::<BasePictures>().remember(key, &base);
                Ok(Some(base))
            }
            Stage::Stale => Ok(None),
        }
    }
}
