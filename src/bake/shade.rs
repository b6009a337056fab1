//! Light on a sample: sun, sky and leaves that let light through. For pictures that people look at, and for comparing the
//! brightness of levels of detail; cards are baked without it.
//!
//! Lambert's law for the sun; the sky is a hemisphere, blue above and dim brown below; a leaf lit from behind passes a
//! share on. As glTF has it, vertex colour multiplies the base colour, and the occlusion texture dims the sky's light only.
//! Normals are those of the front on both sides: leaves are written with backs of their own that have them (`Mesh::double`).

use glam::Vec3;

use super::picture::Repeat;

/// What a sample shows before light falls on it, and colour after.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Fragment {
    /// Linear light.
    pub(super) color: Vec3,
    /// In the world.
    pub(super) normal: Vec3,
    /// Of the occlusion texture; 1 is open.
    pub(super) occlusion: f32,
    /// What the picture's colour is multiplied by in all.
    pub(super) light: Vec3,
    /// Of the vertices: what the picture's colour was multiplied by.
    pub(super) shade: f32,
    /// The texel of the palette that the colour comes from, counted from the surface's first; `u32::MAX` for white.
    pub(super) place: u32,
}

impl Fragment {
    pub(super) fn add(&mut self, other: Self, weight: f32) {
        self.color += other.color * weight;
        self.normal += other.normal * weight;
        self.occlusion += other.occlusion * weight;
    }
}

/// What a target's colour means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shading {
    /// Nothing: colour, normal and occlusion stay zero, and depth is that of whatever was drawn first. For measuring
    /// coverage.
    Nothing,
    /// The base colour: that of the picture times the vertex's ambient occlusion (glTF's `COLOR_0`); normals as they are
    /// on the front, also where the back is seen. For baking.
    Albedo,
    /// The base colour as for [`Albedo`](Self::Albedo), for baking what is seen from one side only. A pixel's normal is that of one
    /// of its samples: means of many leaves all point to the viewer, and what is lit by them is too bright under a sun behind
    /// him and too dark against it.
    Seen,
    /// The base colour in the light. For looking at.
    Lit(Light),
}

/// Sun and sky, in linear light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Unit vector towards the sun.
    pub sun_direction: Vec3,
    /// Light of the sun on a surface that faces it.
    pub sun: Vec3,
    /// Light from straight above.
    pub sky: Vec3,
    /// Light from straight below.
    pub ground: Vec3,
    /// Share of the sun's light that a leaf passes to its far side, 0..=1.
    pub translucency: f32,
}

impl Light {
    /// A clear day: the sun high, over the viewer's right shoulder in a view along -Z.
    pub const DAY: Self = Self {
        sun_direction: Vec3::new(0.482_242_8, 0.723_364_2, 0.494_298_9),
        sun: Vec3::new(2.2, 2.05, 1.8),
        sky: Vec3::new(0.62, 0.70, 0.80),
        ground: Vec3::new(0.24, 0.21, 0.17),
        translucency: 0.3,
    };
}

impl Shading {
    #[inline]
    pub(super) fn apply(&self, mut fragment: Fragment, repeat: Repeat) -> Fragment {
        if let Self::Lit(light) = self {
            let facing = light.sun_direction.dot(fragment.normal);
            let passed = if repeat == Repeat::Cutout { light.translucency } else { 0.0 };
            let sun = light.sun * (facing.max(0.0) + (-facing).max(0.0) * passed);
            let up = (0.5 + 0.5 * fragment.normal.y).clamp(0.0, 1.0);
            let all = sun + light.ground.lerp(light.sky, up) * fragment.occlusion;
            fragment.color *= all;
            fragment.light *= all;
        }
        fragment
    }
}
