//! Wavefront OBJ meshes, as the format says and as thirty years of exporters write them. Alias|Wavefront 1995, "Object
//! Files".
//!
//! Polygons become triangles; corners that share position, (u, v) and normal become one vertex. What cannot be used is
//! left out and said once, with how often it was found.

use super::corners::Corners;
use super::numbers::{Mark, Scanner, text};
use super::support::{Feature, Support, find};
use crate::{Error, Place};
use glam::{Vec2, Vec3};
use std::ops::Range;
use std::path::Path;
use yugen_scene::nearest;
use yugen_scene::{Mesh, polygon};

/// A mesh and which part of it is of what.
#[derive(Clone, Debug, Default)]
pub struct Obj {
    /// All triangles of the file, in its order. In the file v runs up; here it runs down, as in [`Mesh`].
    pub mesh: Mesh,
    /// Runs of triangles with one material, in order, covering all of them.
    pub parts: Vec<Part>,
    /// What stands after each `mtllib`: one name, or several.
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

const FREE_FORM: &str = "free-form curves and surfaces are not read; export them as polygons";
const OTHERS: &str = "an instruction for other renderers";
const MAPS: &str = "pictures are named by materials; use a material library";

/// The statements of the format.
pub const FEATURES: &[Feature] = &[
    Feature::partly("v", "of w, the weight, nothing is kept; six numbers are a position and a linear colour"),
    Feature::partly("vt", "of w, the depth of a solid texture, nothing is kept"),
    Feature::yes("vn"),
    Feature::yes("f"),
    Feature::yes("fo"),
    Feature::yes("usemtl"),
    Feature::partly("mtllib", "a library that is missing is said, and its materials are grey"),
    Feature::partly("o", "objects are not told apart, only materials"),
    Feature::partly("g", "groups are not told apart, only materials"),
    Feature::partly("s", "triangles are smooth where the file has normals, else flat"),
    Feature::partly("mg", "merging is for free-form surfaces"),
    Feature::partly("lod", "every level is shown"),
    Feature::no("l", "a line has no surface"),
    Feature::no("p", "a point has no surface"),
    Feature::no("vp", FREE_FORM),
    Feature::no("cstype", FREE_FORM),
    Feature::no("deg", FREE_FORM),
    Feature::no("bmat", FREE_FORM),
    Feature::no("step", FREE_FORM),
    Feature::no("curv", FREE_FORM),
    Feature::no("curv2", FREE_FORM),
    Feature::no("surf", FREE_FORM),
    Feature::no("parm", FREE_FORM),
    Feature::no("trim", FREE_FORM),
    Feature::no("hole", FREE_FORM),
    Feature::no("scrv", FREE_FORM),
    Feature::no("sp", FREE_FORM),
    Feature::no("end", FREE_FORM),
    Feature::no("con", FREE_FORM),
    Feature::no("ctech", FREE_FORM),
    Feature::no("stech", FREE_FORM),
    Feature::no("bevel", OTHERS),
    Feature::no("c_interp", OTHERS),
    Feature::no("d_interp", OTHERS),
    Feature::no("shadow_obj", OTHERS),
    Feature::no("trace_obj", OTHERS),
    Feature::no("maplib", MAPS),
    Feature::no("usemap", MAPS),
    Feature::no("call", "other files are not read into this one; merge them"),
    Feature::no("csh", "commands are not run"),
];

/// No index: the corner has no (u, v) or no normal.
const NONE: u32 = u32::MAX;

/// Words that are remembered to be spoken of: a file that is no OBJ at all has many.
const MAX_WORDS: usize = 8;

/// What was left out, to be said when the whole file has been read.
#[derive(Default)]
struct Omissions {
    /// Statements that mean nothing here: the word, where it stood first, how often it was found.
    words: Vec<(String, Place, usize)>,
    /// Further words than those.
    more: usize,
    /// Faces of fewer than three corners.
    thin: usize,
    /// Faces whose outlines cross themselves.
    crossed: usize,
    /// Corners with an index of zero.
    zeros: usize,
    /// Numbers of normals and texture coordinates that are none.
    numbers: usize,
}

impl Omissions {
    fn word(&mut self, word: &[u8], at: Place) {
        let word = String::from_utf8_lossy(&word[..word.len().min(40)]).escape_debug().to_string();
        match self.words.iter().position(|w| w.0 == word) {
            Some(i) => self.words[i].2 += 1,
            None if self.words.len() < MAX_WORDS => self.words.push((word, at, 1)),
            None => self.more += 1,
        }
    }

    fn say(self, path: &Path) {
        let times = |n: usize| if n == 1 { String::new() } else { format!(" ({n} times)") };
        for (word, at, count) in self.words {
            let count = times(count);
            match find(FEATURES, &word.to_lowercase()).map(|f| f.support) {
                Some(Support::No(why)) => tracing::warn!("{at}: '{word}' is skipped{count}: {why}"),
                _ => match nearest(&word, FEATURES.iter().map(|f| f.name)) {
                    Some(near) => {
                        tracing::warn!(
                            "{at}: unknown OBJ statement '{word}' is skipped{count}; did you mean '{near}'?"
                        );
                    }
                    None => tracing::warn!("{at}: unknown OBJ statement '{word}' is skipped{count}"),
                },
            }
        }
        let path = path.display();
        if self.more > 0 {
            tracing::warn!("{path}: {} statements with further words are skipped", self.more);
        }
        if self.thin > 0 {
            tracing::warn!("{path}: faces of fewer than three corners are skipped: {}", self.thin);
        }
        if self.crossed > 0 {
            tracing::warn!(
                "{path}: faces that cross themselves are cut into triangles as well as can be: {}",
                self.crossed
            );
        }
        if self.zeros > 0 {
            tracing::warn!(
                "{path}: indices that are 0 count as missing, because the first texture coordinate or normal is 1: {}",
                self.zeros
            );
        }
        if self.numbers > 0 {
            tracing::warn!(
                "{path}: normals and texture coordinates that are no numbers count as missing: {}",
                self.numbers
            );
        }
    }
}

/// The furthest that faces refer ahead to what is defined below them: how far, and where.
#[derive(Default)]
struct Ahead(i64, Option<Mark>);

impl Ahead {
    fn check(&self, count: usize, what: &str, s: &Scanner) -> Result<(), Error> {
        match self.1 {
            Some(at) if self.0 > count as i64 => Err(missing(self.0, count, what, s.place_of(at))),
            _ => Ok(()),
        }
    }
}

fn missing(value: i64, count: usize, what: &str, at: Place) -> Error {
    let range =
        if count == 0 { "there are none".to_string() } else { format!("there are {count}, counted from 1") };
    Error::invalid(at, format!("{what} {value} does not exist; {range}"))
}

/// Reads an OBJ file; `path` names it in messages.
pub fn read(bytes: &[u8], path: &Path) -> Result<Obj, Error> {
    let bytes = text(bytes);
    let mut s = Scanner::new(&bytes, path);
    let (mut points, mut colours, mut uvs, mut normals) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut corners = Corners::default();
    let mut polygon: Vec<u32> = Vec::new();
    // Of more than three corners: the first triangle and how many there are.
    let mut polygons: Vec<[usize; 2]> = Vec::new();
    let mut ahead: [Ahead; 3] = Default::default();
    let mut omitted = Omissions::default();
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
        let word = s.word();
        // Some exporters shout.
        let mut lower = [0; 16];
        let known = match lower.get_mut(..word.len()) {
            Some(lower) if word.first().is_some_and(u8::is_ascii_uppercase) => {
                lower.copy_from_slice(word);
                lower.make_ascii_lowercase();
                &*lower
            }
            _ => word,
        };
        match known {
            b"v" => {
                points.push(vec3(&mut s, "x, y and z")?);
                if !ended(&mut s) {
                    // Either a weight, or a colour as many scanners write it.
                    let first = number(&mut s, "a number")?;
                    if !ended(&mut s) {
                        let (g, b) = (number(&mut s, "green")?, number(&mut s, "blue")?);
                        colours.resize(points.len() - 1, Vec3::ONE);
                        colours.push(Vec3::new(first, g, b));
                        // An alpha that nobody reads.
                        if !ended(&mut s) {
                            number(&mut s, "alpha")?;
                        }
                    }
                }
            }
            b"vn" => {
                let mut part = || lenient(&mut s, "x, y and z of a normal", &mut omitted.numbers);
                normals.push(Vec3::new(part()?, part()?, part()?).normalize_or_zero());
            }
            b"vt" => {
                let u = lenient(&mut s, "u", &mut omitted.numbers)?;
                // v and w are optional in the format.
                let v = if ended(&mut s) { 0.0 } else { lenient(&mut s, "v", &mut omitted.numbers)? };
                uvs.push(if (u + v).is_nan() { Vec2::ZERO } else { Vec2::new(u, 1.0 - v) });
                if !ended(&mut s) {
                    lenient(&mut s, "w", &mut omitted.numbers)?;
                }
            }
            // What faces were called before version 3.
            b"f" | b"fo" => {
                polygon.clear();
                while !ended(&mut s) {
                    let start = s.mark();
                    let p = index(&mut s, points.len(), "vertex", &mut ahead[0])?;
                    let p = p.ok_or_else(|| missing(0, points.len(), "vertex", s.place_of(start)))?;
                    let (mut t, mut n) = (None, None);
                    if s.take(b'/') {
                        if !s.rest().starts_with(b"/") && !corner_ends(&s) {
                            t = index(&mut s, uvs.len(), "texture coordinate", &mut ahead[1])?;
                            omitted.zeros += usize::from(t.is_none());
                        }
                        if s.take(b'/') && !corner_ends(&s) {
                            n = index(&mut s, normals.len(), "normal", &mut ahead[2])?;
                            omitted.zeros += usize::from(n.is_none());
                        }
                    }
                    if !corner_ends(&s) {
                        return Err(s.expected("a blank after a corner such as 3/1/2"));
                    }
                    polygon.push(corners.find([p, t.unwrap_or(NONE), n.unwrap_or(NONE)]));
                }
                if corners.keys.len() >= NONE as usize {
                    return Err(too_many(s.place_of(at)));
                }
                if polygon.len() < 3 {
                    omitted.thin += 1;
                }
                if polygon.len() > 3 {
                    polygons.push([obj.mesh.triangles.len(), polygon.len() - 2]);
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
                    material = Some(name).filter(|n| !n.is_empty());
                }
                continue;
            }
            b"mtllib" => {
                obj.libraries.push(String::from_utf8_lossy(s.next_line()).into_owned());
                continue;
            }
            _ if word.starts_with(b"#") => {
                s.next_line();
                continue;
            }
            _ => {
                let feature = std::str::from_utf8(known).ok().and_then(|w| find(FEATURES, w));
                if !feature.is_some_and(|f| matches!(f.support, Support::Yes | Support::Partly(_))) {
                    omitted.word(word, s.place_of(at));
                }
                // Numbers of a curve may go on over several lines.
                while !s.at_line_end() {
                    s.word();
                }
                continue;
            }
        }
        if !ended(&mut s) {
            return Err(s.expected("the end of the line"));
        }
        if s.rest().starts_with(b"#") {
            s.next_line();
        }
    }
    for (ahead, (count, what)) in ahead.iter().zip([
        (points.len(), "vertex"),
        (uvs.len(), "texture coordinate"),
        (normals.len(), "normal"),
    ]) {
        ahead.check(count, what, &s)?;
    }
    let keys = &corners.keys;
    obj.mesh.positions = keys.iter().map(|k| points[k[0] as usize]).collect();
    for [first, count] in polygons {
        let clean = polygon::cut(&obj.mesh.positions, &mut obj.mesh.triangles[first..first + count]);
        omitted.crossed += usize::from(!clean);
    }
    omitted.say(path);
    if obj.mesh.triangles.is_empty() {
        return Err(Error::invalid(
            Place::file(path),
            "the file has no faces; a mesh needs at least one 'f' statement of three corners",
        ));
    }
    obj.parts.push(Part { material, triangles: run..obj.mesh.triangles.len() });

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

/// Whether a statement ends here, or a comment begins.
#[inline]
fn ended(s: &mut Scanner) -> bool {
    s.at_line_end() || s.rest().starts_with(b"#")
}

/// Whether a corner of a face ends here.
#[inline]
fn corner_ends(s: &Scanner) -> bool {
    matches!(s.rest().first(), None | Some(b' ' | b'\t' | b'\n' | b'\r' | b'\\' | b'#' | 0x0b | 0x0c))
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

/// A number that may be none, as `nan` or the `-1.#IND00` of old C libraries: NaN then, and counted.
#[inline]
fn lenient(s: &mut Scanner, what: &str, count: &mut usize) -> Result<f32, Error> {
    s.blanks();
    let rest = s.rest();
    let value = if matches!(rest.first(), Some(b'-' | b'+')) { &rest[1..] } else { rest };
    let none = match value {
        [b'1', b'.', b'#', ..] => true,
        [b'n' | b'N' | b'i' | b'I', ..] => {
            let start = value[..value.len().min(3)].to_ascii_lowercase();
            start == b"nan" || start == b"inf"
        }
        _ => false,
    };
    if none {
        s.word();
        *count += 1;
        return Ok(f32::NAN);
    }
    number(s, what)
}

/// An index from zero, made from one that counts from one, or back from the last one so far where negative; `None` for 0.
/// What lies further on in the file is noted, and checked at its end.
#[inline]
fn index(s: &mut Scanner, count: usize, what: &str, ahead: &mut Ahead) -> Result<Option<u32>, Error> {
    let at = s.mark();
    let value = s.integer().ok_or_else(|| s.expected(&format!("the index of a {what}")))?;
    let zero_based = if value < 0 { value + count as i64 } else { value - 1 };
    if value == 0 {
        return Ok(None);
    }
    if !(0..i64::from(NONE)).contains(&zero_based) {
        return Err(missing(value, count, what, s.place_of(at)));
    }
    if zero_based >= count as i64 && value > ahead.0 {
        *ahead = Ahead(value, Some(at));
    }
    Ok(Some(zero_based as u32))
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
    fn what_others_write_is_read() {
        let square = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";
        let files = [
            format!("\u{feff}# marked\n{square}f 1 2 3 4"),
            format!("{}f 1 2 3 4 # all\n", square.replace('\n', " # a corner\n")),
            format!("{square}f 1// 2// 3// 4//"),
            format!("{square}f 1/ 2/ 3/ 4/#"),
            format!("{square}vt 0 0\nf 1/1/ 2/1/ 3/1/ 4/1/\n"),
            format!("{square}f 1 2 \\ \t\r\n\x0c 3 4").replace('\n', "\r\n"),
            format!("{square}\x0cf 1 2 3 4\n").replace('\n', "\r"),
            format!("f 1 2 3 4\n{square}"),
            format!("{square}vn 0 0 1\nvt 0 0\nf 1/0/1 2/0/1 3/0/1 4/0/1"),
            format!("{square}f 1 2\nf 3\nf\nf 1 2 3 4"),
            format!("{square}wobble 3\nfo 1 2 3 4\n").to_uppercase(),
        ];
        for file in files {
            for bytes in
                [file.clone().into_bytes(), utf16(&file, u16::to_le_bytes), utf16(&file, u16::to_be_bytes)]
            {
                let mesh =
                    read(&bytes, Path::new("a.obj")).unwrap_or_else(|e| panic!("{e} in {file:?}")).mesh;
                assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]], "{file:?}");
                assert_eq!(mesh.positions[2], Vec3::new(1.0, 1.0, 0.0));
            }
        }
    }

    fn utf16(text: &str, bytes: fn(u16) -> [u8; 2]) -> Vec<u8> {
        // Where the text has a mark already it is not written twice.
        let mark = if text.starts_with('\u{feff}') { "" } else { "\u{feff}" };
        [mark, text].concat().encode_utf16().flat_map(bytes).collect()
    }

    #[test]
    fn normals_and_texture_coordinates_that_are_no_numbers_count_as_missing() {
        let obj = parse(
            "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nvt 0.5 0.25 0\nvt -1.#IND00 -1.#IND00 0\nvn nan -nan nan\nvn 0 0 1\n\
             f 1/1/1 2/2/2 3/2/2",
        )
        .unwrap();
        assert_eq!(obj.mesh.uvs, [Vec2::new(0.5, 0.75), Vec2::ZERO, Vec2::ZERO]);
        assert_eq!(obj.mesh.normals, [Vec3::Z; 3]);
    }

    #[test]
    fn hollow_corners_stay_outside() {
        let obj = parse("v -1 -1 0\nv 0 0 0\nv 1 -1 0\nv 0 1 0\nf 4 1 2\nf 1 2 3 4").unwrap();
        let order = |t: &[u32; 3]| {
            let mut x = t.map(|i| obj.mesh.positions[i as usize].x);
            x.sort_by(f32::total_cmp);
            x
        };
        assert_eq!(
            obj.mesh.triangles[1..].iter().map(order).collect::<Vec<_>>(),
            [[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
        );
    }

    #[test]
    fn mistakes_are_named_with_line_and_column() {
        let cases = [
            ("v 0 0 x\n", "a.obj:1:7: expected x, y and z as a finite number, found 'x'"),
            ("v 0 0\n", "a.obj:1:6: expected x, y and z as a finite number, found the end of the line"),
            ("v 0 0 nan", "a.obj:1:7: expected x, y and z as a finite number, found 'nan'"),
            ("v 1e39 0 0", "a.obj:1:3: expected x, y and z within single precision, which ends at 3.4e38"),
            ("v 0 0 0\nf 1 1 4\n", "a.obj:2:7: vertex 4 does not exist; there are 1, counted from 1"),
            ("v 0 0 0\nf 1 1 -2\n", "a.obj:2:7: vertex -2 does not exist; there are 1, counted from 1"),
            ("v 0 0 0\nf 1/1 1 1", "a.obj:2:5: texture coordinate 1 does not exist; there are none"),
            (
                "v 0 0 0\nf 1 1\n",
                "a.obj: the file has no faces; a mesh needs at least one 'f' statement of three corners",
            ),
            ("v 0 0 0\nf 0 1 1\n", "a.obj:2:3: vertex 0 does not exist; there are 1, counted from 1"),
            ("v 0 0 0\nf 1 1 1x\n", "a.obj:2:8: expected a blank after a corner such as 3/1/2, found 'x'"),
            (
                "v 0 0 0\n",
                "a.obj: the file has no faces; a mesh needs at least one 'f' statement of three corners",
            ),
        ];
        for (text, message) in cases {
            assert_eq!(parse(text).unwrap_err(), message);
        }
    }
}
