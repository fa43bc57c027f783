//! Cloth on the GPU beside the solver of which it is the twin.

use glam::{Quat, Vec2, Vec3};
use std::sync::Arc;
use yugen_motion::cloth::{Along, Cloth, Fabric, Field, Settings, Sheet, SmallSteps, Solid, Stance, Step};
use yugen_realtime::{ClothPass, Gpu};

/// A second of sixty steps.
const SECOND: u32 = 60;
/// What two seconds may leave between both, m.
const EQUAL: f32 = 1e-4;
/// What a step may, m: four times and more the worst that was seen, where silk is struck.
const ROUNDED: f32 = 3e-5;
/// The same where threads are solved all at once: four times the worst, 9.2e-5, in a step that leaves as much between two runs of the processor
/// that begin 6e-8 m apart; another of its steps leaves 2.6e-3 between those.
const BUCKLED: f32 = 4e-4;
/// What half of the steps may: four times the worst that was seen, where threads are solved all at once.
const MOSTLY: f32 = 2.4e-6;

/// A sheet of `size` metres in so many cells a side, y up.
fn sheet(corner: Vec3, warp: Vec3, size: f32, cells: u32) -> Sheet {
    Sheet::rectangle(corner, Vec3::X, warp, Vec2::splat(size), [cells; 2])
}

fn fabric(name: &str) -> Fabric {
    Fabric::preset(name).expect("a fabric").fabric
}

/// Farthest that two lists of points are apart; what is no number is far.
fn apart(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    let far = |(a, b): (&Vec3, &Vec3)| if a.distance(*b).is_nan() { f32::INFINITY } else { a.distance(*b) };
    a.iter().zip(b).map(far).fold(0.0, f32::max)
}

/// What is asked of a step at a time.
#[derive(Default)]
struct Given {
    wind: Vec3,
    targets: Vec<Vec3>,
    slides: Vec<Vec3>,
    stances: Vec<Stance>,
}

impl Given {
    fn step(&self) -> Step<'_> {
        let Self { wind, targets, slides, stances } = self;
        Step { wind: *wind, targets, slides, stances, ..Step::default() }
    }
}

/// A sheet in cells whose vertices lie `bend` beside a plane: what is quite flat buckles by its rounding.
fn wavy(mut sheet: Sheet, size: f32, bend: Vec3) -> Sheet {
    for (p, t) in sheet.positions.iter_mut().zip(0..) {
        let row = (sheet.triangles.len() as f32 / 2.0).sqrt() as u32 + 1;
        let [u, v] = [t % row, t / row].map(|k| k as f32 / (row - 1) as f32);
        *p += bend * size * (2.5 * u - 0.95).cos() * (3.0 * v - 1.0).cos();
    }
    sheet
}

/// How far both are apart at the most in two seconds, and how far vertices went in the mean, m.
fn both(
    name: &str,
    mut cpu: SmallSteps,
    twin: &SmallSteps,
    given: impl Fn(f32) -> Given,
) -> Option<[f32; 2]> {
    let gpu = Gpu::for_tests()?;
    let mut pass = ClothPass::new(&gpu.device, &gpu.queue, twin).expect("a pass");
    let first = cpu.positions().to_vec();
    assert_eq!(pass.read().expect("a device").positions, first);
    let (mut most, mut far) = (0.0f32, 0.0f32);
    for frame in 1..=2 * SECOND {
        let given = given(frame as f32 / SECOND as f32);
        cpu.step(&given.step());
        pass.step(&given.step());
        most = most.max(apart(&pass.read().expect("a device").positions, cpu.positions()));
        let way = first.iter().zip(cpu.positions()).map(|(a, b)| a.distance(*b)).sum::<f32>();
        far = far.max(way / first.len() as f32);
    }
    println!("{name}: {} vertices, {most:.1e} m apart, {far:.2} m gone", first.len());
    Some([most, far])
}

/// Hemp that hangs from two corners in the wind and is swung.
fn swung(stiffer: f32) -> (SmallSteps, impl Fn(f32) -> Given) {
    let cells = 40;
    let mut sheet = sheet(Vec3::new(-0.3, 0.0, 0.0), Vec3::NEG_Y, 0.6, cells);
    for p in &mut sheet.positions {
        // Bowed, the more the lower.
        p.z += 0.05 * (2.5 * p.x / 0.6 + 0.3).cos() * (1.0 - p.y / 0.6);
    }
    let held = [0, cells];
    let ends = held.map(|v| sheet.positions[v as usize]);
    let mut fabric = fabric("hemp");
    fabric.bending_warp *= stiffer;
    let cloth = Cloth::new(sheet, &fabric).expect("a cloth");
    let solver = SmallSteps::new(cloth, &held, Settings::default()).expect("a solver");
    let given = move |time: f32| Given {
        wind: WIND,
        targets: ends.map(|p| p + Vec3::Z * 0.2 * (1.0 - (3.0 * time).cos())).to_vec(),
        ..Given::default()
    };
    (solver, given)
}

const WIND: Vec3 = Vec3::new(0.2, 0.0, 0.5);

#[test]
fn a_sheet_that_swings_is_where_the_processor_has_it() {
    let (solver, given) = swung(1.0);
    // Strips with a border between them, and a coarse level.
    let rows = solver.rows();
    assert!(rows.tasks[0].len() > 1 && !rows.levels.is_empty());
    assert!(rows.tasks[1].iter().any(|t| !t.springs.is_empty() && !t.hinges.is_empty()));
    let Some([most, far]) = both("swung", swung(1.0).0, &solver, given) else { return };
    assert!(most < EQUAL && far > 0.3, "{most} {far}");
}

#[test]
fn another_fabric_is_seen() {
    let (solver, given) = swung(1.0);
    let Some([most, _]) = both("a hundredth stiffer", solver, &swung(1.01).0, given) else { return };
    assert!(most > 2.0 * EQUAL, "{most}");
}

/// A square of hemp above a ball on a floor.
fn falling() -> SmallSteps {
    let sheet = wavy(sheet(Vec3::new(-0.25, 0.35, -0.25), Vec3::Z, 0.5, 24), 0.5, Vec3::Y * 0.04);
    let cloth = Cloth::new(sheet, &fabric("hemp")).expect("a cloth");
    let ball = Solid::Capsule { ends: [Vec3::ZERO, Vec3::X * 0.1], radii: [0.3, 0.25] };
    let floor = Stance { origin: Vec3::Y * -0.1, ..Stance::default() };
    let bodies = vec![(ball, Stance::default()), (Solid::Ground, floor)];
    let solver = SmallSteps::new(cloth, &[], Settings::default()).expect("a solver");
    solver.with_bodies(bodies).expect("bodies")
}

#[test]
fn a_sheet_that_falls_on_a_ball_lies_where_the_processor_has_it() {
    let Some([most, far]) = both("fallen", falling(), &falling(), |_| Given::default()) else { return };
    assert!(most < EQUAL && far > 0.1, "{most} {far}");
}

#[test]
fn a_sheet_on_a_ball_that_moves_goes_along_as_on_the_processor() {
    let given = |time: f32| {
        let origin = Vec3::X * 0.05 * (1.0 - (2.0 * time).cos());
        let ball = Stance { origin, rotation: Quat::from_rotation_y(0.3 * time) };
        let floor = Stance { origin: Vec3::Y * -0.1, ..Stance::default() };
        Given { stances: vec![ball, floor], ..Given::default() }
    };
    let Some([most, far]) = both("carried", falling(), &falling(), given) else { return };
    assert!(most < EQUAL && far > 0.15, "{most} {far}");
}

/// A box as a field.
fn block(half: Vec3) -> Solid {
    let corner =
        |i: usize| Vec3::from_array([0, 1, 2].map(|k| if i >> k & 1 == 1 { half[k] } else { -half[k] }));
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<[u32; 3]> =
        faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect();
    let corners: Vec<Vec3> = (0..8).map(corner).collect();
    Solid::Field(Arc::new(Field::new(&corners, &triangles, 0.02).expect("a field")))
}

/// How far both are apart at the most after one step, and after half of them, each from where the processor is: for what buckles, so that in two seconds a rounding
/// becomes a fold.
fn step_by_step(name: &str, mut cpu: SmallSteps, given: impl Fn(f32) -> Given) -> Option<[f32; 2]> {
    let gpu = Gpu::for_tests()?;
    let mut pass = ClothPass::new(&gpu.device, &gpu.queue, &cpu).expect("a pass");
    let mut most = [0.0f32; 2];
    let mut all = Vec::new();
    for frame in 1..=2 * SECOND {
        assert!(pass.resume(&cpu));
        let given = given(frame as f32 / SECOND as f32);
        cpu.step(&given.step());
        pass.step(&given.step());
        let state = pass.read().expect("a device");
        let velocities: Vec<Vec3> = cpu.velocities().collect();
        let now = [apart(&state.positions, cpu.positions()), apart(&state.velocities, &velocities)];
        most = [0, 1].map(|k| now[k].max(most[k]));
        all.push(now[0]);
    }
    all.sort_by(f32::total_cmp);
    println!(
        "{name}: {:.1e} m and {:.1e} m/s apart after a step, half of them {:.1e} m",
        most[0],
        most[1],
        all[all.len() / 2]
    );
    Some([most[0], all[all.len() / 2]])
}

#[test]
fn steps_among_bodies_are_those_of_the_processor() {
    for (coarse, lines) in [(true, false), (false, false), (true, true)] {
        let cells = 64;
        let sheet = sheet(Vec3::new(-0.5, 0.5, -0.5), Vec3::Z, 1.0, cells);
        let held = [0, cells];
        let ends = held.map(|v| sheet.positions[v as usize]);
        let cloth = Cloth::new(sheet, &fabric("silk")).expect("a cloth");
        let settings = Settings { coarse, lines, substeps: 12, ..Settings::default() };
        let arm = Solid::Capsule { ends: [Vec3::ZERO, Vec3::X], radii: [0.05, 0.02] };
        let still = Stance::default();
        let bodies = vec![(Solid::Ground, still), (block(Vec3::new(0.2, 0.1, 0.15)), still), (arm, still)];
        let solver = SmallSteps::new(cloth, &held, settings).expect("a solver").with_bodies(bodies);
        let given = |time: f32| {
            let turn = Quat::from_rotation_z(4.0 * time);
            let floor = Stance { origin: Vec3::Y * -0.3, ..still };
            let thrust = Stance { origin: Vec3::Y * (0.5 * (5.0 * time).sin()), rotation: turn };
            let strike =
                Stance { origin: Vec3::new(-0.5, 0.3, 0.2), rotation: Quat::from_rotation_y(6.0 * time) };
            Given {
                wind: WIND,
                targets: ends.map(|p| p + Vec3::Y * 0.1 * (7.0 * time).sin()).to_vec(),
                stances: vec![floor, thrust, strike],
                ..Given::default()
            }
        };
        let solver = solver.expect("bodies");
        let rows = solver.rows();
        assert_eq!(rows.levels.len(), if coarse { 2 } else { 0 });
        assert_eq!(rows.lines.each_ref().map(Vec::len), [if lines { cells as usize + 1 } else { 0 }; 2]);
        let Some([most, half]) = step_by_step("struck", solver, given) else { return };
        assert!(most < if lines { BUCKLED } else { ROUNDED } && half < MOSTLY, "{most} {half}");
    }
}

#[test]
fn what_a_grip_lets_slide_does_so_as_on_the_processor() {
    let cells = 32;
    let sheet = sheet(Vec3::new(-0.3, 0.0, 0.0), Vec3::NEG_Y, 0.6, cells);
    // One of them twice, and half of them without a way to slide.
    let held: Vec<u32> = (0..=cells).map(|i| 5 * (cells + 1) + i).chain([5 * (cells + 1)]).collect();
    let places: Vec<Vec3> = held.iter().map(|v| sheet.positions[*v as usize]).collect();
    let cloth = Cloth::new(sheet, &fabric("karaori")).expect("a cloth");
    let settings = Settings { grip: 0.6, ..Settings::default() };
    let solver = SmallSteps::new(cloth, &held, settings).expect("a solver");
    let given = |time: f32| Given {
        targets: places.iter().map(|p| *p + Vec3::Z * 0.3 * (4.0 * time).sin()).collect(),
        slides: vec![Vec3::Y; 16],
        ..Given::default()
    };
    let Some([most, half]) = step_by_step("gripped", solver, given) else { return };
    assert!(most < ROUNDED && half < MOSTLY, "{most} {half}");
}

#[test]
fn vertices_are_shown_with_normals() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut pass = ClothPass::new(&gpu.device, &gpu.queue, &falling()).expect("a pass");
    for _ in 0..30 {
        pass.step(&Step::default());
    }
    let state = pass.read().expect("a device");
    let [positions, normals] = pass.read_vertices().expect("a device");
    assert_eq!(positions, state.positions);
    let solver = falling();
    let mut sums = vec![Vec3::ZERO; positions.len()];
    for t in &solver.cloth().sheet.triangles {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        t.iter().for_each(|v| sums[*v as usize] += (b - a).cross(c - a));
    }
    for (normal, sum) in normals.iter().zip(sums) {
        assert!(normal.distance(sum.normalize()) < 1e-4, "{normal} {sum}");
    }
}

/// Squares above each other, `gap` apart, the lowest at `height`.
fn layers(count: u32, size: f32, cells: u32, gap: f32, height: f32) -> Sheet {
    let mut all = Sheet::default();
    for k in 0..count {
        let corner = Vec3::new(-0.5 * size, height + gap * k as f32, -0.5 * size);
        let mut one = sheet(corner, Vec3::Z, size, cells);
        one.flat.iter_mut().flatten().for_each(|p| p.x += 2.0 * k as f32);
        all.join(one);
    }
    all
}

/// Three sheets of silk above a ball.
fn stacked(contact: bool) -> SmallSteps {
    let cloth = Cloth::new(layers(3, 0.5, 14, 0.01, 0.16), &fabric("silk")).expect("a cloth");
    let settings = Settings { contact, lines: true, ..Settings::default() };
    let ball = Solid::Capsule { ends: [Vec3::ZERO; 2], radii: [0.15; 2] };
    let solver = SmallSteps::new(cloth, &[], settings).expect("a solver");
    solver.with_bodies(vec![(ball, Stance::default())]).expect("a body")
}

#[test]
fn layers_keep_their_order_with_the_same_bits_every_time() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut cpu = stacked(true);
    let mut passes = [(); 2].map(|()| ClothPass::new(&gpu.device, &gpu.queue, &cpu).expect("a pass"));
    let mut loose = stacked(false);
    let n = cpu.positions().len() / 3;
    let mut most = [0; 2];
    for frame in 0..40 {
        cpu.step(&Step::default());
        loose.step(&Step::default());
        passes[0].step(&Step::default());
        let [found, least] = [passes[0].read().expect("a device").positions, loose.positions().to_vec()];
        let crossed = [&found, &least].map(|x| cpu.cloth().crossings(x).len());
        most = [0, 1].map(|k| crossed[k].max(most[k]));
        if frame < 12 {
            passes[1].step(&Step::default());
            assert!(passes[1].read().expect("a device").positions == found, "frame {frame}");
        }
        // Each layer above the one before over the ball's middle, and where the processor has it.
        let top = |x: &[Vec3], k: usize| x[k * n + n / 2].y;
        for k in 0..3 {
            let [own, its] = [top(&found, k), top(cpu.positions(), k)];
            assert!((own - its).abs() < 1e-3, "frame {frame}, layer {k}: {own} and {its} m");
        }
    }
    let long = |x: &[Vec3]| cpu.cloth().elongation(x, |s| s.along != Along::Bias);
    let found = passes[0].read().expect("a device").positions;
    println!(
        "stacked: {most:?} crossings with and without contact, {:.4} and {:.4} longer",
        long(&found),
        long(cpu.positions())
    );
    assert_eq!(most[0], 0);
    assert!(most[1] > 100, "{most:?}");
    assert_eq!(passes[0].missed(), Ok(0));
}

#[test]
fn layers_hold_by_friction_as_on_the_processor() {
    let Some(gpu) = Gpu::for_tests() else { return };
    // The lower of two is held, the upper thrown sideways.
    let slid = |friction: f32| {
        let fabric = Fabric { layer_friction: friction, ..fabric("hemp") };
        let mut sheet = layers(2, 0.2, 10, 0.005, 0.0);
        let n = sheet.positions.len() / 2;
        sheet.positions[n..].iter_mut().for_each(|p| *p *= Vec3::new(0.7, 1.0, 0.7));
        sheet.flat.iter_mut().skip(200).for_each(|t| *t = t.map(|p| p * 0.7));
        let cloth = Cloth::new(sheet, &fabric).expect("a cloth");
        let held: Vec<u32> = (0..n as u32).collect();
        let targets: Vec<Vec3> = cloth.sheet.positions[..n].to_vec();
        let settings = Settings { contact: true, ..Settings::default() };
        let mut solver = SmallSteps::new(cloth, &held, settings).expect("a solver");
        let step = Step { targets: &targets, ..Step::default() };
        (0..30).for_each(|_| solver.step(&step));
        let x = solver.positions().to_vec();
        let thrown = |i: usize| if i < n { Vec3::ZERO } else { Vec3::X * 0.3 };
        solver.place(&x, &(0..x.len()).map(thrown).collect::<Vec<Vec3>>());
        let mut pass = ClothPass::new(&gpu.device, &gpu.queue, &solver).expect("a pass");
        for _ in 0..10 {
            solver.step(&step);
            pass.step(&step);
        }
        let middle = |x: &[Vec3]| x[n..].iter().sum::<Vec3>().x / n as f32;
        let before = middle(&x);
        [middle(&pass.read().expect("a device").positions) - before, middle(solver.positions()) - before]
    };
    let [smooth, rough] = [slid(0.0), slid(0.6)];
    // With friction it stops after v²/(2 μ g).
    println!(
        "slid: without friction {smooth:.4?} m, with .6 {rough:.4?} m of {:.4}",
        0.09 / (2.0 * 0.6 * 9.80665)
    );
    assert!(smooth[0] > 0.035, "{smooth:?}");
    assert!((rough[0] - rough[1]).abs() < 2e-3, "{rough:?}");
}

#[test]
fn a_solver_goes_on_from_where_the_cloth_is() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut solver = stacked(true);
    let mut pass = ClothPass::new(&gpu.device, &gpu.queue, &solver).expect("a pass");
    for _ in 0..3 {
        pass.step(&Step::default());
    }
    let now = pass.now().expect("a device");
    assert!(solver.go_on(&now) && solver.now() == now);
    assert!(solver.positions() == pass.read().expect("a device").positions);
    let other = falling();
    assert!(!solver.go_on(&other.now()) && solver.now() == now);
}
