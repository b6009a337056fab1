//! Promises of sketching as a whole: on plants of any kind, with drawings of any kind.

mod leader;
mod methods;
mod raised;
mod steps;

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::*;
use crate::base::{Rotation, Seed};
use crate::plant::{Leaf, Plant, PlantBuilder, PlantStats};
use crate::relate::random_plant::{Oddity, random_plant};

fn drawing(body: &str) -> Drawing {
    let text = format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 10 10\">{body}</svg>");
    Drawing::read(text.as_bytes()).unwrap()
}

/// A tree with a ball of leaves, which limbs and twigs bear.
fn ball(leaves_a_twig: u64) -> Plant {
    let mut builder = PlantBuilder::new();
    let up: Vec<Vec3> = (0..=8).map(|i| Vec3::Y * i as f32 * 0.75).collect();
    let stem = builder.stem(Vec3::ZERO, &up, &[0.2, 0.19, 0.18, 0.17, 0.15, 0.12, 0.09, 0.06, 0.03]);
    for i in 0..40_u64 {
        let seed = Seed::new(7).at(i);
        let location = 0.45 + 0.5 * seed.at(1).unit();
        let way = seed.direction() * Vec3::new(1.0, 0.8, 1.0);
        let tip = Vec3::Y * 4.3 + way.normalize() * (1.0 + seed.at(2).unit()) - Vec3::Y * 6.0 * location;
        let limb = builder.branch(stem, location, &[Vec3::ZERO, tip * 0.5, tip], &[0.05, 0.03, 0.01]);
        for k in 0..8 {
            let seed = seed.child("twig").at(k);
            let twig = seed.direction() * 0.4;
            let twig = builder.branch(limb, 0.3 + 0.7 * seed.at(1).unit(), &[Vec3::ZERO, twig], &[0.01, 0.003]);
            for l in 0..leaves_a_twig {
                builder.leaf(Leaf::new(twig, l as f32 / 4.0, Rotation::about(Vec3::X, l as f32), 0.25, 0));
            }
        }
    }
    builder.finish().unwrap()
}

const HEART: &str = "<path d='M5 9L1 5C-1 2 3 -1 5 2.5C7 -1 11 2 9 5Z'/>";
const TRIANGLE: &str = "<path d='M0 10L5 0L10 10Z'/>";
const FRONT: SketchViews = SketchViews { azimuth: 0.0, elevation: 0.0, kind: ViewKind::Front, detail: 0.5 };

fn bound(plant: Arc<Plant>, views: SketchViews) -> Result<Arc<Sketcher>, SketchError> {
    Sketcher::bind(plant, views).map(Arc::new)
}

/// How far the silhouette from an azimuth is the target.
fn likeness(plant: &Plant, azimuth: f32, target: &Region) -> f32 {
    overlap(&crown_silhouette(plant, azimuth, 0.0, 0.03), target)
}

#[test]
fn groups_in_groups_are_read_as_deep_as_any_program_writes_them() {
    let nested = |n: usize| {
        format!("{}<circle cx=\"5\" cy=\"5\" r=\"4\"/>{}", "<g opacity=\"0.9\">".repeat(n), "</g>".repeat(n))
    };
    assert!((drawing(&nested(900)).crown.area() - 50.0).abs() < 1.0);
    let text = format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 10 10\">{}</svg>", nested(20_000));
    let error = Drawing::read(text.as_bytes()).unwrap_err();
    assert!(error.to_string().contains("lie too deep in one another"), "{error}");
    for body in ["<text x=\"1\" y=\"5\">Oak</text>", "<image href=\"oak.png\" width=\"9\" height=\"9\"/>"] {
        let text = format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 10 10\">{body}</svg>");
        assert_eq!(Drawing::read(text.as_bytes()).map(drop), Err(SketchError::Unread), "{body}");
    }
}

#[test]
fn a_ball_takes_the_shape_of_a_heart_and_of_a_triangle_better_than_by_one_cage() {
    let sketcher = bound(Arc::new(ball(4)), FRONT).unwrap();
    for body in [HEART, TRIANGLE] {
        let drawn = drawing(body);
        let adaptive = sketcher.draw(&Sketch::of(&drawn)).unwrap();
        let one = sketcher.draw(&Sketch { method: Method::OneCage, ..Sketch::of(&drawn) }).unwrap();
        let (good, poor) =
            (likeness(&adaptive.at(1.0), 0.0, &adaptive.targets[0]), likeness(&one.at(1.0), 0.0, &one.targets[0]));
        assert!(good > 0.8 && good > poor, "{good} {poor}");
    }
}

#[test]
fn drawing_the_crown_s_own_silhouette_changes_nothing() {
    let plant = ball(4);
    let outline = crown_outline(&plant, 0.0, 0.0);
    let path: Vec<String> =
        outline.iter().map(|p| format!("{} {}", p.x * 100.0 + 500.0, 1000.0 - p.y * 100.0)).collect();
    let drawn = drawing(&format!("<path d='M{}Z'/>", path.join("L")));
    let sketcher = bound(Arc::new(plant.clone()), FRONT).unwrap();
    let made = sketcher.draw(&Sketch::of(&drawn)).unwrap().at(1.0);
    let (was, is) = (plant.pose(), made.pose());
    let far = was.positions().iter().zip(is.positions()).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(far <= 1e-4 * plant.height(), "{far}");
    assert_eq!(plant.leaves().len(), made.leaves().len());
}

#[test]
fn an_open_line_on_one_side_moves_nothing_on_the_other() {
    let plant = ball(4);
    let outline = crown_outline(&plant, 0.0, 0.0);
    let middle = Vec2::Y * 4.3;
    let end = |angle: f32| {
        let (sin, cos) = crate::base::math::sin_cos(angle);
        let away = |p: &Vec2| (*p - middle).normalize().distance(Vec2::new(cos, sin));
        outline.iter().copied().min_by(|a, b| away(a).total_cmp(&away(b))).unwrap() - middle
    };
    let place = |p: Vec2| (p + middle) * 10.0 / plant.height();
    let sketcher = bound(Arc::new(plant.clone()), FRONT).unwrap();
    // What is cut out acts further in than what is added.
    for (out, wide) in [(1.5_f32, 0.6_f32), (-0.4, 0.45)] {
        let [low, high] = [end(-wide), end(wide)];
        let line: Vec<String> = (0..=24)
            .map(|k| {
                let f = k as f32 / 24.0;
                let p = place(low.lerp(high, f) + Vec2::X * (out * crate::base::math::sin(f * std::f32::consts::PI)));
                format!("{} {}", 5.0 + p.x, 10.0 - p.y)
            })
            .collect();
        let drawn = drawing(&format!("<path fill='none' stroke='#000' d='M{}'/>", line.join("L")));
        let sketched = sketcher.draw(&Sketch::of(&drawn)).unwrap().following();
        let (was, is) = &sketched.outlines[0];
        assert!(was.iter().zip(is).all(|(a, b)| a == b || a.x > 1.0));
        for t in [0.5, 1.0] {
            let made = sketched.key(t);
            let [a, b] = [&plant, &made].map(Plant::pose);
            let far = |(a, b): (&Vec3, &Vec3)| if a.x < -0.3 { a.distance(*b) } else { 0.0 };
            let wood = a.positions().iter().zip(b.positions()).map(far).fold(0.0, f32::max);
            let mut reach = [0.0_f32; 2];
            for (was, is) in plant.leaves().iter().zip(made.leaves()) {
                let places = [a.leaf(&plant, was).position, b.leaf(&made, is).position];
                let off = far((&places[0], &places[1]));
                assert!(off < 1e-3 && (places[0].x >= -0.3 || was.size == is.size), "{out} {t}: {off}");
                reach = [0, 1].map(|k| if is.size > 0.1 { reach[k].max(places[k].x) } else { reach[k] });
            }
            assert!(wood < 1e-3, "{out} {t}: {wood}");
            if t == 1.0 && out > 0.0 {
                assert!(reach[1] > reach[0] + 0.5, "{reach:?}");
            }
        }
        let near = likeness(&sketched.at(1.0), 0.0, &sketched.targets[0]);
        assert!(near > if out > 0.0 { 0.88 } else { 0.8 }, "{out}: {near}");
    }
}

#[test]
fn at_the_start_nothing_has_moved_and_on_the_way_all_hangs_together() {
    let plant = ball(3);
    let sketcher = bound(Arc::new(plant.clone()), FRONT).unwrap();
    let drawn = drawing(HEART);
    let sketched = sketcher.draw(&Sketch::of(&drawn)).unwrap();
    assert!(sketched.at(0.0) == plant);
    for step in 1..=8 {
        let made = sketched.at(step as f32 / 8.0);
        assert_eq!(PlantStats::of(&made).topology_continuity, 1.0);
    }
    // Keys have all that there ever is, in one order.
    let keys = [0.0, 0.5, 1.0].map(|t| sketched.key(t));
    assert!(keys.iter().all(|k| k.chains().len() == plant.chains().len() && k.leaves().len() == plant.leaves().len()));
    for [stretch, turn, beyond] in sketched.strains() {
        assert!(stretch <= 2.5 && turn <= 1.6 && beyond <= 0.35, "{stretch} {turn} {beyond}");
    }
}

#[test]
fn in_betweens_that_follow_are_nearer_to_the_interpolated_silhouette() {
    let plant = ball(4);
    let sketcher = bound(Arc::new(plant.clone()), FRONT).unwrap();
    let drawn = drawing(TRIANGLE);
    let straight = sketcher.draw(&Sketch::of(&drawn)).unwrap();
    let following = straight.clone().following();
    assert!(following.at(0.0) == plant && following.at(1.0) == straight.at(1.0));
    let places = |plant: &Plant| resampled(&crown_outline(plant, 0.0, 0.0), 240);
    let (from, to) = (places(&plant), places(&straight.at(1.0)));
    let (mut near, mut far) = (0.0, 0.0);
    for k in 1..8 {
        let t = k as f32 / 8.0;
        let reference: Vec<Vec2> = from.iter().zip(&to).map(|(a, b)| a.lerp(*b, t)).collect();
        let made = following.at(t);
        assert_eq!(PlantStats::of(&made).topology_continuity, 1.0);
        let [a, b] = [&made, &straight.at(t)].map(|plant| discrete_frechet(&places(plant), &reference));
        // At keys the best of the rounds is kept, the straight way among them.
        assert!(a <= b + 1e-4, "{t}: {a} {b}");
        near += a;
        far += b;
    }
    assert!(near < 0.9 * far, "{near} {far}");
}

/// How far the stem is from where a drawing has it, over the tree's height, below a height.
fn off_line(plant: &Plant, x: impl Fn(f32) -> f32, until: f32, across: Vec3) -> f32 {
    let posed = plant.pose();
    let stem = posed.chain(plant, crate::plant::ChainId(0));
    stem.iter().filter(|p| p.y <= until).map(|p| (across.dot(*p) - x(p.y)).abs()).fold(0.0, f32::max) / plant.height()
}

/// As [`ball`], but of a stem that leans and bends by a fifth of its height.
fn bent_ball() -> Plant {
    let plant = ball(3);
    let mut builder = PlantBuilder::new();
    let mut named = Vec::new();
    for id in plant.chain_ids() {
        let chain = *plant.chain(id);
        let points: Vec<Vec3> = plant.points(id).to_vec();
        let (points, radii) = (points, plant.radii(id).to_vec());
        let bent: Vec<Vec3> = match chain.parent {
            None => points.iter().map(|p| *p + Vec3::new(0.04 * p.y * p.y - 0.05 * p.y, 0.0, 0.1 * p.y)).collect(),
            Some(_) => points,
        };
        let parent = chain.parent.map(|p: crate::plant::ChainId| named[p.index()]);
        named.push(builder.chain(parent, chain.location, chain.origin, &bent, &radii));
    }
    for leaf in plant.leaves() {
        builder.leaf(Leaf { chain: named[leaf.chain.index()], ..*leaf });
    }
    builder.finish().unwrap()
}

#[test]
fn a_drawn_trunk_is_where_the_stem_stands_whatever_the_tree_and_the_size() {
    let crown = "<ellipse cx='5' cy='3' rx='3.5' ry='3'/>";
    let straight = drawing(&format!("{crown}<rect id='trunk' x='4.7' y='5' width='0.6' height='5'/>"));
    let line = drawing(&format!("{crown}<line id='trunk' x1='5' y1='10' x2='5' y2='5' stroke='#000'/>"));
    let left = drawing(&format!("{crown}<rect id='trunk' x='2.7' y='5' width='0.6' height='5'/>"));
    for plant in [ball(3), bent_ball()] {
        let tall = plant.height();
        let plant = Arc::new(plant);
        for (azimuth, across) in [(0.0, Vec3::X), (std::f32::consts::FRAC_PI_2, Vec3::NEG_Z)] {
            let sketcher = bound(plant.clone(), SketchViews { azimuth, ..FRONT }).unwrap();
            for size in [SketchSize::Crown, SketchSize::Metres(tall * 3.0), SketchSize::Metres(tall * 0.5)] {
                for drawn in [&straight, &line, &left] {
                    let made = sketcher.draw(&Sketch { size, ..Sketch::of(drawn) }).unwrap().at(1.0);
                    let off = off_line(&made, |_| 0.0, made.height() * 0.45, across);
                    assert!(off < 0.005, "{azimuth} {size:?}: {off}");
                    assert_eq!(PlantStats::of(&made).topology_continuity, 1.0);
                }
            }
            // As wide as the crown was, beside its trunk.
            for drawn in [&straight, &left] {
                let stretched = Sketch { size: SketchSize::Stretched, ..Sketch::of(drawn) };
                let sketched = sketcher.draw(&stretched).unwrap();
                let made = sketched.at(1.0);
                assert!(off_line(&made, |_| 0.0, made.height() * 0.4, across) < 0.005);
                let [was, is] = [&sketcher.charts[0].outline[..], sketched.targets[0].outline()].map(super::fit::ends);
                assert!(((was[1] - was[0]) - (is[1] - is[0])).abs().max_element() < 0.01 * tall);
            }
        }
        // Revolved, it is the axis, and the side's trunk is followed beside the front's.
        let round = SketchViews { kind: ViewKind::RevolvedAboutFoot, ..FRONT };
        let made = bound(plant.clone(), round).unwrap().draw(&Sketch::of(&straight)).unwrap().at(1.0);
        assert!(off_line(&made, |_| 0.0, made.height() * 0.45, Vec3::X) < 0.005);
        assert!(off_line(&made, |_| 0.0, made.height() * 0.45, Vec3::Z) < 0.005);
        let both = SketchViews { kind: ViewKind::FrontAndSide, ..FRONT };
        let leaning = drawing(&format!("{crown}<path id='trunk' d='M2.7 10L4.7 5H5.3L3.3 10Z'/>"));
        let beside = Sketch { side: Some(&leaning), ..Sketch::of(&straight) };
        let made = bound(plant.clone(), both).unwrap().draw(&beside).unwrap().at(1.0);
        assert!(off_line(&made, |_| 0.0, made.height() * 0.45, Vec3::X) < 0.005);
        assert!(off_line(&made, |y| y * 0.4, made.height() * 0.45, Vec3::NEG_Z) < 0.01);
    }
}

#[test]
fn a_stem_leaves_the_ground_as_it_did_whatever_outline_is_drawn_without_a_trunk() {
    let outlines = [
        "<path d='M1 9V1H3V7H9V9Z'/>",
        "<path d='M6 .5A4.6 4.6 0 1 0 6 9.5A5 5 0 0 1 6 .5Z'/>",
        "<circle cx='2' cy='5' r='2'/><circle cx='8' cy='5' r='2'/>",
        "<path d='M1 9H9V1Z'/>",
        "<ellipse cx='5' cy='5' rx='1.4' ry='4.8' transform='rotate(40 5 5)'/>",
    ]
    .map(drawing);
    let foot = |plant: &Plant, shift: &[Vec3]| {
        let stem = plant.span(crate::plant::ChainId(0)).start;
        let at = |i: usize| plant.pose().positions()[i] + shift.get(i).copied().unwrap_or_default();
        at(stem + 1) - at(stem)
    };
    for plant in [ball(3), bent_ball()].map(Arc::new) {
        // What handles alone would do.
        let mut most = 0.0_f32;
        for kind in [ViewKind::Front, ViewKind::FrontAndSide] {
            let sketcher = bound(plant.clone(), SketchViews { kind, ..FRONT }).unwrap();
            for (drawn, side) in outlines.iter().zip(outlines.iter().cycle().skip(3)) {
                let side = Some(side).filter(|_| kind == ViewKind::FrontAndSide);
                let sketched = sketcher.draw(&Sketch { side, ..Sketch::of(drawn) }).unwrap();
                let was = foot(&plant, &[]);
                let turned = crate::base::math::angle(was, foot(&sketched.at(1.0), &[])).to_degrees();
                assert!(turned < 6.0, "{kind:?}: {turned}");
                let guided = super::spine::Guided { standing: false, ..sketched.guided.clone() };
                let free = sketcher.spines.moved(&sketcher.positions, &sketched.told, &guided);
                most = most.max(crate::base::math::angle(was, foot(&plant, &free)).to_degrees());
            }
        }
        assert!(most > 12.0, "{most}");
    }
}

#[test]
fn wood_between_lobes_comes_no_lower_than_the_lowest_of_them() {
    // A wide crown on a narrow foot, in which limbs bend.
    let spade = drawing("<path d='M5 0L9.5 6H5.3V10H4.7V6H.5Z'/>");
    let lowest = |heights: &mut dyn Iterator<Item = f32>| heights.fold(f32::INFINITY, f32::min);
    let mut free = 0.0_f32;
    for seed in 0..40 {
        let plant = Arc::new(random_plant(Seed::new(seed), 60, Oddity::Tame));
        for kind in [ViewKind::Front, ViewKind::Revolved] {
            let Ok(sketcher) = bound(plant.clone(), SketchViews { kind, ..FRONT }) else { continue };
            let Ok(sketched) = sketcher.draw(&Sketch::of(&spade)) else { continue };
            let lobes = lowest(&mut sketcher.handles.iter().zip(&sketched.told).map(|(h, way)| h.position.y + way.y));
            let made = sketched.key(1.0);
            let pose = made.pose();
            for id in plant.chain_ids() {
                // A stem's base is its foot.
                let limb = || pose.chain(&made, id).iter().map(|p| p.y);
                let own = || plant.span(id).map(|i| sketcher.positions[i].y);
                let least = lobes.min(limb().next().unwrap()).min(lowest(&mut own()));
                let found = lowest(&mut limb());
                assert!(found > least - 0.01 * plant.height(), "{seed} {kind:?} {id:?}: {found} below {least}");
                let moved = plant.span(id).map(|i| sketcher.positions[i].y + sketched.shift[i].y);
                free = free.min((lowest(&mut { moved }) - least) / plant.height());
            }
        }
    }
    assert!(free < -0.1, "{free}");
}

#[test]
fn limbs_sag_no_deeper_before_their_first_lobe_than_they_did() {
    let droplet = drawing("<path d='M5 0L8.5 5A4 4 0 0 1 5.4 8V10H4.6V8A4 4 0 0 1 1.5 5Z'/>");
    let mut free = 0.0_f32;
    for seed in 0..20 {
        let plant = Arc::new(random_plant(Seed::new(seed), 60, Oddity::Tame));
        let Ok(sketcher) = bound(plant.clone(), FRONT) else { continue };
        let Ok(sketched) = sketcher.draw(&Sketch::of(&droplet)) else { continue };
        let made = sketched.key(1.0);
        let pose = made.pose();
        for id in plant.chain_ids().filter(|id| plant.chain(*id).parent.is_some()) {
            let Some(first) = sketcher.handles.iter().find(|handle| handle.chain == id) else { continue };
            let span = plant.span(id);
            let were = &sketcher.positions[span.clone()];
            let arcs = super::spine::arcs(were);
            let end = arcs.partition_point(|arc| *arc < first.arc).min(arcs.len() - 1);
            // Below the straight way to the first lobe.
            let deepest = |at: &dyn Fn(usize) -> f32| {
                let below = |i: usize| at(i) - at(0) - (at(end) - at(0)) * (arcs[i] / arcs[end]) as f32;
                (0..end).map(below).fold(0.0, f32::min)
            };
            let was = deepest(&|i| were[i].y) - 0.005 * plant.height();
            let is = deepest(&|i| pose.chain(&made, id)[i].y);
            assert!(is >= was, "{seed} {id:?}: {is} {was}");
            free = free.min((deepest(&|i| were[i].y + sketched.shift[span.start + i].y) - was) / plant.height());
        }
    }
    assert!(free < -0.03, "{free}");
}

#[test]
fn a_tree_that_is_drawn_larger_has_thicker_wood_and_larger_leaves_on_the_way_as_well() {
    let plant = ball(3);
    let drawn = drawing("<ellipse cx='5' cy='3' rx='3.5' ry='3'/><rect id='trunk' x='4' y='5' width='2' height='5'/>");
    let sketcher = bound(Arc::new(plant.clone()), FRONT).unwrap();
    let of = |size| sketcher.draw(&Sketch { size, ..Sketch::of(&drawn) }).unwrap();
    let (thick, leaf) = (|p: &Plant| p.all_radii()[0], |p: &Plant| p.leaves()[0].size);
    for times in [4.0_f32, 0.5] {
        let sketched = of(SketchSize::Metres(plant.height() * times));
        let made = sketched.at(1.0);
        assert!((made.height() / plant.height() - times).abs() < 0.1 * times, "{}", made.height());
        assert!((thick(&made) / thick(&plant) - times).abs() < 1e-3 * times);
        assert!((leaf(&made) / leaf(&plant) - times).abs() < 1e-3 * times);
        let halfway = sketched.at(0.5);
        assert!((thick(&halfway) / thick(&plant) - (1.0 + times) * 0.5).abs() < 1e-3 * times);
        // As full as it is when drawn at its own size.
        let near = |sketched: &Sketched| likeness(&sketched.at(1.0), 0.0, &sketched.targets[0]);
        let (own, other) = (near(&of(SketchSize::Crown)), near(&sketched));
        assert!(other > own - 0.02, "{times}: {own} {other}");
    }
    for size in [SketchSize::Crown, SketchSize::Stretched] {
        let made = of(size).at(1.0);
        assert_eq!((thick(&made), leaf(&made)), (thick(&plant), leaf(&plant)));
    }
}

#[test]
fn depth_is_kept_where_it_is_told_to_be_and_else_grows_with_the_outline() {
    let plant = Arc::new(ball(4));
    let wide = drawing("<rect width='10' height='10'/>");
    let times = |kind: ViewKind, drawn: &Drawing, size: SketchSize| {
        let sketcher = bound(plant.clone(), SketchViews { kind, ..FRONT }).unwrap();
        let sketched = sketcher.draw(&Sketch { size, ..Sketch::of(drawn) }).unwrap();
        if kind == ViewKind::FrontKept {
            assert!(sketched.told.iter().all(|told| told.z == 0.0));
        }
        let deep = |plant: &Plant| {
            let [low, high] = crown_silhouette(plant, std::f32::consts::FRAC_PI_2, 0.0, 0.03).bounds();
            high.x - low.x
        };
        let grown = (sketched.targets[0].area() / sketcher.charts[0].area).sqrt();
        (deep(&sketched.at(1.0)) / deep(&plant), grown)
    };
    let twice = SketchSize::Metres(plant.height());
    for size in [SketchSize::Stretched, twice] {
        let (kept, root) = times(ViewKind::FrontKept, &wide, size);
        let (grown, _) = times(ViewKind::Front, &wide, size);
        assert!(root > 1.05 && grown > 1.0 + 0.6 * (root - 1.0), "{size:?}: {root} {grown}");
        // In metres the tree gets larger as a whole, as deep as it is high.
        let scale = if size == twice { root } else { 1.0 };
        assert!(kept < 1.04 * scale, "{size:?}: {kept} {grown}");
    }
}

#[test]
fn front_and_side_hold_at_once_and_an_outline_can_be_revolved() {
    let plant = Arc::new(ball(4));
    let (heart, triangle) = (drawing(HEART), drawing(TRIANGLE));
    let views = SketchViews { kind: ViewKind::FrontAndSide, ..FRONT };
    let sketcher = bound(plant.clone(), views).unwrap();
    let oval = drawing("<ellipse cx='5' cy='5' rx='3' ry='4.5'/>");
    let both = Sketch { side: Some(&oval), ..Sketch::of(&heart) };
    let sketched = sketcher.draw(&both).unwrap();
    let made = sketched.at(1.0);
    let quarter = std::f32::consts::FRAC_PI_2;
    assert!(likeness(&made, 0.0, &sketched.targets[0]) > 0.75);
    assert!(likeness(&made, quarter, &sketched.targets[1]) > 0.7);
    let sketcher = bound(plant, SketchViews { kind: ViewKind::Revolved, ..FRONT }).unwrap();
    let sketched = sketcher.draw(&Sketch::of(&triangle)).unwrap();
    let made = sketched.at(1.0);
    for k in 0..4 {
        let target = sketched.targets[0].moved(Vec2::ONE, Vec2::ZERO);
        let found = crown_silhouette(&made, k as f32 * 0.8, 0.0, 0.03);
        let [low, high] = found.bounds();
        let centred = found.moved(Vec2::ONE, Vec2::new(-(low.x + high.x) * 0.5, 0.0));
        let like = overlap(&centred, &target);
        // 0.58 of so small a plant; the foot's corners stay open.
        assert!(like > 0.5, "{k} {like}");
    }
}

#[test]
fn any_plant_with_any_drawing_gives_a_sound_plant_or_an_error() {
    let bodies = [
        HEART,
        "<path fill='none' stroke='#000' d='M1 5C1 1 9 1 9 5'/>",
        "<path d='M0 0L10 10V0L0 10Z'/>",
        "<rect width='10' height='0.001'/>",
        "<circle cx='2' cy='2' r='1'/><circle cx='8' cy='8' r='2'/>",
        "<path fill-rule='evenodd' d='M0 0H10V10H0Z M4 4H6V6H4Z'/>",
        "<g id='trunk'><rect x='4' y='6' width='2' height='4'/></g><circle cx='5' cy='3' r='3'/>",
    ];
    let mut plants: Vec<Plant> =
        (0..6).map(|i| random_plant(Seed::new(i), 20, if i < 3 { Oddity::Wild } else { Oddity::Tame })).collect();
    let mut one = PlantBuilder::new();
    one.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 3.0], &[0.1, 0.0]);
    plants.push(one.finish().unwrap());
    let mut flat = PlantBuilder::new();
    flat.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::ZERO], &[0.1, 0.0]);
    plants.push(flat.finish().unwrap());
    for plant in plants {
        let plant = Arc::new(plant);
        for kind in [ViewKind::Front, ViewKind::FrontAndSide, ViewKind::Revolved] {
            let Ok(sketcher) = bound(plant.clone(), SketchViews { kind, ..FRONT }) else { continue };
            for body in bodies {
                let drawn = drawing(body);
                for size in [SketchSize::Crown, SketchSize::Stretched, SketchSize::Metres(30.0)] {
                    let Ok(sketched) = sketcher.draw(&Sketch { side: Some(&drawn), size, ..Sketch::of(&drawn) }) else {
                        continue;
                    };
                    let made = sketched.at(1.0);
                    assert!(PlantBuilder::from_plant(made).finish().is_ok());
                }
            }
        }
    }
}

#[test]
fn the_rim_gives_way_until_leaves_cover_what_is_drawn() {
    // Cages and filling alone come to 0.865 and 0.878.
    let sketcher = bound(Arc::new(ball(4)), FRONT).unwrap();
    for (body, least) in [(HEART, 0.88), ("<ellipse cx='5' cy='5' rx='4' ry='5'/>", 0.91)] {
        let drawn = drawing(body);
        let made = sketcher.draw(&Sketch::of(&drawn)).unwrap();
        let near = likeness(&made.at(1.0), 0.0, &made.targets[0]);
        assert!(near > least, "{near}");
    }
}

#[test]
fn outlines_are_revolved_about_the_stem_below_a_crown_and_else_about_the_crown() {
    let axis = |plant: Plant| {
        let views = SketchViews { kind: ViewKind::Revolved, ..FRONT };
        let sketcher = bound(Arc::new(plant), views).unwrap();
        match sketcher.charts[0].plane {
            super::frame::ViewPlane::Round { axis } => axis.with_y(0.0),
            plane => unreachable!("{plane:?}"),
        }
    };
    // A crown of a metre's reach whose middle is so far from the first stem's foot.
    let leaning = |by: f32, stems: usize| {
        let mut builder = PlantBuilder::new();
        let up = [Vec3::ZERO, Vec3::new(by * 0.5, 3.0, 0.0), Vec3::new(by, 6.0, 0.0)];
        let stem = builder.stem(Vec3::ZERO, &up, &[0.2, 0.15, 0.05]);
        (1..stems).for_each(|_| _ = builder.stem(Vec3::X * by, &[Vec3::ZERO, Vec3::Y], &[0.02, 0.01]));
        for i in 0..24_u64 {
            let twig = builder.branch(stem, 1.0, &[Vec3::ZERO, Seed::new(3).at(i).direction()], &[0.02, 0.01]);
            builder.leaf(Leaf::new(twig, 1.0, Rotation::IDENTITY, 0.1, 0));
        }
        builder.finish().unwrap()
    };
    assert!(axis(leaning(0.3, 1)).length() < 1e-6);
    for (far, stems) in [(3.0, 1), (0.3, 2)] {
        assert!(axis(leaning(far, stems)).length() > 0.5 * far, "{far} {stems}");
    }
}
