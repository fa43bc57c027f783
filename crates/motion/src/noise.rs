//! Ken Perlin 2002, "Improving Noise" (ACM SIGGRAPH): gradient noise with a quintic fade, twelve gradients and the table of
//! his reference implementation; and its curl, a flow without sources: Bridson, Hourihan and Nordenstam 2007,
//! "Curl-Noise for Procedural Fluid Flow" (ACM SIGGRAPH).
//!
//! Noise is zero at points of whole numbers, lies within ±1 (in practice ±.9, standard deviation .27), has continuous
//! second derivatives and repeats after 256.

use glam::{DVec3, Vec3};

/// `noise` and `curl_noise` in WGSL, and the struct `Noise` that the former gives.
pub const NOISE_WGSL: &str = include_str!("noise.wgsl");

/// Perlin's permutation of 0 to 255.
const PERMUTATION: [u8; 256] = [
    151, 160, 137, 91, 90, 15, 131, 13, 201, 95, 96, 53, 194, 233, 7, 225, 140, 36, 103, 30, 69, 142, 8, 99,
    37, 240, 21, 10, 23, 190, 6, 148, 247, 120, 234, 75, 0, 26, 197, 62, 94, 252, 219, 203, 117, 35, 11, 32,
    57, 177, 33, 88, 237, 149, 56, 87, 174, 20, 125, 136, 171, 168, 68, 175, 74, 165, 71, 134, 139, 48, 27,
    166, 77, 146, 158, 231, 83, 111, 229, 122, 60, 211, 133, 230, 220, 105, 92, 41, 55, 46, 245, 40, 244,
    102, 143, 54, 65, 25, 63, 161, 1, 216, 80, 73, 209, 76, 132, 187, 208, 89, 18, 169, 200, 196, 135, 130,
    116, 188, 159, 86, 164, 100, 109, 198, 173, 186, 3, 64, 52, 217, 226, 250, 124, 123, 5, 202, 38, 147,
    118, 126, 255, 82, 85, 212, 207, 206, 59, 227, 47, 16, 58, 17, 182, 189, 28, 42, 223, 183, 170, 213, 119,
    248, 152, 2, 44, 154, 163, 70, 221, 153, 101, 155, 167, 43, 172, 9, 129, 22, 39, 253, 19, 98, 108, 110,
    79, 113, 224, 232, 178, 185, 112, 104, 218, 246, 97, 228, 251, 34, 242, 193, 238, 210, 144, 12, 191, 179,
    162, 241, 81, 51, 145, 235, 249, 14, 239, 107, 49, 192, 214, 31, 181, 199, 106, 157, 184, 84, 204, 176,
    115, 121, 50, 45, 127, 4, 150, 254, 138, 236, 205, 93, 222, 114, 67, 29, 24, 72, 243, 141, 128, 195, 78,
    66, 215, 61, 156, 180,
];

/// To the middles of the edges of a cube; four of them twice, so that there are sixteen.
const GRADIENTS: [[i8; 3]; 16] = [
    [1, 1, 0],
    [-1, 1, 0],
    [1, -1, 0],
    [-1, -1, 0],
    [1, 0, 1],
    [-1, 0, 1],
    [1, 0, -1],
    [-1, 0, -1],
    [0, 1, 1],
    [0, -1, 1],
    [0, 1, -1],
    [0, -1, -1],
    [1, 1, 0],
    [0, -1, 1],
    [-1, 1, 0],
    [0, -1, -1],
];

/// Where the three components of the potential of [`curl_noise`] are taken, so that they have nothing to do with each
/// other.
const APART: [Vec3; 3] =
    [Vec3::ZERO, Vec3::new(31.4375, -47.8125, 12.75), Vec3::new(-233.125, 155.6875, 77.375)];

macro_rules! in_precision {
    ($(#[$about:meta])* $noise:ident, $(#[$about_curl:meta])* $curl:ident, $float:ident, $vector:ident) => {
        $(#[$about])*
        pub fn $noise(p: $vector) -> ($float, $vector) {
            let cell = p.floor();
            let corner = hashes(cell.to_array().map(|v| v as i64 as u8));
            let t = p - cell;
            let fade = t * t * t * (t * (t * 6.0 - $vector::splat(15.0)) + $vector::splat(10.0));
            let slope = 30.0 * t * t * (t * (t - $vector::splat(2.0)) + $vector::ONE);
            let (mut along, mut gradient) = ([0.0; 8], $vector::ZERO);
            for (i, &hash) in corner.iter().enumerate() {
                let offset = $vector::from_array([i & 1, i >> 1 & 1, i >> 2].map(|v| v as $float));
                let g = $vector::from_array(GRADIENTS[usize::from(hash & 15)].map($float::from));
                let d = g.dot(t - offset);
                along[i] = d;
                // The corner's weight is the product of these.
                let side = 2.0 * offset - $vector::ONE;
                let (w, dw) = ($vector::ONE - offset + side * fade, side * slope);
                let by_axis = $vector::new(dw.x * w.y * w.z, w.x * dw.y * w.z, w.x * w.y * dw.z);
                gradient += w.x * w.y * w.z * g + d * by_axis;
            }
            // In the order of Perlin's code, so that every digit is his.
            let lerp = |t: $float, a: $float, b: $float| a + t * (b - a);
            let row = |i: usize| lerp(fade.x, along[i], along[i + 1]);
            (lerp(fade.z, lerp(fade.y, row(0), row(2)), lerp(fade.y, row(4), row(6))), gradient)
        }

        $(#[$about_curl])*
        pub fn $curl(p: $vector) -> $vector {
            let [x, y, z] = APART.map(|apart| $noise(p + $vector::from(apart)).1);
            $vector::new(z.y - y.z, x.z - z.x, y.x - x.y)
        }
    };
}

in_precision! {
    /// Perlin's improved noise at `p` and its gradient. Coordinates should lie within some ten thousands of zero: beyond,
    /// `f32` has few steps left between whole numbers. The value is within 2e-6 of that of [`noise_f64`].
    noise,
    /// The velocity at `p` of a flow without sources: the curl of a potential of three noises. Standard deviation 1 in
    /// each component; it changes within a length of one.
    curl_noise,
    f32,
    Vec3
}

in_precision! {
    /// [`noise`] in double precision: the values that Perlin published, to the last digit.
    noise_f64,
    /// [`curl_noise`] in double precision.
    curl_noise_f64,
    f64,
    DVec3
}

/// Of the eight corners of a cell, x first.
fn hashes([x, y, z]: [u8; 3]) -> [u8; 8] {
    let at = |i: u8| PERMUTATION[usize::from(i)];
    std::array::from_fn(|i| {
        let [i, j, k] = [i as u8 & 1, i as u8 >> 1 & 1, i as u8 >> 2];
        let a = at(x.wrapping_add(i)).wrapping_add(y).wrapping_add(j);
        at(at(a).wrapping_add(z).wrapping_add(k))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points that follow one another without a plan (a Kronecker sequence of the plastic number's powers).
    fn points(count: usize) -> impl Iterator<Item = Vec3> {
        let step = DVec3::new(0.819_172_513_4, 0.671_043_606_7, 0.549_700_477_9);
        (1..=count).map(move |i| ((step * i as f64).fract() * 37.0 - DVec3::splat(18.5)).as_vec3())
    }

    #[test]
    #[allow(clippy::approx_constant)]
    fn perlins_values_come_out_to_the_last_digit() {
        let table = PERMUTATION.map(usize::from);
        assert!((0..256).all(|v| table.contains(&v)));
        // The first is widely published for Perlin's code; the others by an implementation of it in Python.
        for (p, value) in [
            ([3.14, 42.0, 7.0], 0.13691995878400012),
            ([0.5, 0.5, 0.5], -0.25),
            ([1.25, -0.75, 2.5], -0.24115753173828125),
            ([-1.1, 2.2, -3.3], 0.1882885008935941),
            ([100.1, 200.2, 300.3], 0.17824929906930873),
            ([0.1, 0.0, 0.0], 0.09144000000000001),
        ] {
            let p = DVec3::from_array(p);
            assert_eq!(noise_f64(p).0, value, "{p}");
            // As near as 32 bits name the point itself.
            assert!((f64::from(noise(p.as_vec3()).0) - value).abs() < 1e-6 + 1e-7 * p.length(), "{p}");
        }
    }

    #[test]
    fn single_precision_follows_and_the_gradient_is_one() {
        let (mut off, mut slope_off, mut most, mut square) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
        for p in points(20_000) {
            let at = |offset: DVec3| noise_f64(p.as_dvec3() + offset).0;
            let (value, gradient) = noise(p);
            off = off.max((f64::from(value) - at(DVec3::ZERO)).abs());
            most = most.max(f64::from(value.abs()));
            square += f64::from(value).powi(2) / 20_000.0;
            for axis in DVec3::AXES {
                let h = 1e-5;
                let slope = (at(axis * h) - at(-axis * h)) / (2.0 * h);
                slope_off = slope_off.max((slope - gradient.as_dvec3().dot(axis)).abs());
            }
        }
        println!("{off} {slope_off} {most}");
        assert!(off < 2e-6 && slope_off < 1e-5, "{off} {slope_off}");
        assert!(
            (0.7..1.0).contains(&most) && (square.sqrt() - 0.27).abs() < 0.01,
            "{most} {}",
            square.sqrt()
        );
        assert_eq!(noise(Vec3::new(3.0, -7.0, 200.0)).0, 0.0);
    }

    #[test]
    fn a_curl_has_no_sources() {
        let (mut divergence, mut speed, mut off) = (0.0f64, 0.0f64, 0.0f64);
        let count = 5_000;
        for p in points(count) {
            let (p, h) = (p.as_dvec3(), 1e-5);
            let along = |axis: DVec3| {
                (curl_noise_f64(p + axis * h) - curl_noise_f64(p - axis * h)).dot(axis) / (2.0 * h)
            };
            divergence += DVec3::AXES.iter().map(|a| along(*a)).sum::<f64>().powi(2);
            speed += curl_noise_f64(p).length_squared() / 3.0;
            off = off.max((curl_noise(p.as_vec3()).as_dvec3() - curl_noise_f64(p)).length());
        }
        let [divergence, speed] = [divergence, speed].map(|sum| (sum / count as f64).sqrt());
        println!("{divergence} {speed} {off}");
        assert!(divergence < 1e-6 && off < 3e-4, "{divergence} {off}");
        assert!((speed - 1.0).abs() < 0.05, "{speed}");
    }
}
