//! The straight line that a trunk and its crown follow, which quads are to cross in: where they cross elsewhere, each shows a trunk
//! of its own.

use glam::Vec3;

use crate::plant::{Plant, Posed};

/// Most that a line goes aside, metres a metre up.
const STEEPEST: f32 = 0.7;
/// The share of a stem's length that may flare.
const FLARED: f32 = 0.1;
/// What is thinner than this, of the trunk's radius above its flare, is a limb.
const THIN: f32 = 0.6;

/// A line from the foot of a plant up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Trunk {
    foot: Vec3,
    /// Metres aside for each metre up; level.
    lean: Vec3,
}

impl Trunk {
    /// The line through the foot that is nearest to the stem as far as it is a trunk, and to the leaves, by least squares, each part
    /// by the area that is seen of it. Of several stems it is the mean of theirs: those of a shrub lean all ways.
    pub(super) fn of(plant: &Plant, posed: &Posed) -> Self {
        let (mut feet, mut thick) = (Vec3::ZERO, 0.0_f32);
        let (mut aside, mut up) = (Vec3::ZERO, 0.0_f32);
        for stem in plant.chain_ids().filter(|&id| plant.chain(id).parent.is_none()) {
            let (points, radii) = (posed.chain(plant, stem), plant.radii(stem));
            let (Some(&foot), Some(&radius)) = (points.first(), radii.first()) else { continue };
            feet += foot * radius;
            thick += radius;
            for (pair, radius) in points[..trunk_end(points, radii)].windows(2).zip(radii) {
                let middle = (pair[0] + pair[1]) * 0.5 - foot;
                let weight = pair[0].distance(pair[1]) * radius;
                aside += middle * (weight * middle.y);
                up += weight * middle.y * middle.y;
            }
        }
        // The crown is what is seen, and a line that leaves it shows it aside of itself from the other plane.
        let foot = if thick > 0.0 { feet / thick } else { Vec3::ZERO };
        for (leaf, pose) in plant.leaves().iter().zip(posed.leaves(plant)) {
            let off = pose.position - foot;
            let weight = leaf.size * leaf.size * leaf.form.width();
            aside += off * (weight * off.y);
            up += weight * off.y * off.y;
        }
        // Without thickness or height there is no mean.
        let known = |mean: Vec3, or: Vec3| if mean.is_finite() { mean } else { or };
        let lean = known(Vec3::new(aside.x, 0.0, aside.z) / up, Vec3::ZERO).clamp_length_max(STEEPEST);
        let first = posed.positions().first().copied().unwrap_or(Vec3::ZERO);
        Self { foot: known(feet / thick, first), lean }
    }

    /// Where it is at a height.
    pub(super) fn at(&self, height: f32) -> Vec3 {
        self.foot.with_y(height) + self.lean * (height - self.foot.y)
    }

    /// Unit vector along it, up.
    pub(super) fn along(&self) -> Vec3 {
        (self.lean + Vec3::Y).normalize()
    }
}

/// How many points of a stem are its trunk's: those up to where it is [`THIN`] as thick as above its flare. Past a fork one of
/// its limbs goes on by the stem's name, aside.
fn trunk_end(points: &[Vec3], radii: &[f32]) -> usize {
    let arc: Vec<f32> = std::iter::once(0.0)
        .chain(points.windows(2).scan(0.0, |sum, pair| {
            *sum += pair[0].distance(pair[1]);
            Some(*sum)
        }))
        .collect();
    let above = arc.partition_point(|s| *s < FLARED * arc[arc.len() - 1]);
    let thick = radii.get(above).copied().unwrap_or(0.0);
    let thin = radii.iter().skip(above).position(|r| *r < THIN * thick);
    thin.map_or(points.len(), |k| above + k).max(2).min(points.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::PlantBuilder;

    fn of(points: &[Vec3], radii: &[f32]) -> Trunk {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(points[0], &points.iter().map(|p| *p - points[0]).collect::<Vec<_>>(), radii);
        builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X * 9.0], &[0.2, 0.1]);
        let plant = builder.finish().unwrap();
        Trunk::of(&plant, &plant.pose())
    }

    #[test]
    fn a_straight_trunk_is_met_and_its_branches_do_not_matter() {
        let (foot, top) = (Vec3::new(3.0, 1.0, -2.0), Vec3::new(4.0, 6.0, -4.0));
        let trunk = of(&[foot, foot.lerp(top, 0.3), top], &[0.3, 0.2, 0.1]);
        for t in [0.0, 0.4, 1.0] {
            let p = foot.lerp(top, t);
            assert!(trunk.at(p.y).distance(p) < 1e-4, "{trunk:?}");
        }
        assert!(trunk.along().distance((top - foot).normalize()) < 1e-5);
    }

    #[test]
    fn a_crown_over_the_foot_keeps_the_line_of_a_leaning_trunk_upright() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::new(0.5, 1.0, 0.0)], &[0.1, 0.1]);
        let bare = builder.clone().finish().unwrap();
        for i in 0..40 {
            let offset = Vec3::new(-0.5 + (i % 5) as f32 * 0.1 - 0.2, 0.5 + (i / 5) as f32 * 0.2, 0.0);
            builder.leaf(crate::plant::Leaf {
                offset,
                ..crate::plant::Leaf::new(stem, 1.0, crate::base::Rotation::IDENTITY, 0.3, 0)
            });
        }
        let leafy = builder.finish().unwrap();
        let lean = |plant: &Plant| Trunk::of(plant, &plant.pose()).lean.length();
        assert!(lean(&bare) > 0.45 && lean(&leafy) < 0.3, "{} {}", lean(&bare), lean(&leafy));
    }

    #[test]
    fn limbs_do_not_count_and_a_trunk_that_lies_is_bounded() {
        let points = [Vec3::ZERO, Vec3::Y * 0.8, Vec3::Y * 3.0, Vec3::Y * 4.0, Vec3::new(2.0, 6.0, 0.0)];
        let (limb, bent) = (of(&points, &[0.4, 0.3, 0.28, 0.1, 0.05]), of(&points, &[0.4, 0.3, 0.28, 0.26, 0.2]));
        assert_eq!(limb.lean, Vec3::ZERO);
        assert!(bent.lean.x > 0.05 && bent.lean.x < 0.33, "{bent:?}");
        let lying = of(&[Vec3::ZERO, Vec3::new(5.0, 0.1, 0.0)], &[0.5, 0.4]);
        assert!(lying.lean.length() < STEEPEST + 1e-5);
        let flat = of(&[Vec3::ZERO, Vec3::X], &[0.5, 0.4]);
        assert_eq!(flat.lean, Vec3::ZERO);
    }

    #[test]
    fn the_stems_of_a_shrub_lean_all_ways_and_its_line_none() {
        let mut builder = PlantBuilder::new();
        for way in [Vec3::X, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Z] {
            builder.stem(Vec3::X * 3.0 + way * 0.2, &[Vec3::ZERO, Vec3::Y + way, Vec3::Y * 2.0 + way * 2.0], &[0.1; 3]);
        }
        let plant = builder.finish().unwrap();
        let trunk = Trunk::of(&plant, &plant.pose());
        assert!(trunk.lean.length() < 1e-5 && trunk.at(2.0).distance(Vec3::new(3.0, 2.0, 0.0)) < 1e-5, "{trunk:?}");
    }
}
