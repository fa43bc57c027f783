//! How far a lens blurred the photographs, and by how much normals are off for it.
//!
//! A blurred texel is a mixture of its neighbours, and one normal describes a mixture of highlights well enough to look
//! right. That the readings of a texel are those of a mixture does not show in themselves, but in how they change from
//! texel to texel: a sharp picture has steps from one texel to the next, a blurred one has none.

use crate::Stack;
use crate::fit::compare::angle;
use glam::Vec3;
use yugen_reflectance::btf::{Btf, Texel};

/// Neighbours of a texel, in pairs that face each other.
const PAIRS: [[(isize, isize); 2]; 4] =
    [[(-1, 0), (1, 0)], [(0, -1), (0, 1)], [(-1, -1), (1, 1)], [(1, -1), (-1, 1)]];

/// Of four texels in a row the step in the middle is this part of their range or less, in 98 of 100 places where much
/// changes, under a Gaussian blur of this standard deviation in texels. Kinran and karaori of 128 x 128 texels under 50
/// lights, as `capture simulate kinran --size 128x128 --near 3 --exposures 3 --blur 0.7` and `hdr` make them, .5, .7, 1 and
/// 1.5 texels: .972, .742, .578, .471 and .907, .715, .567, .500; 1 where sharp or .3.
const STEPS: [[f32; 2]; 7] =
    [[0.45, 1.6], [0.475, 1.5], [0.575, 1.0], [0.735, 0.7], [0.91, 0.52], [0.97, 0.5], [0.995, 0.3]];
/// The part of the places that are less steep.
const STEEPEST: f32 = 0.98;
/// Much changes where four texels range over half of what all but this part of the places do.
const CHANGING: f32 = 0.99;
/// So many places are looked at, and so few say nothing.
const PLACES: usize = 1 << 22;
const FEWEST: usize = 256;

/// More blur than this may as well be the smoothness of a thing without edges, and no more is made of it.
const UNMISTAKABLE: f32 = 1.0;
/// The finest detail whose loss counts, in periods a texel: threads of three texels. A blur leaves e^(−2π²b²f²) of it.
const FINEST: f32 = 1.0 / 3.0;
/// Degrees by which a normal is off for each degree that it was turned by its neighbours. Set so that of kinran and karaori,
/// blurred as above, at most 1 % of the texels above a confidence of a half are off by more than 5°.
const TURNED: f32 = 1.3;
/// Less blur than this mixes nothing.
const SHARP: f32 = 0.25;
/// Degrees off at which confidence is a half.
const HALVED: f32 = 3.0;

/// Blur of the photographs that `bands` are from: the standard deviation in texels of a Gaussian that makes steps as soft as
/// the steepest that they show. 0 where they are sharp, where too little changes to tell, and beyond 1.6, where it cannot be told
/// from a thing that is smooth by itself. Wide steps alone make it up to two thirds too much, and stripes of one or two texels
/// look sharp however faint.
pub fn blur(bands: &[Stack]) -> f32 {
    let _span = tracing::info_span!("measure_blur").entered();
    let lights = bands.first().map_or(0, |b| b.lights.len());
    let texels: usize = bands.iter().map(|b| b.width * b.height).sum();
    let every = (2 * texels * lights).div_ceil(PLACES).max(1);
    let mut places: Vec<[f32; 2]> = Vec::new();
    for band in bands {
        let grey = |x: usize, y: usize, light: usize| band.samples(x, y)[light].iter().sum::<f32>();
        for y in 0..band.height {
            for x in 0..band.width {
                for light in (0..lights).step_by(every) {
                    if x + 3 < band.width {
                        places.extend(step([0, 1, 2, 3].map(|i| grey(x + i, y, light))));
                    }
                    if y + 3 < band.height {
                        places.extend(step([0, 1, 2, 3].map(|i| grey(x, y + i, light))));
                    }
                }
            }
        }
    }
    let mut ranges: Vec<f32> = places.iter().map(|p| p[0]).collect();
    if ranges.len() < FEWEST {
        return 0.0;
    }
    let most = below(&mut ranges, CHANGING);
    let mut steps: Vec<f32> = places.into_iter().filter(|p| p[0] > 0.5 * most).map(|p| p[1]).collect();
    if steps.len() < FEWEST {
        return 0.0;
    }
    of_step(below(&mut steps, STEEPEST))
}

/// The value below which a part `q` of them lies, of one at least. Puts them into another order, but does not sort them:
/// there are millions.
fn below(values: &mut [f32], q: f32) -> f32 {
    let at = ((values.len() - 1) as f32 * q).round() as usize;
    *values.select_nth_unstable_by(at, f32::total_cmp).1
}

/// The range of four values and the part of it that the step in the middle is.
fn step(v: [f32; 4]) -> Option<[f32; 2]> {
    let range = v.iter().fold(f32::MIN, |a, b| a.max(*b)) - v.iter().fold(f32::MAX, |a, b| a.min(*b));
    let usable = v.iter().all(|v| v.is_finite()) && range > 0.0;
    usable.then(|| [range, (v[2] - v[1]).abs() / range])
}

/// The blur under which the steepest steps are this.
fn of_step(step: f32) -> f32 {
    if step < STEPS[0][0] {
        return 0.0;
    }
    let between = STEPS.windows(2).find(|w| step < w[1][0]);
    between.map_or(0.0, |w| {
        let [[low, a], [high, b]] = [w[0], w[1]];
        a + (b - a) * (step - low) / (high - low)
    })
}

/// Degrees by which the normal of each texel is expected to be off for a blur of so many texels. `texel` says the unit normal
/// and how bright a texel is where it is brightest; `None` where there is none.
///
/// Each was mixed from its neighbours by the spot of the lens, the brighter the more: what that would do to the normals as they
/// were found is seen, what it did to those that were there is as much more as the lens left less of them.
pub fn turned(
    blur: f32,
    width: usize,
    height: usize,
    texel: impl Fn(usize) -> Option<(Vec3, f32)>,
) -> Vec<f32> {
    if blur < SHARP {
        return vec![0.0; width * height];
    }
    let lost = (2.0 * (std::f32::consts::PI * blur.min(UNMISTAKABLE) * FINEST).powi(2)).exp();
    let spot = |(x, y): (isize, isize)| (-0.5 * (x * x + y * y) as f32 / (blur * blur)).exp();
    (0..width * height)
        .map(|i| {
            let Some((normal, own)) = texel(i) else { return 0.0 };
            let (x, y) = ((i % width) as isize, (i / width) as isize);
            let neighbour = |by: (isize, isize)| {
                let (x, y) = (x + by.0, y + by.1);
                let inside = (0..width as isize).contains(&x) && (0..height as isize).contains(&y);
                let (normal, bright) = inside.then(|| texel(y as usize * width + x as usize)).flatten()?;
                Some((normal, spot(by) * bright))
            };
            let pairs = PAIRS.map(|pair| pair.map(|by| neighbour(by).unwrap_or((normal, 0.0))));
            let all = own + pairs.iter().flatten().map(|n| n.1).sum::<f32>();
            if all <= 0.0 {
                return 0.0;
            }
            // Neighbours that face each other and lean to both sides leave the normal between them as it is.
            let off = |pair: &[(Vec3, f32); 2]| {
                let mixed = pair.iter().fold(normal, |sum, (n, share)| sum + (*n - normal) * (share / all));
                angle(normal, mixed.normalize_or(normal))
            };
            TURNED * lost * pairs.iter().map(off).sum::<f32>()
        })
        .collect()
}

/// Lowers the confidence of the texels of a cloth by what a blur of so many texels did to their normals.
pub fn doubt(maps: &mut Btf, blur: f32) {
    // As bright as its highlight at its highest.
    let bright = |t: &Texel| {
        let highlight = t.specular / (4.0 * t.sigma.x * t.sigma.y).max(0.004);
        (t.diffuse + highlight).element_sum().max(0.0)
    };
    let there =
        |i: usize| Some(&maps.texels[i]).filter(|t| t.confidence > 0.0).map(|t| (t.normal, bright(t)));
    let turned = turned(blur, maps.width, maps.height, there);
    maps.texels.iter_mut().zip(turned).for_each(|(t, degrees)| t.confidence *= left(degrees));
}

/// What is left of a confidence if the normal may be off by so many degrees more.
pub fn left(degrees: f32) -> f32 {
    1.0 / (1.0 + (degrees / HALVED).powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::compare::{NormalErrors, angle};
    use crate::fit::{Options, Prior, fit};
    use crate::normals::Surface;
    use crate::simulate::{Camera, Sensor, Subject, fibonacci_dome};
    use crate::weave::{Cloth, Fabric, Irregularity};
    use crate::{Eye, Lights};
    use glam::Vec2;
    use yugen_optics::ColourSpace;
    use yugen_optics::random::Pcg32;
    use yugen_reflectance::Choice;

    /// Strips of metal between three and eight texels wide that lean to either side.
    fn strips() -> Btf {
        let (width, height) = (64, 48);
        let mut rng = Pcg32::new(3, 4);
        let (mut leans, mut left) = (Vec::new(), 0);
        let mut lean = 0.0;
        for _ in 0..width {
            if left == 0 {
                (left, lean) = (3 + (6.0 * rng.next_f32()) as usize, 0.8 * rng.next_f32() - 0.4);
            }
            leans.push(lean);
            left -= 1;
        }
        let texel = |i: usize| Texel {
            diffuse: Vec3::splat(0.05),
            specular: Vec3::splat(0.5),
            normal: Vec3::new(leans[i % width], 0.1, 1.0).normalize(),
            tangent: Vec3::X,
            sigma: Vec2::splat(0.15),
            confidence: 1.0,
        };
        let texels = (0..width * height).map(texel).collect();
        Btf { width, height, colour_space: ColourSpace::LinearSrgb, texels }
    }

    fn photographed(blur: f32) -> Stack {
        let cloth = strips();
        let subject = Subject::new(&cloth, None, Choice(0.0)).unwrap();
        let lights = Lights::Distant(fibonacci_dome(40, 1.2));
        subject.photograph(&lights, Eye::ABOVE, &Camera { blur, ..Camera::default() })
    }

    /// Of another cloth than the table was measured on, whose wide strips have no steep flanks but at their edges.
    #[test]
    fn blur_is_measured() {
        assert_eq!(blur(&[photographed(0.0)]), 0.0);
        for sigma in [0.5, 0.6, 0.8, 1.0] {
            let found = blur(&[photographed(sigma)]);
            println!("{sigma}: {found:.2}");
            assert!(found > 0.9 * sigma && found < 1.7 * sigma, "{sigma}: {found}");
        }
        assert_eq!(blur(&[]), 0.0);
    }

    /// Brocade through a lens that blurs it by .7 texels and through a perfect one: of the texels that are sure of themselves
    /// few are off by more than 5°, and the perfect lens costs none.
    #[test]
    fn a_confident_texel_is_right_through_a_blurred_lens() {
        let (width, height) = (96, 64);
        let fabric = Fabric::preset("kinran", ColourSpace::LinearSrgb).unwrap();
        let extent = Vec2::new(width as f32, height as f32) / 16.0;
        let cloth = Cloth::weave(&fabric, [width, height], extent, Irregularity::default(), 5).btf;
        let subject = Subject::new(&cloth, None, Choice(0.0)).unwrap();
        let lights = Lights::Distant(fibonacci_dome(50, 1.3));
        let errors = |blurred: f32| {
            // Four times the usual electrons: what three exposures bring.
            let sensor = Some(Sensor { full_well: 200_000.0, ..Sensor::default() });
            let camera = Camera { blur: blurred, sensor, ..Camera::default() };
            let stack = subject.photograph(&lights, Eye::ABOVE, &camera);
            let bands = std::slice::from_ref(&stack);
            let surface = Surface::of(bands, None, &crate::normals::Options::default(), 2);
            let options = Options { surface: Some(surface), ..Options::default() };
            let prior = Prior::learn(bands, &options, 2);
            let fitted = fit(&stack, &options, prior.as_ref(), 2, &|_| {});
            let texels = fitted.into_iter().map(|f| f.texel).collect();
            let mut maps = Btf { texels, ..cloth.clone() };
            let off = |maps: &Btf| {
                let each = maps.texels.iter().zip(&cloth.texels);
                let all: Vec<_> = each.map(|(t, c)| (t.confidence, angle(t.normal, c.normal))).collect();
                NormalErrors::of(&all).unwrap()
            };
            let before = off(&maps);
            doubt(&mut maps, blur(bands));
            let after = off(&maps);
            println!(
                "{blurred}: {} of {} sure, {} of {}",
                before.sure_and_wrong, before.sure, after.sure_and_wrong, after.sure
            );
            (before, after)
        };
        let (before, after) = errors(0.7);
        assert!(40 * before.sure_and_wrong > before.sure, "nothing to see");
        assert!(2 * after.sure > before.sure && 100 * after.sure_and_wrong < after.sure);
        let (before, after) = errors(0.0);
        assert_eq!((before.sure, before.sure_and_wrong), (after.sure, after.sure_and_wrong));
    }

    #[test]
    fn a_step_between_two_known_ones_is_between_their_blurs() {
        assert_eq!((of_step(1.0), of_step(0.1)), (0.0, 0.0));
        for [step, blur] in &STEPS[..6] {
            assert!((of_step(*step) - blur).abs() < 1e-6);
        }
        assert!((of_step(0.655) - 0.85).abs() < 1e-5);
    }

    /// Where all lean alike, and where they turn evenly, a blur leaves normals as they are; beside a fold it does not, least
    /// where its own side is the brighter one.
    #[test]
    fn normals_are_turned_where_they_bend() {
        let slopes = |slope: &dyn Fn(usize) -> f32, bright: &dyn Fn(usize) -> f32| {
            let at = |i: usize| Some((Vec3::new(slope(i % 9), 0.0, 1.0).normalize(), bright(i % 9)));
            turned(0.7, 9, 9, at)[4 * 9..5 * 9].to_vec()
        };
        let even = |_: usize| 1.0;
        assert!(slopes(&|_| 0.3, &even).iter().all(|t| *t < 1e-3));
        assert!(slopes(&|x| 0.02 * x as f32 - 0.08, &even)[1..8].iter().all(|t| *t < 0.05));
        let fold = |x: usize| if x < 5 { 0.0 } else { 0.4 };
        let off = slopes(&fold, &even);
        assert!(off[4] > 5.0 && off[5] > 5.0 && off[1] < 1e-3, "{off:?}");
        let lit = slopes(&fold, &|x| if x < 5 { 1.0 } else { 0.1 });
        assert!(lit[4] < 0.3 * off[4] && lit[5] > off[5], "{lit:?}");
        // Texels that are not there are in nothing.
        let alone = turned(0.7, 3, 3, |i| (i == 4).then_some((Vec3::Z, 1.0)));
        assert!(alone.iter().all(|t| *t == 0.0));
        assert!(
            turned(0.1, 9, 9, |i| Some((if i % 2 == 0 { Vec3::Z } else { Vec3::X }, 1.0)))
                .iter()
                .all(|t| *t == 0.0)
        );
        assert_eq!((left(0.0), left(HALVED)), (1.0, 0.5));
    }
}
