//! `.lp`: the list of lights of an RTI capture: a count, then a line `file x y z` a picture.
//!
//! ```text
//! 2
//! IMG 0001.png 0.5773 0.5773 0.5773
//! IMG 0002.png -0,6 0,0 0,8
//! ```
//! The last three words of a line are numbers, with a decimal point or a decimal comma; all before them is the name
//! of the file, blanks and quotes around it aside. Where a name with an extension is followed by more numbers, the first
//! three count. The count may be missing, or the columns be named in its place (`file,x,y,z`). Commas or semicolons may stand between the columns instead of blanks, and a list may do without names:
//! then its lines are those of the pictures in the order of their names. The numbers say where the light stands as seen from the object: a
//! direction of any length, or a position where the capture had its lamps near. Lengths are kept. +x is right,
//! +y up, +z to the camera, unless [`Axes`] say otherwise.

use crate::{Error, Place};
use glam::Vec3;
use std::fmt::{self, Display, Formatter, Write};
use std::path::Path;
use std::str::FromStr;

/// One picture of a list.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The name as it stands in the list, often with a folder of the computer that wrote it; empty in all entries of a
    /// list without names.
    pub file: String,
    /// Toward the light, or where it stands; finite, not zero, z above zero. A light on the horizon, or at most a degree
    /// below it, is lifted to [`LOWEST`].
    pub light: Vec3,
}

/// Sine of the elevation to which lights at the horizon are lifted.
pub const LOWEST: f32 = 1e-3;

/// Sine of a degree: what may be wrong with a light that the list has below the horizon.
const DEGREE: f64 = 0.017_452_4;

/// Which numbers of a list are x, y and z: some programs count y downwards or name the axes in another order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes([(usize, f32); 3]);

impl Default for Axes {
    fn default() -> Self {
        Self([(0, 1.0), (1, 1.0), (2, 1.0)])
    }
}

impl Axes {
    /// The point that the three numbers of a line mean.
    pub fn apply(self, numbers: Vec3) -> Vec3 {
        Vec3::from_array(self.0.map(|(axis, sign)| sign * numbers[axis]))
    }
}

impl Display for Axes {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        // The name of each number of a line, not the number of each name.
        let names: Vec<String> = (0..3)
            .filter_map(|n| self.0.iter().position(|(number, _)| *number == n))
            .map(|axis| format!("{}{}", if self.0[axis].1 < 0.0 { "-" } else { "" }, ["x", "y", "z"][axis]))
            .collect();
        f.write_str(&names.join(" "))
    }
}

/// Three words, each one of `x`, `y`, `z` with or without a minus: the first number of a line is called x, and
/// `x -y z` says that it counts y downwards.
impl FromStr for Axes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected =
            || format!("the axes are '{text}'; expected x, y and z in any order, each once, as in 'x -y z'");
        let words: Vec<&str> = text.split_whitespace().collect();
        let words: [&str; 3] = words.try_into().map_err(|_| expected())?;
        let mut axes = Self::default();
        let mut seen = [false; 3];
        for (number, word) in words.into_iter().enumerate() {
            let (sign, name) = word.strip_prefix('-').map_or((1.0, word), |name| (-1.0, name));
            let axis = ["x", "y", "z"].iter().position(|n| *n == name).ok_or_else(expected)?;
            if std::mem::replace(&mut seen[axis], true) {
                return Err(expected());
            }
            axes.0[axis] = (number, sign);
        }
        Ok(axes)
    }
}

/// The pictures of a list in its order.
pub fn read(bytes: &[u8], file: &Path, axes: Axes) -> Result<Vec<Entry>, Error> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let at = Place::byte(file, e.valid_up_to() as u64);
        // Nobody's list holds a zero byte.
        let problem = if bytes.contains(&0) {
            "this is no list of lights (.lp), which is text; name the folder of the photographs or its list"
        } else {
            "this is not text in UTF-8; save the list in that encoding"
        };
        Error::invalid(at, problem)
    })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines().enumerate().map(|(i, l)| (i + 1, l)).filter(|(_, l)| !l.trim().is_empty());
    let Some((first, head)) = lines.next() else {
        return Err(Error::invalid(
            Place::file(file),
            "the list is empty; its first line is the number of lights",
        ));
    };
    // Tables of other programs have the names of columns there, or nothing.
    let count: Option<u64> = head.trim().parse().ok();
    let light = if count.is_none() && !names_columns(head) {
        if split(head).is_err() {
            let problem = format!(
                "'{}' is no number of lights, and no line 'file x y z' either; the first line must be one of them",
                shorten(head.trim())
            );
            return Err(Error::invalid(Place::line(file, first, 1), problem));
        }
        Some((first, head))
    } else {
        None
    };
    let mut entries: Vec<Entry> = Vec::new();
    let (mut low, mut longer) = (0, 0);
    for (number, line) in light.into_iter().chain(lines) {
        let Columns { name, numbers, more } = split(line).map_err(|(word, problem)| {
            let offset = word.as_ptr() as usize - line.as_ptr() as usize;
            Error::invalid(Place::line(file, number, line[..offset].chars().count() + 1), problem)
        })?;
        let at = || Place::line(file, number, 1);
        if entries.first().is_some_and(|first| first.file.is_empty() != name.is_empty()) {
            return Err(Error::invalid(
                at(),
                "some lines have file names and some have none; give all of them one",
            ));
        }
        longer += usize::from(more);
        let mut light = axes.apply(numbers);
        if light == Vec3::ZERO {
            return Err(Error::invalid(
                at(),
                "the light stands in the origin and so has no direction; correct or delete the line",
            ));
        }
        // In f64 nothing overflows.
        let length = light.as_dvec3().length();
        let z = f64::from(light.z);
        if z < -DEGREE * length {
            let named = if name.is_empty() { String::new() } else { format!(" of '{}'", shorten(name)) };
            let problem = format!(
                "the light{named} does not stand above the horizon (z is {}); correct or delete the line, or name the \
                 axes of the list, as in 'x y -z'",
                light.z
            );
            return Err(Error::invalid(at(), problem));
        }
        low += usize::from(z < DEGREE * length);
        // A light that has been lifted is not lifted again.
        if z < f64::from(LOWEST) * length * (1.0 - 1e-5) {
            light.z = ((f64::from(LOWEST) * length) as f32).max(f32::MIN_POSITIVE);
        }
        entries.push(Entry { file: name.to_string(), light });
    }
    if low > 0 {
        tracing::warn!(
            "{}: {low} of {} lights stand within a degree of the horizon; what they graze tells little",
            file.display(),
            entries.len()
        );
    }
    if longer > 0 {
        tracing::warn!(
            "{}: {longer} lines have more than three numbers; the first three after the name are taken",
            file.display()
        );
    }
    if let Some(count) = count.filter(|count| *count != entries.len() as u64) {
        let problem = format!(
            "the first line promises {count} lights, but {} follow; correct the number, or add what is missing",
            entries.len()
        );
        return Err(Error::invalid(Place::line(file, first, 1), problem));
    }
    Ok(entries)
}

/// Whether a line names the columns x, y, z, whatever stands before and behind them.
fn names_columns(line: &str) -> bool {
    let lower = line.to_lowercase();
    let words: Vec<&str> = lower
        .split(|c: char| c.is_whitespace() || [',', ';', '"', '#'].contains(&c))
        .filter(|w| !w.is_empty())
        .collect();
    words
        .windows(3)
        .any(|w| ["x", "y", "z"].iter().zip(w).all(|(axis, w)| w.trim_start_matches("light_") == *axis))
}

/// What a line says.
struct Columns<'a> {
    /// Empty where there is none.
    name: &'a str,
    numbers: Vec3,
    /// Whether numbers follow that were left out.
    more: bool,
}

/// A number of a list: `0.5`, `0,5`, `.5,`.
fn number(word: &str) -> Option<f32> {
    // A comma at the end parts the numbers, one between digits is a decimal point.
    let bare = word.strip_suffix([',', ';']).unwrap_or(word);
    let value = match (bare.contains('.'), bare.matches(',').count()) {
        (false, 1) => bare.replace(',', ".").parse::<f32>(),
        _ => bare.parse::<f32>(),
    };
    value.ok().filter(|v| v.is_finite())
}

/// Without quotes around it.
fn unquoted(name: &str) -> &str {
    name.strip_prefix('"').and_then(|n| n.strip_suffix('"')).unwrap_or(name)
}

/// Whether it looks like the whole name of a picture, with an extension.
fn whole(name: &str) -> bool {
    let extension = unquoted(name).rsplit_once('.').map_or("", |(_, extension)| extension);
    (1..=5).contains(&extension.len()) && extension.starts_with(|c: char| c.is_ascii_alphabetic())
}

/// Columns between commas or semicolons, if that is what the line has: a name, unless there is none, and numbers.
fn separated(line: &str) -> Option<Columns<'_>> {
    let columns = |separator: char| {
        let words: Vec<&str> = line.trim().split(separator).map(str::trim).collect();
        let plain = |w: &&str| {
            if separator == ';' { number(w) } else { w.parse().ok().filter(|v: &f32| v.is_finite()) }
        };
        let numbers: Vec<f32> = words.iter().rev().map_while(plain).collect();
        // Numbers from the second column on, or from the first.
        let named = match words.len() - numbers.len() {
            0 if words.len() == 3 => false,
            0 | 1 if words.len() > 3 => true,
            _ => return None,
        };
        // `a.png 0.1, 0.2, 0.3`: the columns are parted by blanks.
        let joined = words[0].rsplit_once(char::is_whitespace);
        if named && joined.is_some_and(|(name, last)| whole(name.trim()) && number(last).is_some()) {
            return None;
        }
        let first = usize::from(named);
        let at = |i: usize| plain(&words[first + i]);
        Some(Columns {
            name: if named { unquoted(words[0]) } else { "" },
            numbers: Vec3::new(at(0)?, at(1)?, at(2)?),
            more: words.len() > first + 3,
        })
    };
    columns(';').or_else(|| columns(','))
}

/// The name and the numbers of a line, or the word that is wrong and why.
fn split(line: &str) -> Result<Columns<'_>, (&str, String)> {
    if let Some(columns) = separated(line) {
        return Ok(columns);
    }
    // The numbers at the end, the last first.
    let mut rest = line.trim_end();
    let mut found = Vec::new();
    loop {
        let start =
            rest.char_indices().rev().find(|(_, c)| c.is_whitespace()).map_or(0, |(i, c)| i + c.len_utf8());
        let word = &rest[start..];
        match number(word) {
            Some(value) => found.push((value, rest)),
            _ if found.len() >= 3 => break,
            _ if start == 0 => return Err((rest, "expected 'file x y z'".into())),
            _ => {
                return Err((
                    word,
                    format!("'{}' is not a finite number; expected 'file x y z'", shorten(word)),
                ));
            }
        }
        rest = rest[..start].trim_end();
    }
    // What looks like the name of a picture ends there; else the last three are the numbers and the rest is the name.
    let name = rest.trim().trim_end_matches([',', ';']);
    if whole(name) {
        let numbers = Vec3::from_array(std::array::from_fn(|i| found[found.len() - 1 - i].0));
        return Ok(Columns { name: unquoted(name), numbers, more: found.len() > 3 });
    }
    let numbers = Vec3::from_array(std::array::from_fn(|i| found[2 - i].0));
    let name = found.get(3).map_or(name, |(_, upto)| upto.trim().trim_end_matches([',', ';']));
    Ok(Columns { name: unquoted(name), numbers, more: false })
}

/// What fits into a message.
fn shorten(text: &str) -> String {
    let mut short: String = text.chars().take(60).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}

/// The text of a list. A name that no line can hold is refused.
pub fn write(entries: &[Entry], file: &Path) -> Result<String, Error> {
    let mut text = format!("{}\n", entries.len());
    for entry in entries {
        let name = &entry.file;
        if name.is_empty() || name.trim() != name || name.contains(['\n', '\r']) {
            let problem = format!(
                "the name '{}' is empty, begins or ends with a blank, or has a line break, which a list of lights \
                 cannot hold; rename the file",
                shorten(name).escape_debug()
            );
            return Err(Error::invalid(Place::file(file), problem));
        }
        let Vec3 { x, y, z } = entry.light;
        let _ = writeln!(text, "{name} {x} {y} {z}");
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Vec<Entry>, Error> {
        read(text.as_bytes(), Path::new("a.lp"), Axes::default())
    }

    #[test]
    fn lists_of_the_wild_are_read() {
        let text = "\u{feff} 5 \r\nimg 1 of 2.png 0,5773\t0,5773 0,5773\r\n\r\n\"a b.png\" 1e1 -2 30\n\
                    C:\\photos\\c.jpg, 0.1, -.2, 0.3\n日本.png  0 0 1  \n3 0 0 1";
        let got = parse(text).unwrap();
        let want = [
            ("img 1 of 2.png", Vec3::splat(0.5773)),
            ("a b.png", Vec3::new(10.0, -2.0, 30.0)),
            ("C:\\photos\\c.jpg", Vec3::new(0.1, -0.2, 0.3)),
            ("日本.png", Vec3::Z),
            ("3", Vec3::Z),
        ];
        assert_eq!(got, want.map(|(file, light)| Entry { file: file.into(), light }));
        let back = parse(&write(&got, Path::new("b.lp")).unwrap()).unwrap();
        assert_eq!(back, got);
    }

    /// Tables as spreadsheets write them, with the names of the columns or nothing before the first light.
    #[test]
    fn a_list_may_do_without_its_count() {
        let want = parse("2\na.png 0 .6 .8\nb.png 0 0 1").unwrap();
        for text in [
            "a.png 0 .6 .8\nb.png 0 0 1\n",
            "a.png,0,.6,.8\nb.png,0,0,1\n",
            "file,x,y,z\na.png,0,.6,.8\nb.png,0,0,1\n",
            "\"Image\";\"X\";\"Y\";\"Z\"\na.png;0;,6;,8\nb.png;0;0;1\n",
            "# name light_x light_y light_z\na.png 0 .6 .8\nb.png 0 0 1",
        ] {
            assert_eq!(parse(text).unwrap(), want, "{text}");
        }
        assert!(parse("x,y,z\n").unwrap().is_empty());
    }

    #[test]
    fn columns_may_be_parted_by_commas_be_more_or_have_no_name() {
        let third = Vec3::new(0.1, -0.2, 0.3);
        for (line, name) in [
            ("a.png,0.1,-0.2,0.3", "a.png"),
            ("a b.png;0,1;-0,2;0,3", "a b.png"),
            ("a.png, 0.1, -.2, 0.3, 77", "a.png"),
            ("12,0.1,-0.2,0.3", "12"),
            ("a.png 0.1, -0.2, 0.3, 77", "a.png"),
            ("a.png 0.1 -0.2 0.3 1.5 2", "a.png"),
            ("photo 7 0.1 -0.2 0.3", "photo 7"),
            ("\"a 2.png\" 0.1 -0.2 0.3 9", "a 2.png"),
            ("0.1 -0.2 0.3", ""),
            ("0.1,-0.2,0.3", ""),
        ] {
            let got = parse(&format!("1\n{line}\n")).unwrap();
            assert_eq!(got, [Entry { file: name.into(), light: third }], "{line}");
        }
    }

    #[test]
    fn lights_at_the_horizon_are_lifted_above_it() {
        for z in ["0", "-0.017", "1e-9"] {
            let got = parse(&format!("1\na.png 0.6 0.8 {z}\n")).unwrap();
            assert!((got[0].light.z - LOWEST).abs() < 1e-5, "{z}: {}", got[0].light);
        }
        for line in ["a.png 1e38 -3e38 0", "a.png 1e-45 0 0", "a.png 3 4 -0.01"] {
            let got = parse(&format!("1\n{line}\n")).unwrap();
            assert!(got[0].light.is_finite() && got[0].light.z > 0.0, "{line}: {}", got[0].light);
            assert_eq!(parse(&write(&got, Path::new("b.lp")).unwrap()).unwrap(), got, "{line}");
        }
    }

    #[test]
    fn axes_turn_what_other_programs_mean() {
        let axes: Axes = "x -y z".parse().unwrap();
        let got = read(b"1\na.png 1 2 3", Path::new("a.lp"), axes).unwrap();
        assert_eq!(got[0].light, Vec3::new(1.0, -2.0, 3.0));
        // Numbers named z, -x, y in this order.
        let axes: Axes = "z -x y".parse().unwrap();
        assert_eq!(axes.apply(Vec3::new(1.0, 2.0, 3.0)), Vec3::new(-2.0, 3.0, 1.0));
        assert_eq!(axes.to_string(), "z -x y");
        for bad in ["", "x y", "x y y", "x y z z", "x y w", "xyz"] {
            assert!(bad.parse::<Axes>().is_err(), "{bad}");
        }
    }

    #[test]
    fn bad_lists_get_a_sentence_with_the_line() {
        for (text, want) in [
            ("", "a.lp: the list is empty"),
            (
                "a.png 0 0\nb.png 0 0 1\n",
                "a.lp:1:1: 'a.png 0 0' is no number of lights, and no line 'file x y z' either",
            ),
            ("-1\n", "a.lp:1:1: '-1' is no number"),
            ("2\na.png 0 0 1\n", "a.lp:1:1: the first line promises 2 lights, but 1 follow"),
            ("0\na.png 0 0 1\n", "a.lp:1:1: the first line promises 0 lights, but 1 follow"),
            (
                "1\na.png 0 0 -1\n",
                "a.lp:2:1: the light of 'a.png' does not stand above the horizon (z is -1)",
            ),
            ("1\na.png 1 0 -0.02\n", "a.lp:2:1: the light of 'a.png' does not stand above"),
            ("1\n1 0 -0.02\n", "a.lp:2:1: the light does not stand above"),
            ("2\na.png 0 0 1\n0 0 1\n", "a.lp:3:1: some lines have file names and some have none"),
            ("1\na.png 0 0 0\n", "a.lp:2:1: the light stands in the origin"),
            ("1\n\ná.png 0 NaN 1\n", "a.lp:3:9: 'NaN' is not a finite number"),
            ("1\na.png 0 inf 1\n", "a.lp:2:9: 'inf' is not a finite number"),
            ("1\na.png 0 1e99 1\n", "a.lp:2:9: '1e99' is not a finite number"),
            ("1\na.png 0 1,2,3 1\n", "a.lp:2:9: '1,2,3' is not a finite number"),
            ("1\na.png 0 1\n", "a.lp:2:1: expected 'file x y z'"),
            ("1\nb a.png 0 1\n", "a.lp:2:3: 'a.png' is not a finite number; expected 'file x y z'"),
            ("1\n0 1\n", "a.lp:2:1: expected 'file x y z'"),
        ] {
            let got = parse(text).unwrap_err().to_string();
            assert!(got.starts_with(want), "{text:?}: {got}");
        }
        assert!(
            read(&[b'1', 0xff], Path::new("a"), Axes::default()).unwrap_err().to_string().contains("UTF-8")
        );
        for name in ["", " a", "a ", "a\nb"] {
            let entry = Entry { file: name.into(), light: Vec3::Z };
            assert!(write(&[entry], Path::new("a.lp")).is_err(), "{name:?}");
        }
    }
}
