//! Scenes as others wrote them, against numbers of Mitsuba 3.9.1 (`scalar_rgb`: `shape.bbox()`,
//! `sensor.sample_ray`), and mistakes against their messages.

mod mistakes;
mod published;
mod values;

use super::*;
use crate::formats::load_scene;
use glam::{Vec3, Vec4Swizzles};
use std::collections::BTreeMap;
use std::sync::Mutex;
use yugen_scene::{Geometry, Shape};

/// The folder of real scenes; without it a test says so and ends, except where it must be there.
fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("YUGEN_DATA").map(|d| PathBuf::from(d).join("mitsuba"));
    if folder.is_none() {
        assert!(std::env::var_os("CI").is_none(), "YUGEN_DATA must name the folder of test data");
        eprintln!("skipped: YUGEN_DATA is not set");
    }
    folder
}

/// A scene of the folder, read once for all tests.
fn load(file: &str) -> Option<Arc<Scene>> {
    static SCENES: Mutex<BTreeMap<String, Arc<Scene>>> = Mutex::new(BTreeMap::new());
    let path = data()?.join(file);
    let mut scenes = SCENES.lock().unwrap_or_else(|e| e.into_inner());
    let read = || Arc::new(load_scene(&path, &Options::default()).unwrap_or_else(|e| panic!("{e}")));
    Some(scenes.entry(file.to_string()).or_insert_with(read).clone())
}

/// Corners of everything a shape reaches in the world.
fn bounds(s: &Shape) -> (Vec3, Vec3) {
    let m = s.to_world;
    match &s.geometry {
        Geometry::Mesh(mesh) => {
            let points = mesh.positions.iter().map(|p| m.transform_point3(*p));
            points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)))
        }
        Geometry::Sphere => {
            let r = Vec3::from_array(std::array::from_fn(|i| m.row(i).xyz().length()));
            (m.w_axis.xyz() - r, m.w_axis.xyz() + r)
        }
        Geometry::Rectangle => {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
                .map(|(x, y)| m.transform_point3(Vec3::new(x, y, 0.0)));
            (corners.into_iter().reduce(Vec3::min).unwrap(), corners.into_iter().reduce(Vec3::max).unwrap())
        }
        other => panic!("no bounds of {other:?} are asked for here"),
    }
}

fn assert_near(a: Vec3, b: [f32; 3], what: &str) {
    let b = Vec3::from(b);
    // Single precision on both sides.
    let scale = 1.0 + b.abs().max_element();
    assert!((a - b).abs().max_element() < 4e-6 * scale, "{what}: {a}, Mitsuba {b}");
}

/// A scene with a camera and `body` from the second line on.
fn parse_with(body: &str, options: &Options) -> Result<Scene, String> {
    let text = format!("<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\n{body}</scene>");
    read(text.as_bytes(), Path::new("nowhere/a.xml"), options).map_err(|e| e.to_string())
}

fn parse(body: &str) -> Result<Scene, String> {
    parse_with(body, &Options::default())
}

/// A folder that goes away.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str, files: &[(&str, &str)]) -> Self {
        let folder = std::env::temp_dir().join(format!("yugen-mitsuba-{name}-{}", std::process::id()));
        for (file, text) in files {
            let path = folder.join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        Self(folder)
    }

    fn load(&self, file: &str, options: &Options) -> Result<Scene, String> {
        load_scene(&self.0.join(file), options)
            .map_err(|e| e.to_string().replace(&*self.0.to_string_lossy(), "DIR"))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn with_sensor(body: &str) -> String {
    format!("<scene version=\"3.0.0\"><sensor type=\"perspective\"/>{body}</scene>")
}
