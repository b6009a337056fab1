//! The tables of the schema: every default is sound, in its range, and what an absent field means.

use super::*;
use crate::preset::plan::{ANY, BlendTree, ColliderParams, FilterParams, LeafCards, Lod, LodBudget, Pick, Wear};
use crate::preset::report::Report;
use crate::preset::schema::{Choice, Default, Form, Kind, Record};
use crate::preset::set::SET;
use crate::preset::species::SPECIES;
use crate::preset::syntax::{Node, Value, tree};

/// Everything that the tables give a default for.
const SPELLED_OUT: &str = r##"(
    seed: 1,
    sources: {
        "oak": Grow(species: "species/oak.ron", seed: 1, height: 12.0),
        "scan": Import(file: "scan.csv", up: Detect),
    },
    variants: [
        Blend(
            of: ["oak", "scan"], count: 3, from: 0.15, to: 0.85, batches: 3, seed: 0,
            matching: (crown: 0.5, direction: 0.3, ratio: 0.2), pick: All,
        ),
    ],
    foliage: (
        leaf: "oak", season: Summer, density: 1.0, most: 20000, size: 0.086, spread: 0.25, angle: 55.0, droop: 0.15, twig: 0.35,
        color: "#4f6b2a", variation: 0.3, pictures: 4, resolution: 256,
    ),
    bark: (texture: "furrowed", tiling: 1.5, color: "#6b5a48", resolution: 1024),
    mesh: (sides: 12, error: 0.01, forks: Collar, leaves: Folded, wind: Nothing, lightmap: 0),
    lods: [Full, Thinned(triangles: 0.4), BillboardCloud(cards: 48), Impostor],
    atlas: (size: 2048, gutter: 8),
    colliders: (thick: 0.05, capsules: 32, crown: 0, corners: 32),
    engines: [Generic],
)"##;

const SHORT: &str = r#"(
    sources: {"scan": Import(file: "scan.csv"), "oak": Grow(species: "species/oak.ron")},
    variants: [Blend(of: ["oak", "scan"], count: 3)],
)"#;

#[test]
fn what_is_left_out_has_the_documented_default() {
    let (short, mut full) = (load_with_oak(SHORT).expect("loads"), load_with_oak(SPELLED_OUT).expect("loads"));
    // Leaves and bark that are named are worn by every tree, those that are not by trees that bring none.
    assert_eq!((full.leaf_wear, full.bark_wear), (Wear::All, Wear::All));
    (full.leaf_wear, full.bark_wear) = (Wear::Rest, Wear::Rest);
    // A size that is told is kept on trees of any size.
    assert_eq!(full.dress.leaf_share, 0.0);
    full.dress.leaf_share = short.dress.leaf_share;
    // Nor do sides or an error that are told hang on the tree.
    assert_eq!((full.mesh.most_sides, full.mesh.error_share), (12, 0.0));
    assert_eq!((short.mesh.on(2.0).error, short.mesh.on(9.0).error, full.mesh.on(2.0).error), (0.005, 0.01, 0.01));
    (full.mesh.most_sides, full.mesh.error_share) = (short.mesh.most_sides, short.mesh.error_share);
    // What is told is known, so that a build can say what of it does nothing.
    assert!(short.foliage_told.is_empty() && full.foliage_told.contains(&"droop".to_owned()));
    full.foliage_told.clear();
    assert_eq!(short, full);
    let progress: Vec<f32> = short
        .variants
        .iter()
        .map(|variant| match variant {
            Variant::Blend { tree: BlendTree::State { progress, .. }, .. } => *progress,
            _ => 0.0,
        })
        .collect();
    assert!(progress.iter().zip([0.5, 0.325, 0.675]).all(|(a, b)| (a - b).abs() < 1e-6), "{progress:?}");
}

#[test]
fn leaf_cards_and_colliders_are_as_asked_and_the_usual_ones_leave_no_mark() {
    let with = |more: &str| load_with_oak(&SHORT.replace("count: 3)],", &format!("count: 3)], {more}")));
    let leaves = |text: &str| with(&format!("mesh: (leaves: {text})")).map(|plan| plan.mesh.leaves);
    assert_eq!(leaves("Flat"), Ok(LeafCards::Flat));
    assert_eq!(leaves("Bent"), Ok(LeafCards::Bent));
    assert_eq!(leaves("CutOut"), Ok(LeafCards::CutOut { corners: 16 }));
    assert_eq!(leaves("CutOut(corners: 9)"), Ok(LeafCards::CutOut { corners: 9 }));
    for wrong in ["CutOut(corners: 7)", "CutOut(corners: 33)", "Round", "Flat(corners: 9)"] {
        assert!(leaves(wrong).is_err(), "{wrong}");
    }
    let plan = with("colliders: (thick: 0.1, capsules: 4, crown: 3, corners: 64)").expect("loads");
    assert_eq!(plan.colliders, ColliderParams { least_radius: 0.1, most: 4, crown: 3, corners: 64 });
    assert!(with("colliders: (corners: 7)").is_err() && with("colliders: (crown: 17)").is_err());
    let of_unity = |corners: u32| with(&format!("colliders: (crown: 1, corners: {corners}), engines: [Unity]"));
    assert!(of_unity(129).is_ok() && with("colliders: (crown: 1, corners: 255)").is_ok());
    let told = of_unity(130).expect_err("Unity takes 255 triangles");
    assert!(told[0].to_string().contains("255 triangles"), "{told:?}");
    // Keys of sets are made of this: those that do not ask for anything keep theirs.
    let text = |plan: &Plan| serde_json::to_string(plan).expect("a plan is text");
    let usual = text(&load_with_oak(SHORT).expect("loads"));
    assert!(
        !usual.contains("colliders")
            && usual.contains("\"forks\":\"Collar\",\"backs\":\"Doubled\",\"roots\":0.7,\"flare\":0.38}"),
        "{usual}"
    );
    assert!(text(&plan).contains("colliders"));
}

#[test]
fn levels_take_over_where_the_preset_tells_and_else_where_it_is_measured() {
    let lods = |text: &str| {
        let lods = format!("count: 3)], lods: {text}");
        load_with_oak(&SHORT.replace("count: 3)]", &lods)).map(|plan| plan.lods)
    };
    let told = |lod, screen| LodBudget { lod, screen };
    let (cloud, crossed) = (Lod::BillboardCloud { cards: 48 }, Lod::CrossedQuads);
    assert_eq!(
        lods("[Full, Thinned(triangles: 0.5, screen: 0.6), BillboardCloud, CrossedQuads(screen: 0.1)]"),
        Ok(vec![
            Lod::Full.into(),
            told(Lod::thinned(0.5), Some(0.6)),
            told(cloud.clone(), None),
            told(crossed.clone(), Some(0.1)),
        ])
    );
    assert_eq!(
        lods("[Full, BillboardCloud(screen: 0.25), CrossedQuads]"),
        Ok(vec![Lod::Full.into(), told(cloud, Some(0.25)), crossed.into()])
    );
    assert!(lods("[Full, Impostor(screen: 0.0)]").is_err());
}

#[test]
fn autumn_has_many_colours_unless_one_is_told() {
    let art = |foliage: &str| {
        load_with_oak(&SHORT.replace("count: 3)]", &format!("count: 3)], foliage: ({foliage})")))
            .expect("loads")
            .leaf_art
    };
    let tints = |foliage: &str| [0, 1, 2, 3].map(|picture| art(foliage).tint(picture));
    let [first, second, third, fourth] = tints("leaf: \"maple\", season: Autumn");
    // Red first, then ever yellower.
    let yellow = |c: [f32; 3]| c[1] / c[0];
    assert!(yellow(first) < yellow(third) && yellow(third) < yellow(second) && yellow(second) < yellow(fourth));
    let is_one = |tints: [[f32; 3]; 4]| tints.iter().all(|tint| *tint == tints[0]);
    assert!(is_one(tints("leaf: \"maple\"")) && is_one(tints("leaf: \"pine\", season: Autumn")));
    assert!(is_one(tints("leaf: \"maple\", season: Autumn, color: \"#aa3311\"")));
}

#[test]
fn budgets_are_shares_or_numbers_of_triangles() {
    let with = |more: &str| load_with_oak(&SHORT.replace("count: 3)]", &format!("count: 3)], {more}")));
    let lods = |text: &str| with(&format!("lods: [Full, {text}]")).map(|plan| plan.lods[1..].to_vec());
    assert_eq!(lods("Thinned(most: 900)"), Ok(vec![Lod::Thinned { triangles: 0.95, most: 900 }.into()]));
    assert_eq!(
        lods("Thinned(triangles: 0.4, most: 900), Thinned(most: 800)").map(|lods| lods.len()),
        Ok(2),
        "fewer by number"
    );
    let told = |text: &str| lods(text).expect_err("is wrong")[0].to_string();
    assert!(told("Thinned()").contains("missing") && told("Thinned(most: 100)").contains("200"));
    assert!(told("Thinned(most: 900), Thinned(most: 900)").contains("no fewer triangles"));
    let most = |text: &str| with(text).map(|plan| plan.mesh.most);
    assert_eq!((most("mesh: ()"), most("mesh: (most: 5000)")), (Ok(ANY), Ok(5000)));
}

#[test]
fn species_defaults_are_the_documented_ones() {
    let short = species("a.ron", "(height: 2, iterations: [(endpoints: Surface(k: 2, count: 3))])");
    let full = "(height: 2.0, nodes: 30000, width: 1.2, tip_radius: 0.004, allometry: 2.5, crookedness: 0.3, bole: 0, slenderness: 300, iterations: [(
        endpoints: Surface(k: 2, t: 1.0, count: 3, sampling: Poisson),
        guide: Constant(alpha: 0.0), start: Kept, keep: Any,
    )])";
    assert_eq!(short, species("a.ron", full));
    assert!(short.is_ok());
}

#[test]
fn a_pick_makes_candidates_of_which_count_are_kept() {
    let with = |more: &str| load_with_oak(&SHORT.replace("count: 3", &format!("count: 3, {more}"))).expect("loads");
    let plan = with("pick: Inspiring");
    let [selection] = &plan.selections[..] else { panic!("one selection") };
    assert_eq!((selection.candidates.len(), selection.keep, selection.field.as_str()), (18, 3, "variants[0]"));
    // The first candidates are the trees that would have been made without a pick.
    assert_eq!(selection.candidates[..3], load_with_oak(SHORT).expect("loads").variants[..]);
    assert_eq!(plan.variants, (0..3).map(|place| Variant::Selected { selection: 0, place }).collect::<Vec<_>>());
    let full = "pick: Inspiring, candidates: 18, scores: (crown: 0.4, ratio: 0.2, topology: 0.4), \
         filter: Plausible(collisions: 0.01, rise: 0.01, botany: 2)";
    assert_eq!(plan, with(full));
    // A filter alone makes spare trees, and what is let through is kept as it comes.
    assert_eq!(with("filter: Plausible()").selections[0].candidates.len(), 18);
    assert_eq!(with("pick: Diverse(apart: 0.1)").selections[0].pick, Pick::Diverse { apart: 0.1 });
}

#[test]
fn blends_are_cleared_of_what_runs_into_itself_unless_told_otherwise() {
    let filter = |entry: &str| {
        let text = SHORT.replace("Blend(of: [\"oak\", \"scan\"], count: 3)", entry);
        load_with_oak(&text).map(|plan| plan.blends[0].filter).map_err(|found| found[0].to_string())
    };
    let mix = |more: &str| filter(&format!("Mix(of: {{\"oak\": 1, \"scan\": 2}}{more})"));
    let blend = |more: &str| filter(&format!("Blend(of: [\"oak\", \"scan\"], count: 3{more})"));
    assert_eq!([mix(""), blend("")], [Ok(Some(FilterParams::CLEARED)), Ok(Some(FilterParams::CLEARED))]);
    let none = ", filter: None";
    // A selection filters by itself.
    assert_eq!([mix(none), blend(none), blend(", pick: Natural")], [Ok(None), Ok(None), Ok(None)]);
    let own = FilterParams { collisions: 0.5, ..FilterParams::CLEARED };
    assert_eq!(mix(", filter: Plausible(collisions: 0.5)"), Ok(Some(own)));
    assert!(mix(", filter: Plausible(botany: 2)").unwrap_err().contains("botany"));
}

#[test]
fn sequences_keep_the_papers_number_of_inspiring_trees() {
    let with = |more: &str| load_with_oak(&SHORT.replace("count: 3", more));
    let kept = |more: &str| with(more).unwrap_or_else(|found| panic!("{found:?}")).selections[0].keep;
    // ⌈√(N/2)⌉ of N.
    assert_eq!(kept("batches: 2, trees: 100, pick: Inspiring"), 10);
    assert_eq!(kept("batches: 2, trees: 101, pick: Inspiring"), 11);
    assert_eq!(kept("batches: 2, trees: 100, pick: Inspiring, count: 3"), 3);
    for alone in ["trees: 100", "pick: Inspiring", "batches: 2, trees: 100, pick: Natural"] {
        let found = with(alone).expect_err("no count");
        assert!(found[0].field.ends_with("count") && found[0].message == "missing", "{found:?}");
    }
}

#[test]
fn a_score_weighs_sources_by_name() {
    let with = |sources: &str| {
        load_with_oak(&SHORT.replace("count: 3", &format!("count: 3, pick: Inspiring, scores: (sources: {sources})")))
    };
    assert_eq!(with("{\"scan\": 3}").expect("loads").selections[0].scores.sources, [1.0, 3.0]);
    let wrong = |sources: &str| with(sources).expect_err("wrong")[0].to_string();
    assert!(wrong("{\"elm\": 3}").contains("none of the blend's sources"));
    assert!(wrong("{\"oak\": 0, \"scan\": 0}").contains("all weights are zero"));
}

#[test]
fn a_plan_without_a_pick_is_written_as_before() {
    let text = serde_json::to_string(&load_with_oak(SHORT).expect("loads")).expect("a plan can be written");
    assert!(!text.contains("selection") && !text.contains("pick"));
}

#[test]
fn raising_a_count_leaves_the_first_trees_alone() {
    let few = load_with_oak(SHORT).expect("loads").variants;
    let many = load_with_oak(&SHORT.replace("count: 3", "count: 100")).expect("loads").variants;
    assert_eq!(few, many[..3]);
    let mut progress: Vec<f32> = many
        .iter()
        .map(|variant| match variant {
            Variant::Blend { tree: BlendTree::State { progress, .. }, .. } => *progress,
            _ => 0.0,
        })
        .collect();
    progress.sort_by(f32::total_cmp);
    assert!(progress[0] >= 0.15 && progress[99] <= 0.85);
    assert!(progress.windows(2).all(|pair| pair[1] - pair[0] < 0.02), "{progress:?}");
}

/// Whether a default's text is of its kind and in its range.
fn fits(node: &Node, kind: Kind) -> bool {
    match (kind, &node.value) {
        (Kind::Number { low, high, .. }, &Value::Float(value)) => (low..=high).contains(&(value as f32)),
        (Kind::Integer { low, high, .. }, &Value::Integer(value)) => {
            (i128::from(low)..=i128::from(high)).contains(&value)
        }
        (Kind::WordOrChoice(words, _), Value::Text(text)) => words.contains(&text.as_str()),
        (Kind::Texts { low, high, .. }, Value::List(items)) => {
            (low..=high).contains(&items.len()) && items.iter().all(|item| matches!(item.value, Value::Text(_)))
        }
        (Kind::Numbers { most, .. }, Value::List(items)) => items.is_empty() && most > 0,
        (Kind::Fields(record), Value::Record(None, fields)) => {
            fields.is_empty() && record.fields.iter().all(|field| !matches!(field.default, Default::Required))
        }
        (
            Kind::Choice(choice),
            Value::Name(name) | Value::Record(Some(super::super::syntax::Name { text: name, .. }), _),
        ) => choice.kinds.iter().any(|kind| kind.name == name),
        (Kind::ListOf { choice, low, high }, Value::List(items)) => {
            (low..=high).contains(&items.len()) && items.iter().all(|item| fits(item, Kind::Choice(choice)))
        }
        _ => false,
    }
}

fn check_record(record: &'static Record) {
    for field in record.fields {
        assert!(!field.about.is_empty(), "{}.{}", record.title, field.name);
        assert_eq!(record.fields.iter().filter(|other| other.name == field.name).count(), 1, "{}", field.name);
        if let Default::Is(text) = field.default {
            let report = Report::new("");
            let node = tree(text, &report).expect("a default is a value");
            assert!(report.is_clean() && fits(&node, field.kind), "{}.{} = {text}", record.title, field.name);
        }
        match field.kind {
            Kind::Fields(record) | Kind::Rows { record, .. } => check_record(record),
            Kind::Choice(choice)
            | Kind::WordOrChoice(_, choice)
            | Kind::ListOf { choice, .. }
            | Kind::Named { choice, .. } => check_choice(choice),
            _ => {}
        }
    }
}

fn check_choice(choice: &'static Choice) {
    for kind in choice.kinds {
        if let Form::One(record) | Form::Fields(record) = kind.form {
            check_record(record);
        }
    }
}

#[test]
fn every_default_of_the_tables_is_in_its_range() {
    check_record(&SET);
    check_record(&SPECIES);
}
