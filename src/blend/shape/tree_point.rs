//! A plant as a point of tree-shape space (2018 TOG, sections 3 end and 4.1).
//!
//! A plant's graph has a node at every bifurcation and end; an edge is the stretch of a chain between two of them, by 5
//! landmarks with position and thickness: a point of R²⁰. The paper writes all plants into one maximal binary tree;
//! here an edge is known by what branches off before it. Along a chain these sets grow, so a chain's part of the topology is the
//! sequence of its branches: [`Axis::groups`], with edges between. Branches of one group leave at one place: the edge between
//! them is collapsed. That is the paper's space, without its 2^depth places (`binary.rs` shows the tree).
//!
//! An edge's landmarks are relative to its start in the frame of the chain's parent, so what a branch bears does not count
//! again when the branch turns. A branch that a plant lacks is an axis whose edges are zero, all its branches in
//! one group. Memory is linear in kins.

use glam::{DVec3, Vec3};

use crate::plant::{ChainId, Curve, Plant, PlantBuilder, PlantError};
use crate::relate::{Family, KinId};

/// Landmarks of an edge.
pub const LANDMARKS: usize = 5;
/// Position and thickness of each landmark: x, y, z, r, metres.
pub type Edge = [f64; 4 * LANDMARKS];

/// The edge of no attributes.
pub(super) const COLLAPSED: Edge = [0.0; 4 * LANDMARKS];
/// Shorter edges are collapsed, metres.
const SHORTEST: f64 = 1e-9;

/// A chain's part of a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Whether the chain is there.
    pub there: bool,
    /// Where a stem stands; zero for others.
    pub origin: DVec3,
    /// Kins that branch off, from base to tip; those of one group at one place.
    pub groups: Vec<Vec<u32>>,
    /// One more than groups: from the base to the first, between them, from the last to the tip.
    pub edges: Vec<Edge>,
}

/// A plant as a point of the space that a family spans.
#[derive(Clone, Debug, PartialEq)]
pub struct TreePoint {
    /// One for each kin.
    pub axes: Vec<Axis>,
    /// The kin that each grows on.
    pub(super) parents: Vec<Option<u32>>,
}

impl TreePoint {
    /// A source of a family. Where the family says nothing of a place that the source lacks, branches stand where the other sources
    /// have them on average.
    #[must_use]
    pub fn of(family: &Family, source: usize) -> Self {
        let plant = &family.sources()[source];
        let axis = |kin: KinId| {
            let children: Vec<KinId> = family.children(kin).collect();
            let Some(chain) = family.member(kin, source) else {
                let all: Vec<u32> = children.iter().map(|c| c.0).collect();
                let groups: Vec<Vec<u32>> = if all.is_empty() { Vec::new() } else { vec![all] };
                let edges = vec![COLLAPSED; groups.len() + 1];
                return Axis { there: false, origin: DVec3::ZERO, groups, edges };
            };
            let mut places: Vec<(f32, u32)> = children.iter().map(|&c| (place(family, c, source), c.0)).collect();
            places.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let curve = Curve::new(plant.points(chain));
            let length = f64::from(curve.length());
            let (mut groups, mut edges): (Vec<Vec<u32>>, Vec<Edge>) = (Vec::new(), Vec::new());
            let mut from = 0.0_f64;
            for (at, child) in places {
                let at = f64::from(at);
                if let Some(group) = groups.last_mut()
                    && (at - from) * length < SHORTEST
                {
                    group.push(child);
                    continue;
                }
                edges.push(edge(&curve, plant.radii(chain), from, at));
                groups.push(vec![child]);
                from = at;
            }
            edges.push(edge(&curve, plant.radii(chain), from, 1.0));
            Axis { there: true, origin: plant.chain(chain).origin.as_dvec3(), groups, edges }
        };
        let parents = family.kin_ids().map(|k| family.parent(k).map(|p| p.0)).collect();
        Self { axes: family.kin_ids().map(axis).collect(), parents }
    }

    /// How many edges are not collapsed: the dimension of the orthant that it lies in, over that of an edge.
    #[must_use]
    pub fn edges(&self) -> usize {
        self.axes.iter().flat_map(|axis| &axis.edges).filter(|e| **e != COLLAPSED).count()
    }

    /// The plant that the point stands for, without leaves: chains through the landmarks, branches at the ends of
    /// edges. What is shorter than a billionth of a metre is left out with all that it bears.
    ///
    /// # Errors
    ///
    /// When nothing is left, or no plant: see [`PlantError`].
    pub fn plant(&self) -> Result<Plant, PlantError> {
        let mut builder = PlantBuilder::new();
        // Each kin's chain, and where its branches leave it.
        let mut chains: Vec<Option<ChainId>> = vec![None; self.axes.len()];
        let mut places: Vec<f32> = vec![0.0; self.axes.len()];
        for (k, axis) in self.axes.iter().enumerate() {
            let parent = self.parents[k].map(|p| chains[p as usize]);
            if parent == Some(None) || !axis.there {
                continue;
            }
            let (mut points, mut radii) = (vec![Vec3::ZERO], Vec::new());
            let (mut at, mut length) = (DVec3::ZERO, 0.0_f64);
            let mut ends: Vec<f64> = Vec::new();
            for edge in &axis.edges {
                let mut before = DVec3::ZERO;
                if *edge != COLLAPSED {
                    for mark in edge.chunks_exact(4) {
                        let here = DVec3::new(mark[0], mark[1], mark[2]);
                        length += here.distance(before);
                        before = here;
                        points.push((at + here).as_vec3());
                        radii.push(mark[3].max(0.0) as f32);
                    }
                }
                at += before;
                ends.push(length);
            }
            if length < SHORTEST {
                continue;
            }
            radii.insert(0, radii.first().copied().unwrap_or(0.0));
            let total = f64::from(Curve::new(&points).length()).max(f64::MIN_POSITIVE);
            for (group, end) in axis.groups.iter().zip(&ends) {
                group.iter().for_each(|&c| places[c as usize] = (end / total).clamp(0.0, 1.0) as f32);
            }
            chains[k] = Some(match parent.flatten() {
                None => builder.stem(axis.origin.as_vec3(), &points, &radii),
                Some(on) => builder.branch(on, places[k], &points, &radii),
            });
        }
        builder.finish()
    }
}

/// Where a kin stands on a source's chain.
fn place(family: &Family, kin: KinId, source: usize) -> f32 {
    if let Some(place) = family.place_on(kin, source) {
        return place;
    }
    let own = |s: usize| family.member(kin, s).map(|chain| family.sources()[s].chain(chain).location);
    if let Some(place) = own(source) {
        return place;
    }
    let others: Vec<f32> = (0..family.sources().len()).filter_map(own).collect();
    others.iter().sum::<f32>() / others.len().max(1) as f32
}

/// The stretch of a chain between two parameters.
fn edge(curve: &Curve<'_>, radii: &[f32], from: f64, to: f64) -> Edge {
    let mut edge = COLLAPSED;
    if (to - from) * f64::from(curve.length()) < SHORTEST {
        return edge;
    }
    let start = curve.point(from).as_dvec3();
    for (i, mark) in edge.chunks_exact_mut(4).enumerate() {
        let at = from + (to - from) * (i + 1) as f64 / LANDMARKS as f64;
        let here = curve.point(at).as_dvec3() - start;
        mark.copy_from_slice(&[here.x, here.y, here.z, f64::from(curve.value(radii, at))]);
    }
    edge
}
