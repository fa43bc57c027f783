//! Typed access to the properties of one plugin; what nobody asked for is an error.

use super::document::{At, Class, Document, Object, Property, Spectrum, Value};
use super::features::FEATURES;
use crate::formats::support::{Feature, Support, find};
use crate::{Error, Place};
use glam::{Mat4, Vec3};
use std::path::PathBuf;

/// The properties of one plugin.
#[derive(Clone, Copy)]
pub(super) struct Properties<'a> {
    document: &'a Document,
    pub(super) index: usize,
    object: &'a Object,
}

impl<'a> Properties<'a> {
    pub(super) fn new(document: &'a Document, index: usize) -> Self {
        Self { document, index, object: &document.objects[index] }
    }

    pub(super) fn class(self) -> Class {
        self.object.class
    }

    pub(super) fn plugin(self) -> &'a str {
        &self.object.plugin
    }

    pub(super) fn id(self) -> &'a str {
        &self.object.id
    }

    /// Where the plugin is named, in the document.
    pub(super) fn at(self) -> At {
        self.object.at
    }

    /// Where the plugin is named.
    pub(super) fn place(self) -> Place {
        self.document.place(self.object.at)
    }

    pub(super) fn place_of(self, at: At) -> Place {
        self.document.place(at)
    }

    pub(super) fn invalid(self, problem: impl Into<String>) -> Error {
        Error::invalid(self.place(), problem)
    }

    /// This plugin is not read: why, or what was probably meant.
    pub(super) fn unknown_plugin(self) -> Error {
        let class = self.class().name();
        if let Some(Feature { support: Support::No(why), .. }) =
            find(FEATURES, &format!("{class}: {}", self.plugin()))
        {
            return self.invalid(format!("the {class} '{}' is not read: {why}", self.plugin()));
        }
        let of_class = FEATURES.iter().filter(|f| !matches!(f.support, Support::No(_)));
        let known = of_class.filter_map(|f| f.name.strip_prefix(class)?.strip_prefix(": "));
        let what = match self.class() {
            Class::Integrator => "integrator plugin",
            Class::Sensor => "sensor plugin",
            Class::Film => "film plugin",
            Class::Filter => "rfilter plugin",
            Class::Sampler => "sampler plugin",
            Class::Emitter => "emitter plugin",
            Class::Shape => "shape plugin",
            Class::Bsdf => "bsdf plugin",
            Class::Texture => "texture plugin",
            _ => "plugin",
        };
        Error::unknown(self.place(), what, self.plugin(), known)
    }

    /// Where plugins of one class are all treated alike: an error for one that is not read.
    pub(super) fn check_plugin(self) -> Result<(), Error> {
        match find(FEATURES, &format!("{}: {}", self.class().name(), self.plugin())) {
            Some(f) if !matches!(f.support, Support::No(_)) => Ok(()),
            _ => Err(self.unknown_plugin()),
        }
    }

    /// The property called `name`; from now on it counts as read.
    pub(super) fn get(self, name: &'static str) -> Option<&'a Property> {
        self.object.asked.borrow_mut().insert(name);
        let p = self.object.properties.iter().find(|p| p.name == name)?;
        p.read.set(true);
        Some(p)
    }

    pub(super) fn has(self, name: &'static str) -> bool {
        self.get(name).is_some()
    }

    /// Accepted without effect: how things are sampled or stored, not what they are.
    pub(super) fn accept(self, names: &[&'static str]) {
        for name in names {
            self.get(name);
        }
    }

    fn wrong(self, p: &Property, expected: &str) -> Error {
        let at = self.document.place(p.at);
        Error::invalid(at, format!("expected {expected} as '{}', found {}", p.name, p.value.kind()))
    }

    pub(super) fn float(self, name: &'static str, default: f64) -> Result<f64, Error> {
        Ok(self.float_or_none(name)?.unwrap_or(default))
    }

    pub(super) fn float_or_none(self, name: &'static str) -> Result<Option<f64>, Error> {
        let Some(p) = self.get(name) else { return Ok(None) };
        match p.value {
            Value::Float(v) => Ok(Some(v)),
            Value::Integer(v) => Ok(Some(v as f64)),
            _ => Err(self.wrong(p, "a float")),
        }
    }

    /// A float in a range; the range is written as people write it.
    pub(super) fn float_in(
        self,
        name: &'static str,
        default: f64,
        ok: impl Fn(f64) -> bool,
        range: &str,
    ) -> Result<f64, Error> {
        let v = self.float(name, default)?;
        if ok(v) { Ok(v) } else { Err(self.out_of_range(name, v, range)) }
    }

    pub(super) fn out_of_range(
        self,
        name: &'static str,
        value: impl std::fmt::Display,
        range: &str,
    ) -> Error {
        let at = self.get(name).map_or(self.object.at, |p| p.at);
        Error::invalid(self.document.place(at), format!("'{name}' is {value}; expected {range}"))
    }

    pub(super) fn integer(self, name: &'static str, default: i64) -> Result<i64, Error> {
        let Some(p) = self.get(name) else { return Ok(default) };
        match p.value {
            Value::Integer(v) => Ok(v),
            _ => Err(self.wrong(p, "an integer")),
        }
    }

    /// A whole number from `min` to `max`.
    pub(super) fn count(self, name: &'static str, default: u32, min: u32, max: u32) -> Result<u32, Error> {
        let v = self.integer(name, default.into())?;
        match u32::try_from(v) {
            Ok(v) if (min..=max).contains(&v) => Ok(v),
            _ => Err(self.out_of_range(name, v, &format!("{min} to {max}"))),
        }
    }

    pub(super) fn boolean(self, name: &'static str, default: bool) -> Result<bool, Error> {
        let Some(p) = self.get(name) else { return Ok(default) };
        match p.value {
            Value::Boolean(v) => Ok(v),
            _ => Err(self.wrong(p, "a boolean")),
        }
    }

    pub(super) fn string(self, name: &'static str) -> Result<Option<(&'a str, At)>, Error> {
        let Some(p) = self.get(name) else { return Ok(None) };
        match &p.value {
            Value::String(v) => Ok(Some((v, p.at))),
            _ => Err(self.wrong(p, "a string")),
        }
    }

    /// One of a few words, whatever their case.
    pub(super) fn choice(
        self,
        name: &'static str,
        default: &'static str,
        known: &[&'static str],
    ) -> Result<&'static str, Error> {
        let Some((word, at)) = self.string(name)? else { return Ok(default) };
        let found = known.iter().find(|k| k.eq_ignore_ascii_case(word));
        found
            .copied()
            .ok_or_else(|| Error::unknown(self.document.place(at), "choice", word, known.iter().copied()))
    }

    pub(super) fn vector(self, name: &'static str) -> Result<Option<Vec3>, Error> {
        let Some(p) = self.get(name) else { return Ok(None) };
        match p.value {
            Value::Vector(v) => Ok(Some(v.as_vec3())),
            _ => Err(self.wrong(p, "a point or vector")),
        }
    }

    pub(super) fn transform(self, name: &'static str) -> Result<Mat4, Error> {
        let Some(p) = self.get(name) else { return Ok(Mat4::IDENTITY) };
        let Value::Transform(m) = p.value else { return Err(self.wrong(p, "a transform")) };
        let m = m.as_mat4();
        if m.is_finite() {
            Ok(m)
        } else {
            Err(Error::invalid(self.document.place(p.at), "the transform overflows single precision"))
        }
    }

    /// `to_world`, which must be affine and leave no dimension flat.
    pub(super) fn to_world(self) -> Result<Mat4, Error> {
        let m = self.transform("to_world")?;
        let place = || self.document.place(self.get("to_world").map_or(self.object.at, |p| p.at));
        if m.row(3) != glam::Vec4::W {
            return Err(Error::invalid(place(), "the last row of 'to_world' must be 0 0 0 1"));
        }
        if m.determinant() == 0.0 || !m.inverse().is_finite() {
            return Err(Error::invalid(place(), "'to_world' cannot be inverted: it flattens a dimension"));
        }
        Ok(m)
    }

    /// The file that the property `name` names.
    pub(super) fn file(self, name: &'static str) -> Result<Option<PathBuf>, Error> {
        match self.string(name)? {
            Some((file, at)) => self.document.find_file(file, at).map(Some),
            None => Ok(None),
        }
    }

    /// The same, for a plugin that cannot do without.
    pub(super) fn required_file(self, name: &'static str) -> Result<PathBuf, Error> {
        self.file(name)?.ok_or_else(|| self.missing(name))
    }

    pub(super) fn missing(self, name: &str) -> Error {
        self.invalid(format!("{} '{}' needs the property '{name}'", self.class().name(), self.plugin()))
    }

    pub(super) fn spectrum(self, p: &'a Property) -> Option<&'a Spectrum> {
        match &p.value {
            Value::Spectrum(s) => Some(s),
            _ => None,
        }
    }

    /// The object held or referred to by a property.
    pub(super) fn object(self, p: &Property) -> Option<Properties<'a>> {
        self.document.object_of(&p.value).map(|i| Properties::new(self.document, i))
    }

    /// Nested or referenced objects of a class, in order, whatever their names.
    pub(super) fn children(self, class: Class) -> Vec<Properties<'a>> {
        let mut found = Vec::new();
        for p in &self.object.properties {
            if let Some(child) = self.object(p).filter(|c| c.class() == class) {
                p.read.set(true);
                found.push(child);
            }
        }
        found
    }

    /// At most one of them.
    pub(super) fn child(self, class: Class) -> Result<Option<Properties<'a>>, Error> {
        let found = self.children(class);
        match found.get(1) {
            Some(second) => Err(second.invalid(format!(
                "{} '{}' takes only one {}, this is the second",
                self.class().name(),
                self.plugin(),
                class.name()
            ))),
            None => Ok(found.first().copied()),
        }
    }

    /// Everything there was has been read.
    pub(super) fn finish(self) -> Result<(), Error> {
        let Some(p) = self.object.properties.iter().find(|p| !p.read.get()) else { return Ok(()) };
        let at = self.document.place(p.at);
        let here = match self.plugin() {
            "" => format!("<{}>", self.class().name()),
            plugin => format!("{} '{plugin}'", self.class().name()),
        };
        if let Some(child) = self.object(p) {
            let problem = format!("{here} has no use for the {} '{}'", child.class().name(), child.plugin());
            return Err(Error::invalid(at, problem));
        }
        let asked = self.object.asked.borrow();
        Err(Error::unknown(at, "property", &p.name, asked.iter().copied()))
    }
}
