//! The assignment problem on a few candidates a row, with proof that no other pair would do better.
//!
//! A dense search is cubic. Here each row starts with the [`FIRST`] columns of the least lower bound; the best answer on
//! these arcs is found, and its dual potentials price every other pair: where even the lower bound of a pair costs no
//! less than its row's and column's potentials together, no optimum needs it (linear programming duality); where it does
//! not, the exact cost decides, and the pair joins the candidates for another round. When no pair joins, the answer is an
//! optimum of the whole matrix. Crowns make good bounds: of 600 × 600 limbs about one pair in forty is ever measured, in
//! three or four rounds.
//!
//! On its arcs an answer is found by Jonker and Volgenant (1987): augmenting row reduction, where a row takes its
//! cheapest column and makes it dearer by what the second would have cost, then shortest augmenting paths for the rows
//! that are left. A round keeps the potentials and the pairs of the one before: only rows whose new arcs undercut their
//! potential lose their column and are led to another. Columns that no row has are held by one row in their number, whose
//! arcs cost nothing (the *rest*), so that this holds for more columns than rows, too. Starting over in every round, with
//! paths alone, took 10 times as long for 600 × 600.
//!
//! Time: `rows · columns` for the bounds and their pricing, which is a subtraction a pair, and `rows · candidates ·
//! log` for each path that is searched; quadratic in siblings, not cubic. Ties go to the lowest column.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rayon::prelude::*;

/// Candidates that a row starts with.
const FIRST: usize = 20;
/// How far a pair may undercut the potentials and still count as rounding.
const SLACK: f64 = 1e-9;
/// Bounds of fewer cells are priced on one thread.
const PARALLEL_CELLS: usize = 1 << 15;
/// Columns that a row is given more when it shares too few with others.
const MORE: usize = 10;
/// Most steps of row reduction, a row.
const REDUCTIONS: usize = 8;

/// Pairs that are priced at once.
const LANES: usize = 32;

/// A column that a row may take, and what it costs.
type Arc = (u32, f64);

/// The column of each row, for `rows <= columns`. `bounds` holds a lower bound of each cost, row after row; `exact`
/// gives the cost itself, finite.
pub(super) fn assign_pruned(
    rows: usize,
    columns: usize,
    bounds: &[f32],
    exact: &(dyn Fn(usize, usize) -> f64 + Sync),
) -> Vec<usize> {
    let line = |row: usize| &bounds[row * columns..(row + 1) * columns];
    let first = each(rows, columns, &|row| {
        let near = nearest(FIRST, line(row), &|_| false);
        near.into_iter().map(|column| (column, exact(row, column as usize))).collect()
    });
    let mut search = Search::new(first, columns);
    search.reduce();
    loop {
        let wanted: Vec<Vec<Arc>> = match search.match_all() {
            Ok(()) => {
                // Rounded up, so that no price comes out too high.
                let potentials: Vec<f32> = search.column_potential.iter().map(|p| *p as f32 + 1e-6).collect();
                each(rows, columns, &|row| search.undercut(row, line(row), &potentials, &|c| exact(row, c)))
            }
            // These rows share too few columns.
            Err(stuck) => {
                let mut wanted = vec![Vec::new(); rows];
                for row in stuck {
                    let arcs = &search.arcs[row];
                    let known = |column: u32| arcs.iter().any(|arc| arc.0 == column);
                    let near = nearest(MORE, line(row), &known);
                    wanted[row] = near.into_iter().map(|column| (column, exact(row, column as usize))).collect();
                }
                wanted
            }
        };
        if search.free_rows.is_empty() && wanted.iter().all(Vec::is_empty) {
            return search.column_of;
        }
        wanted.into_iter().enumerate().for_each(|(row, arcs)| search.widen(row, arcs));
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

/// The `count` columns of the least bounds that are not `known`, ties by column.
fn nearest(count: usize, bounds: &[f32], known: &dyn Fn(u32) -> bool) -> Vec<u32> {
    // Sorted; after the first few, a column that enters is rare, and asking a whole run of them takes no branches.
    let mut near: Vec<(f32, u32)> = Vec::with_capacity(count + 1);
    let mut worst = f32::INFINITY;
    for (run, bounds) in bounds.chunks(LANES).enumerate() {
        let is_full = near.len() == count;
        if is_full && !bounds.iter().fold(false, |any, bound| any | (*bound < worst)) {
            continue;
        }
        for (column, &bound) in (run * LANES..).zip(bounds) {
            if bound >= worst && near.len() == count || known(column as u32) {
                continue;
            }
            let place = near.partition_point(|kept| kept.0 <= bound);
            near.insert(place, (bound, column as u32));
            near.truncate(count);
            worst = near[near.len() - 1].0;
        }
    }
    near.into_iter().map(|kept| kept.1).collect()
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

/// No row, no column.
const FREE: usize = usize::MAX;
/// The row that holds all columns that no other has.
const REST: usize = usize::MAX - 1;

/// Pairs and potentials on some arcs. At all times no arc costs less than its row's and column's potentials together, and
/// the arc of every pair just as much; the same goes for the rest, whose arcs cost 0.
struct Search {
    arcs: Vec<Vec<Arc>>,
    /// The row of each column, [`REST`], or [`FREE`] for one that a row has lost.
    row_of: Vec<usize>,
    column_of: Vec<usize>,
    row_potential: Vec<f64>,
    column_potential: Vec<f64>,
    rest_potential: f64,
    /// Columns of the rest beyond those that are left over in the end.
    excess: usize,
    free_rows: Vec<usize>,
    /// Of the path that is searched: each column's distance, and the row before it.
    distance: Vec<f64>,
    before: Vec<usize>,
    settled: Vec<bool>,
    heap: BinaryHeap<Reverse<(Far, u32)>>,
    /// How far the nearest column is that may be taken, as far as is known: nothing beyond it is looked at.
    nearest: f64,
}

impl Search {
    fn new(arcs: Vec<Vec<Arc>>, columns: usize) -> Self {
        let rows = arcs.len();
        let least = |arcs: &Vec<Arc>| arcs.iter().map(|a| a.1).fold(f64::INFINITY, f64::min);
        Self {
            row_of: vec![REST; columns],
            column_of: vec![FREE; rows],
            row_potential: arcs.iter().map(least).collect(),
            column_potential: vec![0.0; columns],
            rest_potential: 0.0,
            excess: rows,
            free_rows: (0..rows).collect(),
            distance: vec![f64::INFINITY; columns],
            before: vec![FREE; columns],
            settled: vec![false; columns],
            heap: BinaryHeap::new(),
            nearest: f64::INFINITY,
            arcs,
        }
    }

    /// Augmenting row reduction: cheap pairs for most rows. A column that has a row once keeps having one.
    fn reduce(&mut self) {
        let mut work: Vec<usize> = self.free_rows.drain(..).rev().collect();
        let mut left = Vec::new();
        let mut steps = self.arcs.len() * REDUCTIONS;
        while let Some(row) = work.pop() {
            let (mut first, mut second, mut column) = (f64::INFINITY, f64::INFINITY, FREE);
            for &(c, cost) in &self.arcs[row] {
                let price = cost - self.column_potential[c as usize];
                if price < first || (price == first && (c as usize) < column) {
                    second = first;
                    (first, column) = (price, c as usize);
                } else if price < second {
                    second = price;
                }
            }
            let taken = column != FREE && self.row_of[column] != REST;
            if column == FREE || !second.is_finite() || steps == 0 || (taken && second <= first) {
                // Without a better price there is no one to outbid.
                self.row_potential[row] = first;
                left.push(row);
                continue;
            }
            steps -= 1;
            self.column_potential[column] -= second - first;
            self.row_potential[row] = second;
            let before = std::mem::replace(&mut self.row_of[column], row);
            self.column_of[row] = column;
            if before == REST {
                self.excess -= 1;
            } else {
                self.column_of[before] = FREE;
                work.push(before);
            }
        }
        left.sort_unstable();
        self.free_rows = left;
    }

    /// The pairs of a row that cost less than their potentials, by its lower bounds and the columns' potentials.
    fn undercut(&self, row: usize, bounds: &[f32], potentials: &[f32], exact: &dyn Fn(usize) -> f64) -> Vec<Arc> {
        let most = self.row_potential[row] - SLACK;
        let least = self.row_potential[row] as f32 + 1e-6;
        let mut found = Vec::new();
        for (run, (bounds, potentials)) in bounds.chunks(LANES).zip(potentials.chunks(LANES)).enumerate() {
            // Hardly any run holds a cheap pair, and asking all of it at once takes no branches.
            let any = bounds.iter().zip(potentials).fold(false, |any, (b, p)| any | (b - p < least));
            if !any {
                continue;
            }
            for (i, (b, p)) in bounds.iter().zip(potentials).enumerate() {
                let column = run * LANES + i;
                if b - p < least && self.arcs[row].iter().all(|arc| arc.0 as usize != column) {
                    let cost = exact(column);
                    if cost - self.column_potential[column] < most {
                        found.push((column as u32, cost));
                    }
                }
            }
        }
        found
    }

    /// Gives a row more arcs; a row that they undercut loses its column.
    fn widen(&mut self, row: usize, mut more: Vec<Arc>) {
        let price = |arc: &Arc| arc.1 - self.column_potential[arc.0 as usize];
        let least = more.iter().map(price).fold(f64::INFINITY, f64::min);
        self.arcs[row].append(&mut more);
        if least < self.row_potential[row] {
            self.row_potential[row] = least;
            let column = std::mem::replace(&mut self.column_of[row], FREE);
            if column != FREE {
                self.row_of[column] = FREE;
                self.free_rows.push(row);
            }
        }
    }

    /// A column for every row that has none, or the rows among which too few columns are shared.
    fn match_all(&mut self) -> Result<(), Vec<usize>> {
        while let Some(start) = self.free_rows.pop() {
            if let Err(stuck) = self.augment(start) {
                self.free_rows.push(start);
                return Err(stuck);
            }
        }
        Ok(())
    }

    /// Whether no row misses a column that another takes.
    fn is_open(&self, column: usize) -> bool {
        let holder = self.row_of[column];
        holder == FREE || (holder == REST && self.excess > 0)
    }

    /// One shortest augmenting path.
    fn augment(&mut self, start: usize) -> Result<(), Vec<usize>> {
        self.heap.clear();
        self.nearest = f64::INFINITY;
        let mut seen: Vec<usize> = Vec::new();
        let mut done: Vec<usize> = Vec::new();
        // The row to go on from; none after a further column of the rest, which leads nowhere new.
        let (mut from, mut reached) = (Some(start), 0.0_f64);
        // The column by which the rest was reached, and how far that is.
        let mut rest: Option<(usize, f64)> = None;
        let last = loop {
            match from {
                Some(REST) => {
                    for column in 0..self.row_of.len() {
                        let price = -self.rest_potential - self.column_potential[column];
                        self.relax(REST, column, reached + price.max(0.0), &mut seen);
                    }
                }
                Some(row) => {
                    for i in 0..self.arcs[row].len() {
                        let (column, cost) = self.arcs[row][i];
                        let price = cost - self.row_potential[row] - self.column_potential[column as usize];
                        self.relax(row, column as usize, reached + price.max(0.0), &mut seen);
                    }
                }
                None => {}
            }
            let column = loop {
                let Some(Reverse((Far(far), column))) = self.heap.pop() else { break FREE };
                if !self.settled[column as usize] && far <= self.distance[column as usize] {
                    break column as usize;
                }
            };
            if column == FREE {
                let mut stuck = vec![start];
                stuck.extend(done.iter().map(|&column| self.row_of[column]).filter(|&row| row != REST));
                self.forget(&seen);
                return Err(stuck);
            }
            reached = self.distance[column];
            let holder = self.row_of[column];
            if self.is_open(column) {
                break column;
            }
            self.settled[column] = true;
            done.push(column);
            from = if holder == REST && rest.is_some() { None } else { Some(holder) };
            if from == Some(REST) {
                rest = Some((column, reached));
            }
        };
        self.row_potential[start] += reached;
        if let Some((_, far)) = rest {
            self.rest_potential += reached - far;
        }
        for &column in &done {
            let slack = reached - self.distance[column];
            self.column_potential[column] -= slack;
            if self.row_of[column] != REST {
                self.row_potential[self.row_of[column]] += slack;
            }
        }
        if self.row_of[last] == REST {
            self.excess -= 1;
        }
        // Hand each column on the path to the row that reached it.
        let mut column = last;
        loop {
            let row = self.before[column];
            self.row_of[column] = row;
            if row == REST {
                let Some((entry, _)) = rest else { break };
                column = entry;
                continue;
            }
            let passed = std::mem::replace(&mut self.column_of[row], column);
            if row == start {
                break;
            }
            column = passed;
        }
        self.forget(&seen);
        Ok(())
    }

    /// A way to a column, if it is the shortest so far, and no longer than to the nearest column that may be taken.
    fn relax(&mut self, row: usize, column: usize, through: f64, seen: &mut Vec<usize>) {
        if through > self.nearest || through >= self.distance[column] || self.settled[column] {
            return;
        }
        if self.is_open(column) {
            self.nearest = through;
        }
        if self.distance[column] == f64::INFINITY {
            seen.push(column);
        }
        (self.distance[column], self.before[column]) = (through, row);
        self.heap.push(Reverse((Far(through), column as u32)));
    }

    /// Clears what a path left behind.
    fn forget(&mut self, seen: &[usize]) {
        for &column in seen {
            self.distance[column] = f64::INFINITY;
            self.settled[column] = false;
        }
    }
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
            [(1, 1, 1), (2, 3, 3), (3, 20, 20), (4, 30, 90), (5, 90, 90), (6, 120, 121), (7, 7, 300), (8, 150, 156)]
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
    fn paths_that_stop_at_the_nearest_column_are_the_shortest() {
        // Most rows want a few columns, so that most need a path, and of many lengths.
        for seed in 0..200 {
            let (rows, columns) = (24, 24 + seed as usize % 3);
            let at = |i: usize| Seed::new(seed).at(i as u64);
            let cost = |i: usize| 40 * (i % columns) as i64 + at(i).index(200) as i64;
            let costs: Vec<i64> = (0..rows * columns).map(cost).collect();
            let bounds: Vec<f32> = costs.iter().map(|cost| *cost as f32 * 0.9).collect();
            let answer = assign_pruned(rows, columns, &bounds, &|r, c| costs[r * columns + c] as f64);
            let total: i64 = answer.iter().enumerate().map(|(r, c)| costs[r * columns + c]).sum();
            let (reference, _) = kuhn_munkres_min(&Matrix::from_vec(rows, columns, costs).unwrap());
            assert_eq!(total, reference, "{seed}");
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
