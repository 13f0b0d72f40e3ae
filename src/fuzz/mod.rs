//! Input of any kind for what reads files, pictures and settings: targets of the form "bytes in, panic if something is wrong".
//!
//! A target reads its case from bytes ([`Input`]), runs the library on it and checks what must always hold. [`run`] gives it all files of
//! `tests/corpus/NAME` first, then random bytes and changed files. A case that fails is made smaller for as long as it fails, and written to
//! a file: copy that to the corpus, where it is tried each time from then on.
//!
//! `CRACK_FUZZ_CASES` (cases of each target) and `CRACK_FUZZ_SEED` (default 1) try more and others, `CRACK_FUZZ_FILE` tries one file alone
//! (the slowest case is in one, in the folder for temporary files):
//! `CRACK_FUZZ_CASES=100000 CRACK_FUZZ_SEED=7 cargo test -p bevy_crack --no-default-features --features serde --lib fuzz`.

mod contours;
mod growth;
mod input;
mod pictures;
#[cfg(feature = "serde")]
mod presets;
#[cfg(feature = "serde")]
mod records;
mod shards;

use crate::math::Rng;
use input::Input;
use std::{
    any::Any,
    cell::Cell,
    env,
    fmt::Write as _,
    fs,
    panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook},
    path::Path,
    sync::Once,
    time::{Duration, Instant},
};

/// What tries one case.
type Target = fn(&[u8]);

/// The largest case, bytes.
const MOST_BYTES: u32 = 4096;

/// How often a failing case is tried again to make it smaller.
const MOST_CUTS: u32 = 3000;

fn number(name: &str) -> Option<u64> {
    env::var(name).ok().and_then(|text| text.parse().ok())
}

thread_local! {
    /// Whether panics of this thread are not to be told.
    static IS_QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Tries a case, and returns what its panic says.
fn attempt(target: Target, case: &[u8]) -> Result<(), String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = take_hook();
        set_hook(Box::new(move |info| {
            if !IS_QUIET.get() {
                before(info);
            }
        }));
    });
    IS_QUIET.set(true);
    let outcome = catch_unwind(AssertUnwindSafe(|| target(case)));
    IS_QUIET.set(false);
    let text = |panic: Box<dyn Any + Send>| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("a panic without words").to_owned()
    };
    outcome.map_err(text)
}

/// The smallest case that is found to fail, by leaving bytes out and making them zero.
fn smaller(target: Target, case: &[u8]) -> Vec<u8> {
    let mut best = case.to_vec();
    let mut cuts = 0;
    let mut fails = |case: &[u8]| {
        cuts += 1;
        cuts <= MOST_CUTS && attempt(target, case).is_err()
    };
    let mut size = best.len().div_ceil(2);
    while size > 0 {
        let mut at = 0;
        while at < best.len() {
            let end = (at + size).min(best.len());
            let without = [&best[..at], &best[end..]].concat();
            if fails(&without) {
                best = without;
                continue;
            }
            if best[at..end].iter().any(|&byte| byte != 0) {
                let mut zeroed = best.clone();
                zeroed[at..end].fill(0);
                if fails(&zeroed) {
                    best = zeroed;
                }
            }
            at = end;
        }
        size /= 2;
    }
    best
}

/// Random bytes, or a file of the corpus with some bytes changed.
fn case(rng: &mut Rng, corpus: &[Vec<u8>]) -> Vec<u8> {
    let below = |rng: &mut Rng, most: usize| ((u64::from(rng.next_u32()) * most as u64) >> 32) as usize;
    if corpus.is_empty() || rng.next_u32().is_multiple_of(2) {
        // As many short ones as long ones.
        let length = 1u32 << below(rng, 1 + MOST_BYTES.ilog2() as usize);
        return (0..length).map(|_| rng.next_u32() as u8).collect();
    }
    let mut bytes = corpus[below(rng, corpus.len())].clone();
    for _ in 0..=below(rng, 6) {
        let at = below(rng, bytes.len() + 1);
        let end = (at + 1 + below(rng, 8)).min(bytes.len());
        match rng.next_u32() % 6 {
            0 if at < bytes.len() => bytes[at] ^= 1 << (rng.next_u32() % 8),
            1 if at < bytes.len() => bytes[at] = [0, 1, 0x7f, 0x80, 0xff, b'9', b'-', b')'][below(rng, 8)],
            2 => bytes.insert(at, rng.next_u32() as u8),
            3 => drop(bytes.drain(at..end)),
            4 => bytes.extend_from_within(at..end),
            _ => {
                let other = &corpus[below(rng, corpus.len())];
                let from = below(rng, other.len() + 1);
                let part = &other[from..(from + below(rng, 64)).min(other.len())];
                bytes.splice(at..(at + part.len()).min(bytes.len()), part.iter().copied());
            }
        }
    }
    bytes.truncate(MOST_BYTES as usize);
    bytes
}

/// Tries the corpus of a target, then `usual` cases more, or as many as `CRACK_FUZZ_CASES` says.
fn run(name: &str, usual: u64, target: Target) {
    if let Ok(file) = env::var("CRACK_FUZZ_FILE") {
        target(&fs::read(file).unwrap());
        return;
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(name);
    let mut files: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(!files.is_empty(), "no corpus in {}", folder.display());
    let corpus: Vec<Vec<u8>> = files.iter().map(|file| fs::read(file).unwrap()).collect();
    for (file, case) in files.iter().zip(&corpus) {
        attempt(target, case).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    }

    let rng = Rng::new(number("CRACK_FUZZ_SEED").unwrap_or(1)).stream(name);
    let cases = number("CRACK_FUZZ_CASES").unwrap_or(usual);
    let (begin, mut slowest, mut longest) = (Instant::now(), (Duration::ZERO, 0), Vec::new());
    for index in 0..cases {
        let case = case(&mut rng.substream(index), &corpus);
        let begin = Instant::now();
        if let Err(error) = attempt(target, &case) {
            let case = smaller(target, &case);
            let path = env::temp_dir().join(format!("crack_fuzz_{name}_{index}"));
            fs::write(&path, &case).unwrap();
            let bytes = case.iter().fold(String::new(), |mut text, byte| {
                let _ = write!(text, "{byte:02x}");
                text
            });
            panic!("{name}, case {index}: {error}\nIt is in {}, {} bytes: {bytes}", path.display(), case.len());
        }
        if begin.elapsed() > slowest.0 {
            slowest = (begin.elapsed(), index);
            longest = case;
        }
    }
    fs::write(env::temp_dir().join(format!("crack_fuzz_{name}_slowest")), longest).unwrap();
    let (time, index) = slowest;
    println!(
        "{name}: {} files, {cases} cases in {:.1?}, the slowest is {index} with {time:.1?}",
        files.len(),
        begin.elapsed()
    );
}

/// The harness itself: it finds what fails, and makes it as small as it can be.
#[test]
fn failures_are_found_and_made_small() {
    fn target(case: &[u8]) {
        assert!(!case.windows(2).any(|pair| pair[0] > 100 && pair[1] == 7), "found");
    }
    let corpus = [vec![50, 7, 7, 7]];
    let rng = Rng::new(3);
    let found =
        (0..10_000).map(|index| case(&mut rng.substream(index), &corpus)).find(|case| attempt(target, case).is_err());
    let small = smaller(target, &found.unwrap());
    assert!(small.len() == 2 && small[0] > 100 && small[1] == 7, "{small:?}");
    assert_eq!(attempt(target, &small), Err("found".into()));
    assert_eq!(attempt(target, &[1, 2, 3]), Ok(()));
}
