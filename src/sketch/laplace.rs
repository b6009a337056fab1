//! Laplacian deformation (2018, Eq. 1; Nealen et al. 2005): the displacement whose Laplacian is least while some places move as
//! they are told.
//!
//! `Σ |L(v') - σ|² + Σ |v'_c - c|²` is linear, so displacements are sums of those that are told, by weights that are found once
//! for each shape:
//!
//! - [`weights`] along a branch, with `L` by arc length, told at its base and handles. With base and tip alone that is
//!   the straight line from one displacement to the other; with more handles a smooth curve through them. The normal
//!   equations have five diagonals: time and memory are linear in points.
//! - [`extended`] for anything of a few dozen vertices, by rows of `L`: surfaces of lobes (`sketch/lobe.rs`) and cages that adapt
//!   (`sketch/adapt.rs`). What is told there holds to the last digit.

/// Weight of a constraint against the Laplacian at one point.
const HELD: f64 = 1e4;

/// For each point of a polyline its weights of the displacements of base and handles: `1 + handles` a point. `arc` is the arc
/// length at each point, from 0, never falling; handles are places along it, rising.
pub(super) fn weights(arc: &[f64], handles: &[f64]) -> Vec<f32> {
    let (n, columns) = (arc.len(), handles.len() + 1);
    let length = arc.last().copied().unwrap_or(0.0);
    let even = |i: usize| i as f64 / (n - 1).max(1) as f64;
    let at = |i: usize| if length > 0.0 { arc[i] / length } else { even(i) };
    if handles.is_empty() || n < 2 {
        return vec![1.0; n * columns.max(1)];
    }
    if handles.len() == 1 {
        let end = if length > 0.0 { (handles[0] / length).max(1e-9) } else { 1.0 };
        return (0..n)
            .flat_map(|i| {
                let f = (at(i) / end).min(1.0) as f32;
                [1.0 - f, f]
            })
            .collect();
    }
    // Rows of the least squares: (columns of points with factors), as bands of the normal matrix.
    let mut bands = vec![[0.0_f64; 3]; n];
    let mut right = vec![0.0_f64; n * columns];
    let mut row = |terms: &[(usize, f64)], side: Option<usize>| {
        for &(i, a) in terms {
            for &(j, b) in terms.iter().filter(|(j, _)| *j >= i) {
                bands[i][j - i] += a * b;
            }
            if let Some(k) = side {
                right[i * columns + k] += a * HELD;
            }
        }
    };
    let gap = |i: usize| (at(i + 1) - at(i)).max(1e-4) * n as f64;
    for i in 1..n - 1 {
        let (before, after) = (1.0 / gap(i - 1), 1.0 / gap(i));
        row(&[(i - 1, before), (i, -before - after), (i + 1, after)], None);
    }
    // Keeps stretches beyond the last handle, and points in one place, from being free.
    for i in 0..n - 1 {
        row(&[(i, -1e-3), (i + 1, 1e-3)], None);
    }
    row(&[(0, HELD)], Some(0));
    for (k, &handle) in handles.iter().enumerate() {
        let s = if length > 0.0 { (handle / length).clamp(0.0, 1.0) } else { even(n - 1) };
        let i = (1..n - 1).take_while(|&i| at(i) <= s).last().unwrap_or(0);
        let span = at(i + 1) - at(i);
        let f = if span > 0.0 { ((s - at(i)) / span).clamp(0.0, 1.0) } else { 0.0 };
        row(&[(i, (1.0 - f) * HELD), (i + 1, f * HELD)], Some(k + 1));
    }
    solve(&mut bands, &mut right, columns);
    right.iter().map(|w| *w as f32).collect()
}

/// Solves a symmetric positive definite system of five diagonals in place, for several right sides.
fn solve(bands: &mut [[f64; 3]], right: &mut [f64], columns: usize) {
    let n = bands.len();
    for i in 0..n {
        let pivot = bands[i][0].max(1e-300);
        for d in 1..3_usize.min(n - i) {
            let factor = bands[i][d] / pivot;
            for e in d..3_usize.min(n - i) {
                bands[i + d][e - d] -= factor * bands[i][e];
            }
            for c in 0..columns {
                right[(i + d) * columns + c] -= factor * right[i * columns + c];
            }
        }
    }
    for i in (0..n).rev() {
        for c in 0..columns {
            let mut value = right[i * columns + c];
            for d in 1..3_usize.min(n - i) {
                value -= bands[i][d] * right[(i + d) * columns + c];
            }
            right[i * columns + c] = value / bands[i][0].max(1e-300);
        }
    }
}

/// Pivots are at least this share of the largest: a vertex that no row ties to what is held stays where it is.
const SINGULAR: f64 = 1e-12;

/// For each of `count` vertices its weights of the displacements of the `held` ones: `held.len()` a vertex. `rows` are the rows
/// of the Laplacian, `count` each, scaled by the roots of how much they count. Cubic in what is free.
pub(super) fn extended(rows: &[f64], count: usize, held: &[usize]) -> Vec<f64> {
    let columns = held.len();
    let free: Vec<usize> = (0..count).filter(|i| !held.contains(i)).collect();
    let n = free.len();
    // Normal equations of what is free, with right sides by what is held.
    let mut normal = vec![0.0; n * n];
    let mut right = vec![0.0; n * columns];
    for row in rows.chunks_exact(count.max(1)) {
        for (a, &i) in free.iter().enumerate().filter(|(_, i)| row[**i] != 0.0) {
            for (b, &j) in free.iter().enumerate() {
                normal[a * n + b] += row[i] * row[j];
            }
            for (k, &j) in held.iter().enumerate() {
                right[a * columns + k] -= row[i] * row[j];
            }
        }
    }
    let least = (0..n).map(|i| normal[i * n + i]).fold(f64::MIN_POSITIVE, f64::max) * SINGULAR;
    for i in 0..n {
        let pivot = normal[i * n + i].max(least);
        for below in i + 1..n {
            let factor = normal[below * n + i] / pivot;
            (i..n).for_each(|c| normal[below * n + c] -= factor * normal[i * n + c]);
            (0..columns).for_each(|c| right[below * columns + c] -= factor * right[i * columns + c]);
        }
    }
    for i in (0..n).rev() {
        let pivot = normal[i * n + i].max(least);
        for c in 0..columns {
            let known: f64 = (i + 1..n).map(|j| normal[i * n + j] * right[j * columns + c]).sum();
            right[i * columns + c] = (right[i * columns + c] - known) / pivot;
        }
    }
    let mut weights = vec![0.0; count * columns];
    held.iter().enumerate().for_each(|(k, &i)| weights[i * columns + k] = 1.0);
    for (a, &i) in free.iter().enumerate() {
        weights[i * columns..][..columns].copy_from_slice(&right[a * columns..][..columns]);
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_held_stays_and_the_rest_of_a_line_follows_straight() {
        // Second differences of six places, the second and the fourth held.
        let mut rows = vec![0.0; 4 * 6];
        (0..4).for_each(|i| [1.0, -2.0, 1.0].into_iter().enumerate().for_each(|(k, w)| rows[i * 6 + i + k] = w));
        let found = extended(&rows, 6, &[1, 3]);
        for (i, w) in found.chunks_exact(2).enumerate() {
            let f = (i as f64 - 1.0) / 2.0;
            assert!((w[0] - (1.0 - f)).abs() < 1e-9 && (w[1] - f).abs() < 1e-9, "{i}: {w:?}");
        }
        // Nothing said of anything: all that is free stays.
        assert_eq!(extended(&[], 3, &[1]), [0.0, 1.0, 0.0]);
        assert!(extended(&[], 0, &[]).is_empty());
    }

    #[test]
    fn base_and_tip_alone_share_by_arc_length() {
        assert_eq!(weights(&[0.0, 1.0, 4.0], &[4.0]), [1.0, 0.0, 0.75, 0.25, 0.0, 1.0]);
    }

    #[test]
    fn weights_add_up_to_one_and_handles_move_as_told() {
        let arc: Vec<f64> = (0..30).map(|i| i as f64 * i as f64 * 0.1).collect();
        let handles = [arc[29] / 3.0, arc[29] * 2.0 / 3.0, arc[29]];
        let found = weights(&arc, &handles);
        for w in found.chunks_exact(4) {
            assert!((w.iter().sum::<f32>() - 1.0).abs() < 1e-3, "{w:?}");
        }
        assert!((found[0] - 1.0).abs() < 1e-3 && (found[29 * 4 + 3] - 1.0).abs() < 1e-3);
        // A displacement that grows with arc length stays one.
        for (i, w) in found.chunks_exact(4).enumerate() {
            let sum: f64 = w[1..].iter().zip(handles).map(|(w, h)| f64::from(*w) * h).sum();
            assert!((sum - arc[i]).abs() < arc[29] * 2e-3, "{i}: {sum} {}", arc[i]);
        }
    }

    #[test]
    fn odd_lines_give_finite_weights() {
        for arc in [&[0.0, 0.0, 0.0][..], &[0.0, 1.0], &[0.0, 0.0, 1.0, 1.0], &[0.0]] {
            for handles in [&[][..], &[0.0], &[0.0, 0.0], &[0.3, 1.0]] {
                assert!(weights(arc, handles).iter().all(|w| w.is_finite()), "{arc:?} {handles:?}");
            }
        }
    }
}
