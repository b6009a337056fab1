//! The filter of small branches (2018 TOG, section 4, "Post processing"): an in-between may have branches that are too
//! short for where they stand.
//!
//! Of each source and order a second-order polynomial β gives the length of a branch from its location on its parent
//! (least squares). A branch of a blend is too small below `max(0, min β - α |β1 - β2|)`; with more than two sources
//! the difference is that of the greatest and the least. A polynomial needs three branches at different places; of fewer
//! their mean length is taken. An order that a source lacks allows any length.
//!
//! Past the paper, whose trees have no leaves and some dozens of branches: a branch that bears some stays, as does one that bears a
//! branch that does. A short one with leaves is a leafy shoot, and without those that are still short a mean of two leafy trees was
//! bare; and between trees of unlike species half of the crown went with limbs that were a little short (586 branches of 3207).

use crate::plant::{ChainId, Curve, Plant};

/// Lengths of branches by location, order after order, of some sources.
#[derive(Clone, Debug)]
pub struct SmallBranches {
    /// For each order above the first, for each source that has it, c0 + c1 s + c2 s².
    fits: Vec<Vec<[f64; 3]>>,
    sources: usize,
    alpha: f64,
}

impl SmallBranches {
    /// Learns from the sources; `alpha` as in the paper, which has 0.5.
    #[must_use]
    pub fn of<'a>(sources: impl IntoIterator<Item = &'a Plant>, alpha: f32) -> Self {
        let mut fits: Vec<Vec<[f64; 3]>> = Vec::new();
        let mut count = 0;
        for plant in sources {
            count += 1;
            let mut orders: Vec<Vec<(f64, f64)>> = Vec::new();
            for id in plant.chain_ids() {
                let chain = plant.chain(id);
                let order = usize::from(chain.order);
                if chain.parent.is_some() {
                    orders.resize(orders.len().max(order + 1), Vec::new());
                    orders[order].push((f64::from(chain.location), length(plant, id)));
                }
            }
            fits.resize(fits.len().max(orders.len()), Vec::new());
            for (order, branches) in orders.iter().enumerate().filter(|(_, b)| !b.is_empty()) {
                fits[order].push(fit(branches));
            }
        }
        Self { fits, sources: count, alpha: f64::from(alpha) }
    }

    /// The shortest that a branch of an order may be at a location, metres.
    #[must_use]
    pub fn least(&self, order: u16, location: f32) -> f64 {
        let Some(fits) = self.fits.get(usize::from(order)).filter(|f| f.len() == self.sources) else { return 0.0 };
        let s = f64::from(location);
        let value = |c: &[f64; 3]| c[0] + (c[1] + c[2] * s) * s;
        let (low, high) =
            fits.iter().map(value).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        (low - self.alpha * (high - low)).max(0.0)
    }

    /// The branches of a blend that are too small and bear nothing that stays, no leaf and no branch; what they bear goes with them.
    #[must_use]
    pub fn in_plant(&self, plant: &Plant) -> Vec<ChainId> {
        let mut stays = vec![false; plant.chains().len()];
        plant.leaves().iter().for_each(|leaf| stays[leaf.chain.index()] = true);
        // What is borne comes after its bearer.
        for id in plant.chain_ids().rev() {
            let chain = plant.chain(id);
            stays[id.index()] |= length(plant, id) >= self.least(chain.order, chain.location);
            if let Some(parent) = chain.parent {
                stays[parent.index()] |= stays[id.index()];
            }
        }
        plant.chain_ids().filter(|id| plant.chain(*id).parent.is_some() && !stays[id.index()]).collect()
    }
}

fn length(plant: &Plant, id: ChainId) -> f64 {
    f64::from(Curve::new(plant.points(id)).length())
}

/// Least squares by the normal equations.
fn fit(branches: &[(f64, f64)]) -> [f64; 3] {
    let count = branches.len() as f64;
    let mean = branches.iter().map(|b| b.1).sum::<f64>() / count;
    let flat = [mean, 0.0, 0.0];
    let mut m = [[0.0_f64; 4]; 3];
    for &(s, l) in branches {
        let powers = [1.0, s, s * s];
        for i in 0..3 {
            for j in 0..3 {
                m[i][j] += powers[i] * powers[j];
            }
            m[i][3] += powers[i] * l;
        }
    }
    for i in 0..3 {
        // The matrix is positive definite but for places that coincide.
        if m[i][i] < 1e-6 * count {
            return flat;
        }
        for k in i + 1..3 {
            let by = m[k][i] / m[i][i];
            let row = m[i];
            m[k].iter_mut().zip(row).for_each(|(to, from)| *to -= by * from);
        }
    }
    let c2 = m[2][3] / m[2][2];
    let c1 = (m[1][3] - m[1][2] * c2) / m[1][1];
    [(m[0][3] - m[0][1] * c1 - m[0][2] * c2) / m[0][0], c1, c2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::PlantBuilder;
    use glam::Vec3;

    /// A trunk whose branches are as long as a function of their place says.
    fn comb(count: usize, long: impl Fn(f32) -> f32) -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.1; 2]);
        for i in 0..count {
            let s = i as f32 / count as f32;
            builder.branch(stem, s, &[Vec3::ZERO, Vec3::X * long(s)], &[0.01; 2]);
        }
        builder.finish().unwrap()
    }

    #[test]
    fn a_parabola_is_found_and_the_least_length_is_the_papers() {
        let (a, b) = (comb(12, |s| 2.0 - s * s), comb(9, |s| 1.0 + s));
        let small = SmallBranches::of([&a, &b], 0.5);
        for s in [0.0_f32, 0.3, 0.9] {
            let (one, two) = (2.0 - f64::from(s * s), 1.0 + f64::from(s));
            let wanted = (one.min(two) - 0.5 * (one - two).abs()).max(0.0);
            assert!((small.least(2, s) - wanted).abs() < 1e-4, "{s}: {} {wanted}", small.least(2, s));
        }
        assert_eq!(small.least(3, 0.5), 0.0);
        assert!(small.in_plant(&a).is_empty());
        let stubs = comb(6, |s| if s < 0.5 { 0.2 } else { 1.5 });
        assert_eq!(small.in_plant(&stubs), [ChainId(1), ChainId(2), ChainId(3)]);
        // One of them bears a branch that is as long as such are.
        let mut builder = PlantBuilder::from_plant(stubs.clone());
        builder.branch(ChainId(3), 0.5, &[Vec3::ZERO, Vec3::Y], &[0.01; 2]);
        assert_eq!(small.in_plant(&builder.finish().unwrap()), [ChainId(1), ChainId(2)]);
        let leaf = crate::plant::Leaf::new(ChainId(2), 0.5, crate::base::Rotation::IDENTITY, 0.1, 0);
        assert_eq!(small.in_plant(&stubs.with_leaves(vec![leaf])), [ChainId(1), ChainId(3)]);
    }
}
