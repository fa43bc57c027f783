//! A TOML document whose every value knows its place, and tables that know which words they understand.

use crate::{Error, Place};
use ::toml::Spanned;
use ::toml::de::{DeTable, DeValue};
use std::path::Path;
use yugen_optics::{Vec2, Vec3};

/// The text and its name, for messages.
pub(in crate::formats) struct Document<'a> {
    pub file: &'a Path,
    pub text: &'a str,
}

/// What the parser says first, and the same in plain words.
const SYNTAX: [(&str, &str); 15] = [
    ("duplicate key", "this key is there already; leave one of the two out"),
    (
        "string values must be quoted",
        "a text needs quotes, and the values of a list have commas between them",
    ),
    ("invalid boolean", "a text needs quotes; only numbers, true and false go without"),
    ("invalid float", "this is no number; expected one such as 12, 0.5 or 1e-3"),
    ("invalid integer", "this is no number; expected one such as 12, 0.5 or 1e-3"),
    ("unexpected leading zero", "a number does not begin with 0, unless it is less than one"),
    ("unclosed table", "a heading ends with ], as in [film]"),
    ("unclosed array", "the list does not end; expected ] behind its last value"),
    ("unclosed inline table", "the values in braces do not end; expected } behind the last"),
    ("invalid basic string", "the text does not end in its line; expected a quote behind it"),
    ("invalid literal string", "the text does not end in its line; expected a quote behind it"),
    ("unquoted keys cannot be empty", "there is no key; expected lines of key = value"),
    ("unexpected key or value", "the line goes on; expected one key = value in a line"),
    ("key with no value", "the key has no value; expected key = value"),
    ("missing value", "the key has no value; expected key = value"),
];

impl<'a> Document<'a> {
    /// The values of the text.
    pub fn parse(&self) -> Result<Spanned<DeTable<'a>>, Error> {
        DeTable::parse(self.text).map_err(|e| {
            let said = e.message();
            let plain = SYNTAX.iter().find(|(start, _)| said.starts_with(start));
            let problem = plain.map_or_else(
                || said.trim().replace('\n', "; ").replace('`', "'").replace(", expected nothing", ""),
                |(_, words)| words.to_string(),
            );
            Error::invalid(self.place(e.span().map_or(0, |s| s.start)), problem)
        })
    }

    pub fn place(&self, offset: usize) -> Place {
        Place::in_text(self.file, self.text, offset)
    }
}

/// A value with its key.
#[derive(Clone)]
pub(in crate::formats) struct Item<'a> {
    doc: &'a Document<'a>,
    pub key: String,
    value: &'a Spanned<DeValue<'a>>,
}

impl<'a> Item<'a> {
    /// The file that it stands in.
    pub fn file(&self) -> &'a Path {
        self.doc.file
    }

    pub fn place(&self) -> Place {
        self.doc.place(self.value.span().start)
    }

    pub fn invalid(&self, problem: impl Into<String>) -> Error {
        Error::invalid(self.place(), problem)
    }

    /// It is not what was expected.
    pub fn wrong(&self, expected: &str) -> Error {
        let written = self.doc.text.get(self.value.span()).unwrap_or_default();
        let found = match self.value.get_ref() {
            DeValue::String(s) if s.len() < 40 => format!("'{s}'"),
            DeValue::String(_) => "a long text".into(),
            DeValue::Float(f) if !f.as_str().parse().is_ok_and(f64::is_finite) => {
                format!("{}, which is not finite", f.as_str())
            }
            DeValue::Float(_) | DeValue::Integer(_) if self.try_number().is_none() => {
                format!("{written}, which is beyond what is computed with")
            }
            DeValue::Float(_) | DeValue::Integer(_) | DeValue::Boolean(_) => written.into(),
            DeValue::Datetime(_) => "a date".into(),
            DeValue::Array(_) if written.len() < 40 => written.into(),
            DeValue::Array(_) => "a long list".into(),
            DeValue::Table(_) => "a table of keys and values".into(),
        };
        self.invalid(format!("'{}' is {found}; expected {expected}", self.key))
    }

    /// A word that is none of `known`.
    pub fn unknown<'k>(
        &self,
        what: &'static str,
        name: &str,
        known: impl IntoIterator<Item = &'k str>,
    ) -> Error {
        Error::unknown(self.place(), what, name, known)
    }

    pub fn try_number(&self) -> Option<f64> {
        match self.value.get_ref() {
            DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|i| i as f64),
            DeValue::Float(f) => f.as_str().parse().ok(),
            _ => None,
        }
        // Beyond this, f32 has no room to compute in.
        .filter(|v: &f64| v.abs() < 1e30)
    }

    pub fn number(&self) -> Result<f32, Error> {
        self.try_number().map(|v| v as f32).ok_or_else(|| self.wrong("a number"))
    }

    pub fn number_in(&self, min: f32, max: f32) -> Result<f32, Error> {
        let v = self.number()?;
        if (min..=max).contains(&v) {
            return Ok(v);
        }
        Err(self.invalid(format!("'{}' is {v}; expected a number from {min} to {max}", self.key)))
    }

    pub fn count(&self, max: u32) -> Result<u32, Error> {
        self.try_number()
            .filter(|v| v.fract() == 0.0 && (1.0..=f64::from(max)).contains(v))
            .map(|v| v as u32)
            .ok_or_else(|| self.wrong(&format!("a whole number from 1 to {max}")))
    }

    pub fn boolean(&self) -> Result<bool, Error> {
        self.value.get_ref().as_bool().ok_or_else(|| self.wrong("true or false"))
    }

    pub fn try_text(&self) -> Option<&'a str> {
        self.value.get_ref().as_str()
    }

    pub fn text(&self) -> Result<&'a str, Error> {
        self.try_text().ok_or_else(|| self.wrong("a text in quotes"))
    }

    pub fn try_array(&self) -> Option<Vec<Item<'a>>> {
        let array = self.value.get_ref().as_array()?;
        Some(array.iter().map(|value| Item { doc: self.doc, key: self.key.clone(), value }).collect())
    }

    pub fn array(&self) -> Result<Vec<Item<'a>>, Error> {
        self.try_array().ok_or_else(|| self.wrong("a list in brackets"))
    }

    pub fn numbers<const N: usize>(&self) -> Result<[f32; N], Error> {
        let expected = || self.wrong(&format!("{N} numbers in brackets"));
        let values = self.try_array().ok_or_else(expected)?;
        let values = values.iter().map(Item::number).collect::<Result<Vec<_>, _>>()?;
        values.try_into().map_err(|_| expected())
    }

    pub fn vec3(&self) -> Result<Vec3, Error> {
        self.numbers().map(Vec3::from_array)
    }

    pub fn vec2(&self) -> Result<Vec2, Error> {
        self.numbers().map(Vec2::from_array)
    }

    /// A direction of any length but zero.
    pub fn direction(&self) -> Result<Vec3, Error> {
        self.vec3()?.try_normalize().ok_or_else(|| self.invalid(format!("'{}' has no direction", self.key)))
    }

    /// One of `words`.
    pub fn one_of<T: Copy>(&self, what: &'static str, words: &[(&str, T)]) -> Result<T, Error> {
        let word = self.text()?;
        let found = words.iter().find(|(w, _)| *w == word);
        found.map(|(_, t)| *t).ok_or_else(|| self.unknown(what, word, words.iter().map(|(w, _)| *w)))
    }

    pub fn try_keys(&self, what: &str) -> Option<Keys<'a>> {
        let table = self.value.get_ref().as_table()?;
        Some(Keys {
            doc: self.doc,
            what: what.to_string(),
            table,
            at: self.value.span().start,
            asked: Vec::new(),
        })
    }

    pub fn keys(&self, what: &str) -> Result<Keys<'a>, Error> {
        self.try_keys(what).ok_or_else(|| self.wrong("a table of keys and values"))
    }
}

/// A table that remembers which words it was asked for: those are the ones it understands.
pub(in crate::formats) struct Keys<'a> {
    doc: &'a Document<'a>,
    /// For messages: `material 'cloth'`.
    pub what: String,
    table: &'a DeTable<'a>,
    at: usize,
    asked: Vec<&'static str>,
}

impl<'a> Keys<'a> {
    pub fn root(doc: &'a Document<'a>, table: &'a DeTable<'a>) -> Self {
        Self { doc, what: "scene".into(), table, at: 0, asked: Vec::new() }
    }

    pub fn place(&self) -> Place {
        self.doc.place(self.at)
    }

    pub fn invalid(&self, problem: impl Into<String>) -> Error {
        Error::invalid(self.place(), problem)
    }

    /// The value of `key`, which this table understands from now on.
    pub fn get(&mut self, key: &'static str) -> Option<Item<'a>> {
        self.asked.push(key);
        let (k, value) = self.table.iter().find(|(k, _)| k.get_ref() == key)?;
        Some(Item { doc: self.doc, key: k.get_ref().to_string(), value })
    }

    pub fn need(&mut self, key: &'static str, expected: &str) -> Result<Item<'a>, Error> {
        self.get(key).ok_or_else(|| self.invalid(format!("{} lacks '{key}'; expected {expected}", self.what)))
    }

    /// The value of `key` read by `read`, or `default`.
    pub fn or<T>(
        &mut self,
        key: &'static str,
        default: T,
        read: impl FnOnce(&Item<'a>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        self.get(key).map_or(Ok(default), |item| read(&item))
    }

    /// Every key with its value, for tables whose keys are names that the author chose.
    pub fn names(&self) -> Vec<Item<'a>> {
        self.table
            .iter()
            .map(|(k, value)| Item { doc: self.doc, key: k.get_ref().to_string(), value })
            .collect()
    }

    /// Refuses the first key that was never asked for.
    pub fn finish(self) -> Result<(), Error> {
        let unknown = self.table.keys().filter(|k| !self.asked.contains(&k.get_ref().as_ref()));
        match unknown.min_by_key(|k| k.span().start) {
            None => Ok(()),
            Some(k) => Err(Error::unknown(
                self.doc.place(k.span().start),
                "key",
                k.get_ref(),
                self.asked.iter().copied(),
            )),
        }
    }
}
