//! What a scene holds.

use super::facts::Facts;
use serde_json::{Value as Json, json};
use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;
use yugen_optics::{ColourSpace, Image, Vec3};
use yugen_scene::Scene;
use yugen_scene::{
    Aov, Camera, FovAxis, Geometry, IntegratorKind, Light, Material, Mesh, Projection, Shape, Texture, Value,
};

/// Everything.
pub fn facts(scene: &Scene) -> Facts {
    let shapes = || scene.shapes.iter().chain(scene.groups.iter().flatten());
    let shining = shapes().filter(|s| s.emission.is_some()).count();
    let mut facts = Facts::default().say("colour_space", scene.working_space.name());
    if let Some(bounds) = scene.bounds() {
        facts = facts.group("bounds", box_of(bounds));
    }
    facts
        .group("geometry", geometry(scene))
        .list("cameras", scene.cameras.iter().map(camera))
        .list("lights", scene.lights.iter().map(light))
        .say("shapes_that_shine", (shining > 0).then_some(shining))
        .group("materials", materials(scene))
        .list("textures", scene.textures.iter().map(texture))
        .say("texture_bytes", Some(texture_bytes(scene)).filter(|b| *b > 0))
        .group("integrator", integrator(scene))
}

/// Corners, and what lies between them.
pub fn box_of([low, high]: [Vec3; 2]) -> Facts {
    Facts::default().say("low", vector(low)).say("high", vector(high)).say("size", vector(high - low))
}

fn vector(v: Vec3) -> Json {
    json!(v.to_array())
}

fn geometry(scene: &Scene) -> Facts {
    let mut meshes: HashSet<*const Mesh> = HashSet::new();
    let (mut triangles, mut vertices, mut bytes) = (0, 0, 0);
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    for shape in scene.shapes.iter().chain(scene.groups.iter().flatten()) {
        let kind = match &shape.geometry {
            Geometry::Mesh(mesh) => {
                if meshes.insert(Arc::as_ptr(mesh)) {
                    triangles += mesh.triangles.len();
                    vertices += mesh.positions.len();
                    bytes += mesh_bytes(mesh);
                }
                "meshes"
            }
            Geometry::Sphere => "spheres",
            Geometry::Rectangle => "rectangles",
            Geometry::Disc => "discs",
            Geometry::Cylinder => "cylinders",
            Geometry::Instance(_) => "instances",
        };
        *kinds.entry(kind).or_default() += 1;
    }
    let seen: usize = scene.shapes.iter().map(|s| placed(scene, s, 0)).sum();
    let mut facts = Facts::default().say("shapes", scene.shapes.len());
    for (kind, count) in kinds {
        facts = facts.say(kind, count);
    }
    facts
        .say("groups", Some(scene.groups.len()).filter(|n| *n > 0))
        .say("vertices", vertices)
        .say("triangles", triangles)
        .say("triangles_with_instances", Some(seen).filter(|n| *n != triangles))
        .say("mesh_bytes", bytes)
}

/// Triangles that a shape places, with those of its group.
fn placed(scene: &Scene, shape: &Shape, depth: usize) -> usize {
    match &shape.geometry {
        Geometry::Mesh(mesh) => mesh.triangles.len(),
        // No reader lets groups contain themselves; a limit costs nothing.
        Geometry::Instance(group) if depth < 16 => scene
            .groups
            .get(*group)
            .map_or(0, |g| g.iter().map(|s| placed(scene, s, depth + 1)).fold(0, usize::saturating_add)),
        _ => 0,
    }
}

/// In memory.
pub fn mesh_bytes(mesh: &Mesh) -> usize {
    let extra: usize = mesh.attributes.iter().map(|(.., values)| size_of_val(&values[..])).sum();
    size_of_val(&mesh.positions[..])
        + size_of_val(&mesh.normals[..])
        + size_of_val(&mesh.uvs[..])
        + size_of_val(&mesh.tangents[..])
        + size_of_val(&mesh.triangles[..])
        + extra
}

fn camera(camera: &Camera) -> Facts {
    let frame = camera.to_world;
    let facts = Facts::default()
        .say("name", Some(camera.name.clone()).filter(|n| !n.is_empty()))
        .say("size", json!([camera.film.width, camera.film.height]))
        .say("crop", camera.film.crop.map_or(Json::Null, |c| json!(c)))
        .say("samples", camera.samples_per_pixel)
        .say("at", vector(frame.w_axis.truncate()))
        .say("towards", vector(frame.z_axis.truncate().normalize_or_zero()));
    match camera.projection {
        Projection::Perspective { fov_x, fov_axis, aperture_radius, focus_distance, .. } => {
            let lens = aperture_radius > 0.0;
            facts
                .say("projection", "perspective")
                .say("field_of_view_degrees", json!(fov_x.to_degrees()))
                .say(
                    "kept",
                    if fov_axis == FovAxis::X {
                        Json::Null
                    } else {
                        json!(format!("{fov_axis:?}").to_lowercase())
                    },
                )
                .say("aperture_radius", if lens { json!(aperture_radius) } else { Json::Null })
                .say("focus_distance", if lens { json!(focus_distance) } else { Json::Null })
        }
        Projection::Orthographic => facts.say("projection", "orthographic"),
    }
}

fn light(light: &Light) -> Facts {
    let facts = |kind: &str| Facts::default().say("type", kind);
    match light {
        Light::Point { position, intensity } => {
            facts("point").say("at", vector(*position)).say("intensity", vector(*intensity))
        }
        Light::Spot { to_world, intensity, cutoff, texture, .. } => facts("spot")
            .say("at", vector(to_world.w_axis.truncate()))
            .say("towards", vector(to_world.z_axis.truncate().normalize_or_zero()))
            .say("intensity", vector(*intensity))
            .say("angle_degrees", json!(cutoff.to_degrees()))
            .say("texture", *texture),
        Light::Directional { direction, irradiance } => {
            facts("directional").say("direction", vector(*direction)).say("irradiance", vector(*irradiance))
        }
        Light::Constant { radiance } => facts("constant").say("radiance", vector(*radiance)),
        Light::Environment { image, scale, .. } => facts("environment")
            .say("size", json!([image.width, image.height]))
            .say("scale", json!(scale))
            .say("bytes", image_bytes(image)),
        Light::Volume { grid, scale, .. } => facts("volume")
            .say("cells", json!(grid.size.to_array()))
            .say("scale", json!(scale))
            .say("bytes", size_of_val(&grid.data[..])),
        Light::Projector { to_world, texture, scale, fov_x } => facts("projector")
            .say("at", vector(to_world.w_axis.truncate()))
            .say("towards", vector(to_world.z_axis.truncate().normalize_or_zero()))
            .say("texture", *texture)
            .say("scale", json!(scale))
            .say("field_of_view_degrees", json!(fov_x.to_degrees())),
    }
}

/// How many there are of each kind.
fn materials(scene: &Scene) -> Facts {
    let mut kinds: BTreeMap<&'static str, usize> = BTreeMap::new();
    for material in &scene.materials {
        let kind = match material {
            Material::Model { kind, .. } => kind.name(),
            Material::TwoSided { .. } => "two-sided",
            Material::Mask { .. } => "mask",
            Material::Blend { .. } => "blend",
            Material::Sum(_) => "sum",
            Material::NormalMap { .. } => "normal map",
            Material::BumpMap { .. } => "bump map",
            Material::Cloth { .. } => "cloth",
            Material::Body { .. } => "body",
            Material::OneSided { .. } => "one-sided",
            Material::Null => "null",
        };
        *kinds.entry(kind).or_default() += 1;
    }
    kinds.into_iter().fold(Facts::default(), |facts, (kind, count)| facts.say(kind, count))
}

fn image_bytes(image: &Image) -> usize {
    size_of_val(&image.data[..])
}

fn texture(texture: &Texture) -> Facts {
    let facts = |kind: &str| Facts::default().say("type", kind);
    let value = |v: &Value| match v {
        Value::Number(n) => json!(n),
        Value::Rgb(c) => vector(*c),
        Value::Texture(id) => json!(format!("texture {id}")),
    };
    match texture {
        Texture::Image { image, channel, .. } => facts("picture")
            .say("size", json!([image.width, image.height]))
            .say("channels", image.channels.join(" "))
            .say("channel", *channel)
            .say("bytes", image_bytes(image)),
        Texture::Checkerboard { even, odd, .. } => {
            facts("checkerboard").say("even", value(even)).say("odd", value(odd))
        }
        Texture::MeshAttribute { name, .. } => facts("attribute of a mesh").say("name", name.clone()),
        Texture::Cloth { maps, .. } => facts("maps of a cloth")
            .say("size", json!([maps.width, maps.height]))
            .say("bytes", size_of_val(&maps.texels[..])),
        Texture::Scaled { texture, factor, .. } => {
            facts("another times a factor").say("texture", *texture).say("factor", vector(*factor))
        }
        Texture::At { texture, attribute } => facts("another at coordinates of the mesh")
            .say("texture", *texture)
            .say("name", attribute.clone()),
        Texture::Product { factors: [a, b] } => {
            facts("product").say("first", value(a)).say("second", value(b))
        }
        Texture::Step { value: v, edge } => facts("step").say("value", value(v)).say("edge", json!(edge)),
    }
}

/// Of pictures and maps, each counted once however often it is used; environments among them.
fn texture_bytes(scene: &Scene) -> usize {
    let mut seen = HashSet::new();
    let mut sum = 0;
    let mut add = |at: usize, bytes: usize| {
        if seen.insert(at) {
            sum += bytes;
        }
    };
    for texture in &scene.textures {
        match texture {
            Texture::Image { image, .. } => add(Arc::as_ptr(image) as usize, image_bytes(image)),
            Texture::Cloth { maps, .. } => add(Arc::as_ptr(maps) as usize, size_of_val(&maps.texels[..])),
            _ => {}
        }
    }
    for light in &scene.lights {
        if let Light::Environment { image, .. } = light {
            add(Arc::as_ptr(image) as usize, image_bytes(image));
        }
        if let Light::Volume { grid, .. } = light {
            add(Arc::as_ptr(grid) as usize, size_of_val(&grid.data[..]));
        }
    }
    sum
}

fn integrator(scene: &Scene) -> Facts {
    let i = &scene.integrator;
    let kind = match i.kind {
        IntegratorKind::Path => "path",
        IntegratorKind::Direct => "direct",
        IntegratorKind::Depth => "depth",
        IntegratorKind::Aov => "aov",
    };
    let aovs: Vec<&str> = i.aovs.iter().map(|a: &Aov| a.name()).collect();
    Facts::default()
        .say("kind", kind)
        .say("max_depth", i.max_depth)
        .say("clamp", i.clamp.map_or(Json::Null, |c| json!(c)))
        .say("hide_lights", Some(true).filter(|_| i.hide_emitters))
        .say("layers", Some(aovs.join(", ")).filter(|a| !a.is_empty()))
}

/// The name of a known space with these chromaticities, as far as three digits tell.
pub fn space_name(chromaticities: [[f64; 2]; 4]) -> Option<&'static str> {
    let near = |s: &ColourSpace| {
        let known = s.chromaticities();
        known.iter().flatten().zip(chromaticities.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-3)
    };
    ColourSpace::ALL.iter().find(|s| near(s)).map(|s| s.name())
}
