//! Cracks that draw words are read by a machine, and pictures from outside do no harm.
//!
//! Reading needs `tesseract` (Debian's `tesseract-ocr`); without it the test passes and says so, unless
//! `CRACK_REQUIRE_ALL=1` is set.

#[path = "../../examples/bake/ink.rs"]
mod ink;
#[path = "../../examples/bake/pictures.rs"]
mod pictures;
#[path = "../../examples/bake/text.rs"]
mod text;

use bevy_crack::{
    pattern::SurfaceFrame,
    raster::{DepthField, Profile},
    voronoi::{Guide, SiteLayout, VoronoiBake, VoronoiParams},
};
use glam::UVec2;
use image::{GrayImage, Rgba, RgbaImage};
use std::{
    env, fs,
    io::Write,
    path::{Path, PathBuf},
    process::Command,
};

/// Of 20 words so many must be read.
const READ: usize = 16;

const CAPITALS: [&str; 20] = [
    "CRACK", "STONE", "BEVY", "HELLO", "WORLD", "DANGER", "EXIT", "MAGIC", "QUIET", "JUMP", "GHOST", "RIVER", "BRICK",
    "FLAME", "NIGHT", "KING", "SWORD", "POWER", "ZEBRA", "VAULT",
];

const SMALL: [&str; 20] = [
    "Level",
    "Door",
    "Hidden",
    "Secret",
    "north",
    "Tomb",
    "Dragon",
    "Enter",
    "Forbidden",
    "Castle",
    "Mud",
    "Winter",
    "Orbit",
    "Puzzle",
    "Yellow",
    "Fox",
    "Window",
    "Treasure",
    "Gold",
    "Echo",
];

/// A folder of this process alone.
fn folder(name: &str) -> PathBuf {
    let folder = env::temp_dir().join(format!("bevy_crack_{name}_{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Whether there is something to read with; says so past the test runner if not.
fn can_read() -> bool {
    if Command::new("tesseract").arg("--version").output().is_ok_and(|output| output.status.success()) {
        return true;
    }
    assert!(
        env::var_os("CRACK_REQUIRE_ALL").is_none_or(|v| v != "1"),
        "CRACK_REQUIRE_ALL=1, but there is no tesseract"
    );
    let _ = writeln!(std::io::stderr(), "PASSED OVER: words are not read: there is no `tesseract`");
    false
}

fn read(picture: &Path) -> String {
    let output = Command::new("tesseract").arg(picture).args(["-", "--psm", "7"]).output().unwrap();
    String::from_utf8_lossy(&output.stdout).chars().filter(|c| c.is_alphanumeric()).collect()
}

/// The deep cracks of a word at the paper's size with the paper's number of sites, black on white; checks that the
/// strokes are covered.
fn deep_cracks(word: &str, seed: u64) -> GrayImage {
    let size = UVec2::splat(400);
    let guide = Guide::new(text::draw_text(text::FONT, word, size, f32::INFINITY).unwrap());
    let params = VoronoiParams { layout: SiteLayout::Astride, ..VoronoiParams::DEFAULT };
    let (map, seams) = VoronoiBake::new(params, vec![guide], size, seed).unwrap().finish();
    assert_eq!(map.sites().len(), 175);
    let strokes = map.strokes().unwrap();
    assert!(strokes.covered >= 0.95, "{word}: {strokes:?}");
    let mut field = DepthField::new(SurfaceFrame::new(size).unwrap());
    seams.stamp(&mut field, &Profile { full_width: 0.014, wall: 0.4, faintest: 0.5, ..Profile::DEFAULT });
    let mask = field.depth.as_slice().iter().map(|&depth| if depth > u16::MAX / 2 { 0 } else { 255 }).collect();
    GrayImage::from_raw(size.x, size.y, mask).unwrap()
}

#[test]
fn words_are_legible() {
    if !can_read() {
        return;
    }
    let folder = folder("words");
    for words in [CAPITALS, SMALL] {
        let misread: Vec<_> = (1..)
            .zip(words)
            .filter_map(|(seed, word)| {
                let path = folder.join(format!("{word}.png"));
                deep_cracks(word, seed).save(&path).unwrap();
                let got = read(&path);
                (!got.eq_ignore_ascii_case(word)).then_some((word, got))
            })
            .collect();
        assert!(words.len() - misread.len() >= READ, "misread: {misread:?}");
    }
    fs::remove_dir_all(folder).unwrap();
}

/// A chunk of a PNG file.
fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let mut body = kind.to_vec();
    body.extend(data);
    let crc = body.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 })
    });
    [&(data.len() as u32).to_be_bytes()[..], &body, &(!crc).to_be_bytes()].concat()
}

/// A file that claims `side` x `side` RGBA texels and has next to no data.
fn bomb(side: u32) -> Vec<u8> {
    let side = side.to_be_bytes();
    let header = [&side[..], &side, &[8, 6, 0, 0, 0]].concat();
    let data = [0x78, 0x9C, 0x63, 0, 0, 0, 1, 0, 1, 0, 0];
    [&b"\x89PNG\r\n\x1a\n"[..], &chunk(b"IHDR", &header), &chunk(b"IDAT", &data), &chunk(b"IEND", &[])].concat()
}

/// A decompression bomb is refused by what its header says.
#[test]
fn f2_bombs_are_refused() {
    let folder = folder("bombs");
    let path = folder.join("bomb.png");
    for side in [60_000, 24_000, 8_193, u32::MAX] {
        let file = bomb(side);
        assert_eq!(file.len(), 68);
        fs::write(&path, file).unwrap();
        let refused = pictures::read_picture(&path).unwrap_err().to_string();
        assert!(refused.contains("bomb.png"), "{refused}");
        assert!(side == u32::MAX || refused.to_lowercase().contains("limit"), "{side}: {refused}");
    }
    fs::remove_dir_all(folder).unwrap();
}

/// Pictures that are cut short, flipped in any bit, or no pictures give an error or a picture, never a panic.
#[test]
fn f1_broken_pictures_are_errors() {
    let folder = folder("broken");
    let path = folder.join("picture.png");
    RgbaImage::from_fn(9, 7, |x, y| Rgba([(x * 20) as u8, (y * 30) as u8, 99, 255])).save(&path).unwrap();
    let good = fs::read(&path).unwrap();
    assert_eq!(pictures::read_picture(&path).unwrap().dimensions(), (9, 7));
    let mut refused = 0;
    let mut files: Vec<Vec<u8>> = (0..good.len()).map(|n| good[..n].to_vec()).collect();
    for bit in 0..8 * good.len() {
        let mut file = good.clone();
        file[bit / 8] ^= 1 << (bit % 8);
        files.push(file);
    }
    files.extend([b"GIF89a".to_vec(), b"<svg/>".to_vec(), vec![0; 1000]]);
    let n = files.len();
    for file in files {
        fs::write(&path, file).unwrap();
        refused += usize::from(pictures::read_picture(&path).is_err());
    }
    assert!(refused > n / 2, "{refused} of {n}");
    assert!(pictures::read_picture(&folder.join("nothing.png")).is_err());
    fs::remove_dir_all(folder).unwrap();
}

/// G1: guides of any channel count; the drawing is found whichever way round it is drawn.
#[test]
fn g1_pictures_of_every_kind_are_guides() {
    let folder = folder("kinds");
    let paper = image::DynamicImage::ImageRgba8(RgbaImage::from_fn(20, 12, |x, _| {
        if (8..11).contains(&x) { Rgba([0, 0, 0, 255]) } else { Rgba([255; 4]) }
    }));
    let mut inverted = paper.clone();
    inverted.invert();
    let on_nothing = image::DynamicImage::ImageRgba8(RgbaImage::from_fn(20, 12, |x, _| {
        if (8..11).contains(&x) { Rgba([200, 0, 0, 255]) } else { Rgba([0; 4]) }
    }));
    let kinds = [
        paper.clone(),
        inverted,
        on_nothing,
        paper.to_luma8().into(),
        paper.to_luma_alpha8().into(),
        paper.to_rgb8().into(),
        paper.to_luma16().into(),
        paper.to_rgba16().into(),
    ];
    for (i, kind) in kinds.iter().enumerate() {
        let path = folder.join(format!("{i}.png"));
        kind.save(&path).unwrap();
        let picture = pictures::read_picture(&path).unwrap();
        let ink = ink::ink(&picture).unwrap();
        for x in 0..20 {
            let want = f32::from(u8::from((8..11).contains(&x)));
            assert!((ink.get(x, 5).unwrap() - want).abs() < 0.01, "kind {i} at {x}");
        }
        assert!(ink::lightness(&picture).unwrap().as_slice().iter().all(|light| (0.0..=1.0).contains(light)));
    }
    fs::remove_dir_all(folder).unwrap();
}
