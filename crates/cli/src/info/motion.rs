//! What a file of motion holds.

use super::facts::Facts;
use super::scene::box_of;
use serde_json::json;
use yugen_archive::formats::motion::{Loaded, Motion, unit_name};
use yugen_motion::{SkeletalMotion, Take, Tracks};
use yugen_optics::Vec3;

/// Everything.
pub fn facts(loaded: &Loaded) -> Facts {
    let (unit, axes) = (loaded.unit, loaded.axes);
    let facts = Facts::default()
        .say("kind", "motion")
        .say("format", loaded.format)
        .group("unit", Facts::default().say("length", unit_name(unit.0)).say("basis", unit.1.name()))
        .group(
            "axes",
            Facts::default().say("of_the_file_in_ours", axes.0.to_string()).say("basis", axes.1.name()),
        )
        .list("doubts", loaded.doubts.iter().map(|d| Facts::default().say("doubt", d.clone())));
    match &loaded.motion {
        Motion::Captured(take) => facts.and(captured(take)),
        Motion::Skeletal(moved) => facts.and(skeletal(moved)),
    }
    .group("bounds_of_the_first_frame", bounds(&loaded.motion))
}

fn bounds(motion: &Motion) -> Facts {
    let points = motion.points(0);
    let corner = |f: fn(Vec3, Vec3) -> Vec3| points.iter().copied().reduce(f);
    match (corner(Vec3::min), corner(Vec3::max)) {
        (Some(low), Some(high)) => box_of([low, high]),
        _ => Facts::default(),
    }
}

fn tracks<T>(tracks: &Tracks<T>) -> Facts {
    let each = tracks.tracks.iter().map(|t| {
        let longest = t.gaps().iter().map(|g| g[1]).max();
        let seen = t.samples.len() > t.missing();
        Facts::default()
            .say("name", t.name.clone())
            .say("missing_frames", Some(t.missing()).filter(|n| *n > 0))
            .say("longest_gap_seconds", longest.map(|n| json!((n as f64 / tracks.rate) as f32)))
            .say("never_seen", (!seen).then_some(true))
    });
    Facts::default()
        .say("frames", tracks.frames)
        .say("rate", json!(tracks.rate))
        .say("seconds", json!(tracks.seconds() as f32))
        .say("first_frame_at_seconds", json!(tracks.start as f32))
        .list("tracks", each)
}

fn captured(take: &Take) -> Facts {
    let mut facts = Facts::default();
    if !take.markers.tracks.is_empty() {
        facts = facts.group("markers", tracks(&take.markers));
    }
    if !take.bodies.tracks.is_empty() {
        facts = facts.group("rigid_bodies", tracks(&take.bodies));
    }
    facts
}

fn skeletal(moved: &SkeletalMotion) -> Facts {
    let joints = moved.skeleton.joints();
    let at = |i: usize| joints[i].rest.matrix().w_axis.truncate().length();
    let each = joints.iter().enumerate().map(|(i, joint)| {
        Facts::default()
            .say("name", joint.name.clone())
            .say("parent", joint.parent.map(|p| joints[p].name.clone()))
            .say("from_parent", joint.parent.map(|_| json!(at(i))))
    });
    let coincide = (0..joints.len()).filter(|&i| joints[i].parent.is_some() && at(i) < 1e-6).count();
    Facts::default()
        .say("frames", moved.frames)
        .say("rate", (moved.frames > 0).then(|| json!(moved.rate)))
        .say("seconds", (moved.frames > 0).then(|| json!(((moved.frames - 1) as f64 / moved.rate) as f32)))
        .say("joints_where_their_parent_is", Some(coincide).filter(|n| *n > 0))
        .list("joints", each)
}
