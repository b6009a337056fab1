//! Sequences: sources dressed and in correspondence, leaves and all, and the tree of each frame.
//!
//! A blend is dressed when it is made, so that its twigs suit its crown; frames of a sequence must not get other twigs from
//! frame to frame. So sources are dressed first, exactly as the variants `Source` of them are, and twigs and leaves are
//! matched with the rest. Pictures between two leaves are made for each frame and join the set's. All of them together take a
//! quarter of its atlas at most, where they can, so that there is room for cards and impostors: many are drawn smaller.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::blends;
use super::selections::Selected;
use super::sketches::Drawn;
use super::trees::cell;
use super::unlike;
use super::wardrobe::Wardrobe;
use crate::bake::{LeafMorph, Maps};
use crate::base::{Diagnostic, Note, counted};
use crate::blend::{self, Pace};
use crate::plant::Plant;
use crate::preset::Plan;
use crate::preset::plan::{AtlasParams, MorphKind, MorphParams, PatternParams, TargetLeaf, Variant};
use crate::relate::{self, Family, Kin, KinId, PairedSlots, PatternTree};
use crate::sketch::SketchSteps;

/// How far from a sequence's ends an animation's first and last key are taken: there every chain is still there.
const INSIDE: f32 = 1e-4;

/// Edges that pictures between two leaves are drawn at, at most, pixels.
const EDGES: [u32; 7] = [512, 384, 256, 192, 128, 96, 64];
/// Share of the atlas that they take at most, unless they are as small as can be.
const SHARE: f64 = 0.25;

/// The sequences of a plan, in its order.
#[derive(Debug, Default)]
pub(super) struct Morphs {
    /// One each.
    pub(super) made: Vec<Made>,
    /// That pictures between are drawn smaller than the leaves that they lie between.
    pub(super) note: Option<Note>,
}

/// What a sequence's frames are taken from.
#[derive(Debug)]
enum Way {
    /// Sources in correspondence.
    Blended { family: Box<Family>, pace: Pace },
    /// A source on its way through sketches.
    Sketched(Box<SketchSteps>),
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
    /// Slot of the first picture between: of the first pair all frames but the ends, then of the second. Known when the
    /// pictures of all sequences are drawn.
    first_picture: u16,
}

impl Morphs {
    /// Sketched sequences of whose foliage more would have wilted than may.
    pub(super) fn spared(&self) -> impl Iterator<Item = Note> {
        self.made.iter().filter_map(|made| match (&made.kind, &made.way) {
            (MorphKind::Sketch { sketch, .. }, Way::Sketched(sketched)) => {
                unlike::spared_note(&sketch.field, "its source", sketched.spared())
            }
            _ => None,
        })
    }
}

/// Matches the sources of every sequence, those that follow a sketch by `drawn` in their order, and then adds the pictures between their leaves to the wardrobe.
///
/// # Errors
///
/// When sources can't be matched, at their fields.
pub(super) fn morphs(plan: &Plan, drawn: &[Drawn], wardrobe: &mut Wardrobe) -> Result<Morphs, Vec<Diagnostic>> {
    let mut drawn = drawn.iter();
    let (mut made, mut errors) = (Vec::new(), Vec::new());
    for params in &plan.morphs {
        match one(plan, params, &mut drawn, wardrobe) {
            Ok(morph) => made.push(morph),
            Err(found) => errors.extend(found),
        }
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    let count = |made: &Made| made.slots.pairs.len() * between(made.frames) as usize;
    let all = wardrobe.pictures.leaves.len() + made.iter().map(count).sum::<usize>();
    if let (true, Some(most)) = (all > usize::from(u16::MAX), made.iter().zip(&plan.morphs).max_by_key(|m| count(m.0)))
    {
        let message = format!("all sequences together have {all} pictures of leaves, more than {}", u16::MAX);
        let hint = "ask for fewer frames, fewer sequences or fewer `pictures` of leaves";
        let field = format!("variants[{}].frames", most.1.entry);
        return Err(vec![Diagnostic::new("", message).with_field(field).with_hint(hint)]);
    }
    let drawn = pictures_between(&mut made, &wardrobe.pictures.leaves, &plan.atlas);
    wardrobe.pictures.leaves.extend(drawn.0);
    Ok(Morphs { made, note: drawn.1 })
}

/// Draws the pictures between the leaves of all sequences, which follow the set's `leaves`. Where they are to be smaller,
/// leaves are shrunk before: that costs less than to shrink what is drawn, and what is drawn is as smooth.
fn pictures_between(made: &mut [Made], leaves: &[Maps], atlas: &AtlasParams) -> (Vec<Maps>, Option<Note>) {
    let known = |slot: u16| usize::from(slot) < leaves.len();
    // Each with how far it has changed in each frame: as far as the leaves that wear it have moved.
    let pairs: Vec<(u16, u16, Vec<f32>)> = made
        .iter()
        .flat_map(|made| {
            let shares: Vec<f32> =
                (1..=between(made.frames)).map(|frame| made.share(time(frame, made.frames))).collect();
            made.slots.pairs.iter().map(move |&(a, b)| (a, b, shares.clone()))
        })
        .filter(|&(a, b, _)| known(a) && known(b))
        .collect();
    let leaf = |slot: u16| &leaves[usize::from(slot)];
    let worn: BTreeSet<u16> = pairs.iter().flat_map(|&(a, b, _)| [a, b]).collect();
    let full = worn.iter().map(|&slot| leaf(slot).width.max(leaf(slot).height)).max().unwrap_or(0);
    let area = |edge: u32| -> f64 {
        let size = |(a, b): (u16, u16)| {
            let [a, b] = [a, b].map(|slot| leaf(slot).size_within(atlas.inside(edge)));
            (a.0.max(b.0), a.1.max(b.1))
        };
        pairs.iter().map(|(a, b, shares)| shares.len() as f64 * cell(size((*a, *b)), atlas.gutter)).sum()
    };
    let room = f64::from(atlas.size) * f64::from(atlas.size) * SHARE;
    let edge = EDGES.into_iter().find(|&edge| area(edge) <= room).unwrap_or(EDGES[EDGES.len() - 1]);
    let shrunk: BTreeMap<u16, Cow<'_, Maps>> =
        worn.into_iter().map(|slot| (slot, leaf(slot).within(atlas.inside(edge)))).collect();
    let of = |(a, b, shares): &(u16, u16, Vec<f32>)| -> Vec<Maps> {
        let morph = LeafMorph::new(&shrunk[a], &shrunk[b]);
        shares.iter().map(|share| morph.at(*share)).collect()
    };
    let drawn: Vec<Maps> = pairs.par_iter().flat_map_iter(of).collect();
    let mut next = leaves.len();
    for made in made {
        // There are no more; see above.
        made.first_picture = next as u16;
        next += made.slots.pairs.len() * between(made.frames) as usize;
    }
    let note = (full > edge && !drawn.is_empty()).then(|| {
        let message = format!(
            "{} drawn at {edge} of {full} texels along an edge; fewer frames, fewer \
             `pictures` of leaves or a larger atlas leave them more",
            counted(drawn.len(), "picture between two leaves is", "pictures between two leaves are")
        );
        Note::new("atlas", message)
    });
    (drawn, note)
}

/// Frames between the first and the last.
fn between(frames: u32) -> u32 {
    frames.saturating_sub(2)
}

fn one<'d>(
    plan: &Plan,
    params: &MorphParams,
    drawn: &mut impl Iterator<Item = &'d Drawn>,
    wardrobe: &mut Wardrobe,
) -> Result<Made, Vec<Diagnostic>> {
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
            let patterns = &params.patterns;
            let plants = [source(from, &TargetLeaf::AsSet), source(to, &params.leaf)];
            let [a, b] = plants.map(|plant| gathered(plant, patterns));
            let family =
                relate::pattern_family(a, b, &params.matching, patterns).map_err(|error| wrong("from", error))?;
            let (family, slots) = family.pair_leaves(wardrobe.pictures.leaves.len() as u16);
            (blended(family), slots)
        }
        MorphKind::Growth { of, .. } => {
            let plant = source(of, &TargetLeaf::AsSet);
            let kin = |c| Kin { parent: plant.chain(c).parent.map(|p| KinId(p.0)), members: vec![Some(c)] };
            let kins: Vec<Kin> = plant.chain_ids().map(kin).collect();
            (blended(Family::new(vec![plant], &kins).map_err(|error| wrong("of", error))?), PairedSlots::default())
        }
        MorphKind::Sketch { of, .. } => {
            let plant = source(of, &TargetLeaf::AsSet);
            let sketched = drawn.next().and_then(|drawn| drawn.sketched(&plant));
            (
                sketched.map_or(Way::Still(plant), |sketched| Way::Sketched(Box::new(sketched.following()))),
                PairedSlots::default(),
            )
        }
    };
    Ok(Made { way, kind: params.kind.clone(), frames: params.frames, slots, first_picture: 0 })
}

/// A plant whose leaves are all on chains near them.
fn gathered(plant: Plant, patterns: &PatternParams) -> Plant {
    if plant.leaves().iter().all(|leaf| leaf.offset == glam::Vec3::ZERO) {
        return plant;
    }
    let tree = PatternTree::of(&plant, patterns);
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

    /// How far a sequence has come at a time, both 0..=1.
    fn share(&self, t: f32) -> f32 {
        match &self.way {
            Way::Blended { pace, .. } => pace.share(t),
            Way::Sketched(_) | Way::Still(_) => t,
        }
    }

    fn at(&self, t: f32, unborn: f32) -> Plant {
        let family = match &self.way {
            Way::Blended { family, .. } => family,
            Way::Sketched(sketched) if unborn > 0.0 => return sketched.key(t),
            Way::Sketched(sketched) => return sketched.at(t),
            Way::Still(plant) => return plant.clone(),
        };
        match self.kind {
            MorphKind::Between(..) | MorphKind::Sketch { .. } => {
                // The way too: where a pace nearly stands still at its end, a time inside of it is as good as the end, and the
                // tree there has the chains of a source alone.
                let share = self.share(t);
                let share = if unborn > 0.0 { share.clamp(INSIDE, 1.0 - INSIDE) } else { share };
                family.blend(&blend::morph(family, 0, 1, share))
            }
            MorphKind::Growth { age, .. } => blend::grown(family, age + (1.0 - age) * t, unborn),
        }
    }

    /// The trunk support in each frame, of a way between sources whose stems split and merge.
    pub(super) fn support(&self) -> Option<Vec<f32>> {
        match (&self.way, &self.kind) {
            (Way::Blended { family, .. }, MorphKind::Between(..)) => {
                let shares: Vec<f32> = (0..self.frames).map(|frame| self.share(time(frame, self.frames))).collect();
                Some(blend::support_at(family, &shares))
            }
            _ => None,
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
        &MorphKind::Between(from, to) => {
            let mut recipe = serde_json::json!({
                "morph": [name(from), name(to)], "frame": frame, "frames": params.frames, "matching": params.matching,
                "leaf": params.leaf,
            });
            // What is as usual is not told, as of blends.
            if params.patterns != PatternParams::default() {
                recipe["patterns"] = serde_json::json!(params.patterns);
            }
            recipe
        }
        &MorphKind::Growth { of, age } => serde_json::json!({
            "growth": name(of), "frame": frame, "frames": params.frames, "age": age,
        }),
        MorphKind::Sketch { of, sketch } => serde_json::json!({
            "sketch": sketch.told(), "of": name(*of), "frame": frame, "frames": params.frames,
        }),
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bake::leaf_maps;
    use crate::base::Seed;
    use crate::plant::PlantBuilder;
    use crate::preset::plan::{LeafShape, MatchParams, PatternParams};
    use crate::relate::random_plant::{Oddity, random_plant};

    fn sequence(frames: u32, pairs: Vec<(u16, u16)>) -> Made {
        Made {
            way: Way::Still(random_plant(Seed::new(1), 4, Oddity::Tame)),
            kind: MorphKind::Between(0, 1),
            frames,
            slots: PairedSlots { pairs, first: 3 },
            first_picture: 0,
        }
    }

    #[test]
    fn every_key_has_the_same_chains_also_where_the_way_is_as_good_as_at_its_end() {
        let plant = |limbs: u32| {
            let mut builder = PlantBuilder::new();
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.2, 0.1]);
            for i in 0..limbs {
                let out = Seed::new(u64::from(i)).direction() * Vec3::new(1.0, 0.2, 1.0);
                builder.branch(stem, 0.4 + 0.1 * i as f32, &[Vec3::ZERO, out], &[0.05, 0.02]);
            }
            builder.finish().unwrap()
        };
        let (matching, patterns) = (MatchParams::default(), PatternParams::default());
        let family = Box::new(relate::pattern_family(plant(5), plant(2), &matching, &patterns).unwrap());
        let pace = Pace::through(&[(0.0, 0.0), (1e-8, 0.5), (1.0 - 1e-7, 0.999), (1.0, 1.0)]);
        let made = Made { way: Way::Blended { family, pace }, ..sequence(5, Vec::new()) };
        let chains = |frame| made.key(frame).chains().iter().map(|chain| chain.parent).collect::<Vec<_>>();
        let (middle, end) = (chains(2), made.frame(4).chains().len());
        let counts: Vec<usize> = (0..5).map(|frame| chains(frame).len()).collect();
        assert!((0..5).all(|frame| chains(frame) == middle) && end != middle.len(), "{counts:?} {end}");
    }

    #[test]
    fn pictures_between_two_leaves_change_as_far_as_what_wears_them() {
        let leaf = |picture| leaf_maps(LeafShape::Oak, [0.1, 0.2, 0.05], 0.3, 64, picture, Seed::new(4));
        let (leaves, atlas) = ([leaf(0), leaf(1)], AtlasParams { size: 1024, gutter: 8 });
        let plant = || random_plant(Seed::new(1), 4, Oddity::Tame);
        let (matching, patterns) = (MatchParams::default(), PatternParams::default());
        let family = Box::new(relate::pattern_family(plant(), plant(), &matching, &patterns).unwrap());
        let way = Way::Blended { family, pace: Pace::through(&[(0.0, 0.0), (0.75, 0.5), (1.0, 1.0)]) };
        let mut made = [Made { way, ..sequence(3, vec![(0, 1)]) }];
        let (drawn, _) = pictures_between(&mut made, &leaves, &atlas);
        let ends = leaves.each_ref().map(|leaf| leaf.within(atlas.inside(EDGES[0])));
        let morph = LeafMorph::new(&ends[0], &ends[1]);
        assert!(drawn.len() == 1 && drawn[0].color == morph.at(0.75).color && drawn[0].color != morph.at(0.5).color);
    }

    #[test]
    fn pictures_between_take_a_quarter_of_the_atlas_at_most() {
        let leaf = |size, picture| leaf_maps(LeafShape::Oak, [0.1, 0.2, 0.05], 0.3, size, picture, Seed::new(4));
        let leaves = [leaf(128, 0), leaf(128, 1), leaf(64, 2)];
        let drawn = |size: u32, sequences: &[(u32, Vec<(u16, u16)>)]| {
            let mut made: Vec<Made> =
                sequences.iter().map(|(frames, pairs)| sequence(*frames, pairs.clone())).collect();
            let (drawn, note) = pictures_between(&mut made, &leaves, &AtlasParams { size, gutter: 8 });
            let slots: Vec<u16> = made.iter().map(|made| made.first_picture).collect();
            (drawn, slots, note.map(|note| note.message))
        };
        let edges = |drawn: &[Maps]| drawn.iter().map(|maps| (maps.width, maps.height)).collect::<BTreeSet<_>>();
        // Three of 128 texels fit a quarter of 512 x 512, seven don't: theirs have 64 with their gutters.
        let one = [(5, vec![(0, 1)])];
        let (few, slots, note) = drawn(512, &one);
        assert_eq!((few.len(), edges(&few), slots, note), (3, [(128, 128)].into(), vec![3], None));
        let (many, slots, note) = drawn(512, &[(5, vec![(0, 1)]), (2, vec![(0, 2)]), (4, vec![(0, 2), (1, 2)])]);
        assert_eq!((many.len(), slots), (3 + 4, vec![3, 6, 6]));
        let area: f64 = many.iter().map(|maps| cell((maps.width, maps.height), 8)).sum();
        assert!(edges(&many) == [(56, 56)].into() && area <= 65536.0, "{area}: {:?}", edges(&many));
        assert!(
            note.is_some_and(|note| note.starts_with("7 pictures between two leaves are drawn at 64 of 128 texels"))
        );
        // Never smaller than can be told; and as much of the picture is leaf as when it is drawn large.
        let (least, ..) = drawn(256, &one);
        assert_eq!(edges(&least), [(56, 56)].into());
        let covered = |maps: &Maps| maps.color.iter().filter(|c| c[3] >= 128).count() as f64 / maps.color.len() as f64;
        for (small, large) in least.iter().zip(&few) {
            assert!((covered(small) / covered(large) - 1.0).abs() < 0.13, "{} {}", covered(small), covered(large));
        }
    }
}
