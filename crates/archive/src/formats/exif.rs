//! What a camera writes beside a picture: how long it was exposed, and what else changes its brightness.

use crate::{Error, open};
use ::exif::{In, Reader, Tag, Value};
use std::io::{BufReader, Read};
use std::path::Path;

/// The settings of a camera, as far as the file tells them.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Settings {
    /// Exposure time.
    pub seconds: Option<f32>,
    /// Aperture as an f-number.
    pub f_number: Option<f32>,
    /// Sensitivity, ISO.
    pub iso: Option<u32>,
}

/// A file of 1 GiB is no photograph.
const MAX_FILE: u64 = 1 << 30;

/// The settings of a JPEG, TIFF, PNG or WebP; nothing is known where a file has no Exif data or damaged ones.
pub fn read(path: &Path) -> Result<Settings, Error> {
    let mut bytes = Vec::new();
    BufReader::new(open(path)?).take(MAX_FILE).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    Ok(read_bytes(&bytes))
}

/// As [`read`], from memory.
pub fn read_bytes(bytes: &[u8]) -> Settings {
    let Ok(exif) = Reader::new().read_from_container(&mut std::io::Cursor::new(bytes)) else {
        return Settings::default();
    };
    let ratio = |tag| match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Rational(v) => v.first().map(|r| r.to_f64() as f32).filter(|v| v.is_finite() && *v > 0.0),
        _ => None,
    };
    Settings {
        seconds: ratio(Tag::ExposureTime),
        f_number: ratio(Tag::FNumber),
        iso: exif.get_field(Tag::PhotographicSensitivity, In::PRIMARY).and_then(|f| f.value.get_uint(0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A JPEG without a picture, its Exif segment made by hand after the standard (CIPA DC-008).
    fn jpeg() -> Vec<u8> {
        let mut tiff = b"II*\0\x08\0\0\0".to_vec();
        let mut directory = |entries: &[(u16, u16, u32, u32)]| {
            tiff.extend((entries.len() as u16).to_le_bytes());
            for &(tag, kind, count, value) in entries {
                tiff.extend(tag.to_le_bytes());
                tiff.extend(kind.to_le_bytes());
                tiff.extend(count.to_le_bytes());
                tiff.extend(value.to_le_bytes());
            }
            tiff.extend(0u32.to_le_bytes());
        };
        // The second directory starts at 8 + 18 and is 42 bytes long.
        directory(&[(0x8769, 4, 1, 26)]);
        directory(&[(0x829a, 5, 1, 68), (0x829d, 5, 1, 76), (0x8827, 3, 1, 400)]);
        for v in [1u32, 60, 56, 10] {
            tiff.extend(v.to_le_bytes());
        }
        let mut out = b"\xff\xd8\xff\xe1".to_vec();
        out.extend((tiff.len() as u16 + 8).to_be_bytes());
        out.extend(b"Exif\0\0");
        out.extend(tiff);
        out.extend(b"\xff\xd9");
        out
    }

    #[test]
    fn times_are_found_and_damage_does_no_harm() {
        let bytes = jpeg();
        let want = Settings { seconds: Some(1.0 / 60.0), f_number: Some(5.6), iso: Some(400) };
        assert_eq!(read_bytes(&bytes), want);
        for n in 0..bytes.len() {
            let _ = read_bytes(&bytes[..n]);
            for value in [0, 0xff] {
                let mut broken = bytes.clone();
                broken[n] = value;
                let _ = read_bytes(&broken);
            }
        }
        assert_eq!(read_bytes(b"no picture"), Settings::default());
    }
}
