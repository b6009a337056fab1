//! What a triangle shows at a place: colour, normal, occlusion and light, by its corners and its picture.

use glam::{Vec2, Vec3};

use super::cutout::Level;
use super::picture::{Picture, Repeat};
use super::raster::Surface;
use super::recipe::Palette;
use super::samples::{Point, SUBSAMPLE, edge};
use super::shade::Fragment;
use crate::mesh::Mesh;

/// No tile, no texel.
const NONE: u32 = u32::MAX;

/// What a triangle wears; texture coordinates are affine under an orthographic view, so that the mip level is one for all
/// of it.
pub(super) struct Worn {
    pub(super) uv: [Vec2; 3],
    /// Of its surface's.
    pub(super) picture: Option<usize>,
    pub(super) level: usize,
    /// A texel is larger than a sample.
    pub(super) magnified: bool,
}

impl Worn {
    /// With the level for its picture where `textured` says for how many samples a texel is looked up.
    #[inline]
    pub(super) fn new(surface: &Surface<'_>, area: i64, corners: [u32; 3], textured: Option<f32>) -> Self {
        let mesh = surface.mesh;
        let uv = corners.map(|c| mesh.uvs.get(c as usize).copied().unwrap_or(Vec2::ZERO));
        let plain = Self { uv, picture: None, level: 0, magnified: false };
        let Some(samples) = textured else { return plain };
        let tile = if mesh.tiles.is_empty() { 0 } else { mesh.tiles.get(corners[0] as usize).copied().unwrap_or(NONE) };
        let Some(picture) = surface.pictures.get(tile as usize) else { return plain };
        let texels = (uv[1] - uv[0]).perp_dot(uv[2] - uv[0]).abs() * picture.texels();
        let share = samples * texels / (area.abs() as f32 / (SUBSAMPLE * SUBSAMPLE));
        Self { picture: Some(tile as usize), level: picture.level(share), magnified: share < 1.0, ..plain }
    }

    /// As its alpha is tested, sample by sample; nothing that is opaque asks for its picture.
    #[inline]
    pub(super) fn tested(surface: &Surface<'_>, p: [Point; 3], corners: [u32; 3]) -> Self {
        let area = edge(p[0], p[1], p[2].x, p[2].y);
        Self::new(surface, area, corners, (surface.repeat == Repeat::Cutout).then_some(1.0))
    }

    /// What its alpha is tested by; nothing that is opaque was asked for a picture.
    #[inline]
    pub(super) fn level_of<'a>(&self, surface: &Surface<'a>) -> Option<&'a Level> {
        self.picture.map(|t| surface.pictures[t].cutout().at(self.level))
    }
}

/// A triangle, ready to be shaded: `value(x, y) = value(a) + w_b * (b - a) + w_c * (c - a)`.
pub(super) struct Face<'a> {
    points: [Point; 3],
    /// One over twice the area, in squared units; positive where it is seen from behind.
    inverse: f32,
    worn: Worn,
    picture: Option<&'a Picture>,
    repeat: Repeat,
    mesh: &'a Mesh,
    corners: [u32; 3],
    /// Occlusion of the vertices.
    shades: [f32; 3],
}

impl<'a> Face<'a> {
    /// None for what has no area; a texel is looked up for so many samples.
    pub(super) fn new(surface: &Surface<'a>, points: [Point; 3], corners: [u32; 3], samples: f32) -> Option<Self> {
        let area = edge(points[0], points[1], points[2].x, points[2].y);
        if area == 0 {
            return None;
        }
        let mesh = surface.mesh;
        let worn = Worn::new(surface, area, corners, Some(samples));
        Some(Self {
            points,
            inverse: 1.0 / area as f32,
            picture: worn.picture.and_then(|picture| surface.pictures.get(picture)),
            worn,
            repeat: surface.repeat,
            mesh,
            corners,
            shades: corners.map(|c| mesh.occlusion.get(c as usize).map_or(1.0, |&o| f32::from(o) / 255.0)),
        })
    }

    /// Which of its surface's pictures it wears, the first where it has none.
    pub(super) fn picture(&self) -> usize {
        self.worn.picture.unwrap_or(0)
    }

    /// The weights of its corners at a place, in units.
    #[inline]
    fn weights(&self, (x, y): (i32, i32)) -> [f32; 3] {
        let [a, b, c] = self.points;
        let (wb, wc) = (edge(c, a, x, y) as f32 * self.inverse, edge(a, b, x, y) as f32 * self.inverse);
        [1.0 - wb - wc, wb, wc]
    }

    #[inline]
    fn uv(&self, [wa, wb, wc]: [f32; 3]) -> Vec2 {
        self.worn.uv[0] * wa + self.worn.uv[1] * wb + self.worn.uv[2] * wc
    }

    /// The texel that it shows at a place, counted through the mips; `u32::MAX` for white.
    pub(super) fn texel(&self, at: (i32, i32)) -> u32 {
        self.picture.map_or(NONE, |picture| {
            let uv = self.uv(self.weights(at));
            picture.address(self.worn.level, self.worn.magnified, (uv.x, uv.y), self.repeat)
        })
    }

    /// The normal by its corners and, where it has tangents, by that of its picture.
    fn normal(&self, [wa, wb, wc]: [f32; 3], relief: Option<Vec3>) -> Vec3 {
        let mixed = |[a, b, c]: [Vec3; 3]| a * wa + b * wb + c * wc;
        let normals = self.corners.map(|c| self.mesh.normals.get(c as usize).copied().unwrap_or(Vec3::ZERO));
        let normal = mixed(normals).normalize_or(Vec3::Y);
        let Some(n) = relief else { return normal };
        let tangents =
            self.corners.map(|c| self.mesh.tangents.get(c as usize).copied().unwrap_or([0.0, 0.0, 0.0, 1.0]));
        let tangent = mixed(tangents.map(|t| Vec3::new(t[0], t[1], t[2])));
        let tangent = (tangent - normal * normal.dot(tangent)).normalize_or_zero();
        if tangent == Vec3::ZERO {
            return normal;
        }
        let hand = tangents[2][3];
        (tangent * n.x + normal.cross(tangent) * (n.y * hand) + normal * n.z).normalize_or(normal)
    }

    /// What it shows at a place within it, in units; the normal is zero where it is not asked for.
    #[inline]
    pub(super) fn fragment(&self, at: (i32, i32), has_normal: bool) -> Fragment {
        let weights @ [wa, wb, wc] = self.weights(at);
        let shade = self.shades[0] * wa + self.shades[1] * wb + self.shades[2] * wc;
        let normal = |relief: Option<Vec3>| if has_normal { self.normal(weights, relief) } else { Vec3::ZERO };
        let mut fragment = Fragment {
            color: Vec3::splat(shade),
            light: Vec3::splat(shade),
            normal: Vec3::ZERO,
            occlusion: 1.0,
            shade,
            place: NONE,
        };
        let Some(picture) = self.picture else { return Fragment { normal: normal(None), ..fragment } };
        let uv = self.uv(weights);
        let texel = picture.sample(self.worn.level, self.worn.magnified, (uv.x, uv.y), self.repeat);
        fragment.color = texel.color * shade;
        fragment.occlusion = texel.occlusion;
        fragment.place = Palette::place(self.picture() as u32, uv, self.repeat);
        fragment.normal = normal(Some(texel.normal));
        fragment
    }
}
