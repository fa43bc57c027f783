//! The Polygon File Format (PLY): text and binary of either byte order.
//!
//! Turk 1994. Polygons become fans of triangles; strips (`tristrips`) become their triangles. Properties of
//! vertices beyond position, normal and (u, v) become attributes with the names Mitsuba gives them.

mod header;
#[cfg(test)]
pub(crate) mod tests;
mod values;

use super::numbers::Scanner;
use crate::scene::Mesh;
use crate::{Error, Place};
use glam::{Vec2, Vec3};
use header::{Element, Encoding, MAX_HEADER, Property, Scalar, header};
use std::path::Path;
use values::{Binary, Text, Values};
use yugen_optics::colour::srgb_to_linear;

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
