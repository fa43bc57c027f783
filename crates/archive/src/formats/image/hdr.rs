//! Radiance pictures. Ward 1991, "Real Pixels", Graphics Gems II; file format of Radiance, `color.c`.

use super::{Codec, Decoded, ReadOptions, WriteOptions, shown_channels};
use crate::formats::support::Support;
use crate::{Error, Place};
use yugen_optics::colour::rgb_to_xyz;
use yugen_optics::tonemap::into_gamut;
use yugen_optics::{ColourSpace, Image, Vec3};

pub const CODEC: Codec = Codec {
    name: "Radiance HDR",
    extensions: &["hdr", "rgbe", "pic"],
    support: Support::Yes,
    recognises: |bytes| bytes.starts_with(b"#?"),
    decode,
    encode: Some(encode),
};

/// The header's text, then where the pixels begin.
struct Header {
    xyz: bool,
    exposure: f32,
    primaries: Option<[[f64; 2]; 4]>,
    /// Axis ('X' or 'Y'), sign and length of the slow, then of the fast axis.
    axes: [(u8, u8, usize); 2],
    data: usize,
}

fn decode(bytes: &[u8], options: &ReadOptions, at: &Place) -> Result<Decoded, Error> {
    let header = parse_header(bytes, at)?;
    let [slow, fast] = header.axes;
    let (rows, row) = (slow.2, fast.2);
    options.admit(at, row as u64, rows as u64, 3)?;
    let (width, height) = if slow.0 == b'Y' { (row, rows) } else { (rows, row) };

    let mut read = Scanlines { bytes, at: header.data, file: at };
    let mut image: Option<Image> = None;
    let mut line = vec![[0u8; 4]; row];
    for j in 0..rows {
        read.next(&mut line)?;
        // Only once a first line is there: a lying header costs no more than one.
        let image = image.get_or_insert_with(|| Image::rgb(width, height));
        for (i, p) in line.iter().enumerate() {
            let along = |(_, sign, length): (u8, u8, usize), k: usize, grows: u8| {
                if sign == grows { k } else { length - 1 - k }
            };
            // "-Y 512 +X 1024": the slow axis is y, falling from the top; y grows downwards here.
            let (x, y) = if slow.0 == b'Y' {
                (along(fast, i, b'+'), along(slow, j, b'-'))
            } else {
                (along(slow, j, b'+'), along(fast, i, b'-'))
            };
            // Mantissas stand for m / 256, without the half that Radiance itself adds: others do not.
            let scale = if p[3] == 0 { 0.0 } else { f32::powi(2.0, i32::from(p[3]) - 136) / header.exposure };
            let pixel = image.pixel_mut(x, y);
            for c in 0..3 {
                pixel[c] = f32::from(p[c]) * scale;
            }
        }
    }
    let mut image = image.unwrap_or_default();
    let mut chromaticities = header.primaries;
    if header.xyz && !options.raw {
        // Radiance's XYZ has its equal-energy white at (1, 1, 1); keep it white.
        let space = ColourSpace::LinearSrgb;
        let equal_energy =
            yugen_optics::colour::bradford(glam::DVec3::ONE, space.to_xyz() * glam::DVec3::ONE);
        let matrix = (rgb_to_xyz(space.chromaticities()).inverse() * equal_energy).as_mat3();
        for p in image.data.chunks_exact_mut(3) {
            p.copy_from_slice(&(matrix * Vec3::from_slice(p)).to_array());
        }
        chromaticities = Some(space.chromaticities());
    }
    Ok(Decoded { image, chromaticities, codes: None })
}

fn parse_header(bytes: &[u8], at: &Place) -> Result<Header, Error> {
    let invalid = |problem: String| Error::invalid(at.clone(), problem);
    let mut header =
        Header { xyz: false, exposure: 1.0, primaries: None, axes: [(b'Y', b'-', 0); 2], data: 0 };
    let mut start = 0;
    let mut blank = false;
    loop {
        // Longer lines than this do not occur in a header.
        let line = &bytes[start..bytes.len().min(start + 4096)];
        let Some(end) = line.iter().position(|&b| b == b'\n') else {
            return Err(invalid("the header does not end; expected a line like '-Y 512 +X 1024'".into()));
        };
        let line = String::from_utf8_lossy(&line[..end]);
        let line = line.trim_end_matches('\r');
        start += end + 1;
        if blank {
            header.axes = parse_axes(line).ok_or_else(|| {
                invalid(format!("'{line}' is no size; expected a line like '-Y 512 +X 1024'"))
            })?;
            header.data = start;
            return Ok(header);
        }
        let numbers = |text: &str| -> Option<Vec<f64>> {
            text.split_whitespace().map(|w| w.parse().ok().filter(|v: &f64| v.is_finite())).collect()
        };
        match line.split_once('=') {
            Some(("FORMAT", "32-bit_rle_rgbe")) => header.xyz = false,
            Some(("FORMAT", "32-bit_rle_xyze")) => header.xyz = true,
            Some(("FORMAT", other)) => {
                return Err(invalid(format!(
                    "format '{other}' is not supported; expected 32-bit_rle_rgbe or 32-bit_rle_xyze"
                )));
            }
            Some(("EXPOSURE", value)) => match numbers(value).as_deref() {
                // Exposures multiply; the pixels hold radiance times all of them.
                Some(&[e]) if e > 1e-12 && e < 1e12 => {
                    header.exposure = (header.exposure * e as f32).clamp(1e-12, 1e12)
                }
                _ => return Err(invalid(format!("EXPOSURE={value} is not a positive number"))),
            },
            Some(("PRIMARIES", value)) => match numbers(value).as_deref() {
                Some(&[a, b, c, d, e, f, g, h]) => header.primaries = Some([[a, b], [c, d], [e, f], [g, h]]),
                _ => return Err(invalid(format!("PRIMARIES={value}: expected eight numbers"))),
            },
            _ => blank = line.is_empty(),
        }
    }
}

fn parse_axes(line: &str) -> Option<[(u8, u8, usize); 2]> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [a, n, b, m] = words[..] else { return None };
    let axis = |name: &str, length: &str| match name.as_bytes() {
        &[sign @ (b'+' | b'-'), axis @ (b'X' | b'Y')] => {
            Some((axis, sign, length.parse::<u32>().ok()? as usize))
        }
        _ => None,
    };
    let axes = [axis(a, n)?, axis(b, m)?];
    (axes[0].0 != axes[1].0).then_some(axes)
}

struct Scanlines<'a> {
    bytes: &'a [u8],
    at: usize,
    file: &'a Place,
}

impl Scanlines<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let bytes = self
            .bytes
            .get(self.at..self.at + N)
            .ok_or_else(|| self.invalid("the file ends within the picture"))?;
        self.at += N;
        Ok(bytes.try_into().expect("a slice of N bytes"))
    }

    fn invalid(&self, problem: &str) -> Error {
        Error::invalid(Place::byte(&self.file.file, self.at as u64), problem)
    }

    /// One scanline: run lengths per channel since 1991, else pixels with repeats.
    fn next(&mut self, line: &mut [[u8; 4]]) -> Result<(), Error> {
        let first = self.take::<4>()?;
        let per_channel =
            first[0] == 2 && first[1] == 2 && first[2] < 128 && (8..0x8000).contains(&line.len());
        if !per_channel {
            self.at -= 4;
            return self.old(line);
        }
        if usize::from(first[2]) << 8 | usize::from(first[3]) != line.len() {
            return Err(self.invalid("a scanline is not as long as the picture is wide"));
        }
        for channel in 0..4 {
            let mut x = 0;
            while x < line.len() {
                let [code] = self.take()?;
                let (count, run) =
                    if code > 128 { (usize::from(code) - 128, true) } else { (usize::from(code), false) };
                if count == 0 || count > line.len() - x {
                    return Err(self.invalid("a run goes beyond its scanline"));
                }
                let mut value = 0;
                for (k, p) in line[x..x + count].iter_mut().enumerate() {
                    if k == 0 || !run {
                        [value] = self.take()?;
                    }
                    p[channel] = value;
                }
                x += count;
            }
        }
        Ok(())
    }

    fn old(&mut self, line: &mut [[u8; 4]]) -> Result<(), Error> {
        let (mut x, mut shift) = (0, 0);
        while x < line.len() {
            let p = self.take::<4>()?;
            if p[..3] == [1, 1, 1] {
                let count = usize::from(p[3]).checked_shl(shift).unwrap_or(usize::MAX);
                if x == 0 || count > line.len() - x {
                    return Err(self.invalid("a run goes beyond its scanline"));
                }
                let previous = line[x - 1];
                line[x..x + count].fill(previous);
                x += count;
                shift += 8;
                if shift > 24 {
                    return Err(self.invalid("a run goes beyond its scanline"));
                }
            } else {
                line[x] = p;
                x += 1;
                shift = 0;
            }
        }
        Ok(())
    }
}

/// Linear sRGB, desaturated where it lies outside, because few programs read other primaries.
fn encode(image: &Image, options: &WriteOptions) -> Result<Vec<u8>, String> {
    let (colour, _) = shown_channels(image);
    let to_srgb = options.space.matrix_to(ColourSpace::LinearSrgb);
    let mut out = format!(
        "#?RADIANCE\nSOFTWARE=Yugen\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n",
        image.height, image.width
    )
    .into_bytes();
    for row in image.data.chunks_exact(image.width * image.channels.len()) {
        let pixels: Vec<[u8; 4]> = row
            .chunks_exact(image.channels.len())
            .map(|p| {
                rgbe(into_gamut(to_srgb * Vec3::from_array(colour.map(|c| p[c])), ColourSpace::LinearSrgb))
            })
            .collect();
        if (8..0x8000).contains(&pixels.len()) {
            out.extend([2, 2, (pixels.len() >> 8) as u8, pixels.len() as u8]);
            for channel in 0..4 {
                let values: Vec<u8> = pixels.iter().map(|p| p[channel]).collect();
                run_lengths(&values, &mut out);
            }
        } else {
            out.extend(pixels.iter().flatten());
        }
    }
    Ok(out)
}

/// Shared exponent: the largest channel's mantissa lies in [128, 255]. What is not a number becomes black.
fn rgbe(rgb: Vec3) -> [u8; 4] {
    let max = rgb.max_element();
    if rgb.is_nan() || max < 1e-32 {
        return [0; 4];
    }
    // max = m · 2^e with m in [1/2, 1); 2^127 is the largest that an exponent byte holds.
    let mut e = (max.min(1e38).log2().floor() as i32 + 1).clamp(-127, 127);
    if max.min(1e38) * f32::powi(2.0, 8 - e) >= 255.5 {
        e += 1;
    }
    let e = e.min(127);
    let [r, g, b] = (rgb * f32::powi(2.0, 8 - e)).to_array().map(|v| (v + 0.5).clamp(0.0, 255.0) as u8);
    [r, g, b, (e + 128) as u8]
}

fn run_lengths(values: &[u8], out: &mut Vec<u8>) {
    let run_at = |i: usize| values[i..].iter().take(127).take_while(|&&v| v == values[i]).count();
    let mut i = 0;
    while i < values.len() {
        let run = run_at(i);
        // A run of fewer than four costs more as a run than inside literals.
        if run >= 4 {
            out.extend([128 + run as u8, values[i]]);
            i += run;
        } else {
            let start = i;
            while i < values.len() && i - start < 128 && run_at(i) < 4 {
                i += 1;
            }
            out.push((i - start) as u8);
            out.extend(&values[start..i]);
        }
    }
}
