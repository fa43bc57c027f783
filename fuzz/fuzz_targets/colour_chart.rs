#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let _ = yugen_archive::formats::colour_chart::read(data, "fuzz.csv".as_ref());
});
