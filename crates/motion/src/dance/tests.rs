use super::*;
use crate::solve::{SolveOptions, solve};

const LIST: &str = "# a short one\nkamae seconds=2\nhakobi steps=5 length=.3 degrees=60\nsashikomi\nhiraki\nturn degrees=-135\n\
    sleeve side=left\nsleeve side=right seconds=4\nkamae\n";

fn danced(rate: f64) -> SkeletalMotion {
    dance(&parse(LIST).unwrap(), rate).unwrap()
}

#[test]
fn feet_slide_on_the_floor_and_one_of_them_stands() {
    let moved = danced(120.0);
    assert!(moved.frames > 120 * 25, "{}", moved.frames);
    let mut before: Option<Vec<RigidPose>> = None;
    let (mut low, mut high, mut reach) = (f32::INFINITY, f32::NEG_INFINITY, 0.0f32);
    for frame in 0..moved.frames {
        let poses = moved.poses(frame).unwrap();
        let mut still = 0;
        for [_, shank, foot] in LEGS {
            // The heel, under and behind the ankle.
            let heel = poses[foot].position + poses[foot].rotation * Vec3::new(0.0, -ANKLE[0], -ANKLE[1]);
            (low, high) = (low.min(heel.y), high.max(heel.y));
            let toe = poses[foot].position + poses[foot].rotation * Vec3::new(0.0, -ANKLE[0], 0.15);
            low = low.min(toe.y);
            reach = reach.max(poses[shank].position.distance(poses[foot].position) - 0.4);
            if let Some(before) = &before {
                still += usize::from(poses[foot].position.distance(before[foot].position) < 1e-5);
            }
        }
        assert!(before.is_none() || still > 0, "both feet move in frame {frame}");
        assert!((poses[0].position.y - HIPS).abs() < 1e-5);
        before = Some(poses);
    }
    assert!(low > -1e-4 && high < 1e-4 && reach < 1e-4, "{low} {high} {reach}");
}

#[test]
fn nothing_jerks() {
    let moved = danced(120.0);
    let poses: Vec<Vec<RigidPose>> = (0..moved.frames).map(|f| moved.poses(f).unwrap()).collect();
    let mut most = 0.0f32;
    for w in poses.windows(3) {
        for ((a, b), c) in w[0].iter().zip(&w[1]).zip(&w[2]) {
            let bend = a.position - 2.0 * b.position + c.position;
            most = most.max(bend.length() * 120.0 * 120.0);
        }
    }
    println!("at most {most} m/s²");
    // The tip of a hand that throws its sleeve has 8.9 m/s²; a jump of a millimetre between two frames would be 14.
    assert!(most < 12.0, "{most}");
}

#[test]
fn it_goes_where_the_list_says() {
    let at = |text: &str| {
        let moved = dance(&parse(text).unwrap(), 30.0).unwrap();
        let last = moved.poses(moved.frames - 1).unwrap()[0];
        (last.position, last.rotation * Vec3::Z)
    };
    let (place, facing) = at("hakobi steps=4 length=.25");
    assert!(place.distance(Vec3::new(0.0, HIPS, 1.0)) < 1e-4 && facing.distance(Vec3::Z) < 1e-4, "{place}");
    // To the left is +x for who faces +z.
    let (place, facing) = at("turn degrees=90\nhakobi steps=2 length=.5");
    assert!(
        place.distance(Vec3::new(1.0, HIPS, 0.0)) < 1e-4 && facing.distance(Vec3::X) < 1e-4,
        "{place} {facing}"
    );
    let (place, _) = at("hiraki steps=2 length=.2");
    assert!(place.distance(Vec3::new(0.0, HIPS, -0.4)) < 1e-4, "{place}");
    // The fan's arm points forward.
    let moved = dance(&parse("sashikomi").unwrap(), 30.0).unwrap();
    let poses = moved.poses(moved.frames - 1).unwrap();
    let arm = (poses[12].position - poses[10].position).normalize();
    assert!(arm.z > 0.9, "{arm}");
}

#[test]
fn what_is_danced_is_solved_again() {
    let moved = danced(120.0);
    let noise = Noise { position: 0.0005, rotation: 0.3f32.to_radians(), gaps: 20.0, longest: 0.25, seed: 5 };
    let take = measure(&moved, &noise).unwrap();
    let missing: usize = take.bodies.tracks.iter().map(|t| t.missing()).sum();
    assert!(missing > 1000, "{missing}");
    assert_eq!(take, measure(&moved, &noise).unwrap(), "the same seed");
    let solved = solve(&take.bodies, &SolveOptions::default()).unwrap();
    let (mut sum, mut count) = (0.0f32, 0);
    for frame in 0..moved.frames {
        let (truth, got) = (moved.poses(frame).unwrap(), solved.motion.poses(frame).unwrap());
        let begun = moved.poses(0).unwrap();
        for (i, fit) in solved.fits.iter().enumerate() {
            let of = |name: &str| PERFORMER.iter().position(|(n, _)| *n == name).unwrap();
            let j = of(&fit.name);
            let Some(p) = PERFORMER.iter().position(|(n, _)| *n == PERFORMER[j].1) else { continue };
            let k = solved.fits.iter().position(|f| f.name == PERFORMER[p].0).unwrap();
            // Both from the pose at rest.
            let want = (truth[p].rotation * begun[p].rotation.inverse()).inverse()
                * truth[j].rotation
                * begun[j].rotation.inverse();
            let off = (got[k].rotation.inverse() * got[i].rotation) * want.inverse();
            sum += (2.0 * off.xyz().length().min(1.0).asin()).to_degrees().powi(2);
            count += 1;
        }
    }
    let rms = (sum / count as f32).sqrt();
    println!("{missing} poses lost: {rms} degrees");
    assert!(rms < 1.0, "{rms}");
}

#[test]
fn lists_that_make_no_sense_are_refused() {
    let said = |text: &str| parse(text).unwrap_err().to_string();
    assert!(
        said("kamae\nhakoby").contains("line 2: 'hakoby' is no unit of form; expected one of kamae, hakobi")
    );
    assert!(said("hakobi step=3").contains("'step=3' says nothing of hakobi; it has steps=4, length=0.28"));
    assert!(said("hakobi length=9").contains("'length' of hakobi is '9'; expected -0.6 to 0.6"));
    assert!(said("hakobi length=nan").contains("expected -0.6 to 0.6"));
    assert!(said("# nothing").contains("no unit of form"));
}
