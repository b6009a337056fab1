//! Wood and leaves of plants that have the same chains and leaves in the same order (the in-betweens of a morph), as one
//! mesh and its positions in each of them: what morph targets are made from.
//!
//! Rings stand at fixed arc-length parameters and have a fixed number of sides, so that every vertex means the same in
//! every plant. Both are simpler than a variant's own tubes: a clip holds as many vertices as a budget allows, the largest
//! chains first; a chain's size is its greatest surface. Leaves are flat cards whatever those of variants are, since corners must
//! mean the same in every picture that a leaf wears on the way; they are taken in a fixed seeded order, and enlarged
//! for those that are left out, at most twice.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::bark_uv::BarkScale;
use super::canopy::{is_turned, share_of};
use super::card::arched;
use super::{CrownLight, Mesh};
use crate::base::{Seed, math};
use crate::plant::{ChainId, LeafForm, Plant, Posed};

/// Most and fewest sides of a tube.
const SIDES: (u32, u32) = (9, 3);
/// Most and fewest rings of a tube.
const RINGS: (usize, usize) = (14, 3);
/// Thinnest tube, metres.
const THINNEST: f32 = 2e-4;
/// How far leaves are enlarged at most.
const LARGEST: f32 = 2.0;

/// Where the vertices of a mesh are in one plant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Key {
    /// Metres.
    pub positions: Vec<Vec3>,
    /// Unit vectors.
    pub normals: Vec<Vec3>,
}

impl Key {
    /// Adds what [`Mesh::double`] adds.
    pub fn double(&mut self) {
        self.positions.extend_from_within(..);
        self.normals.extend_from_within(..);
    }
}

/// A plant in the world.
#[derive(Clone, Copy, Debug)]
pub struct KeyPlant<'a> {
    /// The plant.
    pub plant: &'a Plant,
    /// Its pose.
    pub posed: &'a Posed,
}

/// How a chain is swept.
struct Sweep {
    chain: ChainId,
    rings: usize,
    sides: u32,
}

/// Wood of some plants of the same chains: the mesh in the first of them, and the keys of all. At most `most` vertices.
/// Plants of other chains than the first are left out. Linear in chains but for a sort.
#[must_use]
pub fn keyed_tubes(plants: &[KeyPlant<'_>], most: usize, bark_tile: f32) -> (Mesh, Vec<Key>) {
    let Some(first) = plants.first() else { return (Mesh::default(), Vec::new()) };
    let same = |p: &&KeyPlant<'_>| {
        let own = p.plant.chains().iter().map(|c| c.parent);
        own.eq(first.plant.chains().iter().map(|c| c.parent))
    };
    let plants: Vec<&KeyPlant<'_>> = plants.iter().filter(same).collect();
    let sweeps = sweeps(&plants, most);
    let keys: Vec<Key> = plants.par_iter().map(|plant| key(plant, &sweeps)).collect();
    let mut mesh = Mesh { positions: keys[0].positions.clone(), normals: keys[0].normals.clone(), ..Mesh::default() };
    // The texture is that of the plant where a chain is largest; close enough to the middle.
    let middle = plants[plants.len() / 2];
    let light = CrownLight::of(middle.plant, middle.posed);
    let bark = BarkScale::of(middle.plant, middle.posed, bark_tile);
    for sweep in &sweeps {
        let start = mesh.uvs.len() as u32;
        let widest = |p: &&&KeyPlant<'_>| p.plant.radii(sweep.chain)[0];
        let widest = plants.iter().max_by(|a, b| widest(a).total_cmp(&widest(b))).map_or(middle, |p| *p);
        let curve = widest.posed.curve(widest.plant, sweep.chain);
        let step = curve.length() / (sweep.rings - 1) as f32;
        let mut v = Seed::new(0).child("bark").at(u64::from(sweep.chain.0)).unit();
        for j in 0..sweep.rings {
            let along = j as f32 / (sweep.rings - 1) as f32;
            let place = middle.posed.at(middle.plant, sweep.chain, along).position;
            let radius = curve.value(widest.plant.radii(sweep.chain), f64::from(along)).max(THINNEST);
            let around = bark.around(std::f32::consts::TAU * radius);
            if j > 0 {
                v -= step * bark.along();
            }
            for k in 0..=sweep.sides {
                let u = around * (k as f32 / sweep.sides as f32 - 0.5);
                mesh.uvs.push(Vec2::new(u, v));
                mesh.occlusion.push(light.shade(place));
            }
        }
        let columns = sweep.sides + 1;
        for j in 0..sweep.rings as u32 - 1 {
            for k in 0..sweep.sides {
                let a = start + j * columns + k;
                let (b, c, d) = (a + 1, a + columns, a + columns + 1);
                mesh.indices.extend([a, b, d, a, d, c]);
            }
        }
    }
    (mesh, keys)
}

/// The chains that are swept, in order.
fn sweeps(plants: &[&KeyPlant<'_>], most: usize) -> Vec<Sweep> {
    let first = plants[0].plant;
    let thickest = plants.iter().flat_map(|p| p.plant.all_radii()).fold(1e-6_f32, |a, r| a.max(*r));
    let mut measured: Vec<(f32, f32, usize)> = first
        .chain_ids()
        .map(|id| {
            plants.iter().fold((0.0_f32, 0.0_f32, 2), |(surface, radius, points), p| {
                let r = p.plant.radii(id).iter().fold(0.0_f32, |a, r| a.max(*r));
                let length = p.posed.curve(p.plant, id).length();
                (surface.max(r * length), radius.max(r), points.max(p.plant.points(id).len()))
            })
        })
        .collect();
    // What bears something large is as large, so that nothing is kept without its bearer.
    for id in first.chain_ids().rev() {
        if let Some(parent) = first.chain(id).parent {
            measured[parent.index()].0 = measured[parent.index()].0.max(measured[id.index()].0);
        }
    }
    let mut order: Vec<ChainId> = first.chain_ids().collect();
    order.sort_by(|a, b| measured[b.index()].0.total_cmp(&measured[a.index()].0).then(a.cmp(b)));
    let mut left = most;
    let mut sweeps = Vec::new();
    for chain in order {
        let (_, radius, points) = measured[chain.index()];
        let share = (radius / thickest).clamp(0.0, 1.0).sqrt();
        let sides = ((SIDES.0 as f32 * share + 0.5) as u32).clamp(SIDES.1, SIDES.0);
        let wanted = (RINGS.0 as f32 * share.sqrt() + 0.5) as usize;
        let rings = points.min(wanted).clamp(RINGS.1, RINGS.0);
        let vertices = rings * (sides as usize + 1);
        if vertices > left {
            break;
        }
        left -= vertices;
        sweeps.push(Sweep { chain, rings, sides });
    }
    sweeps.sort_by_key(|sweep| sweep.chain);
    sweeps
}

fn key(KeyPlant { plant, posed }: &KeyPlant<'_>, sweeps: &[Sweep]) -> Key {
    let mut key = Key::default();
    for sweep in sweeps {
        let curve = posed.curve(plant, sweep.chain);
        let radii = plant.radii(sweep.chain);
        for j in 0..sweep.rings {
            let along = j as f32 / (sweep.rings - 1) as f32;
            let pose = posed.at(plant, sweep.chain, along);
            let radius = curve.value(radii, f64::from(along)).max(THINNEST);
            for k in 0..=sweep.sides {
                let turn = std::f32::consts::TAU * (k % sweep.sides) as f32 / sweep.sides as f32;
                let (sin, cos) = math::sin_cos(turn);
                let radial = pose.frame.x * cos + pose.frame.z * -sin;
                key.positions.push(pose.position + radial * radius);
                key.normals.push(radial);
            }
        }
    }
    key
}

/// The leaves that a clip shows, in order, and what they are enlarged by.
#[must_use]
pub fn picked_leaves(count: usize, most: usize, seed: Seed) -> (Vec<usize>, f32) {
    if count <= most {
        return ((0..count).collect(), 1.0);
    }
    let mut order: Vec<(u64, usize)> = (0..count).map(|i| (seed.at(i as u64).bits(), i)).collect();
    order.sort_unstable();
    order.truncate(most);
    let mut picked: Vec<usize> = order.into_iter().map(|o| o.1).collect();
    picked.sort_unstable();
    let scale = (count as f32 / most.max(1) as f32).sqrt().min(LARGEST);
    (picked, scale)
}

/// Corners and normals of the cards of some leaves, four each.
#[must_use]
pub fn card_key(KeyPlant { plant, posed }: &KeyPlant<'_>, picked: &[usize], scale: f32) -> Key {
    let light = CrownLight::of(plant, posed);
    let mut key = Key::default();
    for leaf in picked.iter().filter_map(|&i| plant.leaves().get(i)) {
        let pose = posed.leaf(plant, leaf);
        let (length, width) = (leaf.size * scale, leaf.size * scale * leaf.form.width());
        // Of a frond the chord.
        let (tip, own) = match leaf.form {
            LeafForm::Frond { arch, .. } => {
                let tip = arched(pose.frame.y, pose.frame.z, arch, 1.0, length).1;
                (tip, pose.frame.x.cross(tip).normalize_or(pose.frame.z))
            }
            _ => (pose.frame.y * length, pose.frame.z),
        };
        let outward = light.outward(pose.position + tip * 0.5);
        let side = if is_turned(&leaf.form, own, outward) { -1.0 } else { 1.0 };
        let share = share_of(&leaf.form, &light);
        for (u, v) in [(-0.5, 0.0), (0.5, 0.0), (0.5, 1.0), (-0.5, 1.0)] {
            let position = pose.position + pose.frame.x * (u * width) + tip * v;
            let normal = light.outward(position) * share + own * (side * (1.0 - share));
            key.positions.push(position);
            key.normals.push(normal.normalize_or(outward));
        }
    }
    key
}

/// The cards of a key as a mesh; `tile` gives the picture of each leaf by its place among the picked.
#[must_use]
pub fn card_mesh(KeyPlant { plant, posed }: &KeyPlant<'_>, key: &Key, tiles: &[u32]) -> Mesh {
    let light = CrownLight::of(plant, posed);
    let mut mesh = Mesh { positions: key.positions.clone(), normals: key.normals.clone(), ..Mesh::default() };
    for (i, corners) in key.positions.chunks_exact(4).enumerate() {
        let middle = (corners[0] + corners[2]) * 0.5;
        mesh.uvs.extend([Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::new(1.0, 0.0), Vec2::new(0.0, 0.0)]);
        mesh.occlusion.extend([light.shade(middle); 4]);
        mesh.tiles.extend([tiles.get(i).copied().unwrap_or(0); 4]);
        let first = 4 * i as u32;
        // The front looks out of the crown.
        let across = (corners[1] - corners[0]).cross(corners[3] - corners[0]);
        let front = across.dot(key.normals[4 * i]) >= 0.0;
        let [a, b, c, d] = [first, first + 1, first + 2, first + 3];
        mesh.indices.extend(if front { [a, b, c, a, c, d] } else { [a, c, b, a, d, c] });
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Rotation;
    use crate::plant::{Leaf, PlantBuilder};

    #[test]
    fn fronds_that_hang_are_lit_from_above_in_clips_too() {
        for flip in [1.0, -1.0] {
            let mut builder = PlantBuilder::new();
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 6.0], &[0.1, 0.1]);
            for i in 0..12 {
                let (sin, cos) = math::sin_cos(i as f32 * 0.52);
                let tip = Vec3::new(cos, 0.2, sin).normalize();
                let face = (Vec3::Y - tip * tip.y).normalize() * flip;
                let form = LeafForm::Frond { width: 0.2, arch: 1.6 * flip, fold: 0.0 };
                let orientation = Rotation::from_axes(tip.cross(face), tip, face);
                builder.leaf(Leaf { form, ..Leaf::new(stem, 1.0, orientation, 2.5, 0) });
            }
            let plant = builder.finish().unwrap();
            let posed = plant.pose();
            let key = card_key(&KeyPlant { plant: &plant, posed: &posed }, &(0..12).collect::<Vec<_>>(), 1.0);
            assert!(key.normals.iter().all(|n| n.y > 0.2), "{flip}: {:?}", key.normals);
        }
    }
    use crate::relate::random_plant::{Oddity, random_plant};

    #[test]
    fn keys_have_the_meshs_vertices_and_the_budget_holds() {
        for seed in 0..20 {
            let plant = random_plant(Seed::new(seed), 40, Oddity::Wild);
            let posed = plant.pose();
            let own = KeyPlant { plant: &plant, posed: &posed };
            for most in [0, 50, 100_000] {
                let (mesh, keys) = keyed_tubes(&[own, own], most, 1.0);
                assert!(mesh.positions.len() <= most && keys.len() == 2);
                assert_eq!(mesh.uvs.len(), mesh.positions.len());
                assert!(
                    keys.iter()
                        .all(|k| k.positions.len() == mesh.positions.len() && k.normals.len() == mesh.normals.len())
                );
                assert!(mesh.indices.iter().all(|i| (*i as usize) < mesh.positions.len()));
            }
            let (picked, scale) = picked_leaves(plant.leaves().len(), 10, Seed::new(1));
            let key = card_key(&own, &picked, scale);
            let mesh = card_mesh(&own, &key, &vec![0; picked.len()]);
            assert!(mesh.positions.len() == 4 * picked.len() && picked.len() <= 10 && scale <= LARGEST);
        }
    }
}
