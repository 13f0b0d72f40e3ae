//! From guides or strands to a network: what a bake does before it knows of its surface.

use super::strands_job::StrandsOrder;
use crate::Grid;
use crate::pattern::Network;
use crate::plugin::api::{CrackError, CrackRecord, GuidedAppearance, GuidedCracks};
use crate::plugin::source::mask;
use crate::plugin::source::picture::{self, BasePicture, Space};
use crate::plugin::source::png::{self, MAX_SIDE};
use crate::plugin::source::unfolding::Unfolding;
use crate::plugin::surface::cracks::Added;
use crate::plugin::surface::inputs::{BaseAndMask, SurfaceInputs};
use crate::plugin::surface::motion::Motion;
use crate::raster::TexelRect;
use crate::voronoi::{self, Guide, SeamMotion, Seams, SiteLayout, VoronoiBake, VoronoiError, VoronoiMap};
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

/// Shorter side of text that is drawn over the picture of a mesh that is laid out, texels.
const TEXT_SIDE: f32 = 1024.0;

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
    /// Size of the picture of a mesh that is laid out, if it has one.
    picture: Option<UVec2>,
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
    pub(super) fn new(
        order: CracksOrder,
        size: UVec2,
        (surface, picture): (BakeSurface, Option<UVec2>),
        sources: Vec<(Source, f32)>,
    ) -> Self {
        let (copies, guides) = (Vec::new(), Vec::with_capacity(sources.len()));
        Self { order, size, copies, surface, picture, sources: sources.into_iter(), guides, map: None, progress: 0.0 }
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
        let failed = |error: VoronoiError| CrackError::Bake { reason: error.to_string() };
        let Some(map) = &mut self.map else {
            let guides = core::mem::take(&mut self.guides);
            let laid_out = self.unfolding().map(|unfolding| (unfolding, self.proportions()));
            self.map = Some(start(guided, guides, self.size, laid_out).map_err(failed)?);
            return Ok(None);
        };
        if let voronoi::BakeStatus::Working(share) = map.step((SLICE / self.size.x).max(1) as usize) {
            self.progress = READ + (MAPPED - READ) * share;
            return Ok(None);
        }
        let Some((map, seams)) = self.map.take().map(VoronoiBake::finish) else { return Ok(None) };
        let covered = map.strokes().map(|strokes| strokes.covered);
        let front = self.unfolding().zip(guided.appearance.front()).map(|(unfolding, from)| {
            let from = unfolding.nearest_texel(from) / unfolding.layout.size.as_vec2();
            (map.network(&seams, from * seams.extent), FRONT_OPENING)
        });
        let (seams, motion) = motion(guided, map, seams).map_err(failed)?;
        let (network, opening) = front.unwrap_or_else(|| lines(&seams, guided.appearance));
        let added = Some(Added { network, opening, steps: 0, motion });
        Ok(Some(Lines { added, record: None, covered, ground: self.ground() }))
    }

    /// What was read of the surface.
    fn ground(&self) -> Option<BaseAndMask> {
        if let BakeSurface::Read(ground, _) = &self.surface { Some(ground.clone()) } else { None }
    }

    /// The picture of the surface and the part that is shown, once it is read.
    const fn base(&self) -> Option<(&Arc<BasePicture>, TexelRect)> {
        match &self.surface {
            BakeSurface::Known(base, rect) | BakeSurface::Read(BaseAndMask { base, .. }, rect) => Some((base, *rect)),
            BakeSurface::Raw(_) => None,
        }
    }

    /// How its mesh is laid out, if it is.
    fn unfolding(&self) -> Option<&Unfolding> {
        self.base().and_then(|(base, _)| base.unfolding()).map(Arc::as_ref)
    }

    /// A guide over the surface as it is laid out.
    fn read(&self, source: Source) -> Result<Grid<f32>, String> {
        let values = match source {
            Source::Own => return self.own_edges(),
            Source::Grid(values) => Arc::unwrap_or_clone(values),
            Source::Text(text, font) => self.draw_text(&text, font.as_deref())?,
            Source::Image(index) => ink(self.copies.get(index).ok_or("it was not read")?)?,
            Source::Png(file) => ink(&png::decode(&file)?)?,
        };
        let Some(unfolding) = self.unfolding() else { return Ok(values) };
        unfolding.lay_out(&values, self.size).map_err(|error| error.to_string())
    }

    /// Size of the picture of a mesh that is laid out, the shorter side being 1.
    fn proportions(&self) -> Vec2 {
        let is_own = self.unfolding().is_some_and(|unfolding| unfolding.is_own);
        let own = self.base().filter(|_| is_own).map(|(base, _)| base.size);
        let size = own.or(self.picture).filter(|size| size.min_element() > 0).unwrap_or(UVec2::ONE).as_vec2();
        size / size.min_element()
    }

    fn draw_text(&self, text: &str, font: Option<&[u8]>) -> Result<Grid<f32>, String> {
        let mut size = self.size;
        if self.unfolding().is_some() {
            let proportions = self.proportions();
            size = (proportions * TEXT_SIDE.min(MAX_SIDE as f32 / proportions.max_element())).round().as_uvec2();
        }
        let letters = voronoi::draw_text(font.unwrap_or(voronoi::FONT), text, size.max(UVec2::ONE), f32::INFINITY);
        Ok(letters.ok_or("its font cannot be read")?)
    }

    /// The edges of the surface's own picture.
    fn own_edges(&self) -> Result<Grid<f32>, String> {
        let (base, rect) = self.base().ok_or("it was not read")?;
        let rgba = mask::part(&base.diffuse, base.size, rect);
        let picture = voronoi::lightness(rect.size(), &rgba).ok_or("its size is wrong")?;
        let mut edges = voronoi::edges(&picture);
        if let Some(unfolding) = base.unfolding() {
            // Where a chart ends, its picture does not.
            let charts = unfolding.charts(rect.size()).map_err(|error| error.to_string())?;
            for y in 0..edges.height() {
                for (x, edge) in (0..).zip(edges.row_mut(y)) {
                    if !charts.is_inside(UVec2::new(x, y as u32)) {
                        *edge = 0.0;
                    }
                }
            }
        }
        Ok(edges)
    }
}

/// The drawing in a picture.
fn ink(image: &Image) -> Result<Grid<f32>, String> {
    let size = picture::readable_size(image).map_err(|error| error.to_string())?;
    let rgba = picture::read(image, Space::Srgb, size).map_err(|error| error.to_string())?;
    Ok(voronoi::ink(size, &rgba).ok_or("its size is wrong")?)
}

/// A map of the surface, laid out (with the proportions of its picture) or not.
fn start(
    guided: &GuidedCracks,
    guides: Vec<Guide>,
    size: UVec2,
    laid_out: Option<(&Unfolding, Vec2)>,
) -> Result<VoronoiBake, VoronoiError> {
    let mut params = guided.params.clone();
    let Some((unfolding, proportions)) = laid_out else {
        return VoronoiBake::new(params, guides, size, guided.seed);
    };
    let charts = unfolding.charts(size)?;
    // Places in the picture become places where they are laid out.
    let scale = size.as_vec2() / unfolding.layout.size.as_vec2();
    let laid = |texel: Vec2| charts.frame().to_pos(texel * scale);
    match &mut params.layout {
        SiteLayout::Impact { at, .. } if at.is_finite() => *at = laid(unfolding.nearest_texel(*at / proportions)),
        SiteLayout::Given(points) => {
            let all = points.iter().filter(|point| point.is_finite()).take(voronoi::MAX_SITES as usize);
            let uvs: Vec<Vec2> = all.map(|point| *point / proportions).collect();
            *points = unfolding.texels(&uvs).into_iter().flatten().map(laid).collect();
        }
        SiteLayout::Density(density) => *density = unfolding.lay_out(density, size)?,
        _ => {}
    }
    VoronoiBake::on_charts(params, guides, charts, guided.seed)
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
    if let Some(from) = appearance.front() {
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

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::{
        asset::RenderAssetUsages,
        render::render_resource::{Extent3d, TextureDimension, TextureFormat},
    };
    use image::{DynamicImage, ImageFormat, RgbaImage};

    const SIZE: UVec2 = UVec2::new(20, 12);

    /// The light of red, green and blue and the cover of a column of a drawing: paper, a broad stroke, a grey one, a red one, a blue one, and
    /// one of glass.
    fn column(x: u32, is_inverted: bool) -> [f64; 4] {
        let (paper, pen) = if is_inverted { (0.0, 1.0) } else { (1.0, 0.0) };
        match x {
            5..8 => [pen, pen, pen, 1.0],
            10 => [0.25, 0.25, 0.25, 1.0],
            12 => [1.0, 0.0, 0.0, 1.0],
            14 => [0.0, 0.0, 1.0, 1.0],
            16 => [pen, pen, pen, 0.0],
            _ => [paper, paper, paper, 1.0],
        }
    }

    /// The level that stands for a light in a picture for the eye.
    fn level(light: f64) -> f64 {
        if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
    }

    /// A share of the most, in so many bytes; as a float the share itself.
    fn stored(share: f64, bytes: usize, is_float: bool) -> Vec<u8> {
        match (bytes, is_float) {
            (4, true) => (share as f32).to_le_bytes().to_vec(),
            // Sign, exponent and fraction of the three shares that there are.
            (_, true) => (if share > 0.5 {
                0x3C00u16
            } else if share > 0.0 {
                0x3400
            } else {
                0
            })
            .to_le_bytes()
            .to_vec(),
            (4, false) => ((share * f64::from(u32::MAX)).round() as u32).to_le_bytes().to_vec(),
            (2, false) => ((share * f64::from(u16::MAX)).round() as u16).to_le_bytes().to_vec(),
            _ => vec![(share * 255.0).round() as u8],
        }
    }

    fn read(copies: Vec<Image>, source: Source) -> Result<Grid<f32>, String> {
        let base = Arc::new(BasePicture::new(UVec2::ONE, vec![255; 4], None, None));
        let surface = BakeSurface::Known(base, TexelRect::whole(UVec2::ONE));
        let mut job = MapJob::new(CracksOrder::Record(Box::default()), SIZE, (surface, None), Vec::new());
        job.copies = copies;
        job.read(source)
    }

    /// Fault G1: the same drawing in each format that can be read, dark on light and light on dark. What is expected is worked out from the light
    /// of its columns, by other numbers than those that are read.
    #[test]
    fn g1_guide_pictures_of_every_format() {
        use TextureFormat::*;
        let formats = [
            R8Unorm,
            R8Uint,
            R16Unorm,
            R16Uint,
            R16Float,
            R32Uint,
            R32Float,
            Rg8Unorm,
            Rg8Uint,
            Rg16Unorm,
            Rg16Uint,
            Rg16Float,
            Rg32Uint,
            Rg32Float,
            Rgba8Unorm,
            Rgba8UnormSrgb,
            Rgba8Uint,
            Bgra8Unorm,
            Bgra8UnormSrgb,
            Rgba16Unorm,
            Rgba16Uint,
            Rgba16Float,
            Rgba32Uint,
            Rgba32Float,
        ];
        for (format, is_inverted) in formats.into_iter().flat_map(|format| [(format, false), (format, true)]) {
            let name = format!("{format:?}");
            let channels = usize::from(format.components());
            let bytes = format.block_copy_size(None).expect("a plain format") as usize / channels;
            let (is_float, is_srgb) = (name.contains("Float"), name.contains("Srgb"));
            let texel = |x: u32| {
                let [red, green, blue, cover] = column(x, is_inverted);
                let [red, green, blue] = [red, green, blue].map(|light| if is_srgb { level(light) } else { light });
                let all = match format {
                    Bgra8Unorm | Bgra8UnormSrgb => [blue, green, red, cover],
                    Rg16Uint => [red, cover, 0.0, 0.0],
                    _ => [red, green, blue, cover],
                };
                all[..channels].iter().flat_map(|share| stored(*share, bytes, is_float)).collect::<Vec<u8>>()
            };
            let data = (0..SIZE.y).flat_map(|_| (0..SIZE.x).flat_map(texel)).collect();
            let extent = Extent3d { width: SIZE.x, height: SIZE.y, depth_or_array_layers: 1 };
            let usage = RenderAssetUsages::MAIN_WORLD;
            let mut image = Image::new_uninit(extent, TextureDimension::D2, format, usage);
            image.data = Some(data);
            let ink = read(vec![image], Source::Image(0)).expect("it can be read");
            assert_eq!(ink.size(), SIZE, "{name}");
            for x in 0..SIZE.x {
                let [red, green, blue, cover] = column(x, is_inverted);
                // One channel is grey; of two there is no blue; all is opaque without a fourth. Files with grey and alpha become one format.
                let (shown, cover) = match channels {
                    1 => ([red; 3], 1.0),
                    2 if format == Rg16Uint => ([red; 3], cover),
                    2 => ([red, green, 0.0], 1.0),
                    _ => ([red, green, blue], cover),
                };
                let light: f64 =
                    shown.into_iter().zip([0.299, 0.587, 0.114]).map(|(light, of)| of * level(light)).sum();
                let want = cover * if is_inverted { light } else { 1.0 - light };
                for y in [0, 7, SIZE.y - 1] {
                    let got = ink.get(x, y).map_or(f64::NAN, f64::from);
                    assert!((got - want).abs() < 0.01, "{name} {is_inverted}: {got}, not {want} at {x}");
                }
            }
        }
    }

    /// Fault G1: and in each kind of PNG file.
    #[test]
    fn g1_guide_files_of_every_kind() {
        let of = |x: u32| match x {
            10 => [100, 100, 100, 255],
            _ => column(x, false).map(|share| if share > 0.5 { 255 } else { 0 }),
        };
        // Without colours, of which files say other things.
        let has_no_color = |x: u32| !matches!(x, 12..=14);
        let drawing = RgbaImage::from_fn(SIZE.x, SIZE.y, |x, _| image::Rgba(of(if has_no_color(x) { x } else { 0 })));
        let drawing = DynamicImage::ImageRgba8(drawing);
        let kinds: [DynamicImage; 7] = [
            drawing.to_luma8().into(),
            drawing.to_rgb8().into(),
            drawing.to_luma_alpha8().into(),
            drawing.to_rgba8().into(),
            drawing.to_luma16().into(),
            drawing.to_luma_alpha16().into(),
            drawing.to_rgba16().into(),
        ];
        for (i, kind) in kinds.into_iter().enumerate() {
            let mut file = std::io::Cursor::new(Vec::new());
            let is_transparent = kind.color().has_alpha();
            kind.write_to(&mut file, ImageFormat::Png).expect("it can be written");
            let ink = read(Vec::new(), Source::Png(file.into_inner().into())).expect("it can be read");
            for x in 0..SIZE.x {
                let want = match x {
                    5..8 => 1.0,
                    10 => 155.0 / 255.0,
                    16 if !is_transparent => 1.0,
                    _ => 0.0,
                };
                let got = ink.get(x, 3).unwrap_or(f32::NAN);
                assert!((got - want).abs() < 0.01, "kind {i} at {x}: {got}, not {want}");
            }
        }
    }
}
