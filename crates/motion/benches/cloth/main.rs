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
#[path = "../processor/mod.rs"]
mod processor;
mod tables;

use std::path::Path;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

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
        _ => curtain::print(&words),
    }
}
