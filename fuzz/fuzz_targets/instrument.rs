#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::instrument;
use yugen_optics::ColourSpace;

// Told apart by content, and made a table of; the latter takes a second or so, so only of few readings.
fuzz_target!(|data: &[u8]| {
    if let Ok(m) = instrument::read(data, "fuzz.dat".as_ref(), ColourSpace::LinearSrgb) {
        if m.readings.len() <= 64 {
            assert_eq!(m.table().check(), Ok(()));
        }
    }
});
