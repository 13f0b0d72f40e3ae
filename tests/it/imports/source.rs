//! [`Imports`]: a crate as it is parsed, its modules, and which file names what of which.

use proc_macro2::{TokenStream, TokenTree};
use std::collections::BTreeMap;
use syn::{Attribute, ImplItem, Item, ItemUse, Meta, UseTree, Visibility, spanned::Spanned as _, visit, visit::Visit};

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
pub(super) struct Imports {
    pub(super) files: Vec<String>,
    pub(super) lines: usize,
    modules: Vec<Module>,
    /// From file to file, with the first line that does it.
    pub(super) edges: BTreeMap<(usize, usize), usize>,
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
    pub(super) fn of(sources: &BTreeMap<String, String>) -> Self {
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
        let (mut path, mut line, mut colons, mut dots) = (Vec::new(), 0, 0, 0);
        for token in tokens {
            let is_next = colons == 2;
            match token {
                TokenTree::Punct(punct) if punct.as_char() == ':' => colons += 1,
                TokenTree::Ident(ident) => {
                    if !is_next {
                        self.end(&mut path, line);
                    }
                    // What follows one dot is a field or a method.
                    let is_member = std::mem::take(&mut dots) == 1;
                    if is_next && path.is_empty() || is_member {
                        colons = 0;
                        continue;
                    }
                    path.push(ident.to_string());
                    line = ident.span().start().line;
                    colons = 0;
                }
                other => {
                    self.end(&mut path, line);
                    let is_dot = matches!(&other, TokenTree::Punct(punct) if punct.as_char() == '.');
                    (colons, dots) = (0, if is_dot { dots + 1 } else { 0 });
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
