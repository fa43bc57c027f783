//! A picture row by row, so that many large ones can be open side by side.
//!
//! PNG (not interlaced), OpenEXR (one part of scanlines) and TIFF (strips of moderate size) are decoded as they are
//! read and hold a few rows. All others are decoded once when they are opened, then kept as codes of 8 or 16 bits or
//! floats: in memory while the allowance lasts, beyond it in a temporary file without a name (in the folder `TMPDIR`).
//! A JPEG is never more than its bytes, neither while it is decoded.

use super::{CODECS, Decoded, ReadOptions, damaged, decode, exr, jpeg, png, tiff};
use crate::{Error, Place, open, read_bounded};
use ::exr::block::UncompressedBlock;
use ::exr::block::chunk::CompressedBlock;
use ::exr::block::reader::{AllChunksReader, ChunksReader};
use ::exr::meta::{BlockDescription, attribute::SampleType};
use ::exr::prelude::{LineOrder, f16};
use ::png::{BitDepth, ColorType, Transformations};
use ::tiff::decoder::{ChunkType, Decoder};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Arc;

/// A strip of a TIFF that is held for each open picture may have this many bytes; larger ones are set aside.
const STRIP: usize = 4 << 20;

/// Where a picture's numbers come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Samples {
    /// Whole numbers from zero to this one.
    Codes(u32),
    /// Floating point, linear.
    Floats,
}

/// An open picture; rows come from the top.
pub struct Rows {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// 1 (grey) or 3; alpha is left out.
    pub channels: usize,
    /// What the file holds.
    pub samples: Samples,
    /// xy of red, green, blue and white, where the file names them.
    pub chromaticities: Option<[[f64; 2]; 4]>,
    source: Source,
    row: usize,
    at: Place,
    /// What each code means: a fraction of the largest unless told otherwise.
    table: Arc<Vec<[f32; 3]>>,
    line: Vec<f32>,
}

enum Source {
    Png { reader: Box<::png::Reader<BufReader<File>>>, stride: usize, wide: bool },
    Exr(Box<ExrRows>),
    Tiff(Box<TiffRows>),
    Kept(Kept),
}

impl Rows {
    /// Opens a picture. Of what cannot be decoded row by row, as much is kept in memory as `allowance` has bytes,
    /// which are taken off it.
    pub fn open(path: &Path, options: &ReadOptions, allowance: &mut u64) -> Result<Self, Error> {
        let at = Place::file(path);
        let mut file = open(path)?;
        let mut head = Vec::new();
        (&file).take(64).read_to_end(&mut head).map_err(|e| Error::io(path, e))?;
        file.seek(SeekFrom::Start(0)).map_err(|e| Error::io(path, e))?;
        if let Some(refusal) = super::foreign::refusal(&head, &at) {
            return Err(refusal);
        }
        let file = BufReader::with_capacity(1 << 16, file);
        let codec = CODECS.iter().find(|c| (c.recognises)(&head)).map(|c| c.name);
        let opened = if codec == Some(png::CODEC.name) {
            open_png(file, options, &at)?
        } else if codec == Some(exr::CODEC.name) {
            open_exr(file, options, &at)?
        } else if codec == Some(tiff::CODEC.name) {
            open_tiff(file, options, &at)?
        } else {
            None
        };
        match opened {
            Some(rows) => Ok(rows),
            None if codec == Some(jpeg::CODEC.name) => keep_jpeg(path, options, allowance, &at),
            None => keep(path, options, allowance, &at),
        }
    }

    /// Whether the picture was decoded as a whole when it was opened, and is kept.
    pub fn kept(&self) -> bool {
        matches!(self.source, Source::Kept(_))
    }

    fn new(size: [usize; 2], channels: usize, samples: Samples, source: Source, at: &Place) -> Self {
        let max = if let Samples::Codes(max) = samples { max } else { 0 };
        Self {
            width: size[0],
            height: size[1],
            channels,
            samples,
            chromaticities: None,
            source,
            row: 0,
            at: at.clone(),
            table: Arc::new((0..=max).map(|code| [code as f32 / max.max(1) as f32; 3]).collect()),
            line: Vec::new(),
        }
    }

    /// What each code of an integer picture means, one entry a code; must have as many as there are codes.
    pub fn set_table(&mut self, table: Arc<Vec<[f32; 3]>>) {
        if table.len() == self.table.len() {
            self.table = table;
        }
    }

    /// What the levels of an integer picture mean, each a fraction of full scale.
    pub fn set_response(&mut self, light: impl Fn(f32) -> f32) {
        let max = (self.table.len() - 1).max(1) as f32;
        self.table = Arc::new((0..self.table.len()).map(|code| [light(code as f32 / max); 3]).collect());
    }

    /// The next row: integers as the table says, floats as they are; grey three times.
    pub fn next_row(&mut self, out: &mut [[f32; 3]]) -> Result<(), Error> {
        let invalid = |problem: String| Error::invalid(self.at.clone(), problem);
        if self.row == self.height {
            return Err(invalid(format!("the picture has no more than {} rows", self.height)));
        }
        let out = &mut out[..self.width];
        let row = self.row;
        self.row += 1;
        match &mut self.source {
            Source::Png { reader, stride, wide } => {
                let ended = || invalid(damaged(format!("it ends in row {row} of {}", self.height)));
                let line = reader.next_row().map_err(|e| invalid(damaged(e)))?.ok_or_else(ended)?;
                let bytes = line.data();
                let code = |i: usize| match wide {
                    true => usize::from(u16::from_be_bytes([bytes[2 * i], bytes[2 * i + 1]])),
                    false => usize::from(bytes[i]),
                };
                for (x, rgb) in out.iter_mut().enumerate() {
                    let at = x * *stride;
                    *rgb = if self.channels == 1 {
                        self.table[code(at)]
                    } else {
                        std::array::from_fn(|c| self.table[code(at + c)][c])
                    };
                }
            }
            Source::Exr(source) => source.row(row, out).map_err(invalid)?,
            Source::Tiff(source) => {
                let stride = source.stride;
                let line = source.row(row).map_err(invalid)?;
                let max = (self.table.len() - 1) as f32;
                let floats = self.samples == Samples::Floats;
                let value =
                    |v: f32, c: usize| if floats { v } else { self.table[(v * max + 0.5) as usize][c] };
                for (rgb, v) in out.iter_mut().zip(line.chunks_exact(stride)) {
                    *rgb = std::array::from_fn(|c| value(v[if self.channels == 1 { 0 } else { c }], c));
                }
            }
            Source::Kept(kept) => {
                let line = &mut self.line;
                kept.row(row * self.width * self.channels, self.width * self.channels, line)
                    .map_err(|e| Error::io(&self.at.file, e))?;
                let floats = self.samples == Samples::Floats;
                for (rgb, v) in out.iter_mut().zip(line.chunks_exact(self.channels)) {
                    *rgb = std::array::from_fn(|c| {
                        let v = v[if self.channels == 1 { 0 } else { c }];
                        if floats { v } else { self.table[v as usize][c] }
                    });
                }
            }
        }
        Ok(())
    }
}

fn open_png(file: BufReader<File>, options: &ReadOptions, at: &Place) -> Result<Option<Rows>, Error> {
    let invalid = |e: ::png::DecodingError| Error::invalid(at.clone(), damaged(e));
    let mut decoder = ::png::Decoder::new_with_limits(file, ::png::Limits { bytes: 1 << 26 });
    decoder.set_transformations(Transformations::EXPAND);
    let reader = decoder.read_info().map_err(invalid)?;
    let (colour, depth) = reader.output_color_type();
    let info = reader.info();
    options.admit(at, info.width.into(), info.height.into(), colour.samples() as u64)?;
    if info.interlaced {
        return Ok(None);
    }
    let size = [info.width as usize, info.height as usize];
    let wide = depth == BitDepth::Sixteen;
    let channels = if matches!(colour, ColorType::Grayscale | ColorType::GrayscaleAlpha) { 1 } else { 3 };
    let source = Source::Png { reader: Box::new(reader), stride: colour.samples(), wide };
    let samples = Samples::Codes(if wide { 65535 } else { 255 });
    Ok(Some(Rows::new(size, channels, samples, source, at)))
}

/// The blocks of an OpenEXR file, one at a time.
struct ExrRows {
    chunks: AllChunksReader<BufReader<File>>,
    /// Of red, green and blue within a row of a block: offset in bytes and kind.
    planes: [(usize, SampleType); 3],
    /// Bytes of a row.
    row_bytes: usize,
    /// Rows of the block at hand, the first of them, and their bytes.
    first: usize,
    count: usize,
    block: Vec<u8>,
}

fn open_exr(file: BufReader<File>, options: &ReadOptions, at: &Place) -> Result<Option<Rows>, Error> {
    let invalid = |e: ::exr::error::Error| Error::invalid(at.clone(), damaged(e));
    let bytes = file.get_ref().metadata().map_err(|e| Error::io(&at.file, e))?.len();
    let reader = ::exr::block::read(file, false).map_err(invalid)?;
    let [header] = reader.headers() else { return Ok(None) };
    let channels = &header.channels.list;
    let plain = header.blocks == BlockDescription::ScanLines
        && header.line_order == LineOrder::Increasing
        && !header.deep
        && channels.iter().all(|c| c.sampling.x() == 1 && c.sampling.y() == 1);
    let size = [header.layer_size.x(), header.layer_size.y()];
    options.admit(at, size[0] as u64, size[1] as u64, channels.len() as u64)?;
    // As in reading whole: a header must not promise more blocks than the file has room for.
    if !plain || (header.chunk_count as u64).saturating_mul(16) > bytes {
        return Ok(None);
    }
    let find = |name: &str| channels.iter().position(|c| c.name.eq(name));
    let found = match ["R", "G", "B"].map(find) {
        [Some(r), Some(g), Some(b)] => [r, g, b],
        _ => match (find("Y"), channels.len()) {
            (Some(y), _) => [y; 3],
            (None, 1) => [0; 3],
            _ => return Err(no_colour(channels.iter().map(|c| c.name.to_string()), at)),
        },
    };
    let offset =
        |i: usize| channels[..i].iter().map(|c| c.sample_type.bytes_per_sample() * size[0]).sum::<usize>();
    let planes = found.map(|i| (offset(i), channels[i].sample_type));
    let row_bytes = header.channels.bytes_per_pixel * size[0];
    let grey = found[0] == found[1];
    let chromaticities = header
        .shared_attributes
        .chromaticities
        .map(|c| [c.red, c.green, c.blue, c.white].map(|v| [f64::from(v.x()), f64::from(v.y())]));
    let chunks = reader.all_chunks(false).map_err(invalid)?;
    let source = ExrRows { chunks, planes, row_bytes, first: 0, count: 0, block: Vec::new() };
    let source = Source::Exr(Box::new(source));
    let mut rows = Rows::new(size, if grey { 1 } else { 3 }, Samples::Floats, source, at);
    rows.chromaticities = chromaticities;
    Ok(Some(rows))
}

fn no_colour(names: impl Iterator<Item = String>, at: &Place) -> Error {
    let names = names.collect::<Vec<_>>().join(", ");
    Error::invalid(at.clone(), format!("the channels are {names}; expected R, G and B, or Y"))
}

impl ExrRows {
    fn row(&mut self, row: usize, out: &mut [[f32; 3]]) -> Result<(), String> {
        if row >= self.first + self.count {
            let chunk = self.chunks.next().ok_or_else(|| damaged(format!("it ends before row {row}")))?;
            let chunk = chunk.map_err(damaged)?;
            if !matches!(chunk.compressed_block, CompressedBlock::ScanLine(_)) {
                return Err(damaged("the blocks are not what the header says"));
            }
            let block = UncompressedBlock::decompress_chunk(chunk, self.chunks.meta_data(), false)
                .map_err(damaged)?;
            self.first = block.index.pixel_position.y();
            self.count = block.index.pixel_size.y();
            self.block = block.data;
            let whole = self.block.len() == self.count * self.row_bytes;
            if !whole || !(self.first..self.first + self.count).contains(&row) {
                return Err(format!("the rows are not in order at row {row}; save the file anew"));
            }
        }
        let line = &self.block[(row - self.first) * self.row_bytes..][..self.row_bytes];
        for (c, (offset, kind)) in self.planes.into_iter().enumerate() {
            let plane = &line[offset..];
            match kind {
                SampleType::F16 => {
                    for (rgb, b) in out.iter_mut().zip(plane.chunks_exact(2)) {
                        rgb[c] = f16::from_ne_bytes([b[0], b[1]]).to_f32();
                    }
                }
                SampleType::F32 => {
                    for (rgb, b) in out.iter_mut().zip(plane.chunks_exact(4)) {
                        rgb[c] = f32::from_ne_bytes([b[0], b[1], b[2], b[3]]);
                    }
                }
                SampleType::U32 => {
                    for (rgb, b) in out.iter_mut().zip(plane.chunks_exact(4)) {
                        rgb[c] = u32::from_ne_bytes([b[0], b[1], b[2], b[3]]) as f32;
                    }
                }
            }
        }
        Ok(())
    }
}

/// The strips of a TIFF, one at a time.
struct TiffRows {
    decoder: Decoder<BufReader<File>>,
    width: usize,
    /// Samples a pixel.
    stride: usize,
    rows_per_strip: usize,
    strip: Option<usize>,
    data: Vec<f32>,
}

fn open_tiff(file: BufReader<File>, options: &ReadOptions, at: &Place) -> Result<Option<Rows>, Error> {
    let (mut decoder, size, names) = tiff::open(file, options, at)?;
    let bits = decoder.colortype().map_err(|e| Error::invalid(at.clone(), damaged(e)))?.bit_depth();
    let stride = names.len();
    let planes = decoder.image_buffer_layout().map_or(2, |layout| layout.planes);
    let (strip_width, rows_per_strip) = decoder.chunk_dimensions();
    let rows_per_strip = (rows_per_strip as usize).min(size[1]);
    let in_strips = decoder.get_chunk_type() == ChunkType::Strip
        && strip_width as usize == size[0]
        && planes == 1
        && rows_per_strip * size[0] * stride * 4 <= STRIP;
    // What 32 bits mean is told by the first strip.
    if !in_strips || rows_per_strip == 0 || bits == 32 {
        return Ok(None);
    }
    let mut source =
        TiffRows { decoder, width: size[0], stride, rows_per_strip, strip: None, data: Vec::new() };
    let integer = source.load(0).map_err(|problem| Error::invalid(at.clone(), problem))?;
    let samples = match (integer, bits) {
        (false, _) => Samples::Floats,
        (true, 8) => Samples::Codes(255),
        _ => Samples::Codes(65535),
    };
    let channels = if stride < 3 { 1 } else { 3 };
    Ok(Some(Rows::new(size, channels, samples, Source::Tiff(Box::new(source)), at)))
}

impl TiffRows {
    /// Whether the samples are integers.
    fn load(&mut self, strip: usize) -> Result<bool, String> {
        let samples = self.decoder.read_chunk(strip as u32).map_err(damaged)?;
        let (data, integer) = tiff::floats(&samples).ok_or("samples of signed integers are not supported")?;
        self.data = data;
        self.strip = Some(strip);
        Ok(integer)
    }

    fn row(&mut self, row: usize) -> Result<&[f32], String> {
        let strip = row / self.rows_per_strip;
        if self.strip != Some(strip) {
            self.load(strip)?;
        }
        let line = self.width * self.stride;
        let at = (row % self.rows_per_strip) * line;
        self.data.get(at..at + line).ok_or_else(|| format!("the picture ends in row {row}"))
    }
}

/// A picture set aside.
struct Kept {
    /// Bytes a sample: 1 and 2 are codes, 4 a float.
    size: usize,
    place: Set,
}

enum Set {
    Memory(Vec<u8>),
    Disk(File),
}

/// Where the parts of a picture of so many bytes go.
fn set_aside(parts: impl Iterator<Item = Vec<u8>>, bytes: u64, allowance: &mut u64) -> Result<Set, Error> {
    if bytes <= *allowance {
        *allowance -= bytes;
        let mut all = Vec::with_capacity(bytes as usize);
        parts.for_each(|part| all.extend(part));
        return Ok(Set::Memory(all));
    }
    let failed = |e| Error::io(&std::env::temp_dir(), e);
    let mut file = tempfile::tempfile().map_err(failed)?;
    for part in parts {
        file.write_all(&part).map_err(failed)?;
    }
    Ok(Set::Disk(file))
}

fn keep_jpeg(path: &Path, options: &ReadOptions, allowance: &mut u64, at: &Place) -> Result<Rows, Error> {
    let bytes = read_bounded(path, options.max_samples.saturating_mul(8).max(1 << 26))?;
    let (size, channels, codes) = jpeg::codes(&bytes, options, at)?;
    drop(bytes);
    let count = codes.len() as u64;
    let place = if count <= *allowance {
        *allowance -= count;
        Set::Memory(codes)
    } else {
        set_aside(std::iter::once(codes), count, &mut 0)?
    };
    let source = Source::Kept(Kept { size: 1, place });
    Ok(Rows::new(size, channels, Samples::Codes(255), source, at))
}

fn keep(path: &Path, options: &ReadOptions, allowance: &mut u64, at: &Place) -> Result<Rows, Error> {
    let raw = ReadOptions { raw: true, ..options.clone() };
    let bytes = read_bounded(path, options.max_samples.saturating_mul(8).max(1 << 26))?;
    let Decoded { image, chromaticities, codes } = decode(&bytes, &raw, at)?;
    drop(bytes);
    let colour = match ["R", "G", "B"].map(|c| image.channel(c)) {
        [Some(r), Some(g), Some(b)] => vec![r, g, b],
        _ => match image.channel("Y") {
            Some(y) => vec![y],
            None => return Err(no_colour(image.channels.iter().cloned(), at)),
        },
    };
    let size = match codes {
        Some(..=255) => 1,
        Some(_) => 2,
        None => 4,
    };
    let count = image.width * image.height * colour.len();
    let rows = image.data.chunks_exact(image.width * image.channels.len());
    let parts = rows.map(|pixels| {
        let mut line = Vec::with_capacity(image.width * colour.len() * size);
        for pixel in pixels.chunks_exact(image.channels.len()) {
            for &c in &colour {
                match codes {
                    Some(max @ ..=255) => line.push((pixel[c] * max as f32 + 0.5) as u8),
                    Some(max) => line.extend(((pixel[c] * max as f32 + 0.5) as u16).to_ne_bytes()),
                    None => line.extend(pixel[c].to_ne_bytes()),
                }
            }
        }
        line
    });
    let place = set_aside(parts, (count * size) as u64, allowance)?;
    let samples = codes.map_or(Samples::Floats, Samples::Codes);
    let source = Source::Kept(Kept { size, place });
    let mut rows = Rows::new([image.width, image.height], colour.len(), samples, source, at);
    rows.chromaticities = chromaticities;
    Ok(rows)
}

impl Kept {
    /// `count` samples from the one at `from`, codes as whole numbers.
    fn row(&mut self, from: usize, count: usize, out: &mut Vec<f32>) -> std::io::Result<()> {
        let size = self.size;
        let mut read = Vec::new();
        let bytes = match &mut self.place {
            Set::Memory(all) => &all[from * size..(from + count) * size],
            Set::Disk(file) => {
                file.seek(SeekFrom::Start((from * size) as u64))?;
                read.resize(count * size, 0);
                file.read_exact(&mut read)?;
                &read
            }
        };
        out.clear();
        match size {
            1 => out.extend(bytes.iter().map(|b| f32::from(*b))),
            2 => out.extend(bytes.chunks_exact(2).map(|b| f32::from(u16::from_ne_bytes([b[0], b[1]])))),
            _ => out.extend(bytes.chunks_exact(4).map(|b| f32::from_ne_bytes([b[0], b[1], b[2], b[3]]))),
        }
        Ok(())
    }
}
