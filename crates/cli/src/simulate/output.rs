//! What a simulation is written as.

use crate::numbered::Numbered;
use anyhow::{Result, bail};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use yugen_archive::atomic_write;
use yugen_archive::formats::abc::MovingMesh;
use yugen_archive::formats::pc2::PointCache;
use yugen_motion::cloth;
use yugen_optics::{Vec2, Vec3};

/// A mesh whose vertices move.
pub struct Surface {
    /// Its objects one after the other: names, and how many vertices each has.
    pub objects: Vec<(String, usize)>,
    /// (u, v), v down.
    pub uvs: Vec<Vec2>,
    /// Counter-clockwise seen from the face.
    pub triangles: Vec<[u32; 3]>,
    /// Of each vertex that of the cloth, where what is sewn together is one.
    pub vertex: Vec<Option<u32>>,
    /// Triangles of the cloth.
    pub sheet: Vec<[u32; 3]>,
    /// Metres of a unit of u and v, where the mesh did not say it.
    pub scale: Option<Vec2>,
}

/// Where a simulation goes.
pub enum Output {
    /// A point cache, and the mesh that it moves where there is none yet.
    Cache { file: PathBuf, mesh: Option<PathBuf> },
    /// Mesh and movement.
    Alembic(PathBuf),
    /// A mesh for each frame.
    Meshes(Numbered),
}

impl Output {
    /// By the name of a file; `made`: the mesh comes from here.
    pub fn of(path: &Path, made: bool) -> Result<Self> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        Ok(match (extension.as_str(), Numbered::of(path)) {
            ("pc2", None) => {
                Self::Cache { file: path.into(), mesh: made.then(|| path.with_extension("obj")) }
            }
            ("abc", None) => Self::Alembic(path.into()),
            ("obj", Some(numbered)) => Self::Meshes(numbered),
            ("obj", None) => bail!(
                "{}: a mesh for each frame needs a number in its name, as in cloth_%04d.obj",
                path.display()
            ),
            _ => bail!("{}: cloth is written as .abc, .pc2 or _%04d.obj", path.display()),
        })
    }

    /// All files that are written.
    pub fn files(&self, frames: u32) -> Vec<PathBuf> {
        match self {
            Self::Cache { file, mesh } => [file].into_iter().chain(mesh).cloned().collect(),
            Self::Alembic(file) => vec![file.clone()],
            Self::Meshes(numbered) => (0..frames).map(|f| numbered.frame(f)).collect(),
        }
    }

    /// Takes a frame; keeps it in `samples` where the file is written at the end.
    pub fn frame(
        &self,
        frame: u32,
        surface: &Surface,
        points: Vec<Vec3>,
        samples: &mut Vec<Vec<Vec3>>,
    ) -> Result<()> {
        match self {
            Self::Meshes(numbered) => {
                atomic_write(&numbered.frame(frame), surface.obj(&points).as_bytes())?;
            }
            _ => samples.push(points),
        }
        Ok(())
    }

    /// Writes what is written at the end.
    pub fn finish(&self, surface: &Surface, samples: Vec<Vec<Vec3>>, rate: f64) -> Result<()> {
        match self {
            Self::Meshes(_) => {}
            Self::Cache { file, mesh } => {
                if let (Some(mesh), Some(first)) = (mesh, samples.first()) {
                    atomic_write(mesh, surface.obj(first).as_bytes())?;
                }
                PointCache { start: 0.0, rate: 1.0, samples }.write(file)?;
            }
            Self::Alembic(file) => {
                let name = surface.objects.first().map_or("cloth", |(name, _)| name.as_str());
                let Surface { uvs, triangles, .. } = surface;
                MovingMesh { name, uvs, triangles, samples: &samples, rate }.write(file)?;
            }
        }
        Ok(())
    }
}

impl Surface {
    /// Unit normals of its vertices where they are at `points`, smooth across seams.
    pub fn normals(&self, points: &[Vec3]) -> Vec<Vec3> {
        let count = self.vertex.iter().flatten().map(|v| *v as usize + 1).max().unwrap_or(0);
        let mut cloth = vec![Vec3::ZERO; count];
        for (v, p) in self.vertex.iter().zip(points) {
            if let Some(v) = v {
                cloth[*v as usize] = *p;
            }
        }
        let normals = cloth::normals(&self.sheet, &cloth);
        self.vertex.iter().map(|v| v.map_or(Vec3::Y, |v| normals[v as usize])).collect()
    }

    /// As Wavefront OBJ, an object for each shape, with smooth normals, where its vertices are at `points`.
    pub fn obj(&self, points: &[Vec3]) -> String {
        let mut text = String::with_capacity(points.len() * 100);
        // Writing to a string does not fail.
        for p in points {
            let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
        }
        for t in &self.uvs {
            // v of a file runs up.
            let _ = writeln!(text, "vt {} {}", t.x, 1.0 - t.y);
        }
        for n in self.normals(points) {
            let _ = writeln!(text, "vn {:.5} {:.5} {:.5}", n.x, n.y, n.z);
        }
        let mut first = 0;
        let mut rest = self.triangles.iter().peekable();
        for (name, count) in &self.objects {
            let _ = writeln!(text, "o {}", name.replace(char::is_whitespace, "_"));
            first += *count as u32;
            while let Some(t) = rest.next_if(|t| t[0] < first) {
                let [a, b, c] = t.map(|v| v + 1);
                let _ = writeln!(text, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}");
            }
        }
        text
    }
}
