//! What names of joints and markers say: the side of a body, and which part of it.

/// Which side of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodySide {
    /// Its left.
    Left,
    /// Its right.
    Right,
    /// Neither.
    Middle,
}

/// Parts that are known by their names: as the performer's are called, and what else joints at which they begin are called,
/// what is surer first.
pub(crate) const PARTS: [(&str, &[&str]); 7] = [
    ("upper_arm", &["upperarm", "uparm", "arm", "humerus", "shoulder"]),
    ("forearm", &["forearm", "lowerarm", "lowarm", "radius", "elbow"]),
    ("hand", &["wrist", "hand", "palm"]),
    ("thigh", &["thigh", "upperleg", "upleg", "femur", "hip"]),
    ("shank", &["shank", "shin", "calf", "lowerleg", "lowleg", "tibia", "knee", "leg"]),
    ("foot", &["ankle", "foot"]),
    ("head", &["head"]),
];
/// Index of the head among them.
pub(crate) const HEAD: usize = 6;

/// What programs write before the names of all joints.
const PREFIXES: [&str; 6] = ["mixamorig", "bip01", "bip001", "def", "jnt", "joint"];
/// How words of the middle of a body begin that begin as the sides do.
const MIDDLE: [&str; 6] = ["lower", "lumbar", "reference", "rib", "root", "rump"];

/// Which side of a body a joint or a marker of this name is on: `LeftArm`, `mixamorig:LeftArm`, `hand.l`, `lfemur`, `LWRA`.
pub fn side_of(name: &str) -> BodySide {
    words(name).0
}

/// Side and plain word of a joint's name.
pub(crate) fn words(name: &str) -> (BodySide, String) {
    let plain = name.rsplit(':').next().unwrap_or(name);
    let own: Vec<char> = plain.chars().collect();
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
        "left" | "l" => Some(BodySide::Left),
        "right" | "r" => Some(BodySide::Right),
        _ => None,
    };
    let side = tokens.iter().find_map(|t| of_side(t));
    let kept =
        |t: &&String| of_side(t).is_none() && !PREFIXES.contains(&t.as_str()) && t.parse::<u32>().is_err();
    let word: String = tokens.iter().filter(kept).map(String::as_str).collect();
    if let Some(side) = side {
        return (side, word);
    }
    let known = |word: &str| PARTS.iter().any(|(_, words)| words.contains(&word));
    if known(&word) || MIDDLE.iter().any(|m| word.starts_with(m)) {
        return (BodySide::Middle, word);
    }
    // Joints in small letters (`lfemur`, `rtoes end`) and markers in capitals (`LWRA`).
    let small = plain.chars().all(|c| c.is_ascii_lowercase() || c == ' ');
    let capitals = plain.len() > 2 && plain.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit());
    for (short, long, side) in [("l", "left", BodySide::Left), ("r", "right", BodySide::Right)] {
        let rest = word.strip_prefix(long).or(word.strip_prefix(short));
        if let Some(rest) = rest.filter(|rest| word.starts_with(long) || small || capitals || known(rest)) {
            return (side, rest.into());
        }
    }
    (BodySide::Middle, word)
}

#[cfg(test)]
mod tests {
    use super::*;
    use BodySide::{Left, Middle, Right};

    #[test]
    fn names_of_many_makes_are_known() {
        for (name, side, word) in [
            ("mixamorig:LeftForeArm", Left, "forearm"),
            ("mixamorig:RightUpLeg", Right, "upleg"),
            ("upperarm.l", Left, "upperarm"),
            ("Left_elbow", Left, "elbow"),
            ("LHand", Left, "hand"),
            ("rfemur", Right, "femur"),
            ("Bip01 R Calf", Right, "calf"),
            ("leftarm", Left, "arm"),
            ("head", Middle, "head"),
            ("Leg", Middle, "leg"),
            ("leg", Middle, "leg"),
            ("radius", Middle, "radius"),
            ("LeftHandIndex1", Left, "handindex1"),
            ("IK-foot.r", Right, "ikfoot"),
            ("lclavicle", Left, "clavicle"),
            ("rtoes end", Right, "toesend"),
            ("Daniel:LWRA", Left, "wra"),
            ("RANK", Right, "ank"),
            ("Right_palm", Right, "palm"),
            ("hand.L", Left, "hand"),
            ("foot_r", Right, "foot"),
            ("lowerback", Middle, "lowerback"),
            ("root", Middle, "root"),
            ("Daniel:C7", Middle, "c7"),
            ("Reference", Middle, "reference"),
            ("Spine", Middle, "spine"),
        ] {
            assert_eq!(words(name), (side, word.to_string()), "{name}");
        }
    }
}
