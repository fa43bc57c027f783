//! Files as other people's programs write them: each stands for a kind of fault that a reader or a renderer had, with
//! the value that is right. `cargo test --release -p yugen-cli --test strangers -- --nocapture` prints them as a table.
//!
//! The inputs are written here, small and by hand; a case that needs no picture has none.
#![allow(clippy::disallowed_methods)]

mod exr;
mod gltf;
mod mitsuba;
mod negative;
mod normals;
mod obj;
mod ply;

use std::path::{Path, PathBuf};
use std::process::Command;
use yugen_archive::formats::image;
use yugen_optics::{ColourSpace, Image};

/// Files, the one among them that is rendered, and what is right.
pub struct Case {
    /// For the table, and the folder that it is written to.
    pub name: &'static str,
    /// Names, relative to the folder of the case, and contents.
    pub files: Vec<(&'static str, Vec<u8>)>,
    /// `yugen render` and these words, in the folder of the case; `-o picture.exr` is added.
    pub render: &'static str,
    /// What Yugen did with it once, as a few words.
    pub before: &'static str,
    /// What is right.
    pub right: Right,
    /// Words that the command has to say on the way: a warning, or the refusal. Where there are none it must say nothing.
    pub says: &'static [&'static str],
}

/// What is right.
pub enum Right {
    /// The mean of the picture, linear sRGB, and how far from it is still right.
    Mean([f32; 3], f32),
    /// Whatever a function finds, as a few words; the error says what is wrong.
    Picture(fn(&Image) -> Result<String, String>),
    /// The command fails, saying [`Case::says`].
    Refused,
}

impl Case {
    /// What came out, for the table; the error says what is wrong with it.
    fn outcome(&self, kind: &str) -> Result<String, String> {
        let folder = folder(kind, self.name);
        for (name, bytes) in &self.files {
            let path = folder.join(name);
            std::fs::create_dir_all(path.parent().unwrap_or(&folder)).map_err(|e| e.to_string())?;
            std::fs::write(path, bytes).map_err(|e| e.to_string())?;
        }
        let run = Command::new(env!("CARGO_BIN_EXE_yugen"))
            .arg("render")
            .args(self.render.split_whitespace())
            .args(["-o", "picture.exr"])
            .current_dir(&folder)
            .output()
            .map_err(|e| e.to_string())?;
        let said = String::from_utf8_lossy(&run.stderr).into_owned();
        if let Some(missing) = self.says.iter().find(|w| !said.contains(**w)) {
            return Err(format!("did not say '{missing}' but '{said}'"));
        }
        match self.right {
            Right::Refused if self.says.is_empty() => Err("a refusal has to say something".into()),
            Right::Refused if run.status.success() => Err("was not refused".into()),
            Right::Refused => Ok("refused".into()),
            _ if !run.status.success() => Err(format!("failed: {said}")),
            _ if self.says.is_empty() && !said.is_empty() => Err(format!("complained: {said}")),
            Right::Mean(right, tolerance) => {
                let mean = mean(&picture(&folder.join("picture.exr"))?);
                let far = mean.iter().zip(right).any(|(m, r)| (m - r).abs() > tolerance || m.is_nan());
                let text = format!("{:.3} {:.3} {:.3}", mean[0], mean[1], mean[2]);
                if far {
                    Err(format!("the mean is {text}, right is {right:?} ± {tolerance}"))
                } else {
                    Ok(text)
                }
            }
            Right::Picture(judge) => judge(&picture(&folder.join("picture.exr"))?),
        }
    }
}

/// An empty folder for a case.
pub fn folder(kind: &str, name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("strangers").join(kind).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn picture(path: &Path) -> Result<Image, String> {
    image::read(path, &image::ReadOptions::to(ColourSpace::LinearSrgb)).map_err(|e| e.to_string())
}

/// Of R, G and B.
pub fn mean(image: &Image) -> [f32; 3] {
    let rgb = image.select(&["R", "G", "B"]).unwrap();
    let n = (rgb.width * rgb.height) as f64;
    std::array::from_fn(|c| {
        (rgb.data.iter().skip(c).step_by(3).map(|v| f64::from(*v)).sum::<f64>() / n) as f32
    })
}

/// Prints the table of a kind and fails if one of its cases does.
pub fn check(kind: &str, cases: &[Case]) {
    assert!(!cases.is_empty());
    let mut wrong = Vec::new();
    for case in cases {
        let outcome = case.outcome(kind);
        let (mark, text) = match &outcome {
            Ok(text) => ("right", text),
            Err(text) => ("WRONG", text),
        };
        println!("| {kind} | {} | {} | {text} | {mark} |", case.name, case.before);
        wrong.extend(outcome.err().map(|problem| format!("{}: {problem}", case.name)));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A comparison that never fails proves nothing.
#[test]
fn the_check_finds_a_wrong_mean_and_a_missing_refusal() {
    let scene = "[[light]]\ntype = \"constant\"\n[[shape]]\ntype = \"sphere\"\n";
    let case = |name, right, says| Case {
        name,
        files: vec![("scene.toml", scene.into())],
        render: "scene.toml --size 8x8 --spp 4",
        before: "",
        right,
        says,
    };
    assert!(case("wrong mean", Right::Mean([9.0; 3], 0.1), &[]).outcome("sabotage").is_err());
    assert!(case("no refusal", Right::Refused, &["x"]).outcome("sabotage").is_err());
    assert!(case("silent", Right::Mean([0.5; 3], 9.0), &["a warning"]).outcome("sabotage").is_err());
    assert!(case("fine", Right::Mean([0.5; 3], 9.0), &[]).outcome("sabotage").is_ok());
}
