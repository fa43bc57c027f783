//! Meshes.

use crate::{FILE, assault, peak};
use std::path::Path;
use yugen_archive::formats::{mtl, obj, ply, serialized};

#[test]
fn obj() {
    let seed = b"# seed\nmtllib a.mtl\no thing\nv 0 0 0\nv 1.5 0 0 1 0 0\nv 1 1e-1 0\nv 0 1 -.5\nvt 0 0\nvt 1 0.5\n\
        vn 0 0 1\nusemtl a\ns off\nf 1/1/1 2/2/1 3/1/1 4/2/1\nusemtl b\nf -4//-1 -3//1 \\\n -2//1 # c\nf 1/1/ 2// 3/0/0\n\
        v .5 .5 0\nf 1 5 2 3 4\nvt nan -1.#IND 0\nwobble 1\nf 1 2\n";
    assault("obj", &[seed.to_vec()], |b| match obj::read(b, Path::new(FILE)) {
        Ok(o) => {
            let parts = o.split();
            let corners = |(_, m): &(Option<String>, yugen_scene::Mesh)| {
                m.triangles.iter().flatten().map(|&i| m.positions[i as usize].x).sum::<f32>()
            };
            parts.iter().map(corners).sum::<f32>().is_finite() || !parts.is_empty()
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}

#[test]
fn mtl() {
    let seed =
        b"newmtl a\nKd 1 0 0.5\nNs 20\nmap_Kd -s 2 1 -o 0 .5 -mm 0 1 -imfchan r my wood.png -clamp on\n# x\n\
        newmtl b\nKd xyz 1 1 1 # c\nd -halo 0.5\n"
            .to_vec();
    assault("mtl", &[seed], |b| {
        let materials = mtl::read(b, Path::new(FILE));
        materials.iter().any(|m| m.colour("Kd").is_some() && m.map("map_Kd").is_some())
    });
}

fn ply_seed(encoding: &str) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat {encoding} 1.0\ncomment seed\nelement vertex 3\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float nx\n\
         property float ny\nproperty float nz\nproperty float u\nproperty float v\nproperty double heat_x\n\
         property list uchar short odd\nelement face 1\nproperty list uchar int vertex_indices\nelement other 1\n\
         property list int float y\nend_header\n"
    )
    .into_bytes();
    if encoding == "ascii" {
        out.extend(b"0 0 0 255 0 0 0 0 1 0 0 1.5 1 7\n1 0 0 255 0 0 0 0 1 0 0 1.5 0\n");
        out.extend(b"0 1 0 9 9 9 0 0 1 1 1 2 0\n3 0 1 2\n1 5\n");
        return out;
    }
    let mut put = |mut b: Vec<u8>| {
        if encoding.contains("big") {
            b.reverse();
        }
        out.extend(b);
    };
    for [x, y] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0f32]] {
        [x, y, 0.0].iter().for_each(|v| put(v.to_le_bytes().into()));
        [1, 2, 3u8].iter().for_each(|&v| put(vec![v]));
        [0.0, 0.0, 1.0, x, y].iter().for_each(|v| put(v.to_le_bytes().into()));
        put(1.5f64.to_le_bytes().into());
        put(vec![1]);
        put(7i16.to_le_bytes().into());
    }
    put(vec![3]);
    [0, 1, 2i32].iter().for_each(|v| put(v.to_le_bytes().into()));
    put(1i32.to_le_bytes().into());
    put(5f32.to_le_bytes().into());
    out
}

#[test]
fn ply() {
    let mut seeds = ["ascii", "binary_little_endian", "binary_big_endian"].map(ply_seed).to_vec();
    // Corners with texture coordinates, faces with colours, a hollow corner and a strip.
    seeds.push(
        b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nproperty list uchar int vertex_indices\n\
        property list uchar float texcoord\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n\
        -1 -1 0\n0 0 0\n1 -1 0\n0 1 0\n255 0 0 4 0 1 2 3 8 0 0 .5 .5 1 0 .5 1\n0 9 0 3 0 2 3 0\n4 0 1 -1 2\n"
            .to_vec(),
    );
    assault("ply", &seeds, |b| match ply::read(b, Path::new(FILE)) {
        Ok(m) => {
            let n = m.positions.len();
            assert!(m.triangles.iter().flatten().all(|&i| (i as usize) < n));
            let count = |name: &str| if name.starts_with("face_") { m.triangles.len() } else { n };
            assert!(m.attributes.iter().all(|(name, w, v)| v.len() == w * count(name)));
            assert!(m.uvs.len() == n || m.uvs.is_empty());
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}

/// One triangle. At level 0 the stream is stored as it is, so that mutations reach what it says.
fn serialized_seed(version: u16, level: u32) -> Vec<u8> {
    let mut body = 0x1003u32.to_le_bytes().to_vec();
    if version == 4 {
        body.extend(b"tri\0");
    }
    body.extend(3u64.to_le_bytes());
    body.extend(1u64.to_le_bytes());
    let positions = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0f32];
    let normals = [0.0, 0.0, 1.0].repeat(3);
    let uvs = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
    for v in positions.iter().chain(&normals).chain(&uvs) {
        body.extend(v.to_le_bytes());
    }
    for i in [0, 1, 2u32] {
        body.extend(i.to_le_bytes());
    }
    let mut out = 0x041cu16.to_le_bytes().to_vec();
    out.extend(version.to_le_bytes());
    let mut zip = flate2::write::ZlibEncoder::new(out, flate2::Compression::new(level));
    std::io::Write::write_all(&mut zip, &body).unwrap();
    let mut out = zip.finish().unwrap();
    if version == 4 {
        out.extend(0u64.to_le_bytes())
    } else {
        out.extend(0u32.to_le_bytes())
    }
    out.extend(1u32.to_le_bytes());
    out
}

#[test]
fn serialized_meshes() {
    let seeds = [(3, 0), (4, 0), (4, 9)].map(|(version, level)| serialized_seed(version, level));
    assault("serialized", &seeds, |b| match serialized::read(b, 0, Path::new(FILE)) {
        Ok(s) => {
            assert!(s.mesh.triangles.iter().flatten().all(|&i| (i as usize) < s.mesh.positions.len()));
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            // The table of offsets is another way in.
            let _ = serialized::read(b, 1, Path::new(FILE));
            false
        }
    });
}

#[test]
fn claims_of_a_trillion_elements_cost_nothing() {
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let text = format!(
            "ply\nformat {encoding} 1.0\nelement vertex 1099511627776\nproperty float x\nproperty float y\n\
             property float z\nelement face 1099511627776\nproperty list uchar int vertex_indices\nend_header\n0 0 0"
        );
        let bytes = peak(|| assert!(ply::read(text.as_bytes(), Path::new(FILE)).is_err()));
        assert!(bytes < 1 << 16, "{bytes} bytes for {encoding}");
    }
    let mut lie = serialized_seed(4, 0);
    let at = lie.windows(8).position(|w| w == 3u64.to_le_bytes()).unwrap();
    lie[at..at + 8].copy_from_slice(&(1u64 << 40).to_le_bytes());
    let bytes = peak(|| assert!(serialized::read(&lie, 0, Path::new(FILE)).is_err()));
    assert!(bytes < 1 << 18, "{bytes} bytes for a serialized mesh");
}
