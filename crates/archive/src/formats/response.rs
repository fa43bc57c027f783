//! How the levels of a camera follow light.
//!
//! ```text
//! level,red,green,blue
//! 0,0,0,0
//! 0.5,0.21,0.21,0.22
//! 1,1,1,1
//! ```
//! Levels are fractions of full scale, evenly spaced from 0 to 1; light is 1 at full scale.

use super::csv::Table;
use crate::{Error, Place};
use std::fmt::Write;
use std::path::Path;

/// Light (red, green, blue) at evenly spaced levels from 0 to 1, at least two.
pub fn read(bytes: &[u8], file: &Path) -> Result<Vec<[f32; 3]>, Error> {
    let table = Table::read(bytes, file, &["level", "red", "green", "blue"], &[])?;
    let n = table.rows.len();
    if n < 2 {
        return Err(Error::invalid(
            Place::file(file),
            format!("the table has {n} levels; expected two or more"),
        ));
    }
    let entry = |(i, row)| {
        let (level, even) = (table.number(row, 0)?, i as f32 / (n - 1) as f32);
        // Half of the distance between two of 65536 levels.
        if (level - even).abs() > 0.5 / 65535.0 {
            let problem = format!("the level is {level}; expected {even}, as levels rise evenly from 0 to 1");
            return Err(table.invalid(row, problem));
        }
        table.rgb(row, 1)
    };
    table.rows.iter().enumerate().map(entry).collect()
}

/// The text of a table.
pub fn write(light: &[[f32; 3]]) -> String {
    let mut text = String::from("level,red,green,blue\n");
    let last = light.len().saturating_sub(1).max(1);
    for (i, [r, g, b]) in light.iter().enumerate() {
        let _ = writeln!(text, "{},{r},{g},{b}", i as f32 / last as f32);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_come_back_and_uneven_ones_are_refused() {
        let light: Vec<[f32; 3]> =
            (0..256).map(|i| [i as f32 / 255.0, 0.1 * i as f32, 1.0 / (i + 1) as f32]).collect();
        assert_eq!(read(write(&light).as_bytes(), Path::new("r.csv")).unwrap(), light);
        for (text, want) in [
            ("level,red,green,blue\n0,0,0,0\n", "r.csv: the table has 1 levels"),
            (
                "level,red,green,blue\n0,0,0,0\n0.4,1,1,1\n1,1,1,1\n",
                "r.csv:3:1: the level is 0.4; expected 0.5",
            ),
            ("level,red,green,blue\n0,0,0,0\n1,1,1,nan\n", "r.csv:3:1: 'nan' in column 'blue'"),
        ] {
            let got = read(text.as_bytes(), Path::new("r.csv")).unwrap_err().to_string();
            assert!(got.starts_with(want), "{got}");
        }
    }
}
