//! Promises of the methods by which a crown follows a sketch, and of what wilts.

use super::super::prune;
use super::*;

/// Most of the foliage that wilts where nothing is told.
const MOST: f32 = 0.5;

/// The left half of a disc of radius 5 without an ellipse, so that it is `thick` at its middle.
fn crescent(thick: f32) -> Drawing {
    drawing(&format!("<path d='M5 0A5 5 0 0 0 5 10A{} 5 0 0 1 5 0Z'/>", 5.0 - thick))
}

/// Which share of the foliage wilts.
fn lost(sketcher: &Sketcher, wilts: &[bool]) -> f32 {
    let all: f32 = sketcher.handles.iter().map(|h| h.weight).sum();
    let gone = sketcher.handles.iter().filter(|h| wilts[h.chain.index()]).map(|h| h.weight);
    gone.sum::<f32>() / all
}

#[test]
fn the_more_lies_outside_the_more_wilts_and_never_more_than_may() {
    let sketcher = bound(Arc::new(ball(4)), FRONT).unwrap();
    let chart = &sketcher.charts[0];
    let near = vec![1.0; sketcher.handles.len()];
    // What lies to the right of a line, which goes to the right.
    let wilting = |left: f32, most: f32| {
        let ring = [(left, -9.0), (9.0, -9.0), (9.0, 19.0), (left, 19.0)].map(|(x, y)| Vec2::new(x, y));
        let region = Region::of(&[ring.to_vec()], Fill::NonZero);
        let mut wilts = vec![false; sketcher.plant.chains().len()];
        let rules = SketchRules { wilting: most, ..SketchRules::default() };
        let spared = prune::pruned(&sketcher, chart, chart.cages.rest(), &region, &near, &rules, &mut wilts);
        (lost(&sketcher, &wilts), spared)
    };
    let places = [-1.5, -1.0, -0.6, -0.3, 0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.3, 1.6];
    let ours = places.map(|left| wilting(left, MOST));
    assert!(ours.windows(2).all(|pair| pair[1].0 > pair[0].0 - 0.05), "{ours:?}");
    assert!(ours.iter().all(|(lost, _)| *lost <= MOST + 1e-3), "{ours:?}");
    // Where the limit is met it is reached, and what may not wilt is told.
    let (last, spared) = ours[places.len() - 1];
    assert!(ours[0] == (ours[0].0, 0.0) && last > MOST - 0.05 && spared > 0.2, "{ours:?}");
    // The paper has none.
    let (all, none) = wilting(1.6, 1.0);
    assert!(all > MOST + 0.2 && none == 0.0, "{all} {none}");
}

#[test]
fn a_crescent_takes_half_of_a_crown_at_most() {
    let sketcher = bound(Arc::new(ball(4)), FRONT).unwrap();
    for thick in [4.0, 2.0, 1.0, 0.6] {
        let sketched = sketcher.draw(&Sketch::of(&crescent(thick))).unwrap();
        assert!(lost(&sketcher, &sketched.wilts) <= MOST + 0.02, "{thick}");
        let papers = sketcher.draw(&Sketch { method: Method::Paper, ..Sketch::of(&crescent(thick)) }).unwrap();
        assert!(papers.spared() == 0.0);
    }
}

#[test]
fn the_papers_methods_are_cages_and_tips_and_nothing_else() {
    let plant = Arc::new(ball(4));
    let sketcher = bound(plant.clone(), FRONT).unwrap();
    let drawn = drawing(&format!("<g id='trunk'><rect x='8' y='8' width='1' height='2'/></g>{HEART}"));
    let by = |method| {
        let size = SketchSize::Metres(plant.height() * 1.5);
        sketcher.draw(&Sketch { method, size, ..Sketch::of(&drawn) }).unwrap()
    };
    let methods = [Method::Paper, Method::AdaptiveCages, Method::Baseline, Method::OneCage];
    for method in methods {
        let sketched = by(method);
        for (i, handle) in sketcher.handles.iter().enumerate() {
            // Depth is kept, every tip is where its cage has it, however far, and stays there in the tree that is made.
            assert!(sketched.told[i].z.abs() < 1e-4, "{method:?}: {}", sketched.told[i]);
            if sketcher.handles.get(i + 1).is_none_or(|next| next.chain != handle.chain) {
                let tip = plant.span(handle.chain).end - 1;
                let off = sketched.shift[tip].distance(sketched.told[i]);
                assert!(off < 1e-2, "{method:?} {:?}: {off}", handle.chain);
            }
        }
        assert!(sketched.guided.leads.is_empty() && sketched.likeness().is_none());
        assert!(sketched.wilting().0 == 0 || method == Method::Paper, "{method:?}");
        // Nothing is brought up or tightened, and in-betweens are straight ways.
        let (half, following) = (sketched.at(0.5), sketched.clone().following().at(0.5));
        assert_eq!(half, following);
    }
    let told = |method| by(method).told;
    assert_eq!(told(Method::Paper), told(Method::AdaptiveCages));
    assert!(told(Method::AdaptiveCages) != told(Method::Baseline) && told(Method::Baseline) != told(Method::OneCage));
    assert!(told(Method::Adaptive) != told(Method::Paper));
}

#[test]
fn what_is_least_inside_wilts_first_and_a_limb_that_is_too_much_by_its_twigs() {
    // Two limbs of four twigs each, with foliage on the twigs alone.
    let mut builder = PlantBuilder::new();
    let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y], &[0.1, 0.1]);
    for side in [Vec3::X, Vec3::NEG_X] {
        let limb = builder.branch(stem, 0.9, &[Vec3::ZERO, side], &[0.05, 0.02]);
        for _ in 0..4 {
            builder.branch(limb, 0.9, &[Vec3::ZERO, Vec3::Y], &[0.01, 0.01]);
        }
    }
    let plant = builder.finish().unwrap();
    let is_twig = |id: crate::plant::ChainId| plant.radii(id)[0] < 0.02;
    let foliage: Vec<f32> = plant.chain_ids().map(|id| if is_twig(id) { 1.0 } else { 0.0 }).collect();
    assert_eq!(foliage.iter().sum::<f32>(), 8.0);
    let limbs: Vec<_> = plant.chain_ids().filter(|&id| plant.chain(id).parent.is_some() && !is_twig(id)).collect();
    let wilting = |outside: &dyn Fn(crate::plant::ChainId) -> Option<f32>, most: f32| {
        let outside: Vec<Option<f32>> = plant.chain_ids().map(outside).collect();
        let mut wilts = vec![false; plant.chains().len()];
        prune::worst_first(&plant, &outside, &foliage, most, &mut wilts);
        wilts
    };
    let count = |wilts: &[bool]| wilts.iter().zip(&foliage).filter(|(w, f)| **w && **f > 0.0).count();
    // Both limbs are outside, the second by more: it goes, with its twigs, and the first stays.
    let limb = |id: crate::plant::ChainId| {
        if id == limbs[0] {
            Some(0.2)
        } else if id == limbs[1] {
            Some(0.1)
        } else {
            None
        }
    };
    let half = wilting(&limb, 0.5);
    assert!(half[limbs[1].index()] && !half[limbs[0].index()] && count(&half) == 4);
    assert_eq!(count(&wilting(&limb, 1.0)), 8);
    assert_eq!(count(&wilting(&limb, 0.4)), 0);
    // Of a limb that may not go as a whole some twigs do.
    let all = |id: crate::plant::ChainId| plant.chain(id).parent.map(|_| 0.0);
    assert_eq!(count(&wilting(&all, 0.4)), 3);
}

#[test]
fn what_the_paper_found_by_trials_can_be_told() {
    let sketcher = bound(Arc::new(ball(4)), FRONT).unwrap();
    let drawn = crescent(2.0);
    let of = |rules| sketcher.draw(&Sketch { rules, ..Sketch::of(&drawn) }).unwrap();
    let usual = SketchRules::default();
    assert_eq!(usual.wilting, MOST);
    let wilts = |rules| lost(&sketcher, &of(rules).wilts);
    // The more of a lobe must be inside, the more goes, and at none nothing does, but never more than may.
    let by = [0.0, 0.1, 0.3, 0.6].map(|pruning| wilts(SketchRules { pruning, wilting: 1.0, ..usual }));
    assert!(by[0] == 0.0 && by.windows(2).all(|pair| pair[0] < pair[1]), "{by:?}");
    let most = [0.0, 0.1, 0.3].map(|wilting| wilts(SketchRules { wilting, ..usual }));
    assert!(most[0] == 0.0 && most[1] > 0.05 && most[1] < 0.12 && most[2] > 0.25 && most[2] < 0.32, "{most:?}");
    // Cages that count as covering from further off leave less open, and so move otherwise.
    let near = of(SketchRules { covering: 0.1, ..usual });
    assert!(near.shift != of(usual).shift);
}
