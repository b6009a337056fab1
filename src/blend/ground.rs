//! Limbs, shoots and leaves of a blend that would hang into the ground.
//!
//! Between a tree whose limbs hang and one whose limbs stand high or low, a branch may come farther than the height it leaves
//! its bearer at: blends of two willows reached two metres below the ground that both stand on. Such a branch is made as much
//! smaller, with all that it bears, as lets it end on the ground: a shoot that has not grown so far yet. A leaf that still would
//! goes: it is of one source, and hangs as far as there from a twig of another. (Tried: limbs pressed together below their bases.
//! Bark is stretched where wood bends more sharply than it is thick.)

use glam::Vec3;

use crate::base::Frame;
use crate::plant::{Chain, Curve, Leaf, Plant, PlantBuilder, Posed, STATIONS, frame_at};

/// Depths below the ground that nobody sees, as a share of the plant's height.
const UNSEEN: f32 = 1e-3;
/// What at least is left of a branch: one that leaves its bearer at the ground can't be made short enough.
const LEAST: f32 = 0.15;

/// How far some plants reach below the ground, metres; 0 where none does.
#[derive(Clone, Copy, Debug)]
pub(super) struct Depths {
    wood: f32,
    leaves: f32,
}

impl Depths {
    pub(super) fn of<'s>(plants: impl Iterator<Item = &'s Plant>) -> Self {
        plants.fold(Self { wood: 0.0, leaves: 0.0 }, |least, plant| {
            let posed = plant.pose();
            Self { wood: least.wood.min(lowest_wood(&posed)), leaves: least.leaves.min(lowest_leaf(plant, &posed)) }
        })
    }
}

/// A blend of some plants whose wood and leaves reach no farther below the ground (y = 0) than those of any of them; as it is
/// where they do not.
#[must_use]
pub fn grounded<'s, S: IntoIterator<Item = &'s Plant, IntoIter: Clone>>(blend: Plant, sources: S) -> Plant {
    let sources = sources.into_iter();
    held(blend, &|| Depths::of(sources.clone()))
}

/// As [`grounded`], by the depths of the sources.
pub(super) fn held(mut blend: Plant, depths: &dyn Fn() -> Depths) -> Plant {
    let posed = blend.pose();
    let hair = posed.positions().iter().fold(0.0_f32, |top, p| top.max(p.y)) * UNSEEN;
    let (wood, leaves) = (lowest_wood(&posed), lowest_leaf(&blend, &posed));
    if wood < -hair {
        let ground = depths().wood;
        if wood < ground - hair {
            blend = shortened(&blend, ground);
        }
    }
    if leaves < -hair {
        let ground = depths().leaves - hair;
        let posed = blend.pose();
        let low: Vec<bool> = blend.leaves().iter().map(|leaf| tip(&blend, &posed, leaf) < ground).collect();
        blend = blend.keep_leaves(|i, leaf| (!low[i]).then_some(*leaf));
    }
    blend
}

fn lowest_wood(posed: &Posed) -> f32 {
    posed.positions().iter().fold(0.0, |low, p| low.min(p.y))
}

fn lowest_leaf(plant: &Plant, posed: &Posed) -> f32 {
    plant.leaves().iter().fold(0.0, |low, leaf| low.min(tip(plant, posed, leaf)))
}

/// The height of the lowest corner of a leaf's card.
fn tip(plant: &Plant, posed: &Posed, leaf: &Leaf) -> f32 {
    let pose = posed.leaf(plant, leaf);
    let [across, along] = [pose.frame.x.y, pose.frame.y.y].map(|rise| rise * leaf.size);
    pose.position.y + along.min(0.0) - across.abs() * leaf.form.width() * 0.5
}

/// The plant with every branch that reaches lower than `ground` as much smaller as lets it end there. Stems stay as they are.
fn shortened(plant: &Plant, ground: f32) -> Plant {
    let mut builder = PlantBuilder::new();
    // Of each chain: its size over what it was, its places in the world, and its frames.
    let mut sizes: Vec<f32> = Vec::with_capacity(plant.chains().len());
    let mut places: Vec<Vec<Vec3>> = Vec::with_capacity(plant.chains().len());
    let mut frames: Vec<[Frame; STATIONS + 1]> = Vec::with_capacity(plant.chains().len());
    for id in plant.chain_ids() {
        let Chain { origin, parent, location, .. } = *plant.chain(id);
        let (base, frame, borne) = parent.map_or((origin, Frame::WORLD, 1.0), |parent| {
            let i = parent.index();
            (Curve::new(&places[i]).point(f64::from(location)), frame_at(&frames[i], location), sizes[i])
        });
        let points = plant.points(id);
        let deepest = points.iter().map(|p| frame.to_world(*p).y * borne).fold(0.0, f32::min);
        let room = (base.y - ground).max(0.0);
        let size = if parent.is_none() || -deepest <= room { borne } else { borne * (room / -deepest).max(LEAST) };
        let local: Vec<Vec3> = points.iter().map(|p| *p * size).collect();
        let radii: Vec<f32> = plant.radii(id).iter().map(|radius| radius * size).collect();
        frames.push(Curve::new(&local).frames(frame));
        places.push(local.iter().map(|p| base + frame.to_world(*p)).collect());
        sizes.push(size);
        match parent {
            None => builder.stem(origin, &local, &radii),
            Some(parent) => builder.branch(parent, location, &local, &radii),
        };
    }
    for leaf in plant.leaves() {
        builder.leaf(Leaf { offset: leaf.offset * sizes[leaf.chain.index()], ..*leaf });
    }
    builder.finish().unwrap_or_else(|_| plant.clone())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Rotation;
    use crate::plant::ChainId;

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
    fn a_limb_that_hangs_into_the_ground_ends_on_it_with_all_that_it_bears() {
        let (deep, sources) = (willow(-2.0), [willow(0.5), willow(1.0)]);
        let mended = grounded(deep.clone(), &sources);
        assert!(lowest(&deep) < -1.9 && lowest(&mended).abs() < 0.01, "{}", lowest(&mended));
        let (before, after) = (deep.pose(), mended.pose());
        let points = |posed: &Posed, plant: &Plant, chain: u32| posed.chain(plant, ChainId(chain)).to_vec();
        assert_eq!(points(&before, &deep, 0), points(&after, &mended, 0));
        // Three metres where there were five: as slim and as bent as before, and so is its twig.
        for chain in [1, 2] {
            let [a, b] = [points(&before, &deep, chain), points(&after, &mended, chain)];
            for k in 1..a.len() {
                assert!(((b[k] - b[0]) - (a[k] - a[0]) * 0.6).length() < 1e-3, "{chain} {k}");
            }
            let id = ChainId(chain);
            assert!(deep.radii(id).iter().zip(mended.radii(id)).all(|(a, b)| (a * 0.6 - b).abs() < 1e-5));
        }
        assert_eq!(mended.chain(ChainId(2)).location, deep.chain(ChainId(2)).location);
        assert_eq!((mended.leaves().len(), mended.chains().len()), (1, 3));
    }

    #[test]
    fn only_the_shoot_that_reaches_too_low_is_smaller() {
        let mut builder = PlantBuilder::from_plant(willow(0.5));
        let limb = ChainId(1);
        // Straight down from the end of the limb, whose frame is turned.
        let frame = willow(0.5).pose().frame(limb, 1.0);
        let shoot = builder.branch(limb, 1.0, &[Vec3::ZERO, frame.to_local(Vec3::Y * -2.0)], &[0.01, 0.005]);
        let deep = builder.finish().unwrap();
        let mended = grounded(deep.clone(), &[willow(0.5)]);
        assert!(lowest(&deep) < -1.4 && lowest(&mended).abs() < 0.01, "{}", lowest(&mended));
        assert_eq!(deep.points(limb), mended.points(limb));
        assert!(mended.points(shoot)[1].length() < 0.6);
    }

    #[test]
    fn what_reaches_no_deeper_than_its_sources_stays_as_it_is() {
        assert_eq!(grounded(willow(0.2), &[willow(0.5)]), willow(0.2));
        assert_eq!(grounded(willow(-0.5), &[willow(0.5), willow(-0.6)]), willow(-0.5));
        let less = grounded(willow(-1.5), &[willow(0.5), willow(-0.6)]);
        assert!((lowest(&less) + 0.6).abs() < 0.01, "{}", lowest(&less));
    }

    #[test]
    fn leaves_hang_no_deeper_than_those_of_the_sources() {
        let hung = |size: f32| {
            let mut builder = PlantBuilder::from_plant(willow(0.5));
            for k in 0..8 {
                let turned = Rotation::about(Vec3::X, k as f32 * 0.8);
                builder.leaf(Leaf::new(ChainId(1), 1.0, turned, size, 0));
            }
            builder.finish().unwrap()
        };
        let lowest = |plant: &Plant| lowest_leaf(plant, &plant.pose());
        let deep = hung(2.0);
        let mended = grounded(deep.clone(), &[hung(0.2)]);
        assert!(lowest(&deep) < -1.0 && lowest(&mended) > -0.01, "{} {}", lowest(&deep), lowest(&mended));
        assert!((3..9).contains(&mended.leaves().len()) && mended.chains() == deep.chains());
        assert_eq!(grounded(deep.clone(), &[hung(0.2), deep.clone()]), deep);
    }

    #[test]
    fn what_leaves_a_stem_in_the_ground_is_answered() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::new(0.5, -0.4, 0.0), Vec3::Y * 2.0], &[0.1; 3]);
        builder.branch(stem, 0.1, &[Vec3::ZERO, Vec3::new(0.3, -3.0, 0.0)], &[0.02, 0.01]);
        let deep = builder.finish().unwrap();
        assert!(lowest(&grounded(deep, &[willow(0.5)])) > -1.0);
    }
}
