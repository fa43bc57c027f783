//! PNG, 8 and 16 bits (ISO/IEC 15948).

use super::{Codec, damaged, integer};
use crate::Error;
use crate::formats::support::Support;
use ::image::codecs::png::{PngDecoder, PngEncoder};
use ::image::{ExtendedColorType, ImageEncoder, Limits};
use std::io::Cursor;

pub const CODEC: Codec = Codec {
    name: "PNG",
    extensions: &["png"],
    support: Support::Partly("embedded profiles are not looked at"),
    recognises: |bytes| bytes.starts_with(b"\x89PNG\r\n\x1a\n"),
    decode: |bytes, options, at| {
        let mut limits = Limits::default();
        // Before the size is known: what text chunks and profiles may take.
        limits.max_alloc = Some(1 << 26);
        let decoder = PngDecoder::with_limits(Cursor::new(bytes), limits)
            .map_err(|e| Error::invalid(at.clone(), damaged(e)))?;
        integer::decode(decoder, options, at)
    },
    encode: Some(|image, options| {
        let shown = integer::show(image, options, true)?;
        let (bytes, types) = match options.bits {
            8 => (
                shown.bytes(),
                [
                    ExtendedColorType::L8,
                    ExtendedColorType::La8,
                    ExtendedColorType::Rgb8,
                    ExtendedColorType::Rgba8,
                ],
            ),
            16 => (
                shown.words(),
                [
                    ExtendedColorType::L16,
                    ExtendedColorType::La16,
                    ExtendedColorType::Rgb16,
                    ExtendedColorType::Rgba16,
                ],
            ),
            other => return Err(format!("PNG cannot be written with {other} bits; expected 8 or 16")),
        };
        let mut out = Vec::new();
        PngEncoder::new(&mut out)
            .write_image(&bytes, shown.width, shown.height, types[shown.channels - 1])
            .map_err(|e| e.to_string())?;
        Ok(out)
    }),
};
