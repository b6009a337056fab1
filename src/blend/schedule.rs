//! Stochastic blending between two sources: grow, wilt and morph tasks, and the order in which they happen
//! (2017 TVCG, 4.3).
//!
//! Each kin of the two sources is a task: *morph* where both have a member, *wilt* where only the first has, *grow*
//! where only the second has. The kins' own hierarchy is the scheduling tree. A task ends at a random death time; at
//! every step a random pack of the active tasks moves on, each by a random amount. A batch is the sequence of the
//! states, from the first source to the second.
//!
//! The paper's rules are kept, and a little more: a shoot that has grown by a tenth would bear grown boughs, a broom on a
//! stump. So a growing chain is never further than its parent, and a wilting chain never further than its children;
//! where the parent has not started (the grow rule) or a child still stands (the wilt rule) that is the paper's.
//!
//! Kins that share a member (split and merge) lie on one another at the end where they share it: only the one that
//! stands for the member is shown there, the others appear with their first step and go with their last.
//!
//! A step costs time linear in the kins; a batch takes some 50 to 150 steps.

use crate::base::Seed;
use crate::relate::{Family, KinId, Weights};

/// After this many steps a batch ends at its target, whatever is left to do; real ones need a tenth.
const MOST_STEPS: u64 = 2000;

/// What a kin does between the two sources.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Task {
    /// Neither source has it.
    None,
    Grow,
    Wilt,
    Morph,
}

/// The states of a batch, one after the other: the first is the source, the last the target.
#[derive(Clone, Debug)]
pub struct Batch<'a> {
    family: &'a Family,
    seed: Seed,
    from: usize,
    to: usize,
    tasks: Vec<Task>,
    /// t_dth of each task.
    death: Vec<f32>,
    /// t_act / t_dth of each task.
    done: Vec<f32>,
    /// Steps taken; none before the source itself was given out.
    step: Option<u64>,
}

/// The batch with this seed between two sources of a family (indices; out of range gives an empty batch).
#[must_use]
pub fn batch(family: &Family, from: usize, to: usize, seed: Seed) -> Batch<'_> {
    let task = |kin| match (family.member(kin, from).is_some(), family.member(kin, to).is_some()) {
        (true, true) => Task::Morph,
        (true, false) => Task::Wilt,
        (false, true) => Task::Grow,
        (false, false) => Task::None,
    };
    let tasks: Vec<Task> = family.kin_ids().map(task).collect();
    let death = (0..tasks.len() as u64).map(|k| seed.child("death").at(k).range(1.0, 8.0)).collect();
    Batch { family, seed, from, to, done: vec![0.0; tasks.len()], tasks, death, step: None }
}

/// The state of the batch whose [progress](progress_of) is nearest `progress`, the earlier one of two; 0 is the source
/// and 1 the target.
#[must_use]
pub fn sample(family: &Family, from: usize, to: usize, seed: Seed, progress: f32) -> Weights {
    let mut batch = batch(family, from, to, seed);
    let mut best: Option<(f32, Vec<f32>)> = None;
    while batch.advance() {
        let distance = (batch.progress() - progress).abs();
        // Progress never falls, so the distance falls and then rises; at 1 only the target itself will do.
        match &mut best {
            Some((least, _)) if distance > *least => break,
            Some((least, state)) if distance < *least => {
                *least = distance;
                state.clone_from(&batch.done);
            }
            Some(_) => {}
            None => best = Some((distance, batch.done.clone())),
        }
    }
    if let Some((_, state)) = best {
        batch.done = state;
    }
    batch.weights()
}

/// How far a batch's state has come on the way between two sources, 0..=1: the mean of its tasks.
#[must_use]
pub fn progress_of(family: &Family, from: usize, to: usize, weights: &Weights) -> f32 {
    let (mut sum, mut count) = (0.0_f64, 0_usize);
    for kin in family.kin_ids() {
        let done = match (family.member(kin, from).is_some(), family.member(kin, to).is_some()) {
            (true, true) => weights.shares(kin).get(to).copied().unwrap_or(0.0),
            (true, false) => 1.0 - weights.degree(kin),
            (false, true) => weights.degree(kin),
            (false, false) => continue,
        };
        sum += f64::from(done);
        count += 1;
    }
    if count == 0 { 1.0 } else { (sum / count as f64) as f32 }
}

impl Batch<'_> {
    /// The mean of all tasks' degrees, 0..=1.
    fn progress(&self) -> f32 {
        let active = self.tasks.iter().zip(&self.done).filter(|(task, _)| **task != Task::None);
        let (sum, count) = active.fold((0.0_f64, 0_usize), |(s, n), (_, d)| (s + f64::from(*d), n + 1));
        if count == 0 { 1.0 } else { (sum / count as f64) as f32 }
    }

    /// Moves to the next state that differs from the last; false after the end.
    fn advance(&mut self) -> bool {
        let sources = self.family.sources().len();
        if self.from >= sources || self.to >= sources {
            return false;
        }
        let Some(mut step) = self.step else {
            self.step = Some(0);
            return true;
        };
        let finished = |batch: &Self| batch.tasks.iter().zip(&batch.done).all(|(t, d)| *t == Task::None || *d >= 1.0);
        if finished(self) {
            return false;
        }
        loop {
            step += 1;
            self.step = Some(step);
            if step >= MOST_STEPS {
                self.done.fill(1.0);
                return true;
            }
            if self.execute(step) {
                return true;
            }
        }
    }

    /// Carries out one pack of tasks; whether anything changed.
    fn execute(&mut self, step: u64) -> bool {
        let seed = self.seed.child("pack").at(step);
        let pack = seed.child("size").range(0.1, 0.7);
        let amount = |k: usize| {
            let draw = seed.at(k as u64);
            (draw.unit() < pack).then(|| draw.child("amount").range(0.0, 2.0) / self.death[k])
        };
        let mut changed = false;
        // Growing: parents come before children.
        for k in 0..self.tasks.len() {
            if !matches!(self.tasks[k], Task::Grow | Task::Morph) || self.done[k] >= 1.0 {
                continue;
            }
            let Some(amount) = amount(k) else { continue };
            let bearer = self.family.parent(KinId(k as u32)).map(KinId::index);
            let most = match bearer {
                Some(p) if self.tasks[k] == Task::Grow && self.tasks[p] == Task::Grow => self.done[p],
                _ => 1.0,
            };
            let next = (self.done[k] + amount).min(most).max(self.done[k]);
            changed |= next != self.done[k];
            self.done[k] = next;
        }
        // Wilting: children come before parents.
        for k in (0..self.tasks.len()).rev() {
            if self.tasks[k] != Task::Wilt || self.done[k] >= 1.0 {
                continue;
            }
            let Some(amount) = amount(k) else { continue };
            let children = self.family.children(KinId(k as u32)).map(KinId::index);
            let most = children.filter(|&c| self.tasks[c] == Task::Wilt).fold(1.0, |d, c| self.done[c].min(d));
            let next = (self.done[k] + amount).min(most).max(self.done[k]);
            changed |= next != self.done[k];
            self.done[k] = next;
        }
        changed
    }

    /// The present state.
    fn weights(&self) -> Weights {
        let sources = self.family.sources().len();
        let mut weights = Weights::new(self.tasks.len(), sources);
        if self.from >= sources || self.to >= sources {
            return weights;
        }
        let mut shares = vec![0.0; sources];
        for kin in self.family.kin_ids() {
            let done = self.done[kin.index()];
            let (start, end) = (done <= 0.0, done >= 1.0);
            shares.fill(0.0);
            let degree = match self.tasks[kin.index()] {
                Task::None => continue,
                Task::Grow => {
                    shares[self.to] = 1.0;
                    if end && !self.family.is_primary(kin, self.to) { 0.0 } else { done }
                }
                Task::Wilt => {
                    shares[self.from] = 1.0;
                    if start && !self.family.is_primary(kin, self.from) { 0.0 } else { 1.0 - done }
                }
                Task::Morph => {
                    shares[self.from] = 1.0 - done;
                    shares[self.to] += done;
                    let doubled = (start && !self.family.is_primary(kin, self.from))
                        || (end && !self.family.is_primary(kin, self.to));
                    if doubled { 0.0 } else { 1.0 }
                }
            };
            weights.set(kin, &shares, degree);
        }
        weights
    }
}

impl Iterator for Batch<'_> {
    type Item = Weights;

    fn next(&mut self) -> Option<Weights> {
        self.advance().then(|| self.weights())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::PlantStats;
    use crate::preset::plan::MatchParams;
    use crate::relate::fuzzy_family;
    use crate::relate::random_plant::{Oddity, random_plant};

    fn pair(seed: u64, oddity: Oddity) -> Family {
        let plant = |name| random_plant(Seed::new(seed).child(name), 40, oddity);
        fuzzy_family(plant("a"), plant("b"), &MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 }).unwrap()
    }

    #[test]
    fn a_batch_runs_from_the_source_to_the_target() {
        for seed in 0..20 {
            let family = pair(seed, Oddity::Wild);
            let states: Vec<Weights> = batch(&family, 0, 1, Seed::new(seed)).collect();
            assert!(states.len() < 400, "{}", states.len());
            assert!(family.blend(&states[0]) == family.sources()[0]);
            assert!(family.blend(&states[states.len() - 1]) == family.sources()[1]);
            let progress: Vec<f32> = states.iter().map(|w| progress_of(&family, 0, 1, w)).collect();
            assert!(progress.windows(2).all(|p| p[1] > p[0] - 1e-6));
        }
    }

    #[test]
    fn grow_and_wilt_rules_hold_in_every_state() {
        for seed in 0..10 {
            let family = pair(seed, Oddity::Tame);
            for weights in batch(&family, 0, 1, Seed::new(seed)) {
                for kin in family.kin_ids() {
                    let Some(parent) = family.parent(kin) else { continue };
                    assert!(weights.degree(kin) <= weights.degree(parent) + 1e-6);
                }
            }
        }
    }

    #[test]
    fn no_state_has_a_floating_chain() {
        for seed in 0..4 {
            let family = pair(seed, Oddity::Tame);
            for weights in batch(&family, 0, 1, Seed::new(seed)).step_by(5) {
                let plant = family.blend(&weights);
                let shown = family.kin_ids().filter(|&k| weights.degree(k) > 0.0).count();
                assert_eq!(plant.chains().len(), shown);
                assert_eq!(PlantStats::of(&plant).topology_continuity, 1.0);
            }
        }
    }

    #[test]
    fn seeds_make_batches_that_differ_and_the_same_seed_the_same() {
        let family = pair(3, Oddity::Tame);
        let half = |seed| sample(&family, 0, 1, Seed::new(seed), 0.5);
        assert!(half(1) == half(1));
        assert!(half(1) != half(2));
        assert!(family.blend(&half(1)) != family.blend(&half(2)));
    }

    #[test]
    fn a_sample_is_the_nearest_state_of_its_batch() {
        let family = pair(4, Oddity::Tame);
        let seed = Seed::new(9);
        for i in 0..=10 {
            let wanted = i as f32 / 10.0;
            let found = progress_of(&family, 0, 1, &sample(&family, 0, 1, seed, wanted));
            let least = batch(&family, 0, 1, seed)
                .map(|w| (progress_of(&family, 0, 1, &w) - wanted).abs())
                .fold(f32::INFINITY, f32::min);
            assert!(((found - wanted).abs() - least).abs() < 1e-5);
        }
        assert!(family.blend(&sample(&family, 0, 1, seed, 0.0)) == family.sources()[0]);
        assert!(family.blend(&sample(&family, 0, 1, seed, 1.0)) == family.sources()[1]);
    }

    #[test]
    fn sources_that_are_not_there_give_an_empty_batch() {
        let family = pair(5, Oddity::Tame);
        assert_eq!(batch(&family, 0, 7, Seed::new(1)).count(), 0);
        assert_eq!(sample(&family, 7, 0, Seed::new(1), 0.5).kins(), family.kin_count());
    }
}
