//! The rings of all chains at one detail, before any is swept: branches begin on those of their bearers.

use std::ops::Range;

use rayon::prelude::*;

use super::bearer::Bearer;
use super::fit::fit;
use super::rings::{Base, Ring, span_at, stand, unfold};
use super::roots::Foot;
use super::sides::{out_of_corners, out_of_middles};
use super::sweep::Circles;
use super::tube::{PART, Skin, TubeDetail, Wood, is_kept};
use crate::base::is_alone;
use crate::plant::ChainId;

/// What a chain is swept along.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    /// Of its part.
    rings: Range<usize>,
    pub(super) skin: Skin,
    /// By how much its rings are to be wider.
    pub(super) fuller: f32,
    /// Share of its first ring that surely is left where it lies within the bearer's skin; 1 where all does.
    pub(super) left: f32,
    /// Where roots are drawn; without a share where none are.
    pub(super) foot: Foot,
}

/// Shapes of [`PART`] chains.
#[derive(Debug, Default)]
struct Part {
    shapes: Vec<Shape>,
    rings: Vec<Ring>,
    /// Used again for each chain.
    own: Vec<Ring>,
}

/// Shapes of all chains that are meshed.
#[derive(Debug)]
pub(super) struct Shapes {
    parts: Vec<Part>,
    /// By chain, which of those that are meshed it is; `u32::MAX` for others.
    place: Vec<u32>,
    pub(super) circles: Circles,
}

impl Shapes {
    /// Of the chains that are `kept`, bearers first. The same on any number of threads.
    pub(super) fn of(wood: &Wood<'_>, kept: &[ChainId], detail: &TubeDetail) -> Self {
        let part = |ids: &[ChainId]| {
            let mut part = Part::default();
            ids.iter().for_each(|&id| part.add(wood, id, detail));
            part
        };
        let parts: Vec<Part> =
            if is_alone() { kept.chunks(PART).map(part).collect() } else { kept.par_chunks(PART).map(part).collect() };
        let mut place = vec![u32::MAX; wood.limbs.len()];
        (0..).zip(kept).for_each(|(i, id)| place[id.index()] = i);
        let with_rings = parts.iter().flat_map(|part| &part.shapes).filter(|shape| !shape.rings.is_empty());
        let circles = Circles::up_to(with_rings.map(|shape| shape.skin.sides).max().unwrap_or(3));
        let mut shapes = Self { parts, place, circles };
        kept.iter().for_each(|&id| shapes.set_on_bearer(wood, id, detail));
        shapes
    }

    /// A chain's shape and its rings; none for one without any.
    pub(super) fn get(&self, id: ChainId) -> Option<(&Shape, &[Ring])> {
        let i = self.place[id.index()] as usize;
        let part = self.parts.get(i / PART)?;
        let shape = part.shapes.get(i % PART)?;
        (!shape.rings.is_empty()).then(|| (shape, &part.rings[shape.rings.clone()]))
    }

    /// Most vertices and triangles that they take.
    pub(super) fn size(&self) -> (usize, usize) {
        let with_rings = self.parts.iter().flat_map(|part| &part.shapes).filter(|shape| !shape.rings.is_empty());
        with_rings.fold((0, 0), |(vertices, triangles), Shape { rings, skin, .. }| {
            let sides = skin.sides as usize;
            (
                vertices + (rings.len() + skin.dome().len() + usize::from(skin.is_sunk)) * (sides + 1) + 2 * sides,
                triangles + skin.triangles(rings.len(), true),
            )
        })
    }

    /// The wood that bears a chain; none for a stem.
    pub(super) fn bearer(&self, wood: &Wood<'_>, id: ChainId, detail: &TubeDetail) -> Option<Bearer<'_>> {
        let (shape, rings) = self.get(wood.plant.chain(id).parent?)?;
        let Skin { sides, is_pointed, .. } = shape.skin;
        let out = out_of_middles(sides);
        let girth = (shape.fuller * out, detail.added * out);
        Some(Bearer { rings, is_pointed, girth, left: shape.left })
    }

    /// Moves the first ring of a branch to the axis of its bearer, and says what is left of it there. Bearers come first.
    fn set_on_bearer(&mut self, wood: &Wood<'_>, id: ChainId, detail: &TubeDetail) {
        let (Some(bearer), Some((shape, rings))) = (self.bearer(wood, id, detail), self.get(id)) else { return };
        let location = wood.plant.chain(id).location;
        let foot = bearer.nearest(rings[0].centre, location);
        let reach = (rings[0].radius * shape.fuller + detail.added) * out_of_corners(shape.skin.sides);
        let room = bearer.room(foot, span_at(bearer.rings, location)) + wood.may_stick_out(detail);
        let left = if wood.is_capped(id, detail) { 1.0 } else { (room / reach).min(1.0) };
        let i = self.place[id.index()] as usize;
        let Part { shapes, rings, .. } = &mut self.parts[i / PART];
        let shape = &mut shapes[i % PART];
        shape.left = left;
        shape.rings.start += stand(&mut rings[shape.rings.clone()], foot);
    }
}

impl Part {
    fn add(&mut self, wood: &Wood<'_>, id: ChainId, detail: &TubeDetail) {
        let limb = &wood.limbs[id.index()];
        let error = wood.error(limb.widest, detail);
        let (first, all) = (self.rings.len(), wood.rings_of(limb));
        self.own.clear();
        self.own.extend(all.iter().filter(|ring| is_kept(ring, error)));
        let (mut skin, mut fuller) = (Skin { sides: 3, is_pointed: true, is_round: false, is_sunk: false }, 1.0);
        let mut foot = Foot::default();
        if !self.own.is_empty() {
            skin = wood.skin(limb, detail);
            fit(&mut self.own, all, error);
            fuller = wood.fuller(limb, &self.own, skin.is_pointed);
            unfold(&mut self.own, matches!(limb.base, Base::Ground { .. }));
            let asked = Wood::foot(limb, detail).below_branches(&self.own);
            foot = Some(asked).filter(|f| f.shows(&self.own, (skin.sides, error))).unwrap_or_default();
            self.rings.extend_from_slice(&self.own);
        }
        self.shapes.push(Shape { rings: first..self.rings.len(), skin, fuller, left: 1.0, foot });
    }
}
