//! What a preset says about light, obstacles and company reaches the plan.

use super::load_with_oak;
use crate::preset::plan::{Company, GrowParams, Obstacle, SourceRecipe};

fn grown(source: &str) -> GrowParams {
    let text = format!("(sources: {{ \"a\": {source} }}, variants: [Source(\"a\")])");
    let plan = load_with_oak(&text).unwrap_or_else(|errors| panic!("{errors:?}"));
    match &plan.sources[0].recipe {
        SourceRecipe::Grow(params) => params.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn light_obstacles_and_neighbours_reach_the_plan() {
    let params = grown(
        "Grow(species: \"species/oak.ron\", light: (lean: 90.0, turn: 90.0, strength: 0.5), clearance: 0.3, obstacles: [\
         Box(x: 3.0, z: 1.0, width: 2.0, depth: 4.0, height: 5.0), Mesh(file: \"house.glb\", x: -4.0)], \
         beside: [(species: \"species/oak.ron\", x: 5.0, z: 2.0, seed: 3, height: 9.0)])",
    );
    let space = &params.space;
    assert!((space.light.direction[2] - 1.0).abs() < 1e-6 && space.light.strength == 0.5);
    assert_eq!(space.obstacles[0], Obstacle::Box { low: [2.0, 0.0, -1.0], high: [4.0, 5.0, 3.0] });
    assert_eq!(space.obstacles[1], Obstacle::Mesh { file: "house.glb".to_owned(), at: [-4.0, 0.0, 0.0] });
    assert_eq!((space.clearance, space.company), (0.3, Company::LeftOut));
    let beside = &space.beside[0];
    assert_eq!((beside.at, beside.params.seed, beside.params.height), ([5.0, 2.0], 3, 9.0));
}

#[test]
fn a_height_asks_for_the_same_tree_larger_or_smaller() {
    let own = grown("Grow(species: \"species/oak.ron\")");
    for height in [0.1, 5.0, 30.0, 150.0] {
        let asked = grown(&format!("Grow(species: \"species/oak.ron\", height: {height:?})"));
        assert_eq!(asked, own.clone().at_height(height));
        assert_eq!(asked.height, height);
        let times = height / own.height;
        assert!((asked.tip_radius / own.tip_radius / times - 1.0).abs() < 1e-4);
        assert!(own.taper > 0.0 && (asked.taper * times / own.taper - 1.0).abs() < 1e-4);
    }
}

#[test]
fn a_stand_keeps_its_trees_around_the_first() {
    let params = grown(
        "Stand(trees: [(species: \"species/oak.ron\", x: 1.0), (species: \"species/oak.ron\", x: 4.0, z: -2.0, seed: 2)])",
    );
    assert_eq!(params.space.company, Company::Kept);
    assert_eq!((params.space.beside[0].at, params.space.beside[0].params.seed), ([3.0, -2.0], 2));
}
