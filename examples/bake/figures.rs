//! `bake figures-mould`: the figures of Mould 2005 made again.

use crate::{
    analogy::{panels, pattern_panel, picture, shipped_pair, shipped_params},
    guided::regions,
    maps::{Paint, base_picture},
    ocr::{PROFILE, SIDE, deep},
};
use bevy_crack::{
    paint::analogy::{Analogy, Examples},
    pattern::SurfaceFrame,
    raster::{DepthField, Profile},
    voronoi::{FONT, Front, Guide, Seams, SiteLayout, VoronoiBake, VoronoiMap, VoronoiParams, draw_text},
};
use clap::Args;
use glam::{UVec2, Vec2};
use image::{Rgba, RgbaImage, imageops};
use std::{error::Error, fs, path::PathBuf, sync::Arc};

#[derive(Args)]
pub(crate) struct Options {
    /// Folder to write to; made if it is not there
    #[arg(long, default_value = "out/figures-mould")]
    out: PathBuf,
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Free space between panels.
const GAP: u32 = 8;

type Done<T> = Result<T, Box<dyn Error>>;

/// One seed, one size.
struct Studio {
    seed: u64,
    frame: SurfaceFrame,
    base: RgbaImage,
}

impl Studio {
    fn new(size: UVec2, seed: u64) -> Done<Self> {
        Ok(Self { seed, frame: SurfaceFrame::new(size)?, base: base_picture(None, "concrete", size)? })
    }

    fn word(&self, text: &str) -> Done<Guide> {
        Ok(Guide::new(draw_text(FONT, text, self.frame.size(), f32::INFINITY).ok_or("the font cannot be read")?))
    }

    fn map(&self, params: VoronoiParams, guides: &[Guide]) -> Done<(VoronoiMap, Seams)> {
        Ok(VoronoiBake::new(params, guides.to_vec(), self.frame.size(), self.seed)?.finish())
    }

    /// The seams as lines of one width on white.
    fn lines(&self, seams: &Seams) -> RgbaImage {
        let mut field = DepthField::new(self.frame);
        let mut seams = seams.clone();
        let width = 1.5 / self.frame.texels_per_unit();
        seams.seams.iter_mut().flat_map(|seam| &mut seam.points).for_each(|point| point.width = width);
        seams.stamp(&mut field, &Profile { wall: 0.0, full_width: width, ..Profile::DEFAULT });
        self.on_white(&field)
    }

    fn on_white(&self, field: &DepthField) -> RgbaImage {
        let size = self.frame.size();
        RgbaImage::from_fn(size.x, size.y, |x, y| {
            let light = 255 - (field.depth.get(x, y).unwrap_or(0) >> 8) as u8;
            Rgba([light, light, light, 255])
        })
    }

    /// The cracks with their widths on white.
    fn cracks(&self, seams: &Seams) -> RgbaImage {
        let mut field = DepthField::new(self.frame);
        seams.stamp(&mut field, &Profile { wall: 0.0, full_width: 1.0e-4, ..PROFILE });
        self.on_white(&field)
    }

    /// A pair that ships and the same for cracks along the seams: A, A', B, B'.
    fn analogy(&self, name: &str, seams: &Seams) -> Done<[RgbaImage; 4]> {
        let (pair, params) = (shipped_pair(name)?, shipped_params(name)?);
        let mut field = DepthField::new(self.frame);
        seams.stamp(&mut field, &PROFILE);
        let [guide, photo] = panels(&pair, params.depth);
        let examples = Arc::new(Examples::new(&[pair], &params)?);
        let mut analogy = Analogy::new(examples, &field.depth, &[], self.seed)?;
        analogy.finish();
        Ok([guide, photo, pattern_panel(&field.depth, &params), picture(&analogy.colors())])
    }

    fn painted(&self, look: &str, stamp: impl FnOnce(&mut DepthField)) -> Done<RgbaImage> {
        let mut field = DepthField::new(self.frame);
        stamp(&mut field);
        let [diffuse, _] = Paint::new(look, &self.frame)?.paint(&self.base, &field)?;
        Ok(diffuse)
    }
}

/// Panels in rows.
fn sheet(rows: &[Vec<RgbaImage>]) -> RgbaImage {
    let width = |row: &Vec<RgbaImage>| row.iter().map(|panel| panel.width() + GAP).sum::<u32>() + GAP;
    let height = |row: &Vec<RgbaImage>| row.iter().map(RgbaImage::height).max().unwrap_or(0) + GAP;
    let size = (rows.iter().map(width).max().unwrap_or(1), rows.iter().map(height).sum::<u32>() + GAP);
    let mut sheet = RgbaImage::from_pixel(size.0, size.1, Rgba([120, 130, 150, 255]));
    let mut y = GAP;
    for row in rows {
        let mut x = GAP;
        for panel in row {
            imageops::replace(&mut sheet, panel, i64::from(x), i64::from(y));
            x += panel.width() + GAP;
        }
        y += height(row);
    }
    sheet
}

pub(crate) fn bake(options: &Options) -> Done<()> {
    let out = &options.out;
    fs::create_dir_all(out)?;
    let square = Studio::new(UVec2::splat(SIDE), options.seed)?;
    let wide = Studio::new(UVec2::new(2 * SIDE + GAP, SIDE), options.seed)?;
    let usual = VoronoiParams::DEFAULT;
    let even = VoronoiParams { layout: SiteLayout::Even, ..usual.clone() };
    let astride = VoronoiParams { layout: SiteLayout::StrokePairs, ..usual.clone() };

    // 1: pavement, and a title in its cracks.
    let (_, pavement) = square.map(VoronoiParams { sites: 12, ..usual.clone() }, &[])?;
    let (_, tiles) = square.map(VoronoiParams { sites: 40, ..usual.clone() }, &[])?;
    let title = VoronoiParams { sites: 300, ..astride.clone() };
    let (_, title) = wide.map(title, &[wide.word("GRAPHICS\nINTERFACE")?])?;
    sheet(&[
        vec![
            square.painted("groove", |field| pavement.stamp(field, &PROFILE))?,
            square.painted("groove", |field| tiles.stamp(field, &PROFILE))?,
        ],
        vec![wide.painted("groove", |field| title.stamp(field, &PROFILE))?],
    ])
    .save(out.join("fig_01_title.png"))?;

    // 2: without and with noise.
    let (_, straight) = square.map(VoronoiParams { alpha: 0.0, ..usual.clone() }, &[])?;
    let (_, noisy) = square.map(usual.clone(), &[])?;
    sheet(&[vec![square.lines(&straight), square.lines(&noisy)]]).save(out.join("fig_02_noise.png"))?;

    // 3: three levels, and scattered sites.
    let (_, levels) = square.map(VoronoiParams { levels: 3, sites: 220, ..even.clone() }, &[])?;
    sheet(&[vec![square.cracks(&levels), square.cracks(&noisy)]]).save(out.join("fig_03_levels.png"))?;

    // 4: words: drawing, regions and cracks, with the paper's sites and astride.
    let words = [square.word("SO\nODD")?];
    let mut rows = Vec::new();
    for params in [usual.clone(), astride.clone()] {
        let (map, seams) = square.map(params, &words)?;
        let mut drawing = RgbaImage::from_fn(SIDE, SIDE, |x, y| {
            let light = 255 - (words[0].image.get(x, y).unwrap_or(0.0) * 110.0) as u8;
            Rgba([light, light, light, 255])
        });
        imageops::overlay(&mut drawing, &transparent(&square.lines(&seams)), 0, 0);
        for site in map.sites() {
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                drawing.put_pixel((site.x + dx).min(SIDE - 1), (site.y + dy).min(SIDE - 1), Rgba([200, 30, 20, 255]));
            }
        }
        rows.push(vec![drawing, regions(&map), square.cracks(&seams)]);
    }
    sheet(&rows).save(out.join("fig_04_words.png"))?;

    // 5: mud, and an impact.
    let impact = SiteLayout::Impact { at: Vec2::splat(0.5), focus: 2.2 };
    let (_, mud) = square.map(even.clone(), &[])?;
    let (_, impact) = square.map(VoronoiParams { layout: impact, ..usual.clone() }, &[])?;
    sheet(&[vec![square.cracks(&mud), square.cracks(&impact)]]).save(out.join("fig_05_layouts.png"))?;

    // 6: A : A' :: B : B' for pavement.
    sheet(&[square.analogy("paving", &tiles)?.to_vec()]).save(out.join("fig_06_analogy.png"))?;

    // 7: textures on cracks that draw something: stone and clay, in place of the paper's stone and ice.
    let mut rows = Vec::new();
    for (pair, word) in [("concrete", "CHESS"), ("clay", "SMILE")] {
        let (_, seams) = square.map(astride.clone(), &[square.word(word)?])?;
        rows.push(square.analogy(pair, &seams)?.to_vec());
    }
    sheet(&rows).save(out.join("fig_07_materials.png"))?;

    // 8: modulation, dark as in the paper and bright.
    let (_, cracked) = square.map(astride.clone(), &[square.word("ICE")?])?;
    let stamp = |field: &mut DepthField| cracked.stamp(field, &PROFILE);
    let panels =
        vec![square.painted("dark", stamp)?, square.painted("bright", stamp)?, square.painted("groove", stamp)?];
    sheet(&[panels]).save(out.join("fig_08_modulation.png"))?;

    // 9 and 10: words emerge as their weight rises; one word turns into another.
    let emerge = |guides: &[Guide], weights: &[Vec<f32>]| -> Done<RgbaImage> {
        let (mut map, _) = square.map(astride.clone(), guides)?;
        if let [_, others @ ..] = guides {
            let alone: Vec<f32> = std::iter::once(28.0).chain(others.iter().map(|_| 0.0)).collect();
            map.set_gammas(&alone)?;
            map.rescale_widths();
        }
        let frame = |gammas: &Vec<f32>| {
            map.set_gammas(gammas)?;
            let seams = map.seams();
            square.painted("groove", |field| seams.stamp(field, &PROFILE))
        };
        Ok(sheet(&[weights.iter().map(frame).collect::<Done<_>>()?]))
    };
    let rising = [0.0, 3.0, 9.0, 28.0].map(|gamma| vec![gamma]);
    emerge(&[square.word("VERY\nSLOW")?], &rising)?.save(out.join("fig_09_emerging.png"))?;
    let turning = [[28.0, 0.0], [19.0, 9.0], [9.0, 19.0], [0.0, 28.0]].map(Vec::from);
    emerge(&[square.word("NIGHT")?, square.word("LIGHT")?], &turning)?.save(out.join("fig_10_morph.png"))?;

    // 11: widths over time (eq. 5), and a front from an impact.
    let (_, seams) = square.map(VoronoiParams { levels: 3, sites: 160, ..even }, &[])?;
    let front = Front::new(&seams, Vec2::splat(0.5));
    let times = [0.15, 0.4, 0.7, 1.0];
    let widths = times.iter().map(|&t| square.painted("groove", |field| seams.stamp_share(field, &PROFILE, t)));
    let fronts = times
        .iter()
        .map(|&t| square.painted("groove", |field| seams.stamp_front(field, &PROFILE, &front, t * front.reach())));
    sheet(&[widths.collect::<Done<_>>()?, fronts.collect::<Done<_>>()?]).save(out.join("fig_11_expansion.png"))?;

    let mut field = DepthField::new(square.frame);
    cracked.stamp(&mut field, &PROFILE);
    deep(&field).ok_or("mask size")?.save(out.join("fig_08_deep.png"))?;
    println!("figures 1 to 11 are in {}", out.display());
    Ok(())
}

/// White becomes transparent.
fn transparent(picture: &RgbaImage) -> RgbaImage {
    let mut picture = picture.clone();
    for texel in picture.pixels_mut() {
        *texel = Rgba([0, 0, 0, 255 - texel[0]]);
    }
    picture
}
