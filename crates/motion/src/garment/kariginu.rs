//! The kariginu, the hunting cloak of men: a body one width of the loom wide before and behind, sides that are open, a round neck with an
//! upright collar, and sleeves of a width and a half that are sewn to the back alone, for a hand's breadth. The front is sewn in the
//! middle, as it is when the cloak is fastened; what laps over there (okubi) is left out.

use super::bolt::{Bolt, Levels, edge, flat};
use super::cuts::BELT;
use super::{Garment, Side, Wear};
use Side::{Bottom, Left, Right, Top};

/// How much narrower a piece is where it lies beside another that it is not sewn to, m.
const APART: f32 = 0.02;

pub(super) fn kariginu(m: &[f32]) -> Garment {
    let [length, back, sleeve, depth, sewn, neck, neckline, collar, belt] =
        *m.as_array().unwrap_or(&[0.0; 9]);
    let depth = depth.min(length - 0.1);
    let levels = Levels::new(vec![0.0, 0.5 * neckline, 0.85 * neckline, neckline, sewn, depth, length]);
    let [neckline, sewn, depth] = [neckline, sewn, depth].map(|v| levels.near(v));
    // An ellipse.
    let round = |v: f32| neck * (1.0 - (v / neckline).min(1.0).powi(2)).sqrt();
    let leaves = |v: f32, from: f32, to: f32| APART * ((v - from) / (to - from)).clamp(0.0, 1.0);
    // The front leaves the sleeves from the shoulder on.
    let side = |v: f32| back - leaves(v, 0.0, sewn);
    let mut bolt = Bolt::default();
    let whole = |_: f32| [0.0, back];
    let all = levels.marks(0.0, length, whole);
    let backs = [
        bolt.cut("left back", &[0.0, back - neck, back], all.clone(), flat(back, -1.0, false, false)),
        bolt.cut("right back", &[0.0, neck, back], all, flat(0.0, -1.0, false, false)),
    ];
    let fronts = [
        bolt.cut(
            "left front",
            &[0.0, neck, back],
            levels.marks(0.0, length, |v| [round(v), side(v)]),
            flat(0.0, 1.0, true, true),
        ),
        bolt.cut(
            "right front",
            &[0.0, back - neck, back],
            levels.marks(0.0, length, |v| [back - side(v), back - round(v)]),
            flat(-back, 1.0, true, false),
        ),
    ];
    bolt.sew(edge(backs[0], Right, 0.0, length), edge(backs[1], Left, 0.0, length));
    bolt.sew(edge(fronts[0], Left, neckline, length), edge(fronts[1], Right, neckline, length));
    bolt.sew(edge(backs[0], Top, back - neck, 0.0), edge(fronts[0], Top, neck, back));
    bolt.sew(edge(backs[1], Top, neck, back), edge(fronts[1], Top, back - neck, 0.0));
    let across = [0.0, APART, sleeve - APART, sleeve];
    for (k, name) in ["left sleeve", "right sleeve"].into_iter().enumerate() {
        let left = k == 0;
        let cut = |bolt: &mut Bolt, which: &str, hang, inner: &dyn Fn(f32) -> f32, at_left: bool| {
            let marks = levels
                .marks(0.0, depth, |v| if at_left { [inner(v), sleeve] } else { [0.0, sleeve - inner(v)] });
            bolt.cut(&format!("{name}, {which}"), &across, marks, hang)
        };
        // Of the left sleeve u runs inwards behind, and outwards before; of the right the other way round.
        let [at_back, at_front] = if left { [back + sleeve, back] } else { [-back, -back - sleeve] };
        let hangs = [flat(at_back, -1.0, false, false), flat(at_front, 1.0, true, left)];
        let behind = cut(&mut bolt, "back", hangs[0], &|v| leaves(v, sewn, depth), !left);
        let before = cut(&mut bolt, "front", hangs[1], &|v| leaves(v, 0.0, depth), left);
        let (towards, away) = if left { (Right, Left) } else { (Left, Right) };
        bolt.sew(edge(behind, towards, 0.0, sewn), edge(backs[k], away, 0.0, sewn));
        bolt.sew(edge(behind, Top, 0.0, sleeve), edge(before, Top, sleeve, 0.0));
        let [low, high] = if left { [0.0, sleeve - APART] } else { [APART, sleeve] };
        bolt.sew(edge(behind, Bottom, low, high), edge(before, Bottom, sleeve - low, sleeve - high));
    }
    let path = [
        edge(fronts[0], Left, neckline, 0.0),
        edge(backs[0], Top, back - neck, back),
        edge(backs[1], Top, 0.0, neck),
        edge(fronts[1], Right, 0.0, neckline),
    ];
    bolt.strip("collar", collar, &path);
    Garment {
        name: "kariginu".into(),
        panels: bolt.panels,
        seams: bolt.seams,
        wear: Wear {
            length,
            half: back,
            hem: back,
            sleeve,
            armhole: sewn,
            depth,
            cuff: depth,
            neck,
            belt: [belt, belt + BELT],
            open: true,
            shut: true,
            legs: None,
        },
        fabric: None,
    }
}
