//! A plant in the world with all that is asked of its points, and its capsules by cells.

use glam::Vec3;

use super::super::grid::{Boxes, Lattice};
use crate::plant::{ChainId, Plant, Posed};

/// A branch is at its own fork, while it touches its kin, for at most this many times its bearer's radius and its own.
pub(super) const ZONE: f32 = 12.0;
/// Most capsules that one is held against.
const MOST_LOOKS: usize = 512;

/// A plant in the world, with all that is asked of its points.
pub(super) struct Wood<'a> {
    pub(super) plant: &'a Plant,
    pub(super) posed: Posed,
    /// Of each point.
    pub(super) chain: Vec<u32>,
    /// Way from the root along the wood, of each point.
    pub(super) arc: Vec<f32>,
    /// Of each chain: the way at its base, and how long it is at its fork at most.
    pub(super) base: Vec<(f32, f32)>,
}

impl<'a> Wood<'a> {
    pub(super) fn of(plant: &'a Plant) -> Self {
        Self::posed(plant, Posed::of_bearers(plant))
    }

    /// Of a plant with its bearers' frames.
    pub(super) fn posed(plant: &'a Plant, posed: Posed) -> Self {
        let count = plant.all_points().len();
        let (mut chain, mut arc) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut base = Vec::with_capacity(plant.chains().len());
        let stems = plant.chain_ids().filter(|id| plant.chain(*id).parent.is_none());
        let thickest = stems.map(|id| plant.radii(id)[0]).fold(0.0, f32::max);
        for id in plant.chain_ids() {
            let curve = posed.curve(plant, id);
            let radii = plant.radii(id);
            let (start, zone) = plant.chain(id).parent.map_or((0.0, 2.0 * ZONE * thickest), |parent| {
                let location = f64::from(plant.chain(id).location);
                let below = posed.curve(plant, parent);
                let start: (f32, f32) = base[parent.index()];
                let thick = below.value(plant.radii(parent), location);
                (start.0 + below.length() * location as f32, ZONE * (thick + radii[0]))
            });
            base.push((start, zone));
            let length = curve.length();
            chain.extend(std::iter::repeat_n(id.0, radii.len()));
            arc.extend(curve.parameters().into_iter().map(|t| start + t as f32 * length));
        }
        Self { plant, posed, chain, arc, base }
    }

    pub(super) fn at(&self, i: usize) -> Vec3 {
        self.posed.positions()[i]
    }

    pub(super) fn radius(&self, i: usize) -> f32 {
        self.plant.all_radii()[i]
    }

    /// Radius a share along the capsule that ends in a point.
    pub(super) fn radius_at(&self, i: usize, t: f32) -> f32 {
        self.radius(i - 1) + (self.radius(i) - self.radius(i - 1)) * t
    }

    pub(super) fn is_first(&self, i: usize) -> bool {
        i == 0 || self.chain[i] != self.chain[i - 1]
    }

    /// The way along the wood between two places, each a share along the capsule that ends in a point; between stems it
    /// leads along the ground.
    pub(super) fn way(&self, (a, s): (usize, f32), (b, t): (usize, f32)) -> f32 {
        let parent = |c: u32| self.plant.chain(ChainId(c)).parent;
        let arc = |i: usize, t: f32| self.arc[i - 1] + (self.arc[i] - self.arc[i - 1]) * t;
        let (here, there) = (arc(a, s), arc(b, t));
        let (mut x, mut y) = ((self.chain[a], here), (self.chain[b], there));
        while x.0 != y.0 {
            // A parent's index is smaller than its children's.
            let climbs = if x.0 > y.0 { &mut x } else { &mut y };
            let Some(below) = parent(climbs.0) else {
                let between = self.foot(x.0).distance(self.foot(y.0));
                return here + there + between;
            };
            *climbs = (below.0, self.base[climbs.0 as usize].0);
        }
        here + there - 2.0 * x.1.min(y.1)
    }

    /// Where the stem stands that bears a chain.
    pub(super) fn foot(&self, mut chain: u32) -> Vec3 {
        while let Some(parent) = self.plant.chain(ChainId(chain)).parent {
            chain = parent.0;
        }
        self.plant.chain(ChainId(chain)).origin
    }
}

/// The capsules between each point and the one before it on its chain, by cells.
pub(super) struct Capsules {
    lattice: Lattice,
    boxes: Boxes,
    /// The points in which the capsules end.
    ends: Vec<u32>,
}

impl Capsules {
    /// Of the whole plant, or of what lies in the cells where some chains are.
    pub(super) fn of(wood: &Wood<'_>, active: Option<&[bool]>) -> Self {
        let count = wood.chain.len();
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let mut size = 0.0_f64;
        for i in 0..count {
            (low, high) = (low.min(wood.at(i)), high.max(wood.at(i)));
            let way = if wood.is_first(i) { 0.0 } else { wood.arc[i] - wood.arc[i - 1] };
            size += f64::from(way + 2.0 * wood.radius(i));
        }
        let mean = (size / count.max(1) as f64) as f32;
        let mut edge = (mean * 1.5).max((high - low).max_element() / 256.0).max(1e-6);
        loop {
            let lattice = Lattice::covering(low, high, edge);
            let cells = |i: usize| {
                let (a, b) = (wood.at(i), wood.at(i - 1));
                let r = wood.radius(i).max(wood.radius(i - 1));
                (lattice.cell(a.min(b) - r), lattice.cell(a.max(b) + r))
            };
            let all = (0..count).filter(|&i| !wood.is_first(i));
            let (ends, boxes): (Vec<u32>, Vec<_>) = if let Some(active) = active {
                // Coarse cells are enough to say what is far away.
                let coarse = Lattice::covering(low, high, edge * 4.0);
                let mut busy = vec![false; coarse.cells()];
                for i in all.clone().filter(|&i| active[wood.chain[i] as usize]) {
                    let reach = Vec3::splat(wood.radius(i).max(wood.radius(i - 1)) + edge);
                    let (a, b) = (wood.at(i).min(wood.at(i - 1)) - reach, wood.at(i).max(wood.at(i - 1)) + reach);
                    coarse.each(coarse.cell(a), coarse.cell(b), |cell| busy[cell] = true);
                }
                let near = |i: usize| {
                    let r = Vec3::splat(wood.radius(i).max(wood.radius(i - 1)));
                    let (a, b) = (wood.at(i).min(wood.at(i - 1)) - r, wood.at(i).max(wood.at(i - 1)) + r);
                    let mut any = false;
                    coarse.each(coarse.cell(a), coarse.cell(b), |cell| any |= busy[cell]);
                    any
                };
                all.filter(|&i| near(i)).map(|i| (i as u32, cells(i))).unzip()
            } else {
                all.map(|i| (i as u32, cells(i))).unzip()
            };
            let sizes = boxes.iter().map(|(a, b)| (0..3).map(|i| (b[i] - a[i] + 1) as usize).product::<usize>());
            if sizes.sum::<usize>() > count * 24 + 100_000 {
                edge *= 2.0;
                continue;
            }
            let boxes = Boxes::of(&lattice, &boxes);
            return Self { lattice, boxes, ends };
        }
    }

    /// The capsules in the cells of a box, some more than once.
    pub(super) fn near(&self, low: Vec3, high: Vec3) -> impl Iterator<Item = u32> {
        let (a, b) = (self.lattice.cell(low), self.lattice.cell(high));
        (a[1]..=b[1])
            .flat_map(move |y| (a[2]..=b[2]).flat_map(move |z| (a[0]..=b[0]).map(move |x| [x, y, z])))
            .flat_map(|cell| self.boxes.at(self.lattice.index(cell)).iter().map(|&i| self.ends[i as usize]))
            .take(MOST_LOOKS)
    }
}
