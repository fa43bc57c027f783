//! Lights by name: what can be dimmed and coloured after the picture is made.

use super::{Light, Scene};

/// The lights of a scene in groups of one name.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightGroups {
    /// In order of first use, shapes that shine before other lights. Fit for the name of a layer: no points.
    pub names: Vec<String>,
    /// The group of each of [`Scene::shapes`]; `None` for those that do not shine.
    pub of_shapes: Vec<Option<u32>>,
    /// The group of each of [`Scene::lights`].
    pub of_lights: Vec<u32>,
}

impl Scene {
    /// Adds a light that goes by `name`; by that of its kind where there is none.
    pub fn add_light(&mut self, name: &str, light: Light) {
        self.light_names.resize(self.lights.len(), String::new());
        self.light_names.push(name.to_string());
        self.lights.push(light);
    }

    /// The name of a light: its own, else `environment` for what surrounds the scene, `fire` for flames and `light` for all others.
    pub fn light_name(&self, index: usize) -> &str {
        match (self.light_names.get(index), self.lights.get(index)) {
            (Some(name), _) if !name.is_empty() => name,
            (_, Some(Light::Constant { .. } | Light::Environment { .. })) => "environment",
            (_, Some(Light::Volume { .. })) => "fire",
            _ => "light",
        }
    }

    /// Its lights by name; a shape that shines goes by its own.
    pub fn light_groups(&self) -> LightGroups {
        let mut names: Vec<String> = Vec::new();
        let mut group = |name: &str| {
            let named = |c: char| if c == '.' || c.is_control() { '_' } else { c };
            let name: String =
                if name.is_empty() { "light" } else { name }.chars().take(64).map(named).collect();
            let known = names.iter().position(|n| *n == name);
            known.unwrap_or_else(|| {
                names.push(name);
                names.len() - 1
            }) as u32
        };
        let of_shapes = self.shapes.iter().map(|s| s.emission.as_ref().map(|_| group(&s.name))).collect();
        let of_lights = (0..self.lights.len()).map(|i| group(self.light_name(i))).collect();
        LightGroups { names, of_shapes, of_lights }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Geometry, Shape, Value};
    use glam::{Mat4, Vec3};

    #[test]
    fn lights_of_one_name_are_one_group_and_all_have_one() {
        let mut scene = Scene::default();
        let shape = |name: &str| Shape {
            emission: Some(Value::Number(1.0)),
            ..Shape::new(name, Geometry::Sphere, Mat4::IDENTITY, 0)
        };
        scene.shapes =
            vec![shape("lamp"), Shape::new("lamp", Geometry::Disc, Mat4::IDENTITY, 0), shape("v1.2")];
        // As readers do that know no names.
        scene.lights.push(Light::Constant { radiance: Vec3::ONE });
        let point = || Light::Point { position: Vec3::ZERO, intensity: Vec3::ONE };
        scene.add_light("lamp", point());
        scene.add_light("", point());
        let groups = scene.light_groups();
        assert_eq!(groups.names, ["lamp", "v1_2", "environment", "light"]);
        assert_eq!(groups.of_shapes, [Some(0), None, Some(1)]);
        assert_eq!(groups.of_lights, [2, 0, 3]);
    }
}
