//! The volumes that early endpoints fill (2015, 3.2.2): whether one holds a point, and how much of it there is.

use glam::{Vec2, Vec3};

use super::solid::{ShapeFile, ShapeReading, Solid, Solids};
use crate::preset::plan::{UpAxis, Volume};

/// Points along the longest edge of the lattice by which a volume is measured.
const MEASURED: f32 = 64.0;

/// The shape of the files that a volume names.
#[derive(Clone, Copy, Debug)]
pub(super) enum Filed<'s> {
    /// Of one file.
    One(&'s Solid),
    /// What is seen from the front, along z, and from the side, along x from its greater end: the visual hull of both.
    Hull { front: &'s Solid, side: &'s Solid },
}

impl Filed<'_> {
    fn holds(&self, p: Vec3) -> bool {
        match self {
            Self::One(solid) => solid.holds(p),
            Self::Hull { front, side } => front.holds(p) && side.holds(Vec3::new(-p.z, p.y, 0.0)),
        }
    }

    fn bounds(&self) -> [Vec2; 2] {
        match self {
            Self::One(solid) => solid.bounds(),
            Self::Hull { front, side } => {
                let ([low, high], [back, fore]) = (front.bounds(), side.bounds());
                [Vec2::new(low.x, -fore.x), Vec2::new(high.x, -back.x)]
            }
        }
    }
}

/// Whether a volume holds a point; lengths in plant heights. `solid` is what [`solid`] gives.
pub(super) fn holds(shape: &Volume, solid: Option<Filed<'_>>, p: Vec3) -> bool {
    let out = p.x * p.x + p.z * p.z;
    // Distance from the centre in units of the half axes; 0 / 0 is NaN and lies in no range.
    let ball = |centre: f32, half: f32, radius: f32, hollow: f32| {
        let up = (p.y - centre) / half;
        let reach = (up * up + out / (radius * radius)).sqrt();
        (hollow..=1.0).contains(&reach)
    };
    let between = |bottom: f32, top: f32| (bottom..=top).contains(&p.y);
    // Distance from the axis as a share of the radius at this height.
    let ring = |radius: f32, hollow: f32| (hollow..=1.0).contains(&(out.sqrt() / radius));
    match *shape {
        Volume::Point { .. } => false,
        Volume::Ellipsoid { bottom, top, radius, hollow } => {
            ball((bottom + top) * 0.5, (top - bottom) * 0.5, radius, hollow)
        }
        Volume::HalfEllipsoid { bottom, top, radius, hollow } => {
            p.y >= bottom && ball(bottom, top - bottom, radius, hollow)
        }
        Volume::Cone { bottom, top, radius, hollow } => {
            between(bottom, top) && ring(radius * (top - p.y) / (top - bottom), hollow)
        }
        Volume::Cylinder { bottom, top, radius, hollow } => between(bottom, top) && ring(radius, hollow),
        Volume::Box { bottom, top, width, depth, hollow } => {
            let reach = (p.x.abs() / (width * 0.5)).max(p.z.abs() / (depth * 0.5));
            between(bottom, top) && (hollow..=1.0).contains(&reach)
        }
        Volume::Mesh { bottom, top, .. } | Volume::Outline { bottom, top, .. } => {
            top > bottom && solid.is_some_and(|solid| solid.holds((p - Vec3::Y * bottom) / (top - bottom)))
        }
    }
}

/// What a volume is called in a species file.
pub(super) fn name(shape: &Volume) -> &'static str {
    match shape {
        Volume::Point { .. } => "Point",
        Volume::Ellipsoid { .. } => "Ellipsoid",
        Volume::HalfEllipsoid { .. } => "HalfEllipsoid",
        Volume::Cone { .. } => "Cone",
        Volume::Cylinder { .. } => "Cylinder",
        Volume::Box { .. } => "Box",
        Volume::Mesh { .. } => "Mesh",
        Volume::Outline { .. } => "Outline",
    }
}

/// The files that a volume names, and how they are to be read: one, or that from the front and that from the side.
pub(super) fn files(shape: &Volume) -> Vec<ShapeFile> {
    let read = |file: &String, reading| ShapeFile { file: file.clone(), reading };
    match shape {
        Volume::Mesh { file, up: UpAxis::Z, .. } => vec![read(file, ShapeReading::MeshZ)],
        Volume::Mesh { file, .. } => vec![read(file, ShapeReading::MeshY)],
        Volume::Outline { file, side: None, .. } => vec![read(file, ShapeReading::Outline)],
        Volume::Outline { file, side: Some(side), .. } => [file, side].map(|f| read(f, ShapeReading::Seen)).to_vec(),
        _ => Vec::new(),
    }
}

/// The shape of the files that a volume names; none of others, and where one is not there.
pub(super) fn solid<'s>(shape: &Volume, solids: &'s Solids) -> Option<Filed<'s>> {
    match files(shape).as_slice() {
        [file] => solids.get(file).map(Filed::One),
        [front, side] => solids.get(front).zip(solids.get(side)).map(|(front, side)| Filed::Hull { front, side }),
        _ => None,
    }
}

/// How much of a volume lies in the graph's region, a cylinder of height 1 and diameter `width`; cubic plant heights.
/// Measured on a lattice, whatever the shape; within 3 %.
pub(super) fn measure(shape: &Volume, solids: &Solids, width: f32) -> f32 {
    let half = Vec3::new(width, 1.0, width) * 0.5;
    let solid = solid(shape, solids);
    let (low, high) = extent(shape, solid);
    let (low, high) = (low.max(Vec3::new(-half.x, 0.0, -half.z)), high.min(Vec3::new(half.x, 1.0, half.z)));
    let mut inside = 0_u32;
    let edge = on_lattice(low, high, |p, _| {
        inside += u32::from(p.x * p.x + p.z * p.z <= half.x * half.x && holds(shape, solid, p));
    });
    inside as f32 * edge.x * edge.y * edge.z
}

/// What of a volume lies beside the graph's region, which is `width` wide: which share of it, and how wide a region holds all
/// of it. None where nothing does, or less than a thousandth.
pub(super) fn beside(shape: &Volume, solids: &Solids, width: f32) -> Option<(f32, f32)> {
    let solid = solid(shape, solids);
    let (low, high) = extent(shape, solid);
    let corner = low.abs().max(high.abs());
    let radius = width * 0.5 + 1e-6;
    if corner.x * corner.x + corner.z * corner.z <= radius * radius {
        return None;
    }
    let (low, high) = (low.with_y(low.y.max(0.0)), high.with_y(high.y.min(1.0)));
    let (mut inside, mut beyond, mut farthest) = (0_u32, 0_u32, 0.0_f32);
    on_lattice(low, high, |p, edge| {
        if holds(shape, solid, p) {
            inside += 1;
            beyond += u32::from(p.x * p.x + p.z * p.z > radius * radius);
            let (x, z) = (p.x.abs() + edge.x * 0.5, p.z.abs() + edge.z * 0.5);
            farthest = farthest.max((x * x + z * z).sqrt());
        }
    });
    let share = beyond as f32 / inside.max(1) as f32;
    (share >= 1e-3).then_some((share, farthest * 2.0))
}

/// Asks at the middles of a lattice's cells in a box; gives back the size of a cell, zero where the box is flat.
fn on_lattice(low: Vec3, high: Vec3, mut at: impl FnMut(Vec3, Vec3)) -> Vec3 {
    let size = high - low;
    if !(size.min_element() > 0.0 && size.is_finite()) {
        return Vec3::ZERO;
    }
    let edge = size.max_element() / MEASURED;
    let cells = (size / edge).ceil().max(Vec3::ONE);
    let edge = size / cells;
    for y in 0..cells.y as u32 {
        for z in 0..cells.z as u32 {
            for x in 0..cells.x as u32 {
                at(low + (Vec3::new(x as f32, y as f32, z as f32) + 0.5) * edge, edge);
            }
        }
    }
    edge
}

/// A box around a volume.
fn extent(shape: &Volume, solid: Option<Filed<'_>>) -> (Vec3, Vec3) {
    let upright = |bottom: f32, top: f32, x: f32, z: f32| (Vec3::new(-x, bottom, -z), Vec3::new(x, top, z));
    match *shape {
        Volume::Point { height, .. } => (Vec3::Y * height, Vec3::Y * height),
        Volume::Ellipsoid { bottom, top, radius, .. }
        | Volume::HalfEllipsoid { bottom, top, radius, .. }
        | Volume::Cone { bottom, top, radius, .. }
        | Volume::Cylinder { bottom, top, radius, .. } => upright(bottom, top, radius, radius),
        Volume::Box { bottom, top, width, depth, .. } => upright(bottom, top, width * 0.5, depth * 0.5),
        Volume::Mesh { bottom, top, .. } | Volume::Outline { bottom, top, .. } => {
            let [low, high] = solid.map(|solid| solid.bounds().map(|p| p * (top - bottom))).unwrap_or_default();
            (Vec3::new(low.x, bottom, low.y), Vec3::new(high.x, top, high.y))
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;

    fn held(shape: &Volume, x: f32, y: f32, z: f32) -> bool {
        holds(shape, None, Vec3::new(x, y, z))
    }

    #[test]
    fn volumes_hold_what_they_should() {
        let half = Volume::HalfEllipsoid { bottom: 0.3, top: 0.9, radius: 0.5, hollow: 0.5 };
        assert!(held(&half, 0.4, 0.31, 0.0) && held(&half, 0.0, 0.85, 0.0));
        assert!(!held(&half, 0.4, 0.29, 0.0) && !held(&half, 0.1, 0.4, 0.0));
        let cone = Volume::Cone { bottom: 0.2, top: 1.0, radius: 0.4, hollow: 0.5 };
        assert!(held(&cone, 0.0, 0.6, 0.19) && !held(&cone, 0.0, 0.6, 0.21) && !held(&cone, 0.0, 0.6, 0.09));
        let flat = Volume::Ellipsoid { bottom: 0.5, top: 0.5, radius: 0.0, hollow: 0.0 };
        assert!(!held(&flat, 0.0, 0.5, 0.0));
        assert!(held(&Volume::Cylinder { bottom: 0.0, top: 0.2, radius: 0.1, hollow: 0.0 }, 0.0, 0.0, 0.0));
        let tub = Volume::Box { bottom: 0.1, top: 0.2, width: 1.0, depth: 0.2, hollow: 0.0 };
        assert!(held(&tub, 0.49, 0.15, 0.09) && !held(&tub, 0.49, 0.15, 0.11) && !held(&tub, 0.51, 0.15, 0.0));
        let wall = Volume::Box { bottom: 0.1, top: 0.2, width: 1.0, depth: 1.0, hollow: 0.8 };
        assert!(held(&wall, 0.0, 0.15, 0.45) && !held(&wall, 0.3, 0.15, 0.3));
        assert!(!held(&Volume::Point { height: 0.5, out: 0.0, turn: None }, 0.0, 0.5, 0.0));
    }

    #[test]
    fn a_mesh_stands_between_its_heights() {
        let cube = "v -1 0 -1\nv 1 0 -1\nv 1 2 -1\nv -1 2 -1\nv -1 0 1\nv 1 0 1\nv 1 2 1\nv -1 2 1\n\
            f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n";
        let file = ShapeFile { file: "c.obj".to_owned(), reading: ShapeReading::MeshY };
        let solids = Solids::from([(file, Solid::read(cube.as_bytes(), ShapeReading::MeshY).unwrap())]);
        let shape = Volume::Mesh { file: "c.obj".to_owned(), up: UpAxis::Y, bottom: 0.4, top: 0.8 };
        let at = |x, y, z| holds(&shape, solid(&shape, &solids), Vec3::new(x, y, z));
        assert!(at(0.19, 0.41, -0.19) && at(-0.1, 0.79, 0.0));
        assert!(!at(0.21, 0.6, 0.0) && !at(0.0, 0.39, 0.0) && !at(0.0, 0.81, 0.0));
        assert!((measure(&shape, &solids, 2.0) - 0.064).abs() < 0.002);
        // The same file read otherwise is another shape.
        let upright = Volume::Mesh { file: "c.obj".to_owned(), up: UpAxis::Z, bottom: 0.4, top: 0.8 };
        assert!(solid(&upright, &solids).is_none() && !holds(&upright, None, Vec3::Y * 0.6));
    }

    #[test]
    fn a_hull_is_what_lies_inside_of_both_views() {
        // From the front a triangle whose right angle is on the left; from the side, where left is +z, a strip half as wide.
        let front = "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 9 9'><path d='M0 0 L0 8 L8 8 Z'/></svg>";
        let side = "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 9 9'><path d='M0 0 H4 V8 H0 Z M3 1 H4 V2 H3 Z' \
            fill-rule='evenodd'/></svg>";
        let file = |name: &str| ShapeFile { file: name.to_owned(), reading: ShapeReading::Seen };
        let read = |text: &str| Solid::read(text.as_bytes(), ShapeReading::Seen).unwrap();
        let solids = Solids::from([(file("front.svg"), read(front)), (file("side.svg"), read(side))]);
        let side = Some("side.svg".to_owned());
        let shape = Volume::Outline { file: "front.svg".to_owned(), side, bottom: 0.2, top: 0.6 };
        let at = |x, y, z| holds(&shape, solid(&shape, &solids), Vec3::new(x, y, z));
        assert!(at(-0.19, 0.55, 0.0) && at(0.15, 0.22, 0.09) && at(0.0, 0.3, -0.09));
        assert!(!at(0.1, 0.55, 0.0) && !at(0.0, 0.3, 0.11) && !at(0.0, 0.3, -0.11) && !at(0.0, 0.61, 0.0));
        // The notch is at the right of the side's picture, where z is least.
        assert!(!at(-0.19, 0.525, -0.09) && at(-0.19, 0.525, 0.09));
        assert!((measure(&shape, &solids, 2.0) - 0.08 * 0.2).abs() < 0.001, "{}", measure(&shape, &solids, 2.0));
        // With one of its files it holds nothing.
        let lone = Solids::from([(file("front.svg"), read(front))]);
        assert!(solid(&shape, &lone).is_none());
    }

    #[test]
    fn what_a_region_cuts_off_is_measured_with_the_width_that_holds_it() {
        let of = |width, depth| Volume::Box { bottom: 0.1, top: 0.9, width, depth, hollow: 0.0 };
        let (share, wide) = beside(&of(1.0, 1.0), &Solids::new(), 1.0).unwrap();
        assert!((share - (1.0 - PI * 0.25)).abs() < 0.01 && (wide - 2.0_f32.sqrt()).abs() < 1e-3, "{share} {wide}");
        assert_eq!(beside(&of(0.7, 0.7), &Solids::new(), 1.0), None);
        assert_eq!(beside(&of(1.0, 1.0), &Solids::new(), 1.4143), None);
        // A file's own reach counts, as large as it stands there: a strip of 2 by 1, revolved.
        let text = "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 9 9'><path d='M0 0 H8 V4 H0 Z'/></svg>";
        let file = ShapeFile { file: "s.svg".to_owned(), reading: ShapeReading::Outline };
        let solids = Solids::from([(file, Solid::read(text.as_bytes(), ShapeReading::Outline).unwrap())]);
        let of = |top| Volume::Outline { file: "s.svg".to_owned(), side: None, bottom: 0.2, top };
        let (share, wide) = beside(&of(0.7), &solids, 0.8).unwrap();
        assert!((share - 0.36).abs() < 0.02 && (wide - 1.0).abs() < 0.03, "{share} {wide}");
        assert_eq!(beside(&of(0.6), &solids, 0.81), None);
    }

    #[test]
    fn volumes_measure_what_geometry_says() {
        let none = Solids::new();
        for (shape, expected) in [
            (Volume::Ellipsoid { bottom: 0.2, top: 0.8, radius: 0.4, hollow: 0.0 }, 4.0 / 3.0 * PI * 0.3 * 0.16),
            (
                Volume::Ellipsoid { bottom: 0.2, top: 0.8, radius: 0.4, hollow: 0.5 },
                4.0 / 3.0 * PI * 0.3 * 0.16 * 0.875,
            ),
            (Volume::HalfEllipsoid { bottom: 0.2, top: 0.8, radius: 0.4, hollow: 0.0 }, 2.0 / 3.0 * PI * 0.6 * 0.16),
            (Volume::Cone { bottom: 0.1, top: 1.0, radius: 0.3, hollow: 0.0 }, PI * 0.09 * 0.3),
            (Volume::Cylinder { bottom: 0.1, top: 1.0, radius: 0.3, hollow: 0.0 }, PI * 0.09 * 0.9),
            (Volume::Box { bottom: 0.1, top: 0.3, width: 0.5, depth: 0.2, hollow: 0.0 }, 0.02),
            (Volume::Point { height: 0.5, out: 0.0, turn: None }, 0.0),
            // Half of it lies under the ground.
            (Volume::Ellipsoid { bottom: -0.4, top: 0.4, radius: 0.4, hollow: 0.0 }, 2.0 / 3.0 * PI * 0.064),
        ] {
            let measured = measure(&shape, &none, 2.0);
            assert!((measured - expected).abs() <= expected * 0.03, "{shape:?}: {measured}, not {expected}");
        }
    }
}
