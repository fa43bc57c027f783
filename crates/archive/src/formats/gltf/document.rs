//! A glTF file: its JSON and the buffers behind it.

use super::features::{KHR_MESHOPT, MESHOPT};
use super::meshopt::{self, Packing};
use super::schema::{Head, Root};
use crate::formats::folders::Folders;
use crate::formats::{json, read_file};
use crate::{Error, Place};
use serde::Deserialize;
use std::collections::HashMap;
use std::path::Path;

/// The most numbers that an accessor without data may ask for: it costs the file nothing.
const MAX_ZEROS: usize = 1 << 24;

/// The most bytes that packed views may come to, all together: as many as the largest meshes have.
const MAX_UNPACKED: usize = 1 << 31;

/// The JSON and the bytes it speaks of.
pub(super) struct Document {
    pub root: Root,
    pub at: Place,
    buffers: Vec<Vec<u8>>,
    /// What the buffer views hold that are packed.
    unpacked: HashMap<usize, Vec<u8>>,
}

impl Document {
    pub fn read(bytes: &[u8], path: &Path, folders: &Folders) -> Result<Self, Error> {
        let (json, offset, mut binary) = match bytes.strip_prefix(b"glTF") {
            Some(_) => {
                let (json, binary) = split_glb(bytes, path)?;
                (json, 20, binary)
            }
            None if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb")) => {
                let problem =
                    "a .glb file starts with 'glTF'; this is another format, or glTF as text (.gltf)";
                return Err(Error::invalid(Place::byte(path, 0), problem));
            }
            // A byte-order mark is not wanted there, but written.
            None => (bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), 0, None),
        };
        if let Ok(head) = serde_json::from_slice::<Head>(json)
            && head.asset.version.starts_with("1.")
        {
            let problem = format!(
                "this is glTF {}, an older format with another layout; convert it to glTF 2.0, for example with \
                 gltf-pipeline",
                head.asset.version
            );
            return Err(Error::invalid(Place::file(path), problem));
        }
        let mut deserializer = serde_json::Deserializer::from_slice(json);
        let root = Root::deserialize(&mut deserializer).map_err(|e| {
            // In a .glb the lines are those of the JSON inside, which is one line as a rule.
            let at = if offset == 0 {
                Place::line(path, e.line().max(1), e.column().max(1))
            } else {
                Place::byte(path, (offset + e.column()) as u64)
            };
            Error::invalid(at, format!("this is no glTF: {}", json::problem(&e)))
        })?;
        let mut document =
            Self { root, at: Place::file(path), buffers: Vec::new(), unpacked: HashMap::new() };
        for (i, buffer) in document.root.buffers.iter().enumerate() {
            if buffer.uri.is_none() && i > 0 {
                if buffer.extensions.khr_meshopt.is_some() {
                    return Err(super::features::packed(&document, KHR_MESHOPT));
                }
                if buffer.extensions.ext_meshopt.is_some() {
                    // Stands for what its views are unpacked to.
                    document.buffers.push(Vec::new());
                    continue;
                }
            }
            let mut data = match &buffer.uri {
                Some(uri) => document.fetch(uri, folders)?,
                None if i == 0 => binary.take().map(<[u8]>::to_vec).unwrap_or_default(),
                None => Vec::new(),
            };
            if data.len() < buffer.byte_length {
                let problem =
                    format!("buffer {i} has {} bytes, not the {} it should", data.len(), buffer.byte_length);
                return Err(document.invalid(problem));
            }
            data.truncate(buffer.byte_length);
            document.buffers.push(data);
        }
        document.unpack()?;
        Ok(document)
    }

    /// Unpacks the buffer views that EXT_meshopt_compression has packed.
    fn unpack(&mut self) -> Result<(), Error> {
        let mut unpacked = HashMap::new();
        // Many views may be packed in the same bytes.
        let mut total = 0usize;
        for (i, view) in self.root.buffer_views.iter().enumerate() {
            let Some(p) = &view.extensions.ext_meshopt else { continue };
            let buffer = self.entry(&self.buffers, p.buffer, "buffer")?;
            let end = p.byte_offset.checked_add(p.byte_length);
            let data = end.and_then(|end| buffer.get(p.byte_offset..end)).ok_or_else(|| {
                self.invalid(format!("buffer view {i} is packed beyond its buffer of {} bytes", buffer.len()))
            })?;
            total = total.saturating_add(p.count.saturating_mul(p.byte_stride));
            if total > MAX_UNPACKED {
                return Err(Error::TooLarge {
                    at: self.at.clone(),
                    what: format!("what is packed by {MESHOPT}, in bytes,"),
                    asked: total as u64,
                    limit: MAX_UNPACKED as u64,
                });
            }
            let packing = Packing { count: p.count, stride: p.byte_stride, mode: &p.mode, filter: &p.filter };
            let data = meshopt::decode(data, &packing).map_err(|problem| {
                self.invalid(format!(
                    "buffer view {i}, packed by {MESHOPT}, {problem}; unpack the file with `gltf-transform copy`"
                ))
            })?;
            unpacked.insert(i, data);
        }
        self.unpacked = unpacked;
        Ok(())
    }

    pub fn invalid(&self, problem: impl Into<String>) -> Error {
        Error::invalid(self.at.clone(), problem)
    }

    /// Element `index` of a list of the file.
    pub fn entry<'a, T>(&self, list: &'a [T], index: usize, what: &str) -> Result<&'a T, Error> {
        list.get(index)
            .ok_or_else(|| self.invalid(format!("there is no {what} {index}; the file has {}", list.len())))
    }

    /// The bytes a URI stands for: in itself, or of a file beside this one.
    pub fn fetch(&self, uri: &str, folders: &Folders) -> Result<Vec<u8>, Error> {
        match uri.strip_prefix("data:") {
            Some(data) => {
                let (_, data) =
                    data.split_once(";base64,").ok_or_else(|| self.invalid("a data URI is not in base64"))?;
                base64(data).ok_or_else(|| self.invalid("a data URI is not proper base64"))
            }
            None => read_file(&folders.find(&percent_decode(uri), self.at.clone())?),
        }
    }

    pub fn view(&self, index: usize) -> Result<&[u8], Error> {
        let view = self.entry(&self.root.buffer_views, index, "buffer view")?;
        if let Some(data) = self.unpacked.get(&index) {
            return Ok(data);
        }
        let buffer = self.entry(&self.buffers, view.buffer, "buffer")?;
        let end = view.byte_offset.checked_add(view.byte_length);
        end.and_then(|end| buffer.get(view.byte_offset..end)).ok_or_else(|| {
            self.invalid(format!("buffer view {index} goes beyond its buffer of {} bytes", buffer.len()))
        })
    }

    /// `count` elements of `size` bytes each, packed, from a place in a view; `stride` bytes from one to the next.
    fn gather(
        &self,
        view: usize,
        offset: usize,
        stride: usize,
        count: usize,
        size: usize,
    ) -> Result<Vec<u8>, Error> {
        let bytes = self.view(view)?;
        let fits = count == 0
            || (count - 1)
                .checked_mul(stride)
                .and_then(|n| n.checked_add(size)?.checked_add(offset))
                .is_some_and(|end| end <= bytes.len());
        // A stride of zero would make much of little.
        if !fits || stride < size {
            let problem = format!(
                "{count} elements of {size} bytes, {stride} apart, from byte {offset} on do not lie within buffer view {view} of {} bytes",
                bytes.len()
            );
            return Err(self.invalid(problem));
        }
        let each = (0..count).map(|i| &bytes[offset + i * stride..offset + i * stride + size]);
        Ok(each.collect::<Vec<_>>().concat())
    }

    /// The packed bytes of an accessor of `width` components per element, and the size of a component.
    fn packed(&self, index: usize, width: usize) -> Result<(Vec<u8>, usize), Error> {
        let a = self.entry(&self.root.accessors, index, "accessor")?;
        let size = component_size(a.component_type)
            .filter(|_| shape_width(&a.shape) == Some(width))
            .ok_or_else(|| {
                let problem = format!(
                    "accessor {index} holds {} of component type {}; expected {width} components",
                    a.shape, a.component_type
                );
                self.invalid(problem)
            })?;
        let wide = width * size;
        let mut bytes = match a.buffer_view {
            Some(view) => {
                let stride =
                    self.entry(&self.root.buffer_views, view, "buffer view")?.byte_stride.unwrap_or(wide);
                self.gather(view, a.byte_offset, stride, a.count, wide)?
            }
            None if a.count.saturating_mul(width) > MAX_ZEROS => {
                let at = self.at.clone();
                let what = format!("the size of accessor {index}, which has no data,");
                return Err(Error::TooLarge {
                    at,
                    what,
                    asked: a.count as u64,
                    limit: (MAX_ZEROS / width) as u64,
                });
            }
            None => vec![0; a.count * wide],
        };
        if let Some(sparse) = &a.sparse {
            let Some(index_size) = component_size(sparse.indices.component_type) else {
                return Err(
                    self.invalid(format!("the sparse indices of accessor {index} have no known type"))
                );
            };
            let from = &sparse.indices;
            let indices =
                self.gather(from.buffer_view, from.byte_offset, index_size, sparse.count, index_size)?;
            let values =
                self.gather(sparse.values.buffer_view, sparse.values.byte_offset, wide, sparse.count, wide)?;
            for (i, value) in indices.chunks_exact(index_size).zip(values.chunks_exact(wide)) {
                let element = unsigned(i) as usize;
                let Some(slot) = bytes.get_mut(element * wide..(element + 1) * wide) else {
                    return Err(self.invalid(format!(
                        "accessor {index} replaces its element {element}, but has only {}",
                        a.count
                    )));
                };
                slot.copy_from_slice(value);
            }
        }
        Ok((bytes, size))
    }

    /// The numbers of an accessor, `width` per element.
    pub fn floats(&self, index: usize, width: usize) -> Result<Vec<f32>, Error> {
        let (bytes, size) = self.packed(index, width)?;
        let a = &self.root.accessors[index];
        let values: Vec<f32> =
            bytes.chunks_exact(size).map(|c| component(c, a.component_type, a.normalized)).collect();
        if values.iter().any(|v| !v.is_finite()) {
            return Err(
                self.invalid(format!("accessor {index} holds values that are not finite; expected numbers"))
            );
        }
        Ok(values)
    }

    /// The indices of an accessor, `width` per element.
    pub fn indices(&self, index: usize, width: usize) -> Result<Vec<u32>, Error> {
        let (bytes, size) = self.packed(index, width)?;
        Ok(bytes.chunks_exact(size).map(unsigned).collect())
    }

    /// Components per element.
    pub fn width(&self, index: usize) -> Result<usize, Error> {
        let a = self.entry(&self.root.accessors, index, "accessor")?;
        shape_width(&a.shape)
            .ok_or_else(|| self.invalid(format!("accessor {index} is of the unknown type '{}'", a.shape)))
    }
}

fn shape_width(shape: &str) -> Option<usize> {
    Some(match shape {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" | "MAT2" => 4,
        "MAT3" => 9,
        "MAT4" => 16,
        _ => return None,
    })
}

fn component_size(component_type: u32) -> Option<usize> {
    Some(match component_type {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        5125 | 5126 => 4,
        _ => return None,
    })
}

fn unsigned(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |v, &b| v << 8 | u32::from(b))
}

/// glTF 2.0, 3.11: normalised integers stand for [0, 1] or [−1, 1].
fn component(bytes: &[u8], component_type: u32, normalized: bool) -> f32 {
    let raw = unsigned(bytes);
    let (value, max) = match component_type {
        5120 => (f32::from(raw as u8 as i8), 127.0),
        5121 => (raw as f32, 255.0),
        5122 => (f32::from(raw as u16 as i16), 32767.0),
        5123 => (raw as f32, 65535.0),
        5126 => return f32::from_bits(raw),
        _ => return raw as f32,
    };
    if normalized { (value / max).max(-1.0) } else { value }
}

/// The JSON and the binary chunk of a .glb file.
fn split_glb<'a>(bytes: &'a [u8], path: &Path) -> Result<(&'a [u8], Option<&'a [u8]>), Error> {
    let word = |at: usize| bytes.get(at..at + 4).map(unsigned);
    let invalid = |at: usize, problem: &str| Error::invalid(Place::byte(path, at as u64), problem);
    if word(4) != Some(2) {
        return Err(invalid(4, "this is no binary glTF of version 2"));
    }
    let chunk = |at: usize, kind: &[u8; 4]| {
        let length = word(at)? as usize;
        (bytes.get(at + 4..at + 8)? == kind).then(|| bytes.get(at + 8..)?.get(..length)).flatten()
    };
    let json = chunk(12, b"JSON").ok_or_else(|| {
        invalid(
            12,
            "expected a JSON chunk that ends within the file; it is cut short, fetch or export it again",
        )
    })?;
    let next = 20 + json.len().next_multiple_of(4);
    match chunk(next, b"BIN\0") {
        Some(binary) => Ok((json, Some(binary))),
        None if word(next).is_none() || bytes.get(next + 4..next + 8) != Some(b"BIN\0") => Ok((json, None)),
        None => Err(invalid(next, "the binary chunk goes beyond the end of the file; it is cut off")),
    }
}

/// RFC 4648, section 4; `None` for anything else.
fn base64(text: &str) -> Option<Vec<u8>> {
    let text = text.trim_end_matches('=').as_bytes();
    let mut out = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for group in text.chunks(4) {
        let mut bits = 0u32;
        for &c in group {
            let value = match c {
                b'A'..=b'Z' => c - b'A',
                b'a'..=b'z' => c - b'a' + 26,
                b'0'..=b'9' => c - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(value);
        }
        bits <<= 6 * (4 - group.len());
        let bytes = match group.len() {
            4 => 3,
            3 => 2,
            2 => 1,
            _ => return None,
        };
        out.extend_from_slice(&bits.to_be_bytes()[1..=bytes]);
    }
    Some(out)
}

/// RFC 3986, section 2.1; what is no proper escape stays as it is.
fn percent_decode(text: &str) -> String {
    let mut out = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let [first, tail @ ..] = rest {
        let hex = (*first == b'%').then(|| tail.get(..2)).flatten().and_then(|h| std::str::from_utf8(h).ok());
        let code = hex
            .filter(|h| h.bytes().all(|b| b.is_ascii_hexdigit()))
            .and_then(|h| u8::from_str_radix(h, 16).ok());
        out.push(code.unwrap_or(*first));
        rest = if code.is_some() { &tail[2..] } else { tail };
    }
    String::from_utf8_lossy(&out).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_and_escapes_as_in_the_rfcs() {
        // RFC 4648, section 10.
        for (text, code) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(code).unwrap(), text.as_bytes());
        }
        assert_eq!(base64("Zg*="), None);
        assert_eq!(base64("Z"), None);
        assert_eq!(percent_decode("a%20b%2gc%"), "a b%2gc%");
        assert_eq!(component(&[0x81], 5120, true), -1.0);
        assert_eq!(component(&[0xff, 0x7f], 5122, true), 1.0);
    }
}
