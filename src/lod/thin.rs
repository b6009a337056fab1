//! Thinning: fewer rings and sides of wood, fewer and larger leaves.
//!
//! Leaves go in a fixed seeded order: one that is kept at 40 % is kept at 50 % too. Those that stay are enlarged so that
//! the area stays, at most to twice the size; beyond that they read as balloons. Edges of leaves are never collapsed.

use glam::Vec3;

use super::agree::Outlines;
use super::cloud::Scene;
use super::secant::Secant;
use crate::bake::Cutout;
use crate::base::Seed;
use crate::mesh::{Cards, CrownLight, LeafCard, Mesh, NO_CHAIN, TreeMesh, TubeDetail, Wood, leaf_cards_in};
use crate::plant::{Leaf, Plant, Posed};
use crate::preset::plan::MeshParams;

/// Most that a leaf is enlarged by.
pub(super) const LARGEST: f32 = 2.0;
/// How many times as large as most leaves one is that goes last.
const FAR_LARGER: f32 = 6.0;
/// Least share of the triangles that leaves are asked to have which they do have, whatever the wood takes.
const LEAST_LEAVES: f32 = 0.5;
/// How often what is left of a thinned tree is made larger by what is covered, and by how much it is at most, of leafy
/// trees and of those whose wood is seen.
const GROWN_LEAVES: (u32, f32) = (1, 1.2);
const GROWN_WOOD: (u32, f32) = (4, 2.0);
/// Which part of a level's triangles may stay unused.
const SPARE: usize = 20;
/// Steps in search of the wood's detail, of plants with leaves and of those that are wood only.
const STEPS: (usize, usize) = (4, 8);

/// Adds all of `part` to `mesh`; its vertices take their coordinates from `tile`.
pub(super) fn append(mesh: &mut Mesh, part: &Mesh, tile: u32) {
    let first = mesh.positions.len();
    mesh.append(part);
    let all = mesh.positions.len();
    mesh.tiles.truncate(first);
    mesh.tiles.resize(all, tile);
    mesh.chains.truncate(first);
    mesh.chains.resize(all, NO_CHAIN);
}

/// What a thinned level may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Share {
    /// Of the full level's triangles, 0..=1.
    pub(super) of_full: f32,
    /// Triangles, whatever the share is.
    pub(super) most: u32,
}

impl From<f32> for Share {
    fn from(of_full: f32) -> Self {
        Self { of_full, most: u32::MAX }
    }
}

/// A level of about a share of the full level's triangles, whose leaves are drawn on `cards`; its own are on simpler ones
/// where nearly all leaves fit on those only. Leaves are as large as the area asks for, times `grown`; wood that is seen
/// covers as many times as much.
pub(super) fn thinned(scene: &Scene<'_>, cards: Cards<'_>, share: Share, grown: f32, seed: Seed) -> TreeMesh {
    let count = |m: &Mesh| m.indices.len() / 3;
    // A leaf whose back is of triangles of its own is paid for twice.
    let sides = scene.params.backs.sides();
    let all = [count(&scene.full.bark), count(&scene.full.leaf) * sides];
    let Parts { wood, leaves } = Parts::of(all, share);
    let widened = 1.0 + (grown - 1.0) * scene.wood.bare;
    let of_wood = |most| coarse_wood((scene.plant, scene.light), scene.params, scene.wood, most, widened);
    let mut bark = of_wood(wood);
    // A tree of one leaf keeps it.
    let first = scene.plant.leaves().first().map_or(0, |leaf| cards.simplest().triangles(leaf));
    let room = (leaves.of(count(&bark)) / sides).max(first);
    let cards = affordable(scene.plant, cards, room);
    let kept = kept(scene.plant, scene.posed, (room, &|leaf| cards.triangles(leaf)), grown, seed);
    // All leaves may be on simple cards before their triangles are used up: what is left is the wood's.
    let used: usize = kept.iter().map(|card| cards.triangles(&scene.plant.leaves()[card.leaf])).sum();
    let spare = leaves.all.saturating_sub(used * sides + count(&bark));
    if !kept.is_empty() && spare * SPARE > leaves.all {
        bark = of_wood((count(&bark) + spare).min(all[0]));
    }
    TreeMesh { leaf: leaf_cards_in(scene.plant, scene.posed, scene.light, &kept, cards), bark }
}

/// How the triangles of a level are shared.
pub(super) struct Parts {
    /// Most of the wood.
    pub(super) wood: usize,
    pub(super) leaves: Room,
}

/// Triangles for leaves: what wood leaves of all, and some in any case.
pub(super) struct Room {
    all: usize,
    least: usize,
}

impl Room {
    pub(super) const fn of(&self, wood: usize) -> usize {
        let left = self.all.saturating_sub(wood);
        if left > self.least { left } else { self.least }
    }
}

impl Parts {
    /// Of wood and leaves that have so many triangles in all.
    pub(super) fn of([wood, leaves]: [usize; 2], Share { of_full, most }: Share) -> Self {
        let total = wood + leaves;
        let share = of_full.clamp(0.0, 1.0).min(most as f32 / total.max(1) as f32);
        let all = ((total as f32 * share) as usize).min(most as usize);
        let wood = if leaves > 0 { (wood as f32 * share) as usize } else { all };
        // Wood of many stems can't be thinned as far as is asked. A crown that paid for all of that would be gone.
        Self { wood, leaves: Room { all, least: (leaves as f32 * share * LEAST_LEAVES) as usize } }
    }
}

/// Triangles of leaves on cards.
pub(super) fn on_cards(cards: &Cards<'_>, leaves: &[Leaf]) -> usize {
    leaves.iter().map(|leaf| cards.triangles(leaf)).sum()
}

/// The cards on which nearly all leaves fit into so many triangles, or the simplest.
pub(super) fn affordable<'a>(plant: &Plant, mut cards: Cards<'a>, room: usize) -> Cards<'a> {
    let mut all = on_cards(&cards, plant.leaves());
    while room < all * 4 / 5
        && let Some(simpler) = cards.simpler()
    {
        (cards, all) = (simpler, on_cards(&simpler, plant.leaves()));
    }
    cards
}

/// As [`thinned`], as large as it must be to cover what the full tree does. `outlines` are that one's, `worn` cuts leaves
/// out. Fewer, larger leaves hide each other less or more: once more, by what is covered. Wood by secant steps.
pub(super) fn thinned_as_seen(
    scene: &Scene<'_>,
    cards: Cards<'_>,
    share: Share,
    (outlines, worn): (&Outlines, &[&Cutout]),
    seed: Seed,
) -> TreeMesh {
    let at = |grown: f32| thinned(scene, cards, share, grown, seed);
    let (mut grown, mut made) = (1.0_f32, at(1.0));
    let (rounds, most) = if scene.wood.bare > 0.0 { GROWN_WOOD } else { GROWN_LEAVES };
    let mut search: Option<Secant> = None;
    for _ in 0..rounds {
        let covered = outlines.ratio_of_some(&made, worn);
        if (covered - 1.0).abs() <= 0.008 {
            break;
        }
        // At first as if it grew as what is covered does.
        let search = search.get_or_insert_with(|| Secant::new(covered.max(0.5), 0.2..=2.0, 0.85..=most));
        let next = search.next(grown, covered - 1.0);
        if next == grown {
            break;
        }
        grown = next;
        made = at(grown);
    }
    made
}

/// The first leaves in the fixed order that there is room for, by what each takes of it, enlarged. Those that are far larger than
/// most come first: of a few fronds among leaves each is seen to go.
pub(super) fn kept(
    plant: &Plant,
    posed: &Posed,
    (room, takes): (usize, &dyn Fn(&Leaf) -> usize),
    grown: f32,
    seed: Seed,
) -> Vec<LeafCard> {
    let leaves = plant.leaves();
    let places: Vec<Vec3> = posed.leaves(plant).iter().map(|pose| pose.position).collect();
    let mut order = spread(&places, seed.child("thin"));
    let areas: Vec<f32> = leaves.iter().map(|leaf| leaf.size * leaf.size * leaf.form.width()).collect();
    let mut sorted = areas.clone();
    let middle = sorted.len() / 2;
    let usual = if sorted.is_empty() { 0.0 } else { *sorted.select_nth_unstable_by(middle, f32::total_cmp).1 };
    let is_usual = |leaf: usize| areas[leaf] <= usual * FAR_LARGER;
    if !(0..leaves.len()).all(is_usual) {
        order.sort_by_key(|&leaf| is_usual(leaf));
    }
    let mut taken = 0;
    let fit = |leaf: &&usize| {
        taken += takes(&leaves[**leaf]);
        taken <= room
    };
    order.truncate(order.iter().take_while(fit).count());
    // Vertices stay in the order of the plant.
    order.sort_unstable();
    let sum = |leaves: &mut dyn Iterator<Item = usize>| leaves.map(|leaf| f64::from(areas[leaf])).sum::<f64>();
    let (all, left) = (sum(&mut (0..leaves.len())), sum(&mut order.iter().copied()));
    let scale = if left > 0.0 { ((all / left).sqrt() as f32 * grown).clamp(0.8, LARGEST) } else { 1.0 };
    order.into_iter().map(|leaf| LeafCard { leaf, scale }).collect()
}

/// Places in an order whose every beginning is spread evenly over all: along a curve through space (Morton 1966), each half
/// before its quarters (van der Corput 1935). Leaves that are drawn by lot leave gaps and heaps, and those are what is seen
/// of a thinned crown.
pub(super) fn spread(places: &[Vec3], seed: Seed) -> Vec<usize> {
    let (low, high) = places.iter().fold((Vec3::MAX, Vec3::MIN), |(l, h), &p| (l.min(p), h.max(p)));
    let whole = (high - low).max_element().max(1e-6);
    let code = |p: Vec3| {
        let cell = (p - low) / whole * 1023.0;
        spaced(cell.x as u32) | spaced(cell.y as u32) << 1 | spaced(cell.z as u32) << 2
    };
    let mut curve: Vec<(u32, u32)> = (0..).zip(places).map(|(i, &place)| (code(place), i)).collect();
    curve.sort_unstable();
    // Places whose bits, the lowest first, are those of 0, 1, 2, ..., some of them turned.
    let bits = usize::BITS - curve.len().leading_zeros();
    let turn = (seed.bits() as u32).checked_shr(32 - bits).unwrap_or(0);
    let place = |k: u32| ((k ^ turn) as u64).reverse_bits().checked_shr(64 - bits).unwrap_or(0) as usize;
    (0..1_u32 << bits).filter_map(|k| curve.get(place(k))).map(|&(_, i)| i as usize).collect()
}

/// The ten lowest bits of a number, two clear ones between each and the next.
const fn spaced(v: u32) -> u32 {
    let v = v & 0x3ff;
    let v = (v | v << 16) & 0x0300_00ff;
    let v = (v | v << 8) & 0x0300_f00f;
    let v = (v | v << 4) & 0x030c_30c3;
    (v | v << 2) & 0x0924_9249
}

/// The finest wood of at most `budget` triangles. It is thicker by what covers `grown` times as much, all wood by as many
/// metres: twigs make up for those that are gone, and a trunk keeps its girth.
fn coarse_wood(
    (plant, light): (&Plant, &CrownLight),
    params: &MeshParams,
    wood: &Wood<'_>,
    budget: usize,
    grown: f32,
) -> Mesh {
    let detail = coarse_detail(plant, params, wood, budget);
    let added = if grown > 1.0 { (grown - 1.0) * wood.mean_radius(&detail) } else { 0.0 };
    wood.mesh(light, &TubeDetail { added, ..detail })
}

/// How wood is meshed in at most `budget` triangles, as finely as bisection finds; coarsest where even that has more.
fn coarse_detail(plant: &Plant, params: &MeshParams, wood: &Wood<'_>, budget: usize) -> TubeDetail {
    // Twigs are all that is seen of a bare crown: they go last.
    let dropped = |coarse: f32| coarse * coarse * (1.0 + wood.bare * (coarse * coarse - 1.0));
    let steps = if plant.leaves().is_empty() { STEPS.1 } else { STEPS.0 };
    let thickest = wood.thickest;
    let at = |c: f32| TubeDetail { min_radius: thickest * 0.35 * dropped(c), ..coarse(params, wood, c) };
    finest_within(&|detail| wood.count(detail), budget, (1.0, steps), at)
}

/// Of details that get coarser from 0 to `most`, the finest by which there are no more than `budget` triangles, as bisection
/// finds it; the coarsest where even that has more.
pub(super) fn finest_within(
    count: &dyn Fn(&TubeDetail) -> usize,
    budget: usize,
    (most, steps): (f32, usize),
    at: impl Fn(f32) -> TubeDetail,
) -> TubeDetail {
    let (mut fine, mut coarse) = (0.0_f32, most);
    for _ in 0..steps {
        let middle = (fine + coarse) * 0.5;
        if count(&at(middle)) <= budget {
            coarse = middle;
        } else {
            fine = middle;
        }
    }
    at(coarse)
}

/// Wood with all its chains, `coarse` of 0 to 1.
pub(super) fn coarse(params: &MeshParams, wood: &Wood<'_>, coarse: f32) -> TubeDetail {
    // Girths are seen of a bare crown: it loses rings before sides.
    let flattened = 0.75 * (1.0 - wood.bare);
    TubeDetail {
        sides: ((params.sides as f32 * (1.0 - flattened * coarse)) as u32).max(3),
        error: params.error.max(wood.thickest * 0.005) * (1.0 + 24.0 * coarse * coarse),
        ..TubeDetail::full(params)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::bake::Maps;
    use crate::base::Rotation;
    use crate::lod::specimen::crown;
    use crate::lod::{Asked, Ladder, Reference, Wardrobe, ladder, palette};
    use crate::plant::PlantBuilder;
    use crate::preset::plan::{LeafCards, Lod};

    fn plain() -> Maps {
        Maps {
            width: 1,
            height: 1,
            color: vec![[90, 80, 70, 255]],
            normal: vec![[128, 128, 255]],
            orm: vec![[255, 200, 0]],
        }
    }

    fn climbed(plant: &Plant, lods: &[Lod]) -> Ladder {
        let params = MeshParams { leaves: LeafCards::Flat, ..MeshParams::told(8, 0.004) };
        let plain = plain();
        let lods: Vec<_> = lods.iter().cloned().map(Into::into).collect();
        ladder(plant, &params, &lods, std::slice::from_ref(&plain), &plain, Seed::new(1))
    }

    #[test]
    fn what_is_left_of_a_bare_crown_covers_what_all_did_and_the_trunk_keeps_its_girth() {
        let levels = climbed(&crown(0, 1.0), &[Lod::Full, Lod::thinned(0.3)]).levels;
        let [full, thinned] = [0, 1].map(|level: usize| &levels[level]);
        assert!(thinned.triangles * 10 < full.triangles * 4, "{} of {}", thinned.triangles, full.triangles);
        let coverage = thinned.measured.coverage;
        assert!((coverage - 1.0).abs() < 0.02, "{coverage}");
        let girth = |mesh: &Mesh| {
            let of_trunk = |(p, chain): (&Vec3, &u32)| {
                if *chain == 0 && p.y > 0.5 { Vec3::new(p.x, 0.0, p.z).length() } else { 0.0 }
            };
            mesh.positions.iter().zip(&mesh.chains).map(of_trunk).fold(0.0, f32::max)
        };
        let (before, after) = (girth(&full.mesh.bark), girth(&thinned.mesh.bark));
        assert!((after / before - 1.0).abs() < 0.12, "{before} {after}");
        let sides = |mesh: &Mesh| {
            let trunk = || mesh.positions.iter().zip(&mesh.chains).filter(|v| *v.1 == 0).map(|v| v.0.y);
            let lowest = trunk().fold(f32::MAX, f32::min);
            trunk().filter(|y| y - lowest < 1e-3).count()
        };
        let (before, after) = (sides(&full.mesh.bark), sides(&thinned.mesh.bark));
        assert_eq!(after, before, "girths are what is seen of a bare crown");
    }

    #[test]
    fn levels_of_trees_with_few_leaves_or_none_cover_what_the_full_ones_do() {
        let lods = [Lod::Full, Lod::thinned(0.4), Lod::BillboardCloud { cards: 24 }];
        for leaves in [0, 1, 3] {
            for level in climbed(&crown(leaves, 1.0), &lods).levels {
                let coverage = level.measured.coverage;
                assert!((coverage - 1.0).abs() < 0.03, "{leaves} leaves a limb, {:?}: {coverage}", level.kind);
            }
        }
    }

    #[test]
    fn a_tree_of_one_leaf_keeps_it() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y], &[0.02, 0.01]);
        builder.leaf(Leaf::new(stem, 1.0, Rotation::about(Vec3::Z, 0.4), 0.4, 0));
        for share in [0.1, 0.3, 0.6] {
            let levels = climbed(&builder.clone().finish().unwrap(), &[Lod::Full, Lod::thinned(share)]).levels;
            assert!(!levels[1].mesh.leaf.indices.is_empty(), "{share}");
        }
    }

    #[test]
    fn of_leaves_those_that_are_far_larger_go_last_and_no_more_stay_than_there_is_room_for() {
        let plant = crown(6, 1.0);
        let leaves: Vec<Leaf> = (0..)
            .zip(plant.leaves())
            .map(|(i, leaf)| if i % 40 == 7 { Leaf { size: leaf.size * 8.0, ..*leaf } } else { *leaf })
            .collect();
        let (all, large) = (leaves.len(), leaves.len().div_ceil(40) - 1);
        let plant = plant.with_leaves(leaves);
        let takes = |leaf: &Leaf| if leaf.slot == 0 { 2 } else { 4 };
        for room in [large * 4, all, all * 4] {
            let kept = kept(&plant, &plant.pose(), (room, &takes), 1.0, Seed::new(1));
            let is_large = |card: &&LeafCard| card.leaf % 40 == 7;
            assert!(kept.iter().filter(is_large).count() >= large);
            let taken: usize = kept.iter().map(|card| takes(&plant.leaves()[card.leaf])).sum();
            assert!(taken <= room && (taken + 4 > room || kept.len() == all), "{taken} of {room}");
        }
    }

    /// So many poles of one girth, each with a tuft of leaves: wood that can't be thinned.
    fn poles(count: u64) -> Plant {
        let mut builder = PlantBuilder::new();
        for i in 0..count {
            let seed = Seed::new(8).at(i);
            let at = Vec3::new(seed.at(0).range(-1.0, 1.0), 0.0, seed.at(1).range(-1.0, 1.0));
            let top = Vec3::Y * seed.at(2).range(2.0, 4.0);
            let pole = builder.stem(at, &[Vec3::ZERO, top * 0.5, top], &[0.02; 3]);
            for k in 0..12 {
                let seed = seed.at(10 + k);
                let orientation = Rotation::about(seed.at(0).direction(), seed.at(1).range(0.0, 6.0));
                builder.leaf(Leaf::new(pole, seed.at(2).range(0.5, 1.0), orientation, 0.3, 0));
            }
        }
        builder.finish().unwrap()
    }

    #[test]
    fn leaves_do_not_pay_for_wood_that_cannot_be_thinned() {
        let levels = climbed(&poles(80), &[Lod::Full, Lod::thinned(0.03)]).levels;
        let leaves = |level: usize| levels[level].mesh.leaf.indices.len() / 3;
        let wood = levels[1].triangles - leaves(1);
        assert!(wood * 100 > levels[0].triangles * 3, "wood alone takes all of it: {wood}");
        assert!(leaves(1) * 200 >= leaves(0) * 3 - 400, "{} of {}", leaves(1), leaves(0));
    }

    #[test]
    fn a_thinned_level_keeps_to_the_fewer_of_share_and_number() {
        let plant = crown(20, 1.0);
        let at = |lod: Lod| climbed(&plant, &[Lod::Full, lod]).levels[1].triangles;
        let half = at(Lod::thinned(0.5));
        assert_eq!(at(Lod::Thinned { triangles: 0.5, most: half as u32 * 2 }), half);
        let few = at(Lod::Thinned { triangles: 0.5, most: half as u32 / 2 });
        assert!(few * 2 <= half && few * 2 > half * 19 / 20, "{few} of {half}");
    }

    #[test]
    fn a_cloud_has_no_more_triangles_than_the_level_above() {
        // Fewer than a cloud's limbs may have elsewhere.
        let lods = [Lod::Full, Lod::thinned(0.1), Lod::BillboardCloud { cards: 24 }];
        let levels = climbed(&poles(100), &lods).levels;
        assert!(levels[2].triangles < levels[1].triangles, "{} {}", levels[1].triangles, levels[2].triangles);
    }

    #[test]
    fn an_impostor_of_twigs_covers_what_the_tree_does_as_engines_show_it() {
        let ladder = climbed(&crown(0, 0.5), &[Lod::Full, Lod::Impostor { frames: 8 }]);
        let plain = [plain()];
        let sheet = ladder.tiles[0].maps(&palette(&plain, &plain[0]));
        // Fewer views hide too many twigs by chance.
        assert_eq!(ladder.levels[1].measured.views, 32);
        let layout = ladder.levels[1].impostor.unwrap();
        let reference = Reference::new(&ladder.levels[0].mesh, &Wardrobe::new(&plain, &plain[0]), 120, 32);
        let seen = reference
            .measure_from(&|view| layout.as_seen(view.frame, &sheet, (Vec2::ZERO, Vec2::ONE)), Asked::Silhouette);
        assert!((seen.coverage - 1.0).abs() < 0.03, "{}", seen.coverage);
    }
}
