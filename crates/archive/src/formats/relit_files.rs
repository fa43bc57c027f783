//! Files of pictures whose light can be moved: `.ptm`, `.rti` and RelightLab's folders, one line a format.

use super::gathered::Gathered;
use super::relight::Layout;
use super::relightable::{Basis, Colouring};
use super::relit_contents::Contents;
use super::{ptm, relight, rti};
use crate::{Error, Place, atomic_write_with, check_writable, make_folder, open, read_filled};
use std::path::{Path, PathBuf};

struct Format {
    name: &'static str,
    /// Lower case, without the dot; `None` for a folder.
    extension: Option<&'static str>,
    /// How such a file begins.
    magic: &'static [u8],
    /// The path is for messages, and the folder where there is one.
    read: fn(&[u8], &Path, u64) -> Result<Contents, Error>,
    write: fn(&Path, &mut Gathered, Layout) -> Result<(), Error>,
    holds: fn(Basis) -> bool,
}

/// One line a format.
const FORMATS: &[Format] = &[
    Format {
        name: "PTM (.ptm)",
        extension: Some("ptm"),
        magic: b"PTM_",
        read: ptm::read,
        write: |path, r, _| atomic_write_with(path, |out| ptm::write(r, path, out)),
        holds: |basis| basis == Basis::Ptm,
    },
    Format {
        name: "HSH (.rti)",
        extension: Some("rti"),
        magic: b"#HSH",
        read: |bytes, path, limit| rti::read(bytes, path, limit).map(Contents::Terms),
        write: |path, r, _| atomic_write_with(path, |out| rti::write(r, path, out)),
        holds: |basis| matches!(basis, Basis::Hsh { .. }),
    },
    Format {
        name: "a RelightLab folder",
        extension: None,
        magic: b"",
        read: |_, path, limit| relight::read(path, limit),
        write: relight::write,
        holds: |_| true,
    },
];

/// Whether `path` looks like one of these: a file that begins like one or is called so, or a folder with an
/// `info.json`.
pub fn recognises(path: &Path) -> bool {
    if path.is_dir() {
        return path.join(relight::INFO).is_file();
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    if path.is_file() && extension.is_some() && FORMATS.iter().any(|f| f.extension == extension.as_deref()) {
        return true;
    }
    let mut start = [0; 4];
    open(path).is_ok_and(|mut f| std::io::Read::read_exact(&mut f, &mut start).is_ok())
        && FORMATS.iter().any(|f| !f.magic.is_empty() && start == f.magic)
}

/// Reads a `.ptm`, a `.rti` or a RelightLab folder, told apart by what they hold; more than `max_texels` are refused.
pub fn read(path: &Path, max_texels: u64) -> Result<Contents, Error> {
    if path.is_dir() {
        return relight::read(path, max_texels);
    }
    // 48 bytes a texel in HSH of order 4, and 192 where they are floats; headers are small.
    let bytes = read_filled(path, max_texels.saturating_mul(192).saturating_add(1 << 16))?;
    let format = FORMATS.iter().find(|f| !f.magic.is_empty() && bytes.starts_with(f.magic));
    let Some(format) = format else {
        let names = FORMATS.iter().map(|f| f.name).collect::<Vec<_>>().join(", ");
        return Err(Error::invalid(Place::file(path), format!("this is none of {names}")));
    };
    (format.read)(&bytes, path, max_texels)
}

/// Whether a file says that its values are proportional to light; most say nothing, and hold display values.
pub fn says_linear(path: &Path, max_texels: u64) -> Result<bool, Error> {
    Ok(path.is_dir() && relight::info(path, max_texels)?.linear())
}

/// Whether a picture in `basis` can be written to `path`: `.ptm` holds PTM, `.rti` HSH, a folder either; a folder that
/// is not there is made.
pub fn can_write(path: &Path, basis: Basis, layout: Layout) -> Result<(), Error> {
    let format = writer(path, basis)?;
    let Some(extension) = format.extension else {
        make_folder(path)?;
        return relight::has_no_other(path, layout);
    };
    if layout != Layout::Image {
        let problem =
            format!("a .{extension} has no tiles; name a folder for the layout '{}'", layout.name());
        return Err(Error::invalid(Place::file(path), problem));
    }
    check_writable(path)
}

/// The files that [`write`] makes of a picture in `basis`; of tiles, their folders.
pub fn files(path: &Path, basis: Basis, colouring: Colouring, layout: Layout) -> Result<Vec<PathBuf>, Error> {
    Ok(match writer(path, basis)?.extension {
        Some(_) => vec![path.to_path_buf()],
        None => relight::files(path, colouring.stride(basis), layout),
    })
}

/// Writes a `.ptm`, a `.rti` or, without an extension, a RelightLab folder; `layout` is for folders.
pub fn write(path: &Path, r: &mut Gathered, layout: Layout) -> Result<(), Error> {
    (writer(path, r.basis())?.write)(path, r, layout)
}

fn writer(path: &Path, basis: Basis) -> Result<&'static Format, Error> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    // A folder that is there may well have a dot in its name.
    let extension = extension.filter(|_| !path.is_dir());
    let Some(format) = FORMATS.iter().find(|f| f.extension == extension.as_deref()) else {
        let known = FORMATS.iter().filter_map(|f| f.extension);
        return Err(Error::unknown(
            Place::file(path),
            "extension of a relightable picture",
            &extension.unwrap_or_default(),
            known,
        ));
    };
    if !(format.holds)(basis) {
        let others = FORMATS.iter().filter(|f| (f.holds)(basis)).map(|f| f.name).collect::<Vec<_>>();
        let problem =
            format!("{} cannot hold {}; expected {}", format.name, basis.name(), others.join(" or "));
        return Err(Error::invalid(Place::file(path), problem));
    }
    Ok(format)
}

#[cfg(test)]
mod tests {
    use super::super::relightable::tests::sample;
    use super::super::relightable::{DEFAULT_MAX_TEXELS, Relightable};
    use super::*;

    #[test]
    fn names_and_contents_say_which_format() {
        let folder = std::env::temp_dir().join(format!("yugen-relightable-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        for (name, basis) in [
            ("a.ptm", Basis::Ptm),
            ("a.rti", Basis::Hsh { order: 3 }),
            ("web", Basis::Ptm),
            ("hsh", Basis::ALL[3]),
        ] {
            let path = folder.join(name);
            assert!(!recognises(&path));
            let r = sample(basis, Colouring::Rgb, 24, 16);
            write(&path, &mut (&r).into(), Layout::Image).unwrap();
            assert!(recognises(&path), "{name}");
            let back = read(&path, DEFAULT_MAX_TEXELS).unwrap().terms().unwrap();
            assert_eq!((back.basis, back.width, back.height), (basis, 24, 16));
            let error = read(&path, 100).unwrap_err().to_string();
            assert!(
                error.contains("the number of texels (24 x 16) is 384, more than the limit of 100"),
                "{error}"
            );
        }
        let refuse =
            |name: &str, basis| can_write(&folder.join(name), basis, Layout::Image).unwrap_err().to_string();
        assert!(
            refuse("b.ptm", Basis::ALL[2])
                .contains("PTM (.ptm) cannot hold HSH 9; expected HSH (.rti) or a Relight")
        );
        assert!(refuse("b.rti", Basis::Ptm).contains("cannot hold PTM"));
        let tiled = can_write(&folder.join("b.ptm"), Basis::Ptm, Layout::DeepZoom).unwrap_err().to_string();
        assert!(tiled.contains("a .ptm has no tiles; name a folder for the layout 'deepzoom'"), "{tiled}");
        std::fs::create_dir_all(folder.join("tiled")).unwrap();
        std::fs::write(folder.join("tiled/planes.tzi"), "{}").unwrap();
        assert!(refuse("tiled", Basis::Ptm).contains("pictures of the layout 'itarzoom' in it"));
        can_write(&folder.join("tiled"), Basis::Ptm, Layout::ITarZoom).unwrap();
        assert!(refuse("b.rtt", Basis::ALL[1]).contains("did you mean 'rti'?"));
        std::fs::write(folder.join("c.ptm"), "P6\n1 1\n255\n").unwrap();
        let error = read(&folder.join("c.ptm"), 100).unwrap_err().to_string();
        assert!(
            error.ends_with("c.ptm: this is none of PTM (.ptm), HSH (.rti), a RelightLab folder"),
            "{error}"
        );
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn what_cannot_be_written_is_refused() {
        let mut r = sample(Basis::Ptm, Colouring::Rgb, 2, 2);
        r.coefficients[3] = f32::NAN;
        let ptm = |r: &Relightable| ptm::written(r).unwrap_err().to_string();
        assert!(ptm(&r).contains("not a finite number"));
        r.coefficients.pop();
        assert!(ptm(&r).contains("as its size says"));
        r.width = 0;
        let error = rti::written(&r).unwrap_err().to_string();
        assert!(error.contains("empty"), "{error}");
    }
}
