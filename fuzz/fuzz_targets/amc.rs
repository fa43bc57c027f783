#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::motion::{Options, acclaim::Acclaim};

const SKELETON: &[u8] =
    b":units\nlength 0.45\n:root\norder TX TY TZ RX RY RZ\n:bonedata\nbegin\nname thigh\ndirection 0 -1 0\n\
    length 7\naxis 0 0 20 XYZ\ndof rx rz\nend\nbegin\nname shin\ndirection 0 -1 0\nlength 7\ndof rx\nend\n\
    :hierarchy\nbegin\nroot thigh\nthigh shin\nend\n";

fuzz_target!(|data: &[u8]| {
    let options = Options { rate: Some(50.0), ..Options::default() };
    if let Ok(skeleton) = Acclaim::read(SKELETON, "fuzz.asf".as_ref()) {
        let _ = skeleton.read_motion(data, "fuzz.amc".as_ref(), &options);
    }
});
