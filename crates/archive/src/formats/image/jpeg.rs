//! JPEG (ISO/IEC 10918), 8 bits.

use super::{Codec, damaged, integer};
use crate::Error;
use crate::formats::support::Support;
use ::image::codecs::jpeg::{JpegDecoder, JpegEncoder};
use ::image::{ExtendedColorType, ImageEncoder};
use std::io::Cursor;

pub const CODEC: Codec = Codec {
    name: "JPEG",
    extensions: &["jpg", "jpeg"],
    support: Support::Partly("embedded profiles are not looked at; no 12 bits"),
    recognises: |bytes| bytes.starts_with(b"\xff\xd8\xff"),
    decode: |bytes, options, at| {
        let decoder =
            JpegDecoder::new(Cursor::new(bytes)).map_err(|e| Error::invalid(at.clone(), damaged(e)))?;
        // The decoder paints grey what is missing. Within the data of a scan neither marker can stand.
        let last = |marker: &[u8]| bytes.windows(2).rposition(|w| w == marker);
        if last(b"\xff\xd9") < last(b"\xff\xda") {
            return Err(Error::invalid(at.clone(), damaged("it ends before its end marker")));
        }
        integer::decode(decoder, options, at)
    },
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
