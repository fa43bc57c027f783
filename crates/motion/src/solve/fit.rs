//! The skeleton in one frame: positions and rotations of all bodies at once, by Levenberg-Marquardt, with bones that keep
//! their lengths.
//!
//! Unknown are where the root is and how each segment is turned in the world. A body's place is the sum of the bones that
//! lead to it, each turned by its own segment, so that a rotation is measured by itself and a place couples the chain above
//! it.

use super::filter::rotation_vector;
use glam::{DQuat, DVec3};
use yugen_optics::linear::solve_spd;

/// A segment: a joint, the bone that leads to it, and the body that is on it.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    /// Which carries it; before it.
    pub parent: Option<usize>,
    /// Where its joint is in its parent; of the root, nothing.
    pub bone: DVec3,
    /// Where its body is.
    pub body: DVec3,
}

/// What is measured of a segment in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured {
    /// Where the body is.
    pub position: DVec3,
    /// How the segment is turned.
    pub rotation: DQuat,
    /// How much it counts.
    pub weight: f64,
}

/// Where the root is and how segments are turned.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub root: DVec3,
    pub turns: Vec<DQuat>,
}

/// Standard deviations of what is measured: half a millimetre and a third of a degree are those of good systems. Only
/// their ratio counts: a tenth of a metre from a joint both weigh the same.
const POSITION: f64 = 0.0005;
const ROTATION: f64 = 0.005;
/// Steps that change nothing by more are the last: a micrometre and a ten-thousandth of a degree.
const ENOUGH: f64 = 1e-6;
const MOST_STEPS: usize = 20;

/// Places of the joints.
pub(super) fn joints(segments: &[Segment], state: &State) -> Vec<DVec3> {
    let mut at: Vec<DVec3> = Vec::with_capacity(segments.len());
    for segment in segments {
        at.push(match segment.parent {
            None => state.root,
            Some(p) => at[p] + state.turns[p] * segment.bone,
        });
    }
    at
}

fn cost(segments: &[Segment], measured: &[Measured], state: &State) -> f64 {
    let at = joints(segments, state);
    let each = segments.iter().zip(measured).enumerate().map(|(i, (segment, m))| {
        let place = (at[i] + state.turns[i] * segment.body - m.position) / POSITION;
        let turn = rotation_vector(state.turns[i] * m.rotation.inverse()) / ROTATION;
        m.weight * (place.length_squared() + turn.length_squared())
    });
    each.sum()
}

/// The state that fits best, near `start`.
pub(super) fn fit(segments: &[Segment], measured: &[Measured], start: State) -> State {
    let n = 3 + 3 * segments.len();
    let mut state = start;
    let mut now = cost(segments, measured, &state);
    let mut damping = 1e-6;
    let mut normal = vec![0.0; n * n];
    for _ in 0..MOST_STEPS {
        let right = equations(segments, measured, &state, &mut normal);
        let step = loop {
            let mut damped = normal.clone();
            (0..n).for_each(|i| damped[i * n + i] *= 1.0 + damping);
            let Some(step) = solve_spd(damped, right.clone()) else { return state };
            let next = moved(&state, &step);
            let then = cost(segments, measured, &next);
            if then <= now {
                (state, now) = (next, then);
                damping = (damping * 0.1).max(1e-9);
                break step;
            }
            damping *= 10.0;
            if damping > 1e6 {
                return state;
            }
        };
        if step.iter().all(|s| s.abs() < ENOUGH) {
            break;
        }
    }
    state
}

fn moved(state: &State, step: &[f64]) -> State {
    let part = |i: usize| DVec3::from_slice(&step[3 * i..3 * i + 3]);
    let turned = |(i, q): (usize, &DQuat)| (DQuat::from_scaled_axis(part(i + 1)) * *q).normalize();
    State { root: state.root + part(0), turns: state.turns.iter().enumerate().map(turned).collect() }
}

/// The normal equations of a step: JᵀJ, and −Jᵀr which is returned.
fn equations(segments: &[Segment], measured: &[Measured], state: &State, normal: &mut [f64]) -> Vec<f64> {
    let n = 3 + 3 * segments.len();
    normal.fill(0.0);
    let mut right = vec![0.0; n];
    let at = joints(segments, state);
    // Which segments a place depends on, and by which bone.
    let mut chain: Vec<(usize, DVec3)> = Vec::new();
    let per_place = 1.0 / (POSITION * POSITION);
    for (i, (segment, m)) in segments.iter().zip(measured).enumerate() {
        let place = at[i] + state.turns[i] * segment.body - m.position;
        chain.clear();
        chain.push((i, state.turns[i] * segment.body));
        let mut below = i;
        while let Some(p) = segments[below].parent {
            chain.push((p, state.turns[p] * segments[below].bone));
            below = p;
        }
        let w = m.weight * per_place;
        // Turning by θ moves a bone v by θ × v; the root moves everything as it is moved.
        for k in 0..3 {
            normal[k * n + k] += w;
            right[k] -= w * place[k];
        }
        for (s, (j, v)) in chain.iter().enumerate() {
            let row = 3 + 3 * j;
            // Of θ × v against a step of the root: the matrix of v ×.
            let x = [[0.0, -v.z, v.y], [v.z, 0.0, -v.x], [-v.y, v.x, 0.0]];
            let pull = v.cross(place);
            for (a, line) in x.iter().enumerate() {
                right[row + a] -= w * pull[a];
                for (b, value) in line.iter().enumerate() {
                    normal[(row + a) * n + b] += w * value;
                }
            }
            // (θ × v) · (φ × u) = θ · ((v · u) 1 − u vᵀ) φ.
            for (l, u) in &chain[s..] {
                let (hi, lo, u, v) = if j >= l { (j, l, u, v) } else { (l, j, v, u) };
                let dot = v.dot(*u);
                for a in 0..3 {
                    for b in 0..3 {
                        let value = if a == b { dot } else { 0.0 } - u[a] * v[b];
                        normal[(3 + 3 * hi + a) * n + 3 + 3 * lo + b] += w * value;
                    }
                }
            }
        }
        let w = m.weight / (ROTATION * ROTATION);
        let turn = rotation_vector(state.turns[i] * m.rotation.inverse());
        for a in 0..3 {
            let row = 3 + 3 * i + a;
            normal[row * n + row] += w;
            right[row] -= w * turn[a];
        }
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;

    fn arm() -> Vec<Segment> {
        let segment = |parent, bone, body| Segment { parent, bone, body };
        vec![
            segment(None, DVec3::ZERO, DVec3::new(0.0, 0.1, 0.0)),
            segment(Some(0), DVec3::new(0.0, 0.5, 0.0), DVec3::new(0.1, 0.0, 0.0)),
            segment(Some(1), DVec3::new(0.3, 0.0, 0.0), DVec3::new(0.1, 0.02, 0.0)),
            segment(Some(0), DVec3::new(0.0, -0.4, 0.1), DVec3::new(0.0, -0.2, 0.0)),
        ]
    }

    fn random(rng: &mut Pcg32, size: f64) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| size * (2.0 * f64::from(rng.next_f32()) - 1.0)))
    }

    #[test]
    fn a_pose_is_found_from_far_away() {
        let segments = arm();
        let mut rng = Pcg32::new(7, 1);
        for _ in 0..20 {
            let truth = State {
                root: random(&mut rng, 1.0),
                turns: (0..4).map(|_| DQuat::from_scaled_axis(random(&mut rng, 1.0))).collect(),
            };
            let at = joints(&segments, &truth);
            let measured: Vec<Measured> = (0..4)
                .map(|i| Measured {
                    position: at[i] + truth.turns[i] * segments[i].body,
                    rotation: truth.turns[i],
                    weight: 1.0,
                })
                .collect();
            let start = State { root: DVec3::ZERO, turns: vec![DQuat::IDENTITY; 4] };
            let found = fit(&segments, &measured, start);
            assert!(found.root.distance(truth.root) < 1e-6);
            for (a, b) in found.turns.iter().zip(&truth.turns) {
                assert!(rotation_vector(*a * b.inverse()).length() < 1e-6);
            }
        }
    }

    #[test]
    fn the_equations_are_the_derivative() {
        let segments = arm();
        let mut rng = Pcg32::new(8, 1);
        let state = State {
            root: random(&mut rng, 1.0),
            turns: (0..4).map(|_| DQuat::from_scaled_axis(random(&mut rng, 1.0))).collect(),
        };
        let measured: Vec<Measured> = (0..4)
            .map(|i| Measured {
                position: random(&mut rng, 1.0),
                // Little turned: the derivative of the rotation is the identity to first order.
                rotation: DQuat::from_scaled_axis(random(&mut rng, 1e-4)) * state.turns[i],
                weight: 0.5 + i as f64,
            })
            .collect();
        let n = 15;
        let mut normal = vec![0.0; n * n];
        let right = equations(&segments, &measured, &state, &mut normal);
        for i in 0..n {
            let mut step = vec![0.0; n];
            let mut at = |h: f64| {
                step[i] = h;
                cost(&segments, &measured, &moved(&state, &step))
            };
            // Half the derivative of the cost is Jᵀr.
            let h = 1e-6;
            let slope = (at(h) - at(-h)) / (4.0 * h);
            assert!((slope + right[i]).abs() < 1e-4 * (1.0 + right[i].abs()), "{i}: {slope} {}", -right[i]);
        }
        // Near the solution the normal matrix is half of the second derivative, across segments too.
        let at = joints(&segments, &state);
        let exact: Vec<Measured> = (0..4)
            .map(|i| Measured {
                position: at[i] + state.turns[i] * segments[i].body,
                rotation: state.turns[i],
                weight: 1.0,
            })
            .collect();
        equations(&segments, &exact, &state, &mut normal);
        for i in 0..n {
            for j in 0..=i {
                let h = 1e-5;
                let both = |a: f64, b: f64| {
                    let mut step = vec![0.0; n];
                    step[i] += a;
                    step[j] += b;
                    cost(&segments, &exact, &moved(&state, &step))
                };
                let second = (both(h, h) - both(h, -h) - both(-h, h) + both(-h, -h)) / (8.0 * h * h);
                let got = normal[i * n + j];
                // Of 4e6 a metre.
                assert!((second - got).abs() < 50.0, "{i} {j}: {second} {got}");
            }
        }
    }
}
