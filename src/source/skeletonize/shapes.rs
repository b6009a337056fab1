//! Small surfaces whose axes are known, for the tests of this folder.

use glam::DVec3;

use super::surface::Surface;

/// A ring of `sides` corners swept along `path`, open at both ends.
pub(super) fn tube(path: &[DVec3], radii: &[f64], sides: u32) -> Surface {
    let mut surface = Surface::default();
    for (k, &p) in path.iter().enumerate() {
        let ahead = path[(k + 1).min(path.len() - 1)] - path[k.saturating_sub(1)];
        let (x, z) = ahead.normalize().any_orthonormal_pair();
        for s in 0..sides {
            let angle = f64::from(s) / f64::from(sides) * std::f64::consts::TAU;
            surface.positions.push(p + (x * libm::cos(angle) + z * libm::sin(angle)) * radii[k]);
        }
    }
    for k in 0..path.len() as u32 - 1 {
        for s in 0..sides {
            let (a, b) = (k * sides + s, k * sides + (s + 1) % sides);
            surface.triangles.extend([[a, b, b + sides], [a, b + sides, a + sides]]);
        }
    }
    surface
}

/// A flat disc of `rings` rings of `sides` corners around a middle.
pub(super) fn disc(sides: u32, rings: u32) -> Surface {
    let path: Vec<DVec3> = (0..rings).map(|k| DVec3::Y * 1e-9 * f64::from(k)).collect();
    let radii: Vec<f64> = (0..rings).map(|k| f64::from(rings - k)).collect();
    tube(&path, &radii, sides)
}

/// A trunk of one skin that parts into two branches, each four-sided: the lower tube's last ring is cut into two by a
/// bridge of two vertices.
pub(super) fn fork() -> Surface {
    // Two boxes side by side on top of one: the classic cube extrusion, three levels high.
    let mut surface = tube(&[DVec3::ZERO, DVec3::Y, DVec3::Y * 2.0, DVec3::Y * 3.0], &[0.5, 0.5, 0.5, 0.5], 4);
    // Corners of the top ring are 12..16; a ridge across it carries the other two sides of both branches.
    let top: Vec<DVec3> = surface.positions[12..16].to_vec();
    let ridge = [(top[0] + top[1]) * 0.5, (top[2] + top[3]) * 0.5];
    let first = surface.positions.len() as u32;
    surface.positions.extend(ridge);
    // Two quads, each with two corners of the ring and the ridge; the first ring of the two branches.
    let rings = [[12, first, first + 1, 15], [first, 13, 14, first + 1]];
    for (ring, side) in rings.into_iter().zip([-1.0, 1.0]) {
        let lean = (top[1] - top[0]).normalize() * side;
        let mut below = ring;
        for level in 1..=4 {
            let base = surface.positions.len() as u32;
            for &v in &ring {
                let up = (DVec3::Y + lean) * (0.5 * f64::from(level));
                surface.positions.push(surface.positions[v as usize] + up);
            }
            let above = [base, base + 1, base + 2, base + 3];
            for s in 0..4 {
                let (a, b, c, d) = (below[s], below[(s + 1) % 4], above[(s + 1) % 4], above[s]);
                surface.triangles.extend([[a, b, c], [a, c, d]]);
            }
            below = above;
        }
    }
    surface
}
