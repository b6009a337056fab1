//! Stems of a still tree that one source has and the other not.
//!
//! On its way from one source to the other such a stem grows from the ground, as the paper has it (2017 TVCG, 4.3), and what it bears
//! comes last. One of those moments by itself is a pole: a birch of three stems and a poplar made trees with a bowed rod of six metres
//! beside them, as thick as a thumb and bare. So in a tree that stands by itself a stem is there or not, and is not much less than
//! its source has it.

use crate::relate::{Family, KinId, Weights};

/// Stems that have come so far are there.
const THERE: f32 = 0.5;
/// And then grown so far at least.
const GROWN: f32 = 0.7;

/// The same weights with stems that are there or not. One is: where all are hardly there, those that are most.
#[must_use]
pub fn whole_stems(family: &Family, mut weights: Weights) -> Weights {
    let stems: Vec<KinId> = family.kin_ids().filter(|kin| family.parent(*kin).is_none()).collect();
    let there = stems.iter().map(|kin| weights.degree(*kin)).fold(0.0, f32::max).min(THERE);
    for kin in stems {
        let degree = weights.degree(kin);
        if degree > 0.0 && degree < 1.0 {
            let past = ((degree - THERE) / (1.0 - THERE)).max(0.0);
            let shares = weights.shares(kin).to_vec();
            weights.set(kin, &shares, if degree < there { 0.0 } else { GROWN + (1.0 - GROWN) * past });
        }
    }
    weights
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::blend::mix;
    use crate::plant::{Plant, PlantBuilder};
    use crate::preset::plan::MatchParams;
    use crate::relate::nway_family;

    fn stems(count: usize) -> Plant {
        let mut builder = PlantBuilder::new();
        for i in 0..count {
            let foot = Vec3::X * i as f32;
            let stem = builder.stem(foot, &[Vec3::ZERO, Vec3::Y * (6.0 - i as f32)], &[0.2, 0.1]);
            builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X], &[0.05, 0.02]);
        }
        builder.finish().expect("it stands")
    }

    #[test]
    fn a_stem_of_one_source_is_there_or_not_and_one_always_is() {
        let matching = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
        let family = nway_family(vec![stems(3), stems(1)], &matching).expect("they match");
        let lengths = |share: f32| -> Vec<f32> {
            let tree = family.blend(&whole_stems(&family, mix(&family, &[share, 1.0 - share])));
            let stems = tree.chain_ids().filter(|id| tree.chain(*id).parent.is_none());
            stems.map(|id| tree.points(id).last().expect("it has points").y).collect()
        };
        assert_eq!(lengths(0.45).len(), 1);
        let half = lengths(0.6);
        assert!(half.len() == 3 && half.iter().all(|length| *length > 0.7 * 4.0), "{half:?}");
        assert!(family.blend(&whole_stems(&family, family.corner(0))) == family.sources()[0]);
        let mut faint = mix(&family, &[0.5, 0.5]);
        for kin in family.kin_ids() {
            let shares = faint.shares(kin).to_vec();
            faint.set(kin, &shares, 0.2);
        }
        assert!(family.blend(&whole_stems(&family, faint)).height() > 2.0);
    }
}
