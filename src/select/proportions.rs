//! A botanical filter, past the paper: does a blend still have the proportions of its sources' kind?
//!
//! The paper leaves trees that "violate self-similarity and biomass distribution" to a later filter (section 6). Here both
//! are measured in figures that don't know metres:
//!
//! - self-similarity: sub-branches resemble the whole when the ratios from order to order are alike. Mean logarithms of
//!   length and of base radius against the parent's, branches a chain, each by order, and how much the length ratio
//!   differs between orders. A branch counts by its length: the many sprouts that have only just begun to grow say
//!   little about a tree (counted one each, 62 of 72 sound trees between an oak and a shrub were rejected);
//! - biomass: heights below which a quarter, half and three quarters of the wood's volume lie, over the tree's height, and
//!   the shares of volume in orders 1, 2 and all finer ones.
//!
//! A tree *departs* from its sources by the most that any figure lies outside the range of the sources', in units of
//! the usual spread of that figure (the table [`MEASURES`]). A figure over fewer than [`FEWEST`] branches says nothing and
//! is left out, on both sides.

use crate::base::math;
use crate::plant::{Plant, Posed};

/// Fewest branches that make a mean.
const FEWEST: usize = 4;

/// Each figure's name and unit.
const MEASURES: [(&str, f32); 16] = [
    ("length of the limbs", 0.4),
    ("length of the branches of order 3", 0.4),
    ("length of the branches of order 4", 0.4),
    ("thickness of the limbs", 0.4),
    ("thickness of the branches of order 3", 0.4),
    ("thickness of the branches of order 4", 0.4),
    ("number of limbs", 0.5),
    ("branches on a limb", 0.5),
    ("twigs on a branch", 0.5),
    ("likeness of the orders", 0.4),
    ("height of the lower wood", 0.15),
    ("height of the wood", 0.15),
    ("height of the upper wood", 0.15),
    ("share of wood in the stem", 0.15),
    ("share of wood in the limbs", 0.15),
    ("share of wood in finer branches", 0.15),
];

/// Bins of the vertical profile.
const BINS: usize = 32;

/// Ratios by order and where the wood is.
#[derive(Clone, Debug, PartialEq)]
pub struct Proportions {
    /// In the order of [`MEASURES`]; none for what can't be told.
    values: [Option<f32>; MEASURES.len()],
}

/// How far a tree is from its sources' kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Departure {
    /// In units of the usual spread; 0 within the sources' range.
    pub by: f32,
    /// The figure that is farthest off; empty within the range.
    pub what: &'static str,
}

/// Sums over the branches of one order.
#[derive(Clone, Copy, Default)]
struct Order {
    chains: usize,
    ratios: usize,
    /// Summed lengths: what the ratios weigh.
    weight: f32,
    length: f32,
    radius: f32,
    volume: f32,
}

impl Proportions {
    /// Measures a plant; linear in its points.
    #[must_use]
    pub fn of(plant: &Plant, posed: &Posed) -> Self {
        Self::of_kept(plant, posed, &[])
    }

    /// As [`of`](Self::of), without the chains that are marked as gone.
    pub(super) fn of_kept(plant: &Plant, posed: &Posed, gone: &[bool]) -> Self {
        let here = |i: usize| !gone.get(i).copied().unwrap_or(false);
        let top = posed.positions().iter().fold(f32::MIN_POSITIVE, |t, p| t.max(p.y));
        let scale = BINS as f32 / top;
        let mut bins = [0.0_f32; BINS];
        let mut orders = [Order::default(); 5];
        let mut lengths = vec![0.0_f32; plant.chains().len()];
        for id in plant.chain_ids().filter(|id| here(id.index())) {
            let chain = plant.chain(id);
            let (points, radii) = (posed.chain(plant, id), plant.radii(id));
            let order = &mut orders[usize::from(chain.order).clamp(1, 5) - 1];
            let mut length = 0.0;
            for (p, r) in points.windows(2).zip(radii.windows(2)) {
                let step = p[0].distance(p[1]);
                let volume = step * (r[0] * r[0] + r[0] * r[1] + r[1] * r[1]);
                length += step;
                order.volume += volume;
                // A cast clamps what lies below the ground.
                bins[(((p[0].y + p[1].y) * 0.5 * scale) as usize).min(BINS - 1)] += volume;
            }
            lengths[id.index()] = length;
            order.chains += 1;
            let Some(parent) = chain.parent else { continue };
            let (bearer, thick) = (lengths[parent.index()], plant.radii(parent)[0]);
            if length > 0.0 && bearer > 0.0 && radii[0] > 0.0 && thick > 0.0 {
                order.ratios += 1;
                order.weight += length;
                order.length += length * math::ln(length / bearer);
                order.radius += length * math::ln(radii[0] / thick);
            }
        }
        let mean =
            |o: usize, sum: fn(&Order) -> f32| (orders[o].ratios >= FEWEST).then(|| sum(&orders[o]) / orders[o].weight);
        let each = |o: usize| {
            (orders[o].chains > 0 && orders[o + 1].chains >= FEWEST)
                .then(|| math::ln(1.0 + orders[o + 1].chains as f32 / orders[o].chains as f32))
        };
        let ratios = [mean(1, |o| o.length), mean(2, |o| o.length), mean(3, |o| o.length)];
        let known: Vec<f32> = ratios.iter().flatten().copied().collect();
        let least = known.iter().copied().fold(f32::INFINITY, f32::min);
        let most = known.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let volume: f32 = bins.iter().sum();
        let below = |share: f32| {
            let wanted = volume * share;
            let mut sum = 0.0;
            for (i, bin) in bins.iter().enumerate() {
                if sum + bin >= wanted && *bin > 0.0 {
                    return Some((i as f32 + (wanted - sum) / bin) / BINS as f32);
                }
                sum += bin;
            }
            None
        };
        let part = |from: usize| {
            let own: f32 = if from < 2 { orders[from].volume } else { orders[2..].iter().map(|o| o.volume).sum() };
            (volume > 0.0).then(|| own / volume)
        };
        Self {
            values: [
                ratios[0],
                ratios[1],
                ratios[2],
                mean(1, |o| o.radius),
                mean(2, |o| o.radius),
                mean(3, |o| o.radius),
                each(0),
                each(1),
                each(2),
                (known.len() > 1).then_some(most - least),
                below(0.25),
                below(0.5),
                below(0.75),
                part(0),
                part(1),
                part(2),
            ],
        }
    }

    /// How far these are outside the range of some sources'.
    #[must_use]
    pub fn departure(&self, sources: &[&Self]) -> Departure {
        let mut most = Departure { by: 0.0, what: "" };
        for (i, (what, unit)) in MEASURES.iter().enumerate() {
            let Some(value) = self.values[i] else { continue };
            let range = sources.iter().filter_map(|s| s.values[i]);
            let (low, high) = range.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
            let by = (low - value).max(value - high) / unit;
            if low <= high && by > most.by {
                most = Departure { by, what };
            }
        }
        most
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::plant::PlantBuilder;

    /// A stem of 8 m with limbs of this length at these locations.
    fn tree(length: f32, at: &[f32]) -> Proportions {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0, Vec3::Y * 8.0], &[0.2, 0.15, 0.1]);
        for &location in at {
            builder.branch(stem, location, &[Vec3::ZERO, Vec3::X * length], &[0.1, 0.05]);
        }
        let plant = builder.finish().unwrap();
        Proportions::of(&plant, &plant.pose())
    }

    const HIGH: [f32; 5] = [0.6, 0.7, 0.75, 0.8, 0.9];

    #[test]
    fn a_tree_between_its_sources_departs_by_nothing() {
        let (a, b) = (tree(1.0, &HIGH), tree(3.0, &HIGH));
        assert_eq!(a.departure(&[&a]).by, 0.0);
        assert_eq!(tree(2.0, &HIGH).departure(&[&a, &b]).by, 0.0);
    }

    #[test]
    fn limbs_too_long_too_many_or_too_low_are_named() {
        let (a, b) = (tree(1.0, &HIGH), tree(1.5, &HIGH));
        let of = |t: Proportions| t.departure(&[&a, &b]);
        let long = of(tree(6.0, &HIGH));
        assert!(long.what == "length of the limbs" && (long.by - math::ln(4.0) / 0.4).abs() < 1e-3, "{long:?}");
        let many: Vec<f32> = (0..40).map(|i| 0.6 + i as f32 * 0.0075).collect();
        assert_eq!(of(tree(1.2, &many)).what, "number of limbs");
        let low = tree(1.2, &[0.05, 0.06, 0.07, 0.08, 0.09]).departure(&[&a, &b]);
        assert!(low.what.starts_with("height of"), "{low:?}");
    }

    #[test]
    fn too_few_branches_say_nothing() {
        let one = tree(7.0, &[0.5]);
        assert_eq!((one.values[0], one.values[6]), (None, None));
        assert!(tree(1.0, &HIGH).values[9].is_none());
    }
}
