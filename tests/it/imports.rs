//! Which file of the crate imports which: files import each other in one direction, and so do the rooms.
//!
//! A file imports another one if it names an item of it through a path: in a `use`, in code, in a type, in a macro or in
//! an attribute. A name that a parent hands on (`pub use`, or a `use` that its children reach) counts as an import of the file
//! that defines it. Tests, comments and strings do not count, nor does a parent's re-export of what its children define.
//!
//! Two files of one folder may import each other. The head of a folder, `room.rs` or `room/mod.rs`, is of that folder.
//! A room is a file or a folder directly in `src`, and one directly in `src/plugin`; no rooms import each other in a circle.

use proc_macro2::{TokenStream, TokenTree};
use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
    fs,
    path::Path,
};
use syn::{Attribute, ImplItem, Item, ItemUse, Meta, UseTree, Visibility, spanned::Spanned as _, visit, visit::Visit};

/// Files that are in a circle today. New ones are not let in, and one that has left its circle is to leave the list.
const KNOWN: &[&str] = &[
    "growth/arrest.rs",
    "growth/closed.rs",
    "growth/divide.rs",
    "growth/field.rs",
    "growth/field/settle.rs",
    "growth/impact.rs",
    "growth/layout.rs",
    "growth/links.rs",
    "growth/markers.rs",
    "growth/params.rs",
    "growth/plan.rs",
    "growth/pull.rs",
    "growth/rays.rs",
    "growth/step.rs",
    "growth/width.rs",
    "plugin/activate.rs",
    "plugin/bake.rs",
    "plugin/bake/begin.rs",
    "plugin/bake/finish.rs",
    "plugin/bake/job.rs",
    "plugin/bake/land.rs",
    "plugin/carrier.rs",
    "plugin/clock.rs",
    "plugin/film.rs",
    "plugin/film/shot.rs",
    "plugin/freeze.rs",
    "plugin/grow.rs",
    "plugin/guided.rs",
    "plugin/heal.rs",
    "plugin/hit.rs",
    "plugin/layout.rs",
    "plugin/lit.rs",
    "plugin/mask.rs",
    "plugin/material.rs",
    "plugin/material/split.rs",
    "plugin/mod.rs",
    "plugin/paint.rs",
    "plugin/picture.rs",
    "plugin/plan.rs",
    "plugin/prepare.rs",
    "plugin/preset.rs",
    "plugin/queue.rs",
    "plugin/shards/body.rs",
    "plugin/shards/broken.rs",
    "plugin/shards/drawn.rs",
    "plugin/shards/fly.rs",
    "plugin/shards/form.rs",
    "plugin/shards/holes.rs",
    "plugin/shards/order.rs",
    "plugin/shards/release.rs",
    "plugin/sprite.rs",
    "plugin/surface.rs",
    "plugin/surfaces.rs",
    "plugin/textures.rs",
    "plugin/warm.rs",
    "plugin/watch.rs",
    "raster/layer/broken.rs",
    "raster/layer/bruise.rs",
    "raster/layer/crushed.rs",
    "raster/layer/mod.rs",
    "raster/layer/plates.rs",
    "raster/layer/veil.rs",
];

/// Rooms of the plugin that are in a circle today, in the same way.
const KNOWN_ROOMS: &[&str] = &[
    "activate", "bake", "carrier", "clock", "film", "freeze", "grow", "guided", "heal", "hit", "layout", "lit", "mask",
    "material", "mod", "paint", "picture", "plan", "prepare", "preset", "queue", "shards", "sprite", "surface",
    "surfaces", "textures", "warm", "watch",
];

/// What a name stands for in a module.
enum Named {
    Module(usize),
    Item,
    Alias(Vec<String>),
}

struct Module {
    file: usize,
    parent: Option<usize>,
    /// Paths of the modules whose names are all here: `use path::*`.
    globs: Vec<Vec<String>>,
    names: BTreeMap<String, Vec<Named>>,
    items: Vec<Item>,
}

/// A module, or an item, which is of a module.
#[derive(Clone, Copy, PartialEq)]
enum Target {
    Module(usize),
    Item(usize),
}

/// One name that a `use` tree brings.
struct Used {
    path: Vec<String>,
    name: Option<String>,
    is_glob: bool,
    line: usize,
}

/// The modules of a crate and the imports between its files.
struct Imports {
    files: Vec<String>,
    lines: usize,
    modules: Vec<Module>,
    /// From file to file, with the first line that does it.
    edges: BTreeMap<(usize, usize), usize>,
}

/// Whether an attribute keeps the item for tests: `#[cfg(test)]`, `#[cfg(all(test, ..))]`.
fn is_test(attributes: &[Attribute]) -> bool {
    fn names_test(tokens: TokenStream) -> bool {
        let mut skip = false;
        tokens.into_iter().any(|token| match token {
            TokenTree::Ident(ident) => {
                skip = ident == "not" || ident == "any";
                ident == "test"
            }
            TokenTree::Group(group) => !skip && names_test(group.stream()),
            _ => false,
        })
    }
    attributes.iter().any(|attribute| match &attribute.meta {
        Meta::List(list) => list.path.is_ident("cfg") && names_test(list.tokens.clone()),
        Meta::Path(path) => path.is_ident("test"),
        Meta::NameValue(_) => false,
    })
}

fn attributes_of(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(i) => &i.attrs,
        Item::Enum(i) => &i.attrs,
        Item::Fn(i) => &i.attrs,
        Item::Impl(i) => &i.attrs,
        Item::Macro(i) => &i.attrs,
        Item::Mod(i) => &i.attrs,
        Item::Static(i) => &i.attrs,
        Item::Struct(i) => &i.attrs,
        Item::Trait(i) => &i.attrs,
        Item::Type(i) => &i.attrs,
        Item::Union(i) => &i.attrs,
        Item::Use(i) => &i.attrs,
        _ => &[],
    }
}

/// The name that an item defines.
fn name_of(item: &Item) -> Option<String> {
    let ident = match item {
        Item::Const(i) => &i.ident,
        Item::Enum(i) => &i.ident,
        Item::Fn(i) => &i.sig.ident,
        Item::Macro(i) => return i.ident.as_ref().map(ToString::to_string),
        Item::Static(i) => &i.ident,
        Item::Struct(i) => &i.ident,
        Item::Trait(i) => &i.ident,
        Item::Type(i) => &i.ident,
        Item::Union(i) => &i.ident,
        _ => return None,
    };
    Some(ident.to_string())
}

/// All that a `use` brings. One that begins with `::` brings nothing of this crate.
fn used(item: &ItemUse) -> Vec<Used> {
    fn walk(tree: &UseTree, path: &[String], out: &mut Vec<Used>) {
        let with = |name: &syn::Ident| [path, &[name.to_string()]].concat();
        let mut push = |path: Vec<String>, name: Option<String>, line: usize| {
            // `use path::{self}` is the path itself.
            let is_self = path.len() > 1 && path.last().is_some_and(|last| last == "self");
            let path = if is_self { path[..path.len() - 1].to_vec() } else { path };
            let name = name.or_else(|| path.last().cloned()).filter(|name| name != "_");
            out.push(Used { path, name, is_glob: false, line });
        };
        match tree {
            UseTree::Path(next) => walk(&next.tree, &with(&next.ident), out),
            UseTree::Name(last) => push(with(&last.ident), None, last.ident.span().start().line),
            UseTree::Rename(last) => {
                push(with(&last.ident), Some(last.rename.to_string()), last.ident.span().start().line);
            }
            UseTree::Glob(glob) => {
                let line = glob.span().start().line;
                out.push(Used { path: path.to_vec(), name: None, is_glob: true, line });
            }
            UseTree::Group(group) => group.items.iter().for_each(|tree| walk(tree, path, out)),
        }
    }
    let mut out = Vec::new();
    if item.leading_colon.is_none() {
        walk(&item.tree, &[], &mut out);
    }
    out
}

/// The `use` items within functions, which bring names to the module as far as this test goes.
struct Inner<'a>(&'a mut Vec<ItemUse>);

impl<'ast> Visit<'ast> for Inner<'_> {
    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        self.0.push(item.clone());
    }
    fn visit_item_mod(&mut self, _: &'ast syn::ItemMod) {}
}

impl Imports {
    /// Reads a crate from its sources: paths below `src`, and texts.
    fn of(sources: &BTreeMap<String, String>) -> Self {
        let mut imports = Self { files: Vec::new(), lines: 0, modules: Vec::new(), edges: BTreeMap::new() };
        imports.read("lib.rs".into(), "", None, sources);
        for module in 0..imports.modules.len() {
            let items = std::mem::take(&mut imports.modules[module].items);
            let mut walk = Walk { imports: &mut imports, module };
            items.iter().for_each(|item| walk.visit_item(item));
        }
        imports
    }

    /// Reads a file and the modules that it declares. Its children are in `folder`.
    fn read(&mut self, path: String, folder: &str, parent: Option<usize>, sources: &BTreeMap<String, String>) -> usize {
        let text = sources.get(&path).unwrap_or_else(|| panic!("there is no {path}"));
        let parsed = syn::parse_file(text).unwrap_or_else(|error| panic!("{path}: {error}"));
        self.lines += text.lines().count();
        self.files.push(path);
        self.add(self.files.len() - 1, folder, parent, parsed.items, sources)
    }

    fn add(
        &mut self,
        file: usize,
        folder: &str,
        parent: Option<usize>,
        items: Vec<Item>,
        sources: &BTreeMap<String, String>,
    ) -> usize {
        let this = self.modules.len();
        self.modules.push(Module { file, parent, globs: Vec::new(), names: BTreeMap::new(), items: Vec::new() });
        for item in items {
            if is_test(attributes_of(&item)) {
                continue;
            }
            let mut uses = Vec::new();
            if let Item::Mod(declared) = item {
                let name = declared.ident.to_string();
                let inside = if folder.is_empty() { name.clone() } else { format!("{folder}/{name}") };
                if name == "tests" {
                    continue;
                }
                let child = match declared.content {
                    Some((_, items)) => self.add(file, &inside, Some(this), items, sources),
                    None => {
                        let beside = format!("{inside}.rs");
                        let path = if sources.contains_key(&beside) { beside } else { format!("{inside}/mod.rs") };
                        self.read(path, &inside, Some(this), sources)
                    }
                };
                self.name(this, name, Named::Module(child));
                continue;
            }
            if let Some(name) = name_of(&item) {
                self.name(this, name, Named::Item);
            }
            Inner(&mut uses).visit_item(&item);
            for used in uses.iter().flat_map(used) {
                match used.name {
                    _ if used.is_glob => self.modules[this].globs.push(used.path),
                    Some(name) => self.name(this, name, Named::Alias(used.path)),
                    None => {}
                }
            }
            self.modules[this].items.push(item);
        }
        this
    }

    fn name(&mut self, module: usize, name: String, named: Named) {
        self.modules[module].names.entry(name).or_default().push(named);
    }

    /// What a path means in a module; nothing if it leads out of the crate. `seen` are the aliases that are being followed.
    fn resolve(&self, module: usize, path: &[String], seen: &mut Vec<(usize, String, usize)>) -> Vec<Target> {
        let Some((first, rest)) = path.split_first() else { return Vec::new() };
        let mut targets = match first.as_str() {
            "crate" => vec![Target::Module(0)],
            "self" => vec![Target::Module(module)],
            "super" => self.modules[module].parent.map(Target::Module).into_iter().collect(),
            name => self.look_up(module, name, seen),
        };
        for name in rest {
            let mut next = Vec::new();
            for target in targets {
                match target {
                    Target::Item(_) => next.push(target),
                    Target::Module(at) if name == "super" => next.extend(self.modules[at].parent.map(Target::Module)),
                    Target::Module(at) => {
                        let found = self.look_up(at, name, seen);
                        // What a macro defines is not seen, but is in that file.
                        next.extend(if found.is_empty() { vec![Target::Item(at)] } else { found });
                    }
                }
            }
            targets = next;
        }
        targets
    }

    fn look_up(&self, module: usize, name: &str, seen: &mut Vec<(usize, String, usize)>) -> Vec<Target> {
        let Module { names, globs, .. } = &self.modules[module];
        let mut targets = Vec::new();
        for (idx, named) in names.get(name).into_iter().flatten().enumerate() {
            match named {
                Named::Module(at) => targets.push(Target::Module(*at)),
                Named::Item => targets.push(Target::Item(module)),
                Named::Alias(path) => targets.extend(self.guarded((module, name.into(), idx), path, seen)),
            }
        }
        if targets.is_empty() {
            for (idx, glob) in globs.iter().enumerate() {
                for target in self.guarded((module, "*".into(), idx), glob, seen) {
                    if let Target::Module(at) = target
                        && at != module
                    {
                        targets.extend(self.look_up(at, name, seen));
                    }
                }
            }
        }
        targets
    }

    /// Follows an alias, but for one that is being followed.
    fn guarded(
        &self,
        alias: (usize, String, usize),
        path: &[String],
        seen: &mut Vec<(usize, String, usize)>,
    ) -> Vec<Target> {
        if seen.contains(&alias) {
            return Vec::new();
        }
        let module = alias.0;
        seen.push(alias);
        let targets = self.resolve(module, path, seen);
        seen.pop();
        targets
    }

    /// Whether a module is another one's descendant, or it.
    fn is_within(&self, mut module: usize, of: usize) -> bool {
        while module != of {
            let Some(parent) = self.modules[module].parent else { return false };
            module = parent;
        }
        true
    }

    /// The module that is a file, of one in it.
    fn head(&self, mut module: usize) -> usize {
        while let Some(parent) = self.modules[module].parent
            && self.modules[parent].file == self.modules[module].file
        {
            module = parent;
        }
        module
    }

    /// Notes that a path is named in a module. What is only re-exported is not imported, if it is of a child.
    fn note(&mut self, module: usize, path: &[String], line: usize, is_re_export: bool) {
        let from = self.modules[module].file;
        for target in self.resolve(module, path, &mut Vec::new()) {
            let Target::Item(at) = target else { continue };
            let to = self.modules[at].file;
            if to != from && !(is_re_export && self.is_within(at, self.head(module))) {
                let first = self.edges.entry((from, to)).or_insert(line);
                *first = line.min(*first);
            }
        }
    }
}

/// Notes all paths of a module's code.
struct Walk<'a> {
    imports: &'a mut Imports,
    module: usize,
}

impl Walk<'_> {
    /// Paths in what is not parsed: `matches!(x, Kind::A)`.
    fn tokens(&mut self, tokens: TokenStream) {
        let (mut path, mut line, mut colons, mut after_dot) = (Vec::new(), 0, 0, false);
        for token in tokens {
            let is_next = colons == 2;
            match token {
                TokenTree::Punct(punct) if punct.as_char() == ':' => colons += 1,
                TokenTree::Ident(ident) => {
                    if !is_next {
                        self.end(&mut path, line);
                    }
                    if is_next && path.is_empty() || after_dot {
                        (colons, after_dot) = (0, false);
                        continue;
                    }
                    path.push(ident.to_string());
                    line = ident.span().start().line;
                    colons = 0;
                }
                other => {
                    self.end(&mut path, line);
                    (colons, after_dot) = (0, matches!(&other, TokenTree::Punct(punct) if punct.as_char() == '.'));
                    if let TokenTree::Group(group) = other {
                        self.tokens(group.stream());
                    }
                }
            }
        }
        self.end(&mut path, line);
    }

    fn end(&mut self, path: &mut Vec<String>, line: usize) {
        self.imports.note(self.module, path, line, false);
        path.clear();
    }
}

impl<'ast> Visit<'ast> for Walk<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        if !is_test(attributes_of(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_impl_item(&mut self, item: &'ast ImplItem) {
        let is_for_tests = match item {
            ImplItem::Fn(item) => is_test(&item.attrs),
            ImplItem::Const(item) => is_test(&item.attrs),
            _ => false,
        };
        if !is_for_tests {
            visit::visit_impl_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        let is_re_export = !matches!(item.vis, Visibility::Inherited);
        for used in used(item) {
            self.imports.note(self.module, &used.path, used.line, is_re_export);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.leading_colon.is_none() {
            let names: Vec<_> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
            self.imports.note(self.module, &names, path.span().start().line, false);
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, called: &'ast syn::Macro) {
        visit::visit_macro(self, called);
        self.tokens(called.tokens.clone());
    }

    fn visit_attribute(&mut self, attribute: &'ast Attribute) {
        if let Meta::List(list) = &attribute.meta
            && !["cfg", "doc"].iter().any(|name| list.path.is_ident(name))
        {
            self.tokens(list.tokens.clone());
        }
    }
}

/// A graph by the names of its nodes.
#[derive(Default)]
struct Graph {
    nodes: BTreeSet<String>,
    /// With how many imports there are, and where the first one is.
    edges: BTreeMap<(String, String), (usize, String)>,
}

impl Graph {
    fn of_files(imports: &Imports) -> Self {
        Self::of(imports, |file| Some(file.into()))
    }

    /// Files as nodes of the given names, or of none.
    fn of(imports: &Imports, name: impl Fn(&str) -> Option<String>) -> Self {
        let mut graph = Self { nodes: imports.files.iter().filter_map(|file| name(file)).collect(), ..Self::default() };
        for ((from, to), line) in &imports.edges {
            let [from, to] = [from, to].map(|file| imports.files[*file].as_str());
            let (Some(a), Some(b)) = (name(from), name(to)) else { continue };
            if a != b {
                let edge = graph.edges.entry((a, b)).or_insert_with(|| (0, format!("{from}:{line} -> {to}")));
                edge.0 += 1;
            }
        }
        graph
    }

    fn next<'a>(&'a self, from: &'a str) -> impl Iterator<Item = &'a str> {
        self.edges.keys().filter(move |(a, _)| a == from).map(|(_, b)| b.as_str())
    }

    /// A shortest way from a node back to it.
    fn circle_through<'a>(&'a self, start: &'a str) -> Option<Vec<&'a str>> {
        let mut before: BTreeMap<&str, &str> = BTreeMap::new();
        let mut queue = vec![start];
        let mut done = 0;
        while let Some(&at) = queue.get(done) {
            done += 1;
            for next in self.next(at) {
                if next == start {
                    let mut way = vec![start, at];
                    while way[way.len() - 1] != start {
                        way.push(before[way[way.len() - 1]]);
                    }
                    way.reverse();
                    return Some(way);
                }
                if !before.contains_key(next) {
                    before.insert(next, at);
                    queue.push(next);
                }
            }
        }
        None
    }

    fn reached<'a>(&'a self, start: &'a str) -> BTreeSet<&'a str> {
        let (mut reached, mut queue) = (BTreeSet::new(), vec![start]);
        while let Some(at) = queue.pop() {
            queue.extend(self.next(at).filter(|next| reached.insert(*next)));
        }
        reached
    }

    /// Sets of nodes that all reach each other, of two and more.
    fn circles(&self) -> Vec<BTreeSet<&str>> {
        let reached: BTreeMap<&str, BTreeSet<&str>> =
            self.nodes.iter().map(|node| (node.as_str(), self.reached(node))).collect();
        let mut circles = Vec::new();
        for (node, to) in &reached {
            let circle: BTreeSet<&str> = to.iter().filter(|other| reached[*other].contains(node)).copied().collect();
            if circle.len() > 1 && circle.first() == Some(node) {
                circles.push(circle);
            }
        }
        circles
    }

    /// An order of the nodes, importers first, that has few imports against it, and the number of these.
    fn order(&self) -> (Vec<&str>, usize) {
        let mut left: BTreeSet<&str> = self.nodes.iter().map(String::as_str).collect();
        let (mut top, mut bottom) = (Vec::new(), Vec::new());
        while !left.is_empty() {
            let count = |node: &str| {
                let (mut to, mut from) = (0, 0);
                for ((a, b), (n, _)) in &self.edges {
                    if a == node && left.contains(b.as_str()) {
                        to += *n as i64;
                    } else if b == node && left.contains(a.as_str()) {
                        from += *n as i64;
                    }
                }
                (to, from)
            };
            let counts: Vec<_> = left.iter().map(|node| (*node, count(node))).collect();
            let last = counts.iter().find(|(_, (to, _))| *to == 0);
            let first = counts.iter().max_by_key(|(_, (to, from))| if *from == 0 { i64::MAX } else { to - from });
            let Some((node, _)) = last.or(first) else { break };
            left.remove(node);
            if last.is_some() { bottom.push(*node) } else { top.push(*node) }
        }
        top.extend(bottom.into_iter().rev());
        let place = |node: &str| top.iter().position(|other| *other == node);
        let against = self.edges.iter().filter(|((a, b), _)| place(a) > place(b)).map(|(_, (n, _))| n).sum();
        (top, against)
    }

    /// Compares the circles with those that are known, and tells what is wrong.
    fn check(&self, what: &str, is_allowed: impl Fn(&BTreeSet<&str>) -> bool, known: &[&str]) -> Result<(), String> {
        let circles: Vec<_> = self.circles().into_iter().filter(|circle| !is_allowed(circle)).collect();
        let mut told = String::new();
        let mut shown = BTreeSet::new();
        for circle in &circles {
            let new: Vec<_> = circle.iter().filter(|node| !known.contains(node)).collect();
            if new.is_empty() {
                continue;
            }
            let _ = writeln!(told, "{} {what} import each other in a circle: {circle:?}", circle.len());
            let _ = writeln!(told, "  of these, the list of known ones lacks {new:?}");
            for node in new {
                let way = self.circle_through(node).unwrap_or_default();
                if shown.insert(way.iter().copied().collect::<BTreeSet<_>>()) {
                    let _ = writeln!(told, "  a shortest circle through {node}:");
                    for pair in way.windows(2) {
                        let _ = writeln!(told, "    {}", self.edges[&(pair[0].into(), pair[1].into())].1);
                    }
                }
            }
        }
        for node in known.iter().filter(|node| !circles.iter().any(|circle| circle.contains(*node))) {
            let _ = writeln!(told, "{node} is in no circle any more: take it out of the list of known {what}");
        }
        if told.is_empty() { Ok(()) } else { Err(told) }
    }
}

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
        files.check("files", is_pair_of_a_folder, KNOWN),
        rooms.check("rooms", |_| false, &[]),
        parts.check("rooms of the plugin", |_| false, KNOWN_ROOMS),
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
fn told(files: &[(&str, &str)], known: &[&str]) -> Result<(), String> {
    let sources = files.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned())).collect();
    Graph::of_files(&Imports::of(&sources)).check("files", is_pair_of_a_folder, known)
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
    let text = told(&files, &[]).unwrap_err();
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
    assert_eq!(told(&of_a_folder, &[]), Ok(()));
    let head = ("room.rs", "mod a; use a::A; pub struct R;");
    assert_eq!(told(&[("lib.rs", "mod room;"), head, ("room/a.rs", "use super::R; pub struct A;")], &[]), Ok(()));
    let apart =
        [("lib.rs", "mod a; mod room;"), ("a.rs", "use crate::room::b::B; pub struct A;"), ("room.rs", "pub mod b;")];
    let text = told(&[&apart[..], &[("room/b.rs", "use crate::a::A; pub struct B;")]].concat(), &[]).unwrap_err();
    assert!(text.contains("2 files import each other"), "{text}");
}

#[test]
fn known_files_are_excused_until_they_are_out_of_the_circle() {
    let lib = ("lib.rs", "mod a; mod b; mod c;");
    let [a, b] = [("a.rs", "use crate::b::B; pub struct A;"), ("b.rs", "use crate::c::C; pub struct B;")];
    let circle = [lib, a, b, ("c.rs", "use crate::a::A; pub struct C;")];
    assert_eq!(told(&circle, &["a.rs", "b.rs", "c.rs"]), Ok(()));
    assert!(told(&circle, &["a.rs", "b.rs"]).unwrap_err().contains("lacks [\"c.rs\"]"));
    let open = [lib, a, b, ("c.rs", "pub struct C;")];
    assert_eq!(told(&open, &[]), Ok(()));
    assert!(told(&open, &["c.rs"]).unwrap_err().contains("c.rs is in no circle any more: take it out"));
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
    assert_eq!(Graph::of_files(&imports).check("files", is_pair_of_a_folder, &[]), Ok(()));
    let rooms = Graph::of(&imports, |file| room_in("", file));
    let text = rooms.check("rooms", |_| false, &[]).unwrap_err();
    assert!(text.contains("x/a.rs:1 -> y/c.rs") && text.contains("y/d.rs:1 -> x/b.rs"), "{text}");
    assert_eq!(rooms.order().1, 1);
}
