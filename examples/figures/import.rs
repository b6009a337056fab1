//! Figures of imported trees: skeletons of wood.

use glam::Vec3;
use treewright::base::Seed;
use treewright::mesh::{TubeDetail, tubes};
use treewright::plant::Plant;
use treewright::preset::plan::{ImportHeight, UpAxis};
use treewright::source::grow::{Solid, Solids, grow_in, shape_files};
use treewright::source::import::{Agreement, agreement};
use treewright::source::skeletonize::{Method, SkeletonParams, Skeletonized, Wood, skeletonize};

use crate::surface::Surface;
use crate::trees::trees;
use crate::{Figure, data, root, seconds};

/// Prints them.
pub(crate) fn print() {
    match data() {
        Some(data) => {
            for tree in trees(&data) {
                one(&tree.name, &tree.wood, tree.up, tree.truth.as_ref());
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
    SkeletonParams { up, height: ImportHeight::AsIs, method }
}

/// One mesh: against its truth where it has one, and its surface against the plant's.
fn one(name: &str, wood: &Wood, up: UpAxis, truth: Option<&Plant>) {
    let Ok(found) = skeletonize(wood, &params(up, Method::ByPiece)) else {
        Figure::new("import.stems", 0.0, "stems", format!("{name}: no plant")).goal(">= 1").print();
        return;
    };
    let stems = found.plant.chains().iter().filter(|c| c.parent.is_none()).count();
    Figure::new("import.stems", stems as f64, "stems", format!("{name}, {} chains", found.plant.chains().len()))
        .goal("the real number")
        .print();
    if let Some(truth) = truth {
        agrees(&agreement(&found.plant, truth), name);
        if let Ok(slow) = skeletonize(wood, &params(up, Method::Contraction)) {
            agrees(&agreement(&slow.plant, truth), &format!("{name}, by contraction alone"));
        }
    }
    let (there, back) = surface_distance(wood, &found);
    for (value, way) in [(there, "wood to plant"), (back, "plant to wood")] {
        let how = format!("{name}, mean over the surface, {way}, share of the height");
        Figure::new("import.surface_distance", value, "share", how).goal("<= 0.005").print();
    }
}

fn agrees(a: &Agreement, how: &str) {
    Figure::new("import.length_found", a.length_found, "share", how).goal(">= 0.95").print();
    Figure::new("import.length_true", a.length_true, "share", how).goal(">= 0.95").print();
    Figure::new("import.radius_error", a.radius_error, "share", how).goal("<= 0.10").print();
    Figure::new("import.chains_error", (a.chains - 1.0).abs(), "share", how).goal("<= 0.15").print();
}

/// Mean distance from the wood to the surface swept from the plant, and back, over the height.
fn surface_distance(wood: &Wood, found: &Skeletonized) -> (f64, f64) {
    let height = f64::from(found.plant.height());
    let (swept, triangles) = swept(&found.plant, 16);
    let plant = Surface::new(&swept, &triangles);
    let placed: Vec<Vec3> = wood.positions.iter().map(|&p| found.placement.point(p)).collect();
    let wood = Surface::new(&placed, &wood.triangles);
    (wood.mean_to(&plant, 20_000) / height, plant.mean_to(&wood, 20_000) / height)
}

/// A plant's tubes.
fn swept(plant: &Plant, sides: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let detail = TubeDetail { sides, error: plant.height() * 2e-4, min_radius: 0.0, bark_tile: 1.0 };
    let mesh = tubes(plant, &plant.pose(), &detail);
    (mesh.positions, mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect())
}

/// A hundred grown plants, meshed and found again: the worst and the median of each figure.
fn round_trip() {
    let species: Vec<_> = std::fs::read_dir(root().join("presets/species"))
        .expect("species are shipped")
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == "ron"))
        .collect();
    let mut species = species;
    species.sort();
    let mut figures: [Vec<f64>; 4] = Default::default();
    let mut plants = 0;
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
        let found = skeletonize(&Wood { positions, triangles }, &params(UpAxis::Y, Method::ByPiece));
        let Ok(found) = found else { continue };
        plants += 1;
        let a = agreement(&found.plant, &truth);
        let values = [a.length_found, a.length_true, a.radius_error, (a.chains - 1.0).abs()];
        figures.iter_mut().zip(values).for_each(|(list, value)| list.push(value));
    }
    Figure::new("import.round_trip_plants", f64::from(plants), "plants", "of 100 grown, meshed at LOD0 and imported")
        .goal("100")
        .print();
    let names = [
        ("import.round_trip_length_found", ">= 0.95"),
        ("import.round_trip_length_true", ">= 0.95"),
        ("import.round_trip_radius_error", "<= 0.10"),
        ("import.round_trip_chains_error", "<= 0.15"),
    ];
    for ((name, goal), list) in names.into_iter().zip(&mut figures) {
        list.sort_by(f64::total_cmp);
        let worst = if goal.starts_with('>') { list.first() } else { list.last() };
        let how = format!("worst of 100 plants; median {:.4}", list.get(list.len() / 2).copied().unwrap_or(0.0));
        Figure::new(name, worst.copied().unwrap_or(0.0), "share", how).goal(goal).print();
    }
}

/// One skin, no piece of which is a tube, of about this many triangles.
pub(crate) fn shell(triangles: usize) -> Wood {
    // Limbs leave a trunk by splitting its last ring in two, again and again: one skin of 16 tips. Triangles about as
    // long as wide, however many.
    let depth = 4_u32;
    let sides = if triangles > 500_000 { 256_u32 } else { 64 };
    let around = sides * (depth + 1) + (2 << depth);
    let rings = (triangles as u32 / (2 * around)).max(2);
    let mut wood = Wood::default();
    let first: Vec<u32> = (0..sides).collect();
    for s in 0..sides {
        let (sin, cos) = treewright::base::math::sin_cos(s as f32 / sides as f32 * std::f32::consts::TAU);
        wood.positions.push(Vec3::new(cos * 0.3, 0.0, sin * 0.3));
    }
    let mut work = vec![(first, Vec3::ZERO, Vec3::Y, 0.3_f32, 0_u32, Seed::new(5))];
    while let Some((ring, base, along, radius, level, seed)) = work.pop() {
        let length = 3.0 / (1.0 + level as f32 * 0.4);
        let (x, z) = along.any_orthonormal_pair();
        let mut below = ring;
        for k in 1..=rings {
            let middle = base + along * (length * k as f32 / rings as f32);
            let above = wood.positions.len() as u32;
            let count = below.len() as u32;
            for s in 0..count {
                let (sin, cos) = treewright::base::math::sin_cos(s as f32 / count as f32 * std::f32::consts::TAU);
                wood.positions.push(middle + (x * cos + z * sin) * radius);
            }
            for s in 0..count {
                let t = (s + 1) % count;
                let (a, b) = (below[s as usize], below[t as usize]);
                wood.triangles.extend([[a, b, above + t], [a, above + t, above + s]]);
            }
            below = (above..above + count).collect();
        }
        if level == depth {
            continue;
        }
        let half = below.len() / 2;
        let end = base + along * length;
        for (side, part) in [(1.0, [&below[..=half]].concat()), (-1.0, [&below[half..], &below[..1]].concat())] {
            let lean = x * (side * 0.5) + seed.child("lean").at(level.into()).direction() * 0.3;
            let way = (along + lean).normalize();
            work.push((part, end + way * (radius * 0.5), way, radius * 0.7, level + 1, seed.at((side > 0.0).into())));
        }
    }
    wood
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
