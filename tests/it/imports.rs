//! Which file of the crate imports which: files import each other in one direction, and so do the rooms.
//!
//! A file imports another one if it names an item of it through a path: in a `use`, in code, in a type, in a macro or in
//! an attribute. A name that a parent hands on (`pub use`, or a `use` that its children reach) counts as an import of the file
//! that defines it. Tests, comments and strings do not count, nor does a parent's re-export of what its children define. Methods that are called on values
//! are not seen, wherever they are defined.
//!
//! Two files of one folder may import each other. The head of a folder, `room.rs` or `room/mod.rs`, is of that folder.
//! A room is a file or a folder directly in `src`, and one directly in `src/plugin`; no rooms import each other in a circle.

mod graph;
mod source;

use graph::Graph;
use source::Imports;
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

/// Whether a circle of files may be: two, and of one folder, to which its head is counted.
fn is_pair_of_a_folder(circle: &BTreeSet<&str>) -> bool {
    let folders = |path: &str| {
        let of = path.rsplit_once('/').map_or("", |(folder, _)| folder).to_owned();
        [of, path.trim_end_matches(".rs").to_owned()]
    };
    let all: Vec<_> = circle.iter().map(|path| folders(path)).collect();
    all.len() == 2 && all[0].iter().any(|folder| all[1].contains(folder))
}

/// The room of a file: the file or folder directly in `folder` that it is or is in.
fn room_in(folder: &str, file: &str) -> Option<String> {
    let inside = file.strip_prefix(folder)?;
    let room = inside.split_once('/').map_or(inside.trim_end_matches(".rs"), |(room, _)| room);
    (file != "lib.rs").then(|| room.into())
}

fn sources() -> BTreeMap<String, String> {
    fn walk(folder: &Path, root: &Path, out: &mut BTreeMap<String, String>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, root, out);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let name = path.strip_prefix(root).unwrap().to_str().unwrap().replace('\\', "/");
                out.insert(name, fs::read_to_string(&path).unwrap());
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut out = BTreeMap::new();
    walk(&root, &root, &mut out);
    out
}

#[test]
fn files_and_rooms_import_each_other_in_one_direction() {
    let imports = Imports::of(&sources());
    let files = Graph::of_files(&imports);
    let rooms = Graph::of(&imports, |file| room_in("", file));
    let parts = Graph::of(&imports, |file| room_in("plugin/", file));
    let circles: Vec<_> = files.circles().into_iter().filter(|circle| !is_pair_of_a_folder(circle)).collect();
    println!(
        "{} files, {} lines, {} imports, {} circles of {} files in all, {} rooms of the plugin with {} imports against their order",
        imports.files.len(),
        imports.lines,
        imports.edges.len(),
        circles.len(),
        circles.iter().map(BTreeSet::len).sum::<usize>(),
        parts.nodes.len(),
        parts.order().1
    );
    println!("order of the rooms: {:?}\nof those of the plugin: {:?}", rooms.order().0, parts.order().0);
    let found = [
        files.check("files", is_pair_of_a_folder),
        rooms.check("rooms", |_| false),
        parts.check("rooms of the plugin", |_| false),
    ];
    let told: String = found.into_iter().filter_map(Result::err).collect();
    assert!(told.is_empty(), "\n{told}");
}

/// The imports of a made-up crate, as `a.rs -> b.rs`.
fn edges(files: &[(&str, &str)]) -> Vec<String> {
    let sources = files.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned())).collect();
    let graph = Graph::of_files(&Imports::of(&sources));
    graph.edges.keys().map(|(from, to)| format!("{from} -> {to}")).collect()
}

/// What is told of a made-up crate.
fn told(files: &[(&str, &str)]) -> Result<(), String> {
    let sources = files.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned())).collect();
    Graph::of_files(&Imports::of(&sources)).check("files", is_pair_of_a_folder)
}

#[test]
fn every_way_to_name_an_item_is_an_import() {
    let b = ("b.rs", "pub struct B; pub fn f() {} pub mod deep { pub struct D; }");
    for text in [
        "use super::b::B;",
        "use crate::b::{self, f as g}; ",
        "use crate::b; fn h() { b::f() }",
        "fn h() { use crate::b; b::f() }",
        "fn h() { crate::b::f() }",
        "fn h(_: super::b::B) {}",
        "fn h() -> Vec<Option<crate::b::deep::D>> { vec![] }",
        "fn h(x: u8) -> bool { matches!(x, crate::b::X) }",
        "fn h() { dbg!(S { x: 1, ..crate::b::S }) }",
        "#[derive(Debug)] #[require(super::b::B)] struct S;",
        "mod inner { use super::super::b::f; }",
        "use super::b::*; fn h() { f() }",
        "use super::*; fn h() { b::f() }",
        "use crate::again::B as C;",
        "use crate::B; ",
        "impl super::b::B { fn h() {} }",
        "#[cfg(not(test))] use super::b::B;",
    ] {
        let lib = ("lib.rs", "mod a; mod b; mod again { pub use crate::b::B; } pub use again::B;");
        assert_eq!(edges(&[lib, ("a.rs", text), b]), ["a.rs -> b.rs"], "{text}");
    }
}

#[test]
fn what_is_no_import_is_not_counted() {
    for text in [
        "//! [`crate::b::f`]\n// crate::b::f()\n/// `crate::b::f`\nfn h() { let _ = \"crate::b::f()\"; }",
        "fn h(x: &str) { println!(\"crate::b::f {x}\") }",
        "#[cfg(test)] mod tests { use crate::b::f; }",
        "#[cfg(all(test, feature = \"x\"))] use crate::b::f;",
        "#[cfg(test)] fn h() { crate::b::f() }",
        "struct S; impl S { #[cfg(test)] fn h() { crate::b::f() } }",
        "#[cfg(test)] mod tests;",
        "use std::b::f; use ::b::f as g;",
        "fn f() {} fn h() { f() }",
    ] {
        let files = [("lib.rs", "pub mod a; pub mod b;"), ("a.rs", text), ("b.rs", "pub fn f() {}")];
        assert_eq!(edges(&files), [""; 0], "{text}");
    }
}

#[test]
fn a_parent_does_not_hide_a_circle() {
    let files = [
        ("lib.rs", "mod room;"),
        ("room/mod.rs", "mod a; mod b; mod c; pub use a::A; pub(super) use b::B; use c::C;"),
        ("room/a.rs", "use super::B; pub struct A;"),
        ("room/b.rs", "use super::C; pub struct B;"),
        ("room/c.rs", "use crate::room::A; pub struct C;"),
    ];
    let expected = ["room/a.rs -> room/b.rs", "room/b.rs -> room/c.rs", "room/c.rs -> room/a.rs"];
    // The parent's private `use` is an import of its own; re-exports are none, unless it names them in its code.
    assert_eq!(edges(&files)[..3], expected);
    assert_eq!(edges(&files)[3..], ["room/mod.rs -> room/c.rs"]);
    let text = told(&files).unwrap_err();
    assert!(text.contains("3 files import each other in a circle"), "{text}");
    assert!(
        text.contains("room/a.rs:1 -> room/b.rs\n    room/b.rs:1 -> room/c.rs\n    room/c.rs:1 -> room/a.rs"),
        "{text}"
    );
    let parent = "mod a; mod b; pub use a::A; fn f(_: A) {}";
    let named = [("lib.rs", "mod room;"), ("room.rs", parent), ("room/a.rs", "pub struct A;"), ("room/b.rs", "")];
    assert_eq!(edges(&named), ["room.rs -> room/a.rs"]);
}

#[test]
fn a_function_with_the_name_of_its_module_is_found() {
    let files = [
        ("lib.rs", "mod room;"),
        ("room.rs", "mod land; pub use land::land; mod other;"),
        ("room/land.rs", "pub fn land() {}"),
        ("room/other.rs", "fn f() { super::land() }"),
    ];
    assert_eq!(edges(&files), ["room/other.rs -> room/land.rs"]);
}

#[test]
fn two_files_of_a_folder_may_import_each_other() {
    let pair = [("room/a.rs", "use super::b::B; pub struct A;"), ("room/b.rs", "use super::a::A; pub struct B;")];
    let of_a_folder = [&[("lib.rs", "mod room;"), ("room/mod.rs", "mod a; mod b;")], &pair[..]].concat();
    assert_eq!(told(&of_a_folder), Ok(()));
    let head = ("room.rs", "mod a; use a::A; pub struct R;");
    assert_eq!(told(&[("lib.rs", "mod room;"), head, ("room/a.rs", "use super::R; pub struct A;")]), Ok(()));
    let apart =
        [("lib.rs", "mod a; mod room;"), ("a.rs", "use crate::room::b::B; pub struct A;"), ("room.rs", "pub mod b;")];
    let text = told(&[&apart[..], &[("room/b.rs", "use crate::a::A; pub struct B;")]].concat()).unwrap_err();
    assert!(text.contains("2 files import each other"), "{text}");
}

#[test]
fn rooms_are_the_folders_and_files_at_the_top() {
    assert_eq!(room_in("", "growth/field/settle.rs").as_deref(), Some("growth"));
    assert_eq!(room_in("", "preset.rs"), room_in("", "preset/file.rs"));
    assert_eq!(room_in("", "lib.rs"), None);
    assert_eq!(room_in("plugin/", "plugin/bake.rs"), room_in("plugin/", "plugin/bake/job.rs"));
    assert_eq!(room_in("plugin/", "growth/mod.rs"), None);
    // No circle of files, but one of rooms.
    let files = [
        ("lib.rs", "mod x; mod y;"),
        ("x/mod.rs", "pub mod a; pub mod b;"),
        ("x/a.rs", "use crate::y::c::C;"),
        ("x/b.rs", "pub struct B;"),
        ("y/mod.rs", "pub mod c; pub mod d;"),
        ("y/c.rs", "pub struct C;"),
        ("y/d.rs", "use crate::x::b::B; use super::super::x::b;"),
    ];
    let sources = files.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned())).collect();
    let imports = Imports::of(&sources);
    assert_eq!(Graph::of_files(&imports).check("files", is_pair_of_a_folder), Ok(()));
    let rooms = Graph::of(&imports, |file| room_in("", file));
    let text = rooms.check("rooms", |_| false).unwrap_err();
    assert!(text.contains("x/a.rs:1 -> y/c.rs") && text.contains("y/d.rs:1 -> x/b.rs"), "{text}");
    assert_eq!(rooms.order().1, 1);
}
