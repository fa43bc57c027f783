//! A model as the command line names it: model, preset, form, parameters, measured file.

use anyhow::{Context, Result, bail};
use clap::Args;
use std::path::PathBuf;
use yugen_archive::formats::measured;
use yugen_optics::ColourSpace;
use yugen_reflectance::{Bsdf, Data, Kind, ParamType};

/// Which model with which parameters.
#[derive(Args)]
pub struct Subject {
    /// The model, as `yugen brdf list` names it; or a measured file: MERL .binary, RGL .bsdf, goniometer .gonio.
    pub model: String,

    /// Named parameters to start from, as `yugen brdf show MODEL` lists them.
    #[arg(long, value_name = "NAME")]
    pub preset: Option<String>,

    /// Form of the model, for those that have several; short for --param form=NAME.
    #[arg(long, value_name = "NAME")]
    pub form: Option<String>,

    /// A parameter: name=number, name=r,g,b or name=choice. May be repeated.
    #[arg(short, long, value_name = "NAME=VALUE")]
    pub param: Vec<String>,

    /// Measured file for models that need one: MERL .binary, RGL .bsdf, or a goniometer .gonio.
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
        let known = Kind::ALL.iter().map(|k| k.name());
        if let Some(word) = yugen_archive::nearest(name, known) {
            bail!("{e}; did you mean '{word}'?");
        }
        let has = |k: &&Kind| k.presets().iter().any(|p| p.name == name);
        let owners: Vec<&str> = Kind::ALL.iter().filter(has).map(|k| k.name()).collect();
        match owners[..] {
            [] => bail!("{e}; `yugen brdf list` lists them"),
            [owner, ..] => bail!(
                "{e}, but a preset of {}: name the model, and the preset with --preset, as in \
                 `yugen brdf eval {owner} --preset {name}`; `yugen brdf show {owner}` lists them",
                owners.join(", ")
            ),
        }
    })
}

impl Subject {
    /// The colour space asked for.
    pub fn space(&self) -> ColourSpace {
        ColourSpace::from_name(&self.space).unwrap_or_default()
    }

    /// What was asked for, in a line.
    pub fn title(&self) -> String {
        let name = |file: &PathBuf| file.file_name().map(|n| n.to_string_lossy().into_owned());
        let mut words = vec![self.file().as_ref().and_then(name).unwrap_or_else(|| self.model.clone())];
        words.extend(self.preset.clone());
        words.extend(self.form.iter().map(|f| format!("form={f}")));
        words.extend(self.param.iter().cloned());
        words.extend(self.data.iter().filter_map(name));
        words.join(" ")
    }

    /// The measured file that stands in the place of a model's name. No name of a model has a dot.
    fn file(&self) -> Option<PathBuf> {
        self.model.contains('.').then(|| PathBuf::from(&self.model))
    }

    /// Builds it.
    pub fn build(&self) -> Result<Model> {
        let file = self.file();
        let kind = match &file {
            Some(file) if self.data.is_some() => {
                bail!("{} and --data are two measured files", file.display())
            }
            Some(file) => measured::kind(file)?,
            None => find(&self.model)?,
        };
        let (mut slots, mut data) = match &self.preset {
            Some(name) => kind.preset(name, self.space())?,
            None => (kind.defaults(), Vec::new()),
        };
        let form = self.form.iter().map(|f| format!("form={f}"));
        for setting in form.chain(self.param.iter().cloned()) {
            let (name, value) =
                setting.split_once('=').with_context(|| format!("'{setting}': expected name=value"))?;
            set(kind, &mut slots, name.trim(), value.trim())?;
        }
        if let Some(file) = self.data.as_ref().or(file.as_ref()) {
            data = measured::read(file, kind, self.space())?;
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

fn set(kind: Kind, slots: &mut [f32], name: &str, value: &str) -> Result<()> {
    let (at, param) = kind.param(name)?;
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
