//! What broken presets are answered, word for word: `broken.txt` holds presets and their diagnostics.
//!
//! After a change of wording run with `BLESS` set, and read the difference.

use super::*;

const GOLDEN: &str = include_str!("broken.txt");
const BROKEN_SPECIES: &str = "(
    height: 12.0, nodes: 100, tip_radius: 1.0,
    iterations: [
        (endpoints: Volume(shape: Sphere(radius: 1.0), count: 1)),
        (endpoints: Volume(shape: Cone(bottom: 0.9, top: 0.3, radius: 0.7), count: 30), guide: Random(low: 120, high: 30)),
        (endpoints: Surface(hops: 31, proportion: 60, count: 300), guide: Piecewise(frist: 30.0), kept: Any, start: ByHeight()),
        (guide: Polar(theta: 400)),
    ],
)";

fn answer(text: &str) -> String {
    let mut reads = Vec::new();
    let result = load("presets/case.ron", text, &mut |path| {
        reads.push(path.to_string());
        match path {
            "species/oak.ron" => Ok(OAK.to_string()),
            "species/broken.ron" => Ok(BROKEN_SPECIES.to_string()),
            "../shared/typo.ron" => Ok("(height: 12.0,, iterations: [".to_string()),
            "species/preset.ron" => Ok("(sources: {}, variants: [])".to_string()),
            _ => Err("no such file".to_string()),
        }
    });
    reads.sort_unstable();
    assert!(reads.windows(2).all(|pair| pair[0] != pair[1]), "a file was read twice: {reads:?}");
    match result {
        Ok(_) => "sound\n".to_string(),
        Err(found) => found.iter().map(|diagnostic| format!("{diagnostic}\n")).collect(),
    }
}

#[test]
fn broken_presets_are_answered_as_the_golden_says() {
    let mut told = String::new();
    for case in GOLDEN.split("=== ").skip(1) {
        let (name, rest) = case.split_once('\n').expect("a case has a name");
        let (text, _) = rest.split_once("---\n").expect("a case has an answer");
        told.push_str(&format!("=== {name}\n{text}---\n{}", answer(text)));
    }
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/src/preset/tests/broken.txt"), &told).expect("writes");
    }
    for (told, golden) in told.split("=== ").zip(GOLDEN.split("=== ")) {
        assert_eq!(told, golden, "\n{told}");
    }
    assert!(GOLDEN.matches("=== ").count() >= 25 && !GOLDEN.contains("---\nsound"));
}
