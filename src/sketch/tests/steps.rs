//! Promises of sketches that are drawn one over another.

use super::*;

/// The left of a disc, so that something wilts.
const CUT: &str = "<path d='M5 0A5 5 0 0 0 5 10A3 5 0 0 1 5 0Z'/>";

/// The ways of a ball through drawings, each with its view.
fn steps(plant: &Plant, drawn: &[(Drawing, SketchViews)]) -> SketchSteps {
    let mut plant = Arc::new(plant.clone());
    let mut ways = Vec::new();
    for (drawn, views) in drawn {
        let way = bound(plant.clone(), *views).unwrap().draw(&Sketch::of(drawn)).unwrap();
        plant = Arc::new(way.at(1.0));
        ways.push(way);
    }
    SketchSteps::of(ways).unwrap()
}

const SIDE: SketchViews =
    SketchViews { azimuth: std::f32::consts::FRAC_PI_2, elevation: 0.0, kind: ViewKind::FrontKept, detail: 0.5 };

fn both() -> (Plant, SketchSteps) {
    let plant = ball(3);
    let steps = steps(&plant, &[(drawing(HEART), FRONT), (drawing(TRIANGLE), SIDE)]);
    (plant, steps)
}

#[test]
fn a_second_sketch_acts_on_the_tree_that_the_first_gives_and_each_is_seen_from_its_view() {
    let (plant, steps) = both();
    let [first, second] = steps.each() else { panic!("two") };
    assert!(steps.at(0.0) == plant && steps.at(0.5) == first.at(1.0) && steps.at(1.0) == second.at(1.0));
    assert!(*second.sketcher.plant() == first.at(1.0) && steps.likeness() == second.likeness());
    // From the side the tree is what was drawn there, and was not before; from the front it keeps the first shape's width.
    let [before, after] = [0.5, 1.0].map(|t| likeness(&steps.at(t), SIDE.azimuth, &second.targets[0]));
    assert!(after > 0.8 && after > before + 0.1, "{before} {after}");
    let wide = |t: f32| {
        let [low, high] = crown_silhouette(&steps.at(t), 0.0, 0.0, 0.03).bounds();
        high.x - low.x
    };
    assert!((wide(1.0) / wide(0.5) - 1.0).abs() < 0.1, "{} {}", wide(1.0), wide(0.5));
}

#[test]
fn keys_have_all_that_there_ever_is_in_one_order_and_go_on_without_a_jump() {
    let plant = ball(3);
    let steps = steps(&plant, &[(drawing(CUT), FRONT), (drawing(CUT), SIDE)]);
    let wilted = steps.each().iter().map(|way| way.wilting().0).collect::<Vec<_>>();
    assert!(wilted[0] > 0 && wilted[1] > 0, "{wilted:?}");
    let keys: Vec<Plant> = (0..=40).map(|k| steps.key(k as f32 / 40.0)).collect();
    for key in &keys {
        assert_eq!(PlantStats::of(key).topology_continuity, 1.0);
        for (was, is) in plant.chains().iter().zip(key.chains()) {
            assert!(was.parent == is.parent && was.order == is.order);
        }
        assert!(
            plant
                .leaves()
                .iter()
                .map(|leaf| (leaf.chain, leaf.slot))
                .eq(key.leaves().iter().map(|leaf| (leaf.chain, leaf.slot)))
        );
        assert!(plant.chains().len() == key.chains().len());
    }
    let places: Vec<Vec<Vec3>> = keys.iter().map(|key| key.pose().positions().to_vec()).collect();
    for (k, pair) in places.windows(2).enumerate() {
        let most = pair[0].iter().zip(&pair[1]).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!(most < 0.25 * plant.height(), "{k}: {most}");
    }
    // What is not without size in a key is what the tree at that time has, at the same places.
    for t in [0.3, 0.5, 0.8, 1.0] {
        let [tree, key] = [steps.at(t), steps.key(t)];
        let seen: Vec<Vec3> = key
            .leaves()
            .iter()
            .filter(|leaf| leaf.size > 1e-3)
            .map(|leaf| key.pose().leaf(&key, leaf).position)
            .collect();
        let posed = tree.pose();
        let own: Vec<Vec3> =
            tree.leaves().iter().filter(|leaf| leaf.size > 1e-3).map(|leaf| posed.leaf(&tree, leaf).position).collect();
        assert!(
            own.len() == seen.len() && own.iter().zip(&seen).all(|(a, b)| a.distance(*b) < 1e-3),
            "{t}: {} {}",
            own.len(),
            seen.len()
        );
    }
}

#[test]
fn one_sketch_is_what_it_is_alone_and_ways_that_do_not_follow_each_other_are_none() {
    let plant = ball(3);
    let sketcher = bound(Arc::new(plant.clone()), FRONT).unwrap();
    let way = |body: &str| sketcher.draw(&Sketch::of(&drawing(body))).unwrap();
    let alone = SketchSteps::of(vec![way(HEART)]).unwrap();
    for t in [-1.0, 0.0, 0.37, 1.0, 2.0, f32::NAN] {
        assert!(alone.at(t) == way(HEART).at(t) && (t.is_nan() || alone.key(t) == way(HEART).key(t)), "{t}");
    }
    assert!(SketchSteps::of(Vec::new()).is_none());
    assert!(SketchSteps::of(vec![way(HEART), way(TRIANGLE)]).is_none());
}
