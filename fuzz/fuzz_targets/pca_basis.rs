#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::pca_basis;

fuzz_target!(|data: &[u8]| {
    let _ = pca_basis::read(data, "fuzz.pca".as_ref());
});
