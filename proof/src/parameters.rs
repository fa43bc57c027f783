//! Parameter sets from the parameter table: defaults, presets, corners, random.

use yugen_optics::ColourSpace;
use yugen_optics::random::Pcg32;
use yugen_reflectance::{Bsdf, Data, Kind, ParamType};

/// One set, with the table baked for it.
#[derive(Clone, Debug)]
pub struct Parameters {
    /// Which model.
    pub kind: Kind,
    /// What it is, for people: `default`, `preset x`, `alpha at its minimum`, `random 3`.
    pub label: String,
    /// Values in table order.
    pub slots: Vec<f32>,
    /// From [`Kind::bake`].
    pub table: Vec<f32>,
}

impl Parameters {
    /// The model with these.
    pub fn bsdf(&self) -> Bsdf<'_> {
        Bsdf::new(self.kind, &self.slots, &self.table)
    }
}

/// A value between the bounds of a parameter. Where the range spans decades (roughness, exponents) half of
/// the draws are uniform in the logarithm.
fn draw(kind: ParamType, min: f32, max: f32, rng: &mut Pcg32) -> f32 {
    match kind {
        ParamType::Choice(names) => (rng.next_f32() * names.len() as f32).floor(),
        _ if min > 0.0 && max > 20.0 * min && rng.next_f32() < 0.5 => min * (max / min).powf(rng.next_f32()),
        _ => min + (max - min) * rng.next_f32(),
    }
}

/// The default set first, then presets, each parameter alone at its ends (or each of its forms), all at their
/// ends together, and `random` draws. `data` is what [`Kind::bake`] takes. Sets that `bake` refuses are left
/// out, the default excepted: its error is returned.
pub fn parameter_sets(kind: Kind, data: &[f32], random: usize) -> Result<Vec<Parameters>, String> {
    let defaults = kind.defaults();
    let mut slots: Vec<(String, Vec<f32>, Option<Vec<f32>>)> =
        vec![("default".into(), defaults.clone(), None)];
    for p in kind.presets() {
        let (values, own) = kind.preset(p.name, ColourSpace::default()).map_err(|e| e.to_string())?;
        slots.push((format!("preset {}", p.name), values, Some(own)));
    }
    let (mut low, mut high) = (defaults.clone(), defaults.clone());
    let mut at = 0;
    for p in kind.params() {
        let span = at..at + p.width();
        at = span.end;
        low[span.clone()].fill(p.min);
        high[span.clone()].fill(p.max);
        let ends: Vec<(String, f32)> = match p.kind {
            ParamType::Choice(names) => {
                names.iter().enumerate().map(|(i, n)| (format!("{} = {n}", p.name), i as f32)).collect()
            }
            _ => vec![
                (format!("{} at its minimum {}", p.name, p.min), p.min),
                (format!("{} at its maximum {}", p.name, p.max), p.max),
            ],
        };
        for (label, value) in ends {
            let mut set = defaults.clone();
            set[span.clone()].fill(value);
            if set != defaults {
                slots.push((label, set, None));
            }
        }
    }
    slots.push(("all at their minimum".into(), low, None));
    slots.push(("all at their maximum".into(), high, None));
    let mut rng = Pcg32::new(0x9e3779b97f4a7c15, 0x7061);
    for i in 0..random {
        let set = kind
            .params()
            .iter()
            .flat_map(|p| (0..p.width()).map(|_| draw(p.kind, p.min, p.max, &mut rng)).collect::<Vec<_>>())
            .collect();
        slots.push((format!("random {i}"), set, None));
    }
    let mut sets = Vec::new();
    for (label, slots, own) in slots {
        match kind.bake(&slots, own.as_deref().unwrap_or(data)) {
            Ok(table) => sets.push(Parameters { kind, label, slots, table }),
            Err(e) if label == "default" => return Err(e.to_string()),
            Err(_) => {}
        }
    }
    Ok(sets)
}

/// The numbers of the first preset that has any, for models that need some from outside; empty for others.
pub fn example_data(kind: Kind) -> Vec<f32> {
    let presets = if matches!(kind.data(), Data::Required(_)) { kind.presets() } else { &[] };
    presets
        .iter()
        .filter_map(|p| kind.preset(p.name, ColourSpace::default()).ok())
        .map(|(_, data)| data)
        .find(|data| !data.is_empty())
        .unwrap_or_default()
}

/// For every form of every choice (or the model itself where there is none): `count` sets with each other
/// parameter at its default, its minimum, its maximum or anywhere between. Sets that `bake` refuses are left
/// out.
pub(crate) fn spare_sets(kind: Kind, data: &[f32], count: usize) -> Vec<Parameters> {
    let mut forms = vec![None];
    let mut at = 0;
    for p in kind.params() {
        if let ParamType::Choice(names) = p.kind {
            forms.extend((0..names.len()).map(|i| Some((at, i as f32))));
        }
        at += p.width();
    }
    if forms.len() > 1 {
        forms.remove(0);
    }
    let mut rng = Pcg32::new(0x2545f4914f6cdd1d, 0x7370);
    let mut sets = Vec::new();
    for (i, form) in forms.iter().cycle().take(forms.len() * count).enumerate() {
        let mut slots = Vec::new();
        for p in kind.params() {
            let uniform = p.width() == 1 || rng.next_f32() < 0.5;
            let ends = [Some(p.default[0]), Some(p.min), Some(p.max), None][(rng.next_u32() >> 30) as usize];
            for _ in 0..p.width() {
                let free = draw(p.kind, p.min, p.max, &mut rng);
                slots.push(if uniform { ends.unwrap_or(free) } else { free });
            }
        }
        if let Some((at, value)) = *form {
            slots[at] = value;
        }
        if let Ok(table) = kind.bake(&slots, data) {
            let label = format!("{slots:?}");
            sets.push(Parameters { kind, label: format!("spare set {i} {label}"), slots, table });
        }
    }
    sets
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_stay_inside_the_table() {
        for &kind in Kind::ALL {
            let Ok(sets) = parameter_sets(kind, &[], 5) else { continue };
            assert_eq!(sets[0].slots, kind.defaults());
            for set in sets.iter().filter(|s| !s.label.starts_with("preset")) {
                let mut values = set.slots.iter();
                for p in kind.params() {
                    for v in values.by_ref().take(p.width()) {
                        assert!(
                            (p.min..=p.max).contains(v),
                            "{} {}: {} = {v}",
                            kind.name(),
                            set.label,
                            p.name
                        );
                    }
                }
            }
        }
        assert!(parameter_sets(Kind::Lambert, &[], 5).unwrap().len() >= 9);
    }
}
