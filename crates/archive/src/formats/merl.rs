//! MERL `.binary`: 90 × 90 × 180 bins of θ_h (equal in its root), θ_d, φ_d, as planes of red, green, blue.
//!
//! Three little-endian `i32` (the bin counts), then three planes of little-endian `f64`. The planes carry factors
//! of their own; a negative value marks a direction that was not measured. Matusik et al. 2003.

use crate::{Error, Place};
use glam::Vec3;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_reflectance::merl::{PHI_D, THETA_D, THETA_H, VALUES};

/// What turns stored numbers into 1/sr, per channel: as in the reader that comes with the database.
pub const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];
/// Bytes of the header.
const HEADER: usize = 12;
/// Bins.
const BINS: usize = THETA_H * THETA_D * PHI_D;
/// Bytes of a file.
pub const BYTES: usize = HEADER + 3 * BINS * 8;

/// The values of a file as `merl` bakes them: bin by bin, RGB in `space`, −1 where nothing was measured. The
/// colours of the database are taken as linear sRGB.
pub fn read(bytes: &[u8], file: &Path, space: ColourSpace) -> Result<Vec<f32>, Error> {
    let Some((header, planes)) = bytes.split_first_chunk::<HEADER>() else {
        return Err(Error::invalid(
            Place::byte(file, bytes.len() as u64),
            format!(
                "a MERL file starts with three bin counts of 4 bytes each, but this one has {} bytes",
                bytes.len()
            ),
        ));
    };
    let counts: Vec<i32> =
        header.chunks_exact(4).map(|c| i32::from_le_bytes([c[0], c[1], c[2], c[3]])).collect();
    if counts != [THETA_H as i32, THETA_D as i32, PHI_D as i32] {
        return Err(Error::invalid(
            Place::byte(file, 0),
            format!(
                "a MERL file counts {THETA_H}, {THETA_D} and {PHI_D} bins, but this one says {}, {} and {}; \
                 it is not a MERL file, or of another resolution",
                counts[0], counts[1], counts[2]
            ),
        ));
    }
    if bytes.len() != BYTES {
        return Err(Error::invalid(
            Place::byte(file, bytes.len() as u64),
            format!("a MERL file has {BYTES} bytes, but this one has {}; fetch it again", bytes.len()),
        ));
    }
    let (stored, _) = planes.as_chunks::<8>();
    let to_space = ColourSpace::LinearSrgb.matrix_to(space);
    let mut values = Vec::with_capacity(VALUES);
    for bin in 0..BINS {
        let mut rgb = Vec3::ZERO;
        for (c, scale) in SCALE.iter().enumerate() {
            let at = c * BINS + bin;
            let v = f64::from_le_bytes(stored[at]) * scale;
            if !(v as f32).is_finite() {
                return Err(Error::invalid(
                    Place::byte(file, (HEADER + 8 * at) as u64),
                    format!("the value is {}; expected a finite number", f64::from_le_bytes(stored[at])),
                ));
            }
            rgb[c] = v as f32;
        }
        // Test for invalid before the colours mix.
        let rgb = if rgb.min_element() < 0.0 { Vec3::NEG_ONE } else { (to_space * rgb).max(Vec3::ZERO) };
        values.extend(rgb.to_array());
    }
    Ok(values)
}

/// The bins from `first` of a file into `rgb`, three numbers each, linear sRGB, negative where nothing was measured:
/// for work that must not hold whole tables.
///
/// # Panics
/// Where the bins go beyond the table.
pub fn read_bins(file: &Path, first: usize, rgb: &mut [f32]) -> Result<(), Error> {
    let count = rgb.len() / 3;
    assert!(first + count <= BINS);
    let io = |e| Error::io(file, e);
    let mut open = crate::open(file)?;
    let size = open.metadata().map_err(io)?.len();
    let mut header = [0; HEADER];
    if size == BYTES as u64 {
        open.read_exact(&mut header).map_err(io)?;
    }
    let (counts, _) = header.as_chunks::<4>();
    if counts.iter().map(|c| i32::from_le_bytes(*c)).ne([THETA_H as i32, THETA_D as i32, PHI_D as i32]) {
        return Err(Error::invalid(
            Place::file(file),
            format!(
                "a MERL file has {BYTES} bytes and counts {THETA_H}, {THETA_D} and {PHI_D} bins; this one does not"
            ),
        ));
    }
    let mut bytes = vec![0; 8 * count];
    for (c, scale) in SCALE.iter().enumerate() {
        let at = (HEADER + 8 * (c * BINS + first)) as u64;
        open.seek(SeekFrom::Start(at)).map_err(io)?;
        open.read_exact(&mut bytes).map_err(io)?;
        let (stored, _) = bytes.as_chunks::<8>();
        for (to, v) in rgb.chunks_exact_mut(3).zip(stored) {
            to[c] = (f64::from_le_bytes(*v) * scale) as f32;
        }
    }
    Ok(())
}

/// The bytes of a file with `values` as [`read`] returns them, colours in `space`.
///
/// # Panics
/// Unless there are [`VALUES`] of them.
pub fn write(values: &[f32], space: ColourSpace) -> Vec<u8> {
    assert_eq!(values.len(), VALUES, "a MERL table has 90 x 90 x 180 bins of RGB");
    let from_space = space.matrix_to(ColourSpace::LinearSrgb);
    let mut bytes = Vec::with_capacity(BYTES);
    for count in [THETA_H, THETA_D, PHI_D] {
        bytes.extend((count as i32).to_le_bytes());
    }
    for (c, scale) in SCALE.iter().enumerate() {
        for rgb in values.chunks_exact(3).map(Vec3::from_slice) {
            // Colours outside sRGB are cut at zero: negative means "not measured" here.
            let v = if rgb.min_element() < 0.0 { -1.0 } else { (from_space * rgb)[c].max(0.0) };
            bytes.extend((f64::from(v) / scale).to_le_bytes());
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::neural_brdf;
    use yugen_optics::frame::spherical;
    use yugen_reflectance::merl::bin_centre;
    use yugen_reflectance::{Bsdf, Kind};

    fn text(bytes: &[u8]) -> String {
        read(bytes, Path::new("a.binary"), ColourSpace::LinearSrgb).unwrap_err().to_string()
    }

    #[test]
    fn bad_files_get_a_sentence() {
        assert_eq!(
            text(&[90, 0, 0]),
            "a.binary, byte 3: a MERL file starts with three bin counts of 4 bytes each, but this one has 3 bytes"
        );
        let mut bytes: Vec<u8> = [90i32, 90, 180].iter().flat_map(|v| v.to_le_bytes()).collect();
        assert!(text(&bytes).contains("has 34992012 bytes, but this one has 12; fetch it again"));
        bytes[3] = 0x7f;
        assert!(text(&bytes).contains("says 2130706522, 90 and 180"));
        bytes[3] = 0;
        bytes.resize(BYTES, 0);
        let at = HEADER + 8 * (BINS + 7);
        bytes[at..at + 8].copy_from_slice(&f64::NAN.to_le_bytes());
        assert!(text(&bytes).contains(&format!("byte {at}: the value is NaN")));
        bytes[at..at + 8].copy_from_slice(&1e300f64.to_le_bytes());
        assert!(text(&bytes).contains("expected a finite number"));
        bytes.push(0);
        assert!(text(&bytes).contains("this one has 34992013"));
    }

    #[test]
    fn planes_scales_and_invalid_bins_are_where_the_format_has_them() {
        let mut bytes: Vec<u8> = [90i32, 90, 180].iter().flat_map(|v| v.to_le_bytes()).collect();
        bytes.resize(BYTES, 0);
        // Bin (θ_h 2, θ_d 3, φ_d 5) of green is 5 + 180·3 + 180·90·2 of the second plane.
        let bin = 5 + 180 * 3 + 180 * 90 * 2;
        let at = HEADER + 8 * (BINS + bin);
        bytes[at..at + 8].copy_from_slice(&300f64.to_le_bytes());
        let at = HEADER + 8 * (2 * BINS + bin + 1);
        bytes[at..at + 8].copy_from_slice(&(-3f64).to_le_bytes());
        let values = read(&bytes, Path::new("a"), ColourSpace::LinearSrgb).unwrap();
        assert_eq!(values[3 * bin..3 * bin + 6], [0.0, 0.23, 0.0, -1.0, -1.0, -1.0]);
    }

    #[test]
    fn a_whole_measurement_goes_out_and_comes_back() {
        let Some(data) = std::env::var_os("YUGEN_DATA") else {
            assert!(std::env::var_os("CI").is_none(), "YUGEN_DATA must name the data folder in CI");
            println!("skipped: YUGEN_DATA is not set");
            return;
        };
        let folder = Path::new(&data).join("brdf");
        let names = std::fs::read_to_string(folder.join("merl.names.txt")).unwrap();
        let index = names.lines().position(|n| n == "blue-metallic-paint").unwrap();
        let file = folder.join("merl.f32");
        let material = neural_brdf::read(&std::fs::read(&file).unwrap(), &file).unwrap().swap_remove(index);
        let values = material.tabulate();
        let bytes = write(&values, ColourSpace::LinearSrgb);
        assert_eq!(bytes.len(), 34_992_012);
        let back = read(&bytes, Path::new("blue-metallic-paint.binary"), ColourSpace::LinearSrgb).unwrap();
        // A part of the file is the same as that part of all of it.
        let path = std::env::temp_dir().join(format!("yugen-bins-{}.binary", std::process::id()));
        std::fs::write(&path, &bytes).unwrap();
        let mut part = vec![0.0; 3 * 1000];
        read_bins(&path, 700_000, &mut part).unwrap();
        let same = |(a, b): (&f32, &f32)| a == b || (*a < 0.0 && *b < 0.0);
        assert!(part.iter().zip(&back[3 * 700_000..]).all(same));
        std::fs::write(&path, &bytes[..99]).unwrap();
        assert!(read_bins(&path, 0, &mut part).unwrap_err().to_string().contains("34992012 bytes"));
        std::fs::remove_file(&path).unwrap();
        // Two roundings of the scale in f64 and one to f32.
        assert!(values.iter().zip(&back).all(|(a, b)| (a - b).abs() <= 1.2e-7 * a.abs()));

        let slots = Kind::Merl.defaults();
        let table = Kind::Merl.bake(&slots, &back).unwrap();
        let bsdf = Bsdf::new(Kind::Merl, &slots, &table);
        let mut seen = 0;
        for (h, d, p) in [(0, 10, 3), (5, 30, 60), (11, 2, 179), (40, 20, 90), (70, 10, 45)] {
            let [th, td, pd] = bin_centre(h, d, p);
            let (wo, wi) = yugen_reflectance::importance::from_rusinkiewicz(th, td, pd);
            let (got, want) = (bsdf.eval(wo, wi), material.eval(th, td, pd));
            // The angles of a bin's centre are found again to about 1e-6; the highlight is the steepest place.
            assert!(
                (got - want).abs().max_element() <= 2e-4 * want.max_element(),
                "{h} {d} {p}: {got} {want}"
            );
            seen += usize::from(want.max_element() > 0.01);
        }
        assert!(seen >= 3);

        // Blue, and brightest near the mirror direction.
        let wo = spherical(0.6, 0.0);
        let lobe = |offset: f32| bsdf.eval(wo, spherical(0.6 + offset, std::f32::consts::PI));
        assert!(
            lobe(0.0).z > 2.0 * lobe(0.0).x && lobe(0.0).z > 4.0 * lobe(0.7).z,
            "{} {}",
            lobe(0.0),
            lobe(0.7)
        );

        // The density integrates to one less what falls below the horizon, and draws agree with quadrature.
        let mut rng = yugen_optics::random::Pcg32::new(4, 4);
        for theta in [0.2, 1.0, 1.4] {
            let wo = spherical(theta, 0.7);
            let n = 20_000;
            let (mut drawn, mut albedo) = (0, 0.0f64);
            for _ in 0..n {
                if let Some(s) = bsdf.sample(wo, rng.next_vec3()) {
                    drawn += 1;
                    albedo += f64::from(s.weight.z) / f64::from(n);
                }
            }
            let (mut mass, mut want) = (0.0, 0.0);
            // Around the mirror direction the lobe is narrow: √θ_h steps, as the table has them.
            let cells = 256;
            for a in 0..cells {
                for b in 0..cells {
                    let u = (a as f64 + 0.5) / cells as f64;
                    let theta_h = (u * u) as f32 * std::f32::consts::FRAC_PI_2;
                    let h = spherical(theta_h, (b as f32 + 0.5) / cells as f32 * std::f32::consts::TAU);
                    let wi = 2.0 * wo.dot(h) * h - wo;
                    if wo.dot(h) > 0.0 && wi.z > 0.0 {
                        let dw = 4.0 * wo.dot(h) * theta_h.sin();
                        let dw = f64::from(dw) * std::f64::consts::PI * u * std::f64::consts::TAU
                            / f64::from(cells * cells);
                        mass += f64::from(bsdf.pdf(wo, wi)) * dw;
                        want += f64::from(bsdf.eval(wo, wi).z * wi.z) * dw;
                    }
                }
            }
            // Measured: 3e-3 (the quadrature at grazing angles) and 9e-4.
            assert!((mass - f64::from(drawn) / f64::from(n)).abs() < 0.01, "{theta}: {mass} {drawn}");
            assert!((albedo / want - 1.0).abs() < 4e-3, "{theta}: {albedo} {want}");
        }
    }
}
