//! Prints what a crate offers, an item a line, from what `rustdoc --output-format json` wrote.

use std::{env, error::Error, path::Path};

fn main() -> Result<(), Box<dyn Error>> {
    let file = env::args().nth(1).ok_or("the file that rustdoc wrote is to be named")?;
    let api = public_api::Builder::from_rustdoc_json(Path::new(&file))
        .omit_blanket_impls(true)
        .omit_auto_trait_impls(true)
        .omit_auto_derived_impls(true)
        .build()?;
    let mut lines: Vec<String> = api.items().map(ToString::to_string).collect();
    lines.sort();
    lines.dedup();
    lines.iter().for_each(|line| println!("{line}"));
    Ok(())
}
