//! Sequences: sources dressed and in correspondence, leaves and all, and the tree of each frame.
//!
//! A blend is dressed when it is made, so that its twigs suit its crown; frames of a sequence must not get other twigs from
//! frame to frame. So sources are dressed first, exactly as the variants `Source` of them are, and twigs and leaves are
//! matched with the rest. Pictures between two leaves are made for each frame and join the set's.

use rayon::prelude::*;

use super::blends;
use super::pipeline::Inputs;
use super::selections::Selected;
use super::sketches::Drawn;
use super::stages::Wardrobe;
use crate::bake::{LeafMorph, Maps};
use crate::base::Diagnostic;
use crate::blend::{self, Pace};
use crate::plant::{Leaf, Plant};
use crate::preset::Plan;
use crate::preset::plan::{MorphKind, MorphParams, TargetLeaf, Variant};
use crate::relate::{self, Family, Kin, KinId, PairedSlots, PatternParams, PatternTree};
use crate::sketch::Sketched;

/// How far from a sequence's ends an animation's first and last key are taken: there every chain is still there.
const INSIDE: f32 = 1e-4;

/// The sequences of a plan, in its order.
#[derive(Debug)]
pub(super) struct Morphs {
    /// One each.
    pub(super) made: Vec<Made>,
}

/// What a sequence's frames are taken from.
#[derive(Debug)]
enum Way {
    /// Sources in correspondence.
    Blended { family: Box<Family>, pace: Pace },
    /// A source on its way to a sketch.
    Sketched(Box<Sketched>),
    /// A source that can't be sketched.
    Still(Plant),
}

/// One sequence.
#[derive(Debug)]
pub(super) struct Made {
    way: Way,
    kind: MorphKind,
    frames: u32,
    slots: PairedSlots,
    /// Slot of the first picture between: of the first pair all frames but the ends, then of the second.
    first_picture: u16,
}

/// Matches the sources of every sequence, and adds the pictures between their leaves to the wardrobe.
///
/// # Errors
///
/// When sources can't be matched, at their fields.
pub(super) fn morphs(plan: &Plan, inputs: &Inputs, wardrobe: &mut Wardrobe) -> Result<Morphs, Vec<Diagnostic>> {
    let (mut made, mut errors) = (Vec::new(), Vec::new());
    for params in &plan.morphs {
        match one(plan, params, inputs, wardrobe) {
            Ok(morph) => made.push(morph),
            Err(found) => errors.extend(found),
        }
    }
    if errors.is_empty() { Ok(Morphs { made }) } else { Err(errors) }
}

fn one(plan: &Plan, params: &MorphParams, inputs: &Inputs, wardrobe: &mut Wardrobe) -> Result<Made, Vec<Diagnostic>> {
    let mut source = |index: usize, leaf: &TargetLeaf| {
        let none = Selected::default();
        let seed = blends::identity(plan, &Variant::Source(index), &none).1;
        wardrobe.source(plan, index, leaf, seed.child("dress"))
    };
    let wrong = |field: &str, error: relate::FamilyError| {
        let message = format!("can't make a sequence: {error}");
        vec![Diagnostic::new("", message).with_field(format!("variants[{}].{field}", params.entry))]
    };
    let blended = |family: Family| {
        let pace = Pace::of(&family);
        Way::Blended { family: Box::new(family), pace }
    };
    let (way, slots) = match params.kind.clone() {
        MorphKind::Between(from, to) => {
            let plants = [source(from, &TargetLeaf::AsSet), source(to, &params.leaf)].map(gathered);
            let [a, b] = plants;
            let family = relate::pattern_family(a, b, &params.matching).map_err(|error| wrong("from", error))?;
            let (family, slots) = family.pair_leaves(wardrobe.pictures.leaves.len() as u16);
            (blended(family), slots)
        }
        MorphKind::Growth { of, .. } => {
            let plant = source(of, &TargetLeaf::AsSet);
            let kin = |c| Kin { parent: plant.chain(c).parent.map(|p| KinId(p.0)), members: vec![Some(c)] };
            let kins: Vec<Kin> = plant.chain_ids().map(kin).collect();
            (blended(Family::new(vec![plant], &kins).map_err(|error| wrong("of", error))?), PairedSlots::default())
        }
        MorphKind::Sketch { of, sketch } => {
            let plant = source(of, &TargetLeaf::AsSet);
            let drawn = Drawn::read(&sketch, inputs)?;
            (
                drawn
                    .sketched(&plant)
                    .map_or(Way::Still(plant), |sketched| Way::Sketched(Box::new(sketched.following()))),
                PairedSlots::default(),
            )
        }
    };
    let first_picture = wardrobe.pictures.leaves.len() as u16;
    let between = params.frames.saturating_sub(2);
    let pictures = &wardrobe.pictures.leaves;
    let picture = |slot: u16| pictures.get(usize::from(slot));
    let made: Vec<Maps> = slots
        .pairs
        .par_iter()
        .flat_map_iter(|&(a, b)| {
            let morph = picture(a).zip(picture(b)).map(|(a, b)| LeafMorph::new(a, b));
            (1..=between).filter_map(move |frame| Some(morph.as_ref()?.at(time(frame, params.frames))))
        })
        .collect();
    wardrobe.pictures.leaves.extend(made);
    Ok(Made { way, kind: params.kind.clone(), frames: params.frames, slots, first_picture })
}

/// A plant whose leaves are all on chains near them.
fn gathered(plant: Plant) -> Plant {
    if plant.leaves().iter().all(|leaf| leaf.offset == glam::Vec3::ZERO) {
        return plant;
    }
    let tree = PatternTree::of(&plant, &PatternParams::default());
    relate::gather_loose(&plant, &tree)
}

/// Where a frame is, 0..=1.
pub(super) fn time(frame: u32, frames: u32) -> f32 {
    frame as f32 / frames.max(2).saturating_sub(1) as f32
}

impl Made {
    /// The tree of a frame.
    pub(super) fn frame(&self, frame: u32) -> Plant {
        let t = time(frame, self.frames);
        self.at(t, 0.0).rewear(|_, leaf| (self.slot(leaf.slot, frame), leaf.form))
    }

    /// The tree of a frame for an animation: all frames have the same chains and leaves in the same order, those that are
    /// not there as good as without size. Its leaves between two wear slots that [`slot`](Self::slot) knows.
    pub(super) fn key(&self, frame: u32) -> Plant {
        self.at(time(frame, self.frames).clamp(INSIDE, 1.0 - INSIDE), INSIDE)
    }

    fn at(&self, t: f32, unborn: f32) -> Plant {
        let (family, pace) = match &self.way {
            Way::Blended { family, pace } => (family, pace),
            Way::Sketched(sketched) if unborn > 0.0 => return sketched.key(t),
            Way::Sketched(sketched) => return sketched.at(t),
            Way::Still(plant) => return plant.clone(),
        };
        match self.kind {
            MorphKind::Between(..) | MorphKind::Sketch { .. } => {
                family.blend(&blend::morph(family, 0, 1, pace.share(t)))
            }
            MorphKind::Growth { age, .. } => {
                let weights = blend::growth(family, age + (1.0 - age) * t, unborn);
                let (plant, kins) = family.blend_with_kins(&weights);
                let larger = |leaf: &Leaf| {
                    let scale = blend::leaf_scale(weights.degree(kins[leaf.chain.index()]));
                    Leaf { size: leaf.size * scale, ..*leaf }
                };
                let leaves = plant.leaves().iter().map(larger).collect();
                plant.with_leaves(leaves)
            }
        }
    }

    /// The picture of a slot in a frame.
    pub(super) fn slot(&self, slot: u16, frame: u32) -> u16 {
        let Some(pair) = slot.checked_sub(self.slots.first).filter(|p| usize::from(*p) < self.slots.pairs.len()) else {
            return slot;
        };
        let ends = self.slots.pairs[usize::from(pair)];
        let last = self.frames - 1;
        match frame {
            0 => ends.0,
            frame if frame >= last => ends.1,
            frame => self.first_picture + pair * (last - 1) as u16 + (frame - 1) as u16,
        }
    }

    /// How many frames.
    pub(super) const fn frames(&self) -> u32 {
        self.frames
    }
}

/// What a frame is, for the manifest.
pub(super) fn identity(plan: &Plan, morph: usize, frame: u32) -> serde_json::Value {
    let params = &plan.morphs[morph];
    let name = |s: usize| plan.sources[s].name.as_str();
    match &params.kind {
        &MorphKind::Between(from, to) => serde_json::json!({
            "morph": [name(from), name(to)], "frame": frame, "frames": params.frames, "matching": params.matching,
            "leaf": params.leaf,
        }),
        &MorphKind::Growth { of, age } => serde_json::json!({
            "growth": name(of), "frame": frame, "frames": params.frames, "age": age,
        }),
        MorphKind::Sketch { of, sketch } => serde_json::json!({
            "sketch": sketch.told(), "of": name(*of), "frame": frame, "frames": params.frames,
        }),
    }
}
