//! Measured reflectance: which file feeds which model.

use super::{goniometer, merl, rgl};
use crate::disk::read_bounded;
use crate::{Error, Place};
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_reflectance::Kind;

type Read = fn(&[u8], &Path, ColourSpace) -> Result<Vec<f32>, Error>;

/// A model and the format of the file that `Kind::bake` gets its numbers from.
struct Source {
    model: &'static str,
    read: Read,
    /// Larger files are refused.
    limit: u64,
}

/// One line a format.
const SOURCES: &[Source] = &[
    Source { model: "merl", read: merl::read, limit: 1 << 26 },
    // An anisotropic measurement with 195 wavelengths has 106 MB.
    Source {
        model: "rgl",
        read: |bytes, file, space| Ok(rgl::read(bytes, file, space)?.to_data()),
        limit: 1 << 30,
    },
    Source {
        model: "tabulated",
        read: |bytes, file, space| Ok(goniometer::read(bytes, file, space)?.to_data()),
        limit: 1 << 28,
    },
];

/// The numbers of `file` as the model `kind` bakes them, colours in `space`.
pub fn read(file: &Path, kind: Kind, space: ColourSpace) -> Result<Vec<f32>, Error> {
    let Some(source) = SOURCES.iter().find(|s| s.model == kind.name()) else {
        let models: Vec<_> = SOURCES.iter().map(|s| s.model).collect();
        let problem =
            format!("model '{}' takes no measured file; those that do: {}", kind.name(), models.join(", "));
        return Err(Error::invalid(Place::file(file), problem));
    };
    (source.read)(&read_bounded(file, source.limit)?, file, space)
}
