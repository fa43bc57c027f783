use super::*;
use crate::Track;
use crate::dance::BONES;
use glam::Vec3;
use yugen_optics::random::Pcg32;

struct Truth {
    /// Of each joint in its carrier, frame after frame.
    turns: Vec<Vec<Quat>>,
    bodies: Tracks<RigidPose>,
}

fn vector(rng: &mut Pcg32, size: f32) -> Vec3 {
    Vec3::from_array(std::array::from_fn(|_| size * rng.normal()))
}

/// A performer who stands for .75 s and then moves all joints by so many degrees and walks in a circle; bodies are fixed
/// to segments anyhow, and measured with noise (m, rad).
fn truth(frames: usize, rate: f64, degrees: f32, noise: [f32; 2]) -> Truth {
    let mut rng = Pcg32::new(19, 6);
    let waves: Vec<[[f32; 2]; 3]> = (0..19)
        .map(|_| {
            std::array::from_fn(|_| [0.2 + 0.5 * rng.next_f32(), std::f32::consts::TAU * rng.next_f32()])
        })
        .collect();
    let fixed: Vec<(Vec3, Quat)> = (0..19)
        .map(|i| {
            // On the limb, some way to its end, and a little beside it.
            let along = PERFORMER
                .iter()
                .position(|(_, p)| *p == PERFORMER[i].0)
                .map_or([0.0, 0.08, 0.0], |c| BONES[c]);
            let at = 0.5 * Vec3::from(along) + vector(&mut rng, 0.02);
            (if i == 0 { Vec3::ZERO } else { at }, Quat::from_scaled_axis(vector(&mut rng, 1.0)))
        })
        .collect();
    let mut all = Truth {
        turns: vec![Vec::new(); 19],
        bodies: Tracks {
            rate,
            start: 0.0,
            frames,
            tracks: PERFORMER.iter().map(|(n, _)| Track::new(*n)).collect(),
        },
    };
    for frame in 0..frames {
        let seconds = frame as f32 / rate as f32;
        // Begins softly.
        let begun = ((seconds - 0.75) / 1.0).clamp(0.0, 1.0);
        let begun = begun * begun * (3.0 - 2.0 * begun);
        let mut world: Vec<(Vec3, Quat)> = Vec::new();
        for i in 0..19 {
            let wave = |k: usize| {
                let [frequency, phase] = waves[i][k];
                (std::f32::consts::TAU * frequency * seconds + phase).sin()
            };
            let size = degrees.to_radians() * if i == 0 { 0.3 } else { 1.0 };
            let turn = Quat::from_scaled_axis(begun * size * Vec3::new(wave(0), wave(1), wave(2)));
            let walk = Quat::from_rotation_y(begun * 0.3 * seconds);
            let turn = if i == 0 { walk * turn } else { turn };
            all.turns[i].push(turn);
            let bone = Vec3::from(BONES[i]);
            let place = match PERFORMER.iter().position(|(n, _)| *n == PERFORMER[i].1) {
                None => (bone + walk * Vec3::Z * (0.8 * begun), turn),
                Some(p) => (world[p].0 + world[p].1 * bone, world[p].1 * turn),
            };
            world.push(place);
            let (at, how) = fixed[i];
            let position = place.0 + place.1 * at + vector(&mut rng, noise[0]);
            let rotation = Quat::from_scaled_axis(vector(&mut rng, noise[1])) * place.1 * how;
            all.bodies.tracks[i].samples.push(Some(RigidPose { position, rotation: rotation.normalize() }));
        }
    }
    all
}

/// Root mean square of the angles of all joints but the root, degrees, and the worst error of a bone to its length.
fn errors(truth: &Truth, solved: &Solved) -> [f64; 2] {
    let (mut sum, mut count, mut bone) = (0.0f64, 0, 0.0f64);
    for (i, fit) in solved.fits.iter().enumerate() {
        let of = PERFORMER.iter().position(|(n, _)| *n == fit.name).unwrap();
        if of == 0 {
            continue;
        }
        // A pelvis' own origin is anywhere; bones from joint to joint are those of the performer.
        let carrier = PERFORMER[of].1;
        if carrier != "pelvis" {
            let length = f64::from(Vec3::from(BONES[of]).length());
            bone = bone.max((fit.bone - length).abs() / length);
        }
        for frame in 0..truth.bodies.frames {
            let pose = solved.motion.pose(frame);
            let Placement::Parts(got) = pose.placements[i] else { panic!() };
            let want = truth.turns[of][frame];
            let off = rotation_vector((got.rotation * want.inverse()).as_dquat()).length().to_degrees();
            sum += off * off;
            count += 1;
        }
    }
    [(sum / f64::from(count)).sqrt(), bone]
}

#[test]
fn clean_bodies_are_met_exactly() {
    let truth = truth(600, 100.0, 25.0, [0.0; 2]);
    // Unfiltered, nothing changes what is exact.
    let options = SolveOptions { cutoff: 1e3, quick: 1e3, ..SolveOptions::default() };
    let solved = solve(&truth.bodies, &options).unwrap();
    let [angles, bones] = errors(&truth, &solved);
    println!("clean: {angles} degrees, bones {bones}");
    assert!(angles < 0.01 && bones < 1e-4, "{angles} {bones}");
    assert!(solved.fits.iter().all(|f| f.position_off < 1e-5 && f.filled == 0), "{:?}", solved.fits);
    // Solved again from its own bodies, it stays what it is.
    let mut again = solved.motion.take().unwrap().bodies;
    again.tracks.retain(|t| !t.name.ends_with(" end"));
    let twice = solve(&again, &options).unwrap();
    let [angles, _] = errors(&truth, &twice);
    assert!(angles < 0.02, "{angles}");
}

#[test]
fn noise_and_gaps_leave_a_degree_and_a_thousandth() {
    let mut truth = truth(3600, 120.0, 30.0, [0.0005, 0.3f32.to_radians()]);
    // Each body is lost here and there for up to a quarter of a second.
    let mut rng = Pcg32::new(3, 3);
    let mut lost = 0;
    for body in &mut truth.bodies.tracks {
        for _ in 0..12 {
            let first = 100 + (rng.next_f32() * 3400.0) as usize;
            let count = 1 + (rng.next_f32() * 30.0) as usize;
            body.samples[first..first + count].fill(None);
            lost += count;
        }
    }
    let began = std::time::Instant::now();
    let solved = solve(&truth.bodies, &SolveOptions::default()).unwrap();
    let took = began.elapsed().as_secs_f64();
    let [angles, bones] = errors(&truth, &solved);
    println!(
        "{lost} poses lost: {angles} degrees, bones {bones}; {:.1} times as fast as the take",
        30.0 / took
    );
    assert!(angles < 1.0 && bones < 1e-3, "{angles} {bones}");
    // A hand that is lost for two seconds goes on with its arm: where it is, if not how it is turned.
    let mut gone = truth.bodies.clone();
    gone.tracks[8].samples[1000..1240].fill(None);
    let without = solve(&gone, &SolveOptions::default()).unwrap();
    let hand = without.fits.iter().position(|f| f.name == "left_hand").unwrap();
    let wrist = |s: &Solved, f: usize| s.motion.poses(f).unwrap()[hand].position;
    let off = (1000..1240).map(|f| wrist(&without, f).distance(wrist(&solved, f))).fold(0.0, f32::max);
    println!("a wrist whose hand is lost is off by {:.1} mm", 1000.0 * off);
    assert!(off < 0.004, "{off}");
    let solved = without;
    assert!(solved.fits.iter().find(|f| f.name == "left_hand").unwrap().filled >= 240);
    // Bones do not change in the take: the skeleton has but one length for each.
    let joints = solved.motion.skeleton.joints();
    let [a, b] = [300, 2000].map(|f| solved.motion.poses(f).unwrap());
    for (i, parent) in joints.iter().enumerate().filter_map(|(i, j)| Some((i, j.parent?))) {
        let length = |p: &[RigidPose]| p[i].position.distance(p[parent].position);
        assert!((length(&a) - length(&b)).abs() < 1e-5);
    }
    // Without smoothing it is worse, so that smoothing is seen to do something.
    let rough = SolveOptions { cutoff: 1e3, quick: 1e3, ..SolveOptions::default() };
    let [rough, _] = errors(&truth, &solve(&truth.bodies, &rough).unwrap());
    assert!(rough > 1.1 * angles, "{rough} {angles}");
}

#[test]
fn what_cannot_be_solved_is_said() {
    let mut some = truth(60, 60.0, 10.0, [0.0; 2]).bodies;
    let said =
        |bodies: &Tracks<RigidPose>, options: &SolveOptions| solve(bodies, options).unwrap_err().to_string();
    let usual = SolveOptions::default();
    assert_eq!(said(&Tracks::default(), &usual), "there are no rigid bodies in this take");
    some.tracks[3].samples.fill(None);
    assert!(said(&some, &usual).contains("the body 'neck' is not seen in any frame"));
    some.tracks.remove(3);
    assert!(solve(&some, &usual).is_ok(), "the head hangs on the chest");
    let late = SolveOptions { rest: Some(90..=100), ..usual.clone() };
    assert!(said(&some, &late).contains("is not seen in the frames 90 to"), "{}", said(&some, &late));
    some.tracks[0].name = "tail".into();
    assert!(said(&some, &usual).contains("what carries the bodies tail is not known"));
    some.tracks.remove(0);
    let roots = said(&some, &usual);
    assert!(roots.contains("nothing carries") && roots.contains("waist and"), "{roots}");
    let circle = [("a", "b"), ("b", "a")].map(|(a, b)| (a.to_string(), b.to_string())).to_vec();
    some.tracks.truncate(2);
    some.tracks[0].name = "a".into();
    some.tracks[1].name = "b".into();
    assert_eq!(
        said(&some, &SolveOptions { tree: circle, ..usual }),
        "the bodies carry each other in a circle"
    );
}
