//! Texels a second of core time for the fit of PTM and HSH to a stack; `benches/rti_rate.py` sets it beside numpy.
//!
//! `cargo run --release -p yugen-capture --example rti_rate [SIDE] [LIGHTS]`

use std::time::Instant;
use yugen_archive::formats::relightable::{Basis, Colouring};
use yugen_capture::rti::Encoding;
use yugen_capture::rti::fit::{Fitted, Options, fit_into};
use yugen_capture::simulate::fibonacci_dome;
use yugen_capture::{Lights, Stack};
use yugen_optics::random::Pcg32;

/// Seconds that all threads of this process have spent on a core, in hundredths; wall time where the system does not say.
fn core_seconds(start: Instant) -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the name in brackets: user and system time are the 12th and 13th fields, in ticks of 1/100 s.
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    match fields.get(11..13).and_then(|f| Some(f[0].parse::<f64>().ok()? + f[1].parse::<f64>().ok()?)) {
        Some(ticks) => ticks / 100.0,
        None => start.elapsed().as_secs_f64(),
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1).filter_map(|a| a.parse::<usize>().ok());
    let (side, lights) = (arguments.next().unwrap_or(512), arguments.next().unwrap_or(64));
    let mut rng = Pcg32::new(1, 1);
    let stack = Stack {
        width: side,
        height: side,
        first_row: 0,
        rows: side,
        lights: Lights::Distant(fibonacci_dome(lights, 1.3)),
        eyes: vec![yugen_capture::Eye::ABOVE; lights],
        values: (0..side * side * lights).map(|_| rng.next_vec3().to_array()).collect(),
    };
    let texels = (side * side) as f64;
    println!("{side}x{side} texels, {lights} lights, {} bytes read a texel", 12 * lights);
    let start = Instant::now();
    for basis in Basis::ALL {
        for (name, encoding) in [("linear", Encoding::Linear), ("srgb", Encoding::Srgb)] {
            let options = Options { basis, colouring: Colouring::Rgb, encoding, ridge: 0.0 };
            let mut fitted = Fitted::none(&options);
            let before = core_seconds(start);
            let mut rounds = 0;
            // Ticks are coarse: a second is a hundred of them.
            while core_seconds(start) - before < 1.0 {
                assert!(fit_into(&stack, &options, &mut fitted).is_ok() && fitted.empty == 0);
                rounds += 1;
            }
            let seconds = (core_seconds(start) - before) / f64::from(rounds);
            let written = 4 * 3 * basis.terms();
            println!(
                "{:8} {name:8} {:7.2} M texels/s  {written:4} bytes written a texel",
                basis.name(),
                texels / seconds / 1e6
            );
        }
    }
}
