//! Promises of sketches that are drawn from above (2018, 5.1: "from a certain viewpoint").

use super::*;
use crate::base::math;

const UP: f32 = std::f32::consts::FRAC_PI_2;
const ELLIPSE: &str = "<ellipse cx='5' cy='5' rx='4.5' ry='2.6'/>";

fn raised(elevation: f32) -> SketchViews {
    SketchViews { elevation, ..FRONT }
}

fn from(plant: &Plant, elevation: f32, target: &Region) -> f32 {
    overlap(&crown_silhouette(plant, 0.0, elevation, 0.03), target)
}

/// Lowest and highest of the leaves' bases, and of all points.
fn heights(plant: &Plant) -> [f32; 4] {
    let posed = plant.pose();
    let ends = |all: &mut dyn Iterator<Item = f32>| {
        all.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)))
    };
    let (a, b) = ends(&mut plant.leaves().iter().map(|leaf| posed.leaf(plant, leaf).position.y));
    let (c, d) = ends(&mut posed.positions().iter().map(|p| p.y));
    [a, b, c, d]
}

#[test]
fn a_plan_becomes_the_ellipse_that_is_drawn_and_heights_stay() {
    let plant = ball(4);
    let sketcher = bound(Arc::new(plant.clone()), raised(UP)).unwrap();
    let drawn = drawing(ELLIPSE);
    let sketched = sketcher.draw(&Sketch::of(&drawn)).unwrap();
    let made = sketched.at(1.0);
    let target = &sketched.targets[0];
    // About the crown's middle, as large as it is.
    let [low, high] = target.bounds();
    let [was_low, was_high] = super::super::fit::ends(&sketcher.charts[0].outline);
    assert!((low + high - was_low - was_high).length() < 1e-3);
    assert!((target.area() / sketcher.charts[0].area - 1.0).abs() < 1e-3);
    let (before, after) = (from(&plant, UP, target), from(&made, UP, target));
    assert!(after > 0.85 && after > before + 0.1, "{before} {after}");
    for (was, is) in heights(&plant).into_iter().zip(heights(&made)) {
        assert!((was - is).abs() < 0.06 * plant.height(), "{was} {is}");
    }
    // From the front it is as wide as the plan, and as high as before.
    let [low, high] = crown_silhouette(&made, 0.0, 0.0, 0.03).bounds();
    assert!(((high.x - low.x) / (target.bounds()[1].x - target.bounds()[0].x) - 1.0).abs() < 0.1);
    assert_eq!(made.chain(crate::plant::ChainId(0)).origin, plant.chain(crate::plant::ChainId(0)).origin);
    assert_eq!(PlantStats::of(&made).topology_continuity, 1.0);
}

#[test]
fn the_crown_s_own_silhouette_from_any_direction_changes_nothing() {
    let plant = ball(4);
    for (azimuth, elevation) in [(0.0, UP), (0.7, 0.5), (4.0, -0.3)] {
        let outline = crown_outline(&plant, azimuth, elevation);
        let path: Vec<String> = outline.iter().map(|p| format!("{} {}", p.x * 100.0, -p.y * 100.0)).collect();
        let drawn = drawing(&format!("<path d='M{}Z'/>", path.join("L")));
        let sketcher = bound(Arc::new(plant.clone()), SketchViews { azimuth, elevation, ..FRONT }).unwrap();
        let made = sketcher.draw(&Sketch::of(&drawn)).unwrap().at(1.0);
        let (was, is) = (plant.pose(), made.pose());
        let far = was.positions().iter().zip(is.positions()).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!(far <= 1e-4 * plant.height(), "{azimuth} {elevation}: {far}");
    }
}

#[test]
fn views_that_are_hardly_raised_give_what_level_ones_do() {
    let plant = Arc::new(ball(3));
    for (body, size) in [
        (HEART, SketchSize::Crown),
        (TRIANGLE, SketchSize::Metres(6.0)),
        (ELLIPSE, SketchSize::Stretched),
        ("<path fill='none' stroke='#000' d='M6 3.5C9 4 9 1 6 1'/>", SketchSize::Crown),
    ] {
        let drawn = drawing(body);
        let told = |elevation: f32| {
            let sketcher = bound(plant.clone(), raised(elevation)).unwrap();
            sketcher.draw(&Sketch { size, method: Method::Baseline, ..Sketch::of(&drawn) }).unwrap().told
        };
        let (level, nearly) = (told(0.0), told(0.002));
        let off = level.iter().zip(&nearly).map(|(a, b)| a.distance(*b)).sum::<f32>() / level.len() as f32;
        assert!(off < 0.02 * plant.height(), "{body}: {off}");
    }
}

#[test]
fn an_open_line_from_above_acts_where_it_is_drawn_and_nowhere_else() {
    let plant = ball(4);
    let elevation = 0.52;
    let outline = crown_outline(&plant, 0.0, elevation);
    let foot = Vec2::ZERO;
    let [_, high] = super::super::fit::ends(&outline);
    let right = outline.iter().copied().max_by(|a, b| a.x.total_cmp(&b.x)).unwrap();
    // A bump to the right, placed in metres by a mark at the foot.
    let line: Vec<String> = (0..=24)
        .map(|k| {
            let f = k as f32 / 24.0;
            let p = right + Vec2::new(1.2 * math::sin(f * std::f32::consts::PI) - 0.1, f * 1.6 - 0.8);
            format!("{} {}", 5.0 + p.x - foot.x, 10.0 - p.y)
        })
        .collect();
    let drawn = drawing(&format!(
        "<path fill='none' stroke='#000' stroke-width='0.01' d='M{}'/><circle id='foot' cx='5' cy='10' r='0.1'/>",
        line.join("L")
    ));
    let sketcher = bound(Arc::new(plant.clone()), raised(elevation)).unwrap();
    let sketched = sketcher.draw(&Sketch { size: SketchSize::Metres(10.0), ..Sketch::of(&drawn) }).unwrap();
    let made = sketched.at(1.0);
    // It is seen where it was drawn.
    let [_, target] = sketched.targets[0].bounds();
    assert!((target.x - right.x - 1.1).abs() < 0.05 && (target.y - high.y).abs() < 0.05, "{target} {high}");
    let after = from(&made, elevation, &sketched.targets[0]);
    assert!(after > 0.88 && after > from(&plant, elevation, &sketched.targets[0]), "{after}");
    let reach = |plant: &Plant| crown_silhouette(plant, 0.0, elevation, 0.03).bounds()[1].x;
    assert!(reach(&made) > reach(&plant) + 0.4, "{} {}", reach(&plant), reach(&made));
    // The other side stays, but for what the stem goes along; nothing gets thicker.
    let plane = sketcher.charts[0].plane;
    let (was, is) = (plant.pose(), made.pose());
    let mut moved = [0.0_f32; 2];
    for (a, b) in plant.leaves().iter().zip(made.leaves()) {
        let (a, b) = (was.leaf(&plant, a).position, is.leaf(&made, b).position);
        let side = usize::from(plane.seen(a).x > -0.6);
        moved[side] = moved[side].max(a.distance(b));
    }
    assert!(moved[0] < 0.05 && moved[1] > 0.5, "{moved:?}");
    assert_eq!(plant.all_radii(), made.all_radii());
}

#[test]
fn nothing_comes_below_the_ground_from_above() {
    // A bush: its crown begins at the ground.
    let plant = ball(3);
    let mut builder = PlantBuilder::new();
    let mut named = Vec::new();
    for id in plant.chain_ids() {
        let chain = *plant.chain(id);
        let (points, radii) = (plant.points(id).to_vec(), plant.radii(id).to_vec());
        let short = |p: &Vec3| if chain.parent.is_none() { *p * 0.45 } else { *p };
        let points: Vec<Vec3> = points.iter().map(short).collect();
        let parent = chain.parent.map(|p: crate::plant::ChainId| named[p.index()]);
        named.push(builder.chain(parent, chain.location, chain.origin, &points, &radii));
    }
    for leaf in plant.leaves() {
        builder.leaf(Leaf { chain: named[leaf.chain.index()], ..*leaf });
    }
    let bush = Arc::new(builder.finish().unwrap());
    let lowest = heights(&bush)[2].min(0.0);
    for body in [HEART, TRIANGLE, ELLIPSE, "<rect width='1' height='9'/>", "<path d='M0 9H9V8H1V1H0Z'/>"] {
        let drawn = drawing(body);
        for elevation in [0.1, 0.6, 1.2, UP, -0.6] {
            let sketcher = bound(bush.clone(), raised(elevation)).unwrap();
            for size in [SketchSize::Crown, SketchSize::Stretched, SketchSize::Metres(6.0)] {
                let sketched = sketcher.draw(&Sketch { size, ..Sketch::of(&drawn) }).unwrap();
                // Lobes are told to stay about above it, and not only cut off there: the rounds at the rim add a little.
                let sunk = |(handle, told): (&super::super::spine::Handle, &Vec3)| {
                    handle.position.y.min(0.0) - (handle.position + *told).y
                };
                let deepest = sketcher.handles.iter().zip(&sketched.told).map(sunk).fold(0.0, f32::max);
                assert!(deepest < 0.4, "{body} {elevation} {size:?}: {deepest}");
                for t in [0.5, 1.0] {
                    let made = sketched.at(t);
                    assert!(heights(&made)[2] >= lowest - 1e-3, "{body} {elevation} {size:?}: {:?}", heights(&made));
                    assert!(PlantBuilder::from_plant(made).finish().is_ok());
                }
            }
        }
    }
}

#[test]
fn what_stands_upright_needs_a_level_view() {
    let plant = Arc::new(ball(2));
    for kind in [ViewKind::FrontAndSide, ViewKind::Revolved, ViewKind::RevolvedAboutFoot] {
        let views = SketchViews { kind, ..raised(0.2) };
        assert!(matches!(bound(plant.clone(), views), Err(SketchError::Raised { .. })), "{kind:?}");
    }
    let drawn = drawing("<circle cx='5' cy='3' r='3'/><rect id='trunk' x='4' y='5' width='2' height='5'/>");
    let sketcher = bound(plant.clone(), raised(0.2)).unwrap();
    assert_eq!(sketcher.draw(&Sketch::of(&drawn)).unwrap_err(), SketchError::Raised { what: "a trunk" });
    // Angles that are none are level.
    assert!(bound(plant.clone(), raised(f32::NAN)).unwrap().draw(&Sketch::of(&drawn)).is_ok());
    let (above, beyond) = (bound(plant.clone(), raised(UP)).unwrap(), bound(plant, raised(9.0)).unwrap());
    assert_eq!(above.charts[0].plane, beyond.charts[0].plane);
}

#[test]
fn leaves_of_a_crown_that_is_drawn_down_to_the_ground_end_on_it_and_hang_below_where_that_is_drawn() {
    let plant = ball(4);
    let lows = |plant: &Plant| {
        let posed = plant.pose();
        let low = |leaf: &Leaf| {
            let pose = posed.leaf(plant, leaf);
            let tip = pose.position.y + pose.frame.y.y * leaf.size;
            pose.position.y.min(tip) - 0.5 * leaf.size * leaf.form.width() * pose.frame.x.y.abs()
        };
        plant.leaves().iter().map(low).fold(f32::INFINITY, f32::min)
    };
    let flat = |below: f32| {
        drawing(&format!(
            "<ellipse cx='5' cy='8' rx='5' ry='1'/><circle id='foot' cx='5' cy='{}' r='0.1'/>",
            9.0 - below
        ))
    };
    let of = |elevation: f32, below: f32| {
        let views = SketchViews { elevation, ..FRONT };
        let sketcher = bound(Arc::new(plant.clone()), views).unwrap();
        lows(&sketcher.draw(&Sketch::of(&flat(below))).unwrap().at(1.0))
    };
    assert!(of(0.0, 0.0) > -0.03, "{}", of(0.0, 0.0));
    for elevation in [0.3, 0.8] {
        assert!(of(elevation, 0.0) > -0.03, "{elevation}: {}", of(elevation, 0.0));
    }
    assert!(of(0.0, 0.8) < -0.3, "{}", of(0.0, 0.8));
}
