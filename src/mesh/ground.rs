//! Where a stem meets the ground: its skin ends there level all round, and goes on below where that is asked for.
//!
//! The first ring of a stem that leans is square to it. What of it stands above the ground is taken down ([`set_down`]), what lies
//! below is cut off along the sides of the tube ([`Ground::cut`]): as a spur it showed on slopes and below trees that are not sunk. A
//! stem that lies on the ground has no such end.

use std::ops::Range;

use glam::{Vec2, Vec3};

use super::Mesh;
use super::rings::Ring;
use super::sweep::push;
use super::tangent::tangent_of;

/// How upright a stem must be for its foot to be taken down to the ground: the rise of a metre of it, metres; and after how many radii it may
/// begin to rise. Trunks that set out level do stand, and what lies on the ground is the whole of a stem.
const LEANS: f32 = 0.15;
const RISES: f32 = 6.0;
/// How far a stem lies that doesn't go on below the ground: how high its first ring is, as a share of its girth. At 70 degrees.
const LIES: f32 = 0.15;
/// The same of one that stands upright.
const UPRIGHT: f32 = 0.02;
/// What lies no higher above the ground than that falls to it when a stem is cut off there, as a share of its radius: no slivers.
const NEAR: f32 = 0.05;

/// Whether a stem of some rings, the first of them square to a direction, stands on the ground, and does not lie on it.
pub(super) fn stands(rings: &[Ring], tangent: Vec3) -> bool {
    let (Some(first), Some(last)) = (rings.first(), rings.last()) else { return false };
    let ahead = rings.iter().find(|ring| ring.arc - first.arc >= first.radius * RISES).unwrap_or(last);
    let way = (ahead.centre - first.centre).normalize_or(tangent);
    tangent.y.max(way.y) > LEANS
}

/// By how many rings each column of a stem's vertices is cut off by the ground; nothing where the stem is not cut.
#[derive(Debug, Default)]
pub(super) struct Ground {
    /// The first vertex of the stem.
    start: usize,
    cut: Vec<usize>,
}

impl Ground {
    /// Cuts a stem off whose rings, of `columns` vertices each, are all the mesh has from `start` on: the vertices of a
    /// column are moved along it to where it comes out of the ground, and all but the first used no more. What does not come out stays as
    /// it is.
    pub(super) fn cut(mesh: &mut Mesh, (start, columns): (usize, usize), (ground, first): (f32, &Ring)) -> Self {
        let near = first.radius * NEAR;
        let height = |mesh: &Mesh, i: usize| mesh.positions[i].y - ground;
        let is_sunk = (start..start + columns).any(|i| height(mesh, i) < -near);
        if !is_sunk {
            return Self::default();
        }
        let column = |k: usize| (start + k..mesh.positions.len()).step_by(columns);
        let rows = (mesh.positions.len() - start) / columns;
        let cut: Vec<usize> =
            (0..columns).map(|k| column(k).position(|i| height(mesh, i) > near).unwrap_or(rows).max(1)).collect();
        if cut.contains(&rows) {
            return Self::default();
        }
        for (k, &cut) in cut.iter().enumerate() {
            let above = start + cut * columns + k;
            let below = above - columns;
            let (low, high) = (height(mesh, below), height(mesh, above));
            let share = (-low / (high - low)).max(0.0);
            let place = mesh.positions[below].lerp(mesh.positions[above], share).with_y(ground);
            let uv = mesh.uvs[below].lerp(mesh.uvs[above], share);
            for i in (start + k..above).step_by(columns) {
                (mesh.positions[i], mesh.uvs[i]) = (place, uv);
            }
        }
        Self { start, cut }
    }

    /// Adds what is left of a triangle of the tube.
    pub(super) fn add(&self, mesh: &mut Mesh, corners: [u32; 3]) {
        let left = corners.map(|i| {
            let (row, column) =
                ((i as usize - self.start) / self.cut.len(), (i as usize - self.start) % self.cut.len());
            if row < self.cut[column] { (self.start + column) as u32 } else { i }
        });
        if left[0] != left[1] && left[1] != left[2] && left[2] != left[0] {
            mesh.indices.extend(left);
        }
    }

    /// Whether something was cut off.
    pub(super) fn any(&self) -> bool {
        !self.cut.is_empty()
    }

    /// Takes the vertices out that were cut off; `triangles` are where the stem's indices begin. Some importers drop what no triangle
    /// uses, and count other vertices then.
    pub(super) fn tidy(&self, mesh: &mut Mesh, triangles: usize) {
        let columns = self.cut.len();
        // What was added after the sides counts as further rows.
        let is_left = |i: usize| i < columns || i / columns >= self.cut[i % columns];
        let mut next = self.start as u32;
        let places: Vec<u32> = (0..mesh.positions.len() - self.start)
            .map(|i| {
                let place = next;
                next += u32::from(is_left(i));
                place
            })
            .collect();
        for i in &mut mesh.indices[triangles..] {
            *i = places[*i as usize - self.start];
        }
        let Mesh { positions, normals, tangents, uvs, occlusion, .. } = mesh;
        keep(positions, self.start, is_left);
        keep(normals, self.start, is_left);
        keep(tangents, self.start, is_left);
        keep(uvs, self.start, is_left);
        keep(occlusion, self.start, is_left);
    }
}

/// Takes out of what begins at `start` whatever is not left, by its number there.
fn keep<T: Copy>(values: &mut Vec<T>, start: usize, is_left: impl Fn(usize) -> bool) {
    let mut end = start;
    for i in start..values.len() {
        if is_left(i - start) {
            values[end] = values[i];
            end += 1;
        }
    }
    values.truncate(end);
}

/// Takes the first ring of a leaning stem, which is square to it, down to the ground all round: along the stem it would be a spur,
/// and straight down flat. `density` is of bark, repeats a metre.
pub(super) fn set_down(mesh: &mut Mesh, ring: Range<usize>, (ground, tangent): (f32, Vec3), density: f32) {
    let way = (tangent.with_y(tangent.y.max(0.0)) + Vec3::Y).normalize_or(Vec3::Y);
    for (place, uv) in mesh.positions[ring.clone()].iter_mut().zip(&mut mesh.uvs[ring]) {
        let down = ((place.y - ground) / way.y).max(0.0);
        *place -= way * down;
        uv.y += down * density;
    }
}

/// Goes on with the first ring of a stem straight down, so far below the ground, or below the ring where it leans deeper; `density`
/// is of bark, repeats a metre. A stem that lies on the ground has no ring around it there.
pub(super) fn sink(mesh: &mut Mesh, ring: Range<usize>, cut: &Ground, (ground, below): (f32, f32), density: f32) {
    let places = &mesh.positions[ring.clone()];
    let off = places.iter().fold(0.0_f32, |most, place| most.max((place.y - ground).abs()));
    let girth = places.array_windows().map(|[a, b]| a.distance(*b)).sum::<f32>();
    if off > girth * LIES {
        return;
    }
    let bottom = places.iter().fold(ground, |low, place| low.min(place.y)) - below;
    // Seen from above a ring that leans is narrow, and its own normals may look to the other side: it is there once more.
    let leans = cut.any() || off > girth * UPRIGHT;
    let sides = ring.len() as u32 - 1;
    let upper = if leans { mesh.positions.len() as u32 } else { ring.start as u32 };
    // The ways of the ring and of growing u: bark has run on by different lengths where the ring was taken down or cut off.
    let ways = |mesh: &Mesh, i: usize| {
        let before = if i == ring.start { ring.end - 2 } else { i - 1 };
        let after = if i + 1 == ring.end { ring.start + 1 } else { i + 1 };
        let along = mesh.positions[after] - mesh.positions[before];
        (along, along + Vec3::Y * ((mesh.uvs[after].y - mesh.uvs[before].y) / density.max(1e-6)))
    };
    let drops = if leans { &[false, true][..] } else { &[true][..] };
    for drop in drops {
        for i in ring.clone() {
            let (along, growing) = ways(mesh, i);
            let radial = along.cross(Vec3::Y).normalize_or(Vec3::X);
            let down = if *drop { mesh.positions[i].y - bottom } else { 0.0 };
            let place = mesh.positions[i] - Vec3::Y * down;
            let uv = mesh.uvs[i] + Vec2::new(0.0, down * density);
            let tangent = tangent_of(radial, growing, Vec3::NEG_Y);
            push(mesh, place, (radial, tangent), uv, mesh.occlusion[i]);
        }
    }
    let lower = mesh.positions.len() as u32 - sides - 1;
    for k in 0..sides {
        let (a, b) = (lower + k, upper + k);
        mesh.indices.extend([a, a + 1, b + 1, a, b + 1, b]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{CrownLight, TubeDetail, Wood, closure, problems};
    use crate::plant::PlantBuilder;
    use crate::preset::plan::MeshParams;

    #[test]
    fn a_foot_that_leans_ends_on_the_ground_and_goes_on_below_it_and_one_that_lies_does_not() {
        for (lean, sunk) in [(0.0, true), (0.6, true), (3.0, true), (5.0, true), (10.0, false)] {
            let mut builder = PlantBuilder::new();
            builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::new(lean, 1.0, 0.0) * 2.0], &[0.2, 0.1]);
            let plant = builder.finish().unwrap();
            let posed = plant.pose();
            let wood = Wood::of(&plant, &posed, &TubeDetail::full(&MeshParams::told(12, 0.004)));
            let of = |below: f32| {
                let detail = TubeDetail { below, ..TubeDetail::full(&MeshParams::told(12, 0.004)) };
                wood.mesh(&CrownLight::of(&plant, &posed), &detail)
            };
            let lowest = |mesh: &Mesh| mesh.positions.iter().fold(f32::MAX, |low, p| low.min(p.y));
            let (before, after) = (of(0.0), of(0.4));
            let deep = lowest(&before) - lowest(&after);
            assert!((deep - if sunk { 0.4 } else { 0.0 }).abs() < 1e-3, "{lean}: {deep}");
            for mesh in [&before, &after] {
                assert_eq!((problems(mesh), closure(mesh).inside_out), (Vec::new(), 0), "{lean}");
            }
            // It ends on the ground all round.
            assert_eq!(lowest(&before).abs() < 1e-5, sunk, "{lean}");
            let rim: Vec<Vec3> = before.positions.iter().copied().filter(|p| p.y.abs() < 1e-5).collect();
            let middle = rim.iter().sum::<Vec3>() / rim.len().max(1) as f32;
            // What was added faces outwards.
            for t in after.indices[before.indices.len()..].as_chunks::<3>().0 {
                let [a, b, c] = t.map(|i| after.positions[i as usize]);
                let out = (a + b + c) / 3.0 - middle;
                assert!((b - a).cross(c - a).dot(out.with_y(0.0)) > 0.0, "{lean}: {t:?}");
            }
        }
    }

    #[test]
    fn a_trunk_that_sets_out_level_and_rises_stands_on_the_ground() {
        for first in [0.03, 0.0, -0.02] {
            let mut builder = PlantBuilder::new();
            let points = [Vec3::ZERO, Vec3::new(0.5, first, 0.0), Vec3::new(1.0, 0.4, 0.0), Vec3::new(1.3, 2.0, 0.0)];
            builder.stem(Vec3::ZERO, &points, &[0.2, 0.19, 0.18, 0.1]);
            let plant = builder.finish().unwrap();
            let params = MeshParams::told(12, 0.004);
            let mesh = crate::mesh::tubes(&plant, &plant.pose(), &TubeDetail::full(&params));
            assert_eq!((problems(&mesh), closure(&mesh).inside_out), (Vec::new(), 0), "{first}");
            // Nothing of it is below, and it is open nowhere else: an end that stood upright would be.
            assert!(mesh.positions.iter().all(|p| p.y > -1e-5), "{first}");
            let rim = mesh.positions.iter().filter(|p| p.y.abs() < 1e-5).count();
            assert!(rim >= 12, "{first}: {rim}");
        }
    }
}
