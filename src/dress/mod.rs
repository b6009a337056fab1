//! Dressing: twigs and leaves for a bare plant (Wang et al. 2017, TVCG, 4.3 "Foliage").
//!
//! Leaf points are seeded in the crown, twigs grow towards them from the thin wood by space colonization (Runions et al.
//! 2007), and leaves sit along the twigs. Where twigs stand does not depend on the density; the density takes leaves
//! from one fixed order of sites. So raising it moves no branch, twig or leaf, it adds.

mod attract;
mod colonize;
mod foliage;
mod lattice;
mod reach;
mod refit;
mod room;
mod seek;
mod thin;
mod twig;

pub(crate) use refit::{length, refit, shown};
pub use thin::thin;

use crate::base::Seed;
use crate::plant::Plant;
use crate::preset::plan::DressParams;
use crate::source::grow::Obstacles;
use room::Room;

/// The plant with twigs and leaves. Its own chains keep their ids, twigs come after them.
///
/// A plant that has leaves already (imported ones) keeps them and gets nothing; [`thin`] makes them fewer or more. So does one without length. Linear in
/// points and leaves but for a sort of the leaves.
#[must_use]
pub fn dress(plant: &Plant, params: &DressParams, seed: Seed) -> Plant {
    dress_among(plant, params, &Obstacles::default(), seed)
}

/// As [`dress`], beside obstacles in metres: no twig and no leaf reaches into one, and twigs keep their clearance. Where
/// there are none, or all are far away, the same bytes.
#[must_use]
pub fn dress_among(plant: &Plant, params: &DressParams, obstacles: &Obstacles, seed: Seed) -> Plant {
    if !plant.leaves().is_empty() || plant.chains().is_empty() || params.most_leaves == 0 || params.density <= 0.0 {
        return plant.clone();
    }
    let posed = plant.pose();
    let room = Room::among(obstacles);
    let Some(wood) = twig::Wood::of(plant, &posed, params) else { return plant.clone() };
    if params.twig_length <= 0.0 {
        return foliage::add(plant, plant.clone(), (&wood, room), params, seed.child("leaves"));
    }
    let mut points = attract::leaf_points(&wood, seed.child("points"));
    points.retain(|p| room.has(*p));
    let shoots = colonize::colonize(&wood, &points, room, seed.child("twigs"));
    let twiggy = twig::add(plant, &posed, &wood, &shoots);
    foliage::add(plant, twiggy, (&wood, room), params, seed.child("leaves"))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::math;
    use crate::plant::{PlantBuilder, dump};
    use crate::preset::plan::Phyllotaxis;

    pub(super) fn params() -> DressParams {
        DressParams {
            density: 1.0,
            most_leaves: 20_000,
            leaf_size: 0.3,
            leaf_spread: 0.2,
            leaf_angle: 0.9,
            twig_length: 0.5,
            phyllotaxis: Phyllotaxis::Spiral,
            droop: 0.2,
            pictures: 3,
            leaf_share: 1.0 / 15.0,
        }
    }

    /// A trunk of `height` metres with limbs all round its upper half.
    pub(super) fn tree(height: f32, limbs: u64) -> Plant {
        let mut builder = PlantBuilder::new();
        let h = height;
        let stem = builder.stem(
            Vec3::ZERO,
            &[Vec3::ZERO, Vec3::Y * (h * 0.5), Vec3::Y * h],
            &[h * 0.02, h * 0.015, h * 0.001],
        );
        for i in 0..limbs {
            let s = Seed::new(5).at(i);
            let out = Vec3::new(s.direction().x, 0.35, s.direction().z).normalize() * (h * 0.25);
            let location = 0.4 + 0.55 * s.at(9).unit();
            builder.branch(stem, location, &[Vec3::ZERO, out * 0.5, out], &[h * 0.006, h * 0.003, h * 0.001]);
        }
        builder.finish().unwrap()
    }

    #[test]
    fn the_plants_own_chains_stay_what_they_were() {
        let bare = tree(8.0, 12);
        let leafy = dress(&bare, &params(), Seed::new(1));
        assert!(leafy.chains().len() > bare.chains().len() && leafy.leaves().len() > 100);
        for id in bare.chain_ids() {
            assert_eq!(bare.points(id), leafy.points(id));
            assert_eq!(bare.radii(id), leafy.radii(id));
            assert_eq!(
                (bare.chain(id).parent, bare.chain(id).location),
                (leafy.chain(id).parent, leafy.chain(id).location)
            );
        }
    }

    #[test]
    fn stubs_on_a_bole_are_no_crown() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 20.0], &[0.1, 0.02]);
        builder.branch(stem, 0.4, &[Vec3::ZERO, Vec3::X * 0.2], &[0.04, 0.03]);
        let pole = builder.clone().finish().unwrap();
        for k in 0..8_u8 {
            let (sin, cos) = math::sin_cos(f32::from(k) * 2.4);
            let side = Vec3::new(cos, 0.3, sin) * 2.0;
            builder.branch(stem, 0.8 + 0.02 * f32::from(k), &[Vec3::ZERO, side], &[0.02, 0.005]);
        }
        for (plant, base) in [(pole, 9.5), (builder.finish().unwrap(), 12.0)] {
            let leafy = dress(&plant, &params(), Seed::new(1));
            let posed = leafy.pose();
            let lowest = leafy.leaves().iter().map(|leaf| posed.leaf(&leafy, leaf).position.y).fold(f32::MAX, f32::min);
            assert!(leafy.leaves().len() > 100 && lowest > base, "{} leaves from {lowest} m up", leafy.leaves().len());
        }
    }

    #[test]
    fn raising_the_density_only_adds() {
        let bare = tree(8.0, 12);
        let places = |density: f32| {
            let plant = dress(&bare, &DressParams { density, ..params() }, Seed::new(1));
            let posed = plant.pose();
            let mut places: Vec<[u32; 3]> = plant
                .leaves()
                .iter()
                .map(|l| {
                    (posed.leaf(&plant, l).position + posed.leaf(&plant, l).frame.y * l.size)
                        .to_array()
                        .map(f32::to_bits)
                })
                .collect();
            places.sort_unstable();
            places
        };
        let (few, many) = (places(0.3), places(0.9));
        assert!(few.len() * 2 < many.len(), "{} {}", few.len(), many.len());
        assert!(few.iter().all(|p| many.binary_search(p).is_ok()));
    }

    /// The lowest and the highest that leaves reach.
    fn reach(plant: &Plant) -> (f32, f32) {
        let posed = plant.pose();
        plant.leaves().iter().fold((f32::MAX, f32::MIN), |(low, high), leaf| {
            let pose = posed.leaf(plant, leaf);
            let (along, across) = (pose.frame.y.y * leaf.size, pose.frame.x.y.abs() * leaf.size * 0.5);
            let [bottom, top] = [f32::min, f32::max].map(|of| of(pose.position.y, pose.position.y + along));
            (low.min(bottom - across), high.max(top))
        })
    }

    #[test]
    fn leaves_stay_above_the_ground_and_hardly_above_the_wood() {
        let mut builder = PlantBuilder::from_plant(tree(4.0, 12));
        // A stem may dip into the ground: leaves don't.
        builder.stem(
            Vec3::X * 0.2,
            &[Vec3::ZERO, Vec3::new(0.2, -0.4, 0.0), Vec3::new(0.6, 0.9, 0.0)],
            &[0.1, 0.1, 0.05],
        );
        for i in 0..24 {
            let s = Seed::new(6).at(i);
            let out = Vec3::new(s.direction().x, 0.0, s.direction().z).normalize() * 1.5;
            let points = [Vec3::ZERO, out, out * 1.2 - Vec3::Y * 0.25];
            builder.branch(crate::plant::ChainId(0), 0.08, &points, &[0.02, 0.01, 0.004]);
        }
        let low = dress(&builder.finish().unwrap(), &DressParams { droop: 0.8, ..params() }, Seed::new(1));
        assert!(low.leaves().len() > 300 && reach(&low).0 >= -1e-3, "{:?}", reach(&low));
        // Twigs go with the leaves that would hang into the ground.
        let mut bears = vec![false; low.chains().len()];
        low.leaves().iter().for_each(|leaf| bears[leaf.chain.index()] = true);
        low.chains().iter().filter_map(|chain| chain.parent).for_each(|parent| bears[parent.index()] = true);
        assert!(bears[1 + 12 + 24..].iter().all(|bears| *bears));
        // Few limbs: the foliage makes the crown, and swells far beyond them. A leaf's length more, and a step of a twig.
        let bare = tree(8.0, 6);
        let top = bare.pose().positions().iter().fold(0.0_f32, |top, p| top.max(p.y));
        let sparse = dress(&bare, &params(), Seed::new(1));
        assert!(reach(&sparse).1 < top * (1.0 + twig::OVER) + 0.3 * 1.2, "{:?}, {top}", reach(&sparse));
    }

    #[test]
    fn every_limb_that_ends_in_the_air_has_leaves_at_its_end_however_thick_it_is() {
        let mut builder = PlantBuilder::from_plant(tree(8.0, 90));
        let thick: Vec<_> = (0..6)
            .map(|i| {
                let (sin, cos) = crate::base::math::sin_cos(i as f32);
                let out = Vec3::new(cos, 0.6, sin) * 2.0;
                builder.branch(crate::plant::ChainId(0), 0.5, &[Vec3::ZERO, out * 0.5, out], &[0.15, 0.14, 0.13])
            })
            .collect();
        // What goes on is no end.
        let on = builder.branch(thick[0], 1.0, &[Vec3::ZERO, Vec3::Y], &[0.05, 0.01]);
        let bare = builder.finish().unwrap();
        let plant = dress(&bare, &params(), Seed::new(1));
        let on_limb = |limb: crate::plant::ChainId| {
            let is_twig = |chain: crate::plant::ChainId| chain.index() >= bare.chains().len();
            let bears = |leaf: &&crate::plant::Leaf| {
                leaf.chain == limb || (is_twig(leaf.chain) && plant.chain(leaf.chain).parent == Some(limb))
            };
            plant.leaves().iter().filter(bears).count()
        };
        assert!(thick[1..].iter().all(|limb| on_limb(*limb) > 0) && on_limb(on) > 0);
        assert_eq!(on_limb(thick[0]), 0);
    }

    #[test]
    fn leaf_area_follows_the_crown_at_every_size() {
        for (height, limbs) in [(3.7, 20), (8.0, 20), (17.0, 4)] {
            let plant = dress(&tree(height, limbs), &params(), Seed::new(2));
            let area: f32 = plant.leaves().iter().map(|l| l.size * l.size).sum();
            // The bare limbs span a disc of half the height.
            let disc = std::f32::consts::PI * (height * 0.25) * (height * 0.25);
            assert!(area > disc * 2.0 && area < disc * 40.0, "{height}: {area} over {disc}");
        }
    }

    #[test]
    fn capped_leaves_grow_up_to_twice_their_size() {
        let bare = tree(8.0, 12);
        let plant = dress(&bare, &DressParams { most_leaves: 50, leaf_spread: 0.0, ..params() }, Seed::new(1));
        assert_eq!(plant.leaves().len(), 50);
        assert!(plant.leaves().iter().all(|l| (l.size - 0.6).abs() < 1e-5));
    }

    #[test]
    fn foliage_keeps_to_the_wood() {
        let bare = tree(8.0, 3);
        let plant = dress(&bare, &params(), Seed::new(1));
        let (posed, wood) = (plant.pose(), bare.pose());
        for leaf in plant.leaves() {
            let p = posed.leaf(&plant, leaf).position;
            // Against the axes, finely sampled.
            let nearest = bare
                .chain_ids()
                .flat_map(|id| (0..=40).map(move |k| (id, k as f32 / 40.0)))
                .map(|(id, t)| wood.at(&bare, id, t).position.distance(p))
                .fold(f32::MAX, f32::min);
            assert!(nearest < 3.0, "{nearest}");
            assert!(p.y > 8.0 * 0.2);
        }
    }

    #[test]
    fn without_twigs_the_limbs_bear_leaves_in_two_level_rows() {
        let bare = tree(8.0, 12);
        let frond = DressParams {
            twig_length: 0.0,
            phyllotaxis: Phyllotaxis::Distichous,
            droop: 0.0,
            density: 4.0,
            ..params()
        };
        let plant = dress(&bare, &frond, Seed::new(1));
        assert_eq!(plant.chains().len(), bare.chains().len());
        let posed = plant.pose();
        let (mut left, mut right) = (0, 0);
        for leaf in plant.leaves().iter().filter(|leaf| leaf.location < 1.0) {
            let axis = posed.at(&plant, leaf.chain, leaf.location).frame.y;
            let side = axis.cross(Vec3::Y);
            if side.length() < 0.5 {
                continue;
            }
            let frame = posed.leaf(&plant, leaf).frame;
            // Between twig and level, nothing up or down; its face up.
            let across = frame.y.dot(side.normalize());
            let off = frame.y - axis * frame.y.dot(axis) - side.normalize() * across;
            assert!(off.length() < 1e-3 && across.abs() > 0.5, "{off} {across}");
            assert!(frame.z.y > 0.3, "{}", frame.z);
            *if across > 0.0 { &mut right } else { &mut left } += 1;
        }
        assert!(left > 50 && right > 50 && left * 5 > right * 4 && right * 5 > left * 4, "{left} {right}");
        assert!(plant.leaves().iter().all(|l| l.size <= 0.6 * 1.2));
    }

    #[test]
    fn fronds_that_lose_leaves_have_no_gaps_and_keep_their_tips() {
        let bare = tree(8.0, 12);
        let frond = |density: f32| DressParams {
            twig_length: 0.0,
            phyllotaxis: Phyllotaxis::Distichous,
            leaf_size: 0.1,
            density,
            ..params()
        };
        let locations = |density: f32, chain: u32| {
            let plant = dress(&bare, &frond(density), Seed::new(1));
            let own = plant.leaves().iter().filter(|leaf| leaf.chain.0 == chain);
            let mut all: Vec<f32> = own.map(|leaf| leaf.location).collect();
            all.sort_unstable_by(f32::total_cmp);
            all
        };
        for chain in 1..=12 {
            let (some, all) = (locations(0.15, chain), locations(9.0, chain));
            assert!(some.len() * 3 < all.len() * 2 && some.len() > 9, "{} of {}", some.len(), all.len());
            assert_eq!(some[some.len() - 1], 1.0);
            let widest = some.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0_f32, f32::max);
            let mean = (1.0 - some[0]) / (some.len() - 1) as f32;
            // Leaves go by pairs, and stand farther apart where they are larger.
            assert!(widest < 3.6 * 1.36 * mean, "{chain}: {widest} {mean}");
        }
    }

    #[test]
    fn leaves_of_a_frond_stand_as_close_to_each_other_as_they_are_long_up_to_its_end() {
        let bare = tree(8.0, 6);
        let rows = DressParams {
            twig_length: 0.0,
            phyllotaxis: Phyllotaxis::Distichous,
            leaf_spread: 0.0,
            leaf_size: 0.2,
            density: 9.0,
            ..params()
        };
        let plant = dress(&bare, &rows, Seed::new(1));
        for chain in 1..=6 {
            let mut own: Vec<(f32, f32)> =
                plant.leaves().iter().filter(|l| l.chain.0 == chain).map(|l| (l.location, l.size)).collect();
            own.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            let gaps: Vec<f32> = own.windows(2).map(|pair| (pair[1].0 - pair[0].0) / pair[0].1).collect();
            let (least, most) = gaps.iter().fold((f32::MAX, 0.0_f32), |(low, high), g| (low.min(*g), high.max(*g)));
            assert!(gaps.len() > 15 && most < least * 1.2, "{chain}: {least} {most}");
            assert!(own[own.len() - 1].1 < own[0].1 * 0.5);
        }
    }

    #[test]
    fn what_a_leader_bears_at_its_tip_stands_up() {
        // Level limbs, below its tip.
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0, Vec3::Y * 8.0], &[0.16, 0.1, 0.008]);
        for i in 0..16 {
            let (sin, cos) = crate::base::math::sin_cos(i as f32 * 2.4);
            let out = Vec3::new(cos, 0.0, sin) * (2.4 - 0.12 * i as f32);
            builder.branch(stem, 0.3 + 0.04 * i as f32, &[Vec3::ZERO, out * 0.5, out], &[0.05, 0.03, 0.008]);
        }
        let bare = builder.finish().unwrap();
        let plant = dress(&bare, &DressParams { droop: 0.8, ..params() }, Seed::new(1));
        let posed = plant.pose();
        let at_tip = plant.leaves().iter().filter(|leaf| leaf.chain.0 == 0 && leaf.location > 0.97);
        let up: Vec<f32> = at_tip.map(|leaf| posed.leaf(&plant, leaf).frame.y.y).collect();
        assert!(up.len() > 1 && up.iter().all(|up| *up > 0.85), "{up:?}");
    }

    #[test]
    fn few_leaves_in_rows_stand_all_round_the_crown() {
        let bare = tree(8.0, 90);
        let few = DressParams { twig_length: 0.0, phyllotaxis: Phyllotaxis::Distichous, most_leaves: 40, ..params() };
        let plant = dress(&bare, &few, Seed::new(1));
        let mut thirds = [0; 3];
        plant.leaves().iter().for_each(|leaf| thirds[(leaf.chain.index() * 3 / bare.chains().len()).min(2)] += 1);
        assert!(thirds.iter().all(|&leaves| leaves >= 5), "{thirds:?}");
    }

    #[test]
    fn leaves_that_a_plant_brings_are_all_it_gets() {
        let once = dress(&tree(5.0, 6), &params(), Seed::new(1));
        assert_eq!(dress(&once, &params(), Seed::new(2)), once);
    }

    #[test]
    fn the_same_plant_and_seed_give_the_same_leaves() {
        let bare = tree(5.0, 6);
        let (a, b) = (dress(&bare, &params(), Seed::new(1)), dress(&bare, &params(), Seed::new(1)));
        assert_eq!(dump(&a), dump(&b));
        assert!(a != dress(&bare, &params(), Seed::new(2)));
    }

    #[test]
    fn wild_parameters_and_plants_break_nothing() {
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::ZERO], &[0.0, 0.0]);
        let point = builder.finish().unwrap();
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y, Vec3::Y], &[0.0; 3]);
        builder.branch(stem, 1.0, &[Vec3::ZERO, Vec3::ZERO], &[3.0, 0.0]);
        let odd = builder.finish().unwrap();
        for plant in [point, odd, tree(2.0, 1), tree(90.0, 2), Plant::default()] {
            for (leaf_size, twig_length, density, pictures) in
                [(1e-6, 1e-6, 1.0, 0), (50.0, 80.0, 9.0, 1), (0.0, 0.0, 1.0, 1)]
            {
                let wild = DressParams { leaf_size, twig_length, density, pictures, most_leaves: 3000, ..params() };
                let leafy = dress(&plant, &wild, Seed::new(1));
                assert!(leafy.leaves().len() <= 3000);
            }
        }
    }
}
