//! PLY, binary and little-endian: positions, and normals and (u, v) where there are any.

use yugen_scene::Mesh;

/// A mesh as the bytes of a file; its attributes and tangents are left out.
pub fn write_bytes(mesh: &Mesh) -> Vec<u8> {
    let (normals, uvs) = (!mesh.normals.is_empty(), !mesh.uvs.is_empty());
    let mut properties = vec!["x", "y", "z"];
    if normals {
        properties.extend(["nx", "ny", "nz"]);
    }
    if uvs {
        properties.extend(["u", "v"]);
    }
    let properties: String = properties.iter().map(|p| format!("property float {p}\n")).collect();
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{properties}element face {}\n\
         property list uchar uint vertex_indices\nend_header\n",
        mesh.positions.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    for (i, p) in mesh.positions.iter().enumerate() {
        let mut values = p.to_array().to_vec();
        if normals {
            values.extend(mesh.normals.get(i).copied().unwrap_or_default().to_array());
        }
        if uvs {
            values.extend(mesh.uvs.get(i).copied().unwrap_or_default().to_array());
        }
        out.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    }
    for t in &mesh.triangles {
        out.push(3);
        out.extend(t.iter().flat_map(|i| i.to_le_bytes()));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use yugen_scene::primitives::ball;

    #[test]
    fn what_is_written_is_read_back() {
        let mesh = ball(12);
        let back = super::super::read(&write_bytes(&mesh), Path::new("ball.ply")).unwrap();
        assert_eq!(back.positions, mesh.positions);
        // The reader makes them unit anew.
        assert!(back.normals.iter().zip(&mesh.normals).all(|(a, b)| a.distance(*b) < 1e-6));
        assert_eq!((&back.uvs, &back.triangles), (&mesh.uvs, &mesh.triangles));
    }
}
