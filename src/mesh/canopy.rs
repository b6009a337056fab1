//! Normals and tangents of leaf cards, several vertices at a time.
//!
//! A card's normals are mostly the crown's: the direction outward through the leaf, so that light falls on the tree as
//! on one volume with soft edges and not on a heap of mirrors. A tree has some hundred thousand such vertices and three
//! roots each; a coordinate at a time and without branches they are as many instructions for four vertices as for one.

use glam::Vec3;

use super::tangent::tangent_of;
use super::{CrownLight, Mesh};
use crate::plant::LeafForm;

/// How much of a card's normal is a full crown's, the rest is its own; and of the leaves of a crown that one sees through, which
/// hang alone in the light, as fronds do: their crown's outside lies below those that hang.
const CANOPY: f32 = 0.72;
const ALONE: f32 = 0.2;
/// Vertices that are made together.
const LANES: usize = 8;
/// Squares of lengths below this have no direction.
const NOTHING: f32 = 1e-20;

/// How level a frond's middle is that has an upper face: the rise of its unit normal.
const HANGS: f32 = 0.1;

/// How much of the normals of a leaf are the crown's.
pub(super) const fn share_of(form: &LeafForm, light: &CrownLight) -> f32 {
    if matches!(form, LeafForm::Frond { .. }) {
        ALONE
    } else {
        CANOPY * light.fullness() + ALONE * (1.0 - light.fullness())
    }
}

/// Whether a leaf's front looks the other way than its own normal at its middle does: out of the crown, of a frond up, since the
/// crown's outside lies below those that hang.
pub(super) fn is_turned(form: &LeafForm, own: Vec3, outward: Vec3) -> bool {
    let has_upper = matches!(form, LeafForm::Frond { .. }) && own.y.abs() > HANGS;
    if has_upper { own.y < 0.0 } else { own.dot(outward) < 0.0 }
}

type Lane = [f32; LANES];
type Axes = [Lane; 3];

/// Vertices that wait for their normals and tangents; [`flush`](Self::flush) at the end.
pub(super) struct Canopy<'a> {
    light: &'a CrownLight,
    waiting: usize,
    places: Axes,
    own: Axes,
    growing: Axes,
    falling: Axes,
    share: Lane,
}

impl<'a> Canopy<'a> {
    pub(super) fn new(light: &'a CrownLight) -> Self {
        let none = [[0.0; LANES]; 3];
        Self { light, waiting: 0, places: none, own: none, growing: none, falling: none, share: [0.0; LANES] }
    }

    /// Adds a vertex to the mesh: at `place`, on a card with the normal `own` there, of which the crown's takes a `share`, on which u grows along `growing` and v
    /// along `falling`; all about unit.
    #[inline]
    pub(super) fn add(
        &mut self,
        mesh: &mut Mesh,
        place: Vec3,
        (own, share): (Vec3, f32),
        (growing, falling): (Vec3, Vec3),
    ) {
        mesh.positions.push(place);
        let all = [
            (&mut self.places, place),
            (&mut self.own, own),
            (&mut self.growing, growing),
            (&mut self.falling, falling),
        ];
        for (axes, v) in all {
            for (axis, v) in axes.iter_mut().zip(v.to_array()) {
                axis[self.waiting] = v;
            }
        }
        self.share[self.waiting] = share;
        self.waiting += 1;
        if self.waiting == LANES {
            self.flush(mesh);
        }
    }

    /// Makes what waits.
    pub(super) fn flush(&mut self, mesh: &mut Mesh) {
        let outward = self.light.outward_of(&self.places);
        let mut normals = outward;
        for a in 0..3 {
            for k in 0..LANES {
                normals[a][k] = outward[a][k] * self.share[k] + self.own[a][k] * (1.0 - self.share[k]);
            }
        }
        let tall = unit(&mut normals);
        let off = dot(&self.growing, &normals);
        let mut tangents = self.growing;
        for a in 0..3 {
            for k in 0..LANES {
                tangents[a][k] -= normals[a][k] * off[k];
            }
        }
        let long = unit(&mut tangents);
        let side = dot(&cross(&normals, &tangents), &self.falling);
        for k in 0..self.waiting {
            let at = |axes: &Axes| Vec3::new(axes[0][k], axes[1][k], axes[2][k]);
            // Where two directions cancel each other out.
            let normal = if tall[k] > NOTHING { at(&normals) } else { at(&outward) };
            let [x, y, z] = at(&tangents).to_array();
            let sound = tall[k] > NOTHING && long[k] > NOTHING;
            let sign = if side[k] > 0.0 { -1.0 } else { 1.0 };
            mesh.normals.push(normal);
            mesh.tangents.push(if sound {
                [x, y, z, sign]
            } else {
                tangent_of(normal, at(&self.growing), at(&self.falling))
            });
        }
        self.waiting = 0;
    }
}

#[inline]
fn dot(a: &Axes, b: &Axes) -> Lane {
    let mut dots = [0.0; LANES];
    for k in 0..LANES {
        dots[k] = a[0][k] * b[0][k] + a[1][k] * b[1][k] + a[2][k] * b[2][k];
    }
    dots
}

#[inline]
fn cross(a: &Axes, b: &Axes) -> Axes {
    let mut made = [[0.0; LANES]; 3];
    for k in 0..LANES {
        made[0][k] = a[1][k] * b[2][k] - b[1][k] * a[2][k];
        made[1][k] = a[2][k] * b[0][k] - b[2][k] * a[0][k];
        made[2][k] = a[0][k] * b[1][k] - b[0][k] * a[1][k];
    }
    made
}

/// Brings vectors to unit length and gives back the squares of the lengths that they had; those without a length stay short.
#[inline]
fn unit(v: &mut Axes) -> Lane {
    let squares = dot(v, v);
    let mut scale = [0.0; LANES];
    for k in 0..LANES {
        scale[k] = 1.0 / squares[k].max(NOTHING).sqrt();
    }
    for axis in v {
        for k in 0..LANES {
            axis[k] *= scale[k];
        }
    }
    squares
}

impl CrownLight {
    /// [`outward`](Self::outward) of several places.
    #[inline]
    fn outward_of(&self, places: &Axes) -> Axes {
        let (centre, bulge) = (self.centre().to_array(), self.lean().to_array());
        let mut made = *places;
        for a in 0..3 {
            for k in 0..LANES {
                made[a][k] = (places[a][k] - centre[a]) * bulge[a];
            }
        }
        let (squares, fullness) = (unit(&mut made), self.fullness());
        for k in 0..LANES {
            // The very middle looks up.
            let up = if squares[k] > NOTHING { made[1][k] } else { 1.0 };
            made[0][k] *= fullness;
            made[1][k] = up * fullness + (1.0 - fullness);
            made[2][k] *= fullness;
        }
        if fullness < 1.0 {
            unit(&mut made);
        }
        made
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::relate::random_plant::{Oddity, random_plant};

    #[test]
    fn vertices_get_what_each_would_get_alone() {
        let plant = random_plant(Seed::new(4), 40, Oddity::Wild);
        let light = CrownLight::of(&plant, &plant.pose());
        let mut mesh = Mesh::default();
        let mut canopy = Canopy::new(&light);
        let vertex = |i: u64| {
            let seed = Seed::new(6).at(i);
            let place = if i == 3 { light.centre() } else { seed.at(0).direction() * 4.0 };
            // One whose own normal is opposite to the crown's.
            let own = if i == 5 { -light.outward(place) * (CANOPY / (1.0 - CANOPY)) } else { seed.at(1).direction() };
            (place, own, (seed.at(2).direction(), seed.at(3).direction()))
        };
        let share = |i: u64| if i % 7 == 2 { ALONE } else { CANOPY };
        for i in 0..29 {
            let (place, own, ways) = vertex(i);
            canopy.add(&mut mesh, place, (own, share(i)), ways);
        }
        canopy.flush(&mut mesh);
        assert_eq!((mesh.positions.len(), mesh.normals.len(), mesh.tangents.len()), (29, 29, 29));
        for i in 0..29 {
            let (place, own, (growing, falling)) = vertex(i);
            let outward = light.outward(place);
            let normal = (outward * share(i) + own * (1.0 - share(i))).normalize();
            let k = i as usize;
            assert!((mesh.normals[k].length() - 1.0).abs() < 1e-4);
            if i != 5 {
                let [x, y, z, w] = tangent_of(normal, growing, falling);
                let [a, b, c, d] = mesh.tangents[k];
                assert!(mesh.normals[k].distance(normal) < 1e-4, "{i}");
                assert!(Vec3::new(x, y, z).distance(Vec3::new(a, b, c)) < 1e-3 && w == d, "{i}");
            }
        }
    }
}
