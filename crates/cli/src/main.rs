//! The `yugen` command: one file per verb.

mod argument;
mod brdf;
mod capture;
mod figure;
mod progress;
mod render;

use clap::{Command, CommandFactory, FromArgMatches, Parser, Subcommand};
use std::process::ExitCode;

/// Keeps how a performance looks: reflectance models, measured data and a renderer to trust.
#[derive(Parser)]
#[command(version, propagate_version = true, after_help = COMMON)]
struct Yugen {
    #[command(subcommand)]
    verb: Verb,

    /// What to report while working: error, warn, info, debug or trace; or per room, as in
    /// `warn,yugen_archive=debug`.
    #[arg(long, global = true, default_value = "warn", value_name = "LEVEL", display_order = 900)]
    log: String,
}

const COMMON: &str = "\
Common cases:
  yugen render scene.xml -o picture.exr               a scene to a picture
  yugen brdf fit material.binary                      which model meets a measurement best
  yugen capture hdr PHOTOGRAPHS -o STACK              brackets to linear pictures, one a light
  yugen capture calibrate STACK                       where the lamps stood, from a chrome ball
  yugen capture fit STACK -o cloth.btf                what each texel of the cloth reflects
  yugen capture relight cloth.btf --light 1,1,1 -o lit.png";

#[derive(Subcommand)]
enum Verb {
    Render(render::Render),
    #[command(subcommand)]
    Brdf(brdf::Brdf),
    #[command(subcommand)]
    Capture(capture::Capture),
}

/// A reader that has seen enough, as `head` has, ends the program quietly, as it ends others.
#[cfg(unix)]
#[allow(unsafe_code)]
fn end_with_the_reader() {
    // SAFETY: this is the first that main does: no other thread runs, and no handler of our own is installed.
    unsafe { libc::signal(libc::SIGPIPE, libc::SIG_DFL) };
}

#[cfg(not(unix))]
fn end_with_the_reader() {}

/// Lets every value be a number below zero, so that one that may not be is refused in words that say why.
fn with_negative_numbers(command: Command) -> Command {
    command
        .mut_args(|a| if a.get_action().takes_values() { a.allow_negative_numbers(true) } else { a })
        .mut_subcommands(with_negative_numbers)
}

fn main() -> ExitCode {
    end_with_the_reader();
    let matches = with_negative_numbers(Yugen::command()).get_matches();
    let yugen = Yugen::from_arg_matches(&matches).unwrap_or_else(|e| e.exit());
    let filter = match tracing_subscriber::EnvFilter::try_new(&yugen.log) {
        Ok(filter) => filter,
        Err(e) => {
            eprintln!("yugen: --log {}: {e}", yugen.log);
            return ExitCode::FAILURE;
        }
    };
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).without_time().init();
    let outcome = match yugen.verb {
        Verb::Render(verb) => verb.run(),
        Verb::Brdf(verb) => verb.run(),
        Verb::Capture(verb) => verb.run(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("yugen: {e:#}");
            ExitCode::FAILURE
        }
    }
}
