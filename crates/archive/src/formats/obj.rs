//! Wavefront OBJ meshes and the MTL materials beside them.
//!
//! Polygons become fans of triangles; corners that share position, (u, v) and normal become one vertex.
//! Curves and free-form surfaces are skipped, as they are no part of a mesh.

use super::numbers::Scanner;
use crate::scene::Mesh;
use crate::{Error, Place};
use glam::{Vec2, Vec3};
use std::ops::Range;
use std::path::Path;

/// A mesh and which part of it is of what.
#[derive(Clone, Debug, Default)]
pub struct Obj {
    /// All triangles of the file, in its order. In the file v runs up; here it runs down, as in [`Mesh`].
    pub mesh: Mesh,
    /// Runs of triangles with one material, in order, covering all of them.
    pub parts: Vec<Part>,
    /// Files named by `mtllib`.
    pub libraries: Vec<String>,
}

/// A run of triangles with one material.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The word after `usemtl`.
    pub material: Option<String>,
    /// Which triangles.
    pub triangles: Range<usize>,
}

impl Obj {
    /// One mesh per material, in order of first use, with only the vertices it needs.
    pub fn split(&self) -> Vec<(Option<String>, Mesh)> {
        let mut names: Vec<&Option<String>> = Vec::new();
        for p in &self.parts {
            if !names.contains(&&p.material) {
                names.push(&p.material);
            }
        }
        if names.len() == 1 {
            return vec![(names[0].clone(), self.mesh.clone())];
        }
        let mut new_index = vec![u32::MAX; self.mesh.positions.len()];
        names
            .into_iter()
            .map(|name| {
                let mut order = Vec::new();
                let runs = self.parts.iter().filter(|p| p.material == *name);
                let triangles = runs
                    .flat_map(|p| &self.mesh.triangles[p.triangles.clone()])
                    .map(|t| {
                        t.map(|i| {
                            let new = &mut new_index[i as usize];
                            if *new == u32::MAX {
                                *new = order.len() as u32;
                                order.push(i as usize);
                            }
                            *new
                        })
                    })
                    .collect();
                order.iter().for_each(|&i| new_index[i] = u32::MAX);
                let m = &self.mesh;
                let pick = |v: &[Vec3]| {
                    if v.is_empty() { Vec::new() } else { order.iter().map(|&i| v[i]).collect() }
                };
                let mesh = Mesh {
                    name: m.name.clone(),
                    positions: pick(&m.positions),
                    normals: pick(&m.normals),
                    uvs: if m.uvs.is_empty() {
                        Vec::new()
                    } else {
                        order.iter().map(|&i| m.uvs[i]).collect()
                    },
                    attributes: m
                        .attributes
                        .iter()
                        .map(|(n, w, v)| {
                            (n.clone(), *w, order.iter().flat_map(|&i| &v[i * w..][..*w]).copied().collect())
                        })
                        .collect(),
                    triangles,
                    ..Mesh::default()
                };
                (name.clone(), mesh)
            })
            .collect()
    }
}

/// Statements of the format that say nothing about triangles.
const SKIPPED: &[&str] = &[
    "o",
    "g",
    "s",
    "l",
    "p",
    "vp",
    "mg",
    "cstype",
    "deg",
    "bmat",
    "step",
    "curv",
    "curv2",
    "surf",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "maplib",
    "usemap",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
    "csh",
    "call",
];
const READ: &[&str] = &["v", "vn", "vt", "f", "usemtl", "mtllib"];

/// No index: the corner has no (u, v) or no normal.
const NONE: u32 = u32::MAX;

/// Reads an OBJ file; `path` names it in messages.
pub fn read(bytes: &[u8], path: &Path) -> Result<Obj, Error> {
    let mut s = Scanner::new(bytes, path);
    let (mut points, mut colours, mut uvs, mut normals) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut corners = Corners::default();
    let mut polygon: Vec<u32> = Vec::new();
    let mut obj = Obj::default();
    obj.mesh.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut material: Option<String> = None;
    let mut run = 0;
    loop {
        s.space();
        if s.at_end() {
            break;
        }
        let at = s.mark();
        match s.word() {
            b"v" => {
                points.push(vec3(&mut s, "x, y and z")?);
                if !s.at_line_end() {
                    // Either a weight, or a colour as many scanners write it.
                    let first = number(&mut s, "a number")?;
                    if !s.at_line_end() {
                        let (g, b) = (number(&mut s, "green")?, number(&mut s, "blue")?);
                        colours.resize(points.len() - 1, Vec3::ONE);
                        colours.push(Vec3::new(first, g, b));
                    }
                }
            }
            b"vn" => normals.push(vec3(&mut s, "x, y and z of a normal")?.normalize_or_zero()),
            b"vt" => {
                let u = number(&mut s, "u")?;
                // v and w are optional in the format.
                let v = if s.at_line_end() { 0.0 } else { number(&mut s, "v")? };
                uvs.push(Vec2::new(u, 1.0 - v));
                if !s.at_line_end() {
                    number(&mut s, "w")?;
                }
            }
            b"f" => {
                polygon.clear();
                while !s.at_line_end() {
                    let p = index(&mut s, points.len(), "vertex")?;
                    let (mut t, mut n) = (NONE, NONE);
                    if s.take(b'/') {
                        if !s.rest().starts_with(b"/") {
                            t = index(&mut s, uvs.len(), "texture coordinate")?;
                        }
                        if s.take(b'/') {
                            n = index(&mut s, normals.len(), "normal")?;
                        }
                    }
                    if !s.rest().first().is_none_or(u8::is_ascii_whitespace) && !s.rest().starts_with(b"\\") {
                        return Err(s.expected("a blank after a corner such as 3/1/2"));
                    }
                    polygon.push(corners.find([p, t, n]));
                }
                if polygon.len() < 3 {
                    return Err(Error::invalid(
                        s.place_of(at),
                        format!("a face has at least 3 corners, this one has {}", polygon.len()),
                    ));
                }
                if corners.keys.len() >= NONE as usize {
                    return Err(too_many(s.place_of(at)));
                }
                for k in 2..polygon.len() {
                    obj.mesh.triangles.push([polygon[0], polygon[k - 1], polygon[k]]);
                }
            }
            b"usemtl" => {
                let name = String::from_utf8_lossy(s.next_line()).into_owned();
                if material.as_ref() != Some(&name) {
                    let end = obj.mesh.triangles.len();
                    if end > run {
                        obj.parts.push(Part { material: material.take(), triangles: run..end });
                        run = end;
                    }
                    material = Some(name);
                }
                continue;
            }
            b"mtllib" => {
                obj.libraries.push(String::from_utf8_lossy(s.next_line()).into_owned());
                continue;
            }
            word if word.starts_with(b"#") => {
                s.next_line();
                continue;
            }
            word => {
                let word = String::from_utf8_lossy(word);
                if !SKIPPED.contains(&&*word) {
                    let shown: String = word.chars().take(40).collect();
                    return Err(Error::unknown(
                        s.place_of(at),
                        "OBJ statement",
                        &shown,
                        READ.iter().chain(SKIPPED).copied(),
                    ));
                }
                s.next_line();
                continue;
            }
        }
        if !s.at_line_end() {
            return Err(s.expected("the end of the line"));
        }
    }
    if obj.mesh.triangles.is_empty() {
        return Err(Error::invalid(
            Place::file(path),
            "the file has no faces; a mesh needs at least one 'f' statement",
        ));
    }
    obj.parts.push(Part { material, triangles: run..obj.mesh.triangles.len() });

    let keys = &corners.keys;
    obj.mesh.positions = keys.iter().map(|k| points[k[0] as usize]).collect();
    if keys.iter().any(|k| k[1] != NONE) {
        obj.mesh.uvs =
            keys.iter().map(|k| if k[1] == NONE { Vec2::ZERO } else { uvs[k[1] as usize] }).collect();
    }
    if keys.iter().any(|k| k[2] != NONE) {
        obj.mesh.normals =
            keys.iter().map(|k| if k[2] == NONE { Vec3::ZERO } else { normals[k[2] as usize] }).collect();
        if obj.mesh.normals.contains(&Vec3::ZERO) {
            obj.mesh.complete_normals(glam::Mat3::IDENTITY);
        }
    }
    if !colours.is_empty() {
        colours.resize(points.len(), Vec3::ONE);
        let values = keys.iter().flat_map(|k| colours[k[0] as usize].to_array()).collect();
        obj.mesh.attributes.push(("vertex_color".into(), 3, values));
    }
    Ok(obj)
}

fn too_many(at: Place) -> Error {
    Error::TooLarge {
        at,
        what: "the number of vertices".into(),
        asked: NONE.into(),
        limit: u64::from(NONE) - 1,
    }
}

fn number(s: &mut Scanner, what: &str) -> Result<f32, Error> {
    s.blanks();
    let at = s.mark();
    let value = s.float().ok_or_else(|| s.expected(&format!("{what} as a finite number")))? as f32;
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Error::invalid(
            s.place_of(at),
            format!("expected {what} within single precision, which ends at 3.4e38"),
        ))
    }
}

fn vec3(s: &mut Scanner, what: &str) -> Result<Vec3, Error> {
    Ok(Vec3::new(number(s, what)?, number(s, what)?, number(s, what)?))
}

/// An index from zero, made from one that counts from one, or back from the end where negative.
#[inline]
fn index(s: &mut Scanner, count: usize, what: &str) -> Result<u32, Error> {
    let at = s.mark();
    let value = s.integer().ok_or_else(|| s.expected(&format!("the index of a {what}")))?;
    let zero_based = if value < 0 { value + count as i64 } else { value - 1 };
    if value == 0 || zero_based < 0 || zero_based >= (count as i64).min(NONE.into()) {
        let range = if count == 0 {
            "there are none so far".to_string()
        } else {
            format!("there are {count} so far, counted from 1")
        };
        return Err(Error::invalid(s.place_of(at), format!("{what} {value} does not exist; {range}")));
    }
    Ok(zero_based as u32)
}

/// Numbers the distinct (position, uv, normal) triples: open addressing over the list of keys.
#[derive(Default)]
struct Corners {
    keys: Vec<[u32; 3]>,
    table: Vec<u32>,
}

impl Corners {
    #[inline]
    fn slot(&self, [p, t, n]: [u32; 3]) -> usize {
        // Odd 64-bit constants (fractional parts of e, π and the golden ratio); the high bits are mixed best.
        let h = u64::from(p).wrapping_mul(0x9e37_79b9_7f4a_7c15)
            ^ u64::from(t).wrapping_mul(0xb7e1_5162_8aed_2a6b).rotate_left(21)
            ^ u64::from(n).wrapping_mul(0x243f_6a88_85a3_08d3).rotate_left(42);
        let h = (h ^ (h >> 32)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (h >> (64 - self.table.len().trailing_zeros())) as usize
    }

    #[inline]
    fn find(&mut self, key: [u32; 3]) -> u32 {
        if 2 * self.keys.len() >= self.table.len() {
            self.table = vec![NONE; (4 * self.keys.len()).next_power_of_two().max(1024)];
            for i in 0..self.keys.len() {
                let mut slot = self.slot(self.keys[i]);
                while self.table[slot] != NONE {
                    slot = (slot + 1) & (self.table.len() - 1);
                }
                self.table[slot] = i as u32;
            }
        }
        let mut slot = self.slot(key);
        loop {
            match self.table[slot] {
                NONE => break,
                i if self.keys[i as usize] == key => return i,
                _ => slot = (slot + 1) & (self.table.len() - 1),
            }
        }
        self.table[slot] = self.keys.len() as u32;
        self.keys.push(key);
        self.table[slot]
    }
}

/// A material of an MTL library, as written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mtl {
    /// The word after `newmtl`.
    pub name: String,
    /// Statements in order: keyword, and the rest of the line split at blanks.
    pub statements: Vec<(String, Vec<String>)>,
}

impl Mtl {
    /// One or three numbers after a keyword (`Ns`, `Kd`, …); one number stands for grey.
    pub fn colour(&self, keyword: &str) -> Option<Vec3> {
        let words = self.words(keyword)?;
        let v: Vec<f32> = words.iter().map_while(|w| w.parse().ok()).collect();
        match v[..] {
            [x] => Some(Vec3::splat(x)),
            [x, y, z, ..] => Some(Vec3::new(x, y, z)),
            _ => None,
        }
    }

    /// The file named after a keyword (`map_Kd`, `bump`, …): the last word, options come before it.
    pub fn file(&self, keyword: &str) -> Option<&str> {
        self.words(keyword)?.last().map(String::as_str)
    }

    fn words(&self, keyword: &str) -> Option<&[String]> {
        self.statements.iter().find(|(k, _)| k.eq_ignore_ascii_case(keyword)).map(|(_, w)| w.as_slice())
    }
}

/// Reads an MTL library; `path` names it in messages. Numbers are checked where they are asked for.
pub fn read_mtl(bytes: &[u8], path: &Path) -> Result<Vec<Mtl>, Error> {
    let mut s = Scanner::new(bytes, path);
    let mut materials: Vec<Mtl> = Vec::new();
    loop {
        s.space();
        if s.at_end() {
            return Ok(materials);
        }
        let at = s.place();
        let keyword = String::from_utf8_lossy(s.word()).into_owned();
        let line = String::from_utf8_lossy(s.next_line()).into_owned();
        if keyword.starts_with('#') {
            continue;
        }
        if keyword == "newmtl" {
            materials.push(Mtl { name: line, statements: Vec::new() });
            continue;
        }
        let Some(last) = materials.last_mut() else {
            return Err(Error::invalid(
                at,
                "expected 'newmtl NAME' before the first statement of a material",
            ));
        };
        last.statements.push((keyword, line.split_whitespace().map(String::from).collect()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Obj, String> {
        read(text.as_bytes(), Path::new("a.obj")).map_err(|e| e.to_string())
    }

    #[test]
    fn a_quad_with_two_materials_negative_indices_and_continued_lines() {
        let text = "# a quad and a triangle\nmtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0 0.5 0.25 1\nv 0 1 0\r\nvt 0 0\nvt 1 0\nvt 1 1\n\
                    vn 0 0 2\nusemtl red one\nf 1/1/1 2/2/1 3/3/1 \\\n 4/1/1\nusemtl blue\nf -4//1 -3//1 -2//1\no x";
        let obj = parse(text).unwrap();
        assert_eq!(obj.mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 5, 6]]);
        assert_eq!(obj.mesh.positions[3], Vec3::Y);
        assert_eq!(obj.mesh.uvs[2], Vec2::X);
        assert_eq!(obj.mesh.normals[0], Vec3::Z);
        assert_eq!(obj.libraries, ["a.mtl"]);
        assert_eq!(obj.mesh.attributes[0].2[6..9], [0.5, 0.25, 1.0]);
        let names: Vec<_> =
            obj.parts.iter().map(|p| (p.material.clone().unwrap(), p.triangles.clone())).collect();
        assert_eq!(names, [("red one".into(), 0..2), ("blue".into(), 2..3)]);
        let split = obj.split();
        assert_eq!((split[0].1.positions.len(), split[1].1.positions.len()), (4, 3));
        assert_eq!(split[1].1.triangles, [[0, 1, 2]]);
        assert_eq!(split[1].1.attributes[0].2[6..9], [0.5, 0.25, 1.0]);
    }

    #[test]
    fn mistakes_are_named_with_line_and_column() {
        let cases = [
            ("v 0 0 x\n", "a.obj:1:7: expected x, y and z as a finite number, found 'x'"),
            ("v 0 0\n", "a.obj:1:6: expected x, y and z as a finite number, found the end of the line"),
            ("v 0 0 nan", "a.obj:1:7: expected x, y and z as a finite number, found 'nan'"),
            ("v 1e39 0 0", "a.obj:1:3: expected x, y and z within single precision, which ends at 3.4e38"),
            ("v 0 0 0\nf 1 1 4\n", "a.obj:2:7: vertex 4 does not exist; there are 1 so far, counted from 1"),
            (
                "v 0 0 0\nf 1 1 -2\n",
                "a.obj:2:7: vertex -2 does not exist; there are 1 so far, counted from 1",
            ),
            ("v 0 0 0\nf 1/1 1 1", "a.obj:2:5: texture coordinate 1 does not exist; there are none so far"),
            ("v 0 0 0\nf 1 1\n", "a.obj:2:1: a face has at least 3 corners, this one has 2"),
            ("v 0 0 0\nf 1 1 1x\n", "a.obj:2:8: expected a blank after a corner such as 3/1/2, found 'x'"),
            ("usemlt red\n", "a.obj:1:1: unknown OBJ statement 'usemlt'; did you mean 'usemtl'?"),
            ("v 0 0 0\n", "a.obj: the file has no faces; a mesh needs at least one 'f' statement"),
        ];
        for (text, message) in cases {
            assert_eq!(parse(text).unwrap_err(), message);
        }
    }

    #[test]
    fn a_library_of_materials() {
        let text = b"# x\nnewmtl red\nKd 1 0 0.5\nNs 20\nmap_Kd -bm 1 wood.png\nnewmtl b";
        let m = read_mtl(text, Path::new("a.mtl")).unwrap();
        assert_eq!(m.len(), 2);
        assert_eq!(m[0].colour("kd"), Some(Vec3::new(1.0, 0.0, 0.5)));
        assert_eq!(m[0].colour("Ns"), Some(Vec3::splat(20.0)));
        assert_eq!(m[0].file("map_Kd"), Some("wood.png"));
        assert_eq!(m[1].colour("Kd"), None);
        let e = read_mtl(b"Kd 1 1 1", Path::new("a.mtl")).unwrap_err();
        assert_eq!(
            e.to_string(),
            "a.mtl:1:1: expected 'newmtl NAME' before the first statement of a material"
        );
    }
}
