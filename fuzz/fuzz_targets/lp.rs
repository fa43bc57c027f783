#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::lp;

fuzz_target!(|data: &[u8]| {
    if let Ok(entries) = lp::read(data, "fuzz.lp".as_ref(), lp::Axes::default()) {
        assert!(entries.iter().all(|e| e.light.is_finite() && e.light.z > 0.0));
    }
});
