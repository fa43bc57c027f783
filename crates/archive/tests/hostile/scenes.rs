//! Scenes.

use crate::{FILE, assault, assault_with, rewrite};
use std::path::Path;
use yugen_archive::formats::{Options, gltf, mitsuba, toml};

#[test]
fn mitsuba_scenes() {
    let seed = br#"<?xml version="1.0"?><!-- seed -->
<scene version="3.0.0"><default name="n" value="4"/><default name="kind" value="path"/>
<integrator type="moment"><integrator type="$kind"><integer name="max_depth" value="$n"/></integrator></integrator>
<sensor type="thinlens"><float name="aperture_radius" value="0.1"/><string name="fov_axis" value="smaller"/>
<float name="fov" value="40"/><transform name="to_world"><rotate y="1" angle="20"/>
<lookat origin="1,2,3" target="0 0 0" up="0,1,0"/><matrix value="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"/></transform>
<film type="hdrfilm"><integer name="width" value="64"/><rfilter type="mitchell"><float name="B" value="0.2"/></rfilter>
</film></sensor>
<texture type="checkerboard" id="t"><rgb name="color0" value="0.1 0.2 0.3"/>
<transform name="to_uv"><scale value="3"/></transform></texture>
<bsdf type="twosided" id="m"><bsdf type="diffuse"><ref name="reflectance" id="t"/></bsdf></bsdf><alias id="m" as="m2"/>
<bsdf type="roughconductor"><string name="material" value="Au"/><ref name="alpha" id="t"/></bsdf>
<bsdf type="mask" id="k"><float name="opacity" value="0.5"/>
<bsdf type="dielectric"><string name="int_ior" value="water"/></bsdf></bsdf>
<shape type="sphere"><point name="center" x="1" y="2" z="3"/><ref id="m2"/>
<emitter type="area"><spectrum name="radiance" value="400:1, 700:2"/></emitter></shape>
<shape type="shapegroup" id="g"><shape type="cube"><ref id="k"/></shape>
<shape type="cylinder"><float name="radius" value="2"/></shape></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><translate x="3"/></transform></shape>
<emitter type="spot"><rgb name="intensity" value="3"/></emitter><emitter type="constant"/></scene>"#;
    let options = Options { defines: vec![("n".into(), "7".into())], ..Options::default() };
    let read = |b: &[u8]| match mitsuba::read(b, Path::new(FILE), &options) {
        Ok(scene) => scene.cameras.len() == 1,
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    };
    assault("mitsuba bytes", &[seed.to_vec()], read);
    assault_with("mitsuba words", &[seed.to_vec()], 20_000, |seed, _, rng| rewrite(seed, rng), read);
}

#[test]
fn toml_scenes() {
    let seed = br##"[scene]
working_space = "srgb"
[camera]
from = [0, 1, 3]
to = [0, 0.5, 0]
fov = 35
[film]
size = [64, 48]
filter = "tent"
[render]
samples = 16
aovs = ["albedo"]
[texture.t]
checker = [0, "#ff8000"]
scale = [2, 3]
[material.a]
model = "ward"
alpha = 0.2
diffuse = "t"
[material.b]
blend = ["a", "a"]
weight = 0.5
opacity = 0.5
[[shape]]
type = "ball"
segments = 6
material = "b"
rotate = [1, 2, 3]
[[shape]]
type = "sphere"
emission = { blackbody = 1900, scale = 2 }
[[light]]
type = "spot"
at = [0, 2, 0]
towards = [0, 0, 1]
"##;
    // A mesh made here may have four million triangles, which is the scene's wish and not its size: the limit
    // is that of the reader without it.
    assault("toml", &[seed.to_vec()], |b| {
        if std::str::from_utf8(b)
            .is_ok_and(|t| t.lines().any(|l| l.contains("segments") && l.trim() != "segments = 6"))
        {
            return false;
        }
        match toml::read(b, Path::new(FILE), &Options::default()) {
            Ok(scene) => scene.cameras.len() == 1,
            Err(e) => {
                assert!(e.to_string().contains(FILE), "{e}");
                false
            }
        }
    });
}

fn gltf_seed() -> (Vec<u8>, Vec<u8>) {
    let json = r#"{"asset":{"version":"2.0"},"extensionsUsed":["KHR_lights_punctual","EXT_mesh_gpu_instancing"],
"extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","spot":{"outerConeAngle":0.5}}]}},
"cameras":[{"type":"perspective","perspective":{"yfov":0.7,"znear":0.1}}],
"scenes":[{"nodes":[0,2,3,4]}],
"nodes":[{"mesh":0,"children":[1],"scale":[1,2,3]},{"mesh":0,"rotation":[0,0,0,1]},{"camera":0},
{"mesh":1,"skin":0,"weights":[0.5],"extensions":{"KHR_lights_punctual":{"light":0}}},
{"mesh":2,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0}}}}],
"skins":[{"joints":[0,1]}],
"animations":[{"channels":[{"sampler":0,"target":{"node":1,"path":"translation"}},
{"sampler":1,"target":{"node":0,"path":"rotation"}}],"samplers":[{"input":1,"output":0},
{"input":1,"output":3,"interpolation":"STEP"}]}],
"materials":[{"pbrMetallicRoughness":{"roughnessFactor":0.3},"doubleSided":true,"alphaMode":"BLEND",
"extensions":{"KHR_materials_sheen":{"sheenRoughnessFactor":0.4}}},
{"emissiveFactor":[1,0,0],"alphaMode":"MASK","extensions":{"KHR_materials_transmission":{"transmissionFactor":0.5},
"KHR_materials_diffuse_transmission":{"diffuseTransmissionFactor":0.5},
"KHR_materials_volume":{"thicknessFactor":1,"attenuationDistance":2}}}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]},
{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":2,"WEIGHTS_0":3},"mode":5,"targets":[{"POSITION":0}]}]},
{"primitives":[{"attributes":{"POSITION":4,"COLOR_0":3},"material":1}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
{"bufferView":1,"componentType":5121,"count":3,"type":"SCALAR"},
{"bufferView":2,"componentType":5121,"count":3,"type":"VEC4"},
{"bufferView":2,"byteOffset":12,"componentType":5121,"normalized":true,"count":3,"type":"VEC4",
"sparse":{"count":1,"indices":{"bufferView":1,"componentType":5121},"values":{"bufferView":2}}},
{"bufferView":3,"componentType":5126,"count":3,"type":"VEC3"}],
"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":3},
{"buffer":0,"byteOffset":40,"byteLength":24},{"buffer":1,"byteLength":36,"extensions":{"EXT_meshopt_compression":
{"buffer":0,"byteOffset":64,"byteLength":45,"byteStride":12,"count":3,"mode":"ATTRIBUTES"}}}],
"buffers":[{"byteLength":109URI},{"byteLength":36,"extensions":{"EXT_meshopt_compression":{"fallback":true}}}]}"#;
    let mut data: Vec<u8> =
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0f32].iter().flat_map(|v| v.to_le_bytes()).collect();
    data.extend([0, 1, 2, 0]);
    data.extend([0, 1, 0, 0].repeat(3));
    data.extend([255, 0, 0, 0].repeat(3));
    // All of its bytes as in the last element, which is zero.
    data.push(0xa0);
    data.extend([0; 44]);
    let text = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAECAAABAAAAAQAAAAEAAP8AAAD/AAAA/wAAAKAAAA\
        AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA==";
    let uri = format!(r#","uri":"data:application/octet-stream;base64,{text}""#);
    let apart = json.replace("URI", &uri).into_bytes();
    let mut json = json.replace("URI", "").into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((28 + json.len() as u32 + data.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &data)] {
        glb.extend((chunk.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(chunk);
    }
    (apart, glb)
}

#[test]
fn gltf_scenes() {
    let (apart, glb) = gltf_seed();
    // An accessor without data may ask for 2^24 zeros, and a mesh of them has positions, normals and indices.
    let read = |b: &[u8]| gltf::read(b, Path::new(FILE), &Options::default());
    assault("gltf", &[apart, glb], |b| match read(b) {
        Ok(mut scene) => {
            assert!(scene.clips().iter().all(|(_, [first, last])| first <= last));
            // A pose is one or is refused.
            let _ = scene.pose(None, 0.5);
            for shape in scene.shapes.iter().chain(scene.groups.iter().flatten()) {
                if let yugen_scene::Geometry::Mesh(m) = &shape.geometry {
                    assert!(m.triangles.iter().flatten().all(|&i| (i as usize) < m.positions.len()));
                    assert!(m.positions.iter().all(|p| p.is_finite()));
                }
            }
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}
