//! Readings of a BRDF as lines of text: `wi_x wi_y wi_z wo_x wo_y wo_z [r g b [weight]]`.
//!
//! Separated by blanks, commas or semicolons; `#` starts a comment; a line of words before the first numbers is a
//! heading. Directions point away from the surface, normal +z, tangent +x, of any length; r, g, b are f in 1/sr,
//! linear. Without a weight a reading counts as one.

use crate::{Error, Place};
use glam::Vec3;
use std::path::Path;

/// A line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// To the light, unit.
    pub wi: Vec3,
    /// To the eye, unit.
    pub wo: Vec3,
    /// f in 1/sr, without the cosine, linear RGB in whatever space the caller means; `None` if not given.
    pub f: Option<Vec3>,
    /// What it counts.
    pub weight: f32,
}

/// The lines of a file.
pub fn read(bytes: &[u8], file: &Path) -> Result<Vec<Line>, Error> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        Error::invalid(
            Place::byte(file, e.valid_up_to() as u64),
            "this is not text in UTF-8; expected lines of numbers",
        )
    })?;
    let mut lines = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default();
        let words = || content.split([',', ';', ' ', '\t']).filter(|w| !w.is_empty());
        let heading = || lines.is_empty() && words().all(|w| w.parse::<f32>().is_err());
        if words().next().is_none() || heading() {
            continue;
        }
        let wrong = |problem: String| Error::invalid(Place::line(file, i + 1, 1), problem);
        let mut n = [0.0f32; 10];
        let mut count = 0;
        for word in words() {
            let slot = n.get_mut(count).ok_or_else(|| wrong("expected at most ten numbers".into()))?;
            *slot = word
                .parse()
                .ok()
                .filter(|v: &f32| v.is_finite())
                .ok_or_else(|| wrong(format!("'{word}' is not a finite number")))?;
            count += 1;
        }
        if ![6, 9, 10].contains(&count) {
            return Err(wrong(format!(
                "has {count} numbers; expected wi and wo (six), then perhaps r, g, b, then perhaps a weight"
            )));
        }
        let direction = |at: usize| {
            let w = Vec3::from_slice(&n[at..]);
            w.try_normalize().ok_or_else(|| wrong(format!("{w} is no direction")))
        };
        let (wi, wo) = (direction(0)?, direction(3)?);
        let f = (count > 6).then(|| Vec3::from_slice(&n[6..]));
        if f.is_some_and(|f| f.min_element() < 0.0) {
            return Err(wrong("a reflection cannot be negative; leave the line out".into()));
        }
        let weight = if count == 10 { n[9] } else { 1.0 };
        if weight < 0.0 {
            return Err(wrong(format!("the weight is {weight}; expected 0 or more")));
        }
        lines.push(Line { wi, wo, f, weight });
    }
    if lines.is_empty() {
        return Err(Error::invalid(Place::file(file), "has no line of numbers; expected wi, wo, r, g, b"));
    }
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;

    fn of(text: &str) -> Result<Vec<Line>, String> {
        read(text.as_bytes(), Path::new("a.csv")).map_err(|e| e.to_string())
    }

    #[test]
    fn lines_are_read_with_and_without_values() {
        let lines = of(
            "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z,r,g,b\n# both up\n0,0,2, 0 0 1\n0;3;4;0;0;1;0.1;0.2;0.3 # last\n\n\
            1 0 1 0 0 1 1 2 3 0.5\n",
        )
        .unwrap();
        assert_eq!(lines[0], Line { wi: Vec3::Z, wo: Vec3::Z, f: None, weight: 1.0 });
        assert_eq!(lines[1].wi, Vec3::new(0.0, 0.6, 0.8));
        assert_eq!(
            (lines[1].f, lines[2].f),
            (Some(Vec3::new(0.1, 0.2, 0.3)), Some(Vec3::new(1.0, 2.0, 3.0)))
        );
        assert_eq!((lines.len(), lines[1].weight, lines[2].weight), (3, 1.0, 0.5));
    }

    #[test]
    fn bad_lines_get_a_sentence() {
        for (text, words) in [
            ("", "a.csv: has no line of numbers"),
            ("0 0 1 0 0 1\n0 0 1 0 x 1\n", "a.csv:2:1: 'x' is not a finite number"),
            ("0 0 1 0 0 1 nan 0 0", "'nan' is not a finite number"),
            ("0 0 1 0 0 1 4", "a.csv:1:1: has 7 numbers"),
            ("0 0 0 0 0 1", "is no direction"),
            ("0 0 1 0 0 1 1 -1 1", "cannot be negative"),
            ("0 0 1 0 0 1 1 1 1 -2", "the weight is -2"),
            ("0 0 1 0 0 1 1 1 1 1 1", "at most ten"),
        ] {
            let error = of(text).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
        assert!(read(b"\xff\xfe0", Path::new("a")).unwrap_err().to_string().contains("UTF-8"));
    }

    #[test]
    fn damaged_text_never_panics() {
        let seed =
            b"wi,wo\n0.1,0.2,0.9, 0 0 1, 0.5 0.4 0.3, 2 # x\n-0.4 0 1;0;0;1\n1e-3 0 1 0 0 1 1e30 0 0\n";
        let mut rng = Pcg32::new(5, 8);
        let mut refused = 0;
        for _ in 0..4000 {
            let mut bytes = seed.to_vec();
            for _ in 0..1 + rng.next_u32() % 4 {
                let at = rng.next_u32() as usize % bytes.len();
                bytes[at] = b"0123456789.,;-e#\n \xffn"[rng.next_u32() as usize % 20];
            }
            refused += usize::from(read(&bytes, Path::new("a")).is_err());
        }
        assert!((200..3900).contains(&refused), "{refused}");
    }
}
