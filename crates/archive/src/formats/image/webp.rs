//! WebP (RFC 9649), lossy and lossless; read only.

use super::{Codec, integer};
use crate::Error;
use crate::formats::support::Support;
use ::image::codecs::webp::WebPDecoder;
use std::io::Cursor;

pub const CODEC: Codec = Codec {
    name: "WebP",
    extensions: &["webp"],
    support: Support::Partly("the first picture"),
    recognises: |bytes| bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP"),
    decode: |bytes, options, at| {
        let decoder =
            WebPDecoder::new(Cursor::new(bytes)).map_err(|e| Error::invalid(at.clone(), e.to_string()))?;
        integer::decode(decoder, options, at)
    },
    encode: None,
};
