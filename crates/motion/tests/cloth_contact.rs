//! Cloth on cloth: layers keep their order, nothing passes, friction holds.

use glam::{Vec2, Vec3};
use yugen_motion::cloth::{Along, Cloth, Fabric, PRESETS, Settings, Sheet, SmallSteps, Solid, Stance, Step};

/// Sheets one above the other, `gap` apart, as one cloth.
fn layers(count: u32, size: f32, cells: u32, gap: f32, height: f32) -> Sheet {
    let mut all = Sheet::default();
    for layer in 0..count {
        let corner = Vec3::new(-0.5 * size, height + layer as f32 * gap, -0.5 * size);
        let mut one = Sheet::rectangle(corner, Vec3::X, Vec3::Z, Vec2::splat(size), [cells; 2]);
        // Panels lie side by side in the flat cloth.
        one.flat.iter_mut().flatten().for_each(|p| p.x += layer as f32 * 2.0 * size);
        all.join(one);
    }
    all
}

fn settings(contact: bool) -> Settings {
    Settings { contact, substeps: 20, ..Settings::default() }
}

#[test]
fn three_layers_keep_their_order_on_a_body() {
    let drop = |contact: bool| {
        let cloth = Cloth::new(layers(3, 0.5, 32, 0.006, 0.16), &PRESETS[0].fabric).unwrap();
        let ball = (Solid::Capsule { ends: [Vec3::ZERO; 2], radii: [0.12; 2] }, Stance::default());
        let ground = (Solid::Ground, Stance { origin: Vec3::NEG_Y * 0.12, ..Stance::default() });
        let solver = SmallSteps::new(cloth, &[], settings(contact)).unwrap();
        let mut solver = solver.with_bodies(vec![ball, ground]).unwrap();
        let mut most = 0;
        for frame in 0..150 {
            solver.step(&Step::default());
            if frame % 5 == 4 {
                most = most.max(solver.cloth().crossings(solver.positions()).len());
            }
        }
        let stretch = solver.cloth().stretch(solver.positions(), |a| a != Along::Bias);
        let rest =
            solver.velocities().map(|v| v.length_squared()).sum::<f32>() / solver.positions().len() as f32;
        println!("contact {contact}: {most} crossings at the most, {stretch:?}, {:.5} m/s", rest.sqrt());
        // Heights of the three at the crown.
        let n = solver.positions().len() / 3;
        let crown = |k: usize| solver.positions()[k * n + 16 * 33 + 16].y;
        (most, [crown(0), crown(1), crown(2)], stretch.p999)
    };
    let (crossings, heights, stretch) = drop(true);
    println!("{heights:?}");
    assert_eq!(crossings, 0);
    assert!(heights[0] < heights[1] && heights[1] < heights[2], "{heights:?}");
    // Measured .075: what keeps vertices from passing keeps springs from their length, too.
    assert!(stretch < 0.15, "{stretch}");
    // Without contact there is plenty to count.
    let (crossings, ..) = drop(false);
    assert!(crossings > 100, "{crossings}");
}

#[test]
fn a_sheet_that_crumples_does_not_pass_through_itself() {
    // It stands on its edge and falls.
    let mut sheet =
        Sheet::rectangle(Vec3::new(-0.2, 0.02, 0.0), Vec3::X, Vec3::Y, Vec2::new(0.4, 0.6), [24, 36]);
    sheet.positions.iter_mut().for_each(|p| p.z = 0.004 * (p.y * 20.0).sin() + 0.002 * (p.x * 33.0).cos());
    let cloth = Cloth::new(sheet, &PRESETS[0].fabric).unwrap();
    let solver = SmallSteps::new(cloth, &[], settings(true)).unwrap();
    let mut solver = solver.with_bodies(vec![(Solid::Ground, Stance::default())]).unwrap();
    for frame in 0..120 {
        solver.step(&Step::default());
        if frame % 5 == 4 {
            let crossings = solver.cloth().crossings(solver.positions()).len();
            assert_eq!(crossings, 0, "frame {frame}");
        }
    }
    let top = solver.positions().iter().map(|p| p.y).fold(0.0, f32::max);
    println!("{top}");
    assert!(top < 0.3, "{top}");
}

#[test]
fn layers_hold_by_friction_or_slide() {
    // Two sheets on the ground; the lower is held, the upper thrown sideways.
    let slid = |friction: f32| {
        let fabric = Fabric { layer_friction: friction, ..PRESETS[1].fabric };
        let mut sheet = layers(2, 0.2, 10, 0.005, 0.0006);
        let n = sheet.positions.len() / 2;
        // Upper corners inside the lower.
        sheet.positions[n..].iter_mut().for_each(|p| *p *= Vec3::new(0.7, 1.0, 0.7));
        sheet.flat.iter_mut().skip(200).for_each(|t| *t = t.map(|p| p * 0.7));
        let cloth = Cloth::new(sheet, &fabric).unwrap();
        let held: Vec<u32> = (0..n as u32).collect();
        let targets: Vec<Vec3> = cloth.sheet.positions[..n].to_vec();
        let mut solver = SmallSteps::new(cloth, &held, settings(true)).unwrap();
        let middle = |s: &SmallSteps| s.positions()[n..].iter().sum::<Vec3>().x / n as f32;
        for _ in 0..30 {
            solver.step(&Step { targets: &targets, ..Step::default() });
        }
        let x = solver.positions().to_vec();
        let v: Vec<Vec3> = (0..x.len()).map(|i| if i < n { Vec3::ZERO } else { Vec3::X * 0.3 }).collect();
        solver.place(&x, &v);
        let before = middle(&solver);
        for _ in 0..10 {
            solver.step(&Step { targets: &targets, ..Step::default() });
        }
        middle(&solver) - before
    };
    let [smooth, rough] = [slid(0.0), slid(0.6)];
    // With friction it stops after v²/(2 μ g).
    println!("without friction {smooth:.4} m, with .6 {rough:.4} m of {:.4}", 0.09 / (2.0 * 0.6 * 9.80665));
    assert!(smooth > 0.035, "{smooth}");
    assert!(rough < 0.012 && rough > 0.0, "{rough}");
}

#[test]
fn contact_has_the_same_bits_for_any_number_of_threads() {
    let run = |threads: usize| {
        let cloth = Cloth::new(layers(2, 0.4, 30, 0.006, 0.11), &PRESETS[0].fabric).unwrap();
        let ball = (Solid::Capsule { ends: [Vec3::ZERO; 2], radii: [0.1; 2] }, Stance::default());
        let solver = SmallSteps::new(cloth, &[], Settings { threads, ..settings(true) }).unwrap();
        let mut solver = solver.with_bodies(vec![ball]).unwrap();
        for _ in 0..20 {
            solver.step(&Step::default());
        }
        solver.positions().to_vec()
    };
    let one = run(1);
    for threads in [2, 3] {
        assert!(run(threads) == one, "{threads} threads");
    }
}

#[test]
fn what_is_held_with_less_than_full_grip_does_not_go_through_other_cloth() {
    // Of two sheets on the ground the middle of the upper is drawn below the lower.
    let pulled = |grip: f32| {
        let sheet = layers(2, 0.3, 12, 0.012, 0.001);
        let n = sheet.positions.len() / 2;
        let middle = |p: &Vec3| p.x.abs() < 0.06 && p.z.abs() < 0.06;
        let held: Vec<u32> = (n..2 * n).filter(|v| middle(&sheet.positions[*v])).map(|v| v as u32).collect();
        let targets: Vec<Vec3> = held.iter().map(|v| sheet.positions[*v as usize] - Vec3::Y * 0.03).collect();
        let cloth = Cloth::new(sheet, &PRESETS[1].fabric).unwrap();
        let solver = SmallSteps::new(cloth, &held, Settings { grip, ..settings(true) }).unwrap();
        let mut solver = solver.with_bodies(vec![(Solid::Ground, Stance::default())]).unwrap();
        let mut most = 0;
        for _ in 0..60 {
            solver.step(&Step { targets: &targets, ..Step::default() });
            most = most.max(solver.cloth().crossings(solver.positions()).len());
        }
        let lowest = solver.positions().iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
        // Where nothing is in the way it is held there.
        let up: Vec<Vec3> = targets.iter().map(|t| *t + Vec3::Y * 0.1).collect();
        for _ in 0..60 {
            solver.step(&Step { targets: &up, ..Step::default() });
        }
        let off = held.iter().zip(&up).map(|(v, t)| solver.positions()[*v as usize].distance(*t));
        (most, lowest, off.fold(0.0, f32::max))
    };
    let [(crossings, lowest, off), (through, deep, _)] = [0.2, 1.0].map(pulled);
    println!(
        "{crossings} crossings, lowest at {lowest} m, {off} m off; {through} and {deep} m with full grip"
    );
    assert_eq!([crossings, through], [0; 2]);
    assert!(off < 0.004 && lowest > -1e-3, "{off} {lowest}");
    // It takes the lower one with it, into the ground.
    assert!(deep < -0.01, "{deep}");
}
