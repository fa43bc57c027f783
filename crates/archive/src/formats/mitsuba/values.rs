//! The values of properties: numbers, vectors, colours, spectra and transforms, from the text of their attributes.

use super::document::{At, ELEMENTS, Spectrum, Value};
use super::reader::{Attributes, Context, Reader};
use crate::formats::{numbers, read_file};
use crate::{Error, Place};
use glam::{DMat4, DVec3};
use roxmltree::Node;
use std::path::Path;

const TRANSFORMS: &[&str] = &["translate", "rotate", "scale", "lookat", "matrix"];

impl Reader {
    /// The value of a property element, with its attributes.
    pub(super) fn value(&mut self, node: Node, c: Context) -> Result<(Attributes, Value), Error> {
        let tag = node.tag_name().name();
        let plain = ["name", "value"];
        let a = match tag {
            "boolean" | "integer" | "float" | "string" | "rgb" => self.attributes(node, c, &plain)?,
            "point" | "vector" => self.attributes(node, c, &["name", "value", "x", "y", "z"])?,
            "spectrum" => self.attributes(node, c, &["name", "value", "filename"])?,
            "ref" => self.attributes(node, c, &["name", "id"])?,
            "transform" => self.attributes(node, c, &["name"])?,
            _ if TRANSFORMS.contains(&tag) => {
                let at = At { file: c.file, byte: node.range().start };
                return Err(self.invalid(at, format!("<{tag}> can only stand in a <transform>")));
            }
            _ => {
                let at = At { file: c.file, byte: node.range().start };
                return Err(self.unknown(at, "element", tag, ELEMENTS.iter().copied()));
            }
        };
        let value = match tag {
            "boolean" => {
                let (text, at) = self.required(&a, "value")?;
                match text.trim().to_ascii_lowercase().as_str() {
                    "true" => Value::Boolean(true),
                    "false" => Value::Boolean(false),
                    _ => {
                        return Err(
                            self.invalid(at, format!("expected 'true' or 'false', found '{}'", shown(text)))
                        );
                    }
                }
            }
            "integer" => {
                let (text, at) = self.required(&a, "value")?;
                let value = text.trim().parse();
                Value::Integer(value.map_err(|_| {
                    self.invalid(at, format!("expected a whole number, found '{}'", shown(text)))
                })?)
            }
            "float" => {
                let (text, at) = self.required(&a, "value")?;
                Value::Float(self.number(text, at)?)
            }
            "string" => Value::String(self.required(&a, "value")?.0.to_string()),
            "ref" => Value::Reference(self.required(&a, "id")?.0.to_string()),
            "rgb" => {
                let (text, at) = self.required(&a, "value")?;
                match self.numbers(text, at)?[..] {
                    [v] => Value::Rgb(DVec3::splat(v)),
                    [r, g, b] => Value::Rgb(DVec3::new(r, g, b)),
                    ref v => {
                        return Err(self.invalid(
                            at,
                            format!("a colour has one or three numbers, this one has {}", v.len()),
                        ));
                    }
                }
            }
            "point" | "vector" => {
                if a.get("value").is_none() {
                    for axis in ["x", "y", "z"] {
                        self.required(&a, axis)?;
                    }
                }
                Value::Vector(self.vector(&a, DVec3::ZERO)?)
            }
            "spectrum" => Value::Spectrum(self.spectrum(&a)?),
            "transform" => {
                let mut m = DMat4::IDENTITY;
                for step in node.children().filter(|n| n.is_element()) {
                    m = self.transform(step, c)? * m;
                }
                Value::Transform(m)
            }
            _ => unreachable!("every tag above has its value"),
        };
        Ok((a, value))
    }

    fn number(&self, text: &str, at: At) -> Result<f64, Error> {
        let word = text.trim();
        match numbers::float(word.as_bytes()) {
            Some((v, n)) if n == word.len() => Ok(v),
            _ => Err(self.invalid(at, format!("expected a finite number, found '{}'", shown(text)))),
        }
    }

    /// Numbers separated by blanks or commas.
    fn numbers(&self, text: &str, at: At) -> Result<Vec<f64>, Error> {
        words(text).map(|w| self.number(w, at)).collect()
    }

    /// `value="x, y, z"`, or one number for all three, or x, y and z by themselves.
    fn vector(&self, a: &Attributes, default: DVec3) -> Result<DVec3, Error> {
        let mut v = default;
        if let Some((text, at)) = a.get("value") {
            if let Some(axis) = ["x", "y", "z"].iter().find(|n| a.get(n).is_some()) {
                return Err(self.invalid(at, format!("'value' and '{axis}' cannot both be given")));
            }
            match self.numbers(text, at)?[..] {
                [s] => v = DVec3::splat(s),
                [x, y, z] => v = DVec3::new(x, y, z),
                ref w => {
                    return Err(self.invalid(at, format!("expected one or three numbers, found {}", w.len())));
                }
            }
        }
        for (i, axis) in ["x", "y", "z"].iter().enumerate() {
            if let Some((text, at)) = a.get(axis) {
                v[i] = self.number(text, at)?;
            }
        }
        Ok(v)
    }

    fn spectrum(&self, a: &Attributes) -> Result<Spectrum, Error> {
        let (text, at) = match (a.get("value"), a.get("filename")) {
            (Some(v), None) => v,
            (None, Some((name, at))) => {
                let path = self.document.find_file(name, at)?;
                return read_spd(&read_file(&path)?, &path);
            }
            _ => return Err(self.invalid(a.at, "expected either 'value' or 'filename' in <spectrum>")),
        };
        let mut wavelengths = Vec::new();
        let mut values = Vec::new();
        for word in words(text) {
            match word.split_once(':') {
                Some((w, v)) => {
                    wavelengths.push(self.number(w, at)?);
                    values.push(self.number(v, at)?);
                }
                None => values.push(self.number(word, at)?),
            }
        }
        match (wavelengths.len(), values.len()) {
            (0, 1) => Ok(Spectrum::Uniform(values[0])),
            (w, v) if w == v && w >= 2 => Ok(Spectrum::Table { wavelengths, values }),
            _ => {
                Err(self.invalid(at, "expected one number, or at least two pairs such as '400:0.1, 700:0.2'"))
            }
        }
    }

    /// One step of a transform; the steps apply in the order they are written.
    fn transform(&mut self, node: Node, c: Context) -> Result<DMat4, Error> {
        let tag = node.tag_name().name();
        // Files before 2.0 write lookAt.
        let tag = if c.old && tag == "lookAt" { "lookat" } else { tag };
        let at = At { file: c.file, byte: node.range().start };
        Ok(match tag {
            "translate" => {
                let a = self.attributes(node, c, &["value", "x", "y", "z"])?;
                DMat4::from_translation(self.vector(&a, DVec3::ZERO)?)
            }
            "scale" => {
                let a = self.attributes(node, c, &["value", "x", "y", "z"])?;
                DMat4::from_scale(self.vector(&a, DVec3::ONE)?)
            }
            "rotate" => {
                let a = self.attributes(node, c, &["value", "x", "y", "z", "angle"])?;
                let (angle, angle_at) = self.required(&a, "angle")?;
                let angle = self.number(angle, angle_at)?.to_radians();
                let axis = self.vector(&a, DVec3::ZERO)?.try_normalize();
                DMat4::from_axis_angle(
                    axis.ok_or_else(|| self.invalid(at, "the axis of a rotation cannot be zero"))?,
                    angle,
                )
            }
            "lookat" => {
                let a = self.attributes(node, c, &["origin", "target", "up"])?;
                let (origin, target) = (self.triple(&a, "origin")?, self.triple(&a, "target")?);
                let up = if a.get("up").is_some() { self.triple(&a, "up")? } else { DVec3::ZERO };
                look_at(origin, target, up).ok_or_else(|| {
                    self.invalid(
                        at,
                        "'target' must differ from 'origin', and 'up' must not be parallel to the view",
                    )
                })?
            }
            "matrix" => {
                let a = self.attributes(node, c, &["value"])?;
                let (text, at) = self.required(&a, "value")?;
                let v = self.numbers(text, at)?;
                // Row by row in the file.
                match v.len() {
                    16 => DMat4::from_cols_array(&std::array::from_fn(|i| v[i])).transpose(),
                    9 => DMat4::from_mat3(
                        glam::DMat3::from_cols_array(&std::array::from_fn(|i| v[i])).transpose(),
                    ),
                    n => {
                        return Err(
                            self.invalid(at, format!("a matrix has 9 or 16 numbers, this one has {n}"))
                        );
                    }
                }
            }
            _ => return Err(self.unknown(at, "step of a transform", tag, TRANSFORMS.iter().copied())),
        })
    }

    fn triple(&self, a: &Attributes, name: &str) -> Result<DVec3, Error> {
        let (text, at) = self.required(a, name)?;
        match self.numbers(text, at)?[..] {
            [x, y, z] => Ok(DVec3::new(x, y, z)),
            ref v => Err(self.invalid(at, format!("expected three numbers, found {}", v.len()))),
        }
    }
}

/// From a frame that looks along +z with +y up (and so +x to the left) to the world.
fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> Option<DMat4> {
    let z = (target - origin).try_normalize()?;
    let up = if up == DVec3::ZERO {
        // Without one Mitsuba takes the tangent of its own frame around the view.
        let f = yugen_optics::Frame::from_normal(z.as_vec3());
        f.s.as_dvec3()
    } else {
        up
    };
    let x = up.cross(z).try_normalize()?;
    Some(DMat4::from_cols(x.extend(0.0), z.cross(x).extend(0.0), z.extend(0.0), origin.extend(1.0)))
}

/// A spectrum file: a wavelength and a value in each line, `#` starts a comment.
fn read_spd(bytes: &[u8], path: &Path) -> Result<Spectrum, Error> {
    let mut s = numbers::Scanner::new(bytes, path);
    let (mut wavelengths, mut values) = (Vec::new(), Vec::new());
    loop {
        s.space();
        if s.at_end() {
            break;
        }
        if s.rest().starts_with(b"#") {
            s.next_line();
            continue;
        }
        wavelengths.push(s.float().ok_or_else(|| s.expected("a wavelength in nm"))?);
        values.push(s.float().ok_or_else(|| s.expected("the value at this wavelength"))?);
        if !s.at_line_end() {
            return Err(s.expected("the end of the line"));
        }
    }
    if wavelengths.len() < 2 {
        return Err(Error::invalid(
            Place::file(path),
            "expected at least two lines, each a wavelength and a value",
        ));
    }
    Ok(Spectrum::Table { wavelengths, values })
}

/// Words separated by blanks or commas.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c == ',' || c.is_whitespace()).filter(|w| !w.is_empty())
}

/// The start of a text, for messages.
fn shown(text: &str) -> String {
    text.chars().take(40).collect()
}
