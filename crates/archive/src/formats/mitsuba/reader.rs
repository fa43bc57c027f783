//! The XML itself: parameters, includes, old names.

use super::document::{At, CLASSES, Class, Document, File, MAX_NESTING, Object, Property, Value};
use crate::formats::folders::Folders;
use crate::formats::read_file;
use crate::{Error, Place};
use glam::{DMat4, DVec3};
use roxmltree::{Attribute, Node, ParsingOptions};
use std::cell::{Cell, RefCell};
use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Limits of a document; far beyond what a person or an exporter writes.
const MAX_BYTES: usize = 64 << 20;
const MAX_NODES: u32 = 2 << 20;
/// Of one object that gives names to them.
const MAX_PROPERTIES: usize = 1 << 14;
const MAX_INCLUDE_DEPTH: usize = 16;
const MAX_INCLUDES: usize = 1024;
/// Names that were translated and are told of.
const MAX_TOLD: usize = 64;
/// All text that `$name` puts in: stops parameters that double each other.
const MAX_SUBSTITUTED: usize = 16 << 20;

/// `$name` and its value; the longest names first, so that `$ab` is not read as `$a` and a `b`.
struct Parameter {
    name: String,
    value: String,
    /// The files have it: as a <default>, or where its value goes. The caller wants to know of one that they have not.
    known: bool,
}

/// What is open while files are read.
pub(super) struct Reader {
    pub(super) document: Document,
    parameters: Vec<Parameter>,
    substituted: usize,
    /// The chain of includes that led here.
    chain: Vec<PathBuf>,
    /// XML nodes so far, over all files.
    nodes: u32,
    /// Names of old files and those that they have now.
    translated: BTreeSet<(String, String)>,
}

/// Reads `bytes`, called `path`, and everything it includes; `defines` are the caller's parameters.
pub(super) fn read(
    bytes: &[u8],
    path: &Path,
    defines: &[(String, String)],
    folders: Folders,
) -> Result<Document, Error> {
    let mut reader = Reader {
        document: Document {
            objects: Vec::new(),
            ids: HashMap::new(),
            referenced: HashSet::new(),
            files: Vec::new(),
            folders: folders.clone(),
        },
        parameters: Vec::new(),
        substituted: 0,
        chain: Vec::new(),
        nodes: 0,
        translated: BTreeSet::new(),
    };
    for (name, value) in defines {
        reader.define(name, value, true);
    }
    reader.file(bytes, path, folders, None)?;
    reader.tell_what_was_translated(path);
    let known: Vec<&str> = reader.parameters.iter().filter(|p| p.known).map(|p| p.name.as_str()).collect();
    if let Some(unused) = reader.parameters.iter().find(|p| !p.known) {
        let at = Place::file(path);
        if known.is_empty() {
            let problem =
                format!("the scene has no parameters, so '{}' cannot be given a value", unused.name);
            return Err(Error::invalid(at, problem));
        }
        return Err(Error::unknown(at, "parameter", &unused.name, known));
    }
    let mut document = reader.document;
    document.check_references()?;
    let all = document.objects.iter().flat_map(|o| &o.properties);
    let referenced =
        all.filter(|p| matches!(p.value, Value::Reference(_))).filter_map(|p| document.object_of(&p.value));
    document.referenced = referenced.collect();
    Ok(document)
}

/// What an element is read into: the file, its version and the object around it.
#[derive(Clone, Copy)]
pub(super) struct Context {
    pub(super) file: usize,
    /// Below 2.0: names are camelCase.
    pub(super) old: bool,
    parent: usize,
    depth: usize,
}

impl Reader {
    /// Once, for all there was.
    fn tell_what_was_translated(&self, path: &Path) {
        if self.translated.is_empty() {
            return;
        }
        let pairs: Vec<String> = self.translated.iter().map(|(old, new)| format!("{old} to {new}")).collect();
        tracing::warn!(
            "{}: a scene of Mitsuba 0.6 or older; translated: {}",
            path.display(),
            pairs.join(", ")
        );
    }

    fn define(&mut self, name: &str, value: &str, given: bool) {
        if let Some(p) = self.parameters.iter_mut().find(|p| p.name == name) {
            p.known |= !given;
            return;
        }
        let at = self.parameters.partition_point(|p| p.name.len() >= name.len());
        self.parameters.insert(at, Parameter { name: name.into(), value: value.into(), known: !given });
    }

    pub(super) fn invalid(&self, at: At, problem: impl Into<String>) -> Error {
        Error::invalid(self.document.place(at), problem)
    }

    pub(super) fn unknown<'a>(
        &self,
        at: At,
        what: &'static str,
        name: &str,
        known: impl IntoIterator<Item = &'a str>,
    ) -> Error {
        Error::unknown(self.document.place(at), what, name, known)
    }

    /// Reads a file. `into` is the object that includes it; the main file has none.
    fn file(
        &mut self,
        bytes: &[u8],
        path: &Path,
        folders: Folders,
        into: Option<Context>,
    ) -> Result<(), Error> {
        let whole = || Place::file(path);
        if bytes.len() > MAX_BYTES {
            let (asked, limit) = (bytes.len() as u64, MAX_BYTES as u64);
            return Err(Error::TooLarge {
                at: whole(),
                what: "the size of the XML in bytes".into(),
                asked,
                limit,
            });
        }
        let text = std::str::from_utf8(bytes).map_err(|e| {
            Error::invalid(
                Place::byte(path, e.valid_up_to() as u64),
                "expected UTF-8 text; convert the file to UTF-8",
            )
        })?;
        let nodes_limit = MAX_NODES.saturating_sub(self.nodes);
        let options = ParsingOptions { allow_dtd: false, nodes_limit, ..ParsingOptions::default() };
        let tree = roxmltree::Document::parse_with_options(text, options).map_err(|e| {
            let (at, e) = (e.pos(), e);
            let place = Place::line(path, at.row as usize, at.col as usize);
            match e {
                roxmltree::Error::NodesLimitReached => Error::TooLarge {
                    at: whole(),
                    what: "the number of XML nodes".into(),
                    asked: u64::from(nodes_limit) + 1,
                    limit: nodes_limit.into(),
                },
                roxmltree::Error::DtdDetected => Error::invalid(
                    whole(),
                    "document types and entities are not allowed in a scene; remove <!DOCTYPE …>",
                ),
                e => {
                    // Its words end with the place, which stands before them here.
                    let problem = e.to_string();
                    let problem = problem.rsplit_once(" at ").map_or(problem.as_str(), |(p, _)| p);
                    Error::invalid(place, format!("not well-formed XML: {problem}"))
                }
            }
        })?;
        self.nodes += tree.descendants().len() as u32;
        let file = self.document.files.len();
        self.document.files.push(File { path: path.into(), text: text.into(), folders });
        let root = tree.root_element();
        let at = At { file, byte: root.range().start };
        let Some(version) = root.attribute("version") else {
            return Err(self.invalid(
                at,
                format!("expected the attribute version=\"3.0.0\" in <{}>", root.tag_name().name()),
            ));
        };
        let major = version.split('.').map(str::parse::<u32>).collect::<Result<Vec<_>, _>>();
        let Ok(Some(major)) = major.map(|v| v.first().copied()) else {
            return Err(self.invalid(at, format!("expected a version such as 3.0.0, found '{version}'")));
        };
        if major > 3 {
            return Err(
                self.invalid(at, format!("the file is of version {version}; versions up to 3 are read"))
            );
        }
        let old = major < 2;
        match into {
            None => {
                if root.tag_name().name() != "scene" {
                    return Err(self.invalid(
                        at,
                        format!(
                            "expected <scene> as the outermost element, found <{}>",
                            root.tag_name().name()
                        ),
                    ));
                }
                self.object(root, Context { file, old, parent: 0, depth: 0 }, true)
            }
            // What stands in an included scene goes where the include stands.
            Some(c) if root.tag_name().name() == "scene" => self.children(root, Context { file, old, ..c }),
            Some(c) => self.element(root, Context { file, old, ..c }, true),
        }
    }

    fn children(&mut self, node: Node, c: Context) -> Result<(), Error> {
        for child in node.children() {
            if child.is_element() {
                self.element(child, c, false)?;
            } else if let Some(text) = child.text().filter(|t| child.is_text() && !t.trim().is_empty()) {
                let blanks = text.len() - text.trim_start().len();
                let at = At { file: c.file, byte: child.range().start + blanks };
                return Err(self.invalid(at, "expected elements, found text"));
            }
        }
        Ok(())
    }

    /// The attributes of an element, parameters put in; those that are not `allowed` are errors.
    pub(super) fn attributes(
        &mut self,
        node: Node,
        c: Context,
        allowed: &[&str],
    ) -> Result<Attributes, Error> {
        let element = node.tag_name().name().to_string();
        let mut list = Vec::new();
        for a in node.attributes() {
            let at = At { file: c.file, byte: a.range().start };
            if !allowed.contains(&a.name()) {
                return Err(self.unknown(at, "attribute", a.name(), allowed.iter().copied()));
            }
            list.push((
                a.name().to_string(),
                self.substitute(&a, c.file)?,
                At { byte: a.range_value().start, ..at },
            ));
        }
        Ok(Attributes { element, at: At { file: c.file, byte: node.range().start }, list })
    }

    fn substitute(&mut self, a: &Attribute, file: usize) -> Result<String, Error> {
        let text = a.value();
        if !text.contains('$') {
            return Ok(text.into());
        }
        let at = At { file, byte: a.range_value().start };
        let (mut out, mut rest) = (String::new(), text);
        while let Some(n) = rest.find('$') {
            if rest[..n].ends_with('\\') {
                out += &rest[..n - 1];
                out.push('$');
                rest = &rest[n + 1..];
                continue;
            }
            out += &rest[..n];
            rest = &rest[n + 1..];
            let Some(p) = self.parameters.iter_mut().find(|p| rest.starts_with(&p.name)) else {
                let name: String =
                    rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').take(64).collect();
                // Where nothing alike has a value, it wants one.
                let known = self.parameters.iter().map(|p| p.name.as_str());
                if yugen_scene::nearest(&name, known.clone()).is_none() {
                    let problem = format!(
                        "the parameter '{name}' has no value; give it one with -D {name}=VALUE, or a <default>"
                    );
                    return Err(self.invalid(at, problem));
                }
                return Err(self.unknown(at, "parameter", &name, known));
            };
            p.known = true;
            out += &p.value;
            rest = &rest[p.name.len()..];
            self.substituted += p.value.len();
            if self.substituted > MAX_SUBSTITUTED {
                return Err(Error::TooLarge {
                    at: self.document.place(at),
                    what: "the text that parameters put in, in bytes,".into(),
                    asked: self.substituted as u64,
                    limit: MAX_SUBSTITUTED as u64,
                });
            }
        }
        out += rest;
        Ok(out)
    }

    fn element(&mut self, node: Node, c: Context, root: bool) -> Result<(), Error> {
        let name = node.tag_name().name();
        let at = At { file: c.file, byte: node.range().start };
        if c.depth > MAX_NESTING {
            let (asked, limit) = (c.depth as u64, MAX_NESTING as u64);
            return Err(Error::TooLarge {
                at: self.document.place(at),
                what: "the depth of nested elements".into(),
                asked,
                limit,
            });
        }
        if CLASSES.iter().any(|(n, _)| *n == name) || (name == "spectrum" && node.has_attribute("type")) {
            return self.object(node, c, root);
        }
        match name {
            "include" => return self.include(node, c),
            "transform" => {}
            _ => {
                if let Some(child) = node.children().find(|n| n.is_element()) {
                    let at = At { file: c.file, byte: child.range().start };
                    return Err(self.invalid(at, format!("<{name}> cannot have elements inside")));
                }
            }
        }
        match name {
            "default" => {
                let a = self.attributes(node, c, &["name", "value"])?;
                let (name, value) =
                    (self.required(&a, "name")?.0.to_string(), self.required(&a, "value")?.0.to_string());
                if name.is_empty() {
                    return Err(self.invalid(at, "the name of a parameter cannot be empty"));
                }
                self.define(&name, &value, false);
            }
            "path" => {
                let a = self.attributes(node, c, &["value"])?;
                let (value, at) = self.required(&a, "value")?;
                if c.depth != 1 {
                    return Err(self.invalid(a.at, "<path> can only stand directly in <scene>"));
                }
                let place = self.document.place(at);
                let f = &mut self.document.files[c.file];
                f.folders.add_first(value, &f.path, place)?;
                if c.file == 0 {
                    self.document.folders = f.folders.clone();
                }
            }
            "alias" => {
                let a = self.attributes(node, c, &["id", "as"])?;
                let ((id, id_at), (new, new_at)) = (self.required(&a, "id")?, self.required(&a, "as")?);
                let Some(&object) = self.document.ids.get(id) else {
                    return Err(self.unknown(id_at, "id", id, self.document.ids.keys().map(String::as_str)));
                };
                if self.document.ids.insert(new.to_string(), object).is_some() {
                    return Err(self.invalid(new_at, format!("the id '{new}' is taken already")));
                }
            }
            _ => {
                let (a, value) = self.value(node, c)?;
                let name = match a.get("name") {
                    Some((name, _)) => name.to_string(),
                    None if name == "ref" => String::new(),
                    None => {
                        return Err(self.invalid(at, format!("expected the attribute 'name' in <{name}>")));
                    }
                };
                self.property(c, name, value, at)?;
            }
        }
        Ok(())
    }

    pub(super) fn required<'a>(&self, a: &'a Attributes, name: &str) -> Result<(&'a str, At), Error> {
        a.get(name)
            .ok_or_else(|| self.invalid(a.at, format!("expected the attribute '{name}' in <{}>", a.element)))
    }

    fn property(&mut self, c: Context, name: String, value: Value, at: At) -> Result<(), Error> {
        let name = if c.old {
            let new = snake_case(&name);
            // More than a person reads is not kept.
            if new != name && new != STRICT && self.translated.len() < MAX_TOLD {
                self.translated.insert((name, new.clone()));
            }
            new
        } else {
            name
        };
        let parent = &self.document.objects[c.parent];
        if !name.is_empty() {
            if parent.properties.iter().any(|p| p.name == name) {
                return Err(self.invalid(at, format!("the property '{name}' is given twice")));
            }
            // The search above takes the square of their number.
            if parent.properties.len() > MAX_PROPERTIES {
                let (asked, limit) = (parent.properties.len() as u64, MAX_PROPERTIES as u64);
                return Err(Error::TooLarge {
                    at: self.document.place(at),
                    what: "the number of properties".into(),
                    asked,
                    limit,
                });
            }
        }
        self.document.objects[c.parent].properties.push(Property { name, value, at, read: Cell::new(false) });
        Ok(())
    }

    fn object(&mut self, node: Node, c: Context, root: bool) -> Result<(), Error> {
        let is_main = self.document.objects.is_empty();
        if node.tag_name().name() == "scene" && !is_main {
            let at = At { file: c.file, byte: node.range().start };
            return Err(self.invalid(at, "<scene> can only be the outermost element"));
        }
        let allowed: &[&str] =
            if root { &["version", "type", "id", "name"] } else { &["type", "id", "name"] };
        let a = self.attributes(node, c, allowed)?;
        let class = CLASSES.iter().find(|(n, _)| *n == a.element).map_or(Class::Texture, |(_, class)| *class);
        let plugin = if class == Class::Scene {
            String::new()
        } else {
            self.required(&a, "type")?.0.to_ascii_lowercase()
        };
        let index = self.document.objects.len();
        let id = a.get("id").map_or(String::new(), |(id, _)| id.to_string());
        if let Some((id, at)) = a.get("id").filter(|(id, _)| !id.is_empty()) {
            if let Some(&other) = self.document.ids.get(id) {
                let other = self.document.place(self.document.objects[other].at);
                return Err(self.invalid(at, format!("the id '{id}' is taken already, at {other}")));
            }
            self.document.ids.insert(id.to_string(), index);
        }
        if !is_main {
            let name = a.get("name").map_or(String::new(), |(n, _)| n.to_string());
            self.property(c, name, Value::Object(index), a.at)?;
        }
        let at = a.get("type").map_or(a.at, |(_, at)| at);
        self.document.objects.push(Object {
            class,
            plugin,
            id,
            at,
            properties: Vec::new(),
            asked: RefCell::default(),
        });
        self.children(node, Context { parent: index, depth: c.depth + 1, ..c })?;
        if c.old {
            let object = &mut self.document.objects[index];
            let strict = |p: &Property| p.name == STRICT && matches!(p.value, Value::Boolean(true));
            if object.class == Class::Integrator && object.properties.iter().any(strict) {
                let kept =
                    "nothing: light that a shading normal sees on the wrong side of its surface is kept";
                self.translated.insert(("strictNormals".into(), kept.into()));
            }
            if upgrade(object) {
                self.translated.insert((format!("{} without a material", object.plugin), "copper".into()));
            }
            let model = match object.plugin.as_str() {
                "ldrfilm" => "hdrfilm",
                "roughdiffuse" => "oren_nayar (sigma = alpha/√2)",
                "phong" => "phong over lambert",
                _ => "",
            };
            if !model.is_empty() {
                self.translated.insert((object.plugin.clone(), model.into()));
            }
        }
        Ok(())
    }

    fn include(&mut self, node: Node, c: Context) -> Result<(), Error> {
        let a = self.attributes(node, c, &["filename"])?;
        let (name, at) = self.required(&a, "filename")?;
        let place = self.document.place(at);
        let here = &self.document.files[c.file];
        let folders = here.folders.inside(&here.path);
        let path = folders.find(name, place.clone())?;
        if self.chain.contains(&path) || self.document.files[0].path.canonicalize().is_ok_and(|p| p == path) {
            return Err(Error::invalid(place, format!("the file '{name}' includes itself")));
        }
        let too_large = |what: &str, limit: usize| Error::TooLarge {
            at: place.clone(),
            what: what.into(),
            asked: limit as u64 + 1,
            limit: limit as u64,
        };
        if self.chain.len() >= MAX_INCLUDE_DEPTH {
            return Err(too_large("the depth of includes", MAX_INCLUDE_DEPTH));
        }
        if self.document.files.len() > MAX_INCLUDES {
            return Err(too_large("the number of includes", MAX_INCLUDES));
        }
        let bytes = read_file(&path)?;
        self.chain.push(path.clone());
        let inside = self.document.files[c.file].folders.inside(&path);
        self.file(&bytes, &path, inside, Some(c))?;
        self.chain.pop();
        Ok(())
    }
}

/// The attributes of one element, parameters put in.
pub(super) struct Attributes {
    element: String,
    pub(super) at: At,
    list: Vec<(String, String, At)>,
}

impl Attributes {
    pub(super) fn get(&self, name: &str) -> Option<(&str, At)> {
        self.list.iter().find(|(n, ..)| n == name).map(|(_, v, at)| (v.as_str(), *at))
    }
}

/// `sampleCount` to `sample_count`, as files before 2.0 write it.
fn snake_case(name: &str) -> String {
    let mut out = String::new();
    let mut before = ' ';
    for c in name.chars() {
        if c.is_ascii_uppercase() && before.is_ascii_lowercase() {
            out.push('_');
        }
        // Within a run of capitals that a small letter began, as in `toUV`, all become small.
        let lower = c.is_ascii_uppercase()
            && (before.is_ascii_lowercase() || (before.is_ascii_uppercase() && out.contains('_')));
        out.push(if lower { c.to_ascii_lowercase() } else { c });
        before = c;
    }
    out
}

/// An option of 0.6's path tracers that no longer exists.
const STRICT: &str = "strict_normals";

/// What else changed with version 2.0. Returns whether a metal became copper.
fn upgrade(object: &mut Object) -> bool {
    if matches!(object.plugin.as_str(), "diffuse" | "roughdiffuse") {
        for p in &mut object.properties {
            if p.name == "diffuse_reflectance" {
                p.name = "reflectance".into();
            }
        }
    }
    // Metals were copper unless something was said.
    let said = |p: &Property| matches!(p.name.as_str(), "material" | "eta" | "k");
    let copper = matches!(object.plugin.as_str(), "conductor" | "roughconductor")
        && !object.properties.iter().any(said);
    if copper {
        let (value, at) = (Value::String("Cu".into()), object.at);
        object.properties.push(Property { name: "material".into(), value, at, read: Cell::new(false) });
    }
    if object.class == Class::Integrator {
        object.properties.retain(|p| p.name != STRICT);
    }
    // Offsets and scales of textures became one transform: first moved, then scaled.
    let mut take = |name: &str| {
        let i = object.properties.iter().position(|p| p.name == name)?;
        let value = match object.properties[i].value {
            Value::Float(v) => v,
            Value::Integer(v) => v as f64,
            // Of the wrong type: it stays and is refused with the others nobody reads.
            _ => return None,
        };
        Some((value, object.properties.remove(i).at))
    };
    let old = ["uoffset", "voffset", "uscale", "vscale"].map(&mut take);
    if let Some(at) = old.iter().flatten().map(|(_, at)| *at).next() {
        let or = |i: usize, default| old[i].map_or(default, |(v, _)| v);
        let (offset, scale) =
            (DVec3::new(or(0, 0.0), or(1, 0.0), 0.0), DVec3::new(or(2, 1.0), or(3, 1.0), 1.0));
        let value = Value::Transform(DMat4::from_scale(scale) * DMat4::from_translation(offset));
        object.properties.push(Property { name: "to_uv".into(), value, at, read: Cell::new(false) });
    }
    copper
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_names_become_new_ones() {
        for (old, new) in [
            ("sampleCount", "sample_count"),
            ("toWorld", "to_world"),
            ("toUV", "to_uv"),
            ("alphaU", "alpha_u"),
            ("B", "B"),
            ("fov", "fov"),
        ] {
            assert_eq!(snake_case(old), new);
        }
    }
}
