//! What a PLY file says it holds.

use crate::formats::numbers::Scanner;
use crate::{Error, Place};

/// A header longer than this is none.
pub(super) const MAX_HEADER: usize = 1 << 20;
/// Elements of a file, and properties of an element.
const MAX_NAMES: usize = 256;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Scalar {
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

    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The largest value of a whole type, 1 for others: what a stored colour is divided by.
    pub(super) fn unit(self) -> f64 {
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
pub(super) struct Property {
    pub(super) name: String,
    /// The type of the count, for a list.
    pub(super) count: Option<Scalar>,
    pub(super) value: Scalar,
}

#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Encoding {
    Text,
    Little,
    Big,
}

/// Reads the header: how values are written, and of what.
pub(super) fn header(s: &mut Scanner) -> Result<(Encoding, Vec<Element>), Error> {
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
