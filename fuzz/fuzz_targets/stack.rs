#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::stack::Options;

fuzz_target!(|data: &[u8]| {
    if let Ok(options) = Options::parse(data, "stack.toml".as_ref()) {
        assert_eq!(Options::parse(options.text().as_bytes(), "stack.toml".as_ref()).ok(), Some(options));
    }
});
