//! What each kin does between two sources, and which kins take part (2017 TVCG, 4.3; partial blending, 5.1).

use crate::relate::{Family, KinId};

/// What a kin does between the two sources.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Task {
    /// It is not there: neither source has it, or another kin stands for it on the way.
    None,
    /// It takes no part and stays as the first source has it.
    Still,
    /// It takes no part, and the first source does not have it.
    Absent,
    Grow,
    Wilt,
    Morph,
}

impl Task {
    /// Whether it has anything to do.
    pub(super) fn acts(self) -> bool {
        matches!(self, Self::Grow | Self::Wilt | Self::Morph)
    }
}

/// The scheduling tree between two sources of a family: a task for each kin, the kins' hierarchy.
#[derive(Clone, Debug)]
pub struct Tasks<'f> {
    pub(super) family: &'f Family,
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) tasks: Vec<Task>,
    /// Whether every kin takes part, so that the end is the target itself.
    pub(super) whole: bool,
}

impl<'f> Tasks<'f> {
    /// All kins take part. Sources are indices; out of range gives a schedule without any state.
    #[must_use]
    pub fn new(family: &'f Family, from: usize, to: usize) -> Self {
        Self::partial(family, from, to, &|_| true)
    }

    /// Only the kins that `takes_part` says; the rest stays as the first source has it. A kin that would grow on one that
    /// stays away does not take part, nor does one that would wilt under one that stays.
    #[must_use]
    pub fn partial(family: &'f Family, from: usize, to: usize, takes_part: &dyn Fn(KinId) -> bool) -> Self {
        let mut whole = true;
        let mut tasks: Vec<Task> = Vec::with_capacity(family.kin_count());
        for kin in family.kin_ids() {
            if family.is_stand_in(kin) {
                tasks.push(Task::None);
                continue;
            }
            let ends = (family.member(kin, from).is_some(), family.member(kin, to).is_some());
            let ground = family.parent(kin).is_none_or(|p| tasks[p.index()] != Task::Absent);
            let part = takes_part(kin) && ground;
            whole &= part || ends == (false, false);
            tasks.push(match (ends, part) {
                ((false, false), _) => Task::None,
                ((true, true), true) => Task::Morph,
                ((true, false), true) => Task::Wilt,
                ((false, true), true) => Task::Grow,
                ((true, _), false) => Task::Still,
                ((false, true), false) => Task::Absent,
            });
        }
        for kin in family.kin_ids().rev() {
            if let Some(parent) = family.parent(kin)
                && tasks[kin.index()] == Task::Still
                && tasks[parent.index()] == Task::Wilt
            {
                tasks[parent.index()] = Task::Still;
            }
        }
        Self { family, from, to, tasks, whole }
    }

    /// How many kins have anything to do.
    #[must_use]
    pub fn count(&self) -> usize {
        self.tasks.iter().filter(|task| task.acts()).count()
    }

    pub(super) fn in_range(&self) -> bool {
        self.from.max(self.to) < self.family.sources().len()
    }
}
