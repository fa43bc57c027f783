#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::obj;

fuzz_target!(|data: &[u8]| {
    if let Ok(obj) = obj::read(data, "fuzz.obj".as_ref()) {
        let _ = obj.split();
    }
});
