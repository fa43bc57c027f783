use super::*;
use yugen_optics::colour::srgb_to_linear;
use yugen_scene::{Material, Texture};

fn load(json: &str) -> Result<Scene, Error> {
    read(json.as_bytes(), "scene.gltf".as_ref(), &Options::default())
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let groups = bytes.chunks(3).map(|g| {
        let bits = g.iter().fold(0u32, |b, &v| b << 8 | u32::from(v)) << (8 * (3 - g.len()));
        (0..4).map(
            move |i| if i <= g.len() { DIGITS[(bits >> (18 - 6 * i)) as usize & 63] as char } else { '=' },
        )
    });
    groups.flatten().collect()
}

/// A quad of four vertices with everything a vertex can have, as buffer 0, and a picture as buffer view 1.
fn quad() -> (String, usize, usize) {
    let mut bytes = Vec::new();
    let mut floats = |v: &[f32]| bytes.extend(v.iter().flat_map(|x| x.to_le_bytes()));
    floats(&[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]); // 0 positions
    floats(&[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]); // 48 normals
    floats(&[0., 1., 1., 1., 1., 0., 0., 0.]); // 96 uvs
    floats(&[1., 0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0.]); // 128 colours
    floats(&[0., 0., 2., 0., 0., 0., 0., 0., 0., 0., 0., 0.]); // 176 morph target
    bytes.extend([0u8, 1, 2, 0, 2, 3, 0, 0]); // 224 indices
    let picture = Image {
        width: 2,
        height: 1,
        channels: ["R", "G", "B", "A"].map(String::from).to_vec(),
        data: vec![0.5, 0.25, 0.1, 1.0, 0.05, 0.02, 0.01, 0.2],
    };
    let options = super::super::image::WriteOptions::from(ColourSpace::LinearSrgb);
    let png = super::super::image::write_bytes("a.png".as_ref(), &picture, &options).unwrap();
    let start = bytes.len();
    bytes.extend(&png);
    (format!("data:application/octet-stream;base64,{}", base64(&bytes)), start, png.len())
}

fn document(extra: &str, primitive: &str, nodes: &str) -> String {
    let (uri, start, png) = quad();
    format!(
        r#"{{ "asset": {{ "version": "2.0" }}, {extra}
        "nodes": {nodes},
        "meshes": [{{ "name": "quad", "primitives": [{{ "attributes": {{ "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }}, "indices": 5 {primitive} }}] }}],
        "accessors": [
            {{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" }},
            {{ "bufferView": 0, "byteOffset": 48, "componentType": 5126, "count": 4, "type": "VEC3" }},
            {{ "bufferView": 0, "byteOffset": 96, "componentType": 5126, "count": 4, "type": "VEC2" }},
            {{ "bufferView": 0, "byteOffset": 128, "componentType": 5126, "count": 4, "type": "VEC3" }},
            {{ "bufferView": 0, "byteOffset": 176, "componentType": 5126, "count": 4, "type": "VEC3" }},
            {{ "bufferView": 0, "byteOffset": 224, "componentType": 5121, "count": 6, "type": "SCALAR" }}
        ],
        "images": [{{ "bufferView": 1, "mimeType": "image/png" }}],
        "samplers": [{{ "wrapS": 33071, "wrapT": 33071, "magFilter": 9728 }}],
        "textures": [{{ "source": 0, "sampler": 0 }}],
        "bufferViews": [ {{ "buffer": 0, "byteLength": {start} }}, {{ "buffer": 0, "byteOffset": {start}, "byteLength": {png} }} ],
        "buffers": [{{ "uri": "{uri}", "byteLength": {} }}]
        }}"#,
        start + png
    )
}

fn param(scene: &Scene, material: usize, name: &str) -> Value {
    match &scene.materials[material] {
        Material::Model { kind, params, .. } => {
            params[kind.params().iter().position(|p| p.name == name).unwrap()].clone()
        }
        Material::TwoSided { front: base, .. }
        | Material::OneSided { base }
        | Material::Mask { base, .. }
        | Material::NormalMap { base, .. } => param(scene, *base, name),
        other => panic!("{other:?}"),
    }
}

#[test]
fn geometry_instances_cameras_and_lights() {
    let extra = r#"
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [
            { "type": "spot", "color": [1, 0.5, 0], "intensity": 10, "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.3 } },
            { "type": "directional", "intensity": 3 } ] } },
        "cameras": [
            { "type": "perspective", "perspective": { "yfov": 0.8, "aspectRatio": 1.5, "znear": 0.1 } },
            { "type": "orthographic", "orthographic": { "xmag": 4, "ymag": 2, "znear": 0.1, "zfar": 10 } } ],"#;
    let nodes = r#"[
        { "name": "a", "mesh": 0, "translation": [1, 2, 3], "children": [1] },
        { "name": "b", "mesh": 0, "rotation": [0, 0, 0.7071068, 0.7071068], "scale": [2, 2, 2] },
        { "name": "eye", "camera": 0, "translation": [0, 0, 5], "scale": [3, 3, 3] },
        { "camera": 1 },
        { "extensions": { "KHR_lights_punctual": { "light": 0 } }, "translation": [0, 4, 0] },
        { "extensions": { "KHR_lights_punctual": { "light": 1 } } } ]"#;
    let json = document(extra, "", nodes);
    let mut folders = Folders::default();
    let srgb = read_into(ColourSpace::LinearSrgb, json.as_bytes(), "scene.gltf".as_ref(), &folders).unwrap();
    assert_eq!((srgb.groups.len(), srgb.shapes.len(), srgb.cameras.len(), srgb.lights.len()), (1, 2, 2, 2));
    assert!(srgb.shapes.iter().all(|s| matches!(s.geometry, Geometry::Instance(0))));
    // The child is scaled, turned and then moved with its parent.
    let corner = srgb.shapes[1].to_world.transform_point3(Vec3::X);
    assert!((corner - Vec3::new(1.0, 4.0, 3.0)).length() < 1e-5, "{corner}");
    let Geometry::Mesh(mesh) = &srgb.groups[0][0].geometry else { panic!("a mesh") };
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!((mesh.uvs[0], mesh.positions[2]), (Vec2::new(0.0, 1.0), Vec3::new(1.0, 1.0, 0.0)));

    let eye = &srgb.cameras[0];
    assert_eq!((eye.name.as_str(), eye.film.width, eye.film.height), ("eye", 864, 576));
    // Looks along -z with +x of the picture to the right, which is our -x axis, and is not scaled.
    assert!((eye.to_world.transform_vector3(Vec3::Z) - Vec3::NEG_Z).length() < 1e-6);
    assert!((eye.to_world.transform_vector3(Vec3::X) - Vec3::NEG_X).length() < 1e-6);
    let Projection::Perspective { fov_x, .. } = eye.projection else { panic!("perspective") };
    assert!(((0.5 * fov_x).tan() - 1.5 * 0.4f32.tan()).abs() < 1e-5);
    assert_eq!(srgb.cameras[1].projection, Projection::Orthographic);
    assert_eq!(srgb.cameras[1].film.width, 1152);
    assert!((srgb.cameras[1].to_world.transform_vector3(Vec3::X).length() - 4.0).abs() < 1e-5);
    let Light::Spot { to_world, intensity, beam, cutoff, .. } = srgb.lights[0] else { panic!("a spot") };
    assert!((to_world.transform_vector3(Vec3::Z) - Vec3::NEG_Z).length() < 1e-6);
    assert_eq!((intensity, beam, cutoff), (Vec3::new(10.0, 5.0, 0.0), 0.1, 0.3));
    let Light::Directional { direction, irradiance } = srgb.lights[1] else { panic!("a sun") };
    assert_eq!((direction, irradiance), (Vec3::NEG_Z, Vec3::splat(3.0)));
    folders = Folders::default();
    let wide =
        read_into(ColourSpace::LinearRec2020, json.as_bytes(), "scene.gltf".as_ref(), &folders).unwrap();
    let Light::Spot { intensity, .. } = wide.lights[0] else { panic!("a spot") };
    assert!((intensity.x - (6.274 + 5.0 * 0.3293)).abs() < 2e-3, "{intensity}");
}

#[test]
fn materials_with_every_extension() {
    let extra = r#""materials": [
        { "name": "all", "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.5,
          "emissiveFactor": [1, 0, 0],
          "normalTexture": { "index": 0, "scale": 0.7 },
          "pbrMetallicRoughness": { "baseColorFactor": [1, 0.5, 0.25, 1], "metallicFactor": 0.5, "roughnessFactor": 0.4,
            "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": { "offset": [0.5, 0], "rotation": 1.5707963, "scale": [2, 3] } } },
            "metallicRoughnessTexture": { "index": 0 } },
          "extensions": {
            "KHR_materials_emissive_strength": { "emissiveStrength": 7 },
            "KHR_materials_ior": { "ior": 1.8 },
            "KHR_materials_specular": { "specularFactor": 0.3, "specularColorFactor": [1, 1, 1] },
            "KHR_materials_sheen": { "sheenColorFactor": [0.2, 0.2, 0.2], "sheenRoughnessFactor": 0.6 },
            "KHR_materials_clearcoat": { "clearcoatFactor": 0.9, "clearcoatRoughnessFactor": 0.1 },
            "KHR_materials_anisotropy": { "anisotropyStrength": 0.8, "anisotropyRotation": -0.5 },
            "KHR_materials_iridescence": { "iridescenceFactor": 1, "iridescenceIor": 1.4, "iridescenceThicknessMinimum": 100,
              "iridescenceThicknessMaximum": 500, "iridescenceThicknessTexture": { "index": 0 } } } } ],"#;
    let json = document(extra, r#", "material": 0"#, r#"[{ "mesh": 0 }]"#);
    let scene =
        read_into(ColourSpace::LinearSrgb, json.as_bytes(), "s.gltf".as_ref(), &Folders::default()).unwrap();
    let shape = &scene.shapes[0];
    // What is not there does not shine.
    let Some(Value::Texture(glow)) = shape.emission else { panic!("emission with holes") };
    let Texture::Scaled { texture: mask, factor } = scene.textures[glow] else { panic!("times the opacity") };
    assert!(matches!(scene.textures[mask], Texture::Step { .. }));
    assert_eq!(factor, Vec3::new(7.0, 0.0, 0.0));
    assert!(shape.two_sided_emission);
    let Material::Mask { opacity: Value::Texture(holes), base } = scene.materials[shape.material] else {
        panic!("a mask")
    };
    // The alpha test comes after the filter.
    let Texture::Step { value: Value::Texture(alpha), edge: 0.5 } = scene.textures[holes] else {
        panic!("a step")
    };
    let Texture::Image { channel, wrap, filter, to_uv, .. } = &scene.textures[alpha] else {
        panic!("a picture")
    };
    assert_eq!(
        (*channel, *wrap, *filter),
        (Some(3), [yugen_scene::Wrap::Clamp; 2], yugen_scene::TextureFilter::Nearest)
    );
    // Scale, then rotate counter-clockwise as seen with v down, then move.
    let moved = to_uv.transform_point2(Vec2::new(0.25, 0.5));
    assert!((moved - Vec2::new(0.5 + 1.5, -0.5)).length() < 1e-5, "{moved}");
    let Material::TwoSided { front, back } = scene.materials[base] else { panic!("two-sided") };
    assert_eq!(front, back);
    assert!(matches!(scene.materials[front], Material::NormalMap { scale: 0.7, .. }));
    for (name, value) in [
        ("ior", 1.8),
        ("specular", 0.3),
        ("sheen_roughness", 0.6),
        ("clearcoat", 0.9),
        ("clearcoat_roughness", 0.1),
        ("anisotropy", 0.8),
        ("anisotropy_rotation", std::f32::consts::TAU - 0.5),
        ("iridescence", 1.0),
        ("iridescence_ior", 1.4),
    ] {
        assert_eq!(param(&scene, base, name), Value::Number(value), "{name}");
    }
    assert_eq!(param(&scene, base, "sheen_color"), Value::Rgb(Vec3::splat(0.2)));
    let channel_and_factor = |name: &str| {
        let Value::Texture(id) = param(&scene, base, name) else { panic!("{name} is textured") };
        let Texture::Scaled { texture, factor } = scene.textures[id] else { panic!("{name} has a factor") };
        let Texture::Image { channel, image, .. } = &scene.textures[texture] else {
            panic!("{name} is a picture")
        };
        (*channel, factor, image.clone())
    };
    assert_eq!(channel_and_factor("metallic").0, Some(2));
    let (channel, factor, image) = channel_and_factor("roughness");
    assert_eq!((channel, factor), (Some(1), Vec3::splat(0.4)));
    // Roughness is a number: the picture's display value as it is, here that of 0.25 in eight bits.
    assert!((srgb_to_linear(image.data[1]) - 0.25).abs() < 0.003, "{}", image.data[1]);
    let (channel, factor, image) = channel_and_factor("base_color");
    assert_eq!((channel, factor), (None, Vec3::new(1.0, 0.5, 0.25)));
    assert!((image.data[1] - 0.25).abs() < 0.003);
    let Value::Texture(thickness) = param(&scene, base, "iridescence_thickness") else { panic!("textured") };
    let Texture::Image { image: film, .. } = &scene.textures[thickness] else { panic!("a picture") };
    let green = yugen_optics::colour::linear_to_srgb(0.25);
    assert!((film.data[0] - (100.0 + 400.0 * green)).abs() < 2.0, "{}", film.data[0]);

    // In another space the coloured factor multiplies in linear sRGB all the same.
    let wide = read_into(ColourSpace::LinearRec2020, json.as_bytes(), "s.gltf".as_ref(), &Folders::default())
        .unwrap();
    let Value::Texture(id) = param(&wide, wide.shapes[0].material, "base_color") else { panic!("textured") };
    let Texture::Image { image: baked, .. } = &wide.textures[id] else { panic!("baked") };
    let to = ColourSpace::LinearSrgb.matrix_to(ColourSpace::LinearRec2020);
    let expected = to * (Vec3::from_slice(&image.data[..3]) * factor);
    assert!((Vec3::from_slice(&baked.data[..3]) - expected).abs().max_element() < 1e-5);
}

#[test]
fn a_mesh_has_the_texture_coordinates_that_its_material_asks_for() {
    let uvs = |textures: &str| {
        let extra = format!(r#""materials": [{{ "name": "m", {textures} }}],"#);
        let json = document(&extra, r#", "material": 0"#, r#"[{ "mesh": 0 }]"#)
            .replace(r#""TEXCOORD_0": 2"#, r#""TEXCOORD_0": 2, "TEXCOORD_1": 6"#)
            .replace(
                r#""count": 6, "type": "SCALAR" }"#,
                r#""count": 6, "type": "SCALAR" },
                { "bufferView": 0, "byteOffset": 128, "componentType": 5126, "count": 4, "type": "VEC2" }"#,
            );
        let scene = load(&json).unwrap();
        let shapes = scene.groups.iter().flatten().chain(&scene.shapes);
        let mut meshes = shapes.filter_map(|s| match &s.geometry {
            Geometry::Mesh(mesh) => Some(mesh.uvs[0]),
            _ => None,
        });
        meshes.next().expect("a mesh")
    };
    let (first, second) = (Vec2::new(0.0, 1.0), Vec2::new(1.0, 0.0));
    assert_eq!(uvs(r#""doubleSided": true"#), first);
    assert_eq!(uvs(r#""normalTexture": { "index": 0 }"#), first);
    assert_eq!(uvs(r#""normalTexture": { "index": 0, "texCoord": 1 }"#), second);
    // The transform's own word counts, and so do the textures of extensions.
    let transform = r#""texCoord": 0, "extensions": { "KHR_texture_transform": { "texCoord": 1 } }"#;
    assert_eq!(uvs(&format!(r#""normalTexture": {{ "index": 0, {transform} }}"#)), second);
    let sheen = r#""KHR_materials_sheen": { "sheenColorTexture": { "index": 0, "texCoord": 1 } }"#;
    assert_eq!(uvs(&format!(r#""extensions": {{ {sheen} }}"#)), second);
    // Where they differ, the normal texture's, along which tangents run, whatever stands first in the file.
    let base = r#""pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } }"#;
    assert_eq!(uvs(&format!(r#"{base}, "normalTexture": {{ "index": 0, "texCoord": 1 }}"#)), second);
}

#[test]
fn colours_morphs_strips_and_flat_meshes() {
    let primitive = r#", "targets": [{ "POSITION": 4 }]"#;
    let json = document("", primitive, r#"[{ "mesh": 0, "weights": [0.5] }]"#)
        .replace(r#""NORMAL": 1, "TEXCOORD_0": 2"#, r#""COLOR_0": 3"#)
        .replace(r#""indices": 5"#, r#""mode": 5"#);
    let scene = load(&json).unwrap();
    let shape = &scene.shapes[0];
    let Geometry::Mesh(mesh) = &shape.geometry else { panic!("a mesh") };
    assert_eq!(mesh.positions[0], Vec3::new(0.0, 0.0, 1.0), "half of the target's 2");
    assert_eq!(mesh.triangles, [[0, 1, 2], [1, 3, 2]]);
    assert!(shape.face_normals && mesh.normals.is_empty());
    let (name, width, colours) = &mesh.attributes[0];
    assert_eq!((name.as_str(), *width, colours.len()), ("vertex_color", 3, 12));
    assert!((colours[0] - 0.6274).abs() < 1e-3, "red in the working space");
    assert!(matches!(param(&scene, shape.material, "base_color"), Value::Texture(_)));
    // Nothing to see by in the file: a camera, a sun and a sky.
    assert_eq!((scene.cameras.len(), scene.lights.len()), (1, 2));
}

#[test]
fn damaged_files_are_refused_in_words() {
    let good = document("", "", r#"[{ "mesh": 0 }]"#);
    assert!(load(&good).is_ok());
    for (from, to, words) in [
        (r#""indices": 5"#, r#""indices": 99"#, "there is no accessor 99; the file has 6"),
        (r#""indices": 5"#, r#""indices": 2"#, "expected 1 components"),
        (r#""indices": 5"#, "\"indices\": 5, \"material\": 3", "there is no material 3"),
        (r#""mesh": 0 }"#, r#""mesh": 0, "children": [0] }"#, "circle"),
        (r#""mesh": 0 }"#, r#""mesh": 0, "translation": [1e39, 0, 0] }"#, "not finite"),
        (r#""count": 6"#, r#""count": 600"#, "do not lie within buffer view 0"),
        (r#""count": 6"#, r#""count": 18446744073709551615"#, "do not lie within"),
        (r#""byteOffset": 224"#, r#""byteOffset": 56"#, "uses vertex"),
        (
            r#""bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3""#,
            r#""componentType": 5126, "count": 1099511627776, "type": "VEC3""#,
            "more than the limit",
        ),
        (r#""TEXCOORD_0": 2"#, r#""TEXCOORD_0": 3"#, "expected 2 components"),
        (
            r#""asset""#,
            r#""extensionsRequired": ["KHR_draco_mesh_compression"], "asset""#,
            "requires the extension KHR_draco_mesh_compression",
        ),
        ("base64,", "base64,*", "base64"),
        ("data:application/octet-stream;base64,", "../../etc/passwd?", "outside the folders"),
        (r#""nodes": ["#, r#""nodes": [,"#, "scene.gltf:2:"),
        (r#""buffer": 0, "byteLength""#, r#""buffer": 7, "byteLength""#, "there is no buffer 7"),
    ] {
        assert!(good.contains(from), "{from}");
        let error = load(&good.replacen(from, to, 1)).expect_err(to).to_string();
        assert!(error.starts_with("scene.gltf") && error.contains(words), "{to}: {error}");
    }
    let glb = |bytes: &[u8]| read(bytes, "a.glb".as_ref(), &Options::default()).unwrap_err().to_string();
    assert!(glb(b"glTF\x01\0\0\0").contains("version 2"));
    assert!(glb(b"glTF\x02\0\0\0\xff\0\0\0\xff\xff\0\0JSON{}").contains("ends within the file"));
}

#[test]
fn real_figures_stand_as_another_reader_sees_them() {
    let Some(folder) = std::env::var_os("YUGEN_DATA") else {
        assert!(std::env::var_os("CI").is_none(), "YUGEN_DATA must be set in CI");
        println!("skipped: YUGEN_DATA is not set");
        return;
    };
    // Skinning by numpy in double precision from the raw accessors: bounds, triangles, area.
    let cases = [
        (
            "Mage.glb",
            [-1.128499485406345, -2.6840226098032987e-05, -1.017150084337665],
            [1.2972166979101085, 2.7156481449907246, 1.2542531008882276],
            5683,
            24.61506996559696,
        ),
        (
            "gltf/Fox.glb",
            [-12.592718762206037, -0.12174418434116749, -88.09500578699789],
            [12.592717486586839, 78.90719764774782, 66.6248597776897],
            576,
            15070.773809610255,
        ),
    ];
    for (file, low, high, triangles, area) in cases {
        let path = Path::new(&folder).join("mesh").join(file);
        let scene = crate::formats::load_scene(&path, &Options::default()).unwrap();
        let [l, h] = scene.bounds().unwrap();
        let size = h - l;
        for i in 0..3 {
            assert!((f64::from(l[i]) - low[i]).abs() < 1e-5 * f64::from(size[i]), "{file} {l}");
            assert!((f64::from(h[i]) - high[i]).abs() < 1e-5 * f64::from(size[i]), "{file} {h}");
        }
        let (mut count, mut sum) = (0, 0.0);
        for shape in &scene.shapes {
            let Geometry::Mesh(mesh) = &shape.geometry else { panic!("{file}: each mesh stands once") };
            count += mesh.triangles.len();
            let world: Vec<Vec3> =
                mesh.positions.iter().map(|&p| shape.to_world.transform_point3(p)).collect();
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| world[i as usize]);
                sum += 0.5 * f64::from((b - a).cross(c - a).length());
            }
            assert!(matches!(param(&scene, shape.material, "base_color"), Value::Texture(_)), "{file}");
            assert_eq!(mesh.uvs.len(), mesh.positions.len());
        }
        assert_eq!(count, triangles, "{file}");
        assert!((sum / area - 1.0).abs() < 1e-5, "{file}: area {sum}");
        assert_eq!((scene.cameras.len(), scene.lights.len()), (1, 2));
    }
}

#[test]
fn a_figure_moves_as_another_reader_moves_it() {
    let Some(folder) = std::env::var_os("YUGEN_DATA") else {
        assert!(std::env::var_os("CI").is_none(), "YUGEN_DATA must be set in CI");
        println!("skipped: YUGEN_DATA is not set");
        return;
    };
    let path = Path::new(&folder).join("mesh/gltf/Fox.glb");
    let mut scene = crate::formats::load_scene(&path, &Options::default()).unwrap();
    let mut at = |animation: &str, seconds: f32| {
        scene.pose(Some(animation), seconds).map(|()| scene.clone()).map_err(|e| e.to_string())
    };
    let vertices = |scene: &Scene| {
        let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("a mesh") };
        [0, 500, 1200].map(|i| mesh.positions[i])
    };
    // Vertices 0, 500 and 1200 by numpy in double precision from the raw accessors.
    for (animation, seconds, expected) in [
        (
            "Walk",
            0.0,
            [[2.2913, 31.7829, -23.1143], [7.8063, 19.257, -37.554], [-11.3933, 47.4461, -22.8333]],
        ),
        (
            "Walk",
            0.3,
            [[1.9499, 33.1406, -21.8939], [7.7778, 24.4212, -37.9744], [-11.5858, 48.2881, -22.4967]],
        ),
        (
            "Run",
            0.55,
            [[2.9629, 31.0359, -29.8442], [9.5312, 33.0023, -48.9388], [-11.6086, 45.2629, -27.0698]],
        ),
    ] {
        let got = vertices(&at(animation, seconds).unwrap());
        for (got, want) in got.into_iter().zip(expected.map(Vec3::from)) {
            // Four digits in the table; the fox is 155 long.
            assert!(got.distance(want) < 3e-4, "{animation} {seconds}: {got} for {want}");
        }
    }
    // Before it begins and after it ends it stands still.
    assert_eq!(vertices(&at("Run", -1.0).unwrap()), vertices(&at("Run", 0.0).unwrap()));
    assert_eq!(vertices(&at("Run", 9.0).unwrap()), vertices(&at("Run", 99.0).unwrap()));
    assert!(at("Runn", 0.0).unwrap_err().contains("did you mean 'Run'?"));
}

#[test]
fn the_direction_of_a_brush_is_painted() {
    let anisotropy =
        r#"{ "anisotropyStrength": 0.5, "anisotropyRotation": 1.0, "anisotropyTexture": { "index": 0 } }"#;
    let extra =
        format!(r#""materials": [{{ "extensions": {{ "KHR_materials_anisotropy": {anisotropy} }} }}],"#);
    let scene = load(&document(&extra, r#", "material": 0"#, r#"[{ "mesh": 0 }]"#)).unwrap();
    let Value::Texture(id) = param(&scene, 0, "anisotropy_rotation") else { panic!("a texture") };
    let Texture::Image { image, filter, .. } = &scene.textures[id] else { panic!("a picture") };
    assert_eq!(*filter, yugen_scene::TextureFilter::Nearest);
    // The picture's raw values are the display values of (0.5, 0.25) and, without its alpha, (0.25, 0.1).
    for (angle, [r, g]) in image.data.iter().zip([[0.5f32, 0.25], [0.25, 0.1]]) {
        let [x, y] = [r, g].map(|v| 2.0 * yugen_optics::colour::linear_to_srgb(v) - 1.0);
        let off = (angle - 1.0 - y.atan2(x)).rem_euclid(std::f32::consts::TAU);
        // Eight bits of a short direction.
        assert!(off.min(std::f32::consts::TAU - off) < 0.03, "{angle} {x} {y}");
    }
}

#[test]
fn an_animation_that_makes_no_sense_is_refused() {
    let read_at = |animations: &str| {
        let json = document(animations, "", r#"[{ "mesh": 0 }]"#);
        match read(json.as_bytes(), "scene.gltf".as_ref(), &Options::default()) {
            Ok(mut scene) => scene.pose(None, 0.5).unwrap_err().to_string(),
            Err(e) => e.to_string(),
        }
    };
    let one = |node: usize, path: &str, input: usize, more: &str| {
        read_at(&format!(
            r#""animations": [{{ "channels": [{{ "sampler": 0, "target": {{ "node": {node}, "path": "{path}" }} }}],
            "samplers": [{{ "input": {input}, "output": 0 {more} }}] }}],"#
        ))
    };
    assert!(read_at("").contains("it has no animation"));
    assert!(one(7, "translation", 5, "").contains("there is no node 7"));
    assert!(one(0, "rotatoin", 5, "").contains("did you mean 'rotation'?"));
    assert!(one(0, "scale", 5, r#", "interpolation": "CUBIC""#).contains("interpolation 'CUBIC'"));
    assert!(one(0, "translation", 5, "").contains("6 times but 4 values"));
    assert!(one(0, "rotation", 5, "").contains("expected 4 components"));
    assert!(one(0, "translation", 99, "").contains("there is no accessor 99"));
}
