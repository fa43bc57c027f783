//! `yugen motion solve`: rigid bodies to a skeleton.

use super::Reading;
use crate::json;
use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::json;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use yugen_archive::formats::motion::{Motion, written};
use yugen_archive::{atomic_write, check_outputs, check_writable, read_bounded};
use yugen_motion::Tracks;
use yugen_motion::solve::{SMPL, SolveError, SolveOptions, Solved, VICON, bodies, solve, solve_points};
use yugen_optics::Vec3;

/// Makes a skeleton of rigid bodies: joints where bodies turn about each other, bones that keep their lengths, gaps filled,
/// noise taken out without delay.
///
/// `yugen motion solve bodies.csv -o dance.bvh`. The bodies are those of a performer: pelvis, waist, chest, neck, head, and left
/// and right clavicle, upper arm, forearm, hand, thigh, shank and foot, as many of them as there are, and a fan; or those
/// of --tree. The pose of the first half second, or of --rest, becomes that of the skeleton at rest. A take without bodies
/// that has labelled markers of Vicon's set (LFWT, C7, LKNE, …) gets bodies of them first; markers that are the joints of
/// SMPL (Pelvis, Left_hip, …), or those of --tree, are taken for joints.
#[derive(Args)]
pub struct Solve {
    /// The take: .csv, .tsv or .c3d with rigid bodies or labelled markers; or what moves a skeleton, whose joints are taken
    /// for bodies.
    file: PathBuf,

    /// The skeleton that moves: .bvh, .glb, .csv or .c3d.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    #[command(flatten)]
    reading: Reading,

    /// Frames of the pose at rest, counted from 0.
    #[arg(long, value_name = "A-B", value_parser = frames)]
    rest: Option<RangeInclusive<usize>>,

    /// What is faster is noise, Hz; hands, feet and fan have twice as much.
    #[arg(long, value_name = "HZ", default_value_t = 6.0, value_parser = cutoff)]
    cutoff: f64,

    /// Which body carries which: a text with a body and its carrier on each line, and a body alone that carries all.
    #[arg(long, value_name = "FILE")]
    tree: Option<PathBuf>,

    /// Print what was done as JSON.
    #[arg(long)]
    json: bool,
}

fn frames(text: &str) -> Result<RangeInclusive<usize>, String> {
    let pair = text.split_once('-').and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    pair.filter(|(a, b)| a <= b).map(|(a, b)| a..=b).ok_or_else(|| "expected frames, as in 0-60".into())
}

fn cutoff(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|v: &f64| *v > 0.0 && v.is_finite());
    number.ok_or_else(|| "expected a frequency above zero, as in 6".into())
}

impl Solve {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let format = written(&self.output)?;
        check_writable(&self.output)?;
        let mut options = SolveOptions {
            rest: self.rest.clone(),
            cutoff: self.cutoff,
            quick: 2.0 * self.cutoff,
            ..SolveOptions::default()
        };
        if let Some(tree) = &self.tree {
            options.tree = read_tree(tree)?;
        }
        let loaded = self.reading.load(&self.file, false)?;
        check_outputs([&self.output])?;
        let name = || self.file.display().to_string();
        let solved = {
            let _span = tracing::info_span!("solve").entered();
            match &loaded.motion {
                Motion::Skeletal(moved) => solve(&moved.take().with_context(name)?.bodies, &options),
                Motion::Captured(take) if !take.bodies.tracks.is_empty() => solve(&take.bodies, &options),
                Motion::Captured(take) => self.solve_markers(&take.markers, options)?,
            }
            .with_context(name)?
        };
        let (frames, rate) = (solved.motion.frames, solved.motion.rate);
        let fits = report(&solved);
        let motion = Motion::Skeletal(solved.motion);
        atomic_write(&self.output, &(format.write)(&motion, &self.output)?)?;
        if self.json {
            json::print(json!({
                "output": self.output.display().to_string(),
                "format": format.name,
                "frames": frames,
                "rate": rate,
                "bodies": fits,
            }));
        } else {
            println!(
                "{:<20} {:>7} {:>9} {:>9} {:>8} {:>7}",
                "body", "filled", "bone mm", "joint mm", "off mm", "off °"
            );
            for fit in fits {
                let number = |key: &str| fit[key].as_f64().unwrap_or(0.0);
                println!(
                    "{:<20} {:>7} {:>9.1} {:>9.2} {:>8.2} {:>7.2}",
                    fit["name"].as_str().unwrap_or_default(),
                    fit["filled_frames"],
                    1000.0 * number("bone"),
                    1000.0 * number("joint_apart"),
                    1000.0 * number("position_off"),
                    number("rotation_off_degrees"),
                );
            }
            println!("{}: {} frames ({})", self.output.display(), frames, format.name);
        }
        Ok(())
    }
}

fn report(solved: &Solved) -> Vec<serde_json::Value> {
    let fits = solved.fits.iter().map(|f| {
        json!({
            "name": f.name,
            "filled_frames": f.filled,
            "bone": f.bone as f32,
            "joint_apart": f.joint_apart as f32,
            "position_off": f.position_off as f32,
            "rotation_off_degrees": f.rotation_off.to_degrees() as f32,
        })
    });
    fits.collect()
}

impl Solve {
    /// Markers that are the joints of a tree; else those on the segments of a performer.
    fn solve_markers(
        &self,
        markers: &Tracks<Vec3>,
        mut options: SolveOptions,
    ) -> Result<Result<Solved, SolveError>> {
        let joints = markers.tracks.iter().all(|t| SMPL.iter().any(|(name, _)| *name == t.name));
        if joints && self.tree.is_none() {
            options.tree = SMPL.map(|(a, b)| (a.to_string(), b.to_string())).to_vec();
        }
        if joints || self.tree.is_some() {
            return Ok(solve_points(markers, &options));
        }
        let found = bodies(markers, &VICON);
        if found.tracks.len() < 2 {
            bail!(
                "{}: there are no rigid bodies in this take, and its markers have not the names that Vicon's systems use (LFWT, \
                 C7, LKNE, …) nor those of SMPL's joints; if they are joints, say by --tree which carries which",
                self.file.display()
            );
        }
        Ok(solve(&found, &options))
    }
}

/// Lines of a body and its carrier.
fn read_tree(path: &Path) -> Result<Vec<(String, String)>> {
    // A megabyte of names.
    let text = String::from_utf8(read_bounded(path, 1 << 20)?)
        .with_context(|| format!("{}: this is not text in UTF-8", path.display()))?;
    let mut tree = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split('#').next().unwrap_or_default().split_whitespace().collect();
        match words[..] {
            [] => {}
            [root] => tree.push((root.to_string(), String::new())),
            [body, carrier] => tree.push((body.to_string(), carrier.to_string())),
            _ => bail!(
                "{}:{}:1: expected a body and its carrier, found {} words",
                path.display(),
                i + 1,
                words.len()
            ),
        }
    }
    Ok(tree)
}
