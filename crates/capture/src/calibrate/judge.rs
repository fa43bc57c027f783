//! Whether what was found can be believed: is a circle a polished ball, and do the balls agree.

use super::{Ball, Highlight, Outline, Ray, View, angle, mean_direction, triangulate};
use glam::{Vec2, Vec3};

/// Why a circle is no ball to measure by.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// A part of it is missing.
    #[error("reaches out of the picture; photograph it whole")]
    Cut,
    /// At full size it is none.
    #[error("has no rim that shows all around; name a picture in which it stands out with --outline")]
    NoRim,
    /// The camera is near, and its focal length is not known.
    #[error(
        "mirrors the table as a near camera sees it; say --focal in pixels (about {focal:.0}, by this), or photograph from \
         farther away"
    )]
    Nearer {
        /// In pixels, roughly.
        focal: f32,
    },
    /// It may be the border of the table in a ball's mirror.
    #[error(
        "is {step:.0} times brighter on one side, as no rim of a polished ball on a matt ground, and mirrors nothing that \
         lies around it: it may be where a ball's mirror image of the table ends; name a picture in which the rim stands \
         out with --outline, or the rim with --ball"
    )]
    Border {
        /// How many times.
        step: f32,
    },
    /// A coin, a matt ball, a print.
    #[error(
        "is no polished ball under these lights: a lamp's small, bright mirror image stands out on it in {seen} of {of} \
         pictures"
    )]
    NoLamp {
        /// In so many pictures.
        seen: usize,
        /// Of so many.
        of: usize,
    },
    /// What shines on it belongs to no light of the list.
    #[error(
        "shows the same bright spot in the same place in {seen} of {of} pictures: the camera's flash or a lamp of the room, \
         not the lamp that was moved; switch it off"
    )]
    Still {
        /// In so many pictures.
        seen: usize,
        /// Of so many.
        of: usize,
    },
    /// The camera is near and its focal length is not known.
    #[error(
        "is {percent:.1} % longer toward the middle of the picture than across, as a near camera sees a ball; say --focal \
         (about {focal:.0} pixels, by this)"
    )]
    Stretched {
        /// Of its radius.
        percent: f32,
        /// In pixels, as the outline says.
        focal: f32,
    },
}

/// A metal ball mirrors half of the table's light or more at its rim.
const STEP: f32 = 3.0;

/// What is wrong with a ball; `given`: somebody pointed at it. `moving` are the lamps' mirror images, a picture
/// each, and `all` those that are found where what stands still is not taken off.
pub fn fault(
    view: &View,
    outline: &Outline,
    given: bool,
    moving: &[Option<Highlight>],
    all: &[Option<Highlight>],
) -> Option<Fault> {
    let ball = outline.ball;
    if view.focal.is_none() && outline.stretch > 0.0 {
        // The difference of the half axes over their mean is ψ²/2, ψ being how far off the camera's axis it lies.
        let off = ball.centre.distance(view.middle());
        let focal = off / (2.0 * outline.stretch).sqrt();
        return Some(Fault::Stretched { percent: 100.0 * outline.stretch, focal });
    }
    if let Some(focal) = outline.nearer {
        return Some(Fault::Nearer { focal });
    }
    let seen = moving.iter().flatten().count();
    let of = moving.len();
    let still = |all: &[Option<Highlight>]| {
        let places: Vec<Vec2> = all.iter().flatten().map(|h| h.at).collect();
        let middle = |part: fn(&Vec2) -> f32| {
            let mut values: Vec<f32> = places.iter().map(part).collect();
            let half = values.len() / 2;
            values.sort_by(f32::total_cmp);
            values.get(half).copied().unwrap_or_default()
        };
        let middle = Vec2::new(middle(|p| p.x), middle(|p| p.y));
        let near = places.iter().filter(|p| p.distance(middle) < (0.01 * ball.radius).max(1.0)).count();
        // Lights that stand close together are no matter; all in one place are.
        (near >= 3 && near * 10 > of * 7).then_some(Fault::Still { seen: near, of })
    };
    if let Some(fault) = still(moving) {
        return Some(fault);
    }
    if 2 * seen < of {
        return still(all).or(Some(Fault::NoLamp { seen, of }));
    }
    let unproven = !given && outline.mirrored < super::mirror::PROVEN && outline.step > STEP;
    unproven.then_some(Fault::Border { step: outline.step })
}

/// By how much the direction of a lamp may be wrong, as one standard deviation across and along in radians: from those of
/// the outline and of the mirror image. `seen`: the ball as the picture shows it.
pub fn uncertainty(seen: Ball, outline: &Outline, highlight: &Highlight) -> f32 {
    // A normal turns by so much a pixel, and the mirrored ray by twice that; a wrong radius counts as far out as it lies.
    let at = (highlight.at.distance(seen.centre) / seen.radius).min(0.95);
    let off = outline.sigma.hypot(highlight.sigma).hypot(at * outline.radius_sigma);
    2.0 * off / (seen.radius * (1.0 - at * at).sqrt())
}

/// What balls say that disagree on distant lamps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Disagreement {
    /// Their rays meet, so far away in widths of the picture in the median: the lamps are near.
    Near(f32),
    /// Their rays part, as those of a near camera that is taken for a distant one.
    Parting,
    /// Without this ball, by its place in the list, the others agree.
    Odd(usize),
    /// None of these.
    Unknown,
}

/// Why balls disagree: for every light a ray from each ball in which it shows. `within` is the angle in radians that is
/// no disagreement.
pub fn explain(lights: &[Vec<Option<Ray>>], within: f32) -> Disagreement {
    let median = |mut values: Vec<f32>| {
        values.sort_by(f32::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let spread = |without: Option<usize>| {
        let one = |rays: &Vec<Option<Ray>>| {
            let kept: Vec<Ray> =
                rays.iter().enumerate().filter(|r| Some(r.0) != without).filter_map(|r| *r.1).collect();
            (kept.len() > 1).then(|| mean_direction(&kept).map_or(0.0, |m| m.1))
        };
        median(lights.iter().filter_map(one).collect())
    };
    let balls = lights.first().map_or(0, Vec::len);
    let odd = (0..balls).filter_map(|b| Some((b, spread(Some(b))?)));
    if balls > 2
        && let Some((b, rest)) = odd.min_by(|a, b| a.1.total_cmp(&b.1))
        && rest < within
    {
        return Disagreement::Odd(b);
    }
    let (mut meet, mut part, mut count, mut far) = (0, 0, 0, Vec::new());
    for rays in lights {
        let rays: Vec<Ray> = rays.iter().flatten().copied().collect();
        if rays.len() < 2 {
            continue;
        }
        count += 1;
        let Some((point, miss)) = triangulate(&rays) else { continue };
        let ahead = rays.iter().all(|r| r.direction.dot(point - r.origin) > 0.0);
        let behind = rays.iter().all(|r| r.direction.dot(point - r.origin) < 0.0);
        // Behind the balls rays meet where they are drawn backward.
        let miss = if behind { backward(&rays, point) } else { miss };
        if miss < within {
            meet += usize::from(ahead && point.z > 0.0);
            part += usize::from(behind);
            far.push(point.length());
        }
    }
    match median(far) {
        Some(far) if 4 * meet > 3 * count => Disagreement::Near(far),
        _ if 4 * part > 3 * count => Disagreement::Parting,
        _ => Disagreement::Unknown,
    }
}

fn backward(rays: &[Ray], point: Vec3) -> f32 {
    rays.iter().map(|r| angle(-r.direction, point - r.origin)).fold(0.0, f32::max)
}
