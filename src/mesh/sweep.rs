//! A tube's vertices: rings swept along the axis by rotation-minimizing frames, the cone or dome at its end, and the cap of a base
//! that nothing hides.

use glam::{Vec2, Vec3};

use super::bark_uv::{Bend, drawn_in};
use super::ground::{Ground, set_down, sink, stands};
use super::rings::{Base, span_at};
use super::roots::Roots;
use super::shapes::Shapes;
use super::sides::out_of_corners;
use super::tangent::tangent_of;
use super::tube::{BLUNT_CONE, Skin, TubeDetail, Wood};
use super::{CrownLight, Mesh};
use crate::base::{Frame, Seed, math};
use crate::plant::ChainId;

/// Brightness of bark on the youngest wood, and the radii between which it grows old, metres.
const YOUNG: (f32, f32, f32) = (0.75, 0.004, 0.03);

/// Sines and cosines of the corners of polygons, and of the middles of their sides.
#[derive(Debug)]
pub(super) struct Circles {
    /// By sides, from three on, twice around: from whichever corner, those of once around lie in a row.
    all: Vec<Circle>,
}

/// Of one polygon.
#[derive(Debug)]
pub(super) struct Circle {
    corners: Vec<(f32, f32)>,
    middles: Vec<(f32, f32)>,
}

impl Circles {
    pub(super) fn up_to(sides: u32) -> Self {
        let at = |k: f32, n: u32| math::sin_cos(std::f32::consts::TAU * k / n as f32);
        let one = |n: u32| {
            let corners: Vec<(f32, f32)> = (0..n).map(|k| at(k as f32, n)).collect();
            let middles: Vec<(f32, f32)> = (0..n).map(|k| at(k as f32 + 0.5, n)).collect();
            Circle { corners: corners.repeat(2), middles: middles.repeat(2) }
        };
        Self { all: (3..=sides.clamp(3, 64)).map(one).collect() }
    }

    pub(super) fn of(&self, sides: u32) -> &Circle {
        &self.all[sides as usize - 3]
    }
}

impl Wood<'_> {
    /// Adds one chain's skin; `own` is used again.
    pub(super) fn sweep(
        &self,
        id: ChainId,
        (light, detail, shapes): (&CrownLight, &TubeDetail, &Shapes),
        own: &mut Vec<Vec3>,
        mesh: &mut Mesh,
    ) {
        let limb = &self.limbs[id.index()];
        let base = limb.base;
        let Some((shape, rings)) = shapes.get(id) else { return };
        let (Skin { sides, is_pointed, is_sunk, .. }, fuller) = (shape.skin, shape.fuller);
        let dome = shape.skin.dome();
        // Those that have vertices all round.
        let body = &rings[..rings.len() - usize::from(is_pointed)];
        let (first, tip) = (rings[0], rings[rings.len() - 1]);
        let foot = self.posed.chain(self.plant, id)[0];
        let columns = sides as usize + 1;
        let circle = shapes.circles.of(sides);
        let widened = out_of_corners(sides);
        let girth = |radius: f32| std::f32::consts::TAU * radius;
        // A stem's flare goes round as often as the wood above it.
        let most = match base {
            Base::Ground { .. } => self.bark.around(girth(self.above_flare(id))).ceil(),
            Base::Fork { .. } => f32::MAX,
        };
        let around = |radius: f32| self.bark.around(girth(radius)).min(most);
        let mut v = Seed::new(0).child("bark").at(u64::from(id.0)).unit();
        let density = self.bark.along();
        let v_at_base = v;
        let mut frame = if self.plant.chain(id).parent.is_some() { self.posed.frame(id, 0.0) } else { Frame::WORLD };
        frame = frame.transported(first.tangent);
        let base_frame = frame;
        let once = &circle.corners[..sides as usize];
        let turn = if self.plant.chain(id).parent.is_some() { uppermost(once, frame) } else { 0 };
        let (corners, middles) = (&circle.corners[turn..][..columns], &circle.middles[turn..][..sides as usize]);
        let roots = (shape.foot.share > 0.0).then(|| Roots::of(id.0, shape.foot.turn()).corners(sides));
        let mut bend = Bend::default();
        let mut last = first;
        let (start, triangles) = (mesh.positions.len() as u32, mesh.indices.len());
        let is_capped = self.is_capped(id, detail);
        let vertices =
            (body.len() + dome.len() + usize::from(is_sunk)) * columns + sides as usize * (1 + usize::from(is_capped));
        mesh.positions.reserve(vertices);
        mesh.normals.reserve(vertices);
        mesh.tangents.reserve(vertices);
        mesh.uvs.reserve(vertices);
        mesh.occlusion.reserve(vertices);
        mesh.indices.reserve(shape.skin.triangles(rings.len(), is_capped) * 3);
        // The wood's own normals, before they lean on the parent's, up to the last ring that does.
        let leaning = body.iter().rposition(|ring| !base.is_clear_of(foot, ring)).map_or(0, |i| i + 1);
        own.clear();
        for (j, ring) in body.iter().enumerate() {
            let here = around(ring.radius);
            let step = last.centre.distance(ring.centre);
            // On the skin, which a flare and a collar have more of than their axis.
            let wider = ring.radius - last.radius;
            v -= (step * step + wider * wider).sqrt() * density;
            bend.step(frame, ring.tangent, step / ring.radius.max(1e-6));
            frame = frame.turned(ring.tangent);
            let shade = Self::shade(light, ring.centre, ring.radius);
            let slope = ring.slope.clamp(-2.0, 2.0);
            // Normals stand at one angle to the axis all round.
            let (across, along) = (1.0 / (1.0 + slope * slope).sqrt(), frame.y * -slope);
            let spread = shape.foot.spread(ring);
            let rooted = roots.as_deref().filter(|_| spread > 0.0);
            for (k, &(sin, cos)) in corners.iter().enumerate() {
                let radial = frame.x * cos - frame.z * sin;
                // From the side that lies opposite the seam, so that changes of the number shear the least.
                let u = here * (k as f32 / sides as f32 - 0.5);
                let (mut radius, mut normal) = (ring.radius, (radial + along) * across);
                // Round the wood u grows, against its way v does.
                let around = frame.x * -sin - frame.z * cos;
                let mut seen = (normal, [around.x, around.y, around.z, 1.0]);
                if let Some(&(out, turning)) = rooted.map(|roots| &roots[k]) {
                    radius += spread * out;
                    normal = radial - around * (spread * turning / radius) + along * (1.0 + shape.foot.share * out);
                    normal = normal.normalize_or(radial);
                    seen = (normal, tangent_of(normal, around, -frame.y));
                }
                let place = ring.centre + radial * ((radius * fuller + detail.added) * widened);
                if j <= leaning {
                    own.push(normal);
                }
                if j < leaning {
                    let leant = base.blended(foot, place, normal, ring.radius);
                    seen = (leant, tangent_of(leant, around, -frame.y));
                }
                let ahead = bend.ahead((sin, cos)) * ring.radius * density;
                push(mesh, place, seen, Vec2::new(u, v + ahead), shade);
            }
            last = *ring;
        }
        let mut ground = Ground::default();
        if matches!(base, Base::Ground { .. }) && stands(self.rings_of(limb), first.tangent) {
            set_down(mesh, start as usize..start as usize + columns, (foot.y, first.tangent), density);
            ground = Ground::cut(mesh, (start as usize, columns), (foot.y, &first));
        }
        if shape.left < 1.0
            && let Some(bearer) = shapes.bearer(self, id, detail)
        {
            let span = span_at(bearer.rings, self.plant.chain(id).location);
            let ring = start as usize..start as usize + columns;
            let length = |places: &[Vec3]| places.array_windows().map(|[a, b]| a.distance(*b)).sum::<f32>();
            let whole = length(&mesh.positions[ring.clone()]);
            for place in &mut mesh.positions[ring.clone()] {
                *place = bearer.within(first.centre, *place, span, self.may_stick_out(detail));
            }
            drawn_in(&mesh.positions[ring.clone()], &mut mesh.uvs[ring], whole);
        }
        let columns = columns as u32;
        for j in 0..body.len() as u32 - 1 {
            for k in 0..sides {
                let a = start + j * columns + k;
                let (b, c, d) = (a + 1, a + columns, a + columns + 1);
                if ground.any() {
                    ground.add(mesh, [a, b, d]);
                    ground.add(mesh, [a, d, c]);
                } else {
                    mesh.indices.extend([a, b, d, a, d, c]);
                }
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
        let shade = |place, radius| Self::shade(light, place, radius);
        let mut rim = start + (body.len() as u32 - 1) * columns;
        let (mut beyond, mut narrow) = (0.0, 1.0);
        for &(along, share) in dome {
            let (centre, next) = (tip.centre + frame.y * (tip.radius * along), mesh.positions.len() as u32);
            v -= Vec2::new(along - beyond, narrow - share).length() * tip.radius * density;
            (beyond, narrow) = (along, share);
            // As a ball's.
            let (across, up) = (share, frame.y * (1.0 - share * share).sqrt());
            for (k, &(sin, cos)) in corners.iter().enumerate() {
                let radial = frame.x * cos - frame.z * sin;
                let place = centre + radial * ((tip.radius * fuller + detail.added) * widened * share);
                let growing = frame.x * -sin - frame.z * cos;
                let seen = (radial * across + up, [growing.x, growing.y, growing.z, 1.0]);
                let u = around(last.radius) * (k as f32 / sides as f32 - 0.5);
                push(mesh, place, seen, Vec2::new(u, v), shade(place, tip.radius));
            }
            for k in 0..sides {
                let (a, b, c, d) = (rim + k, rim + k + 1, next + k, next + k + 1);
                mesh.indices.extend([a, b, d, a, d, c]);
            }
            rim = next;
        }
        let apex = tip.centre + frame.y * (tip.radius * shape.skin.beyond());
        let end = Cone { rim, apex, frame, v, density, is_base: false };
        end.add(mesh, middles, (last.radius * narrow, self.thinnest), around(last.radius), shade(apex, last.radius));
        if is_capped {
            let apex = first.centre - base_frame.y * (first.radius * BLUNT_CONE);
            let cap = Cone { rim: start, apex, frame: base_frame, v: v_at_base, density, is_base: true };
            cap.add(mesh, middles, (first.radius, self.thinnest), around(first.radius), shade(apex, first.radius));
        }
        if is_sunk {
            sink(mesh, start as usize..(start + columns) as usize, &ground, (foot.y, detail.below), density);
        }
        if ground.any() {
            ground.tidy(mesh, triangles);
        }
        mesh.chains.resize(mesh.positions.len(), id.0);
    }

    /// How bright wood of a radius is at a place: twigs have no bark yet, and are darker than the pale bark of some stems.
    fn shade(light: &CrownLight, place: Vec3, radius: f32) -> u8 {
        let (young, thin, thick) = YOUNG;
        let age = young + (1.0 - young) * math::smoothstep(thin, thick, radius);
        (f32::from(light.shade(place)) * age + 0.5) as u8
    }
}

/// Triangles from a ring to a point, at a tip or a base.
struct Cone {
    /// The ring's first vertex.
    rim: u32,
    apex: Vec3,
    frame: Frame,
    /// Of the ring.
    v: f32,
    /// Of bark along the wood, repeats a metre.
    density: f32,
    is_base: bool,
}

impl Cone {
    /// Adds one triangle for each side whose middle is given. `least` is how high it counts at least, metres; bark goes `around`
    /// the ring so often.
    fn add(&self, mesh: &mut Mesh, middles: &[(f32, f32)], (radius, least): (f32, f32), around: f32, shade: u8) {
        let Self { rim, apex, frame, v, density, is_base } = *self;
        let ring = mesh.positions[rim as usize..=rim as usize + middles.len()].iter();
        let centre = ring.take(middles.len()).sum::<Vec3>() / middles.len() as f32;
        let height = apex.distance(centre).max(least);
        let way = if is_base { -frame.y } else { frame.y };
        let v = if is_base { v + height * density } else { v - height * density };
        let apexes = mesh.positions.len() as u32;
        // Normals stand at one angle to the axis all round.
        let steep = (radius / height).min(2.0);
        let across = 1.0 / (1.0 + steep * steep).sqrt();
        let along = way * (steep * across);
        for (k, &(sin, cos)) in (0..).zip(middles) {
            // Each side of the cone has a tip of its own, so that its texture is not pinched to one column.
            let normal = (frame.x * cos - frame.z * sin) * across + along;
            let u = around * ((k as f32 + 0.5) / middles.len() as f32 - 0.5);
            let growing = frame.x * -sin - frame.z * cos;
            let tangent = [growing.x, growing.y, growing.z, 1.0];
            push(mesh, apex, (normal, tangent), Vec2::new(u, v), shade);
            let [from, to] = if is_base { [rim + k + 1, rim + k] } else { [rim + k, rim + k + 1] };
            mesh.indices.extend([from, to, apexes + k]);
        }
    }
}

/// Whether a triangle faces away from the normals of all its corners.
fn is_lit_from_behind(mesh: &Mesh, triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
    let face = (b - a).cross(c - a);
    triangle.iter().all(|&i| mesh.normals[i as usize].dot(face) < 0.0)
}

#[inline]
pub(super) fn push(mesh: &mut Mesh, position: Vec3, (normal, tangent): (Vec3, [f32; 4]), uv: Vec2, shade: u8) {
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
