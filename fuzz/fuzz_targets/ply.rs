#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::ply;

fuzz_target!(|data: &[u8]| {
    let _ = ply::read(data, "fuzz.ply".as_ref());
});
