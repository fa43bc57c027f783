//! Windows bitmaps (BMP); read only.

use super::{Codec, damaged, integer};
use crate::Error;
use crate::formats::support::Support;
use ::image::codecs::bmp::BmpDecoder;
use std::io::Cursor;

pub const CODEC: Codec = Codec {
    name: "BMP",
    extensions: &["bmp", "dib"],
    support: Support::Partly("no JPEG or PNG inside"),
    recognises: |bytes| bytes.starts_with(b"BM"),
    decode: |bytes, options, at| {
        let decoder =
            BmpDecoder::new(Cursor::new(bytes)).map_err(|e| Error::invalid(at.clone(), damaged(e)))?;
        integer::decode(decoder, options, at)
    },
    encode: None,
};
