#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::mtl;

fuzz_target!(|data: &[u8]| {
    for m in mtl::read(data, "fuzz.mtl".as_ref()) {
        let _ = m.colour("Kd");
        m.statements.iter().for_each(|(keyword, _)| drop(m.map(keyword)));
    }
});
