//! The manual's list of actions is the table that the window reads.

use std::path::PathBuf;
use yugen_view::action::{ACTIONS, manual};

const HEADING: &str = "\n## Everything that can be done\n";

/// `BLESS=1` writes it anew.
#[test]
fn the_page_of_the_window_is_up_to_date() {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/view.md");
    let text = std::fs::read_to_string(&file).expect("docs/view.md is there");
    let (by_hand, _) = text.split_once(HEADING).expect("it has a list of actions");
    let page = format!("{by_hand}{HEADING}{}", manual());
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&file, &page).expect("it can be written");
    }
    assert!(
        text == page || std::env::var_os("BLESS").is_some(),
        "docs/view.md is not what the table says; BLESS=1 writes it anew"
    );
    assert!(ACTIONS.len() > 30 && ACTIONS.iter().all(|a| page.contains(&format!("`{}", a.name))));
}
