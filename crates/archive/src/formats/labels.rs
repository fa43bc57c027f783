//! What the things of a scene are called in a file that is written.

use yugen_scene::MaterialId;

/// Names and remarks. Whatever is missing is numbered, or left out.
#[derive(Clone, Debug, Default)]
pub struct Labels {
    /// Of [`yugen_scene::Scene::materials`].
    pub materials: Vec<String>,
    /// Of each of [`yugen_scene::Scene::shapes`]: keys and values.
    pub shapes: Vec<Vec<(String, String)>>,
    /// Of the whole.
    pub about: Vec<(String, String)>,
}

impl Labels {
    /// A material's name.
    pub fn material(&self, id: MaterialId) -> String {
        self.materials.get(id).filter(|n| !n.is_empty()).cloned().unwrap_or_else(|| format!("material_{id}"))
    }
}
