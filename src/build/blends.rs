//! The blending stages: sources in correspondence, and each variant bare.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use super::cache::{Cache, Entry, Stage};
use super::morphs::{self, Morphs};
use super::selections::Selected;
use super::shapes::{self, Shapes};
use super::trees::content;
use crate::base::{Diagnostic, Key, Seed};
use crate::blend::{self, Bounds, Chosen, State, Tasks};
use crate::plant::{ChainId, Plant, rule_radii};
use crate::preset::Plan;
use crate::preset::plan::{BlendParams, BlendScale, BlendTree, PartRegion, RadiusRule, ShapeKind, StemRule, Variant};
use crate::relate::{self, Family, FamilyError, Weights};
use crate::select;

/// Sources in correspondence; kept in memory only.
const FAMILY: Stage = Stage("family", 6);

/// What the blended variants of a plan are made from.
#[derive(Debug)]
pub(super) struct Blends {
    /// Families, each once.
    families: Vec<Arc<Family>>,
    /// For each blend of the plan.
    made: Vec<Made>,
    /// The plan's shape spaces.
    shapes: Shapes,
}

/// One blend of the plan.
#[derive(Debug)]
struct Made {
    /// Index of its family.
    family: usize,
    /// Which kins take part.
    chosen: Chosen,
}

/// Matches the sources of every blend, each set of them once, and finds which branches take part.
pub(super) fn blends(plan: &Plan, sources: &[Plant], cache: &Cache) -> Result<Blends, Vec<Diagnostic>> {
    let alike = |a: &BlendParams, b: &BlendParams| {
        (&a.of, a.stems, a.scale) == (&b.of, b.stems, b.scale) && a.matching == b.matching
    };
    let mut firsts: Vec<usize> = Vec::new();
    let mut family_of: Vec<usize> = Vec::new();
    for (i, params) in plan.blends.iter().enumerate() {
        let known = firsts.iter().position(|&first| alike(&plan.blends[first], params));
        family_of.push(known.unwrap_or(firsts.len()));
        if known.is_none() {
            firsts.push(i);
        }
    }
    let contents: Vec<Key> = sources.par_iter().map(content).collect();
    let of = |&i: &usize| {
        let params = &plan.blends[i];
        let key = FAMILY.key().params(&(params.stems, params.scale, &params.matching));
        let key = params.of.iter().fold(key, |key, &s| key.input(contents[s])).finish();
        let weight = |family: &Family| 2 * family.sources().iter().map(Plant::weight).sum::<usize>();
        cache.remember_here(key, weight, || family(plan, params, sources).map_err(|error| vec![error]))
    };
    let families: Vec<Result<Arc<Family>, Vec<Diagnostic>>> = firsts.par_iter().map(of).collect();
    let mut errors: Vec<Diagnostic> =
        families.iter().filter_map(|family| family.as_ref().err().cloned()).flatten().collect();
    if !errors.is_empty() {
        return Err(errors);
    }
    let families: Vec<Arc<Family>> = families.into_iter().filter_map(Result::ok).collect();
    let made: Vec<Result<Made, Diagnostic>> = plan
        .blends
        .par_iter()
        .zip(&family_of)
        .map(|(params, &of)| {
            let chosen = chosen(plan, params, &families[of])?;
            Ok(Made { family: of, chosen })
        })
        .collect();
    errors.extend(made.iter().filter_map(|made| made.as_ref().err().cloned()));
    let shapes = shapes::shapes(plan, sources).map_err(|found| errors.extend(found));
    match shapes {
        Ok(shapes) if errors.is_empty() => {
            Ok(Blends { families, made: made.into_iter().filter_map(Result::ok).collect(), shapes })
        }
        _ => Err(errors),
    }
}

fn family(plan: &Plan, params: &BlendParams, sources: &[Plant]) -> Result<Family, Diagnostic> {
    let plants = params.of.iter().map(|&s| sources[s].clone()).collect();
    let matched = Family::at_one_size(plants, |plants| match (params.stems, <[Plant; 2]>::try_from(plants)) {
        (StemRule::Merge, Ok([from, to])) => relate::merged_family(from, to, &params.matching),
        (_, Ok(pair)) => relate::nway_family(pair.to_vec(), &params.matching),
        (_, Err(plants)) => relate::nway_family(plants, &params.matching),
    });
    let matched = match params.scale {
        BlendScale::Chain => matched,
        BlendScale::GrowthUnit => matched.map(Family::by_units),
    };
    matched.map_err(|error| {
        let at = match error {
            FamilyError::TooLarge { source_index } => params.of.get(source_index).copied(),
            _ => params.of.iter().copied().find(|&s| sources[s].chains().is_empty()),
        };
        let name = |index: usize| plan.sources[index].name.as_str();
        let others: Vec<String> = params.of.iter().map(|&s| format!("\"{}\"", name(s))).collect();
        let message = format!("can't blend {}: {error}", others.join(" and "));
        let field = match at {
            Some(source) => format!("sources[\"{}\"]", name(source)),
            None => format!("variants[{}].of", params.entry),
        };
        Diagnostic::new("", message).with_field(field)
    })
}

/// Which kins take part in a blend.
fn chosen(plan: &Plan, params: &BlendParams, family: &Family) -> Result<Chosen, Diagnostic> {
    let parts: Vec<(usize, &str, PartRegion)> = params
        .of
        .iter()
        .enumerate()
        .flat_map(|(place, &s)| plan.sources[s].parts.iter().map(move |p| (place, p.name.as_str(), p.region)))
        .collect();
    let chosen = blend::chosen(family, &params.only, &parts);
    let acting = match params.of.len() {
        2 => Tasks::partial(family, 0, 1, &|kin| chosen.has(kin)).count(),
        _ => chosen.count(),
    };
    if acting == 0 {
        let deepest = family.sources().iter().flat_map(Plant::chains).map(|chain| chain.order).max().unwrap_or(0);
        return Err(Diagnostic::new("", "selects no branch that could change")
            .with_field(format!("variants[{}].only", params.entry))
            .with_hint(format!(
                "its sources have orders 1 to {deepest}; a branch grows only where its parent stands"
            )));
    }
    Ok(chosen)
}

/// The address of a batch's schedule: it holds the pair and the batch only, so that trees of one batch are states of
/// one schedule.
fn schedule_seed(plan: &Plan, params: &BlendParams, batch: u64) -> Seed {
    let named = |seed: Seed, &s: &usize| seed.child(&plan.sources[s].name);
    params.of.iter().fold(Seed::new(plan.seed).child("schedule"), named).at(batch)
}

/// A batch: its blend, its number, the bits of its pace.
type Run = (usize, u64, u32);
/// Variants and how far into their batch they are.
type Places = Vec<(usize, f32)>;

/// The states that variants of batches are, each batch run through once; none for others.
pub(super) fn states(plan: &Plan, variants: &[Variant], blends: &Blends) -> Vec<Option<State>> {
    let mut runs: BTreeMap<Run, Places> = BTreeMap::new();
    for (i, variant) in variants.iter().enumerate() {
        if let Variant::Blend { blend, tree: BlendTree::State { batch, progress, pace } } = variant {
            runs.entry((*blend, *batch, pace.to_bits())).or_default().push((i, *progress));
        }
    }
    let runs: Vec<(Run, Places)> = runs.into_iter().collect();
    let found: Vec<Vec<State>> = runs
        .par_iter()
        .map(|((blend, batch, pace), places)| {
            let (params, made) = (&plan.blends[*blend], &blends.made[*blend]);
            let tasks = Tasks::partial(&blends.families[made.family], 0, 1, &|kin| made.chosen.has(kin));
            let places: Vec<f32> = places.iter().map(|place| place.1).collect();
            tasks.samples(schedule_seed(plan, params, *batch), &places, f32::from_bits(*pace))
        })
        .collect();
    let mut states = vec![None; variants.len()];
    for ((_, places), found) in runs.iter().zip(found) {
        places.iter().zip(found).for_each(|((i, _), state)| states[*i] = Some(state));
    }
    states
}

/// The family of a blend and its weights there; none for what is no blend.
pub(super) fn blend_of<'b>(plan: &Plan, variant: &Variant, blends: &'b Blends) -> Option<(&'b Family, Weights)> {
    blend_at(plan, variant, blends, None)
}

/// How a blend is made, and its family; none for what is no blend.
pub(super) fn params_of<'b>(
    plan: &'b Plan,
    variant: &Variant,
    blends: &'b Blends,
) -> Option<(&'b BlendParams, &'b Family)> {
    let Variant::Blend { blend, .. } = variant else { return None };
    Some((&plan.blends[*blend], &blends.families[blends.made[*blend].family]))
}

/// As [`blend_of`], where the state that the variant is may be known already.
pub(super) fn blend_at<'b>(
    plan: &Plan,
    variant: &Variant,
    blends: &'b Blends,
    known: Option<&State>,
) -> Option<(&'b Family, Weights)> {
    let Variant::Blend { blend, tree } = variant else { return None };
    let (params, made) = (&plan.blends[*blend], &blends.made[*blend]);
    let family = &blends.families[made.family];
    let weights = match tree {
        BlendTree::State { batch, progress, pace } => {
            let seed = schedule_seed(plan, params, *batch);
            let tasks = Tasks::partial(family, 0, 1, &|kin| made.chosen.has(kin));
            let weights = match known {
                Some(state) => tasks.weights(state),
                None => tasks.weights(&tasks.sample(seed, *progress, *pace)),
            };
            weights.with_unit_seed(seed.child("units"))
        }
        BlendTree::Point { shares, scatter, draw } => {
            let seed = schedule_seed(plan, params, *draw);
            made.chosen.hold(family, blend::scattered(family, shares, *scatter, seed))
        }
    };
    let weights = match params.stems {
        StemRule::Grow => weights,
        StemRule::Apart | StemRule::Merge => blend::whole_stems(family, weights),
    };
    Some((family, weights))
}

/// A blend as it is delivered but for branches that run into others: as thick as its rule says, and within its sources' bounds.
pub(super) fn finished(params: &BlendParams, bounds: &Bounds, plant: Plant) -> Plant {
    let plant = match params.radii {
        RadiusRule::Corrected => plant,
        RadiusRule::Ruled => {
            let radii = rule_radii(&plant);
            plant.with_radii(radii)
        }
    };
    bounds.hold(plant)
}

/// A tree of a blend without some branches, bare; none for what is no blend. What runs into others is found in the tree that it is in the end.
pub(super) fn delivered(plan: &Plan, variant: &Variant, blends: &Blends, gone: &[ChainId]) -> Option<Plant> {
    let Variant::Blend { blend, .. } = variant else { return None };
    let (family, weights) = blend_of(plan, variant, blends)?;
    let plant = finished(&plan.blends[*blend], &Bounds::of(family.sources()), family.blend(&weights));
    Some(select::without(&plant, gone))
}

/// One variant, bare.
pub(super) fn variant(
    plan: &Plan,
    variant: &Variant,
    sources: &[Plant],
    blends: &Blends,
    selected: &Selected,
    morphs: &Morphs,
) -> Plant {
    let made = match variant {
        Variant::Source(index) => Some(sources[*index].clone()),
        Variant::Blend { .. } => delivered(plan, variant, blends, selected.gone(variant)),
        Variant::Shape { shape, shares } => {
            let of = plan.shapes[*shape].of.iter().filter_map(|&source| sources.get(source));
            // What is symmetric leans less than its source, and is as high as that makes it.
            let is_mirrored = matches!(plan.shapes[*shape].kind, ShapeKind::Mirror { .. });
            let bound = |plant| if is_mirrored { blend::grounded(plant, of) } else { blend::within(plant, of) };
            blends.shapes.plant(*shape, shares).map(bound)
        }
        Variant::Selected { .. } => {
            selected.get(variant).and_then(|kept| delivered(plan, &kept.recipe, blends, &kept.gone))
        }
        Variant::Frame { morph, frame } => morphs.made.get(*morph).map(|made| made.frame(*frame)),
        // It is shaped when it has leaves.
        Variant::Sketched { of, .. } => return self::variant(plan, of, sources, blends, selected, morphs),
    };
    made.expect("every blend of the plan was made, and selections hold as many trees as they keep")
}

/// What a variant is, for the manifest, and the address of its randomness: what it is and not its place in the list, so
/// that adding a variant changes no other, nor does being picked.
pub(super) fn identity(plan: &Plan, variant: &Variant, selected: &Selected) -> (serde_json::Value, Seed) {
    if let Variant::Sketched { sketch, of } = variant {
        // The tree is what it is without a sketch, leaf by leaf.
        let (mut recipe, seed) = identity(plan, of, selected);
        recipe["sketch"] = serde_json::json!(plan.sketches[*sketch].told());
        return (recipe, seed);
    }
    let kept = selected.get(variant);
    let mut recipe = match kept.map_or(variant, |kept| &kept.recipe) {
        Variant::Source(index) => serde_json::json!({ "source": plan.sources[*index].name }),
        Variant::Blend { blend, tree } => blend_identity(plan, &plan.blends[*blend], tree),
        Variant::Shape { shape, shares } => shapes::identity(plan, &plan.shapes[*shape], shares),
        Variant::Selected { selection, place } => serde_json::json!({ "selection": selection, "place": place }),
        Variant::Frame { morph, frame } => morphs::identity(plan, *morph, *frame),
        Variant::Sketched { of, .. } => identity(plan, of, selected).0,
    };
    let seed = Seed::new(plan.seed).child("variant").child(&recipe.to_string());
    if let Some(kept) = kept {
        recipe["selected"] = kept.told.clone();
    }
    let gone = selected.gone(variant).len();
    if gone > 0 {
        recipe["branches_removed"] = serde_json::json!(gone);
    }
    (recipe, seed)
}

pub(super) fn blend_identity(plan: &Plan, params: &BlendParams, tree: &BlendTree) -> serde_json::Value {
    let names: Vec<&str> = params.of.iter().map(|&s| plan.sources[s].name.as_str()).collect();
    let mut recipe = match tree {
        BlendTree::State { batch, progress, .. } => serde_json::json!({
            "blend": names, "batch": batch, "progress": progress, "matching": params.matching,
        }),
        BlendTree::Point { shares, scatter, draw } => serde_json::json!({
            "mix": names, "weights": shares, "scatter": scatter, "draw": draw, "matching": params.matching,
        }),
    };
    if let Some(fields) = recipe.as_object_mut() {
        // What is as usual is not told, so that presets from before these fields keep their trees' leaves.
        if let BlendTree::State { pace, .. } = tree
            && *pace != 1.0
        {
            fields.insert("pace".to_owned(), serde_json::json!(pace));
        }
        if params.stems != StemRule::Apart {
            fields.insert("stems".to_owned(), serde_json::json!(params.stems));
        }
        if params.radii != RadiusRule::Corrected {
            fields.insert("radii".to_owned(), serde_json::json!(params.radii));
        }
        if params.scale != BlendScale::Chain {
            fields.insert("scale".to_owned(), serde_json::json!(params.scale));
        }
        if params.only != crate::preset::plan::OnlyParams::default() {
            fields.insert("only".to_owned(), serde_json::json!(params.only));
        }
    }
    recipe
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::selections;
    use crate::plant::{PlantBuilder, PlantStats};
    use crate::relate::random_plant::{Oddity, random_plant};

    use glam::Vec3;

    const OAK: &str = "(height: 12.0, iterations: [(endpoints: Surface(k: 4, count: 300))])";

    /// A plan over three sources "a", "b" and "c"; "a" has a part "limb".
    fn plan(variants: &str) -> Plan {
        let source =
            |name: &str, seed: u32, more: &str| format!("\"{name}\": Grow(species: \"oak.ron\", seed: {seed}{more}),");
        let sources = source("a", 1, ", parts: {\"limb\": Branch(2)}") + &source("b", 2, "") + &source("c", 3, "");
        let text = format!("(sources: {{{sources}}}, variants: [{variants}])");
        let loaded = crate::preset::load("set.ron", &text, &mut |_| Ok(OAK.to_owned()));
        loaded.unwrap_or_else(|found| panic!("{found:?}"))
    }

    fn plants() -> Vec<Plant> {
        (0..3).map(|i| random_plant(Seed::new(9).at(i), 40, Oddity::Tame)).collect()
    }

    fn made(plan: &Plan) -> Vec<Plant> {
        made_of(plants(), plan)
    }

    fn made_of(plants: Vec<Plant>, plan: &Plan) -> Vec<Plant> {
        let blends = self::blends(plan, &plants, &Cache::default()).unwrap();
        let selected = selections::selected(plan, &blends).unwrap();
        plan.variants.iter().map(|tree| variant(plan, tree, &plants, &blends, &selected, &Morphs::default())).collect()
    }

    #[test]
    fn every_way_of_blending_gives_sound_trees_that_differ() {
        let plan = plan(
            "Blend(of: [\"a\", \"b\"], count: 2),
             Blend(of: [\"a\", \"b\"], count: 3, batches: 2, trees: 8),
             Blend(of: [\"a\", \"b\"], count: 2, seed: 3, scale: GrowthUnit),
             Blend(of: [\"b\", \"c\"], count: 2, stems: Merge),
             Blend(of: [\"a\", \"b\"], count: 2, seed: 4, only: [Order(from: 2, to: 9)]),
             Blend(of: [\"a\", \"c\"], count: 2, seed: 1, batches: 2, trees: 6, pick: Diverse()),
             Mix(of: {\"a\": 0.5, \"b\": 0.3, \"c\": 0.2}),
             Mix(of: {\"a\": 1, \"c\": 1}, count: 2, scatter: 0.5),
             Explore(of: [\"c\", \"b\", \"a\"], count: 3),",
        );
        let trees = made(&plan);
        assert_eq!(trees.len(), 19);
        for (i, tree) in trees.iter().enumerate() {
            assert_eq!(PlantStats::of(tree).topology_continuity, 1.0, "{i}");
            assert!(trees[..i].iter().all(|other| other != tree), "{i}");
        }
    }

    #[test]
    fn what_runs_into_other_branches_is_removed_and_told() {
        let text = |filter: &str| plan(&format!("Blend(of: [\"a\", \"b\"], count: 8, filter: {filter})"));
        let usual = plan("Blend(of: [\"a\", \"b\"], count: 8)");
        let chains = |plan: &Plan| made(plan).iter().map(|tree| tree.chains().len()).sum::<usize>();
        assert!(chains(&usual) < chains(&text("None")));
        let blends = blends(&usual, &plants(), &Cache::default()).unwrap();
        let selected = selections::selected(&usual, &blends).unwrap();
        let [note] = &selected.notes[..] else { panic!("{:?}", selected.notes) };
        assert!(note.about == "variants[0]" && note.message.contains("removed from"), "{note:?}");
        // The address of a tree's leaves is what it was.
        let (recipe, seed) = identity(&usual, &usual.variants[0], &selected);
        let (plain, same) = identity(&usual, &usual.variants[0], &Selected::default());
        assert_eq!(seed.bits(), same.bits());
        let told = |place: usize| identity(&usual, &usual.variants[place], &selected).0["branches_removed"].as_u64();
        assert!((0..8).any(|place| told(place).is_some()) && plain["branches_removed"].is_null(), "{recipe}");
    }

    #[test]
    fn a_greater_count_keeps_the_first_trees() {
        let (few, many) = (
            plan("Explore(of: [\"a\", \"b\", \"c\"], count: 2)"),
            plan("Explore(of: [\"a\", \"b\", \"c\"], count: 5)"),
        );
        assert!(made(&few) == made(&many)[..2]);
        let pool = |count: u32| plan(&format!("Blend(of: [\"a\", \"b\"], count: {count}, batches: 2, trees: 9)"));
        assert!(made(&pool(3)) == made(&pool(7))[..3]);
    }

    #[test]
    fn an_only_that_selects_nothing_is_told_at_its_field() {
        for (only, sound) in
            [("[Order(from: 60, to: 70)]", false), ("[Part(\"limb\")]", true), ("[Part(\"limb\"), Above(1.0)]", false)]
        {
            let plan = plan(&format!("Source(\"c\"), Blend(of: [\"a\", \"b\"], count: 2, only: {only})"));
            match blends(&plan, &plants(), &Cache::default()) {
                Ok(_) => assert!(sound, "{only}"),
                Err(found) => {
                    assert!(!sound && found.len() == 1, "{only}");
                    assert_eq!(found[0].field, "variants[1].only");
                    assert_eq!(found[0].message, "selects no branch that could change");
                }
            }
        }
    }

    #[test]
    fn what_is_judged_is_the_tree_that_is_delivered() {
        // Stems that go off to both sides: between them one is upright, half as high again as both, and made as much smaller. Its two
        // limbs then run into each other, which they do in no source and not before.
        let umbrella = |way: f32| {
            let mut builder = PlantBuilder::new();
            let [fork, end] = [Vec3::Y * 2.0, Vec3::new(way * 5.0, 4.0, 0.0)];
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, fork, fork.midpoint(end), end], &[0.3, 0.25, 0.2, 0.15]);
            for (at, radius) in [(0.7, 0.12), (0.75, 0.11)] {
                builder.branch(stem, at, &[Vec3::ZERO, Vec3::Z, Vec3::Z * 2.0], &[radius, radius, radius]);
            }
            builder.finish().unwrap()
        };
        let of = || vec![umbrella(1.0), umbrella(-1.0), umbrella(1.0)];
        let mix = |filter: &str| plan(&format!("Mix(of: {{\"a\": 1, \"b\": 1}}, filter: {filter})"));
        let (kept, cleared) = (made_of(of(), &mix("None")).remove(0), made_of(of(), &mix("Plausible()")).remove(0));
        assert!((kept.height() - umbrella(1.0).height()).abs() < 1e-3, "{}", kept.height());
        assert_eq!((kept.chains().len(), cleared.chains().len()), (3, 2));
    }

    #[test]
    fn stems_that_grow_are_there_from_the_first_and_radii_by_the_rule_follow_it() {
        let stems = |count: usize| {
            let mut builder = PlantBuilder::new();
            for i in 0..count {
                let foot = Vec3::X * (2.0 * i as f32);
                let stem = builder.stem(foot, &[Vec3::ZERO, Vec3::Y * 3.0, Vec3::Y * 6.0], &[0.2, 0.15, 0.1]);
                builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X], &[0.05, 0.04]);
            }
            builder.finish().unwrap()
        };
        let of = || vec![stems(3), stems(1), stems(1)];
        let text = |more: &str| format!("Mix(of: {{\"a\": 0.2, \"b\": 0.8}}{more})");
        let tree = |more: &str| made_of(of(), &plan(&text(more))).remove(0);
        let count = |tree: &Plant| tree.chains().iter().filter(|chain| chain.parent.is_none()).count();
        let (apart, grown) = (tree(""), tree(", stems: Grow"));
        assert_eq!((count(&apart), count(&grown)), (1, 3));
        let lengths: Vec<f32> = grown
            .chain_ids()
            .filter(|id| grown.chain(*id).parent.is_none())
            .map(|id| grown.points(id)[grown.points(id).len() - 1].length())
            .collect();
        assert!(lengths.iter().filter(|length| (**length - 1.2).abs() < 0.01).count() == 2, "{lengths:?}");
        let ruled = tree(", radii: Ruled");
        assert!(ruled.all_radii() == rule_radii(&ruled) && ruled.all_points() == apart.all_points());
        let (tip, limb) = (0.1_f32, 0.04_f32);
        let carried = |r: f32| crate::base::math::pow(r, 2.5);
        let base = crate::base::math::pow(carried(tip) + carried(limb), 0.4);
        assert!((ruled.all_radii()[0] - base).abs() < 1e-4, "{:?}", ruled.all_radii());
        // Blends of two and samples have both, too, and what is not asked for is not told.
        let plan = plan(
            "Blend(of: [\"a\", \"b\"], count: 1, stems: Grow, radii: Ruled), Blend(of: [\"a\", \"b\"], count: 1),
             Explore(of: [\"a\", \"b\"], count: 1, stems: Grow, radii: Ruled)",
        );
        let told = |i: usize| identity(&plan, &plan.variants[i], &Selected::default()).0;
        assert!(told(0)["radii"] == "Ruled" && told(0)["stems"] == "Grow" && told(2)["radii"] == "Ruled");
        assert!(told(1)["radii"].is_null() && told(1)["stems"].is_null());
    }
}
