//! Attributes that materials look up on meshes which have them, or not.

use super::{Geometry, Material, MaterialId, Scene, Shape, Texture, TextureId, Value};
use std::collections::BTreeSet;

/// A material asks a shape for an attribute that it does not have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the shape '{shape}' has no attribute '{name}'{hint}")]
pub struct MissingAttribute {
    /// Of the scene.
    pub shape: String,
    /// What is looked up.
    pub name: String,
    /// The end of the sentence: what was meant, or what there is.
    pub hint: String,
}

impl Scene {
    /// Whether every attribute that a material or an emission looks up is there.
    pub fn check_attributes(&self) -> Result<(), MissingAttribute> {
        if !self.textures.iter().any(|t| matches!(t, Texture::MeshAttribute { .. })) {
            return Ok(());
        }
        let mut of_materials: Vec<Option<BTreeSet<&str>>> = vec![None; self.materials.len()];
        for shape in self.groups.iter().flatten().chain(&self.shapes) {
            if matches!(shape.geometry, Geometry::Instance(_)) {
                continue;
            }
            let mut wanted = self.of_material(shape.material, &mut of_materials);
            if let Some(emission) = &shape.emission {
                self.of_value(emission, &mut wanted, &mut BTreeSet::new());
            }
            let found: Vec<&str> = match &shape.geometry {
                Geometry::Mesh(mesh) => mesh.attributes.iter().map(|(name, ..)| name.as_str()).collect(),
                _ => Vec::new(),
            };
            if let Some(name) = wanted.into_iter().find(|name| !found.contains(name)) {
                return Err(missing(shape, name, &found));
            }
        }
        Ok(())
    }

    fn of_material<'a>(
        &'a self,
        id: MaterialId,
        known: &mut [Option<BTreeSet<&'a str>>],
    ) -> BTreeSet<&'a str> {
        let Some(slot) = known.get(id) else { return BTreeSet::new() };
        if let Some(names) = slot {
            return names.clone();
        }
        // A material that contains itself is refused elsewhere.
        known[id] = Some(BTreeSet::new());
        let (mut names, mut seen) = (BTreeSet::new(), BTreeSet::new());
        match &self.materials[id] {
            Material::Model { params, .. } => {
                params.iter().for_each(|v| self.of_value(v, &mut names, &mut seen))
            }
            Material::Mask { opacity: value, .. } | Material::Blend { weight: value, .. } => {
                self.of_value(value, &mut names, &mut seen);
            }
            Material::NormalMap { texture, .. } | Material::BumpMap { texture, .. } => {
                self.of_texture(*texture, &mut names, &mut seen);
            }
            Material::TwoSided { .. }
            | Material::Sum(_)
            | Material::Body { .. }
            | Material::OneSided { .. }
            | Material::Cloth { .. }
            | Material::Null => {}
        }
        for id in self.materials[id].parts() {
            names.extend(self.of_material(id, known));
        }
        known[id] = Some(names.clone());
        names
    }

    fn of_value<'a>(&'a self, value: &Value, names: &mut BTreeSet<&'a str>, seen: &mut BTreeSet<TextureId>) {
        if let Value::Texture(id) = value {
            self.of_texture(*id, names, seen);
        }
    }

    /// Of a texture and all inside that were not `seen` yet: textures may share others, over and over.
    fn of_texture<'a>(
        &'a self,
        id: TextureId,
        names: &mut BTreeSet<&'a str>,
        seen: &mut BTreeSet<TextureId>,
    ) {
        if !seen.insert(id) {
            return;
        }
        match self.textures.get(id) {
            Some(Texture::MeshAttribute { name }) => {
                names.insert(name);
            }
            // Without coordinates of its own, a texture lies on the mesh by those there are.
            Some(Texture::Scaled { texture, .. } | Texture::At { texture, .. }) => {
                self.of_texture(*texture, names, seen)
            }
            Some(Texture::Checkerboard { even: a, odd: b, .. } | Texture::Product { factors: [a, b] }) => {
                self.of_value(a, names, seen);
                self.of_value(b, names, seen);
            }
            Some(Texture::Step { value, .. }) => self.of_value(value, names, seen),
            Some(Texture::Image { .. } | Texture::Cloth { .. }) | None => {}
        }
    }
}

fn missing(shape: &Shape, name: &str, found: &[&str]) -> MissingAttribute {
    let hint = match found {
        [] => "; it has none".into(),
        found => crate::suggest(name, found.iter().copied()),
    };
    MissingAttribute { shape: shape.name.clone(), name: name.into(), hint }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mesh, primitives};
    use glam::Mat4;
    use std::sync::Arc;

    #[test]
    fn an_attribute_that_is_not_there_is_named_with_the_nearest() {
        let mut mesh: Mesh = primitives::block(glam::Vec3::ONE);
        mesh.attributes.push(("vertex_color".into(), 1, vec![1.0; mesh.positions.len()]));
        let scene = |name: &str| Scene {
            textures: vec![
                Texture::MeshAttribute { name: name.into() },
                Texture::Scaled { texture: 0, factor: glam::Vec3::ONE },
            ],
            materials: vec![Material::lambert(Value::Texture(1)), Material::TwoSided { front: 0, back: 0 }],
            shapes: vec![Shape::new("box", Geometry::Mesh(Arc::new(mesh.clone())), Mat4::IDENTITY, 1)],
            ..Scene::default()
        };
        assert_eq!(scene("vertex_color").check_attributes(), Ok(()));
        let problem = scene("vertex_colour").check_attributes().unwrap_err().to_string();
        assert_eq!(problem, "the shape 'box' has no attribute 'vertex_colour'; did you mean 'vertex_color'?");
        // Sixty products, each of the one before by itself: 2⁵⁹ ways to the first.
        let mut deep = scene("nowhere");
        for id in 1..60 {
            let inner = || Value::Texture(id);
            deep.textures.push(Texture::Product { factors: [inner(), inner()] });
        }
        deep.materials[0] = Material::lambert(Value::Texture(60));
        assert!(deep.check_attributes().is_err());
    }
}
