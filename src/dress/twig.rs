//! Where twigs start on the wood, and how shoots become chains.

use glam::Vec3;

use super::colonize::Shoot;
use crate::base::{Groups, math};
use crate::plant::{ALLOMETRIC_EXPONENT, ChainId, Crown, Curve, Plant, PlantBuilder, Posed, frame_at};
use crate::preset::plan::{DressParams, USUAL_LEAF_SHARE};

/// Share of the thickest radius up to which wood bears twigs.
const THIN: f32 = 0.22;
/// How far the foliage may swell above the wood, as a share of its height. Crowns that can't at all are flat, and spruces have no
/// tips.
pub(super) const OVER: f32 = 0.03;
/// Where the end of a chain begins, as a share of its length, and how much thicker than its very end wood is there at most.
const END: f32 = 0.8;
const BLUNT: f32 = 1.15;
/// How far a twig's points may lie from a straight line to be left out, in steps.
const STRAIGHT: f32 = 0.14;
/// Length of all branches, in extents of the plant, from which on a plant has a crown of its own.
const SPARSE: f32 = 8.0;

/// What length of branches is no crown yet, as a share of the height: the bole of a scan may have stubs only. And where the crown of a
/// plant begins that has such, and where that of one without a branch.
const STUBS: f32 = 0.03;
const POLE: f32 = 0.65;
const WHIP: f32 = 0.3;

/// A place on the wood where a twig can start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    pub(super) chain: ChainId,
    pub(super) location: f32,
    pub(super) position: Vec3,
    /// Direction of the wood.
    pub(super) direction: Vec3,
    /// Radius of the wood.
    pub(super) radius: f32,
}

/// What dressing has to know of a bare plant.
#[derive(Clone, Debug)]
pub(super) struct Wood {
    /// Hull of the first-scale crown.
    pub(super) crown: Crown,
    /// How far the crown's foliage swells beyond its branches, metres.
    pub(super) swell: f32,
    /// No foliage below this height.
    pub(super) floor: f32,
    /// The lowest that branches are and stems begin, lower than which no leaf hangs: the trunk of a bonsai may dip into the ground.
    /// And the highest that a twig is sought: [`OVER`] the wood, or a tree would be higher than it was asked to be.
    pub(super) ground: f32,
    pub(super) top: f32,
    /// A twig's step.
    pub(super) step: f32,
    /// How far from the wood a leaf point may lie.
    pub(super) reach: f32,
    /// Longest twig, in steps.
    pub(super) rounds: u16,
    /// Distance between leaf points at the hull.
    pub(super) spacing: f32,
    /// Places where twigs can start.
    pub(super) starts: Vec<Start>,
    /// The same places' positions.
    pub(super) near: Vec<Vec3>,
    /// Length of a leaf's picture.
    pub(super) leaf: f32,
    /// Radius of a twig's tip.
    pub(super) tip: f32,
    /// Up to this radius the wood of each chain bears twigs.
    pub(super) thin: Vec<f32>,
}

impl Wood {
    /// Reads a plant; none if it has no crown to speak of.
    pub(super) fn of(plant: &Plant, posed: &Posed, params: &DressParams) -> Option<Self> {
        let thickest = plant.all_radii().iter().fold(0.0_f32, |a, &r| a.max(r));
        let (mut low, mut high) = (Vec3::splat(f32::MAX), Vec3::splat(f32::MIN));
        for &p in posed.positions() {
            (low, high) = (low.min(p), high.max(p));
        }
        let extent = (high - low).max_element();
        if !(extent > 1e-4 && extent < 1e5) {
            return None;
        }
        // A scan or a sapling may have a few bare limbs only: 1 where twigs have to make the whole crown. The wood's
        // length is a measure of it that cutting chains finer does not change.
        let length: f32 = plant
            .chain_ids()
            .filter(|&id| plant.chain(id).parent.is_some())
            .map(|id| posed.curve(plant, id).length())
            .sum();
        let sparse = 1.0 - (length / (extent * SPARSE)).min(1.0);
        let twig = params.twig_length.clamp(extent * 0.01, extent * 0.15);
        let reach = (twig * 2.2).max(extent * 0.16 * sparse);
        let step = (twig * 0.5).max(reach / 7.0);
        let rounds = (reach / step * 1.4 + 1.0) as u16;
        let swell = (twig * 0.6).max(extent * 0.09 * sparse);
        let base = crown_base(plant, posed, low.y, high.y);
        let mut crown = Crown::new(Vec3::new((low.x + high.x) * 0.5, base, (low.z + high.z) * 0.5));
        for &p in posed.positions().iter().filter(|p| p.y >= base) {
            crown.add(p);
        }
        let floor = (base - swell * 0.7).max(low.y);
        let blunt = blunt_ends(plant);
        let mut thin = thickest * THIN;
        // What lies below the crown bears leaves where it is thin; thick stubs bear none.
        let is_low = |id| posed.chain(plant, id).iter().all(|p| p.y < floor);
        let lowest: Vec<bool> = plant.chain_ids().map(is_low).collect();
        let (mut starts, mut each) = (Vec::new(), Vec::new());
        for _ in 0..4 {
            let bears = |(end, low): (&f32, &bool)| if *low { thickest * THIN } else { thin.max(*end) };
            each = blunt.iter().zip(&lowest).map(bears).collect();
            starts = places(plant, posed, &each, floor, step * 0.7);
            let bearing = starts.len() as f32 * step * 0.7;
            if bearing > extent * 2.0 {
                break;
            }
            // A scan stops at thick wood: let that bear twigs too.
            thin *= 1.6;
        }
        if starts.is_empty() {
            return None;
        }
        let near = starts.iter().map(|s| s.position).collect();
        let leaf = params.leaf_size.min(extent * params.leaf_share.max(USUAL_LEAF_SHARE));
        let tip = (leaf * 0.006).clamp(extent * 1e-4, extent * 1e-3);
        Some(Self {
            crown,
            swell,
            floor,
            ground: ground(plant, posed),
            top: high.y + swell.min((high.y - low.y) * OVER),
            step,
            reach,
            rounds,
            spacing: step * 1.2,
            starts,
            near,
            leaf,
            tip,
            thin: each,
        })
    }
}

/// Height below which no twig starts: that above which all but a fiftieth of the branches' length stays, and all but [`STUBS`]. The paper takes the
/// crown of the first scale, which begins where the lowest limb leaves the stem; shoots that hang lower would be bare there, and
/// a stub on the bole is no crown.
fn crown_base(plant: &Plant, posed: &Posed, low: f32, high: f32) -> f32 {
    let lowest = |id| posed.chain(plant, id).iter().map(|p| p.y).min_by(f32::total_cmp);
    let branches = plant.chain_ids().filter(|&id| plant.chain(id).parent.is_some());
    let mut branches: Vec<(f32, f32)> =
        branches.filter_map(|id| Some((lowest(id)?, posed.curve(plant, id).length()))).collect();
    branches.sort_by(|a, b| a.0.total_cmp(&b.0));
    let below = (branches.iter().map(|b| b.1).sum::<f32>() / 50.0).max((high - low) * STUBS);
    let mut passed = 0.0;
    let first = branches.iter().find(|(_, length)| {
        passed += length;
        passed > below
    });
    let share = if branches.is_empty() { WHIP } else { POLE };
    let lowest = first.map_or(low + (high - low) * share, |first| first.0);
    lowest.max(low + (high - low) * 0.08)
}

/// The lowest place of the branches and of the stems' bases.
fn ground(plant: &Plant, posed: &Posed) -> f32 {
    let places = |id| match plant.chain(id).parent {
        Some(_) => posed.chain(plant, id),
        None => &posed.chain(plant, id)[..1],
    };
    plant.chain_ids().flat_map(places).fold(f32::MAX, |low, p| low.min(p.y))
}

/// For each chain the radius of its end and a little more, where nothing leaves it there: however thick it is, a limb that
/// ends in the air has leaves at its end. 0 for others.
fn blunt_ends(plant: &Plant) -> Vec<f32> {
    let mut ends: Vec<f32> =
        plant.chain_ids().map(|id| plant.radii(id).last().map_or(0.0, |radius| radius * BLUNT)).collect();
    for chain in plant.chains() {
        if let Some(parent) = chain.parent.filter(|_| chain.location > END) {
            ends[parent.index()] = 0.0;
        }
    }
    ends
}

/// Places along wood up to a radius for each chain and above `floor`, `step` metres from each other.
fn places(plant: &Plant, posed: &Posed, thin: &[f32], floor: f32, step: f32) -> Vec<Start> {
    let mut starts = Vec::new();
    for (id, &thin) in plant.chain_ids().zip(thin) {
        let curve = posed.curve(plant, id);
        let length = curve.length();
        let count = ((length / step + 0.5) as usize).clamp(1, 100_000);
        for k in 1..=count {
            let t = k as f64 / count as f64;
            let radius = curve.value(plant.radii(id), t);
            let position = curve.point(t);
            if radius <= thin && position.y >= floor {
                let direction = posed.tangent(id, t as f32);
                starts.push(Start { chain: id, location: t as f32, position, direction, radius });
            }
        }
    }
    starts
}

/// The plant with the shoots as chains after its own; radii by the rule from the tips.
pub(super) fn add(plant: &Plant, posed: &Posed, wood: &Wood, shoots: &[Shoot]) -> Plant {
    let first = wood.starts.len();
    let mut load = vec![0.0_f64; shoots.len()];
    let power = |r: f32| math::pow64(f64::from(r), f64::from(ALLOMETRIC_EXPONENT));
    let tip = power(wood.tip);
    for i in (first..shoots.len()).rev() {
        if load[i] == 0.0 {
            load[i] = tip;
        }
        if let Some(parent) = shoots[i].parent {
            load[parent as usize] += load[i];
        }
    }
    // The shoots that grew from each, in their order.
    let grown = (0..).zip(shoots).filter_map(|(i, shoot)| Some((shoot.parent?, i)));
    let children = Groups::of(shoots.len(), grown);
    let root = |load: f64| math::pow64(load, 1.0 / f64::from(ALLOMETRIC_EXPONENT)) as f32;
    // Nearly all loads are those of a few tips.
    let known: Vec<(f64, f32)> = (0..64)
        .scan(0.0, |sum, _| {
            *sum += tip;
            Some((*sum, root(*sum)))
        })
        .collect();
    let radius = |i: u32| {
        let load = load[i as usize];
        match known.get((load / tip - 0.5) as usize) {
            Some(&(same, radius)) if same == load => radius,
            _ => root(load),
        }
    };
    let mut builder = PlantBuilder::from_plant(plant.clone());
    // Chains to be made, parents first: (first node, base, parent chain, location, frame there, most radius).
    let mut work = Vec::new();
    for (i, start) in wood.starts.iter().enumerate() {
        for &child in children.get(i) {
            let frame = posed.frame(start.chain, start.location);
            work.push((child, start.position, start.chain, start.location, frame, start.radius));
        }
    }
    let mut next = 0;
    while next < work.len() {
        let (node, base, parent, location, frame, most) = work[next];
        next += 1;
        let mut path = vec![node];
        let mut end = node;
        while let Some(&on) = children.get(end as usize).first() {
            path.push(on);
            end = on;
        }
        let path = straightened(&path, base, shoots, &children, wood.step * STRAIGHT);
        let points: Vec<Vec3> = std::iter::once(Vec3::ZERO)
            .chain(path.iter().map(|&n| frame.to_local(shoots[n as usize].position - base)))
            .collect();
        let mut radii: Vec<f32> =
            std::iter::once(node).chain(path.iter().copied()).map(|n| radius(n).min(most * 0.75)).collect();
        // Thinner towards the tip, where leaves go on.
        if let Some(last) = radii.last_mut() {
            *last *= 0.6;
        }
        let id = builder.branch(parent, location, &points, &radii);
        if path.iter().all(|&n| children.get(n as usize).len() < 2) {
            continue;
        }
        let curve = Curve::new(&points);
        let frames = curve.frames(frame);
        let parameters = curve.parameters();
        for (k, &n) in path.iter().enumerate() {
            for &side in children.get(n as usize).iter().skip(1) {
                let t = (parameters[k + 1] as f32).clamp(0.0, 1.0);
                let station = frame_at(&frames, t);
                work.push((side, shoots[n as usize].position, id, t, station, radii[k + 1]));
            }
        }
    }
    builder.finish().unwrap_or_else(|_| plant.clone())
}

/// A twig's nodes without those that lie between others within `tolerance`; forks and the tip stay.
fn straightened(path: &[u32], base: Vec3, shoots: &[Shoot], children: &Groups, tolerance: f32) -> Vec<u32> {
    let mut kept: Vec<u32> = Vec::with_capacity(path.len());
    for (k, &node) in path.iter().enumerate() {
        let next = path.get(k + 1).map(|&n| shoots[n as usize].position);
        let before = kept.last().map_or(base, |&n| shoots[n as usize].position);
        let stays = match next {
            _ if children.get(node as usize).len() > 1 => true,
            None => true,
            Some(next) => {
                let p = shoots[node as usize].position - before;
                let along = (next - before).normalize_or_zero();
                (p - along * p.dot(along)).length() > tolerance
            }
        };
        if stays {
            kept.push(node);
        }
    }
    kept
}

/// The plant without those twigs, of the chains from `first` on, on which and beyond which no leaf sits; and where each
/// chain went.
pub(super) fn prune(plant: &Plant, first: usize, leafy: &mut [bool]) -> (PlantBuilder, Vec<Option<ChainId>>) {
    for id in plant.chain_ids().rev() {
        if let (true, Some(parent)) = (leafy[id.index()], plant.chain(id).parent) {
            leafy[parent.index()] = true;
        }
    }
    let mut builder = PlantBuilder::new();
    let mut moved: Vec<Option<ChainId>> = Vec::with_capacity(leafy.len());
    for id in plant.chain_ids() {
        let chain = plant.chain(id);
        let stays = id.index() < first || leafy[id.index()];
        let place = stays.then(|| match chain.parent.and_then(|p| moved[p.index()]) {
            Some(parent) => builder.branch(parent, chain.location, plant.points(id), plant.radii(id)),
            None => builder.stem(chain.origin, plant.points(id), plant.radii(id)),
        });
        moved.push(place);
    }
    (builder, moved)
}
