//! The kariginu, the hunting cloak of men: a body one width of the loom wide before and behind, sides that are open, a round neck with an
//! upright collar, and sleeves of a width and a half that are sewn to the back alone, for a hand's breadth. The front is sewn in the
//! middle, and the collar closed, as they are when the cloak is fastened; what laps over there (okubi) is left out.

use super::bolt::{Bolt, Levels, WideSleeve, edge, leaves};
use super::cuts::BELT;
use super::{Form, Garment, Side, Wear};
use Side::{Bottom, Left, Right, Top};

pub(super) fn kariginu(m: &[f32]) -> Garment {
    let [length, back, sleeve, depth, sewn, neck, neckline, collar, belt] =
        *m.as_array().unwrap_or(&[0.0; 9]);
    let depth = depth.min(length - 0.1);
    let levels = Levels::new(vec![0.0, 0.5 * neckline, 0.85 * neckline, neckline, sewn, depth, length]);
    let [neckline, sewn, depth] = [neckline, sewn, depth].map(|v| levels.near(v));
    // An ellipse.
    let round = |v: f32| neck * (1.0 - (v / neckline).min(1.0).powi(2)).sqrt();
    // The front leaves the sleeves from the shoulder on.
    let side = |v: f32| back - leaves(v, 0.0, sewn);
    let mut bolt = Bolt::default();
    let backs = bolt.backs(&levels, length, back, neck);
    let fronts = bolt.fronts(&levels, [length, back, neck], backs, round, side);
    bolt.sew(edge(fronts[0], Left, neckline, length), edge(fronts[1], Right, neckline, length));
    bolt.wide_sleeves(&levels, &WideSleeve { back, sleeve, depth, sewn }, backs, None);
    let path = [
        edge(fronts[0], Left, neckline, 0.0),
        edge(backs[0], Top, back - neck, back),
        edge(backs[1], Top, 0.0, neck),
        edge(fronts[1], Right, 0.0, neckline),
    ];
    let strip = bolt.strip("collar", collar, &path);
    // Its ends are fastened at the throat.
    bolt.sew(edge(strip, Top, 0.0, collar), edge(strip, Bottom, 0.0, collar));
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
            form: Form::Fastened,
            bare: false,
        },
        fabric: None,
    }
}
