//! Meshes whose vertices were computed before, frame by frame, as a simulation of cloth leaves them.

use crate::{Geometry, Mesh, Scene};
use glam::{Mat4, Vec3};
use std::collections::HashMap;
use std::sync::Arc;

/// The animation of caches alone.
pub(crate) const CACHE: &str = "cache";

/// Where the vertices of a shape are over time; posed by [`Scene::pose`], linear between two samples, still before the first
/// and after the last.
#[derive(Clone, Debug)]
pub struct CachedMesh {
    shape: usize,
    rest: Arc<Mesh>,
    /// Coordinates of the samples to those of the shape.
    to_shape: Mat4,
    start: f64,
    rate: f64,
    samples: Arc<[Vec<Vec3>]>,
    /// Of each vertex the first that is at its place and turned as it is: normals go over seams of the texture.
    twin: Vec<u32>,
}

/// Why a cache is none of a shape.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CacheError {
    /// Nothing to play.
    #[error("a cache without samples moves nothing")]
    Empty,
    /// No mesh.
    #[error("'{0}' is no mesh, and only meshes have caches")]
    NoMesh(String),
    /// No such cache.
    #[error("the scene has no cache {0}")]
    Unknown(usize),
    /// Of another mesh.
    #[error(
        "the cache has {found} vertices and '{shape}' has {expected}: it is of another mesh, or of one that was written anew"
    )]
    Vertices {
        /// In the sample.
        found: usize,
        /// In the mesh.
        expected: usize,
        /// Its name.
        shape: String,
    },
    /// No time.
    #[error(
        "a cache needs a rate above zero and a start, in samples a second and seconds: these are {rate} and {start}"
    )]
    Rate {
        /// Samples a second.
        rate: String,
        /// Seconds.
        start: String,
    },
}

impl Scene {
    /// Gives a shape a cache: `samples` of all its vertices, `rate` of them a second, the first at `start` seconds, in
    /// coordinates that `to_shape` takes to the shape's own. The shape takes the first at once.
    ///
    /// # Errors
    /// A shape that is no mesh, or samples that are not of its vertices.
    pub fn add_cache(
        &mut self,
        shape: usize,
        samples: Arc<[Vec<Vec3>]>,
        rate: f64,
        start: f64,
        to_shape: Mat4,
    ) -> Result<(), CacheError> {
        let no_mesh = |name: &str| CacheError::NoMesh(name.into());
        let owner = self.shapes.get(shape).ok_or_else(|| no_mesh(""))?;
        let Geometry::Mesh(rest) = &owner.geometry else { return Err(no_mesh(&owner.name)) };
        if !(rate > 0.0 && rate.is_finite() && start.is_finite()) {
            return Err(CacheError::Rate { rate: rate.to_string(), start: start.to_string() });
        }
        let expected = rest.positions.len();
        if let Some(wrong) = samples.iter().find(|s| s.len() != expected) {
            return Err(CacheError::Vertices { found: wrong.len(), expected, shape: owner.name.clone() });
        }
        if samples.is_empty() {
            return Err(CacheError::Empty);
        }
        let rest = rest.clone();
        let cache = CachedMesh { shape, twin: twins(&rest), rest, to_shape, start, rate, samples };
        cache.play(start, self);
        self.caches.push(Arc::new(cache));
        Ok(())
    }

    /// Gives the cache of this number one sample instead of those that it has, in their coordinates, m: where a simulation is now. Its
    /// shape takes it when the scene is posed.
    ///
    /// # Errors
    /// No such cache, or a sample of another mesh.
    pub fn set_sample(&mut self, cache: usize, points: Vec<Vec3>) -> Result<(), CacheError> {
        let old = self.caches.get_mut(cache).ok_or(CacheError::Unknown(cache))?;
        let expected = old.rest.positions.len();
        if points.len() != expected {
            let shape = self.shapes.get(old.shape).map_or(String::new(), |s| s.name.clone());
            return Err(CacheError::Vertices { found: points.len(), expected, shape });
        }
        Arc::make_mut(old).samples = Arc::new([points]);
        Ok(())
    }
}

/// Of each vertex the first with its place and its normal.
fn twins(mesh: &Mesh) -> Vec<u32> {
    let mut first = HashMap::new();
    let each = mesh.positions.iter().zip(&mesh.normals).zip(0u32..);
    each.map(|((p, n), i)| {
        // Normals that are written to some digits are alike to fewer.
        let key = (p.to_array().map(f32::to_bits), (*n * 256.0).round().as_ivec3());
        *first.entry(key).or_insert(i)
    })
    .collect()
}

impl CachedMesh {
    /// Index of its shape.
    pub fn shape(&self) -> usize {
        self.shape
    }

    /// The mesh, where no cache moves it.
    pub fn rest(&self) -> &Arc<Mesh> {
        &self.rest
    }

    /// Coordinates of its samples to those of the shape.
    pub fn to_shape(&self) -> Mat4 {
        self.to_shape
    }

    /// Its samples.
    pub fn samples(&self) -> &[Vec<Vec3>] {
        &self.samples
    }

    /// Samples a second.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// Seconds of the first sample and the last.
    pub fn span(&self) -> [f32; 2] {
        let last = self.start + (self.samples.len() - 1) as f64 / self.rate;
        [self.start as f32, last as f32]
    }

    /// Sets the mesh of its shape to how it is at `seconds`.
    pub(crate) fn play(&self, seconds: f64, scene: &mut Scene) {
        let last = self.samples.len() - 1;
        let at = ((seconds - self.start) * self.rate).clamp(0.0, last as f64);
        let from = (at as usize).min(last);
        let t = (at - from as f64) as f32;
        let (from, to) = (&self.samples[from], &self.samples[(from + 1).min(last)]);
        let own = self.to_shape != Mat4::IDENTITY;
        let place = |p: Vec3| if own { self.to_shape.transform_point3(p) } else { p };
        let mut mesh = Mesh::clone(&self.rest);
        mesh.positions = from.iter().zip(to).map(|(a, b)| place(a.lerp(*b, t))).collect();
        let Some(shape) = scene.shapes.get_mut(self.shape) else { return };
        if self.twin.len() == mesh.positions.len() {
            // Of those that are alike at rest the triangles of all count, at one of them.
            let corners = std::mem::take(&mut mesh.triangles);
            mesh.triangles = corners.iter().map(|t| t.map(|v| self.twin[v as usize])).collect();
            mesh.normals.clear();
            mesh.complete_normals(glam::Mat3::from_mat4(shape.to_world));
            mesh.normals = self.twin.iter().map(|v| mesh.normals[*v as usize]).collect();
            mesh.triangles = corners;
        }
        // Tangents follow from (u, v) where none are given.
        mesh.tangents.clear();
        shape.geometry = Geometry::Mesh(Arc::new(mesh));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PoseError, Shape};
    use glam::Vec2;

    /// A strip of two squares, whose middle edge is a seam of the texture.
    fn strip() -> Scene {
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let mesh = Mesh {
            positions: vec![
                at(0., 0.),
                at(1., 0.),
                at(1., 1.),
                at(0., 1.),
                at(1., 0.),
                at(2., 0.),
                at(2., 1.),
                at(1., 1.),
            ],
            normals: vec![Vec3::Z; 8],
            uvs: [0., 1., 1., 0., 5., 6., 6., 5.].iter().map(|u| Vec2::new(*u, 0.0)).collect(),
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
            ..Mesh::default()
        };
        let to_world = Mat4::from_translation(Vec3::Y * 3.0);
        let shape = Shape::new("strip", Geometry::Mesh(Arc::new(mesh)), to_world, 0);
        Scene { shapes: vec![shape], ..Scene::default() }
    }

    fn mesh(scene: &Scene) -> &Mesh {
        let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("it is a mesh") };
        mesh
    }

    #[test]
    fn a_cache_bends_a_mesh_and_its_normals_over_a_seam() {
        let mut scene = strip();
        let flat: Vec<Vec3> = mesh(&scene).positions.iter().map(|p| *p + Vec3::Y * 3.0).collect();
        // The second square is bent upright, to -z.
        let bent: Vec<Vec3> =
            flat.iter().map(|p| if p.x > 1.5 { Vec3::new(1.0, p.y, -1.0) } else { *p }).collect();
        let to_shape = scene.shapes[0].to_world.inverse();
        scene.add_cache(0, Arc::from([flat, bent]), 10.0, 2.0, to_shape).unwrap();
        assert_eq!(scene.clips(), [(CACHE.to_string(), [2.0, 2.1])]);
        scene.pose(None, 2.05).unwrap();
        let half = mesh(&scene).clone();
        assert!(half.positions[5].distance(Vec3::new(1.5, 0.0, -0.5)) < 1e-5, "{}", half.positions[5]);
        // On both sides of the seam the normal is between those of the squares.
        let [left, right] = [1, 4].map(|v: usize| half.normals[v]);
        assert_eq!(left, right);
        let between = (Vec3::Z + Vec3::new(1.0, 0.0, 1.0).normalize()).normalize();
        assert!(left.distance(between) < 1e-5, "{left} {between}");
        assert!(half.normals[0].distance(Vec3::Z) < 1e-6);
        // Before and after it stands still; back again it is as it was.
        scene.pose(Some(CACHE), 0.0).unwrap();
        let first = mesh(&scene).positions.clone();
        scene.pose(None, 99.0).unwrap();
        assert!(mesh(&scene).positions[5].distance(Vec3::new(1.0, 0.0, -1.0)) < 1e-5);
        scene.pose(None, 2.0).unwrap();
        assert_eq!(mesh(&scene).positions, first);
        assert!(matches!(scene.pose(Some("cash"), 0.0), Err(PoseError::Unknown { .. })));
    }

    #[test]
    fn caches_of_other_meshes_are_refused_in_words() {
        let mut scene = strip();
        let samples = |n: usize| -> Arc<[Vec<Vec3>]> { Arc::from([vec![Vec3::ZERO; n]]) };
        let said = |e: Result<(), CacheError>| e.unwrap_err().to_string();
        assert!(
            said(scene.add_cache(0, samples(7), 60.0, 0.0, Mat4::IDENTITY))
                .contains("7 vertices and 'strip' has 8")
        );
        assert!(said(scene.add_cache(0, samples(8), 0.0, 0.0, Mat4::IDENTITY)).contains("a rate above zero"));
        assert!(
            said(scene.add_cache(0, Arc::from([]), 60.0, 0.0, Mat4::IDENTITY)).contains("without samples")
        );
        scene.shapes[0].geometry = Geometry::Sphere;
        assert!(said(scene.add_cache(0, samples(8), 60.0, 0.0, Mat4::IDENTITY)).contains("is no mesh"));
    }
}
