//! Leaves that are larger than their tree bears, which is told where it shows: there are fewer than are wanted, since a preset's `most`
//! allows no more or branches have no room for them, and those that are there are longer for it; or the preset asks for such.

use std::sync::Arc;

use super::stages::SourcePlant;
use super::trees::Tree;
use super::wardrobe::{Dressing, Wardrobe, picture_span};
use crate::base::{Note, counted};
use crate::dress;
use crate::plant::Plant;
use crate::preset::Plan;
use crate::preset::plan::{LeafArt, Source, USUAL_LEAF_SHARE, Variant, Wear};

/// How much longer than asked for leaves are told of.
const LONGER: f32 = 1.35;

/// So much longer they are at least where they would have to be longer yet: a little less than dressing allows, as lengths are spread.
const MOST_LONGER: f32 = 1.9;
/// What share of its tree a picture of leaves is at the most that nobody is told of: usual ones are a fifteenth.
const LARGE: f32 = 1.0 / 3.0;
/// Share of the leaves that a source brings below which it is told how many are left.
const FEW: f32 = 0.1;
/// How much longer than usual a source's own leaves are told of that wear the picture of another.
const PADDLE: f32 = 3.0;

/// A tree whose leaves are longer than asked for.
#[derive(Clone, Copy)]
struct Longer {
    /// How many times.
    times: f32,
    /// The length that was asked for, metres.
    asked: f32,
    /// Whether it has as many leaves as it may have.
    has_most: bool,
}

impl Longer {
    fn of(plan: &Plan, wardrobe: &Wardrobe, variant: &Variant, tree: &Tree) -> Option<Self> {
        // Sketches make trees and leaves larger by themselves.
        let Some(Dressing::Made { params, first, .. }) = wardrobe.dressing(plan, variant) else { return None };
        if matches!(variant, Variant::Sketched { .. }) {
            return None;
        }
        let asked = params.leaf_size.min(params.leaf_share * tree.plant.pose().extent());
        let longest = longest(plan, first, tree);
        let times = longest / (asked * (1.0 + params.leaf_spread)).max(1e-6);
        let has_most = tree.plant.leaves().len() >= params.most_leaves as usize;
        (times >= LONGER).then_some(Self { times, asked, has_most })
    }
}

/// The longest picture on a tree, metres, of those that are made: what a source brings is as long as it is.
fn longest(plan: &Plan, first: u16, tree: &Tree) -> f32 {
    let pictures = first..first.saturating_add(plan.dress.pictures);
    let made = tree.plant.leaves().iter().filter(|leaf| pictures.contains(&leaf.slot));
    made.map(|leaf| leaf.size).fold(0.0, f32::max)
}

/// What is told of the tree that the preset's `size` of a leaf is too large for most: a picture shows a twig of many.
fn large(plan: &Plan, wardrobe: &Wardrobe, trees: &[Tree]) -> Option<Note> {
    // Left out, the size follows the tree; one that suits no tree has been told of.
    if plan.dress.leaf_share > 0.0 || plan.notes.iter().any(|note| note.about == "foliage.size") {
        return None;
    }
    let share = |((n, variant), tree): ((i32, &Variant), &Tree)| {
        let Some(Dressing::Made { first, .. }) = wardrobe.dressing(plan, variant) else { return None };
        let (long, extent) = (longest(plan, first, tree), tree.plant.pose().extent());
        (long > extent * LARGE).then_some((long / extent, n, long, extent))
    };
    let (_, n, long, extent) =
        (1..).zip(&plan.variants).zip(trees).filter_map(share).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let fits = extent * USUAL_LEAF_SHARE / picture_span(plan);
    let message = format!(
        "pictures of twigs are up to {long:.2} m long on {}, which reaches {extent:.2} m: leave `size` out, or ask for \
         {fits:.3}",
        plan.called(n)
    );
    Some(Note::new("foliage.size", message))
}

/// What is told of leaves that a source brings, and that wear another's picture at their own length: one leaf's on the card of a
/// branch is a paddle.
fn kept(plan: &Plan, wardrobe: &Wardrobe) -> Option<Note> {
    let is_own = match plan.leaf_wear {
        Wear::All => matches!(plan.leaf_art, LeafArt::Files { .. }),
        Wear::Source(_) => true,
        Wear::Rest => false,
    };
    if !is_own || plan.dress.leaf_share <= 0.0 {
        return None;
    }
    let times = |plant: &Plant| {
        let usual = wardrobe.leaf_size.min(plant.pose().extent() * plan.dress.leaf_share);
        (dress::length(plant) / usual.max(1e-6), usual)
    };
    let long = |(source, plant): (&Source, &Plant)| {
        let (times, usual) = times(plant);
        (times >= PADDLE).then(|| (times, source.name.clone(), dress::length(plant), usual))
    };
    let all = plan.sources.iter().zip(&wardrobe.plants).filter_map(long);
    let (_, name, long, usual) = all.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let message = format!(
        "leaves of \"{name}\" stay {long:.2} m long, as those that it brings: if what they wear is the picture of one leaf, ask for \
         its length, as {usual:.3}"
    );
    Some(Note::new("foliage.size", message))
}

/// What is told of the source that has least left of the leaves that it brings, where few of those that the set wears show as much.
/// `plants` are the sources in what the set wears.
pub(super) fn left(plan: &Plan, sources: &[Arc<SourcePlant>], plants: &[Plant]) -> Option<Note> {
    if plan.own_density <= 0.0 {
        return None;
    }
    let count = |plant: &Plant| plant.leaves().len();
    let share = |i: usize| count(&plants[i]) as f32 / count(&sources[i].plant).max(1) as f32;
    let all = (0..plants.len()).filter(|&i| sources[i].is_leafy() && share(i) < FEW);
    let worst = all.min_by(|a, b| share(*a).total_cmp(&share(*b)))?;
    let message = format!(
        "{} of {} leaves of \"{}\" are left, which show as much as all did: a smaller `size` keeps more",
        count(&plants[worst]),
        count(&sources[worst].plant),
        plan.sources[worst].name
    );
    Some(Note::new("foliage.size", message))
}

/// One note for trees whose leaves the preset wants too large, one for all trees of a set that may not have more leaves, and one for those that have no room for more where the
/// preset asks for more than usual.
pub(super) fn notes(plan: &Plan, wardrobe: &Wardrobe, trees: &[Tree]) -> Vec<Note> {
    let longer = plan.variants.iter().zip(trees).filter_map(|(v, tree)| Longer::of(plan, wardrobe, v, tree));
    let (cut, full): (Vec<Longer>, Vec<Longer>) = longer.partition(|longer| longer.has_most);
    let like = if plan.dress.leaf_share > 0.0 { "as usual ones" } else { "as asked for" };
    let told = |some: &[Longer], about: &str, why: String, help: &str| {
        let worst = some.iter().copied().reduce(|a, b| if b.times > a.times { b } else { a })?;
        let (times, asked) = (worst.times, worst.asked / picture_span(plan));
        let trees = counted(trees.len(), "tree", "trees");
        let most = if times >= MOST_LONGER { ", the most they may be, and crowns are thinner" } else { "" };
        let longer = format!("so leaves are up to {times:.1} times as long {like} ({asked:.3} m){most}");
        Some(Note::new(about, format!("{} of {trees} {why}, {longer}: {help}", some.len())))
    };
    let why = format!("would have more leaves than `most: {}` allows", plan.dress.most_leaves);
    let cut = told(&cut, "foliage.most", why, "raise `most`, lower `density`, or ask for a larger `size`");
    let why = "would have more leaves than its branches have room for".to_owned();
    let help = "lower `density`, or ask for a larger `size`";
    let full = told(if plan.own_density > 1.0 { &full } else { &[] }, "foliage.density", why, help);
    large(plan, wardrobe, trees).into_iter().chain(cut).chain(full).chain(kept(plan, wardrobe)).collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bake::Maps;
    use crate::base::Rotation;
    use crate::plant::{Leaf, PlantBuilder};

    #[test]
    fn a_size_that_takes_nearly_all_leaves_of_an_import_is_told() {
        let pole = |leaves: u16| {
            let mut builder = PlantBuilder::new();
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.1, 0.1]);
            (0..leaves).for_each(|k| {
                builder.leaf(Leaf::new(stem, f32::from(k) / 100.0, Rotation::IDENTITY, 0.1, 0));
            });
            builder.finish().unwrap()
        };
        let text =
            "(sources: {\"a\": Import(file: \"a.obj\"), \"b\": Import(file: \"b.obj\")}, variants: [Source(\"a\")])";
        let plan = crate::preset::load("set.ron", text, &mut |_| Ok(String::new())).unwrap();
        let source = |leaves| {
            let mut source = SourcePlant::grown(pole(leaves), Vec::new());
            let color = vec![[9; 4]];
            source.leaf_maps = vec![Maps { width: 1, height: 1, color, normal: vec![[128; 3]], orm: vec![[255; 3]] }];
            Arc::new(source)
        };
        let sources = [source(100), source(50)];
        let told = |kept: [u16; 2]| left(&plan, &sources, &kept.map(pole)).map(|note| note.message);
        let bare = Plan { own_density: 0.0, ..plan.clone() };
        assert!(left(&bare, &sources, &[9, 2].map(pole)).is_none());
        assert_eq!(told([10, 50]), None);
        let few = told([9, 2]).expect("few are left");
        assert!(few.starts_with("2 of 50 leaves of \"b\" are left"), "{few}");
    }
}
