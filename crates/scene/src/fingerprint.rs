//! What tells one scene from another, whatever files it came from.

use super::{Geometry, Light, Material, Mesh, Scene, Shape, Texture};
use bytemuck::cast_slice;
use std::collections::HashMap;
use std::sync::Arc;
use yugen_motion::fire::Grid;
use yugen_optics::{Fingerprint, Image};
use yugen_reflectance::btf::Btf;

/// Up to so many parts of a kind are told apart; of more it is only told that one of them has changed.
const FEW: usize = 64;

impl Scene {
    /// Everything in it but its cameras and its integrator, part by part: a name for people and a hash. A vertex moved
    /// in a mesh, a texel painted over or a table measured anew give another hash, though no scene file changed; a
    /// comment in a file does not. About as fast as memory is read. A name may stand for several parts.
    pub fn parts(&self) -> Vec<(String, u64)> {
        // By name, so that a new field of the scene cannot be forgotten here.
        let Self {
            working_space,
            cameras: _,
            textures,
            materials,
            material_names: _,
            shapes,
            groups,
            lights,
            light_names: _,
            // Where they are now is in the shapes and lights.
            seconds: _,
            figures: _,
            fires: _,
            caches: _,
            integrator: _,
            display: _,
        } = self;
        let mut parts = Parts::default();
        let of = |write: &dyn Fn(&mut Fingerprint)| {
            let mut print = Fingerprint::default();
            write(&mut print);
            print.finish()
        };
        parts.all.push(("the working space".into(), of(&|p| p.debug(working_space))));

        // A mesh may serve many shapes.
        let everything = || groups.iter().flatten().chain(shapes);
        let mut meshes = HashMap::new();
        let mut hashes = Vec::new();
        for shape in everything() {
            if let Geometry::Mesh(m) = &shape.geometry {
                meshes.entry(Arc::as_ptr(m)).or_insert_with(|| {
                    hashes.push((format!("the mesh of '{}'", shape.name), mesh(m)));
                    hashes.len()
                });
            }
        }
        parts.add("the meshes", hashes);
        let each = textures.iter().enumerate();
        parts.add("the textures", each.map(|(i, t)| (texture_name(i, t), of(&|p| texture(p, t)))).collect());
        let mut user = vec![None; materials.len()];
        for shape in everything() {
            if let Some(user) = user.get_mut(shape.material) {
                user.get_or_insert(&shape.name);
            }
        }
        let name = |i: usize| match user[i] {
            Some(shape) => format!("the material of '{shape}'"),
            None => format!("material {}", i + 1),
        };
        let each = materials.iter().enumerate();
        parts.add("the materials", each.map(|(i, m)| (name(i), of(&|p| material(p, m)))).collect());
        let each = groups.iter().enumerate().map(|(i, group)| {
            let hash = |p: &mut Fingerprint| group.iter().for_each(|s| shape(p, s, &meshes));
            (format!("group {}", i + 1), of(&hash))
        });
        parts.add("the groups", each.collect());
        let each = shapes.iter().map(|s| (format!("shape '{}'", s.name), of(&|p| shape(p, s, &meshes))));
        parts.add("the shapes", each.collect());
        let name = |i: usize| format!("light {} ('{}')", i + 1, self.light_name(i));
        let each = lights.iter().enumerate();
        parts.add("the lights", each.map(|(i, l)| (name(i), of(&|p| light(p, l)))).collect());
        parts.all
    }
}

#[derive(Default)]
struct Parts {
    all: Vec<(String, u64)>,
}

impl Parts {
    /// One by one while they are few, else together as `kind`.
    fn add(&mut self, kind: &str, each: Vec<(String, u64)>) {
        if each.len() <= FEW {
            self.all.extend(each);
            return;
        }
        let mut print = Fingerprint::default();
        each.iter().for_each(|(_, hash)| print.word(*hash));
        self.all.push((kind.into(), print.finish()));
    }
}

fn texture_name(i: usize, texture: &Texture) -> String {
    match texture {
        Texture::Image { image, .. } => {
            format!("texture {} (a picture of {}x{})", i + 1, image.width, image.height)
        }
        _ => format!("texture {}", i + 1),
    }
}

fn texture(print: &mut Fingerprint, texture: &Texture) {
    match texture {
        Texture::Image { image, filter, wrap, to_uv, channel } => {
            picture(print, image);
            print.debug(&(filter, wrap, to_uv, channel));
        }
        Texture::Cloth { maps, wrap, to_uv } => {
            let Btf { width, height, texels, colour_space } = &**maps;
            print.bytes(cast_slice(texels));
            print.debug(&(width, height, colour_space, wrap, to_uv));
        }
        small => print.debug(small),
    }
}

fn material(print: &mut Fingerprint, material: &Material) {
    match material {
        Material::Model { kind, params, table } => {
            print.debug(&(kind, params));
            print.bytes(cast_slice(table));
        }
        small => print.debug(small),
    }
}

fn light(print: &mut Fingerprint, light: &Light) {
    match light {
        Light::Environment { image, scale, to_world } => {
            picture(print, image);
            print.debug(&(scale, to_world));
        }
        Light::Volume { grid, scale, to_world } => {
            let Grid { size, lower, upper, space, data, solid } = &**grid;
            print.bytes(cast_slice(data));
            print.bytes(cast_slice(solid));
            print.debug(&(size, lower, upper, space, scale, to_world));
        }
        small => print.debug(small),
    }
}

fn picture(print: &mut Fingerprint, image: &Image) {
    let Image { width, height, channels, data } = image;
    print.debug(&(width, height, channels));
    print.bytes(cast_slice(data));
}

/// All of a shape but the content of its mesh, of which `meshes` has the number.
fn shape(print: &mut Fingerprint, shape: &Shape, meshes: &HashMap<*const Mesh, usize>) {
    let Shape {
        name: _, // For messages only.
        geometry,
        to_world,
        flip_normals,
        face_normals,
        material,
        emission,
        two_sided_emission,
    } = shape;
    print.debug(&(to_world, flip_normals, face_normals, material, emission, two_sided_emission));
    match geometry {
        Geometry::Mesh(m) => print.debug(&meshes.get(&Arc::as_ptr(m))),
        small => print.debug(small),
    }
}

fn mesh(mesh: &Mesh) -> u64 {
    let Mesh { name: _, positions, normals, uvs, tangents, attributes, triangles } = mesh;
    let mut print = Fingerprint::default();
    print.bytes(cast_slice(positions));
    print.bytes(cast_slice(normals));
    print.bytes(cast_slice(uvs));
    print.bytes(cast_slice(tangents));
    for (name, width, values) in attributes {
        print.debug(&(name, width));
        print.bytes(cast_slice(values));
    }
    print.bytes(cast_slice(triangles));
    print.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{TextureFilter, Value, Wrap, primitives};
    use glam::{Affine2, Mat4, Vec3};
    use yugen_reflectance::Kind;

    fn scene(mesh: Mesh, image: Image, table: Vec<f32>) -> Scene {
        let texture = Texture::Image {
            image: Arc::new(image.clone()),
            filter: TextureFilter::Bilinear,
            wrap: [Wrap::Repeat; 2],
            to_uv: Affine2::IDENTITY,
            channel: None,
        };
        let params = vec![Value::Texture(0)];
        let material = Material::Model { kind: Kind::Lambert, params, table: table.into() };
        let mesh = Arc::new(mesh);
        let place = |x| Shape::new("s", Geometry::Mesh(mesh.clone()), Mat4::from_translation(Vec3::X * x), 0);
        Scene {
            textures: vec![texture],
            materials: vec![material],
            shapes: vec![place(0.0), place(2.0)],
            lights: vec![Light::Environment { image: Arc::new(image), scale: 1.0, to_world: Mat4::IDENTITY }],
            ..Scene::default()
        }
    }

    #[test]
    fn one_vertex_texel_or_number_of_a_table_changes_the_part_it_is_in() {
        let (mesh, image, table) = (primitives::ball(12), Image::rgb(3, 2), vec![0.5; 5]);
        let of = |m: &Mesh, i: &Image, t: &[f32]| scene(m.clone(), i.clone(), t.to_vec()).parts();
        let whole = of(&mesh, &image, &table);
        assert_eq!(whole, of(&mesh, &image, &table));
        type Named = Vec<(String, u64)>;
        let mut changed: Vec<(&str, &str, Named)> = Vec::new();
        for (what, change) in [
            ("vertex", (|m| m.positions[7].y += 1e-6) as fn(&mut Mesh)),
            ("normal", |m| m.normals[7].y += 1e-3),
            ("uv", |m| m.uvs[7].x += 1e-3),
            ("triangle", |m| m.triangles[3].swap(0, 1)),
            ("attribute", |m| m.attributes.push(("vertex_color".into(), 1, vec![1.0]))),
        ] {
            let mut m = mesh.clone();
            change(&mut m);
            changed.push((what, "the mesh of 's'", of(&m, &image, &table)));
        }
        let mut i = image.clone();
        i.data[17] = 1e-3;
        // It is the environment, too.
        changed.push((
            "texel",
            "texture 1 (a picture of 3x2), light 1 ('environment')",
            of(&mesh, &i, &table),
        ));
        let mut t = table.clone();
        t[4] = 0.25;
        changed.push(("table", "the material of 's'", of(&mesh, &image, &t)));
        let mut s = scene(mesh.clone(), image.clone(), table.clone());
        s.shapes[1].to_world.w_axis.x += 1e-3;
        changed.push(("place", "shape 's'", s.parts()));
        for (n, (what, named, parts)) in changed.iter().enumerate() {
            let different = parts.iter().zip(&whole).filter(|(a, b)| a != b).map(|(a, _)| a.0.as_str());
            assert_eq!(different.collect::<Vec<_>>().join(", "), *named, "{what}");
            assert!(changed[..n].iter().all(|(.., other)| other != parts), "{what}");
        }
        let mut s = scene(mesh.clone(), image.clone(), table.clone());
        s.shapes.pop();
        assert_eq!(s.parts().len() + 1, whole.len());
        // Which of two meshes a shape has.
        let two = |of_last: usize| {
            let mut s = scene(mesh.clone(), image.clone(), table.clone());
            let meshes = [Arc::new(mesh.clone()), Arc::new(primitives::ball(8))];
            s.shapes = [0, 1, of_last]
                .map(|i| Shape::new("s", Geometry::Mesh(meshes[i].clone()), Mat4::IDENTITY, 0))
                .to_vec();
            s.parts()
        };
        assert_ne!(two(0), two(1));
        // Too many to be told one by one.
        let mut s = scene(mesh, image, table);
        s.shapes = (0..100).map(|i| Shape { name: i.to_string(), ..s.shapes[0].clone() }).collect();
        assert!(s.parts().iter().any(|(name, _)| name == "the shapes"));
    }
}
