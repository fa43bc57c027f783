//! glTF 2.0 as motion: the joints of its skins and the nodes that carry them, moved by one of its animations; and such a
//! file, with sticks that follow the joints so that it can be seen.
//!
//! Lengths are metres and y is up, as the format has it. Keys may stand at any times: they are sampled at the rate at
//! which they are even, or at 60 a second.

use super::{Basis, Conventions, Motion, Options, up};
use crate::formats::gltf;
use crate::{Error, Place};
use glam::{Mat4, Vec3};
use serde_json::{Value as Json, json};
use std::path::Path;
use yugen_motion::{
    Clip, Interpolation, Joint, Placement, Property, SkeletalMotion, Skeleton, SkeletonError, sampled,
};
use yugen_scene::{Figure, suggest};

/// Where the keys are not even.
const RATE: f64 = 60.0;
/// The most numbers that keys are sampled to.
const MAX_NUMBERS: usize = 1 << 26;

/// Reads the figure that has the most joints.
///
/// # Errors
/// What is wrong in the file, and where it has nothing that moves.
pub fn read(bytes: &[u8], path: &Path, options: &Options) -> Result<(Motion, Conventions), Error> {
    let scene = gltf::read(bytes, path, &crate::formats::Options::default())?;
    let invalid = |problem: String| Error::invalid(Place::file(path), problem);
    let figure = scene.figures.iter().max_by_key(|f| f.skeleton.joints().len());
    let figure = figure.ok_or_else(|| invalid("there is no animation in this file".into()))?;
    let clip = match &options.animation {
        None => figure.clips.first(),
        Some(name) => figure.clips.iter().find(|c| c.name == *name),
    };
    let clip = clip.ok_or_else(|| {
        let name = options.animation.as_deref().unwrap_or_default();
        let hint = suggest(name, figure.clips.iter().map(|c| c.name.as_str()));
        invalid(format!("there is no animation called '{name}'{hint}"))
    })?;
    let moved = moved(figure, clip, options).map_err(invalid)?;
    Ok((Motion::Skeletal(moved), Conventions { unit: Some(1.0), axes: up('y').map(|a| (a, Basis::Stated)) }))
}

fn moved(figure: &Figure, clip: &Clip, options: &Options) -> Result<SkeletalMotion, String> {
    let all = figure.skeleton.joints();
    // Of joints and what carries them; of everything where there is no skin.
    let mut kept = vec![figure.skins.is_empty(); all.len()];
    for &joint in figure.skins.iter().flat_map(|s| &s.joints) {
        let mut next = Some(joint);
        while let Some(i) = next.filter(|i| !std::mem::replace(&mut kept[*i], true)) {
            next = all[i].parent;
        }
    }
    let mut places = vec![None; all.len()];
    let mut joints: Vec<Joint> = Vec::new();
    for (i, joint) in all.iter().enumerate().filter(|(i, _)| kept[*i]) {
        places[i] = Some(joints.len());
        joints.push(joint.clone());
    }
    for joint in &mut joints {
        joint.parent = joint.parent.and_then(|p| places[p]);
    }
    let curves: Vec<_> = clip
        .channels
        .iter()
        .filter(|(_, c)| c.property() != Property::Weights)
        .filter_map(|(joint, curve)| Some(((*places.get(*joint)?)?, curve)))
        .collect();
    let [first, last] = clip.span();
    let spacing = curves
        .iter()
        .filter_map(|(_, c)| even(c.times()))
        .fold(None, |a: Option<f64>, b| Some(a.map_or(b, |a| a.max(b))));
    let rate = options.rate.or(spacing).unwrap_or(RATE);
    let frames = (f64::from(last - first) * rate + 1e-3).floor() + 1.0;
    let width: usize = curves.iter().map(|(_, c)| c.property().width()).sum();
    if frames * width.max(1) as f64 > MAX_NUMBERS as f64 {
        return Err(format!("{frames} frames of {width} numbers are too many; give a lower --rate"));
    }
    let frames = frames as usize;
    let channels = curves.into_iter().map(|(joint, curve)| {
        let values = (0..frames).flat_map(|f| curve.at(first + (f as f64 / rate) as f32)).collect();
        (joint, curve.property(), values)
    });
    let clip = sampled(clip.name.clone(), rate, channels).map_err(|e| e.to_string())?;
    let mut skeleton = joints;
    // Where a skeleton stands in its figure.
    for joint in skeleton.iter_mut().filter(|j| j.parent.is_none() && figure.to_world != Mat4::IDENTITY) {
        joint.rest = Placement::Matrix(figure.to_world * joint.rest.matrix());
    }
    let skeleton = Skeleton::new(skeleton).map_err(|e| e.to_string())?;
    Ok(SkeletalMotion { skeleton, clip, rate, frames })
}

/// Keys a second where they are evenly apart.
fn even(times: &[f32]) -> Option<f64> {
    let [first, .., last] = times else { return None };
    let step = f64::from(last - first) / (times.len() - 1) as f64;
    let off = |(i, t): (usize, &f32)| (f64::from(t - first) - i as f64 * step).abs() > 0.01 * step;
    if times.iter().enumerate().any(off) {
        return None;
    }
    let rate = 1.0 / step;
    Some(if (rate - rate.round()).abs() < 1e-3 * rate { rate.round() } else { rate })
}

/// Binary data and what points into it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Json>,
    accessors: Vec<Json>,
}

impl Buffer {
    const FLOAT: u32 = 5126;
    const SHORT: u32 = 5123;
    const INTEGER: u32 = 5125;

    fn add(&mut self, data: &[u8], component: u32, kind: &str, count: usize, target: Option<u32>) -> usize {
        // Components lie at multiples of their size.
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": data.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.extend(data);
        self.views.push(view);
        self.accessors.push(json!({
            "bufferView": self.views.len() - 1, "componentType": component, "count": count, "type": kind,
        }));
        self.accessors.len() - 1
    }

    fn floats(&mut self, values: &[f32], kind: &str, target: Option<u32>) -> usize {
        let width = match kind {
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            _ => 1,
        };
        let data: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let index = self.add(&data, Self::FLOAT, kind, values.len() / width, target);
        // Times and positions must say their range.
        if matches!(kind, "SCALAR" | "VEC3") {
            let of = |i: usize| values.iter().skip(i).step_by(width).copied();
            self.accessors[index]["min"] = (0..width).map(|i| of(i).fold(f32::INFINITY, f32::min)).collect();
            self.accessors[index]["max"] =
                (0..width).map(|i| of(i).fold(f32::NEG_INFINITY, f32::max)).collect();
        }
        index
    }
}

/// The bytes of a GLB of this motion, which is in metres with +y up: its joints as nodes, its clip as an animation, and a
/// skin of sticks.
///
/// # Errors
/// Where a joint is at no place, or the format has no room.
pub fn write(moved: &SkeletalMotion, path: &Path) -> Result<Vec<u8>, Error> {
    const VERTICES: Option<u32> = Some(34962);
    const TRIANGLES: Option<u32> = Some(34963);
    let cannot = |problem: String| Error::invalid(Place::file(path), problem);
    let joints = moved.skeleton.joints();
    let mut nodes: Vec<Json> = joints
        .iter()
        .map(|joint| {
            let mut node = json!({ "name": joint.name });
            match joint.rest {
                Placement::Parts(parts) => {
                    node["translation"] = json!(parts.translation.to_array());
                    node["rotation"] = json!(parts.rotation.normalize().to_array());
                    node["scale"] = json!(parts.scale.to_array());
                }
                Placement::Matrix(m) => node["matrix"] = json!(m.to_cols_array()),
            }
            node
        })
        .collect();
    // What moves has no matrix.
    for (joint, _) in &moved.clip.channels {
        if let Some(node) = nodes.get_mut(*joint).and_then(Json::as_object_mut) {
            node.remove("matrix");
        }
    }
    let mut roots = Vec::new();
    for (i, joint) in joints.iter().enumerate() {
        match joint.parent {
            None => roots.push(i),
            Some(parent) => match nodes[parent].get_mut("children").and_then(Json::as_array_mut) {
                Some(children) => children.push(json!(i)),
                None => nodes[parent]["children"] = json!([i]),
            },
        }
    }
    let mut buffer = Buffer::default();
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    let mut known: Vec<(&[f32], usize)> = Vec::new();
    for (joint, curve) in &moved.clip.channels {
        let (target, kind) = match curve.property() {
            Property::Translation => ("translation", "VEC3"),
            Property::Rotation => ("rotation", "VEC4"),
            Property::Scale => ("scale", "VEC3"),
            Property::Weights => continue,
        };
        let input = match known.iter().find(|(times, _)| *times == curve.times()) {
            Some((_, index)) => *index,
            None => {
                let index = buffer.floats(curve.times(), "SCALAR", None);
                known.push((curve.times(), index));
                index
            }
        };
        let output = buffer.floats(curve.values(), kind, None);
        let interpolation = match curve.interpolation() {
            Interpolation::Linear => "LINEAR",
            Interpolation::Step => "STEP",
            Interpolation::Cubic => "CUBICSPLINE",
        };
        samplers.push(json!({ "input": input, "output": output, "interpolation": interpolation }));
        channels.push(json!({ "sampler": samplers.len() - 1, "target": { "node": joint, "path": target } }));
    }

    let rest = moved.skeleton.to_skeleton(&moved.skeleton.rest());
    let rest = rest.map_err(|e: SkeletonError| cannot(e.to_string()))?;
    let sticks = Sticks::of(joints, &rest);
    let inverse: Vec<f32> = rest
        .iter()
        .flat_map(|m| if m.determinant() == 0.0 { Mat4::IDENTITY } else { m.inverse() }.to_cols_array())
        .collect();
    let mut document = json!({
        "asset": { "version": "2.0", "generator": concat!("yugen ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
    });
    if !sticks.triangles.is_empty() {
        let flat = |all: &[Vec3]| all.iter().flat_map(|v| v.to_array()).collect::<Vec<f32>>();
        let positions = buffer.floats(&flat(&sticks.positions), "VEC3", VERTICES);
        let normals = buffer.floats(&flat(&sticks.normals), "VEC3", VERTICES);
        let count = sticks.joints.len();
        let bones: Vec<u8> =
            sticks.joints.iter().flat_map(|j| [*j, 0, 0, 0]).flat_map(u16::to_le_bytes).collect();
        let bones = buffer.add(&bones, Buffer::SHORT, "VEC4", count, VERTICES);
        let weights = buffer.floats(&[1.0, 0.0, 0.0, 0.0].repeat(count), "VEC4", VERTICES);
        let corners: Vec<u8> = sticks.triangles.iter().flat_map(|i| i.to_le_bytes()).collect();
        let corners = buffer.add(&corners, Buffer::INTEGER, "SCALAR", sticks.triangles.len(), TRIANGLES);
        let inverse = buffer.floats(&inverse, "MAT4", None);
        document["meshes"] = json!([{ "name": "sticks", "primitives": [{
            "attributes": { "POSITION": positions, "NORMAL": normals, "JOINTS_0": bones, "WEIGHTS_0": weights },
            "indices": corners,
        }] }]);
        let all: Vec<usize> = (0..joints.len()).collect();
        document["skins"] = json!([{ "joints": all, "inverseBindMatrices": inverse }]);
        roots.push(nodes.len());
        nodes.push(json!({ "name": "sticks", "mesh": 0, "skin": 0 }));
    }
    document["nodes"] = json!(nodes);
    document["scenes"] = json!([{ "nodes": roots }]);
    if !channels.is_empty() {
        let name = if moved.clip.name.is_empty() { "motion" } else { &moved.clip.name };
        document["animations"] = json!([{ "name": name, "samplers": samplers, "channels": channels }]);
    }
    buffer.bytes.resize(buffer.bytes.len().next_multiple_of(4), 0);
    if !buffer.bytes.is_empty() {
        document["buffers"] = json!([{ "byteLength": buffer.bytes.len() }]);
        document["bufferViews"] = json!(buffer.views);
        document["accessors"] = json!(buffer.accessors);
    }
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + text.len() + 8 + buffer.bytes.len();
    let length =
        u32::try_from(length).map_err(|_| cannot("a GLB holds 4 GiB at most; write a BVH".into()))?;
    let mut out = Vec::with_capacity(length as usize);
    out.extend(b"glTF");
    for word in [2, length, text.len() as u32] {
        out.extend(word.to_le_bytes());
    }
    out.extend(b"JSON");
    out.extend(&text);
    out.extend((buffer.bytes.len() as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(&buffer.bytes);
    Ok(out)
}

/// An octahedron from each joint's parent to it, which the parent carries.
#[derive(Default)]
struct Sticks {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    joints: Vec<u16>,
    triangles: Vec<u32>,
}

impl Sticks {
    /// How thick a stick is to its length, and how far from its parent it is thickest.
    const THICK: f32 = 0.08;
    const WAIST: f32 = 0.2;

    fn of(joints: &[Joint], places: &[Mat4]) -> Self {
        let mut all = Self::default();
        for (i, joint) in joints.iter().enumerate() {
            let Some((parent, carrier)) = joint.parent.and_then(|p| Some((p, u16::try_from(p).ok()?))) else {
                continue;
            };
            let [from, to] = [places[parent], places[i]].map(|m| m.w_axis.truncate());
            let along = to - from;
            if along.length() < 1e-6 {
                continue;
            }
            let side = along.any_orthogonal_vector().normalize_or_zero() * along.length() * Self::THICK;
            let other = along.normalize().cross(side);
            let waist = [side, other, -side, -other].map(|s| from + Self::WAIST * along + s);
            for k in 0..4 {
                let (a, b) = (waist[k], waist[(k + 1) % 4]);
                for [p, q, r] in [[from, b, a], [to, a, b]] {
                    let normal = (q - p).cross(r - p).normalize_or_zero();
                    all.triangles.extend((0..3).map(|c| all.positions.len() as u32 + c));
                    all.positions.extend([p, q, r]);
                    all.normals.extend([normal; 3]);
                    all.joints.extend([carrier; 3]);
                }
            }
        }
        all
    }
}
