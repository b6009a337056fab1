//! One card: what stands near a plane, drawn onto it, as a tile and a polygon.
//!
//! Both sides are one picture: the leaves of a card lie so near to its plane that which is in front does not matter at
//! the size at which cards are seen. Alpha is coverage scaled so that as many texels pass the alpha test at 0.5 as the
//! content covers of the card's area, times a gain that the caller finds by measuring whole trees. It lets as much light
//! through as the leaves seen on it do, mixed with the wood; leaves behind those take none of it, since an engine's shadows
//! fall on cards as they do on leaves.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::bent::Bend;
use super::lacks::Lacks;
use super::measure::Wardrobe;
use super::outline::octagon;
use super::packed::as_packed;
use super::tile::{Tile, share};
use crate::bake::{Cutout, Design, PictureKind, Recipe, Repeat, Shading, Surface, Target, View, rasterize, survey};
use crate::base::Frame;
use crate::mesh::{CrownLight, Mesh, TreeMesh, add_tangents};

/// Samples along an edge of a texel.
const SAMPLES: u32 = 3;
/// Least of a texel that is worth alpha: below it are specks.
const SPECK: f32 = 0.02;
/// What wood covers at least of a texel that stays solid, and the alpha of such.
const WOOD: f32 = 0.15;
const SOLID: u8 = 144;
/// How much of a card's vertex normals is the crown's; the rest is the card's own, which its texels' normals stand on.
const CANOPY: f32 = 0.5;
/// Vertex normals of pairs back to back: how far they look outward from their middle, up at the top and down at the foot, and to the
/// viewer. They are nearly those of their places, so that where two cards cross they are alike, and both sides. With more of the face
/// each card was one plane under the sun: twice as bright as the tree from one side, black from the other, and a hard line
/// down the middle of the crown where a viewer saw both (32 suns, deviation of the logarithm of brightness: 0.74 to 1.11, and 0.16 to
/// 0.23 with these).
const OUTWARD: f32 = 1.3;
const UPWARD: [f32; 2] = [-0.2, 0.35];
const FACE: f32 = 0.12;
/// By how much more what is baked is open to the sky. Normals of leaves that are one texel's, or are mixed when it is seen, look one
/// way, and a sun that stands there lights all of them: pictures that are as bright as the tree under sun and sky together were 0.90
/// as bright as six trees under the sky alone.
const OPENED: f32 = 1.12;
/// Roughness of leaves, of 255.
const ROUGHNESS: u8 = 200;

/// A rectangle in space: the plane of a card and the part of it that is baked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// `x` right, `y` up, `z` out of its front.
    pub(super) frame: Frame,
    pub(super) centre: Vec3,
    pub(super) half: Vec2,
}

impl Place {
    /// The smallest upright rectangle around some points on the plane through `on` with the normal `z`.
    pub(super) fn around(z: Vec3, on: Vec3, points: impl Iterator<Item = Vec3>) -> Option<Self> {
        let x = Vec3::Y.cross(z).try_normalize().unwrap_or(Vec3::X);
        let frame = Frame { x, y: z.cross(x), z };
        let (mut low, mut high) = (Vec2::MAX, Vec2::MIN);
        for p in points {
            let p = Vec2::new(x.dot(p - on), frame.y.dot(p - on));
            (low, high) = (low.min(p), high.max(p));
        }
        let (half, middle) = ((high - low) * 0.5, (high + low) * 0.5);
        let real = half.is_finite() && half.x > 1e-5 && half.y > 1e-5;
        real.then_some(Self { frame, centre: on + x * middle.x + frame.y * middle.y, half })
    }

    pub(super) fn area(&self) -> f32 {
        4.0 * self.half.x * self.half.y
    }

    fn point(&self, at: Vec2) -> Vec3 {
        self.centre + self.frame.x * at.x + self.frame.y * at.y
    }

    /// Where a point lies on it, -1..=1, and how far in front of it.
    pub(super) fn over(&self, point: Vec3) -> (Vec2, f32) {
        let d = point - self.centre;
        (Vec2::new(self.frame.x.dot(d), self.frame.y.dot(d)) / self.half, self.frame.z.dot(d))
    }

    fn view(&self) -> View {
        View::new(self.frame, self.centre, self.half.x, self.half.y)
    }
}

/// A baked card before its alpha is settled.
#[derive(Clone, Debug)]
pub(super) struct Card {
    /// Its polygon with normals and tangents; texture coordinates in its own picture, `tiles` zero.
    pub(super) mesh: Mesh,
    size: (u32, u32),
    normal: Vec<[u8; 3]>,
    orm: Vec<[u8; 3]>,
    recipe: Recipe,
    /// How much of each texel was drawn, of 255; all of those that stand.
    drawn: Vec<u8>,
    place: Place,
    bend: Bend,
    /// Share of each texel that is covered, and what was added since.
    coverage: Vec<f32>,
    /// Texels' worth of content.
    covered: f32,
    /// Texels that are solid whatever the gain.
    stands: Vec<u32>,
}

impl Card {
    /// Draws `content` onto `place`, bent, at `size` texels. Nothing when the place stays empty.
    pub(super) fn bake(
        content: &TreeMesh,
        (place, bend): (&Place, &Bend),
        size: (u32, u32),
        wardrobe: &Wardrobe,
        light: &CrownLight,
    ) -> Option<Self> {
        let mut surfaces = wardrobe.dressed(content);
        // Ribbons are seen from both sides.
        surfaces[0].closed = false;
        let (drawn, recipe) = survey(&surfaces, &place.view(), size.0, size.1, SAMPLES, &Shading::Albedo);
        let mesh =
            if *bend == Bend::FLAT { polygon(&drawn, place, light)? } else { sheet(&drawn, (place, bend), light)? };
        // The polygon drawn like its content gives the normals that a texel's normal is relative to.
        let bare = Surface { mesh: &mesh, pictures: &[], repeat: Repeat::Cutout, closed: false };
        let ground = rasterize(&[bare], &place.view(), drawn.width, drawn.height, 1, &Shading::Albedo);
        let through: Vec<u8> = surfaces.iter().flat_map(Surface::through).collect();
        let (normal, orm) = relief(&drawn, &ground, place, &recipe.mean(&through));
        let covered = drawn.coverage.iter().sum();
        let size = (drawn.width, drawn.height);
        Some(Self {
            mesh,
            size,
            place: *place,
            bend: bend.clone(),
            normal,
            orm,
            recipe,
            drawn: drawn.coverage.iter().map(|covered| share(*covered)).collect(),
            coverage: drawn.coverage,
            covered,
            stands: Vec::new(),
        })
    }

    /// Makes it a pair of rectangles back to back, each seen from one side only since it hides the other, `apart` metres
    /// from the plane. Normals can then be those of the crown, alike on all cards, without an engine turning them round
    /// on the back; nothing shines, which would by the glancing light that such normals tell of. Wood, which the first `barks`
    /// pictures are of, faces the viewer: with the crown's normals the foot of a trunk was lit from below. And what of it is most of a row stays solid: a thin trunk that is settled like leaves has gaps, and its crown
    /// floats.
    pub(super) fn back_to_back(&mut self, place: &Place, apart: f32, barks: u32) {
        let mut mesh = Mesh::default();
        for side in [1.0_f32, -1.0] {
            let face = place.frame.z * side;
            let first = mesh.positions.len() as u32;
            for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                let position = place.point(place.half * Vec2::new(x, y)) + face * apart;
                let up = place.frame.y * UPWARD[usize::from(y > 0.0)];
                let normal = place.frame.x * (x * OUTWARD) + up + face * FACE;
                mesh.positions.push(position);
                mesh.normals.push(normal.normalize_or(face));
                mesh.uvs.push(Vec2::new(0.5 + 0.5 * x, 0.5 - 0.5 * y));
                mesh.occlusion.push(255);
                mesh.tiles.push(0);
            }
            let corners: [u32; 6] = if side > 0.0 { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
            mesh.indices.extend(corners.map(|c| first + c));
        }
        // An error only says that the mesh has no triangles to take tangents from.
        let _ = add_tangents(&mut mesh);
        self.mesh = mesh;
        // Both sides have the same normal map: the crown's normals are as good as mirrored in the plane.
        let bare = Surface { mesh: &self.mesh, pictures: &[], repeat: Repeat::Cutout, closed: false };
        let ground = rasterize(&[bare], &place.view(), self.size.0, self.size.1, 1, &Shading::Albedo);
        self.orm.iter_mut().for_each(|orm| orm[1] = u8::MAX);
        for ((normal, wood), up) in self.normal.iter_mut().zip(self.recipe.share_of_first(barks)).zip(ground.normal) {
            let up = up.try_normalize().unwrap_or(place.frame.z);
            *normal = relative(up.lerp(place.frame.z, wood), up, place.frame.x);
        }
        let wood: Vec<f32> =
            self.recipe.share_of_first(barks).zip(&self.coverage).map(|(share, c)| share * c).collect();
        let (width, count) = (self.size.0 as usize, self.size.1);
        let most = |row: u32| {
            let first = row as usize * width;
            let of_row = (first..first + width).filter(|&i| wood[i] > WOOD);
            of_row.max_by(|&a, &b| wood[a].total_cmp(&wood[b])).map(|i| i as u32)
        };
        self.stands = (0..count).filter_map(most).collect();
        self.stands.iter().for_each(|&i| self.drawn[i as usize] = u8::MAX);
    }

    /// Lets texels that lack something grow towards being solid, and others away from it, by `step` times what `lacks`
    /// tells of where they are.
    pub(super) fn adjust(&mut self, lacks: &Lacks, step: f32) {
        let scale = self.scale(1.0);
        let (w, h) = (self.size.0 as usize, self.size.1 as usize);
        let half = self.place.half;
        for (i, c) in self.coverage.iter_mut().enumerate().filter(|(_, c)| **c > SPECK) {
            let at = Vec2::new((i % w) as f32 + 0.5, (i / w) as f32 + 0.5) / Vec2::new(w as f32, h as f32) * 2.0 - 1.0;
            let at = Vec2::new(at.x, -at.y);
            let point = self.place.point(at * half) + self.place.frame.z * self.bend.at(at);
            *c = (*c * scale + step * lacks.at(point)).clamp(SPECK * 1.5, 1.0);
        }
        self.covered = self.coverage.iter().filter(|c| **c >= 0.5).count() as f32;
    }

    /// What of the card passes the alpha test as it is, with `gain` times the area that its content covers solid.
    pub(super) fn outline(&self, gain: f32) -> Cutout {
        Cutout::new(self.size.0, self.size.1, self.alpha(gain))
    }

    /// What of each card passes the alpha test, with alpha as an atlas keeps it.
    pub(super) fn cutouts(cards: &[Self], alphas: &[Vec<u8>]) -> Vec<Cutout> {
        let packed = alphas.par_iter().zip(cards);
        packed.map(|(alpha, card)| Cutout::as_packed(card.size.0, card.size.1, alpha)).collect()
    }

    /// The alpha of each card as an atlas keeps it, with `gain` times the area that its content covers solid.
    pub(super) fn packed(cards: &[Self], gain: f32, design: &mut Design) -> Vec<Vec<u8>> {
        let alphas: Vec<Vec<u8>> = cards.par_iter().map(|card| card.alpha(gain)).collect();
        let sizes: Vec<(u32, u32)> = cards.iter().map(|card| card.size).collect();
        as_packed(&alphas, &sizes, PictureKind::Card, design)
    }

    /// The card's picture.
    pub(super) fn finish(&self, alpha: Vec<u8>) -> Tile {
        Tile::new(self.size, alpha, self.normal.clone(), self.orm.clone(), (self.recipe.clone(), self.drawn.clone()))
    }

    /// What coverage is multiplied by so that `gain` times the area that its content covers is a half and more.
    fn scale(&self, gain: f32) -> f32 {
        let wanted = (self.covered * gain).max(1.0) as usize;
        let mut seen: Vec<f32> = self.coverage.iter().copied().filter(|c| *c > SPECK).collect();
        let last = (wanted - 1).min(seen.len().saturating_sub(1));
        let threshold = (!seen.is_empty()).then(|| *seen.select_nth_unstable_by(last, |a, b| b.total_cmp(a)).1);
        0.5 / threshold.unwrap_or(0.5).clamp(SPECK, 1.0)
    }

    fn alpha(&self, gain: f32) -> Vec<u8> {
        let scale = self.scale(gain);
        let alpha = |&c: &f32| if c > SPECK { (c * scale * 255.0 + 0.5).clamp(0.0, 255.0) as u8 } else { 0 };
        let mut alphas: Vec<u8> = self.coverage.iter().map(alpha).collect();
        self.stands.iter().for_each(|&i| alphas[i as usize] = alphas[i as usize].max(SOLID));
        alphas
    }
}

/// The octagon around what was drawn, as a fan.
fn polygon(drawn: &Target, place: &Place, light: &CrownLight) -> Option<Mesh> {
    let (w, h) = (drawn.width as usize, drawn.height as usize);
    let step = Vec2::new(2.0 * place.half.x / w as f32, 2.0 * place.half.y / h as f32);
    // Only the ends of each row can touch a convex outline.
    let mut ends = Vec::with_capacity(4 * h);
    for row in 0..h {
        let line = &drawn.coverage[row * w..(row + 1) * w];
        let seen = |c: &f32| *c > SPECK;
        if let (Some(a), Some(b)) = (line.iter().position(seen), line.iter().rposition(seen)) {
            for (x, y) in [(a, row), (b + 1, row), (a, row + 1), (b + 1, row + 1)] {
                ends.push(Vec2::new(x as f32 * step.x - place.half.x, place.half.y - y as f32 * step.y));
            }
        }
    }
    // Octagons are cut along the card's diagonals: measured in halves of its edges.
    let corners: Vec<Vec2> =
        octagon(ends.into_iter().map(|p| p / place.half)).into_iter().map(|p| p * place.half).collect();
    if corners.len() < 3 {
        return None;
    }
    let mut mesh = Mesh::default();
    for &corner in &corners {
        let position = place.point(corner);
        let normal = light.outward(position) * CANOPY + place.frame.z * (1.0 - CANOPY);
        mesh.positions.push(position);
        mesh.normals.push(normal.normalize_or(place.frame.z));
        let uv = corner / place.half * 0.5;
        mesh.uvs.push(Vec2::new((0.5 + uv.x).clamp(0.0, 1.0), (0.5 - uv.y).clamp(0.0, 1.0)));
        mesh.occlusion.push(255);
        mesh.tiles.push(0);
    }
    for k in 1..corners.len() as u32 - 1 {
        mesh.indices.extend([0, k, k + 1]);
    }
    add_tangents(&mut mesh).ok()?;
    Some(mesh)
}

/// A grid of cells that follows the leaves; cells that show nothing are left out.
fn sheet(drawn: &Target, (place, bend): (&Place, &Bend), light: &CrownLight) -> Option<Mesh> {
    let (w, h, cells) = (drawn.width as usize, drawn.height as usize, bend.cells());
    let mut mesh = Mesh::default();
    let mut corner_of = vec![u32::MAX; (cells + 1) * (cells + 1)];
    for (row, column) in (0..cells).flat_map(|row| (0..cells).map(move |column| (row, column))) {
        // Rows of texels go down.
        let texels = |cell: usize, count: usize| cell * count / cells..((cell + 1) * count).div_ceil(cells);
        let mut rows = texels(cells - 1 - row, h);
        if !rows.any(|y| drawn.coverage[y * w..][texels(column, w)].iter().any(|c| *c > SPECK)) {
            continue;
        }
        let mut corner = |dx: usize, dy: usize| {
            let (x, y) = (column + dx, row + dy);
            let index = &mut corner_of[y * (cells + 1) + x];
            if *index == u32::MAX {
                *index = mesh.positions.len() as u32;
                let at = Vec2::new(x as f32, y as f32) / cells as f32 * 2.0 - 1.0;
                let position = place.point(at * place.half) + place.frame.z * bend.at(at);
                let normal = light.outward(position) * CANOPY + place.frame.z * (1.0 - CANOPY);
                mesh.positions.push(position);
                mesh.normals.push(normal.normalize_or(place.frame.z));
                mesh.uvs.push(Vec2::new(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y));
                mesh.occlusion.push(255);
                mesh.tiles.push(0);
            }
            *index
        };
        let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
        mesh.indices.extend([a, b, c, a, c, d]);
    }
    add_tangents(&mut mesh).ok()?;
    Some(mesh)
}

/// Normals relative to the polygon's, and occlusion with what is let `through`.
fn relief(drawn: &Target, ground: &Target, place: &Place, through: &[u8]) -> (Vec<[u8; 3]>, Vec<[u8; 3]>) {
    let count = drawn.coverage.len();
    let (mut normal, mut orm) = (vec![[128, 128, 255]; count], vec![[255, ROUGHNESS, 0]; count]);
    for i in 0..count {
        if drawn.coverage[i] <= SPECK {
            continue;
        }
        orm[i][0] = opened(drawn.occlusion[i]);
        orm[i][2] = through[i];
        let up = ground.normal[i].try_normalize().unwrap_or(place.frame.z);
        normal[i] = relative(drawn.normal[i], up, place.frame.x);
    }
    (normal, orm)
}

/// Occlusion as a texel of what is baked holds it.
pub(super) fn opened(occlusion: f32) -> u8 {
    ((occlusion * OPENED).clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// A normal as a texel holds it, of a surface whose own is `up` and whose pictures go along `x`.
fn relative(normal: Vec3, up: Vec3, x: Vec3) -> [u8; 3] {
    let along = (x - up * up.dot(x)).normalize_or(x);
    let n = normal.normalize_or(up);
    // It can't point behind the surface.
    let n = Vec3::new(n.dot(along), n.dot(up.cross(along)), n.dot(up).max(0.05)).normalize_or(Vec3::Z);
    [n.x, n.y, n.z].map(|v| (v * 127.0 + 128.5) as u8)
}
