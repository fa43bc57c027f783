//! Which files a scene may open.
//!
//! A scene file comes from someone else. It may name files in its own folder and below, in the folders that it
//! names for this (`<path>` in Mitsuba's format, `path` under `[scene]` in TOML), and in those the caller allows
//! ([`Options::folders`](crate::formats::Options), `--allow`). A folder that a scene names is relative to the file it
//! stands in and may climb with `..`, as Mitsuba's format intends; it may not end at the root of the file system, and be
//! absolute only inside one of the folders already in force. Every other name (meshes, pictures, includes, spectra) must end, with `..` and symbolic links
//! followed, inside one of these folders. Where a format lets its files name folders by elements of their own
//! (`<path>`), a relative name may as well climb by itself: it could say the same in two lines.

use crate::{Error, Place};
use std::path::{Component, Path, PathBuf};

/// The folders in force, in the order they are searched.
#[derive(Clone, Debug, Default)]
pub(crate) struct Folders {
    roots: Vec<PathBuf>,
    /// How files of this format name a folder, before it and behind it; nothing where they cannot.
    statement: Option<[&'static str; 2]>,
    /// Names may climb with `..`.
    climbs: bool,
}

impl Folders {
    /// The folder of the scene file, then those the caller allows.
    pub(crate) fn new(
        scene: &Path,
        allowed: &[PathBuf],
        statement: Option<[&'static str; 2]>,
    ) -> Result<Self, Error> {
        let mut roots = Vec::new();
        // A scene that is only bytes has no folder, and then none of its files can be found.
        if let Some(parent) = scene.parent() {
            let parent = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
            roots.extend(parent.canonicalize());
        }
        for folder in allowed {
            roots.push(folder.canonicalize().map_err(|e| Error::io(folder, e))?);
        }
        Ok(Self { roots, statement, climbs: false })
    }

    /// Lets relative names climb with `..`.
    pub(crate) fn climbing(self) -> Self {
        Self { climbs: true, ..self }
    }

    /// A folder that `file` names: searched first from now on.
    pub(crate) fn add_first(&mut self, value: &str, file: &Path, at: Place) -> Result<(), Error> {
        let folder = self.named(value, file, at)?;
        self.roots.insert(0, folder);
        Ok(())
    }

    /// A folder that `file` names: searched last.
    pub(crate) fn add_last(&mut self, value: &str, file: &Path, at: Place) -> Result<(), Error> {
        let folder = self.named(value, file, at)?;
        self.roots.push(folder);
        Ok(())
    }

    fn named(&self, value: &str, file: &Path, at: Place) -> Result<PathBuf, Error> {
        let value = Path::new(value);
        if value.is_absolute() {
            let within = |folder: &PathBuf| self.roots.iter().any(|r| folder.starts_with(r));
            if let Some(folder) = value.canonicalize().ok().filter(|f| within(f) && f.is_dir()) {
                return Ok(folder);
            }
            let folder = value.display();
            let problem = format!(
                "the folder '{folder}' is absolute; give it relative to the file, or allow it with --allow '{folder}'"
            );
            return Err(Error::invalid(at, problem));
        }
        let beside = file.parent().unwrap_or(Path::new("")).join(value);
        let folder = std::iter::once(beside)
            .chain(self.roots.iter().map(|r| r.join(value)))
            .filter_map(|p| p.canonicalize().ok())
            .find(|p| p.is_dir())
            .ok_or_else(|| {
                Error::invalid(
                    at.clone(),
                    format!("there is no folder '{}' beside this file", value.display()),
                )
            })?;
        if folder.parent().is_none() {
            return Err(Error::invalid(
                at,
                "the folder is the root of the file system; name the one that holds the scene's files",
            ));
        }
        Ok(folder)
    }

    /// For an included file: its own folder first.
    pub(crate) fn inside(&self, file: &Path) -> Self {
        let mut roots = self.roots.clone();
        if let Some(folder) = file.parent().and_then(|p| p.canonicalize().ok()) {
            roots.retain(|r| *r != folder);
            roots.insert(0, folder);
        }
        Self { roots, ..*self }
    }

    /// The folders of `other` after these.
    pub(crate) fn then(&self, other: &Self) -> Self {
        let mut roots = self.roots.clone();
        roots.extend(other.roots.iter().filter(|r| !self.roots.contains(r)).cloned());
        Self { roots, ..*self }
    }

    /// The file called `name`, where it may be opened.
    pub(crate) fn find(&self, name: &str, at: Place) -> Result<PathBuf, Error> {
        let name = Path::new(name);
        let found = self.roots.iter().filter_map(|r| r.join(name).canonicalize().ok()).collect::<Vec<_>>();
        if let Some(file) = found.iter().find(|f| self.roots.iter().any(|r| f.starts_with(r))) {
            return Ok(file.clone());
        }
        if self.climbs && name.starts_with("..") {
            // Links are not followed out of the folder that the name climbs to, which is not the root of all.
            let above = |r: &PathBuf| {
                Some((r.join(climb(name)).canonicalize().ok()?, r.join(name).canonicalize().ok()?))
            };
            let mut reached = self.roots.iter().filter_map(above);
            if let Some((_, file)) =
                reached.find(|(folder, file)| folder.parent().is_some() && file.starts_with(folder))
            {
                return Ok(file);
            }
        }
        // Whether a file outside exists is nobody's business: the answer is the same for both.
        let climbs = name.is_absolute() || name.components().any(|c| c == Component::ParentDir);
        if climbs || !found.is_empty() {
            let (what, folder) = match found.first() {
                Some(target) if !climbs => ("is a link that leads", target.parent().map(Path::to_path_buf)),
                _ => ("lies", name.parent().map(|folder| self.beside(folder))),
            };
            let folder = folder.unwrap_or_default();
            let name = name.display();
            let statement = match self.statement {
                Some([before, behind]) => format!("name its folder in the scene ({before}FOLDER{behind}), "),
                None => String::new(),
            };
            let problem = format!(
                "the file '{name}' {what} outside the folders of this scene; put it there, {statement}or allow it with \
                 --allow '{}'",
                folder.display()
            );
            return Err(Error::invalid(at, problem));
        }
        let roots: Vec<_> = self.roots.iter().map(|r| r.display().to_string()).collect();
        let roots = if roots.is_empty() { "no folder".to_string() } else { roots.join(", ") };
        Err(Error::invalid(at, format!("there is no file '{}' (looked in {roots})", name.display())))
    }

    /// Where a folder lies that is named from the first of these, as far as its name tells.
    fn beside(&self, folder: &Path) -> PathBuf {
        let mut place = PathBuf::new();
        for part in self.roots.first().map(|r| r.join(folder)).unwrap_or_default().components() {
            match part {
                Component::ParentDir => _ = place.pop(),
                Component::CurDir => {}
                part => place.push(part),
            }
        }
        place
    }
}

/// The parts of a relative name that climb, at its beginning.
fn climb(name: &Path) -> PathBuf {
    name.components().take_while(|c| *c == Component::ParentDir).collect()
}
