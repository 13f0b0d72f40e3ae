//! Work that must give the same bits whichever threads do it, after whatever other work.

use std::sync::{
    Barrier, Mutex,
    atomic::{AtomicUsize, Ordering},
};

/// Panics unless job number `0..jobs` gives the same on a thread of its own as in pools of 1, 2 and 8 threads. Threads of a pool begin together
/// and take the next job that nobody has taken, so each does several after each other, others at the same time.
pub(crate) fn check_in_pools<T: PartialEq + Send>(jobs: usize, job: impl Fn(usize) -> T + Sync) {
    let alone: Vec<T> = (0..jobs).map(|i| std::thread::scope(|scope| scope.spawn(|| job(i)).join().unwrap())).collect();
    for threads in [1, 2, 8] {
        let (next, begin) = (AtomicUsize::new(0), Barrier::new(threads));
        let done = Mutex::new(Vec::new());
        let work = || {
            begin.wait();
            // Backwards: what comes first is not what came first alone.
            while let Some(i) = jobs.checked_sub(1 + next.fetch_add(1, Ordering::Relaxed)) {
                let made = job(i);
                done.lock().unwrap().push((i, made));
            }
        };
        std::thread::scope(|scope| (0..threads).for_each(|_| _ = scope.spawn(work)));
        let done = done.into_inner().unwrap();
        assert_eq!(done.len(), jobs);
        let other: Vec<usize> = done.iter().filter(|(i, made)| *made != alone[*i]).map(|(i, _)| *i).collect();
        assert!(other.is_empty(), "{threads} threads: jobs {other:?} of {jobs} give something else");
    }
}

/// The check can fail: work that depends on what its thread or any other has done before is found.
#[test]
fn work_that_depends_on_other_work_is_found() {
    std::thread_local! {
        static OF_THREAD: AtomicUsize = const { AtomicUsize::new(0) };
    }
    static OF_ALL: AtomicUsize = AtomicUsize::new(0);
    let fails = |job: fn(usize) -> usize| std::panic::catch_unwind(|| check_in_pools(12, job)).is_err();
    assert!(fails(|i| i + OF_THREAD.with(|before| before.fetch_add(1, Ordering::Relaxed))));
    assert!(fails(|i| i + OF_ALL.fetch_add(1, Ordering::Relaxed)));
    assert!(!fails(|i| i * i));
}
