//! Leaves as textured cards.
//!
//! Normals are mostly the crown's ([`super::canopy`]). Engines turn a double-sided card's normal round on its
//! back; so that this never shows from outside, the side that looks out of the crown is made the front.

use glam::{Vec2, Vec3};

use super::canopy::{Canopy, is_turned, share_of};
use super::cut::{CardCut, Pattern};
use super::{CrownLight, Mesh};
use crate::base::math;
use crate::plant::{Leaf, LeafForm, Plant, Posed};
use crate::preset::plan::LeafCards;

/// How far the halves of a folded card lean back, radians.
const FOLD: f32 = 0.38;
/// How far the tip of a bent card turns down where it lies level, radians.
const ARCH: f32 = 1.1;

/// One leaf to be meshed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeafCard {
    /// Index into the plant's leaves.
    pub leaf: usize,
    /// Its size as a factor of the leaf's own.
    pub scale: f32,
}

/// The shape of a card.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CardShape {
    /// A square of two triangles.
    Flat,
    /// Folded along the middle: four triangles, seen from every side.
    Folded,
    /// Arched to the tip and folded a little: eight triangles.
    Bent,
    /// Folded and cut to its picture's outline; cards of leaves that are flat are cut too.
    CutOut,
    /// Flat and cut to an outline of few corners: what [`CutOut`](Self::CutOut) is from afar.
    Trimmed,
}

/// What leaves are drawn on.
#[derive(Clone, Copy, Debug)]
pub struct Cards<'a> {
    /// The shape of all cards, but of leaves that are flat or fronds.
    pub shape: CardShape,
    /// The outlines that cards are cut to, by the slots of leaves; a picture without one is drawn whole.
    pub cuts: &'a [CardCut],
}

impl From<CardShape> for Cards<'_> {
    fn from(shape: CardShape) -> Self {
        Self { shape, cuts: &[] }
    }
}

/// What one card is made of.
struct Plan<'a> {
    corners: &'a [(f32, f32)],
    triangles: &'a [u32],
    /// How far its halves lean back, radians.
    fold: f32,
    /// How far its tip turns down where it lies level, radians.
    arch: f32,
}

const FLAT: Plan<'_> = Plan {
    corners: &[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)],
    triangles: &[0, 1, 2, 0, 2, 3],
    fold: 0.0,
    arch: 0.0,
};
const FOLDED: Plan<'_> = Plan {
    corners: &[(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 1.0), (0.5, 1.0), (0.0, 1.0)],
    triangles: &[0, 1, 4, 0, 4, 5, 1, 2, 3, 1, 3, 4],
    fold: FOLD,
    arch: 0.0,
};
#[rustfmt::skip]
const BENT: Plan<'_> = Plan {
    corners: &[(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (0.0, 0.5), (0.5, 0.5), (1.0, 0.5), (0.0, 1.0), (0.5, 1.0), (1.0, 1.0)],
    triangles: &[0, 1, 4, 0, 4, 3, 1, 2, 4, 2, 5, 4, 3, 4, 7, 3, 7, 6, 4, 5, 7, 5, 8, 7],
    fold: FOLD * 0.6,
    arch: ARCH,
};

/// Fronds are bent by themselves, on all levels.
const FROND: Plan<'_> = Plan {
    corners: &{
        let mut corners = [(0.0, 0.0); 15];
        let mut i = 0;
        while i < 15 {
            corners[i] = ((i % 3) as f32 * 0.5, (i / 3) as f32 * 0.25);
            i += 1;
        }
        corners
    },
    #[rustfmt::skip]
    triangles: &[
        0, 1, 4, 0, 4, 3, 1, 2, 4, 2, 5, 4, 3, 4, 7, 3, 7, 6, 4, 5, 7, 5, 8, 7,
        6, 7, 10, 6, 10, 9, 7, 8, 10, 8, 11, 10, 9, 10, 13, 9, 13, 12, 10, 11, 13, 11, 14, 13,
    ],
    fold: 0.0,
    arch: 0.0,
};
/// Not folded any more, of eight triangles and of six: a frond's bend is seen from afar, its fold is not. Few of them make a crown, so
/// that all must fit into two fifths of the triangles.
const FROND_COARSE: Plan<'_> =
    Plan { corners: &strip::<10>(), triangles: &strip_triangles::<24>(), fold: 0.0, arch: 0.0 };
const FROND_FLAT: Plan<'_> = Plan { corners: &strip::<8>(), triangles: &strip_triangles::<18>(), fold: 0.0, arch: 0.0 };

/// The corners of a strip, two a row, from its base.
const fn strip<const N: usize>() -> [(f32, f32); N] {
    let mut corners = [(0.0, 0.0); N];
    let mut i = 0;
    while i < N {
        corners[i] = ((i % 2) as f32, (i / 2) as f32 / (N / 2 - 1) as f32);
        i += 1;
    }
    corners
}

/// Two triangles between each row of a strip and the next.
const fn strip_triangles<const N: usize>() -> [u32; N] {
    let mut triangles = [0; N];
    let mut row = 0;
    while row < N / 6 {
        let a = 2 * row as u32;
        let of = [a, a + 1, a + 3, a, a + 3, a + 2];
        let mut k = 0;
        while k < 6 {
            triangles[6 * row + k] = of[k];
            k += 1;
        }
        row += 1;
    }
    triangles
}

impl<'a> Cards<'a> {
    /// What a preset asks for.
    #[must_use]
    pub const fn of(leaves: LeafCards, cuts: &'a [CardCut]) -> Self {
        let shape = match leaves {
            LeafCards::Flat => CardShape::Flat,
            LeafCards::Folded => CardShape::Folded,
            LeafCards::Bent => CardShape::Bent,
            LeafCards::CutOut { .. } => CardShape::CutOut,
        };
        Self { shape, cuts }
    }

    /// The next simpler cards, for levels of detail; none after flat ones.
    #[must_use]
    pub const fn simpler(self) -> Option<Self> {
        let shape = match self.shape {
            CardShape::Flat => return None,
            CardShape::Folded | CardShape::Trimmed => CardShape::Flat,
            CardShape::Bent => CardShape::Folded,
            CardShape::CutOut => CardShape::Trimmed,
        };
        Some(Self { shape, ..self })
    }

    /// The simplest.
    pub(crate) fn simplest(self) -> Self {
        std::iter::successors(Some(self), |cards| cards.simpler()).last().unwrap_or(self)
    }

    /// Triangles of a leaf's card.
    #[must_use]
    pub fn triangles(&self, leaf: &Leaf) -> usize {
        self.plan(leaf).triangles.len() / 3
    }

    fn plan(&self, leaf: &Leaf) -> Plan<'a> {
        if let LeafForm::Frond { .. } = leaf.form {
            return match self.shape {
                CardShape::Folded | CardShape::Bent | CardShape::CutOut => FROND,
                CardShape::Trimmed => FROND_COARSE,
                CardShape::Flat => FROND_FLAT,
            };
        }
        let is_flat = matches!(leaf.form, LeafForm::Flat(_));
        let cut = self.cuts.get(usize::from(leaf.slot));
        let of = |pattern: &'a Pattern, fold| Plan {
            corners: &pattern.corners,
            triangles: &pattern.triangles,
            fold,
            arch: 0.0,
        };
        match (self.shape, cut) {
            (CardShape::CutOut, Some(cut)) if is_flat => of(&cut.flat, 0.0),
            (CardShape::CutOut, Some(cut)) => of(&cut.folded, FOLD),
            (CardShape::Trimmed, Some(cut)) => of(&cut.trimmed, 0.0),
            (CardShape::Folded | CardShape::CutOut, _) if !is_flat => FOLDED,
            (CardShape::Bent, _) if !is_flat => BENT,
            _ => FLAT,
        }
    }
}

/// A card for each leaf of a plant, at its own size.
#[must_use]
pub fn all_cards(plant: &Plant) -> Vec<LeafCard> {
    (0..plant.leaves().len()).map(|leaf| LeafCard { leaf, scale: 1.0 }).collect()
}

/// Leaves of so few metres and smaller are not drawn: rounding would crush their cards.
pub(crate) fn least_leaf(posed: &Posed) -> f32 {
    posed.positions().iter().fold(0.0_f32, |a, p| a.max(p.abs().max_element())) * 1e-5
}

/// Meshes leaves: a card as wide as the leaf's form says, its picture's base in the middle of the lower edge at the
/// leaf's base; flat where the form is, else of the shape that is asked for; u, v in 0..=1 of the tile with v = 1 at the
/// base, `tiles` the leaf's slot. A leaf of no size, or that the plant doesn't have, gives nothing. Tangents
/// included. Linear in cards.
#[must_use]
pub fn leaf_cards<'c>(plant: &Plant, posed: &Posed, leaves: &[LeafCard], cards: impl Into<Cards<'c>>) -> Mesh {
    leaf_cards_in(plant, posed, &CrownLight::of(plant, posed), leaves, cards)
}

/// As [`leaf_cards`], where the crown's light is known.
#[must_use]
pub fn leaf_cards_in<'c>(
    plant: &Plant,
    posed: &Posed,
    light: &CrownLight,
    leaves: &[LeafCard],
    cards: impl Into<Cards<'c>>,
) -> Mesh {
    let cards: Cards<'c> = cards.into();
    let plans = leaves.iter().filter_map(|card| plant.leaves().get(card.leaf)).map(|leaf| cards.plan(leaf));
    let (vertices, indices) = plans.fold((0, 0), |(v, i), plan| (v + plan.corners.len(), i + plan.triangles.len()));
    let mut mesh = Mesh {
        positions: Vec::with_capacity(vertices),
        normals: Vec::with_capacity(vertices),
        tangents: Vec::with_capacity(vertices),
        uvs: Vec::with_capacity(vertices),
        occlusion: Vec::with_capacity(vertices),
        tiles: Vec::with_capacity(vertices),
        chains: Vec::with_capacity(vertices),
        indices: Vec::with_capacity(indices),
        ..Mesh::default()
    };
    let poses = posed.leaves(plant);
    let least = least_leaf(posed);
    let mut folded = (0.0, math::sin_cos(0.0));
    let mut canopy = Canopy::new(light);
    // Where a card is bent, or large beside its tree, one side need not be right for all of it.
    let (large, mut doubtful) = (least * 5e3, Vec::new());
    for card in leaves {
        let (Some(leaf), Some(pose)) = (plant.leaves().get(card.leaf), poses.get(card.leaf)) else { continue };
        let size = leaf.size * card.scale;
        if !(size > least && size.is_finite()) {
            continue;
        }
        let plan = cards.plan(leaf);
        let (fold, bent) = match leaf.form {
            LeafForm::Frond { arch, fold, .. } => (fold, Some(arch)),
            _ => (plan.fold, None),
        };
        if fold != folded.0 {
            folded = (fold, math::sin_cos(fold));
        }
        let width = size * leaf.form.width();
        let y = pose.frame.y.normalize_or(Vec3::Y);
        let x = pose.frame.x;
        let x = (x - y * x.dot(y)).try_normalize().unwrap_or_else(|| crate::base::Frame::along(y).x);
        let z = x.cross(y);
        // A tip bends down, most where the card lies level; where it hangs there is no down. Fronds bend as they are told.
        let arch = bent.unwrap_or_else(|| plan.arch * z.y / (z.y * z.y + 0.1).sqrt());
        let along = |v: f32| if arch == 0.0 { (z, y * (v * size)) } else { arched(y, z, arch, v, size) };
        let middle = pose.position + if bent.is_some() { along(0.5).1 } else { y * (size * 0.5) };
        let own = if bent.is_some() { along(0.5).0 } else { z };
        let side = if is_turned(&leaf.form, own, light.outward(middle)) { -1.0 } else { 1.0 };
        let share = share_of(&leaf.form, light);
        let (sin, cos) = folded.1;
        let sin = if bent.is_some() { sin * side } else { sin };
        // Light changes little across a card.
        let tip = if bent.is_some() { along(1.0).1 } else { y * size };
        let ends = [f32::from(light.shade(pose.position)), f32::from(light.shade(pose.position + tip))];
        let first = mesh.positions.len() as u32;
        let falling = x.cross(z);
        for &(u, v) in plan.corners {
            let across = (u - 0.5) * width;
            let (up, along) = along(v);
            // The halves lean away from the front, or from a frond's upper face.
            let position = pose.position + x * (across * cos) + along - up * (across.abs() * sin * side);
            let own = up * (side * cos) + x * (sin * (2.0 * u - 1.0));
            let half = f32::from(i8::from(u > 0.5) - i8::from(u < 0.5));
            let growing = if half == 0.0 { x } else { x * cos - up * (half * sin * side) };
            canopy.add(&mut mesh, position, (own, share), (growing, if arch == 0.0 { falling } else { x.cross(up) }));
            mesh.uvs.push(Vec2::new(u, 1.0 - v));
            mesh.occlusion.push((ends[0] + (ends[1] - ends[0]) * v + 0.5) as u8);
        }
        mesh.tiles.resize(mesh.positions.len(), u32::from(leaf.slot));
        mesh.chains.resize(mesh.positions.len(), leaf.chain.0);
        if arch != 0.0 || size > large {
            doubtful.push(mesh.indices.len()..mesh.indices.len() + plan.triangles.len());
        }
        for t in plan.triangles.as_chunks::<3>().0 {
            let [a, b, c] = t.map(|corner| corner + first);
            mesh.indices.extend(if side > 0.0 { [a, b, c] } else { [a, c, b] });
        }
    }
    canopy.flush(&mut mesh);
    for range in doubtful {
        for t in mesh.indices[range].as_chunks_mut::<3>().0 {
            let [a, b, c] = t.map(|i| i as usize);
            let p = &mesh.positions;
            let face = (p[b] - p[a]).cross(p[c] - p[a]);
            if face.dot(mesh.normals[a] + mesh.normals[b] + mesh.normals[c]) < 0.0 {
                t.swap(1, 2);
            }
        }
    }
    mesh
}

/// Normal and place of a share `v` of a card that runs along `y` for `size` metres and turns by `arch` away from `z`: a
/// circle's arc, as long as the card.
pub(super) fn arched(y: Vec3, z: Vec3, arch: f32, v: f32, size: f32) -> (Vec3, Vec3) {
    let turn = arch * v;
    let (sin, cos) = math::sin_cos(turn);
    // Below this the arc is a parabola to the last bit, and the quotients are 0 / 0.
    let (along, down) = if arch.abs() < 1e-3 { (v, arch * v * v * 0.5) } else { (sin / arch, (1.0 - cos) / arch) };
    (z * cos + y * sin, y * (along * size) - z * (down * size))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Rotation;
    use crate::plant::PlantBuilder;

    #[test]
    fn fronds_that_hang_around_a_stem_are_lit_from_above_whatever_way_they_were_read() {
        for flip in [1.0, -1.0] {
            let mut builder = PlantBuilder::new();
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 6.0], &[0.1, 0.1]);
            for i in 0..12 {
                let (sin, cos) = math::sin_cos(i as f32 * 0.52);
                // They rise a little and hang then.
                let (out, tip) = (Vec3::new(cos, 0.0, sin), Vec3::new(cos * 0.9, 0.4, sin * 0.9).normalize());
                let face = (Vec3::Y - tip * tip.y - out * 0.2).normalize();
                let face = (face - tip * face.dot(tip)).normalize() * flip;
                let form = LeafForm::Frond { width: 0.2, arch: 1.6 * flip, fold: 0.3 * flip };
                let orientation = Rotation::from_axes(tip.cross(face), tip, face);
                builder.leaf(Leaf { form, ..Leaf::new(stem, 1.0, orientation, 2.5, 0) });
            }
            let plant = builder.finish().unwrap();
            let mesh = leaf_cards(&plant, &plant.pose(), &all_cards(&plant), CardShape::Folded);
            let mean = mesh.normals.iter().map(|n| n.y).sum::<f32>() / mesh.normals.len() as f32;
            assert!(mean > 0.2, "{flip}: {mean}");
        }
    }

    #[test]
    fn a_frond_is_bent_and_folded_on_every_shape_of_card_however_it_lies() {
        let (width, arch, fold, size) = (0.4, 1.2, 0.3, 0.5);
        // Its tip runs along x, its upper face looks up, down and aside.
        for face in [Vec3::Y, Vec3::NEG_Y, Vec3::Z] {
            let mut builder = PlantBuilder::new();
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 2.0], &[0.1, 0.05]);
            let orientation = Rotation::from_axes(Vec3::X.cross(face), Vec3::X, face);
            let form = LeafForm::Frond { width, arch, fold };
            builder.leaf(Leaf { form, ..Leaf::new(stem, 1.0, orientation, size, 0) });
            let plant = builder.finish().unwrap();
            let base = Vec3::Y * 2.0;
            for (shape, count) in [(CardShape::Folded, 16), (CardShape::Trimmed, 8), (CardShape::Flat, 6)] {
                let mesh = leaf_cards(&plant, &plant.pose(), &all_cards(&plant), shape);
                assert_eq!(mesh.indices.len() / 3, count);
                for (p, uv) in mesh.positions.iter().zip(&mesh.uvs) {
                    let (sin, cos) = math::sin_cos(arch * (1.0 - uv.y));
                    let (along, up) = (Vec3::X * sin - face * (1.0 - cos), face * cos + Vec3::X * sin);
                    let (lean, out) = math::sin_cos(fold);
                    let half = (uv.x - 0.5) * width * size;
                    let place =
                        base + along * (size / arch) + Vec3::X.cross(face) * (half * out) - up * (half.abs() * lean);
                    assert!(p.distance(place) < 1e-4, "{shape:?}, {face}: {p} for {place}");
                }
            }
        }
    }
}
