//! Rows of cells, as tables of numbers have them under a few lines of header: commas, semicolons or tabs between them.

use crate::formats::numbers;
use crate::{Error, Place};
use glam::{Quat, Vec3};
use std::borrow::Cow;
use std::path::Path;
use yugen_motion::{RigidPose, Track, Tracks};

/// Reads row after row.
pub(super) struct Sheet<'a> {
    reader: csv::Reader<&'a [u8]>,
    bytes: &'a [u8],
    /// So many bytes are before the row, in so many lines.
    seen: (usize, usize),
    pub path: &'a Path,
    /// Numbers may have a decimal comma.
    comma: bool,
    pub row: Row,
}

/// A row.
#[derive(Default)]
pub(super) struct Row {
    pub line: usize,
    cells: csv::ByteRecord,
}

impl Row {
    /// A cell without the blanks around it; empty beyond the end.
    pub fn bytes(&self, column: usize) -> &[u8] {
        self.cells.get(column).unwrap_or_default().trim_ascii()
    }

    /// The same as text.
    pub fn text(&self, column: usize) -> String {
        String::from_utf8_lossy(self.bytes(column)).into_owned()
    }

    /// How many cells it has, empty ones at its end aside.
    pub fn len(&self) -> usize {
        (0..self.cells.len()).rev().find(|&c| !self.bytes(c).is_empty()).map_or(0, |c| c + 1)
    }

    /// All cells as texts.
    pub fn texts(&self) -> Vec<String> {
        (0..self.len()).map(|c| self.text(c)).collect()
    }
}

impl<'a> Sheet<'a> {
    /// Of a text ([`numbers::text`]) with this delimiter.
    pub fn new(bytes: &'a [u8], path: &'a Path, delimiter: u8) -> Self {
        let reader = csv::ReaderBuilder::new()
            .delimiter(delimiter)
            .flexible(true)
            .has_headers(false)
            // Tabs need no quotes, and a name may begin with one.
            .quoting(delimiter != b'\t')
            .from_reader(bytes);
        Self { reader, bytes, seen: (0, 1), path, comma: delimiter != b',', row: Row::default() }
    }

    /// Goes to the next row that is not empty; false at the end.
    pub fn advance(&mut self) -> Result<bool, Error> {
        loop {
            let read = self.reader.read_byte_record(&mut self.row.cells);
            let read = read.map_err(|e| {
                let line = e.position().map_or(1, |p| p.line() as usize);
                Error::invalid(Place::line(self.path, line, 1), e.to_string())
            })?;
            if !read {
                return Ok(false);
            }
            // The reader's own count is behind where lines end with two bytes.
            let start = self.row.cells.position().map_or(0, |p| p.byte() as usize);
            let breaks = self.bytes[start..].iter().take_while(|b| matches!(b, b'\r' | b'\n')).count();
            let lines = self.bytes[self.seen.0..start + breaks].iter().filter(|b| **b == b'\n').count();
            self.seen = (start + breaks, self.seen.1 + lines);
            self.row.line = self.seen.1;
            if self.row.len() > 0 {
                return Ok(true);
            }
        }
    }

    /// Goes to the next row, which must be there.
    pub fn need(&mut self, what: &str) -> Result<(), Error> {
        match self.advance()? {
            true => Ok(()),
            false => Err(self.invalid(format!("the file ends before {what}"))),
        }
    }

    /// Something is wrong in the row.
    pub fn invalid(&self, problem: impl Into<String>) -> Error {
        Error::invalid(Place::line(self.path, self.row.line.max(1), 1), problem)
    }

    /// A number of a cell, `None` where there is a gap: the cell is empty or NaN.
    pub fn number(&self, column: usize) -> Result<Option<f64>, Error> {
        let mut cell = Cow::Borrowed(self.row.bytes(column));
        if cell.is_empty()
            || [&b"nan"[..], b"null", b"-nan", b"-nan(ind)", b"1.#qnan"]
                .iter()
                .any(|gap| cell.eq_ignore_ascii_case(gap))
        {
            return Ok(None);
        }
        if self.comma && cell.contains(&b',') {
            cell = cell.iter().map(|&b| if b == b',' { b'.' } else { b }).collect();
        }
        match numbers::float(&cell) {
            Some((value, length)) if length == cell.len() && value.abs() < f64::from(f32::MAX) => {
                Ok(Some(value))
            }
            _ => {
                let short: String = String::from_utf8_lossy(&cell).chars().take(40).collect();
                Err(self.invalid(format!("'{short}' in column {} is not a finite number", column + 1)))
            }
        }
    }

    /// So many numbers from `column` on; `None` where all are missing.
    pub fn numbers<const N: usize>(&self, column: usize, what: &str) -> Result<Option<[f64; N]>, Error> {
        let mut all = [0.0; N];
        let mut there = 0;
        for (i, value) in all.iter_mut().enumerate() {
            if let Some(v) = self.number(column + i)? {
                *value = v;
                there += 1;
            }
        }
        match there {
            0 => Ok(None),
            n if n == N => Ok(Some(all)),
            _ => Err(self.invalid(format!(
                "of the {N} numbers of '{what}' from column {} on only {there} are there; give all or none",
                column + 1
            ))),
        }
    }

    /// A point; `None` where it was not seen.
    pub fn point(&self, column: usize, what: &str) -> Result<Option<Vec3>, Error> {
        Ok(self.numbers(column, what)?.map(vector))
    }
}

/// In single precision.
pub(super) fn vector(v: [f64; 3]) -> Vec3 {
    Vec3::from_array(v.map(|v| v as f32))
}

/// A rotation from numbers that may be slightly off unit length; `None` where they are no rotation.
pub(super) fn quaternion([x, y, z, w]: [f64; 4]) -> Option<Quat> {
    let q = glam::DQuat::from_xyzw(x, y, z, w);
    // Six digits leave 1e-6; a hundredth is no rounding any more.
    ((q.length() - 1.0).abs() < 0.01).then(|| q.normalize().as_quat())
}

/// The bytes that end a header's cell.
pub(super) fn delimiter(head: &[u8]) -> u8 {
    [b'\t', b';', b','].into_iter().find(|d| head.contains(d)).unwrap_or(b',')
}

/// The first line that is not empty.
pub(super) fn first_line(bytes: &[u8]) -> &[u8] {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    bytes.split(|&b| b == b'\n').map(<[u8]>::trim_ascii).find(|l| !l.is_empty()).unwrap_or_default()
}

/// Tracks that grow row by row.
pub(super) fn tracks<T>(names: impl IntoIterator<Item = String>) -> Tracks<T> {
    Tracks { tracks: names.into_iter().map(Track::new).collect(), ..Tracks::default() }
}

/// Frame numbers, which must follow one another.
#[derive(Default)]
pub(super) struct Frames {
    last: Option<f64>,
    pub count: usize,
}

impl Frames {
    /// Takes the number of the row, in its first column.
    pub fn follow(&mut self, sheet: &Sheet) -> Result<(), Error> {
        let number = sheet.number(0)?.ok_or_else(|| sheet.invalid("this row has no number of a frame"))?;
        if let Some(last) = self.last.filter(|last| number != last + 1.0) {
            let problem = format!(
                "frame {number} follows frame {last}; export every frame, and those without data as empty cells"
            );
            return Err(sheet.invalid(problem));
        }
        self.last = Some(number);
        self.count += 1;
        Ok(())
    }

    /// The file must have as many as it says.
    pub fn check(&self, sheet: &Sheet, announced: Option<usize>) -> Result<(), Error> {
        if self.count == 0 {
            return Err(sheet.invalid("there is no frame in this file"));
        }
        match announced {
            Some(n) if n != self.count => Err(sheet.invalid(format!(
                "{n} frames are announced, but there are {}; the file may be cut off",
                self.count
            ))),
            _ => Ok(()),
        }
    }
}

/// Sets what all tracks of a file share.
pub(super) fn timed<T>(tracks: &mut Tracks<T>, frames: usize, rate: f64, start: f64) {
    if !tracks.tracks.is_empty() {
        (tracks.frames, tracks.rate, tracks.start) = (frames, rate, start);
    }
}

/// A pose whose parts are both there.
pub(super) fn pose(
    sheet: &Sheet,
    name: &str,
    position: Option<Vec3>,
    rotation: Option<Quat>,
) -> Result<Option<RigidPose>, Error> {
    match (position, rotation) {
        (Some(position), Some(rotation)) => Ok(Some(RigidPose { position, rotation })),
        (None, None) => Ok(None),
        (at, _) => {
            let there =
                if at.is_some() { "a position but no rotation" } else { "a rotation but no position" };
            Err(sheet.invalid(format!("the body '{name}' has {there}")))
        }
    }
}
