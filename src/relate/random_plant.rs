//! Random plants for tests: several stems, deep orders, folds, segments and whole chains without length, leaves.

use glam::Vec3;

use crate::base::{Rotation, Seed};
use crate::plant::{ChainId, Leaf, LeafForm, Plant, PlantBuilder};

/// How odd a random plant is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Oddity {
    /// Wavy, tapering axes with distinct points.
    Tame,
    /// Folds, doubled points, chains without length, zero radii, locations at the ends, children thicker than parents.
    Wild,
}

/// A plant of up to `most` chains.
pub(crate) fn random_plant(seed: Seed, most: usize, oddity: Oddity) -> Plant {
    let wild = oddity == Oddity::Wild;
    let mut builder = PlantBuilder::new();
    let stems = if most > 4 { 1 + seed.child("stems").index(3) } else { 1 };
    let count = stems + seed.child("count").index(most.saturating_sub(stems) + 1);
    // Length, base radius and order of each chain.
    let mut made: Vec<(f32, f32, u32)> = Vec::new();
    for i in 0..count {
        let s = seed.child("chain").at(i as u64);
        let parent = (i >= stems).then(|| {
            // The last of a few draws leans to late chains: deep orders.
            let draw = s.child("parent");
            if draw.at(0).unit() < 0.5 { draw.at(1).index(i) } else { i - 1 - draw.at(2).index(i.min(3)) }
        });
        let (length, radius, order) = match parent {
            None => (s.child("l").range(2.0, 8.0), s.child("r").range(0.05, 0.3), 1),
            Some(p) => {
                let (l, r, o) = made[p];
                (l * s.child("l").range(0.2, 0.8), r * s.child("r").range(0.2, if wild { 1.4 } else { 0.8 }), o + 1)
            }
        };
        let odd = if wild { s.child("odd").index(8) } else { 8 };
        let direction = if parent.is_none() { Vec3::Y } else { (s.direction() + Vec3::Y * 0.3).normalize_or(Vec3::X) };
        let n = 2 + s.child("n").index(12);
        let mut points = vec![Vec3::ZERO];
        let mut radii = vec![radius];
        for j in 1..n {
            let at = s.child("point").at(j as u64);
            let step = (direction + at.direction() * 0.5) * (length / (n - 1) as f32);
            let step = match odd {
                0 => Vec3::ZERO,
                1 if j % 2 == 0 => Vec3::ZERO,
                2 if j > n / 2 => points[n - j] - points[j - 1],
                3 if j % 2 == 0 => -(points[j - 1] - points[j - 2]),
                4 => step * 1e-7,
                _ => step,
            };
            points.push(points[j - 1] + step);
            let taper = 1.0 - 0.8 * j as f32 / (n - 1) as f32;
            radii.push(if odd == 5 && j + 1 == n { 0.0 } else { radius * taper });
        }
        let location = match odd {
            6 => 0.0,
            7 => 1.0,
            _ => s.child("location").range(0.1, 1.0),
        };
        match parent {
            None => builder.stem(s.child("origin").direction() * Vec3::new(2.0, 0.0, 2.0), &points, &radii),
            Some(p) => builder.branch(ChainId(p as u32), location, &points, &radii),
        };
        made.push((length, radius, order));
    }
    for i in 0..seed.child("leaves").index(30) {
        let s = seed.child("leaf").at(i as u64);
        let leaf = Leaf::new(
            ChainId(s.child("chain").index(count) as u32),
            s.child("location").unit(),
            Rotation::about(s.direction(), s.child("angle").range(-3.0, 3.0)),
            s.child("size").range(0.0, 0.2),
            s.child("slot").index(4) as u16,
        );
        let own = Leaf { offset: s.child("offset").direction() * 0.05, form: LeafForm::Flat(0.7), ..leaf };
        builder.leaf(if s.child("own").unit() < 0.3 { own } else { leaf });
    }
    builder.finish().expect("a random plant is a plant")
}
