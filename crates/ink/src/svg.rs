//! Strokes as vectors: SVG with a group for each kind of stroke and each object.
//!
//! A stroke is its outline, filled, and its centreline, which is not drawn and keeps what programs want to know: width and
//! pressure at each of its points, identity and length. Outlines are smooth: the radius is sampled as densely as it changes.

use crate::canvas::Layer;
use crate::mount::{self, Mounting};
use crate::path;
use crate::signature::{self, Mark};
use crate::stroke::{Stroke, StrokePoint, tangent};
use glam::{Vec2, Vec3};
use std::collections::BTreeMap;
use std::fmt::Write;
use yugen_optics::colour::linear_to_srgb;

/// Distance by which a simplified centreline may be off, pixels: a tenth of what is seen.
const TOLERANCE: f32 = 0.1;

/// What is written beside strokes.
#[derive(Clone, Copy)]
pub struct Drawing<'a> {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Colour of the paper, linear sRGB.
    pub paper: Vec3,
    /// Colour of a load of ink on the paper, linear sRGB.
    pub shade: &'a dyn Fn(f32) -> Vec3,
    /// Name of a shape by its number, counted from one.
    pub name: &'a dyn Fn(u32) -> String,
    /// Inscription and seal.
    pub marks: &'a [Mark],
    /// Colours of their layers.
    pub of_marks: &'a dyn Fn(Layer) -> Vec3,
    /// What it is mounted in.
    pub mounting: Option<&'a Mounting>,
    /// Number of the frame, of a sequence.
    pub frame: Option<u32>,
}

/// The text of a file. Layers are in the order in which they are painted.
pub fn svg(layers: &[(Layer, &[Stroke])], drawing: &Drawing) -> String {
    let [w, h] = drawing.mounting.map_or(drawing.size, |m| m.size);
    let mut out = String::new();
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" \
         width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\">"
    );
    if let Some(mounting) = drawing.mounting {
        write_figures(&mut out, mounting);
        write_parts(&mut out, mounting, false);
        let [x, y] = mounting.at;
        let clip = mounting.leaf.as_ref().map_or("", |_| " clip-path=\"url(#leaf)\"");
        let _ = writeln!(out, "<g id=\"painting\"{clip}><g transform=\"translate({x} {y})\">");
    }
    let [w, h] = drawing.size;
    let _ =
        writeln!(out, "<rect id=\"paper\" width=\"{w}\" height=\"{h}\" fill=\"{}\"/>", hex(drawing.paper));
    let frame = drawing.frame.map_or(String::new(), |f| format!(" data-frame=\"{f}\""));
    for (layer, strokes) in layers {
        let name = layer.name();
        let _ =
            writeln!(out, "<g id=\"{name}\" inkscape:groupmode=\"layer\" inkscape:label=\"{name}\"{frame}>");
        let mut objects: BTreeMap<u32, Vec<&Stroke>> = BTreeMap::new();
        strokes.iter().for_each(|s| objects.entry(s.shape).or_default().push(s));
        for (shape, strokes) in objects {
            let label = escape(&(drawing.name)(shape));
            let _ =
                writeln!(out, "<g id=\"{name}-{shape}\" inkscape:label=\"{label}\" data-object=\"{label}\">");
            strokes.into_iter().for_each(|s| write_stroke(&mut out, s, drawing));
            out.push_str("</g>\n");
        }
        out.push_str("</g>\n");
    }
    for layer in [Layer::Inscription, Layer::Seal] {
        write_marks(&mut out, layer, drawing);
    }
    if let Some(mounting) = drawing.mounting {
        out.push_str("</g></g>\n");
        write_parts(&mut out, mounting, true);
    }
    out.push_str("</svg>\n");
    out
}

fn write_marks(out: &mut String, layer: Layer, drawing: &Drawing) {
    let marks: Vec<&Mark> = drawing.marks.iter().filter(|m| m.layer == layer).collect();
    if marks.is_empty() {
        return;
    }
    let (name, fill) = (layer.name(), hex((drawing.of_marks)(layer)));
    let _ = writeln!(out, "<g id=\"{name}\" inkscape:groupmode=\"layer\" inkscape:label=\"{name}\">");
    for (i, mark) in marks.into_iter().enumerate() {
        let (text, mut mask) = (escape(&mark.text), String::new());
        if let (Some(cut), Some(around)) = (&mark.cut, signature::around(mark)) {
            mask = format!(" mask=\"url(#{name}-{i}-cut)\"");
            let (around, cut) = (path::svg(&around), path::svg(cut));
            let _ = writeln!(
                out,
                "<mask id=\"{name}-{i}-cut\" maskUnits=\"userSpaceOnUse\"><path fill=\"#fff\" d=\"{around}\"/>\
                 <path fill=\"#000\" d=\"{cut}\"/></mask>"
            );
        }
        let d = path::svg(&mark.form);
        let _ = writeln!(out, "<path data-text=\"{text}\" fill=\"{fill}\"{mask} d=\"{d}\"/>");
    }
    out.push_str("</g>\n");
}

/// Figures of brocade, shades of rods, and the leaf of a fan, to be referred to.
fn write_figures(out: &mut String, mounting: &Mounting) {
    out.push_str("<defs>\n");
    if let Some(leaf) = &mounting.leaf {
        let _ = writeln!(out, "<clipPath id=\"leaf\"><path d=\"{}\"/></clipPath>", path::svg(leaf));
    }
    for (i, part) in mounting.parts.iter().enumerate() {
        let (fill, b) = (hex(part.cloth.colour), part.path.bounds());
        if let Some(figure) = part.cloth.figure {
            let ring = mounting.unit.max(2.0);
            let step = ring * std::f32::consts::SQRT_2;
            let (r, side, thin) = (number(ring), number(step), number(2.0 * mount::RING * ring));
            let rings = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[x, y]: [f32; 2]| {
                let [x, y] = [x, y].map(|v| number(v * step));
                format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"/>")
            });
            let _ = writeln!(
                out,
                "<pattern id=\"cloth-{i}\" patternUnits=\"userSpaceOnUse\" width=\"{side}\" height=\"{side}\">\
                 <rect width=\"{side}\" height=\"{side}\" fill=\"{fill}\"/>\
                 <g fill=\"none\" stroke=\"{}\" stroke-width=\"{thin}\">{}</g></pattern>",
                hex(figure),
                rings.concat()
            );
        } else if part.cloth.rod {
            let flat = b.width() > b.height();
            let stops = (0..=8).map(|k| {
                let t = k as f32 / 8.0;
                format!(
                    "<stop offset=\"{}\" stop-color=\"{}\"/>",
                    number(t),
                    hex(part.cloth.colour * mount::round(t))
                )
            });
            let (x, y) = if flat { (0, 1) } else { (1, 0) };
            let stops = stops.collect::<String>();
            let _ = writeln!(
                out,
                "<linearGradient id=\"cloth-{i}\" x1=\"0\" y1=\"0\" x2=\"{x}\" y2=\"{y}\">{stops}</linearGradient>"
            );
        }
    }
    out.push_str("</defs>\n");
}

fn write_parts(out: &mut String, mounting: &Mounting, over: bool) {
    if mounting.parts.iter().all(|p| p.over != over) {
        return;
    }
    let _ = writeln!(out, "<g id=\"mount{}\">", if over { "-over" } else { "" });
    for (i, part) in mounting.parts.iter().enumerate().filter(|(_, p)| p.over == over) {
        let fill = match part.cloth.figure.is_some() || part.cloth.rod {
            true => format!("url(#cloth-{i})"),
            false => hex(part.cloth.colour),
        };
        let cover = match part.cloth.cover {
            1.0 => String::new(),
            part => format!(" fill-opacity=\"{part}\""),
        };
        let (label, d) = (part.name, path::svg(&part.path));
        let _ = writeln!(out, "<path inkscape:label=\"{label}\" fill=\"{fill}\"{cover} d=\"{d}\"/>");
    }
    out.push_str("</g>\n");
}

fn write_stroke(out: &mut String, stroke: &Stroke, drawing: &Drawing) {
    let points = simplified(stroke);
    if points.len() < 2 {
        return;
    }
    let ink = points.iter().map(|p| p.ink).sum::<f32>() / points.len() as f32;
    let list = |value: &dyn Fn(&StrokePoint) -> f32| {
        points.iter().map(|p| number(value(p))).collect::<Vec<_>>().join(" ")
    };
    let mut line = through(points.iter().map(|p| p.pixel));
    if stroke.closed {
        line.push('Z');
    }
    let _ = writeln!(
        out,
        "<g data-id=\"{:08x}\" data-kind=\"{}\" data-closed=\"{}\" data-length=\"{}\"{}>\
         <path fill=\"{}\" fill-rule=\"nonzero\" d=\"{}\"/>\
         <path fill=\"none\" stroke=\"none\" d=\"{line}\" data-width=\"{}\" data-pressure=\"{}\" data-dryness=\"{}\" \
         data-ink=\"{}\"/></g>",
        stroke.id,
        stroke.kind.name(),
        stroke.closed,
        number(stroke.length()),
        if stroke.fading { " data-fading=\"true\"" } else { "" },
        hex((drawing.shade)(ink)),
        outline(&points, stroke.closed),
        list(&|p| 2.0 * p.radius),
        list(&|p| p.pressure),
        list(&|p| p.dryness),
        list(&|p| p.ink),
    );
}

/// Both sides of the stroke; of a closed one two loops, of which the inner one runs the other way.
fn outline(points: &[StrokePoint], closed: bool) -> String {
    let n = points.len();
    let side = |i: usize, sign: f32| {
        let way = if closed {
            (points[(i + 1) % n].pixel - points[(i + n - 1) % n].pixel).normalize_or(Vec2::X)
        } else {
            tangent(points, i)
        };
        points[i].pixel + way.perp() * sign * points[i].radius
    };
    if closed {
        let out = through((0..n).map(|i| side(i, 1.0)));
        let back = through((0..n).rev().map(|i| side(i, -1.0)));
        return format!("{out}Z{back}Z");
    }
    // Round ends: a half circle about each.
    let cap = |i: usize, sign: f32| {
        let way = tangent(points, i) * sign;
        (1..6).map(move |k| {
            let turn = Vec2::from_angle(std::f32::consts::PI * k as f32 / 6.0);
            points[i].pixel + points[i].radius * turn.rotate(-way.perp() * 1.0)
        })
    };
    let there = (0..n).map(|i| side(i, -1.0));
    let back = (0..n).rev().map(|i| side(i, 1.0));
    through(there.chain(cap(n - 1, 1.0)).chain(back).chain(cap(0, -1.0))) + "Z"
}

fn through(points: impl Iterator<Item = Vec2>) -> String {
    let mut out = String::new();
    for (i, p) in points.enumerate() {
        let _ = write!(out, "{}{} {}", if i == 0 { "M" } else { "L" }, number(p.x), number(p.y));
    }
    out
}

/// Two digits after the point, none that say nothing.
pub(crate) fn number(v: f32) -> String {
    let text = format!("{:.2}", if v.is_finite() { v } else { 0.0 });
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.into() }
}

/// Without points that lie on the way between their neighbours, in place and in width. Douglas and Peucker 1973.
fn simplified(stroke: &Stroke) -> Vec<StrokePoint> {
    let p = &stroke.points;
    if p.len() < 3 {
        return p.clone();
    }
    let mut keep = vec![false; p.len()];
    (keep[0], keep[p.len() - 1]) = (true, true);
    let mut ranges = vec![(0, p.len() - 1)];
    while let Some((a, b)) = ranges.pop() {
        let span = (p[b].s - p[a].s).max(1e-6);
        let off = |i: usize| {
            let t = (p[i].s - p[a].s) / span;
            let place = p[a].pixel.lerp(p[b].pixel, t).distance(p[i].pixel);
            place.max((p[a].radius + (p[b].radius - p[a].radius) * t - p[i].radius).abs())
        };
        let worst = (a + 1..b).map(|i| (off(i), i)).max_by(|x, y| x.0.total_cmp(&y.0));
        if let Some((_, i)) = worst.filter(|w| w.0 > TOLERANCE) {
            keep[i] = true;
            ranges.extend([(a, i), (i, b)]);
        }
    }
    p.iter().zip(keep).filter(|(_, k)| *k).map(|(p, _)| *p).collect()
}

fn hex(linear: Vec3) -> String {
    let byte = |v: f32| (linear_to_srgb(v.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8;
    format!("#{:02x}{:02x}{:02x}", byte(linear.x), byte(linear.y), byte(linear.z))
}

/// Text inside an attribute.
fn escape(text: &str) -> String {
    let plain: String = text.chars().filter(|c| !c.is_control()).collect();
    plain.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contour::LineKind;

    fn stroke(closed: bool) -> Stroke {
        let n = 256;
        let points = (0..n)
            .map(|i| {
                let a = i as f32 / n as f32 * std::f32::consts::TAU;
                StrokePoint {
                    pixel: Vec2::splat(50.0) + 30.0 * Vec2::from_angle(a),
                    depth: 1.0,
                    s: 30.0 * a,
                    phase: 30.0 * a,
                    pressure: 0.5,
                    dryness: 0.2,
                    ink: 0.9,
                    radius: 3.0,
                }
            })
            .collect();
        Stroke { kind: LineKind::Contour, shape: 1, id: 0xabc, seed: 0xabc, points, closed, fading: false }
    }

    #[test]
    fn closed_strokes_are_closed_and_groups_are_by_kind_and_object() {
        let strokes = [stroke(true), stroke(false), Stroke { shape: 2, ..stroke(false) }];
        let drawing = Drawing {
            size: [100, 80],
            paper: Vec3::ONE,
            shade: &|load| Vec3::splat(1.0 - load),
            name: &|shape| format!("<{shape}> & \"co\""),
            marks: &[],
            of_marks: &|_| Vec3::ZERO,
            mounting: None,
            frame: Some(7),
        };
        let text = svg(&[(Layer::Contour, &strokes)], &drawing);
        assert!(text.starts_with("<svg") && text.ends_with("</svg>\n"));
        assert_eq!(text.matches("<g ").count(), text.matches("</g>").count());
        assert_eq!(text.matches("data-object=\"&lt;1&gt; &amp; &quot;co&quot;\"").count(), 1);
        assert!(
            text.contains("id=\"gou\"")
                && text.contains("data-frame=\"7\"")
                && text.contains("data-id=\"00000abc\"")
        );
        // The outline of a ring has two loops, its centreline one.
        let ring = text.lines().find(|l| l.contains("data-closed=\"true\"")).unwrap();
        assert_eq!(ring.matches('Z').count(), 3);
        let open = text.lines().find(|l| l.contains("data-closed=\"false\"")).unwrap();
        assert_eq!(open.matches('Z').count(), 1);
        // As many widths as points.
        let attribute = |name: &str| {
            ring.split(&format!("{name}=\"")).nth(1).unwrap().split('"').next().unwrap().to_string()
        };
        let centre = ring.rsplit(" d=\"").next().unwrap().split('"').next().unwrap();
        assert_eq!(attribute("data-width").split(' ').count(), centre.matches(['M', 'L']).count());
    }

    #[test]
    fn simplifying_keeps_the_form() {
        let all = stroke(false);
        let few = simplified(&all);
        assert!(few.len() < all.points.len() && few.len() > 10, "{}", few.len());
        for p in &all.points {
            let near = few.windows(2).map(|w| {
                let d = w[1].pixel - w[0].pixel;
                let t = ((p.pixel - w[0].pixel).dot(d) / d.length_squared()).clamp(0.0, 1.0);
                (w[0].pixel + d * t).distance(p.pixel)
            });
            assert!(near.fold(f32::MAX, f32::min) <= TOLERANCE + 1e-4);
        }
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(
            [1.0, 0.5, -0.001, 12.345, f32::NAN].map(number),
            ["1", "0.5", "0", "12.35", "0"].map(String::from)
        );
    }
}
