//! Blending at the scale of growth units (what 2017 TVCG lists under its limits, section 6).
//!
//! A chain is cut where matched branches leave it. Of the pairs of locations the longest run that rises on both chains
//! becomes the boundaries (so no unit is turned inside out); the stretch between two of them is a growth unit, and
//! units correspond in their order. Internodes then match internodes: a branch stays at the boundary it left from, where
//! a blend by arc length alone lets it slide past its neighbours.
//!
//! Each unit also has a time of its own. With [`Weights::with_unit_seed`](super::Weights::with_unit_seed) a boundary
//! starts to morph at a random time in the first half of its chain's task and takes half of it, so one stretch of a limb
//! is already the other source's while the next still is the first one's. Chains are summed segment by segment then.
//!
//! For two sources; a family of more keeps its chains whole. Linear in points, `n log n` in the children of one chain.

use glam::Vec3;

use super::family::{Family, Line, NONE};
use super::kernel::{Blender, Feed};
use super::place::measure;
use super::turns::turn_of;
use crate::base::Seed;

/// Least distance of two boundaries, as a share of the chain.
const LEAST_UNIT: f64 = 0.01;

/// Growth units of a family of two.
#[derive(Clone, Debug)]
pub(super) struct Units {
    /// For each kin where its boundaries start.
    first: Vec<u32>,
    /// Boundaries: the arc-length parameter on the first member and on the second, and the coordinate they share.
    boundaries: Vec<(f64, f64, f64)>,
    /// The coordinate of each slot of the family's blocks, in their order.
    pub(super) coordinates: Vec<f64>,
}

impl Units {
    fn of_kin(&self, kin: usize) -> &[(f64, f64, f64)] {
        &self.boundaries[self.first[kin] as usize..self.first[kin + 1] as usize]
    }

    /// The coordinate of a place on a member.
    pub(super) fn coordinate(&self, kin: usize, source: usize, location: f64) -> f64 {
        map(self.of_kin(kin), location, |b| if source == 0 { b.0 } else { b.1 }, |b| b.2)
    }

    /// A member with a point at each boundary, by coordinate.
    pub(super) fn cut<'a>(&self, kin: usize, source: usize, line: &Line<'a>) -> Line<'a> {
        let boundaries = self.of_kin(kin);
        let own = |b: &(f64, f64, f64)| if source == 0 { b.0 } else { b.1 };
        let count = line.parameters.len() + boundaries.len();
        let mut parameters = Vec::with_capacity(count);
        let (mut points, mut radii) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut next = 0;
        for (i, &t) in line.parameters.iter().enumerate() {
            while next < boundaries.len() && own(&boundaries[next]) < t {
                let (at, coordinate) = (own(&boundaries[next]), boundaries[next].2);
                // Never before the first point, whose parameter is 0.
                let low = line.parameters[i - 1];
                if at > low {
                    let f = ((at - low) / (t - low)) as f32;
                    parameters.push(coordinate);
                    points.push(line.points[i - 1].lerp(line.points[i], f));
                    radii.push(line.radii[i - 1] + (line.radii[i] - line.radii[i - 1]) * f);
                }
                next += 1;
            }
            parameters.push(self.coordinate(kin, source, t));
            points.push(line.points[i]);
            radii.push(line.radii[i]);
        }
        Line { parameters: parameters.into(), points: points.into(), radii: radii.into() }
    }

    /// The place on a member that has a coordinate.
    fn place(&self, kin: usize, source: usize, coordinate: f64) -> f64 {
        map(self.of_kin(kin), coordinate, |b| b.2, |b| if source == 0 { b.0 } else { b.1 })
    }
}

/// Piecewise linear from one rising sequence to another.
fn map<B>(boundaries: &[B], x: f64, from: impl Fn(&B) -> f64, to: impl Fn(&B) -> f64) -> f64 {
    let next = boundaries.partition_point(|b| from(b) <= x).clamp(1, boundaries.len() - 1);
    let (a, b) = (&boundaries[next - 1], &boundaries[next]);
    let f = ((x - from(a)) / (from(b) - from(a))).clamp(0.0, 1.0);
    to(a) + (to(b) - to(a)) * f
}

impl Family {
    /// The same family with its chains cut into growth units; see the head of `relate/units.rs`. A family of other
    /// than two sources stays as it is.
    #[must_use]
    pub fn by_units(mut self) -> Self {
        if self.plants.len() != 2 {
            return self;
        }
        let mut units = Units { first: vec![0], boundaries: Vec::new(), coordinates: Vec::new() };
        for k in 0..self.parents.len() {
            let whole = |kin: usize| self.row(kin).iter().all(|m| m.chain != NONE);
            let mut pairs: Vec<(f64, f64)> = Vec::new();
            if whole(k) {
                let children = self.children[self.child_range(k)].iter().map(|&c| c as usize);
                let pair = |c: usize| (f64::from(self.row(c)[0].location), f64::from(self.row(c)[1].location));
                pairs.extend(children.filter(|&c| whole(c)).map(pair));
            }
            units.boundaries.push((0.0, 0.0, 0.0));
            let mut last = (0.0, 0.0);
            for (a, b) in rising(pairs) {
                let far = |from: f64, to: f64| to - from >= LEAST_UNIT;
                if far(last.0, a) && far(last.1, b) && far(a, 1.0) && far(b, 1.0) {
                    units.boundaries.push((a, b, (a + b) * 0.5));
                    last = (a, b);
                }
            }
            units.boundaries.push((1.0, 1.0, 1.0));
            units.first.push(units.boundaries.len() as u32);
        }
        self.units = Some(units);
        self.lay_blocks();
        self
    }
}

/// The longest subsequence that rises in both, in `n log n`.
fn rising(mut pairs: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    // Equal firsts with falling seconds, so that no two of them are taken.
    pairs.sort_by(|x, y| x.0.total_cmp(&y.0).then(y.1.total_cmp(&x.1)));
    // The last pair of the best run of each length, and what comes before each pair.
    let mut ends: Vec<usize> = Vec::new();
    let mut before: Vec<usize> = vec![usize::MAX; pairs.len()];
    for (i, pair) in pairs.iter().enumerate() {
        let place = ends.partition_point(|&e| pairs[e].1 < pair.1);
        if place > 0 {
            before[i] = ends[place - 1];
        }
        if place == ends.len() {
            ends.push(i);
        } else {
            ends[place] = i;
        }
    }
    let mut run = Vec::new();
    let mut at = ends.last().copied().unwrap_or(usize::MAX);
    while at != usize::MAX {
        run.push(pairs[at]);
        at = before[at];
    }
    run.reverse();
    run
}

impl Blender<'_> {
    /// Where a kin of a family by units leaves its parent, which must have been placed.
    pub(super) fn locate(&self, k: usize) -> f32 {
        let family = self.family;
        let p = family.parents[k];
        let Some(units) = family.units.as_ref().filter(|_| p != NONE) else { return self.location[k] };
        let p = p as usize;
        if self.feeds[k] == self.feeds[p] && self.feeds[k] != Feed::Several {
            return self.location[k];
        }
        let members = family.row(k).iter().zip(self.share(k)).enumerate();
        let mut coordinate = 0.0;
        for (s, (member, share)) in members.filter(|(_, (_, share))| **share > 0.0) {
            coordinate += units.coordinate(p, s, f64::from(member.location)) * f64::from(*share);
        }
        self.along(p, coordinate)
    }

    /// The arc-length parameter on a blended chain of a family by units that has a coordinate.
    pub(super) fn along(&self, p: usize, coordinate: f64) -> f32 {
        let Some(units) = &self.family.units else { return coordinate as f32 };
        let place = match self.feeds[p] {
            Feed::One(s) => units.place(p, s as usize, coordinate),
            _ => {
                let (start, len) = self.family.blocks[p];
                let slots = &units.coordinates[start_of(self.family, p, start)..][..len as usize];
                let parameters = &self.parameters[self.span(p)];
                let next = slots.partition_point(|&c| c <= coordinate).clamp(1, slots.len() - 1);
                let span = slots[next] - slots[next - 1];
                let f = if span > 0.0 { ((coordinate - slots[next - 1]) / span).clamp(0.0, 1.0) } else { 0.0 };
                parameters[next - 1] + (parameters[next] - parameters[next - 1]) * f
            }
        };
        (place as f32).clamp(0.0, 1.0)
    }

    /// Sums a kin of two members with every growth unit at its own time.
    pub(super) fn place_by_units(&mut self, k: usize, seed: u64) {
        let family = self.family;
        let Some(units) = &family.units else { return };
        let (start, len) = (family.blocks[k].0 as usize, family.blocks[k].1 as usize);
        let (row, degree) = (family.row(k), self.grown[k]);
        let share = self.share(k)[1];
        let boundaries = units.of_kin(k);
        // Not an address of its own kind, but one below the batch's.
        let address = Seed::new(seed).at(k as u64);
        let phase = |b: usize| f64::from(address.at(b as u64).range(0.0, 0.5));
        let slots = &units.coordinates[start_of(family, k, family.blocks[k].0)..][..len];
        let time = |coordinate: f64| {
            let next = boundaries.partition_point(|b| b.2 <= coordinate).clamp(1, boundaries.len() - 1);
            let (a, b) = (boundaries[next - 1].2, boundaries[next].2);
            let f = ((coordinate - a) / (b - a)).clamp(0.0, 1.0);
            let phase = phase(next - 1) * (1.0 - f) + phase(next) * f;
            ((f64::from(share) - phase) * 2.0).clamp(0.0, 1.0) as f32
        };
        let times: Vec<f32> = slots.iter().map(|&c| time(c)).collect();
        let block = &family.shapes[start * 4..start * 4 + 8 * len];
        let (own, other) = block.split_at(4 * len);
        let at = |shape: &[f32], i: usize| Vec3::new(shape[i], shape[len + i], shape[2 * len + i]);
        let turn = turn_of(row, self.share(k), &family.order);
        let first = self.first[k] as usize;
        let (mut sum, mut reach) = (Vec3::ZERO, 0.0_f32);
        let mut line = vec![Vec3::ZERO; len];
        for i in 1..len {
            let t = (times[i - 1] + times[i]) * 0.5;
            let step = (at(own, i) - at(own, i - 1)) * (1.0 - t) + (at(other, i) - at(other, i - 1)) * t;
            sum += step;
            line[i] = sum;
            reach = at(own, i).length() * (1.0 - t) + at(other, i).length() * t;
        }
        let scale = degree * super::place::stretch(reach, sum.length());
        for (to, p) in self.points[first..first + len].iter_mut().zip(&line) {
            *to = turn.rotate(*p) * scale;
        }
        let sharers = [0, 1].map(|source| self.sharer(k, source));
        let thick = |source: usize, share: f32| sharers[source].as_ref().map_or(share, |s| s.thickness(0.0, share));
        for (i, to) in self.linear[first..first + len].iter_mut().enumerate() {
            let (a, b) = (thick(0, 1.0 - times[i]), thick(1, times[i]));
            *to = (own[3 * len + i] * a + other[3 * len + i] * b) * degree;
        }
        measure(&self.points[first..first + len], &mut self.parameters[first..first + len]);
    }
}

/// Where the slots of a kin's block start: blocks hold every member's points, coordinates one of each slot.
fn start_of(family: &Family, kin: usize, start: u32) -> usize {
    // Two members in every block.
    debug_assert!(family.blocks[kin].0 == start);
    start as usize / 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Plant, PlantBuilder};
    use crate::preset::plan::MatchParams;
    use crate::relate::random_plant::{Oddity, random_plant};
    use crate::relate::{KinId, Weights, fuzzy_family};

    const EVEN: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

    fn even(family: &Family, t: f32, seed: Seed) -> Weights {
        let mut weights = Weights::new(family.kin_count(), 2);
        for kin in family.kin_ids() {
            let degree = match (family.member(kin, 0), family.member(kin, 1)) {
                (Some(_), None) => 1.0 - t,
                (None, _) => t,
                _ => 1.0,
            };
            weights.set(kin, &[1.0 - t, t], degree);
        }
        weights.with_unit_seed(seed)
    }

    #[test]
    fn the_longest_rising_run_is_taken() {
        let run = rising(vec![(0.1, 0.5), (0.2, 0.2), (0.3, 0.3), (0.3, 0.4), (0.6, 0.1), (0.9, 0.9)]);
        assert!(run == [(0.2, 0.2), (0.3, 0.4), (0.9, 0.9)] || run == [(0.2, 0.2), (0.3, 0.3), (0.9, 0.9)]);
        assert!(rising(Vec::new()).is_empty());
    }

    #[test]
    fn corners_are_the_sources_and_just_off_them_nothing_jumps() {
        for seed in 0..40 {
            let plant = |name| random_plant(Seed::new(seed).child(name), 40, Oddity::Tame);
            let family = fuzzy_family(plant("a"), plant("b"), &EVEN).unwrap().by_units();
            for s in 0..2 {
                let source = &family.sources()[s];
                assert!(family.blend(&family.corner(s)) == *source);
                let t = if s == 0 { 1e-6 } else { 1.0 - 1e-6 };
                let off = family.blend(&even(&family, t, Seed::new(seed)));
                let (posed, near) = (source.pose(), off.pose());
                for kin in family.kin_ids() {
                    let Some(own) = family.member(kin, s) else { continue };
                    let id = crate::plant::ChainId(kin.0);
                    for i in 0..=4 {
                        let t = f64::from(i) / 4.0;
                        let (a, b) = (posed.curve(source, own).point(t), near.curve(&off, id).point(t));
                        assert!(a.distance(b) < source.height() * 5e-4, "seed {seed} {kin:?}: {a} {b}");
                    }
                }
            }
        }
    }

    /// A trunk with branches at the given locations.
    fn comb(locations: &[f32]) -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.1, 0.1]);
        for (i, &location) in locations.iter().enumerate() {
            let out = Seed::new(5).at(i as u64).direction() * Vec3::new(1.0, 0.2, 1.0);
            builder.branch(stem, location, &[Vec3::ZERO, out], &[0.05, 0.05]);
        }
        builder.finish().unwrap()
    }

    #[test]
    fn internodes_match_internodes() {
        // The same five branches in the same order, at other places.
        let (a, b) = (comb(&[0.2, 0.3, 0.4, 0.5, 0.9]), comb(&[0.5, 0.6, 0.7, 0.8, 0.9]));
        let matching = MatchParams { crown: 0.0, direction: 1.0, ratio: 0.0 };
        let family = fuzzy_family(a, b, &matching).unwrap().by_units();
        let plant = family.blend(&even(&family, 0.5, Seed::new(1)));
        let locations: Vec<f32> = plant.chains()[1..].iter().map(|c| c.location).collect();
        assert!(locations.windows(2).all(|w| w[1] > w[0]), "{locations:?}");
        // Units have times of their own: other seeds, other trees; the same corners.
        let other = family.blend(&even(&family, 0.5, Seed::new(2)));
        assert!(other != plant);
        assert_eq!(family.member(KinId(1), 1), Some(crate::plant::ChainId(1)));
    }
}
