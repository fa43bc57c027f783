//! A mesh by itself, as a scene: in front of a camera that sees all of it, under the default sun and sky.

use super::{Options, serialized, toml};
use crate::{Error, Place};
use std::path::Path;
use yugen_scene::Scene;

/// Which way is up in a file of a mesh, which does not say it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    /// As most programs that draw have it.
    #[default]
    Y,
    /// As most programs that build have it.
    Z,
}

/// The most meshes of a file: more than anyone puts into one.
const MAX_MESHES: usize = 1 << 12;

/// Reads the mesh `path`, with its materials where it names some. All meshes of a .serialized file are shown.
pub(super) fn read(path: &Path, options: &Options) -> Result<Scene, Error> {
    super::check_regular(path)?;
    // Where it really lies: whoever names it wants it read.
    let path = &path.canonicalize().map_err(|e| Error::io(path, e))?;
    let Some(name) = path.file_name().and_then(|n| n.to_str()) else {
        return Err(Error::invalid(Place::file(path), "the name of the file is not UTF-8; give it another"));
    };
    let up = if options.up == Some(Up::Z) { "rotate = [-90, 0, 0]\n" } else { "" };
    let shape = format!("[[shape]]\ntype = \"file\"\nfile = {}\n{up}", quoted(name));
    let serialized = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("serialized"));
    let text = if serialized {
        let count = serialized::count(&super::read_file(path)?).clamp(1, MAX_MESHES);
        (0..count).map(|i| format!("{shape}index = {i}\n")).collect()
    } else {
        shape
    };
    let mut scene = toml::read(text.as_bytes(), path, options)?;
    if !scene.has_light() {
        scene.add_default_light();
    }
    Ok(scene)
}

/// As a string of TOML.
fn quoted(name: &str) -> String {
    let escaped = |c: char| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_control() => format!("\\u{:04x}", u32::from(c)),
        c => c.to_string(),
    };
    format!("\"{}\"", name.chars().map(escaped).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::load_scene;
    use glam::Vec3;

    #[test]
    fn a_mesh_is_a_scene_of_its_own() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a \"b\".obj");
        std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 0 2\nf 1 2 3\n").unwrap();
        let scene = load_scene(&path, &Options::default()).unwrap();
        assert_eq!((scene.shapes.len(), scene.cameras.len(), scene.lights.len()), (1, 1, 2));
        assert_eq!(scene.bounds(), Some([Vec3::ZERO, Vec3::new(1.0, 0.0, 2.0)]));
        let lying = load_scene(&path, &Options { up: Some(Up::Z), ..Options::default() }).unwrap();
        let [low, high] = lying.bounds().unwrap();
        assert!((low - Vec3::ZERO).length() < 1e-6 && (high - Vec3::new(1.0, 2.0, 0.0)).length() < 1e-6);

        let missing = load_scene(&folder.path().join("b.obj"), &Options::default()).unwrap_err().to_string();
        assert!(missing.contains("nothing of this name"), "{missing}");
        std::fs::write(folder.path().join("c.obj"), "").unwrap();
        let empty = load_scene(&folder.path().join("c.obj"), &Options::default()).unwrap_err().to_string();
        assert!(empty.contains("c.obj"), "{empty}");
        // A scene says itself which way is up.
        let scene = folder.path().join("s.toml");
        std::fs::write(&scene, "[[shape]]\ntype = \"sphere\"\n").unwrap();
        let turned = load_scene(&scene, &Options { up: Some(Up::Z), ..Options::default() });
        assert!(turned.unwrap_err().to_string().contains("which way is up"));
    }
}
