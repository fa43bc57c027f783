#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::rgl;
use yugen_optics::ColourSpace;

fuzz_target!(|data: &[u8]| {
    let _ = rgl::read(data, "fuzz.bsdf".as_ref(), ColourSpace::LinearSrgb);
});
