//! What tools see of a surface that games do not: its network, markers and cells in texture coordinates, costs, a film of its growth.

use super::api::textures::MAPS;
use super::api::{CrackBudget, CrackRecord};
use super::carrier::{kind::Found, kinds, space};
use super::gpu::{memory::TextureMemory, textures, uploads::Uploads};
use super::jobs::frame_time::FrameClock;
use super::source::picture::BasePicture;
use super::surface::{active::Active, cracked};
use crate::paint::LookTable;
use crate::pattern::{Moment, Network, SurfaceFrame, Timeline};
use crate::raster::{DepthField, LayerPlan, Profile, Replay, ReplayChanges, TexelRect};
use bevy::prelude::*;
use std::sync::Arc;

/// What a frame has cost so far.
pub(crate) struct FrameCost {
    pub(crate) milliseconds: f32,
    pub(crate) texture_bytes: u64,
    pub(crate) nodes: u64,
    pub(crate) cracked: u32,
}

pub(crate) fn frame_cost(world: &mut World) -> FrameCost {
    let milliseconds = world.get_resource::<FrameClock>().map_or(0.0, FrameClock::milliseconds);
    let texture_bytes = world.get_resource::<TextureMemory>().map_or(0, TextureMemory::used);
    let (mut nodes, mut n_cracked) = (0, 0);
    let mut surfaces = world.query::<&cracked::Cracked>();
    for active in surfaces.iter(world).filter_map(cracked::Cracked::get) {
        nodes += active.cracks.growth.network().nodes().len() as u64;
        n_cracked += 1;
    }
    FrameCost { milliseconds, texture_bytes, nodes, cracked: n_cracked }
}

/// What has happened to a surface; `None` if it has no cracks, or was hit too often.
pub(crate) fn recorded(world: &World, entity: Entity) -> Option<CrackRecord> {
    cracked::active(world, entity)?.record()
}

/// A straight part of a crack.
pub(crate) struct Line {
    /// Its ends, texture coordinates.
    pub(crate) ends: [Vec2; 2],
    /// When it was born, as a share of all steps.
    pub(crate) birth: f32,
}

/// The parts of the network that are shown, `most` at the most.
pub(crate) fn lines(world: &World, entity: Entity, most: usize) -> Vec<Line> {
    let Some(active) = cracked::active(world, entity) else { return Vec::new() };
    let (growth, frame) = (&active.cracks.growth, active.drawing.field.frame);
    let (network, steps) = (growth.network(), growth.steps().max(1) as f32);
    let shown = active.playhead.playback.as_ref().map_or(u32::MAX, |playback| playback.shown.begun());
    let ends = network.segments().filter_map(|segment| network.ends(segment)).take(most);
    let line = |(a, b): (u32, u32)| {
        let [a, b] = [a, b].map(|node| network.nodes().get(node as usize));
        let (a, b) = (a?, b?);
        let birth = a.birth.max(b.birth);
        let ends = [a, b].map(|node| frame.pos_to_uv(node.pos));
        (birth <= shown).then_some(Line { ends, birth: birth as f32 / steps })
    };
    ends.filter_map(line).collect()
}

/// The markers that attract cracks, texture coordinates, `most` at the most.
pub(crate) fn markers(world: &World, entity: Entity, most: usize) -> Vec<Vec2> {
    let Some(active) = cracked::active(world, entity) else { return Vec::new() };
    let frame = active.drawing.field.frame;
    active.cracks.growth.living_markers().take(most).map(|pos| frame.pos_to_uv(pos)).collect()
}

/// Circles around each hit, texture coordinates: its reach, and the distance at which markers are removed.
pub(crate) fn circles(world: &World, entity: Entity) -> Vec<[Vec<Vec2>; 2]> {
    const CORNERS: u32 = 48;
    let Some(active) = cracked::active(world, entity) else { return Vec::new() };
    let (growth, frame) = (&active.cracks.growth, active.drawing.field.frame);
    let params = growth.params();
    let circle = |center: Vec2, radius: f32| {
        let at = |i| center + radius * Vec2::from_angle(core::f32::consts::TAU * i as f32 / CORNERS as f32);
        (0..=CORNERS).map(|i| frame.pos_to_uv(at(i))).collect()
    };
    let hits = growth.impacts().iter();
    hits.map(|hit| [circle(hit.pos, params.reach * hit.energy.sqrt()), circle(hit.pos, params.kill_distance)]).collect()
}

/// The outlines of closed cells, texture coordinates.
pub(crate) fn cells(world: &World, entity: Entity) -> Vec<Vec<Vec2>> {
    let Some(active) = cracked::active(world, entity) else { return Vec::new() };
    let (cells, frame) = (&active.cracks.cells, active.drawing.field.frame);
    let outline = |cell: u32| {
        let points = cells.outline(cell);
        points.into_iter().filter_map(|point| cells.pos(point)).map(|pos| frame.pos_to_uv(pos)).collect::<Vec<_>>()
    };
    (1..cells.cells().len() as u32).map(outline).filter(|outline| outline.len() > 2).collect()
}

/// The rectangles of a surface that were painted in this frame, texture coordinates.
pub(crate) fn dirty_rects(world: &World, entity: Entity) -> Vec<[Vec2; 2]> {
    let (Some(active), Some(uploads)) = (cracked::active(world, entity), world.get_resource::<Uploads>()) else {
        return Vec::new();
    };
    let Some(seen) = active.canvas.seen() else { return Vec::new() };
    let (origin, size) = (seen.min.as_vec2(), seen.size().as_vec2());
    let own: Vec<AssetId<Image>> = active.canvas.textures.handles().take(1).map(Handle::id).collect();
    let uv = |texel: UVec2| (texel.as_vec2() - origin) / size;
    uploads.changed().filter(|(image, _)| own.contains(image)).map(|(_, rect)| [uv(rect.min), uv(rect.max)]).collect()
}

/// Texture coordinates of a point of the world on a surface.
pub(crate) fn uv_at(world: &World, entity: Entity, point: Vec3) -> Option<Vec2> {
    let (Some(kind), Found::Shown(_)) = kinds::inspect(world, entity) else { return None };
    let local = space::to_local(world.get::<GlobalTransform>(entity)?)?.transform_point3(point);
    let size = cracked::active(world, entity).map(|active| active.drawing.field.frame.size());
    kind.locate(world, entity, local, size).ok()
}

/// The growth of a surface as it was when this was made, to draw any moment of it on a background task.
pub(crate) struct Film {
    network: Network,
    timeline: Timeline,
    base: Arc<BasePicture>,
    look: LookTable,
    profile: Profile,
    layer: LayerPlan,
    frame: SurfaceFrame,
    seen: TexelRect,
}

impl Film {
    /// The cracks of a surface; `None` if it has none.
    pub(crate) fn of(world: &World, entity: Entity) -> Option<Self> {
        let Active { cracks, drawing, canvas, preset, surface, .. } = cracked::active(world, entity)?;
        Some(Self {
            network: cracks.growth.network().clone(),
            timeline: cracks.growth.timeline().clone(),
            base: canvas.base.clone(),
            look: canvas.look.clone(),
            profile: drawing.profile,
            layer: preset.look.layer(surface.seed),
            frame: drawing.field.frame,
            seen: canvas.seen()?,
        })
    }

    /// Size of a picture, texels.
    pub(crate) fn size(&self) -> UVec2 {
        self.seen.size()
    }

    /// So many moments from the first to the last: RGBA, 8 bits each.
    pub(crate) fn pictures(&self, count: u32) -> impl Iterator<Item = Vec<u8>> + '_ {
        let mut field = DepthField::new(self.frame);
        field.set_layers(self.layer.clone());
        let mut replay = Replay::new(self.frame.size(), self.profile);
        let mut redrawn = ReplayChanges::default();
        let end = f64::from(self.timeline.end());
        (0..count).map(move |i| {
            let moment = Moment::nearest(end * f64::from(i) / f64::from(count.max(2) - 1));
            replay.show(&mut field, &self.network, &self.timeline, moment, &mut redrawn);
            self.paint(&field)
        })
    }

    fn paint(&self, field: &DepthField) -> Vec<u8> {
        let mut texels = self.base.diffuse.clone();
        let mut maps = [const { None }; MAPS];
        maps[0] = Some(&mut *texels);
        let shown = TexelRect::whole(self.seen.size());
        textures::paint(&self.base, None, field, &self.look, &[shown], self.seen.min, maps);
        let row = 4 * self.seen.size().x as usize;
        let rows = texels.chunks_exact(4 * self.base.size.x as usize);
        let rows = rows.skip(self.seen.min.y as usize).take(self.seen.size().y as usize);
        let left = 4 * self.seen.min.x as usize;
        rows.filter_map(|texels| texels.get(left..left + row)).flatten().copied().collect()
    }
}

/// The limit of a frame, milliseconds.
pub(crate) fn budget(world: &World) -> f32 {
    world.get_resource::<CrackBudget>().map_or(0.0, |budget| budget.milliseconds)
}
