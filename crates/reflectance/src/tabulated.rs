//! Nicodemus et al. 1977, "Geometrical Considerations and Nomenclature for Reflectance": the BRDF as a plain table
//! of what a goniometer read.

use crate::axis::{azimuth, clamped, periodic, polar_angle};
use crate::importance::HalfVectorTable;
use crate::microfacet::{Distribution, Masking, Microfacets};
use crate::model::{Data, Laws, Model, ModelError, Preset, Sample, Spec, params};
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, TAU};
use yugen_optics::ColourSpace;
use yugen_optics::frame::spherical;

params! {
    /// An anisotropic BRDF read off a table over eye and light.
    pub struct Tabulated {
        scale: f32 = Spec::num(1.0, 0.0, 1.0, "", "factor on the measurement"),
    }
}

/// What a goniometer measured, on a grid that is regular in no axis but complete.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Goniometry {
    /// Polar angles of the eye, rising, radians, in [0, π/2].
    pub theta_o: Vec<f32>,
    /// Azimuths of the eye, rising, radians, less than a turn from first to last; one for isotropic materials.
    pub phi_o: Vec<f32>,
    /// Polar angles of the light, rising, radians, in [0, π/2].
    pub theta_i: Vec<f32>,
    /// Azimuths of the light **from the eye's**, rising, radians, less than a turn from first to last: π is the
    /// mirror's side. Relative, so that a highlight stays where it is while the sample turns.
    pub phi_d: Vec<f32>,
    /// f in 1/sr as RGB, `phi_d` fastest, then `theta_i`, `phi_o`, `theta_o`. NaN where nothing was read (a
    /// detector stands in its own light).
    pub rgb: Vec<f32>,
}

const HEADER: usize = 4;

impl Goniometry {
    /// What is wrong with it, if anything is.
    pub fn check(&self) -> Result<(), String> {
        for (name, axis) in [("theta_o", &self.theta_o), ("theta_i", &self.theta_i)] {
            let rising = axis.windows(2).all(|w| w[0] < w[1]);
            // A little beyond, as degrees become radians with rounding.
            if axis.len() < 2 || !rising || !axis.iter().all(|a| (0.0..=FRAC_PI_2 + 1e-5).contains(a)) {
                return Err(format!(
                    "needs at least two polar angles {name} that rise from 0 to at most 90 degrees"
                ));
            }
        }
        for (name, axis) in [("phi_o", &self.phi_o), ("phi_d", &self.phi_d)] {
            let rising = axis.windows(2).all(|w| w[0] < w[1]) && axis.iter().all(|a| a.is_finite());
            if axis.is_empty() || !rising || axis[axis.len() - 1] - axis[0] >= TAU - 1e-5 {
                return Err(format!("needs azimuths {name} that rise and end before they come round"));
            }
        }
        let expected = 3 * self.theta_o.len() * self.phi_o.len() * self.theta_i.len() * self.phi_d.len();
        if self.rgb.len() != expected {
            return Err(format!("has {} numbers; its axes need {expected}", self.rgb.len()));
        }
        if self.rgb.iter().any(|v| v.is_infinite() || *v < 0.0) {
            return Err("has a value that is negative or infinite".into());
        }
        Ok(())
    }

    /// As numbers for [`Model::bake`].
    pub fn to_data(&self) -> Vec<f32> {
        let axes = [&self.theta_o, &self.phi_o, &self.theta_i, &self.phi_d];
        let mut data: Vec<f32> = axes.iter().map(|a| a.len() as f32).collect();
        axes.iter().for_each(|a| data.extend(*a));
        data.extend(&self.rgb);
        data
    }

    fn from_data(data: &[f32]) -> Result<Self, String> {
        let short = || "needs the numbers of a goniometer table".to_string();
        let (header, mut rest) = data.split_at_checked(HEADER).ok_or_else(short)?;
        let mut take = |n: f32| -> Result<Vec<f32>, String> {
            let (head, tail) = rest.split_at_checked(n.clamp(0.0, 1e9) as usize).ok_or_else(short)?;
            rest = tail;
            Ok(head.to_vec())
        };
        let (theta_o, phi_o, theta_i) = (take(header[0])?, take(header[1])?, take(header[2])?);
        let phi_d = take(header[3])?;
        let g = Self { theta_o, phi_o, theta_i, phi_d, rgb: rest.to_vec() };
        g.check()?;
        Ok(g)
    }

    /// Reads any reflection `f(wo, wi)` off at these angles.
    pub fn of(
        f: impl Fn(Vec3, Vec3) -> Vec3,
        theta_o: Vec<f32>,
        phi_o: Vec<f32>,
        theta_i: Vec<f32>,
        phi_d: Vec<f32>,
    ) -> Self {
        let mut g = Self { theta_o, phi_o, theta_i, phi_d, rgb: Vec::new() };
        // A hair above the horizon, where f still has a meaning.
        let up = |theta: f32, phi: f32| spherical(theta.min(FRAC_PI_2 - 1e-3), phi);
        for &to in &g.theta_o {
            for &po in &g.phi_o {
                for &ti in &g.theta_i {
                    for &pd in &g.phi_d {
                        g.rgb.extend(f(up(to, po), up(ti, po + pd)).to_array());
                    }
                }
            }
        }
        g
    }

    /// Readings that are missing become those nearest in θ_i; where a whole row of θ_i is missing, nothing.
    fn fill(&mut self) {
        let (n_d, n_i) = (self.phi_d.len(), self.theta_i.len());
        for block in self.rgb.chunks_exact_mut(3 * n_d * n_i) {
            for column in 0..3 * n_d {
                let at = |i: usize| i * 3 * n_d + column;
                let known: Vec<usize> = (0..n_i).filter(|&i| !block[at(i)].is_nan()).collect();
                for i in 0..n_i {
                    if block[at(i)].is_nan() {
                        let nearest = known.iter().min_by_key(|&&k| k.abs_diff(i));
                        block[at(i)] = nearest.map_or(0.0, |&k| block[at(k)]);
                    }
                }
            }
        }
    }
}

/// A baked table: [`Goniometry::to_data`], then the sampler's.
struct View<'a> {
    axes: [&'a [f32]; 4],
    values: &'a [f32],
}

impl<'a> View<'a> {
    fn new(table: &'a [f32]) -> Self {
        let mut at = HEADER;
        let axes = [0, 1, 2, 3].map(|i| {
            let n = table[i] as usize;
            at += n;
            &table[at - n..at]
        });
        let count = 3 * axes.iter().map(|a| a.len()).product::<usize>();
        Self { axes, values: &table[at..at + count] }
    }

    fn sampler(&self) -> HalfVectorTable {
        let axes: usize = self.axes.iter().map(|a| a.len()).sum();
        let n_phi = if self.axes[1].len() > 1 { 16 } else { 1 };
        HalfVectorTable { start: HEADER + axes + self.values.len(), n_theta: 16, n_phi, n_u: 32, n_v: 24 }
    }

    fn f(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let (phi_o, phi_i) = (azimuth(wo), azimuth(wi));
        let cells = [
            clamped(self.axes[0], polar_angle(wo)),
            periodic(self.axes[1], phi_o),
            clamped(self.axes[2], polar_angle(wi)),
            periodic(self.axes[3], phi_i - phi_o),
        ];
        // Linear in all four.
        let mut sum = Vec3::ZERO;
        for corner in 0..16 {
            let (mut index, mut weight) = (0, 1.0);
            for (k, &(low, high, t)) in cells.iter().enumerate() {
                let upper = corner >> k & 1 == 1;
                index = index * self.axes[k].len() + if upper { high } else { low };
                weight *= if upper { t } else { 1.0 - t };
            }
            if weight > 0.0 {
                sum += weight * Vec3::from_slice(&self.values[3 * index..]);
            }
        }
        sum
    }
}

impl Model for Tabulated {
    const NAME: &'static str = "tabulated";
    const SOURCE: &'static str =
        "Nicodemus et al. 1977, Geometrical Considerations and Nomenclature for Reflectance";
    const DOC: &'static str = "What a goniometer read, as a plain table over eye and light, isotropic or not. Linear \
        between the readings: highlights narrower than a few steps need a finer grid, or a model fitted to them.";
    const LAWS: Laws = Laws {
        reciprocal: false,
        conserves_energy: true,
        transmits: false,
        delta: false,
        isotropic: false,
        why: "Eye and light are read on different grids, and a reading is what it is.",
    };
    const WGSL: &'static str = include_str!("tabulated.wgsl");
    // Worst 4.4e-5.
    const TWIN: (f32, f32) = (2e-4, 1e-6);
    const COSTLY: bool = true;
    const DATA: Data = Data::Required("a goniometer table");
    const PRESETS: &'static [Preset] = &[Preset {
        name: "satin",
        doc: "no measurement: GGX of roughness 0.3 and 0.6 over Lambert, read every 7.5 degrees by 15",
    }];

    fn preset(name: &str, space: ColourSpace) -> Option<(Self, Vec<f32>)> {
        if name != "satin" {
            return None;
        }
        let facets = Microfacets::new(Distribution::Ggx, Masking::HeightCorrelated, 0.3, 0.6);
        let to_space = ColourSpace::LinearSrgb.matrix_to(space);
        let (diffuse, specular) =
            (to_space * Vec3::new(0.25, 0.05, 0.06), to_space * Vec3::new(0.3, 0.25, 0.2));
        let f = |wo: Vec3, wi: Vec3| diffuse * FRAC_1_PI + specular * facets.reflect(wo, wi).0;
        let steps =
            |n: u8, step: f32| (0..n).map(|i| (f32::from(i) * step).to_radians()).collect::<Vec<f32>>();
        let g = Goniometry::of(f, steps(12, 7.5), steps(12, 30.0), steps(12, 7.5), steps(24, 15.0));
        Some((Self::default(), g.to_data()))
    }

    fn bake(&self, data: &[f32]) -> Result<Vec<f32>, ModelError> {
        let mut g = Goniometry::from_data(data)
            .map_err(|problem| ModelError::BadTable { model: Self::NAME, problem })?;
        g.fill();
        let mut table = g.to_data();
        let view = View::new(&table);
        let sampler = view.sampler().build(|wo, wi| view.f(wo, wi));
        table.extend(sampler);
        Ok(table)
    }

    fn eval(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        self.scale * View::new(table).f(wo, wi)
    }

    fn pdf(&self, table: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        View::new(table).sampler().pdf(table, wo, wi)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        View::new(table).sampler().sample_with(table, wo, u, |wo, wi| self.eval(table, wo, wi))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::furnace::assert_samples;

    fn linear(wo: Vec3, wi: Vec3) -> Vec3 {
        let polar = |w: Vec3| w.truncate().length().atan2(w.z);
        let turn = wi.y.atan2(wi.x) - wo.y.atan2(wo.x);
        Vec3::new(polar(wo), polar(wi), 1.0 + turn.cos())
    }

    fn degrees(a: &[f32]) -> Vec<f32> {
        a.iter().map(|a| a.to_radians()).collect()
    }

    fn uneven() -> Goniometry {
        let phi: Vec<f32> = (0..36).map(|i| i as f32 * 10.0).collect();
        let theta = [0.0, 10.0, 25.0, 60.0, 85.0];
        Goniometry::of(
            linear,
            degrees(&theta),
            degrees(&[-90.0, 0.0, 10.0, 170.0]),
            degrees(&theta),
            degrees(&phi),
        )
    }

    #[test]
    fn readings_come_back_and_lie_on_lines_between() {
        let g = uneven();
        let table = Tabulated::default().bake(&g.to_data()).unwrap();
        let m = Tabulated::default();
        for (to, po, ti, pd) in
            [(10.0, 0.0, 60.0, 40.0), (17.0, 150.0, 42.0, 350.0), (13.0, -130.0, 84.0, 180.0)]
        {
            let (to, po, ti, pd) =
                (f32::to_radians(to), f32::to_radians(po), f32::to_radians(ti), f32::to_radians(pd));
            let got = m.eval(&table, spherical(to, po), spherical(ti, po + pd));
            let want = Vec3::new(to, ti, 1.0 + pd.cos());
            assert!((got - want).abs().max_element() < 1e-5, "{got} {want}");
        }
        // Halfway between two azimuths, across the seam, and beyond the last polar angle.
        let at = |ti: f32, pd: f32| m.eval(&table, spherical(0.5, 2.0), spherical(ti, 2.0 + pd.to_radians()));
        let middle = 0.5 * (at(1.0, 350.0) + at(1.0, 0.0));
        assert!((at(1.0, 355.0) - middle).abs().max_element() < 1e-5);
        assert!((at(1.55, 30.0).y - 85f32.to_radians()).abs() < 1e-5);
    }

    #[test]
    fn missing_readings_are_filled_and_wrong_tables_refused() {
        let (m, g) = (Tabulated::default(), uneven());
        let change = |f: &dyn Fn(&mut Goniometry)| {
            let mut g = g.clone();
            f(&mut g);
            m.bake(&g.to_data())
        };
        let whole = change(&|_| ()).unwrap();
        let hole = change(&|g| g.rgb[3 * 36 * 2 + 5] = f32::NAN).unwrap();
        let start = HEADER + 5 + 4 + 5 + 36;
        assert_eq!(hole[start + 3 * 36 * 2 + 5], whole[start + 3 * 36 + 5]);
        assert!(hole.iter().all(|v| v.is_finite()));
        assert!(change(&|g| g.rgb[7] = -1.0).is_err());
        assert!(change(&|g| g.rgb[7] = f32::INFINITY).is_err());
        assert!(change(&|g| g.theta_i[1] = 2.0).is_err());
        assert!(change(&|g| g.phi_d[35] = 7.0).is_err());
        assert!(change(&|g| g.rgb.truncate(9)).is_err());
        assert!(m.bake(&[]).is_err() && m.bake(&[1e30, -5.0, f32::NAN, 3.0]).is_err());
    }

    #[test]
    fn is_sampled_by_importance() {
        let (m, data) = Tabulated::preset("satin", ColourSpace::LinearRec2020).unwrap();
        let table = m.bake(&data).unwrap();
        for wo in [spherical(0.2, 0.4), spherical(1.1, -2.0)] {
            assert_samples(&m, &table, wo, 2e-3);
        }
    }
}
