//! D, G and F of microfacet models, each as a curve of its own.

use super::{Scene, Shown, plane};
use crate::figure::chart::{Across, Chart};
use crate::figure::curve::{Curve, Look, MOST};
use crate::figure::scale::Scale;
use crate::figure::{CHANNELS, Figure};
use anyhow::{Context, Result, bail};
use std::f32::consts::PI;
use yugen_optics::Vec3;
use yugen_optics::frame::spherical;
use yugen_reflectance::{Bsdf, Kind, Terms};

/// One of the three.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Term {
    D,
    G,
    F,
}

/// From a node to the next, degrees.
const STEP: f32 = 0.25;
/// The last of them: at the horizon itself D and F have a meaning, G and the half vector have none.
const LAST: f32 = 89.99;

fn terms(shown: &Shown, wo: Vec3, wi: Vec3) -> Result<Terms> {
    shown.model.bsdf().terms(wo, wi).with_context(|| {
        let made = |kind: &&Kind| {
            let slots = kind.defaults();
            Bsdf::new(**kind, &slots, &[]).terms(Vec3::Z, Vec3::Z).is_some()
        };
        let all: Vec<_> = Kind::ALL.iter().filter(made).map(|k| k.name()).collect();
        format!("{} is not made of D, G and F; {} are", shown.model.kind.name(), all.join(", "))
    })
}

/// Angles from `low` to [`LAST`], degrees.
fn angles(low: f32) -> Vec<f32> {
    let n = ((90.0 - low) / STEP) as i32;
    (0..=n).map(|i| (low + i as f32 * STEP).clamp(-LAST, LAST)).collect()
}

pub fn draw(scene: &Scene, term: Term) -> Result<Figure> {
    match term {
        Term::D => distribution(scene),
        Term::G => masking(scene),
        Term::F => fresnel(scene),
    }
}

/// A curve for each model.
fn each(scene: &Scene, of: impl Fn(&Shown, f32) -> Result<Vec3>) -> Result<Vec<Curve>> {
    if scene.shown.len() > MOST {
        bail!("{} models are more curves than the {MOST} that a figure tells apart", scene.shown.len());
    }
    let mut curves = Vec::new();
    for (i, shown) in scene.shown.iter().enumerate() {
        let values = angles(0.0).into_iter().map(|a| Ok((a, of(shown, a.to_radians())?)));
        let values = values.collect::<Result<Vec<_>>>()?;
        let mut curve = |of: &dyn Fn(Vec3) -> f32, look: Look, name: String| {
            let points = values.iter().map(|(a, v)| (*a, of(*v))).collect();
            curves.push(Curve { name, look, points, peak: None });
        };
        if scene.shown.len() == 1 && values.iter().any(|(_, v)| Scene::coloured(*v)) {
            for (c, colour) in CHANNELS.into_iter().enumerate() {
                curve(&|v| v[c], Look { colour, ..Look::nth(0) }, ["red", "green", "blue"][c].into());
            }
        } else {
            curve(&|v| scene.space.luminance(v), Look::beside(i), shown.name.clone());
        }
    }
    Ok(curves)
}

fn most(curves: &[Curve]) -> f32 {
    curves.iter().flat_map(|c| &c.points).fold(0.0f32, |a, (_, v)| a.max(*v))
}

fn distribution(scene: &Scene) -> Result<Figure> {
    let mut curves = each(scene, |shown, alpha| {
        let h = spherical(alpha, scene.phi);
        Ok(Vec3::splat(terms(shown, h, h)?.d))
    })?;
    for curve in &mut curves {
        let top = most(std::slice::from_ref(curve));
        if !(top > 0.0 && top.is_finite()) {
            bail!("{} has no finite positive D", curve.name);
        }
        if scene.relative {
            curve.points.iter_mut().for_each(|p| p.1 /= top);
        }
    }
    // On a linear scale nothing is seen of what lies below a two-hundredth.
    let seen = |limit: f32| {
        curves.iter().all(|c| {
            let top = most(std::slice::from_ref(c));
            c.points.iter().all(|(a, v)| *a < limit || *v < 0.005 * top)
        })
    };
    let linear = scene.scale == Scale::Linear;
    let high = [15.0, 30.0, 45.0, 60.0].into_iter().find(|limit| linear && seen(*limit)).unwrap_or(90.0);
    curves.iter_mut().for_each(|c| c.points.retain(|(a, _)| *a <= high));
    let top = most(&curves);
    let mut heading = scene.titles();
    heading.push(format!("D, the distribution of facets, {}", scene.scale.name()));
    let chart = Chart {
        heading,
        across: Across::degrees("alpha, angle of the half vector from the normal", 0.0, high),
        upwards: if scene.relative { "D over its peak" } else { "D" }.into(),
        scale: scene.scale,
        top: if linear { 1.06 * top } else { 1.2 * top },
        marks: Vec::new(),
        posts: Vec::new(),
    };
    Ok(chart.draw(&curves))
}

fn masking(scene: &Scene) -> Result<Figure> {
    let mut curves = Vec::new();
    for (shown, theta, look, name) in plane::pairs(scene)? {
        let wi = spherical(theta, scene.phi + PI);
        let points = angles(-90.0).into_iter().map(|a| {
            let wo = spherical(a.abs().to_radians(), if a < 0.0 { scene.phi + PI } else { scene.phi });
            Ok((a, terms(shown, wo, wi)?.g))
        });
        curves.push(Curve { name, look, points: points.collect::<Result<_>>()?, peak: None });
    }
    let mut heading = scene.titles();
    heading.push("G, the part of the facets that light and eye both see".into());
    let chart = Chart {
        heading,
        across: Across::degrees(
            "angle of the eye from the normal, towards the mirror direction",
            -90.0,
            90.0,
        ),
        upwards: "G".into(),
        scale: scene.scale,
        top: 1.06,
        marks: Vec::new(),
        posts: Vec::new(),
    };
    Ok(chart.draw(&curves))
}

fn fresnel(scene: &Scene) -> Result<Figure> {
    let curves = each(scene, |shown, theta| {
        let (wo, wi) = (spherical(theta, scene.phi), spherical(theta, scene.phi + PI));
        Ok(terms(shown, wo, wi)?.f)
    })?;
    let mut heading = scene.titles();
    heading.push("F, the Fresnel reflectance of a facet".into());
    let chart = Chart {
        heading,
        across: Across::degrees("angle of incidence on the facet", 0.0, 90.0),
        upwards: "F".into(),
        scale: scene.scale,
        top: 1.06 * most(&curves).max(1.0),
        marks: Vec::new(),
        posts: Vec::new(),
    };
    Ok(chart.draw(&curves))
}
