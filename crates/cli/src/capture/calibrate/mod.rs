//! `yugen capture calibrate`.

mod pictures;
mod preview;

use super::hdr::{BAD_LENS, lens};
use crate::{argument, json, progress};
use anyhow::{Context, Result, anyhow, bail, ensure};
use clap::Args;
use indicatif::ProgressBar;
use pictures::{Grey, Pictures, name};
use serde_json::json;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use yugen_archive::formats::image;
use yugen_archive::formats::lp;
use yugen_archive::formats::stack::{self, Response};
use yugen_archive::{check_outputs, check_writable, will_read};
use yugen_capture::calibrate::{
    Ball, Disagreement, Fault, Highlight, Outline, Ray, View, Window, explain, fault, highlight,
    mean_direction, measure, on_dome, triangulate, uncertainty,
};
use yugen_capture::lens::Lens;
use yugen_optics::{Vec2, Vec3};

/// Finds where the lights stood from their mirror images in polished balls beside the sample.
///
/// `yugen capture calibrate STACK --balls 2` looks for two balls in the pictures of STACK and writes STACK/lights.lp.
/// With one ball the lamps are taken as far away; with two or more and --near, or with one and --dome, they get
/// positions. Balls that disagree, and circles that are no polished balls, are refused with the reason. Look at the
/// picture that --preview draws, and point at a ball that was not met with --ball x,y,radius.
#[derive(Args)]
pub struct Calibrate {
    /// The folder of pictures, one a light.
    folder: PathBuf,

    /// How many balls to look for.
    #[arg(long, default_value_t = 1, value_name = "N", conflicts_with = "ball")]
    balls: usize,

    /// The outline of a ball in pixels from the top left, to look for its rim near there (within a twentieth of the
    /// radius; where none shows it is taken as given); may be given again.
    #[arg(long, value_name = "X,Y,RADIUS", value_parser = ball)]
    ball: Vec<Ball>,

    /// A picture in which the balls stand out, such as one with the room's light or a mask, to look for them in
    /// instead of what stays in place in all pictures.
    #[arg(long, value_name = "FILE")]
    outline: Option<PathBuf>,

    /// Pictures that are no light's: the ambient one, for example.
    #[arg(long, value_name = "NAME")]
    skip: Vec<String>,

    /// Focal length in pixels (millimetres divided by the sensor's width, times the picture's); without it the camera
    /// is taken as far away.
    #[arg(long, value_name = "PIXELS")]
    focal: Option<f32>,

    /// The lens, undone before anything is measured: focal length and centre in pixels, then k1, k2, p1, p2 and k3 of
    /// Brown and Conrady, as OpenCV writes them. Not for pictures that `hdr --lens` has straightened.
    #[arg(long, value_name = "F,CX,CY,K1,K2,P1,P2,K3", value_parser = lens, allow_hyphen_values = true)]
    lens: Option<Lens>,

    /// The lamps are near: find their positions from two balls or more.
    #[arg(long)]
    near: bool,

    /// The lamps stand on a dome of this radius around the middle of the sample, in widths of the picture.
    #[arg(long, value_name = "WIDTHS", conflicts_with = "near")]
    dome: Option<f32>,

    /// The list to write; FOLDER/lights.lp where absent. OBJECT/lights.lp makes it the list of another stack, whose
    /// pictures it means in the order of their names where the names are others.
    #[arg(short, long, value_name = "LP")]
    output: Option<PathBuf>,

    /// The angle in degrees beyond which balls disagree. Directions that are not as sure as that (in 99 of 100 cases) are
    /// refused or, where they are few, left out.
    #[arg(long, value_name = "DEGREES", default_value_t = 0.3)]
    tolerance: f32,

    /// Replace a list that is there.
    #[arg(long)]
    force: bool,

    /// Draw the balls and the mirror images.
    #[arg(long, value_name = "PNG")]
    preview: Option<PathBuf>,

    /// Print the report as JSON, and no progress.
    #[arg(long)]
    json: bool,
}

/// A circle and what it shows.
struct Candidate {
    /// As the picture shows it.
    seen: Ball,
    outline: Outline,
    /// The lamps' mirror images, a picture each.
    highlights: Vec<Option<Highlight>>,
    fault: Option<Fault>,
}

/// What was found of a light.
struct Found {
    file: String,
    light: Vec3,
    /// Balls in which it shows.
    balls: usize,
    /// By how much the balls disagree, in degrees.
    spread: f32,
    /// Its direction is wrong by less in 99 of 100 cases, in degrees.
    uncertainty: f32,
}

/// 99 of 100 errors in two dimensions are smaller than so many standard deviations: √(2 ln 100).
const SURE: f32 = 3.035;
/// Bytes of pictures that are kept around balls to measure their rims in.
const WINDOWS: usize = 512 << 20;

impl Calibrate {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let output = self.output.clone().unwrap_or_else(|| self.folder.join(stack::LIGHTS));
        ensure!(
            self.force || !output.exists(),
            "{} is there already; say --force to replace it",
            output.display()
        );
        let all = stack::pictures(&self.folder, &[stack::MASK])?;
        let above_zero = |v: f32| v > 0.0 && v.is_finite();
        ensure!(self.focal.is_none_or(above_zero), "--focal: expected a length above zero");
        ensure!(self.dome.is_none_or(above_zero), "--dome: expected a radius above zero");
        ensure!(above_zero(self.tolerance), "--tolerance: expected an angle above zero");
        ensure!((1..=64).contains(&self.balls), "--balls {}: expected 1 to 64", self.balls);
        let count = if self.ball.is_empty() { self.balls } else { self.ball.len() };
        ensure!(!self.near || count > 1, "--near takes two balls or more; with one, give the --dome");
        check_writable(&output)?;
        if let Some(preview) = &self.preview {
            image::can_write(preview)?;
        }
        let options = stack::Options::read(&self.folder)?;
        if let Some(none) = self.skip.iter().find(|s| !all.iter().any(|p| name(p) == **s)) {
            bail!("--skip {none}: there is no such picture in {}", self.folder.display());
        }
        let files: Vec<PathBuf> = all
            .iter()
            .filter(|p| !self.skip.contains(&name(p)) && options.ambient != Some(name(p)))
            .filter(|p| options.mask != Some(name(p)))
            .cloned()
            .collect();
        if files.is_empty() {
            return Err(stack::no_picture(&self.folder).into());
        }
        all.iter().chain(&self.outline).for_each(|p| will_read(p));
        check_outputs([Some(&output), self.preview.as_ref()].into_iter().flatten())?;

        let bar = progress::bar(files.len() as u64, self.json);
        let mut pictures = Pictures::read(files, &options.response, self.outline.is_none(), &bar)?;
        let (width, height) = (pictures.width, pictures.height);
        if let Some(lens) = &self.lens {
            ensure!(lens.fits(width, height), BAD_LENS);
        }
        let view = View { width, height, focal: self.focal.or(self.lens.map(|l| l.focal)), lens: self.lens };
        for Ball { centre, radius } in &self.ball {
            let inside = Vec2::ZERO.cmple(*centre).all()
                && centre.cmple(Vec2::new(width as f32, height as f32)).all()
                && *radius <= width.max(height) as f32;
            ensure!(
                inside,
                "--ball {},{},{radius}: the pictures have {width} x {height} pixels",
                centre.x,
                centre.y
            );
        }
        let candidates = self.candidates(&view, &mut pictures, &options.response, &bar)?;
        bar.finish_and_clear();
        // Also of a failure: it shows what is wrong.
        if let Some(path) = &self.preview {
            preview::draw(path, &pictures.brightest, &view, &candidates)?;
        }
        let good: Vec<&Candidate> = candidates.iter().filter(|c| c.fault.is_none()).take(count).collect();
        if good.len() < count {
            bail!(self.too_few(&candidates, good.len(), count));
        }
        let names: Vec<String> = pictures.files.iter().map(|f| name(f)).collect();
        let found = self.lights(&view, &good, &mut pictures)?;
        for (picture, why) in &pictures.bad {
            tracing::warn!("{picture} is left out: {why}");
        }
        // Beside the balls, or in another stack for which they speak.
        let beside = output.parent().unwrap_or(Path::new("")).to_path_buf();
        let elsewhere = beside.canonicalize().ok() != self.folder.canonicalize().ok();
        if !pictures.bad.is_empty() && (elsewhere || !options.intensities.is_empty()) {
            bail!(
                "{}: {} of the lights are not known, and {}; photograph them again, or leave their pictures out there as well",
                self.folder.display(),
                pictures.bad.len(),
                match elsewhere {
                    true => "the other stack has pictures of them",
                    false => "stack.toml has intensities of them",
                }
            );
        }
        let entries: Vec<lp::Entry> =
            found.iter().map(|f| lp::Entry { file: f.file.clone(), light: f.light }).collect();
        let near = self.near || self.dome.is_some();
        if output.file_name().is_some_and(|n| n == stack::LIGHTS) {
            let said = stack::Options::read(&beside)?;
            // The balls prove the focal length of their own pictures; another stack may say better of its own.
            let distance = view.focal.and_then(|f| stack::distance_told(f / width as f32, "--focal"));
            let options = stack::Options {
                camera_distance: if elsewhere {
                    said.camera_distance.or(distance)
                } else {
                    distance.or(said.camera_distance)
                },
                lights: stack::LIGHTS.into(),
                axes: lp::Axes::default(),
                near,
                field_width: 1.0,
                ..said
            };
            stack::amend(&beside, &entries, &options)?;
        } else {
            yugen_archive::atomic_write(&output, lp::write(&entries, &output)?.as_bytes())?;
        }
        self.report(&output, &good, &names, &found, &pictures.bad, near);
        Ok(())
    }

    /// Circles in the pictures, measured at full size, and what is wrong with them.
    fn candidates(
        &self,
        view: &View,
        pictures: &mut Pictures,
        response: &Response,
        bar: &ProgressBar,
    ) -> Result<Vec<Candidate>> {
        let (width, height) = (view.width, view.height);
        let outline = match &self.outline {
            Some(path) => {
                let outline = Grey::read(path, response)?;
                outline.same_size(path, width, height)?;
                pictures.overview.add(&outline.values, width);
                pictures.brightest = outline.values.clone();
                Some(outline)
            }
            None => None,
        };
        // A coin, a print or a washer may be a better circle than a ball.
        let circles: Vec<(Ball, bool)> = if self.ball.is_empty() {
            pictures.overview.circles(self.balls + 4).iter().map(|c| (c.ball, c.whole)).collect()
        } else {
            self.ball.iter().map(|b| (*b, true)).collect()
        };
        let mut windows: Vec<Window> =
            circles.iter().map(|(ball, _)| Window::around(*ball, width, height)).collect();
        let bytes: usize = windows.iter().map(|w| 4 * w.size[0] * w.size[1]).sum();
        let kept = (WINDOWS / bytes.max(1)).clamp(3, pictures.files.len().max(3));
        let every = pictures.files.len().div_ceil(kept).max(1);
        let mut still: Vec<Vec<f32>> =
            windows.iter().map(|w| vec![f32::INFINITY; w.size[0] * w.size[1]]).collect();
        if let Some(outline) = &outline {
            windows.iter_mut().for_each(|w| w.add(&outline.values, width));
        }
        bar.reset();
        for (i, file) in pictures.files.iter().enumerate() {
            let picture = Grey::read(file, response)?;
            for (window, still) in windows.iter_mut().zip(&mut still) {
                let cut = window.cut(&picture.values, width);
                still.iter_mut().zip(&cut).for_each(|(a, b)| *a = a.min(*b));
                if outline.is_none() && i % every == 0 {
                    window.pictures.push(cut);
                }
            }
            bar.inc(1);
        }
        // Then they need not be decoded once more.
        let all_kept = every == 1 && outline.is_none();
        let mut candidates = Vec::new();
        for (window, (seen, whole)) in windows.iter_mut().zip(&circles) {
            let given = !self.ball.is_empty();
            let reach = if given {
                (0.05 * seen.radius).max(2.0)
            } else {
                2.0 * pictures.overview.factor() as f32 + 2.0
            };
            let start = view.straightened(*seen);
            // The rim of what was pointed at lies near, or it is that of something else.
            let near = |o: &Outline| {
                let off = o.ball.centre.distance(start.centre).max((o.ball.radius - start.radius).abs());
                !given || off <= reach
            };
            let exact = measure(window, view, start, reach).filter(near);
            let fault = match (whole, exact) {
                (false, _) => Some(Fault::Cut),
                (true, None) if !given => Some(Fault::NoRim),
                _ => None,
            };
            if given && exact.is_none() {
                tracing::warn!(
                    "--ball {},{},{}: no rim shows near there, and it is taken as given, to half a pixel",
                    seen.centre.x,
                    seen.centre.y,
                    seen.radius
                );
            }
            let as_given = Outline {
                ball: start,
                sigma: 0.5,
                radius_sigma: 0.5,
                shown: 1.0,
                stretch: 0.0,
                nearer: None,
                step: 1.0,
                mirrored: 0.0,
            };
            let mut seen = *seen;
            if let Some(exact) = exact {
                let rim = view.rim(exact.ball, &[0.0, 0.25, 0.5, 0.75].map(|t| t * std::f32::consts::TAU));
                if let Some(rim) = rim {
                    let centre = rim.iter().copied().sum::<Vec2>() / 4.0;
                    let radius = rim.iter().map(|p| p.distance(centre)).sum::<f32>() / 4.0;
                    seen = Ball { centre, radius };
                }
            }
            // On a lit table the circle that was met first may be the border of what the ball mirrors of it.
            let Ball { centre, radius } = seen;
            let inside = centre.x >= radius
                && centre.y >= radius
                && centre.x + radius <= width as f32
                && centre.y + radius <= height as f32;
            let fault = if inside { fault } else { Some(Fault::Cut) };
            if !all_kept {
                window.pictures.clear();
            }
            candidates.push(Candidate {
                seen,
                outline: exact.unwrap_or(as_given),
                highlights: Vec::new(),
                fault,
            });
        }
        // What the darkest of two shows may be a lamp's.
        let many = pictures.files.len() > 2;
        let mut all: Vec<Vec<Option<Highlight>>> = vec![Vec::new(); candidates.len()];
        bar.reset();
        for (i, file) in pictures.files.iter().enumerate() {
            let picture = if all_kept { None } else { Some(Grey::read(file, response)?) };
            for (((candidate, window), still), all) in
                candidates.iter_mut().zip(&windows).zip(&still).zip(&mut all)
            {
                let cut = match &picture {
                    Some(picture) => Cow::Owned(window.cut(&picture.values, width)),
                    None => Cow::Borrowed(&window.pictures[i]),
                };
                let corner = Vec2::new(window.corner[0] as f32, window.corner[1] as f32);
                let ball = Ball { centre: candidate.seen.centre - corner, ..candidate.seen };
                let look = |still: Option<&[f32]>| {
                    highlight(&cut, window.size[0], window.size[1], ball, still)
                        .map(|h| Highlight { at: h.at + corner, ..h })
                };
                candidate.highlights.push(look(many.then_some(still)));
                all.push(look(None));
            }
            bar.inc(1);
        }
        for (candidate, all) in candidates.iter_mut().zip(&all) {
            if candidate.fault.is_none() {
                let given = self.outline.is_some() || !self.ball.is_empty();
                candidate.fault = fault(view, &candidate.outline, given, &candidate.highlights, all);
            }
        }
        Ok(candidates)
    }

    /// Why there are not as many balls as were asked for.
    fn too_few(&self, candidates: &[Candidate], good: usize, count: usize) -> anyhow::Error {
        let mut text = format!("{good} of {count} balls were found");
        for c in candidates.iter().filter(|c| c.fault.is_some()).take(3) {
            if let Some(fault) = c.fault {
                let Ball { centre, radius } = c.seen;
                text += &format!(
                    "; the circle at {:.0}, {:.0} with radius {radius:.0} {fault}",
                    centre.x, centre.y
                );
            }
        }
        if candidates.is_empty() {
            text += "; no circle stands out in the pictures";
        }
        if self.ball.is_empty() {
            text += "; or point at the ball with --ball x,y,radius";
        }
        if self.preview.is_none() {
            text += " (--preview draws what was found)";
        }
        anyhow!(text)
    }

    /// What the balls say of the lights. Few pictures that say nothing sure are left out.
    fn lights(&self, view: &View, balls: &[&Candidate], pictures: &mut Pictures) -> Result<Vec<Found>> {
        let tolerance = self.tolerance.to_radians();
        let ray = |ball: &Candidate, i: usize| {
            let highlight = ball.highlights[i].as_ref()?;
            let ray = view.reflect(ball.outline.ball, highlight.at)?;
            Some((ray, uncertainty(ball.seen, &ball.outline, highlight)))
        };
        let rays: Vec<Vec<Option<(Ray, f32)>>> =
            (0..pictures.files.len()).map(|i| balls.iter().map(|b| ray(b, i)).collect()).collect();
        let only = |rays: &Vec<Option<(Ray, f32)>>| rays.iter().map(|r| r.map(|r| r.0)).collect::<Vec<_>>();
        // Distant lamps, as all balls see them: what disagrees is a wrong outline, a near lamp or a near camera.
        let mut limits = Vec::new();
        let mut spreads = Vec::new();
        for rays in &rays {
            let known: Vec<(Ray, f32)> = rays.iter().flatten().copied().collect();
            if known.len() > 1 {
                let directions: Vec<Ray> = known.iter().map(|r| r.0).collect();
                spreads.push(mean_direction(&directions).map_or(0.0, |m| m.1));
                limits.push(known.iter().map(|r| 3.0 * r.1).fold(tolerance, f32::max));
            }
        }
        let (spread, limit) = (median(&mut spreads), median(&mut limits));
        if !self.near && self.dome.is_none() && spread > limit {
            let all: Vec<Vec<Option<Ray>>> = rays.iter().map(only).collect();
            bail!(self.disagreement(balls, explain(&all, limit), spread));
        }
        let files = std::mem::take(&mut pictures.files);
        let mut found = Vec::new();
        for (file, rays) in files.into_iter().zip(&rays) {
            match self.place(&name(&file), rays) {
                Ok(light) => {
                    found.push(light);
                    pictures.files.push(file);
                }
                Err(e) => pictures.bad.push((name(&file), format!("{e:#}"))),
            }
        }
        pictures.check()?;
        // Few lights that are not sure are left out; where they are many the ball is too small.
        let most = most(&found.iter().map(|f| f.uncertainty).collect::<Vec<_>>());
        let total = found.len();
        let (sure, unsure): (Vec<_>, Vec<_>) =
            found.into_iter().partition(|f| f.uncertainty <= self.tolerance);
        if 4 * unsure.len() > total {
            let radius = balls.iter().map(|b| b.outline.ball.radius).fold(f32::INFINITY, f32::min);
            bail!(
                "{} of {total} directions may be wrong by more than the --tolerance of {} degrees, by {most:.2} \
                 at most: a ball of {radius:.0} pixels' radius shows the lamps' mirror images no better; use \
                 larger balls or pictures that are not shrunk, or allow it with --tolerance {:.1}",
                unsure.len(),
                self.tolerance,
                (10.0 * most).ceil() / 10.0
            );
        }
        for light in unsure {
            let why = format!(
                "its direction may be wrong by {:.2} degrees, beyond the --tolerance of {}",
                light.uncertainty, self.tolerance
            );
            pictures.bad.push((light.file, why));
        }
        Ok(sure)
    }

    fn disagreement(&self, balls: &[&Candidate], why: Disagreement, spread: f32) -> anyhow::Error {
        let spread = spread.to_degrees();
        let at = |b: &Candidate| format!("{:.0}, {:.0}", b.seen.centre.x, b.seen.centre.y);
        let places = balls.iter().map(|b| at(b)).collect::<Vec<_>>().join(" and ");
        let allow = format!("allow it with --tolerance {:.1}", (10.0 * spread).ceil() / 10.0);
        let head = format!(
            "the balls at {places} disagree by {spread:.2} degrees in the median, beyond the --tolerance of {}",
            self.tolerance
        );
        let why = match why {
            Disagreement::Near(far) => format!(
                "their rays meet about {far:.1} widths of the picture away, so the lamps are near: say --near \
                 for positions, or for mean directions {allow}"
            ),
            Disagreement::Parting => format!(
                "their rays part, as where a near camera is taken for a distant one: say its --focal length, or \
                 {allow}"
            ),
            Disagreement::Odd(ball) => format!(
                "without the one at {} the others agree: its outline is wrong, or it is no ball; correct it \
                 with --ball, or leave it out",
                at(balls[ball])
            ),
            Disagreement::Unknown => {
                "an outline is wrong, or one is no ball; look at --preview, and correct it with --ball".into()
            }
        };
        anyhow!("{head}; {why}")
    }

    fn place(&self, file: &str, rays: &[Option<(Ray, f32)>]) -> Result<Found> {
        let (rays, sigmas): (Vec<Ray>, Vec<f32>) = rays.iter().flatten().copied().unzip();
        let (direction, spread) = mean_direction(&rays).context("no ball shows the lamp")?;
        let uncertainty = SURE * sigmas.iter().map(|s| s * s).sum::<f32>().sqrt() / sigmas.len() as f32;
        let (light, spread) = if self.near {
            triangulate(&rays).context(
                "the balls do not say how far the lamp is: it shows in one only, or is too far away for --near",
            )?
        } else if let Some(radius) = self.dome {
            let at: Vec<Vec3> = rays.iter().filter_map(|r| on_dome(*r, radius)).collect();
            ensure!(
                at.len() == rays.len(),
                "the ball lies outside the dome of {radius} widths: give a larger --dome"
            );
            let mean = at.iter().sum::<Vec3>() / at.len() as f32;
            (mean, at.iter().map(|p| p.angle_between(mean)).fold(0.0, f32::max))
        } else {
            (direction, spread)
        };
        ensure!(light.z > 0.0, "the lamp seems to stand below the sample");
        let spread = if rays.len() > 1 { spread.to_degrees() } else { 0.0 };
        let limit = sigmas.iter().map(|s| 3.0 * s.to_degrees()).fold(3.0 * self.tolerance, f32::max);
        ensure!(
            spread <= limit,
            "the balls disagree on its lamp by {spread:.2} degrees, beyond three times the --tolerance of {}",
            self.tolerance
        );
        Ok(Found {
            file: file.into(),
            light,
            balls: rays.len(),
            spread,
            uncertainty: uncertainty.to_degrees(),
        })
    }

    fn report(
        &self,
        output: &Path,
        balls: &[&Candidate],
        names: &[String],
        found: &[Found],
        bad: &[(String, String)],
        near: bool,
    ) {
        let mut spreads: Vec<f32> = found.iter().filter(|f| f.balls > 1).map(|f| f.spread).collect();
        let mut unsure: Vec<f32> = found.iter().map(|f| f.uncertainty).collect();
        let (middle, usual) = (median(&mut spreads), median(&mut unsure));
        if self.json {
            let all: Vec<_> = balls
                .iter()
                .map(|b| {
                    let Ball { centre, radius } = b.seen;
                    let seen = names.iter().zip(&b.highlights).filter_map(|(n, h)| Some((n, h.as_ref()?)));
                    let highlights: Vec<_> =
                        seen.map(|(n, h)| json!({ "file": n, "at": h.at.to_array() })).collect();
                    json!({
                        "x": centre.x,
                        "y": centre.y,
                        "radius": radius,
                        "mirror_agreement": b.outline.mirrored,
                        "highlights": highlights,
                    })
                })
                .collect();
            let lights: Vec<_> = found
                .iter()
                .map(|f| {
                    json!({
                        "file": f.file,
                        "light": f.light.to_array(),
                        "balls": f.balls,
                        "disagreement_degrees": (f.balls > 1).then_some(f.spread),
                        "uncertainty_degrees": f.uncertainty,
                    })
                })
                .collect();
            let left_out: Vec<_> =
                bad.iter().map(|(file, why)| json!({ "file": file, "reason": why })).collect();
            json::print(json!({
                "output": output.display().to_string(),
                "near": near,
                "balls": all,
                "lights": lights,
                "left_out": left_out,
            }));
            return;
        }
        for b in balls {
            let Ball { centre, radius } = b.seen;
            println!("ball at {:.1}, {:.1} with radius {radius:.1}", centre.x, centre.y);
        }
        println!("{}: {} {}", output.display(), found.len(), if near { "positions" } else { "directions" });
        println!(
            "in 99 of 100 cases a direction is wrong by less than {usual:.2} degrees in the median, {:.2} at most",
            most(&unsure)
        );
        if !spreads.is_empty() {
            println!(
                "the balls disagree by {middle:.2} degrees in the median, {:.2} at most",
                most(&spreads)
            );
        }
        if self.focal.is_none() && self.lens.is_none() {
            println!("the camera is taken as far away; if it is not, say --focal");
        }
    }
}

/// Upper median; sorts. 0 of none.
fn median(values: &mut [f32]) -> f32 {
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

fn most(values: &[f32]) -> f32 {
    values.iter().copied().fold(0.0, f32::max)
}

fn ball(text: &str) -> Result<Ball, String> {
    let [x, y, radius] = argument::numbers(text)
        .filter(|n| n[2] > 1.0)
        .ok_or("expected x,y,radius in pixels, as in 1204,880,112.5")?;
    Ok(Ball { centre: Vec2::new(x, y), radius })
}
