//! What a shader needs to sway a tree in the wind, a vertex at a time, by the hierarchy of its branches.
//!
//! Three movements add up, as in the shaders that are in use (Sousa 2007, "Vegetation procedural animation and shading in
//! Crysis"; SpeedTree): the whole tree bends with the square of the height; each limb, a chain on a stem with all that it
//! bears, swings about its own base; leaves flutter about theirs. So that neighbours do not move as one, a limb has a
//! phase, and a leaf has one of its own, which hangs on where it grows only: it is the same at every level of detail. Cards
//! that stand for many leaves do not flutter.

use std::collections::BTreeMap;
use std::ops::Range;

use glam::{Vec2, Vec3};

use super::Mesh;
use crate::base::Seed;
use crate::plant::{Plant, Posed};

/// No chain: a card or an impostor, which stands for many.
pub const NO_CHAIN: u32 = u32::MAX;

/// Wind of a mesh; arrays of its vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wind {
    /// How far the trunk bends there and how far the limb, both 0..=1, and the limb's phase, 0..1.
    pub weights: Vec<[f32; 3]>,
    /// Where the limb swings about, metres.
    pub pivots: Vec<Vec3>,
    /// How far a leaf flutters there, 0 at its base and 1 at its tip, 0 on wood; and the leaf's phase, 0..1.
    pub leaves: Vec<Vec2>,
}

impl Wind {
    /// Whether it tells of every vertex of a mesh.
    pub(crate) fn fits(&self, mesh: &Mesh) -> bool {
        [self.weights.len(), self.pivots.len(), self.leaves.len()] == [mesh.positions.len(); 3]
    }

    /// How far a vertex bends all in all, and its phase: for shaders with two numbers only. With the limb's share beside it, the
    /// trunk's is known, too.
    #[must_use]
    pub fn bend_and_phase(&self) -> Vec<Vec2> {
        self.weights.iter().map(|w| Vec2::new((w[0] * 0.6 + w[1] * 0.4).min(1.0), w[2])).collect()
    }
}

/// The limb that each chain of a plant is a part of.
#[derive(Clone, Debug)]
pub struct Limbs {
    /// By chain: base of its limb, and the phase.
    limbs: Vec<(Vec3, f32)>,
    /// Farthest that anything is from its limb's base, metres.
    reach: f32,
    low: f32,
    height: f32,
}

impl Limbs {
    /// Reads a plant; linear in its points.
    #[must_use]
    pub fn of(plant: &Plant, posed: &Posed) -> Self {
        let mut limbs: Vec<(Vec3, f32)> = Vec::with_capacity(plant.chains().len());
        let mut reach = 1e-6_f32;
        let (mut low, mut high) = (f32::MAX, f32::MIN);
        for id in plant.chain_ids() {
            let points = posed.chain(plant, id);
            let base = points.first().copied().unwrap_or(Vec3::ZERO);
            let phase = Seed::new(0).child("wind").at(u64::from(id.0)).unit();
            let limb = match plant.chain(id).parent {
                // What a limb bears swings with it; a stem stands on its own foot.
                Some(parent) if plant.chain(parent).parent.is_some() => limbs[parent.index()],
                _ => (base, phase),
            };
            limbs.push(limb);
            for p in points.iter().filter(|p| p.is_finite()) {
                if plant.chain(id).parent.is_some() {
                    reach = reach.max(p.distance(limb.0));
                }
                (low, high) = (low.min(p.y), high.max(p.y));
            }
        }
        let height = if low < high { high - low } else { 1.0 };
        Self { limbs, reach, low: low.min(high), height }
    }

    /// Wind of a mesh whose `chains` are this plant's; what has no chain stands on the first stem, in step with it. `made` is the mesh before its
    /// pictures had their places in an atlas and before light maps were unwrapped, or the mesh itself.
    #[must_use]
    pub fn wind(&self, plant: &Plant, mesh: &Mesh, made: &Mesh) -> Wind {
        let mut wind = Wind::default();
        for (i, &p) in mesh.positions.iter().enumerate() {
            let chain = mesh.chains.get(i).copied().unwrap_or(NO_CHAIN) as usize;
            let level = ((p.y - self.low) / self.height).clamp(0.0, 1.0);
            let limb = self.limbs.get(chain).or(self.limbs.first());
            let (pivot, phase) = limb.copied().unwrap_or((Vec3::ZERO, 0.0));
            let on_limb = plant.chains().get(chain).is_some_and(|c| c.parent.is_some());
            let swing = if on_limb { (p.distance(pivot) / self.reach).clamp(0.0, 1.0) } else { 0.0 };
            wind.weights.push([level * level, swing * swing, phase]);
            wind.pivots.push(pivot);
        }
        wind.leaves = as_placed(flutter(made), made, mesh);
        wind
    }
}

/// Phases a metre along each axis, so that leaves a hand apart are in no step.
const PHASES: Vec3 = Vec3::new(7.31, 5.57, 9.13);

/// How far each vertex flutters, and the phase of its leaf. A leaf's picture stands on its lower edge, where `v` is 1.
fn flutter(mesh: &Mesh) -> Vec<Vec2> {
    let mut all = vec![Vec2::ZERO; mesh.positions.len()];
    // Wood has no tiles, and what stands for many leaves hangs on no chain.
    let flutters = |i: usize| mesh.tiles.get(i).is_some() && mesh.chains.get(i).is_some_and(|&chain| chain != NO_CHAIN);
    for (card, triangles) in cards(mesh) {
        if !card.clone().all(flutters) {
            continue;
        }
        let foot = foot(mesh, triangles);
        let phase = foot.dot(PHASES).rem_euclid(1.0);
        // Of the largest float below 1, `rem_euclid` makes 1.
        let phase = if phase < 1.0 { phase } else { 0.0 };
        card.for_each(|i| all[i] = Vec2::new((1.0 - mesh.uvs[i].y).clamp(0.0, 1.0), phase));
    }
    all
}

/// Where a card's leaf is attached: the middle of the lower edge of its picture. A folded card has a vertex there, a whole one
/// its base to both sides; of one that is cut to an outline, or of a half of it, the widest triangle tells.
fn foot(mesh: &Mesh, card: &[[u32; 3]]) -> Vec3 {
    let corners = || card.iter().flatten().map(|&i| (mesh.uvs[i as usize], mesh.positions[i as usize]));
    let base = |u: f32| corners().find(|(uv, _)| uv.y > 1.0 - 1e-3 && (uv.x - u).abs() < 1e-3).map(|of| of.1);
    if let Some(middle) = base(0.5) {
        return middle;
    }
    if let (Some(left), Some(right)) = (base(0.0), base(1.0)) {
        return (left + right) * 0.5;
    }
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.uvs[i as usize]);
        (b - a).perp_dot(c - a)
    };
    let Some(widest) = card.iter().max_by(|a, b| area(a).abs().total_cmp(&area(b).abs())) else { return Vec3::ZERO };
    let ([a, b, c], [p, q, r]) = (widest.map(|i| mesh.uvs[i as usize]), widest.map(|i| mesh.positions[i as usize]));
    let (all, at) = (area(widest), Vec2::new(0.5, 1.0) - a);
    if all.abs() < 1e-9 {
        return p;
    }
    p + ((q - p) * at.perp_dot(c - a) + (r - p) * (b - a).perp_dot(at)) / all
}

/// What was found of a mesh as it was made, for the same mesh whose vertices may have been doubled and put in another order.
fn as_placed(found: Vec<Vec2>, made: &Mesh, mesh: &Mesh) -> Vec<Vec2> {
    if made.positions == mesh.positions {
        return found;
    }
    let place = |p: &Vec3| p.to_array().map(f32::to_bits);
    let at: BTreeMap<[u32; 3], Vec2> = made.positions.iter().map(place).zip(found).collect();
    mesh.positions.iter().map(|p| at.get(&place(p)).copied().unwrap_or_default()).collect()
}

/// The vertices and triangles of each card, or of each half of one that is cut: those of a card lie side by side, in both, and no
/// triangle has corners of two.
fn cards(mesh: &Mesh) -> Vec<(Range<usize>, &[[u32; 3]])> {
    let triangles = mesh.indices.as_chunks::<3>().0;
    // The last vertex that hangs together with each.
    let mut last: Vec<usize> = (0..mesh.positions.len()).collect();
    for t in triangles {
        let (low, high) = t.iter().fold((usize::MAX, 0), |(low, high), &i| (low.min(i as usize), high.max(i as usize)));
        last[low] = last[low].max(high);
    }
    let (mut all, mut start, mut end, mut first) = (Vec::new(), 0, 0, 0);
    for (i, &reach) in last.iter().enumerate() {
        end = end.max(reach);
        if end == i {
            let count = triangles[first..].iter().take_while(|t| t.iter().all(|&corner| corner as usize <= i)).count();
            all.push((start..i + 1, &triangles[first..first + count]));
            first += count;
            (start, end) = (i + 1, i + 1);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{CardShape, LeafCard, TubeDetail, leaf_cards, tubes};
    use crate::plant::{Leaf, PlantBuilder};
    use crate::preset::plan::MeshParams;

    #[test]
    fn a_twig_swings_with_its_limb_and_the_trunk_with_none() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.2, 0.1]);
        let limb = builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X * 2.0], &[0.1, 0.05]);
        builder.branch(limb, 0.5, &[Vec3::ZERO, Vec3::X], &[0.03, 0.01]);
        let plant = builder.finish().unwrap();
        let posed = plant.pose();
        let detail = TubeDetail::full(&MeshParams::told(8, 0.01));
        let mesh = tubes(&plant, &posed, &detail);
        assert_eq!(mesh.chains.len(), mesh.positions.len());
        let wind = Limbs::of(&plant, &posed).wind(&plant, &mesh, &mesh);
        let root = posed.chain(&plant, limb)[0];
        for (i, &chain) in mesh.chains.iter().enumerate() {
            let [bend, swing, phase] = wind.weights[i];
            assert!([bend, swing, phase].iter().all(|v| (0.0..=1.0).contains(v)));
            if chain == 0 {
                assert_eq!(swing, 0.0);
            } else {
                assert!(wind.pivots[i].distance(root) < 1e-5);
            }
        }
        assert!(wind.weights.iter().any(|w| w[1] > 0.5));
        assert!(wind.leaves.iter().all(|leaf| *leaf == Vec2::ZERO), "wood does not flutter");
    }

    #[test]
    fn leaves_flutter_from_base_to_tip_in_a_phase_of_their_own_at_every_level() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.2, 0.1]);
        for i in 0..40 {
            let seed = crate::base::Seed::new(9).at(i);
            let turned = crate::base::Rotation::about(seed.direction(), seed.at(1).range(0.0, 6.0));
            builder.leaf(Leaf::new(stem, seed.at(2).range(0.3, 1.0), turned, 0.3, 0));
        }
        let plant = builder.finish().unwrap();
        let posed = plant.pose();
        let limbs = Limbs::of(&plant, &posed);
        let of = |shape: CardShape, scale: f32| {
            let cards: Vec<_> = (0..40).map(|leaf| LeafCard { leaf, scale }).collect();
            let mesh = leaf_cards(&plant, &posed, &cards, shape);
            let leaves = limbs.wind(&plant, &mesh, &mesh).leaves;
            (mesh, leaves)
        };
        let (mesh, leaves) = of(CardShape::Folded, 1.0);
        let mut phases: Vec<f32> = Vec::new();
        for (card, uvs) in leaves.chunks(6).zip(mesh.uvs.chunks(6)) {
            for (told, uv) in card.iter().zip(uvs) {
                assert!(told.x == 1.0 - uv.y && told.y == card[0].y && (0.0..1.0).contains(&told.y));
            }
            phases.push(card[0].y);
        }
        // Fewer corners, and larger: from afar a leaf is still in step with itself.
        let (_, coarse) = of(CardShape::Flat, 1.7);
        for (near, far) in phases.iter().zip(coarse.chunks(4)) {
            let off = (near - far[0].y).abs();
            assert!(off.min(1.0 - off) < 1e-3, "{near} {}", far[0].y);
        }
        let (least, most) = phases.iter().fold((1.0_f32, 0.0_f32), |(least, most), &p| (least.min(p), most.max(p)));
        assert!(least < 0.2 && most > 0.8, "{phases:?}");
        // Vertices that light maps double and move are found again.
        let order: Vec<usize> = (0..mesh.positions.len()).rev().chain([7, 7]).collect();
        let moved = Mesh { positions: order.iter().map(|&i| mesh.positions[i]).collect(), ..Mesh::default() };
        let again = limbs.wind(&plant, &moved, &mesh).leaves;
        assert!(order.iter().zip(&again).all(|(&i, told)| *told == leaves[i]));
        // A cut card's halves share no vertex, and neither need lie on the middle of the base.
        let outline = |at: &[(f32, f32)]| at.iter().map(|&p| Vec2::from(p)).collect::<Vec<_>>();
        let whole = outline(&[(0.1, 0.2), (0.7, 0.1), (0.9, 0.8), (0.3, 0.9)]);
        let halves = [
            outline(&[(0.1, 0.2), (0.5, 0.15), (0.5, 0.85), (0.3, 0.9)]),
            outline(&[(0.5, 0.15), (0.7, 0.1), (0.9, 0.8), (0.5, 0.85)]),
        ];
        let cut = [crate::mesh::CardCut::new(&whole, [&halves[0], &halves[1]], &whole[1..]).unwrap()];
        for (shape, scale, corners) in [(CardShape::CutOut, 1.0, 8), (CardShape::Trimmed, 1.5, 3)] {
            let cards: Vec<_> = (0..40).map(|leaf| LeafCard { leaf, scale }).collect();
            let mesh = leaf_cards(&plant, &posed, &cards, crate::mesh::Cards { shape, cuts: &cut });
            let leaves = limbs.wind(&plant, &mesh, &mesh).leaves;
            assert_eq!(leaves.len(), 40 * corners);
            for (card, phase) in leaves.chunks(corners).zip(&phases) {
                let off = card.iter().map(|told| (told.y - phase).abs()).fold(0.0, f32::max);
                assert!(off.min(1.0 - off) < 1e-3, "{shape:?}: {card:?} for {phase}");
            }
        }
        // A card that stands for many hangs on no chain.
        let cloud = Mesh { chains: vec![NO_CHAIN; mesh.positions.len()], ..mesh };
        assert!(limbs.wind(&plant, &cloud, &cloud).leaves.iter().all(|leaf| *leaf == Vec2::ZERO));
    }
}
