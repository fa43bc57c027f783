//! What stands behind the options of `yugen render`.

use crate::argument;
use std::time::Duration;
use yugen_scene::Aov;

/// Width and height in pixels.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    argument::pair(text, 1 << 16)
        .ok_or_else(|| "expected width x height in pixels, each 1 to 65536, as in 640x480".into())
}

/// Left, top, width and height of a part of a picture.
pub fn crop(text: &str) -> Result<[u32; 4], String> {
    let all: Result<Vec<u32>, _> = text.split(',').map(|w| w.trim().parse()).collect();
    let all: Option<[u32; 4]> = all.ok().and_then(|all| all.try_into().ok());
    all.filter(|[_, _, w, h]| *w > 0 && *h > 0)
        .ok_or_else(|| "expected left, top, width and height in whole pixels, as in 100,50,64,64".into())
}

/// A span of time: seconds where no unit is given.
pub fn time(text: &str) -> Result<Duration, String> {
    let (number, factor) = match text.char_indices().last() {
        Some((i, 's')) => (&text[..i], 1.0),
        Some((i, 'm')) => (&text[..i], 60.0),
        Some((i, 'h')) => (&text[..i], 3600.0),
        _ => (text, 1.0),
    };
    number
        .parse::<f64>()
        .ok()
        .filter(|s| s.is_finite() && *s > 0.0)
        .and_then(|s| Duration::try_from_secs_f64(s * factor).ok())
        .ok_or_else(|| "expected a time, as in 90, 90s, 5m or 1h".to_string())
}

/// Seconds, none or more.
pub fn seconds(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|s: &f64| (0.0..=1e6).contains(s))
        .ok_or_else(|| "expected a number of seconds, 0 or more".to_string())
}

/// The first and the last frame.
pub fn frames(text: &str) -> Result<[u32; 2], String> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    let number = |t: &str| t.trim().parse::<u32>().ok().filter(|n| *n <= 1 << 24);
    number(first)
        .zip(number(last))
        .filter(|(first, last)| first <= last)
        .map(|(first, last)| [first, last])
        .ok_or_else(|| "expected the first and the last frame, as in 0-47".to_string())
}

/// Frames a second.
pub fn rate(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|r: &f64| (0.1..=1000.0).contains(r))
        .ok_or_else(|| "expected frames a second, 0.1 to 1000, as in 24 or 23.976".to_string())
}

/// A relative error.
pub fn error(text: &str) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|e: &f32| (1e-5..=1.0).contains(e))
        .ok_or_else(|| "expected a relative error between 0.00001 and 1, as in 0.01".to_string())
}

/// One layer, or all of them.
pub fn aov(text: &str) -> Result<Vec<Aov>, String> {
    if text == "all" {
        // Lights apart, they add nothing to the work.
        return Ok(Aov::ALL.into_iter().filter(|a| *a != Aov::Lights).collect());
    }
    Aov::from_name(text).map(|a| vec![a]).ok_or_else(|| {
        format!("there is no layer '{text}'; there are all, {}", Aov::ALL.map(Aov::name).join(", "))
    })
}
