//! Ctrl-C.

use anyhow::{Context, Result};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit status of a program that was interrupted, as shells have it: 128 and the number of the signal.
pub const STATUS: i32 = 128 + SIGINT;

/// Whether somebody wants the work to end.
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// From now on the first Ctrl-C or `kill` is a wish that is read here; a second one ends the program at once.
    pub fn listen() -> Result<Self> {
        let wish = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // In this order: the first signal finds the wish unset.
            flag::register_conditional_shutdown(signal, 128 + signal, wish.clone())
                .and_then(|_| flag::register(signal, wish.clone()))
                .context("cannot listen to Ctrl-C")?;
        }
        Ok(Self(wish))
    }

    /// One that never comes: Ctrl-C ends the program at once.
    #[cfg(feature = "view")]
    pub fn never() -> Self {
        Self(Arc::default())
    }

    /// Whether it has come.
    pub fn came(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
