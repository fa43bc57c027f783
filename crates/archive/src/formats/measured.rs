//! Measured reflectance: which file feeds which model.

use super::{goniometer, goniometer_csv, merl, rgl};
use crate::disk::read_bounded;
use crate::{Error, Place};
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_reflectance::Kind;

type Read = fn(&[u8], &Path, ColourSpace) -> Result<Vec<f32>, Error>;

/// A model and the format of the file that `Kind::bake` gets its numbers from.
struct Source {
    model: &'static str,
    /// Lower case, without the dot.
    extension: &'static str,
    read: Read,
    /// Larger files are refused.
    limit: u64,
}

/// One line a format.
const SOURCES: &[Source] = &[
    Source { model: "merl", extension: "binary", read: merl::read, limit: 1 << 26 },
    // An anisotropic measurement with 195 wavelengths has 106 MB.
    Source {
        model: "rgl",
        extension: "bsdf",
        read: |bytes, file, space| Ok(rgl::read(bytes, file, space)?.to_data()),
        limit: 1 << 30,
    },
    Source {
        model: "tabulated",
        extension: "gonio",
        read: |bytes, file, space| Ok(goniometer::read(bytes, file, space)?.to_data()),
        limit: 1 << 28,
    },
    Source {
        model: "tabulated",
        extension: "csv",
        read: |bytes, file, space| Ok(goniometer_csv::read(bytes, file, space)?.to_data()),
        limit: 1 << 28,
    },
];

/// The model that files with the extension of `file` feed.
pub fn kind(file: &Path) -> Result<Kind, Error> {
    let extension = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let source = SOURCES.iter().find(|s| s.extension == extension);
    source.and_then(|s| Kind::from_name(s.model).ok()).ok_or_else(|| {
        let known = SOURCES.iter().map(|s| s.extension);
        Error::unknown(Place::file(file), "measured file extension", &extension, known)
    })
}

/// The numbers of `file` as the model `kind` bakes them, colours in `space`.
pub fn read(file: &Path, kind: Kind, space: ColourSpace) -> Result<Vec<f32>, Error> {
    let extension = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let named = SOURCES.iter().find(|s| s.model == kind.name() && s.extension == extension);
    let Some(source) = named.or(SOURCES.iter().find(|s| s.model == kind.name())) else {
        let models: Vec<_> = SOURCES.iter().map(|s| s.model).collect();
        let problem =
            format!("model '{}' takes no measured file; those that do: {}", kind.name(), models.join(", "));
        return Err(Error::invalid(Place::file(file), problem));
    };
    (source.read)(&read_bounded(file, source.limit)?, file, space)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_feeds_a_model_that_wants_data() {
        for source in SOURCES {
            let file = format!("a/b.{}", source.extension.to_uppercase());
            let kind = kind(Path::new(&file)).unwrap();
            assert_eq!(kind.name(), source.model);
            assert!(kind.data() != yugen_reflectance::Data::None);
        }
        assert!(kind(Path::new("gold.binari")).unwrap_err().to_string().contains("binary"));
    }
}
