#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::btf;
use yugen_archive::formats::image::ReadOptions;
use yugen_optics::ColourSpace;

fuzz_target!(|data: &[u8]| {
    // Small pictures keep the fuzzer fast.
    let options = ReadOptions { max_samples: 1 << 20, ..ReadOptions::to(ColourSpace::LinearSrgb) };
    if let Ok((maps, _)) = btf::read(data, "fuzz.btf".as_ref(), &options) {
        assert_eq!(maps.texels.len(), maps.width * maps.height);
        assert!(maps.texels.iter().all(|t| t.normal.is_normalized() && t.tangent.is_normalized()));
    }
});
