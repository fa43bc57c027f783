//! Closed curves: of mountings, seals and characters; as text of SVG.

use glam::{Vec2, vec2};
use std::fmt::Write;
use tiny_skia::{Path, PathBuilder, PathSegment};

/// A closed polygon; `None` where it has no area.
pub fn polygon(points: impl IntoIterator<Item = Vec2>) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (i, p) in points.into_iter().enumerate() {
        if i == 0 { path.move_to(p.x, p.y) } else { path.line_to(p.x, p.y) }
    }
    path.close();
    path.finish().filter(has_area)
}

/// Between two corners.
pub fn rectangle(a: Vec2, b: Vec2) -> Option<Path> {
    polygon([a, vec2(b.x, a.y), b, vec2(a.x, b.y)])
}

/// A disc.
pub fn disc(middle: Vec2, radius: f32) -> Option<Path> {
    PathBuilder::from_circle(middle.x, middle.y, radius).filter(has_area)
}

fn has_area(path: &Path) -> bool {
    path.bounds().width() > 1e-3 && path.bounds().height() > 1e-3
}

/// The attribute `d`.
pub fn svg(path: &Path) -> String {
    let mut out = String::new();
    let n = crate::svg::number;
    for segment in path.segments() {
        let _ = match segment {
            PathSegment::MoveTo(p) => write!(out, "M{} {}", n(p.x), n(p.y)),
            PathSegment::LineTo(p) => write!(out, "L{} {}", n(p.x), n(p.y)),
            PathSegment::QuadTo(c, p) => write!(out, "Q{} {} {} {}", n(c.x), n(c.y), n(p.x), n(p.y)),
            PathSegment::CubicTo(c, d, p) => {
                write!(out, "C{} {} {} {} {} {}", n(c.x), n(c.y), n(d.x), n(d.y), n(p.x), n(p.y))
            }
            PathSegment::Close => write!(out, "Z"),
        };
    }
    out
}
