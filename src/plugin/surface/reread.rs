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
use bevy::{platform::time::Instant, prelude::*};
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
}

/// What was read.
pub(crate) struct Reread {
    pub(crate) pictures: ReadPictures,
    /// Whether a picture has changed meanwhile: what was read is shown until it is read again. A film would never be there otherwise.
    pub(crate) has_changed: bool,
}

struct Rereading {
    key: BaseKey,
    stage: Stage,
    since: Instant,
    asked: Instant,
    /// The frame in which it was last copied.
    copied_at: u64,
    /// Whether a picture has changed since.
    has_changed: bool,
}

enum Stage {
    /// Pictures are copied; indices of the copies of diffuse, normal and depth.
    Copying(PictureCopies, [Option<usize>; 3]),
    Reading(BackgroundJob<Work, Result<BasePicture, CrackError>>),
    /// It has changed while it was read. Surfaces that do not show it yet get it.
    Read(Arc<BasePicture>),
    /// Nothing is done.
    Idle,
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
    /// Drops what nobody has come for.
    pub(crate) fn trim(&mut self) {
        if !self.list.is_empty() {
            let now = Instant::now();
            self.list.retain(|reading| now - reading.asked < KEPT);
        }
    }

    /// The picture has changed, `before` this frame.
    pub(crate) fn forget(&mut self, picture: AssetId<Image>, before: u64) {
        for reading in self.list.iter_mut().filter(|reading| reading.key.pictures.contains(&Some(picture))) {
            match &mut reading.stage {
                Stage::Copying(copies, _) => reading.has_changed |= !copies.forget(picture),
                Stage::Reading(_) => reading.has_changed |= reading.copied_at < before,
                Stage::Read(_) => reading.stage = Stage::Idle,
                Stage::Idle => {}
            }
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
) -> Result<Option<Reread>, CrackError> {
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
    let read = base(world, &plan, shown, &active.canvas.base)?;
    Ok(read.map(|(base, has_changed)| Reread { pictures: ReadPictures { base, plan }, has_changed }))
}

/// The pictures of a plan, read, and whether they have changed meanwhile; `None` if that takes some frames more. A surface that shows
/// one that has changed, `known`, wants another.
fn base(
    world: &mut World,
    plan: &PicturePlan,
    shown: &Shown,
    known: &Arc<BasePicture>,
) -> Result<Option<(Arc<BasePicture>, bool)>, CrackError> {
    let key = plan.key(shown);
    let is_small = plan.size.as_usizevec2().element_product() <= MAX_AT_ONCE;
    let has_threads = world.resource::<Threads>().pool().is_some();
    if is_small || !has_threads || world.resource::<CrackBudget>().is_unlimited() {
        return plan.clone().draft(world, shown).map(|draft| Some((draft.base, false)));
    }
    if let Some(base) = world.resource::<BasePictures>().find(key) {
        return Ok(Some((base, false)));
    }
    world.resource_scope(|world, mut readings: Mut<Rereadings>| readings.step(world, plan, shown, (key, known)))
}

impl Rereadings {
    fn step(
        &mut self,
        world: &mut World,
        plan: &PicturePlan,
        shown: &Shown,
        (key, known): (BaseKey, &Arc<BasePicture>),
    ) -> Result<Option<(Arc<BasePicture>, bool)>, CrackError> {
        let now = Instant::now();
        let index = self.list.iter().position(|reading| reading.key == key).unwrap_or_else(|| {
            let stage = Stage::Idle;
            self.list.push(Rereading { key, stage, since: now, asked: now, copied_at: 0, has_changed: false });
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
        let is_known = matches!(&reading.stage, Stage::Read(base) if Arc::ptr_eq(base, known));
        if is_known || matches!(reading.stage, Stage::Idle) {
            let needed = plan.needed(shown);
            let pictures: Vec<Handle<Image>> = needed.iter().copied().flatten().cloned().collect();
            let mut next = 0..;
            let indices = needed.map(|picture| picture.and_then(|_| next.next()));
            let Some(copies) = PictureCopies::new(pictures, images, true) else { return Ok(None) };
            (reading.stage, reading.since) = (Stage::Copying(copies, indices), now);
            reading.has_changed = false;
        }
        match &mut reading.stage {
            Stage::Copying(copies, indices) => {
                if now - reading.since >= PATIENCE {
                    copies.wait_no_more();
                }
                reading.copied_at = frame;
                match copies.step(images, left) {
                    CopyProgress::More => {}
                    CopyProgress::Changed => reading.stage = Stage::Idle,
                    CopyProgress::Done => {
                        let indices = *indices;
                        if let Stage::Copying(copies, _) = core::mem::replace(&mut reading.stage, Stage::Idle) {
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
                let has_changed = reading.has_changed;
                reading.stage = Stage::Idle;
                let base = Arc::new(read?);
                if has_changed {
                    reading.stage = Stage::Read(base.clone());
                } else {
                    list.swap_remove(index);
                    world.resource_mut::<BasePictures>().remember(key, &base);
                }
                Ok(Some((base, has_changed)))
            }
            Stage::Read(base) => Ok(Some((base.clone(), true))),
            Stage::Idle => Ok(None),
        }
    }
}
