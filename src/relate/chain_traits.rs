//! What tells a chain from those beside it past its outer lobe, its ratio and its branching vector (2017 CAVW, Table 1), and
//! how unlike two chains are by it (5: the weighted sum over the feature parameters).
//!
//! Terms lie in 0..=1, measured against the farthest, longest and thickest chain of the same group, and stand beside the three
//! that have the preset's weights, which add up to 1:
//!
//! | parameter | what is compared | weight |
//! |---|---|---|
//! | IL | hulls of the chains' own leaves, from the chain's base, by Hausdorff distance | [`INNER`] |
//! | IR | where the lowest of these leaves stands along the chain, 1 without leaves | [`INNER_RATIO`] |
//! | chn | lengths | [`LENGTH`] |
//! | chn | radii at the base | [`RADIUS`] |
//! | p | for stems, where they stand from the middle of all of them | [`ORIGIN`] |
//!
//! Left out: p of what is no stem, since the chains of a group leave one place and groups are matched by what they are (their
//! location, Gp, would tie a branch to its height where the paper's figures let limbs rise); and the course of a chain
//! between its base and its tip: where it goes is in its outer lobe and its branching vector, and what bends on the way is
//! blended by arc length whichever partner it has.

use glam::Vec3;

use crate::plant::{ChainId, Crown, Plant, Posed};

/// Weights of the terms.
const INNER: f32 = 0.1;
const INNER_RATIO: f32 = 0.05;
const LENGTH: f32 = 0.1;
const RADIUS: f32 = 0.1;
const ORIGIN: f32 = 0.1;

/// One chain's traits.
#[derive(Clone, Debug)]
pub(super) struct ChainTraits {
    /// IL: hull of its own leaves, from its base; none without leaves.
    inner: Option<Box<Crown>>,
    /// IR: location of its lowest leaf; 1 without leaves.
    inner_ratio: f32,
    /// Metres.
    length: f32,
    /// At the base, metres.
    radius: f32,
    /// Where a stem stands; zero for others.
    origin: Vec3,
}

/// What the traits of a group's chains are measured against.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measure {
    inner: f32,
    length: f32,
    radius: f32,
    middle: Vec3,
    apart: f32,
}

/// The traits of all chains; `leaves` are the hulls of their own leaves.
pub(super) fn traits(plant: &Plant, posed: &Posed, leaves: &[Option<Crown>]) -> Vec<ChainTraits> {
    let mut lowest = vec![1.0_f32; plant.chains().len()];
    for leaf in plant.leaves() {
        let own = &mut lowest[leaf.chain.index()];
        *own = own.min(leaf.location);
    }
    let of = |id: ChainId| ChainTraits {
        inner: leaves[id.index()].as_ref().map(|hull| Box::new(hull.anchored(posed.chain(plant, id)[0]))),
        inner_ratio: lowest[id.index()],
        length: posed.curve(plant, id).length(),
        radius: plant.radii(id)[0],
        origin: plant.chain(id).origin,
    };
    plant.chain_ids().map(of).collect()
}

impl Measure {
    pub(super) fn of(group: &[&ChainTraits]) -> Self {
        let most = |of: &dyn Fn(&ChainTraits) -> f32| group.iter().map(|t| of(t)).fold(0.0, f32::max);
        let middle = group.iter().fold(Vec3::ZERO, |sum, t| sum + t.origin) / group.len().max(1) as f32;
        Self {
            inner: most(&|t| t.inner.as_ref().map_or(0.0, |hull| hull.reach())),
            length: most(&|t| t.length),
            radius: most(&|t| t.radius),
            middle,
            apart: most(&|t| t.origin.distance(middle)),
        }
    }
}

impl ChainTraits {
    /// How unlike two chains are, each among its own group: at most the sum of the weights.
    pub(super) fn unlike(&self, own: &Measure, other: &Self, others: &Measure) -> f32 {
        let share = |value: f32, most: f32| if most > 0.0 && most.is_finite() { value / most } else { 0.0 };
        let inner = match (&self.inner, &other.inner) {
            (None, None) => 0.0,
            (Some(_), None) | (None, Some(_)) => 1.0,
            (Some(a), Some(b)) => {
                a.scaled(share(1.0, own.inner)).distance(&b.scaled(share(1.0, others.inner))).min(1.0)
            }
        };
        let length = (share(self.length, own.length) - share(other.length, others.length)).abs();
        let radius = (share(self.radius, own.radius) - share(other.radius, others.radius)).abs();
        let place = |traits: &Self, measure: &Measure| (traits.origin - measure.middle) * share(1.0, measure.apart);
        inner * INNER
            + (self.inner_ratio - other.inner_ratio).abs() * INNER_RATIO
            + length * LENGTH
            + radius * RADIUS
            + place(self, own).distance(place(other, others)) * 0.5 * ORIGIN
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Rotation;
    use crate::plant::{Leaf, PlantBuilder};

    /// Twigs of one shape with a leaf at a location each, or none; and their traits.
    fn twigs(of: &[(f32, f32, Option<f32>)]) -> Vec<ChainTraits> {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.1, 0.05]);
        for &(length, radius, leaf) in of {
            let twig = builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X * length], &[radius, 0.001]);
            if let Some(location) = leaf {
                builder.leaf(Leaf::new(twig, location, Rotation::about(Vec3::X, 0.3), 0.1, 0));
            }
        }
        let plant = builder.finish().unwrap();
        let posed = plant.pose();
        let mut hulls: Vec<Option<Crown>> = vec![None; plant.chains().len()];
        for leaf in plant.leaves() {
            let pose = posed.leaf(&plant, leaf);
            hulls[leaf.chain.index()].get_or_insert_with(|| Crown::new(pose.position)).add(pose.position);
        }
        traits(&plant, &posed, &hulls).split_off(1)
    }

    #[test]
    fn length_girth_and_leaves_tell_chains_apart() {
        let all = twigs(&[
            (1.0, 0.02, None),
            (0.5, 0.02, None),
            (1.0, 0.01, None),
            (1.0, 0.02, Some(0.9)),
            (1.0, 0.02, Some(0.2)),
        ]);
        let measure = Measure::of(&all.iter().collect::<Vec<_>>());
        let apart = |i: usize, j: usize| all[i].unlike(&measure, &all[j], &measure);
        let near = |a: f32, b: f32| (a - b).abs() < 1e-5;
        assert!(near(apart(0, 0), 0.0) && near(apart(3, 3), 0.0));
        assert!(near(apart(0, 1), 0.5 * LENGTH) && near(apart(0, 2), 0.5 * RADIUS));
        // A leafy one and a bare one; and leaves at the tip and near the base.
        assert!(near(apart(0, 3), INNER + 0.1 * INNER_RATIO));
        assert!(apart(3, 4) > 0.7 * INNER_RATIO + 0.6 * INNER);
        assert_eq!(apart(3, 4), apart(4, 3));
    }
}
