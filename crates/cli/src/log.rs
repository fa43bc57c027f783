//! `--log`: what the rooms report while they work, and how long it took them.

use std::io::IsTerminal;
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::format::{FmtSpan, format};
use yugen_scene::suggest;

const LEVELS: [&str; 6] = ["off", "error", "warn", "info", "debug", "trace"];

/// Rooms as people name them, and as the compiler does.
const ROOMS: [(&str, &str); 8] = [
    ("optics", "yugen_optics"),
    ("reflectance", "yugen_reflectance"),
    ("archive", "yugen_archive"),
    ("capture", "yugen_capture"),
    ("transport", "yugen_transport"),
    ("realtime", "yugen_realtime"),
    ("view", "yugen_view"),
    ("cli", "yugen"),
];

/// What the filter takes of `LEVEL`, `ROOM=LEVEL` and several of them with commas.
pub fn parse(text: &str) -> Result<String, String> {
    let directives = text.split(',').map(|word| {
        let (room, level) = match word.trim().split_once('=') {
            Some((room, level)) => (Some(room.trim()), level.trim()),
            None => (None, word.trim()),
        };
        let level = level.to_lowercase();
        if !LEVELS.contains(&level.as_str()) {
            return Err(format!("there is no level '{level}'{}", suggest(&level, LEVELS)));
        }
        let Some(room) = room else { return Ok(level) };
        // What stands behind the room is a module of it.
        let (crate_name, module) = room.split_at(room.find("::").unwrap_or(room.len()));
        let found = ROOMS.iter().find(|(short, long)| [*short, *long].contains(&crate_name));
        match found {
            Some((_, long)) => Ok(format!("{long}{module}={level}")),
            None => {
                let names = ROOMS.map(|(short, _)| short);
                Err(format!("there is no room '{crate_name}'{}", suggest(crate_name, names)))
            }
        }
    });
    Ok(directives.collect::<Result<Vec<_>, _>>()?.join(","))
}

/// Reports to standard error, in colours only for people.
pub fn start(filter: &str) {
    let plain = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
    tracing_subscriber::fmt()
        // What winit warns of (a display that says no size) nobody can mend.
        .with_env_filter(EnvFilter::new(format!("{filter},winit=error")))
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal() && !plain)
        // When a piece of work ends its name and time are said.
        .with_span_events(FmtSpan::CLOSE)
        .event_format(format().without_time())
        .init();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_and_rooms_are_known_by_name() {
        assert_eq!(parse("info"), Ok("info".into()));
        assert_eq!(parse("warn, archive=debug"), Ok("warn,yugen_archive=debug".into()));
        assert_eq!(parse("yugen_transport::render=TRACE"), Ok("yugen_transport::render=trace".into()));
        assert!(parse("inof").unwrap_err().contains("did you mean 'info'?"));
        assert!(parse("loud").unwrap_err().contains("expected one of off, error"));
        assert!(parse("warn,archives=info").unwrap_err().contains("did you mean 'archive'?"));
        assert!(parse("").is_err() && parse("archive=").is_err());
    }
}
