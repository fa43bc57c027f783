//! The choken: wide sleeves (osode) that are open at the hand, open sides, fronts that hang beside each other. Pieces that lie beside each
//! other without being sewn are cut a little narrower, so that they are apart.

use super::bolt::{Bolt, Levels, edge, flat};
use super::cuts::BELT;
use super::{Garment, Side, Wear};
use Side::{Bottom, Left, Right, Top};

/// How much narrower a piece is where it lies beside another that it is not sewn to, m.
const APART: f32 = 0.02;

pub(super) fn choken(m: &[f32]) -> Garment {
    let [length, back, sleeve, depth, armhole, neck, neckline, collar, collar_end, belt] =
        *m.as_array().unwrap_or(&[0.0; 10]);
    let depth = depth.min(length - 0.1);
    let (sewn, collar_end) = (armhole.min(depth - 0.1), collar_end.min(length - 0.05).max(neckline + 0.05));
    let levels = Levels::new(vec![0.0, neckline, sewn, depth, collar_end, length]);
    let [neckline, sewn, depth, collar_end] = [neckline, sewn, depth, collar_end].map(|v| levels.near(v));
    // Collars hang beside each other, edge to edge.
    let beside = (collar + 0.5 * APART).min(neck);
    let edge_at = |v: f32| neck + (beside - neck) * (v / neckline).min(1.0);
    // Fronts are narrower at their sides, from the shoulder on.
    let side = |v: f32| back - APART * (v / sewn).min(1.0);
    let whole = |_: f32| [0.0, back];
    let mut bolt = Bolt::default();
    let backs = [
        bolt.cut(
            "left back",
            &[0.0, back - neck, back],
            levels.marks(0.0, length, whole),
            flat(back, -1.0, false, false),
        ),
        bolt.cut(
            "right back",
            &[0.0, neck, back],
            levels.marks(0.0, length, whole),
            flat(0.0, -1.0, false, false),
        ),
    ];
    let fronts = [
        bolt.cut(
            "left front",
            &[0.0, neck, back],
            levels.marks(0.0, length, |v| [edge_at(v), side(v)]),
            flat(0.0, 1.0, true, true),
        ),
        bolt.cut(
            "right front",
            &[0.0, back - neck, back],
            levels.marks(0.0, length, |v| [back - side(v), back - edge_at(v)]),
            flat(-back, 1.0, true, false),
        ),
    ];
    bolt.sew(edge(backs[0], Right, 0.0, length), edge(backs[1], Left, 0.0, length));
    bolt.sew(edge(backs[0], Top, back - neck, 0.0), edge(fronts[0], Top, neck, back));
    bolt.sew(edge(backs[1], Top, neck, back), edge(fronts[1], Top, back - neck, 0.0));
    // What of a sleeve is not sewn to the body leaves it.
    let inner = |v: f32| APART * ((v - sewn) / (depth - sewn)).clamp(0.0, 1.0);
    let narrowed = |at_left: bool| {
        levels.marks(0.0, depth, |v| if at_left { [inner(v), sleeve] } else { [0.0, sleeve - inner(v)] })
    };
    let all = [0.0, APART, sleeve - APART, sleeve];
    for (k, name) in ["left sleeve", "right sleeve"].into_iter().enumerate() {
        let left = k == 0;
        // Of the left sleeve u runs inwards behind, and outwards before; of the right the other way round.
        let [at_back, at_front] = if left { [back + sleeve, back] } else { [-back, -back - sleeve] };
        let hang = flat(at_back, -1.0, false, false);
        let behind = bolt.cut(&format!("{name}, back"), &all, narrowed(!left), hang);
        let hang = flat(at_front, 1.0, true, left);
        let before = bolt.cut(&format!("{name}, front"), &all, narrowed(left), hang);
        let (towards, away) = if left { (Right, Left) } else { (Left, Right) };
        bolt.sew(edge(behind, towards, 0.0, sewn), edge(backs[k], away, 0.0, sewn));
        bolt.sew(edge(before, away, 0.0, sewn), edge(fronts[k], towards, 0.0, sewn));
        bolt.sew(edge(behind, Top, 0.0, sleeve), edge(before, Top, sleeve, 0.0));
        let [low, high] = if left { [0.0, sleeve - APART] } else { [APART, sleeve] };
        bolt.sew(edge(behind, Bottom, low, high), edge(before, Bottom, sleeve - low, sleeve - high));
    }
    let path = [
        edge(fronts[0], Left, collar_end, 0.0),
        edge(backs[0], Top, back - neck, back),
        edge(backs[1], Top, 0.0, neck),
        edge(fronts[1], Right, 0.0, collar_end),
    ];
    bolt.strip("collar", collar, &path);
    Garment {
        name: "choken".into(),
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
            shut: false,
            legs: None,
        },
        fabric: None,
    }
}
