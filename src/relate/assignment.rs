//! The assignment problem: each row gets a column of its own so that the costs add up to the least (2017 TVCG, Eq. 1,
//! "Kuhn-Munkres").
//!
//! Shortest augmenting paths with dual potentials (Jonker and Volgenant 1987, without its initialization): one
//! Dijkstra-like search a row, `O(rows² · columns)` at worst, for `rows <= columns`; a taller matrix is solved on its
//! side. Ties go to the lowest column, so equal costs give equal answers everywhere.

/// What stands in for a cost that is not finite: dearer than any sum of sensible costs, and small enough that sums of
/// it stay exact in their order.
const FORBIDDEN: f64 = 1e12;

/// Solves a `rows × columns` matrix given row after row. For each row its column, or none where there are more rows
/// than columns; every row (or every column, whichever are fewer) is assigned. A cost that is not finite counts as
/// 1e12; cells that `costs` is too short for count as that, too.
#[must_use]
pub fn assign(costs: &[f64], rows: usize, columns: usize) -> Vec<Option<usize>> {
    let cell = |row: usize, column: usize| match costs.get(row * columns + column) {
        Some(cost) if cost.is_finite() => cost.clamp(-FORBIDDEN, FORBIDDEN),
        _ => FORBIDDEN,
    };
    if rows <= columns {
        let clean: Vec<f64> = (0..rows * columns).map(|i| cell(i / columns, i % columns)).collect();
        return augment(&clean, rows, columns).into_iter().map(Some).collect();
    }
    let turned: Vec<f64> = (0..rows * columns).map(|i| cell(i % rows, i / rows)).collect();
    let mut answer = vec![None; rows];
    for (column, row) in augment(&turned, columns, rows).into_iter().enumerate() {
        answer[row] = Some(column);
    }
    answer
}

/// The column of each row, for `rows <= columns` and finite costs.
fn augment(costs: &[f64], rows: usize, columns: usize) -> Vec<usize> {
    const FREE: usize = usize::MAX;
    let mut row_of = vec![FREE; columns];
    let mut column_potential = vec![0.0_f64; columns];
    let mut row_potential = vec![0.0_f64; rows];
    let mut distance = vec![0.0_f64; columns];
    let mut before = vec![FREE; columns];
    let mut todo: Vec<usize> = Vec::with_capacity(columns);
    let mut done: Vec<usize> = Vec::with_capacity(columns);
    for start in 0..rows {
        distance.fill(f64::INFINITY);
        todo.clear();
        todo.extend(0..columns);
        done.clear();
        let (mut row, mut from, mut reached) = (start, FREE, 0.0_f64);
        let last = loop {
            // Relax all columns from `row`, and find the nearest one that is not settled.
            let line = &costs[row * columns..(row + 1) * columns];
            let base = reached - row_potential[row];
            let (mut nearest, mut place) = (f64::INFINITY, 0);
            for (i, &column) in todo.iter().enumerate() {
                let through = base + line[column] - column_potential[column];
                if through < distance[column] {
                    distance[column] = through;
                    before[column] = from;
                }
                let d = distance[column];
                if d < nearest || (d == nearest && column < todo[place]) {
                    (nearest, place) = (d, i);
                }
            }
            let column = todo.swap_remove(place);
            reached = nearest;
            if row_of[column] == FREE {
                break column;
            }
            done.push(column);
            (row, from) = (row_of[column], column);
        };
        row_potential[start] += reached;
        for &column in &done {
            let slack = reached - distance[column];
            column_potential[column] -= slack;
            row_potential[row_of[column]] += slack;
        }
        // Hand each column on the path to the row that reached it.
        let mut column = last;
        while before[column] != FREE {
            row_of[column] = row_of[before[column]];
            column = before[column];
        }
        row_of[column] = start;
    }
    let mut answer = vec![0; rows];
    for (column, &row) in row_of.iter().enumerate() {
        if row != FREE {
            answer[row] = column;
        }
    }
    answer
}

#[cfg(test)]
mod tests {
    use pathfinding::prelude::{Matrix, kuhn_munkres_min};

    use super::*;
    use crate::base::Seed;

    fn matrix(seed: u64, rows: usize, columns: usize) -> Vec<f64> {
        // Whole numbers, many of them equal: exact sums and many ties.
        (0..rows * columns).map(|i| Seed::new(seed).at(i as u64).index(40) as f64).collect()
    }

    fn total(costs: &[f64], columns: usize, answer: &[Option<usize>]) -> f64 {
        answer.iter().enumerate().filter_map(|(r, c)| c.map(|c| costs[r * columns + c])).sum()
    }

    fn brute(costs: &[f64], columns: usize, row: usize, rows: usize, used: u32) -> f64 {
        if row == rows {
            return 0.0;
        }
        (0..columns)
            .filter(|c| used & (1 << c) == 0)
            .map(|c| costs[row * columns + c] + brute(costs, columns, row + 1, rows, used | 1 << c))
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn small_problems_cost_what_trying_all_finds() {
        for seed in 0..200 {
            let rows = 1 + Seed::new(seed).child("r").index(4);
            let columns = rows + Seed::new(seed).child("c").index(3);
            let costs = matrix(seed, rows, columns);
            let answer = assign(&costs, rows, columns);
            assert_eq!(total(&costs, columns, &answer), brute(&costs, columns, 0, rows, 0));
        }
    }

    #[test]
    fn larger_problems_cost_what_pathfinding_finds_and_use_a_column_once() {
        for (seed, rows, columns) in [(1, 20, 20), (2, 30, 60), (3, 60, 61), (4, 1, 50)] {
            let costs = matrix(seed, rows, columns);
            let answer = assign(&costs, rows, columns);
            let whole: Vec<i64> = costs.iter().map(|c| *c as i64).collect();
            let (reference, _) = kuhn_munkres_min(&Matrix::from_vec(rows, columns, whole).unwrap());
            assert_eq!(total(&costs, columns, &answer) as i64, reference);
            let mut columns: Vec<usize> = answer.iter().map(|c| c.unwrap()).collect();
            columns.sort_unstable();
            columns.dedup();
            assert_eq!(columns.len(), rows);
        }
    }

    #[test]
    fn a_tall_matrix_assigns_every_column() {
        let costs = matrix(5, 9, 4);
        let answer = assign(&costs, 9, 4);
        let turned: Vec<f64> = (0..36).map(|i| costs[(i % 9) * 4 + i / 9]).collect();
        assert_eq!(answer.iter().flatten().count(), 4);
        assert_eq!(total(&costs, 4, &answer), brute(&turned, 9, 0, 4, 0));
    }

    #[test]
    fn bad_costs_are_avoided_and_never_hang() {
        let bad = [f64::NAN, 1.0, f64::INFINITY, 1.0, 2.0, f64::NEG_INFINITY];
        assert_eq!(assign(&bad, 2, 3), [Some(1), Some(0)]);
        assert_eq!(assign(&[], 2, 2).len(), 2);
        assert!(assign(&[], 0, 5).is_empty());
        assert_eq!(assign(&[], 2, 0), [None, None]);
    }
}
