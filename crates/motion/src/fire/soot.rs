//! The light of hot soot.

use glam::Vec3;
use yugen_optics::ColourSpace;
use yugen_optics::spectrum::{INTEGRAL_Y, Sensor, blackbody};

/// Where absorption coefficients are stated, nm.
const WAVELENGTH: f64 = 560.0;
/// h c / (λ k) there, K: light of soot falls about as exp(−this/T).
const SECOND_RADIATION: f32 = 25_692.8;
/// Lumens per watt at 555 nm.
const EFFICACY: f64 = 683.002;
/// First and last temperature of the table and its entries.
const RANGE: [f32; 2] = [800.0, 2200.0];
const ENTRIES: usize = 57;

/// Light of soot by its temperature, in one colour space.
#[derive(Clone, Debug)]
pub(super) struct Soot {
    pub(super) space: ColourSpace,
    /// RGB over exp(−c₂/(λ T)), which changes little from entry to entry.
    table: Vec<Vec3>,
}

impl Soot {
    /// Small particles absorb as 1/λ and emit as a black body does times what they absorb (Kirchhoff).
    pub(super) fn new(space: ColourSpace) -> Self {
        Self::of(space, |lambda, kelvin| WAVELENGTH / lambda * blackbody(lambda, kelvin))
    }

    /// What glows as a black body.
    pub(super) fn black(space: ColourSpace) -> Self {
        Self::of(space, blackbody)
    }

    fn of(space: ColourSpace, light: impl Fn(f64, f64) -> f64) -> Self {
        let sensor = Sensor::emission(space, [360.0, 830.0], 95, |_| 1.0);
        let table = (0..ENTRIES)
            .map(|i| {
                let kelvin = RANGE[0] + (RANGE[1] - RANGE[0]) * i as f32 / (ENTRIES - 1) as f32;
                let rgb = sensor.rgb(|lambda| light(lambda, f64::from(kelvin)) * EFFICACY * INTEGRAL_Y);
                rgb / (-SECOND_RADIATION / kelvin).exp()
            })
            .collect();
        Self { space, table }
    }

    /// Emission over absorption at `kelvin`: luminance in cd/m². Cooler than 800 K nothing is to be seen.
    pub(super) fn light(&self, kelvin: f32) -> Vec3 {
        if kelvin < RANGE[0] {
            return Vec3::ZERO;
        }
        let kelvin = kelvin.min(RANGE[1]);
        let at = (kelvin - RANGE[0]) * ((ENTRIES - 1) as f32 / (RANGE[1] - RANGE[0]));
        let i = (at as usize).min(ENTRIES - 2);
        self.table[i].lerp(self.table[i + 1], at - i as f32) * (-SECOND_RADIATION / kelvin).exp()
    }

    /// As a shader reads it: a head, then the table.
    pub(super) fn rows(&self) -> impl Iterator<Item = [f32; 4]> {
        let step = (RANGE[1] - RANGE[0]) / (ENTRIES - 1) as f32;
        let head = [RANGE[0], RANGE[1], 1.0 / step, SECOND_RADIATION];
        std::iter::once(head).chain(self.table.iter().map(|v| [v.x, v.y, v.z, 0.0]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::spectrum::emission_rgb;

    #[test]
    fn the_table_is_plancks_law_to_the_eye() {
        for space in ColourSpace::ALL {
            let (soot, black) = (Soot::new(space), Soot::black(space));
            for kelvin in [806.0f32, 900.0, 1333.0, 1700.0, 1871.5, 2190.0] {
                // At the dim end, where the eye sees nothing but the far red, the table is 4.6e-3 off.
                let tolerance = if kelvin < 1000.0 { 1e-2 } else { 3e-3 };
                let scale = (EFFICACY * INTEGRAL_Y) as f32;
                let t = f64::from(kelvin);
                let exact = scale * emission_rgb(space, |l| blackbody(l, t));
                let off = (black.light(kelvin) - exact).abs().max_element() / exact.max_element();
                assert!(off < tolerance, "{space:?} {kelvin}: {off}");
                let exact = scale * emission_rgb(space, |l| 560.0 / l * blackbody(l, t));
                let off = (soot.light(kelvin) - exact).abs().max_element() / exact.max_element();
                assert!(off < tolerance, "{space:?} {kelvin}: {off}");
            }
        }
        let black = Soot::black(ColourSpace::LinearRec2020);
        // Chromaticity of the Planckian locus at 2000 K (Wyszecki and Stiles 1982).
        let xyz = ColourSpace::LinearRec2020.to_xyz() * black.light(2000.0).as_dvec3();
        let [x, y] = [xyz.x, xyz.y].map(|v| v / xyz.element_sum());
        assert!((x - 0.5267).abs() < 3e-4 && (y - 0.4133).abs() < 3e-4, "{x} {y}");
        assert_eq!(black.light(300.0), Vec3::ZERO);
        assert!(black.light(f32::INFINITY).is_finite());
    }
}
