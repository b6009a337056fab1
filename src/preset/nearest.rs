//! The name that was probably meant.

/// Longest name that is compared; longer ones are no typing slip.
const MOST_CHARS: usize = 40;

/// The one of `names` nearest to `typed`, if one is near: at most one slip in three letters, case aside. Ties go to
/// the first.
pub(crate) fn nearest<'n>(typed: &str, names: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let letters: Vec<char> = typed.to_lowercase().chars().take(MOST_CHARS + 1).collect();
    if letters.len() > MOST_CHARS {
        return None;
    }
    let most = (letters.len() / 3).max(1);
    names
        .into_iter()
        .map(|name| (slips(&letters, &name.to_lowercase().chars().collect::<Vec<_>>()), name))
        .filter(|&(slips, name)| slips <= most && slips < name.len())
        .min_by_key(|&(slips, _)| slips)
        .map(|(_, name)| name)
}

/// Optimal string alignment distance: insertions, deletions, replacements and swaps of neighbours.
fn slips(a: &[char], b: &[char]) -> usize {
    let mut before: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for (i, &ca) in a.iter().enumerate() {
        let mut row = vec![i + 1];
        for (j, &cb) in b.iter().enumerate() {
            let mut least = (last[j] + usize::from(ca != cb)).min(last[j + 1] + 1).min(row[j] + 1);
            if i > 0 && j > 0 && ca == b[j - 1] && a[i - 1] == cb {
                least = least.min(before[j - 1] + 1);
            }
            row.push(least);
        }
        before = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_counted() {
        for (a, b, expected) in [("", "", 0), ("", "abc", 3), ("count", "conut", 1), ("kitten", "sitting", 3)] {
            let chars = |s: &str| s.chars().collect::<Vec<_>>();
            assert_eq!(slips(&chars(a), &chars(b)), expected, "{a} {b}");
        }
    }

    #[test]
    fn only_near_names_are_suggested() {
        let names = ["count", "matching", "of", "to"];
        assert_eq!(nearest("conut", names), Some("count"));
        assert_eq!(nearest("Count", names), Some("count"));
        assert_eq!(nearest("amount", names), Some("count"));
        assert_eq!(nearest("colour", names), None);
        assert_eq!(nearest("x", names), None);
        assert_eq!(nearest(&"c".repeat(1 << 20), names), None);
    }
}
