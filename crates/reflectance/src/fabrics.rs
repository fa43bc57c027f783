//! The six fabrics of Table II of Sadeghi et al. 2013, "A Practical Microcylinder Appearance Model for Cloth
//! Rendering": the presets of [`crate::microcylinder`].

use crate::model::Preset;
use glam::Vec3;
use yugen_optics::ColourSpace;

/// One of the two threads of a fabric.
pub(crate) struct Yarn {
    /// Index of refraction.
    pub eta: f32,
    /// Volume colour A, before `scale`.
    colour: [f32; 3],
    scale: f32,
    /// Isotropic share of the volume scattering.
    pub k_d: f32,
    /// Width of the surface lobe, degrees.
    pub gamma_s: f32,
    /// Width of the volume lobe, degrees.
    pub gamma_v: f32,
    /// Share of the area.
    pub a: f32,
    /// Of the tangents, degrees.
    offsets: &'static [f32],
    /// Of the pieces of curve between them.
    lengths: &'static [f32],
}

impl Yarn {
    /// A in `space`. The paper's colours are taken for linear sRGB, as its pictures are.
    pub fn colour(&self, space: ColourSpace) -> Vec3 {
        let srgb = Vec3::from_array(self.colour) * self.scale;
        if space == ColourSpace::LinearSrgb { srgb } else { ColourSpace::LinearSrgb.matrix_to(space) * srgb }
    }
}

/// A row of the table.
pub(crate) struct Fabric {
    name: &'static str,
    doc: &'static str,
    /// Along the tangent, and across it.
    pub threads: [Yarn; 2],
}

impl Fabric {
    /// The one called `name`.
    pub fn find(name: &str) -> Option<Self> {
        FABRICS.into_iter().find(|f| f.name == name)
    }

    /// Its tangent curves as the model's data: per thread the count of offsets, the offsets, one length less.
    pub fn curves(&self) -> Vec<f32> {
        let mut data = Vec::new();
        for Yarn { offsets, lengths, .. } in &self.threads {
            data.push(offsets.len() as f32);
            data.extend_from_slice(offsets);
            data.extend_from_slice(lengths);
        }
        data
    }
}

/// Names of the fabrics.
pub(crate) const PRESETS: [Preset; 6] = {
    let mut presets = [Preset { name: "", doc: "" }; 6];
    let mut i = 0;
    while i < 6 {
        presets[i] = Preset { name: FABRICS[i].name, doc: FABRICS[i].doc };
        i += 1;
    }
    presets
};

/// The table, a line a thread: η, the scale of the colour, k_d, γ_s, γ_v and the share of the area; the colour A; offsets
/// of the tangents; lengths between them. The tangent lengths and the charmeuse's twisted A = 0.2 follow the
/// published codes that agree with one another.
#[rustfmt::skip]
pub(crate) const FABRICS: [Fabric; 6] = [
    Fabric { name: "linen_plain", doc: "Linen plain weave (Sadeghi et al. 2013, Table II)", threads: [
        yarn([1.46, 0.3, 0.3, 12.0, 24.0, 0.33], [0.2, 0.8, 1.0], &[-25.0, 25.0], &[1.0]),
        yarn([1.46, 0.3, 0.3, 12.0, 24.0, 0.33], [0.2, 0.8, 1.0], &[-25.0, 25.0], &[1.0]),
    ] },
    Fabric { name: "silk_crepe_de_chine", doc: "Silk crêpe de Chine, flat and twisted threads (Sadeghi et al. 2013, Table II)", threads: [
        yarn([1.345, 0.12, 0.2, 5.0, 10.0, 0.75], [1.0, 0.95, 0.05], &[-35.0, -35.0, 35.0, 35.0], &[1.0, 1.0, 1.0]),
        yarn([1.345, 0.16, 0.3, 18.0, 32.0, 0.25], [1.0, 0.95, 0.05], &[0.0, 0.0], &[1.0]),
    ] },
    Fabric { name: "polyester_satin_charmeuse", doc: "Polyester satin charmeuse, front (Sadeghi et al. 2013, Table II)", threads: [
        yarn([1.539, 0.035, 0.1, 2.5, 5.0, 0.9], [1.0, 0.37, 0.3], &[-32.0, -32.0, -18.0, 0.0, 0.0, 18.0, 32.0, 32.0], &[1.33, 0.66, 2.0, 2.0, 2.0, 0.66, 1.33]),
        yarn([1.539, 0.2, 0.7, 30.0, 60.0, 0.1], [1.0, 0.37, 0.3], &[0.0, 0.0], &[1.0]),
    ] },
    Fabric { name: "polyester_satin_charmeuse_back", doc: "Polyester satin charmeuse, back (Sadeghi et al. 2013, Table II)", threads: [
        yarn([1.539, 0.035, 0.1, 2.5, 5.0, 0.67], [1.0, 0.37, 0.3], &[-30.0, -30.0, 30.0, 30.0, -5.0, -5.0, 5.0, 5.0], &[1.33, 1.33, 1.33, 0.0, 0.67, 0.67, 0.67]),
        yarn([1.539, 0.2, 0.7, 30.0, 60.0, 0.33], [1.0, 0.37, 0.3], &[0.0, 0.0], &[1.0]),
    ] },
    Fabric { name: "silk_shot", doc: "Shot silk, two colours of thread (Sadeghi et al. 2013, Table II)", threads: [
        yarn([1.345, 0.2, 0.1, 4.0, 8.0, 0.86], [0.1, 1.0, 0.4], &[-25.0, -25.0, 25.0, 25.0], &[1.33, 2.67, 1.33]),
        yarn([1.345, 0.6, 0.1, 5.0, 10.0, 0.14], [1.0, 0.0, 0.1], &[0.0, 0.0], &[1.0]),
    ] },
    Fabric { name: "velvet", doc: "Velvet, whose pile stands up (Sadeghi et al. 2013, Table II)", threads: [
        yarn([1.46, 0.3, 0.1, 6.0, 12.0, 0.5], [0.05, 0.02, 0.0], &[-90.0, -50.0], &[1.0]),
        yarn([1.46, 0.3, 0.1, 6.0, 12.0, 0.5], [0.05, 0.02, 0.0], &[-90.0, -55.0, 55.0, 90.0], &[0.5, 0.0, 0.5]),
    ] },
];

const fn yarn(
    [eta, scale, k_d, gamma_s, gamma_v, a]: [f32; 6],
    colour: [f32; 3],
    offsets: &'static [f32],
    lengths: &'static [f32],
) -> Yarn {
    Yarn { eta, colour, scale, k_d, gamma_s, gamma_v, a, offsets, lengths }
}
