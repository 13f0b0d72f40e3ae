//! From guides or strands to a network: what a bake does before it knows of its surface.

use super::strands_job::StrandsOrder;
use crate::Grid;
use crate::pattern::Network;
use crate::plugin::api::{CrackError, CrackRecord, GuidedAppearance, GuidedCracks};
use crate::plugin::source::mask;
use crate::plugin::source::picture::{self, BasePicture, Space};
use crate::plugin::source::png;
use crate::plugin::surface::cracks::Added;
use crate::plugin::surface::inputs::{BaseAndMask, SurfaceInputs};
use crate::plugin::surface::motion::Motion;
use crate::raster::TexelRect;
use crate::voronoi::{self, Guide, SeamMotion, Seams, VoronoiBake, VoronoiError, VoronoiMap};
use bevy::prelude::*;
use std::{sync::Arc, vec};

/// Texels of a slice: well below a millisecond.
pub(super) const SLICE: u32 = 1 << 14;

/// Steps in which the cracks of a front open behind its tip.
const FRONT_OPENING: u32 = 12;

/// Steps in which cracks open that widen all at once.
const WIDE_OPENING: u32 = 32;

/// Steps in which cracks move to where they stay.
const MOTION_STEPS: u32 = 64;

/// Shares of the whole that reading the guides and drawing the lines count for in the progress.
const READ: f32 = 0.1;

pub(super) const MAPPED: f32 = 0.95;

/// A map as a machine that is stepped; depends on nothing but itself.
pub(super) struct MapJob {
    order: CracksOrder,
    pub(super) size: UVec2,
    /// Copies of the pictures of surface, mask and guides.
    pub(super) copies: Vec<Image>,
    pub(super) surface: BakeSurface,
    pub(super) sources: vec::IntoIter<(Source, f32)>,
    guides: Vec<Guide>,
    map: Option<VoronoiBake>,
    pub(super) progress: f32,
}

/// The cracks that are to be made.
pub(super) enum CracksOrder {
    Guided(Box<GuidedCracks>),
    Strands(Box<StrandsOrder>),
    Record(Box<CrackRecord>),
}

/// The surface that is to crack.
pub(super) enum BakeSurface {
    /// Its picture and the part that is shown.
    Known(Arc<BasePicture>, TexelRect),
    /// It has not cracked yet.
    Raw(Box<SurfaceInputs>),
    Read(BaseAndMask, TexelRect),
}

/// A guide that is not read yet.
pub(super) enum Source {
    /// Index of the copy.
    Image(usize),
    Grid(Arc<Grid<f32>>),
    Png(Arc<[u8]>),
    /// Lines of text, and their font unless it is the crate's own.
    Text(String, Option<Arc<[u8]>>),
    /// The surface's own picture.
    Own,
}

/// The cracks of a bake, and the surface if that was read for it.
pub(super) struct Lines {
    /// `None` = only what a record has grows.
    pub(super) added: Option<Added>,
    pub(super) record: Option<Box<CrackRecord>>,
    pub(super) covered: Option<f32>,
    pub(super) ground: Option<BaseAndMask>,
}

impl MapJob {
    pub(super) fn new(order: CracksOrder, size: UVec2, surface: BakeSurface, sources: Vec<(Source, f32)>) -> Self {
        let (copies, guides) = (Vec::new(), Vec::with_capacity(sources.len()));
        Self { order, size, copies, surface, sources: sources.into_iter(), guides, map: None, progress: 0.0 }
    }

    /// A slice of the work.
    pub(super) fn step(&mut self) -> Result<Option<Lines>, CrackError> {
        if let BakeSurface::Raw(raw) = &self.surface {
            let ground = raw.read(&self.copies)?;
            self.surface = BakeSurface::Read(ground, raw.plan.rect);
            return Ok(None);
        }
        if let Some((source, gamma)) = self.sources.next() {
            let index = self.guides.len();
            let image = self.read(source).map_err(|reason| CrackError::Guide { index, reason })?;
            self.guides.push(Guide { image, gamma });
            self.progress = READ * self.guides.len() as f32 / (self.guides.len() + self.sources.len()) as f32;
            return Ok(None);
        }
        let guided = match &self.order {
            CracksOrder::Guided(guided) => guided,
            CracksOrder::Strands(order) => {
                let (network, opening) = order.lines(&self.copies, self.size)?;
                let added = Some(Added { network, opening, steps: 0, motion: None });
                return Ok(Some(Lines { added, record: None, covered: None, ground: self.ground() }));
            }
            CracksOrder::Record(record) => {
                let record = Some(record.clone());
                return Ok(Some(Lines { added: None, record, covered: None, ground: self.ground() }));
            }
        };
        let Some(map) = &mut self.map else {
            let (params, guides) = (guided.params.clone(), core::mem::take(&mut self.guides));
            let map = VoronoiBake::new(params, guides, self.size, guided.seed);
            self.map = Some(map.map_err(|error| CrackError::Bake { reason: error.to_string() })?);
            return Ok(None);
        };
        if let voronoi::BakeStatus::Working(share) = map.step((SLICE / self.size.x).max(1) as usize) {
            self.progress = READ + (MAPPED - READ) * share;
            return Ok(None);
        }
        let Some((map, seams)) = self.map.take().map(VoronoiBake::finish) else { return Ok(None) };
        let covered = map.strokes().map(|strokes| strokes.covered);
        let (seams, motion) =
            motion(guided, map, seams).map_err(|error| CrackError::Bake { reason: error.to_string() })?;
        let (network, opening) = lines(&seams, guided.appearance);
        let added = Some(Added { network, opening, steps: 0, motion });
        Ok(Some(Lines { added, record: None, covered, ground: self.ground() }))
    }

    /// What was read of the surface.
    fn ground(&self) -> Option<BaseAndMask> {
        if let BakeSurface::Read(ground, _) = &self.surface { Some(ground.clone()) } else { None }
    }

    fn read(&self, source: Source) -> Result<Grid<f32>, String> {
        let decoded;
        let image = match source {
            Source::Grid(grid) => return Ok(Arc::unwrap_or_clone(grid)),
            Source::Text(text, font) => {
                let font = font.as_deref().unwrap_or(voronoi::FONT);
                let letters = voronoi::draw_text(font, &text, self.size, f32::INFINITY);
                return Ok(letters.ok_or("its font cannot be read")?);
            }
            Source::Own => {
                let (base, rect) = match &self.surface {
                    BakeSurface::Known(base, rect) | BakeSurface::Read(BaseAndMask { base, .. }, rect) => (base, *rect),
                    BakeSurface::Raw(_) => return Err("it was not read".into()),
                };
                let rgba = mask::part(&base.diffuse, base.size, rect);
                let picture = voronoi::lightness(rect.size(), &rgba).ok_or("its size is wrong")?;
                return Ok(voronoi::edges(&picture));
            }
            Source::Image(index) => self.copies.get(index).ok_or("it was not read")?,
            Source::Png(file) => {
                decoded = png::decode(&file)?;
                &decoded
            }
        };
        let size = picture::readable_size(image).map_err(|error| error.to_string())?;
        let rgba = picture::read(image, Space::Srgb, size).map_err(|error| error.to_string())?;
        Ok(voronoi::ink(size, &rgba).ok_or("its size is wrong")?)
    }
}

/// How the cracks move until they are where they stay, and the seams there.
fn motion(guided: &GuidedCracks, mut map: VoronoiMap, seams: Seams) -> Result<(Seams, Option<Motion>), VoronoiError> {
    if guided.appearance.seconds().is_none() {
        return Ok((seams, None));
    }
    let gammas: Vec<f32> = guided.guides.iter().map(|guide| guide.gamma).collect();
    let (from, to) = match (guided.appearance, &gammas[..]) {
        (GuidedAppearance::Emerge { .. }, _) => (vec![0.0; gammas.len()], gammas),
        (GuidedAppearance::Morph { .. }, &[first, second, ..]) => {
            map.set_gammas(&[first, 0.0])?;
            map.rescale_widths();
            (vec![first, 0.0], vec![0.0, second])
        }
        _ => return Ok((seams, None)),
    };
    let mut motion = SeamMotion::new(map, from, to)?;
    Ok((motion.at(1.0)?, Some(Motion::new(motion))))
}

/// The seams in the order in which they come, and the steps in which each opens.
fn lines(seams: &Seams, appearance: GuidedAppearance) -> (Network, u32) {
    if let GuidedAppearance::Front { from, .. } = appearance {
        return (seams.network(from * seams.extent), FRONT_OPENING);
    }
    let mut network = seams.network(Vec2::ZERO);
    network.nodes.iter_mut().for_each(|node| node.birth = 0);
    network.links.iter_mut().for_each(|link| link.birth = 0);
    let opening = match appearance {
        GuidedAppearance::AtOnce => 0,
        GuidedAppearance::Emerge { .. } | GuidedAppearance::Morph { .. } => MOTION_STEPS,
        GuidedAppearance::Front { .. } | GuidedAppearance::Widen { .. } => WIDE_OPENING,
    };
    (network, opening)
}
