//! Sparse Cholesky factors of symmetric positive definite matrices, the same bits everywhere.
//!
//! faer orders the unknowns (approximate minimum degree, whole numbers only). The numbers are factored here, by the
//! up-looking LDLᵀ of Davis (LDL, ACM TOMS 2005): faer's own kernels add in an order that the processor's vector width
//! decides, so that two machines would find skeletons a bit apart. Meshes of trees are tubes, whose factors are as thin
//! as a ring: plain loops do 20,000 unknowns in some hundredths of a second, see the figure `import.seconds_100k`.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

/// No parent in the elimination tree.
const NONE: u32 = u32::MAX;

/// The pattern of a matrix, ordered, and of its factor.
#[derive(Debug)]
pub(super) struct Symbolic {
    /// New index of each unknown.
    place: Vec<u32>,
    /// Of the upper triangle of the ordered matrix: where each column begins, and its rows, rising.
    first: Vec<usize>,
    rows: Vec<u32>,
    /// Elimination tree.
    parent: Vec<u32>,
    /// Where each column of the factor begins.
    factor: Vec<usize>,
    /// Multiplications of one factoring.
    pub(super) work: f64,
}

impl Symbolic {
    /// Analyses the pattern given as each row's columns, rising, with the diagonal; it must be symmetric. None when faer
    /// can't order it (a matter of memory).
    pub(super) fn new(pattern: &[Vec<u32>]) -> Option<Self> {
        let n = pattern.len();
        let place = order(pattern)?;
        let mut old = vec![0_u32; n];
        for (i, &p) in place.iter().enumerate() {
            old[p as usize] = i as u32;
        }
        let mut first = Vec::with_capacity(n + 1);
        first.push(0);
        let mut rows = Vec::new();
        for k in 0..n {
            let from = rows.len();
            let above = pattern[old[k] as usize].iter().map(|&j| place[j as usize]).filter(|&r| r as usize <= k);
            rows.extend(above);
            rows[from..].sort_unstable();
            first.push(rows.len());
        }
        let mut parent = vec![NONE; n];
        let mut counts = vec![0_usize; n];
        let mut flag = vec![NONE; n];
        for k in 0..n {
            flag[k] = k as u32;
            for &row in &rows[first[k]..first[k + 1]] {
                let mut i = row as usize;
                while flag[i] != k as u32 {
                    if parent[i] == NONE {
                        parent[i] = k as u32;
                    }
                    counts[i] += 1;
                    flag[i] = k as u32;
                    i = parent[i] as usize;
                }
            }
        }
        let mut factor = Vec::with_capacity(n + 1);
        factor.push(0);
        let mut work = 0.0;
        for count in counts {
            factor.push(factor[factor.len() - 1] + count);
            work += (count * (count + 1)) as f64 * 0.5;
        }
        Some(Self { place, first, rows, parent, factor, work })
    }

    /// How many numbers the matrix has: the upper triangle with the diagonal.
    pub(super) fn entries(&self) -> usize {
        self.rows.len()
    }

    /// How many numbers the factor has.
    pub(super) fn fill(&self) -> usize {
        self.factor[self.factor.len() - 1]
    }

    /// Where the number of row `i` and column `j` lies, either way round; it must be in the pattern.
    pub(super) fn slot(&self, i: u32, j: u32) -> usize {
        let (a, b) = (self.place[i as usize], self.place[j as usize]);
        let (row, column) = (a.min(b), a.max(b) as usize);
        let run = &self.rows[self.first[column]..self.first[column + 1]];
        self.first[column] + run.partition_point(|&r| r < row)
    }

    /// Solves for three right-hand sides at once, in place.
    pub(super) fn solve(&self, values: &[f64], sides: &mut [[f64; 3]], scratch: &mut Factor) {
        let n = self.place.len();
        scratch.reset(n, self.fill());
        let Factor { rows, numbers, filled, diagonal, column, pattern, flag, ordered } = scratch;
        for k in 0..n {
            let mut top = n;
            flag[k] = k as u32;
            for (&row, &value) in self.rows[self.first[k]..self.first[k + 1]].iter().zip(&values[self.first[k]..]) {
                column[row as usize] += value;
                let mut i = row as usize;
                let mut length = 0;
                while flag[i] != k as u32 {
                    pattern[length] = i as u32;
                    length += 1;
                    flag[i] = k as u32;
                    i = self.parent[i] as usize;
                }
                while length > 0 {
                    length -= 1;
                    top -= 1;
                    pattern[top] = pattern[length];
                }
            }
            let mut d = column[k];
            column[k] = 0.0;
            for &i in &pattern[top..] {
                let i = i as usize;
                let y = column[i];
                column[i] = 0.0;
                let (from, to) = (self.factor[i], self.factor[i] + filled[i]);
                for (&r, &l) in rows[from..to].iter().zip(&numbers[from..to]) {
                    column[r as usize] -= l * y;
                }
                let l = y / diagonal[i];
                d -= l * y;
                rows[to] = k as u32;
                numbers[to] = l;
                filled[i] += 1;
            }
            // Positive in exact arithmetic; rounding must not turn it.
            diagonal[k] = if d > 1e-300 { d } else { 1e-300 };
        }
        for (i, side) in sides.iter().enumerate() {
            ordered[self.place[i] as usize] = *side;
        }
        for k in 0..n {
            let x = ordered[k];
            for p in self.factor[k]..self.factor[k + 1] {
                let (r, l) = (rows[p] as usize, numbers[p]);
                for c in 0..3 {
                    ordered[r][c] -= l * x[c];
                }
            }
        }
        for k in (0..n).rev() {
            let mut x = ordered[k].map(|x| x / diagonal[k]);
            for p in self.factor[k]..self.factor[k + 1] {
                let (r, l) = (rows[p] as usize, numbers[p]);
                for c in 0..3 {
                    x[c] -= l * ordered[r][c];
                }
            }
            ordered[k] = x;
        }
        for (i, side) in sides.iter_mut().enumerate() {
            *side = ordered[self.place[i] as usize];
        }
    }
}

/// Room for a factor, used again from one factoring to the next.
#[derive(Debug, Default)]
pub(super) struct Factor {
    rows: Vec<u32>,
    numbers: Vec<f64>,
    filled: Vec<usize>,
    diagonal: Vec<f64>,
    column: Vec<f64>,
    pattern: Vec<u32>,
    flag: Vec<u32>,
    ordered: Vec<[f64; 3]>,
}

impl Factor {
    fn reset(&mut self, n: usize, fill: usize) {
        self.rows.resize(fill, 0);
        self.numbers.resize(fill, 0.0);
        self.filled.clear();
        self.filled.resize(n, 0);
        self.diagonal.resize(n, 0.0);
        self.column.clear();
        self.column.resize(n, 0.0);
        self.pattern.resize(n, 0);
        self.flag.clear();
        self.flag.resize(n, NONE);
        self.ordered.resize(n, [0.0; 3]);
    }
}

/// The new index of each unknown, by approximate minimum degree.
fn order(pattern: &[Vec<u32>]) -> Option<Vec<u32>> {
    let n = pattern.len();
    let mut starts: Vec<u32> = Vec::with_capacity(n + 1);
    starts.push(0);
    let mut rows: Vec<u32> = Vec::new();
    for row in pattern {
        rows.extend_from_slice(row);
        starts.push(u32::try_from(rows.len()).ok()?);
    }
    let matrix = SymbolicSparseColMatRef::<'_, u32>::new_checked(n, n, &starts, None, &rows);
    let (mut new_to_old, mut old_to_new) = (vec![0_u32; n], vec![0_u32; n]);
    let mut memory = MemBuffer::try_new(amd::order_scratch::<u32>(n, rows.len())).ok()?;
    let stack = MemStack::new(&mut memory);
    amd::order(&mut new_to_old, &mut old_to_new, matrix, amd::Control::default(), stack).ok()?;
    Some(old_to_new)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn solutions_satisfy_their_equations() {
        let n = 200_usize;
        let seed = Seed::new(11);
        let mut dense = vec![vec![0.0_f64; n]; n];
        for k in 0..600 {
            let (i, j) = (seed.at(k).at(0).index(n), seed.at(k).at(1).index(n));
            let value = f64::from(seed.at(k).at(2).range(-1.0, 1.0));
            dense[i][j] += value;
            dense[j][i] = dense[i][j];
        }
        for (i, row) in dense.iter_mut().enumerate() {
            row[i] = row.iter().map(|v| v.abs()).sum::<f64>() + 0.5;
        }
        let columns = |i: usize| (0..n as u32).filter(|&j| dense[i][j as usize] != 0.0).collect::<Vec<_>>();
        let symbolic = Symbolic::new(&(0..n).map(columns).collect::<Vec<_>>()).unwrap();
        let mut values = vec![0.0; symbolic.entries()];
        for i in 0..n {
            for j in columns(i) {
                values[symbolic.slot(i as u32, j)] = dense[i][j as usize];
            }
        }
        let right: Vec<[f64; 3]> = (0..n).map(|i| seed.at(9000 + i as u64).direction().as_dvec3().to_array()).collect();
        let mut solved = right.clone();
        let mut scratch = Factor::default();
        symbolic.solve(&values, &mut solved, &mut scratch);
        let mut again = right.clone();
        symbolic.solve(&values, &mut again, &mut scratch);
        assert_eq!(solved, again);
        for i in 0..n {
            for c in 0..3 {
                let product: f64 = (0..n).map(|j| dense[i][j] * solved[j][c]).sum();
                assert!((product - right[i][c]).abs() < 1e-10);
            }
        }
    }
}
