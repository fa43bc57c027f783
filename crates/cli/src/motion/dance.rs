//! `yugen motion dance`: a dance from a list of its units of form.

use crate::{argument, json};
use anyhow::{Context, Result, anyhow};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use yugen_archive::formats::motion::{Motion, written};
use yugen_archive::{atomic_write, check_outputs, check_writable, read_bounded};
use yugen_motion::dance::{Noise, UNITS, dance, measure, parse};

/// Dances Noh from a list of units of form, as a katatsuke notes a dance: a player who stands, walks, points, opens, turns
/// and throws a sleeve.
///
/// `yugen motion dance list.txt -o dance.bvh`, where list.txt has lines such as `kamae seconds=2`, `hakobi steps=6`, `sashikomi`,
/// `hiraki`, `turn degrees=90`, `sleeve side=left`; `--list` has all of them with their numbers. .bvh and .glb hold the skeleton
/// that moves, .csv and .c3d 19 rigid bodies as a capture would measure them, with noise and gaps if they are wanted.
#[derive(Args)]
pub struct Dance {
    /// The list: a unit on each line; what follows a # is for people.
    #[arg(required_unless_present = "list")]
    units: Option<PathBuf>,

    /// Where to: .bvh, .glb, .csv or .c3d.
    #[arg(short, long, value_name = "FILE", required_unless_present = "list")]
    output: Option<PathBuf>,

    /// Frames a second.
    #[arg(long, value_name = "F", default_value_t = 120.0, value_parser = rate)]
    rate: f64,

    /// Noise of measured bodies: standard deviations of places, mm, and of turns, degrees.
    #[arg(long, value_name = "MM,DEG", value_parser = noise)]
    noise: Option<[f32; 2]>,

    /// How often a minute each measured body is lost, for a quarter of a second at most.
    #[arg(long, value_name = "N", default_value_t = 0.0, value_parser = gaps)]
    gaps: f32,

    /// Same seed, same noise and gaps.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,

    /// The units of form and their numbers.
    #[arg(long)]
    list: bool,

    /// Print what was done as JSON.
    #[arg(long)]
    json: bool,
}

fn rate(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|v: &f64| (1.0..=1000.0).contains(v));
    number.ok_or_else(|| "expected frames a second from 1 to 1000, as in 120".into())
}

fn noise(text: &str) -> Result<[f32; 2], String> {
    let pair = argument::numbers(text).filter(|n: &[f32; 2]| n.iter().all(|v| (0.0..=100.0).contains(v)));
    pair.ok_or_else(|| "expected millimetres and degrees from 0 to 100, as in 0.5,0.3".into())
}

fn gaps(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|v: &f32| (0.0..=120.0).contains(v));
    number.ok_or_else(|| "expected gaps a minute from 0 to 120, as in 10".into())
}

impl Dance {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let (Some(list), Some(output), false) = (&self.units, &self.output, self.list) else {
            for (name, parameters, doc) in UNITS {
                println!("{name}: {doc}");
                for p in parameters {
                    println!("  {}={}  {} to {}: {}", p.name, p.default, p.range[0], p.range[1], p.doc);
                }
            }
            return Ok(());
        };
        let format = written(output)?;
        check_writable(output)?;
        // A megabyte is a dance of days.
        let text = String::from_utf8(read_bounded(list, 1 << 20)?)
            .with_context(|| format!("{}: this is not text in UTF-8", list.display()))?;
        let units = parse(&text).map_err(|e| anyhow!("{}:{}:1: {}", list.display(), e.line, e.problem))?;
        check_outputs([output])?;
        let moved = dance(&units, self.rate).map_err(|e| anyhow!("{}: {e}", list.display()))?;
        let (frames, seconds) = (moved.frames, moved.frames as f64 / self.rate);
        let captured = matches!(format.extension, "csv" | "c3d");
        let motion = if captured {
            let [position, rotation] = self.noise.unwrap_or_default();
            let noise = Noise {
                position: position / 1000.0,
                rotation: rotation.to_radians(),
                gaps: self.gaps,
                longest: 0.25,
                seed: self.seed,
            };
            Motion::Captured(measure(&moved, &noise).with_context(|| list.display().to_string())?)
        } else {
            Motion::Skeletal(moved)
        };
        atomic_write(output, &(format.write)(&motion, output)?)?;
        if self.json {
            json::print(json!({
                "output": output.display().to_string(),
                "format": format.name,
                "units": units.len(),
                "frames": frames,
                "rate": self.rate,
                "seconds": seconds,
            }));
        } else {
            println!(
                "{}: {} units, {seconds:.1} s, {frames} frames ({})",
                output.display(),
                units.len(),
                format.name
            );
        }
        Ok(())
    }
}
