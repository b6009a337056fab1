//! A tree for tests: a ball of twigs and leaves on a trunk, and what its levels are made with.

use glam::Vec3;

use super::{Ladder, Stock, Texels, ladder_with};
use crate::bake::Maps;
use crate::base::{Rotation, Seed};
use crate::plant::{Leaf, Plant, PlantBuilder};
use crate::preset::plan::{Forks, Lod, LodBudget, MeshParams};

/// A trunk that stands at `foot`, `height` high and `radius` thick at its base, whose crown begins at three quarters of it: so
/// many twigs of one and a half metres with so many leaves each.
pub(crate) fn on_trunk(foot: Vec3, (height, radius): (f32, f32), (twigs, leaves): (u64, u64)) -> Plant {
    let mut builder = PlantBuilder::new();
    let radii = [1.0, 0.8, 0.5].map(|part| part * radius);
    let stem = builder.stem(foot, &[Vec3::ZERO, Vec3::Y * (0.5 * height), Vec3::Y * height], &radii);
    for i in 0..twigs {
        let seed = Seed::new(6).at(i);
        let way = seed.direction() * 1.5;
        let twig = builder.branch(stem, seed.at(1).range(0.75, 1.0), &[Vec3::ZERO, way], &[0.02, 0.01]);
        for k in 0..leaves {
            let seed = seed.at(10 + k);
            let turned = Rotation::about(seed.at(0).direction(), seed.at(1).range(0.0, 6.0));
            builder.leaf(Leaf::new(twig, seed.at(2).unit(), turned, 0.4, 0));
        }
    }
    builder.finish().expect("it is sound")
}

/// A trunk with 60 limbs of six twigs and so many leaves each; all wood is `girth` times as thick as it might be.
pub(super) fn crown(leaves: u64, girth: f32) -> Plant {
    let mut builder = PlantBuilder::new();
    let stem =
        builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 3.0, Vec3::Y * 6.0], &[0.2, 0.15, 0.05].map(|r| r * girth));
    for i in 0..60 {
        let seed = Seed::new(4).at(i);
        let way = (seed.direction() + Vec3::Y * 0.4) * 1.5;
        let limb = builder.branch(
            stem,
            seed.at(1).range(0.3, 1.0),
            &[Vec3::ZERO, way * 0.5, way],
            &[0.03, 0.02, 0.01].map(|r| r * girth),
        );
        for k in 0..6 {
            let seed = seed.at(10 + k);
            let way = seed.direction() * 0.5;
            builder.branch(limb, seed.at(1).range(0.3, 1.0), &[Vec3::ZERO, way], &[0.012, 0.008].map(|r| r * girth));
        }
        for k in 0..leaves {
            let seed = seed.at(30 + k);
            let orientation = Rotation::about(seed.at(0).direction(), seed.at(1).range(0.0, 6.0));
            builder.leaf(Leaf::new(limb, seed.at(2).unit(), orientation, 0.2, 0));
        }
    }
    builder.finish().expect("it is sound")
}

/// An opaque picture.
pub(crate) fn plain() -> Maps {
    Maps {
        width: 8,
        height: 8,
        color: vec![[60, 110, 30, 255]; 64],
        normal: vec![[128, 128, 255]; 64],
        orm: vec![[255; 3]; 64],
    }
}

/// The tree in full and one level more, in plain pictures.
pub(super) fn climbed(plant: &Plant, lod: Lod) -> Ladder {
    let plain = plain();
    let params = MeshParams { forks: Forks::Plain, ..MeshParams::told(8, 0.01) };
    let stock = Stock::new(std::slice::from_ref(&plain), &plain);
    ladder_with(plant, &params, &[Lod::Full, lod].map(LodBudget::from), &stock, Texels::all(64), Seed::new(1))
}
