//! What the tables in CSV share: named columns, and the line of every mistake.
//!
//! The first line names the columns, in any order; lines that begin with `#` are for people. Columns are parted by
//! commas, or by semicolons or tabs if the first line is, and then numbers may have a decimal comma.

use crate::{Error, Place};
use std::path::Path;

/// The rows of a table, each with the cells of the columns that were asked for.
pub(crate) struct Table<'a> {
    file: &'a Path,
    columns: Vec<&'static str>,
    /// Where each of them stands in a line.
    at: Vec<Option<usize>>,
    comma: bool,
    pub rows: Vec<Row>,
}

#[derive(Clone)]
pub(crate) struct Row {
    line: usize,
    cells: csv::StringRecord,
}

impl<'a> Table<'a> {
    /// Reads the columns `needed` and `optional`; cells of absent columns are empty.
    pub fn read(
        bytes: &[u8],
        file: &'a Path,
        needed: &[&'static str],
        optional: &[&'static str],
    ) -> Result<Self, Error> {
        let mut rows = Vec::new();
        let mut table = Self::visit(bytes, file, needed, optional, |_, row| {
            rows.push(row.clone());
            Ok(())
        })?;
        table.rows = rows;
        Ok(table)
    }

    /// Calls `each` for row after row and keeps none.
    pub fn visit(
        bytes: &[u8],
        file: &'a Path,
        needed: &[&'static str],
        optional: &[&'static str],
        mut each: impl FnMut(&Self, &Row) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
        let head = bytes.split(|&b| b == b'\n').find(|l| !l.trim_ascii().is_empty() && !l.starts_with(b"#"));
        let delimiter = [b';', b'\t', b','].into_iter().find(|d| head.is_some_and(|h| h.contains(d)));
        let delimiter = delimiter.unwrap_or(b',');
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .delimiter(delimiter)
            .trim(csv::Trim::All)
            .from_reader(bytes);
        let invalid = |e: csv::Error| {
            let line = e.position().map_or(1, |p| p.line() as usize);
            let problem = match e.kind() {
                csv::ErrorKind::Utf8 { .. } => {
                    "this is not text in UTF-8; save the table as CSV in that encoding".to_string()
                }
                csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                    format!("this line has {len} columns, the first one has {expected_len}")
                }
                _ => e.to_string(),
            };
            Error::invalid(Place::line(file, line, 1), problem)
        };
        let columns: Vec<&'static str> = needed.iter().chain(optional).copied().collect();
        let names = reader.headers().map_err(invalid)?.clone();
        let first = || Place::line(file, 1, 1);
        if let Some(name) = names.iter().find(|n| !columns.contains(n)) {
            return Err(Error::unknown(first(), "column", name, columns.iter().copied()));
        }
        let at: Vec<Option<usize>> = columns.iter().map(|c| names.iter().position(|n| n == *c)).collect();
        if let Some(i) = at[..needed.len()].iter().position(Option::is_none) {
            let problem =
                format!("there is no column '{}'; the first line must name {}", needed[i], needed.join(", "));
            return Err(Error::invalid(first(), problem));
        }
        let table = Self { file, columns, at, comma: delimiter != b',', rows: Vec::new() };
        let mut row = Row { line: 1, cells: csv::StringRecord::new() };
        while reader.read_record(&mut row.cells).map_err(invalid)? {
            row.line = row.cells.position().map_or(1, |p| p.line() as usize);
            each(&table, &row)?;
        }
        Ok(table)
    }

    /// Something is wrong in a row.
    pub fn invalid(&self, row: &Row, problem: impl Into<String>) -> Error {
        Error::invalid(Place::line(self.file, row.line, 1), problem)
    }

    /// The cell of a column by its place among those asked for; empty where there is none.
    pub fn text<'r>(&self, row: &'r Row, column: usize) -> &'r str {
        self.at[column].and_then(|i| row.cells.get(i)).unwrap_or_default()
    }

    /// A finite number.
    pub fn number(&self, row: &Row, column: usize) -> Result<f32, Error> {
        let number = self.parsed(row, column).filter(|v: &f32| v.is_finite());
        number.ok_or_else(|| self.not_finite(row, column))
    }

    /// A finite number, with all its digits.
    pub fn double(&self, row: &Row, column: usize) -> Result<f64, Error> {
        let number = self.parsed(row, column).filter(|v: &f64| v.is_finite());
        number.ok_or_else(|| self.not_finite(row, column))
    }

    fn parsed<T: std::str::FromStr>(&self, row: &Row, column: usize) -> Option<T> {
        let cell = self.text(row, column);
        match self.comma && cell.contains(',') {
            true => cell.replace(',', ".").parse().ok(),
            false => cell.parse().ok(),
        }
    }

    fn not_finite(&self, row: &Row, column: usize) -> Error {
        let short: String = self.text(row, column).chars().take(40).collect();
        self.invalid(row, format!("'{short}' in column '{}' is not a finite number", self.columns[column]))
    }

    /// Three numbers in neighbouring columns.
    pub fn rgb(&self, row: &Row, column: usize) -> Result<[f32; 3], Error> {
        Ok([self.number(row, column)?, self.number(row, column + 1)?, self.number(row, column + 2)?])
    }
}
