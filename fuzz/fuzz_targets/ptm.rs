#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::ptm;

fuzz_target!(|data: &[u8]| {
    let _ = ptm::read(data, "fuzz.ptm".as_ref(), 1 << 16);
});
