//! Denoised pictures of small scenes against converged ones: never worse than what was rendered, and as far off as is
//! claimed.

use yugen_archive::formats::{Options as Reading, load_scene};
use yugen_optics::Image;
use yugen_scene::{Aov, Scene};
use yugen_transport::render::{Action, Budget, Job, Options};

const SIZE: usize = 48;

/// What all scenes have.
const ALL: &str = r##"
[camera]
from = [0.6, 1.5, 4.2]
to = [0, 0.6, 0]
fov = 36

[film]
size = [48, 48]

[render]
max_depth = 7

[texture.tiles]
checker = [0.1, 0.6]
scale = 12

[material.floor]
model = "lambert"
reflectance = "tiles"

[material.wall]
model = "lambert"
reflectance = [0.6, 0.5, 0.3]

[material.mirror]
model = "conductor"
metal = "silver"

[material.glass]
model = "dielectric"

[material.gold]
model = "rough_conductor"
metal = "gold"
alpha_x = 0.3
alpha_y = 0.1
bump_map = { checker = [0, 1], scale = 9 }
bump_scale = 0.01

[material.silk]
model = "microcylinder"
preset = "silk_shot"
two_sided = true

[material.half]
model = "lambert"
opacity = 0.5
two_sided = true

[[shape]]
type = "rectangle"
size = [12, 12]
facing = [0, 1, 0]
material = "floor"

[[shape]]
type = "rectangle"
size = [12, 12]
at = [0, 0, -1.5]
material = "wall"
"##;

/// Name, samples a pixel, how often the relative mean square error of the raw picture is at least that of the denoised
/// one (about half of what was measured, never less than once), and the rest of the scene.
const SCENES: [(&str, u32, f64, &str); 7] = [
    ("matt", 16, 1.0, "[[shape]]\ntype = \"sphere\"\nradius = 0.6\nat = [0, 0.6, 0]\nmaterial = \"wall\"\n"),
    (
        "mirror",
        16,
        5.0,
        "[[shape]]\ntype = \"sphere\"\nradius = 0.6\nat = [0, 0.6, 0]\nmaterial = \"mirror\"\n",
    ),
    (
        "glass",
        32,
        1.0,
        "[[shape]]\ntype = \"sphere\"\nradius = 0.6\nat = [0, 0.6, 0]\nmaterial = \"glass\"\n",
    ),
    ("gold", 16, 1.7, "[[shape]]\ntype = \"sphere\"\nradius = 0.6\nat = [0, 0.6, 0]\nmaterial = \"gold\"\n"),
    (
        "silk",
        16,
        1.0,
        "[[shape]]\ntype = \"cylinder\"\nradius = 0.6\nheight = 1.3\nrotate = [-90, 0, 0]\nmaterial = \"silk\"\n",
    ),
    (
        "fire",
        64,
        1.0,
        "[[shape]]\ntype = \"sphere\"\nradius = 0.06\nat = [-0.5, 0.3, 0.3]\n\
         emission = { blackbody = 1900, scale = 60 }\n\
         [[shape]]\ntype = \"box\"\nsize = [0.6, 1, 0.6]\nat = [0.3, 0.5, 0]\nmaterial = \"gold\"\n",
    ),
    (
        "veil",
        16,
        2.0,
        "[[shape]]\ntype = \"rectangle\"\nsize = [1.4, 1.4]\nat = [0, 0.8, 0.4]\nmaterial = \"half\"\n\
         [[shape]]\ntype = \"sphere\"\nradius = 0.5\nat = [0, 0.5, -0.4]\nmaterial = \"mirror\"\n",
    ),
];

const LAMP: &str = "[[shape]]\ntype = \"rectangle\"\nsize = [0.7, 0.7]\nfacing = [0, -1, 0]\nat = [0.4, 2.6, 0.6]\n\
                    emission = 14\n[[light]]\ntype = \"constant\"\nradiance = [0.1, 0.13, 0.2]\n";

fn scene(name: &str, rest: &str) -> Scene {
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("denoise_{name}.toml"));
    std::fs::write(&path, [ALL, LAMP, rest].concat()).expect("a scene is written");
    load_scene(&path, &Reading::default()).expect("a scene")
}

fn render(scene: &Scene, spp: u32, seed: u32, threads: Option<usize>, denoise: bool) -> Image {
    let budget = Some(Budget::Samples(spp));
    let job =
        Job::new(scene, &Options { budget, seed, threads, denoise, ..Options::default() }).expect("a job");
    assert!(job.run(|_, _| Action::Continue));
    job.denoised()
}

fn layer(image: &Image, name: &str) -> Image {
    let names = ["R", "G", "B"].map(|c| format!("{name}{c}"));
    image.select(&names.each_ref().map(String::as_str)).expect("three channels")
}

/// A converged picture in two halves: the product of the differences to each has no part that is their own noise.
struct Truth([Image; 2]);

impl Truth {
    fn of(scene: &Scene) -> Self {
        Self([1001, 1002].map(|seed| layer(&render(scene, 256, seed, None, false), "")))
    }

    /// One over what errors count relative to, squared: dark pixels count as a tenth of the mean.
    fn scales(&self) -> Vec<f64> {
        let [a, b] = &self.0;
        let means: Vec<f64> = a.data.iter().zip(&b.data).map(|(a, b)| 0.5 * f64::from(a + b)).collect();
        let dark = 0.1 * means.iter().sum::<f64>() / means.len() as f64;
        means.iter().map(|m| 1.0 / (m * m + dark * dark)).collect()
    }

    /// Relative mean square error.
    fn error(&self, picture: &Image) -> f64 {
        let [a, b] = &self.0;
        let all = picture.data.iter().zip(&a.data).zip(&b.data).zip(self.scales());
        all.map(|(((x, a), b), scale)| f64::from(x - a) * f64::from(x - b) * scale).sum::<f64>()
            / picture.data.len() as f64
    }

    /// The same of what is claimed for it.
    fn claimed(&self, error: &Image) -> f64 {
        error.data.iter().zip(self.scales()).map(|(e, scale)| f64::from(e * e) * scale).sum::<f64>()
            / error.data.len() as f64
    }

    /// What is wrong with a picture that was made of `raw` and claims that error.
    fn fault(&self, raw: &Image, picture: &Image, claim: &Image, gain: f64) -> Option<String> {
        let (before, after, claimed) = (self.error(raw), self.error(picture), self.claimed(claim));
        println!("gain {:.2} claimed/true {:.2} raw {before:.5}", before / after, (claimed / after).sqrt());
        if !picture.data.iter().chain(&claim.data).all(|v| v.is_finite()) {
            return Some("not finite".into());
        }
        if after.is_nan() || before < gain * after {
            return Some(format!("an error of {after} instead of {before}"));
        }
        let ratio = (claimed / after).sqrt();
        (!(0.5..2.0).contains(&ratio)).then(|| format!("claims {ratio} times the error"))
    }
}

/// Mean of the 25 pixels around each.
fn blurred(image: &Image) -> Image {
    let mut out = image.clone();
    for (i, to) in out.data.iter_mut().enumerate() {
        let (c, x, y) = (i % 3, i / 3 % SIZE, i / 3 / SIZE);
        let around = |v: usize| v.saturating_sub(2)..(v + 3).min(SIZE);
        let all: Vec<f32> =
            around(y).flat_map(|y| around(x).map(move |x| image.data[(y * SIZE + x) * 3 + c])).collect();
        *to = all.iter().sum::<f32>() / all.len() as f32;
    }
    out
}

#[test]
fn it_is_never_worse_than_what_was_rendered_and_as_far_off_as_it_says() {
    let mut faults = Vec::new();
    for (name, spp, gain, rest) in SCENES {
        println!("{name}");
        let scene = scene(name, rest);
        let truth = Truth::of(&scene);
        let picture = render(&scene, spp, 7, None, true);
        let [clean, raw, claim] = ["", "noisy.", "error."].map(|l| layer(&picture, l));
        faults.extend(truth.fault(&raw, &clean, &claim, gain).map(|f| format!("{name}: {f}")));
        if truth.fault(&raw, &blurred(&raw), &claim, gain).is_none() {
            faults.push(format!("{name}: a blur passes for denoising"));
        }
        let boastful = Image { data: claim.data.iter().map(|e| 5.0 * e).collect(), ..claim.clone() };
        if truth.fault(&raw, &clean, &boastful, gain).is_none() {
            faults.push(format!("{name}: a claim of five times as much passes"));
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn the_same_bits_for_any_number_of_threads_and_when_resumed() {
    let scene = scene("bits", SCENES[2].3);
    const SAMPLES: u32 = 200;
    let one = render(&scene, SAMPLES, 3, Some(1), true);
    assert_eq!(one.data, render(&scene, SAMPLES, 3, Some(3), true).data);
    let job = |threads| {
        let budget = Some(Budget::Samples(SAMPLES));
        let options = Options { budget, seed: 3, threads, denoise: true, ..Options::default() };
        Job::new(&scene, &options).expect("a job")
    };
    // Stopped at the first look, 50 ms from the start, where one thread has worked off about a tenth; and gone on with.
    let first = job(Some(1));
    assert!(!first.run(|_, _| Action::Stop));
    let rest = job(None);
    rest.resume(&first.checkpoint()).expect("its own checkpoint");
    assert!(rest.run(|_, _| Action::Continue));
    assert_eq!(one.data, rest.denoised().data);
}

#[test]
fn the_layer_of_normals_shows_what_maps_do_to_them() {
    let normals = |name: &str, scale: &str| {
        let text = [ALL, LAMP, SCENES[3].3].concat().replace("bump_scale = 0.01", scale);
        let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::write(&path, text).expect("a scene is written");
        let scene = load_scene(&path, &Reading::default()).expect("a scene");
        let budget = Some(Budget::Samples(1));
        let aovs = vec![Aov::ShadingNormal];
        let job = Job::new(&scene, &Options { budget, aovs, ..Options::default() }).expect("a job");
        assert!(job.run(|_, _| Action::Continue));
        let names = ["shading_normal.X", "shading_normal.Y", "shading_normal.Z"];
        job.image().select(&names).expect("its normals").data
    };
    let (plain, bumped) =
        (normals("plain.toml", "bump_scale = 0"), normals("bumped.toml", "bump_scale = 0.01"));
    let most = plain.iter().zip(&bumped).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(most > 0.1, "{most}");
}
