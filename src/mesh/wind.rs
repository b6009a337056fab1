//! What a shader needs to sway a tree in the wind, a vertex at a time, by the hierarchy of its branches.
//!
//! Three movements add up, as in the shaders that are in use (Sousa 2007, "Vegetation procedural animation and shading in
//! Crysis"; SpeedTree): the whole tree bends with the square of the height; each limb, a chain on a stem with all that it
//! bears, swings about its own base; leaves flutter about theirs. So that neighbours do not move as one, a limb has a
//! phase.

use glam::{Vec2, Vec3};

use super::Mesh;
use crate::base::Seed;
use crate::plant::{Plant, Posed};

/// No chain: a card or an impostor, which stands for many.
pub const NO_CHAIN: u32 = u32::MAX;

/// Wind of a mesh; arrays of its vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wind {
    /// How far the trunk bends there and how far the limb, both 0..=1, and the phase, 0..1. Leaves flutter, wood does not.
    pub weights: Vec<[f32; 3]>,
    /// Where the limb swings about, metres.
    pub pivots: Vec<Vec3>,
}

impl Wind {
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

    /// Wind of a mesh whose `chains` are this plant's; what has no chain hangs on the trunk.
    #[must_use]
    pub fn wind(&self, plant: &Plant, mesh: &Mesh) -> Wind {
        let mut wind = Wind::default();
        for (i, &p) in mesh.positions.iter().enumerate() {
            let chain = mesh.chains.get(i).copied().unwrap_or(NO_CHAIN) as usize;
            let level = ((p.y - self.low) / self.height).clamp(0.0, 1.0);
            let (pivot, phase) = self.limbs.get(chain).copied().unwrap_or((Vec3::ZERO, 0.0));
            let on_limb = plant.chains().get(chain).is_some_and(|c| c.parent.is_some());
            let swing = if on_limb { (p.distance(pivot) / self.reach).clamp(0.0, 1.0) } else { 0.0 };
            wind.weights.push([level * level, swing * swing, phase]);
            wind.pivots.push(pivot);
        }
        wind
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{TubeDetail, tubes};
    use crate::plant::PlantBuilder;
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
        let wind = Limbs::of(&plant, &posed).wind(&plant, &mesh);
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
    }
}
