//! The choken: wide sleeves (osode) that are open at the hand, open sides, fronts that hang beside each other. Pieces that lie beside each
//! other without being sewn are cut a little narrower, so that they are apart.

use super::bolt::{APART, Bolt, Levels, WideSleeve, edge, leaves};
use super::cuts::BELT;
use super::{Form, Garment, Side, Wear};
use Side::{Left, Right, Top};

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
    let side = |v: f32| back - leaves(v, 0.0, sewn);
    let mut bolt = Bolt::default();
    let backs = bolt.backs(&levels, length, back, neck);
    let fronts = bolt.fronts(&levels, [length, back, neck], backs, edge_at, side);
    bolt.wide_sleeves(&levels, &WideSleeve { back, sleeve, depth, sewn }, backs, Some(fronts));
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
            form: Form::Open,
            bare: false,
        },
        fabric: None,
    }
}
