//! Cards and crowns brought to a plant.
//!
//! A card goes to the chain whose axis is nearest to its base, and keeps its place exactly by its offset from the axis
//! in the frame there: it may stand off by a petiole that no chain shows, and moves with the branch from then on.

use glam::Vec3;

use super::fill::{Crown, fill};
use super::near::Near;
use super::{Card, Parts};
use crate::base::{Rotation, Seed, counted};
use crate::plant::{ChainId, Leaf, LeafForm, Plant, PlantBuilder, Posed};
use crate::source::skeletonize::Placement;

/// Places along axes that are looked at, about.
const PLACES: f32 = 40_000.0;
/// A leaf is far from the wood beyond this share of the plant's height and two of its lengths.
const FAR: f32 = 0.05;

/// A card in the plant's space.
fn placed(card: &Card, placement: &Placement) -> Card {
    Card {
        base: placement.point(card.base),
        axes: card.axes.map(|axis| placement.direction(axis)),
        length: card.length * placement.scale(),
        width: card.width * placement.scale(),
        slot: card.slot,
        bend: card.bend,
    }
}

/// The plant with the leaves of a mesh; notes are added to `notes`. n log n in points and leaves.
///
/// The plant's own leaves and chains stay; first come the chains and leaves that fill crowns, then the cards' leaves in
/// their order. Those without finite place or size are left out.
#[must_use]
pub fn attach(plant: Plant, parts: &Parts, placement: &Placement, notes: &mut Vec<String>) -> Plant {
    let crowns: Vec<Crown> = parts
        .crowns
        .iter()
        .map(|c| Crown {
            positions: c.positions.iter().map(|p| placement.point(*p)).collect(),
            triangles: c.triangles.clone(),
            slots: c.slots,
        })
        .collect();
    let plant = if crowns.is_empty() { plant } else { fill(plant, &crowns, Seed::new(0).child("crowns")) };
    let posed = plant.pose();
    let height = posed.positions().iter().fold(0.0_f32, |top, p| top.max(p.y.abs()));
    let wood = Axes::of(&plant, &posed);
    let mut far = 0;
    let mut leaves = Vec::with_capacity(parts.cards.len());
    for card in &parts.cards {
        let card = placed(card, placement);
        let Some((chain, location, distance)) = wood.nearest(card.base) else { continue };
        far += usize::from(distance > FAR * height + 2.0 * card.length);
        leaves.push(leaf(&plant, &posed, &card, chain, location));
    }
    if far > 0 {
        let hang = counted(far, "leaf is far from any wood and hangs", "leaves are far from any wood and hang");
        notes.push(format!("{hang} on the nearest branch"));
    }
    let mut builder = PlantBuilder::from_plant(plant.clone());
    for leaf in leaves.into_iter().filter(|l| l.size.is_finite() && l.size > 0.0 && l.offset.is_finite()) {
        builder.leaf(leaf);
    }
    builder.finish().unwrap_or(plant)
}

/// A card as a leaf of a chain.
fn leaf(plant: &Plant, posed: &Posed, card: &Card, chain: ChainId, location: f32) -> Leaf {
    let here = posed.at(plant, chain, location);
    let [x, y, z] = card.axes.map(|axis| here.frame.to_local(axis));
    let width = card.width / card.length;
    Leaf {
        offset: here.frame.to_local(card.base - here.position),
        form: card.bend.map_or(LeafForm::Flat(width), |(arch, fold)| LeafForm::Frond { width, arch, fold }),
        ..Leaf::new(chain, location, Rotation::from_axes(x, y, z), card.length, card.slot)
    }
}

/// The axes of a plant, by place.
pub(super) struct Axes<'a> {
    plant: &'a Plant,
    posed: &'a Posed,
    /// Chain and segment of each place.
    places: Vec<(ChainId, u32)>,
    near: Near,
}

impl<'a> Axes<'a> {
    pub(super) fn of(plant: &'a Plant, posed: &'a Posed) -> Self {
        let total: f32 = plant.chain_ids().map(|id| posed.curve(plant, id).length()).sum();
        let gap = (total / PLACES).max(1e-6);
        let mut places = Vec::new();
        let mut points = Vec::new();
        for id in plant.chain_ids() {
            for (i, pair) in posed.chain(plant, id).windows(2).enumerate() {
                let steps = ((pair[0].distance(pair[1]) / gap).ceil() as u32).clamp(1, 10_000);
                for k in 0..=steps {
                    places.push((id, i as u32));
                    points.push(pair[0].lerp(pair[1], k as f32 / steps as f32));
                }
            }
        }
        Self { plant, posed, places, near: Near::new(points.into_iter()) }
    }

    /// Chain, location and distance of the place on an axis that is nearest to a point.
    pub(super) fn nearest(&self, p: Vec3) -> Option<(ChainId, f32, f32)> {
        let (found, _) = self.near.find(p).filter(|(_, d)| d.is_finite())?;
        let (chain, segment) = self.places[found as usize];
        let points = self.posed.chain(self.plant, chain);
        let parameters = self.posed.curve(self.plant, chain).parameters();
        let segments = (segment as usize).saturating_sub(1)..(segment as usize + 2).min(points.len() - 1);
        segments
            .map(|i| {
                let (a, b) = (points[i], points[i + 1]);
                let t = ((p - a).dot(b - a) / (b - a).length_squared().max(1e-20)).clamp(0.0, 1.0);
                let location = parameters[i] + (parameters[i + 1] - parameters[i]) * f64::from(t);
                (chain, (location as f32).clamp(0.0, 1.0), a.lerp(b, t).distance(p))
            })
            .min_by(|a, b| a.2.total_cmp(&b.2))
    }
}
