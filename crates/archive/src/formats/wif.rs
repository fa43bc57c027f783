//! Weaving Information File 1.1, 1997: the drafts that weaving programs exchange. An INI file of sections such as
//! `[THREADING]`, lines such as `3=1,2`.
//!
//! Forgiving where weavers' files are sloppy and nothing can be misunderstood: what stands before `[WIF]`, case,
//! blanks, lines given twice, threads left out (they hang on no shaft), 0 for none, and in the tie-up treadles and
//! shafts beyond the loom that no pick presses (Fiberworks writes them). `[CONTENTS]` is not needed: what is there is
//! there.

use crate::{Error, Place};
use glam::Vec3;
use std::collections::HashMap;
use std::fmt::Write;
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_optics::colour::{linear_to_srgb, srgb_to_linear};

/// A jacquard loom of full width at a hundred ends a centimetre.
const MAX_THREADS: u64 = 16384;

/// A thread of the warp (an end) or of the weft (a pick).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thread {
    /// Linear, in the space asked for.
    pub colour: Vec3,
    /// From the middle of this thread to that of its neighbours, in mm.
    pub spacing: f32,
    /// Diameter in mm; as the spacing where the file does not say.
    pub thickness: f32,
}

/// How the shed of a pick is made.
#[derive(Clone, Debug, PartialEq)]
pub enum Shedding {
    /// Treadles, each tied to shafts.
    Treadles {
        /// For each treadle the shafts it is tied to, from 1.
        tie_up: Vec<Vec<u32>>,
        /// For each pick the treadles pressed, from 1.
        treadling: Vec<Vec<u32>>,
    },
    /// For each pick the shafts that move, from 1.
    LiftPlan(Vec<Vec<u32>>),
}

/// How a cloth is set up and woven. Ends count from the left, picks from the first that is woven, at the bottom.
#[derive(Clone, Debug, PartialEq)]
pub struct Draft {
    /// May be empty.
    pub title: String,
    /// The ends.
    pub warp: Vec<Thread>,
    /// The picks.
    pub weft: Vec<Thread>,
    /// How many shafts (harnesses) the loom has.
    pub shafts: usize,
    /// For each end the shafts it is on, from 1.
    pub threading: Vec<Vec<u32>>,
    /// What moves.
    pub shedding: Shedding,
    /// Whether shafts that move rise; in a sinking shed they sink.
    pub rising: bool,
}

impl Draft {
    /// The shafts that move for a pick.
    pub fn moved(&self, pick: usize) -> Vec<u32> {
        match &self.shedding {
            Shedding::LiftPlan(plan) => plan[pick].clone(),
            Shedding::Treadles { tie_up, treadling } => {
                treadling[pick].iter().flat_map(|t| tie_up[*t as usize - 1].iter().copied()).collect()
            }
        }
    }

    /// Pick by pick from the first, end by end from the left: whether the warp lies on top.
    pub fn drawdown(&self) -> Vec<bool> {
        let mut up = Vec::with_capacity(self.warp.len() * self.weft.len());
        let mut moves = vec![false; self.shafts + 1];
        for pick in 0..self.weft.len() {
            moves.fill(false);
            self.moved(pick).into_iter().for_each(|shaft| moves[shaft as usize] = true);
            up.extend(self.threading.iter().map(|s| s.iter().any(|s| moves[*s as usize]) == self.rising));
        }
        up
    }
}

/// The draft in a file, colours in `space`.
///
/// # Errors
/// With the line: sections that a draft needs and that are missing, numbers that are none, and threads, shafts,
/// treadles and colours that the file itself says do not exist.
pub fn read(bytes: &[u8], file: &Path, space: ColourSpace) -> Result<Draft, Error> {
    let text = String::from_utf8_lossy(bytes);
    let ini = Ini::parse(&text, file)?;

    let threads = |section: &str| -> Result<usize, Error> {
        let count = ini.number(section, "THREADS")?.ok_or_else(|| ini.missing(section, "Threads"))?;
        ini.limit(section, "THREADS", count, MAX_THREADS)
    };
    let (ends, picks) = (threads("WARP")?, threads("WEFT")?);
    let shafts = match ini.number("WEAVING", "SHAFTS")? {
        Some(n) => ini.limit("WEAVING", "SHAFTS", n, MAX_THREADS)?,
        None => return Err(ini.missing("WEAVING", "Shafts")),
    };
    let treadles = match ini.number("WEAVING", "TREADLES")? {
        Some(n) => ini.limit("WEAVING", "TREADLES", n, MAX_THREADS)?,
        None => 0,
    };
    let rising = match ini.value("WEAVING", "RISING SHED") {
        None => true,
        Some((line, word)) => match word.to_lowercase().as_str() {
            "true" | "yes" | "on" | "1" => true,
            "false" | "no" | "off" | "0" => false,
            _ => {
                let problem = format!("'{word}' is neither true nor false");
                return Err(Error::invalid(Place::line(file, line, 1), problem));
            }
        },
    };
    let all = |_: usize| true;
    let threading = ini.lists("THREADING", ends, "thread", shafts, "shaft", all)?;
    let threading = threading.ok_or_else(|| ini.missing_section("THREADING"))?;
    let treadled = ini.lists("TREADLING", picks, "pick", treadles, "treadle", all)?;
    let plan = ini.lists("LIFTPLAN", picks, "pick", shafts, "shaft", all)?;
    let mut pressed = vec![false; treadles];
    if let (Some(treadled), None) = (&treadled, &plan) {
        treadled.iter().flatten().for_each(|t| pressed[*t as usize - 1] = true);
    }
    let is_pressed = |treadle: usize| pressed.get(treadle).is_some_and(|p| *p);
    let tied = ini.lists("TIEUP", treadles, "treadle", shafts, "shaft", is_pressed)?;
    let shedding = match (treadled, tied, plan) {
        (_, _, Some(plan)) => Shedding::LiftPlan(plan),
        (Some(treadling), Some(tie_up), None) => Shedding::Treadles { tie_up, treadling },
        (Some(_), None, None) => return Err(ini.missing_section("TIEUP")),
        _ => return Err(ini.missing_section("TREADLING")),
    };

    let palette = ini.palette(space)?;
    let colour = |line: usize, word: &str| -> Result<Vec3, Error> {
        let index = ini.integer(line, first(word))?;
        palette.get(&index).copied().ok_or_else(|| {
            let problem = format!("colour {index} is not in [COLOR TABLE]");
            Error::invalid(Place::line(file, line, 1), problem)
        })
    };
    let yarns = |section: &str, count: usize, plain: f32| -> Result<Vec<Thread>, Error> {
        let units = match ini.value(section, "UNITS") {
            None => 10.0,
            Some((line, word)) => match word.to_lowercase().as_str() {
                "centimeters" | "centimetres" => 10.0,
                "inches" => 25.4,
                // Tenths of a printer's point.
                "decipoints" => 25.4 / 720.0,
                _ => {
                    let known = ["centimeters", "inches", "decipoints"];
                    return Err(Error::unknown(Place::line(file, line, 1), "unit", word, known));
                }
            },
        };
        let length = |line: usize, word: &str| Ok(ini.length(line, word)? * units);
        let spacing = ini.value(section, "SPACING").map(|(l, w)| length(l, w)).transpose()?;
        let thickness = ini.value(section, "THICKNESS").map(|(l, w)| length(l, w)).transpose()?;
        // Twenty threads a centimetre where the file does not say: a light woollen cloth.
        let spacing = spacing.filter(|s| *s > 0.0).or(thickness.filter(|t| *t > 0.0)).unwrap_or(0.5);
        let default = Thread {
            colour: match ini.value(section, "COLOR") {
                Some((line, word)) if !palette.is_empty() => colour(line, word)?,
                _ => Vec3::splat(plain),
            },
            spacing,
            thickness: thickness.filter(|t| *t > 0.0).unwrap_or(spacing),
        };
        let mut yarns = vec![default; count];
        for (i, line, word) in ini.entries(&format!("{section} COLORS"), count, "thread", all)? {
            if !word.is_empty() {
                yarns[i].colour = colour(line, word)?;
            }
        }
        for (i, line, word) in ini.entries(&format!("{section} SPACING"), count, "thread", all)? {
            if let Some(v) = Some(word).filter(|w| !w.is_empty()) {
                yarns[i].spacing = length(line, v)?;
                yarns[i].thickness = thickness.filter(|t| *t > 0.0).unwrap_or(yarns[i].spacing);
            }
        }
        for (i, line, word) in ini.entries(&format!("{section} THICKNESS"), count, "thread", all)? {
            if let Some(v) = Some(word).filter(|w| !w.is_empty()) {
                yarns[i].thickness = length(line, v)?;
            }
        }
        Ok(yarns)
    };
    Ok(Draft {
        title: ini.value("TEXT", "TITLE").map_or(String::new(), |(_, w)| w.to_string()),
        // Light warp, dark weft: the pattern shows.
        warp: yarns("WARP", ends, 0.7)?,
        weft: yarns("WEFT", picks, 0.1)?,
        shafts,
        threading,
        shedding,
        rising,
    })
}

/// The text of a file with this draft, whose colours are of `space`.
pub fn write(draft: &Draft, space: ColourSpace) -> String {
    let to_srgb = space.matrix_to(ColourSpace::LinearSrgb);
    let shown = |c: Vec3| -> [u16; 3] {
        (to_srgb * c).to_array().map(|v| (linear_to_srgb(v.clamp(0.0, 1.0)) * 999.0).round() as u16)
    };
    let mut palette: Vec<[u16; 3]> = draft.warp.iter().chain(&draft.weft).map(|t| shown(t.colour)).collect();
    palette.sort_unstable();
    palette.dedup();
    let plan = matches!(draft.shedding, Shedding::LiftPlan(_));
    let treadles = match &draft.shedding {
        Shedding::Treadles { tie_up, .. } => tie_up.len(),
        Shedding::LiftPlan(_) => 0,
    };
    let mut text = String::from("[WIF]\nVersion=1.1\nDate=April 20, 1997\nDevelopers=wif@mhsoft.com\n");
    text.push_str("Source Program=Yugen\n\n[CONTENTS]\n");
    for section in ["COLOR PALETTE", "TEXT", "WEAVING", "WARP", "WEFT", "COLOR TABLE", "THREADING"] {
        let _ = writeln!(text, "{section}=true");
    }
    for section in ["WARP COLORS", "WEFT COLORS", "WARP SPACING", "WEFT SPACING"] {
        let _ = writeln!(text, "{section}=true");
    }
    let _ = write!(
        text,
        "WARP THICKNESS=true\nWEFT THICKNESS=true\nTIEUP={0}\nTREADLING={0}\nLIFTPLAN={plan}\n",
        !plan
    );
    // A line break would start another key.
    let title: String = draft.title.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let _ = write!(text, "\n[TEXT]\nTitle={title}\n\n[WEAVING]\nRising Shed={}\n", draft.rising);
    let _ = write!(text, "Shafts={}\nTreadles={treadles}\n", draft.shafts);
    let _ = write!(text, "\n[COLOR PALETTE]\nEntries={}\nRange=0,999\n\n[COLOR TABLE]\n", palette.len());
    for (i, [r, g, b]) in palette.iter().enumerate() {
        let _ = writeln!(text, "{}={r},{g},{b}", i + 1);
    }
    for (section, threads) in [("WARP", &draft.warp), ("WEFT", &draft.weft)] {
        let _ = write!(text, "\n[{section}]\nThreads={}\nUnits=centimeters\n", threads.len());
        let mut list = |what: &str, value: &dyn Fn(&Thread) -> String| {
            let _ = write!(text, "\n[{section} {what}]\n");
            for (i, thread) in threads.iter().enumerate() {
                let _ = writeln!(text, "{}={}", i + 1, value(thread));
            }
        };
        list("COLORS", &|t| {
            palette.binary_search(&shown(t.colour)).map_or(String::new(), |i| (i + 1).to_string())
        });
        list("SPACING", &|t| (t.spacing / 10.0).to_string());
        list("THICKNESS", &|t| (t.thickness / 10.0).to_string());
    }
    let mut lists = |section: &str, lists: &[Vec<u32>]| {
        let _ = write!(text, "\n[{section}]\n");
        for (i, list) in lists.iter().enumerate() {
            let words: Vec<String> = list.iter().map(u32::to_string).collect();
            let _ = writeln!(text, "{}={}", i + 1, words.join(","));
        }
    };
    lists("THREADING", &draft.threading);
    match &draft.shedding {
        Shedding::LiftPlan(plan) => lists("LIFTPLAN", plan),
        Shedding::Treadles { tie_up, treadling } => {
            lists("TIEUP", tie_up);
            lists("TREADLING", treadling);
        }
    }
    text
}

/// What stands before a comma.
fn first(word: &str) -> &str {
    word.split(',').next().unwrap_or_default().trim()
}

/// Sections and their lines: number, key in capitals, value.
struct Ini<'a> {
    sections: HashMap<String, Vec<(usize, String, &'a str)>>,
    file: &'a Path,
}

impl<'a> Ini<'a> {
    fn parse(text: &'a str, file: &'a Path) -> Result<Self, Error> {
        let mut sections: HashMap<String, Vec<(usize, String, &str)>> = HashMap::new();
        let mut current: Option<String> = None;
        for (i, line) in text.lines().enumerate() {
            let line = line.trim();
            if let Some(name) = line.strip_prefix('[').and_then(|l| l.split(']').next()) {
                let name = name.trim().to_uppercase();
                // Until the file says what it is anything may stand there.
                if current.is_some() || name == "WIF" {
                    sections.entry(name.clone()).or_default();
                    current = Some(name);
                }
            } else if let Some(section) =
                current.as_ref().filter(|_| !line.is_empty() && !line.starts_with(';'))
            {
                let (key, value) = line.split_once('=').unwrap_or((line, ""));
                let entry = (i + 1, key.trim().to_uppercase(), value.trim());
                if let Some(lines) = sections.get_mut(section) {
                    lines.push(entry);
                }
            }
        }
        if current.is_none() {
            let problem = "this is no weaving draft: a WIF file has a section [WIF]";
            return Err(Error::invalid(Place::file(file), problem));
        }
        Ok(Self { sections, file })
    }

    /// The last value that a section gives to a key.
    fn value(&self, section: &str, key: &str) -> Option<(usize, &'a str)> {
        let lines = self.sections.get(section)?;
        lines.iter().rev().find(|(_, k, v)| k == key && !v.is_empty()).map(|(line, _, v)| (*line, *v))
    }

    fn missing(&self, section: &str, key: &str) -> Error {
        Error::invalid(Place::file(self.file), format!("the draft needs '{key}=' in [{section}]"))
    }

    fn missing_section(&self, section: &str) -> Error {
        let or = if section == "TREADLING" { " (or [LIFTPLAN])" } else { "" };
        Error::invalid(Place::file(self.file), format!("the draft needs a section [{section}]{or}"))
    }

    fn integer(&self, line: usize, word: &str) -> Result<u64, Error> {
        word.parse().map_err(|_| {
            let problem = format!("'{word}' is not a whole number of 0 or more");
            Error::invalid(Place::line(self.file, line, 1), problem)
        })
    }

    fn length(&self, line: usize, word: &str) -> Result<f32, Error> {
        // A thread a metre thick is a mistake of units.
        let ok = |v: &f32| (0.0..=100.0).contains(v);
        word.parse().ok().filter(ok).ok_or_else(|| {
            let problem = format!("'{word}' is not a length from 0 to 100");
            Error::invalid(Place::line(self.file, line, 1), problem)
        })
    }

    fn number(&self, section: &str, key: &str) -> Result<Option<(usize, u64)>, Error> {
        self.value(section, key).map(|(line, word)| Ok((line, self.integer(line, first(word))?))).transpose()
    }

    /// The number as a count from 1 to `limit`.
    fn limit(&self, section: &str, key: &str, (line, n): (usize, u64), limit: u64) -> Result<usize, Error> {
        let at = Place::line(self.file, line, 1);
        if n > limit {
            return Err(Error::TooLarge { at, what: format!("'{key}' of [{section}]"), asked: n, limit });
        }
        if n == 0 && key != "TREADLES" {
            return Err(Error::invalid(at, format!("'{key}' of [{section}] must be at least 1")));
        }
        Ok(n as usize)
    }

    /// The lines `3=…` of a section, keys from 0 and below `count`; none where the section is missing. Those that are
    /// not `used` may lie beyond.
    fn entries(
        &self,
        section: &str,
        count: usize,
        what: &str,
        used: impl Fn(usize) -> bool,
    ) -> Result<Vec<(usize, usize, &'a str)>, Error> {
        let mut entries = Vec::new();
        for (line, key, value) in self.sections.get(section).map_or(&[][..], Vec::as_slice) {
            let n = self.integer(*line, key)?;
            if (1..=count as u64).contains(&n) {
                entries.push((n as usize - 1, *line, *value));
            } else if !(value.is_empty() || *value == "0") && (n == 0 || used(n as usize - 1)) {
                // One that is not there and does nothing is no matter.
                let problem = format!("[{section}] names {what} {n} of {count}");
                return Err(Error::invalid(Place::line(self.file, *line, 1), problem));
            }
        }
        Ok(entries)
    }

    /// The lists `3=1,2` of a section, whose numbers are from 1 to `most`; zeros mean none. `None` where the
    /// section is missing. What lies beyond is left out of those that are not `used`.
    fn lists(
        &self,
        section: &str,
        count: usize,
        what: &str,
        most: usize,
        kind: &str,
        used: impl Fn(usize) -> bool,
    ) -> Result<Option<Vec<Vec<u32>>>, Error> {
        if !self.sections.contains_key(section) {
            return Ok(None);
        }
        let mut lists = vec![Vec::new(); count];
        for (i, line, value) in self.entries(section, count, what, &used)? {
            let mut list = Vec::new();
            for word in value.split(',').map(str::trim).filter(|w| !w.is_empty()) {
                let n = self.integer(line, word)?;
                if n > most as u64 && !used(i) {
                    continue;
                }
                if n > most as u64 {
                    let problem = format!("[{section}] names {kind} {n}, and there are {most}");
                    return Err(Error::invalid(Place::line(self.file, line, 1), problem));
                }
                if n > 0 {
                    list.push(n as u32);
                }
            }
            // Given twice, the last one counts.
            lists[i] = list;
        }
        Ok(Some(lists))
    }

    fn palette(&self, space: ColourSpace) -> Result<HashMap<u64, Vec3>, Error> {
        let to_space = ColourSpace::LinearSrgb.matrix_to(space);
        let range = match self.value("COLOR PALETTE", "RANGE") {
            None => [0, 255],
            Some((line, words)) => match words.split_once(',') {
                Some((low, high)) => [self.integer(line, low.trim())?, self.integer(line, high.trim())?],
                None => [0, self.integer(line, words)?],
            },
        };
        let [low, high] = range;
        if low >= high {
            let line = self.value("COLOR PALETTE", "RANGE").map_or(1, |(line, _)| line);
            let problem = format!("the range of colours {low},{high} is empty");
            return Err(Error::invalid(Place::line(self.file, line, 1), problem));
        }
        let lines = self.sections.get("COLOR TABLE").map_or(&[][..], Vec::as_slice);
        let mut palette = HashMap::new();
        for (line, key, value) in lines {
            let at = || Place::line(self.file, *line, 1);
            let mut rgb = [0.0; 3];
            let words: Vec<&str> = value.split(',').map(str::trim).collect();
            if words.len() != 3 {
                return Err(Error::invalid(at(), format!("'{value}' is no colour: three numbers r,g,b are")));
            }
            for (channel, word) in rgb.iter_mut().zip(words) {
                let v = self.integer(*line, word)?;
                if !(low..=high).contains(&v) {
                    return Err(Error::invalid(
                        at(),
                        format!("{v} is outside the colours' range {low},{high}"),
                    ));
                }
                *channel = srgb_to_linear(((v - low) as f64 / (high - low) as f64) as f32);
            }
            palette.insert(self.integer(*line, key)?, (to_space * Vec3::from(rgb)).max(Vec3::ZERO));
        }
        Ok(palette)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SRGB: ColourSpace = ColourSpace::LinearSrgb;

    fn text(draft: &Draft) -> String {
        let n = draft.warp.len();
        let rows = draft.drawdown();
        let row = |r: &[bool]| r.iter().map(|up| if *up { '#' } else { '.' }).collect::<String>();
        rows.chunks(n).map(row).collect::<Vec<_>>().join(" ")
    }

    const TWILL: &str = "[WIF]\nVersion=1.1\n[WEAVING]\nShafts=3\nTreadles=3\n[WARP]\nThreads=3\n[WEFT]\n\
        Threads=3\n[THREADING]\n1=1\n2=2\n3=3\n[TIEUP]\n1=1,2\n2=2,3\n3=3,1\n[TREADLING]\n1=1\n2=2\n3=3\n";

    #[test]
    fn a_twill_is_woven_as_it_is_tied_up() {
        let draft = read(TWILL.as_bytes(), Path::new("t.wif"), SRGB).unwrap();
        assert_eq!(text(&draft), "##. .## #.#");
        let sinking = TWILL.replace("Shafts=3", "Shafts=3\nRising Shed=no");
        let draft = read(sinking.as_bytes(), Path::new("t.wif"), SRGB).unwrap();
        assert_eq!(text(&draft), "..# #.. .#.");
    }

    #[test]
    fn what_is_written_is_read_again() {
        let mut draft = read(TWILL.as_bytes(), Path::new("t.wif"), SRGB).unwrap();
        draft.title = "gold, \"two\" [x]".into();
        draft.rising = false;
        draft.warp[1] = Thread { colour: Vec3::new(0.8, 0.1, 0.05), spacing: 0.083, thickness: 0.07 };
        draft.threading[2] = vec![1, 3];
        for lift in [false, true] {
            if lift {
                draft.shedding = Shedding::LiftPlan(vec![vec![1], vec![], vec![1, 2, 3]]);
            }
            let again = read(write(&draft, SRGB).as_bytes(), Path::new("w.wif"), SRGB).unwrap();
            for (a, b) in draft.warp.iter().chain(&draft.weft).zip(again.warp.iter().chain(&again.weft)) {
                // A step of a thousand in sRGB is at most 2.3e-3 of linear light.
                assert!((a.colour - b.colour).abs().max_element() < 2e-3);
                assert!((a.spacing - b.spacing).abs() < 1e-6 && (a.thickness - b.thickness).abs() < 1e-6);
            }
            assert_eq!(
                (&draft.title, draft.rising, draft.shafts),
                (&again.title, again.rising, again.shafts)
            );
            assert_eq!((&draft.threading, &draft.shedding), (&again.threading, &again.shedding));
        }
    }

    /// Fiberworks writes a column for every treadle that it can show.
    #[test]
    fn treadles_that_no_pick_presses_do_not_matter() {
        let plain = read(TWILL.as_bytes(), Path::new("t.wif"), SRGB).unwrap();
        let wide = TWILL.replace("3=3,1\n", "3=3,1\n4=1,7\n9=2\n10=\n");
        for text in [wide.clone(), wide.replace("Treadles=3", "Treadles=4")] {
            let draft = read(text.as_bytes(), Path::new("t.wif"), SRGB).unwrap();
            assert_eq!(draft.drawdown(), plain.drawdown());
            let again = read(write(&draft, SRGB).as_bytes(), Path::new("w.wif"), SRGB).unwrap();
            assert_eq!(again.shedding, draft.shedding);
        }
        // One that is pressed must be there, and its shafts too.
        let wrong = |from: &str, to: &str| {
            let text = wide.replace("Treadles=3", "Treadles=4").replacen(from, to, 1);
            read(text.as_bytes(), Path::new("t.wif"), SRGB).unwrap_err().to_string()
        };
        assert!(wrong("[TREADLING]\n1=1", "[TREADLING]\n1=9").contains("names treadle 9, and there are 4"));
        assert!(wrong("[TREADLING]\n1=1", "[TREADLING]\n1=4").contains("names shaft 7, and there are 3"));
        assert!(wrong("9=2", "0=2").contains("[TIEUP] names treadle 0 of 4"));
    }

    #[test]
    fn lies_are_named_with_their_line() {
        let colours = "[COLOR PALETTE]\nRange=0,255\n[COLOR TABLE]\n1=255,0,0\n";
        for (from, to, want) in [
            ("[WIF]", "[WAF]", "t.wif: this is no weaving draft"),
            (
                "[WARP]\nThreads=3",
                "[WARP]\nThreads=4000000000",
                "t.wif:7:1: 'THREADS' of [WARP] is 4000000000",
            ),
            ("[WARP]\nThreads=3", "[WARP]\nThreads=0", "t.wif:7:1: 'THREADS' of [WARP] must be at least 1"),
            ("[WARP]\nThreads=3", "[WARP]\nThreads=-3", "t.wif:7:1: '-3' is not a whole number"),
            ("[WARP]\nThreads=3", "[WARP]", "needs 'Threads=' in [WARP]"),
            ("Shafts=3\n", "", "needs 'Shafts=' in [WEAVING]"),
            ("[WARP]\nThreads=3", "[WARP]\nThreads=2", "t.wif:13:1: [THREADING] names thread 3 of 2"),
            ("3=3,1", "3=3,9", "t.wif:17:1: [TIEUP] names shaft 9, and there are 3"),
            (
                "[TREADLING]\n1=1",
                "[TREADLING]\n1=7",
                "t.wif:19:1: [TREADLING] names treadle 7, and there are 3",
            ),
            ("[TIEUP]", "[PRIVATE X]", "needs a section [TIEUP]"),
            ("[TREADLING]", "[PRIVATE X]", "needs a section [TREADLING] (or [LIFTPLAN])"),
            ("[THREADING]", "[PRIVATE X]", "needs a section [THREADING]"),
            ("[WARP]", &format!("{colours}[WARP]\nColor=2"), "t.wif:11:1: colour 2 is not in [COLOR TABLE]"),
            ("[WARP]", &format!("{}[WARP]", colours.replace("255,0,0", "300,0,0")), "300 is outside"),
            ("[WARP]", &format!("{}[WARP]", colours.replace("255,0,0", "30,0")), "'30,0' is no colour"),
            ("[WARP]", &format!("{}[WARP]", colours.replace("0,255", "9,9")), "9,9 is empty"),
            ("[WARP]", "[WARP]\nUnits=furlongs", "t.wif:7:1: unknown unit 'furlongs'"),
            ("[WARP]", "[WARP]\nSpacing=1e9", "t.wif:7:1: '1e9' is not a length"),
            ("Shafts=3", "Shafts=3\nRising Shed=maybe", "t.wif:5:1: 'maybe' is neither"),
        ] {
            assert!(TWILL.contains(from), "{from}");
            let error = read(TWILL.replacen(from, to, 1).as_bytes(), Path::new("t.wif"), SRGB).unwrap_err();
            assert!(error.to_string().contains(want), "{error}\nwant {want}");
        }
    }

    /// Drafts of several weaving programs.
    #[test]
    fn weavers_files_are_read() {
        let Some(data) = std::env::var_os("YUGEN_DATA") else {
            assert!(std::env::var_os("CI").is_none(), "YUGEN_DATA must name the data folder in CI");
            println!("skipped: YUGEN_DATA is not set");
            return;
        };
        let folder = Path::new(&data).join("textile/wif");
        let get = |name: &str| {
            let path = folder.join(name);
            read(&std::fs::read(&path).unwrap(), &path, SRGB).unwrap()
        };
        let lift = get("basic_wif__liftplan_with_defaults.wif");
        assert_eq!(lift.title, "liftplan with defaults.dtx");
        // Threading 3, 2, none, none; lifts 1 2 4, none, none, 3 4.
        assert_eq!(text(&lift), ".#.. .... .... #... .... ....");
        assert_eq!(lift.warp[0].colour, Vec3::ONE);
        assert_eq!(lift.weft[0].colour, Vec3::X);
        assert!((lift.warp[0].spacing - 2.12).abs() < 1e-6);
        let treadles = get("basic_wif__treadles_with_defaults_and_private_sections.wif");
        // Pick 1 presses 1 and 6, which lift shaft 1 (and nothing): the last end; pick 3 adds treadle 2: 2 and 4.
        assert_eq!(text(&treadles), "....# ..... ..#.. ..... ..... .....");
        assert!(
            (treadles.warp[3].spacing - 0.53).abs() < 1e-6 && (treadles.warp[2].spacing - 2.12).abs() < 1e-6
        );
        let zeros = get("desired_basic_wif__many_color_multiple_treadles_and_zeros.wif");
        assert_eq!((zeros.warp.len(), zeros.weft.len(), zeros.shafts), (5, 6, 4));
        let large = get("desired_basic_wif__multi-byte_liftplan.wif");
        assert_eq!((large.warp.len(), large.weft.len(), large.shafts), (641, 641, 17));
        assert!((large.warp[0].spacing - 25.4 / 24.0).abs() < 1e-3, "24 to the inch");
        // A straight lift of shafts 1 2 5 6 13 14 in the first and the last pick, on a point threading.
        let up = large.drawdown();
        let ends =
            |pick: usize| -> Vec<usize> { (0..17).filter(|e| up[pick * 641 + e]).map(|e| e + 1).collect() };
        assert_eq!(ends(0), [1, 2, 5, 6, 13, 14]);
        assert_eq!(ends(640), ends(0));
        assert_eq!(ends(3), [1, 4, 5, 8, 9, 16, 17]);
    }
}
