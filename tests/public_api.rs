//! What the library makes public stands in `tests/public_api.txt`, so that no change of it goes unseen: who changes it
//! on purpose renews the list by `BLESS=1 cargo test --test public_api` and reads the difference.

mod api;

use std::fs;
use std::path::Path;

#[test]
fn the_public_face_is_the_one_that_is_written_down() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let listed = api::listing(&root.join("src/lib.rs"));
    let golden = root.join("tests/public_api.txt");
    if std::env::var_os("BLESS").is_some() {
        fs::write(&golden, listed.join("\n") + "\n").unwrap();
    }
    let known = fs::read_to_string(&golden).unwrap();
    let known: Vec<&str> = known.lines().collect();
    let gone: Vec<_> = known.iter().filter(|line| !listed.iter().any(|l| l == *line)).collect();
    let new: Vec<_> = listed.iter().filter(|line| !known.contains(&line.as_str())).collect();
    assert!(
        gone.is_empty() && new.is_empty(),
        "the public face changed.\ngone: {gone:#?}\nnew: {new:#?}\nIf that is meant: BLESS=1 cargo test --test public_api, \
         and a line in CHANGELOG.md"
    );
}
