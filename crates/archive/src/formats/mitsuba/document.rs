//! A scene file as it stands: objects with typed properties, ids and references.

use crate::formats::folders::Folders;
use crate::{Error, Place};
use glam::{DMat4, DVec3};
use std::cell::{Cell, RefCell};
use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::PathBuf;

/// How deep objects may lie in each other, by elements or by references.
pub(super) const MAX_NESTING: usize = 64;

/// What kind of thing an object is: the name of its element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    Scene,
    Integrator,
    Sensor,
    Film,
    Filter,
    Sampler,
    Emitter,
    Shape,
    Bsdf,
    Texture,
    Medium,
    Phase,
    Volume,
}

pub(super) const CLASSES: &[(&str, Class)] = &[
    ("scene", Class::Scene),
    ("integrator", Class::Integrator),
    ("sensor", Class::Sensor),
    ("film", Class::Film),
    ("rfilter", Class::Filter),
    ("sampler", Class::Sampler),
    ("emitter", Class::Emitter),
    ("shape", Class::Shape),
    ("bsdf", Class::Bsdf),
    ("texture", Class::Texture),
    ("medium", Class::Medium),
    ("phase", Class::Phase),
    ("volume", Class::Volume),
];

impl Class {
    /// The name of its element.
    pub(super) fn name(self) -> &'static str {
        CLASSES.iter().find(|(_, c)| *c == self).map_or("", |(n, _)| n)
    }
}

pub(super) const ELEMENTS: &[&str] = &[
    "scene",
    "integrator",
    "sensor",
    "film",
    "rfilter",
    "sampler",
    "emitter",
    "shape",
    "bsdf",
    "texture",
    "medium",
    "phase",
    "volume",
    "boolean",
    "integer",
    "float",
    "string",
    "point",
    "vector",
    "spectrum",
    "rgb",
    "transform",
    "ref",
    "include",
    "alias",
    "default",
    "path",
];

/// Where something stands: a file of the document and a byte in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct At {
    pub(super) file: usize,
    pub(super) byte: usize,
}

/// A plugin with its properties.
#[derive(Debug)]
pub(super) struct Object {
    pub(super) class: Class,
    pub(super) plugin: String,
    pub(super) id: String,
    pub(super) at: At,
    pub(super) properties: Vec<Property>,
    /// Names somebody asked for, whether they were there or not: what could have been meant.
    pub(super) asked: RefCell<BTreeSet<&'static str>>,
}

#[derive(Debug)]
pub(super) struct Property {
    /// Empty for nested objects and references without one.
    pub(super) name: String,
    pub(super) value: Value,
    pub(super) at: At,
    pub(super) read: Cell<bool>,
}

#[derive(Clone, Debug)]
pub(super) enum Value {
    Boolean(bool),
    Integer(i64),
    Float(f64),
    String(String),
    Vector(DVec3),
    Rgb(DVec3),
    Spectrum(Spectrum),
    Transform(DMat4),
    Object(usize),
    Reference(String),
}

impl Value {
    /// What it is, for messages.
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Self::Boolean(_) => "a boolean",
            Self::Integer(_) => "an integer",
            Self::Float(_) => "a float",
            Self::String(_) => "a string",
            Self::Vector(_) => "a point or vector",
            Self::Rgb(_) => "an rgb colour",
            Self::Spectrum(_) => "a spectrum",
            Self::Transform(_) => "a transform",
            Self::Object(_) | Self::Reference(_) => "an object",
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Spectrum {
    Uniform(f64),
    Table { wavelengths: Vec<f64>, values: Vec<f64> },
}

/// A scene file with everything it includes.
pub(super) struct Document {
    pub(super) objects: Vec<Object>,
    pub(super) ids: HashMap<String, usize>,
    /// Objects that something refers to by their id.
    pub(super) referenced: HashSet<usize>,
    pub(super) files: Vec<File>,
    /// Those of the main file.
    pub(super) folders: Folders,
}

pub(super) struct File {
    pub(super) path: PathBuf,
    pub(super) text: String,
    /// How far `<path>` elements of this file and its own folder reach.
    pub(super) folders: Folders,
}

impl Document {
    /// The scene itself.
    pub(super) fn root(&self) -> usize {
        0
    }

    /// The file, line and column of `at`.
    pub(super) fn place(&self, at: At) -> Place {
        let f = &self.files[at.file];
        Place::in_text(&f.path, &f.text, at.byte)
    }

    /// A file named by a property that stands at `at`.
    pub(super) fn find_file(&self, name: &str, at: At) -> Result<PathBuf, Error> {
        self.folders.then(&self.files[at.file].folders).find(name, self.place(at))
    }

    /// The object a property holds or refers to.
    pub(super) fn object_of(&self, value: &Value) -> Option<usize> {
        match value {
            Value::Object(i) => Some(*i),
            Value::Reference(id) => self.ids.get(id).copied(),
            _ => None,
        }
    }

    /// Whether some property refers to `object` by its id.
    pub(super) fn referenced(&self, object: usize) -> bool {
        self.referenced.contains(&object)
    }

    /// Every reference has its object, and no object contains itself.
    pub(super) fn check_references(&self) -> Result<(), Error> {
        for p in self.objects.iter().flat_map(|o| &o.properties) {
            if let Value::Reference(id) = &p.value
                && !self.ids.contains_key(id)
            {
                return Err(Error::unknown(self.place(p.at), "id", id, self.ids.keys().map(String::as_str)));
            }
        }
        // Depth first with an explicit stack: a chain of references may be as long as the file.
        #[derive(Clone, Copy, PartialEq)]
        enum State {
            New,
            Open,
            Done,
        }
        let mut state = vec![State::New; self.objects.len()];
        for start in 0..self.objects.len() {
            let mut stack = vec![(start, 0)];
            while let Some((object, next)) = stack.last_mut() {
                if *next == 0 {
                    if state[*object] != State::New {
                        stack.pop();
                        continue;
                    }
                    state[*object] = State::Open;
                }
                let Some(p) = self.objects[*object].properties.get(*next) else {
                    state[*object] = State::Done;
                    stack.pop();
                    continue;
                };
                *next += 1;
                if let Some(child) = self.object_of(&p.value) {
                    match state[child] {
                        State::Open => {
                            let id = &self.objects[child].id;
                            return Err(Error::invalid(
                                self.place(p.at),
                                format!("the object '{id}' contains itself"),
                            ));
                        }
                        State::New if stack.len() > MAX_NESTING => {
                            return Err(Error::TooLarge {
                                at: self.place(p.at),
                                what: "the depth of nested and referenced objects".into(),
                                asked: stack.len() as u64,
                                limit: MAX_NESTING as u64,
                            });
                        }
                        State::New => stack.push((child, 0)),
                        State::Done => {}
                    }
                }
            }
        }
        Ok(())
    }
}
