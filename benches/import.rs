//! Benchmarks of skeletonization: `cargo bench --bench import`. Compare within one run.

use divan::Bencher;
use glam::Vec3;
use treewright::preset::plan::{ImportHeight, UpAxis};
use treewright::source::skeletonize::{Method, SkeletonParams, Wood, skeletonize};

fn main() {
    divan::main();
}

/// A bent trunk of one skin, of about this many triangles; 16 sides.
fn trunk(triangles: u32) -> Wood {
    let sides = 16;
    let rings = triangles / (2 * sides);
    let mut wood = Wood::default();
    for k in 0..=rings {
        let at = k as f32 / rings as f32;
        for s in 0..sides {
            let angle = s as f32 / sides as f32 * std::f32::consts::TAU;
            let (sin, cos) = (libm::sinf(angle), libm::cosf(angle));
            let radius = 0.4 * (1.0 - 0.8 * at);
            wood.positions.push(Vec3::new(at * at * 3.0 + cos * radius, at * 20.0, sin * radius));
        }
    }
    for k in 0..rings {
        for s in 0..sides {
            let (a, b) = (k * sides + s, k * sides + (s + 1) % sides);
            wood.triangles.extend([[a, b, b + sides], [a, b + sides, a + sides]]);
        }
    }
    wood
}

#[divan::bench(sample_count = 5, args = [10_000, 100_000])]
fn contract_a_trunk(bencher: Bencher<'_, '_>, triangles: u32) {
    let wood = trunk(triangles);
    let params =
        SkeletonParams { up: UpAxis::Y, height: ImportHeight::AsIs, method: Method::Contraction, around: None };
    bencher.bench(|| skeletonize(&wood, &params).unwrap());
}

#[divan::bench(sample_count = 10, args = [10_000, 100_000])]
fn rings_of_a_trunk(bencher: Bencher<'_, '_>, triangles: u32) {
    let wood = trunk(triangles);
    let params = SkeletonParams { up: UpAxis::Y, height: ImportHeight::AsIs, method: Method::ByPiece, around: None };
    bencher.bench(|| skeletonize(&wood, &params).unwrap());
}
