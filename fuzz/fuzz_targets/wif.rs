#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::wif;
use yugen_optics::ColourSpace;

fuzz_target!(|data: &[u8]| {
    if let Ok(draft) = wif::read(data, "fuzz.wif".as_ref(), ColourSpace::LinearSrgb) {
        // What is read can be woven.
        if draft.warp.len() * draft.weft.len() <= 1 << 16 {
            assert_eq!(draft.drawdown().len(), draft.warp.len() * draft.weft.len());
        }
    }
});
