//! Figures of imported trees: skeletons of wood.

use glam::Vec3;
use treewright::base::Seed;
use treewright::mesh::{TubeDetail, tubes};
use treewright::plant::Plant;
use treewright::preset::plan::{ImportHeight, MeshParams, UpAxis};
use treewright::source::grow::{Solid, Solids, grow_in, shape_files};
use treewright::source::import::{Agreement, agreement, agreement_at};
use treewright::source::skeletonize::{Method, SkeletonParams, Skeletonized, Wood, skeletonize};

use crate::bridges::Bridges;
use crate::shells::shell;
use crate::surface::Surface;
use crate::trees::{Tree, trees};
use crate::{Figure, data, root, seconds};

/// Prints them.
pub(crate) fn print() {
    match data() {
        Some(data) => {
            for tree in trees(&data) {
                one(&tree);
            }
            crate::foliage::print(&data);
        }
        None => Figure::new("import.files", 0.0, "files", "no data folder: nothing was measured").print(),
    }
    round_trip();
    speed();
    crate::formats::print();
}

fn params(up: UpAxis, method: Method) -> SkeletonParams {
    SkeletonParams { up, height: ImportHeight::AsIs, method, around: None }
}

/// One mesh: against its truth where it has one, and its surface against the plant's.
fn one(tree: &Tree) {
    let (name, wood, up) = (&tree.name, &tree.wood, tree.up);
    let Ok(found) = skeletonize(wood, &params(up, Method::ByPiece)) else {
        Figure::new("import.stems", 0.0, "stems", format!("{name}: no plant")).goal(">= 1").print();
        return;
    };
    let stems = found.plant.chains().iter().filter(|c| c.parent.is_none()).count();
    Figure::new("import.stems", stems as f64, "stems", format!("{name}, {} chains", found.plant.chains().len()))
        .goal("the real number")
        .print();
    if let Some(truth) = &tree.truth {
        agrees(&agreement(&found.plant, truth), name);
        if let Ok(slow) = skeletonize(wood, &params(up, Method::Contraction)) {
            agrees(&agreement(&slow.plant, truth), &format!("{name}, by contraction alone"));
        }
    } else if let Ok(slow) = skeletonize(wood, &params(up, Method::Contraction)) {
        // Where the truth is not known, both ways must find the same.
        let shift = found.placement.point(Vec3::ZERO) - slow.placement.point(Vec3::ZERO);
        let how = format!("{name}, by contraction alone, against what is found by rings where there are any");
        agrees(&agreement_at(&slow.plant, shift, &found.plant), &how);
    }
    let corners = [tree.bounds.0, tree.bounds.1].map(|p| found.placement.point(p).y);
    let height = f64::from((corners[1] - corners[0]).abs());
    let Distances { there, back, bridges, with_bridges } = distances(wood, &found, height);
    for (value, way) in [(there, "wood to plant"), (back, "plant to wood")] {
        let how = format!("{name}, mean over the surface, {way}, share of the tree's height");
        Figure::new("import.surface_distance", value, "share", how).goal("<= 0.005").print();
    }
    if bridges > 0.0 {
        let left_out = format!("of it {:.1} % run between pieces, where the file has no wood", bridges * 100.0);
        Figure::new("import.surface_bridged", bridges, "share", format!("{name}, of the length of all axes")).print();
        let how = format!("{name}, mean over the surface, plant to wood, bridges too; {left_out}");
        Figure::new("import.surface_distance_with_bridges", with_bridges, "share", how).print();
    }
}

fn agrees(a: &Agreement, how: &str) {
    Figure::new("import.length_found", a.length_found, "share", how).goal(">= 0.95").print();
    Figure::new("import.length_true", a.length_true, "share", how).goal(">= 0.95").print();
    Figure::new("import.radius_error", a.radius_error, "share", how).goal("<= 0.10").print();
    Figure::new("import.chains_error", (a.chains - 1.0).abs(), "share", how).goal("<= 0.15").print();
}

/// Mean distances of surfaces, over the tree's height.
struct Distances {
    /// From the wood to the surface swept from the plant.
    there: f64,
    /// And back, where the file has wood.
    back: f64,
    /// The share of the axes that the file has no wood for, and the way back with what is swept there.
    bridges: f64,
    with_bridges: f64,
}

fn distances(wood: &Wood, found: &Skeletonized, height: f64) -> Distances {
    let (swept, triangles) = swept(&found.plant, 16);
    let plant = Surface::new(&swept, &triangles);
    let placed: Vec<Vec3> = wood.positions.iter().map(|&p| found.placement.point(p)).collect();
    let surface = Surface::new(&placed, &wood.triangles);
    let bridges = Bridges::new(&found.plant, wood, &placed, &surface);
    Distances {
        there: surface.mean_to(&plant, 20_000, |_| true) / height,
        back: plant.mean_to(&surface, 20_000, |p| !bridges.holds(p)) / height,
        with_bridges: plant.mean_to(&surface, 20_000, |_| true) / height,
        bridges: bridges.share,
    }
}

/// A plant's tubes.
fn swept(plant: &Plant, sides: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let detail = TubeDetail::full(&MeshParams::told(sides, plant.height() * 2e-4));
    let mesh = tubes(plant, &plant.pose(), &detail);
    (mesh.positions, mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect())
}

/// A hundred grown plants, meshed and found again: the worst and the median of each figure.
fn round_trip() {
    let folder = root().join("presets/species");
    let entries = std::fs::read_dir(folder).expect("species are shipped").flatten().map(|entry| entry.path());
    let mut species: Vec<_> = entries.filter(|path| path.extension().is_some_and(|e| e == "ron")).collect();
    species.sort();
    let mut round = [Round::default(), Round::default()];
    for seed in 0..100_u64 {
        let path = &species[seed as usize % species.len()];
        let text = std::fs::read_to_string(path).expect("the species can be read");
        let mut growth = treewright::preset::species("it.ron", &text).expect("the species is good");
        growth.seed = seed;
        let solids: Solids = shape_files(&growth)
            .into_iter()
            .map(|shape| {
                let bytes = std::fs::read(path.with_file_name(&shape.file)).expect("the shape is shipped");
                let solid = Solid::read(&bytes, shape.reading).expect("the shape is good");
                (shape, solid)
            })
            .collect();
        let truth = grow_in(&growth, &solids, Seed::new(seed)).expect("it grows").0;
        let (positions, triangles) = swept(&truth, 12);
        let wood = Wood { positions, triangles };
        for (round, method) in round.iter_mut().zip([Method::ByPiece, Method::Contraction]) {
            round.add(&wood, method, &truth);
        }
    }
    for (round, how) in round.iter_mut().zip(["", ", by contraction alone"]) {
        round.print(how);
    }
}

/// What was found again of some plants.
#[derive(Default)]
struct Round {
    plants: u32,
    figures: [Vec<f64>; 4],
}

impl Round {
    fn add(&mut self, wood: &Wood, method: Method, truth: &Plant) {
        let Ok(found) = skeletonize(wood, &params(UpAxis::Y, method)) else { return };
        self.plants += 1;
        // In the place that the mesh has: of a shrub another stem may have come to the origin.
        let a = agreement_at(&found.plant, -found.placement.point(Vec3::ZERO), truth);
        let values = [a.length_found, a.length_true, a.radius_error, (a.chains - 1.0).abs()];
        self.figures.iter_mut().zip(values).for_each(|(list, value)| list.push(value));
    }

    fn print(&mut self, how: &str) {
        let what = format!("of 100 grown, meshed at LOD0 and imported{how}");
        Figure::new("import.round_trip_plants", f64::from(self.plants), "plants", what).goal("100").print();
        let names = [
            ("import.round_trip_length_found", ">= 0.95"),
            ("import.round_trip_length_true", ">= 0.95"),
            ("import.round_trip_radius_error", "<= 0.10"),
            ("import.round_trip_chains_error", "<= 0.15"),
        ];
        for ((name, goal), list) in names.into_iter().zip(&mut self.figures) {
            list.sort_by(f64::total_cmp);
            let worst = if goal.starts_with('>') { list.first() } else { list.last() };
            let middle = list.get(list.len() / 2).copied().unwrap_or(0.0);
            let what = format!("worst of 100 plants{how}; median {middle:.4}");
            Figure::new(name, worst.copied().unwrap_or(0.0), "share", what).goal(goal).print();
        }
    }
}

fn speed() {
    let time = |wood: &Wood, method, runs| {
        seconds(runs, || drop(skeletonize(wood, &params(UpAxis::Y, method)).expect("it has an axis")))
    };
    let wood = shell(100_000);
    let one = time(&wood, Method::ByPiece, 3);
    let how = format!("one skin of {} triangles with 31 limbs, contracted, median of 3", wood.triangles.len());
    Figure::new("import.seconds_100k", one, "s", how).goal("<= 1 s on 2 cores").print();
    let large = shell(2_000_000);
    let twenty = time(&large, Method::ByPiece, 1);
    let how = format!("one skin of {} triangles, one run", large.triangles.len());
    Figure::new("import.seconds_2m", twenty, "s", how).print();
    let share = large.triangles.len() as f64 / wood.triangles.len() as f64;
    let exponent = treewright::base::math::ln64(twenty / one) / treewright::base::math::ln64(share);
    Figure::new("import.scaling_exponent", exponent, "", "of time over triangles, from 100,000 to 2 million")
        .goal("<= 1.1 (n log n)")
        .print();
    if let Some(most) = peak() {
        let how = "peak of this process, with the mesh of 2 million triangles itself and all that was measured before";
        Figure::new("import.memory_2m", most, "GB", how).goal("<= 1").print();
    }
}

/// Most memory that this process had at a time, GB, where the system tells.
fn peak() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes / 1e6)
}
