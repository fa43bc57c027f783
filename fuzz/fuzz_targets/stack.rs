#![no_main]

use libfuzzer_sys::fuzz_target;
use yugen_archive::formats::stack::Options;

fuzz_target!(|data: &[u8]| {
    if let Ok(options) = Options::parse(data, "stack.toml".as_ref()) {
        let back = Options::parse(options.text().as_bytes(), "stack.toml".as_ref());
        assert_eq!(back.ok().as_ref(), Some(&options));
        let new = Options { near: !options.near, field_width: 3.0, ..options.clone() };
        let text = String::from_utf8_lossy(data);
        let amended = options.amended(&text, "stack.toml".as_ref(), &new).unwrap_or_default();
        assert_eq!(Options::parse(amended.as_bytes(), "stack.toml".as_ref()).ok(), Some(new));
    }
});
