//! `yugen simulate`: cloth of a scene in motion.

use crate::numbered::Numbered;
use crate::render::rate;
use crate::{argument, json, progress};
use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::json;
use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;
use yugen_archive::formats::pc2::PointCache;
use yugen_archive::formats::{self, mesh};
use yugen_archive::{atomic_write, check_outputs, check_writable};
use yugen_motion::cloth::{
    Along, Cloth, Fabric, Field, PRESETS, Settings, Sheet, SmallSteps, Solid, Stance, Step,
};
use yugen_optics::{Mat4, Vec2, Vec3};
use yugen_scene::{Geometry, Mesh, Scene, suggest};

/// Lets cloth of a scene fall, hang and lie, and writes where it goes.
///
/// `yugen simulate scene.toml --cloth robe -o robe.pc2` takes every mesh and rectangle whose name begins with `robe` for cloth and all
/// other meshes and spheres for bodies. (u, v) of the cloth are its pattern: threads run along them. What an animation of the scene moves
/// as it is moves here too. Out: .pc2 (a point cache, in the world's coordinates) or numbered meshes, `-o robe_%04d.obj`.
#[derive(Args)]
pub struct Simulate {
    /// The scene, or a mesh.
    scene: PathBuf,

    /// Where to: .pc2, or .obj with %04d where the number of the frame is.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Shapes of which the name begins so are cloth [default: all that a mesh file holds].
    #[arg(long, value_name = "NAME")]
    cloth: Option<String>,

    /// What it is made of.
    #[arg(long, default_value = "silk", value_parser = PRESETS.iter().map(|p| p.name).collect::<Vec<_>>(), value_name = "FABRIC")]
    fabric: String,

    /// Another number of the fabric, as in areal_mass=0.2; may be repeated.
    #[arg(long = "set", value_name = "QUANTITY=VALUE")]
    set: Vec<String>,

    /// Metres for a unit of u and of v [default: those that fit the mesh best].
    #[arg(long, value_name = "U,V", value_parser = scale)]
    pattern: Option<Vec2>,

    /// Vertices within R metres of X,Y,Z are attached, and go where the scene takes them; may be repeated.
    #[arg(long, value_name = "X,Y,Z,R", value_parser = pin, allow_hyphen_values = true)]
    pin: Vec<[f32; 4]>,

    /// A ground at this height, m.
    #[arg(long, value_name = "Y", allow_hyphen_values = true)]
    ground: Option<f32>,

    /// Velocity of the air, m/s.
    #[arg(long, value_name = "X,Y,Z", value_parser = velocity, allow_hyphen_values = true)]
    wind: Option<Vec3>,

    /// Frames.
    #[arg(long, default_value_t = 120, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,

    /// Frames a second.
    #[arg(long, default_value = "60", value_name = "F", value_parser = rate)]
    fps: f64,

    /// The scene's animation to play [default: the first].
    #[arg(long, value_name = "NAME")]
    animation: Option<String>,

    /// Substeps of a frame, at the least.
    #[arg(long, default_value_t = 20, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    substeps: u32,

    /// Cloth does not touch cloth: faster, where it does not fold.
    #[arg(long)]
    no_contact: bool,

    /// Threads [default: as many as there are cores]; the result does not depend on them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,

    /// Which way is up of a mesh file.
    #[arg(long, value_name = "AXIS", value_parser = ["y", "z"])]
    up: Option<String>,

    #[command(flatten)]
    reading: argument::Reading,

    /// A report as JSON.
    #[arg(long)]
    json: bool,
}

fn scale(text: &str) -> Result<Vec2, String> {
    let both = argument::numbers::<2>(text).or_else(|| text.parse().ok().map(|v| [v; 2]));
    let both = both.filter(|v| v.iter().all(|v| *v > 0.0 && v.is_finite())).map(Vec2::from_array);
    both.ok_or_else(|| "expected metres for a unit of u and of v, as in 0.38,3.5".into())
}

fn pin(text: &str) -> Result<[f32; 4], String> {
    let good = argument::numbers::<4>(text).filter(|p| p[3] > 0.0);
    good.ok_or_else(|| "expected a place and a radius above zero, as in 0,1.5,0,0.05".into())
}

fn velocity(text: &str) -> Result<Vec3, String> {
    let good = argument::numbers::<3>(text).map(Vec3::from_array).filter(|v| v.length() <= 100.0);
    good.ok_or_else(|| "expected a velocity of at most 100 m/s, as in 0,0,-3".into())
}

/// Shapes that are cloth, as one mesh.
struct Garment {
    /// Number of each shape in the scene, its name and how many vertices it has.
    shapes: Vec<(usize, String, usize)>,
    mesh: Mesh,
}

/// Cells along the longer side of a rectangle that is cloth.
const SHEET: f32 = 64.0;

/// A rectangle in square cells, nearly.
fn sheet(to_world: Mat4) -> Mesh {
    let sides = [to_world.x_axis, to_world.y_axis].map(|side| side.truncate().length());
    let cell = sides[0].max(sides[1]) / SHEET;
    let cells = sides.map(|side| if side > 0.0 { (side / cell).round().clamp(1.0, SHEET) as u32 } else { 1 });
    let flat = Sheet::rectangle(Vec3::new(-1.0, -1.0, 0.0), Vec3::X, Vec3::Y, Vec2::splat(2.0), cells);
    Mesh {
        uvs: flat.positions.iter().map(|p| 0.5 * p.truncate() + 0.5).collect(),
        positions: flat.positions,
        triangles: flat.triangles,
        ..Mesh::default()
    }
}

/// What of a scene is a body.
struct Body {
    shape: usize,
    /// Its mesh as it was, to see whether it deforms.
    mesh: Option<Arc<Mesh>>,
    solid: Solid,
}

/// Cells along the longest side of a body's distance field: a figure of 1.6 m has cells of 17 mm, and 3 MB.
const CELLS: f32 = 96.0;

impl Simulate {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let fabric = self.fabric()?;
        let meshes = Numbered::of(&self.output);
        let extension = self.output.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match (extension.as_str(), &meshes) {
            ("pc2", None) => check_writable(&self.output)?,
            ("obj", Some(numbered)) => check_writable(&numbered.frame(0))?,
            ("obj", None) => bail!(
                "{}: a mesh for each frame needs a number in its name, as in cloth_%04d.obj",
                self.output.display()
            ),
            _ => bail!("{}: cloth is written as .pc2 or as _%04d.obj", self.output.display()),
        }
        let mut options = self.reading.options();
        options.up = self.up.as_deref().map(|up| if up == "z" { mesh::Up::Z } else { mesh::Up::Y });
        let mut scene = formats::load_scene(&self.scene, &options)?;
        self.pose(&mut scene, 0.0)?;
        let garment = self.garment(&scene)?;
        if garment.mesh.uvs.is_empty() {
            bail!(
                "the cloth has no (u, v): they are its pattern, without which nobody knows where its threads run"
            );
        }
        let welded =
            Sheet::welded(&garment.mesh.positions, &garment.mesh.uvs, &garment.mesh.triangles, self.pattern);
        let Some(welded) = welded else {
            bail!(
                "the (u, v) of the cloth are no pattern: no scale makes them as large as the mesh; give --pattern"
            );
        };
        let cloth = Cloth::new(welded.sheet.clone(), &fabric).context("the cloth cannot be simulated")?;
        if welded.dropped > 0 {
            eprintln!("yugen: {} triangles of the cloth have no area and are left out", welded.dropped);
        }
        let crossed = if self.no_contact { Vec::new() } else { cloth.crossings(&welded.sheet.positions) };
        if let Some(((a, b), t)) = crossed.first().map(|(e, t)| ((e[0], e[1]), *t)) {
            let named = |v: u32| self.name_of(&garment, &welded.vertex, v);
            eprintln!(
                "yugen: the cloth passes through itself in {} places as it begins, first '{}' (at {}) and '{}': these stay as they are \
                 until it parts there",
                crossed.len(),
                named(a),
                (welded.sheet.positions[a as usize] + welded.sheet.positions[b as usize]) * 0.5,
                named(welded.sheet.triangles[t as usize][0])
            );
        }
        let attached: Vec<u32> = (0..welded.sheet.positions.len() as u32)
            .filter(|v| {
                let p = welded.sheet.positions[*v as usize];
                self.pin.iter().any(|[x, y, z, r]| p.distance(Vec3::new(*x, *y, *z)) <= *r)
            })
            .collect();
        if attached.is_empty() && !self.pin.is_empty() {
            bail!(
                "no vertex of the cloth lies within a --pin; its first is at {}",
                welded.sheet.positions[0]
            );
        }
        // Of each attached vertex one of the mesh, which says where it goes.
        let mut follows = vec![0usize; welded.sheet.positions.len()];
        for (i, v) in welded.vertex.iter().enumerate() {
            if let Some(v) = v {
                follows[*v as usize] = i;
            }
        }
        let bodies = self.bodies(&scene, &garment)?;
        let settings = Settings {
            seconds: (1.0 / self.fps) as f32,
            substeps: self.substeps,
            contact: !self.no_contact,
            threads: argument::threads(self.threads),
            ..Settings::default()
        };
        let ground =
            self.ground.map(|y| (Solid::Ground, Stance { origin: Vec3::Y * y, ..Stance::default() }));
        let solids = bodies
            .iter()
            .map(|b| Ok((b.solid.clone(), stance(&scene, b.shape))))
            .chain(ground.clone().map(Ok));
        let solids = solids.collect::<Result<Vec<_>>>()?;
        let mut solver = SmallSteps::new(cloth, &attached, settings)?.with_bodies(solids)?;
        if solver.softened() > 0.05 {
            eprintln!(
                "yugen: {:.0} % of the bends are softened: triangles are small for such stiff cloth; more --substeps help",
                solver.softened() * 100.0
            );
        }
        check_outputs(match &meshes {
            Some(numbered) => (0..self.frames).map(|f| numbered.frame(f)).collect(),
            None => vec![self.output.clone()],
        })?;
        let mut samples = Vec::new();
        let bar = progress::bar(self.frames.into(), self.json);
        let start = std::time::Instant::now();
        for frame in 0..self.frames {
            if frame > 0 {
                self.pose(&mut scene, f64::from(frame) / self.fps)?;
                for body in &bodies {
                    if let (Geometry::Mesh(now), Some(then)) =
                        (&scene.shapes[body.shape].geometry, &body.mesh)
                        && !Arc::ptr_eq(now, then)
                        && now.positions != then.positions
                    {
                        bail!(
                            "'{}' deforms; cloth meets bodies that move as they are",
                            scene.shapes[body.shape].name
                        );
                    }
                }
                let mut stances: Vec<Stance> = bodies.iter().map(|b| stance(&scene, b.shape)).collect();
                stances.extend(ground.as_ref().map(|g| g.1));
                let targets: Vec<Vec3> = if attached.is_empty() {
                    Vec::new()
                } else {
                    let now = positions(&scene, &garment);
                    attached.iter().map(|v| now[follows[*v as usize]]).collect()
                };
                let wind = self.wind.unwrap_or(Vec3::ZERO);
                solver.step(&Step { wind, targets: &targets, stances: &stances, ..Step::default() });
            }
            let own = &garment.mesh.positions;
            let at =
                welded.vertex.iter().zip(own).map(|(v, p)| v.map_or(*p, |v| solver.positions()[v as usize]));
            let points: Vec<Vec3> = at.collect();
            match &meshes {
                Some(numbered) => {
                    let text =
                        obj(&garment, &points, &welded.vertex, solver.positions(), &welded.sheet.triangles);
                    atomic_write(&numbered.frame(frame), text.as_bytes())?;
                }
                None => samples.push(points),
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        let seconds = start.elapsed().as_secs_f64();
        if meshes.is_none() {
            PointCache { start: 0.0, rate: 1.0, samples }.write(&self.output)?;
        }
        let stretch = solver.cloth().stretch(solver.positions(), |a| a != Along::Bias);
        let crossings = solver.cloth().crossings(solver.positions()).len();
        let ms = seconds * 1e3 / f64::from(self.frames);
        if self.json {
            json::print(json!({
                "output": self.output, "frames": self.frames, "vertices": solver.positions().len(),
                "attached": attached.len(), "bodies": bodies.len(), "substeps": solver.substeps(),
                "pattern": welded.scale.to_array(), "stretch": stretch.p999, "crossings": crossings,
                "crossings_at_start": crossed.len(), "ms_per_frame": ms,
            }));
        } else {
            println!(
                "{}: {} frames of {} vertices, {ms:.0} ms each; in the last, threads are stretched by {:.1} % (99.9 of 100 by less), {} \
                 edges pass through triangles",
                self.output.display(),
                self.frames,
                solver.positions().len(),
                stretch.p999 * 100.0,
                crossings
            );
        }
        Ok(())
    }

    fn fabric(&self) -> Result<Fabric> {
        let preset = Fabric::preset(&self.fabric).context("a fabric of the list was expected")?;
        let mut fabric = preset.fabric;
        for text in &self.set {
            let pair =
                text.split_once('=').and_then(|(k, v)| Some((k.trim(), v.trim().parse::<f32>().ok()?)));
            let Some((name, value)) = pair else {
                bail!("--set {text}: expected QUANTITY=VALUE with a number, as in areal_mass=0.2");
            };
            let Some(quantity) = yugen_motion::cloth::QUANTITIES.iter().find(|q| q.name == name) else {
                let known = yugen_motion::cloth::QUANTITIES.iter().map(|q| q.name);
                bail!("a fabric has no quantity '{name}'{}", suggest(name, known));
            };
            *(quantity.place)(&mut fabric) = value;
        }
        fabric.check()?;
        Ok(fabric)
    }

    fn pose(&self, scene: &mut Scene, seconds: f64) -> Result<()> {
        if !scene.figures.is_empty() || !scene.caches.is_empty() {
            scene.pose(self.animation.as_deref(), seconds as f32)?;
        } else if let Some(name) = &self.animation {
            bail!("there is no animation called '{name}': nothing in {} moves", self.scene.display());
        }
        Ok(())
    }

    fn is_cloth(&self, name: &str) -> bool {
        self.cloth.as_ref().is_none_or(|cloth| name.starts_with(cloth.as_str()))
    }

    fn garment(&self, scene: &Scene) -> Result<Garment> {
        let is_mesh = |g: &Geometry| matches!(g, Geometry::Mesh(_) | Geometry::Rectangle);
        let extension = self.scene.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let alone = formats::MESH_FORMATS.iter().any(|(_, e)| e.contains(&extension.as_str()));
        if self.cloth.is_none() && !alone {
            let names = scene.shapes.iter().filter(|s| is_mesh(&s.geometry)).map(|s| s.name.as_str());
            bail!(
                "which shapes are cloth? Give --cloth with the beginning of their names{}",
                suggest("", names)
            );
        }
        let mut garment = Garment { shapes: Vec::new(), mesh: Mesh::default() };
        for (i, shape) in scene.shapes.iter().enumerate() {
            let mesh = match &shape.geometry {
                Geometry::Mesh(mesh) => mesh.clone(),
                Geometry::Rectangle => Arc::new(sheet(shape.to_world)),
                _ => continue,
            };
            // A mesh file by itself is framed on a floor of ours.
            if !self.is_cloth(&shape.name) || (alone && self.cloth.is_none() && mesh.uvs.is_empty()) {
                continue;
            }
            let first = garment.mesh.positions.len() as u32;
            garment.mesh.positions.extend(mesh.positions.iter().map(|p| shape.to_world.transform_point3(*p)));
            garment.mesh.uvs.extend_from_slice(&mesh.uvs);
            garment.mesh.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
            garment.shapes.push((i, shape.name.clone(), mesh.positions.len()));
        }
        if garment.shapes.is_empty() {
            let name = self.cloth.clone().unwrap_or_default();
            let known = scene.shapes.iter().filter(|s| is_mesh(&s.geometry)).map(|s| s.name.as_str());
            bail!(
                "no mesh or rectangle of {} has a name that begins with '{name}'{}",
                self.scene.display(),
                suggest(&name, known)
            );
        }
        if garment.mesh.uvs.len() != garment.mesh.positions.len() {
            garment.mesh.uvs.clear();
        }
        Ok(garment)
    }

    fn bodies(&self, scene: &Scene, garment: &Garment) -> Result<Vec<Body>> {
        let mut bodies = Vec::new();
        if self.cloth.is_none() {
            return Ok(bodies);
        }
        for (i, shape) in scene.shapes.iter().enumerate() {
            if garment.shapes.iter().any(|g| g.0 == i) {
                continue;
            }
            let (scale, ..) = shape.to_world.to_scale_rotation_translation();
            let (solid, mesh) = match &shape.geometry {
                Geometry::Mesh(mesh) => {
                    let positions: Vec<Vec3> = mesh.positions.iter().map(|p| *p * scale).collect();
                    let bounds = positions
                        .iter()
                        .fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |b, p| [b[0].min(*p), b[1].max(*p)]);
                    let longest = (bounds[1] - bounds[0]).max_element();
                    let field = Field::new(&positions, &mesh.triangles, longest / CELLS);
                    let field = field.with_context(|| format!("'{}' cannot be a body", shape.name))?;
                    (Solid::Field(Arc::new(field)), Some(mesh.clone()))
                }
                // One that is not round is as thick as its thickest.
                Geometry::Sphere => {
                    (Solid::Capsule { ends: [Vec3::ZERO; 2], radii: [scale.abs().max_element(); 2] }, None)
                }
                _ => {
                    tracing::warn!(
                        "cloth passes through '{}', which is neither a mesh nor a sphere; --ground Y gives it a floor",
                        shape.name
                    );
                    continue;
                }
            };
            bodies.push(Body { shape: i, mesh, solid });
        }
        Ok(bodies)
    }

    /// Name of the shape that has a vertex of the sheet.
    fn name_of(&self, garment: &Garment, vertex: &[Option<u32>], v: u32) -> String {
        let mut at = vertex.iter().position(|w| *w == Some(v)).unwrap_or(0);
        for (_, name, count) in &garment.shapes {
            if at < *count {
                return name.clone();
            }
            at -= count;
        }
        String::new()
    }
}

/// Where the vertices of the cloth are in the scene as it is posed.
fn positions(scene: &Scene, garment: &Garment) -> Vec<Vec3> {
    let mut all = Vec::with_capacity(garment.mesh.positions.len());
    for (i, _, count) in &garment.shapes {
        let shape = &scene.shapes[*i];
        if let Geometry::Mesh(mesh) = &shape.geometry {
            all.extend(mesh.positions.iter().take(*count).map(|p| shape.to_world.transform_point3(*p)));
        }
    }
    all
}

/// Without scale, which is in the body's own coordinates.
fn stance(scene: &Scene, shape: usize) -> Stance {
    Stance::of(&scene.shapes[shape].to_world)
}

/// A mesh as Wavefront OBJ, an object for each shape, with smooth normals.
fn obj(
    garment: &Garment,
    points: &[Vec3],
    vertex: &[Option<u32>],
    welded: &[Vec3],
    triangles: &[[u32; 3]],
) -> String {
    let mut normals = vec![Vec3::ZERO; welded.len()];
    for t in triangles {
        let [a, b, c] = t.map(|v| welded[v as usize]);
        t.iter().for_each(|v| normals[*v as usize] += (b - a).cross(c - a));
    }
    let mut text = String::with_capacity(points.len() * 100);
    // Writing to a string does not fail.
    for p in points {
        let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
    }
    for t in &garment.mesh.uvs {
        // v of a file runs up.
        let _ = writeln!(text, "vt {} {}", t.x, 1.0 - t.y);
    }
    for v in vertex {
        let n = v.map_or(Vec3::Y, |v| normals[v as usize].normalize_or(Vec3::Y));
        let _ = writeln!(text, "vn {:.5} {:.5} {:.5}", n.x, n.y, n.z);
    }
    let mut first = 0;
    let mut rest = garment.mesh.triangles.iter().peekable();
    for (_, name, count) in &garment.shapes {
        let _ = writeln!(text, "o {}", name.replace(char::is_whitespace, "_"));
        first += *count as u32;
        while let Some(t) = rest.next_if(|t| t[0] < first) {
            let [a, b, c] = t.map(|v| v + 1);
            let _ = writeln!(text, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_the_command_line_are_read_or_told() {
        assert_eq!(scale("0.5"), Ok(Vec2::splat(0.5)));
        assert_eq!(scale("0.38,3.5"), Ok(Vec2::new(0.38, 3.5)));
        assert!(scale("0,1").is_err() && scale("x").is_err());
        assert_eq!(pin("0,1.5,0,0.05"), Ok([0.0, 1.5, 0.0, 0.05]));
        assert!(pin("0,1.5,0,0").is_err() && velocity("1,2").is_err() && velocity("1e9,0,0").is_err());
    }
}
