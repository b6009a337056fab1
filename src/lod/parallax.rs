//! What an impostor's shader shows (`examples/engines/impostor.js`).
//!
//! A rectangle faces the viewer. The ray of each of its points is followed to the depth of each of the three frames that
//! were drawn from around the viewer's direction (parallax mapping: Kaneko et al. 2001, in two steps), and what they hold there
//! is mixed by their shares: a tree that is passed changes from frame to frame without a jump, and holes that one frame shows
//! by chance are not those of the next. Mixed alpha agrees better with the full tree than that of the nearest frame: 0.005 to
//! 0.02 of IoU on broadleaved trees and palms.
//!
//! Here what the rectangle shows is a picture, finer than the frames: views are parallel, so that shares are the same for
//! all of it. Twice as fine is enough to settle crowns by. Outlines of twigs, a texel wide, cover too little there: impostors
//! of winter trees that were settled so covered 4 to 9 % too much in an engine, and with four times as fine 0 to 4 %.

use std::borrow::Cow;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::impostor::{Impostor, ROUGHNESS};
use super::measure::Wardrobe;
use crate::bake::{Maps, Picture, Silhouette, srgb_byte, srgb_linear};
use crate::base::Frame;
use crate::mesh::{Mesh, TreeMesh};

/// Steps along a ray: measured, four are no better.
const STEPS: usize = 2;
/// Pixels of the picture a texel of a frame, along an edge: of crowns, and of twigs or where somebody measures.
pub(super) const CROWNS: usize = 2;
pub(super) const TWIGS: usize = 4;
/// Roughness of leaves, beyond which the texels of a sheet tell how far their normals look away.
const ROUGH: f32 = ROUGHNESS as f32;
/// Nowhere in the sheet.
const OUTSIDE: Vec2 = Vec2::splat(f32::NEG_INFINITY);

/// A channel of a sheet, or a part of one.
#[derive(Clone, Copy)]
pub(super) struct Texels<'a, T> {
    pub(super) all: &'a [T],
    /// Texels a row of `all`.
    pub(super) wide: usize,
    /// Column and row of the sheet's first texel.
    pub(super) first: (usize, usize),
    /// Texels of the sheet.
    pub(super) size: (usize, usize),
}

impl<T> Texels<'_, T> {
    /// What is `of` the four texels around a place, counted from the sheet's corner; edges are clamped.
    #[inline]
    fn between(&self, at: Vec2, of: impl Fn(&T) -> f32) -> f32 {
        let last = Vec2::new((self.size.0 - 1) as f32, (self.size.1 - 1) as f32);
        let at = (at - 0.5).clamp(Vec2::ZERO, last);
        let corner = at.as_ivec2();
        let (x, y, f) = (corner.x as usize, corner.y as usize, at - corner.as_vec2());
        let right = usize::from(x + 1 < self.size.0);
        let below = if y + 1 < self.size.1 { self.wide } else { 0 };
        let corner = (self.first.1 + y) * self.wide + self.first.0 + x;
        let value = |at: usize| of(&self.all[at]);
        let upper = value(corner) + (value(corner + right) - value(corner)) * f.x;
        let lower = value(corner + below) + (value(corner + below + right) - value(corner + below)) * f.x;
        upper + (lower - upper) * f.y
    }
}

/// What faces a viewer far away.
pub(crate) struct Facing {
    /// Where its sheet lies.
    first: (usize, usize),
    sheet: (usize, usize),
    viewer: Frame,
    centre: Vec3,
    /// Of the rectangle, metres.
    half: Vec2,
    frames: [((u32, u32), f32); 3],
    axes: [Frame; 3],
    columns: usize,
    rows: usize,
    /// Where each pixel looks into the sheet, by frame, texels.
    places: Vec<[Vec2; 3]>,
}

impl Facing {
    /// Follows the rays of so many pixels a texel, along an edge; `deep` gives metres before the frame's plane from a texel
    /// of `depths`.
    pub(super) fn new<T>(
        layout: &Impostor,
        (viewer, fine): (Frame, usize),
        depths: Texels<'_, T>,
        deep: impl Fn(&T) -> f32 + Copy,
    ) -> Self {
        let edge = depths.size.0.max(depths.size.1).div_ceil(layout.frames.max(1) as usize).max(1);
        Self::of_cells(layout, viewer, ((edge, edge), fine), |_, _| true, depths, deep)
    }

    /// As [`new`](Self::new), of a picture of so many columns and rows of cells, in each of which places are found between its
    /// corners for so many pixels an edge. Cells in whose column and row nothing is `wanted` look nowhere.
    pub(super) fn of_cells<T>(
        layout: &Impostor,
        viewer: Frame,
        ((columns, rows), fine): ((usize, usize), usize),
        wanted: impl Fn(usize, usize) -> bool,
        depths: Texels<'_, T>,
        deep: impl Fn(&T) -> f32 + Copy,
    ) -> Self {
        let frames = layout.blended(viewer.z);
        let axes = frames.map(|(frame, _)| layout.axes(frame));
        let half = layout.extent_from(viewer.z);
        let size = Vec2::new(depths.size.0 as f32, depths.size.1 as f32);
        let edge = size / layout.frames.max(1) as f32;
        let mut made = Self {
            first: depths.first,
            sheet: depths.size,
            viewer,
            centre: layout.centre,
            half,
            frames,
            axes,
            columns: columns * fine,
            rows: rows * fine,
            places: vec![[OUTSIDE; 3]; columns * fine * rows * fine],
        };
        for (k, ((frame, share), axes)) in frames.into_iter().zip(axes).enumerate() {
            if share <= 0.0 {
                continue;
            }
            let extent = layout.extent(frame);
            let corner = Vec2::new(frame.0 as f32, frame.1 as f32) * edge;
            let half_texel = (0.5 / edge).min(Vec2::splat(0.5));
            let within = |seen: Vec2| {
                let at = 0.5 + Vec2::new(0.5, -0.5) * seen / extent;
                corner + at.clamp(half_texel, 1.0 - half_texel) * edge
            };
            // Parallel rays: aside by metres towards the frame's viewer.
            let ray = axes.to_local(viewer.z);
            let slope = Vec2::new(ray.x, ray.y) / ray.z.max(1e-3);
            let found = |on: Vec2| {
                let on = axes.to_local(viewer.x * on.x + viewer.y * on.y);
                let plane = Vec2::new(on.x, on.y) - slope * on.z;
                let mut metres = 0.0;
                for _ in 0..STEPS {
                    metres = depths.between(within(plane + slope * metres), deep);
                }
                plane + slope * metres
            };
            // At the corners of texels, and between those for pixels.
            let at = |i: usize| {
                let (x, y) = ((i % (columns + 1)) as f32 / columns as f32, (i / (columns + 1)) as f32 / rows as f32);
                half * Vec2::new(2.0 * x - 1.0, 1.0 - 2.0 * y)
            };
            let is_corner = |i: usize| {
                let (x, y) = (i % (columns + 1), i / (columns + 1));
                let around = |of: usize, count: usize| of.saturating_sub(1)..(of + 1).min(count);
                around(y, rows).any(|y| around(x, columns).any(|x| wanted(x, y)))
            };
            let of = |i: usize| if is_corner(i) { found(at(i)) } else { OUTSIDE };
            let seen: Vec<Vec2> = (0..(columns + 1) * (rows + 1)).map(of).collect();
            let part = |v: usize| (v as f32 + 0.5) / fine as f32;
            for (y, line) in made.places.chunks_exact_mut(made.columns).enumerate() {
                let (first, down) = (y / fine * (columns + 1), part(y % fine));
                let cells = line.chunks_exact_mut(fine).enumerate();
                for (cell, places) in cells.filter(|(cell, _)| wanted(*cell, y / fine)) {
                    let first = first + cell;
                    let (upper, lower) = ([seen[first], seen[first + 1]], &seen[first + columns + 1..][..2]);
                    for (x, place) in places.iter_mut().enumerate() {
                        let (upper, lower) = (upper[0].lerp(upper[1], part(x)), lower[0].lerp(lower[1], part(x)));
                        let seen = upper.lerp(lower, down);
                        if seen.abs().cmple(extent).all() {
                            place[k] = within(seen);
                        }
                    }
                }
            }
        }
        made
    }

    /// Width and height of the picture.
    pub(crate) fn size(&self) -> (u32, u32) {
        (self.columns as u32, self.rows as u32)
    }

    /// A channel of its sheet, of pictures so many texels wide.
    fn texels<'a, T>(&self, all: &'a [T], wide: usize) -> Texels<'a, T> {
        Texels { all, wide, first: self.first, size: self.sheet }
    }

    /// Where a pixel looks, with the share and the axes of the frame.
    fn looks(&self, places: [Vec2; 3]) -> impl Iterator<Item = (Vec2, f32, Frame)> {
        let all = places.into_iter().zip(self.frames).zip(self.axes);
        all.filter(|((place, _), _)| place.x >= 0.0).map(|((place, (_, share)), axes)| (place, share, axes))
    }

    /// What is `of` the places that a pixel looks at, by the shares of the frames.
    #[inline]
    fn mixed(&self, places: &[Vec2; 3], of: impl Fn(Vec2) -> f32) -> f32 {
        let looks = places.iter().zip(&self.frames).filter(|(place, _)| place.x >= 0.0);
        looks.map(|(place, (_, share))| of(*place) * share).sum()
    }

    /// Some of its pixels, counted row by row; places of the others are forgotten.
    pub(super) fn some(mut self, pixels: Vec<u32>) -> Glimpse {
        let places = std::mem::take(&mut self.places);
        Glimpse { places: pixels.iter().map(|i| places[*i as usize]).collect(), facing: self, pixels }
    }

    /// The picture's alpha.
    pub(super) fn alpha(&self, all: &[u8], wide: usize) -> Vec<u8> {
        let sheet = self.texels(all, wide);
        self.places
            .iter()
            .map(|places| (self.mixed(places, |place| sheet.between(place, |a| f32::from(*a))) + 0.5) as u8)
            .collect()
    }

    /// Its colours and alpha; frames count by their alpha.
    pub(crate) fn color(&self, all: &[[u8; 4]], wide: usize) -> Vec<[u8; 4]> {
        let sheet = self.texels(all, wide);
        let pixel = |&places: &[Vec2; 3]| {
            let (mut light, mut alpha) = (Vec3::ZERO, 0.0_f32);
            for (place, share, _) in self.looks(places) {
                let own = sheet.between(place, |c| f32::from(c[3])) * share;
                if own > 0.0 {
                    let channel = |i: usize| sheet.between(place, |c| srgb_linear(c[i]));
                    light += Vec3::new(channel(0), channel(1), channel(2)) * own;
                    alpha += own;
                }
            }
            let [r, g, b] = (light / alpha.max(1e-6)).to_array().map(srgb_byte);
            [r, g, b, (alpha + 0.5) as u8]
        };
        self.places.iter().map(pixel).collect()
    }

    /// All of it; normals are the rectangle's.
    pub(crate) fn maps(&self, sheet: &Maps) -> Maps {
        let wide = sheet.width as usize;
        let (alpha, normal) = (self.texels(&sheet.color, wide), self.texels(&sheet.normal, wide));
        let orm = self.texels(&sheet.orm, wide);
        let pixel = |&places: &[Vec2; 3]| {
            let (mut facing, mut open, mut all) = (Vec3::ZERO, 0.0, 1e-6);
            for (place, share, axes) in self.looks(places) {
                let own = alpha.between(place, |c| f32::from(c[3])) * share;
                let along = |i: usize| normal.between(place, |n| f32::from(n[i]) - 128.0);
                let n = Vec3::new(along(0), along(1), along(2)).normalize_or_zero();
                facing += axes.to_world(looking(n, orm.between(place, |o| f32::from(o[1])))) * own;
                open += orm.between(place, |o| f32::from(o[0])) * own;
                all += own;
            }
            let n = self.viewer.to_local(facing).normalize_or(Vec3::Z);
            (n.to_array().map(|v| (v * 127.0 + 128.5) as u8), [(open / all + 0.5) as u8, 255, 0])
        };
        let (width, height) = self.size();
        let (normal, orm) = self.places.iter().map(pixel).unzip();
        Maps { width, height, color: self.color(&sheet.color, wide), normal, orm }
    }

    /// The rectangle, which wears the picture as tile 0.
    pub(crate) fn quad(&self) -> Mesh {
        let Frame { x, y, z } = self.viewer;
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        Mesh {
            positions: corners.map(|(a, b)| self.centre + x * (a * self.half.x) + y * (b * self.half.y)).to_vec(),
            normals: vec![z; 4],
            tangents: vec![[x.x, x.y, x.z, 1.0]; 4],
            uvs: corners.map(|(a, b)| Vec2::new(0.5 + 0.5 * a, 0.5 - 0.5 * b)).to_vec(),
            occlusion: vec![255; 4],
            tiles: vec![0; 4],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Mesh::default()
        }
    }
}

/// A normal of a frame, by what the normal map holds and the green of the other.
fn looking(normal: Vec3, green: f32) -> Vec3 {
    let away = ((green - ROUGH) / (255.0 - ROUGH)).clamp(0.0, 1.0);
    normal * (1.0 - away * away).sqrt() - Vec3::Z * away
}

/// Some pixels of what faces a viewer.
pub(super) struct Glimpse {
    /// Without places.
    facing: Facing,
    pixels: Vec<u32>,
    places: Vec<[Vec2; 3]>,
}

impl Glimpse {
    /// The frames that it mixes, as (column, row), and their shares.
    pub(super) fn frames(&self) -> impl Iterator<Item = ((u32, u32), f32)> {
        self.facing.frames.into_iter().filter(|(_, share)| *share > 0.0)
    }

    /// Which of the pixels are solid, of a sheet of so many texels a row whose alpha is 0..=1.
    pub(super) fn solid(&self, all: &[f32], wide: usize) -> Silhouette {
        let (facing, sheet) = (&self.facing, self.facing.texels(all, wide));
        let is_solid = |places: &[Vec2; 3]| facing.mixed(places, |place| sheet.between(place, |a| *a)) >= 0.5;
        let solid = self.pixels.iter().zip(&self.places).filter(|(_, places)| is_solid(places));
        Silhouette::of(facing.columns, facing.rows, solid.map(|(i, _)| *i as usize))
    }
}

impl Impostor {
    /// What its shader shows a viewer far away with the axes `viewer` (`z` towards them): a rectangle and the picture that it
    /// wears as tile 0. `sheet` holds the sheet between the corners `low` and `high` (0..=1, v down). Nothing of a sheet
    /// without texels.
    #[must_use]
    pub fn seen_from(&self, viewer: Frame, sheet: &Maps, corners: (Vec2, Vec2)) -> (Mesh, Maps) {
        self.shown((viewer, TWIGS), sheet, corners)
    }

    fn shown(&self, seen: (Frame, usize), sheet: &Maps, corners: (Vec2, Vec2)) -> (Mesh, Maps) {
        let texels = sheet.width as usize * sheet.height as usize;
        let is_whole = sheet.color.len() >= texels && sheet.normal.len() >= texels;
        match self.faced(seen, (sheet.width, sheet.height), &sheet.orm, corners).filter(|_| is_whole) {
            Some(facing) => (facing.quad(), facing.maps(sheet)),
            None => (Mesh::default(), Maps { width: 0, height: 0, color: vec![], normal: vec![], orm: vec![] }),
        }
    }

    /// As [`seen_from`](Self::seen_from), before anything but depth is looked at.
    pub(crate) fn facing(
        &self,
        viewer: Frame,
        size: (u32, u32),
        orm: &[[u8; 3]],
        corners: (Vec2, Vec2),
    ) -> Option<Facing> {
        self.faced((viewer, CROWNS), size, orm, corners)
    }

    fn faced(
        &self,
        seen: (Frame, usize),
        (width, height): (u32, u32),
        orm: &[[u8; 3]],
        (low, high): (Vec2, Vec2),
    ) -> Option<Facing> {
        let whole = Vec2::new(width as f32, height as f32);
        let corner = |at: Vec2| ((at.clamp(Vec2::ZERO, Vec2::ONE) * whole) + 0.5).as_uvec2();
        let (first, end) = (corner(low), corner(high));
        if orm.len() < width as usize * height as usize || !first.cmplt(end).all() {
            return None;
        }
        let pair = |v: glam::UVec2| (v.x as usize, v.y as usize);
        let depths = Texels { all: orm, wide: width as usize, first: pair(first), size: pair(end - first) };
        Some(Facing::new(self, seen, depths, |orm| (f32::from(orm[2]) / 127.5 - 1.0) * self.radius))
    }

    /// The same as a level that is measured.
    #[must_use]
    pub fn as_seen(
        &self,
        viewer: Frame,
        sheet: &Maps,
        corners: (Vec2, Vec2),
    ) -> (Cow<'static, TreeMesh>, Cow<'static, Wardrobe>) {
        self.worn((viewer, TWIGS), sheet, corners)
    }

    /// As [`as_seen`](Self::as_seen), of so many pixels a texel, along an edge.
    pub(super) fn worn(
        &self,
        seen: (Frame, usize),
        sheet: &Maps,
        corners: (Vec2, Vec2),
    ) -> (Cow<'static, TreeMesh>, Cow<'static, Wardrobe>) {
        let (leaf, maps) = self.shown(seen, sheet, corners);
        let wardrobe = Wardrobe { leaves: vec![Picture::new(&maps)], bark: Arc::default() };
        (Cow::Owned(TreeMesh { leaf, ..TreeMesh::default() }), Cow::Owned(wardrobe))
    }

    /// Half the width and height of the rectangle around the tree that faces a viewer in the direction `z` (unit), metres.
    pub(super) fn extent_from(&self, z: Vec3) -> Vec2 {
        let level = (z.x * z.x + z.z * z.z).sqrt();
        Vec2::new(self.reach, self.height * level + self.reach * z.y.abs())
    }

    /// The three frames, as (column, row), that are mixed for a direction (unit, towards the viewer), and their shares.
    /// Directions from below take those at the horizon.
    #[must_use]
    pub fn blended(&self, direction: Vec3) -> [((u32, u32), f32); 3] {
        let d = Vec3::new(direction.x, direction.y.max(0.0), direction.z);
        let d = d / (d.x.abs() + d.y + d.z.abs()).max(1e-9);
        let last = self.frames.saturating_sub(1).max(1);
        let at = (Vec2::new(d.x + d.z, d.z - d.x) * 0.5 + 0.5).clamp(Vec2::ZERO, Vec2::ONE) * last as f32;
        let (x, y) = ((at.x as u32).min(last - 1), (at.y as u32).min(last - 1));
        let f = at - Vec2::new(x as f32, y as f32);
        // Each square of the grid is two triangles that share the corners (0, 0) and (1, 1).
        let (side, weights) = if f.x > f.y {
            ((x + 1, y), [1.0 - f.x, f.x - f.y, f.y])
        } else {
            ((x, y + 1), [1.0 - f.y, f.y - f.x, f.x])
        };
        [((x, y), weights[0]), (side, weights[1]), ((x + 1, y + 1), weights[2])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAYOUT: Impostor =
        Impostor { frames: 8, centre: Vec3::new(1.0, 3.0, 0.0), radius: 5.0, reach: 3.0, height: 4.0 };
    const EDGE: u32 = 160;
    const WHOLE: (Vec2, Vec2) = (Vec2::ZERO, Vec2::ONE);

    /// A sheet of 8 by 8 frames of 20 texels; `texel` gives its depth, metres, and its alpha by frame and place, -1..=1, v up.
    fn sheet(texel: impl Fn((u32, u32), Vec2) -> (f32, u8)) -> Maps {
        let at = |i: u32| {
            let (x, y) = (i % EDGE, i / EDGE);
            let within = Vec2::new((x % 20) as f32, (y % 20) as f32) + 0.5;
            texel((x / 20, y / 20), (within / 10.0 - 1.0) * Vec2::new(1.0, -1.0))
        };
        let pixels: Vec<(f32, u8)> = (0..EDGE * EDGE).map(at).collect();
        Maps {
            width: EDGE,
            height: EDGE,
            color: pixels.iter().map(|p| [50, 100, 20, p.1]).collect(),
            normal: vec![[128, 128, 255]; pixels.len()],
            orm: pixels.iter().map(|p| [255, 200, ((0.5 + 0.5 * p.0 / LAYOUT.radius) * 255.0 + 0.5) as u8]).collect(),
        }
    }

    fn viewer(z: Vec3) -> Frame {
        let z = z.normalize();
        let x = Vec3::Y.cross(z).normalize();
        Frame { x, y: z.cross(x), z }
    }

    /// Where a ball around a point (metres from the middle) is in each frame, and its depth there.
    fn ball(middle: Vec3, radius: f32) -> Maps {
        sheet(|frame, at| {
            let (axes, extent) = (LAYOUT.axes(frame), LAYOUT.extent(frame));
            let middle = axes.to_local(middle);
            let off = at * extent - Vec2::new(middle.x, middle.y);
            (middle.z, if off.length() < radius { 255 } else { 0 })
        })
    }

    #[test]
    fn normals_that_look_away_from_the_viewer_come_back_from_two_maps_of_which_the_first_looks_at_them() {
        for i in 0..2000 {
            let normal = crate::base::Seed::new(4).at(i).direction();
            let (bytes, away) = super::super::impostor::held(normal);
            let green = (ROUGH + away * (255.0 - ROUGH)).round();
            let map = Vec3::from(bytes.map(|b| (f32::from(b) - 128.0) / 127.0));
            assert!(map.z > 0.0 && green >= ROUGH);
            // To some degrees: 55 steps of green, and the rim is held a little before itself.
            let back = looking(map.normalize(), green).normalize();
            assert!(back.dot(normal) > 0.99, "{normal} {back}");
        }
        // What looks at the viewer has a leaf's roughness.
        assert_eq!(super::super::impostor::held(Vec3::Z), ([128, 128, 255], 0.0));
    }

    #[test]
    fn shares_are_one_in_all_and_a_frames_own_direction_is_its_alone() {
        for i in 0..64 {
            let frame = (i % 8, i / 8);
            let (mixed, own) = (LAYOUT.blended(LAYOUT.axes(frame).z), |m: &((u32, u32), f32)| m.0 == frame);
            assert!(
                (mixed.iter().filter(|m| own(m)).map(|m| m.1).sum::<f32>() - 1.0).abs() < 1e-4,
                "{frame:?} {mixed:?}"
            );
        }
        let fine = Impostor { frames: 12, ..LAYOUT };
        for (layout, near) in [(LAYOUT, 0.93), (fine, 0.97)] {
            for i in 0..500 {
                let d = crate::base::Seed::new(4).at(i).direction();
                let mixed = layout.blended(d);
                assert!((mixed.iter().map(|m| m.1).sum::<f32>() - 1.0).abs() < 1e-5);
                assert!(mixed.iter().all(|m| m.0.0 < layout.frames && m.0.1 < layout.frames));
                let d = d.with_y(d.y.max(0.0)).normalize();
                let most = mixed.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
                assert!(layout.axes(most.0).z.dot(d) > near, "{d} {mixed:?}");
            }
        }
    }

    #[test]
    fn what_lies_at_a_depth_is_seen_where_it_is_from_everywhere() {
        for (i, middle) in
            [Vec3::new(1.0, 0.5, 1.5), Vec3::new(-1.2, -2.0, 0.3), Vec3::new(0.0, 2.5, -1.0)].into_iter().enumerate()
        {
            let maps = ball(middle, 1.2);
            for k in 0..40 {
                let way = crate::base::Seed::new(7).at(i as u64 * 100 + k).direction();
                let from = viewer(way.with_y(way.y.abs()));
                let (quad, seen) = LAYOUT.seen_from(from, &maps, WHOLE);
                let half = quad.positions[2] - LAYOUT.centre;
                let half = Vec2::new(half.dot(from.x), half.dot(from.y));
                let (mut sum, mut count) = (Vec2::ZERO, 0);
                for (p, _) in seen.color.iter().enumerate().filter(|(_, c)| c[3] >= 128) {
                    let at = Vec2::new((p as u32 % seen.width) as f32, (p as u32 / seen.width) as f32) + 0.5;
                    let size = Vec2::new(seen.width as f32, seen.height as f32);
                    sum += (at / size * 2.0 - 1.0) * Vec2::new(1.0, -1.0) * half;
                    count += 1;
                }
                let found = sum / count as f32;
                let wanted = Vec2::new(middle.dot(from.x), middle.dot(from.y));
                assert!(found.distance(wanted) < 0.12, "{middle} from {}: {found} and not {wanted}", from.z);
                let area = count as f32 * 4.0 * half.x * half.y / (seen.width * seen.height) as f32;
                assert!((area / (std::f32::consts::PI * 1.44) - 1.0).abs() < 0.25, "{area}");
            }
        }
    }

    #[test]
    fn alpha_alone_is_that_of_all_maps_and_the_quad_faces_the_viewer() {
        let maps = ball(Vec3::new(0.5, 1.0, 0.0), 1.5);
        let from = viewer(Vec3::new(0.3, 0.4, -1.0));
        let (quad, seen) = LAYOUT.seen_from(from, &maps, WHOLE);
        let facing = LAYOUT.faced((from, TWIGS), (EDGE, EDGE), &maps.orm, WHOLE).unwrap();
        let alphas: Vec<u8> = maps.color.iter().map(|c| c[3]).collect();
        let alone = facing.alpha(&alphas, EDGE as usize);
        assert_eq!((alone.len(), facing.size()), (seen.color.len(), (20 * TWIGS as u32, 20 * TWIGS as u32)));
        assert!(alone.iter().zip(&seen.color).all(|(a, c)| a.abs_diff(c[3]) <= 1));
        assert!(quad.normals.iter().all(|n| *n == from.z) && crate::mesh::problems(&quad).is_empty());
        assert!(seen.normal.iter().zip(&seen.color).all(|(n, c)| c[3] < 128 || n[2] > 240));
    }

    #[test]
    fn a_part_of_an_atlas_is_a_sheet_and_nonsense_shows_nothing() {
        let maps = ball(Vec3::ZERO, 1.5);
        let pad = |all: &[[u8; 3]]| -> Vec<[u8; 3]> {
            all.chunks(EDGE as usize).flat_map(|row| row.iter().copied().chain(vec![[9; 3]; EDGE as usize])).collect()
        };
        let color: Vec<[u8; 4]> = maps
            .color
            .chunks(EDGE as usize)
            .flat_map(|row| row.iter().copied().chain(vec![[9, 9, 9, 255]; EDGE as usize]))
            .collect();
        let wide = Maps { width: 2 * EDGE, height: EDGE, color, normal: pad(&maps.normal), orm: pad(&maps.orm) };
        let from = viewer(Vec3::new(0.1, 0.2, -1.0));
        assert_eq!(
            LAYOUT.seen_from(from, &maps, WHOLE),
            LAYOUT.seen_from(from, &wide, (Vec2::ZERO, Vec2::new(0.5, 1.0)))
        );
        let none = Maps { width: 0, height: 0, color: vec![], normal: vec![], orm: vec![] };
        assert!(LAYOUT.seen_from(from, &none, WHOLE).0.indices.is_empty());
        assert!(LAYOUT.seen_from(from, &maps, (Vec2::ONE, Vec2::ZERO)).0.indices.is_empty());
        let short = Maps { width: 99, height: 9999, ..maps };
        assert!(LAYOUT.seen_from(from, &short, WHOLE).0.indices.is_empty());
    }
}
