//! Sheets become cards: the flat rectangle that fits a sheet best, with its base at the stem's end, and its picture.
//!
//! Sheets that look alike make a group and share a picture: same material, same triangles, and the same texture
//! coordinates or, where those say nothing, the same shape. A group has one flat map: its texture coordinates, or the
//! first sheet laid flat. Each sheet is an affine image of the map (least squares), so what is decided once in the map
//! (which side is the base, where the rectangle lies) holds for all, and a quad's four corners come out exactly.
//!
//! The base is the side, or for outlines the corner, that lies nearest to the wood, by vote of the whole group: single
//! leaves may point back at the branch. The picture's lower edge wins a tie.

use glam::{Vec2, Vec3};

use super::component::Component;
use super::decide::{Piece, Role};
use super::frond;
use super::near::Near;
use super::picture::{CardCorner, CardPicture, Gallery, LeafPicture};
use super::tone::Tones;
use super::{Parts, UNMAPPED, sample, words};
use crate::base::counted;
use crate::source::scene::{Alpha, Image, Scene, Transmission};

/// Most pictures of one plant; rarer groups wear the likest of the others.
const MOST_PICTURES: usize = 48;
/// Most groups that are told apart within one kind of triangles.
const MOST_GROUPS: usize = 96;
/// Sheets of a group that vote for the base.
const VOTERS: usize = 400;
/// How far a sheet may stray from an affine image of its texture coordinates, as a share of its size.
const STRAY: f64 = 0.25;

/// A leaf's card in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Card {
    /// Middle of the lower edge.
    pub base: Vec3,
    /// Unit: across, from base to tip, and out of the front.
    pub axes: [Vec3; 3],
    /// From base to tip.
    pub length: f32,
    /// Across.
    pub width: f32,
    /// Which picture it wears.
    pub slot: u16,
    /// Of a frond how far its tip turns away from the front, and how far its halves lean back, radians.
    pub bend: Option<(f32, f32)>,
}

impl Card {
    /// Middle of the card.
    #[must_use]
    pub fn centre(&self) -> Vec3 {
        self.base + self.axes[1] * (self.length * 0.5)
    }
}

/// A sheet as its group sees it.
#[derive(Debug)]
struct Sheet {
    points: Vec<Vec3>,
    normal: Vec3,
}

/// Sheets that share a picture.
#[derive(Debug)]
struct Group {
    material: Option<usize>,
    /// What members are compared by, and how far they may differ.
    traits: Vec<f32>,
    tolerance: f32,
    triangles: Vec<[u32; 3]>,
    /// The flat map of the first sheet.
    map: Vec<Vec2>,
    /// Whether the map is in texture coordinates.
    textured: bool,
    /// Texture coordinates and colours of each triangle's corners.
    corners: Vec<[(Vec2, [f32; 3]); 3]>,
    /// Colour of the material where it has a picture and the sheets no coordinates for it.
    unmapped: Option<[f32; 3]>,
    sheets: Vec<Sheet>,
}

/// A rectangle in a group's map: middle of the base, the vector to the tip, and the vector across.
#[derive(Clone, Copy, Debug)]
struct Window {
    base: Vec2,
    up: Vec2,
    across: Vec2,
}

/// Makes the cards of all leaves, and their pictures.
pub(super) fn cards(scene: &Scene, tones: &Tones<'_>, pieces: &[Piece], gallery: &mut Gallery<'_>, parts: &mut Parts) {
    if !pieces.iter().any(|p| matches!(p.role, Role::Leaf | Role::Frond)) {
        return;
    }
    let near = Near::new(sample(scene, pieces, &[Role::Wood, Role::Stalk]).into_iter());
    let groups = groups(scene, tones, pieces);
    let windows: Vec<Window> = groups.iter().map(|group| window(group, &near)).collect();
    let slots = slots(&groups, &windows);
    let (mut crushed, mut strangers, mut unmapped) = (0, 0, 0);
    let needles = |group: &Group| {
        let material = group.material.and_then(|m| scene.materials.get(m));
        material.is_some_and(|m| words::is_conifer(&m.name))
    };
    let mut faces: Vec<u32> = Vec::new();
    for ((group, window), &(slot, own)) in groups.iter().zip(&windows).zip(&slots) {
        for sheet in &group.sheets {
            let Some(card) = place(group, sheet, window, slot) else {
                crushed += 1;
                continue;
            };
            parts.cards.push(card);
            faces.push(preference(scene, group));
            strangers += usize::from(!own);
            unmapped += usize::from(group.unmapped.is_some());
        }
        if own {
            parts.art.leaves.push(match group.unmapped {
                // A quad's leaf is cut out by its picture, an outline is one itself.
                Some(color) if quad(group).is_some() => LeafPicture::Spray { color, needles: needles(group) },
                _ => LeafPicture::Card(picture(scene, group, window, gallery)),
            });
        }
    }
    let joined = join_backs(&mut parts.cards, &faces);
    let (fronds, bare) = fronds(scene, tones, pieces, &near, gallery, parts);
    if unmapped + bare > 0 {
        let have = counted(unmapped + bare, "leaf has", "leaves have");
        parts.notes.push(format!(
            "{have} {UNMAPPED}: they are made in its mean colour; export the mesh with its coordinates, or name a leaf in the \
             preset, `foliage: (leaf: \"oak\")`"
        ));
    }
    for (n, one, many) in [
        (fronds, "frond became a bent card", "fronds became bent cards"),
        (joined, "leaf's back was joined with its front", "leaves' backs were joined with their fronts"),
        (crushed, "leaf without an area was dropped", "leaves without an area were dropped"),
        (
            strangers,
            "leaf of a rare shape wears the likest of the other leaves' pictures",
            "leaves of rare shapes wear the likest of the other leaves' pictures",
        ),
    ] {
        if n > 0 {
            parts.notes.push(counted(n, one, many));
        }
    }
}

/// Makes the cards of all fronds; how many there are, and how many of them have no coordinates for their picture.
fn fronds(
    scene: &Scene,
    tones: &Tones<'_>,
    pieces: &[Piece],
    near: &Near,
    gallery: &mut Gallery<'_>,
    parts: &mut Parts,
) -> (usize, usize) {
    let mut slots: Vec<(Option<usize>, u16)> = Vec::new();
    let (mut count, mut bare) = (0, 0);
    for piece in pieces.iter().filter(|p| p.role == Role::Frond) {
        let part = &scene.parts[piece.component.part];
        let known = slots.iter().find(|(material, _)| *material == part.material).or_else(|| {
            // No more pictures than an atlas can hold.
            slots.first().filter(|_| parts.art.leaves.len() >= super::MOST_SLOTS)
        });
        let known = known.map(|(_, first)| *first);
        let first = known.unwrap_or_else(|| {
            let first = parts.art.leaves.len() as u16;
            let plain = worn(scene, part.material, tones.unmapped(part), gallery);
            let picture = frond::picture(part, &piece.component, near, &plain);
            parts.art.leaves.push(LeafPicture::Card(picture));
            slots.push((part.material, first));
            first
        });
        parts.cards.extend(frond::card(part, &piece.component, near, first));
        count += 1;
        bare += usize::from(tones.unmapped(part).is_some());
    }
    (count, bare)
}

/// Leaves of one material and the same triangles.
type Kind = (Option<usize>, Vec<[u32; 3]>);

/// All leaves by what they look like, in order of their first.
fn groups(scene: &Scene, tones: &Tones<'_>, pieces: &[Piece]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let mut kinds: std::collections::BTreeMap<Kind, Vec<usize>> = Default::default();
    for piece in pieces.iter().filter(|p| p.role == Role::Leaf) {
        let group = alone(scene, tones, &piece.component);
        let kind = kinds.entry((group.material, group.triangles.clone())).or_default();
        let alike = |g: &Group| {
            let gap = g.traits.iter().zip(&group.traits).fold(0.0_f32, |gap, (a, b)| gap.max((a - b).abs()));
            let same = g.textured == group.textured && g.unmapped.is_some() == group.unmapped.is_some();
            same.then_some(gap)
        };
        let likest = kind.iter().filter_map(|&i| Some((alike(&groups[i])?, i))).min_by(|a, b| a.0.total_cmp(&b.0));
        match likest {
            Some((gap, i)) if gap <= group.tolerance || kind.len() >= MOST_GROUPS => {
                groups[i].sheets.extend(group.sheets);
            }
            _ => {
                kind.push(groups.len());
                groups.push(group);
            }
        }
    }
    groups
}

/// A group of one sheet.
fn alone(scene: &Scene, tones: &Tones<'_>, c: &Component) -> Group {
    let part = &scene.parts[c.part];
    let material = part.material.and_then(|m| scene.materials.get(m));
    let mut order = c.points.clone();
    let wears = material.is_some_and(|m| m.color_image.is_some()) && !part.uvs.is_empty();
    let uv_of = |i: u32| if wears { part.uvs[i as usize] } else { Vec2::ZERO };
    let worn = |i: u32| (uv_of(i), part.colors.get(i as usize).map_or([1.0; 3], |c| [c[0], c[1], c[2]]));
    // Of each point the corner that wears it first; at a seam others wear it otherwise.
    let mut first: Vec<(u32, u32)> = Vec::with_capacity(c.triangles.len() * 3);
    first.extend(c.triangles.iter().flatten().copied().zip(c.corners.iter().flatten().copied()));
    first.sort_by_key(|(point, _)| *point);
    let seamed = first.chunk_by(|a, b| a.0 == b.0).any(|same| same.iter().any(|s| uv_of(s.1) != uv_of(same[0].1)));
    first.dedup_by_key(|(point, _)| *point);
    let own = |i: u32| first.binary_search_by_key(&i, |f| f.0).map_or(i, |k| first[k].1);
    let uv = |i: u32| uv_of(own(i));
    let at = |i: u32| part.positions[i as usize];
    let points = |order: &[u32]| order.iter().map(|&i| at(i)).collect::<Vec<Vec3>>();
    let textured = wears && !seamed && {
        let uvs: Vec<Vec2> = order.iter().map(|&i| uv(i)).collect();
        Affine::fit(&uvs, &points(&order)).is_some_and(|fit| fit.stray < STRAY)
    };
    if textured {
        // Exporters turn the corners of a quad as they like.
        let key = |i: &u32| (uv(*i) * 512.0 + 0.5).floor().to_array().map(|v| v as i64);
        order.sort_by_key(|i| (key(i)[1], key(i)[0]));
    }
    let mut places: Vec<(u32, u32)> = order.iter().enumerate().map(|(k, &i)| (i, k as u32)).collect();
    places.sort_unstable();
    let find = |i: u32| places.binary_search_by_key(&i, |p| p.0).map_or(0, |k| places[k].1);
    let mut triangles: Vec<[u32; 3]> = c.triangles.iter().map(|t| t.map(find)).collect();
    let mut corners: Vec<[(Vec2, [f32; 3]); 3]> = c.corners.iter().map(|t| t.map(worn)).collect();
    if textured {
        for t in &mut triangles {
            let least = (0..3).min_by_key(|&k| t[k]).unwrap_or(0);
            t.rotate_left(least);
        }
        triangles.sort_unstable();
        if let [a, b] = &mut triangles[..] {
            // A quad may be cut along either diagonal.
            if order.len() == 4 {
                (*a, *b) = ([0, 1, 2], [1, 2, 3]);
            }
        }
        corners = triangles.iter().map(|t| t.map(|k| worn(own(order[k as usize])))).collect();
    }
    let points = points(&order);
    let uvs: Vec<Vec2> = order.iter().map(|&i| uv(i)).collect();
    let mut traits: Vec<f32> = Vec::new();
    if wears {
        traits.extend(uvs.iter().flat_map(|uv| uv.to_array()).map(|v| v * 20.0));
    }
    if !textured {
        let rms = (points.iter().map(|p| p.distance_squared(c.centre)).sum::<f32>() / points.len() as f32).sqrt();
        traits.extend(points.iter().map(|p| p.distance(c.centre) / rms.max(1e-12)));
        let tone = c.corners.iter().take(8).map(|t| tones.of_triangle(part, *t)).sum::<Vec3>();
        traits.extend((tone / c.corners.len().min(8) as f32).to_array());
    }
    let map = if textured { uvs.clone() } else { lay_flat(c, &points) };
    let sheets = vec![Sheet { points, normal: c.normal }];
    let (material, unmapped) = (part.material, tones.unmapped(part));
    Group { material, traits, tolerance: 0.06, triangles, map, textured, corners, unmapped, sheets }
}

/// A sheet's points in its own plane, in its own unit.
fn lay_flat(c: &Component, points: &[Vec3]) -> Vec<Vec2> {
    let x = c.axes[0] - c.normal * c.normal.dot(c.axes[0]);
    let x = x.try_normalize().unwrap_or_else(|| crate::base::Frame::along(c.normal).x);
    let y = c.normal.cross(x);
    points.iter().map(|p| Vec2::new((*p - c.centre).dot(x), (*p - c.centre).dot(y))).collect()
}

/// The affine map that brings a flat map's points nearest to a sheet's.
struct Affine {
    middle: Vec2,
    centre: Vec3,
    x: Vec3,
    y: Vec3,
    /// Root mean square of what is left over, as a share of that of the points about their middle.
    stray: f64,
}

impl Affine {
    /// None where the map is no area.
    fn fit(map: &[Vec2], points: &[Vec3]) -> Option<Self> {
        let n = map.len().max(1) as f64;
        let middle = map.iter().map(|q| q.as_dvec2()).sum::<glam::DVec2>() / n;
        let centre = points.iter().map(|p| p.as_dvec3()).sum::<glam::DVec3>() / n;
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        let (mut px, mut py) = (glam::DVec3::ZERO, glam::DVec3::ZERO);
        for (q, p) in map.iter().zip(points) {
            let (q, p) = (q.as_dvec2() - middle, p.as_dvec3() - centre);
            (xx, xy, yy) = (xx + q.x * q.x, xy + q.x * q.y, yy + q.y * q.y);
            (px, py) = (px + p * q.x, py + p * q.y);
        }
        let det = xx * yy - xy * xy;
        if det.is_nan() || det <= 1e-6 * (xx + yy) * (xx + yy) {
            return None;
        }
        let (x, y) = ((px * yy - py * xy) / det, (py * xx - px * xy) / det);
        let (mut left, mut all) = (0.0, 0.0);
        for (q, p) in map.iter().zip(points) {
            let (q, p) = (q.as_dvec2() - middle, p.as_dvec3() - centre);
            left += (p - x * q.x - y * q.y).length_squared();
            all += p.length_squared();
        }
        let stray = if all > 0.0 { (left / all).sqrt() } else { f64::MAX };
        Some(Self { middle: middle.as_vec2(), centre: centre.as_vec3(), x: x.as_vec3(), y: y.as_vec3(), stray })
    }

    fn vector(&self, v: Vec2) -> Vec3 {
        self.x * v.x + self.y * v.y
    }

    fn point(&self, q: Vec2) -> Vec3 {
        self.centre + self.vector(q - self.middle)
    }
}

/// Where a group's rectangle lies in its map, and which of its sides is the base.
fn window(group: &Group, near: &Near) -> Window {
    let candidates = candidates(group);
    let mut costs = vec![0.0_f32; candidates.len()];
    let step = group.sheets.len().div_ceil(VOTERS).max(1);
    for sheet in group.sheets.iter().step_by(step) {
        let Some(fit) = Affine::fit(&group.map, &sheet.points) else { continue };
        for (cost, (foot, window)) in costs.iter_mut().zip(&candidates) {
            let size = fit.vector(window.up).length().max(1e-12);
            *cost += near.find(fit.point(*foot)).map_or(0.0, |(_, d)| (d / size).min(2.0));
        }
    }
    // A hair for the picture's lower edge.
    let lowest = candidates.iter().map(|(foot, _)| foot.y).fold(f32::MIN, f32::max);
    let voters = group.sheets.len().div_ceil(step) as f32;
    let best = (0..candidates.len()).min_by(|&a, &b| {
        let cost = |i: usize| {
            let lower = group.textured && candidates[i].0.y >= lowest - 1e-4;
            costs[i] - if lower { 0.12 * voters } else { 0.0 }
        };
        cost(a).total_cmp(&cost(b)).then(a.cmp(&b))
    });
    let mut window = best.map_or(Window { base: Vec2::ZERO, up: Vec2::Y, across: Vec2::X }, |best| candidates[best].1);
    // Right-handed with the front of the triangles.
    if let Some((sheet, fit)) = group.sheets.first().and_then(|s| Some((s, Affine::fit(&group.map, &s.points)?)))
        && fit.vector(window.across).cross(fit.vector(window.up)).dot(sheet.normal) < 0.0
    {
        window.across = -window.across;
    }
    window
}

/// Places that may be the stem's end, each with the rectangle that goes with it.
fn candidates(group: &Group) -> Vec<(Vec2, Window)> {
    let map = &group.map;
    if let Some(corners) = quad(group) {
        return (0..4)
            .map(|k| {
                let [a, b, c, d] = [0, 1, 2, 3].map(|i| map[corners[(k + i) % 4] as usize]);
                let (base, tip) = ((a + b) * 0.5, (c + d) * 0.5);
                (base, Window { base, up: tip - base, across: ((b - a) + (c - d)) * 0.5 })
            })
            .collect();
    }
    let boxed = |up: Vec2| {
        let across = up.perp();
        let bounds =
            |axis: Vec2| map.iter().map(|q| q.dot(axis)).fold((f32::MAX, f32::MIN), |(l, h), d| (l.min(d), h.max(d)));
        let ((x0, x1), (y0, y1)) = (bounds(across), bounds(up));
        Window { base: across * ((x0 + x1) * 0.5) + up * y0, up: up * (y1 - y0), across: across * (x1 - x0) }
    };
    if group.textured {
        return [Vec2::NEG_Y, Vec2::Y, Vec2::X, Vec2::NEG_X].map(boxed).map(|window| (window.base, window)).to_vec();
    }
    // An outline: each of its points, looking through the middle of its area.
    let (mut middle, mut area) = (Vec2::ZERO, 1e-20_f32);
    for t in &group.triangles {
        let [a, b, c] = t.map(|i| map[i as usize]);
        let size = (b - a).perp_dot(c - a).abs();
        middle += (a + b + c) * (size / 3.0);
        area += size;
    }
    let middle = middle / area;
    let step = map.len().div_ceil(48).max(1);
    map.iter().step_by(step).filter_map(|&foot| Some((foot, boxed((middle - foot).try_normalize()?)))).collect()
}

/// The corners of a quad in order round it.
fn quad(group: &Group) -> Option<[u32; 4]> {
    let [a, b] = group.triangles[..] else { return None };
    if group.map.len() != 4 {
        return None;
    }
    // The corner of the first triangle that the second lacks lies opposite the second's own.
    let k = (0..3).find(|&k| !b.contains(&a[k]))?;
    let far = b.into_iter().find(|c| !a.contains(c))?;
    let corners = [a[k], a[(k + 1) % 3], far, a[(k + 2) % 3]];
    // Corners that are no convex quad (two triangles with a tip inside) are an outline.
    let at = |i: usize| group.map[corners[i % 4] as usize];
    let turns = (0..4).map(|i| (at(i + 1) - at(i)).perp_dot(at(i + 2) - at(i + 1)));
    let (mut left, mut right) = (0, 0);
    turns.for_each(|turn| if turn > 0.0 { left += 1 } else { right += 1 });
    (left == 4 || right == 4).then_some(corners)
}

/// A sheet's card; none where it has no length or width.
fn place(group: &Group, sheet: &Sheet, window: &Window, slot: u16) -> Option<Card> {
    let fit = Affine::fit(&group.map, &sheet.points)?;
    let (up, across) = (fit.vector(window.up), fit.vector(window.across));
    let facing = across.cross(up).try_normalize()?;
    // A bent sheet faces where its area does.
    let z = if facing.dot(sheet.normal) < 0.0 { -sheet.normal } else { sheet.normal };
    let z = if facing.dot(z) > 0.5 { z } else { facing };
    let y = (up - z * z.dot(up)).try_normalize()?;
    let x = y.cross(z);
    let (mut length, mut width) = (up.dot(y), across.dot(x));
    let mut base = fit.point(window.base);
    // A flat one is now exact. The image of one that is bent spans less or more than the sheet itself.
    let span = |points: &mut dyn Iterator<Item = Vec3>, axis: Vec3| {
        let along = points.map(|p| (p - base).dot(axis));
        along.fold((f32::MAX, f32::MIN), |(low, high), d| (low.min(d), high.max(d)))
    };
    let mut shift = Vec3::ZERO;
    for (axis, side) in [(x, Some(&mut width)), (y, Some(&mut length)), (z, None)] {
        let is = span(&mut sheet.points.iter().copied(), axis);
        let image = span(&mut group.map.iter().map(|q| fit.point(*q)), axis);
        match side {
            Some(side) if image.1 - image.0 > 0.0 => {
                // Of a sheet that wears the map of another the image may span anything.
                let factor = ((is.1 - is.0) / (image.1 - image.0)).min(2.0);
                // The base lies in the middle across, and as far below the lower end as it did.
                let (of_image, of_sheet) = ((image.0 + image.1) * 0.5, (is.0 + is.1) * 0.5);
                shift += axis * (of_sheet - of_image * factor);
                *side *= factor;
            }
            _ => shift += axis * ((is.0 + is.1) * 0.5),
        }
    }
    base += shift;
    (base.is_finite() && length.is_finite() && width > 0.0).then_some(Card {
        base,
        axes: [x, y, x.cross(y)],
        length,
        width,
        slot,
        bend: None,
    })
}

/// For each group its picture's slot, and whether the picture is its own.
fn slots(groups: &[Group], windows: &[Window]) -> Vec<(u16, bool)> {
    let mut order: Vec<usize> = (0..groups.len()).collect();
    order.sort_by_key(|&i| (std::cmp::Reverse(groups[i].sheets.len()), i));
    let mut kept: Vec<usize> = order.into_iter().take(MOST_PICTURES).collect();
    kept.sort_unstable();
    let aspect =
        |i: usize| place(&groups[i], &groups[i].sheets[0], &windows[i], 0).map_or(1.0, |card| card.width / card.length);
    let aspects: Vec<f32> = kept.iter().map(|&i| aspect(i)).collect();
    (0..groups.len())
        .map(|i| match kept.binary_search(&i) {
            Ok(slot) => (slot as u16, true),
            Err(_) => {
                let own = aspect(i);
                let gap = |k: usize| {
                    let other = if groups[kept[k]].material == groups[i].material { 0.0 } else { 10.0 };
                    other + (aspects[k] / own).max(own / aspects[k])
                };
                let best = (0..kept.len()).min_by(|&a, &b| gap(a).total_cmp(&gap(b)).then(a.cmp(&b)));
                (best.unwrap_or(0) as u16, false)
            }
        })
        .collect()
}

/// A group's picture: its first sheet, laid into the window.
fn picture(scene: &Scene, group: &Group, window: &Window, gallery: &mut Gallery<'_>) -> CardPicture {
    let det = window.up.perp_dot(window.across);
    let corner = |i: u32, (uv, color): (Vec2, [f32; 3])| {
        let q = group.map[i as usize] - window.base;
        let (t, s) = (q.perp_dot(window.across) / det, window.up.perp_dot(q) / det);
        CardCorner { at: Vec2::new(s + 0.5, 1.0 - t), uv, color }
    };
    let width = place(group, &group.sheets[0], window, 0).map_or(1.0, |card| card.width / card.length);
    let corners = group.triangles.iter().zip(&group.corners);
    let triangles = corners.map(|(t, own)| [0, 1, 2].map(|k| corner(t[k], own[k]))).collect();
    CardPicture { width, triangles, ..worn(scene, group.material, group.unmapped, gallery) }
}

/// A picture of a material without triangles; `plain` is its colour where nothing says where its pictures lie.
fn worn(scene: &Scene, material: Option<usize>, plain: Option<[f32; 3]>, gallery: &mut Gallery<'_>) -> CardPicture {
    let material = material.and_then(|m| scene.materials.get(m));
    if let Some([red, green, blue]) = plain {
        let through = material.and_then(|m| m.transmission).map(|through| Transmission { image: None, ..through });
        return CardPicture {
            width: 1.0,
            triangles: Vec::new(),
            color: [red, green, blue, 1.0],
            image: None,
            normal: None,
            roughness: None,
            alpha: None,
            transmission: through,
            cutoff: 0.5,
        };
    }
    CardPicture {
        width: 1.0,
        triangles: Vec::new(),
        color: material.map_or([1.0; 4], |m| m.color),
        image: material.and_then(|m| gallery.add(m.color_image)),
        normal: material.and_then(|m| gallery.add(m.normal_image)),
        roughness: material.and_then(|m| gallery.add(m.roughness_image)),
        alpha: material.and_then(|m| gallery.add(m.alpha_image)),
        transmission: material
            .and_then(|m| m.transmission)
            .map(|through| Transmission { image: gallery.add(through.image), ..through }),
        cutoff: match material.map(|m| m.alpha) {
            Some(Alpha::Mask(cutoff)) => cutoff,
            _ => 0.5,
        },
    }
}

/// How much rather this group is the front of a leaf whose back is another.
fn preference(scene: &Scene, group: &Group) -> u32 {
    let material = group.material.and_then(|m| scene.materials.get(m));
    let mut name = material.map_or(String::new(), |m| m.name.to_lowercase());
    if let Some(Image::File(file)) = material.and_then(|m| scene.images.get(m.color_image?)) {
        name.push_str(&file.to_lowercase());
    }
    let has = |words: &[&str]| words.iter().any(|w| name.contains(w));
    1 + u32::from(has(&["upper", "top", "front"])) - u32::from(has(&["lower", "bottom", "back"]))
}

/// Of two cards on top of each other keeps the one preferred, or else the first; how many went.
fn join_backs(cards: &mut Vec<Card>, preferences: &[u32]) -> usize {
    let mut order: Vec<usize> = (0..cards.len()).collect();
    order.sort_by(|&a, &b| cards[a].centre().x.total_cmp(&cards[b].centre().x).then(a.cmp(&b)));
    let mut keep = vec![true; cards.len()];
    for (k, &i) in order.iter().enumerate() {
        let (a, reach) = (cards[i], cards[i].length * 0.02);
        for &j in order[k + 1..].iter().take(64) {
            let b = cards[j];
            if b.centre().x - a.centre().x > reach {
                break;
            }
            let same = |x: f32, y: f32| (x - y).abs() <= 0.03 * x.max(y);
            let sized = (same(a.length, b.length) && same(a.width, b.width))
                || (same(a.length, b.width) && same(a.width, b.length));
            if keep[i]
                && keep[j]
                && sized
                && a.centre().distance(b.centre()) <= reach
                && a.axes[2].dot(b.axes[2]).abs() > 0.995
            {
                let first = preferences[i] > preferences[j] || (preferences[i] == preferences[j] && i < j);
                keep[if first { j } else { i }] = false;
            }
        }
    }
    let before = cards.len();
    let mut kept = keep.iter();
    cards.retain(|_| kept.next() == Some(&true));
    before - cards.len()
}
