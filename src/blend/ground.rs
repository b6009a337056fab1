//! Limbs of a blend that would hang into the ground.
//!
//! Between a tree whose limbs hang and one whose limbs stand high or low, a limb may come farther than the height it leaves
//! the trunk at: blends of two willows reached two metres below the ground that both stand on. Such a limb is pressed
//! together below its base until it lies on the ground, as a long shoot does; what is above its base stays as it is.

use glam::Vec3;

use crate::base::Frame;
use crate::plant::{Chain, ChainId, Curve, Leaf, Plant, PlantBuilder, Posed, STATIONS, frame_at};

/// Depths below the ground that nobody sees, as a share of the plant's height.
const UNSEEN: f32 = 1e-3;

/// A blend of some plants whose wood reaches no farther below the ground (y = 0) than that of any of them; as it is
/// where it does not.
#[must_use]
pub fn grounded(blend: Plant, sources: &[Plant]) -> Plant {
    let posed = blend.pose();
    let top = posed.positions().iter().fold(0.0_f32, |top, p| top.max(p.y));
    let deep = |positions: &[Vec3]| positions.iter().fold(0.0_f32, |low, p| low.min(p.y));
    let hair = top * UNSEEN;
    if deep(posed.positions()) >= -hair {
        return blend;
    }
    let ground = sources.iter().map(|source| deep(source.pose().positions())).fold(0.0, f32::min);
    if deep(posed.positions()) >= ground - hair {
        return blend;
    }
    lifted(&blend, &posed, ground)
}

/// The plant with every limb pressed together, below its base, until it reaches no lower than `ground`; stems likewise.
fn lifted(plant: &Plant, posed: &Posed, ground: f32) -> Plant {
    // The limb that each chain is on: the chain on a stem that bears it, or the stem itself.
    let mut limb: Vec<usize> = Vec::with_capacity(plant.chains().len());
    let mut lowest = vec![f32::MAX; plant.chains().len()];
    for id in plant.chain_ids() {
        let on = plant.chain(id).parent.filter(|parent| plant.chain(*parent).parent.is_some());
        limb.push(on.map_or(id.index(), |parent| limb[parent.index()]));
        let low = &mut lowest[limb[id.index()]];
        *low = posed.chain(plant, id).iter().fold(*low, |low, p| low.min(p.y));
    }
    let place = |id: ChainId, p: Vec3| {
        let limb = limb[id.index()];
        let (base, low) = (posed.chain(plant, ChainId(limb as u32))[0].y, lowest[limb]);
        if low >= ground || p.y >= base {
            return p;
        }
        let pressed = (base - ground).max(0.0) / (base - low);
        Vec3::new(p.x, base + (p.y - base) * pressed, p.z)
    };
    let mut builder = PlantBuilder::new();
    let mut frames: Vec<[Frame; STATIONS + 1]> = Vec::with_capacity(plant.chains().len());
    let mut arcs: Vec<Vec<f64>> = Vec::with_capacity(plant.chains().len());
    // Where on its bent axis lies what was at a share of the length before.
    let moved = |arcs: &[Vec<f64>], id: ChainId, location: f32| {
        let ((i, f), arc) = (posed.curve(plant, id).segment(f64::from(location)), &arcs[id.index()]);
        let next = arc.get(i + 1).copied().unwrap_or(1.0);
        ((arc[i] + (next - arc[i]) * f64::from(f)) as f32).clamp(0.0, 1.0)
    };
    for id in plant.chain_ids() {
        let Chain { origin, parent, location, .. } = *plant.chain(id);
        let location = parent.map_or(location, |parent| moved(&arcs, parent, location));
        let frame = parent.map_or(Frame::WORLD, |parent| frame_at(&frames[parent.index()], location));
        let places: Vec<Vec3> = posed.chain(plant, id).iter().map(|p| place(id, *p)).collect();
        let local: Vec<Vec3> = places.iter().map(|p| frame.to_local(*p - places[0])).collect();
        let curve = Curve::new(&local);
        frames.push(curve.frames(frame));
        arcs.push(curve.parameters());
        match parent {
            None => builder.stem(origin, &local, plant.radii(id)),
            Some(parent) => builder.branch(parent, location, &local, plant.radii(id)),
        };
    }
    for leaf in plant.leaves() {
        builder.leaf(Leaf { location: moved(&arcs, leaf.chain, leaf.location), ..*leaf });
    }
    builder.finish().unwrap_or_else(|_| plant.clone())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Rotation;

    /// A trunk of 4 m with a limb at three quarters that goes up and then hangs, `low` being the height of its end, and a twig
    /// with a leaf on it.
    fn willow(low: f32) -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 2.0, Vec3::Y * 4.0], &[0.2, 0.15, 0.1]);
        // In the trunk's frame, which is the world's.
        let points = [
            Vec3::ZERO,
            Vec3::new(1.0, 0.5, 0.0),
            Vec3::new(2.0, (low - 3.0) * 0.5, 0.0),
            Vec3::new(2.2, low - 3.0, 0.0),
        ];
        let limb = builder.branch(stem, 0.75, &points, &[0.08, 0.06, 0.04, 0.02]);
        let twig = builder.branch(limb, 0.8, &[Vec3::ZERO, Vec3::new(0.2, 0.3, 0.1)], &[0.01, 0.005]);
        builder.leaf(Leaf::new(twig, 1.0, Rotation::about(Vec3::Y, 0.3), 0.1, 0));
        builder.finish().unwrap()
    }

    fn lowest(plant: &Plant) -> f32 {
        plant.pose().positions().iter().fold(f32::MAX, |low, p| low.min(p.y))
    }

    #[test]
    fn a_limb_that_hangs_into_the_ground_lies_on_it_and_keeps_what_is_above_its_base() {
        let (deep, sources) = (willow(-2.0), [willow(0.5), willow(1.0)]);
        let lifted = grounded(deep.clone(), &sources);
        assert!(lowest(&deep) < -1.9 && lowest(&lifted).abs() < 0.01, "{}", lowest(&lifted));
        let (before, after) = (deep.pose(), lifted.pose());
        let point = |posed: &Posed, plant: &Plant, chain: u32, k: usize| posed.chain(plant, ChainId(chain))[k];
        for (chain, k) in [(0, 2), (1, 0), (1, 1)] {
            let [before, after] = [point(&before, &deep, chain, k), point(&after, &lifted, chain, k)];
            assert!(before.distance(after) < 1e-4, "{chain} {k}: {before} {after}");
        }
        let ends = [point(&before, &deep, 1, 3), point(&after, &lifted, 1, 3)];
        assert!((ends[0].x - ends[1].x).abs() < 1e-4);
        // What it bears stays where it was on it.
        let base = point(&after, &lifted, 2, 0);
        let way = (point(&after, &lifted, 1, 3) - point(&after, &lifted, 1, 2)).normalize();
        let off = base - point(&after, &lifted, 1, 2);
        assert!((off - way * off.dot(way)).length() < 1e-3, "{off}");
        assert_eq!((lifted.leaves().len(), lifted.chains().len()), (1, 3));
    }

    #[test]
    fn what_reaches_no_deeper_than_its_sources_stays_as_it_is() {
        assert_eq!(grounded(willow(0.2), &[willow(0.5)]), willow(0.2));
        assert_eq!(grounded(willow(-0.5), &[willow(0.5), willow(-0.6)]), willow(-0.5));
        let less = grounded(willow(-1.5), &[willow(0.5), willow(-0.6)]);
        assert!((lowest(&less) + 0.6).abs() < 0.01, "{}", lowest(&less));
    }

    #[test]
    fn a_stem_that_starts_to_grow_downwards_is_answered() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::new(0.5, -0.4, 0.0), Vec3::Y * 2.0], &[0.1; 3]);
        builder.branch(stem, 0.1, &[Vec3::ZERO, Vec3::new(0.3, -3.0, 0.0)], &[0.02, 0.01]);
        let deep = builder.finish().unwrap();
        assert!(lowest(&grounded(deep, &[willow(0.5)])) > -0.5);
    }
}
