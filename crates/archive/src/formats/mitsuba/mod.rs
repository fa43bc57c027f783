//! Mitsuba 3 scene files, strictly: a plugin, property or word that is not understood is an error that says
//! where it stands. Files of versions 2 and 3, and of version 0 with its camelCase names, are read.
//!
//! Colours become linear sRGB exactly as in the `rgb` variants of Mitsuba 3.9.1. Which files a scene may open
//! is said in [`folders`]. What changes only how a renderer works inside (sampling weights, block sizes,
//! storage of textures) is accepted and has no effect.

mod document;
mod features;
mod lights;
mod materials;
mod properties;
mod reader;
mod sensors;
mod shapes;
#[cfg(test)]
mod tests;
mod values;

pub use features::FEATURES;

use super::Options;
use crate::Error;
use crate::formats::folders::Folders;
use document::{Class, Document};
use properties::Properties;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use yugen_optics::{ColourSpace, Image};
use yugen_scene::{Aov, GroupId, Integrator, IntegratorKind, MaterialId, Mesh, Scene, Strategy, TextureId};

/// Reads a scene; `path` names it in messages, and its folder is where its files lie.
pub fn read(bytes: &[u8], path: &Path, options: &Options) -> Result<Scene, Error> {
    let folders = Folders::new(path, &options.folders, Some(["<path value=\"", "\"/>"]))?.climbing();
    let document = reader::read(bytes, path, &options.defines, folders)?;
    let mut builder = Builder::new(&document);
    builder.scene()?;
    Ok(builder.scene)
}

/// A scene being filled; objects that are referred to more than once are made once.
struct Builder<'a> {
    document: &'a Document,
    scene: Scene,
    /// By object, and whether it is looked up as a number: see [`materials`].
    textures: HashMap<(usize, bool), TextureId>,
    materials: HashMap<usize, MaterialId>,
    /// What a shape without a material is made of, where it emits and where it does not.
    defaults: [Option<MaterialId>; 2],
    groups: HashMap<usize, GroupId>,
    images: HashMap<(PathBuf, bool), Arc<Image>>,
    meshes: HashMap<shapes::MeshKey, Arc<Mesh>>,
}

impl<'a> Builder<'a> {
    fn new(document: &'a Document) -> Self {
        Self {
            document,
            scene: Scene { working_space: ColourSpace::LinearSrgb, ..Scene::default() },
            textures: HashMap::new(),
            materials: HashMap::new(),
            defaults: [None; 2],
            groups: HashMap::new(),
            images: HashMap::new(),
            meshes: HashMap::new(),
        }
    }

    fn scene(&mut self) -> Result<(), Error> {
        let root = Properties::new(self.document, self.document.root());
        if let Some(p) = root.child(Class::Integrator)? {
            self.scene.integrator = integrator(p)?;
        }
        for p in root.children(Class::Sensor) {
            let camera = self.camera(p)?;
            self.scene.cameras.push(camera);
        }
        if self.scene.cameras.is_empty() {
            return Err(root.invalid("the scene has no camera; add a <sensor>"));
        }
        // Parts of sensors that stand by themselves are used where something refers to them.
        for class in [Class::Sampler, Class::Film, Class::Filter] {
            root.children(class);
        }
        for p in root.children(Class::Bsdf) {
            self.material(p)?;
        }
        for p in root.children(Class::Texture) {
            // Whoever refers to it knows what it is for.
            if !self.document.referenced(p.index) {
                self.texture(p, false)?;
            }
        }
        for p in root.children(Class::Shape) {
            if p.plugin() == "shapegroup" {
                self.group(p)?;
            } else {
                let shape = self.shape(p)?;
                self.scene.shapes.push(shape);
            }
        }
        for p in root.children(Class::Emitter) {
            if p.plugin() != "area" {
                let light = self.light(p)?;
                self.scene.add_light(p.id(), light);
            } else if !self.document.referenced(p.index) {
                return Err(p.invalid("an area emitter belongs inside a <shape>, or a shape refers to it"));
            }
        }
        root.finish()
    }
}

/// AOVs by the name Mitsuba gives them.
const AOVS: &[(&str, Aov)] = &[
    ("albedo", Aov::Albedo),
    ("depth", Aov::Depth),
    ("position", Aov::Position),
    ("uv", Aov::Uv),
    ("geo_normal", Aov::Normal),
    ("sh_normal", Aov::ShadingNormal),
    ("shape_index", Aov::Id),
];

fn integrator(p: Properties) -> Result<Integrator, Error> {
    p.accept(&["block_size", "samples_per_pass", "timeout"]);
    let mut out = match p.plugin() {
        "moment" => {
            let inner = p
                .child(Class::Integrator)?
                .ok_or_else(|| p.invalid("integrator 'moment' needs another one inside"))?;
            let mut out = integrator(inner)?;
            if !out.aovs.contains(&Aov::Variance) {
                out.aovs.push(Aov::Variance);
            }
            out
        }
        "aov" => {
            let inner = p.child(Class::Integrator)?;
            let mut out = match inner {
                Some(inner) => integrator(inner)?,
                None => Integrator { kind: IntegratorKind::Aov, ..Integrator::default() },
            };
            let (list, at) = p.string("aovs")?.ok_or_else(|| p.missing("aovs"))?;
            for item in values::words(list) {
                let (_, kind) = item.split_once(':').ok_or_else(|| {
                    Error::invalid(
                        p.place_of(at),
                        format!("expected pairs such as 'dd:depth', found '{item}'"),
                    )
                })?;
                let known = AOVS.iter().map(|(theirs, _)| *theirs);
                let found = AOVS.iter().find(|(theirs, _)| *theirs == kind);
                let (_, ours) = found.ok_or_else(|| Error::unknown(p.place_of(at), "AOV", kind, known))?;
                if !out.aovs.contains(ours) {
                    out.aovs.push(*ours);
                }
            }
            out
        }
        // Without media, which shapes refuse, those for volumes find the same light.
        "path" | "volpath" => Integrator::default(),
        "volpathmis" => {
            p.accept(&["use_spectral_mis"]);
            Integrator::default()
        }
        "direct" => {
            // How one sample of a pixel is split changes its noise, not what it tends to, while both are taken.
            let both = p.count("shading_samples", 1, 0, 1 << 20)?;
            let light_samples = p.count("emitter_samples", both, 0, 1 << 20)?;
            let bsdf_samples = p.count("bsdf_samples", both, 0, 1 << 20)?;
            if p.has("shading_samples") && (p.has("emitter_samples") || p.has("bsdf_samples")) {
                return Err(p.invalid(
                    "'shading_samples' cannot be given together with 'emitter_samples' or 'bsdf_samples'",
                ));
            }
            if light_samples + bsdf_samples == 0 {
                return Err(p.invalid("'emitter_samples' and 'bsdf_samples' cannot both be 0"));
            }
            let strategy = match (light_samples, bsdf_samples) {
                (0, _) => Strategy::Material,
                (_, 0) => Strategy::Lights,
                _ => Strategy::Both,
            };
            Integrator { kind: IntegratorKind::Direct, strategy, ..Integrator::default() }
        }
        "depth" => Integrator { kind: IntegratorKind::Depth, ..Integrator::default() },
        _ => return Err(p.unknown_plugin()),
    };
    let follows_paths = matches!(p.plugin(), "path" | "volpath" | "volpathmis");
    if follows_paths {
        let max_depth = p.integer("max_depth", -1)?;
        out.max_depth = match max_depth {
            -1 => None,
            _ => Some(
                u32::try_from(max_depth)
                    .map_err(|_| p.out_of_range("max_depth", max_depth, "-1 for no limit, or 0 and more"))?,
            ),
        };
        out.rr_depth = p.count("rr_depth", 5, 1, u32::MAX)?;
    }
    if follows_paths || p.plugin() == "direct" || p.has("hide_emitters") {
        out.hide_emitters = p.boolean("hide_emitters", out.hide_emitters)?;
    }
    p.finish()?;
    Ok(out)
}
