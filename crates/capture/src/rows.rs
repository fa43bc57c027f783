//! Rows of a picture on all cores.

use std::sync::{Mutex, PoisonError};
use yugen_optics::parallel::threads;

/// Calls `fill(y, row)` for every row of `values`, each once, on all cores. What a row becomes may depend on
/// nothing but y and what was in it, and so not on the number of threads.
pub(crate) fn for_rows<T: Send>(values: &mut [T], width: usize, fill: impl Fn(usize, &mut [T]) + Sync) {
    let rows = Mutex::new(values.chunks_mut(width.max(1)).enumerate());
    let work = || {
        loop {
            // A thread that panicked cannot have been inside: taking a row cannot panic.
            let next = rows.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some((y, row)) = next else { break };
            fill(y, row);
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads() {
            scope.spawn(work);
        }
        work();
    });
}
