//! Kinds of meshes that tools and packs make, each by the least that shows it: what they become.

use glam::{Vec2, Vec3};

use super::tests::{png, trunk};
use super::*;
use crate::base::Seed;
use crate::source::scene::{Alpha, Material};

fn told(scene: &Scene) -> Parts {
    split(scene, &Files::new(), &Overrides::default())
}

fn scene(parts: Vec<Part>, materials: Vec<Material>) -> Scene {
    Scene { parts, materials, ..Scene::default() }
}

fn painted(name: &str, color: [f32; 3]) -> Material {
    Material { name: name.into(), color: [color[0], color[1], color[2], 1.0], ..Material::default() }
}

/// A closed octahedron.
fn ball(centre: Vec3, radius: f32) -> Part {
    let positions = [Vec3::X, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Z, Vec3::Y, Vec3::NEG_Y].map(|p| centre + p * radius);
    let triangles = (0..4).flat_map(|i| [[(i + 1) % 4, i, 4], [i, (i + 1) % 4, 5]]);
    Part { positions: positions.to_vec(), triangles: triangles.collect(), ..Part::default() }
}

/// A closed box.
fn slab(low: Vec3, high: Vec3) -> Part {
    let corner = |i: u32| {
        Vec3::new(
            [low.x, high.x][(i & 1) as usize],
            [low.y, high.y][(i >> 1 & 1) as usize],
            [low.z, high.z][(i >> 2) as usize],
        )
    };
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
    Part { positions: (0..8).map(corner).collect(), triangles: triangles.collect(), ..Part::default() }
}

/// Every triangle with corners of its own.
fn apart(part: &Part, uv: impl Fn(Vec3) -> Vec2) -> Part {
    let mut own = Part { material: Some(0), ..Part::default() };
    for t in &part.triangles {
        let corners = t.map(|i| part.positions[i as usize]);
        let first = own.positions.len() as u32;
        own.positions.extend(corners);
        own.uvs.extend([uv((corners[0] + corners[1] + corners[2]) / 3.0); 3]);
        own.triangles.push([first, first + 1, first + 2]);
    }
    own
}

#[test]
fn at_a_seam_each_triangle_has_the_colour_of_its_own_corners() {
    // One skin: the crown is the uppermost quarter of a tube and wears the green half of a palette.
    let mut skin = trunk(8.0, 0.5);
    for p in skin.positions.iter_mut().filter(|p| p.y > 7.0) {
        (p.x, p.z) = (p.x * 4.0, p.z * 4.0);
    }
    let skin = apart(&skin, |middle| Vec2::new(if middle.y > 6.0 { 0.75 } else { 0.25 }, 0.5));
    let palette = png(8, |x, _| if x < 4 { [110, 80, 50, 255] } else { [40, 140, 30, 255] });
    let material = Material { name: "palette".into(), color_image: Some(0), ..Material::default() };
    let parts = told(&Scene { images: vec![palette], ..scene(vec![skin], vec![material]) });
    assert_eq!((parts.wood.len(), parts.crowns.len()), (48, 1), "{:?}", parts.notes);
    let LeafPicture::Spray { color: [red, green, blue], .. } = parts.art.leaves[0] else { panic!("no spray") };
    assert!(green > red * 4.0 && green > blue * 4.0, "{red} {green} {blue}");
}

#[test]
fn no_leaf_is_larger_than_its_sheet_though_it_wears_the_likest_of_other_shapes() {
    let mut leaves = Part { name: "leaves".into(), ..Part::default() };
    for i in 0..300_u64 {
        let s = Seed::new(6).at(i);
        let (x, y) = (s.child("x").direction(), s.child("y").direction());
        let base = Vec3::Y * (3.0 + 0.01 * i as f32) + Vec3::X * 0.3;
        let slim = if i % 3 == 0 { 0.004 } else { 1.0 };
        let first = leaves.positions.len() as u32;
        leaves.positions.extend([base, base + x * 0.4, base + x * s.child("at").range(0.0, 0.4) + y * (0.3 * slim)]);
        leaves.triangles.push([first, first + 1, first + 2]);
    }
    let parts = told(&scene(vec![trunk(9.0, 0.2), leaves], Vec::new()));
    assert!(parts.cards.len() > 250, "{:?}", parts.notes);
    let longest = parts.cards.iter().map(|card| card.length.max(card.width)).fold(0.0, f32::max);
    assert!(longest < 0.7, "{longest}");
}

#[test]
fn without_colours_balls_on_a_thinner_stem_are_crowns_and_stacked_pieces_of_a_trunk_are_wood() {
    let balls = [3.5_f32, 4.5, 5.2].map(|y| ball(Vec3::new(0.2 * y, y, 0.0), 0.8));
    let stem = Part { name: String::new(), ..trunk(4.0, 0.2) };
    let parts = told(&scene([vec![stem], balls.to_vec()].concat(), Vec::new()));
    assert_eq!((parts.crowns.len(), parts.wood.len()), (3, 64), "{:?}", parts.notes);
    let piece = |k: u32| slab(Vec3::new(-0.5, k as f32, -0.5), Vec3::new(0.5, k as f32 + 1.0, 0.5));
    let parts = told(&scene((0..5).map(piece).collect(), Vec::new()));
    assert_eq!((parts.crowns.len(), parts.wood.len()), (0, 60), "{:?}", parts.notes);
}

#[test]
fn a_slab_under_all_trees_is_ground_though_it_is_green() {
    let green = painted("a", [0.1, 0.4, 0.05]);
    let lawn = Part { material: Some(0), ..slab(Vec3::new(-3.0, -0.3, -3.0), Vec3::new(3.0, 0.0, 3.0)) };
    let crown = Part { material: Some(0), ..ball(Vec3::Y * 4.0, 1.0) };
    let parts = told(&scene(vec![trunk(4.0, 0.2), crown, lawn], vec![green]));
    assert_eq!((parts.cards.len(), parts.crowns.len(), parts.wood.len()), (0, 1, 64), "{:?}", parts.notes);
    assert!(parts.notes.contains(&"1 piece of ground, or of a pot, was dropped".to_owned()), "{:?}", parts.notes);
}

#[test]
fn pictures_of_whole_branches_are_leaves_though_they_are_called_branches() {
    let mut cards = Part { material: Some(0), ..Part::default() };
    for i in 0..6 {
        let frame = crate::base::Frame::along(Seed::new(2).at(i).direction());
        super::tests::quad(&mut cards, Vec3::Y * (3.0 + 0.5 * i as f32), frame, 1.0, 0.8, 0);
    }
    let branch = Material { name: "branch-1".into(), alpha: Alpha::Mask(0.5), ..Material::default() };
    let parts = told(&scene(vec![trunk(9.0, 0.2), cards.clone()], vec![branch.clone()]));
    assert_eq!((parts.cards.len(), parts.wood.len()), (6, 64), "{:?}", parts.notes);
    // The preset has the last word, and an opaque sheet that is called so is wood.
    let opaque = Material { alpha: Alpha::Opaque, ..branch };
    assert_eq!(told(&scene(vec![trunk(9.0, 0.2), cards], vec![opaque])).wood.len(), 76);
}

#[test]
fn a_bent_strip_of_few_triangles_is_a_frond() {
    let mut strip = Part { material: Some(0), ..Part::default() };
    for (x, y) in [(0.0, 4.0), (0.8, 4.2), (1.5, 3.9), (1.9, 3.2)] {
        strip.positions.extend([Vec3::new(x, y, -0.2), Vec3::new(x, y, 0.2)]);
    }
    strip.triangles.extend((0..3).flat_map(|k| [[2 * k, 2 * k + 1, 2 * k + 3], [2 * k, 2 * k + 3, 2 * k + 2]]));
    let parts = told(&scene(vec![trunk(4.0, 0.2), strip], vec![painted("a", [0.1, 0.4, 0.05])]));
    assert!(matches!(parts.cards[..], [Card { bend: Some((arch, _)), .. }] if arch > 0.6), "{:?}", parts.cards);
}

#[test]
fn green_pieces_of_a_tube_are_a_stem() {
    let culm = |from: f32| {
        let mut part = Part { name: String::new(), material: Some(0), ..trunk(1.0, 0.1) };
        part.positions.retain(|p| p.y == 0.0 || p.y == 1.0);
        part.triangles.truncate(16);
        part.positions.iter_mut().for_each(|p| p.y += from);
        part
    };
    let parts = told(&scene((0..4).map(|k| culm(k as f32)).collect(), vec![painted("a", [0.1, 0.4, 0.05])]));
    assert_eq!((parts.wood.len(), parts.crowns.len(), parts.cards.len()), (64, 0, 0), "{:?}", parts.notes);
}

#[test]
fn a_bush_that_is_all_crown_gets_a_stem_inside_and_its_berries_are_dropped() {
    let bush = Part { name: "BushBerries".into(), material: Some(0), ..ball(Vec3::Y, 1.0) };
    let berry = Part { name: "BushBerries".into(), material: Some(1), ..ball(Vec3::new(0.6, 1.2, 0.6), 0.1) };
    let materials = vec![painted("Green", [0.1, 0.4, 0.05]), painted("Berry", [0.5, 0.0, 0.0])];
    let parts = told(&scene(vec![bush, berry], materials));
    assert_eq!(parts.crowns.len(), 1, "{:?}", parts.notes);
    assert!(!parts.wood.is_empty() && parts.wood_positions.iter().all(|p| (p.x.abs() + p.z.abs()) < 0.1 && p.y < 1.6));
    assert!(parts.notes.iter().any(|note| note.starts_with("the mesh has no wood")), "{:?}", parts.notes);
}

#[test]
fn bark_wears_no_picture_that_leaves_share_or_that_is_coloured_otherwise_where_the_wood_lies() {
    let stuffs = |bark: [u8; 4], rest: [u8; 4]| png(32, move |x, _| if x < 14 { bark } else { rest });
    let wood = |material| {
        let part = Part { name: String::new(), material: Some(material), ..trunk(9.0, 0.2) };
        let uvs = (0..part.positions.len()).map(|i| Vec2::new((i % 8) as f32 * 0.06, (i / 8 % 2) as f32)).collect();
        Part { uvs, ..part }
    };
    let material = Material { name: "atlas".into(), color_image: Some(0), ..Material::default() };
    // Islands on black.
    let black = Scene {
        images: vec![stuffs([200, 150, 100, 255], [0, 0, 0, 255])],
        ..scene(vec![wood(0)], vec![material.clone()])
    };
    assert!(told(&black).art.bark.is_some_and(|bark| bark.image.is_none()));
    // Leaves on the other half of a picture that is hardly greener than the bark.
    let mut crown = Part { material: Some(0), ..ball(Vec3::Y * 9.0, 1.5) };
    crown.uvs = vec![Vec2::new(0.8, 0.5); crown.positions.len()];
    let images = vec![stuffs([110, 80, 50, 255], [85, 105, 55, 255])];
    let shared = Scene { images, ..scene(vec![wood(0), crown], vec![material]) };
    let parts = told(&shared);
    assert_eq!(parts.crowns.len(), 1, "{:?}", parts.notes);
    assert!(parts.art.bark.is_some_and(|bark| bark.image.is_none()), "{:?}", parts.notes);
}

/// A closed board that bends down, from the top of a trunk outwards.
fn frond(top: f32, way: f32, thick: f32) -> Part {
    let (sin, cos) = crate::base::math::sin_cos(way);
    let (out, across) = (Vec3::new(cos, 0.0, sin), Vec3::new(-sin, 0.0, cos));
    let mut part = Part { material: Some(1), ..Part::default() };
    for k in 0..9_u32 {
        let t = k as f32 / 8.0;
        let wide = 0.3 + 1.8 * t * (1.0 - t);
        let middle = Vec3::Y * (top + 0.6 * t - 1.4 * t * t) + out * (3.6 * t + 0.15);
        for (side, above) in [(-1.0, -0.5), (1.0, -0.5), (1.0, 0.5), (-1.0, 0.5)] {
            part.positions.push(middle + across * (wide * 0.5 * side) + Vec3::Y * (thick * above));
        }
    }
    for k in 0..8 {
        for s in 0..4 {
            let (a, b) = (k * 4 + s, k * 4 + (s + 1) % 4);
            part.triangles.extend([[a, b, b + 4], [a, b + 4, a + 4]]);
        }
    }
    part.triangles.extend([[0, 2, 1], [0, 3, 2], [32, 33, 34], [32, 34, 35]]);
    part
}

#[test]
fn boards_that_bend_are_fronds_whatever_their_colour_and_bent_poles_are_wood() {
    let materials = || vec![painted("a", [0.2, 0.1, 0.05]), painted("b", [0.28, 0.29, 0.03])];
    let palm = |thick: f32| {
        let mut parts: Vec<Part> = (0..7).map(|k| frond(6.0, 0.9 * k as f32, thick)).collect();
        parts.push(Part { material: Some(0), ..trunk(6.0, 0.25) });
        told(&scene(parts, materials()))
    };
    let parts = palm(0.06);
    assert_eq!((parts.cards.len(), parts.wood.len()), (7, trunk(6.0, 0.25).triangles.len()), "{:?}", parts.notes);
    assert!(parts.cards.iter().all(|card| card.bend.is_some()));
    assert!(palm(0.6).cards.is_empty());
}
