//! Sketches that are drawn one over another (2018, 5.1: a designer edits the crown by one stroke after the other, each over the
//! tree that the last one gave).
//!
//! Each sketch is bound to the tree as the one before left it, so that the way goes through all of them in order, each in
//! its share of the time, and stops at every tree between. On the way of a later one what wilted under those before stays
//! as good as without size, on the branches that bore it: an animation has the same branches and leaves from end to end.
//!
//! A later sketch does not see what has wilted, however small: its lobes would take their share of what is drawn.

use super::sketched::Sketched;
use crate::plant::{Leaf, Plant, PlantBuilder};

/// The way of a plant through sketches that are drawn one over another.
#[derive(Clone, Debug)]
pub struct SketchSteps(Vec<Sketched>);

impl SketchSteps {
    /// Of the ways to each, in order; none where there is no way, and where one does not begin at the tree that the one before ends
    /// at ([`Sketched::at`] 1).
    #[must_use]
    pub fn of(steps: Vec<Sketched>) -> Option<Self> {
        let follows = |pair: &[Sketched]| *pair[1].sketcher.plant == pair[0].at(1.0);
        (!steps.is_empty() && steps.windows(2).all(follows)).then_some(Self(steps))
    }

    /// The ways to each sketch.
    #[must_use]
    pub fn each(&self) -> &[Sketched] {
        &self.0
    }

    /// The same with in-betweens that follow interpolated silhouettes ([`Sketched::following`]).
    #[must_use]
    pub fn following(self) -> Self {
        Self(self.0.into_iter().map(Sketched::following).collect())
    }

    /// How like the last sketch the crown is ([`Sketched::likeness`]): those before it are drawn over.
    #[must_use]
    pub fn likeness(&self) -> Option<f32> {
        self.0.last().and_then(Sketched::likeness)
    }

    /// The most that a sketch draws in of what lies outside of it ([`Sketched::spared`]).
    #[must_use]
    pub fn spared(&self) -> f32 {
        self.0.iter().map(Sketched::spared).fold(0.0, f32::max)
    }

    /// The tree at a time 0..=1: at 0 as it was, at 1 as the last sketch has it.
    #[must_use]
    pub fn at(&self, t: f32) -> Plant {
        let (step, t) = self.place(t);
        self.0[step].at(t)
    }

    /// The tree at a time, with all branches and leaves it ever has: those that have wilted are as good as without size.
    #[must_use]
    pub fn key(&self, t: f32) -> Plant {
        let (step, t) = self.place(t);
        let mut whole = self.0[0].key(if step == 0 { t } else { 1.0 });
        // Which of its branches have wilted.
        let mut gone = vec![false; whole.chains().len()];
        for k in 1..=step {
            let mut wilts = self.0[k - 1].wilts.iter();
            gone.iter_mut().filter(|gone| !**gone).zip(&mut wilts).for_each(|(gone, wilts)| *gone = *wilts);
            whole = joined(&whole, &gone, &self.0[k].key(if step == k { t } else { 1.0 }));
        }
        whole
    }

    /// Which sketch is followed at a time, and how far.
    fn place(&self, t: f32) -> (usize, f32) {
        let at = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) } * self.0.len() as f32;
        let step = (at as usize).min(self.0.len() - 1);
        (step, at - step as f32)
    }
}

/// A plant as it is `now`, and on it what is gone of it, as `whole` has it.
fn joined(whole: &Plant, gone: &[bool], now: &Plant) -> Plant {
    let mut builder =
        PlantBuilder::reusing(Plant::default(), whole.chains().len(), whole.all_points().len(), whole.leaves().len());
    let mut stays = now.chain_ids();
    for id in whole.chain_ids() {
        let own = if gone[id.index()] { None } else { stays.next() };
        let (of, own) = own.map_or((whole, id), |own| (now, own));
        let chain = of.chain(own);
        // All of its branches have the places among all that they had.
        let parent = whole.chain(id).parent;
        builder.chain(parent, chain.location, chain.origin, of.points(own), of.radii(own));
    }
    let mut stays = now.leaves().iter();
    for leaf in whole.leaves() {
        let is = if gone[leaf.chain.index()] { None } else { stays.next() };
        builder.leaf(Leaf { chain: leaf.chain, ..*is.unwrap_or(leaf) });
    }
    builder.finish_trusted()
}
