//! Which body carries which: the 19 of a performer, and trees of others.

/// The bodies of a performer, each with the one that carries it: the pelvis carries all. Names are compared without case,
/// blanks, hyphens and underscores, and without what stands before a colon.
pub const PERFORMER: [(&str, &str); 19] = [
    ("pelvis", ""),
    ("waist", "pelvis"),
    ("chest", "waist"),
    ("neck", "chest"),
    ("head", "neck"),
    ("left_clavicle", "chest"),
    ("left_upper_arm", "left_clavicle"),
    ("left_forearm", "left_upper_arm"),
    ("left_hand", "left_forearm"),
    ("right_clavicle", "chest"),
    ("right_upper_arm", "right_clavicle"),
    ("right_forearm", "right_upper_arm"),
    ("right_hand", "right_forearm"),
    ("left_thigh", "pelvis"),
    ("left_shank", "left_thigh"),
    ("left_foot", "left_shank"),
    ("right_thigh", "pelvis"),
    ("right_shank", "right_thigh"),
    ("right_foot", "right_shank"),
];

/// What a performer may hold.
pub const HELD: [(&str, &str); 1] = [("fan", "right_hand")];

/// Other words for the same.
const WORDS: [(&str, &str); 22] = [
    ("hips", "pelvis"),
    ("hip", "pelvis"),
    ("spine", "waist"),
    ("abdomen", "waist"),
    ("ab", "waist"),
    ("thorax", "chest"),
    ("torso", "chest"),
    ("leftshoulder", "leftclavicle"),
    ("rightshoulder", "rightclavicle"),
    ("leftarm", "leftupperarm"),
    ("rightarm", "rightupperarm"),
    ("leftlowerarm", "leftforearm"),
    ("rightlowerarm", "rightforearm"),
    ("leftupperleg", "leftthigh"),
    ("rightupperleg", "rightthigh"),
    ("leftfemur", "leftthigh"),
    ("rightfemur", "rightthigh"),
    ("leftlowerleg", "leftshank"),
    ("rightlowerleg", "rightshank"),
    ("leftshin", "leftshank"),
    ("rightshin", "rightshank"),
    ("leftwrist", "lefthand"),
];

/// A name as it is compared.
fn plain(name: &str) -> String {
    let own = name.rsplit(':').next().unwrap_or(name);
    let letters: String =
        own.chars().filter(|c| !matches!(c, ' ' | '_' | '-')).flat_map(char::to_lowercase).collect();
    // `LHand`, `L_Thigh`.
    let sided = |letter: char, side: &str| {
        let rest = own.strip_prefix([letter, letter.to_ascii_lowercase()])?;
        let begins = rest.starts_with(|c: char| c.is_ascii_uppercase() || matches!(c, '_' | ' ' | '-'));
        begins.then(|| format!("{side}{}", &letters[1..]))
    };
    let letters = sided('L', "left").or(sided('R', "right")).unwrap_or(letters);
    WORDS.iter().find(|(word, _)| *word == letters).map_or(letters, |(_, same)| (*same).to_string())
}

/// Which bodies carry which, by what they are called: of each its place among those of a tree, and the index of the
/// body that carries it. A body that is not in the take is passed over: what it would carry hangs on what would carry it.
///
/// # Errors
/// The names that the tree does not have.
pub(super) fn parents(names: &[&str], tree: &[(&str, &str)]) -> Result<Vec<Option<usize>>, Vec<String>> {
    let same = |a: &str, b: &str| plain(a) == plain(b);
    let unknown: Vec<String> =
        names.iter().filter(|n| !tree.iter().any(|(t, _)| same(t, n))).map(|n| (*n).to_string()).collect();
    if !unknown.is_empty() {
        return Err(unknown);
    }
    let carrier = |name: &str| {
        let mut at = name;
        // No longer than the tree is deep.
        for _ in 0..tree.len() {
            at = tree.iter().find(|(t, _)| same(t, at))?.1;
            if let Some(i) = names.iter().position(|n| same(n, at)) {
                return Some(i);
            }
        }
        None
    };
    Ok(names.iter().map(|n| carrier(n)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_hang_on_what_is_there() {
        let names = ["actor:Head", "Chest", "L_Hand", "Hips", "left upper-arm"];
        assert_eq!(
            parents(&names, &PERFORMER).unwrap(),
            [Some(1), Some(3), Some(4), None, Some(1)],
            "neck, clavicle and forearm are missing"
        );
        assert_eq!(parents(&["tail"], &PERFORMER).unwrap_err(), ["tail"]);
        assert_eq!(plain("Left_Hip"), "lefthip");
        assert_eq!(plain("left"), "left");
        assert_eq!(plain("RFoot"), "rightfoot");
    }
}
