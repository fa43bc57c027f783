#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::serialized;

fuzz_target!(|data: &[u8]| {
    let _ = serialized::read(data, 0, "fuzz.serialized".as_ref());
    let _ = serialized::read(data, 1, "fuzz.serialized".as_ref());
});
