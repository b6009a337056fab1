//! Figures of leafy morphing: whole at every time, continuous, trunk support, the paper's Table 2, patterns, pictures.

use std::hint::black_box;

use glam::Vec3;
use rayon::prelude::*;
use treewright::bake::{LeafMorph, leaf_maps};
use treewright::base::{Rotation, Seed};
use treewright::blend::{Pace, morph, support_over_morph};
use treewright::dress::dress;
use treewright::export::Curve;
use treewright::mesh::{CardShape, CrownLight, TubeDetail, all_cards, leaf_cards_in, tubes_in};
use treewright::plant::{ChainId, Leaf, Plant, PlantBuilder, PlantStats};
use treewright::preset::plan::{DressParams, LeafShape, MatchParams, MeshParams};
use treewright::relate::{
    Blender, Family, Pattern, PatternParams, PatternTree, fuzzy_family, groups, lobes, match_patterns, pattern_family,
};
use treewright::select;

use crate::leafy::{foliage, imported, leafy};
use crate::table_1::source;
use crate::{Figure, seconds};

const MATCHING: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
const MESH: MeshParams = MeshParams { bark_tile: 1.5, ..MeshParams::told(12, 0.004) };

/// Prints them.
pub(crate) fn print() {
    whole();
    support();
    patterns();
    lobe_agreement();
    pictures();
    table_2();
}

fn family(a: &Plant, b: &Plant) -> Family {
    let patterns = PatternParams::default();
    pattern_family(a.clone(), b.clone(), &MATCHING, &patterns).expect("they match").pair_leaves(1000).0
}

/// The pairs that are looked at: single trunk and shrub, two broad-leaved trees, two imported ones.
fn pairs() -> Vec<(String, Plant, Plant)> {
    let mut pairs = vec![
        ("oak to shrub".to_owned(), leafy("oak", 1, 5000), leafy("shrub", 2, 4000)),
        ("oak to willow".to_owned(), leafy("oak", 1, 5000), leafy("willow", 2, 5000)),
    ];
    if let (Some(a), Some(b)) = (imported("eztree_oak_medium.glb"), imported("eztree_aspen_small.glb")) {
        pairs.push(("eztree_oak_medium to eztree_aspen_small".to_owned(), a, b));
    }
    pairs
}

/// Base and size of every leaf.
fn leaves_at(family: &Family, t: f32) -> Vec<(Vec3, f32)> {
    let plant = family.blend(&morph(family, 0, 1, t));
    let posed = plant.pose();
    plant.leaves().iter().map(|leaf| (posed.leaf(&plant, leaf).position, leaf.size)).collect()
}

/// Longest way of a leaf in one of `steps` steps, over the taller source's height.
fn longest_step(family: &Family, steps: u32, height: f32) -> f32 {
    let at = |step: u32| leaves_at(family, 1e-4 + (1.0 - 2e-4) * step as f32 / steps as f32);
    let mut most = 0.0_f32;
    let mut last = at(0);
    for step in 1..=steps {
        let next = at(step);
        most = last.iter().zip(&next).fold(most, |most, (a, b)| most.max(a.0.distance(b.0)));
        last = next;
    }
    most / height
}

fn whole() {
    for (what, a, b) in pairs() {
        let family = family(&a, &b);
        let frames = 41;
        let measured: Vec<(f32, f32, f32)> = (0..frames)
            .into_par_iter()
            .map(|frame| {
                let plant = family.blend(&morph(&family, 0, 1, frame as f32 / (frames - 1) as f32));
                let posed = plant.pose();
                // From a leaf's base to the axis of its chain: to the nearest point of it, in the world.
                let gap = plant.leaves().iter().map(|leaf| {
                    let points = posed.chain(&plant, leaf.chain);
                    to_axis(points, posed.leaf(&plant, leaf).position)
                });
                let loose = plant.chain_ids().filter_map(|id| {
                    let parent = plant.chain(id).parent?;
                    Some(to_axis(posed.chain(&plant, parent), posed.chain(&plant, id)[0]))
                });
                let continuity = PlantStats::of(&plant).topology_continuity;
                (continuity, gap.fold(0.0, f32::max), loose.fold(0.0, f32::max))
            })
            .collect();
        let worst =
            measured.iter().fold((1.0_f32, 0.0_f32, 0.0_f32), |w, m| (w.0.min(m.0), w.1.max(m.1), w.2.max(m.2)));
        let ends = measured[0].1.max(measured[frames - 1].1);
        let how = format!("{what}, worst of {frames} frames; {} and {} chains", a.chains().len(), b.chains().len());
        Figure::new("morph.continuity", f64::from(worst.0), "", format!("share of branches in their parent, {how}"))
            .goal(">= 1")
            .print();
        let how = format!("a branch's base from its parent's axis, {how}");
        Figure::new("morph.floating_branch", f64::from(worst.2) * 1000.0, "mm", how).goal("<= 0.1").print();
        let how = format!("farthest leaf from its axis in any frame less that of the sources ({ends:.3} m), {what}");
        Figure::new("morph.floating_leaf", f64::from(worst.1 - ends) * 1000.0, "mm", how).goal("<= 0.1").print();
        let height = a.height().max(b.height());
        let (coarse, fine) = (longest_step(&family, 100, height), longest_step(&family, 200, height));
        let how = format!(
            "longest step of {} leaves in 200 steps over that in 100 ({coarse:.4} of the height), {what}",
            leaves_at(&family, 0.5).len()
        );
        Figure::new("morph.leaf_path", f64::from(fine / coarse), "", how).goal("<= 0.6: no jump").print();
        let found = family.leaf_matches().expect("they are paired");
        let all = (found.lobes + found.pooled + found.alone) as f64;
        let how = format!(
            "of {all} leaves on the way those with a source and a target ({:.1} % in lobes of matched chains alone), {what}",
            found.lobes as f64 / all * 100.0
        );
        let matched = (found.lobes + found.pooled) as f64 / all * 100.0;
        Figure::new("morph.matched_leaves", matched, "%", how).goal(">= 80").print();
        let same = family.blend(&morph(&family, 0, 1, 0.0)) == a && family.blend(&morph(&family, 0, 1, 1.0)) == b;
        Figure::new(
            "morph.ends",
            f64::from(u8::from(same)),
            "",
            format!("first and last frame are the sources, bit by bit, {what}"),
        )
        .goal(">= 1")
        .print();
    }
}

fn to_axis(points: &[Vec3], place: Vec3) -> f32 {
    let segment = |pair: &[Vec3]| {
        let way = pair[1] - pair[0];
        let square = way.length_squared();
        let f = if square > 0.0 { ((place - pair[0]).dot(way) / square).clamp(0.0, 1.0) } else { 0.0 };
        (pair[0] + way * f).distance(place)
    };
    points.windows(2).map(segment).fold(f32::INFINITY, f32::min)
}

fn support() {
    for (what, a, b) in [
        ("oak to shrub", leafy("oak", 1, 5000), leafy("shrub", 2, 4000)),
        ("shrub to oak", leafy("shrub", 2, 4000), leafy("oak", 1, 5000)),
    ] {
        let many = family(&a, &b);
        let one_to_many = Curve { name: String::new(), values: support_over_morph(&many, &Pace::of(&many), 100) };
        let fuzzy = fuzzy_family(a.clone(), b.clone(), &MATCHING).expect("they match");
        let one_to_one = Curve { name: String::new(), values: support_over_morph(&fuzzy, &Pace::even(), 100) };
        let ends = (one_to_many.values[0], one_to_many.values[100]);
        let how = format!(
            "trunk support weight, {what} ({:.2} to {:.2}), 100 steps: steepest over the straight line",
            ends.0, ends.1
        );
        let ratio = one_to_many.steepest() / one_to_many.straight();
        Figure::new("morph.support", f64::from(ratio), "x", how).goal("<= 2").print();
        let how = format!("{what}: steepest over the steepest with one-to-one matching ({:.2})", one_to_one.steepest());
        let ratio = one_to_many.steepest() / one_to_one.steepest();
        Figure::new("morph.support_one_to_one", f64::from(ratio), "x", how).goal("< 1").print();
    }
}

/// A grown oak's trunk and limbs with nodes of known phyllotaxis.
fn known(count: usize, noise: f32, seed: Seed) -> (Plant, Vec<(ChainId, usize)>) {
    let wood = source("oak", 3, 40);
    let mut builder = PlantBuilder::new();
    for id in wood.chain_ids() {
        let chain = wood.chain(id);
        match chain.parent {
            None => builder.stem(chain.origin, wood.points(id), wood.radii(id)),
            Some(parent) => builder.branch(parent, chain.location, wood.points(id), wood.radii(id)),
        };
    }
    let mut nodes = Vec::new();
    for id in wood.chain_ids() {
        let taken: Vec<f32> =
            wood.chain_ids().filter(|&c| wood.chain(c).parent == Some(id)).map(|c| wood.chain(c).location).collect();
        for node in 0..12_u64 {
            let location = 0.25 + 0.06 * node as f32;
            // Clear of the limbs' own forks.
            if taken.iter().any(|t| (t - location).abs() < 0.03) {
                continue;
            }
            let radius = wood.radii(id)[0] * 0.15;
            for i in 0..count {
                let s = seed.at(u64::from(id.0)).at(node).at(i as u64);
                // Uniform between these has the standard deviation `noise`.
                let off = |name: &str| s.child(name).range(-1.0, 1.0) * noise * 3.0_f32.sqrt();
                let around = node as f32 * 2.4 + std::f32::consts::TAU * i as f32 / count as f32 + off("around");
                let turn = Rotation::about(Vec3::Y, around);
                let way = turn.rotate(Rotation::about(Vec3::Z, -(0.9 + off("out"))).rotate(Vec3::Y)) * 0.3;
                let twig = builder.branch(id, location, &[Vec3::ZERO, way], &[radius, radius * 0.3]);
                if i == 0 {
                    nodes.push((twig, count));
                }
            }
        }
    }
    (builder.finish().expect("it is a plant"), nodes)
}

fn patterns() {
    let (mut right, mut all) = (0, 0);
    for (count, wanted) in
        [(1, Pattern::Alternate), (2, Pattern::Opposite), (3, Pattern::Whorled), (5, Pattern::Whorled)]
    {
        for seed in 0..5 {
            let (plant, nodes) = known(count, 5.0_f32.to_radians(), Seed::new(seed));
            let found = groups(&plant, &plant.pose(), &PatternParams::default());
            for (twig, count) in nodes {
                let group = found.iter().find(|g| g.chains.contains(&twig));
                right += usize::from(group.is_some_and(|g| g.pattern == wanted && g.chains.len() == count));
                all += 1;
            }
        }
    }
    let how = format!("{all} nodes of known phyllotaxis on a grown oak's limbs, 5 degrees of noise on every angle");
    Figure::new("morph.patterns", right as f64 / all as f64 * 100.0, "%", how).goal(">= 98").print();
}

fn lobe_agreement() {
    let mut plants: Vec<(&str, Plant)> = ["oak", "willow", "shrub"].map(|s| (s, leafy(s, 1, 5000))).into();
    plants.extend(imported("eztree_oak_medium.glb").map(|plant| ("imported oak", plant)));
    for (species, plant) in plants {
        let (posed, tree) = (plant.pose(), PatternTree::of(&plant, &PatternParams::default()));
        let places: Vec<Vec3> = plant.leaves().iter().map(|l| posed.leaf(&plant, l).position).collect();
        let found = lobes(&plant, &posed, &tree, &places);
        let limb = |chain: ChainId, order: u16| {
            let mut at = chain;
            while plant.chain(at).order > order {
                let Some(parent) = plant.chain(at).parent else { break };
                at = parent;
            }
            at
        };
        let share = |order: u16| {
            let same =
                found.iter().zip(plant.leaves()).filter(|(c, l)| limb(**c, order) == limb(l.chain, order)).count();
            same as f64 / places.len() as f64 * 100.0
        };
        let how = format!(
            "{} leaves of a {species} by their places alone: on the right limb; on the right chain {:.0} %",
            places.len(),
            share(u16::MAX)
        );
        Figure::new("morph.lobes", share(2), "%", how).print();
        let lost = found.iter().filter(|c| c.index() >= plant.chains().len()).count();
        Figure::new("morph.lobes_lost", lost as f64, "leaves", format!("leaves of a {species} without a chain"))
            .goal("<= 0")
            .print();
    }
}

fn pictures() {
    let made = |shape, color| leaf_maps(shape, color, 0.3, 256, 0, Seed::new(1));
    let (a, b) = (made(LeafShape::Oak, [0.08, 0.15, 0.03]), made(LeafShape::Willow, [0.2, 0.3, 0.08]));
    let morph = LeafMorph::new(&a, &b);
    let half = morph.at(0.5);
    let partial =
        |alpha: &dyn Fn(usize) -> f32| (0..256 * 256).filter(|&i| (0.1..0.9).contains(&alpha(i))).count() as f64;
    let own = partial(&|i| f32::from(half.color[i][3]) / 255.0);
    let faded = partial(&|i| (f32::from(a.color[i][3]) + f32::from(b.color[i][3])) / 510.0);
    let how = "half-transparent pixels half way between an oak's and a willow's spray, over those of a cross-fade";
    Figure::new("morph.ghosting", own / faded, "x", how).goal("<= 0.35").print();
    let time = seconds(5, || {
        black_box(morph.at(0.5));
    });
    Figure::new("morph.picture", time * 1e3, "ms", "one picture of 256 x 256 between two").print();
}

/// A leafy plant of given numbers of chains and leaves.
fn sized(species: &str, seed: u64, chains: usize, leaves: usize) -> Plant {
    let bare = source(species, seed, usize::MAX);
    let mut plant = dress(&bare, &DressParams { density: 4.0, ..foliage(200_000) }, Seed::new(seed));
    let mut order: Vec<ChainId> = plant.chain_ids().collect();
    order.sort_by_key(|&id| (plant.chain(id).order, id));
    plant = select::without(&plant, order.get(chains..).unwrap_or(&[]));
    let mut builder = PlantBuilder::new();
    for id in plant.chain_ids() {
        let chain = plant.chain(id);
        match chain.parent {
            None => builder.stem(chain.origin, plant.points(id), plant.radii(id)),
            Some(parent) => builder.branch(parent, chain.location, plant.points(id), plant.radii(id)),
        };
    }
    // Short of chains: twigs of a metre's tenth, in turn along all chains.
    let first = builder.chain_count();
    for i in first..chains {
        let s = Seed::new(seed).child("more").at(i as u64);
        let way = s.direction() * 0.1;
        builder.branch(
            ChainId(s.child("on").index(first) as u32),
            s.child("at").range(0.2, 1.0),
            &[Vec3::ZERO, way],
            &[0.003, 0.001],
        );
    }
    for i in 0..leaves {
        let s = Seed::new(seed).child("leaf").at(i as u64);
        let turned = Rotation::about(s.direction(), s.child("angle").range(0.0, 3.0));
        builder.leaf(Leaf::new(ChainId(s.child("on").index(chains) as u32), s.child("at").unit(), turned, 0.2, 0));
    }
    builder.finish().expect("it is a plant")
}

/// A row of the paper's Table 2: figures, species, chains and leaves of both, seconds before a frame, seconds a frame.
type Row = ([&'static str; 2], [&'static str; 2], [usize; 2], [usize; 2], f64, f64);

const ROWS: [Row; 5] = [
    (["morph.fig1", "morph.fig1_frame"], ["oak", "willow"], [5220, 20195], [4690, 5919], 5.43, 11.35),
    (["morph.fig3", "morph.fig3_frame"], ["elm", "lime"], [4507, 4590], [4436, 3765], 1.79, 1.52),
    (["morph.fig8", "morph.fig8_frame"], ["zelkova", "ash"], [5660, 4370], [2937, 2844], 2.86, 7.31),
    (["morph.fig7", "morph.fig7_frame"], ["willow", "willow"], [7782, 21138], [6459, 2874], 7.05, 7.92),
    (["morph.fig9", "morph.fig9_frame"], ["cottonwood", "birch"], [5224, 8272], [2351, 5564], 4.06, 10.08),
];

fn table_2() {
    let threads = rayon::current_num_threads();
    for (figure, species, chains, leaves, paper, paper_frame) in ROWS {
        let (a, b) =
            rayon::join(|| sized(species[0], 1, chains[0], leaves[0]), || sized(species[1], 2, chains[1], leaves[1]));
        let of = |plant: &Plant| {
            let tree = PatternTree::of(plant, &PatternParams::default());
            let posed = plant.pose();
            let places: Vec<Vec3> = plant.leaves().iter().map(|l| posed.leaf(plant, l).position).collect();
            let found = lobes(plant, &posed, &tree, &places);
            (tree, found)
        };
        let time = seconds(5, || {
            let (own, other) = rayon::join(|| of(&a), || of(&b));
            black_box(match_patterns(&own.0, &other.0, &MATCHING));
            black_box((own.1, other.1));
        });
        let sizes = format!(
            "{}/{} chains, {}/{} leaves",
            a.chains().len(),
            b.chains().len(),
            a.leaves().len(),
            b.leaves().len()
        );
        let how =
            format!("{sizes}: ordering, lobes and matching, median of 5, {threads} threads; the paper's {paper} s");
        Figure::new(figure[0], time, "s", how).goal("<= 0.5").print();
        let family = family(&a, &b);
        let detail = TubeDetail::full(&MESH);
        // As a set's frames are made: side by side, each thread with a blender of its own.
        let frame = |(blender, plant): &mut (Blender<'_>, Plant), t: f32| {
            blender.blend_into(&morph(&family, 0, 1, t), plant);
            let posed = plant.pose();
            let cards = all_cards(plant);
            let light = CrownLight::of(plant, &posed);
            let wood = tubes_in(plant, &posed, &light, &detail);
            let leaf = leaf_cards_in(plant, &posed, &light, &cards, CardShape::Folded);
            (wood.indices.len() + leaf.indices.len()) / 3
        };
        let count = 12_u32;
        let mut triangles = 0;
        let time = seconds(3, || {
            let made: Vec<usize> = (1..count + 1)
                .into_par_iter()
                .with_min_len(3)
                .map_init(
                    || (Blender::new(&family), Plant::default()),
                    |room, k| frame(room, k as f32 / (count + 1) as f32),
                )
                .collect();
            triangles = made.iter().sum::<usize>() / made.len();
        }) / f64::from(count);
        let how = format!(
            "{sizes}: a frame with its branch mesh and leaves, {triangles} triangles, of {count} side by side, median of 3, \
             {threads} threads; the paper's {paper_frame} s"
        );
        Figure::new(figure[1], time * 1e3, "ms", how).goal("<= 60").print();
    }
}
