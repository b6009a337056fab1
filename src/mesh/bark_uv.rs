//! The scale of bark: as many texels a metre on every branch of a tree, within a fifth, around and along alike.
//!
//! Bark that goes round each branch a whole number of times closes without a seam, but on a twig a twentieth as thick as the
//! trunk it is twenty times as fine, and is no longer the trunk's bark. Tools for trees choose one of the two by hand. Here
//! the scale comes first, and the texture closes wherever that costs less than a fifth:
//!
//! - The scale is the trunk's: the tile nearest to the one that is asked for with which the bark closes there. A trunk whose
//!   girth is below a tile has its whole bark in that girth.
//! - Wood takes a whole number of repeats while that is between [`LEAST`] and [`MOST`] of what its girth asks for. Between
//!   these stretches the number runs from one to the next along the wood, so nothing jumps, and below one repeat it is the
//!   girth itself: there the texture does not close, and a seam runs along the branch, on its upper side, where it is
//!   seen the least from the ground. It is a change of picture, not of shading: normals go on.
//! - Along wood there are as many repeats a metre everywhere, counted on its skin, which a flare has more of than its axis. While they
//!   were as many as go round, bark that is a sixth finer there had no room left for bends.
//! - A stem's flare goes round as often as the wood above it; it is the one place that is coarser than a fifth allows.
//! - At a bend the inner side is shorter than the outer: bark runs ahead there ([`Bend`]), so that it is neither crushed nor
//!   stretched, as far as it then leans no more than a fifth allows. No map of a ring that is bent has neither.
//! - Where a branch begins in wood that is thinner than it, bark goes round what is left of its first ring ([`drawn_in`]).
//!
//! Mirrored repeats have no seam at any scale; they were dropped, since a trunk that is its own mirror image is seen from
//! afar, a seam from near by. Changing the number at a ring of vertices shows as a ring all round the branch.

use glam::{Vec2, Vec3};

use crate::base::Frame;
use crate::plant::{Plant, Posed};

/// The fewest and most repeats round wood, as shares of what its girth asks for, with which a whole number is taken.
const LEAST: f32 = 1.0 / 1.2;
const MOST: f32 = 1.0 / 0.86;
/// Nor is a whole number taken farther from what the girth asks for than this, so that there is room to get to the next.
const NEAR: f32 = 0.4;
/// Below this share of a tile round wood takes what its girth asks for.
const OPEN: f32 = 0.6;
/// The girth of the trunk in tiles over its whole number: near the upper end of what that number is taken for, since wood
/// gets thinner from there.
const TRUNK: f32 = 1.1;
/// Where along the thickest stem its girth is taken: above a flare.
pub(super) const ABOVE: f64 = 0.08;

/// How far bark leans at most to make up for a bend, along over around. More makes what runs along it longer than it makes even.
const LEANS: f32 = 0.2;
/// After how much wood half of a lean is gone, radii.
const FADES: f32 = 12.0;

/// How far bark runs ahead on one side of the wood of what it does on the axis.
///
/// A ring's side towards which the axis has turned by an angle is nearer to the base by that angle times the radius. The sum of these
/// fades, or bark would lean on after each bend.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bend(Vec2);

impl Bend {
    /// The next ring: its direction, seen from the frame of the ring before, and how far from that it is, in radii.
    pub(super) fn step(&mut self, before: Frame, tangent: Vec3, radii: f32) {
        let turned = Vec2::new(tangent.dot(before.x), -tangent.dot(before.z));
        self.0 = (self.0 / (1.0 + radii / FADES) + turned).clamp_length_max(LEANS);
    }

    /// Radii that bark at a corner of the ring runs ahead; `corner` is the corner's sine and cosine.
    pub(super) fn ahead(self, (sin, cos): (f32, f32)) -> f32 {
        self.0.x * cos + self.0.y * sin
    }
}

/// Lets the bark of a ring whose corners were drawn in go round what is left of it as often a metre as it went round `girth`
/// metres, from the side that lies opposite the seam. Bark that closes there stays.
pub(super) fn drawn_in(places: &[Vec3], uvs: &mut [Vec2], girth: f32) {
    let (Some(first), Some(last)) = (uvs.first(), uvs.last()) else { return };
    let around = last.x - first.x;
    if around >= 1.0 && around.fract() == 0.0 {
        return;
    }
    let left: f32 = places.array_windows().map(|[a, b]| a.distance(*b)).sum();
    let density = around / girth.max(1e-6);
    let mut u = -0.5 * left * density;
    for (i, uv) in uvs.iter_mut().enumerate() {
        if i > 0 {
            u += places[i - 1].distance(places[i]) * density;
        }
        uv.x = u;
    }
}

/// The scale of a plant's bark.
#[derive(Clone, Copy, Debug)]
pub(super) struct BarkScale {
    /// Metres.
    tile: f32,
}

impl BarkScale {
    /// The scale at which bark closes round the thickest stem, with tiles about as large as asked for, metres.
    pub(super) fn of(plant: &Plant, posed: &Posed, tile: f32) -> Self {
        let tile = tile.max(1e-3);
        let stem = |id: &crate::plant::ChainId| plant.chain(*id).parent.is_none();
        let radius = |id| posed.curve(plant, id).value(plant.radii(id), ABOVE).min(plant.radii(id)[0].max(1e-6));
        let thickest = plant.chain_ids().filter(stem).map(radius).fold(0.0_f32, f32::max);
        let girth = std::f32::consts::TAU * thickest;
        if !(girth > 1e-5 && girth.is_finite()) {
            return Self { tile };
        }
        Self { tile: girth / (TRUNK * (girth / (TRUNK * tile)).round().max(1.0)) }
    }

    /// How often bark goes round wood of some girth, metres.
    pub(super) fn around(self, girth: f32) -> f32 {
        let asked = girth / self.tile;
        let from = |n: f32| (n * MOST.recip()).max(n - NEAR);
        let to = |n: f32| (n * LEAST.recip()).min(n + NEAR);
        // The whole number whose stretch the girth is in or before, and the one before.
        let below = asked.floor();
        let n = if asked <= to(below) { below } else { below + 1.0 };
        let (x0, y0) = if n <= 1.0 { (OPEN, OPEN) } else { (to(n - 1.0), n - 1.0) };
        if asked >= from(n) {
            n
        } else if asked <= x0 {
            asked.max(0.0)
        } else {
            y0 + (n - y0) * (asked - x0) / (from(n) - x0)
        }
    }

    /// Repeats a metre along wood of any girth.
    pub(super) fn along(self) -> f32 {
        1.0 / self.tile
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::math;
    use crate::plant::PlantBuilder;

    #[test]
    fn repeats_keep_within_a_fifth_never_jump_and_are_whole_where_they_can() {
        let scale = BarkScale { tile: 1.0 };
        let (mut whole, mut before) = (0, 0.0);
        for step in 1..=6000 {
            let girth = step as f32 * 0.001;
            let around = scale.around(girth);
            let off = around / girth;
            assert!((1.0 / 1.2 - 1e-3..=1.0 / 0.86 + 1e-3).contains(&off), "{girth} {around}");
            assert!(around >= before - 1e-5 && around - before < 0.02, "{girth} {around}");
            whole += usize::from(girth > 0.86 && around.fract() == 0.0);
            before = around;
        }
        assert!(whole > 3500, "{whole}");
    }

    /// The least and most repeats a metre along the sides of a tube that bends a tenth of a radian to the right and to the left, again and again.
    fn along_a_bend(bends: bool) -> (f32, f32) {
        let (radius, step) = (0.5, 0.2);
        let (mut frame, mut bend) = (Frame::WORLD, Bend::default());
        let (mut centre, mut before) = (Vec3::ZERO, None);
        let (mut least, mut most) = (f32::MAX, 0.0_f32);
        for j in 0..40 {
            let angle = 0.1 * math::sin(j as f32 * 0.5);
            let tangent = Vec3::new(math::sin(angle), math::cos(angle), 0.0);
            if bends {
                bend.step(frame, tangent, step / radius);
            }
            frame = frame.transported(tangent);
            centre += tangent * step;
            let corners = [(0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0)];
            let ring = corners.map(|(sin, cos)| {
                let place = centre + (frame.x * cos - frame.z * sin) * radius;
                (place, bend.ahead((sin, cos)) * radius - j as f32 * step)
            });
            if let Some(old) = before.replace(ring) {
                let density = |((p, v), (q, w)): (&(Vec3, f32), &(Vec3, f32))| (v - w) / p.distance(*q);
                let all = old.iter().zip(&ring).map(density);
                (least, most) = all.fold((least, most), |(a, b), d| (a.min(d), b.max(d)));
            }
        }
        (least, most)
    }

    #[test]
    fn bends_crush_and_stretch_bark_less_than_rings_at_one_height_would() {
        let ((a, b), (c, d)) = (along_a_bend(false), along_a_bend(true));
        assert!(a < 0.92 && b > 1.1, "{a} {b}");
        assert!(1.0 - c < (1.0 - a) * 0.6 && d - 1.0 < (b - 1.0) * 0.6, "{a} {b}, {c} {d}");
    }

    #[test]
    fn bark_goes_round_what_is_left_of_a_ring_unless_it_closes() {
        let square = |size: f32| {
            [(-1.0, 0.0), (0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)].map(|(x, z)| Vec3::new(x, 0.0, z) * size)
        };
        let girth = square(1.0).array_windows().map(|[a, b]| a.distance(*b)).sum();
        for (around, expected) in [(0.5, 0.3), (1.2, 0.72), (2.0, 2.0)] {
            let mut uvs = [0.0, 0.25, 0.5, 0.75, 1.0].map(|k| Vec2::new(around * (k - 0.5), 0.4));
            drawn_in(&square(0.6), &mut uvs, girth);
            assert!((uvs[4].x - uvs[0].x - expected).abs() < 1e-5 && uvs[2].x.abs() < 1e-5, "{uvs:?}");
            assert!(uvs.iter().all(|uv| uv.y == 0.4));
        }
    }

    #[test]
    fn the_trunk_closes_whatever_its_girth() {
        for radius in [0.004_f32, 0.05, 0.21, 0.3, 0.77, 2.0] {
            let mut builder = PlantBuilder::new();
            builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 9.0], &[radius, radius]);
            let plant = builder.finish().unwrap();
            let scale = BarkScale::of(&plant, &plant.pose(), 1.5);
            let around = scale.around(std::f32::consts::TAU * radius);
            assert!(around >= 1.0 && around.fract() == 0.0, "{radius} {around}");
            assert!(scale.tile < 1.5 * 1.4, "{radius} {}", scale.tile);
        }
    }
}
