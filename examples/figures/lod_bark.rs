//! Texel density of bark along the branches of the shipped sets.

use glam::Vec3;
use treewright::mesh::Mesh;

use crate::Figure;
use crate::lod_asset::Set;

/// What was found on some trees.
#[derive(Default)]
pub(crate) struct Density {
    /// Square metres, and how many of them are within a fifth of their tree's median both ways.
    area: f64,
    near: f64,
    trees: usize,
    /// The least share of a tree, and of a branch that has a thousandth of its tree's bark at least.
    worst_tree: Option<(f64, String)>,
    worst_branch: Option<(f64, String)>,
}

/// Looks at LOD0 of every variant of a set.
pub(crate) fn add(all: &mut Density, name: &str, set: &Set) {
    let mut of_set = Density::default();
    for (v, levels) in set.variants.iter().enumerate() {
        let bark = &levels[0].0.bark;
        let found = triangles(bark);
        let total: f64 = found.iter().map(|f| f.2).sum();
        if total <= 0.0 {
            continue;
        }
        let mut sorted: Vec<(f64, f64)> = found.iter().flat_map(|&(u, v, area)| [(u, area), (v, area)]).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut sum = 0.0;
        let median = sorted
            .iter()
            .find(|d| {
                sum += d.1;
                sum >= total
            })
            .map_or(1.0, |d| d.0);
        let near = |&(u, v, area): &(f64, f64, f64)| {
            if [u, v].iter().all(|d| (d / median - 1.0).abs() <= 0.2) { area } else { 0.0 }
        };
        let branches = branches(bark);
        let mut of_branch = vec![(0.0, 0.0); bark.positions.len()];
        for (triangle, &branch) in found.iter().zip(&branches) {
            let of: &mut (f64, f64) = &mut of_branch[branch as usize];
            of.0 += near(triangle);
            of.1 += triangle.2;
        }
        let good: f64 = found.iter().map(near).sum();
        let tree = format!("{name} {}", v + 1);
        for density in [&mut *all, &mut of_set] {
            density.area += total;
            density.near += good;
            density.trees += 1;
            lower(&mut density.worst_tree, good / total, &tree);
            for of in of_branch.iter().filter(|of| of.1 >= total * 1e-3) {
                let what = || format!("{tree}, with {:.1} % of its bark", of.1 / total * 100.0);
                if density.worst_branch.as_ref().is_none_or(|w| of.0 / of.1 < w.0) {
                    density.worst_branch = Some((of.0 / of.1, what()));
                }
            }
        }
    }
    if of_set.trees > 0 {
        let worst = of_set.worst_tree.as_ref().map_or(0.0, |w| w.0);
        let how = format!(
            "share of bark within 20 % of its tree's median around and along, {} trees, worst {worst:.3}",
            of_set.trees
        );
        Figure::new(format!("lod.{name}.bark_density"), of_set.near / of_set.area, "share", how)
            .goal(">= 0.90")
            .print();
    }
}

/// The total.
pub(crate) fn print(all: &Density) {
    if all.trees == 0 {
        return;
    }
    let how = format!(
        "share of bark whose texels a metre are within 20 % of its tree's median, around and along, LOD0 of {} trees",
        all.trees
    );
    Figure::new("lod.bark.density", all.near / all.area, "share", how).goal(">= 0.95").print();
    for (name, worst) in
        [("lod.bark.density_worst_tree", &all.worst_tree), ("lod.bark.density_worst_branch", &all.worst_branch)]
    {
        if let Some((share, what)) = worst {
            let figure = Figure::new(name, *share, "share", format!("the same of {what}"));
            if name.ends_with("tree") { figure.goal(">= 0.90").print() } else { figure.print() }
        }
    }
}

fn lower(worst: &mut Option<(f64, String)>, share: f64, what: &str) {
    if worst.as_ref().is_none_or(|w| share < w.0) {
        *worst = Some((share, what.to_owned()));
    }
}

/// Repeats a metre around and along each triangle, and its area.
fn triangles(mesh: &Mesh) -> Vec<(f64, f64, f64)> {
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        let [p, q, r] = t.map(|i| mesh.uvs[i as usize]);
        let (e, f): (Vec3, Vec3) = (b - a, c - a);
        let normal = e.cross(f);
        let double = normal.length();
        let gradient = |dp: f32, dq: f32| f64::from(((f * dp - e * dq).cross(normal) / (double * double)).length());
        (gradient(q.x - p.x, r.x - p.x), gradient(q.y - p.y, r.y - p.y), f64::from(double) * 0.5)
    };
    mesh.indices.as_chunks::<3>().0.iter().map(of).filter(|f| f.0.is_finite() && f.1.is_finite()).collect()
}

/// The branch of each triangle: what hangs together by its vertices is one skin.
fn branches(mesh: &Mesh) -> Vec<u32> {
    let mut sets: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    fn find(sets: &mut [u32], mut i: u32) -> u32 {
        while sets[i as usize] != i {
            sets[i as usize] = sets[sets[i as usize] as usize];
            i = sets[i as usize];
        }
        i
    }
    for t in mesh.indices.as_chunks::<3>().0 {
        for k in [1, 2] {
            let (i, j) = (find(&mut sets, t[0]), find(&mut sets, t[k]));
            sets[i.max(j) as usize] = i.min(j);
        }
    }
    mesh.indices.as_chunks::<3>().0.iter().map(|t| find(&mut sets, t[0])).collect()
}
