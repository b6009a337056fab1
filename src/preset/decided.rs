//! `keep` and `reject`: what a designer decided about trees of an entry, by their numbers.
//!
//! An entry makes its trees in an order that depends on nothing else: a greater `count` keeps the first ones. So a number,
//! from 1, says which tree is meant as long as the entry's sources and seed stay. Kept trees are in the set whatever
//! `count` and `pick` say otherwise; rejected ones never, and the next ones take their place.

use super::plan::Decided;
use super::reader::Reader;
use super::schema::{Default, Field, Kind};

/// Highest number.
pub(super) const MOST_NUMBER: u64 = 2048;

const NUMBERS: Kind = Kind::Numbers { what: "trees' numbers", low: 1, high: MOST_NUMBER, most: 256 };

/// The field `keep`.
pub(super) const KEEP_FIELD: Field = Field {
    name: "keep",
    kind: NUMBERS,
    default: Default::Is("[]"),
    about: "trees of the entry that are in the set in any case, by number; the page of `treewright preview` writes it",
};

/// The field `reject`.
pub(super) const REJECT_FIELD: Field = Field {
    name: "reject",
    kind: NUMBERS,
    default: Default::Is("[]"),
    about: "trees of the entry that are not in the set; the next ones take their place",
};

/// Reads both fields of an entry that gives `count` trees.
pub(super) fn decided(fields: &Reader<'_, '_>, count: u64) -> Decided {
    let numbers = |name: &str| {
        let mut numbers: Vec<usize> = fields.numbers(name).into_iter().map(|n| n.max(1) as usize - 1).collect();
        numbers.sort_unstable();
        if let Some(twice) = numbers.windows(2).find(|pair| pair[0] == pair[1]) {
            fields.fault(name, format!("names tree {} twice", twice[0] + 1), "leave one of the two out");
        }
        numbers.dedup();
        numbers
    };
    let (keep, reject) = (numbers("keep"), numbers("reject"));
    if keep.len() as u64 > count {
        let message = format!("keeps {} trees where `count` is {count}", keep.len());
        fields.fault("keep", message, "raise `count`, or keep fewer");
    }
    if let Some(both) = keep.iter().find(|n| reject.contains(n)) {
        fields.fault("reject", format!("rejects tree {}, which `keep` keeps", both + 1), "leave one of the two out");
    }
    Decided { keep, reject }
}

impl Decided {
    /// How many trees must be made, so that `count` of them can be had and every kept one is among them.
    pub(super) fn reach(&self, count: u64) -> u64 {
        self.numbers(count).last().map_or(count, |last| *last as u64 + 1)
    }

    /// The trees of an entry that gives `count` trees as they come, from 0, rising: the kept ones and the first others.
    pub(super) fn numbers(&self, count: u64) -> Vec<usize> {
        let others = (count as usize).saturating_sub(self.keep.len());
        let free = |n: &usize| !self.keep.contains(n) && !self.reject.contains(n);
        let mut all: Vec<usize> = (0..).filter(free).take(others).collect();
        all.extend(&self.keep);
        all.sort_unstable();
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decided(keep: &[usize], reject: &[usize]) -> Decided {
        Decided { keep: keep.to_vec(), reject: reject.to_vec() }
    }

    #[test]
    fn kept_trees_stay_and_rejected_ones_give_way() {
        assert_eq!(decided(&[], &[]).numbers(3), [0, 1, 2]);
        assert_eq!(decided(&[7], &[]).numbers(3), [0, 1, 7]);
        assert_eq!(decided(&[1, 7], &[0]).numbers(3), [1, 2, 7]);
        assert_eq!(decided(&[2, 1], &[]).numbers(2), [1, 2]);
        assert_eq!(decided(&[], &[0, 2]).reach(3), 5);
        assert_eq!(decided(&[], &[]).reach(0), 0);
    }

    #[test]
    fn what_contradicts_itself_is_told_at_its_field() {
        let load = |fields: &str| {
            let text = format!(
                "(sources: {{\"a\": Import(file: \"a.csv\"), \"b\": Import(file: \"b.csv\")}}, \
                 variants: [Blend(of: [\"a\", \"b\"], count: 2, {fields})])"
            );
            crate::preset::load("a.ron", &text, &mut |_| Err(String::new()))
        };
        for (fields, field) in [
            ("keep: [1, 2, 3]", "variants[0].keep"),
            ("keep: [1], reject: [1]", "variants[0].reject"),
            ("keep: [0]", "variants[0].keep[0]"),
            ("reject: [4, 4]", "variants[0].reject"),
            ("reject: [5000]", "variants[0].reject[0]"),
            ("keep: [\"1\"]", "variants[0].keep[0]"),
            ("keep: 1", "variants[0].keep"),
        ] {
            let found = load(fields).expect_err(fields);
            assert_eq!(found.iter().map(|d| d.field.as_str()).collect::<Vec<_>>(), [field], "{fields}");
        }
        let plan = load("keep: [9], reject: [1]").expect("loads");
        assert_eq!(plan.origins.iter().map(|o| o.number).collect::<Vec<_>>(), [Some(2), Some(9)]);
        assert!(load("keep: [9], pick: Inspiring").expect("loads").selections[0].candidates.len() >= 9);
    }
}
