//! What the crate paints, texel for texel, against stored pictures.
//!
//! `UPDATE_GOLDEN=1 cargo test pictures` writes them anew and fails all the same, so that nobody does it by accident.

use bevy_crack::{
    CrackPreset,
    growth::CrackGrowth,
    paint::{BaseTexels, LookTable, PaintTargets, paint_into},
    pattern::{Moment, SurfaceFrame},
    raster::{DepthField, TexelRect, stamp_path},
};
use glam::{UVec2, Vec2};
use image::RgbaImage;
use std::path::Path;

const SIZE: UVec2 = UVec2::new(160, 112);

fn paint(preset: &CrackPreset) -> (RgbaImage, RgbaImage) {
    let frame = SurfaceFrame::new(SIZE).unwrap();
    let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), 1).unwrap();
    growth.hit(Vec2::new(0.6, 0.5), 1.0);
    while growth.step().grew() {}
    growth.hit(Vec2::new(1.1, 0.7), 0.4);
    while growth.step().grew() {}
    let mut field = DepthField::new(frame);
    field.set_layers(preset.look.layer(1));
    for segment in growth.network().segments() {
        stamp_path(&mut field, &preset.profile, &growth.network().path(segment).unwrap());
    }
    let timeline = growth.timeline();
    field.show_layers(growth.network(), timeline, Moment::after(timeline.end()), &mut Vec::new());
    let base = RgbaImage::from_fn(SIZE.x, SIZE.y, |x, y| {
        let shade = 110 + ((x / 8 + y / 8) % 2) as u8 * 30;
        image::Rgba([shade, shade, shade - 10, if x < 4 { 0 } else { 255 }])
    });
    let (mut diffuse, mut normal) = (RgbaImage::new(SIZE.x, SIZE.y), RgbaImage::new(SIZE.x, SIZE.y));
    paint_into(
        BaseTexels { size: SIZE, diffuse: base.as_raw(), normal: None, depth: None },
        &field,
        &LookTable::new(&preset.look, frame.texels_per_unit()).unwrap(),
        TexelRect::whole(SIZE),
        UVec2::ZERO,
        &mut PaintTargets { diffuse: Some(&mut diffuse), normal: Some(&mut normal), depth: None },
    );
    (diffuse, normal)
}

fn compare(name: &str, picture: &RgbaImage) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/golden/{name}.png"));
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        picture.save(&path).unwrap();
        return;
    }
    let stored = image::open(&path).unwrap_or_else(|error| panic!("{name}.png: {error}")).to_rgba8();
    if stored == *picture {
        return;
    }
    let differing = stored.pixels().zip(picture.pixels()).filter(|(a, b)| a != b).count();
    let side_by_side = RgbaImage::from_fn(3 * SIZE.x, SIZE.y, |x, y| {
        let (a, b) = (stored.get_pixel(x % SIZE.x, y), picture.get_pixel(x % SIZE.x, y));
        match x / SIZE.x {
            0 => *a,
            1 => image::Rgba([if a == b { 0 } else { 255 }, 0, 0, 255]),
            _ => *b,
        }
    });
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.diff.png"));
    side_by_side.save(&out).unwrap();
    panic!("{name}: {differing} texels differ; stored | difference | painted in {}", out.display());
}

fn check(name: &str, preset: &CrackPreset) {
    let (diffuse, normal) = paint(preset);
    compare(&format!("{name}_diffuse"), &diffuse);
    compare(&format!("{name}_normal"), &normal);
    assert!(
        std::env::var_os("UPDATE_GOLDEN").is_none(),
        "{name} is stored anew; look at it, then run without UPDATE_GOLDEN"
    );
}

#[test]
fn glass_is_painted_as_before() {
    check("glass", &CrackPreset::GLASS);
}

#[test]
fn concrete_is_painted_as_before() {
    check("concrete", &CrackPreset::CONCRETE);
}

#[test]
fn clay_is_painted_as_before() {
    check("clay", &CrackPreset::CLAY);
}
