//! Metals: what they are made of optically, and what colour that gives them.

//!
//! [`Metal`] is a metal by its measured index of refraction; [`named_conductor`] is what Mitsuba's files mean by
//! a name.

use crate::films::{Layer, stack};
use crate::model::Preset;
use glam::Vec3;
use num_complex::Complex64;
use yugen_optics::ColourSpace;
use yugen_optics::spectrum::Sensor;

/// Wavelengths at which colours of metals and films are computed: every 5 nm from 380 to 780.
pub const WAVELENGTHS: usize = 81;
/// First and last of them, nm.
pub const VISIBLE: [f64; 2] = [380.0, 780.0];

/// A metal with a published table of n and k.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metal {
    /// Evaporated gold, Olmon et al. 2012.
    Gold,
    /// Gold, Johnson and Christy 1972: a little greener.
    GoldJohnsonChristy,
    /// Johnson and Christy 1972.
    Silver,
    /// Johnson and Christy 1972.
    Copper,
    /// McPeak et al. 2015.
    Aluminium,
}

impl Metal {
    /// Every metal.
    pub const ALL: [Self; 5] =
        [Self::Gold, Self::GoldJohnsonChristy, Self::Silver, Self::Copper, Self::Aluminium];

    /// The metals as presets of the models that take an index of refraction.
    pub const PRESETS: &'static [Preset] = &[
        Preset { name: "gold", doc: "evaporated gold, Olmon et al. 2012" },
        Preset { name: "gold_johnson_christy", doc: "gold, Johnson and Christy 1972" },
        Preset { name: "silver", doc: "silver, Johnson and Christy 1972" },
        Preset { name: "copper", doc: "copper, Johnson and Christy 1972" },
        Preset { name: "aluminium", doc: "aluminium, McPeak et al. 2015" },
    ];

    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gold => "gold",
            Self::GoldJohnsonChristy => "gold_johnson_christy",
            Self::Silver => "silver",
            Self::Copper => "copper",
            Self::Aluminium => "aluminium",
        }
    }

    /// The metal called `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|m| m.name() == name)
    }

    /// Rows of wavelength (nm), n, k.
    pub fn table(self) -> &'static [[f64; 3]] {
        match self {
            Self::Gold => &GOLD_OLMON,
            Self::GoldJohnsonChristy => &GOLD_JOHNSON_CHRISTY,
            Self::Silver => &SILVER_JOHNSON_CHRISTY,
            Self::Copper => &COPPER_JOHNSON_CHRISTY,
            Self::Aluminium => &ALUMINIUM_MCPEAK,
        }
    }

    /// n + ik at `lambda` nm, linear between the entries of the table, held beyond its ends.
    pub fn index(self, lambda: f64) -> Complex64 {
        let table = self.table();
        let i = table.partition_point(|row| row[0] <= lambda).clamp(1, table.len() - 1);
        let (a, b) = (table[i - 1], table[i]);
        let t = ((lambda - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
        Complex64::new(a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2]))
    }

    /// Unpolarised reflectance at `lambda` nm in air, at the cosine `cos`. Fresnel 1823.
    pub fn reflectance(self, lambda: f64, cos: f64) -> f64 {
        stack(lambda, 1.0, cos, &[], self.index(lambda)).reflectance()
    }

    /// Reflectance in air as RGB of `space`, at the cosine `cos`. Not clamped: gold in sRGB reflects more red
    /// than there is.
    pub fn rgb(self, space: ColourSpace, cos: f64) -> Vec3 {
        Sensor::reflectance(space, VISIBLE, WAVELENGTHS).rgb(|l| self.reflectance(l, cos))
    }

    /// Normal reflectance as RGB of `space`.
    pub fn f0(self, space: ColourSpace) -> Vec3 {
        self.rgb(space, 1.0)
    }

    /// `eta` and `k` per channel of `space`, the averages that D65 and the channels' sensitivities make of n and
    /// k: for models that take three indices. Their reflectance only comes near [`Self::rgb`].
    pub fn rgb_index(self, space: ColourSpace) -> (Vec3, Vec3) {
        let sensor = Sensor::reflectance(space, VISIBLE, WAVELENGTHS);
        (sensor.rgb(|l| self.index(l).re).max(Vec3::ZERO), sensor.rgb(|l| self.index(l).im).max(Vec3::ZERO))
    }

    /// A leaf of this metal, `thickness` nm thick.
    pub fn leaf(self, lambda: f64, thickness: f64) -> Layer {
        Layer { index: self.index(lambda), thickness }
    }
}

// Tables of n and k over the visible, from the refractiveindex.info database, whose files are CC0.

/// Olmon et al. 2012, Optical dielectric function of gold, Phys. Rev. B 86, 235147: evaporated gold.
#[rustfmt::skip]
const GOLD_OLMON: [[f64; 3]; 41] = [
    [380.0, 1.588, 1.877], [390.0, 1.585, 1.904], [400.0, 1.588, 1.915], [410.0, 1.585, 1.911],
    [420.0, 1.567, 1.898], [430.0, 1.537, 1.887], [440.0, 1.505, 1.877], [450.0, 1.472, 1.855],
    [460.0, 1.422, 1.812], [470.0, 1.333, 1.758], [480.0, 1.193, 1.716], [490.0, 1.011, 1.72],
    [500.0, 0.8197, 1.787], [510.0, 0.6527, 1.908], [520.0, 0.5263, 2.058], [530.0, 0.4363, 2.213],
    [540.0, 0.3724, 2.364], [550.0, 0.3256, 2.507], [560.0, 0.2899, 2.641], [570.0, 0.2617, 2.769],
    [580.0, 0.2388, 2.891], [590.0, 0.2199, 3.009], [600.0, 0.2041, 3.122], [610.0, 0.1908, 3.232],
    [620.0, 0.1794, 3.34], [630.0, 0.1698, 3.444], [640.0, 0.1616, 3.547], [650.0, 0.1546, 3.647],
    [660.0, 0.1487, 3.746], [670.0, 0.1436, 3.843], [680.0, 0.1394, 3.938], [690.0, 0.1358, 4.033],
    [700.0, 0.1328, 4.126], [710.0, 0.1304, 4.217], [720.0, 0.1284, 4.308], [730.0, 0.1268, 4.398],
    [740.0, 0.1257, 4.487], [750.0, 0.1248, 4.575], [760.0, 0.1242, 4.662], [770.0, 0.1239, 4.749],
    [780.0, 0.1239, 4.834],
];

/// Johnson and Christy 1972, Optical constants of the noble metals, Phys. Rev. B 6, 4370: gold.
#[rustfmt::skip]
const GOLD_JOHNSON_CHRISTY: [[f64; 3]; 16] = [
    [367.9, 1.48, 1.895], [381.5, 1.46, 1.933], [397.4, 1.47, 1.952], [413.3, 1.46, 1.958],
    [430.5, 1.45, 1.948], [450.9, 1.38, 1.914], [471.4, 1.31, 1.849], [495.9, 1.04, 1.833],
    [520.9, 0.62, 2.081], [548.6, 0.43, 2.455], [582.1, 0.29, 2.863], [616.8, 0.21, 3.272],
    [659.5, 0.14, 3.697], [704.5, 0.13, 4.103], [756.0, 0.14, 4.542], [821.1, 0.16, 5.083],
];

/// Johnson and Christy 1972: silver.
#[rustfmt::skip]
const SILVER_JOHNSON_CHRISTY: [[f64; 3]; 16] = [
    [367.9, 0.07, 1.657], [381.5, 0.05, 1.864], [397.4, 0.05, 2.07], [413.3, 0.05, 2.275],
    [430.5, 0.04, 2.462], [450.9, 0.04, 2.657], [471.4, 0.05, 2.869], [495.9, 0.05, 3.093],
    [520.9, 0.05, 3.324], [548.6, 0.06, 3.586], [582.1, 0.05, 3.858], [616.8, 0.06, 4.152],
    [659.5, 0.05, 4.483], [704.5, 0.04, 4.838], [756.0, 0.03, 5.242], [821.1, 0.04, 5.727],
];

/// Johnson and Christy 1972: copper.
#[rustfmt::skip]
const COPPER_JOHNSON_CHRISTY: [[f64; 3]; 16] = [
    [367.9, 1.36, 1.975], [381.5, 1.33, 2.045], [397.4, 1.32, 2.116], [413.3, 1.28, 2.207],
    [430.5, 1.25, 2.305], [450.9, 1.24, 2.397], [471.4, 1.25, 2.483], [495.9, 1.22, 2.564],
    [520.9, 1.18, 2.608], [548.6, 1.02, 2.577], [582.1, 0.7, 2.704], [616.8, 0.3, 3.205],
    [659.5, 0.22, 3.747], [704.5, 0.21, 4.205], [756.0, 0.24, 4.665], [821.1, 0.26, 5.18],
];

/// McPeak et al. 2015, Plasmonic films can easily be better: rules and recipes, ACS Photonics 2, 326: every second
/// entry, to four places.
#[rustfmt::skip]
const ALUMINIUM_MCPEAK: [[f64; 3]; 41] = [
    [380.0, 0.336, 4.0026], [390.0, 0.3549, 4.1142], [400.0, 0.3752, 4.2264], [410.0, 0.3961, 4.3368],
    [420.0, 0.4176, 4.4474], [430.0, 0.441, 4.5591], [440.0, 0.4642, 4.6691], [450.0, 0.4892, 4.7783],
    [460.0, 0.5148, 4.8879], [470.0, 0.5399, 4.9973], [480.0, 0.568, 5.1059], [490.0, 0.5967, 5.2129],
    [500.0, 0.6257, 5.3205], [510.0, 0.6557, 5.4282], [520.0, 0.6883, 5.536], [530.0, 0.7208, 5.6418],
    [540.0, 0.7545, 5.7465], [550.0, 0.7894, 5.8519], [560.0, 0.8292, 5.9582], [570.0, 0.8674, 6.0602],
    [580.0, 0.9086, 6.1652], [590.0, 0.949, 6.2674], [600.0, 0.9925, 6.369], [610.0, 1.0381, 6.4668],
    [620.0, 1.0882, 6.5666], [630.0, 1.1363, 6.6631], [640.0, 1.1903, 6.7594], [650.0, 1.2464, 6.8523],
    [660.0, 1.3044, 6.9424], [670.0, 1.3654, 7.032], [680.0, 1.426, 7.1163], [690.0, 1.4932, 7.1975],
    [700.0, 1.5598, 7.2739], [710.0, 1.6316, 7.3458], [720.0, 1.7068, 7.4142], [730.0, 1.7864, 7.4754],
    [740.0, 1.8722, 7.5284], [750.0, 1.9584, 7.5714], [760.0, 2.0542, 7.5995], [770.0, 2.1445, 7.6122],
    [780.0, 2.2315, 7.6039],
];

/// `eta` and `k` of Mitsuba's `material="…"` in linear sRGB, as the `rgb` variants of Mitsuba 3.9.1 compute
/// them: [`yugen_optics::spectrum::mitsuba_rgb`] with the flat weighting of `Emission`, so that even a constant
/// index would be reddish. The measurements behind them are those of Palik's Handbook of Optical Constants of
/// Solids and of luxpop.com. `"none"` is a perfect mirror. `None` where Mitsuba has no such material.
pub fn named_conductor(name: &str) -> Option<(Vec3, Vec3)> {
    if name == "none" {
        return Some((Vec3::ZERO, Vec3::ONE));
    }
    NAMED.iter().find(|(n, ..)| *n == name).map(|&(_, eta, k)| (eta.into(), k.into()))
}

/// Every name that [`named_conductor`] knows, to suggest from.
pub fn conductor_names() -> impl Iterator<Item = &'static str> {
    NAMED.iter().map(|&(name, ..)| name).chain(["none"])
}

/// Name, eta, k. Read from Mitsuba 3.9.1: the textures that `<bsdf type="conductor">` holds in `scalar_rgb`.
#[rustfmt::skip]
const NAMED: [(&str, [f32; 3], [f32; 3]); 71] = [
    ("Ag", [0.155276, 0.116728, 0.138387], [4.82835, 3.12222, 2.1469]),
    ("Al", [1.6575, 0.880405, 0.521244], [9.2238, 6.2695, 4.83701]),
    ("AlAs", [3.60528, 3.23294, 2.21632], [0.000679444, 0.0, 0.0075127]),
    ("AlAs_palik", [3.60528, 3.23294, 2.21632], [0.000679444, 0.0, 0.0075127]),
    ("AlSb", [0.0, 4.13937, 4.66925], [0.0, 0.094009, 1.30057]),
    ("AlSb_palik", [0.0, 4.13937, 4.66925], [0.0, 0.094009, 1.30057]),
    ("Au", [0.143037, 0.375306, 1.44204], [3.98299, 2.38556, 1.60336]),
    ("Be", [4.185, 3.18503, 2.78406], [3.83546, 3.01012, 2.869]),
    ("Be_palik", [4.185, 3.18503, 2.78406], [3.83546, 3.01012, 2.869]),
    ("Cr", [4.36966, 2.9165, 1.6549], [5.20654, 4.23131, 3.7547]),
    ("CsI", [2.1449, 1.70232, 1.66243], [0.0, 0.0, 0.0]),
    ("CsI_palik", [2.1449, 1.70232, 1.66243], [0.0, 0.0, 0.0]),
    ("Cu", [0.201005, 0.923749, 1.10221], [3.91326, 2.45304, 2.14209]),
    ("Cu2O", [3.55177, 2.94987, 2.75187], [0.114207, 0.193896, 0.606134]),
    ("Cu2O_palik", [3.55177, 2.94987, 2.75187], [0.114207, 0.193896, 0.606134]),
    ("CuO", [3.24753, 2.4478, 2.21022], [0.52109, 0.570029, 0.722179]),
    ("CuO_palik", [3.24753, 2.4478, 2.21022], [0.52109, 0.570029, 0.722179]),
    ("Cu_palik", [0.213229, 0.919714, 1.10241], [3.92187, 2.45733, 2.13658]),
    ("Hg", [2.39894, 1.44003, 0.90957], [6.32758, 4.37192, 3.42176]),
    ("HgTe", [4.77904, 3.23119, 2.6599], [1.63161, 1.58081, 1.72929]),
    ("HgTe_palik", [4.77904, 3.23119, 2.6599], [1.63161, 1.58081, 1.72929]),
    ("Hg_palik", [2.39894, 1.44003, 0.90957], [6.32758, 4.37192, 3.42176]),
    ("Ir", [3.0863, 2.08219, 1.61791], [5.59214, 4.06709, 3.26731]),
    ("Ir_palik", [3.0863, 2.08219, 1.61791], [5.59214, 4.06709, 3.26731]),
    ("K", [0.064043, 0.0464097, 0.0381849], [2.1042, 1.34894, 0.913126]),
    ("K_palik", [0.064043, 0.0464097, 0.0381849], [2.1042, 1.34894, 0.913126]),
    ("Li", [0.265791, 0.195618, 0.220949], [3.54016, 2.31112, 1.66861]),
    ("Li_palik", [0.265791, 0.195618, 0.220949], [3.54016, 2.31112, 1.66861]),
    ("MgO", [2.08958, 1.65072, 1.59488], [4.332694e-12, 0.0, 2.498645e-11]),
    ("MgO_palik", [2.08958, 1.65072, 1.59488], [4.332694e-12, 0.0, 2.498645e-11]),
    ("Mo", [4.48397, 3.52513, 2.77631], [4.11144, 3.42082, 3.15061]),
    ("Mo_palik", [4.48397, 3.52513, 2.77631], [4.11144, 3.42082, 3.15061]),
    ("Na_palik", [0.0602693, 0.0561409, 0.0619884], [3.17927, 2.11249, 1.57904]),
    ("Nb", [3.42007, 2.79009, 2.39563], [3.44139, 2.73767, 2.57975]),
    ("Nb_palik", [3.42007, 2.79009, 2.39563], [3.44139, 2.73767, 2.57975]),
    ("Ni_palik", [2.3673, 1.66337, 1.46708], [4.49881, 3.05015, 2.34544]),
    ("Rh", [2.5858, 1.86021, 1.55426], [6.78225, 4.70298, 3.97607]),
    ("Rh_palik", [2.5858, 1.86021, 1.55426], [6.78225, 4.70298, 3.97607]),
    ("Se", [4.05831, 2.84294, 2.82085], [0.754049, 0.638444, 0.521807]),
    ("Se-e", [5.72285, 4.16573, 4.08134], [0.871136, 1.10516, 1.56532]),
    ("Se-e_palik", [5.72285, 4.16573, 4.08134], [0.871136, 1.10516, 1.56532]),
    ("Se_palik", [4.05831, 2.84294, 2.82085], [0.754049, 0.638444, 0.521807]),
    ("SiC", [3.17234, 2.52597, 2.47937], [7.537672e-07, 0.0, 1.019253e-05]),
    ("SiC_palik", [3.17234, 2.52597, 2.47937], [7.537672e-07, 0.0, 1.019253e-05]),
    ("SnTe", [4.52424, 1.98164, 1.28159], [0.0, 0.0, 0.0]),
    ("SnTe_palik", [4.52424, 1.98164, 1.28159], [0.0, 0.0, 0.0]),
    ("Ta", [2.06273, 2.39293, 2.62793], [2.40836, 1.74149, 1.94703]),
    ("Ta_palik", [2.06273, 2.39293, 2.62793], [2.40836, 1.74149, 1.94703]),
    ("Te", [7.39023, 4.4821, 2.63711], [3.25603, 3.52705, 3.29205]),
    ("Te-e", [7.50891, 4.29642, 2.36999], [5.58392, 4.9472, 3.99759]),
    ("Te-e_palik", [7.50891, 4.29642, 2.36999], [5.58392, 4.9472, 3.99759]),
    ("Te_palik", [7.39023, 4.4821, 2.63711], [3.25603, 3.52705, 3.29205]),
    ("ThF4", [1.83072, 1.44223, 1.38765], [0.0, 0.0, 0.0]),
    ("ThF4_palik", [1.83072, 1.44223, 1.38765], [0.0, 0.0, 0.0]),
    ("TiC", [3.70054, 2.83741, 2.58229], [3.26563, 2.35159, 2.17279]),
    ("TiC_palik", [3.70054, 2.83741, 2.58229], [3.26563, 2.35159, 2.17279]),
    ("TiN", [1.64845, 1.15052, 1.37982], [3.36832, 1.9435, 1.10207]),
    ("TiN_palik", [1.64845, 1.15052, 1.37982], [3.36832, 1.9435, 1.10207]),
    ("TiO2", [3.45662, 2.80173, 2.90518], [0.000105265, 0.0, 0.000652887]),
    ("TiO2-e", [3.10656, 2.51317, 2.58244], [2.975158e-05, 0.0, 0.000182698]),
    ("TiO2-e_palik", [3.10656, 2.51317, 2.58244], [2.975158e-05, 0.0, 0.000182698]),
    ("TiO2_palik", [3.45662, 2.80173, 2.90518], [0.000105265, 0.0, 0.000652887]),
    ("VC", [3.65757, 2.75273, 2.53267], [3.0683, 2.19869, 1.96319]),
    ("VC_palik", [3.65757, 2.75273, 2.53267], [3.0683, 2.19869, 1.96319]),
    ("VN", [2.8656, 2.11919, 1.94009], [3.03224, 2.05612, 1.61631]),
    ("VN_palik", [2.8656, 2.11919, 1.94009], [3.03224, 2.05612, 1.61631]),
    ("V_palik", [4.27757, 3.51295, 2.76107], [3.49131, 2.88945, 3.11152]),
    ("W", [4.37081, 3.30024, 2.99841], [3.50064, 2.60487, 2.27323]),
    ("a-C", [2.94404, 2.22713, 1.96816], [0.887464, 0.799298, 0.81529]),
    ("d-C", [2.70872, 2.31883, 2.2289], [0.0, 0.0, 0.0]),
    ("d-C_palik", [2.70872, 2.31883, 2.2289], [0.0, 0.0, 0.0]),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::films::{Response, coat};
    use glam::DVec3;
    use yugen_optics::spectrum::{cie_1931, d65, illuminant_a};

    /// The colours below were computed once by an independent program from the same tables; worst difference
    /// 6.2e-4, hence 1e-3.
    fn near(got: Vec3, want: [f64; 3], tolerance: f32) {
        let want = Vec3::new(want[0] as f32, want[1] as f32, want[2] as f32);
        assert!((got - want).abs().max_element() <= tolerance, "{got} is not {want}");
    }

    fn srgb(value: impl Fn(f64) -> f64) -> Vec3 {
        Sensor::reflectance(ColourSpace::LinearSrgb, VISIBLE, WAVELENGTHS).rgb(value)
    }

    #[test]
    fn reflectances_of_gold_are_the_published_ones() {
        for (lambda, want) in [
            (550.0, [0.838056, 0.836299, 0.837190, 0.893226]),
            (610.0, [0.935670, 0.933659, 0.930223, 0.943876]),
            (450.0, [0.383572, 0.391299, 0.416685, 0.606308]),
        ] {
            for (angle, want) in [0.0f64, 45.0, 60.0, 80.0].into_iter().zip(want) {
                let got = Metal::Gold.reflectance(lambda, angle.to_radians().cos());
                assert!((got - want).abs() < 6e-7, "{lambda} {angle}: {got} {want}");
            }
        }
        assert_eq!(Metal::Gold.index(500.0), Complex64::new(0.8197, 1.787));
        assert_eq!(Metal::GoldJohnsonChristy.index(548.6), Complex64::new(0.43, 2.455));
        assert_eq!(Metal::Silver.index(450.9), Complex64::new(0.04, 2.657));
        assert_eq!(
            (Metal::Gold.index(300.0), Metal::Gold.index(900.0)),
            (Metal::Gold.index(380.0), Metal::Gold.index(780.0))
        );
    }

    #[test]
    fn metals_have_their_colours() {
        use ColourSpace::{LinearRec2020, LinearSrgb};
        near(Metal::Gold.f0(LinearSrgb), [1.0427, 0.7740, 0.3346], 1e-3);
        near(Metal::GoldJohnsonChristy.f0(LinearSrgb), [1.0375, 0.7284, 0.3646], 1e-3);
        near(Metal::Silver.f0(LinearSrgb), [0.9892, 0.9840, 0.9778], 1e-3);
        near(Metal::Gold.f0(LinearRec2020), [0.9236, 0.7875, 0.3848], 1e-3);
        near(Metal::Silver.f0(LinearRec2020), [0.9871, 0.9843, 0.9783], 1e-3);
        for (angle, want) in [
            (60.0f64, [1.0251, 0.7832, 0.3745]),
            (75.0, [0.9996, 0.8296, 0.4903]),
            (85.0, [0.9929, 0.9253, 0.7402]),
        ] {
            near(Metal::Gold.rgb(LinearSrgb, angle.to_radians().cos()), want, 1e-3);
        }
        let xyz = |light: fn(f64) -> f64| {
            (380..=780).map(f64::from).fold([DVec3::ZERO; 2], |[gold, white], l| {
                let light = cie_1931(l) * light(l);
                [gold + light * Metal::Gold.reflectance(l, 1.0), white + light]
            })
        };
        let [gold, white] = xyz(d65);
        near((gold / white.y).as_vec3(), [0.76719, 0.79941, 0.43036], 1e-3);
        // Under illuminant A, as XYZ relative to a white surface there.
        let [gold, white] = xyz(illuminant_a);
        let relative = LinearSrgb.to_xyz() * DVec3::ONE * (gold / white);
        near((LinearSrgb.to_xyz().inverse() * relative).as_vec3(), [1.22, 0.786, 0.343], 5e-3);
        let (eta, k) = Metal::Copper.rgb_index(LinearRec2020);
        assert!(eta.x < eta.y && eta.y < eta.z && k.x > k.y, "{eta} {k}");
        // Akenine-Möller et al. 2018, Real-Time Rendering, table 9.2, from other measurements.
        near(Metal::Copper.f0(LinearSrgb), [0.955, 0.638, 0.538], 0.03);
        let aluminium = Metal::Aluminium.f0(LinearSrgb);
        assert!(
            aluminium.max_element() - aluminium.min_element() < 0.025 && (aluminium.y - 0.916).abs() < 5e-3
        );
        assert!(Metal::ALL.iter().all(|&m| Metal::from_name(m.name()) == Some(m)));
    }

    #[test]
    fn leaf_and_lacquer_have_their_colours() {
        let leaf =
            |d: f64| move |l: f64| -> Response { stack(l, 1.0, 1.0, &[Metal::Gold.leaf(l, d)], 1.53.into()) };
        near(srgb(|l| leaf(50.0)(l).reflectance()), [0.9875, 0.6667, 0.3641], 1e-3);
        near(srgb(|l| leaf(100.0)(l).reflectance()), [1.0392, 0.7697, 0.3387], 1e-3);
        near(
            srgb(|l| leaf(150.0)(l).reflectance()),
            Metal::Gold.f0(ColourSpace::LinearSrgb).to_array().map(f64::from),
            2e-3,
        );
        assert!((leaf(50.0)(510.0).transmittance() - 0.160).abs() < 6e-4);
        assert!((leaf(100.0)(510.0).transmittance() - 0.0168).abs() < 6e-5);
        let lacquer = |l: f64| {
            coat(1.0, 1.0, 1.53, 1.0, |c| stack(l, 1.53, c, &[], Metal::Gold.index(l))).reflectance()
        };
        near(srgb(lacquer), [1.0296, 0.7308, 0.2498], 1e-3);
        let film = |d: f64| {
            let film = Layer { index: 1.53.into(), thickness: d };
            move |l: f64| stack(l, 1.0, 1.0, &[film], Metal::Gold.index(l)).reflectance()
        };
        near(srgb(film(200.0)), [1.0967, 0.6938, 0.0721], 1e-3);
        near(srgb(film(300.0)), [0.9617, 0.8059, 0.3007], 1e-3);
    }

    #[test]
    fn named_conductors_are_mitsubas() {
        // Printed by the loaded plugin itself, a way other than the one that filled the table.
        for (name, eta, k) in [
            ("Au", [0.143036, 0.375307, 1.44205], [3.983, 2.38556, 1.60336]),
            ("Al", [1.6575, 0.880405, 0.521244], [9.22381, 6.2695, 4.837]),
            ("none", [0.0; 3], [1.0; 3]),
        ] {
            let (e, n) = named_conductor(name).unwrap();
            assert!(
                (e - Vec3::from(eta)).abs().max_element() < 2e-5
                    && (n - Vec3::from(k)).abs().max_element() < 2e-5
            );
        }
        assert_eq!(named_conductor("Unobtainium"), None);
        assert_eq!(conductor_names().count(), NAMED.len() + 1);
    }
}
