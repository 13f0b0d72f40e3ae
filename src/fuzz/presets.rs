//! Preset files.

use super::{Input, run};
use crate::{CrackPreset, preset::PresetError};

/// What is put into a file in place of something else.
const PARTS: [&str; 28] = [
    "NaN",
    "inf",
    "-inf",
    "1e999",
    "-1",
    "0",
    "4294967295",
    "4294967296",
    "1e-45",
    "0.5",
    "true",
    "()",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ",",
    ":",
    "\"",
    "Some(1)",
    "None",
    "/*",
    "//",
    "Rays(sectors: 3, jitter: 0.5, through: 1)",
    "Strands(count: 9)",
    "\u{1F4A5}",
];

/// A file: the text itself, or that of a preset with some of its words replaced.
fn text(bytes: &[u8]) -> String {
    if bytes.first().is_none_or(|&first| first == b'(') {
        return String::from_utf8_lossy(bytes).into_owned();
    }
    let input = &mut Input::new(bytes);
    let preset = CrackPreset::named(input.choose(&CrackPreset::NAMES)).unwrap();
    let text = preset.scaled(input.mostly(0.01, 100.0, 16)).to_ron().unwrap();
    let mut words: Vec<&str> = text.split_inclusive([' ', ',', '\n', '(', ')']).collect();
    for _ in 0..input.below(6) {
        let at = input.below(words.len() as u32) as usize;
        match input.byte() % 8 {
            0 => drop(words.remove(at)),
            1 => words.insert(at, words[input.below(words.len() as u32) as usize]),
            2 => words.insert(at, input.choose(&PARTS)),
            3 => words.truncate(at + 1),
            _ => words.splice(at..=at, [input.choose(&PARTS), ","]).for_each(drop),
        }
        if words.is_empty() {
            break;
        }
    }
    let numbers: Vec<String> = words
        .into_iter()
        .map(|word| {
            let number = word.trim_end_matches([',', '\n']);
            // A few numbers become others.
            if number.parse::<f32>().is_ok() && input.once_in(24) {
                word.replace(number, &input.odd().to_string())
            } else {
                word.to_owned()
            }
        })
        .collect();
    numbers.concat()
}

fn target(bytes: &[u8]) {
    let text = text(bytes);
    match CrackPreset::from_ron(&text) {
        Ok(preset) => {
            assert_eq!(preset.validate(), Ok(()));
            let written = preset.to_ron().unwrap();
            assert_eq!(CrackPreset::from_ron(&written).as_ref(), Ok(&preset), "{written}");
            for by in [0.0, 0.01, 3.0, 1e9, f32::NAN] {
                let scaled = preset.scaled(by);
                assert_eq!(scaled.validate(), Ok(()), "{by}: {preset:?}");
            }
            assert_eq!(preset.growth.varied(u64::from(bytes.len() as u32)).validate(), Ok(()), "{:?}", preset.growth);
        }
        Err(PresetError::Unreadable { line, column, .. }) => {
            assert!((1..=1 + text.lines().count()).contains(&line) && column > 0, "{line} {column}: {text}");
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

#[test]
fn presets() {
    run("presets", 1500, target);
}
