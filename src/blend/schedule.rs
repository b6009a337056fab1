//! Stochastic blending between two sources: the order in which grow, wilt and morph tasks happen (2017 TVCG, 4.3).
//!
//! Each kin is a task: *morph* where both sources have a member, *wilt* where only the first has, *grow* where only the
//! second has. The kins' own hierarchy is the scheduling tree. A task has a random death time and an active time that
//! starts at 0; its degree is the one over the other. At every step a random pack of the active tasks moves on, each by a
//! random amount, until all have reached their death. A batch is the sequence of the states, from the first source to the
//! second.
//!
//! The paper's rules are kept, and a little more: a shoot that has grown by a tenth would bear grown boughs, a broom on a
//! stump. So a growing chain is never further than its parent, and a wilting chain never further than its children;
//! where the parent has not started (the grow rule) or a child still stands (the wilt rule) that is the paper's.
//!
//! A [`State`] holds the degree of each task in steps of 1/65535, two bytes a kin, and is exact: the schedule itself
//! counts in these. So ten thousand states of a family of 700 kins take 14 MB.
//!
//! Kins that share a member (split and merge) lie on one another at the end where they share it: they stay until the
//! last state, where the one that stands for the member is shown alone.
//!
//! A step costs time linear in the kins; a batch at the usual pace takes some 50 to 150 steps.

use rayon::prelude::*;

use super::tasks::{Task, Tasks};
use crate::base::Seed;
use crate::plant::Plant;
use crate::relate::{Blender, Family, KinId, Weights};

/// After this many steps at the usual pace a batch ends at its target, whatever is left to do; real ones need a tenth.
const MOST_STEPS: u64 = 2000;
/// A task's whole degree.
const DONE: u16 = u16::MAX;
/// Steps that a batch takes at the usual pace, about.
const USUAL_STEPS: f32 = 60.0;

/// The degree of every task, in 65535ths: one state of a batch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct State {
    degrees: Vec<u16>,
}

impl State {
    /// How many bytes it takes, its own header included.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.degrees.capacity() * size_of::<u16>()
    }
}

/// The states of a batch, one after the other: the first is the source, the last the target.
#[derive(Clone, Debug)]
pub struct Batch<'t> {
    tasks: &'t Tasks<'t>,
    seed: Seed,
    pace: f32,
    /// t_dth of each task.
    death: Vec<f32>,
    /// t_act / t_dth of each task.
    state: State,
    /// Steps taken; none before the source itself was given out.
    step: Option<u64>,
}

impl<'f> Tasks<'f> {
    /// The batch with this seed. `pace` scales how far tasks move in a step: 1 is the usual, half of it takes twice as
    /// many steps.
    #[must_use]
    pub fn batch(&self, seed: Seed, pace: f32) -> Batch<'_> {
        let death = (0..self.tasks.len() as u64).map(|k| seed.child("death").at(k).range(1.0, 8.0)).collect();
        let state = State { degrees: vec![0; self.tasks.len()] };
        let pace = if pace.is_finite() { pace.clamp(1e-3, 1e3) } else { 1.0 };
        Batch { tasks: self, seed, pace, death, state, step: None }
    }

    /// `trees` in-betweens of one batch: of all its states those nearest to evenly spread progress between `low` and
    /// `high`, in order. The pace follows their number, so that hardly two are the same.
    #[must_use]
    pub fn in_betweens(&self, seed: Seed, trees: usize, low: f32, high: f32) -> Vec<State> {
        let span = (high - low).max(0.05);
        let pace = (USUAL_STEPS * span / (8.0 * trees.max(1) as f32)).min(1.0);
        let wanted = |i: usize| low + (high - low) * (i as f32 + 0.5) / trees as f32;
        let mut batch = self.batch(seed, pace);
        let mut states = Vec::with_capacity(trees);
        let mut last: Option<(f32, State)> = None;
        while states.len() < trees && batch.advance() {
            let progress = batch.progress();
            while states.len() < trees && progress >= wanted(states.len()) {
                let target = wanted(states.len());
                let nearer = last.as_ref().filter(|(before, _)| target - before < progress - target);
                states.push(nearer.map_or_else(|| batch.state.clone(), |(_, state)| state.clone()));
            }
            match &mut last {
                Some((before, state)) => {
                    *before = progress;
                    state.degrees.copy_from_slice(&batch.state.degrees);
                }
                None => last = Some((progress, batch.state.clone())),
            }
        }
        // Where nothing has anything to do all states are the source.
        while self.in_range() && states.len() < trees {
            states.push(batch.state.clone());
        }
        states
    }

    /// The state of the batch whose progress is nearest `progress`, the earlier one of two; 0 is the source and 1 the
    /// target.
    #[must_use]
    pub fn sample(&self, seed: Seed, progress: f32, pace: f32) -> State {
        let mut batch = self.batch(seed, pace);
        let mut best: Option<(f32, State)> = None;
        while batch.advance() {
            let distance = (batch.progress() - progress).abs();
            // Progress never falls, so the distance falls and then rises; at 1 only the target itself will do.
            match &mut best {
                Some((least, _)) if distance > *least => break,
                Some((least, state)) if distance < *least => {
                    *least = distance;
                    state.degrees.copy_from_slice(&batch.state.degrees);
                }
                Some(_) => {}
                None => best = Some((distance, batch.state.clone())),
            }
        }
        best.map_or(batch.state, |(_, state)| state)
    }

    /// As [`sample`](Self::sample) for each of some places in the batch, in one run through it.
    #[must_use]
    pub fn samples(&self, seed: Seed, progress: &[f32], pace: f32) -> Vec<State> {
        let mut batch = self.batch(seed, pace);
        let mut states = vec![batch.state.clone(); progress.len()];
        // What is not a number stays at the first state.
        let mut order: Vec<usize> = (0..progress.len()).filter(|&i| !progress[i].is_nan()).collect();
        order.sort_by(|&a, &b| progress[a].total_cmp(&progress[b]).then(a.cmp(&b)));
        let mut open = order.into_iter().peekable();
        // The first state that has come this far.
        let mut last: Option<(f32, State)> = None;
        while open.peek().is_some() && batch.advance() {
            let now = batch.progress();
            if last.as_ref().is_some_and(|(before, _)| now <= *before) {
                continue;
            }
            while let Some(i) = open.next_if(|&i| progress[i] <= now) {
                let earlier =
                    last.as_ref().filter(|(before, _)| (before - progress[i]).abs() <= (now - progress[i]).abs());
                states[i].clone_from(earlier.map_or(&batch.state, |(_, state)| state));
            }
            match &mut last {
                Some((before, state)) => {
                    *before = now;
                    state.degrees.copy_from_slice(&batch.state.degrees);
                }
                None => last = Some((now, batch.state.clone())),
            }
        }
        if let Some((_, state)) = last {
            open.for_each(|i| states[i].clone_from(&state));
        }
        states
    }

    /// How far a state has come, 0..=1: the mean of its tasks.
    #[must_use]
    pub fn progress(&self, state: &State) -> f32 {
        let acting = self.tasks.iter().zip(&state.degrees).filter(|(task, _)| task.acts());
        let (sum, count) = acting.fold((0_u64, 0_u64), |(sum, n), (_, d)| (sum + u64::from(*d), n + 1));
        if count == 0 { 1.0 } else { (sum as f64 / (count as f64 * f64::from(DONE))) as f32 }
    }

    /// A state between two, the `share` of the second 0..=1: for motion between the states of a batch.
    #[must_use]
    pub fn between(&self, a: &State, b: &State, share: f32) -> Weights {
        let at = |k: usize| {
            let (a, b) = (f32::from(a.degrees[k]), f32::from(b.degrees[k]));
            (a + (b - a) * share) / f32::from(DONE)
        };
        self.weights_by(&at)
    }

    /// The weights of a state.
    #[must_use]
    pub fn weights(&self, state: &State) -> Weights {
        self.weights_by(&|k| f32::from(state.degrees[k]) / f32::from(DONE))
    }

    fn weights_by(&self, done: &dyn Fn(usize) -> f32) -> Weights {
        let sources = self.family.sources().len();
        let mut weights = Weights::new(self.tasks.len(), sources);
        if !self.in_range() {
            return weights;
        }
        let all = |end: f32| self.tasks.iter().enumerate().all(|(k, task)| !task.acts() || done(k) == end);
        if all(0.0) {
            return self.family.corner(self.from);
        }
        if self.whole && all(1.0) {
            return self.family.corner(self.to);
        }
        let mut shares = vec![0.0; sources];
        for kin in self.family.kin_ids() {
            let done = done(kin.index());
            shares.fill(0.0);
            let degree = match self.tasks[kin.index()] {
                Task::None | Task::Absent => continue,
                Task::Still => {
                    weights.keep(kin);
                    shares[self.from] = 1.0;
                    1.0
                }
                Task::Grow => {
                    shares[self.to] = 1.0;
                    done
                }
                Task::Wilt => {
                    shares[self.from] = 1.0;
                    1.0 - done
                }
                Task::Morph => {
                    shares[self.from] = 1.0 - done;
                    shares[self.to] += done;
                    1.0
                }
            };
            weights.set(kin, &shares, degree);
        }
        weights
    }

    /// Something of the tree of every state (its place, the tree, the kin of each chain), in their order. On as many threads as there are, each with a [`Blender`]
    /// that goes from state to neighbouring state.
    #[must_use]
    pub fn map_trees<T: Send>(&self, states: &[State], make: &(dyn Fn(usize, &Plant, &[KinId]) -> T + Sync)) -> Vec<T> {
        // Some trees in a row, so that a blender's second and later ones are cheap.
        const RUN: usize = 16;
        let runs: Vec<Vec<T>> = states
            .par_chunks(RUN)
            .enumerate()
            .map_init(
                || (Blender::new(self.family), Plant::default()),
                |(blender, plant), (run, states)| {
                    let mut made = Vec::with_capacity(states.len());
                    for (i, state) in states.iter().enumerate() {
                        blender.blend_into(&self.weights(state), plant);
                        made.push(make(run * RUN + i, plant, blender.kins()));
                    }
                    made
                },
            )
            .collect();
        runs.into_iter().flatten().collect()
    }
}

/// The state of the batch whose progress is nearest `progress`; see [`Tasks::sample`].
#[must_use]
pub fn sample(family: &Family, from: usize, to: usize, seed: Seed, progress: f32) -> Weights {
    let tasks = Tasks::new(family, from, to);
    tasks.weights(&tasks.sample(seed, progress, 1.0))
}

impl Batch<'_> {
    /// How far the present state has come.
    #[must_use]
    pub fn progress(&self) -> f32 {
        self.tasks.progress(&self.state)
    }

    /// Moves to the next state that differs from the last; false after the end.
    fn advance(&mut self) -> bool {
        if !self.tasks.in_range() {
            return false;
        }
        let Some(mut step) = self.step else {
            self.step = Some(0);
            return true;
        };
        let finished = self.tasks.tasks.iter().zip(&self.state.degrees).all(|(task, d)| !task.acts() || *d == DONE);
        if finished {
            return false;
        }
        let most = (MOST_STEPS as f32 / self.pace.min(1.0)) as u64;
        loop {
            step += 1;
            self.step = Some(step);
            if step >= most {
                let acting = self.tasks.tasks.iter().zip(&mut self.state.degrees).filter(|(task, _)| task.acts());
                acting.for_each(|(_, degree)| *degree = DONE);
                return true;
            }
            if self.execute(step) {
                return true;
            }
        }
    }

    /// Carries out one pack of tasks; whether anything changed.
    fn execute(&mut self, step: u64) -> bool {
        let Self { tasks, state: State { degrees }, death, pace, .. } = self;
        let (family, tasks) = (tasks.family, &tasks.tasks);
        let seed = self.seed.child("pack").at(step);
        let pack = seed.child("size").range(0.1, 0.7);
        let amount = |k: usize| {
            let draw = seed.at(k as u64);
            let amount = || draw.child("amount").range(0.0, 2.0) / death[k] * *pace;
            (draw.unit() < pack).then(|| (amount() * f32::from(DONE)) as u16)
        };
        let mut changed = false;
        let mut move_on = |degree: &mut u16, amount: u16, most: u16| {
            let next = degree.saturating_add(amount).min(most).max(*degree);
            changed |= next != *degree;
            *degree = next;
        };
        // Growing: parents come before children.
        for k in 0..tasks.len() {
            if !matches!(tasks[k], Task::Grow | Task::Morph) || degrees[k] == DONE {
                continue;
            }
            let Some(amount) = amount(k) else { continue };
            let bearer = family.parent(KinId(k as u32)).map(KinId::index);
            let most = match bearer {
                Some(p) if tasks[k] == Task::Grow && tasks[p] == Task::Grow => degrees[p],
                _ => DONE,
            };
            move_on(&mut degrees[k], amount, most);
        }
        // Wilting: children come before parents.
        for k in (0..tasks.len()).rev() {
            if tasks[k] != Task::Wilt || degrees[k] == DONE {
                continue;
            }
            let Some(amount) = amount(k) else { continue };
            let children = family.children(KinId(k as u32)).map(KinId::index);
            let most = children.filter(|&c| tasks[c] == Task::Wilt).fold(DONE, |d, c| degrees[c].min(d));
            move_on(&mut degrees[k], amount, most);
        }
        changed
    }
}

impl Iterator for Batch<'_> {
    type Item = State;

    fn next(&mut self) -> Option<State> {
        self.advance().then(|| self.state.clone())
    }
}
