//! The painting system: networks to texels.

use super::{
    CrackBudget, CrackFinished, CrackState, CrackStatus, CrackTextures, CrackTip,
    budget::FrameClock,
    surfaces::{Active, Surfaces},
    upload::Uploads,
};
use crate::{
    paint::{BaseTexels, PaintTargets, paint_into},
    pattern::{NO_PARENT, SegmentId},
    raster::{TexelRect, stamp_dot, stamp_path},
};
use bevy::prelude::*;

/// Depth of the dots that `draw_markers` asks for.
const MARKER_DEPTH: f32 = 0.5;

/// Buffers kept from frame to frame.
#[derive(Default)]
pub(super) struct Scratch {
    segments: Vec<SegmentId>,
    markers: Vec<Vec2>,
    rects: Vec<TexelRect>,
}

/// Paints what has changed, surface after surface, at least one, until the budget is spent.
pub(super) fn paint_surfaces(
    mut commands: Commands,
    budget: Res<CrackBudget>,
    mut clock: ResMut<FrameClock>,
    mut surfaces: ResMut<Surfaces>,
    mut uploads: ResMut<Uploads>,
    images: Option<ResMut<Assets<Image>>>,
    mut states: Query<&mut CrackState>,
    mut scratch: Local<Scratch>,
) {
    if surfaces.dirty.is_empty() {
        return;
    }
    let Some(mut images) = images else { return };
    let timer = clock.start(&budget, 1.0);
    let Surfaces { active, dirty, .. } = &mut *surfaces;
    while let Some(entity) = dirty.pop_front() {
        let Some(active) = active.get_mut(&entity) else { continue };
        active.is_dirty = false;
        stamp(active, &mut scratch);
        paint(active, &mut images, &mut uploads, &mut scratch.rects);
        let is_done = !active.is_growing && active.is_open;
        if let Ok(mut state) = states.get_mut(entity) {
            tell(active, &mut state, is_done);
        }
        if is_done {
            active.is_open = false;
            commands.trigger(CrackFinished { entity });
        }
        if timer.is_over() {
            break;
        }
    }
    clock.stop(&timer);
}

/// Stamps what has grown since the last time into the field.
fn stamp(active: &mut Active, scratch: &mut Scratch) {
    active.growth.take_changed(&mut scratch.segments);
    for segment in scratch.segments.drain(..) {
        if let Some(path) = active.growth.network().path(segment) {
            let rect = stamp_path(&mut active.field, &active.profile, &path);
            active.touched.mark(rect);
            active.mark(rect);
        }
    }
    active.growth.take_markers(&mut scratch.markers);
    let radius = active.growth.params().line_width;
    for marker in scratch.markers.drain(..) {
        let rect = stamp_dot(&mut active.field, marker, radius, MARKER_DEPTH);
        active.mark(rect);
    }
}

/// Stamps the whole network into the field anew.
pub(super) fn stamp_all(active: &mut Active) {
    let network = active.growth.network();
    for segment in network.segments() {
        if let Some(path) = network.path(segment) {
            let rect = stamp_path(&mut active.field, &active.profile, &path);
            active.touched.mark(rect);
        }
    }
}

/// Paints the dirty texels of the view that is shown and asks for their upload.
fn paint(active: &mut Active, images: &mut Assets<Image>, uploads: &mut Uploads, rects: &mut Vec<TexelRect>) {
    let size = active.base.size;
    let Some(view) = active.views.get_mut(active.view) else { return };
    view.dirty.take_rects(rects);
    if rects.is_empty() {
        return;
    }
    let origin = view.rect.min;
    let shown = TexelRect::whole(view.rect.size());
    let CrackTextures { diffuse, normal, depth } = &active.textures;
    // Three images of one collection cannot be borrowed at once: their data is taken out and put back.
    let mut diffuse_data = take_data(images, diffuse.as_ref());
    let mut normal_data = take_data(images, normal.as_ref());
    let mut depth_data = take_data(images, depth.as_ref());
    let base = BaseTexels {
        size,
        diffuse: &active.base.diffuse,
        normal: active.base.normal.as_deref(),
        depth: active.base.depth.as_deref(),
    };
    let mut targets = PaintTargets {
        diffuse: diffuse_data.as_deref_mut(),
        normal: normal_data.as_deref_mut(),
        depth: depth_data.as_deref_mut(),
    };
    for rect in rects.drain(..) {
        let rect = rect.intersect(shown);
        paint_into(base, &active.field, &active.look, rect, origin, &mut targets);
        let rect = TexelRect { min: rect.min + origin, max: rect.max + origin }.intersect(TexelRect::whole(size));
        for texture in active.textures.handles() {
            uploads.push(texture.id(), rect);
        }
    }
    put_data(images, diffuse.as_ref(), diffuse_data);
    put_data(images, normal.as_ref(), normal_data);
    put_data(images, depth.as_ref(), depth_data);
}

/// Texels are changed without an asset event, which would upload the whole image.
fn take_data(images: &mut Assets<Image>, texture: Option<&Handle<Image>>) -> Option<Vec<u8>> {
    images.get_mut_untracked(texture?)?.data.take()
}

fn put_data(images: &mut Assets<Image>, texture: Option<&Handle<Image>>, data: Option<Vec<u8>>) {
    if let Some(texture) = texture
        && let Some(image) = images.get_mut_untracked(texture)
    {
        image.data = data;
    }
}

/// Writes down how the surface is doing.
fn tell(active: &mut Active, state: &mut CrackState, is_done: bool) {
    let network = active.growth.network();
    let nodes = network.nodes();
    state.damage = active.touched.share();
    state.nodes = u32::try_from(nodes.len()).unwrap_or(u32::MAX);
    state.hits = active.hits;
    state.tips.clear();
    if is_done {
        state.status = CrackStatus::Done;
    } else {
        let first = active.tips_from.max(nodes.len().saturating_sub(CrackState::MAX_TIPS)).min(nodes.len());
        state.tips.extend(nodes[first..].iter().filter(|node| node.parent != NO_PARENT).map(|node| CrackTip {
            uv: active.field.frame.pos_to_uv(node.pos),
            direction: (node.pos - nodes[node.parent as usize].pos).normalize_or_zero(),
        }));
    }
    active.tips_from = nodes.len();
}
