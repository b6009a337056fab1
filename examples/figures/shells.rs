//! Skins made to measure speed with.

use glam::Vec3;
use treewright::base::Seed;
use treewright::source::skeletonize::Wood;

/// One skin, no piece of which is a tube, of about this many triangles.
pub(crate) fn shell(triangles: usize) -> Wood {
    // Limbs leave a trunk by splitting its last ring in two, again and again: one skin of 16 tips. Triangles about as
    // long as wide, however many.
    let depth = 4_u32;
    let sides = if triangles > 500_000 { 256_u32 } else { 64 };
    let around = sides * (depth + 1) + (2 << depth);
    let rings = (triangles as u32 / (2 * around)).max(2);
    let mut wood = Wood::default();
    let first: Vec<u32> = (0..sides).collect();
    for s in 0..sides {
        let (sin, cos) = treewright::base::math::sin_cos(s as f32 / sides as f32 * std::f32::consts::TAU);
        wood.positions.push(Vec3::new(cos * 0.3, 0.0, sin * 0.3));
    }
    let mut work = vec![(first, Vec3::ZERO, Vec3::Y, 0.3_f32, 0_u32, Seed::new(5))];
    while let Some((ring, base, along, radius, level, seed)) = work.pop() {
        let length = 3.0 / (1.0 + level as f32 * 0.4);
        let (x, z) = along.any_orthonormal_pair();
        let mut below = ring;
        for k in 1..=rings {
            let middle = base + along * (length * k as f32 / rings as f32);
            let above = wood.positions.len() as u32;
            let count = below.len() as u32;
            for s in 0..count {
                let (sin, cos) = treewright::base::math::sin_cos(s as f32 / count as f32 * std::f32::consts::TAU);
                wood.positions.push(middle + (x * cos + z * sin) * radius);
            }
            for s in 0..count {
                let t = (s + 1) % count;
                let (a, b) = (below[s as usize], below[t as usize]);
                wood.triangles.extend([[a, b, above + t], [a, above + t, above + s]]);
            }
            below = (above..above + count).collect();
        }
        if level == depth {
            continue;
        }
        let half = below.len() / 2;
        let end = base + along * length;
        for (side, part) in [(1.0, [&below[..=half]].concat()), (-1.0, [&below[half..], &below[..1]].concat())] {
            let lean = x * (side * 0.5) + seed.child("lean").at(level.into()).direction() * 0.3;
            let way = (along + lean).normalize();
            work.push((part, end + way * (radius * 0.5), way, radius * 0.7, level + 1, seed.at((side > 0.0).into())));
        }
    }
    wood
}
