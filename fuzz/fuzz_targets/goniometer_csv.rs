#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::goniometer_csv;
use yugen_optics::ColourSpace;

fuzz_target!(|data: &[u8]| {
    if let Ok(g) = goniometer_csv::read(data, "fuzz.csv".as_ref(), ColourSpace::LinearSrgb) {
        assert_eq!(g.check(), Ok(()));
    }
    if let Ok(t) = goniometer_csv::read_texels(data, "fuzz.csv".as_ref(), ColourSpace::LinearSrgb) {
        assert_eq!(t.starts.last(), Some(&t.values.len()));
    }
});
