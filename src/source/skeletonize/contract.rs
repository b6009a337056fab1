//! Laplacian contraction: a surface shrinks to its axes, without a change of what is joined to what.
//!
//! Au, Tai, Chu, Cohen-Or and Lee 2008, "Skeleton Extraction by Mesh Contraction", section 4. Each round solves
//! `[W_L L; W_H] V' = [0; W_H V]` in the sense of least squares: `L` draws every vertex to the middle of its neighbours,
//! `W_H` holds it where it is. `W_L` doubles from round to round; `W_H` of a vertex grows with the square root of how
//! much the area around it has shrunk, so that what is thin already stays where it is while the trunk goes on. Rounds end
//! when the area is small enough for the surgery, or don't help any more.
//!
//! Differences to the paper. The cotangents are those of the first surface in all rounds, as Kazhdan, Solomon and
//! Ben-Chen 2012 ("Can Mean-Curvature Flow be Modified to be Non-singular?") keep theirs: on a straight tube, whatever its
//! triangles, they leave places along the axis just where they are, while the cotangents of the slivers that every
//! contraction makes draw neighbouring vertices apart along it. With those, a skin of twigs with long thin triangles
//! had twice its area after fourteen rounds, and lost 50 of its 122 branches; with these it has a seventh, and keeps all.
//! The rows of `L` are divided by their sums, so that the equations' condition is at most `4 W_L²`. And a vertex whose
//! area has shrunk to [`DONE`] is held from then on in the measure of `W_L`: by the square root alone, the rounds that a
//! trunk still needs drew twigs back along their axes, by ten edges and more; of a shell with fifty limbs half were gone.
//! Cotangents are clamped on both sides ([`FLAT`], [`STEEP`]), which is what makes zero-area and obtuse triangles
//! harmless. Both ends of the scale of `W_L` are then pure numbers.

use glam::DVec3;

use super::cholesky::{Factor, Symbolic};
use super::surface::Surface;

/// `W_L` of the first round.
const FIRST: f64 = 1.0;
/// Its factor from one round to the next, `s_L`.
const STRONGER: f64 = 2.0;
/// Least cotangent.
const FLAT: f64 = 1e-3;
/// Largest cotangent.
const STEEP: f64 = 1e3;
/// The share of the first area at which rounds end.
const THIN: f64 = 0.01;
/// The share of the first area from which on a round that gains little is the last one.
const CONTRACTED: f64 = 0.3;
/// What little is: the share of the area before it that such a round leaves.
const SETTLED: f64 = 0.97;
/// Most rounds.
const MOST_ROUNDS: usize = 14;
/// The share of its first area at which a vertex is done.
const DONE: f64 = 0.03;
/// `W_H` of what is done, over `W_L`.
const FAST: f64 = 4.0;
/// Most that `W_H` grows otherwise.
const MOST_HOLD: f64 = 1e3;
/// Most multiplications of one factoring: a second's worth.
const MOST_WORK: f64 = 1.5e9;

/// What each vertex of a surface contracts to; none where the factor would be too large, for a coarser surface is needed.
pub(super) fn contract(surface: &Surface) -> Option<Vec<DVec3>> {
    let equations = Equations::new(surface)?;
    let mut shrunk = surface.clone();
    let before = surface.area();
    let shares = surface.shares();
    let mean = before / surface.positions.len().max(1) as f64;
    let mut hold = vec![1.0_f64; surface.positions.len()];
    let mut pull = FIRST;
    let mut scratch = Factor::default();
    let mut last = before;
    for _ in 0..MOST_ROUNDS {
        equations.round(&mut shrunk, pull, &hold, &mut scratch);
        let area = shrunk.area();
        if area.is_nan() || area <= before * THIN || (area > last * SETTLED && area < before * CONTRACTED) {
            break;
        }
        last = area;
        pull *= STRONGER;
        for ((hold, &was), now) in hold.iter_mut().zip(&shares).zip(shrunk.shares()) {
            // Where there was next to no area, its loss says nothing.
            if was < mean * 1e-3 {
                continue;
            }
            let left = now / was;
            *hold = hold.max((1.0 / left.max(1e-9)).sqrt().clamp(1.0, MOST_HOLD));
            if left < DONE {
                *hold = hold.max(pull * FAST);
            }
        }
    }
    Some(shrunk.positions)
}

/// The normal equations' pattern and the rows of `L`, which no round changes.
struct Equations {
    symbolic: Symbolic,
    /// For each vertex, for each pair of its row's columns (itself last, then its neighbours, the second not before the
    /// first), the slot in the matrix.
    slots: Vec<u32>,
    diagonal: Vec<u32>,
    /// For each vertex the shares of its neighbours, rising.
    weights: Vec<Vec<f64>>,
}

impl Equations {
    fn new(surface: &Surface) -> Option<Self> {
        let links: Vec<Vec<u32>> = surface.neighbours().iter().map(|list| list.iter().map(|n| n.0).collect()).collect();
        let n = links.len();
        let mut pattern: Vec<Vec<u32>> = Vec::with_capacity(n);
        let mut entries = 0_usize;
        for (i, near) in links.iter().enumerate() {
            let mut row = vec![i as u32];
            row.extend_from_slice(near);
            near.iter().for_each(|&k| row.extend_from_slice(&links[k as usize]));
            row.sort_unstable();
            row.dedup();
            entries += row.len();
            if entries > 64 * n + 200_000 {
                return None;
            }
            pattern.push(row);
        }
        let symbolic = Symbolic::new(&pattern)?;
        if symbolic.work > MOST_WORK {
            return None;
        }
        let mut slots = Vec::new();
        for (i, near) in links.iter().enumerate() {
            let columns = || near.iter().copied().chain([i as u32]);
            for (k, a) in columns().enumerate() {
                slots.extend(columns().skip(k).map(|b| symbolic.slot(a, b) as u32));
            }
        }
        let diagonal = (0..n as u32).map(|i| symbolic.slot(i, i) as u32).collect();
        let weights = weights(surface, &links);
        Some(Self { symbolic, slots, diagonal, weights })
    }

    /// One round.
    fn round(&self, shrunk: &mut Surface, pull: f64, hold: &[f64], scratch: &mut Factor) {
        let mut values = vec![0.0_f64; self.symbolic.entries()];
        let mut slots = self.slots.iter();
        let mut row: Vec<f64> = Vec::new();
        for weights in &self.weights {
            row.clear();
            row.extend(weights.iter().map(|w| w * pull));
            row.push(-pull);
            for k in 0..row.len() {
                for &other in &row[k..] {
                    if let Some(&slot) = slots.next() {
                        values[slot as usize] += row[k] * other;
                    }
                }
            }
        }
        for (&slot, hold) in self.diagonal.iter().zip(hold) {
            values[slot as usize] += hold * hold;
        }
        let mut sides: Vec<[f64; 3]> =
            shrunk.positions.iter().zip(hold).map(|(&p, h)| (p * (h * h)).to_array()).collect();
        self.symbolic.solve(&values, &mut sides, scratch);
        for (p, side) in shrunk.positions.iter_mut().zip(sides) {
            let to = DVec3::from_array(side);
            if to.is_finite() {
                *p = to;
            }
        }
    }
}

/// The cotangent weights of each vertex's edges, over their sum.
fn weights(surface: &Surface, links: &[Vec<u32>]) -> Vec<Vec<f64>> {
    let mut weights: Vec<Vec<f64>> = links.iter().map(|l| vec![0.0; l.len()]).collect();
    for &[a, b, c] in &surface.triangles {
        for [tip, u, v] in [[a, b, c], [b, c, a], [c, a, b]] {
            let at = surface.positions[tip as usize];
            let (x, y) = (surface.positions[u as usize] - at, surface.positions[v as usize] - at);
            let cross = x.cross(y).length();
            let cotangent = if cross > 0.0 { (x.dot(y) / cross).clamp(FLAT, STEEP) } else { FLAT };
            for (p, q) in [(u, v), (v, u)] {
                if let Ok(k) = links[p as usize].binary_search(&q) {
                    weights[p as usize][k] += cotangent;
                }
            }
        }
    }
    for row in &mut weights {
        let sum: f64 = row.iter().sum();
        row.iter_mut().for_each(|w| *w /= sum);
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::super::cap::closed;
    use super::super::shapes;
    use super::*;

    #[test]
    fn a_tube_contracts_to_its_axis_and_keeps_most_of_its_length() {
        for sides in [4, 8, 16] {
            let path: Vec<DVec3> = (0..40).map(|k| DVec3::Y * 0.1 * f64::from(k)).collect();
            let surface = closed(&shapes::tube(&path, &[0.1; 40], sides));
            let thin = contract(&surface).unwrap();
            let offs: Vec<f64> = thin.iter().map(|p| DVec3::new(p.x, 0.0, p.z).length()).collect();
            let mean = offs.iter().sum::<f64>() / offs.len() as f64;
            // The rings of the ends, whose area goes along the axis too, stay a little wider than the others.
            let most = offs.iter().fold(0.0_f64, |m, &o| m.max(o));
            let (low, high) = thin.iter().fold((9.0_f64, 0.0_f64), |(l, h), p| (l.min(p.y), h.max(p.y)));
            assert!(mean < 0.01 && most < 0.015, "{sides} {mean} {most}");
            assert!(high - low > 3.7, "{sides} {low} {high}");
        }
    }

    #[test]
    fn a_thin_twig_of_long_triangles_stays_in_place_while_it_contracts() {
        // Rings a hundred radii apart, as a twig of a coarse skin has; bent, so that it isn't the axis of anything.
        let path: Vec<DVec3> = (0..8).map(|k| DVec3::new(0.02 * f64::from(k * k), 0.3 * f64::from(k), 0.0)).collect();
        let surface = closed(&shapes::tube(&path, &[0.003; 8], 8));
        let thin = contract(&surface).unwrap();
        let shrunk = Surface { positions: thin.clone(), ..surface.clone() };
        assert!(shrunk.area() < surface.area() * 0.3, "{}", shrunk.area() / surface.area());
        let most = thin.iter().zip(&surface.positions).fold(0.0_f64, |m, (a, b)| m.max(a.distance(*b)));
        assert!(most < 0.03, "{most}");
    }

    #[test]
    fn flat_and_zero_area_triangles_do_no_harm() {
        let mut surface = shapes::tube(&[DVec3::ZERO, DVec3::Y, DVec3::Y, DVec3::Y * 2.0], &[0.2, 0.2, 0.2, 0.0], 6);
        surface.positions[3] = surface.positions[4];
        assert!(contract(&surface).unwrap().iter().all(|p| p.is_finite() && p.length() < 3.0));
    }
}
