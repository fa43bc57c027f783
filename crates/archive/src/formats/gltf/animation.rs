//! Animations as clips of the file's nodes (glTF 2.0, 3.11).

use super::document::Document;
use super::schema::AnimationEntry;
use crate::Error;
use std::collections::HashSet;
use yugen_motion::{Clip, Curve, Interpolation, Property};

/// The most numbers of all keys together: channels may share what they read, and reading it again costs the file
/// nothing.
const MAX_NUMBERS: usize = 1 << 26;

/// The animations of a file; joints are its nodes.
pub(super) fn clips(doc: &Document) -> Result<Vec<Clip>, Error> {
    let mut numbers = 0;
    let mut taken = HashSet::new();
    let mut clips = Vec::new();
    for animation in &doc.root.animations {
        let mut clip = clip(doc, animation, &mut numbers)?;
        // Each can be called, though the file has no name for it or the same for several.
        let name = if clip.name.is_empty() { "animation".to_string() } else { clip.name };
        clip.name = name.clone();
        let mut number = 2;
        while !taken.insert(clip.name.clone()) {
            clip.name = format!("{name} {number}");
            number += 1;
        }
        clips.push(clip);
    }
    Ok(clips)
}

fn clip(doc: &Document, animation: &AnimationEntry, numbers: &mut usize) -> Result<Clip, Error> {
    let mut clip = Clip { name: animation.name.clone(), channels: Vec::new() };
    for channel in &animation.channels {
        // A channel without a node is for extensions.
        let Some(node) = channel.target.node else { continue };
        doc.entry(&doc.root.nodes, node, "node")?;
        let sampler = doc.entry(&animation.samplers, channel.sampler, "sampler of an animation")?;
        let property = match channel.target.path.as_str() {
            "translation" => Property::Translation,
            "rotation" => Property::Rotation,
            "scale" => Property::Scale,
            "weights" => Property::Weights,
            other => {
                let known = ["translation", "rotation", "scale", "weights"];
                return Err(Error::unknown(doc.at.clone(), "path of an animation", other, known));
            }
        };
        let interpolation = match sampler.interpolation.as_deref().unwrap_or("LINEAR") {
            "LINEAR" => Interpolation::Linear,
            "STEP" => Interpolation::Step,
            "CUBICSPLINE" => Interpolation::Cubic,
            other => {
                let known = ["LINEAR", "STEP", "CUBICSPLINE"];
                return Err(Error::unknown(doc.at.clone(), "interpolation", other, known));
            }
        };
        let times = doc.floats(sampler.input, 1)?;
        let values = doc.floats(sampler.output, property.width())?;
        *numbers += times.len() + values.len();
        if *numbers > MAX_NUMBERS {
            return Err(Error::TooLarge {
                at: doc.at.clone(),
                what: "the number of keys of all animations".into(),
                asked: *numbers as u64,
                limit: MAX_NUMBERS as u64,
            });
        }
        let curve = Curve::new(property, interpolation, times, values);
        clip.channels.push((node, curve.map_err(|e| doc.invalid(e.to_string()))?));
    }
    Ok(clip)
}
