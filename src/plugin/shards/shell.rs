//! Surfaces that are laid out flat shatter as shells: which of their pieces leave, and how each is thrown.

use super::broken::{Broken, BrokenShell};
use super::spans::fringe;
use super::throw::Throw;
use crate::Grid;
use crate::pattern::SurfaceFrame;
use crate::plugin::carrier::kind::CarrierKind;
use crate::plugin::carrier::plane::Plane;
use crate::plugin::source::picture::BasePicture;
use crate::plugin::surface::cutouts::Span;
use crate::shatter::{Anchor, Burst, Fallen, Shards, ShatterError, Shell, ShellTriangle, Support};
use bevy::prelude::*;
use std::sync::Arc;

/// The largest reach of a blow, pattern units: no flat surface is larger.
pub(super) const MOST_REACH: f32 = 64.0;

/// What is known of a shell when it is to shatter.
pub(super) struct ShellOrder {
    source: ShellSource,
    throw: Throw,
    place: Option<GlobalTransform>,
    /// Of the blow, in the entity's own space.
    direction: Vec3,
    energy: f32,
}

enum ShellSource {
    /// It has shattered before.
    Known(BrokenShell),
    New(Vec<ShellTriangle>),
}

impl ShellOrder {
    /// Looks at an entity whose mesh is laid out.
    pub(super) fn of(
        world: &World,
        entity: Entity,
        kind: &dyn CarrierKind,
        broken: Option<&Broken>,
        (throw, direction, energy): (Throw, Vec3, f32),
    ) -> Result<Self, &'static str> {
        let source = match broken.and_then(|broken| broken.shell.clone()) {
            Some(known) => ShellSource::Known(known),
            None => ShellSource::New(kind.triangles(world, entity).ok_or("its mesh cannot be read")?),
        };
        Ok(Self { source, throw, place: world.get(entity).copied(), direction, energy })
    }

    /// The shell in a plane of `extent`, hit at `from`, pattern units.
    pub(super) fn shape(self, extent: Vec2, from: Vec2) -> CutShell {
        let Self { source, throw, place, direction, energy } = self;
        let shell = match source {
            ShellSource::Known(shell) => shell,
            // Its fringe is found when it is cut.
            ShellSource::New(triangles) => BrokenShell {
                shape: Arc::new(Shell::new(extent, triangles)),
                fringe: Arc::new(Grid::new(UVec2::ONE, false)),
            },
        };
        let hit = shell.shape.place(from);
        let at = hit.map_or(Vec3::ZERO, |hit| hit.position);
        let unit = hit.map_or(1.0, |hit| (hit.right.length() * hit.down.length()).sqrt());
        // A hit without a direction is straight at its place, for all pieces, wherever they face.
        let direction = direction.try_normalize().or(hit.map(|hit| -hit.normal)).unwrap_or(Vec3::ZERO);
        CutShell { shell, throw, place, direction, energy, extent, from, at, unit }
    }
}

/// A shell that is cut.
pub(super) struct CutShell {
    pub(super) shell: BrokenShell,
    throw: Throw,
    place: Option<GlobalTransform>,
    direction: Vec3,
    energy: f32,
    extent: Vec2,
    /// Where it is hit, pattern units.
    from: Vec2,
    /// The same in the entity's own space, and the length of a pattern unit there.
    at: Vec3,
    unit: f32,
}

impl CutShell {
    /// What lies where nothing is laid out is no piece; pieces beside that are held, unless nothing is to hold any.
    pub(super) fn hold(&mut self, cut: &Shards, support: &mut Support, anchor: Anchor, frame: SurfaceFrame) {
        let is_piece = |shard: u32| cut.inner_point(shard).is_some_and(|at| self.shell.shape.place(at).is_some());
        let gaps: Vec<u32> = (0..cut.len() as u32).filter(|shard| !is_piece(*shard)).collect();
        if !matches!(anchor, Anchor::Nothing | Anchor::Sides([false, false, false, false])) {
            support.hold_shards(gaps.iter().flat_map(|gap| cut.neighbours(*gap)).map(|neighbour| neighbour.shard));
        }
        self.shell.fringe = Arc::new(fringe(cut, &gaps, frame));
        support.remove(gaps);
    }

    /// Knocks out what lies within `reach` through space.
    pub(super) fn hit(
        &self,
        cut: &Shards,
        support: &mut Support,
        from: Vec2,
        reach: f32,
    ) -> Result<Fallen, ShatterError> {
        support.hit_by(cut, reach, |shard| {
            if cut.distance(shard, from) == 0.0 {
                return 0.0;
            }
            let away = self.shell.shape.distance(cut, shard, self.at).map_or(f32::INFINITY, |away| away / self.unit);
            // All of it, however large.
            if reach >= MOST_REACH { away.min(MOST_REACH) } else { away }
        })
    }

    /// The plane of a piece, and what throws it; `None` where nothing is laid out.
    pub(super) fn thrown(&self, cut: &Shards, shard: u32) -> Option<Result<(Plane, Burst), ShatterError>> {
        let at = cut.inner_point(shard)?;
        let plane = Plane::on(&self.shell.shape.place(at)?, at, self.extent)?;
        let direction = plane.rotation.inverse() * self.direction;
        let corners =
            cut.corners(shard).iter().filter_map(|&corner| self.shell.shape.place(cut.positions()[corner as usize]));
        let height = |position: Vec3| plane.flight_axes(position, self.extent).z;
        let depth = corners.map(|corner| -height(corner.position)).fold(0.0, f32::max).min(MOST_REACH);
        let throw = Throw { depth, ..self.throw };
        let burst = throw.burst(self.place.as_ref(), (&plane, self.extent), (self.from, direction, self.energy));
        Some(burst.map(|burst| (plane, burst.with_origin(plane.flight_axes(self.at, self.extent)))))
    }

    /// Adds the texels that show nothing of the mesh: seen at a low angle, parallax finds them beyond its border.
    pub(super) fn add_gaps(&self, spans: &mut Vec<Span>, base: &BasePicture) {
        let size = self.shell.fringe.size();
        for y in 0..size.y {
            let is_gap = |x: &u32| self.shell.fringe.get(*x, y) == Some(true) && base.is_hole(UVec2::new(*x, y));
            spans.extend((0..size.x).filter(is_gap).map(|x| [y, x, x + 1]));
        }
    }
}
