#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::readings;

fuzz_target!(|data: &[u8]| {
    let _ = readings::read(data, "fuzz.csv".as_ref());
});
