//! Words and numbers of a text file, fast and with the place of every mistake.

use crate::{Error, Place};
use std::borrow::Cow;
use std::path::Path;

/// The bytes of a text as UTF-8 whose lines end with a line feed, whatever it was written on: without a byte-order
/// mark, out of UTF-16 where the mark says so, and with the carriage returns of old Macintoshes replaced.
pub(crate) fn text(bytes: &[u8]) -> Cow<'_, [u8]> {
    let utf16 = |units: &mut dyn Iterator<Item = u16>| {
        let text: String =
            char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
        Cow::Owned(text.into_bytes())
    };
    let pairs = bytes.get(2..).unwrap_or_default().chunks_exact(2);
    let text = match bytes {
        [0xff, 0xfe, ..] => utf16(&mut pairs.map(|b| u16::from_le_bytes([b[0], b[1]]))),
        [0xfe, 0xff, ..] => utf16(&mut pairs.map(|b| u16::from_be_bytes([b[0], b[1]]))),
        _ => Cow::Borrowed(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)),
    };
    if text.contains(&b'\n') || !text.contains(&b'\r') {
        return text;
    }
    Cow::Owned(text.iter().map(|&b| if b == b'\r' { b'\n' } else { b }).collect())
}

/// Walks over the bytes of a text file line by line and word by word.
pub(crate) struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
    line_start: usize,
    path: &'a Path,
}

/// A position in the text of a [`Scanner`].
#[derive(Clone, Copy)]
pub(crate) struct Mark {
    at: usize,
    line: usize,
    line_start: usize,
}

impl<'a> Scanner<'a> {
    pub(crate) fn new(bytes: &'a [u8], path: &'a Path) -> Self {
        Self { bytes, at: 0, line: 1, line_start: 0, path }
    }

    /// Goes on in all of `bytes` where `other` stopped, which saw only their beginning.
    pub(crate) fn resume(bytes: &'a [u8], other: &Scanner<'a>) -> Self {
        Self { bytes, ..*other }
    }

    /// Bytes read so far.
    pub(crate) fn offset(&self) -> usize {
        self.at
    }

    /// The first line and column.
    pub(crate) fn start_of_file(&self) -> Place {
        Place::line(self.path, 1, 1)
    }

    /// Where it stands, to be named only if something turns out to be wrong there.
    #[inline]
    pub(crate) fn mark(&self) -> Mark {
        Mark { at: self.at, line: self.line, line_start: self.line_start }
    }

    /// The place of a mark.
    pub(crate) fn place_of(&self, m: Mark) -> Place {
        Place::line(self.path, m.line, m.at - m.line_start + 1)
    }

    /// Where it stands.
    pub(crate) fn place(&self) -> Place {
        self.place_of(self.mark())
    }

    /// "Expected this, found that" for what comes next.
    pub(crate) fn expected(&self, what: &str) -> Error {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|b| b.is_ascii_whitespace()).unwrap_or(rest.len()).min(40);
        let found = match (rest.first(), end) {
            (None, _) => "the end of the file".to_string(),
            (_, 0) => "the end of the line".to_string(),
            _ => format!("'{}'", String::from_utf8_lossy(&rest[..end]).escape_debug()),
        };
        Error::invalid(self.place(), format!("expected {what}, found {found}"))
    }

    /// Bytes not read yet.
    pub(crate) fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// Whether the file ends here.
    pub(crate) fn at_end(&self) -> bool {
        self.at >= self.bytes.len()
    }

    /// Skips blanks and continued line ends (`\` before the break), not line ends.
    #[inline]
    pub(crate) fn blanks(&mut self) {
        while let Some(&b) = self.bytes.get(self.at) {
            // Most of the time a word begins.
            if b > b' ' && b != b'\\' {
                break;
            }
            match b {
                b' ' | b'\t' | b'\r' | 0x0b | 0x0c => self.at += 1,
                b'\\' => match self.continued() {
                    Some(bytes) => self.step_line(bytes),
                    None => break,
                },
                _ => break,
            }
        }
    }

    /// How long a `\` is together with the end of its line, between which some editors leave blanks.
    fn continued(&self) -> Option<usize> {
        let after = &self.bytes[self.at + 1..];
        let n = after.iter().position(|b| !matches!(b, b' ' | b'\t' | b'\r'))?;
        (after[n] == b'\n').then_some(n + 2)
    }

    fn step_line(&mut self, bytes: usize) {
        self.at += bytes;
        self.line += 1;
        self.line_start = self.at;
    }

    /// Skips blanks and line ends.
    #[inline]
    pub(crate) fn space(&mut self) {
        loop {
            self.blanks();
            if self.bytes.get(self.at) != Some(&b'\n') {
                break;
            }
            self.step_line(1);
        }
    }

    /// Whether nothing but blanks is left on the line.
    pub(crate) fn at_line_end(&mut self) -> bool {
        self.blanks();
        matches!(self.bytes.get(self.at), None | Some(b'\n'))
    }

    /// Goes to the start of the next line and returns what was left of this one.
    pub(crate) fn next_line(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let n = rest.iter().position(|&b| b == b'\n');
        self.at += n.unwrap_or(rest.len());
        if n.is_some() {
            self.step_line(1);
        }
        rest[..n.unwrap_or(rest.len())].trim_ascii()
    }

    /// Steps over the one line end that comes next, and over no blank after it: binary data may follow.
    pub(crate) fn next_line_exactly(&mut self) {
        if self.take(b'\n') {
            self.line += 1;
            self.line_start = self.at;
        }
    }

    /// The next word of the line, empty at its end.
    #[inline]
    pub(crate) fn word(&mut self) -> &'a [u8] {
        self.blanks();
        let rest = &self.bytes[self.at..];
        let n = rest.iter().position(|b| b.is_ascii_whitespace()).unwrap_or(rest.len());
        self.at += n;
        &rest[..n]
    }

    /// What is left of the line up to an opening brace, as a name.
    pub(crate) fn next_name(&mut self) -> String {
        self.blanks();
        let rest = &self.bytes[self.at..];
        let n = rest.iter().position(|&b| b == b'\n' || b == b'{').unwrap_or(rest.len());
        self.at += n;
        String::from_utf8_lossy(rest[..n].trim_ascii()).into_owned()
    }

    /// The next byte, if it is `byte`, is taken.
    #[inline]
    pub(crate) fn take(&mut self, byte: u8) -> bool {
        let is = self.bytes.get(self.at) == Some(&byte);
        self.at += usize::from(is);
        is
    }

    /// A decimal number, finite as `f64`; `None`, and nothing taken, where there is none.
    #[inline]
    pub(crate) fn float(&mut self) -> Option<f64> {
        self.blanks();
        let (value, n) = float(&self.bytes[self.at..])?;
        self.at += n;
        Some(value)
    }

    /// A whole number; `None`, and nothing taken, where there is none or it has more than 18 digits.
    #[inline]
    pub(crate) fn integer(&mut self) -> Option<i64> {
        let rest = &self.bytes[self.at..];
        let sign = usize::from(matches!(rest.first(), Some(b'-' | b'+')));
        let mut value = 0i64;
        let mut n = sign;
        while let Some(d) = rest.get(n).map(|b| b.wrapping_sub(b'0')).filter(|&d| d < 10) {
            if n - sign == 18 {
                return None;
            }
            value = value * 10 + i64::from(d);
            n += 1;
        }
        if n == sign {
            return None;
        }
        self.at += n;
        Some(if rest[0] == b'-' { -value } else { value })
    }
}

/// The decimal number at the start of `text` and its length; correctly rounded to `f64`.
#[inline]
pub(crate) fn float(text: &[u8]) -> Option<(f64, usize)> {
    // Powers of ten that f64 holds exactly: with a mantissa below 2⁵³ one multiplication or division
    // rounds once, so the result is exact (Clinger 1990, the fast case).
    const POWERS: [f64; 23] = [
        1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17,
        1e18, 1e19, 1e20, 1e21, 1e22,
    ];
    let digit = |i: usize| text.get(i).map(|b| b.wrapping_sub(b'0')).filter(|&d| d < 10);
    let mut n = usize::from(matches!(text.first(), Some(b'-' | b'+')));
    let (mut mantissa, mut digits, mut scale) = (0u64, 0usize, 0i32);
    while let Some(d) = digit(n) {
        mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(d));
        digits += 1;
        n += 1;
    }
    if text.get(n) == Some(&b'.') {
        n += 1;
        while let Some(d) = digit(n) {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(d));
            digits += 1;
            scale -= 1;
            n += 1;
        }
    }
    if digits == 0 {
        return None;
    }
    if matches!(text.get(n), Some(b'e' | b'E')) {
        let mut m = n + 1;
        let negative = text.get(m) == Some(&b'-');
        m += usize::from(matches!(text.get(m), Some(b'-' | b'+')));
        let (first, mut exponent) = (m, 0i32);
        while let Some(d) = digit(m) {
            exponent = (exponent * 10 + i32::from(d)).min(100_000);
            m += 1;
        }
        if m == first {
            return None;
        }
        scale += if negative { -exponent } else { exponent };
        n = m;
    }
    // A number must end where its word ends: `1.2.3` and `12abc` are no numbers.
    if text.get(n).is_some_and(|b| b.is_ascii_alphanumeric() || *b == b'.' || *b == b'_') {
        return None;
    }
    let value = if digits <= 15 && scale.unsigned_abs() <= 22 {
        let power = POWERS[scale.unsigned_abs() as usize];
        let v = if scale < 0 { mantissa as f64 / power } else { mantissa as f64 * power };
        if text[0] == b'-' { -v } else { v }
    } else {
        std::str::from_utf8(&text[..n]).ok()?.parse::<f64>().ok()?
    };
    value.is_finite().then_some((value, n))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_what_the_standard_library_reads() {
        for text in [
            "0",
            "-0.5",
            "+1",
            ".5",
            "5.",
            "1e3",
            "1E-3",
            "123456789012345678901234567890",
            "3.4028235e38",
            "1e-300",
            "0.1",
            "2.2250738585072014e-308",
            "-179.99999999999997",
            "9007199254740993",
            "0.000000000000000000000000001",
        ] {
            let (v, n) = float(text.as_bytes()).unwrap_or_else(|| panic!("{text}"));
            assert_eq!((v.to_bits(), n), (text.parse::<f64>().unwrap().to_bits(), text.len()), "{text}");
        }
        let mut rng = yugen_optics::random::Pcg32::new(1, 1);
        for _ in 0..20_000 {
            let v = f32::from_bits(rng.next_u32());
            if v.is_finite() {
                for text in [format!("{v}"), format!("{v:e}"), format!("{:.6}", v.clamp(-1e9, 1e9))] {
                    assert_eq!(
                        float(text.as_bytes()).map(|f| f.0.to_bits()),
                        text.parse().ok().map(f64::to_bits),
                        "{text}"
                    );
                }
            }
        }
        for text in ["", "-", ".", "e5", "1e", "nan", "inf", "1.2.3", "12a", "1e999"] {
            assert_eq!(float(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn places_count_lines_and_columns_from_one() {
        let mut s = Scanner::new(b"ab 12\n  -7 \\\n x", Path::new("f"));
        assert_eq!(s.word(), b"ab");
        assert_eq!(s.float(), Some(12.0));
        assert!(s.at_line_end());
        s.space();
        assert_eq!(s.place().to_string(), "f:2:3");
        assert_eq!(s.integer(), Some(-7));
        assert!(!s.at_line_end());
        assert_eq!(s.expected("a number").to_string(), "f:3:2: expected a number, found 'x'");
    }
}
