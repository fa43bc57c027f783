//! What a camera writes beside a picture: how long it was exposed, what else changes its brightness, and the focal length.

use crate::{Error, open};
use ::exif::{In, Reader, Tag, Value};
use std::io::{BufRead, BufReader, Seek};
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
    /// Focal length in millimetres of a camera for 35 mm film that shows as much, after the diagonal.
    pub focal_35mm: Option<f32>,
    /// Pixels across and down as the camera took them: of a picture that was cropped since, these are others.
    pub taken: Option<[u32; 2]>,
}

/// The diagonal of 35 mm film, 36 mm by 24 mm.
const DIAGONAL: f32 = 43.266_6;

impl Settings {
    /// How far the camera stood from what it was focused on, in widths of a picture of this size, taken that the lens is
    /// thin and the scale well below 1: focal length over width of the sensor. `None` where that is not told, or the
    /// picture has other proportions than the one that was taken.
    pub fn distance(&self, width: usize, height: usize) -> Option<f32> {
        let [w, h] = [width, height].map(|v| v as f32);
        // Orientation may have turned it.
        let proportion = |w: f32, h: f32| w.max(h) / w.min(h);
        let cropped = self
            .taken
            .is_some_and(|[x, y]| (proportion(x as f32, y as f32) / proportion(w, h) - 1.0).abs() > 0.01);
        self.focal_35mm.filter(|_| !cropped && w > 0.0 && h > 0.0).map(|f| f / DIAGONAL * w.hypot(h) / w)
    }

    /// By what factor a photograph of these settings is brighter than one of `other`, by time, aperture and sensitivity, of
    /// those that both tell.
    pub fn brighter_than(&self, other: &Self) -> f32 {
        let ratio = |of: fn(&Self) -> Option<f32>| of(self).zip(of(other)).map_or(1.0, |(a, b)| a / b);
        ratio(|s| s.seconds) * ratio(|s| s.iso.map(|i| i as f32)) / ratio(|s| s.f_number).powi(2)
    }
}

/// A file of 1 GiB is no photograph.
const MAX_FILE: u64 = 1 << 30;

/// The settings of a JPEG, TIFF, PNG or WebP; nothing is known where a file has no Exif data or damaged ones.
pub fn read(path: &Path) -> Result<Settings, Error> {
    let file = open(path)?;
    if file.metadata().map_err(|e| Error::io(path, e))?.len() > MAX_FILE {
        return Ok(Settings::default());
    }
    // Of a JPEG only the beginning is read.
    Ok(settings(&mut BufReader::new(file)))
}

/// As [`read`], from memory.
pub fn read_bytes(bytes: &[u8]) -> Settings {
    settings(&mut std::io::Cursor::new(bytes))
}

fn settings(from: &mut (impl BufRead + Seek)) -> Settings {
    let Ok(exif) = Reader::new().read_from_container(from) else {
        return Settings::default();
    };
    let ratio = |tag| match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Rational(v) => v.first().map(|r| r.to_f64() as f32).filter(|v| v.is_finite() && *v > 0.0),
        _ => None,
    };
    let whole = |tag| exif.get_field(tag, In::PRIMARY)?.value.get_uint(0).filter(|v| *v > 0);
    Settings {
        seconds: ratio(Tag::ExposureTime),
        f_number: ratio(Tag::FNumber),
        // Nought is what cameras write that do not tell.
        iso: exif
            .get_field(Tag::PhotographicSensitivity, In::PRIMARY)
            .and_then(|f| f.value.get_uint(0))
            .filter(|iso| *iso > 0),
        focal_35mm: whole(Tag::FocalLengthIn35mmFilm).map(|f| f as f32),
        taken: whole(Tag::PixelXDimension).zip(whole(Tag::PixelYDimension)).map(|(w, h)| [w, h]),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The Exif segment of a JPEG, made by hand after the standard (CIPA DC-008): a picture of 6000 x 4000 pixels by a lens
    /// as of 50 mm.
    pub(crate) fn segment() -> Vec<u8> {
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
        // The second directory starts at 8 + 18 and is 78 bytes long.
        directory(&[(0x8769, 4, 1, 26)]);
        directory(&[
            (0x829a, 5, 1, 104),
            (0x829d, 5, 1, 112),
            (0x8827, 3, 1, 400),
            (0xa002, 4, 1, 6000),
            (0xa003, 4, 1, 4000),
            (0xa405, 3, 1, 50),
        ]);
        for v in [1u32, 60, 56, 10] {
            tiff.extend(v.to_le_bytes());
        }
        let mut out = b"\xff\xe1".to_vec();
        out.extend((tiff.len() as u16 + 8).to_be_bytes());
        out.extend(b"Exif\0\0");
        out.extend(tiff);
        out
    }

    /// Without a picture.
    fn jpeg() -> Vec<u8> {
        [&b"\xff\xd8"[..], &segment(), b"\xff\xd9"].concat()
    }

    #[test]
    fn times_are_found_and_damage_does_no_harm() {
        let bytes = jpeg();
        let want = Settings {
            seconds: Some(1.0 / 60.0),
            f_number: Some(5.6),
            iso: Some(400),
            focal_35mm: Some(50.0),
            taken: Some([6000, 4000]),
        };
        assert_eq!(read_bytes(&bytes), want);
        // As wide as film: 50 mm over 36 mm; upright over 24 mm; cropped: not known.
        let distance = |w, h| want.distance(w, h);
        assert!((distance(1500, 1000).unwrap() - 50.0 / 36.0).abs() < 1e-4);
        assert!((distance(1000, 1500).unwrap() - 50.0 / 24.0).abs() < 1e-4);
        assert_eq!((distance(1000, 1000), Settings::default().distance(3, 2)), (None, None));
        // Twice the time, half the sensitivity, a stop less of aperture; what one of them does not tell is alike.
        let other =
            Settings { seconds: Some(1.0 / 30.0), iso: Some(200), f_number: Some(5.6 * 2f32.sqrt()), ..want };
        assert!((other.brighter_than(&want) - 0.5).abs() < 1e-5);
        assert!((Settings { iso: None, ..other }.brighter_than(&want) - 1.0).abs() < 1e-5);
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
