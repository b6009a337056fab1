//! What nothing grows through: boxes and closed meshes, with some air around them.
//!
//! Nodes inside or within the clearance are taken out of the graph, and so are edges through a wall thinner than an edge
//! is long. A point is inside a mesh where an odd number of its triangles lie above; projected to the ground an edge is
//! computed in one order of its ends whichever triangle asks, so that neighbours agree and a closed mesh has no leaks.
//! Triangles are found by cells. Limits: a mesh that is open lets points below its hole count as inside or not; at most
//! [`MOST_TRIANGLES`].

use glam::Vec3;

use super::grid::Lattice;
use super::{GrowError, ObstacleMeshes};
use crate::base::Groups;
use crate::preset::plan::Obstacle;
use crate::source::glb::read_glb;

/// Most triangles of all obstacles.
pub(super) const MOST_TRIANGLES: usize = 500_000;
/// Most cells along an axis.
const MOST_CELLS: f32 = 48.0;

/// A triangle.
pub(super) type Triangle = [Vec3; 3];

/// The triangles of a GLB file's default scene, in its own units, Y up.
///
/// # Errors
///
/// Why it can't be read, or that it has too many triangles.
pub fn obstacle_triangles(bytes: &[u8]) -> Result<Vec<[Vec3; 3]>, String> {
    let info = read_glb(bytes).map_err(|error| error.to_string())?;
    let mut triangles = Vec::new();
    for instance in &info.instances {
        for (i, primitive) in info.meshes[instance.mesh].primitives.iter().enumerate() {
            if triangles.len() as u64 + primitive.triangles > MOST_TRIANGLES as u64 {
                return Err(format!("it has more than {MOST_TRIANGLES} triangles"));
            }
            let read = |error: crate::source::glb::GlbError| error.to_string();
            let points: Vec<Vec3> = info
                .positions(instance.mesh, i)
                .map_err(read)?
                .into_iter()
                .map(|p| Vec3::from(instance.place(p)))
                .collect();
            let corners = info.triangles(instance.mesh, i).map_err(read)?;
            let corner = |c: u32| points.get(c as usize).copied().unwrap_or_default();
            triangles.extend(corners.into_iter().map(|t| t.map(corner)));
        }
    }
    Ok(triangles)
}

/// Boxes, triangles and the air around them: lengths in plant heights where plants grow, metres from the foot of the first
/// plant where they are dressed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Obstacles {
    boxes: Vec<[Vec3; 2]>,
    mesh: Option<Mesh>,
    clearance: f32,
}

impl Obstacles {
    /// What parameters name, in metres.
    ///
    /// # Errors
    ///
    /// When a mesh is not in `meshes`, not finite or too large.
    pub fn of(obstacles: &[Obstacle], clearance: f32, meshes: &ObstacleMeshes) -> Result<Self, GrowError> {
        Self::scaled(obstacles, clearance, 1.0, meshes)
    }

    /// The same in lengths of which a metre has so many; `clearance` is one of them.
    pub(super) fn scaled(
        obstacles: &[Obstacle],
        clearance: f32,
        per_metre: f32,
        meshes: &ObstacleMeshes,
    ) -> Result<Self, GrowError> {
        let (mut boxes, mut triangles): (Vec<[Vec3; 2]>, Vec<Triangle>) = (Vec::new(), Vec::new());
        for obstacle in obstacles {
            match obstacle {
                Obstacle::Box { low, high } => boxes.push([*low, *high].map(|v| Vec3::from(v) * per_metre)),
                Obstacle::Mesh { file, at } => {
                    let mesh = meshes.get(file).ok_or_else(|| GrowError::NoMesh(file.clone()))?;
                    let place = |v: Vec3| (v + Vec3::from(*at)) * per_metre;
                    triangles.extend(mesh.iter().map(|t| t.map(place)));
                }
            }
        }
        if triangles.len() > MOST_TRIANGLES || triangles.iter().flatten().any(|v| !v.is_finite()) {
            return Err(GrowError::BadMesh);
        }
        Ok(Self::new(boxes, triangles, clearance))
    }

    /// Obstacles of finite size.
    pub(super) fn new(boxes: Vec<[Vec3; 2]>, triangles: Vec<Triangle>, clearance: f32) -> Self {
        let mesh = (!triangles.is_empty()).then(|| Mesh::new(triangles, clearance));
        Self { boxes, mesh, clearance }
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.boxes.is_empty() && self.mesh.is_none()
    }

    /// Whether a point is outside of all, with the clearance.
    pub(crate) fn free(&self, p: Vec3) -> bool {
        let clear = |&[low, high]: &[Vec3; 2]| {
            let off = (low - p).max(p - high).max(Vec3::ZERO);
            off.length_squared() > self.clearance * self.clearance
        };
        self.boxes.iter().all(clear)
            && self.mesh.as_ref().is_none_or(|mesh| !mesh.touches(p, self.clearance) && !mesh.holds(p))
    }

    /// Whether a point is inside of one, without the clearance.
    pub(crate) fn hold(&self, p: Vec3) -> bool {
        let within = |&[low, high]: &[Vec3; 2]| p.cmpge(low).all() && p.cmple(high).all();
        self.boxes.iter().any(within) || self.mesh.as_ref().is_some_and(|mesh| mesh.holds(p))
    }

    /// Whether the way from one point to another meets one.
    pub(crate) fn bar(&self, from: Vec3, to: Vec3) -> bool {
        self.boxes.iter().any(|b| segment_meets_box(from, to, *b))
            || self.mesh.as_ref().is_some_and(|mesh| mesh.meets(from, to))
    }
}

fn segment_meets_box(from: Vec3, to: Vec3, [low, high]: [Vec3; 2]) -> bool {
    let way = to - from;
    let (mut enter, mut leave) = (0.0_f32, 1.0_f32);
    for axis in 0..3 {
        if way[axis] == 0.0 {
            if from[axis] < low[axis] || from[axis] > high[axis] {
                return false;
            }
        } else {
            let (a, b) = ((low[axis] - from[axis]) / way[axis], (high[axis] - from[axis]) / way[axis]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
    }
    enter <= leave
}

/// Triangles by the cells that they come near.
#[derive(Clone, Debug)]
struct Mesh {
    triangles: Vec<Triangle>,
    lattice: Lattice,
    /// Those of each cell.
    members: Groups,
    /// The same for upright columns of cells, without the clearance.
    columns: Groups,
}

impl PartialEq for Mesh {
    fn eq(&self, other: &Self) -> bool {
        self.triangles == other.triangles
    }
}

impl Mesh {
    fn new(triangles: Vec<Triangle>, clearance: f32) -> Self {
        let corners = || triangles.iter().flatten();
        let low = corners().fold(Vec3::INFINITY, |l, p| l.min(*p)) - clearance;
        let high = corners().fold(Vec3::NEG_INFINITY, |h, p| h.max(*p)) + clearance;
        let span = |t: &Triangle| (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
        let mut cells = MOST_CELLS;
        loop {
            let edge = ((high - low).max_element() / cells).max(1e-6);
            let lattice = Lattice::covering(low, high, edge);
            let boxes = |air: f32| {
                triangles
                    .iter()
                    .map(|t| (lattice.cell(span(t).0 - air), lattice.cell(span(t).1 + air)))
                    .collect::<Vec<_>>()
            };
            let (near, flat) = (boxes(clearance), boxes(0.0));
            let entries: usize =
                near.iter().map(|(a, b)| (0..3).map(|i| (b[i] - a[i] + 1) as usize).product::<usize>()).sum();
            // Large triangles in small cells would take memory without bound.
            if entries > triangles.len() * 16 + 200_000 && cells > 1.0 {
                cells *= 0.5;
                continue;
            }
            let columns: Vec<_> = flat.iter().map(|(a, b)| ([a[0], 0, a[2]], [b[0], 0, b[2]])).collect();
            let (members, columns) = (gather(&lattice, &near), gather(&lattice, &columns));
            return Self { triangles, lattice, members, columns };
        }
    }

    fn near(&self, cell: [u32; 3]) -> impl Iterator<Item = &Triangle> {
        let i = self.lattice.index(cell);
        self.members.get(i).iter().map(|&t| &self.triangles[t as usize])
    }

    fn covers(&self, p: Vec3) -> bool {
        let size = self.lattice.size.map(|s| s as f32 * self.lattice.edge);
        let q = p - self.lattice.low;
        (0..3).all(|axis| q[axis] >= 0.0 && q[axis] <= size[axis])
    }

    fn touches(&self, p: Vec3, clearance: f32) -> bool {
        clearance > 0.0
            && self.covers(p)
            && self.near(self.lattice.cell(p)).any(|t| nearest(t, p).distance_squared(p) <= clearance * clearance)
    }

    fn holds(&self, p: Vec3) -> bool {
        if !self.covers(p) {
            return false;
        }
        let [x, _, z] = self.lattice.cell(p);
        let i = self.lattice.index([x, 0, z]);
        let column = self.columns.get(i);
        column.iter().filter(|&&t| lies_above(&self.triangles[t as usize], p)).count() % 2 == 1
    }

    fn meets(&self, from: Vec3, to: Vec3) -> bool {
        let (low, high) = (from.min(to), from.max(to));
        let size = self.lattice.size.map(|s| s as f32 * self.lattice.edge);
        let end = self.lattice.low + Vec3::from(size);
        if low.cmpgt(end).any() || high.cmplt(self.lattice.low).any() {
            return false;
        }
        let (a, b) = (self.lattice.cell(low), self.lattice.cell(high));
        (a[1]..=b[1]).any(|y| {
            (a[2]..=b[2])
                .any(|z| (a[0]..=b[0]).any(|x| self.near([x, y, z]).any(|t| segment_meets_triangle(from, to, t))))
        })
    }
}

/// Lists of members by cell, as one array; `boxes` are each member's first and last cell.
fn gather(lattice: &Lattice, boxes: &[([u32; 3], [u32; 3])]) -> Groups {
    let each = |(t, &(a, b)): (u32, &([u32; 3], [u32; 3]))| {
        let rows = (a[1]..=b[1]).flat_map(move |y| (a[2]..=b[2]).map(move |z| (y, z)));
        rows.flat_map(move |(y, z)| (a[0]..=b[0]).map(move |x| (lattice.index([x, y, z]) as u32, t)))
    };
    Groups::of(lattice.cells(), (0..).zip(boxes).flat_map(each))
}

/// Whether the vertical upwards from a point meets a triangle.
fn lies_above(triangle: &Triangle, p: Vec3) -> bool {
    let (x, z) = (f64::from(p.x), f64::from(p.z));
    let mut inside = false;
    for i in 0..3 {
        // One order of the ends, whichever triangle asks.
        let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
        let (a, b) = if (a.z, a.x) <= (b.z, b.x) { (a, b) } else { (b, a) };
        if (a.z > p.z) != (b.z > p.z) {
            let share = (z - f64::from(a.z)) / (f64::from(b.z) - f64::from(a.z));
            inside ^= x < f64::from(a.x) + (f64::from(b.x) - f64::from(a.x)) * share;
        }
    }
    if !inside {
        return false;
    }
    let [a, b, c] = triangle.map(|v| v.as_dvec3());
    let normal = (b - a).cross(c - a);
    normal.y != 0.0 && a.y - ((x - a.x) * normal.x + (z - a.z) * normal.z) / normal.y > f64::from(p.y)
}

/// The point of a triangle nearest to `p` (Ericson 2005, 5.1.5).
fn nearest(&[a, b, c]: &Triangle, p: Vec3) -> Vec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, d4) = (ab.dot(p - b), ac.dot(p - b));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let (d5, d6) = (ab.dot(p - c), ac.dot(p - c));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    if sum == 0.0 { a } else { a + ab * (vb / sum) + ac * (vc / sum) }
}

/// Whether a segment meets a triangle (Möller and Trumbore 1997).
fn segment_meets_triangle(from: Vec3, to: Vec3, &[a, b, c]: &Triangle) -> bool {
    let (way, ab, ac) = (to - from, b - a, c - a);
    let cross = way.cross(ac);
    let volume = ab.dot(cross);
    if volume == 0.0 {
        return false;
    }
    let off = from - a;
    let u = off.dot(cross) / volume;
    let other = off.cross(ab);
    let (v, t) = (way.dot(other) / volume, ac.dot(other) / volume);
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && (0.0..=1.0).contains(&t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    /// A closed octahedron around `centre`.
    fn octahedron(centre: Vec3, radius: f32) -> Vec<Triangle> {
        let mut triangles = Vec::new();
        for o in 0..8_u32 {
            let side = |bit: u32| if o >> bit & 1 == 1 { -radius } else { radius };
            triangles.push([Vec3::X * side(0), Vec3::Y * side(1), Vec3::Z * side(2)].map(|v| v + centre));
        }
        triangles
    }

    #[test]
    fn a_mesh_holds_its_inside_and_nothing_else() {
        let centre = Vec3::new(0.3, 0.5, -0.2);
        let obstacles = Obstacles::new(Vec::new(), octahedron(centre, 0.2), 0.0);
        for i in 0..4000 {
            let p = centre + Seed::new(1).at(i).direction() * Seed::new(2).at(i).range(0.0, 0.3);
            let d = (p - centre).abs();
            let outside = d.x + d.y + d.z - 0.2;
            if outside.abs() > 1e-4 {
                assert_eq!(obstacles.hold(p), outside < 0.0, "{p}");
                assert_eq!(obstacles.free(p), outside > 0.0, "{p}");
            }
        }
    }

    #[test]
    fn clearance_is_kept_around_boxes_and_meshes() {
        let mesh = Obstacles::new(Vec::new(), octahedron(Vec3::ZERO, 1.0), 0.5);
        assert!(!mesh.free(Vec3::X * 1.4) && mesh.free(Vec3::X * 1.6) && !mesh.hold(Vec3::X * 1.4));
        let boxes = Obstacles::new(vec![[Vec3::ZERO, Vec3::ONE]], Vec::new(), 0.5);
        assert!(!boxes.free(Vec3::new(1.3, 1.3, 0.5)) && boxes.free(Vec3::new(1.4, 1.4, 0.5)));
        assert!(boxes.hold(Vec3::splat(0.5)) && !boxes.hold(Vec3::splat(1.1)));
        assert!(Obstacles::default().free(Vec3::ZERO) && Obstacles::default().is_empty());
    }

    #[test]
    fn ways_through_thin_walls_are_barred() {
        let wall = [[Vec3::ZERO, Vec3::Y, Vec3::Z], [Vec3::Y, Vec3::Z, Vec3::new(0.0, 1.0, 1.0)]];
        let mesh = Obstacles::new(Vec::new(), wall.to_vec(), 0.0);
        let at = |x: f32| Vec3::new(x, 0.4, 0.3);
        assert!(mesh.bar(at(-0.1), at(0.2)) && !mesh.bar(at(0.1), at(0.2)));
        let boxes = Obstacles::new(vec![[Vec3::new(-0.01, 0.0, 0.0), Vec3::new(0.01, 1.0, 1.0)]], Vec::new(), 0.0);
        assert!(boxes.bar(at(-0.1), at(0.2)) && !boxes.bar(at(0.1), at(0.2)));
        assert!(!boxes.bar(at(-0.1), at(-0.1) + Vec3::Y));
    }

    #[test]
    fn flat_and_broken_meshes_end() {
        let flat = vec![[Vec3::ZERO, Vec3::ZERO, Vec3::ZERO]; 3];
        assert!(!Obstacles::new(Vec::new(), flat, 0.0).hold(Vec3::ZERO));
        assert!(obstacle_triangles(b"no mesh").is_err());
    }
}
