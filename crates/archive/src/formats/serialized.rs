//! Mitsuba's `.serialized` meshes, versions 3 and 4: zlib streams one behind the other and a table of
//! their offsets at the end of the file.

use crate::{Error, Place};
use flate2::read::ZlibDecoder;
use glam::{Vec2, Vec3};
use std::io::Read;
use std::path::Path;
use yugen_scene::Mesh;

/// Layout after mitsuba3 v3.9.1, src/shapes/serialized.cpp: the first bytes and the flags of a mesh.
const MAGIC: u16 = 0x041c;
// Other bits, which exporters set, say nothing about the layout, as in the program.
const NORMALS: u32 = 0x0001;
const UVS: u32 = 0x0002;
const COLOURS: u32 = 0x0008;
const FACE_NORMALS: u32 = 0x0010;
const DOUBLE: u32 = 0x2000;

/// DEFLATE cannot squeeze better than this (RFC 1951: 258 bytes from 2 bits).
const MAX_RATIO: u64 = 1032;

/// A mesh of a `.serialized` file.
#[derive(Clone, Debug)]
pub struct Serialized {
    /// Colours are an attribute `vertex_color`.
    pub mesh: Mesh,
    /// The file wants flat triangles.
    pub face_normals: bool,
}

/// Reads mesh number `shape_index`, counted from zero; `path` names the file in messages.
pub fn read(bytes: &[u8], shape_index: usize, path: &Path) -> Result<Serialized, Error> {
    let version = header(bytes, 0, path)?;
    let start = if shape_index == 0 { 0 } else { offset(bytes, version, shape_index, path)? };
    if start != 0 {
        header(bytes, start, path)?;
    }
    let mut s = Stream { zip: ZlibDecoder::new(&bytes[start + 4..]), path, start: start as u64 + 4 };
    s.mesh(version, (bytes.len() - start) as u64)
}

/// How many meshes a file says it holds; one where its table cannot be.
pub fn count(bytes: &[u8]) -> usize {
    let Ok(version) = header(bytes, 0, Path::new("")) else { return 1 };
    let width = if version == 4 { 8 } else { 4 };
    let count = bytes.last_chunk::<4>().map_or(1, |c| u32::from_le_bytes(*c) as usize);
    let fits =
        count.checked_mul(width).and_then(|t| t.checked_add(8)).is_some_and(|least| least <= bytes.len());
    if fits { count } else { 1 }
}

/// Checks the four bytes before a stream and returns the version.
fn header(bytes: &[u8], at: usize, path: &Path) -> Result<u16, Error> {
    let place = || Place::byte(path, at as u64);
    let Some(&[a, b, c, d]) = bytes.get(at..).and_then(|b| b.first_chunk::<4>()) else {
        return Err(Error::invalid(place(), "the file ends before a mesh begins"));
    };
    let (magic, version) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
    if magic != MAGIC {
        return Err(Error::invalid(
            place(),
            format!("expected the two bytes 1c 04 of a serialized mesh, found {a:02x} {b:02x}"),
        ));
    }
    if version != 3 && version != 4 {
        return Err(Error::invalid(
            place(),
            format!("this is version {version} of the format; expected 3 or 4"),
        ));
    }
    Ok(version)
}

/// Where mesh `index` starts, from the table at the end.
fn offset(bytes: &[u8], version: u16, index: usize, path: &Path) -> Result<usize, Error> {
    let place = |at: usize| Place::byte(path, at as u64);
    let width = if version == 4 { 8 } else { 4 };
    // The header is there, so the file has at least four bytes.
    let end = bytes.len() - 4;
    let count = u32::from_le_bytes([bytes[end], bytes[end + 1], bytes[end + 2], bytes[end + 3]]) as usize;
    if count.checked_mul(width).is_none_or(|table| table > end) {
        return Err(Error::invalid(
            place(end),
            format!("the file claims {count} meshes, more than its size allows; it may be cut off"),
        ));
    }
    if index >= count {
        return Err(Error::invalid(
            place(end),
            format!("mesh {index} was asked for, but the file has {count}, counted from 0"),
        ));
    }
    let entry = end - (count - index) * width;
    let mut word = [0; 8];
    word[..width].copy_from_slice(&bytes[entry..entry + width]);
    let offset = u64::from_le_bytes(word);
    usize::try_from(offset).ok().filter(|&o| o < entry).ok_or_else(|| {
        Error::invalid(
            place(entry),
            format!("mesh {index} claims to start at byte {offset}, outside the file"),
        )
    })
}

struct Stream<'a> {
    zip: ZlibDecoder<&'a [u8]>,
    path: &'a Path,
    start: u64,
}

impl Stream<'_> {
    /// Where it stands in the file.
    fn place(&self) -> Place {
        Place::byte(self.path, self.start + self.zip.total_in())
    }

    fn bytes(&mut self, n: u64, what: &str) -> Result<Vec<u8>, Error> {
        let mut out = Vec::new();
        let read = (&mut self.zip).take(n).read_to_end(&mut out);
        match read {
            Err(e) => Err(Error::invalid(
                self.place(),
                format!("the compressed data is damaged at the {what}: {e}"),
            )),
            Ok(got) if (got as u64) < n => Err(Error::invalid(
                self.place(),
                format!("the data ends after {got} of {n} bytes of the {what}; the file may be cut off"),
            )),
            Ok(_) => Ok(out),
        }
    }

    fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N], Error> {
        let v = self.bytes(N as u64, what)?;
        Ok(std::array::from_fn(|i| v[i]))
    }

    /// `n` numbers, single precision inside.
    fn numbers(&mut self, n: u64, double: bool, what: &str) -> Result<Vec<f32>, Error> {
        let bytes = self.bytes(n * if double { 8 } else { 4 }, what)?;
        let v: Vec<f32> = if double {
            bytes.as_chunks().0.iter().map(|&b| f64::from_le_bytes(b) as f32).collect()
        } else {
            bytes.as_chunks().0.iter().map(|&b| f32::from_le_bytes(b)).collect()
        };
        match v.iter().position(|x| !x.is_finite()) {
            Some(i) => Err(Error::invalid(
                self.place(),
                format!("number {i} of the {what} is {}; expected finite numbers", v[i]),
            )),
            None => Ok(v),
        }
    }

    fn mesh(&mut self, version: u16, compressed: u64) -> Result<Serialized, Error> {
        let flags = u32::from_le_bytes(self.array("flags")?);
        let mut name = Vec::new();
        if version == 4 {
            loop {
                let [b] = self.array("name")?;
                if b == 0 {
                    break;
                }
                if name.len() == 4096 {
                    return Err(Error::invalid(
                        self.place(),
                        "expected a name of at most 4096 bytes that ends in a zero",
                    ));
                }
                name.push(b);
            }
        }
        let vertices = u64::from_le_bytes(self.array("number of vertices")?);
        let triangles = u64::from_le_bytes(self.array("number of triangles")?);
        let double = flags & DOUBLE != 0;
        let per_vertex =
            [(3, true), (3, flags & NORMALS != 0), (2, flags & UVS != 0), (3, flags & COLOURS != 0)];
        let floats: u64 = per_vertex.iter().filter(|p| p.1).map(|p| p.0).sum();
        let size = u128::from(vertices) * u128::from(floats * if double { 8 } else { 4 })
            + u128::from(triangles) * 12;
        if vertices > u64::from(u32::MAX) || size > u128::from(compressed) * u128::from(MAX_RATIO) {
            return Err(Error::invalid(
                self.place(),
                format!(
                    "the mesh claims {vertices} vertices and {triangles} triangles, more than {compressed} compressed bytes can hold"
                ),
            ));
        }
        if vertices == 0 || triangles == 0 {
            return Err(Error::invalid(
                self.place(),
                format!("the mesh has {vertices} vertices and {triangles} triangles; expected some"),
            ));
        }
        let vec3 = |v: Vec<f32>| -> Vec<Vec3> { v.as_chunks().0.iter().map(|&c| Vec3::from(c)).collect() };
        let mut mesh = Mesh { name: String::from_utf8_lossy(&name).into_owned(), ..Mesh::default() };
        mesh.positions = vec3(self.numbers(3 * vertices, double, "positions")?);
        if flags & NORMALS != 0 {
            mesh.normals = vec3(self.numbers(3 * vertices, double, "normals")?);
            mesh.normals.iter_mut().for_each(|n| *n = n.normalize_or_zero());
        }
        if flags & UVS != 0 {
            mesh.uvs = self
                .numbers(2 * vertices, double, "texture coordinates")?
                .as_chunks()
                .0
                .iter()
                .map(|&c| Vec2::from(c))
                .collect();
        }
        if flags & COLOURS != 0 {
            mesh.attributes.push(("vertex_color".into(), 3, self.numbers(3 * vertices, double, "colours")?));
        }
        let corners = self.bytes(12 * triangles, "triangles")?;
        let index = |c: &[u8; 4]| u32::from_le_bytes(*c);
        mesh.triangles =
            corners.as_chunks::<4>().0.as_chunks::<3>().0.iter().map(|t| t.each_ref().map(index)).collect();
        if let Some((i, t)) =
            mesh.triangles.iter().enumerate().find(|(_, t)| t.iter().any(|&v| u64::from(v) >= vertices))
        {
            return Err(Error::invalid(
                self.place(),
                format!(
                    "triangle {i} has the corners {t:?}, but there are {vertices} vertices, counted from 0"
                ),
            ));
        }
        if mesh.normals.contains(&Vec3::ZERO) {
            mesh.complete_normals(glam::Mat3::IDENTITY);
        }
        Ok(Serialized { mesh, face_normals: flags & FACE_NORMALS != 0 })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::io::Write;

    /// One triangle, with everything the format can hold, as version 3 or 4.
    pub(crate) fn one(version: u16, flags: u32, vertices: u64, triangles: u64, corner: u32) -> Vec<u8> {
        let mut out = Vec::new();
        out.extend(MAGIC.to_le_bytes());
        out.extend(version.to_le_bytes());
        let mut zip = flate2::write::ZlibEncoder::new(&mut out, flate2::Compression::fast());
        let mut put = |b: &[u8]| zip.write_all(b).unwrap();
        put(&flags.to_le_bytes());
        if version == 4 {
            put(b"tri\0");
        }
        put(&vertices.to_le_bytes());
        put(&triangles.to_le_bytes());
        let mut numbers = vec![0.0f64, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        if flags & NORMALS != 0 {
            numbers.extend([0.0, 0.0, 2.0].repeat(3));
        }
        if flags & UVS != 0 {
            numbers.extend([0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        }
        if flags & COLOURS != 0 {
            numbers.extend([0.25; 9]);
        }
        for n in numbers {
            if flags & DOUBLE != 0 { put(&n.to_le_bytes()) } else { put(&(n as f32).to_le_bytes()) }
        }
        for c in [0, 1, corner] {
            put(&c.to_le_bytes());
        }
        zip.finish().unwrap();
        out
    }

    /// Two copies behind each other with the table at the end.
    fn two(version: u16) -> Vec<u8> {
        let mut out = one(version, 0x1000, 3, 1, 2);
        let second = out.len() as u64;
        out.extend(one(version, NORMALS | UVS | COLOURS | FACE_NORMALS | DOUBLE, 3, 1, 2));
        for o in [0, second] {
            if version == 4 { out.extend(o.to_le_bytes()) } else { out.extend((o as u32).to_le_bytes()) }
        }
        out.extend(2u32.to_le_bytes());
        out
    }

    #[test]
    fn both_versions_and_both_precisions() {
        for version in [3, 4] {
            let bytes = two(version);
            let first = read(&bytes, 0, Path::new("a")).unwrap();
            assert_eq!(first.mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
            assert!(first.mesh.normals.is_empty() && !first.face_normals);
            let second = read(&bytes, 1, Path::new("a")).unwrap();
            assert_eq!(second.mesh.positions, first.mesh.positions);
            assert_eq!(second.mesh.normals, [Vec3::Z; 3]);
            assert_eq!(second.mesh.uvs, [Vec2::ZERO, Vec2::X, Vec2::Y]);
            assert_eq!(second.mesh.attributes, [("vertex_color".to_string(), 3, vec![0.25; 9])]);
            assert_eq!(second.mesh.triangles, [[0, 1, 2]]);
            assert!(second.face_normals);
            assert_eq!(second.mesh.name, if version == 4 { "tri" } else { "" });
            let e = read(&bytes, 2, Path::new("a")).unwrap_err().to_string();
            assert!(e.ends_with("mesh 2 was asked for, but the file has 2, counted from 0"), "{e}");
        }
    }

    #[test]
    fn flags_that_say_nothing_about_the_layout_are_let_through() {
        // Exporters of 0.6 set 0x4000 and others.
        let plain = read(&one(4, 0, 3, 1, 2), 0, Path::new("a")).unwrap();
        let flagged = read(&one(4, 0x4000, 3, 1, 2), 0, Path::new("a")).unwrap();
        assert_eq!(
            (flagged.mesh.positions, flagged.mesh.triangles),
            (plain.mesh.positions, plain.mesh.triangles)
        );
    }

    #[test]
    fn lying_and_damaged_files_are_refused_before_memory_is_asked_for() {
        let error = |bytes: &[u8]| read(bytes, 0, Path::new("a")).unwrap_err().to_string();
        let big = error(&one(4, 0, 1 << 40, 1 << 40, 2));
        assert!(
            big.contains("claims 1099511627776 vertices and 1099511627776 triangles, more than"),
            "{big}"
        );
        let big = error(&one(4, 0, 3, u64::MAX, 2));
        assert!(big.contains("more than"), "{big}");
        assert!(
            error(&one(4, 0, 3, 1, 3))
                .contains("triangle 0 has the corners [0, 1, 3], but there are 3 vertices")
        );
        assert!(error(&one(4, 0, 3, 9, 2)).contains("the data ends after 12 of 108 bytes of the triangles"));
        assert_eq!(
            error(b"PK\x03\x04"),
            "a, byte 0: expected the two bytes 1c 04 of a serialized mesh, found 50 4b"
        );
        assert_eq!(error(b"\x1c\x04\x05\x00"), "a, byte 0: this is version 5 of the format; expected 3 or 4");
        assert_eq!(error(b"\x1c"), "a, byte 0: the file ends before a mesh begins");
        let whole = one(4, 0, 3, 1, 2);
        assert!(error(&whole[..whole.len() / 2]).contains("byte"));
    }
}
