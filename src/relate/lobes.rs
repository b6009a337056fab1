//! Lobes: which leaves belong to which chain, from where leaves and wood lie alone (2017 CAVW, 4.2).
//!
//! From the stems' group down: the leaves of a group's outer lobe are divided among the groups that grow on its chains
//! (their outer lobes) and the chains themselves (their inner lobes) by clustering about centres, each with a distance
//! threshold of its own. Centres start at the middle of what a child group spans and at the tips of the chains; thresholds at
//! 35 % of that group's radius and of a tenth of the chain's length. In each round a leaf goes to the nearest centre whose
//! threshold reaches it, centres move to the mean of their leaves, and thresholds grow by 10.5 % of
//! themselves, until no leaf is left.
//!
//! Where it departs: a leaf that no threshold reaches after [`ROUNDS`] rounds goes to the nearest centre, or a leaf far
//! out would cost rounds without bound. Of the first thresholds 10.5 % a round would reach 2.6 radii in as many
//! rounds; of themselves they get everywhere. Of the plant's own leaves only those that hang loose are moved ([`gather_loose`]): a leaf that stands within its own length of its chain's axis is on it.
//!
//! Time: leaves × groups of a level × rounds; of the groups below one group the first [`MOST_CENTRES`] count.

use glam::Vec3;
use rayon::prelude::*;

use super::pattern_tree::{PatternNode, PatternTree};
use crate::plant::{ChainId, Leaf, Plant, Posed};

/// First threshold over a centre's radius.
const START: f32 = 0.35;
/// What a threshold grows by from round to round.
const RELAX: f32 = 1.105;
/// Radius of an inner lobe over the length of its chain.
const INNER: f32 = 0.1;
/// Rounds after which the nearest centre takes what is left.
const ROUNDS: usize = 60;
/// Most centres that a leaf is compared with.
const MOST_CENTRES: usize = 4096;
/// Leaves that one thread takes at a time.
const MOST_ON_ONE: usize = 1024;

/// For each place of a leaf the chain whose inner lobe it belongs to. Every leaf gets one.
#[must_use]
pub fn lobes(plant: &Plant, posed: &Posed, tree: &PatternTree, leaves: &[Vec3]) -> Vec<ChainId> {
    let spans = Spans::of(plant, posed);
    let mut owner = vec![tree.root().chains.first().copied().unwrap_or(ChainId(0)); leaves.len()];
    let all: Vec<u32> = (0..leaves.len() as u32).collect();
    let mut level: Vec<(&PatternNode, Vec<u32>)> = vec![(tree.root(), all)];
    while let Some((node, own)) = level.pop() {
        if own.is_empty() {
            continue;
        }
        let below: Vec<&PatternNode> = node.chains.iter().flat_map(|&c| tree.on(c)).take(MOST_CENTRES).collect();
        if below.is_empty() && node.chains.len() == 1 {
            own.iter().for_each(|&i| owner[i as usize] = node.chains[0]);
            continue;
        }
        let mut centres: Vec<Centre> = below.iter().map(|n| spans.of_group(n)).collect();
        centres.extend(node.chains.iter().map(|&c| spans.of_tip(plant, posed, c)));
        let found = cluster(&mut centres, leaves, &own);
        let mut outer: Vec<Vec<u32>> = vec![Vec::new(); below.len()];
        for (&leaf, place) in own.iter().zip(found) {
            match outer.get_mut(place) {
                Some(outer) => outer.push(leaf),
                None => owner[leaf as usize] = node.chains[place - below.len()],
            }
        }
        level.extend(below.into_iter().zip(outer));
    }
    owner
}

/// The plant with every leaf that hangs loose given to the chain whose inner lobe it is in; no leaf moves in the world.
#[must_use]
pub fn gather_loose(plant: &Plant, tree: &PatternTree) -> Plant {
    let posed = plant.pose();
    let loose = |leaf: &Leaf| leaf.offset.length() > leaf.size.max(1e-6);
    let index: Vec<usize> = (0..plant.leaves().len()).filter(|&i| loose(&plant.leaves()[i])).collect();
    if index.is_empty() {
        return plant.clone();
    }
    let places: Vec<Vec3> = index.iter().map(|&i| posed.leaf(plant, &plant.leaves()[i]).position).collect();
    let owners = lobes(plant, &posed, tree, &places);
    let mut moved = plant.leaves().to_vec();
    for ((&i, place), owner) in index.iter().zip(places).zip(owners) {
        let leaf = plant.leaves()[i];
        let location = nearest(posed.chain(plant, owner), &plant_parameters(plant, owner), place);
        let (before, after) = (posed.at(plant, leaf.chain, leaf.location), posed.at(plant, owner, location));
        let offset = after.frame.to_local(place - after.position);
        if offset.length() > leaf.offset.length() {
            // Where it is, it is nearer to wood.
            continue;
        }
        let orientation = after.frame.rotation().inverse().after(before.frame.rotation()).after(leaf.orientation);
        moved[i] = Leaf { chain: owner, location, orientation, offset, ..leaf };
    }
    plant.clone().with_leaves(moved)
}

fn plant_parameters(plant: &Plant, chain: ChainId) -> Vec<f64> {
    crate::plant::Curve::new(plant.points(chain)).parameters()
}

/// The arc-length parameter of the point of a polyline that is nearest to `place`.
fn nearest(points: &[Vec3], parameters: &[f64], place: Vec3) -> f32 {
    let mut best = (f32::INFINITY, 0.0_f32);
    for (i, pair) in points.windows(2).enumerate() {
        let way = pair[1] - pair[0];
        let square = way.length_squared();
        let f = if square > 0.0 { ((place - pair[0]).dot(way) / square).clamp(0.0, 1.0) } else { 0.0 };
        let distance = (pair[0] + way * f).distance_squared(place);
        if distance < best.0 {
            best = (distance, (parameters[i] + (parameters[i + 1] - parameters[i]) * f64::from(f)) as f32);
        }
    }
    best.1.clamp(0.0, 1.0)
}

/// A cluster to be.
#[derive(Clone, Copy, Debug)]
struct Centre {
    place: Vec3,
    /// Square of the threshold.
    reach: f32,
}

/// For each leaf of `own` the place of its centre.
fn cluster(centres: &mut [Centre], leaves: &[Vec3], own: &[u32]) -> Vec<usize> {
    let mut found = vec![usize::MAX; own.len()];
    let mut sums: Vec<(Vec3, f32)> = vec![(Vec3::ZERO, 0.0); centres.len()];
    let mut open: Vec<usize> = (0..own.len()).collect();
    for round in 0..=ROUNDS {
        let nearest = |&i: &usize| {
            let place = leaves[own[i] as usize];
            let mut best = (f32::INFINITY, usize::MAX);
            for (c, centre) in centres.iter().enumerate() {
                let distance = centre.place.distance_squared(place);
                if distance < best.0 && (distance <= centre.reach || round == ROUNDS) {
                    best = (distance, c);
                }
            }
            // Coordinates beyond all measure are near nothing.
            if round == ROUNDS { best.1.min(centres.len() - 1) } else { best.1 }
        };
        let taken: Vec<usize> = open.par_iter().with_min_len(MOST_ON_ONE).map(nearest).collect();
        for (&i, &c) in open.iter().zip(&taken).filter(|(_, c)| **c < centres.len()) {
            found[i] = c;
            sums[c].0 += leaves[own[i] as usize];
            sums[c].1 += 1.0;
        }
        open.retain(|&i| found[i] == usize::MAX);
        if open.is_empty() {
            break;
        }
        for (centre, (sum, count)) in centres.iter_mut().zip(&sums) {
            if *count > 0.0 {
                centre.place = *sum / *count;
            }
            centre.reach *= RELAX * RELAX;
        }
    }
    found
}

/// Boxes of what chains and their substructures span.
struct Spans {
    boxes: Vec<(Vec3, Vec3)>,
}

impl Spans {
    fn of(plant: &Plant, posed: &Posed) -> Self {
        let mut boxes = vec![(Vec3::INFINITY, Vec3::NEG_INFINITY); plant.chains().len()];
        for id in plant.chain_ids().rev() {
            let own = posed.chain(plant, id).iter();
            let span = own.fold(boxes[id.index()], |(low, high), p| (low.min(*p), high.max(*p)));
            boxes[id.index()] = span;
            if let Some(parent) = plant.chain(id).parent {
                let above = &mut boxes[parent.index()];
                *above = (above.0.min(span.0), above.1.max(span.1));
            }
        }
        Self { boxes }
    }

    fn of_group(&self, node: &PatternNode) -> Centre {
        let all = node.chains.iter().map(|c| self.boxes[c.index()]);
        let (low, high) = all.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), b| (l.min(b.0), h.max(b.1)));
        Centre::new((low + high) * 0.5, low.distance(high) * 0.5)
    }

    fn of_tip(&self, plant: &Plant, posed: &Posed, chain: ChainId) -> Centre {
        let points = posed.chain(plant, chain);
        Centre::new(points[points.len() - 1], posed.curve(plant, chain).length() * INNER)
    }
}

impl Centre {
    fn new(place: Vec3, radius: f32) -> Self {
        let reach = (radius * START).max(1e-6);
        Self { place, reach: reach * reach }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Rotation, Seed};
    use crate::plant::PlantBuilder;
    use crate::relate::PatternParams;
    use crate::relate::random_plant::{Oddity, random_plant};

    #[test]
    fn leaves_about_the_ends_of_twigs_belong_to_those_twigs() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 6.0], &[0.1, 0.05]);
        let mut leaves = Vec::new();
        let mut twigs = Vec::new();
        for i in 0..8 {
            let (sin, cos) = crate::base::math::sin_cos(i as f32 * 0.785);
            let way = Vec3::new(cos, 0.5, sin) * 2.0;
            let location = 0.3 + 0.08 * i as f32;
            twigs.push(builder.branch(stem, location, &[Vec3::ZERO, way], &[0.03, 0.01]));
            for k in 0..30 {
                let off = Seed::new(i).at(k).direction() * 0.3;
                leaves.push((Vec3::Y * 6.0 * location + way + off, twigs[i as usize]));
            }
        }
        let plant = builder.finish().unwrap();
        let tree = PatternTree::of(&plant, &PatternParams::default());
        let places: Vec<Vec3> = leaves.iter().map(|l| l.0).collect();
        let found = lobes(&plant, &plant.pose(), &tree, &places);
        let right = found.iter().zip(&leaves).filter(|(own, leaf)| **own == leaf.1).count();
        assert!(right >= leaves.len() * 95 / 100, "{right} of {}", leaves.len());
    }

    #[test]
    fn every_leaf_of_any_plant_gets_a_chain_of_it() {
        for seed in 0..40 {
            let plant = random_plant(Seed::new(seed), 50, Oddity::Wild);
            let tree = PatternTree::of(&plant, &PatternParams::default());
            let places: Vec<Vec3> = (0..50).map(|i| Seed::new(seed).at(i).direction() * 9.0).collect();
            let found = lobes(&plant, &plant.pose(), &tree, &places);
            assert!(found.iter().all(|c| c.index() < plant.chains().len()) && found.len() == 50);
        }
    }

    #[test]
    fn gathered_leaves_stay_where_they_were() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.1, 0.05]);
        let twig = builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::new(1.0, 0.4, 0.0)], &[0.03, 0.01]);
        let turned = Rotation::about(Vec3::X, 0.4);
        // On the stem, but out at the twig's end.
        let mut loose = Leaf::new(stem, 0.6, turned, 0.1, 0);
        loose.offset = Vec3::new(1.0, 0.1, 0.05);
        builder.leaf(loose);
        let plant = builder.finish().unwrap();
        let gathered = gather_loose(&plant, &PatternTree::of(&plant, &PatternParams::default()));
        assert_eq!(gathered.leaves()[0].chain, twig);
        let (before, after) =
            (plant.pose().leaf(&plant, &loose), gathered.pose().leaf(&gathered, &gathered.leaves()[0]));
        assert!(before.position.distance(after.position) < 1e-5 && before.frame.x.distance(after.frame.x) < 1e-5);
        assert!(gathered.leaves()[0].offset.length() < 0.2);
    }
}
