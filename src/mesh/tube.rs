//! Wood: tubes swept along the chains by rotation-minimizing frames.
//!
//! Each chain is one skin of welded rings with a doubled column where the texture closes. A branch starts on its
//! parent's axis and leaves the parent's surface through a collar a bit wider than itself, so that no gap shows and no
//! vertices have to be stitched; its end is a cone. A stem's base is open downward, level with the ground, and flares.
//! Bark is as fine on a twig as on the trunk, within a fifth: how it closes round them is told in `bark_uv.rs`.

use std::ops::Range;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::bareness::bareness;
use super::bark_uv::{ABOVE, BarkScale};
use super::fit::fit;
use super::rings::{Base, Ring, Scratch, add_rings, taper, unfold};
use super::sides::sides;
use super::tangent::tangent_of;
use super::{CrownLight, Mesh};
use crate::base::{Frame, Seed, math};
use crate::plant::{ChainId, Plant, Posed};
use crate::preset::plan::{Forks, MeshParams};

/// How much wider a stem without a flare of its own gets at the ground, as a share of its radius.
const FLARE: f32 = 0.38;
/// How many times the error the thinnest wood may stray where leaves hide it: it is small on the screen. Not on bare
/// trees, of which it is what is seen.
const SLACK: f32 = 2.5;
/// Share of its error that the end of a coarse tube may be thick to close in a point.
const BLUNT: f32 = 0.4;
/// How upright a stem must be for its foot to be taken down to the ground: the rise of a metre of it, metres.
const LEANS: f32 = 0.15;
/// Chains that a thread takes at once.
const PART: usize = 64;
/// Brightness of bark on the youngest wood, and the radii between which it grows old, metres.
const YOUNG: (f32, f32, f32) = (0.62, 0.004, 0.03);

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

/// The radii that a chain is meshed with, one a point, metres: as the plant has them, but where a branch has left the wood
/// does not thin at once.
#[must_use]
pub fn meshed_radii(plant: &Plant, posed: &Posed, id: ChainId) -> Vec<f32> {
    let mut radii = plant.radii(id).to_vec();
    taper(posed.chain(plant, id), &mut radii, plant.chain(id).parent.is_none());
    radii
}

/// Adds all of `part` to `mesh`.
fn append(mesh: &mut Mesh, part: &Mesh) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend_from_slice(&part.positions);
    mesh.normals.extend_from_slice(&part.normals);
    mesh.tangents.extend_from_slice(&part.tangents);
    mesh.uvs.extend_from_slice(&part.uvs);
    mesh.occlusion.extend_from_slice(&part.occlusion);
    mesh.chains.extend_from_slice(&part.chains);
    mesh.indices.extend(part.indices.iter().map(|i| i + first));
}

/// Sines and cosines of the corners of polygons, and of the middles of their sides.
struct Circles {
    /// By sides, from three on, twice around: from whichever corner, those of once around lie in a row.
    all: Vec<Circle>,
}

struct Circle {
    corners: Vec<(f32, f32)>,
    middles: Vec<(f32, f32)>,
}

impl Circles {
    fn up_to(sides: u32) -> Self {
        let at = |k: f32, n: u32| math::sin_cos(std::f32::consts::TAU * k / n as f32);
        let one = |n: u32| {
            let corners: Vec<(f32, f32)> = (0..n).map(|k| at(k as f32, n)).collect();
            let middles: Vec<(f32, f32)> = (0..n).map(|k| at(k as f32 + 0.5, n)).collect();
            Circle { corners: corners.repeat(2), middles: middles.repeat(2) }
        };
        Self { all: (3..=sides.clamp(3, 64)).map(one).collect() }
    }

    fn of(&self, sides: u32) -> &Circle {
        &self.all[sides as usize - 3]
    }
}

/// A plant's wood, ready to be meshed at any detail: where rings may go is found once, for the finest.
#[derive(Clone, Debug)]
pub struct Wood<'a> {
    plant: &'a Plant,
    posed: &'a Posed,
    /// As wood is meshed ([`taper`]).
    radii: Vec<f32>,
    limbs: Vec<Limb>,
    rings: Vec<Ring>,
    bark: BarkScale,
    thickest: f32,
    thinnest: f32,
    /// See [`bareness`].
    pub(crate) bare: f32,
    /// The finest detail's error, metres.
    finest: f32,
}

/// What is known of a chain's skin before it is made.
#[derive(Clone, Copy, Debug)]
struct Limb {
    /// Where its rings lie; two or more, or none for a chain without length.
    rings: (u32, u32),
    base: Base,
    /// Largest radius, as the plant has it and as it is meshed, metres.
    own: f32,
    widest: f32,
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
        for id in plant.chain_ids() {
            taper(posed.chain(plant, id), &mut radii[plant.span(id)], plant.chain(id).parent.is_none());
        }
        let bark = BarkScale::of(plant, posed, finest.bark_tile);
        let bare = bareness(plant, posed);
        let mut wood = Self {
            plant,
            posed,
            radii,
            limbs: Vec::new(),
            rings: Vec::new(),
            bark,
            thickest,
            thinnest,
            bare,
            finest: finest.error,
        };
        let read = |ids: &[ChainId]| {
            let (mut limbs, mut rings, mut scratch) = (Vec::with_capacity(ids.len()), Vec::new(), Scratch::default());
            ids.iter().for_each(|&id| limbs.push(wood.limb(id, finest, &mut rings, &mut scratch)));
            (limbs, rings)
        };
        let ids: Vec<ChainId> = plant.chain_ids().collect();
        if rayon::current_num_threads() == 1 {
            let (limbs, rings) = read(&ids);
            return Self { limbs, rings, ..wood };
        }
        let parts: Vec<(Vec<Limb>, Vec<Ring>)> = ids.par_chunks(PART).map(read).collect();
        wood.limbs.reserve_exact(ids.len());
        wood.rings.reserve_exact(parts.iter().map(|part| part.1.len()).sum());
        for (limbs, rings) in parts {
            let first = wood.rings.len() as u32;
            wood.limbs.extend(limbs.into_iter().map(|limb| limb.moved(first)));
            wood.rings.extend(rings);
        }
        wood
    }

    /// Reads one chain.
    fn limb(&self, id: ChainId, finest: &TubeDetail, rings: &mut Vec<Ring>, scratch: &mut Scratch) -> Limb {
        let chain = self.plant.chain(id);
        let radii = &self.radii[self.plant.span(id)];
        let points = self.posed.chain(self.plant, id);
        let base = match chain.parent {
            Some(parent) => Base::Fork {
                axis: self.posed.tangent(parent, chain.location),
                parent: self
                    .posed
                    .curve(self.plant, parent)
                    .value(&self.radii[self.plant.span(parent)], f64::from(chain.location))
                    .max(self.thinnest),
                forks: finest.forks,
            },
            None => Base::Ground { flare: flare(points, radii) },
        };
        let widest = radii.iter().fold(self.thinnest, |a, &r| a.max(r));
        let first = rings.len() as u32;
        add_rings(rings, (points, radii), base, (self.error(widest, finest), self.thinnest), scratch);
        let own = self.plant.radii(id).iter().fold(0.0_f32, |a, &r| a.max(r));
        Limb { rings: (first, rings.len() as u32), base, own, widest }
    }

    /// How far a chain may stray, metres.
    fn error(&self, widest: f32, detail: &TubeDetail) -> f32 {
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
            if limb.own >= detail.min_radius && bears {
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
        let sides = |id: &ChainId| self.skin(&self.limbs[id.index()], detail).sides;
        let with_rings = kept.iter().filter(|id| !self.rings_of(&self.limbs[id.index()]).is_empty());
        let circles = Circles::up_to(with_rings.map(sides).max().unwrap_or(3));
        let sweep = |ids: &[ChainId]| {
            let (mut mesh, mut rings) = (Mesh::default(), Vec::new());
            ids.iter().for_each(|&id| self.sweep(id, (light, detail, &circles), &mut rings, &mut mesh));
            mesh
        };
        if rayon::current_num_threads() == 1 {
            return sweep(&kept);
        }
        let parts: Vec<Mesh> = kept.par_chunks(PART).map(sweep).collect();
        let total = |of: fn(&Mesh) -> usize| parts.iter().map(of).sum::<usize>();
        let (vertices, indices) = (total(|part| part.positions.len()), total(|part| part.indices.len()));
        let mut mesh = Mesh::default();
        mesh.positions.reserve_exact(vertices);
        mesh.normals.reserve_exact(vertices);
        mesh.tangents.reserve_exact(vertices);
        mesh.uvs.reserve_exact(vertices);
        mesh.occlusion.reserve_exact(vertices);
        mesh.chains.reserve_exact(vertices);
        mesh.indices.reserve_exact(indices);
        parts.iter().for_each(|part| append(&mut mesh, part));
        mesh
    }

    /// How many triangles [`mesh`](Self::mesh) makes at most, without making them: rings that would fold go on top of that,
    /// and they are few.
    #[must_use]
    pub fn count(&self, detail: &TubeDetail) -> usize {
        let of = |id: &ChainId| {
            let limb = &self.limbs[id.index()];
            let error = self.error(limb.widest, detail);
            let kept = self.rings_of(limb).iter().filter(|ring| is_kept(ring, error)).count();
            if kept == 0 { 0 } else { self.skin(limb, detail).triangles(kept) }
        };
        self.kept(detail).iter().map(of).sum()
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

    fn rings_of(&self, limb: &Limb) -> &[Ring] {
        &self.rings[limb.rings.0 as usize..limb.rings.1 as usize]
    }

    /// How a chain that has rings is skinned.
    fn skin(&self, limb: &Limb, detail: &TubeDetail) -> Skin {
        Skin {
            sides: sides(limb.widest, self.thickest, detail, self.error(limb.widest, detail)),
            // A thin end closes in one point, a thick one gets a blunt cone behind its last ring.
            is_pointed: self.is_pointed(limb, detail.error),
        }
    }

    /// Whether a chain that has rings ends in a point. Of coarse tubes not all that the error lets be one: a broken limb would
    /// be a needle.
    fn is_pointed(&self, limb: &Limb, error: f32) -> bool {
        let most = self.finest.max(error * BLUNT).max(self.thinnest * 1.5);
        self.rings[limb.rings.1 as usize - 1].radius <= most
    }

    /// By how much the rings that a coarse tube keeps are to be wider, to cover what all of them do: a twig that has lost the
    /// ring before its point would be a cone from its base on.
    fn fuller(&self, limb: &Limb, kept: &[Ring], is_pointed: bool) -> f32 {
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

    /// How bright wood of a radius is at a place: twigs have no bark yet, and are darker than the pale bark of some stems.
    fn shade(light: &CrownLight, place: Vec3, radius: f32) -> u8 {
        let (young, thin, thick) = YOUNG;
        let age = young + (1.0 - young) * math::smoothstep(thin, thick, radius);
        (f32::from(light.shade(place)) * age + 0.5) as u8
    }

    /// The radius of a stem above its flare, metres.
    fn above_flare(&self, id: ChainId) -> f32 {
        let radii = &self.radii[self.plant.span(id)];
        self.posed.curve(self.plant, id).value(radii, ABOVE).min(radii[0])
    }

    /// Adds one chain's skin; `rings` are used again.
    fn sweep(
        &self,
        id: ChainId,
        (light, detail, circles): (&CrownLight, &TubeDetail, &Circles),
        rings: &mut Vec<Ring>,
        mesh: &mut Mesh,
    ) {
        let limb = &self.limbs[id.index()];
        let (base, error) = (limb.base, self.error(limb.widest, detail));
        rings.clear();
        rings.extend(self.rings_of(limb).iter().filter(|ring| is_kept(ring, error)));
        if rings.is_empty() {
            return;
        }
        let skin = self.skin(limb, detail);
        let Skin { sides, is_pointed } = skin;
        fit(rings, self.rings_of(limb), error);
        let fuller = self.fuller(limb, rings, is_pointed);
        unfold(rings, matches!(base, Base::Ground { .. }));
        // Those that have vertices all round.
        let body = &rings[..rings.len() - usize::from(is_pointed)];
        let (first, tip) = (rings[0], rings[rings.len() - 1]);
        let foot = self.posed.chain(self.plant, id)[0];
        let columns = sides as usize + 1;
        let circle = circles.of(sides);
        // As wide in the mean of all views as what is round: the corners of a prism of three sides stand 21 % out. With
        // corners on the circle it would cover 17 % too little, and twigs of coarse levels would fade. `sides` counts on it.
        let widened = std::f32::consts::PI / (sides as f32 * circle.middles[0].0);
        let girth = |radius: f32| std::f32::consts::TAU * radius;
        // A stem's flare goes round as often as the wood above it.
        let most = match base {
            Base::Ground { .. } => self.bark.around(girth(self.above_flare(id))).ceil(),
            Base::Fork { .. } => f32::MAX,
        };
        let around = |radius: f32| self.bark.around(girth(radius)).min(most);
        let mut v = Seed::new(0).child("bark").at(u64::from(id.0)).unit();
        let mut frame = if self.plant.chain(id).parent.is_some() { self.posed.frame(id, 0.0) } else { Frame::WORLD };
        frame = frame.transported(first.tangent);
        let once = &circle.corners[..sides as usize];
        let turn = if self.plant.chain(id).parent.is_some() { uppermost(once, frame) } else { 0 };
        let (corners, middles) = (&circle.corners[turn..][..columns], &circle.middles[turn..][..sides as usize]);
        let mut density_before = None;
        let mut last = first;
        let start = mesh.positions.len() as u32;
        let vertices = body.len() * columns + sides as usize;
        mesh.positions.reserve(vertices);
        mesh.normals.reserve(vertices);
        mesh.tangents.reserve(vertices);
        mesh.uvs.reserve(vertices);
        mesh.occlusion.reserve(vertices);
        mesh.indices.reserve(skin.triangles(rings.len()) * 3);
        // The wood's own normals, before they lean on the parent's, up to the last ring that does.
        let leaning = body.iter().rposition(|ring| !base.is_clear_of(foot, ring)).map_or(0, |i| i + 1);
        let mut own: Vec<Vec3> = Vec::with_capacity((leaning + 1).min(body.len()) * columns);
        for (j, ring) in body.iter().enumerate() {
            frame = frame.transported(ring.tangent);
            let (here, girth) = (around(ring.radius), girth(ring.radius));
            let density = here / girth.max(1e-6);
            v -= last.centre.distance(ring.centre) * 0.5 * (density + density_before.unwrap_or(density));
            density_before = Some(density);
            let shade = Self::shade(light, ring.centre, ring.radius);
            let slope = ring.slope.clamp(-2.0, 2.0);
            // Normals stand at one angle to the axis all round.
            let (across, along) = (1.0 / (1.0 + slope * slope).sqrt(), frame.y * -slope);
            for (k, &(sin, cos)) in corners.iter().enumerate() {
                let radial = frame.x * cos - frame.z * sin;
                // From the side that lies opposite the seam, so that changes of the number shear the least.
                let u = here * (k as f32 / sides as f32 - 0.5);
                let normal = (radial + along) * across;
                let place = ring.centre + radial * ((ring.radius * fuller + detail.added) * widened);
                // Round the wood u grows, against its way v does.
                let around = frame.x * -sin - frame.z * cos;
                let mut seen = (normal, [around.x, around.y, around.z, 1.0]);
                if j <= leaning {
                    own.push(normal);
                }
                if j < leaning {
                    let leant = base.blended(foot, place, normal, ring.radius);
                    seen = (leant, tangent_of(leant, around, -frame.y));
                }
                push(mesh, place, seen, Vec2::new(u, v), shade);
            }
            last = *ring;
        }
        if matches!(base, Base::Ground { .. }) {
            let density = around(first.radius) / girth(first.radius).max(1e-6);
            set_down(mesh, start as usize..start as usize + columns, (foot.y, first.tangent), density);
        }
        let columns = columns as u32;
        for j in 0..body.len() as u32 - 1 {
            for k in 0..sides {
                let a = start + j * columns + k;
                let (b, c, d) = (a + 1, a + columns, a + columns + 1);
                mesh.indices.extend([a, b, d, a, d, c]);
                if (j as usize) < leaning {
                    for t in [[a, b, d], [a, d, c]] {
                        if is_lit_from_behind(mesh, t) {
                            for i in t.map(|i| i as usize) {
                                let [x, y, z, _] = mesh.tangents[i];
                                let growing = Vec3::new(x, y, z);
                                mesh.normals[i] = own[i - start as usize];
                                mesh.tangents[i] = tangent_of(mesh.normals[i], growing, growing.cross(mesh.normals[i]));
                            }
                        }
                    }
                }
            }
        }
        let apex = if is_pointed { tip.centre } else { tip.centre + frame.y * (tip.radius * 0.6) };
        let height = apex.distance(last.centre).max(self.thinnest);
        v -= height * density_before.unwrap_or(0.0);
        let shade = Self::shade(light, apex, last.radius);
        let rim = start + (body.len() as u32 - 1) * columns;
        let apexes = mesh.positions.len() as u32;
        for (k, &(sin, cos)) in (0..).zip(middles) {
            // Each side of the cone has a tip of its own, so that its texture is not pinched to one column.
            let radial = frame.x * cos + frame.z * -sin;
            let normal = (radial + frame.y * (last.radius / height).min(2.0)).normalize_or(radial);
            let u = around(last.radius) * ((k as f32 + 0.5) / sides as f32 - 0.5);
            let tangent = tangent_of(normal, frame.x * -sin - frame.z * cos, -frame.y);
            push(mesh, apex, (normal, tangent), Vec2::new(u, v), shade);
            mesh.indices.extend([rim + k, rim + k + 1, apexes + k]);
        }
        mesh.chains.resize(mesh.positions.len(), id.0);
    }
}

/// Takes the first ring of a leaning stem, which is square to it, down to the ground all round: along the stem it would be a spur,
/// and straight down flat. `density` is of bark, repeats a metre.
fn set_down(mesh: &mut Mesh, ring: Range<usize>, (ground, tangent): (f32, Vec3), density: f32) {
    if tangent.y <= LEANS {
        return;
    }
    let way = (tangent + Vec3::Y).normalize_or(Vec3::Y);
    for (place, uv) in mesh.positions[ring.clone()].iter_mut().zip(&mut mesh.uvs[ring]) {
        let down = ((place.y - ground) / way.y).max(0.0);
        *place -= way * down;
        uv.y += down * density;
    }
}

/// What a chain's skin is like.
#[derive(Clone, Copy, Debug)]
struct Skin {
    sides: u32,
    /// Whether its end closes in one point.
    is_pointed: bool,
}

impl Skin {
    /// Of so many rings.
    fn triangles(&self, rings: usize) -> usize {
        (2 * (rings - usize::from(self.is_pointed)) - 1) * self.sides as usize
    }
}

impl Limb {
    /// With its rings that much farther back.
    fn moved(self, by: u32) -> Self {
        Self { rings: (self.rings.0 + by, self.rings.1 + by), ..self }
    }
}

/// Whether a ring is needed under a bound.
fn is_kept(ring: &Ring, error: f32) -> bool {
    error <= 0.0 || ring.worth > error
}

/// Whether a triangle faces away from the normals of all its corners.
fn is_lit_from_behind(mesh: &Mesh, triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
    let face = (b - a).cross(c - a);
    triangle.iter().all(|&i| mesh.normals[i as usize].dot(face) < 0.0)
}

fn push(mesh: &mut Mesh, position: Vec3, (normal, tangent): (Vec3, [f32; 4]), uv: Vec2, shade: u8) {
    mesh.positions.push(position);
    mesh.normals.push(normal);
    mesh.tangents.push(tangent);
    mesh.uvs.push(uv);
    mesh.occlusion.push(shade);
}

/// The corner of a ring that lies uppermost.
fn uppermost(circle: &[(f32, f32)], frame: Frame) -> usize {
    let up = |&k: &usize| circle[k].1 * frame.x.y - circle[k].0 * frame.z.y;
    (0..circle.len()).max_by(|a, b| up(a).total_cmp(&up(b)).then(b.cmp(a))).unwrap_or(0)
}

/// The flare that a stem still needs: none when its own radii widen at the ground, as a scan's do.
fn flare(points: &[Vec3], radii: &[f32]) -> f32 {
    let curve = crate::plant::Curve::new(points);
    let length = curve.length();
    if length <= 0.0 {
        return 0.0;
    }
    let above = curve.value(radii, f64::from((radii[0] * 3.0 / length).min(0.5)));
    let own = if above > 0.0 { (radii[0] / above - 1.1).max(0.0) } else { FLARE };
    (FLARE - own).max(0.0)
}
