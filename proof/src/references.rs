//! The furnace against published albedos: `reference/albedos.txt`, the one place where they are written.

use crate::Subject;
use crate::laws::{Finding, albedo};
use glam::Vec3;
use std::f32::consts::FRAC_PI_2;
use yugen_optics::frame::spherical;
use yugen_reflectance::{Bsdf, Kind, ParamType};

/// Parameters of a model and the albedos it must have with them.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Which model.
    pub kind: Kind,
    /// As the file says it: `form=gmd diffuse=0 …`.
    pub label: String,
    /// Values in table order.
    pub slots: Vec<f32>,
    /// Direction as the file says it, the same as a vector, and the albedo for every channel.
    pub albedos: Vec<(String, Vec3, f64)>,
}

/// What is written of `kind`; empty where nothing is.
pub fn references(kind: Kind) -> Vec<Reference> {
    let file = include_str!("../reference/albedos.txt");
    let lines = file.lines().map(str::trim).enumerate().filter(|(_, l)| !l.is_empty() && !l.starts_with('#'));
    lines
        .map(|(i, line)| parse(line).unwrap_or_else(|e| panic!("albedos.txt:{}: {e}", i + 1)))
        .filter(|r| r.kind == kind)
        .collect()
}

fn parse(line: &str) -> Result<Reference, String> {
    let number = |text: &str| text.parse::<f64>().map_err(|_| format!("'{text}' is not a number"));
    let (set, albedos) = line.split_once(':').ok_or("expected `model parameters : albedos`")?;
    let (model, label) = set.trim().split_once(' ').ok_or("expected parameters")?;
    let kind = Kind::from_name(model).map_err(|e| e.to_string())?;
    let mut slots = kind.defaults();
    for pair in label.split_whitespace() {
        let (name, value) = pair.split_once('=').ok_or(format!("'{pair}' is not name=value"))?;
        let (at, param) = kind.param(name).map_err(|e| e.to_string())?;
        let value = match param.kind {
            ParamType::Choice(names) => {
                names.iter().position(|n| *n == value).ok_or(format!("there is no {name} '{value}'"))? as f32
            }
            _ => number(value)? as f32,
        };
        slots[at..at + param.width()].fill(value);
    }
    let one = |text: &str| {
        let (direction, value) = text.trim().split_once(' ').ok_or(format!("'{text}' is not an albedo"))?;
        let (degrees, phi) = direction.strip_suffix('y').map_or((direction, 0.0), |d| (d, FRAC_PI_2));
        let wo = spherical((number(degrees)? as f32).to_radians(), phi);
        Ok((direction.to_string(), wo, number(value.trim())?))
    };
    let albedos = albedos.split(',').map(one).collect::<Result<_, String>>()?;
    Ok(Reference { kind, label: label.to_string(), slots, albedos })
}

impl Reference {
    /// Value: the largest difference of the albedo from the published one. `subject` is the model itself, or
    /// something wrong in its place.
    pub fn compare(&self, subject: &dyn Subject) -> Finding {
        // The numbers have five digits, and four where g is tabulated: there the worst seen is 4.5e-5, elsewhere
        // 1.2e-5.
        let mut finding = Finding::new(2e-4, 1e-2);
        for (direction, wo, want) in &self.albedos {
            let got = albedo(subject, *wo).value;
            for channel in got.to_array().map(f64::from) {
                finding.see((channel - want).abs(), || format!("at {direction}: {channel:.5} for {want:.5}"));
            }
        }
        finding
    }

    /// Calls `f` with the model.
    pub fn with<R>(&self, f: impl FnOnce(&dyn Subject) -> R) -> R {
        let table = self.kind.bake(&self.slots, &[]).unwrap_or_else(|e| panic!("{}: {e}", self.label));
        f(&Bsdf::new(self.kind, &self.slots, &table))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_whole_file_is_read_and_a_mistake_in_it_is_told() {
        let all: Vec<Reference> = Kind::ALL.iter().flat_map(|k| references(*k)).collect();
        assert_eq!(all.len(), 36);
        assert_eq!(all.iter().map(|r| r.albedos.len()).sum::<usize>(), 162);
        for (line, what) in [
            ("phong exponent=10 0 1", "albedos"),
            ("fong exponent=10 : 0 1", "fong"),
            ("phong exponant=10 : 0 1", "exponant"),
            ("phong form=square : 0 1", "square"),
            ("phong exponent=ten : 0 1", "ten"),
            ("phong exponent=10 : 0x 1", "0x"),
        ] {
            let told = parse(line).expect_err(line);
            assert!(told.contains(what), "{line}: {told}");
        }
    }
}
