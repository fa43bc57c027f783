//! Which pictures were taken for how long, under which light.
//!
//! ```text
//! file,seconds,light
//! IMG_0001.jpg,1/60,left
//! IMG_0002.jpg,0.25,left
//! ```
//! Seconds are a number or a fraction; without the column `light` all pictures belong to one.

use super::csv::Table;
use crate::Error;
use std::path::Path;

/// An exposure.
#[derive(Clone, Debug, PartialEq)]
pub struct Exposure {
    /// The name of the picture.
    pub file: String,
    /// How long it was exposed, from a nanosecond to thirty years.
    pub seconds: f32,
    /// The name of the light; may be empty.
    pub light: String,
}

/// The exposures of a list in its order.
pub fn read(bytes: &[u8], file: &Path) -> Result<Vec<Exposure>, Error> {
    let table = Table::read(bytes, file, &["file", "seconds"], &["light"])?;
    let exposure = |row| {
        let text = table.text(row, 1);
        let seconds = match text.split_once('/') {
            Some((over, under)) => over
                .trim()
                .parse()
                .ok()
                .zip(under.trim().parse().ok())
                .map(|(over, under): (f32, f32)| over / under)
                .ok_or_else(|| {
                    table.invalid(row, format!("'{text}' is not a time; expected seconds, as in 1/60"))
                })?,
            None => table.number(row, 1)?,
        };
        if !(1e-9..=1e9).contains(&seconds) {
            return Err(table.invalid(
                row,
                format!("the time '{text}' is no exposure; expected seconds above zero, as in 0.25 or 1/60"),
            ));
        }
        if table.text(row, 0).is_empty() {
            return Err(table.invalid(row, "there is no file name"));
        }
        Ok(Exposure { file: table.text(row, 0).into(), seconds, light: table.text(row, 2).into() })
    };
    table.rows.iter().map(exposure).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_read_and_mistakes_have_a_line() {
        let parse = |text: &str| read(text.as_bytes(), Path::new("e.csv"));
        let got =
            parse("\u{feff}# from the log\nlight; file;seconds\nleft; a 1.jpg;1/50\n;\"b;c.jpg\";0,25\n")
                .unwrap();
        let want = [("a 1.jpg", 0.02, "left"), ("b;c.jpg", 0.25, "")];
        assert_eq!(got, want.map(|(f, seconds, l)| Exposure { file: f.into(), seconds, light: l.into() }));
        for (text, want) in [
            ("", "e.csv:1:1: there is no column 'file'; the first line must name file, seconds"),
            ("file,second\n", "e.csv:1:1: unknown column 'second'; did you mean 'seconds'?"),
            ("file,seconds\na,0\n", "e.csv:2:1: the time '0' is no exposure; expected seconds above zero"),
            ("file,seconds\na,1\nb,x\n", "e.csv:3:1: 'x' in column 'seconds' is not a finite number"),
            ("file,seconds\na,1/x\n", "e.csv:2:1: '1/x' is not a time"),
            ("file,seconds\na,1e30\n", "e.csv:2:1: the time '1e30' is no exposure"),
            ("file,seconds\na,1/0\n", "e.csv:2:1: the time '1/0' is no exposure"),
            ("file,seconds\na\n", "e.csv:2:1: this line has 1 columns, the first one has 2"),
            ("file,seconds\n,1\n", "e.csv:2:1: there is no file name"),
        ] {
            let got = parse(text).unwrap_err().to_string();
            assert!(got.starts_with(want), "{text:?}: {got}");
        }
        assert!(read(b"file,seconds\na\xff,1\n", Path::new("e")).unwrap_err().to_string().contains("UTF-8"));
    }
}
