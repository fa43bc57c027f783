#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::rti;

fuzz_target!(|data: &[u8]| {
    let _ = rti::read(data, "fuzz.rti".as_ref(), 1 << 16);
});
