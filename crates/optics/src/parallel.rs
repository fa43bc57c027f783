//! Work on all cores.

use std::sync::atomic::{AtomicUsize, Ordering};

/// As many threads as run at once here; one where there are none, as in browsers.
pub fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Calls `work` with 0, 1, … `n − 1` on `threads` threads; results in that order, whatever the order of work. After
/// each, `done` hears how many are finished.
pub fn parallel<T: Send>(
    threads: usize,
    n: usize,
    work: impl Fn(usize) -> T + Sync,
    done: &(dyn Fn(usize) + Sync),
) -> Vec<T> {
    parallel_in(threads, n, |i, ()| work(i), done)
}

/// The same where a thread has a room to work in, which it finds again as it left it.
pub fn parallel_in<T: Send, R: Default>(
    threads: usize,
    n: usize,
    work: impl Fn(usize, &mut R) -> T + Sync,
    done: &(dyn Fn(usize) + Sync),
) -> Vec<T> {
    let threads = threads.min(n);
    if threads <= 1 {
        let mut room = R::default();
        let one = |i| {
            let t = work(i, &mut room);
            done(i + 1);
            t
        };
        return (0..n).map(one).collect();
    }
    let (next, finished) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let mut all: Vec<(usize, T)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|_| {
                scope.spawn(|| {
                    let (mut mine, mut room) = (Vec::new(), R::default());
                    loop {
                        let i = next.fetch_add(1, Ordering::Relaxed);
                        if i >= n {
                            return mine;
                        }
                        mine.push((i, work(i, &mut room)));
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
