#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::image::{ReadOptions, about_bytes, read_bytes};

fuzz_target!(|data: &[u8]| {
    // Small pictures keep the fuzzer fast; the limit itself is part of what is tested.
    let options = ReadOptions { max_samples: 1 << 20, ..ReadOptions::default() };
    if let Ok(image) = read_bytes(data, "fuzz".as_ref(), &options) {
        assert_eq!(image.data.len(), image.width * image.height * image.channels.len());
        assert!(about_bytes(data, "fuzz".as_ref(), 1 << 20).is_ok_and(|a| a.width == image.width));
    }
});
