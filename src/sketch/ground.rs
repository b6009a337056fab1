//! Leaves under a sketch stay above the ground.
//!
//! Lobes that are drawn down to the ground are brought there by their twigs, and leaves hang below those: under flat sketches, and in
//! raised views, by a tenth of a metre to half a metre. So the tree is looked at as it is made, and branches of leaves that
//! have sunk are told to rise by as much, with the limbs that bear them by half, until none has or [`ROUNDS`] are done. A leaf that hung
//! lower before may do so again, and so may all where the sketch itself goes on below the ground, in a level view.

use glam::Vec3;

use super::sketched::Sketched;
use super::trim::between;
use crate::plant::{Plant, Posed};

/// Rounds at most.
const ROUNDS: usize = 4;
/// How near to the ground a leaf is looked at, over how far it covers.
const NEAR: f32 = 4.0;
/// What is left below, over the crown's size: less than anybody sees.
const LEAST: f32 = 0.002;

impl Sketched {
    /// Has leaves rise out of the ground; `low` is the lowest that is drawn, where that is a height.
    pub(super) fn risen(mut self, low: Option<f32>) -> Self {
        let sketcher = self.sketcher.clone();
        let ground = sketcher.foot.y;
        let least = LEAST * sketcher.size;
        let is_below = low.is_some_and(|low| low < ground - least);
        // Of most crowns no leaf is anywhere near, however it has turned.
        let is_near = |((place, radius), (point, f)): (&(Vec3, f32), &(u32, f32))| {
            place.y + between(&self.shift, *point, *f).y - NEAR * radius < ground
        };
        if is_below || !self.guided.bounded || !sketcher.discs.iter().zip(&sketcher.leaves).any(is_near) {
            return self;
        }
        let plant = &*sketcher.plant;
        let before = lows(plant, &plant.pose());
        for _ in 0..ROUNDS {
            let made = self.made(&|i| self.shift[i], 1.0, false);
            let mut sunk = vec![0.0_f32; plant.chains().len()];
            for ((leaf, low), was) in plant.leaves().iter().zip(lows(&made, &made.pose())).zip(&before) {
                let sunk = &mut sunk[leaf.chain.index()];
                *sunk = sunk.max((ground.min(*was) - low) / self.scale);
            }
            for id in plant.chain_ids() {
                if self.wilts[id.index()] || sunk[id.index()] < least {
                    sunk[id.index()] = 0.0;
                }
            }
            if sunk.iter().all(|sunk| *sunk == 0.0) {
                break;
            }
            for id in plant.chain_ids().rev() {
                let bearer = plant.chain(id).parent.filter(|bearer| plant.chain(*bearer).parent.is_some());
                if let Some(bearer) = bearer {
                    sunk[bearer.index()] = sunk[bearer.index()].max(sunk[id.index()] * 0.5);
                }
            }
            for (told, handle) in self.told.iter_mut().zip(&sketcher.handles) {
                *told += Vec3::Y * sunk[handle.chain.index()];
            }
            self.shift = sketcher.spines.moved(&sketcher.positions, &self.told, &self.guided);
        }
        self
    }
}

/// The lowest of each leaf's card, metres.
fn lows(plant: &Plant, posed: &Posed) -> Vec<f32> {
    let low = |leaf: &crate::plant::Leaf| {
        let pose = posed.leaf(plant, leaf);
        let tip = pose.position.y + pose.frame.y.y * leaf.size;
        pose.position.y.min(tip) - 0.5 * leaf.size * leaf.form.width() * pose.frame.x.y.abs()
    };
    plant.leaves().iter().map(low).collect()
}
