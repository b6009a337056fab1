//! Which place of one outline goes with which of another (Liu, Wang, Zhang, Guo and Shum 2004, "Perceptually based
//! approach for planar shape morphing"; the polygon morphing of 2017 CAVW, 6.2): lobes go to lobes and tips to tips.
//!
//! Feature points are the sharpest turns of the smoothed outline, convex and concave. Between a feature and its
//! neighbours lie its left and its right region of support, which tell what it looks like: how far it sticks out (the share of the
//! variance across it, by the eigenvalues of the whole region's covariance, signed by which way it turns), how bent either side is
//! (the smaller share of its own eigenvalues), and how long either side is. How much two features differ, weighted by the larger of
//! the two, is what matching them costs; a feature that is left out costs by its size and its turn. The cheapest
//! cyclic order is found by dynamic programming over all places to begin at, and what lies between two matched features
//! is laid out by arc length.
//!
//! All lengths are measured in the square root of the outline's area, so pictures of any size match alike. The order of the two
//! outlines is settled before anything is compared: the way back is the way there.
//!
//! Where it departs: the paper's measure is blind to where a feature is and how it is turned. Leaves stand upright in
//! their pictures and have many lobes that look alike, so place in the outline's box and direction count, too. Outlines with
//! fewer than [`LEAST`] matched features, as round leaves have, and those that would fold over themselves more by their
//! features than without, are laid on each other evenly by arc length, begun where the squares are least.
//!
//! Of 112 pairs of made sprays and drawn leaves all outlines together cross themselves 1247 times at a quarter, half and three
//! quarters of their way by arc length, and 560 times by features: what is left are sprays whose blades lie over each other.
//! Tried: features left out for half as much (633) and tips that may go to notches (1770). Place and direction of 1.2 and
//! 0.4 cross less (408 to 436), but match the two halves of a maple's leaf with an oak's differently, which is seen at once.
//!
//! Time: features² × features, of which [`MOST`] at most count.

use glam::Vec2;

use super::contour::area;
use crate::base::math;

/// Points that an outline is looked at by, a length of √area, and their least and largest number.
const DENSE: f32 = 64.0;
const DENSE_RANGE: (f32, f32) = (128.0, 1024.0);
/// Standard deviation of the smoothing, and how far to both sides turns are measured: √area.
const SMOOTH: f32 = 0.02;
const SPAN: f32 = 0.08;
/// Least turn of a feature, radians.
const TURN: f32 = 0.5;
/// Most features of an outline: those that turn most.
const MOST: usize = 112;
/// Fewest matched features that lay outlines out.
const LEAST: usize = 2;
/// Weights of what a feature looks like, the bend of its sides, their lengths, its place and its direction.
const WEIGHTS: [f32; 5] = [0.25, 0.15, 0.2, 0.8, 0.25];
/// What leaving out costs for a feature that turns back, over its size.
const SKIP: f32 = 0.4;
/// Points of a matched outline, a length of √area, and their least and largest number.
const POINTS: f32 = 12.0;
const POINTS_RANGE: (f32, f32) = (96.0, 256.0);

/// Two outlines at equal numbers of points that go with each other; each clockwise to the eye (y down), without its end repeated,
/// of any units.
pub(super) fn matched(first: &[Vec2], second: &[Vec2]) -> [Vec<Vec2>; 2] {
    let key = |outline: &[Vec2]| (area(outline).to_bits(), outline.len());
    let order = key(first).cmp(&key(second)).then_with(|| {
        let bits = |p: &Vec2| [p.x.to_bits(), p.y.to_bits()];
        first.iter().map(bits).cmp(second.iter().map(bits))
    });
    if order.is_gt() {
        let [b, a] = ordered(second, first);
        [a, b]
    } else {
        ordered(first, second)
    }
}

/// An outline by itself, at as many points by arc length as a matched one has.
pub(super) fn evenly(outline: &[Vec2]) -> Vec<Vec2> {
    let outline = Outline::measured(outline);
    outline.evenly(0.0, points(outline.length / outline.unit))
}

/// How many points lay out an outline of such a length in √area.
fn points(length: f32) -> usize {
    (length * POINTS).clamp(POINTS_RANGE.0, POINTS_RANGE.1) as usize
}

fn ordered(first: &[Vec2], second: &[Vec2]) -> [Vec<Vec2>; 2] {
    let (a, b) = (Outline::new(first), Outline::new(second));
    let count = points((a.length / a.unit + b.length / b.unit) * 0.5);
    let even = laid_on(a.evenly(0.0, count), b.evenly(0.0, count));
    let pairs = pairs(&a.features, &b.features);
    if pairs.len() < LEAST {
        return even;
    }
    let by_features = laid_out(&a, &b, &pairs, count);
    if folds(&by_features) > folds(&even) { even } else { by_features }
}

/// A place where an outline turns.
struct Feature {
    /// Arc length from the outline's first point.
    at: f32,
    /// How far it turns, radians; above zero where it is convex.
    turn: f32,
    /// Share of the variance of both regions across the outline, signed as the turn is.
    shape: f32,
    /// The smaller share of the variance of the region before and of that behind: 0 for straight ones.
    bend: [f32; 2],
    /// Lengths of both regions as shares of the outline's.
    size: [f32; 2],
    /// In the outline's box, 0..=1 each.
    place: Vec2,
    /// Out of the outline, of unit length.
    out: Vec2,
}

/// An outline and where it turns.
struct Outline<'p> {
    points: &'p [Vec2],
    /// Arc length up to each point, and to the end.
    along: Vec<f32>,
    length: f32,
    /// √area.
    unit: f32,
    /// In order of `at`.
    features: Vec<Feature>,
}

impl<'p> Outline<'p> {
    fn new(points: &'p [Vec2]) -> Self {
        let mut outline = Self::measured(points);
        outline.features = outline.features();
        outline
    }

    /// Without its features.
    fn measured(points: &'p [Vec2]) -> Self {
        let mut along = Vec::with_capacity(points.len() + 1);
        let mut length = 0.0_f32;
        for i in 0..points.len() {
            along.push(length);
            length += points[i].distance(points[(i + 1) % points.len()]);
        }
        along.push(length);
        let unit = area(points).abs().sqrt().max(1e-6);
        Self { points, along, length, unit, features: Vec::new() }
    }

    /// The point at an arc length, of any round.
    fn point(&self, at: f32) -> Vec2 {
        let at = if self.length > 0.0 { at.rem_euclid(self.length) } else { 0.0 };
        let edge = self.along.partition_point(|a| *a <= at).clamp(1, self.points.len()) - 1;
        let span = self.along[edge + 1] - self.along[edge];
        let f = if span > 0.0 { ((at - self.along[edge]) / span).clamp(0.0, 1.0) } else { 0.0 };
        self.points[edge].lerp(self.points[(edge + 1) % self.points.len()], f)
    }

    /// So many points by arc length.
    fn evenly(&self, start: f32, count: usize) -> Vec<Vec2> {
        (0..count).map(|k| self.point(start + self.length * (k as f32 / count as f32))).collect()
    }

    fn features(&self) -> Vec<Feature> {
        let count = (self.length / self.unit * DENSE).clamp(DENSE_RANGE.0, DENSE_RANGE.1) as usize;
        let step = self.length / count as f32;
        if !(step > 0.0 && step.is_finite()) {
            return Vec::new();
        }
        let steps = |length: f32| ((length * self.unit / step + 0.5) as usize).max(1).min(count / 8);
        let smooth = smoothed(&self.evenly(0.0, count), steps(SMOOTH));
        let span = steps(SPAN);
        let at = |i: usize, off: isize| smooth[(i as isize + off).rem_euclid(count as isize) as usize];
        let reach = span as isize;
        let turns: Vec<f32> = (0..count)
            .map(|i| {
                let (before, after) = (at(i, 0) - at(i, -reach), at(i, reach) - at(i, 0));
                math::atan2(before.perp_dot(after), before.dot(after))
            })
            .collect();
        let sharper = |i: usize, j: usize| {
            let (own, other) = (turns[i], turns[j]);
            own * other <= 0.0 || own.abs() > other.abs() || (own.abs() == other.abs() && i <= j)
        };
        let sharpest =
            |i: &usize| (1..=span).all(|k| sharper(*i, (i + k) % count) && sharper(*i, (i + count - k) % count));
        let mut found: Vec<usize> = (0..count).filter(|&i| turns[i].abs() >= TURN).filter(sharpest).collect();
        found.sort_by(|&i, &j| turns[j].abs().total_cmp(&turns[i].abs()).then(i.cmp(&j)));
        found.truncate(MOST);
        found.sort_unstable();
        let (low, high) =
            self.points.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        let size = (high - low).max(Vec2::splat(1e-6));
        let total = found.len();
        (0..total)
            .map(|k| {
                let i = found[k];
                let gap = |from: usize, to: usize| match (to + count - from) % count {
                    0 => count,
                    gap => gap,
                };
                let (before, after) = (gap(found[(k + total - 1) % total], i), gap(i, found[(k + 1) % total]));
                let region = |from: isize, to: isize| from..=to;
                let sides = [(-(before as isize), 0), (0, after as isize)];
                let bend = sides.map(|(from, to)| Spread::of(region(from, to).map(|off| at(i, off))).least());
                let whole = Spread::of(region(sides[0].0, sides[1].1).map(|off| at(i, off)));
                let way = (at(i, reach) - at(i, -reach)).normalize_or(Vec2::X);
                let out = Vec2::new(way.y, -way.x);
                // Smoothing rounds tips and notches; the outline's own is the farthest out or in. Less than half of the way
                // to the next feature, so that their order stays.
                let sign = turns[i].signum();
                let near = span.min(4) as i32;
                let farthest = (-near..=near)
                    .map(|k| (i as f32 + k as f32 * 0.5) * step)
                    .max_by(|&x, &y| (self.point(x).dot(out) * sign).total_cmp(&(self.point(y).dot(out) * sign)));
                Feature {
                    at: farthest.unwrap_or(i as f32 * step).rem_euclid(self.length),
                    turn: turns[i],
                    shape: whole.across(out) * sign,
                    bend,
                    size: [before, after].map(|steps| steps as f32 / count as f32),
                    place: (at(i, 0) - low) / size,
                    out,
                }
            })
            .collect()
    }
}

impl Feature {
    /// Length of both regions.
    fn size(&self) -> f32 {
        (self.size[0] + self.size[1]) * 0.5
    }

    /// What going with a feature of the other outline costs; a tip and a notch never do.
    fn unlike(&self, other: &Self) -> f32 {
        if self.turn * other.turn <= 0.0 {
            return f32::INFINITY;
        }
        let pair = |a: [f32; 2], b: [f32; 2]| ((a[0] - b[0]).abs() + (a[1] - b[1]).abs()) * 0.5;
        let ratio = |a: f32, b: f32| (a - b).abs() / a.max(b).max(1e-6);
        let sizes = (ratio(self.size[0], other.size[0]) + ratio(self.size[1], other.size[1])) * 0.5;
        let terms = [
            (self.shape - other.shape).abs(),
            pair(self.bend, other.bend),
            sizes,
            self.place.distance(other.place),
            self.out.distance(other.out) * 0.5,
        ];
        let sum: f32 = terms.iter().zip(WEIGHTS).map(|(term, weight)| term * weight).sum();
        sum * self.size().max(other.size())
    }

    fn left_out(&self) -> f32 {
        SKIP * self.size() * (0.3 + 0.7 * self.turn.abs() * std::f32::consts::FRAC_1_PI)
    }
}

/// How points lie about their mean.
struct Spread {
    xx: f32,
    xy: f32,
    yy: f32,
}

impl Spread {
    fn of(points: impl Iterator<Item = Vec2> + Clone) -> Self {
        let share = 1.0 / points.clone().count().max(1) as f32;
        let mean = points.clone().fold(Vec2::ZERO, |sum, p| sum + p) * share;
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for off in points.map(|p| p - mean) {
            xx += off.x * off.x * share;
            xy += off.x * off.y * share;
            yy += off.y * off.y * share;
        }
        Self { xx, xy, yy }
    }

    /// The larger and the smaller eigenvalue as shares of both, and the way of the larger.
    fn axes(&self) -> (f32, f32, Vec2) {
        let (half, apart) = ((self.xx + self.yy) * 0.5, (self.xx - self.yy) * 0.5);
        let root = (apart * apart + self.xy * self.xy).sqrt();
        if half <= 1e-20 {
            return (1.0, 0.0, Vec2::X);
        }
        // Of two ways to write it the one that does not vanish.
        let way = if apart >= 0.0 { Vec2::new(apart + root, self.xy) } else { Vec2::new(self.xy, root - apart) };
        (0.5 * (half + root) / half, (0.5 * (half - root) / half).max(0.0), way.normalize_or(Vec2::X))
    }

    fn least(&self) -> f32 {
        self.axes().1
    }

    /// The share of the eigenvalue whose way is nearer to `out`.
    fn across(&self, out: Vec2) -> f32 {
        let (large, small, way) = self.axes();
        if way.dot(out).abs() * std::f32::consts::SQRT_2 >= 1.0 { large } else { small }
    }
}

/// A closed polygon, smoothed along itself by a Gauss of so many steps' deviation.
fn smoothed(points: &[Vec2], deviation: usize) -> Vec<Vec2> {
    let count = points.len() as isize;
    let reach = 3 * deviation as isize;
    let weight = |k: isize| {
        let off = k as f32 / deviation as f32;
        math::exp(-0.5 * off * off)
    };
    let weights: Vec<f32> = (-reach..=reach).map(weight).collect();
    let sum: f32 = weights.iter().sum();
    let at = |i: isize| points[i.rem_euclid(count) as usize];
    (0..count).map(|i| (-reach..=reach).zip(&weights).fold(Vec2::ZERO, |s, (k, w)| s + at(i + k) * *w) / sum).collect()
}

/// The features that go with each other, in the order of the first outline, round the second in the same sense.
fn pairs(a: &[Feature], b: &[Feature]) -> Vec<(usize, usize)> {
    let (m, n) = (a.len(), b.len());
    if m < LEAST || n < LEAST {
        return Vec::new();
    }
    let costs: Vec<f32> = a.iter().flat_map(|x| b.iter().map(move |y| x.unlike(y))).collect();
    let (out_a, out_b): (Vec<f32>, Vec<f32>) =
        (a.iter().map(Feature::left_out).collect(), b.iter().map(Feature::left_out).collect());
    let mut table = vec![0.0_f32; (m + 1) * (n + 1)];
    let wide = n + 1;
    // Cheapest ways to deal with the first i of one and j of the other, from `start` on.
    let fill = |table: &mut [f32], start: usize| {
        table[0] = 0.0;
        for j in 0..n {
            table[j + 1] = table[j] + out_b[(start + j) % n];
        }
        for i in 0..m {
            table[(i + 1) * wide] = table[i * wide] + out_a[i];
            for j in 0..n {
                let other = (start + j) % n;
                let both = table[i * wide + j] + costs[i * n + other];
                let one = (table[i * wide + j + 1] + out_a[i]).min(table[(i + 1) * wide + j] + out_b[other]);
                table[(i + 1) * wide + j + 1] = both.min(one);
            }
        }
        table[m * wide + n]
    };
    let mut best = (f32::INFINITY, 0);
    for start in 0..n {
        let cost = fill(&mut table, start);
        if cost < best.0 {
            best = (cost, start);
        }
    }
    let start = best.1;
    fill(&mut table, start);
    let (mut i, mut j) = (m, n);
    let mut found = Vec::new();
    while i > 0 && j > 0 {
        let other = (start + j - 1) % n;
        let here = table[i * wide + j];
        if here == table[(i - 1) * wide + j - 1] + costs[(i - 1) * n + other] {
            found.push((i - 1, other));
            (i, j) = (i - 1, j - 1);
        } else if here == table[(i - 1) * wide + j] + out_a[i - 1] {
            i -= 1;
        } else {
            j -= 1;
        }
    }
    found.reverse();
    found
}

/// Both outlines at `count` points: all matched features, and between them evenly by arc length.
fn laid_out(a: &Outline<'_>, b: &Outline<'_>, pairs: &[(usize, usize)], count: usize) -> [Vec<Vec2>; 2] {
    let spans = |outline: &Outline<'_>, own: &dyn Fn(&(usize, usize)) -> usize| -> Vec<(f32, f32)> {
        let at = |k: usize| outline.features[own(&pairs[k % pairs.len()])].at;
        (0..pairs.len()).map(|k| (at(k), (at(k + 1) - at(k)).rem_euclid(outline.length))).collect()
    };
    let (spans_a, spans_b) = (spans(a, &|p| p.0), spans(b, &|p| p.1));
    // One for each feature, the rest by length; what rounding leaves goes to the next.
    let rest = count.saturating_sub(pairs.len()) as f32;
    let (mut sum, mut given) = (0.0_f32, 0_usize);
    let mut ends = [Vec::with_capacity(count), Vec::with_capacity(count)];
    for (k, (own, other)) in spans_a.iter().zip(&spans_b).enumerate() {
        sum += (own.1 / a.length + other.1 / b.length) * 0.5;
        let upto = if k + 1 == pairs.len() { rest as usize } else { ((rest * sum + 0.5) as usize).min(rest as usize) };
        let points = 1 + upto.saturating_sub(given);
        given = given.max(upto);
        for step in 0..points {
            let share = step as f32 / points as f32;
            ends[0].push(a.point(own.0 + own.1 * share));
            ends[1].push(b.point(other.0 + other.1 * share));
        }
    }
    ends
}

/// Two outlines of as many points, the second begun where it lies best on the first.
fn laid_on(first: Vec<Vec2>, second: Vec<Vec2>) -> [Vec<Vec2>; 2] {
    let normal = |outline: &[Vec2]| {
        let centre = outline.iter().fold(Vec2::ZERO, |sum, p| sum + *p) / outline.len().max(1) as f32;
        let scale = 1.0 / area(outline).abs().sqrt().max(1e-6);
        outline.iter().map(|p| (*p - centre) * scale).collect::<Vec<_>>()
    };
    let (a, b) = (normal(&first), normal(&second));
    let count = b.len();
    let off = |shift: usize| (0..count).map(|i| a[i].distance_squared(b[(i + shift) % count])).sum::<f32>();
    let best = (0..count).min_by(|&x, &y| off(x).total_cmp(&off(y)).then(x.cmp(&y))).unwrap_or(0);
    let turned = (0..count).map(|i| second[(i + best) % count]).collect();
    [first, turned]
}

/// How often the outline crosses itself on the way, at a quarter, half and three quarters of it.
fn folds(ends: &[Vec<Vec2>; 2]) -> usize {
    [0.25, 0.5, 0.75]
        .iter()
        .map(|&t| crossings(&ends[0].iter().zip(&ends[1]).map(|(a, b)| a.lerp(*b, t)).collect::<Vec<_>>()))
        .sum()
}

/// How often a closed polygon crosses itself.
fn crossings(polygon: &[Vec2]) -> usize {
    let count = polygon.len();
    let side = |a: Vec2, b: Vec2, p: Vec2| (b - a).perp_dot(p - a);
    let mut found = 0;
    for i in 0..count {
        let (a, b) = (polygon[i], polygon[(i + 1) % count]);
        for j in i + 2..count {
            let (c, d) = (polygon[j], polygon[(j + 1) % count]);
            let apart = a.x.max(b.x) < c.x.min(d.x) || c.x.max(d.x) < a.x.min(b.x);
            if (i == 0 && j + 1 == count) || apart {
                continue;
            }
            let across = side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0;
            found += usize::from(across);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A leaf from its tip down one side, mirrored.
    fn leaf(half: &[(f32, f32)]) -> Vec<Vec2> {
        let side = |sign: f32| half.iter().map(move |&(x, y)| Vec2::new(0.5 + sign * x, y));
        let all: Vec<Vec2> = side(1.0).chain(side(-1.0).rev().filter(|p| p.x < 0.5)).collect();
        // As fine as a picture's outline.
        let next = |i: usize| all[(i + 1) % all.len()];
        (0..all.len())
            .flat_map(|i| (0..16).map(move |k| (i, k)))
            .map(|(i, k)| all[i].lerp(next(i), k as f32 / 16.0))
            .collect()
    }

    const MAPLE: [(f32, f32); 9] = [
        (0.0, 0.0),
        (0.12, 0.3),
        (0.44, 0.2),
        (0.2, 0.48),
        (0.42, 0.6),
        (0.1, 0.68),
        (0.02, 0.72),
        (0.015, 0.97),
        (0.0, 0.98),
    ];
    const OAK: [(f32, f32); 9] = [
        (0.0, 0.03),
        (0.04, 0.26),
        (0.22, 0.42),
        (0.07, 0.5),
        (0.3, 0.74),
        (0.06, 0.8),
        (0.02, 0.84),
        (0.015, 0.97),
        (0.0, 0.98),
    ];

    #[test]
    fn tips_go_to_tips_and_notches_to_notches() {
        let (maple, oak) = (leaf(&MAPLE), leaf(&OAK));
        let with = |corner: usize, sign: f32, ends: &[Vec<Vec2>; 2]| {
            let at = |half: &[(f32, f32)]| Vec2::new(0.5 + sign * half[corner].0, half[corner].1);
            let (from, to) = (at(&MAPLE), at(&OAK));
            let nearest = (0..ends[0].len())
                .min_by(|&i, &j| ends[0][i].distance(from).total_cmp(&ends[0][j].distance(from)))
                .unwrap();
            ends[1][nearest].distance(to)
        };
        let ends = matched(&maple, &oak);
        let even = laid_on(evenly(&maple), evenly(&oak));
        for sign in [1.0, -1.0] {
            // Tip, both lobes and the notches above and between them.
            for corner in 0..5 {
                assert!(with(corner, sign, &ends) < 0.03, "{corner}: {}", with(corner, sign, &ends));
            }
        }
        let missed = (0..5).map(|corner| with(corner, 1.0, &even)).fold(0.0, f32::max);
        assert!(missed > 0.06, "by arc length alone some miss their like: {missed}");
    }

    #[test]
    fn the_way_back_is_the_way_there_and_both_ends_keep_their_shape() {
        let (maple, oak) = (leaf(&MAPLE), leaf(&OAK));
        let (there, back) = (matched(&maple, &oak), matched(&oak, &maple));
        assert!(there[0] == back[1] && there[1] == back[0]);
        assert!(there[0].len() == there[1].len() && crossings(&there[0]) + crossings(&there[1]) == 0);
        for (end, own) in there.iter().zip([&maple, &oak]) {
            assert!((area(end) / area(own) - 1.0).abs() < 0.02, "{} {}", area(end), area(own));
        }
        assert_eq!(folds(&there), 0);
    }

    #[test]
    fn round_outlines_have_no_features_and_are_laid_on_each_other_evenly() {
        let disc = |wide: f32, high: f32| -> Vec<Vec2> {
            let at = |i: usize| math::sin_cos(i as f32 * std::f32::consts::TAU / 200.0);
            (0..200).map(|i| Vec2::new(at(i).1 * wide, at(i).0 * high)).collect()
        };
        let (a, b) = (disc(1.0, 1.2), disc(1.3, 1.0));
        assert!(Outline::new(&a).features.is_empty() && Outline::new(&b).features.is_empty());
        let [from, to] = matched(&a, &b);
        assert!(from.len() == 96 && from.iter().zip(&to).all(|(p, q)| p.distance(*q) < 0.5));
    }

    #[test]
    fn outlines_of_next_to_nothing_are_matched() {
        let speck = [Vec2::ZERO, Vec2::new(1e-4, 0.0), Vec2::new(0.0, 1e-4)];
        let point = [Vec2::ONE; 3];
        for (a, b) in [(&speck[..], &leaf(&OAK)[..]), (&point, &speck), (&point, &point)] {
            let [from, to] = matched(a, b);
            assert!(from.len() == to.len() && from.iter().chain(&to).all(|p| p.is_finite()));
        }
    }
}
