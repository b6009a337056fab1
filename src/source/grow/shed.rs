//! Shedding: branches too slim to bear themselves are dropped, as trees drop their shaded lower limbs.
//!
//! Least-cost paths can run far before they end, and one that bears nothing on the way becomes a wire: at the tip's
//! radius all along. Past the paper; without it about one branch in two hundred of the shipped species hung bare below
//! the crown. Real branches measure 100 to 300 base radii, and so does the median of every shipped species.

use glam::Vec3;

use crate::plant::{ChainId, Curve, Plant, PlantBuilder};

/// The plant without the branches that are longer than `slenderness` times their base radius, and what these bore, scaled
/// to the height that it had; and how many of them there were, what they bore not counted. Stems stay, and so do branches of no radius. Linear in
/// points.
pub(super) fn shed(plant: &Plant, slenderness: f32) -> (Plant, usize) {
    let (rest, slim) = without(plant, slenderness, 1.0);
    if slim == 0 {
        return (rest, slim);
    }
    let (before, after) = rayon::join(|| plant.height(), || rest.height());
    // The highest twig may be among what was shed.
    if after > 0.0 && after < before {
        let (rest, _) = without(plant, slenderness, before / after);
        return (rest, slim);
    }
    (rest, slim)
}

/// As [`shed`], but not scaled: for plants among obstacles and neighbours, whose scale is fixed.
pub(super) fn shed_in_place(plant: &Plant, slenderness: f32) -> (Plant, usize) {
    without(plant, slenderness, 1.0)
}

/// A plant scaled to the height that it had, which is the first of two; the second is the one it has.
pub(super) fn as_high_as([before, after]: [f32; 2], plant: Plant) -> Plant {
    if after > 0.0 && before > 0.0 && after != before {
        return without(&plant, f32::INFINITY, before / after).0;
    }
    plant
}

fn without(plant: &Plant, slenderness: f32, scale: f32) -> (Plant, usize) {
    let mut builder = PlantBuilder::new();
    let mut kept: Vec<Option<ChainId>> = Vec::with_capacity(plant.chains().len());
    let mut slim = 0;
    for id in plant.chain_ids() {
        let chain = plant.chain(id);
        let points: Vec<Vec3> = plant.points(id).iter().map(|p| *p * scale).collect();
        let radii: Vec<f32> = plant.radii(id).iter().map(|r| r * scale).collect();
        kept.push(match chain.parent {
            None => Some(builder.stem(chain.origin * scale, &points, &radii)),
            Some(parent) => kept[parent.index()].and_then(|parent| {
                let sound = radii[0] == 0.0 || Curve::new(&points).length() <= slenderness * radii[0];
                slim += usize::from(!sound);
                sound.then(|| builder.branch(parent, chain.location, &points, &radii))
            }),
        });
    }
    // All chains come from a sound plant, so this one is sound.
    (builder.finish().unwrap_or_else(|_| plant.clone()), slim)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wire_goes_with_what_it_bears_and_nothing_else_does() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 9.0], &[0.01, 0.01]);
        let wire = builder.branch(stem, 0.2, &[Vec3::ZERO, Vec3::X * 4.0], &[0.01, 0.01]);
        builder.branch(wire, 0.5, &[Vec3::ZERO, Vec3::X * 0.1], &[0.01, 0.01]);
        let branch = builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X * 2.0], &[0.01, 0.01]);
        builder.branch(branch, 0.5, &[Vec3::ZERO, Vec3::X * 0.2], &[0.01, 0.01]);
        let (plant, slim) = shed(&builder.finish().unwrap(), 300.0);
        assert_eq!(slim, 1);
        assert_eq!(plant.chains().iter().map(|c| c.location).collect::<Vec<_>>(), [0.0, 0.5, 0.5]);
    }
}
