//! Words of a text with the line of each, for formats that are lists of numbers.

use crate::{Error, Place};
use std::path::Path;

/// A text, for what is wrong in it.
#[derive(Clone, Copy)]
pub(super) struct Text<'a> {
    pub text: &'a str,
    file: &'a Path,
}

impl<'a> Text<'a> {
    /// `bytes` without a byte-order mark. Latin letters of an old header are no reason to refuse a table, but are
    /// no text either: the format's own words are ASCII.
    pub fn new(bytes: &'a [u8], file: &'a Path) -> Result<Self, Error> {
        let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
        let text = std::str::from_utf8(bytes).map_err(|e| {
            Error::invalid(
                Place::byte(file, e.valid_up_to() as u64),
                "this is not text in UTF-8; save the file in that encoding",
            )
        })?;
        Ok(Self { text, file })
    }

    /// Lines with their numbers, from 1, whether they end with LF, CR LF or, of old machines, CR.
    pub fn lines(self) -> impl Iterator<Item = (usize, &'a str)> {
        self.text.lines().flat_map(|l| l.split('\r')).enumerate().map(|(i, l)| (i + 1, l.trim()))
    }

    /// Something is wrong in a line.
    pub fn wrong(self, line: usize, problem: impl Into<String>) -> Error {
        Error::invalid(Place::line(self.file, line, 1), problem)
    }

    /// Something is wrong with all of it.
    pub fn whole(self, problem: impl Into<String>) -> Error {
        Error::invalid(Place::file(self.file), problem)
    }

    /// A finite number.
    pub fn number(self, line: usize, word: &str) -> Result<f32, Error> {
        word.parse().ok().filter(|v: &f32| v.is_finite()).ok_or_else(|| {
            let short: String = word.chars().take(40).collect();
            self.wrong(line, format!("'{short}' is not a finite number"))
        })
    }
}

/// The words between blanks and commas.
pub(super) fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split([' ', '\t', ',', ';']).filter(|w| !w.is_empty())
}
