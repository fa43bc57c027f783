//! Milliseconds a frame of cloth at a stated stretch.
//!
//! `cargo bench -p yugen-motion --bench cloth -- [CELLS] [SUBSTEPS] [THREADS] [FABRIC]`: a square metre of cloth, CELLS by
//! CELLS, falls from the horizontal and hangs, from an edge (a curtain) or two corners, for five seconds. Wall time and
//! processor time, both per frame of a sixtieth of a second; |stretch| of threads is the worst of what every tenth frame has.
//!
//! `write FOLDER` writes the scenes of [`cases`] for other programs and prints the name of each; `tables FOLDER [TOOL NAME]…` moves
//! them by ours, reads what the TOOLs have left in the folder, and prints the tables of docs/cloth.md. `benches/cloth.py` does both.

mod cases;
mod curtain;
#[path = "../../tests/drape/mod.rs"]
mod drape;
mod tables;

use std::path::Path;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Processor time of this process, s; 0 where the system does not say.
fn processor() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = stat.rsplit(')').next().unwrap_or_default();
    // Hundredths of a second in user mode: the 14th number, the 12th behind the name.
    after.split_whitespace().nth(11).and_then(|t| t.parse::<f64>().ok()).unwrap_or(0.0) / 100.0
}

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["write", folder] => {
            for case in cases::all() {
                cases::write(Path::new(folder), &case)?;
                println!("{}", case.file);
            }
            Ok(())
        }
        ["tables", folder, ref tools @ ..] => tables::print(Path::new(folder), tools),
        _ => {
            curtain::print(&words);
            Ok(())
        }
    }
}
