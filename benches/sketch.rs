//! Sketching on the workloads of the paper's Table 1 (2018): binding a tree, drawing on it, a frame of the way there.

use std::sync::Arc;

use divan::Bencher;
use treewright::base::{Rotation, Seed};
use treewright::plant::{Leaf, Plant, PlantBuilder};
use treewright::sketch::{Drawing, Sketch, SketchViews, Sketcher, ViewKind};

fn main() {
    divan::main();
}

/// Branches and leaves of the rows.
const ROWS: [(usize, usize); 5] = [(5031, 3830), (1800, 1702), (3917, 3787), (3976, 3852), (1774, 1766)];
const FRONT: SketchViews = SketchViews { azimuth: 0.0, elevation: 0.0, kind: ViewKind::Front, detail: 0.7 };
const HEART: &[u8] = include_bytes!("../presets/sketches/heart.svg");

/// A ball of twigs on limbs, of so many branches and leaves.
fn plant(branches: usize, leaves: usize) -> Arc<Plant> {
    let mut builder = PlantBuilder::new();
    let up: Vec<_> = (0..=16).map(|i| glam::Vec3::Y * i as f32 * 0.5).collect();
    let stem = builder.stem(glam::Vec3::ZERO, &up, &[0.2; 17]);
    let limbs = branches / 40;
    for i in 0..limbs {
        let seed = Seed::new(1).at(i as u64);
        let out = seed.direction() * 2.5;
        let points: Vec<_> = (0..=8).map(|k| out * k as f32 / 8.0).collect();
        builder.branch(stem, 0.4 + 0.6 * seed.at(1).unit(), &points, &[0.05; 9]);
    }
    for i in builder.chain_count()..branches {
        let seed = Seed::new(2).at(i as u64);
        let limb = treewright::plant::ChainId(1 + seed.at(1).index(limbs) as u32);
        let out = seed.direction() * 0.5;
        let points: Vec<_> = (0..=5).map(|k| out * k as f32 / 5.0).collect();
        builder.branch(limb, 0.2 + 0.8 * seed.at(2).unit(), &points, &[0.01; 6]);
    }
    let count = builder.chain_count();
    for i in 0..leaves {
        let seed = Seed::new(3).at(i as u64);
        let chain = treewright::plant::ChainId((limbs + 1 + seed.index(count - limbs - 1)) as u32);
        builder.leaf(Leaf::new(chain, seed.at(1).unit(), Rotation::IDENTITY, 0.15, 0));
    }
    Arc::new(builder.finish().expect("it is sound"))
}

fn bound(row: (usize, usize)) -> Arc<Sketcher> {
    Arc::new(Sketcher::bind(plant(row.0, row.1), FRONT).expect("it has a crown"))
}

#[divan::bench(args = ROWS)]
fn bind(bencher: Bencher<'_, '_>, row: (usize, usize)) {
    let plant = plant(row.0, row.1);
    bencher.bench(|| Sketcher::bind(plant.clone(), FRONT).is_ok());
}

#[divan::bench(args = ROWS)]
fn redraw(bencher: Bencher<'_, '_>, row: (usize, usize)) {
    let (sketcher, heart) = (bound(row), Drawing::read(HEART).expect("a heart"));
    bencher.bench(|| sketcher.draw(&Sketch::of(&heart)).map(|sketched| sketched.at(1.0)).is_ok());
}

#[divan::bench(args = ROWS)]
fn frame(bencher: Bencher<'_, '_>, row: (usize, usize)) {
    let (sketcher, heart) = (bound(row), Drawing::read(HEART).expect("a heart"));
    let sketched = sketcher.draw(&Sketch::of(&heart)).expect("it can be drawn");
    bencher.bench(|| sketched.at(0.5));
}
