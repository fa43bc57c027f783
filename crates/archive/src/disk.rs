//! Files on the disk: written whole or not at all, read up to a limit, and what is read is noted in the ledger.
// The one file of this crate that may open files.
#![allow(clippy::disallowed_methods)]

use crate::{Error, Place, ledger};
use std::fs::File;
use std::io::{BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Opens a file for reading, and notes that it is read.
pub fn open(path: &Path) -> Result<File, Error> {
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    ledger::will_read(path);
    Ok(file)
}

/// Writes `path` so that at every moment it holds either what it held before or everything new: to a
/// temporary name in the same folder first, which is renamed when it is complete and on the disk. An input
/// ([`protect_inputs`](crate::protect_inputs)) is not replaced.
pub fn atomic_write(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    if ledger::is_input(path) {
        return Err(ledger::refusal(path));
    }
    update(path, bytes)
}

/// As [`atomic_write`], for what is too large to be in memory: `fill` writes it part by part.
pub fn atomic_write_with(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> Result<(), Error>,
) -> Result<(), Error> {
    if ledger::is_input(path) {
        return Err(ledger::refusal(path));
    }
    replace(path, |file| {
        let mut file = BufWriter::with_capacity(1 << 20, file);
        fill(&mut file)?;
        file.flush().map_err(|e| Error::io(path, e))
    })
}

/// As [`atomic_write`], for a file that a command reads in order to change it.
pub fn update(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    replace(path, |file| file.write_all(bytes).map_err(|e| Error::io(path, e)))
}

fn replace(path: &Path, fill: impl FnOnce(&mut File) -> Result<(), Error>) -> Result<(), Error> {
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    let name = path.file_name().ok_or_else(|| {
        Error::io(
            path,
            std::io::Error::new(std::io::ErrorKind::InvalidInput, "this is not the name of a file"),
        )
    })?;
    let mut temporary = name.to_os_string();
    temporary.push(format!(".{}.{}.part", std::process::id(), COUNTER.fetch_add(1, Ordering::Relaxed)));
    let temporary = path.with_file_name(temporary);
    let io = |e| Error::io(path, e);
    let written = File::create(&temporary).map_err(io).and_then(|mut file| {
        fill(&mut file)?;
        file.sync_all().map_err(io)?;
        std::fs::rename(&temporary, path).map_err(io)
    });
    // Best effort: the error that matters is the first one.
    written.inspect_err(|_| drop(std::fs::remove_file(&temporary)))
}

/// Whether [`atomic_write`] could write `path` now: asked before an hour of work, not after it.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    ledger::check_outputs([path])?;
    if path.is_dir() {
        return Err(Error::io(path, std::io::ErrorKind::IsADirectory.into()));
    }
    let mut probe = path.file_name().unwrap_or_default().to_os_string();
    probe.push(format!(".{}.probe", std::process::id()));
    let probe = path.with_file_name(probe);
    File::create_new(&probe).and_then(|_| std::fs::remove_file(&probe)).map_err(|e| Error::io(path, e))
}

/// Makes a folder and those above it, unless they are there.
pub fn make_folder(folder: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))
}

/// The files and folders in `folder`, by name.
pub fn list_folder(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let io = |e| Error::io(folder, e);
    let entries = std::fs::read_dir(folder).map_err(io)?;
    let mut all = entries.map(|e| Ok(e.map_err(io)?.path())).collect::<Result<Vec<_>, Error>>()?;
    all.sort();
    Ok(all)
}

/// All of `path`, or an error where it holds more than `limit` bytes.
pub fn read_bounded(path: &Path, limit: u64) -> Result<Vec<u8>, Error> {
    read_up_to(open(path)?, path, limit)
}

/// As [`read_bounded`], of a file that cannot be empty.
pub fn read_filled(path: &Path, limit: u64) -> Result<Vec<u8>, Error> {
    let bytes = read_bounded(path, limit)?;
    match bytes.is_empty() {
        true => Err(Error::invalid(Place::file(path), "the file is empty; copy or export it again")),
        false => Ok(bytes),
    }
}

/// As [`read_bounded`], for what this program wrote for itself and will replace, as checkpoints: it is no input.
pub fn read_own(path: &Path, limit: u64) -> Result<Vec<u8>, Error> {
    read_up_to(File::open(path).map_err(|e| Error::io(path, e))?, path, limit)
}

/// The first bytes of what this program wrote for itself, at most `limit`.
pub fn begin_own(path: &Path, limit: u64) -> Result<Vec<u8>, Error> {
    let io = |e| Error::io(path, e);
    let mut bytes = Vec::new();
    File::open(path).map_err(io)?.take(limit).read_to_end(&mut bytes).map_err(io)?;
    Ok(bytes)
}

fn read_up_to(file: File, path: &Path, limit: u64) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    // One byte more than allowed tells a file of just the limit from a longer one, pipes included.
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    tracing::debug!("{}: {} bytes", path.display(), bytes.len());
    if bytes.len() as u64 > limit {
        let asked = std::fs::metadata(path).map_or(0, |m| m.len()).max(limit.saturating_add(1));
        return Err(Error::TooLarge {
            at: Place::file(path),
            what: "the size in bytes".into(),
            asked,
            limit,
        });
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_whole_files_and_leaves_nothing_behind() {
        let folder = std::env::temp_dir().join(format!("yugen-atomic-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("a.bin");
        atomic_write(&path, b"first").unwrap();
        atomic_write(&path, b"2nd").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"2nd");
        assert_eq!(read_bounded(&path, 3).unwrap(), b"2nd");
        assert!(matches!(read_bounded(&path, 2), Err(Error::TooLarge { asked: 3, limit: 2, .. })));
        // A folder of that name cannot be replaced by a file: the error says which, and nothing is left.
        std::fs::create_dir(folder.join("b")).unwrap();
        std::fs::write(folder.join("b/inside"), b"x").unwrap();
        let error = atomic_write(&folder.join("b"), b"x").unwrap_err();
        assert!(error.to_string().contains("/b"), "{error}");
        assert!(atomic_write(&folder.join("missing/c"), b"x").is_err());
        let fill = |file: &mut dyn Write| {
            file.write_all(&[7; 3 << 20]).unwrap();
            file.write_all(b"end").map_err(|e| Error::io(&path, e))
        };
        atomic_write_with(&path, fill).unwrap();
        assert!(read_bounded(&path, 1 << 22).unwrap().ends_with(b"\x07end"));
        // What goes wrong on the way leaves what was there.
        let given_up = |_: &mut dyn Write| Err(Error::invalid(Place::file("a"), "given up"));
        assert!(atomic_write_with(&path, given_up).unwrap_err().to_string().contains("given up"));
        assert_eq!(std::fs::metadata(&path).unwrap().len(), (3 << 20) + 3);
        assert!(check_writable(&folder.join("c")).is_ok() && check_writable(&path).is_ok());
        for (name, problem) in [("missing/c", "there is no folder"), ("b", "this is a folder")] {
            let error = check_writable(&folder.join(name)).unwrap_err().to_string();
            assert!(error.contains(problem), "{error}");
        }
        assert!(atomic_write(Path::new("/"), b"x").is_err());
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
