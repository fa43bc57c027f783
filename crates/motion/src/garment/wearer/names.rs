//! Which joint of a skeleton is what of a body, by names.

use crate::Skeleton;
use crate::garment::GarmentError;
use crate::names::{BodySide as Side, HEAD, PARTS, words};

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

    /// Where a hand is a joint of its own behind the wrist, it is the wrist at which the part begins.
    #[test]
    fn a_wrist_goes_before_a_hand() {
        let mut joints = crate::dance::player();
        let count = joints.len();
        for (side, short) in [("left", 'l'), ("right", 'r')] {
            let at = joints.iter().position(|j| j.name == format!("{side}_hand")).unwrap();
            joints[at].name = format!("wrist.{short}");
            let hand = crate::Joint { name: format!("hand.{short}"), parent: Some(at), ..joints[at].clone() };
            joints.push(hand);
        }
        let skeleton = Skeleton::new(joints).unwrap();
        let found = Found::new(&skeleton, &[]).unwrap();
        assert_eq!(found.limbs.map(|limb| limb[2]), [8, 12]);
        let named = [("left_hand".to_string(), "hand.l".to_string())];
        let found = Found::new(&skeleton, &named).unwrap();
        assert_eq!(found.limbs.map(|limb| limb[2]), [count, 12]);
    }
}
