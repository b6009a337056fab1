//! What trees are cleared of, and which of them selections keep: candidates are blended bare, as high and thick as they are delivered,
//! filtered, scored and picked. Candidates are forgotten once measured; those that are kept are blended again, which costs a
//! millisecond.

use rayon::prelude::*;

use super::blends::{self, Blends};
use crate::base::{Diagnostic, Note, counted};
use crate::blend::Bounds;
use crate::plant::{ChainId, Plant, Posed};
use crate::preset::Plan;
use crate::preset::plan::{FilterParams, Pick, Selection, Variant};
use crate::relate::Blender;
use crate::select::{self, Collision, Examined, Habits, Picked, Scores, Sources};

/// A kept tree.
pub(super) struct Kept {
    /// The candidate.
    pub(super) recipe: Variant,
    /// Branches that the filter removes.
    pub(super) gone: Vec<ChainId>,
    /// Why it was kept, for the manifest.
    pub(super) told: serde_json::Value,
}

/// What all selections keep.
#[derive(Default)]
pub(super) struct Selected {
    /// By selection and place.
    kept: Vec<Vec<Kept>>,
    /// Blends that no selection decides about and that branches are removed from.
    cleared: Vec<(Variant, Vec<ChainId>)>,
    /// What was rejected and removed.
    pub(super) notes: Vec<Note>,
}

impl Selected {
    /// The kept tree that a variant is; none for a variant that no selection decides.
    pub(super) fn get(&self, variant: &Variant) -> Option<&Kept> {
        match variant {
            Variant::Selected { selection, place } => self.kept.get(*selection)?.get(*place),
            _ => None,
        }
    }

    /// The branches that are removed from a blend which no selection decides about.
    pub(super) fn gone(&self, variant: &Variant) -> &[ChainId] {
        self.cleared.iter().find(|cleared| cleared.0 == *variant).map_or(&[], |cleared| &cleared.1)
    }
}

/// Makes, filters, scores and picks the candidates of every selection.
///
/// # Errors
///
/// When a selection selects nothing, at its field.
pub(super) fn selected(plan: &Plan, made: &Blends) -> Result<Selected, Vec<Diagnostic>> {
    let mut all = Selected::default();
    let mut errors = Vec::new();
    for selection in &plan.selections {
        match one(plan, selection, made) {
            Ok((kept, notes)) => {
                all.kept.push(kept);
                all.notes.extend(notes);
            }
            Err(error) => errors.push(error),
        }
    }
    for entry in 0..plan.blends.len() {
        let (cleared, note) = cleared(plan, entry, made);
        all.cleared.extend(cleared);
        all.notes.extend(note);
    }
    if errors.is_empty() { Ok(all) } else { Err(errors) }
}

/// The branches that run into others in the trees of a blend that no selection decides about.
fn cleared(plan: &Plan, blend: usize, made: &Blends) -> (Vec<(Variant, Vec<ChainId>)>, Option<Note>) {
    let params = &plan.blends[blend];
    let is_of_blend = |variant: &&Variant| matches!(variant, Variant::Blend { blend: of, .. } if *of == blend);
    let trees: Vec<Variant> = plan.variants.iter().map(unsketched).filter(is_of_blend).cloned().collect();
    let first = trees.first().and_then(|tree| blends::blend_of(plan, tree, made));
    let (Some(filter), Some((family, _))) = (&params.filter, first) else { return Default::default() };
    let (habits, bounds) = (Habits::of(family, filter), Bounds::of(family.sources()));
    let states = blends::states(plan, &trees, made);
    let found: Vec<Vec<Collision>> = trees
        .par_iter()
        .zip(&states)
        .map_init(
            || (Blender::new(family), Plant::default()),
            |(blender, plant), (tree, state)| {
                let Some((_, weights)) = blends::blend_at(plan, tree, made, state.as_ref()) else { return Vec::new() };
                blender.blend_into(&weights, plant);
                *plant = blends::finished(params, &bounds, std::mem::take(plant));
                select::collisions(plant, &Posed::of_bearers(plant), blender.kins(), &habits, filter)
            },
        )
        .collect();
    let message = removed(found.iter().map(Vec::as_slice));
    let note = message.map(|message| Note::new(format!("variants[{}]", params.entry), message));
    let goes = |found: Vec<Collision>| found.iter().map(|c| c.goes).collect();
    (trees.into_iter().zip(found.into_iter().map(goes)).collect(), note)
}

/// A variant before it follows a sketch.
fn unsketched(variant: &Variant) -> &Variant {
    match variant {
        Variant::Sketched { of, .. } => of,
        plain => plain,
    }
}

/// What is said of branches that are removed from trees.
fn removed<'c>(trees: impl Iterator<Item = &'c [Collision]>) -> Option<String> {
    let (mut all, mut mended, mut branches, mut worst) = (0, 0, 0, 0.0_f32);
    for found in trees {
        all += 1;
        mended += usize::from(!found.is_empty());
        branches += found.len();
        worst = found.iter().fold(worst, |worst, c| worst.max(c.ratio));
    }
    (mended > 0).then(|| {
        format!(
            "{} that ran into others (up to {:.0} % of a surface) removed from {mended} of {}",
            counted(branches, "branch", "branches"),
            worst * 100.0,
            counted(all, "tree", "trees")
        )
    })
}

/// The kept trees of one selection and what is to be said of them.
type Outcome = (Vec<Kept>, Vec<Note>);

fn one(plan: &Plan, selection: &Selection, made: &Blends) -> Result<Outcome, Diagnostic> {
    let first = selection.candidates.first().and_then(|recipe| blends::params_of(plan, recipe, made));
    let Some((params, family)) = first else { return Ok((Vec::new(), Vec::new())) };
    let bounds = Bounds::of(family.sources());
    let sources = Sources::of(family, &selection.filter);
    let states = blends::states(plan, &selection.candidates, made);
    // All of one blend, so of one family.
    let examined: Vec<Examined> = selection
        .candidates
        .par_iter()
        .zip(&states)
        .map_init(
            || (Blender::new(family), Plant::default()),
            |(blender, plant), (recipe, state)| {
                let (_, weights) = blends::blend_at(plan, recipe, made, state.as_ref())?;
                blender.blend_into(&weights, plant);
                *plant = blends::finished(params, &bounds, std::mem::take(plant));
                Some(select::examine(plant, blender.kins(), &sources, &selection.filter))
            },
        )
        .flatten_iter()
        .collect();
    let scores = select::scores(&examined, &sources, &selection.scores);
    let Selection { pick, keep, decided, filter, .. } = selection;
    let picked = select::pick_decided(*pick, *keep, decided, filter.botany, &examined, &scores);
    let picked = picked.map_err(|error| {
        let hint = match error {
            select::PickError::TooFew { .. } => "raise `candidates`, or lower `count`",
            select::PickError::Apart { .. } => "lower `apart`, or raise `candidates`",
        };
        Diagnostic::new("", error.to_string()).with_field(format!("{}.pick", selection.field)).with_hint(hint)
    })?;
    let kept = picked.kept.iter().map(|&i| Kept {
        recipe: selection.candidates[i].clone(),
        gone: examined[i].gone(),
        told: told(i, selection, &picked, &examined[i], &scores),
    });
    Ok((kept.collect(), notes(selection, &picked, &examined, &sources)))
}

/// A kept tree as the manifest tells of it.
fn told(
    candidate: usize,
    selection: &Selection,
    picked: &Picked,
    tree: &Examined,
    scores: &Scores,
) -> serde_json::Value {
    serde_json::json!({
        "pick": selection.pick,
        "candidate": candidate + 1,
        "candidates": selection.candidates.len(),
        "rejected": picked.rejected,
        "score": scores.each[candidate],
        "departure": tree.departure.by,
        "departs_in": tree.departure.what,
        "branches_removed": tree.collisions.len(),
    })
}

/// A number with as many decimals as it takes to see that it is above a limit, one at least.
fn above(value: f32, limit: f32) -> String {
    let shown = (1..6).map(|decimals| format!("{value:.decimals$}"));
    shown.into_iter().find(|text| text.parse::<f32>().is_ok_and(|v| v > limit)).unwrap_or_else(|| value.to_string())
}

/// What people want to know of a selection.
fn notes(selection: &Selection, picked: &Picked, trees: &[Examined], sources: &Sources) -> Vec<Note> {
    let FilterParams { botany, .. } = selection.filter;
    let mut said = Vec::new();
    let many = trees.len();
    let worst = |of: &[usize]| {
        let by = |i: &&usize| trees[**i].departure;
        of.iter().max_by(|a, b| by(a).by.total_cmp(&by(b).by).then(b.cmp(a))).map(|i| trees[*i].departure)
    };
    if picked.rejected > 0 {
        let all: Vec<usize> = (0..many).collect();
        let reason = worst(&all).map_or(String::new(), |d| format!("; the worst departs by {:.1} in {}", d.by, d.what));
        let rejected = picked.rejected;
        said.push(format!(
            "{rejected} of {} rejected as unlike the sources{reason}",
            counted(many, "candidate", "candidates")
        ));
    }
    if picked.in_spite > 0 {
        let most = worst(&picked.kept).map_or(0.0, |d| d.by);
        said.push(format!(
            "the filter lets too few through: {} of the {} had been rejected, the least bad of those, and {} by up to {} where \
             {botany} is allowed",
            picked.in_spite,
            counted(picked.kept.len(), "tree that is kept", "trees that are kept"),
            if picked.in_spite == 1 { "departs" } else { "depart" },
            above(most, botany),
        ));
    }
    said.extend(removed(picked.kept.iter().map(|&i| trees[i].collisions.as_slice())));
    if let (Pick::Diverse { apart }, Some(found)) = (selection.pick, picked.apart)
        && found < apart
    {
        said.push(format!("the two nearest of the kept trees are {found:.3} apart, not {apart}"));
    }
    let own = sources.own_collisions();
    if own.iter().any(|n| *n > 0) {
        let counts: Vec<String> = own.iter().map(ToString::to_string).collect();
        said.push(format!("the sources' own branches run into each other {} times, and stay", counts.join(" and ")));
    }
    said.into_iter().map(|message| Note::new(selection.field.clone(), message)).collect()
}

#[cfg(test)]
mod tests {
    use super::above;

    #[test]
    fn what_is_above_a_limit_is_seen_to_be() {
        let cases = [(2.04, "2.04"), (2.1, "2.1"), (2.000_04, "2.00004"), (2.96, "3.0"), (17.0, "17.0")];
        for (value, shown) in cases {
            assert_eq!(above(value, 2.0), shown);
        }
        // What is not above it is told as it is.
        assert_eq!(above(1.5, 2.0), "1.5");
    }
}
