#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::relight;

fuzz_target!(|data: &[u8]| {
    let _ = relight::read_info(data, "info.json".as_ref(), 1 << 16);
});
