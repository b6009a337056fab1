//! The rotation that brings one square root velocity function nearest to another (2018 TOG, Eq. 1 for a fixed
//! parameterization): Horn's quaternion, the top eigenvector of a symmetric 4 × 4 matrix, by Jacobi's rotations.
//!
//! Nearly straight curves leave the twist about them open; a small multiple of the identity picks the least one.

use glam::DVec3;

/// A rotation by its columns.
pub(super) type Turn = [DVec3; 3];

/// No rotation.
pub(super) const UNTURNED: Turn = [DVec3::X, DVec3::Y, DVec3::Z];

/// A turned vector.
pub(super) fn turned(turn: &Turn, v: DVec3) -> DVec3 {
    turn[0] * v.x + turn[1] * v.y + turn[2] * v.z
}

/// The rotation R that makes the sum of `to · R from` greatest over all pairs `(to, from)`.
pub(super) fn nearest_rotation(pairs: impl Iterator<Item = (DVec3, DVec3)>) -> Turn {
    // m[i][j]: sum of from_i to_j.
    let mut m = [[0.0_f64; 3]; 3];
    for (to, from) in pairs {
        for i in 0..3 {
            for j in 0..3 {
                m[i][j] += from[i] * to[j];
            }
        }
    }
    let size = m.iter().flatten().fold(0.0_f64, |s, x| s.max(x.abs()));
    if size <= 0.0 {
        return UNTURNED;
    }
    (0..3).for_each(|i| m[i][i] += size * 1e-6);
    let trace = m[0][0] + m[1][1] + m[2][2];
    let mut n = [[0.0_f64; 4]; 4];
    n[0][0] = trace;
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        n[0][i + 1] = m[j][k] - m[k][j];
        n[i + 1][0] = n[0][i + 1];
        n[i + 1][i + 1] = 2.0 * m[i][i] - trace;
        n[i + 1][j + 1] = m[i][j] + m[j][i];
        n[j + 1][i + 1] = n[i + 1][j + 1];
    }
    let [w, x, y, z] = top_eigenvector(n);
    [
        DVec3::new(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
        DVec3::new(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
        DVec3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
    ]
}

/// Sweeps of Jacobi's method; four by four matrices are diagonal to the last digit after five or six.
const SWEEPS: usize = 10;

fn top_eigenvector(mut a: [[f64; 4]; 4]) -> [f64; 4] {
    let mut v = [[0.0_f64; 4]; 4];
    (0..4).for_each(|i| v[i][i] = 1.0);
    for _ in 0..SWEEPS {
        for p in 0..3 {
            for q in p + 1..4 {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for row in &mut a {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                let (x, y) = (a[p], a[q]);
                a[p] = std::array::from_fn(|k| c * x[k] - s * y[k]);
                a[q] = std::array::from_fn(|k| s * x[k] + c * y[k]);
                for row in &mut v {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
            }
        }
    }
    let top = (1..4).fold(0, |best, i| if a[i][i] > a[best][best] { i } else { best });
    let vector = [v[0][top], v[1][top], v[2][top], v[3][top]];
    let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    vector.map(|x| x / length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Rotation, Seed};

    #[test]
    fn a_rotation_is_found_from_what_it_turned() {
        for i in 0..200 {
            let seed = Seed::new(i);
            let rotation = Rotation::about(seed.direction(), seed.child("angle").range(-3.1, 3.1));
            let from: Vec<DVec3> = (0..6).map(|k| seed.at(k).child("v").direction().as_dvec3()).collect();
            let pairs = from.iter().map(|f| (rotation.rotate(f.as_vec3()).as_dvec3(), *f));
            let turn = nearest_rotation(pairs);
            for f in &from {
                assert!(turned(&turn, *f).distance(rotation.rotate(f.as_vec3()).as_dvec3()) < 1e-4);
            }
        }
    }

    #[test]
    fn nothing_and_the_same_are_not_turned() {
        assert_eq!(nearest_rotation(std::iter::empty()), UNTURNED);
        let turn = nearest_rotation((0..3).map(|_| (DVec3::Y, DVec3::Y)));
        assert!(turn.iter().zip(&UNTURNED).all(|(a, b)| a.distance(*b) < 1e-9));
    }
}
