//! Properties of the whole mesher over random plants.

mod bark;
mod ends;

use glam::{Vec2, Vec3};

use super::*;
use crate::base::{Rotation, Seed};
use crate::plant::{ChainId, Leaf, Plant, PlantBuilder};
use crate::preset::plan::{Forks, MeshParams};

/// A random plant: crooked chains of any thickness, some points doubled, some radii zero, and leaves.
fn plant(seed: u64, wild: bool) -> Plant {
    let seed = Seed::new(seed).child("plant");
    let mut builder = PlantBuilder::new();
    for i in 0..14 {
        let s = seed.at(i);
        let count = 2 + s.child("count").index(9);
        let mut points = vec![Vec3::ZERO];
        for k in 1..count as u64 {
            let step = (s.at(k).direction() * 0.6 + Vec3::Y) * s.at(k).child("step").range(0.05, 0.7);
            let still = wild && s.at(k).child("still").unit() < 0.2;
            points.push(points[points.len() - 1] + if still { Vec3::ZERO } else { step });
        }
        let base = if i == 0 { 0.3 } else { s.child("radius").range(0.001, 0.15) };
        let radii: Vec<f32> = (0..count)
            .map(|k| {
                if wild && s.at(k as u64).child("zero").unit() < 0.2 {
                    0.0
                } else {
                    base * (1.0 - k as f32 / count as f32)
                }
            })
            .collect();
        if i == 0 {
            builder.stem(Vec3::ZERO, &points, &radii);
        } else {
            builder.branch(ChainId(s.child("parent").index(i as usize) as u32), s.child("at").unit(), &points, &radii);
        }
        for k in 0..6 {
            let l = s.child("leaf").at(k);
            let orientation = Rotation::about(l.direction(), l.range(0.0, 6.0));
            let size = if wild && k == 0 { 0.0 } else { 0.2 };
            builder.leaf(Leaf::new(ChainId(i as u32), l.unit(), orientation, size, k as u16));
        }
    }
    builder.finish().unwrap()
}

const DETAIL: TubeDetail = TubeDetail::full(&MeshParams { bark_tile: 0.7, roots: 0.7, ..MeshParams::told(12, 0.004) });

#[test]
fn meshes_of_random_plants_are_sound() {
    let mut agree = [(0, 0); 2];
    let mut count = |k: usize, mesh: &Mesh| {
        let (alike, all) = tangents_agree(mesh);
        agree[k] = (agree[k].0 + alike, agree[k].1 + all);
    };
    for seed in 0..60 {
        let plant = plant(seed, seed % 2 == 1);
        let posed = plant.pose();
        for error in [0.0, 0.004, 0.5] {
            let mut bark = tubes(&plant, &posed, &TubeDetail { error, ..DETAIL });
            assert_eq!(problems(&bark), [""; 0], "bark of {seed} at {error}");
            count(0, &bark);
            optimize(&mut bark).unwrap();
            assert_eq!(problems(&bark), [""; 0]);
        }
        let cuts = cuts();
        for shape in SHAPES {
            let cards = Cards { shape, cuts: &cuts };
            let leaf = leaf_cards(&plant, &posed, &all_cards(&plant), cards);
            assert_eq!(problems(&leaf), [""; 0], "leaves of {seed}");
            assert_eq!(leaf.tangents.len(), leaf.positions.len());
            count(1, &leaf);
            let told: usize = plant.leaves().iter().filter(|l| l.size > 0.0).map(|l| cards.triangles(l)).sum();
            assert_eq!(leaf.indices.len() / 3, told, "{shape:?}");
        }
    }
    for (alike, all) in agree {
        assert!(alike * 100 > all * 97, "tangents: {alike} of {all}");
    }
}

#[test]
fn wood_is_counted_as_it_is_meshed_and_coarser_levels_have_fewer_rings() {
    let (mut counted, mut made) = (0, 0);
    for seed in 0..30 {
        let plant = plant(seed, seed % 2 == 1);
        let posed = plant.pose();
        let light = CrownLight::of(&plant, &posed);
        let wood = Wood::of(&plant, &posed, &DETAIL);
        assert_eq!(wood.mesh(&light, &DETAIL), tubes(&plant, &posed, &DETAIL));
        let mut finer = usize::MAX;
        for (error, min_radius, added) in [(DETAIL.error, 0.0, 0.0), (0.05, 0.0, 0.01), (0.2, 0.02, 0.03)] {
            let detail = TubeDetail { error, min_radius, added, ..DETAIL };
            let mesh = wood.mesh(&light, &detail);
            assert_eq!(problems(&mesh), [""; 0], "{seed} at {error}");
            let triangles = mesh.indices.len() / 3;
            assert!(wood.count(&detail) >= triangles && triangles <= finer, "{seed} at {error}");
            (counted, made, finer) = (counted + wood.count(&detail), made + triangles, triangles);
        }
    }
    // Rings that fold are counted and not made.
    assert!(counted * 9 < made * 10 && made > 1000, "{counted} {made}");
}

#[test]
fn stems_that_go_on_below_the_ground_are_as_sound_and_nothing_else_moves() {
    let mut sunk = 0;
    for seed in 0..30 {
        let plant = plant(seed, false);
        let posed = plant.pose();
        let light = CrownLight::of(&plant, &posed);
        let wood = Wood::of(&plant, &posed, &DETAIL);
        for (error, forks) in [(DETAIL.error, Forks::Collar), (0.05, Forks::Plain)] {
            let level = TubeDetail { error, forks, ..DETAIL };
            let below = TubeDetail { below: 0.7, ..level };
            let (before, after) = (wood.mesh(&light, &level), wood.mesh(&light, &below));
            assert_eq!(problems(&after), [""; 0], "{seed}");
            assert_eq!(closure(&after), closure(&before), "{seed}");
            let [off_before, off_after] = [&before, &after].map(|mesh| {
                let (alike, all) = tangents_agree(mesh);
                all - alike
            });
            assert!(off_after <= off_before + 5, "tangents: {off_before} {off_after}");
            let added = after.indices.len() - before.indices.len();
            assert!(wood.count(&below) >= after.indices.len() / 3 && wood.count(&below) > wood.count(&level), "{seed}");
            // What is above is there as it was, and what was added begins where the stem ended.
            let lowest = |mesh: &Mesh| mesh.positions.iter().fold(f32::MAX, |low, p| low.min(p.y));
            let stands: Vec<Vec3> = after.positions.iter().copied().filter(|p| p.y > lowest(&before) - 1e-3).collect();
            let mut all = stands.iter();
            assert!(before.positions.iter().all(|p| all.any(|q| q == p)), "{seed}");
            if added > 0 && lowest(&before).abs() < 1e-3 {
                assert!((lowest(&after) + 0.7).abs() < 1e-3, "{seed}: {}", lowest(&after));
                sunk += 1;
            }
        }
    }
    assert!(sunk > 20, "{sunk}");
}

/// A trunk of four metres with twigs that are bent as quarters of circles, and as many leaves on each.
fn bent_twigs(leaves: u32) -> Plant {
    let mut builder = PlantBuilder::new();
    let trunk = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.2, 0.2]);
    for i in 0..24 {
        let way = Rotation::about(Vec3::Y, i as f32);
        let at = |k: u32| {
            let (sin, cos) = crate::base::math::sin_cos(k as f32 / 16.0 * std::f32::consts::FRAC_PI_2);
            way.rotate(Vec3::new(sin, 1.0 - cos, 0.0))
        };
        let points: Vec<Vec3> = (0..=16).map(at).collect();
        let twig = builder.branch(trunk, 0.3 + 0.02 * i as f32, &points, &[0.012; 17]);
        for k in 0..leaves {
            builder.leaf(Leaf::new(twig, k as f32 / leaves as f32, Rotation::about(Vec3::Y, k as f32), 0.3, 0));
        }
    }
    builder.finish().unwrap()
}

/// Area of bent twigs in square metres, and how far it lies outside of their circles on the mean, metres.
fn twigs(plant: &Plant, error: f32) -> (f32, f32) {
    let (posed, detail) = (plant.pose(), TubeDetail { error: 0.001, sides: 4, ..DETAIL });
    let light = CrownLight::of(plant, &posed);
    let mesh = Wood::of(plant, &posed, &detail).mesh(&light, &TubeDetail { error, ..detail });
    let (mut area, mut outside) = (0.0, 0.0);
    for corners in mesh.indices.as_chunks::<3>().0 {
        let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
        let share = (b - a).cross(c - a).length() * 0.5;
        let chain = mesh.chains[corners[0] as usize];
        if chain > 0 {
            let centre = posed.chain(plant, ChainId(chain))[0] + Vec3::Y;
            (area, outside) = (area + share, outside + share * (((a + b + c) / 3.0).distance(centre) - 1.0));
        }
    }
    (area, outside / area)
}

#[test]
fn coarse_twigs_go_where_fine_ones_do_and_cover_as_much() {
    let plant = bent_twigs(0);
    let (fine, coarse) = (twigs(&plant, 0.001), twigs(&plant, 0.08));
    assert!((coarse.0 / fine.0 - 1.0).abs() < 0.1, "{coarse:?} of {fine:?}");
    // Chords alone lie seven centimetres inside.
    assert!((coarse.1 - fine.1).abs() < 0.045, "{coarse:?} of {fine:?}");
}

#[test]
fn twigs_stray_further_where_leaves_hide_them() {
    let count = |plant: &Plant| Wood::of(plant, &plant.pose(), &DETAIL).count(&TubeDetail { error: 0.01, ..DETAIL });
    let (bare, leafy) = (count(&bent_twigs(0)), count(&bent_twigs(40)));
    assert!(leafy * 5 < bare * 4, "{leafy} {bare}");
}

/// How many vertices have tangents that the triangles' texture coordinates ask for, within 25 degrees (those are means of
/// triangles that lean to other rings), and all.
fn tangents_agree(mesh: &Mesh) -> (usize, usize) {
    let mut asked = mesh.clone();
    add_tangents(&mut asked).unwrap();
    let alike = |(a, b): &(&[f32; 4], &[f32; 4])| a[3] == b[3] && (0..3).map(|k| a[k] * b[k]).sum::<f32>() > 0.9;
    (mesh.tangents.iter().zip(&asked.tangents).filter(alike).count(), mesh.positions.len())
}

const SHAPES: [CardShape; 5] =
    [CardShape::Flat, CardShape::Folded, CardShape::Bent, CardShape::CutOut, CardShape::Trimmed];

/// Outlines for the first four of six pictures: a kite and its halves.
fn cuts() -> Vec<CardCut> {
    let of = |points: &[(f32, f32)]| points.iter().map(|p| Vec2::new(p.0, p.1)).collect::<Vec<_>>();
    let whole = of(&[(0.5, 0.0), (0.9, 0.6), (0.5, 1.0), (0.1, 0.6)]);
    let left = of(&[(0.5, 0.0), (0.5, 1.0), (0.1, 0.6)]);
    let right = of(&[(0.5, 0.0), (0.9, 0.6), (0.5, 1.0)]);
    vec![CardCut::new(&whole, [&left, &right], &whole).unwrap(); 4]
}

/// A plant with one leaf, whose upper face looks up and whose tip points along x.
fn one_leaf(form: crate::plant::LeafForm) -> Plant {
    let mut builder = PlantBuilder::new();
    let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 2.0], &[0.1, 0.05]);
    // The stem's own axes are the world's.
    let orientation = Rotation::from_axes(Vec3::Z, Vec3::X, Vec3::Y);
    builder.leaf(Leaf { form, ..Leaf::new(stem, 1.0, orientation, 0.4, 0) });
    builder.finish().unwrap()
}

#[test]
fn a_bent_card_is_as_long_as_a_flat_one_and_its_tip_hangs() {
    let plant = one_leaf(crate::plant::LeafForm::Square);
    let posed = plant.pose();
    let bent = leaf_cards(&plant, &posed, &all_cards(&plant), CardShape::Bent);
    assert_eq!((bent.indices.len() / 3, bent.positions.len()), (8, 9));
    let middle: Vec<Vec3> = [1, 4, 7].map(|i| bent.positions[i]).to_vec();
    let length = middle[0].distance(middle[1]) + middle[1].distance(middle[2]);
    // Chords of the arc.
    assert!(length < 0.4 && length > 0.39, "{length}");
    assert!(middle[2].y < middle[0].y - 0.12 && middle[1].y > middle[2].y, "{middle:?}");
    assert!(middle[2].x > middle[0].x + 0.25);
    // Normals turn with the arc: towards the tip more of them is along the card.
    let lean = [1, 4, 7].map(|i| bent.normals[i].x);
    assert!(lean[0] < lean[1] && lean[1] < lean[2], "{lean:?}");
    // One that faces down hangs too, and one that hangs already is straight.
    let turned = |face: Vec3, tip: Vec3| {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 2.0], &[0.1, 0.05]);
        builder.leaf(Leaf::new(stem, 1.0, Rotation::from_axes(tip.cross(face), tip, face), 0.4, 0));
        let plant = builder.finish().unwrap();
        let mesh = leaf_cards(&plant, &plant.pose(), &all_cards(&plant), CardShape::Bent);
        mesh.positions[7] - mesh.positions[1]
    };
    assert!(turned(-Vec3::Y, Vec3::X).y < -0.12);
    assert!(turned(Vec3::X, -Vec3::Y).distance(Vec3::Y * -0.4) < 1e-5);
}

#[test]
fn cut_cards_show_what_whole_ones_do_there_and_nothing_else() {
    let cuts = cuts();
    for (form, whole_shape) in
        [(crate::plant::LeafForm::Square, CardShape::Folded), (crate::plant::LeafForm::Flat(1.5), CardShape::Flat)]
    {
        let plant = one_leaf(form);
        let posed = plant.pose();
        let of = |cards: Cards<'_>| leaf_cards(&plant, &posed, &all_cards(&plant), cards);
        let whole = of(whole_shape.into());
        let cut = of(Cards { shape: CardShape::CutOut, cuts: &cuts });
        // Every corner lies on the whole card, where its picture is the same.
        let on_card = |p: Vec3, uv: Vec2| {
            whole.indices.as_chunks::<3>().0.iter().any(|t| {
                let [a, b, c] = t.map(|i| whole.uvs[i as usize]);
                let area = (b - a).perp_dot(c - a);
                let weights = [(b - uv).perp_dot(c - uv), (c - uv).perp_dot(a - uv), (a - uv).perp_dot(b - uv)];
                let weights = weights.map(|w| w / area);
                let place: Vec3 = t.iter().zip(weights).map(|(i, w)| whole.positions[*i as usize] * w).sum();
                weights.iter().all(|w| *w > -1e-4) && place.distance(p) < 1e-4
            })
        };
        assert!(cut.positions.iter().zip(&cut.uvs).all(|(p, uv)| on_card(*p, *uv)));
        let area = |mesh: &Mesh| -> f32 {
            let corner = |i: u32| mesh.positions[i as usize];
            let triangles = mesh.indices.as_chunks::<3>().0.iter();
            triangles.map(|t| (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).length() * 0.5).sum()
        };
        assert!((area(&cut) / area(&whole) - 0.4).abs() < 1e-4, "{}", area(&cut) / area(&whole));
        // A picture without an outline is drawn whole.
        assert_eq!(of(CardShape::CutOut.into()), whole);
    }
}

/// How far the bases of branches stick out, none for those that are closed; see [`fork_gaps`].
fn gaps(plant: &Plant, mesh: &Mesh) -> Vec<Option<f32>> {
    let parents: Vec<Option<u32>> = plant.chains().iter().map(|chain| chain.parent.map(|p| p.0)).collect();
    fork_gaps(mesh, &parents)
}

#[test]
fn tubes_of_random_plants_are_closed_but_for_bases_in_other_wood() {
    // A thousand of them are looked at by `figures lod`.
    let mut capped = 0;
    for seed in 0..100 {
        let plant = plant(seed, false);
        let (posed, forks) = (plant.pose(), if seed % 2 == 0 { Forks::Collar } else { Forks::Plain });
        let full = TubeDetail { forks, ..DETAIL };
        let wood = Wood::of(&plant, &posed, &full);
        for error in [0.004, 0.02, 0.07] {
            let detail = TubeDetail { error, ..full };
            let mesh = wood.mesh(&CrownLight::of(&plant, &posed), &detail);
            let (found, gaps) = (closure(&mesh), gaps(&plant, &mesh));
            let open = 1 + gaps.iter().flatten().count();
            assert_eq!((found.openings, found.faulty_edges, found.inside_out), (open, 0, 0), "{seed} {error}");
            let most = gaps.iter().flatten().fold(0.0_f32, |most, &gap| most.max(gap));
            assert!(most <= if error > 0.004 { error } else { 0.0 }, "{seed} {error}: {most}");
            capped += gaps.len() - open;
            assert!(mesh.indices.len() / 3 <= wood.count(&detail), "{seed} {error}");
        }
    }
    assert!((20..300).contains(&capped), "{capped} of 3900");
}

#[test]
fn a_branch_that_its_bearer_has_no_room_for_is_closed() {
    for (location, radius, is_closed) in [
        (0.5, 0.05, false),
        (0.5, 0.12, false),
        (0.5, 0.3, false),
        (1.0, 0.06, true),
        (0.97, 0.04, false),
        (0.99, 0.09, true),
    ] {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 2.0, Vec3::Y * 4.0], &[0.12, 0.12, 0.1]);
        let out = Vec3::new(1.0, 0.2, 0.0);
        builder.branch(stem, location, &[Vec3::ZERO, out, out * 2.0], &[radius, radius, radius * 0.5]);
        let plant = builder.finish().unwrap();
        let mesh = tubes(&plant, &plant.pose(), &DETAIL);
        let expected = if is_closed { None } else { Some(0.0) };
        assert_eq!(gaps(&plant, &mesh), [None, expected], "{location} {radius}");
        let found = closure(&mesh);
        assert_eq!((found.openings, found.faulty_edges, found.inside_out), (2 - usize::from(is_closed), 0, 0));
        assert_eq!(problems(&mesh), [""; 0]);
    }
}

#[test]
fn plain_forks_cost_less_and_start_in_the_same_wood() {
    let plant = plant(5, false);
    let posed = plant.pose();
    let triangles = |forks| tubes(&plant, &posed, &TubeDetail { forks, ..DETAIL }).indices.len() / 3;
    assert!(triangles(Forks::Plain) < triangles(Forks::Collar));
    assert_eq!(closure(&tubes(&plant, &posed, &TubeDetail { forks: Forks::Plain, ..DETAIL })).faulty_edges, 0);
}

#[test]
fn a_straight_taper_needs_its_two_ends_only_and_stands_where_it_should() {
    let mut builder = PlantBuilder::new();
    let points: Vec<Vec3> = (0..=50).map(|k| Vec3::Y * (k as f32 * 0.1)).collect();
    let stem = builder.stem(Vec3::ZERO, &points, &[0.2; 51]);
    let radii: Vec<f32> = (0..=50).map(|k| 0.05 - 0.001 * k as f32).collect();
    builder.branch(stem, 0.6, &points.iter().map(|p| Vec3::new(p.y, 0.0, 0.0)).collect::<Vec<_>>(), &radii);
    let plant = builder.finish().unwrap();
    let posed = plant.pose();
    let detail = TubeDetail { error: 0.05, ..DETAIL };
    let mesh = tubes(&plant, &posed, &detail);
    assert_eq!(problems(&mesh), [""; 0]);
    assert!(mesh.indices.len() / 3 < 160, "{}", mesh.indices.len() / 3);
    let top = mesh.positions.iter().fold(0.0_f32, |a, p| a.max(p.y));
    assert!(top > 5.0 && top < 5.2, "{top}");
    assert!(mesh.positions.iter().all(|p| p.y > -1e-4));
    let tip = mesh.positions.iter().fold(0.0_f32, |a, p| a.max(p.x));
    assert!((tip - 5.0).abs() < 0.01, "{tip}");
}

#[test]
fn a_branch_starts_inside_its_parents_wood() {
    for (angle, radius) in [(1.57, 0.15), (1.0, 0.19), (0.6, 0.1), (0.3, 0.05), (2.4, 0.02)] {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.2, 0.2]);
        let (sin, cos) = crate::base::math::sin_cos(angle);
        let way = Vec3::new(sin, cos, 0.0);
        builder.branch(stem, 0.5, &[Vec3::ZERO, way, way * 2.0], &[radius, radius * 0.8, 0.01]);
        let plant = builder.finish().unwrap();
        let posed = plant.pose();
        let mesh = tubes(&plant, &posed, &DETAIL);
        // The branch's skin comes second: what of it lies nearer to the trunk's axis than the trunk's surface is hidden.
        let branch =
            mesh.positions.iter().rposition(|p| p.y >= 3.9 && p.x.abs() < 0.25 && p.z.abs() < 0.25).unwrap() + 1;
        let distance = |p: Vec3| Vec3::new(p.x, 0.0, p.z).length();
        let first = mesh.positions[branch..].iter().take(4);
        assert!(first.clone().count() == 4 && first.clone().all(|&p| distance(p) <= 0.2 + 1e-4), "{angle} {radius}");
        assert!(mesh.positions[branch..].iter().any(|&p| distance(p) > 0.5));
    }
}

#[test]
fn tubes_face_outward() {
    let mut builder = PlantBuilder::new();
    builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y, Vec3::Y * 2.0], &[0.3, 0.25, 0.2]);
    let plant = builder.finish().unwrap();
    let mesh = tubes(&plant, &plant.pose(), &TubeDetail { roots: 0.0, ..DETAIL });
    for t in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| mesh.positions[i as usize]);
        let face = (b - a).cross(c - a);
        let middle = (a + b + c) / 3.0;
        assert!(face.dot(middle - Vec3::Y * 1.0) > 0.0);
        assert!(t.iter().all(|&i| mesh.normals[i as usize].dot(face) > 0.0));
    }
}

#[test]
fn a_card_spans_its_picture_from_base_to_tip() {
    let mut builder = PlantBuilder::new();
    let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 2.0], &[0.1, 0.05]);
    builder.leaf(Leaf::new(stem, 0.5, Rotation::IDENTITY, 0.4, 7));
    let plant = builder.finish().unwrap();
    let posed = plant.pose();
    let mesh = leaf_cards(
        &plant,
        &posed,
        &[LeafCard { leaf: 0, scale: 1.5 }, LeafCard { leaf: 9, scale: 1.0 }],
        CardShape::Flat,
    );
    assert_eq!(mesh.positions.len(), 4);
    assert_eq!(mesh.tiles, [7; 4]);
    for (p, uv) in mesh.positions.iter().zip(&mesh.uvs) {
        let expected = Vec3::new((uv.x - 0.5) * 0.6, 1.0 + (1.0 - uv.y) * 0.6, 0.0);
        assert!(p.distance(expected) < 1e-5, "{p} {uv}");
    }
    let none = leaf_cards(&plant, &posed, &[LeafCard { leaf: 0, scale: 0.0 }], CardShape::Folded);
    assert_eq!(none, Mesh::default());
}

#[test]
fn dropping_thin_wood_drops_what_it_bears() {
    let plant = plant(5, false);
    let posed = plant.pose();
    let all = tubes(&plant, &posed, &DETAIL);
    let thick = tubes(&plant, &posed, &TubeDetail { min_radius: 0.08, ..DETAIL });
    let none = tubes(&plant, &posed, &TubeDetail { min_radius: 9.0, ..DETAIL });
    assert!(thick.indices.len() < all.indices.len() && !thick.indices.is_empty());
    assert_eq!(none, Mesh::default());
}

/// A stem with a ball of 400 leaves around 4.8 m.
fn ball(leaf: f32) -> Plant {
    let mut builder = PlantBuilder::new();
    let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 8.0], &[0.1, 0.05]);
    for i in 0..400 {
        let s = Seed::new(1).at(i);
        let p = s.direction() * 3.0;
        let id = builder.branch(stem, 0.6, &[Vec3::ZERO, p], &[0.01, 0.005]);
        builder.leaf(Leaf::new(id, 1.0, Rotation::IDENTITY, leaf, 0));
    }
    builder.finish().unwrap()
}

#[test]
fn the_middle_of_a_crown_is_darker_than_its_rim() {
    let plant = ball(0.6);
    let light = CrownLight::of(&plant, &plant.pose());
    let middle = light.shade(Vec3::Y * 4.8);
    // Dark, but not black: shadows fall on it besides.
    assert!((130..160).contains(&middle) && light.shade(Vec3::Y * 8.0) > 225, "{middle}");
    assert!(light.shade(Vec3::Y * 20.0) == 255);
    assert!(light.outward(Vec3::new(3.0, 4.8, 0.0)).x > 0.95);
}

#[test]
fn leaves_that_hide_nothing_are_lit_from_above_and_darken_nothing() {
    for (leaf, is_full) in [(0.6, true), (0.1, false)] {
        let plant = ball(leaf);
        let posed = plant.pose();
        let light = CrownLight::of(&plant, &posed);
        let below = Vec3::new(0.0, 1.9, 0.0);
        assert!(if is_full { light.outward(below).y < -0.9 } else { light.outward(below).y > 0.9 });
        assert!(is_full == (light.shade(Vec3::Y * 4.8) < 200));
        let cards = leaf_cards(&plant, &posed, &all_cards(&plant), CardShape::Flat);
        let low = cards.positions.iter().zip(&cards.normals).filter(|(p, _)| p.y < 3.8).map(|(_, n)| n.y);
        let (sum, count) = low.fold((0.0, 0), |(sum, count), y| (sum + y, count + 1));
        let mean = sum / count as f32;
        assert!(count > 100 && if is_full { mean < -0.25 } else { mean > 0.15 }, "{leaf}: {mean} of {count}");
    }
}

#[test]
fn broken_meshes_are_told_and_never_reach_the_optimizer() {
    let mut mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        normals: vec![Vec3::Z; 3],
        uvs: vec![Vec2::ZERO; 3],
        occlusion: vec![255; 3],
        indices: vec![0, 1, 2],
        ..Mesh::default()
    };
    assert_eq!(problems(&mesh), [""; 0]);
    // No texture direction at all: a fallback.
    add_tangents(&mut mesh).unwrap();
    assert_eq!(problems(&mesh), [""; 0]);
    let sound = mesh.clone();
    mesh.indices = vec![0, 1, 3];
    assert_eq!(problems(&mesh).len(), 1);
    assert_eq!(optimize(&mut mesh), Err(MeshError::OutOfRange { at: 2, index: 3, vertices: 3 }));
    mesh.indices = vec![0, 1];
    assert_eq!(add_tangents(&mut mesh), Err(MeshError::Ragged(2)));
    assert_eq!(problems(&mesh).len(), 2, "{:?}", problems(&mesh));
    mesh = Mesh { indices: vec![0, 1, 1], normals: vec![Vec3::NAN; 3], ..sound.clone() };
    assert_eq!(problems(&mesh).len(), 4, "{:?}", problems(&mesh));
    mesh = Mesh { uvs: vec![], ..sound };
    assert!(optimize(&mut mesh).is_ok() && !problems(&mesh).is_empty());
}

#[test]
fn tangents_follow_u_and_the_picture_is_not_mirrored() {
    let mut mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        normals: vec![Vec3::Z; 3],
        uvs: vec![Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::new(0.0, 0.0)],
        occlusion: vec![255; 3],
        indices: vec![0, 1, 2],
        ..Mesh::default()
    };
    add_tangents(&mut mesh).unwrap();
    assert_eq!(mesh.tangents, [[1.0, 0.0, 0.0, 1.0]; 3]);
}

#[test]
fn optimizing_keeps_every_triangle() {
    let plant = plant(8, false);
    let mut mesh = tubes(&plant, &plant.pose(), &DETAIL);
    add_tangents(&mut mesh).unwrap();
    let corners = |mesh: &Mesh| {
        let mut triangles: Vec<Vec<[u32; 3]>> = mesh
            .indices
            .chunks_exact(3)
            .map(|t| {
                let mut t: Vec<_> =
                    t.iter().map(|&i| mesh.positions[i as usize].to_array().map(f32::to_bits)).collect();
                t.sort_unstable();
                t
            })
            .collect();
        triangles.sort_unstable();
        triangles
    };
    let before = corners(&mesh);
    optimize(&mut mesh).unwrap();
    assert_eq!(before, corners(&mesh));
}

#[cfg(feature = "lightmap")]
#[test]
fn cards_of_every_shape_can_be_unwrapped() {
    let plant = plant(4, false);
    let posed = plant.pose();
    let cuts = cuts();
    for shape in SHAPES {
        let leaf = leaf_cards(&plant, &posed, &all_cards(&plant), Cards { shape, cuts: &cuts });
        let triangles = leaf.indices.len();
        let mut level = TreeMesh { bark: Mesh::default(), leaf };
        unwrap_lightmap(&mut level, 512).unwrap();
        let inside = |uv: &Vec2| uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all();
        assert_eq!((level.leaf.indices.len(), level.leaf.lightmap.len()), (triangles, level.leaf.positions.len()));
        assert!(level.leaf.lightmap.iter().all(inside), "{shape:?}");
    }
}

#[test]
fn trunks_are_as_round_as_the_error_asks() {
    // A trunk of two metres, a limb and a twig; how far corners and middles of sides are from the circle at mid-height.
    let mut builder = PlantBuilder::new();
    let up: Vec<Vec3> = (0..9).map(|i| Vec3::Y * i as f32 * 2.0).collect();
    let trunk = builder.stem(Vec3::ZERO, &up, &[1.0; 9]);
    for (at, radius) in [(0.5, 0.4), (0.8, 0.04)] {
        let out: Vec<Vec3> = (0..9).map(|i| Vec3::X * i as f32 * 1.5).collect();
        builder.branch(trunk, at, &out, &[radius; 9]);
    }
    let plant = builder.finish().unwrap();
    let posed = plant.pose();
    let strays = |detail: &TubeDetail, chain: u32, radius: f32| {
        let mesh = tubes(&plant, &posed, detail);
        let axis = posed.chain(&plant, ChainId(chain));
        let (foot, way) = (axis[0], (axis[8] - axis[0]).normalize());
        let off = |p: Vec3| (p - foot - way * (p - foot).dot(way)).length();
        let along = |p: Vec3| (p - foot).dot(way) / axis[8].distance(foot);
        let mut worst = 0.0_f32;
        for corners in mesh.indices.as_chunks::<3>().0 {
            if corners.iter().any(|&i| mesh.chains[i as usize] != chain) {
                continue;
            }
            let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
            for p in [a, b, c, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5] {
                if (0.5..0.95).contains(&along(p)) {
                    worst = worst.max((off(p) - radius).abs());
                }
            }
        }
        assert!(worst > 0.0);
        worst
    };
    for error in [0.03, 0.01, 0.004] {
        let detail = TubeDetail { error, most_sides: 64, ..DETAIL };
        for (chain, radius) in [(0, 1.0), (1, 0.4)] {
            let worst = strays(&detail, chain, radius);
            // Once along the tube, where its rings stand, and once around it.
            assert!(worst <= error * 2.0, "{error}: chain {chain} strays by {worst}");
        }
        // A twig may stray further where leaves hide it.
        assert!(strays(&detail, 2, 0.04) <= error * 5.0);
    }
    // Who tells a number gets no more.
    assert!(strays(&TubeDetail { error: 0.004, ..DETAIL }, 0, 1.0) > 0.02);
}

#[test]
fn leaning_stems_stand_on_the_ground_all_round() {
    for lean in [0.0, 0.6, 1.1, 1.3] {
        let (sin, cos) = crate::base::math::sin_cos(lean);
        let way = Vec3::new(sin, cos, 0.0);
        let points: Vec<Vec3> = (0..9).map(|i| way * i as f32 * 0.5).collect();
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::ZERO, &points, &[0.3; 9]);
        let plant = builder.finish().unwrap();
        let mesh = tubes(&plant, &plant.pose(), &DETAIL);
        // Where the skin is open.
        let mut edges = std::collections::BTreeMap::new();
        let at = |i: u32| mesh.positions[i as usize].to_array().map(|x| (x * 1e4).round() as i32);
        for t in mesh.indices.as_chunks::<3>().0 {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                let key = if at(a) < at(b) { (at(a), at(b)) } else { (at(b), at(a)) };
                *edges.entry(key).or_insert(0) += 1;
            }
        }
        let open = edges.iter().filter(|(_, count)| **count == 1).flat_map(|((a, b), _)| [a[1], b[1]]);
        let high = open.max().expect("a foot is open");
        assert!(high <= 1, "{lean}: {high}");
        assert!(problems(&mesh).is_empty(), "{lean}: {:?}", problems(&mesh));
    }
}

#[test]
fn no_triangle_of_a_bent_card_faces_away_from_its_normals() {
    let mut builder = PlantBuilder::new();
    let trunk = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.1, 0.02]);
    for i in 0..300 {
        let seed = Seed::new(3).at(i);
        let turn = Rotation::about(seed.at(0).direction(), seed.at(1).range(0.0, 6.0));
        builder.leaf(Leaf::new(trunk, seed.at(2).range(0.3, 1.0), turn, 0.9, 0));
    }
    let plant = builder.finish().unwrap();
    for cards in [CardShape::Bent, CardShape::Folded, CardShape::Flat] {
        let mesh = leaf_cards(&plant, &plant.pose(), &all_cards(&plant), cards);
        let away = mesh.indices.as_chunks::<3>().0.iter().filter(|t| {
            let [a, b, c] = t.map(|i| i as usize);
            let face = (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
            t.iter().all(|&i| mesh.normals[i as usize].dot(face) < 0.0)
        });
        assert_eq!(away.count(), 0, "{cards:?}");
    }
}
