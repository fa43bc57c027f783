//! `yugen capture calibrate`.

use super::hdr::{BAD_LENS, lens};
use crate::{argument, json, progress};
use anyhow::{Context, Result, anyhow, bail, ensure};
use clap::Args;
use indicatif::ProgressBar;
use serde_json::json;
use std::path::{Path, PathBuf};
use yugen_archive::formats::image::rows::Rows;
use yugen_archive::formats::image::{self, ReadOptions, WriteOptions};
use yugen_archive::formats::lp;
use yugen_archive::formats::stack::{self, Response};
use yugen_archive::{check_outputs, check_writable, will_read};
use yugen_capture::calibrate::{
    Ball, Ray, View, find_balls, highlight, mean_direction, on_dome, triangulate,
};
use yugen_capture::lens::Lens;
use yugen_optics::{ColourSpace, Image, Vec2, Vec3};

/// Finds where the lights stood from their mirror images in polished balls beside the sample.
///
/// `yugen capture calibrate STACK --balls 2` looks for two balls in the pictures of STACK and writes STACK/lights.lp.
/// With one ball the lamps are taken as far away; with two or more and --near, or with one and --dome, they get
/// positions. Look at the picture that --preview draws, and correct a ball that was not met with --ball x,y,radius.
#[derive(Args)]
pub struct Calibrate {
    /// The folder of pictures, one a light.
    folder: PathBuf,

    /// How many balls to look for.
    #[arg(long, default_value_t = 1, value_name = "N", conflicts_with = "ball")]
    balls: usize,

    /// The outline of a ball in pixels from the top left, instead of looking for it; may be given again.
    #[arg(long, value_name = "X,Y,RADIUS", value_parser = ball)]
    ball: Vec<Ball>,

    /// A picture in which the balls stand out, such as one with the room's light or a mask, to look for them in
    /// instead of the brightest of all pictures.
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

    /// The list to write; FOLDER/lights.lp where absent.
    #[arg(short, long, value_name = "LP")]
    output: Option<PathBuf>,

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

/// What was found of a light.
struct Found {
    file: String,
    light: Vec3,
    /// Balls in which it shows.
    balls: usize,
    /// By how much the balls disagree, in degrees.
    spread: f32,
    /// The largest angle between two balls' directions, in degrees.
    parallax: f32,
    pixels: Vec<Vec2>,
}

const KEPT: u64 = 1 << 30;

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
        ensure!(self.balls > 0, "--balls 0: expected one or more");
        check_writable(&output)?;
        if let Some(preview) = &self.preview {
            image::can_write(preview)?;
        }
        let name = |p: &PathBuf| p.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut options = stack::Options::read(&self.folder)?;
        if let Some(none) = self.skip.iter().find(|s| !all.iter().any(|p| name(p) == **s)) {
            bail!("--skip {none}: there is no such picture in {}", self.folder.display());
        }
        let files: Vec<PathBuf> = all
            .iter()
            .filter(|p| !self.skip.contains(&name(p)) && options.ambient != Some(name(p)))
            .filter(|p| options.mask != Some(name(p)))
            .cloned()
            .collect();
        ensure!(!files.is_empty(), "{}: there is no picture in it", self.folder.display());
        all.iter().chain(&self.outline).for_each(|p| will_read(p));
        check_outputs([Some(&output), self.preview.as_ref()].into_iter().flatten())?;

        let bar = progress::bar(files.len() as u64, self.json);
        let (mut brightest, width, height) = self.brightest(&files, &options.response, &bar)?;
        let view = View { width, height, focal: self.focal.or(self.lens.map(|l| l.focal)) };
        if let Some(path) = &self.outline {
            let outline = Grey::read(path, &options.response)?;
            outline.same_size(path, width, height)?;
            brightest = outline.values;
        }
        let balls = if self.ball.is_empty() {
            find_balls(&brightest, width, height, self.balls)
        } else {
            self.ball.clone()
        };
        if balls.len() < self.balls && self.ball.is_empty() {
            bail!(
                "{} of {} balls were found; name a picture in which they stand out with --outline, or say where they are \
                 with --ball x,y,radius",
                balls.len(),
                self.balls
            );
        }
        ensure!(!self.near || balls.len() > 1, "--near takes two balls or more; with one, give the --dome");

        bar.reset();
        if let Some(lens) = &self.lens {
            ensure!(lens.fits(width, height), BAD_LENS);
        }
        let straight = |p: Vec2| self.lens.map_or(p, |l| l.undistort(p));
        let straight_balls: Vec<Ball> = balls.iter().map(|b| straighten(*b, straight)).collect();
        let mut found = Vec::new();
        for file in &files {
            bar.set_message(name(file));
            let picture = Grey::read(file, &options.response)?;
            let mut rays: Vec<Ray> = Vec::new();
            let mut pixels = Vec::new();
            for (ball, straight_ball) in balls.iter().zip(&straight_balls) {
                let Some(pixel) = highlight(&picture.values, width, height, *ball) else { continue };
                if let Some(ray) = view.reflect(*straight_ball, straight(pixel)) {
                    rays.push(ray);
                    pixels.push(pixel);
                }
            }
            found
                .push(self.place(&name(file), &rays, pixels).with_context(|| format!("{}", file.display()))?);
            bar.inc(1);
        }
        bar.finish_and_clear();
        if let Some(path) = &self.preview {
            preview(path, &brightest, width, &balls, &found)?;
        }
        let entries: Vec<lp::Entry> =
            found.iter().map(|f| lp::Entry { file: f.file.clone(), light: f.light }).collect();
        let near = self.near || self.dome.is_some();
        if output == self.folder.join(stack::LIGHTS) {
            options = stack::Options {
                lights: stack::LIGHTS.into(),
                axes: lp::Axes::default(),
                near,
                field_width: 1.0,
                ..options
            };
            stack::amend(&self.folder, &entries, &options)?;
        } else {
            yugen_archive::atomic_write(&output, lp::write(&entries, &output)?.as_bytes())?;
        }
        self.report(&output, &balls, &found, near);
        Ok(())
    }

    /// The brightest that each pixel becomes.
    fn brightest(
        &self,
        files: &[PathBuf],
        response: &Response,
        bar: &ProgressBar,
    ) -> Result<(Vec<f32>, usize, usize)> {
        let mut all: Option<Grey> = None;
        for file in files {
            let picture = Grey::read(file, response).map_err(|e| {
                let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
                anyhow!("{e:#}; if it is no light's picture leave it out with --skip '{name}'")
            })?;
            bar.inc(1);
            match &mut all {
                None => all = Some(picture),
                Some(all) => {
                    picture.same_size(file, all.width, all.height)?;
                    all.values.iter_mut().zip(&picture.values).for_each(|(a, b)| *a = a.max(*b));
                }
            }
        }
        let all = all.context("there is no picture")?;
        Ok((all.values, all.width, all.height))
    }

    fn place(&self, file: &str, rays: &[Ray], pixels: Vec<Vec2>) -> Result<Found> {
        let (direction, spread) = mean_direction(rays).context(
            "no ball shows the lamp; leave the picture out with --skip, or correct the outline with --ball",
        )?;
        let angles = rays.iter().flat_map(|a| rays.iter().map(|b| a.direction.angle_between(b.direction)));
        let parallax = angles.fold(0.0, f32::max).to_degrees();
        let (light, spread) = if self.near {
            triangulate(rays).context(
                "the balls do not say how far the lamp is: it shows in one only, or too far away; leave out --near",
            )?
        } else if let Some(radius) = self.dome {
            let at: Vec<Vec3> = rays.iter().filter_map(|r| on_dome(*r, radius)).collect();
            ensure!(at.len() == rays.len(), "the ball lies outside the dome of {radius} widths");
            let mean = at.iter().sum::<Vec3>() / at.len() as f32;
            (mean, at.iter().map(|p| p.angle_between(mean)).fold(0.0, f32::max))
        } else {
            (direction, spread)
        };
        ensure!(
            light.z > 0.0,
            "the lamp seems to stand below the sample; correct the outline of the ball with --ball"
        );
        let spread = if rays.len() > 1 { spread.to_degrees() } else { 0.0 };
        Ok(Found { file: file.into(), light, balls: rays.len(), spread, parallax, pixels })
    }

    fn report(&self, output: &Path, balls: &[Ball], found: &[Found], near: bool) {
        let mut spreads: Vec<f32> = found.iter().filter(|f| f.balls > 1).map(|f| f.spread).collect();
        spreads.sort_by(f32::total_cmp);
        let mut parallax: Vec<f32> = found.iter().filter(|f| f.balls > 1).map(|f| f.parallax).collect();
        parallax.sort_by(f32::total_cmp);
        let median = |v: &[f32]| v.get(v.len() / 2).copied();
        if self.json {
            let balls: Vec<_> = balls
                .iter()
                .map(|b| json!({ "x": b.centre.x, "y": b.centre.y, "radius": b.radius }))
                .collect();
            let lights: Vec<_> = found
                .iter()
                .map(|f| {
                    json!({
                        "file": f.file,
                        "light": f.light.to_array(),
                        "balls": f.balls,
                        "disagreement_degrees": (f.balls > 1).then_some(f.spread),
                        "highlights": f.pixels.iter().map(|p| p.to_array()).collect::<Vec<_>>(),
                    })
                })
                .collect();
            json::print(
                json!({ "output": output.display().to_string(), "near": near, "balls": balls, "lights": lights }),
            );
            return;
        }
        for b in balls {
            println!("ball at {:.1}, {:.1} with radius {:.1}", b.centre.x, b.centre.y, b.radius);
        }
        println!("{}: {} {}", output.display(), found.len(), if near { "positions" } else { "directions" });
        if let (Some(middle), Some(worst)) = (median(&spreads), spreads.last()) {
            println!("the balls disagree by {middle:.2} degrees in the median, {worst:.2} at most");
        }
        if let Some(parallax) = median(&parallax).filter(|p| !near && *p > 2.0) {
            println!(
                "they see the lamps {parallax:.1} degrees apart, so the lamps are near: consider --near"
            );
        }
    }
}

/// The light of a picture's pixels, grey.
struct Grey {
    values: Vec<f32>,
    width: usize,
    height: usize,
}

impl Grey {
    fn read(path: &Path, response: &Response) -> Result<Self> {
        let mut rows = Rows::open(path, &ReadOptions::raw(), &mut { KEPT })?;
        rows.set_response(|level| response.light(level));
        let (width, height) = (rows.width, rows.height);
        let mut line = vec![[0.0; 3]; width];
        let mut values = Vec::with_capacity(width * height);
        for _ in 0..height {
            rows.next_row(&mut line)?;
            // What an exposure could not hold is brighter than the rest.
            let grey = |v: &[f32; 3]| {
                let sum = v[0] + v[1] + v[2];
                if sum.is_nan() { f32::MAX / 4.0 } else { sum / 3.0 }
            };
            values.extend(line.iter().map(grey));
        }
        // Saturated pixels become twice as bright as the brightest that is known.
        let top = values.iter().copied().filter(|v| *v < f32::MAX / 4.0).fold(0.0, f32::max);
        values.iter_mut().for_each(|v| *v = v.min(2.0 * top));
        Ok(Self { values, width, height })
    }

    fn same_size(&self, path: &Path, width: usize, height: usize) -> Result<()> {
        ensure!(
            (self.width, self.height) == (width, height),
            "{}: the picture is {} x {}, the others are {width} x {height}",
            path.display(),
            self.width,
            self.height
        );
        Ok(())
    }
}

/// A ball whose outline passes through where the lens would have put four of its points.
fn straighten(ball: Ball, straight: impl Fn(Vec2) -> Vec2) -> Ball {
    let rim = [Vec2::X, Vec2::Y, -Vec2::X, -Vec2::Y].map(|d| straight(ball.centre + d * ball.radius));
    let centre = (rim[0] + rim[1] + rim[2] + rim[3]) / 4.0;
    Ball { centre, radius: rim.iter().map(|p| p.distance(centre)).sum::<f32>() / 4.0 }
}

fn preview(path: &Path, brightest: &[f32], width: usize, balls: &[Ball], found: &[Found]) -> Result<()> {
    let height = brightest.len() / width.max(1);
    let mut image = Image::rgb(width, height);
    let mut sorted: Vec<f32> = brightest.to_vec();
    let nth = sorted.len() * 95 / 100;
    let (_, &mut bright, _) = sorted.select_nth_unstable_by(nth, f32::total_cmp);
    for (pixel, v) in image.data.chunks_exact_mut(3).zip(brightest) {
        pixel.fill((v / bright.max(1e-6)).clamp(0.0, 1.0) * 0.7);
    }
    let mut dot = |at: Vec2, colour: [f32; 3]| {
        if at.x >= 0.0 && at.y >= 0.0 && (at.x as usize) < width && (at.y as usize) < height {
            image.pixel_mut(at.x as usize, at.y as usize).copy_from_slice(&colour);
        }
    };
    for ball in balls {
        let steps = (8.0 * ball.radius) as usize;
        for i in 0..steps {
            dot(
                ball.centre + Vec2::from_angle(std::f32::consts::TAU * i as f32 / steps as f32) * ball.radius,
                [0.0, 1.0, 0.0],
            );
        }
    }
    for at in found.iter().flat_map(|f| &f.pixels) {
        for off in [Vec2::ZERO, Vec2::X, Vec2::Y, -Vec2::X, -Vec2::Y] {
            dot(*at + off, [1.0, 0.0, 0.0]);
        }
    }
    Ok(image::write(path, &image, &WriteOptions::from(ColourSpace::LinearSrgb))?)
}

fn ball(text: &str) -> Result<Ball, String> {
    let [x, y, radius] = argument::numbers(text)
        .filter(|n| n[2] > 1.0)
        .ok_or("expected x,y,radius in pixels, as in 1204,880,112.5")?;
    Ok(Ball { centre: Vec2::new(x, y), radius })
}
