//! What the lighting of the paper needs to know of a scene beside its lights.

use glam::Vec3;
use yugen_scene::prepared::Rows;

/// The centre of the ambient map, and in the last number what its values count.
pub fn ambient_map(rows: &Rows) -> [f32; 4] {
    middle(rows).extend(flame_unit(rows)).to_array()
}

/// The middle of all that is drawn.
fn middle(rows: &Rows) -> Vec3 {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for draw in &rows.draws {
        let row = |r: [f32; 4], p: Vec3| r[0] * p.x + r[1] * p.y + r[2] * p.z + r[3];
        let first = draw.first_triangle as usize;
        for v in rows.triangles.iter().skip(first).take(draw.triangles as usize).flatten() {
            let p = Vec3::from(rows.vertices[*v as usize].position);
            let p = Vec3::from(draw.to_world.map(|r| row(r, p)));
            (low, high) = (low.min(p), high.max(p));
        }
    }
    if low.is_finite() && high.is_finite() { 0.5 * (low + high) } else { Vec3::ZERO }
}

/// What a value of the ambient map counts in the paper's equations. Both the colour of a fire, C_l, which falls off with the square of
/// the distance, and that of the map, C_a, are colours of flames there; so the middle of a flame in the map counts what lights a
/// surface at one metre: intensity over radiance, m², over π as in the diffuse term. 1 where nothing burns.
fn flame_unit(rows: &Rows) -> f32 {
    let units = rows.volumes.iter().filter_map(|v| {
        let grid = &v.grid;
        let (mut of, mut at) = (0.0, Vec3::ZERO);
        for (cell, p) in grid.data.iter().zip(grid.centres()) {
            let light = cell[0] + cell[1] + cell[2];
            of += light;
            at += p * light;
        }
        let away = Vec3::X * (grid.upper - grid.lower).length();
        let seen = grid.march(at / of + away, Vec3::NEG_X, [0.0, 2.0 * away.x], grid.cell().min_element());
        let intensity = grid.intensity(glam::DVec3::X).as_vec3().element_sum();
        // To the world: the edges of the box there over those of the grid.
        let size =
            (v.to_unit.determinant() * (grid.upper - grid.lower).element_product()).abs().cbrt().recip();
        let unit = intensity / seen.radiance.element_sum() * size * size / std::f32::consts::PI;
        unit.is_finite().then_some(unit)
    });
    let units: Vec<f32> = units.collect();
    if units.is_empty() { 1.0 } else { units.iter().sum::<f32>() / units.len() as f32 }
}
