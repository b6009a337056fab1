//! "Grow more like this scan": parameters of growth estimated from a plant (the example-based control that 2015, 5 names
//! as future work).
//!
//! The plant is measured (`measure`), the measures become a `Recipe`, and the recipe is written as a
//! species file, which is read back like any other: what is grown is what a designer can edit, with the same ranges.
//!
//! | parameter | estimated from |
//! |---|---|
//! | first iteration | stems; how far up the stem holds a third of the wood's cross section |
//! | volume of the second | the tips of the longest branches: the smallest shape that holds 9 of 10, and how hollow it is |
//! | its start and bend | the branches' inclination where they leave, against height, and what it changes to |
//! | later iterations | the other branches in up to three groups by length: k from length, α1 from branching angle, α2 from bend, counts |
//! | bole | the height below which a 30th of the branches' wood leaves |
//! | tip radius, exponent, taper | least squares of all base radii over what they carry (`radii`) |
//! | flare | the stem's radius at the ground against its course above |
//! | slenderness | the longest branches against their radii |
//! | crookedness | arc length over chord |
//!
//! Paths find their own way, so a tree grown by the first recipe misses some of its measures. `ROUNDS` trial trees are
//! grown and measured alike, and each corrects the recipe by what it missed. What measures don't tell is searched for: in
//! `GENERATIONS` generations the best recipe so far is varied `BROOD` times, each time less, and replaced by one whose
//! trees come nearer ([`Habit::distance`](crate::plant::Habit::distance), the mean of two trees, so that no recipe wins by a
//! lucky one). Trunks are as thick as the plant's: trials with others are grown again with radii that fit what they carry, since
//! branches are shed by their radii and distances hardly see them (of one maple the trunk was nine times too thick). Deterministic; about as long as 110 trees of 12,000 to 60,000 nodes take, some seconds.
//!
//! Limits: one crown shape of the five, upright about the axis; no more than four levels. A plant without branches gives
//! a bare stem.

mod crown;
mod measure;
mod radii;
mod recipe;

#[cfg(test)]
mod tests;

use rayon::prelude::*;

use crate::base::Seed;
use crate::plant::{Habit, Plant};
use crate::preset::plan::GrowParams;
use crate::preset::species;
use crate::source::grow::{GrowError, grow};

use measure::Measures;
use recipe::Recipe;

/// Trial trees that correct the recipe.
const ROUNDS: u64 = 6;
/// Generations of recipes that are varied.
const GENERATIONS: u64 = 8;
/// Recipes of a generation.
const BROOD: u64 = 6;
/// By how much the first generation varies, as a share; and by how much less each next one.
const SIZE: [f32; 2] = [0.35, 0.75];

/// How many times too thick or too thin trunks of trials may be, and those of the last; and in how many rounds that is sought.
const THICK: f32 = 1.25;
const FIT: f32 = 1.08;
const FITS: u64 = 3;

/// What was estimated.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Parameters that grow plants like it, at its height, with seed 1.
    pub params: GrowParams,
    /// The same as a species file, every line explained.
    pub text: String,
    /// How far the two trees lie from the plant that came nearest, 0..=1; see [`Habit::distance`].
    pub distance: f32,
}

/// Why nothing was estimated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EstimateError {
    /// It has no height to speak of.
    #[error("it is {0} m high; a plant of 0.1 to 150 m is needed")]
    Height(f32),
    /// No trial grew.
    #[error("nothing like it grows: {0}")]
    Grow(#[from] GrowError),
}

/// Estimates the parameters that grow plants like this one. Leaves do not count.
///
/// # Errors
///
/// When the plant is lower than 0.1 m or higher than 150 m, or when nothing grows.
pub fn estimate(plant: &Plant) -> Result<Estimate, EstimateError> {
    let height = plant.height();
    if !(0.1..=150.0).contains(&height) {
        return Err(EstimateError::Height(height));
    }
    search(plant, GENERATIONS)
}

/// A recipe that was tried.
struct Trial {
    recipe: Recipe,
    params: GrowParams,
    text: String,
    distance: f32,
    /// Mean radius of the trunks of its trees, metres.
    radius: f32,
}

/// What trees are held against.
struct Target {
    measures: Measures,
    habit: Habit,
}

impl Target {
    /// How many times too thick or too thin a trial's trunks are.
    fn miss(&self, trial: &Trial) -> f32 {
        let times = self.measures.base_radius / trial.radius;
        times.max(times.recip())
    }

    /// Grows by a recipe, from some seeds; none where its text has a number out of its range.
    fn grown(&self, recipe: Recipe, seeds: [u64; 2]) -> Option<Result<Trial, GrowError>> {
        let text = recipe.text();
        let params = species("estimate", &text).ok()?;
        let (mut distance, mut radius) = (0.0, 0.0);
        for seed in seeds {
            match grow(&GrowParams { seed, ..params.clone() }, Seed::new(seed).child("grow")) {
                Ok((grown, _)) => {
                    distance += self.habit.distance(&Habit::of(&grown)) * 0.5;
                    radius += measure::base_radius(&grown) * 0.5;
                }
                Err(error) => return Some(Err(error)),
            }
        }
        Some(Ok(Trial { recipe, params, text, distance, radius }))
    }

    /// As [`grown`](Self::grown), once more with radii that fit where trunks are too thick or too thin: branches are shed by them.
    fn tried(&self, recipe: Recipe, seeds: [u64; 2], thick: f32) -> Option<Result<Trial, GrowError>> {
        let mut trial = match self.grown(recipe, seeds)? {
            Ok(trial) if self.miss(&trial) > thick => trial,
            other => return Some(other),
        };
        let radius = trial.radius;
        trial.recipe.thicken(&self.measures, radius);
        self.grown(trial.recipe, seeds)
    }
}

fn search(plant: &Plant, generations: u64) -> Result<Estimate, EstimateError> {
    let target = Target { measures: Measures::of(plant, None), habit: Habit::of(plant) };
    let mut recipe = Recipe::of(&target.measures);
    let mut best: Option<Trial> = None;
    let mut failed = None;
    for round in 0..ROUNDS {
        let Some(trial) = target.grown(recipe.clone(), [round, round + 100]) else { break };
        match trial {
            Ok(trial) => {
                let params = GrowParams { seed: round, ..trial.params.clone() };
                let (grown, _) = grow(&params, Seed::new(round).child("grow"))?;
                recipe.correct(&target.measures, &Measures::of(&grown, Some(&target.measures)));
                // Of the first ones the radii are not corrected yet.
                let is_fit = target.miss(&trial) <= THICK;
                if best
                    .as_ref()
                    .is_none_or(|best| (!is_fit, trial.distance) < (target.miss(best) > THICK, best.distance))
                {
                    best = Some(trial);
                }
            }
            Err(error) => {
                failed = Some(error);
                recipe.loosen();
            }
        }
    }
    let Some(mut best) = best else { return Err(failed.unwrap_or(GrowError::Nothing).into()) };
    let mut size = SIZE[0];
    for generation in 0..generations {
        let seed = Seed::new(0).child("vary").at(generation);
        let brood: Vec<Option<Result<Trial, GrowError>>> = (0..BROOD)
            .into_par_iter()
            .map(|i| {
                let first = ROUNDS + generation * 2;
                target.tried(best.recipe.varied(seed.at(i), size), [first, first + 1], THICK)
            })
            .collect();
        for trial in brood.into_iter().flatten().flatten() {
            if trial.distance < best.distance && target.miss(&trial) <= THICK.max(target.miss(&best)) {
                best = trial;
            }
        }
        size *= SIZE[1];
    }
    for round in 0..FITS {
        if target.miss(&best) <= FIT {
            break;
        }
        match target.tried(best.recipe.clone(), [200 + 2 * round, 201 + 2 * round], FIT) {
            Some(Ok(trial)) if target.miss(&trial) < target.miss(&best) => best = trial,
            _ => {}
        }
    }
    let Trial { params, text, distance, .. } = best;
    Ok(Estimate { params, text, distance })
}
