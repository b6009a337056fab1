//! What the foliage of a variant keeps out of: the obstacles beside which its sources grew.
//!
//! A variant of several sources keeps out of the obstacles that all of them have, with the least of their clearances: two
//! trees along one house make others along it, and what grew in the open has nothing to keep out of.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Serialize, Serializer};

use super::pipeline::Inputs;
use super::stages::{SourcePlant, obstacle_meshes};
use crate::base::{Diagnostic, Key};
use crate::preset::Plan;
use crate::preset::plan::{GrowSpace, Obstacle, SourceRecipe};
use crate::source::grow::{ObstacleMeshes, Obstacles, obstacle_files};

/// Obstacles, in metres from the foot of the first plant, and the key of what they are made from; told by that alone.
#[derive(Clone, Debug, Default)]
pub(super) struct Around {
    pub(super) obstacles: Arc<Obstacles>,
    key: Option<Key>,
}

impl Around {
    /// Whether there are none.
    pub(super) fn is_nothing(&self) -> bool {
        self.key.is_none()
    }
}

impl Serialize for Around {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.key.map(Key::bytes).serialize(serializer)
    }
}

/// What is around each source of a plan.
#[derive(Clone, Debug, Default)]
pub(super) struct Surroundings {
    /// By source; none beyond the last that has obstacles.
    each: Vec<Around>,
    meshes: Arc<ObstacleMeshes>,
    /// The keys of the meshes' files.
    keys: BTreeMap<String, Key>,
}

impl Surroundings {
    /// Reads the meshes of the obstacles beside sources that were made.
    ///
    /// # Errors
    ///
    /// What is wrong with them.
    pub(super) fn of(plan: &Plan, sources: &[Arc<SourcePlant>], inputs: &Inputs) -> Result<Self, Vec<Diagnostic>> {
        let mut meshes = ObstacleMeshes::new();
        let mut keys = BTreeMap::new();
        let is_made = |i: usize| sources.get(i).is_some_and(|source| !source.plant.chains().is_empty());
        for (_, source) in plan.sources.iter().enumerate().filter(|(i, _)| is_made(*i)) {
            if let SourceRecipe::Grow(params) = &source.recipe {
                let files = obstacle_files(params);
                keys.extend(files.map(|file| (file.clone(), Key::of_bytes(&inputs[file].bytes))));
                meshes.extend(obstacle_meshes(source, params, inputs)?);
            }
        }
        let mut known = Self { each: Vec::new(), meshes: Arc::new(meshes), keys };
        known.each = (0..plan.sources.len())
            .map(|i| match space(plan, i).filter(|_| is_made(i)) {
                Some(space) => known.made(&space.obstacles, space.clearance),
                None => Around::default(),
            })
            .collect();
        Ok(known)
    }

    /// What is around all of some sources.
    pub(super) fn around(&self, plan: &Plan, sources: &[usize]) -> Around {
        let Some((&first, others)) = sources.split_first() else { return Around::default() };
        let Some(whole) = self.each.get(first).filter(|around| !around.is_nothing()) else { return Around::default() };
        let Some(space) = space(plan, first) else { return Around::default() };
        let (mut obstacles, mut clearance) = (space.obstacles.clone(), space.clearance);
        for &other in others {
            let Some(other) = self::space(plan, other) else { return Around::default() };
            obstacles.retain(|obstacle| other.obstacles.contains(obstacle));
            clearance = clearance.min(other.clearance);
        }
        if (obstacles.len(), clearance) == (space.obstacles.len(), space.clearance) {
            return whole.clone();
        }
        self.made(&obstacles, clearance)
    }

    fn made(&self, obstacles: &[Obstacle], clearance: f32) -> Around {
        if obstacles.is_empty() {
            return Around::default();
        }
        let named = |file: &str| {
            obstacles.iter().any(|obstacle| matches!(obstacle, Obstacle::Mesh { file: own, .. } if own == file))
        };
        let key = Key::stage("around", 1).params(&obstacles).params(&clearance);
        let files = self.keys.iter().filter(|(file, _)| named(file.as_str()));
        let key = files.fold(key, |key, (_, file)| key.input(*file)).finish();
        // Growth has read them before.
        let made = Obstacles::of(obstacles, clearance, &self.meshes).unwrap_or_default();
        Around { obstacles: Arc::new(made), key: Some(key) }
    }
}

/// Where a source grows; none for those that do not.
fn space(plan: &Plan, source: usize) -> Option<&GrowSpace> {
    match &plan.sources.get(source)?.recipe {
        SourceRecipe::Grow(params) => Some(&params.space),
        SourceRecipe::Import(_) | SourceRecipe::Like(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::plant::PlantBuilder;

    #[test]
    fn variants_keep_out_of_what_all_of_their_sources_keep_out_of() {
        const OAK: &str = "(height: 12.0, iterations: [(endpoints: Surface(k: 4, count: 300))])";
        let wall = |x: f32| format!("Box(x: {x:?}, z: 0.0, width: 1.0, depth: 9.0, height: 9.0)");
        let grown = |obstacles: &[f32], clearance: f32| {
            let walls: Vec<String> = obstacles.iter().map(|x| wall(*x)).collect();
            format!("Grow(species: \"o.ron\", obstacles: [{}], clearance: {clearance:?})", walls.join(", "))
        };
        let text = format!(
            "(sources: {{\"a\": {}, \"b\": {}, \"c\": Grow(species: \"o.ron\")}}, variants: [Source(\"a\")])",
            grown(&[3.0, 6.0], 0.5),
            grown(&[6.0, 9.0], 0.2)
        );
        let plan = crate::preset::load("set.ron", &text, &mut |_| Ok(OAK.to_owned())).unwrap();
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y], &[0.1, 0.1]);
        let plant = Arc::new(SourcePlant::grown(builder.finish().unwrap(), Vec::new()));
        let known = Surroundings::of(&plan, &vec![plant; 3], &Inputs::new()).unwrap();
        let free = |sources: &[usize]| {
            let around = known.around(&plan, sources);
            assert_eq!(around.is_nothing(), around.obstacles.is_empty());
            // In each wall, and a bit before the middle one.
            [3.0, 5.2, 6.0, 9.0].map(|x| around.obstacles.free(Vec3::new(x, 1.0, 0.0)))
        };
        assert_eq!(free(&[0]), [false, false, false, true]);
        assert_eq!(free(&[1]), [true, true, false, false]);
        assert_eq!(free(&[1, 0]), [true, true, false, true]);
        assert!(known.around(&plan, &[0, 2]).is_nothing() && known.around(&plan, &[2, 1]).is_nothing());
        // Equal keys are of equal obstacles.
        let key = |sources: &[usize]| serde_json::to_string(&known.around(&plan, sources)).unwrap();
        assert!(key(&[0, 1]) == key(&[1, 0]) && key(&[0]) != key(&[1]) && key(&[0]) != key(&[0, 1]));
    }
}
