//! The pose of an animation at a moment (glTF 2.0, 3.11 and appendix C).

use super::document::Document;
use super::schema::{AnimationEntry, Node};
use crate::Error;
use crate::formats::Moment;
use glam::Quat;

/// The most numbers of all keys together: channels may share what they read, and reading it again costs the file
/// nothing.
const MAX_NUMBERS: usize = 1 << 26;

/// The names of the animations of a file and when each begins and ends, in seconds.
pub(super) fn list(doc: &Document) -> Result<Vec<(String, [f32; 2])>, Error> {
    let span = |animation: &AnimationEntry| -> Result<[f32; 2], Error> {
        let mut span = [f32::INFINITY, f32::NEG_INFINITY];
        for sampler in &animation.samplers {
            for time in doc.floats(sampler.input, 1)? {
                span = [span[0].min(time), span[1].max(time)];
            }
        }
        Ok(if span[0] > span[1] { [0.0; 2] } else { span })
    };
    doc.root.animations.iter().map(|a| Ok((a.name.clone(), span(a)?))).collect()
}

/// Puts the nodes of the file where they are at `moment`; before an animation begins and after it ends it stands still.
pub(super) fn pose(doc: &mut Document, moment: &Moment) -> Result<(), Error> {
    let animation = choose(doc, moment.animation.as_deref())?;
    let mut changes = Vec::new();
    let mut numbers = 0;
    for channel in &animation.channels {
        // A channel without a node is for extensions.
        let Some(node) = channel.target.node else { continue };
        doc.entry(&doc.root.nodes, node, "node")?;
        let sampler = doc.entry(&animation.samplers, channel.sampler, "sampler of an animation")?;
        let path = match channel.target.path.as_str() {
            "translation" => Path::Translation,
            "rotation" => Path::Rotation,
            "scale" => Path::Scale,
            "weights" => Path::Weights,
            other => {
                let known = ["translation", "rotation", "scale", "weights"];
                return Err(Error::unknown(doc.at.clone(), "path of an animation", other, known));
            }
        };
        let method = match sampler.interpolation.as_deref().unwrap_or("LINEAR") {
            "LINEAR" if path == Path::Rotation => Method::Slerp,
            "LINEAR" => Method::Linear,
            "STEP" => Method::Step,
            "CUBICSPLINE" => Method::Cubic,
            other => {
                let known = ["LINEAR", "STEP", "CUBICSPLINE"];
                return Err(Error::unknown(doc.at.clone(), "interpolation", other, known));
            }
        };
        let times = doc.floats(sampler.input, 1)?;
        let values = doc.floats(sampler.output, path.components())?;
        numbers += times.len() + values.len();
        if numbers > MAX_NUMBERS {
            return Err(Error::TooLarge {
                at: doc.at.clone(),
                what: "the number of keys of an animation".into(),
                asked: numbers as u64,
                limit: MAX_NUMBERS as u64,
            });
        }
        let each = if method == Method::Cubic { 3 * times.len() } else { times.len() };
        let width = values.len().checked_div(each).unwrap_or(0);
        let fits = width > 0 && width * each == values.len();
        if !fits || (path != Path::Weights && width != path.components()) {
            let (n, m) = (times.len(), values.len() / path.components());
            return Err(doc.invalid(format!("an animation has {n} times but {m} values of {path:?}")));
        }
        if times.windows(2).any(|t| t[0] >= t[1]) {
            return Err(doc.invalid("the times of an animation must rise"));
        }
        changes.push((node, path, at(&times, &values, width, method, moment.seconds)));
    }
    for (node, path, value) in changes {
        apply(&mut doc.root.nodes[node], path, &value);
    }
    Ok(())
}

/// The animation called `name`; the first where no name is given.
fn choose<'a>(doc: &'a Document, name: Option<&str>) -> Result<&'a AnimationEntry, Error> {
    let all = &doc.root.animations;
    let names = || all.iter().map(|a| a.name.as_str());
    match name {
        None => all.first().ok_or_else(|| doc.invalid("there is no animation in it, so it has no moments")),
        Some(name) => all
            .iter()
            .find(|a| a.name == name)
            .ok_or_else(|| Error::unknown(doc.at.clone(), "animation", name, names())),
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Path {
    Translation,
    Rotation,
    Scale,
    Weights,
}

impl Path {
    /// Of an element of the accessor; weights of all morph targets are one after the other.
    fn components(self) -> usize {
        match self {
            Self::Translation | Self::Scale => 3,
            Self::Rotation => 4,
            Self::Weights => 1,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Method {
    Step,
    Linear,
    Slerp,
    /// Each value stands between its incoming and its outgoing tangent.
    Cubic,
}

/// The value at `seconds`, `width` numbers. `times` rise and are not empty.
fn at(times: &[f32], values: &[f32], width: usize, method: Method, seconds: f32) -> Vec<f32> {
    let (per_key, first) = if method == Method::Cubic { (3 * width, width) } else { (width, 0) };
    let part = |key: usize, offset: usize| &values[key * per_key + offset..][..width];
    let last = times.len() - 1;
    let key = times.partition_point(|t| *t <= seconds).saturating_sub(1);
    if key == last || seconds <= times[0] || method == Method::Step {
        return part(key, first).to_vec();
    }
    let span = times[key + 1] - times[key];
    let t = (seconds - times[key]) / span;
    let (a, b) = (part(key, first), part(key + 1, first));
    match method {
        Method::Slerp => {
            let q = |v: &[f32]| Quat::from_slice(v).normalize();
            q(a).slerp(q(b), t).to_array().to_vec()
        }
        Method::Cubic => {
            let (leave, arrive) = (part(key, 2 * width), part(key + 1, 0));
            let (t2, t3) = (t * t, t * t * t);
            let hermite = |i: usize| {
                (2.0 * t3 - 3.0 * t2 + 1.0) * a[i]
                    + span * (t3 - 2.0 * t2 + t) * leave[i]
                    + (3.0 * t2 - 2.0 * t3) * b[i]
                    + span * (t3 - t2) * arrive[i]
            };
            (0..width).map(hermite).collect()
        }
        Method::Linear | Method::Step => a.iter().zip(b).map(|(a, b)| a + t * (b - a)).collect(),
    }
}

/// A rotation is made a unit when the node's matrix is.
fn apply(node: &mut Node, path: Path, value: &[f32]) {
    // Animated nodes have no matrix; where a file gives one nonetheless, the animation is what was meant.
    node.matrix = None;
    match path {
        Path::Translation => node.translation = value.first_chunk().copied(),
        Path::Rotation => node.rotation = value.first_chunk().copied(),
        Path::Scale => node.scale = value.first_chunk().copied(),
        Path::Weights => node.weights = Some(value.to_vec()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_between_keys_are_those_of_the_specification() {
        let times = [1.0, 3.0, 4.0];
        let line = [0.0, 10.0, 4.0, 20.0, 8.0, 0.0];
        let of = |method, seconds| at(&times, &line, 2, method, seconds);
        for method in [Method::Linear, Method::Step] {
            assert_eq!(of(method, 0.0), [0.0, 10.0]);
            assert_eq!(of(method, 3.0), [4.0, 20.0]);
            assert_eq!(of(method, 9.0), [8.0, 0.0]);
        }
        assert_eq!(of(Method::Linear, 1.5), [1.0, 12.5]);
        assert_eq!(of(Method::Step, 2.9), [0.0, 10.0]);
        // The spline of x³ through 0 and 8, whose slopes are 0 and 12: it is a cubic, so that it is met exactly.
        let cube = [9.0, 0.0, 0.0, 12.0, 8.0, 9.0];
        for t in [0.5f32, 1.0, 1.7] {
            let got = at(&[0.0, 2.0], &cube, 1, Method::Cubic, t)[0];
            assert!((got - t.powi(3)).abs() < 1e-5, "{t}: {got}");
        }
        assert_eq!(at(&[0.0, 2.0], &cube, 1, Method::Cubic, 7.0), [8.0]);
        // A turn about z by 0 and 270 degrees is short the other way round.
        let half = 0.5f32.sqrt();
        let turn = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, -half];
        let got = Quat::from_slice(&at(&[0.0, 1.0], &turn, 4, Method::Slerp, 0.5));
        let want = Quat::from_rotation_z(-std::f32::consts::FRAC_PI_4);
        assert!(got.dot(want).abs() > 1.0 - 1e-6, "{got}");
    }
}
