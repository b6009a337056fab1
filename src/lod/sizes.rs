//! The sizes at which a level may take over: shares of the screen's height that the tree's height covers.
//!
//! Silhouettes are compared on so many samples along the tree's height ([`lines`]), whole ones a pixel; so sizes that are
//! measured are those fractions. Where the preset tells a size, it is that size, and what is measured there is measured at the
//! nearest fraction.
//!
//! Of what is far wider than high, a ground cover, the width is what is seen: such plants have as many samples along the
//! [`FLAT`]th part of it ([`flatness`]), and their levels take over where that is as high as others' trees. With all of them
//! along its height a creeper of 0.4 by 10 metres took 4.6 GB and gave way to cards when it was 500 pixels wide.

use super::measure::{Measured, bounds};
use super::thin::LARGEST;
use crate::base::math::pow;
use crate::mesh::TreeMesh;
use crate::preset::plan::{Lod, LodBudget};

/// Lines of the screen that sizes are measured on.
pub(super) const SCREEN: f32 = 1080.0;
/// Samples along a tree's height where outlines are compared: of thinned levels, and of those that are seen from afar.
pub(super) const FINE: u32 = 540;
pub(super) const COARSE: u32 = 270;
/// How much smaller a level's tree is than where the level before took over, at least.
const STEP: f32 = 0.9;
/// Differences of IoU that are no reason to take over further away.
const ALIKE: f32 = 0.005;
/// By how much a level misses what it must at best that is nowhere like the tree, and which part of that is a difference that says
/// nothing then: the worse it is, the less hangs on where it is a little better.
const HOPELESS: f32 = -0.1;
const NOTHING: f32 = 0.2;
/// The most samples a pixel.
const MOST: usize = 64;
/// How many times as wide as high a plant is at most that is measured by its height.
const FLAT: f32 = 3.0;

/// Where a level may take over.
#[derive(Debug, PartialEq)]
pub(super) struct Sizes {
    /// In samples a pixel, growing; never empty.
    pub(super) measured: Vec<usize>,
    /// The very share, where there is nothing to be found.
    pub(super) told: Option<f32>,
}

impl Sizes {
    fn told((lod, flat): (&Lod, f32), share: f32) -> Self {
        let nearest = (lines(lod) as f32 * flat / (SCREEN * share)).round();
        Self { measured: vec![(nearest as usize).clamp(1, MOST)], told: Some(share) }
    }

    /// Those of them that are no smaller shares of the screen, or else the largest; what is told stays.
    pub(super) fn at_least(mut self, least: f32, (lod, flat): (&Lod, f32)) -> Self {
        let count = self.measured.iter().take_while(|&&size| share((lines(lod), flat), size) >= least * 0.999).count();
        if self.told.is_none() {
            self.measured.truncate(count.max(1));
        }
        self
    }
}

/// The share of the screen below which a level whose leaves are such a share of the tree's height dissolves: where they are
/// smaller than a pixel, an engine draws them by mips in which hardly anything of a leaf is left. Levels that have pictures of their own
/// take over before. (A spruce with leaves of 0.6 pixels showed 0.26 of itself, and gave way to a cloud that showed 0.88.)
pub(super) fn dissolves(lod: &Lod, leaf: f32) -> f32 {
    let enlarged = match *lod {
        Lod::Thinned { triangles, .. } => triangles.max(1e-3).sqrt().recip().min(LARGEST),
        _ => 1.0,
    };
    if leaf > 0.0 { (leaf * enlarged * SCREEN).recip() } else { 0.0 }
}

/// Which part a tree's height is of what its samples lie along, 0..=1: all of it, but of the flattest.
pub(super) fn flatness(tree: &TreeMesh) -> f32 {
    let (low, high) = bounds(tree);
    let (size, least) = (high - low, 1e-3);
    (size.y.max(least) * FLAT / size.x.max(size.z).max(least)).min(1.0)
}

/// Samples along a tree's height for a kind of level.
pub(super) fn lines(lod: &Lod) -> u32 {
    match lod {
        Lod::Full | Lod::Thinned { .. } => FINE,
        _ => COARSE,
    }
}

/// The share of the screen that a tree as flat as that covers whose pixels are so many of its samples wide.
pub(super) fn share((lines, flat): (u32, f32), size: usize) -> f32 {
    lines as f32 * flat / (size as f32 * SCREEN)
}

/// The sizes at which the first of some levels may take over: where the preset tells, or all below `above`, where the level
/// before did, and above what is told of a level further on.
pub(super) fn sizes(levels: &[LodBudget], above: f32, flat: f32) -> Sizes {
    let Some(LodBudget { lod, screen }) = levels.first() else { return Sizes { measured: vec![1], told: None } };
    if let Some(share) = *screen {
        return Sizes::told((lod, flat), share);
    }
    let next = levels.iter().enumerate().find_map(|(i, level)| Some((i, level.screen?)));
    let least = next.map_or(0.0, |(steps, share)| (0..steps).fold(share, |share, _| share / STEP));
    let all: &[usize] = match lod {
        Lod::Full => &[1],
        Lod::Thinned { .. } => &[2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 13, 15],
        Lod::BillboardCloud { .. } => &[3, 4, 5, 6, 7, 8, 9, 10, 12, 13, 15],
        Lod::CrossedQuads | Lod::Impostor { .. } => &[7, 8, 10, 12, 13, 15, 17, 19],
    };
    let lines = (lines(lod), flat);
    let may = |size: usize| share(lines, size) < above * STEP && share(lines, size) > least;
    let measured: Vec<usize> = all.iter().copied().filter(|&size| may(size)).collect();
    if !measured.is_empty() {
        return Sizes { measured, told: None };
    }
    match next {
        // Of the way down to what is told, as much as of the other levels before it.
        Some((steps, share)) => Sizes::told((lod, flat), above * pow(share / above, 1.0 / (steps + 1) as f32)),
        None => {
            let size = (lines.0 as f32 * flat / (SCREEN * above * STEP)) as usize + 1;
            if size <= MOST {
                Sizes { measured: vec![size], told: None }
            } else {
                Sizes::told((lod, flat), above * STEP)
            }
        }
    }
}

/// By how much a level agrees better with the full one than it must to take over; negative where it does not. Views of the
/// ladder are few; the bounds leave a margin for those between them.
pub(super) fn agrees(lod: &Lod, measured: &Measured) -> f32 {
    let (mean, worst) = match lod {
        Lod::CrossedQuads => (0.8, 0.5),
        // Of few views.
        Lod::Thinned { .. } => (0.922, 0.88),
        Lod::Impostor { .. } => (0.91, 0.867),
        _ => (0.912, 0.872),
    };
    (measured.iou - mean).min(measured.worst_iou - worst)
}

/// Which of some sizes, from the largest down, a level takes over at, by how much better than it must it agrees at each: the
/// first at which it agrees well enough; where it never does, the first that is about as good as the best. Small pictures are
/// not always more alike, since outlines are longer there for what they hold. What is nowhere like the tree is best seen small:
/// the last that is about as good.
pub(super) fn chosen(better: &[f32]) -> Option<usize> {
    let best = better.iter().copied().fold(f32::MIN, f32::max);
    if best < HOPELESS {
        return better.iter().rposition(|better| *better >= best * (1.0 + NOTHING));
    }
    let enough = if best >= 0.0 { 0.0 } else { best - ALIKE };
    better.iter().position(|better| *better >= enough)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lod::Outlines;
    use crate::mesh::Mesh;
    use glam::Vec3;

    #[test]
    fn a_level_takes_over_before_the_one_above_it_dissolves() {
        // Leaves a fiftieth as long as the tree, half as many again of a thinned one.
        assert!((dissolves(&Lod::Full, 0.02) * SCREEN - 50.0).abs() < 1e-3);
        assert!((dissolves(&Lod::thinned(0.4), 0.02) * SCREEN - 50.0 * 0.4_f32.sqrt()).abs() < 1e-3);
        assert!((dissolves(&Lod::thinned(0.01), 0.02) * SCREEN - 25.0).abs() < 1e-3);
        assert_eq!(dissolves(&Lod::Full, 0.0), 0.0);
        let all = || sizes(&[CLOUD.into()], 1.0, 1.0);
        assert_eq!(all().at_least(0.0, (&CLOUD, 1.0)), all());
        let fine = all().at_least(share((COARSE, 1.0), 6), (&CLOUD, 1.0));
        assert_eq!(fine, Sizes { measured: vec![3, 4, 5, 6], told: None });
        assert_eq!(all().at_least(f32::INFINITY, (&CLOUD, 1.0)).measured, [3]);
        let told = || sizes(&[at(CLOUD, 0.02)], 1.0, 1.0);
        assert_eq!(told().at_least(0.5, (&CLOUD, 1.0)), told());
    }

    #[test]
    fn what_is_far_wider_than_high_is_measured_by_its_width() {
        let mesh = |wide: f32| {
            let positions = vec![Vec3::ZERO, Vec3::new(wide, 1.0, 0.1)];
            TreeMesh { bark: Mesh { positions, ..Mesh::default() }, ..TreeMesh::default() }
        };
        assert_eq!([0.1, 1.0, 3.0, 30.0].map(|wide| flatness(&mesh(wide))), [1.0, 1.0, 1.0, 0.1]);
        // Told shares are those of its height, and it may take over at those that others may, of that part of its width.
        assert_eq!(sizes(&[at(CLOUD, 0.02)], 1.0, 0.1), Sizes { measured: vec![1], told: Some(0.02) });
        assert_eq!(sizes(&[CLOUD.into()], 0.1, 0.1), sizes(&[CLOUD.into()], 1.0, 1.0));
        assert!((share((COARSE, 0.1), 3) - 0.1 * share((COARSE, 1.0), 3)).abs() < 1e-6);
        let bytes = |wide: f32| Outlines::new(&mesh(wide), &[], 540.0 * flatness(&mesh(wide)), 4).weight();
        assert!(bytes(300.0) < 2 * bytes(3.0), "{} {}", bytes(300.0), bytes(3.0));
    }

    const THINNED: Lod = Lod::thinned(0.4);
    const CLOUD: Lod = Lod::BillboardCloud { cards: 12 };

    fn at(lod: Lod, screen: f32) -> LodBudget {
        LodBudget { lod, screen: Some(screen) }
    }

    #[test]
    fn what_the_preset_tells_is_taken_and_measured_nearby() {
        assert_eq!(sizes(&[at(THINNED, 0.25)], 1.0, 1.0), Sizes { measured: vec![2], told: Some(0.25) });
        assert_eq!(sizes(&[at(CLOUD, 0.9)], 1.0, 1.0), Sizes { measured: vec![1], told: Some(0.9) });
        assert_eq!(sizes(&[at(CLOUD, 0.002)], 1.0, 1.0), Sizes { measured: vec![64], told: Some(0.002) });
    }

    #[test]
    fn what_is_sought_lies_between_the_level_before_and_what_is_told_further_on() {
        let found = sizes(&[THINNED.into(), CLOUD.into(), at(Lod::CrossedQuads, 0.1)], 0.3, 1.0);
        assert_eq!(found, Sizes { measured: vec![2, 3, 4], told: None });
        for size in found.measured {
            let size = share((FINE, 1.0), size);
            assert!(size < 0.3 * STEP && size > 0.1 / (STEP * STEP));
        }
    }

    #[test]
    fn a_level_takes_over_where_it_agrees_or_where_it_is_about_best() {
        assert_eq!(chosen(&[-0.1, 0.0, 0.1]), Some(1));
        assert_eq!(chosen(&[-0.1, -0.004, -0.001, -0.002]), Some(1));
        assert_eq!(chosen(&[-0.1, -0.02, -0.01]), Some(2));
        assert_eq!((chosen(&[f32::NAN, -0.3]), chosen(&[])), (Some(1), None));
        // Unlike the tree at all sizes: as far away as it is no worse.
        assert_eq!(chosen(&[-0.58, -0.57, -0.59, -0.71]), Some(2));
        assert_eq!((chosen(&[-0.47, -0.53, -0.52]), chosen(&[-0.14, -0.2, -0.19])), (Some(2), Some(0)));
    }

    #[test]
    fn levels_fall_from_one_to_the_next_however_narrow_it_is() {
        for told in [0.99, 0.5, 0.0021] {
            let levels = [THINNED.into(), CLOUD.into(), at(THINNED, told), CLOUD.into(), Lod::CrossedQuads.into()];
            let mut above = 1.0;
            for i in 0..levels.len() {
                let found = sizes(&levels[i..], above, 1.0);
                let least =
                    found.told.unwrap_or_else(|| share((lines(&levels[i].lod), 1.0), *found.measured.last().unwrap()));
                assert!(
                    least < above && least >= if i < 3 { told } else { 0.0 },
                    "{i} of {told}: {found:?} below {above}"
                );
                above = least;
            }
        }
    }
}
