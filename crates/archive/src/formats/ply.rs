//! The Polygon File Format (PLY): text and binary of either byte order.
//!
//! Turk 1994. Polygons become fans of triangles; strips (`tristrips`) become their triangles. Properties of
//! vertices beyond position, normal and (u, v) become attributes with the names Mitsuba gives them.

use super::numbers::Scanner;
use crate::scene::Mesh;
use crate::{Error, Place};
use glam::{Vec2, Vec3};
use std::path::Path;
use yugen_optics::colour::srgb_to_linear;

/// A header longer than this is none.
const MAX_HEADER: usize = 1 << 20;
/// Elements of a file, and properties of an element.
const MAX_NAMES: usize = 256;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    const NAMES: [(&'static str, &'static str, Self); 8] = [
        ("char", "int8", Self::I8),
        ("uchar", "uint8", Self::U8),
        ("short", "int16", Self::I16),
        ("ushort", "uint16", Self::U16),
        ("int", "int32", Self::I32),
        ("uint", "uint32", Self::U32),
        ("float", "float32", Self::F32),
        ("double", "float64", Self::F64),
    ];

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The largest value of a whole type, 1 for others: what a stored colour is divided by.
    fn unit(self) -> f64 {
        match self {
            Self::I8 => f64::from(i8::MAX),
            Self::U8 => f64::from(u8::MAX),
            Self::I16 => f64::from(i16::MAX),
            Self::U16 => f64::from(u16::MAX),
            Self::I32 => f64::from(i32::MAX),
            Self::U32 => f64::from(u32::MAX),
            Self::F32 | Self::F64 => 1.0,
        }
    }
}

#[derive(Clone, Debug)]
struct Property {
    name: String,
    /// The type of the count, for a list.
    count: Option<Scalar>,
    value: Scalar,
}

#[derive(Clone, Debug)]
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Text,
    Little,
    Big,
}

/// Where the value of a vertex property goes.
#[derive(Clone, Copy)]
enum Sink {
    Skip,
    Position(usize),
    Normal(usize),
    Uv(usize),
    /// Which attribute, which of its components, and what stored whole numbers are divided by.
    Attribute(usize, usize, f64),
}

/// Reads a PLY file; `path` names it in messages. (u, v) are as in the file.
pub fn read(bytes: &[u8], path: &Path) -> Result<Mesh, Error> {
    let mut s = Scanner::new(&bytes[..bytes.len().min(MAX_HEADER)], path);
    let (encoding, elements) = header(&mut s)?;
    let start = s.offset();
    let mut mesh =
        Mesh { name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(), ..Mesh::default() };
    match encoding {
        Encoding::Text => body(Text(Scanner::resume(bytes, &s)), &elements, &mut mesh)?,
        Encoding::Little => body(Binary::<true> { bytes, at: start, path }, &elements, &mut mesh)?,
        Encoding::Big => body(Binary::<false> { bytes, at: start, path }, &elements, &mut mesh)?,
    }
    if mesh.triangles.is_empty() {
        return Err(Error::invalid(Place::file(path), "the file has no faces; a point cloud is no mesh"));
    }
    let vertices = mesh.positions.len();
    if let Some((i, t)) =
        mesh.triangles.iter().enumerate().find(|(_, t)| t.iter().any(|&v| v as usize >= vertices))
    {
        let problem =
            format!("triangle {i} has the corners {t:?}, but there are {vertices} vertices, counted from 0");
        return Err(Error::invalid(Place::file(path), problem));
    }
    if mesh.normals.contains(&Vec3::ZERO) {
        mesh.complete_normals(glam::Mat3::IDENTITY);
    }
    Ok(mesh)
}

fn header(s: &mut Scanner) -> Result<(Encoding, Vec<Element>), Error> {
    if s.next_line() != b"ply" {
        return Err(Error::invalid(s.start_of_file(), "expected 'ply' as the first line of a PLY file"));
    }
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let string = |w: &[u8]| String::from_utf8_lossy(w).into_owned();
    loop {
        s.space();
        if s.at_end() {
            return Err(s.expected("'end_header'"));
        }
        let at = s.place();
        match s.word() {
            b"comment" | b"obj_info" => {
                s.next_line();
                continue;
            }
            b"format" => {
                let at = s.place();
                encoding = Some(match s.word() {
                    b"ascii" => Encoding::Text,
                    b"binary_little_endian" => Encoding::Little,
                    b"binary_big_endian" => Encoding::Big,
                    w => {
                        let known = ["ascii", "binary_little_endian", "binary_big_endian"];
                        return Err(Error::unknown(at, "PLY format", &short(w), known));
                    }
                });
                if s.word() != b"1.0" {
                    return Err(Error::invalid(at, "expected version 1.0 of the format"));
                }
            }
            b"element" => {
                let name = string(s.word());
                s.blanks();
                let at = s.place();
                let count = s.integer().and_then(|n| u64::try_from(n).ok());
                let count =
                    count.ok_or_else(|| Error::invalid(at.clone(), "expected the number of elements"))?;
                if elements.len() == MAX_NAMES || elements.iter().any(|e| e.name == name) {
                    return Err(twice(at, "element", &name));
                }
                elements.push(Element { name, count, properties: Vec::new() });
            }
            b"property" => {
                let Some(element) = elements.last_mut() else {
                    return Err(Error::invalid(at, "expected 'element' before the first 'property'"));
                };
                let scalar = |s: &mut Scanner, word: &[u8]| {
                    let found =
                        Scalar::NAMES.iter().find(|(a, b, _)| word == a.as_bytes() || word == b.as_bytes());
                    let known = Scalar::NAMES.iter().flat_map(|(a, b, _)| [*a, *b]);
                    found
                        .map(|f| f.2)
                        .ok_or_else(|| Error::unknown(s.place(), "PLY type", &short(word), known))
                };
                let first = s.word();
                let count = if first == b"list" {
                    let word = s.word();
                    let count = scalar(s, word)?;
                    if matches!(count, Scalar::F32 | Scalar::F64) {
                        return Err(Error::invalid(at, "expected a whole type as the count of a list"));
                    }
                    Some(count)
                } else {
                    None
                };
                let word = if count.is_some() { s.word() } else { first };
                let value = scalar(s, word)?;
                let name = string(s.word());
                if element.properties.len() == MAX_NAMES || element.properties.iter().any(|p| p.name == name)
                {
                    return Err(twice(at, "property", &name));
                }
                element.properties.push(Property { name, count, value });
            }
            b"end_header" => {
                if !s.at_line_end() {
                    return Err(s.expected("the end of the line"));
                }
                s.next_line_exactly();
                break;
            }
            w => {
                let known = ["format", "element", "property", "comment", "obj_info", "end_header"];
                return Err(Error::unknown(at, "PLY keyword", &short(w), known));
            }
        }
        if !s.at_line_end() {
            return Err(s.expected("the end of the line"));
        }
    }
    let encoding = encoding.ok_or_else(|| Error::invalid(s.place(), "the header has no 'format'"))?;
    Ok((encoding, elements))
}

fn short(word: &[u8]) -> String {
    String::from_utf8_lossy(&word[..word.len().min(40)]).into_owned()
}

fn twice(at: Place, what: &str, name: &str) -> Error {
    let name: String = name.chars().take(40).collect();
    Error::invalid(
        at,
        format!(
            "expected at most {MAX_NAMES} names of this kind, each once; the {what} '{name}' is too many"
        ),
    )
}

/// The values after the header, one by one.
trait Values {
    fn next(&mut self, scalar: Scalar) -> Result<f64, Error>;
    fn skip(&mut self, scalar: Scalar, n: u64) -> Result<(), Error>;
    fn place(&self) -> Place;
    fn bytes_left(&self) -> u64;
    /// The fewest bytes a value takes.
    fn least(&self, scalar: Scalar) -> u64;
}

struct Text<'a>(Scanner<'a>);

impl Values for Text<'_> {
    #[inline]
    fn next(&mut self, scalar: Scalar) -> Result<f64, Error> {
        self.0.space();
        let _ = scalar;
        self.0.float().ok_or_else(|| self.0.expected("a finite number"))
    }

    fn skip(&mut self, scalar: Scalar, n: u64) -> Result<(), Error> {
        for _ in 0..n {
            self.next(scalar)?;
        }
        Ok(())
    }

    fn place(&self) -> Place {
        self.0.place()
    }

    fn bytes_left(&self) -> u64 {
        // The last number need not be followed by a blank.
        self.0.rest().len() as u64 + 1
    }

    fn least(&self, _: Scalar) -> u64 {
        2
    }
}

struct Binary<'a, const LITTLE: bool> {
    bytes: &'a [u8],
    at: usize,
    path: &'a Path,
}

impl<const LITTLE: bool> Binary<'_, LITTLE> {
    #[inline]
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut a = *self.bytes.get(self.at..)?.first_chunk::<N>()?;
        if !LITTLE {
            a.reverse();
        }
        self.at += N;
        Some(a)
    }

    #[inline]
    fn value(&mut self, scalar: Scalar) -> Option<f64> {
        Some(match scalar {
            Scalar::I8 => f64::from(i8::from_le_bytes(self.array()?)),
            Scalar::U8 => f64::from(u8::from_le_bytes(self.array()?)),
            Scalar::I16 => f64::from(i16::from_le_bytes(self.array()?)),
            Scalar::U16 => f64::from(u16::from_le_bytes(self.array()?)),
            Scalar::I32 => f64::from(i32::from_le_bytes(self.array()?)),
            Scalar::U32 => f64::from(u32::from_le_bytes(self.array()?)),
            Scalar::F32 => f64::from(f32::from_le_bytes(self.array()?)),
            Scalar::F64 => f64::from_le_bytes(self.array()?),
        })
    }

    fn cut_off(&self) -> Error {
        Error::invalid(
            Place::byte(self.path, self.at as u64),
            "the file ends in the middle of its data; it may be cut off",
        )
    }
}

impl<const LITTLE: bool> Values for Binary<'_, LITTLE> {
    #[inline]
    fn next(&mut self, scalar: Scalar) -> Result<f64, Error> {
        self.value(scalar).ok_or_else(|| self.cut_off())
    }

    fn skip(&mut self, scalar: Scalar, n: u64) -> Result<(), Error> {
        let bytes = n.checked_mul(scalar.size() as u64).filter(|&b| b <= self.bytes_left());
        self.at += bytes.ok_or_else(|| self.cut_off())? as usize;
        Ok(())
    }

    fn place(&self) -> Place {
        Place::byte(self.path, self.at as u64)
    }

    fn bytes_left(&self) -> u64 {
        (self.bytes.len() - self.at) as u64
    }

    fn least(&self, scalar: Scalar) -> u64 {
        scalar.size() as u64
    }
}

fn body<V: Values>(mut v: V, elements: &[Element], mesh: &mut Mesh) -> Result<(), Error> {
    for e in elements {
        let least: u64 = e.properties.iter().map(|p| v.least(p.count.unwrap_or(p.value))).sum();
        if u128::from(e.count) * u128::from(least) > u128::from(v.bytes_left()) {
            let problem = format!(
                "the header claims {} of '{}', but only {} bytes are left",
                e.count,
                e.name,
                v.bytes_left()
            );
            return Err(Error::invalid(v.place(), problem));
        }
        match e.name.as_str() {
            "vertex" => vertices(&mut v, e, mesh)?,
            "face" => faces(&mut v, e, mesh)?,
            "tristrips" => strips(&mut v, e, mesh)?,
            // Nothing is stored for elements without properties, however many there are.
            _ if least == 0 => {}
            _ => {
                for _ in 0..e.count {
                    for p in &e.properties {
                        skip(&mut v, p)?;
                    }
                }
            }
        }
    }
    Ok(())
}

fn skip<V: Values>(v: &mut V, p: &Property) -> Result<(), Error> {
    let n = match p.count {
        Some(count) => length(v, count)?,
        None => 1,
    };
    v.skip(p.value, n)
}

/// The length of a list.
#[inline]
fn length<V: Values>(v: &mut V, count: Scalar) -> Result<u64, Error> {
    let n = v.next(count)?;
    if n >= 0.0 && n.fract() == 0.0 && n <= v.bytes_left() as f64 {
        return Ok(n as u64);
    }
    Err(Error::invalid(
        v.place(),
        format!("a list claims {n} entries, but only {} bytes are left", v.bytes_left()),
    ))
}

#[inline]
fn index<V: Values>(v: &mut V, scalar: Scalar) -> Result<u32, Error> {
    let i = v.next(scalar)?;
    // Whether the vertex exists is checked when all are known.
    if i >= 0.0 && i.fract() == 0.0 && i < f64::from(u32::MAX) {
        return Ok(i as u32);
    }
    Err(Error::invalid(v.place(), format!("expected the index of a vertex, found {i}")))
}

fn vertices<V: Values>(v: &mut V, e: &Element, mesh: &mut Mesh) -> Result<(), Error> {
    let (sinks, attributes) = sinks(e);
    for axis in 0..3 {
        if !sinks.iter().any(|s| matches!(s, Sink::Position(a) if *a == axis)) {
            return Err(Error::invalid(
                v.place(),
                format!("the vertices have no property '{}'", ["x", "y", "z"][axis]),
            ));
        }
    }
    if e.count >= u64::from(u32::MAX) {
        let (asked, limit) = (e.count, u64::from(u32::MAX) - 1);
        return Err(Error::TooLarge { at: v.place(), what: "the number of vertices".into(), asked, limit });
    }
    // Bounded by the size of the file, as was just checked.
    let n = e.count as usize;
    mesh.positions = vec![Vec3::ZERO; n];
    if sinks.iter().any(|s| matches!(s, Sink::Normal(_))) {
        mesh.normals = vec![Vec3::ZERO; n];
    }
    if sinks.iter().any(|s| matches!(s, Sink::Uv(_))) {
        mesh.uvs = vec![Vec2::ZERO; n];
    }
    mesh.attributes =
        attributes.into_iter().map(|(name, width)| (name, width, vec![0.0; n * width])).collect();
    for i in 0..n {
        for (p, sink) in e.properties.iter().zip(&sinks) {
            if p.count.is_some() {
                skip(v, p)?;
                continue;
            }
            let x = v.next(p.value)?;
            let single = x as f32;
            match *sink {
                Sink::Skip => continue,
                Sink::Position(a) => mesh.positions[i][a] = single,
                Sink::Normal(a) => mesh.normals[i][a] = single,
                Sink::Uv(a) => mesh.uvs[i][a] = single,
                Sink::Attribute(which, part, unit) => {
                    let (_, width, values) = &mut mesh.attributes[which];
                    // Whole numbers are stored colours, encoded for display.
                    values[i * *width + part] =
                        if unit == 1.0 { single } else { srgb_to_linear((x / unit) as f32) };
                }
            }
            if !single.is_finite() {
                let problem =
                    format!("'{}' of vertex {i} is {x}; expected a finite single-precision number", p.name);
                return Err(Error::invalid(v.place(), problem));
            }
        }
    }
    for normal in &mut mesh.normals {
        *normal = normal.normalize_or_zero();
    }
    Ok(())
}

/// Where each property of a vertex goes, and the attributes with their widths.
fn sinks(e: &Element) -> (Vec<Sink>, Vec<(String, usize)>) {
    let has = |n: &str| e.properties.iter().any(|p| p.name == n && p.count.is_none());
    let all = |names: &[&'static str]| names.iter().all(|n| has(n));
    let normals: &[&str] = if all(&["nx", "ny", "nz"]) { &["nx", "ny", "nz"] } else { &[] };
    let uvs = [["u", "v"], ["texture_u", "texture_v"], ["s", "t"]].into_iter().find(|names| all(names));
    let uvs: &[&str] = uvs.as_ref().map_or(&[], |u| u);
    let colours = [["r", "g", "b"], ["red", "green", "blue"]].into_iter().find(|names| all(names));
    let mut attributes: Vec<(String, usize)> = Vec::new();
    if colours.is_some() {
        attributes.push(("vertex_color".into(), 3));
    }
    let colours: &[&str] = colours.as_ref().map_or(&[], |c| c);
    let mut out = Vec::new();
    let mut i = 0;
    while i < e.properties.len() {
        let p = &e.properties[i];
        let place = |names: &[&str]| names.iter().position(|n| *n == p.name).filter(|_| p.count.is_none());
        out.push(if let Some(a) = place(&["x", "y", "z"]) {
            Sink::Position(a)
        } else if let Some(a) = place(normals) {
            Sink::Normal(a)
        } else if let Some(a) = place(uvs) {
            Sink::Uv(a)
        } else if let Some(a) = place(colours) {
            Sink::Attribute(0, a, p.value.unit())
        } else if let Some((name, n)) = group(&e.properties[i..]) {
            // One number or a colour; a fourth component is an alpha nobody reads.
            let width = if n >= 3 { 3 } else { 1 };
            for part in 0..n {
                let unit = e.properties[i + part].value.unit();
                out.push(if part < width {
                    Sink::Attribute(attributes.len(), part, unit)
                } else {
                    Sink::Skip
                });
            }
            attributes.push((format!("vertex_{name}"), width));
            i += n;
            continue;
        } else {
            Sink::Skip
        });
        i += 1;
    }
    (out, attributes)
}

/// Neighbours such as `warmth_r`, `warmth_g`, `warmth_b`: the name of the attribute and how many they are.
fn group(properties: &[Property]) -> Option<(String, usize)> {
    let (prefix, first) = properties[0].name.rsplit_once('_')?;
    let ends = [["r", "g", "b", "a"], ["x", "y", "z", "w"], ["0", "1", "2", "3"], ["1", "2", "3", "4"]];
    let (k, ends) = ends.iter().enumerate().find(|(_, e)| e[0] == first)?;
    let belongs =
        |(p, end): (&Property, &&str)| p.count.is_none() && p.name.rsplit_once('_') == Some((prefix, *end));
    let n = properties.iter().zip(ends).take_while(|pair| belongs((pair.0, pair.1))).count();
    let name = if k == 0 { format!("{prefix}_color") } else { prefix.to_string() };
    (n == 1 || n >= 3).then_some((name, n))
}

fn corners<'e, V: Values>(v: &V, e: &'e Element) -> Result<&'e Property, Error> {
    let is =
        |p: &&Property| matches!(p.name.as_str(), "vertex_indices" | "vertex_index") && p.count.is_some();
    let problem = || format!("the element '{}' has no list 'vertex_indices'", e.name);
    e.properties.iter().find(is).ok_or_else(|| Error::invalid(v.place(), problem()))
}

fn faces<V: Values>(v: &mut V, e: &Element, mesh: &mut Mesh) -> Result<(), Error> {
    let name = corners(v, e)?.name.clone();
    mesh.triangles.reserve(e.count as usize);
    for i in 0..e.count {
        for p in &e.properties {
            let Some(count) = p.count.filter(|_| p.name == name) else {
                skip(v, p)?;
                continue;
            };
            let n = length(v, count)?;
            if n < 3 {
                return Err(Error::invalid(
                    v.place(),
                    format!("face {i} has {n} corners; expected at least 3"),
                ));
            }
            let (first, mut last) = (index(v, p.value)?, index(v, p.value)?);
            for _ in 2..n {
                let next = index(v, p.value)?;
                mesh.triangles.push([first, last, next]);
                last = next;
            }
        }
    }
    Ok(())
}

/// Strips, separated by −1 in one list; every second triangle runs the other way round.
fn strips<V: Values>(v: &mut V, e: &Element, mesh: &mut Mesh) -> Result<(), Error> {
    let name = corners(v, e)?.name.clone();
    for _ in 0..e.count {
        for p in &e.properties {
            let Some(count) = p.count.filter(|_| p.name == name) else {
                skip(v, p)?;
                continue;
            };
            let n = length(v, count)?;
            let mut strip: Vec<u32> = Vec::new();
            for _ in 0..n {
                let i = v.next(p.value)?;
                if i == -1.0 {
                    strip.clear();
                    continue;
                }
                if !(i >= 0.0 && i.fract() == 0.0 && i < f64::from(u32::MAX)) {
                    return Err(Error::invalid(
                        v.place(),
                        format!("expected the index of a vertex or -1, found {i}"),
                    ));
                }
                strip.push(i as u32);
                if let [.., a, b, c] = strip[..] {
                    mesh.triangles.push(if strip.len() % 2 == 1 { [a, b, c] } else { [b, a, c] });
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
pub(crate) mod tests {
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

    #[test]
    fn mistakes_are_named_with_their_place() {
        let vertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
        let face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
        let text = |h: &str| {
            read(format!("ply\nformat ascii 1.0\n{h}").as_bytes(), Path::new("a.ply"))
                .unwrap_err()
                .to_string()
        };
        for (h, message) in [
            (
                format!("{vertex}{face}0 0 0 1 0 0 0 1 0 3 0 1 3"),
                "a.ply: triangle 0 has the corners [0, 1, 3], but there are 3 vertices",
            ),
            (
                format!("{vertex}{face}0 0 0 1 0 0 0 1 0 2 0 1"),
                "a.ply:10:20: face 0 has 2 corners; expected at least 3",
            ),
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
}
