//! From a weave to cloth: drawdowns, fabrics made of named threads, and what they look like texel by texel.
//!
//! Ends are threads of the warp, counted from the left; picks are threads of the weft, counted from the first that
//! is woven, at the bottom. Everything tiles: end `n` of a repeat of n is end 0 of the next.

mod cloth;
mod fabric;
mod presets;

pub use cloth::{Cloth, ThreadId};
pub use fabric::{Fabric, Irregularity, Make, Yarn};
pub use presets::PRESETS;

use std::collections::HashMap;
use std::str::FromStr;
use yugen_archive::formats::wif::{Draft, Shedding, Thread};

/// One repeat of a weave: which thread lies on top where an end crosses a pick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Weave {
    ends: usize,
    picks: usize,
    /// Pick by pick.
    up: Vec<bool>,
}

/// Which way the lines of a twill run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Twill {
    /// Up to the right: a Z twill.
    Right,
    /// Up to the left: an S twill.
    Left,
}

/// Why there is no such weave.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WeaveError {
    /// The binding points of a satin must not touch, and must visit every end.
    #[error(
        "there is no satin over {repeat} with the move {step}: the move must be 2 to {repeat} − 2 and share no \
         factor with {repeat}{}", moves(*repeat)
    )]
    Satin {
        /// Ends of the repeat.
        repeat: usize,
        /// From pick to pick.
        step: usize,
    },
    /// A name that no weave has.
    #[error(
        "'{0}' names no weave; these do: plain, twill:2/1 (twill:2/1s runs up to the left), satin:5/2, sateen:5/2"
    )]
    Name(String),
    /// Twills go over and under.
    #[error("a twill goes over at least one thread and under at least one, not {over} and {under}")]
    Twill {
        /// Picks that an end passes over.
        over: usize,
        /// Picks that it passes under.
        under: usize,
    },
}

fn satin_moves(repeat: usize) -> impl Iterator<Item = usize> {
    (2..repeat.saturating_sub(1)).filter(move |step| gcd(*step, repeat) == 1)
}

fn moves(repeat: usize) -> String {
    let known: Vec<String> = satin_moves(repeat).take(12).map(|m| m.to_string()).collect();
    if known.is_empty() { "; none does".into() } else { format!("; these do: {}", known.join(", ")) }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

impl Weave {
    /// A repeat of `ends` by `picks`, both at least 1; `up(end, pick)` says whether the warp lies on top.
    pub fn from_fn(ends: usize, picks: usize, up: impl Fn(usize, usize) -> bool) -> Self {
        let up = (0..ends * picks).map(|i| up(i % ends, i / ends)).collect();
        Self { ends, picks, up }
    }

    /// What a loom set up like this weaves.
    pub fn of(draft: &Draft) -> Self {
        Self { ends: draft.warp.len(), picks: draft.weft.len(), up: draft.drawdown() }
    }

    /// Ends of a repeat.
    pub fn ends(&self) -> usize {
        self.ends
    }

    /// Picks of a repeat.
    pub fn picks(&self) -> usize {
        self.picks
    }

    /// Whether the warp lies on top, for any end and pick of an endless cloth.
    pub fn up(&self, end: usize, pick: usize) -> bool {
        self.up[pick % self.picks * self.ends + end % self.ends]
    }

    /// Over one, under one.
    pub fn plain() -> Self {
        Self::from_fn(2, 2, |end, pick| (end + pick) % 2 == 0)
    }

    /// Each end over `over` picks and under `under`, one pick later than its neighbour: 2/1 is a warp-faced twill
    /// of three harnesses.
    ///
    /// # Errors
    /// Where either is zero.
    pub fn twill(over: usize, under: usize, line: Twill) -> Result<Self, WeaveError> {
        if over == 0 || under == 0 {
            return Err(WeaveError::Twill { over, under });
        }
        let n = over + under;
        Ok(Self::from_fn(n, n, |end, pick| match line {
            Twill::Right => (pick + n - end) % n < over,
            Twill::Left => (pick + end) % n < over,
        }))
    }

    /// Warp-faced satin: in each pick one end of `repeat` lies below, `step` ends (the move, or counter) further
    /// than in the pick before. Satin 5/2 is the common one.
    ///
    /// # Errors
    /// Where binding points would touch, or not visit every end.
    pub fn satin(repeat: usize, step: usize) -> Result<Self, WeaveError> {
        if satin_moves(repeat).all(|s| s != step) {
            return Err(WeaveError::Satin { repeat, step });
        }
        Ok(Self::from_fn(repeat, repeat, |end, pick| pick * step % repeat != end))
    }

    /// The same weave with warp and weft exchanged in their visibility: a sateen of a satin.
    pub fn opposite(&self) -> Self {
        Self { up: self.up.iter().map(|up| !up).collect(), ..self.clone() }
    }

    /// Jacquard: `figure` where the mask says so, `ground` elsewhere, each going on undisturbed under the other.
    pub fn jacquard(
        ends: usize,
        picks: usize,
        mask: impl Fn(usize, usize) -> bool,
        figure: &Self,
        ground: &Self,
    ) -> Self {
        Self::from_fn(
            ends,
            picks,
            |end, pick| {
                if mask(end, pick) { figure.up(end, pick) } else { ground.up(end, pick) }
            },
        )
    }

    /// A pattern woven into a ground with wefts of its own: rows of `ground_picks` picks of the ground and then one
    /// pick of each of `colours` pattern wefts. `figure(end, row)` is 0 where no pattern weft shows and k where the
    /// k-th does; there it floats over all ends but those that `tie` raises in that row. Elsewhere it lies behind.
    pub fn with_pattern_wefts(
        ground: &Self,
        [ends, rows]: [usize; 2],
        ground_picks: usize,
        colours: usize,
        figure: impl Fn(usize, usize) -> usize,
        tie: &Self,
    ) -> Self {
        let row = ground_picks + colours;
        Self::from_fn(ends, rows * row, |end, pick| {
            let (r, within) = (pick / row, pick % row);
            match within.checked_sub(ground_picks) {
                None => ground.up(end, r * ground_picks + within),
                Some(colour) => figure(end, r) != colour + 1 || tie.up(end, r),
            }
        })
    }

    /// The longest float of the warp, in picks, and of the weft, in ends, on the face of the endless cloth. A thread
    /// that never goes under floats without end: `usize::MAX`.
    pub fn longest_floats(&self) -> [usize; 2] {
        let warp = (0..self.ends).map(|e| longest_run(self.picks, |p| self.up(e, p))).max();
        let weft = (0..self.picks).map(|p| longest_run(self.ends, |e| !self.up(e, p))).max();
        [warp.unwrap_or(0), weft.unwrap_or(0)]
    }

    /// The ends and the picks that never change sides, and so are not held by the cloth.
    pub fn loose(&self) -> [Vec<usize>; 2] {
        let constant = |mut sides: Box<dyn Iterator<Item = bool> + '_>| {
            let first = sides.next();
            sides.all(|s| Some(s) == first)
        };
        let end = |e: &usize| constant(Box::new((0..self.picks).map(|p| self.up(*e, p))));
        let pick = |p: &usize| constant(Box::new((0..self.ends).map(|e| self.up(e, *p))));
        [(0..self.ends).filter(end).collect(), (0..self.picks).filter(pick).collect()]
    }

    /// A draft that weaves this: ends that move alike share a shaft, picks that are alike a treadle.
    ///
    /// # Panics
    /// If there is not one thread for each end and each pick.
    pub fn draft(&self, title: &str, warp: Vec<Thread>, weft: Vec<Thread>) -> Draft {
        assert_eq!((warp.len(), weft.len()), (self.ends, self.picks), "a thread for each end and pick");
        let column = |e: usize| (0..self.picks).map(|p| self.up(e, p)).collect::<Vec<_>>();
        let row = |p: usize| (0..self.ends).map(|e| self.up(e, p)).collect::<Vec<_>>();
        let (threading, shafts) = classes((0..self.ends).map(column));
        let (treadling, treadles) = classes((0..self.picks).map(row));
        let tied = |p: &usize| {
            let up = shafts.iter().enumerate().filter(|(_, e)| self.up(**e, *p));
            up.map(|(s, _)| s as u32 + 1).collect()
        };
        Draft {
            title: title.to_string(),
            warp,
            weft,
            shafts: shafts.len(),
            threading,
            shedding: Shedding::Treadles { tie_up: treadles.iter().map(tied).collect(), treadling },
            rising: true,
        }
    }
}

/// `plain`, `twill:3/1`, `twill:3/1s` (up to the left), `satin:8/3`, `sateen:8/3`; no repeat is wider than 1024.
impl FromStr for Weave {
    type Err = WeaveError;

    fn from_str(text: &str) -> Result<Self, WeaveError> {
        let unknown = || WeaveError::Name(text.to_string());
        if text == "plain" {
            return Ok(Self::plain());
        }
        let (name, numbers) = text.split_once(':').ok_or_else(unknown)?;
        let (numbers, line) = match numbers.strip_suffix(['s', 'S']) {
            Some(numbers) if name == "twill" => (numbers, Twill::Left),
            _ => (numbers, Twill::Right),
        };
        let number = |word: &str| word.parse().ok().filter(|n| *n <= 512).ok_or_else(unknown);
        let (a, b) = numbers.split_once('/').ok_or_else(unknown)?;
        let (a, b) = (number(a)?, number(b)?);
        match name {
            "twill" => Self::twill(a, b, line),
            "satin" => Self::satin(a, b),
            "sateen" => Ok(Self::satin(a, b)?.opposite()),
            _ => Err(unknown()),
        }
    }
}

/// For each item the number (from 1) of its class, and the first member of every class.
fn classes(items: impl Iterator<Item = Vec<bool>>) -> (Vec<Vec<u32>>, Vec<usize>) {
    let (mut known, mut firsts) = (HashMap::new(), Vec::new());
    let numbers = items
        .enumerate()
        .map(|(i, item)| {
            let number = *known.entry(item).or_insert_with(|| {
                firsts.push(i);
                firsts.len() as u32
            });
            vec![number]
        })
        .collect();
    (numbers, firsts)
}

/// The longest run of a cyclic sequence of `n`.
fn longest_run(n: usize, on: impl Fn(usize) -> bool) -> usize {
    let Some(gap) = (0..n).find(|i| !on(*i)) else { return usize::MAX };
    let (mut longest, mut run) = (0, 0);
    for i in 1..=n {
        run = if on((gap + i) % n) { run + 1 } else { 0 };
        longest = longest.max(run);
    }
    longest
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use std::path::Path;

    fn picture(w: &Weave) -> String {
        let row = |p: usize| (0..w.ends).map(|e| if w.up(e, p) { '|' } else { '-' }).collect::<String>();
        (0..w.picks).rev().map(row).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn plain_weave_is_a_checkerboard() {
        assert_eq!(picture(&Weave::plain()), "-|\n|-");
        assert_eq!(Weave::plain().longest_floats(), [1, 1]);
    }

    #[test]
    fn twill_lines_run_as_they_are_called() {
        // 2/1, up to the right: the weft shows one end further right in each pick.
        let z = Weave::twill(2, 1, Twill::Right).unwrap();
        assert_eq!(picture(&z), "-||\n||-\n|-|");
        let s = Weave::twill(2, 1, Twill::Left).unwrap();
        for (end, pick) in (0..9).flat_map(|e| (0..9).map(move |p| (e, p))) {
            assert_eq!(z.up(end, pick), z.up(end + 1, pick + 1));
            assert_eq!(s.up(end + 1, pick), s.up(end, pick + 1));
        }
        assert_eq!(Weave::twill(3, 2, Twill::Left).unwrap().longest_floats(), [3, 2]);
        assert_eq!(Weave::twill(1, 3, Twill::Right).unwrap().longest_floats(), [1, 3]);
        assert!(Weave::twill(3, 0, Twill::Left).is_err());
    }

    #[test]
    fn satins_have_their_counters_and_no_others() {
        // The regular satins of the textbooks.
        for (repeat, want) in [
            (4, vec![]),
            (5, vec![2, 3]),
            (6, vec![]),
            (7, vec![2, 3, 4, 5]),
            (8, vec![3, 5]),
            (10, vec![3, 7]),
        ] {
            let found: Vec<usize> = (0..=repeat).filter(|s| Weave::satin(repeat, *s).is_ok()).collect();
            assert_eq!(found, want, "satin of {repeat}");
        }
        let satin = Weave::satin(5, 2).unwrap();
        assert_eq!(picture(&satin), "|||-|\n|-|||\n||||-\n||-||\n-||||");
        assert_eq!(satin.longest_floats(), [4, 1]);
        assert_eq!(satin.opposite().longest_floats(), [1, 4]);
        for (repeat, step) in [(5, 2), (5, 3), (7, 3), (8, 3), (8, 5), (10, 3), (12, 5)] {
            let w = Weave::satin(repeat, step).unwrap();
            for p in 0..repeat {
                let under: Vec<usize> = (0..repeat).filter(|e| !w.up(*e, p)).collect();
                assert_eq!(under, [p * step % repeat]);
                // No two binding points touch, not even at a corner: that is what hides them.
                for side in [1, repeat - 1] {
                    assert!(w.up(under[0] + side, p + 1) && w.up(under[0] + side, p), "{repeat}/{step}");
                }
            }
            assert_eq!(w.loose(), [const { Vec::<usize>::new() }; 2]);
        }
        let refused = Weave::satin(8, 2).unwrap_err().to_string();
        assert!(refused.ends_with("these do: 3, 5"), "{refused}");
        assert!(Weave::satin(6, 2).unwrap_err().to_string().ends_with("none does"));
    }

    #[test]
    fn weaves_have_names() {
        let of = |name: &str| name.parse::<Weave>();
        assert_eq!(of("plain"), Ok(Weave::plain()));
        assert_eq!(of("twill:2/1"), Weave::twill(2, 1, Twill::Right));
        assert_eq!(of("twill:3/2s"), Weave::twill(3, 2, Twill::Left));
        assert_eq!(of("satin:8/3"), Weave::satin(8, 3));
        assert_eq!(of("sateen:8/3").unwrap().opposite(), Weave::satin(8, 3).unwrap());
        assert!(of("satin:6/2").unwrap_err().to_string().contains("there is no satin over 6"));
        for name in ["", "linen", "twill", "twill:2", "twill:x/1", "satin:5/2s", "satin:5000/2", "twill:2/-1"]
        {
            assert_eq!(of(name), Err(WeaveError::Name(name.into())));
        }
    }

    #[test]
    fn a_jacquard_figure_takes_the_place_of_the_ground() {
        let (satin, sateen) = (Weave::satin(5, 2).unwrap(), Weave::satin(5, 2).unwrap().opposite());
        let mask = |e: usize, p: usize| (5..15).contains(&e) && (5..15).contains(&p);
        let w = Weave::jacquard(20, 20, mask, &sateen, &satin);
        for (e, p) in (0..40).flat_map(|e| (0..40).map(move |p| (e, p))) {
            let want = if mask(e % 20, p % 20) { sateen.up(e, p) } else { satin.up(e, p) };
            assert_eq!(w.up(e, p), want);
        }
        assert_eq!(w.loose(), [const { Vec::<usize>::new() }; 2]);
    }

    #[test]
    fn pattern_wefts_show_in_the_figure_and_hide_elsewhere() {
        let ground = Weave::twill(2, 1, Twill::Right).unwrap();
        let tie = Weave::from_fn(4, 4, |e, r| (e + r) % 4 == 0);
        let figure = |e: usize, r: usize| if e < 6 { 1 + r % 2 } else { 0 };
        let w = Weave::with_pattern_wefts(&ground, [12, 12], 2, 2, figure, &tie);
        assert_eq!((w.ends(), w.picks()), (12, 48));
        for (e, r) in (0..12).flat_map(|e| (0..12).map(move |r| (e, r))) {
            assert_eq!(w.up(e, 4 * r), ground.up(e, 2 * r));
            assert_eq!(w.up(e, 4 * r + 1), ground.up(e, 2 * r + 1));
            for colour in 0..2 {
                let shows = e < 6 && r % 2 == colour && (e + r) % 4 != 0;
                assert_eq!(!w.up(e, 4 * r + 2 + colour), shows);
            }
        }
    }

    #[test]
    fn a_weave_becomes_a_draft_and_back() {
        let thread = Thread { colour: Vec3::ONE, spacing: 0.1, thickness: 0.1 };
        let threads = |n| vec![thread; n];
        for (weave, shafts) in [
            (Weave::plain(), 2),
            (Weave::satin(8, 3).unwrap(), 8),
            (Weave::twill(2, 2, Twill::Left).unwrap(), 4),
            // Doubled ends share their shafts.
            (Weave::from_fn(6, 3, |e, p| e / 2 == p), 3),
        ] {
            let draft = weave.draft("t", threads(weave.ends()), threads(weave.picks()));
            assert_eq!(draft.shafts, shafts);
            assert_eq!(Weave::of(&draft), weave);
        }
    }

    /// Weaves that others digitised, as drawn by Irawan and Marschner 2012 for their cloth model: the pattern names
    /// for each cell the segment of yarn on top.
    #[test]
    fn published_weaves_are_the_ones_we_generate() {
        let Some(data) = std::env::var_os("YUGEN_DATA") else {
            assert!(std::env::var_os("CI").is_none(), "YUGEN_DATA must name the data folder in CI");
            println!("skipped: YUGEN_DATA is not set");
            return;
        };
        let text = std::fs::read_to_string(Path::new(&data).join("textile/irawan_weaves.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        // Name, cells of the drawing per end and per pick.
        for (name, across, down, want) in [
            ("polyester_lining", 1, 1, Weave::plain()),
            ("denim", 1, 2, Weave::twill(2, 1, Twill::Right).unwrap()),
            ("cotton_twill", 1, 2, Weave::twill(3, 1, Twill::Left).unwrap()),
            ("wool_gabardine", 2, 3, Weave::twill(2, 1, Twill::Left).unwrap()),
            ("silk_charmeuse", 1, 2, Weave::satin(5, 2).unwrap()),
        ] {
            let weave = &json["weaves"][name];
            let number = |v: &serde_json::Value| v.as_u64().unwrap() as usize;
            let (w, h) = (number(&weave["config"]["tile_w"]), number(&weave["config"]["tile_h"]));
            let warp = |x: usize, y: usize| {
                let segment = number(&weave["pattern"][y * w + x]);
                weave["yarns"][segment - 1][7] == "warp"
            };
            // A cell shows weft where any of its parts does: the drawings leave room around binding points.
            let got = Weave::from_fn(w / across, h / down, |e, p| {
                let rows = p * down..(p + 1) * down;
                rows.clone().all(|y| (e * across..(e + 1) * across).all(|x| warp(x, y)))
            });
            let shifts = (0..want.ends()).flat_map(|a| (0..want.picks()).map(move |b| (a, b)));
            let same = |flip: bool| {
                let shifted = |a: usize, b: usize| {
                    Weave::from_fn(want.ends(), want.picks(), |e, p| {
                        want.up(if flip { want.ends() - 1 - e } else { e } + a, p + b)
                    })
                };
                shifts.clone().any(|(a, b)| shifted(a, b) == got)
            };
            // The drawings do not say which row is the first, so a line may run either way.
            assert!(same(false) || same(true), "{name}:\n{}", picture(&got));
        }
    }
}
