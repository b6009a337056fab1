//! Wood: tubes swept along the chains by rotation-minimizing frames.
//!
//! Each chain is one skin of welded rings with a doubled column where the texture closes. A branch starts on its
//! parent's axis and leaves the parent's surface through a collar a bit wider than itself, so that no gap shows and no
//! vertices have to be stitched; its end is a cone. A stem's base is open downward, level with the ground, and flares.
//! Bark is as fine on a twig as on the trunk, within a fifth: how it closes round them is told in `bark_uv.rs`.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::bark_uv::{ABOVE, BarkScale};
use super::rings::{Base, Ring, rings, taper};
use super::sides::sides;
use super::{CrownLight, Mesh};
use crate::base::{Frame, Seed, math};
use crate::plant::{ChainId, Plant, Posed};
use crate::preset::plan::{Forks, MeshParams};

/// How much wider a stem without a flare of its own gets at the ground, as a share of its radius.
const FLARE: f32 = 0.38;
/// How many times the error the thinnest wood may stray: it is small on the screen, and hung with leaves.
const SLACK: f32 = 2.5;
/// Brightness of bark on the youngest wood, and the radii between which it grows old, metres.
const YOUNG: (f32, f32, f32) = (0.62, 0.004, 0.03);

/// How finely wood is meshed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeDetail {
    /// Sides of the thickest tube, 3..=64.
    pub sides: u32,
    /// Largest distance between the tube and the smooth branch, metres; twigs may stray up to two and a half times as
    /// far. 0 keeps every ring.
    pub error: f32,
    /// Chains whose base is thinner than this are dropped with all that they bear, metres.
    pub min_radius: f32,
    /// Edge of one bark tile on the trunk, metres.
    pub bark_tile: f32,
    /// How branches leave their parents.
    pub forks: Forks,
}

impl TubeDetail {
    /// The finest level of a preset.
    #[must_use]
    pub fn full(params: &MeshParams) -> Self {
        Self {
            sides: params.sides,
            error: params.error,
            min_radius: 0.0,
            bark_tile: params.bark_tile,
            forks: params.forks,
        }
    }
}

/// Meshes a plant's wood. Linear in points; same bytes on any number of threads. Tangents are left to
/// [`add_tangents`](super::add_tangents).
#[must_use]
pub fn tubes(plant: &Plant, posed: &Posed, detail: &TubeDetail) -> Mesh {
    tubes_in(plant, posed, &CrownLight::of(plant, posed), detail)
}

/// As [`tubes`], where the crown's light is known.
#[must_use]
pub fn tubes_in(plant: &Plant, posed: &Posed, light: &CrownLight, detail: &TubeDetail) -> Mesh {
    let scene = Scene::of(plant, posed, detail);
    let circles = Circles::up_to(detail.sides);
    let mut mesh = Mesh::default();
    if rayon::current_num_threads() == 1 {
        scene.kept.iter().for_each(|&id| scene.sweep(id, light, &circles, &mut mesh));
        return mesh;
    }
    let parts: Vec<Mesh> = scene
        .kept
        .par_chunks(64)
        .map(|ids| {
            let mut mesh = Mesh::default();
            ids.iter().for_each(|&id| scene.sweep(id, light, &circles, &mut mesh));
            mesh
        })
        .collect();
    let total = |of: fn(&Mesh) -> usize| parts.iter().map(of).sum::<usize>();
    let (vertices, indices) = (total(|part| part.positions.len()), total(|part| part.indices.len()));
    mesh.positions.reserve_exact(vertices);
    mesh.normals.reserve_exact(vertices);
    mesh.uvs.reserve_exact(vertices);
    mesh.occlusion.reserve_exact(vertices);
    mesh.chains.reserve_exact(vertices);
    mesh.indices.reserve_exact(indices);
    parts.iter().for_each(|part| append(&mut mesh, part));
    mesh
}

/// How many triangles [`tubes`] makes, without making them; several times faster, for who looks for a detail.
#[must_use]
pub fn count_tubes(plant: &Plant, posed: &Posed, detail: &TubeDetail) -> usize {
    let scene = Scene::of(plant, posed, detail);
    let of = |id: &ChainId| scene.skin(*id).map_or(0, |skin| skin.triangles());
    scene.kept.par_iter().with_min_len(64).map(of).sum()
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
    mesh.uvs.extend_from_slice(&part.uvs);
    mesh.occlusion.extend_from_slice(&part.occlusion);
    mesh.chains.extend_from_slice(&part.chains);
    mesh.indices.extend(part.indices.iter().map(|i| i + first));
}

/// Sines and cosines of the corners of polygons, and of the middles of their sides.
struct Circles {
    /// By sides, from three on: the corners, the first once more as the last.
    corners: Vec<Vec<(f32, f32)>>,
    middles: Vec<Vec<(f32, f32)>>,
}

impl Circles {
    fn up_to(sides: u32) -> Self {
        let all = 3..=sides.clamp(3, 64);
        let at = |k: f32, n: u32| math::sin_cos(std::f32::consts::TAU * k / n as f32);
        Self {
            corners: all.clone().map(|n| (0..=n).map(|k| at((k % n) as f32, n)).collect()).collect(),
            middles: all.map(|n| (0..n).map(|k| at(k as f32 + 0.5, n)).collect()).collect(),
        }
    }
}

struct Scene<'a> {
    plant: &'a Plant,
    posed: &'a Posed,
    /// Chains that are not dropped, parents first.
    kept: Vec<ChainId>,
    /// The radii of those, where the plant has its own.
    radii: Vec<f32>,
    detail: &'a TubeDetail,
    bark: BarkScale,
    thickest: f32,
    thinnest: f32,
}

/// What is known of a chain's skin before it is made.
struct Skin {
    rings: Vec<Ring>,
    base: Base,
    sides: u32,
    /// Whether its end closes in one point.
    is_pointed: bool,
}

impl Skin {
    /// The rings that have vertices all round.
    fn body(&self) -> &[Ring] {
        &self.rings[..self.rings.len() - usize::from(self.is_pointed)]
    }

    fn triangles(&self) -> usize {
        (2 * self.body().len() - 1) * self.sides as usize
    }
}

impl<'a> Scene<'a> {
    fn of(plant: &'a Plant, posed: &'a Posed, detail: &'a TubeDetail) -> Self {
        let thickest = plant.all_radii().iter().fold(0.0_f32, |a, &r| a.max(r));
        let reach = posed.positions().iter().fold(0.0_f32, |a, p| a.max(p.abs().max_element()));
        // Below this, coordinates of 24 bits can't tell the corners of a ring apart.
        let thinnest = (reach * 2e-5).max(thickest * 1e-3).max(1e-5);
        let mut is_kept = vec![false; plant.chains().len()];
        let mut kept = Vec::with_capacity(is_kept.len());
        let mut radii = plant.all_radii().to_vec();
        for id in plant.chain_ids() {
            let (chain, span) = (plant.chain(id), plant.span(id));
            let own = &mut radii[span];
            let thick = own.iter().fold(0.0_f32, |a, &r| a.max(r)) >= detail.min_radius;
            if thick && chain.parent.is_none_or(|p| is_kept[p.index()]) {
                is_kept[id.index()] = true;
                kept.push(id);
                taper(posed.chain(plant, id), own, chain.parent.is_none());
            }
        }
        let bark = BarkScale::of(plant, posed, detail.bark_tile);
        Self { plant, posed, kept, radii, detail, bark, thickest, thinnest }
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

    /// Where the rings of one chain go; none for a chain without length.
    fn skin(&self, id: ChainId) -> Option<Skin> {
        let chain = self.plant.chain(id);
        let radii = &self.radii[self.plant.span(id)];
        let points = self.posed.chain(self.plant, id);
        let base = match chain.parent {
            Some(parent) => Base::Fork {
                axis: self.posed.tangent(parent, chain.location),
                parent: self
                    .posed
                    .curve(self.plant, parent)
                    .value(&self.radii[self.plant.span(parent)], f64::from(chain.location)),
                forks: self.detail.forks,
            },
            None => Base::Ground { flare: flare(points, radii) },
        };
        let widest = radii.iter().fold(self.thinnest, |a, &r| a.max(r));
        let share = (widest / self.thickest.max(1e-9)).clamp(0.0, 1.0).sqrt();
        let error = self.detail.error * (1.0 + (SLACK - 1.0) * (1.0 - math::smoothstep(0.15, 0.45, share)));
        let rings = rings(points, radii, base, error, self.thinnest);
        let tip = rings.last()?;
        let sides = sides(widest, self.thickest, self.detail.sides, self.detail.error);
        // A thin end closes in one point, a thick one gets a blunt cone behind its last ring.
        let is_pointed = tip.radius <= (self.detail.error).max(self.thinnest * 1.5);
        Some(Skin { rings, base, sides, is_pointed })
    }

    /// Adds one chain's skin.
    fn sweep(&self, id: ChainId, light: &CrownLight, circles: &Circles, mesh: &mut Mesh) {
        let Some(skin) = self.skin(id) else { return };
        let Skin { ref rings, base, sides, is_pointed } = skin;
        let body = skin.body();
        let (first, tip) = (rings[0], rings[rings.len() - 1]);
        let foot = self.posed.chain(self.plant, id)[0];
        let circle = &circles.corners[sides as usize - 3];
        // As wide in the mean of all views as what is round: the corners of a prism of three sides stand 21 % out. With
        // corners on the circle it would cover 17 % too little, and twigs of coarse levels would fade.
        let widened = std::f32::consts::PI / (sides as f32 * circles.middles[sides as usize - 3][0].0);
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
        let turn = if self.plant.chain(id).parent.is_some() { uppermost(circle, frame) } else { 0 };
        let corner = |k: u32| circle[((k + turn) % sides) as usize];
        let middle = |k: u32| circles.middles[sides as usize - 3][((k + turn) % sides) as usize];
        let mut density_before = None;
        let mut last = first;
        let start = mesh.positions.len() as u32;
        let vertices = body.len() * circle.len() + sides as usize;
        mesh.positions.reserve(vertices);
        mesh.normals.reserve(vertices);
        mesh.uvs.reserve(vertices);
        mesh.occlusion.reserve(vertices);
        mesh.indices.reserve(skin.triangles() * 3);
        // The wood's own normals, before they lean on the parent's, up to the last ring that does.
        let leaning = body.iter().rposition(|ring| !base.is_clear_of(foot, ring)).map_or(0, |i| i + 1);
        let mut own: Vec<Vec3> = Vec::with_capacity((leaning + 1).min(body.len()) * circle.len());
        for (j, ring) in body.iter().enumerate() {
            frame = frame.transported(ring.tangent);
            let (here, girth) = (around(ring.radius), girth(ring.radius));
            let density = here / girth.max(1e-6);
            v -= last.centre.distance(ring.centre) * 0.5 * (density + density_before.unwrap_or(density));
            density_before = Some(density);
            let shade = Self::shade(light, ring.centre, ring.radius);
            let slope = frame.y * ring.slope.clamp(-2.0, 2.0);
            for k in 0..=sides {
                let (sin, cos) = corner(k);
                let radial = frame.x * cos + frame.z * -sin;
                // From the side that lies opposite the seam, so that changes of the number shear the least.
                let u = here * (k as f32 / sides as f32 - 0.5);
                let mut normal = (radial - slope).normalize_or(radial);
                let place = ring.centre + radial * (ring.radius * widened);
                if j <= leaning {
                    own.push(normal);
                }
                if j < leaning {
                    normal = base.blended(foot, place, normal, ring.radius);
                }
                push(mesh, place, normal, Vec2::new(u, v), shade);
            }
            last = *ring;
        }
        let columns = sides + 1;
        for j in 0..body.len() as u32 - 1 {
            for k in 0..sides {
                let a = start + j * columns + k;
                let (b, c, d) = (a + 1, a + columns, a + columns + 1);
                mesh.indices.extend([a, b, d, a, d, c]);
                if (j as usize) < leaning {
                    for t in [[a, b, d], [a, d, c]] {
                        if is_lit_from_behind(mesh, t) {
                            t.iter().for_each(|&i| mesh.normals[i as usize] = own[(i - start) as usize]);
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
        for k in 0..sides {
            let (sin, cos) = middle(k);
            // Each side of the cone has a tip of its own, so that its texture is not pinched to one column.
            let radial = frame.x * cos + frame.z * -sin;
            let normal = (radial + frame.y * (last.radius / height).min(2.0)).normalize_or(radial);
            let u = around(last.radius) * ((k as f32 + 0.5) / sides as f32 - 0.5);
            push(mesh, apex, normal, Vec2::new(u, v), shade);
            mesh.indices.extend([rim + k, rim + k + 1, apexes + k]);
        }
        mesh.chains.resize(mesh.positions.len(), id.0);
    }
}

/// Whether a triangle faces away from the normals of all its corners.
fn is_lit_from_behind(mesh: &Mesh, triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
    let face = (b - a).cross(c - a);
    triangle.iter().all(|&i| mesh.normals[i as usize].dot(face) < 0.0)
}

fn push(mesh: &mut Mesh, position: Vec3, normal: Vec3, uv: Vec2, shade: u8) {
    mesh.positions.push(position);
    mesh.normals.push(normal);
    mesh.uvs.push(uv);
    mesh.occlusion.push(shade);
}

/// The corner of a ring that lies uppermost.
fn uppermost(circle: &[(f32, f32)], frame: Frame) -> u32 {
    let up = |&k: &usize| circle[k].1 * frame.x.y - circle[k].0 * frame.z.y;
    (0..circle.len() - 1).max_by(|a, b| up(a).total_cmp(&up(b)).then(b.cmp(a))).unwrap_or(0) as u32
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
