//! Paper: its surface, and how easily ink goes through it.

use glam::{Vec2, Vec3};
use yugen_motion::noise::noise;
use yugen_optics::random::Pcg32;

use crate::pigment::BANDS;

/// A kind of paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paper {
    /// Of presets.
    pub name: &'static str,
    /// What it is.
    pub doc: &'static str,
    /// Reflectance in the bands of [`crate::pigment`].
    pub reflectance: [f32; BANDS],
    /// Number of fibres that show, on a sheet of 1080 lines and the same width.
    pub fibres: u32,
    /// Their length, pixels of such a sheet.
    pub fibre_length: f32,
    /// Depth of the grain, part of its height.
    pub grain: f32,
    /// How far sizing keeps ink from creeping: 0 raw, 1 wholly.
    pub sizing: f32,
    /// How much fibres, blotches and the grain show in its tone.
    pub relief: [f32; 4],
    /// A weave of threads so many pixels apart instead of fibres that lie as they fell; 0: none.
    pub threads: f32,
}

/// All kinds. Reflectances are drawn by hand: bleached paper is nearly white, age takes blue first.
pub const PAPERS: &[Paper] = &[
    Paper {
        name: "raw",
        doc: "raw xuan: long fibres, no size, ink creeps far",
        reflectance: [0.80, 0.845, 0.87, 0.885, 0.895, 0.90, 0.90, 0.90],
        fibres: 1500,
        fibre_length: 90.0,
        grain: 1.0,
        sizing: 0.0,
        relief: [0.055, 0.035, 0.018, 0.0],
        threads: 0.0,
    },
    Paper {
        name: "sized",
        doc: "xuan with alum and glue: ink stays where it is put",
        reflectance: [0.81, 0.85, 0.87, 0.885, 0.89, 0.895, 0.895, 0.895],
        fibres: 900,
        fibre_length: 60.0,
        grain: 0.7,
        sizing: 0.8,
        relief: [0.03, 0.02, 0.012, 0.0],
        threads: 0.0,
    },
    Paper {
        name: "aged",
        doc: "old paper, brown and blotched",
        reflectance: [0.46, 0.56, 0.64, 0.70, 0.745, 0.775, 0.79, 0.80],
        fibres: 1800,
        fibre_length: 80.0,
        grain: 1.2,
        sizing: 0.35,
        relief: [0.07, 0.28, 0.04, 0.0],
        threads: 0.0,
    },
    Paper {
        name: "silk",
        doc: "sized silk: a fine weave of threads, warm",
        reflectance: [0.55, 0.63, 0.69, 0.73, 0.76, 0.78, 0.79, 0.79],
        fibres: 0,
        fibre_length: 0.0,
        grain: 0.6,
        sizing: 0.9,
        relief: [0.0, 0.08, 0.09, 0.0],
        threads: 3.2,
    },
];

/// The surface of a sheet.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// Texels across and down.
    pub size: [u32; 2],
    /// Height, fibres, blotches and permeability of each, 0 to 1, row after row. Heights are evenly distributed.
    pub texels: Vec<[f32; 4]>,
}

impl Paper {
    /// The one called `name`.
    pub fn find(name: &str) -> Option<&'static Self> {
        PAPERS.iter().find(|p| p.name == name)
    }

    /// A sheet of `size` pixels, of which `unit` stand for one in a picture of 1080 lines.
    pub fn sheet(&self, size: [u32; 2], unit: f32, seed: u32) -> Sheet {
        let [w, h] = size.map(|n| n as usize);
        let layer = (seed & 0xff) as f32 + 0.5;
        let fibres = self.fibre_map([w, h], unit, seed);
        let mut heights = Vec::with_capacity(w * h);
        let mut blotches = Vec::with_capacity(w * h);
        for y in 0..h {
            for x in 0..w {
                let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / unit;
                let n = |p: Vec2, z: f32| noise(p.extend(z + layer)).0;
                let mut height = n(p / 3.1, 0.0) + 0.8 * n(p / 7.3, 19.0) + 0.45 * n(p / 19.0, 37.0);
                if self.threads > 0.0 {
                    let over = |t: f32| (t * std::f32::consts::TAU / self.threads).sin();
                    let warped = p + 0.6 * Vec2::new(n(p / 40.0, 51.0), n(p / 40.0, 67.0));
                    height = 0.5 * height + 0.5 * (over(warped.x) + over(warped.y));
                }
                heights.push(height + 0.55 * fibres[y * w + x]);
                blotches.push((0.5 + 0.9 * n(p / 170.0, 83.0) + 0.5 * n(p / 61.0, 101.0)).clamp(0.0, 1.0));
            }
        }
        // An even distribution, by rank among a sample: sorting two million numbers is no work for a sheet of paper.
        let stride = (heights.len() / 65_536).max(1);
        let mut sample: Vec<f32> = heights.iter().copied().step_by(stride).collect();
        sample.sort_by(f32::total_cmp);
        let rank = |v: f32| sample.partition_point(|s| *s < v) as f32 / sample.len() as f32;
        let texels = heights
            .iter()
            .zip(&fibres)
            .zip(&blotches)
            .map(|((h, f), b)| {
                let even = rank(*h);
                let height = 0.5 + (even - 0.5) * self.grain.min(1.0);
                let open = (1.0 - self.sizing)
                    * (0.7 + 0.3 * f.min(1.0))
                    * (0.8 + 0.25 * (even - 0.5)).clamp(0.0, 1.0);
                [height, f.min(1.0), *b, open.clamp(0.02, 1.0)]
            })
            .collect();
        Sheet { size, texels }
    }

    /// Fibres as lines that bend a little, drawn over one another.
    fn fibre_map(&self, [w, h]: [usize; 2], unit: f32, seed: u32) -> Vec<f32> {
        let mut map = vec![0.0f32; w * h];
        if self.fibres == 0 {
            return map;
        }
        let mut random = Pcg32::new(u64::from(seed), 0xf1b);
        let sheet = Vec2::new(w as f32, h as f32);
        let count = (self.fibres as f32 * sheet.x * sheet.y / (1080.0 * 1080.0 * unit * unit)) as usize;
        for _ in 0..count.min(1 << 18) {
            let mut p = Vec2::new(random.next_f32(), random.next_f32()) * sheet;
            let mut angle = random.next_f32() * std::f32::consts::TAU;
            let bend = 0.02 * random.normal();
            let strength = 0.15 + 0.5 * random.next_f32() * random.next_f32();
            let steps = (self.fibre_length * unit * (0.3 + 1.2 * random.next_f32())) as usize;
            for i in 0..steps {
                angle += bend / unit + 0.03 * random.normal();
                p += Vec2::from_angle(angle);
                let fade = (i.min(steps - i) as f32 / (8.0 * unit)).min(1.0) * strength;
                // Bilinear, so that a fibre has no steps.
                let base = (p - 0.5).floor();
                let t = p - 0.5 - base;
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (x, y) = (base.x as isize + dx, base.y as isize + dy);
                    if (0..w as isize).contains(&x) && (0..h as isize).contains(&y) {
                        let weight = Vec2::new(
                            if dx == 0 { 1.0 - t.x } else { t.x },
                            if dy == 0 { 1.0 - t.y } else { t.y },
                        );
                        map[y as usize * w + x as usize] += fade * weight.x * weight.y;
                    }
                }
            }
        }
        map
    }

    /// Its colour, linear sRGB.
    pub fn rgb(&self) -> Vec3 {
        crate::pigment::band_to_rgb().iter().zip(self.reflectance).map(|(w, r)| *w * r).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheets_are_even_in_height_and_the_same_for_the_same_seed() {
        for paper in PAPERS {
            let sheet = paper.sheet([160, 90], 0.25, 3);
            assert_eq!(sheet.texels.len(), 160 * 90);
            assert!(sheet.texels.iter().flatten().all(|v| (0.0..=1.0).contains(v)), "{}", paper.name);
            let mean = sheet.texels.iter().map(|t| t[0]).sum::<f32>() / sheet.texels.len() as f32;
            assert!((mean - 0.5).abs() < 0.02, "{}: {mean}", paper.name);
            assert_eq!(sheet.texels, paper.sheet([160, 90], 0.25, 3).texels);
        }
        let raw = Paper::find("raw").unwrap();
        assert_ne!(raw.sheet([64, 64], 1.0, 1).texels, raw.sheet([64, 64], 1.0, 2).texels);
        let rgb = raw.rgb();
        assert!(rgb.x > rgb.z && rgb.z > 0.7, "{rgb}");
    }
}
