//! From the surface that collapsed to each node to the node's place and radius.
//!
//! Every vertex of the first surface ended in a node: a sleeve around the axis. The node lies in the middle of its
//! sleeve's area and its radius is the mean distance of the sleeve from the axis (Au et al. 2008, section 6, who take the
//! sleeve's borders for both; the whole sleeve is steadier where it is cut askew). Then
//!
//! - rounds of axes, which a surface with holes gives, are opened where the wood is thinnest;
//! - a spur that doesn't come out of its parent's wood is the parent's;
//! - a fork lies on the line of its two thickest axes, not drawn aside by the third one's collar;
//! - sleeves much shorter than wide are one with their neighbour: where a cut runs askew, each of two holds a half of
//!   a ring, and neither its middle nor its radius;
//! - an axis goes on to the end of its surface, of which a contraction always falls short. The end is looked for in each of
//!   eight directions around the axis: trunks are cut level and lean, so that the farthest point is that of one side.

use glam::{DMat3, DVec3};

use super::facets;
use super::surface::Surface;
use super::surgery::Axes;
use super::weld::root;
use crate::source::import::limb::{Limb, LimbNode};

/// How far a spur must come out of its parent's wood, in the parent's radii from its axis.
const OUT: f64 = 1.3;
/// Passes of pruning: a spur on a spur goes with the second.
const PASSES: usize = 3;
/// Cosine of the bend up to which a fork is put on its main axis.
const STRAIGHT: f64 = 0.5;
/// From how far out, in usual radii, surface is not the axis' own.
const COLLAR: f64 = 1.5;
/// The part of a fork's sleeve that is surely nearer than a collar.
const FORK: f64 = 0.3;
/// How much wider than all beside it a sleeve may be before it is what it swallowed, a twig that shrank into it.
const SWOLLEN: f64 = 1.5;
/// The same for the end of an axis.
const SWOLLEN_END: f64 = 2.0;
/// Least distance of two nodes along an axis, in radii.
const CLOSE: f64 = 0.5;
/// Steps that joining close sleeves may take for each vertex.
const MOST_STEPS: usize = 200;
/// Directions around an axis in which its end is looked for.
const SIDES: usize = 8;
/// How far the farthest point lies beyond the end's middle, in its radii, where the end is a tip.
const POINTED: f64 = 1.0;

/// The limb of some axes, and how far its faces are from them, as a share of the distance of its vertices.
pub(super) fn limb(surface: &Surface, axes: &Axes) -> (Limb, f64) {
    let mut sleeves = Sleeves::new(surface, axes);
    sleeves.open_rounds();
    sleeves.calm();
    for _ in 0..PASSES {
        if !sleeves.prune() {
            break;
        }
    }
    sleeves.join_close();
    sleeves.calm();
    let faces = facets::share(surface, &sleeves.homes(), |k| sleeves.line(k));
    (sleeves.finish(), faces)
}

/// A surface without any axis to speak of: its own longest way.
pub(super) fn stick(positions: &[DVec3], shares: &[f64]) -> Option<Limb> {
    let mut square = DMat3::ZERO;
    let middle = mean(positions.iter().copied().zip(shares.iter().copied()))?;
    let floor = shares.iter().sum::<f64>() * 1e-6 + f64::MIN_POSITIVE;
    for (&p, &share) in positions.iter().zip(shares) {
        let d = p - middle;
        square += DMat3::from_cols(d * d.x, d * d.y, d * d.z) * (share + floor);
    }
    // Power iteration from the longest column: 40 rounds are plenty for a direction.
    let columns = [square.x_axis, square.y_axis, square.z_axis];
    let mut along = columns.into_iter().reduce(|a, b| if b.length() > a.length() { b } else { a })?.try_normalize()?;
    for _ in 0..40 {
        along = (square * along).try_normalize()?;
    }
    let far = |sign: f64| positions.iter().fold(0.0_f64, |m, &p| m.max((p - middle).dot(along) * sign));
    let (below, above) = (far(-1.0), far(1.0));
    if (below + above).is_nan() || below + above <= 0.0 {
        return None;
    }
    let radius = |sign: f64, reach: f64| {
        let near = |p: DVec3| (p - middle).dot(along) * sign >= reach * 0.3;
        let off = |p: DVec3| ((p - middle) - along * (p - middle).dot(along)).length();
        let (sum, count) = positions.iter().filter(|&&p| near(p)).fold((0.0, 0.0), |(s, c), &p| (s + off(p), c + 1.0));
        if count > 0.0 { sum / count } else { 0.0 }
    };
    let ends = [(middle - along * below, radius(-1.0, below)), (middle + along * above, radius(1.0, above))];
    Some(Limb::path(&ends))
}

/// Inside of a surface.
const NO_BORDER: u32 = u32::MAX;

/// For each vertex the least vertex of the border that it is on.
fn borders(surface: &Surface) -> Vec<u32> {
    let neighbours = surface.neighbours();
    let n = neighbours.len();
    let mut sets: Vec<u32> = (0..n as u32).collect();
    let mut on = vec![false; n];
    for (v, near) in neighbours.iter().enumerate() {
        for &(other, _) in near.iter().filter(|e| e.1 == 1) {
            on[v] = true;
            let (a, b) = (root(&mut sets, v as u32), root(&mut sets, other));
            sets[a.max(b) as usize] = a.min(b);
        }
    }
    (0..n).map(|v| if on[v] { root(&mut sets, v as u32) } else { NO_BORDER }).collect()
}

/// The mean of weighted places; none where there is none.
fn mean(places: impl Iterator<Item = (DVec3, f64)>) -> Option<DVec3> {
    let (mut sum, mut weight, mut plain, mut count) = (DVec3::ZERO, 0.0, DVec3::ZERO, 0.0);
    for (p, w) in places {
        sum += p * w;
        weight += w;
        plain += p;
        count += 1.0;
    }
    if weight > 0.0 {
        Some(sum / weight)
    } else if count > 0.0 {
        Some(plain / count)
    } else {
        None
    }
}

struct Sleeves<'a> {
    surface: &'a Surface,
    shares: Vec<f64>,
    /// For each vertex the border that it is on, by number; [`NO_BORDER`] for those inside.
    border: Vec<u32>,
    /// The vertices of each node's sleeve; empty for nodes that are gone.
    members: Vec<Vec<u32>>,
    links: Vec<Vec<u32>>,
    middles: Vec<DVec3>,
    radii: Vec<f64>,
}

impl<'a> Sleeves<'a> {
    fn new(surface: &'a Surface, axes: &Axes) -> Self {
        let mut members = vec![Vec::new(); axes.count];
        for (v, &home) in axes.home.iter().enumerate() {
            members[home as usize].push(v as u32);
        }
        let mut links = vec![Vec::new(); axes.count];
        for &[a, b] in &axes.edges {
            links[a as usize].push(b);
            links[b as usize].push(a);
        }
        let mut sleeves = Self {
            surface,
            shares: surface.shares(),
            border: borders(surface),
            members,
            links,
            middles: vec![DVec3::ZERO; axes.count],
            radii: vec![0.0; axes.count],
        };
        (0..axes.count).for_each(|k| sleeves.middle(k));
        (0..axes.count).for_each(|k| sleeves.radius(k));
        sleeves
    }

    fn middle(&mut self, k: usize) {
        let places = self.members[k].iter().map(|&v| (self.surface.positions[v as usize], self.shares[v as usize]));
        if let Some(middle) = mean(places) {
            self.middles[k] = middle;
        }
    }

    /// The direction of the axis at a node, from what is beside it.
    fn along(&self, k: usize) -> Option<DVec3> {
        let (a, b) = match *self.links[k].as_slice() {
            [] => return None,
            [a] => (k as u32, a),
            [a, b] => (a, b),
            _ => self.main(k),
        };
        (self.middles[b as usize] - self.middles[a as usize]).try_normalize()
    }

    /// For each vertex its node.
    fn homes(&self) -> Vec<u32> {
        let mut homes = vec![u32::MAX; self.surface.positions.len()];
        for (k, members) in self.members.iter().enumerate() {
            members.iter().for_each(|&v| homes[v as usize] = k as u32);
        }
        homes
    }

    /// Place, direction and radius of the axis at a node inside of it.
    fn line(&self, k: usize) -> Option<(DVec3, DVec3, f64)> {
        let plain = self.links[k].len() <= 2;
        self.along(k).filter(|_| plain).map(|along| (self.middles[k], along, self.radii[k]))
    }

    /// The two neighbours of a fork that carry its main axis: the thickest, and the one of the rest that is thick and in
    /// line with it.
    fn main(&self, k: usize) -> (u32, u32) {
        let links = &self.links[k];
        let radius = |v: u32| self.radii[v as usize];
        let first = links.iter().copied().reduce(|a, b| if radius(b) > radius(a) { b } else { a }).unwrap_or(k as u32);
        let from = (self.middles[k] - self.middles[first as usize]).normalize_or_zero();
        let worth = |v: u32| {
            let to = (self.middles[v as usize] - self.middles[k]).normalize_or_zero();
            radius(v) * (1.2 + from.dot(to))
        };
        let rest = links.iter().copied().filter(|&v| v != first);
        (first, rest.reduce(|a, b| if worth(b) > worth(a) { b } else { a }).unwrap_or(first))
    }

    fn off(&self, k: usize, along: DVec3, v: u32) -> f64 {
        let d = self.surface.positions[v as usize] - self.middles[k];
        (d - along * d.dot(along)).length()
    }

    fn radius(&mut self, k: usize) {
        let along = self.along(k).unwrap_or(DVec3::ZERO);
        let mut offs: Vec<(f64, f64)> =
            self.members[k].iter().map(|&v| (self.off(k, along, v), self.shares[v as usize])).collect();
        if offs.is_empty() {
            return;
        }
        offs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        // Most of a sleeve lies at its radius. What lies much farther out is the collar of a branch, or all of a twig
        // that went with it; at a fork that can be the greater part.
        let share = if self.links[k].len() > 2 { FORK } else { 0.5 };
        let usual = offs[((offs.len() - 1) as f64 * share) as usize].0;
        let floor = offs.iter().map(|o| o.1).sum::<f64>() * 1e-3 + f64::MIN_POSITIVE;
        let (mut sum, mut weight) = (0.0, 0.0);
        for (off, share) in offs.into_iter().take_while(|o| o.0 <= usual * COLLAR) {
            sum += off * (share + floor);
            weight += share + floor;
        }
        if weight > 0.0 {
            self.radii[k] = sum / weight;
        }
    }

    /// Keeps a spanning tree, thick wood first.
    fn open_rounds(&mut self) {
        let n = self.links.len();
        let mut edges: Vec<(f64, u32, u32)> = Vec::new();
        for (a, near) in self.links.iter().enumerate() {
            let thin = |b: u32| self.radii[a].min(self.radii[b as usize]);
            edges.extend(near.iter().filter(|&&b| b as usize > a).map(|&b| (thin(b), a as u32, b)));
        }
        edges.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        let mut sets: Vec<u32> = (0..n as u32).collect();
        self.links = vec![Vec::new(); n];
        for (_, a, b) in edges {
            let (x, y) = (root(&mut sets, a), root(&mut sets, b));
            if x != y {
                sets[x as usize] = y;
                self.links[a as usize].push(b);
                self.links[b as usize].push(a);
            }
        }
    }

    /// Gives the sleeves of spurs to the forks that they leave; whether there was any.
    fn prune(&mut self) -> bool {
        let ends: Vec<usize> = (0..self.links.len()).filter(|&k| self.links[k].len() == 1).collect();
        let mut any = false;
        for end in ends {
            if self.links[end].len() != 1 {
                continue;
            }
            let mut branch = vec![end];
            let mut at = self.links[end][0] as usize;
            let mut length = self.middles[end].distance(self.middles[at]);
            while self.links[at].len() == 2 && length < self.radii[at] * 4.0 {
                let before = branch[branch.len() - 1] as u32;
                let next = if self.links[at][0] == before { self.links[at][1] } else { self.links[at][0] } as usize;
                length += self.middles[at].distance(self.middles[next]);
                branch.push(at);
                at = next;
            }
            if self.links[at].len() < 3 {
                continue;
            }
            let (fork, middle) = (self.radii[at], self.middles[at]);
            let along = self.along(at).unwrap_or(DVec3::ZERO);
            let out = branch.iter().flat_map(|&k| &self.members[k]).fold(0.0_f64, |m, &v| {
                let d = self.surface.positions[v as usize] - middle;
                // Past the fork along its own axis, a stub is no spur but the axis' end.
                let beyond = (d.dot(along).abs() - fork).max(0.0);
                m.max((d - along * d.dot(along)).length() + beyond)
            });
            if out > fork * OUT {
                continue;
            }
            any = true;
            let last = branch[branch.len() - 1] as u32;
            self.links[at].retain(|&n| n != last);
            for k in branch {
                let gone = std::mem::take(&mut self.members[k]);
                self.members[at].extend(gone);
                self.links[k].clear();
            }
            self.middle(at);
            self.radius(at);
        }
        any
    }

    /// Whether a node and the one beside it are all there is. Of a twig's base and its tip neither tells that the other is
    /// off.
    fn is_one_of_two(&self, k: usize) -> bool {
        matches!(*self.links[k].as_slice(), [n] if self.links[n as usize].len() == 1)
    }

    /// Gives sleeves that are much wider than all beside them their neighbours' radius, and their place on the way between.
    fn calm(&mut self) {
        let swollen: Vec<(usize, f64)> = (0..self.links.len())
            .filter(|&k| !self.is_one_of_two(k))
            .filter_map(|k| {
                let most = self.links[k].iter().fold(0.0_f64, |m, &n| m.max(self.radii[n as usize]));
                // A trunk may well be wider at its foot.
                let share = if self.links[k].len() > 1 { SWOLLEN } else { SWOLLEN_END };
                (most > 0.0 && self.radii[k] > most * share).then_some((k, most))
            })
            .collect();
        for (k, most) in swollen {
            self.radii[k] = most;
            if self.links[k].len() < 2 {
                continue;
            }
            let (a, b) = self.main(k);
            let (from, to) = (self.middles[a as usize], self.middles[b as usize]);
            let way = to - from;
            if way.length_squared() > 0.0 {
                let t = ((self.middles[k] - from).dot(way) / way.length_squared()).clamp(0.0, 1.0);
                self.middles[k] = from + way * t;
            }
        }
    }

    /// Makes one of neighbours along an axis that are nearer than a part of their radius.
    fn join_close(&mut self) {
        let mut steps = MOST_STEPS * self.surface.positions.len();
        let mut work: Vec<u32> = (0..self.links.len() as u32).rev().collect();
        while let Some(k) = work.pop() {
            let k = k as usize;
            // At least one edge stays.
            if !(1..=2).contains(&self.links[k].len()) {
                continue;
            }
            let near = |&n: &u32| {
                let n = n as usize;
                let (one, other) = (self.links[k].len(), self.links[n].len());
                (other == 2 || other == 1 && one == 2)
                    && self.middles[k].distance(self.middles[n]) < CLOSE * self.radii[k].max(self.radii[n])
            };
            let Some(&n) = self.links[k].iter().find(|n| near(n)) else { continue };
            let larger = self.members[n as usize].len() > self.members[k].len();
            let (from, to) = if larger { (k, n as usize) } else { (n as usize, k) };
            let all = self.members[from].len() + self.members[to].len();
            if all > steps {
                return;
            }
            steps -= all;
            let moved = std::mem::take(&mut self.members[from]);
            self.members[to].extend(moved);
            self.links[to].retain(|&l| l as usize != from);
            for l in std::mem::take(&mut self.links[from]).into_iter().filter(|&l| l as usize != to) {
                self.links[to].push(l);
                self.links[l as usize].iter_mut().filter(|m| **m as usize == from).for_each(|m| *m = to as u32);
            }
            self.middle(to);
            self.radius(to);
            work.push(to as u32);
        }
    }

    /// Middle and radius of the end of the surface beyond the last node of an axis; none where the axis reaches it.
    fn end(&self, k: usize) -> Option<LimbNode> {
        let [before] = *self.links[k].as_slice() else { return None };
        let along = (self.middles[k] - self.middles[before as usize]).try_normalize()?;
        let (x, y) = along.any_orthonormal_pair();
        // The farthest vertex on each side: how far ahead it is, and its place.
        let mut sides: [Option<(f64, DVec3)>; SIDES] = [None; SIDES];
        let mut tip = (0.0, self.middles[k]);
        // Half of an end's ring may have gone to the node before it.
        let all = || self.members[k].iter().chain(&self.members[before as usize]).copied();
        for v in all() {
            let p = self.surface.positions[v as usize];
            let d = p - self.middles[k];
            let ahead = d.dot(along);
            if ahead > tip.0 {
                tip = (ahead, p);
            }
            let (u, w) = (d.dot(x), d.dot(y));
            // Eight sides by the signs of both coordinates and by which of them is larger.
            let side = usize::from(u > 0.0) + 2 * usize::from(w > 0.0) + 4 * usize::from(u.abs() > w.abs());
            if sides[side].is_none_or(|(most, _)| ahead > most) {
                sides[side] = Some((ahead, p));
            }
        }
        if tip.0 <= self.radii[k] * 0.05 {
            return None;
        }
        // Where the surface is open, its border is the end. A side on which the surface ends far below the tip has none of it.
        let near = |p: DVec3| (p - self.middles[k]).dot(along) >= tip.0 - self.radii[k] * 2.0;
        let place = |v: u32| self.surface.positions[v as usize];
        let open = |v: &u32| self.border[*v as usize] != NO_BORDER && near(place(*v));
        let border = self.members[k].iter().copied().find(open).map(|v| self.border[v as usize]);
        let on = |v: &u32| border.is_some_and(|b| self.border[*v as usize] == b) && near(place(*v));
        let mut ends: Vec<DVec3> = all().filter(on).map(place).collect();
        if ends.len() < 3 {
            ends = sides.iter().flatten().map(|side| side.1).filter(|&p| near(p)).collect();
        }
        let count = ends.len().max(1) as f64;
        let middle = ends.iter().sum::<DVec3>() / count;
        let off = |p: DVec3| {
            let d = p - middle;
            (d - along * d.dot(along)).length()
        };
        let radius = (ends.iter().map(|&p| off(p)).sum::<f64>() / count).min(self.radii[k] * COLLAR);
        let short = (tip.1 - middle).dot(along);
        if short <= radius * POINTED {
            return Some(LimbNode { position: middle, radius });
        }
        // A tip: what lies about its own end.
        let last = tip.0 - short * 0.5;
        let (mut sum, mut count) = (DVec3::ZERO, 0.0);
        let about = || {
            let members = self.members[k].iter().map(|&v| self.surface.positions[v as usize]);
            members.filter(|p| (*p - self.middles[k]).dot(along) >= last)
        };
        for p in about() {
            sum += p;
            count += 1.0;
        }
        let middle = if count > 0.0 { sum / count } else { tip.1 };
        let middle = middle + along * (tip.1 - middle).dot(along);
        let off = |p: DVec3| {
            let d = p - middle;
            (d - along * d.dot(along)).length()
        };
        let radius = about().map(off).sum::<f64>() / f64::max(count, 1.0);
        Some(LimbNode { position: middle, radius: radius.min(self.radii[k] * COLLAR) })
    }

    fn finish(mut self) -> Limb {
        let n = self.links.len();
        let forks: Vec<usize> = (0..n).filter(|&k| self.links[k].len() > 2).collect();
        let placed: Vec<(usize, DVec3, f64)> = forks
            .iter()
            .filter_map(|&k| {
                let (a, b) = self.main(k);
                let (a, b) = (a as usize, b as usize);
                let (from, to) = (self.middles[a], self.middles[b]);
                let bend = (self.middles[k] - from).normalize_or_zero().dot((to - self.middles[k]).normalize_or_zero());
                if bend < STRAIGHT {
                    return None;
                }
                let way = to - from;
                let t = ((self.middles[k] - from).dot(way) / way.length_squared()).clamp(0.0, 1.0);
                let between = self.radii[a] + (self.radii[b] - self.radii[a]) * t;
                Some((k, from + way * t, self.radii[k].min(between * 1.1)))
            })
            .collect();
        for (k, middle, radius) in placed {
            self.middles[k] = middle;
            self.radii[k] = radius;
        }
        let mut name = vec![u32::MAX; n];
        let mut limb = Limb::default();
        for (k, name) in name.iter_mut().enumerate() {
            if !self.members[k].is_empty() {
                *name = limb.nodes.len() as u32;
                limb.nodes.push(LimbNode { position: self.middles[k], radius: self.radii[k] });
            }
        }
        for (k, &own) in name.iter().enumerate() {
            let near = self.links[k].iter().filter(|&&b| b as usize > k);
            limb.edges.extend(near.map(|&b| [own, name[b as usize]]));
        }
        if limb.nodes.len() == 1 {
            return stick(&self.surface.positions, &self.shares).unwrap_or(limb);
        }
        for (k, &own) in name.iter().enumerate() {
            let Some(end) = self.end(k) else { continue };
            // A last bit shorter than wide points anywhere, and would tilt the end.
            if end.position.distance(self.middles[k]) < CLOSE * end.radius {
                limb.nodes[own as usize] = end;
            } else {
                limb.edges.push([own, limb.nodes.len() as u32]);
                limb.nodes.push(end);
            }
        }
        limb
    }
}
