//! Measured reflectance: which file feeds which model.

use super::{goniometer, goniometer_csv, instrument, merl, rgl};
use crate::disk::read_filled;
use crate::{Error, Place};
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_reflectance::Kind;

type Read = fn(&[u8], &Path, ColourSpace) -> Result<Vec<f32>, Error>;

/// A model and the format of the file that `Kind::bake` gets its numbers from.
struct Source {
    model: &'static str,
    /// For people.
    name: &'static str,
    /// Lower case, without the dot.
    extensions: &'static [&'static str],
    read: Read,
    /// Larger files are refused.
    limit: u64,
    /// Whether such files are written as well.
    written: bool,
}

/// Those of [`instrument::FORMATS`].
const INSTRUMENTS: &str = "instruments";

/// One line a format; where several have an extension, the first whose files these are, or the last.
const SOURCES: &[Source] = &[
    Source {
        model: "merl",
        name: "MERL",
        extensions: &["binary"],
        read: merl::read,
        limit: 1 << 26,
        written: true,
    },
    Source {
        model: "tabulated",
        name: INSTRUMENTS,
        extensions: &["xml", "bsdf", "brdf", "alta", "astm", "dat", "bin", "txt"],
        read: |bytes, file, space| Ok(instrument::read(bytes, file, space)?.table().to_data()),
        limit: instrument::MAX_BYTES,
        written: false,
    },
    // An anisotropic measurement with 195 wavelengths has 106 MB.
    Source {
        model: "rgl",
        name: "RGL",
        extensions: &["bsdf"],
        read: |bytes, file, space| Ok(rgl::read(bytes, file, space)?.to_data()),
        limit: 1 << 30,
        written: true,
    },
    Source {
        model: "tabulated",
        name: "goniometer table",
        extensions: &["gonio"],
        read: |bytes, file, space| Ok(goniometer::read(bytes, file, space)?.to_data()),
        limit: 1 << 28,
        written: true,
    },
    Source {
        model: "tabulated",
        name: "goniometer readings",
        extensions: &["csv"],
        read: |bytes, file, space| Ok(goniometer_csv::read(bytes, file, space)?.to_data()),
        limit: 1 << 28,
        written: false,
    },
];

fn extension(file: &Path) -> String {
    file.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

fn model(file: &Path, fits: impl Fn(&&Source) -> bool, what: &'static str) -> Result<Kind, Error> {
    let extension = extension(file);
    let all = || SOURCES.iter().filter(&fits);
    let source = all().rfind(|s| s.extensions.contains(&extension.as_str()));
    source.and_then(|s| Kind::from_name(s.model).ok()).ok_or_else(|| {
        let known = all().flat_map(|s| s.extensions).copied();
        Error::unknown(Place::file(file), what, &extension, known)
    })
}

/// The model that `file` feeds: as its extension says, and where that is not enough, its first bytes.
pub fn kind(file: &Path) -> Result<Kind, Error> {
    let others = SOURCES.iter().filter(|s| s.extensions.contains(&extension(file).as_str())).count();
    if others > 1 && instrument::format_of(file).is_some() {
        return model(file, |s| s.model == "tabulated", "measured file extension");
    }
    model(file, |_| true, "measured file extension")
}

/// The model whose files have the extension of `file`, among those that are written.
pub fn written_kind(file: &Path) -> Result<Kind, Error> {
    model(file, |s| s.written, "extension of a measured file that is written")
}

/// The numbers of `file` as the model `kind` bakes them, colours in `space`.
pub fn read(file: &Path, kind: Kind, space: ColourSpace) -> Result<Vec<f32>, Error> {
    let extension = extension(file);
    let fits = |s: &&Source| s.model == kind.name();
    let named = SOURCES.iter().filter(fits).find(|s| s.extensions.contains(&extension.as_str()));
    // Of another extension, what is written is most likely.
    let Some(source) = named.or(SOURCES.iter().filter(fits).find(|s| s.written)) else {
        let mut models: Vec<_> = SOURCES.iter().map(|s| s.model).collect();
        models.sort_unstable();
        models.dedup();
        let problem =
            format!("model '{}' takes no measured file; those that do: {}", kind.name(), models.join(", "));
        return Err(Error::invalid(Place::file(file), problem));
    };
    (source.read)(&read_filled(file, source.limit)?, file, space)
}

/// The formats of measured reflectance: name, extensions, the model that they feed, and whether they are written.
pub fn formats() -> Vec<(&'static str, &'static [&'static str], &'static str, bool)> {
    let own =
        SOURCES.iter().filter(|s| s.name != INSTRUMENTS).map(|s| (s.name, s.extensions, s.model, s.written));
    own.chain(instrument::FORMATS.iter().map(|f| (f.name, f.extensions, "tabulated", false))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_feeds_a_model_that_wants_data() {
        for source in SOURCES {
            for extension in source.extensions {
                let file = format!("a/b.{}", extension.to_uppercase());
                let kind = kind(Path::new(&file)).unwrap();
                // Of files that are not there the extension says what it says most often.
                assert_eq!(kind.name(), if *extension == "bsdf" { "rgl" } else { source.model });
                assert!(kind.data() != yugen_reflectance::Data::None);
                assert_eq!(written_kind(Path::new(&file)).is_ok(), source.written || *extension == "bsdf");
            }
        }
        let listed: Vec<_> = SOURCES[1]
            .extensions
            .iter()
            .filter(|e| instrument::FORMATS.iter().any(|f| f.extensions.contains(e)))
            .collect();
        assert_eq!(listed.len(), SOURCES[1].extensions.len());
        assert!(kind(Path::new("gold.binari")).unwrap_err().to_string().contains("binary"));
    }
}
