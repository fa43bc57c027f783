#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::{Options, mitsuba};

fuzz_target!(|data: &[u8]| {
    let _ = mitsuba::read(data, "fuzz.xml".as_ref(), &Options::default());
});
