//! Pictures of trees, drawn by the rasterizer that bakes cards and contact sheets: the turntable, which needs no
//! graphics hardware and no library, and the small pictures of the gallery.
//!
//! A picture stands on transparent ground, so that it suits a dark page as well as a light one. Pure.

use glam::Vec3;

use super::scene::Wear;
use crate::bake::{Light, Shading, Surface, Target, View, rasterize, srgb_byte};
use crate::base::math;
use crate::export::{self, PngKind};
use crate::mesh::TreeMesh;

/// Smallest and largest edge of a picture, pixels.
pub(super) const EDGES: (u32, u32) = (32, 1024);

/// How a tree is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Framing {
    /// Where from: radians, 0 from +Z, towards +X.
    pub(super) azimuth: f32,
    /// From how high: radians, 0 is level, a quarter turn straight down.
    pub(super) elevation: f32,
    /// Pixels; [`EDGES`] bound it.
    pub(super) width: u32,
    /// Pixels; [`EDGES`] bound it.
    pub(super) height: u32,
    /// Half of the width that must be seen, metres.
    pub(super) reach: f32,
    /// The height that must be seen, metres.
    pub(super) top: f32,
    /// The lowest that must be seen, metres.
    pub(super) foot: f32,
}

impl Framing {
    /// A frame that shows all of a tree from wherever it is turned to; from above, of one that is round.
    #[must_use]
    pub(super) fn around(tree: &TreeMesh, azimuth: f32, elevation: f32, width: u32, height: u32) -> Self {
        let (mut reach, mut top, mut foot) = (0.1_f32, 0.1_f32, 0.0_f32);
        for p in tree.bark.positions.iter().chain(&tree.leaf.positions).filter(|p| p.is_finite()) {
            reach = reach.max((p.x * p.x + p.z * p.z).sqrt());
            top = top.max(p.y);
            foot = foot.min(p.y);
        }
        let edge = |e: u32| e.clamp(EDGES.0, EDGES.1);
        let (width, height) = (edge(width), edge(height));
        Self { azimuth, elevation, width, height, reach: reach.min(1e5), top: top.min(1e5), foot }
    }

    /// Metres of a pixel, and how far up in the picture its middle is from where the tree's foot is seen, metres.
    #[must_use]
    pub(super) fn scale(&self) -> (f32, f32) {
        // What is seen of an upright ellipsoid; level, its height.
        let (sin, cos) = math::sin_cos(self.elevation);
        let (upright, deep) = ((self.top - self.foot) * 0.5 * cos, self.reach * sin);
        let half = if sin == 0.0 { upright } else { (upright * upright + deep * deep).sqrt() };
        let low = (self.top + self.foot) * 0.5 * cos - half;
        let tall = (half * 2.0).max(0.1) * 1.06;
        let wide = self.reach.max(0.05) * 2.0 * 1.04;
        let metres = (tall / self.height as f32).max(wide / self.width as f32);
        // The foot stands a little above the lower edge, wherever the width decides.
        let middle = low - tall * 0.03 + metres * self.height as f32 * 0.5;
        (metres, middle)
    }
}

/// Draws a tree; straight alpha, sRGB.
#[must_use]
pub(super) fn draw(tree: &TreeMesh, wear: &Wear, framing: &Framing, samples: u32) -> Target {
    let (metres, middle) = framing.scale();
    let (half_width, half_height) = (metres * framing.width as f32 * 0.5, metres * framing.height as f32 * 0.5);
    let mut view = View::raised(framing.azimuth, framing.elevation, Vec3::ZERO, half_width, half_height);
    view.centre = view.frame.y * middle;
    let surfaces = Surface::of_tree(tree, &wear.bark, &wear.leaf);
    rasterize(&surfaces, &view, framing.width, framing.height, samples, &Shading::Lit(Light::DAY))
}

/// A drawing as PNG.
#[must_use]
pub(super) fn png(target: &Target) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(target.coverage.len() * 4);
    for (color, cover) in target.color.iter().zip(&target.coverage) {
        let byte = |v: f32| srgb_byte(v.clamp(0.0, 1.0));
        bytes.extend([byte(color.x), byte(color.y), byte(color.z), (cover.clamp(0.0, 1.0) * 255.0) as u8]);
    }
    export::encode_quickly(&bytes, target.width, target.height, PngKind::Rgba).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::super::scene::blank;
    use super::*;
    use crate::mesh::Mesh;

    fn post() -> TreeMesh {
        let corners = [(-0.5, 0.0), (0.5, 0.0), (0.5, 4.0), (-0.5, 4.0)];
        let bark = Mesh {
            positions: corners.map(|(x, y)| Vec3::new(x, y, 0.0)).into(),
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Mesh::default()
        };
        TreeMesh { bark, leaf: Mesh::default() }
    }

    #[test]
    fn a_tree_is_drawn_whole_on_transparent_ground_from_every_side() {
        let wear = Wear { leaf: vec![blank()], bark: vec![blank()] };
        for (width, height) in [(100, 100), (300, 64), (64, 300)] {
            let framing = Framing::around(&post(), 0.0, 0.0, width, height);
            let target = draw(&post(), &wear, &framing, 1);
            let (metres, _) = framing.scale();
            let shown: f32 = target.coverage.iter().sum::<f32>() * metres * metres;
            assert!((shown - 4.0).abs() < 0.4, "{width} {height} {shown}");
            let edge = (0..width).all(|x| target.coverage[x as usize] == 0.0);
            assert!(edge, "nothing touches the upper edge");
            let image = image::load_from_memory(&png(&target)).expect("a PNG").into_rgba8();
            assert_eq!(image.dimensions(), (width, height));
            assert!(image.get_pixel(0, 0).0[3] == 0 && image.get_pixel(width / 2, height / 2).0[3] == 255);
        }
        let bounded = Framing::around(&post(), 0.0, 0.0, 1, u32::MAX);
        assert_eq!((bounded.width, bounded.height), EDGES);
    }
}
