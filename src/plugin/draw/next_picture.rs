//! [`NextPicture`]: cracks on another picture are drawn and painted before it is shown.

use super::async_playback::is_much;
use super::frame_job::{FrameJob, Stage, TimelineSnapshot};
use super::running::{News, Running};
use crate::paint::LookTable;
use crate::pattern::{CrackMask, Moment};
use crate::plugin::api::textures::{MAPS, Maps};
use crate::plugin::api::{CrackBudget, CrackError};
use crate::plugin::carrier::kind::{CarrierKind, Shown};
use crate::plugin::gpu::textures;
use crate::plugin::jobs::background::drop_in_background;
use crate::plugin::jobs::frame_time::FrameClock;
use crate::plugin::jobs::threads::Threads;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::frame::profile;
use crate::plugin::surface::picture_plan::ReadPictures;
use crate::plugin::surface::regrow::{OnAnother, Regrown, Regrowth, regrow};
use crate::plugin::surface::tile_set::Touched;
use crate::raster::{DepthField, DirtyTiles, ReplayChanges};
use bevy::{platform::time::Instant, prelude::*};
use core::ops::ControlFlow;
use std::{sync::Arc, time::Duration};

/// How often another picture takes the place of one that is not drawn yet. In a film one that was begun is shown before the next begins.
const MAX_CHANGES: u32 = 3;

/// Cracks that have changed so often before they were drawn are drawn in the frame.
const MAX_RESTARTS: u32 = 3;

/// How long these are remembered.
const KEPT: Duration = Duration::from_secs(5);

/// What a surface is to show, until it is there. What it showed before is shown until then.
#[derive(Component, Default)]
#[component(clone_behavior = Ignore)]
pub(crate) struct NextPicture {
    request: Option<Box<Request>>,
    making: Option<Box<Making>>,
    changes: u32,
    changed: Option<Instant>,
    restarts: u32,
    restarted: Option<Instant>,
}

/// A picture that somebody gave to a surface.
pub(crate) struct Request {
    /// How to deal with it, if the surface was not made from it.
    pub(crate) other: Option<&'static dyn CarrierKind>,
    pub(crate) shown: Shown,
    /// What was read of it, and where it keeps cracks off.
    pub(crate) read: Option<(ReadPictures, Arc<CrackMask>)>,
    /// Whether there is a newer one, which comes after it.
    pub(crate) is_superseded: bool,
}

struct Making {
    inputs: NextInputs,
    seen: Seen,
    regrown: Option<Regrown>,
    job: Running,
}

/// What cracks are drawn and painted on.
pub(crate) struct NextInputs {
    pub(crate) growth: Regrowth,
    pub(crate) maps: Maps,
    pub(crate) look: LookTable,
}

/// What there is to show of a surface: its steps, hits, whether time can be turned back, and what it has forgotten.
#[derive(PartialEq)]
struct Seen(u32, usize, bool, Option<u32>);

/// What a surface shows from now on.
pub(crate) struct NextShown {
    pub(crate) inputs: NextInputs,
    /// Its cracks, if they were grown again for it.
    pub(crate) regrown: Option<Regrown>,
    /// `None` if a frame is to draw it.
    pub(crate) drawn: Option<Drawn>,
}

/// What was drawn and painted.
pub(crate) struct Drawn(Box<FrameJob>);

impl NextInputs {
    fn is_like(&self, other: &Self) -> bool {
        self.maps == other.maps && self.growth.is_like(&other.growth)
    }

    /// Whether cracks with a past that is only known as a picture are where they were: they are not drawn again.
    fn keeps_field(&self, active: &Active) -> bool {
        let drawing = &active.drawing;
        let is_whole = !drawing.is_stale && drawing.carried.is_empty();
        drawing.frozen.is_some() && is_whole && !self.changes_field(active)
    }

    /// Whether the cracks are elsewhere on it, or drawn in another way. What the mask forbids may be elsewhere.
    pub(crate) fn changes_field(&self, active: &Active) -> bool {
        let Regrowth { preset, base, frame, mask, .. } = &self.growth;
        *frame != active.drawing.field.frame
            || !active.cracks.growth.mask().is_empty()
            || !mask.is_empty()
            || profile(preset, base.is_nearest) != active.drawing.profile
    }

    fn job(&self, active: &Active, regrown: Option<&Regrown>) -> Box<FrameJob> {
        let Regrowth { preset, base, rect, frame, seed, mask, .. } = &self.growth;
        let growth = regrown.map_or(&*active.cracks.growth, |regrown| &regrown.growth);
        let is_played = active.playhead.playback.is_some();
        let moment = if is_played { active.moment() } else { Moment::after(growth.timeline().end()) };
        let is_anew = !self.keeps_field(active);
        let field = if is_anew { DepthField::without_texels(*frame) } else { active.drawing.field.clone() };
        let mut kinds = textures::KINDS.iter().map(|kind| (kind.is_wanted)(self.maps));
        Box::new(FrameJob {
            timeline: TimelineSnapshot::of(growth),
            moment,
            base: base.clone(),
            analogy: None,
            look: self.look.clone(),
            maps: [(); MAPS].map(|()| kinds.next().unwrap_or(false)),
            has_mips: self.maps.mips,
            rect: *rect,
            stager: None,
            field,
            ground: is_anew.then(|| (mask.clone(), preset.look.layer(*seed))),
            replay: None,
            profile: profile(preset, base.is_nearest),
            is_anew,
            frozen: regrown.map_or(&active.drawing.frozen, |regrown| &regrown.frozen).clone(),
            carried: (Vec::new(), 0.0),
            holes: None,
            motion: active.cracks.motion_at(moment).filter(|_| is_played),
            touched: Touched::default(),
            back: None,
            dirty: DirtyTiles::new(frame.size()),
            redrawn: ReplayChanges::default(),
            stage: Stage::Begin,
            changed: Vec::new(),
            staged: [const { None }; MAPS],
        })
    }
}

impl Seen {
    fn of(active: &Active) -> Self {
        let (growth, frozen) = (&active.cracks.growth, active.drawing.frozen.as_ref());
        let is_played = active.playhead.playback.is_some();
        Self(growth.steps_made(), growth.impacts().len(), is_played, frozen.map(|frozen| frozen.nodes))
    }
}

/// The picture that a surface is to show: the `latest`, or one that was begun before it and has given way to others often enough.
/// `has_changed` if texels of the picture have.
pub(crate) fn request(world: &mut World, entity: Entity, latest: Request, has_changed: bool) -> Request {
    let Some(mut next) = next_of(world, entity) else { return latest };
    let Some(request) = next.request.take() else { return latest };
    let is_like = request.shown == latest.shown && request.other.is_some() == latest.other.is_some();
    if is_like && !has_changed {
        return *request;
    }
    next.changed = Some(Instant::now());
    if next.changes >= MAX_CHANGES && request.shown.asset.type_id() == latest.shown.asset.type_id() {
        return Request { is_superseded: true, ..*request };
    }
    next.changes += 1;
    latest
}

/// It is not there yet.
pub(crate) fn put_back(world: &mut World, entity: Entity, request: Request) {
    if let Some(mut next) = world.get_mut::<NextPicture>(entity) {
        next.request = Some(Box::new(request));
    }
}

/// What was read may be read in another way from now on.
pub(crate) fn read_again(world: &mut World, entity: Entity) {
    if let Some(request) = world.get_mut::<NextPicture>(entity).as_mut().and_then(|next| next.request.as_mut()) {
        request.read = None;
    }
}

/// Goes on with the cracks on another picture: they are grown again if it has other proportions, and then drawn and painted, by a task if that
/// takes longer than a frame has and what was shown before still is, so that it `may_wait`. They do not grow while they are drawn. `None` if
/// it is not there yet.
pub(crate) fn make(
    world: &mut World,
    entity: Entity,
    active: &mut Active,
    inputs: NextInputs,
    may_wait: bool,
) -> Result<Option<NextShown>, CrackError> {
    let inputs = match go_on(world, entity, active, inputs) {
        ControlFlow::Break(next) => return Ok(next),
        ControlFlow::Continue(inputs) => inputs,
    };
    let has_threads = world.resource::<Threads>().pool().is_some();
    let is_unlimited = world.resource::<CrackBudget>().is_unlimited();
    let mut regrown = match regrow(active, inputs.growth.clone(), !has_threads || is_unlimited)? {
        OnAnother::Same => None,
        OnAnother::Grown(regrown) => Some(*regrown),
        OnAnother::Wait => return Ok(None),
    };
    let growth = regrown.as_ref().map_or(&*active.cracks.growth, |regrown| &regrown.growth);
    let is_for_frame = !may_wait || is_unlimited || !is_much(growth, inputs.growth.frame.size());
    let next = next_of(world, entity).filter(|next| !is_for_frame && next.restarts <= MAX_RESTARTS);
    let Some(mut next) = next else { return Ok(Some(NextShown { inputs, regrown, drawn: None })) };
    active.turn.is_held = true;
    if active.turn.is_dirty && inputs.keeps_field(active) {
        // All that has grown is drawn first.
        return Ok(None);
    }
    if let Some(Regrown { growth, .. }) = &mut regrown {
        // All of it will be drawn.
        growth.take_changed(&mut Vec::new());
        growth.take_markers(&mut Vec::new());
    }
    active.drawing.redrawn += 1;
    let job = Running::start(inputs.job(active, regrown.as_ref()), has_threads);
    next.making = Some(Box::new(Making { inputs, seen: Seen::of(active), regrown, job }));
    Ok(None)
}

fn next_of(world: &mut World, entity: Entity) -> Option<Mut<'_, NextPicture>> {
    let mut next = world.get_mut::<NextPicture>(entity)?;
    let is_over = |at: Option<Instant>| at.is_some_and(|at| at.elapsed() >= KEPT);
    if is_over(next.restarted) {
        next.restarts = 0;
    }
    if is_over(next.changed) {
        next.changes = 0;
    }
    Some(next)
}

/// What has become of it, `None` if it is not there yet; `Continue` if nothing is made that is to be shown.
fn go_on(
    world: &mut World,
    entity: Entity,
    active: &mut Active,
    inputs: NextInputs,
) -> ControlFlow<Option<NextShown>, NextInputs> {
    let timer = world.resource::<FrameClock>().start(world.resource::<CrackBudget>(), 1.0);
    let Some(mut next) = world.get_mut::<NextPicture>(entity) else { return ControlFlow::Continue(inputs) };
    let Some(making) = next.making.take() else { return ControlFlow::Continue(inputs) };
    let Making { inputs: before, seen, regrown, job } = *making;
    let is_same = inputs.is_like(&before) && seen == Seen::of(active);
    match is_same.then(|| job.look(&timer)) {
        Some(News::Running(job)) => {
            next.making = Some(Box::new(Making { inputs, seen, regrown, job }));
            active.turn.is_held = true;
            ControlFlow::Break(None)
        }
        Some(News::Made(job)) => ControlFlow::Break(Some(NextShown { inputs, regrown, drawn: Some(Drawn(job)) })),
        lost => {
            (next.restarts, next.restarted) = (next.restarts + 1, Some(Instant::now()));
            if lost.is_some() {
                next.restarts = MAX_RESTARTS + 1;
            }
            ControlFlow::Continue(inputs)
        }
    }
}

/// Gives up what a surface was to show.
pub(crate) fn give_up(world: &mut World, entity: Entity) {
    if let Some(mut next) = world.get_mut::<NextPicture>(entity) {
        drop_in_background((next.making.take(), next.request.take()));
    }
}

impl Drawn {
    /// Apart from the texels of its textures.
    pub(crate) fn split(mut self) -> (Option<Self>, [Option<Vec<u8>>; MAPS]) {
        let texels = self.0.back.take().map(|back| back.texels);
        (Some(self), texels.unwrap_or_default())
    }

    /// Gives a surface what was drawn for it.
    pub(crate) fn put_on(self, active: &mut Active) {
        let FrameJob { is_anew, field, replay, touched, profile, moment, .. } = *self.0;
        if !is_anew {
            return;
        }
        let before = core::mem::replace(&mut active.drawing.field, field);
        (active.drawing.touched, active.drawing.profile, active.drawing.is_stale) = (touched, profile, false);
        if let (Some(playback), Some(replay)) = (&mut active.playhead.playback, replay) {
            (playback.replay, playback.shown) = (replay, moment);
        }
        drop_in_background(before);
    }
}
