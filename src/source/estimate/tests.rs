//! Promises of estimates as a whole.

use glam::Vec3;

use super::{Estimate, EstimateError, estimate, search};
use crate::base::Seed;
use crate::plant::{Habit, Plant, PlantBuilder};
use crate::preset::plan::GrowParams;
use crate::preset::species;
use crate::source::grow::grow;

/// As [`estimate`], with a shorter search.
fn quick(plant: &Plant) -> Result<Estimate, EstimateError> {
    search(plant, 0)
}

fn grown(text: &str, seed: u64) -> Plant {
    let params = GrowParams { seed, ..species("s.ron", text).unwrap() };
    grow(&params, Seed::new(seed).child("grow")).unwrap().0
}

/// A slim tree of 9 m with short side branches, and a broad one.
const POLE: &str = "(height: 9.0, nodes: 6000, width: 0.4, tip_radius: 0.006, bole: 0.3, iterations: [
    (endpoints: Volume(shape: Point(height: 0.95), count: 1)),
    (endpoints: Volume(shape: Ellipsoid(bottom: 0.35, top: 0.95, radius: 0.1), count: 30),
     guide: Piecewise(alpha1: 70.0, alpha2: 0.0, h0: 1)),
])";
const DOME: &str = "(height: 9.0, nodes: 6000, width: 1.6, tip_radius: 0.006, bole: 0.15, iterations: [
    (endpoints: Volume(shape: Point(height: 0.3), count: 1)),
    (endpoints: Volume(shape: HalfEllipsoid(bottom: 0.4, top: 0.9, radius: 0.6, hollow: 0.6), count: 20),
     guide: Piecewise(alpha1: 40.0, alpha2: 0.0, h0: 1)),
    (endpoints: Surface(k: 2, t: 0.6, count: 150)),
])";

#[test]
fn trees_grown_like_a_slim_plant_are_nearer_to_it_than_another_kind_is() {
    let (pole, dome) = (grown(POLE, 3), grown(DOME, 3));
    let estimate = quick(&pole).unwrap();
    let habit = Habit::of(&pole);
    let like = grow(&GrowParams { seed: 40, ..estimate.params.clone() }, Seed::new(40)).unwrap().0;
    let (near, far) = (habit.distance(&Habit::of(&like)), habit.distance(&Habit::of(&dome)));
    assert!(near < far * 0.85, "{near} {far}\n{}", estimate.text);
    assert!((like.height() - pole.height()).abs() < 1e-3);
}

#[test]
fn a_broad_plant_is_grown_broad_and_nearer_to_it_than_a_pole() {
    let width = |p: &Plant| p.pose().positions().iter().fold(0.0_f32, |w, q| w.max(Vec3::new(q.x, 0.0, q.z).length()));
    let (pole, dome) = (grown(POLE, 3), grown(DOME, 3));
    let habit = Habit::of(&dome);
    let params = search(&dome, 3).unwrap().params;
    let like = |seed: u64| grow(&GrowParams { seed, ..params.clone() }, Seed::new(seed)).unwrap().0;
    let likes: Vec<Plant> = (40..48).map(like).collect();
    let like = &likes[0];
    assert!((0.6..1.5).contains(&(width(like) / width(&dome))), "{} {}", width(like), width(&dome));
    assert!((like.height() - dome.height()).abs() < 1e-3);
    // One tree of a kind may be unlike another.
    let all: Vec<f32> = likes.iter().map(|like| habit.distance(&Habit::of(like))).collect();
    let (near, far) = (all.iter().sum::<f32>() / all.len() as f32, habit.distance(&Habit::of(&pole)));
    assert!(near < far * 0.9, "{near} {far} {all:?}");
}

#[test]
fn trunks_are_as_thick_as_the_plant_s_whatever_its_twigs_are() {
    let plant = grown(DOME, 3);
    let trunk = plant.all_radii()[0];
    // Twigs that a scan shows far too thick, and ones that hold the trunk's whole cross section together.
    for (name, thick) in [("as grown", 0.0_f32), ("thick twigs", 0.5), ("all alike", 0.95)] {
        let radii: Vec<f32> = plant.all_radii().iter().map(|r| r.max(trunk * thick)).collect();
        let plant = plant.clone().with_radii(radii);
        let params = quick(&plant).unwrap().params;
        let base = |p: &Plant| super::measure::base_radius(p);
        let likes =
            (60..64).map(|seed| base(&grow(&GrowParams { seed, ..params.clone() }, Seed::new(seed)).unwrap().0));
        let times = likes.sum::<f32>() / 4.0 / base(&plant);
        assert!((0.75..1.33).contains(&times), "{name}: {times}");
    }
}

#[test]
fn the_text_is_the_species_that_is_grown() {
    let estimate = quick(&grown(POLE, 5)).unwrap();
    assert_eq!(species("x.ron", &estimate.text).unwrap(), estimate.params);
    assert!(ron::from_str::<ron::Value>(&estimate.text).is_ok());
    let crown = |p: &Plant| p.pose().positions().iter().fold(0.0_f32, |w, q| w.max(q.x.abs().max(q.z.abs())));
    let plant = grown(&estimate.text, 9);
    assert!(crown(&plant) < 2.7, "a pole is no dome: {}", crown(&plant));
}

#[test]
fn odd_plants_give_an_estimate_or_an_error() {
    let stem = |points: &[Vec3]| {
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::ZERO, points, &vec![0.1; points.len()]);
        builder.finish().unwrap()
    };
    let bare = quick(&stem(&[Vec3::ZERO, Vec3::Y * 3.0])).unwrap();
    assert!((bare.params.height - 3.0).abs() < 1e-3 && bare.params.iterations.len() == 1);
    assert!(estimate(&stem(&[Vec3::ZERO, Vec3::X * 3.0])).is_err());
    assert!(estimate(&stem(&[Vec3::ZERO, Vec3::Y * 900.0])).is_err());
    // Wood without thickness, a branch without length, and one that hangs below the ground.
    let mut builder = PlantBuilder::new();
    let base = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 2.0], &[0.0, 0.0]);
    builder.branch(base, 0.5, &[Vec3::ZERO, Vec3::ZERO], &[0.0, 0.0]);
    builder.branch(base, 1.0, &[Vec3::ZERO, Vec3::Y * -5.0 + Vec3::X], &[0.0, 0.0]);
    if let Ok(estimate) = quick(&builder.finish().unwrap()) {
        assert!(species("x.ron", &estimate.text).is_ok());
    }
}

#[test]
fn another_height_keeps_the_proportions() {
    let estimate = quick(&grown(POLE, 3)).unwrap();
    let plant = |params: &GrowParams| grow(params, Seed::new(2)).unwrap().0;
    let (own, twice) =
        (plant(&estimate.params), plant(&estimate.params.clone().at_height(estimate.params.height * 2.0)));
    let ratio = |p: &Plant| p.all_radii()[0] / p.height();
    assert!((twice.height() / own.height() - 2.0).abs() < 1e-3);
    assert!((ratio(&own) / ratio(&twice) - 1.0).abs() < 0.05, "{} {}", ratio(&own), ratio(&twice));
    assert!((own.chains().len() as f32 / twice.chains().len() as f32 - 1.0).abs() < 0.05);
}
