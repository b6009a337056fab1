//! What is measured of a tree: crown and crown ratio at the coarsest scale, topology, proportions.

use glam::Vec3;

use super::proportions::Proportions;
use super::topology::Topology;
use crate::plant::{Crown, Plant, Posed};

/// A tree, measured; some 3 kB and 4 bytes a chain.
#[derive(Clone, Debug)]
pub struct Profile {
    /// Hull of all that stands above the crown base, anchored there (2017 TVCG, 4.1 at the coarsest scale). The crown
    /// base is the lowest location of the main stem that bears a branch; the main stem is the one with most wood.
    pub crown: Crown,
    /// Share of the main stem's length that is above its crown base, 0..=1.
    pub crown_ratio: f32,
    /// Which chain bears which.
    pub topology: Topology,
    /// Ratios and where the wood is.
    pub proportions: Proportions,
}

impl Profile {
    /// Measures a plant. Linear in its points; the crown costs most.
    #[must_use]
    pub fn of(plant: &Plant, posed: &Posed) -> Self {
        Self::of_kept(plant, posed, &[])
    }

    /// As [`of`](Self::of), without the chains that are marked as gone; an empty `gone` marks none.
    pub(super) fn of_kept(plant: &Plant, posed: &Posed, gone: &[bool]) -> Self {
        let chains = plant.chains();
        let here = |i: usize| !gone.get(i).copied().unwrap_or(false);
        let volume = |i: usize| {
            let id = crate::plant::ChainId(i as u32);
            let r = plant.radii(id);
            posed.curve(plant, id).length() * (r[0] * r[0] + r[r.len() - 1] * r[r.len() - 1])
        };
        let main = (0..chains.len())
            .filter(|&i| chains[i].parent.is_none() && here(i))
            .max_by(|&a, &b| volume(a).total_cmp(&volume(b)).then(b.cmp(&a)))
            .unwrap_or(0);
        let borne = (0..chains.len()).filter(|&i| here(i) && chains[i].parent.is_some_and(|p| p.index() == main));
        let lowest = borne.map(|i| chains[i].location).fold(f32::INFINITY, f32::min);
        let base = if lowest.is_finite() { lowest } else { 0.0 };
        let anchor = posed.at(plant, crate::plant::ChainId(main as u32), base).position;
        let mut crown = Crown::new(anchor);
        let mut points: Vec<Vec3> = Vec::with_capacity(posed.positions().len() + 1);
        points.push(anchor);
        for id in plant.chain_ids().filter(|id| here(id.index())) {
            let own = posed.chain(plant, id);
            if id.index() == main {
                let first = posed.curve(plant, id).segment(f64::from(base)).0 + 1;
                points.extend_from_slice(own.get(first..).unwrap_or(&[]));
            } else {
                points.extend_from_slice(own);
            }
        }
        crown.add_all(&points);
        Self {
            crown,
            crown_ratio: 1.0 - base,
            topology: Topology::of_kept(plant, gone),
            proportions: Proportions::of_kept(plant, posed, gone),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::PlantBuilder;

    #[test]
    fn the_crown_is_what_stands_above_the_lowest_branch_of_the_main_stem() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.2, 0.1]);
        let sucker = builder.stem(Vec3::X, &[Vec3::ZERO, Vec3::Y], &[0.02, 0.01]);
        builder.branch(sucker, 0.1, &[Vec3::ZERO, Vec3::X], &[0.01, 0.01]);
        builder.branch(stem, 0.75, &[Vec3::ZERO, Vec3::X], &[0.05, 0.05]);
        let plant = builder.finish().unwrap();
        let profile = Profile::of(&plant, &plant.pose());
        assert!((profile.crown_ratio - 0.25).abs() < 1e-6);
        assert!(profile.crown.anchor().abs_diff_eq(Vec3::Y * 3.0, 1e-5));
        // A root for two stems.
        assert_eq!(profile.topology.len(), 5);
        let without = Profile::of_kept(&plant, &plant.pose(), &[false, false, false, true]);
        assert_eq!(without.crown_ratio, 1.0);
    }
}
