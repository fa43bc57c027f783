//! The `yugen` command: one file per verb.
// Tests look at files as they like.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

#[macro_use]
mod output;
mod argument;
mod brdf;
mod brush;
mod capture;
mod figure;
mod film;
mod font;
mod info;
mod ink;
mod json;
mod log;
mod motion;
mod noh;
mod numbered;
mod progress;
mod render;
mod sequence;
mod simulate;
mod view;

use clap::{Command, CommandFactory, FromArgMatches, Parser, Subcommand};
use std::io::Write;
use std::process::ExitCode;

/// Keeps how a performance looks: reflectance models, measured data and a renderer to trust.
#[derive(Parser)]
#[command(version, propagate_version = true, after_help = COMMON)]
struct Yugen {
    #[command(subcommand)]
    verb: Verb,

    /// What to report while working: off, error, warn, info (what is read and done, and how long it took), debug or
    /// trace; or for a room (archive, capture, transport, …), as in `warn,archive=debug`.
    #[arg(
        long,
        global = true,
        default_value = "warn",
        value_name = "LEVEL",
        value_parser = log::parse,
        display_order = 900
    )]
    log: String,
}

const COMMON: &str = "\
Common cases:
  yugen render scene.xml -o picture.exr               a scene to a picture
  yugen render fox.glb -o walk.mp4 --animation Walk   its animation to a film
  yugen simulate scene.toml --cloth robe -o robe.pc2  its cloth in motion
  yugen view scene.xml                                the same in a window, to turn and to change
  yugen ink scene.glb -o painting.png                 the same by brush, on paper
  yugen info FILE                                     what a scene, stack, picture, table or weave holds
  yugen brdf fit material.binary                      which model meets a measurement best
  yugen capture hdr PHOTOGRAPHS -o STACK              brackets to linear pictures, one a light
  yugen capture calibrate STACK                       where the lamps stood, from a chrome ball
  yugen capture fit STACK -o cloth.btf                what each texel of the cloth reflects
  yugen capture relight cloth.btf --light 1,1,1 -o lit.png
  yugen motion info take.c3d                          what a motion capture holds
  yugen motion preview dance.bvh -o dance.mp4         a film of it, as sticks
  yugen noh stage --preset national -o stage.toml     a Noh stage between fires";

#[derive(Subcommand)]
enum Verb {
    Render(render::Render),
    Film(film::Film),
    Simulate(simulate::Simulate),
    View(view::View),
    Info(info::Info),
    #[command(subcommand)]
    Brdf(brdf::Brdf),
    #[command(subcommand)]
    Capture(capture::Capture),
    #[command(subcommand)]
    Motion(motion::Motion),
    #[command(subcommand)]
    Noh(noh::Noh),
    Ink(ink::Ink),
    Brush(brush::Brush),
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

/// Every verb is a part of `yugen`: its version is that of the whole. And lets every value be a number below zero, so
/// that one that may not be is refused in words that say why.
fn adjusted(command: Command) -> Command {
    command
        .display_name("yugen")
        .mut_args(|a| if a.get_action().takes_values() { a.allow_negative_numbers(true) } else { a })
        .mut_subcommands(adjusted)
}

/// Help and version go to standard output, mistakes to standard error.
fn answer(e: &clap::Error) -> ExitCode {
    match e.print().and_then(|()| std::io::stdout().flush()) {
        Err(problem) if !e.use_stderr() => fail(&output::failed(problem).into()),
        _ => ExitCode::from(u8::try_from(e.exit_code()).unwrap_or(1)),
    }
}

fn fail(e: &anyhow::Error) -> ExitCode {
    eprintln!("yugen: {e:#}");
    ExitCode::FAILURE
}

fn main() -> ExitCode {
    end_with_the_reader();
    let parsed = adjusted(Yugen::command()).try_get_matches();
    let yugen = match parsed.and_then(|matches| Yugen::from_arg_matches(&matches)) {
        Ok(yugen) => yugen,
        Err(e) => return answer(&e),
    };
    log::start(&yugen.log);
    yugen_archive::protect_inputs();
    let outcome = match yugen.verb {
        Verb::Render(verb) => verb.run(),
        Verb::Film(verb) => verb.run(),
        Verb::Simulate(verb) => verb.run(),
        Verb::View(verb) => verb.run(),
        Verb::Info(verb) => verb.run(),
        Verb::Brdf(verb) => verb.run(),
        Verb::Capture(verb) => verb.run(),
        Verb::Motion(verb) => verb.run(),
        Verb::Noh(verb) => verb.run(),
        Verb::Ink(verb) => verb.run(),
        Verb::Brush(verb) => verb.run(),
    };
    match outcome.and_then(|()| Ok(output::flush()?)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => fail(&e),
    }
}
