//! A closed crown becomes branches and leaves: what a low mesh shows as one green lump.
//!
//! Chains grow into the volume by space colonization (Runions et al. 2007) from the axes that reach it or, where none
//! does, from the place nearest to it, so that blending finds a crown of wood. Leaves sit near the surface, close enough
//! that the silhouette stays: most just below the skin with their tips at it, some deeper so that nobody sees through.
//! Each stands on the nearest chain.
//!
//! The number of leaves follows from the surface and the size of a leaf, which is a share of the crown's width.

use glam::Vec3;

use super::attach::Axes;
use super::near::Near;
use super::volume::Volume;
use crate::base::{Frame, Rotation, Seed, math};
use crate::plant::{ALLOMETRIC_EXPONENT, ChainId, Curve, Leaf, Plant, PlantBuilder, frame_at};

/// Points that pull branches, over all crowns.
const PULLS: usize = 420;
/// Rounds of growth.
const ROUNDS: usize = 80;
/// How near to another node, in steps, none grows.
const HELD: f32 = 0.3;
/// Radius of a tip as a share of the height.
const TIP: f32 = 6e-4;
/// How thick a branch is at most that leaves wood before its end, as a share of that.
const SIDE: f32 = 0.5;
/// And how thick such a branch is at most, as a share of its length from there on.
const STOUT: f32 = 0.035;
/// Leaf area over the area of the crown's surface.
const COVER: f32 = 5.0;
/// Length of a leaf's card as a share of the cube root of the crown's volume.
const LENGTH: f32 = 0.2;
/// Most leaves on all crowns of a plant.
const MOST_LEAVES: usize = 12_000;
/// Share of the leaves that lie deeper.
const DEEP: f32 = 0.22;

/// A crown in the plant's space.
#[derive(Debug)]
pub(super) struct Crown {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// First of the slots that its leaves wear, and how many there are.
    pub(super) slots: (u16, u16),
}

/// The plant with its crowns filled; the plant as it is where they hold nothing.
pub(super) fn fill(plant: Plant, crowns: &[Crown], seed: Seed) -> Plant {
    let volumes: Vec<Option<Volume>> = crowns.iter().map(|c| Volume::new(&c.positions, &c.triangles)).collect();
    let size = |v: &Volume| (v.cells().count() as f32 * v.cell() * v.cell() * v.cell()).max(0.0);
    let sizes: Vec<f32> = volumes.iter().map(|v| v.as_ref().map_or(0.0, size)).collect();
    let total: f32 = sizes.iter().sum();
    if total <= 0.0 {
        return plant;
    }
    let mut pulls = Vec::new();
    for (i, volume) in volumes.iter().enumerate() {
        let Some(volume) = volume else { continue };
        let cells: Vec<Vec3> = volume.cells().collect();
        let share = (PULLS as f32 * sizes[i] / total) as usize;
        let wanted = share.clamp(12, 300).min(cells.len());
        for k in 0..wanted {
            // One of each run of cells, shaken: even and never twice the same.
            let s = seed.child("pull").at(i as u64).at(k as u64);
            let run = k * cells.len() / wanted..(k + 1) * cells.len() / wanted;
            let jitter = s.child("place").direction() * (volume.cell() * 0.5);
            pulls.push(cells[run.start + s.index(run.len())] + jitter);
        }
    }
    let step = math::cbrt(total / pulls.len().max(1) as f32) * 0.6;
    let plant = grow(plant, &pulls, step, seed.child("grow"));
    leaves(plant, crowns, &volumes, &sizes, seed.child("leaves"))
}

/// A node of a new branch.
#[derive(Clone, Copy)]
struct Node {
    position: Vec3,
    parent: Option<u32>,
    /// Where on the plant it starts; for nodes without a parent.
    start: (ChainId, f32),
}

/// Branches from the plant's axes to the points.
fn grow(plant: Plant, pulls: &[Vec3], step: f32, seed: Seed) -> Plant {
    let posed = plant.pose();
    let axes = Axes::of(&plant, &posed);
    let mut nodes: Vec<Node> = Vec::new();
    let mut open: Vec<Vec3> = pulls.to_vec();
    let (low, high) = pulls.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    let near_crown = |p: Vec3| (low - p).max(p - high).max(Vec3::ZERO).length() <= step;
    // The plant's own axes where they are in the crowns' box, and in any case what lies nearest to each point's crown.
    for id in plant.chain_ids() {
        let curve = posed.curve(&plant, id);
        let steps = ((curve.length() / step).ceil() as u32).clamp(1, 400);
        for k in 0..=steps {
            let t = f64::from(k) / f64::from(steps);
            let position = curve.point(t);
            if near_crown(position) && (k > 0 || plant.chain(id).parent.is_none()) {
                nodes.push(Node { position, parent: None, start: (id, t as f32) });
            }
        }
    }
    if nodes.is_empty()
        && let Some(found) = pulls.iter().filter_map(|p| axes.nearest(*p)).min_by(|a, b| a.2.total_cmp(&b.2))
    {
        let position = posed.at(&plant, found.0, found.1).position;
        nodes.push(Node { position, parent: None, start: (found.0, found.1) });
    }
    let first = nodes.len();
    if first == 0 {
        return plant;
    }
    for round in 0..ROUNDS {
        let near = Near::new(nodes.iter().map(|n| n.position));
        let mut sums: Vec<(u32, Vec3, f32)> = Vec::new();
        for p in &open {
            if let Some((i, distance)) = near.find(*p) {
                sums.push((i, (*p - nodes[i as usize].position).normalize_or_zero(), distance));
            }
        }
        sums.sort_by(|a, b| a.0.cmp(&b.0).then(a.2.total_cmp(&b.2)));
        let before = nodes.len();
        for group in sums.chunk_by(|a, b| a.0 == b.0) {
            let from = nodes[group[0].0 as usize];
            let pull: Vec3 = group.iter().map(|(_, d, _)| *d).sum();
            // Towards the nearest where the pulls cancel each other.
            let pull = if pull.length() < 0.2 { group[0].1 } else { pull.normalize_or_zero() };
            let wander = seed.at(round as u64).at(u64::from(group[0].0)).direction() * 0.15;
            // Where points in balance held it before it goes to the nearest: it would grow the same way in every round.
            let ways = [pull + wander, group[0].1].into_iter().filter_map(Vec3::try_normalize);
            let mut places = ways.map(|way| from.position + way * step.min(group[group.len() - 1].2));
            let is_held = |place: &Vec3| near.find(*place).is_some_and(|(i, d)| i != group[0].0 && d < step * HELD);
            let Some(position) = places.find(|place| !is_held(place)) else { continue };
            nodes.push(Node { position, parent: Some(group[0].0), start: from.start });
        }
        let near = Near::new(nodes[before..].iter().map(|n| n.position));
        open.retain(|p| near.find(*p).is_none_or(|(_, d)| d > step * 1.05));
        if nodes.len() == before || open.is_empty() || nodes.len() > PULLS * 12 {
            break;
        }
    }
    branches(&plant, &posed, &nodes, first)
}

/// Nodes to chains; the longest way on carries on a chain.
fn branches(plant: &Plant, posed: &crate::plant::Posed, nodes: &[Node], first: usize) -> Plant {
    let mut children: Vec<Vec<u32>> = vec![Vec::new(); nodes.len()];
    let mut reach = vec![0.0_f32; nodes.len()];
    let mut load = vec![0.0_f32; nodes.len()];
    for i in (first..nodes.len()).rev() {
        load[i] = load[i].max(1.0);
        if let Some(p) = nodes[i].parent {
            let step = nodes[p as usize].position.distance(nodes[i].position);
            reach[p as usize] = reach[p as usize].max(reach[i] + step);
            load[p as usize] += load[i];
        }
    }
    for (i, node) in nodes.iter().enumerate() {
        if let Some(parent) = node.parent {
            children[parent as usize].push(i as u32);
        }
    }
    for list in &mut children {
        list.sort_by(|&a, &b| reach[b as usize].total_cmp(&reach[a as usize]).then(a.cmp(&b)));
    }
    let height = posed.positions().iter().fold(0.0_f32, |top, p| top.max(p.y));
    let tip = height * TIP;
    let borne = borne(plant, &nodes[..first], &load);
    let mut builder = PlantBuilder::from_plant(plant.clone());
    let mut radii = vec![0.0_f32; nodes.len()];
    for (i, node) in nodes[..first].iter().enumerate() {
        let (chain, t) = node.start;
        radii[i] = posed.curve(plant, chain).value(plant.radii(chain), f64::from(t)).max(tip);
    }
    // Wood goes on as thick as it ends and narrows towards the tips: however few branches a crown takes, a bare tree is not stumps
    // that bear threads.
    let mut start: Vec<u32> = (0..nodes.len() as u32).collect();
    // How much of what the wood bears that a node's branch starts from goes through the node.
    let share = |i: usize, from: usize| math::pow(load[i] / borne[from], 1.0 / ALLOMETRIC_EXPONENT);
    let is_end = |from: usize| nodes[from].start.1 >= 1.0;
    for i in first..nodes.len() {
        let Some(parent) = nodes[i].parent.map(|p| p as usize) else { continue };
        start[i] = start[parent];
        let from = start[i] as usize;
        let grown = tip * math::pow(load[i], 1.0 / ALLOMETRIC_EXPONENT);
        let goes_on = radii[from] * share(i, from) * reach[i] / reach[from].max(1e-9);
        let goes_on = if is_end(from) { goes_on } else { goes_on.min(reach[i] * STOUT) };
        let most = if parent < first && !is_end(from) { radii[parent] * SIDE } else { radii[parent] };
        radii[i] = goes_on.max(grown).min(most);
    }
    // Chains to be made: first node, base, bearer, location and frame there, radius at the base.
    let mut work: Vec<(u32, Vec3, ChainId, f32, Frame, f32)> = Vec::new();
    for (i, node) in nodes[..first].iter().enumerate() {
        let (chain, t) = node.start;
        for &child in &children[i] {
            // What leaves the very end goes on with it, the rest are branches.
            let wide = if is_end(i) { radii[i] * share(child as usize, i) } else { 0.0 };
            let wide = wide.max(radii[child as usize]);
            work.push((child, node.position, chain, t, posed.frame(chain, t), wide));
        }
    }
    let mut next = 0;
    while next < work.len() {
        let (node, base, parent, location, frame, wide) = work[next];
        next += 1;
        let mut path = vec![node];
        while let Some(&on) = children[path[path.len() - 1] as usize].first() {
            path.push(on);
        }
        let local = |n: &u32| frame.to_local(nodes[*n as usize].position - base);
        let points: Vec<Vec3> = std::iter::once(Vec3::ZERO).chain(path.iter().map(local)).collect();
        let along: Vec<f32> = std::iter::once(wide).chain(path.iter().map(|n| radii[*n as usize])).collect();
        let id = builder.branch(parent, location, &points, &along);
        let curve = Curve::new(&points);
        let (frames, parameters) = (curve.frames(frame), curve.parameters());
        for (k, &n) in path.iter().enumerate() {
            for &side in children[n as usize].iter().skip(1) {
                let t = (parameters[k + 1] as f32).clamp(0.0, 1.0);
                work.push((side, nodes[n as usize].position, id, t, frame_at(&frames, t), radii[side as usize]));
            }
        }
    }
    builder.finish().unwrap_or_else(|_| plant.clone())
}

/// For each node that starts on the plant the tips that the wood bears from there on.
fn borne(plant: &Plant, starts: &[Node], load: &[f32]) -> Vec<f32> {
    let mut whole = vec![0.0_f32; plant.chains().len()];
    let mut borne = vec![0.0; starts.len()];
    let children = plant.children();
    // Nodes stand in the order of their chains and along them; chains after those that bear them.
    let mut i = starts.len();
    for chain in plant.chain_ids().rev() {
        let mut children = children[chain.index()].clone();
        children.sort_by(|a, b| plant.chain(*a).location.total_cmp(&plant.chain(*b).location));
        let mut beyond = 0.0;
        while let Some(before) = i.checked_sub(1).filter(|&before| starts[before].start.0 == chain) {
            let t = starts[before].start.1;
            while let Some(child) = children.pop_if(|child| plant.chain(*child).location >= t) {
                beyond += whole[child.index()];
            }
            beyond += load[before];
            borne[before] = beyond;
            i = before;
        }
        whole[chain.index()] = beyond + children.iter().map(|child| whole[child.index()]).sum::<f32>();
    }
    borne
}

/// Leaves below the crowns' surfaces, each on the nearest chain.
fn leaves(plant: Plant, crowns: &[Crown], volumes: &[Option<Volume>], sizes: &[f32], seed: Seed) -> Plant {
    let posed = plant.pose();
    let axes = Axes::of(&plant, &posed);
    let mut builder = PlantBuilder::from_plant(plant.clone());
    let areas: Vec<f32> =
        crowns.iter().map(|c| c.triangles.iter().map(|t| normal(c, t).length() * 0.5).sum::<f32>()).collect();
    let wanted = |i: usize| {
        let length = math::cbrt(sizes[i]) * LENGTH;
        if length > 0.0 { COVER * areas[i] / (length * length) } else { 0.0 }
    };
    let all: f32 = (0..crowns.len()).map(wanted).sum();
    let fewer = (all / MOST_LEAVES as f32).max(1.0);
    for (i, (crown, volume)) in crowns.iter().zip(volumes).enumerate() {
        let Some(volume) = volume else { continue };
        // Fewer and larger where there would be too many.
        let length = math::cbrt(sizes[i]) * LENGTH * fewer.sqrt();
        let count = (wanted(i) / fewer) as usize;
        let centre = volume.cells().sum::<Vec3>() / volume.cells().count().max(1) as f32;
        let mut sums: Vec<f32> = Vec::with_capacity(crown.triangles.len());
        for t in &crown.triangles {
            sums.push(sums.last().copied().unwrap_or(0.0) + normal(crown, t).length());
        }
        let whole = sums.last().copied().unwrap_or(0.0);
        for k in 0..count {
            let s = seed.at(i as u64).at(k as u64);
            // Strata of the surface, so that no place stays bare.
            let at = (k as f32 + s.child("at").unit()) / count as f32 * whole;
            let t = crown.triangles[sums.partition_point(|&sum| sum < at).min(sums.len() - 1)];
            let [a, b, c] = t.map(|i| crown.positions[i as usize]);
            let (mut u, mut v) = (s.child("u").unit(), s.child("v").unit());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let place = a + (b - a) * u + (c - a) * v;
            let mut out = normal(crown, &t).normalize_or(Vec3::Y);
            // Whichever way round the file has its triangles.
            let inner = volume.contains(place - out * volume.cell() * 1.5);
            let outer = volume.contains(place + out * volume.cell() * 1.5);
            if outer && !inner {
                out = -out;
            }
            let deep = s.child("deep").unit() < DEEP;
            let aside = s.child("aside").direction();
            let y = (out * 0.75 + aside * 0.65 + Vec3::NEG_Y * 0.18).normalize_or(out);
            // The tip ends at the surface, or a good way below it.
            let below = if deep { s.child("below").range(0.8, 2.6) } else { s.child("below").range(-0.12, 0.2) };
            let tip = place - out * (below * length);
            let tip = if deep { tip.lerp(centre, 0.15) } else { tip };
            let base = tip - y * length;
            let face = out + Vec3::Y * 0.25 + s.child("face").direction() * 0.5;
            let z = (face - y * face.dot(y)).try_normalize().unwrap_or_else(|| Frame::along(y).z);
            let Some((chain, location, _)) = axes.nearest(base) else { continue };
            let here = posed.at(&plant, chain, location);
            let [x, y, z] = [y.cross(z), y, z].map(|v| here.frame.to_local(v));
            let slot = crown.slots.0 + s.child("slot").index(usize::from(crown.slots.1)) as u16;
            let size = length * s.child("size").range(0.8, 1.2);
            let leaf = Leaf::new(chain, location, Rotation::from_axes(x, y, z), size, slot);
            builder.leaf(Leaf { offset: here.frame.to_local(base - here.position), ..leaf });
        }
    }
    builder.finish().unwrap_or(plant)
}

/// Twice the area vector of a triangle.
fn normal(crown: &Crown, t: &[u32; 3]) -> Vec3 {
    let [a, b, c] = t.map(|i| crown.positions[i as usize]);
    (b - a).cross(c - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_in_balance_hold_no_branch() {
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y], &[0.05, 0.02]);
        let pole = builder.finish().unwrap();
        // A step between the first two comes nearer to neither.
        for [aside, rise] in [[0.158, 0.024], [1.0, 0.3], [1.0, 0.7]] {
            let pulls = [-aside, aside].map(|side| Vec3::new(side, 1.0 + rise, 0.0));
            let filled = grow(pole.clone(), &pulls, 0.1, Seed::new(1));
            assert!((2..12).contains(&filled.chains().len()), "{rise}: {} chains", filled.chains().len());
            let posed = filled.pose();
            for pull in pulls {
                let near = posed.positions().iter().map(|p| p.distance(pull)).fold(f32::MAX, f32::min);
                assert!(near < 0.12, "{rise}: {near}");
            }
        }
    }

    #[test]
    fn wood_goes_on_as_thick_as_it_ends_and_narrows_to_the_tips() {
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 2.0], &[0.2, 0.15]);
        let stub = builder.finish().unwrap();
        let pulls: Vec<Vec3> =
            (0..60).map(|k| Vec3::Y * 3.5 + Seed::new(7).at(k).direction() * 1.4).filter(|p| p.y > 2.1).collect();
        let filled = grow(stub, &pulls, 0.2, Seed::new(1));
        let branches = || filled.chain_ids().skip(1);
        let leader = branches().find(|&id| filled.chain(id).location >= 1.0).expect("something leaves the end");
        let foot =
            branches().filter(|&id| filled.chain(id).location >= 1.0).map(|id| filled.radii(id)[0]).fold(0.0, f32::max);
        assert!((0.12..=0.15).contains(&foot), "{foot}");
        for id in branches() {
            let radii = filled.radii(id);
            assert!(radii.windows(2).all(|pair| pair[1] <= pair[0] + 1e-6), "{radii:?}");
            assert!(radii[radii.len() - 1] < 0.01, "{radii:?}");
        }
        assert!(filled.radii(leader).len() > 2);
    }
}
