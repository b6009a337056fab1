//! The assignment problem on a few candidates a row, with proof that no other pair would do better.
//!
//! A dense search is cubic. Here each row starts with the [`FIRST`] columns of the least lower bound; shortest
//! augmenting paths run on these arcs only, and their dual potentials price every other pair: where even the lower bound
//! of a pair costs no less than its row's and column's potentials together, no optimum needs it (linear programming
//! duality); where it does not, the exact cost decides, and the pair joins the candidates for another round. When no pair
//! joins, the answer is an optimum of the whole matrix. Crowns make good bounds: of 600 × 600 limbs about one pair in
//! forty is ever measured, in three or four rounds.
//!
//! Time: `rows · columns` for the bounds and their pricing, which is a subtraction a pair, and `rows · candidates ·
//! log` for each path that is searched; quadratic in siblings, not cubic. Ties go to the lowest column.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rayon::prelude::*;

/// Candidates that a row starts with.
const FIRST: usize = 10;
/// How far a pair may undercut the potentials and still count as rounding.
const SLACK: f64 = 1e-9;
/// Bounds of fewer cells are priced on one thread.
const PARALLEL_CELLS: usize = 1 << 15;

/// The column of each row, for `rows <= columns`. `bounds` holds a lower bound of each cost, row after row; `exact`
/// gives the cost itself, finite.
pub(super) fn assign_pruned(
    rows: usize,
    columns: usize,
    bounds: &[f32],
    exact: &(dyn Fn(usize, usize) -> f64 + Sync),
) -> Vec<usize> {
    let line = |row: usize| &bounds[row * columns..(row + 1) * columns];
    let mut arcs: Vec<Vec<(u32, f64)>> = each(rows, columns, &|row| {
        let mut order: Vec<u32> = (0..columns as u32).collect();
        nearest(&mut order, FIRST, line(row));
        order.iter().map(|&column| (column, exact(row, column as usize))).collect()
    });
    loop {
        let mut wanted = match search(&arcs, columns) {
            Ok((answer, row_potential, column_potential)) => {
                let wanted: Vec<Vec<(u32, f64)>> = each(rows, columns, &|row| {
                    let most = row_potential[row] - SLACK;
                    let cheap = line(row).iter().zip(&column_potential).enumerate();
                    cheap
                        .filter(|(_, (bound, potential))| f64::from(**bound) - **potential < most)
                        .filter(|(column, _)| arcs[row].iter().all(|arc| arc.0 as usize != *column))
                        .map(|(column, (_, potential))| (column as u32, exact(row, column), *potential))
                        .filter(|(_, cost, potential)| cost - potential < most)
                        .map(|(column, cost, _)| (column, cost))
                        .collect()
                });
                if wanted.iter().all(Vec::is_empty) {
                    return answer;
                }
                wanted
            }
            // These rows share too few columns: twice as many for each.
            Err(stuck) => {
                let mut wanted = vec![Vec::new(); rows];
                for row in stuck {
                    let mut order: Vec<u32> = (0..columns as u32).collect();
                    order.retain(|column| arcs[row].iter().all(|arc| arc.0 != *column));
                    nearest(&mut order, arcs[row].len().max(1), line(row));
                    wanted[row] = order.iter().map(|&column| (column, exact(row, column as usize))).collect();
                }
                wanted
            }
        };
        for (own, more) in arcs.iter_mut().zip(&mut wanted) {
            own.append(more);
        }
    }
}

/// Something of every row, in order.
fn each<T: Send>(rows: usize, columns: usize, make: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    if rows * columns < PARALLEL_CELLS {
        (0..rows).map(make).collect()
    } else {
        (0..rows).into_par_iter().with_min_len(16).map(make).collect()
    }
}

/// Keeps the `count` columns of the least bounds, ties by column.
fn nearest(order: &mut Vec<u32>, count: usize, bounds: &[f32]) {
    if order.len() > count {
        let key = |c: &u32| (bounds[*c as usize], *c);
        order.select_nth_unstable_by(count, |a, b| key(a).0.total_cmp(&key(b).0).then(a.cmp(b)));
        order.truncate(count);
    }
}

/// A distance in a heap; distances are never NaN.
#[derive(Clone, Copy, PartialEq)]
struct Far(f64);

impl Eq for Far {}

impl Ord for Far {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl PartialOrd for Far {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// Columns of the rows, and the potentials of rows and columns that prove it.
type Answer = (Vec<usize>, Vec<f64>, Vec<f64>);

/// The best answer on the given arcs, or the rows among which too few columns are shared.
fn search(arcs: &[Vec<(u32, f64)>], columns: usize) -> Result<Answer, Vec<usize>> {
    const FREE: usize = usize::MAX;
    let rows = arcs.len();
    let mut row_of = vec![FREE; columns];
    let mut column_of = vec![FREE; rows];
    let mut column_potential = vec![0.0_f64; columns];
    let mut row_potential: Vec<f64> =
        arcs.iter().map(|arcs| arcs.iter().map(|a| a.1).fold(f64::INFINITY, f64::min)).collect();
    // Whoever's cheapest column is free takes it.
    for (row, arcs) in arcs.iter().enumerate() {
        let cheapest = arcs.iter().filter(|a| a.1 == row_potential[row]).map(|a| a.0 as usize).min();
        if let Some(column) = cheapest.filter(|&column| row_of[column] == FREE) {
            (row_of[column], column_of[row]) = (row, column);
        }
    }
    let mut distance = vec![f64::INFINITY; columns];
    let mut before = vec![FREE; columns];
    let mut settled = vec![false; columns];
    let mut seen: Vec<usize> = Vec::new();
    let mut done: Vec<usize> = Vec::new();
    let mut heap: BinaryHeap<Reverse<(Far, u32)>> = BinaryHeap::new();
    for start in 0..rows {
        if column_of[start] != FREE {
            continue;
        }
        heap.clear();
        done.clear();
        let (mut row, mut reached) = (start, 0.0_f64);
        let last = loop {
            for &(column, cost) in &arcs[row] {
                let c = column as usize;
                let through = reached + (cost - row_potential[row] - column_potential[c]).max(0.0);
                if !settled[c] && through < distance[c] {
                    if distance[c] == f64::INFINITY {
                        seen.push(c);
                    }
                    (distance[c], before[c]) = (through, row);
                    heap.push(Reverse((Far(through), column)));
                }
            }
            let next = loop {
                match heap.pop() {
                    Some(Reverse((Far(d), column))) if !settled[column as usize] && d <= distance[column as usize] => {
                        break Some(column as usize);
                    }
                    Some(_) => {}
                    None => break None,
                }
            };
            let Some(column) = next else {
                let mut stuck = vec![start];
                stuck.extend(done.iter().map(|&column| row_of[column]));
                return Err(stuck);
            };
            reached = distance[column];
            if row_of[column] == FREE {
                break column;
            }
            settled[column] = true;
            done.push(column);
            row = row_of[column];
        };
        row_potential[start] += reached;
        for &column in &done {
            let slack = reached - distance[column];
            column_potential[column] -= slack;
            row_potential[row_of[column]] += slack;
        }
        // Hand each column on the path to the row that reached it.
        let mut column = last;
        loop {
            let row = before[column];
            row_of[column] = row;
            let passed = std::mem::replace(&mut column_of[row], column);
            if row == start {
                break;
            }
            column = passed;
        }
        for &column in &seen {
            distance[column] = f64::INFINITY;
            settled[column] = false;
        }
        seen.clear();
    }
    Ok((column_of, row_potential, column_potential))
}

#[cfg(test)]
mod tests {
    use pathfinding::prelude::{Matrix, kuhn_munkres_min};

    use super::*;
    use crate::base::Seed;

    /// Whole costs, and bounds below them by a random part.
    fn problem(seed: u64, rows: usize, columns: usize, most: usize) -> (Vec<i64>, Vec<f32>) {
        let at = |i: usize| Seed::new(seed).at(i as u64);
        let costs: Vec<i64> = (0..rows * columns).map(|i| at(i).index(most) as i64).collect();
        let bounds = costs.iter().enumerate().map(|(i, c)| *c as f32 * at(i).child("bound").range(0.3, 1.0)).collect();
        (costs, bounds)
    }

    #[test]
    fn the_optimum_is_that_of_the_reference_on_many_sizes() {
        for (seed, rows, columns) in
            [(1, 1, 1), (2, 3, 3), (3, 20, 20), (4, 30, 90), (5, 90, 90), (6, 120, 121), (7, 7, 300)]
        {
            for most in [2, 40, 1_000_000] {
                let (costs, bounds) = problem(seed, rows, columns, most);
                let answer = assign_pruned(rows, columns, &bounds, &|r, c| costs[r * columns + c] as f64);
                let total: i64 = answer.iter().enumerate().map(|(r, c)| costs[r * columns + c]).sum();
                let (reference, _) = kuhn_munkres_min(&Matrix::from_vec(rows, columns, costs).unwrap());
                assert_eq!(total, reference, "{rows} x {columns}");
                let mut used = answer.clone();
                used.sort_unstable();
                used.dedup();
                assert_eq!(used.len(), rows);
            }
        }
    }

    #[test]
    fn rows_that_all_want_the_same_columns_get_others() {
        // Every row finds the first columns cheapest.
        let (rows, columns) = (60, 60);
        let cost = |_: usize, c: usize| c as f64;
        let bounds: Vec<f32> = (0..rows * columns).map(|i| (i % columns) as f32).collect();
        let mut used = assign_pruned(rows, columns, &bounds, &cost);
        used.sort_unstable();
        assert_eq!(used, (0..60).collect::<Vec<_>>());
    }

    #[test]
    fn few_costs_are_measured_where_bounds_are_near() {
        use std::sync::atomic::{AtomicUsize, Ordering};
        let at = |i: usize| (Seed::new(9).at(i as u64).direction(), Seed::new(10).at(i as u64).direction());
        let (rows, columns) = (300, 300);
        let cost = |r: usize, c: usize| f64::from(at(r).0.distance(at(c).1));
        let bounds: Vec<f32> = (0..rows * columns).map(|i| cost(i / columns, i % columns) as f32 * 0.97).collect();
        let measured = AtomicUsize::new(0);
        let counted = |r: usize, c: usize| {
            measured.fetch_add(1, Ordering::Relaxed);
            cost(r, c)
        };
        let answer = assign_pruned(rows, columns, &bounds, &counted);
        assert_eq!(answer.len(), rows);
        assert!(measured.into_inner() < rows * columns / 5);
    }
}
