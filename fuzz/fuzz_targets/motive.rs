#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::motion::{Angles, Options, motive};

fuzz_target!(|data: &[u8]| {
    let options = Options { rate: Some(50.0), angles: Some(Angles::Helical), ..Options::default() };
    if let Ok((motion, _)) = motive::read(data, "fuzz.csv".as_ref(), &options) {
        // What is read has a size.
        assert!(motion.size().height >= 0.0);
    }
});
