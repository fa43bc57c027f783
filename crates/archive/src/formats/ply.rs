//! The Polygon File Format (PLY): text and binary of either byte order.
//!
//! Turk 1994. Polygons and strips (`tristrips`) become triangles. Properties of vertices beyond position, normal and
//! (u, v), and those of faces, become attributes with the names Mitsuba gives them: `vertex_color`, `face_color`. Texture
//! coordinates of the corners of faces (`texcoord`) go before those of vertices; corners that differ in them become
//! vertices of their own.

mod header;
#[cfg(test)]
pub(crate) mod tests;
mod values;
mod write;

pub use write::write_bytes;

use super::corners::Corners;
use super::numbers::Scanner;
use super::support::{Feature, Support, find};
use crate::{Error, Place};
use glam::{Vec2, Vec3};
use header::{Element, Encoding, MAX_HEADER, Property, Scalar, header};
use std::path::Path;
use values::{Binary, Text, Values};
use yugen_optics::colour::srgb_to_linear;
use yugen_scene::{Mesh, polygon};

const ONE_PICTURE: &str = "all faces have one material; split the mesh by its pictures";

/// Elements and properties.
pub const FEATURES: &[Feature] = &[
    Feature::yes("format ascii"),
    Feature::yes("format binary_little_endian"),
    Feature::yes("format binary_big_endian"),
    Feature::yes("vertex"),
    Feature::yes("vertex: x, y, z"),
    Feature::yes("vertex: nx, ny, nz"),
    Feature::partly("vertex: u, v; s, t; texture_u, texture_v", "v runs down, as in Mitsuba's files"),
    Feature::yes("vertex: red, green, blue; diffuse_red, …; r, g, b"),
    Feature::yes("vertex: NAME_r, NAME_g, NAME_b; NAME_x, …; NAME_0, …"),
    Feature::yes("face"),
    Feature::yes("face: vertex_indices, vertex_index"),
    Feature::partly("face: texcoord", "v runs up, as MeshLab has it; one picture for all faces"),
    Feature::yes("face: red, green, blue"),
    Feature::yes("face: NAME_r, NAME_g, NAME_b"),
    Feature::partly("alpha", "use an opacity"),
    Feature::no("texnumber", ONE_PICTURE),
    Feature::no("material_index", ONE_PICTURE),
    Feature::yes("tristrips"),
    Feature::no("edge", "a line has no surface"),
    Feature::no("material", "name a material in the scene"),
    Feature::no("multi_texture_vertex", ONE_PICTURE),
    Feature::no("multi_texture_face", ONE_PICTURE),
];

/// The most attributes of faces that are kept: each is repeated for every triangle of a polygon.
const MAX_FACE_ATTRIBUTES: usize = 8;

/// Where the value of a property goes.
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
    let mut faces = match encoding {
        Encoding::Text => body(Text(Scanner::resume(bytes, &s)), &elements, &mut mesh)?,
        Encoding::Little => body(Binary::<true> { bytes, at: start, path }, &elements, &mut mesh)?,
        Encoding::Big => body(Binary::<false> { bytes, at: start, path }, &elements, &mut mesh)?,
    };
    if mesh.triangles.is_empty() {
        return Err(Error::invalid(Place::file(path), "the file has no faces; a point cloud is no mesh"));
    }
    let vertices = mesh.positions.len();
    let vertex_of = |corner: u32| match &faces.corners {
        Some(corners) => corners.keys[corner as usize][0],
        None => corner,
    };
    if let Some((i, t)) =
        mesh.triangles.iter().enumerate().find(|(_, t)| t.iter().any(|&v| vertex_of(v) as usize >= vertices))
    {
        let t = t.map(vertex_of);
        let problem =
            format!("triangle {i} has the corners {t:?}, but there are {vertices} vertices, counted from 0");
        return Err(Error::invalid(Place::file(path), problem));
    }
    if let Some(corners) = &faces.corners {
        // Strips may name vertices that come into no triangle.
        if let Some([vertex, ..]) = corners.keys.iter().find(|k| k[0] as usize >= vertices) {
            let problem =
                format!("a strip has the corner {vertex}, but there are {vertices} vertices, counted from 0");
            return Err(Error::invalid(Place::file(path), problem));
        }
        let of = |k: &[u32; 3]| k[0] as usize;
        mesh.positions = corners.keys.iter().map(|k| mesh.positions[of(k)]).collect();
        if !mesh.normals.is_empty() {
            mesh.normals = corners.keys.iter().map(|k| mesh.normals[of(k)]).collect();
        }
        for (_, width, values) in &mut mesh.attributes {
            *values =
                corners.keys.iter().flat_map(|k| &values[of(k) * *width..][..*width]).copied().collect();
        }
        mesh.uvs =
            corners.keys.iter().map(|k| Vec2::new(f32::from_bits(k[1]), f32::from_bits(k[2]))).collect();
    }
    for [first, count] in std::mem::take(&mut faces.polygons) {
        let clean = polygon::cut(&mesh.positions, &mut mesh.triangles[first..first + count]);
        faces.crossed += usize::from(!clean);
    }
    say_omissions(&elements, &faces, path);
    for (name, width, values) in faces.attributes {
        // Strips have triangles that are no faces.
        if values.len() == width * mesh.triangles.len() {
            mesh.attributes.push((name, width, values));
        } else {
            tracing::warn!("{}: beside strips the attribute '{name}' of faces is skipped", path.display());
        }
    }
    if mesh.normals.contains(&Vec3::ZERO) {
        mesh.complete_normals(glam::Mat3::IDENTITY);
    }
    Ok(mesh)
}

/// What faces bring besides triangles.
#[derive(Default)]
struct Faces {
    /// Of those with more than three corners: the first triangle and how many there are.
    polygons: Vec<[usize; 2]>,
    /// Where corners have texture coordinates, what the triangles count: vertex, and the bits of u and v.
    corners: Option<Corners>,
    /// One value for each triangle.
    attributes: Vec<(String, usize, Vec<f32>)>,
    /// Faces of fewer than three corners.
    thin: usize,
    /// Faces whose outlines cross themselves.
    crossed: usize,
    /// Lists of texture coordinates that are not two numbers for each corner.
    unmapped: usize,
}

/// Says once for each kind of thing that is not read why.
fn say_omissions(elements: &[Element], faces: &Faces, path: &Path) {
    let path = path.display();
    let properties = elements.iter().flat_map(|e| &e.properties).map(|p| &p.name);
    let mut names: Vec<&String> = elements.iter().map(|e| &e.name).chain(properties).collect();
    names.sort();
    names.dedup();
    for name in names {
        if let Some(Support::No(why)) = find(FEATURES, name).map(|f| f.support) {
            tracing::warn!("{path}: '{name}' is skipped: {why}");
        }
    }
    if faces.thin > 0 {
        tracing::warn!("{path}: faces of fewer than three corners are skipped: {}", faces.thin);
    }
    if faces.crossed > 0 {
        let crossed = faces.crossed;
        tracing::warn!(
            "{path}: faces that cross themselves are cut into triangles as well as can be: {crossed}"
        );
    }
    if faces.unmapped > 0 {
        tracing::warn!(
            "{path}: faces whose 'texcoord' has not two numbers for each corner have (0, 0): {}",
            faces.unmapped
        );
    }
}

fn body<V: Values>(mut v: V, elements: &[Element], mesh: &mut Mesh) -> Result<Faces, Error> {
    let mut all = Faces::default();
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
            "face" => faces(&mut v, e, mesh, &mut all)?,
            "tristrips" => strips(&mut v, e, mesh, &mut all)?,
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
    Ok(all)
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
    let (sinks, attributes) = sinks(e, "vertex");
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

/// Where each property of a vertex or a face goes, and the attributes with their widths.
fn sinks(e: &Element, domain: &str) -> (Vec<Sink>, Vec<(String, usize)>) {
    let vertex = domain == "vertex";
    let has = |n: &str| e.properties.iter().any(|p| p.name == n && p.count.is_none());
    let all = |names: &[&'static str]| names.iter().all(|n| has(n));
    let positions: &[&str] = if vertex { &["x", "y", "z"] } else { &[] };
    let normals: &[&str] = if vertex && all(&["nx", "ny", "nz"]) { &["nx", "ny", "nz"] } else { &[] };
    let uvs =
        [["u", "v"], ["texture_u", "texture_v"], ["s", "t"]].into_iter().find(|names| vertex && all(names));
    let uvs: &[&str] = uvs.as_ref().map_or(&[], |u| u);
    let colours =
        [["r", "g", "b"], ["red", "green", "blue"], ["diffuse_red", "diffuse_green", "diffuse_blue"]];
    let colours = colours.into_iter().find(|names| all(names));
    let mut attributes: Vec<(String, usize)> = Vec::new();
    if colours.is_some() {
        attributes.push((format!("{domain}_color"), 3));
    }
    let colours: &[&str] = colours.as_ref().map_or(&[], |c| c);
    let mut out = Vec::new();
    let mut i = 0;
    while i < e.properties.len() {
        let p = &e.properties[i];
        let place = |names: &[&str]| names.iter().position(|n| *n == p.name).filter(|_| p.count.is_none());
        out.push(if let Some(a) = place(positions) {
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
            attributes.push((format!("{domain}_{name}"), width));
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

fn faces<V: Values>(v: &mut V, e: &Element, mesh: &mut Mesh, all: &mut Faces) -> Result<(), Error> {
    let name = corners(v, e)?.name.clone();
    let (sinks, attributes) = sinks(e, "face");
    // Strips that came before have no values, and count vertices instead of corners.
    let whole = mesh.triangles.is_empty();
    let most = if whole { MAX_FACE_ATTRIBUTES } else { 0 };
    all.attributes =
        attributes.into_iter().take(most).map(|(name, width)| (name, width, Vec::new())).collect();
    let wedges = e.properties.iter().position(|p| whole && p.name == "texcoord" && p.count.is_some());
    if wedges.is_some() {
        all.corners = Some(Corners::default());
    }
    mesh.triangles.reserve(e.count as usize);
    let (mut polygon, mut uvs) = (Vec::new(), Vec::new());
    for i in 0..e.count {
        polygon.clear();
        uvs.clear();
        for (at, (p, sink)) in e.properties.iter().zip(&sinks).enumerate() {
            match (p.count, *sink) {
                (Some(count), _) if p.name == name => {
                    let n = length(v, count)?;
                    for _ in 0..n {
                        polygon.push(index(v, p.value)?);
                    }
                }
                (Some(count), _) if Some(at) == wedges => {
                    let n = length(v, count)?;
                    for _ in 0..n {
                        uvs.push(v.next(p.value)? as f32);
                    }
                }
                (None, Sink::Attribute(which, part, unit)) if which < all.attributes.len() => {
                    let x = v.next(p.value)?;
                    let value = if unit == 1.0 { x as f32 } else { srgb_to_linear((x / unit) as f32) };
                    if !value.is_finite() {
                        let problem = format!(
                            "'{}' of face {i} is {x}; expected a finite single-precision number",
                            p.name
                        );
                        return Err(Error::invalid(v.place(), problem));
                    }
                    let (_, width, values) = &mut all.attributes[which];
                    let row = *width * mesh.triangles.len();
                    values.resize(row + *width, 0.0);
                    values[row + part] = value;
                }
                _ => skip(v, p)?,
            }
        }
        let triangles = polygon.len().saturating_sub(2);
        if triangles == 0 {
            all.thin += 1;
        }
        for (_, width, values) in &mut all.attributes {
            let row = *width * mesh.triangles.len();
            if triangles == 0 {
                values.truncate(row);
            }
            for _ in 1..triangles {
                values.extend_from_within(row..row + *width);
            }
        }
        if let Some(corners) = &mut all.corners {
            let mapped = uvs.len() == 2 * polygon.len() && uvs.iter().all(|x| x.is_finite());
            all.unmapped += usize::from(!mapped && triangles > 0);
            let kept = if triangles > 0 { &mut polygon[..] } else { &mut [] };
            for (k, vertex) in kept.iter_mut().enumerate() {
                let uv = if mapped { [uvs[2 * k], 1.0 - uvs[2 * k + 1]] } else { [0.0; 2] };
                *vertex = corners.find([*vertex, uv[0].to_bits(), uv[1].to_bits()]);
            }
        }
        if triangles > 1 {
            all.polygons.push([mesh.triangles.len(), triangles]);
        }
        for k in 2..polygon.len() {
            mesh.triangles.push([polygon[0], polygon[k - 1], polygon[k]]);
        }
    }
    Ok(())
}

/// Strips, separated by −1 in one list; every second triangle runs the other way round.
fn strips<V: Values>(v: &mut V, e: &Element, mesh: &mut Mesh, all: &mut Faces) -> Result<(), Error> {
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
                strip.push(match &mut all.corners {
                    Some(corners) => corners.find([i as u32, 0, 0]),
                    None => i as u32,
                });
                if let [.., a, b, c] = strip[..] {
                    mesh.triangles.push(if strip.len() % 2 == 1 { [a, b, c] } else { [b, a, c] });
                }
            }
        }
    }
    Ok(())
}
