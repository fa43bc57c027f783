//! Hemispherical harmonics as RTIBuilder writes them, `.rti` (`#HSH1.2`).
//!
//! Text lines `#HSH1.2`, the kind 3, `width height 3`, `terms 2 bytes`; then a scale and a bias for each term as
//! floats, little end first; then the top row first, texel by texel, red, green, blue, in each every term. In one
//! byte a coefficient is byte/255 · scale + bias, in four it is a float, and a colour lies between 0 and 1.

use super::gathered::Gathered;
use super::numbers::Scanner;
use super::relightable::{Basis, Colouring, Relightable, admit};
use crate::{Error, Place};
use std::io::Write;
use std::path::Path;

/// What the format's second line can say, from 1 on.
const KINDS: [&str; 4] = ["PTM", "spherical harmonics", "HSH", "an adaptive basis"];

/// Reads a file; more than `max_texels` are refused before memory is asked for.
pub fn read(bytes: &[u8], file: &Path, max_texels: u64) -> Result<Relightable, Error> {
    let mut s = Scanner::new(bytes, file);
    let start = s.start_of_file();
    if s.next_line() != b"#HSH1.2" {
        return Err(Error::invalid(start, "a HSH file starts with the line '#HSH1.2'"));
    }
    while s.rest().starts_with(b"#") {
        s.next_line();
    }
    let mut whole = |what: &str| -> Result<(u64, Place), Error> {
        s.space();
        let at = s.place();
        let value = s.integer().ok_or_else(|| s.expected(&format!("{what}, a whole number")))?;
        match u64::try_from(value) {
            Ok(value) => Ok((value, at)),
            Err(_) => Err(Error::invalid(at, format!("{what} is negative"))),
        }
    };
    let (kind, at) = whole("the kind of the file")?;
    if kind != 3 {
        let named = usize::try_from(kind).ok().and_then(|k| KINDS.get(k.checked_sub(1)?));
        let found = named.map_or("an unknown kind".into(), |k| format!("kind {kind}, {k}"));
        return Err(Error::invalid(at, format!("expected kind 3, HSH; found {found}, which is not read")));
    }
    let (width, at) = whole("the width")?;
    let (height, _) = whole("the height")?;
    let (width, height) = admit(at, width, height, max_texels)?;
    let (components, at) = whole("the number of colours")?;
    if components != 3 {
        return Err(Error::invalid(at, format!("expected 3 colours, found {components}")));
    }
    let (terms, at) = whole("the number of terms")?;
    // The first files counted orders above the constant one.
    let terms = if matches!(terms, 1 | 2) { (terms + 1).pow(2) } else { terms };
    let Some(basis) = Basis::ALL.into_iter().find(|b| *b != Basis::Ptm && b.terms() as u64 == terms) else {
        return Err(Error::invalid(at, format!("expected 4, 9 or 16 terms, found {terms}")));
    };
    let (colouring, at) = whole("the kind of colours")?;
    if colouring != 2 {
        let problem = format!("expected colours of kind 2, each with its own terms; found kind {colouring}");
        return Err(Error::invalid(at, problem));
    }
    let (size, at) = whole("the bytes of a coefficient")?;
    if size != 1 && size != 4 {
        return Err(Error::invalid(at, format!("expected coefficients of 1 or 4 bytes, found {size}")));
    }
    if !s.at_line_end() {
        return Err(s.expected("the end of the header's last line"));
    }
    s.next_line_exactly();

    let (terms, size) = (terms as usize, size as usize);
    let (offset, data) = (s.offset(), s.rest());
    let need = 8 * terms + width * height * 3 * terms * size;
    if data.len() < need {
        let problem = format!(
            "the file ends early: {width} x {height} texels of {terms} terms need {need} bytes from byte {offset} on, \
             and {} are there",
            data.len()
        );
        return Err(Error::invalid(Place::byte(file, bytes.len() as u64), problem));
    }
    let float = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let (ranges, data) = data.split_at(8 * terms);
    let ranges: Vec<f32> = ranges.chunks_exact(4).map(float).collect();
    let (scale, bias) = ranges.split_at(terms);
    let mut r = Relightable { width, height, basis, colouring: Colouring::Rgb, coefficients: Vec::new() };
    r.coefficients = vec![0.0; width * height * 3 * terms];
    let texels = data.chunks_exact(3 * terms * size);
    for (texel, data) in r.coefficients.chunks_exact_mut(3 * terms).zip(texels) {
        for (i, coded) in data.chunks_exact(size).enumerate() {
            let (colour, term) = (i / terms, i % terms);
            let value = if size == 1 { f32::from(coded[0]) / 255.0 } else { float(coded) };
            texel[3 * term + colour] = value * scale[term] + bias[term];
        }
    }
    if r.coefficients.iter().any(|v| !v.is_finite()) {
        return Err(Error::invalid(Place::byte(file, offset as u64), "a coefficient is not a finite number"));
    }
    Ok(r)
}

/// Writes a file with one byte a coefficient to `out`; `file` is for messages.
pub fn write(r: &mut Gathered, file: &Path, out: &mut dyn Write) -> Result<(), Error> {
    r.check(file)?;
    if !matches!(r.basis(), Basis::Hsh { .. }) || r.colouring() != Colouring::Rgb {
        let problem = "a .rti holds HSH with a term for each of red, green and blue; write PTM as .ptm";
        return Err(Error::invalid(Place::file(file), problem));
    }
    let terms = r.basis().terms();
    let ranges = r.term_ranges();
    let [width, height] = r.size();
    let mut bytes = format!("#HSH1.2\n3\n{width} {height} 3\n{terms} 2 1\n").into_bytes();
    bytes.extend(ranges.iter().flat_map(|[lo, hi]| (hi - lo).to_le_bytes()));
    bytes.extend(ranges.iter().flat_map(|[lo, _]| lo.to_le_bytes()));
    let mut row = Vec::new();
    for y in 0..height {
        r.row(y, &mut row)?;
        for texel in row.chunks_exact(3 * terms) {
            for colour in 0..3 {
                bytes.extend(ranges.iter().enumerate().map(|(term, [lo, hi])| {
                    // A term that never changes: 0/0 is no number, which becomes 0.
                    (255.0 * (texel[3 * term + colour] - lo) / (hi - lo)).round() as u8
                }));
            }
        }
        out.write_all(&bytes).map_err(|e| Error::io(file, e))?;
        bytes.clear();
    }
    Ok(())
}

/// The bytes of a file.
#[cfg(test)]
pub(super) fn written(r: &super::relightable::Relightable) -> Result<Vec<u8>, Error> {
    let mut out = Vec::new();
    write(&mut r.into(), Path::new("a.rti"), &mut out).map(|()| out)
}

#[cfg(test)]
mod tests {
    use super::super::relightable::DEFAULT_MAX_TEXELS;
    use super::super::relightable::tests::{quanta, sample};
    use super::*;

    fn parse(bytes: &[u8]) -> Result<Relightable, Error> {
        read(bytes, Path::new("a.rti"), DEFAULT_MAX_TEXELS)
    }

    /// By hand, as RTIBuilder ends its lines.
    #[test]
    fn the_order_of_texels_colours_and_terms_is_that_of_the_format() {
        let mut bytes = b"#HSH1.2\r\n# made by hand\r\n3\r\n1 2 3\r\n4 2 1\r\n".to_vec();
        for v in [255.0, 510.0, 255.0, 255.0, -1.0, 0.0, 0.0, 5.0f32] {
            bytes.extend(v.to_le_bytes());
        }
        bytes.extend(1..=24u8);
        let r = parse(&bytes).unwrap();
        assert_eq!((r.width, r.height, r.basis), (1, 2, Basis::Hsh { order: 2 }));
        // Top texel: red has the bytes 1 to 4, green 5 to 8, blue 9 to 12.
        let top = [0.0, 4.0, 8.0, 4.0, 12.0, 20.0, 3.0, 7.0, 11.0, 9.0, 13.0, 17.0];
        assert!(r.coefficients.iter().zip(top).all(|(a, b)| (a - b).abs() < 1e-4), "{:?}", r.coefficients);
        assert!((r.coefficients[12] - 12.0).abs() < 1e-4);

        // The same as floats.
        let header = "#HSH1.2\n3\n1 2 3\n4 2 4\n";
        let mut floats = header.as_bytes().to_vec();
        floats.extend([1.0f32; 4].iter().chain(&[0.0; 4]).flat_map(|v| v.to_le_bytes()));
        for texel in r.coefficients.chunks(12) {
            floats.extend((0..12).flat_map(|i| texel[3 * (i % 4) + i / 4].to_le_bytes()));
        }
        assert_eq!(parse(&floats).unwrap(), r);
        let at = header.len() + 32;
        floats[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(parse(&floats).unwrap_err().to_string().contains("not a finite number"));
    }

    #[test]
    fn files_come_back_within_a_quantum() {
        for order in 2..5 {
            let r = sample(Basis::Hsh { order }, Colouring::Rgb, 13, 7);
            let back = parse(&written(&r).unwrap()).unwrap();
            assert!(quanta(&r, &back) < 0.51, "{order}: {}", quanta(&r, &back));
        }
    }

    #[test]
    fn bad_files_get_a_sentence() {
        let r = sample(Basis::Hsh { order: 3 }, Colouring::Rgb, 3, 2);
        let good = written(&r).unwrap();
        let text = |from: &str, to: &str| {
            let at = good.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
            [&good[..at], to.as_bytes(), &good[at + from.len()..]].concat()
        };
        for (from, to, want) in [
            ("#HSH1.2", "#HSH2.0", "a.rti:1:1: a HSH file starts with the line '#HSH1.2'"),
            ("\n3\n", "\n1\n", "a.rti:2:1: expected kind 3, HSH; found kind 1, PTM, which is not read"),
            ("\n3\n", "\n99\n", "found an unknown kind"),
            ("3 2 3", "3 2 1", "a.rti:3:5: expected 3 colours, found 1"),
            ("3 2 3", "0 2 3", "a.rti:3:1: the picture is empty (0 x 2)"),
            ("3 2 3", "3 -2 3", "a.rti:3:3: the height is negative"),
            ("3 2 3", "99999999 99999999 3", "the number of texels (99999999 x 99999999)"),
            ("9 2 1", "8 2 1", "a.rti:4:1: expected 4, 9 or 16 terms, found 8"),
            ("9 2 1", "9 1 1", "a.rti:4:3: expected colours of kind 2"),
            ("9 2 1", "9 2 2", "a.rti:4:5: expected coefficients of 1 or 4 bytes, found 2"),
            ("9 2 1", "9 2 4", "the file ends early: 3 x 2 texels of 9 terms need 720 bytes"),
        ] {
            let got = parse(&text(from, to)).unwrap_err().to_string();
            assert!(got.contains(want), "{from} -> {to}: {got}");
        }
        for n in 0..good.len() {
            assert!(parse(&good[..n]).is_err(), "{n}");
        }
        assert_eq!(parse(&text("9 2 1", "2 2 1")).unwrap(), parse(&good).unwrap(), "two orders");
        let lrgb = sample(Basis::Hsh { order: 3 }, Colouring::Lrgb, 1, 1);
        assert!(written(&lrgb).is_err());
    }
}
