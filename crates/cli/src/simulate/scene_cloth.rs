//! Cloth that is in a scene: its meshes and rectangles, and the shapes that are bodies.

use super::output::Surface;
use super::subject::{Subject, Task};
use crate::argument;
use anyhow::{Context, Result, bail};
use std::sync::Arc;
use yugen_archive::formats;
use yugen_motion::cloth::rows::Now;
use yugen_motion::cloth::{Cloth, Fabric, Field, Settings, Sheet, SmallSteps, Solid, Stance, Step, Welded};
use yugen_optics::{Mat4, Vec2, Vec3};
use yugen_scene::{Geometry, Mesh, Scene, suggest};

/// Shapes that are cloth, as one mesh.
struct Pieces {
    /// Number of each shape in the scene, its name, and its mesh in its own coordinates: of a rectangle the one made of it.
    shapes: Vec<(usize, String, Arc<Mesh>)>,
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

/// Cloth of a scene in motion.
pub struct SceneCloth {
    task: Task,
    scene: Scene,
    pieces: Pieces,
    surface: Surface,
    bodies: Vec<Body>,
    ground: Option<Stance>,
    solver: SmallSteps,
    /// Of each attached vertex one of the mesh, which says where it goes.
    follows: Vec<usize>,
    /// Where attached vertices and bodies are in the last frame that was asked for.
    targets: Vec<Vec3>,
    stances: Vec<Stance>,
    wind: Vec3,
    crossed: usize,
}

/// Substeps of a frame where none are asked for.
const SUBSTEPS: u32 = 20;

impl SceneCloth {
    /// The cloth of a scene; from a memory where there is one.
    pub fn new(task: Task, mut scene: Scene, fabric: &Fabric, memory: Option<&[f32]>) -> Result<Self> {
        let options = &task.options;
        options.pose(&task.file, &mut scene, 0.0)?;
        let pieces = task.pieces(&scene)?;
        if pieces.mesh.uvs.is_empty() {
            bail!(
                "the cloth has no (u, v): they are its pattern, without which nobody knows where its threads run"
            );
        }
        let welded =
            Sheet::welded(&pieces.mesh.positions, &pieces.mesh.uvs, &pieces.mesh.triangles, options.pattern);
        let Some(welded) = welded else {
            bail!(
                "the (u, v) of the cloth are no pattern: no scale makes them as large as the mesh; give --pattern"
            );
        };
        let cloth = Cloth::new(welded.sheet.clone(), fabric).context("the cloth cannot be simulated")?;
        if welded.dropped > 0 {
            eprintln!("yugen: {} triangles of the cloth have no area and are left out", welded.dropped);
        }
        let crossed = if options.no_contact { 0 } else { tell_crossings(&cloth, &welded, &pieces) };
        let attached: Vec<u32> = (0..welded.sheet.positions.len() as u32)
            .filter(|v| {
                let p = welded.sheet.positions[*v as usize];
                options.pin.iter().any(|[x, y, z, r]| p.distance(Vec3::new(*x, *y, *z)) <= *r)
            })
            .collect();
        if attached.is_empty() && !options.pin.is_empty() {
            bail!(
                "no vertex of the cloth lies within a --pin; its first is at {}",
                welded.sheet.positions[0]
            );
        }
        let mut follows = vec![0usize; welded.sheet.positions.len()];
        for (i, v) in welded.vertex.iter().enumerate() {
            if let Some(v) = v {
                follows[*v as usize] = i;
            }
        }
        let follows = attached.iter().map(|v| follows[*v as usize]).collect();
        let bodies = task.bodies(&scene, &pieces, fabric.thickness)?;
        let settings = Settings {
            seconds: (1.0 / options.fps) as f32,
            substeps: options.substeps.unwrap_or(SUBSTEPS),
            contact: !options.no_contact,
            lines: true,
            threads: argument::threads(options.threads),
            ..Settings::default()
        };
        let ground = options.ground.map(|y| Stance { origin: Vec3::Y * y, ..Stance::default() });
        let solids = bodies.iter().map(|b| (b.solid.clone(), stance(&scene, b.shape)));
        let solids = solids.chain(ground.map(|g| (Solid::Ground, g))).collect();
        let mut solver = SmallSteps::new(cloth, &attached, settings)?.with_bodies(solids)?;
        if solver.softened() > 0.05 {
            eprintln!(
                "yugen: {:.0} % of the bends are softened: triangles are small for such stiff cloth; more --substeps help",
                solver.softened() * 100.0
            );
        }
        if memory.is_some_and(|m| !solver.recall(m)) {
            bail!("the checkpoint is of another cloth; --restart throws it away");
        }
        let surface = Surface {
            objects: pieces
                .shapes
                .iter()
                .map(|(_, name, mesh)| (name.clone(), mesh.positions.len()))
                .collect(),
            uvs: pieces.mesh.uvs.clone(),
            triangles: pieces.mesh.triangles.clone(),
            vertex: welded.vertex,
            sheet: welded.sheet.triangles,
            scale: Some(welded.scale),
        };
        Ok(Self {
            wind: options.wind.unwrap_or(Vec3::ZERO),
            task,
            scene,
            pieces,
            surface,
            bodies,
            ground,
            solver,
            follows,
            targets: Vec::new(),
            stances: Vec::new(),
            crossed,
        })
    }

    /// Where attached vertices and bodies are in a frame.
    fn go_to(&mut self, frame: u32) -> Result<()> {
        let options = &self.task.options;
        options.pose(&self.task.file, &mut self.scene, f64::from(frame) / options.fps)?;
        let scene = &self.scene;
        for body in &self.bodies {
            if let (Geometry::Mesh(now), Some(then)) = (&scene.shapes[body.shape].geometry, &body.mesh)
                && !Arc::ptr_eq(now, then)
                && now.positions != then.positions
            {
                bail!(
                    "'{}' deforms; cloth meets bodies that move as they are",
                    scene.shapes[body.shape].name
                );
            }
        }
        self.stances = self.bodies.iter().map(|b| stance(scene, b.shape)).chain(self.ground).collect();
        if !self.follows.is_empty() {
            let now = positions(scene, &self.pieces);
            self.targets = self.follows.iter().map(|i| now[*i]).collect();
        }
        Ok(())
    }
}

fn acting<'a>(wind: Vec3, targets: &'a [Vec3], stances: &'a [Stance]) -> Step<'a> {
    Step { wind, targets, stances, ..Step::default() }
}

/// Says where a cloth passes through itself as it begins.
fn tell_crossings(cloth: &Cloth, welded: &Welded, pieces: &Pieces) -> usize {
    let at = &welded.sheet.positions;
    let crossed = cloth.crossings(at);
    if let Some((edge, triangle)) = crossed.first() {
        let named = |v: u32| pieces.name_of(&welded.vertex, v);
        eprintln!(
            "yugen: the cloth passes through itself in {} places as it begins, first '{}' (at {}) and '{}': these stay as they are \
             until it parts there",
            crossed.len(),
            named(edge[0]),
            (at[edge[0] as usize] + at[edge[1] as usize]) * 0.5,
            named(welded.sheet.triangles[*triangle as usize][0])
        );
    }
    crossed.len()
}

impl Subject for SceneCloth {
    fn surface(&self) -> &Surface {
        &self.surface
    }

    fn solver(&self) -> &SmallSteps {
        &self.solver
    }

    fn recall(&mut self, memory: &[f32]) -> bool {
        self.solver.recall(memory)
    }

    fn shapes(&self) -> Vec<usize> {
        self.pieces.shapes.iter().map(|(shape, ..)| *shape).collect()
    }

    fn search_anew(&mut self) {
        self.solver.search_anew();
    }

    fn frames(&self) -> u32 {
        120
    }

    fn blow(&mut self, wind: Vec3) {
        self.wind = wind;
    }

    fn points(&self) -> Vec<Vec3> {
        let own = self.surface.vertex.iter().zip(&self.pieces.mesh.positions);
        own.map(|(v, p)| v.map_or(*p, |v| self.solver.positions()[v as usize])).collect()
    }

    fn step(&mut self, frame: u32) -> Result<()> {
        self.go_to(frame)?;
        let Self { solver, wind, targets, stances, .. } = self;
        solver.step(&acting(*wind, targets, stances));
        Ok(())
    }

    fn given(&mut self, frame: u32) -> Result<Step<'_>> {
        self.go_to(frame)?;
        Ok(acting(self.wind, &self.targets, &self.stances))
    }

    fn go_on(&mut self, now: &Now) -> bool {
        self.solver.go_on(now)
    }

    fn report(&self) -> serde_json::Value {
        serde_json::json!({
            "attached": self.follows.len(), "bodies": self.bodies.len(),
            "pattern": self.surface.scale.unwrap_or(Vec2::ONE).to_array(), "crossings_at_start": self.crossed,
        })
    }
}

impl Task {
    fn is_cloth(&self, name: &str) -> bool {
        self.options.cloth.as_ref().is_none_or(|cloth| name.starts_with(cloth.as_str()))
    }

    fn pieces(&self, scene: &Scene) -> Result<Pieces> {
        let is_mesh = |g: &Geometry| matches!(g, Geometry::Mesh(_) | Geometry::Rectangle);
        let extension = self.file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let alone = formats::MESH_FORMATS.iter().any(|(_, e)| e.contains(&extension.as_str()));
        if self.options.cloth.is_none() && !alone {
            let names = scene.shapes.iter().filter(|s| is_mesh(&s.geometry)).map(|s| s.name.as_str());
            bail!(
                "which shapes are cloth? Give --cloth with the beginning of their names{}",
                suggest("", names)
            );
        }
        let mut pieces = Pieces { shapes: Vec::new(), mesh: Mesh::default() };
        for (i, shape) in scene.shapes.iter().enumerate() {
            let mesh = match &shape.geometry {
                Geometry::Mesh(mesh) => mesh.clone(),
                Geometry::Rectangle => Arc::new(sheet(shape.to_world)),
                _ => continue,
            };
            // A mesh file by itself is framed on a floor of ours.
            if !self.is_cloth(&shape.name) || (alone && self.options.cloth.is_none() && mesh.uvs.is_empty()) {
                continue;
            }
            let first = pieces.mesh.positions.len() as u32;
            pieces.mesh.positions.extend(mesh.positions.iter().map(|p| shape.to_world.transform_point3(*p)));
            pieces.mesh.uvs.extend_from_slice(&mesh.uvs);
            pieces.mesh.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
            pieces.shapes.push((i, shape.name.clone(), mesh));
        }
        if pieces.shapes.is_empty() {
            let name = self.options.cloth.clone().unwrap_or_default();
            let known = scene.shapes.iter().filter(|s| is_mesh(&s.geometry)).map(|s| s.name.as_str());
            bail!(
                "no mesh or rectangle of {} has a name that begins with '{name}'{}",
                self.file.display(),
                suggest(&name, known)
            );
        }
        if pieces.mesh.uvs.len() != pieces.mesh.positions.len() {
            pieces.mesh.uvs.clear();
        }
        Ok(pieces)
    }

    /// `thickness` of the cloth, m: a field is known to three cells, and cloth keeps half of it.
    fn bodies(&self, scene: &Scene, pieces: &Pieces, thickness: f32) -> Result<Vec<Body>> {
        let mut bodies = Vec::new();
        if self.options.cloth.is_none() {
            return Ok(bodies);
        }
        for (i, shape) in scene.shapes.iter().enumerate() {
            if pieces.shapes.iter().any(|g| g.0 == i) {
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
                    let cell = (longest / CELLS).max(0.25 * thickness);
                    let field = Field::new(&positions, &mesh.triangles, cell);
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
}

impl Pieces {
    /// Name of the shape that has a vertex of the sheet.
    fn name_of(&self, vertex: &[Option<u32>], v: u32) -> String {
        let mut at = vertex.iter().position(|w| *w == Some(v)).unwrap_or(0);
        for (_, name, mesh) in &self.shapes {
            let count = mesh.positions.len();
            if at < count {
                return name.clone();
            }
            at -= count;
        }
        String::new()
    }
}

/// Where the vertices of the cloth are in the scene as it is posed.
fn positions(scene: &Scene, pieces: &Pieces) -> Vec<Vec3> {
    let mut all = Vec::with_capacity(pieces.mesh.positions.len());
    for (i, _, own) in &pieces.shapes {
        let shape = &scene.shapes[*i];
        let mesh = match &shape.geometry {
            Geometry::Mesh(mesh) => mesh,
            _ => own,
        };
        all.extend(
            mesh.positions.iter().take(own.positions.len()).map(|p| shape.to_world.transform_point3(*p)),
        );
    }
    all
}

/// Without scale, which is in the body's own coordinates.
fn stance(scene: &Scene, shape: usize) -> Stance {
    Stance::of(&scene.shapes[shape].to_world)
}
