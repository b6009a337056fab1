//! The shipped species: each grows with the habit that its name promises, at a fifth of its nodes. And shapes that
//! species take endpoints from are read with the preset, or told of at their place.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use treewright::base::Seed;
use treewright::build::check;
use treewright::plant::{Plant, PlantStats};
use treewright::preset::species;
use treewright::source::grow::{Solid, Solids, grow_in, shape_files};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("presets/species")
}

fn grown(name: &str) -> Plant {
    let text = fs::read_to_string(folder().join(format!("{name}.ron"))).unwrap();
    let mut params = species(name, &text).unwrap();
    params.nodes /= 5;
    let mut solids = Solids::new();
    for shape in shape_files(&params) {
        let solid = Solid::read(&fs::read(folder().join(&shape.file)).unwrap(), shape.reading).unwrap();
        solids.insert(shape, solid);
    }
    grow_in(&params, &solids, Seed::new(1)).unwrap().0
}

/// What can be said of a habit in numbers.
struct Habit {
    /// Width over height.
    spread: f32,
    /// Of the chains that bear nothing, the share whose tip lies below their base.
    hanging: f32,
    /// Stems, and limbs that leave in the lowest third with at least a third of the stem's radius.
    trunks: usize,
    /// Height above which nine tenths of all tips lie, as a share of the plant's.
    clear: f32,
}

fn habit(plant: &Plant) -> Habit {
    let posed = plant.pose();
    let stats = PlantStats::of(plant);
    let mut bears = vec![false; plant.chains().len()];
    plant.chains().iter().filter_map(|c| c.parent).for_each(|p| bears[p.index()] = true);
    let ends = |id| {
        let points = posed.chain(plant, id);
        (points[0], points[points.len() - 1])
    };
    let (mut tips, mut hanging, mut trunks) = (Vec::new(), 0, 0);
    for id in plant.chain_ids() {
        let (base, tip) = ends(id);
        let thick = plant.radii(id)[0] >= stats.base_radius / 3.0;
        trunks += usize::from(plant.chain(id).parent.is_none() || (thick && base.y < stats.height / 3.0));
        if !bears[id.index()] {
            tips.push(tip.y);
            hanging += u32::from(tip.y < base.y);
        }
    }
    tips.sort_by(f32::total_cmp);
    Habit {
        spread: stats.width / stats.height,
        hanging: hanging as f32 / tips.len() as f32,
        trunks,
        clear: tips[tips.len() / 10] / stats.height,
    }
}

#[test]
fn every_shipped_species_has_the_habit_of_its_name() {
    let shipped: Vec<String> = fs::read_dir(folder())
        .unwrap()
        .filter_map(|entry| entry.unwrap().file_name().into_string().ok()?.strip_suffix(".ron").map(str::to_owned))
        .collect();
    // Spread, share of hanging twigs, trunks, clear height.
    let any = 0.0..=1.0;
    let habits = BTreeMap::from([
        ("oak", (0.8..=1.4, 0.0..=0.5, 1..=9, 0.3..=0.6)),
        ("elm", (0.85..=1.4, any.clone(), 1..=30, 0.4..=0.75)),
        ("zelkova", (0.75..=1.3, 0.0..=0.5, 1..=30, 0.35..=0.7)),
        ("lime", (0.5..=1.0, any.clone(), 1..=4, 0.2..=0.55)),
        ("ash", (0.45..=1.0, 0.0..=0.5, 1..=4, 0.3..=0.65)),
        ("cottonwood", (0.8..=1.5, 0.0..=0.2, 2..=12, 0.3..=0.65)),
        ("poplar", (0.1..=0.35, 0.0..=0.2, 1..=2, 0.05..=0.4)),
        ("birch", (0.3..=0.8, 0.3..=1.0, 2..=9, 0.2..=0.55)),
        ("willow", (0.85..=1.4, 0.6..=1.0, 1..=20, 0.05..=0.45)),
        ("pine", (0.4..=1.0, 0.0..=0.5, 1..=2, 0.5..=0.85)),
        ("spruce", (0.25..=0.7, 0.5..=1.0, 1..=2, 0.0..=0.25)),
        ("cypress", (0.08..=0.35, 0.0..=0.4, 1..=2, 0.05..=0.4)),
        ("palm", (0.4..=1.0, any.clone(), 1..=1, 0.4..=0.95)),
        ("snag", (0.2..=0.9, any.clone(), 1..=3, 0.2..=0.75)),
        ("shrub", (0.6..=1.3, 0.0..=0.6, 5..=40, 0.15..=0.6)),
        ("hawthorn", (0.7..=2.0, any.clone(), 1..=20, 0.2..=0.7)),
        ("topiary_helix", (0.2..=0.7, any.clone(), 1..=9, 0.45..=0.85)),
        ("topiary_sphere", (0.4..=0.8, any.clone(), 1..=2, 0.4..=0.75)),
        ("topiary_cube", (0.5..=0.9, any.clone(), 1..=2, 0.35..=0.65)),
    ]);
    let mut wrong = Vec::new();
    for name in &shipped {
        let Some((spread, hanging, trunks, clear)) = habits.get(name.as_str()) else {
            wrong.push(format!("{name}: nothing is promised of it"));
            continue;
        };
        let of = habit(&grown(name));
        if !(spread.contains(&of.spread)
            && hanging.contains(&of.hanging)
            && trunks.contains(&of.trunks)
            && clear.contains(&of.clear))
        {
            wrong.push(format!(
                "{name}: spread {:.2}, hanging {:.2}, trunks {}, clear {:.2}",
                of.spread, of.hanging, of.trunks, of.clear
            ));
        }
    }
    assert!(wrong.is_empty() && shipped.len() == habits.len(), "{}", wrong.join("\n"));
}

#[test]
fn shapes_are_looked_for_beside_the_species_and_told_of() {
    let project = tempfile::tempdir().unwrap();
    let at = |name: &str| project.path().join(name);
    fs::create_dir_all(at("species")).unwrap();
    fs::write(at("set.ron"), r#"(sources: {"a": Grow(species: "species/a.ron")}, variants: [Source("a")])"#).unwrap();
    fs::write(
        at("species/a.ron"),
        r#"(height: 5, nodes: 600, iterations: [(endpoints: Volume(shape: Mesh(file: "crown.obj", bottom: 0.3, top: 1), count: 9))])"#,
    )
    .unwrap();
    let told = || match check(&[at("set.ron")]) {
        Ok(_) => String::new(),
        Err(failed) => failed.to_string().replace('\\', "/"),
    };
    let missing = told();
    assert!(missing.contains("set.ron:1:") && missing.contains("can't read species/crown.obj"), "{missing}");
    let closed = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n";
    fs::write(at("species/crown.obj"), closed).unwrap();
    let open = told();
    assert!(open.contains("crown.obj: the mesh is not closed: 3 of its edges"), "{open}");
    fs::write(at("species/crown.obj"), format!("{closed}f 1 4 3\n")).unwrap();
    assert_eq!(told(), "");
}
