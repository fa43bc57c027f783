#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::merl;
use yugen_optics::ColourSpace;

fuzz_target!(|data: &[u8]| {
    let _ = merl::read(data, "fuzz.binary".as_ref(), ColourSpace::LinearSrgb);
});
