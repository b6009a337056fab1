//! Murray's allometric rule: `r_parent^2.5 = Σ r_child^2.5` (Wang et al. 2017, Eq. 3; Murray 1927).

use super::Plant;
use crate::base::math;

/// The exponent of the rule.
pub const ALLOMETRIC_EXPONENT: f32 = 2.5;

/// `radius^2.5`: what a branch carries. Without a call to `pow`.
pub(crate) fn carried(radius: f64) -> f64 {
    radius * radius * radius.sqrt()
}

/// The radius that carries this much; the inverse of [`carried`].
fn carrier(carried: f64) -> f64 {
    math::pow64(carried, 1.0 / f64::from(ALLOMETRIC_EXPONENT))
}

/// Whether a child at `location` counts for a point at `parameter`: it leaves at the point or above it, give or take
/// rounding.
fn counts(location: f32, parameter: f64) -> bool {
    f64::from(location) >= parameter - 1e-6
}

/// The radius that the rule gives at every point of a plant, from the tips to the base, metres; in the order of
/// [`Plant::all_points`]. At a tip it is the plant's own radius; of a chain that ends in a point, the last that is above zero.
///
/// A child counts for every point of its parent at or below the child's location. Linear in points, and n log n in the
/// children of one chain.
#[must_use]
pub fn rule_radii(plant: &Plant) -> Vec<f32> {
    let parameters: Vec<f64> =
        plant.chain_ids().flat_map(|id| super::Curve::new(plant.points(id)).parameters()).collect();
    let mut rule = vec![0.0_f32; plant.all_points().len()];
    // What each chain's children carry: (location, r^2.5 at their base).
    let mut loads: Vec<Vec<(f32, f64)>> = vec![Vec::new(); plant.chains().len()];
    for id in plant.chain_ids().rev() {
        let mut children = std::mem::take(&mut loads[id.index()]);
        // From the tip down; ties by value keep the sum independent of the order of siblings.
        children.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1)));
        let span = plant.span(id);
        let radii = plant.radii(id);
        let tip = f64::from(radii.iter().rev().copied().find(|radius| *radius > 0.0).unwrap_or(0.0));
        let (mut sum, mut radius) = (carried(tip), tip);
        let mut next = 0;
        for i in span.rev() {
            let before = next;
            while next < children.len() && counts(children[next].0, parameters[i]) {
                sum += children[next].1;
                next += 1;
            }
            if next > before {
                radius = carrier(sum);
            }
            rule[i] = radius as f32;
        }
        let chain = plant.chain(id);
        if let Some(parent) = chain.parent {
            loads[parent.index()].push((chain.location, carried(radius)));
        }
    }
    rule
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::plant::PlantBuilder;

    #[test]
    fn two_equal_twigs_make_a_stem_of_the_rule() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y, Vec3::Y * 2.0], &[1.0, 1.0, 0.1]);
        builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X], &[0.5, 0.1]);
        let rule = rule_radii(&builder.finish().unwrap());
        let both = math::pow(2.0, 0.4) * 0.1;
        assert!((rule[0] - both).abs() < 1e-6 && (rule[1] - both).abs() < 1e-6);
        assert!((rule[2] - 0.1).abs() < 1e-6);
    }
}
