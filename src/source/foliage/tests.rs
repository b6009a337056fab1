//! Hand-made scenes whose leaves are known to the last figure.

use glam::{Vec2, Vec3};

use super::*;
use crate::base::{Frame, Seed};
use crate::plant::{LeafForm, dump};
use crate::preset::plan::{ImportHeight, UpAxis};
use crate::source::scene::{Alpha, Image, Material, Part, SceneUp};
use crate::source::skeletonize::{Method, SkeletonParams, Skeletonized, Wood, skeletonize};

/// A trunk of eight sides, `height` high.
pub(super) fn trunk(height: f32, radius: f32) -> Part {
    let mut part = Part { name: "trunk".into(), ..Part::default() };
    for k in 0..5_u32 {
        for s in 0..8_u32 {
            let (sin, cos) = crate::base::math::sin_cos(s as f32 * std::f32::consts::TAU / 8.0);
            part.positions.push(Vec3::new(cos * radius, height * k as f32 / 4.0, sin * radius));
        }
    }
    for k in 0..4_u32 {
        for s in 0..8_u32 {
            let (a, b) = (k * 8 + s, k * 8 + (s + 1) % 8);
            part.triangles.extend([[a, b + 8, b], [a, a + 8, b + 8]]);
        }
    }
    part
}

/// Adds a quad with its base at `base`; its texture's lower edge is there.
pub(super) fn quad(part: &mut Part, base: Vec3, frame: Frame, length: f32, width: f32, turn: usize) {
    let corner = |x: f32, y: f32| base + frame.x * (x * width) + frame.y * (y * length);
    let corners = [
        (corner(-0.5, 0.0), Vec2::new(0.0, 1.0)),
        (corner(0.5, 0.0), Vec2::new(1.0, 1.0)),
        (corner(0.5, 1.0), Vec2::new(1.0, 0.0)),
        (corner(-0.5, 1.0), Vec2::new(0.0, 0.0)),
    ];
    let first = part.positions.len() as u32;
    for k in 0..4 {
        let (p, uv) = corners[(k + turn) % 4];
        part.positions.push(p);
        part.uvs.push(uv);
    }
    part.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
}

/// A trunk with `count` leaves off it, and the leaves: base, frame, length and width.
fn leafy(count: u64) -> (Scene, Vec<(Vec3, Frame, f32, f32)>) {
    let mut leaves = Part { name: String::new(), material: Some(0), ..Part::default() };
    let mut truth = Vec::new();
    for i in 0..count {
        let s = Seed::new(8).at(i);
        let out = Vec3::new(s.direction().x, 0.0, s.direction().z).normalize_or(Vec3::X);
        let frame = Frame::along((out + Vec3::Y * s.child("up").range(-0.4, 0.6)).normalize());
        let base = Vec3::Y * (2.0 + 6.0 * (i as f32 + 0.5) / count as f32) + out * 0.25;
        let (length, width) = (s.child("length").range(0.3, 0.6), s.child("width").range(0.15, 0.3));
        quad(&mut leaves, base, frame, length, width, i as usize % 4);
        truth.push((base, frame, length, width));
    }
    let scene = Scene {
        parts: vec![trunk(9.0, 0.2), leaves],
        materials: vec![Material {
            name: "M_1".into(),
            alpha: Alpha::Mask(0.4),
            color_image: Some(0),
            ..Material::default()
        }],
        images: vec![Image::Embedded(b"not looked at here".to_vec())],
        up: SceneUp(UpAxis::Y),
        ..Scene::default()
    };
    (scene, truth)
}

fn plant_of(parts: &Parts) -> Skeletonized {
    let wood = Wood { positions: parts.wood_positions.clone(), triangles: parts.wood.clone() };
    let params =
        SkeletonParams { up: UpAxis::Y, height: ImportHeight::Metres(4.5), method: Method::ByPiece, around: None };
    skeletonize(&wood, &params).unwrap()
}

#[test]
fn quads_become_leaves_with_place_normal_and_size() {
    let (scene, truth) = leafy(40);
    let parts = split(&scene, &Files::new(), &Overrides::default());
    assert_eq!((parts.cards.len(), parts.art.leaves.len(), parts.wood.len()), (40, 1, 64));
    let made = plant_of(&parts);
    let mut notes = Vec::new();
    let plant = attach(made.plant, &parts, &made.placement, &mut notes);
    assert!(notes.is_empty(), "{notes:?}");
    let posed = plant.pose();
    for (leaf, (base, frame, length, width)) in plant.leaves().iter().zip(&truth) {
        let pose = posed.leaf(&plant, leaf);
        let scale = made.placement.scale();
        assert!((scale - 0.5).abs() < 0.01);
        assert!(pose.position.distance(made.placement.point(*base)) < 1e-4);
        assert!(pose.frame.y.dot(frame.y) > 0.9999 && pose.frame.z.dot(frame.z) > 0.9999);
        assert!((leaf.size / (length * scale) - 1.0).abs() < 1e-4);
        let LeafForm::Flat(aspect) = leaf.form else { panic!("a card is flat") };
        assert!((aspect / (width / length) - 1.0).abs() < 1e-4);
    }
    let LeafPicture::Card(card) = &parts.art.leaves[0] else { panic!("a card has a picture of its own") };
    // The texture's lower edge is the card's.
    for corner in card.triangles.iter().flatten() {
        assert!(corner.at.distance(corner.uv) < 1e-5, "{corner:?}");
    }
    assert_eq!((card.cutoff, card.image), (0.4, Some(0)));
}

/// A frond that leaves a trunk's top outwards and bends down by `turn` over its length, its halves leaning down by `fold`.
fn frond(top: f32, length: f32, turn: f32, fold: f32) -> Part {
    let mut part = Part { name: "leaves".into(), material: Some(0), ..Part::default() };
    let radius = length / turn;
    for k in 0..9_u32 {
        let share = k as f32 / 8.0;
        let (sin, cos) = crate::base::math::sin_cos(turn * share);
        let (place, up) = (Vec3::new(radius * sin, top - radius * (1.0 - cos), 0.0), Vec3::new(sin, cos, 0.0));
        let (lean, out) = crate::base::math::sin_cos(fold);
        for side in [-1.0_f32, 0.0, 1.0] {
            let half = length * (0.02 + 0.4 * share * (1.0 - share)) * side.abs();
            part.positions.push(place + Vec3::Z * (side * half * out) - up * (half * lean));
        }
    }
    for k in 0..8_u32 {
        for side in 0..2 {
            let a = k * 3 + side;
            part.triangles.extend([[a, a + 1, a + 4], [a, a + 4, a + 3]]);
        }
    }
    part
}

#[test]
fn a_frond_is_one_card_that_is_bent_and_folded_as_it_is() {
    let scene = Scene {
        parts: vec![trunk(4.0, 0.2), frond(4.0, 2.0, 1.2, 0.3)],
        materials: vec![Material { name: "Leaves".into(), ..Material::default() }],
        up: SceneUp(UpAxis::Y),
        ..Scene::default()
    };
    let parts = split(&scene, &Files::new(), &Overrides::default());
    assert_eq!((parts.cards.len(), parts.art.leaves.len()), (1, 1));
    let made = plant_of(&parts);
    let plant = attach(made.plant, &parts, &made.placement, &mut Vec::new());
    let LeafForm::Frond { arch, fold, .. } = plant.leaves()[0].form else { panic!("{:?}", plant.leaves()) };
    assert!((arch - 1.2).abs() < 0.1 && (fold - 0.3).abs() < 0.05, "{arch} {fold}");
    let pose = plant.pose().leaf(&plant, &plant.leaves()[0]);
    let (scale, leaf) = (made.placement.scale(), &plant.leaves()[0]);
    assert!(pose.position.distance(made.placement.point(Vec3::Y * 4.0)) < 0.03 * scale, "{}", pose.position);
    assert!(pose.frame.y.dot(Vec3::X) > 0.99 && pose.frame.z.dot(Vec3::Y) > 0.99, "{:?}", pose.frame);
    assert!((leaf.size / (2.0 * scale) - 1.0).abs() < 0.02 && (leaf.form.width() - 0.24).abs() < 0.02, "{leaf:?}");
}

/// A disc of twelve sides at a height, facing up.
fn disc(y: f32, radius: f32) -> Part {
    let mut part = Part::default();
    part.positions.push(Vec3::Y * y);
    for k in 0..12_u32 {
        let (sin, cos) = crate::base::math::sin_cos(k as f32 * std::f32::consts::TAU / 12.0);
        part.positions.push(Vec3::new(cos * radius, y, sin * radius));
        part.triangles.push([0, 1 + (k + 1) % 12, 1 + k]);
    }
    part
}

#[test]
fn the_ground_and_the_pot_of_a_tree_are_neither_leaves_nor_wood() {
    let (mut scene, _) = leafy(10);
    let before = split(&scene, &Files::new(), &Overrides::default());
    scene.parts.push(disc(0.0, 3.0));
    let told = split(&scene, &Files::new(), &Overrides::default()).notes;
    assert!(told.contains(&"1 piece of ground, or of a pot, was dropped".to_owned()), "{told:?}");
    scene.parts.push(Part { name: "Terracotta_Pot".into(), ..trunk(0.8, 1.0) });
    let parts = split(&scene, &Files::new(), &Overrides::default());
    assert_eq!((parts.cards.len(), parts.wood.len()), (10, before.wood.len()));
    assert!(parts.notes.iter().any(|n| n.starts_with("2 pieces of ground")), "{:?}", parts.notes);
    // The preset may know better, a sheet up in the tree is a leaf, and what is all called a pot is a plant.
    let wood = Overrides { wood: vec!["terracotta_pot".into()], ..Overrides::default() };
    assert_eq!(split(&scene, &Files::new(), &wood).wood.len(), before.wood.len() * 2);
    scene.parts[2] = disc(5.0, 3.0);
    assert_eq!(split(&scene, &Files::new(), &Overrides::default()).cards.len(), 11);
    let potted = Scene { parts: vec![Part { name: "pot".into(), ..trunk(9.0, 0.2) }], ..Scene::default() };
    assert_eq!(split(&potted, &Files::new(), &Overrides::default()).wood.len(), before.wood.len());
}

#[test]
fn the_same_scene_gives_the_same_plant() {
    let (scene, _) = leafy(12);
    let make = || {
        let parts = split(&scene, &Files::new(), &Overrides::default());
        let made = plant_of(&parts);
        dump(&attach(made.plant, &parts, &made.placement, &mut Vec::new()))
    };
    assert_eq!(make(), make());
}

#[test]
fn backs_of_leaves_join_their_fronts_and_crossed_leaves_stay_two() {
    let (mut scene, _) = leafy(6);
    let mut back = scene.parts[1].clone();
    back.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    scene.parts.push(back);
    let parts = split(&scene, &Files::new(), &Overrides::default());
    assert_eq!(parts.cards.len(), 6);
    assert!(parts.notes.iter().any(|n| n.starts_with("6 leaves' backs were joined")), "{:?}", parts.notes);
    let mut crossed = Part { material: Some(0), ..Part::default() };
    let frame = Frame::along(Vec3::X);
    quad(&mut crossed, Vec3::new(0.3, 5.0, 0.0), frame, 0.5, 0.5, 0);
    let turned = Frame { x: frame.z, y: frame.y, z: -frame.x };
    quad(&mut crossed, Vec3::new(0.3, 5.0, 0.0), turned, 0.5, 0.5, 0);
    scene.parts.truncate(1);
    scene.parts.push(crossed);
    assert_eq!(split(&scene, &Files::new(), &Overrides::default()).cards.len(), 2);
}

#[test]
fn the_preset_has_the_last_word() {
    let (mut scene, _) = leafy(5);
    scene.materials[0].name = "leaf".into();
    let none = Overrides { wood: vec!["LEAF".into()], ..Overrides::default() };
    assert!(split(&scene, &Files::new(), &none).cards.is_empty());
    scene.materials[0].name = "bark".into();
    let all = Overrides { leaves: vec!["Bark".into()], ..Overrides::default() };
    assert_eq!(split(&scene, &Files::new(), &all).cards.len(), 5);
    let wrong = Overrides { leaves: vec!["leef".into()], ..Overrides::default() };
    assert_eq!(unmatched(&scene, &wrong), ["leef"]);
}

#[test]
fn a_closed_green_lump_is_filled_with_branches_and_leaves_and_keeps_its_outline() {
    let centre = Vec3::new(0.0, 9.5, 0.0);
    let mut lump = Part { material: Some(0), ..Part::default() };
    let (rings, sides) = (8_u32, 12_u32);
    for r in 0..=rings {
        let (up, flat) = crate::base::math::sin_cos((r as f32 / rings as f32 - 0.5) * std::f32::consts::PI);
        for s in 0..sides {
            let (sin, cos) = crate::base::math::sin_cos(s as f32 / sides as f32 * std::f32::consts::TAU);
            lump.positions.push(centre + Vec3::new(cos * flat, up, sin * flat) * 2.5);
        }
    }
    for r in 0..rings {
        for s in 0..sides {
            let (a, b) = (r * sides + s, r * sides + (s + 1) % sides);
            lump.triangles.extend([[a, a + sides, b], [b, a + sides, b + sides]]);
        }
    }
    let green = Material { name: "Green".into(), color: [0.1, 0.4, 0.05, 1.0], ..Material::default() };
    let scene = Scene { parts: vec![trunk(8.0, 0.2), lump], materials: vec![green], ..Scene::default() };
    let parts = split(&scene, &Files::new(), &Overrides::default());
    assert_eq!((parts.crowns.len(), parts.cards.len()), (1, 0));
    assert!(matches!(parts.art.leaves[0], LeafPicture::Spray { needles: false, .. }));
    let told = format!("1 closed crown was filled with branches and leaves{MADE_LEAVES}\"beech\" in its colour");
    assert!(parts.notes.iter().any(|note| note.starts_with(&told)), "{:?}", parts.notes);
    let made = plant_of(&parts);
    let bare = made.plant.chains().len();
    let plant = attach(made.plant, &parts, &made.placement, &mut Vec::new());
    assert!(plant.chains().len() > bare + 10 && plant.leaves().len() > 100);
    let (posed, scale) = (plant.pose(), made.placement.scale());
    let centre = made.placement.point(centre);
    let tips: Vec<Vec3> = plant
        .leaves()
        .iter()
        .map(|l| {
            let pose = posed.leaf(&plant, l);
            pose.position + pose.frame.y * l.size
        })
        .collect();
    let radius = 2.5 * scale;
    assert!(tips.iter().all(|t| t.distance(centre) < radius * 1.25));
    // Everywhere about the lump some leaf comes near its surface.
    for i in 0..60 {
        let p = centre + Seed::new(2).at(i).direction() * radius;
        let near = tips.iter().map(|t| t.distance(p)).fold(f32::MAX, f32::min);
        assert!(near < radius * 0.4, "{near} {radius}");
    }
}

#[test]
fn broken_scenes_break_nothing() {
    let (scene, _) = leafy(6);
    for round in 0..60_u64 {
        let s = Seed::new(3).at(round);
        let mut bad = scene.clone();
        for k in 0..6 {
            let s = s.at(k);
            let part = &mut bad.parts[s.child("part").index(2)];
            let i = s.child("at").index(part.positions.len());
            match s.child("what").index(4) {
                0 => part.positions[i] = part.positions[0],
                1 => part.positions[i] *= 1e9,
                2 => part.positions[i] = Vec3::ZERO,
                _ => {
                    let t = s.child("t").index(part.triangles.len());
                    part.triangles[t] = [i as u32; 3];
                }
            }
        }
        let parts = split(&bad, &Files::new(), &Overrides::default());
        let wood = Wood { positions: parts.wood_positions.clone(), triangles: parts.wood.clone() };
        let params =
            SkeletonParams { up: UpAxis::Y, height: ImportHeight::AsIs, method: Method::ByPiece, around: None };
        if let Ok(made) = skeletonize(&wood, &params) {
            let _ = attach(made.plant, &parts, &made.placement, &mut Vec::new());
        }
    }
    let nothing = split(&Scene::default(), &Files::new(), &Overrides::default());
    assert!(nothing.cards.is_empty() && nothing.wood.is_empty());
}

#[test]
fn wood_that_wears_a_corner_of_the_leaves_picture_is_wood() {
    let mut picture = image::RgbaImage::new(2, 1);
    picture.put_pixel(0, 0, image::Rgba([110, 80, 50, 255]));
    picture.put_pixel(1, 0, image::Rgba([40, 140, 30, 200]));
    let mut png = Vec::new();
    picture.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
    let mut part = Part { name: "mesh".into(), material: Some(0), ..trunk(9.0, 0.2) };
    part.uvs = vec![Vec2::new(0.25, 0.5); part.positions.len()];
    let wood = part.triangles.len();
    for i in 0..40_u64 {
        let way = Seed::new(5).at(i).direction();
        let base = Vec3::Y * (3.0 + 0.15 * i as f32) + Vec3::new(way.x, 0.0, way.z).normalize_or(Vec3::X) * 0.4;
        quad(&mut part, base, Frame::along(way), 0.5, 0.3, 0);
    }
    for uv in &mut part.uvs[40..] {
        uv.x = 0.5 + uv.x * 0.5;
    }
    let material =
        Material { name: "atlas".into(), alpha: Alpha::Mask(0.5), color_image: Some(0), ..Material::default() };
    part.faces = (0..part.triangles.len() as u32).collect();
    let scene =
        Scene { parts: vec![part], materials: vec![material], images: vec![Image::Embedded(png)], ..Scene::default() };
    let parts = split(&scene, &Files::new(), &Overrides::default());
    assert_eq!((parts.wood.len(), parts.cards.len()), (wood, 40), "{:?}", parts.notes);
}

#[test]
fn the_card_of_a_bent_leaf_faces_as_its_area_does_and_spans_it() {
    let mut leaves = Part { material: Some(0), ..Part::default() };
    let (mut y, mut z) = (3.0_f32, 0.3_f32);
    for k in 0..=4_u16 {
        for side in [-0.1_f32, 0.1] {
            leaves.positions.push(Vec3::new(side, y, z));
            leaves.uvs.push(Vec2::new(0.5 + side * 4.0, 1.0 - f32::from(k) / 4.0));
        }
        let (sin, cos) = crate::base::math::sin_cos(f32::from(k) * 0.3);
        (y, z) = (y + cos * 0.15, z + sin * 0.15);
    }
    for k in 0..4_u32 {
        leaves.triangles.extend([[2 * k, 2 * k + 1, 2 * k + 3], [2 * k, 2 * k + 3, 2 * k + 2]]);
    }
    leaves.faces = (0..8).collect();
    let area: Vec3 = leaves
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| leaves.positions[i as usize]);
            (b - a).cross(c - a)
        })
        .sum();
    let points = leaves.positions.clone();
    let (mut scene, _) = leafy(0);
    scene.parts[1] = leaves;
    let parts = split(&scene, &Files::new(), &Overrides::default());
    let [card] = parts.cards[..] else { panic!("{} cards", parts.cards.len()) };
    assert!(card.axes[2].dot(area.normalize()).abs() > 0.9999);
    for (axis, from, size) in [(1, 0.0, card.length), (0, -card.width * 0.5, card.width)] {
        let along = points.iter().map(|p| (*p - card.base).dot(card.axes[axis]));
        let (low, high) = along.fold((f32::MAX, f32::MIN), |(l, h), d| (l.min(d), h.max(d)));
        assert!((low - from).abs() < 1e-4 && (high - low - size).abs() < 1e-4, "{axis} {low} {high} {size}");
    }
}

/// A PNG of so many texels an edge.
pub(super) fn png(edge: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Image {
    let picture = image::RgbaImage::from_fn(edge, edge, |x, y| image::Rgba(texel(x, y)));
    let mut bytes = Vec::new();
    picture.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
    Image::Embedded(bytes)
}

/// Bark: brown, lighter and darker from texel to texel.
fn brown(x: u32, y: u32) -> [u8; 4] {
    let shade = (x * 7 + y * 13) as u8 % 40;
    [110 + shade, 80 + shade, 50 + shade, 255]
}

/// A trunk that wears a picture: once around, and along each piece of it from one `v` to another and back.
fn barked(picture: Image, v: [f32; 2], alpha: Alpha) -> Parts {
    let mut part = Part { material: Some(0), ..trunk(9.0, 0.2) };
    part.uvs = (0..part.positions.len()).map(|i| Vec2::new((i % 8) as f32 / 7.0, v[i / 8 % 2])).collect();
    let material = Material { name: "bark".into(), alpha, color_image: Some(0), ..Material::default() };
    let scene = Scene { parts: vec![part], materials: vec![material], images: vec![picture], ..Scene::default() };
    split(&scene, &Files::new(), &Overrides::default())
}

#[test]
fn bark_is_worn_by_a_strip_of_its_picture_and_where_it_is_not_a_note_says_why() {
    let worn = |parts: &Parts| parts.art.bark.as_ref().unwrap().image.is_some();
    let told = |parts: &Parts| parts.notes.iter().filter(|note| note.starts_with(NO_BARK)).cloned().collect::<String>();
    for v in [[0.0, 1.0], [0.9, 1.0], [0.45, 0.3]] {
        let parts = barked(png(32, brown), v, Alpha::Opaque);
        assert!(worn(&parts) && told(&parts).is_empty(), "{v:?} {:?}", parts.notes);
    }
    // A strip of a sheet of several stuffs is no bark.
    let stuffs = |x, y| if y < 16 { [40, 140, 30, 255] } else { brown(x, y) };
    let parts = barked(png(32, stuffs), [0.9, 1.0], Alpha::Opaque);
    assert!(!worn(&parts) && told(&parts).contains("the rest shows something else"), "{:?}", parts.notes);
    let parts = barked(png(32, brown), [0.0, 1.0], Alpha::Mask(0.5));
    assert!(!worn(&parts) && told(&parts).contains("see-through"), "{:?}", parts.notes);
    // Wood that wears one texel of a palette has that colour, as its maker meant it.
    let mut part = Part { material: Some(0), ..trunk(9.0, 0.2) };
    part.uvs = vec![Vec2::splat(0.9); part.positions.len()];
    let material = Material { name: "palette".into(), color_image: Some(0), ..Material::default() };
    let scene =
        Scene { parts: vec![part], materials: vec![material], images: vec![png(32, stuffs)], ..Scene::default() };
    let parts = split(&scene, &Files::new(), &Overrides::default());
    assert!(!worn(&parts) && told(&parts).is_empty(), "{:?}", parts.notes);
}

#[test]
fn of_several_barks_of_one_tree_a_note_names_the_one_that_is_worn() {
    let barked = |k: u32| {
        let part = Part { material: Some(k as usize), ..trunk(9.0 - k as f32, 0.2) };
        let uvs = (0..part.positions.len()).map(|i| Vec2::new((i % 8) as f32 / 7.0, (i / 8 % 2) as f32)).collect();
        Part { uvs, ..part }
    };
    let material = |k: usize| Material { name: format!("bark_{k}"), color_image: Some(k), ..Material::default() };
    let scene = Scene {
        parts: vec![barked(0), barked(1)],
        materials: vec![material(0), material(1)],
        images: vec![png(8, brown), png(8, |x, y| brown(y, x))],
        ..Scene::default()
    };
    let notes = split(&scene, &Files::new(), &Overrides::default()).notes;
    assert!(notes.iter().any(|n| n.starts_with("the wood has 2 barks") && n.contains("\"bark_0\"")), "{notes:?}");
}

#[test]
fn a_picture_without_coordinates_gives_its_mean_colour_and_made_leaves_and_a_note() {
    let (mut scene, _) = leafy(10);
    // Two texels of bark, and a leaf on half of a picture that is black elsewhere.
    scene.images =
        vec![png(8, |x, _| if x < 4 { [60, 140, 30, 255] } else { [0, 0, 0, 0] }), png(8, |_, _| [110, 80, 50, 255])];
    scene.materials.push(Material { name: "bark".into(), color_image: Some(1), ..Material::default() });
    scene.parts[0].material = Some(1);
    scene.parts[1].uvs.clear();
    let parts = split(&scene, &Files::new(), &Overrides::default());
    let linear = |c: [u8; 3]| c.map(|c| crate::base::math::srgb_to_linear(f32::from(c) / 255.0));
    let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3);
    assert_eq!((parts.cards.len(), parts.art.leaves.len()), (10, 1));
    let LeafPicture::Spray { color, needles: false } = parts.art.leaves[0] else { panic!("{:?}", parts.art.leaves) };
    assert!(near(color, linear([60, 140, 30])), "{color:?}");
    let bark = parts.art.bark.as_ref().unwrap();
    assert!(bark.image.is_none() && near(bark.color, linear([110, 80, 50])), "{bark:?}");
    let told = |what: &str| assert!(parts.notes.iter().any(|n| n.contains(what)), "{what}: {:?}", parts.notes);
    told("10 leaves have a picture and no texture coordinates (UVs): they are made in its mean colour");
    told("the wood has no texture coordinates (UVs); a plain bark is made in its mean colour (material \"bark\")");
    // A leaf whose outline is modelled keeps it.
    scene.parts[1] = Part { uvs: Vec::new(), ..frond(5.0, 0.5, 0.5, 0.1) };
    let art = split(&scene, &Files::new(), &Overrides::default()).art;
    let LeafPicture::Card(card) = &art.leaves[0] else { panic!("{:?}", art.leaves) };
    assert!(card.image.is_none() && card.triangles.len() == 32);
    assert!(near([card.color[0], card.color[1], card.color[2]], linear([60, 140, 30])), "{:?}", card.color);
}

#[test]
fn fronds_with_a_thickness_and_such_whose_halves_face_each_other_are_no_closed_crowns() {
    let made = |part: Part| {
        let materials = vec![Material { name: "leaves".into(), ..Material::default() }];
        let scene = Scene { parts: vec![trunk(4.0, 0.2), part], materials, ..Scene::default() };
        let parts = split(&scene, &Files::new(), &Overrides::default());
        (parts.crowns.len(), parts.cards.iter().filter(|card| card.bend.is_some()).count())
    };
    let open = frond(4.0, 2.0, 2.0, 0.3);
    assert_eq!(made(open.clone()), (0, 1));
    // Below it, from rim to rim, a second sheet.
    let mut closed = open.clone();
    let count = open.positions.len() as u32;
    let is_inner = |i: usize| i % 3 == 1 && (1..8).contains(&(i / 3));
    closed.positions.extend(open.positions.iter().enumerate().map(|(i, p)| if is_inner(i) { *p * 0.99 } else { *p }));
    closed.triangles.extend(open.triangles.iter().map(|[a, b, c]| [a + count, c + count, b + count]));
    assert_eq!(made(closed), (0, 1));
    let mut turned = open;
    turned.triangles.iter_mut().skip(2).step_by(4).for_each(|t| t.swap(0, 1));
    turned.triangles.iter_mut().skip(3).step_by(4).for_each(|t| t.swap(0, 1));
    assert_eq!(made(turned), (0, 1));
}
