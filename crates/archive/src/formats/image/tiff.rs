//! TIFF 6.0 and BigTIFF: the first picture; 8, 16 and 32-bit integers, half and float; read only.

use super::{Codec, Decoded, ReadOptions};
use crate::formats::support::Support;
use crate::{Error, Place};
use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::{ColorType, TiffError};
use std::io::{Cursor, Read, Seek, SeekFrom};
use yugen_optics::Image;
use yugen_optics::colour::srgb_to_linear;

pub const CODEC: Codec = Codec {
    name: "TIFF",
    extensions: &["tif", "tiff"],
    support: Support::Partly("the first picture; 8, 16 and 32-bit integers, half and float; grey or RGB"),
    recognises: |bytes| {
        [&b"II*\0"[..], b"MM\0*", b"II+\0", b"MM\0+"].iter().any(|magic| bytes.starts_with(magic))
    },
    decode,
    encode: None,
};

fn decode(bytes: &[u8], options: &ReadOptions, at: &Place) -> Result<Decoded, Error> {
    let (mut decoder, size, names) = open(Cursor::new(bytes), options, at)?;
    let invalid = |e: TiffError| Error::invalid(at.clone(), e.to_string());
    let samples = decoder.read_image().map_err(invalid)?;
    let (mut data, integer) = floats(&samples)
        .ok_or_else(|| Error::invalid(at.clone(), "samples of signed integers are not supported"))?;
    if data.len() != size[0] * size[1] * names.len() {
        let problem =
            format!("found {} samples in separate planes; save it with interleaved channels", data.len());
        return Err(Error::invalid(at.clone(), problem));
    }
    if integer && !options.raw {
        let alpha = names.iter().position(|&n| n == "A");
        for (i, v) in data.iter_mut().enumerate() {
            if Some(i % names.len()) != alpha {
                *v = srgb_to_linear(*v);
            }
        }
    }
    let channels = names.iter().map(|n| n.to_string()).collect();
    let codes = match samples {
        DecodingResult::U8(_) => Some(255),
        // A file has 32 bits to be safe, not because a camera tells so many levels apart.
        _ => integer.then_some(65535),
    };
    let image = Image { width: size[0], height: size[1], channels, data };
    Ok(Decoded { image, chromaticities: None, codes })
}

/// A decoder that has read the header and been told to ask for no more memory than the picture needs; the size and
/// the names of the channels.
type Opened<R> = (Decoder<R>, [usize; 2], &'static [&'static str]);

pub(super) fn open<R: Read + Seek>(
    mut source: R,
    options: &ReadOptions,
    at: &Place,
) -> Result<Opened<R>, Error> {
    let invalid = |e: TiffError| Error::invalid(at.clone(), e.to_string());
    admit_directory(&mut source).map_err(|problem| Error::invalid(at.clone(), problem))?;
    let mut limits = Limits::default();
    let mut decoder = Decoder::new(source).map_err(invalid)?;
    let (width, height) = decoder.dimensions().map_err(invalid)?;
    let colour = decoder.colortype().map_err(invalid)?;
    let names: &[&str] = match colour {
        ColorType::Gray(_) => &["Y"],
        ColorType::GrayA(_) => &["Y", "A"],
        ColorType::RGB(_) => &["R", "G", "B"],
        ColorType::RGBA(_) => &["R", "G", "B", "A"],
        other => {
            let problem = format!("pictures of type {other:?} are not supported; save it as grey or RGB");
            return Err(Error::invalid(at.clone(), problem));
        }
    };
    if ![8, 16, 32].contains(&colour.bit_depth()) {
        let problem = format!("{} bits a sample are not supported; expected 8, 16 or 32", colour.bit_depth());
        return Err(Error::invalid(at.clone(), problem));
    }
    options.admit(at, width.into(), height.into(), names.len() as u64)?;
    let (width, height) = (width as usize, height as usize);
    // A strip or tile may overhang the picture by no more than the picture itself.
    let bytes = (width * height * names.len()).saturating_mul(4).max(1 << 16);
    limits.decoding_buffer_size = bytes.saturating_mul(2);
    limits.intermediate_buffer_size = bytes.saturating_mul(2);
    Ok((decoder.with_limits(limits), [width, height], names))
}

/// Refuses a directory whose lists cannot be in the file: the decoder makes room for them before it looks.
fn admit_directory<R: Read + Seek>(source: &mut R) -> Result<(), String> {
    let ended = |e: std::io::Error| format!("the directory of the picture cannot be read: {e}");
    let length = source.seek(SeekFrom::End(0)).map_err(ended)?;
    source.seek(SeekFrom::Start(0)).map_err(ended)?;
    let mut head = [0; 16];
    source.read_exact(&mut head[..8]).map_err(ended)?;
    let little = head[0] == b'I';
    let number = |bytes: &[u8]| {
        let fold = |n: u64, b: &u8| n << 8 | u64::from(*b);
        if little { bytes.iter().rev().fold(0, fold) } else { bytes.iter().fold(0, fold) }
    };
    let big = number(&head[2..4]) == 43;
    if big {
        source.read_exact(&mut head[8..]).map_err(ended)?;
    }
    let start = if big { number(&head[8..16]) } else { number(&head[4..8]) };
    source.seek(SeekFrom::Start(start)).map_err(ended)?;
    let mut count = [0; 8];
    let count = &mut count[..if big { 8 } else { 2 }];
    source.read_exact(count).map_err(ended)?;
    let mut entry = [0; 20];
    let entry = &mut entry[..if big { 20 } else { 12 }];
    for _ in 0..number(count) {
        source.read_exact(entry).map_err(ended)?;
        // No kind of value takes less than a byte.
        let values = number(if big { &entry[4..12] } else { &entry[4..8] });
        if values > length {
            let tag = number(&entry[..2]);
            return Err(format!(
                "field {tag} promises {values} values, but the file has only {length} bytes"
            ));
        }
    }
    source.seek(SeekFrom::Start(0)).map_err(ended)?;
    Ok(())
}

/// Integers as fractions of the largest, floats as they are; whether they are integers.
pub(super) fn floats(samples: &DecodingResult) -> Option<(Vec<f32>, bool)> {
    Some(match samples {
        DecodingResult::U8(v) => (v.iter().map(|&x| f32::from(x) / 255.0).collect(), true),
        DecodingResult::U16(v) => (v.iter().map(|&x| f32::from(x) / 65535.0).collect(), true),
        DecodingResult::U32(v) => {
            (v.iter().map(|&x| (f64::from(x) / f64::from(u32::MAX)) as f32).collect(), true)
        }
        DecodingResult::F16(v) => (v.iter().map(|x| x.to_f32()).collect(), false),
        DecodingResult::F32(v) => (v.clone(), false),
        _ => return None,
    })
}
