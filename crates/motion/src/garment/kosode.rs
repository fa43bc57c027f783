//! The kosode (karaori, atsuita, nuihaku): two lengths of the body, two sleeves, the half widths at the front edges (okumi), a collar;
//! where cloth is folded away along the collar it is cut here.

use super::bolt::{Bolt, edge, flat};
use super::cuts::BELT;
use super::{Form, Garment, Side, Wear, bolt::Levels};

pub(super) fn kosode(m: &[f32]) -> Garment {
    let [length, back, front, okumi, sleeve, depth, cuff, neck, collar, collar_end, belt] =
        *m.as_array().unwrap_or(&[0.0; 11]);
    let collar_end = collar_end.min(length - 0.1);
    let (depth, front) = (depth.min(length - 0.2), front.min(back));
    let cuff = cuff.min(depth - 0.05);
    // The collar goes straight from the neck to the edge of the okumi; it leaves the front where the okumi begins.
    let slope = (neck + okumi) / collar_end;
    let begin = neck / slope;
    let collar_at = |v: f32| neck - slope * v;
    let levels = Levels::new(vec![0.0, cuff, begin, depth, collar_end, length]);
    let [cuff, begin, depth, collar_end] = [cuff, begin, depth, collar_end].map(|v| levels.near(v));
    let marks = |from: f32, to: f32, of: &dyn Fn(f32) -> [f32; 2]| levels.marks(from, to, of);
    let whole = |width: f32| move |_: f32| [0.0, width];
    // A front is as wide as the back at the shoulder, and narrows below the sleeve.
    let side = |v: f32| back - (back - front) * ((v - depth) / (length - depth)).clamp(0.0, 1.0);
    let mut bolt = Bolt::default();
    let [b_left, b_right] = bolt.backs(&levels, length, back, neck);
    let inner = |v: f32| if v < begin { collar_at(v) } else { 0.0 };
    let [f_left, f_right] = bolt.fronts(&levels, [length, back, neck], [b_left, b_right], inner, side);
    let edge_at = |v: f32| if v < collar_end { collar_at(v).min(0.0) } else { -okumi };
    let o_left = bolt.cut(
        "left okumi",
        &[0.0, okumi],
        marks(begin, length, &|v| [if v <= begin { okumi } else { okumi + edge_at(v) }, okumi]),
        flat(-okumi, 1.0, true, true),
    );
    let o_right = bolt.cut(
        "right okumi",
        &[0.0, okumi],
        marks(begin, length, &|v| [0.0, if v <= begin { 0.0 } else { -edge_at(v) }]),
        flat(0.0, 1.0, true, false),
    );
    use Side::{Bottom, Left, Right, Top};
    // Sides and fronts.
    bolt.sew(edge(b_left, Left, depth, length), edge(f_left, Right, depth, length));
    bolt.sew(edge(b_right, Right, depth, length), edge(f_right, Left, depth, length));
    bolt.sew(edge(f_left, Left, begin, length), edge(o_left, Right, begin, length));
    bolt.sew(edge(f_right, Right, begin, length), edge(o_right, Left, begin, length));
    for (left, body_back, body_front) in [(true, b_left, f_left), (false, b_right, f_right)] {
        let name = |end: &str| format!("{} sleeve, {end}", if left { "left" } else { "right" });
        let all = [0.0, sleeve];
        let span = marks(0.0, depth, &whole(sleeve));
        let [behind, before] = if left {
            [
                bolt.cut(&name("back"), &all, span.clone(), flat(back + sleeve, -1.0, false, false)),
                bolt.cut(&name("front"), &all, span, flat(back, 1.0, true, true)),
            ]
        } else {
            [
                bolt.cut(&name("back"), &all, span.clone(), flat(-back, -1.0, false, false)),
                bolt.cut(&name("front"), &all, span, flat(-back - sleeve, 1.0, true, false)),
            ]
        };
        // Towards the body, and towards the hand, of what is behind; before it is the other way round.
        let (inner, outer) = if left { (Right, Left) } else { (Left, Right) };
        bolt.sew(edge(behind, inner, 0.0, depth), edge(body_back, outer, 0.0, depth));
        bolt.sew(edge(before, outer, 0.0, depth), edge(body_front, inner, 0.0, depth));
        bolt.sew(edge(behind, Top, 0.0, sleeve), edge(before, Top, sleeve, 0.0));
        bolt.sew(edge(behind, Bottom, 0.0, sleeve), edge(before, Bottom, sleeve, 0.0));
        bolt.sew(edge(behind, outer, cuff, depth), edge(before, inner, cuff, depth));
    }
    // The collar, from the end on the wearer's left over the neck to that on the right.
    let path = [
        edge(o_left, Left, collar_end, begin),
        edge(f_left, Left, begin, 0.0),
        edge(b_left, Top, back - neck, back),
        edge(b_right, Top, 0.0, neck),
        edge(f_right, Right, 0.0, begin),
        edge(o_right, Right, begin, collar_end),
    ];
    bolt.strip("collar", collar, &path);
    Garment {
        name: "kosode".into(),
        panels: bolt.panels,
        seams: bolt.seams,
        wear: Wear {
            length,
            half: back,
            hem: front,
            sleeve,
            armhole: depth,
            depth,
            cuff,
            neck,
            belt: [belt, belt + BELT],
            form: Form::Wrapped,
            bare: false,
        },
        fabric: None,
    }
}
