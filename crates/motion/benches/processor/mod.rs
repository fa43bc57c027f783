//! Processor time.

/// Seconds that all threads of this process have spent on a processor, in user mode and in the system; no number where the system does not
/// say.
pub fn processor() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the name in parentheses, which may hold anything: user and system time are words 14 and 15 of all, in hundredths of a second.
    let words = stat.rsplit_once(')').map_or("", |(_, after)| after).split_whitespace().skip(11);
    let ticks: Vec<f64> = words.take(2).filter_map(|word| word.parse().ok()).collect();
    if ticks.len() == 2 { (ticks[0] + ticks[1]) / 100.0 } else { f64::NAN }
}
