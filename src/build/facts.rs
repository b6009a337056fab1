//! What the manifest tells of trees and their shapes alone, whatever they wear: counts, bounds and colliders.

use std::sync::Arc;

use rayon::prelude::*;

use super::cache::{Cache, Stage};
use super::trees::Tree;
use crate::base::{Diagnostic, Note};
use crate::export::{self, Bounds};
use crate::plant::PlantBrief;
use crate::preset::Plan;
use crate::preset::plan::Lod;

/// The stage that looks at trees, kept in memory only, with its version.
const FACTS: Stage = Stage("facts", 8);

/// What is told of a tree and its shape alone.
pub(super) struct Facts {
    pub(super) brief: PlantBrief,
    pub(super) bounds: Bounds,
    pub(super) capsules: Vec<export::Capsule>,
    pub(super) hulls: Vec<export::Hull>,
    /// Of the thickest wood, metres.
    pub(super) thickest: f32,
}

/// Looks at every tree that was not looked at before.
pub(super) fn facts(plan: &Plan, trees: &[Tree], cache: &Cache) -> Result<Vec<Arc<Facts>>, Vec<Diagnostic>> {
    let one = |tree: &Tree| {
        // They are the tree's and its first level's: where that is the full one, no budget changes them.
        let of = if plan.lods.first().is_some_and(|level| level.lod == Lod::Full) { tree.of } else { tree.key };
        let key = FACTS.key().input(of).params(&plan.colliders).finish();
        cache.remember_here(
            key,
            |facts: &Facts| {
                facts.capsules.len() * 32 + facts.hulls.iter().map(|h| h.points.len() * 40).sum::<usize>() + 512
            },
            || {
                let (plant, full) = (&*tree.plant, &tree.ladder.levels[0].mesh);
                let posed = plant.pose();
                let asked = &plan.colliders;
                let points = full.bark.positions.iter().chain(&full.leaf.positions).copied();
                Ok(Facts {
                    thickest: plant.all_radii().iter().fold(0.0_f32, |a, &r| a.max(r)),
                    brief: PlantBrief::of(plant, &posed),
                    bounds: Bounds::of(points).unwrap_or(Bounds { min: [0.0; 3], max: [0.0; 3] }),
                    capsules: export::capsules(plant, &posed, asked),
                    hulls: export::crown_hulls(plant, &posed, &full.leaf, asked.crown, asked.corners),
                })
            },
        )
    };
    trees.par_iter().map(one).collect()
}

/// What is told of variants that nothing runs into, since their wood is thinner than what gets capsules.
pub(super) fn bodiless(plan: &Plan, facts: &[Arc<Facts>]) -> Option<Note> {
    let is_bare = |facts: &Facts| plan.colliders.most > 0 && facts.capsules.is_empty() && facts.hulls.is_empty();
    let bare: Vec<(i32, &Facts)> =
        (1..).zip(facts).map(|(n, facts)| (n, &**facts)).filter(|(_, facts)| is_bare(facts)).collect();
    let (n, thickest) = bare.iter().map(|(n, facts)| (*n, facts.thickest)).max_by(|a, b| b.1.total_cmp(&a.1))?;
    let message = format!(
        "{} of {} variants {} no collider, since all of the wood is thinner than {} m: the thickest of {} is of \
         {thickest:.3} m; a `thick` below it gives it capsules, a `crown` hulls",
        bare.len(),
        facts.len(),
        if bare.len() == 1 { "has" } else { "have" },
        plan.colliders.least_radius,
        plan.called(n),
    );
    Some(Note::new("colliders.thick", message))
}
