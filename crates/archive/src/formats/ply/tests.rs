use super::*;

const HEADER: &str = "element vertex 4\nproperty float x\nproperty double y\nproperty float z\n\
    property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\n\
    property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n\
    property float heat_x\nproperty list uchar int extra\nelement nothing 1099511627776\n\
    element face 1\nproperty uchar flags\nproperty list uchar int vertex_indices\nend_header\n";

/// A square with everything, in each of the encodings.
pub(crate) fn square(encoding: &str) -> Vec<u8> {
    let mut out = format!("ply\nformat {encoding} 1.0\ncomment made by hand\n{HEADER}").into_bytes();
    let corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
    let big = encoding.contains("big");
    if encoding == "ascii" {
        for [x, y] in corners {
            out.extend(format!("{x} {y} 0 0 0 2 {x} {y} 255 0 188 255 0.5 2 7 8\n").bytes());
        }
        out.extend(b"9 4 0 1 2 3");
        return out;
    }
    let mut put = |mut bytes: Vec<u8>| {
        if big {
            bytes.reverse();
        }
        out.extend(bytes);
    };
    for [x, y] in corners.map(|c| c.map(|v| v as f32)) {
        put(x.to_le_bytes().into());
        put(f64::from(y).to_le_bytes().into());
        for v in [0.0, 0.0, 0.0, 2.0, x, y] {
            put(f32::to_le_bytes(v).into());
        }
        for b in [255u8, 0, 188, 255] {
            put(vec![b]);
        }
        put(0.5f32.to_le_bytes().into());
        put(vec![2]);
        put(7i32.to_le_bytes().into());
        put(8i32.to_le_bytes().into());
    }
    put(vec![9]);
    put(vec![4]);
    for i in 0..4i32 {
        put(i.to_le_bytes().into());
    }
    out
}

#[test]
fn the_three_encodings_hold_the_same_mesh() {
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let m = read(&square(encoding), Path::new("a.ply")).unwrap();
        assert_eq!(m.positions, [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y], "{encoding}");
        assert_eq!(m.normals, [Vec3::Z; 4]);
        assert_eq!(m.uvs, [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
        assert_eq!(m.triangles, [[0, 1, 2], [0, 2, 3]]);
        let (name, width, values) = &m.attributes[0];
        assert_eq!((name.as_str(), *width), ("vertex_color", 3));
        assert_eq!(values[..3], [1.0, 0.0, srgb_to_linear(188.0 / 255.0)]);
        assert_eq!(m.attributes[1], ("vertex_heat".into(), 1, vec![0.5; 4]));
    }
}

#[test]
fn strips_turn_every_second_triangle() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 1 2 3\n";
    let m = read(text.as_bytes(), Path::new("a.ply")).unwrap();
    assert_eq!(m.triangles, [[0, 1, 2], [2, 1, 3], [1, 2, 3]]);
}

/// A hollow corner, a face of two corners, a picture and a colour for each face.
#[test]
fn faces_have_texture_coordinates_and_colours_of_their_own() {
    let text = "ply\nformat ascii 1.0\nelement face 3\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
        property list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty float heat_x\n\
        element vertex 5\nproperty float x\nproperty float y\nproperty float z\nproperty float warmth_x\nend_header\n\
        255 0 0 4 0 1 2 3 8 0 0 .5 .5 1 0 .5 1 7\n1 2 3 2 0 1 0 5\n0 255 0 3 0 2 4 6 0 0 1 0 .25 .25 8\n\
        -1 -1 0 1\n0 0 0 2\n1 -1 0 3\n0 1 0 4\n0 -2 0 5\n";
    let m = read(text.as_bytes(), Path::new("a.ply")).unwrap();
    assert_eq!(m.triangles.len(), 3);
    let corner = |i: u32| (m.positions[i as usize], m.uvs[i as usize], m.attributes[0].2[i as usize]);
    // Vertices 0 and 2 are where they were in both faces; the hollow corner is in both triangles of the first.
    assert_eq!(m.positions.len(), 5);
    assert_eq!(m.attributes[0].0, "vertex_warmth");
    let hollow = (Vec3::ZERO, Vec2::new(0.5, 0.5), 2.0);
    assert!(m.triangles[..2].iter().all(|t| t.iter().any(|&i| corner(i) == hollow)));
    assert_eq!(corner(m.triangles[2][2]), (Vec3::new(0.0, -2.0, 0.0), Vec2::new(0.25, 0.75), 5.0));
    let [red, green] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    assert_eq!(m.attributes[1], ("face_color".into(), 3, [red, red, green].concat()));
    assert_eq!(m.attributes[2], ("face_heat".into(), 1, vec![7.0, 7.0, 8.0]));

    // A vertex that faces show differently is several.
    let text = text.replace("6 0 0 1 0 .25 .25 8", "6 0 0 1 1 .25 .25 8");
    let m = read(text.as_bytes(), Path::new("a.ply")).unwrap();
    assert_eq!((m.positions.len(), m.uvs.len(), m.attributes[0].2.len()), (6, 6, 6));
    // And with a list that is too short the face has none.
    let text = text.replace("8 0 0 .5 .5 1 0 .5 1 7", "2 0 .5 7");
    let m = read(text.as_bytes(), Path::new("a.ply")).unwrap();
    assert!(m.triangles[..2].iter().flatten().all(|&i| m.uvs[i as usize] == Vec2::ZERO));
}

#[test]
fn strips_beside_faces_with_texture_coordinates() {
    let vertex = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    let face = "element face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n\
        property float heat_x\n";
    let strip = "element tristrips 1\nproperty list int int vertex_indices\n";
    let values = ["0 0 0 1 0 0 0 1 0 1 1 0\n", "3 0 1 2 6 0 0 1 0 1 1 9\n", "3 1 3 2\n"];
    for (elements, order, mapped) in
        [([vertex, face, strip], [0, 1, 2], true), ([vertex, strip, face], [0, 2, 1], false)]
    {
        let body: String = order.iter().map(|&i| values[i]).collect();
        let text = format!("ply\nformat ascii 1.0\n{}end_header\n{body}", elements.concat());
        let m = read(text.as_bytes(), Path::new("a.ply")).unwrap();
        assert_eq!((m.triangles.len(), m.uvs.is_empty(), m.attributes.len()), (2, !mapped, 0));
        // A corner of no triangle is looked at, too, where it would be copied.
        let text = text.replace("3 1 3 2\n", "5 1 3 2 -1 9\n");
        assert_eq!(read(text.as_bytes(), Path::new("a.ply")).is_err(), mapped);
    }
}

#[test]
fn mistakes_are_named_with_their_place() {
    let vertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let text = |h: &str| {
        read(format!("ply\nformat ascii 1.0\n{h}").as_bytes(), Path::new("a.ply")).unwrap_err().to_string()
    };
    for (h, message) in [
        (
            format!("{vertex}{face}0 0 0 1 0 0 0 1 0 3 0 1 3"),
            "a.ply: triangle 0 has the corners [0, 1, 3], but there are 3 vertices",
        ),
        (format!("{vertex}{face}0 0 0 1 0 0 0 1 0 2 0 1"), "a.ply: the file has no faces"),
        (
            format!("{vertex}{face}0 0 0\n1 zero 0 0 1 0 3 0 1 2"),
            "a.ply:11:3: expected a finite number, found 'zero'",
        ),
        (
            format!("{vertex}{face}0 0 0 1 0 0 0 1 0 3 0 1"),
            "a.ply:10:24: expected a finite number, found the end of the file",
        ),
        (format!("{vertex}{face}0 0 0 1 0 0 0 1 0 3 0 1 -1"), "expected the index of a vertex, found -1"),
        (
            "element vertex 1099511627776\nproperty float x\nend_header\n0".into(),
            "claims 1099511627776 of 'vertex', but only 2 bytes are left",
        ),
        ("elemnt vertex 3\n".into(), "a.ply:3:1: unknown PLY keyword 'elemnt'; did you mean 'element'?"),
        (
            "element vertex 3\nproperty flaot x\n".into(),
            "a.ply:4:15: unknown PLY type 'flaot'; did you mean 'float'?",
        ),
        (
            "element vertex 0\nproperty float y\nend_header\n".into(),
            "a.ply:6:1: the vertices have no property 'x'",
        ),
        ("element".into(), "expected the number of elements"),
        (
            "element face 1\nelement face 2\n".into(),
            "a.ply:4:14: expected at most 256 names of this kind, each once",
        ),
        (
            format!("{vertex}property float x\n"),
            "a.ply:7:1: expected at most 256 names of this kind, each once",
        ),
    ] {
        let e = text(&h);
        assert!(e.contains(message), "{e}\n{message}");
    }
    let lie = format!(
        "ply\nformat binary_little_endian 1.0\n{}{face}",
        vertex.replace('3', "0").replace("face 1", "face 99")
    );
    let lie = lie.replace("element face 1", "element face 1099511627776").into_bytes();
    let e = read(&lie, Path::new("a.ply")).unwrap_err().to_string();
    assert!(e.contains("the header claims 1099511627776 of 'face', but only 0 bytes are left"), "{e}");
    let whole = square("binary_big_endian");
    for cut in [10, 100, 400, whole.len() - 30, whole.len() - 1] {
        assert!(read(&whole[..cut], Path::new("a.ply")).is_err(), "cut at {cut}");
    }
}
