//! A model as the command line names it: model, preset, form, parameters, measured file.

use anyhow::{Context, Result, bail};
use clap::Args;
use std::path::PathBuf;
use yugen_archive::formats::measured;
use yugen_optics::ColourSpace;
use yugen_reflectance::{Bsdf, Data, Kind, ParamType};
use yugen_scene::nearest;

/// Which model with which parameters.
#[derive(Args)]
pub struct Subject {
    /// The model, as `yugen brdf list` names it, perhaps with MODEL:NAME=VALUE,…; or a measured file: MERL .binary, RGL
    /// or Zemax .bsdf, WINDOW .xml, ALTA .brdf, .astm, UTIA .bin, goniometer .gonio.
    pub model: String,

    #[command(flatten)]
    pub settings: Settings,
}

/// With which parameters.
#[derive(Args, Clone)]
pub struct Settings {
    /// Named parameters to start from, as `yugen brdf show MODEL` lists them.
    #[arg(long, value_name = "NAME")]
    pub preset: Option<String>,

    /// Form of the model, for those that have several; short for --param form=NAME.
    #[arg(long, value_name = "NAME")]
    pub form: Option<String>,

    /// A parameter: name=number, name=r,g,b or name=choice; alpha=V is both alpha_x and alpha_y. May be repeated.
    #[arg(short, long, value_name = "NAME=VALUE")]
    pub param: Vec<String>,

    /// Measured file for models that need one: MERL .binary, RGL .bsdf, or for `tabulated` a goniometer .gonio or what
    /// an instrument wrote (.xml, .bsdf, .brdf, .astm, .bin).
    #[arg(long, value_name = "FILE")]
    pub data: Option<PathBuf>,

    /// The linear RGB space of colours, in and out.
    #[arg(long, default_value = "rec2020", value_parser = ColourSpace::ALL.map(ColourSpace::name), value_name = "SPACE")]
    pub space: String,
}

/// The model with its parameters and table.
pub struct Model {
    /// Which.
    pub kind: Kind,
    /// Values in table order.
    pub slots: Vec<f32>,
    /// Baked.
    pub table: Vec<f32>,
}

impl Model {
    /// Ready to be asked.
    pub fn bsdf(&self) -> Bsdf<'_> {
        Bsdf::new(self.kind, &self.slots, &self.table)
    }
}

/// The model called `name`, or an error that knows what may have been meant.
pub fn find(name: &str) -> Result<Kind> {
    Kind::from_name(name).or_else(|e| {
        let names = || Kind::ALL.iter().map(|k| k.name());
        let has = |k: &&Kind| k.presets().iter().any(|p| p.name == name);
        let owners: Vec<&str> = Kind::ALL.iter().filter(has).map(|k| k.name()).collect();
        // Names that share a whole word are near too: `gold` and `gold_thread`.
        let shares = |n: &&str| n.split('_').any(|w| name.split('_').any(|v| v == w));
        let near: Vec<&str> = match nearest(name, names()) {
            Some(word) => vec![word],
            None => names().filter(shares).collect(),
        };
        let near = match &near[..] {
            [] => String::new(),
            some => format!("; did you mean '{}'?", some.join("' or '")),
        };
        match owners[..] {
            [] if near.is_empty() => bail!("{e}; there are {}", names().collect::<Vec<_>>().join(", ")),
            [] => bail!("{e}{near}"),
            [owner, ..] => bail!(
                "{e}, but a preset of {}: name the model, and the preset with --preset, as in \
                 `yugen brdf eval {owner} --preset {name}`; `yugen brdf show {owner}` lists them{near}",
                owners.join(", ")
            ),
        }
    })
}

/// A model as it was typed, one of perhaps several that a line stands for.
pub struct Named {
    kind: Kind,
    /// What a figure calls it: as it was asked for, in a line, or as `label` says.
    pub label: String,
    preset: Option<String>,
    settings: Vec<(String, String)>,
    /// The measured file, and whether it stood in the place of the model's name.
    data: Option<PathBuf>,
    space: ColourSpace,
}

/// Most models that slashes and `all` may make of one.
const MOST: usize = 64;

impl Settings {
    /// The colour space asked for.
    pub fn space(&self) -> ColourSpace {
        ColourSpace::from_name(&self.space).unwrap_or_default()
    }

    /// The models that `model` stands for, with these settings and its own, which come later.
    pub fn expand(&self, model: &str) -> Result<Vec<Named>> {
        // A name of a file may have a colon; what follows that of a model has an equals sign.
        let (model, own) = match model.split_once(':') {
            Some((name, own)) if own.contains('=') => (name, own),
            _ => (model, ""),
        };
        // No name of a model has a dot.
        let file = model.contains('.').then(|| PathBuf::from(model));
        let mut data = self.data.clone();
        let mut label = None;
        let mut settings: Vec<(String, String)> = Vec::new();
        let pair = |text: &str| -> Result<(String, String)> {
            let (name, value) =
                text.split_once('=').with_context(|| format!("'{text}': expected name=value"))?;
            Ok((name.trim().to_string(), value.trim().to_string()))
        };
        settings.extend(self.preset.iter().map(|p| ("preset".into(), p.clone())));
        settings.extend(self.form.iter().map(|f| ("form".into(), f.clone())));
        for text in &self.param {
            settings.push(pair(text)?);
        }
        let shared = settings.len();
        for piece in own.split(',').filter(|p| !p.is_empty()) {
            match (piece.contains('='), settings.last_mut()) {
                // r,g,b: the comma belongs to the value before it.
                (false, Some((_, value))) if own.contains('=') => {
                    *value = format!("{value},{}", piece.trim())
                }
                _ => settings.push(pair(piece)?),
            }
        }
        let mut title = settings.split_off(shared);
        title.retain(|(name, value)| match name.as_str() {
            "data" => {
                data = Some(PathBuf::from(value));
                false
            }
            "label" => {
                label = Some(value.clone());
                false
            }
            _ => true,
        });
        settings.extend(title);
        let (kind, data) = match (file, data) {
            (Some(file), Some(_)) => bail!("{} and --data are two measured files", file.display()),
            (Some(file), None) => (measured::kind(&file)?, Some(file)),
            (None, data) => (find(model)?, data),
        };
        let stands = if model.contains('.') {
            PathBuf::from(model).file_name().map(|n| n.to_string_lossy().into_owned())
        } else {
            None
        };
        let base = stands.unwrap_or_else(|| kind.name().to_string());

        let mut all: Vec<Vec<(String, String)>> = vec![Vec::new()];
        for (name, value) in settings {
            let values: Vec<String> = match kind.param(&name) {
                Ok((_, param)) if value == "all" && matches!(param.kind, ParamType::Choice(_)) => {
                    let ParamType::Choice(names) = param.kind else { continue };
                    names.iter().map(|n| n.to_string()).collect()
                }
                _ => value.split('/').map(str::to_string).collect(),
            };
            if all.len() * values.len() > MOST {
                bail!("{model}: {name}={value} makes more than {MOST} models of one");
            }
            all = all
                .iter()
                .flat_map(|before| {
                    values.iter().map(|v| [&before[..], &[(name.clone(), v.clone())]].concat())
                })
                .collect();
        }
        let labels: Option<Vec<&str>> = label.as_ref().map(|l| l.split('/').collect());
        let count = all.len();
        let named = all.into_iter().enumerate().map(|(i, mut settings)| {
            let mut words = vec![base.clone()];
            words.extend(
                settings.iter().map(|(n, v)| if n == "preset" { v.clone() } else { format!("{n}={v}") }),
            );
            let preset = settings.iter().rposition(|(n, _)| n == "preset").map(|at| settings.remove(at).1);
            settings.retain(|(n, _)| n != "preset");
            if let (Some(file), false) = (&data, model.contains('.')) {
                words.extend(file.file_name().map(|n| n.to_string_lossy().into_owned()));
            }
            let label = match &labels {
                Some(all) if all.len() == count => all[i].to_string(),
                Some(_) => format!("{} {}", label.as_deref().unwrap_or_default(), words[1..].join(" ")),
                None => words.join(" "),
            };
            Named { kind, label, preset, settings, data: data.clone(), space: self.space() }
        });
        Ok(named.collect())
    }
}

impl Subject {
    /// The colour space asked for.
    pub fn space(&self) -> ColourSpace {
        self.settings.space()
    }

    /// The one model that is meant.
    pub fn named(&self) -> Result<Named> {
        let mut all = self.settings.expand(&self.model)?;
        match (all.pop(), all.len()) {
            (Some(one), 0) => Ok(one),
            (_, more) => bail!("{} stands for {} models; expected one", self.model, more + 1),
        }
    }

    /// Builds it.
    pub fn build(&self) -> Result<Model> {
        self.named()?.build()
    }
}

impl Named {
    /// Builds it.
    pub fn build(&self) -> Result<Model> {
        let kind = self.kind;
        let (mut slots, mut data) = match &self.preset {
            Some(name) => kind.preset(name, self.space)?,
            None => (kind.defaults(), Vec::new()),
        };
        for (name, value) in &self.settings {
            set(kind, &mut slots, name, value)?;
        }
        if let Some(file) = &self.data {
            data = measured::read(file, kind, self.space)?;
        }
        if let (Data::Required(what), true) = (kind.data(), data.is_empty()) {
            let presets: Vec<_> = kind.presets().iter().map(|p| p.name).collect();
            bail!(
                "{} needs {what}: give --data FILE, or --preset with one of {}",
                kind.name(),
                presets.join(", ")
            );
        }
        let table = kind.bake(&slots, &data)?;
        Ok(Model { kind, slots, table })
    }
}

/// Sets a parameter, or both of a pair that differ in their axis alone, as `alpha` for `alpha_x` and `alpha_y`.
fn set(kind: Kind, slots: &mut [f32], name: &str, value: &str) -> Result<()> {
    let pair = [format!("{name}_x"), format!("{name}_y")];
    if kind.param(name).is_err() && pair.iter().all(|n| kind.param(n).is_ok()) {
        return pair.iter().try_for_each(|n| set(kind, slots, n, value));
    }
    let (at, param) =
        kind.param(name).or_else(|e| match nearest(name, kind.params().iter().map(|p| p.name)) {
            Some(word) => bail!("{e}; did you mean '{word}'?"),
            None => bail!(e),
        })?;
    if let ParamType::Choice(names) = param.kind {
        let Some(i) = names.iter().position(|n| *n == value) else {
            bail!("'{value}' is no {name} of {}; expected one of {}", kind.name(), names.join(", "));
        };
        slots[at] = i as f32;
        return Ok(());
    }
    let numbers: Vec<f32> = value
        .split(',')
        .map(|v| v.trim().parse::<f32>().ok().filter(|v| v.is_finite()))
        .collect::<Option<_>>()
        .with_context(|| {
            format!(
                "{name}={value}: expected {}",
                if param.width() == 3 { "r,g,b or one number" } else { "a number" }
            )
        })?;
    if let Some(bad) = numbers.iter().find(|v| !(param.min..=param.max).contains(v)) {
        let expected = format!("{} to {} {}", param.min, param.max, param.unit);
        bail!("{name} is {bad}; expected {}", expected.trim_end());
    }
    match (param.width(), numbers.as_slice()) {
        (w, [v]) => slots[at..at + w].fill(*v),
        (3, [_, _, _]) => slots[at..at + 3].copy_from_slice(&numbers),
        (w, _) => bail!("{name}={value}: expected {w} number{}", if w == 1 { "" } else { "s" }),
    }
    Ok(())
}
