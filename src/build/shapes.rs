//! The stage of shape spaces: sources in elastic correspondence, or one beside its reflection, and trees from them.

use rayon::prelude::*;

use crate::base::Diagnostic;
use crate::blend::shape::{
    Metric, Reflection, SmallBranches, TreeGeodesic, TreePoint, frechet_mean, nearest_facing, weighted_mean,
};
use crate::plant::Plant;
use crate::preset::Plan;
use crate::preset::plan::{ChainPath, Facing, MatchParams, MirrorPlane, ShapeKind, ShapeParams, SmallRule};
use crate::relate::{Family, FamilyError, canonical_order, elastic_family, nway_family, turned};
use crate::select;

/// The shape spaces of a plan, each once.
#[derive(Debug, Default)]
pub(super) struct Shapes {
    spaces: Vec<Space>,
    /// For each of the plan's its space.
    of: Vec<usize>,
}

/// What trees are taken from.
#[derive(Debug)]
enum Space {
    /// Several sources.
    Sources(Box<Family>, Option<SmallBranches>),
    /// Several sources as points of tree-shape space.
    Orthants(Box<Orthants>),
    /// A source and its reflection.
    Mirror(Box<Reflection>),
}

/// Puts the sources of every shape space in correspondence.
pub(super) fn shapes(plan: &Plan, sources: &[Plant]) -> Result<Shapes, Vec<Diagnostic>> {
    let alike =
        |a: &ShapeParams, b: &ShapeParams| (&a.of, a.kind, a.elastic, a.small) == (&b.of, b.kind, b.elastic, b.small);
    let mut firsts: Vec<&ShapeParams> = Vec::new();
    let mut of = Vec::new();
    for params in &plan.shapes {
        let known = firsts.iter().position(|first| alike(first, params));
        of.push(known.unwrap_or(firsts.len()));
        if known.is_none() {
            firsts.push(params);
        }
    }
    let made: Vec<Result<Space, Diagnostic>> =
        firsts.par_iter().map(|params| space(params, sources).map_err(|e| told(plan, params, sources, &e))).collect();
    let errors: Vec<Diagnostic> = made.iter().filter_map(|space| space.as_ref().err().cloned()).collect();
    if !errors.is_empty() {
        return Err(errors);
    }
    Ok(Shapes { spaces: made.into_iter().filter_map(Result::ok).collect(), of })
}

fn space(params: &ShapeParams, sources: &[Plant]) -> Result<Space, FamilyError> {
    let plants: Vec<&Plant> = params.of.iter().map(|&s| &sources[s]).collect();
    match params.kind {
        ShapeKind::Mirror { plane } => {
            let Some(plant) = plants.first() else { return Err(FamilyError::Empty) };
            if plant.chains().is_empty() {
                return Err(FamilyError::Empty);
            }
            let reflection = match plane {
                MirrorPlane::Best => Reflection::best(plant, &params.elastic)?,
                MirrorPlane::At(azimuth) => Reflection::across(plant, azimuth, &params.elastic)?,
            };
            Ok(Space::Mirror(Box::new(reflection)))
        }
        ShapeKind::Sources { facing, turn } => {
            let small = small(params, &plants);
            let all = faced(params, &plants, facing, turn)?;
            Ok(Space::Sources(Box::new(elastic_family(all, &params.elastic)?), small))
        }
        ShapeKind::Orthants { facing, turn } => {
            let small = small(params, &plants);
            let all = faced(params, &plants, facing, turn)?;
            Ok(Space::Orthants(Box::new(Orthants::of(all, small)?)))
        }
    }
}

fn small(params: &ShapeParams, plants: &[&Plant]) -> Option<SmallBranches> {
    match params.small {
        SmallRule::Kept => None,
        SmallRule::Removed { alpha } => Some(SmallBranches::of(plants.iter().copied(), alpha)),
    }
}

/// The sources, those behind the first turned.
fn faced(params: &ShapeParams, plants: &[&Plant], facing: Facing, turn: f32) -> Result<Vec<Plant>, FamilyError> {
    let mut all: Vec<Plant> = plants.iter().map(|plant| (*plant).clone()).collect();
    if all.iter().any(|p| p.chains().is_empty()) {
        return Ok(all);
    }
    let metric = match params.elastic.path {
        ChainPath::Elastic => Metric::Elastic,
        ChainPath::Straight => Metric::Qed,
    };
    let first = all[0].clone().without_leaves();
    for plant in all.iter_mut().skip(1) {
        let angle = match facing {
            Facing::Fixed => 0.0,
            Facing::Free => nearest_facing(&first, &plant.clone().without_leaves(), metric, &params.elastic)?.1,
        };
        if angle + turn != 0.0 {
            *plant = turned(plant, angle + turn);
        }
    }
    Ok(all)
}

/// Plants as points of tree-shape space, in the correspondence of blends: in whatever order branches leave.
#[derive(Debug)]
struct Orthants {
    plants: Vec<Plant>,
    points: Vec<TreePoint>,
    /// The order in which means walk, whatever the sources' is.
    order: Vec<usize>,
    small: Option<SmallBranches>,
}

impl Orthants {
    /// Times that a mean walks round its sources.
    const ROUNDS: usize = 16;

    fn of(plants: Vec<Plant>, small: Option<SmallBranches>) -> Result<Self, FamilyError> {
        let order = canonical_order(&plants);
        let family = nway_family(plants, &MatchParams::default())?;
        let points = (0..family.sources().len()).map(|s| TreePoint::of(&family, s)).collect();
        Ok(Self { plants: family.sources().to_vec(), points, order, small })
    }

    /// The source that has most, for where all edges are collapsed: no plant stands for that point.
    fn heaviest(&self, shares: &[f32]) -> Option<Plant> {
        let most = self.plants.iter().zip(shares).max_by(|a, b| a.1.total_cmp(b.1));
        most.map(|(plant, _)| plant.clone())
    }

    /// The point at some shares; none where it is no plant.
    fn plant(&self, shares: &[f32]) -> Option<Plant> {
        let share = |s: &usize| shares.get(*s).copied().unwrap_or(0.0);
        let there: Vec<usize> = self.order.iter().copied().filter(|s| share(s) > 0.0).collect();
        let point = match there[..] {
            [] => return self.plants.first().cloned(),
            [s] => return self.plants.get(s).cloned(),
            [a, b] => {
                TreeGeodesic::new(&self.points[a], &self.points[b]).at(f64::from(share(&b) / (share(&a) + share(&b))))
            }
            _ => {
                let points: Vec<TreePoint> = there.iter().map(|&s| self.points[s].clone()).collect();
                let weights: Vec<f64> = there.iter().map(|s| f64::from(share(s))).collect();
                frechet_mean(&points, &weights, Self::ROUNDS)?
            }
        };
        let plant = point.plant().ok()?;
        Some(match &self.small {
            Some(small) => select::without(&plant, &small.in_plant(&plant)),
            None => plant,
        })
    }
}

fn told(plan: &Plan, params: &ShapeParams, sources: &[Plant], error: &FamilyError) -> Diagnostic {
    let at = match error {
        FamilyError::TooLarge { source_index } => params.of.get(*source_index).or(params.of.first()).copied(),
        _ => params.of.iter().copied().find(|&s| sources[s].chains().is_empty()),
    };
    let names: Vec<String> = params.of.iter().map(|&s| format!("\"{}\"", plan.sources[s].name)).collect();
    let field = match at {
        Some(source) => format!("sources[\"{}\"]", plan.sources[source].name),
        None => format!("variants[{}]", params.entry),
    };
    Diagnostic::new("", format!("can't compare {}: {error}", names.join(" and "))).with_field(field)
}

impl Shapes {
    /// A tree, bare; none for a space that the plan does not have.
    pub(super) fn plant(&self, shape: usize, shares: &[f32]) -> Option<Plant> {
        Some(match self.spaces.get(*self.of.get(shape)?)? {
            Space::Orthants(space) => space.plant(shares).or_else(|| space.heaviest(shares))?,
            Space::Mirror(reflection) => reflection.symmetrized(shares.get(1).copied().unwrap_or(0.0) * 2.0),
            Space::Sources(family, small) => {
                let plant = family.blend(&weighted_mean(family, shares));
                match small {
                    // A source alone stays as it is.
                    Some(small) if shares.iter().filter(|w| **w > 0.0).count() > 1 => {
                        select::without(&plant, &small.in_plant(&plant))
                    }
                    _ => plant,
                }
            }
        })
    }
}

/// What a tree is, for the manifest and for the address of its randomness.
pub(super) fn identity(plan: &Plan, params: &ShapeParams, shares: &[f32]) -> serde_json::Value {
    let names: Vec<&str> = params.of.iter().map(|&s| plan.sources[s].name.as_str()).collect();
    serde_json::json!({
        "shape": names, "kind": params.kind, "shares": shares, "elastic": params.elastic, "small": params.small,
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::Seed;
    use crate::build::{Cache, blends};
    use crate::plant::{PlantBuilder, PlantStats};
    use crate::relate::random_plant::{Oddity, random_plant};

    const OAK: &str = "(height: 12.0, iterations: [(endpoints: Surface(k: 4, count: 300))])";

    fn made(variants: &str) -> Vec<Plant> {
        made_of((0..3).map(|i| random_plant(Seed::new(9).at(i), 40, Oddity::Tame)).collect(), variants)
    }

    fn made_of(plants: Vec<Plant>, variants: &str) -> Vec<Plant> {
        let source = |name: &str, seed: u32| format!("\"{name}\": Grow(species: \"oak.ron\", seed: {seed}),");
        let sources = source("a", 1) + &source("b", 2) + &source("c", 3);
        let text = format!("(sources: {{{sources}}}, variants: [{variants}])");
        let loaded = crate::preset::load("set.ron", &text, &mut |_| Ok(OAK.to_owned()));
        let plan = loaded.unwrap_or_else(|found| panic!("{found:?}"));
        let blends = blends::blends(&plan, &plants, &Cache::default()).unwrap();
        let selected = crate::build::selections::selected(&plan, &blends).unwrap();
        let none = crate::build::morphs::Morphs::default();
        plan.variants.iter().map(|tree| blends::variant(&plan, tree, &plants, &blends, &selected, &none)).collect()
    }

    #[test]
    fn every_kind_of_shape_gives_sound_trees_that_differ() {
        let trees = made(
            "Geodesic(from: \"a\", to: \"b\", steps: 3),
             Geodesic(from: \"a\", to: \"b\", steps: 2, path: Straight),
             Geodesic(from: \"a\", to: \"c\", steps: 1, facing: Free, small: Kept),
             Geodesic(from: \"a\", to: \"b\", steps: 2, path: Straightened),
             Mean(of: [\"a\", \"b\", \"c\"], path: Straightened),
             Mean(of: [\"a\", \"b\", \"c\"]),
             Mean(of: [\"a\", \"b\", \"c\"], weights: {\"b\": 3}),
             Symmetrize(of: \"a\"),
             Symmetrize(of: \"a\", amount: 0.5, plane: At(20)),
             Between(of: [\"c\", \"b\", \"a\"], count: 3),",
        );
        assert_eq!(trees.len(), 16);
        for (i, tree) in trees.iter().enumerate() {
            assert_eq!(PlantStats::of(tree).topology_continuity, 1.0, "{i}");
            assert!(trees[..i].iter().all(|other| other != tree), "{i}");
        }
    }

    #[test]
    fn no_way_between_trees_leads_through_the_ground() {
        // A branch that hangs from the middle of a trunk, and one as long that lies beside a stub.
        let plant = |height: f32, way: Vec3| {
            let mut builder = PlantBuilder::new();
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * height], &[0.3, 0.1]);
            builder.branch(stem, 0.5, &[Vec3::ZERO, way * 2.4, way * 4.8], &[0.1, 0.08, 0.05]);
            builder.finish().unwrap()
        };
        let (high, low) = (plant(10.0, Vec3::NEG_Y), plant(0.1, Vec3::X));
        let deepest = |tree: &Plant| tree.pose().positions().iter().fold(0.0_f32, |low, p| low.min(p.y));
        let trees = made_of(
            vec![high.clone(), low, high],
            "Geodesic(from: \"a\", to: \"b\", steps: 6, small: Kept), Geodesic(from: \"a\", to: \"b\", steps: 5, path: Straight)",
        );
        assert_eq!(trees.len(), 11);
        for (i, tree) in trees.iter().enumerate() {
            assert!(deepest(tree) > -0.02, "{i}: {} with {} chains", deepest(tree), tree.chains().len());
        }
    }

    #[test]
    fn no_tree_between_umbrellas_is_higher_than_both() {
        // A stem that leaves upright and goes on far to one side: the mean of two that go to other sides is upright all along.
        let umbrella = |turn: f32| {
            let mut builder = PlantBuilder::new();
            let (sin, cos) = crate::base::math::sin_cos(turn);
            let [fork, end] = [Vec3::Y * 2.0, Vec3::new(cos * 5.0, 4.0, sin * 5.0)];
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, fork, fork.midpoint(end), end], &[0.3, 0.2, 0.1, 0.05]);
            builder.branch(stem, 0.3, &[Vec3::ZERO, Vec3::new(-cos, 0.3, -sin)], &[0.05, 0.02]);
            builder.finish().unwrap()
        };
        let of = || vec![umbrella(0.0), umbrella(2.5), umbrella(1.2)];
        let most = of().iter().map(Plant::height).fold(0.0, f32::max);
        let trees = made_of(of(), "Geodesic(from: \"a\", to: \"b\", steps: 3), Mean(of: [\"a\", \"b\", \"c\"])");
        let heights: Vec<f32> = trees.iter().map(Plant::height).collect();
        assert!(heights.len() == 4 && heights.iter().all(|height| *height < most * 1.0001), "{most}: {heights:?}");
        let free = elastic_family(of()[..2].to_vec(), &crate::preset::plan::ElasticParams::default()).unwrap();
        let free = free.blend(&weighted_mean(&free, &[0.5, 0.5])).height();
        assert!(free > 1.05 * most, "{free}");
    }

    #[test]
    fn a_way_to_a_turned_tree_leads_through_others_and_ends_at_it() {
        let middle = |more: &str| made(&format!("Geodesic(from: \"a\", to: \"b\", steps: 1{more})")).remove(0);
        let plain = middle("");
        assert!(middle(", turn: 0") == plain && middle(", turn: 180") != plain);
        // A whole turn changes nothing but the last bits.
        let (whole, posed) = (middle(", turn: 360"), plain.pose());
        assert_eq!(whole.chains().len(), plain.chains().len());
        for (a, b) in whole.pose().positions().iter().zip(posed.positions()) {
            assert!(a.distance(*b) < 1e-3);
        }
        // Of a mean that is all of the second source, what is left is that source, turned.
        let end = made("Mean(of: [\"a\", \"b\"], weights: {\"a\": 0}, turn: 90)").remove(0);
        let second = random_plant(Seed::new(9).at(1), 40, Oddity::Tame);
        let turned = crate::relate::turned(&second, std::f32::consts::FRAC_PI_2);
        for (a, b) in end.pose().positions().iter().zip(turned.pose().positions()) {
            assert!(a.distance(*b) < 1e-3);
        }
    }

    #[test]
    fn small_branches_are_removed_unless_they_are_kept() {
        let chains = |small: &str| {
            let trees = made(&format!("Geodesic(from: \"a\", to: \"b\", steps: 5, small: {small})"));
            trees.iter().map(|t| t.chains().len()).sum::<usize>()
        };
        assert!(chains("Removed(alpha: 0)") < chains("Kept"));
    }
}
