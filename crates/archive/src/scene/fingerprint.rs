//! What tells one scene from another, whatever files it came from.

use super::{Geometry, Light, Material, Mesh, Scene, Shape, Texture};
use bytemuck::cast_slice;
use std::collections::HashMap;
use std::sync::Arc;
use yugen_optics::{Fingerprint, Image};

impl Scene {
    /// A hash of everything in it: a vertex moved in a mesh, a texel painted over or a table measured anew give
    /// another one, though no scene file changed; a comment in a file does not. About as fast as memory is read.
    pub fn fingerprint(&self) -> u64 {
        // By name, so that a new field of the scene cannot be forgotten here.
        let Self { working_space, cameras, textures, materials, shapes, groups, lights, integrator } = self;
        let mut print = Fingerprint::default();
        print.debug(&(working_space, cameras, integrator));
        for texture in textures {
            match texture {
                Texture::Image { image, filter, wrap, to_uv, channel } => {
                    picture(&mut print, image);
                    print.debug(&(filter, wrap, to_uv, channel));
                }
                Texture::Cloth { maps, wrap, to_uv } => {
                    picture(&mut print, &crate::formats::btf::image(maps));
                    print.debug(&(maps.colour_space, wrap, to_uv));
                }
                small => print.debug(small),
            }
        }
        for material in materials {
            match material {
                Material::Model { kind, params, table } => {
                    print.debug(&(kind, params));
                    print.bytes(cast_slice(table));
                }
                small => print.debug(small),
            }
        }
        // A mesh may serve many shapes.
        let mut meshes = HashMap::new();
        for group in groups.iter().chain([shapes]) {
            print.word(group.len() as u64);
            for shape in group {
                self::shape(&mut print, shape, &mut meshes);
            }
        }
        for light in lights {
            match light {
                Light::Environment { image, scale, to_world } => {
                    picture(&mut print, image);
                    print.debug(&(scale, to_world));
                }
                small => print.debug(small),
            }
        }
        print.finish()
    }
}

fn picture(print: &mut Fingerprint, image: &Image) {
    let Image { width, height, channels, data } = image;
    print.debug(&(width, height, channels));
    print.bytes(cast_slice(data));
}

fn shape(print: &mut Fingerprint, shape: &Shape, meshes: &mut HashMap<*const Mesh, u64>) {
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
        Geometry::Mesh(m) => print.word(*meshes.entry(Arc::as_ptr(m)).or_insert_with(|| mesh(m))),
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
    use crate::scene::{TextureFilter, Value, Wrap, primitives};
    use glam::{Affine2, Mat4, Vec3};
    use yugen_reflectance::Kind;

    fn scene(mesh: Mesh, image: Image, table: Vec<f32>) -> Scene {
        let texture = Texture::Image {
            image: Arc::new(image.clone()),
            filter: TextureFilter::Bilinear,
            wrap: Wrap::Repeat,
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
    fn one_vertex_texel_or_number_of_a_table_gives_another() {
        let (mesh, image, table) = (primitives::ball(12), Image::rgb(3, 2), vec![0.5; 5]);
        let of = |m: &Mesh, i: &Image, t: &[f32]| scene(m.clone(), i.clone(), t.to_vec()).fingerprint();
        let whole = of(&mesh, &image, &table);
        assert_eq!(whole, of(&mesh, &image, &table));
        let mut changed: Vec<(&str, u64)> = Vec::new();
        for (what, change) in [
            ("vertex", (|m| m.positions[7].y += 1e-6) as fn(&mut Mesh)),
            ("normal", |m| m.normals[7].y += 1e-3),
            ("uv", |m| m.uvs[7].x += 1e-3),
            ("triangle", |m| m.triangles[3].swap(0, 1)),
            ("attribute", |m| m.attributes.push(("vertex_color".into(), 1, vec![1.0]))),
        ] {
            let mut m = mesh.clone();
            change(&mut m);
            changed.push((what, of(&m, &image, &table)));
        }
        let mut i = image.clone();
        i.data[17] = 1e-3;
        changed.push(("texel", of(&mesh, &i, &table)));
        let mut t = table.clone();
        t[4] = 0.25;
        changed.push(("table", of(&mesh, &image, &t)));
        let mut s = scene(mesh.clone(), image.clone(), table.clone());
        s.shapes[1].to_world.w_axis.x += 1e-3;
        changed.push(("place", s.fingerprint()));
        s = scene(mesh, image, table);
        s.shapes.pop();
        changed.push(("shape", s.fingerprint()));
        for (n, (what, print)) in changed.iter().enumerate() {
            assert_ne!(*print, whole, "{what}");
            assert!(changed[..n].iter().all(|(_, other)| other != print), "{what}");
        }
    }
}
