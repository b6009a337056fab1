//! Bark on whole meshes: as fine everywhere, closed round the trunk, even at bases and in bends.

use glam::Vec3;

use super::*;
use crate::base::math;

/// Repeats of bark a metre around and along each triangle, with its area.
fn densities(mesh: &Mesh) -> Vec<(f32, f32, f32)> {
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        let [p, q, r] = t.map(|i| mesh.uvs[i as usize]);
        let (e, f) = (b - a, c - a);
        let normal = e.cross(f);
        let double = normal.length();
        // The gradient of what is dp along e and dq along f.
        let gradient = |dp: f32, dq: f32| ((f * dp - e * dq).cross(normal) / (double * double)).length();
        (gradient(q.x - p.x, r.x - p.x), gradient(q.y - p.y, r.y - p.y), double * 0.5)
    };
    mesh.indices.as_chunks::<3>().0.iter().map(of).collect()
}

#[test]
fn bark_is_as_fine_on_a_twig_as_on_the_trunk_and_closes_round_the_trunk() {
    let mut builder = PlantBuilder::new();
    let points: Vec<Vec3> = (0..=20).map(|k| Vec3::Y * (k as f32 * 0.5)).collect();
    let radii: Vec<f32> = (0..=20).map(|k| 0.3 - 0.013 * k as f32).collect();
    let stem = builder.stem(Vec3::ZERO, &points, &radii);
    for i in 0..12 {
        let way = Seed::new(9).at(i).direction() * 2.0;
        let branch = builder.branch(stem, 0.3 + 0.05 * i as f32, &[Vec3::ZERO, way * 0.5, way], &[0.06, 0.045, 0.03]);
        builder.branch(branch, 0.5, &[Vec3::ZERO, Vec3::Y * 0.8], &[0.012, 0.006]);
    }
    let plant = builder.finish().unwrap();
    let mesh = tubes(&plant, &plant.pose(), &DETAIL);
    let mut found = densities(&mesh);
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f32 = found.iter().map(|d| d.2).sum();
    let mut sum = 0.0;
    let median = found.iter().find(|d| {
        sum += d.2;
        sum >= total * 0.5
    });
    let median = median.unwrap().0;
    let near = |d: f32| (d / median - 1.0).abs() <= 0.2;
    let good: f32 = found.iter().filter(|d| near(d.0) && near(d.1)).map(|d| d.2).sum();
    assert!(good / total > 0.9, "{}", good / total);
    // The trunk's lowest rings: three repeats of 0.7 m, and whole ones.
    let of_ring = |ring: usize| mesh.uvs[ring * 13 + 12].x - mesh.uvs[ring * 13].x;
    assert!((0..3).all(|ring| of_ring(ring) == 2.0 || of_ring(ring) == 3.0), "{}", of_ring(0));
}

#[test]
fn bark_is_no_denser_where_a_branch_begins_in_thinner_wood() {
    let mut builder = PlantBuilder::new();
    // Of a trunk that is thick below, so that bark doesn't close round the branch: there it would stay.
    let stem = builder.stem(Vec3::ZERO, &[0.0, 2.0, 4.0].map(|y| Vec3::Y * y), &[0.15, 0.014, 0.014]);
    builder.branch(stem, 0.75, &[Vec3::ZERO, Vec3::new(0.5, 0.1, 0.0)], &[0.018, 0.018]);
    let plant = builder.finish().unwrap();
    let mesh = tubes(&plant, &plant.pose(), &DETAIL);
    let triangles = mesh.indices.as_chunks::<3>().0.iter();
    let of_branch: Vec<bool> = triangles.map(|t| mesh.chains[t[0] as usize] == 1).collect();
    let found: Vec<_> = densities(&mesh).into_iter().zip(of_branch).filter(|d| d.1).map(|d| d.0).collect();
    let base = mesh.chains.iter().position(|&c| c == 1).unwrap();
    let drawn = mesh.positions[base].distance(Vec3::Y * 3.0);
    assert!(drawn < 0.0175, "the first ring is drawn in, else this shows nothing: {drawn}");
    let (least, most) = found.iter().fold((f32::MAX, 0.0_f32), |(a, b), f| (a.min(f.0), b.max(f.0)));
    assert!(most < least * 1.02, "{least} to {most}");
}

#[test]
fn bark_runs_ahead_on_the_outside_of_bends() {
    let points: Vec<Vec3> =
        (0..60).map(|i| Vec3::new(math::sin(i as f32 * 0.25) * 0.05, i as f32 * 0.05, 0.0)).collect();
    let mut builder = PlantBuilder::new();
    builder.stem(Vec3::ZERO, &points, &[0.15; 60]);
    let plant = builder.finish().unwrap();
    let mesh = tubes(&plant, &plant.pose(), &TubeDetail { error: 0.002, sides: 12, flare: 0.0, ..DETAIL });
    let found = densities(&mesh);
    let mut along: Vec<f32> = found.iter().map(|f| f.1).collect();
    along.sort_by(f32::total_cmp);
    let middle = along[along.len() / 2];
    let off = |share: f32| (along[(along.len() as f32 * share) as usize] / middle - 1.0).abs();
    assert!(off(0.05) < 0.12 && off(0.95) < 0.12, "{} {}", off(0.05), off(0.95));
}

#[test]
fn bark_runs_as_often_a_metre_along_the_skin_of_a_flare() {
    // Upright, with a foot three times as wide as the wood above, at half a right angle: its skin is 1.4 times as long as its axis.
    let mut builder = PlantBuilder::new();
    let points: Vec<Vec3> = (0..=20).map(|i| Vec3::Y * (i as f32 * 0.25)).collect();
    let radii: Vec<f32> = (0..=20).map(|i| 0.25 - i as f32 * 0.004 + 0.5 * (1.0 - i as f32 / 2.0).max(0.0)).collect();
    builder.stem(Vec3::ZERO, &points, &radii);
    let plant = builder.finish().unwrap();
    let mesh = tubes(&plant, &plant.pose(), &TubeDetail { roots: 0.0, ..DETAIL });
    // But for the cone that closes it.
    let ends = |t: &[u32; 3]| t.iter().any(|&i| mesh.positions[i as usize].y > 4.99);
    let triangles = mesh.indices.as_chunks::<3>().0.iter().zip(densities(&mesh));
    let along: Vec<f32> = triangles.filter(|(t, _)| !ends(t)).map(|(_, (_, v, _))| v).collect();
    let (least, most) = along.iter().fold((f32::MAX, 0.0_f32), |(a, b), &v| (a.min(v), b.max(v)));
    assert!(along.len() > 20 && most < least * 1.05, "{least} {most}");
}
