//! The bar that is shown while work takes longer than a second.

use indicatif::{ProgressBar, ProgressStyle};

/// For work on `total` of something; people see it on a terminal, programs (`hidden`) do not.
pub fn bar(total: u64, hidden: bool) -> ProgressBar {
    shaped(total, hidden, "{elapsed_precise} {wide_bar} {percent:>3} %, {eta} left  {msg}")
}

/// For work that tells itself, by its message, how long it will take; in thousandths.
pub fn bar_of_parts(hidden: bool) -> ProgressBar {
    shaped(1000, hidden, "{elapsed_precise} {wide_bar} {percent:>3} %  {msg}")
}

fn shaped(total: u64, hidden: bool, template: &str) -> ProgressBar {
    if hidden {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(total).with_style(style)
}
