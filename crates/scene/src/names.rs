//! Names that people type: the one that was meant.

/// The end of a sentence about a word that is none of `known`: what was probably meant, or what there is where that is
/// a short list.
pub fn suggest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    // Two of a list may share a word, as formats share extensions.
    let mut known: Vec<&str> = known.into_iter().collect();
    let mut seen = std::collections::HashSet::new();
    known.retain(|word| seen.insert(*word));
    match nearest(name, known.iter().copied()) {
        Some(word) => format!("; did you mean '{word}'?"),
        // A list longer than this helps nobody.
        None if known.is_empty() || known.len() > 24 => String::new(),
        None => format!("; expected one of {}", known.join(", ")),
    }
}

/// The known word nearest to `word`, if one is near enough to be what was meant: edit distance with
/// transpositions at most a third of the longer word; else one that begins with it.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let fold = |w: &str| w.to_lowercase().replace('-', "_");
    let word = fold(word);
    // A word this long is no slip of the pen, and the distance costs the product of the lengths.
    if word.len() > 64 {
        return None;
    }
    let known: Vec<&str> = known.into_iter().collect();
    let near = known
        .iter()
        .copied()
        .map(|k| (edit_distance(&word, &fold(k)), k))
        .filter(|(d, k)| 3 * d <= k.chars().count().max(word.chars().count()))
        .min_by_key(|(d, _)| *d)
        .map(|(_, k)| k);
    // Or what goes on where the word ends: gold for gold-paint.
    near.or_else(|| {
        let longer = known.into_iter().filter(|k| word.chars().count() > 2 && fold(k).starts_with(&word));
        longer.min_by_key(|k| k.len())
    })
}

/// Damerau-Levenshtein distance, optimal string alignment: insert, delete, replace, swap neighbours.
fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows = vec![vec![0usize; b.len() + 1]; a.len() + 1];
    rows[0] = (0..=b.len()).collect();
    for i in 1..=a.len() {
        rows[i][0] = i;
        for j in 1..=b.len() {
            let replace = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut best = replace.min(rows[i - 1][j] + 1).min(rows[i][j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(rows[i - 2][j - 2] + 1);
            }
            rows[i][j] = best;
        }
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_word_is_found_and_a_far_one_is_not() {
        let known = ["roughness", "reflectance", "alpha", "sigma_x"];
        assert_eq!(nearest("rougness", known), Some("roughness"));
        assert_eq!(nearest("relfectance", known), Some("reflectance"));
        assert_eq!(nearest("Sigma-X", known), Some("sigma_x"));
        assert_eq!(nearest("temperature", known), None);
        assert_eq!(nearest("refl", known), Some("reflectance"));
        assert_eq!(nearest("re", known), None);
        assert_eq!(suggest("x", ["b", "a", "b"]), "; expected one of b, a");
    }
}
