//! Wood: tubes swept along the chains by rotation-minimizing frames.
//!
//! Each chain is one skin of welded rings with a doubled column where the texture closes. A branch starts in its parent's
//! wood as that is meshed (`bearer.rs`) and leaves the parent's surface through a collar a bit wider than itself, so that no
//! gap shows and no vertices have to be stitched; its end is a cone. A stem's base is open downward, level with the ground
//! or below it, and flares.
//! Bark is as fine on a twig as on the trunk, within a fifth: how it closes round them is told in `bark_uv.rs`.

use glam::Vec3;
use rayon::prelude::*;

use super::bareness::bareness;
use super::bark_uv::{ABOVE, BarkScale};
use super::bearer::NARROW;
use super::rings::{Base, Ring, Scratch, Shoulder, add_rings, span_at, taper};
use super::roots::{self, Foot};
use super::shapes::Shapes;
use super::sides::{out_of_middles, sides};
use super::{CrownLight, Mesh};
use crate::base::{is_alone, math};
use crate::plant::{ChainId, Plant, Posed};
use crate::preset::plan::{Forks, MeshParams};

/// How many times the error the thinnest wood may stray where leaves hide it: it is small on the screen. Not on bare
/// trees, of which it is what is seen.
const SLACK: f32 = 2.5;
/// Share of its error that the end of a coarse tube may be thick to close in a point.
const BLUNT: f32 = 0.4;
/// Chains that a thread takes at once.
pub(super) const PART: usize = 64;

/// How finely wood is meshed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeDetail {
    /// Sides of the thickest tube, 3..=64.
    pub sides: u32,
    /// How many a tube may have where so few would stray further than `error`, `sides`..=64.
    pub most_sides: u32,
    /// Largest distance between the tube and the smooth branch, metres; twigs in leaf may stray up to two and a half times
    /// as far. 0 keeps every ring.
    pub error: f32,
    /// Chains whose base is thinner than this are dropped with all that they bear, metres.
    pub min_radius: f32,
    /// Edge of one bark tile on the trunk, metres.
    pub bark_tile: f32,
    /// How branches leave their parents.
    pub forks: Forks,
    /// Added to every radius, metres, 0 or more: wood that is left makes up for twigs that were dropped.
    pub added: f32,
    /// How far stems go on straight down from the ground, metres, 0 or more: on a slope none ends in the air.
    pub below: f32,
    /// Share of a foot's flare that is drawn out into roots, 0..=1.
    pub roots: f32,
    /// How much wider, as a share of its radius, a stem's foot gets that is not so much wider by itself.
    pub flare: f32,
}

impl TubeDetail {
    /// The finest level of a preset.
    #[must_use]
    pub const fn full(params: &MeshParams) -> Self {
        Self {
            sides: params.sides,
            most_sides: params.most_sides,
            error: params.error,
            min_radius: 0.0,
            bark_tile: params.bark_tile,
            forks: params.forks,
            added: 0.0,
            below: params.below,
            roots: params.roots,
            flare: params.flare,
        }
    }
}

/// Meshes a plant's wood, tangents included. Linear in points; same bytes on any number of threads.
#[must_use]
pub fn tubes(plant: &Plant, posed: &Posed, detail: &TubeDetail) -> Mesh {
    tubes_in(plant, posed, &CrownLight::of(plant, posed), detail)
}

/// As [`tubes`], where the crown's light is known.
#[must_use]
pub fn tubes_in(plant: &Plant, posed: &Posed, light: &CrownLight, detail: &TubeDetail) -> Mesh {
    Wood::of(plant, posed, detail).mesh(light, detail)
}

/// A plant's wood, ready to be meshed at any detail: where rings may go is found once, for the finest.
#[derive(Clone, Debug)]
pub struct Wood<'a> {
    pub(super) plant: &'a Plant,
    pub(super) posed: &'a Posed,
    /// As wood is meshed ([`taper`]), but for shoulders.
    radii: Vec<f32>,
    /// Of the few chains that have any, in the chains' order.
    shoulders: Vec<(ChainId, Vec<Shoulder>)>,
    pub(super) limbs: Vec<Limb>,
    rings: Vec<Ring>,
    pub(super) bark: BarkScale,
    /// The largest radius of the plant, metres.
    pub(crate) thickest: f32,
    pub(super) thinnest: f32,
    /// See [`bareness`].
    pub(crate) bare: f32,
    /// The finest detail's error, metres.
    finest: f32,
    /// Which chains are part of meshes.
    pub(crate) shown: Vec<bool>,
}

/// What is known of a chain's skin before it is made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limb {
    /// Where its rings lie; two or more, or none for a chain without length.
    rings: (u32, u32),
    pub(super) base: Base,
    /// Largest radius, as the plant has it and as it is meshed, metres.
    own: f32,
    pub(super) widest: f32,
    /// Where roots may be, with all of the flare for a share; branches have none.
    foot: Foot,
    /// Whether its bearer has no room for its base, which is closed then.
    is_exposed: bool,
}

impl<'a> Wood<'a> {
    /// Wood that is to be meshed at no finer detail than this, with these forks and this bark. Linear in points.
    #[must_use]
    pub fn of(plant: &'a Plant, posed: &'a Posed, finest: &TubeDetail) -> Self {
        let thickest = plant.all_radii().iter().fold(0.0_f32, |a, &r| a.max(r));
        let reach = posed.positions().iter().fold(0.0_f32, |a, p| a.max(p.abs().max_element()));
        // Below this, coordinates of 24 bits can't tell the corners of a ring apart.
        let thinnest = (reach * 2e-5).max(thickest * 1e-3).max(1e-5);
        let mut radii = plant.all_radii().to_vec();
        let (mut shoulders, mut found) = (Vec::new(), Vec::new());
        for id in plant.chain_ids() {
            let is_stem = plant.chain(id).parent.is_none();
            taper(posed.chain(plant, id), &mut radii[plant.span(id)], is_stem, &mut found);
            if !found.is_empty() {
                shoulders.push((id, std::mem::take(&mut found)));
            }
        }
        let bark = BarkScale::of(plant, posed, finest.bark_tile);
        let bare = bareness(plant, posed);
        let mut wood = Self {
            plant,
            posed,
            radii,
            shoulders,
            limbs: Vec::new(),
            rings: Vec::new(),
            bark,
            thickest,
            thinnest,
            bare,
            finest: finest.error,
            shown: vec![true; plant.chains().len()],
        };
        let read = |ids: &[ChainId]| {
            let (mut limbs, mut rings, mut scratch) = (Vec::with_capacity(ids.len()), Vec::new(), Scratch::default());
            ids.iter().for_each(|&id| limbs.push(wood.limb(id, finest, &mut rings, &mut scratch)));
            (limbs, rings)
        };
        let ids: Vec<ChainId> = plant.chain_ids().collect();
        if is_alone() {
            let (limbs, rings) = read(&ids);
            return Self { limbs, rings, ..wood }.with_exposed_bases(finest);
        }
        let parts: Vec<(Vec<Limb>, Vec<Ring>)> = ids.par_chunks(PART).map(read).collect();
        wood.limbs.reserve_exact(ids.len());
        wood.rings.reserve_exact(parts.iter().map(|part| part.1.len()).sum());
        for (limbs, rings) in parts {
            let first = wood.rings.len() as u32;
            wood.limbs.extend(limbs.into_iter().map(|limb| limb.moved(first)));
            wood.rings.extend(rings);
        }
        wood.with_exposed_bases(finest)
    }

    /// Of these chains alone.
    pub(crate) fn only(&self, shown: Vec<bool>) -> Self {
        Self { shown, ..self.clone() }
    }

    fn with_exposed_bases(mut self, finest: &TubeDetail) -> Self {
        // Of bearers, once they are asked for.
        let mut skins = vec![None; self.limbs.len()];
        for id in self.plant.chain_ids() {
            let chain = self.plant.chain(id);
            if let Some(parent) = chain.parent {
                self.limbs[id.index()].is_exposed = self.is_exposed((id, parent), &mut skins[parent.index()], finest);
                let (own, length) = (self.limbs[id.index()].own, self.length(&self.limbs[parent.index()]));
                let points = self.posed.chain(self.plant, id);
                let aside = points[points.len() - 1] - self.posed.chain(self.plant, parent)[0];
                self.limbs[parent.index()].foot.bears(length * chain.location, own, aside);
            }
        }
        self
    }

    fn shoulders_of(&self, id: ChainId) -> &[Shoulder] {
        let found = self.shoulders.binary_search_by_key(&id, |of| of.0);
        found.map_or(&[], |found| &self.shoulders[found].1)
    }

    /// How thick a chain is meshed at a share of its length, metres.
    fn radius_at(&self, id: ChainId, location: f32) -> f32 {
        let curve = self.posed.curve(self.plant, id);
        let own = curve.value(&self.radii[self.plant.span(id)], f64::from(location));
        let wider = |own, shoulder: &Shoulder| shoulder.radius(curve.length() * location, own);
        self.shoulders_of(id).iter().fold(own, wider)
    }

    /// Reads one chain.
    fn limb(&self, id: ChainId, finest: &TubeDetail, rings: &mut Vec<Ring>, scratch: &mut Scratch) -> Limb {
        let chain = self.plant.chain(id);
        let radii = &self.radii[self.plant.span(id)];
        let points = self.posed.chain(self.plant, id);
        let base = match chain.parent {
            Some(parent) => Base::Fork {
                axis: self.posed.tangent(parent, chain.location),
                parent: self.radius_at(parent, chain.location).max(self.thinnest),
                forks: finest.forks,
            },
            None => Base::Ground { flare: flare(points, radii, finest.flare) },
        };
        let widest = radii.iter().fold(self.thinnest, |a, &r| a.max(r));
        let first = rings.len() as u32;
        let shoulders = self.shoulders_of(id);
        add_rings(rings, (points, radii, shoulders), base, (self.error(widest, finest), self.thinnest), scratch);
        let own = self.plant.radii(id).iter().fold(0.0_f32, |a, &r| a.max(r));
        let foot = if chain.parent.is_none() { Foot::of(points, radii) } else { Foot::default() };
        Limb { rings: (first, rings.len() as u32), base, own, widest, foot, is_exposed: false }
    }

    /// Whether the wood that bears a chain is too thin there, or ends too near, for its first ring to lie within. `skin` is its
    /// bearer's, once it is known.
    fn is_exposed(&self, (id, parent): (ChainId, ChainId), skin: &mut Option<Skin>, finest: &TubeDetail) -> bool {
        let chain = self.plant.chain(id);
        let (limb, bearer) = (&self.limbs[id.index()], &self.limbs[parent.index()]);
        let (own, rings) = (self.rings_of(limb), self.rings_of(bearer));
        let [first, second, ..] = *own else { return false };
        let (Base::Fork { axis, .. }, [.., last]) = (limb.base, rings) else { return true };
        let arc = last.arc * chain.location;
        let span = span_at(rings, chain.location);
        let (a, b) = (&rings[span], &rings[span + 1]);
        let skin = skin.get_or_insert_with(|| self.skin(bearer, finest));
        let end = if skin.is_pointed && span + 2 == rings.len() { 0.0 } else { b.radius };
        let wood = (a.radius + (end - a.radius) * ((arc - a.arc) / (b.arc - a.arc))) * out_of_middles(skin.sides);
        // How far its ring reaches along the bearer.
        let way = (second.centre - first.centre).normalize_or_zero();
        let needed = first.radius * NARROW;
        let along = needed * (1.0 - way.dot(axis) * way.dot(axis)).max(0.0).sqrt();
        wood < needed || last.arc - arc < along
    }

    /// How far the base of a branch may stick out of its bearer, metres: not at all at the finest detail, and on coarser ones by the
    /// error, which is too little to be seen. Drawn in there, too, branches would cover up to 15 % less.
    pub(super) fn may_stick_out(&self, detail: &TubeDetail) -> f32 {
        if detail.error <= self.finest { 0.0 } else { detail.error }
    }

    /// Whether a chain's base is closed by a cap: what would be seen of it where it is open is more than the error.
    pub(super) fn is_capped(&self, id: ChainId, detail: &TubeDetail) -> bool {
        let limb = &self.limbs[id.index()];
        limb.is_exposed && self.rings[limb.rings.0 as usize].radius > self.may_stick_out(detail)
    }

    /// How far a chain may stray, metres.
    pub(super) fn error(&self, widest: f32, detail: &TubeDetail) -> f32 {
        let share = (widest / self.thickest.max(1e-9)).clamp(0.0, 1.0).sqrt();
        let slack = (SLACK - 1.0) * (1.0 - self.bare);
        detail.error * (1.0 + slack * (1.0 - math::smoothstep(0.15, 0.45, share)))
    }

    /// The chains that a detail does not drop, parents first.
    fn kept(&self, detail: &TubeDetail) -> Vec<ChainId> {
        let mut is_kept = vec![false; self.limbs.len()];
        let mut kept = Vec::with_capacity(self.limbs.len());
        for (id, limb) in self.plant.chain_ids().zip(&self.limbs) {
            let bears = self.plant.chain(id).parent.is_none_or(|p| is_kept[p.index()]);
            if self.shown[id.index()] && limb.own >= detail.min_radius && bears {
                is_kept[id.index()] = true;
                kept.push(id);
            }
        }
        kept
    }

    /// Its triangles: base to tip, parents first. Forks and bark are those that the wood was read with. The same bytes on any
    /// number of threads.
    #[must_use]
    pub fn mesh(&self, light: &CrownLight, detail: &TubeDetail) -> Mesh {
        let kept = self.kept(detail);
        let shapes = Shapes::of(self, &kept, detail);
        let sweep = |ids: &[ChainId], mesh: &mut Mesh| {
            let mut own = Vec::new();
            ids.iter().for_each(|&id| self.sweep(id, (light, detail, &shapes), &mut own, mesh));
        };
        if is_alone() {
            let (vertices, triangles) = shapes.size();
            let mut mesh = Mesh::with_room(vertices, 3 * triangles);
            sweep(&kept, &mut mesh);
            return mesh;
        }
        let part = |ids: &[ChainId]| {
            let mut mesh = Mesh::default();
            sweep(ids, &mut mesh);
            mesh
        };
        let parts: Vec<Mesh> = kept.par_chunks(PART).map(part).collect();
        let total = |of: fn(&Mesh) -> usize| parts.iter().map(of).sum::<usize>();
        let mut mesh = Mesh::with_room(total(|part| part.positions.len()), total(|part| part.indices.len()));
        parts.iter().for_each(|part| mesh.append(part));
        mesh
    }

    /// How many triangles [`mesh`](Self::mesh) makes at most, without making them: rings that would fold go on top of that,
    /// and they are few.
    #[must_use]
    pub fn count(&self, detail: &TubeDetail) -> usize {
        self.kept(detail).into_iter().map(|id| self.count_of(id, detail)).sum()
    }

    /// How many of them a chain has that is kept.
    pub(crate) fn count_of(&self, id: ChainId, detail: &TubeDetail) -> usize {
        let limb = &self.limbs[id.index()];
        let error = self.error(limb.widest, detail);
        let kept = self.rings_of(limb).iter().filter(|ring| is_kept(ring, error)).count();
        if kept == 0 { 0 } else { self.skin(limb, detail).triangles(kept, self.is_capped(id, detail)) }
    }

    /// Mean radius along the chains that are meshed, metres.
    pub(crate) fn mean_radius(&self, detail: &TubeDetail) -> f32 {
        let (mut area, mut length) = (0.0, 0.0);
        for id in self.kept(detail) {
            for [a, b] in self.rings_of(&self.limbs[id.index()]).array_windows() {
                let step = a.centre.distance(b.centre);
                area += (a.radius + b.radius) * 0.5 * step;
                length += step;
            }
        }
        if length > 0.0 { area / length } else { 0.0 }
    }

    pub(super) fn rings_of(&self, limb: &Limb) -> &[Ring] {
        &self.rings[limb.rings.0 as usize..limb.rings.1 as usize]
    }

    /// How a chain that has rings is skinned.
    pub(super) fn skin(&self, limb: &Limb, detail: &TubeDetail) -> Skin {
        let error = self.error(limb.widest, detail);
        let usual = sides(limb.widest, self.thickest, detail, error);
        let spread = Self::foot(limb, detail).spread(&self.rings[limb.rings.0 as usize]);
        // A thin end closes in one point, a thick one gets a blunt cone beyond its last ring, and one as thick as a trunk a dome.
        let is_pointed = self.is_pointed(limb, detail.error);
        Skin {
            sides: if spread > error { usual.max(roots::sides(usual).min(detail.most_sides)) } else { usual },
            is_pointed,
            is_round: !is_pointed && self.end(limb).radius >= error.max(self.thinnest) * THICK,
            is_sunk: detail.below > 0.0 && matches!(limb.base, Base::Ground { .. }),
        }
    }

    /// The foot of a stem at a detail.
    pub(super) fn foot(limb: &Limb, detail: &TubeDetail) -> Foot {
        limb.foot.with(detail.roots)
    }

    /// Along a chain, metres; 0 of one without rings.
    fn length(&self, limb: &Limb) -> f32 {
        self.rings_of(limb).last().map_or(0.0, |ring| ring.arc)
    }

    /// Whether a chain that has rings ends in a point. Of coarse tubes not all that the error lets be one: a broken limb would
    /// be a needle.
    fn is_pointed(&self, limb: &Limb, error: f32) -> bool {
        let most = self.finest.max(error * BLUNT).max(self.thinnest * 1.5);
        self.end(limb).radius <= most
    }

    /// The last ring of a chain that has some.
    fn end(&self, limb: &Limb) -> &Ring {
        &self.rings[limb.rings.1 as usize - 1]
    }

    /// By how much the rings that a coarse tube keeps are to be wider, to cover what all of them do: a twig that has lost the
    /// ring before its point would be a cone from its base on.
    pub(super) fn fuller(&self, limb: &Limb, kept: &[Ring], is_pointed: bool) -> f32 {
        let (all, was_pointed) = (self.rings_of(limb), self.is_pointed(limb, self.finest));
        if all.len() == kept.len() && is_pointed == was_pointed {
            return 1.0;
        }
        let area = |rings: &[Ring], is_pointed: bool| {
            let of = |(i, [a, b]): (usize, &[Ring; 2])| {
                let end = if is_pointed && i + 2 == rings.len() { 0.0 } else { b.radius };
                (a.radius + end) * a.centre.distance(b.centre)
            };
            rings.array_windows().enumerate().map(of).sum::<f32>()
        };
        let (all, kept) = (area(all, was_pointed), area(kept, is_pointed));
        if kept > 0.0 { (all / kept).clamp(0.5, 2.0) } else { 1.0 }
    }

    /// The radius of a stem above its flare, metres.
    pub(super) fn above_flare(&self, id: ChainId) -> f32 {
        let radii = &self.radii[self.plant.span(id)];
        self.posed.curve(self.plant, id).value(radii, ABOVE).min(radii[0])
    }
}

/// See [`Skin::dome`]; on an ellipsoid whose top is [`CROWN`] of the last ring's radius beyond it.
const DOME: [(f32, f32); 2] = [(0.5 * CROWN, 0.866), (0.866 * CROWN, 0.5)];
const CROWN: f32 = 0.9;
/// How high cones are on other ends, of the last ring's radius.
pub(super) const BLUNT_CONE: f32 = 0.6;
/// Ends of so many times the error are round: as cones they look sharpened.
const THICK: f32 = 8.0;

/// What a chain's skin is like.
#[derive(Clone, Copy, Debug)]
pub(super) struct Skin {
    pub(super) sides: u32,
    /// Whether its end closes in one point.
    pub(super) is_pointed: bool,
    /// Whether it is a dome.
    pub(super) is_round: bool,
    /// Whether it goes on below the ground.
    pub(super) is_sunk: bool,
}

impl Skin {
    /// Rings of a round end above the last one, below a cone: how far beyond it, and how wide, both of its radius.
    pub(super) fn dome(&self) -> &'static [(f32, f32)] {
        if self.is_round { &DOME } else { &[] }
    }

    /// How far the end is beyond the last ring, of its radius.
    pub(super) fn beyond(&self) -> f32 {
        match (self.is_pointed, self.is_round) {
            (true, _) => 0.0,
            (_, true) => CROWN,
            _ => BLUNT_CONE,
        }
    }

    /// Of so many rings, with a cap on its base or without.
    pub(super) fn triangles(&self, rings: usize, is_capped: bool) -> usize {
        let rings = rings - usize::from(self.is_pointed) + usize::from(self.is_sunk);
        (2 * (rings + self.dome().len()) - 1 + usize::from(is_capped)) * self.sides as usize
    }
}

impl Limb {
    /// With its rings that much farther back.
    fn moved(self, by: u32) -> Self {
        Self { rings: (self.rings.0 + by, self.rings.1 + by), ..self }
    }
}

/// Whether a ring is needed under a bound.
pub(super) fn is_kept(ring: &Ring, error: f32) -> bool {
    error <= 0.0 || ring.worth > error
}

/// The flare that a stem still needs: none when its own radii widen at the ground, as a scan's do.
fn flare(points: &[Vec3], radii: &[f32], wanted: f32) -> f32 {
    let curve = crate::plant::Curve::new(points);
    let length = curve.length();
    if length <= 0.0 {
        return 0.0;
    }
    let above = curve.value(radii, f64::from((radii[0] * 3.0 / length).min(0.5)));
    let own = if above > 0.0 { (radii[0] / above - 1.1).max(0.0) } else { wanted };
    (wanted - own).max(0.0)
}
