//! Where wood ends.

use glam::{Vec2, Vec3};

use super::*;

#[test]
fn broken_limbs_stay_blunt_on_coarse_tubes_and_twigs_end_in_points() {
    let mut builder = PlantBuilder::new();
    let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 3.0], &[0.3, 0.2]);
    let out = Vec3::new(0.8, 0.6, 0.0);
    let stub = builder.branch(stem, 0.6, &[Vec3::ZERO, out], &[0.06, 0.05]);
    let twig = builder.branch(stem, 0.8, &[Vec3::ZERO, out], &[0.02, 0.01]);
    let plant = builder.finish().unwrap();
    let posed = plant.pose();
    let wood = Wood::of(&plant, &posed, &DETAIL);
    let mesh = wood.mesh(&CrownLight::of(&plant, &posed), &TubeDetail { error: 0.08, sides: 6, ..DETAIL });
    let girth = |chain: ChainId| {
        let tip = posed.chain(&plant, chain)[1];
        let of_chain = mesh.positions.iter().zip(&mesh.chains).filter(|(_, c)| **c == chain.0).map(|(p, _)| p);
        of_chain.filter(|p| p.distance(tip) < 0.12).fold(0.0_f32, |most, p| {
            let off = *p - tip;
            most.max((off - out * off.dot(out)).length())
        })
    };
    assert!(girth(stub) > 0.04 && girth(twig) < 0.001, "{} {}", girth(stub), girth(twig));
}

#[test]
fn a_trunk_ends_round_and_a_twig_in_a_cone() {
    let mut builder = PlantBuilder::new();
    let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 3.0], &[0.3, 0.2]);
    let twig = builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X * 2.0], &[0.02, 0.015]);
    let plant = builder.finish().unwrap();
    let posed = plant.pose();
    let detail = TubeDetail { error: 0.004, sides: 12, ..DETAIL };
    let wood = Wood::of(&plant, &posed, &detail);
    let mesh = wood.mesh(&CrownLight::of(&plant, &posed), &detail);
    assert!(problems(&mesh).is_empty() && mesh.indices.len() / 3 <= wood.count(&detail));
    // All on an ellipsoid round the end, twelve corners being a little outside of it.
    let beyond = |chain: ChainId, tip: Vec3, way: Vec3| {
        let of_chain = mesh.positions.iter().zip(&mesh.chains).filter(move |(_, c)| **c == chain.0);
        of_chain
            .map(move |(p, _)| *p - tip)
            .map(move |off| (off.dot(way), (off - way * off.dot(way)).length()))
            .filter(|at| at.0 > 1e-4)
    };
    let of_stem: Vec<(f32, f32)> = beyond(stem, Vec3::Y * 3.0, Vec3::Y).collect();
    let highest = of_stem.iter().map(|at| at.0).fold(0.0, f32::max);
    assert!(of_stem.len() > 24 && (highest / 0.2 - 0.9).abs() < 0.01, "{highest}");
    for (up, out) in of_stem {
        let off = Vec2::new(up / highest, out / 0.2).length();
        assert!((off - 1.0).abs() < 0.03, "{up} {out}");
    }
    let of_twig: Vec<(f32, f32)> = beyond(twig, posed.chain(&plant, twig)[1], Vec3::X).collect();
    assert!(of_twig.iter().all(|at| at.1 < 1e-4) && !of_twig.is_empty(), "{of_twig:?}");
}
