//! Leaves that a source brought along, as many as the preset says.
//!
//! Such leaves stay where they are: a density of 1 keeps all of them, a lower one that share, and with a higher one others
//! join them (`refit`). Where there would be more than the most, the kept ones are longer for it, at most twice, as dressing
//! makes its own. Each leaf's turn to go is drawn once, so that raising the density only adds.

use super::refit::more;
use crate::base::Seed;
use crate::plant::{Leaf, Plant};
use crate::preset::plan::DressParams;

/// Most that kept leaves are lengthened.
const LONGEST: f32 = 2.0;

/// The plant with as many of its leaves, or more; it itself where all stay. n log n in leaves.
#[must_use]
pub fn thin(plant: Plant, params: &DressParams, seed: Seed) -> Plant {
    let plant = if params.density > 1.0 { more(plant, params.density, seed.child("more")) } else { plant };
    let all = plant.leaves().len();
    let wanted = (all as f32 * params.density.clamp(0.0, 1.0)).ceil() as usize;
    let kept = wanted.min(params.most_leaves as usize);
    if kept >= all {
        return plant;
    }
    let mut order: Vec<(u64, u32)> = (0..all as u32).map(|i| (seed.at(i.into()).bits(), i)).collect();
    order.sort_unstable();
    let mut keep = vec![false; all];
    order.iter().take(kept).for_each(|&(_, i)| keep[i as usize] = true);
    let longer = (wanted as f32 / kept.max(1) as f32).sqrt().min(LONGEST);
    plant.keep_leaves(|i, leaf| keep[i].then_some(Leaf { size: leaf.size * longer, ..*leaf }))
}

#[cfg(test)]
pub(super) mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::Rotation;
    use crate::plant::PlantBuilder;
    use crate::preset::plan::Phyllotaxis;

    /// A pole with so many leaves of a decimetre, which wear as many pictures.
    pub(in crate::dress) fn leafy(count: u16) -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.1, 0.1]);
        for k in 0..count {
            let at = f32::from(k) / f32::from(count);
            builder.leaf(Leaf::new(stem, at, Rotation::IDENTITY, 0.1, k));
        }
        builder.finish().unwrap()
    }

    fn params(density: f32, most_leaves: u32) -> DressParams {
        DressParams {
            density,
            most_leaves,
            leaf_size: 0.1,
            leaf_share: 1.0,
            leaf_spread: 0.2,
            leaf_angle: 0.9,
            twig_length: 0.5,
            phyllotaxis: Phyllotaxis::Spiral,
            droop: 0.2,
            pictures: 1,
        }
    }

    #[test]
    fn raising_the_density_only_adds_and_one_keeps_all() {
        let plant = leafy(200);
        let at = |density| thin(plant.clone(), &params(density, 1000), Seed::new(3));
        assert_eq!(at(1.0), plant);
        assert_eq!(at(2.0).leaves().len(), 400);
        assert!(plant.leaves().iter().all(|leaf| at(1.3).leaves().contains(leaf)));
        let (few, more) = (at(0.25), at(0.5));
        assert_eq!((few.leaves().len(), more.leaves().len()), (50, 100));
        assert!(few.leaves().iter().all(|leaf| more.leaves().contains(leaf)));
        assert!(at(0.0).leaves().is_empty());
    }

    #[test]
    fn more_than_the_most_become_longer_instead() {
        let plant = leafy(400);
        let thinned = thin(plant.clone(), &params(1.0, 100), Seed::new(3));
        assert_eq!(thinned.leaves().len(), 100);
        assert!(thinned.leaves().iter().all(|leaf| (leaf.size - 0.2).abs() < 1e-6));
        let area = |plant: &Plant| plant.leaves().iter().map(|leaf| leaf.size * leaf.size).sum::<f32>();
        assert!((area(&thinned) / area(&plant) - 1.0).abs() < 1e-4);
    }
}
