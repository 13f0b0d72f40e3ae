//! The pages in `docs` and the README: their links lead somewhere, and what they list is what there is.
//!
//! The tables of `docs/presets.md` are made from the code: `UPDATE_DOCS=1 cargo test -p bevy_crack docs` writes them anew, and still fails.

mod source;

use bevy_crack::{
    CrackPreset,
    growth::GrowthParams,
    paint::{Cel, ColorStop, Facets, Look},
    raster::{CrushedZone, Profile, Veil},
};
use source::{Source, default_of};
use std::{
    collections::BTreeMap,
    fmt::{Debug, Write as _},
    fs,
    path::{Path, PathBuf},
};
use syn::{Expr, Type};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All files below a folder with this extension, in order.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut out = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            out.extend(files(&path, extension));
        } else if path.extension().is_some_and(|is| is == extension) {
            out.push(path);
        }
    }
    out.sort();
    out
}

fn pages() -> Vec<PathBuf> {
    let mut pages = files(&root().join("docs"), "md");
    pages.extend(["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "assets/CREDITS.md"].map(|page| root().join(page)));
    pages
}

fn page(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap()
}

/// A page without its blocks of code.
fn prose(text: &str) -> String {
    let mut is_code = false;
    let lines = text.lines().filter(|line| {
        is_code ^= line.trim_start().starts_with("```");
        !is_code
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// The targets of a page's links and pictures: `[text](target)`.
fn targets(text: &str) -> Vec<String> {
    let text = prose(text);
    let after = text.match_indices("](").map(|(at, _)| &text[at + 2..]);
    after.filter_map(|rest| rest.split_once(')')).map(|(target, _)| target.to_owned()).collect()
}

/// The anchors of a page's headings, as the usual viewers make them.
fn anchors(text: &str) -> Vec<String> {
    let headings = prose(text);
    let headings = headings.lines().filter(|line| line.starts_with('#'));
    let anchor = |heading: &str| {
        let kept = heading.trim_start_matches('#').trim().to_lowercase();
        let kept = kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    };
    headings.map(anchor).collect()
}

/// What is wrong with the links of a page.
fn dead_links(path: &Path, text: &str) -> Vec<String> {
    let is_dead = |target: &String| {
        if target.contains("://") {
            return false;
        }
        let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
        let file = if file.is_empty() { path.to_owned() } else { path.parent().unwrap().join(file) };
        let is_page = file.extension().is_some_and(|extension| extension == "md");
        !file.exists()
            || is_page && !anchor.is_empty() && {
                let text = if file == path { text.to_owned() } else { fs::read_to_string(&file).unwrap() };
                !anchors(&text).iter().any(|other| other == anchor)
            }
    };
    targets(text).into_iter().filter(is_dead).collect()
}

#[test]
fn links_and_pictures_are_there() {
    for path in pages() {
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(dead_links(&path, &text), [""; 0], "in {}", path.display());
    }
}

#[test]
fn dead_links_are_found() {
    let path = root().join("docs/faults.md");
    let text =
        "[a](../README.md) ![b](images/gallery.png) [c](https://bevy.org) [d](#here)\n# Here\n```\n[e](gone)\n```";
    assert_eq!(dead_links(&path, text), [""; 0]);
    let text = "[a](../READYOU.md) ![b](images/none.png) [c](#here) [d](../README.md#nowhere)";
    assert_eq!(dead_links(&path, text), ["../READYOU.md", "images/none.png", "#here", "../README.md#nowhere"]);
}

/// Every page is to be found from the README, and every picture is shown somewhere.
#[test]
fn nothing_lies_idle() {
    let readme = page("README.md");
    for path in files(&root().join("docs"), "md") {
        let name = format!("docs/{}", path.file_name().unwrap().to_str().unwrap());
        assert!(targets(&readme).iter().any(|target| target.starts_with(&name)), "the README has no link to {name}");
    }
    let shown: Vec<_> = pages().into_iter().flat_map(|path| targets(&fs::read_to_string(path).unwrap())).collect();
    for entry in fs::read_dir(root().join("docs/images")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(shown.iter().any(|target| target.ends_with(&name)), "no page shows {name}");
    }
}

/// The values of a struct's fields, as `Debug` writes them.
fn values(of: &impl Debug) -> BTreeMap<String, String> {
    let text = format!("{of:?}");
    let Ok(Expr::Struct(parsed)) = syn::parse_str::<Expr>(&text) else { panic!("no struct: {text}") };
    let mut values = BTreeMap::new();
    for field in parsed.fields {
        let syn::Member::Named(name) = &field.member else { continue };
        // By the text, as tokens would be written with blanks between them.
        let start = text.find(&format!("{name}: ")).unwrap() + name.to_string().len() + 2;
        let (mut depth, mut end) = (0, text.len());
        for (at, c) in text[start..].char_indices() {
            match c {
                '(' | '[' | '{' => depth += 1,
                ')' | ']' | '}' if depth > 0 => depth -= 1,
                ',' | '}' if depth == 0 => {
                    end = start + at;
                    break;
                }
                _ => {}
            }
        }
        values.insert(name.to_string(), text[start..end].trim().to_owned());
    }
    values
}

fn type_name(ty: &Type) -> String {
    match ty {
        Type::Path(path) => {
            let last = path.path.segments.last().unwrap();
            match (last.ident.to_string().as_str(), &last.arguments) {
                ("Cow", _) => "list of `ColorStop`".into(),
                (name, syn::PathArguments::AngleBracketed(inner)) => {
                    let inner = inner.args.iter().find_map(|argument| match argument {
                        syn::GenericArgument::Type(ty) => Some(type_name(ty)),
                        _ => None,
                    });
                    format!("`{name}<{}>`", inner.unwrap_or_default().trim_matches('`'))
                }
                (name, _) => format!("`{name}`"),
            }
        }
        Type::Array(array) => format!("`[{}; 3]`", type_name(&array.elem).trim_matches('`')),
        _ => panic!("a field of another kind"),
    }
}

/// The unit that a field's documentation tells.
fn unit(doc: &str, ty: &str, range: Option<&String>) -> &'static str {
    let doc = doc.to_lowercase();
    let has = |text: &str| doc.contains(text);
    match () {
        () if ty == "`[f32; 3]`" => "sRGB",
        () if range.is_none() || has("share of") || has("shares of") => "",
        () if has("pattern units for each step") => "pattern units a step",
        () if has("pattern unit") => "pattern units",
        () if has("radians") => "radians",
        () if has("texels at the") => "texels",
        () if has("radii.") => "radii",
        () if has("a second") => "steps a second",
        () => "",
    }
}

fn is_range(text: &str) -> bool {
    let is_number = |text: &str| text.parse::<f64>().is_ok();
    text.split_once("..=").is_some_and(|(min, max)| is_number(min) && is_number(max))
}

/// What a documentation tells beside unit, range and default, which have columns of their own.
fn meaning(doc: &str) -> String {
    let is_column = |part: &str| {
        let part = part.trim().trim_end_matches('.').to_lowercase();
        let part = part.strip_prefix("range ").unwrap_or(&part).to_owned();
        let is_value = |text: &str| text.parse::<f64>().is_ok() || matches!(text, "false" | "none");
        part == "pattern units"
            || part == "radians"
            || part == "> 0"
            || is_range(&part)
            || part.strip_prefix("default ").is_some_and(is_value)
    };
    let mut kept = String::new();
    let doc = doc.replace("... ", "…");
    for sentence in doc.split_inclusive(". ") {
        let parts: Vec<_> = sentence.split("; ").flat_map(|part| part.split(", ")).collect();
        if parts.iter().all(|part| is_column(part)) {
            continue;
        }
        let mut sentence = sentence.trim().trim_end_matches('.').to_owned();
        while let Some(cut) = sentence.rfind([',', ';'])
            && is_column(&sentence[cut + 1..])
        {
            sentence.truncate(cut);
        }
        kept.push_str(sentence.trim());
        kept.push_str(". ");
    }
    kept.trim().replace('…', "... ").replace('|', "\\|")
}

/// The table of a struct's fields.
fn table(source: &Source, name: &str, prefix: &str, default: &impl Debug) -> String {
    let has_default = name != "ColorStop";
    let (path, fields) = source.fields(name);
    let defaults = values(default);
    let mut out = String::from("| field | type | unit | range | default | what it does |\n|---|---|---|---|---|---|\n");
    for (field, ty, doc) in fields {
        let ty = type_name(&ty);
        // Colours and stops are checked in loops without their names.
        let told = doc.split([' ', ',', ';', ':']).map(|word| word.trim_end_matches('.')).find(|word| is_range(word));
        let range = source.range(&path, prefix, &field).cloned().or_else(|| told.map(ToOwned::to_owned));
        let default = &defaults[&field];
        let default = match default.matches("ColorStop").count() {
            _ if !has_default => String::new(),
            0 => format!("`{default}`"),
            stops => format!("{stops} stops"),
        };
        let shown = range.as_ref().map_or(String::new(), |range| format!("`{range}`"));
        let (unit, meaning) = (unit(&doc, &ty, range.as_ref()), meaning(&doc));
        let _ = writeln!(out, "| `{field}` | {ty} | {unit} | {shown} | {default} | {meaning} |");
    }
    out
}

/// The list of an enum's variants and their fields.
fn list(source: &Source, name: &str) -> String {
    let mut out = String::new();
    for (variant, doc) in source.variants(name) {
        let doc = doc.replace('|', "\\|");
        let _ = match variant.split_once('.') {
            Some((_, field)) => writeln!(out, "  - `{field}`: {doc}"),
            None => writeln!(out, "- `{variant}`: {doc}"),
        };
    }
    out
}

/// The parts of `docs/presets.md` that are made from the code, by name.
fn generated() -> Vec<(&'static str, String)> {
    let source = Source::read();
    let preset = CrackPreset::default();
    let top = |name: &str| ["steps_per_second", "follows_lines"].contains(&name);
    let whole = table(&source, "CrackPreset", "", &WithoutParts(&preset));
    let whole = whole
        .lines()
        .filter(|line| line.split('`').nth(1).is_none_or(top) || line.starts_with("| field") || line.starts_with("|-"));
    vec![
        ("CrackPreset", whole.map(|line| format!("{line}\n")).collect()),
        ("GrowthParams", table(&source, "GrowthParams", "", &GrowthParams::DEFAULT)),
        ("MarkerLayout", list(&source, "MarkerLayout")),
        ("StartLayout", list(&source, "StartLayout")),
        ("Venation", list(&source, "Venation")),
        ("Profile", table(&source, "Profile", "profile.", &Profile::DEFAULT)),
        ("Look", table(&source, "Look", "", &Look::default())),
        ("ColorStop", table(&source, "ColorStop", "ramp.", &ColorStop { depth: 0.0, color: [0.0; 3], cover: 0.0 })),
        ("Facets", table(&source, "Facets", "facets.", &Facets::DEFAULT)),
        ("CrushedZone", table(&source, "CrushedZone", "crushed.", &CrushedZone::DEFAULT)),
        ("Veil", table(&source, "Veil", "veil.", &Veil::DEFAULT)),
        ("Cel", table(&source, "Cel", "cel.", &Cel::DEFAULT)),
    ]
}

/// A preset without what has tables of its own.
struct WithoutParts<'a>(&'a CrackPreset);

impl Debug for WithoutParts<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CrackPreset")
            .field("growth", &())
            .field("profile", &())
            .field("look", &())
            .field("steps_per_second", &self.0.steps_per_second)
            .field("follows_lines", &self.0.follows_lines)
            .finish()
    }
}

/// `text` with the generated parts in it, each between its two marks.
fn with_generated(text: &str, parts: &[(&str, String)]) -> String {
    let mut text = text.to_owned();
    for (name, part) in parts {
        let [from, to] = [format!("<!-- {name} -->\n\n"), format!("\n<!-- end of {name} -->")];
        let start = text.find(&from).unwrap_or_else(|| panic!("the page has no place for {name}")) + from.len();
        let end = start + text[start..].find(&to).unwrap_or_else(|| panic!("{name} has no end"));
        text.replace_range(start..end, part);
    }
    text
}

#[test]
fn the_tables_of_presets_are_those_of_the_code() {
    let text = page("docs/presets.md");
    let anew = with_generated(&text, &generated());
    if anew != text && std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(root().join("docs/presets.md"), &anew).unwrap();
    }
    for (old, new) in text.lines().zip(anew.lines()) {
        assert_eq!(old, new, "docs/presets.md differs from the code: UPDATE_DOCS=1 writes it anew");
    }
    assert_eq!(text, anew, "docs/presets.md is shorter or longer than the code has it");
}

#[test]
fn the_tables_have_what_the_code_has() {
    let parts: BTreeMap<_, _> = generated().into_iter().collect();
    let row = |table: &str, field: &str| {
        let start = format!("| `{field}` |");
        let row = parts[table].lines().find(|line| line.starts_with(&start));
        row.unwrap_or_else(|| panic!("no {field} in {table}")).to_owned()
    };
    let begins = |row: String, with: &str| assert!(row.starts_with(with), "{row}");
    begins(
        row("GrowthParams", "reach"),
        "| `reach` | `f32` | pattern units | `0.01..=64` | `0.6` | Radius around a hit",
    );
    begins(row("GrowthParams", "draw_islands"), "| `draw_islands` | `bool` |  |  | `false` | ");
    begins(row("Profile", "wall"), "| `wall` | `f32` |  | `0..=1` | `0.6` | How much of the half width is wall");
    begins(row("Look", "relief"), "| `relief` | `f32` | pattern units | `0..=1` | `0.012` | Height of the walls");
    begins(row("Cel", "ink"), "| `ink` | `[f32; 3]` | sRGB | `0..=1` | `[0.075, 0.05, 0.055]` | ");
    begins(
        row("CrackPreset", "steps_per_second"),
        "| `steps_per_second` | `f32` | steps a second | `0..=10000` | `60.0` |",
    );
    // Ranges are those that are checked: of each number, the ends are allowed, and nothing beyond.
    let mut checked = 0;
    for line in parts["GrowthParams"].lines().skip(2) {
        let cells: Vec<_> = line.split('|').map(|cell| cell.trim().trim_matches('`')).collect();
        let Some((min, max)) = cells[4].split_once("..=") else { continue };
        let beyond = [min, max].map(|end| end.parse::<f64>().unwrap());
        for value in [beyond[0] - 1.0, beyond[1] + 1.0].iter().filter(|value| cells[2] != "u32" || **value >= 0.0) {
            let mut params = GrowthParams::DEFAULT;
            params.set(cells[1], &value.to_string()).unwrap();
            assert!(params.validate().is_err(), "{} may be {value}", cells[1]);
            checked += 1;
        }
    }
    assert!(checked > 80, "{checked}");
}

/// Names in backticks that begin a row or an item.
fn listed(text: &str) -> Vec<&str> {
    let starts = text.lines().filter_map(|line| line.strip_prefix("| `").or_else(|| line.strip_prefix("- `")));
    starts.filter_map(|line| line.split_once('`')).map(|(name, _)| name).collect()
}

#[test]
fn every_preset_and_every_error_has_its_row() {
    let presets = page("docs/presets.md");
    for name in CrackPreset::NAMES {
        assert!(listed(&presets).contains(&name), "docs/presets.md has no row for {name}");
    }
    for name in Look::NAMES {
        assert!(presets.contains(&format!("`Look::{}`", name.to_uppercase())), "docs/presets.md does not name {name}");
    }
    let pitfalls = page("docs/pitfalls.md");
    let source = Source::read();
    for error in ["CrackError", "ShardsError"] {
        for (variant, _) in source.variants(error).iter().filter(|(variant, _)| !variant.contains('.')) {
            assert!(
                listed(&pitfalls).contains(&variant.as_str()),
                "docs/pitfalls.md has no row for {error}::{variant}"
            );
        }
    }
}

/// Tables that are written by hand, of types that need an engine or have more to tell: nothing is missing, and their numbers are right.
#[test]
fn tables_by_hand_are_right() {
    let source = Source::read();
    let mut compared = 0;
    for (name, of, is_whole) in [
        ("docs/performance_and_memory.md", "CrackBudget", true),
        ("docs/shattering.md", "ShatterCracks", true),
        ("docs/guided_cracks.md", "VoronoiParams", false),
    ] {
        let text = page(name);
        for (field, ..) in source.fields(of).1 {
            let row = text.lines().find(|line| line.starts_with(&format!("| `{field}`")));
            assert!(row.is_some() || !is_whole, "{name} has no row for {of}::{field}");
            let told = row.and_then(|row| row.split('|').nth(2)?.trim().parse::<f64>().ok());
            if let (Some(told), Some(default)) = (told, default_of(&source, of, &field)) {
                assert_eq!(told, default, "{of}::{field} in {name}");
                compared += 1;
            }
        }
    }
    assert!(compared > 10, "{compared}");
    for (name, of) in [
        ("docs/guided_cracks.md", "GuideSource"),
        ("docs/guided_cracks.md", "GuidedAppearance"),
        ("docs/sprites.md", "CrackMaskSource"),
    ] {
        let text = page(name);
        let rows: Vec<_> = listed(&text).into_iter().filter_map(|row| row.split(['(', ' ']).next()).collect();
        for (variant, _) in source.variants(of).iter().filter(|(variant, _)| !variant.contains('.')) {
            assert!(rows.contains(&variant.as_str()), "{name} has no row for {of}::{variant}");
        }
    }
}
