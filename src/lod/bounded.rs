//! The full level of a plant that has more triangles than it may have (`most` of a preset's `mesh`).
//!
//! This level is seen from near: a leaf whose twig is gone would float. So twigs go with all their leaves, evenly over the
//! crown, once wood is as coarse as may be; leaves that stay are enlarged. Coarser levels go on from what is left, so none
//! has a limb or a leaf that this one has not.

use glam::Vec3;

use super::thin::{Parts, Share, affordable, coarse, finest_within, kept, on_cards, spread};
use crate::base::Seed;
use crate::mesh::{Cards, CrownLight, Mesh, TubeDetail, Wood};
use crate::plant::{ChainId, Leaf, Plant, Posed};
use crate::preset::plan::MeshParams;

/// How coarse wood may get before twigs go, of what coarser levels may be, and steps in search of that.
const COARSE: (f32, usize) = (0.5, 6);
/// The same of stems that are too many triangles alone.
const COARSEST: (f32, usize) = (1.0, 7);
/// How many times what wood may take its whole at its coarsest is, from which on it is as coarse as that.
const FAR_TOO_MUCH: usize = 3;
/// Limbs that have this share of the thickest radius go last.
const THICK: f32 = 0.2;

/// A plant within a budget of triangles: its wood, the leaves that are left, and what they are drawn on.
pub(super) struct Bounded<'a> {
    pub(super) plant: Plant,
    pub(super) bark: Mesh,
    /// Which chains are in it, each with what bears it.
    pub(super) shown: Vec<bool>,
    pub(super) cards: Cards<'a>,
}

/// As much of a plant as it may have triangles for; none where that is all of it.
pub(super) fn bounded<'a>(
    (plant, posed, light): (&Plant, &Posed, &CrownLight),
    params: &MeshParams,
    wood: &Wood<'_>,
    cards: Cards<'a>,
    seed: Seed,
) -> Option<Bounded<'a>> {
    let sides = params.backs.sides();
    let full = [wood.count(&TubeDetail::full(params)), on_cards(&cards, plant.leaves()) * sides];
    let most = params.most as usize;
    if full[0] + full[1] <= most {
        return None;
    }
    let parts = Parts::of(full, Share { of_full: 1.0, most: params.most });
    let at = |c| coarse(params, wood, c);
    let of_stems = |detail: &TubeDetail| {
        let stems = plant.chain_ids().filter(|&id| is_stem(plant, id));
        stems.map(|id| wood.count_of(id, detail)).sum::<usize>()
    };
    let mut detail = finest_within(&|detail| wood.count(detail), parts.wood, COARSE, at);
    // Of what is far too much few chains are left, and those are better many than round.
    if wood.count(&detail) > parts.wood * FAR_TOO_MUCH {
        detail = at(COARSEST.0);
    }
    // Stems are in it in any case, and coarser than limbs would be where there is nothing else for it.
    if of_stems(&detail) > parts.wood {
        detail = finest_within(&of_stems, parts.wood, COARSEST, at);
    }
    // Leaves get simpler before they go.
    let simplest = cards.simplest();
    let of_leaf = |leaf: &Leaf| simplest.triangles(leaf) * sides;
    let shown = shown((plant, posed), (wood, &detail), of_leaf, [parts.wood, most], seed);
    let bark = wood.only(shown.clone()).mesh(light, &detail);
    let left = plant.clone().keep_leaves(|_, leaf| shown[leaf.chain.index()].then_some(*leaf));
    let made = bark.indices.len() / 3;
    let room = if of_stems(&detail) > parts.wood { parts.leaves.of(made) } else { most.saturating_sub(made) };
    let cards = affordable(&left, cards, room / sides);
    let takes = |leaf: &Leaf| cards.triangles(leaf) * sides;
    // Leaves make up for those that went with their twigs, too.
    let grown = (area(plant) / area(&left).max(f32::MIN_POSITIVE)).sqrt();
    let leaves = kept(&left, &left.pose(), (room, &takes), grown, seed).into_iter().map(|card| {
        let leaf = left.leaves()[card.leaf];
        Leaf { size: leaf.size * card.scale, ..leaf }
    });
    let plant = left.clone().with_leaves(leaves.collect());
    Some(Bounded { plant, bark, shown, cards })
}

/// What a plant's leaves cover, square metres times a constant.
fn area(plant: &Plant) -> f32 {
    plant.leaves().iter().map(|leaf| leaf.size * leaf.size * leaf.form.width()).sum()
}

/// The chains that there are triangles for: stems and, as far as half of `most_wood` goes, stout limbs, then those that bear leaves, evenly
/// over the crown, then the others, as far as that goes or `most` with all their leaves.
fn shown(
    (plant, posed): (&Plant, &Posed),
    (wood, detail): (&Wood<'_>, &TubeDetail),
    of_leaf: impl Fn(&Leaf) -> usize,
    [most_wood, most]: [usize; 2],
    seed: Seed,
) -> Vec<bool> {
    let of_wood: Vec<usize> = plant.chain_ids().map(|id| wood.count_of(id, detail)).collect();
    let mut of_leaves = vec![0; of_wood.len()];
    plant.leaves().iter().for_each(|leaf| of_leaves[leaf.chain.index()] += of_leaf(leaf));
    let is_thick = plant.thick(wood.thickest * THICK);
    let middles: Vec<Vec3> = plant.chain_ids().map(|id| middle(posed.chain(plant, id))).collect();
    let mut order = spread(&middles, seed.child("twigs"));
    let id = |chain: usize| ChainId(chain as u32);
    let class = |chain: usize| match (is_stem(plant, id(chain)), is_thick[chain], of_leaves[chain] > 0) {
        (true, ..) => Class::Stem,
        (_, true, _) => Class::Limb,
        (_, _, true) => Class::Leafy,
        _ => Class::Bare,
    };
    order.sort_by_key(|&chain| class(chain));
    let mut shown = vec![false; of_wood.len()];
    let (mut in_wood, mut in_leaves) = (0, 0);
    for chain in order {
        let is_missing = |id: &ChainId| !shown[id.index()];
        let way = std::iter::successors(Some(id(chain)), |id| plant.chain(*id).parent).take_while(is_missing);
        let (mut more_wood, mut more_leaves, mut added) = (in_wood, in_leaves, Vec::new());
        // Given up as soon as it is too much: ways may be as long as a plant is deep.
        let is_enough = way.map(ChainId::index).all(|i| {
            added.push(i);
            (more_wood, more_leaves) = (more_wood + of_wood[i], more_leaves + of_leaves[i]);
            let (is_within, is_all_within) = (more_wood <= most_wood, more_wood + more_leaves <= most);
            match class(chain) {
                Class::Stem => true,
                // Limbs by themselves make no crown, and those that twigs need come with these.
                Class::Limb => more_wood * 2 <= most_wood,
                Class::Leafy => is_within || is_all_within,
                Class::Bare => is_all_within,
            }
        });
        if is_enough {
            (in_wood, in_leaves) = (more_wood, more_leaves);
            added.into_iter().for_each(|i| shown[i] = true);
        }
    }
    shown
}

/// In which order chains come in.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Class {
    Stem,
    Limb,
    Leafy,
    Bare,
}

fn is_stem(plant: &Plant, id: ChainId) -> bool {
    plant.chain(id).parent.is_none()
}

fn middle(points: &[Vec3]) -> Vec3 {
    points.iter().sum::<Vec3>() / points.len().max(1) as f32
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::base::{Rotation, math};
    use crate::lod::mesh_levels;
    use crate::lod::specimen::{crown, on_trunk};
    use crate::lod::twigs::thin_wood;
    use crate::mesh::TreeMesh;
    use crate::plant::{LeafForm, PlantBuilder};
    use crate::preset::plan::{ANY, Backs};

    /// Three hundred leafy twigs, and leafy limbs with bare ones.
    fn plants() -> [Plant; 2] {
        [on_trunk(Vec3::ZERO, (6.0, 0.2), (300, 10)), crown(20, 1.0)]
    }

    /// A stem that winds up, of many rings, with leafy twigs.
    fn winding() -> Plant {
        let mut builder = PlantBuilder::new();
        let at = |i: usize| {
            let (sin, cos) = math::sin_cos(i as f32 * 0.5);
            Vec3::new(0.3 * cos - 0.3, i as f32 * 0.1, 0.3 * sin)
        };
        let stem = builder.stem(Vec3::ZERO, &std::array::from_fn::<_, 60, _>(at), &[0.15; 60]);
        for i in 0..100 {
            let seed = Seed::new(9).at(i);
            let twig = builder.branch(stem, seed.unit(), &[Vec3::ZERO, seed.at(1).direction()], &[0.02, 0.01]);
            for k in 0..6 {
                let seed = seed.at(2 + k);
                let turned = Rotation::about(seed.direction(), seed.at(1).range(0.0, 6.0));
                builder.leaf(Leaf::new(twig, seed.at(2).unit(), turned, 0.3, 0));
            }
        }
        builder.finish().expect("it is sound")
    }

    fn count(mesh: &Mesh) -> usize {
        mesh.indices.len() / 3
    }

    fn chains(mesh: &Mesh) -> BTreeSet<u32> {
        mesh.chains.iter().copied().collect()
    }

    fn params(most: u32) -> MeshParams {
        MeshParams { most, ..MeshParams::told(8, 0.004) }
    }

    fn wood<'a>(plant: &'a Plant, posed: &'a Posed) -> Wood<'a> {
        Wood::of(plant, posed, &TubeDetail::full(&params(ANY)))
    }

    /// A plant within so many triangles, and the chains that its wood is of.
    fn within(tree: (&Plant, &Posed, &CrownLight), wood: &Wood<'_>, most: u32) -> (Bounded<'static>, BTreeSet<u32>) {
        let cards = Cards::of(params(most).leaves, &[]);
        let bound = bounded(tree, &params(most), wood, cards, Seed::new(1)).expect("it has more than that");
        let shown = chains(&bound.bark);
        (bound, shown)
    }

    fn levels(plant: &Plant, most: u32) -> Vec<TreeMesh> {
        let params = MeshParams { backs: Backs::DoubleSided, ..params(most) };
        mesh_levels(plant, &params, &[0.4], Seed::new(1))
    }

    fn triangles(tree: &TreeMesh) -> usize {
        count(&tree.bark) + count(&tree.leaf)
    }

    #[test]
    fn a_full_level_keeps_to_its_budget_and_leaves_cover_what_they_did() {
        for plant in plants() {
            let all = &levels(&plant, ANY)[0];
            for part in [8, 4, 3] {
                let most = triangles(all) as u32 * part / 10;
                let [full, thinned] = &levels(&plant, most)[..] else { panic!("two levels") };
                let made = triangles(full);
                assert!(made <= most as usize && made * 20 > most as usize * 19, "{made} of {most}");
                let share = triangles(thinned) as f32 / made as f32;
                assert!((share - 0.4).abs() < 0.03, "{share}");
                let area = full.leaf.area() / all.leaf.area();
                assert!((area - 1.0).abs() < 0.05, "{area}");
                let has = |p: &Vec3| full.leaf.positions.iter().any(|q| p.distance(*q) < 0.4);
                assert!(thinned.leaf.positions.iter().all(has), "a leaf that the full level has not");
            }
            assert_eq!(&levels(&plant, triangles(all) as u32)[0], all, "who asks for enough changes nothing");
        }
    }

    #[test]
    fn no_budget_that_stems_leave_room_for_is_exceeded() {
        for plant in plants().into_iter().chain([winding()]) {
            for most in (200..1500).step_by(50) {
                let full = &levels(&plant, most)[0];
                let [made, leaves] = [triangles(full), count(&full.leaf)];
                assert!(
                    made <= most as usize && made + 40 > most as usize && leaves > 0,
                    "{made} of {most}, {leaves} of leaves"
                );
            }
        }
    }

    #[test]
    fn leaves_that_take_unlike_numbers_of_triangles_exceed_no_budget() {
        let plant = winding();
        let flat =
            |(i, leaf): (usize, &Leaf)| if i % 3 == 0 { Leaf { form: LeafForm::Flat(1.0), ..*leaf } } else { *leaf };
        let leaves = plant.leaves().iter().enumerate().map(flat).collect();
        let plant = plant.with_leaves(leaves);
        for most in (1000..4000).step_by(7) {
            let made = triangles(&levels(&plant, most)[0]);
            assert!(made <= most as usize, "{made} of {most}");
        }
    }

    #[test]
    fn of_few_triangles_no_limbs_without_leaves_take_what_leaves_need() {
        // Stout bare limbs, and twigs with leaves on some of them.
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 6.0], &[0.3, 0.2]);
        for i in 0..60 {
            let seed = Seed::new(4).at(i);
            let limb = builder.branch(stem, seed.unit(), &[Vec3::ZERO, seed.at(1).direction() * 2.0], &[0.1, 0.08]);
            for k in 0..i % 3 {
                let twig = builder.branch(limb, 0.9, &[Vec3::ZERO, seed.at(2 + k).direction() * 0.5], &[0.01, 0.005]);
                for j in 0..6 {
                    builder.leaf(Leaf::new(twig, j as f32 / 6.0, Rotation::IDENTITY, 0.3, 0));
                }
            }
        }
        let full = &levels(&builder.finish().unwrap(), 400)[0];
        let leaves = count(&full.leaf) as f32 / triangles(full) as f32;
        assert!(triangles(full) <= 400 && leaves > 0.15, "{leaves} of {}", triangles(full));
    }

    #[test]
    fn no_level_has_limbs_that_the_full_level_has_no_triangles_for() {
        let plant = crown(20, 1.0);
        let posed = plant.pose();
        let light = CrownLight::of(&plant, &posed);
        let wood = wood(&plant, &posed);
        let (bound, shown) = within((&plant, &posed, &light), &wood, 800);
        assert!(shown.len() > 1 && shown.len() < plant.chains().len() / 2, "{}", shown.len());
        let fine = wood.only(bound.shown.clone()).mesh(&light, &TubeDetail::full(&params(ANY)));
        assert_eq!(chains(&fine), shown);
        let twigs = thin_wood((&plant, &posed, &bound.shown), &light, f32::MAX).len();
        assert_eq!(twigs, shown.iter().map(|&chain| plant.points(ChainId(chain)).len() - 1).sum::<usize>());
    }

    #[test]
    fn leaves_keep_their_twigs_and_twigs_go_evenly_over_the_crown() {
        let plant = on_trunk(Vec3::ZERO, (6.0, 0.2), (300, 10));
        let posed = plant.pose();
        let light = CrownLight::of(&plant, &posed);
        let (bound, shown) = within((&plant, &posed, &light), &wood(&plant, &posed), 2500);
        assert!((30..200).contains(&shown.len()), "{}", shown.len());
        assert!(bound.plant.leaves().len() > 100);
        assert!(bound.plant.leaves().iter().all(|leaf| shown.contains(&leaf.chain.0)));
        for side in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z] {
            let here = |&&chain: &&u32| middle(posed.chain(&plant, ChainId(chain))).dot(side) > 0.0;
            let share = shown.iter().filter(here).count() as f32 / shown.len() as f32;
            assert!((share - 0.5).abs() < 0.12, "{side}: {share}");
        }
    }
}
