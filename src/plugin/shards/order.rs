//! From a surface to its shards, in the background: nothing here touches the world but [`ShatterJob::of`], which looks at it.

use super::batch::{Batch, Leaving};
use super::broken::{Broken, BrokenShell, broken};
use super::crumbs::{Crumb, CrumbParams, Loose, MOST_IN_FRAME};
use super::drawn::{Drawn, Sketch};
use super::form::Style;
use super::shell::{MOST_REACH, ShellOrder};
use super::spans::{Scan, add_fringe, join_spans};
use super::throw::{Throw, in_own_space};
use crate::Grid;
use crate::math::mix;
use crate::pattern::{Network, SurfaceFrame};
use crate::plugin::api::shatter::rim_for;
use crate::plugin::api::{CrackBudget, CrackChips, ShardsError, ShatterCracks, ShatterRequest};
use crate::plugin::carrier::plane::Plane;
use crate::plugin::jobs::background::guarded_as;
use crate::plugin::source::mask;
use crate::plugin::source::picture::BasePicture;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cutouts::{Holes, Span};
use crate::raster::{DirtyTiles, TexelRect};
use crate::shatter::{Anchor, Burst, Cuts, RimLook, Shards, ShatterError, Support, shatter};
use bevy::prelude::*;
use std::{collections::VecDeque, sync::Arc};

/// The most shards that become entities in one frame, of all surfaces together, unless frames may take any time. Fewer would be seen to
/// come late: a burst stands for 0.15 s before its pieces move.
pub(super) const MOST_NEW: usize = 256;

/// What a surface is to lose, and all that was to be known of it when that was asked for.
pub(super) struct ShatterJob {
    /// What the surface was then, see [`Active::revision`].
    revision: Arc<()>,
    settings: ShatterCracks,
    /// What holds the surface besides: lighter than half.
    held: Option<Grid<f32>>,
    rim: RimLook,
    plane: Plane,
    is_solid: bool,
    from: Vec2,
    reach: f32,
    burst: Burst,
    /// The shape of what is not flat.
    shell: Option<ShellOrder>,
    /// The surface's.
    seed: u64,
    /// Nodes and links of the network.
    grown: (usize, usize),
    pieces: CutFrom,
    /// Which crumbs come off its shards.
    crumbs: Option<CrumbParams>,
    /// Whether it is whole.
    is_first: bool,
    sketch: Option<Sketch>,
    /// Pieces that were released before.
    released: u32,
    /// The most that leave in one frame.
    batch: usize,
    holes: Option<Holes>,
    base: Arc<BasePicture>,
    frame: SurfaceFrame,
    view: TexelRect,
    alpha_mask: bool,
}

/// Where the pieces come from.
enum CutFrom {
    /// What has been cut stays cut, and what held it holds it.
    Cut(Arc<Shards>, Support),
    /// The same, but something else holds it.
    Held(Arc<Shards>, Support),
    /// There is more to cut along: a network, and what was carried on. What it was cut into before, and what held.
    Lines(Network, Vec<Arc<[Vec<Vec2>]>>, Option<(Arc<Shards>, Support)>),
}

/// What leaves a surface.
pub(super) struct CutSurface {
    revision: Arc<()>,
    pub(super) settings: ShatterCracks,
    pub(super) rim: RimLook,
    pub(super) plane: Plane,
    pub(super) shell: Option<BrokenShell>,
    pub(super) grown: (usize, usize),
    pub(super) cut: Arc<Shards>,
    /// Whether it was cut again.
    pub(super) is_new: bool,
    pub(super) support: Support,
    /// What leaves, frame by frame.
    pub(super) batches: VecDeque<Batch>,
    pub(super) crumbs: Option<CrumbParams>,
    /// The cracks that were carried on.
    pub(super) drawn: Option<Drawn>,
    /// Where cracks may go when all have left.
    pub(super) density: Option<Grid<f32>>,
    /// Memory for a copy of the picture, written once: the first write page-faults.
    pub(super) room: Vec<u8>,
}

impl CutSurface {
    /// Whether the surface is still what it was.
    pub(super) fn fits(&self, active: &Active) -> bool {
        Arc::ptr_eq(&self.revision, &active.revision)
    }
}

/// Where an image holds a surface.
fn anchor_mask(world: &World, mask: &Handle<Image>) -> Result<Grid<f32>, ShardsError> {
    let refused = |reason: String| ShardsError::AnchorMask { reason };
    let image = world.get_resource::<Assets<Image>>().and_then(|images| images.get(mask));
    let image = image.ok_or_else(|| refused("it is not loaded".to_owned()))?;
    mask::layer(image).map_err(|error| refused(error.to_string()))
}

impl ShatterJob {
    /// Looks at a surface.
    pub(super) fn of(
        world: &World,
        entity: Entity,
        active: &Active,
        request: &ShatterRequest,
    ) -> Result<Self, ShardsError> {
        let mut settings = world.get::<ShatterCracks>(entity).cloned().unwrap_or_default();
        let budget = world.resource::<CrackBudget>();
        let is_everything = request.reach == f32::INFINITY;
        if is_everything {
            settings.cut.extend_cracks = true;
            (settings.anchor, settings.anchor_mask) = (Anchor::Nothing, None);
        }
        let unfolding = active.carrier.unfolding.clone();
        if unfolding.is_some() {
            // It does not fit the layout.
            settings.anchor_mask = None;
        }
        // Fewer and larger ones, rather than some that nobody sees.
        settings.cut.max_shards =
            settings.cut.max_shards.min(u32::try_from(budget.max_shards).unwrap_or(u32::MAX).max(1));
        request.validate()?;
        if !(0.0..=10.0).contains(&settings.thickness) {
            let value = f64::from(settings.thickness);
            let name = "thickness";
            return Err(ShatterError::OutOfRange { name, value, min: 0.0, max: 10.0 }.into());
        }
        let rim = rim_for(&settings, &active.preset.look);
        rim.validate()?;
        if let Some(again) = settings.again {
            again.validate()?;
        }
        let held = settings.anchor_mask.as_ref().map(|mask| anchor_mask(world, mask)).transpose()?;
        let network = active.cracks.growth.network();
        let extent = network.extent();
        let (pos, energy, direction) =
            active.cracks.last_hit.map_or((0.5 * extent, 1.0, Vec3::ZERO), |hit| (hit.pos, hit.energy, hit.direction));
        let broken = broken(world, entity);
        let refused = |reason| ShardsError::NotFlat { reason };
        let seen = active.canvas.seen().ok_or(refused("it shows nothing"))?;
        let kind = active.carrier.kind;
        let (from, plane) = match &unfolding {
            Some(unfolding) => {
                let texel = match request.uv {
                    Some(uv) => kind.texel_of(world, entity, uv),
                    None => Some(pos * unfolding.unit),
                };
                let place = texel.and_then(|texel| Some((texel, kind.plane_at(world, entity, texel)?)));
                let (texel, plane) = place.ok_or(refused("nothing of its mesh is there"))?;
                // Pieces that are out already keep theirs.
                let same = broken.filter(|broken| broken.settings.thickness == settings.thickness);
                let thickness = same.map_or_else(
                    || plane.thickness(settings.thickness, extent),
                    |same| same.plane.thickness(0.0, extent),
                );
                (texel / unfolding.unit, Plane { thickness: Some(thickness), ..plane })
            }
            None => (request.uv.map_or(pos, |uv| uv * extent), kind.plane(world, entity, seen).map_err(refused)?),
        };
        let own_direction = in_own_space(world, entity, request.direction.unwrap_or(direction));
        let direction = plane.rotation.inverse() * own_direction;
        let released = broken.map_or(0, |broken| broken.released);
        let seed = active.surface.seed;
        let energy = request.energy.unwrap_or(energy);
        let throw = Throw {
            params: settings.burst,
            gravity: settings.gravity,
            floor: settings.floor,
            thickness: active.carrier.is_solid.then(|| plane.thickness(settings.thickness, extent)),
            depth: 0.0,
            seed: seed ^ u64::from(released),
        };
        let place = world.get::<GlobalTransform>(entity);
        let burst = throw.burst(place, (&plane, extent), (from, direction, energy))?;
        let order = |_| ShellOrder::of(world, entity, kind, broken, (throw, own_direction, energy));
        let shell = unfolding.map(order).transpose().map_err(refused)?;
        let grown = (network.nodes().len(), network.links().len());
        let same = |broken: &Broken| broken.grown == grown && broken.settings.cut == settings.cut;
        let pieces = match broken {
            Some(broken)
                if same(broken)
                    && (broken.settings.anchor, &broken.settings.anchor_mask)
                        == (settings.anchor, &settings.anchor_mask) =>
            {
                CutFrom::Cut(broken.cut.clone(), broken.support.clone())
            }
            Some(broken) if same(broken) => CutFrom::Held(broken.cut.clone(), broken.support.clone()),
            Some(Broken { cut, support, .. }) => {
                let carried = &active.drawing.carried;
                CutFrom::Lines(network.clone(), carried.clone(), Some((cut.clone(), support.clone())))
            }
            None => CutFrom::Lines(network.clone(), Vec::new(), None),
        };
        let is_sketched = settings.cut.extend_cracks && matches!(pieces, CutFrom::Lines(..));
        Ok(Self {
            revision: active.revision.clone(),
            rim,
            plane,
            is_solid: active.carrier.is_solid,
            from,
            reach: if is_everything { MOST_REACH } else { request.reach },
            burst,
            shell,
            seed,
            grown,
            pieces,
            crumbs: world.get::<CrackChips>(entity).and_then(CrumbParams::of),
            is_first: broken.is_none(),
            sketch: if is_sketched { Sketch::new(active) } else { None },
            released,
            batch: if budget.is_unlimited() { usize::MAX } else { MOST_NEW },
            holes: active.drawing.cutouts.clone(),
            base: active.canvas.base.clone(),
            frame: active.drawing.field.frame,
            view: active
                .canvas
                .views
                .get(active.canvas.view)
                .map_or(TexelRect::whole(active.canvas.base.size), |view| view.rect),
            alpha_mask: active.surface.alpha_mask,
            held,
            settings,
        })
    }

    /// Makes all that needs no world. A panic is an error.
    pub(super) fn make(self) -> Result<CutSurface, ShardsError> {
        guarded_as(|reason| ShardsError::Failed { reason }, || self.cut())
    }

    fn cut(self) -> Result<CutSurface, ShardsError> {
        let is_new = matches!(self.pieces, CutFrom::Lines(..));
        let is_kept = matches!(self.pieces, CutFrom::Cut(..));
        let extent = self.frame.extent();
        let mut curved = self.shell.map(|order| order.shape(extent, self.from));
        let (cut, mut support) = match self.pieces {
            CutFrom::Cut(cut, support) => (cut, support),
            CutFrom::Held(cut, support) => {
                let support = support.held_by(&cut, self.settings.anchor);
                (cut, support)
            }
            CutFrom::Lines(network, carried, before) => {
                let mut cuts = Cuts::from_network(&network)?;
                for line in carried.iter().flat_map(|lines| lines.iter()) {
                    cuts.add_line(line)?;
                }
                for edge in curved.iter().flat_map(|curved| curved.shell.shape.border()) {
                    cuts.add_line(&edge)?;
                }
                let cut = Arc::new(shatter(cuts, &self.settings.cut)?);
                let support = match before {
                    Some((old, support)) => support.after_new_cracks(&old, &cut, self.settings.anchor),
                    None => Support::new(&cut, self.settings.anchor),
                };
                (cut, support)
            }
        };
        if let Some(held) = self.held.filter(|_| !is_kept) {
            let (extent, size) = (cut.extent(), held.size().as_vec2());
            support.hold(&cut, |pos| {
                let texel = (pos / extent * size).max(Vec2::ZERO).as_uvec2().min(held.size() - 1);
                held.get(texel.x, texel.y).is_some_and(|value| value > 0.5)
            });
        }
        if let Some(curved) = curved.as_mut().filter(|_| !is_kept) {
            curved.hold(&cut, &mut support, self.settings.anchor, self.frame);
        }
        let fallen = match &curved {
            Some(curved) => curved.hit(&cut, &mut support, self.from, self.reach)?,
            None => support.hit(&cut, self.from, self.reach)?,
        };
        let (frame, settings) = (self.frame, self.settings);
        let size = self.base.size.as_vec2();
        let uv = [self.view.min.as_vec2() / size, self.view.max.as_vec2() / size];
        let thickness = self.plane.thickness(settings.thickness, cut.extent());
        let shape = curved.as_ref().map(|curved| curved.shell.shape.clone());
        let style = Style { rim: self.rim, thickness: self.is_solid.then_some(thickness), shell: shape };
        let mut holes = self.holes.unwrap_or_else(|| Holes::new(frame.size()));
        let mut scan = Scan::new(frame);
        let is_seen = |&[y, from, to]: &Span| (from..to).any(|x| !self.base.is_hole(self.view.min + UVec2::new(x, y)));
        let falls = fallen.hit.iter().map(|_| false).chain(fallen.loose.iter().map(|_| true));
        let mut leaving = Vec::with_capacity(fallen.hit.len() + fallen.loose.len());
        for ((&number, is_falling), nth) in fallen.hit.iter().chain(&fallen.loose).zip(falls).zip(self.released..) {
            let Some(shard) = cut.get(number) else { continue };
            let thrown = curved.as_ref().and_then(|curved| curved.thrown(&cut, number)).transpose()?;
            let (plane, burst) = thrown.unwrap_or_else(|| (self.plane, self.burst.clone()));
            let flight = if is_falling { burst.fall(nth, shard) } else { burst.flight(nth, shard) };
            let seed = mix(self.seed ^ mix(u64::from(nth)));
            let again = settings.again.and_then(|again| Some((again, flight.delay + again.due(shard.area, seed)?)));
            let mut spans = Vec::new();
            scan.find(&cut, number, &mut spans);
            if let Some(curved) = &curved {
                add_fringe(&mut spans, &curved.shell.fringe);
            }
            let is_shown = spans.is_empty() || spans.iter().any(is_seen);
            let form = is_shown.then(|| Box::new(style.form(&cut, number, &plane, uv, seed)));
            leaving.push(Leaving { number, plane, flight, seed, again, form, spans });
        }
        if let (Some(curved), Some(first), true) = (&curved, leaving.first_mut(), self.is_first) {
            curved.add_gaps(&mut first.spans, &self.base);
        }
        if leaving.len() > self.batch {
            // Those that move first leave first.
            leaving.sort_by(|a, b| a.flight.delay.total_cmp(&b.flight.delay));
        }
        let mut dirty = DirtyTiles::new(frame.size());
        let mut batches = VecDeque::with_capacity(leaving.len().div_ceil(self.batch));
        let mut rest = leaving.into_iter().peekable();
        while rest.peek().is_some() {
            let mut leaving: Vec<Leaving> = rest.by_ref().take(self.batch).collect();
            let mut spans: Vec<Span> =
                leaving.iter_mut().flat_map(|leaving| core::mem::take(&mut leaving.spans)).collect();
            join_spans(&mut spans);
            holes.set(&spans, true);
            for &[y, from, to] in &spans {
                dirty.mark(TexelRect { min: UVec2::new(from, y), max: UVec2::new(to, y + 1) });
            }
            let mut rects = Vec::new();
            dirty.take_rects(&mut rects);
            let crumbs = self.crumbs.map_or_else(Vec::new, |params| crumbs_of(&cut, &leaving, &style, params));
            batches.push_back(Batch { leaving, crumbs, spans, rects, uv });
        }
        let density = holes.density(self.view, &self.base, self.alpha_mask);
        let room = if self.is_first && !batches.is_empty() { vec![1; self.base.diffuse.len()] } else { Vec::new() };
        let drawn = match self.sketch {
            Some(sketch) if !batches.is_empty() && !cut.extended_lines().is_empty() => {
                Some(sketch.draw(cut.extended_lines(), &self.base))
            }
            _ => None,
        };
        Ok(CutSurface {
            revision: self.revision,
            settings,
            rim: self.rim,
            plane: self.plane,
            shell: curved.map(|curved| curved.shell),
            grown: self.grown,
            cut,
            is_new,
            support,
            batches,
            crumbs: self.crumbs,
            drawn,
            density,
            room,
        })
    }
}

/// The crumbs of pieces that leave in one frame.
fn crumbs_of(cut: &Shards, leaving: &[Leaving], style: &Style, params: CrumbParams) -> Vec<Crumb> {
    let seen: Vec<&Leaving> = leaving.iter().filter(|leaving| leaving.form.is_some()).collect();
    let most = (MOST_IN_FRAME / seen.len().max(1)).max(1);
    let crumbs = |leaving: &Leaving| {
        let Leaving { number, ref plane, ref flight, seed, .. } = *leaving;
        Loose { cut, number, plane, flight, seed, style }.crumbs(params, most)
    };
    seen.into_iter().flat_map(crumbs).take(MOST_IN_FRAME).collect()
}
