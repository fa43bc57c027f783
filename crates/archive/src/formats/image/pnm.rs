//! Netpbm: PBM, PGM, PPM and PAM, as text and binary, 8 and 16 bits; read only.

use super::{Codec, damaged, integer};
use crate::Error;
use crate::formats::support::Support;
use ::image::codecs::pnm::PnmDecoder;
use std::io::Cursor;

pub const CODEC: Codec = Codec {
    name: "PNM",
    extensions: &["pnm", "pbm", "pgm", "ppm", "pam"],
    support: Support::Partly("no PFM"),
    recognises: |bytes| matches!(bytes, [b'P', b'1'..=b'7', b' ' | b'\t' | b'\n' | b'\r', ..]),
    decode: |bytes, options, at| {
        let decoder =
            PnmDecoder::new(Cursor::new(bytes)).map_err(|e| Error::invalid(at.clone(), damaged(e)))?;
        integer::decode(decoder, options, at)
    },
    encode: None,
};
