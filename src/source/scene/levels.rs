//! What stands beside a tree in files made for engines: lower levels of detail, colliders.
//!
//! Engines know them by their names, and a reader that keeps them all finds one tree inside the other. A part whose name
//! ends in `_LOD1` or higher is left out where one of the same name with `_LOD0` is there, in any case of letters; so is
//! one with the prefix or suffix of a collider, as long as anything else is left.

use std::collections::BTreeSet;

use super::Scene;
use crate::base::counted;

/// Prefixes (Unreal) and suffixes (Godot) of colliders, in small letters.
const COLLIDERS: ([&str; 4], [&str; 4]) =
    (["ucx_", "ubx_", "usp_", "ucp_"], ["-col", "-colonly", "-convcol", "-convcolonly"]);

/// The name without its level, and the level.
fn level(name: &str) -> Option<(&str, u32)> {
    let at = name.rfind("_lod")?;
    let digits = &name[at + 4..];
    let sound = (1..=2).contains(&digits.len()) && digits.bytes().all(|b| b.is_ascii_digit());
    Some((&name[..at], digits.parse().ok().filter(|_| sound)?))
}

fn is_collider(name: &str) -> bool {
    COLLIDERS.0.iter().any(|p| name.starts_with(p)) || COLLIDERS.1.iter().any(|s| name.ends_with(s))
}

/// Leaves out lower levels and colliders, with a note.
pub(super) fn keep_finest(scene: &mut Scene) {
    let names: Vec<String> = scene.parts.iter().map(|p| p.name.to_ascii_lowercase()).collect();
    let finest: BTreeSet<&str> = names.iter().filter_map(|n| level(n)).filter(|l| l.1 == 0).map(|l| l.0).collect();
    let lower = |name: &str| level(name).is_some_and(|(stem, level)| level > 0 && finest.contains(stem));
    let left_out: Vec<bool> = names.iter().map(|n| lower(n) || is_collider(n)).collect();
    let count = left_out.iter().filter(|l| **l).count();
    if count == 0 || count == left_out.len() {
        return;
    }
    let mut keep = left_out.iter().map(|l| !l);
    scene.parts.retain(|_| keep.next().unwrap_or(true));
    let are = counted(
        count,
        "part is a lower level of detail or a collider",
        "parts are lower levels of detail or colliders",
    );
    scene.notes.push(format!("{are} by name: left out"));
}

#[cfg(test)]
mod tests {
    use super::super::Part;
    use super::*;

    #[test]
    fn only_the_finest_level_stays_and_no_collider() {
        let part = |name: &&str| Part { name: (*name).to_owned(), ..Part::default() };
        let kept = |names: &[&str]| {
            let mut scene = Scene { parts: names.iter().map(part).collect(), ..Scene::default() };
            keep_finest(&mut scene);
            (scene.parts.into_iter().map(|p| p.name).collect::<Vec<_>>(), scene.notes.len())
        };
        assert_eq!(kept(&["Oak_LOD0", "Oak_LOD1", "oak_lod10", "UCX_Oak"]).0, ["Oak_LOD0"]);
        assert_eq!(kept(&["Oak_LOD1", "Ash_LOD0", "x-colonly"]).0, ["Oak_LOD1", "Ash_LOD0"]);
        assert_eq!(kept(&["UCX_a", "b-col"]), (vec!["UCX_a".to_owned(), "b-col".to_owned()], 0));
        assert_eq!(kept(&["Oak_LOD0", "Oak_LOD0", "Oak_LODx", "_lod"]).0.len(), 4);
    }
}
