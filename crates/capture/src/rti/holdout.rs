//! How well photographs that were left out are predicted from the others.

use super::light::texel_under;
use super::rbf::{Kernel, Rbf};
use super::{Encoding, RtiError, evaluate, fit, light, readings};
use crate::fit as btf_fit;
use crate::normals::{self, Surface};
use crate::rows::for_rows;
use crate::{Lights, Stack};
use glam::Vec3;
use yugen_archive::formats::relightable::{Basis, Colouring, Relightable};
use yugen_optics::Image;
use yugen_optics::colour::srgb_to_linear;
use yugen_optics::compare::{SSIM_REACH, psnr, ssim};
use yugen_reflectance::Choice;
use yugen_reflectance::btf::Texel;

/// What can predict a photograph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// The maps of a cloth.
    Btf,
    /// A basis, for each colour.
    Basis(Basis),
    /// A polynomial that multiplies a fixed colour.
    LrgbPtm,
    /// Interpolation between lights.
    Rbf(Kernel),
}

impl Method {
    /// All of them, in the order of a report.
    pub const ALL: [Self; 8] = [
        Self::Btf,
        Self::LrgbPtm,
        Self::Basis(Basis::Ptm),
        Self::Basis(Basis::Hsh { order: 2 }),
        Self::Basis(Basis::Hsh { order: 3 }),
        Self::Basis(Basis::Hsh { order: 4 }),
        Self::Rbf(Kernel::ThinPlate),
        Self::Rbf(Kernel::Gaussian),
    ];

    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Btf => "BTF",
            Self::Basis(basis) => basis.name(),
            Self::LrgbPtm => "LRGB PTM",
            Self::Rbf(Kernel::ThinPlate) => "RBF thin plate",
            Self::Rbf(Kernel::Gaussian) => "RBF Gaussian",
        }
    }

    /// Numbers a texel takes in a file or, for interpolation, in memory; `lights` is how many it learned from.
    pub fn numbers(self, lights: usize) -> usize {
        match self {
            // Two colours, a normal and a tangent by an angle, two widths.
            Self::Btf => 11,
            Self::Basis(basis) => 3 * basis.terms(),
            Self::LrgbPtm => 9,
            Self::Rbf(_) => 3 * lights,
        }
    }
}

/// What a method learned from a stack.
enum Model<'a> {
    Cloth(Vec<Texel>),
    Picture(Relightable, Encoding),
    Between(Rbf<'a>, Encoding),
}

impl<'a> Model<'a> {
    fn learn(stack: &'a Stack, method: Method, encoding: Encoding, threads: usize) -> Result<Self, RtiError> {
        let lights = stack.lights.len();
        let picture = |basis, colouring| -> Result<Self, RtiError> {
            let ridge = fit::choose_ridge(stack, basis, encoding)?;
            let fitted = fit::fit(stack, &fit::Options { basis, colouring, encoding, ridge })?;
            Ok(Self::Picture(fitted.picture, encoding))
        };
        match method {
            Method::Btf => {
                let options = btf_fit::Options::default();
                let least = options.least_readings;
                if lights < least {
                    return Err(RtiError::TooFewLights { lights, what: "a BTF", least });
                }
                let surface =
                    Surface::of(std::slice::from_ref(stack), None, &normals::Options::default(), threads);
                let options = btf_fit::Options { surface: Some(surface), ..options };
                let prior = btf_fit::Prior::learn(std::slice::from_ref(stack), &options, threads);
                let fitted = btf_fit::fit(stack, &options, prior.as_ref(), threads, &|_| {});
                Ok(Self::Cloth(fitted.into_iter().map(|f| f.texel).collect()))
            }
            Method::Basis(basis) => picture(basis, Colouring::Rgb),
            Method::LrgbPtm => picture(Basis::Ptm, Colouring::Lrgb),
            Method::Rbf(kernel) => Ok(Self::Between(Rbf::new(stack, kernel, encoding)?, encoding)),
        }
    }

    /// Display values under light from `toward` texel (x, y).
    fn under(&self, width: usize, toward: impl Fn(usize, usize) -> Vec3 + Sync) -> Vec<[f32; 3]> {
        let show = |encoding: Encoding, v: f32| match encoding {
            Encoding::Srgb => v.clamp(0.0, 1.0),
            Encoding::Linear => Encoding::Srgb.encode(v),
        };
        match self {
            Self::Between(rbf, encoding) => {
                let mut values = rbf.picture(toward);
                values.iter_mut().flatten().for_each(|v| *v = show(*encoding, *v));
                values
            }
            Self::Picture(p, encoding) => {
                let mut out = vec![[0.0; 3]; p.width * p.height];
                for_rows(&mut out, width, |y, row| {
                    for (x, out) in row.iter_mut().enumerate() {
                        let texel = &p.coefficients[(y * p.width + x) * p.stride()..][..p.stride()];
                        *out = texel_under(p, texel, &evaluate(p.basis, toward(x, y)))
                            .map(|v| show(*encoding, v));
                    }
                });
                out
            }
            Self::Cloth(texels) => {
                let mut out = vec![[0.0; 3]; texels.len()];
                for_rows(&mut out, width, |y, row| {
                    for (x, out) in row.iter_mut().enumerate() {
                        let value = light::factor(&texels[y * width + x], Choice(0.0), &[], toward(x, y));
                        *out = value.to_array().map(|v| Encoding::Srgb.encode(v));
                    }
                });
                out
            }
        }
    }

    fn normals(&self, width: usize) -> Vec<Vec3> {
        match self {
            Self::Cloth(texels) => texels.iter().map(|t| t.normal).collect(),
            _ => light::normals(|l| {
                let mut values = self.under(width, |_, _| l);
                values.iter_mut().flatten().for_each(|v| *v = srgb_to_linear(*v));
                values
            }),
        }
    }
}

/// How well a method did.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// The method.
    pub method: Method,
    /// dB, over all usable values of all photographs left out, on display values.
    pub psnr: f64,
    /// Mean over usable pixels of all of them; `None` where pictures are smaller than the window.
    pub ssim: Option<f64>,
    /// Mean angle between predicted and true colours, linear, in degrees, of pixels that are not dark.
    pub colour_angle: f64,
    /// Mean angle between normals and the true ones, in degrees, where the true ones are known.
    pub normal_angle: Option<f64>,
    /// PSNR of each photograph left out.
    pub lights: Vec<f64>,
    /// The prediction of each photograph left out: display values, texel by texel.
    pub pictures: Vec<Vec<[f32; 3]>>,
    /// Root mean square error of each texel in display values over the photographs left out; NaN where unusable.
    pub error: Vec<f32>,
}

/// Display values darker than this, a mean over channels, have no colour worth an angle.
const DARK: f32 = 0.1;

/// Learns from all lights but those `left_out` and predicts them. `normals`, texel by texel, NaN or zero where unknown.
pub fn score(
    stack: &Stack,
    left_out: &[usize],
    method: Method,
    encoding: Encoding,
    normals: Option<&[Vec3]>,
    threads: usize,
) -> Result<Score, RtiError> {
    let _span = tracing::info_span!("score", method = method.name()).entered();
    let (train, held) = split(stack, left_out);
    let model = Model::learn(&train, method, encoding, threads)?;
    let (width, height, n) = (stack.width, stack.height, held.lights.len());
    let (mut all, mut all_true) = (Vec::new(), Vec::new());
    let (mut likeness, mut likeness_weight) = (0.0, 0u64);
    let (mut angle, mut angles) = (0.0, 0u64);
    let mut scored = Score {
        method,
        psnr: 0.0,
        ssim: None,
        colour_angle: 0.0,
        normal_angle: None,
        lights: Vec::new(),
        pictures: Vec::new(),
        error: vec![0.0; width * height],
    };
    let truth = pictures(&held);
    for (l, truth) in truth.iter().enumerate() {
        let predicted = model.under(width, |x, y| match held.lights {
            Lights::Distant(_) => held.light(l, 0, 0).0,
            Lights::Near(_) => held.light(l, x, y).0,
        });
        scored.lights.push(psnr(predicted.as_flattened(), truth.as_flattened()));
        let picture = |values: &[[f32; 3]]| {
            let mut image = Image::rgb(width, height);
            // Where truth is unusable both are black.
            for ((out, v), t) in image.data.chunks_exact_mut(3).zip(values).zip(truth) {
                if !t[0].is_nan() {
                    out.copy_from_slice(v);
                }
            }
            image
        };
        if let Some(map) = ssim(&picture(&predicted), &picture(truth)) {
            for (i, v) in map.data.iter().enumerate() {
                let (x, y) = (i % map.width + SSIM_REACH, i / map.width + SSIM_REACH);
                if !truth[y * width + x][0].is_nan() {
                    likeness += f64::from(*v);
                    likeness_weight += 1;
                }
            }
        }
        for (i, (p, t)) in predicted.iter().zip(truth).enumerate() {
            let (a, b) = (Vec3::from_array(*p), Vec3::from_array(*t));
            scored.error[i] += (a - b).length_squared() / (3 * n) as f32;
            if b.element_sum() > 3.0 * DARK {
                let (a, b) = (a.map(srgb_to_linear), b.map(srgb_to_linear));
                angle += if a.length() > 0.0 { f64::from(a.angle_between(b)).to_degrees() } else { 90.0 };
                angles += 1;
            }
        }
        all.extend_from_slice(&predicted);
        all_true.extend_from_slice(truth);
        scored.pictures.push(predicted);
    }
    scored.error.iter_mut().for_each(|e| *e = e.sqrt());
    scored.psnr = psnr(all.as_flattened(), all_true.as_flattened());
    scored.ssim = (likeness_weight > 0).then(|| likeness / likeness_weight as f64);
    scored.colour_angle = angle / angles.max(1) as f64;
    scored.normal_angle = normals.map(|truth| {
        let (mut sum, mut count) = (0.0, 0u64);
        for (n, t) in model.normals(width).iter().zip(truth).filter(|(_, t)| t.length() > 0.5) {
            sum += f64::from(n.angle_between(*t)).to_degrees();
            count += 1;
        }
        sum / count.max(1) as f64
    });
    Ok(scored)
}

/// The stack without some lights, and with these only.
pub fn split(stack: &Stack, left_out: &[usize]) -> (Stack, Stack) {
    let rest: Vec<usize> = (0..stack.lights.len()).filter(|l| !left_out.contains(l)).collect();
    (stack.select(&rest), stack.select(left_out))
}

/// Display values of each photograph under lamps of the same irradiance, texel by texel; NaN where unusable.
pub fn pictures(stack: &Stack) -> Vec<Vec<[f32; 3]>> {
    let n = stack.lights.len();
    let mut out = vec![vec![[0.0; 3]; stack.width * stack.height]; n];
    let mut values = vec![[0.0; 3]; n];
    for y in 0..stack.height {
        for x in 0..stack.width {
            readings(stack, x, y, Encoding::Srgb, &mut values);
            for (picture, v) in out.iter_mut().zip(&values) {
                picture[y * stack.width + x] = *v;
            }
        }
    }
    out
}

/// `n` of so many lights, evenly over their list.
pub fn spread(lights: usize, n: usize) -> Vec<usize> {
    (0..n.min(lights)).map(|i| (2 * i + 1) * lights / (2 * n)).collect()
}
