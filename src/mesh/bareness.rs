//! How much of what is seen of a tree is wood: levels of a leafy crown are settled by its leaves, those of a bare one by
//! its twigs, and those of trees with few leaves by both.

use crate::plant::{Plant, Posed};

/// What is seen of a leaf from all around, of the rectangle that it is drawn in: half of it by its turns, and half of that
/// by its outline.
const LEAF: f32 = 0.25;
/// The same of wood, of its girth's width times its length (Cauchy 1841: a quarter of a convex surface).
const WOOD: f32 = std::f32::consts::FRAC_PI_4;
/// Shares of wood below which leaves are all that counts, and above which wood is.
const LEAFY: f32 = 0.25;
const BARE: f32 = 0.75;

/// 0 where leaves hide the wood, 1 of a bare tree.
pub(crate) fn bareness(plant: &Plant, posed: &Posed) -> f32 {
    let leaves: f64 = plant.leaves().iter().map(|l| f64::from(l.size * l.size * l.form.width() * LEAF)).sum();
    let wood: f64 = plant
        .chain_ids()
        .map(|id| {
            let pieces = posed.chain(plant, id).windows(2).zip(plant.radii(id).windows(2));
            pieces.map(|(p, r)| f64::from(p[0].distance(p[1]) * (r[0] + r[1]) * WOOD)).sum::<f64>()
        })
        .sum();
    let share = (wood / (wood + leaves).max(1e-12)) as f32;
    ((share - LEAFY) / (BARE - LEAFY)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::{Rotation, Seed};
    use crate::plant::{Leaf, PlantBuilder};

    #[test]
    fn leaves_hide_wood_as_there_are_more_of_them() {
        let with = |leaves: u64| {
            let mut builder = PlantBuilder::new();
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.2, 0.1]);
            for i in 0..leaves {
                let turn = Rotation::about(Seed::new(i).direction(), 1.0);
                builder.leaf(Leaf::new(stem, 0.5, turn, 0.5, 0));
            }
            let plant = builder.finish().unwrap();
            bareness(&plant, &plant.pose())
        };
        assert_eq!((with(0), with(400)), (1.0, 0.0));
        let few = [10, 20, 40].map(with);
        assert!(few.is_sorted_by(|a, b| a > b) && few[2] > 0.0 && few[0] < 1.0, "{few:?}");
        assert_eq!(bareness(&Plant::default(), &Plant::default().pose()), 0.0);
    }
}
