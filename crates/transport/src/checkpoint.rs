//! A render on the disk: what it is of, and the sums of its tiles, packed.
//!
//! A file is the head (text and numbers), then blocks of tiles, then a hash of all before. A block is deflated with the
//! bytes of like significance side by side: of the doubles in which samples are summed, which came in single
//! precision, the lower bytes are mostly zero and the upper ones mostly alike.

use crate::film::Tile;
use crate::guide::{Guide, NUMBERS};
use crate::render::lock;
use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use std::io::{Read, Write};
use std::sync::Mutex;
use std::time::Duration;
use yugen_optics::Fingerprint;

const MAGIC: &[u8] = b"yugen checkpoint 5\n";
/// Tiles of a block: some hundred kilobytes.
const BLOCK: usize = 64;
/// Most parts of a head: more than are ever written.
const MAX_PARTS: u32 = 1 << 12;
/// The longest head that is looked for at the beginning of a file.
pub const HEAD_BYTES: u64 = 1 << 20;

/// One thing that a render is made from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// For people: `the size`, `the mesh of 'bunny'`.
    pub name: String,
    /// What it is.
    pub value: PartValue,
}

/// What tells two parts of one name apart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PartValue {
    /// In words that can be shown.
    Text(String),
    /// A hash of something large.
    Hash(u64),
}

impl Part {
    /// A part that can be said in a few words.
    pub fn text(name: impl Into<String>, value: impl ToString) -> Self {
        Self { name: cut(name.into()), value: PartValue::Text(cut(value.to_string())) }
    }

    /// A part that is too large to be shown.
    pub fn hash(name: impl Into<String>, value: u64) -> Self {
        Self { name: cut(name.into()), value: PartValue::Hash(value) }
    }
}

fn cut(mut text: String) -> String {
    let end = (0..=200.min(text.len())).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0);
    text.truncate(end);
    text
}

/// The first thing that is not the same in two renders, as a sentence; `None` where all is.
fn difference(then: &[Part], now: &[Part]) -> Option<String> {
    let without = |all: &[Part], others: &[Part]| {
        all.iter().find(|p| !others.iter().any(|o| o.name == p.name)).map(|p| p.name.clone())
    };
    if let Some(name) = without(now, then) {
        return Some(format!("it knows nothing of {name}, which is in this render"));
    }
    if let Some(name) = without(then, now) {
        return Some(format!("in it is {name}, which is not in this render"));
    }
    // A name may stand for several parts, one after the other.
    if let Some((a, b)) = then.iter().zip(now).find(|(a, b)| a != b) {
        return Some(match (&a.value, &b.value) {
            (PartValue::Text(then), PartValue::Text(now)) if a.name == b.name => {
                format!("{} was {then} in it, and is {now} now", a.name)
            }
            _ => format!("{} has changed since", b.name),
        });
    }
    (then.len() != now.len())
        .then(|| format!("it is made from {} parts, this render from {}", then.len(), now.len()))
}

/// What a budget counts: samples that were shared out by noise are no beginning of as many for all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counting {
    /// The same number for every pixel, this many in the end.
    Samples(u32),
    /// As many as are needed where they are needed, for a time or an error.
    ByNoise,
}

/// The head of a checkpoint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Head {
    /// What the render is made from.
    pub parts: Vec<Part>,
    /// How samples were counted.
    pub counting: Counting,
    /// The budget was spent: the picture has been written.
    pub finished: bool,
    /// Samples that every pixel has at least.
    pub samples: u32,
    /// Time spent.
    pub elapsed: Duration,
    pub(crate) tiles: u64,
}

/// A checkpoint could not be taken up.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ResumeError {
    /// Not a checkpoint, cut short or damaged.
    #[error("this is not a whole checkpoint of a render: {0}")]
    Damaged(&'static str),
    /// Of another picture; what differs.
    #[error("the checkpoint is of another render: {0}")]
    Other(String),
    /// More samples than asked for.
    #[error(
        "the checkpoint already has {done} samples a pixel, more than the {asked} asked for; ask for more"
    )]
    Fewer {
        /// Samples a pixel that are in it.
        done: u32,
        /// Samples a pixel that are wanted.
        asked: u32,
    },
    /// Samples shared out by noise cannot become the same number for all.
    #[error(
        "in the checkpoint noisy parts have more samples than others (--time, --error); go on with a longer time or a \
         smaller error, not with a number of samples"
    )]
    SharedOut,
}

impl Head {
    /// Reads the head of a checkpoint from the first bytes of a file: [`HEAD_BYTES`] are enough.
    pub fn read(bytes: &[u8]) -> Result<Self, ResumeError> {
        Self::read_from(&mut Reader(bytes))
    }

    fn read_from(from: &mut Reader) -> Result<Self, ResumeError> {
        from.0 = from
            .0
            .strip_prefix(MAGIC)
            .ok_or(ResumeError::Damaged("it does not start like one of this version"))?;
        let count = from.u32()?;
        if count > MAX_PARTS {
            return Err(ResumeError::Damaged("its head is too long"));
        }
        let mut parts = Vec::new();
        for _ in 0..count {
            let name = from.word()?;
            let value = match from.take::<1>()? {
                [0] => PartValue::Hash(from.u64()?),
                _ => PartValue::Text(from.word()?),
            };
            parts.push(Part { name, value });
        }
        let counting = match from.u32()? {
            0 => Counting::ByNoise,
            n => Counting::Samples(n),
        };
        let finished = from.take::<1>()? != [0];
        let (samples, elapsed, tiles) = (from.u32()?, from.u64()?, from.u64()?);
        Ok(Self { parts, counting, finished, samples, elapsed: Duration::from_millis(elapsed), tiles })
    }

    fn write(&self, out: &mut Vec<u8>) {
        let word = |out: &mut Vec<u8>, text: &str| {
            out.extend_from_slice(&(text.len() as u32).to_le_bytes());
            out.extend_from_slice(text.as_bytes());
        };
        out.extend_from_slice(MAGIC);
        out.extend_from_slice(&(self.parts.len() as u32).to_le_bytes());
        for part in &self.parts {
            word(out, &part.name);
            match &part.value {
                PartValue::Hash(hash) => {
                    out.push(0);
                    out.extend_from_slice(&hash.to_le_bytes());
                }
                PartValue::Text(text) => {
                    out.push(1);
                    word(out, text);
                }
            }
        }
        let samples = if let Counting::Samples(n) = self.counting { n } else { 0 };
        out.extend_from_slice(&samples.to_le_bytes());
        out.push(u8::from(self.finished));
        out.extend_from_slice(&self.samples.to_le_bytes());
        out.extend_from_slice(&(self.elapsed.as_millis() as u64).to_le_bytes());
        out.extend_from_slice(&self.tiles.to_le_bytes());
    }
}

/// A whole checkpoint of `tiles`, which have so many `sums` for every pixel, that of the weights included.
pub(crate) fn write(head: &Head, tiles: &[Mutex<Tile>], sums: usize) -> Vec<u8> {
    let mut out = Vec::new();
    head.write(&mut out);
    for block in tiles.chunks(BLOCK) {
        let mut heads = Vec::new();
        let mut columns = vec![Vec::new(); sums];
        let mut moments = [const { Vec::new() }; 7];
        let mut guides = [const { Vec::new() }; NUMBERS];
        for tile in block {
            let tile = lock(tile);
            let tile = tile.to_go_on();
            heads.extend_from_slice(&tile.samples.to_le_bytes());
            heads.extend_from_slice(&tile.goal.to_le_bytes());
            heads.extend_from_slice(&tile.shared.to_le_bytes());
            heads.extend_from_slice(&tile.clamped.to_le_bytes());
            heads.extend_from_slice(&tile.rejected.to_le_bytes());
            if tile.samples == 0 {
                continue;
            }
            for pixel in tile.sums.chunks_exact(sums) {
                for (column, value) in columns.iter_mut().zip(pixel) {
                    column.push(value.to_bits());
                }
            }
            for pixel in &tile.moments {
                for (column, value) in moments.iter_mut().zip(pixel) {
                    column.push(value.to_bits());
                }
                if let Some(count) = moments[6].last_mut() {
                    *count ^= (tile.samples as f32).to_bits();
                }
            }
            for guide in &tile.guides {
                for (column, value) in guides.iter_mut().zip(guide.numbers()) {
                    column.push(value.to_bits());
                }
            }
        }
        tell_alpha_by_weight(&mut columns);
        let mut raw = heads;
        for column in &columns {
            spread(column.iter().map(|v| v.to_le_bytes()), column.len(), &mut raw);
        }
        for column in moments.iter().chain(&guides) {
            spread(column.iter().map(|v| v.to_le_bytes()), column.len(), &mut raw);
        }
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
        // Writing to memory cannot fail.
        let packed = packed.write_all(&raw).and_then(|()| packed.finish()).unwrap_or_default();
        out.extend_from_slice(&(packed.len() as u32).to_le_bytes());
        out.extend_from_slice(&packed);
    }
    let sum = Fingerprint::of(&out);
    out.extend_from_slice(&sum.to_le_bytes());
    out
}

/// Takes up a checkpoint: it has to be of a render made from `parts`, and `accept` has to find its head right.
pub(crate) fn read(
    bytes: &[u8],
    parts: &[Part],
    tiles: &[Mutex<Tile>],
    sums: usize,
    accept: impl FnOnce(&Head) -> Result<(), ResumeError>,
) -> Result<Head, ResumeError> {
    let (body, sum) = bytes.split_last_chunk::<8>().ok_or(ResumeError::Damaged("it is too short"))?;
    let mut from = Reader(body);
    let head = Head::read_from(&mut from)?;
    if Fingerprint::of(body) != u64::from_le_bytes(*sum) {
        return Err(ResumeError::Damaged("its checksum is wrong"));
    }
    if let Some(what) = difference(&head.parts, parts) {
        return Err(ResumeError::Other(what));
    }
    if head.tiles != tiles.len() as u64 {
        return Err(ResumeError::Damaged("it has another number of tiles"));
    }
    accept(&head)?;
    for block in tiles.chunks(BLOCK) {
        let mut from = Unpacked(ZlibDecoder::new(from.bytes()?));
        let (mut pixels, mut padded, mut guided) = (0, 0, 0);
        for tile in block {
            let mut tile = lock(tile);
            tile.samples = u32::from_le_bytes(from.take()?);
            tile.goal = u32::from_le_bytes(from.take()?);
            tile.shared = f64::from_le_bytes(from.take()?);
            tile.clamped = f64::from_le_bytes(from.take()?);
            tile.rejected = u64::from_le_bytes(from.take()?);
            if tile.samples > 0 {
                padded += tile.sums.len() / sums;
                pixels += tile.moments.len();
                guided += tile.guides.len();
            }
        }
        let mut columns = Vec::new();
        for _ in 0..sums {
            columns.push(from.column::<8>(padded)?.into_iter().map(u64::from_le_bytes).collect::<Vec<_>>());
        }
        tell_alpha_by_weight(&mut columns);
        let mut moments = [const { Vec::new() }; 7];
        for column in &mut moments {
            *column = from.column::<4>(pixels)?.into_iter().map(u32::from_le_bytes).collect();
        }
        let mut guides = [const { Vec::new() }; NUMBERS];
        for column in &mut guides {
            *column = from.column::<4>(guided)?.into_iter().map(f32::from_le_bytes).collect();
        }
        let (mut pixel, mut place, mut guide) = (0, 0, 0);
        for tile in block {
            let mut tile = lock(tile);
            let samples = tile.samples;
            if samples == 0 {
                continue;
            }
            for to in tile.sums.chunks_exact_mut(sums) {
                for (to, column) in to.iter_mut().zip(&columns) {
                    *to = f64::from_bits(column[place]);
                }
                place += 1;
            }
            for to in &mut tile.moments {
                for (to, column) in to.iter_mut().zip(&moments) {
                    *to = f32::from_bits(column[pixel]);
                }
                to[6] = f32::from_bits(to[6].to_bits() ^ (samples as f32).to_bits());
                pixel += 1;
            }
            for to in &mut tile.guides {
                *to = Guide::from_numbers(guides.each_ref().map(|column| column[guide]));
                guide += 1;
            }
        }
    }
    Ok(head)
}

/// Where every ray meets something, the sum of alpha is that of the weights, bit for bit: then it takes no room. The
/// same again undoes it.
fn tell_alpha_by_weight(columns: &mut [Vec<u64>]) {
    if let [_, _, _, alpha, .., weights] = columns {
        alpha.iter_mut().zip(weights).for_each(|(a, w)| *a ^= *w);
    }
}

/// The first bytes of all, then the second ones, and so on.
fn spread<const N: usize>(values: impl Iterator<Item = [u8; N]>, count: usize, out: &mut Vec<u8>) {
    let start = out.len();
    out.resize(start + N * count, 0);
    for (i, value) in values.enumerate() {
        for (k, byte) in value.into_iter().enumerate() {
            out[start + k * count + i] = byte;
        }
    }
}

struct Unpacked<'a>(ZlibDecoder<&'a [u8]>);

impl Unpacked<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], ResumeError> {
        let mut bytes = [0; N];
        self.0.read_exact(&mut bytes).map_err(|_| ResumeError::Damaged("a block of it is cut short"))?;
        Ok(bytes)
    }

    fn column<const N: usize>(&mut self, count: usize) -> Result<Vec<[u8; N]>, ResumeError> {
        let mut spread = vec![0; N * count];
        self.0.read_exact(&mut spread).map_err(|_| ResumeError::Damaged("a block of it is cut short"))?;
        Ok((0..count).map(|i| std::array::from_fn(|k| spread[k * count + i])).collect())
    }
}

struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], ResumeError> {
        let (head, rest) = self.0.split_first_chunk::<N>().ok_or(ResumeError::Damaged("it is cut short"))?;
        self.0 = rest;
        Ok(*head)
    }

    fn u32(&mut self) -> Result<u32, ResumeError> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, ResumeError> {
        self.take().map(u64::from_le_bytes)
    }

    /// As many bytes as are said before them.
    fn bytes(&mut self) -> Result<&'a [u8], ResumeError> {
        let length = self.u32()? as usize;
        let (bytes, rest) = self.0.split_at_checked(length).ok_or(ResumeError::Damaged("it is cut short"))?;
        self.0 = rest;
        Ok(bytes)
    }

    fn word(&mut self) -> Result<String, ResumeError> {
        Ok(String::from_utf8_lossy(self.bytes()?).into_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reason_names_the_one_thing_that_differs() {
        let parts = |size: &str, mesh: u64, lights: usize| {
            let mut all = vec![Part::text("the size", size), Part::hash("the mesh of 'bunny'", mesh)];
            all.extend((0..lights).map(|i| Part::hash("the light 'lamp'", i as u64)));
            all
        };
        let told = |a: &[Part], b: &[Part]| difference(a, b).unwrap_or_default();
        let then = parts("96x64", 1, 2);
        assert_eq!(difference(&then, &then), None);
        assert_eq!(told(&then, &parts("40x30", 1, 2)), "the size was 96x64 in it, and is 40x30 now");
        assert_eq!(told(&then, &parts("96x64", 2, 2)), "the mesh of 'bunny' has changed since");
        assert_eq!(
            told(&then, &parts("96x64", 2, 0)),
            "in it is the light 'lamp', which is not in this render"
        );
        assert_eq!(
            told(&parts("96x64", 1, 0), &then),
            "it knows nothing of the light 'lamp', which is in this render"
        );
        assert!(told(&then, &parts("96x64", 1, 3)).contains("4 parts"));
    }

    #[test]
    fn words_and_heads_of_any_length_are_bounded() {
        assert_eq!(cut("é".repeat(200)).len(), 200);
        let head = Head {
            parts: vec![Part::text("the size", "1x1"), Part::hash("x", 3)],
            counting: Counting::Samples(7),
            finished: true,
            samples: 5,
            elapsed: Duration::from_millis(1234),
            tiles: 9,
        };
        let mut bytes = Vec::new();
        head.write(&mut bytes);
        assert_eq!(Head::read(&bytes), Ok(head));
        for end in 0..bytes.len() {
            assert!(matches!(Head::read(&bytes[..end]), Err(ResumeError::Damaged(_))), "{end}");
        }
        let long = [MAGIC, &u32::MAX.to_le_bytes()].concat();
        assert_eq!(Head::read(&long), Err(ResumeError::Damaged("its head is too long")));
    }
}
