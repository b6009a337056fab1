//! What is told of what a set wears: whose bark, which leaf where sources bring none, and fields that nothing wears.
//!
//! The import knows what a source lacks and not what the preset puts there; so its notes on looks are finished here, and
//! left out where other leaves or another bark are worn.

use std::sync::Arc;

use super::stages::SourcePlant;
use crate::bake;
use crate::base::Note;
use crate::preset::plan::{BarkArt, LeafArt, Wear};
use crate::preset::{BARE_IN_WINTER, Plan, TURNED};
use crate::source::foliage;

/// Fields of `foliage` that made leaves alone take, and those that leaves take which Treewright puts on branches.
const OF_PICTURES: &[&str] = &["size", "variation", "pictures", "resolution"];
const OF_PLACES: &[&str] = &["spread", "angle", "droop", "twig", "phyllotaxis"];

/// A note of an import's, as it is told of the plan's source of that index; none where it concerns nothing that is worn.
pub(super) fn told(plan: &Plan, source: usize, note: &str) -> Option<String> {
    let is_own = |wear: Wear| match wear {
        Wear::All => false,
        Wear::Rest => true,
        Wear::Source(index) => index == source,
    };
    let (own_leaves, own_bark) = (is_own(plan.leaf_wear), is_own(plan.bark_wear));
    if note == foliage::BARE {
        if stays_bare(plan) {
            return Some(format!("{note}, and stays bare; `foliage: (leaf: \"oak\")` dresses it"));
        }
        let leaf = leaf(plan);
        return (plan.dress.density > 0.0)
            .then(|| format!("{note}: dressed in {leaf}; `foliage: (density: 0)` leaves it bare"));
    }
    if let Some((filled, _)) = note.split_once(foliage::MADE_LEAVES).filter(|_| !own_leaves) {
        return Some(format!("{filled}: {}", leaf(plan)));
    }
    let of_leaves = note.starts_with(foliage::WHITE) || note.contains(foliage::UNMAPPED);
    let of_bark = note.starts_with(foliage::NO_BARK) || note.starts_with(foliage::MANY_BARKS);
    let is_worn = (own_leaves || !of_leaves) && (own_bark || !of_bark);
    is_worn.then(|| note.to_owned())
}

/// Whether an import's note is on how the source looks, which matters to nobody who only takes its branches.
pub(super) fn is_of_looks(note: &str) -> bool {
    note == foliage::BARE
        || note.contains(foliage::UNMAPPED)
        || [foliage::WHITE, foliage::NO_BARK, foliage::MANY_BARKS].iter().any(|begin| note.starts_with(begin))
}

/// Whether a mesh without leaves stays as it was drawn: a model of a dead tree is one, and who has the wood of a living one
/// says which leaf it bears. Scans and skeletons have no leaves by nature, and are dressed whatever is said.
pub(super) fn stays_bare(plan: &Plan) -> bool {
    plan.foliage_told.is_empty()
}

/// What the leaves are called that the plan puts on trees without.
fn leaf(plan: &Plan) -> String {
    match (plan.leaf_wear, &plan.leaf_art) {
        (Wear::Source(index), _) => format!("the leaves of \"{}\"", plan.sources[index].name),
        (_, LeafArt::Made { shape, .. }) => format!("made leaves, \"{}\"", format!("{shape:?}").to_lowercase()),
        (_, LeafArt::Files { color, .. }) => format!("the leaves of {color}"),
    }
}

/// The sources that something is made of, with their indices.
fn made(sources: &[Arc<SourcePlant>]) -> impl Iterator<Item = (usize, &Arc<SourcePlant>)> {
    sources.iter().enumerate().filter(|(_, source)| !source.plant.chains().is_empty())
}

/// The source whose bark the set wears: of several that bring some the first whose bark is a picture, or else the first. None
/// where the plan's own is worn, as where one brings none.
pub(super) fn bark_source(plan: &Plan, sources: &[Arc<SourcePlant>]) -> Option<usize> {
    match plan.bark_wear {
        Wear::All => None,
        Wear::Source(index) => Some(index),
        Wear::Rest if made(sources).all(|(_, source)| source.bark.is_some()) => {
            made(sources).find(|(_, source)| source.pictured).or_else(|| made(sources).next()).map(|(index, _)| index)
        }
        Wear::Rest => None,
    }
}

/// Says whose bark a set wears whose sources bring different ones, and how to choose.
fn one_bark(plan: &Plan, sources: &[Arc<SourcePlant>]) -> Option<Note> {
    let first = made(sources).find(|(_, source)| source.bark.is_some()).filter(|_| plan.bark_wear == Wear::Rest)?;
    let named = |index: usize| &plan.sources[index].name;
    let from = |index: usize| format!("`bark: (texture: From(\"{}\"))`", named(index));
    let message = if let Some(worn) = bark_source(plan, sources) {
        let (other, _) = made(sources).find(|(_, source)| source.bark != sources[worn].bark)?;
        let picture = if sources[worn].pictured { " whose bark is a picture" } else { "" };
        format!(
            "a set has one bark: all of its trees wear that of \"{}\", the first source{picture}; {} would choose that of \"{}\"",
            named(worn),
            from(other),
            named(other)
        )
    } else {
        let (bare, _) = made(sources).find(|(_, source)| source.bark.is_none())?;
        let own = match &plan.bark_art {
            BarkArt::Made { pattern, .. } => format!("a made one, \"{}\"", format!("{pattern:?}").to_lowercase()),
            BarkArt::Files { color, .. } => color.clone(),
        };
        format!(
            "a set has one bark, and \"{}\" brings none: all of its trees wear {own}; {} would choose that of \"{}\"",
            named(bare),
            from(first.0),
            named(first.0)
        )
    };
    Some(Note::new("bark", message))
}

/// Names the fields of `foliage` that are told and do nothing, as all trees have leaves of their own.
fn idle(plan: &Plan, sources: &[Arc<SourcePlant>]) -> Option<Note> {
    let among = |names: &[&str]| {
        let told = plan.foliage_told.iter().filter(|told| names.contains(&told.as_str()));
        told.map(|told| format!("`{told}`")).collect::<Vec<_>>()
    };
    let (pictures, places) =
        (if plan.leaf_wear == Wear::Rest { among(OF_PICTURES) } else { Vec::new() }, among(OF_PLACES));
    let all = [&pictures[..], &places[..]].concat();
    if all.is_empty() || makes_leaves(sources) {
        return None;
    }
    let list = |names: &[String]| match names {
        [rest @ .., last] if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        _ => names.concat(),
    };
    let have = if all.len() == 1 { "has" } else { "have" };
    let mut help = Vec::new();
    if !pictures.is_empty() {
        help.push(format!("`leaf: \"oak\"` puts made leaves in their place, which take {}", list(&pictures)));
    }
    if !places.is_empty() {
        let say = if places.len() == 1 { "says" } else { "say" };
        help.push(format!(
            "{} {say} how leaves are put on branches that bring none: import the wood alone",
            list(&places)
        ));
    }
    let message = format!("{} {have} no effect, as all leaves are the imports' own: {}", list(&all), help.join("; "));
    Some(Note::new("foliage", message))
}

/// Names what is to turn the leaves of sources none of which has any green.
fn unturned(plan: &Plan, sources: &[Arc<SourcePlant>]) -> Option<Note> {
    let worn = |index: usize| plan.leaf_wear == Wear::Rest || plan.leaf_wear == Wear::Source(index);
    let mut leafy =
        made(sources).filter(|(i, source)| worn(*i) && source.is_leafy()).map(|(_, source)| source).peekable();
    if plan.leaf_turn.is_none() || plan.own_density <= 0.0 || leafy.peek().is_none() {
        return None;
    }
    let field = if plan.foliage_told.iter().any(|told| told == "color") { "color" } else { "season" };
    let is_green = leafy.any(|source| source.leaf_maps.iter().any(bake::has_green));
    let message = "no picture that a source brings has green leaves, which alone turn: all keep their colours";
    (!is_green).then(|| Note::new(format!("foliage.{field}"), message))
}

/// Whether dressing puts leaves on some source.
fn makes_leaves(sources: &[Arc<SourcePlant>]) -> bool {
    made(sources).any(|(_, source)| source.plant.leaves().is_empty())
}

/// What the plan tells of itself, less what nothing wears, and what there is to tell of what its trees wear.
pub(super) fn notes(plan: &Plan, sources: &[Arc<SourcePlant>]) -> Vec<Note> {
    let is_rest = plan.leaf_wear == Wear::Rest;
    // The size of a made leaf is of no concern where none is, nor is what becomes of those that sources bring where none does.
    let makes_none = is_rest && !makes_leaves(sources);
    let brings_none = is_rest && made(sources).all(|(_, source)| source.plant.leaves().is_empty());
    let is_of_theirs = |note: &Note| [TURNED, BARE_IN_WINTER].contains(&note.message.as_str());
    let concerns = |note: &&Note| !(makes_none && note.about == "foliage.size" || brings_none && is_of_theirs(note));
    let of_plan = plan.notes.iter().filter(concerns).cloned();
    of_plan.chain(one_bark(plan, sources)).chain(idle(plan, sources)).chain(unturned(plan, sources)).collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bake::Maps;
    use crate::base::Rotation;
    use crate::plant::{Leaf, PlantBuilder};

    fn maps(shade: u8) -> Maps {
        let all = |value| vec![[value; 3]; 1];
        Maps { width: 1, height: 1, color: vec![[shade; 4]], normal: all(128), orm: all(255) }
    }

    /// A pole, perhaps with a leaf, and with a bark of a shade that is a picture or a colour.
    fn source(leafy: bool, bark: Option<(u8, bool)>) -> Arc<SourcePlant> {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y], &[0.1, 0.1]);
        if leafy {
            builder.leaf(Leaf::new(stem, 0.5, Rotation::IDENTITY, 0.1, 0));
        }
        let mut source = SourcePlant::grown(builder.finish().unwrap(), Vec::new());
        source.leaf_maps = vec![maps(9); usize::from(leafy)];
        (source.bark, source.pictured) = (bark.map(|(shade, _)| maps(shade)), bark.is_some_and(|bark| bark.1));
        Arc::new(source)
    }

    fn plan(fields: &str) -> Plan {
        let text = format!(
            "(sources: {{\"a\": Import(file: \"a.obj\"), \"b\": Import(file: \"b.obj\")}}, variants: [Source(\"a\")], {fields})"
        );
        crate::preset::load("set.ron", &text, &mut |_| Ok(String::new())).unwrap_or_else(|found| panic!("{found:?}"))
    }

    #[test]
    fn autumn_tells_of_pictures_that_turn() {
        let told = |fields: &str, leafy: [bool; 2]| {
            let found = notes(&plan(&format!("foliage: ({fields})")), &leafy.map(|leafy| source(leafy, None)));
            found.iter().any(|note| note.message == TURNED)
        };
        let autumn = |more: &str| format!("season: Autumn{more}");
        assert!(told(&autumn(""), [true, false]) && !told(&autumn(""), [false, false]));
        assert!(told(&autumn(", leaf: From(\"a\")"), [true, false]));
        assert!(told(&autumn(", leaf: Files(color: \"leaf.png\")"), [false, false]));
        for quiet in [", leaf: \"birch\"", ", density: 0.0", ", color: \"#aa3311\""].map(autumn) {
            assert!(!told(&quiet, [true, true]), "{quiet}");
        }
        for season in ["Spring", "Summer", "Winter"] {
            assert!(!told(&format!("season: {season}"), [true, true]));
        }
    }

    #[test]
    fn leaves_without_green_are_told_of_where_they_are_to_turn() {
        let told = |fields: &str, color: [u8; 3]| {
            let mut source = SourcePlant::clone(&source(true, None));
            let [r, g, b] = color;
            source.leaf_maps[0].color = vec![[r, g, b, 255]];
            let found = notes(&plan(&format!("foliage: ({fields})")), &[Arc::new(source.clone()), Arc::new(source)]);
            found.into_iter().find(|note| note.message.starts_with("no picture")).map(|note| note.about)
        };
        let (green, red) = ([80, 120, 40], [120, 40, 50]);
        assert_eq!(told("season: Autumn", red).as_deref(), Some("foliage.season"));
        assert_eq!(told("color: \"#aa3311\"", red).as_deref(), Some("foliage.color"));
        for (quiet, color) in [("season: Autumn", green), ("", red), ("season: Autumn, leaf: \"oak\"", red)] {
            assert_eq!(told(quiet, color), None, "{quiet}");
        }
    }

    #[test]
    fn winter_tells_of_leaves_that_sources_bring_and_lose() {
        let told = |fields: &str, leafy: [bool; 2]| {
            let found = notes(&plan(&format!("foliage: ({fields})")), &leafy.map(|leafy| source(leafy, None)));
            found.iter().any(|note| note.message == BARE_IN_WINTER)
        };
        assert!(told("season: Winter", [true, false]) && !told("season: Winter", [false, false]));
        for quiet in
            ["", "season: Winter, leaf: \"oak\"", "season: Winter, leaf: \"pine\"", "season: Winter, density: 0"]
        {
            assert!(!told(quiet, [true, true]), "{quiet}");
        }
    }

    #[test]
    fn a_set_tells_whose_bark_it_wears_where_its_sources_differ() {
        let told = |fields: &str, barks: [Option<(u8, bool)>; 2]| {
            let found = notes(&plan(fields), &barks.map(|bark| source(true, bark)));
            found.into_iter().map(|note| note.message).collect::<Vec<_>>().join(" ")
        };
        let both = [Some((1, false)), Some((2, true))];
        let found = told("", both);
        assert!(found.contains("wear that of \"b\", the first source whose bark is a picture"), "{found}");
        assert!(found.contains("`bark: (texture: From(\"a\"))`"), "{found}");
        let found = told("", [Some((1, false)), Some((2, false))]);
        assert!(found.contains("wear that of \"a\", the first source;") && found.contains("From(\"b\")"), "{found}");
        let found = told("", [None, Some((2, true))]);
        assert!(
            found.contains("\"a\" brings none") && found.contains("\"furrowed\"; `bark: (texture: From(\"b\"))`"),
            "{found}"
        );
        // The same bark twice, none at all, and one that is told.
        assert_eq!(told("", [Some((1, true)); 2]), "");
        assert_eq!(told("", [None; 2]), "");
        for bark in ["bark: (texture: From(\"a\"))", "bark: (texture: \"smooth\")"] {
            assert_eq!(told(bark, both), "");
        }
    }

    #[test]
    fn foliage_that_nothing_takes_is_told_and_a_leaf_that_nobody_wears_is_not() {
        let found = |fields: &str, leafy: [bool; 2]| {
            let found = notes(&plan(fields), &leafy.map(|leafy| source(leafy, None)));
            found.into_iter().map(|note| (note.about, note.message)).collect::<Vec<_>>()
        };
        let told = found("foliage: (angle: 90.0, droop: 1.0, size: 1.0)", [true; 2]);
        assert_eq!(told.len(), 1, "{told:?}");
        assert_eq!(told[0].0, "foliage");
        let says = |what: &str| assert!(told[0].1.contains(what), "{told:?}");
        says("`size`, `angle` and `droop` have no effect");
        says("`leaf: \"oak\"` puts made leaves in their place, which take `size`");
        says("`angle` and `droop` say how leaves are put on branches");
        // With a leaf that all wear its length counts, and with a bare source all does.
        let worn = found("foliage: (leaf: \"oak\", size: 0.1, twig: 1.0)", [true; 2]);
        assert!(worn.len() == 1 && worn[0].1.starts_with("`twig` has no effect"), "{worn:?}");
        let bare = found("foliage: (angle: 90.0, size: 1.0)", [true, false]);
        assert_eq!(bare.iter().map(|note| note.0.as_str()).collect::<Vec<_>>(), ["foliage.size"]);
        assert_eq!(found("foliage: (density: 0.5, most: 10)", [true; 2]), []);
    }

    #[test]
    fn what_an_import_lacks_is_told_with_what_takes_its_place() {
        let told = |foliage: &str, note: &str| told(&plan(&format!("foliage: ({foliage})")), 0, note);
        let bare = told("", foliage::BARE).unwrap();
        assert!(bare.contains("brings no leaves, and stays bare; `foliage: (leaf: \"oak\")` dresses it"), "{bare}");
        let oak = told("most: 900", foliage::BARE).unwrap();
        assert!(oak.contains("brings no leaves: dressed in made leaves, \"oak\"; `foliage: (density: 0)`"), "{oak}");
        assert!(told("leaf: \"birch\"", foliage::BARE).unwrap().contains("\"birch\""));
        assert!(told("leaf: From(\"b\")", foliage::BARE).unwrap().contains("the leaves of \"b\""));
        assert_eq!(told("density: 0", foliage::BARE), None);
        let filled = format!(
            "3 closed crowns were filled with branches and leaves{}beech in their colours",
            foliage::MADE_LEAVES
        );
        assert_eq!(told("", &filled), Some(filled.clone()));
        let birch = told("leaf: \"birch\"", &filled).unwrap();
        assert!(birch.ends_with("filled with branches and leaves: made leaves, \"birch\""), "{birch}");
    }

    #[test]
    fn notes_on_bark_are_told_only_where_it_is_worn() {
        let note = format!("{}: it is small", foliage::NO_BARK);
        let told = |bark: &str, source| told(&plan(&format!("bark: ({bark})")), source, &note).is_some();
        assert!(told("", 0) && told("texture: From(\"a\")", 0));
        assert!(!told("texture: From(\"b\")", 0) && !told("texture: \"smooth\"", 0));
    }
}
