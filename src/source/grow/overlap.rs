//! Branches that grow into each other: found, moved apart, and dropped where that does not help.
//!
//! Paths share no node but those before their fork, so axes never cross. But nodes are points and wood is thick, and
//! smoothing draws axes off their nodes. So a finished plant can be checked: every node's
//! disc is held against the capsules of all other axes near it. A branch is at its fork until it first leaves the wood of
//! the axis that bears it, and so are two places less than [`FORK`] times their radii apart along the wood; overlapping is
//! right there. A branch is mended when more than [`LIMIT`] of its surface lies in others: the thinner is pushed out with
//! all that it bears, a few times, to the side on which it passes; what still overlaps is dropped, the thinner first. Stems
//! stay, and so do limbs that bear more than [`LIMB`] of the plant: these are told of.
//!
//! Limits: on a small grown tree mending dropped a third of the branches, so growth leaves it to the caller.
//!
//! `n log n` in nodes: capsules are found by cells. At most [`MOST_LOOKS`] capsules are held against one disc, so that
//! wood thicker than its own spacing ends in bounded time; what lies beyond is not seen.

use glam::Vec3;
use rayon::prelude::*;

use super::grid::Lattice;
use crate::plant::{Plant, PlantError, Skeleton, SkeletonNode};

/// Share of a branch's surface that may lie in others.
const LIMIT: f32 = 0.01;
/// Up to this many times the sum of the radii along the wood, two places are at a fork.
const FORK: f32 = 6.0;
/// How often branches are pushed apart before what is left is dropped.
const ROUNDS: u32 = 5;
/// Share of a plant's nodes from which an axis is not dropped.
const LIMB: f32 = 0.02;
/// Least sine of the angle between two axes that pass each other; below it they run side by side.
const ACROSS: f32 = 0.3;
/// Nodes on either side that go part of the way with one that is pushed.
const SPREAD: usize = 4;
/// Most capsules that one disc is held against.
const MOST_LOOKS: usize = 512;
/// No node.
const NONE: u32 = u32::MAX;

/// What was found and done; counts of branches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mended {
    /// Of which more than a hundredth overlapped.
    pub found: usize,
    /// Dropped, not counting what these bore.
    pub dropped: usize,
    /// Still overlapping: stems and limbs.
    pub left: usize,
}

/// A skeleton cut into axes, each following the thickest child.
struct Axes {
    /// Of each node.
    axis: Vec<u32>,
    /// Way along the wood from the root.
    arc: Vec<f32>,
    /// The first node of each axis after its fork; the root of a stem.
    first: Vec<u32>,
    /// How many forks below each.
    depth: Vec<u32>,
}

impl Axes {
    fn of(nodes: &[SkeletonNode]) -> Self {
        let mut heavy = vec![NONE; nodes.len()];
        for (i, node) in nodes.iter().enumerate() {
            if let Some(p) = node.parent {
                let best = heavy[p as usize];
                if best == NONE || node.radius > nodes[best as usize].radius {
                    heavy[p as usize] = i as u32;
                }
            }
        }
        let mut axes = Self { axis: vec![0; nodes.len()], arc: vec![0.0; nodes.len()], first: vec![], depth: vec![] };
        for (i, node) in nodes.iter().enumerate() {
            let parent = node.parent.map(|p| p as usize);
            if let Some(p) = parent {
                axes.arc[i] = axes.arc[p] + node.position.distance(nodes[p].position);
            }
            axes.axis[i] = match parent {
                Some(p) if heavy[p] == i as u32 => axes.axis[p],
                _ => {
                    axes.first.push(i as u32);
                    axes.depth.push(parent.map_or(0, |p| axes.depth[axes.axis[p] as usize] + 1));
                    axes.first.len() as u32 - 1
                }
            };
        }
        axes
    }

    /// The axis that bears another; none of a stem.
    fn bearer(&self, nodes: &[SkeletonNode], axis: u32) -> u32 {
        nodes[self.first[axis as usize] as usize].parent.map_or(NONE, |fork| self.axis[fork as usize])
    }

    /// The way along the wood between two nodes; infinite between plants.
    fn way(&self, nodes: &[SkeletonNode], a: usize, b: usize) -> f32 {
        let (mut x, mut y) = (a, b);
        while self.axis[x] != self.axis[y] {
            let (i, j) = (self.axis[x] as usize, self.axis[y] as usize);
            let climbs = if self.depth[i] >= self.depth[j] { &mut x } else { &mut y };
            let first = self.first[self.axis[*climbs] as usize];
            match nodes[first as usize].parent {
                Some(fork) => *climbs = fork as usize,
                None => return f32::INFINITY,
            }
        }
        self.arc[a] + self.arc[b] - 2.0 * self.arc[x].min(self.arc[y])
    }
}

/// The capsules between each node and its parent, by cells.
struct Capsules {
    lattice: Lattice,
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Capsules {
    fn of(nodes: &[SkeletonNode]) -> Self {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let mut size = 0.0_f64;
        for node in nodes {
            (low, high) = (low.min(node.position), high.max(node.position));
            let parent = node.parent.map_or(node.position, |p| nodes[p as usize].position);
            size += f64::from(node.position.distance(parent) + 2.0 * node.radius);
        }
        let mean = (size / nodes.len().max(1) as f64) as f32;
        let mut edge = (mean * 1.5).max((high - low).max_element() / 256.0).max(1e-6);
        loop {
            let lattice = Lattice::covering(low, high, edge);
            let boxes: Vec<([u32; 3], [u32; 3])> = nodes
                .iter()
                .map(|node| {
                    let parent = node.parent.map_or(*node, |p| nodes[p as usize]);
                    let (a, b) = (node.position, parent.position);
                    // A branch's first capsule has its own radius: the fork's is the parent's.
                    let r = node.radius;
                    (lattice.cell(a.min(b) - r), lattice.cell(a.max(b) + r))
                })
                .collect();
            let cells = |(a, b): &([u32; 3], [u32; 3])| (0..3).map(|i| (b[i] - a[i] + 1) as usize).product::<usize>();
            if boxes.iter().map(cells).sum::<usize>() > nodes.len() * 24 + 100_000 {
                edge *= 2.0;
                continue;
            }
            let mut starts = vec![0_u32; lattice.cells() + 1];
            let mut members = Vec::new();
            for fill in [false, true] {
                let mut next = starts.clone();
                for (i, (a, b)) in boxes.iter().enumerate().filter(|(i, _)| nodes[*i].parent.is_some()) {
                    for y in a[1]..=b[1] {
                        for z in a[2]..=b[2] {
                            for x in a[0]..=b[0] {
                                let cell = lattice.index([x, y, z]);
                                if fill {
                                    members[next[cell] as usize] = i as u32;
                                    next[cell] += 1;
                                } else {
                                    starts[cell + 1] += 1;
                                }
                            }
                        }
                    }
                }
                if !fill {
                    for i in 1..starts.len() {
                        starts[i] += starts[i - 1];
                    }
                    members = vec![0_u32; starts.last().copied().unwrap_or(0) as usize];
                }
            }
            return Self { lattice, starts, members };
        }
    }

    fn near(&self, p: Vec3, r: f32) -> impl Iterator<Item = u32> {
        let (a, b) = (self.lattice.cell(p - r), self.lattice.cell(p + r));
        (a[1]..=b[1])
            .flat_map(move |y| (a[2]..=b[2]).flat_map(move |z| (a[0]..=b[0]).map(move |x| [x, y, z])))
            .flat_map(|cell| {
                let i = self.lattice.index(cell);
                self.members[self.starts[i] as usize..self.starts[i + 1] as usize].iter().copied()
            })
            .take(MOST_LOOKS)
    }
}

/// The deepest overlap of a node's disc.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Hit {
    /// Share of the disc's rim that is inside.
    share: f32,
    /// The other axis.
    other: u32,
    /// The way out, for the thinner of two; zero for the thicker.
    out: Vec3,
}

/// A node's disc against the capsule that ends in another node.
struct Meeting {
    /// From the capsule's axis to the node.
    off: Vec3,
    /// Along the capsule.
    along: Vec3,
    /// Its radius there and the disc's.
    reach: f32,
}

fn meeting(nodes: &[SkeletonNode], axes: &Axes, i: usize, j: usize) -> Option<Meeting> {
    let SkeletonNode { position: p, radius: r, .. } = nodes[i];
    let tip = nodes[j];
    let parent = tip.parent? as usize;
    let foot = nodes[parent];
    let along = tip.position - foot.position;
    let t = ((p - foot.position).dot(along) / along.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
    let same = axes.axis[parent] == axes.axis[j];
    let wide = if same { foot.radius + (tip.radius - foot.radius) * t } else { tip.radius };
    let off = p - (foot.position + along * t);
    let reach = wide + r;
    (off.length_squared() < reach * reach).then_some(Meeting { off, along, reach })
}

/// Which nodes have not left the wood of the axis that bears theirs.
fn fused(nodes: &[SkeletonNode], axes: &Axes, capsules: &Capsules) -> Vec<bool> {
    let touches: Vec<bool> = (0..nodes.len())
        .into_par_iter()
        .with_min_len(256)
        .map(|i| {
            let bearer = axes.bearer(nodes, axes.axis[i]);
            bearer != NONE
                && capsules
                    .near(nodes[i].position, nodes[i].radius)
                    .any(|j| axes.axis[j as usize] == bearer && meeting(nodes, axes, i, j as usize).is_some())
        })
        .collect();
    let mut left = vec![false; axes.first.len()];
    let still = |(i, touches): (usize, &bool)| {
        let left = &mut left[axes.axis[i] as usize];
        *left |= !touches;
        !*left
    };
    touches.iter().enumerate().map(still).collect()
}

fn hit(nodes: &[SkeletonNode], axes: &Axes, capsules: &Capsules, fused: &[bool], i: usize) -> Option<Hit> {
    let SkeletonNode { position: p, radius: r, parent } = nodes[i];
    let own = axes.axis[i];
    let bearer = axes.bearer(nodes, own);
    let heading = parent.map_or(Vec3::ZERO, |parent| p - nodes[parent as usize].position).normalize_or(Vec3::ZERO);
    let mut deepest: Option<Hit> = None;
    for j in capsules.near(p, r) {
        let (j, other) = (j as usize, axes.axis[j as usize]);
        if own == other {
            continue;
        }
        let theirs = axes.bearer(nodes, other);
        let at_fork =
            (fused[i] && other == bearer) || (fused[j] && own == theirs) || (fused[i] && fused[j] && bearer == theirs);
        let Some(Meeting { off, along, reach }) = meeting(nodes, axes, i, j).filter(|_| !at_fork) else { continue };
        if axes.way(nodes, i, j) <= FORK * reach {
            continue;
        }
        let far = off.length();
        let share = ((reach - far) / (2.0 * r).max(f32::MIN_POSITIVE)).min(1.0);
        let thinner = (r, other) <= (reach - r, own);
        // Where axes cross, all nodes go to the side on which their axis passes; each its own way out, those before and
        // behind the other would part and never get free.
        let across = heading.cross(along.normalize_or(Vec3::ZERO));
        let out = if !thinner {
            Vec3::ZERO
        } else if across.length() >= ACROSS {
            let across = across.normalize_or(Vec3::X);
            let side = off.dot(across);
            across * ((reach - side.abs()) * 1.05).copysign(side)
        } else {
            off.try_normalize().unwrap_or_else(|| along.any_orthogonal_vector().normalize_or(Vec3::X))
                * ((reach - far) * 1.05)
        };
        if deepest.is_none_or(|d| (share, out.length_squared()) > (d.share, d.out.length_squared())) {
            deepest = Some(Hit { share, other, out });
        }
    }
    deepest
}

/// The deepest overlap of every node's disc.
fn all_hits(nodes: &[SkeletonNode], axes: &Axes) -> Vec<Option<Hit>> {
    let capsules = Capsules::of(nodes);
    let fused = fused(nodes, axes, &capsules);
    (0..nodes.len()).into_par_iter().with_min_len(256).map(|i| hit(nodes, axes, &capsules, &fused, i)).collect()
}

/// For each axis, how much of its surface lies in others.
fn shares(nodes: &[SkeletonNode], axes: &Axes, hits: &[Option<Hit>]) -> Vec<f32> {
    let mut surface = vec![(0.0_f64, 0.0_f64); axes.first.len()];
    for (i, node) in nodes.iter().enumerate() {
        let Some(parent) = node.parent else { continue };
        let area = f64::from(node.radius * node.position.distance(nodes[parent as usize].position));
        let sum = &mut surface[axes.axis[i] as usize];
        sum.0 += area * f64::from(hits[i].map_or(0.0, |hit| hit.share));
        sum.1 += area;
    }
    surface.into_iter().map(|(inside, all)| if all > 0.0 { (inside / all) as f32 } else { 0.0 }).collect()
}

/// Moves apart or drops what overlaps, and says what it did. Radii stay, and so does every stem.
fn mend(mut skeleton: Skeleton) -> (Skeleton, Mended) {
    let mut mended = Mended::default();
    for round in 0..=ROUNDS {
        let nodes = &skeleton.nodes;
        let axes = Axes::of(nodes);
        let hits = all_hits(nodes, &axes);
        let shares = shares(nodes, &axes, &hits);
        let over = shares.iter().filter(|share| **share > LIMIT).count();
        if round == 0 {
            mended.found = over;
        }
        mended.left = over;
        if over == 0 {
            break;
        }
        if round < ROUNDS {
            skeleton = pushed(skeleton, &axes, &hits);
        } else {
            (skeleton, mended.dropped) = dropped(&skeleton, &axes, &hits, &shares);
            mended.left = over_limit(&skeleton);
        }
    }
    (skeleton, mended)
}

/// How many branches of a plant lie in others with more than a hundredth of their surface, away from forks.
///
/// A branch here is an axis that follows the thickest wood, which may be more than one chain.
#[must_use]
pub fn overlaps(plant: &Plant) -> usize {
    over_limit(&skeleton_of(plant))
}

/// The plant with its overlapping branches moved apart or dropped, and what was done.
///
/// Growth does not call it: on dense species it drops more than it should, see the limits above.
///
/// # Errors
///
/// When nothing with a length is left.
pub fn mend_overlaps(plant: &Plant) -> Result<(Plant, Mended), PlantError> {
    let (skeleton, mended) = mend(skeleton_of(plant));
    if mended.found == 0 {
        return Ok((plant.clone(), mended));
    }
    Ok((skeleton.into_plant()?, mended))
}

fn over_limit(skeleton: &Skeleton) -> usize {
    let axes = Axes::of(&skeleton.nodes);
    let hits = all_hits(&skeleton.nodes, &axes);
    shares(&skeleton.nodes, &axes, &hits).into_iter().filter(|share| *share > LIMIT).count()
}

/// A plant's points as a skeleton; a branch leaves its parent at the point nearest to its location.
fn skeleton_of(plant: &Plant) -> Skeleton {
    let posed = plant.pose();
    let mut nodes: Vec<SkeletonNode> = Vec::new();
    // Of each chain so far: the node of its first point, whether that one is its parent's, and its points' parameters.
    let mut chains: Vec<(usize, usize, Vec<f64>)> = Vec::new();
    for id in plant.chain_ids() {
        let (points, chain) = (posed.chain(plant, id), plant.chain(id));
        let mut parent = chain.parent.map(|parent| {
            let (first, skipped, parameters) = &chains[parent.index()];
            let location = f64::from(chain.location);
            let next = parameters.partition_point(|&t| t < location).min(parameters.len() - 1);
            let before = next.saturating_sub(1);
            let nearer = if location - parameters[before] < parameters[next] - location { before } else { next };
            (first + nearer.max(*skipped)) as u32
        });
        let skipped = usize::from(parent.is_some());
        // A branch's first point lies on its parent: the parent's node stands for it.
        chains.push((nodes.len() - skipped, skipped, posed.curve(plant, id).parameters()));
        for (position, radius) in points.iter().zip(plant.radii(id)).skip(skipped) {
            nodes.push(SkeletonNode { position: *position, radius: *radius, parent });
            parent = Some(nodes.len() as u32 - 1);
        }
    }
    Skeleton { nodes }
}

/// The skeleton with every pushed node at its place, its neighbours on the axis part of the way, and what they bear with
/// them.
fn pushed(mut skeleton: Skeleton, axes: &Axes, hits: &[Option<Hit>]) -> Skeleton {
    let count = skeleton.nodes.len();
    let mut own = vec![Vec3::ZERO; count];
    let mut next = vec![NONE; count];
    for (i, node) in skeleton.nodes.iter().enumerate() {
        if let Some(p) = node.parent.filter(|&p| axes.axis[p as usize] == axes.axis[i]) {
            next[p as usize] = i as u32;
        }
    }
    for (i, hit) in hits.iter().enumerate() {
        let Some(hit) = hit.filter(|hit| hit.out != Vec3::ZERO) else { continue };
        let mut grow = |node: usize, share: f32| {
            let wish = hit.out * share;
            if wish.length_squared() > own[node].length_squared() {
                own[node] = wish;
            }
        };
        grow(i, 1.0);
        let (mut below, mut above) = (i, i);
        for step in 1..=SPREAD {
            let share = 1.0 - step as f32 / (SPREAD + 1) as f32;
            if let Some(p) = skeleton.nodes[below].parent.filter(|&p| axes.axis[p as usize] == axes.axis[i]) {
                below = p as usize;
                grow(below, share);
            }
            if next[above] != NONE {
                above = next[above] as usize;
                grow(above, share);
            }
        }
    }
    // What a branch bears goes with it; a root stands.
    let mut carried = vec![Vec3::ZERO; axes.first.len()];
    for i in 0..count {
        let axis = axes.axis[i] as usize;
        let Some(parent) = skeleton.nodes[i].parent.map(|p| p as usize) else { continue };
        if axes.first[axis] as usize == i {
            let below = axes.axis[parent] as usize;
            let root = skeleton.nodes[parent].parent.is_none();
            carried[axis] = carried[below] + if root { Vec3::ZERO } else { own[parent] };
        }
        skeleton.nodes[i].position += carried[axis] + own[i];
    }
    skeleton
}

/// The skeleton without the thinner axis of each pair of which one overlaps too much; and how many these were.
fn dropped(skeleton: &Skeleton, axes: &Axes, hits: &[Option<Hit>], shares: &[f32]) -> (Skeleton, usize) {
    let mut gone = vec![false; axes.first.len()];
    // Nodes of each axis and of all that it bears.
    let mut bears = vec![0_usize; axes.first.len()];
    for &axis in &axes.axis {
        bears[axis as usize] += 1;
    }
    for axis in (0..axes.first.len()).rev() {
        if let Some(bearer) = bears.get(axes.bearer(&skeleton.nodes, axis as u32) as usize).copied() {
            bears[axes.bearer(&skeleton.nodes, axis as u32) as usize] = bearer + bears[axis];
        }
    }
    let most = (skeleton.nodes.len() as f32 * LIMB).max(30.0) as usize;
    let base = |axis: u32| skeleton.nodes[axes.first[axis as usize] as usize].radius;
    let stays =
        |axis: u32| skeleton.nodes[axes.first[axis as usize] as usize].parent.is_none() || bears[axis as usize] > most;
    for (i, hit) in hits.iter().enumerate() {
        let own = axes.axis[i];
        if let Some(hit) = hit.filter(|_| shares[own as usize] > LIMIT) {
            let thinner = (base(own), hit.other) <= (base(hit.other), own);
            let (first, second) = if thinner { (own, hit.other) } else { (hit.other, own) };
            if gone[first as usize] || gone[second as usize] {
                continue;
            }
            match (stays(first), stays(second)) {
                (false, _) => gone[first as usize] = true,
                (true, false) => gone[second as usize] = true,
                (true, true) => {}
            }
        }
    }
    let count = gone.iter().filter(|gone| **gone).count();
    let mut places = vec![NONE; skeleton.nodes.len()];
    let mut rest = Skeleton::default();
    for (i, node) in skeleton.nodes.iter().enumerate() {
        let parent = node.parent.map(|p| places[p as usize]);
        if gone[axes.axis[i] as usize] || parent == Some(NONE) {
            continue;
        }
        places[i] = rest.nodes.len() as u32;
        rest.nodes.push(SkeletonNode { parent, ..*node });
    }
    (rest, count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(nodes: &mut Vec<SkeletonNode>, from: Option<u32>, points: &[Vec3], radius: f32) {
        let mut parent = from;
        for &position in points {
            nodes.push(SkeletonNode { position, radius, parent });
            parent = Some(nodes.len() as u32 - 1);
        }
    }

    /// A trunk, a limb that leaves it, and a twig of the trunk whose way leads through the limb.
    fn crossing(offset: f32) -> Skeleton {
        let mut nodes = Vec::new();
        let up: Vec<Vec3> = (0..=40).map(|i| Vec3::Y * (i as f32 * 0.1)).collect();
        chain(&mut nodes, None, &up, 0.1);
        let limb: Vec<Vec3> = (1..=30).map(|i| Vec3::new(i as f32 * 0.1, 1.0, 0.0)).collect();
        chain(&mut nodes, Some(10), &limb, 0.05);
        let twig: Vec<Vec3> = (1..=30).map(|i| Vec3::new(i as f32 * 0.08, 2.0 - i as f32 * 0.08, offset)).collect();
        chain(&mut nodes, Some(20), &twig, 0.01);
        Skeleton { nodes }
    }

    #[test]
    fn what_is_apart_stays_as_it_is() {
        let (skeleton, mended) = mend(crossing(0.3));
        assert_eq!((skeleton, mended), (crossing(0.3), Mended::default()));
    }

    #[test]
    fn a_twig_through_a_limb_goes_around_it() {
        let (skeleton, mended) = mend(crossing(0.004));
        assert!(mended.found >= 1 && mended.dropped == 0 && mended.left == 0, "{mended:?}");
        assert_eq!(skeleton.nodes.len(), crossing(0.004).nodes.len());
        assert_eq!(mend(skeleton).1, Mended::default());
    }

    #[test]
    fn a_twig_inside_a_limb_is_dropped_with_what_it_bears() {
        let mut skeleton = crossing(0.3);
        let inside: Vec<Vec3> = (0..25).map(|i| Vec3::new(2.9 - i as f32 * 0.08, 1.0, 0.0)).collect();
        let before = skeleton.nodes.len();
        chain(&mut skeleton.nodes, Some(40), &inside, 0.001);
        let bears = skeleton.nodes.len() as u32 - 1;
        chain(&mut skeleton.nodes, Some(bears), &[Vec3::new(1.0, 1.0, 0.5)], 0.0005);
        // The trunk's top bends into the limb here; whatever is dropped, nothing is left overlapping.
        let (rest, mended) = mend(skeleton);
        assert!(mended.found >= 1 && mended.left == 0);
        assert!(rest.nodes.len() >= before);
        assert_eq!(mend(rest).1.left, 0);
    }

    #[test]
    fn wood_thicker_than_its_spacing_ends() {
        let mut skeleton = crossing(0.0);
        skeleton.nodes.iter_mut().for_each(|n| n.radius = 50.0);
        let (rest, _) = mend(skeleton);
        assert!(!rest.nodes.is_empty());
        assert_eq!(mend(Skeleton::default()).1, Mended::default());
    }
}
