//! The values in the plane of incidence over a straight axis.

use super::{Scene, plane};
use crate::figure::Figure;
use crate::figure::chart::{Across, Chart};
use crate::figure::scale::Scale;
use anyhow::Result;
use std::f32::consts::{FRAC_PI_2, PI};

pub fn draw(scene: &Scene) -> Result<Figure> {
    let reach = if scene.transmits() { PI } else { FRAC_PI_2 };
    let (curves, coloured) = plane::curves(scene, reach)?;
    let max = curves.iter().flat_map(|c| &c.points).fold(0.0f32, |a, (_, v)| a.max(*v));
    let posts = match scene.theta_i[..] {
        [theta] if theta > 0.0 => vec![(-theta.to_degrees(), "light"), (theta.to_degrees(), "mirror")],
        _ => Vec::new(),
    };
    let chart = Chart {
        heading: scene.heading(coloured),
        across: Across::degrees(
            "angle of the eye from the normal, towards the mirror direction",
            -reach.to_degrees(),
            reach.to_degrees(),
        ),
        upwards: match scene.relative {
            true => format!("{} over its peak", scene.value.name()),
            false => format!("{}, 1/sr", scene.value.name()),
        },
        scale: scene.scale,
        top: if scene.scale == Scale::Linear { 1.06 * max } else { 1.2 * max },
        marks: Vec::new(),
        posts,
    };
    Ok(chart.draw(&curves))
}
