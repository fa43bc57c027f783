//! Files that are no picture of ours, told by what they are rather than by what they lack.

use crate::{Error, Place, open};
use std::io::Read;
use std::path::Path;

/// Raw files of cameras are TIFFs as a rule, with a small preview that would pass for the picture.
const RAW: [&str; 22] = [
    "nef", "nrw", "cr2", "cr3", "crw", "arw", "sr2", "srf", "dng", "raf", "orf", "rw2", "rwl", "pef", "srw",
    "3fr", "fff", "iiq", "x3f", "mrw", "erf", "kdc",
];

/// Where a file begins so (from this byte), what it is.
const KINDS: [(usize, &[u8], &str); 18] = [
    (0, b"FUJIFILMCCD-RAW", "a camera's raw file"),
    (4, b"ftypcrx ", "a camera's raw file"),
    (4, b"ftypheic", "a HEIF picture"),
    (4, b"ftypheix", "a HEIF picture"),
    (4, b"ftypmif1", "a HEIF picture"),
    (4, b"ftypavif", "an AVIF picture"),
    (4, b"ftyp", "a film"),
    (0, b"GIF8", "a GIF picture"),
    (0, b"8BPS", "a Photoshop document"),
    (0, b"%PDF", "a PDF document"),
    (0, b"\0\0\0\x0cJXL ", "a JPEG XL picture"),
    (0, b"\xff\x0a", "a JPEG XL picture"),
    (0, b"\0\0\0\x0cjP  ", "a JPEG 2000 picture"),
    (0, b"\xabKTX", "a KTX texture"),
    (0, b"DDS ", "a DDS texture"),
    (0, b"PK\x03\x04", "a ZIP archive"),
    (0, b"<!DOCTYPE html", "a web page"),
    (0, b"<html", "a web page"),
];

/// Whether a file has the extension of a camera's raw files.
pub fn is_raw(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    RAW.contains(&extension.as_str())
}

/// Why a file that begins so cannot be a picture that is read, if that can be told.
pub(super) fn refusal(head: &[u8], at: &Place) -> Option<Error> {
    let raw = "this is a camera's raw file; develop it to a 16-bit TIFF with linear values first";
    if head.is_empty() {
        return Some(Error::invalid(at.clone(), "the file is empty; copy or export it again"));
    }
    if is_raw(&at.file) {
        return Some(Error::invalid(at.clone(), raw));
    }
    let begins =
        |(from, start, _): &&(usize, &[u8], &str)| head.get(*from..).is_some_and(|h| h.starts_with(start));
    let (.., what) = KINDS.iter().find(begins)?;
    Some(Error::invalid(
        at.clone(),
        match *what {
            "a camera's raw file" => raw.to_string(),
            "a web page" => "this is a web page, no picture; fetch the file itself".into(),
            what => format!("this is {what}, which is not read; export it as PNG, TIFF or OpenEXR"),
        },
    ))
}

/// Whether a file is a picture of a format that is read, told by how it begins: what else is wrong with it is not
/// looked at.
///
/// # Errors
/// Says what it is instead.
pub fn check_kind(path: &Path) -> Result<(), Error> {
    let mut head = Vec::new();
    open(path)?.take(64).read_to_end(&mut head).map_err(|e| Error::io(path, e))?;
    super::codec_of(&head, &Place::file(path)).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_file_is_comes_first() {
        let said = |name: &str, head: &[u8]| refusal(head, &Place::file(name)).map(|e| e.to_string());
        assert!(
            said("DSC.NEF", b"II*\0....").unwrap().contains("DSC.NEF: this is a camera's raw file; develop")
        );
        assert!(said("a.jpg", b"").unwrap().contains("the file is empty"));
        assert!(
            said("a.jpg", b"\0\0\0\x18ftypheic....").unwrap().contains("a HEIF picture, which is not read")
        );
        assert!(said("a.png", b"<!DOCTYPE html>").unwrap().contains("no picture; fetch"));
        assert_eq!(said("a.tif", b"II*\0...."), None);
    }
}
