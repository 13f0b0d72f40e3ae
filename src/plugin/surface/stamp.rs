//! From networks to depths: what is stamped into the field of a surface.

use super::active::Active;
use super::drawing::Drawing;
use super::stamp_network::stamp_all;
use super::tile_set::Touched;
use crate::pattern::{Moment, PathPoint, SegmentId, SegmentPath};
use crate::raster::{
    DOT_DEPTH, DepthField, Profile, Replay, ReplayChanges, TexelRect, stamp_dot, stamp_path, stamp_path_with,
};
use bevy::prelude::*;

/// Buffers kept from frame to frame.
#[derive(Default)]
pub(crate) struct Scratch {
    segments: Vec<SegmentId>,
    markers: Vec<Vec2>,
    redrawn: ReplayChanges,
    pub(crate) rects: Vec<TexelRect>,
}

/// Segments that are stamped between two looks at the frame's clock.
const SLICE: usize = 64;

/// Stamps what has grown since the last time into the field, or whatever is to be shown, but for what hits have crushed.
pub(crate) fn stamp(active: &mut Active, scratch: &mut Scratch) {
    active.cracks.finish_step();
    stamp_some(active, scratch, || false);
}

/// The same for as much of what has grown as there is time for, a part of a step as well; returns whether that is all.
pub(crate) fn stamp_some(active: &mut Active, scratch: &mut Scratch, is_over: impl Fn() -> bool) -> bool {
    active.turn.is_stamping = false;
    if active.drawing.is_stale {
        stamp_anew(active);
    }
    let moment = active.moment();
    if stamp_motion(active, moment) {
        return true;
    }
    if let Some(playback) = &mut active.playhead.playback {
        let (growth, redrawn) = (&active.cracks.growth, &mut scratch.redrawn);
        playback.replay.show_lines(&mut active.drawing.field, growth.network(), growth.timeline(), moment, redrawn);
        playback.shown = moment;
        active.drawing.touched.follow(redrawn);
        redrawn.changed.iter().for_each(|rect| active.mark(*rect));
        if !redrawn.changed.is_empty() {
            active.stamp_carried();
        }
        return true;
    }
    // Without changes the growth is not even touched: a task may be reading it.
    let has_changed = active.cracks.growth.has_changed();
    loop {
        active.turn.is_stamping = has_changed && active.cracks.growth.take_some_changed(SLICE, &mut scratch.segments);
        let Drawing { field, profile, touched, .. } = &mut active.drawing;
        for segment in scratch.segments.drain(..) {
            if let Some(path) = active.cracks.growth.network().path(segment) {
                touched.mark(stamp_path_with(field, profile, &path, &mut |rect| scratch.rects.push(rect)));
            }
        }
        if !active.turn.is_stamping {
            break;
        }
        scratch.rects.drain(..).for_each(|rect| active.mark_grown(rect));
        if is_over() {
            return false;
        }
    }
    let growth = &active.cracks.growth;
    // Plates close in the order of whole steps.
    if !growth.is_in_step() {
        active.drawing.field.begin_layer(growth.network(), growth.timeline(), moment, &mut scratch.rects);
    }
    scratch.rects.drain(..).for_each(|rect| active.mark_grown(rect));
    if has_changed {
        active.cracks.growth.take_markers(&mut scratch.markers);
    }
    let radius = active.cracks.growth.params().line_width;
    for marker in scratch.markers.drain(..) {
        let rect = stamp_dot(&mut active.drawing.field, marker, radius, DOT_DEPTH);
        active.mark_grown(rect);
    }
    true
}

/// Draws a moment of cracks that move in place of what is in the field; returns whether they do.
fn stamp_motion(active: &mut Active, moment: Moment) -> bool {
    let (frame, drawing) = (active.cracks.motion_at(moment), &mut active.drawing);
    let (Some(frame), Some(playback)) = (frame, &mut active.playhead.playback) else { return false };
    if !frame.draw(&drawing.profile, &mut drawing.field, &mut drawing.touched) {
        return false;
    }
    playback.replay = Replay::stale(drawing.field.frame.size(), drawing.profile);
    playback.shown = moment;
    active.stamp_carried();
    active.mark_all();
    true
}

impl Active {
    /// Finds out what a hit crushes, which counts as part of the hit. It is drawn when the surface is painted.
    pub(crate) fn note_hit(&mut self) {
        if self.playhead.playback.is_none() {
            let moment = self.moment();
            self.drawing.field.follow_hits(self.cracks.growth.timeline(), moment);
        }
    }
}

/// Clears the field and stamps the whole network again; at another time than the end that is left to the next
/// painting.
pub(crate) fn stamp_anew(active: &mut Active) {
    active.cracks.finish_step();
    let frame = active.drawing.field.frame;
    active.drawing.redrawn += 1;
    active.drawing.is_stale = false;
    active.drawing.field.clear();
    active.drawing.touched = Touched::new(frame.size());
    if let Some(frozen) = &active.drawing.frozen {
        frozen.draw(&mut active.drawing.field);
    }
    if let Some(playback) = &mut active.playhead.playback {
        playback.start_over(frame, active.drawing.profile);
        return;
    }
    stamp_all(&active.cracks.growth, &active.drawing.profile, &mut active.drawing.field, &mut active.drawing.touched);
    active.stamp_carried();
}

/// How wide a crack is that was carried on, as a share of the narrowest that grow.
const HAIR: f32 = 0.5;

impl Active {
    /// Draws lines as cracks into the field.
    pub(crate) fn stamp_lines(&mut self, lines: &[Vec<Vec2>]) {
        let width = self.hair();
        let mut rects = Vec::new();
        stamp_hairlines(&mut self.drawing.field, &self.drawing.profile, width, lines, |rect| rects.push(rect));
        rects.into_iter().for_each(|rect| self.mark(rect));
    }

    /// The width of a crack that was carried on, pattern units.
    pub(crate) fn hair(&self) -> f32 {
        HAIR * self.cracks.growth.params().line_width
    }

    /// Draws the cracks that were carried on once more: the field has been drawn again.
    fn stamp_carried(&mut self) {
        for lines in self.drawing.carried.clone() {
            self.stamp_lines(&lines);
        }
    }
}

/// Draws lines as cracks of this width.
pub(crate) fn stamp_hairlines(
    field: &mut DepthField,
    profile: &Profile,
    width: f32,
    lines: &[Vec<Vec2>],
    mut changed: impl FnMut(TexelRect),
) {
    for pair in lines.iter().flat_map(|line| line.windows(2)) {
        let [from, to] = [pair[0], pair[1]].map(|pos| PathPoint { pos, width });
        changed(stamp_path(field, profile, &SegmentPath::straight(from, to)));
    }
}
