//! Geodesics of tree-shape space under the QED metric (2018 TOG, 4.2; Owen and Provan 2011).
//!
//! Two points differ in edges that both have (their attributes change along a straight line), in edges of one that fit into
//! the other's topology (they grow or collapse evenly) and in edges that can't be there together: stretches of a chain with
//! different sets of branches before them, none of which holds the other. Those of the first must collapse before those of the
//! second expand. A path is a sequence of legs `(A, B)`: the edges A collapse together, then B expand.
//!
//! *Initial path.* The edges of A are collapsed one after the other, shortest first, and an edge of B is expanded as soon
//! as nothing is in its way. (The paper takes paths from a queue in order of length; with the correspondence given the
//! cheapest next collapse is always the shortest edge, so no queue is needed.)
//!
//! *Straightening.* Legs out of order of `|A| / |B|` are joined. A leg is split where a vertex cover of its
//! incompatible pairs weighs less than 1, with weights `|a|² / |A|²` and `|b|² / |B|²`; then it was not straight. When
//! neither applies, the path is the geodesic (Owen and Provan, Theorem 2.5). An edge of A is incompatible with a run of edges of B,
//! and the runs move up with it, so the least cover, a maximum flow, is found by filling in order.
//!
//! The axes are independent, and each goes at constant speed, so the whole does.

use super::tree_point::{Axis, COLLAPSED, Edge, TreePoint};

/// Covers this near to 1 split nothing.
const SLACK: f64 = 1e-9;

/// The shortest way between two points.
#[derive(Clone, Debug)]
pub struct TreeGeodesic {
    axes: Vec<AxisWay>,
    parents: Vec<Option<u32>>,
}

/// Which side an edge is of, and after how many of its groups it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Of {
    /// After this many groups of the first point.
    First(u32),
    /// After this many groups of the second point.
    Second(u32),
}

/// Edges that collapse together, and those that expand in their place.
#[derive(Clone, Debug)]
struct Leg {
    a: Vec<usize>,
    b: Vec<usize>,
}

/// A chain's part of the way.
#[derive(Clone, Debug)]
struct AxisWay {
    first: Axis,
    second: Axis,
    /// Kin, its group in the first point, its group in the second.
    kins: Vec<(u32, u32, u32)>,
    /// Edges that are there all along: where, and both values.
    common: Vec<(Of, Edge, Edge)>,
    legs: Vec<Leg>,
}

impl TreeGeodesic {
    /// The geodesic between two points of one family.
    #[must_use]
    pub fn new(first: &TreePoint, second: &TreePoint) -> Self {
        let axes = first.axes.iter().zip(&second.axes).map(|(a, b)| AxisWay::new(a, b)).collect();
        Self { axes, parents: first.parents.clone() }
    }

    /// Its length: the QED distance of its ends, metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.axes.iter().map(AxisWay::square).sum::<f64>().sqrt()
    }

    /// The L1 variant, the tree edit distance: the attributes of all edges that are changed, added or removed, metres.
    #[must_use]
    pub fn edit_length(&self) -> f64 {
        self.axes.iter().map(AxisWay::edits).sum()
    }

    /// How many times the way turns from one orthant into another that is not on its boundary.
    #[must_use]
    pub fn turns(&self) -> usize {
        self.axes.iter().map(|axis| axis.legs.len()).sum()
    }

    /// The point at a share of the way, 0..=1.
    #[must_use]
    pub fn at(&self, share: f64) -> TreePoint {
        let share = share.clamp(0.0, 1.0);
        TreePoint { axes: self.axes.iter().map(|axis| axis.at(share)).collect(), parents: self.parents.clone() }
    }

    /// The point halfway.
    #[must_use]
    pub fn midpoint(&self) -> TreePoint {
        self.at(0.5)
    }
}

fn norm(edge: &Edge) -> f64 {
    square(edge).sqrt()
}

fn square(edge: &Edge) -> f64 {
    edge.iter().map(|x| x * x).sum()
}

fn scaled(edge: &Edge, by: f64) -> Edge {
    edge.map(|x| x * by)
}

fn between(a: &Edge, b: &Edge, share: f64) -> Edge {
    std::array::from_fn(|i| a[i] * (1.0 - share) + b[i] * share)
}

fn apart(a: &Edge, b: &Edge) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum()
}

impl AxisWay {
    fn new(first: &Axis, second: &Axis) -> Self {
        let mut kins: Vec<(u32, u32, u32)> = Vec::new();
        for (g, group) in first.groups.iter().enumerate() {
            kins.extend(group.iter().map(|&k| (k, g as u32, 0)));
        }
        kins.sort_unstable();
        for (g, group) in second.groups.iter().enumerate() {
            for k in group {
                if let Ok(i) = kins.binary_search_by_key(k, |kin| kin.0) {
                    kins[i].2 = g as u32;
                }
            }
        }
        let mut way = Self { first: first.clone(), second: second.clone(), kins, common: Vec::new(), legs: Vec::new() };
        way.find();
        way
    }

    /// Which edges of the second point are in the way of each inner one of the first: those after `j` groups with
    /// `low < j <= high`; where `low` is `high` none, where it is greater the second has the edge, too. Both rise with `i`.
    fn conflicts(&self) -> Vec<(u32, u32)> {
        let groups = self.first.groups.len();
        let (mut most, mut least) = (vec![0_u32; groups], vec![u32::MAX; groups]);
        for &(_, a, b) in &self.kins {
            most[a as usize] = most[a as usize].max(b);
            least[a as usize] = least[a as usize].min(b);
        }
        // Greatest second group before, least after.
        for g in 1..groups {
            most[g] = most[g].max(most[g - 1]);
        }
        for g in (0..groups.saturating_sub(1)).rev() {
            least[g] = least[g].min(least[g + 1]);
        }
        (1..groups).map(|i| (least[i], most[i - 1])).collect()
    }

    fn find(&mut self) {
        let (first, second) = (&self.first, &self.second);
        let (m, n) = (first.groups.len(), second.groups.len());
        // The outermost edges are everywhere.
        self.common.push((Of::First(0), first.edges[0], second.edges[0]));
        if m > 0 && n > 0 {
            self.common.push((Of::First(m as u32), first.edges[m], second.edges[n]));
        }
        let conflicts = self.conflicts();
        let mut blocked = vec![false; n + 1];
        let mut equal = vec![false; n + 1];
        let mut inner: Vec<usize> = Vec::new();
        for (i, &(low, high)) in (1..m).zip(&conflicts) {
            if low < high {
                // Collapsed edges are in nobody's way.
                if first.edges[i] != COLLAPSED {
                    inner.push(i);
                }
            } else {
                // Of those between, which holds the same branches: after all groups up to `high`, if none below `low` more.
                let j = high as usize + 1;
                let same = j < n && low as usize == j;
                let other = if same { second.edges[j] } else { COLLAPSED };
                equal[j.min(n)] |= same;
                self.common.push((Of::First(i as u32), first.edges[i], other));
            }
        }
        // Runs move up, so one pass marks them all.
        let mut marked = 0;
        for &i in &inner {
            let (low, high) = (conflicts[i - 1].0 as usize, conflicts[i - 1].1 as usize);
            blocked[(low + 1).max(marked)..(high + 1).max(marked)].fill(true);
            marked = marked.max(high + 1);
        }
        let mut outer: Vec<usize> = Vec::new();
        for j in 1..n {
            if blocked[j] && second.edges[j] != COLLAPSED {
                outer.push(j);
            } else if !equal[j] && second.edges[j] != COLLAPSED {
                self.common.push((Of::Second(j as u32), COLLAPSED, second.edges[j]));
            }
        }
        // Edges of the first that only collapsed ones were in the way of.
        let free = |i: usize| {
            let (low, high) = (conflicts[i - 1].0 as usize, conflicts[i - 1].1 as usize);
            outer.partition_point(|&j| j <= low) == outer.partition_point(|&j| j <= high)
        };
        for &i in inner.iter().filter(|&&i| free(i)) {
            self.common.push((Of::First(i as u32), first.edges[i], COLLAPSED));
        }
        inner.retain(|&i| !free(i));
        if !inner.is_empty() {
            let runs = |i: usize| (conflicts[i - 1].0 as usize + 1, conflicts[i - 1].1 as usize);
            self.legs = straightened(&self.first.edges, &self.second.edges, inner, outer, &runs);
        }
    }

    fn lengths(&self, leg: &Leg) -> (f64, f64) {
        let of = |edges: &[Edge], which: &[usize]| which.iter().map(|&i| square(&edges[i])).sum::<f64>().sqrt();
        (of(&self.first.edges, &leg.a), of(&self.second.edges, &leg.b))
    }

    fn square(&self) -> f64 {
        let common: f64 = self.common.iter().map(|(_, a, b)| apart(a, b)).sum();
        let legs = self.legs.iter().map(|leg| {
            let (a, b) = self.lengths(leg);
            (a + b) * (a + b)
        });
        let moved = if self.first.there && self.second.there {
            self.first.origin.distance_squared(self.second.origin)
        } else {
            0.0
        };
        common + legs.sum::<f64>() + moved
    }

    fn edits(&self) -> f64 {
        let common: f64 = self.common.iter().map(|(_, a, b)| apart(a, b).sqrt()).sum();
        let one = |edges: &[Edge], which: &[usize]| which.iter().map(|&i| norm(&edges[i])).sum::<f64>();
        let legs = self.legs.iter().map(|leg| one(&self.first.edges, &leg.a) + one(&self.second.edges, &leg.b));
        let moved =
            if self.first.there && self.second.there { self.first.origin.distance(self.second.origin) } else { 0.0 };
        common + legs.sum::<f64>() + moved
    }

    fn at(&self, share: f64) -> Axis {
        if share <= 0.0 {
            return self.first.clone();
        }
        if share >= 1.0 {
            return self.second.clone();
        }
        let mut there: Vec<(Of, Edge)> = Vec::new();
        let (mut base, mut tip) = (COLLAPSED, COLLAPSED);
        for (k, (of, a, b)) in self.common.iter().enumerate() {
            let here = between(a, b, share);
            match k {
                0 => base = here,
                1 if self.first.groups.len().min(self.second.groups.len()) > 0 => tip = here,
                _ if here != COLLAPSED => there.push((*of, here)),
                _ => {}
            }
        }
        for leg in &self.legs {
            let (a, b) = self.lengths(leg);
            let left = (1.0 - share) * a - share * b;
            if left > 0.0 {
                there.extend(leg.a.iter().map(|&i| (Of::First(i as u32), scaled(&self.first.edges[i], left / a))));
            } else if left < 0.0 {
                there.extend(leg.b.iter().map(|&j| (Of::Second(j as u32), scaled(&self.second.edges[j], -left / b))));
            }
        }
        // In order of how many branches stand before: what is there together is nested.
        let (of_first, of_second) = (counts(&self.first.groups), counts(&self.second.groups));
        let before = |of: Of| match of {
            Of::First(i) => of_first[i as usize],
            Of::Second(j) => of_second[j as usize],
        };
        let mut sorted: Vec<(usize, Of, Edge)> = there.into_iter().map(|(of, edge)| (before(of), of, edge)).collect();
        sorted.sort_by_key(|e| e.0);
        let mut groups: Vec<Vec<u32>> = vec![Vec::new(); sorted.len() + 1];
        for &(kin, a, b) in &self.kins {
            let holds = |of: Of| match of {
                Of::First(i) => a < i,
                Of::Second(j) => b < j,
            };
            groups[sorted.partition_point(|e| !holds(e.1))].push(kin);
        }
        let mut edges = vec![base];
        edges.extend(sorted.into_iter().map(|e| e.2));
        if self.kins.is_empty() {
            groups.clear();
        } else {
            edges.push(tip);
        }
        let origin = match (self.first.there, self.second.there) {
            (true, true) => self.first.origin.lerp(self.second.origin, share),
            (true, false) => self.first.origin,
            _ => self.second.origin,
        };
        Axis { there: self.first.there || self.second.there, origin, groups, edges }
    }
}

/// How many branches stand before each place between groups.
fn counts(groups: &[Vec<u32>]) -> Vec<usize> {
    let mut counts = vec![0];
    for group in groups {
        counts.push(counts[counts.len() - 1] + group.len());
    }
    counts
}

/// Straightens the initial path through some edges that are in each other's way; `run` gives for an edge of the first
/// which of the second.
fn straightened(
    first: &[Edge],
    second: &[Edge],
    inner: Vec<usize>,
    outer: Vec<usize>,
    run: &dyn Fn(usize) -> (usize, usize),
) -> Vec<Leg> {
    let of = |edges: &[Edge], which: &[usize]| which.iter().map(|&i| square(&edges[i])).sum::<f64>();
    let ratio = |leg: &Leg| of(first, &leg.a) / of(second, &leg.b).max(f64::MIN_POSITIVE);
    let mut legs = initial(first, inner, outer, run);
    // Each round shortens the path; on grown plants two or three do.
    for _ in 0..64 {
        let mut ordered: Vec<Leg> = Vec::with_capacity(legs.len());
        for mut leg in legs {
            while let Some(before) = ordered.pop() {
                if ratio(&before) <= ratio(&leg) {
                    ordered.push(before);
                    break;
                }
                leg = Leg { a: [before.a, leg.a].concat(), b: [before.b, leg.b].concat() };
                leg.a.sort_unstable();
                leg.b.sort_unstable();
            }
            ordered.push(leg);
        }
        let count = ordered.len();
        legs = ordered.into_iter().flat_map(|leg| split(first, second, leg, run)).collect();
        if legs.len() == count {
            break;
        }
    }
    legs
}

/// The initial path: the shortest edges collapse first, others expand as soon as they can.
fn initial(first: &[Edge], inner: Vec<usize>, outer: Vec<usize>, run: &dyn Fn(usize) -> (usize, usize)) -> Vec<Leg> {
    // How many edges are in the way of each.
    let mut blockers: Vec<u32> = vec![0; outer.len()];
    let span = |i: usize| {
        let (low, high) = run(i);
        outer.partition_point(|&j| j < low)..outer.partition_point(|&j| j <= high)
    };
    for &i in &inner {
        blockers[span(i)].iter_mut().for_each(|b| *b += 1);
    }
    let mut order = inner;
    order.sort_by(|&a, &b| square(&first[a]).total_cmp(&square(&first[b])).then(a.cmp(&b)));
    let mut legs = Vec::new();
    let mut collapsing: Vec<usize> = Vec::new();
    for i in order {
        collapsing.push(i);
        let mut expanding = Vec::new();
        for j in span(i) {
            blockers[j] -= 1;
            if blockers[j] == 0 {
                expanding.push(outer[j]);
            }
        }
        if !expanding.is_empty() {
            // What is in the way of none of these may wait: every edge of a leg has one of the other side against it,
            // which splitting and joining keep.
            let (mut a, wait): (Vec<usize>, Vec<usize>) = collapsing.into_iter().partition(|&i| {
                let (low, high) = run(i);
                expanding.partition_point(|&j| j < low) < expanding.partition_point(|&j| j <= high)
            });
            a.sort_unstable();
            legs.push(Leg { a, b: expanding });
            collapsing = wait;
        }
    }
    legs
}

/// Splits a leg along a cover that weighs less than 1, if there is one.
fn split(first: &[Edge], second: &[Edge], leg: Leg, run: &dyn Fn(usize) -> (usize, usize)) -> Vec<Leg> {
    if leg.a.len() == 1 || leg.b.len() == 1 {
        return vec![leg];
    }
    let weights = |edges: &[Edge], which: &[usize]| {
        let squares: Vec<f64> = which.iter().map(|&i| square(&edges[i])).collect();
        let whole: f64 = squares.iter().sum();
        squares.into_iter().map(|s| s / whole).collect::<Vec<f64>>()
    };
    let spans: Vec<std::ops::Range<usize>> = leg
        .a
        .iter()
        .map(|&i| {
            let (low, high) = run(i);
            leg.b.partition_point(|&j| j < low)..leg.b.partition_point(|&j| j <= high)
        })
        .collect();
    let (mut left_a, mut left_b) = (weights(first, &leg.a), weights(second, &leg.b));
    // Runs move up: filling in order is a maximum flow.
    let mut flows: Vec<Vec<usize>> = vec![Vec::new(); leg.b.len()];
    let mut flow = 0.0;
    for (a, span) in spans.iter().enumerate() {
        for b in span.clone() {
            let part = left_a[a].min(left_b[b]);
            if part > 0.0 {
                (left_a[a], left_b[b], flow) = (left_a[a] - part, left_b[b] - part, flow + part);
                flows[b].push(a);
            }
        }
    }
    if flow >= 1.0 - SLACK {
        return vec![leg];
    }
    // The cover: edges of A that no unfilled one reaches, and edges of B that one does.
    let mut reached_a: Vec<bool> = left_a.iter().map(|left| *left > SLACK * 0.1).collect();
    let mut reached_b = vec![false; leg.b.len()];
    let mut open: Vec<usize> = (0..leg.a.len()).filter(|&a| reached_a[a]).collect();
    while let Some(a) = open.pop() {
        for b in spans[a].clone() {
            if !std::mem::replace(&mut reached_b[b], true) {
                for &back in &flows[b] {
                    if !std::mem::replace(&mut reached_a[back], true) {
                        open.push(back);
                    }
                }
            }
        }
    }
    let (a2, a1): (Vec<usize>, Vec<usize>) = (0..leg.a.len()).partition(|&a| reached_a[a]);
    let (b2, b1): (Vec<usize>, Vec<usize>) = (0..leg.b.len()).partition(|&b| reached_b[b]);
    if a1.is_empty() || a2.is_empty() || b1.is_empty() || b2.is_empty() {
        return vec![leg];
    }
    let part = |a: &[usize], b: &[usize]| Leg {
        a: a.iter().map(|&i| leg.a[i]).collect(),
        b: b.iter().map(|&i| leg.b[i]).collect(),
    };
    vec![part(&a1, &b1), part(&a2, &b2)]
}
