//! Fires of a scene: flames, logs and sparks, each as a function of time.

use crate::{Geometry, Light, Material, MaterialId, Mesh, Scene, Shape, Texture, TextureId, Value};
use glam::{Mat4, Vec3};
use std::sync::Arc;
use yugen_motion::fire::{Burning, Fire, FireError, Grid, Logs};
use yugen_optics::parallel::{parallel, threads};

/// For how long the film of a spark is open, s: it is seen as a streak.
const EXPOSURE: f32 = 1.0 / 60.0;
/// Attribute of the meshes of logs and sparks: what they emit.
const GLOW: &str = "glow";
/// Charcoal reflects hardly anything.
const CHARCOAL: f32 = 0.04;
/// And emits nearly what a black body does.
const EMISSIVITY: f32 = 0.9;
/// Seconds between the moments that a mean over time is made of: fires as large as a basket puff a few times a second.
const STEP: f64 = 0.125;
/// The longest that flames are averaged over, s: as long as the animation of a fire.
const WINDOW: f32 = 60.0;
/// Cells over the diameter of the fuel bed, unless something else is asked for.
const FINENESS: f32 = 20.0;

/// A fire of a scene, posed by [`Scene::pose`].
pub struct SceneFire {
    burning: Burning,
    /// Edge of a cell, m.
    cell: f32,
    /// Index of its light.
    light: usize,
    logs: Logs,
    /// Indices of the shapes of its logs and sparks.
    shapes: [usize; 2],
}

impl std::fmt::Debug for SceneFire {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SceneFire").field("fire", self.burning.fire()).field("light", &self.light).finish()
    }
}

impl SceneFire {
    /// What burns.
    pub fn fire(&self) -> &Fire {
        self.burning.fire()
    }

    /// Edge of a cell, m.
    pub fn cell(&self) -> f32 {
        self.cell
    }

    /// Index of its light.
    pub fn light(&self) -> usize {
        self.light
    }

    /// Indices of its shapes: logs and sparks.
    pub fn shapes(&self) -> [usize; 2] {
        self.shapes
    }
}

impl Scene {
    /// Lights a fire: a [`Light::Volume`] called `name` and two shapes, logs and sparks, as they are at `seconds`. Lengths
    /// of the scene are metres then, and light is in cd/m². `cell`: edge of the cells, m; a twentieth of the fuel bed where
    /// absent.
    pub fn add_fire(
        &mut self,
        name: &str,
        fire: &Fire,
        cell: Option<f32>,
        seconds: f64,
    ) -> Result<(), FireError> {
        let burning = fire.light(self.working_space)?;
        let glow = self.textures.len();
        self.textures.push(Texture::MeshAttribute { name: GLOW.into() });
        let charcoal = self.materials.len();
        self.materials.push(Material::lambert(Value::Number(CHARCOAL)));
        let name = if name.is_empty() { "fire" } else { name };
        let shapes = [" logs", " sparks"].map(|part| {
            self.shapes.push(glowing(format!("{name}{part}"), charcoal, glow));
            self.shapes.len() - 1
        });
        let light = self.lights.len();
        let nothing = Grid {
            size: glam::UVec3::ZERO,
            lower: Vec3::ZERO,
            upper: Vec3::ZERO,
            space: self.working_space,
            data: vec![],
            solid: vec![],
        };
        self.add_light(name, Light::Volume { grid: Arc::new(nothing), scale: 1.0, to_world: Mat4::IDENTITY });
        let cell = cell.unwrap_or(fire.diameter / FINENESS);
        let fire = SceneFire { logs: burning.logs(), burning, cell, light, shapes };
        fire.moment(seconds)?.put(&fire, self);
        self.fires.push(Arc::new(fire));
        self.seconds = seconds;
        Ok(())
    }

    /// The scene with the flames of its fires as they are in the mean over `window` seconds, half of them before its moment and
    /// half after, 0 to 60: their light without its flicker. Logs and sparks stay as they are.
    ///
    /// # Errors
    /// A window that is out of that range or no number; a fire that cannot be made cells of.
    pub fn with_mean_flames(&self, window: f64) -> Result<Self, FireError> {
        if !(0.0..=f64::from(WINDOW)).contains(&window) {
            let (name, value, unit) = ("window of the mean", window as f32, "s");
            return Err(FireError::Range { name, value, unit, low: 0.0, high: WINDOW });
        }
        let moments = (window / STEP).ceil().max(1.0) as usize;
        let time = |k: usize| self.seconds + window * ((k as f64 + 0.5) / moments as f64 - 0.5);
        let count = self.fires.len() * moments;
        // As many grids at once as there are threads to make them, each added in order to the sum of its fire.
        let at_once = threads();
        let mut sums: Vec<Grid> = Vec::with_capacity(self.fires.len());
        for first in (0..count).step_by(at_once) {
            let one = |k: usize| self.fires[(first + k) / moments].cells(time((first + k) % moments));
            let grids = parallel(at_once, at_once.min(count - first), one, &|_| {});
            for (i, grid) in (first..).zip(grids) {
                let grid = grid?;
                match sums.get_mut(i / moments) {
                    Some(sum) => {
                        let values = grid.data.as_flattened();
                        sum.data.as_flattened_mut().iter_mut().zip(values).for_each(|(sum, v)| *sum += v);
                    }
                    None => sums.push(grid),
                }
            }
        }
        let mut scene = self.clone();
        for (fire, mut mean) in self.fires.iter().zip(sums) {
            mean.data.as_flattened_mut().iter_mut().for_each(|v| *v /= moments as f32);
            if let Some(Light::Volume { grid, .. }) = scene.lights.get_mut(fire.light) {
                *grid = Arc::new(mean);
            }
        }
        Ok(scene)
    }
}

/// A fire as it is at a moment.
struct Moment {
    cells: Grid,
    /// Logs and sparks.
    meshes: [Mesh; 2],
}

impl Moment {
    /// Sets the light and shapes of `fire` in `scene` to this.
    fn put(self, fire: &SceneFire, scene: &mut Scene) {
        if let Some(Light::Volume { grid, .. }) = scene.lights.get_mut(fire.light) {
            *grid = Arc::new(self.cells);
        }
        for (shape, mesh) in fire.shapes.into_iter().zip(self.meshes) {
            if let Some(shape) = scene.shapes.get_mut(shape) {
                shape.geometry = Geometry::Mesh(Arc::new(mesh));
            }
        }
    }
}

/// Sets lights and shapes of `fires` in `scene` to how they are at `seconds`, each fire on a thread of its own.
pub(crate) fn burn(fires: &[Arc<SceneFire>], seconds: f64, scene: &mut Scene) -> Result<(), FireError> {
    let moments = parallel(threads(), fires.len(), |i| fires[i].moment(seconds), &|_| {});
    for (fire, moment) in fires.iter().zip(moments) {
        moment?.put(fire, scene);
    }
    Ok(())
}

impl SceneFire {
    fn moment(&self, seconds: f64) -> Result<Moment, FireError> {
        Ok(Moment { cells: self.cells(seconds)?, meshes: [self.logs(seconds), self.sparks(seconds)] })
    }

    /// Of the same bounds at every moment.
    fn cells(&self, seconds: f64) -> Result<Grid, FireError> {
        let flame = self.burning.at(seconds);
        let mut cells = flame.grid(flame.cells(self.cell))?;
        self.logs.fill(&mut cells);
        Ok(cells)
    }

    fn logs(&self, seconds: f64) -> Mesh {
        let glow = self.burning.ember_temperatures(&self.logs, seconds).into_iter();
        let glow = glow.flat_map(|kelvin| (EMISSIVITY * self.burning.glow(kelvin)).to_array());
        Mesh {
            name: "logs".into(),
            positions: self.logs.positions.clone(),
            normals: self.logs.normals.clone(),
            triangles: self.logs.triangles.clone(),
            attributes: vec![(GLOW.into(), 3, glow.collect())],
            ..Mesh::default()
        }
    }

    /// Each spark an octahedron, drawn out along its way; what is spread over a longer streak is dimmer.
    fn sparks(&self, seconds: f64) -> Mesh {
        let mut mesh = Mesh { name: "sparks".into(), ..Mesh::default() };
        let mut glow = Vec::new();
        for spark in self.burning.sparks(seconds) {
            let way = spark.velocity * EXPOSURE;
            let along = way.try_normalize().unwrap_or(Vec3::Y);
            let (x, y) = along.any_orthonormal_pair();
            let half = 0.5 * way.length() + spark.radius;
            let first = mesh.positions.len() as u32;
            let corners = [along * half, x * spark.radius, y * spark.radius];
            mesh.positions.extend(corners.iter().flat_map(|c| [spark.position + *c, spark.position - *c]));
            for octant in 0..8u32 {
                let sign = |axis: u32| octant >> axis & 1;
                let [a, b, c] = [0, 1, 2].map(|axis| first + 2 * axis + sign(axis));
                // Each mirroring turns the triangle round.
                let turned = (sign(0) + sign(1) + sign(2)) % 2 == 1;
                mesh.triangles.push(if turned { [a, c, b] } else { [a, b, c] });
            }
            let radiance = EMISSIVITY * self.burning.glow(spark.temperature) * (spark.radius / half);
            glow.extend([radiance; 6].iter().flat_map(|c| c.to_array()));
        }
        mesh.attributes = vec![(GLOW.into(), 3, glow)];
        mesh
    }
}

fn glowing(name: String, material: MaterialId, glow: TextureId) -> Shape {
    let mut shape = Shape::new(name, Geometry::Mesh(Arc::default()), Mat4::IDENTITY, material);
    shape.emission = Some(Value::Texture(glow));
    shape
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prepared::Rows;
    use yugen_motion::fire::Flicker;

    fn scene() -> Scene {
        let mut scene = Scene::default();
        let fire = Fire { power: 30.0, ..Fire::default() };
        scene.add_fire("west", &fire, Some(0.06), 0.0).unwrap();
        scene.add_fire("", &Fire { seed: 1, flicker: Flicker::Still, ..fire }, Some(0.06), 0.0).unwrap();
        scene
    }

    fn grid(scene: &Scene, light: usize) -> Arc<Grid> {
        let Light::Volume { grid, .. } = &scene.lights[light] else { panic!("a volume") };
        grid.clone()
    }

    #[test]
    fn fires_burn_with_time_and_the_still_ones_do_not() {
        let mut scene = scene();
        assert_eq!(scene.clips(), [("fire".to_string(), [0.0, 60.0])]);
        assert_eq!(
            scene.shapes.iter().map(|s| &*s.name).collect::<Vec<_>>()[..2],
            ["west logs", "west sparks"]
        );
        assert_eq!(scene.light_groups().names[4..], ["west", "fire"]);
        let (first, still) = (grid(&scene, 0), grid(&scene, 1));
        let mut rows = Rows::new(&scene).unwrap();
        scene.pose(Some("fire"), 1.5).unwrap();
        assert!(grid(&scene, 0) != first && grid(&scene, 1) == still);
        // As if they had been lit then.
        let mut later = Scene::default();
        later.add_fire("west", scene.fires[0].fire(), Some(0.06), 1.5).unwrap();
        assert_eq!(grid(&later, 0), grid(&scene, 0));
        // Rows take over the pose, and are as long as before, which is what a stage needs.
        let was = (rows.words.len(), rows.numbers.len(), rows.vertices.len());
        rows.pose(&scene).unwrap();
        let anew = Rows::new(&scene).unwrap();
        assert!(rows.words == anew.words && rows.numbers == anew.numbers);
        assert_eq!(was, (rows.words.len(), rows.numbers.len(), rows.vertices.len()));
        assert!(
            scene.pose(Some("walk"), 0.0).unwrap_err().to_string().contains("no animation called 'walk'")
        );
        assert!(scene.pose(None, f32::NAN).is_err());
    }

    #[test]
    fn mean_flames_are_the_mean_of_moments() {
        let mut scene = scene();
        scene.pose(None, 1.5).unwrap();
        let now = grid(&scene, 0);
        assert_eq!(grid(&scene.with_mean_flames(0.0).unwrap(), 0), now);
        for window in [-0.1, f64::NAN, f64::INFINITY, 61.0] {
            let said = scene.with_mean_flames(window).unwrap_err().to_string();
            assert!(
                said.contains("the window of the mean of a fire is") && said.contains("0 and 60 s"),
                "{said}"
            );
        }
        let mean = scene.with_mean_flames(0.25).unwrap();
        let halves = [1.5 - 0.0625, 1.5 + 0.0625].map(|seconds| {
            scene.pose(None, seconds).unwrap();
            grid(&scene, 0)
        });
        for (i, value) in grid(&mean, 0).data.as_flattened().iter().enumerate() {
            let both = halves.each_ref().map(|g| g.data.as_flattened()[i]);
            assert!((value - 0.5 * (both[0] + both[1])).abs() <= 1e-5 * value.abs(), "{value}: {both:?}");
        }
        assert!(
            grid(&mean, 0) != now && grid(&mean, 1) == grid(&scene, 1) && grid(&mean, 0).solid == now.solid
        );
    }

    #[test]
    fn sparks_are_closed_and_give_the_light_of_their_streaks() {
        let scene = scene();
        let Geometry::Mesh(sparks) = &scene.shapes[1].geometry else { panic!("a mesh") };
        assert_eq!((sparks.positions.len() % 6, sparks.triangles.len() % 8), (0, 0));
        for spark in 0..sparks.positions.len() / 6 {
            // Six times the volume, all faces outwards.
            let volume: f32 = sparks.triangles[8 * spark..][..8]
                .iter()
                .map(|t| {
                    let middle = 0.5 * (sparks.positions[6 * spark] + sparks.positions[6 * spark + 1]);
                    let [a, b, c] = t.map(|i| sparks.positions[i as usize] - middle);
                    let six = a.dot(b.cross(c));
                    assert!(six > 0.0, "{spark}");
                    six
                })
                .sum();
            assert!(volume > 0.0);
        }
        let (_, width, glow) = &sparks.attributes[0];
        assert!(*width == 3 && glow.len() == 3 * sparks.positions.len() && glow.iter().any(|v| *v > 0.0));
    }
}
