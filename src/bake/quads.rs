//! Pairs of triangles that are a parallelogram, as the halves of a leaf's card are: what they show is one affine picture, so
//! they are drawn as one. They cover the same samples as the two triangles do, at half the work. Of what is solid and asked for
//! its outline only, as wood is, pairs of any shape do.

use std::ops::Range;

use super::samples::{Grid, Point, Side, edge, row_from};
use crate::mesh::Mesh;

/// How far the fourth corner may lie from where a parallelogram has it: units, since each is rounded, and parts of a picture.
const OFF: i32 = 2;
const OFF_PICTURE: f32 = 1e-5;
/// The same of depth, as a share of what corners are apart, and of their distance from the view's middle.
const OFF_DEPTH: f32 = 1e-3;
const ROUNDED: f32 = 4e-6;

/// The corners, one after the other around it, of two triangles (a, b, c) and (a, c, d).
#[inline]
pub(super) fn joined([[a, b, c], [again, same, d]]: [[u32; 3]; 2]) -> Option<[u32; 4]> {
    (again == a && same == c).then_some([a, b, c, d])
}

/// Whether four corners are those of a parallelogram in space and in their picture.
#[inline]
pub(super) fn is_parallelogram(mesh: &Mesh, corners: [u32; 4], p: [Point; 4]) -> bool {
    // Points are within 2^26 units, so that no sum overflows.
    let off = |[a, b, c, d]: [i32; 4]| (a - b + c - d).abs();
    if off(p.map(|p| p.x)) > OFF || off(p.map(|p| p.y)) > OFF {
        return false;
    }
    let z = p.map(|p| p.depth);
    let most = OFF_DEPTH * ((z[0] - z[2]).abs() + (z[1] - z[3]).abs()) + ROUNDED * z[0].abs().max(z[1].abs());
    if (z[0] - z[1] + z[2] - z[3]).abs() > most {
        return false;
    }
    let uv = |k: usize| mesh.uvs.get(corners[k] as usize).copied();
    let (Some(a), Some(b), Some(c), Some(d)) = (uv(0), uv(1), uv(2), uv(3)) else { return false };
    (a - b + c - d).abs().max_element() <= OFF_PICTURE
}

/// As [`scan_box`](super::samples::scan_box), of the two triangles; false, and nothing is called, where rounding has left
/// their corners in no order that one run a row can show.
#[inline]
pub(super) fn scan_quad(
    p: [Point; 4],
    grid: Grid,
    rows: Range<usize>,
    mut put: impl FnMut(usize, usize, usize),
) -> bool {
    let first = (1..4).fold(0, |first, k| if p[k].y < p[first].y { k } else { first });
    let [top, next, bottom, last] = std::array::from_fn(|k| p[(first + k) % 4]);
    let (bulge, other) = (edge(top, bottom, next.x, next.y), edge(top, bottom, last.x, last.y));
    if next.y > bottom.y || last.y > bottom.y || bulge.signum() * other.signum() != -1 {
        return false;
    }
    let (start, end) = (row_from(top.y, &rows), row_from(bottom.y, &rows));
    let (left, right) = if bulge < 0 { (last, next) } else { (next, last) };
    let turns = [left, right].map(|middle| row_from(middle.y, &rows));
    if start >= end {
        return true;
    }
    // Where a side turns can't be foretold: both of its edges are followed, and looked at by turns.
    let mut sides = [(left, turns[0]), (right, turns[1])].map(|(middle, turn)| {
        (Side::new(top, middle, start), Side::new(middle, bottom, turn).back(turn - start), turn)
    });
    for row in start..end {
        let [from, to] = sides.each_mut().map(|(upper, lower, turn)| {
            let (upper, lower) = (upper.next(), lower.next());
            grid.column(if row < *turn { upper } else { lower })
        });
        if from < to {
            put(row, from, to);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::bake::samples::corner_points;
    use crate::bake::{Cutout, Maps, Picture, Repeat, Shading, Shape, Silhouette, Surface, View, rasterize};
    use crate::base::{Frame, Seed};

    /// Parallelograms of any size and turn, strewn, by pairs of triangles.
    fn strewn(count: u64, sizes: (f32, f32)) -> Mesh {
        let mut mesh = Mesh::default();
        for i in 0..count {
            let seed = Seed::new(11).at(i);
            let at = seed.direction() * seed.at(3).range(0.0, 1.4);
            let [x, y] = [5, 6].map(|k| seed.at(k).direction() * seed.at(7).range(sizes.0, sizes.1));
            let first = mesh.positions.len() as u32;
            mesh.positions.extend([at, at + x, at + x + y, at + y]);
            mesh.uvs.extend([Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
            // Each corner's own, so that the two triangles are lit differently.
            mesh.normals.extend((20..24).map(|k| seed.at(k).direction()));
            mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|k| first + k));
        }
        mesh
    }

    /// The same triangles, told so that no two are a pair.
    fn apart(mesh: &Mesh) -> Mesh {
        let mut apart = mesh.clone();
        apart.indices.as_chunks_mut::<6>().0.iter_mut().for_each(|pair| pair[3..].rotate_left(1));
        apart
    }

    fn maps(alpha: impl Fn(u32, u32) -> u8) -> Maps {
        let color = (0..64 * 64).map(|i| [(i % 64 * 4) as u8, (i / 64 * 4) as u8, 9, alpha(i % 64, i / 64)]).collect();
        Maps { width: 64, height: 64, color, normal: vec![[128, 128, 255]; 4096], orm: vec![[255; 3]; 4096] }
    }

    #[test]
    fn pairs_cover_what_their_triangles_do() {
        let view = View::new(Frame::WORLD, Vec3::ZERO, 1.5, 1.5);
        let holes = Picture::new(&maps(|x, y| if (x / 8 + y / 8) % 2 == 0 { 255 } else { 0 }));
        for (sizes, edge) in [((0.02, 0.1), 100), ((0.05, 1.5), 100), ((0.3, 2.0), 400)] {
            let (mesh, size) = (strewn(400, sizes), edge as usize);
            let apart = apart(&mesh);
            let drawn = |mesh: &Mesh, cutouts: &[&Cutout], count: usize| {
                let part = Mesh { indices: mesh.indices[..count * 6].to_vec(), ..mesh.clone() };
                let shape = Shape { mesh: &part, cutouts, repeat: Repeat::Cutout, closed: false };
                Silhouette::new(&[shape], &view, size, size)
            };
            for count in [1, 2, 20, 400] {
                assert_eq!(drawn(&mesh, &[], count), drawn(&apart, &[], count), "{sizes:?} {count}");
            }
            let [paired, single] = [&mesh, &apart].map(|mesh| drawn(mesh, &[holes.cutout()], 400).pixels(1));
            let differ = paired.iter().zip(&single).filter(|(a, b)| a != b).count();
            // Each triangle's corners are rounded: a sample on the edge of a hole may fall to either side.
            assert!(differ * 100 < size * size, "{differ} of {size}²");
            assert!(single.iter().map(|covered| u32::from(*covered)).sum::<u32>() > 300);
        }
    }

    #[test]
    fn solid_pairs_cover_what_their_triangles_do_whatever_their_shape() {
        let view = View::new(Frame::WORLD, Vec3::ZERO, 1.5, 1.5);
        for (sizes, edge) in [((0.02, 0.1), 100), ((0.05, 1.5), 100), ((0.3, 2.0), 400)] {
            let mut mesh = strewn(300, sizes);
            // Convex and not, folded over, and seen from behind.
            for (i, corners) in (0..).zip(mesh.positions.as_chunks_mut::<4>().0) {
                let seed = Seed::new(12).at(i);
                corners[seed.at(0).index(4)] += seed.at(1).direction() * seed.at(2).range(0.0, sizes.1);
            }
            let apart = apart(&mesh);
            for (closed, count) in [false, true].into_iter().flat_map(|closed| (0..300).map(move |i| (closed, i))) {
                let drawn = |mesh: &Mesh| {
                    let part = Mesh { indices: mesh.indices[count * 6..][..6].to_vec(), ..mesh.clone() };
                    let shape = Shape { mesh: &part, cutouts: &[], repeat: Repeat::Tiled, closed };
                    Silhouette::new(&[shape], &view, edge, edge)
                };
                assert_eq!(drawn(&mesh), drawn(&apart), "{sizes:?} {closed} {count}");
            }
        }
    }

    #[test]
    fn pairs_show_what_their_triangles_do() {
        let view = View::new(Frame::WORLD, Vec3::ZERO, 1.5, 1.5);
        let pictures = [Picture::new(&maps(|x, y| if x + y > 20 { 255 } else { 0 }))];
        let mesh = strewn(600, (0.03, 0.09));
        let drawn = |mesh: &Mesh| {
            let surface = Surface { mesh, pictures: &pictures, repeat: Repeat::Cutout, closed: false };
            rasterize(&[surface], &view, 96, 96, 1, &Shading::Albedo)
        };
        let (paired, single) = (drawn(&mesh), drawn(&apart(&mesh)));
        let seen = |i: usize| (paired.coverage[i], single.coverage[i]);
        let alike = |i: usize| {
            (paired.depth[i] - single.depth[i]).abs() < 0.01
                && paired.color[i].distance(single.color[i]) < 0.03
                && paired.normal[i].dot(single.normal[i]) > 0.97
        };
        let both = (0..96 * 96).filter(|&i| seen(i) == (1.0, 1.0)).count();
        let wrong = (0..96 * 96).filter(|&i| seen(i) != (0.0, 0.0) && (seen(i) != (1.0, 1.0) || !alike(i))).count();
        assert!(both > 500 && wrong * 50 < both, "{wrong} of {both}");
    }

    #[test]
    fn what_is_no_parallelogram_stays_two_triangles() {
        let grid = Grid { columns: 100, rows: 100 };
        let points =
            |mesh: &Mesh| crate::bake::samples::project(mesh, &View::new(Frame::WORLD, Vec3::ZERO, 1.5, 1.5), grid);
        let pair = [[0, 1, 2], [0, 2, 3]];
        let whole = strewn(1, (0.5, 0.6));
        let is = |mesh: &Mesh, pair: [[u32; 3]; 2]| {
            let found = joined(pair).and_then(|corners| Some((corners, corner_points(&points(mesh), corners)?)));
            found.is_some_and(|(corners, p)| is_parallelogram(mesh, corners, p))
        };
        assert!(is(&whole, pair));
        assert!(!is(&whole, [[0, 1, 2], [2, 3, 0]]) && !is(&whole, [[0, 1, 2], [0, 2, 99]]));
        for k in 0..4 {
            let mut bent = whole.clone();
            bent.positions[k] += Vec3::Z * 0.1;
            let mut wide = whole.clone();
            wide.positions[k] += Vec3::X * 0.1;
            let mut drawn = whole.clone();
            drawn.uvs[k] += Vec2::new(0.0, 0.1);
            let mut broken = whole.clone();
            broken.positions[k] = Vec3::NAN;
            assert!([bent, wide, drawn, broken].iter().all(|mesh| !is(mesh, pair)), "{k}");
        }
        // Seen on edge nothing is covered, whichever way corners are rounded.
        for lean in [0.0, 1e-3, 3e-3] {
            let mut flat = whole.clone();
            flat.positions =
                [(0.0, 0.0), (0.4, lean), (0.8, 0.0), (0.4, -lean)].map(|(x, y)| Vec3::new(x, y, 0.0)).into();
            let covered = |mesh: &Mesh| {
                let shape = Shape { mesh, cutouts: &[], repeat: Repeat::Cutout, closed: false };
                Silhouette::new(&[shape], &View::new(Frame::WORLD, Vec3::ZERO, 1.5, 1.5), 100, 100)
            };
            assert_eq!(covered(&flat), covered(&apart(&flat)));
        }
    }
}
