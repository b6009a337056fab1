//! A plant in correspondence with its own reflection (2018 TOG, section 6), so that the way between the two is the same from
//! both ends and its middle is symmetric.
//!
//! With the paper's matching a branch mostly goes with its own mirror image, which leaves the trunk at the same
//! height, and the middle of the way lies flat in the mirror plane: a monotone matching of a trunk with itself that is
//! its own inverse can be no other. Here each side of the plane is matched with the reflection of the other, by the same dynamic
//! programming: branch l goes with the image of r and r with the image of l. A branch near the plane goes with its own image; one
//! without a partner stands on both sides, half grown, in the middle.

use glam::Vec3;

use super::bifurcation::{Bifurcation, match_bifurcations};
use super::blocks::family_of;
use super::correspondence::{Correspondence, Shared, Side, Slot, join};
use super::monotone::Monotone;
use crate::base::{Rotation, math};
use crate::plant::{ChainId, Plant, PlantBuilder};
use crate::preset::plan::ElasticParams;
use crate::relate::{Family, FamilyError, Kin, KinId};

/// Branches that point out of the plane by less than this share of their length go with their own images: 10 degrees.
const NEAR: f32 = 0.17;

/// A plant turned about the vertical through the origin, by `angle` radians from +z towards +x.
///
/// Turning every chain's points within the frame of its parent does it: frames are carried along chains by least rotations,
/// which turn with them.
#[must_use]
pub fn turned(plant: &Plant, angle: f32) -> Plant {
    let (sin, cos) = math::sin_cos(angle);
    let turn = |v: Vec3| Vec3::new(cos * v.x + sin * v.z, v.y, cos * v.z - sin * v.x);
    let about = Rotation::about(Vec3::Y, angle);
    rebuilt(plant, &turn, &|r| about.after(r).after(about.inverse()))
}

/// A plant reflected across the plane x = 0: exact, and its own inverse.
#[must_use]
pub fn mirrored(plant: &Plant) -> Plant {
    let flip = |v: Vec3| Vec3::new(-v.x, v.y, v.z);
    // A leaf is flipped within its own blade as well, so that it stays a rotation.
    rebuilt(plant, &flip, &|r| Rotation { v: Vec3::new(r.v.x, -r.v.y, -r.v.z), w: r.w })
}

fn rebuilt(plant: &Plant, map: &dyn Fn(Vec3) -> Vec3, turn: &dyn Fn(Rotation) -> Rotation) -> Plant {
    let mut builder = PlantBuilder::new();
    for id in plant.chain_ids() {
        let chain = plant.chain(id);
        let points: Vec<Vec3> = plant.points(id).iter().map(|p| map(*p)).collect();
        builder.chain(chain.parent, chain.location, map(chain.origin), &points, plant.radii(id));
    }
    for leaf in plant.leaves() {
        let mut leaf = *leaf;
        (leaf.orientation, leaf.offset) = (turn(leaf.orientation), map(leaf.offset));
        builder.leaf(leaf);
    }
    builder.finish_trusted()
}

/// The family of a plant and its reflection across the plane x = 0.
///
/// # Errors
///
/// When the plant has no chain or holds a length beyond all measure; see [`FamilyError`].
pub fn mirror_family(plant: Plant, params: &ElasticParams) -> Result<Family, FamilyError> {
    if plant.chains().is_empty() {
        return Err(FamilyError::Empty);
    }
    let image = mirrored(&plant);
    let plants = vec![plant, image];
    let sides: Vec<Side<'_>> = plants.iter().map(Side::new).collect();
    let mut work = Work { sides: &sides, params, found: Correspondence { kins: Vec::new(), shared: Vec::new() } };
    let stems: Vec<(ChainId, Bifurcation)> = sides[0].stems.iter().map(|&id| (id, sides[0].branch(id, 0.0))).collect();
    let side_of = |id: ChainId, branch: &Bifurcation| {
        let stem = plants[0].chain(id);
        if stem.origin == Vec3::ZERO { branch.direction.x } else { stem.origin.normalize_or_zero().x }
    };
    work.both_sides(None, &stems, &side_of, true);
    family_of(plants.clone(), work.found, params.path)
}

/// Kins that are found, first in, first out.
struct Work<'a> {
    sides: &'a [Side<'a>],
    params: &'a ElasticParams,
    found: Correspondence,
}

impl Work<'_> {
    fn kin(&mut self, parent: Option<KinId>, members: [Option<ChainId>; 2], at: f64) -> KinId {
        let id = KinId(self.found.kins.len() as u32);
        self.found.kins.push(Kin { parent, members: members.to_vec() });
        self.found.shared.push(Shared { maps: Vec::new(), at });
        id
    }

    fn image(&self, branch: &Bifurcation) -> Bifurcation {
        Bifurcation { direction: branch.direction * Vec3::new(-1.0, 1.0, 1.0), ..*branch }
    }

    /// Pairs what leaves a kin that is its own image. The longest of stems goes with itself.
    fn both_sides(
        &mut self,
        parent: Option<KinId>,
        branches: &[(ChainId, Bifurcation)],
        side_of: &dyn Fn(ChainId, &Bifurcation) -> f32,
        stems: bool,
    ) {
        let (mut own, mut left, mut right) = (Vec::new(), Vec::new(), Vec::new());
        for (i, &(id, branch)) in branches.iter().enumerate() {
            let side = side_of(id, &branch);
            if (stems && i == 0) || side.abs() < NEAR {
                own.push((id, branch));
            } else if side > 0.0 {
                left.push((id, branch));
            } else {
                right.push((id, self.image(&branch)));
            }
        }
        let of = |list: &[(ChainId, Bifurcation)]| list.iter().map(|b| b.1).collect::<Vec<_>>();
        let pairs = match_bifurcations(&of(&left), &of(&right), self.params);
        let mut free = (vec![true; left.len()], vec![true; right.len()]);
        let mut next: Vec<(KinId, KinId, Option<ChainId>, Option<ChainId>)> = Vec::new();
        for (i, j) in pairs {
            (free.0[i], free.1[j]) = (false, false);
            next.push(self.pair(parent, Some(left[i].0), Some(right[j].0)));
        }
        let alone = |free: &[bool], list: &[(ChainId, Bifurcation)]| {
            list.iter().zip(free).filter(|(_, free)| **free).map(|(b, _)| *b).collect::<Vec<_>>()
        };
        for (id, _) in alone(&free.0, &left).into_iter().chain(alone(&free.1, &right)) {
            next.push(self.pair(parent, Some(id), None));
        }
        for (id, _) in own {
            let kin = self.kin(parent, [Some(id); 2], f64::NAN);
            let identity = || Monotone::new(vec![(0.0, 0.0), (1.0, 1.0)]);
            self.found.shared[kin.index()].maps = vec![identity(), identity()];
            let place = |id: ChainId| f64::from(self.sides[0].plant.chain(id).location);
            let children: Vec<(ChainId, Bifurcation)> =
                self.sides[0].children[id.index()].iter().map(|&c| (c, self.sides[0].branch(c, place(c)))).collect();
            self.both_sides(Some(kin), &children, &|_, b| b.direction.x, false);
        }
        self.pairs(next);
    }

    /// Two kins that are each other's images. Partners need not stand at one height, and their images stand the other way
    /// round: such kins move along their parent by their shares.
    fn pair(
        &mut self,
        parent: Option<KinId>,
        one: Option<ChainId>,
        other: Option<ChainId>,
    ) -> (KinId, KinId, Option<ChainId>, Option<ChainId>) {
        let here = self.kin(parent, [one, other], f64::NAN);
        let there = self.kin(parent, [other, one], f64::NAN);
        (here, there, one, other)
    }

    /// Matches what pairs bear, level by level.
    fn pairs(&mut self, mut level: Vec<(KinId, KinId, Option<ChainId>, Option<ChainId>)>) {
        while !level.is_empty() {
            let mut next = Vec::new();
            for (here, there, one, other) in level {
                let member = |side: usize, id: Option<ChainId>| id.map(|id| (id, self.sides[side].branch(id, 0.0)));
                let slot = Slot { at: 0.0, members: vec![member(0, one), member(1, other)] };
                let (maps, slots) = join(self.sides, &slot, self.params);
                self.found.shared[there.index()].maps = maps.iter().rev().cloned().collect();
                self.found.shared[here.index()].maps = maps;
                for slot in slots {
                    let child = |side: usize| slot.members[side].as_ref().map(|m| m.0);
                    let (one, other) = (child(0), child(1));
                    let a = self.kin(Some(here), [one, other], slot.at);
                    let b = self.kin(Some(there), [other, one], slot.at);
                    next.push((a, b, one, other));
                }
            }
            level = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::relate::random_plant::{Oddity, random_plant};

    #[test]
    fn a_reflection_is_one_in_the_world_and_its_own_inverse() {
        for seed in 0..10 {
            let plant = random_plant(Seed::new(seed), 40, Oddity::Wild);
            let image = mirrored(&plant);
            assert!(mirrored(&image) == plant);
            let (own, flipped) = (plant.pose(), image.pose());
            for (a, b) in own.positions().iter().zip(flipped.positions()) {
                assert!((*a * Vec3::new(-1.0, 1.0, 1.0)).distance(*b) < 1e-4, "{a} {b}");
            }
            for (a, b) in plant.leaves().iter().zip(image.leaves()) {
                let (a, b) = (own.leaf(&plant, a), flipped.leaf(&image, b));
                let flip = |v: Vec3| v * Vec3::new(-1.0, 1.0, 1.0);
                assert!(flip(a.position).distance(b.position) < 1e-4);
                assert!(flip(a.frame.y).distance(b.frame.y) < 1e-4 && flip(a.frame.z).distance(b.frame.z) < 1e-4);
            }
        }
    }

    #[test]
    fn a_turned_plant_is_turned_in_the_world() {
        let plant = random_plant(Seed::new(4), 40, Oddity::Tame);
        let image = turned(&plant, 0.7);
        let about = Rotation::about(Vec3::Y, 0.7);
        for (a, b) in plant.pose().positions().iter().zip(image.pose().positions()) {
            assert!(about.rotate(*a).distance(*b) < 1e-4);
        }
        for (a, b) in plant.leaves().iter().zip(image.leaves()) {
            let (a, b) = (plant.pose().leaf(&plant, a), image.pose().leaf(&image, b));
            assert!(about.rotate(a.frame.y).distance(b.frame.y) < 1e-4);
        }
    }

    #[test]
    fn the_correspondence_is_the_same_from_both_ends() {
        for seed in 0..20 {
            let plant = random_plant(Seed::new(seed), 50, Oddity::Tame);
            let family = mirror_family(plant, &ElasticParams::default()).unwrap();
            for kin in family.kin_ids() {
                let (a, b) = (family.member(kin, 0), family.member(kin, 1));
                assert!(family.kin_ids().any(|k| family.member(k, 0) == b && family.member(k, 1) == a));
            }
        }
    }
}
