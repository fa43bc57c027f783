//! Polynomial texture maps, `.ptm`, versions 1.1 and 1.2. Malzbender and Gelb 2001, "Polynomial Texture Map (.ptm)
//! File Format".
//!
//! Text lines `PTM_1.2`, the layout, width, height, six scales, six biases; then bytes, the bottom row first. A
//! coefficient is (byte − bias) · scale and a colour lies between 0 and 255. Coefficients stand in the order x², y²,
//! xy, x, y, 1. `PTM_FORMAT_RGB` has a block of six bytes a texel for red, then green, then blue;
//! `PTM_FORMAT_LRGB` six bytes a texel for a luminance that multiplies a colour over 255, then (1.1: beside them)
//! three bytes for the colour. The JPEG layouts have a grey JPEG a coefficient, some of them as difference to
//! another. `PTM_FORMAT_LUM` has eight bytes a texel: six for a luminance Y, then Cr and Cb, which are 128 where there is
//! no colour. The last three are read, not written.

use super::gathered::Gathered;
use super::image::{ReadOptions, read_bytes};
use super::mixed::{Functions, Mixed};
use super::numbers::Scanner;
use super::relightable::{Basis, Colouring, Relightable, admit};
use super::relit_contents::Contents;
use super::support::{Feature, Support, find};
use crate::{Error, Place};
use std::io::Write;
use std::path::Path;

/// Where the file's coefficients x², y², xy, x, y, 1 stand in [`Basis::Ptm`].
const TERM: [usize; 6] = [3, 5, 4, 1, 2, 0];

/// What a file's planes make up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Planes {
    /// Six of red, six of green, six of blue.
    Rgb,
    /// Six of a factor, then red, green and blue.
    Lrgb,
    /// Six of a luminance, then Cr and Cb.
    Lum,
}

const LAYOUTS: [(&str, Planes, bool); 5] = [
    ("PTM_FORMAT_RGB", Planes::Rgb, false),
    ("PTM_FORMAT_LRGB", Planes::Lrgb, false),
    ("PTM_FORMAT_LUM", Planes::Lum, false),
    ("PTM_FORMAT_JPEG_RGB", Planes::Rgb, true),
    ("PTM_FORMAT_JPEG_LRGB", Planes::Lrgb, true),
];

/// What is read.
pub const FEATURES: &[Feature] = &[
    Feature::yes("PTM_FORMAT_RGB"),
    Feature::yes("PTM_FORMAT_LRGB"),
    Feature::partly(
        "PTM_FORMAT_LUM",
        "no colour matrix; chrominance as JFIF has it, for no file of another program is known that shows it",
    ),
    Feature::partly("PTM_FORMAT_JPEG_RGB", "no planes that are predicted with motion"),
    Feature::partly("PTM_FORMAT_JPEG_LRGB", "no planes that are predicted with motion"),
    Feature::no("PTM_FORMAT_PTM_LUT", "tables of polynomials are not supported"),
    Feature::no("PTM_FORMAT_PTM_C_LUT", "tables of polynomials are not supported"),
    Feature::no("PTM_FORMAT_JPEGLS_RGB", "JPEG-LS is not supported"),
    Feature::no("PTM_FORMAT_JPEGLS_LRGB", "JPEG-LS is not supported"),
];

/// Reads a file; more than `max_texels` are refused before memory is asked for.
pub fn read(bytes: &[u8], file: &Path, max_texels: u64) -> Result<Contents, Error> {
    let mut s = Scanner::new(bytes, file);
    let start = s.start_of_file();
    let old = match s.next_line() {
        b"PTM_1.2" => false,
        b"PTM_1.1" => true,
        _ => return Err(Error::invalid(start, "a PTM file starts with the line 'PTM_1.2' (or 'PTM_1.1')")),
    };
    let at = s.place();
    let name = s.next_line();
    let name = String::from_utf8_lossy(&name[..name.len().min(40)]);
    let Some(&(_, kind, jpeg)) = LAYOUTS.iter().find(|l| l.0 == name) else {
        if let Some(Feature { name, support: Support::No(why) }) = find(FEATURES, &name) {
            let problem =
                format!("{name} cannot be read: {why}; save it as PTM_FORMAT_LRGB or PTM_FORMAT_RGB");
            return Err(Error::invalid(at, problem));
        }
        let name = name.escape_debug().to_string();
        return Err(Error::unknown(at, "PTM layout", &name, LAYOUTS.iter().map(|l| l.0)));
    };
    s.space();
    let at = s.place();
    let width = whole(&mut s, "the width")?;
    let height = whole(&mut s, "the height")?;
    let (width, height) = admit(at, width, height, max_texels)?;
    let (mut scale, mut bias) = ([0.0; 6], [0.0; 6]);
    scale.iter_mut().try_for_each(|v| number(&mut s, "a scale").map(|n| *v = n))?;
    bias.iter_mut().try_for_each(|v| number(&mut s, "a bias").map(|n| *v = n))?;
    let n = width * height;
    let planes = match kind {
        Planes::Rgb => 18,
        Planes::Lrgb => 9,
        Planes::Lum => 8,
    };
    let header = Header { width, height, planes: kind, scale, bias };
    if jpeg {
        let planes = Streams::read(&mut s, planes)?.decode(bytes, file, width, height)?;
        return header.assemble(&s, |plane, i| planes[plane][i]);
    }
    end_of_line(&mut s)?;
    let (offset, data) = (s.offset(), s.rest());
    if data.len() < n * planes {
        let problem = format!(
            "the file ends early: {width} x {height} texels need {} bytes from byte {offset} on, and {} are there",
            n * planes,
            data.len()
        );
        return Err(Error::invalid(Place::byte(file, bytes.len() as u64), problem));
    }
    match (kind, old) {
        (Planes::Rgb, _) => header.assemble(&s, |plane, i| data[(plane / 6 * n + i) * 6 + plane % 6]),
        (Planes::Lrgb, true) => header.assemble(&s, |plane, i| data[i * 9 + plane]),
        (Planes::Lrgb, false) => header.assemble(&s, |plane, i| match plane {
            0..6 => data[i * 6 + plane],
            _ => data[n * 6 + i * 3 + plane - 6],
        }),
        (Planes::Lum, _) => {
            let place = s.place();
            let mut number = || {
                s.space();
                s.float().is_some()
            };
            if data.len() > n * planes && (0..16).all(|_| number()) {
                let problem =
                    "the colour matrix of a file of luminance is not read; save it as PTM_FORMAT_LRGB";
                return Err(Error::invalid(place, problem));
            }
            header.assemble(&s, |plane, i| data[i * 8 + plane])
        }
    }
}

/// Writes a file of version 1.2 without compression to `out`; `file` is for messages.
pub fn write(r: &mut Gathered, file: &Path, out: &mut dyn Write) -> Result<(), Error> {
    r.check(file)?;
    if r.basis() != Basis::Ptm {
        let problem = format!("a .ptm holds PTM, not {}; write a .rti or a folder", r.basis().name());
        return Err(Error::invalid(Place::file(file), problem));
    }
    let ranges = r.term_ranges();
    // With zero among the values the whole-numbered bias lies in 0..=255, and with 254 steps rounding it stays inside.
    let steps = TERM.map(|t| {
        let (lo, hi) = (ranges[t][0].min(0.0), ranges[t][1].max(0.0));
        // At 4e-39 a scale would be no normal number, and black has no scale at all.
        let scale = if hi - lo > 1e-30 { 255.0 * (hi - lo) / 254.0 } else { 1.0 };
        (scale, (-255.0 * lo / scale).ceil())
    });
    // The scale counts colours up to 255.
    let byte = |j: usize, v: f32| ((255.0 * v / steps[j].0).round() + steps[j].1).clamp(0.0, 255.0) as u8;
    let (stride, [width, height]) = (r.stride(), r.size());
    let (layout, blocks): (_, &[Block]) = match r.colouring() {
        Colouring::Rgb => ("PTM_FORMAT_RGB", &[Block::Terms(0, 3), Block::Terms(1, 3), Block::Terms(2, 3)]),
        Colouring::Lrgb => ("PTM_FORMAT_LRGB", &[Block::Terms(3, 1), Block::Colour]),
    };
    let line = |values: [f32; 6]| values.map(|v| v.to_string()).join(" ");
    let (scales, biases) = (line(steps.map(|s| s.0)), line(steps.map(|s| s.1)));
    let header = format!("PTM_1.2\n{layout}\n{width}\n{height}\n{scales}\n{biases}\n");
    let mut bytes = header.into_bytes();
    let mut row = Vec::new();
    for block in blocks {
        for y in (0..height).rev() {
            r.row(y, &mut row)?;
            let texels = row.chunks_exact(stride);
            match *block {
                Block::Terms(first, step) => {
                    bytes
                        .extend(texels.flat_map(|t| (0..6).map(move |j| byte(j, t[first + step * TERM[j]]))));
                }
                Block::Colour => {
                    bytes.extend(texels.flat_map(|t| {
                        [t[0], t[1], t[2]].map(|v| (255.0 * v).round().clamp(0.0, 255.0) as u8)
                    }))
                }
            }
            out.write_all(&bytes).map_err(|e| Error::io(file, e))?;
            bytes.clear();
        }
    }
    Ok(())
}

/// What stands together in a file.
#[derive(Clone, Copy)]
enum Block {
    /// Six coefficients: the number of the first among those of a texel, and from one to the next.
    Terms(usize, usize),
    /// The fixed colour.
    Colour,
}

/// The bytes of a file.
#[cfg(test)]
pub(super) fn written(r: &Relightable) -> Result<Vec<u8>, Error> {
    let mut out = Vec::new();
    write(&mut r.into(), Path::new("a.ptm"), &mut out).map(|()| out)
}

fn number(s: &mut Scanner, what: &str) -> Result<f32, Error> {
    s.space();
    let at = s.mark();
    let value = s.float().ok_or_else(|| s.expected(what))? as f32;
    if value.is_finite() {
        return Ok(value);
    }
    Err(Error::invalid(s.place_of(at), format!("{what} is too large to be a number of single precision")))
}

fn whole(s: &mut Scanner, what: &str) -> Result<u64, Error> {
    s.space();
    let at = s.mark();
    let value = s.integer().ok_or_else(|| s.expected(&format!("{what}, a whole number")))?;
    u64::try_from(value).map_err(|_| Error::invalid(s.place_of(at), format!("{what} is negative")))
}

/// The header is over: the very next byte after the line's end is data.
fn end_of_line(s: &mut Scanner) -> Result<(), Error> {
    if !s.at_line_end() {
        return Err(s.expected("the end of the header's last line"));
    }
    s.next_line_exactly();
    Ok(())
}

struct Header {
    width: usize,
    height: usize,
    planes: Planes,
    scale: [f32; 6],
    bias: [f32; 6],
}

impl Header {
    /// From the bytes of each plane by texel in the order of the file.
    fn assemble(self, s: &Scanner, byte: impl Fn(usize, usize) -> u8) -> Result<Contents, Error> {
        let Self { width, height, planes, scale, bias } = self;
        let (colouring, stride) = match planes {
            Planes::Rgb => (Colouring::Rgb, 18),
            Planes::Lrgb => (Colouring::Lrgb, 9),
            Planes::Lum => (Colouring::Lrgb, 8),
        };
        let mut coefficients = vec![0.0; width * height * stride];
        let value = |j: usize, b: u8| (f32::from(b) - bias[j]) * scale[j] / 255.0;
        for (y, row) in coefficients.chunks_exact_mut(width * stride).enumerate() {
            for (x, texel) in row.chunks_exact_mut(stride).enumerate() {
                let i = (height - 1 - y) * width + x;
                for j in 0..6 {
                    match planes {
                        Planes::Rgb => {
                            (0..3).for_each(|c| texel[3 * TERM[j] + c] = value(j, byte(6 * c + j, i)));
                        }
                        Planes::Lrgb => texel[3 + TERM[j]] = value(j, byte(j, i)),
                        Planes::Lum => texel[TERM[j]] = value(j, byte(j, i)),
                    }
                }
                match planes {
                    Planes::Rgb => {}
                    Planes::Lrgb => (0..3).for_each(|c| texel[c] = f32::from(byte(6 + c, i)) / 255.0),
                    Planes::Lum => {
                        // Cr stands before Cb.
                        let chrominance = |plane| (f32::from(byte(plane, i)) - 128.0) / 255.0;
                        texel[6..].copy_from_slice(&[chrominance(7), chrominance(6)]);
                    }
                }
            }
        }
        if coefficients.iter().any(|v| !v.is_finite()) {
            return Err(Error::invalid(
                s.start_of_file(),
                "scales and biases make coefficients that are not finite",
            ));
        }
        if planes == Planes::Lum {
            let functions = Functions::Luminance(Basis::Ptm);
            return Ok(Contents::Mixed(Mixed { width, height, functions, coefficients }));
        }
        Ok(Contents::Terms(Relightable { width, height, basis: Basis::Ptm, colouring, coefficients }))
    }
}

/// What the header of a JPEG layout says of each plane.
struct Streams {
    /// Where the first stream begins.
    offset: usize,
    inverted: Vec<bool>,
    /// The planes in the order in which they can be restored.
    order: Vec<usize>,
    reference: Vec<Option<usize>>,
    sizes: Vec<u64>,
    corrections: Vec<u64>,
}

impl Streams {
    fn read(s: &mut Scanner, planes: usize) -> Result<Self, Error> {
        number(s, "the quality of the JPEG planes")?;
        let list = |s: &mut Scanner, what: &str| -> Result<Vec<i64>, Error> {
            let mut one = || {
                s.space();
                s.integer().ok_or_else(|| s.expected(&format!("{what} of each of {planes} planes")))
            };
            (0..planes).map(|_| one()).collect()
        };
        s.space();
        let at = s.place();
        let transforms = list(s, "the transformation")?;
        let motion = [list(s, "the motion across")?, list(s, "the motion down")?];
        if transforms.iter().any(|t| t & !1 != 0) || motion.iter().flatten().any(|m| *m != 0) {
            return Err(Error::invalid(at, "planes that are predicted with motion are not supported"));
        }
        let at = s.place();
        let ranks = list(s, "the rank")?;
        let reference = list(s, "the reference")?;
        let reference: Vec<_> =
            reference.iter().map(|r| usize::try_from(*r).ok().filter(|r| *r < planes)).collect();
        let mut order: Vec<usize> = (0..planes).collect();
        order.sort_by_key(|p| ranks[*p]);
        let rank = |p: usize| order.iter().position(|q| *q == p);
        if (0..planes).any(|p| reference[p].is_some_and(|r| rank(r) >= rank(p))) {
            return Err(Error::invalid(at, "a plane refers to one that comes after it"));
        }
        let size = |s: &mut Scanner, what: &str| -> Result<Vec<u64>, Error> {
            s.space();
            let at = s.place();
            let sizes = list(s, what)?;
            let sizes: Result<Vec<u64>, _> = sizes.into_iter().map(u64::try_from).collect();
            sizes.map_err(|_| Error::invalid(at, format!("{what} is negative")))
        };
        let sizes = size(s, "the size")?;
        let corrections = size(s, "the size of the corrections")?;
        end_of_line(s)?;
        let inverted = transforms.iter().map(|t| t & 1 == 1).collect();
        Ok(Self { offset: s.offset(), inverted, order, reference, sizes, corrections })
    }

    /// The bytes of every plane.
    fn decode(&self, bytes: &[u8], file: &Path, width: usize, height: usize) -> Result<Vec<Vec<u8>>, Error> {
        let n = width * height;
        let mut at = self.offset;
        let mut next = |size: u64| -> Result<&[u8], Error> {
            let part = usize::try_from(size).ok().and_then(|size| bytes.get(at..at.checked_add(size)?));
            let part = part.ok_or_else(|| {
                let place = Place::byte(file, at as u64);
                Error::invalid(
                    place,
                    format!("the file ends early: {size} bytes of a plane should stand here"),
                )
            })?;
            at += part.len();
            Ok(part)
        };
        let options = ReadOptions { max_samples: n as u64, ..ReadOptions::raw() };
        let (mut planes, mut fixes) = (Vec::new(), Vec::new());
        for (plane, (&size, &corrections)) in self.sizes.iter().zip(&self.corrections).enumerate() {
            let jpeg = next(size)?;
            let picture = read_bytes(jpeg, file, &options)?;
            if (picture.width, picture.height, picture.channels.len()) != (width, height, 1) {
                let problem = format!(
                    "JPEG plane {plane} is {} x {} with {} channels; expected {width} x {height} and one",
                    picture.width,
                    picture.height,
                    picture.channels.len()
                );
                return Err(Error::invalid(Place::file(file), problem));
            }
            planes.push(picture.data.iter().map(|v| (v * 255.0).round() as u8).collect::<Vec<u8>>());
            fixes.push(next(corrections)?);
        }
        for &p in &self.order {
            if let Some(r) = self.reference[p] {
                let (from, to) = if r < p {
                    let (a, b) = planes.split_at_mut(p);
                    (&a[r], &mut b[0])
                } else {
                    let (a, b) = planes.split_at_mut(r);
                    (&b[0], &mut a[p])
                };
                for (v, &r) in to.iter_mut().zip(from.iter()) {
                    let prediction = if self.inverted[p] { 255 - r } else { r };
                    *v = v.wrapping_add(prediction).wrapping_sub(128);
                }
            }
            // Bytes that prediction could not restore: position from the plane's first byte, big end first, value.
            for fix in fixes[p].chunks_exact(5) {
                let i = u32::from_be_bytes([fix[0], fix[1], fix[2], fix[3]]) as usize;
                if let Some(v) = planes[p].get_mut(i) {
                    *v = fix[4];
                }
            }
        }
        Ok(planes)
    }
}

#[cfg(test)]
mod tests {
    use super::super::relightable::DEFAULT_MAX_TEXELS;
    use super::super::relightable::tests::{quanta, sample};
    use super::*;

    fn parse(bytes: &[u8]) -> Result<Relightable, Error> {
        read(bytes, Path::new("a.ptm"), DEFAULT_MAX_TEXELS).map(|c| c.terms().unwrap())
    }

    /// By hand: two texels, one above the other.
    #[test]
    fn luminance_and_chrominance_are_kept_apart() {
        let header = "PTM_1.2\nPTM_FORMAT_LUM\n1 2\n2 1 1 1 1 255\n0 10 0 0 0 1\n";
        let mut bytes = header.as_bytes().to_vec();
        bytes.extend([1, 12, 3, 4, 5, 6, 128, 255]);
        bytes.extend([0, 0, 0, 0, 0, 2, 0, 128]);
        let Contents::Mixed(m) = read(&bytes, Path::new("a.ptm"), 10).unwrap() else { panic!("terms") };
        assert_eq!((m.width, m.height, m.functions), (1, 2, Functions::Luminance(Basis::Ptm)));
        // 1, x, y, x², xy, y², Cb, Cr; the row at the end of the file is the top one.
        let want =
            [[255.0, 0.0, 0.0, 0.0, 0.0, -10.0, 0.0, -128.0], [1275.0, 4.0, 5.0, 2.0, 3.0, 2.0, 127.0, 0.0]];
        let got: Vec<f32> = m.coefficients.iter().map(|v| v * 255.0).collect();
        assert!(got.iter().zip(want.as_flattened()).all(|(a, b)| (a - b).abs() < 1e-3), "{got:?}");
        let with_matrix = [header.as_bytes(), &b"1 0 0 0 ".repeat(4), b"\n", &bytes[header.len()..]].concat();
        let error = read(&with_matrix, Path::new("a.ptm"), 10).unwrap_err().to_string();
        assert!(error.contains("a.ptm:6:1: the colour matrix of a file of luminance is not read"), "{error}");
        for n in 0..bytes.len() {
            assert!(read(&bytes[..n], Path::new("a.ptm"), 10).is_err(), "{n}");
        }
    }

    /// By hand: two texels, one above the other.
    #[test]
    fn the_order_of_rows_and_coefficients_is_that_of_the_format() {
        let header = "PTM_1.2\nPTM_FORMAT_LRGB\n1 2 \n 1 1 1 1 1 2.5\n0 10 0 0 0 0 \r\n";
        let below = [[1, 12, 3, 4, 5, 6], [11, 22, 13, 14, 15, 16]];
        let colours = [[255, 0, 0], [51, 102, 204]];
        let mut bytes = header.as_bytes().to_vec();
        bytes.extend(below.iter().flatten().map(|b| *b as u8));
        bytes.extend(colours.iter().flatten());
        let r = parse(&bytes).unwrap();
        assert_eq!((r.width, r.height, r.colouring), (1, 2, Colouring::Lrgb));
        // 1, x, y, x², xy, y² times 255; the row at the end of the file is the top one.
        let want = [
            [15.0, 2.0 * 0.0 + 6.0 * 2.5, 4.0, 5.0, 1.0, 3.0, 2.0],
            [16.0 * 2.5, 14.0, 15.0, 11.0, 13.0, 12.0, 0.0],
        ];
        let got: Vec<f32> = r.coefficients.chunks(9).flat_map(|t| t[3..].iter().map(|v| v * 255.0)).collect();
        let want = [&want[1][..6], &want[0][1..]].concat();
        assert!(got.iter().zip(&want).all(|(a, b)| (a - b).abs() < 1e-4), "{got:?} {want:?}");
        assert_eq!(r.coefficients[..3], [0.2, 0.4, 0.8]);
        assert_eq!(r.coefficients[9..12], [1.0, 0.0, 0.0]);

        // Version 1.1 keeps the colour beside the coefficients.
        let mut old = header.replace("1.2\n", "1.1\n").into_bytes();
        for (c, rgb) in below.iter().zip(colours) {
            old.extend(c.iter().map(|b| *b as u8).chain(rgb));
        }
        assert_eq!(parse(&old).unwrap(), r);
    }

    #[test]
    fn files_come_back_within_a_quantum() {
        for colouring in [Colouring::Rgb, Colouring::Lrgb] {
            let r = sample(Basis::Ptm, colouring, 13, 7);
            let bytes = written(&r).unwrap();
            let back = parse(&bytes).unwrap();
            // Half a step of 254, and a half more where the bias is a whole number of steps; measured 0.502.
            assert!(quanta(&r, &back) < 0.51, "{colouring:?} {}", quanta(&r, &back));
            assert_eq!(written(&back).unwrap().len(), bytes.len());
        }
        // One texel, all black.
        let r = Relightable { coefficients: vec![0.0; 18], ..sample(Basis::Ptm, Colouring::Rgb, 1, 1) };
        assert_eq!(parse(&written(&r).unwrap()).unwrap(), r);
    }

    /// The planes as JPEGs of the best quality: the second predicted from the first inverted, the third corrected.
    pub fn jpeg_file(raw: &[u8], n: usize, width: u32) -> Vec<u8> {
        let encode = |plane: &[u8]| {
            let mut out = Vec::new();
            let mut e = ::image::codecs::jpeg::JpegEncoder::new_with_quality(&mut out, 100);
            e.encode(plane, width, n as u32 / width, ::image::ExtendedColorType::L8).unwrap();
            out
        };
        let plane = |k: usize| -> Vec<u8> {
            (0..n).map(|i| if k < 6 { raw[i * 6 + k] } else { raw[n * 6 + i * 3 + k - 6] }).collect()
        };
        let mut planes: Vec<Vec<u8>> = (0..9).map(plane).collect();
        let first = planes[0].clone();
        for (v, r) in planes[1].iter_mut().zip(&first) {
            *v = v.wrapping_sub(255 - r).wrapping_add(128);
        }
        let jpegs: Vec<Vec<u8>> = planes.iter().map(|p| encode(p)).collect();
        let fix = [0, 0, 0, 2, planes[2][2]];
        let list = |f: &dyn Fn(usize) -> i64| (0..9).map(|k| f(k).to_string()).collect::<Vec<_>>().join(" ");
        let mut out = format!(
            "90\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n",
            list(&|k| i64::from(k == 1)),
            list(&|_| 0),
            list(&|_| 0),
            list(&|k| k as i64),
            list(&|k| if k == 1 { 0 } else { -1 }),
            list(&|k| jpegs[k].len() as i64),
            list(&|k| if k == 2 { 5 } else { 0 })
        )
        .into_bytes();
        for (k, jpeg) in jpegs.iter().enumerate() {
            out.extend(jpeg);
            out.extend(if k == 2 { &fix[..] } else { &[] });
        }
        out
    }

    #[test]
    fn jpeg_planes_are_restored_from_each_other() {
        // Slow waves, which JPEG keeps.
        let (width, height) = (16, 8);
        let mut r = sample(Basis::Ptm, Colouring::Lrgb, width, height);
        for (i, v) in r.coefficients.iter_mut().enumerate() {
            let (texel, k) = (i / 9, i % 9);
            let (x, y) = ((texel % width) as f32, (texel / width) as f32);
            *v = 0.5 + 0.3 * (0.2 * x + 0.15 * y + k as f32).sin();
        }
        let raw = written(&r).unwrap();
        let header: usize = raw.split_inclusive(|b| *b == b'\n').take(6).map(<[u8]>::len).sum();
        let text = String::from_utf8(raw[..header].to_vec()).unwrap().replace("_LRGB", "_JPEG_LRGB");
        let mut bytes = text.into_bytes();
        bytes.extend(jpeg_file(&raw[header..], width * height, width as u32));
        let back = parse(&bytes).unwrap();
        // At quality 100 JPEG is off by two grey levels at most, twice that where one is predicted from another.
        assert!(quanta(&r, &back) < 5.0, "{}", quanta(&r, &back));
        for n in (0..bytes.len()).step_by(37) {
            assert!(parse(&bytes[..n]).is_err(), "{n}");
        }
        let with = |from: &str, to: &str| {
            let text: Vec<u8> = bytes.clone();
            let at = text.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
            [&text[..at], to.as_bytes(), &text[at + from.len()..]].concat()
        };
        let error = parse(&with("\n0 1 0 0", "\n0 2 0 0")).unwrap_err().to_string();
        assert!(error.contains("predicted with motion"), "{error}");
        let error = parse(&with("-1 0 -1", "-1 5 -1")).unwrap_err().to_string();
        assert!(error.contains("comes after it"), "{error}");
        let error = parse(&with("\n16\n8\n", "\n8\n16\n")).unwrap_err().to_string();
        assert!(error.contains("expected 8 x 16 and one"), "{error}");
    }

    #[test]
    fn bad_files_get_a_sentence() {
        let good = written(&sample(Basis::Ptm, Colouring::Rgb, 3, 2)).unwrap();
        let text = |from: &str, to: &str| {
            let at = good.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
            [&good[..at], to.as_bytes(), &good[at + from.len()..]].concat()
        };
        for (from, to, want) in [
            ("PTM_1.2", "PTM_1.9", "a.ptm:1:1: a PTM file starts with the line 'PTM_1.2' (or 'PTM_1.1')"),
            (
                "FORMAT_RGB",
                "FORMAT_JPEGLS_RGB",
                "a.ptm:2:1: PTM_FORMAT_JPEGLS_RGB cannot be read: JPEG-LS is not",
            ),
            ("FORMAT_RGB", "FORMAT_RBG", "a.ptm:2:1: unknown PTM layout 'PTM_FORMAT_RBG'; did you mean"),
            ("\n3\n", "\n-3\n", "a.ptm:3:1: the width is negative"),
            ("\n3\n", "\n0\n", "a.ptm:3:1: the picture is empty (0 x 2)"),
            ("\n3\n", "\nthree\n", "a.ptm:3:1: expected the width, a whole number, found 'three'"),
            (
                "\n3\n",
                "\n999999999999\n",
                "the number of texels (999999999999 x 2) is 1999999999998, more than",
            ),
            ("\n3\n", "\n4\n", "the file ends early: 4 x 2 texels need 144 bytes"),
        ] {
            let got = parse(&text(from, to)).unwrap_err().to_string();
            assert!(got.contains(want), "{from} -> {to}: {got}");
        }
        for n in 0..good.len() {
            assert!(parse(&good[..n]).is_err(), "{n}");
        }
    }
}
