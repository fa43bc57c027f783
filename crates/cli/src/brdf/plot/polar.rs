//! The lobe in the plane of incidence, as lengths from the lit point.

use super::{Scene, plane};
use crate::figure::curve::Legend;
use crate::figure::scale::digits;
use crate::figure::{Anchor, Figure, INK, LINE, RULE, wrapped};
use anyhow::Result;
use std::f32::consts::{FRAC_PI_2, PI};
use yugen_optics::Vec2;

const WIDTH: f32 = 720.0;
const RADIUS: f32 = 290.0;
/// Room for the names of angles around the rim.
const RIM: f32 = 34.0;

pub fn draw(scene: &Scene) -> Result<Figure> {
    // A model that lets light through is seen from below too.
    let reach = if scene.transmits() { PI } else { FRAC_PI_2 };
    let (curves, coloured) = plane::curves(scene, reach)?;
    let max = curves.iter().flat_map(|c| &c.points).fold(0.0f32, |a, (_, v)| a.max(*v));

    let heading = scene.heading(coloured);
    let lines: Vec<&str> = heading.iter().map(String::as_str).collect();
    let head: usize = lines.iter().map(|l| wrapped(l, WIDTH - 40.0).len()).sum();
    let legend = Legend::new(&curves, WIDTH - 40.0);
    let centre = Vec2::new(WIDTH / 2.0, 22.0 + LINE * head as f32 + RIM + RADIUS);
    let foot = centre.y + if reach > FRAC_PI_2 { RADIUS + RIM } else { 0.0 } + 24.0;
    let mut figure = Figure::new(WIDTH, foot + legend.height() + 16.0);
    figure.heading(&lines);
    // Angles from the normal, towards the mirror direction.
    let at = |angle: f32, r: f32| centre + r * RADIUS * Vec2::new(angle.sin(), -angle.cos());
    let unit = |v: f32| scene.scale.unit(v, max);

    // Rings, spokes and what they mean.
    for r in scene.scale.ticks(max).into_iter().map(unit).chain([1.0]) {
        figure.line((-90..=90).map(|i| at(i as f32 / 90.0 * reach, r)).collect(), RULE, 1.0);
    }
    let spokes = (reach.to_degrees() / 15.0).round() as i32;
    for i in -spokes..=spokes {
        let degrees = 15 * i;
        if degrees == -180 {
            continue;
        }
        let angle = (degrees as f32).to_radians();
        figure.line(vec![at(angle, 0.0), at(angle, 1.0)], RULE, if degrees % 90 == 0 { 1.6 } else { 0.7 });
        if degrees % 30 == 0 {
            let p = at(angle, 1.045);
            let anchor = match degrees {
                -180 | 0 | 180 => Anchor::Middle,
                d if d < 0 => Anchor::End,
                _ => Anchor::Start,
            };
            figure.text(p.x, p.y + 4.0 - 2.0 * angle.cos(), anchor, format!("{}°", degrees.abs()));
        }
    }

    for curve in &curves {
        let mut outline: Vec<Vec2> = curve.points.iter().map(|(a, v)| at(a.to_radians(), unit(*v))).collect();
        // What lies closer together than the eye can tell makes a file large and nothing else.
        outline.dedup_by(|next, kept| next.distance_squared(*kept) < 0.25);
        if curves.len() <= 4 {
            let mut area = outline.clone();
            area.push(centre);
            figure.area(area, curve.look.colour, 0.10);
        }
        figure.broken(outline, curve.look.colour, 2.2, curve.look.dash);
    }
    let one_model = scene.shown.len() == 1 && scene.theta_i.len() > 1;
    for (i, &theta) in scene.theta_i.iter().enumerate() {
        let colour = if one_model { curves[i].look.colour } else { INK };
        figure.dashes(vec![at(-theta, 0.7), at(-theta, 0.0)], colour, 1.0);
        figure.arrow(at(-theta, 1.0), at(-theta, 0.7), colour);
    }
    let mut last = 0.0;
    for tick in scene.scale.ticks(max) {
        let r = unit(tick);
        // At the rim stands 0°; closer rings would have their numbers on each other.
        if r > 0.96 || (r - last) * RADIUS < 16.0 {
            continue;
        }
        last = r;
        let p = at(0.0, r);
        figure.text(p.x + 4.0, p.y - 3.0, Anchor::Start, digits(tick));
    }
    legend.peaks(&mut figure, &|degrees, v| at(degrees.to_radians(), unit(v)));
    legend.draw(&mut figure, Vec2::new(20.0, foot));
    Ok(figure)
}
