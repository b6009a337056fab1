//! Invariants of meshes over a thousand random plants.

use glam::Vec3;
use treewright::bake::{card_cut, leaf_maps};
use treewright::base::{Rotation, Seed};
use treewright::mesh::{
    CardShape, Cards, TubeDetail, add_tangents, all_cards, closure, fork_gaps, leaf_cards, problems, tubes,
};
use treewright::plant::{ChainId, Leaf, Plant, PlantBuilder};
use treewright::preset::plan::{Forks, LeafShape, MeshParams};

use crate::Figure;

/// How many plants.
const PLANTS: u64 = 1000;
/// The shapes of their cards; pictures of three of the four slots have outlines.
const SHAPES: [CardShape; 5] =
    [CardShape::Flat, CardShape::Folded, CardShape::Bent, CardShape::CutOut, CardShape::Trimmed];

/// A random plant of crooked chains of any thickness, with leaves.
fn plant(seed: Seed) -> Plant {
    let mut builder = PlantBuilder::new();
    let chains = 2 + seed.child("chains").index(14) as u64;
    for i in 0..chains {
        let s = seed.at(i);
        let count = 2 + s.child("count").index(9);
        let mut points = vec![Vec3::ZERO];
        for k in 1..count as u64 {
            let step = (s.at(k).direction() * 0.6 + Vec3::Y) * s.at(k).child("step").range(0.05, 0.7);
            points.push(points[points.len() - 1] + step);
        }
        let base = if i == 0 { 0.3 } else { s.child("radius").range(0.001, 0.15) };
        let radii: Vec<f32> = (0..count).map(|k| base * (1.0 - k as f32 / count as f32)).collect();
        if i == 0 {
            builder.stem(Vec3::ZERO, &points, &radii);
        } else {
            let parent = ChainId(s.child("parent").index(i as usize) as u32);
            builder.branch(parent, s.child("at").unit(), &points, &radii);
        }
        for k in 0..4 {
            let l = s.child("leaf").at(k);
            let orientation = Rotation::about(l.direction(), l.range(0.0, 6.0));
            builder.leaf(Leaf::new(ChainId(i as u32), l.unit(), orientation, 0.2, k as u16));
        }
    }
    builder.finish().expect("a builder's plant is sound")
}

pub(crate) fn print() {
    let cuts: Vec<_> = [LeafShape::Oak, LeafShape::Willow, LeafShape::Maple]
        .map(|shape| card_cut(&leaf_maps(shape, [0.2; 3], 0.0, 64, 0, Seed::new(1)), 16))
        .to_vec();
    let (mut broken, mut open, mut closed, mut faulty, mut inside_out, mut triangles) = (0, 0, 0, 0, 0, 0);
    // How far a branch's open base sticks out of its bearers' triangles.
    let mut gap = 0.0_f32;
    for i in 0..PLANTS {
        let plant = plant(Seed::new(i));
        let posed = plant.pose();
        for forks in [Forks::Collar, Forks::Plain] {
            let detail =
                TubeDetail::full(&MeshParams { bark_tile: 0.7, forks, roots: 0.7, ..MeshParams::told(12, 0.004) });
            let mut bark = tubes(&plant, &posed, &detail);
            broken += usize::from(add_tangents(&mut bark).is_err() || !problems(&bark).is_empty());
            for shape in SHAPES {
                let cards = Cards { shape, cuts: &cuts };
                let mut leaf = leaf_cards(&plant, &posed, &all_cards(&plant), cards);
                broken += usize::from(add_tangents(&mut leaf).is_err() || !problems(&leaf).is_empty());
            }
            let found = closure(&bark);
            faulty += found.faulty_edges;
            inside_out += found.inside_out;
            triangles += bark.indices.len() / 3;
            let parents: Vec<Option<u32>> = plant.chains().iter().map(|c| c.parent.map(|p| p.0)).collect();
            let gaps = fork_gaps(&bark, &parents);
            let stems = parents.iter().filter(|parent| parent.is_none()).count();
            open += found.openings.abs_diff(stems + gaps.iter().flatten().count());
            closed += gaps.iter().filter(|gap| gap.is_none()).count() - stems;
            gap = gaps.into_iter().flatten().fold(gap, f32::max);
        }
    }
    let how = |what: &str| {
        format!(
            "{PLANTS} random plants with collars and without, leaves on cards of each shape, {triangles} triangles: {what}"
        )
    };
    let what = "meshes with a NaN, an index out of range, a triangle without area, or a tangent that leans";
    Figure::new("lod.mesh.broken", broken as f64, "meshes", how(what)).goal("0").print();
    let what = format!("openings more or less than one a chain, its base, {closed} of which a cap closes");
    Figure::new("lod.mesh.openings_off", open as f64, "openings", how(&what)).goal("0").print();
    let what = "edges of more than two triangles, or wound against each other";
    Figure::new("lod.mesh.faulty_edges", faulty as f64, "edges", how(what)).goal("0").print();
    let what = "triangles that face away from all their normals";
    Figure::new("lod.mesh.inside_out", inside_out as f64, "triangles", how(what)).goal("0").print();
    let what = "how far the open base of a branch sticks out of the triangles of what bears it, at most";
    Figure::new("lod.mesh.fork_gap", f64::from(gap.max(0.0)), "m", how(what)).goal("<= 1e-5").print();
}
