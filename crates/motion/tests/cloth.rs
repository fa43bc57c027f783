//! Cloth against what is known of it: catenary, pendulum, oscillator, cantilever, Hooke.

use glam::{Vec2, Vec3};
use std::f64::consts::PI;
use yugen_motion::cloth::{
    Along, Cloth, ClothError, Fabric, Hinge, PRESETS, Provot, Settings, Sheet, SmallSteps, Spring, Step,
};

/// Either solver.
enum Solver {
    Small(Box<SmallSteps>),
    Provot(Box<Provot>),
}

impl Solver {
    fn both(cloth: &Cloth, attached: &[u32], seconds: f32, substeps: u32) -> [(&'static str, Self); 2] {
        let settings = Settings { seconds, substeps, ..Settings::default() };
        let small = SmallSteps::new(cloth.clone(), attached, settings).unwrap();
        let provot = Provot::new(cloth.clone(), attached, seconds, 1).unwrap().at_least(substeps);
        [("small steps", Self::Small(Box::new(small))), ("Provot", Self::Provot(Box::new(provot)))]
    }

    fn step(&mut self, step: &Step) {
        match self {
            Self::Small(s) => s.step(step),
            Self::Provot(s) => s.step(step),
        }
    }

    /// Takes a twentieth of the velocities: what searches for rest need not wait for it.
    fn calm(&mut self) {
        let (x, v) = (self.positions().to_vec(), self.velocities());
        let v: Vec<Vec3> = v.into_iter().map(|v| v * 0.95).collect();
        match self {
            Self::Small(s) => s.place(&x, &v),
            Self::Provot(s) => s.place(&x, &v),
        }
    }

    fn positions(&self) -> &[Vec3] {
        match self {
            Self::Small(s) => s.positions(),
            Self::Provot(s) => s.positions(),
        }
    }

    fn velocities(&self) -> Vec<Vec3> {
        match self {
            Self::Small(s) => s.velocities().collect(),
            Self::Provot(s) => s.velocities().to_vec(),
        }
    }
}

fn spring(a: u32, b: u32, rest: f32, stiffness: f32) -> Spring {
    Spring { ends: [a, b], rest, stiffness, damper: 0.0, limit: f32::INFINITY, along: Along::Warp }
}

fn by_hand(positions: Vec<Vec3>, mass: f32, springs: Vec<Spring>, hinges: Vec<Hinge>) -> Cloth {
    let masses = vec![mass; positions.len()];
    Cloth { sheet: Sheet { positions, ..Sheet::default() }, masses, springs, hinges, ..Cloth::default() }
}

/// Seconds between zero crossings, in one direction, of a function of time sampled every `dt`; the mean of those seen.
fn period(samples: &[f64], dt: f64) -> f64 {
    let up = samples.windows(2).enumerate().filter(|(_, w)| w[0] < 0.0 && w[1] >= 0.0);
    let crossings: Vec<f64> = up.map(|(i, w)| (i as f64 + w[0] / (w[0] - w[1])) * dt).collect();
    assert!(crossings.len() > 1, "no period in {} samples", samples.len());
    (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64
}

#[test]
fn a_chain_and_a_strip_hang_as_a_catenary() {
    // Length 1.2 over a chord of 1: a = .469541523, sag .292343798; here 100 segments.
    let n = 100u32;
    // A parabola of about the length, so that it need not fall far.
    let parabola = |t: f32, z: f32| Vec3::new(t, 1.2 * t * (t - 1.0), z);
    let rest = 1.2 / n as f32;
    let springs = (0..n).map(|i| Spring { damper: 0.05, ..spring(i, i + 1, rest, 60_000.0) }).collect();
    let at = |i: u32| parabola(i as f32 / n as f32, 0.0);
    let chain = by_hand((0..=n).map(at).collect(), 0.001, springs, Vec::new());
    let ends = vec![0, n];
    let provot = Provot::new(chain.clone(), &ends, 1.0 / 60.0, 1).unwrap();
    let fabric = Fabric { weft: 1e6, bending_warp: 0.0, bending_weft: 0.0, limit: 0.0, ..PRESETS[1].fabric };
    let mut sheet = Sheet::rectangle(Vec3::ZERO, Vec3::X, Vec3::Z, Vec2::new(1.2, rest), [n, 1]);
    sheet.positions.iter_mut().for_each(|p| *p = parabola(p.x / 1.2, p.z));
    let strip = Cloth::new(sheet, &fabric).unwrap();
    let corners = vec![0, n, n + 1, 2 * n + 1];
    let small =
        SmallSteps::new(strip.clone(), &corners, Settings { substeps: 80, ..Settings::default() }).unwrap();
    let small = ("small steps", Solver::Small(Box::new(small)), strip, corners);
    for (name, mut solver, cloth, held) in [small, ("Provot", Solver::Provot(Box::new(provot)), chain, ends)]
    {
        let targets: Vec<Vec3> = held.iter().map(|v| cloth.sheet.positions[*v as usize]).collect();
        for _ in 0..600 {
            solver.step(&Step { targets: &targets, ..Step::default() });
            solver.calm();
        }
        let sag = -f64::from(solver.positions().iter().map(|p| p.y).fold(0.0, f32::min));
        let stretch = cloth.stretch(solver.positions(), |a| a != Along::Bias);
        println!("{name}: sag {sag:.6}, {stretch:?}");
        assert!((sag / 0.292_343_798 - 1.0).abs() < 0.005, "{name}: {sag}");
    }
}

#[test]
fn pendulums_swing_as_elliptic_integrals_say() {
    let dt = 1.0 / 60.0;
    let small = 2.0 * PI * (1.0 / 9.80665f64).sqrt();
    for (degrees, ratio) in [(10.0f32, 1.001_91), (30.0, 1.017_41), (60.0, 1.073_18), (90.0, 1.180_34)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let positions = vec![Vec3::ZERO, Vec3::new(sin, -cos, 0.0)];
        let cloth = by_hand(positions, 0.1, vec![spring(0, 1, 1.0, 20_000.0)], Vec::new());
        // Large swings lose more to implicit steps, small ones more to the rounding of short steps.
        let substeps = if degrees < 45.0 { 30 } else { 80 };
        for (name, mut solver) in Solver::both(&cloth, &[0], dt as f32, substeps) {
            let samples: Vec<f64> = (0..120)
                .map(|_| {
                    solver.step(&Step { targets: &[Vec3::ZERO], ..Step::default() });
                    f64::from(solver.positions()[1].x)
                })
                .collect();
            // From the first passage to the second: what an implicit step loses makes later ones shorter.
            let passes = samples.windows(2).enumerate().filter(|(_, w)| (w[0] < 0.0) != (w[1] < 0.0));
            let at: Vec<f64> = passes.map(|(i, w)| (i as f64 + w[0] / (w[0] - w[1])) * dt).take(2).collect();
            let found = 2.0 * (at[1] - at[0]) / small;
            println!("{name}: {degrees}°: {found:.5}, {ratio:.5}");
            assert!((found / ratio - 1.0).abs() < 0.002, "{name}: {degrees}°: {found}");
        }
    }
}

#[test]
fn an_oscillator_has_its_damped_frequency() {
    let (m, k, c) = (0.1f64, 40.0f64, 0.4f64);
    let omega = (k / m - (c / (2.0 * m)).powi(2)).sqrt();
    let dt = 1.0 / 240.0;
    // Without weight: a step of its length from 1.02 to 1, along itself.
    let positions = vec![Vec3::ZERO, Vec3::new(1.02, 0.0, 0.0)];
    let damped = Spring { damper: c as f32, ..spring(0, 1, 1.0, k as f32) };
    let cloth = by_hand(positions, m as f32, vec![damped], Vec::new());
    for (name, mut solver) in Solver::both(&cloth, &[0], dt as f32, 8) {
        let samples: Vec<f64> = (0..360)
            .map(|_| {
                solver.step(&Step { targets: &[Vec3::ZERO], gravity: Vec3::ZERO, ..Step::default() });
                f64::from(solver.positions()[1].x) - 1.0
            })
            .collect();
        let found = 2.0 * PI / period(&samples, dt);
        let decay = |i: usize| samples[i..].iter().take(96).fold(0.0, |a: f64, b| a.max(b.abs()));
        let rate = (decay(0) / decay(192)).ln() / 0.8;
        println!("{name}: {found:.4} of {omega:.4} rad/s, decay {rate:.4} of {:.4} /s", c / (2.0 * m));
        assert!((found / omega - 1.0).abs() < 0.005, "{name}: {found}");
        assert!((rate * 2.0 * m / c - 1.0).abs() < 0.1, "{name}: {rate}");
    }
}

#[test]
fn energy_is_kept_or_lost_but_not_made() {
    // A pendulum from the horizontal, over ten seconds.
    let cloth = by_hand(vec![Vec3::ZERO, Vec3::X], 0.1, vec![spring(0, 1, 1.0, 20_000.0)], Vec::new());
    let gravity = Step::default().gravity;
    for (name, mut solver) in Solver::both(&cloth, &[0], 1.0 / 60.0, 20) {
        let mut energies = Vec::new();
        for _ in 0..600 {
            solver.step(&Step { targets: &[Vec3::ZERO], ..Step::default() });
            let energy = cloth.energy(solver.positions(), solver.velocities(), gravity);
            // From the deepest that it can come, a metre below.
            energies.push(1.0 + energy.sum() / (0.1 * 9.80665));
        }
        let (first, last) = (energies[0], energies[599]);
        let highest = energies.iter().copied().fold(0.0, f64::max);
        println!(
            "{name}: {last:.5} left after 10 s, half-life {:.0} s",
            10.0 * 0.5f64.ln() / (last / first).ln()
        );
        assert!(highest < first * 1.004, "{name} made energy: {highest}");
        // Of the symplectic baseline all but nothing goes; the default loses as implicit steps do, and the finer the less.
        let most = if name == "Provot" { 0.01 } else { 0.25 };
        assert!(last > first * (1.0 - most), "{name}: {last}");
    }
}

/// A strip that sticks out over an edge by `length`, in so many cells and half a one: its first two rows are clamped, and the
/// bend at the second stands for half a cell on either side, so that the edge lies in the middle between both.
fn cantilever(bending: f32, length: f32, cells: u32) -> (Cloth, Vec<u32>) {
    let fabric =
        Fabric { bending_warp: bending, bending_weft: bending, warp: 5e3, weft: 5e3, ..PRESETS[0].fabric };
    let cell = length / (cells as f32 + 0.5);
    let across = (0.02 / cell).round().max(2.0);
    let size = Vec2::new(across, (cells + 1) as f32) * cell;
    let corner = Vec3::new(0.0, 0.0, -0.5 * cell);
    let across = across as u32;
    let sheet = Sheet::rectangle(corner, Vec3::X, Vec3::Z, size, [across, cells + 1]);
    (Cloth::new(sheet, &fabric).unwrap(), (0..2 * (across + 1)).collect())
}

/// Angle below the horizontal of the chord of an elastica of bending length `c` and length `l` under its own weight: by
/// shooting, from the free end.
fn elastica(c: f64, l: f64) -> f64 {
    // EI θ'' = −W s cos θ with s from the free end; EI = W c³; θ'(0) = 0, θ(l) = 0.
    let shoot = |free: f64| {
        let n = 4000;
        let h = l / f64::from(n);
        let f = |s: f64, t: f64| -s * t.cos() / c.powi(3);
        let (mut t, mut u, mut x, mut y) = (free, 0.0, 0.0, 0.0);
        for i in 0..n {
            let s = f64::from(i) * h;
            // Midpoint.
            let (tm, um) = (t + 0.5 * h * u, u + 0.5 * h * f(s, t));
            x += h * tm.cos();
            y += h * tm.sin();
            t += h * um;
            u += h * f(s + 0.5 * h, tm);
        }
        (t, y.atan2(x))
    };
    let (mut low, mut high) = (0.0, PI / 2.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if shoot(middle).0 < 0.0 { low = middle } else { high = middle }
    }
    shoot(low).1
}

#[test]
fn a_strip_bends_by_its_bending_length() {
    let c = 0.03f32;
    // Peirce: c = l f(θ), f(41.5°) = .509, and one half at .5.
    let length = c / 0.509;
    let truth = elastica(c.into(), length.into()).to_degrees();
    println!("elastica: {truth:.2}°, Peirce 41.5°");
    assert!((truth - 41.5).abs() < 2.0, "{truth}");
    let mut worst = [0.0f64; 2];
    for cells in [4, 8, 16] {
        let (cloth, attached) = cantilever(c, length, cells);
        let targets: Vec<Vec3> = attached.iter().map(|v| cloth.sheet.positions[*v as usize]).collect();
        let settings = Settings { seconds: 1.0 / 240.0, substeps: 20, ..Settings::default() };
        let solver = SmallSteps::new(cloth, &attached, settings).unwrap();
        assert_eq!(solver.softened(), 0.0);
        let mut solver = Solver::Small(Box::new(solver));
        for _ in 0..720 {
            solver.step(&Step { targets: &targets, ..Step::default() });
            solver.calm();
        }
        let n = solver.positions().len();
        let tip = solver.positions()[n - 2];
        // Of the middle of the clamped edge.
        let angle = f64::from(-tip.y).atan2(f64::from(tip.z));
        let f = |t: f64| ((t / 2.0).cos() / (8.0 * t.tan())).cbrt();
        let found = f64::from(length) * f(angle);
        println!("{cells} cells: {:.2}°, c = {found:.5}", angle.to_degrees());
        worst = [
            worst[0].max((found / f64::from(c) - 1.0).abs()),
            worst[1].max((angle.to_degrees() / truth - 1.0).abs()),
        ];
    }
    assert!(worst[0] < 0.03 && worst[1] < 0.05, "{worst:?}");
}

#[test]
fn a_sheet_stretched_both_ways_obeys_hooke() {
    [false, true].into_iter().for_each(stretch_both_ways);
}

fn stretch_both_ways(lines: bool) {
    let fabric = Fabric { limit: 1.0, bias_limit: 1.0, ..PRESETS[1].fabric };
    let n = 20u32;
    let sheet = Sheet::rectangle(Vec3::ZERO, Vec3::X, Vec3::Y, Vec2::new(0.5, 0.4), [n, n]);
    let cloth = Cloth::new(sheet, &fabric).unwrap();
    let row = n + 1;
    let edge: Vec<u32> =
        (0..row * row).filter(|v| [0, n].contains(&(v % row)) || [0, n].contains(&(v / row))).collect();
    let strain = Vec3::new(0.02, 0.01, 0.0);
    let targets: Vec<Vec3> =
        edge.iter().map(|v| cloth.sheet.positions[*v as usize]).map(|p| p * (strain + 1.0)).collect();
    // One pass leaves a hundredth of the strain where it should not be; it goes with the square of the substep.
    let settings = Settings { substeps: 80, lines, ..Settings::default() };
    let mut solver = SmallSteps::new(cloth.clone(), &edge, settings).unwrap();
    for _ in 0..240 {
        solver.step(&Step { targets: &targets, gravity: Vec3::ZERO, ..Step::default() });
    }
    let x = solver.positions();
    // What lies inside has followed: a displacement of 1 cm, within what one pass leaves, .23 mm here.
    let away = x.iter().zip(&cloth.sheet.positions).map(|(x, p)| x.distance(*p * (strain + 1.0)));
    let worst = away.fold(0.0, f32::max);
    assert!(worst < 5e-4, "{worst}");
    // Mean tension for a width of one, by the virial theorem: forces times lengths over the area.
    let area = 0.5 * 0.4 * (1.0 + strain.x) * (1.0 + strain.y);
    let tension = |axis: usize| {
        let of = |s: &Spring| {
            let d = x[s.ends[1] as usize] - x[s.ends[0] as usize];
            s.stiffness * (d.length() - s.rest) * d[axis] * d[axis] / d.length()
        };
        cloth.springs.iter().map(of).sum::<f32>() / area * (1.0 + strain[1 - axis])
    };
    let (weft, warp) = (tension(0), tension(1));
    // A spring network has a Poisson coupling as large as its shear modulus.
    let hooke =
        [fabric.weft * strain.x + fabric.shear * strain.y, fabric.warp * strain.y + fabric.shear * strain.x];
    println!("lines {lines}: weft {weft:.3} of {:.3} N/m, warp {warp:.3} of {:.3}", hooke[0], hooke[1]);
    for (found, hooke) in [weft, warp].into_iter().zip(hooke) {
        assert!((found / hooke - 1.0).abs() < 0.01, "{found} {hooke}");
    }
}

/// A sheet that hangs from its first row or its first corners.
fn hanging(cells: u32, row: bool, settings: Settings) -> (SmallSteps, Vec<Vec3>) {
    let corner = Vec3::new(-0.5, 2.0, 0.0);
    let sheet = Sheet::rectangle(corner, Vec3::X, Vec3::Z, Vec2::ONE, [cells, cells]);
    let cloth = Cloth::new(sheet, &PRESETS[0].fabric).unwrap();
    let attached: Vec<u32> = if row { (0..=cells).collect() } else { vec![0, cells] };
    let targets = attached.iter().map(|v| cloth.sheet.positions[*v as usize]).collect();
    (SmallSteps::new(cloth, &attached, settings).unwrap(), targets)
}

#[test]
fn coarse_levels_carry_what_one_pass_does_not() {
    let strain = |coarse: bool| {
        let (mut solver, targets) =
            hanging(64, true, Settings { substeps: 12, coarse, ..Settings::default() });
        for _ in 0..150 {
            solver.step(&Step { targets: &targets, ..Step::default() });
        }
        solver.cloth().stretch(solver.positions(), |a| a != Along::Bias).p999
    };
    let [with, without] = [true, false].map(strain);
    println!("p99.9 stretch {with:.4}, without coarse levels {without:.4}");
    assert!(with < 0.03 && without > 0.08, "{with} {without}");
}

#[test]
fn lines_keep_threads_from_stretching() {
    // A sheet falls from the horizontal and hangs from two corners; the worst of a second.
    let strain = |lines: bool| {
        let (mut solver, targets) = hanging(64, false, Settings { lines, ..Settings::default() });
        let worst = (0..60).map(|_| {
            solver.step(&Step { targets: &targets, ..Step::default() });
            solver.cloth().elongation(solver.positions(), |s| s.along != Along::Bias)
        });
        worst.fold(0.0, f32::max)
    };
    let [with, without] = [true, false].map(strain);
    println!("p99.9 elongation {with:.4}, without lines {without:.4}");
    // Measured .023 and .068.
    assert!(with < 0.04 && without > 0.05, "{with} {without}");
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    [false, true].into_iter().for_each(run_by_threads);
}

fn run_by_threads(lines: bool) {
    let run = |threads: usize| {
        let (mut solver, targets) = hanging(72, false, Settings { threads, lines, ..Settings::default() });
        for frame in 0..40 {
            let wind = Vec3::new(0.0, 0.0, if frame > 20 { 6.0 } else { 0.0 });
            solver.step(&Step { targets: &targets, wind, ..Step::default() });
        }
        solver.positions().to_vec()
    };
    let one = run(1);
    assert!(one.iter().all(|p| p.is_finite()));
    for threads in [2, 3, 5] {
        assert!(run(threads) == one, "{threads} threads");
    }
}

#[test]
fn a_free_cloth_keeps_its_momentum() {
    [false, true].into_iter().for_each(fly_apart);
}

fn fly_apart(lines: bool) {
    let sheet = Sheet::rectangle(Vec3::ZERO, Vec3::X, Vec3::Z, Vec2::new(0.5, 0.6), [24, 28]);
    let cloth = Cloth::new(sheet, &Fabric { areal_mass: 5.0, ..PRESETS[2].fabric }).unwrap();
    let mut solver = SmallSteps::new(cloth.clone(), &[], Settings { lines, ..Settings::default() }).unwrap();
    // Two halves pulled apart and one corner thrown up.
    let velocity = |p: &Vec3| Vec3::new(4.0 * (p.x - 0.25), if p.x + p.z > 0.9 { 1.0 } else { 0.0 }, 0.5);
    let v: Vec<Vec3> = cloth.sheet.positions.iter().map(velocity).collect();
    let of =
        |v: &mut dyn Iterator<Item = Vec3>| cloth.masses.iter().zip(v).map(|(m, v)| v * *m).sum::<Vec3>();
    let before = of(&mut v.iter().copied());
    solver.place(&cloth.sheet.positions, &v);
    let mass: f32 = cloth.masses.iter().sum();
    // A still cloth in air slows down; for a tenth of a second that is less than what is compared.
    for _ in 0..2 {
        solver.step(&Step { gravity: Vec3::ZERO, ..Step::default() });
    }
    let after = of(&mut solver.velocities());
    println!("{before} {after}, mass {mass}");
    assert!((after - before).length() < 0.01 * before.length());
}

#[test]
fn what_is_no_cloth_is_told_in_a_sentence() {
    let fabric = PRESETS[0].fabric;
    let sheet = Sheet::rectangle(Vec3::ZERO, Vec3::X, Vec3::Z, Vec2::ONE, [2, 2]);
    let with = |change: &dyn Fn(&mut Sheet)| {
        let mut sheet = sheet.clone();
        change(&mut sheet);
        Cloth::new(sheet, &fabric).map(|_| ()).unwrap_err().to_string()
    };
    for (says, change) in [
        ("without triangles", (&|s: &mut Sheet| s.triangles.clear()) as &dyn Fn(&mut Sheet)),
        ("without vertices", &|s| s.positions.clear()),
        ("one for each of its triangles", &|s| s.flat.truncate(3)),
        ("triangle 1 of a cloth names vertex 99", &|s| s.triangles[1][2] = 99),
        ("vertex 4 of a cloth is", &|s| s.positions[4].y = f32::NAN),
        ("finite numbers within 1e6", &|s| s.positions[4].y = 1e7),
        ("triangle 0 of a cloth has no area", &|s| s.flat[0] = [Vec2::ZERO; 3]),
        ("names a vertex twice", &|s| s.triangles[0][1] = s.triangles[0][0]),
        ("wind all triangles of a cloth alike", &|s| s.triangles[0].swap(0, 1)),
        ("in no triangle", &|s| s.positions.push(Vec3::ONE)),
    ] {
        let said = with(change);
        assert!(said.contains(says), "{said}");
    }
    let bad = Cloth::new(sheet.clone(), &Fabric { areal_mass: 0.0, ..fabric }).unwrap_err().to_string();
    assert!(bad.contains("areal_mass of a fabric is 0 kg/m²; it lies between"), "{bad}");
    let cloth = Cloth::new(sheet, &fabric).unwrap();
    let said = SmallSteps::new(cloth.clone(), &[77], Settings::default()).err().unwrap();
    assert!(matches!(said, ClothError::Vertex { vertex: 77, .. }), "{said}");
    assert!(Provot::new(cloth, &[77], 0.01, 1).is_err());
}

#[test]
fn no_step_makes_it_explode() {
    [false, true].into_iter().for_each(jump);
}

fn jump(lines: bool) {
    // Targets that jump five metres in a frame, a hurricane, and no gravity at all.
    let (mut solver, mut targets) = hanging(16, true, Settings { lines, ..Settings::default() });
    for frame in 0..120 {
        if frame == 10 {
            targets.iter_mut().for_each(|t| t.x += 5.0);
        }
        let wind = if frame > 40 { Vec3::new(40.0, 10.0, 0.0) } else { Vec3::ZERO };
        solver.step(&Step { targets: &targets, wind, ..Step::default() });
        assert!(solver.positions().iter().all(|p| p.is_finite() && p.length() < 20.0), "{frame}");
    }
    let stretch = solver.cloth().stretch(solver.positions(), |a| a != Along::Bias);
    assert!(stretch.p999 < 0.5, "{stretch:?}");
}

#[test]
fn a_plate_swings_out_as_its_drag_says() {
    // Stiff, without dampers, hinged at its upper edge, .1 m wide and .3 m long.
    let (width, length, cells, mass) = (0.1f32, 0.3f32, [4, 12], 2.0f32);
    let fabric = Fabric {
        areal_mass: mass,
        bending_warp: 0.3,
        bending_weft: 0.3,
        damping: 0.0,
        bending_damping: 0.0,
        ..PRESETS[0].fabric
    };
    let angle = 0.12f32;
    let down = Vec3::new(0.0, -angle.cos(), angle.sin());
    let sheet = Sheet::rectangle(Vec3::ZERO, Vec3::X, down, Vec2::new(width, length), cells);
    let held: Vec<u32> = (0..=cells[0]).collect();
    let targets: Vec<Vec3> = held.iter().map(|v| sheet.positions[*v as usize]).collect();
    let settings = Settings { seconds: 1.0 / 240.0, substeps: 20, ..Settings::default() };
    let cloth = Cloth::new(sheet, &fabric).unwrap();
    let mut solver = SmallSteps::new(cloth, &held, settings).unwrap();
    assert_eq!(solver.softened(), 0.0);
    let (mut last, mut turns, mut rising) = (f32::NAN, Vec::new(), false);
    while turns.len() < 14 {
        solver.step(&Step { targets: &targets, ..Step::default() });
        let z = solver.positions().last().unwrap().z.abs();
        if rising && z < last {
            turns.push(last / length);
        }
        (rising, last) = (z > last, z);
    }
    // Where it begins, and the first turn, before which it had never turned.
    turns.drain(..2);
    // Per square metre at s below the hinge ½ρ C_D |u|³ with C_D = 8 (2πθs/D)^(−1/3) is lost: θ^(−2/3) grows by the same in each period.
    let rate = 0.5
        * 1.225
        * 8.0
        * (2.0 * std::f32::consts::PI / width).powf(-1.0 / 3.0)
        * (8.0 / 11.0)
        * length.powf(2.0 / 3.0)
        * (3.0 / mass);
    let periods = (turns.len() - 1) as f32 / 2.0;
    let grown = turns[turns.len() - 1].powf(-2.0 / 3.0) - turns[0].powf(-2.0 / 3.0);
    let found = grown / (2.0 / 3.0 * rate * periods);
    println!("{:.4} to {:.4} rad in {periods} periods; {found:.3} of what drag takes", turns[0], turns[11]);
    assert!((found - 1.0).abs() < 0.08, "{found}");
}

#[test]
fn what_falls_flat_is_held_as_in_a_steady_stream() {
    let silk = &PRESETS[0].fabric;
    let sheet = Sheet::rectangle(Vec3::ZERO, Vec3::X, Vec3::Z, Vec2::splat(0.2), [4, 4]);
    let cloth = Cloth::new(sheet, silk).unwrap();
    let mut solver = SmallSteps::new(cloth, &[], Settings::default()).unwrap();
    // Hoerner's square plate: ½ρ 1.17 v² holds its weight.
    let end = (2.0 * silk.areal_mass * 9.80665 / (1.225 * 1.17)).sqrt();
    for step in 1..=60 {
        solver.step(&Step::default());
        if [6, 15, 60].contains(&step) {
            let truth = end * (9.80665 * step as f32 / 60.0 / end).tanh();
            let v: Vec<f32> = solver.velocities().map(|v| -v.y).collect();
            let mean = v.iter().sum::<f32>() / v.len() as f32;
            println!("{mean:.4} of {truth:.4} m/s");
            assert!((mean / truth - 1.0).abs() < 0.02, "{mean} {truth}");
        }
    }
}
