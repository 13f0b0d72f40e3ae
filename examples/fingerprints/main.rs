//! Prints a fingerprint of everything that the crate makes: the same on every machine and in every build.
//!
//! ```text
//! cargo run -p bevy_crack_fingerprints | diff tests/golden/fingerprints.txt -
//! ```
//!
//! `cargo run -p bevy_crack_fingerprints -- painted` makes only those whose names begin so.
//!
//! For WebAssembly, run by Node (`rustup target add wasm32-wasip1`):
//!
//! ```text
//! export CARGO_TARGET_WASM32_WASIP1_RUNNER="node --no-warnings --no-turbo-fast-api-calls $PWD/.ci/wasi.mjs"
//! cargo run -p bevy_crack_fingerprints --target wasm32-wasip1 | diff tests/golden/fingerprints.txt -
//! ```

#![expect(clippy::print_stdout, reason = "a command-line tool")]

#[path = "../../tests/fingerprints/prints.rs"]
mod prints;

use std::{env, error::Error};

fn main() -> Result<(), Box<dyn Error>> {
    for line in prints::prints(&env::args().nth(1).unwrap_or_default())? {
        println!("{line}");
    }
    Ok(())
}
