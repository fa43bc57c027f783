#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::{Options, gltf};

fuzz_target!(|data: &[u8]| {
    let _ = gltf::read(data, "fuzz.glb".as_ref(), &Options::default());
});
