//! What air does to a vertex.

use glam::Vec4;

/// Density of air, kg/m³, at 15 °C.
pub(super) const AIR: f32 = 1.225;
/// Drag coefficients of a plate across and along the wind: 1.17 for plates as long as wide (Hoerner 1965), .02 for
/// turbulent friction on both sides (assumed).
pub(super) const DRAG: [f32; 2] = [1.17, 0.02];

/// Air in motion.
#[derive(Clone, Copy)]
pub(super) struct Air {
    /// m/s.
    pub wind: Vec4,
}

impl Air {
    /// What it adds, m/s, to the velocity `v` of a vertex whose normal is as long as its `area`, m²; `seconds_per_mass` is the time that it
    /// acts over the mass of the vertex, s/kg. Implicit in its own speed: air stops a cloth, and does not throw it back.
    pub fn pull(self, v: Vec4, area: Vec4, seconds_per_mass: f32) -> Vec4 {
        let a = area.length();
        if a <= 0.0 {
            return Vec4::ZERO;
        }
        let n = area / a;
        let relative = self.wind - v;
        let across = n * relative.dot(n);
        let along = relative - across;
        let pull = |u: Vec4, drag: f32| {
            let c = 0.5 * AIR * drag * a * u.length() * seconds_per_mass;
            u * (c / (1.0 + c))
        };
        pull(across, DRAG[0]) + pull(along, DRAG[1])
    }
}
