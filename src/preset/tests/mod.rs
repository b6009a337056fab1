//! Tests of the whole folder: presets in, plans or diagnostics out.

mod defaults;
mod hostile;
mod surroundings;

use super::plan::{BarkArt, BarkPattern, GuideStart, LeafArt, LeafShape, SourceRecipe, Variant};
use super::*;
use crate::base::Diagnostic;

const OAK: &str = r#"(
    height: 12.0, nodes: 30000, width: 1.2, tip_radius: 0.004, allometry: 2.5,
    iterations: [
        (endpoints: Volume(shape: Point(height: 0.4), count: 1), guide: Piecewise(alpha1: 0.0, alpha2: 0.0, h0: 1)),
        (endpoints: Volume(shape: HalfEllipsoid(bottom: 0.3, top: 1.0, radius: 0.5, hollow: 0.3), count: 30), guide: Piecewise(alpha1: 30.0, alpha2: -3.0, h0: 3), start: Kept, keep: Any),
        (endpoints: Surface(k: 4, t: 0.6, count: 300), guide: Random(low: 30.0, high: 120.0)),
    ],
)"#;

fn load_with_oak(text: &str) -> Result<Plan, Vec<Diagnostic>> {
    load("presets/avenue.ron", text, &mut |path| match path {
        "species/oak.ron" => Ok(OAK.to_string()),
        _ => Err("no such file".to_string()),
    })
}

#[test]
fn the_avenue_is_what_its_comments_say() {
    let plan = load_with_oak(include_str!("../../../presets/avenue.ron")).expect("loads");
    assert_eq!((plan.name.as_str(), plan.seed, plan.sources.len(), plan.variants.len()), ("avenue", 41, 2, 8));
    let heights = plan.sources.iter().map(|source| match &source.recipe {
        SourceRecipe::Grow(grow) => (source.name.as_str(), grow.seed, grow.height),
        SourceRecipe::Import(_) | SourceRecipe::Like(_) => ("", 0, 0.0),
    });
    assert_eq!(heights.collect::<Vec<_>>(), [("broad", 1, 12.0), ("tall", 9, 15.0)]);
    assert_eq!(plan.variants[0], Variant::Source(0));
    let chosen: Vec<Variant> = (0..6).map(|place| Variant::Selected { selection: 0, place }).collect();
    assert_eq!(plan.variants[2..], chosen);
    assert_eq!((plan.blends[0].of.as_slice(), plan.selections[0].pick), ([0, 1].as_slice(), plan::Pick::Inspiring));
    assert!(matches!(plan.leaf_art, LeafArt::Made { shape: LeafShape::Oak, .. }));
    assert!(matches!(plan.bark_art, BarkArt::Made { pattern: BarkPattern::Furrowed, .. }));
    assert_eq!((plan.lods.len(), plan.mesh.bark_tile, plan.dress.density), (4, 2.0, 0.8));
}

#[test]
fn degrees_become_radians() {
    let oak = species("oak.ron", OAK).expect("loads");
    assert_eq!(oak.iterations[0].start, GuideStart::Kept);
    let plan::Guide::Random { low, high, .. } = oak.iterations[2].guide else { panic!("{oak:?}") };
    assert!((low - std::f32::consts::FRAC_PI_6).abs() < 1e-6 && (high - 2.094_395).abs() < 1e-6);
}

#[test]
fn patterns_of_a_morph_are_part_of_what_it_is() {
    let morph = |patterns: &str| {
        let text = format!(
            "(sources: {{\"a\": Grow(species: \"species/oak.ron\"), \"b\": Grow(species: \"species/oak.ron\", seed: 2)}}, \
             variants: [Morph(from: \"a\", to: \"b\", frames: 3{patterns})])"
        );
        load_with_oak(&text).expect("loads").morphs[0].clone()
    };
    assert_eq!(morph("").patterns, plan::PatternParams::default());
    assert_eq!(morph(", patterns: (angle: 10, radius: 0.2, divergence: 30)"), morph(""));
    let told = morph(", patterns: (angle: 45, radius: 0.5, divergence: 90)").patterns;
    let radians = [told.angle - std::f32::consts::FRAC_PI_4, told.divergence - std::f32::consts::FRAC_PI_2];
    assert!(radians.iter().all(|off| off.abs() < 1e-6) && told.radius == 0.5);
    // Keys are made of what a plan says.
    let key = |patterns: &str| serde_json::to_string(&morph(patterns)).expect("a plan is data");
    for one in ["angle: 11", "radius: 0.3", "divergence: 31"] {
        assert_ne!(key(&format!(", patterns: ({one})")), key(""));
    }
}

#[test]
fn winter_tells_of_leaves_that_may_be_evergreen() {
    let notes = |foliage: &str| {
        let text = format!(
            "(sources: {{\"a\": Grow(species: \"species/oak.ron\")}}, variants: [Source(\"a\")], foliage: ({foliage}))"
        );
        let plan = load_with_oak(&text).expect("loads");
        (plan.dress.density, plan.notes.iter().map(|note| note.about.clone()).collect::<Vec<_>>())
    };
    let own = "leaf: Files(color: \"holly.png\")";
    assert_eq!(notes(&format!("{own}, season: Winter")), (0.0, vec!["foliage.season".to_owned()]));
    let quiet = [own, "season: Winter", "leaf: \"pine\", season: Winter"].map(|foliage| notes(foliage).1.len());
    // Whether a source brings leaves is known once it is read.
    assert_eq!((quiet, notes(&format!("{own}, season: Winter, density: 0")).1.len()), ([0, 1, 0], 0));
}

#[test]
fn a_set_without_leaves_has_no_cloud_unless_it_asks_for_one() {
    let clouds = |fields: &str| {
        let text =
            format!("(sources: {{\"a\": Grow(species: \"species/oak.ron\")}}, variants: [Source(\"a\")], {fields})");
        let lods = load_with_oak(&text).expect("loads").lods;
        (lods.len(), lods.iter().filter(|level| matches!(level.lod, plan::Lod::BillboardCloud { .. })).count())
    };
    assert_eq!(clouds(""), (4, 1));
    assert_eq!(clouds("foliage: (leaf: \"pine\", season: Winter)"), (4, 1));
    assert_eq!(clouds("foliage: (season: Winter)"), (3, 0));
    assert_eq!(clouds("foliage: (density: 0)"), (3, 0));
    assert_eq!(clouds("foliage: (density: 0), lods: [Full, BillboardCloud()]"), (2, 1));
}

#[test]
fn twins_are_told_with_what_would_part_them() {
    let hint = |variants: &str| {
        let text = format!(
            "(sources: {{\"a\": Grow(species: \"species/oak.ron\"), \"b\": Grow(species: \"species/oak.ron\", seed: 2)}}, \
             variants: [{variants}])"
        );
        load_with_oak(&text).expect_err("the same tree twice").remove(0).hint
    };
    assert!(hint("Mean(of: [\"a\", \"b\"]), Geodesic(from: \"a\", to: \"b\", steps: 3)").contains("`steps`"));
    assert!(hint("Mean(of: [\"a\", \"b\"]), Mean(of: [\"a\", \"b\"])").contains("`weights`"));
    assert!(hint("Source(\"a\"), Source(\"a\")").contains("leave one"));
    assert!(hint("Blend(of: [\"a\", \"b\"], count: 2), Blend(of: [\"a\", \"b\"], count: 2)").contains("`seed`"));
}

#[test]
fn what_is_grown_brings_neither_leaves_nor_bark() {
    let text = "(sources: {\"a\": Grow(species: \"species/oak.ron\"), \"b\": Import(file: \"b.obj\"), \
        \"c\": Grow(like: \"b.obj\")}, variants: [Source(\"a\")], foliage: (leaf: From(\"a\")), bark: (texture: From(\"c\")))";
    let errors = load_with_oak(text).expect_err("none of them brings any");
    let told: Vec<String> = errors.iter().map(ToString::to_string).collect();
    for (told, part) in told.iter().zip(["\"a\" is grown, and brings no leaves", "\"c\" is grown, and brings no bark"])
    {
        assert!(told.contains(part) && told.contains("name a source"), "{told}");
    }
    assert!(told.len() == 2 && errors.iter().all(|error| error.span.is_some()), "{told:?}");
    assert!(load_with_oak(&text.replace("From(\"a\")", "From(\"b\")").replace("From(\"c\")", "From(\"b\")")).is_ok());
}

#[test]
fn a_point_is_one_endpoint() {
    let many = OAK.replace("Point(height: 0.4), count: 1", "Point(height: 0.4), count: 50");
    let errors = species("oak.ron", &many).unwrap_err();
    assert!(errors.len() == 1 && errors[0].to_string().contains("a Point is one endpoint"), "{errors:?}");
}

#[test]
fn the_papers_own_growth_can_be_asked_for_and_what_is_left_out_leaves_no_mark() {
    let with = |fields: &str, surface: &str, pass: &str| {
        let text = OAK.replace("height: 12.0,", &format!("height: 12.0, {fields}"));
        let text = text.replace("t: 0.6,", &format!("t: 0.6, {surface}")).replace("start: Kept,", pass);
        species("oak.ron", &text)
    };
    let usual = with("", "", "").expect("loads");
    let spelled = "leader: Held, length_cost: 0.2, whim: 0.15,";
    assert_eq!(with(spelled, "irregular: 0.0,", "start: Kept, axis: Vector,"), Ok(usual.clone()));
    let key = |params: &plan::GrowParams| serde_json::to_string(params).expect("it has a form");
    for name in ["leader", "length_cost", "whim", "axis", "irregular"] {
        assert!(!key(&usual).contains(name), "{name}");
    }
    let papers = with("leader: Free, length_cost: 0, whim: 0,", "irregular: 0.5,", "axis: Edge,").expect("loads");
    assert_eq!((papers.leader, papers.length_cost, papers.whim), (plan::LeaderRule::Free, 0.0, 0.0));
    assert_eq!(papers.iterations[1].axis, plan::GuideAxis::Edge);
    assert!(matches!(papers.iterations[2].endpoints, plan::Endpoints::Surface { irregular: 0.5, .. }));
    for name in ["leader", "length_cost", "whim", "axis", "irregular"] {
        assert!(key(&papers).contains(name), "{name}");
    }
    for (wrong, names) in [
        (with("whim: 1.0,", "", ""), "whim"),
        (with("length_cost: -0.1,", "", ""), "length_cost"),
        (with("leader: Loose,", "", ""), "leader"),
        (with("", "irregular: 2.0,", ""), "irregular"),
        (with("", "", "axis: Up,"), "axis"),
    ] {
        let errors = wrong.unwrap_err();
        assert!(errors.len() == 1 && errors[0].to_string().contains(names), "{errors:?}");
    }
}

#[test]
fn a_sketch_is_drawn_by_the_method_that_is_told() {
    let with = |more: &str| {
        load_with_oak(&format!(
            "(sources: {{\"oak\": Grow(species: \"species/oak.ron\")}}, \
             variants: [Sketch(of: \"oak\", crown: \"heart.svg\"{more})])"
        ))
    };
    let key = |plan: &Plan| serde_json::to_string(&plan.sketches[0]).expect("it has a form");
    let usual = with("").expect("loads");
    assert_eq!(key(&usual), key(&with(", method: Adaptive, depth: Grown").expect("loads")));
    assert!(!key(&usual).contains("method"));
    for method in ["Paper", "Cages", "Baseline", "OneCage"] {
        let plan = with(&format!(", method: {method}")).expect("loads");
        assert!(key(&plan).contains(&format!("\"method\":\"{method}\"")), "{}", key(&plan));
        let error = with(&format!(", method: {method}, depth: Grown")).unwrap_err().remove(0).to_string();
        assert!(error.contains("depth: only the method `Adaptive` lets depth grow"), "{error}");
    }
    assert!(with(", method: Papers").unwrap_err()[0].to_string().contains("method"));
}

#[test]
fn a_point_off_the_axis_is_on_the_side_that_is_told() {
    let with =
        |more: &str| species("oak.ron", &OAK.replace("Point(height: 0.4)", &format!("Point(height: 0.4{more})")));
    let turn = |more: &str| match with(more).expect("loads").iterations[0].endpoints {
        plan::Endpoints::Volume { shape: plan::Volume::Point { turn, .. }, .. } => turn,
        _ => panic!("its trunk ends at a point"),
    };
    assert_eq!((turn(""), turn(", out: 0.3")), (None, None));
    assert!((turn(", out: 0.3, turn: 90").expect("it is told") - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    let error = with(", turn: 90").unwrap_err().remove(0).to_string();
    assert!(error.contains("turn: has no meaning without `out`"), "{error}");
}

#[test]
fn a_part_of_a_mesh_is_not_both_wood_and_leaves() {
    let load = |leaves: &str, wood: &str| {
        load_with_oak(&format!(
            "(sources: {{\"a\": Import(file: \"a.glb\", leaves: [{leaves}], wood: [{wood}])}}, variants: [Source(\"a\")])"
        ))
    };
    let error = load("\"x\", \"Needles\"", "\"needles\"").expect_err("one name in both").remove(0).to_string();
    assert!(error.contains("sources[\"a\"].wood") && error.contains("\"needles\" is among `leaves`, too"), "{error}");
    assert!(load("\"x\"", "\"y\"").is_ok());
}
