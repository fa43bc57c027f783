#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::{Options, gltf};

fuzz_target!(|data: &[u8]| {
    // Under this name text and binary files are both read.
    if let Ok(mut scene) = gltf::read(data, "fuzz.gltf".as_ref(), &Options::default()) {
        let _ = scene.pose(None, 0.5);
    }
});
