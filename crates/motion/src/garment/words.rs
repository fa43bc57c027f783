//! A garment from a line of text.

use super::{CUTS, Garment, GarmentError, STYLES};
use crate::dance::Parameter;

/// Edges with which a garment is tried, m.
const COARSE: f32 = 0.05;

/// Reads a garment: the name of a cut, then measures that differ from its own, as in `kosode length=1.45`, and the way to wear it ([`STYLES`]); what follows a # is
/// for people, and lines may be broken anywhere between words.
///
/// # Errors
/// Names and numbers that are none, with their line.
pub fn parse(text: &str) -> Result<Garment, GarmentError> {
    parse_for(text, 1.0)
}

/// As [`parse`], for a wearer who is so many times as tall as the player: measures that the text does not give are so much longer,
/// within their ranges.
///
/// # Errors
/// As there.
pub fn parse_for(text: &str, size: f32) -> Result<Garment, GarmentError> {
    let mut found: Option<(&super::Cutting, Vec<f32>)> = None;
    let mut style = &STYLES[0];
    for (i, line) in text.lines().enumerate() {
        let wrong = |problem: String| GarmentError::Text { line: i + 1, problem };
        for word in line.split('#').next().unwrap_or_default().split_whitespace() {
            let short: String = word.chars().take(40).collect();
            let Some((cut, values)) = &mut found else {
                let cut = CUTS.iter().find(|c| c.name == word).ok_or_else(|| {
                    let names: Vec<&str> = CUTS.iter().map(|c| c.name).collect();
                    wrong(format!("'{short}' is no cut; expected one of {}", names.join(", ")))
                })?;
                found = Some((cut, cut.measures.iter().map(|m| made(m, size)).collect()));
                continue;
            };
            if let Some(named) = STYLES.iter().find(|s| s.name == word) {
                style = named;
                continue;
            }
            let pair = word.split_once('=');
            let at = pair.and_then(|(key, _)| cut.measures.iter().position(|m| m.name == key));
            let (Some((_, value)), Some(at)) = (pair, at) else {
                let names: Vec<String> =
                    cut.measures.iter().map(|m| format!("{}={}", m.name, m.default)).collect();
                let styles: Vec<&str> = STYLES.iter().map(|s| s.name).collect();
                return Err(wrong(format!(
                    "'{short}' is no measure of a {}; it has {}; and no way to wear it, as {}",
                    cut.name,
                    names.join(", "),
                    styles.join(", ")
                )));
            };
            let [low, high] = cut.measures[at].range;
            let number = value.parse().ok().filter(|v: &f32| (low..=high).contains(v));
            values[at] = number.ok_or_else(|| {
                let name = cut.measures[at].name;
                let value: String = value.chars().take(40).collect();
                wrong(format!("'{name}' of a {} is '{value}'; expected {low} to {high} m", cut.name))
            })?;
        }
    }
    match found {
        Some((cut, values)) => {
            let mut garment = (cut.make)(&values);
            (style.change)(&mut garment.wear);
            let wrong = |problem: String| GarmentError::Text { line: 1, problem };
            // Each measure is within its range; together they may make no garment.
            garment.cut(COARSE).map_err(|e| wrong(format!("{e}: these measures do not go together")))?;
            let ([_, belt], length) = (garment.wear.belt, garment.wear.length);
            if belt > length {
                return Err(wrong(format!(
                    "a belt {belt:.2} m below the shoulder meets no robe of {length:.2} m"
                )));
            }
            Ok(garment)
        }
        None => {
            let names: Vec<&str> = CUTS.iter().map(|c| c.name).collect();
            let problem = format!("there is no garment; expected one of {}", names.join(", "));
            Err(GarmentError::Text { line: 1, problem })
        }
    }
}

/// A measure for a wearer of some size.
fn made(measure: &Parameter, size: f32) -> f32 {
    let [low, high] = measure.range;
    (measure.default * size).clamp(low, high)
}
