#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::instrument::astm;
use yugen_optics::ColourSpace;

fuzz_target!(|data: &[u8]| {
    if let Ok(m) = astm::read(data, "fuzz.astm".as_ref(), ColourSpace::LinearSrgb) {
        assert!(m.readings.iter().all(|r| r.f.is_finite() && r.wi.z > 0.0 && r.wo.z > 0.0));
    }
});
