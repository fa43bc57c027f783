//! What this process has read, so that nothing of it is written over.
//!
//! Every file that is opened for reading is noted by [`open`](crate::disk::open), the one function of this crate that
//! opens files; files that are read later are noted with [`will_read`] before the work. A program that calls
//! [`protect_inputs`] is then refused by [`check_outputs`], [`check_writable`](crate::check_writable) and, should it
//! have asked neither, by [`atomic_write`](crate::atomic_write) what would replace one of them, by whatever name: a
//! file is the same through links and hard links.

use crate::{Error, Place};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

#[derive(Default)]
struct Ledger {
    protects: bool,
    /// Canonical names.
    names: HashSet<PathBuf>,
    /// Canonical names by what the file system calls the file.
    identities: HashMap<Identity, Vec<PathBuf>>,
}

/// Device and inode.
type Identity = (u64, u64);

static LEDGER: Mutex<Option<Ledger>> = Mutex::new(None);

fn ledger() -> MutexGuard<'static, Option<Ledger>> {
    // Notes that were taken stay true whatever became of the thread that took them.
    LEDGER.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(unix)]
fn identity(path: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;
    std::fs::metadata(path).ok().map(|m| (m.dev(), m.ino()))
}

#[cfg(not(unix))]
fn identity(_: &Path) -> Option<Identity> {
    None
}

/// From now on what this process reads is protected, until it ends. What was read before is protected as well.
pub fn protect_inputs() {
    ledger().get_or_insert_default().protects = true;
}

/// Notes a file that is read, now or later. One that is not there has nothing to lose.
pub fn will_read(path: &Path) {
    let Ok(name) = path.canonicalize() else { return };
    let mut ledger = ledger();
    let ledger = ledger.get_or_insert_default();
    if ledger.names.insert(name.clone())
        && let Some(identity) = identity(&name)
    {
        ledger.identities.entry(identity).or_default().push(name);
    }
}

/// Whether writing `path` would replace something that is read.
pub(crate) fn is_input(path: &Path) -> bool {
    let ledger = ledger();
    let Some(ledger) = ledger.as_ref().filter(|l| l.protects) else { return false };
    // A link that leads nowhere is no input.
    let Ok(name) = path.canonicalize() else { return false };
    // An inode is given to another file once its own is gone: it counts only where the input still has it.
    ledger.names.contains(&name)
        || identity(&name).is_some_and(|id| {
            ledger.identities.get(&id).is_some_and(|all| all.iter().any(|n| identity(n) == Some(id)))
        })
}

pub(crate) fn refusal(path: &Path) -> Error {
    Error::invalid(Place::file(path), "this is read, and would be lost; name another output")
}

/// Refuses outputs of which one is read by this process (see [`protect_inputs`]), or is named twice. Asked when
/// everything is read that says what else will be, and before the work.
///
/// # Errors
/// Names the first such output.
pub fn check_outputs(outputs: impl IntoIterator<Item = impl AsRef<Path>>) -> Result<(), Error> {
    let mut seen = HashSet::new();
    for output in outputs {
        let output = output.as_ref();
        if is_input(output) {
            return Err(refusal(output));
        }
        let place = output.canonicalize().unwrap_or_else(|_| {
            let folder = output.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf());
            folder.join(output.file_name().unwrap_or_default())
        });
        if !seen.insert(place) {
            return Err(Error::invalid(
                Place::file(output),
                "two outputs have this name, and one would be lost; give them different ones",
            ));
        }
    }
    Ok(())
}

/// Refuses outputs that are there already, for commands that replace only where they are told to.
///
/// # Errors
/// Names the first such output, and `--force`.
pub fn check_new(outputs: impl IntoIterator<Item = impl AsRef<Path>>) -> Result<(), Error> {
    match outputs.into_iter().find(|o| o.as_ref().symlink_metadata().is_ok()) {
        None => Ok(()),
        Some(there) => Err(Error::invalid(
            Place::file(there.as_ref()),
            "this is there already; name another output, or say --force to replace it",
        )),
    }
}
