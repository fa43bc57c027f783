//! UTIA `.bin`: anisotropic BRDFs every 15 degrees of polar angle by 7.5 of azimuth, Filip and Vávra 2014,
//! "Template-Based Sampling of Anisotropic BRDFs".
//!
//! Planes of red, green, blue, each 288 × 288 little-endian `f64`: rows are directions of the light, columns of the
//! eye, both θ = 0, 15 … 75 by φ = 0, 7.5 … 352.5 degrees, φ fastest. There is no header: the size tells.
//!
//! The database does not state a unit. Its numbers are taken as f in 1/sr of linear sRGB, as its own reader returns
//! them; where they are in another, the parameter `scale` of the model `tabulated` is for it.

use super::{Measurement, Reading, bands};
use crate::{Error, Place};
use glam::Vec3;
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_optics::frame::spherical;

/// Polar angles.
const THETA: usize = 6;
/// Azimuths.
const PHI: usize = 48;
/// Directions of the light, and as many of the eye.
const SIDE: usize = THETA * PHI;
/// Bytes of a file.
pub const BYTES: usize = 3 * SIDE * SIDE * 8;

/// The readings of a file, colours in `space`.
pub fn read(bytes: &[u8], file: &Path, space: ColourSpace) -> Result<Measurement, Error> {
    if bytes.len() != BYTES {
        let problem =
            format!("a UTIA file has {BYTES} bytes, but this one has {}; fetch it again", bytes.len());
        return Err(Error::invalid(Place::byte(file, bytes.len() as u64), problem));
    }
    let (stored, _) = bytes.as_chunks::<8>();
    let to_space = ColourSpace::LinearSrgb.matrix_to(space);
    let theta = [0.0f32, 15.0, 30.0, 45.0, 60.0, 75.0];
    let share = bands(&theta, 90.0);
    let direction = |i: usize| {
        let (t, p) = (i / PHI, i % PHI);
        (spherical(theta[t].to_radians(), (7.5 * p as f32).to_radians()), share[t] / PHI as f32)
    };
    let all: Vec<(Vec3, f32)> = (0..SIDE).map(direction).collect();
    let mut readings = Vec::with_capacity(SIDE * SIDE);
    for (i, (wi, light)) in all.iter().enumerate() {
        for (o, (wo, eye)) in all.iter().enumerate() {
            let mut rgb = Vec3::ZERO;
            for c in 0..3 {
                let at = (c * SIDE + i) * SIDE + o;
                let v = f64::from_le_bytes(stored[at]);
                if !(v as f32).is_finite() {
                    let problem = format!("the value is {v}; expected a finite number");
                    return Err(Error::invalid(Place::byte(file, 8 * at as u64), problem));
                }
                rgb[c] = v.max(0.0) as f32;
            }
            let f = (to_space * rgb).max(Vec3::ZERO);
            readings.push(Reading { wi: *wi, wo: *wo, f, weight: light * eye });
        }
    }
    Measurement::new("UTIA BRDF", readings, None, Vec::new(), file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_1_PI;
    use yugen_reflectance::{Bsdf, Kind};

    const SRGB: ColourSpace = ColourSpace::LinearSrgb;

    fn of(f: impl Fn(Vec3, Vec3) -> Vec3) -> Vec<u8> {
        let direction =
            |i: usize| spherical(((i / 48 * 15) as f32).to_radians(), (7.5 * (i % 48) as f32).to_radians());
        let mut bytes = Vec::with_capacity(BYTES);
        for c in 0..3 {
            for i in 0..288 {
                for o in 0..288 {
                    bytes.extend(f64::from(f(direction(i), direction(o))[c]).to_le_bytes());
                }
            }
        }
        bytes
    }

    #[test]
    fn a_grain_comes_back_and_a_table_is_exact() {
        let f = |wi: Vec3, wo: Vec3| Vec3::new(0.2 + 0.1 * wi.x, 0.3 + 0.1 * wo.y, 0.1 + 0.05 * wi.y * wo.x);
        let m = read(&of(f), "a.bin".as_ref(), SRGB).unwrap();
        assert!(!m.isotropic);
        assert_eq!(m.readings.len(), 288 * 288);
        for r in m.readings.iter().step_by(97) {
            assert!((r.f - f(r.wi, r.wo)).abs().max_element() < 1e-6);
        }
        let slots = Kind::Tabulated.defaults();
        let table = Kind::Tabulated.bake(&slots, &m.table().to_data()).unwrap();
        let bsdf = Bsdf::new(Kind::Tabulated, &slots, &table);
        for r in m.readings.iter().step_by(53) {
            let got = bsdf.eval(r.wo, r.wi);
            assert!((got - r.f).abs().max_element() < 1e-5, "{r:?} {got}");
        }
    }

    #[test]
    fn a_lambertian_is_isotropic_and_keeps_its_albedo() {
        let m = read(&of(|_, _| Vec3::splat(0.5 * FRAC_1_PI)), "a.bin".as_ref(), ColourSpace::LinearRec2020)
            .unwrap();
        assert!(m.isotropic);
        assert!(m.readings.iter().all(|r| (r.f - 0.5 * FRAC_1_PI).abs().max_element() < 1e-6));
        let g = m.table();
        assert_eq!((g.phi_o.len(), g.theta_o.len(), g.phi_d.len()), (1, 6, 48));
        assert!(g.rgb.iter().all(|v| (v - 0.5 * FRAC_1_PI).abs() < 1e-6));
    }

    #[test]
    fn bad_files_get_a_sentence() {
        let told = |bytes: &[u8]| read(bytes, "a.bin".as_ref(), SRGB).unwrap_err().to_string();
        assert!(told(&[0; 9]).contains("a UTIA file has 1990656 bytes, but this one has 9; fetch it again"));
        let mut bytes = vec![0; BYTES];
        bytes[800..808].copy_from_slice(&f64::NAN.to_le_bytes());
        assert!(told(&bytes).contains("byte 800: the value is NaN"));
    }
}
