//! Truevision Targa (TGA); read only.

use super::{Codec, damaged, integer};
use crate::Error;
use crate::formats::support::Support;
use ::image::codecs::tga::TgaDecoder;
use std::io::Cursor;

pub const CODEC: Codec = Codec {
    name: "TGA",
    extensions: &["tga", "targa", "icb", "vda", "vst"],
    support: Support::Yes,
    // The first version of the format has no mark; the second has it at the end, which a look at the beginning of a
    // large file does not see.
    recognises: |bytes| bytes.ends_with(b"TRUEVISION-XFILE.\0"),
    decode: |bytes, options, at| {
        let decoder =
            TgaDecoder::new(Cursor::new(bytes)).map_err(|e| Error::invalid(at.clone(), damaged(e)))?;
        integer::decode(decoder, options, at)
    },
    encode: None,
};
