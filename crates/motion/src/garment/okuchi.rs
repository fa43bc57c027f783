//! Okuchi, hangire, hakama: trousers. A width or so of cloth before and behind each leg, four rectangles; seams at the sides, along the
//! inner legs, and before and behind from the waist to where legs part, which is low. All of it is gathered at the waist.

use super::bolt::{Bolt, Levels, edge};
use super::cuts::BELT;
use super::{Form, Garment, Hang, Legs, Side, Wear};

pub(super) fn okuchi(m: &[f32]) -> Garment {
    let [length, front, back, crotch] = *m.as_array().unwrap_or(&[0.0; 4]);
    let levels = Levels::new(vec![0.0, crotch, length]);
    let mut bolt = Bolt::default();
    let mut cut = |name: &str, width: f32, from: f32, left: bool, front: bool| {
        let along = levels.marks(0.0, length, |_| [0.0, width]);
        bolt.cut(name, &[0.0, width], along, Hang::Leg { from, left, front })
    };
    // Seen from outside u runs to the right: on all of them to the wearer's right behind, and to the left before.
    let backs = [cut("left back", back, back, true, false), cut("right back", back, 0.0, false, false)];
    let fronts =
        [cut("left front", front, back + front, true, true), cut("right front", front, -back, false, true)];
    use Side::{Left, Right};
    // The sides, the middles, and the inner legs.
    bolt.sew(edge(backs[0], Left, 0.0, length), edge(fronts[0], Right, 0.0, length));
    bolt.sew(edge(backs[1], Right, 0.0, length), edge(fronts[1], Left, 0.0, length));
    bolt.sew(edge(backs[0], Right, 0.0, crotch), edge(backs[1], Left, 0.0, crotch));
    bolt.sew(edge(fronts[0], Left, 0.0, crotch), edge(fronts[1], Right, 0.0, crotch));
    bolt.sew(edge(backs[0], Right, crotch, length), edge(fronts[0], Left, crotch, length));
    bolt.sew(edge(backs[1], Left, crotch, length), edge(fronts[1], Right, crotch, length));
    Garment {
        name: "okuchi".into(),
        panels: bolt.panels,
        seams: bolt.seams,
        wear: Wear {
            length,
            half: 0.0,
            hem: 0.0,
            sleeve: 0.0,
            armhole: 0.0,
            depth: 0.0,
            cuff: 0.0,
            neck: 0.0,
            belt: [0.0, BELT],
            form: Form::Trousers(Legs { round: front + back, crotch }),
            bare: false,
        },
        fabric: None,
    }
}
