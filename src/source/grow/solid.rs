//! Shapes from files that endpoints fill: the inside of a closed mesh, or of an SVG silhouette revolved (2015, 3.2.2
//! asks for "a user-specified volume"; the paper's are all analytic).
//!
//! A mesh is asked by the parity of what lies above a point. Projected on the ground, an edge is computed in one order of
//! its ends whichever triangle asks, so a point lies under exactly one of two neighbours and the parity is never wrong
//! for a closed mesh, however thin its triangles. Columns on the ground keep a question short.
//!
//! An outline is a half profile, see `outline`. What is seen in one direction is a prism; two of them, from the front and
//! from the side, have the visual hull in common (Laurentini 1994), which `volume` asks for.
//!
//! Limits: [`MOST_TRIANGLES`]. Nothing is read beside the given bytes: buffers outside a glTF file count as absent.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::outline::{self, ROWS};
use crate::base::{Diagnostic, Groups};
use crate::preset::plan::UpAxis;
use crate::source::scene;

/// Most triangles of a mesh.
const MOST_TRIANGLES: usize = 500_000;
/// Widest outline, in its heights.
const WIDEST: f32 = 16.0;

/// Why a file is no shape.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SolidError {
    /// Not a mesh or outline that can be read.
    #[error("{0}")]
    Unreadable(String),
    /// A mesh with a border.
    #[error("the mesh is not closed: {0} of its edges border an odd number of triangles")]
    Open(usize),
    /// Nothing inside.
    #[error("the shape is flat or empty")]
    Flat,
    /// Beyond the limits.
    #[error("the shape has {found} {what}; at most {most} are read")]
    TooLarge {
        /// How many there are.
        found: usize,
        /// Of what.
        what: &'static str,
        /// The limit.
        most: usize,
    },
}

/// How a file is read as a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ShapeReading {
    /// A closed mesh whose Y axis points up.
    MeshY,
    /// A closed mesh whose Z axis points up.
    MeshZ,
    /// An SVG silhouette to be revolved.
    Outline,
    /// An SVG silhouette as it is seen along z.
    Seen,
}

/// A file that a volume names, and how it is read.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ShapeFile {
    /// Its path, as the volume names it.
    pub file: String,
    /// How it is read.
    pub reading: ShapeReading,
}

/// The shapes of a species' volumes.
pub type Solids = BTreeMap<ShapeFile, Solid>;

/// A solid of height 1 that stands on the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Solid {
    body: Body,
    /// Bounds in x and z.
    bounds: [Vec2; 2],
}

#[derive(Clone, Debug, PartialEq)]
enum Body {
    Mesh(Columns),
    Profile { columns: usize, inside: Vec<bool> },
    Prism { columns: usize, inside: Vec<bool> },
}

impl Solid {
    /// A file's shape.
    ///
    /// # Errors
    ///
    /// When it can't be read, is open, flat or too large.
    pub fn read(bytes: &[u8], reading: ShapeReading) -> Result<Self, SolidError> {
        match reading {
            ShapeReading::MeshY => Self::from_mesh(bytes, UpAxis::Y),
            ShapeReading::MeshZ => Self::from_mesh(bytes, UpAxis::Z),
            ShapeReading::Outline => Self::from_outline(bytes),
            ShapeReading::Seen => Self::from_view(bytes),
        }
    }

    /// A closed mesh of any format that [`scene`](crate::source::scene) reads, told by its content. `up` says which axis of the file points up, `Detect` is Y. The
    /// file's vertical axis stays over the origin, so that a crown can lean to one side.
    ///
    /// # Errors
    ///
    /// When it can't be read, is open, flat or too large.
    pub fn from_mesh(bytes: &[u8], up: UpAxis) -> Result<Self, SolidError> {
        let told = |found: Vec<Diagnostic>| match found.first() {
            Some(Diagnostic { span: Some(span), message, .. }) => format!("line {}: {message}", span.line),
            Some(Diagnostic { message, .. }) => message.clone(),
            None => String::new(),
        };
        let scene =
            scene::read(bytes, "", &scene::Files::new()).map_err(|found| SolidError::Unreadable(told(found)))?;
        let (mut points, mut triangles): (Vec<Vec3>, Vec<[u32; 3]>) = (Vec::new(), Vec::new());
        for part in scene.parts {
            let first = points.len() as u32;
            points.extend(part.positions);
            triangles.extend(part.triangles.into_iter().map(|t| t.map(|corner| corner + first)));
        }
        if triangles.len() > MOST_TRIANGLES {
            let (found, what, most) = (triangles.len(), "triangles", MOST_TRIANGLES);
            return Err(SolidError::TooLarge { found, what, most });
        }
        if up == UpAxis::Z {
            points.iter_mut().for_each(|p| *p = Vec3::new(p.x, p.z, -p.y));
        }
        let (low, high) = bounds(triangles.iter().flatten().map(|&i| points[i as usize]));
        let size = high - low;
        if !(size.is_finite() && size.min_element() > 0.0) {
            return Err(SolidError::Flat);
        }
        points.iter_mut().for_each(|p| *p = (*p - Vec3::Y * low.y) / size.y);
        let bounds = [low, high].map(|p| Vec2::new(p.x, p.z) / size.y);
        if bounds.iter().any(|p| p.abs().max_element() > WIDEST) {
            return Err(SolidError::Flat);
        }
        Ok(Self { body: Body::Mesh(Columns::of(&points, &triangles, bounds)?), bounds })
    }

    /// An SVG silhouette, revolved about the vertical through the middle of its bounds. Every path counts as filled.
    ///
    /// # Errors
    ///
    /// When it can't be read, is flat or too large.
    pub fn from_outline(bytes: &[u8]) -> Result<Self, SolidError> {
        let (silhouettes, half) = fitted(bytes)?;
        let (columns, inside) = outline::profile(&silhouettes, half);
        if !inside.contains(&true) {
            return Err(SolidError::Flat);
        }
        Ok(Self { body: Body::Profile { columns, inside }, bounds: [Vec2::splat(-half), Vec2::splat(half)] })
    }

    /// An SVG silhouette as it is seen along z, x to the right; as deep as any shape may be. Every path counts as filled.
    ///
    /// # Errors
    ///
    /// When it can't be read, is flat or too large.
    pub fn from_view(bytes: &[u8]) -> Result<Self, SolidError> {
        let (silhouettes, half) = fitted(bytes)?;
        let (columns, inside) = outline::seen(&silhouettes, half);
        if !inside.contains(&true) {
            return Err(SolidError::Flat);
        }
        let reach = Vec2::new(half, WIDEST);
        Ok(Self { body: Body::Prism { columns, inside }, bounds: [-reach, reach] })
    }

    /// Whether a point lies inside.
    #[must_use]
    pub fn holds(&self, p: Vec3) -> bool {
        let flat = Vec2::new(p.x, p.z);
        let [low, high] = self.bounds;
        if !((0.0..=1.0).contains(&p.y) && flat.cmpge(low).all() && flat.cmple(high).all()) {
            return false;
        }
        let row = ((p.y * ROWS as f32) as usize).min(ROWS - 1);
        match &self.body {
            Body::Mesh(columns) => columns.hold(p),
            Body::Profile { columns, inside } => {
                let column = (flat.length() * ROWS as f32) as usize;
                column < *columns && inside[row * columns + column]
            }
            Body::Prism { columns, inside } => {
                let column = ((p.x - low.x) * ROWS as f32) as usize;
                column < *columns && inside[row * columns + column]
            }
        }
    }

    /// Least and greatest x and z, in its heights.
    #[must_use]
    pub fn bounds(&self) -> [Vec2; 2] {
        self.bounds
    }
}

/// The silhouettes of an SVG in heights, the middle of their bounds over x = 0; and how far they reach to either side.
fn fitted(bytes: &[u8]) -> Result<(Vec<outline::Silhouette>, f32), SolidError> {
    let mut silhouettes = outline::silhouettes(bytes)?;
    let points = silhouettes.iter().flat_map(|silhouette| silhouette.rings.iter().flatten());
    let (low, high) = bounds(points.map(|p| p.extend(0.0)));
    let size = high - low;
    if !(size.is_finite() && size.x > 0.0 && size.y > 0.0 && size.x <= size.y * 2.0 * WIDEST) {
        return Err(SolidError::Flat);
    }
    let half = size.x / (2.0 * size.y);
    // SVG's y runs down.
    let fit = |p: &Vec2| Vec2::new((p.x - (low.x + high.x) * 0.5) / size.y, (high.y - p.y) / size.y);
    for ring in silhouettes.iter_mut().flat_map(|silhouette| &mut silhouette.rings) {
        ring.iter_mut().for_each(|p| *p = fit(p));
    }
    Ok((silhouettes, half))
}

fn bounds(points: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}

/// Triangles by the cells of the ground that they cover.
#[derive(Clone, Debug, PartialEq)]
struct Columns {
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    low: Vec2,
    edge: f32,
    size: [u32; 2],
    cells: Groups,
}

impl Columns {
    fn of(points: &[Vec3], triangles: &[[u32; 3]], [low, high]: [Vec2; 2]) -> Result<Self, SolidError> {
        // Vertices split by normals or colours are one place.
        let mut places: BTreeMap<[u32; 3], u32> = BTreeMap::new();
        let mut welded: Vec<DVec3> = Vec::new();
        let mut weld = |corner: u32| {
            let p = points[corner as usize] + 0.0;
            *places.entry(p.to_array().map(f32::to_bits)).or_insert_with(|| {
                welded.push(p.as_dvec3());
                welded.len() as u32 - 1
            })
        };
        let mut sound: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(&mut weld)).collect();
        sound.retain(|[a, b, c]| a != b && b != c && c != a);
        let mut edges: Vec<(u32, u32)> =
            sound.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).map(|(a, b)| (a.min(b), a.max(b))).collect();
        edges.sort_unstable();
        let odd = edges.chunk_by(|a, b| a == b).filter(|same| same.len() % 2 == 1).count();
        if odd > 0 {
            return Err(SolidError::Open(odd));
        }
        let mut cells = ((sound.len() as f32).sqrt() as u32).clamp(1, 512);
        loop {
            let edge = ((high - low).max_element() / cells as f32).max(f32::MIN_POSITIVE);
            let size = (high - low).to_array().map(|extent| ((extent / edge) as u32).min(1023) + 1);
            let cell = |at: f32, low: f32, most: u32| (((at - low) / edge) as u32).min(most - 1);
            let covered = |t: &[u32; 3]| {
                let (from, to) = bounds(t.iter().map(|&i| welded[i as usize].as_vec3()));
                [
                    (cell(from.x, low.x, size[0]), cell(to.x, low.x, size[0])),
                    (cell(from.z, low.y, size[1]), cell(to.z, low.y, size[1])),
                ]
            };
            let area = |[(x0, x1), (z0, z1)]: [(u32, u32); 2]| (x1 - x0 + 1) as usize * (z1 - z0 + 1) as usize;
            let entries: usize = sound.iter().map(|t| area(covered(t))).sum();
            // Large triangles in fine cells: coarser ones.
            if cells > 1 && entries > sound.len() * 16 + 65_536 {
                cells /= 2;
                continue;
            }
            let each = |(i, t): (u32, &[u32; 3])| {
                let [(x0, x1), (z0, z1)] = covered(t);
                (z0..=z1).flat_map(move |z| (x0..=x1).map(move |x| (z * size[0] + x, i)))
            };
            let cells = Groups::of(size[0] as usize * size[1] as usize, (0..).zip(&sound).flat_map(each));
            return Ok(Self { points: welded, triangles: sound, low, edge, size, cells });
        }
    }

    fn hold(&self, p: Vec3) -> bool {
        let cell = |at: f32, low: f32, most: u32| (((at - low) / self.edge) as u32).min(most - 1);
        let (x, z) = (cell(p.x, self.low.x, self.size[0]), cell(p.z, self.low.y, self.size[1]));
        let column = (z * self.size[0] + x) as usize;
        let items = self.cells.get(column);
        let p = p.as_dvec3();
        items.iter().filter(|&&i| self.lies_above(self.triangles[i as usize], p)).count() % 2 == 1
    }

    /// Whether a triangle is met going straight up from a point.
    fn lies_above(&self, corners: [u32; 3], p: DVec3) -> bool {
        let mut inside = false;
        for k in 0..3 {
            // In one order, so that both triangles at an edge compute the same.
            let (a, b) = (corners[k].min(corners[(k + 1) % 3]), corners[k].max(corners[(k + 1) % 3]));
            let (a, b) = (self.points[a as usize], self.points[b as usize]);
            if (a.z > p.z) != (b.z > p.z) && p.x < a.x + (b.x - a.x) * ((p.z - a.z) / (b.z - a.z)) {
                inside = !inside;
            }
        }
        let [a, b, c] = corners.map(|i| self.points[i as usize]);
        let normal = (b - a).cross(c - a);
        // The plane above the point; a triangle on edge covers no ground.
        inside
            && normal.y != 0.0
            && a.y - (DVec2::new(p.x - a.x, p.z - a.z).dot(DVec2::new(normal.x, normal.z)) / normal.y) > p.y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBE: &str = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n\
        f 1 4 3 2\nf 5 6 7 8\nf 1/1 2/1 6/1 5/1\nf 3 4 8 7\nf 2 3 7 6\nf -8 -4 -1 -5\n";

    #[test]
    fn a_cube_holds_its_inside_and_nothing_else() {
        let cube = Solid::from_mesh(CUBE.as_bytes(), UpAxis::Detect).unwrap();
        assert_eq!(cube.bounds(), [Vec2::ZERO, Vec2::ONE]);
        let mut inside = 0;
        for i in 0..20_u32 {
            for j in 0..20_u32 {
                for k in 0..20_u32 {
                    // Corners, edges, diagonals of the faces: every third point lies on one.
                    let p = Vec3::new(i as f32, j as f32, k as f32) * 0.1 - Vec3::new(0.5, 0.4, 0.5);
                    let [within, beyond] =
                        [0.001, -0.001].map(|rim| p.to_array().map(|c| (rim..1.0 - rim).contains(&c)));
                    assert!(within != [true; 3] || cube.holds(p), "{p}");
                    assert!(beyond == [true; 3] || !cube.holds(p), "{p}");
                    inside += u32::from(cube.holds(p));
                }
            }
        }
        assert!(inside > 700);
    }

    #[test]
    fn up_can_be_z() {
        // A wedge whose thick end is at z = 2.
        let wedge =
            "v 0 0 0\nv 0 0 2\nv 1 0 2\nv 0 1 0\nv 0 1 2\nv 1 1 2\nf 1 3 2\nf 4 5 6\nf 1 2 5 4\nf 2 3 6 5\nf 3 1 4 6";
        let up_z = Solid::from_mesh(wedge.as_bytes(), UpAxis::Z).unwrap();
        assert!(up_z.holds(Vec3::new(0.45, 0.97, -0.25)) && !up_z.holds(Vec3::new(0.45, 0.05, -0.25)));
        assert!(up_z.holds(Vec3::new(0.01, 0.05, -0.25)) && !up_z.holds(Vec3::new(0.01, 0.05, 0.25)));
    }

    #[test]
    fn open_flat_and_broken_meshes_are_refused() {
        let open = CUBE.replace("f 5 6 7 8\n", "");
        assert_eq!(Solid::from_mesh(open.as_bytes(), UpAxis::Y), Err(SolidError::Open(4)));
        let flat = "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\nf 3 2 1";
        assert_eq!(Solid::from_mesh(flat.as_bytes(), UpAxis::Y), Err(SolidError::Flat));
        for broken in
            ["", "v 1 2\n", "v 0 0 0\nf 1 2 3", "f 9999999999999 1 1", "v nan 0 0", "glTF", "\u{1}", "f -1 -1 -1"]
        {
            let answer = Solid::from_mesh(broken.as_bytes(), UpAxis::Y);
            assert!(matches!(answer, Err(SolidError::Unreadable(_))), "{broken:?}: {answer:?}");
        }
        assert!(matches!(Solid::from_mesh(&[0xff, 0xfe, 0], UpAxis::Y), Err(SolidError::Unreadable(_))));
    }

    #[test]
    fn an_outline_is_revolved_about_its_middle() {
        // A triangle with its tip up, 20 wide and 40 high.
        let svg = br#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path d="M 10 60 L 30 60 L 20 20 Z"/></svg>"#;
        let cone = Solid::from_outline(svg).unwrap();
        assert!((cone.bounds()[1].x - 0.25).abs() < 1e-6);
        for (p, held) in [
            ([0.0, 0.9, 0.0], true),
            ([0.2, 0.1, 0.0], true),
            ([0.0, 0.1, -0.2], true),
            ([0.15, 0.1, 0.15], true),
            ([0.2, 0.5, 0.0], false),
            ([0.0, -0.1, 0.0], false),
            ([0.19, 0.1, 0.19], false),
        ] {
            assert_eq!(cone.holds(Vec3::from_array(p)), held, "{p:?}");
        }
    }

    #[test]
    fn holes_transforms_and_curves_of_outlines_count() {
        let svg =
            br#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><g transform="translate(5 5) scale(2)">
            <path fill-rule="evenodd" d="M 0 0 H 20 V 20 H 0 Z M 6 6 V 14 H 14 V 6 Z"/></g></svg>"#;
        let ring = Solid::from_outline(svg).unwrap();
        assert!(!ring.holds(Vec3::new(0.1, 0.5, 0.0)) && ring.holds(Vec3::new(0.35, 0.5, 0.0)));
        let disc =
            br#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><circle cx="50" cy="50" r="10"/></svg>"#;
        let ball = Solid::from_outline(disc).unwrap();
        let hits = (0..1000)
            .filter(|&i| {
                let s = crate::base::Seed::new(3).at(i);
                ball.holds(Vec3::new(s.at(0).unit() - 0.5, s.at(1).unit(), s.at(2).unit() - 0.5))
            })
            .count();
        // π/6 of the cube.
        assert!((480..570).contains(&hits), "{hits}");
    }

    #[test]
    fn broken_outlines_are_refused() {
        for broken in ["", "<svg", "<svg xmlns=\"http://www.w3.org/2000/svg\"/>", "\u{1f}\u{8b}"] {
            assert!(Solid::from_outline(broken.as_bytes()).is_err(), "{broken:?}");
        }
        let line = br#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><path stroke="red" d="M 1 1 H 5 H 3"/></svg>"#;
        assert!(Solid::from_outline(line).is_err());
    }
}
