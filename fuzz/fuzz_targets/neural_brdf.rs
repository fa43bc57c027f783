#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::neural_brdf;

fuzz_target!(|data: &[u8]| {
    if let Ok(all) = neural_brdf::read(data, "fuzz.f32".as_ref()) {
        all.iter().for_each(|m| _ = m.eval(0.3, 0.4, 1.0));
    }
    let _ = neural_brdf::read_names(data, "fuzz.names.txt".as_ref(), 2);
});
