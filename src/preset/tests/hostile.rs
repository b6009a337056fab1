//! Texts that nobody means well: mutated, deep, huge. They are answered, quickly, and whatever our syntax accepts is
//! RON.

use super::*;
use crate::base::{Draws, Seed, Span};
use crate::preset::report::Report;
use crate::preset::syntax::{Node, Value, tree};

const CORPUS: [&str; 4] = [
    include_str!("../../../presets/avenue.ron"),
    include_str!("../../../presets/grove.ron"),
    OAK,
    r###"( // numbers and texts in all their forms
        a: [1, -2, +3, 0x1F, 0o17, 0b101, 1_000, 1.5, 1., .5, -1.5e-3, 2E+4, 1e9, NaN, inf, -inf],
        b: ["", "é\n\t\\\"\u{1F333}\x41", r"raw \", r#"raw "quoted""#, r##"#"#"##],
        c: {"k": Name, "l": Name(), "m": Name(1, 2), "n": Name(x: 1), "o": (), "p": (1,), "q": true, "r": _r1},
        /* block /* nested */ comment */ d: [[], {}, [()]],
    )"###,
];

/// A random text near the ones of the corpus.
fn mutant(draws: &mut Draws) -> String {
    const SCRAPS: [&str; 30] = [
        "(", ")", "[", "]", "{", "}", ",", ":", "\"", "'", "\\", "/*", "*/", "//", "\n", "r#\"", "#", "NaN", "-",
        "1e999", "0x", "_", "..", "Some(", "None", "inf", "true", "b\"", "\u{feff}", "é",
    ];
    let mut text: Vec<char> = CORPUS[draws.draw().index(CORPUS.len())].chars().collect();
    for _ in 0..=draws.draw().index(4) {
        let at = draws.draw().index(text.len() + 1);
        let end = (at + 1 + draws.draw().index(12)).min(text.len());
        match draws.draw().index(6) {
            0 => drop(text.drain(at..end)),
            1 => text.truncate(at),
            2 => {
                let slice = text[at..end].to_vec();
                let to = draws.draw().index(text.len() + 1);
                text.splice(to..to, slice);
            }
            3 => {
                let c = char::from_u32((draws.draw().bits() % 0x300) as u32).unwrap_or(' ');
                text.insert(at, c);
            }
            _ => drop(text.splice(at..at, SCRAPS[draws.draw().index(SCRAPS.len())].chars())),
        }
    }
    text.into_iter().collect()
}

fn is_inside(span: Span, text: &str) -> bool {
    let lines: Vec<&str> = text.split('\n').collect();
    let column = |line: u32, column: u32| {
        lines.get(line as usize - 1).is_some_and(|line| column >= 1 && column as usize <= line.chars().count() + 1)
    };
    (span.line, span.column) <= (span.end_line, span.end_column)
        && column(span.line, span.column)
        && column(span.end_line, span.end_column)
}

#[test]
fn mutated_presets_are_answered_with_places_inside_the_text() {
    let mut draws = Seed::new(11).draws();
    let mut sound = 0;
    for _ in 0..3000 {
        let text = mutant(&mut draws);
        let read = &mut |_: &str| Ok(OAK.to_string());
        for result in [load("a.ron", &text, read).map(drop), species("a.ron", &text).map(drop)] {
            sound += usize::from(result.is_ok());
            let Err(found) = result else { continue };
            assert!(!found.is_empty() && found.len() <= 65, "{text}");
            for diagnostic in found {
                let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
                assert!(!diagnostic.message.is_empty());
                assert!(diagnostic.span.is_none_or(|span| is_inside(span, text)), "{diagnostic}\n{text}");
            }
        }
    }
    assert!(sound > 50, "mutants are too harsh to test what is accepted: {sound}");
}

/// What RON's own value has no room for, though typed RON takes it: presets refuse it by their ranges.
fn is_plain(node: &Node) -> bool {
    match &node.value {
        Value::Integer(value) => (i128::from(i64::MIN)..=i128::from(u64::MAX)).contains(value),
        Value::Record(_, fields) => fields.iter().all(|(_, node)| is_plain(node)),
        Value::Tuple(_, items) | Value::List(items) => items.iter().all(is_plain),
        Value::Map(entries) => entries.iter().all(|(key, node)| is_plain(key) && is_plain(node)),
        _ => true,
    }
}

#[test]
fn what_is_accepted_is_ron() {
    let accepted = |text: &str| {
        let report = Report::new("a.ron");
        tree(text, &report).filter(|node| report.is_clean() && is_plain(node)).is_some()
    };
    for text in CORPUS {
        assert!(accepted(text) && ron::from_str::<ron::Value>(text).is_ok(), "{text}");
    }
    let mut draws = Seed::new(12).draws();
    let (mut both, mut neither) = (0, 0);
    for _ in 0..3000 {
        let text = mutant(&mut draws);
        let ron = ron::from_str::<ron::Value>(text.strip_prefix('\u{feff}').unwrap_or(&text));
        if accepted(&text) {
            assert!(ron.is_ok(), "{}\n{text}", ron.unwrap_err());
            both += 1;
        } else {
            neither += usize::from(ron.is_err());
        }
    }
    assert!(both > 300 && neither > 300, "{both} {neither}");
}

#[test]
fn deep_nesting_is_an_error_and_overflows_nothing() {
    for open in ["(", "[", "{", "(a:", "A(", "[(", "{1:"] {
        let found = load("a.ron", &open.repeat(100_000), &mut |_| Err(String::new())).unwrap_err();
        assert!(found[0].message.contains("deeper than 64"), "{open}: {:?}", found[0]);
        assert!(found.len() < 3, "{open}: {} errors", found.len());
    }
    let report = Report::new("a.ron");
    assert!(tree(&format!("{}{}", "[".repeat(64), "]".repeat(64)), &report).is_some() && report.is_clean());
}

#[test]
fn huge_texts_are_answered_with_few_errors() {
    let many = |start: &str, entry: &str, end: &str| {
        let mut text = start.to_string();
        while text.len() < 1 << 20 {
            text.push_str(entry);
        }
        text + end
    };
    for text in [
        many("(variants: [", "Source(\"x\"),", "])"),
        many("(sources: {", "\"x\": Grow(),", "})"),
        many("(", "sead: 1,", ")"),
        many("(", "1 ", ")"),
        many("", "é", ""),
        many("(", "\"", ")"),
        many("(", "\"\n", ")"),
        many("r", "#", ""),
        many("r##\"", "\"#", ""),
        many("", "/*", ""),
        many("(seed: ", "9", ")"),
        many("(seed: 1.", "9", ")"),
        many("(lods: [", "Full,", "])"),
        many("(lods: [", "]", "])"),
        many("(variants: [Source(\"", "x", "\")])"),
        many("(", "x", ": 1)"),
        " ".repeat((4 << 20) + 1),
    ] {
        let found = load("a.ron", &text, &mut |_| Err(String::new())).unwrap_err();
        let shown = found.iter().map(|diagnostic| diagnostic.to_string().len()).sum::<usize>();
        assert!((1..=65).contains(&found.len()) && shown < 40_000, "{}…: {} {shown}", &text[..10], found.len());
    }
}

#[test]
fn what_is_pasted_or_left_by_a_merge_is_told_as_that() {
    let told = |text: &str| {
        let found = load_with_oak(text).expect_err("it is wrong");
        found.into_iter().map(|d| (d.span.map(|span| span.line), d.message, d.hint)).collect::<Vec<_>>()
    };
    let good =
        "(\n    seed: 1,\n    sources: {\"a\": Grow(species: \"species/oak.ron\")},\n    variants: [Source(\"a\")],\n)";
    assert!(load_with_oak(good).is_ok());
    for (blank, name) in
        [("\u{a0}", "U+00A0"), ("\u{200b}\u{200b}", "U+200B"), ("\u{202e}", "U+202E"), ("\u{3000}", "U+3000")]
    {
        let found = told(&good.replace("seed: 1", &format!("seed:{blank}1")));
        assert!(found.len() == 1 && found[0].0 == Some(2) && found[0].1.contains(name), "{found:?}");
    }
    let conflict =
        good.replace("    seed: 1,\n", "<<<<<<< HEAD\n    seed: 1,\n=======\n    seed: 2,\n>>>>>>> theirs\n");
    let found = told(&conflict);
    assert!(
        found[0].0 == Some(2) && found[0].1.contains("merge") && found[0].2.contains("one of its sides"),
        "{found:?}"
    );
    // However many of them there are.
    told(&"\u{a0} /**/ ".repeat(100_000));
    told(&"=======\n".repeat(100_000));
}
