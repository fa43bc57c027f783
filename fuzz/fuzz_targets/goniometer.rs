#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::goniometer;
use yugen_optics::ColourSpace;

fuzz_target!(|data: &[u8]| {
    let _ = goniometer::read(data, "fuzz.txt".as_ref(), ColourSpace::LinearSrgb);
});
