//! What a bake needs: it is looked for in the frames until all of it is there.

use super::map_job::{BakeSurface, CracksOrder, MapJob, Source};
use super::strands_job::StrandsOrder;
use super::work::{Bake, Baked, Work};
use crate::plugin::api::{CrackError, CrackRecord, CrackStrands, CrackSurface, GuideSource, GuidedCracks};
use crate::plugin::jobs::copy::PictureCopies;
use crate::plugin::jobs::threads::Threads;
use crate::plugin::source::picture;
use crate::plugin::source::png::MAX_SIDE;
use crate::plugin::surface::cracked::active;
use crate::plugin::surface::inputs::Copies;
use crate::plugin::surface::plan::Plan;
use crate::plugin::surface::unfold::unfold;
use bevy::prelude::*;

const LAID_OUT: &str =
    "its mesh is laid out around its first hit: add strands before that, or set `CrackSurface::unwrap` to `Never`";

/// All that a bake needs; `None` if its pictures are not there yet.
pub(super) fn begin(world: &mut World, entity: Entity, bake: &mut Bake) -> Result<Option<Work>, CrackError> {
    let mut copies = Copies::default();
    let (guided, order) = match bake.kind {
        Baked::Guided => {
            let Some(guided) = world.get::<GuidedCracks>(entity).cloned() else { return Ok(None) };
            guided.validate()?;
            if active(world, entity).is_none() && !unfold(world, entity) {
                return Ok(None);
            }
            (Some(guided), None)
        }
        Baked::Strands => {
            let Some(strands) = world.get::<CrackStrands>(entity).cloned() else { return Ok(None) };
            let Some(order) = StrandsOrder::new(world, entity, &strands, &mut copies)? else { return Ok(None) };
            (None, Some(CracksOrder::Strands(Box::new(order))))
        }
        Baked::Record => {
            let Some(record) = world.get::<CrackRecord>(entity).cloned() else { return Ok(None) };
            record.validate()?;
            if let Some(mut surface) = world.get_mut::<CrackSurface>(entity)
                && surface.seed != record.seed
            {
                surface.seed = record.seed;
            }
            if active(world, entity).is_none() && !unfold(world, entity) {
                return Ok(None);
            }
            (None, Some(CracksOrder::Record(Box::new(record))))
        }
    };
    if matches!(bake.kind, Baked::Strands)
        && active(world, entity).is_some_and(|active| active.carrier.unfolding.is_some())
    {
        return Err(CrackError::Bake { reason: LAID_OUT.to_owned() });
    }
    let known = active(world, entity).and_then(|active| {
        let rect = active.canvas.views.get(active.canvas.view)?.rect;
        Some((BakeSurface::Known(active.canvas.base.clone(), rect), active.carrier.shown.diffuse.clone()))
    });
    let (surface, diffuse) = match known {
        Some(known) => known,
        None => {
            let Some(plan) = Plan::new(world, entity)? else { return Ok(None) };
            let Some(raw) = plan.raw(world, &mut copies)? else { return Ok(None) };
            plan.check_mesh(world, entity)?;
            let diffuse = plan.shown.diffuse.clone();
            bake.plan = Some(Box::new(plan));
            (BakeSurface::Raw(Box::new(raw)), diffuse)
        }
    };
    let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
    let picture = diffuse.and_then(|diffuse| images.get(&diffuse)).map(Image::size);
    let mut sources = Vec::new();
    for (index, guide) in guided.iter().flat_map(|guided| &guided.guides).enumerate() {
        let named = |error: CrackError| CrackError::Guide { index, reason: error.to_string() };
        let source = match &guide.source {
            GuideSource::Grid(grid) => Source::Grid(grid.clone()),
            GuideSource::Png(file) => Source::Png(file.clone()),
            GuideSource::OwnEdges => Source::Own,
            GuideSource::Text { text, font } => Source::Text(text.clone(), font.clone()),
            GuideSource::Image(picture) => {
                if !picture::is_loaded(world, picture).map_err(named)? {
                    return Ok(None);
                }
                let Some(image) = images.get(picture) else { return Ok(None) };
                let size = picture::readable_size(image).map_err(named)?;
                if size.max_element() > MAX_SIDE {
                    return Err(named(CrackError::Size { width: size.x, height: size.y }));
                }
                Source::Image(copies.add(picture))
            }
        };
        sources.push((source, guide.gamma));
    }
    let size = match &surface {
        BakeSurface::Known(_, rect) | BakeSurface::Read(_, rect) => rect.size(),
        BakeSurface::Raw(raw) => raw.plan.rect.size(),
    };
    let (order, size) = match (guided, order) {
        (Some(guided), _) => {
            let size = scaled(size, guided.max_side);
            (CracksOrder::Guided(Box::new(guided)), size)
        }
        (None, Some(order)) => (order, size.max(UVec2::ONE)),
        (None, None) => return Ok(None),
    };
    let has_threads = world.resource::<Threads>().pool().is_some();
    let Some(reading) = PictureCopies::new(copies.0, images, has_threads) else { return Ok(None) };
    Ok(Some(Work::Reading(reading, Box::new(MapJob::new(order, size, (surface, picture), sources)))))
}

/// The size of a map of at most `max_side` texels along its longer side.
fn scaled(size: UVec2, max_side: u32) -> UVec2 {
    let side = size.max_element().max(1);
    let scale = f64::from(max_side.clamp(1, side)) / f64::from(side);
    (size.as_dvec2() * scale).round().as_uvec2().max(UVec2::ONE)
}
