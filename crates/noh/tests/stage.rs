//! Parts are closed, and the geometry is as long and wide as the table says.

use glam::Vec3;
use yugen_noh::solid::{Solids, check_closed};
use yugen_noh::{PRESETS, Part, Stage};

fn part<'a>(stage: &'a Stage, id: &str) -> &'a Part {
    stage.parts().iter().find(|p| p.id == id).unwrap_or_else(|| panic!("no part {id}"))
}

fn bounds(part: &Part) -> [Vec3; 2] {
    let all = part.mesh.positions.iter();
    all.fold([Vec3::MAX, Vec3::MIN], |[low, high], p| [low.min(*p), high.max(*p)])
}

#[test]
fn every_part_of_every_stage_is_closed() {
    for preset in PRESETS {
        let stage = Stage::preset(preset.name).unwrap();
        let mut ids = std::collections::BTreeSet::new();
        for part in stage.parts() {
            if let Err(e) = check_closed(&part.mesh) {
                panic!("{}: {}: {e}", preset.name, part.id);
            }
            assert!(ids.insert(part.id.clone()), "{} twice", part.id);
            let mesh = &part.mesh;
            assert!(mesh.uvs.len() == mesh.positions.len() && mesh.normals.len() == mesh.positions.len());
            assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4), "{}", part.id);
            // Shading normals look to the side that the triangle does.
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
                let face = (b - a).cross(c - a);
                let sum: Vec3 = t.iter().map(|i| mesh.normals[*i as usize]).sum();
                assert!(face.dot(sum) > 0.0, "{}: {}: {a} {b} {c}", preset.name, part.id);
            }
        }
    }
}

#[test]
fn what_is_not_closed_is_found() {
    let stage = Stage::preset("textbook").unwrap();
    let good = &part(&stage, "shite-bashira").mesh;
    check_closed(good).unwrap();
    let mut open = (**good).clone();
    open.triangles.pop();
    assert!(check_closed(&open).is_err());
    let mut turned = (**good).clone();
    turned.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    assert!(check_closed(&turned).is_err());
    let mut torn = (**good).clone();
    torn.positions[0] += Vec3::X * 1e-3;
    assert!(check_closed(&torn).is_err());
    assert!(check_closed(&Solids::new().mesh("")).is_err());
}
