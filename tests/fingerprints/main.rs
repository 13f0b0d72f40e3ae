//! What a seed makes is part of the contract: a change here changes every user's cracks and goes into the changelog.
//!
//! `UPDATE_FINGERPRINTS=1 cargo test fingerprints` writes the file anew, and still fails. `.ci/run` compares it with what builds without
//! optimisation and builds for WebAssembly print.

mod prints;

use std::{env, fs, path::Path};

#[test]
fn fingerprints_are_frozen() {
    let found = prints::prints("").unwrap();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/fingerprints.txt");
    if env::var_os("UPDATE_FINGERPRINTS").is_some() {
        fs::write(&file, found.join("\n") + "\n").unwrap();
        panic!("written anew: {}", file.display());
    }
    let stored = fs::read_to_string(&file).unwrap();
    let changed: Vec<_> = found.iter().filter(|line| !stored.lines().any(|stored| stored == line.as_str())).collect();
    assert!(changed.is_empty(), "what a seed makes has changed: {changed:#?}");
    assert_eq!(found.len(), stored.lines().count(), "a fingerprint is missing");
}

/// No two things have the same fingerprint: none is that of nothing.
#[test]
fn fingerprints_differ() {
    let found = prints::prints("").unwrap();
    let mut prints: Vec<_> = found.iter().filter_map(|line| line.rsplit_once(' ')).map(|(_, print)| print).collect();
    prints.sort_unstable();
    let all = prints.len();
    prints.dedup();
    assert_eq!(prints.len(), all, "{found:#?}");
}
