//! Which pictures lie in a folder, and which of them a list of lights means.

use super::{MASK, Options, Picture, inside};
use crate::formats::{image, lp};
use crate::{Error, Place, list_folder};
use std::path::{Path, PathBuf};

/// What names are sorted by so that 2 comes before 10: digits as numbers, all else by itself.
fn by_number(name: &str) -> Vec<(u64, char)> {
    let mut key = Vec::new();
    for c in name.chars() {
        match (c.to_digit(10), key.last_mut()) {
            (Some(digit), Some((number, '0'))) => *number = u64::saturating_add(*number * 10, digit.into()),
            (Some(digit), _) => key.push((digit.into(), '0')),
            (None, _) => key.push((0, c)),
        }
    }
    key
}

/// The pictures of a folder in the order of their names, 2 before 10; without those `aside` and what is hidden.
pub fn pictures(folder: &Path, aside: &[&str]) -> Result<Vec<PathBuf>, Error> {
    let mut all = list_folder(folder)?;
    all.retain(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        image::is_picture(path) && !name.starts_with('.') && !aside.contains(&&*name) && path.is_file()
    });
    all.sort_by_cached_key(|path| by_number(&path.file_name().unwrap_or_default().to_string_lossy()));
    Ok(all)
}

/// Why a folder has no pictures.
pub fn no_picture(folder: &Path) -> Error {
    let raw = list_folder(folder).into_iter().flatten().find(|path| image::is_raw(path));
    let problem = match raw {
        Some(raw) => format!(
            "there is no picture in it but raw files of a camera such as '{}'; develop them to 16-bit TIFFs with linear values \
             first",
            raw.file_name().unwrap_or_default().display()
        ),
        None => "there is no picture in it".into(),
    };
    Error::invalid(Place::file(folder), problem)
}

/// The entries of a list of lights with the pictures of a folder that they name. A name that differs from that of one
/// picture in case or extension only is taken for it. A list whose names are all foreign, or that has none, is taken in
/// the order of the pictures' names where there are as many.
pub(super) fn of_list(
    folder: &Path,
    list: &Path,
    entries: Vec<lp::Entry>,
    options: &Options,
) -> Result<Vec<Picture>, Error> {
    let aside = [options.mask.as_deref().unwrap_or(MASK), options.ambient.as_deref().unwrap_or_default()];
    let there = pictures(folder, &aside)?;
    let lower = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().to_lowercase();
    let find = |name: &str| -> Option<PathBuf> {
        let exact = inside(folder, name);
        if exact.is_file() {
            return Some(exact);
        }
        let only = |same: &dyn Fn(&Path) -> bool| {
            let mut all = there.iter().filter(|path| same(path));
            all.next().filter(|_| all.next().is_none()).cloned()
        };
        only(&|path| lower(path.file_name()) == lower(exact.file_name()))
            .or_else(|| only(&|path| lower(path.file_stem()) == lower(exact.file_stem())))
    };
    let found: Vec<Option<PathBuf>> =
        entries.iter().map(|e| if e.file.is_empty() { None } else { find(&e.file) }).collect();
    if found.iter().all(Option::is_none) && there.len() == entries.len() {
        if entries.iter().any(|e| !e.file.is_empty()) {
            tracing::warn!(
                "{}: none of the pictures it names is there ('{}' …); its lights are taken in the order of the {} \
                 pictures that are",
                list.display(),
                entries[0].file,
                there.len()
            );
        }
        return Ok(entries
            .into_iter()
            .zip(there)
            .map(|(e, path)| Picture { path, light: e.light })
            .collect());
    }
    if let Some(first) = found.iter().position(Option::is_none) {
        let [lights, others] = [entries.len(), there.len()];
        let missing = found.iter().filter(|f| f.is_none()).count();
        let path = inside(folder, &entries[first].file);
        let name = path.display();
        let like = |part: fn(&Path) -> Option<&std::ffi::OsStr>| {
            let like = there.iter().filter(|t| lower(part(t)) == lower(part(&path)));
            like.map(|t| format!("'{}'", t.file_name().unwrap_or_default().display())).collect::<Vec<_>>()
        };
        let like =
            Some(like(Path::file_name)).filter(|l| l.len() > 1).unwrap_or_else(|| like(Path::file_stem));
        let problem = if entries[first].file.is_empty() {
            format!(
                "the list names no pictures, and has {lights} lights for {others} pictures in the folder; expected as many: \
                 name them in the list, or move what is no picture of a light elsewhere"
            )
        } else if like.len() > 1 {
            format!(
                "the picture '{name}' is not there, and {} differ from it in case or extension only; correct its line",
                like.join(" and ")
            )
        } else if missing == lights {
            format!(
                "none of the {lights} pictures that it names is there, '{name}' first, and there are {others} others: it \
                 may be the list of another stack; of a list with other names as many pictures are expected, in its order"
            )
        } else if missing > 1 {
            format!(
                "{missing} of the {lights} pictures that it names are not there, '{name}' first: it may be the list of \
                 another stack; put them back, or delete their lines and correct the count"
            )
        } else {
            format!(
                "the picture '{name}' is not there; put it back, or delete its line and correct the count"
            )
        };
        return Err(Error::invalid(Place::file(list), problem));
    }
    let pair =
        |(entry, path): (lp::Entry, Option<PathBuf>)| Some(Picture { path: path?, light: entry.light });
    let pictures: Vec<Picture> = entries.into_iter().zip(found).filter_map(pair).collect();
    let mut paths: Vec<&PathBuf> = pictures.iter().map(|p| &p.path).collect();
    paths.sort_unstable();
    if let Some(twice) = paths.windows(2).find(|pair| pair[0] == pair[1]) {
        let problem =
            format!("two lines of the list mean the picture '{}'; expected one", twice[0].display());
        return Err(Error::invalid(Place::file(list), problem));
    }
    Ok(pictures)
}
