//! Standard output and error. A reader that is gone or a disk that is full is an error with a plain sentence, not a
//! panic as with the macros of the same names in the standard library, whose place these take in all of this program.

use std::fmt::Arguments;
use std::io::Write;
use std::path::Path;
use yugen_archive::Error;

macro_rules! print {
    ($($what:tt)*) => { $crate::output::write(format_args!($($what)*)) };
}

macro_rules! println {
    ($($what:tt)*) => { $crate::output::write(format_args!("{}\n", format_args!($($what)*))) };
}

macro_rules! eprintln {
    ($($what:tt)*) => { $crate::output::complain(format_args!($($what)*)) };
}

/// To standard output; ends the program where that fails.
pub fn write(what: Arguments) {
    if let Err(e) = std::io::stdout().write_fmt(what) {
        eprintln!("yugen: {}", failed(e));
        std::process::exit(1);
    }
}

/// A line to standard error, if anybody listens.
pub fn complain(what: Arguments) {
    let _ = writeln!(std::io::stderr(), "{what}");
}

/// Everything that was printed is out.
pub fn flush() -> Result<(), Error> {
    std::io::stdout().flush().map_err(failed)
}

/// Why standard output takes no more.
pub fn failed(e: std::io::Error) -> Error {
    Error::io(Path::new("standard output"), e)
}
