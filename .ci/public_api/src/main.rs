//! Prints what a crate offers, an item a line, from what `rustdoc --output-format json` wrote.
//!
//! Of a trait that a type has, the one line that says so; of what is offered in `prelude` as well, its name there.

use std::{env, error::Error, path::Path};

/// The type whose trait a line is of: `impl Trait for path::Type<..>`.
fn of_trait(line: &str) -> Option<String> {
    let (_, of) = line.strip_prefix("impl")?.split_once(" for ")?;
    of.split(['<', ' ']).next().map(str::to_owned)
}

/// Whether a line is of something within an item of the prelude.
fn is_within_prelude(line: &str) -> bool {
    line.split_once("::prelude::").is_some_and(|(before, name)| before.starts_with("impl") || name.contains("::"))
}

fn main() -> Result<(), Box<dyn Error>> {
    let file = env::args().nth(1).ok_or("the file that rustdoc wrote is to be named")?;
    let api = public_api::Builder::from_rustdoc_json(Path::new(&file))
        .omit_blanket_impls(true)
        .omit_auto_trait_impls(true)
        .omit_auto_derived_impls(true)
        .build()?;
    // The items of an `impl` follow it.
    let (mut lines, mut within) = (Vec::new(), None::<String>);
    for line in api.items().map(ToString::to_string) {
        let is_of_trait = within.as_ref().is_some_and(|path| {
            let rest = ["pub fn ", "pub type ", "pub const "].iter().find_map(|kind| line.strip_prefix(kind));
            let of = rest.and_then(|rest| rest.strip_prefix(path.as_str()));
            of.is_some_and(|of| of.starts_with(['<', ':']))
        });
        if is_of_trait {
            continue;
        }
        within = of_trait(&line);
        // Of reflection, that there is.
        let is_detail = line.contains("impl bevy_reflect::") && !line.contains("::Reflect for ");
        if !is_detail && !is_within_prelude(&line) {
            lines.push(line);
        }
    }
    lines.sort();
    lines.dedup();
    lines.iter().for_each(|line| println!("{line}"));
    Ok(())
}
