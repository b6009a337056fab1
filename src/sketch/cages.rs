//! The view-dependent multiscale cage tree (2018, 5.2): silhouettes of lobes as cages, each bound to the next coarser one
//! by mean value coordinates.
//!
//! The root is the crown's silhouette. Below it stands the cage of each group outer lobe, of each outer lobe where a group
//! has several chains, and of the inner lobe of each chain that bears others; the pattern tree's groups say which. A
//! lobe's cage is drawn round it by its support in [`SIDES`] directions, so a cage holds those of its children, and has the
//! same number of vertices everywhere: bound once, a frame is a run over flat arrays. How deep a lobe is along the view goes
//! with its cage, for its surface (`sketch/lobe.rs`).
//!
//! A lobe smaller than [`SMALLEST`] of the crown has its parent's cage: at that scale a cage adds nothing but time.

use std::ops::Range;

use glam::{Vec2, Vec3};

use super::adapt;
use super::lobe::LobeSurface;
use super::mean_value::mean_value;
use crate::base::math;
use crate::plant::{ChainId, Plant};
use crate::relate::Group;

/// Vertices of the cage of a lobe.
pub(super) const SIDES: usize = 12;
/// Size of the smallest lobe with a cage, over the crown's.
const SMALLEST: f32 = 0.03;
/// What cages are wider than their lobes, over the crown's size: a lobe seen edge-on is no cage.
const AROUND: f32 = 0.01;

/// A cage's place in the flat arrays.
#[derive(Clone, Copy, Debug)]
struct Cage {
    /// Its vertices, and how many.
    first: u32,
    count: u32,
    /// Its parent; itself for the root.
    parent: u32,
    /// Coordinates of its vertices in the parent, vertex after vertex.
    weights: u32,
    /// From where to where its lobe lies along the view.
    depth: [f32; 2],
}

impl Cage {
    fn vertices(&self) -> Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

/// The cages of a crown, parents before children; the root is 0.
#[derive(Clone, Debug)]
pub(super) struct Cages {
    cages: Vec<Cage>,
    /// Vertices of the crown as it is.
    rest: Vec<Vec2>,
    weights: Vec<f32>,
    /// For each cage those that it is the parent of.
    children: Vec<Vec<u32>>,
    /// For each chain the cage of its outer lobe, and of its inner one.
    outer: Vec<u32>,
    inner: Vec<u32>,
}

/// Support of some points in the cages' directions, then along the view and against it.
type Support = [f32; SIDES + 2];
const EMPTY: Support = [f32::NEG_INFINITY; SIDES + 2];

impl Cages {
    /// Binds the lobes of a plant. `own` has for each chain what its inner lobe spans: in the view's plane, with depth as z.
    pub(super) fn bind(plant: &Plant, groups: &[Group], own: &[Vec<Vec3>], root: &[Vec2], size: f32) -> Self {
        let directions = directions();
        let mut inner = vec![EMPTY; plant.chains().len()];
        for (support, points) in inner.iter_mut().zip(own) {
            points.iter().for_each(|p| widen(support, *p, &directions));
        }
        let mut outer = inner.clone();
        for id in plant.chain_ids().rev() {
            if let Some(parent) = plant.chain(id).parent {
                let lobe = outer[id.index()];
                merge(&mut outer[parent.index()], &lobe);
            }
        }
        let count = plant.chains().len();
        let mut made = Self {
            cages: vec![Cage { first: 0, count: root.len() as u32, parent: 0, weights: 0, depth: [0.0; 2] }],
            rest: root.to_vec(),
            weights: Vec::new(),
            children: Vec::new(),
            outer: vec![0; count],
            inner: vec![0; count],
        };
        let mut bears = vec![false; count];
        plant.chains().iter().filter_map(|c| c.parent).for_each(|p| bears[p.index()] = true);
        for group in groups {
            // The group of a lone stem is the crown.
            let above = group.parent.map_or(0, |p| made.outer[p.index()]);
            let mut lobe = EMPTY;
            group.chains.iter().for_each(|c| merge(&mut lobe, &outer[c.index()]));
            let of_group = if group.parent.is_none() { 0 } else { made.add(above, &lobe, size, &directions) };
            for &chain in &group.chains {
                let alone = group.chains.len() == 1;
                let own = if alone { of_group } else { made.add(of_group, &outer[chain.index()], size, &directions) };
                made.outer[chain.index()] = own;
                made.inner[chain.index()] =
                    if bears[chain.index()] { made.add(own, &inner[chain.index()], size, &directions) } else { own };
            }
        }
        made.children = vec![Vec::new(); made.cages.len()];
        for (cage, of) in made.cages.iter().enumerate().skip(1) {
            made.children[of.parent as usize].push(cage as u32);
        }
        made
    }

    /// Adds a cage round a lobe, or gives the parent's where the lobe needs none.
    fn add(&mut self, parent: u32, lobe: &Support, size: f32, directions: &[Vec2; SIDES]) -> u32 {
        let wide = (0..SIDES / 2).map(|k| lobe[k] + lobe[k + SIDES / 2]).fold(f32::NEG_INFINITY, f32::max);
        if !(wide.is_finite() && wide >= size * SMALLEST) {
            return parent;
        }
        let above = self.cages[parent as usize];
        let ring: Vec<Vec2> = vertices(lobe, size * AROUND, directions);
        let (first, weights) = (self.rest.len() as u32, self.weights.len() as u32);
        let cage = Cage { first, count: SIDES as u32, parent, weights, depth: [-lobe[SIDES + 1], lobe[SIDES]] };
        let rest = &self.rest[above.vertices()];
        let weights: Vec<f32> = ring.iter().flat_map(|v| mean_value(&[rest], *v)).collect();
        self.weights.extend(weights);
        self.rest.extend(ring);
        self.cages.push(cage);
        self.cages.len() as u32 - 1
    }

    /// How many cages.
    pub(super) fn len(&self) -> usize {
        self.cages.len()
    }

    /// The cage of a chain's outer lobe.
    pub(super) fn outer(&self, chain: ChainId) -> u32 {
        self.outer[chain.index()]
    }

    /// The cage of a chain's inner lobe.
    pub(super) fn inner(&self, chain: ChainId) -> u32 {
        self.inner[chain.index()]
    }

    /// The parent of a cage.
    pub(super) fn parent(&self, cage: u32) -> u32 {
        self.cages[cage as usize].parent
    }

    /// The vertices of a cage among those of all.
    pub(super) fn ring<'v>(&self, cage: u32, vertices: &'v [Vec2]) -> &'v [Vec2] {
        &vertices[self.cages[cage as usize].vertices()]
    }

    /// The surface of a cage's lobe; the crown has none, since it is as odd as its silhouette.
    pub(super) fn surface(&self, cage: u32) -> Option<LobeSurface> {
        (cage > 0).then(|| LobeSurface::over(self.ring(cage, &self.rest), self.cages[cage as usize].depth))
    }

    /// The vertices of all cages when the root becomes `root`, which has as many vertices as it had: each follows its parent
    /// (5.3, step 1), and where `adapt` says how far, 0..=1, and how near counts as covered, metres, children then spread
    /// over what of their parent none of them covers (5.4.1).
    pub(super) fn moved(&self, root: &[Vec2], adapt: Option<(f32, f32)>) -> Vec<Vec2> {
        let mut places = self.rest.clone();
        places[..root.len()].copy_from_slice(root);
        for (cage, children) in self.cages.iter().zip(&self.children).filter(|(_, children)| !children.is_empty()) {
            // What a vertex moves by is what its parent's vertices move by: nothing where they stay.
            let ring = places[cage.vertices()].to_vec();
            let shift: Vec<Vec2> = ring.iter().zip(&self.rest[cage.vertices()]).map(|(to, from)| *to - *from).collect();
            let rings: Vec<Range<usize>> = children.iter().map(|c| self.cages[*c as usize].vertices()).collect();
            for (child, vertices) in children.iter().zip(&rings) {
                let weights = &self.weights[self.cages[*child as usize].weights as usize..];
                for (vertex, weights) in places[vertices.clone()].iter_mut().zip(weights.chunks_exact(shift.len())) {
                    *vertex += sum(weights, &shift);
                }
            }
            if let Some((share, near)) = adapt {
                adapt::cover(&ring, &rings, &mut places, share, near);
            }
        }
        places
    }

    /// The vertices of all cages as they are.
    pub(super) fn rest(&self) -> &[Vec2] {
        &self.rest
    }
}

/// The sum of some places by weights.
pub(super) fn sum(weights: &[f32], places: &[Vec2]) -> Vec2 {
    let (mut x, mut y) = (0.0, 0.0);
    for (w, p) in weights.iter().zip(places) {
        x += w * p.x;
        y += w * p.y;
    }
    Vec2::new(x, y)
}

fn directions() -> [Vec2; SIDES] {
    std::array::from_fn(|k| {
        let (sin, cos) = math::sin_cos(std::f32::consts::TAU * k as f32 / SIDES as f32);
        Vec2::new(cos, sin)
    })
}

fn widen(support: &mut Support, p: Vec3, directions: &[Vec2; SIDES]) {
    for (h, u) in support.iter_mut().zip(directions) {
        *h = h.max(u.dot(p.truncate()));
    }
    support[SIDES] = support[SIDES].max(p.z);
    support[SIDES + 1] = support[SIDES + 1].max(-p.z);
}

fn merge(support: &mut Support, other: &Support) {
    support.iter_mut().zip(other).for_each(|(h, o)| *h = h.max(*o));
}

/// Where the support lines of neighbouring directions meet, counter-clockwise.
fn vertices(support: &Support, around: f32, directions: &[Vec2; SIDES]) -> Vec<Vec2> {
    (0..SIDES)
        .map(|k| {
            let (u, v) = (directions[k], directions[(k + 1) % SIDES]);
            let (a, b) = (support[k] + around, support[(k + 1) % SIDES] + around);
            let cross = u.perp_dot(v);
            Vec2::new(a * v.y - b * u.y, b * u.x - a * v.x) / cross
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::relate::random_plant::{Oddity, random_plant};
    use crate::relate::{PatternParams, groups};

    fn bound(seed: u64) -> Cages {
        let plant = random_plant(Seed::new(seed), 60, Oddity::Wild);
        let posed = plant.pose();
        let own: Vec<Vec<Vec3>> = plant.chain_ids().map(|id| posed.chain(&plant, id).to_vec()).collect();
        let all: Vec<Vec2> = own.iter().flatten().map(|p| p.truncate()).collect();
        let (low, high) = all.iter().fold((all[0], all[0]), |(l, h), p| (l.min(*p), h.max(*p)));
        let (low, high) = (low - 1.0, high + 1.0);
        let root = [low, Vec2::new(high.x, low.y), high, Vec2::new(low.x, high.y)];
        Cages::bind(&plant, &groups(&plant, &posed, &PatternParams::default()), &own, &root, (high - low).length())
    }

    #[test]
    fn cages_stay_when_the_root_stays_and_follow_when_it_is_moved_and_scaled() {
        for seed in 0..10 {
            let cages = bound(seed);
            let root = cages.ring(0, cages.rest()).to_vec();
            assert!(cages.moved(&root, None) == cages.rest());
            let far = |p: &Vec2| *p * 2.0 + Vec2::new(3.0, -1.0);
            let moved = cages.moved(&root.iter().map(far).collect::<Vec<_>>(), None);
            let size = (root[2] - root[0]).length();
            for (was, is) in cages.rest().iter().zip(&moved) {
                assert!(far(was).distance(*is) < size * 1e-4, "{seed}");
            }
        }
    }

    #[test]
    fn vertices_of_a_cage_stand_round_its_lobe() {
        let directions = directions();
        let mut support = EMPTY;
        let points: Vec<Vec2> =
            (0..20).map(|i| Vec2::new(Seed::new(1).at(i).unit(), Seed::new(2).at(i).unit())).collect();
        points.iter().for_each(|p| widen(&mut support, p.extend(0.0), &directions));
        let ring = vertices(&support, 0.01, &directions);
        for p in points {
            for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
                assert!((*b - *a).perp_dot(p - *a) > 0.0);
            }
        }
    }
}
