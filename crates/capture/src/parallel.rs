//! Work on all cores.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Calls `work` with 0, 1, … `n − 1` on `threads` threads; results in that order, whatever the order of work. After
/// each, `done` hears how many are finished.
pub fn parallel<T: Send>(
    threads: usize,
    n: usize,
    work: impl Fn(usize) -> T + Sync,
    done: &(dyn Fn(usize) + Sync),
) -> Vec<T> {
    let (next, finished) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let mut all: Vec<(usize, T)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads.clamp(1, n.max(1)))
            .map(|_| {
                scope.spawn(|| {
                    let mut mine = Vec::new();
                    loop {
                        let i = next.fetch_add(1, Ordering::Relaxed);
                        if i >= n {
                            return mine;
                        }
                        mine.push((i, work(i)));
                        done(finished.fetch_add(1, Ordering::Relaxed) + 1);
                    }
                })
            })
            .collect();
        let join = |w: std::thread::ScopedJoinHandle<_>| {
            w.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        workers.into_iter().flat_map(join).collect()
    });
    all.sort_by_key(|(i, _)| *i);
    all.into_iter().map(|(_, t)| t).collect()
}
