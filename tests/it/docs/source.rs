//! [`Source`]: what the crate's source says of its types.

use super::{files, root};
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};
use syn::{Attribute, Expr, ExprLit, Fields, Item, Lit, Meta, Type, punctuated::Punctuated, visit, visit::Visit};

/// The source of the crate: its types, and the ranges of numbers that are written in it.
pub(super) struct Source {
    pub(super) items: Vec<(PathBuf, Item)>,
    /// By file and name.
    ranges: BTreeMap<(PathBuf, String), String>,
}

impl Source {
    pub(super) fn read() -> Self {
        let mut source = Self { items: Vec::new(), ranges: BTreeMap::new() };
        for path in files(&root().join("src"), "rs") {
            let parsed = syn::parse_file(&fs::read_to_string(&path).unwrap()).unwrap();
            let mut ranges = Ranges::default();
            ranges.visit_file(&parsed);
            source.ranges.extend(ranges.0.into_iter().map(|(name, range)| ((path.clone(), name), range)));
            source.items.extend(parsed.items.into_iter().map(|item| (path.clone(), item)));
        }
        source
    }

    /// The fields of a struct: name, type, documentation, and the file that it is in.
    pub(super) fn fields(&self, name: &str) -> (PathBuf, Vec<(String, Type, String)>) {
        let (path, item) = self.find(|item| matches!(item, Item::Struct(item) if item.ident == name), name);
        let Item::Struct(item) = item else { unreachable!() };
        let fields = item
            .fields
            .iter()
            .map(|field| (field.ident.as_ref().unwrap().to_string(), field.ty.clone(), documentation(&field.attrs)));
        (path.clone(), fields.collect())
    }

    /// The variants of an enum: as they are written, and their documentation. Those of variants follow with a dot.
    pub(super) fn variants(&self, name: &str) -> Vec<(String, String)> {
        let (_, item) = self.find(|item| matches!(item, Item::Enum(item) if item.ident == name), name);
        let Item::Enum(item) = item else { unreachable!() };
        let mut out = Vec::new();
        for variant in &item.variants {
            out.push((variant.ident.to_string(), documentation(&variant.attrs)));
            if let Fields::Named(fields) = &variant.fields {
                for field in &fields.named {
                    let name = format!("{}.{}", variant.ident, field.ident.as_ref().unwrap());
                    out.push((name, documentation(&field.attrs)));
                }
            }
        }
        out
    }

    fn find(&self, is: impl Fn(&Item) -> bool, name: &str) -> &(PathBuf, Item) {
        self.items.iter().find(|(_, item)| is(item)).unwrap_or_else(|| panic!("there is no {name}"))
    }

    /// The range of a field, by its name in the file of its struct or by its full one in any.
    pub(super) fn range(&self, path: &Path, prefix: &str, name: &str) -> Option<&String> {
        let own = self.ranges.get(&(path.to_owned(), name.to_owned()));
        let full = format!("{prefix}{name}");
        let by_name = || self.ranges.iter().find(|((_, other), _)| *other == full).map(|(_, range)| range);
        if prefix.is_empty() { own.or_else(by_name) } else { by_name() }
    }
}

/// Ranges by name: `("name", value, 0.0..=1.0)`, `("name", value, 0.0, 1.0)` and `name: f32 = 0.0, 1.0;`.
#[derive(Default)]
struct Ranges(BTreeMap<String, String>);

fn number(expr: &Expr) -> Option<f64> {
    match expr {
        Expr::Lit(ExprLit { lit: Lit::Float(lit), .. }) => lit.base10_parse().ok(),
        Expr::Lit(ExprLit { lit: Lit::Int(lit), .. }) => lit.base10_parse().ok(),
        Expr::Unary(negative) => Some(-number(&negative.expr)?),
        _ => None,
    }
}

impl Ranges {
    fn note<'a>(&mut self, parts: impl Iterator<Item = &'a Expr>) {
        let parts: Vec<_> = parts.collect();
        let Some(Expr::Lit(ExprLit { lit: Lit::Str(name), .. })) = parts.first() else { return };
        let ends = parts.iter().find_map(|part| match part {
            Expr::Range(range) => Some((number(range.start.as_deref()?)?, number(range.end.as_deref()?)?)),
            _ => None,
        });
        let ends = ends.or_else(|| match parts[..] {
            [.., min, max] => Some((number(min)?, number(max)?)),
            _ => None,
        });
        if let Some((min, max)) = ends {
            self.0.insert(name.value(), format!("{min}..={max}"));
        }
    }
}

impl<'ast> Visit<'ast> for Ranges {
    fn visit_expr_tuple(&mut self, tuple: &'ast syn::ExprTuple) {
        self.note(tuple.elems.iter());
        visit::visit_expr_tuple(self, tuple);
    }

    fn visit_expr_call(&mut self, call: &'ast syn::ExprCall) {
        self.note(call.args.iter());
        visit::visit_expr_call(self, call);
    }

    fn visit_macro(&mut self, called: &'ast syn::Macro) {
        if called.path.is_ident("fields") {
            let text = called.tokens.to_string();
            for line in text.split(';').filter(|line| line.contains('=')) {
                let (name, ends) = line.split_once(':').unwrap();
                let (min, max) = ends.split_once('=').unwrap().1.split_once(',').unwrap();
                let [min, max] = [min, max].map(|end| end.replace([' ', '_'], "").parse::<f64>().unwrap());
                self.0.insert(name.trim().into(), format!("{min}..={max}"));
            }
        }
        let list = Punctuated::<Expr, syn::Token![,]>::parse_terminated;
        for expr in called.parse_body_with(list).iter().flatten() {
            self.visit_expr(expr);
        }
    }
}

/// Doc comments as one line, without the links of rustdoc.
fn documentation(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|attribute| match &attribute.meta {
        Meta::NameValue(doc) if doc.path.is_ident("doc") => match &doc.value {
            Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) => Some(text.value().trim().to_owned()),
            _ => None,
        },
        _ => None,
    });
    let text = lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ");
    let mut out = String::new();
    let mut rest = text.as_str();
    while let Some((before, link)) = rest.split_once('[') {
        out.push_str(before);
        let Some((words, after)) = link.split_once(']') else { break };
        // `[f32; 3]` is no link.
        let is_link = after.starts_with('(') || words.starts_with('`');
        out.push_str(&if is_link { words.to_owned() } else { format!("[{words}]") });
        rest = match after.strip_prefix('(') {
            Some(target) if is_link => target.split_once(')').map_or("", |(_, after)| after),
            _ => after,
        };
    }
    out + rest
}

/// The value of a field where a type's default is written: `Default::default`, or `DEFAULT` of all.
pub(super) fn default_of(source: &Source, name: &str, field: &str) -> Option<f64> {
    struct Find<'a>(&'a str, Option<f64>);
    impl<'ast> Visit<'ast> for Find<'_> {
        fn visit_field_value(&mut self, value: &'ast syn::FieldValue) {
            if matches!(&value.member, syn::Member::Named(name) if name == self.0) {
                self.1 = self.1.or(number(&value.expr));
            }
        }
    }
    let impls = source.items.iter().filter_map(|(_, item)| match item {
        Item::Impl(item) => Some(item),
        _ => None,
    });
    let is_of = |ty: &Type| matches!(ty, Type::Path(path) if path.path.is_ident(name));
    let mut find = Find(field, None);
    for item in impls.filter(|item| is_of(&item.self_ty)).flat_map(|item| &item.items) {
        match item {
            syn::ImplItem::Const(item) if item.ident == "DEFAULT" => find.visit_impl_item_const(item),
            syn::ImplItem::Fn(item) if item.sig.ident == "default" => find.visit_impl_item_fn(item),
            _ => {}
        }
    }
    find.1
}
