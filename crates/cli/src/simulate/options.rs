//! Which cloth moves and how: what `simulate` and `view` are told of it.

use crate::argument;
use crate::render::rate;
use anyhow::{Context, Result, bail};
use clap::Args;
use std::ops::RangeInclusive;
use std::path::Path;
use yugen_motion::cloth::{Fabric, MOST_WIND, PRESETS};
use yugen_optics::{Fingerprint, Vec2, Vec3};
use yugen_scene::{Scene, suggest};

/// Cloth of a scene, or garments of a figure.
#[derive(Args, Clone, PartialEq)]
pub struct ClothOptions {
    /// Shapes of which the name begins so are cloth [default: all that a mesh file holds].
    #[arg(long, value_name = "NAME")]
    pub cloth: Option<String>,

    /// Garments for the figure that has the most joints, the innermost first: of each a cut, measures that differ from its own and its
    /// fabric if it is another one, as in "okuchi hemp choken length=1.1", or a file with these words. Measures that are not given fit
    /// the figure.
    #[arg(long, value_name = "CUT", conflicts_with_all = ["cloth", "pattern", "pin", "no_contact"])]
    pub garment: Option<String>,

    /// Edges of the garment's triangles, mm; half as long takes some eight times as long [default: 25].
    #[arg(long, value_name = "MM", value_parser = argument::edge, requires = "garment")]
    pub edge: Option<f32>,

    /// Which joint of the figure is what, where its name does not tell, as in left_upper_arm=Bone7: the joint at which that part begins;
    /// may be repeated.
    #[arg(long = "joint", value_name = "PART=JOINT", value_parser = joint, requires = "garment")]
    pub joint: Vec<(String, String)>,

    /// So many times as thick as its mesh, or as a player of Noh where it has none, the figure is under the garment.
    #[arg(long, value_name = "F", value_parser = girth, requires = "garment")]
    pub girth: Option<f32>,

    /// What it is made of.
    #[arg(long, default_value = Fabric::DEFAULT, value_parser = PRESETS.iter().map(|p| p.name).collect::<Vec<_>>(), value_name = "FABRIC")]
    pub fabric: String,

    /// Another number of the fabric, as in areal_mass=0.2; may be repeated.
    #[arg(long = "set", value_name = "QUANTITY=VALUE")]
    pub set: Vec<String>,

    /// Metres for a unit of u and of v [default: those that fit the mesh best].
    #[arg(long, value_name = "U,V", value_parser = scale)]
    pub pattern: Option<Vec2>,

    /// Vertices within R metres of X,Y,Z are attached, and go where the scene takes them; may be repeated.
    #[arg(long, value_name = "X,Y,Z,R", value_parser = pin, allow_hyphen_values = true)]
    pub pin: Vec<[f32; 4]>,

    /// A ground at this height, m [default: none; of a garment that on which the figure stands in the first frame].
    #[arg(long, value_name = "Y", allow_hyphen_values = true)]
    pub ground: Option<f32>,

    /// Velocity of the air, m/s.
    #[arg(long, value_name = "X,Y,Z", value_parser = velocity, allow_hyphen_values = true)]
    pub wind: Option<Vec3>,

    /// Frames a second.
    #[arg(long, default_value = "60", value_name = "F", value_parser = rate)]
    pub fps: f64,

    /// The scene's animation to play [default: the first].
    #[arg(long, value_name = "NAME")]
    pub animation: Option<String>,

    /// Substeps of a frame, at the least [default: 20; of a garment 64].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub substeps: Option<u32>,

    /// Cloth does not touch cloth: faster, where it does not fold.
    #[arg(long)]
    pub no_contact: bool,

    /// Threads [default: as many as there are cores]; the result does not depend on them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub threads: Option<u16>,

    /// Move the cloth on the GPU. It begins where the processor has put it, and folds fall otherwise than there.
    #[arg(long)]
    pub gpu: bool,
}

fn scale(text: &str) -> Result<Vec2, String> {
    let both = argument::numbers::<2>(text).or_else(|| text.parse().ok().map(|v| [v; 2]));
    let both = both.filter(|v| v.iter().all(|v| *v > 0.0 && v.is_finite())).map(Vec2::from_array);
    both.ok_or_else(|| "expected metres for a unit of u and of v, as in 0.38,3.5".into())
}

fn pin(text: &str) -> Result<[f32; 4], String> {
    let good = argument::numbers::<4>(text).filter(|p| p[3] > 0.0);
    good.ok_or_else(|| "expected a place and a radius above zero, as in 0,1.5,0,0.05".into())
}

fn velocity(text: &str) -> Result<Vec3, String> {
    let good = argument::numbers::<3>(text).map(Vec3::from_array).filter(|v| v.length() <= MOST_WIND);
    good.ok_or_else(|| format!("expected a velocity of at most {MOST_WIND} m/s, as in 0,0,-3"))
}

fn joint(text: &str) -> Result<(String, String), String> {
    let pair = text.split_once('=').filter(|(part, joint)| !part.is_empty() && !joint.is_empty());
    let pair = pair.map(|(part, joint)| (part.to_string(), joint.to_string()));
    pair.ok_or_else(|| "expected PART=JOINT, as in left_upper_arm=Bone7".into())
}

/// What `--girth` takes.
pub const GIRTH: RangeInclusive<f32> = 0.2..=3.0;

fn girth(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|v: &f32| GIRTH.contains(v));
    number.ok_or_else(|| format!("expected a number from {} to {}, as in 1.1", GIRTH.start(), GIRTH.end()))
}

impl ClothOptions {
    /// These, where they say which shapes are cloth or what is worn; none where nothing was given.
    #[cfg(feature = "view")]
    pub fn wanted(self) -> Result<Option<Self>> {
        if self.cloth.is_some() || self.garment.is_some() {
            return Ok(Some(self));
        }
        let nothing = Self::augment_args(clap::Command::new("")).try_get_matches_from([""])?;
        if self != <Self as clap::FromArgMatches>::from_arg_matches(&nothing)? {
            bail!(
                "these options say how cloth moves, but not which shapes are cloth: give --cloth with the beginning of their names, or \
                 --garment"
            );
        }
        Ok(None)
    }

    /// Takes in every option on which the result depends.
    pub fn fingerprint(&self, print: &mut Fingerprint) {
        print.debug(&(
            &self.cloth,
            &self.garment,
            self.edge,
            &self.joint,
            self.girth,
            &self.fabric,
            &self.set,
        ));
        print.debug(&(
            self.pattern,
            &self.pin,
            self.ground,
            self.wind,
            self.fps,
            &self.animation,
            self.substeps,
        ));
        print.debug(&(self.no_contact, self.gpu));
        let words = self.garment.as_deref().map(argument::garment_words);
        print.debug(&words.and_then(Result::ok));
    }

    /// What it is made of.
    pub fn fabric(&self) -> Result<Fabric> {
        let preset = Fabric::preset(&self.fabric).context("a fabric of the list was expected")?;
        let mut fabric = preset.fabric;
        for text in &self.set {
            let pair =
                text.split_once('=').and_then(|(k, v)| Some((k.trim(), v.trim().parse::<f32>().ok()?)));
            let Some((name, value)) = pair else {
                bail!("--set {text}: expected QUANTITY=VALUE with a number, as in areal_mass=0.2");
            };
            let Some(quantity) = yugen_motion::cloth::QUANTITIES.iter().find(|q| q.name == name) else {
                let known = yugen_motion::cloth::QUANTITIES.iter().map(|q| q.name);
                bail!("a fabric has no quantity '{name}'{}", suggest(name, known));
            };
            *(quantity.place)(&mut fabric) = value;
        }
        fabric.check()?;
        Ok(fabric)
    }

    /// Takes a scene from `file` to where its animation is at `seconds`.
    pub fn pose(&self, file: &Path, scene: &mut Scene, seconds: f64) -> Result<()> {
        if !scene.figures.is_empty() || !scene.caches.is_empty() {
            scene.pose(self.animation.as_deref(), seconds as f32)?;
        } else if let Some(name) = &self.animation {
            bail!("there is no animation called '{name}': nothing in {} moves", file.display());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_the_command_line_are_read_or_told() {
        assert_eq!(scale("0.5"), Ok(Vec2::splat(0.5)));
        assert_eq!(scale("0.38,3.5"), Ok(Vec2::new(0.38, 3.5)));
        assert!(scale("0,1").is_err() && scale("x").is_err());
        assert_eq!(pin("0,1.5,0,0.05"), Ok([0.0, 1.5, 0.0, 0.05]));
        assert!(pin("0,1.5,0,0").is_err() && velocity("1,2").is_err() && velocity("1e9,0,0").is_err());
    }
}
