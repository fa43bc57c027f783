#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::obj;

fuzz_target!(|data: &[u8]| {
    let _ = obj::read_mtl(data, "fuzz.mtl".as_ref());
});
