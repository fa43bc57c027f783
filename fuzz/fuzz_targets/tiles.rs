#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::relight::tiles;

fuzz_target!(|data: &[u8]| {
    let _ = tiles::read_index(data, "plane_0.tzi".as_ref(), [700, 370], 1 << 16);
});
