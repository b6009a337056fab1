//! Outlines in correspondence: a crown's silhouette, a sketch, and which place of one becomes which of the other.
//!
//! Both are cut where the vertical through the sketch's middle leaves them above and below, and each half is run along by
//! arc length (2018, 5.1; Nealen et al. 2005): so what is symmetric stays so, and the notch of a heart comes from the top
//! of a ball. A crown whose own silhouette is drawn keeps it exactly.
//!
//! An open sketch replaces the part of the silhouette between the places nearest to its ends, on the side where it runs: places
//! of that part go onto it by arc length, all others stay. As a ring of its own, with landmarks of its own, it shifted
//! places along the whole silhouette (a bump of 2 m on one side of a circle of 8 m by up to 1.15 m on the other).

use glam::Vec2;

/// The places of a closed ring by arc length.
pub(super) struct Ring<'r> {
    points: &'r [Vec2],
    /// Arc length up to each point, and of the whole at the end.
    arc: Vec<f32>,
}

impl<'r> Ring<'r> {
    pub(super) fn new(points: &'r [Vec2]) -> Self {
        let mut arc = vec![0.0];
        let mut length = 0.0_f64;
        for (a, b) in points.iter().zip(points.iter().cycle().skip(1)) {
            length += f64::from(a.distance(*b));
            arc.push(length as f32);
        }
        Self { points, arc }
    }

    /// Its length; no walk along it is longer.
    pub(super) fn length(&self) -> f32 {
        self.arc[self.arc.len() - 1]
    }

    /// Where it is after a length, on and on round it.
    pub(super) fn at(&self, s: f32) -> Vec2 {
        let s = s.rem_euclid(self.length().max(f32::MIN_POSITIVE));
        let n = self.points.len();
        let i = self.arc[1..n].partition_point(|a| *a <= s);
        let span = self.arc[i + 1] - self.arc[i];
        let f = if span > 0.0 { ((s - self.arc[i]) / span).clamp(0.0, 1.0) } else { 0.0 };
        self.points[i].lerp(self.points[(i + 1) % n], f)
    }

    /// Where the ring crosses a vertical: the lowest and the highest crossing.
    fn landmarks(&self, x: f32) -> Option<(f32, f32)> {
        let n = self.points.len();
        let mut found: Option<((f32, f32), (f32, f32))> = None;
        for i in 0..n {
            let (a, b) = (self.points[i], self.points[(i + 1) % n]);
            if (a.x <= x) == (b.x <= x) {
                continue;
            }
            let f = (x - a.x) / (b.x - a.x);
            let (y, s) = (a.y + (b.y - a.y) * f, self.arc[i] + (self.arc[i + 1] - self.arc[i]) * f);
            let (low, high) = found.unwrap_or(((y, s), (y, s)));
            found = Some((if y < low.0 { (y, s) } else { low }, if y > high.0 { (y, s) } else { high }));
        }
        found.map(|(low, high)| (low.1, high.1))
    }

    /// Arc lengths of `count` places from the lowest landmark on, half of them up to the highest.
    fn places(&self, count: usize) -> impl Iterator<Item = f32> + use<> {
        let low = self.points.iter().fold(f32::INFINITY, |m, p| m.min(p.x));
        let high = self.points.iter().fold(f32::NEG_INFINITY, |m, p| m.max(p.x));
        let x = (low + high) * 0.5;
        let (low, high) = self.landmarks(x).unwrap_or((0.0, self.length() * 0.5));
        let up = (high - low).rem_euclid(self.length().max(f32::MIN_POSITIVE));
        let half = count / 2;
        let down = self.length() - up;
        (0..count).map(move |i| {
            let s = if i < half {
                up * i as f32 / half as f32
            } else {
                up + down * (i - half) as f32 / (count - half) as f32
            };
            low + s
        })
    }
}

/// A ring, counter-clockwise, as `count` places: what becomes of place i of one ring is place i of another. They start
/// where the vertical through the ring's middle leaves it below; half of them lead up to where it leaves it above.
#[must_use]
pub fn resampled(ring: &[Vec2], count: usize) -> Vec<Vec2> {
    if ring.len() < 2 {
        return vec![ring.first().copied().unwrap_or_default(); count];
    }
    let ring = Ring::new(ring);
    ring.places(count).map(|s| ring.at(s)).collect()
}

/// The convex hull of some points, counter-clockwise (Andrew's monotone chain).
pub(super) fn hull(points: &[Vec2]) -> Vec<Vec2> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = Vec2>| {
        let mut chain: Vec<Vec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..] {
                if (b - a).perp_dot(p - b) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    sorted.dedup();
    let mut ring = half(&mut sorted.iter().copied());
    ring.extend(half(&mut sorted.iter().rev().copied()));
    ring
}

/// The edges of a closed ring, for asking where places lie.
#[derive(Clone, Debug)]
pub(super) struct Edges(Vec<(Vec2, Vec2, f32)>);

impl Edges {
    pub(super) fn new(ring: &[Vec2]) -> Self {
        // Start, way, and one over the square of its length.
        let edge = |(a, b): (&Vec2, &Vec2)| (*a, *b - *a, 1.0 / a.distance_squared(*b).max(1e-12));
        Self(ring.iter().zip(ring.iter().cycle().skip(1)).map(edge).collect())
    }

    /// Whether a place is inside, by the even-odd rule, and the square of its distance to the ring.
    pub(super) fn at(&self, p: Vec2) -> (bool, f32) {
        let (mut inside, mut off) = (false, f32::INFINITY);
        for &(a, way, over) in &self.0 {
            let from = p - a;
            off = off.min((from - way * (from.dot(way) * over).clamp(0.0, 1.0)).length_squared());
            inside ^= (from.y >= 0.0) != (from.y >= way.y) && (way.perp_dot(from) > 0.0) == (way.y > 0.0);
        }
        (inside, off)
    }
}

/// What an open line makes of a ring.
#[derive(Clone, Debug)]
pub(super) struct Replaced {
    /// The ring with the line in it.
    pub(super) ring: Vec<Vec2>,
    /// What becomes of the places of the old ring as [`resampled`] has it: those of the part that goes stand on the line by
    /// arc length, all others where they were.
    pub(super) places: Vec<Vec2>,
    /// How many go.
    pub(super) gone: usize,
    /// The part that goes, and the line, which runs the same way.
    pub(super) part: Vec<Vec2>,
    pub(super) line: Vec<Vec2>,
}

/// Replaces the part of a ring that an open line runs along; `count` places of it are followed. None for an empty line.
pub(super) fn replaced(ring: &[Vec2], line: &[Vec2], count: usize) -> Option<Replaced> {
    let whole = Ring::new(ring);
    let nearest = |p: Vec2| {
        let n = ring.len();
        let mut best = (f32::INFINITY, 0.0);
        for i in 0..n {
            let (a, b) = (ring[i], ring[(i + 1) % n]);
            let way = b - a;
            let square = way.length_squared();
            let f = if square > 0.0 { ((p - a).dot(way) / square).clamp(0.0, 1.0) } else { 0.0 };
            let distance = (a + way * f).distance_squared(p);
            if distance < best.0 {
                best = (distance, whole.arc[i] + (whole.arc[i + 1] - whole.arc[i]) * f);
            }
        }
        best.1
    };
    let (&first, &last) = (line.first()?, line.last()?);
    let length = whole.length().max(f32::MIN_POSITIVE);
    let (a, b) = (nearest(first), nearest(last));
    let open = Open::new(line);
    // The part that goes: forwards from a to b, or from b to a. The one along which the line runs.
    let forwards = (b - a).rem_euclid(length);
    let off = |from: f32, span: f32, reversed: bool| {
        let steps = 32;
        (0..=steps)
            .map(|k| {
                let f = k as f32 / steps as f32;
                open.at(if reversed { 1.0 - f } else { f }).distance(whole.at(from + span * f))
            })
            .sum::<f32>()
    };
    let reversed = off(a, forwards, false) > off(b, length - forwards, true);
    let (start, span) = if reversed { (b, length - forwards) } else { (a, forwards) };
    let line: Vec<Vec2> = if reversed { line.iter().rev().copied().collect() } else { line.to_vec() };
    let open = Open::new(&line);
    let steps = ring.len().clamp(16, 4096);
    let along = |from: f32, span: f32| {
        let whole = &whole;
        (0..=steps).map(move |k| whole.at(from + span * k as f32 / steps as f32))
    };
    let mut made = line.clone();
    made.extend(along(start + span, length - span).skip(1).take(steps - 1));
    let mut gone = 0;
    let places = whole.places(count).map(|s| {
        let from = (s - start).rem_euclid(length);
        if from < span {
            gone += 1;
            open.at(from / span)
        } else {
            whole.at(s)
        }
    });
    let places = places.collect();
    let part = along(start, span).collect();
    Some(Replaced { ring: made, places, gone, part, line })
}

/// An open line by arc length.
struct Open<'l> {
    points: &'l [Vec2],
    arc: Vec<f32>,
}

impl<'l> Open<'l> {
    fn new(points: &'l [Vec2]) -> Self {
        let mut length = 0.0_f64;
        let steps = points.windows(2).map(|pair| f64::from(pair[0].distance(pair[1])));
        let arc = std::iter::once(0.0).chain(steps.map(|step| {
            length += step;
            length as f32
        }));
        let arc = arc.collect();
        Self { points, arc }
    }

    /// Where it is at a share of its length.
    fn at(&self, f: f32) -> Vec2 {
        let last = self.points.len() - 1;
        let s = f * self.arc[last];
        let i = self.arc.partition_point(|a| *a <= s).clamp(1, last.max(1)).min(last);
        if i == 0 {
            return self.points[0];
        }
        let span = self.arc[i] - self.arc[i - 1];
        let f = if span > 0.0 { ((s - self.arc[i - 1]) / span).clamp(0.0, 1.0) } else { 0.0 };
        self.points[i - 1].lerp(self.points[i], f)
    }
}

/// Discrete Fréchet distance of two polylines (Eiter and Mannila 1994): the shortest leash for two who walk along them and
/// never back. Quadratic in time, linear in memory; infinite where one is empty.
#[must_use]
pub fn discrete_frechet(a: &[Vec2], b: &[Vec2]) -> f32 {
    if a.is_empty() || b.is_empty() {
        return f32::INFINITY;
    }
    let mut row = vec![0.0_f32; b.len()];
    for (i, p) in a.iter().enumerate() {
        let mut before = f32::INFINITY;
        for (j, q) in b.iter().enumerate() {
            let above = row[j];
            let least = match (i, j) {
                (0, 0) => 0.0,
                (0, _) => row[j - 1],
                (_, 0) => above,
                _ => above.min(before).min(row[j - 1]),
            };
            before = above;
            row[j] = least.max(p.distance(*q));
        }
    }
    row[b.len() - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(n: usize, r: f32) -> Vec<Vec2> {
        (0..n)
            .map(|i| {
                let (s, c) = crate::base::math::sin_cos(std::f32::consts::TAU * i as f32 / n as f32);
                Vec2::new(c, s) * r
            })
            .collect()
    }

    #[test]
    fn rings_are_matched_from_the_middle_below() {
        let ring = circle(200, 1.0);
        assert_eq!(resampled(&ring, 64), resampled(&ring, 64));
        for (p, q) in resampled(&ring, 64).iter().zip(&resampled(&circle(173, 2.0), 64)) {
            assert!((*p * 2.0).distance(*q) < 0.02, "{p} {q}");
        }
    }

    #[test]
    fn the_hull_of_a_dented_square_is_the_square() {
        let points = [(0, 0), (2, 0), (1, 1), (2, 2), (0, 2), (1, 0)].map(|(x, y)| Vec2::new(x as f32, y as f32));
        assert_eq!(hull(&points), [Vec2::ZERO, Vec2::X * 2.0, Vec2::splat(2.0), Vec2::Y * 2.0]);
        assert!(hull(&[]).is_empty() && hull(&[Vec2::X; 4]).len() <= 1);
    }

    #[test]
    fn an_open_line_replaces_the_part_it_runs_along_whichever_way_it_is_drawn() {
        let ring = circle(100, 1.0);
        let bump = vec![Vec2::new(0.7, 0.7), Vec2::new(0.0, 2.0), Vec2::new(-0.7, 0.7)];
        for line in [bump.clone(), bump.iter().rev().copied().collect()] {
            let Replaced { ring: made, places, gone, .. } = replaced(&ring, &line, 64).unwrap();
            let top = made.iter().fold(f32::NEG_INFINITY, |m, p| m.max(p.y));
            let bottom = made.iter().fold(f32::INFINITY, |m, p| m.min(p.y));
            assert!((top - 2.0).abs() < 1e-5 && (bottom + 1.0).abs() < 1e-2);
            assert!(super::super::region::twice_signed_area(&made) > 5.0);
            // A quarter goes, evenly along the line; all else stays to the last bit.
            let was = resampled(&ring, 64);
            let moved: Vec<usize> = (0..64).filter(|i| places[*i] != was[*i]).collect();
            assert!(
                moved.len() == gone && gone.abs_diff(16) <= 1 && moved.iter().all(|i| was[*i].y > 0.7),
                "{moved:?}"
            );
            let steps: Vec<f32> = moved.windows(2).map(|m| places[m[0]].distance(places[m[1]])).collect();
            let [least, most] = [f32::min, f32::max].map(|of| steps.iter().copied().reduce(of).unwrap());
            // A step over the line's corner is a chord.
            assert!(most < 1.01 * 2.95 / 15.0 && least > 0.4 * most, "{steps:?}");
        }
    }

    #[test]
    fn the_leash_of_known_walks() {
        let a = [Vec2::ZERO, Vec2::X, Vec2::X * 2.0];
        let b = [Vec2::Y, Vec2::new(1.0, 1.0), Vec2::new(2.0, 1.0)];
        assert_eq!(discrete_frechet(&a, &b), 1.0);
        // Walking the other way the ends are two apart.
        let back: Vec<Vec2> = a.iter().rev().copied().collect();
        assert_eq!(discrete_frechet(&a, &back), 2.0);
        assert_eq!(discrete_frechet(&a, &[]), f32::INFINITY);
    }
}
