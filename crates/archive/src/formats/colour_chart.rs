//! A colour chart: what the camera says of each patch beside what it is.
//!
//! ```text
//! red,green,blue,known_red,known_green,known_blue
//! 0.081,0.060,0.041,0.172,0.084,0.057
//! ```
//! All numbers are linear; those that are known are of the space that the pictures are to be in.

use super::csv::Table;
use crate::{Error, Place};
use std::path::Path;

/// A patch of a chart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// What the camera says.
    pub measured: [f32; 3],
    /// What it is.
    pub known: [f32; 3],
}

/// The patches of a chart, at least three.
pub fn read(bytes: &[u8], file: &Path) -> Result<Vec<Patch>, Error> {
    let columns = ["red", "green", "blue", "known_red", "known_green", "known_blue"];
    let table = Table::read(bytes, file, &columns, &[])?;
    if table.rows.len() < 3 {
        let problem = format!("the chart has {} patches; expected three or more", table.rows.len());
        return Err(Error::invalid(Place::file(file), problem));
    }
    table
        .rows
        .iter()
        .map(|row| Ok(Patch { measured: table.rgb(row, 0)?, known: table.rgb(row, 3)? }))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_are_read() {
        let head = "known_red,known_green,known_blue,red,green,blue\n";
        let read = |rows: &str| read(format!("{head}{rows}").as_bytes(), Path::new("c.csv"));
        assert_eq!(
            read("1,2,3,4,5,6\n0,0,0,1,1,1\n1,0,0,1,0,0\n").unwrap()[0],
            Patch { measured: [4.0, 5.0, 6.0], known: [1.0, 2.0, 3.0] }
        );
        assert!(read("1,2,3,4,5,6\n").unwrap_err().to_string().starts_with("c.csv: the chart has 1 patches"));
        assert!(
            read("1,2,3,4,5,6\n1,2,3,4,5,x\n0,0,0,0,0,0\n")
                .unwrap_err()
                .to_string()
                .starts_with("c.csv:3:1: 'x'")
        );
    }
}
