//! Overlaps and crossings of drawn plants are found and mended.

use super::*;
use crate::plant::{Skeleton, SkeletonNode};
use crate::preset::species;
use crate::source::grow::grow;

fn chain(nodes: &mut Vec<SkeletonNode>, from: Option<u32>, points: &[Vec3], radius: f32) {
    let mut parent = from;
    for &position in points {
        nodes.push(SkeletonNode { position, radius, parent });
        parent = Some(nodes.len() as u32 - 1);
    }
}

/// A trunk, a limb that leaves it, and a twig of the trunk whose way leads through the limb.
fn crossing(offset: f32) -> Skeleton {
    let mut nodes = Vec::new();
    let up: Vec<Vec3> = (0..=40).map(|i| Vec3::Y * (i as f32 * 0.1)).collect();
    chain(&mut nodes, None, &up, 0.1);
    let limb: Vec<Vec3> = (1..=30).map(|i| Vec3::new(i as f32 * 0.1, 1.0, 0.0)).collect();
    chain(&mut nodes, Some(10), &limb, 0.05);
    let twig: Vec<Vec3> = (1..=30).map(|i| Vec3::new(i as f32 * 0.08, 2.0 - i as f32 * 0.08, offset)).collect();
    chain(&mut nodes, Some(20), &twig, 0.01);
    Skeleton { nodes }
}

fn plant(skeleton: Skeleton) -> Plant {
    skeleton.into_plant().unwrap()
}

#[test]
fn what_is_apart_stays_as_it_is() {
    let apart = plant(crossing(0.3));
    assert_eq!(mend_overlaps(&apart), (apart, Mended::default()));
}

#[test]
fn a_twig_through_a_limb_goes_around_it() {
    let before = plant(crossing(0.004));
    let (after, mended) = mend_overlaps(&before);
    // The limb, too, has more than a hundredth of its surface in the twig.
    assert_eq!(mended, Mended { found: 2, dropped: 0, left: 0 });
    assert_eq!((after.chains(), overlaps(&after), crossings(&after)), (before.chains(), 0, 0));
    // No farther than it must, and its base and tip not at all.
    let (a, b) = (before.pose(), after.pose());
    let far = a.positions().iter().zip(b.positions()).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!((0.05..0.09).contains(&far), "{far}");
    for id in before.chain_ids() {
        let (a, b) = (a.chain(&before, id), b.chain(&after, id));
        assert_eq!((a.first(), a.last()), (b.first(), b.last()));
    }
}

#[test]
fn a_branch_is_not_moved_through_an_obstacle() {
    let before = plant(crossing(0.004));
    // A wall close to the twig, on the side to which it would go.
    let wall = |a: Vec3, b: Vec3| (a.z - 0.02) * (b.z - 0.02) <= 0.0;
    assert!(before.pose().positions().iter().all(|p| p.z < 0.02));
    let (after, mended, heights) = mend_among(&before, Some(&wall));
    assert_eq!(heights, [before.height(), after.height()]);
    assert!(after.pose().positions().iter().all(|p| p.z < 0.02));
    assert!(mended.dropped + mended.left > 0, "{mended:?}");
}

#[test]
fn axes_that_cross_are_found_and_moved_apart_however_long_the_branches() {
    // Wood of a millimetre: the crossing is far less than a hundredth of its surface.
    let mut skeleton = crossing(0.0);
    skeleton.nodes.iter_mut().for_each(|n| n.radius = 0.001);
    let crossed = plant(skeleton);
    assert_eq!((overlaps(&crossed), crossings(&crossed)), (0, 2));
    let (after, mended) = mend_overlaps(&crossed);
    assert_eq!((mended.found, mended.left, crossings(&after)), (2, 0, 0));
}

#[test]
fn axes_that_cross_between_their_points_are_found() {
    // Segments of a metre, wood of a centimetre: no point is near the other axis.
    let mut nodes = Vec::new();
    chain(&mut nodes, None, &[Vec3::ZERO, Vec3::Y, Vec3::Y * 4.0], 0.02);
    chain(&mut nodes, Some(1), &[Vec3::new(1.0, 1.0, 0.0), Vec3::new(2.0, 1.0, 0.0)], 0.02);
    chain(&mut nodes, Some(2), &[Vec3::new(1.5, 1.5, 0.0), Vec3::new(1.5, 0.5, 0.0)], 0.02);
    let crossed = plant(Skeleton { nodes });
    let wood = Wood::of(&crossed);
    let hits = find(&wood, &[true; 3], None).hits;
    assert_eq!(hits.len(), 2, "{hits:?}");
    assert!(hits.iter().all(|(_, hit)| (hit.at - 0.5).abs() < 1e-3));
}

#[test]
fn forks_are_no_overlaps_however_long_their_first_segments() {
    let mut nodes = Vec::new();
    let up: Vec<Vec3> = (0..=8).map(|i| Vec3::Y * (i as f32 * 0.5)).collect();
    chain(&mut nodes, None, &up, 0.1);
    for fork in 1..8_u32 {
        let (sin, cos) = crate::base::math::sin_cos(fork as f32);
        let base = up[fork as usize];
        for steep in [0.4, 1.5] {
            let way = |t: f32| base + Vec3::new(cos * t, steep * t, sin * t);
            chain(&mut nodes, Some(fork), &[way(0.9), way(1.3)], 0.03);
        }
    }
    assert_eq!(overlaps(&plant(Skeleton { nodes })), 0);
}

#[test]
fn a_twig_inside_a_limb_leaves_it_or_is_dropped() {
    let mut skeleton = crossing(0.3);
    let inside: Vec<Vec3> = (0..25).map(|i| Vec3::new(2.9 - i as f32 * 0.08, 1.0, 0.0)).collect();
    chain(&mut skeleton.nodes, Some(40), &inside, 0.001);
    let (rest, mended) = mend_overlaps(&plant(skeleton));
    assert!(mended.found >= 1 && mended.left == 0, "{mended:?}");
    assert_eq!(overlaps(&rest), 0);
}

#[test]
fn wood_thicker_than_its_spacing_ends() {
    let mut skeleton = crossing(0.0);
    skeleton.nodes.iter_mut().for_each(|n| n.radius = 50.0);
    let (rest, _) = mend_overlaps(&plant(skeleton));
    assert!(!rest.chains().is_empty());
}

#[test]
fn grown_plants_overlap_nowhere_or_say_where() {
    let text = "(height: 9.0, nodes: 6000, iterations: [\
        (endpoints: Volume(shape: Point(height: 0.6), count: 1)),\
        (endpoints: Volume(shape: Ellipsoid(bottom: 0.2, top: 0.9, radius: 0.4), count: 60)),\
        (endpoints: Surface(k: 2, count: 400))])";
    let mut params = species("s.ron", text).unwrap();
    params.tip_radius = 0.03;
    let mut told = 0;
    for seed in 1..5 {
        let (plant, notes) = grow(&params, crate::base::Seed::new(seed)).unwrap();
        let left = notes.iter().any(|note| note.contains("still grow"));
        told += usize::from(left || notes.iter().any(|note| note.contains("moved out of")));
        assert!(left || overlaps(&plant) == 0, "{notes:?}");
        assert!((plant.height() - 9.0).abs() < 1e-3);
    }
    assert!(told > 0);
}
