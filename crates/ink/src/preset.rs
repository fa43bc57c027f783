//! Ways of painting, from a small text file.

use crate::InkError;
use crate::brush::Bristles;
use crate::canvas::Layer;
use crate::control::CONTROLS;
use crate::mask::{Grey, Ground, Mask};
use crate::painter::{Style, pigments};
use crate::paper::{PAPERS, Paper};
use crate::pigment::{PIGMENTS, Pigment};
use crate::steering::{self, Changes, Steering, StrokeEdit};
use crate::wrinkle::{MANNERS, Manner};
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;
use toml::de::{DeTable, DeValue};
use yugen_optics::Image;
use yugen_scene::suggest;

/// A way of painting.
#[derive(Clone, Debug)]
pub struct Preset {
    /// For `--preset`.
    pub name: String,
    /// What it is.
    pub doc: String,
    /// What it comes to.
    pub style: Style,
}

/// Opens the picture of a brush or of a mask, a file beside that of its preset; what it is to be called in presets that are written.
pub type Open<'a> = &'a dyn Fn(&str) -> Result<(String, Image), String>;

/// What is painted where nobody says.
pub const DEFAULT: &str = "sumi";

/// Tables of tables.
const TABLES: [&str; 4] = ["object", "material", "mask", "stroke"];
/// Names that keys take instead of a number.
const NAMES: [&str; 7] = ["doc", "base", "brush", "paper", "manner", "pigment", "wash_pigment"];

/// Those that are built in; the first is what is painted where nobody says.
pub fn presets() -> Result<Vec<Preset>, InkError> {
    let table = parse(include_str!("presets.toml"))?;
    let mut presets = table
        .iter()
        .map(|(name, value)| match value.get_ref() {
            DeValue::Table(keys) => preset(name.get_ref(), keys, &no_pictures),
            _ => Err(InkError::Preset(format!("the preset '{}' is no table", name.get_ref()))),
        })
        .collect::<Result<Vec<_>, _>>()?;
    // The parser sorts by name.
    presets.sort_by_key(|p| p.name != DEFAULT);
    Ok(presets)
}

/// The one called `name`.
pub fn find(name: &str) -> Result<Preset, InkError> {
    let all = presets()?;
    let hint = suggest(name, all.iter().map(|p| p.name.as_str()));
    let found = all.into_iter().find(|p| p.name == name);
    found.ok_or_else(|| InkError::Preset(format!("there is no preset '{name}'{hint}")))
}

/// Whether a name is that of a file of the user's own, and not of a preset that is built in.
pub fn is_file(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// For presets without a file.
pub fn no_pictures(picture: &str) -> Result<(String, Image), String> {
    Err(format!("the picture '{picture}' cannot be opened here"))
}

/// One from the text of a file of the user's own, which `name` calls in errors.
pub fn read(text: &str, name: &str, open: Open) -> Result<Preset, InkError> {
    let table = parse(text).map_err(|e| InkError::Preset(format!("{name}: {e}")))?;
    preset(name, &table, open).map_err(|e| InkError::Preset(format!("{name}: {e}")))
}

/// The text of a file that [`read`] makes the same style of, but for its creases and seed.
pub fn write(style: &Style, doc: &str) -> String {
    let mut out = String::new();
    let pigment = |layer: Layer| style.pigments[layer as usize].name;
    let words = [
        ("doc", doc),
        ("paper", style.paper.name),
        ("pigment", pigment(Layer::Contour)),
        ("wash_pigment", pigment(Layer::Wash)),
        ("manner", style.manner.name),
    ];
    let brush = style.brush.as_ref().map(|b| ("brush", b.name.as_str()));
    for (key, word) in words.into_iter().chain(brush) {
        let _ = writeln!(out, "{key} = {}", quoted(word));
    }
    for c in CONTROLS {
        let value = style.controls.get(c.name).filter(|v| *v != c.default);
        if let Some(v) = value {
            let _ = writeln!(out, "{} = {v}", c.name);
        }
    }
    for (kind, tables) in [("material", &style.steering.materials), ("object", &style.steering.objects)] {
        for (name, changes) in tables {
            let _ = writeln!(out, "\n[{kind}.{}]", quoted(name));
            for (name, v) in changes.iter() {
                let _ = writeln!(out, "{name} = {v}");
            }
        }
    }
    for Mask { name, picture, on, changes } in &style.steering.masks {
        let _ = writeln!(out, "\n[mask.{}]\nimage = {}", quoted(name), quoted(&picture.name));
        let _ = writeln!(out, "on = {}", quoted(&on.to_string()));
        for (name, v) in changes.iter() {
            let _ = writeln!(out, "{name} = {v}");
        }
    }
    for (id, edit) in &style.steering.strokes {
        let _ = writeln!(out, "\n[stroke.{id:08x}]");
        for (name, _) in edit.flags().into_iter().filter(|(_, on)| *on) {
            let _ = writeln!(out, "{name} = true");
        }
        for (name, v) in edit.changes.iter() {
            let _ = writeln!(out, "{name} = {v}");
        }
    }
    out
}

/// A string of TOML.
fn quoted(text: &str) -> String {
    let mut out = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out += &format!("\\u{:04X}", u32::from(c)),
            c => out.push(c),
        }
    }
    out + "\""
}

fn parse(text: &str) -> Result<DeTable<'_>, InkError> {
    let wrong = |e: toml::de::Error| InkError::Preset(e.to_string().trim_end().replace('\n', " "));
    DeTable::parse(text).map(|table| table.into_inner()).map_err(wrong)
}

fn preset(name: &str, keys: &DeTable, open: Open) -> Result<Preset, InkError> {
    let mut style = Style::default();
    let mut doc = String::new();
    // What all else is a change of.
    if let Some(DeValue::String(base)) = keys.get("base").map(|v| v.get_ref()) {
        style = find(base)?.style;
    }
    for (key, value) in keys {
        let key: &str = key.get_ref();
        let named = NAMES.contains(&key);
        match value.get_ref() {
            DeValue::String(word) if key == "doc" => doc = word.to_string(),
            DeValue::String(_) if key == "base" => {}
            DeValue::String(word) if key == "brush" => {
                let (name, picture) = open(word).map_err(InkError::Preset)?;
                style.brush = Some(Arc::new(Bristles::new(&name, &picture)?));
            }
            DeValue::String(word) if named => set_name(&mut style, key, word)?,
            // What floats cannot name is out of every range.
            DeValue::Float(number) if !named && !TABLES.contains(&key) => {
                style.controls.set(key, number.as_str().parse().unwrap_or(f32::NAN))?;
            }
            DeValue::Integer(number) if !named && !TABLES.contains(&key) => {
                style.controls.set(key, number.as_str().parse().unwrap_or(f32::NAN))?;
            }
            DeValue::Table(all) if TABLES.contains(&key) => steer(&mut style.steering, key, all, open)?,
            _ => {
                let known = NAMES.into_iter().chain(TABLES).chain(CONTROLS.iter().map(|c| c.name));
                let what = match named {
                    true => "a name in quotes",
                    false if TABLES.contains(&key) => {
                        "tables, as [object.NAME], [material.NAME], [mask.NAME] and [stroke.ID]"
                    }
                    false => "a number",
                };
                let hint = match known.clone().any(|k| k == key) {
                    true => format!(": expected {what}"),
                    false => suggest(key, known),
                };
                return Err(InkError::Preset(format!("'{key}' cannot be so in a preset{hint}")));
            }
        }
    }
    Ok(Preset { name: name.into(), doc, style })
}

/// Reads the tables of objects, of materials, of masks or of strokes.
fn steer(steering: &mut Steering, kind: &str, all: &DeTable, open: Open) -> Result<(), InkError> {
    // Later ones win over earlier ones of the file, and the parser sorts by name.
    let mut all: Vec<_> = all.iter().collect();
    all.sort_by_key(|(name, _)| name.span().start);
    for (name, value) in all {
        let name: &str = name.get_ref();
        let within = |e: InkError| InkError::Preset(format!("[{kind}.{name}]: {e}"));
        let DeValue::Table(keys) = value.get_ref() else {
            return Err(InkError::Preset(format!("[{kind}.{name}] must be a table of controls")));
        };
        let mut edit = StrokeEdit::default();
        let of_stroke = kind == "stroke";
        let (mut picture, mut on) = (None, Ground::default());
        for (key, value) in keys {
            let key: &str = key.get_ref();
            match value.get_ref() {
                DeValue::String(word) if kind == "mask" && key == "image" => {
                    let opened = open(word).map_err(|e| within(InkError::Preset(e)))?;
                    picture = Some(Arc::new(Grey::new(&opened.0, &opened.1).map_err(within)?));
                    continue;
                }
                DeValue::String(word) if kind == "mask" && key == "on" => {
                    on = Ground::parse(word).map_err(within)?;
                    continue;
                }
                _ if kind == "mask" && ["image", "on"].contains(&key) => {
                    return Err(within(InkError::Preset(format!("'{key}' must be a text in quotes"))));
                }
                _ => {}
            }
            let flag = edit.flag(key).filter(|_| of_stroke);
            let number = match (flag, value.get_ref()) {
                (Some(flag), DeValue::Boolean(on)) => {
                    *flag = *on;
                    continue;
                }
                (Some(_), _) => {
                    return Err(within(InkError::Preset(format!("'{key}' must be true or false"))));
                }
                (None, value) => match value {
                    DeValue::Float(number) => number.as_str().parse().unwrap_or(f32::NAN),
                    DeValue::Integer(number) => number.as_str().parse().unwrap_or(f32::NAN),
                    _ if CONTROLS.iter().any(|c| c.name == key) => {
                        return Err(within(InkError::Preset(format!("'{key}' must be a number"))));
                    }
                    // The name is told.
                    _ => f32::NAN,
                },
            };
            let add = if of_stroke { Changes::of_stroke } else { Changes::of_object };
            add(&mut edit.changes, key, number).map_err(within)?;
        }
        match kind {
            "object" => steering.objects.push((name.into(), edit.changes)),
            "material" => steering.materials.push((name.into(), edit.changes)),
            "mask" => {
                let none = || within(InkError::Preset("expected image = \"FILE\", a grey picture".into()));
                let (name, picture, changes) = (name.into(), picture.ok_or_else(none)?, edit.changes);
                steering.masks.push(Mask { name, picture, on, changes });
            }
            _ => drop(steering.strokes.insert(steering::id(name).map_err(within)?, edit)),
        }
    }
    Ok(())
}

/// What of a style is chosen by a name: [`set_name`]'s keys.
pub const NAMED: [&str; 4] = ["paper", "pigment", "wash_pigment", "manner"];

/// Gives a style a paper, a manner of wrinkles or a pigment by its name.
pub fn set_name(style: &mut Style, key: &str, word: &str) -> Result<(), InkError> {
    let unknown = |what: &str, hint: String| InkError::Preset(format!("there is no {what} '{word}'{hint}"));
    let pigment = || {
        let names = PIGMENTS.iter().map(|p| p.name);
        Pigment::find(word).ok_or_else(|| unknown("pigment", suggest(word, names)))
    };
    match key {
        "paper" => {
            let names = PAPERS.iter().map(|p| p.name);
            style.paper = Paper::find(word).ok_or_else(|| unknown("paper", suggest(word, names)))?;
        }
        "manner" => {
            let names = MANNERS.iter().map(|m| m.name);
            style.manner = Manner::find(word).ok_or_else(|| unknown("manner", suggest(word, names)))?;
        }
        "wash_pigment" => style.pigments[Layer::Wash as usize] = pigment()?,
        "pigment" => {
            // A wash of its own stays.
            let wash = style.pigments[Layer::Wash as usize];
            let own = wash != style.pigments[Layer::Contour as usize];
            style.pigments = pigments(pigment()?);
            if own {
                style.pigments[Layer::Wash as usize] = wash;
            }
        }
        _ => {
            let hint = suggest(key, NAMED);
            return Err(InkError::Preset(format!("'{key}' is not chosen by name{hint}")));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_presets_are_good_and_say_what_they_are() {
        let all = presets().unwrap();
        assert!(all.len() >= 4 && all[0].name == "sumi");
        assert!(all.iter().all(|p| !p.doc.is_empty()));
        assert_eq!(find("boneless").unwrap().style.controls.contour, 0.0);
        let blue = find("blue").unwrap().style;
        assert_eq!(
            (blue.paper.name, blue.pigments[0].name, blue.pigments[3].name),
            ("aged", "indigo", "pine")
        );
    }

    #[test]
    fn tables_of_objects_hold_in_the_order_of_the_file() {
        let tables =
            ["[object.pine]\nink = 0.2", "[object.\"p*\"]\nink = 0.9", "[object.\"*\"]\nwater = 0.1"];
        for order in [[0, 1, 2], [1, 0, 2], [2, 1, 0]] {
            let style = read(&order.map(|i| tables[i]).join("\n"), "own", &no_pictures).unwrap().style;
            let controls = style.steering.controls(&style.controls, "pine", &[""; 0]);
            let later = order.iter().rev().find(|i| **i < 2);
            assert_eq!(controls.ink, if later == Some(&0) { 0.2 } else { 0.9 }, "{order:?}");
            assert_eq!(controls.water, 0.1);
        }
    }

    #[test]
    fn what_is_written_is_read_as_it_was() {
        let own = "doc = 'a \"word\" \\ and 松'\nsize = 0.7\nwash = 2\nlight = 0.1\npaper = 'silk'\npigment = 'oil'\n\
                   wash_pigment = 'indigo'\nmanner = 'rain'\n[object.\"pine*\"]\nink = 0.2\n[object.'a \"b\" \\\u{1f}']\nrub = 1\n\
                   [material.\"wet ro*\"]\nwash = 0.5\n[stroke.0f3a9c12]\nhide = true\npin = true\n[stroke.00000001]\nink = 1.3\nsize = 0.1";
        let texts = presets().unwrap().into_iter().map(|p| write(&p.style, &p.doc)).collect::<Vec<_>>();
        for text in texts.iter().map(String::as_str).chain([own.replace('\u{1f}', "").as_str()]) {
            let a = read(text, "a", &no_pictures).unwrap();
            let b = read(&write(&a.style, &a.doc), "b", &no_pictures).unwrap();
            assert_eq!(a.doc, b.doc);
            let all = |s: &Style| {
                let names = s.pigments.map(|p| p.name);
                (s.controls, s.paper.name, names, s.manner.name, s.steering.clone())
            };
            assert_eq!(all(&a.style), all(&b.style), "{text}");
        }
        // The built-in ones as they are, not only as they are read again.
        for (text, preset) in texts.iter().zip(presets().unwrap()) {
            let again = read(text, "again", &no_pictures).unwrap().style;
            assert_eq!((again.controls, again.pigments), (preset.style.controls, preset.style.pigments));
        }
        // Changes of another, whatever stands first.
        let stroke = |brush: &str| {
            let mut strip = Image::rgb(128, 64);
            strip.data[..3 * 128 * 20].fill(1.0);
            Ok((format!("/brushes/{brush}"), strip))
        };
        let own = read("dryness = 0.2\nbase = 'dry'\nbrush = 'own.png'", "own", &stroke).unwrap();
        let dry = find("dry").unwrap().style;
        assert_eq!((own.style.controls.dryness, own.style.controls.size), (0.2, dry.controls.size));
        assert_eq!(own.style.manner.name, dry.manner.name);
        // It is written by the name that whoever opened it gave.
        assert!(write(&own.style, "").contains("brush = \"/brushes/own.png\""));
        assert!(
            read("brush = 'own.png'", "own", &no_pictures).unwrap_err().to_string().contains("'own.png'")
        );
        // Masks in the order of the file, and their pictures as they are called.
        let own = "[mask.b]\nimage = 'b.png'\nwash = 0.25\n[mask.a]\non = 'object.wet \"r\".*'\nimage = 'a.png'\nink = 1";
        let masks = read(own, "own", &stroke).unwrap().style.steering.masks;
        let said = masks.iter().map(|m| (m.name.as_str(), m.picture.name.as_str(), m.on.to_string()));
        assert_eq!(
            said.collect::<Vec<_>>(),
            [("b", "/brushes/b.png", "picture".into()), ("a", "/brushes/a.png", "object.wet \"r\".*".into())]
        );
        let style = Style { steering: Steering { masks, ..Steering::default() }, ..Style::default() };
        let again = |name: &str| stroke(name).map(|(_, picture)| (name.into(), picture));
        assert_eq!(read(&write(&style, ""), "again", &again).unwrap().style.steering, style.steering);
        // Whatever characters a name has.
        let mut style = Style::default();
        style.steering.objects.push(("a\n\"\u{1f}\\".into(), Default::default()));
        assert_eq!(read(&write(&style, "\t"), "c", &no_pictures).unwrap().style.steering, style.steering);
    }

    #[test]
    fn what_is_wrong_with_a_preset_is_said() {
        let said = |text: &str| read(text, "own.toml", &no_pictures).unwrap_err().to_string();
        for (text, words) in [
            ("dryness = 7", "own.toml: dryness = 7 is out of range: 0 to 1"),
            ("dryeness = 0.5", "did you mean 'dryness'?"),
            ("dryness = 'much'", "'dryness' cannot be so in a preset: expected a number"),
            ("base = 'sumie'", "there is no preset 'sumie'; did you mean 'sumi'?"),
            ("brush = 1", "'brush' cannot be so in a preset: expected a name"),
            ("paper = 3", "'paper' cannot be so in a preset: expected a name"),
            ("paper = 'rav'", "there is no paper 'rav'; did you mean 'raw'?"),
            ("ink = nan", "out of range"),
            ("ink = ", "own.toml: "),
            ("[ink]\na = 1", "expected a number"),
            ("[object.ball]\nwahs = 1", "[object.ball]: there is no control 'wahs'; did you mean 'wash'?"),
            ("[material.clay]\nlight = 1", "[material.clay]: 'light' is of the whole sheet"),
            ("[object.ball]\nbleed = 1", "'bleed' is of the whole sheet"),
            ("[object]\nball = 1", "[object.ball] must be a table"),
            ("object = 1", "expected tables, as [object.NAME]"),
            ("[stroke.12]\nhide = true", "'12' is no stroke: expected data-id"),
            ("[mask.a]\nink = 0", "[mask.a]: expected image = \"FILE\""),
            ("[mask.a]\nimage = 3", "[mask.a]: 'image' must be a text"),
            ("[mask.a]\nimage = 'm.png'", "[mask.a]: the picture 'm.png' cannot be opened here"),
            (
                "[mask.a]\non = 'objct.b'",
                "[mask.a]: a mask cannot lie on 'objct.b': expected picture, object.NAME",
            ),
            ("[mask.a]\nlight = 1", "[mask.a]: 'light' is of the whole sheet"),
            ("[mask.a]\nwahs = 1", "did you mean 'wash'?"),
            ("[mask.a]\nwash = 'much'", "'wash' must be a number"),
            ("[stroke.0f3a9c12]\nwash = 1", "'wash' is not of a stroke; expected hide, pin, ink"),
            ("[stroke.0f3a9c12]\nhide = 'yes'", "'hide' must be true or false"),
        ] {
            assert!(said(text).contains(words), "{text}: {}", said(text));
        }
        assert!(find("sumie").unwrap_err().to_string().contains("did you mean 'sumi'?"));
        assert_eq!(
            read("", "empty", &no_pictures).unwrap().style.controls,
            crate::control::Controls::default()
        );
    }
}
