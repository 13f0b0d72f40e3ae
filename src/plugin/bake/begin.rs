//! What a bake needs: it is looked for in the frames until all of it is there.

use super::{
    super::{
        CrackError, CrackMaskSource, GuideSource, GuidedCracks,
        activate::plan_pictures,
        carrier::{self, Shown, Untouched},
        mask::{Key, PictureMasks},
        picture,
        surfaces::Surfaces,
    },
    Bake, Bakes, Plan, Work,
    job::{MAX_SIDE, MapJob, RawMask, RawSurface, Source, Surface},
    read::Reading,
};
use bevy::prelude::*;
use std::sync::Arc;

/// The pictures that a bake needs a copy of, each once.
#[derive(Default)]
struct Pictures(Vec<Handle<Image>>);

impl Pictures {
    fn add(&mut self, picture: &Handle<Image>) -> usize {
        self.0.iter().position(|known| known == picture).unwrap_or_else(|| {
            self.0.push(picture.clone());
            self.0.len() - 1
        })
    }
}

/// All that a bake needs; `None` if its pictures are not there yet.
pub(super) fn begin(world: &mut World, entity: Entity, bake: &mut Bake) -> Result<Option<Work>, CrackError> {
    let Some(guided) = world.get::<GuidedCracks>(entity).cloned() else { return Ok(None) };
    let mut pictures = Pictures::default();
    let known = world.resource::<Surfaces>().active.get(&entity).and_then(|active| {
        let rect = active.views.get(active.view)?.rect;
        Some(Surface::Known(active.base.clone(), rect))
    });
    let surface = match known {
        Some(surface) => surface,
        None => {
            let Some((plan, mask)) = plan(world, entity, &mut pictures)? else { return Ok(None) };
            let Shown { diffuse, normal, depth, .. } = &plan.shown;
            let maps = plan.pictures.maps;
            let needed = [(diffuse, true), (normal, maps.normal), (depth, maps.depth)];
            let needed = needed.map(|(map, is_needed)| map.as_ref().filter(|_| is_needed).map(|map| pictures.add(map)));
            let raw = RawSurface { plan: plan.pictures.clone(), pictures: needed, mask };
            bake.plan = Some(Box::new(plan));
            Surface::Raw(Box::new(raw))
        }
    };
    let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
    let mut sources = Vec::with_capacity(guided.guides.len());
    for (index, guide) in guided.guides.iter().enumerate() {
        let named = |error: CrackError| CrackError::Guide { index, reason: error.to_string() };
        let source = match &guide.source {
            GuideSource::Grid(grid) => Source::Grid(grid.clone()),
            GuideSource::Png(file) => Source::Png(file.clone()),
            GuideSource::OwnEdges => Source::Own,
            GuideSource::Image(picture) => {
                if !picture::is_loaded(world, picture).map_err(named)? {
                    return Ok(None);
                }
                let Some(image) = images.get(picture) else { return Ok(None) };
                let size = picture::readable_size(image).map_err(named)?;
                if size.max_element() > MAX_SIDE {
                    return Err(named(CrackError::Size { width: size.x, height: size.y }));
                }
                Source::Image(pictures.add(picture))
            }
        };
        sources.push((source, guide.gamma));
    }
    let size = match &surface {
        Surface::Known(_, rect) | Surface::Read(_, rect) => rect.size(),
        Surface::Raw(raw) => raw.plan.rect.size(),
    };
    let side = size.max_element();
    let scale = f64::from(guided.max_side.clamp(1, side.max(1))) / f64::from(side.max(1));
    let size = (size.as_dvec2() * scale).round().as_uvec2().max(UVec2::ONE);
    let has_threads = world.resource::<Bakes>().pool().is_some();
    let Some(reading) = Reading::new(pictures.0, images, has_threads) else { return Ok(None) };
    Ok(Some(Work::Reading(reading, Box::new(MapJob::new(guided, size, surface, sources)))))
}

/// What a surface will be that has not cracked yet, and its mask; `None` if its pictures are not there yet.
fn plan(world: &World, entity: Entity, pictures: &mut Pictures) -> Result<Option<(Plan, RawMask)>, CrackError> {
    let Some(untouched) = carrier::untouched(world, entity)? else { return Ok(None) };
    let Untouched { surface, preset, kind, shown } = untouched;
    let Some(plan) = plan_pictures(world, &surface, &shown, 0)? else { return Ok(None) };
    let mask = match &surface.mask {
        CrackMaskSource::FromPicture => match &shown.diffuse {
            Some(picture) => {
                let key = Key::new(picture, &plan);
                world.resource::<PictureMasks>().find(key).map_or(RawMask::FromPicture(key), RawMask::Made)
            }
            None => RawMask::Made(Arc::default()),
        },
        CrackMaskSource::None => RawMask::Made(Arc::default()),
        CrackMaskSource::Images { weak, strong, forbidden } => {
            for image in [weak, strong, forbidden].into_iter().flatten() {
                if !picture::is_loaded(world, image)? {
                    return Ok(None);
                }
            }
            RawMask::Images([weak, strong, forbidden].map(|image| image.as_ref().map(|image| pictures.add(image))))
        }
    };
    Ok(Some((Plan { surface, preset, kind, shown, pictures: plan, textures: None, is_outdated: false }, mask)))
}
