//! Which joint of a skeleton is what of a body, by names.

use crate::Skeleton;
use crate::garment::GarmentError;

/// Which side of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Left,
    Right,
    Middle,
}

/// Parts that are known by their names: as the performer's are called, and what else joints at which they begin are called,
/// what is surer first.
pub(super) const PARTS: [(&str, &[&str]); 7] = [
    ("upper_arm", &["upperarm", "uparm", "arm", "humerus", "shoulder"]),
    ("forearm", &["forearm", "lowerarm", "lowarm", "radius", "elbow"]),
    ("hand", &["wrist", "hand", "palm"]),
    ("thigh", &["thigh", "upperleg", "upleg", "femur", "hip"]),
    ("shank", &["shank", "shin", "calf", "lowerleg", "lowleg", "tibia", "knee", "leg"]),
    ("foot", &["ankle", "foot"]),
    ("head", &["head"]),
];
/// Index of the head among them.
const HEAD: usize = 6;

/// What programs write before the names of all joints.
const PREFIXES: [&str; 6] = ["mixamorig", "bip01", "bip001", "def", "jnt", "joint"];

/// Side and plain word of a joint's name.
fn words(name: &str) -> (Side, String) {
    let own: Vec<char> = name.rsplit(':').next().unwrap_or(name).chars().collect();
    let mut tokens = vec![String::new()];
    for (i, c) in own.iter().enumerate() {
        let before = i.checked_sub(1).map(|k| own[k]);
        // `LeftArm`, `LHand`.
        let begins = c.is_uppercase()
            && (before.is_some_and(char::is_lowercase)
                || before.is_some_and(char::is_uppercase)
                    && own.get(i + 1).is_some_and(|n| n.is_lowercase()));
        if begins || !c.is_alphanumeric() {
            tokens.push(String::new());
        }
        if c.is_alphanumeric() {
            let at = tokens.len() - 1;
            tokens[at].extend(c.to_lowercase());
        }
    }
    let of_side = |t: &str| match t {
        "left" | "l" => Some(Side::Left),
        "right" | "r" => Some(Side::Right),
        _ => None,
    };
    let side = tokens.iter().find_map(|t| of_side(t));
    let kept =
        |t: &&String| of_side(t).is_none() && !PREFIXES.contains(&t.as_str()) && t.parse::<u32>().is_err();
    let word: String = tokens.iter().filter(kept).map(String::as_str).collect();
    if let Some(side) = side {
        return (side, word);
    }
    // `leftarm`, `lfemur`.
    let known = |rest: &&str| PARTS.iter().any(|(_, words)| words.contains(rest));
    for (short, long, side) in [("l", "left", Side::Left), ("r", "right", Side::Right)] {
        if let Some(rest) = word.strip_prefix(long).or(word.strip_prefix(short)).filter(known) {
            return (side, rest.into());
        }
    }
    (Side::Middle, word)
}

/// Joints of a body: of the left and the right the six parts of limbs, then what is in the middle.
pub(super) struct Found {
    pub limbs: [[usize; 6]; 2],
    pub head: usize,
    pub pelvis: usize,
    pub chest: usize,
}

impl Found {
    /// By their names, but for those that are `named` as the performer's.
    pub fn new(skeleton: &Skeleton, named: &[(String, String)]) -> Result<Self, GarmentError> {
        let joints = skeleton.joints();
        let known: Vec<(Side, String)> = joints.iter().map(|j| words(&j.name)).collect();
        let mut missing = Vec::new();
        let mut find = |side: Side, part: usize| -> Result<usize, GarmentError> {
            let (name, others) = PARTS[part];
            let full = match side {
                Side::Left => format!("left_{name}"),
                Side::Right => format!("right_{name}"),
                Side::Middle => name.to_string(),
            };
            if let Some((_, joint)) = named.iter().find(|(part, _)| *part == full) {
                return joints.iter().position(|j| j.name == *joint).ok_or_else(|| {
                    GarmentError::Body(format!("has no joint called '{joint}', which should be its {full}"))
                });
            }
            let of = |word: &&str| {
                skeleton.order().iter().copied().find(|j| known[*j].0 == side && known[*j].1 == **word)
            };
            let found = others.iter().find_map(of);
            if found.is_none() {
                missing.push(full);
            }
            Ok(found.unwrap_or(0))
        };
        let mut limbs = [[0; 6]; 2];
        for (limb, side) in limbs.iter_mut().zip([Side::Left, Side::Right]) {
            for (part, joint) in limb.iter_mut().enumerate() {
                *joint = find(side, part)?;
            }
        }
        let head = find(Side::Middle, HEAD)?;
        if let Some((part, _)) = named.iter().find(|(p, _)| !parts().any(|known| known == *p)) {
            let all: Vec<String> = parts().collect();
            return Err(GarmentError::Body(format!(
                "has no part '{part}'; expected one of {}",
                all.join(", ")
            )));
        }
        if !missing.is_empty() {
            let names: Vec<&str> = joints.iter().map(|j| j.name.as_str()).take(80).collect();
            return Err(GarmentError::Body(format!(
                "needs joints for {}; say which they are (the figure has {})",
                missing.join(", "),
                names.join(", ")
            )));
        }
        let above = |mut j: usize| {
            // No longer than there are joints, for they are a tree.
            let mut all = vec![j];
            while let Some(parent) = joints[j].parent {
                all.push(parent);
                j = parent;
            }
            all
        };
        for limb in &limbs {
            for pair in [[0, 1], [1, 2], [3, 4], [4, 5]] {
                let [from, to] = pair.map(|k| limb[k]);
                if from == to || !above(to).contains(&from) {
                    let [from, to] = [from, to].map(|j| &joints[j].name);
                    return Err(GarmentError::Body(format!(
                        "has '{to}' at a limb that does not begin with '{from}'"
                    )));
                }
            }
        }
        let common = |a: usize, b: usize| {
            let of = above(b);
            above(a).into_iter().find(|j| of.contains(j))
        };
        let pelvis = common(limbs[0][3], limbs[1][3]);
        let chest = common(limbs[0][0], limbs[1][0]);
        let trunk = pelvis.zip(chest).filter(|(p, c)| above(*c).contains(p) && above(head).contains(c));
        let (pelvis, chest) = trunk.ok_or_else(|| {
            GarmentError::Body(
                "has no joint that carries both legs and, above it, one that carries arms and head".into(),
            )
        })?;
        Ok(Self { limbs, head, pelvis, chest })
    }
}

/// What may be named.
fn parts() -> impl Iterator<Item = String> {
    let sided = |side: &'static str| PARTS[..HEAD].iter().map(move |(name, _)| format!("{side}_{name}"));
    sided("left").chain(sided("right")).chain([PARTS[HEAD].0.to_string()])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_many_makes_are_known() {
        for (name, side, word) in [
            ("mixamorig:LeftForeArm", Side::Left, "forearm"),
            ("mixamorig:RightUpLeg", Side::Right, "upleg"),
            ("upperarm.l", Side::Left, "upperarm"),
            ("Left_elbow", Side::Left, "elbow"),
            ("LHand", Side::Left, "hand"),
            ("rfemur", Side::Right, "femur"),
            ("Bip01 R Calf", Side::Right, "calf"),
            ("leftarm", Side::Left, "arm"),
            ("head", Side::Middle, "head"),
            ("Leg", Side::Middle, "leg"),
            ("LeftHandIndex1", Side::Left, "handindex1"),
            ("IK-foot.r", Side::Right, "ikfoot"),
        ] {
            assert_eq!(words(name), (side, word.to_string()), "{name}");
        }
    }
}
