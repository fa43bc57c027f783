//! Which pictures are whose, and what the folder says of them.

use super::{Hdr, MAX_TEXT};
use anyhow::{Context, Result, ensure};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use yugen_archive::formats::exposures::{self, Exposure};
use yugen_archive::formats::{exif, image, lp, stack};
use yugen_archive::read_bounded;

/// A picture and how long it was exposed.
pub(super) struct Photograph {
    pub path: PathBuf,
    pub seconds: f32,
}

/// The bracket of a light.
pub(super) struct Light {
    pub name: String,
    pub photographs: Vec<Photograph>,
}

/// The lights of a stack in the order of its pictures, and their intensities.
pub(super) type Listed = (Vec<lp::Entry>, Vec<[f32; 3]>);

impl Hdr {
    /// Every light with its exposures, shortest first.
    pub(super) fn photographs(&self, folder: bool) -> Result<Vec<Light>> {
        let list = self.list.clone().or_else(|| {
            let usual = self.input[0].join("exposures.csv");
            (folder && usual.is_file()).then_some(usual)
        });
        let mut lights: BTreeMap<String, Vec<Photograph>> = BTreeMap::new();
        match list {
            Some(path) => {
                let all = exposures::read(&read_bounded(&path, MAX_TEXT)?, &path)?;
                let at = |name: &str| -> Result<PathBuf> {
                    let bare = Path::new(name).file_name().unwrap_or_default();
                    let found = if folder {
                        Some(self.input[0].join(bare)).filter(|p| p.is_file())
                    } else {
                        self.input.iter().find(|p| p.file_name() == Some(bare)).cloned()
                    };
                    found.with_context(|| format!("{}: the picture '{name}' is not there", path.display()))
                };
                for Exposure { file, seconds, light } in &all {
                    let name = if light.is_empty() { "merged" } else { light };
                    ensure!(
                        !name.contains(['/', '\\']) && !name.starts_with('.'),
                        "{}: the light '{name}' cannot name a file; leave out / and \\ and a dot in front",
                        path.display()
                    );
                    let photograph = Photograph { path: at(file)?, seconds: *seconds };
                    lights.entry(name.to_string()).or_default().push(photograph);
                }
                ensure!(folder || lights.len() == 1, "{}: several lights need a folder", path.display());
            }
            None => {
                for path in
                    if folder { stack::pictures(&self.input[0], &[stack::MASK])? } else { self.input.clone() }
                {
                    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                    let name = match stem.rsplit_once('_') {
                        Some((light, _)) if folder && !light.is_empty() => light.to_string(),
                        _ if folder => stem,
                        _ => "merged".into(),
                    };
                    image::check_kind(&path)?;
                    let seconds = exif::read(&path)?.seconds.with_context(|| {
                        format!(
                            "{}: there is no exposure time in it; give the times with --list (columns file, seconds, light)",
                            path.display()
                        )
                    })?;
                    lights.entry(name).or_default().push(Photograph { path, seconds });
                }
                for photographs in lights.values() {
                    same_settings(photographs)?;
                }
            }
        }
        if lights.is_empty() {
            return Err(stack::no_picture(&self.input[0]).into());
        }
        Ok(lights
            .into_iter()
            .map(|(name, mut photographs)| {
                photographs.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
                Light { name, photographs }
            })
            .collect())
    }

    /// The list of lights of the stack and their intensities (none: all alike), if there is a list.
    pub(super) fn listed(
        &self,
        lights: &[Light],
        folder: bool,
        options: &stack::Options,
    ) -> Result<Option<Listed>> {
        let usual = stack::inside(&self.input[0], &options.lights);
        let path = match &self.lights {
            Some(path) => path.clone(),
            None if folder && usual.is_file() => usual,
            None => return Ok(None),
        };
        ensure!(folder, "--lights is for a folder of brackets, one a light");
        let known = lp::read(&read_bounded(&path, MAX_TEXT)?, &path, options.axes)?;
        let intensities = &options.intensities;
        ensure!(
            intensities.is_empty() || intensities.len() == known.len(),
            "{}: there are {} intensities for the {} lights of {}; expected one a light",
            self.input[0].join(stack::OPTIONS).display(),
            intensities.len(),
            known.len(),
            path.display()
        );
        let stem = |name: &str| -> String {
            let bare = name.rsplit(['/', '\\']).next().unwrap_or(name);
            Path::new(bare).file_stem().unwrap_or_default().to_string_lossy().into_owned()
        };
        let place = |light: &Light| {
            let named = |e: &lp::Entry| {
                let name = stem(&e.file);
                name == light.name
                    || light.photographs.iter().any(|p| stem(&p.path.to_string_lossy()) == name)
            };
            known.iter().position(named).with_context(|| {
                format!(
                    "{}: there is no light '{}'; name it so, or as one of its pictures",
                    path.display(),
                    light.name
                )
            })
        };
        let found = lights.iter().map(place).collect::<Result<Vec<_>>>()?;
        let entry = |(light, &i): (&Light, &usize)| lp::Entry {
            file: format!("{}.exr", light.name),
            light: known[i].light,
        };
        let entries = lights.iter().zip(&found).map(entry).collect();
        Ok(Some((entries, found.iter().filter_map(|&i| intensities.get(i).copied()).collect())))
    }
}

/// Only the time may change within a bracket.
fn same_settings(photographs: &[Photograph]) -> Result<()> {
    let first = exif::read(&photographs[0].path)?;
    for p in &photographs[1..] {
        let settings = exif::read(&p.path)?;
        ensure!(
            settings.f_number == first.f_number && settings.iso == first.iso,
            "{}: aperture or sensitivity differ from those of '{}'; within a bracket only the time may change",
            p.path.display(),
            photographs[0].path.display()
        );
    }
    Ok(())
}
