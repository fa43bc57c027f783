//! What can go wrong with a file, as one clear sentence that says where.

use std::fmt;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use yugen_reflectance::ModelError;
use yugen_scene::{nearest, suggest};

/// Where in a file.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Place {
    /// The file as it was named.
    pub file: PathBuf,
    /// Where in it.
    pub position: Position,
}

/// Position in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Position {
    /// The file as a whole.
    #[default]
    Whole,
    /// Text; both count from one, columns in characters.
    Line {
        /// Line.
        line: usize,
        /// Column.
        column: usize,
    },
    /// Binary: offset from the start.
    Byte(u64),
}

impl Place {
    /// The file as a whole.
    pub fn file(file: impl Into<PathBuf>) -> Self {
        Self { file: file.into(), position: Position::Whole }
    }

    /// A line and a column, both from one.
    pub fn line(file: impl Into<PathBuf>, line: usize, column: usize) -> Self {
        Self { file: file.into(), position: Position::Line { line, column } }
    }

    /// A byte offset of a binary file.
    pub fn byte(file: impl Into<PathBuf>, offset: u64) -> Self {
        Self { file: file.into(), position: Position::Byte(offset) }
    }

    /// The line and column of byte `offset` of `text`.
    pub fn in_text(file: impl Into<PathBuf>, text: &str, offset: usize) -> Self {
        let offset = (0..=offset.min(text.len())).rev().find(|&o| text.is_char_boundary(o)).unwrap_or(0);
        let before = &text[..offset];
        let start = before.rfind('\n').map_or(0, |n| n + 1);
        Self::line(file, before.matches('\n').count() + 1, before[start..].chars().count() + 1)
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let file = self.file.display();
        match self.position {
            Position::Whole => write!(f, "{file}"),
            Position::Line { line, column } => write!(f, "{file}:{line}:{column}"),
            Position::Byte(offset) => write!(f, "{file}, byte {offset}"),
        }
    }
}

/// Why a file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system says no.
    #[error("{}: {problem}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What it says, and what to do.
        problem: String,
        /// What kind of no.
        kind: ErrorKind,
    },
    /// The content is wrong: the problem says what was expected and what to do.
    #[error("{at}: {problem}")]
    Invalid {
        /// Where.
        at: Place,
        /// What was found and what was expected.
        problem: String,
    },
    /// A word that means nothing there.
    #[error("{at}: unknown {what} '{name}'{hint}")]
    Unknown {
        /// Where.
        at: Place,
        /// What kind of word, for example `key` or `plugin`.
        what: &'static str,
        /// The word.
        name: String,
        /// What was probably meant or what would do, as the end of the sentence.
        hint: String,
    },
    /// The file asks for more than the limit.
    #[error("{at}: {what} is {asked}, more than the limit of {limit}; check the file, or use a smaller one")]
    TooLarge {
        /// Where.
        at: Place,
        /// What is counted.
        what: String,
        /// How many.
        asked: u64,
        /// How many are allowed.
        limit: u64,
    },
    /// A reflectance model refuses.
    // Not called `source`: the message says it already, and reports print the sources of an error behind it.
    #[error("{at}: {problem}")]
    Model {
        /// Where.
        at: Place,
        /// Why.
        problem: Box<ModelError>,
    },
}

impl Error {
    /// The operating system says no.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        let problem = match source.kind() {
            ErrorKind::NotFound => not_found(path),
            ErrorKind::PermissionDenied => {
                "this is not allowed; check the permissions of the file and its folder".into()
            }
            ErrorKind::NotADirectory | ErrorKind::AlreadyExists => {
                "a file is where a folder is expected; name a folder, or move the file".into()
            }
            ErrorKind::IsADirectory => "this is a folder; name a file in it".into(),
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
                "the disk is full; make room or write elsewhere".into()
            }
            ErrorKind::FileTooLarge => "files may not become so large here; write elsewhere".into(),
            _ => source.to_string(),
        };
        Self::Io { path: path.to_path_buf(), problem, kind: source.kind() }
    }

    /// Wrong content.
    pub fn invalid(at: Place, problem: impl Into<String>) -> Self {
        Self::Invalid { at, problem: problem.into() }
    }

    /// An unknown word among `known`, with the nearest as suggestion.
    pub fn unknown<'a>(
        at: Place,
        what: &'static str,
        name: &str,
        known: impl IntoIterator<Item = &'a str>,
    ) -> Self {
        Self::Unknown { at, what, name: name.to_string(), hint: suggest(name, known) }
    }

    /// A reflectance model refuses.
    pub fn model(at: Place, problem: ModelError) -> Self {
        Self::Model { at, problem: Box::new(problem) }
    }
}

/// Which part of `path` is missing, and what may have been meant.
fn not_found(path: &Path) -> String {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return format!("there is no folder '{}'; make it, or check its name", folder.display());
    }
    // A crowded folder is not searched to its end.
    let entries = std::fs::read_dir(folder).into_iter().flatten().take(4096).flatten();
    let names: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    match nearest(&name, names.iter().map(String::as_str)) {
        Some(near) => format!("there is nothing of this name; did you mean '{near}'?"),
        None => "there is nothing of this name; check its name".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_word_is_answered_with_the_nearest() {
        let known = ["roughness", "reflectance", "alpha", "sigma_x"];
        let e = Error::unknown(Place::line("a.toml", 3, 7), "key", "aplha", known);
        assert_eq!(e.to_string(), "a.toml:3:7: unknown key 'aplha'; did you mean 'alpha'?");
    }

    #[test]
    fn a_missing_file_tells_what_is_missing_and_what_is_near() {
        let folder = std::env::temp_dir().join(format!("yugen-missing-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("kimono.toml"), "").unwrap();
        let said = |path: &Path| Error::io(path, std::fs::File::open(path).unwrap_err()).to_string();
        assert!(
            said(&folder.join("kimnoo.toml")).ends_with("nothing of this name; did you mean 'kimono.toml'?")
        );
        assert!(said(&folder.join("z")).ends_with("there is nothing of this name; check its name"));
        let nowhere = said(&folder.join("obi/kimono.toml"));
        assert!(nowhere.contains("there is no folder") && nowhere.contains("obi'; make it"), "{nowhere}");
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_message_that_names_its_cause_has_no_source_to_say_it_again() {
        let refusal = || yugen_reflectance::Kind::from_name("lambertt").unwrap_err();
        let e = Error::model(Place::line("a.toml", 3, 7), refusal());
        assert_eq!(e.to_string(), format!("a.toml:3:7: {}", refusal()));
        assert!(std::error::Error::source(&e).is_none());
    }

    #[test]
    fn offsets_become_lines_and_columns() {
        let text = "a\nñb\n";
        assert_eq!(Place::in_text("f", text, 4).to_string(), "f:2:2");
        assert_eq!(Place::in_text("f", text, 3).to_string(), "f:2:1", "inside a character");
        assert_eq!(Place::in_text("f", text, 99).to_string(), "f:3:1");
    }
}
