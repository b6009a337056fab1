//! Trees with a leader: under a sketch that is lower than they are no mast stands out of it.

use super::*;
use crate::base::math;
use crate::plant::ChainId;

/// A spruce with leaves of so many metres: a leader of 12 m from whose foot to whose tip limbs get shorter, each with leaves along it.
fn spruce(leaf: f32) -> Plant {
    let mut builder = PlantBuilder::new();
    let up: Vec<Vec3> = (0..=12).map(|i| Vec3::Y * i as f32).collect();
    let radii: Vec<f32> = (0..=12).map(|i| 0.2 - 0.015 * i as f32).collect();
    let stem = builder.stem(Vec3::ZERO, &up, &radii);
    for i in 0..120_u64 {
        let seed = Seed::new(11).at(i);
        let location = 0.08 + 0.91 * (i as f32 + 0.5) / 120.0;
        let (sin, cos) = math::sin_cos(i as f32 * 2.4);
        let way = Vec3::new(cos, -0.1, sin) * (2.6 * (1.05 - location));
        let limb = builder.branch(stem, location, &[Vec3::ZERO, way * 0.5, way], &[0.03, 0.02, 0.01]);
        for k in 0..10 {
            builder.leaf(Leaf::new(limb, (k as f32 + seed.at(k).unit()) / 10.0, Rotation::IDENTITY, leaf, 0));
        }
    }
    builder.finish().unwrap()
}

/// How far a place is below what is drawn, metres; below zero outside.
fn depth(sketched: &Sketched, place: Vec2) -> f32 {
    super::super::trim::Field::of(&sketched.targets[0], 0.1).at(place)
}

#[test]
fn a_leader_ends_within_a_sketch_that_is_lower_and_bends_one_way() {
    let plant = Arc::new(spruce(0.25));
    let sketcher = bound(plant.clone(), FRONT).unwrap();
    // A notch that goes down to below the middle keeps limbs out, which wilt or stay short.
    let notched = "<path d='M5 9L1 5L1 1L4 1L5 6L6 1L9 1L9 5Z'/>";
    for (body, least) in [(HEART, 0.7), ("<ellipse cx='5' cy='5' rx='4' ry='3'/>", 0.7), (notched, 0.4)] {
        let drawn = drawing(body);
        let sketched = sketcher.draw(&Sketch::of(&drawn)).unwrap();
        let made = sketched.at(1.0);
        let posed = made.pose();
        let stem = posed.chain(&made, ChainId(0));
        let seen: Vec<Vec2> = stem.iter().map(|p| Vec2::new(p.x, p.y)).collect();
        let tip = seen[seen.len() - 1];
        let high = sketched.targets[0].bounds()[1].y;
        assert!(high < 9.0 && tip.y < high, "{body}: {tip} below {high}");
        // It never falls, and no step is pressed to nothing.
        assert!(seen.windows(2).all(|pair| pair[1].y - pair[0].y > 0.1), "{body}: {seen:?}");
        // The sides to which it turns from step to step: once from one to the other at most, beyond a few degrees.
        let turns = seen.windows(3).map(|p| (p[1] - p[0]).normalize().perp_dot((p[2] - p[1]).normalize()));
        let sides: Vec<bool> = turns.filter(|turn| turn.abs() > 0.1).map(|turn| turn > 0.0).collect();
        assert!(sides.windows(2).filter(|pair| pair[0] != pair[1]).count() <= 1, "{body}: {seen:?}");
        assert!(depth(&sketched, tip) > -0.02, "{body}: {tip} is outside");
        let near = sketched.likeness().unwrap();
        assert!(near > least, "{body}: {near}");
    }
}

#[test]
fn a_leader_with_small_leaves_ends_within_too() {
    // Leaves of two centimetres reach far less than the cells that are looked at are wide.
    let sketcher = bound(Arc::new(spruce(0.02)), FRONT).unwrap();
    for body in [HEART, "<ellipse cx='5' cy='5' rx='4' ry='3'/>", "<rect width='9' height='6'/>"] {
        let drawn = drawing(body);
        let sketched = sketcher.draw(&Sketch::of(&drawn)).unwrap();
        let made = sketched.at(1.0);
        let tip = *made.pose().chain(&made, ChainId(0)).last().unwrap();
        assert!(depth(&sketched, Vec2::new(tip.x, tip.y)) > -0.02, "{body}: {tip}");
    }
}

#[test]
fn what_lies_outside_when_all_has_moved_wilts_up_to_half_of_a_crown() {
    let sketcher = bound(Arc::new(spruce(0.25)), FRONT).unwrap();
    let still = vec![Vec3::ZERO; sketcher.positions.len()];
    let wilting = |right: f32| {
        let ring = [(-9.0, 0.0), (right, 0.0), (right, 15.0), (-9.0, 15.0)].map(|(x, y)| Vec2::new(x, y));
        let drawn = super::super::trim::Field::of(&Region::of(&[ring.to_vec()], Fill::NonZero), sketcher.reach);
        let mut wilts = vec![false; sketcher.plant.chains().len()];
        let near = vec![1.0; sketcher.handles.len()];
        super::prune::left_outside(
            &sketcher,
            &sketcher.charts[0],
            &drawn,
            &still,
            &near,
            &SketchRules::default(),
            &mut wilts,
        );
        wilts
    };
    let posed = sketcher.plant.pose();
    let (mut gone, wilts) = (0, wilting(0.4));
    for id in sketcher.plant.chain_ids() {
        let tip = posed.chain(&sketcher.plant, id).last().unwrap().x;
        gone += usize::from(wilts[id.index()]);
        // Its leaves lie evenly along a limb and reach beyond it.
        assert!(tip > 0.4 || !wilts[id.index()], "{tip}");
        assert!(tip < 2.2 || wilts[id.index()], "{tip}");
    }
    assert!(gone > 4);
    // Of a sketch that is far from the tree half wilts at the most, and nearly so much.
    let foliage = |wilts: &[bool]| {
        let of = |leaf: &crate::plant::Leaf| f32::from(u8::from(wilts[leaf.chain.index()])) * leaf.size * leaf.size;
        let all: f32 = sketcher.plant.leaves().iter().map(|leaf| leaf.size * leaf.size).sum();
        sketcher.plant.leaves().iter().map(of).sum::<f32>() / all
    };
    let most = foliage(&wilting(-2.0));
    assert!(most > 0.4 && most < 0.501, "{most}");
}
