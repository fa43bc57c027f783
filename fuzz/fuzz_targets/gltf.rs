#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::{Moment, Options, gltf};

fuzz_target!(|data: &[u8]| {
    let _ = gltf::animations(data, "fuzz.gltf".as_ref(), &Options::default());
    // Under this name text and binary files are both read.
    let moment = Some(Moment { seconds: 0.5, animation: None });
    for options in [Options::default(), Options { moment, ..Options::default() }] {
        let _ = gltf::read(data, "fuzz.gltf".as_ref(), &options);
    }
});
