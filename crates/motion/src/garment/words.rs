//! Garments from a line of text.

use super::{CUTS, Cutting, Form, Garment, GarmentError, STYLES, Style, Wear};
use crate::cloth::{Fabric, PRESETS};
use crate::dance::Parameter;

/// Edges with which a garment is tried, m.
const COARSE: f32 = 0.05;
/// The most garments of an outfit: under- and over-robe, trousers, and as many again.
const MOST: usize = 6;

/// Reads a garment, as [`outfit`] reads several, for the player.
///
/// # Errors
/// As there, and more garments than one.
pub fn parse(text: &str) -> Result<Garment, GarmentError> {
    let all = read(text, 1.0)?;
    match all.get(1) {
        Some(second) => Err(second.wrong(format!("there are {} garments; one was expected", all.len()))),
        None => all[0].make(),
    }
}

/// A garment whose words are read: its cut, measures so far, way to wear it, cloth and line.
struct Words {
    cut: &'static Cutting,
    values: Vec<f32>,
    style: &'static Style,
    fabric: Option<Fabric>,
    line: usize,
}

/// Reads what a figure wears, the innermost first: of each garment the name of a cut, then measures that differ from its own, as in
/// `kosode length=1.45`, the way to wear it ([`STYLES`]) and what it is made of ([`PRESETS`]); what follows a # is for people, and lines
/// may be broken anywhere between words. The wearer is `size` times as tall as the player: measures that the text does not give are so much
/// longer, within their ranges.
///
/// # Errors
/// Names and numbers that are none, trousers over a robe and more than six garments, with their line.
pub fn outfit(text: &str, size: f32) -> Result<Vec<Garment>, GarmentError> {
    let words = read(text, size)?;
    let all = words.iter().map(Words::make).collect::<Result<Vec<_>, _>>()?;
    for (at, above) in all.windows(2).zip(&words[1..]) {
        if at[0].wear.form.legs().is_none() && at[1].wear.form.legs().is_some() {
            return Err(above.wrong(format!(
                "'{}' was expected before '{}': trousers are worn below robes",
                at[1].name, at[0].name
            )));
        }
    }
    Ok(all)
}

/// Words of one garment at least.
fn read(text: &str, size: f32) -> Result<Vec<Words>, GarmentError> {
    let mut all: Vec<Words> = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let wrong = |problem: String| GarmentError::Text { line: i + 1, problem };
        for word in line.split('#').next().unwrap_or_default().split_whitespace() {
            let short: String = word.chars().take(40).collect();
            if let Some(cut) = CUTS.iter().find(|c| c.name == word) {
                if all.len() == MOST {
                    return Err(wrong(format!(
                        "'{word}' is one garment too many; at most {MOST} are worn at once"
                    )));
                }
                let values = cut.measures.iter().map(|m| made(m, size)).collect();
                all.push(Words { cut, values, style: &STYLES[0], fabric: None, line: i + 1 });
                continue;
            }
            let Some(words) = all.last_mut() else {
                return Err(wrong(format!("'{short}' is no cut; expected one of {}", cuts())));
            };
            if let Some(named) = STYLES.iter().find(|s| s.name == word) {
                words.style = named;
                continue;
            }
            if let Some(preset) = Fabric::preset(word) {
                words.fabric = Some(preset.fabric);
                continue;
            }
            let pair = word.split_once('=');
            let at = pair.and_then(|(key, _)| words.cut.measures.iter().position(|m| m.name == key));
            let (Some((_, value)), Some(at)) = (pair, at) else {
                let names: Vec<String> =
                    words.cut.measures.iter().map(|m| format!("{}={}", m.name, m.default)).collect();
                let styles: Vec<&str> = STYLES.iter().map(|s| s.name).collect();
                let fabrics: Vec<&str> = PRESETS.iter().map(|p| p.name).collect();
                return Err(wrong(format!(
                    "'{short}' is no measure of a {}; it has {}; no way to wear it, as {}; no fabric, as {}; and no other garment, as {}",
                    words.cut.name,
                    names.join(", "),
                    styles.join(", "),
                    fabrics.join(", "),
                    cuts()
                )));
            };
            let [low, high] = words.cut.measures[at].range;
            let number = value.parse().ok().filter(|v: &f32| (low..=high).contains(v));
            words.values[at] = number.ok_or_else(|| {
                let (name, value) = (words.cut.measures[at].name, value.chars().take(40).collect::<String>());
                wrong(format!("'{name}' of a {} is '{value}'; expected {low} to {high} m", words.cut.name))
            })?;
        }
    }
    if all.is_empty() {
        let problem = format!("there is no garment; expected one of {}", cuts());
        return Err(GarmentError::Text { line: 1, problem });
    }
    Ok(all)
}

/// Names of all cuts.
fn cuts() -> String {
    CUTS.iter().map(|c| c.name).collect::<Vec<_>>().join(", ")
}

impl Words {
    fn wrong(&self, problem: String) -> GarmentError {
        GarmentError::Text { line: self.line, problem }
    }

    fn make(&self) -> Result<Garment, GarmentError> {
        let mut garment = (self.cut.make)(&self.values);
        garment.fabric = self.fabric;
        let wrong = |problem: String| self.wrong(problem);
        if garment.wear.form.legs().is_some() && self.style.name != STYLES[0].name {
            return Err(wrong(format!("a {} is not worn {}: it is no robe", self.cut.name, self.style.name)));
        }
        (self.style.change)(&mut garment.wear);
        let Wear { bare, form, depth, .. } = garment.wear;
        if bare {
            let not =
                |why: String| wrong(format!("a {} is not worn {}: {why}", self.cut.name, self.style.name));
            if form != Form::Wrapped {
                return Err(not("only a robe that is wrapped and sewn at its sides is, as a kosode".into()));
            }
            let most = garment.wear.folded();
            if depth > most {
                return Err(not(format!(
                    "its sleeves end {depth:.2} m below the shoulder; {most:.2} m, above the belt, were expected at the most"
                )));
            }
        }
        // Each measure is within its range; together they may make no garment.
        garment
            .cut(COARSE)
            .map_err(|e| wrong(format!("{e}: these measures of a {} do not go together", self.cut.name)))?;
        let ([_, belt], length) = (garment.wear.belt, garment.wear.length);
        if belt > length {
            return Err(wrong(format!(
                "a belt {belt:.2} m below the shoulder does not meet a {} of {length:.2} m",
                self.cut.name
            )));
        }
        Ok(garment)
    }
}

/// A measure for a wearer of some size.
fn made(measure: &Parameter, size: f32) -> f32 {
    let [low, high] = measure.range;
    (measure.default * size).clamp(low, high)
}
