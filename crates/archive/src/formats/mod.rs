//! One file per format.

pub mod abc;
pub mod btf;
pub mod colour_chart;
mod corners;
mod csv;
pub mod exif;
pub mod exposures;
pub mod film;
mod folders;
pub mod gathered;
pub mod gltf;
pub mod goniometer;
pub mod goniometer_csv;
mod grid;
pub mod image;
pub mod instrument;
mod json;
pub mod labels;
pub mod lp;
pub mod measured;
pub mod merl;
pub mod mesh;
pub mod mitsuba;
pub mod mixed;
pub mod motion;
pub mod mtl;
pub mod neural_brdf;
mod numbers;
pub mod obj;
pub mod pc2;
pub mod pca_basis;
pub mod ply;
pub mod ptm;
pub mod readings;
pub mod relight;
pub mod relightable;
pub mod relit_contents;
pub mod relit_files;
pub mod response;
pub mod rgl;
pub mod rti;
pub mod serialized;
pub mod stack;
pub mod support;
pub mod toml;
pub mod wif;

use crate::{Error, Place, read_bounded, read_filled};
use std::path::{Path, PathBuf};
use support::Feature;
use yugen_scene::Scene;

/// What a caller may say about how a scene is read.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// `-D name=value`: values of a file's parameters.
    pub defines: Vec<(String, String)>,
    /// Folders in which a scene's files may lie, besides its own.
    pub folders: Vec<PathBuf>,
    /// Which way is up in a mesh that is read as a scene; y where absent.
    pub up: Option<mesh::Up>,
}

/// A format that scenes come in.
pub struct Format {
    /// For people.
    pub name: &'static str,
    /// Lower case, without the dot.
    pub extensions: &'static [&'static str],
    /// Whether its files have parameters for [`Options::defines`].
    pub parameters: bool,
    /// Reads a scene from the bytes of a file; the path names it in messages and says where its files lie.
    pub read: fn(&[u8], &Path, &Options) -> Result<Scene, Error>,
}

/// Every format that scenes come in.
pub const FORMATS: &[Format] = &[
    Format { name: "Yugen TOML", extensions: &["toml"], parameters: false, read: toml::read },
    Format { name: "glTF 2.0", extensions: &["glb", "gltf"], parameters: false, read: gltf::read },
    Format { name: "Mitsuba 3 XML", extensions: &["xml"], parameters: true, read: mitsuba::read },
];

/// A format of meshes, which scenes name: its name for people, and its extensions.
pub const MESH_FORMATS: &[(&str, &[&str])] =
    &[("Wavefront OBJ", &["obj"]), ("PLY", &["ply"]), ("Mitsuba serialized", &["serialized"])];

/// What is read of the formats of others, feature by feature: tables with their titles.
pub fn features() -> Vec<(&'static str, Vec<Feature>)> {
    vec![
        ("Wavefront OBJ: statements", obj::FEATURES.to_vec()),
        ("Wavefront MTL: statements", mtl::FEATURES.to_vec()),
        ("Wavefront MTL: options of pictures", mtl::OPTIONS.to_vec()),
        ("PLY: elements and their properties", ply::FEATURES.to_vec()),
        ("OpenEXR", image::exr_features().collect()),
        ("glTF 2.0: the format itself and its extensions", gltf::FEATURES.to_vec()),
        ("Mitsuba XML: plugins", mitsuba::FEATURES.to_vec()),
        ("Polynomial texture maps (.ptm): layouts", ptm::FEATURES.to_vec()),
        ("RelightLab's folders: bases, colour spaces and layouts", relight::FEATURES.to_vec()),
        (
            "LBNL WINDOW XML: what is scattered where, and how it is written",
            instrument::window::FEATURES.to_vec(),
        ),
        ("Zemax and ASAP BSDF: keywords", instrument::zemax::FEATURES.to_vec()),
        ("ASTM E1392 and E2387: columns", instrument::astm::FEATURES.to_vec()),
        ("BVH: keywords", motion::bvh::FEATURES.to_vec()),
        ("C3D: groups of parameters", motion::c3d::FEATURES.to_vec()),
        ("TRC: fields of the header", motion::trc::FEATURES.to_vec()),
        ("Acclaim ASF and AMC: sections and degrees of freedom", motion::acclaim::FEATURES.to_vec()),
        ("OptiTrack Motive CSV: types of columns", motion::motive::FEATURES.to_vec()),
        ("Vicon CSV: sections", motion::vicon::FEATURES.to_vec()),
        ("Qualisys TSV: lines of the header", motion::qualisys::FEATURES.to_vec()),
        ("ALTA: parametrisations of directions and values", instrument::alta::FEATURES.to_vec()),
    ]
}

/// Reads a scene in the format that the extension of its file names. A mesh is one, too, and so is motion.
pub fn load_scene(path: &Path, options: &Options) -> Result<Scene, Error> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let Some(format) = FORMATS.iter().find(|f| f.extensions.contains(&extension.as_str())) else {
        let meshes = || MESH_FORMATS.iter().flat_map(|(_, extensions)| *extensions).copied();
        if meshes().any(|e| e == extension) {
            return load_mesh(path, options);
        }
        let motions = || motion::FORMATS.iter().flat_map(|f| f.extensions).copied();
        if motions().any(|e| e == extension) {
            return load_motion(path, options);
        }
        let known = FORMATS.iter().flat_map(|f| f.extensions).copied().chain(meshes()).chain(motions());
        return Err(match path.is_dir() {
            true => Error::io(path, std::io::ErrorKind::IsADirectory.into()),
            false => Error::unknown(Place::file(path), "scene file extension", &extension, known),
        });
    };
    if let (false, Some((name, _))) = (format.parameters, options.defines.first()) {
        let problem =
            format!("a {} scene has no parameters, so '{name}' cannot be given a value", format.name);
        return Err(Error::invalid(Place::file(path), problem));
    }
    if options.up.is_some() {
        let problem =
            format!("a {} scene says itself which way is up; only for a mesh can it be said", format.name);
        return Err(Error::invalid(Place::file(path), problem));
    }
    let _span = tracing::info_span!("read_scene", file = %path.display()).entered();
    let bytes = read_filled_file(path)?;
    let scene = (format.read)(&bytes, path, options)?;
    if scene.is_empty() {
        let problem =
            "there is nothing to be seen in this scene: it has no shape, and no light from all sides";
        return Err(Error::invalid(Place::file(path), problem));
    }
    tracing::info!(
        "{}: {} shapes, {} groups, {} materials, {} textures, {} lights, {} cameras",
        path.display(),
        scene.shapes.len(),
        scene.groups.len(),
        scene.materials.len(),
        scene.textures.len(),
        scene.lights.len(),
        scene.cameras.len()
    );
    Ok(scene)
}

fn load_mesh(path: &Path, options: &Options) -> Result<Scene, Error> {
    if let Some((name, _)) = options.defines.first() {
        let problem = format!("a mesh has no parameters, so '{name}' cannot be given a value");
        return Err(Error::invalid(Place::file(path), problem));
    }
    let _span = tracing::info_span!("read_scene", file = %path.display()).entered();
    let scene = mesh::read(path, options)?;
    if scene.bounds().is_none() {
        return Err(Error::invalid(
            Place::file(path),
            "there is nothing to be seen in this mesh: it has no vertices",
        ));
    }
    Ok(scene)
}

/// Motion as sticks; what its file does not say of unit and axes is guessed.
fn load_motion(path: &Path, options: &Options) -> Result<Scene, Error> {
    if let Some((name, _)) = options.defines.first() {
        let problem = format!("motion has no parameters, so '{name}' cannot be given a value");
        return Err(Error::invalid(Place::file(path), problem));
    }
    let axes = options.up.and_then(|up| motion::up(if up == mesh::Up::Z { 'z' } else { 'y' }));
    let loaded = motion::load(path, &motion::Options { axes, guess: true, ..motion::Options::default() })?;
    for doubt in &loaded.doubts {
        tracing::warn!("{}: {doubt}", path.display());
    }
    motion::scene(&loaded.motion, path)
}

/// The largest file that is read as a whole: a mesh of some fifty million triangles.
const MAX_FILE: u64 = 8 << 30;

/// All of a regular file.
pub(crate) fn read_file(path: &Path) -> Result<Vec<u8>, Error> {
    check_regular(path)?;
    read_bounded(path, MAX_FILE)
}

/// The same of one that cannot be empty.
pub(crate) fn read_filled_file(path: &Path) -> Result<Vec<u8>, Error> {
    check_regular(path)?;
    read_filled(path, MAX_FILE)
}

/// Refuses what is no regular file.
fn check_regular(path: &Path) -> Result<(), Error> {
    let meta = std::fs::metadata(path).map_err(|e| Error::io(path, e))?;
    // A pipe or a device may never end.
    if !meta.is_file() {
        return Err(Error::invalid(Place::file(path), "expected a file, found a folder, a pipe or a device"));
    }
    Ok(())
}
