//! Scenes that several programs move, and the files by which they get them.

use crate::{Result, drape};
use glam::{Vec2, Vec3};
use std::path::Path;
use yugen_motion::cloth::{Fabric, PRESETS, Sheet};

/// Frames of a sixtieth of a second of each scene, and of how many one is a sample.
pub const FRAMES: u32 = 60;
/// One of so many is a sample.
pub const EVERY: u32 = 10;

/// Cloth and what it falls on.
pub struct Case {
    /// In the names of files: one word.
    pub file: String,
    /// In the tables.
    pub name: String,
    /// In its rest.
    pub sheet: Sheet,
    /// Where its vertices begin, m.
    pub start: Vec<Vec3>,
    /// Those that stay there.
    pub held: Vec<u32>,
    /// Middle and radius of the ball it falls on, m.
    pub ball: Option<(Vec3, f32)>,
}

/// Habutae.
pub fn fabric() -> Fabric {
    PRESETS[0].fabric
}

/// What other programs keep from a body at the least, m.
const CLEAR: f32 = 0.001;

/// Square sheets of `size` metres one above the other, 6 mm apart, a centimetre above a ball of a quarter of that.
pub fn sheets(file: &str, name: &str, count: u32, size: f32, cells: u32) -> Case {
    let radius = 0.25 * size;
    let mut sheet = Sheet::default();
    for layer in 0..count {
        let height = radius + 0.01 + 0.006 * layer as f32;
        let corner = Vec3::new(-0.5 * size, height, -0.5 * size);
        let mut one = Sheet::rectangle(corner, Vec3::X, Vec3::Z, Vec2::splat(size), [cells; 2]);
        // Beside each other in the flat cloth.
        one.flat.iter_mut().flatten().for_each(|p| p.x += 2.0 * size * layer as f32);
        sheet.join(one);
    }
    let start = sheet.positions.clone();
    let ball = Some((Vec3::ZERO, radius));
    Case { file: file.into(), name: name.into(), sheet, start, held: Vec::new(), ball }
}

/// Those of the tables.
pub fn all() -> Vec<Case> {
    let cell = 0.0042;
    let sheet = drape::disc(cell);
    let (held, start) = (drape::held(&sheet, cell), drape::bent(&sheet));
    let disc = Case { file: "disc".into(), name: "Cusick's disc".into(), held, start, sheet, ball: None };
    vec![
        disc,
        sheets("sheet-small", "sheet on a ball", 1, 1.0, 64),
        sheets("layers", "three sheets on a ball", 3, 0.6, 36),
        sheets("sheet-large", "sheet on a ball", 1, 1.0, 128),
    ]
}

/// Lengths of the edges of triangles in the mean, m.
fn mean_edge(sheet: &Sheet) -> f32 {
    let sides = |t: &[u32; 3]| {
        let p = t.map(|v| sheet.positions[v as usize]);
        (p[0].distance(p[1]) + p[1].distance(p[2]) + p[2].distance(p[0])) / 3.0
    };
    sheet.triangles.iter().map(sides).sum::<f32>() / sheet.triangles.len() as f32
}

/// Writes `file.case`, a quantity a line, and arrays of 32 bits: `.positions` to begin with, `.triangles`, `.flat`, a place in the flat
/// cloth for each vertex, and `.held`.
pub fn write(folder: &Path, case: &Case) -> Result<()> {
    let file = |kind: &str| folder.join(format!("{}.{kind}", case.file));
    let floats = |all: &mut dyn Iterator<Item = f32>| all.flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
    let words = |all: &mut dyn Iterator<Item = u32>| all.flat_map(u32::to_le_bytes).collect::<Vec<u8>>();
    let mut flat = vec![Vec2::ZERO; case.sheet.positions.len()];
    for (corners, places) in case.sheet.triangles.iter().zip(&case.sheet.flat) {
        corners.iter().zip(places).for_each(|(v, place)| flat[*v as usize] = *place);
    }
    std::fs::write(file("positions"), floats(&mut case.start.iter().flat_map(|p| p.to_array())))?;
    std::fs::write(file("flat"), floats(&mut flat.iter().flat_map(|p| p.to_array())))?;
    std::fs::write(file("triangles"), words(&mut case.sheet.triangles.iter().flatten().copied()))?;
    std::fs::write(file("held"), words(&mut case.held.iter().copied()))?;
    let f = fabric();
    let area: f32 = case.sheet.flat.iter().map(|t| 0.5 * (t[1] - t[0]).perp_dot(t[2] - t[0]).abs()).sum();
    let cell = (2.0 * area / case.sheet.triangles.len() as f32).sqrt();
    let [along_warp, along_weft] = f.rigidity();
    // Those at which ours keeps cloth from a body and from itself.
    let [body, cloth] = [(0.5 * f.thickness).max(CLEAR), f.thickness.max(0.2 * mean_edge(&case.sheet))];
    let mut text = format!(
        "frames {FRAMES}\nevery {EVERY}\nareal_mass {}\nmoduli {} {} {}\nrigidity {along_warp} {along_weft}\ndamping {} {}\n\
         friction {} {}\ndistance {body} {cloth}\ncell {cell}\n",
        f.areal_mass, f.weft, f.warp, f.shear, f.damping, f.bending_damping, f.friction, f.layer_friction
    );
    if let Some((middle, radius)) = case.ball {
        text += &format!("ball {} {} {} {radius}\n", middle.x, middle.y, middle.z);
    }
    Ok(std::fs::write(file("case"), text)?)
}
