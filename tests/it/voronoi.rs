//! Cracks that draw words are read by a machine, and pictures from outside do no harm.
//!
//! Reading needs `tesseract` (Debian's `tesseract-ocr`) and more fonts (`fonts-crosextra-carlito`, `fonts-cantarell`); without them
//! the test passes and says so, unless `CRACK_REQUIRE_ALL=1` is set.

#[path = "../../examples/bake/ink.rs"]
mod ink;
#[path = "../../examples/bake/ocr.rs"]
mod ocr;
#[path = "../../examples/bake/pictures.rs"]
mod pictures;

use bevy_crack::{
    Grid,
    pattern::CrackMask,
    voronoi::{FONT, Guide, SiteLayout, VoronoiBake, VoronoiParams, draw_text, ink as ink_of, lightness},
};
use glam::UVec2;
use image::{Rgba, RgbaImage};
use std::{env, fs, io::Write, path::PathBuf};

/// Words and names of three to eight letters, drawn by lot; nothing was tuned on them.
#[rustfmt::skip]
const WORDS: [&str; 40] = [
    "mist", "Alice", "silver", "Benjamin", "quiz", "Marcus", "Sue", "Charles", "Theo", "grape", "Beth", "maple",
    "language", "island", "Tyler", "rainbow", "insight", "Winifred", "Luke", "fortune", "Fred", "elegant", "vine",
    "rib", "Ned", "Pam", "Dominick", "freedom", "temple", "gem", "unison", "Harrison", "ivy", "Karen", "Bruno",
    "Olivia", "gallery", "pepper", "sandwich", "Wendy",
];

/// Of the words so many must be read in each font, in capitals and as they are.
const READ: [usize; 2] = [34, 31];

/// Fonts of Debian that nothing was tuned on either, beside the one that ships with the crate.
const FONTS: [&str; 2] = [
    "/usr/share/fonts/truetype/crosextra/Carlito-Bold.ttf",
    "/usr/share/fonts/opentype/cantarell/Cantarell-ExtraBold.otf",
];

/// A folder of this process alone.
fn folder(name: &str) -> PathBuf {
    let folder = env::temp_dir().join(format!("bevy_crack_{name}_{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Says past the test runner that something is not there; that is a failure where all must be there.
fn passed_over(what: &str) {
    assert!(env::var_os("CRACK_REQUIRE_ALL").is_none_or(|v| v != "1"), "CRACK_REQUIRE_ALL=1, but {what}");
    let _ = writeln!(std::io::stderr(), "PASSED OVER: {what}");
}

#[test]
fn words_are_legible() {
    if !ocr::can_read() {
        return passed_over("words are not read: there is no `tesseract`");
    }
    let mut fonts = vec![("the crate's font", FONT.to_vec())];
    for path in FONTS {
        match fs::read(path) {
            Ok(font) => fonts.push((path, font)),
            Err(_) => passed_over(&format!("words are not drawn in {path}")),
        }
    }
    let folder = folder("words");
    for (name, font) in &fonts {
        for (capitals, at_least) in [true, false].into_iter().zip(READ) {
            let words = WORDS.map(|word| if capitals { word.to_uppercase() } else { word.to_owned() });
            let mut pictures = Vec::new();
            for (seed, word) in (1..).zip(&words) {
                let (picture, strokes) =
                    ocr::draw(ocr::word(font, word).unwrap(), seed, VoronoiParams::DEFAULT).unwrap();
                assert!(strokes.covered >= 0.95, "{word}: {strokes:?}");
                let path = folder.join(format!("{word}.png"));
                picture.save(&path).unwrap();
                pictures.push(path);
            }
            let texts = ocr::read(&pictures, &folder).unwrap();
            let misread: Vec<_> =
                words.iter().zip(&texts).filter(|(word, text)| !text.eq_ignore_ascii_case(word)).collect();
            let n_read = words.len() - misread.len();
            println!("{n_read} of {} words in {name}, misread: {misread:?}", words.len());
            assert!(n_read >= at_least, "{n_read} words read in {name}, misread: {misread:?}");
        }
    }
    fs::remove_dir_all(folder).unwrap();
}

/// Text that cannot be drawn gives an empty guide or its boxes, and a map in any case.
#[test]
fn g2_any_text_is_a_guide() {
    let long = "endless ".repeat(5_000);
    let lines = "\n".repeat(1_000) + "x";
    let all = [
        ("", false),
        ("   ", false),
        ("\n\n", false),
        ("\u{0}\t\u{7f}", true),
        ("\u{200d}\u{301}", true),
        ("漢字 Ω ж", true),
        ("مرحبا", true),
        ("👩‍👩‍👧", true),
        ("A", true),
        (&lines, true),
        (&long, true),
    ];
    for size in [UVec2::ONE, UVec2::new(1, 300), UVec2::new(90, 3), UVec2::splat(64)] {
        for (text, may_have_ink) in all {
            let start: String = text.chars().take(20).collect();
            let guide = draw_text(FONT, text, size, f32::INFINITY).unwrap();
            assert_eq!(guide.size(), size);
            assert!(guide.as_slice().iter().all(|ink| (0.0..=1.0).contains(ink)), "{start:?}");
            let has_ink = guide.as_slice().iter().any(|&ink| ink > 0.0);
            assert!(may_have_ink || !has_ink, "{start:?} at {size}");
            assert!(has_ink || size != UVec2::splat(64) || !["A", "漢字 Ω ж"].contains(&text), "{start:?}");
            let params = VoronoiParams { layout: SiteLayout::StrokePairs, ..VoronoiParams::DEFAULT };
            let (map, seams) = VoronoiBake::new(params, vec![Guide::new(guide)], size, 1).unwrap().finish();
            assert_eq!(map.sites().len(), 175, "{start:?} at {size}");
            assert!(seams.seams.iter().flat_map(|seam| &seam.points).all(|point| point.width.is_finite()));
        }
    }
    assert!(draw_text(b"no font", "A", UVec2::splat(9), f32::INFINITY).is_none());
    assert!(draw_text(&[], "A", UVec2::splat(9), f32::INFINITY).is_none());
    assert!(draw_text(&FONT[..200], "A", UVec2::splat(9), f32::INFINITY).is_none());
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
        // What makes pictures of texels that are there already takes no more memory than they do. Files: `src/plugin/source/png.rs`.
        let (size, few) = (UVec2::splat(side), [0; 44]);
        assert!(ink_of(size, &few).is_none() && lightness(size, &few).is_none());
        assert!(CrackMask::from_picture(size, &few).is_err());
        assert!(Grid::from_vec(size, vec![0.0f32; 11]).is_none());
        let params = VoronoiParams::DEFAULT;
        assert!(side == 8_193 || VoronoiBake::new(params, Vec::new(), size, 1).is_err(), "{side}");
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
    // Texels that do not fit their size, for all that reads pictures. Files: `src/plugin/source/png.rs`.
    let size = UVec2::new(9, 7);
    for n in [0, 1, 4 * 62, 4 * 63, 4 * 64, 8 * 63] {
        let (texels, fits) = (vec![200; n], n == 4 * 63);
        assert_eq!(ink_of(size, &texels).is_some(), fits, "{n} bytes");
        assert_eq!(lightness(size, &texels).is_some(), fits, "{n} bytes");
        assert_eq!(CrackMask::from_picture(size, &texels).is_ok(), fits, "{n} bytes");
        assert_eq!(CrackMask::weak_from_picture(size, &texels).is_ok(), fits, "{n} bytes");
        assert_eq!(CrackMask::forbidden_from_alpha(size, &texels).is_ok(), fits, "{n} bytes");
        assert!(Grid::from_vec(size, texels).is_none(), "{n} values");
    }
    assert!(Grid::from_vec(size, vec![0u8; 63]).is_some());
    for size in [UVec2::ZERO, UVec2::new(0, 7), UVec2::new(9, 0)] {
        assert!(
            CrackMask::from_picture(size, &[]).is_err()
                && VoronoiBake::new(VoronoiParams::DEFAULT, Vec::new(), size, 1).is_err()
        );
    }
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
