//! Files with numbers in their names.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use yugen_archive::{Error, list_folder};

/// The name of a file with the number of a frame in it: `frame_%04d.png`.
pub struct Numbered {
    before: String,
    digits: usize,
    after: String,
}

impl Numbered {
    /// `None`: there is no `%d` in it.
    pub fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?;
        let (before, rest) = name.split_once('%')?;
        let (digits, after) = rest.split_once('d')?;
        let digits =
            if digits.is_empty() { 1 } else { digits.parse().ok().filter(|n| (1..=9).contains(n))? };
        let path = path.with_file_name(before);
        // A name that begins with its number.
        let before = if before.is_empty() { path.join("") } else { path };
        Some(Self { before: before.to_str()?.to_string(), digits, after: after.to_string() })
    }

    /// The file of a frame.
    pub fn frame(&self, number: u32) -> PathBuf {
        let Self { before, digits, after } = self;
        format!("{before}{number:0digits$}{after}").into()
    }

    /// The files that are there, by their numbers.
    pub fn list(&self) -> Result<BTreeMap<u32, PathBuf>, Error> {
        let pattern = Path::new(&self.before);
        let (folder, before) = match self.before.ends_with('/') {
            true => (pattern, String::new()),
            false => (
                pattern.parent().unwrap_or(Path::new("")),
                pattern.file_name().map_or(String::new(), |n| n.display().to_string()),
            ),
        };
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let number = |path: &PathBuf| -> Option<u32> {
            let digits = path.file_name()?.to_str()?.strip_prefix(&before)?.strip_suffix(&self.after)?;
            digits.parse().ok().filter(|n| self.frame(*n).file_name() == path.file_name())
        };
        Ok(list_folder(folder)?.into_iter().filter_map(|path| Some((number(&path)?, path))).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_where_the_name_says() {
        let frame = |name: &str, n| Numbered::of(Path::new(name)).map(|p| p.frame(n).display().to_string());
        assert_eq!(frame("a/b_%04d.png", 7).as_deref(), Some("a/b_0007.png"));
        assert_eq!(frame("%d.exr", 120).as_deref(), Some("120.exr"));
        assert_eq!(frame("a/%3d.exr", 12).as_deref(), Some("a/012.exr"));
        for none in ["a.png", "100%.png", "a_%xd.png", "a_%099d.png"] {
            assert_eq!(frame(none, 1), None, "{none}");
        }
    }
}
