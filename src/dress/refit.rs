//! Leaves that a source brought along, in another length: as many more or fewer as show the same area.
//!
//! Which leaves go is drawn once for each, so that a longer leaf takes away and moves none. Where more are wanted, those of
//! one leaf follow each other along its middle and point to both sides of it, as a twig's do: what an import calls a leaf
//! often is the card of a whole branch.

use glam::Vec3;

use crate::base::{Rotation, Seed};
use crate::plant::{Leaf, Plant};

/// Most leaves that one becomes.
const MOST: f32 = 12.0;
/// How far those that follow the first point aside, radians.
const ASIDE: f32 = 0.7;
/// How far they are rolled about themselves, radians, to both sides.
const ROLL: f32 = 0.8;

/// Area that leaves show, square metres, where `share` is what one shows of the square of its length.
#[must_use]
pub(crate) fn shown(plant: &Plant, share: impl Fn(&Leaf) -> f32) -> f32 {
    plant.leaves().iter().map(|leaf| leaf.size * leaf.size * share(leaf)).sum()
}

/// Length of a plant's leaves, metres: of those that have the mean area. 0 where there are none.
#[must_use]
pub(crate) fn length(plant: &Plant) -> f32 {
    let leaves = plant.leaves();
    if leaves.is_empty() { 0.0 } else { (shown(plant, |_| 1.0) / leaves.len() as f32).sqrt() }
}

/// The plant with its leaves scaled by `scale`, so many that they show `area`, square metres, where `share` is what one
/// shows of the square of its length. At most twelve for each. Linear in leaves.
#[must_use]
pub(crate) fn refit(plant: Plant, scale: f32, area: f32, share: impl Fn(&Leaf) -> f32, seed: Seed) -> Plant {
    let alike = shown(&plant, share) * scale * scale;
    if plant.leaves().is_empty() || alike <= 0.0 {
        return plant;
    }
    repeated(plant, (area / alike).min(MOST), scale, seed)
}

/// The plant with `times` as many leaves, at most twelve for each of its own, which stay; raising it only adds. Linear in
/// leaves.
#[must_use]
pub(super) fn more(plant: Plant, times: f32, seed: Seed) -> Plant {
    repeated(plant, times.clamp(1.0, MOST), 1.0, seed)
}

/// The plant with `each` leaves in the mean for each of its own, scaled by `scale`.
fn repeated(plant: Plant, each: f32, scale: f32, seed: Seed) -> Plant {
    let mut leaves = Vec::with_capacity((plant.leaves().len() as f32 * each) as usize + 1);
    for (i, leaf) in plant.leaves().iter().enumerate() {
        let seed = seed.at(i as u64);
        let count = (each + seed.unit()) as u32;
        let size = leaf.size * scale;
        // Where the tips of both would lie at the same place nothing is moved.
        let along = leaf.orientation.rotate(Vec3::Y) * (leaf.size - size).max(0.0);
        for k in 0..count {
            let first = Leaf { size, ..*leaf };
            leaves.push(if k == 0 {
                first
            } else {
                let side = if k % 2 == 0 { ASIDE } else { -ASIDE };
                let roll = ROLL * seed.at(k.into()).range(-1.0, 1.0);
                let turn = Rotation::about(Vec3::Z, side).after(Rotation::about(Vec3::Y, roll));
                let offset = leaf.offset + along * (k as f32 / count as f32);
                Leaf { offset, orientation: leaf.orientation.after(turn), ..first }
            });
        }
    }
    plant.with_leaves(leaves)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dress::thin::tests;

    fn leafy(count: u16) -> Plant {
        let turned = Rotation::about(Vec3::X, 1.0);
        let leaf = |leaf: &Leaf| Leaf { orientation: turned, size: 0.2 + 0.1 * leaf.location, ..*leaf };
        tests::leafy(count).keep_leaves(|_, old| Some(leaf(old)))
    }

    #[test]
    fn longer_leaves_are_fewer_and_shorter_ones_more_and_show_the_same_area() {
        let plant = leafy(2000);
        let whole = |_: &Leaf| 1.0;
        let area = shown(&plant, whole);
        assert!((length(&plant) - 0.25).abs() < 0.005);
        for scale in [0.4, 0.8, 1.0, 1.7, 3.0] {
            let other = refit(plant.clone(), scale, area, whole, Seed::new(1));
            assert!((length(&other) / length(&plant) / scale - 1.0).abs() < 0.01, "{scale}");
            assert!((shown(&other, whole) / area - 1.0).abs() < 0.05, "{scale}");
        }
        // Of pictures with half as much leaf in them there are twice as many.
        let thin = refit(plant.clone(), 1.0, area, |_| 0.5, Seed::new(1));
        assert_eq!(thin.leaves().len(), 4000);
        // There is an end to it.
        assert_eq!(refit(plant, 0.01, area, whole, Seed::new(1)).leaves().len(), 24_000);
    }

    #[test]
    fn a_longer_leaf_takes_away_and_moves_none() {
        let plant = leafy(400);
        let area = shown(&plant, |_| 1.0);
        let places = |scale: f32| {
            let other = refit(plant.clone(), scale, area, |_| 1.0, Seed::new(1));
            other.leaves().iter().map(|leaf| leaf.slot).collect::<Vec<_>>()
        };
        let (some, few) = (places(1.5), places(2.5));
        assert!(few.len() * 2 < some.len() && few.iter().all(|slot| some.contains(slot)));
    }

    #[test]
    fn what_becomes_several_lies_where_it_lay() {
        let plant = leafy(50);
        let several = refit(plant.clone(), 0.3, shown(&plant, |_| 1.0), |_| 1.0, Seed::new(1));
        assert!(several.leaves().len() > 450);
        let posed = plant.pose();
        for leaf in several.leaves() {
            let whole = &plant.leaves()[usize::from(leaf.slot)];
            let (at, of) = (posed.leaf(&plant, leaf), posed.leaf(&plant, whole));
            let tip = at.position + at.frame.y * leaf.size - of.position;
            let along = tip.dot(of.frame.y) / whole.size;
            assert!((0.0..=1.001).contains(&along), "{along}");
            assert!((tip - of.frame.y * tip.dot(of.frame.y)).length() < whole.size * 0.3);
        }
    }

    #[test]
    fn leaves_of_a_plant_become_more_and_raising_that_only_adds() {
        let plant = leafy(400);
        let [some, many] = [1.5, 3.0].map(|times| more(plant.clone(), times, Seed::new(1)));
        assert!((570..630).contains(&some.leaves().len()) && many.leaves().len() == 1200);
        assert!(plant.leaves().iter().all(|leaf| some.leaves().contains(leaf)));
        assert!(some.leaves().iter().all(|leaf| many.leaves().contains(leaf)));
        assert_eq!(more(plant.clone(), 0.5, Seed::new(1)), plant);
    }

    #[test]
    fn nothing_comes_of_nothing() {
        let bare = leafy(0);
        assert_eq!(length(&bare), 0.0);
        assert_eq!(refit(bare.clone(), 2.0, 1.0, |_| 1.0, Seed::new(1)), bare);
        let clear = refit(leafy(5), 2.0, 1.0, |_| 0.0, Seed::new(1));
        assert_eq!(clear, leafy(5));
    }
}
