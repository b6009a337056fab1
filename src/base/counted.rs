//! Numbers of things in sentences for people.

/// A number with its noun: `1 row`, `2 rows`. Verbs that go with the noun may stand in both forms.
pub(crate) fn counted(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_one_is_one() {
        let told = [0, 1, 2].map(|n| counted(n, "row was", "rows were"));
        assert_eq!(told, ["0 rows were", "1 row was", "2 rows were"]);
    }
}
