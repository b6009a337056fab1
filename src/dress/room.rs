//! Where foliage has room beside obstacles.
//!
//! Twigs grow where wood may: outside of the clearance, and through no wall. Leaves stand off their twigs, so a leaf is turned
//! about its twig until its card keeps the clearance too; where no way of turning does, the way that keeps it best is
//! taken, and a leaf that reaches into an obstacle whichever way it is turned is left out. Coarser levels of detail enlarge the
//! leaves that they keep, so ways in which the leaf may grow come first.
//!
//! Limits: a card is told by points at its edges and by the lines between them, so the corner of a box that is thinner than a
//! third of a leaf may poke through one.

use glam::Vec3;

use crate::source::grow::Obstacles;

/// How much coarser levels are likely to enlarge a leaf.
const ENLARGED: f32 = 1.7;
/// How far the halves of a folded card lie behind a flat one's at its sides, in sizes.
const BEHIND: f32 = 0.2;
/// What a leaf that has no room to be enlarged counts, in points within the clearance.
const NARROW: u32 = 6;
/// Where points of a card lie, along and across, in sizes.
const ALONG: [f32; 4] = [0.0, 0.34, 0.67, 1.0];
const ACROSS: [f32; 3] = [-0.5, 0.0, 0.5];

/// A leaf's card: a square from its base on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Card {
    pub(super) base: Vec3,
    /// Across, along, and out of its upper face.
    pub(super) axes: [Vec3; 3],
    pub(super) size: f32,
}

impl Card {
    /// The height of its lowest corner, however far it is folded.
    pub(super) fn lowest(&self) -> f32 {
        let corners = [0.0, 1.0].into_iter().flat_map(|along| [-0.5, 0.5].map(|across| (along, across)));
        corners.map(|(u, v)| self.at(u, v, 0.0).y.min(self.at(u, v, 1.0).y)).fold(f32::MAX, f32::min)
    }

    /// A point of it folded back by so much of what folded cards are.
    fn at(&self, along: f32, across: f32, fold: f32) -> Vec3 {
        let [x, y, z] = self.axes;
        self.base + (y * along + x * across - z * (across.abs() * 2.0 * BEHIND * fold)) * self.size
    }

    fn points(&self, fold: f32) -> impl Iterator<Item = Vec3> {
        ALONG.into_iter().flat_map(move |along| ACROSS.into_iter().map(move |across| self.at(along, across, fold)))
    }

    fn grown(&self, by: f32) -> Self {
        Self { size: self.size * by, ..*self }
    }
}

/// What is left beside obstacles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room<'a>(Option<&'a Obstacles>);

impl<'a> Room<'a> {
    /// Outside of those obstacles.
    pub(super) fn among(obstacles: &'a Obstacles) -> Self {
        Self(Some(obstacles).filter(|obstacles| !obstacles.is_empty()))
    }

    /// Whether a place keeps the clearance.
    pub(super) fn has(self, p: Vec3) -> bool {
        self.0.is_none_or(|obstacles| obstacles.free(p))
    }

    /// Whether a twig may grow from one place to another.
    pub(super) fn lets(self, from: Vec3, to: Vec3) -> bool {
        self.0.is_none_or(|obstacles| obstacles.free(to) && !obstacles.bar(from, to))
    }

    /// The first way to lie that keeps the clearance, or that which keeps it best; none where all meet an obstacle.
    pub(super) fn first_free<T: Copy>(self, mut ways: impl Iterator<Item = T>, card: impl Fn(T) -> Card) -> Option<T> {
        let Some(obstacles) = self.0 else { return ways.next() };
        let mut best: Option<(u32, T)> = None;
        for way in ways {
            let card = card(way);
            if meets(obstacles, &card) {
                continue;
            }
            let narrow = if meets(obstacles, &card.grown(ENLARGED)) { NARROW } else { 0 };
            let near = card.points(0.0).filter(|p| !obstacles.free(*p)).count() as u32;
            if best.is_none_or(|(least, _)| narrow + near < least) {
                best = Some((narrow + near, way));
            }
            if narrow + near == 0 {
                break;
            }
        }
        best.map(|(_, way)| way)
    }
}

/// Whether a card, flat or folded, reaches into an obstacle.
fn meets(obstacles: &Obstacles, card: &Card) -> bool {
    [0.0, 1.0].into_iter().any(|fold| {
        let lines = |along: f32| ACROSS.map(|across| (card.base, card.at(along, across, fold)));
        card.points(fold).any(|p| obstacles.hold(p))
            || ALONG.into_iter().flat_map(lines).any(|(from, to)| obstacles.bar(from, to))
            || obstacles.bar(card.at(1.0, -0.5, fold), card.at(1.0, 0.5, fold))
            || [-0.5, 0.5].into_iter().any(|side| obstacles.bar(card.at(0.0, side, fold), card.at(1.0, side, fold)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::dress::tests::{params, tree};
    use crate::dress::{dress, dress_among};
    use crate::plant::Plant;
    use crate::preset::plan::{DressParams, Obstacle, Phyllotaxis};
    use crate::source::grow::ObstacleMeshes;

    /// A closed wall of four metres by eight by 0.1, askew, a metre and a half from the trunk.
    fn askew() -> (Obstacle, ObstacleMeshes) {
        let (out, along) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.8, 0.0, 0.6));
        let corner = |i: usize| {
            let bit = |k: usize| (i >> k & 1) as f32;
            out * (1.5 + 0.1 * bit(0)) + along * (8.0 * bit(1) - 4.0) + Vec3::Y * (9.0 * bit(2))
        };
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let halves = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]];
        let triangles = faces.into_iter().flat_map(halves).map(|t| t.map(corner)).collect();
        let named = Obstacle::Mesh { file: "wall.glb".to_owned(), at: [0.0; 3] };
        (named, ObstacleMeshes::from([("wall.glb".to_owned(), triangles)]))
    }

    /// Leaves that reach into obstacles, and the share of points of leaves within the clearance.
    fn crowded(plant: &Plant, obstacles: &Obstacles) -> (usize, f32) {
        let posed = plant.pose();
        let (mut into, mut near) = (0, 0);
        for leaf in plant.leaves() {
            let pose = posed.leaf(plant, leaf);
            let axes = [pose.frame.x, pose.frame.y, pose.frame.z];
            let card = Card { base: pose.position, axes, size: leaf.size };
            // Finer than what is looked at.
            let fine = (0..=144).map(|i| card.at((i % 12) as f32 / 12.0, (i / 12) as f32 / 12.0 - 0.5, 0.0));
            into += usize::from(meets(obstacles, &card) || fine.clone().any(|p| obstacles.hold(p)));
            near += fine.filter(|p| !obstacles.free(*p)).count();
        }
        (into, near as f32 / (145 * plant.leaves().len()) as f32)
    }

    #[test]
    fn no_leaf_reaches_into_an_obstacle_and_few_into_the_clearance() {
        let bare = tree(8.0, 24);
        let wall = |x: f32, wide: f32| Obstacle::Box { low: [x, 0.0, -9.0], high: [x + wide, 9.0, 9.0] };
        let none = ObstacleMeshes::new();
        let rows = DressParams { twig_length: 0.0, phyllotaxis: Phyllotaxis::Distichous, leaf_size: 0.6, ..params() };
        let (mesh, meshes) = askew();
        for (what, obstacle, meshes, clearance, params) in [
            ("wall", wall(2.0, 2.0), &none, 0.3, params()),
            ("fence", wall(2.0, 0.02), &none, 0.1, params()),
            ("rows", wall(2.0, 1.0), &none, 0.1, rows),
            ("mesh", mesh, &meshes, 0.2, params()),
        ] {
            let obstacles = Obstacles::of(&[obstacle], clearance, meshes).unwrap();
            let (free, among) =
                (dress(&bare, &params, Seed::new(1)), dress_among(&bare, &params, &obstacles, Seed::new(1)));
            let (before, now) = (crowded(&free, &obstacles), crowded(&among, &obstacles));
            assert!(before.0 > 2 && before.1 > 0.002, "{what}: {before:?}");
            assert!(now.0 == 0 && now.1 < 0.3 * before.1, "{what}: {before:?} {now:?}");
            // Its twigs end in the air, too, and it is not bare for it.
            let (own, posed) = (bare.chains().len(), among.pose());
            let mut ends = among.chain_ids().skip(own).filter_map(|id| posed.chain(&among, id).last().copied());
            assert!(ends.all(|p| obstacles.free(p)), "{what}");
            let (few, many) = (among.leaves().len(), free.leaves().len());
            assert!(few * 10 > many * 8, "{what}: {few} of {many}");
        }
    }

    #[test]
    fn what_is_far_away_changes_nothing() {
        let (bare, far) = (tree(5.0, 8), Obstacle::Box { low: [30.0, 0.0, -9.0], high: [40.0, 9.0, 9.0] });
        let obstacles = Obstacles::of(&[far], 0.5, &ObstacleMeshes::new()).unwrap();
        assert!(dress(&bare, &params(), Seed::new(1)) == dress_among(&bare, &params(), &obstacles, Seed::new(1)));
    }
}
