//! Tiny neural encodings of isotropic BRDFs: Sztrajman et al. 2021, "Neural BRDF Representation and Importance Sampling".
//!
//! A file is a row of materials of 675 little-endian `f32` each: weights and biases of the layers 6 → 21 → 21 → 3,
//! weights with the input slowest. The input is h and the difference vector in the Rusinkiewicz frame with φ_h = 0;
//! both inner layers are rectified, and f = max(exp(output) − 1, 0), linear sRGB. The names stand in a text file
//! beside it, a line each: `merl.names.txt` for `merl.f32`.

use crate::{Error, Place};
use glam::Vec3;
use std::path::Path;
use yugen_optics::frame::spherical;
use yugen_reflectance::merl::tabulate_angles;

const IN: usize = 6;
const HIDDEN: usize = 21;
const OUT: usize = 3;
/// Numbers of a material.
pub const WEIGHTS: usize = (IN + 1) * HIDDEN + (HIDDEN + 1) * HIDDEN + (HIDDEN + 1) * OUT;

/// One material.
#[derive(Clone, Debug, PartialEq)]
pub struct NeuralBrdf(Vec<f32>);

/// A layer with its biases: the weights of one input after the other.
fn layer<const N: usize, const M: usize>(weights: &[f32], x: &[f32; N]) -> [f32; M] {
    let (weights, biases) = weights.split_at(N * M);
    let mut y: [f32; M] = std::array::from_fn(|j| biases[j]);
    for (x, row) in x.iter().zip(weights.chunks_exact(M)) {
        y.iter_mut().zip(row).for_each(|(y, w)| *y += x * w);
    }
    y
}

impl NeuralBrdf {
    /// f in 1/sr, linear sRGB, at Rusinkiewicz angles in radians.
    pub fn eval(&self, theta_h: f32, theta_d: f32, phi_d: f32) -> Vec3 {
        let (h, d) = (spherical(theta_h, 0.0), spherical(theta_d, phi_d));
        let (first, rest) = self.0.split_at((IN + 1) * HIDDEN);
        let (second, third) = rest.split_at((HIDDEN + 1) * HIDDEN);
        let x = layer::<IN, HIDDEN>(first, &[h.x, h.y, h.z, d.x, d.y, d.z]).map(|v| v.max(0.0));
        let x = layer::<HIDDEN, HIDDEN>(second, &x).map(|v| v.max(0.0));
        Vec3::from_array(layer::<HIDDEN, OUT>(third, &x).map(|v| v.exp_m1().max(0.0)))
    }

    /// As a MERL table in the order of [`yugen_reflectance::merl::VALUES`], linear sRGB, −1 below the horizon.
    pub fn tabulate(&self) -> Vec<f32> {
        tabulate_angles(|[h, d, p], _, _| self.eval(h, d, p))
    }
}

/// All materials of a file.
pub fn read(bytes: &[u8], file: &Path) -> Result<Vec<NeuralBrdf>, Error> {
    let size = 4 * WEIGHTS;
    if bytes.is_empty() || !bytes.len().is_multiple_of(size) {
        return Err(Error::invalid(
            Place::byte(file, bytes.len() as u64),
            format!("has {} bytes; expected a multiple of {size}, {WEIGHTS} numbers a material", bytes.len()),
        ));
    }
    let (numbers, _) = bytes.as_chunks::<4>();
    let numbers: Vec<f32> = numbers.iter().map(|b| f32::from_le_bytes(*b)).collect();
    if let Some(bad) = numbers.iter().position(|v| !v.is_finite()) {
        let problem = format!("the weight is {}; expected a finite number", numbers[bad]);
        return Err(Error::invalid(Place::byte(file, 4 * bad as u64), problem));
    }
    Ok(numbers.chunks_exact(WEIGHTS).map(|w| NeuralBrdf(w.to_vec())).collect())
}

/// The names of `count` materials, a line each, fit for names of files.
pub fn read_names(bytes: &[u8], file: &Path, count: usize) -> Result<Vec<String>, Error> {
    let text = String::from_utf8_lossy(bytes);
    let names: Vec<String> = text.lines().map(|l| l.trim().to_string()).filter(|l| !l.is_empty()).collect();
    if names.len() != count {
        let problem = format!("has {} names; expected {count}, a line for each material", names.len());
        return Err(Error::invalid(Place::file(file), problem));
    }
    let unfit = |n: &String| n.starts_with('.') || n.contains(['/', '\\', ':', '\0']);
    if let Some(i) = names.iter().position(unfit) {
        return Err(Error::invalid(
            Place::line(file, i + 1, 1),
            format!("'{}' cannot be the name of a file", names[i].escape_debug()),
        ));
    }
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_and_their_order_are_those_of_the_format() {
        // Hidden unit 2 takes h.z + 0.5, unit 5 of the next layer twice that; green is its exponential less one.
        let mut w = vec![0.0f32; WEIGHTS];
        (w[2 * HIDDEN + 2], w[IN * HIDDEN + 2]) = (1.0, 0.5);
        let second = (IN + 1) * HIDDEN;
        w[second + 2 * HIDDEN + 5] = 2.0;
        let third = second + (HIDDEN + 1) * HIDDEN;
        (w[third + 5 * OUT + 1], w[third + HIDDEN * OUT + 2]) = (0.1, -3.0);
        let bytes: Vec<u8> = w.iter().flat_map(|v| v.to_le_bytes()).collect();
        let all = read(&[bytes.clone(), bytes.clone()].concat(), Path::new("a.f32")).unwrap();
        assert_eq!(all.len(), 2);
        let f = all[1].eval(0.7, 0.3, 1.0);
        let want = (0.2 * (0.7f32.cos() + 0.5)).exp_m1();
        assert!(f.x == 0.0 && f.z == 0.0 && (f.y / want - 1.0).abs() < 1e-6, "{f}");

        let error = |b: &[u8]| read(b, Path::new("a.f32")).unwrap_err().to_string();
        assert!(error(&bytes[1..]).contains("has 2699 bytes; expected a multiple of 2700"));
        assert!(error(&[]).contains("has 0 bytes"));
        let mut broken = bytes;
        broken[40..44].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(error(&broken).contains("a.f32, byte 40: the weight is NaN"));
        let names = |text: &str, n| read_names(text.as_bytes(), Path::new("n"), n).map_err(|e| e.to_string());
        assert_eq!(names("gold\n\n silk \n", 2).unwrap(), ["gold", "silk"]);
        assert!(names("gold", 2).unwrap_err().contains("has 1 names; expected 2"));
        assert!(names("gold\n../x", 2).unwrap_err().contains("n:2:1: '../x' cannot be"));
    }
}
