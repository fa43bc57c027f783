//! JPEG (ISO/IEC 10918), 8 bits.

use super::{Codec, ReadOptions, damaged, integer};
use crate::formats::support::Support;
use crate::{Error, Place};
use ::image::codecs::jpeg::{JpegDecoder, JpegEncoder};
use ::image::{ColorType, ExtendedColorType, ImageDecoder, ImageEncoder};
use std::io::Cursor;

pub const CODEC: Codec = Codec {
    name: "JPEG",
    extensions: &["jpg", "jpeg"],
    support: Support::Partly("embedded profiles are not looked at; no 12 bits"),
    recognises: |bytes| bytes.starts_with(b"\xff\xd8\xff"),
    decode: |bytes, options, at| integer::decode(decoder(bytes, at)?, options, at),
    encode: Some(|image, options| {
        let shown = integer::show(image, options, false)?;
        let colour = if shown.channels == 1 { ExtendedColorType::L8 } else { ExtendedColorType::Rgb8 };
        let mut out = Vec::new();
        JpegEncoder::new_with_quality(&mut out, options.quality.clamp(1, 100))
            .write_image(&shown.bytes(), shown.width, shown.height, colour)
            .map_err(|e| e.to_string())?;
        Ok(out)
    }),
};

fn decoder<'a>(bytes: &'a [u8], at: &Place) -> Result<JpegDecoder<Cursor<&'a [u8]>>, Error> {
    let decoder = JpegDecoder::new(Cursor::new(bytes)).map_err(|e| Error::invalid(at.clone(), damaged(e)))?;
    // The decoder paints grey what is missing. Within the data of a scan neither marker can stand.
    let last = |marker: &[u8]| bytes.windows(2).rposition(|w| w == marker);
    if last(b"\xff\xd9") < last(b"\xff\xda") {
        return Err(Error::invalid(at.clone(), damaged("it ends before its end marker")));
    }
    Ok(decoder)
}

/// Width and height, 1 channel (grey) or 3, and the bytes as they are coded: a quarter of an image of floats.
pub fn codes(bytes: &[u8], options: &ReadOptions, at: &Place) -> Result<([usize; 2], usize, Vec<u8>), Error> {
    let decoder = decoder(bytes, at)?;
    let channels = match decoder.color_type() {
        ColorType::L8 => 1,
        ColorType::Rgb8 => 3,
        other => {
            return Err(Error::invalid(at.clone(), format!("samples of type {other:?} are not supported")));
        }
    };
    let (size, codes) = integer::samples(decoder, channels, options, at)?;
    Ok((size, channels, codes))
}
