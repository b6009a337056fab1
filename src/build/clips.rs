//! The animated file of each sequence: keys at its frames, wood and leaves of the same vertices in all of them.

use rayon::prelude::*;

use super::morphs::{Made, Morphs, time};
use super::stages::Pictures;
use super::textures::clip_textures;
use crate::bake::{Layout, mean_transmission};
use crate::base::{Diagnostic, Seed};
use crate::export::{self, ClipEntry, ClipIn, ClipLeaves, SetMaterials};
use crate::mesh::{self, Key, KeyPlant};
use crate::plant::{Plant, Posed, trunk_support};
use crate::preset::Plan;
use crate::preset::plan::{Clip as ClipParams, Variant};

/// An animated file.
#[derive(Clone, Debug)]
pub(super) struct Clip {
    /// What the manifest says of it.
    pub(super) entry: ClipEntry,
    /// The GLB.
    pub(super) bytes: Vec<u8>,
}

/// Makes the clips of a plan, in the order of its sequences.
///
/// # Errors
///
/// When one can't be written.
pub(super) fn clips(
    plan: &Plan,
    morphs: &Morphs,
    pictures: &Pictures,
    atlas: &Layout,
) -> Result<Vec<Clip>, Vec<Diagnostic>> {
    let mut clips = Vec::new();
    for (i, (params, made)) in plan.morphs.iter().zip(&morphs.made).enumerate() {
        let ClipParams::Play { seconds, vertices, leaves } = params.clip else { continue };
        let name = format!("{}_clip_{:03}", plan.name, clips.len() + 1);
        let wrong = |error: &dyn std::fmt::Display| {
            let field = format!("variants[{}].animation", params.entry);
            vec![Diagnostic::new("", error.to_string()).with_field(field)]
        };
        let budget = Budget { vertices: vertices as usize, leaves: leaves as usize };
        let parts = Parts::of(plan, made, budget, atlas).map_err(|error| wrong(&error))?;
        let times: Vec<f32> = (0..made.frames()).map(|k| time(k, made.frames()) * seconds).collect();
        let textures = clip_textures(plan);
        let materials = SetMaterials::of(&plan.name, textures)
            .letting_through(mean_transmission(&pictures.leaves))
            .drawn_by(plan.mesh.backs);
        let bytes = export::clip_glb(&ClipIn {
            name: &name,
            seed: plan.seed,
            times: &times,
            wood: &parts.wood,
            keys: &parts.keys,
            leaves: &parts.leaves,
            materials: &materials,
        });
        let frames = plan.variants.iter().enumerate().filter_map(|(v, variant)| match variant {
            Variant::Frame { morph, .. } if *morph == i => Some(format!("{}_{:03}", plan.name, v + 1)),
            _ => None,
        });
        let entry = ClipEntry {
            file: format!("{name}.glb"),
            seconds,
            frames: frames.collect(),
            wood_vertices: parts.wood.positions.len() as u64,
            leaves: parts.cards as u64,
            trunk_support: parts.support,
            name,
        };
        clips.push(Clip { entry, bytes: bytes.map_err(|error| wrong(&error))? });
    }
    Ok(clips)
}

struct Budget {
    vertices: usize,
    leaves: usize,
}

struct Parts {
    wood: mesh::Mesh,
    keys: Vec<Key>,
    leaves: Vec<ClipLeaves>,
    /// How many leaves each of those is of.
    cards: usize,
    support: Vec<f32>,
}

impl Parts {
    fn of(plan: &Plan, made: &Made, budget: Budget, atlas: &Layout) -> Result<Self, String> {
        let last = made.frames() - 1;
        let plants: Vec<(Plant, Posed)> = (0..=last)
            .into_par_iter()
            .map(|frame| {
                let plant = made.key(frame);
                let posed = plant.pose();
                (plant, posed)
            })
            .collect();
        let plants: Vec<KeyPlant<'_>> = plants.iter().map(|(plant, posed)| KeyPlant { plant, posed }).collect();
        let (mut wood, keys) = mesh::keyed_tubes(&plants, budget.vertices, plan.mesh.bark_tile);
        // An error only says that a mesh has no triangles to take tangents from.
        let _ = mesh::add_tangents(&mut wood);
        let count = leaves_of_all(plants.iter().map(|p| p.plant))?;
        let (picked, scale) = mesh::picked_leaves(count, budget.leaves, Seed::new(plan.seed).child("clip"));
        let cards: Vec<Key> = plants.par_iter().map(|plant| mesh::card_key(plant, &picked, scale)).collect();
        let mut leaves = Vec::new();
        if !picked.is_empty() {
            for (k, (plant, card)) in plants.iter().zip(&cards).enumerate() {
                let tile = |&i: &usize| u32::from(made.slot(plant.plant.leaves()[i].slot, k as u32));
                let tiles: Vec<u32> = picked.iter().map(tile).collect();
                let mut mesh = mesh::card_mesh(plant, card, &tiles);
                let _ = mesh::add_tangents(&mut mesh);
                atlas.place(&mut mesh).map_err(|error| error.to_string())?;
                let before = (k > 0).then(|| between(&cards[k - 1], card));
                let after = cards.get(k + 1).map(|next| between(card, next));
                let mut around = [before, after];
                if plan.mesh.backs.sides() > 1 {
                    mesh.double();
                    around.iter_mut().flatten().for_each(Key::double);
                }
                leaves.push(ClipLeaves { mesh, around });
            }
        }
        let support =
            made.support().unwrap_or_else(|| plants.iter().map(|p| trunk_support(p.plant, p.posed)).collect());
        Ok(Self { wood, keys, leaves, cards: picked.len(), support })
    }
}

/// How many leaves each of some keys has: leaf `i` of one is leaf `i` of all.
///
/// # Errors
///
/// When they don't have equally many.
fn leaves_of_all<'p>(mut keys: impl Iterator<Item = &'p Plant>) -> Result<usize, String> {
    let first = keys.next().map_or(0, |plant| plant.leaves().len());
    match keys.map(|plant| plant.leaves().len()).find(|count| *count != first) {
        Some(other) => Err(format!("keys of one clip have {first} and {other} leaves; this is a fault of Treewright")),
        None => Ok(first),
    }
}

/// Half way between two keys.
fn between(a: &Key, b: &Key) -> Key {
    let middle = |x: &[glam::Vec3], y: &[glam::Vec3]| x.iter().zip(y).map(|(x, y)| (*x + *y) * 0.5).collect();
    Key { positions: middle(&a.positions, &b.positions), normals: middle(&a.normals, &b.normals) }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::Rotation;
    use crate::plant::{Leaf, PlantBuilder};

    #[test]
    fn keys_of_unequally_many_leaves_are_an_error_and_no_plants_have_none() {
        let plant = |leaves: usize| {
            let mut builder = PlantBuilder::new();
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y], &[0.1, 0.1]);
            (0..leaves).for_each(|i| builder.leaf(Leaf::new(stem, 0.1 * i as f32, Rotation::IDENTITY, 0.1, 0)));
            builder.finish().unwrap()
        };
        let plants = [2, 2, 3].map(plant);
        assert_eq!(leaves_of_all(plants[..2].iter()), Ok(2));
        assert_eq!(leaves_of_all([].into_iter()), Ok(0));
        let error = leaves_of_all(plants.iter()).unwrap_err();
        assert!(error.contains("2 and 3 leaves"), "{error}");
    }
}
